"""Smoothing of realistic data: irregular, long, with gaps, copies and rounding, and with failing curves."""

import numpy as np
import pytest
from noisy import rms
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss


def wave(name, t, rng):
    space = ss.space(name)
    rates, phases = rng.uniform(0.5, 2, 3), rng.uniform(0, 2 * np.pi, 3)
    u = np.sin(2 * np.pi * rates * t[:, None] + phases)
    if name == "r:2":
        return space, u[:, :2]
    if name == "sphere:2":
        return space, space.project(0.6 * u + [0, 0, 1])
    still = np.broadcast_to(np.eye(3), (len(t), 3, 3))
    return space, space.exp(still, ss.rotations.velocities(still, 0.8 * u))


def recorded(name, n, seed, sigma=0.05):
    rng = np.random.default_rng([seed, n, 7])
    t = np.sort(rng.random(n))
    t = (t - t[0]) / (t[-1] - t[0])
    space, truth = wave(name, t, rng)
    noisy = space.exp(truth, sigma * space.random_tangent(rng, truth))
    return space, t, truth, noisy


def test_an_outlier_beside_a_gap():
    """A body that turns between three bursts. No spline joins the points of a curve through the outlier."""
    t = [0, 0.0001, 0.0004, 0.0011, 0.0066, 0.008, 0.0081, 0.4977, 0.5016, 0.502, 0.5037]
    t += [0.9907, 0.9914, 0.9914, 0.9915, 0.9936, 0.9936, 0.9968, 0.9984, 1]
    words = (
        "94 55 7  96 56 7  95 54 6  95 57 7  97 56 8  95 57 7  97 57 7  -137 -121 -16  -15 48 15  -14 47 16  -13 "
        "48 16  -47 -32 20  -47 -33 20  -46 -34 21  -47 -33 22  -46 -32 21  -47 -33 22  -46 -32 20  -45 -34 20 "
        "-46 -33 21 "
    )
    noisy = ss.rotations.from_rotation_vectors(np.reshape(words.split(), (20, 3)).astype(float) / 100)
    raises("no spline joins", ss.make_smoothing_spline, t, noisy, "so:3", error=ss.ConvergenceError)
    spline = ss.make_smoothing_spline(t, noisy, "so:3", loss="huber")
    distances = ss.SpecialOrthogonal(3).distance(spline(t), noisy)
    assert spline.report.converged and np.delete(distances, 7).max() < 0.03 < 2 < distances[7]


def test_knots_that_end_a_rounding_before_the_data():
    rng = np.random.default_rng(3)
    beside = 0
    for _ in range(300):
        a, b = np.sort(rng.normal(size=2) * 10 ** rng.uniform(-3, 3))
        t = np.sort(np.r_[a, rng.uniform(a, b, 30), b])
        knots = a + (b - a) * np.linspace(0, 1, 6)
        beside += knots[-1] < b
        spline = ss.make_lsq_spline(t, np.sin(t)[:, None], knots, "r:1")
        assert spline.t[-1] == b
    assert beside
    raises("knots must reach", ss.make_lsq_spline, [0, 0.4, 0.7, 1], np.zeros((4, 1)), [0, 0.5, 1 - 1e-12], "r:1")


def drive(length, rng, n=600):
    """Poses of a car that winds along a road: times, attitudes, positions."""
    t = np.linspace(0, 60, n)
    path = length * np.stack([t / 60, 0.03 * np.sin(0.6 * t + rng.random()), 0 * t], axis=-1)
    forward = np.gradient(path, t, axis=0)
    forward /= np.linalg.norm(forward, axis=-1, keepdims=True)
    left = np.cross([0.0, 0, 1], forward)
    left /= np.linalg.norm(left, axis=-1, keepdims=True)
    return t, np.stack([forward, left, np.cross(forward, left)], axis=-1), path


# The ends turn, which natural ends do not follow.
@pytest.mark.filterwarnings("ignore:.*the residuals are larger between:symspline.SmoothingWarning")
@pytest.mark.parametrize("length", [1.0, 1000.0])
@pytest.mark.parametrize(("unit", "knots"), [(1.0, 240), (1000.0, None)])
def test_poses_are_as_good_as_their_parts(length, unit, knots):
    so3, rng = ss.space("so:3"), np.random.default_rng(1)
    t, attitudes, path = drive(length, rng)
    turned = so3.exp(attitudes, ss.rotations.velocities(attitudes, 0.005 * rng.standard_normal((600, 3))))
    moved = unit * (path + 0.005 * rng.standard_normal((600, 3)))
    poses = ss.poses.join(turned, moved)
    smooth = ss.make_smoothing_spline(t, poses, "se:3", knots=knots)
    parts = ss.make_smoothing_spline(t, (turned, moved), "so:3 x r:3", knots=knots)
    assert smooth.sigma == pytest.approx((0.005, 0.005 * unit), rel=0.1)
    # Between the knots, too.
    x = 0.5 * (t[1:] + t[:-1])
    dense = ss.CubicSpline(t, path, "r:3", bc_type="not-a-knot")(x)
    errors = [np.sqrt(np.mean((p / unit - dense) ** 2)) for p in (smooth(x)[:, :3, 3], parts(x)[1])]
    assert errors[0] < 1.25 * errors[1] < 0.005
    turns = [so3.distance(r, parts(x)[0]).max() for r in (smooth(x)[:, :3, :3],)]
    assert turns[0] < 1e-4
    # Each part has its own numbers.
    assert smooth.lam == parts.lam and smooth.df == parts.df
    assert smooth.std(x) == pytest.approx(np.array(parts.std(x))) and len(smooth.band(x)) == 2
    assert smooth.residuals.shape == poses.shape


# The matrices belong to other frames than those of the rotations and positions, and one part has little noise.
@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
def test_poses_take_matrices_velocities_and_files(tmp_path):
    se3, rng = ss.space("se:3"), np.random.default_rng(2)
    t, attitudes, path = drive(20.0, rng, 200)
    truth = ss.poses.join(attitudes, path)
    frames = se3.frame(truth)
    deviations = np.r_[0.02, 0.02, 0.02, 0.01, 0.1, 0.1]
    noisy = se3.exp(truth, np.einsum("ni,nijk->njk", rng.standard_normal((200, 6)) * deviations, frames))
    weights = np.tile(np.diag(1 / deviations**2), (200, 1, 1))
    start = ss.CubicSpline(t, truth, se3, bc_type="not-a-knot")(0.0, nu=1)
    start = se3.project_tangent(noisy[0], noisy[0] @ np.linalg.inv(truth[0]) @ start)
    informed = ss.make_smoothing_spline(t, noisy, se3, weights=weights, bc_type=((1, start), "natural"))
    assert informed.sigma == pytest.approx((1, 1), rel=0.15)
    # Transported with the attitude and the position, each by itself.
    assert np.abs(informed(0.0, nu=1)[:3, 3] - start[:3, 3]).max() < 1e-9
    pair = (np.ones(200), np.where(np.arange(200) == 3, 0.0, 1.0))
    apart = ss.make_smoothing_spline(t, noisy, se3, (1.0, 2.0), weights=pair)
    assert apart.lam == pytest.approx((1.0, 2.0))
    for spline in (informed, apart):
        spline.save(tmp_path / "poses.npz")
        back = ss.load(tmp_path / "poses.npz")
        assert back == spline and back.report == spline.report
        assert np.array_equal(back.std(t), spline.std(t))
    both = ss.make_smoothing_spline(t, (noisy, path), "se:3 x r:3", loss="huber")
    assert len(both.lam) == 3
    with pytest.raises(ss.ValidationError, match="`lam` has 2 entries, but there are 3 parts"):
        ss.make_smoothing_spline(t, (noisy, path), "se:3 x r:3", (1.0, 2.0))


def test_a_bad_curve_does_not_stop_a_batch():
    space, t, _, noisy = recorded("sphere:2", 40, 0)
    batch = np.stack([noisy, np.full_like(noisy, np.nan), noisy[::-1], 2 * noisy])
    raises(r"of curve 1", ss.make_smoothing_spline, t, batch, space)
    found = ss.make_smoothing_spline(t, batch, space, on_failure="ignore")
    with pytest.warns(ss.ConvergenceWarning, match=r"curve 1.*1 more"):
        ss.make_smoothing_spline(t, batch, space, on_failure="warn")
    chosen = ss.make_smoothing_spline(t, batch, space, where=[True, False, True, False])
    for spline in (found, chosen):
        assert spline.report.converged.tolist() == [True, False, True, False]
        assert np.isnan(spline(0.5)[[1, 3]]).all() and np.isnan(spline.lam[[1, 3]]).all()
        assert np.isnan(spline.std(0.5)[[1, 3]]).all() and np.isnan(spline.residuals[[1, 3]]).all()
        for i, data in ((0, noisy), (2, noisy[::-1])):
            alone = ss.make_smoothing_spline(t, data, space)
            assert alone == spline[i] and alone.report == spline[i].report
            assert np.array_equal(alone.std(0.3), spline[i].std(0.3))
    raises("where must be", ss.make_smoothing_spline, t, batch, space, where=[True])
    nothing = ss.make_smoothing_spline(t, batch, space, where=np.zeros(4, bool))
    assert np.isnan(nothing(0.5)).all()
    weighted = ss.make_smoothing_spline(t, batch, space, where=np.zeros(4, bool), weights=np.ones((4, 40)))
    assert np.isnan(weighted(0.5)).all()


def test_missing_samples_are_the_same_alone_and_in_a_batch():
    space, t, _, noisy = recorded("so:3", 50, 1)
    weights = np.ones((3, 50))
    weights[0, :4], weights[1, 20:30], weights[2, 44:] = 0, 0, 0
    batch = np.where(weights[:, :, None, None] > 0, noisy, np.nan)
    together = ss.make_smoothing_spline(t, batch, space, weights=weights)
    for k in range(3):
        alone = ss.make_smoothing_spline(t, batch[k], space, weights=weights[k])
        assert alone == together[k] and alone.lam == together.lam[k]
    shared = ss.make_smoothing_spline(t, np.stack([batch[1], batch[1]]), space, weights=weights[1])
    assert shared[0] == together[1]
    # A curve without any data is a bad one.
    weights[2] = 0
    rest = ss.make_smoothing_spline(t, batch, space, weights=weights, on_failure="ignore")
    assert rest[0] == together[0] and not rest.report.converged[2]
    raises("curve 2", ss.make_smoothing_spline, t, batch, space, weights=weights)


def far_apart():
    """Three bursts of a turning body: between two of them it turns by more than a segment between two knots can."""
    rng = np.random.default_rng([21, 20, 0, 4, 6])
    centres = np.sort(rng.random(3))
    t = np.sort(centres[rng.integers(0, 3, 20)] + 0.01 * rng.standard_normal(20))
    t = (t - t[0]) / (t[-1] - t[0])
    rates, phases = rng.uniform(0.5, 2, 3), rng.uniform(0, 6.28, 3)
    turns = 0.8 * np.stack([np.sin(2 * np.pi * rates[i] * t + phases[i]) for i in range(3)], -1)
    space, still = ss.space("so:3"), np.broadcast_to(np.eye(3), (20, 3, 3))
    truth = space.exp(still, ss.rotations.velocities(still, turns))
    return space, t, truth, space.exp(truth, 0.05 * space.random_tangent(rng, truth))


def test_a_gap_that_one_segment_cannot_cross():
    space, t, truth, noisy = far_apart()
    for loss in ("linear", "huber", "cauchy"):
        spline = ss.make_smoothing_spline(t, noisy, space, loss=loss)
        assert rms(space, spline(t), truth) < 0.06


def test_the_advice_of_messages_helps():
    space, t, truth, noisy = far_apart()
    times = np.unique(t)
    with pytest.raises(ss.ConvergenceError, match="Pass more knots in the gaps"):
        ss.make_smoothing_spline(t, noisy, space, knots=times)
    more = ss.make_smoothing_spline(t, noisy, space, knots=np.union1d(times, np.linspace(0, 1, 13)))
    assert more.report.converged and rms(space, more(t), truth) < 0.06
    assert ss.make_smoothing_spline(t, noisy, space, 1e-3, knots=times).report.converged

    space, t, _, noisy = recorded("sphere:2", 40, 0)
    with pytest.raises(ss.ConvergenceError, match="there must be data near every knot: pass fewer knots"):
        ss.make_lsq_spline(t, noisy, np.linspace(0, 1, 60), space)
    assert ss.make_lsq_spline(t, noisy, 8, space).report.converged
    with pytest.raises(ss.ConvergenceError, match="Raise max_iter or pass method='newton'"):
        ss.make_smoothing_spline(t, noisy, space, max_iter=2)
    for advice in ({"max_iter": 50}, {"method": "newton"}):
        assert ss.make_smoothing_spline(t, noisy, space, **advice).report.converged
    with pytest.raises(ss.ConvergenceError) as caught:
        ss.make_smoothing_spline(t, noisy, space, max_iter=2, method="newton")
    # What was tried already is not proposed again.
    assert "method='newton'" not in str(caught.value)


@pytest.mark.filterwarnings("ignore:The smoothing chose the largest lam:symspline.SmoothingWarning")
def test_knots_without_data_and_the_jerk():
    space, t, noisy, weights = with_gap("r:2", 0.5, 2, n=3000)
    options = {"weights": weights, "penalty": "jerk"}
    # Most knots in the gap are removed, because λ/h⁵ would exceed the precision of numbers.
    own = ss.make_smoothing_spline(t, noisy, space, **options)
    given = ss.make_smoothing_spline(t, noisy, space, knots=500, **options)
    assert own.report.converged and given.report.converged
    assert np.all(np.linalg.norm(own(t) - given(t), axis=-1) < 0.2 * own.std(t, calibrated=False))
    options["weights"] = 1.0 - weights
    assert ss.make_smoothing_spline(t, noisy, space, **options).report.converged
    assert ss.make_smoothing_spline(t[weights == 0], noisy[weights == 0], space, penalty="jerk").report.converged
    options["weights"] = np.where(np.arange(3000) < 2, 1.0, 0.0)
    with pytest.raises(ss.ConvergenceError, match="needs at least 3 data, not 2"):
        ss.make_smoothing_spline(t, noisy, space, **options)
    with pytest.raises(ss.ConvergenceError, match="there must be data near every knot: pass fewer knots"):
        ss.make_smoothing_spline(t[:60], noisy[:60], space, 0.0, penalty="jerk", knots=np.linspace(t[0], t[59], 90))


def vibration(n, cycle, rng):
    """Irregular times, and rotation vectors that oscillate with a given number of data per cycle."""
    t = np.cumsum(rng.uniform(0.8, 1.2, n))
    phase = 2 * np.pi * t / cycle
    return t, np.stack([np.sin(phase), np.cos(0.9 * phase), np.sin(0.8 * phase + 1)], axis=-1)


# The amplitude of closed curves varies.
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*the residuals are larger between:symspline.SmoothingWarning")
@pytest.mark.parametrize(
    ("name", "variant"),
    [("so:3", "closed"), ("sphere:2 x r:3", "weights")],
)
def test_motion_that_is_fast_for_the_length_of_a_recording_is_no_noise(name, variant):
    """18 000 data with 2600 cycles, which 2000 knots do not resolve."""
    rng = np.random.default_rng(5)
    t, angle = vibration(18_000, 7, rng)
    if variant == "closed":
        angle *= np.sin(np.linspace(0, np.pi, len(t)))[:, None]
    space, noise = ss.space(name), 0.02 * rng.normal(size=(2, *angle.shape))
    rotations = (Rotation.from_rotvec(0.3 * angle) * Rotation.from_rotvec(noise[0])).as_matrix()
    positions = 40 * (angle + noise[1])
    data = rotations if name == "so:3" else (rotations[:, 0], positions)
    options = {"bc_type": "periodic"} if variant == "closed" else {}
    if variant == "weights":
        options["weights"] = np.where(np.arange(len(t)) % 900 < 2, 0.0, 1.0)
    spline = ss.make_smoothing_spline(t, data, space, **options)
    expected = len(t) / 7
    assert np.all(np.ravel(spline.df) > 1.2 * expected), spline


def test_motion_between_rests_is_no_noise():
    """4 s of fast motion in 1000 s. No part of the recording that begins at an even time contains it."""
    rng = np.random.default_rng(0)
    t, angle = vibration(30_000, 12, rng)
    moving = slice(9_300, 9_700)
    angle[: moving.start] = angle[moving.start]
    angle[moving.stop :] = angle[moving.stop - 1]
    data = angle + 0.02 * rng.normal(size=angle.shape)
    with pytest.warns(ss.SmoothingWarning, match="the motion is faster between t = 9"):
        spline = ss.make_smoothing_spline(t, data, "r:3")
    assert rms(spline.space, spline(t[moving]), angle[moving]) < 0.2


def test_the_gap_in_which_a_curve_is_free_to_turn_is_named():
    t, angle = vibration(80, 20, np.random.default_rng(2))
    t[30:] += 40
    turns = Rotation.from_rotvec(angle).as_matrix()
    expected = r"between t = [23]\d\..* and 7\d\..*: cut the recording.*fit_segments"
    raises(expected, ss.make_smoothing_spline, t, turns, "so:3", max_iter=4, error=ss.ConvergenceError)


def test_long_recordings_with_few_weights():
    """Parts of a recording have enough data in every curve and factor, or there are no parts."""
    rng = np.random.default_rng(3)
    t, angle = vibration(6_000, 40, rng)
    data = angle[:, :2] + 0.05 * rng.normal(size=(len(t), 2))
    for step in (400, 100):
        few = np.where(np.arange(len(t)) % step == 0, 1.0, 0.0)
        spline = ss.make_smoothing_spline(t, data, "r:2", lam=1e3, weights=few)
        short = ss.make_smoothing_spline(t[::step], data[::step], "r:2", lam=1e3)
        assert spline.df == pytest.approx(short.df, rel=0.01)
    once = ss.make_smoothing_spline(t, data, "r:2")
    half = np.where((np.arange(len(t)) > 1000) & (np.arange(len(t)) < 5000), 0.0, 1.0)
    both = ss.make_smoothing_spline(t, (data, data), "r:2 x r:2", weights=(np.ones(len(t)), half))
    assert both.df[0] == pytest.approx(once.df, rel=0.01) and 0.2 * once.df < both.df[1] < 0.5 * once.df
    batch = ss.make_smoothing_spline(t, np.stack([data, data]), "r:2", weights=np.stack([np.ones(len(t)), half]))
    np.testing.assert_allclose(batch.df, both.df, rtol=0.01)
    information = np.broadcast_to(np.diag([1.0, 4.0]), (2, len(t), 2, 2))
    assert np.all(ss.make_smoothing_spline(t, np.stack([data, data]), "r:2", weights=information).df > 150)


@pytest.mark.parametrize("name", ["r:2", "sphere:2", "so:3", "se:3", "sphere:2 x r:3"])
@pytest.mark.parametrize("loss", ["linear", "huber"])
def test_curves_are_geodesics_before_and_after_their_data(name, loss):
    """Data with weight in the middle tenth: the curve is that of these data, and the same λ is chosen."""
    space, rng = ss.space(name), np.random.default_rng(7)
    n = 1500
    t = np.cumsum(rng.exponential(0.01, n))
    points = []
    for part in getattr(space, "factors", [space]):
        p = part.random_point(rng)
        v, w = part.random_tangent(rng, np.stack([p, p]))
        around = np.sin(t)[:, None] * v.reshape(1, -1) + np.cos(2 * t)[:, None] * w.reshape(1, -1)
        truth = part.exp(p, 0.4 * around.reshape(n, *p.shape))
        points.append(part.exp(truth, 0.02 * part.random_tangent(rng, truth)))
    points = tuple(points) if len(points) > 1 else points[0]
    rows = slice(700, 850)
    weights = np.zeros(n)
    weights[rows] = 1
    inner = tuple(own[rows] for own in points) if isinstance(points, tuple) else points[rows]
    alone = ss.make_smoothing_spline(t[rows], inner, space, loss=loss)
    spline = ss.make_smoothing_spline(t, points, space, weights=weights, loss=loss)
    np.testing.assert_allclose(spline.lam, alone.lam, rtol=1e-9)
    np.testing.assert_allclose(spline.df, alone.df, rtol=1e-9)
    assert np.max(space.distance(spline(t[rows]), alone(t[rows]))) < 1e-9
    if name != "se:3":
        # Its geodesics are those of so:3 x r:3 at the knots.
        np.testing.assert_allclose(spline.speed(t[[0, -1]]), alone.speed(t[[700, 849]]), rtol=1e-9)
        assert np.max(space.norm(spline(t[:600]), spline(t[:600], 2))) < 1e-4
    # Standard errors are the same at the data, and grow without them.
    inside, whole = (own.std(t[[700, 750, 849]]) for own in (alone, spline))
    np.testing.assert_allclose(whole, inside, rtol=1e-4)
    grown = np.asarray(spline.std(t[[849, 1000, 1200, 1499]], calibrated=False))
    assert (np.diff(grown) > 0).all()


def with_gap(name, missing, seed, n=1500):
    """Irregular times of a moving body, and points of which a part in the middle has no weight."""
    space, rng = ss.space(name), np.random.default_rng([seed, len(name)])
    t = np.cumsum(rng.exponential(0.01, n))
    base = np.stack([np.sin(t), np.cos(t), 0.3 * np.sin(2 * t)], axis=-1)
    if name == "r:2":
        truth = base[:, :2]
    elif name == "sphere:2":
        truth = space.project(base)
    else:
        truth = ss.rotations.from_rotation_vectors(base)
    if name == "se:3":
        truth = np.pad(truth, ((0, 0), (0, 1), (0, 1)))
        truth[:, :3, 3], truth[:, 3, 3] = np.column_stack([base[:, :2], t]), 1
    noisy = space.exp(truth, 0.05 * space.random_tangent(rng, truth))
    weights = np.ones(n)
    first = int(n * (1 - missing) / 2)
    weights[first : first + int(n * missing)] = 0
    return space, t, noisy, weights


@pytest.mark.slow
@pytest.mark.parametrize(
    ("missing", "name"), [(0.1, "se:3"), (0.1, "r:2"), (0.3, "sphere:2"), (0.6, "so:3"), (0.6, "se:3")]
)
def test_recordings_with_a_long_gap(name, missing):
    """One is as good as many: a curve of a batch is that of its data alone, to the last bit."""
    many = [with_gap(name, missing, seed) for seed in range(3)]
    for space, t, noisy, weights in many:
        alone = ss.make_smoothing_spline(t, noisy, space, weights=weights)
        used = weights > 0
        assert name == "se:3" or rms(space, alone(t[used]), noisy[used]) < 0.12
    batch = np.stack([weights, np.roll(weights, 50)])
    both = ss.make_smoothing_spline(t, np.stack([noisy, noisy]), space, weights=batch)
    assert np.array_equal(both[0].points, alone.points) and np.array_equal(both[0](t), alone(t))

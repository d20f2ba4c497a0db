"""Estimates from data as sensors record them."""

import pickle
import warnings

import numpy as np
import pytest
import sensors
from refused import raises

import symspline as ss
from symspline import measure

SO3 = sensors.SO3
BIAS = np.array([0.03, -0.02, 0.05])


def gyro(seed, end=10, attitudes=51, rates=501, noise=(0.05, 0.02)):
    rng = np.random.default_rng(seed)
    truth = sensors.turning(end, rng)
    t, s = sensors.times(rng, 0, end, attitudes), sensors.times(rng, 0, end, rates)
    seen = SO3.exp(truth(t), noise[0] * SO3.random_tangent(rng, truth(t)))
    omega = ss.rotations.angular_velocity(truth, s) + BIAS + noise[1] * rng.standard_normal((rates, 3))
    return truth, t, seen, s, omega


def fused(t, seen, s, omega, **options):
    return [
        measure.Points(t, seen, sigma=0.05, **options),
        measure.BodyRates(s, omega, sigma=0.02, bias=measure.Constant(3)),
    ]


def errors(curve, truth, x):
    angle = SO3.distance(curve(x), truth(x))
    rate = [ss.rotations.angular_velocity(own, x) for own in (curve, truth)]
    return sensors.rms(angle), sensors.rms(rate[0] - rate[1])


def imu(seed, end=30):
    rng = np.random.default_rng(seed)
    turn, path = sensors.turning(end, rng, 0.4), sensors.moving(end, rng)
    s, g = np.linspace(0, end, 100 * end + 1), sensors.times(rng, 0, end, 8 * end)
    bias = 0.1 * rng.standard_normal(3), 0.2 * rng.standard_normal(3)
    omega = ss.rotations.angular_velocity(turn, s) + bias[0] + 0.01 * rng.standard_normal((len(s), 3))
    force = np.einsum("nij,ni->nj", turn(s), path(s, 2) - sensors.GRAVITY) + bias[1]
    force = force + 0.1 * rng.standard_normal(force.shape)
    y = path(g) + 0.3 * rng.standard_normal((len(g), 3))
    return turn, path, bias, s, g, omega, force, y


def inertial(s, omega, force, **options):
    return [
        measure.BodyRates(s, omega, sigma=0.01, bias=measure.Constant(3), **options),
        measure.SpecificForce(s, force, sigma=0.1, bias=measure.Constant(3, sigma=1.0)),
    ]


@pytest.mark.slow
def test_position_and_imu():
    """Attitude and both biases from positions and an IMU; `se:3` gives what the product gives."""
    turn, path, bias, s, g, omega, force, y = imu(0)
    knots = np.linspace(0, 30, 151)
    position = measure.Points(g, y, sigma=0.3, factor=1)
    product = ss.estimate([position, *inertial(s, omega, force)], knots, "so:3 x r:3", penalty="jerk")
    assert sensors.rms(product(g)[1] - path(g)) < 0.1
    assert sensors.rms(SO3.distance(product(g)[0], turn(g))) < 0.03
    for name, true in zip(["gyro bias", "accelerometer bias"], bias, strict=True):
        found = product.parameters[name]
        assert np.all(np.abs(found.value - true) < 4 * found.std), name
    seen = measure.Points(g, y, sigma=0.3)
    poses = ss.estimate([seen, *inertial(s, omega, force)], knots, "se:3", penalty="jerk")
    assert poses.space == ss.SpecialEuclidean(3)
    at = poses(g)
    assert sensors.rms(at[:, :3, 3] - path(g)) < 1.25 * sensors.rms(product(g)[1] - path(g))
    assert sensors.rms(SO3.distance(at[:, :3, :3], turn(g))) < 1.25 * sensors.rms(SO3.distance(product(g)[0], turn(g)))
    assert [own.shape for own in poses.cov(g)] == [(len(g), 3, 3)] * 2
    assert poses.plot().axes
    assert [own.shape for own in poses.std(g)] == [(len(g),)] * 2


def test_spinning_bodies():
    """λ grows without bound for a constant rotation, and the linear problem must know the curvature of the space."""
    for rate in (0.1, 0.5, 1.0):
        rng = np.random.default_rng(0)
        t, s = sensors.times(rng, 0, 60, 121), np.linspace(0, 60, 1201)
        axis = rate * np.array([0.2, 0.1, 1.0])
        turned = ss.rotations.from_rotation_vectors(t[:, None] * axis)
        seen = SO3.exp(turned, 0.05 * SO3.random_tangent(rng, turned))
        omega = axis + BIAS + 0.02 * rng.standard_normal((1201, 3))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ss.SmoothingWarning)
            curve = ss.estimate(fused(t, seen, s, omega), np.linspace(0, 60, 121), "so:3", penalty="acceleration")
        assert curve.report.iterations <= 8 and curve.df < 5
        assert sensors.rms(SO3.distance(curve(t), turned)) < 0.03


@pytest.mark.slow
def test_unknown_attitude_and_large_bias_of_the_gyro():
    """The initial attitude follows from accelerations, although the integral of the rates drifts by several radians."""
    for seed in (31, 32, 33):
        turn, _, _, s, g, omega, force, y = imu(seed)
        omega = omega + np.array([0.1, -0.05, 0.2])
        curve = ss.estimate(
            [measure.Points(g, y, sigma=0.3, factor=1), *inertial(s, omega, force)],
            np.linspace(0, 30, 151),
            "so:3 x r:3",
            penalty="jerk",
        )
        assert curve.report[0].iterations <= 12
        assert sensors.rms(SO3.distance(curve(g)[0], turn(g))) < 0.05


def test_stars():
    """Directions alone determine the attitude, also where single stars are seen."""
    rng = np.random.default_rng(2)
    truth = sensors.turning(10, rng)
    stars = np.array([[1.0, 0, 0], [0, 0.6, 0.8]])
    t = sensors.times(rng, 0, 10, 81)
    seen = np.einsum("ki,nij->nkj", stars, truth(t)) + 0.01 * rng.standard_normal((81, 2, 3))
    both = ss.estimate([measure.Directions(t, seen, stars, sigma=0.01)], 41, "so:3")
    x = np.linspace(t[0], t[-1], 200)
    assert errors(both, truth, x)[0] < 0.02
    lone = [measure.Directions(t[k::2], seen[k::2, k], stars[k], sigma=0.01) for k in (0, 1)]
    single = ss.estimate(lone, np.linspace(t[0], t[-1], 30), "so:3")
    assert errors(single, truth, x)[0] < 0.05
    on_sphere = ss.estimate([measure.Directions(t, seen, stars, sigma=0.01)], 41, "sphere:3")
    turned = ss.rotations.from_quaternions(on_sphere(x), scalar_first=True)
    assert np.abs(turned - both(x)).max() < 0.01


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_outliers(loss):
    truth, t, seen, s, omega = gyro(7, attitudes=80)
    rng = np.random.default_rng(8)
    bad = rng.choice(len(t), 12, replace=False)
    spoiled = seen.copy()
    spoiled[bad] = SO3.exp(seen[bad], 1.0 * SO3.random_tangent(rng, seen[bad]))
    knots, x = np.linspace(0, 10, 41), np.linspace(0.5, 9.5, 200)
    clean = errors(ss.estimate(fused(t, seen, s, omega), knots, "so:3"), truth, x)[0]
    robust = errors(ss.estimate(fused(t, spoiled, s, omega, loss=loss), knots, "so:3"), truth, x)[0]
    assert robust < (1.7 if loss == "huber" else 1.5) * clean


def test_one_kind_of_points_is_a_smoothing_spline():
    _, t, seen, _, _ = gyro(9)
    order = np.random.default_rng(0).permutation(len(t))
    a = ss.estimate([measure.Points(t[order], seen[order])], "auto", "so:3")
    b = ss.make_smoothing_spline(t, seen, "so:3")
    assert np.array_equal(a(5.5), b(5.5)) and isinstance(a, ss.SmoothingSpline) and not a.parameters


def test_automatic_knots_and_dates():
    truth, t, seen, s, omega = gyro(10)
    day = np.datetime64("2024-03-01T00:00:00.000000")
    dates = [day + (1e6 * x).astype("m8[us]") for x in (t, s)]
    curve = ss.estimate(fused(dates[0], seen, dates[1], omega), "auto", "so:3")
    x = np.linspace(0.5, 9.5, 100)
    plain = ss.estimate(fused(t, seen, s, omega), "auto", "so:3")
    assert 30 < len(curve.t) < 552
    at = day + (1e6 * x).astype("m8[us]")
    assert sensors.rms(SO3.distance(curve(at), truth(x))) < 0.03
    assert abs(len(curve.t) - len(plain.t)) < 5


# ---- the posterior ----


def test_files_pickles_and_text(tmp_path):
    _, t, seen, s, omega = gyro(11)
    curve = ss.estimate(fused(t, seen, s, omega), 31, "so:3")
    curve.save(tmp_path / "curve.npz")
    for found in (ss.load(tmp_path / "curve.npz"), pickle.loads(pickle.dumps(curve))):
        assert np.array_equal(found(3.3), curve(3.3)) and np.array_equal(found.cov(3.3), curve.cov(3.3))
        assert np.array_equal(found.parameters["gyro bias"].std, curve.parameters["gyro bias"].std)
        assert found.measurements == () and found.report == curve.report
    assert "31 knots, from 0.0215778 to 9.98802, gyro bias" in repr(curve)
    assert [own.shape for own in curve.residuals] == [(51, 3), (501, 3)]
    assert curve.data[1] is seen


def test_samples_of_batches_products_and_closed_curves():
    rng = np.random.default_rng(15)
    noisy = rng.standard_normal((2, 40, 2)).cumsum(axis=1)
    batch = ss.make_smoothing_spline(None, noisy, "r:2")
    assert batch.sample(rng, 5)(3.5).shape == (5, 2, 2)
    assert batch.cov([1.5, 2.5, 3.5]).shape == (2, 3, 2, 2) and batch.frames([1.5]).shape == (2, 1, 2, 2)
    assert np.allclose(np.sqrt(batch.cov(2.5)[..., 0, 0]), batch.std(2.5))
    masked = ss.make_smoothing_spline(None, noisy, "r:2", where=[True, False]).sample(rng, 5)(3.5)
    assert np.isfinite(masked[:, 0]).all() and np.isnan(masked[:, 1]).all()
    both = ss.make_smoothing_spline(None, (noisy[0], noisy[1]), "r:2 x r:2")
    assert both.sample(rng, 4)(3.5)[1].shape == (4, 2) and [own.shape for own in both.cov(2.5)] == [(2, 2)] * 2
    angle = np.linspace(0, 2 * np.pi, 41)
    ring = np.stack([np.cos(angle), np.sin(angle), 0.3 * np.sin(2 * angle)], -1)
    ring = ring + 0.05 * rng.standard_normal(ring.shape)
    ring = ss.Sphere(2).project(ring)
    ring[-1] = ring[0]
    closed = ss.make_smoothing_spline(angle, ring, "sphere:2", bc_type="periodic")
    drawn = closed.sample(rng, 300)
    assert np.abs(drawn(0.0) - drawn(2 * np.pi)).max() < 1e-12
    x = closed.t[20]
    distances = ss.Sphere(2).distance(closed(x), drawn(x))
    assert abs(sensors.rms(distances) / np.sqrt(np.trace(closed.cov(x))) - 1) < 0.15
    first, last = closed.cov(0.0), closed.cov(2 * np.pi)
    assert abs(np.trace(first) - np.trace(last)) < 1e-9


# ---- the jerk ----


def test_closed_curves_with_jerk():
    rng = np.random.default_rng(18)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 80))
    angle[[0, -1]] = 0, 2 * np.pi
    y = np.stack([np.cos(angle), np.sin(2 * angle)], -1) + 0.02 * rng.standard_normal((80, 2))
    y[-1] = y[0]
    curve = ss.make_smoothing_spline(angle, y, "r:2", penalty="jerk", bc_type="periodic")
    for nu in range(3):
        assert np.abs(curve(0.0, nu) - curve(2 * np.pi, nu)).max() < 1e-8
    x = np.linspace(0, 2 * np.pi, 100)
    assert sensors.rms(curve(x) - np.stack([np.cos(x), np.sin(2 * x)], -1)) < 0.02


# ---- invalid input ----


def test_invalid_measurements_raise():
    _, t, seen, s, omega = gyro(19)
    points, rates = fused(t, seen, s, omega)
    broken, off, late = omega.copy(), seen.copy(), np.where(np.arange(51) == 3, np.nan, t)
    broken[7, 1], off[4] = np.nan, 1.1 * off[4]
    dates = np.datetime64("2024-01-01") + np.arange(2)

    def turns(omega=omega, t=s, sigma=1, **options):
        return measure.BodyRates(t, omega, sigma=sigma, **options)

    for match, given, knots, space, options in [
        (
            r"measurements\[1\]\.t\[0\] is after the last knot",
            [points, turns(omega[:1], [11.0])],
            [0, 5, 10],
            "so:3",
            {},
        ),
        (r"measurements\[1\] has no sigma", [points, turns(sigma=None)], 9, "so:3", {}),
        (r"measurements\[0\] has no sigma", [measure.Points(t, seen), rates], 9, "so:3", {}),
        (r"omega has shape \(500, 3\)", [points, turns(omega[1:])], 9, "so:3", {}),
        (r"omega\[7, 1\] is nan", [points, turns(broken)], 9, "so:3", {}),
        (r"measurements\[0\]\.y: .*4", [measure.Points(t, off, sigma=0.1), rates], 9, "so:3", {}),
        ("needs one group", [turns()], 9, "sphere:2", {}),
        ("needs one rotation and one position", [measure.SpecificForce(s, omega, sigma=1)], 9, "so:3", {}),
        ("Constant of size 3", [points, turns(bias=measure.Constant(2))], 9, "so:3", {}),
        ("must be one of symspline.measure", [(t, seen)], 9, "so:3", {}),
        ("there are no measurements", [], 9, "so:3", {}),
        ("dates", [points, turns(omega[:2], dates)], 9, "so:3", {}),
        ("factor must be", [measure.Points(t, seen, sigma=1, factor=3)], 9, "so:3 x r:3", {}),
        (r"t\[3\] is nan", [measure.Points(late, seen, sigma=1), rates], 9, "so:3", {}),
        ("there is no initial curve", [measure.Function(t, lambda p: p[:, 0], sigma=1)], 9, "sphere:2", {}),
        ("penalty must be", [points], 9, "so:3", {"penalty": "snap"}),
        ("at least 4 knots", [points, rates], 3, "so:3", {"penalty": "jerk"}),
    ]:
        raises(match, ss.estimate, given, knots, space, **options)


def test_undetermined_parameters_are_named():
    _, t, seen, s, omega = gyro(20)
    points, _ = fused(t, seen, s, omega)
    # Only the sum of both constants enters.
    a, b = measure.Constant(1, name="a"), measure.Constant(1, name="b")
    both = measure.Function(t, lambda p, c: p[:, 0, 0] + c["x"] + c["y"], sigma=0.1, parameters={"x": a, "y": b})
    raises(
        r"do not determine 'a' and 'b' in the direction \{'a': \[1\.0\], 'b': \[-1\.0\]\}",
        ss.estimate,
        [points, both],
        9,
        "so:3",
    )
    unused = measure.Function(t, lambda p, c: p[:, 0, 0], sigma=0.1, parameters={"x": a})
    raises("do not determine 'a'", ss.estimate, [points, unused], 9, "so:3")
    twice = [measure.BodyRates(s, omega, sigma=1, bias=measure.Constant(3)) for _ in range(2)]
    raises("two different constants have the name 'gyro bias'", ss.estimate, [points, *twice], 9, "so:3")


def test_functions_that_return_nonsense_are_located():
    _, t, seen, _, _ = gyro(21)
    points = measure.Points(t, seen, sigma=0.05)
    short = measure.Function(t, lambda p: p[1:, 0, 0], sigma=1)
    raises(
        r"measurements\[1\]: the function returned float64 of shape \(50,\)", ss.estimate, [points, short], 9, "so:3"
    )

    def broken(p):
        return np.where(np.arange(51) == 17, np.nan, p[:, 0, 0])

    raises("residual of sample 17 is", ss.estimate, [points, measure.Function(t, broken, sigma=1)], 9, "so:3")


def test_a_curve_that_nothing_determines():
    rng = np.random.default_rng(22)
    position = measure.Points(np.arange(9.0), rng.standard_normal((9, 3)), sigma=0.1, factor=1)
    raises("do not determine the curve", ss.estimate, [position], 5, "r:2 x r:3", error=ss.ConvergenceError)


def test_noise_that_exceeds_sigma_warns():
    _, t, seen, s, omega = gyro(23)
    given = [measure.Points(t, seen, sigma=0.005), measure.BodyRates(s, omega, sigma=0.002, bias=measure.Constant(3))]
    with pytest.warns(ss.SmoothingWarning, match=r"\[1\] \(BodyRates\): the residuals are (10|9\.9) times as large"):
        ss.estimate(given, 41, "so:3")

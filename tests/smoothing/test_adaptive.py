"""λ(t) and σ(t) that vary along the curve: see `oracle` for the references."""

import warnings

import numpy as np
import pytest
from cases import loop_over
from oracle import Dense, process_variance

import symspline as ss
from symspline import _core

# One λ for motion that bursts is what these tests compare with; it issues a warning.
pytestmark = pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")

TIGHT = {"tol": 1e-9, "max_iter": 200}
BOTH = {"lam": "adaptive", "noise": "adaptive"}


def middles(curve):
    return 0.5 * (curve.t[1:] + curve.t[:-1])


def burst(seed, n=600, m=1, noise=0.03):
    """A slow motion of a minute with a burst of some seconds, and noisy data at random times."""
    rng = np.random.default_rng(seed)
    t, centre, phase = np.sort(rng.uniform(5, 65, n)), rng.uniform(20, 50), rng.uniform(0, 6, m)

    def truth(x):
        x = np.asarray(x)[:, None]
        return 0.3 * np.sin(0.1 * x + phase) + 0.4 * np.exp(-(((x - centre) / 1.8) ** 2) / 2) * np.sin(
            np.pi * (x - centre) + phase
        )

    return t, truth(t) + noise * rng.standard_normal((n, m)), truth, np.abs(t - centre) < 3.6


def on_space(space, t, y, truth):
    """The same motion along geodesics from one point, with its noise."""
    base = space.random_point(np.random.default_rng(0))
    frame = space.frame(base)

    def point(x):
        return space.exp(np.broadcast_to(base, (len(x), *base.shape)), np.einsum("ni,i...->n...", truth(x), frame))

    at = point(t)
    return point, space.exp(at, np.einsum("ni,ni...->n...", y - truth(t), space.frame(at)))


def rms(space, curve, t, point):
    return np.sqrt(np.mean(space.distance(curve(t), point(t)) ** 2))


# ---- λ of the segments ----


@pytest.mark.parametrize("ends", ["natural", ("clamped", "natural"), "periodic"], ids=str)
@loop_over("power", [0.0, 1.0, 3.0])
def test_lam_of_segments_is_that_of_dense_matrices(ends, power):
    rng = np.random.default_rng(3)
    t = np.sort(rng.uniform(0, 0.97, 40))
    w, y = rng.uniform(0.3, 3, 40), rng.standard_normal((40, 2))
    knots = np.linspace(0, 1, 13)
    lam = 1e-4 * np.exp(power * np.sin(np.arange(12)))
    dense = Dense(t, w, knots, ends, lam)
    curve = ss.make_smoothing_spline(t, y, "r:2", lam, weights=w, knots=knots, bc_type=ends, **TIGHT)
    assert np.abs(curve.points[: len(dense.gram)] - dense.fit(y, 1.0)).max() < 1e-8
    assert curve.df == pytest.approx(dense.df(1.0), rel=1e-9)
    np.testing.assert_allclose(curve.lam_at(0.5 * (knots[1:] + knots[:-1])), lam, rtol=1e-12)
    assert curve.lam == pytest.approx(np.exp(np.log(lam).mean()))
    x = np.linspace(0.01, 0.99, 50)
    wanted = curve.sigma * np.sqrt(dense.variance(x, 1.0))
    np.testing.assert_allclose(curve.std(x, calibrated=False), wanted, rtol=1e-8)


@pytest.mark.parametrize("ends", ["natural", "clamped", "periodic"])
def test_variances_are_those_of_a_process_whose_intensity_varies(ends):
    """The mean of the process is no cubic spline where λ jumps, so that the variances differ by the changes of λ."""
    rng = np.random.default_rng(4)
    t = np.sort(rng.uniform(0, 0.97, 60))
    knots = np.append(t, 1.0) if ends == "periodic" else t
    x, span = np.sort(np.append(t, 0.5 * (t[1:] + t[:-1])))[1:-1], knots[-1] - knots[0]
    y = rng.standard_normal((60, 1))
    for size in (0.0, 0.5, 1.5):
        lam = 1e-4 * np.exp(size * np.sin(2 * np.pi * 0.5 * (knots[1:] + knots[:-1])))
        curve = ss.make_smoothing_spline(t, y, "r:1", lam, knots=knots, bc_type=ends, **TIGHT)
        for nu in (0, 1):
            variance = process_variance(t, np.ones(60), lam, x, nu, ends, span, knots)
            wanted = curve.sigma * np.sqrt(variance)
            np.testing.assert_allclose(curve.std(x, nu=nu, calibrated=False), wanted, rtol=1e-6 + 0.03 * size)
            # One λ would have other variances.
            plain = curve.sigma * np.sqrt(process_variance(t, np.ones(60), 1e-4, x, nu, ends, span))
            assert size == 0 or np.abs(plain / wanted - 1).max() > 0.1 * size


@pytest.mark.parametrize("space", ["r:2", "sphere:2", "so:3", "spd:2"])
@pytest.mark.parametrize("how", [{}, {"method": "newton"}, {"penalty": "jerk"}, {"loss": "cauchy"}], ids=str)
def test_equal_lams_are_one_lam(space, how):
    space = ss.space(space)
    t, y, truth, _ = burst(1, 60, space.dim)
    _, data = on_space(space, t, y, truth)
    lam = 0.02
    one, many = (
        ss.make_smoothing_spline(t, data, space, value, knots=np.linspace(t[0], t[-1], 21), **how)
        for value in (lam, np.full(20, lam))
    )
    np.testing.assert_allclose(many.points, one.points, rtol=0, atol=1e-13)
    x = np.linspace(t[0], t[-1], 77)
    np.testing.assert_allclose(many.std(x), one.std(x), rtol=1e-12)


@pytest.mark.parametrize("name", ["sphere:2", "so:3"])
def test_newton_minimises_the_objective_with_lams_of_segments(name):
    space, rng = ss.space(name), np.random.default_rng(0)
    t, y, truth, _ = burst(2, 80, space.dim)
    _, data = on_space(space, t, y, truth)
    knots = np.linspace(t[0], t[-1], 41)
    lam = 0.02 * np.exp(2 * np.sin(np.arange(40)))
    curve, other = (
        ss.make_smoothing_spline(t, data, space, lam, knots=knots, method=method, **TIGHT)
        for method in ("newton", "linearized")
    )

    def objective(points):
        spline = ss.CubicSpline(knots, points, space)
        # Two nodes of Gauss and Legendre per segment, as in the solver.
        nodes = knots[:-1, None] + np.diff(knots)[:, None] * (0.5 + np.array([-0.5, 0.5]) / np.sqrt(3))
        sizes = space.norm(spline(nodes), spline(nodes, 2)) ** 2
        energy = np.sum(0.5 * lam * np.diff(knots) * sizes.sum(axis=1))
        return np.sum(space.distance(spline(t), data) ** 2) + energy

    least = objective(curve.points)
    for _ in range(5):
        step = space.random_tangent(rng, curve.points)
        changes = [objective(space.exp(curve.points, size * step)) - least for size in (1e-4, -1e-4)]
        assert min(changes) > 0 and abs(changes[0] - changes[1]) < 1e-3 * max(changes)
    assert space.distance(curve(t), other(t)).max() < 0.2 * curve.std(t).min()


def test_lams_of_segments_are_refused_for_other_knots():
    t, y, *_ = burst(0, 50)
    with pytest.raises(ss.ValidationError, match=r"lam has 9 numbers per curve.*have 49 segments"):
        ss.make_smoothing_spline(t, y, "r:1", np.ones(9))
    with pytest.raises(ss.ValidationError, match=r"lam.*must be finite and > 0 in every segment"):
        ss.make_smoothing_spline(t, y, "r:1", np.zeros(9), knots=10)
    with pytest.raises(ss.ValidationError, match="lam must be a number, an array or 'adaptive', not 'adaptiv'"):
        ss.make_smoothing_spline(t, y, "r:1", "adaptiv")
    with pytest.raises(ss.ValidationError, match="noise must be 'constant' or 'adaptive'"):
        ss.make_smoothing_spline(t, y, "r:1", noise="yes")


# ---- λ(t) of the data ----


@pytest.mark.parametrize("name", ["r:1", "sphere:2", "so:3", "spd:2"])
@pytest.mark.parametrize("penalty", ["acceleration", "jerk"])
def test_a_burst_between_rests(name, penalty):
    space = ss.space(name)
    t, y, truth, busy = burst(5, 600, space.dim)
    point, data = on_space(space, t, y, truth)
    one = ss.make_smoothing_spline(t, data, space, penalty=penalty)
    curve = ss.make_smoothing_spline(t, data, space, "adaptive", penalty=penalty)
    assert curve.report.gain > 100
    assert rms(space, curve, t, point) < 0.75 * rms(space, one, t, point)
    inside = space.distance(curve(t), point(t)) < curve.band(t)
    assert inside.mean() > 0.85 and inside[busy].mean() > 0.8
    lam = curve.lam_at(t)
    assert np.median(lam[~busy]) > 30 * np.median(lam[busy])
    # The result is repeated by its λ.
    again = ss.make_smoothing_spline(t, data, space, curve.lam_at(middles(curve)), knots=curve.t, penalty=penalty)
    assert space.distance(again(t), curve(t)).max() < 0.02 * curve.std(t).min()


@pytest.mark.parametrize("name", ["r:1", "so:3"])
@loop_over("seed", range(3))
def test_steady_motion_keeps_one_lam(name, seed):
    space, rng = ss.space(name), np.random.default_rng(seed)
    t, speed, phase = np.sort(rng.uniform(0, 1, 300)), rng.uniform(15, 40), rng.uniform(0, 6, space.dim)

    def truth(x):
        return 0.3 * np.sin(speed * x[:, None] + phase)

    _, data = on_space(space, t, truth(t) + 0.04 * rng.standard_normal((300, space.dim)), truth)
    one = ss.make_smoothing_spline(t, data, space)
    curve = ss.make_smoothing_spline(t, data, space, "adaptive", noise="adaptive")
    assert curve.report.gain < 6
    assert space.distance(curve(t), one(t)).max() < 0.02 * one.std(t).min()
    assert curve.lam_at(t) == pytest.approx(curve.lam)
    assert curve.sigma_at(t) == pytest.approx(curve.sigma)


def test_units_of_time_and_space_do_not_matter():
    t, y, *_ = burst(6)
    curve = ss.make_smoothing_spline(t, y, "r:1", "adaptive", noise="adaptive")
    other = ss.make_smoothing_spline(1e4 * t, 1e-3 * y, "r:1", "adaptive", noise="adaptive")
    np.testing.assert_allclose(other(1e4 * t), 1e-3 * curve(t), rtol=0, atol=1e-9)
    np.testing.assert_allclose(other.lam_at(1e4 * t), 1e12 * curve.lam_at(t), rtol=1e-5)
    assert other.report.gain == pytest.approx(curve.report.gain, rel=1e-6)


def test_a_closed_curve_varies():
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 1, 500))
    angle = 2 * np.pi * t
    r = 1 + 0.3 * np.exp(-(((t - 0.6) / 0.02) ** 2) / 2) * np.sin(200 * t)
    truth = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)
    data = truth + 0.02 * rng.standard_normal(truth.shape)
    knots = np.linspace(0, 1, 200)
    one, curve = (
        ss.make_smoothing_spline(t, data, "r:2", lam, knots=knots, bc_type="periodic") for lam in (None, "adaptive")
    )
    errors = [np.sqrt(np.mean((c(t) - truth) ** 2)) for c in (one, curve)]
    assert errors[1] < 0.75 * errors[0] and curve.report.gain > 50
    np.testing.assert_allclose(curve(0.0), curve(1.0), atol=1e-12)
    assert curve.lam_at(1.6) == curve.lam_at(0.6)


def test_outliers_are_not_bursts():
    t, y, truth, busy = burst(7, 600, 2)
    rng = np.random.default_rng(0)
    far = rng.random(600) < 0.05
    y[far] += rng.standard_normal((far.sum(), 2))
    one, curve = (ss.make_smoothing_spline(t, y, "r:2", lam, loss="cauchy") for lam in (None, "adaptive"))
    errors = [np.sqrt(np.mean((c(t) - truth(t)) ** 2)) for c in (one, curve)]
    assert errors[1] < 0.8 * errors[0]
    assert np.median(curve.lam_at(t[~busy])) > 30 * np.median(curve.lam_at(t[busy]))


@pytest.mark.parametrize("knots", [12, 40])
def test_few_knots(knots):
    t, y, *_ = burst(8)
    curve = ss.make_smoothing_spline(t, y, "r:1", "adaptive", knots=knots)
    assert np.isfinite(curve(t)).all() and len(np.unique(curve.lam_at(t))) <= knots


@pytest.mark.parametrize("count", [2, 3, 4, 6])
def test_few_data(count):
    t = np.arange(float(count))
    curve = ss.make_smoothing_spline(t, np.sin(t)[:, None], "r:1", "adaptive", noise="adaptive")
    assert np.isfinite(curve(t)).all()


# ---- σ(t) ----


@loop_over("seed", range(3))
def test_noise_that_varies(seed):
    rng = np.random.default_rng(seed)
    t = np.sort(rng.uniform(0, 60, 1000))
    loud = (t > 24) & (t < 42)
    truth = np.stack([np.sin(0.5 * t + seed), np.cos(0.3 * t)], axis=-1)
    sigma = np.where(loud, 0.25, 0.05)
    data = truth + sigma[:, None] * rng.standard_normal(truth.shape)
    curve = ss.make_smoothing_spline(t, data, "r:2", "adaptive", noise="adaptive")
    assert curve.report.gain > 100
    assert np.ptp(curve.lam_at(t)) == 0
    assert np.median(curve.sigma_at(t[loud])) == pytest.approx(0.25, rel=0.15)
    assert np.median(curve.sigma_at(t[~loud])) == pytest.approx(0.05, rel=0.15)
    assert curve.sigma == pytest.approx(np.exp(np.log(curve.sigma_at(t)).mean()), rel=1e-6)
    weighted = ss.make_smoothing_spline(t, data, "r:2", weights=1 / sigma**2)
    errors = [np.sqrt(np.mean((c(t) - truth) ** 2)) for c in (curve, weighted)]
    assert errors[0] < 1.15 * errors[1]
    # Weights and matrices are multiplied by the same factors.
    matrices = np.eye(2) * rng.uniform(0.5, 2, 1000)[:, None, None]
    plain = matrices[:, 0, 0]
    by_matrices = ss.make_smoothing_spline(t, data, "r:2", weights=matrices, noise="adaptive")
    by_numbers = ss.make_smoothing_spline(t, data, "r:2", weights=plain, noise="adaptive")
    np.testing.assert_allclose(by_matrices.sigma_at(t), by_numbers.sigma_at(t), rtol=1e-6)
    np.testing.assert_allclose(by_matrices(t), by_numbers(t), atol=1e-8)


def test_each_of_both_is_found():
    rng = np.random.default_rng(0)
    t, y, truth, _ = burst(9, 1000, noise=0)
    loud = (t > 30) & (t < 48)
    data = y + np.where(loud, 0.1, 0.02)[:, None] * rng.standard_normal(y.shape)
    both = ss.make_smoothing_spline(t, data, "r:1", "adaptive", noise="adaptive")
    assert np.ptp(both.lam_at(t)) > 0 and np.ptp(both.sigma_at(t)) > 0
    # λ(t) alone takes noise for motion.
    alone = ss.make_smoothing_spline(t, data, "r:1", "adaptive")
    errors = [np.sqrt(np.mean((c(t) - truth(t)) ** 2)) for c in (both, alone)]
    assert errors[0] < errors[1]


# ---- several curves, gaps ----


def test_batches_and_products_are_single_curves():
    t, y, *_ = burst(10, 300, 2)
    rng = np.random.default_rng(1)
    steady = np.stack([np.sin(0.5 * t), np.cos(0.4 * t)], axis=-1) + 0.03 * rng.standard_normal(y.shape)
    batch = ss.make_smoothing_spline(t, np.stack([y, steady]), "r:2", "adaptive", noise="adaptive")
    product = ss.make_smoothing_spline(t, (y, steady), "r:2 x r:2", "adaptive", noise="adaptive")
    x = np.linspace(t[0], t[-1], 99)
    for i, data in enumerate((y, steady)):
        one = ss.make_smoothing_spline(t, data, "r:2", "adaptive", noise="adaptive")
        for other in (batch[i], product.factors[i] if hasattr(product, "factors") else product._parts[i]):
            np.testing.assert_allclose(other(x), one(x), atol=1e-9)
            np.testing.assert_allclose(other.std(x), one.std(x), rtol=1e-6)
            np.testing.assert_allclose(other.lam_at(x), one.lam_at(x), rtol=1e-6)
        assert batch.report.gain[i] == pytest.approx(one.report.gain, rel=1e-6)
    assert batch.report.gain[0] > 6 > batch.report.gain[1]
    only = ss.make_smoothing_spline(t, (y, y), "r:2 x r:2", (None, "adaptive"))
    assert only.report[0].gain is None and only.report[1].gain > 6


def test_lam_in_a_long_gap_is_the_harmonic_mean():
    t, y, *_ = burst(11, 900)
    gap = (8.0, 14.0)
    kept = (t < gap[0]) | (t > gap[1])
    curve = ss.make_smoothing_spline(t[kept], y[kept], "r:1", "adaptive")
    lam, h = curve.lam_at(middles(curve)), np.diff(curve.t)
    in_gap = h > 5
    assert in_gap.sum() == 1
    assert lam[in_gap] == pytest.approx(h[~in_gap].sum() / np.sum(h[~in_gap] / lam[~in_gap]), rel=1e-6)
    beside = np.flatnonzero(in_gap)[0] + np.array([-1, 1])
    assert (lam[beside] > 3 * lam[in_gap]).all()


@pytest.mark.parametrize("kind", ["burst", "steady"])
def test_estimates_vary(kind):
    space, rng = ss.space("so:3"), np.random.default_rng(3)
    t, s = np.sort(rng.uniform(0, 60, 240)), np.arange(0, 60.01, 0.1)

    def turn(x):
        slow = 0.5 * np.sin(0.15 * x[:, None] + np.arange(3))
        fast = 0.4 * np.exp(-(((x - 30) / 1.5) ** 2) / 2) * np.sin(np.pi * (x - 30))
        return ss.rotations.from_rotation_vectors(slow + (kind == "burst") * fast[:, None] * [1, 0.7, -0.5])

    at = turn(t)
    points = space.exp(at, np.einsum("ni,nijk->njk", 0.03 * rng.standard_normal((240, 3)), space.frame(at)))
    up = turn(s)[:, 2] + 0.05 * rng.standard_normal((len(s), 3))
    sensors = [
        ss.measure.Points(t, points, sigma=0.03),
        ss.measure.Directions(s, up, [0, 0, 1], sigma=0.05),
    ]
    one, curve = (ss.estimate(sensors, 150, space, penalty="acceleration", lam=lam) for lam in (None, "adaptive"))
    errors = [rms(space, c, s, turn) for c in (one, curve)]
    if kind == "steady":
        assert curve.report.gain < 6
        np.testing.assert_array_equal(curve(s), one(s))
        return
    assert curve.report.gain > 100 and errors[1] < 0.7 * errors[0]
    inside = space.distance(curve(s), turn(s)) < curve.band(s)
    assert inside[np.abs(s - 30) < 3].mean() > 0.8
    again = ss.estimate(sensors, curve.t, space, penalty="acceleration", lam=curve.lam_at(middles(curve)))
    assert space.distance(again(s), curve(s)).max() < 0.05 * curve.std(s).min()


# ---- warnings ----


def warned(*words, **options):
    """The data of a burst or a steady motion, with noise that varies or not, and the warnings of their fit."""
    rng = np.random.default_rng(0)
    t, y, *_ = burst(9, 1000, noise=0)
    if "steady" in words:
        y = np.sin(0.5 * t)[:, None]
    loud = (t > 30) & (t < 48) & ("loud" in words)
    data = y + np.where(loud, 0.1, 0.02)[:, None] * rng.standard_normal(y.shape)
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        ss.make_smoothing_spline(t, data, "r:1", **options)
    return " ".join(str(note.message) for note in seen)


@pytest.mark.parametrize("words", [(), ("steady",), ("loud",), ("steady", "loud")], ids=str)
def test_no_warning_if_both_may_vary(words):
    assert warned(*words, lam="adaptive", noise="adaptive") == ""


def test_one_that_takes_the_other_for_itself():
    assert "takes for noise may be motion: lam varies" in warned(noise="adaptive")
    assert "takes for motion may be noise: noise varies" in warned("steady", "loud", lam="adaptive")
    assert warned(lam="adaptive") == warned("steady", lam="adaptive") == ""
    assert warned("steady", "loud", noise="adaptive") == warned("steady", noise="adaptive") == ""
    assert "Pass lam='adaptive'" in warned()


@pytest.mark.parametrize("n", [60, 600])
@loop_over("seed", range(5))
def test_an_outlier_is_no_burst(n, seed):
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 60, n)
    k = rng.integers(5, n - 5)
    y = np.sin(t / 8)[:, None] + 0.02 * rng.standard_normal((n, 1))
    y[k] += 0.6
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        curve = ss.make_smoothing_spline(t, y, "r:1", "adaptive")
    text = " ".join(str(note.message) for note in seen)
    # Otherwise the residuals show it, as with one λ.
    assert f"points[{k}]" in text or "outlier" in text
    assert np.ptp(curve.lam_at(t)) == 0 or f"follow an outlier: points[{k}]" in text


def test_noise_does_not_vanish_where_rounded_data_repeat():
    rng, t = np.random.default_rng(2), np.linspace(0, 60, 600)
    truth = 0.3 * np.sin(t / 8) + 0.4 * np.exp(-((t - 30) ** 2) / 4) * np.sin(3 * t)
    y = np.round((truth + 0.01 * rng.standard_normal(600)) / 0.05) * 0.05
    one, curve = (ss.make_smoothing_spline(t, y[:, None], "r:1", **how) for how in ({}, BOTH))
    sigma = curve.sigma_at(t)
    assert sigma.max() < 101 * sigma.min()
    assert np.abs(curve(t)[:, 0] - truth).max() < 1.5 * np.abs(one(t)[:, 0] - truth).max()


def test_few_data_hardly_decide():
    """In 40 data, a burst and a noisy part look alike."""
    rng, t = np.random.default_rng(0), np.linspace(0, 60, 40)
    y = 0.2 * np.sin(t / 10) + 0.4 * np.exp(-((t - 30) ** 2) / 30) * np.sin(0.8 * t) + 0.02 * rng.standard_normal(40)
    with pytest.warns(ss.SmoothingWarning, match="hardly decide whether their noise or the motion varies"):
        ss.make_smoothing_spline(t, y[:, None], "r:1", **BOTH)


def test_curves_that_do_not_converge_keep_one_lam(monkeypatch):
    t, y, *_ = burst(5)
    one = ss.make_smoothing_spline(t, y, "r:1")
    run = _core.smooth

    def failing(factors, *rest):
        (smooth,) = run(factors, *rest)
        if any(factors[0][-1]):
            smooth[2][0][:] = 1
        return [smooth]

    monkeypatch.setattr(_core, "smooth", failing)
    with pytest.warns(ss.SmoothingWarning, match="did not converge with a lam or a noise level that varies"):
        curve = ss.make_smoothing_spline(t, y, "r:1", "adaptive")
    assert np.isnan(curve.report.gain) and curve.report.converged
    np.testing.assert_array_equal(curve(t), one(t))


def test_noise_does_not_vary_without_a_penalty():
    t, y, *_ = burst(0, 50)
    for lam in (0.0, np.inf):
        with pytest.raises(ss.ValidationError, match="noise='adaptive' needs a penalty"):
            ss.make_smoothing_spline(t, y, "r:1", lam, knots=10, noise="adaptive")
    with pytest.raises(ss.ValidationError, match=r"lam has shape \(2, 49\), but must be a number"):
        ss.make_smoothing_spline(t, y, "r:1", np.ones((2, 49)))

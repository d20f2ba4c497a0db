"""Bands are calibrated in long gaps and beyond the ends, and do not change elsewhere."""

import warnings

import numpy as np
import pytest

import symspline as ss
from symspline import _core
from symspline._curves.ends import end_kinds
from symspline._smoothing import gaps

# The standard deviations here are arbitrary, which the audit of residuals reports.
pytestmark = pytest.mark.filterwarnings("ignore:The residuals:symspline.SmoothingWarning")


def recorded(seed=0, n=400, gaps=((132.0, 137.0),), dim=2, noise=0.02, start=100.0, span=60.0):
    """Return irregular times, noisy points and the motion: sums of three sines."""
    rng = np.random.default_rng(seed)
    # Far from even, and without gaps of its own.
    t = start + span * (np.arange(n) + rng.uniform(0.1, 0.9, n)) / n
    for first, last in gaps:
        t = t[(t < first) | (t > last)]
    w = rng.uniform(0.2, 1.2, (dim, 3))
    a, p = rng.uniform(1, 5, (dim, 3)) / (1 + 3 * w), rng.uniform(0, 6, (dim, 3))

    def motion(x):
        return (a * np.sin(np.multiply.outer(x, w) + p)).sum(axis=-1)

    return t, motion(t) + noise * rng.standard_normal((len(t), dim)), motion


def predictions(spline, left_out):
    """Return vectors to the data from the curve without some of its data, and the variances of that curve there."""
    own = gaps._evidence(spline, 0, np.arange(len(left_out)), float(spline.sigma))
    n, rows, _ = own.factors.shape
    roots = own.line[0]
    m = roots.shape[2]

    def flat(factors):
        return np.repeat(own.firsts, factors.shape[1]), factors.reshape(-1, 4 * m), np.zeros((factors[..., 0].size, 0))

    # The coordinates themselves, without roots of weights.
    factors = _core.coefficient_factors(own.knots, own.known[2], own.times, 0)[1]
    probes = flat(np.einsum("qc,nk->nqkc", np.eye(m), factors).reshape(n, m, -1))
    omitted = (np.flatnonzero(left_out)[:, None] * rows + np.arange(rows)).ravel()
    residuals = np.ascontiguousarray(own.residuals.reshape(n * rows, -1))
    blocks = [[0, len(omitted), 0, len(probes[0])]]
    values, variances = _core.predictions_without(
        own.knots, own.known, flat(own.factors), residuals, probes, omitted, blocks
    )
    sigma = float(spline.sigma)
    vectors = np.linalg.solve(roots, own.residuals.reshape(n, rows, -1)).reshape(n, -1)
    errors = (vectors - values.reshape(n, -1)) * sigma
    return errors, np.asarray(variances).reshape(n, -1).mean(axis=1) * sigma**2


def matrices(rng, n, m):
    roots = rng.standard_normal((n, m, m)) + 2 * np.eye(m)
    return roots @ np.swapaxes(roots, 1, 2)


@pytest.mark.parametrize("kind", ["numbers", "matrices", "jerk", "closed", "knots"])
def test_predictions_without_data_are_those_of_fits_without_them(kind):
    t, y, _ = recorded(seed=3, n=120, gaps=())
    rng = np.random.default_rng(1)
    weights = matrices(rng, len(t), 2) if kind == "matrices" else rng.uniform(0.5, 3, len(t))
    options = {"jerk": {"penalty": "jerk"}, "closed": {"bc_type": "periodic"}, "knots": {"knots": 50}}.get(kind, {})
    left_out = (t > 120) & (t < 124) if kind != "closed" else (t > 157) | (t < 102)
    left_out[[0, -1]] &= kind == "closed"
    lam = 0.01 if kind == "jerk" else 0.1
    if kind == "closed":
        y[-1] = y[0]
        left_out[[0, -1]] = False
    spline = ss.make_smoothing_spline(t, y, "r:2", lam, weights=weights, sigma=0.02, **options)
    errors, variances = predictions(spline, left_out)
    fewer = np.array(weights)
    fewer[left_out] = 0
    again = ss.make_smoothing_spline(t, y, "r:2", lam, weights=fewer, sigma=0.02, **options)
    assert np.allclose(errors, y - again(t), atol=1e-6 if kind == "jerk" else 1e-9)
    posterior, kinds = again._posterior(again._smoothed[0]), end_kinds(again._bc_type)
    plain = posterior.covariance(again.space, again._knots_of(()), (), kinds, again._noisy.times, None, [0])
    assert np.allclose(variances, 0.02**2 * np.trace(plain, axis1=1, axis2=2) / 2, rtol=1e-5)


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "h:2"])
def test_predictions_on_curved_spaces_are_nearly_those_of_fits(name):
    space = {"sphere:2": ss.Sphere(2), "so:3": ss.SpecialOrthogonal(3), "h:2": ss.Hyperbolic(2)}[name]
    t, own, _ = recorded(seed=5, n=150, gaps=(), dim=space.dim, noise=0.0)
    rng = np.random.default_rng(2)
    origin = space.mean(space.random_point(rng, (3,))) if name == "h:2" else space.random_point(rng)
    frame = space.frame(origin)
    truth = space.exp(np.broadcast_to(origin, (len(t), *origin.shape)), np.tensordot(0.05 * own, frame, 1))
    y = space.exp(truth, 0.01 * space.random_tangent(rng, truth))
    left_out = (t > 120) & (t < 123)
    spline = ss.make_smoothing_spline(t, y, space, 0.3, sigma=0.01)
    errors, _ = predictions(spline, left_out)
    again = ss.make_smoothing_spline(t, y, space, 0.3, sigma=0.01, weights=np.where(left_out, 0.0, 1.0))
    wanted = space.distance(again(t), y)
    assert np.allclose(np.linalg.norm(errors, axis=1), wanted, atol=0.05 * wanted.max())


@pytest.mark.parametrize("options", [{}, {"criterion": "reml"}, {"penalty": "jerk"}])
def test_bands_in_a_gap_contain_the_motion(options):
    inside, outside, before = [], [], []
    for seed in range(6):
        t, y, motion = recorded(seed, n=500)
        spline = ss.make_smoothing_spline(t, y, "r:2", **options)
        x, far = np.linspace(132.2, 136.8, 30), np.linspace(104, 126, 50)
        error = np.linalg.norm(spline(x) - motion(x), axis=1)
        inside.append(np.mean(error < spline.band(x)))
        before.append(np.mean(error < spline.band(x, calibrated=False)))
        outside.append(np.mean(np.linalg.norm(spline(far) - motion(far), axis=1) < spline.band(far)))
        assert np.array_equal(spline.std(far), spline.std(far, calibrated=False))
    assert np.mean(inside) > 0.85 > 0.5 > np.mean(before) - 0.4 * ("criterion" in options)
    assert np.mean(outside) > 0.9


def test_continued_cubics_warn_once_of_their_bands():
    t, y, _ = recorded(gaps=())
    spline = ss.make_smoothing_spline(t, y, "r:2", extrapolate=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spline.band(np.linspace(t[0], t[-1], 10))
    with pytest.warns(ss.SmoothingWarning, match="extrapolate='geodesic'") as caught:
        spline.band(t[-1] + 1), spline.cov(t[0] - 1)
    assert len(caught) == 1


@pytest.mark.filterwarnings("ignore:The smoothing chose|In the data:symspline.SmoothingWarning")
@pytest.mark.parametrize(("name", "warns"), [("sphere:2", True), ("so:3", True), ("r:3", False), ("torus:1", False)])
def test_bands_wider_than_half_the_injectivity_radius_warn_once(name, warns):
    """A fast oscillation, whose course in a gap of five seconds is unknown."""
    space = ss.space(name)
    rng = np.random.default_rng(0)
    t = np.linspace(0, 60, 400)
    t = t[(t < 27) | (t > 32)]
    origin = np.zeros(space.point_shape) if name in ("r:3", "torus:1") else space.random_point(rng)
    waves = np.sin(np.multiply.outer(t, rng.uniform(1.0, 3.0, space.dim)))
    frame = space.frame(origin)
    y = space.exp(np.broadcast_to(origin, (len(t), *origin.shape)), np.tensordot(0.5 * waves, frame, 1))
    y = space.exp(y, 0.01 * space.random_tangent(rng, y))
    spline = ss.make_smoothing_spline(t, y, space, criterion="reml")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        spline.band(t), spline.band(np.linspace(27, 32, 20)), spline.std(29.0)
    assert [str(own.message)[:13] for own in caught] == ["the 95 % band"] * warns


def test_nothing_changes_without_gaps():
    t, y, _ = recorded(gaps=())
    spline = ss.make_smoothing_spline(t, y, "r:2")
    x = np.linspace(t[0], t[-1], 500)
    before, after = spline.gaps
    assert (before.start, before.stop, after.start, after.stop) == (-np.inf, t[0], t[-1], np.inf)
    for nu in (0, 1):
        assert np.array_equal(spline.std(x, nu=nu), spline.std(x, nu=nu, calibrated=False))
        assert np.array_equal(spline.cov(x, nu=nu), spline.cov(x, nu=nu, calibrated=False))
    assert np.array_equal(spline.band(x, 0.5), spline.band(x, 0.5, calibrated=False))


def test_velocities_covariances_and_samples_have_the_same_factors():
    t, y, _ = recorded()
    spline = ss.make_smoothing_spline(t, y, "r:2", knots=np.union1d(t, np.linspace(132, 137, 21)))
    x = np.array([110.0, 133, 134.5])
    std, speed = spline.std(x), spline.std(x, nu=1)
    assert np.allclose(spline.cov(x)[:, 0, 0], std**2) and np.allclose(spline.cov(x, nu=1)[:, 1, 1], speed**2)
    joint = spline.cov(x, nu="joint")
    assert np.allclose(joint[:, 0, 0], std**2, rtol=0.03) and np.linalg.eigvalsh(joint).min() > 0
    ratio = std / spline.std(x, calibrated=False)
    assert ratio[0] == 1 and ratio[2] > 2 and speed[2] > 1.5 * spline.std(x, nu=1, calibrated=False)[2]
    across = spline.cov(x, x[::-1])[0, 0, 0] / spline.cov(x, x[::-1], calibrated=False)[0, 0, 0]
    assert across == pytest.approx(ratio[0] * ratio[2])
    drawn = spline.sample(np.random.default_rng(0), 400)(134.5)
    assert np.std(drawn[:, 0]) == pytest.approx(std[2], rel=0.15)


def test_products_batches_and_files_have_the_factors_of_their_curves(tmp_path):
    t, y, _ = recorded(dim=2)
    alone = ss.make_smoothing_spline(t, y, "r:2")
    flat = ss.make_smoothing_spline(t, y[:, :1], "r:1")
    space = ss.Product(ss.Euclidean(2), ss.Euclidean(1))
    both = ss.make_smoothing_spline(t, (y, y[:, :1]), space)
    assert both.gaps == (alone.gaps, flat.gaps)
    batch = ss.make_smoothing_spline(t, np.stack([y, 2 * y]), "r:2")
    assert batch.gaps.shape == (2,)
    assert [gap.factor for gap in batch.gaps[0]] == pytest.approx([gap.factor for gap in alone.gaps], rel=1e-6)
    x = np.linspace(130, 139, 10)
    assert np.allclose(batch.std(x)[1], 2 * alone.std(x))
    assert np.array_equal(batch[1].std(x), batch.std(x)[1])
    jerk = ss.make_smoothing_spline(t, y, "r:2", penalty="jerk", loss="huber")
    for number, spline in enumerate((alone, both, batch, jerk)):
        ss.save(spline, tmp_path / f"{number}.npz")
        again = ss.load(tmp_path / f"{number}.npz")
        for one, same in zip(np.atleast_1d(spline.std(x)), np.atleast_1d(again.std(x)), strict=True):
            assert np.array_equal(one, same)


def test_gaps_of_dates_have_dates():
    t, y, _ = recorded()
    dates = np.datetime64("2024-05-01T00:00", "ms") + (1000 * t).astype("timedelta64[ms]")
    before, gap, after = ss.make_smoothing_spline(dates, y, "r:2").gaps
    assert np.isnat(before.start) and np.isnat(after.stop)
    assert before.stop == dates[0] and after.start == dates[-1]
    first = np.searchsorted(t, 134)
    assert (gap.start, gap.stop) == (dates[first - 1], dates[first])


def test_a_closed_curve_has_blocks_across_its_start():
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 60, 500))
    t = np.concatenate([[0.0], t[(t < 3) | ((t > 8) & (t < 57))], [60.0]])
    y = np.stack([5 * np.sin(2 * np.pi * t / 20), 3 * np.cos(2 * np.pi * t / 15)], -1)
    y = y + 0.02 * rng.standard_normal(y.shape)
    y[-1] = y[0]
    spline = ss.make_smoothing_spline(t, y, "r:2", bc_type="periodic")
    assert len(spline.gaps) == 2
    x = np.linspace(3.2, 7.8, 20)
    np.testing.assert_allclose(spline.std(x + 60), spline.std(x), rtol=1e-6)
    assert np.all(spline.std(x)[5:15] > 2 * spline.std(x, calibrated=False)[5:15])


def test_a_gap_longer_than_any_part_has_the_largest_factor_and_a_warning():
    t, y, motion = recorded(n=600, gaps=((118.0, 142.0),))
    spline = ss.make_smoothing_spline(t, y, "r:2")
    with pytest.warns(ss.SmoothingWarning, match=r"no data between t = 11.* and t = 142|no data between t = 11"):
        band = spline.band(np.linspace(119, 141, 40))
    assert spline.gaps[1].blocks == 0 and spline.gaps[1].factor > 1
    error = np.linalg.norm(spline(np.linspace(119, 141, 40)) - motion(np.linspace(119, 141, 40)), axis=1)
    assert np.mean(error < band) > 0.9
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spline.std(130.0)
        ss.make_smoothing_spline(t, y, "r:2").std(105.0)


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
def test_gaps_between_data_that_are_all_outliers_have_no_band():
    """The given standard deviation is so small that no datum can show how far predictions are off."""
    t, y, _ = recorded(n=40, noise=0.5)
    spline = ss.make_smoothing_spline(t, y, "r:2", 0.01, loss="huber", sigma=1e-6)
    assert np.isnan(spline.std(134.5)) and spline.std(134.5, calibrated=False) > 0

"""Smoothing against dense matrices and least squares: see `oracle`."""

import numpy as np
import pytest
from cases import loop_over
from noisy import beside, truth
from oracle import Dense, process_variance
from scipy.stats import chi2

import symspline as ss

ENDS = ["natural", "clamped", ("clamped", "natural"), "periodic"]
TIGHT = {"tol": 1e-9, "max_iter": 200}


def data(closed, n=40, m=2, seed=0):
    """Times of which two are equal and two nearly, weights, and values."""
    rng = np.random.default_rng(seed)
    # Nearer to each other by chance, they would cost the reference its digits.
    t = np.arange(n) + rng.uniform(-0.3, 0.3, n)
    t = (t - t[0]) / (t[-1] - t[0])
    t[11], t[21] = t[10], t[20] + 3e-3
    if closed:
        t = 0.97 * t
    y = np.stack([np.sin(2 * np.pi * t), np.cos(2 * np.pi * t)], -1)[:, :m] + 0.2 * rng.standard_normal((n, m))
    return t, rng.uniform(0.3, 3, n), y


def knots_of(kind, t, closed):
    if kind == "few":
        return np.linspace(0, 1, 9)
    return np.append(np.unique(t), 1.0) if closed else np.unique(t)


@pytest.mark.parametrize("ends", ENDS, ids=str)
@pytest.mark.parametrize("kind", ["few", "all"])
@loop_over("lam", [1e-9, 1e-5, 1e-2, 10.0])
def test_fits_of_numbers(ends, kind, lam):
    closed = ends == "periodic"
    t, w, y = data(closed)
    knots = knots_of(kind, t, closed)
    dense = Dense(t, w, knots, ends)
    spline = ss.make_smoothing_spline(t, y, "r:2", lam, weights=w, knots=knots, bc_type=ends, **TIGHT)
    assert np.abs(spline.points[: len(dense.gram)] - dense.fit(y, lam)).max() < 1e-6
    assert spline.df == pytest.approx(dense.df(lam), rel=1e-6)
    assert spline.sigma == spline.report.sigma == pytest.approx(dense.sigma(y, lam), rel=1e-6)
    x = np.sort(np.r_[t, 0.5 * (t[1:] + t[:-1])[np.diff(t) > 0.005]])
    for nu in (0, 1):
        if kind == "few":
            variance = dense.variance(x, lam, nu)
        elif ends == ("clamped", "natural"):
            continue
        else:
            variance = process_variance(t, w, lam, x, nu, ends, 1.0)
        inner = slice(1, -1) if nu == 1 and ends == "clamped" else slice(None)
        wanted = spline.sigma * np.sqrt(variance[inner])
        assert spline.std(x[inner], nu=nu, calibrated=False) == pytest.approx(wanted, rel=1e-6)
    radius = np.sqrt(chi2.ppf(0.9, 2)) * spline.std(x, calibrated=False)
    assert spline.band(x, 0.9, calibrated=False) == pytest.approx(radius, rel=1e-9)


@pytest.mark.parametrize("ends", ENDS, ids=str)
@pytest.mark.parametrize("kind", ["few", "all"])
@loop_over("criterion, gamma", [("gcv", 1.0), ("gcv", 1.4), ("reml", 1.4), ("cp", 1.4)])
def test_the_choice_of_lambda(ends, kind, criterion, gamma):
    """The criterion at the chosen λ is its minimum."""
    closed = ends == "periodic"
    options = {"gamma": gamma, "sigma": 0.2}
    for seed in range(3):
        t, w, y = data(closed, seed=seed)
        knots = knots_of(kind, t, closed)
        dense = Dense(t, w, knots, ends)
        spline = ss.make_smoothing_spline(
            t, y, "r:2", weights=w, knots=knots, bc_type=ends, criterion=criterion, **options, **TIGHT
        )
        best = dense.best(criterion, y, spline.lam, **options)
        low, found = (dense.score(criterion, y, lam, **options) for lam in (best, spline.lam))
        assert found - low < 1e-5 * max(1.0, abs(low))
        for factor in 10.0 ** np.arange(-6, 7):
            assert dense.score(criterion, y, spline.lam * factor, **options) >= found - 1e-9


@pytest.mark.parametrize("name", ["sphere:2", "so:3"])
@pytest.mark.parametrize("kind", ["few", "all"])
@pytest.mark.parametrize("ends", ["natural", "clamped"])
def test_frames_make_curves_numbers(name, kind, ends):
    """In frames along the curve the matrix is that of numbers; residuals are logarithms."""
    space = ss.space(name)
    t, w, _ = data(False)
    curve = truth(space, end=1.0, step=0.3)
    noisy = beside(space, curve(t), 0.05)
    knots = knots_of(kind, t, False)
    dense = Dense(t, w, knots, ends)
    x = np.linspace(0, 1, 31)
    for lam in (1e-6, 1e-4):
        spline = ss.make_smoothing_spline(t, noisy, space, lam, weights=w, knots=knots, bc_type=ends, **TIGHT)
        assert spline.df == pytest.approx(dense.df(lam), rel=1e-6)
        rss = w @ space.distance(spline(t), noisy) ** 2
        sigma = np.sqrt(rss / (space.dim * (len(t) - dense.df(lam))))
        assert spline.sigma == pytest.approx(sigma, rel=1e-6)
        if kind == "few":
            assert spline.std(x, calibrated=False) == pytest.approx(sigma * np.sqrt(dense.variance(x, lam)), rel=1e-6)
        else:
            variance = process_variance(t, w, lam, x, 0, ends)
            assert spline.std(x, calibrated=False) == pytest.approx(sigma * np.sqrt(variance), rel=1e-6)
    # λ: the criterion of curves that are smoothed anew with others is least.
    chosen = ss.make_smoothing_spline(t, noisy, space, weights=w, knots=knots, bc_type=ends, **TIGHT)
    around = chosen.lam * np.exp([-0.3, 0.0, 0.3])
    fits = [
        ss.make_smoothing_spline(t, noisy, space, lam, weights=w, knots=knots, bc_type=ends, **TIGHT) for lam in around
    ]
    low, middle, high = (2 * np.log(fit.sigma) + np.log(40 - fit.df) - 2 * np.log(40 - 1.2 * fit.df) for fit in fits)
    assert low > middle < high
    # The lowest point of the parabola through the three.
    assert abs(0.15 * (low - high) / (low + high - 2 * middle)) < 0.05


def test_beyond_the_ends_the_deviation_is_that_of_a_straight_line():
    rng = np.random.default_rng(6)
    t = np.linspace(0, 1, 20)
    spline = ss.make_smoothing_spline(t, rng.standard_normal((20, 1)), "r:1", 1e12)
    # Of a straight line through 20 points: σ² (1/20 + (x − ½)²/Σ(t − ½)²).
    x = np.array([-1.0, 0.5, 2.0])
    wanted = spline.sigma * np.sqrt(1 / 20 + (x - 0.5) ** 2 / np.sum((t - 0.5) ** 2))
    # The largest λ leaves about this.
    assert np.allclose(spline.std(x, calibrated=False), wanted, rtol=1e-5)


def test_least_squares_are_orthogonal_to_natural_splines():
    rng = np.random.default_rng(7)
    t = np.sort(rng.random(200))
    t[[0, -1]] = 0, 1
    knots = np.array([0, 0.2, 0.35, 0.7, 1])
    y = np.sin(6 * t) + 0.1 * rng.standard_normal(200)
    spline = ss.make_lsq_spline(t, y[:, None], knots, "r:1")
    residual = y - spline(t)[:, 0]
    # No natural spline on the same knots comes nearer.
    for column in np.eye(5):
        direction = ss.CubicSpline(knots, column[:, None], "r:1")(t)[:, 0]
        assert abs(residual @ direction) < 1e-12
    assert spline.lam == 0 and spline.df == pytest.approx(5)

"""Smoothing of numbers, for which everything is known from other sources."""

from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest
from scipy.interpolate import make_lsq_spline

import symspline as ss


def reinsch(t, y, w, lam):
    """Values of the smoothing spline at the knots, in 50 digits: Green & Silverman (1994), §2.3.3."""
    with mp.workdps(50):
        t, y, w = ([mp.mpf(float(x)) for x in row] for row in (t, y, w))
        lam = mp.mpf(float(lam))
        n, h = len(t), [b - a for a, b in pairwise(t)]
        q, r = mp.zeros(n, n - 2), mp.zeros(n - 2)
        for j in range(1, n - 1):
            q[j - 1, j - 1], q[j, j - 1] = 1 / h[j - 1], -1 / h[j - 1] - 1 / h[j]
            q[j + 1, j - 1] = 1 / h[j]
            r[j - 1, j - 1] = (h[j - 1] + h[j]) / 3
            if j + 1 < n - 1:
                r[j - 1, j] = r[j, j - 1] = h[j] / 6
        spread = mp.diag([1 / x for x in w])
        gamma = mp.lu_solve(r + lam * q.T * spread * q, q.T * mp.matrix(y))
        return np.array([float(x) for x in mp.matrix(y) - lam * spread * q * gamma])


@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize("size", [1e-2, 1.0, 1e2, 1e4])
def test_is_the_spline_of_fifty_digits(even, size):
    rng = np.random.default_rng(3)
    n = 30
    t = np.linspace(0, 1, n) if even else np.sort(rng.random(n))
    y, w = np.sin(5 * t) + rng.standard_normal(n), rng.uniform(0.5, 2, n)
    lam = size * ((t[-1] - t[0]) / (n - 1)) ** 3
    spline = ss.make_smoothing_spline(t, y[:, None], "r:1", lam, weights=w)
    # λ grows by up to 1e4 what rounding makes of the accelerations.
    assert np.abs(spline.points[:, 0] - reinsch(t, y, w, lam)).max() < 1e-10
    assert spline.lam == pytest.approx(lam, rel=1e-13)


def dense(t, y, w, lam):
    """Smoother matrix and energy of the spline, dense."""
    n, h = len(t), np.diff(t)
    q, r = np.zeros((n, n - 2)), np.zeros((n - 2, n - 2))
    for j in range(1, n - 1):
        q[j - 1 : j + 2, j - 1] = 1 / h[j - 1], -1 / h[j - 1] - 1 / h[j], 1 / h[j]
        r[j - 1, j - 1] = (h[j - 1] + h[j]) / 3
        if j + 1 < n - 1:
            r[j - 1, j] = r[j, j - 1] = h[j] / 6
    penalty = q @ np.linalg.solve(r, q.T)
    a = np.diag(w) + lam * penalty
    return np.linalg.solve(a, np.diag(w)), penalty, a


CRITERIA = {
    "gcv 1": lambda n, rss, tr, *_: n * rss / (n - tr) ** 2,
    "gcv 1.4": lambda n, rss, tr, *_: n * rss / max(n - 1.4 * tr, 1e-9) ** 2,
    # Σ w(y − Sy)² + 2σ² tr S
    "cp 1": lambda n, rss, tr, *_: rss + 2 * 0.3**2 * tr,
    # Wahba (1985): y'W(1 − S)y over the root of the product of its eigenvalues that are not zero.
    "reml 1": lambda n, rss, tr, whole, det: (n - 2) * np.log(whole) - np.log(det),
}


@pytest.mark.parametrize("criterion", CRITERIA)
def test_chooses_the_best_by_its_criterion(criterion):
    rng = np.random.default_rng(4)
    n = 50
    t = np.sort(rng.random(n))
    y, w = np.sin(8 * t) + 0.3 * rng.standard_normal(n), rng.uniform(0.5, 2, n)

    def score(lam):
        smoother, *_ = dense(t, y, w, lam)
        rest = y - smoother @ y
        root = np.sqrt(w)
        # The symmetric form of 1 − S has the same eigenvalues.
        symmetric = np.eye(n) - root[:, None] * smoother / root
        values = np.sort(np.linalg.eigvalsh((symmetric + symmetric.T) / 2))[2:]
        return CRITERIA[criterion](n, w @ rest**2, np.trace(smoother), y @ (w * rest), np.prod(values))

    word, gamma = criterion.split()
    spline = ss.make_smoothing_spline(
        t, y[:, None], "r:1", weights=w, criterion=word, gamma=float(gamma), sigma=0.3, tol=1e-6
    )
    # The λ at which a parabola through three neighbours is lowest.
    around = spline.lam * np.exp([-0.05, 0.0, 0.05])
    low, middle, high = map(score, around)
    assert low > middle < high
    assert 0.05 * (low - high) / (low + high - 2 * middle) / 2 == pytest.approx(0, abs=5e-3)
    assert all(score(lam) > middle for lam in spline.lam * np.logspace(-6, 6, 25) if lam != spline.lam)


@pytest.mark.parametrize("nu", [0, 1])
def test_deviations_are_those_of_an_integrated_wiener_process(nu):
    """The posterior of y = x + noise for x with a flat prior on straight lines and ∫∫ of white noise (Wahba 1978)."""
    rng = np.random.default_rng(5)
    t, lam, sigma = np.sort(rng.random(25)), 1e-3, 0.2
    w = rng.uniform(0.5, 2, 25)
    spline = ss.make_smoothing_spline(t, rng.standard_normal((25, 1)), "r:1", lam, weights=w, sigma=sigma)
    x = np.concatenate([np.linspace(t[0], t[-1], 101), t])
    start = t[0]

    def kernel(a, b, da=0, db=0):
        """Covariance of x or x' at a with that at b, of variance σ²/λ."""
        a, b = np.meshgrid(a - start, b - start, indexing="ij")
        low = np.minimum(a, b)
        if (da, db) == (0, 0):
            return low**2 * (3 * np.maximum(a, b) - low) / 6
        if (da, db) == (1, 0):
            return np.where(a <= b, a * b - a**2 / 2, b**2 / 2)
        return low

    # The straight lines get a large variance.
    wide = 1e7
    line = lambda a, d: np.stack([np.ones_like(a), a - start] if d == 0 else [0 * a, 1 + 0 * a], -1)  # noqa: E731
    prior = lambda a, b, da, db: kernel(a, b, da, db) / lam + wide * line(a, da) @ line(b, db).T  # noqa: E731
    data = prior(t, t, 0, 0) + np.diag(1 / w)
    cross = prior(x, t, nu, 0)
    variance = np.diag(prior(x, x, nu, nu)) - np.einsum("ij,ji->i", cross, np.linalg.solve(data, cross.T))
    # The flat prior costs the reference digits.
    assert np.abs(spline.std(x, nu) / (sigma * np.sqrt(variance)) - 1).max() < 1e-5


def test_beyond_the_ends_the_deviation_is_that_of_a_straight_line():
    rng = np.random.default_rng(6)
    t = np.linspace(0, 1, 20)
    spline = ss.make_smoothing_spline(t, rng.standard_normal((20, 1)), "r:1", 1e12)
    # Of a straight line through 20 points: σ² (1/20 + (x − ½)²/Σ(t − ½)²).
    x = np.array([-1.0, 0.5, 2.0])
    wanted = spline.sigma * np.sqrt(1 / 20 + (x - 0.5) ** 2 / np.sum((t - 0.5) ** 2))
    # The largest λ leaves about this.
    assert np.allclose(spline.std(x), wanted, rtol=1e-5)


def test_least_squares_is_that_of_scipy():
    rng = np.random.default_rng(7)
    t = np.sort(rng.random(200))
    t[[0, -1]] = 0, 1
    knots = np.array([0, 0.2, 0.35, 0.7, 1])
    y = np.sin(6 * t) + 0.1 * rng.standard_normal(200)
    spline = ss.make_lsq_spline(t, y[:, None], knots, "r:1")
    # The natural splines among SciPy's: x'' = 0 at both ends, by weights that leave nothing else.
    full = np.r_[[0] * 3, knots, [1] * 3]
    basis = np.stack([make_lsq_spline(t, column, full)(t) for column in np.eye(200)], -1)
    assert np.abs(basis @ spline(t)[:, 0] - spline(t)[:, 0]).max() < 1e-12
    residual = y - spline(t)[:, 0]
    # No natural spline on the same knots comes nearer.
    for column in np.eye(5):
        direction = ss.CubicSpline(knots, column[:, None], "r:1")(t)[:, 0]
        assert abs(residual @ direction) < 1e-12
    assert spline.lam == 0 and spline.df == pytest.approx(5)


def test_coordinates_of_one_curve_share_their_smoothness():
    rng = np.random.default_rng(8)
    t, y = np.linspace(0, 1, 40), rng.standard_normal((40, 10))
    together = ss.make_smoothing_spline(t, y, "r:10", 1e-3)
    for c in range(10):
        alone = ss.make_smoothing_spline(t, y[:, c : c + 1], "r:1", 1e-3)
        assert np.abs(alone.points[:, 0] - together.points[:, c]).max() < 1e-13

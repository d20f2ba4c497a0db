"""Standard deviations at all times against dense computations with the integrated Wiener process."""

from math import factorial

import numpy as np
import pytest
from scipy.special import bernoulli

import symspline as ss

# The standard deviations here are arbitrary, which the audit of residuals reports.
pytestmark = pytest.mark.filterwarnings("ignore:The residuals:symspline.SmoothingWarning")

rng = np.random.default_rng(7)
GAP = np.sort(np.r_[rng.uniform(102, 104, 30), rng.uniform(107, 110, 30)])
RANDOM = np.sort(rng.uniform(-3, 5, 60))
EVEN = np.linspace(1000, 1006, 60)
ORDERS = {"acceleration": 2, "jerk": 3}


def states(t, w, lam, m, x, nu):
    """Variances of an open process from all states at once: dense least squares, solved by orthogonal factors."""
    sites = np.unique(np.r_[t, x])
    rows = np.zeros((m * (len(sites) - 1) + len(t), m * len(sites)))
    powers = np.arange(m)
    for k, h in enumerate(np.diff(sites)):
        taylor = [[h ** (j - i) / factorial(j - i) if j >= i else 0 for j in powers] for i in powers]
        i, j = np.meshgrid(m - 1 - powers, m - 1 - powers, indexing="ij")
        cov = h ** (i + j + 1) / ((i + j + 1) * factorials(i) * factorials(j)) / lam
        root = np.linalg.inv(np.linalg.cholesky(cov))
        rows[m * k : m * (k + 1), m * k : m * (k + 2)] = np.hstack([-root @ taylor, root])
    observed = m * np.searchsorted(sites, t)
    rows[m * (len(sites) - 1) + np.arange(len(t)), observed] = np.sqrt(w)
    inverse = np.linalg.inv(np.linalg.qr(rows, mode="r"))
    return np.sum(inverse[m * np.searchsorted(sites, x) + nu] ** 2, axis=1)


factorials = np.vectorize(factorial)


def periodic_kernel(s, t, m, period, nu=(0, 0)):
    """The same for the periodic process of mean zero: Bernoulli polynomials."""
    degree = 2 * m - sum(nu)
    numbers = bernoulli(degree)
    x = np.mod(np.subtract.outer(s, t) / period, 1)
    value = sum(factorial(degree) / factorial(k) / factorial(degree - k) * numbers[k] * x ** (degree - k)
                for k in range(degree + 1))  # fmt: skip
    return (-1) ** (m - 1 + nu[1]) * value / factorial(degree) * period ** (degree - 1)


def exact_std(t, w, lam, m, x, nu=0, period=None):
    """Standard deviation for noise of variance one; that of a closed process by kriging with an unknown mean."""
    # Moderate units keep the dense matrices well conditioned.
    unit = period or (t[-1] - t[0]) / len(t)
    t, x, lam = (t - t[0]) / unit, (x - t[0]) / unit, lam / unit ** (2 * m - 1)
    if period is None:
        return np.sqrt(states(t, w, lam, m, x, nu)) / unit**nu
    inverse = np.linalg.inv(periodic_kernel(t, t, m, 1.0) / lam + np.diag(1 / w))
    cross = periodic_kernel(x, t, m, 1.0, (nu, 0)) / lam
    own = periodic_kernel(x[:1], x[:1], m, 1.0, (nu, nu))[0, 0] / lam
    rest = float(nu == 0) - cross @ inverse.sum(axis=1)
    variance = own - np.sum(cross @ inverse * cross, axis=1) + rest**2 / inverse.sum()
    return np.sqrt(variance) / unit**nu


def noisy(t, period=1.5):
    return np.sin(2 * np.pi * t / period) + 0.1 * np.random.default_rng(3).standard_normal(len(t))


@pytest.mark.parametrize("penalty", ["acceleration", "jerk"])
@pytest.mark.parametrize("t", [EVEN, RANDOM, GAP], ids=["even", "random", "gap"])
@pytest.mark.parametrize("nu", [0, 1])
@pytest.mark.parametrize("lam", [None, 1e-2])
def test_std_is_that_of_the_process_at_all_times(penalty, t, nu, lam):
    w = np.random.default_rng(2).uniform(0.2, 5, len(t))
    s = ss.make_smoothing_spline(t, noisy(t)[:, None], "r:1", lam, weights=w, penalty=penalty, sigma=0.1)
    x = np.linspace(t[0], t[-1], 151)
    exact = 0.1 * exact_std(t, w, s.lam, ORDERS[penalty], x, nu)
    np.testing.assert_allclose(s.std(x, nu=nu, calibrated=False), exact, rtol=2e-3)
    # The covariance of one time and the file have the same variance.
    np.testing.assert_allclose(np.sqrt(s.cov(x, nu=nu, calibrated=False)[:, 0, 0]), exact, rtol=2e-3)


@pytest.mark.parametrize("penalty", ["acceleration", "jerk"])
@pytest.mark.parametrize("nu", [0, 1])
def test_std_of_a_closed_curve(penalty, nu):
    t = np.sort(np.random.default_rng(4).uniform(10, 15.9, 50))
    knots = np.unique(np.r_[10, t, 16])
    s = ss.make_smoothing_spline(
        t, noisy(t, 2)[:, None], "r:1", 1e-4, knots=knots, bc_type="periodic", penalty=penalty, sigma=0.1
    )
    x = np.linspace(9, 17, 99)
    exact = 0.1 * exact_std(t, np.ones(50), 1e-4, ORDERS[penalty], x, nu, period=6.0)
    np.testing.assert_allclose(s.std(x, nu=nu, calibrated=False), exact, rtol=2e-3)


def test_std_of_products_batches_and_files(tmp_path):
    t, x = RANDOM, np.linspace(RANDOM[0], RANDOM[-1], 77)
    points = np.stack([noisy(t), noisy(t, 3)])[..., None]
    batch = ss.make_smoothing_spline(t, points, "r:1", penalty="jerk", sigma=0.1)
    product = ss.make_smoothing_spline(t, tuple(points), "r:1 x r:1", penalty="jerk", sigma=0.1)
    batch.save(tmp_path / "curves.npz")
    stored = ss.load(tmp_path / "curves.npz")
    for i in range(2):
        exact = 0.1 * exact_std(t, np.ones(60), batch.lam[i], 3, x)
        np.testing.assert_allclose(batch.std(x, calibrated=False)[i], exact, rtol=2e-3)
        np.testing.assert_allclose(product.std(x, calibrated=False)[i], exact, rtol=2e-3)
        assert np.array_equal(stored.std(x, calibrated=False)[i], batch.std(x, calibrated=False)[i])
        assert np.array_equal(batch[i].std(x, calibrated=False), batch.std(x, calibrated=False)[i])


def test_information_matrices_scale_the_variance_of_the_process():
    t, x = GAP, np.linspace(GAP[0], GAP[-1], 99)
    y = np.stack([noisy(t), noisy(t, 2)], axis=1)
    w = np.broadcast_to(4 * np.eye(2), (60, 2, 2))
    s = ss.make_smoothing_spline(t, y, "r:2", 1e-3, weights=w, penalty="jerk", sigma=1.0)
    np.testing.assert_allclose(s.std(x, calibrated=False), exact_std(t, np.full(60, 4.0), 1e-3, 3, x), rtol=2e-3)

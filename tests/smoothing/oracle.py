"""Smoothing by dense matrices: an independent reference for λ, degrees of freedom, deviations and bands.

Everything follows from one matrix E with the cubic splines that satisfy the conditions at the ends as its columns. They
are SciPy's interpolants of unit vectors, not the B-splines of the library; integrals are Gauss-Legendre's.
"""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar


class Dense:
    """The penalised least squares problem of numbers.

    Parameters
    ----------
    t, w : ndarray, shape (N,)
        Times and weights of the data.
    knots : ndarray, shape (K,)
    ends : {"natural", "clamped", "periodic"} or pair of the first two
    factors : float or ndarray, shape (K - 1,)
        Factors of the penalty in the segments.
    """

    def __init__(self, t, w, knots, ends="natural", factors=1.0):
        self.t, self.w, self.knots = t, w, knots
        self.closed = ends == "periodic"
        count = len(knots) - self.closed
        unit = np.eye(count)
        if self.closed:
            self.curve = CubicSpline(knots, np.vstack([unit, unit[:1]]), bc_type="periodic")
        else:
            pair = (ends, ends) if isinstance(ends, str) else ends
            kinds = tuple({"natural": (2, np.zeros(count)), "clamped": (1, np.zeros(count))}[end] for end in pair)
            self.curve = CubicSpline(knots, unit, bc_type=kinds)
        self.null = 2 if ends == "natural" else 1
        self.values = self.rows(t)
        x, weights = np.polynomial.legendre.leggauss(3)
        h = np.diff(knots)
        at = (knots[:-1, None] + 0.5 * h[:, None] * (1 + x)).ravel()
        second = self.curve(at, 2)
        self.penalty = second.T @ ((0.5 * (factors * h)[:, None] * weights).ravel()[:, None] * second)
        self.gram = self.values.T @ (w[:, None] * self.values)

    def rows(self, x, nu=0):
        """Values or derivatives of the basis at times."""
        return self.curve(x, nu)

    def inverse(self, lam):
        return np.linalg.inv(self.gram + lam * self.penalty)

    def df(self, lam):
        return np.trace(self.inverse(lam) @ self.gram)

    def fit(self, y, lam):
        """Values at the knots."""
        return self.inverse(lam) @ self.values.T @ (self.w[:, None] * y)

    def rss(self, y, lam):
        rest = y - self.values @ self.fit(y, lam)
        return np.sum(self.w[:, None] * rest**2)

    def sigma(self, y, lam):
        return np.sqrt(self.rss(y, lam) / (y.shape[1] * (len(self.t) - self.df(lam))))

    def variance(self, x, lam, nu=0):
        """Of a spline on the knots with the prior precision λ · penalty."""
        rows = self.rows(x, nu)
        return np.einsum("ij,jk,ik->i", rows, self.inverse(lam), rows)

    def score(self, criterion, y, lam, gamma=1.2, sigma=None):
        """What a criterion minimises."""
        n, m, df = len(self.t), y.shape[1], self.df(lam)
        rss = self.rss(y, lam) / m
        if criterion == "gcv":
            return np.log(rss) - 2 * np.log(n - gamma * df) if n > gamma * df else np.inf
        if criterion == "cp":
            return rss + 2 * sigma**2 * df
        # Minus twice the logarithm of the likelihood of what does not depend on the penalty's null space.
        c = self.fit(y, lam)
        whole = rss + lam * np.trace(c.T @ self.penalty @ c) / m
        values = np.linalg.eigvalsh(self.gram + lam * self.penalty)
        rank = len(self.penalty) - self.null
        return (n - self.null) * np.log(whole) + np.log(values).sum() - rank * np.log(lam)

    def best(self, criterion, y, near, **options):
        """The λ at the minimum within a factor of ten."""
        found = minimize_scalar(
            lambda x: self.score(criterion, y, np.exp(x), **options),
            bounds=np.log(near) + np.array([-2.3, 2.3]),
            method="bounded",
            options={"xatol": 1e-10},
        )
        return np.exp(found.x)


def process_variance(t, w, lam, x, nu=0, ends="natural", span=None, knots=None):
    """Of an integrated Wiener process with a flat prior for straight lines, seen at times t: Wahba (1978).

    λ may be that of the segments between knots; these are among t and x.

    As a linear regression on values and slopes at t and x: an exact Markov representation, without any spline. Slopes
    that are given at the ends are seen exactly; a closed process goes on at the start of ``span`` where it ends.
    """
    closed = ends == "periodic"
    grid = np.unique(np.r_[t, x])
    size = 2 * len(grid)
    precision = np.zeros((size, size))
    steps = np.append(np.diff(grid), span - grid[-1] + grid[0]) if closed else np.diff(grid)
    for i, h in enumerate(steps):
        here = lam
        if knots is not None:
            middle = grid[i] + 0.5 * h
            turned = knots[0] + np.mod(middle - knots[0], span) if closed else middle
            here = lam[np.searchsorted(knots[1:-1], turned, "right")]
        noise = np.array([[h**3 / 3, h**2 / 2], [h**2 / 2, h]]) / here
        step = np.hstack([-np.array([[1, h], [0, 1]]), np.eye(2)])
        at = np.arange(2 * i, 2 * i + 4) % size
        precision[np.ix_(at, at)] += step.T @ np.linalg.solve(noise, step)
    np.add.at(precision, (2 * np.searchsorted(grid, t),) * 2, w)
    if ends == "clamped":
        precision[[1, -1], [1, -1]] += 1e9
    covariance = np.linalg.inv(precision)
    at = 2 * np.searchsorted(grid, x) + nu
    return covariance[at, at]

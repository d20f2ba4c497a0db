"""Riemannian cubics through points of S², by SciPy's solver for boundary value problems.

A curve γ that minimises ∫ |∇γ'|² among all that pass through the points at their times satisfies between
them

    ∇³γ' + R(∇γ', γ')γ' = 0,    on the unit sphere R(a, v)v = |v|²a − ⟨a, v⟩v,

is C² at the inner points, and has ∇γ' = 0 at both ends: the equation is that of L. Noakes, G. Heinzinger
and B. Paden, *Cubic splines on curved spaces* (1989). Here it is written for latitude, longitude, and the
components of γ', ∇γ' and ∇²γ' to the north and to the east: eight numbers on every interval, all intervals
side by side over the time from 0 to 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

import symspline as ss

Array = NDArray[np.float64]


class RiemannianCubic:
    """The C² curve of Riemannian cubics with natural ends, found by Newton's method from the spline.

    Args:
        spline: the spline whose points it passes through; no pole may be near the two curves.
        tol: relative tolerance of the collocation.
    """

    def __init__(self, spline: ss.CubicSpline, tol: float = 1e-7) -> None:
        t, points = spline.t, spline.points
        self.t, self.h = t, np.diff(t)
        n = len(self.h)
        places = _places(points)

        def slope(_: Array, y: Array) -> Array:
            return (self.h[:, None] * _slope(y.reshape(8, n, -1))).reshape(8 * n, -1)

        def conditions(first: Array, last: Array) -> Array:
            a, b = first.reshape(8, n), last.reshape(8, n)
            hits = np.concatenate([a[:2] - places[:, :-1], b[:2] - places[:, 1:]])
            joins = b[2:6, :-1] - a[2:6, 1:]
            return np.concatenate([hits.ravel(), joins.ravel(), a[4:6, 0], b[4:6, -1]])

        mesh = np.linspace(0, 1, 5)
        start = _start(spline, t[:-1, None] + self.h[:, None] * mesh)
        found = solve_bvp(
            slope, conditions, mesh, start.reshape(8 * n, -1), tol=tol, bc_tol=1e-11, max_nodes=10_000
        )
        if not found.success:
            raise RuntimeError(f"no Riemannian cubic found: {found.message}")
        self._solution = found.sol

    def state(self, s: Array) -> Array:
        """Latitude, longitude, γ', ∇γ' and ∇²γ' at the parts s of every interval, shape (8, N, len(s))."""
        return self._solution(s).reshape(8, len(self.h), -1)

    def ambient(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """γ, γ', ∇γ' and ∇²γ' as vectors of R³, each of shape (N, len(s), 3)."""
        y = self.state(s)
        point, north, east = _frame(*y[:2])
        vectors = [y[i, ..., None] * north + y[i + 1, ..., None] * east for i in (2, 4, 6)]
        return point, *vectors

    def __call__(self, x: Array) -> Array:
        """Points at increasing times x, shape (len(x), 3)."""
        interval = np.clip(np.searchsorted(self.t, x, side="right") - 1, 0, len(self.h) - 1)
        y = np.empty((2, len(x)))
        for k in np.unique(interval):
            here = interval == k
            s = (x[here] - self.t[k]) / self.h[k]
            y[:, here] = self.state(s)[:2, k]
        return _frame(*y)[0]

    def energy(self) -> float:
        """∫ |∇γ'|² dt."""
        s, weights = np.polynomial.legendre.leggauss(12)
        square = np.sum(self.state((s + 1) / 2)[4:6] ** 2, axis=0)
        return float(self.h @ square @ weights / 2)


def _frame(latitude: Array, longitude: Array) -> tuple[Array, Array, Array]:
    """The point, and the unit vectors to the north and to the east."""
    sin, cos = np.sin(latitude), np.cos(latitude)
    x, y, zero = np.cos(longitude), np.sin(longitude), np.zeros_like(latitude)
    point = np.stack([cos * x, cos * y, sin], axis=-1)
    north = np.stack([-sin * x, -sin * y, cos], axis=-1)
    return point, north, np.stack([-y, x, zero], axis=-1)


def _slope(y: Array) -> Array:
    """dy/dt."""
    latitude, _, v1, v2, a1, a2, j1, j2 = y
    # A parallel vector turns against north and east at this rate.
    turn = v2 * np.tan(latitude)
    square, inner = v1 * v1 + v2 * v2, a1 * v1 + a2 * v2
    return np.stack(
        [
            v1,
            v2 / np.cos(latitude),
            a1 - turn * v2,
            a2 + turn * v1,
            j1 - turn * a2,
            j2 + turn * a1,
            inner * v1 - square * a1 - turn * j2,
            inner * v2 - square * a2 + turn * j1,
        ]
    )


def _places(points: Array) -> Array:
    """Latitude and continuous longitude, shape (2, N+1)."""
    longitude = np.unwrap(np.arctan2(points[..., 1], points[..., 0]))
    return np.stack([np.arcsin(points[..., 2]), longitude])


def _start(spline: ss.CubicSpline, x: Array) -> Array:
    """The state of the spline at times x, one row per interval."""
    points, accelerations = spline(x), spline(x, nu=2)
    places = _places(points.reshape(-1, 3)).reshape(2, *x.shape)
    _, north, east = _frame(*places)
    # Constant on an interval, as in flat space.
    brought = spline.space.transport(points[:, -1], points[:, 0], accelerations[:, -1])
    jerk = (brought - accelerations[:, 0]) / np.ptp(x, axis=1)[:, None]
    vectors = spline(x, nu=1), accelerations, jerk[:, None]
    parts = [np.sum(vector * to, axis=-1) for vector in vectors for to in (north, east)]
    return np.stack([*places, *parts])

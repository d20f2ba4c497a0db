"""Is a curve a critical point of ∫ |∇γ'|² dt, and does it satisfy the equation of Riemannian cubics?

Both are asked of points on the curve alone: derivatives are those of polynomials through them, taken in the
space of matrices or vectors around, and projected. So nothing is used that found the curve.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

import symspline as ss

Array = NDArray[np.float64]
DEGREE = 14


class Variation(NamedTuple):
    """How the energy changes when the curve is moved aside by ε w, with w = 0 at the points."""

    slope: float
    """Its derivative by ε at 0, relative to the energy."""
    rise: float
    """The smaller of its changes for a small ε and −ε, relative to the energy."""


def energy(space: ss.Space, t: Array, curve: Callable[[Array], Array]) -> float:
    """∫ |∇γ'|² dt of a curve that is smooth between the times t."""
    h, s = np.diff(t), nodes()
    points = curve(_times(t, s))
    values = points.reshape(len(h), len(s), -1)
    second = np.einsum("ij,kjn->kin", _derivative(s) @ _derivative(s), values) / h[:, None, None] ** 2
    second = second.reshape(-1, *space.point_shape)
    bend = space.project_tangent(points, second)
    squares = space.inner(points, bend, bend).reshape(len(h), len(s))
    return float(h @ squares @ _weights(s))


def vary(
    space: ss.Space, t: Array, curve: Callable[[Array], Array], rng: np.random.Generator, step: float = 1e-3
) -> Variation:
    """One random variation. The points must be equidistant in time.

    The field w is smooth, and its derivative at the points is not 0: that the curve is C² there, and has
    natural ends, is part of the question.
    """
    size = int(np.prod(space.point_shape))
    waves, phases = rng.uniform(0.2, 2, (4, size)), rng.uniform(0, 2 * np.pi, (4, size))

    def moved(epsilon: float) -> Callable[[Array], Array]:
        def points(x: Array) -> Array:
            p, u = curve(x), (x - t[0]) / (t[1] - t[0])
            field = np.sin(np.pi * u)[:, None] * np.sin(u[:, None, None] * waves + phases).sum(axis=1)
            return space.exp(p, epsilon * space.project_tangent(p, field.reshape(p.shape)))

        return points

    still = energy(space, t, curve)
    back2, back, there, there2 = (energy(space, t, moved(k * step)) for k in (-2, -1, 1, 2))
    # The difference quotient of order 4: third derivatives of the energy are large.
    slope = (8 * (there - back) - (there2 - back2)) / (12 * step)
    return Variation(slope / still, min(there, back) / still - 1)


def defect(t: Array, x: Array, v: Array, a: Array, j: Array) -> float:
    """How badly x' = v, ∇v = a, ∇a = j, ∇j = −R(a, v)v are satisfied on S² at the nodes, the largest of the
    four relative to the largest value of what is on the right. Arrays have shape (N, len(nodes), 3)."""
    force = np.sum(a * v, axis=-1, keepdims=True) * v - np.sum(v * v, axis=-1, keepdims=True) * a
    worst = 0.0
    for left, right in ((x, v), (v, a), (a, j), (j, force)):
        worst = max(worst, float(np.abs(slopes(t, x, left) - right).max() / np.abs(right).max()))
    return worst


def slopes(t: Array, x: Array, v: Array) -> Array:
    """Covariant derivatives on S² of vectors v at the points x of the nodes, which have shape (N, len(nodes), 3)."""
    slope = np.einsum("ij,kjn->kin", _derivative(nodes()), v) / np.diff(t)[:, None, None]
    projected: Array = slope - np.sum(slope * x, axis=-1, keepdims=True) * x
    return projected


def nodes() -> Array:
    """Where in an interval the curve is asked for: Chebyshev points from 0 to 1."""
    return (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)) / 2


def _times(t: Array, s: Array) -> Array:
    return (t[:-1, None] + np.diff(t)[:, None] * s).ravel()


def _derivative(s: Array) -> Array:
    """Matrix from values at s to derivatives there."""
    x = 2 * s - 1
    slopes = chebyshev.chebval(x, chebyshev.chebder(np.eye(DEGREE + 1))).T
    return 2 * slopes @ np.linalg.inv(chebyshev.chebvander(x, DEGREE))


def _weights(s: Array) -> Array:
    """Weights of the integral from 0 to 1."""
    antiderivative = chebyshev.chebint(np.eye(DEGREE + 1), lbnd=-1)
    return chebyshev.chebval(1.0, antiderivative) / 2 @ np.linalg.inv(chebyshev.chebvander(2 * s - 1, DEGREE))

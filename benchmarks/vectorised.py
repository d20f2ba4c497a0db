"""The fit in NumPy, vectorised over curves: unit knots, natural ends, Newton's method with the flat
matrix as in symspline, to the same residual.

Points and vectors are written in frames that move along the curve. A frame at p is a pair of matrices with
p = ab, and a matrix v stands for the tangent vector avb. In it the transvection (10) is
E_p(v) x = a e^{v/2} a⁻¹ x b⁻¹ e^{v/2} b: with g = a e^{v/2} a⁻¹ it is x ↦ gxg* for positive definite matrices, where
b = a*, and p e^{v/2} p⁻¹ x e^{v/2} in a group, where a = p and b = 1. With d for log_p of the next point,
(a e^{d/2}, e^{d/2} b) is the frame there, in which parallel vectors have the same matrices.

The C² condition (13) on unit knots is w⁺ − w⁻ = 2v, with control points exp_p(±v), v a third of the
velocity. Between two knots with v and v' let m = e^{−v/2} e^{d/2} e^{−v'/2} and n = e^{−v'/2} e^{d/2} e^{−v/2}. Then
w⁺ = log(mn) at the first knot, and w⁻ = −log(nm) at the second.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from .data import Array

MOST = 50
"""Iterations after which it has failed."""


class Geometry(Protocol):
    """What the fit asks of a space. Vectors are the v and d above."""

    def unroll(self, points: Array) -> tuple[Array, Any]:
        """The d of every segment, and the frames of the points."""

    def half(self, v: Array) -> Array:
        """e^{v/2}."""

    def logs(self, before: Array, middle: Array, after: Array) -> tuple[Array, Array]:
        """w⁺ and w⁻ of every segment, from e^{−v/2}, e^{d/2} and e^{−v'/2}."""

    def tangents(self, frames: Any, v: Array) -> Array:
        """The tangent vectors that v stands for."""


def fit(points: Array, geometry: Geometry, tol: float = 1e-12) -> Array:
    """Velocities of the C² splines through points, shape (curves, knots, rows, columns).

    The residual is that of `symspline.Report`, in the norm of matrices: the largest defect beside the largest
    speed. All curves go on until the last one is below ``tol``.
    """
    chords, frames = geometry.unroll(points)
    middle = geometry.half(chords)
    v = np.zeros((*points.shape[:2], *chords.shape[2:]), chords.dtype)
    defect = _defect(chords, -chords, v)
    for _ in range(MOST):
        v += _newton(defect)
        half = geometry.half(-v)
        defect = _defect(*geometry.logs(half[:, :-1], middle, half[:, 1:]), v)
        if np.all(_largest(defect[:, [0, -1]], defect[:, 1:-1] / 2) <= tol * _largest(3 * v)):
            return geometry.tangents(frames, 3 * v)
    raise RuntimeError(f"no convergence in {MOST} iterations")


def _defect(plus: Array, minus: Array, v: Array) -> Array:
    """w⁺ − w⁻ − 2v at inner knots; at natural ends, (20), w⁺ − v, and its mirror image −w⁻ − v."""
    defect = -v
    defect[:, 1:-1] -= v[:, 1:-1]
    defect[:, :-1] += plus
    defect[:, 1:] -= minus
    return defect


def _newton(defect: Array) -> Array:
    """x with 2x₀ + x₁ = f₀, xᵢ₋₁ + 4xᵢ + xᵢ₊₁ = fᵢ, and at the end the mirror image of the first equation."""
    last = defect.shape[1] - 1
    x, pivots = defect.copy(), [2.0]
    x[:, 0] /= 2
    for i in range(1, last + 1):
        pivots.append((4 if i < last else 2) - 1 / pivots[-1])
        x[:, i] = (x[:, i] - x[:, i - 1]) / pivots[-1]
    for i in reversed(range(last)):
        x[:, i] -= x[:, i + 1] / pivots[i]
    return x


def _largest(*vectors: Array) -> Array:
    """The largest norm of all of a curve's vectors."""
    return np.max([np.linalg.norm(v, axis=(2, 3)).max(axis=1, initial=0) for v in vectors], axis=0)

"""Geodesics in closed forms: what de Casteljau's algorithm needs of a space.

Arrays have any axes in front of those of a point. Angles are squared wherever they occur, so the formulas are smooth
where they are zero.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .library import Library, adjoint, hermitian


class Model:
    """Flat space; the others override what differs. Points inside may be other arrays than outside."""

    axes = 1

    def __init__(self, lib: Library) -> None:
        self.lib = lib

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        """Return the nearest points of the space, and the nearest tangent vectors there."""
        return points, velocities

    def from_internal(self, points: Any) -> Any:
        """Return points as the arrays of the user."""
        return points

    def velocities_from_internal(self, points: Any, velocities: Any) -> Any:
        """Return velocities at internal points as the arrays of the user."""
        return velocities

    def exp(self, p: Any, v: Any) -> Any:
        """Return the geodesic from p with velocity v at time 1."""
        return p + v

    def log(self, p: Any, q: Any) -> Any:
        """Return the inverse of `exp`."""
        return q - p

    def between(self, p: Any, q: Any, t: Any) -> Any:
        """Return the geodesic from p to q at time t."""
        return self.exp(p, self.times(t, self.log(p, q)))

    def times(self, t: Any, v: Any) -> Any:
        """Multiply vectors by one factor each."""
        return t[(..., *(None,) * self.axes)] * v


class Curved(Model):
    """Spheres for sign 1 and hyperbolic spaces for sign −1: vectors with ⟨p, p⟩ = sign."""

    def __init__(self, lib: Library, sign: int) -> None:
        super().__init__(lib)
        self.sign = sign

    def inner(self, u: Any, v: Any) -> Any:
        """Return the product in which points have length one, with an axis of its own."""
        products = u * v
        if self.sign > 0:
            return products.sum(axis=-1, keepdims=True)
        return products[..., 1:].sum(axis=-1, keepdims=True) - products[..., :1]

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        points = points / self.lib.xp.sqrt(self.sign * self.inner(points, points))
        return points, velocities - self.sign * self.inner(points, velocities) * points

    def exp(self, p: Any, v: Any) -> Any:
        z = self.inner(v, v)
        return self.lib.stumpff(0, self.sign, z) * p + self.lib.stumpff(1, self.sign, z) * v

    def log(self, p: Any, q: Any) -> Any:
        d, s = q - p, q + p
        y = 0.25 * self.inner(d, d)
        return self.lib.arc(y, 0.25 * self.sign * self.inner(s, s), self.sign) * (d + 2 * self.sign * y * p)


class Lines(Model):
    """Unit vectors up to a phase or a sign."""

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        points = points / self.lib.xp.sqrt(_product(points, points).real)
        return points, velocities - points * _product(points, velocities)

    def exp(self, p: Any, v: Any) -> Any:
        z = _product(v, v).real
        return self.lib.stumpff(0, 1, z) * p + self.lib.stumpff(1, 1, z) * v

    def log(self, p: Any, q: Any) -> Any:
        overlap = _product(p, q)
        beside = q - p * overlap
        y = _product(beside, beside).real
        return self.lib.arc(y, _product(overlap, overlap).real, 1) * overlap.conj() * beside


def _product(u: Any, v: Any) -> Any:
    return (u.conj() * v).sum(axis=-1, keepdims=True)


# ---- geodesics of subspaces and of positive definite matrices ----

# Newton's iteration for the nearest orthonormal columns is at rounding after so many steps from singular values
# between .4 and 1.5.
_STEPS = 9
# cos and sin of a matrix are series of what is this many times halved, which angles up to 2³ need.
_HALVINGS = 3
_TERMS = 12


class Planes(Model):
    """Orthonormal columns up to a unitary factor on their right: Edelman, Arias & Smith (1998)."""

    axes = 2

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        points = orthonormal(self.lib, points)
        return points, velocities - points @ (adjoint(points) @ velocities)

    def exp(self, p: Any, v: Any) -> Any:
        cosine, sine = _trigonometric(self.lib, adjoint(v) @ v)
        return p @ cosine + v @ sine

    def log(self, p: Any, q: Any) -> Any:
        assert self.lib.arcs is not None
        overlap = adjoint(p) @ q
        beside = q - p @ overlap
        return beside @ self.lib.arcs(adjoint(beside) @ beside) @ adjoint(overlap)


class Positive(Model):
    """Positive definite matrices with the affine-invariant metric."""

    axes = 2

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        return hermitian(points), hermitian(velocities)

    def exp(self, p: Any, v: Any) -> Any:
        root = self.lib.xp.linalg.cholesky(p)
        return root @ self.lib.exponential(whitened(self.lib, root, v)) @ adjoint(root)

    def log(self, p: Any, q: Any) -> Any:
        root = self.lib.xp.linalg.cholesky(p)
        return root @ self.lib.logarithm(whitened(self.lib, root, q)) @ adjoint(root)

    def between(self, p: Any, q: Any, t: Any) -> Any:
        root = self.lib.xp.linalg.cholesky(p)
        step = self.lib.logarithm(whitened(self.lib, root, q))
        return root @ self.lib.exponential(self.times(t, step)) @ adjoint(root)


def identity(lib: Library, like: Any) -> Any:
    """Return the identity matrix of the size of the last axis."""
    return lib.constant(np.eye(like.shape[-1]), like)


def orthonormal(lib: Library, columns: Any) -> Any:
    """Return the nearest orthonormal columns; NaN where the given ones are too far off for the iteration."""
    one = identity(lib, columns)
    for _ in range(_STEPS):
        columns = 0.5 * columns @ (3 * one - adjoint(columns) @ columns)
    off = lib.xp.amax(abs(adjoint(columns) @ columns - one), (-2, -1))[..., None, None]
    return lib.xp.where(off < 1e-5, columns, float("nan"))


def _trigonometric(lib: Library, square: Any) -> tuple[Any, Any]:
    """cos √z and sin √z / √z of Hermitian matrices z without negative eigenvalues."""
    one = identity(lib, square)
    z = square / 4**_HALVINGS
    cosine = sine = one
    for n in range(_TERMS, 0, -1):
        cosine = one - z @ cosine / (2 * n * (2 * n - 1))
        sine = one - z @ sine / (2 * n * (2 * n + 1))
    for _ in range(_HALVINGS):
        cosine, sine, z = one - 2 * z @ sine @ sine, cosine @ sine, 4 * z
    return cosine, sine


def whitened(lib: Library, root: Any, x: Any) -> Any:
    """L⁻¹ x L⁻* for a Hermitian x."""
    left = lib.solve_lower(root, x)
    return hermitian(adjoint(lib.solve_lower(root, adjoint(left))))

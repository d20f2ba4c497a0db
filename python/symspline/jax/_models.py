"""Geodesics in JAX: what de Casteljau's algorithm needs of a space, in closed forms.

Arrays have any axes in front of those of a point. Angles are squared wherever they stand, so that nothing has a
corner where they are zero.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax.scipy.linalg import expm, solve_triangular

from .._quaternions import Rows, quaternion_rows, rotation_rows
from ._series import arc, stumpff, unbent
from ._spectral import adjoint, arcs, hermitian, logarithm


class Model:
    """Flat space; the others override what differs. Points inside may be other arrays than outside."""

    axes = 1

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        """Points moved to the nearest of the space, and velocities moved to be tangent there."""
        return points, velocities

    def from_internal(self, points: Any) -> Any:
        """Arrays as they are outside."""
        return points

    def exp(self, p: Any, v: Any) -> Any:
        """Where the geodesic from p with velocity v is at time 1."""
        return p + v

    def log(self, p: Any, q: Any) -> Any:
        """The inverse of `exp`."""
        return q - p

    def between(self, p: Any, q: Any, t: Any) -> Any:
        """The geodesic from p to q at time t."""
        return self.exp(p, self.times(t, self.log(p, q)))

    def times(self, t: Any, v: Any) -> Any:
        """Vectors with a factor each."""
        return jnp.expand_dims(t, tuple(range(-self.axes, 0))) * v


class Curved(Model):
    """Spheres for sign 1 and hyperbolic spaces for sign −1: vectors with ⟨p, p⟩ = sign."""

    def __init__(self, sign: int) -> None:
        self.sign = sign

    def inner(self, u: Any, v: Any) -> Any:
        """The product in which points have length one, with an axis of its own."""
        products = u * v
        if self.sign > 0:
            return jnp.sum(products, axis=-1, keepdims=True)
        return jnp.sum(products[..., 1:], axis=-1, keepdims=True) - products[..., :1]

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        points = points / jnp.sqrt(self.sign * self.inner(points, points))
        return points, velocities - self.sign * self.inner(points, velocities) * points

    def exp(self, p: Any, v: Any) -> Any:
        z = self.inner(v, v)
        return stumpff(0, self.sign, z) * p + stumpff(1, self.sign, z) * v

    def log(self, p: Any, q: Any) -> Any:
        d, s = q - p, q + p
        y = 0.25 * self.inner(d, d)
        return arc(y, 0.25 * self.sign * self.inner(s, s), self.sign) * (d + 2 * self.sign * y * p)


class Lines(Model):
    """Unit vectors up to a phase or a sign."""

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        points = points / jnp.sqrt(_product(points, points).real)
        return points, velocities - points * _product(points, velocities)

    def exp(self, p: Any, v: Any) -> Any:
        z = _product(v, v).real
        return stumpff(0, 1, z) * p + stumpff(1, 1, z) * v

    def log(self, p: Any, q: Any) -> Any:
        overlap = _product(p, q)
        beside = q - p * overlap
        y = _product(beside, beside).real
        return arc(y, _product(overlap, overlap).real) * jnp.conj(overlap) * beside


def _product(u: Any, v: Any) -> Any:
    return jnp.sum(jnp.conj(u) * v, axis=-1, keepdims=True)


# ---- geodesics of subspaces and of positive definite matrices in JAX ----

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
        points = orthonormal(points)
        return points, velocities - points @ (adjoint(points) @ velocities)

    def exp(self, p: Any, v: Any) -> Any:
        cosine, sine = _trigonometric(adjoint(v) @ v)
        return p @ cosine + v @ sine

    def log(self, p: Any, q: Any) -> Any:
        overlap = adjoint(p) @ q
        beside = q - p @ overlap
        return beside @ arcs(adjoint(beside) @ beside) @ adjoint(overlap)


class Positive(Model):
    """Positive definite matrices with the affine-invariant metric."""

    axes = 2

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        return hermitian(points), hermitian(velocities)

    def exp(self, p: Any, v: Any) -> Any:
        root = jnp.linalg.cholesky(p)
        return root @ expm(_whitened(root, v)) @ adjoint(root)

    def log(self, p: Any, q: Any) -> Any:
        root = jnp.linalg.cholesky(p)
        return root @ logarithm(_whitened(root, q)) @ adjoint(root)

    def between(self, p: Any, q: Any, t: Any) -> Any:
        root = jnp.linalg.cholesky(p)
        step = logarithm(_whitened(root, q))
        return root @ expm(self.times(t, step)) @ adjoint(root)


def orthonormal(columns: Any) -> Any:
    """The nearest orthonormal columns; NaN where the given ones are so far off that the iteration does not end."""
    one = jnp.eye(columns.shape[-1], dtype=columns.dtype)
    for _ in range(_STEPS):
        columns = 0.5 * columns @ (3 * one - adjoint(columns) @ columns)
    off = jnp.abs(adjoint(columns) @ columns - one).max(axis=(-2, -1), keepdims=True)
    return jnp.where(off < 1e-5, columns, jnp.nan)


def _trigonometric(square: Any) -> tuple[Any, Any]:
    """cos √z and sin √z / √z of Hermitian matrices z without negative eigenvalues."""
    one = jnp.eye(square.shape[-1], dtype=square.dtype)
    z = square / 4**_HALVINGS
    cosine = sine = one
    for n in range(_TERMS, 0, -1):
        cosine = one - z @ cosine / (2 * n * (2 * n - 1))
        sine = one - z @ sine / (2 * n * (2 * n + 1))
    for _ in range(_HALVINGS):
        cosine, sine, z = one - 2 * z @ sine @ sine, cosine @ sine, 4 * z
    return cosine, sine


def _whitened(root: Any, x: Any) -> Any:
    """L⁻¹ x L⁻* for a Hermitian x."""
    left = solve_triangular(root, x, lower=True)
    return hermitian(adjoint(solve_triangular(root, adjoint(left), lower=True)))


# ---- geodesics of rotations and rigid motions in JAX, by unit quaternions (scalar first) of either sign ----


class Rotations(Lines):
    """Rotations of space or of the plane as unit quaternions up to their sign: half an angle is a distance there."""

    def __init__(self, size: int) -> None:
        self.size = size

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        quaternion, turn = _motion_of(points, velocities)
        half = jnp.concatenate([jnp.zeros_like(quaternion[..., :1]), 0.5 * turn], axis=-1)
        return quaternion, product(quaternion, half)

    def from_internal(self, points: Any) -> Any:
        return matrix_of(points)[..., : self.size, : self.size]


class Poses(Model):
    """Rigid motions, seven numbers: a unit quaternion of the rotation, and the translation. A velocity is the twist of
    the body, six numbers: angular velocity and velocity. Geodesics are screw motions (Murray, Li & Sastry 1994, §2.3).
    """

    def __init__(self, size: int) -> None:
        self.size = size

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        n = self.size
        quaternion, turn = _motion_of(points[..., :n, :n], velocities[..., :n, :n])
        place, ahead = points[..., :n, n], velocities[..., :n, n]
        if n == 2:
            place, ahead = (jnp.concatenate([x, jnp.zeros_like(x[..., :1])], axis=-1) for x in (place, ahead))
        pose = jnp.concatenate([quaternion, place], axis=-1)
        return pose, jnp.concatenate([turn, turned(_conjugate(quaternion), ahead)], axis=-1)

    def from_internal(self, points: Any) -> Any:
        n = self.size
        top = jnp.concatenate([matrix_of(points[..., :4])[..., :n, :n], points[..., 4 : 4 + n, None]], axis=-1)
        last = jnp.broadcast_to(jnp.eye(n + 1, dtype=top.dtype)[n:], (*top.shape[:-2], 1, n + 1))
        return jnp.concatenate([top, last], axis=-2)

    def exp(self, p: Any, v: Any) -> Any:
        quaternion, place = p[..., :4], p[..., 4:]
        turn, ahead = v[..., :3], v[..., 3:]
        z = jnp.sum(turn * turn, axis=-1, keepdims=True)
        # V(ω)v = v + (1 − cos θ)/θ² ω×v + (θ − sin θ)/θ³ ω×(ω×v)
        across = jnp.cross(turn, ahead)
        moved = ahead + stumpff(2, 1, z) * across + stumpff(3, 1, z) * jnp.cross(turn, across)
        step = jnp.concatenate([1 - 0.125 * z * stumpff(1, 1, z / 16) ** 2, 0.5 * stumpff(1, 1, z / 4) * turn], axis=-1)
        return jnp.concatenate([product(quaternion, step), place + turned(quaternion, moved)], axis=-1)

    def log(self, p: Any, q: Any) -> Any:
        back = _conjugate(p[..., :4])
        step = product(back, q[..., :4])
        scalar, vector = step[..., :1], step[..., 1:]
        y = jnp.sum(vector * vector, axis=-1, keepdims=True)
        turn = 2 * arc(y, scalar * scalar) * scalar * vector
        apart = turned(back, q[..., 4:] - p[..., 4:])
        z = jnp.sum(turn * turn, axis=-1, keepdims=True)
        across = jnp.cross(turn, apart)
        ahead = apart - 0.5 * across + unbent(z) * jnp.cross(turn, across)
        return jnp.concatenate([turn, ahead], axis=-1)


def product(p: Any, q: Any) -> Any:
    """The product of quaternions."""
    a, u, b, v = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    scalar = a * b - jnp.sum(u * v, axis=-1, keepdims=True)
    return jnp.concatenate([scalar, a * v + b * u + jnp.cross(u, v)], axis=-1)


def turned(quaternion: Any, vector: Any) -> Any:
    """Vectors turned by unit quaternions."""
    a, u = quaternion[..., :1], quaternion[..., 1:]
    twice = 2 * jnp.cross(u, vector)
    return vector + a * twice + jnp.cross(u, twice)


def matrix_of(quaternion: Any) -> Any:
    """Rotation matrices of unit quaternions."""
    return _matrices(rotation_rows(*jnp.moveaxis(quaternion, -1, 0)))


def _matrices(rows: Rows) -> Any:
    return jnp.stack([jnp.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_of(matrix: Any) -> Any:
    """A unit quaternion of rotation matrices; NaN of reflections.

    The longest of the four rows of 4qqᵀ is far from zero (Shepperd 1978).
    """
    table = _matrices(quaternion_rows(matrix))
    longest = jnp.argmax(jnp.diagonal(table, axis1=-2, axis2=-1), axis=-1)
    row = jnp.take_along_axis(table, longest[..., None, None], axis=-2)[..., 0, :]
    found = row / jnp.sqrt(jnp.sum(row * row, axis=-1, keepdims=True))
    good = jnp.linalg.det(matrix) > 0
    return jnp.where(good[..., None], found, jnp.nan)


def axis_of(matrix: Any) -> Any:
    """The vector ω of the skew part of matrices [ω]×."""
    skew = 0.5 * (matrix - jnp.swapaxes(matrix, -1, -2))
    return jnp.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)


def _conjugate(quaternion: Any) -> Any:
    return jnp.concatenate([quaternion[..., :1], -quaternion[..., 1:]], axis=-1)


def _motion_of(matrices: Any, velocities: Any) -> tuple[Any, Any]:
    """Unit quaternions of rotations of the plane or of space, and their angular velocities in the body."""
    matrices = orthonormal(matrices)
    turn = jnp.swapaxes(matrices, -1, -2) @ velocities
    if matrices.shape[-1] == 2:
        # Rotations of the plane turn about the third axis of space.
        padding = [(0, 0)] * (matrices.ndim - 2) + [(0, 1), (0, 1)]
        matrices, turn = jnp.pad(matrices, padding).at[..., 2, 2].set(1.0), jnp.pad(turn, padding)
    return quaternion_of(matrices), axis_of(turn)

"""Geodesics of rotations and rigid motions in JAX, by unit quaternions (scalar first) of either sign."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from .._quaternions import Rows, quaternion_rows, rotation_rows
from ._matrices import orthonormal
from ._models import Lines, Model
from ._series import arc, stumpff, unbent


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

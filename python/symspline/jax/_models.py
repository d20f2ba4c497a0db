"""Geodesics of vectors in JAX: what de Casteljau's algorithm needs of a space, in closed forms.

Arrays have any axes in front of those of a point. Angles are squared wherever they stand, so that nothing has a
corner where they are zero.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ._series import arc, stumpff


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

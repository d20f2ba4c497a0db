"""Tangent vectors as arrays: by how much their derivative differs from the covariant one."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from .. import _spaces
from .._spaces import Space

_COLUMN = (_spaces.Sphere, _spaces.RealProjective, _spaces.ComplexProjective)
_COLUMNS = (_spaces.Grassmannian, _spaces.ComplexGrassmannian, _spaces.QuaternionicProjective)
_LORENTZ = (_spaces.Hyperbolic, _spaces.ComplexHyperbolic)


def second_fundamental_form(space: Space, point: Any, vector: Any, motion: Any) -> Any:
    """What the derivative of a field of tangent vectors as arrays has beyond its covariant derivative.

    Of unit vectors, and of k orthonormal columns X, it is −X Ẋ*V, which keeps X*V = 0 (minus the second fundamental
    form). A field gΩ on a group has the covariant derivative g(Ω' + ½[ω, Ω]) where g moves by gω, and the array
    g(Ω' + ωΩ) as derivative: that is ½g(ωΩ + Ωω) more, or ½(ġ g⁻¹V + V g⁻¹ġ); the same holds for positive definite
    matrices, whose covariant acceleration is γ'' − γ'γ⁻¹γ'.

    Args:
        point: γ, shape (..., *point_shape).
        vector: the field at γ.
        motion: how γ moves; the result is linear in it.
    """
    if isinstance(space, _spaces.Euclidean):
        return jnp.zeros_like(motion)
    if isinstance(space, _COLUMN):
        return -point * jnp.sum(jnp.conj(motion) * vector, axis=-1, keepdims=True)
    if isinstance(space, _LORENTZ):
        products = jnp.conj(motion) * vector
        return point * (jnp.sum(products[..., 1:], axis=-1, keepdims=True) - products[..., :1])
    if isinstance(space, _COLUMNS):
        return -point @ (jnp.conj(jnp.swapaxes(motion, -1, -2)) @ vector)
    inverse = jnp.linalg.inv(point)
    return 0.5 * (motion @ inverse @ vector + vector @ inverse @ motion)

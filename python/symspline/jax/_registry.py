"""The spaces whose curves are made in JAX itself."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from .. import _spaces
from .._core import ValidationError
from .._spaces import Space
from ._models import Curved, Lines, Model, Planes, Poses, Positive, Rotations

_LINES = (_spaces.RealProjective, _spaces.ComplexProjective)
_PLANES = (_spaces.Grassmannian, _spaces.ComplexGrassmannian)
_MODELS: list[tuple[tuple[type[Space[Any]], ...], Model]] = [
    ((_spaces.Euclidean,), Model()),
    ((_spaces.Sphere,), Curved(1)),
    ((_spaces.Hyperbolic,), Curved(-1)),
    (_LINES, Lines()),
    (_PLANES, Planes()),
    ((_spaces.SymmetricPositiveDefinite, _spaces.HermitianPositiveDefinite), Positive()),
]
QUOTIENTS = (*_LINES, *_PLANES)
_COLUMN = (_spaces.Sphere, _spaces.RealProjective, _spaces.ComplexProjective)
_COLUMNS = (_spaces.Grassmannian, _spaces.ComplexGrassmannian, _spaces.QuaternionicProjective)
_LORENTZ = (_spaces.Hyperbolic, _spaces.ComplexHyperbolic)


def model_of(space: Space) -> Model:
    """Return the model of a space, except products.

    Raises
    ------
    ValidationError
        If the space is not supported in JAX.
    """
    for classes, model in _MODELS:
        if isinstance(space, classes):
            return model
    if isinstance(space, _spaces.SpecialOrthogonal) and space.point_shape[0] in (2, 3):
        return Rotations(space.point_shape[0])
    if isinstance(space, _spaces.SpecialEuclidean):
        return Poses(space.point_shape[0] - 1)
    raise ValidationError(
        f"symspline.jax.evaluate does not support {space}, but only r, sphere, hyperbolic, rp, cp, gr, cgr, spd, hpd, "
        "so:2, so:3, se:2 and se:3; use symspline.jax.curve, which supports every space"
    )


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

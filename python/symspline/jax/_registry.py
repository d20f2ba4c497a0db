"""The spaces whose curves are made in JAX itself."""

from __future__ import annotations

from .. import _spaces
from .._core import ValidationError
from .._spaces import Space
from ._matrices import Planes, Positive
from ._models import Curved, Lines, Model
from ._motions import Poses, Rotations

_LINES = (_spaces.RealProjective, _spaces.ComplexProjective)
_PLANES = (_spaces.Grassmannian, _spaces.ComplexGrassmannian)
_POSITIVE = (_spaces.SymmetricPositiveDefinite, _spaces.HermitianPositiveDefinite)
QUOTIENTS = (*_LINES, *_PLANES)


def model_of(space: Space) -> Model:
    """Return the model of a space, except products.

    Raises
    ------
    ValidationError
        If the space is not supported in JAX.
    """
    if isinstance(space, _spaces.Euclidean):
        return Model()
    if isinstance(space, (_spaces.Sphere, _spaces.Hyperbolic)):
        return Curved(1 if isinstance(space, _spaces.Sphere) else -1)
    if isinstance(space, _LINES):
        return Lines()
    if isinstance(space, _PLANES):
        return Planes()
    if isinstance(space, _POSITIVE):
        return Positive()
    if isinstance(space, _spaces.SpecialOrthogonal) and space.point_shape[0] in (2, 3):
        return Rotations(space.point_shape[0])
    if isinstance(space, _spaces.SpecialEuclidean):
        return Poses(space.point_shape[0] - 1)
    raise ValidationError(
        f"symspline.jax.evaluate does not support {space}, but only r, sphere, hyperbolic, rp, cp, gr, cgr, spd, hpd, "
        "so:2, so:3, se:2 and se:3; use symspline.jax.curve, which supports every space"
    )

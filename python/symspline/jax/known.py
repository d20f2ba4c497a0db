"""The spaces whose curves are made in JAX itself."""

from __future__ import annotations

from .. import spaces
from .._core import ValidationError
from ..spaces import Space
from .matrices import Planes, Positive
from .models import Curved, Lines, Model
from .motions import Poses, Rotations

_LINES = (spaces.RealProjective, spaces.ComplexProjective)
_PLANES = (spaces.Grassmannian, spaces.ComplexGrassmannian)
_POSITIVE = (spaces.SymmetricPositiveDefinite, spaces.HermitianPositiveDefinite)
QUOTIENTS = (*_LINES, *_PLANES)


def model_of(space: Space) -> Model:
    """Geodesics of a space that is no product.

    Raises:
        ValidationError: they are not written for JAX.
    """
    if isinstance(space, spaces.Euclidean):
        return Model()
    if isinstance(space, (spaces.Sphere, spaces.Hyperbolic)):
        return Curved(1 if isinstance(space, spaces.Sphere) else -1)
    if isinstance(space, _LINES):
        return Lines()
    if isinstance(space, _PLANES):
        return Planes()
    if isinstance(space, _POSITIVE):
        return Positive()
    if isinstance(space, spaces.SpecialOrthogonal) and space.point_shape[0] in (2, 3):
        return Rotations(space.point_shape[0])
    if isinstance(space, spaces.SpecialEuclidean):
        return Poses(space.point_shape[0] - 1)
    raise ValidationError(
        f"curves in {space} are not made in JAX itself; it has r, sphere, hyperbolic, rp, cp, gr, cgr, spd, hpd, so:2, "
        "so:3, se:2 and se:3, and symspline.jax.curve has every space"
    )

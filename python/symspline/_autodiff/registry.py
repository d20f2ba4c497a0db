"""The models of spaces."""

from __future__ import annotations

from typing import Any

from .. import _spaces
from .._spaces import Space
from .casteljau import QUOTIENTS
from .library import Library
from .models import Curved, Lines, Model, Planes, Poses, Positive, Rotations


def model_of(lib: Library, space: Space[Any]) -> Model | None:
    """Return the model of a space, which is not a product; None if there is none."""
    if not lib.general and (space.dtype.kind == "c" or isinstance(space, QUOTIENTS)):
        return None
    if isinstance(space, _spaces.Euclidean):
        return Model(lib)
    if isinstance(space, _spaces.Sphere):
        return Curved(lib, 1)
    if isinstance(space, _spaces.Hyperbolic):
        return Curved(lib, -1)
    if isinstance(space, QUOTIENTS):
        return Lines(lib) if len(space.point_shape) == 1 else Planes(lib)
    if isinstance(space, (_spaces.SymmetricPositiveDefinite, _spaces.HermitianPositiveDefinite)):
        return Positive(lib)
    if isinstance(space, _spaces.SpecialOrthogonal) and space.point_shape[0] in (2, 3):
        return Rotations(lib, space.point_shape[0])
    if isinstance(space, _spaces.SpecialEuclidean):
        return Poses(lib, space.point_shape[0] - 1)
    return None

"""Points that come from files: next to their space, or as longitude and latitude."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..places import compass, from_lonlat, to_lonlat
from ..spaces import POINT_TOL_FLOAT32, Space, Sphere
from .errors import Problem
from .layout import Doubles

GLOBE = Sphere(2)


def onto(space: Space, points: NDArray[Any]) -> NDArray[Any]:
    """The points of a space, not a product, next to these, which may be off it as far as rounding in a file goes.

    Raises:
        ValidationError: a point is farther off.
    """
    doubles = space._doubles(points, "points")
    lead = space._lead(doubles)
    space._handle.check_points(space._rows(doubles, lead), lead, POINT_TOL_FLOAT32)
    return space.project(points)


# ---- longitude and latitude ----

LONLAT = ["lon", "lat"]
_MOTION = ["east", "north"]


def from_degrees(columns: Doubles) -> Doubles:
    """Points of S² from longitude and latitude in degrees, shape (rows, 2)."""
    return from_lonlat(*columns.T)


def to_degrees(points: Doubles) -> Doubles:
    """Longitude and latitude in degrees, shape (rows, 2)."""
    return np.stack(to_lonlat(points), axis=1)


def motion_labels(nu: int) -> list[str]:
    """Names for velocity or acceleration on a globe."""
    return [f"{name}_d{nu}" for name in _MOTION]


def motion_degrees(points: Doubles, vectors: Doubles) -> Doubles:
    """The parts to the east and to the north of vectors at points, in degrees of arc."""
    parts = [(vectors * axis).sum(axis=-1) for axis in compass(points)]
    degrees: Doubles = np.degrees(np.stack(parts, axis=1))
    return degrees


def require_globe(space: Space) -> None:
    """Raise `Problem` unless places on a globe are points of the space."""
    if space != GLOBE:
        raise Problem(f"--lonlat is for sphere:2, not for {space}")

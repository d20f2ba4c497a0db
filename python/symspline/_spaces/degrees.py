"""Recognise angles in degrees where radians are expected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .._base.typing import Array, PointsLike
from . import Torus, factors_of, parts_of
from .base import AnySpace

# Names of the unit in attributes of netCDF files and in column names.
_NAMES = ("deg", "degs", "degree", "degrees", "°", "arc_degree", "arcdegree", "degree_true", "degrees_true", "degt")
# Angles in radians rarely exceed two turns, except those of wheels, whose steps are shorter than half a turn.
TWO_TURNS = 4 * np.pi
_SHARE = 0.1


def is_degrees(unit: object) -> bool:
    """Whether the name of a unit means degrees."""
    return str(unit).strip().lower() in _NAMES


def look_like_degrees(space: AnySpace, points: PointsLike) -> float | None:
    """Return the largest angle if points on a torus seem to be in degrees, else None.

    Angles seem to be in degrees if they are between -180 and 360, their largest size exceeds 4π, and either at least a
    tenth of the steps exceed π or all angles have at most two decimals.
    """
    for factor, part in zip(factors_of(space), parts_of(points, space, "points"), strict=True):
        if not isinstance(factor, Torus):
            continue
        x: Array = np.asarray(part, np.float64).reshape(-1, part.shape[-1])
        x = x[np.isfinite(x).all(axis=1)]
        size = float(np.abs(x).max(initial=0.0))
        if not (size > TWO_TURNS and x.min(initial=0.0) >= -180 and size <= 360):
            continue
        steps = np.abs(np.diff(x, axis=0))
        jumps = np.mean(steps > np.pi) >= _SHARE if steps.size else False
        if jumps or np.array_equal(100 * x, np.rint(100 * x)):
            return size
    return None


def with_angles(space: AnySpace, points: PointsLike, convert: Callable[[Any], Any]) -> Any:
    """Return points, or vectors, with the angles of tori converted from or to degrees."""
    pairs = zip(factors_of(space), parts_of(points, space, "points"), strict=True)
    converted = tuple(convert(part) if isinstance(factor, Torus) else part for factor, part in pairs)
    return converted if isinstance(points, tuple) else converted[0]

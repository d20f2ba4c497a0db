"""Points and tangent vectors as columns of numbers, row by row, and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..lonlat import compass, from_lonlat, to_lonlat
from ..product import Product
from ..spaces import POINT_TOL_FLOAT32, Space, Sphere
from .errors import Problem

Doubles = NDArray[np.float64]

GLOBE = Sphere(2)


def labels(space: Space) -> list[str]:
    """Names for the columns of a point: x0, x1, …; complex numbers end in _re and _im."""
    names: list[str] = []
    entry = 0
    for factor in _factors(space):
        for _ in range(int(np.prod(factor.point_shape))):
            names += [f"x{entry}{end}" for end in (("_re", "_im") if _is_complex(factor) else ("",))]
            entry += 1
    return names


def flatten(space: Space, values: Any) -> Doubles:
    """Points or vectors of shape (rows, *point_shape) as columns, shape (rows, columns)."""
    parts = values if isinstance(space, Product) else (values,)
    return np.concatenate([_flat(np.asarray(part)) for part in parts], axis=1)


def unflatten(space: Space, columns: Doubles) -> Any:
    """The inverse of `flatten`."""
    parts: list[NDArray[Any]] = []
    start = 0
    for factor in _factors(space):
        width = len(labels(factor))
        part = np.ascontiguousarray(columns[:, start : start + width])
        numbers = part.view(np.complex128) if _is_complex(factor) else part
        parts.append(numbers.reshape(len(columns), *factor.point_shape))
        start += width
    return tuple(parts) if isinstance(space, Product) else parts[0]


def onto(space: Space, points: Any) -> Any:
    """The points of the space next to these, which may be off it as far as rounding in a file goes.

    Raises:
        ValidationError: a point is farther off.
    """
    if isinstance(space, Product):
        return tuple(onto(factor, part) for factor, part in zip(space.factors, points, strict=True))
    space._handle.check_points(space._rows(points, points.shape), (len(points),), POINT_TOL_FLOAT32)
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


def _factors(space: Space) -> tuple[Space, ...]:
    return space.factors if isinstance(space, Product) else (space,)


def _is_complex(space: Space) -> bool:
    return np.issubdtype(space._dtype, np.complexfloating)


def _flat(values: NDArray[Any]) -> Doubles:
    rows = np.ascontiguousarray(values.reshape(len(values), -1))
    return rows.view(np.float64) if rows.dtype.kind == "c" else rows

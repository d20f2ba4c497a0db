"""Rows of a table that are probably outliers."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.exceptions import SymsplineError
from .._base.time import time_axis_of
from .._smoothing import SmoothingSpline
from .._spaces import Doubles, Product, Space, factors_of
from .._splines.cubic import CubicSpline
from ._points import GLOBE
from ._recordings import Recordings
from ._summary import counted

_FAST, _FAR = 10.0, 10.0
"""Multiples of the median speed and of the median distance from a smooth curve that outliers exceed."""
_ROUNDING = 1e-9
"""Distances that are a smaller part of the largest component of a point are rounding errors."""
_FEWEST = 8
"""The smallest number of points of a curve that is searched for outliers."""


def outliers(data: Recordings, curves: Sequence[CubicSpline] | None, lonlat: bool) -> str:
    """Describe the rows that are probably outliers, with a remedy; empty if there are none.

    ``curves`` are those that were fitted, or None if the fit failed. Points are compared with a smooth curve, or with
    their neighbours.
    """
    found: list[tuple[int, float, float]] = []
    smooth = curves if curves is not None and isinstance(curves[0], SmoothingSpline) else None
    for i, (own, (times, points)) in enumerate(zip(data.groups.values(), data.curves, strict=True)):
        if len(own) < _FEWEST:
            continue
        # Not all spaces have distances between all points.
        with suppress(SymsplineError):
            near = None if smooth is None else smooth[i](times)
            for space, part, beside in _factors(data.space, points, near):
                far, sizes, usual = _spikes(space, times, part) if beside is None else _far(space, part, beside)
                found += [(int(own[k]), float(sizes[k]), usual) for k in np.flatnonzero(far)]
    if not found:
        return ""
    row, *lengths = found[0]
    scale, unit = (180 / np.pi, "°") if lonlat and data.space == GLOBE else (1.0, "")
    size, usual_size = (f"{scale * length:.3g}{unit}" for length in lengths)
    where = f"{size} from its neighbours, and most steps are {usual_size}"
    remedy = "omit outliers, or fit near the points with --smooth --robust"
    if smooth is not None:
        where = f"{size} from the curve, and half of the points are within {usual_size}"
        remedy = "--robust reduces the influence of outliers"
    rest = len({k for k, *_ in found}) - 1
    others = f" (and in {counted(rest, 'other row')})" if rest else ""
    return f"{data.place(row)}: the point is probably an outlier{others}, {where}; {remedy}"


def _factors(space: Space, points: Any, near: Any) -> list[tuple[Space, Any, Any]]:
    if not isinstance(space, Product):
        return [(space, points, near)]
    beside = near if near is not None else [None] * len(points)
    return list(zip(factors_of(space), points, beside, strict=True))


def _spikes(space: Space, times: Any, points: Any) -> tuple[NDArray[np.bool_], Doubles, float]:
    """Return which points are far from both neighbours, which are closer to each other, and the usual step."""
    steps = np.asarray(space.distance(points[1:], points[:-1]))
    lengths = np.ones(len(steps))
    if times is not None:
        axis, knots = time_axis_of(times)
        lengths = np.diff(axis.knots(knots))
        lengths = np.maximum(lengths, 1e-3 * lengths.mean())
    found = np.zeros(len(points), bool)
    if not lengths.min() > 0:
        return found, found.astype(np.float64), 0.0
    speeds = steps / lengths
    sizes, slowest = (np.r_[0.0, np.minimum(own[1:], own[:-1]), 0.0] for own in (steps, speeds))
    usual = float(np.median(speeds))
    fast = np.flatnonzero((slowest > _FAST * usual) & (usual > 0))
    around = space.distance(points[fast + 1], points[fast - 1])
    found[fast] = sizes[fast] > np.maximum(around, _ROUNDING * np.abs(points).max())
    return found, sizes, float(np.median(steps))


def _far(space: Space, points: Any, near: Any) -> tuple[NDArray[np.bool_], Doubles, float]:
    """Return which points are far from a curve, their distances, and the distance within which most points are."""
    distances = np.asarray(space.distance(points, near))
    usual = float(np.median(distances))
    return distances > max(_FAR * usual, _ROUNDING * np.abs(points).max()), distances, usual

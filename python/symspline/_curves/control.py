"""Validation of the knots and control points of B-splines and Bézier curves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import as_array, cast
from .._core import CutLocusError, ValidationError
from .._spaces import Array, Space, point_tol
from .ends import ends_of
from .fit import Points, validated


def control_array(value: ArrayLike, space: Space[Any], least: int) -> tuple[NDArray[np.float64], float]:
    """Return control points as floating-point numbers of the core, and their tolerance."""
    array = space._array(value, "control_points")
    doubles = space._doubles(array, "control_points") if array.ndim > len(space.point_shape) else None
    if doubles is None or array.size == 0 or space._lead(doubles)[-1] < least:
        shape = ", ".join(map(str, space.point_shape))
        raise ValidationError(
            f"control_points has shape {array.shape}; a curve needs shape (..., n, {shape}) with n >= {least}"
        )
    return doubles, point_tol(array.dtype)


def checked_points(space: Space[Any], doubles: NDArray[np.float64], tol: float) -> Array:
    """Project control points onto the space.

    Raises
    ------
    ValidationError
        If a control point is not on the space.
    CutLocusError
        If two neighbouring control points are not joined by a unique shortest geodesic.
    """
    *batch, count = space._lead(doubles)
    try:
        (points,), _ = validated(
            space,
            np.arange(count, dtype=np.float64),
            [Points(doubles, tol, tuple(batch), count)],
            [ends_of("natural", space, tuple(batch))],
        )
    except ValidationError as error:
        raise ValidationError(str(error).replace("points[", "control_points[")) from None
    index = (slice(None),) * len(batch)
    try:
        space._apply("log", p=points[(*index, slice(-1))], q=points[(*index, slice(1, None))])
    except CutLocusError as error:
        row, _, why = str(error).removeprefix("pair ").partition(": the points ")
        *curve, i = map(int, np.unravel_index(int(row), (*batch, count - 1)))
        of = f" of curve {','.join(map(str, curve))}" if curve else ""
        raise CutLocusError(f"control_points[{i}] and control_points[{i + 1}]{of} {why}") from None
    return points


def checked_knots(knots: ArrayLike, count: int, degree: int) -> NDArray[np.float64]:
    """Return a copy of the knots of a B-spline with `count` control points after validation."""
    array = as_array(knots, "knots")
    if array.ndim != 1 or array.dtype.kind not in "biuf":
        raise ValidationError(
            f"knots must be a one-dimensional array of real numbers, not {array.dtype} of shape {array.shape}"
        )
    needed = count + degree + 1
    if count <= degree:
        raise ValidationError(f"degree {degree} needs at least {degree + 1} control points, got {count}")
    if array.size != needed:
        raise ValidationError(
            f"{count} control points of degree {degree} need {needed} knots, got {array.size}"
        )
    result = cast(array.copy())
    if not np.isfinite(result).all():
        raise ValidationError(f"knots[{np.flatnonzero(~np.isfinite(result))[0]}] is not finite")
    falls = np.flatnonzero(result[1:] < result[:-1])
    if falls.size:
        raise ValidationError(f"knots[{falls[0] + 1}] = {result[falls[0] + 1]} is before knots[{falls[0]}]")
    if not np.isfinite(float(result[-1]) - float(result[0])):
        raise ValidationError("knots span more than the floating-point range")
    times, repeats = np.unique(result, return_counts=True)
    if repeats.max() > degree + 1:
        most = np.argmax(repeats)
        raise ValidationError(
            f"knots repeat {times[most]} {repeats[most]} times; with degree {degree} a knot may repeat at most "
            f"{degree + 1} times"
        )
    if not result[degree] < result[count]:
        raise ValidationError(
            f"the domain of the curve is empty: knots[{degree}] and knots[{count}] are equal"
        )
    return result

"""How curves follow their data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import as_array, shown
from ._core import ValidationError
from ._ends import End, ends_of
from ._span import is_large

if TYPE_CHECKING:
    from .spline import CubicSpline

Array = NDArray[Any]


@dataclass(frozen=True)
class Gradient:
    """The gradient of a number with respect to what a spline is made of, see `CubicSpline.vjp`.

    Attributes:
        points: tangent vectors at the points, of their shape.
        t: one number a knot, of the shape of the knots.
        ends: tangent vectors for the velocity or acceleration that was given at either end, of its shape; None
            where none was given.
    """

    points: Any
    t: Array
    ends: tuple[Any, Any]


class _Curves(NamedTuple):
    """What the compiled core needs, curve after curve."""

    t: NDArray[np.float64]
    points: NDArray[np.float64]
    velocities: NDArray[np.float64]
    ends: list[End] | None
    x: NDArray[np.float64]
    curves: int
    nu: int


def push(spline: CubicSpline, x: ArrayLike, points: Any, t: Any, ends: Any, nu: int) -> Array:
    """The work of `CubicSpline.jvp`."""
    space = spline._space
    curves, shape = _curves(spline, x, nu)
    batch = spline._batch
    if points is None:
        motion = np.zeros_like(spline._points).view(np.float64)
    else:
        motion = space._doubles(as_array(points, "points"), "points")
        _same_shape(space._numbers(motion), spline._points.shape, "points")
        motion = space._doubles(space.project_tangent(spline._points, space._numbers(motion)), "points")
    knots = np.zeros(spline._times.shape) if t is None else as_array(t, "t").astype(np.float64)
    _same_shape(knots, spline._times.shape, "t")
    if not isinstance(ends, (tuple, list, type(None))) or (ends is not None and len(ends) != 2):
        raise ValidationError(f"ends must be a pair, not {shown(ends)}")
    vectors = [
        _end_motion(spline, end, name, which)
        for which, (end, name) in enumerate(zip(ends or (None, None), ("start", "end"), strict=True))
    ]
    moved = _core.push(
        space._handle,
        curves,
        np.ascontiguousarray(motion),
        _per_curve(knots, batch),
        vectors,
    )
    return np.asarray(space._numbers(moved.reshape(*shape, *space._doubles_shape)))


def pull(spline: CubicSpline, x: ArrayLike, cotangent: Any, nu: int) -> Gradient:
    """The work of `CubicSpline.vjp`."""
    space = spline._space
    curves, shape = _curves(spline, x, nu)
    doubles = space._doubles(as_array(cotangent, "cotangent"), "cotangent")
    _same_shape(space._numbers(doubles), (*shape, *space.point_shape), "cotangent")
    points, knots, *ends = _core.pull(space._handle, curves, np.ascontiguousarray(doubles))
    batch = spline._batch
    knots = knots.reshape(*batch, -1)
    if spline._times.ndim == 1:
        knots = knots.reshape(-1, knots.shape[-1]).sum(axis=0)
    return Gradient(
        space._numbers(points.reshape(*spline._points.shape[: len(batch) + 1], *space._doubles_shape)),
        knots,
        (_end_gradient(spline, ends[0], 0), _end_gradient(spline, ends[1], 1)),
    )


def _curves(spline: CubicSpline, x: ArrayLike, nu: int) -> tuple[_Curves, tuple[int, ...]]:
    """The spline and times as the core needs them, and the shape of the result but for the axes of a point."""
    space, batch = spline._space, spline._batch
    if isinstance(nu, bool) or nu not in (0, 1, 2):
        raise ValidationError(f"nu must be 0, 1 or 2, not {shown(nu)}")
    if is_large(space):
        raise ValidationError(
            f"derivatives with respect to the data are not made in as many dimensions as {space} has: "
            "motions of points leave the span in which the curve is computed"
        )
    times, per_curve = spline._clock.at(x, batch, False)
    shape = times.shape if per_curve else batch + times.shape
    curves = math.prod(batch)
    knots = _per_curve(spline._times, batch)
    own = np.ascontiguousarray(np.broadcast_to(times, shape).reshape(curves, math.prod(shape) // curves))
    outside = ~((own >= knots[:, :1]) & (own <= knots[:, -1:]))
    if outside.any():
        curve, index = (int(i) for i in np.argwhere(outside)[0])
        raise spline._clock.explain(
            ValidationError(
                f"x[{index}] = {own[curve, index]} is outside the knots [{knots[curve, 0]}, {knots[curve, -1]}]; "
                "derivatives with respect to the data are known between the first and the last knot"
            )
        )
    velocities = np.ascontiguousarray(solved(spline)).view(np.float64)
    points = np.ascontiguousarray(spline._points).view(np.float64)
    return _Curves(knots, points, velocities, ends_of(spline._bc_type, space, batch), own, curves, nu), shape


def solved(spline: CubicSpline) -> Array:
    """The velocities; NaN of curves that have not converged, as what holds at a solution does not hold there."""
    # A spline that was made of velocities has no report.
    if not hasattr(spline, "_report"):
        return spline._velocities
    converged = np.reshape(
        spline._report.converged, (*spline._batch, *(1,) * (len(spline._space.point_shape) + 1))
    )
    return np.asarray(np.where(converged, spline._velocities, np.nan))


def _per_curve(knots: Array, batch: tuple[int, ...]) -> NDArray[np.float64]:
    """One row of knots a curve."""
    rows = np.broadcast_to(knots, (*batch, knots.shape[-1]))
    return np.ascontiguousarray(rows.reshape(-1, knots.shape[-1]), dtype=np.float64)


def _same_shape(array: Array, shape: tuple[int, ...], name: str) -> None:
    if array.shape != shape:
        raise ValidationError(f"{name} has shape {array.shape}, but {shape} is needed")


def _given(spline: CubicSpline, which: int) -> Array | None:
    """The vector that was given at an end."""
    bc = spline._bc_type
    return None if isinstance(bc, str) or isinstance(bc[which], str) else bc[which][1]


def _end_motion(spline: CubicSpline, value: Any, name: str, which: int) -> NDArray[np.float64]:
    space, batch = spline._space, spline._batch
    shape = batch + space._doubles_shape
    if value is None:
        return np.zeros(shape)
    if _given(spline, which) is None:
        raise ValidationError(f"no vector was given at the {name}, so that none can change")
    doubles = space._doubles(as_array(value, f"the change at the {name}"), f"the change at the {name}")
    at = np.take(spline._points, -which, axis=len(batch))
    vectors = np.broadcast_to(space._numbers(doubles), batch + space.point_shape)
    return np.ascontiguousarray(space.project_tangent(at, vectors)).view(np.float64).reshape(shape)


def _end_gradient(spline: CubicSpline, gradient: NDArray[np.float64], which: int) -> Any:
    given = _given(spline, which)
    if given is None:
        return None
    space, batch = spline._space, spline._batch
    full = space._numbers(gradient.reshape(batch + space._doubles_shape))
    # A vector that all curves share collects all their gradients.
    extra = full.ndim - given.ndim
    summed = full.sum(axis=tuple(range(extra)))
    for axis, size in enumerate(given.shape):
        if size == 1 and summed.shape[axis] != 1:
            summed = summed.sum(axis=axis, keepdims=True)
    return summed

"""Sensitivity of curves to their data, in forward and reverse mode."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, Protocol

import numpy as np

from .. import _core
from .._base.arrays import as_array, cast, same_fields, short_repr
from .._base.faults import of_index, warn
from .._base.report import ConvergenceWarning
from .._base.time import onto_ends, refuse_outside
from .._base.typing import Array, CubicBCType, FloatArray, P
from .._core import ValidationError
from .._spaces import AnySpace, Doubles, Space
from .ends import End, ends_of


@dataclass(frozen=True, eq=False)
class Gradient(Generic[P]):
    """Gradient of a function of a spline with respect to its data.

    `CubicSpline.vjp` returns objects of this class.

    Attributes
    ----------
    points : ndarray or tuple of ndarray
        Tangent vectors at the points, with their shape.
    t : ndarray
        One number per knot, with the shape of the knots.
    ends : tuple
        Tangent vectors for the velocity or acceleration prescribed at either end, with its shape; None where none was
        prescribed.

    See Also
    --------
    CubicSpline.vjp : Compute the gradient of a function of the curve.

    Examples
    --------
    >>> import symspline as ss
    >>> spline = ss.CubicSpline([0, 1, 2], [[0.0], [1.0], [0.0]], "r:1")
    >>> gradient = spline.vjp(0.5, [1.0])
    >>> gradient.points.shape, gradient.t.shape, gradient.ends
    ((3, 1), (3,), (None, None))
    """

    points: P
    t: FloatArray
    ends: tuple[P | None, P | None]

    def __eq__(self, other: object) -> bool:
        """Whether both have equal arrays."""
        return same_fields(self, other) if isinstance(other, Gradient) else NotImplemented


class SampleTimes(NamedTuple):
    """Times on the curves of a batch at which derivatives are computed.

    Attributes
    ----------
    x : ndarray, shape (curves, times)
        Times of each curve.
    shape : tuple of int
        Shape of a result, without the axes of a point.
    orders : tuple of {0, 1, 2}
        Orders of the derivatives in time.
    """

    x: Doubles
    shape: tuple[int, ...]
    orders: tuple[int, ...]


class SplineData(Protocol):
    """C² curves through points, in a space that is not a product."""

    space: Space
    times: Doubles

    @property
    def points(self) -> Array: ...
    @property
    def velocities(self) -> Array: ...
    @property
    def batch(self) -> tuple[int, ...]: ...


def sample_times(
    knots: Array, batch: tuple[int, ...], x: Array, per_curve: bool, nu: int | tuple[int, ...]
) -> SampleTimes:
    """Return the sampling times of each curve. Results of several orders have an axis for them behind those of a batch.

    Raises
    ------
    ValidationError
        If a time lies outside the knots.
    """
    dtype = x.dtype if x.dtype.kind == "f" else np.dtype(np.float64)
    x, per_curve = onto_ends(cast(x), knots, batch, per_curve, dtype)
    refuse_outside(knots, batch, x, per_curve, remedy="; derivatives with respect to the data exist only there")
    shape = x.shape if per_curve else batch + x.shape
    rows = x if x.shape == shape else np.broadcast_to(x, shape)
    rows = rows.reshape(math.prod(batch), math.prod(shape[len(batch) :]))
    if isinstance(nu, tuple):
        return SampleTimes(np.ascontiguousarray(rows), (*batch, len(nu), *shape[len(batch) :]), nu)
    return SampleTimes(np.ascontiguousarray(rows), shape, (nu,))


class _Curves(NamedTuple):
    """Arguments of the compiled core, with one row per curve."""

    t: Doubles
    points: Doubles
    velocities: Doubles
    ends: list[End] | None
    x: Doubles
    curves: int
    orders: tuple[int, ...]


def jvp(curve: SplineData, at: SampleTimes, bc_type: Any, points: Any, t: Any, ends: Any) -> Array:
    """Compute the change of the curve for a change of its data; see `symspline.CubicSpline.jvp`."""
    space, times = curve.space, curve.times
    if points is None:
        motion = np.zeros_like(space._as_doubles(curve.points))
    else:
        motion = space._doubles(points, "points")
        _same_shape(space._numbers(motion), curve.points.shape, "points")
        motion = space._as_doubles(space.project_tangent(curve.points, space._numbers(motion)))
    knots = np.zeros(times.shape) if t is None else as_array(t, "t").astype(np.float64)
    _same_shape(knots, times.shape, "t")
    vectors = [
        _end_motion(curve, bc_type, end, name, which)
        for which, (end, name) in enumerate(zip(pair_of(ends), ("start", "end"), strict=True))
    ]
    motion, knots = np.ascontiguousarray(motion), _per_curve(knots, curve.batch)
    moved = _core.push(space._handle, _curves(curve, at, bc_type), motion, knots, vectors)
    _warn_of_singular(curve, moved)
    return np.asarray(space._numbers(moved.reshape(*at.shape, *space._doubles_shape)))


def vjp(curve: SplineData, at: SampleTimes, bc_type: CubicBCType, cotangent: Any) -> Gradient:
    """Compute the gradient with respect to the data; see `symspline.CubicSpline.vjp`."""
    space, batch, nodes = curve.space, curve.batch, curve.times.shape[-1]
    doubles = space._as_doubles(read_cotangent(space, cotangent, at.shape))
    points, knots, *ends = _core.pull(space._handle, _curves(curve, at, bc_type), np.ascontiguousarray(doubles))
    if np.isfinite(doubles).all():
        _warn_of_singular(curve, points)
    knots = knots.reshape(*batch, nodes)
    if curve.times.ndim == 1:
        knots = knots.reshape(-1, nodes).sum(axis=0)
    return Gradient(
        space._numbers(points.reshape(*batch, nodes, *space._doubles_shape)),
        knots,
        (_end_gradient(curve, bc_type, ends[0], 0), _end_gradient(curve, bc_type, ends[1], 1)),
    )


def _warn_of_singular(curve: SplineData, result: Array) -> None:
    """Warn of curves whose derivatives are NaN although the curves exist."""
    if np.isfinite(result).all():
        return
    rows = (np.isfinite(x.reshape(math.prod(curve.batch), -1)).all(axis=-1) for x in (result, curve.velocities))
    finite, exists = rows
    singular = np.flatnonzero(exists & ~finite)
    if len(singular):
        index = tuple(int(i) for i in np.unravel_index(singular[0], curve.batch))
        more = f" (and of {len(singular) - 1} more curves)" if len(singular) > 1 else ""
        warn(
            f"the derivatives{of_index(index)}{more} are NaN: its linear system is singular. A tiny change of the data "
            "leads to another curve. Put more points where steps are long or times uneven.",
            ConvergenceWarning,
            index,
        )


def read_cotangent(space: Space, cotangent: Any, shape: tuple[int, ...]) -> Array:
    """Return the weights of the numbers of values, whose shape without the axes of a point is `shape`."""
    numbers = space._numbers(space._doubles(cotangent, "cotangent"))
    _same_shape(numbers, (*shape, *space.point_shape), "cotangent")
    return numbers


def require_derivatives(space: AnySpace) -> None:
    """Raise ValidationError if curves in the space have no derivatives with respect to their data."""
    if space._is_large:
        raise ValidationError(
            f"derivatives with respect to the data are not available, because the dimension of {space} is too large: "
            "the curve is computed in the span of its points, which motions of the points leave"
        )


def pair_of(ends: object) -> tuple[Any, Any]:
    """Split a pair of changes of the end vectors; None means no change."""
    if ends is None:
        return None, None
    if not isinstance(ends, (tuple, list)) or len(ends) != 2:
        raise ValidationError(f"ends must be a pair, not {short_repr(ends)}")
    return ends[0], ends[1]


def _curves(curve: SplineData, at: SampleTimes, bc_type: object) -> _Curves:
    space, batch = curve.space, curve.batch
    points, velocities = (space._as_doubles(np.ascontiguousarray(a)) for a in (curve.points, curve.velocities))
    knots, ends = _per_curve(curve.times, batch), ends_of(bc_type, space, batch)
    return _Curves(knots, points, velocities, ends, at.x, math.prod(batch), at.orders)


def _per_curve(knots: Array, batch: tuple[int, ...]) -> Doubles:
    """Return one row of knots per curve."""
    shape = (*batch, knots.shape[-1])
    rows = knots if knots.shape == shape else np.broadcast_to(knots, shape)
    return np.ascontiguousarray(rows.reshape(-1, shape[-1]), dtype=np.float64)


def _same_shape(array: Array, shape: tuple[int, ...], name: str) -> None:
    if array.shape != shape:
        raise ValidationError(f"{name} has shape {array.shape}, but {shape} is needed")


def _given(bc_type: Any, which: int) -> Array | None:
    """Return the vector that `bc_type` prescribes at an end, or None."""
    return None if isinstance(bc_type, str) or isinstance(bc_type[which], str) else bc_type[which][1]


def _end_motion(curve: SplineData, bc_type: object, value: Any, name: str, which: int) -> Doubles:
    space, batch = curve.space, curve.batch
    shape = batch + space._doubles_shape
    if value is None:
        return np.zeros(shape)
    if _given(bc_type, which) is None:
        raise ValidationError(f"no vector was given at the {name}, so it cannot change")
    doubles = space._doubles(value, f"the change at the {name}")
    at = np.take(curve.points, -which, axis=len(batch))
    vectors = np.broadcast_to(space._numbers(doubles), batch + space.point_shape)
    return space._as_doubles(np.ascontiguousarray(space.project_tangent(at, vectors))).reshape(shape)


def _end_gradient(curve: SplineData, bc_type: CubicBCType, gradient: Doubles, which: int) -> Any:
    given = _given(bc_type, which)
    if given is None:
        return None
    space = curve.space
    full = space._numbers(gradient.reshape(curve.batch + space._doubles_shape))
    # The gradient with respect to a shared vector is the sum over the curves that share it.
    extra = full.ndim - given.ndim
    summed = full.sum(axis=tuple(range(extra)))
    for axis, size in enumerate(given.shape):
        if size == 1 and summed.shape[axis] != 1:
            summed = summed.sum(axis=axis, keepdims=True)
    return summed

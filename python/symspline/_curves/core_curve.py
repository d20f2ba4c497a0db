"""Curves that the compiled core fits and evaluates as they are."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from .. import _core
from .._core import ValidationError
from .._faults import Fault
from .._spaces import Affine, Array, Similarity, Space, SpecialEuclidean
from . import derivatives
from .curve import REAL, CurveArrays, Doubles
from .gradient import Gradient, SampleTimes
from .lift import check_reach, check_start, fiber_factors, is_quotient
from .out import can_write_into, check_out
from .solve import Options, Progress, Task, solve_single, validate

# Their matrices have the same last row everywhere, which the core writes of curves that were not found, too.
_CONSTANT_ROW = (SpecialEuclidean, Similarity, Affine)


def _all_nan(space: Space, values: Array) -> Array:
    """The same values, in place, with NaN in all of a matrix of which there is one."""
    if isinstance(space, _CONSTANT_ROW):
        missing = np.isnan(values[..., 0, 0])
        if missing.any():
            values[missing] = np.nan
    return values


class CoreCurve(CurveArrays):
    """Curves in a space that is no product."""

    points: Array
    velocities: Array
    # Whether the core computes points in the space itself.
    _compiled: ClassVar[bool] = True

    def __init__(self, space: Space, times: Doubles, points: Array, velocities: Array) -> None:
        self.space, self.times, self.points, self.velocities = space, times, points, velocities
        points.flags.writeable = velocities.flags.writeable = False

    @staticmethod
    def suits(space: Space) -> bool:
        """Whether curves in a space are of this kind, if they are of no other one."""
        return True

    # The velocities that make the curve C². The core validates such curves on the way.
    solve = staticmethod(solve_single)

    @staticmethod
    def validate(task: Task, options: Options) -> tuple[Task, list[Fault]]:
        """Validate a task and project its points onto the space. Return the task and the faults of skipped curves.

        Raises:
            ValidationError: something is wrong with it.
        """
        return validate(task)

    @property
    def batch(self) -> tuple[int, ...]:
        return self.points.shape[: self.points.ndim - len(self.space._point_shape) - 1]

    @property
    def parts(self) -> tuple[Self]:
        return (self,)

    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        self._check_times(x, per_curve)
        values = _core.evaluate(*self._core_curve, x, quantity, outside, per_curve, progress)
        return values if quantity in REAL else _all_nan(self.space, self.space._numbers(values))

    def write(
        self, out: Any, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None
    ) -> Any:
        self._check_times(x, per_curve)
        space = self.space
        check_out(out, (x.shape if per_curve else self.batch + x.shape) + space.point_shape, space.dtype)
        if self._compiled and can_write_into(out, space.dtype, x):
            _core.evaluate(
                *self._core_curve, x, quantity, outside, per_curve, progress, space._as_doubles(out)
            )
            _all_nan(space, out)
        else:
            np.copyto(out, self.evaluate(x, quantity, outside, per_curve, progress), casting="same_kind")
        return out

    def lift(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        start: Any,
        progress: Progress | None = None,
    ) -> Array:
        first = np.take(self.points, 0, axis=len(self.batch))
        if not is_quotient(self.space):
            if start is not None:
                check_start(self.space, first, start)
            values: Array = self.evaluate(x, quantity, outside, per_curve, progress)
            return values
        self._check_times(x, per_curve)
        if outside == "continue":
            check_reach(self.times, x)
        return self._lifted(
            x, quantity, outside, per_curve, fiber_factors(self.space, first, start), progress
        )

    def _lifted(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        start: Doubles,
        progress: Progress | None,
    ) -> Array:
        curve, knots = self._core_curve, self._lift_knots
        values = _core.lift(*curve, x, quantity, outside, per_curve, knots, start, progress)
        return self.space._numbers(values)

    @cached_property
    def _lift_knots(self) -> Doubles:
        """The factors of the horizontal lift at the knots; kept from the first use on."""
        return _core.lift_knots(*self._core_curve)

    @property
    def _core_curve(self) -> tuple[_core.Handle, Doubles, Doubles, Doubles]:
        space = self.space
        points, velocities = space._as_doubles(self.points), space._as_doubles(self.velocities)
        return space._handle, self.times, points, velocities

    def _check_times(self, x: Doubles, per_curve: bool) -> None:
        if per_curve and x.shape[: len(self.batch)] != self.batch:
            raise ValidationError(
                f"with per_curve=True the shape of x must begin with the batch axes {self.batch}; got {x.shape}"
            )

    def transport(self, times: tuple[float, float], outside: str, v: Any) -> Array:
        space = self.space
        vectors = np.ascontiguousarray(space._as_doubles(np.asarray(v, space.dtype)))
        return space._numbers(_core.transport(*self._core_curve, times, outside, vectors))

    def control_points(self) -> Array:
        axis = len(self.batch)
        h = np.diff(self.times)
        third = h.reshape(h.shape + (1,) * len(self.space.point_shape)) / 3
        first, last = (slice(None, -1), slice(1, None))
        index = (slice(None),) * axis
        p, q = self.points[(*index, first)], self.points[(*index, last)]
        u, w = self.velocities[(*index, first)], self.velocities[(*index, last)]
        with np.errstate(all="ignore"):
            handles = third * u, -third * w
        # Of curves that were not found they are NaN.
        inner = [self.space._apply("exp", p=at, v=handle) for at, handle in zip((p, q), handles, strict=True)]
        return np.stack([p, *inner, q], axis=axis + 1)

    def jvp(self, at: SampleTimes, bc_type: Any, points: Any, t: Any, ends: Any) -> Array:
        return derivatives.jvp(self, at, bc_type, points, t, ends)

    def vjp(self, at: SampleTimes, bc_type: Any, cotangent: Any) -> Gradient:
        return derivatives.vjp(self, at, bc_type, cotangent)

    def take_batch(self, index: Any) -> Self:
        times = np.ascontiguousarray(self.times[index]) if self.times.ndim > 1 else self.times
        return self._with(
            times, np.ascontiguousarray(self.points[index]), np.ascontiguousarray(self.velocities[index])
        )

    def _with(self, times: Doubles, points: Array, velocities: Array) -> Self:
        """Other curves of this kind in the same space."""
        return type(self)(self.space, times, points, velocities)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.space, self.times, self.points, self.velocities)

"""Curves that the compiled core fits and evaluates directly."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from .. import _core
from .._core import ValidationError
from .._faults import Fault
from .._spaces import Affine, Array, Doubles, Similarity, Space, SpecialEuclidean
from .._typing import Progress
from . import derivatives
from .curve import REAL, CurveArrays, Gradient, SampleTimes
from .lift import check_reach, check_start, fiber_factors, is_quotient
from .solve import Options, Task, solve_single, validate

# Matrices of these spaces have a constant last row, which the core also writes for curves without a solution.
_CONSTANT_ROW = (SpecialEuclidean, Similarity, Affine)


def _all_nan(space: Space, values: Array) -> Array:
    """Set every matrix that contains a NaN to NaN as a whole, in place."""
    if isinstance(space, _CONSTANT_ROW):
        missing = np.isnan(values[..., 0, 0])
        if missing.any():
            values[missing] = np.nan
    return values


# ---- results in existing arrays of the user, as for the argument ``out`` of NumPy ----


def _check_out(out: Any, shape: tuple[int, ...], dtype: Any) -> None:
    """Raise ValidationError if an array cannot hold a result of this shape and type."""
    if not isinstance(out, np.ndarray):
        raise ValidationError(f"out must be a NumPy array, not {type(out).__name__}")
    if out.shape != shape:
        raise ValidationError(f"out has shape {out.shape}, but the result has {shape}")
    if not np.can_cast(dtype, out.dtype, "same_kind"):
        raise ValidationError(f"out has dtype {out.dtype}, which cannot hold {np.dtype(dtype)}")
    if not out.flags.writeable:
        raise ValidationError("out is read-only")


def _can_write_into(out: Array, dtype: Any, read: Array) -> bool:
    """Whether the core can write directly into an array while it reads another one."""
    apart = not np.may_share_memory(out, read)
    return apart and out.dtype == dtype and out.flags.c_contiguous and out.flags.aligned


class CoreCurve(CurveArrays):
    """Curves in a space that is not a product."""

    points: Array
    velocities: Array
    # Whether the core computes points in the space itself, and not in a smaller one.
    _compiled: ClassVar[bool] = True

    def __init__(self, space: Space, times: Doubles, points: Array, velocities: Array, fitted: bool = True) -> None:
        self.space, self.times, self.points, self.velocities = space, times, points, velocities
        # Whether velocities are those of a C² curve, which lie in the span of the points and the end velocities.
        self._fitted = fitted
        points.flags.writeable = velocities.flags.writeable = False

    @staticmethod
    def suits(space: Space) -> bool:
        """Whether this class can represent curves in a space."""
        return True

    # The velocities of the C² curve. The core validates the points in the same call.
    solve = staticmethod(solve_single)

    @staticmethod
    def validate(task: Task, options: Options) -> tuple[Task, list[Fault]]:
        """Validate a task and project its points onto the space. Return the task and the faults of skipped curves.

        Raises
        ------
        ValidationError
            If the task is invalid.
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
        _check_out(out, (x.shape if per_curve else self.batch + x.shape) + space.point_shape, space.dtype)
        if self._compiled and _can_write_into(out, space.dtype, x):
            _core.evaluate(*self._core_curve, x, quantity, outside, per_curve, progress, space._as_doubles(out))
            _all_nan(space, out)
        else:
            np.copyto(out, self.evaluate(x, quantity, outside, per_curve, progress), casting="same_kind")
        return out

    def lift(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, start: Any, progress: Progress | None = None
    ) -> Array:
        first = np.take(self.points, 0, axis=len(self.batch))
        if not is_quotient(self.space):
            if start is not None:
                check_start(self.space, first, start)
            return np.asarray(self.evaluate(x, quantity, outside, per_curve, progress))
        self._check_times(x, per_curve)
        if outside == "continue":
            check_reach(self.times, x)
        return self._lifted(x, quantity, outside, per_curve, fiber_factors(self.space, first, start), progress)

    def _lifted(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, start: Doubles, progress: Progress | None
    ) -> Array:
        curve, knots = self._core_curve, self._lift_knots
        values = _core.lift(*curve, x, quantity, outside, per_curve, knots, start, progress)
        return self.space._numbers(values)

    @cached_property
    def _lift_knots(self) -> Doubles:
        """Unitary factors of the horizontal lift at the knots, computed once."""
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
        h = np.diff(self.times)
        third = h.reshape(h.shape + (1,) * len(self.space.point_shape)) / 3
        (p, q), (u, w) = (self.space._neighbours(x) for x in (self.points, self.velocities))
        with np.errstate(all="ignore"):
            handles = third * u, -third * w
        # Control points of curves without a solution are NaN.
        inner = [self.space._apply("exp", p=at, v=handle) for at, handle in zip((p, q), handles, strict=True)]
        return np.stack([p, *inner, q], axis=len(self.batch) + 1)

    def jvp(self, at: SampleTimes, bc_type: Any, points: Any, t: Any, ends: Any) -> Array:
        return derivatives.jvp(self, at, bc_type, points, t, ends)

    def vjp(self, at: SampleTimes, bc_type: Any, cotangent: Any) -> Gradient:
        return derivatives.vjp(self, at, bc_type, cotangent)

    def take_batch(self, index: Any) -> Self:
        times = np.ascontiguousarray(self.times[index]) if self.times.ndim > 1 else self.times
        points, velocities = (np.ascontiguousarray(x[index]) for x in (self.points, self.velocities))
        return type(self)(self.space, times, points, velocities, self._fitted)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.space, self.times, self.points, self.velocities, self._fitted)

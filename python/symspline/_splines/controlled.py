"""The base class of curves that are given by knots, control points and a degree."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import as_array, cast, refuse
from .._base.faults import of_index
from .._base.time import TimeAxis, onto_ends
from .._base.typing import FloatArray, P
from .._core import CutLocusError, ValidationError
from .._curves.ends import ends_of
from .._curves.fit import Points, validated
from .._curves.options import quantity_of
from .._spaces import Array, Doubles, Space, parts_of
from .curve import Curve


class ControlledSpline(Curve[P]):
    """Base class of B-spline curves."""

    _curve: Any
    _time_axis = TimeAxis()

    def __call__(self, x: ArrayLike, nu: int = 0) -> P:
        """Evaluate the curve or its derivatives.

        Parameters
        ----------
        x : array_like
            Times between ``knots[degree]`` and ``knots[-degree - 1]``, of any shape and in any order.
        nu : {0, 1, 2}, default 0
            Order of the derivative: 0 for points, 1 for the velocity, 2 for the covariant acceleration.

        Returns
        -------
        ndarray or tuple of ndarray, shape ``(*batch axes, *x.shape, *point_shape)``
            Points or tangent vectors. For a `Product`, a tuple with one array per factor.

        Raises
        ------
        ValidationError
            If a time is not finite or lies outside the domain of the curve.
        """
        values: P = self._curve.evaluate(self._core_times(x)[0], quantity_of(nu))
        return values

    def speed(self, x: ArrayLike) -> FloatArray:
        """Compute the speed of the curve.

        Parameters
        ----------
        x : array_like
            Times in the domain of the curve, of any shape and in any order.

        Returns
        -------
        ndarray, shape ``(*batch axes, *x.shape)``
            The norm of the velocity.

        Raises
        ------
        ValidationError
            If a time is not finite or lies outside the domain of the curve.

        Examples
        --------
        >>> import symspline as ss
        >>> line = ss.BSpline([0, 0, 2, 2], [[0.0], [3.0]], 1, "r:1")
        >>> line.speed([0.5, 1.0])
        array([1.5, 1.5])
        """
        speeds: FloatArray = self._curve.evaluate(self._core_times(x)[0], "speed")[()]
        return speeds

    def _core_times(self, x: Any, name: str = "x", per_curve: bool = False) -> tuple[Doubles, bool]:
        times = as_array(x, name)
        if times.dtype.kind not in "biuf":
            raise ValidationError(f"{name} must be real numbers, not {times.dtype}")
        batch = self._batch
        if per_curve and times.shape[: len(batch)] != batch:
            raise ValidationError(
                f"with per_curve=True the shape of {name} must begin with the batch axes {batch}; got {times.shape}"
            )
        start, end = self.domain
        times, _ = onto_ends(cast(times), np.array([start, end]), (), False, times.dtype)
        outside = ~((times >= start) & (times <= end))

        def say(i: Any) -> str:
            where = f"outside the domain [{start}, {end}] of the curve" if np.isfinite(times[i]) else "not finite"
            return f"= {times[i]} is {where}"

        refuse(outside, name, say)
        return times, per_curve

    def _shown_times(self, x: Doubles) -> Doubles:
        return x

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time of the curve."""
        return float(self.knots[self.degree]), float(self.knots[-self.degree - 1])

    @property
    def knots(self) -> Doubles:
        """Knots, shape (n + degree + 1,)."""
        knots: Doubles = self._curve.knots
        return knots

    @property
    def control_points(self) -> P:
        """Control points, shape (..., n, *point_shape)."""
        points: P = self._curve.control_points
        return points

    @property
    def degree(self) -> int:
        """Degree of the curve."""
        degree: int = self._curve.degree
        return degree

    @property
    def space(self) -> Space[P]:
        """Space of the curve."""
        space: Space[P] = self._curve.space
        return space

    def _fill(self, *parts: Any) -> None:
        (self._curve,) = parts

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ControlledSpline):
            return NotImplemented
        return (
            type(self._curve) is type(other._curve)
            and self.space == other.space
            and self.degree == other.degree
            and np.array_equal(self.knots, other.knots)
            and all(
                np.array_equal(*pair)
                for pair in zip(*(parts_of(c.control_points, c.space, "") for c in (self, other)), strict=True)
            )
        )

    def _made_of(self, radius: float | None = None) -> str:
        return f"{self.knots.size - self.degree - 1} control points, degree {self.degree}"

    def __repr__(self) -> str:
        count = self.knots.size - self.degree - 1
        what = f"{self._batch_text}{count} control points, degree {self.degree}, {self._span_text}"
        return f"<{type(self).__name__} on {self.space!r}: {what}>"


def control_array(value: ArrayLike, space: Space[Any], least: int) -> tuple[Doubles, float]:
    """Return control points as floating-point numbers of the core, and their tolerance."""
    array = space._array(value, "control_points")
    doubles = space._doubles(array, "control_points") if array.ndim > len(space.point_shape) else None
    if doubles is None or array.size == 0 or space._lead(doubles)[-1] < least:
        shape = ", ".join(map(str, space.point_shape))
        raise ValidationError(
            f"control_points has shape {array.shape}; a curve needs shape (..., n, {shape}) with n >= {least}"
        )
    return doubles, space._tol(array)


def checked_points(space: Space[Any], doubles: Doubles, tol: float) -> Array:
    """Project control points onto the space.

    Raises
    ------
    ValidationError
        If a control point is not on the space.
    CutLocusError
        If two neighbouring control points are not joined by a unique shortest geodesic.
    """
    *batch, count = space._lead(doubles)
    data, ends = Points(doubles, tol, tuple(batch), count), ends_of("natural", space, tuple(batch))
    try:
        (points,), _ = validated(space, np.arange(count, dtype=np.float64), [data], [ends])
    except ValidationError as error:
        raise ValidationError(str(error).replace("points[", "control_points[")) from None
    p, q = space._neighbours(points)
    try:
        space._apply("log", p=p, q=q)
    except CutLocusError as error:
        row, _, why = str(error).removeprefix("pair ").partition(": the points ")
        *curve, i = map(int, np.unravel_index(int(row), (*batch, count - 1)))
        raise CutLocusError(f"control_points[{i}] and control_points[{i + 1}]{of_index(curve)} {why}") from None
    return points


def checked_knots(knots: ArrayLike, count: int, degree: int) -> Doubles:
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
        raise ValidationError(f"{count} control points of degree {degree} need {needed} knots, got {array.size}")
    result = cast(array.copy())
    refuse(~np.isfinite(result), "knots", lambda _: "is not finite")
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
        raise ValidationError(f"the domain of the curve is empty: knots[{degree}] and knots[{count}] are equal")
    return result

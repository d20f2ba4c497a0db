"""Bézier and B-spline curves: control points that the curve is drawn towards, without interpolation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import as_array, whole_number
from ._core import CutLocusError, ValidationError
from .spaces import POINT_TOL, POINT_TOL_FLOAT32, Space
from .spaces import space as space_named

Array = NDArray[Any]

_QUANTITIES = {0: "point", 1: "velocity", 2: "acceleration"}


class BSpline:
    """A B-spline curve on a space: de Boor's algorithm with geodesics in place of straight lines.

    In flat space it is SciPy's ``BSpline``. On a curved space it keeps the ends and the smoothness at
    simple knots up to C¹ (Popiel & Noakes 2007); at interior knots higher derivatives may jump.

    Args:
        knots: shape (n + degree + 1,) for n control points, not falling; a knot may repeat up to
            ``degree + 1`` times, at which the curve is less smooth.
        control_points: shape (..., n, *space.point_shape); leading axes are independent curves.
        degree: 1 or more.
        space: a space or its name.

    Raises:
        ValidationError: the input is not what is described above.
        CutLocusError: the geodesic between two neighbouring control points is not unique.

    >>> import symspline as ss
    >>> corner = ss.BSpline([0, 0, 0, 1, 1, 1], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], 2, ss.Sphere(2))
    >>> corner(0.5).round(8)
    array([0.40824829, 0.81649658, 0.40824829])
    """

    def __init__(self, knots: ArrayLike, control_points: ArrayLike, degree: int, space: Space | str) -> None:
        self._space = space = space_named(space)
        if hasattr(space, "factors"):
            raise ValidationError("a curve in a product is one curve in every factor: make one for each")
        self._degree = whole_number(degree, "degree", 1)
        array = as_array(control_points, "control_points")
        if array.ndim <= len(space.point_shape) or array.size == 0:
            raise ValidationError(
                f"control_points has shape {array.shape}; a curve needs shape (..., n, *point_shape)"
            )
        self._control_points = self._checked(array)
        self._knots = self._checked_knots(knots)
        self._control_points.flags.writeable = self._knots.flags.writeable = False

    def _checked(self, array: Array) -> Array:
        """The control points, on the space and within reach of each other."""
        space = self._space
        tol = POINT_TOL_FLOAT32 if array.dtype in (np.float32, np.float16) else POINT_TOL
        doubles = space._doubles(array, "control_points")
        lead = space._lead(doubles)
        space._handle.check_points(space._rows(doubles, lead), lead, tol)
        points = space.project(space._numbers(doubles))
        index = (slice(None),) * (len(lead) - 1)
        for i in range(lead[-1] - 1):
            try:
                space.log(points[(*index, i)], points[(*index, i + 1)])
            except CutLocusError as error:
                raise CutLocusError(f"control points {i} and {i + 1}: {error}") from None
        return points

    def _checked_knots(self, knots: ArrayLike) -> NDArray[np.float64]:
        array = as_array(knots, "knots")
        if array.ndim != 1 or array.dtype.kind not in "biuf":
            raise ValidationError(
                f"knots must be a row of real numbers, not {array.dtype} of shape {array.shape}"
            )
        count = self._control_points.shape[-1 - len(self._space.point_shape)]
        needed = count + self._degree + 1
        if count <= self._degree:
            raise ValidationError(
                f"degree {self._degree} needs at least {self._degree + 1} control points, got {count}"
            )
        if array.size != needed:
            raise ValidationError(
                f"{count} control points of degree {self._degree} need {needed} knots, got {array.size}"
            )
        result = array.astype(np.float64)
        if not np.isfinite(result).all():
            raise ValidationError(f"knots[{np.flatnonzero(~np.isfinite(result))[0]}] is not finite")
        falls = np.flatnonzero(np.diff(result) < 0)
        if falls.size:
            raise ValidationError(
                f"knots[{falls[0] + 1}] = {result[falls[0] + 1]} is before knots[{falls[0]}]"
            )
        if not result[self._degree] < result[count]:
            raise ValidationError(
                f"the curve lives between knots[{self._degree}] and knots[{count}], which are equal"
            )
        return result

    def __call__(self, x: ArrayLike, nu: int = 0) -> Array:
        """The curve at times x.

        Args:
            x: times between ``knots[degree]`` and ``knots[-degree - 1]``, any shape and order.
            nu: 0 for points, 1 for the velocity, 2 for the covariant acceleration.

        Returns:
            Shape batch axes + x.shape + point_shape.

        Raises:
            ValidationError: a time is not finite or outside.
        """
        if isinstance(nu, bool) or nu not in _QUANTITIES:
            raise ValidationError(f"nu must be 0, 1 or 2, not {nu!r}")
        return self._space._numbers(self._evaluate(x, _QUANTITIES[nu]))

    def speed(self, x: ArrayLike) -> Array:
        """|γ'| at times x, shape batch axes + x.shape."""
        return self._evaluate(x, "speed")[()]

    def _evaluate(self, x: ArrayLike, quantity: str) -> NDArray[np.float64]:
        times = as_array(x, "x")
        if times.dtype.kind not in "biuf":
            raise ValidationError(f"x must be real numbers, not {times.dtype}")
        times = np.ascontiguousarray(times, dtype=np.float64).reshape(times.shape)
        start, end = self.domain
        outside = ~((times >= start) & (times <= end))
        if outside.any():
            index = np.argwhere(outside)[0].tolist()
            raise ValidationError(
                f"x{index or ''} = {times[tuple(index)]} is outside the curve's times [{start}, {end}]"
            )
        control = self._control_points.view(np.float64)
        return _core.evaluate_bspline(
            self._space._handle, self._knots, control, self._degree, times, quantity
        )

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time of the curve."""
        return float(self._knots[self._degree]), float(self._knots[-self._degree - 1])

    @property
    def knots(self) -> NDArray[np.float64]:
        """The knots."""
        return self._knots

    @property
    def control_points(self) -> Array:
        """The control points, shape (..., n, *point_shape)."""
        return self._control_points

    @property
    def degree(self) -> int:
        """The degree."""
        return self._degree

    @property
    def space(self) -> Space:
        """The space."""
        return self._space

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, BSpline):
            return NotImplemented
        return (
            self._space == other._space
            and self._degree == other._degree
            and np.array_equal(self._knots, other._knots)
            and np.array_equal(self._control_points, other._control_points)
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        count = self._control_points.shape[-1 - len(self._space.point_shape)]
        return f"<{type(self).__name__} on {self._space!r}: {count} control points, degree {self._degree}>"


class BezierCurve(BSpline):
    """A Bézier curve of any degree on a space, for times from 0 to 1: de Casteljau's algorithm, (8).

    Args:
        control_points: shape (..., degree + 1, *space.point_shape), at least two.
        space: a space or its name.

    >>> import symspline as ss
    >>> curve = ss.BezierCurve([[1, 0, 0], [0, 1, 0], [0, 0, 1]], ss.Sphere(2))
    >>> curve(0.5).round(8)
    array([0.40824829, 0.81649658, 0.40824829])
    >>> curve(0, nu=1).round(8) + 0.0
    array([0.        , 3.14159265, 0.        ])
    """

    def __init__(self, control_points: ArrayLike, space: Space | str) -> None:
        space = space_named(space)
        shape = np.shape(as_array(control_points, "control_points"))
        count = shape[-1 - len(space.point_shape)] if len(shape) > len(space.point_shape) else 0
        if count < 2:
            raise ValidationError(
                f"control_points has shape {shape}; a curve needs shape (..., n, *point_shape) with n >= 2"
            )
        super().__init__([0.0] * count + [1.0] * count, control_points, count - 1, space)

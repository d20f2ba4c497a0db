"""Bézier and B-spline curves: control points that the curve is drawn towards, without interpolation."""

from __future__ import annotations

from typing import Any, Generic

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import as_array, cast, whole_number
from ._core import ValidationError
from ._curves.control import checked_knots, checked_points, control_array
from ._curves.reduced import reduced
from ._options import quantity_of
from ._spaces import Product, Space
from ._spaces import space as space_named
from ._time import onto_ends
from ._typing import FloatArray, P
from .manifolds._manifold import refuse_functions


class BSpline(Generic[P]):
    """A B-spline curve on a space: de Boor's algorithm with geodesics in place of straight lines.

    In flat space it is SciPy's ``BSpline``. On a curved space it keeps the ends and the smoothness at
    simple knots up to C¹ (Popiel & Noakes 2007); at interior knots higher derivatives may jump. Where they
    jump the curve has those from the right, at its end those from the left.

    Args:
        knots: shape (n + degree + 1,) for n control points, not falling; a knot may repeat up to
            ``degree + 1`` times, at which the curve is less smooth.
        control_points: shape (..., n, *space.point_shape); leading axes are independent curves. Points
            within 1e-8 of the space (1e-4 for single precision) are projected.
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

    def __init__(
        self, knots: ArrayLike, control_points: ArrayLike, degree: int, space: Space[P] | str
    ) -> None:
        self._space = space = _factor(space)
        self._degree = whole_number(degree, "degree", 1)
        doubles, tol = control_array(control_points, space, 2)
        self._knots = checked_knots(knots, space._lead(doubles)[-1], self._degree)
        self._control_points: Any = checked_points(space, doubles, tol)
        self._control_points.flags.writeable = self._knots.flags.writeable = False

    def __call__(self, x: ArrayLike, nu: int = 0) -> P:
        """The curve at times x.

        Args:
            x: times between ``knots[degree]`` and ``knots[-degree - 1]``, any shape and order.
            nu: 0 for points, 1 for the velocity, 2 for the covariant acceleration.

        Returns:
            Shape batch axes + x.shape + point_shape.

        Raises:
            ValidationError: a time is not finite or outside.
        """
        values: P = self._evaluate(x, quantity_of(nu))
        return values

    def speed(self, x: ArrayLike) -> FloatArray:
        """|γ'| at times x, shape batch axes + x.shape."""
        speeds: FloatArray = self._evaluate(x, "speed")[()]
        return speeds

    def _evaluate(self, x: ArrayLike, quantity: str) -> Any:
        times = self._times(x)
        space, control, span = reduced(self._space, self._control_points)
        values = _core.evaluate_bspline(
            space._handle, self._knots, space._as_doubles(control), self._degree, times, quantity
        )
        if quantity == "speed":
            return values
        batch = control.shape[: control.ndim - len(space.point_shape) - 1]
        return space._numbers(values) if span is None else span.embed_samples(space._numbers(values), batch)

    def _times(self, x: ArrayLike) -> NDArray[np.float64]:
        """Times of the curve as doubles."""
        times = as_array(x, "x")
        if times.dtype.kind not in "biuf":
            raise ValidationError(f"x must be real numbers, not {times.dtype}")
        start, end = self.domain
        times, _ = onto_ends(cast(times), np.array([start, end]), (), False, times.dtype)
        outside = ~((times >= start) & (times <= end))
        if outside.any():
            index = np.argwhere(outside)[0].tolist()
            time = times[tuple(index)]
            where = f"outside the curve's times [{start}, {end}]" if np.isfinite(time) else "not finite"
            raise ValidationError(f"x{index or ''} = {time} is {where}")
        return times

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time of the curve."""
        return float(self._knots[self._degree]), float(self._knots[-self._degree - 1])

    @property
    def knots(self) -> NDArray[np.float64]:
        """The knots."""
        return self._knots

    @property
    def control_points(self) -> P:
        """The control points, shape (..., n, *point_shape)."""
        points: P = self._control_points
        return points

    @property
    def degree(self) -> int:
        """The degree."""
        return self._degree

    @property
    def space(self) -> Space[P]:
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

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        # Unpickled arrays can be written to.
        self._control_points.flags.writeable = self._knots.flags.writeable = False

    def __repr__(self) -> str:
        count = self._control_points.shape[-1 - len(self._space.point_shape)]
        return f"<{type(self).__name__} on {self._space!r}: {count} control points, degree {self._degree}>"


class BezierCurve(BSpline[P]):
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

    def __init__(self, control_points: ArrayLike, space: Space[P] | str) -> None:
        space = _factor(space)
        count = space._lead(control_array(control_points, space, 2)[0])[-1]
        super().__init__([0.0] * count + [1.0] * count, control_points, count - 1, space)


def _factor(space: Space[P] | str) -> Space[P]:
    """The space, which is no product."""
    space = space_named(space)
    if isinstance(space, Product):
        raise ValidationError("a curve in a product is one curve in every factor: make one for each")
    refuse_functions(space, "B-spline and Bézier curves are not made")
    return space

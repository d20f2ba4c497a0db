"""Bézier and B-spline curves, which approximate their control points without interpolating them."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._archive import VERSION, Entries, Stored, entry, read_array, read_space
from ._arrays import as_array, cast, refuse, whole_number
from ._core import CutLocusError, ValidationError
from ._curve import Curve
from ._curves.curve import NORMS
from ._curves.ends import ends_of
from ._curves.fit import Points, unwrapped, validated
from ._curves.integrals import EXACT
from ._curves.reduced import reduced
from ._faults import of_index
from ._options import quantity_of
from ._representatives import warn_of_far_data
from ._spaces import Array, Doubles, Product, Space, point_tol, space_named
from ._time import TimeAxis, onto_ends
from ._typing import FloatArray, P, Progress
from .manifolds._manifold import refuse_functions


class BSpline(Curve[P]):
    """Construct a B-spline curve from control points.

    The curve is evaluated by de Boor's algorithm with geodesics in place of straight lines. On a Euclidean space the
    result equals SciPy's ``BSpline``. Leading axes of the control points are batch axes.

    Parameters
    ----------
    knots : array_like, shape (n + degree + 1,)
        Non-decreasing knots for n control points. A knot may repeat up to ``degree + 1`` times; the curve is less
        smooth there.
    control_points : array_like, shape (..., n, *space.point_shape)
        Control points. Points within 1e-8 of the manifold (1e-4 for single precision) are projected onto it.
    degree : int
        Degree, at least 1.
    space : Space or str
        A space or its name. Products and manifolds made of functions are not supported.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    CutLocusError
        If two neighbouring control points are not joined by a unique shortest geodesic.

    Warns
    -----
    FarPointsWarning
        If there are at least five control points and more than half of the steps between them exceed 0.6 of the
        distance to the cut locus.

    See Also
    --------
    BezierCurve : Construct a Bézier curve of any degree.
    CubicSpline : Interpolate points by a C² curve.

    Notes
    -----
    On a curved space the curve is C¹ at simple knots, as long as the degree is at least two. Higher derivatives may
    jump at interior knots. There, the derivatives from the right are returned, and at the end of the curve those from
    the left.

    The methods ``transport`` and ``lift`` of `CubicSpline` are absent: they follow a curve through cubic Bézier
    segments, of which a B-spline on a curved space does not consist.

    References
    ----------
    T. Popiel, L. Noakes, Bézier curves and C² interpolation in Riemannian manifolds, J. Approx. Theory 148 (2007).

    Examples
    --------
    >>> import symspline as ss
    >>> corner = ss.BSpline([0, 0, 0, 1, 1, 1], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], 2, ss.Sphere(2))
    >>> corner(0.5).round(8)
    array([0.40824829, 0.81649658, 0.40824829])
    """

    _format = "symspline-bspline"
    _curve: ControlledCurve
    _time_axis = TimeAxis()

    def __init__(self, knots: ArrayLike, control_points: ArrayLike, degree: int, space: Space[P] | str) -> None:
        space = _factor(space)
        degree = whole_number(degree, "degree", 1)
        doubles, tol = _control_array(control_points, space, 2)
        knots = _checked_knots(knots, space._lead(doubles)[-1], degree)
        *batch, count = space._lead(doubles)
        data = unwrapped(space, Points(doubles, tol, tuple(batch), count))
        self._fill(space, knots, _checked_points(space, data.numbers, tol), degree)
        warn_of_far_data(space, [data])

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
        ndarray, shape ``(*batch axes, *x.shape, *point_shape)``
            Points or tangent vectors.

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
        return self._curve.knots

    @property
    def control_points(self) -> P:
        """Control points, shape (..., n, *point_shape)."""
        points: P = self._curve.control_points
        return points

    @property
    def degree(self) -> int:
        """Degree of the curve."""
        return self._curve.degree

    @property
    def space(self) -> Space[P]:
        """Space of the curve."""
        return self._curve.space

    def _picked(self, index: Any) -> Self:
        return self._of(self.space, self.knots, np.ascontiguousarray(self.control_points[index]), self.degree)

    def _fill(self, *parts: Any) -> None:
        self._curve = ControlledCurve(*parts)

    def _state(self) -> dict[str, Any]:
        head = {"format": self._format, "version": VERSION, "space": self.space}
        return head | {"knots": self.knots, "control_points": self.control_points, "degree": self.degree}

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        space, degree = _factor(read_space(state)), state["degree"]
        control, knots = read_array(state, "control_points", space), state["knots"]
        if isinstance(state, Stored):
            with entry("control_points"):
                # They keep the values that they had after projection.
                _checked_points(space, *_control_array(control, space, 2))
            with entry("degree"):
                degree = whole_number(degree, "degree", 1)
            with entry("knots"):
                knots = _checked_knots(knots, space._lead(space._doubles(control, "control_points"))[-1], degree)
        return cls._of(space, knots, control, degree)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, BSpline):
            return NotImplemented
        return (
            self.space == other.space
            and self.degree == other.degree
            and np.array_equal(self.knots, other.knots)
            and np.array_equal(self.control_points, other.control_points)
        )

    def __repr__(self) -> str:
        count = self._curve.control_points.shape[-1 - len(self.space.point_shape)]
        what = f"{self._batch_text}{count} control points, degree {self.degree}"
        return f"<{type(self).__name__} on {self.space!r}: {what}>"


class ControlledCurve:
    """Knots, control points and degree of B-spline curves, and evaluation in the core.

    Attributes
    ----------
    times : ndarray
        The distinct knots of the domain, between which the curve is smooth.
    """

    quad_rtol = EXACT
    max_nu = 2

    def __init__(self, space: Space[Any], knots: Doubles, control_points: Any, degree: int) -> None:
        self.space, self.knots, self.control_points, self.degree = space, knots, control_points, degree
        self.times = np.unique(knots[degree : knots.size - degree])
        control_points.flags.writeable = knots.flags.writeable = False

    @property
    def batch(self) -> tuple[int, ...]:
        shape: tuple[int, ...] = self.control_points.shape
        return shape[: len(shape) - len(self.space.point_shape) - 1]

    @property
    def parts(self) -> tuple[ControlledCurve]:
        """The curve itself."""
        return (self,)

    def evaluate(
        self,
        x: Doubles,
        quantity: str,
        outside: str = "raise",
        per_curve: bool = False,
        progress: Progress | None = None,
    ) -> Any:
        """A quantity at times in the domain; with ``per_curve`` the leading axes of x are the batch axes."""
        if per_curve:
            batch = self.batch
            rows = x.reshape(-1, *x.shape[len(batch) :])
            if not (rows == rows[0]).all():
                # The core evaluates all curves of a batch at the same times.
                control = self.control_points.reshape(-1, *self.control_points.shape[len(batch) :])
                each = [
                    ControlledCurve(self.space, self.knots, own, self.degree).evaluate(row, quantity)
                    for own, row in zip(control, np.ascontiguousarray(rows), strict=True)
                ]
                return np.reshape(each, (*batch, *each[0].shape))
            x = np.ascontiguousarray(rows[0])
        space, control, span = reduced(self.space, self.control_points)
        values = _core.evaluate_bspline(space._handle, self.knots, space._as_doubles(control), self.degree, x, quantity)
        if quantity in NORMS:
            return values
        return space._numbers(values) if span is None else span.embed_samples(space._numbers(values), self.batch)


class BezierCurve(BSpline[P]):
    r"""Construct a Bézier curve of any degree, for times from 0 to 1.

    The curve is evaluated by de Casteljau's algorithm with geodesics in place of straight lines. The degree is the
    number of control points minus one.

    Parameters
    ----------
    control_points : array_like, shape (..., degree + 1, *space.point_shape)
        Control points, at least two per curve. Leading axes are batch axes.
    space : Space or str
        A space or its name. Products and manifolds made of functions are not supported.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    CutLocusError
        If two neighbouring control points are not joined by a unique shortest geodesic.

    See Also
    --------
    BSpline : Construct a B-spline curve from control points.

    Notes
    -----
    A segment of a `CubicSpline` is a Bézier curve of degree three, equation (8) of the paper:

    .. math:: \gamma(t) = [\,[\,[p_0, q_0]_t, [q_0, q_1]_t\,]_t, [\,[q_0, q_1]_t, [q_1, p_1]_t\,]_t\,]_t,

    where :math:`[p, q]_t` is the geodesic from p to q.

    References
    ----------
    G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
    Anal. 56 (2018), equation (8).

    Examples
    --------
    >>> import symspline as ss
    >>> curve = ss.BezierCurve([[1, 0, 0], [0, 1, 0], [0, 0, 1]], ss.Sphere(2))
    >>> curve(0.5).round(8)
    array([0.40824829, 0.81649658, 0.40824829])
    >>> curve(0, nu=1).round(8) + 0.0
    array([0.        , 3.14159265, 0.        ])
    """

    _format = "symspline-bezier"

    def __init__(self, control_points: ArrayLike, space: Space[P] | str) -> None:
        space = _factor(space)
        count = space._lead(_control_array(control_points, space, 2)[0])[-1]
        super().__init__([0.0] * count + [1.0] * count, control_points, count - 1, space)

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        curve = super()._from_state(state)
        count = curve.degree + 1
        if curve.knots.tolist() != [0.0] * count + [1.0] * count:
            raise ValidationError("entry 'knots' must be zeros and ones, as many of either as there are points")
        return curve


def _factor(space: Space[P] | str) -> Space[P]:
    """Return the space, which must not be a product."""
    space = space_named(space)
    if isinstance(space, Product):
        raise ValidationError(
            "B-spline and Bézier curves are not defined on a Product. Make one curve for each factor."
        )
    refuse_functions(space, "B-spline and Bézier curves are not made")
    return space


def _control_array(value: ArrayLike, space: Space[Any], least: int) -> tuple[Doubles, float]:
    """Return control points as floating-point numbers of the core, and their tolerance."""
    array = space._array(value, "control_points")
    doubles = space._doubles(array, "control_points") if array.ndim > len(space.point_shape) else None
    if doubles is None or array.size == 0 or space._lead(doubles)[-1] < least:
        shape = ", ".join(map(str, space.point_shape))
        raise ValidationError(
            f"control_points has shape {array.shape}; a curve needs shape (..., n, {shape}) with n >= {least}"
        )
    return doubles, point_tol(array.dtype)


def _checked_points(space: Space[Any], doubles: Doubles, tol: float) -> Array:
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


def _checked_knots(knots: ArrayLike, count: int, degree: int) -> Doubles:
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

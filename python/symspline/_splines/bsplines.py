"""Bézier curves, B-splines, and cumulative B-splines on Lie groups."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._base.arrays import as_array, cast, checked_number, refuse, short_repr, whole_number
from .._base.faults import of_index, warn
from .._base.report import ConvergenceWarning, CumulativeReport
from .._base.time import TimeAxis, onto_ends
from .._base.typing import FloatArray, OnFailure, P, PointsLike
from .._core import ConvergenceError, CutLocusError, ValidationError
from .._curves.controlled import ControlledCurve, CumulativeCurve, CumulativeProduct, cumulative_of
from .._curves.ends import ends_of
from .._curves.failures import warn_of_far_data
from .._curves.fit import Points, read_given, unwrapped, validated
from .._curves.options import check_on_failure, quantity_of
from .._spaces import Array, Doubles, Euclidean, Group, Product, Quotient, Space, factors_of, parts_of, space_named
from ..manifolds._manifold import refuse_functions
from .archive import VERSION, Entries, Stored, entry, read_array, read_report, read_space, suffix_of
from .base import Curve


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


# ---- Bézier and B-spline curves, which approximate their control points without interpolating them ----


class BSpline(ControlledSpline[P]):
    """Construct a B-spline curve from control points.

    The curve is evaluated by de Boor's algorithm with geodesics in place of straight lines. On a Euclidean space the
    result equals SciPy's ``BSpline``. Leading axes of the control points are batch axes.

    Parameters
    ----------
    knots : array_like, shape (n + degree + 1,)
        Non-decreasing knots for n control points. A knot may repeat up to ``degree + 1`` times; the curve is less
        smooth there.
    control_points : array_like, shape (..., n, *space.point_shape)
        Control points. Rounded points are projected onto the manifold; the tolerance is that of `CubicSpline`.
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
    _kind = "B-spline"
    _curve: ControlledCurve

    def __init__(self, knots: ArrayLike, control_points: ArrayLike, degree: int, space: Space[P] | str) -> None:
        space = _factor(space)
        degree = whole_number(degree, "degree", 1)
        doubles, tol = control_array(control_points, space, 2)
        knots = checked_knots(knots, space._lead(doubles)[-1], degree)
        *batch, count = space._lead(doubles)
        data = unwrapped(space, Points(doubles, tol, tuple(batch), count))
        self._fill(ControlledCurve(space, knots, checked_points(space, data.numbers, tol), degree))
        warn_of_far_data(space, [data])

    def _picked(self, index: Any) -> Self:
        control = np.ascontiguousarray(self.control_points[index])
        return self._of(ControlledCurve(self.space, self.knots, control, self.degree))

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
                checked_points(space, *control_array(control, space, 2))
            with entry("degree"):
                degree = whole_number(degree, "degree", 1)
            with entry("knots"):
                knots = checked_knots(knots, space._lead(space._doubles(control, "control_points"))[-1], degree)
        return cls._of(ControlledCurve(space, knots, control, degree))


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
    _kind = "Bézier curve"

    def __init__(self, control_points: ArrayLike, space: Space[P] | str) -> None:
        space = _factor(space)
        count = space._lead(control_array(control_points, space, 2)[0])[-1]
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


# ---- cumulative B-spline curves on Lie groups ----

if TYPE_CHECKING:
    pass


class CumulativeBSpline(ControlledSpline[P]):
    r"""Construct a cumulative B-spline curve on a Lie group from control points.

    A cumulative B-spline of degree 3 is twice continuously differentiable, and a control point affects only the four
    intervals of knots around it. It approximates its control points without passing through them. On a Euclidean space
    the result equals SciPy's ``BSpline``. `fit` fits such a curve to data by least squares.

    Parameters
    ----------
    knots : array_like, shape (n + degree + 1,), or None
        Non-decreasing knots for n control points. A knot may repeat up to ``degree + 1`` times; the curve is less
        smooth there. None means the equidistant knots -degree, ..., n, so that the curve is defined from 0 to
        ``n - degree``.
    control_points : array_like, shape (..., n, *space.point_shape)
        Control points. Rounded points are projected onto the group; the tolerance is that of `CubicSpline`. Leading
        axes are batch axes. For a `Product`, a tuple with one array per factor.
    space : Space or str
        A group or its name, such as ``"so:3"``, ``"se:3"``, ``"su:2"``, ``"gl:3"`` or ``"r:3"``, or a product of
        groups, such as ``"so:3 x r:3"``.
    degree : int, default 3
        Degree, at least 1. The curve has ``degree - 1`` continuous derivatives at simple knots.

    Attributes
    ----------
    report : CumulativeReport or None
        Report of the least-squares fit; None for a curve that was constructed from control points.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above, or the space is not a group.
    CutLocusError
        If two neighbouring control points are not joined by a unique shortest geodesic.

    Warns
    -----
    FarPointsWarning
        If there are at least five control points and more than half of the steps between them exceed 0.6 of the
        distance to the cut locus.

    See Also
    --------
    BSpline : B-spline curves on any space, by de Boor's algorithm; those of degree 3 are C¹.
    CubicSpline : Interpolate points by a C² curve.
    make_lsq_spline : Fit a curve of cubic segments with given knots by least squares.

    Notes
    -----
    With the control points :math:`p_0, \ldots, p_k` whose basis functions :math:`B_m` of degree k are not zero at t,
    the curve is [1]_

    .. math:: \gamma(t) = p_0 \prod_{j=1}^{k} \exp\bigl(\lambda_j(t)\, \omega_j\bigr), \quad
        \omega_j = \log(p_{j-1}^{-1} p_j), \quad \lambda_j = \sum_{m=j}^{k} B_m.

    Velocities and accelerations are exact derivatives of the product [2]_. The acceleration is that of the connection
    of Cartan and Schouten, :math:`\nabla\gamma' = \gamma\,(\gamma^{-1}\gamma')'`, as for all curves on groups.

    The curve follows translations from the left: if all control points are multiplied by g from the left, so is the
    curve. It does not follow those from the right, unless the group is commutative.

    References
    ----------
    .. [1] M.-J. Kim, M.-S. Kim, S. Y. Shin, A general construction scheme for unit quaternion curves with simple high
       order derivatives, SIGGRAPH 1995.
    .. [2] C. Sommer, V. Usenko, D. Schubert, N. Demmel, D. Cremers, Efficient derivative computation for cumulative
       B-splines on Lie groups, CVPR 2020.

    Examples
    --------
    >>> import symspline as ss
    >>> turns = ss.rotations.from_rotation_vectors([[0, 0, 0.1 * i * i] for i in range(6)])
    >>> curve = ss.CumulativeBSpline(None, turns, "so:3")
    >>> curve
    <CumulativeBSpline on SpecialOrthogonal(3): 6 control points, degree 3, from 0 to 3>
    >>> curve.domain
    (0.0, 3.0)
    >>> ss.rotations.angular_velocity(curve, 1.5).round(6)
    array([0. , 0. , 0.5])
    """

    _format = "symspline-cumulative"
    _kind = "CumulativeBSpline"
    _curve: CumulativeCurve | CumulativeProduct
    report: CumulativeReport | None

    def __init__(
        self, knots: ArrayLike | None, control_points: PointsLike, space: Space[P] | str, *, degree: int = 3
    ) -> None:
        space = _checked_group(space)
        degree = whole_number(degree, "degree", 1)
        data = []
        for factor, value in zip(factors_of(space), parts_of(control_points, space, "control_points"), strict=True):
            doubles, tol = control_array(value, factor, 2)
            *batch, count = factor._lead(doubles)
            data.append(Points(doubles, tol, tuple(batch), count))
        if len({(part.batch, part.nodes) for part in data}) > 1:
            raise ValidationError("the factors of control_points must have the same number of points and batch axes")
        count = data[0].nodes
        given = np.arange(-degree, count + 1) if knots is None and degree < count else knots
        found = checked_knots([] if given is None else given, count, degree)
        points = [
            checked_points(own, part.numbers, part.tol) for own, part in zip(factors_of(space), data, strict=True)
        ]
        self._fill(cumulative_of(space, found, points, degree), None)
        warn_of_far_data(space, data)

    @classmethod
    def fit(
        cls,
        t: ArrayLike | None,
        points: PointsLike,
        knots: ArrayLike,
        space: Space[P] | str,
        *,
        weights: ArrayLike | None = None,
        degree: int = 3,
        tol: float = 1e-10,
        max_iter: int = 50,
        on_failure: OnFailure = "raise",
    ) -> Self:
        r"""Fit a cumulative B-spline to noisy points by least squares.

        The curve minimises the weighted sum of squared distances to the data. On a Euclidean space the result equals
        SciPy's ``make_lsq_spline``.

        Parameters
        ----------
        t : array_like, shape (N,), or None
            Times of the data, in non-decreasing order. None means 0, 1, ..., N - 1.
        points : array_like, shape (..., N, *space.point_shape)
            Noisy points. For a `Product`, a tuple of arrays.
        knots : int or array_like
            Number of equidistant knots from the first to the last time, at least 2, or an increasing array that covers
            all times. The first and the last knot are repeated ``degree`` times. There must be data near every knot.
        space : Space or str
            A group or its name, or a product of groups.
        weights : array_like, shape (N,) or (..., N), optional
            Weights of the squared distances, not negative. Data with weight 0 are ignored.
        degree : int, default 3
            Degree of the curve.
        tol : float, default 1e-10
            The iteration stops when a step moves no control point by more than `tol` times the longest step between
            control points.
        max_iter : int, default 50
            Largest number of iterations.
        on_failure : {"raise", "warn", "ignore"}, default "raise"
            Policy if the iteration does not converge: raise `ConvergenceError`, whose attribute ``spline`` holds the
            curve, or return the curve with or without a warning.

        Returns
        -------
        CumulativeBSpline
            The curve. Its `report` describes the fit.

        Raises
        ------
        ValidationError
            If the input does not meet the requirements above, or the data do not determine a control point.
        CutLocusError
            If the data near two neighbouring control points are not joined by a unique shortest geodesic.
        ConvergenceError
            If the iteration does not converge and `on_failure` is ``"raise"``.

        See Also
        --------
        make_lsq_spline : Fit a curve of cubic segments, on any space.

        Notes
        -----
        Gauss and Newton's method moves the control points by :math:`p \leftarrow p \exp(\delta)`. It starts at the data
        nearest to the mean knots of the basis functions. The derivatives of the residuals
        :math:`\log(\gamma(t_i)^{-1} y_i)` are exact, and the normal equations are banded. Distances are those of the
        space; on groups without an invariant metric, such as SE(3), they are the lengths of the logarithms in the body
        frame.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> t = np.linspace(0, 1, 40)
        >>> turns = ss.rotations.from_rotation_vectors(np.sin(3 * t)[:, None] * [0, 0, 1])
        >>> curve = ss.CumulativeBSpline.fit(t, turns, 6, "so:3")
        >>> ss.rotations.as_rotation_vectors(curve(0.5)).round(3) + 0.0
        array([0.   , 0.   , 0.997])
        """
        space = _checked_group(space)
        degree = whole_number(degree, "degree", 1)
        tol = checked_number(tol, "tol must be a number from 0 to 1", lambda x: 0 <= x < 1)
        max_iter = whole_number(max_iter, "max_iter", 1)
        check_on_failure(on_failure)
        data = read_given(points, space)
        batch, count = data[0].batch, data[0].nodes
        times = _times_of(t, count)
        full = _clamped(knots, times, degree)
        w = _weights_of(weights, batch, count)
        ends = [ends_of("natural", factor, batch) for factor in factors_of(space)]
        valid, _ = validated(space, np.arange(count, dtype=np.float64), data, ends)
        control, columns = [], []
        for factor, y in zip(factors_of(space), valid, strict=True):
            fitted: tuple[Any, ...] = _core.fit_cumulative(
                factor._handle, full, degree, times, np.ascontiguousarray(factor._as_doubles(y)), w, tol, max_iter
            )
            control.append(factor._numbers(fitted[0]))
            columns.append([np.reshape(column, batch) for column in fitted[1:]])
        converged, iterations, step, residual = (np.array(each) for each in zip(*columns, strict=True))
        each = [converged.all(axis=0), iterations.max(axis=0), step.max(axis=0), residual.sum(axis=0)]
        report = CumulativeReport(*(own if batch else own.item() for own in each))
        curve = cls._of(cumulative_of(space, full, control, degree), report)
        _check_converged(curve, report, on_failure)
        return curve

    @property
    def _unconverged(self) -> int:
        return 0 if self.report is None else int(np.sum(~np.asarray(self.report.converged)))

    def _where(self, extrapolate: Any) -> str:
        """Return the extrapolation policy. B-splines have no values outside their domain."""
        if extrapolate is None or (isinstance(extrapolate, str) and extrapolate == "raise"):
            return "raise"
        if extrapolate is False:
            return "nan"
        raise ValidationError(
            f"extrapolate must be None, 'raise' or False for a cumulative B-spline, not {short_repr(extrapolate)}"
        )

    # ---- batches, files ----

    def _fill(self, *parts: Any) -> None:
        self._curve, self.report = parts

    @property
    def t(self) -> Doubles:
        """Distinct knots in the domain of the curve."""
        return self._curve.times

    def _picked(self, index: Any) -> Self:
        report = self.report and self.report.map(lambda column: column[index])
        return self._of(self._curve.take_batch(index), report)

    def _state(self) -> dict[str, Any]:
        space: Space[Any] = self.space
        report = self.report
        head = {"format": self._format, "version": VERSION, "space": space, "knots": self.knots, "degree": self.degree}
        points = {
            "control_points" + suffix_of(space, i): part.control_points for i, part in enumerate(self._curve.parts)
        }
        return head | points | {"report": None if report is None else vars(report)}

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        with entry("space"):
            space = _checked_group(read_space(state))
        degree, knots = state["degree"], state["knots"]
        names = ["control_points" + suffix_of(space, i) for i in range(len(factors_of(space)))]
        control = [read_array(state, name, own) for name, own in zip(names, factors_of(space), strict=True)]
        if isinstance(state, Stored):
            for name, factor, points in zip(names, factors_of(space), control, strict=True):
                with entry(name):
                    # They keep the values that they had after projection.
                    checked_points(factor, *control_array(points, factor, 2))
            with entry("degree"):
                degree = whole_number(degree, "degree", 1)
            leads = {
                own._lead(own._doubles(x, "control_points")) for own, x in zip(factors_of(space), control, strict=True)
            }
            with entry("knots"):
                if len(leads) > 1:
                    raise ValidationError("the factors have different numbers of control points")
                knots = checked_knots(knots, leads.pop()[-1], degree)
        curve = cumulative_of(space, knots, control, degree)
        with entry("report"):
            plain = state["report"]
            report = None if plain is None else read_report(CumulativeReport, plain, curve.batch)
        return cls._of(curve, report)


def _checked_group(space: Space[P] | str) -> Space[P]:
    """Return the space, whose factors must be groups."""
    space = space_named(space)
    for factor in factors_of(space):
        if isinstance(factor, Quotient) or not isinstance(factor, (Group, Euclidean)):
            raise ValidationError(
                f"space: cumulative B-splines are defined on groups, such as so:3, se:3, su:2, gl:3 or r:3, and on "
                f"products of groups, but {factor!r} is not a group. Use BSpline, or make_lsq_spline for a fit."
            )
    return space


def _times_of(t: ArrayLike | None, count: int) -> Doubles:
    """Return the times of data."""
    if t is None:
        return np.arange(count, dtype=np.float64)
    array = as_array(t, "t")
    if array.dtype.kind not in "biuf" or array.shape != (count,):
        raise ValidationError(
            f"t must be {count} real numbers, one per point, not {array.dtype} of shape {array.shape}"
        )
    times = cast(array.copy())
    refuse(~np.isfinite(times), "t", lambda i: f"= {times[i]} is not finite")
    falls = np.flatnonzero(times[1:] < times[:-1])
    if falls.size:
        i = falls[0] + 1
        raise ValidationError(f"t[{i}] = {times[i]} is before t[{i - 1}] = {times[i - 1]}. Sort the data by time.")
    if not times[0] < times[-1] or not np.isfinite(times[-1] - times[0]):
        raise ValidationError("t must contain at least two different times, within the floating-point range")
    return times


def _clamped(knots: Any, times: Doubles, degree: int) -> Doubles:
    """Return knots that cover the times, with the first and last one repeated."""
    array = as_array(knots, "knots")
    if array.ndim == 0:
        number = whole_number(knots, "knots", 2)
        if number > times.size + 1:
            raise ValidationError(f"knots = {number} exceeds the number of data, {times.size}. Use fewer knots.")
        inner = np.linspace(times[0], times[-1], number)
    else:
        if array.ndim != 1 or array.dtype.kind not in "biuf" or array.size < 2:
            raise ValidationError(
                f"knots must be a number of knots, or at least two increasing times, not {array.dtype} of shape "
                f"{array.shape}"
            )
        inner = cast(array.copy())
        refuse(~np.isfinite(inner), "knots", lambda i: f"= {inner[i]} is not finite")
        flat = np.flatnonzero(~(inner[1:] > inner[:-1]))
        if flat.size:
            i = flat[0] + 1
            raise ValidationError(f"knots[{i}] = {inner[i]} is not after knots[{i - 1}] = {inner[i - 1]}")
        if inner[0] > times[0] or inner[-1] < times[-1]:
            raise ValidationError(
                f"knots reach from {inner[0]} to {inner[-1]}, but must cover the times from {times[0]} to {times[-1]}"
            )
    return np.concatenate([np.repeat(inner[0], degree), inner, np.repeat(inner[-1], degree)])


def _weights_of(weights: ArrayLike | None, batch: tuple[int, ...], count: int) -> Doubles:
    """Return one weight per datum of every curve."""
    if weights is None:
        return np.ones((*batch, count))
    array = as_array(weights, "weights")
    if array.dtype.kind not in "biuf":
        raise ValidationError(f"weights must be real numbers, not {array.dtype}")
    refuse(~(np.isfinite(array) & (array >= 0)), "weights", lambda i: f"= {array[i]} must be finite and not negative")
    try:
        return np.array(np.broadcast_to(cast(array), (*batch, count)), order="C")
    except ValueError:
        raise ValidationError(
            f"weights has shape {array.shape}, but must broadcast to {(*batch, count)}. Pass one weight per point."
        ) from None


def _check_converged(curve: CumulativeBSpline[Any], report: CumulativeReport, on_failure: str) -> None:
    """Raise an error or warn if a curve of the batch did not converge."""
    failed = np.argwhere(~np.asarray(report.converged))
    if not len(failed) or on_failure == "ignore":
        return
    index = tuple(failed[0].tolist())
    step, iterations = np.asarray(report.step)[index], np.asarray(report.iterations)[index]
    of = f" of curve {list(index)}" if index else ""
    message = (
        f"the least-squares fit{of} did not converge: after {iterations} iterations the last step is {step:.1e} of the "
        "longest step between control points. Use fewer knots, check the data for outliers, or increase max_iter."
    )
    if on_failure == "warn":
        warn(message, ConvergenceWarning, index)
        return
    error = ConvergenceError(message)
    error.spline, error.curve = curve, index
    raise error

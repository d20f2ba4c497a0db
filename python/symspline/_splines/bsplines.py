"""Bézier curves, B-splines, and cumulative B-splines on Lie groups."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._base.arrays import as_array, cast, checked_number, refuse, whole_number
from .._base.faults import UNCONVERGED, Fault, between_neighbours, renamed
from .._base.report import CumulativeReport
from .._base.typing import Array, OnFailure, P, PointsLike, State
from .._core import CutLocusError, ValidationError
from .._curves.curve import ControlledCurve
from .._curves.ends import ends_of
from .._curves.failures import raise_or_warn, warn_of_far_data
from .._curves.fit import Points, read_given, unwrapped, validated
from .._curves.options import check_on_failure
from .._spaces import AnySpace, Doubles, Euclidean, Group, Product, Quotient, Space, factors_of, parts_of, space_named
from ..manifolds._manifold import refuse_functions
from .archive import Entries, Stored, by_factor, entry, head_of, read_by_factor, read_report
from .base import Curve


class ControlledSpline(Curve[P]):
    """Base class of B-spline curves."""

    _curve: ControlledCurve
    _cumulative: ClassVar[bool] = False

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

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ControlledSpline):
            return NotImplemented
        return (
            self._curve.cumulative == other._curve.cumulative
            and self.space == other.space
            and self.degree == other.degree
            and np.array_equal(self.knots, other.knots)
            and all(np.array_equal(*factor) for factor in zip(self._curve.control, other._curve.control, strict=True))
        )

    # ---- batches, files ----

    @staticmethod
    @abstractmethod
    def _checked_space(space: AnySpace | str) -> AnySpace:
        """Return the space, on which curves of this class must be defined."""

    @classmethod
    def _of(cls, curve: ControlledCurve) -> Self:
        self = cls.__new__(cls)
        self._curve = curve
        return self

    def _picked(self, index: Any) -> Self:
        return self._of(self._curve.take_batch(index))

    def _state(self) -> State:
        state = head_of(self) | {"knots": self.knots, "degree": self.degree}
        return state | by_factor("control_points", self._curve.space, self._curve.control)

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        space = state.read("space", cls._checked_space)
        degree, knots, control = state["degree"], state["knots"], read_by_factor(state, "control_points", space)
        if isinstance(state, Stored):
            # Control points keep the values that they had after projection.
            points = tuple(control) if isinstance(space, Product) else control[0]
            with entry("control_points"):
                curve = _opened(points, space, knots, degree, cls._cumulative)
            degree, knots = curve.degree, curve.knots
        return cls._of(ControlledCurve(space, knots, control, degree, cls._cumulative))

    @property
    def _counts(self) -> str:
        return f"{self._made_of()}, "

    def _made_of(self, radius: float | None = None) -> str:
        return f"{self.knots.size - self.degree - 1} control points, degree {self.degree}"


def _opened(control_points: PointsLike, space: AnySpace, knots: Any, degree: Any, cumulative: bool) -> ControlledCurve:
    """Return the curve with given control points and knots, after validation."""
    degree = whole_number(degree, "degree", 1)
    factors = factors_of(space)
    data = list(map(_read_factor, parts_of(control_points, space, "control_points"), factors))
    count = _check_alike(data)
    if knots is None:
        knots = np.arange(-degree, count + 1) if degree < count else []
    knots = checked_knots(knots, count, degree)
    data = list(map(unwrapped, factors, data))
    return ControlledCurve(space, knots, list(map(checked_points, factors, data)), degree, cumulative)


def _read_factor(value: ArrayLike, space: AnySpace) -> Points:
    """Return the control points of one factor."""
    array = space._array(value, "control_points")
    doubles = space._doubles(array, "control_points") if array.ndim > len(space.point_shape) else None
    if doubles is None or array.size == 0 or space._lead(doubles)[-1] < 2:
        shape = ", ".join(map(str, space.point_shape))
        raise ValidationError(
            f"control_points has shape {array.shape}; a curve needs shape (..., n, {shape}) with n >= 2"
        )
    *batch, count = space._lead(doubles)
    return Points(doubles, space._tol(array), tuple(batch), count)


def _check_alike(data: list[Points]) -> int:
    """Return the number of control points, which must be the same in all factors."""
    if len({(part.batch, part.nodes) for part in data}) > 1:
        raise ValidationError("the factors of control_points must have the same number of points and batch axes")
    return data[0].nodes


def checked_points(space: AnySpace, data: Points) -> Array:
    """Project control points onto the space.

    Raises
    ------
    ValidationError
        If a control point is not on the space.
    CutLocusError
        If two neighbouring control points are not joined by a unique shortest geodesic.
    """
    ends = ends_of("natural", space, data.batch)
    try:
        (points,), _ = validated(space, np.arange(data.nodes, dtype=np.float64), [data], [ends])
    except ValidationError as error:
        raise renamed(error, lambda sample: ("control_points", sample.node)) from None
    p, q = space._neighbours(points)
    try:
        space._apply("log", p=p, q=q)
    except CutLocusError as error:
        raise between_neighbours(error, "control_points", (*data.batch, data.nodes - 1)) from None
    return points


def _ordered(value: ArrayLike, name: str, needed: str, *, least: int = 0, count: int | None = None) -> Doubles:
    """Return a copy of a vector of finite times that do not decrease."""
    array = as_array(value, name)
    if array.ndim != 1 or array.dtype.kind not in "biuf" or array.size < least or count not in (None, array.size):
        raise ValidationError(f"{name} must be {needed}, not {array.dtype} of shape {array.shape}")
    times = cast(array.copy())
    refuse(~np.isfinite(times), name, lambda i: f"= {times[i]} is not finite")
    falls = np.flatnonzero(times[1:] < times[:-1])
    if falls.size:
        i = falls[0] + 1
        raise ValidationError(f"{name}[{i}] = {times[i]} is before {name}[{i - 1}] = {times[i - 1]}. Sort by time.")
    return times


def checked_knots(knots: ArrayLike, count: int, degree: int) -> Doubles:
    """Return a copy of the knots of a B-spline with `count` control points after validation."""
    result, needed = _ordered(knots, "knots", "a one-dimensional array of real numbers"), count + degree + 1
    if count <= degree:
        raise ValidationError(f"degree {degree} needs at least {degree + 1} control points, got {count}")
    if result.size != needed:
        raise ValidationError(f"{count} control points of degree {degree} need {needed} knots, got {result.size}")
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

    def __init__(self, knots: ArrayLike, control_points: ArrayLike, degree: int, space: Space[P] | str) -> None:
        self._curve = _opened(control_points, self._checked_space(space), knots, degree, False)
        warn_of_far_data(self.space, self._curve.control)

    @staticmethod
    def _checked_space(space: AnySpace | str) -> AnySpace:
        space = space_named(space)
        if isinstance(space, Product):
            raise ValidationError(
                "B-spline and Bézier curves are not defined on a Product. Make one curve for each factor."
            )
        refuse_functions(space, "B-spline and Bézier curves are not made")
        return space


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
        space = self._checked_space(space)
        count = _read_factor(control_points, space).nodes
        super().__init__([0.0] * count + [1.0] * count, control_points, count - 1, space)

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        curve = super()._from_state(state)
        count = curve.degree + 1
        if curve.knots.tolist() != [0.0] * count + [1.0] * count:
            raise ValidationError("entry 'knots' must be zeros and ones, as many of either as there are points")
        return curve


# ---- cumulative B-spline curves on Lie groups ----


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
    _cumulative = True
    report: CumulativeReport | None

    def __init__(
        self, knots: ArrayLike | None, control_points: PointsLike, space: Space[P] | str, *, degree: int = 3
    ) -> None:
        self._curve = _opened(control_points, self._checked_space(space), knots, degree, True)
        self.report = None
        warn_of_far_data(self.space, self._curve.control)

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
        space = cls._checked_space(space)
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
        converged, iterations, step, residual = (np.array(combined) for combined in zip(*columns, strict=True))
        combined = [converged.all(axis=0), iterations.max(axis=0), step.max(axis=0), residual.sum(axis=0)]
        report = CumulativeReport(*(value if batch else value.item() for value in combined))
        curve = cls._of(ControlledCurve(space, full, control, degree, cumulative=True))
        curve.report = report
        raise_or_warn(_faults(report, tol), on_failure, curve)
        return curve

    @property
    def _unconverged(self) -> int:
        return 0 if self.report is None else int(np.sum(~np.asarray(self.report.converged)))

    @property
    def t(self) -> Doubles:
        """Distinct knots in the domain of the curve."""
        return self._curve.times

    @staticmethod
    def _checked_space(space: AnySpace | str) -> AnySpace:
        """Return the space if all its factors are groups."""
        space = space_named(space)
        for factor in factors_of(space):
            if isinstance(factor, Quotient) or not isinstance(factor, (Group, Euclidean)):
                raise ValidationError(
                    f"space: cumulative B-splines are defined on groups, such as so:3, se:3, su:2, gl:3 or r:3, and "
                    f"on products of groups, but {factor!r} is not a group. Use BSpline, or make_lsq_spline for a fit."
                )
        return space

    def _picked(self, index: Any) -> Self:
        curve = super()._picked(index)
        curve.report = self.report and self.report.map(lambda column: column[index])
        return curve

    def _state(self) -> State:
        return super()._state() | {"report": None if self.report is None else vars(self.report)}

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        curve = super()._from_state(state)
        curve.report = state.read(
            "report", lambda plain: None if plain is None else read_report(CumulativeReport, plain, curve._batch)
        )
        return curve


def _times_of(t: ArrayLike | None, count: int) -> Doubles:
    """Return the times of data."""
    if t is None:
        return np.arange(count, dtype=np.float64)
    times = _ordered(t, "t", f"{count} real numbers, one per point", count=count)
    if not times[0] < times[-1] or not np.isfinite(times[-1] - times[0]):
        raise ValidationError("t must contain at least two different times, within the floating-point range")
    return times


def _clamped(knots: Any, times: Doubles, degree: int) -> Doubles:
    """Return knots that cover the times, with the first and last one repeated."""
    if np.ndim(knots) == 0:
        number = whole_number(knots, "knots", 2)
        if number > times.size + 1:
            raise ValidationError(f"knots = {number} exceeds the number of data, {times.size}. Use fewer knots.")
        inner = np.linspace(times[0], times[-1], number)
    else:
        inner = _ordered(knots, "knots", "a number of knots, or at least two increasing times", least=2)
        flat = np.flatnonzero(inner[1:] == inner[:-1])
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


def _faults(report: CumulativeReport, tol: float) -> list[Fault]:
    """Return the faults of the fits that did not converge."""
    remedy = "use fewer knots, check the data for outliers, or increase max_iter"
    steps, iterations = np.ravel(report.step), np.ravel(report.iterations)
    faults = []
    for number in np.flatnonzero(~np.ravel(report.converged)).tolist():
        what = (
            f"the least-squares fit{{of}} did not converge: after {iterations[number]} iterations the last step is "
            f"{steps[number]:.1e} of the longest step between control points"
        )
        faults.append(Fault(number, UNCONVERGED, what, remedy, value=float(steps[number]), limit=tol))
    return faults

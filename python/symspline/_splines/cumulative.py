"""Cumulative B-spline curves on Lie groups."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._base.arrays import as_array, cast, checked_number, refuse, short_repr, whole_number
from .._base.report import ConvergenceWarning, CumulativeReport
from .._base.typing import OnFailure, P, PointsLike
from .._base.warnings import warn
from .._core import ConvergenceError, ValidationError
from .._curves.controlled import CumulativeCurve, CumulativeProduct, cumulative_of
from .._curves.ends import ends_of
from .._curves.fit import Points, read_given, validated
from .._curves.options import check_on_failure
from .._curves.representatives import warn_of_far_data
from .._spaces import Doubles, Euclidean, Group, Quotient, Space, factors_of, parts_of, space_named
from .archive import VERSION, Entries, Stored, entry, read_array, read_report, read_space, suffix_of
from .controlled import ControlledSpline, checked_knots, checked_points, control_array

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

"""C² cubic splines through points, and further points at their end."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from operator import attrgetter
from types import GenericAlias
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import as_array, checked_flag, refuse, whole_number
from .._base.input import times_of
from .._base.report import INTEGERS, NUMBERS, Columns, Report, combined
from .._base.time import TimeAxis, knots_of
from .._base.typing import (
    Array,
    BCType,
    CubicBCType,
    Extrapolate,
    Method,
    OnFailure,
    P,
    PointsLike,
    Progress,
    State,
    TimesLike,
)
from .._core import ValidationError
from .._curves.conditions import fit_with_conditions
from .._curves.curve import CurveArrays, longest_step
from .._curves.derivatives import Gradient, SampleTimes, sample_times
from .._curves.ends import ends_in_factors, freeze_bc_type, is_closed, split_accelerations, take_batch
from .._curves.failures import FEWEST_HELD, raise_or_warn, warn_of_held_points, warn_of_representatives
from .._curves.fit import Fit, FitProblem, Problem, curve_of, fit, mask_of, moved_ends, read, read_ends
from .._curves.missing import counts_all_samples, curves_without_missing, inner_velocities_of_present, with_remedy
from .._curves.options import fit_options, order_of, with_atol
from .._curves.search import alternative_energy
from .._curves.solve import DEFAULTS
from .._spaces import AnySpace, Doubles, Product, Quotient, Space, factors_of, parts_of, space_named
from .archive import Entries, read_c1_nodes, read_fitted
from .piecewise import PiecewiseCubic

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    # The report: that of a fit through points, or that of a smoothing fit.
    R = TypeVar("R", covariant=True, default=Report)
else:
    from typing import TypeVar

    R = TypeVar("R", covariant=True)


class CubicSpline(PiecewiseCubic[P], Generic[P, R]):
    r"""Interpolate points on a space by a C² cubic spline.

    Each segment is a cubic Bézier curve built from geodesics. At every knot the values, velocities and covariant
    accelerations of adjacent segments agree. Ends are natural by default, as in the paper; SciPy's default is
    ``"not-a-knot"``. On a Euclidean space the result equals SciPy's ``CubicSpline`` with the same `bc_type`.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,) or (..., n), or None
        Strictly increasing knots, shared by all curves or one row per curve. None means 0, 1, ..., n - 1. Rates for
        dates are per second. Dates with a time zone are converted to UTC.
    points : array_like, shape (..., n, *space.point_shape)
        Points to interpolate, at least two per curve. Leading axes are batch axes. Points within `atol` of the
        manifold are projected onto it. On complex spaces the numbers may be complex. For a `Product`, pass a tuple
        with one array per factor.
    space : Space or str
        A space or its name, such as ``Sphere(2)`` or ``"sphere:2"``.
    bc_type : {"natural", "not-a-knot", "clamped", "periodic"} or pair, default "natural"
        End conditions. Natural ends converge also for points that are far apart, where not-a-knot ends may not. Use
        ``"not-a-knot"`` for dense samples of a smooth motion; its error is of fourth order up to the ends, while
        natural ends are of second order there.

        - ``"natural"``: the covariant acceleration at both ends is zero.
        - ``"not-a-knot"``: the outer two segments at each end form one cubic, in the sense of flat space.
        - ``"clamped"``: the velocity at both ends is zero, as in SciPy.
        - ``"periodic"``: the curve is closed. The last point must equal the first.
        - A pair sets each end separately. Its entries are ``"natural"``, ``"not-a-knot"``, ``"clamped"``,
          ``(1, velocity)`` or ``(2, acceleration)``. Vectors are derivatives with respect to t, tangent at the
          corresponding end point, with the shape of a point or with batch axes in front.
        - An entry of a pair may also be ``[(1, velocity), (2, acceleration)]``, as in SciPy's
          ``make_interp_spline``. The curve then has an additional knot in the middle of the outer segment, see Notes.
    velocities : dict of int to array_like, optional
        Velocities at inner points, by the index of the point, such as ``{3: v}``. Each has the shape of a point, or
        batch axes in front. The curve is C² except at these points, where the acceleration may jump, see Notes.
    method : {"auto", "quasi-newton", "newton", "fixed-point", "homotopy"}, default "auto"
        Solver. ``"fixed-point"`` is Algorithm 1 of the paper. ``"homotopy"`` follows the solution from flat space to
        the given points. ``"auto"`` starts with quasi-Newton and uses Newton's method and the homotopy for curves that
        do not converge. If points are far apart, it also searches for solutions of lower energy; see Notes.
    tol : float, default 1e-12
        Largest relative C² residual of a converged curve, see `Report.residual`.
    max_iter : int, optional
        Largest number of iterations. By default each solver has its own limit.
    extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
        Extrapolation policy for times beyond the knots. ``"raise"`` raises `ValidationError`, and so does None,
        except for closed curves, which are repeated. True continues the first and last segments. False gives NaN.
        ``"geodesic"`` continues with constant velocity. ``"periodic"`` repeats the curve.
    on_failure : {"raise", "warn", "ignore"}, default "raise"
        Action if a curve does not converge or meets a cut locus. ``"warn"`` issues a `ConvergenceWarning`. An
        unconverged curve keeps its best iterate (the last one with ``method="fixed-point"``). A curve that meets a
        cut locus is NaN. With ``"warn"`` and ``"ignore"``, curves of a batch with invalid points are NaN as well,
        and the others are fitted.
    check : bool, default True
        Whether to validate the points and end vectors. If False, the points are not projected either.
    atol : float, optional
        Largest distance of a point from the manifold. By default, the accuracy of the points determines it: 1e-8 in
        double precision; 1e-4 for numbers that were in single precision, or have at most nine significant digits; and
        the rounding error, up to 5e-3, for numbers with a few decimal places.
    skipna : bool, default False
        True to omit missing samples, where the point or its time is NaN, NaT or masked. All curves of a batch
        must lack the same samples; see `fit_many` for others.
    where : array_like of bool, optional
        Mask over the batch. Curves where it is False are not fitted and evaluate to NaN.
    progress : callable, optional
        Function that is called from time to time with the finished and the total number of points.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    CutLocusError
        If two neighbouring points or control points are not joined by a unique shortest geodesic.
    ConvergenceError
        If the solver does not reach `tol`. Its attribute ``spline`` holds the converged curves and the best iterates
        of the others.

    Warns
    -----
    FarPointsWarning
        If a curve has at least four segments and more than half of its steps exceed 0.6 of the distance to the cut
        locus.
    ConvergenceWarning
        If a curve fails and `on_failure` is ``"warn"``.
    UserWarning
        If two neighbouring points are within 1e-5 of each other's cut locus, or if points on ``Sphere(3)`` look like
        unit quaternions with inconsistent signs. If many points are exact copies of the point before.

    See Also
    --------
    HermiteSpline : Interpolate points and given velocities.
    make_smoothing_spline : Fit a curve close to noisy points.
    fit_many : Fit curves of different lengths in one call.
    fit_segments : Fit a recording with gaps.

    Notes
    -----
    Let :math:`p_i` be the points, :math:`h_i = t_{i+1} - t_i` the lengths of the intervals and :math:`u_i` the
    velocities at the knots. Segment i is the Bézier curve (8) with the control points

    .. math:: p_i, \quad q_i^+ = \exp_{p_i}(h_i u_i / 3), \quad q_{i+1}^- = \exp_{p_{i+1}}(-h_i u_{i+1} / 3),
              \quad p_{i+1}.

    The solver determines the velocities from the C² condition (13), extended from unit intervals to arbitrary ones.
    The clamped spline of the paper is ``bc_type=((1, v0), (1, vN))``.

    A velocity and an acceleration at the same end are one condition too many for the knots t. They would determine the
    first segment and, by the C² condition, all others; errors then grow by the factor :math:`2 + \sqrt 3` from one
    segment to the next. The curve therefore has one more knot in the middle of the outer segment, and its point there
    is determined such that both conditions hold. `t` and `points` of the spline contain this knot, and `bc_type` the
    velocity. `jvp` and `vjp` treat the additional point as one of the points.

    A velocity in `velocities` replaces the C² condition at its point. The sections on both sides are then independent
    C² curves with this end velocity. `jvp` and `vjp` are not available.

    If steps exceed 0.55 of the distance to the cut locus, or 0.4 of it where quasi-Newton is slow, several C² curves
    may pass through the points. ``"auto"`` then runs all solvers and a trust-region method within a budget, and keeps
    the solution with the lowest bending energy. `Report.method` names the solver that found it.

    References
    ----------
    G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
    Anal. 56 (2018), equations (8) and (13), Algorithm 1.

    Examples
    --------
    >>> import symspline as ss
    >>> spline = ss.CubicSpline([0, 1, 3], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], ss.Sphere(2))
    >>> spline(1).round(12) + 0.0
    array([0., 1., 0.])
    >>> spline([0.5, 2.0], nu=1).shape
    (2, 3)
    """

    @counts_all_samples
    def __init__(
        self,
        t: TimesLike | None,
        points: PointsLike,
        space: Space[P] | str,
        *,
        bc_type: CubicBCType = "natural",
        velocities: Mapping[int, PointsLike] | None = None,
        method: Method = "auto",
        tol: float = 1e-12,
        max_iter: int | None = None,
        extrapolate: Extrapolate = None,
        on_failure: OnFailure = "raise",
        check: bool = True,
        atol: float | None = None,
        skipna: bool = False,
        where: ArrayLike | None = None,
        progress: Progress | None = None,
    ) -> None:
        space = cast("Space[P]", space if isinstance(space, Space) else space_named(space))
        if skipna is not False and checked_flag(skipna, "skipna"):
            velocities = inner_velocities_of_present(t, points, space, velocities)
            t, points = curves_without_missing(t, points, space)
        options = fit_options(method, tol, max_iter, extrapolate, on_failure, check, progress)
        conditions, accelerations = (bc_type, None) if isinstance(bc_type, str) else split_accelerations(bc_type)
        data = read(points, space)
        if atol is not None:
            data = with_atol(data, atol)
        batch, nodes = data[0].batch, data[0].nodes
        time_axis, shown_times, times = knots_of(t, batch, nodes)
        if space._has_quotients:
            conditions = moved_ends(conditions, space, data)
        ends = read_ends(conditions, space, batch)
        skip_invalid = bool(batch) and on_failure != "raise"
        mask = None if where is None else mask_of(where, batch)
        problem = Problem(space, times, data, ends, options, bool(check), mask, skip_invalid)
        try:
            if velocities is None and accelerations is None:
                solution = fit(problem, progress)
            else:
                solution, shown_times, self._c1_nodes = fit_with_conditions(
                    problem, time_axis, shown_times, velocities, accelerations, progress
                )
        except ValidationError as error:
            raise time_axis.explain(with_remedy(error, data, times)) from None
        self._fit = solution
        kept: Any = conditions if isinstance(conditions, str) else freeze_bc_type(conditions)
        self._set_nodes(time_axis, shown_times, solution.curve, kept, extrapolate)
        if solution.faults:
            raise_or_warn(solution.faults, on_failure, self)
        warn_of_representatives(space, [data], [solution.curve], [solution.columns])
        if nodes >= FEWEST_HELD:
            warn_of_held_points(times, list(map(attrgetter("numbers"), data)), batch)

    # Nodes with a prescribed velocity, where the acceleration may jump.
    _c1_nodes: tuple[int, ...] = ()

    @classmethod
    def _fitted(
        cls,
        time_axis: TimeAxis,
        t: Array,
        curve: CurveArrays,
        bc_type: BCType,
        extrapolate: Extrapolate,
        reports: Fit | list[Report],
        c1_nodes: tuple[int, ...] = (),
    ) -> Self:
        """Return a fitted curve; its reports are created from the fit when they are needed."""
        self = cls.__new__(cls)
        self._set_nodes(time_axis, t, curve, bc_type, extrapolate)
        if isinstance(reports, Fit):
            self._fit = reports
        else:
            self._reports = reports
        if c1_nodes:
            self._c1_nodes = c1_nodes
        return self

    if not TYPE_CHECKING:
        # The report may be omitted at run time, too, although type variables have defaults from Python 3.13 on only.
        __class_getitem__ = classmethod(GenericAlias)

    # ---- further points ----

    def append(self, t: TimesLike, points: PointsLike, *, lag: int | None = 12) -> CubicSpline[P]:
        r"""Return the spline with further points at its end.

        Use it for points that arrive one by one. Only the last segments are computed again.

        Parameters
        ----------
        t : float or datetime64, or array_like of them
            Time of one point, or times of several points. They must increase from the last knot on.
        points : array_like
            The point, with the shape of a point, or the points, shape ``(*batch axes, m, *point_shape)``. For a
            `Product`, a tuple with one array per factor.
        lag : int or None, default 12
            Number of segments before the new points that are computed again, at least 2. None computes all of them.

        Returns
        -------
        CubicSpline
            The spline through all points, with the same end conditions. This spline does not change.

        Raises
        ------
        ValidationError
            If the times or points are invalid, the curve is closed, or it has prescribed velocities at inner points.
        CutLocusError, ConvergenceError
            As for the constructor.

        See Also
        --------
        Curve.concatenate : Join two curves.

        Notes
        -----
        The velocity at the node before the last `lag` segments is held fixed. In flat space with equal steps, the
        influence of a new point decreases by the factor :math:`2 - \sqrt{3} \approx 0.27` per node. The difference to
        a new fit of all points is about :math:`0.27^{lag}` times the change of the velocity at the old end: 3e-5 for 8
        segments, 1e-7 for 12. The covariant acceleration jumps by a similar amount at that node, where
        `Report.residual` is not evaluated.

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> spline.append(3, [1.0])
        <CubicSpline on Euclidean(1): 4 points, from 0 to 3, natural>
        >>> spline.append([3, 5], [[1.0], [2.0]]).t
        array([0., 1., 2., 3., 5.])
        """
        if type(self) is not CubicSpline:
            raise ValidationError(f"points cannot be appended to a {type(self).__name__}. Fit all points again.")
        if self._c1_nodes:
            raise ValidationError(
                f"points cannot be appended to a curve with prescribed velocities at points {self._c1_nodes}. "
                "Fit all points again."
            )
        local, axis = local_fit(self, t, points, lag), self._time_axis
        try:
            part = fit(local.problem)
        except ValidationError as error:
            part_of_curve = (
                error._with_message(f"in the part from node {local.kept} on: {error}") if local.kept else error
            )
            raise axis.explain(part_of_curve) from None
        solution = joined(self, part, local) if local.kept else part
        spline: CubicSpline[P] = CubicSpline._fitted(
            axis, local.t, solution.curve, self._bc_type, self._extrapolate, solution
        )
        if part.faults:
            raise_or_warn(part.faults, "raise", spline)
        warn_of_representatives(self.space, [local.problem.points], [part.curve], [part.columns])
        return spline

    # ---- sensitivity to the data ----

    def jvp(
        self,
        x: TimesLike,
        points: ArrayLike | tuple[ArrayLike | None, ...] | None = None,
        t: TimesLike | None = None,
        ends: tuple[ArrayLike | None, ArrayLike | None] | None = None,
        *,
        nu: int = 0,
    ) -> P:
        """Compute the change of the curve for a change of its data (forward mode).

        This is the directional derivative of the curve in the direction given by `points`, `t` and `ends`. Omitted
        arguments are held fixed.

        Parameters
        ----------
        x : array_like
            Times between the first and the last knot, of any shape.
        points : array_like, optional
            Tangent vectors at the points, with their shape. The last row of a closed curve is ignored, because its
            last point is its first.
        t : array_like, optional
            Changes of the knots, with their shape; in seconds for dates.
        ends : tuple of array_like or None, optional
            Changes of the vectors prescribed by `bc_type` at the two ends. A vector whose change is None is
            transported parallel with its point.
        nu : {0, 1, 2}, default 0
            Order of the derivative in time: 0 for the point γ, 1 for the velocity γ', 2 for the covariant acceleration
            ∇γ'.

        Returns
        -------
        ndarray, shape ``(*batch axes, *x.shape, *point_shape)``
            Tangent vectors at the points of the curve. For `nu` 1 and 2 they are covariant derivatives of γ' and ∇γ'.
            Curves that did not converge give NaN, and so do those whose linear system is singular.

        Raises
        ------
        ValidationError
            If the input does not meet the requirements above, or the dimension of the space is too large.

        Warns
        -----
        ConvergenceWarning
            If the linear system of a curve that converged is singular to rounding: a tiny change of the data leads to
            another curve.

        See Also
        --------
        CubicSpline.vjp : Compute the gradient of a function of the curve (reverse mode).

        Notes
        -----
        The derivative follows from implicit differentiation of the C² condition (13). Newton's method uses the same
        Jacobian.

        References
        ----------
        G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
        Anal. 56 (2018), equation (13).

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline([0, 1, 2], [[0.0], [1.0], [0.0]], "r:1")
        >>> spline.jvp(0.5, points=[[0.0], [1.0], [0.0]])
        array([0.6875])
        """
        moved: P = self._solved().jvp(self._sample_times(x, nu), self._bc_type, points, t, ends)
        return moved

    def vjp(self, x: TimesLike, cotangent: ArrayLike, *, nu: int = 0) -> Gradient[P]:
        """Compute the gradient of a function of the curve with respect to its data.

        The function is ``sum(cotangent * spline(x, nu))``. This is reverse mode, the transpose of `jvp`.

        Parameters
        ----------
        x : array_like
            Times between the first and the last knot, of any shape.
        cotangent : array_like, shape ``(*batch axes, *x.shape, *point_shape)``
            Weights of the numbers of ``spline(x, nu)``. For complex numbers, real and imaginary parts are multiplied
            separately.
        nu : {0, 1, 2}, default 0
            Order of the derivative in time, as for `jvp`.

        Returns
        -------
        Gradient
            A gradient g such that ``sum(cotangent * spline.jvp(x, points, t, ends, nu=nu))`` equals ``sum(g.points *
            points) + sum(g.t * t)`` plus the same sums for the end vectors. Its vectors are tangent. The last point of
            a closed curve has no separate gradient. Curves that did not converge give NaN, and so do those whose linear
            system is singular.

        Raises
        ------
        ValidationError
            If the input does not meet the requirements above, or the dimension of the space is too large.

        Warns
        -----
        ConvergenceWarning
            If the linear system of a curve that converged is singular to rounding: a tiny change of the data leads to
            another curve.

        See Also
        --------
        CubicSpline.jvp : Compute the change of the curve for a change of its data (forward mode).

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline([0, 1, 2], [[0.0], [1.0], [0.0]], "r:1")
        >>> spline.vjp(0.5, [1.0]).points.round(12).tolist()
        [[0.40625], [0.6875], [-0.09375]]
        """
        gradient: Gradient[P] = self._solved().vjp(self._sample_times(x, nu), self._bc_type, cotangent)
        return gradient

    def _solved(self) -> CurveArrays:
        """Return the curve with NaN for all curves that did not converge.

        Derivatives follow from the C² condition, which only converged curves satisfy. For the others they would be
        wrong without notice.

        Raises
        ------
        ValidationError
            If the C² condition does not hold at some nodes, because velocities are prescribed there.
        """
        if self._c1_nodes:
            raise ValidationError(
                f"derivatives with respect to the data are not available for a curve with prescribed velocities at the "
                f"inner points {self._c1_nodes}. Fit the curves between these points separately, with their velocities "
                "in bc_type."
            )
        if all(np.all(report.converged) for report in self._reports):
            return self._curve
        arrays = []
        for part, report in zip(self._curve.parts, self._reports, strict=True):
            velocities = np.array(part.velocities)
            velocities[~np.asarray(report.converged)] = np.nan
            arrays.append((part.points, velocities))
        return curve_of(self.space, self._times, arrays)

    def _sample_times(self, x: TimesLike, nu: int) -> SampleTimes:
        nu, curve = order_of(nu), self._curve
        times, per_curve = self._time_axis.at(x, curve.batch, False, curve.times)
        try:
            return sample_times(curve.times, curve.batch, times, per_curve, nu)
        except ValidationError as error:
            raise self._time_axis.explain(error) from None

    # ---- data and report ----

    @property
    def bc_type(self) -> BCType:
        """End conditions, as passed to the constructor.

        At an end with a velocity and an acceleration this is the velocity alone, because the curve satisfies the
        second condition by its additional point.
        """
        return self._bc_type

    @cached_property
    def _reports(self) -> list[Report]:
        """Reports in every factor, created on demand because they cost up to a third of a fit of few points."""
        return self._fit.reports()

    @property
    def report(self) -> R:
        """Report of the fit: convergence, solver, residual and step lengths."""
        report: Any = self._reports[0] if len(self._reports) == 1 else self._product_report
        result: R = report
        return result

    @cached_property
    def _product_report(self) -> Report:
        """Report of all factors, computed on first access because it costs more than a fit of few points."""
        curve, reports = self._curve, self._reports
        other = alternative_energy(curve.parts, reports)
        return combined(reports, longest_step(curve), curve.space.curvature, other)

    @property
    def _parts(self) -> tuple[AnyCubicSpline, ...]:
        """Splines in the factors of a product; in any other space, the spline itself."""
        if len(self._reports) == 1:
            return (self,)
        factors = zip(self._curve.parts, ends_in_factors(self._bc_type, self.space), self._reports, strict=True)
        return tuple(
            CubicSpline._fitted(self._time_axis, self._t, curve, ends, self._extrapolate, [report], self._c1_nodes)
            for curve, ends, report in factors
        )

    # ---- batches ----

    def _with(self, time_axis: TimeAxis, t: Array, curve: CurveArrays, index: object) -> Any:
        ends = take_batch(self._bc_type, index, len(self._batch), self.space)
        reports = [report.map(lambda column: column[index]) for report in self._reports]
        return CubicSpline._fitted(time_axis, t, curve, ends, self._extrapolate, reports, self._c1_nodes)

    # ---- files, pickles and text ----

    def _state(self) -> State:
        entries = {"bc_type": self._bc_type, "report": [vars(report) for report in self._reports]}
        nodes = {"c1_nodes": list(self._c1_nodes)} if self._c1_nodes else {}
        return super()._state() | entries | nodes

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        nodes = read_c1_nodes(state)
        return cls._fitted(*read_fitted(state, fitted=not nodes), nodes)

    def __repr__(self) -> str:
        bc = self._bc_type if isinstance(self._bc_type, str) else "custom end conditions"
        text = f"{self._batch_text}{self._counts}{self._span_text}, {bc}{self._failed_text}"
        return f"<CubicSpline on {self.space!r}: {text}>"

    @property
    def _failed_text(self) -> str:
        """The number of curves that did not converge, for the representation."""
        failed = self._unconverged
        count = f" ({failed} of {math.prod(self._batch)})" if self._batch else ""
        return f", NOT converged{count}" if failed else ""

    # Title of plots.
    _kind = "C² spline"
    _format = "symspline-curve"

    @property
    def _ends(self) -> str:
        return f"{self._bc_type} ends" if isinstance(self._bc_type, str) else "custom end conditions"

    @property
    def _unconverged(self) -> int:
        return int(np.sum(~np.all([np.asarray(report.converged) for report in self._reports], axis=0)))


# A spline on any space, also on a product, with any report.
AnyCubicSpline = CubicSpline[Any, Any]


# ---- splines with further points at their end ----

# Adjacent rows of reports that a local fit does not determine for the whole curve, those of which the largest value
# counts, and the one of which the value of the last part counts.
_UNKNOWN = slice(NUMBERS.index("invariant_radius"), None)
_LARGEST = ("residual", "max_step")
_MAXIMA = np.array([[name != "rate"] for name in NUMBERS])
_CONVERGED = INTEGERS.index("converged")


class Local(NamedTuple):
    """The fit of the last part of a curve and of the points that follow it.

    Attributes
    ----------
    t : ndarray
        Knots of the whole curve as the user counts them.
    times : ndarray
        Knots of the whole curve as numbers of the core.
    problem : Problem
        The last part, which begins with the velocity of the curve there.
    kept : int
        Number of segments of the curve before this part.
    """

    t: Array
    times: Doubles
    problem: FitProblem
    kept: int


def local_fit(spline: Any, t: TimesLike, points: object, lag: int | None) -> Local:
    """Return the problem of a new fit, after validation of the times, the points and the lag."""
    bc_type, space, curve = spline._bc_type, spline.space, spline._curve
    if is_closed(bc_type):
        raise ValidationError("a closed curve has no end to which points can be appended")
    segments = curve.times.shape[-1] - 1
    kept = 0 if lag is None else max(segments - whole_number(lag, "lag", 2), 0)
    new_t, single = _new_times(spline, t)
    batch, parts = curve.batch, curve.parts
    data = read(_with_new(space, parts, points, batch, kept, None if single else new_t.shape[-1]), space)
    if isinstance(space, (Product, Quotient)):
        bc_type = moved_ends(bc_type, space, data)
    ends = read_ends(bc_type, space, batch)
    if kept:
        at = (slice(None),) * len(batch) + (kept,)
        starts = [np.ascontiguousarray(part.space._as_doubles(part.velocities[at])) for part in parts]
        ends = [
            conditions and [("velocity", start), conditions[1]] for conditions, start in zip(ends, starts, strict=True)
        ]
    shown = np.concatenate([spline._t, new_t], axis=-1)
    times = spline._time_axis.knots(shown)
    last, names = np.ascontiguousarray(times[..., kept:]), range(kept, times.shape[-1])
    return Local(shown, times, Problem(space, last, data, ends, DEFAULTS, names=names), kept)


def _with_new(space: AnySpace, parts: Any, points: object, batch: tuple[int, ...], kept: int, count: int | None) -> Any:
    """Return the last points of a curve and the new ones; without `count`, there is one without an axis."""
    axis = len(batch)
    tail, one = (slice(None),) * axis + (slice(kept, None),), (slice(None),) * axis + (None,)
    joined = []
    for factor, part, given in zip(factors_of(space), parts, parts_of(points, space, "points"), strict=True):
        new = factor._array(given, "points")
        shape = batch + (() if count is None else (count,)) + factor.point_shape
        if new.shape != shape:
            raise ValidationError(f"points has shape {np.shape(given)}, but {shape} is needed for these times")
        joined.append(np.concatenate([part.points[tail], new[one] if count is None else new], axis=axis))
    return tuple(joined) if isinstance(space, Product) else joined[0]


def _new_times(spline: Any, t: TimesLike) -> tuple[Array, bool]:
    """Return the times of the new points, and whether there is only one point without an axis."""
    if spline._time_axis.plain and spline._t.ndim == 1 and type(t) in (float, int, np.float64):
        # Points that arrive one by one are the usual case.
        time = np.array([t], np.float64)
        if np.isfinite(time[0]) and time[0] > spline._t[-1]:
            return time, True
    # Conversion validates the kind of the times and their time zone.
    later, _ = spline._time_axis.at(t, spline._batch, spline._t.ndim > 1, name="t")
    array = as_array(times_of(t, "t")[0], "t")
    # Durations are shown as seconds.
    array = later if array.dtype.kind == "m" else array
    single = array.ndim == spline._t.ndim - 1
    if (
        array.ndim not in (spline._t.ndim - 1, spline._t.ndim)
        or array.shape[: spline._t.ndim - 1] != spline._t.shape[:-1]
    ):
        raise ValidationError(f"t has shape {array.shape}, but must be one time or the times (m,), as the knots are")
    array, later = (x[..., None] if single else x for x in (array, later))
    known = np.broadcast_to(spline._curve.times[..., -1:], (*later.shape[:-1], 1))
    rises = np.isfinite(later) & (np.diff(np.concatenate([known, later], axis=-1)) > 0)
    last = f"the last knot {spline.domain[1]}" if spline._t.ndim == 1 else "the last knot of its curve"
    advice = f"times must be finite and increase from {last} on. Sort the points, or remove those that the curve has."
    refuse(~(rises[..., 0] if single else rises), "t", lambda i: f"is {array[(*i, 0) if single else i]}, but {advice}")
    return array, single


def joined(spline: Any, solution: Fit, local: Local) -> Fit:
    """Return the first segments of a curve, followed by another curve, with the report of both."""
    curve, kept = spline._curve, local.kept
    axis = len(curve.batch)
    head = (slice(None),) * axis + (slice(kept),)
    arrays = [
        (
            np.concatenate([a.points[head], b.points], axis=axis),
            np.concatenate([a.velocities[head], b.velocities], axis=axis),
        )
        for a, b in zip(curve.parts, solution.curve.parts, strict=True)
    ]
    columns = [_joined_columns(a, b) for a, b in zip(columns_of(spline), solution.columns, strict=True)]
    return Fit(curve_of(spline.space, local.times, arrays), columns, solution.method, solution.faults)


def _joined_columns(first: Columns, second: Columns) -> Columns:
    """Return the report of a curve whose last part was fitted again, in the arrays of that fit."""
    np.fmax(first.numbers, second.numbers, out=second.numbers, where=_MAXIMA)
    second.numbers[_UNKNOWN] = np.nan
    second.integers[_CONVERGED] &= first.integers[_CONVERGED]
    return second


def columns_of(spline: Any) -> list[Columns]:
    """Return the reports of a spline in each factor as tables, also of one that was loaded."""
    if "_fit" in vars(spline):
        columns: list[Columns] = spline._fit.columns
        return columns
    columns_of_factors = []
    for report in spline._reports:
        of_factor = Columns.empty(np.size(report.converged))
        of_factor.row("converged")[:] = np.ravel(report.converged)
        for name in _LARGEST:
            value = getattr(report, name)
            of_factor.row(name)[:] = np.nan if value is None else np.ravel(value)
        columns_of_factors.append(of_factor)
    return columns_of_factors

"""C² cubic splines."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from . import _archive
from ._base_curve import Curve
from ._core import ValidationError
from ._curves.curve import CurveArrays
from ._curves.derivatives import places
from ._curves.ends import ends_in_factors, freeze_bc_type, picked
from ._curves.energy import alternative_energy
from ._curves.fit import FitProblem, curve_of, fit, mask_of, read, read_ends
from ._curves.gradient import Gradient, Places
from ._curves.product import longest_step
from ._curves.solve import Progress
from ._errors import raise_or_warn
from ._far import warn_of_far_points
from ._options import check_fit_options, options_of, order_of, outside, with_atol
from ._report import Report, combined
from ._signs import warn_of_signs
from ._spaces import Array, Space
from ._spaces import space as space_named
from ._time import TimeAxis, knots_of
from ._typing import BCType, Extrapolate, File, Method, OnFailure, P, PointsLike


class CubicSpline(Curve[P]):
    """The C² cubic spline through points of a space.

    Between two points the curve is a cubic Bézier curve made of geodesics (de Casteljau's algorithm,
    (8) of the paper); at the points value, velocity and covariant acceleration agree from both sides,
    (13). In flat space it is SciPy's ``CubicSpline``.

    Args:
        t: times of the points, increasing: None for 0, 1, …, N, shape (N+1,), or (..., N+1) with one
            row per curve. Numbers, ``datetime64`` or other dates; for dates rates are per second. Those with a
            time zone become UTC.
        points: shape (..., N+1, *space.point_shape), N >= 1, real, or complex on complex spaces; leading axes
            are independent curves. Points within 1e-8 of the space (1e-4 for single precision) are projected.
            For a `Product` a tuple of arrays.
        space: a space or its name, such as ``Sphere(2)`` or ``"sphere:2"``.
        bc_type: conditions at the ends: ``"natural"`` (zero covariant acceleration, the paper's default),
            ``"not-a-knot"`` (the better choice for a smooth curve: order 4 instead of 2 near the ends),
            ``"clamped"`` (zero velocity, as in SciPy), ``"periodic"`` (the last point is the first), or a
            pair with one of ``"natural"``, ``"clamped"``, ``"not-a-knot"``, ``(1, velocity)``,
            ``(2, acceleration)`` for either end. The paper's clamped spline is ``((1, v0), (1, vN))``.
            Vectors are derivatives in t, shape (*point_shape) or with the batch axes.
        method: ``"quasi-newton"``, ``"newton"``, ``"fixed-point"`` (the paper's Algorithm 1, literally), ``"homotopy"``
            (the curve that is continued from near points), or ``"auto"``: quasi-Newton, then Newton's method and the
            homotopy for curves that did not converge. Points far apart (steps beyond 0.55 of the way to the cut locus,
            or beyond 0.4 where quasi-Newton is slow) may have several C² curves. Then ``"auto"`` also runs Algorithm 1,
            all other solvers and a trust region within a budget, and keeps the solution with the lowest bending energy.
            `Report.method` names the solver that found it.
        tol: largest relative C² defect that counts as converged, see `Report.residual`.
        max_iter: largest number of iterations; None for the method's own.
        extrapolate: what happens outside the knots: None raises (and wraps for periodic curves), True
            continues the last segment, ``"geodesic"`` goes on with constant velocity, ``"periodic"`` wraps.
        on_failure: what happens when a curve does not converge or meets a cut locus: ``"raise"``,
            ``"warn"`` or ``"ignore"``. The exception's ``.spline`` holds all good curves; an unconverged
            curve keeps its best iterate (with ``method="fixed-point"`` its last one), a curve with a cut-locus fault
            is NaN. With ``"warn"`` and ``"ignore"``, a curve of a batch with an invalid point (NaN, not positive
            definite, off the space) is NaN, too, and the others are fitted.
        where: True for the curves of a batch that are wanted, shape of the batch axes: the others are NaN, whatever
            their points are, and no work is done for them.
        check: whether to validate the input.
        atol: how far off the space points may be, for numbers that were rounded in a file, such as 1e-5 for unit
            quaternions of six decimals; None for what ``points`` says.
        progress: called from time to time with the finished and the total number of points.

    Raises:
        ValidationError: the input is not what is described above.
        CutLocusError: the geodesic between two neighbours, or to a control point, is not unique.
        ConvergenceError: the solver did not reach ``tol``.

    Warns:
        UserWarning: neighbours are within 1e-5 of each other's cut locus: a little more, and the curve would go the
            other way round. Or points of ``sphere:3`` look like quaternions of which some have the wrong sign.
        FarPointsWarning: more than half of the steps of a curve with four or more are beyond 0.6 of the way to the cut
            locus.

    >>> import symspline as ss
    >>> spline = ss.CubicSpline([0, 1, 3], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], ss.Sphere(2))
    >>> spline(1).round(12) + 0.0
    array([0., 1., 0.])
    >>> spline([0.5, 2.0], nu=1).shape
    (2, 3)
    """

    def __init__(
        self,
        t: ArrayLike | None,
        points: PointsLike,
        space: Space[P] | str,
        *,
        bc_type: BCType = "natural",
        method: Method = "auto",
        tol: float = 1e-12,
        max_iter: int | None = None,
        extrapolate: Extrapolate = None,
        on_failure: OnFailure = "raise",
        check: bool = True,
        atol: float | None = None,
        where: ArrayLike | None = None,
        progress: Progress | None = None,
    ) -> None:
        space = space_named(space)
        check_fit_options(extrapolate, on_failure, check, progress)
        options = options_of(method, tol, max_iter)
        data = read(points, space)
        if atol is not None:
            data = with_atol(data, atol)
        batch, nodes = data[0].batch, data[0].nodes
        clock, shown_times, times = knots_of(t, batch, nodes)
        ends = read_ends(bc_type, space, batch)
        skip_invalid = bool(batch) and on_failure != "raise"
        problem = FitProblem(
            space, times, data, ends, options, bool(check), mask_of(where, batch), skip_invalid
        )
        try:
            curve, reports, faults = fit(problem, progress)
        except ValidationError as error:
            raise clock.explain(error) from None
        self._fill(clock, shown_times, curve, freeze_bc_type(bc_type), extrapolate, reports)
        if faults:
            raise_or_warn(faults, on_failure, self)
        warn_of_signs(space, [data], [report.max_step for report in reports])
        warn_of_far_points([curve], [reports])

    def _fill(
        self,
        clock: TimeAxis,
        t: Array,
        curve: CurveArrays,
        bc_type: BCType,
        extrapolate: Extrapolate,
        reports: list[Report],
    ) -> None:
        self._clock, self._t, self._curve = clock, t, curve
        self._bc_type, self._extrapolate, self._reports = bc_type, extrapolate, reports
        self._outside = outside(extrapolate, bc_type)

    @classmethod
    def _of(cls, *parts: Any) -> Self:
        """A spline that was fitted before, from all that it keeps."""
        self = cls.__new__(cls)
        self._fill(*parts)
        return self

    # ---- how it follows its data ----

    def jvp(
        self,
        x: ArrayLike,
        points: ArrayLike | tuple[ArrayLike | None, ...] | None = None,
        t: ArrayLike | None = None,
        ends: tuple[ArrayLike | None, ArrayLike | None] | None = None,
        *,
        nu: int = 0,
    ) -> P:
        """How the curve at times x moves when its data move: the derivative in one direction.

        The data move by small multiples of what is given here; what is not given stays. It is computed by
        implicit differentiation of the C² condition, whose Jacobian Newton's method uses, too.

        Args:
            x: times between the first and the last knot, any shape.
            points: tangent vectors at the points, of their shape. Of a closed curve the last point goes with the
                first, and its row is not read.
            t: changes of the knots, of their shape; in seconds for dates.
            ends: changes of the vectors that were given at the two ends; None for no change. What is not changed
                goes with its point in parallel.
            nu: 0 for the point γ, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.

        Returns:
            Tangent vectors at the points of the curve, shape batch axes + x.shape + point_shape. With ``nu`` 1 or 2
            covariant derivatives: how γ' or ∇γ' change seen from the moving point. NaN for curves that have not
            converged.

        Raises:
            ValidationError: the input is not what is described above, or the space has very many dimensions.

        >>> import numpy as np
        >>> import symspline as ss
        >>> spline = ss.CubicSpline([0, 1, 2], [[0.0], [1.0], [0.0]], "r:1")
        >>> spline.jvp(0.5, points=[[0.0], [1.0], [0.0]])
        array([0.6875])
        """
        moved: P = self._solved().push(self._places(x, nu), self._bc_type, points, t, ends)
        return moved

    def vjp(self, x: ArrayLike, cotangent: ArrayLike, *, nu: int = 0) -> Gradient[P]:
        """The gradient of ``sum(cotangent * curve)`` with respect to the data: `jvp`, transposed.

        Args:
            x: times between the first and the last knot, any shape.
            cotangent: any array of the shape of ``spline(x)``. Of complex numbers the sum is of the products of real
                and of imaginary parts.
            nu: as for `jvp`.

        Returns:
            A `Gradient` g such that ``sum(cotangent * spline.jvp(x, points, t, ends, nu=nu))`` is
            ``sum(g.points * points) + sum(g.t * t)`` and the same for the vectors at the ends: plain sums of products.
            Vectors in it are tangent. Of a closed curve the last point has no gradient of its own. NaN for curves that
            have not converged.

        Raises:
            ValidationError: the input is not what is described above, or the space has very many dimensions.

        >>> import symspline as ss
        >>> spline = ss.CubicSpline([0, 1, 2], [[0.0], [1.0], [0.0]], "r:1")
        >>> spline.vjp(0.5, [1.0]).points.round(12).tolist()
        [[0.40625], [0.6875], [-0.09375]]
        """
        gradient: Gradient[P] = self._solved().pull(self._places(x, nu), self._bc_type, cotangent)
        return gradient

    def _solved(self) -> CurveArrays:
        """The curve from which derivatives are made: NaN where it did not converge. They follow from the C² condition,
        which only curves that converged fulfil; without it they would be wrong in silence."""
        if all(np.all(report.converged) for report in self._reports):
            return self._curve
        found = []
        for part, report in zip(self._curve.parts, self._reports, strict=True):
            velocities = np.array(part.velocities)
            velocities[~np.asarray(report.converged)] = np.nan
            found.append((part.points, velocities))
        return curve_of(self.space, self._times, found)

    def _places(self, x: ArrayLike, nu: int) -> Places:
        nu, curve = order_of(nu), self._curve
        times, per_curve = self._clock.at(x, curve.batch, False, curve.times)
        try:
            return places(curve.times, curve.batch, times, per_curve, nu)
        except ValidationError as error:
            raise self._clock.explain(error) from None

    # ---- what it is made of ----

    @property
    def bc_type(self) -> BCType:
        """The end conditions, as they were given."""
        return self._bc_type

    @property
    def report(self) -> Report:
        """How the fit went."""
        if len(self._reports) == 1:
            return self._reports[0]
        return self._product_report

    @cached_property
    def _product_report(self) -> Report:
        """The report of all factors, made when it is asked for: it costs more than a fit of few points."""
        curve, reports = self._curve, self._reports
        other = alternative_energy(curve, reports, self._outside)
        return combined(reports, longest_step(curve), curve.space.curvature, other)

    @property
    def _parts(self) -> tuple[CubicSpline[Any], ...]:
        """The splines in the factors of a product; in another space the spline is its only part."""
        if len(self._reports) == 1:
            return (self,)
        each = zip(self._curve.parts, ends_in_factors(self._bc_type, self.space), self._reports, strict=True)
        return tuple(
            CubicSpline._of(self._clock, self._t, curve, ends, self._extrapolate, [report])
            for curve, ends, report in each
        )

    # ---- a batch as a sequence ----

    def _with(self, clock: TimeAxis, t: Array, curve: CurveArrays, index: Any) -> Any:
        return CubicSpline._of(
            clock,
            t,
            curve,
            picked(self._bc_type, index, len(self._batch), self.space),
            self._extrapolate,
            [report.map(lambda column: column[index]) for report in self._reports],
        )

    # ---- as a value ----

    def __reduce__(self) -> tuple[Any, ...]:
        return CubicSpline._of, (
            self._clock,
            self._t,
            self._curve,
            self._bc_type,
            self._extrapolate,
            self._reports,
        )

    def __repr__(self) -> str:
        knots = self._times.shape[-1]
        curves = f"{' x '.join(map(str, self._batch))} curves, " if self._batch else ""
        bc = self._bc_type if isinstance(self._bc_type, str) else "own end conditions"
        return f"<CubicSpline on {self.space!r}: {curves}{knots} points, {bc}>"

    def save(self, file: File) -> None:
        """Write the curve to an NPZ file, which `symspline.load` reads back without a new fit."""
        _archive.write(file, self._arrays())

    def _arrays(self) -> dict[str, Any]:
        """What stands in a file."""
        return _archive.fitted_arrays(self, self._reports)

    # What a plot says of it.
    _kind = "C² spline"

    @property
    def _ends(self) -> str:
        return f"{self._bc_type} ends" if isinstance(self._bc_type, str) else "own end conditions"

    @property
    def _unconverged(self) -> int:
        return int(np.size(self.report.converged) - np.sum(self.report.converged))

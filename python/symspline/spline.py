"""C² cubic splines."""

from __future__ import annotations

import math
from base64 import b64encode
from collections.abc import Callable, Iterator
from html import escape
from importlib.util import find_spec
from io import BytesIO
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import archive
from ._core import ValidationError
from .arrays import in_single, is_single, read_only, shown
from .curves.chosen import fit_chosen, invalid, mask_of
from .curves.curve import Curve, Doubles, quantity_of
from .curves.derivatives import Gradient, Places, places
from .curves.ends import ends_in_factors, kept, picked
from .curves.fit import curve_of, fit, read, read_ends
from .curves.integrals import integrate
from .curves.solve import Fault, Progress
from .curves.together import longest_step
from .failures import fail
from .options import check_on_failure, check_progress, checked_policy, options_of, outside, within
from .report import Report, combined
from .signs import warn_of_signs
from .spaces import Array, Product, Space, parts_of
from .spaces import space as space_named
from .times import Clock, knots_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Per inch, in notebooks.
_DOTS = 60


class CubicSpline:
    """The C² cubic spline through points of a space.

    Between two points the curve is a cubic Bézier curve made of geodesics (de Casteljau's algorithm,
    (8) of the paper); at the points value, velocity and covariant acceleration agree from both sides,
    (13). In flat space it is SciPy's ``CubicSpline``.

    Args:
        t: times of the points, increasing: None for 0, 1, …, N, shape (N+1,), or (..., N+1) with one
            row per curve. Numbers or ``datetime64``; for dates rates are per second.
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
        method: ``"quasi-newton"``, ``"newton"``, ``"fixed-point"`` (the paper's Algorithm 1), or ``"auto"``:
            quasi-Newton, for curves that it leaves Newton's method, and then a homotopy from flat space.
            `Report.method` says which was used.
        tol: largest relative C² defect that counts as converged, see `Report.residual`.
        max_iter: largest number of iterations; None for the method's own.
        extrapolate: what happens outside the knots: None raises (and wraps for periodic curves), True
            continues the last segment, ``"geodesic"`` goes on with constant velocity, ``"periodic"`` wraps.
        on_failure: what happens when a curve does not converge or meets a cut locus: ``"raise"``,
            ``"warn"`` or ``"ignore"``. The exception's ``.spline`` holds all good curves; an unconverged
            curve keeps its best iterate, a curve with a cut-locus fault is NaN. With the last two a curve of a batch
            with an invalid point (NaN, not positive definite, off the space) is NaN, too, and the others are fitted.
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
        points: Any,
        space: Space | str,
        *,
        bc_type: Any = "natural",
        method: str = "auto",
        tol: float = 1e-12,
        max_iter: int | None = None,
        extrapolate: bool | str | None = None,
        on_failure: str = "raise",
        check: bool = True,
        atol: float | None = None,
        where: ArrayLike | None = None,
        progress: Progress | None = None,
    ) -> None:
        space = space_named(space)
        policy = checked_policy(extrapolate)
        check_on_failure(on_failure)
        options = options_of(method, tol, max_iter)
        check_progress(progress)
        data = within(read(points, space), atol)
        batch, nodes = data[0].batch, data[0].nodes
        clock, shown_times, times = knots_of(t, batch, nodes)
        ends = read_ends(bc_type, space, batch)
        mask = None if where is None else mask_of(where, batch)
        bad: list[Fault] = []
        if batch and check and on_failure != "raise":
            wanted = np.arange(math.prod(batch)) if mask is None else np.flatnonzero(mask)
            bad = invalid(space, data, wanted)
            if bad:
                mask = np.ones(batch, bool) if mask is None else mask.copy()
                mask.flat[[number for number, *_ in bad]] = False
        try:
            if mask is None or mask.all():
                curve, reports, faults = fit(space, times, data, ends, options, check, progress)
            else:
                chosen = np.flatnonzero(mask)
                curve, reports, faults = fit_chosen(
                    space, times, data, ends, options, check, progress, chosen
                )
        except ValidationError as error:
            raise clock.explain(error) from None
        self._fill(clock, shown_times, curve, kept(bc_type), policy, reports)
        if bad or faults:
            fail(sorted(bad + faults), on_failure, self)
        warn_of_signs(space, [data])

    def _fill(
        self,
        clock: Clock,
        t: Array,
        curve: Curve,
        bc_type: Any,
        extrapolate: Any,
        reports: list[Report],
    ) -> None:
        self._clock, self._t, self._curve = clock, t, curve
        self._bc_type, self._extrapolate, self._reports = bc_type, extrapolate, reports
        self._outside = outside(extrapolate, bc_type)
        self._report = (
            reports[0] if len(reports) == 1 else combined(reports, longest_step(curve), curve.space.curvature)
        )

    @classmethod
    def _of(cls, *parts: Any) -> Self:
        """A spline that was fitted before, from all that it keeps."""
        self = cls.__new__(cls)
        self._fill(*parts)
        return self

    # ---- the curve ----

    def __call__(
        self,
        x: ArrayLike,
        nu: int = 0,
        *,
        extrapolate: bool | str | None = None,
        per_curve: bool = False,
        dtype: Any = None,
        progress: Progress | None = None,
    ) -> Any:
        """The curve at times x.

        Args:
            x: times, any shape and order; ``datetime64`` if the knots are.
            nu: 0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.
            extrapolate: as for the constructor, whose choice holds if None.
            per_curve: whether the leading axes of x are the batch axes: every curve has its own times.
            dtype: ``"float32"`` for results in single precision, of complex points in complex64; they are computed in
                double precision.
            progress: called from time to time with the finished and the total number of points to compute.

        Returns:
            Shape batch axes + x.shape + point_shape (x.shape without its batch axes if ``per_curve``).

        Raises:
            ValidationError: a time is not finite, or outside the knots and ``extrapolate`` is None.
        """
        if progress is not None:
            check_progress(progress)
        single = dtype is not None and is_single(dtype)
        values = self._at(x, quantity_of(nu), extrapolate, per_curve, progress)
        return in_single(values) if single else values

    def lift(
        self,
        x: ArrayLike,
        start: Any = None,
        nu: int = 0,
        *,
        extrapolate: bool | str | None = None,
        per_curve: bool = False,
        progress: Progress | None = None,
    ) -> Any:
        """The curve at times x by arrays that move continuously: the horizontal lift.

        A point of a projective space or a Grassmannian is an array up to a unitary factor on its right, a phase, a
        sign or a change of the basis. A call picks one by itself, which jumps at knots. The horizontal lift X is
        continuous, and turns no more than its subspace does: X*X' = 0. It depends neither on the representatives of
        the data nor on the other times that are asked for. Where points have one array only it is the curve itself.

        Args:
            x: times, any shape and order, as in a call.
            start: a representative of the first point, at which the lift starts, shape point_shape or batch axes +
                point_shape; None for the first point as it was given. For a product a tuple with one or None for
                every factor.
            nu: 0 for representatives, 1 for the velocity γ', 2 for the covariant acceleration ∇γ' there. With ``nu=1``
                these are the derivatives of the arrays.
            extrapolate, per_curve, progress: as in a call. A closed curve may come back as another representative,
                by its *holonomy* (on CP¹ the phase of half the enclosed area, Berry's phase); beyond the knots the
                lift goes on with that.

        Returns:
            Shape batch axes + x.shape + point_shape.

        Raises:
            ValidationError: as in a call, and where ``start`` does not represent the first point.

        >>> import numpy as np
        >>> import symspline as ss
        >>> spline = ss.CubicSpline(None, [[1, 0], [0.6, 0.8], [-0.28, -0.96]], "rp:1")
        >>> spline.lift(2.0).round(12)  # the data have the other sign
        array([0.28, 0.96])
        """
        if progress is not None:
            check_progress(progress)
        quantity, where = quantity_of(nu), self._where(extrapolate)
        return timed(
            self._curve,
            self._clock,
            x,
            per_curve,
            lambda curve, x, per_curve: curve.lift(x, quantity, where, per_curve, start, progress),
        )

    def transport(self, x0: Any, x1: Any, v: Any) -> Any:
        """Parallel transport of tangent vectors along the curve, (26a) of the paper.

        Args:
            x0, x1: from when to when, two times between the first and the last knot, in any order. A closed curve is
                gone round as often as times beyond its knots say.
            v: a tangent vector at ``spline(x0)``, shape point_shape, or one for every curve, batch axes + point_shape;
                for a product a tuple.

        Returns:
            Tangent vectors at ``spline(x1)``, shape batch axes + point_shape. On quotient spaces vectors belong to the
            representatives that the two calls give.

        Raises:
            ValidationError: a time is outside the knots, or v is not tangent at ``spline(x0)``.

        >>> import symspline as ss
        >>> quarter = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], ss.Sphere(2))
        >>> quarter.transport(0, 1, [0.0, 1.0, 2.0]).round(12) + 0.0  # a vector ahead, and one across
        array([-1.,  0.,  2.])
        """
        times, _ = self._clock.at(np.asarray([x0, x1]), self._batch, False)
        where = "periodic" if self._outside == "periodic" else "raise"
        # Times outside the knots are refused here.
        at = evaluated(self._curve, self._clock, np.asarray([x0, x1]), "point", where, False, None)
        vectors = []
        for points, part, one in zip(
            parts_of(at, self.space, "points"), self._curve.parts, parts_of(v, self.space, "v"), strict=True
        ):
            first = np.take(points, 0, axis=len(self._batch))
            part.space.check_tangent(first, one)
            vectors.append(np.broadcast_to(np.asarray(one), first.shape))
        moved = tuple(vectors) if isinstance(self.space, Product) else vectors[0]
        return self._curve.transport((float(times[0]), float(times[1])), where, moved)

    def speed(self, x: ArrayLike, *, extrapolate: bool | str | None = None, per_curve: bool = False) -> Any:
        """|γ'| at times x, shape batch axes + x.shape."""
        return self._at(x, "speed", extrapolate, per_curve)[()]

    def _at(
        self, x: ArrayLike, quantity: str, extrapolate: Any, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        return evaluated(self._curve, self._clock, x, quantity, self._where(extrapolate), per_curve, progress)

    def _where(self, extrapolate: Any) -> str:
        """What happens outside the knots, as the core calls it."""
        return self._outside if extrapolate is None else outside(checked_policy(extrapolate), self._bc_type)

    def length(self) -> Any:
        """Length of the curve from first to last knot, ∫ |γ'| dt; shape of the batch axes."""
        curve = self._curve
        return integrate(curve.times, lambda x: curve.evaluate(x, "speed", self._outside, True), curve.batch)

    def bending_energy(self) -> Any:
        """∫ |∇γ'|² dt, the energy (1) that Riemannian cubics minimise; shape of the batch axes."""
        # In units of the whole time: squares of accelerations would overflow or vanish where times are far from one.
        times = self._times
        unit = np.broadcast_to(times[..., -1:] - times[..., :1], (*self._batch, 1))

        def power(x: NDArray[np.float64]) -> Array:
            bend: Array = self._curve.evaluate(x, "bend", self._outside, True) * unit * unit
            return bend * bend / unit

        with np.errstate(all="ignore"):
            return integrate(times, power, self._batch) / unit[..., 0] / unit[..., 0] / unit[..., 0]

    # ---- how it follows its data ----

    def jvp(
        self,
        x: ArrayLike,
        points: Any = None,
        t: ArrayLike | None = None,
        ends: tuple[Any, Any] | None = None,
        nu: int = 0,
    ) -> Any:
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
        return self._solved().push(self._places(x, nu), self._bc_type, points, t, ends)

    def vjp(self, x: ArrayLike, cotangent: Any, nu: int = 0) -> Gradient:
        """The gradient of ``sum(cotangent * curve)`` with respect to the data: `jvp`, transposed.

        Args:
            x: times between the first and the last knot, any shape.
            cotangent: any array of the shape of ``spline(x)``. Of complex numbers the sum is of the products of real
                and of imaginary parts.
            nu: as for `jvp`.

        Returns:
            A `Gradient` g such that ``sum(cotangent * spline.jvp(x, points, t, ends, nu))`` is
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
        return self._solved().pull(self._places(x, nu), self._bc_type, cotangent)

    def _solved(self) -> Curve:
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
        curve = self._curve
        times, per_curve = self._clock.at(x, curve.batch, False)
        try:
            return places(curve.times, curve.batch, times, per_curve, nu)
        except ValidationError as error:
            raise self._clock.explain(error) from None

    # ---- what it is made of ----

    @property
    def t(self) -> Array:
        """The knots, shape (N+1,) or (..., N+1); numbers or ``datetime64`` as they were given."""
        return read_only(self._t)

    @property
    def points(self) -> Any:
        """The points, shape (..., N+1, *point_shape)."""
        return self._curve.points

    @property
    def velocities(self) -> Any:
        """Velocities γ' at the knots, the shape of the points. Together with knots and points they are
        the whole curve."""
        return self._curve.velocities

    @property
    def control_points(self) -> Any:
        """Control points of the Bézier segments, shape (..., N, 4, *point_shape)."""
        return self._curve.control_points()

    @property
    def space(self) -> Space:
        """The space."""
        return self._curve.space

    @property
    def bc_type(self) -> Any:
        """The end conditions, as they were given."""
        return self._bc_type

    @property
    def extrapolate(self) -> Any:
        """What happens outside the knots, as it was given."""
        return self._extrapolate

    @property
    def report(self) -> Report:
        """How the fit went."""
        return self._report

    @property
    def _batch(self) -> tuple[int, ...]:
        return self._curve.batch

    @property
    def _times(self) -> NDArray[np.float64]:
        """The knots as the core counts them."""
        return self._curve.times

    @property
    def _parts(self) -> tuple[CubicSpline, ...]:
        """The splines in the factors of a product; in another space the spline is its only part."""
        if len(self._reports) == 1:
            return (self,)
        each = zip(self._curve.parts, ends_in_factors(self._bc_type, self.space), self._reports, strict=True)
        return tuple(
            CubicSpline._of(self._clock, self._t, curve, ends, self._extrapolate, [report])
            for curve, ends, report in each
        )

    # ---- a batch as a sequence ----

    def __len__(self) -> int:
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves has a length (see also .length())")
        return self._batch[0]

    def __getitem__(self, index: Any) -> CubicSpline:
        """A curve, or a slice of curves, of a batch."""
        axes = len(self._batch)
        if not axes:
            raise TypeError("this is one curve; only a batch of curves can be indexed")
        if not isinstance(index, (int, np.integer, slice)):
            raise TypeError(f"a curve is picked by a whole number or a slice, not {shown(index)}")
        return CubicSpline._of(
            self._clock.picked(index),
            self._t[index] if self._times.ndim > 1 else self._t,
            self._curve.picked(index),
            picked(self._bc_type, index, axes, self.space),
            self._extrapolate,
            [report.map(lambda column: column[index]) for report in self._reports],
        )

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator[CubicSpline]:
        return (self[i] for i in range(len(self)))

    # ---- as a value ----

    def __eq__(self, other: object) -> bool:
        """Equal space, knots, points and velocities, to the last bit."""
        if not isinstance(other, CubicSpline):
            return NotImplemented
        return (
            self.space == other.space
            and self._t.dtype == other._t.dtype
            and np.array_equal(self._t, other._t)
            and all(
                np.array_equal(a.points, b.points, equal_nan=True)
                and np.array_equal(a.velocities, b.velocities, equal_nan=True)
                for a, b in zip(self._curve.parts, other._curve.parts, strict=True)
            )
        )

    __hash__ = None  # type: ignore[assignment]

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

    def _repr_html_(self) -> str:
        """What notebooks show: a small picture, where matplotlib is there to draw it."""
        text = f"<pre>{escape(repr(self))}</pre>"
        if find_spec("matplotlib") is None:
            return text
        picture = BytesIO()
        try:
            self.plot().savefig(picture, format="png", dpi=_DOTS)
        except ValidationError:
            # There is nothing to plot of curves that failed.
            return text
        data = b64encode(picture.getvalue()).decode()
        return f'{text}<img src="data:image/png;base64,{data}" alt="{escape(repr(self))}">'

    def save(self, file: Any) -> None:
        """Write the curve to an NPZ file, which `symspline.load` reads back without a new fit."""
        archive.write(file, archive.arrays_of(self))

    # What a plot says of it.
    _kind = "C² spline"

    @property
    def _ends(self) -> str:
        return f"{self._bc_type} ends" if isinstance(self._bc_type, str) else "own end conditions"

    @property
    def _unconverged(self) -> int:
        return int(np.size(self._report.converged) - np.sum(self._report.converged))

    def plot(self, file: Any = None) -> Figure:
        """A figure with a picture of the curve, and speed |γ'| and |∇γ'| against time.

        The picture depends on the space:

        - S²: a globe and a map; H²: the Poincaré disk; R¹, R² and R³: the graph or the curve.
        - SO(3), O(3), SU(2) and S³ (unit quaternions, scalar first): rotated frames along the time axis.
        - S¹, SO(2), O(2), U(1), RP¹ and Gr(1, 2): the angle against time, without jumps.
        - SE(3): frames on the path of the positions; SE(2): arrow heads on it.
        - CP¹ and the complex Gr(1, 2): the Bloch sphere.
        - RP², Gr(1, 3) and Gr(2, 3): a half sphere, with the normals of planes; a curve that leaves it
          through the rim comes back on the opposite side.
        - Other projective spaces and Grassmannians: the principal angles to the first point.
        - SPD(2) and SPD(3): ellipses and ellipsoids along the time axis.
        - Otherwise the components against time, imaginary parts dashed.

        For a product the pictures of its factors. Of a batch at most 50 curves are drawn. Neither pyplot nor
        any setting of matplotlib is touched.

        Args:
            file: where to save the figure, if anywhere: a name such as ``"curve.pdf"``, or an open file.

        Returns:
            The figure, to change or to save.

        Raises:
            ImportError: matplotlib is not installed.
        """
        if find_spec("matplotlib") is None:
            raise ImportError("plots need matplotlib; install it with: pip install 'symspline[plot]'")
        from .plotting import plot

        return plot(self, file)


def evaluated(
    curve: Curve,
    clock: Clock,
    x: ArrayLike,
    quantity: str,
    outside: str,
    per_curve: bool,
    progress: Progress | None,
) -> Any:
    """A quantity at times as the user gives them."""
    return timed(
        curve,
        clock,
        x,
        per_curve,
        lambda curve, x, per_curve: curve.evaluate(x, quantity, outside, per_curve, progress),
    )


def timed(
    curve: Curve, clock: Clock, x: ArrayLike, per_curve: bool, call: Callable[[Curve, Doubles, bool], Any]
) -> Any:
    """What a curve has at times as the user gives them."""
    if clock.plain and type(x) is float:
        # A single time is worth a short way.
        times = np.array(x)
    else:
        times, per_curve = clock.at(x, curve.batch, per_curve)
    try:
        return call(curve, times, per_curve)
    except ValidationError as error:
        raise clock.explain(error) from None

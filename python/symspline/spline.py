"""C² cubic splines."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import as_array, shown, whole_number
from ._core import ConvergenceError, CutLocusError, ValidationError
from ._ends import ends_of, kept, picked
from ._integrals import integrate
from ._span import Span, fit_in_span, is_large, lifted, span_of
from ._times import Clock, clock_of
from .report import ConvergenceWarning, Report, shaped
from .spaces import Space, point_tol
from .spaces import space as space_named

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ._derivatives import Gradient

_PACKAGE = os.path.dirname(__file__)

Array = NDArray[Any]
Progress = Callable[[int, int], object]

_OUTSIDE = {None: "raise", True: "continue", "geodesic": "geodesic", "periodic": "periodic"}
_NORMS = ("speed", "bend")
_QUANTITIES = {0: "point", 1: "velocity", 2: "acceleration"}
_FAULTS: dict[str, type[Exception]] = {"cut-locus": CutLocusError, "unconverged": ConvergenceError}


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
            curve keeps its best iterate, a curve with a cut-locus fault is NaN.
        check: whether to validate the input.
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

    _space: Space
    _clock: Clock
    _t: Array
    _times: NDArray[np.float64]
    _points: NDArray[np.float64]
    _velocities: NDArray[np.float64]
    _bc_type: Any
    _extrapolate: Any
    _report: Report
    _faults: list[tuple[int, str, str]]
    _small: tuple[Span, Array, Array] | None = None

    def __new__(cls, t: Any = None, points: Any = None, space: Any = None, **options: Any) -> Self:
        if cls is CubicSpline and space is not None and not isinstance(space, Space):
            space = space_named(space)
        if cls is CubicSpline and hasattr(space, "factors"):
            from .product import ProductSpline

            return object.__new__(ProductSpline)  # type: ignore[return-value]
        return object.__new__(cls)

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
        progress: Progress | None = None,
    ) -> None:
        self._space = space = space_named(space)
        self._extrapolate = _policy(extrapolate)
        _check_options(on_failure, progress)
        self._fill(t, points, bc_type, method, tol, max_iter, check, progress)
        if self._faults:
            _fail(self._faults, on_failure, self)

    def _fill(
        self,
        t: ArrayLike | None,
        points: Any,
        bc_type: Any,
        method: str,
        tol: float,
        max_iter: int | None,
        check: bool,
        progress: Progress | None,
        dry: bool = False,
    ) -> None:
        """Validate, and solve unless ``dry``."""
        space = self._space
        doubles, point_tol = _points(points, space)
        axes = doubles.ndim - len(space.point_shape) - 1
        batch, nodes = doubles.shape[:axes], doubles.shape[axes]
        self._clock, self._t, self._times = _knots(t, batch, nodes)
        ends = ends_of(bc_type, space, batch)
        self._bc_type = kept(bc_type)
        if max_iter is not None:
            max_iter = whole_number(max_iter, "max_iter", 1)
        options = (method, tol, max_iter)
        try:
            large = is_large(space)
            points, velocities, columns, self._faults = _core.fit(
                space._handle,
                self._times,
                doubles,
                ends,
                *options,
                check,
                point_tol,
                None,
                progress,
                dry or large,
            )
        except ValidationError as error:
            raise self._clock.explain(error) from None
        self._points, self._velocities = space._numbers(points), space._numbers(velocities)
        if large and not dry:
            self._velocities, columns, self._faults = fit_in_span(
                space, self._times, self._points, ends, options, progress
            )
        self._points.flags.writeable = self._velocities.flags.writeable = False
        if not dry:
            self._report = shaped(columns, batch, space.curvature, method)

    @classmethod
    def _made(
        cls,
        space: Space,
        clock: Clock,
        t: Array,
        times: NDArray[np.float64],
        points: NDArray[np.float64],
        velocities: NDArray[np.float64],
        bc_type: Any,
        extrapolate: Any,
        report: Report,
    ) -> CubicSpline:
        """A spline from its parts, without a fit."""
        self = object.__new__(CubicSpline)
        self._space, self._clock, self._t, self._times = space, clock, t, times
        self._points, self._velocities = points, velocities
        self._points.flags.writeable = self._velocities.flags.writeable = False
        self._bc_type, self._extrapolate, self._report = bc_type, extrapolate, report
        return self

    @classmethod
    def _with_velocities(
        cls, t: ArrayLike | None, points: Any, velocities: Array, space: Space, bc_type: Any, check: bool
    ) -> CubicSpline:
        """A spline whose velocities are known: validated, but not fitted."""
        self = object.__new__(CubicSpline)
        self._space, self._extrapolate = space, None
        self._fill(t, points, bc_type, "auto", 0.0, None, check, None, dry=True)
        self._velocities = velocities
        return self

    # ---- the curve ----

    def __call__(
        self,
        x: ArrayLike,
        nu: int = 0,
        *,
        extrapolate: bool | str | None = None,
        per_curve: bool = False,
    ) -> Any:
        """The curve at times x.

        Args:
            x: times, any shape and order; ``datetime64`` if the knots are.
            nu: 0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.
            extrapolate: as for the constructor, whose choice holds if None.
            per_curve: whether the leading axes of x are the batch axes: every curve has its own times.

        Returns:
            Shape batch axes + x.shape + point_shape (x.shape without its batch axes if ``per_curve``).

        Raises:
            ValidationError: a time is not finite, or outside the knots and ``extrapolate`` is None.
        """
        try:
            quantity = _QUANTITIES[nu]
        except (KeyError, TypeError):
            raise ValidationError(f"nu must be 0, 1 or 2, not {shown(nu)}") from None
        return self._at(x, quantity, extrapolate, per_curve)

    def speed(self, x: ArrayLike, *, extrapolate: bool | str | None = None, per_curve: bool = False) -> Any:
        """|γ'| at times x, shape batch axes + x.shape."""
        return self._at(x, "speed", extrapolate, per_curve)[()]

    def length(self) -> Any:
        """Length of the curve from first to last knot, ∫ |γ'| dt; shape of the batch axes."""
        return integrate(self._times, lambda x: self._evaluate(x, "speed", None, True), self._batch)

    def bending_energy(self) -> Any:
        """∫ |∇γ'|² dt, the energy (1) that Riemannian cubics minimise; shape of the batch axes."""
        # In units of the whole time: squares of accelerations would overflow or vanish where times are far from one.
        unit = np.broadcast_to(self._times[..., -1:] - self._times[..., :1], (*self._batch, 1))

        def power(x: NDArray[np.float64]) -> Array:
            bend: Array = self._evaluate(x, "bend", None, True) * unit * unit
            return bend * bend / unit

        with np.errstate(all="ignore"):
            return integrate(self._times, power, self._batch) / unit[..., 0] / unit[..., 0] / unit[..., 0]

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
        from ._derivatives import push

        return push(self, x, points, t, ends, nu)

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
        from ._derivatives import pull

        return pull(self, x, cotangent, nu)

    def _at(self, x: ArrayLike, quantity: str, extrapolate: Any, per_curve: bool) -> Any:
        """A quantity at times as the user gives them."""
        if self._clock.plain and type(x) is float:
            # A single time is worth a short way.
            times = np.array(x)
        else:
            times, per_curve = self._clock.at(x, self._batch, per_curve)
        try:
            return self._evaluate(times, quantity, extrapolate, per_curve)
        except ValidationError as error:
            raise self._clock.explain(error) from None

    def _evaluate(
        self, x: NDArray[np.float64], quantity: str, extrapolate: bool | str | None, per_curve: bool
    ) -> Array:
        policy = self._extrapolate if extrapolate is None else _policy(extrapolate)
        if policy is None and type(self._bc_type) is str and self._bc_type == "periodic":
            policy = "periodic"
        if per_curve and x.shape[: len(self._batch)] != self._batch:
            raise ValidationError(
                f"with per_curve=True the shape of x must begin with the batch axes {self._batch}; got {x.shape}"
            )
        space, points, velocities, span = self._space, self._points, self._velocities, None
        if is_large(space):
            span, points, velocities = self._in_span()
            space = span.space
        values = _core.evaluate(
            space._handle,
            self._times,
            points.view(np.float64),
            velocities.view(np.float64),
            x,
            quantity,
            _OUTSIDE[policy],
            per_curve,
        )
        if quantity in _NORMS:
            return values
        return space._numbers(values) if span is None else lifted(span, space._numbers(values), self._batch)

    def _in_span(self) -> tuple[Span, Array, Array]:
        """The span, and points and velocities in it; kept from the first use on."""
        if self._small is None:
            # Velocities of a spline lie in the span of its points and end velocities.
            at_ends = np.take(self._velocities, [0, -1], axis=len(self._batch))
            self._small = self._down(span_of(self._space, self._points, at_ends))
        return self._small

    def _down(self, span: Span) -> tuple[Span, Array, Array]:
        return span, span.down(self._points), span.down(self._velocities)

    # ---- what it is made of ----

    @property
    def t(self) -> Array:
        """The knots, shape (N+1,) or (..., N+1); numbers or ``datetime64`` as they were given."""
        return _read_only(self._t)

    @property
    def points(self) -> Any:
        """The points, shape (..., N+1, *point_shape)."""
        return self._points

    @property
    def velocities(self) -> Any:
        """Velocities γ' at the knots, the shape of the points. Together with knots and points they are
        the whole curve."""
        return self._velocities

    @property
    def control_points(self) -> Any:
        """Control points of the Bézier segments, shape (..., N, 4, *point_shape)."""
        axis = len(self._batch)
        h = np.diff(self._times)
        third = h.reshape(h.shape + (1,) * len(self._space.point_shape)) / 3
        first, last = (slice(None, -1), slice(1, None))
        index = (slice(None),) * axis
        p, q = self._points[(*index, first)], self._points[(*index, last)]
        u, w = self._velocities[(*index, first)], self._velocities[(*index, last)]
        with np.errstate(all="ignore"):
            legs = third * u, -third * w
        # Of curves that were not found they are NaN.
        inner = [self._space._apply("exp", p=at, v=leg) for at, leg in zip((p, q), legs, strict=True)]
        return np.stack([p, *inner, q], axis=axis + 1)

    @property
    def space(self) -> Space:
        """The space."""
        return self._space

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
        return self._points.shape[: self._points.ndim - len(self._space.point_shape) - 1]

    # ---- a batch as a sequence ----

    def __len__(self) -> int:
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves has a length (see also .length())")
        return self._batch[0]

    def __getitem__(self, index: Any) -> CubicSpline:
        """A curve, or a slice of curves, of a batch."""
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves can be indexed")
        if not isinstance(index, (int, np.integer, slice)):
            raise TypeError(f"a curve is picked by a whole number or a slice, not {shown(index)}")
        own = self._times.ndim > 1
        return CubicSpline._made(
            self._space,
            Clock(self._clock.origin[index][()], self._clock.dates)
            if np.ndim(self._clock.origin)
            else self._clock,
            self._t[index] if own else self._t,
            np.ascontiguousarray(self._times[index]) if own else self._times,
            np.ascontiguousarray(self._points[index]),
            np.ascontiguousarray(self._velocities[index]),
            picked(self._bc_type, index, len(self._batch), self._space),
            self._extrapolate,
            self._report._map(lambda column: column[index]),
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
            self._space == other._space
            and self._t.dtype == other._t.dtype
            and np.array_equal(self._t, other._t)
            and np.array_equal(self._points, other._points, equal_nan=True)
            and np.array_equal(self._velocities, other._velocities, equal_nan=True)
        )

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return CubicSpline._made, (
            self._space,
            self._clock,
            self._t,
            self._times,
            self._points,
            self._velocities,
            self._bc_type,
            self._extrapolate,
            self._report,
        )

    def __repr__(self) -> str:
        knots = self._times.shape[-1]
        curves = f"{' x '.join(map(str, self._batch))} curves, " if self._batch else ""
        bc = self._bc_type if isinstance(self._bc_type, str) else "own end conditions"
        return f"<CubicSpline on {self._space!r}: {curves}{knots} points, {bc}>"

    def save(self, file: Any) -> None:
        """Write the curve to an NPZ file, which `symspline.load` reads back without a new fit."""
        from .files import save

        save(self, file)

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


def fit(t: ArrayLike | None, points: Any, space: Space | str, **options: Any) -> tuple[Any, Report]:
    """The velocities of the C² spline through points, as plain arrays.

    Takes the arguments of `CubicSpline`.

    Returns:
        The velocities, of the shape of the points, and the report.

    >>> import symspline as ss
    >>> u, report = ss.fit(None, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "sphere:2")
    >>> u.shape, report.converged
    ((3, 3), True)
    """
    spline = CubicSpline(t, points, space, **options)
    return spline.velocities, spline.report


def evaluate(
    x: ArrayLike,
    t: ArrayLike | None,
    points: Any,
    u: Any,
    space: Space | str,
    nu: int = 0,
    *,
    extrapolate: bool | str | None = None,
    per_curve: bool = False,
) -> Any:
    """The curve with given knots, points and velocities at times x, as plain arrays.

    Args:
        x: times, any shape and order.
        t: knots, as for `CubicSpline`.
        points, u: points and velocities, shape (..., N+1, *point_shape).
        space: the space or its name.
        nu, extrapolate, per_curve: as for calling a `CubicSpline`.

    >>> import symspline as ss
    >>> p = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> u, _ = ss.fit(None, p, "sphere:2")
    >>> ss.evaluate(0.5, None, p, u, "sphere:2").round(8)
    array([ 0.61308303,  0.76368565, -0.20227067])
    """
    space = space_named(space)
    if hasattr(space, "factors"):
        from .product import check_tuple

        check_tuple(points, space, "points")
        check_tuple(u, space, "u")
        pieces = zip(points, u, space.factors, strict=True)
        options = {"extrapolate": extrapolate, "per_curve": per_curve}
        return tuple(evaluate(x, t, p, v, factor, nu, **options) for p, v, factor in pieces)  # type: ignore[arg-type]
    velocities, shape = space._numbers(space._doubles(u, "u")), as_array(points, "points").shape
    if velocities.shape != shape:
        raise ValidationError(f"u has shape {velocities.shape}, but points {shape}")
    if not np.isfinite(velocities).all():
        index = np.argwhere(~np.isfinite(velocities))[0].tolist()
        raise ValidationError(f"u{index} is not finite")
    spline = CubicSpline._with_velocities(t, points, velocities, space, "natural", check=True)
    if is_large(space):
        # Any velocities, unlike those of a spline.
        spline._small = spline._down(span_of(space, spline._points, velocities))
    return spline(x, nu, extrapolate=extrapolate, per_curve=per_curve)


def fit_many(
    curves: Iterable[tuple[ArrayLike | None, Any]], space: Space | str, **options: Any
) -> list[CubicSpline]:
    """Fit curves of different lengths in one parallel call.

    Args:
        curves: pairs (t, points), one a curve; see `CubicSpline`.
        space: the space of all curves, or its name.
        options: the options of `CubicSpline`, for all curves alike.

    Returns:
        One `CubicSpline` a curve. If curves fail and ``on_failure="raise"``, the exception's ``.spline``
        is this list.

    >>> import symspline as ss
    >>> square = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    >>> [len(s.t) for s in ss.fit_many([(None, square), ([0, 2], square[:2])], "sphere:2")]
    [4, 2]
    """
    from ._many import fit_many as run

    return run(list(curves), space_named(space), **options)


def _points(points: Any, space: Space) -> tuple[NDArray[np.float64], float]:
    """Points as doubles, and how far off the space they may be."""
    array = as_array(points, "points")
    if array.ndim == 0 or array.size == 0:
        raise ValidationError("no points given; a curve needs at least two")
    doubles = space._doubles(array, "points")
    axes = doubles.ndim - len(space.point_shape)
    if axes == 0:
        raise ValidationError(
            f"points has shape {array.shape}, which is one point; a curve needs shape (..., N+1, *point_shape)"
        )
    if doubles.shape[axes - 1] < 2:
        raise ValidationError("a curve needs at least two points; got one")
    return doubles, point_tol(array.dtype)


def _knots(
    t: ArrayLike | None, batch: tuple[int, ...], nodes: int
) -> tuple[Clock, Array, NDArray[np.float64]]:
    """The clock, the knots as shown and as the core counts them."""
    if t is None:
        knots = np.arange(nodes, dtype=np.float64)
        return Clock(), knots, knots
    clock, shown = clock_of(t)
    if shown.shape != (nodes,) and shown.shape != (*batch, nodes):
        own = f" or {(*batch, nodes)}" if batch else ""
        raise ValidationError(f"t has shape {shown.shape}, but {nodes} points a curve need {(nodes,)}{own}")
    return clock, shown, clock.knots(shown)


def _policy(extrapolate: Any) -> Any:
    known = isinstance(extrapolate, str) and extrapolate in _OUTSIDE
    if extrapolate is not None and extrapolate is not True and not known:
        raise ValidationError(
            f"extrapolate must be None, True, 'geodesic' or 'periodic', not {shown(extrapolate)}"
        )
    return extrapolate


def _check_options(on_failure: Any, progress: Any) -> None:
    if not isinstance(on_failure, str) or on_failure not in ("raise", "warn", "ignore"):
        raise ValidationError(f"on_failure must be 'raise', 'warn' or 'ignore', not {shown(on_failure)}")
    if progress is not None and not callable(progress):
        raise ValidationError(f"progress must be a function of two numbers, not {shown(progress)}")


def _fail(faults: list[tuple[int, str, str]], on_failure: str, spline: Any) -> None:
    """Raise or warn, with the good curves attached."""
    if on_failure == "ignore":
        return
    _, kind, message = faults[0]
    if len(faults) > 1:
        message += f" (and {len(faults) - 1} more curves failed)"
    if on_failure == "warn":
        warnings.warn(message, ConvergenceWarning, stacklevel=_callers_level())
        return
    error: Any = _FAULTS[kind](message)
    error.spline = spline
    raise error


def _callers_level() -> int:
    """How many frames up the code is that called this package."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    return level


def _read_only(array: Array) -> Array:
    view = array.view()
    view.flags.writeable = False
    return view

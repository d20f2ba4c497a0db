"""The base class of curves made of Bézier segments between knots."""

from __future__ import annotations

from abc import abstractmethod
from base64 import b64encode
from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from html import escape
from importlib.util import find_spec
from io import BytesIO
from typing import TYPE_CHECKING, Any, ClassVar, Self, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from . import _archive
from ._arrays import as_array, checked_flag, checked_number, in_single, is_single, read_only, refuse, short_repr
from ._core import ValidationError
from ._curve import Curve
from ._curves.curve import CurveArrays, SidePanel, UncertaintyBand, write_into
from ._curves.fit import curve_of
from ._curves.jerk import jerk
from ._input import times_of
from ._options import (
    EvaluationOptions,
    check_progress,
    checked_extrapolate,
    extrapolation_mode,
    quantity_of,
    require_matplotlib,
)
from ._spaces import Array, Doubles, Product, Space, parts_of
from ._time import TimeAxis, onto_ends
from ._typing import AnyArray, AnyArrays, BCType, Extrapolate, File, FloatArray, Out, P, Progress, Time, TimesLike

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LARGEST = float(np.finfo(np.float64).max)
# Resolution of pictures in notebooks, in dots per inch.
_DOTS = 60


class SegmentedCurve(Curve[P]):
    """Base class of curves of cubic Bézier segments, which are given by knots, points and velocities."""

    # Title of plots.
    _kind: ClassVar[str]

    @property
    @abstractmethod
    def _ends(self) -> str:
        """End conditions, as the title of a plot names them."""

    @property
    def _made_of(self) -> str:
        """Description of the data, for the title of a plot."""
        return f"{self._t.shape[-1]} points{' each' if self._batch else ''}, {self._ends}"

    def _noise_beside(self, index: tuple[int, ...], x: Doubles) -> UncertaintyBand | None:
        """Return the noisy data of one curve of a batch, with uncertainty bands at times x of the core.

        Curves that pass through their points have none and return None.
        """
        return None

    def _panels_below(self, x: Doubles) -> list[SidePanel]:
        """Return the bands at times x of the core, and the residuals of measurements that are not points, for plots."""
        return []

    @property
    @abstractmethod
    def _unconverged(self) -> int:
        """Number of curves that failed."""

    _time_axis: TimeAxis
    _t: Array
    _curve: CurveArrays
    _extrapolate: Extrapolate
    # Extrapolation policy, by its name in the core.
    _extrapolation_mode: str
    # End conditions, which determine whether curves are closed.
    _bc_type: BCType

    def _fill(
        self, time_axis: TimeAxis, t: Array, curve: CurveArrays, bc_type: BCType, extrapolate: Extrapolate
    ) -> None:
        self._time_axis, self._t, self._curve = time_axis, t, curve
        self._bc_type, self._extrapolate = bc_type, extrapolate
        self._extrapolation_mode = extrapolation_mode(extrapolate, bc_type)

    @abstractmethod
    def _with(self, time_axis: TimeAxis, t: Array, curve: CurveArrays, index: Any) -> Self:
        """Return the curves that an index selects from the batch."""

    # ---- the curve ----

    @overload
    def __call__(
        self, x: TimesLike, nu: int = 0, *, dtype: None = None, out: None = None, **options: Unpack[EvaluationOptions]
    ) -> P: ...
    @overload
    def __call__(self, x: TimesLike, nu: int = 0, *, out: Out, **options: Unpack[EvaluationOptions]) -> Out: ...
    @overload
    def __call__(
        self: Curve[AnyArrays], x: TimesLike, nu: int = 0, *, dtype: DTypeLike, **options: Unpack[EvaluationOptions]
    ) -> AnyArrays: ...
    @overload
    def __call__(
        self: Curve[AnyArray], x: TimesLike, nu: int = 0, *, dtype: DTypeLike, **options: Unpack[EvaluationOptions]
    ) -> AnyArray: ...
    def __call__(
        self,
        x: TimesLike,
        nu: int = 0,
        *,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        dtype: DTypeLike | None = None,
        progress: Progress | None = None,
        out: AnyArray | AnyArrays | None = None,
    ) -> Any:
        """Evaluate the curve or its derivatives.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape and in any order. If the knots are dates, times must be dates as well. If the knots had
            a time zone, pass times with any time zone, or ``datetime64`` in UTC; otherwise pass times without one.
        nu : {0, 1, 2, 3}, default 0
            Order of the derivative: 0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ', 3 for
            the covariant jerk ∇∇γ'. The jerk jumps at knots, where it is that of the segment after the knot.
        extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
            Extrapolation policy for this call. None means the policy of the curve.
        per_curve : bool, default False
            True if every curve of a batch has its own times. The leading axes of x are then the batch axes.
        dtype : {"float32", "float64"}, optional
            Precision of the result; ``"float32"`` gives complex64 on complex spaces. The computation is always in
            double precision.
        progress : callable, optional
            Function that is called from time to time with the finished and the total number of points.
        out : ndarray or tuple of ndarray, optional
            Array into which the result is written, and which is returned. For a `Product`, a tuple with one array per
            factor. An array that is not contiguous, or not of the type of the space, requires an additional copy.

        Returns
        -------
        ndarray or tuple of ndarray
            Points or tangent vectors, shape ``(*batch axes, *x.shape, *point_shape)``. With `per_curve`, the batch
            axes appear only once. For a `Product`, a tuple with one array per factor.

        Raises
        ------
        ValidationError
            If a time is not finite, if a time lies outside the knots and the policy does not allow it, if `out` cannot
            hold the result, or if both `out` and `dtype` are given.
        CutLocusError
            If `nu` is 3 and half a segment leads past the cut locus of one of its points.

        Notes
        -----
        The jerk is computed by differentiation of a polynomial that interpolates the acceleration on half a segment.
        Let a be the largest size of the acceleration on a segment and h the length of its interval. Errors are about
        1e-12 of a/h, and up to 1e-8 of it if the step between two points exceeds half of the distance to the cut locus.
        A `Manifold` must have a function `transport`, and errors are larger there, because accelerations are
        differences. The jerk takes about 100 times the time of the acceleration.
        """
        if progress is not None:
            check_progress(progress)
        single = dtype is not None and is_single(dtype)
        if out is not None and dtype is not None:
            raise ValidationError("dtype and out are both given. Pass one of them; the result has the type of out.")
        quantity, where = quantity_of(nu, 3), self._where(extrapolate)
        values = evaluated(self._curve, self._time_axis, x, quantity, where, per_curve, progress, out)
        return in_single(values) if single else values

    def lift(
        self,
        x: TimesLike,
        start: ArrayLike | tuple[ArrayLike | None, ...] | None = None,
        *,
        nu: int = 0,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        progress: Progress | None = None,
    ) -> P:
        """Evaluate the horizontal lift of the curve, a continuous choice of representatives.

        On projective spaces and Grassmannians, several arrays represent one point: they differ by a sign, a phase or a
        change of basis. Calling the curve returns representatives that may jump at knots. The lift returns
        representatives that move continuously. On all other spaces the lift is the curve itself.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape and in any order, as in a call of the curve.
        start : array_like, optional
            Representative of the first point at which the lift starts, with the shape of a point or with batch axes in
            front. By default, the first point as it was given. For a `Product`, a tuple with one array or None per
            factor.
        nu : {0, 1, 2}, default 0
            Order of the derivative: 0 for representatives, 1 for the velocity γ', 2 for the covariant acceleration
            ∇γ'. Velocities are the derivatives of the representatives.
        extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
            Extrapolation policy for this call. None means the policy of the curve.
        per_curve : bool, default False
            True if every curve of a batch has its own times.
        progress : callable, optional
            Function that is called from time to time with the finished and the total number of points.

        Returns
        -------
        ndarray or tuple of ndarray
            Representatives or tangent vectors, shape ``(*batch axes, *x.shape, *point_shape)``.

        Raises
        ------
        ValidationError
            If `x` is invalid, as in a call of the curve, or if `start` does not represent the first point.

        Notes
        -----
        The lift X of a curve of subspaces satisfies :math:`X^* X' = 0`: the basis turns no more than its subspace. It
        depends neither on the representatives of the data nor on the other times in `x`.

        A closed curve may return to its first point with another representative. The difference is its holonomy; on
        CP¹ it is the phase of half the enclosed area (Berry's phase). With ``extrapolate="periodic"`` the lift
        continues from that representative.

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline(None, [[1, 0], [0.6, 0.8], [-0.28, -0.96]], "rp:1")
        >>> spline.lift(2.0).round(12)  # the data have the other sign
        array([0.28, 0.96])
        """
        if progress is not None:
            check_progress(progress)
        quantity, where = quantity_of(nu), self._where(extrapolate)

        def call(x: Doubles, outside: str, per_curve: bool) -> Any:
            return self._curve.lift(x, quantity, outside, per_curve, start, progress)

        values: P = call_at_times(self._curve, self._time_axis, x, per_curve, where, call)
        return values

    def transport(self, x0: TimesLike, x1: TimesLike, v: ArrayLike) -> P:
        r"""Transport tangent vectors in parallel along the curve.

        Parameters
        ----------
        x0, x1 : float or datetime64
            Start and end of the transport, in any order. Both must lie between the first and the last knot, unless the
            curve is periodic; the transport then follows the curve around as often as the times require.
        v : array_like, shape point_shape or ``(*batch axes, *point_shape)``
            Tangent vectors at ``spline(x0)``. For a `Product`, a tuple with one array per factor.

        Returns
        -------
        ndarray or tuple of ndarray, shape ``(*batch axes, *point_shape)``
            Tangent vectors at ``spline(x1)``. On quotient spaces, vectors refer to the representatives that
            ``spline(x0)`` and ``spline(x1)`` return.

        Raises
        ------
        ValidationError
            If a time lies outside the knots, or if v is not tangent at ``spline(x0)``.

        See Also
        --------
        Space.transport : Transport a tangent vector along a geodesic.

        Notes
        -----
        The transported vector V satisfies :math:`\nabla_{\gamma'} V = 0` for the invariant connection (26a).

        References
        ----------
        G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
        Anal. 56 (2018), equation (26a).

        Examples
        --------
        A vector with a component along the curve and one across it:

        >>> import symspline as ss
        >>> quarter = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], ss.Sphere(2))
        >>> quarter.transport(0, 1, [0.0, 1.0, 2.0]).round(12) + 0.0
        array([-1.,  0.,  2.])
        """
        ends = [as_array(times_of(x, name)[0], name) for name, x in (("x0", x0), ("x1", x1))]
        if any(end.ndim for end in ends):
            raise ValidationError("x0 and x1 must be single times, the start and the end of the transport")
        pair = times_of([x0, x1], "x")[0] if any(end.dtype.kind in "MmU" for end in ends) else np.asarray(ends)
        times, own = self._time_axis.at(pair, self._batch, False, self._times)
        where = "periodic" if self._extrapolation_mode == "periodic" else "raise"
        try:
            at = evaluated(self._curve, self._time_axis, pair, "point", where, False)
        except ValidationError as error:
            what = str(error).partition("; pass extrapolate")[0]
            raise ValidationError(
                f"{what}; vectors are transported between the first and the last knot only, and x is (x0, x1)"
            ) from None
        vectors = []
        for points, part, one in zip(
            parts_of(at, self.space, "points"), self._curve.parts, parts_of(v, self.space, "v"), strict=True
        ):
            first = np.take(points, 0, axis=len(self._batch))
            # Curves that failed are NaN, and their vectors are not checked.
            good = part.space._where_finite(first)
            given = part.space._array(one, "v")
            part.space._doubles(given, "v")
            try:
                given = np.broadcast_to(given, first.shape)
            except ValueError:
                raise ValidationError(f"v has shape {given.shape}, which does not broadcast to {first.shape}") from None
            part.space.check_tangent(first[good], given[good])
            vectors.append(given)
        if own:
            # Curves that count time from their own first knots are processed one by one.
            product = isinstance(self.space, Product)
            each: list[Any] = [
                self[i].transport(x0, x1, tuple(v[i] for v in vectors) if product else vectors[0][i])
                for i in range(len(self))
            ]
            stacked: Any = tuple(map(np.stack, zip(*each, strict=True))) if product else np.stack(each)
            result: P = stacked
            return result
        moved = tuple(vectors) if isinstance(self.space, Product) else vectors[0]
        result = self._curve.transport((float(times[0]), float(times[1])), where, moved)
        return result

    def speed(
        self, x: TimesLike, *, extrapolate: Extrapolate = None, per_curve: bool = False, dtype: DTypeLike | None = None
    ) -> FloatArray:
        """Compute the speed of the curve.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape and in any order, as in a call of the curve.
        extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
            Extrapolation policy for this call. None means the policy of the curve.
        per_curve : bool, default False
            True if every curve of a batch has its own times.
        dtype : {"float32", "float64"}, optional
            Precision of the result.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *x.shape)``
            The norm of the velocity γ'.

        Raises
        ------
        ValidationError
            If `x` is invalid, as in a call of the curve.

        Examples
        --------
        >>> import symspline as ss
        >>> line = ss.CubicSpline([0, 2], [[0.0], [3.0]], "r:1")
        >>> line.speed([0.5, 1.0])
        array([1.5, 1.5])
        """
        single = dtype is not None and is_single(dtype)
        values = evaluated(self._curve, self._time_axis, x, "speed", self._where(extrapolate), per_curve)
        speeds: FloatArray = (in_single(values) if single else values)[()]
        return speeds

    def _where(self, extrapolate: Any) -> str:
        """Return the core's name of the extrapolation policy."""
        return (
            self._extrapolation_mode
            if extrapolate is None
            else extrapolation_mode(checked_extrapolate(extrapolate), self._bc_type)
        )

    def _core_times(self, x: Any, name: str, per_curve: bool = False) -> tuple[Doubles, bool]:
        batch, knots = self._batch, self._times
        if per_curve and np.shape(x)[: len(batch)] != batch:
            raise ValidationError(
                f"with per_curve=True the shape of {name} must begin with the batch axes {batch}; got {np.shape(x)}"
            )
        times, own = self._time_axis.at(x, batch, per_curve, knots, name)
        if knots.ndim > 1 and not own:
            times, own = np.broadcast_to(times, batch + times.shape), True
        samples = (1,) * (times.ndim - len(batch) if own else 0)
        first, last = (
            end.reshape(end.shape + samples) if knots.ndim > 1 else end for end in (knots[..., 0], knots[..., -1])
        )

        def say(i: Any) -> str:
            ends = [np.broadcast_to(end, times.shape)[i] for end in (first, last)]
            where = f"outside the knots [{ends[0]}, {ends[1]}]" if np.isfinite(times[i]) else "not finite"
            return f"= {times[i]} is {where}"

        try:
            refuse(~((times >= first) & (times <= last)), name, say)
        except ValidationError as error:
            raise self._time_axis.explain(error) from None
        return times, own

    def _shown_times(self, x: Doubles) -> NDArray[Any]:
        return self._time_axis.shown(x, self._batch)

    # ---- data ----

    @property
    def t(self) -> Array:
        """Knots as numbers or ``datetime64``, shape (n,) or (..., n); dates with a time zone are in UTC."""
        return read_only(self._t)

    @property
    def points(self) -> P:
        """Points at the knots, shape (..., n, *point_shape)."""
        points: P = self._curve.points
        return points

    @property
    def velocities(self) -> P:
        """Velocities γ' at the knots, with the shape of the points.

        Knots, points and velocities determine the curve.
        """
        velocities: P = self._curve.velocities
        return velocities

    @property
    def control_points(self) -> P:
        """Control points of the Bézier segments, shape (..., n - 1, 4, *point_shape)."""
        control_points: P = self._curve.control_points()
        return control_points

    @property
    def space(self) -> Space[P]:
        """Space of the curve."""
        return self._curve.space

    @property
    def extrapolate(self) -> Extrapolate:
        """Extrapolation policy, as passed to the constructor."""
        return self._extrapolate

    @property
    def _times(self) -> NDArray[np.float64]:
        """Knots as the core counts them."""
        return self._curve.times

    @property
    def domain(self) -> tuple[Time, Time]:
        return self._t[..., 0][()], self._t[..., -1][()]

    def _picked(self, index: Any) -> Self:
        t = self._t[index] if self._times.ndim > 1 else self._t
        return self._with(self._time_axis.take_batch(index), t, self._curve.take_batch(index), index)

    def _state(self) -> dict[str, Any]:
        return _archive.segments_state(
            self._format, self.space, self._t, self._time_axis, self._extrapolate, self._curve
        )

    # ---- parts and copies in other times ----

    def restrict(self, a: TimesLike | None = None, b: TimesLike | None = None) -> SegmentedCurve[P]:
        """Return the part of the curve between two knots.

        Parameters
        ----------
        a, b : float or datetime64, optional
            First and last knot of the part. By default, the first and the last knot of the curve.

        Returns
        -------
        HermiteSpline
            A curve with the same segments between the two knots. It raises beyond them, as `extrapolate` is None.

        Raises
        ------
        ValidationError
            If a time is not a knot of every curve of the batch, or b is not after a.

        Notes
        -----
        The part is exact, and its covariant acceleration is continuous where that of the curve is. On a curved space
        part of a segment is in general not a cubic Bézier curve, so that curves are cut at knots only.

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline(None, [[0.0], [1.0], [0.0], [2.0]], "r:1")
        >>> part = spline.restrict(1, 3)
        >>> part.t, bool(part(1.5) == spline(1.5))
        (array([1., 2., 3.]), True)
        """
        knots = self._times
        first, last = (
            end if x is None else self._knot(x, name) for x, name, end in ((a, "a", 0), (b, "b", knots.shape[-1] - 1))
        )
        if not first < last:
            raise ValidationError("b must be a later knot than a. Exchange a and b, or omit one of them.")
        kept = slice(first, last + 1)
        return self._in_times(self._t[..., kept], kept, 1, None)

    def reverse(self) -> SegmentedCurve[P]:
        """Return the curve in the opposite direction, over the same domain.

        Returns
        -------
        HermiteSpline
            A curve whose point at time x is that of this curve at time ``t[0] + t[-1] - x``.

        Notes
        -----
        The result is exact, and its covariant acceleration is continuous where that of the curve is.

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline([0, 1, 4], [[0.0], [1.0], [0.0]], "r:1")
        >>> spline.reverse().t
        array([0., 3., 4.])
        """
        t, last = self._t, self._t[..., -1:]
        mirrored = (t[..., :1] + (last - t))[..., ::-1].copy()
        # The sum can differ from the last knot by rounding.
        mirrored[..., -1] = last[..., 0]
        return self._in_times(mirrored, slice(None, None, -1), -1, self._policy)

    def shift(self, dt: float | timedelta | np.timedelta64) -> SegmentedCurve[P]:
        """Return the curve at times that are later by a constant.

        Parameters
        ----------
        dt : float or timedelta64
            Time by which the knots move. A ``timedelta`` or ``timedelta64`` if the knots are dates, otherwise a
            number. Negative values move the curve to earlier times.

        Returns
        -------
        HermiteSpline
            A curve whose point at time ``x + dt`` is that of this curve at time x.

        Raises
        ------
        ValidationError
            If `dt` is invalid, or so large that knots coincide after rounding.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.CubicSpline([0, 1, 4], [[0.0], [1.0], [0.0]], "r:1").shift(10).t
        array([10., 11., 14.])
        """
        if self._time_axis.dates:
            if not isinstance(dt, (timedelta, np.timedelta64)) or np.isnat(np.timedelta64(dt)):
                raise ValidationError(f"the knots are dates, so dt must be a timedelta64, not {short_repr(dt)}")
            return self._in_times(self._t + np.timedelta64(dt), slice(None), 1, self._policy)
        # Comparison is exact for integers of any size.
        step = checked_number(dt, "the knots are numbers, so dt must be a finite number", lambda x: abs(x) <= _LARGEST)
        exact = isinstance(dt, (int, np.integer)) and abs(int(dt)) < 2**62
        return self._in_times(self._t + (dt if exact else step), slice(None), 1, self._policy)

    def _knot(self, x: TimesLike, name: str) -> int:
        """Return the index of a knot that is given by its time."""
        times, own = self._core_times(x, name)
        if times.ndim > len(self._batch) * own:
            raise ValidationError(f"{name} must be a single time, not an array of shape {np.shape(times)}")
        is_knot = self._times == times[..., None]
        # The knot must have the same number in all curves of a batch.
        found = np.flatnonzero(is_knot.reshape(-1, is_knot.shape[-1]).all(axis=0))
        if not len(found):
            raise ValidationError(f"{name} = {short_repr(x)} is not a knot of the curve. Pass an entry of curve.t.")
        return int(found[0])

    @property
    def _policy(self) -> Extrapolate:
        """The extrapolation policy without reference to the end conditions."""
        return "periodic" if self._extrapolation_mode == "periodic" else self._extrapolate

    def _in_times(self, t: Array, nodes: slice, sign: int, extrapolate: Extrapolate) -> SegmentedCurve[P]:
        """Return the curve through some nodes at other times, with velocities multiplied by the sign."""
        t = np.ascontiguousarray(t)
        origin = None if self._time_axis.plain else t[..., :1] if t.ndim > 1 else t[0]
        time_axis = replace(self._time_axis, origin=origin)
        times = time_axis.knots(t)
        if not (np.diff(times) > 0).all():
            raise ValidationError("knots coincide after rounding. Use a smaller dt, or dates.")
        index = (slice(None),) * len(self._batch) + (nodes,)
        arrays = [
            (np.ascontiguousarray(part.points[index]), sign * np.ascontiguousarray(part.velocities[index]))
            for part in self._curve.parts
        ]
        return self._of_nodes(time_axis, t, times, arrays, extrapolate)

    def _of_nodes(
        self, time_axis: TimeAxis, t: Array, times: Doubles, arrays: list[tuple[Array, Array]], extrapolate: Extrapolate
    ) -> SegmentedCurve[P]:
        """Return the curve with given points and velocities at its knots in each factor: a Hermite spline."""
        curve = curve_of(self.space, times, arrays, fitted=False)
        found: SegmentedCurve[P] = _archive.FORMATS["symspline-hermite"]._of(
            time_axis, t, curve, "natural", extrapolate
        )
        return found

    # ---- comparison, text and plots ----

    def __eq__(self, other: object) -> bool:
        """Whether spaces, knots, points and velocities are equal, bit by bit."""
        if type(self) is not type(other) or not isinstance(other, SegmentedCurve):
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

    def _repr_html_(self) -> str:
        """Return the representation for notebooks, with a small plot if Matplotlib is installed."""
        text = f"<pre>{escape(repr(self))}</pre>"
        if find_spec("matplotlib") is None:
            return text
        picture = BytesIO()
        try:
            self.plot().savefig(picture, format="png", dpi=_DOTS)
        except ValidationError:
            # Curves that failed cannot be plotted.
            return text
        data = b64encode(picture.getvalue()).decode()
        return f'{text}<img src="data:image/png;base64,{data}" alt="{escape(repr(self))}">'

    def plot(self, file: File | None = None) -> Figure:
        """Plot the curve, its speed and the size of its covariant acceleration.

        The first panel depends on the space:

        - S²: a globe and a map; H²: the Poincaré disk; R¹, R² and R³: the graph or the curve.
        - SO(3), O(3), SU(2) and S³ (unit quaternions, scalar first): rotated frames along the time axis.
        - S¹, SO(2), O(2), U(1), RP¹ and Gr(1, 2): the continuous angle against time.
        - SE(3): frames along the path of the positions; SE(2): arrow heads on it.
        - CP¹ and the complex Gr(1, 2): the Bloch sphere.
        - RP², Gr(1, 3) and Gr(2, 3): a hemisphere, with the normals of planes. A curve that leaves it through the rim
          re-enters on the opposite side.
        - Other projective spaces and Grassmannians: the principal angles to the first point.
        - SPD(2) and SPD(3): ellipses and ellipsoids along the time axis.
        - All other spaces: the components against time, with dashed imaginary parts.

        A product has one such panel per factor. At most 50 curves of a batch are drawn.

        Parameters
        ----------
        file : str, path or file object, optional
            File to which the figure is saved, such as ``"curve.pdf"``.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, which you can modify or save.

        Raises
        ------
        ImportError
            If Matplotlib is not installed.

        Notes
        -----
        A smoothing spline is drawn with its data and, where possible, with 95 % bands of the curve and the speed;
        bands of a batch are drawn for a few curves only. A curve of `estimate` is drawn with all points among its
        measurements. It has a panel with the residuals of every other measurement in standard deviations, and one with
        the radius of the 95 % band if the first panel does not show the band. The function uses neither pyplot nor any
        global setting of Matplotlib.

        Examples
        --------
        >>> import symspline as ss
        >>> quarter = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], ss.Sphere(2))
        >>> figure = quarter.plot()
        """
        require_matplotlib()
        from ._plotting import plot

        return plot(self, file)


def check_curve(spline: Any, name: str = "spline") -> None:
    """Raise TypeError unless an argument is a curve of cubic segments."""
    if not isinstance(spline, SegmentedCurve):
        what = "a curve with knots and velocities, such as a symspline.CubicSpline"
        raise TypeError(f"{name} must be {what}, not {short_repr(spline)}")


def evaluated(
    curve: CurveArrays,
    time_axis: TimeAxis,
    x: TimesLike,
    quantity: str,
    outside: str,
    per_curve: bool,
    progress: Progress | None = None,
    out: Any = None,
) -> Any:
    """Evaluate a quantity at times as a user passes them."""

    def call(x: Doubles, outside: str, per_curve: bool) -> Any:
        if quantity == "jerk":
            values = jerk(curve, x, outside, per_curve, progress)
            return values if out is None else write_into(out, values, curve.space)
        return curve.evaluate(x, quantity, outside, per_curve, progress, out)

    return call_at_times(curve, time_axis, x, per_curve, outside, call)


def call_at_times(
    curve: CurveArrays,
    time_axis: TimeAxis,
    x: TimesLike,
    per_curve: bool,
    outside: str,
    call: Callable[[Doubles, str, bool], Any],
) -> Any:
    """Call a function of a curve with times as a user passes them.

    Parameters
    ----------
    outside : str
        Extrapolation policy by its name in the core, or ``"nan"``, which this function implements.
    call : callable
        Function of times as the core counts them, a policy of the core, and `per_curve`.
    """
    per_curve = checked_flag(per_curve, "per_curve")
    if time_axis.plain and type(x) is float:
        # Single times are frequent, and the general conversion would cost more than the evaluation.
        times, knots = np.array(x), curve.times
        if knots.ndim > 1 or not knots[0] <= x <= knots[-1]:
            times, per_curve = onto_ends(times, knots, curve.batch, per_curve)
    else:
        times, per_curve = time_axis.at(x, curve.batch, per_curve, curve.times)
    beyond = None
    if outside == "nan":
        times, per_curve, beyond = _inside(curve, times, per_curve)
        outside = "raise"
    try:
        values = call(times, outside, per_curve)
    except ValidationError as error:
        raise time_axis.explain(error) from None
    if beyond is not None:
        index = beyond if per_curve else (slice(None),) * len(curve.batch) + (beyond,)
        for own in values if isinstance(values, tuple) else (values,):
            own[index] = np.nan
    return values


def _inside(curve: CurveArrays, times: Doubles, per_curve: bool) -> tuple[Doubles, bool, NDArray[np.bool_] | None]:
    """Replace times outside the knots by the first knot, and return which times these are, if any."""
    first, last = curve.times[..., 0], curve.times[..., -1]
    if curve.times.ndim > 1:
        own = times.shape[len(curve.batch) :] if per_curve else times.shape
        first, last = (end.reshape(curve.batch + (1,) * len(own)) for end in (first, last))
    # Infinite times and NaN remain, and raise.
    beyond = np.asarray(np.isfinite(times) & ((times < first) | (times > last)))
    if not beyond.any():
        return times, per_curve, None
    return np.where(beyond, first, times), per_curve or beyond.ndim > times.ndim, beyond

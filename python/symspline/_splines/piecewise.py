"""The base class of curves made of Bézier segments between knots."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import as_array, read_only, short_repr
from .._base.input import times_of
from .._base.time import TimeAxis
from .._base.typing import BCType, Extrapolate, P, Progress, Time, TimesLike
from .._core import ValidationError
from .._curves.composed import call_at_times, evaluated
from .._curves.curve import CurveArrays
from .._curves.fit import curve_of
from .._curves.options import check_progress, extrapolation_mode, quantity_of
from .._spaces import Array, Doubles, Product, Space, parts_of
from . import archive
from .base import Curve, TimedCurve, check_increasing

# Relative difference of velocities that are equal up to rounding.
_SAME = 1e-12


class PiecewiseCubic(TimedCurve[P]):
    """Base class of curves of cubic Bézier segments, which are given by knots, points and velocities."""

    # Whether points and velocities at the knots determine the curve.
    _of_velocities: ClassVar[bool] = True

    @property
    @abstractmethod
    def _ends(self) -> str:
        """End conditions, as the title of a plot names them."""

    def _made_of(self, radius: float | None = None) -> str:
        return f"{self._t.shape[-1]} points{' each' if self._batch else ''}, {self._ends}"

    @property
    def _node_times(self) -> Doubles:
        return self._times

    _t: Array
    _curve: CurveArrays

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
        return archive.segments_state(
            self._format, self.space, self._t, self._time_axis, self._extrapolate, self._curve
        )

    # ---- parts and copies in other times, which are exact as curves of cubic segments ----

    def _restricted(self, start: Doubles, stop: Doubles) -> Curve[P]:
        first, last = (self._knot(end) for end in (start, stop))
        if first is None or last is None:
            return super()._restricted(start, stop)
        kept = slice(first, last + 1)
        return self._in_times(self._t[..., kept], kept, 1, None)

    def _reversed(self) -> PiecewiseCubic[P]:
        t, last = self._t, self._t[..., -1:]
        mirrored = (t[..., :1] + (last - t))[..., ::-1].copy()
        # The sum can differ from the last knot by rounding.
        mirrored[..., -1] = last[..., 0]
        return self._in_times(mirrored, slice(None, None, -1), -1, self._policy)

    def _shifted(self, step: Any) -> PiecewiseCubic[P]:
        return self._in_times(self._t + step, slice(None), 1, self._policy)

    def _merged(self, other: Curve[P]) -> PiecewiseCubic[P] | None:
        # Piecewise geodesics have velocities on both sides of a knot.
        if not isinstance(other, PiecewiseCubic) or not (self._of_velocities and other._of_velocities):
            return None
        pairs = list(zip(self._curve.parts, other._curve.parts, strict=True))
        axis = len(self._batch)
        if not all(_agree(*own, axis) for own in pairs):
            return None
        t = np.concatenate([self._t[:-1], other._t])
        arrays = [
            tuple(
                np.concatenate([np.delete(getattr(first, name), -1, axis=axis), getattr(second, name)], axis=axis)
                for name in ("points", "velocities")
            )
            for first, second in pairs
        ]
        return self._on_nodes(t, arrays, None)

    def _knot(self, time: Doubles) -> int | None:
        """Return the index of the knot with this time, the same in all curves of a batch."""
        is_knot = self._times == time[..., None]
        found = np.flatnonzero(is_knot.reshape(-1, is_knot.shape[-1]).all(axis=0))
        return int(found[0]) if len(found) else None

    @property
    def _policy(self) -> Extrapolate:
        """The extrapolation policy without reference to the end conditions."""
        return "periodic" if self._extrapolation_mode == "periodic" else self._extrapolate

    def _in_times(self, t: Array, nodes: slice, sign: int, extrapolate: Extrapolate) -> PiecewiseCubic[P]:
        """Return the curve through some nodes at other times, with velocities multiplied by the sign."""
        index = (slice(None),) * len(self._batch) + (nodes,)
        arrays = [
            (np.ascontiguousarray(part.points[index]), sign * np.ascontiguousarray(part.velocities[index]))
            for part in self._curve.parts
        ]
        return self._on_nodes(np.ascontiguousarray(t), arrays, extrapolate)

    def _on_nodes(self, t: Array, arrays: list[Any], extrapolate: Extrapolate) -> PiecewiseCubic[P]:
        """Return the curve with points and velocities in each factor at knots t of the same time axis."""
        origin = None if self._time_axis.plain else t[..., :1] if t.ndim > 1 else t[0]
        time_axis = replace(self._time_axis, origin=origin)
        times = time_axis.knots(t)
        check_increasing(times)
        return self._of_nodes(time_axis, t, times, arrays, extrapolate)

    def _of_nodes(
        self, time_axis: TimeAxis, t: Array, times: Doubles, arrays: list[tuple[Array, Array]], extrapolate: Extrapolate
    ) -> PiecewiseCubic[P]:
        """Return the curve with given points and velocities at its knots in each factor: a Hermite spline."""
        curve = curve_of(self.space, times, arrays, fitted=False)
        found: PiecewiseCubic[P] = archive.FORMATS["symspline-hermite"]._of(time_axis, t, curve, "natural", extrapolate)
        return found

    # ---- comparison and plots ----

    def __eq__(self, other: object) -> bool:
        """Whether spaces, knots, points and velocities are equal, bit by bit."""
        if type(self) is not type(other) or not isinstance(other, PiecewiseCubic):
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


def _agree(first: Any, second: Any, axis: int) -> bool:
    """Whether one curve ends, up to rounding, at the point and with the velocity with which another begins."""
    for name in ("points", "velocities"):
        x, y = np.take(getattr(first, name), -1, axis=axis), np.take(getattr(second, name), 0, axis=axis)
        if not np.allclose(x, y, rtol=_SAME, atol=_SAME * np.abs(x).max(initial=0.0), equal_nan=True):
            return False
    return True


def check_curve(spline: Any, name: str = "spline") -> None:
    """Raise TypeError unless an argument is a curve of cubic segments."""
    if not isinstance(spline, PiecewiseCubic):
        what = "a curve with knots and velocities, such as a symspline.CubicSpline"
        raise TypeError(f"{name} must be {what}, not {short_repr(spline)}")

"""The base class of curves made of Bézier segments between knots."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import as_array, checked_flag, read_only, short_repr
from .._base.input import times_of
from .._base.time import TimeAxis, knots_of, refuse_outside
from .._base.typing import (
    Array,
    BCType,
    Extrapolate,
    FloatArray,
    Number,
    P,
    PointsLike,
    Progress,
    State,
    Time,
    TimesLike,
)
from .._core import ValidationError
from .._curves.composed import call_at_times, check_increasing
from .._curves.curve import CurveArrays
from .._curves.failures import warn_of_representatives
from .._curves.fit import Points, curve_of, hermite_data, read, read_ends, read_velocities, validated
from .._curves.missing import counts_all_samples, curves_without_missing, nodes_without_missing, with_remedy
from .._curves.options import check_progress, checked_extrapolate, extrapolation_mode, quantity_of, with_atol
from .._curves.slopes import check_method, joined, jumps, local_velocities
from .._spaces import POINT_TOL, AnySpace, Doubles, Product, Space, factors_of, parts_of, space_named
from ..manifolds import Manifold
from . import archive
from .base import Curve

# Relative difference of velocities that are equal up to rounding.
_SAME = 1e-12


class PiecewiseCubic(Curve[P]):
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

    def _set_nodes(
        self, time_axis: TimeAxis, t: Array, curve: CurveArrays, bc_type: BCType, extrapolate: Extrapolate
    ) -> None:
        """Set the state that all curves of cubic segments have."""
        self._time_axis, self._t, self._curve = time_axis, t, curve
        self._bc_type, self._extrapolate = bc_type, extrapolate
        self._extrapolation_mode = extrapolation_mode(extrapolate, bc_type)

    @classmethod
    def _at_nodes(cls, time_axis: TimeAxis, t: Array, curve: CurveArrays, extrapolate: Extrapolate) -> Self:
        """Return the curve with these points and velocities at its knots, without checks."""
        self = cls.__new__(cls)
        self._set_nodes(time_axis, t, curve, "natural", extrapolate)
        return self

    @classmethod
    def _from_state(cls, state: archive.Entries) -> Self:
        time_axis, t, curve, extrapolate = archive.read_segments(state, fitted=False)
        archive.check_curves(state, curve, [True] * len(curve.parts), gaps=True)
        arrays = [(factor.points, factor.velocities) for factor in curve.factors]
        return cls._at_nodes(time_axis, t, cls._joined_nodes(curve.space, curve.times, arrays), extrapolate)

    @staticmethod
    def _joined_nodes(space: AnySpace, times: Doubles, arrays: list[tuple[Array, Array]]) -> CurveArrays:
        """Return the curve with points and velocities at its knots in each factor."""
        return curve_of(space, times, arrays, fitted=False)

    def _with(self, time_axis: TimeAxis, t: Array, curve: CurveArrays, index: object) -> Self:
        """Return the curves that an index selects from the batch."""
        return self._at_nodes(time_axis, t, curve, self._extrapolate)

    @property
    def _counts(self) -> str:
        return f"{self._t.shape[-1]} points, "

    def _where(self, extrapolate: Any) -> str:
        if extrapolate is None:
            return self._extrapolation_mode
        return extrapolation_mode(checked_extrapolate(extrapolate), self._bc_type)

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
        times, per_curve = self._time_axis.at(pair, self._batch, False, self._times)
        where = "periodic" if self._extrapolation_mode == "periodic" else "raise"
        if where == "raise":
            remedy = "; vectors are transported between the first and the last knot only, and x is (x0, x1)"
            with self._time_axis.explained():
                refuse_outside(self._times, self._batch, times, per_curve, remedy=remedy)
        at = self._curve.evaluate(times, "point", where, per_curve)
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
        if per_curve:
            # Curves that count time from their own first knots are processed one by one.
            product = isinstance(self.space, Product)
            moved_curves: list[Any] = [
                self[i].transport(x0, x1, tuple(v[i] for v in vectors) if product else vectors[0][i])
                for i in range(len(self))
            ]
            stacked: Any = tuple(map(np.stack, zip(*moved_curves, strict=True))) if product else np.stack(moved_curves)
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
    def _times(self) -> NDArray[np.float64]:
        """Knots as the core counts them."""
        return self._curve.times

    @property
    def domain(self) -> tuple[Time, Time]:
        return self._t[..., 0][()], self._t[..., -1][()]

    def _picked(self, index: Any) -> Self:
        t = self._t[index] if self._times.ndim > 1 else self._t
        return self._with(self._time_axis.take_batch(index), t, self._curve.take_batch(index), index)

    def _state(self) -> State:
        state = archive.head_of(self) | {"extrapolate": self._extrapolate}
        state |= archive.times_state("t", self._t, self._time_axis)
        for name in ("points", "velocities"):
            arrays = [getattr(factor, name) for factor in self._curve.factors]
            state |= archive.by_factor(name, self._curve.space, arrays)
        return state

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
        if not all(_agree(*pair, axis) for pair in pairs):
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
        indices = np.flatnonzero(is_knot.reshape(-1, is_knot.shape[-1]).all(axis=0))
        return int(indices[0]) if len(indices) else None

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
        return HermiteSpline._at_nodes(time_axis, t, self._joined_nodes(self.space, times, arrays), extrapolate)

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


def _agree(first: object, second: object, axis: int) -> bool:
    """Whether one curve ends, up to rounding, at the point and with the velocity with which another begins."""
    for name in ("points", "velocities"):
        x, y = np.take(getattr(first, name), -1, axis=axis), np.take(getattr(second, name), 0, axis=axis)
        if not np.allclose(x, y, rtol=_SAME, atol=_SAME * np.abs(x).max(initial=0.0), equal_nan=True):
            return False
    return True


def check_curve(spline: object, name: str = "spline") -> None:
    """Raise TypeError unless an argument is a curve of cubic segments."""
    if not isinstance(spline, PiecewiseCubic):
        what = "a curve with knots and velocities, such as a symspline.CubicSpline"
        raise TypeError(f"{name} must be {what}, not {short_repr(spline)}")


# ---- cubic Hermite splines, and curves of geodesics between neighbouring points ----


class HermiteSpline(PiecewiseCubic[P]):
    r"""Interpolate points and velocities by a C¹ cubic Hermite spline.

    Each segment is the cubic Bézier curve of a `CubicSpline`, with control points that follow from the given
    velocities instead of a C² condition. The covariant acceleration may jump at the knots. On a Euclidean space the
    result equals SciPy's ``CubicHermiteSpline``.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,) or (..., n), or None
        Strictly increasing knots, shared by all curves or one row per curve. None means 0, 1, ..., n - 1. Velocities
        for dates are per second. Dates with a time zone are converted to UTC.
    points : array_like, shape (..., n, *space.point_shape)
        Points to interpolate, at least two per curve. Leading axes are batch axes. Points within `atol` of the
        manifold are projected onto it. For a `Product`, pass a tuple with one array per factor.
    velocities : array_like, shape (..., n, *space.point_shape)
        Velocities γ' at the points, which must be tangent vectors there. `symspline.rotations.velocities` computes
        those of rotations from angular velocities.
    space : Space or str
        A space or its name, such as ``Sphere(2)`` or ``"sphere:2"``.
    extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
        Extrapolation policy for times beyond the knots. None and ``"raise"`` raise `ValidationError`. True continues
        the first and last segments. False gives NaN. ``"geodesic"`` continues with constant velocity. ``"periodic"``
        repeats the curve.
    atol : float, optional
        Largest distance of a point from the manifold. By default, the accuracy of the points determines it, as for
        `CubicSpline`.
    skipna : bool, default False
        True to omit missing samples, as for `CubicSpline`.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    CutLocusError
        If two neighbouring points or control points are not joined by a unique shortest geodesic.

    Warns
    -----
    FarPointsWarning
        If a curve has at least four segments and more than half of its steps exceed 0.6 of the distance to the cut
        locus.
    UserWarning
        If points on ``Sphere(3)`` look like unit quaternions with inconsistent signs.

    See Also
    --------
    CubicSpline : Interpolate points by a C² curve.
    evaluate : Evaluate a curve given by plain arrays.

    Notes
    -----
    The control points of the segment between the points :math:`p_i` and :math:`p_{i+1}` with the velocities
    :math:`u_i` and :math:`u_{i+1}` are, for an interval of length h,

    .. math:: p_i, \quad \exp_{p_i}(h u_i / 3), \quad \exp_{p_{i+1}}(-h u_{i+1} / 3), \quad p_{i+1}.

    If a handle :math:`h u / 3` passes the cut locus, the curve would not have the velocity u, and `ValidationError` is
    raised. A `Torus` is an exception: where a handle exceeds half a turn in an angle, the segment has the number of
    turns for which the change of this angle is nearest to :math:`h (u_i + u_{i+1}) / 2`. This is the cubic with the
    lowest bending energy.

    References
    ----------
    G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
    Anal. 56 (2018), equations (8) and (12).

    Examples
    --------
    >>> import symspline as ss
    >>> curve = ss.HermiteSpline([0, 1], [[1, 0, 0], [0, 1, 0]], [[0, 0, 0], [-1, 0, 0]], "sphere:2")
    >>> curve(1, nu=1).round(12) + 0.0
    array([-1.,  0.,  0.])
    """

    # Hermite splines are never closed: their end conditions are "natural".
    _kind = "C¹ Hermite spline"
    _format = "symspline-hermite"
    _ends = "given velocities"

    @counts_all_samples
    def __init__(
        self,
        t: TimesLike | None,
        points: PointsLike,
        velocities: ArrayLike,
        space: Space[P] | str,
        *,
        extrapolate: Extrapolate = None,
        atol: float | None = None,
        skipna: bool = False,
    ) -> None:
        space = space_named(space)
        if checked_flag(skipna, "skipna"):
            t, points, velocities = nodes_without_missing(t, points, velocities, space)
        nodes = _read(t, points, space, extrapolate, atol)
        vectors = read_velocities(velocities, space, nodes.data)
        with nodes.explained():
            curve = nodes.hermite(vectors)
        self._set_nodes(nodes.time_axis, nodes.t, curve, "natural", extrapolate)

    @classmethod
    @counts_all_samples
    def from_points(
        cls,
        t: TimesLike | None,
        points: PointsLike,
        space: Space[P] | str,
        *,
        method: Literal["catmull-rom", "akima", "pchip"] = "catmull-rom",
        extrapolate: Extrapolate = None,
        atol: float | None = None,
        skipna: bool = False,
    ) -> HermiteSpline[P]:
        r"""Interpolate points by a C¹ curve that depends on neighbouring points only.

        The velocity at each point is computed from the geodesics to its neighbours. No equations are solved, a change
        of one point changes the curve in at most six segments, and there is no C² condition.

        Parameters
        ----------
        t : array_like of float or datetime64, shape (n,) or (..., n), or None
            Strictly increasing knots. None means 0, 1, ..., n - 1.
        points : array_like, shape (..., n, *space.point_shape)
            Points to interpolate, at least two per curve. Leading axes are batch axes. For a `Product`, pass a tuple
            with one array per factor.
        space : Space or str
            A space or its name, such as ``Sphere(2)`` or ``"sphere:2"``. A `Manifold` must have a function `transport`.
        method : {"catmull-rom", "akima", "pchip"}, default "catmull-rom"
            Formula for the velocities.

            - ``"catmull-rom"``: the velocity of the parabola through the point and its two neighbours. It is the
              Catmull–Rom spline for knots at any distances.
            - ``"akima"``: Akima's weighted mean of the velocities of the two adjacent geodesics. Weights depend on four
              segments. The curve does not overshoot next to straight parts.
            - ``"pchip"``: the weighted harmonic mean of both velocities, zero where the curve turns back. In flat
              space, every component is monotone where its data are.
        extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
            Extrapolation policy, as for `HermiteSpline`.
        atol : float, optional
            Largest distance of a point from the manifold. By default, the accuracy of the points determines it, as for
            `CubicSpline`.
        skipna : bool, default False
            True to omit missing samples, as for `CubicSpline`.

        Returns
        -------
        HermiteSpline
            The curve. With two points it is a geodesic.

        Raises
        ------
        ValidationError
            If the input does not meet the requirements above.
        CutLocusError
            If no neighbouring points, or not all neighbouring control points, are joined by a unique shortest geodesic.

        Warns
        -----
        FarPointsWarning
            If some neighbouring points are not joined by a unique shortest geodesic. The velocities there are NaN, and
            so is the curve on the segments next to these points. Other segments are those of the points on either side
            alone.

        See Also
        --------
        CubicSpline : Interpolate points by a C² curve.
        PiecewiseGeodesic : Join points by geodesics.

        Notes
        -----
        Let :math:`m_i = \log_{p_i}(p_{i+1}) / h_i` be the velocity of the geodesic between two neighbours. At the node
        i, the velocities of the segments i - 2 to i + 1 are transported to :math:`p_i` along these geodesics. The
        formulas of flat space are then applied in the tangent space at :math:`p_i`:

        .. math:: \frac{h_i m_{i-1} + h_{i-1} m_i}{h_{i-1} + h_i}, \qquad
                  \frac{|m_{i+1} - m_i| \, m_{i-1} + |m_{i-1} - m_{i-2}| \, m_i}{|m_{i+1} - m_i| + |m_{i-1} - m_{i-2}|}

        for ``"catmull-rom"`` [1]_ and ``"akima"`` [2]_. At the ends, the first formula becomes that of the outer
        parabola. On a Euclidean space, the second formula and that of ``"pchip"`` [3]_ are applied to each component,
        and the results equal SciPy's ``Akima1DInterpolator`` and ``PchipInterpolator``. On other spaces, components
        depend on the choice of a frame. Norms of vectors replace the absolute values there, and ``"pchip"`` gives the
        harmonic mean of both speeds in the direction of the bisector, times the cosine of half the angle between both
        directions. The curve is therefore independent of coordinates: an isometry that is applied to the points is
        applied to the curve. In one dimension, both definitions agree. Without an invariant metric, as on poses, only
        ``"catmull-rom"`` has this property.

        References
        ----------
        .. [1] E. Catmull, R. Rom, A Class of Local Interpolating Splines, Computer Aided Geometric Design (1974).
        .. [2] H. Akima, A New Method of Interpolation and Smooth Curve Fitting Based on Local Procedures, J. ACM 17
           (1970).
        .. [3] F. N. Fritsch, J. Butland, A Method for Constructing Local Monotone Piecewise Cubic Interpolants, SIAM J.
           Sci. Stat. Comput. 5 (1984).

        Examples
        --------
        >>> import symspline as ss
        >>> points = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        >>> curve = ss.HermiteSpline.from_points([0, 1, 3], points, "sphere:2")
        >>> curve.velocities[1].round(4) + 0.0
        array([-1.0472,  0.    ,  0.2618])
        >>> steps = [[0.0], [0.0], [1.0], [1.0]]
        >>> ss.HermiteSpline.from_points(None, steps, "r:1", method="pchip").velocities.ravel()
        array([0., 0., 0., 0.])
        """
        space = space_named(space)
        check_method(method)
        nodes = _read(*_present(t, points, space, skipna), space, extrapolate, atol)
        with nodes.explained():
            factors = zip(factors_of(space), nodes.validated(), strict=True)
            vectors = [(local_velocities(factor, nodes.times, on, method), POINT_TOL) for factor, on in factors]
            curve = nodes.hermite(vectors)
        return HermiteSpline._at_nodes(nodes.time_axis, nodes.t, curve, extrapolate)


class _Nodes(NamedTuple):
    """Knots and points of a curve as given by the user.

    Attributes
    ----------
    t : ndarray
        Knots as shown.
    times : ndarray
        Knots as the core counts them.
    """

    space: AnySpace
    data: list[Points]
    time_axis: TimeAxis
    t: Array
    times: Doubles

    @contextmanager
    def explained(self) -> Iterator[None]:
        """Add to errors how missing points are omitted, and from when times count."""
        try:
            yield
        except ValidationError as error:
            raise with_remedy(self.time_axis.explain(error), self.data, self.times) from None

    def validated(self) -> list[Array]:
        """Return the points in each factor after validation."""
        return validated(self.space, self.times, self.data, read_ends("natural", self.space, self.data[0].batch))[0]

    def hermite(self, vectors: list[tuple[Array, float]]) -> CurveArrays:
        """Return the curve through the points with velocities, after validation. See `hermite_data`."""
        factors = hermite_data(self.space, self.times, self.data, vectors)
        curve = curve_of(self.space, self.times, [factor[:2] for factor in factors], fitted=False)
        warn_of_representatives(self.space, [self.data], [curve], [[longest for *_, longest in factors]])
        return curve


def _read(
    t: TimesLike | None, points: PointsLike, space: AnySpace, extrapolate: Extrapolate, atol: float | None
) -> _Nodes:
    checked_extrapolate(extrapolate)
    data = with_atol(read(points, space), atol)
    return _Nodes(space, data, *knots_of(t, data[0].batch, data[0].nodes))


def _present(t: object, points: object, space: AnySpace, skipna: Any) -> tuple[Any, Any]:
    """Return knots and points, without missing samples if the user wants to omit them."""
    return curves_without_missing(t, points, space) if checked_flag(skipna, "skipna") else (t, points)


# ---- curves of geodesics between neighbouring points ----

# A change of velocity below this part of the speed is a rounding error of a straight curve.
_STRAIGHT = 1e-9


class PiecewiseGeodesic(PiecewiseCubic[P]):
    r"""Join points by geodesics.

    The speed is constant on each segment, and the velocity jumps at the knots. On rotations, the result equals SciPy's
    ``Slerp``; on a Euclidean space, it is linear interpolation. Use it as a baseline for comparisons, or for data that
    are too coarse for a smooth curve.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,) or (..., n), or None
        Strictly increasing knots, shared by all curves or one row per curve. None means 0, 1, ..., n - 1. Velocities
        for dates are per second. Dates with a time zone are converted to UTC.
    points : array_like, shape (..., n, *space.point_shape)
        Points to join, at least two per curve. Leading axes are batch axes. Points within `atol` of the manifold are
        projected onto it. For a `Product`, pass a tuple with one array per factor.
    space : Space or str
        A space or its name, such as ``Sphere(2)`` or ``"sphere:2"``.
    extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
        Extrapolation policy for times beyond the knots. None and ``"raise"`` raise `ValidationError`. True and
        ``"geodesic"`` continue the first and last segments. False gives NaN. ``"periodic"`` repeats the curve.
    atol : float, optional
        Largest distance of a point from the manifold. By default, the accuracy of the points determines it, as for
        `CubicSpline`.
    skipna : bool, default False
        True to omit missing samples, as for `CubicSpline`.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    CutLocusError
        If no neighbouring points are joined by a unique shortest geodesic.

    Warns
    -----
    FarPointsWarning
        If two neighbouring points lie at or past each other's cut locus. The curve is NaN between them. Also if a curve
        has at least four segments and more than half of its steps exceed 0.6 of the distance to the cut locus.
    UserWarning
        If points on ``Sphere(3)`` look like unit quaternions with inconsistent signs.

    See Also
    --------
    CubicSpline : Interpolate points by a C² curve.
    HermiteSpline.from_points : Interpolate points by a C¹ curve.
    Space.geodesic : Evaluate the geodesic between two points.

    Notes
    -----
    On the segment between the points :math:`p_i` and :math:`p_{i+1}`, the curve is :math:`[p_i, p_{i+1}]_\tau`, the
    geodesic (6) with :math:`\tau = (t - t_i) / h_i`. At a knot, the velocity of the segment after it is returned, and
    at the last knot that of the last segment. The covariant acceleration is zero except for rounding errors.

    References
    ----------
    G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
    Anal. 56 (2018), equation (6).

    Examples
    --------
    >>> import symspline as ss
    >>> curve = ss.PiecewiseGeodesic([0, 1, 3], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "sphere:2")
    >>> curve(0.5).round(8)
    array([0.70710678, 0.70710678, 0.        ])
    >>> curve.speed([0.5, 1.0]).round(4)
    array([1.5708, 0.7854])
    >>> curve.length().round(8)
    np.float64(3.14159265)
    """

    _kind = "Piecewise geodesic"
    _format = "symspline-geodesics"
    _ends = "joined by geodesics"
    _of_velocities = False

    @counts_all_samples
    def __init__(
        self,
        t: TimesLike | None,
        points: PointsLike,
        space: Space[P] | str,
        *,
        extrapolate: Extrapolate = None,
        atol: float | None = None,
        skipna: bool = False,
    ) -> None:
        space = space_named(space)
        nodes = _read(*_present(t, points, space, skipna), space, extrapolate, atol)
        with nodes.explained():
            curve = joined(space, nodes.times, nodes.validated())
        self._set_nodes(nodes.time_axis, nodes.t, curve, "natural", extrapolate)
        warn_of_representatives(space, [nodes.data], [curve], [[_longest_step(part) for part in curve.parts]])

    @staticmethod
    def _joined_nodes(space: AnySpace, times: Doubles, arrays: list[tuple[Array, Array]]) -> CurveArrays:
        return joined(space, times, [points for points, _ in arrays])

    @property
    def velocities(self) -> P:
        """Velocities γ' after the knots, with the shape of the points; at the last knot, the velocity before it."""
        velocities: P = self._curve.velocities
        return velocities

    def bending_energy(self) -> Number:
        """Compute the bending energy of the curve.

        Returns
        -------
        ndarray or float, shape ``batch axes``
            Infinity if the velocity jumps at a knot, since no curve of finite energy has a jump. Zero for a single
            geodesic. NaN if the curve is NaN somewhere.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.PiecewiseGeodesic(None, [[0.0], [1.0], [0.0]], "r:1").bending_energy()
        np.float64(inf)
        """
        largest = np.max([sizes.max(axis=-1, initial=0.0) for sizes in jumps(self._curve)], axis=0)
        energy: FloatArray = np.where(np.isnan(largest), np.nan, np.where(largest > _STRAIGHT, np.inf, 0.0))
        return energy[()]

    def _of_nodes(
        self, time_axis: TimeAxis, t: Array, times: Doubles, arrays: list[tuple[Array, Array]], extrapolate: Extrapolate
    ) -> PiecewiseGeodesic[P]:
        return self._at_nodes(time_axis, t, self._joined_nodes(self.space, times, arrays), extrapolate)


def _longest_step(part: CurveArrays) -> Doubles:
    """Return the largest distance between neighbouring points of each curve."""
    p, q = part.space._neighbours(part.points)
    if isinstance(part.space, Manifold):
        # The distance may be unknown on a manifold that is made of functions.
        return np.full(math.prod(part.batch), np.inf)
    return np.asarray(part.space.distance(p, q).max(axis=-1, initial=0.0)).ravel()

"""Cubic Hermite splines, and curves of geodesics between neighbouring points."""

from __future__ import annotations

import math
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import checked_flag
from .._base.time import TimeAxis, knots_of
from .._base.typing import Extrapolate, FloatArray, Number, P, PointsLike, TimesLike
from .._curves.curve import CurveArrays
from .._curves.failures import warn_of_representatives
from .._curves.fit import Points, curve_of, hermite_data, read, read_ends, validated
from .._curves.missing import counts_all_samples, curves_without_missing, missing_named, nodes_without_missing
from .._curves.options import checked_extrapolate, with_atol
from .._curves.slopes import check_method, joined, jumps, local_velocities
from .._spaces import POINT_TOL, Array, Doubles, Space, factors_of, space_named
from ..manifolds import Manifold
from .archive import Entries, check_curves, read_segments
from .functional import read_velocities
from .piecewise import PiecewiseCubic


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
        checked_extrapolate(extrapolate)
        if checked_flag(skipna, "skipna"):
            t, points, velocities = nodes_without_missing(t, points, velocities, space)
        data = with_atol(read(points, space), atol)
        batch, nodes = data[0].batch, data[0].nodes
        vectors = read_velocities(velocities, space, data)
        time_axis, shown_times, times = knots_of(t, batch, nodes)
        with missing_named(data), time_axis.explained():
            curve = _hermite(space, times, data, vectors)
        self._fill(time_axis, shown_times, curve, "natural", extrapolate)

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
        checked_extrapolate(extrapolate)
        check_method(method)
        if checked_flag(skipna, "skipna"):
            t, points = curves_without_missing(t, points, space)
        data = with_atol(read(points, space), atol)
        batch, nodes = data[0].batch, data[0].nodes
        time_axis, shown_times, times = knots_of(t, batch, nodes)
        with missing_named(data), time_axis.explained():
            valid, _ = validated(space, times, data, read_ends("natural", space, batch))
            vectors = [
                (local_velocities(factor, times, own, method), POINT_TOL)
                for factor, own in zip(factors_of(space), valid, strict=True)
            ]
            curve = _hermite(space, times, data, vectors)
        return HermiteSpline._of(time_axis, shown_times, curve, "natural", extrapolate)

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        time_axis, knots, curve, extrapolate = read_segments(state, fitted=False)
        check_curves(state, curve, [True] * len(curve.parts), gaps=True)
        return cls._of(time_axis, knots, curve, "natural", extrapolate)

    def __repr__(self) -> str:
        count = self._curve.times.shape[-1]
        return f"<HermiteSpline on {self.space!r}: {self._batch_text}{count} points, {self._span_text}>"

    def _with(self, time_axis: TimeAxis, t: Array, curve: CurveArrays, index: Any) -> Any:
        return HermiteSpline._of(time_axis, t, curve, "natural", self._extrapolate)


def _hermite(space: Space[Any], times: Doubles, data: list[Points], vectors: list[tuple[Array, float]]) -> CurveArrays:
    """Return the curve through points with velocities, after validation. See `hermite_data`."""
    found = hermite_data(space, times, data, vectors)
    curve = curve_of(space, times, [own[:2] for own in found], fitted=False)
    warn_of_representatives(space, [data], [curve], [[own[2] for own in found]])
    return curve


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
        checked_extrapolate(extrapolate)
        if checked_flag(skipna, "skipna"):
            t, points = curves_without_missing(t, points, space)
        data = with_atol(read(points, space), atol)
        batch, nodes = data[0].batch, data[0].nodes
        time_axis, shown_times, times = knots_of(t, batch, nodes)
        with missing_named(data), time_axis.explained():
            valid, _ = validated(space, times, data, read_ends("natural", space, batch))
            curve = joined(space, times, valid)
        self._fill(time_axis, shown_times, curve, "natural", extrapolate)
        warn_of_representatives(space, [data], [curve], [[_longest_step(part) for part in curve.parts]])

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        time_axis, knots, curve, extrapolate = read_segments(state, fitted=False)
        check_curves(state, curve, [True] * len(curve.parts), gaps=True)
        geodesics = joined(curve.space, curve.times, [part.points for part in curve.parts])
        return cls._of(time_axis, knots, geodesics, "natural", extrapolate)

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
        largest = np.max([own.max(axis=-1, initial=0.0) for own in jumps(self._curve)], axis=0)
        energy: FloatArray = np.where(np.isnan(largest), np.nan, np.where(largest > _STRAIGHT, np.inf, 0.0))
        return energy[()]

    def __repr__(self) -> str:
        return f"<PiecewiseGeodesic on {self.space!r}: {self._batch_text}{self._t.shape[-1]} points, {self._span_text}>"

    def _of_nodes(
        self, time_axis: TimeAxis, t: Array, times: Doubles, arrays: list[tuple[Array, Array]], extrapolate: Extrapolate
    ) -> PiecewiseGeodesic[P]:
        curve = joined(self.space, times, [points for points, _ in arrays])
        return PiecewiseGeodesic._of(time_axis, t, curve, "natural", extrapolate)

    def _with(self, time_axis: TimeAxis, t: Array, curve: CurveArrays, index: Any) -> Any:
        return PiecewiseGeodesic._of(time_axis, t, curve, "natural", self._extrapolate)


def _longest_step(part: CurveArrays) -> Doubles:
    """Return the largest distance between neighbouring points of each curve."""
    p, q = part.space._neighbours(part.points)
    if isinstance(part.space, Manifold):
        # The distance may be unknown on a manifold that is made of functions.
        return np.full(math.prod(part.batch), np.inf)
    return np.asarray(part.space.distance(p, q).max(axis=-1, initial=0.0)).ravel()

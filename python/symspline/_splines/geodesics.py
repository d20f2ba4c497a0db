"""Curves of geodesics between neighbouring points."""

from __future__ import annotations

import math
from typing import Any, Self

import numpy as np

from .._base.arrays import checked_flag
from .._base.time import TimeAxis, knots_of
from .._base.typing import Extrapolate, FloatArray, Number, P, PointsLike, TimesLike
from .._curves.curve import CurveArrays
from .._curves.fit import read, read_ends, validated
from .._curves.geodesics import joined, jumps
from .._curves.missing import counts_all_samples, curves_without_missing, missing_named
from .._curves.options import checked_extrapolate, with_atol
from .._curves.representatives import warn_of_representatives
from .._spaces import Array, Doubles, Space, space_named
from ..manifolds import Manifold
from .archive import Entries, check_curves, read_segments
from .piecewise_cubic import PiecewiseCubic

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

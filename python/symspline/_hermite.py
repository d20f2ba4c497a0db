"""Cubic Hermite splines: curves through points with given velocities."""

from __future__ import annotations

from typing import Any, Self

from numpy.typing import ArrayLike

from ._archive import Entries, check_curves, read_segments
from ._base_curve import SegmentedCurve
from ._core import ValidationError
from ._curves.curve import CurveArrays
from ._curves.fit import curve_of, hermite_data, read
from ._functional import read_velocities
from ._options import checked_extrapolate, with_atol
from ._representatives import warn_of_representatives
from ._spaces import Array, Space, space_named
from ._time import TimeAxis, knots_of
from ._typing import Extrapolate, P, PointsLike, TimesLike


class HermiteSpline(SegmentedCurve[P]):
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
        Largest distance of a point from the manifold. By default 1e-8, or 1e-4 for points in single precision.

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
    _unconverged = 0

    def __init__(
        self,
        t: TimesLike | None,
        points: PointsLike,
        velocities: ArrayLike,
        space: Space[P] | str,
        *,
        extrapolate: Extrapolate = None,
        atol: float | None = None,
    ) -> None:
        space = space_named(space)
        checked_extrapolate(extrapolate)
        data = with_atol(read(points, space), atol)
        batch, nodes = data[0].batch, data[0].nodes
        vectors = read_velocities(velocities, space, data)
        time_axis, shown_times, times = knots_of(t, batch, nodes)
        try:
            found = hermite_data(space, times, data, vectors)
        except ValidationError as error:
            raise time_axis.explain(error) from None
        curve = curve_of(space, times, [own[:2] for own in found], fitted=False)
        self._fill(time_axis, shown_times, curve, "natural", extrapolate)
        warn_of_representatives(space, [data], [curve], [[own[2] for own in found]])

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        time_axis, knots, curve, extrapolate = read_segments(state, fitted=False)
        check_curves(state, curve, [True] * len(curve.parts))
        return cls._of(time_axis, knots, curve, "natural", extrapolate)

    def __repr__(self) -> str:
        return f"<HermiteSpline on {self.space!r}: {self._batch_text}{self._curve.times.shape[-1]} points>"

    def _with(self, time_axis: TimeAxis, t: Array, curve: CurveArrays, index: Any) -> Any:
        return HermiteSpline._of(time_axis, t, curve, "natural", self._extrapolate)

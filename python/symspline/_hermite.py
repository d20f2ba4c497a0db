"""Curves through points with given velocities."""

from __future__ import annotations

from typing import Any, Self

from numpy.typing import ArrayLike

from . import _archive
from ._base_curve import Curve
from ._core import ValidationError
from ._curves.curve import CurveArrays
from ._curves.fit import curve_of, hermite_data, read
from ._far import warn_of_far_points
from ._functional import velocities_of
from ._options import checked_extrapolate, outside, with_atol
from ._signs import warn_of_signs
from ._spaces import Array, Space, factors_of, parts_of, point_tol
from ._spaces import space as space_named
from ._time import TimeAxis, knots_of
from ._typing import BCType, Extrapolate, File, P, PointsLike


class HermiteSpline(Curve[P]):
    """The cubic curve through points with given velocities there, such as measured ones.

    Between two points it is the same Bézier curve as that of a `CubicSpline`, whose control points follow from the
    velocities. At the points it is C¹: the acceleration jumps. In flat space it is SciPy's ``CubicHermiteSpline``.

    Args:
        t: times of the points, increasing: None for 0, 1, …, N, shape (N+1,), or (..., N+1) with one row per curve.
            Numbers or dates; for dates velocities are per second. Those with a time zone become UTC.
        points: shape (..., N+1, *space.point_shape), N >= 1; leading axes are independent curves. For a `Product` a
            tuple of arrays.
        velocities: γ' at the points, tangent vectors of the shape of the points. Those of rotations are made of
            angular velocities by `symspline.rotations.velocities`.
        space: a space or its name.
        extrapolate: what happens outside the knots: None raises, True continues the last segment, ``"geodesic"`` goes
            on with constant velocity, ``"periodic"`` wraps.
        atol: how far off the space points may be, as for `CubicSpline`.

    Raises:
        ValidationError: the input is not what is described above.
        CutLocusError: the geodesic between two neighbours, or between their control points, is not unique.

    >>> import symspline as ss
    >>> curve = ss.HermiteSpline([0, 1], [[1, 0, 0], [0, 1, 0]], [[0, 0, 0], [-1, 0, 0]], "sphere:2")
    >>> curve(1, nu=1).round(12) + 0.0
    array([-1.,  0.,  0.])
    """

    _kind = "C¹ Hermite spline"
    _ends = "given velocities"
    _unconverged = 0
    _bc_type: BCType = "natural"  # such curves are not closed

    def __init__(
        self,
        t: ArrayLike | None,
        points: PointsLike,
        velocities: ArrayLike,
        space: Space[P] | str,
        *,
        extrapolate: Extrapolate = None,
        atol: float | None = None,
    ) -> None:
        space = space_named(space)
        policy = checked_extrapolate(extrapolate)
        data = with_atol(read(points, space), atol)
        batch, nodes = data[0].batch, data[0].nodes
        given = parts_of(velocities, space, "velocities")
        vectors = [
            (velocities_of(factor, part.doubles, own), point_tol(factor._array(own, "velocities").dtype))
            for factor, part, own in zip(factors_of(space), data, given, strict=True)
        ]
        clock, shown_times, times = knots_of(t, batch, nodes)
        try:
            arrays = hermite_data(space, times, data, vectors)
        except ValidationError as error:
            raise clock.explain(error) from None
        curve = curve_of(space, times, arrays, fitted=False)
        self._fill(clock, shown_times, curve, policy)
        warn_of_signs(space, [data])
        warn_of_far_points([curve], [None])

    def _fill(self, clock: TimeAxis, t: Array, curve: CurveArrays, extrapolate: Any) -> None:
        self._clock, self._t, self._curve, self._extrapolate = clock, t, curve, extrapolate
        self._outside = outside(extrapolate, self._bc_type)

    @classmethod
    def _of(cls, *parts: Any) -> Self:
        """A curve that was checked before, from all that it keeps."""
        self = cls.__new__(cls)
        self._fill(*parts)
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return HermiteSpline._of, (self._clock, self._t, self._curve, self._extrapolate)

    def __repr__(self) -> str:
        batch = self._curve.batch
        curves = f"{' x '.join(map(str, batch))} curves, " if batch else ""
        return f"<HermiteSpline on {self.space!r}: {curves}{self._curve.times.shape[-1]} points>"

    def save(self, file: File) -> None:
        """Write the curve to an NPZ file, which `symspline.load` reads back."""
        _archive.write(file, _archive.arrays_of(self, _archive.HERMITE))

    def _with(self, clock: TimeAxis, t: Array, curve: CurveArrays, index: Any) -> Any:
        return HermiteSpline._of(clock, t, curve, self._extrapolate)

"""Curves through points with given velocities."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from . import archive
from ._core import CutLocusError, ValidationError
from .curves.curve import Curve
from .curves.fit import curve_of, read, read_ends, validated
from .far import warn_of_far_points
from .functions import velocities_of
from .options import checked_policy, outside, within
from .piecewise import Piecewise
from .signs import warn_of_signs
from .spaces import Array, Space, factors_of, parts_of
from .spaces import space as space_named
from .times import Clock, knots_of


class HermiteSpline(Piecewise):
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
    _bc_type = "natural"  # such curves are not closed

    def __init__(
        self,
        t: ArrayLike | None,
        points: Any,
        velocities: Any,
        space: Space | str,
        *,
        extrapolate: bool | str | None = None,
        atol: float | None = None,
    ) -> None:
        space = space_named(space)
        policy = checked_policy(extrapolate)
        data = within(read(points, space), atol)
        batch, nodes = data[0].batch, data[0].nodes
        given = parts_of(velocities, space, "velocities")
        for factor, part, own in zip(factors_of(space), data, given, strict=True):
            velocities_of(factor, part.doubles, own, "velocities")
        clock, shown_times, times = knots_of(t, batch, nodes)
        try:
            on_space = validated(space, times, data, read_ends("natural", space, batch))
        except ValidationError as error:
            raise clock.explain(error) from None
        arrays = []
        for factor, p, own in zip(factors_of(space), on_space, given, strict=True):
            factor.check_tangent(p, own)
            arrays.append((p, np.ascontiguousarray(factor.project_tangent(p, own))))
        curve = curve_of(space, times, arrays, fitted=False)
        _check_legs(curve)
        self._fill(clock, shown_times, curve, policy)
        warn_of_signs(space, [data])
        warn_of_far_points([curve], [None])

    def _fill(self, clock: Clock, t: Array, curve: Curve, extrapolate: Any) -> None:
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

    def save(self, file: Any) -> None:
        """Write the curve to an NPZ file, which `symspline.load` reads back."""
        archive.write(file, archive.arrays_of(self, archive.HERMITE))

    def _with(self, clock: Clock, t: Array, curve: Curve, index: Any) -> HermiteSpline:
        return HermiteSpline._of(clock, t, curve, self._extrapolate)


def _check_legs(curve: Curve) -> None:
    """Raise CutLocusError unless the inner control points of every segment are within reach of each other."""
    for part in curve.parts:
        axes = len(part.batch)
        inner = np.moveaxis(part.control_points(), axes + 1, 0)[1:3]
        try:
            part.space._apply("log", p=inner[0], q=inner[1])
        except CutLocusError as error:
            row, _, why = str(error).removeprefix("pair ").partition(": the points ")
            *which, i = map(int, np.unravel_index(int(row), inner.shape[1 : axes + 2]))
            of = f" of curve {','.join(map(str, which))}" if which else ""
            raise CutLocusError(
                f"segment {i}{of}, between t[{i}] and t[{i + 1}]: its inner control points {why}; velocities are too "
                "large for its time"
            ) from None

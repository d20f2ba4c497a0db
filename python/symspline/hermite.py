"""Curves through points with given velocities."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ._core import CutLocusError, ValidationError
from .arrays import read_only, shown
from .curves.curve import Curve, quantity_of
from .curves.fit import curve_of, read, read_ends, validated
from .curves.integrals import integrate
from .curves.solve import Progress
from .functions import velocities_of
from .options import check_progress, checked_policy, outside
from .spaces import Array, Space, factors_of, parts_of
from .spaces import space as space_named
from .spline import evaluated
from .times import Clock, knots_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class HermiteSpline:
    """The cubic curve through points with given velocities there, such as measured ones.

    Between two points it is the same Bézier curve as that of a `CubicSpline`, whose control points follow from the
    velocities. At the points it is C¹: the acceleration jumps. In flat space it is SciPy's ``CubicHermiteSpline``.

    Args:
        t: times of the points, increasing: None for 0, 1, …, N, shape (N+1,), or (..., N+1) with one row per curve.
            Numbers or ``datetime64``; for dates velocities are per second.
        points: shape (..., N+1, *space.point_shape), N >= 1; leading axes are independent curves. For a `Product` a
            tuple of arrays.
        velocities: γ' at the points, tangent vectors of the shape of the points. Those of rotations are made of
            angular velocities by `symspline.rotations.velocities`.
        space: a space or its name.
        extrapolate: what happens outside the knots: None raises, True continues the last segment, ``"geodesic"`` goes
            on with constant velocity, ``"periodic"`` wraps.

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

    def __init__(
        self,
        t: ArrayLike | None,
        points: Any,
        velocities: Any,
        space: Space | str,
        *,
        extrapolate: bool | str | None = None,
    ) -> None:
        space = space_named(space)
        policy = checked_policy(extrapolate)
        data = read(points, space)
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

    def _fill(self, clock: Clock, t: Array, curve: Curve, extrapolate: Any) -> None:
        self._clock, self._t, self._curve, self._extrapolate = clock, t, curve, extrapolate

    @classmethod
    def _of(cls, *parts: Any) -> Self:
        """A curve that was checked before, from all that it keeps."""
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
        progress: Progress | None = None,
    ) -> Any:
        """The curve at times x, as calling a `CubicSpline`; at knots ``nu=2`` is that of the segment that begins there,
        at the last knot of the one that ends."""
        if progress is not None:
            check_progress(progress)
        where = self._where(extrapolate)
        return evaluated(self._curve, self._clock, x, quantity_of(nu), where, per_curve, progress)

    def speed(self, x: ArrayLike, *, extrapolate: bool | str | None = None, per_curve: bool = False) -> Any:
        """|γ'| at times x, shape batch axes + x.shape."""
        where = self._where(extrapolate)
        return evaluated(self._curve, self._clock, x, "speed", where, per_curve, None)[()]

    def length(self) -> Any:
        """Length of the curve from first to last knot, ∫ |γ'| dt; shape of the batch axes."""
        curve = self._curve
        return integrate(curve.times, lambda x: curve.evaluate(x, "speed", "raise", True), curve.batch)

    def _where(self, extrapolate: Any) -> str:
        """What happens outside the knots, as the core calls it."""
        policy = self._extrapolate if extrapolate is None else checked_policy(extrapolate)
        return outside(policy, "natural")

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
        """The velocities at the knots, the shape of the points."""
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
    def extrapolate(self) -> Any:
        """What happens outside the knots, as it was given."""
        return self._extrapolate

    # ---- a batch as a sequence ----

    def __len__(self) -> int:
        if not self._curve.batch:
            raise TypeError("this is one curve; only a batch of curves has a length (see also .length())")
        return self._curve.batch[0]

    def __getitem__(self, index: Any) -> HermiteSpline:
        """A curve, or a slice of curves, of a batch."""
        if not self._curve.batch:
            raise TypeError("this is one curve; only a batch of curves can be indexed")
        if not isinstance(index, (int, np.integer, slice)):
            raise TypeError(f"a curve is picked by a whole number or a slice, not {shown(index)}")
        t = self._t[index] if self._curve.times.ndim > 1 else self._t
        return HermiteSpline._of(self._clock.picked(index), t, self._curve.picked(index), self._extrapolate)

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator[HermiteSpline]:
        return (self[i] for i in range(len(self)))

    # ---- as a value ----

    def __eq__(self, other: object) -> bool:
        """Equal space, knots, points and velocities, to the last bit."""
        if not isinstance(other, HermiteSpline):
            return NotImplemented
        return (
            self.space == other.space
            and self._t.dtype == other._t.dtype
            and np.array_equal(self._t, other._t)
            and all(
                np.array_equal(a.points, b.points) and np.array_equal(a.velocities, b.velocities)
                for a, b in zip(self._curve.parts, other._curve.parts, strict=True)
            )
        )

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return HermiteSpline._of, (self._clock, self._t, self._curve, self._extrapolate)

    def __repr__(self) -> str:
        batch = self._curve.batch
        curves = f"{' x '.join(map(str, batch))} curves, " if batch else ""
        return f"<HermiteSpline on {self.space!r}: {curves}{self._curve.times.shape[-1]} points>"

    def plot(self, file: Any = None) -> Figure:
        """A figure as that of `CubicSpline.plot`.

        Raises:
            ImportError: matplotlib is not installed.
        """
        if find_spec("matplotlib") is None:
            raise ImportError("plots need matplotlib; install it with: pip install 'symspline[plot]'")
        from .plotting import plot

        return plot(self, file)


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

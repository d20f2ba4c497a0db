"""Curves made of other curves: with other times, and one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from types import GenericAlias
from typing import TYPE_CHECKING, Any, Generic, Literal, Self, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import short_repr
from .._base.time import TimeAxis
from .._base.typing import Array, FloatArray, P, State, Time
from .._core import ValidationError
from .._curves.composed import Affine, Joined, Retimed, TimeMap, part_of_times
from .._curves.curve import UncertaintyBand
from .._spaces import Doubles
from .archive import Entries, entry, head_of, read_times, restore, times_state
from .base import Curve, UserCurve

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    # The class of the segments.
    C = TypeVar("C", bound=UserCurve, covariant=True, default=UserCurve)
else:
    from typing import TypeVar

    C = TypeVar("C", covariant=True)


# Differences of values that are equal up to rounding.
_EQUAL = 1e-9
# Domains that overlap by rounding, in units in the last place.
_ROUNDING = 4


class RetimedCurve(Curve[P]):
    """A curve at other times.

    The methods `Curve.restrict`, `Curve.reverse`, `Curve.shift` and `Curve.retime` return curves of this class. It
    evaluates the original curve, so that its points and derivatives are exact.

    See Also
    --------
    Curve.retime : Return the same path with another time law.
    Curve.restrict : Return the part of a curve between two times.

    Notes
    -----
    Curves with a general time law are not saved; the law is a function. They can be pickled if the law can be.

    Examples
    --------
    >>> import symspline as ss
    >>> quarter = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], "sphere:2")
    >>> part = quarter.restrict(0.25, 0.5)
    >>> part
    <RetimedCurve on Sphere(2): from 0.25 to 0.5>
    >>> round(float(part.length()), 8)
    0.39269908
    """

    _format = "symspline-retimed"
    _kind = "Retimed curve"
    _curve: Retimed
    _source: Curve[P]

    def __init__(self) -> None:
        raise TypeError("RetimedCurve has no public constructor. Call restrict, reverse, shift or retime of a curve.")

    @classmethod
    def _of(cls, source: Curve[P], time_axis: TimeAxis, law: TimeMap, times: Doubles) -> Self:
        """Return a curve at times of another time axis, which a law maps to those of the source."""
        self = cls.__new__(cls)
        self._source, self._time_axis, self._curve = source, time_axis, Retimed(source._curve, law, times)
        return self

    def _made_of(self, radius: float | None = None) -> str:
        return self._span_text

    @property
    def _unconverged(self) -> int:
        return self._source._unconverged

    @property
    def _rate_limits(self) -> list[tuple[float, float]]:
        # Of the law that `time_law` returns; other laws are functions.
        law = getattr(self._curve.law, "function", None)
        return [*zip(getattr(law, "max_speed", ()), getattr(law, "max_acceleration", ()), strict=True)]

    @property
    def _node_times(self) -> Doubles:
        given = self._source._node_times
        times = self._curve.times
        if not len(given):
            return times[:0]
        at = np.asarray(self._curve.law(times))
        after = np.clip(np.searchsorted(given, at), 1, len(given) - 1)
        apart = np.minimum(abs(at - given[after - 1]), abs(at - given[after]))
        kept: Doubles = times[apart <= _ROUNDING * np.spacing(np.abs(given).max() + np.ptp(given))]
        return kept

    def _restricted(self, start: Doubles, stop: Doubles) -> Self:
        times = part_of_times(self._curve.times, start, stop, self._batch)
        return self._of(self._source, self._time_axis, self._curve.law, times)

    def _picked(self, index: Any) -> Self:
        times, law = self._curve.times, self._curve.law
        if isinstance(law, Affine) and np.ndim(law.offset):
            law = Affine(law.sign, law.offset[index])
        times_of_picked = times[index] if times.ndim > 1 else times
        return self._of(self._source[index], self._time_axis.take_batch(index), law, times_of_picked)

    def _state(self) -> State:
        law: Any = self._curve.law
        if isinstance(law, Affine):
            law = {"sign": law.sign, "offset": np.asarray(law.offset)}
        origin = np.atleast_1d(0.0 if self._time_axis.plain else self._time_axis.origin)
        axis = {"plain": self._time_axis.plain} | times_state("t", origin, self._time_axis)
        return head_of(self) | axis | {"law": law, "knots": self._curve.times, "0": self._source._state()}

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        source, law, times = restore(state["0"]), state["law"], state["knots"]
        with entry("law"):
            if isinstance(law, dict):
                offset = np.asarray(law["offset"], np.float64)
                law = Affine({-1: -1, 1: 1}[law["sign"]], offset if offset.ndim else float(offset))
        time_axis, origin = read_times(state, "t")
        time_axis = replace(time_axis, origin=None if state["plain"] else origin if np.ndim(times) > 1 else origin[0])
        with entry("knots"):
            if not (np.isfinite(times).all() and (np.diff(times) >= 0).all() and times.shape[-1] > 1):
                raise ValidationError("the times do not increase")
            curve = cls._of(source, time_axis, law, times)
            curve._curve.evaluate(times, "point", "raise", times.ndim > 1)
        return curve

    def __eq__(self, other: object) -> bool:
        """Whether both are the same curve at the same times."""
        if not isinstance(other, RetimedCurve):
            return NotImplemented
        return (
            self._source == other._source
            and np.array_equal(np.asarray(self.domain), np.asarray(other.domain))
            and self._curve.law == other._curve.law
            and np.array_equal(self._curve.times, other._curve.times)
        )


class SegmentedCurve(Curve[P], Generic[P, C]):
    """Curves one after the other, with gaps between them.

    This is one function of time and a sequence of its segments. It is NaN in the gaps, where there are no data.
    `fit_segments` returns it for a recording with gaps.

    Parameters
    ----------
    curves : sequence of Curve
        The segments, in the order of time, on one space. A segment must not begin before the previous one ends. They
        may be batches of curves that share their times, with equal batch axes.
    extrapolate : {None, "raise", False}, default None
        Extrapolation policy for times before the first and after the last segment. None and ``"raise"`` raise
        `ValidationError`, False gives NaN.

    Raises
    ------
    ValidationError
        If there are no curves, or they do not meet the requirements above.

    See Also
    --------
    fit_segments : Fit a recording with gaps, one curve per segment.
    Curve.concatenate : Join two curves that meet.

    Notes
    -----
    Where two segments meet, the result has the values of the later one. Lengths and bending energies are sums over the
    segments.

    Examples
    --------
    >>> import symspline as ss
    >>> morning = ss.CubicSpline([0, 1, 2], [[0.0], [1.0], [4.0]], "r:1")
    >>> noon = ss.CubicSpline([14, 15], [[0.0], [3.0]], "r:1")
    >>> day = ss.SegmentedCurve([morning, noon])
    >>> day([1.0, 5.0, 14.5])[:, 0]
    array([1. , nan, 1.5])
    >>> len(day), day[1] is noon
    (2, True)
    """

    _format = "symspline-segments"
    _kind = "Segmented curve"
    _curve: Joined

    def __init__(self, curves: Sequence[C], *, extrapolate: Literal["raise", False] | None = None) -> None:
        segments = _checked_segments(curves)
        time_axis = segments[0]._time_axis
        offsets = [_offset(segment._time_axis, time_axis) for segment in segments]
        joined = Joined([segment._curve for segment in segments], offsets)
        _check_order(segments, joined)
        self._segments: tuple[C, ...] = segments
        self._time_axis, self._curve = time_axis, joined
        self._extrapolate, self._extrapolation_mode = extrapolate, self._where(extrapolate)

    def _in_segments(self) -> Sequence[Curve[P]]:
        return self._segments

    def _of_segments(self, segments: Any) -> Self:
        """Return other segments with the same extrapolation policy."""
        policy: Any = self._extrapolate
        return type(self)(segments, extrapolate=policy)

    @property
    def gaps(self) -> list[tuple[Time, Time]]:
        """Pairs of times between which there is no segment."""
        ends = [segment.domain for segment in self._segments]
        return [(a[1], b[0]) for a, b in pairwise(ends) if b[0] > a[1]]

    def _made_of(self, radius: float | None = None) -> str:
        kind, *others = {segment._kind for segment in self._segments}
        # C² spline, B-spline and Bézier curve are names.
        kind = f"{kind[0].lower()}{kind[1:]}" if kind.startswith(("Smoothing", "Piecewise")) else kind
        return f"{len(self)} segments" if others else f"{len(self)} segments ({kind})"

    @property
    def _unconverged(self) -> int:
        return sum(segment._unconverged for segment in self._segments)

    @property
    def _node_times(self) -> Doubles:
        pairs = zip(self._segments, self._curve.offsets, strict=True)
        return np.unique(np.concatenate([segment._node_times + offset for segment, offset in pairs]))

    def _noise_beside(self, index: tuple[int, ...], x: Doubles) -> UncertaintyBand | None:
        """Return the noisy data of all segments, and the bands at times x outside gaps, in increasing order."""
        offsets = self._curve.offsets
        parts = np.split(x, np.searchsorted(x, self._curve.starts[1:]))
        bands = [
            segment._noise_beside(index, part - offset)
            for segment, part, offset in zip(self._segments, parts, offsets, strict=True)
        ]
        known = [segment for segment in bands if segment is not None]
        return UncertaintyBand.joined(known, offsets) if len(known) == len(bands) else None

    @property
    def _breaks(self) -> Doubles:
        return np.stack([self._curve.stops[:-1], self._curve.starts[1:]], axis=1)

    if not TYPE_CHECKING:
        # The class of the segments may be omitted at run time, too.
        __class_getitem__ = classmethod(GenericAlias)

    def __len__(self) -> int:
        """Return the number of segments."""
        return len(self._segments)

    @overload  # type: ignore[override]
    def __getitem__(self, index: int | np.integer) -> C: ...
    @overload
    def __getitem__(self, index: slice) -> SegmentedCurve[P, C]: ...
    def __getitem__(self, index: object) -> Any:
        """Return one segment, or the curve of several consecutive ones."""
        if isinstance(index, slice):
            return self._of_segments(self._segments[index])
        if not isinstance(index, (int, np.integer)):
            raise TypeError(f"the index of a segment must be an integer or a slice, not {short_repr(index)}")
        if not -len(self) <= index < len(self):
            raise IndexError(f"index {short_repr(index)} is out of range: there are {len(self)} segments")
        return self._segments[index]

    def closest(
        self, points: ArrayLike | tuple[ArrayLike, ...], *, per_curve: bool = False
    ) -> tuple[Time, FloatArray | float]:
        # Points in the gaps are not defined.
        time, distance = (np.array(values) for values in self._segments[0].closest(points, per_curve=per_curve))
        for segment in self._segments[1:]:
            times, distances = segment.closest(points, per_curve=per_curve)
            nearer = np.asarray((distances < distance) | (np.isnan(distance) & ~np.isnan(distances)))
            np.copyto(time, times, where=nearer)
            np.copyto(distance, distances, where=nearer)
        return time[()], distance[()]

    def __iter__(self) -> Iterator[C]:  # type: ignore[override]
        return iter(self._segments)

    def extrema(
        self,
        function: Literal["speed", "acceleration"] | Callable[[Any], Any] = "speed",
        *,
        kind: Literal["max", "min"] = "max",
    ) -> tuple[Array, NDArray[np.float64]]:
        pairs = [segment.extrema(function, kind=kind) for segment in self._segments]
        times = np.concatenate([segment[0] for segment in pairs])
        values = np.concatenate([segment[1] for segment in pairs])
        sign = 1 if kind == "max" else -1
        # Where two segments meet, their ends are extrema of the whole only if both are, or if there is a jump.
        kept = np.ones(len(times), bool)
        for t, *beside in self._meetings:
            here = np.arange(*(np.searchsorted(times, t, side) for side in ("left", "right")))
            value = [np.asarray(_at(segment, function, t)) for segment in beside]
            if len(here) == 2:
                kept[here[int(sign * values[here[0]] >= sign * values[here[1]])]] = False
            elif len(here) == 1 and not sign * values[here[0]] > sign * min(value, key=lambda x: sign * x) + _EQUAL:
                kept[here] = False
        return times[kept], values[kept]

    def solve(self, function: Literal["speed", "acceleration"] | Callable[[Any], Any], value: float = 0.0) -> Array:
        crossings = [segment.solve(function, value) for segment in self._segments]
        jumps = []
        for t, *beside in self._meetings:
            left, right = (float(np.asarray(_at(segment, function, t))) - value for segment in beside)
            if left * right < 0:
                jumps.append(np.asarray(t)[None])
        return np.unique(np.concatenate([*crossings, *jumps]))

    @property
    def _meetings(self) -> list[tuple[Any, UserCurve, UserCurve]]:
        """Times at which a segment begins where the previous one ends, with both segments."""
        pairs = pairwise(self._segments)
        return [(b.domain[0], a, b) for a, b in pairs if b.domain[0] == a.domain[1]]

    def _picked(self, index: Any) -> Self:
        return self._of_segments([segment[index] for segment in self._segments])

    def _restricted(self, start: Doubles, stop: Doubles) -> Curve[P]:
        kept: list[Any] = []
        for segment, offset in zip(self._segments, self._curve.offsets, strict=True):
            first, last = segment._curve.times[[0, -1]] + offset
            if max(first, start) < min(last, stop):
                ends = (np.asarray(max(first, start) - offset), np.asarray(min(last, stop) - offset))
                kept.append(segment if start <= first and last <= stop else segment._restricted(*ends))
        if not kept:
            raise ValidationError("there is no segment between a and b, which are in one gap")
        return self._of_segments(kept)

    def _reversed(self) -> Curve[P]:
        first, last = (np.asarray(end)[()] for end in self.domain)
        turned = []
        for segment in reversed(self._segments):
            start, stop = (np.asarray(end)[()] for end in segment.domain)
            turned.append(segment._reversed()._shifted((first - start) + (last - stop)))
        return self._of_segments(turned)

    def _shifted(self, step: Any) -> Curve[P]:
        return self._of_segments([segment._shifted(step) for segment in self._segments])

    def _state(self) -> State:
        return (
            head_of(self)
            | {"extrapolate": self._extrapolate}
            | {str(i): segment._state() for i, segment in enumerate(self._segments)}
        )

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        segments = [restore(state[str(i)]) for i in range(sum(name.isdigit() for name in state))]
        return state.read("extrapolate", lambda policy: cls(segments, extrapolate=policy))

    def __eq__(self, other: object) -> bool:
        """Whether all segments are equal."""
        return self._segments == other._segments if isinstance(other, SegmentedCurve) else NotImplemented

    @property
    def _counts(self) -> str:
        return f"{len(self)} segments, "


def _at(curve: UserCurve, function: Any, t: ArrayLike) -> Any:
    """Return a quantity of a segment at a time, as `Curve.extrema` names it."""
    if callable(function):
        return np.asarray(function(np.asarray(t)[None]))[0]
    return curve._curve.evaluate(
        curve._core_times(t, "x")[0], {"speed": "speed"}.get(function, "bend"), "continue", False
    )


def _checked_segments(curves: Any) -> tuple[Any, ...]:
    if isinstance(curves, Curve) or not isinstance(curves, Iterable):
        raise TypeError(f"curves must be a sequence of curves, not {short_repr(curves)}")
    segments = tuple(curves)
    if not segments:
        raise ValidationError("curves is empty; pass at least one curve")
    first = segments[0]
    for i, segment in enumerate(segments):
        if not isinstance(segment, Curve):
            raise TypeError(f"curves[{i}] must be a curve, not {short_repr(segment)}")
        if segment.space != first.space:
            raise ValidationError(f"curves[{i}] is on {segment.space!r}, but curves[0] is on {first.space!r}")
        if segment._batch != first._batch:
            raise ValidationError(f"curves[{i}] has batch axes {segment._batch}, but curves[0] has {first._batch}")
        if segment._curve.times.ndim > 1:
            raise ValidationError(
                f"curves[{i}] is a batch whose curves have their own times. Make one SegmentedCurve per curve."
            )
        if (segment._time_axis.dates, segment._time_axis.zone) != (first._time_axis.dates, first._time_axis.zone):
            raise ValidationError(
                f"curves[{i}] has times of another kind than curves[0]. Use numbers for all, or dates for all, with or "
                "without a time zone."
            )
    return segments


def _offset(time_axis: TimeAxis, reference: TimeAxis) -> float:
    """Return the origin of a time axis as a number of another one."""
    if time_axis.plain and reference.plain:
        return 0.0
    if reference.dates:
        return float(reference.knots(np.asarray(time_axis.origin)))
    # Differences of integers are exact.
    return float((0 if time_axis.plain else time_axis.origin) - (0 if reference.plain else reference.origin))


def _check_order(segments: Sequence[Any], joined: Joined) -> None:
    """Raise ValidationError if a segment begins before the previous one ends."""
    for i in range(1, len(segments)):
        stop, start = joined.stops[i - 1], joined.starts[i]
        if start < stop - _ROUNDING * np.spacing(max(abs(start), abs(stop))):
            raise ValidationError(
                f"curves[{i}] begins at {segments[i].domain[0]}, before curves[{i - 1}] ends at "
                f"{segments[i - 1].domain[1]}. Sort the curves by time, or restrict them."
            )

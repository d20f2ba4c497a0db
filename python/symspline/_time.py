"""Times as a user gives them, and as plain doubles in the core."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._arrays import as_array, cast
from ._core import ValidationError
from ._input import NO_ZONE, UTC_ZONE, times_of
from ._typing import TimesLike

Doubles = NDArray[np.float64]

# Integers up to here are exact as doubles.
_EXACT = 2**53
_SECONDS = {
    "W": 604800.0, "D": 86400.0, "h": 3600.0, "m": 60.0, "s": 1.0,
    "ms": 1e3, "us": 1e6, "ns": 1e9, "ps": 1e12, "fs": 1e15, "as": 1e18,
}  # fmt: skip
_DOUBLE = np.dtype(np.float64)
# Units in the last place that are rounding of one sum or difference and of the end itself.
_ROUNDING = 4
_MULTIPLES = ("W", "D", "h", "m", "s")


class Moments(NamedTuple):
    """Times of a user that were read before.

    Attributes:
        times: as NumPy has them.
        zone: what was known of their zone, see `_input.times_of`.
    """

    times: Any
    zone: str | None


@dataclass(frozen=True)
class TimeAxis:
    """How times become doubles.

    Numbers are taken as they are. Dates become seconds, and integers too large for a double
    differences, since the first knot of each curve: ``origin``, of shape batch + (1,) where curves
    have their own knots. Durations are seconds. ``zone`` is that of dates, see `_input.times_of`.
    """

    origin: Any = None
    dates: bool = False
    durations: bool = False
    zone: str | None = None

    @cached_property
    def plain(self) -> bool:
        """Whether times are taken as they are."""
        return self.origin is None

    def knots(self, knots: NDArray[Any]) -> Doubles:
        """Knots as the core counts them."""
        return self._doubles(knots, self.origin, "t")

    def at(
        self, x: TimesLike, batch: tuple[int, ...], per_curve: bool, knots: Doubles | None = None
    ) -> tuple[Doubles, bool]:
        """Times to evaluate at, and whether every curve now has its own.

        Parameters
        ----------
        x : array_like
            Times as a user gives them.
        batch : tuple of int
            The batch axes of the curves.
        per_curve : bool
            Whether the leading axes of x are the batch axes.
        knots : ndarray, optional
            Knots as the core counts them. Numbers that lie beyond the first or last one by rounding become that knot.
        """
        given, zone = times_of(x, "x")
        array = as_array(given, "x")
        if {zone, self.zone} == {UTC_ZONE, NO_ZONE}:
            here, there = ("a time zone", "none") if zone == UTC_ZONE else ("no time zone", "one")
            raise ValidationError(
                f"x has {here}, but the knots have {there}: which time is meant is in doubt; pass both with a zone, or "
                "both without"
            )
        if self.durations and array.dtype.kind == "m":
            array = _durations(array, "x")
        if array.dtype.kind not in ("M" if self.dates else "iufb"):
            wanted = "dates, so x must be datetime64" if self.dates else "numbers, so x must be numbers"
            raise ValidationError(f"the knots are {wanted}, not {array.dtype}")
        if np.ndim(self.origin) == 0:
            times = self._doubles(array, self.origin, "x")
        else:
            # Every curve counts from its own first knot.
            own = array.shape[len(batch) :] if per_curve else array.shape
            origin = self.origin.reshape(batch + (1,) * len(own))
            times, per_curve = self._doubles(np.broadcast_to(array, batch + own), origin, "x"), True
        if knots is None or array.dtype.kind != "f":
            return times, per_curve
        return onto_ends(times, knots, batch, per_curve, array.dtype, 0.0 if self.dates else self.origin)

    def take_batch(self, index: Any) -> TimeAxis:
        """The time axis of some curves of a batch."""
        return replace(self, origin=self.origin[index][()]) if np.ndim(self.origin) else self

    def _doubles(self, array: NDArray[Any], origin: Any, name: str) -> Doubles:
        if self.dates:
            return _seconds(array, origin, name)
        if origin is not None:
            array = _difference(array, origin) if array.dtype.kind in "iub" else array - np.float64(origin)
        return cast(array)

    def explain(self, error: ValidationError) -> ValidationError:
        """The error, saying from where its times are counted."""
        if self.origin is None:
            return error
        since = np.ravel(self.origin)[0]
        what = "seconds" if self.dates else "differences"
        more = "" if np.ndim(self.origin) == 0 else " (the first curve; the others from their own first time)"
        return error._with_message(f"{error}; times are {what} since {since}{more}")


# The axis of times that are taken as they are.
_NUMBERS = TimeAxis()


def time_axis_of(knots: TimesLike | Moments) -> tuple[TimeAxis, NDArray[Any]]:
    """The time axis for some knots, and the knots as `CubicSpline.t` shows them."""
    given: Any
    given, zone = knots if isinstance(knots, Moments) else times_of(knots, "t")
    array = as_array(given, "t")
    if array.size == 0 and (array.ndim < 2 or array.shape[-1] == 0):
        raise ValidationError("t is empty; a curve needs at least two points")
    first = array[..., :1] if array.ndim > 1 else array.flat[0]
    if array.dtype.kind == "M":
        if np.datetime_data(array.dtype)[0] in ("Y", "M", "generic"):
            array = array.astype("datetime64[D]")
            first = first.astype("datetime64[D]")
        return TimeAxis(np.array(first)[()], dates=True, zone=zone), array.copy()
    if array.dtype.kind == "m":
        return TimeAxis(durations=True), _durations(array, "t")
    if array.dtype.kind in "iu" and array.size and (int(array.max()) > _EXACT or int(array.min()) < -_EXACT):
        return TimeAxis(np.array(first)[()]), array.copy()
    if array.dtype.kind not in "iufb":
        raise ValidationError(f"t must be numbers or datetime64, not {array.dtype}")
    return TimeAxis(), cast(array.copy())


def knots_of(
    t: TimesLike | None, batch: tuple[int, ...], nodes: int
) -> tuple[TimeAxis, NDArray[Any], Doubles]:
    """The time axis of curves with so many knots each, the knots as shown, and as the core counts them."""
    if t is None:
        knots = np.arange(nodes, dtype=np.float64)
        return TimeAxis(), knots, knots
    if type(t) is np.ndarray and t.dtype == np.float64 and t.shape == (nodes,):
        # What most programs pass.
        knots = t.copy()
        return _NUMBERS, knots, knots
    time_axis, shown = time_axis_of(t)
    if shown.shape != (nodes,) and shown.shape != (*batch, nodes):
        own = f" or {(*batch, nodes)}" if batch else ""
        raise ValidationError(f"t has shape {shown.shape}, but {nodes} points a curve need {(nodes,)}{own}")
    return time_axis, shown, time_axis.knots(shown)


def onto_ends(
    x: Doubles,
    knots: Doubles,
    batch: tuple[int, ...],
    per_curve: bool,
    dtype: np.dtype[Any] = _DOUBLE,
    origin: Any = None,
) -> tuple[Doubles, bool]:
    """Times, where those beyond the first or last knot by rounding are that knot.

    The last of ``t0 + (t1 - t0) * np.linspace(0, 1, n)`` is often one unit in the last place after ``t1``. A few units
    of the larger end are taken as rounding, in the precision in which the times were given.

    Parameters
    ----------
    x, knots : ndarray
        Times and knots as the core counts them.
    batch, per_curve
        As for `TimeAxis.at`.
    dtype : dtype
        The type in which the times were given.
    origin : array_like, optional
        What was subtracted of times and knots.

    Returns
    -------
    times : ndarray
        They have the batch axes if the curves have ends of their own and one of them was met.
    per_curve : bool
        Whether they do.
    """
    ends = knots[..., 0], knots[..., -1]
    if (
        not (x.size and knots.size)
        or (x.min() >= ends[0].max() and x.max() <= ends[1].min())
        or np.isnan(x).any()
    ):
        return x, per_curve
    own = x.shape[len(batch) :] if per_curve else x.shape
    if per_curve and x.shape[: len(batch)] != batch:
        # An error that is found elsewhere.
        return x, per_curve
    if knots.ndim > 1:
        first, last = (end.reshape(batch + (1,) * len(own)) for end in ends)
        shift = np.reshape(origin, batch + (1,) * len(own)) if np.ndim(origin) else origin
    else:
        (first, last), shift = ends, origin
    size = np.maximum(np.abs(first), np.abs(last))
    if shift is not None:
        size = size + np.abs(np.asarray(shift, np.float64))
    # Of types wider than doubles only what doubles hold is left.
    kind = dtype.type if dtype.itemsize < 8 else np.float64
    with np.errstate(over="ignore", invalid="ignore"):
        reach = _ROUNDING * np.spacing(size.astype(kind)).astype(np.float64)
        before, behind = (x < first) & (x >= first - reach), (x > last) & (x <= last + reach)
    if not (before.any() or behind.any()):
        return x, per_curve
    found = np.where(before, first, np.where(behind, last, x))
    return np.asarray(found, order="C"), per_curve or found.ndim > x.ndim


def _difference(array: NDArray[Any], origin: Any) -> NDArray[np.int64]:
    """array − origin, exact for differences below 2**63 whatever the integer types: modulo 2**64."""
    modular = array.astype(np.uint64) - np.asarray(origin).astype(np.uint64)
    return modular.view(np.int64) if modular.ndim else modular.astype(np.int64)


def _seconds(array: NDArray[Any], origin: Any, name: str) -> Doubles:
    if np.isnat(array).any():
        index = np.argwhere(np.isnat(array))[0].tolist()
        raise ValidationError(f"{name}{index or ''} is NaT (not a time)")
    origin = np.asarray(origin)
    fine = np.promote_types(array.dtype, origin.dtype)
    exact = [x.astype(fine) for x in (array, origin)]
    if all(np.array_equal(e.astype(x.dtype), x) for e, x in zip(exact, (array, origin), strict=True)):
        difference = exact[0] - exact[1]
        # The difference itself may be too long for the finer unit.
        if np.array_equal(exact[1] + difference, exact[0]) and np.all(
            (difference >= 0) == (exact[0] >= exact[1])
        ):
            return _in_seconds(difference)
    # Times too far apart for their finer unit: whole days, and what is left of the day.
    days = [x.astype("datetime64[D]") for x in (array, origin)]
    rest = [_in_seconds(x - d) for x, d in zip((array, origin), days, strict=True)]
    return np.asarray(_in_seconds(days[0] - days[1]) + (rest[0] - rest[1]), order="C")


def _durations(array: NDArray[Any], name: str) -> Doubles:
    if np.isnat(array).any():
        index = np.argwhere(np.isnat(array))[0].tolist()
        raise ValidationError(f"{name}{index or ''} is NaT (not a time)")
    return _in_seconds(array)


def _in_seconds(difference: Any) -> Doubles:
    unit, step = np.datetime_data(difference.dtype)
    if unit not in _SECONDS:
        raise ValidationError(f"dates in units of {unit!r} have no fixed length; use days or finer")
    ticks = np.asarray(difference).astype(np.int64).astype(np.float64) * step
    # Dividing by a power of ten is rounded once; multiplying by 1e-9 would be twice.
    return np.asarray(ticks * _SECONDS[unit] if unit in _MULTIPLES else ticks / _SECONDS[unit], order="C")

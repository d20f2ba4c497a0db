"""Times of the user, also dates and durations, as floating-point numbers of the core."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import timedelta
from decimal import Decimal
from functools import cached_property
from math import ulp
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._core import ValidationError
from .arrays import as_array, cast, refuse, short_repr
from .faults import warn
from .input import NO_ZONE, UTC_ZONE, times_of
from .typing import Array, TimesLike

Doubles = NDArray[np.float64]

# Integers up to this one are exact as floating-point numbers.
_EXACT = 2**53
_SECONDS = {
    "W": 604800.0, "D": 86400.0, "h": 3600.0, "m": 60.0, "s": 1.0,
    "ms": 1e3, "us": 1e6, "ns": 1e9, "ps": 1e12, "fs": 1e15, "as": 1e18,
}  # fmt: skip
_DOUBLE = np.dtype(np.float64)
# Rounding error of a sum or difference and of the end itself, in units in the last place.
_ROUNDING = 4
# Times rounded to this part of the mean step are inspected.
_FINE = 1e-6
_MULTIPLES = ("W", "D", "h", "m", "s")


class Moments(NamedTuple):
    """Times of the user after `input.times_of`.

    Attributes
    ----------
    times : array_like
        Times in a type of NumPy.
    zone : str or None
        Whether the times had a time zone; see `input.times_of`.
    """

    times: Any
    zone: str | None


@dataclass(frozen=True)
class TimeAxis:
    """Conversion of times to floating-point numbers.

    Numbers do not change, and durations become seconds. Dates become seconds since the first knot of each curve.
    Integers that are too large for exact floating-point numbers become differences from the first knot.

    Attributes
    ----------
    origin : scalar, ndarray or None
        First knot, of shape batch + (1,) if each curve has its own knots. None if times are not differences.
    dates, durations : bool
        Whether times are dates, or durations.
    zone : str or None
        Whether dates had a time zone; see `input.times_of`.
    """

    origin: Any = None
    dates: bool = False
    durations: bool = False
    zone: str | None = None

    @cached_property
    def plain(self) -> bool:
        """Whether times have no origin."""
        return self.origin is None

    def knots(self, knots: Array) -> Doubles:
        """Convert knots to numbers of the core."""
        return self._doubles(knots, self.origin, "t")

    def at(
        self, x: TimesLike, batch: tuple[int, ...], per_curve: bool, knots: Doubles | None = None, name: str = "x"
    ) -> tuple[Doubles, bool]:
        """Convert sampling times to numbers of the core, and return whether each curve then has its own times.

        Parameters
        ----------
        x : array_like
            Times from the user.
        batch : tuple of int
            The batch axes of the curves.
        per_curve : bool
            Whether the leading axes of x are the batch axes.
        knots : ndarray, optional
            Knots as numbers of the core. A time that exceeds the first or last knot by rounding becomes that knot.
        name : str
            Name of the times in messages.
        """
        if self is _NUMBERS and type(x) is np.ndarray and x.dtype == np.float64:
            # The usual case takes few function calls.
            flags = x.flags
            if flags.c_contiguous and flags.aligned:
                return (x, per_curve) if knots is None else onto_ends(x, knots, batch, per_curve)
        given, zone = times_of(x, name)
        array = as_array(given, name)
        if {zone, self.zone} == {UTC_ZONE, NO_ZONE}:
            here, there = ("a time zone", "none") if zone == UTC_ZONE else ("no time zone", "one")
            raise ValidationError(
                f"{name} has {here}, but the knots have {there}; pass both with a time zone, or both without"
            )
        if self.durations and array.dtype.kind == "m":
            array = _durations(array, name)
        if array.dtype.kind not in ("M" if self.dates else "iufb"):
            required = f"dates, so {name} must be datetime64" if self.dates else f"numbers, so {name} must be numbers"
            raise ValidationError(f"the knots are {required}, not {array.dtype}")
        if np.ndim(self.origin) == 0:
            times = self._doubles(array, self.origin, name)
        else:
            # Times of each curve are differences from its own first knot.
            axes = array.shape[len(batch) :] if per_curve else array.shape
            origin = self.origin.reshape(batch + (1,) * len(axes))
            times, per_curve = self._doubles(np.broadcast_to(array, batch + axes), origin, name), True
        if knots is None or array.dtype.kind != "f":
            return times, per_curve
        return onto_ends(times, knots, batch, per_curve, array.dtype, 0.0 if self.dates else self.origin)

    def shown(self, x: Doubles, batch: tuple[int, ...]) -> Array:
        """Convert numbers of the core to times of the user, the inverse of `at`.

        Dates are in nanoseconds, or in the unit of the knots if it is finer, as long as they are in the range of this
        unit. NaN becomes NaT. Durations are numbers of seconds.

        Parameters
        ----------
        x : ndarray
            Times as numbers of the core, with the batch axes in front if each curve has its own origin.
        batch : tuple of int
            The batch axes of the curves.
        """
        if self.origin is None:
            return x
        origin = np.asarray(self.origin)
        if origin.ndim:
            origin = origin.reshape(batch + (1,) * (x.ndim - len(batch)))
        if not self.dates:
            return np.asarray(origin.astype(np.float64) + x)
        missing = np.isnan(x)
        reach = float(np.abs(x[~missing]).max(initial=0.0))
        for unit in ("ns", "us", "s"):
            fine = np.promote_types(origin.dtype, f"datetime64[{unit}]") if unit != "s" else np.dtype("datetime64[s]")
            start = origin.astype(fine)
            per_second = _SECONDS[np.datetime_data(fine)[0]]
            # Half of the range: the sum must not overflow either.
            fits = reach * per_second < 2.0**62 and np.abs(start.astype(np.int64)).max(initial=0) < 2**62
            if fits and np.array_equal(start.astype(origin.dtype), origin):
                break
        ticks = np.rint(np.where(missing, 0.0, x) * per_second).astype(np.int64)
        return np.where(
            missing, np.datetime64("NaT"), start + ticks.astype(f"timedelta64[{np.datetime_data(fine)[0]}]")
        )

    def take_batch(self, index: Any) -> TimeAxis:
        """Return the time axis of one curve or a slice of curves along the first batch axis."""
        return replace(self, origin=self.origin[index][()]) if np.ndim(self.origin) else self

    @contextmanager
    def explained(self) -> Iterator[None]:
        """Add to errors what their times are measured from."""
        try:
            yield
        except ValidationError as error:
            raise self.explain(error) from None

    def _doubles(self, array: Array, origin: Any, name: str) -> Doubles:
        if self.dates:
            return _seconds(array, origin, name)
        if origin is not None:
            array = _difference(array, origin) if array.dtype.kind in "iub" else array - np.float64(origin)
        return cast(array)

    def explain(self, error: ValidationError) -> ValidationError:
        """Add to an error what its times are measured from."""
        if self.origin is None:
            return error
        since = np.ravel(self.origin)[0]
        what = "seconds" if self.dates else "differences"
        more = "" if np.ndim(self.origin) == 0 else " (the first curve; the others from their own first time)"
        return error._with_message(f"{error}; times are {what} since {since}{more}")


# The time axis of numbers.
_NUMBERS = TimeAxis()


def time_axis_of(knots: TimesLike | Moments) -> tuple[TimeAxis, Array]:
    """Return the time axis of knots, and the knots as in `CubicSpline.t`."""
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


def knots_of(t: TimesLike | None, batch: tuple[int, ...], nodes: int) -> tuple[TimeAxis, Array, Doubles]:
    """Return the time axis, the knots as in `CubicSpline.t`, and the knots as numbers of the core."""
    if t is None:
        knots = np.arange(nodes, dtype=np.float64)
        return TimeAxis(), knots, knots
    if type(t) is np.ndarray and t.dtype == np.float64 and t.shape == (nodes,):
        # The usual case takes no further function call.
        knots = t.copy()
        first, last = knots.item(0), knots.item(nodes - 1)
        # Nearly always the mean step shows that times are precise enough.
        if ulp(max(abs(first), abs(last))) * nodes > _FINE * abs(last - first):
            warn_of_rounded_times(knots)
        return _NUMBERS, knots, knots
    time_axis, shown = time_axis_of(t)
    # Segments of a recording are checked as a whole.
    if time_axis.plain and not isinstance(t, Moments):
        warn_of_rounded_times(shown)
    if shown.shape != (nodes,) and shown.shape != (*batch, nodes):
        rows = f" or {(*batch, nodes)}" if batch else ""
        axis = batch.index(shown.size) if shown.ndim == 1 and shown.size in batch else None
        which = "first axis" if axis == 0 else f"axis {axis}"
        remedy = (
            f". The {which} of points has this length, but the axis of times must be the last one before those of a "
            f"point: pass np.moveaxis(points, {axis}, {len(batch)})."
        )
        raise ValidationError(
            f"t has shape {shown.shape}, but {nodes} points per curve need {(nodes,)}{rows}"
            + remedy * (axis is not None)
        )
    return time_axis, shown, time_axis.knots(shown)


def onto_ends(
    x: Doubles,
    knots: Doubles,
    batch: tuple[int, ...],
    per_curve: bool,
    dtype: np.dtype[Any] = _DOUBLE,
    origin: Any = None,
) -> tuple[Doubles, bool]:
    """Replace times that exceed the first or last knot by rounding by that knot.

    The last of ``t0 + (t1 - t0) * np.linspace(0, 1, n)`` is often one unit in the last place after ``t1``. A few units
    in the last place of the larger end count as rounding, in the precision of `dtype`.

    Parameters
    ----------
    x, knots : ndarray
        Times and knots as numbers of the core.
    batch, per_curve
        As for `TimeAxis.at`.
    dtype : dtype
        Type of the times of the user.
    origin : array_like, optional
        Origin that was subtracted from times and knots.

    Returns
    -------
    times : ndarray
        Times, with the batch axes if each curve has its own knots and a time was replaced.
    per_curve : bool
        Whether the times have the batch axes.
    """
    ends = knots[..., 0], knots[..., -1]
    if not (x.size and knots.size) or (x.min() >= ends[0].max() and x.max() <= ends[1].min()):
        return x, per_curve
    axes = x.shape[len(batch) :] if per_curve else x.shape
    if per_curve and x.shape[: len(batch)] != batch:
        # The evaluation raises an error for this shape.
        return x, per_curve
    first, last = ends_beside(knots, x, batch, per_curve)
    shift = np.reshape(origin, batch + (1,) * len(axes)) if knots.ndim > 1 and np.ndim(origin) else origin
    size = np.maximum(np.abs(first), np.abs(last))
    if shift is not None:
        size = size + np.abs(np.asarray(shift, np.float64))
    # Times in wider types were rounded to double precision.
    kind = dtype.type if dtype.itemsize < 8 else np.float64
    with np.errstate(over="ignore", invalid="ignore"):
        reach = _ROUNDING * np.spacing(size.astype(kind)).astype(np.float64)
        before, behind = (x < first) & (x >= first - reach), (x > last) & (x <= last + reach)
    if not (before.any() or behind.any()):
        return x, per_curve
    moved = np.where(before, first, np.where(behind, last, x))
    return np.asarray(moved, order="C"), per_curve or moved.ndim > x.ndim


def ends_beside(times: Doubles, x: Doubles, batch: tuple[int, ...], per_curve: bool) -> tuple[Any, Any]:
    """Return the first and the last time of the curves, in shapes that broadcast with times x."""
    first, last = times[..., 0], times[..., -1]
    if times.ndim == 1:
        return first, last
    ones = (1,) * (x.ndim - len(batch) if per_curve else x.ndim)
    return first.reshape(batch + ones), last.reshape(batch + ones)


def refuse_outside(
    times: Doubles, batch: tuple[int, ...], x: Doubles, per_curve: bool, name: str = "x", remedy: str = ""
) -> None:
    """Raise ValidationError unless all times x are finite and in the domain of the curves."""
    first, last = ends_beside(times, x, batch, per_curve)
    wrong = ~((x >= first) & (x <= last))

    def say(i: Any) -> str:
        time, *ends = (np.broadcast_to(values, wrong.shape)[i] for values in (x, first, last))
        where = f"outside the domain [{ends[0]}, {ends[1]}] of the curve" if np.isfinite(time) else "not finite"
        return f"= {time} is {where}{remedy}"

    refuse(wrong, name, say)


def _difference(array: Array, origin: object) -> NDArray[np.int64]:
    """Subtract integers modulo 2**64, which is exact for differences below 2**63 and all integer types."""
    modular = array.astype(np.uint64) - np.asarray(origin).astype(np.uint64)
    return modular.view(np.int64) if modular.ndim else modular.astype(np.int64)


def _seconds(array: Array, origin: object, name: str) -> Doubles:
    _refuse_missing(array, name)
    origin = np.asarray(origin)
    fine = np.promote_types(array.dtype, origin.dtype)
    exact = [x.astype(fine) for x in (array, origin)]
    if all(np.array_equal(e.astype(x.dtype), x) for e, x in zip(exact, (array, origin), strict=True)):
        difference = exact[0] - exact[1]
        # The difference itself may exceed the range of the finer unit.
        ahead = difference >= np.timedelta64(0)
        if np.array_equal(exact[1] + difference, exact[0]) and np.all(ahead == (exact[0] >= exact[1])):
            return _in_seconds(difference)
    # The times are too far apart for the finer unit, so days and times of day are subtracted separately.
    days = [x.astype("datetime64[D]") for x in (array, origin)]
    rest = [_in_seconds(x - d) for x, d in zip((array, origin), days, strict=True)]
    return np.asarray(_in_seconds(days[0] - days[1]) + (rest[0] - rest[1]), order="C")


def _refuse_missing(array: Array, name: str) -> None:
    remedy = "Remove missing entries, or pass skipna=True to a function that has this option."
    refuse(np.isnat(array), name, lambda _: f"is NaT (not a time). {remedy}")


def _durations(array: Array, name: str) -> Doubles:
    _refuse_missing(array, name)
    return _in_seconds(array)


def _in_seconds(difference: Any) -> Doubles:
    unit, step = np.datetime_data(difference.dtype)
    if unit not in _SECONDS:
        raise ValidationError(f"dates in units of {unit!r} have no fixed length; use days or finer")
    ticks = np.asarray(difference).astype(np.int64).astype(np.float64) * step
    # Division by a power of ten rounds once. Multiplication by 1e-9, which is itself rounded, would round twice.
    return np.asarray(ticks * _SECONDS[unit] if unit in _MULTIPLES else ticks / _SECONDS[unit], order="C")


# ---- durations: strings such as "3h", and the types of Python, NumPy and pandas ----

_TEXT = re.compile(r"(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+) ?([a-z]*)", re.IGNORECASE | re.ASCII)
NANOSECONDS = {
    "ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9,
    "min": 60 * 10**9, "h": 3600 * 10**9, "d": 24 * 3600 * 10**9,
}  # fmt: skip
# Other names of these units, in pandas and in everyday use.
_SAME = {
    "sec": "s", "second": "s", "minute": "min", "m": "min", "t": "min", "hr": "h", "hour": "h", "day": "d",
    "l": "ms", "millisecond": "ms", "u": "us", "microsecond": "us", "n": "ns", "nanosecond": "ns",
}  # fmt: skip


def parts_of_duration(text: str) -> tuple[Decimal, str] | None:
    """Split a text such as ``"10min"`` into 10 and ``"min"``; without a unit, the second entry is ``""``.

    Return None if the text is not a duration. Units can be words in the singular or plural.

    Raises
    ------
    decimal.InvalidOperation
        If an exponent is too large.

    Examples
    --------
    >>> parts_of_duration("2 hours"), parts_of_duration("soon")
    ((Decimal('2'), 'h'), None)
    """
    match = _TEXT.fullmatch(text.strip())
    if match is None:
        return None
    unit = match[2].lower()
    unit = unit if unit in NANOSECONDS else _SAME.get(unit, _SAME.get(unit.removesuffix("s"), unit))
    return (Decimal(match[1]), unit) if unit in ("", *NANOSECONDS) else None


def seconds_of(value: object, name: str, dates: bool = True) -> Any:
    """Convert a duration to seconds; numbers do not change.

    Parameters
    ----------
    value : object
        A text, ``timedelta``, ``timedelta64``, ``pandas.Timedelta``, or anything else, which is returned.
    name : str
        Name of the argument in messages.
    dates : bool
        Whether the times are dates or durations, so that units are allowed.

    Raises
    ------
    ValidationError
        If a text is not a duration, or the times are numbers without a unit.
    """
    if not isinstance(value, (str, timedelta, np.timedelta64)):
        return value
    if not dates:
        raise ValidationError(
            f"{name} is {short_repr(value)}, but the times are numbers. Pass a number in the unit of the times."
        )
    if not isinstance(value, str):
        # pandas.Timedelta has nanoseconds, which its base class timedelta lacks.
        step = getattr(value, "asm8", np.timedelta64(value))
        return np.nan if np.isnat(step) else float(step / np.timedelta64(1, "s"))
    try:
        parts = parts_of_duration(value)
    except ArithmeticError:
        parts = None
    if parts is None or not parts[1]:
        raise ValidationError(
            f"{name} is {short_repr(value)}, which is not a duration. Pass a number of seconds, a timedelta64, or a "
            f"text with a unit, such as '3h' or '10min'; units are {', '.join(NANOSECONDS)}."
        )
    return float(parts[0] * NANOSECONDS[parts[1]] / NANOSECONDS["s"])


# ---- times whose spacing in double precision is coarse ----

# Rounding of times, as a fraction of the time step, beyond which accelerations are affected.
_COARSE = 1e-4
REMEDY = (
    "Subtract the first time before the conversion to floating-point numbers, or pass integers or datetime64[ns], "
    "which are exact."
)


def warn_of_rounded_times(times: Array, name: str = "t", remedy: str = REMEDY) -> None:
    """Warn if the spacing of floating-point numbers is more than 1e-4 of the median time step.

    Whole numbers are exact and cause no warning. Accelerations depend on squares of time steps. Times in seconds since
    1970, which are rounded to 2.4e-7 s, therefore yield wrong accelerations at 1 kHz.
    """
    if times.dtype.kind != "f" or times.shape[-1:] < (2,) or not times.size:
        return
    kept = times[np.isfinite(times)]
    if not kept.size:
        return
    largest = kept[np.argmax(np.abs(kept))]
    spacing = float(np.spacing(np.abs(largest)))
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.abs(np.diff(times, axis=-1))
        steps = steps[(steps > 0) & (steps < np.inf)]
        step = float(np.median(steps)) if steps.size else np.inf
    if not spacing > _COARSE * step or np.array_equal(kept, np.rint(kept)):
        return
    warn(
        f"{name} near {largest:.9g} are rounded to multiples of {spacing:.2g} by the type {times.dtype}, which is "
        f"{spacing / step:.2g} of the time step {step:.3g}. Accelerations are wrong, and with coarser rounding also "
        f"velocities. {remedy}",
        UserWarning,
    )

"""Times in texts: numbers, ISO dates and durations; and times along a curve."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..handed import minutes_of
from .errors import Problem
from .numbers import is_number, numbers

Times = NDArray[Any]
Fail = Callable[[int, str], Problem]
"""Makes the problem of a row of a column from what was found there."""

# A date, with 0 for every digit.
_SHAPE = re.compile(
    r"0000-00-00"
    r"(?:(?P<mark>[T ])00:00(?P<seconds>:00(?:\.0{1,9})?)? ?(?P<zone>Z|[+-]00(?::?00)?)?)?"
)
# 2021-08-29, 29.8.2021, 8/29/21, 20210829T1655, 16:55, 29 Aug 2021, Aug 29, 2021
_MONTH = r"(?:jan|feb|mar|apr|may|jun|jul|aug|sep|oct|nov|dec)[a-z]*"
_DATE_LIKE = re.compile(
    r"\d{4}([-/.])\d{1,2}\1\d{1,2}(?!\d)|\d{1,2}([-/.])\d{1,2}\2(?:\d{4}|\d{2})(?!\d|\.\d)|\d{8}T\d{4}|\d{1,2}:\d{2}(?!\d)"
    rf"|\d{{1,2}}[-. ]*{_MONTH}[-. ,]*\d{{2}}|{_MONTH}[-. ]*\d{{1,2}}\b",
    re.IGNORECASE | re.ASCII,
)
_ZEROS = str.maketrans("123456789", "000000000")
# Whole numbers up to here are exact as doubles.
_EXACT = 2**53

_NANOSECONDS = {
    "ns": 1,
    "us": 10**3,
    "ms": 10**6,
    "s": 10**9,
    "min": 60 * 10**9,
    "h": 3600 * 10**9,
    "d": 86400 * 10**9,
}
_PACKED_DAY = re.compile(r"(19|20)\d\d(0[1-9]|1[0-2])(0[1-9]|[12]\d|3[01])", re.ASCII)
_DURATION = re.compile(r"(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+) ?([a-z]*)", re.IGNORECASE | re.ASCII)
_MOST = 10**9
# Exponents of doubles are smaller.
_EXPONENT = 400


# ---- columns ----


def parse_times(cells: list[str], fail: Fail) -> tuple[Times, bool]:
    """The times in a column: numbers if the first is one, else ISO dates.

    Returns:
        The times, and whether they had a Z or an offset and are now UTC.
    """
    cells = [cell.strip() for cell in cells]
    if "" in cells:
        raise fail(cells.index(""), "is empty")
    if cells and not is_number(cells[0]):
        return _dates(cells, fail)
    return _numbers(cells, fail), False


def _numbers(cells: list[str], fail: Fail) -> Times:
    try:
        values = numbers(cells)
    except ValueError:
        i = next(i for i, cell in enumerate(cells) if not is_number(cell))
        raise fail(
            i, f"holds {cells[i]!r}, but {cells[0]!r} before; all must be numbers, or all dates"
        ) from None
    if not np.isfinite(values).all():
        i = int(np.flatnonzero(~np.isfinite(values))[0])
        raise fail(i, f"holds {cells[i]!r}, which is no time")
    if np.abs(values).max(initial=0) > _EXACT:
        with suppress(ValueError, OverflowError):
            return np.array([int(cell) for cell in cells], dtype=np.int64)
    return values


def _dates(cells: list[str], fail: Fail) -> tuple[Times, bool]:
    shapes = [cell.translate(_ZEROS) for cell in cells]
    zones = {shape: _zone(shape, shapes, cells, fail) for shape in dict.fromkeys(shapes)}
    lengths = [len(cell) - zones[shape] for cell, shape in zip(cells, shapes, strict=True)]
    bodies = [cell[:length].rstrip() for cell, length in zip(cells, lengths, strict=True)]
    try:
        times = np.array(bodies, dtype="datetime64")
    except ValueError:
        i = next(i for i, body in enumerate(bodies) if not _is_date(body))
        raise fail(i, f"holds {cells[i]!r}, which is no date of the calendar") from None
    if not zones[shapes[0]]:
        return times, False
    offsets = [cell[length:] for cell, length in zip(cells, lengths, strict=True)]
    minutes = {offset: minutes_of(offset) for offset in set(offsets)}
    return times - np.array([minutes[offset] for offset in offsets], dtype="timedelta64[m]"), True


def _zone(shape: str, shapes: list[str], cells: list[str], fail: Fail) -> int:
    """The length of the Z or the offset at the end of dates of a shape, which must suit the first date."""
    match, first = _SHAPE.fullmatch(shape), _SHAPE.fullmatch(shapes[0])
    i = shapes.index(shape)
    if first is None or (match is None and not is_number(cells[i])):
        raise fail(i, f"holds {cells[i]!r}, not a time: write 0.5, 2021-08-29 or 2021-08-29T16:55:00Z")
    if match is None or _style(match) != _style(first):
        raise fail(i, f"holds {cells[i]!r}, but {cells[0]!r} before; write all times in the same way")
    return len(match["zone"] or "")


def _style(match: re.Match[str]) -> tuple[Any, ...]:
    """What the dates of a column have in common; fractions and offsets may differ."""
    return match["mark"], match["seconds"] is None, match["zone"] is None


def is_packed_day(cell: str) -> bool:
    """Whether a number looks like a day of these centuries: 20210829."""
    return _PACKED_DAY.fullmatch(cell.strip()) is not None


def is_date_like(text: str) -> bool:
    """Whether a text seems to be a date or a time of day, in any of the usual ways to write them."""
    return _DATE_LIKE.match(text.strip()) is not None


def _is_date(text: str) -> bool:
    try:
        np.datetime64(text)
    except ValueError:
        return False
    return True


# ---- times along a curve ----


def gap_of(longest: str, knots: Times) -> NDArray[np.bool_]:
    """Whether the steps between knots are longer than a duration such as ``"12h"``."""
    number, unit = _duration(longest, "--max-gap")
    if knots.dtype.kind == "M":
        seconds = number * _NANOSECONDS[unit or "s"] / _NANOSECONDS["s"]
        return np.diff(knots) / np.timedelta64(1, "s") > float(seconds)
    if unit:
        raise Problem(f"--max-gap {longest}: the times are numbers; give a gap without a unit")
    return np.diff(knots) > float(number)


def every(step: str, knots: Times) -> Times:
    """Times from the first to at most the last knot, one a step."""
    number, unit = _duration(step, "--every")
    if knots.dtype.kind == "M":
        delta = _timedelta(number * _NANOSECONDS[unit or "s"], step)
        start, stop = _ends_in(delta, knots)
        span = stop - start
        if delta.astype(span.dtype).astype(delta.dtype) != delta:
            # A step that overflows is longer than all that there is.
            return np.array([start])
        dates: Times = start + delta * np.arange(_count(span // delta, step))
        return dates
    if unit:
        raise Problem(f"--every {step}: the times of this curve are numbers; give a step without a unit")
    if knots.dtype.kind in "iu":
        if number != int(number):
            raise Problem(
                f"--every {step}: the times of this curve are large whole numbers; give a whole step"
            )
        whole = int(knots[-1]) - int(knots[0])
        count = _count(whole // int(number), step)
        # Modulo 2**64 all differences are exact.
        jump = np.uint64(min(int(number), whole))
        return (knots[:1].astype(np.uint64) + jump * np.arange(count, dtype=np.uint64)).astype(knots.dtype)
    length = float(number)
    if not 0 < length < float("inf"):
        raise Problem(f"--every {step}: that is too {'long' if length else 'short'}")
    # A step that divides the curve up to rounding reaches its end.
    count = _count((float(knots[-1]) - float(knots[0])) / length * (1 + 1e-12), step)
    times: Times = np.minimum(knots[0] + length * np.arange(count), knots[-1])
    return times


def spread(count: int, knots: Times) -> Times:
    """So many times from the first to the last knot at equal distances; dates to a microsecond."""
    if knots.dtype.kind == "f":
        return np.linspace(knots[0], knots[-1], count)
    dates = knots.dtype.kind == "M"
    start, stop = _ends_in(np.timedelta64(1, "us"), knots) if dates else (knots[0], knots[-1])
    span = stop - start
    steps = np.rint(np.linspace(0, span.astype(np.int64), count)).astype(np.int64).astype(span.dtype)
    times = np.append(start + steps[:-1], stop) if count > 1 else np.array([start])
    return _coarsest(times) if dates else times


def _ends_in(tick: Any, knots: Times) -> tuple[Any, Any]:
    """The first and the last date, as exact as the tick or more."""
    with suppress(OverflowError):
        start, stop = knots[0] + 0 * tick, knots[-1] + 0 * tick
        back = [end.astype(knots.dtype) for end in (start, stop)]
        # NumPy lets dates and differences overflow; only between some units it says so.
        if back == [knots[0], knots[-1]] and stop - start >= 0 * tick:
            return start, stop
    raise Problem(f"the dates from {knots[0]} to {knots[-1]} cannot be counted in units of {tick}")


def _coarsest(dates: Times) -> Times:
    """The same dates in seconds if they are whole seconds, else in the next finer unit that will do."""
    for unit in ("s", "ms", "us"):
        # Attoseconds cannot become seconds.
        with suppress(OverflowError):
            coarse = dates.astype(f"datetime64[{unit}]")
            if (coarse == dates).all():
                return coarse
    return dates


def _timedelta(nanoseconds: Decimal, step: str) -> Any:
    if nanoseconds < 1 or nanoseconds != int(nanoseconds):
        raise Problem(f"--every {step}: a step is a whole number of nanoseconds")
    unit = next(unit for unit in ("s", "ms", "us", "ns") if int(nanoseconds) % _NANOSECONDS[unit] == 0)
    try:
        return np.array(int(nanoseconds) // _NANOSECONDS[unit], dtype=f"timedelta64[{unit}]")[()]
    except OverflowError:
        raise Problem(f"--every {step}: that is too long") from None


def _count(steps: float, option: str) -> int:
    if steps >= _MOST:
        raise Problem(f"--every {option}: that makes {float(steps):.1e} samples of one curve")
    return int(steps) + 1


def _duration(text: str, option: str) -> tuple[Decimal, str]:
    """``"10min"`` is 10 and ``"min"``."""
    match = _DURATION.fullmatch(text.strip())
    if match is None or match[2].lower() not in ("", *_NANOSECONDS):
        raise Problem(
            f"{option} {text}: a duration is a number such as 0.5, or one with a unit such as 10min; "
            f"units are {', '.join(_NANOSECONDS)}"
        )
    try:
        number = Decimal(match[1])
    except InvalidOperation:
        raise Problem(f"{option} {text}: that is no number of any use") from None
    if number == 0:
        raise Problem(f"{option} {text}: it must be larger than zero")
    if abs(number.adjusted()) > _EXPONENT:
        raise Problem(f"{option} {text}: that is too {'long' if number > 1 else 'short'}")
    return number, match[2].lower()

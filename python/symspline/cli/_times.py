"""Numbers, dates and durations in text, and sampling times along a curve."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.durations import NANOSECONDS, parts_of_duration
from .._base.input import ISO_DATE, UTC_ZONE, shapes_of, times_of
from .._core import ValidationError
from ._messages import Problem, refuse

Times = NDArray[Any]
Fail = Callable[[int, str], Problem]
"""Makes the `Problem` of a row from a description of its cell."""

# 2021-08-29, 29.8.2021, 8/29/21, 20210829T1655, 16:55, 29 Aug 2021, Aug 29, 2021
_MONTH = r"(?:jan|feb|mar|apr|may|jun|jul|aug|sep|oct|nov|dec)[a-z]*"
_DATE_LIKE = re.compile(
    r"\d{4}([-/.])\d{1,2}\1\d{1,2}(?!\d)|\d{1,2}([-/.])\d{1,2}\2(?:\d{4}|\d{2})(?!\d|\.\d)|\d{8}T\d{4}|\d{1,2}:\d{2}(?!\d)"
    rf"|\d{{1,2}}[-. ]*{_MONTH}[-. ,]*\d{{2}}|{_MONTH}[-. ]*\d{{1,2}}\b",
    re.IGNORECASE | re.ASCII,
)
_PACKED_DAY = re.compile(r"(19|20)\d\d(0[1-9]|1[0-2])(0[1-9]|[12]\d|3[01])", re.ASCII)
_SECOND = 10**9
UNITS = ("s", "ms", "us", "ns")
EXACT = 2**53
"""Whole numbers up to here are exact as floating-point numbers."""
_MOST = 10**9
# Exponents of floating-point numbers are smaller.
_EXPONENT = 400


# ---- text ----


def is_number(text: str) -> bool:
    """Whether a text is a number, without the underscores and numerals of other scripts that Python accepts."""
    try:
        float(text)
    except ValueError:
        return False
    return _is_usual(text)


def numbers(texts: Sequence[str]) -> NDArray[np.float64]:
    """Convert texts to numbers; raise ValueError if one of them is not a number."""
    # Checking all characters takes little time compared with reading the numbers.
    if not _is_usual("".join(texts)) and not all(map(is_number, texts)):
        raise ValueError
    return np.fromiter(map(float, texts), np.float64, len(texts))


def _is_usual(text: str) -> bool:
    return "_" not in text and text.strip().isascii()


def number(text: str) -> float:
    """Read a number in an option."""
    return float(numbers([text])[0])


def option_numbers(text: str, option: str, positive: bool = False) -> Any:
    """Read the numbers in an option, finite and at least 0: one, or a tuple of several."""
    cells = text.split(",")
    refuse(f"{option} {text}: ", (not all(map(is_number, cells)), "give a number such as 0.1"))
    values = tuple(map(float, cells))
    bad = [value for value in values if not 0 <= value < math.inf]
    refuse(
        f"{option} {text}: ",
        (bad, f"{next(iter(bad), 0):g} is not a finite number >= 0"),
        (positive and 0 in values, "the standard deviation must be greater than 0"),
    )
    return values if len(values) > 1 else values[0]


def parse_times(cells: Sequence[str], fail: Fail) -> tuple[Times, bool]:
    """Read the times in a column: numbers if the first cell is one, otherwise ISO dates.

    Returns
    -------
    times : ndarray
        Numbers, or ``datetime64``.
    utc : bool
        Whether the dates had a Z or an offset. They are converted to UTC then.
    """
    style = _style(cells[0]) if cells else "number"
    if style == "number":
        with suppress(ValueError):
            return _numeric_times(cells, fail), False
    # Texts of one form have one style.
    alike = set(shapes_of(list(cells)))
    if style in (None, "number") or set(map(_style, alike)) != {style}:
        for i, own in enumerate(map(_style, cells)):
            if own is None and style != "number":
                raise fail(i, f"holds {cells[i]!r}, not a time: write 0.5, 2021-08-29 or 2021-08-29T16:55:00Z")
            if own != style:
                raise fail(i, f"holds {cells[i]!r}, but {cells[0]!r} before; write all times in the same way")
    try:
        times, zone = times_of(list(cells), "time")
    except ValidationError:
        i = next(i for i, cell in enumerate(cells) if not _is_date(cell))
        raise fail(i, f"holds {cells[i]!r}, which is not a date of the calendar") from None
    return times, zone == UTC_ZONE


def from_unix(times: Times, unit: str, cells: Sequence[str] | None, place: Callable[[int], str]) -> Times:
    """Return dates in UTC for numbers that count a unit since 1970; fractions in the text of cells are exact."""
    scale = NANOSECONDS[unit]
    whole = times if times.dtype.kind in "iu" else np.floor(times)
    limit = np.iinfo(np.int64).max // scale
    far = np.flatnonzero(np.abs(whole) > limit)
    if far.size:
        raise Problem(f"{place(int(far[0]))}: --unix {unit}: time {times[far[0]]} is too far from 1970; is it in ns?")
    if cells is not None and whole is not times:
        with suppress(InvalidOperation):
            exact = [int((Decimal(cell) * scale).to_integral_value()) for cell in cells]
            return np.array(exact, np.int64).astype("datetime64[ns]")
    # The accuracy of floating-point numbers is their spacing.
    digits = max(0, int(-np.log10(np.spacing(np.abs(times).max(initial=1.0))))) if whole is not times else 0
    fraction = np.rint(np.round((times - whole) * 1.0, digits) * scale).astype(np.int64)
    return np.asarray((whole.astype(np.int64) * scale + fraction).astype("datetime64[ns]"))


def _numeric_times(cells: Sequence[str], fail: Fail) -> Times:
    values = numbers(cells)
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise fail(int(bad[0]), f"holds {cells[bad[0]]!r}, which is not a time")
    if np.abs(values).max(initial=0) > EXACT:
        with suppress(ValueError, OverflowError):
            return np.array([int(cell) for cell in cells], dtype=np.int64)
    return values


def _style(cell: str) -> object:
    """Return the properties that all times of a column must share; fractions and offsets may differ."""
    match = ISO_DATE.fullmatch(cell)
    if match is not None and (len(match["body"]) > 10 or not match["zone"]):
        return match["body"][10:11], len(match["body"]) > 16, match["zone"] is None
    return "number" if is_number(cell) else None


def _is_date(cell: str) -> bool:
    try:
        times_of(cell, "time")
    except ValidationError:
        return False
    return True


def is_date_like(text: str) -> bool:
    """Whether a text seems to be a date or a time of day, in any of the usual ways to write them."""
    return _DATE_LIKE.match(text.strip()) is not None


def first_date(cells: Sequence[str]) -> bool:
    """Whether the first cell that looks like a date or a number looks like a date, such as 20210829."""
    first = next((cell for cell in cells if is_number(cell) or is_date_like(cell)), "")
    return is_date_like(first) or _PACKED_DAY.fullmatch(first.strip()) is not None


# ---- durations, and times along a curve ----


def longest_gap(text: str, dates: bool) -> float:
    """Read a duration such as ``"12h"``, in seconds, or in the unit of numeric times."""
    count, unit = _duration(text, "--max-gap")
    if unit and not dates:
        raise Problem(f"--max-gap {text}: the times are numbers; give a gap without a unit")
    return float(count * NANOSECONDS[unit or "s"] / _SECOND if dates else count)


def every(step: str, knots: Times) -> Times:
    """Return times from the first to the last knot, one per step.

    Dates are whole multiples of the step since 1970-01-01 in UTC, as those of `symspline.geo.resample`. Numbers start
    at the first knot.
    """
    count, unit = _duration(step, "--every")
    kind = knots.dtype.kind
    if unit and kind != "M":
        raise Problem(f"--every {step}: the times of this curve are numbers; give a step without a unit")
    if kind == "f":
        length = float(count)
        if not 0 < length < float("inf"):
            raise Problem(f"--every {step}: that is too {'long' if length else 'short'}")
        # The last sample is at the end if the step divides the curve up to rounding.
        samples = _samples((float(knots[-1]) - float(knots[0])) / length * (1 + 1e-12), step)
        return np.asarray(np.minimum(_equidistant(_decimal(knots[0]), Fraction(count), samples), knots[-1]))
    count *= NANOSECONDS[unit or "s"] if kind == "M" else 1
    whole = "of nanoseconds" if kind == "M" else "as the times are"
    refuse(f"--every {step}: ", (count != int(count), f"a step must be a whole number {whole}"))
    ends, jump = _in_ticks(knots, int(count)) if kind == "M" else (knots[[0, -1]], int(count))
    first, last = _integers(ends)
    start = -(-first // jump) * jump if kind == "M" else first
    samples = _samples((last - start) // jump, step) if start <= last else 0
    # A step that is longer than the time between the ends may not fit into 64 bits.
    return _after(start, np.uint64(min(jump, last - first)) * np.arange(samples, dtype=np.uint64), ends.dtype)


def _in_ticks(knots: Times, nanoseconds: int) -> tuple[Times, int]:
    """Return the ends and a step in the coarsest unit in which both are whole numbers."""
    unit = next(unit for unit in ("s", "ms", "us", "ns") if nanoseconds % NANOSECONDS[unit] == 0)
    ends = _in_unit(knots, unit)
    ticks = int(np.ones(1, f"datetime64[{unit}]").astype(ends.dtype).astype(np.int64)[0])
    return ends, nanoseconds // NANOSECONDS[unit] * ticks


def _integers(ends: Times) -> list[int]:
    found: list[int] = ends.astype(np.int64 if ends.dtype.kind == "M" else ends.dtype).tolist()
    return found


def spread(count: int, knots: Times) -> Times:
    """Return equidistant times from the first to the last knot, dates to a microsecond."""
    if knots.dtype.kind == "f":
        first, last = _decimal(knots[0]), _decimal(knots[-1])
        return _equidistant(first, (last - first) / max(count - 1, 1), count)
    dates = knots.dtype.kind == "M"
    ends = _in_unit(knots, "us") if dates else knots[[0, -1]]
    start, stop = _integers(ends)
    steps = np.rint(np.linspace(0, stop - start, count)[: count - 1]).astype(np.uint64)
    times = _after(start, np.append(steps, np.uint64(stop - start if count > 1 else 0)), ends.dtype)
    return _coarsest(times) if dates else times


def _decimal(time: Any) -> Fraction:
    """Return the shortest decimal number that reads back as a floating-point number."""
    return Fraction(repr(float(time)))


def _equidistant(first: Fraction, step: Fraction, count: int) -> NDArray[np.float64]:
    """Return the numbers ``first + i step`` for i < count, each rounded once from its exact value."""
    scale = math.lcm(first.denominator, step.denominator)
    start, jump = int(first * scale), int(step * scale)
    if max(abs(start) + abs(jump) * count, scale) <= EXACT:
        # All of these integers are exact as floating-point numbers.
        return np.asarray((start + jump * np.arange(count)) / scale)
    return np.fromiter(((start + jump * i) / scale for i in range(count)), np.float64, count)


def _after(start: int, steps: NDArray[np.uint64], dtype: Any) -> Times:
    """Return a start plus whole numbers. The sum is exact, as it is computed modulo 2**64."""
    return np.asarray((np.uint64(start % 2**64) + steps).astype(np.int64).astype(dtype))


def _in_unit(knots: Times, unit: Any) -> Times:
    """Return the first and the last date in a unit or a finer one."""
    ends = knots[[0, -1]]
    with suppress(OverflowError):
        fine = ends.astype(np.promote_types(knots.dtype, f"datetime64[{unit}]"))
        # NumPy does not report all overflows.
        if (fine.astype(knots.dtype) == ends).all():
            return fine
    tick = np.timedelta64(1, unit)
    raise Problem(f"the dates from {ends[0]} to {ends[1]} cannot be counted in units of {tick}")


def _coarsest(dates: Times) -> Times:
    """Return the dates in the coarsest unit from seconds on that represents them exactly."""
    for unit in ("s", "ms", "us"):
        # Dates in attoseconds cannot be converted to seconds.
        with suppress(OverflowError):
            coarse = dates.astype(f"datetime64[{unit}]")
            if (coarse == dates).all():
                return coarse
    return dates


def _samples(steps: float, option: str) -> int:
    if steps >= _MOST:
        raise Problem(f"--every {option}: that makes {float(steps):.1e} samples of one curve")
    return int(steps) + 1


def _duration(text: str, option: str) -> tuple[Decimal, str]:
    """Split ``"10min"`` into 10 and ``"min"``."""
    try:
        found = parts_of_duration(text)
    except InvalidOperation:
        raise Problem(f"{option} {text}: the exponent is too large") from None
    if found is None:
        raise Problem(
            f"{option} {text}: a duration is a number such as 0.5, or one with a unit such as 10min; "
            f"units are {', '.join(NANOSECONDS)}"
        )
    count, unit = found
    refuse(
        f"{option} {text}: ",
        (count == 0, "it must be larger than zero"),
        (abs(count.adjusted()) > _EXPONENT, f"that is too {'long' if count > 1 else 'short'}"),
    )
    return count, unit

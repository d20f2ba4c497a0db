"""Times in texts: numbers or ISO dates, and durations."""

from __future__ import annotations

import re
from collections.abc import Callable
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import Problem

Times = NDArray[Any]
Fail = Callable[[int, str], Problem]
"""Makes the problem of a row: where it is, and what was found."""

# A date with 0 for every digit.
_SHAPE = re.compile(
    r"0000-00-00"
    r"(?:(?P<mark>[T ])00:00(?P<seconds>:00(?:\.0{1,9})?)? ?(?P<zone>Z|[+-]00(?::?00)?)?)?"
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
_DURATION = re.compile(r"(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+) ?([a-z]*)", re.IGNORECASE | re.ASCII)


# ---- columns ----


def parse_times(cells: list[str], fail: Fail) -> tuple[Times, bool]:
    """The times in a column: numbers if the first is one, else ISO dates.

    Returns:
        The times, and whether they had a Z or an offset and are now UTC.
    """
    cells = [cell.strip() for cell in cells]
    if "" in cells:
        raise fail(cells.index(""), "is empty")
    if _is_number(cells[0]):
        return _numbers(cells, fail), False
    return _dates(cells, fail)


def _numbers(cells: list[str], fail: Fail) -> Times:
    try:
        values = np.fromiter(map(float, cells), np.float64, len(cells))
        if np.abs(values).max() <= _EXACT:
            return values
        return np.array(list(map(int, cells)))
    except ValueError:
        i = next((i for i, cell in enumerate(cells) if not _is_number(cell)), None)
    if i is None:
        # Large, and not whole.
        return values
    raise fail(i, f"holds {cells[i]!r}, but {cells[0]!r} before; all must be numbers, or all dates")


def _dates(cells: list[str], fail: Fail) -> tuple[Times, bool]:
    shapes = [cell.translate(_ZEROS) for cell in cells]
    zones = {shape: _zone(shape, shapes, cells, fail) for shape in dict.fromkeys(shapes)}
    lengths = [len(cell) - zones[shape] for cell, shape in zip(cells, shapes, strict=True)]
    bodies = [cell[:length].strip() for cell, length in zip(cells, lengths, strict=True)]
    try:
        times = np.array(bodies, dtype="datetime64")
    except ValueError:
        i = next(i for i, body in enumerate(bodies) if not _is_date(body))
        raise fail(i, f"holds {cells[i]!r}, and there is no such date") from None
    if not zones[shapes[0]]:
        return times, False
    offsets = [cell[length:] for cell, length in zip(cells, lengths, strict=True)]
    minutes = {offset: _minutes(offset) for offset in set(offsets)}
    return times - np.array([minutes[offset] for offset in offsets], dtype="timedelta64[m]"), True


def _zone(shape: str, shapes: list[str], cells: list[str], fail: Fail) -> int:
    """The length of the Z or the offset at the end of dates of a shape."""
    match, first = _SHAPE.fullmatch(shape), _SHAPE.fullmatch(shapes[0])
    i = shapes.index(shape)
    if match is None:
        raise fail(i, f"holds {cells[i]!r}, neither a number nor a date such as 2021-08-29 or 2021-08-29T16:55Z")
    if first is None or _style(match) != _style(first):
        raise fail(i, f"holds {cells[i]!r}, but {cells[0]!r} before; all dates must be written the same way")
    return len(match["zone"] or "")


def _style(match: re.Match[str]) -> tuple[Any, ...]:
    """What dates of a column must have in common; fractions and offsets may differ."""
    return match["mark"], match["seconds"] is None, match["zone"] is None


def _minutes(offset: str) -> int:
    """``"+02:30"`` is 150."""
    digits = offset[1:].replace(":", "").ljust(4, "0")
    minutes = 60 * int(digits[:2]) + int(digits[2:]) if offset != "Z" else 0
    return -minutes if offset[0] == "-" else minutes


def _is_date(text: str) -> bool:
    try:
        np.datetime64(text)
    except ValueError:
        return False
    return True


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


# ---- times along a curve ----


def every(step: str, knots: Times) -> Times:
    """Times from the first to at most the last knot, one a step."""
    number, unit = _duration(step)
    if knots.dtype.kind == "M":
        return _every_date(number * _NANOSECONDS[unit or "s"], step, knots)
    if unit:
        raise Problem(f"--every {step}: the times of this curve are numbers, so give a number without a unit")
    count = int((knots[-1] - knots[0]) / float(number) * (1 + 1e-12))
    if knots.dtype.kind == "i" and number == int(number):
        whole: Times = knots[0] + int(number) * np.arange(count + 1)
        return whole[whole <= knots[-1]]
    return np.minimum(knots[0] + float(number) * np.arange(count + 1), knots[-1])


def _every_date(nanoseconds: Decimal, step: str, knots: Times) -> Times:
    if nanoseconds < 1 or nanoseconds != int(nanoseconds):
        raise Problem(f"--every {step}: a step is a whole number of nanoseconds")
    unit = next(unit for unit in ("s", "ms", "us", "ns") if int(nanoseconds) % _NANOSECONDS[unit] == 0)
    delta = np.timedelta64(int(nanoseconds) // _NANOSECONDS[unit], unit)
    start, stop = knots[0] + 0 * delta, knots[-1] + 0 * delta
    return start + delta * np.arange((stop - start) // delta + 1)


def spread(count: int, knots: Times) -> Times:
    """So many times from the first to the last knot, at equal distances; dates to a microsecond."""
    if knots.dtype.kind != "M":
        return np.linspace(knots[0], knots[-1], count)
    start, stop = (knot + np.timedelta64(0, "us") for knot in (knots[0], knots[-1]))
    steps = np.rint(np.linspace(0, (stop - start).astype(np.int64), count)).astype(np.int64)
    return _coarsest(start + steps.astype(start - stop).dtype))


def _coarsest(times: Times) -> Times:
    """The same times in seconds if they are whole ones, else in the next finer unit that will do."""
    for unit in ("s", "ms"):
        coarse = times.astype(f"datetime64[{unit}]")
        if (coarse == times).all():
            return coarse
    return times


def _duration(text: str) -> tuple[Decimal, str]:
    """``"10min"`` is 10 and ``"min"``."""
    match = _DURATION.fullmatch(text.strip())
    if match is None or match[2].lower() not in ("", *_NANOSECONDS):
        raise Problem(f"--every {text}: a step is a number such as 0.5, or a duration such as 10min; "
                      f"its unit is one of {', '.join(_NANOSECONDS)}")
    number = Decimal(match[1])
    if number == 0:
        raise Problem(f"--every {text}: a step must be larger than zero")
    return number, match[2].lower()

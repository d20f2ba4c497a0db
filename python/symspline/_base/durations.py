"""Durations: strings such as "3h", and the types of Python, NumPy and pandas."""

from __future__ import annotations

import re
from datetime import timedelta
from decimal import Decimal
from typing import Any

import numpy as np

from .._core import ValidationError
from .arrays import short_repr

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


def seconds_of(value: Any, name: str, dates: bool = True) -> Any:
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
        found = parts_of_duration(value)
    except ArithmeticError:
        found = None
    if found is None or not found[1]:
        raise ValidationError(
            f"{name} is {short_repr(value)}, which is not a duration. Pass a number of seconds, a timedelta64, or a "
            f"text with a unit, such as '3h' or '10min'; units are {', '.join(NANOSECONDS)}."
        )
    return float(found[0] * NANOSECONDS[found[1]] / NANOSECONDS["s"])

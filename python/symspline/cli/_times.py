"""Durations in options, and sampling times along a curve."""

from __future__ import annotations

import math
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.time import NANOSECONDS, parts_of_duration
from ._messages import Problem, refuse
from ._tables import EXACT, UNITS

Times = NDArray[Any]
_SECOND = 10**9
_MOST = 10**9
# Exponents of floating-point numbers are smaller.
_EXPONENT = 400


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
    unit = next(unit for unit in UNITS if nanoseconds % NANOSECONDS[unit] == 0)
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

"""Times as a user gives them, and as plain doubles in the core."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import ValidationError

# Integers up to here are exact as doubles.
_EXACT = 2**53


@dataclass(frozen=True)
class Clock:
    """How times become doubles: dates as seconds, large integers as differences, since ``origin``."""

    origin: Any = None
    unit: str = ""

    def doubles(self, times: ArrayLike, name: str) -> NDArray[np.float64]:
        """Times as the core counts them, C-contiguous."""
        array = np.asarray(times)
        if self.unit:
            if array.dtype.kind != "M":
                raise ValidationError(f"the knots are dates, so {name} must be datetime64, not {array.dtype}")
            return _seconds(array, self.origin, name)
        if array.dtype.kind == "f":
            array = array if self.origin is None else array - float(self.origin)
        elif array.dtype.kind in "iub":
            if self.origin is not None:
                array = array.astype(np.int64) - self.origin
        elif array.dtype.kind == "M":
            raise ValidationError(f"{name} is datetime64, but the knots are numbers")
        else:
            raise ValidationError(f"{name} must be numbers or datetime64, not {array.dtype}")
        return np.asarray(array, dtype=np.float64, order="C")


def _seconds(array: NDArray[Any], origin: Any, name: str) -> NDArray[np.float64]:
    if np.isnat(array).any():
        index = np.argwhere(np.isnat(array))[0].tolist()
        raise ValidationError(f"{name}{index} is NaT (not a time)")
    difference = array - origin
    # The difference is exact in the finer of the two units; one rounding makes it seconds.
    unit, step = np.datetime_data(difference.dtype)
    ticks = difference.astype(np.int64).astype(np.float64) * step
    per_second = {"ns": 1e9, "us": 1e6, "ms": 1e3, "ps": 1e12, "fs": 1e15, "as": 1e18}
    if unit in per_second:
        return np.asarray(ticks / per_second[unit], order="C")
    seconds = {"s": 1.0, "m": 60.0, "h": 3600.0, "D": 86400.0, "W": 604800.0}
    if unit not in seconds:
        raise ValidationError(f"{name} has the unit {unit!r}, which has no fixed length; use days or finer")
    return np.asarray(ticks * seconds[unit], order="C")


def clock_of(knots: ArrayLike) -> tuple[Clock, NDArray[Any]]:
    """The clock for some knots, and the knots as `CubicSpline.t` shows them."""
    array = np.asarray(knots)
    if array.size == 0:
        raise ValidationError("t is empty; a curve needs at least two points")
    if array.dtype.kind == "M":
        unit = np.datetime_data(array.dtype)[0]
        if unit in ("Y", "M"):
            array = array.astype("datetime64[D]")
        return Clock(array.flat[0], np.datetime_data(array.dtype)[0]), array.copy()
    if array.dtype.kind in "iu" and (int(array.max()) > _EXACT or int(array.min()) < -_EXACT):
        array = array.astype(np.int64)
        return Clock(np.int64(array.flat[0])), array
    if array.dtype.kind not in "iufb":
        raise ValidationError(f"t must be numbers or datetime64, not {array.dtype}")
    return Clock(), array.astype(np.float64)

"""Arc length as a function of time, and time as a function of arc length."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .integrals import Doubles, Evaluable, panels, rule

_EPS = np.finfo(np.float64).eps
# Bisection alone takes at most this number of steps from any interval to two neighbouring floating-point numbers.
_STEPS = 1100


class ArcLength:
    """The arc length of curves, from a table of its values at the ends of short intervals.

    On each interval the Gauss–Legendre rule integrates the speed up to rounding errors, so that it does so from the
    start of the interval to any time in it. Times and lengths have shape (*batch, m).

    Attributes
    ----------
    times : ndarray, shape (*batch, k)
        Ends of the intervals, increasing; they include all knots.
    lengths : ndarray, shape (*batch, k)
        Arc lengths from the first knot to these times. NaN for curves that failed.
    """

    def __init__(self, curve: Evaluable) -> None:
        self._curve = curve
        with np.errstate(all="ignore"):
            found = list(panels(curve.times, self._speed, curve.batch, curve.quad_rtol))
        starts = np.concatenate([x for own in found for x in (own.a, own.middle)], axis=-1)
        parts = np.concatenate([x for own in found for x in (own.left, own.right)], axis=-1)
        order = np.argsort(starts, axis=-1)
        first, last = (np.broadcast_to(x, (*curve.batch, 1)) for x in (curve.times[..., :1], curve.times[..., -1:]))
        self.times = np.concatenate([np.take_along_axis(starts, order, axis=-1), last], axis=-1)
        sums = np.cumsum(np.take_along_axis(parts, order, axis=-1), axis=-1)
        self.lengths = np.concatenate([np.zeros_like(first), sums], axis=-1)

    def _speed(self, x: Doubles) -> Any:
        return self._curve.evaluate(np.ascontiguousarray(x), "speed", "continue", True)

    def at(self, x: Doubles) -> Doubles:
        """Return the arc lengths from the first knot to times x."""
        k = _interval(self.times, x, "right")
        start = np.take_along_axis(self.times, k, axis=-1)
        with np.errstate(all="ignore"):
            return np.asarray(np.take_along_axis(self.lengths, k, axis=-1) + rule(start, x, self._speed))

    def between(self, a: Doubles, b: Doubles) -> Doubles:
        """Return the lengths from times a to times b, which are not before a.

        They are sums of three lengths, not differences of two arc lengths, which would round to the accuracy of the
        whole length if both times are in one interval.
        """
        i, j = (_interval(self.times, x, "right") for x in (a, b))
        start, stop = (np.take_along_axis(self.times, k, axis=-1) for k in (i + 1, j))
        same = i == j
        with np.errstate(all="ignore"):
            first = rule(a, np.where(same, b, start), self._speed)
            last = rule(np.where(same, b, stop), b, self._speed)
            inner = np.take_along_axis(self.lengths, j, axis=-1) - np.take_along_axis(self.lengths, i + 1, axis=-1)
        return np.asarray(first + np.where(same, 0.0, inner) + last)

    def times_at(self, s: Doubles) -> Doubles:
        """Return the first times at which the arc length is s, by Newton's method with bisection as a safeguard.

        Arc lengths must be between 0 and the length of the curve. Curves that failed have NaN.
        """
        total = self.lengths[..., -1:]
        # Rounding must not move a time from the start of a rest to its end.
        k = _interval(self.lengths, s - 4 * _EPS * total, "left")
        a, b = (np.take_along_axis(self.times, i, axis=-1) for i in (k, k + 1))
        low, high = (np.take_along_axis(self.lengths, i, axis=-1) for i in (k, k + 1))
        missing = np.broadcast_to(np.isnan(total), s.shape)
        with np.errstate(all="ignore"):
            ahead = s - low
            share = np.where(high > low, np.clip(ahead / (high - low), 0.0, 1.0), 0.0)
        x = np.where(missing, a, np.clip(a + share * (b - a), a, b))
        # The ends of an interval are known: the table has their arc lengths.
        x = np.where(s <= low, a, np.where(s >= high, b, x))
        active = ~(missing | (s <= low) | (s >= high))
        lower, upper = a, b
        for _ in range(_STEPS):
            # Columns in which a curve of the batch is still active.
            columns = np.asarray(active.reshape(-1, s.shape[-1]).any(axis=0))
            if not columns.any():
                break
            own = x[..., columns]
            with np.errstate(all="ignore"):
                error = rule(a[..., columns], own, self._speed) - ahead[..., columns]
                lo = np.where(error <= 0, own, lower[..., columns])
                hi = np.where(error >= 0, own, upper[..., columns])
                step = own - error / self._speed(own)
                inside = (step > lo) & (step < hi)
                new = np.where(inside, step, lo / 2 + hi / 2)
                near = np.spacing(np.abs(own))
                done = (np.abs(error) <= 4 * _EPS * total) | (np.abs(step - own) <= near) | (hi - lo <= 2 * near)
            going = active[..., columns] & ~done
            x[..., columns] = np.where(going, new, own)
            lower, upper = _replaced(lower, columns, lo), _replaced(upper, columns, hi)
            active[..., columns] = going
        return np.where(missing, np.nan, x)


def _replaced(array: Doubles, columns: NDArray[np.bool_], values: Doubles) -> Doubles:
    result = array.copy()
    result[..., columns] = values
    return result


def _interval(ends: Doubles, values: Doubles, side: Any) -> NDArray[np.intp]:
    """Return the index of the interval between `ends` that contains each value, curve by curve."""
    rows = ends.reshape(-1, ends.shape[-1])
    found = [np.searchsorted(row, x, side) for row, x in zip(rows, values.reshape(len(rows), -1), strict=True)]
    return np.clip(np.reshape(found, values.shape) - 1, 0, ends.shape[-1] - 2)

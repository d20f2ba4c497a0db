"""Ordinary differential equations, many at once, to rounding: extrapolation (Hairer, Nørsett and Wanner, Solving
Ordinary Differential Equations I, II.9)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .._spaces import Array

# Steps of Gragg's method, whose results are extrapolated to order twelve.
_NUMBERS = (2, 4, 6, 8, 10, 12)
# The error of order ten at which that of order twelve is rounding, relative to the largest number.
FINE = 1e-12
_MOST = 64
# By what angle a solution may turn in one step that is fine.
_REACH = 0.35


def integrate(f: Callable[[Array], Array], y: Array, turns: Array, tol: float = FINE) -> Array:
    """y(1) of y' = f(y), of rows y: each by as many steps of order twelve as it needs; NaN where 64 are too few.

    Args:
        turns: approximate angle by which the solution turns, one per row; it sets the first number of steps.
        tol: largest error of order ten.
    """
    result = np.full_like(y, np.nan)
    reach = _REACH * (tol / FINE) ** 0.1
    steps = 2.0 ** np.clip(np.rint(np.log2(np.maximum(turns, 1e-300) / reach)), 0, np.log2(_MOST))
    left = np.arange(len(y))
    while left.size:
        # All that need the fewest steps.
        count = steps[left].min()
        own = left[steps[left] == count]
        now, error = y[own], np.zeros(len(own))
        with np.errstate(all="ignore"):
            for _ in range(int(count)):
                now, more = _step(f, now, 1 / count)
                error += more
            excess = error / (tol * np.maximum(1.0, _sizes(now)))
            # It falls with the tenth power of the steps.
            factor = 2.0 ** np.ceil(np.maximum(1.0, np.log2(excess) / 10))
        done = excess <= 1
        result[own[done]] = now[done]
        steps[own] = np.where(done | ~(count * factor <= _MOST), np.inf, count * factor)
        left = left[np.isfinite(steps[left])]
    return result


def _sizes(y: Array) -> Array:
    return np.asarray(np.abs(y).reshape(len(y), -1).max(axis=1))


def _step(f: Callable[[Array], Array], y: Array, h: float) -> tuple[Array, Array]:
    """One step, and the error of the order before."""
    start = f(y)
    table: list[Array] = []
    for j, n in enumerate(_NUMBERS):
        row = [_midpoint(f, y, start, h / n, n)]
        for k in range(1, j + 1):
            ratio = (n / _NUMBERS[j - k]) ** 2 - 1
            row.append(row[-1] + (row[-1] - table[k - 1]) / ratio)
        table = row
    return table[-1], _sizes(table[-1] - table[-2])


def _midpoint(f: Callable[[Array], Array], y: Array, start: Array, h: float, n: int) -> Array:
    """Gragg's method, whose error is a series in h²."""
    before, now = y, y + h * start
    for _ in range(n - 1):
        before, now = now, before + 2 * h * f(now)
    return np.asarray((before + now + h * f(now)) / 2)

"""Extrema of functions of time, and times at which they have a given value."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from .. import _core
from .._core import ValidationError
from .._spaces import Doubles

Function = Callable[[Doubles], Doubles]

# Chebyshev nodes per interval, and how often an interval is halved if a polynomial does not represent the function.
_NODES = 24
_DEPTH = 7
# Part of the largest value below which the last coefficients of a polynomial and the changes of a constant are rounding
# errors.
_SMALL = 1e-10
# Rounding errors by which values of a spline can deviate, relative to those of its points divided by a power of the
# knot spacing: second differences of points have coefficients of up to 12, in several coordinates.
_NOISE = 64 * float(np.finfo(np.float64).eps)
# Points per interval at which the signs of the derivative are compared.
_SIGNS = 49

# Steps of golden-section search, which divide an interval by 10¹⁰.
_GOLDEN = 48
_RATIO = (np.sqrt(5) - 1) / 2

_POINTS = chebyshev.chebpts1(_NODES)
# From values at the nodes to the coefficients of the interpolating polynomial.
_TO_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(_POINTS, _NODES - 1))


class Intervals(NamedTuple):
    """A function as a polynomial on each of several intervals, which cover the domain in order.

    Attributes
    ----------
    a, b : ndarray, shape (m,)
        Ends of the intervals.
    values : ndarray, shape (m, n)
        Values at the Chebyshev nodes.
    rough : ndarray of bool, shape (m,)
        Whether the polynomial does not represent the function, as next to a kink.
    noise : ndarray, shape (m,)
        Size of the rounding errors of the function.
    """

    a: Doubles
    b: Doubles
    values: Doubles
    rough: NDArray[np.bool_]
    noise: Doubles

    @classmethod
    def of(cls, f: Function, knots: Doubles, noise: Doubles) -> Self:
        """Sample a function between the knots. Intervals are halved until polynomials represent it."""
        a, b, scale, done = knots[:-1], knots[1:], 0.0, []
        for depth in range(_DEPTH + 1):
            values = f(_nodes(a, b).ravel()).reshape(-1, _NODES)
            scale = max(scale, float(np.abs(values).max()))
            # Halving an interval does not remove its rounding errors.
            rough = np.abs(values @ _TO_COEFFICIENTS[-3:].T).max(axis=-1) > np.maximum(_SMALL * scale, noise)
            kept = ~rough | (depth == _DEPTH)
            done.append(cls(a[kept], b[kept], values[kept], rough[kept], noise[kept]))
            if kept.all():
                break
            middle = (a + b)[rough] / 2
            a, b = (np.stack(x, axis=-1).ravel() for x in ((a[rough], middle), (middle, b[rough])))
            noise = np.repeat(noise[rough], 2)
        each = [np.concatenate(x) for x in zip(*done, strict=True)]
        order = np.argsort(each[0])
        return cls(*(x[order] for x in each))

    @property
    def coefficients(self) -> Doubles:
        """Coefficients of the Chebyshev polynomials, shape (n, m)."""
        return np.asarray(_TO_COEFFICIENTS @ self.values.T)

    def time(self, number: Any, tau: Doubles) -> Doubles:
        """Return times in intervals, where tau is from -1 to 1."""
        return np.asarray(self.a[number] + (self.b - self.a)[number] * (tau + 1) / 2)


def _nodes(a: Doubles, b: Doubles) -> Doubles:
    return a[:, None] + (b - a)[:, None] * (_POINTS + 1) / 2


def rounding_noise(sizes: Doubles, spacing: Doubles, order: int) -> Doubles:
    """Return the size of rounding errors of a derivative between knots.

    Errors of points, ε times their size, are divided by the spacing of the knots to the power of the order. At a dense
    sampling, the second derivative consists of them: the error is 4e-8 for unit vectors at 1 kHz.

    Parameters
    ----------
    sizes : ndarray, shape (n,)
        Sizes of the points at the knots.
    spacing : ndarray, shape (n - 1,)
        Spacing of the knots.
    """
    # The errors of an interval decay over the next ones, which may be longer.
    shortest = np.minimum(spacing, np.minimum(np.append(spacing[1:], np.inf), np.append(np.inf, spacing[:-1])))
    with np.errstate(over="ignore", divide="ignore"):
        return np.asarray(_NOISE * np.maximum(sizes[1:], sizes[:-1]) / shortest**order)


def extrema(f: Function, knots: Doubles, sign: float, noise: Doubles) -> Doubles:
    """Return the times of local maxima (sign 1) or minima (sign -1), including those at the ends of the domain.

    Parameters
    ----------
    noise : ndarray, shape (n - 1,)
        Size of the rounding errors of the function between the knots. Extrema that they explain are omitted.
    """
    intervals = Intervals.of(f, knots, noise)
    found = _candidates(f, intervals, knots, sign)
    return _prominent(f, intervals, knots, sign, found) if noise.any() else found


def _prominent(f: Function, intervals: Intervals, knots: Doubles, sign: float, found: Doubles) -> Doubles:
    """Return the maxima on both sides of which the function falls by more than its rounding errors.

    Of several maxima that are not separated by such a fall, only the largest one is returned.
    """
    sampled = np.concatenate([knots[:1], _nodes(intervals.a, intervals.b).ravel(), knots[-1:]])
    values = sign * np.concatenate([f(knots[:1]), intervals.values.ravel(), f(knots[-1:])])
    allowed = np.repeat(intervals.noise, _NODES)
    allowed = np.concatenate([allowed[:1], allowed, allowed[-1:]])
    if np.ptp(values) <= allowed.max():
        # A constant: all its values are largest.
        return np.asarray(knots[[0, -1]])
    peaks = sign * f(found)
    # Between two maxima, only the smallest value matters.
    starts = np.searchsorted(sampled, found)
    ends = np.append(starts, len(sampled))
    lows = [
        values[a:b].min(initial=np.inf) for a, b in zip(np.append(0, ends[:-1]).tolist(), ends.tolist(), strict=True)
    ]
    tolerance = allowed[np.minimum(starts, len(allowed) - 1)].tolist()
    kept: list[int] = []
    best, low = -1, lows[0]
    for i, (peak, after) in enumerate(zip(peaks.tolist(), lows[1:], strict=True)):
        # `low` is the smallest value since the best maximum so far, or since the last one that was kept.
        if best < 0:
            if not kept or peak - low > tolerance[i]:
                best, low = i, after
            else:
                low = min(low, after)
        elif peak > peaks[best]:
            best, low = i, after
        else:
            low = min(low, after)
        if best >= 0 and peaks[best] - low > tolerance[best]:
            kept.append(best)
            best = -1
    if best >= 0:
        kept.append(best)
    return found[kept]


def _candidates(f: Function, intervals: Intervals, knots: Doubles, sign: float) -> Doubles:
    """Return the times of all maxima, including those caused by rounding errors."""
    scale = float(np.abs(intervals.values).max())
    slopes = sign * chebyshev.chebder(intervals.coefficients)
    tau = np.linspace(-1, 1, _SIGNS)
    values = chebyshev.chebval(tau, slopes)
    # Changes that rounding errors explain do not have a sign.
    values[np.abs(values) <= np.maximum(_SMALL * scale, intervals.noise)[:, None]] = 0.0
    number, place = np.nonzero(values)
    if not len(number):
        return np.asarray(knots[[0, -1]])
    signs = np.sign(values[number, place])
    turns = np.flatnonzero((signs[:-1] > 0) & (signs[1:] < 0))
    found = intervals.time(number[turns], tau[place[turns]])
    inside = number[turns] == number[turns + 1]
    # In other cases, the maximum is at a knot, or a constant part begins there.
    found[~inside] = intervals.b[number[turns[~inside]]]
    own = turns[inside]
    ends = tau[place[own]], tau[place[own + 1]]

    def slope(index: Any, x: Doubles) -> Doubles:
        return np.asarray(chebyshev.chebval(x, slopes[:, number[own[index]]], tensor=False))

    starts, stops = (values[number[i], place[i]] for i in (own, own + 1))
    root = _core.roots(slope, ends, (starts, stops), (ends[0] + ends[1]) / 2)
    found[inside] = intervals.time(number[own], root)
    rough = np.flatnonzero(inside)[intervals.rough[number[own]]]
    found[rough], real = _refined(lambda x: sign * f(x), intervals, number[turns[rough]], found[rough])
    found = np.delete(found, rough[~real])
    outer = [knots[:1]] if signs[0] < 0 else []
    return np.concatenate([*outer, found, *([knots[-1:]] if signs[-1] > 0 else [])])


def _refined(
    f: Function, intervals: Intervals, number: NDArray[np.intp], x: Doubles
) -> tuple[Doubles, NDArray[np.bool_]]:
    """Improve maxima next to kinks by golden-section search, and return whether they are maxima of the function."""
    if not len(x):
        return x, np.zeros(0, np.bool_)
    reach = (intervals.b - intervals.a)[number] / _NODES
    a, b = np.maximum(x - reach, intervals.a[number]), np.minimum(x + reach, intervals.b[number])
    ends = np.maximum(f(a), f(b))
    for _ in range(_GOLDEN):
        left, right = b - _RATIO * (b - a), a + _RATIO * (b - a)
        lower = f(left) < f(right)
        a, b = np.where(lower, left, a), np.where(lower, b, right)
    middle = (a + b) / 2
    return middle, f(middle) > ends


def crossings(f: Function, knots: Doubles, value: float, noise: Doubles) -> Doubles:
    """Return the times at which a function crosses a value, in increasing order.

    Values that differ from it by less than the rounding errors `noise` between the knots do not have a sign.
    """
    intervals = Intervals.of(f, knots, noise)
    ends = f(knots[[0, -1]])
    times = np.concatenate([knots[:1], _nodes(intervals.a, intervals.b).ravel(), knots[-1:]])
    values = np.concatenate([ends[:1], intervals.values.ravel(), ends[1:]]) - value
    allowed = np.concatenate([[0.0], np.repeat(intervals.noise, _NODES), [0.0]])
    signed = (np.abs(values) > allowed) | (values == 0)
    times, values = times[signed], values[signed]
    exact = np.flatnonzero((values == 0) & np.append(True, values[:-1] != 0))
    own = np.flatnonzero(values[:-1] * values[1:] < 0)
    interval, outer = (times[own], times[own + 1]), (values[own], values[own + 1])
    guess = (interval[0] + interval[1]) / 2
    found = _core.roots(lambda _, x: f(x) - value, interval, outer, guess)
    return np.sort(np.concatenate([times[exact], found]))


def checked_values(values: Any, times: NDArray[Any]) -> Doubles:
    """Return the values of a function of the user at some times."""
    array = np.asarray(values)
    if array.shape != times.shape or array.dtype.kind not in "biuf":
        raise ValidationError(
            f"function must return one real number per time, shape {times.shape}; got {array.dtype} of shape "
            f"{array.shape}"
        )
    good = np.isfinite(array)
    if not good.all():
        i = np.unravel_index(np.argmin(good), good.shape)
        raise ValidationError(
            f"function must return finite numbers in the whole domain of the curve; at the time {times[i]} it returned "
            f"{array[i]}"
        )
    return array.astype(np.float64)

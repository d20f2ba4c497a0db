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
    """

    a: Doubles
    b: Doubles
    values: Doubles
    rough: NDArray[np.bool_]

    @classmethod
    def of(cls, f: Function, knots: Doubles) -> Self:
        """Sample a function between the knots. Intervals are halved until polynomials represent it."""
        a, b, scale, done = knots[:-1], knots[1:], 0.0, []
        for depth in range(_DEPTH + 1):
            values = f(_nodes(a, b).ravel()).reshape(-1, _NODES)
            scale = max(scale, float(np.abs(values).max()))
            rough = np.abs(values @ _TO_COEFFICIENTS[-3:].T).max(axis=-1) > _SMALL * scale
            kept = ~rough | (depth == _DEPTH)
            done.append(cls(a[kept], b[kept], values[kept], rough[kept]))
            if kept.all():
                break
            middle = (a + b)[rough] / 2
            a, b = (np.stack(x, axis=-1).ravel() for x in ((a[rough], middle), (middle, b[rough])))
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


def extrema(f: Function, knots: Doubles, sign: float) -> Doubles:
    """Return the times of local maxima (sign 1) or minima (sign -1), including those at the ends of the domain."""
    intervals = Intervals.of(f, knots)
    scale = float(np.abs(intervals.values).max())
    slopes = sign * chebyshev.chebder(intervals.coefficients)
    tau = np.linspace(-1, 1, _SIGNS)
    values = chebyshev.chebval(tau, slopes)
    # Changes that rounding errors explain do not have a sign.
    values[np.abs(values) <= _SMALL * scale] = 0.0
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


def crossings(f: Function, knots: Doubles, value: float) -> Doubles:
    """Return the times at which a function crosses a value, in increasing order."""
    intervals = Intervals.of(f, knots)
    ends = f(knots[[0, -1]])
    times = np.concatenate([knots[:1], _nodes(intervals.a, intervals.b).ravel(), knots[-1:]])
    values = np.concatenate([ends[:1], intervals.values.ravel(), ends[1:]]) - value
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

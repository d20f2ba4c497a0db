"""Roots of many functions at once, each in an interval at whose ends it has opposite signs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .._spaces import Doubles

_EPS = np.finfo(np.float64).eps
# Bisection alone takes at most this number of steps from any interval to two neighbouring floating-point numbers.
_STEPS = 1100


def roots(
    f: Callable[[Doubles, NDArray[np.intp]], Doubles],
    interval: tuple[Doubles, Doubles],
    values: tuple[Doubles, Doubles],
    guess: Doubles,
    xtol: Doubles,
) -> Doubles:
    """Return one root per interval by Chandrupatla's method: inverse quadratic interpolation or bisection.

    Parameters
    ----------
    f : callable
        ``f(x, i)``, the values at times x of the functions with indices i.
    interval : pair of ndarray, shape (m,)
        Ends of the intervals.
    values : pair of ndarray, shape (m,)
        Values at the ends, which do not have the same sign.
    guess : ndarray, shape (m,)
        First times inside the intervals.
    xtol : ndarray, shape (m,)
        Absolute tolerances of the roots, in addition to rounding errors.

    References
    ----------
    T. R. Chandrupatla, A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function without
    using derivatives, Adv. Eng. Softw. 28 (1997).
    """
    (a, b), (fa, fb) = interval, values
    found = np.where(np.abs(fa) <= np.abs(fb), a, b)
    index = np.flatnonzero((fa != 0) & (fb != 0) & (a != b))
    # The latest time is a. The root is between a and b, and c is the time before.
    a, b, fa, fb, x, tol = (y[index] for y in (a, b, fa, fb, guess, xtol))
    for _ in range(_STEPS):
        if not index.size:
            break
        fx = f(x, index)
        same = np.sign(fx) == np.sign(fa)
        c, fc = np.where(same, a, b), np.where(same, fa, fb)
        b, fb = np.where(same, b, a), np.where(same, fb, fa)
        a, fa = x, fx
        best = np.where(np.abs(fa) < np.abs(fb), a, b)
        with np.errstate(all="ignore"):
            near = (2 * _EPS * np.abs(best) + tol) / np.abs(b - a)
        done = (near > 0.5) | (fa == 0) | ~np.isfinite(fa)
        found[index[done]] = best[done]
        with np.errstate(all="ignore"):
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            smooth = (phi**2 < xi) & ((1 - phi) ** 2 < 1 - xi)
            quadratic = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        t = np.clip(np.where(smooth, quadratic, 0.5), near, 1 - near)
        going = ~done
        x = (a + t * (b - a))[going]
        index, a, b, fa, fb, tol = (y[going] for y in (index, a, b, fa, fb, tol))
    return found

"""Variance of the integrated Wiener process whose posterior mean is a curve smoothed with a penalty on the jerk."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from .._spaces import Doubles


def process_ratio(
    times: Doubles, weights: Doubles, knots: Doubles, band: Doubles | None, lam: float, kinds: Any, x: Doubles, nu: int
) -> Doubles:
    """Return the variance of the process divided by that of a cubic spline with the same data and the same λ.

    The posterior mean of the process is a quintic spline. At the data, its variance is nearly that of the cubic spline.
    Between the data, the process is stiffer than the one whose mean is a cubic spline.

    Parameters
    ----------
    times, weights : ndarray, shape (N,)
        Times and weights of the data.
    knots : ndarray
        Knots of the cubic spline.
    band : ndarray or None
        Band of A⁻¹. None if coordinates are coupled; the ratio is then that of uncoupled coordinates.
    lam : float
        Weight of the penalty.
    kinds : list of str or None
        Kinds of the ends; None for a closed curve.
    x : ndarray, shape (n,)
        Times.
    nu : {0, 1}
        0 for the point, 1 for the velocity.
    """
    used = weights > 0
    times, weights, knots, x = (np.ascontiguousarray(own) for own in (times[used], weights[used], knots, x))
    if not (lam > 0 and np.isfinite(lam)):
        return np.ones(len(x))
    if band is None:
        band = _core.smoothing_inverse(knots, times, weights, lam, "jerk", kinds)
    period = knots[-1] - knots[0] if kinds is None else None
    spline = _core.smoothing_variance(knots, np.ascontiguousarray(band), 0.0, x, nu, kinds)
    return np.asarray(_core.process_variance(times, weights, lam, period, x, nu) / spline)

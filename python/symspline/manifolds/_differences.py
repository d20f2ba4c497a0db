"""Derivatives by differences: of the logarithm, and of curves."""

from __future__ import annotations

import math

import numpy as np

from .._spaces import Array
from ._operations import Operations

# Steps along the geodesic at q, as parts of the injectivity radius, or of the distance of p and q and the length of
# the direction: where errors of order four are as large as those of rounding.
_OF_RADIUS = 5e-4
_OF_HANDLES = 4e-3
_PLACES = np.array([-2.0, -1.0, 1.0, 2.0])
_WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0

# Of order eight: weights of the values at 1, 2, 3, 4 steps; behind them they are minus and plus the same.
_FIRST = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
_SECOND = np.array([8 / 5, -1 / 5, 8 / 315, -1 / 560])
_EIGHTH = np.array([-56.0, 28.0, -8.0, 1.0])
STEPS = np.concatenate([np.arange(-4.0, 0.0), np.arange(1.0, 5.0)])


def dlog_by_differences(operations: Operations, p: Array, v: Array, q: Array, w: Array, radius: float) -> Array:
    """The derivative of log_p at q = exp_p(v) in the direction w, by differences of order four along its geodesic."""
    size = operations.norm(q, w)
    step = _OF_RADIUS * radius if math.isfinite(radius) else _OF_HANDLES * np.hypot(size, operations.norm(p, v))
    # Times along the geodesic with velocity w.
    s = np.divide(step, size, out=np.zeros_like(size), where=size > 0)
    ahead = np.multiply.outer(_PLACES, s).reshape(len(_PLACES), -1, *[1] * (w.ndim - 1))
    shape = (len(_PLACES), *p.shape)
    x = operations.exp(np.broadcast_to(q, shape), ahead * w)
    logs = operations.log(np.broadcast_to(p, shape), x)
    inverse = np.divide(1.0, s, out=np.zeros_like(s), where=s > 0).reshape(-1, *[1] * (w.ndim - 1))
    # Differences of logarithms, not of the products, so that what they share cancels at once.
    return np.asarray(np.tensordot(_WEIGHTS, logs, 1) * inverse)


def first_derivative(values: Array, step: Array) -> Array:
    """The derivative of a function by its values at `STEPS`, which come first."""
    odd = values[4:] - values[3::-1]
    return np.asarray(np.tensordot(_FIRST, odd, 1) / step)


def second_derivative(values: Array, step: Array) -> Array:
    """The second derivative of a function that is zero in the middle."""
    even = values[4:] + values[3::-1]
    return np.asarray(np.tensordot(_SECOND, even, 1) / step / step)


def eighth_difference(values: Array) -> Array:
    """What polynomials of degree seven have none of: large where a function is not smooth on the scale of the steps."""
    return np.asarray(np.tensordot(_EIGHTH, values[4:] + values[3::-1], 1))

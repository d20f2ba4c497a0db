"""Integrals along curves, to rounding."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

# Gauss's rule with this many nodes, on an interval and on its halves.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
_TOL = 1e-14
# Speed has kinks where a curve stops and turns; bisection closes in on them.
_DEPTH = 40


def integrate(times: Doubles, f: Callable[[Doubles], Any], batch: tuple[int, ...]) -> Any:
    """∫ f dt over all segments, adaptively; f takes times of shape batch + (m,)."""
    times = np.broadcast_to(times, (*batch, times.shape[-1]))
    a, b = times[..., :-1], times[..., 1:]
    whole = _rule(a, b, f)
    total = np.zeros(batch)
    scale = np.abs(whole).sum(axis=-1)
    for _ in range(_DEPTH):
        middle = (a + b) / 2
        halves = _rule(a, middle, f), _rule(middle, b, f)
        better = halves[0] + halves[1]
        error = np.abs(better - whole)
        # Curves of a batch are refined together, interval by interval.
        rough = (error > _TOL * scale[..., None]).reshape(-1, a.shape[-1]).any(axis=0)
        total = total + better[..., ~rough].sum(axis=-1)
        if not rough.any():
            return total[()]
        a, b = (
            np.concatenate([x[..., rough], y[..., rough]], axis=-1) for x, y in ((a, middle), (middle, b))
        )
        whole = np.concatenate([half[..., rough] for half in halves], axis=-1)
    return (total + whole.sum(axis=-1))[()]


def _rule(a: Doubles, b: Doubles, f: Callable[[Doubles], Any]) -> Doubles:
    half = (b - a) / 2
    x = (a + b)[..., None] / 2 + half[..., None] * _NODES
    values = f(np.ascontiguousarray(x.reshape(*a.shape[:-1], -1))).reshape(x.shape)
    result: Doubles = (values @ _WEIGHTS) * half
    return result

"""Integrals along curves, accurate up to rounding errors: lengths and bending energies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .._base.report import Report
from .._base.typing import Number

Doubles = NDArray[np.float64]

# Gauss–Legendre rule, applied to an interval and to its halves.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
EXACT = 1e-14
_PATIENCE = 5


def integrate(times: Doubles, f: Callable[[Doubles], Any], batch: tuple[int, ...], tol: float = EXACT) -> Number:
    """Integrate f over all segments by adaptive bisection, to the relative tolerance `tol`.

    The function takes times of shape batch + (m,). The speed of a curve has a kink where the curve stops and turns;
    bisection then converges to the kink. An error that does not decrease for several rounds is a rounding error, and
    bisection stops.
    """
    total = np.zeros(batch)
    if 0 in batch:
        return total
    # Values beyond the floating-point range become infinite, and a curve without a solution is NaN.
    with np.errstate(all="ignore"):
        for own in panels(times, f, batch, tol):
            total = total + (own.left + own.right).sum(axis=-1)
    result: Number = total[()]
    return result


class Panels(NamedTuple):
    """Intervals, and the integrals over their two halves.

    Attributes
    ----------
    a, middle, b : ndarray, shape (*batch, k)
        Ends and midpoints of the intervals.
    left, right : ndarray, shape (*batch, k)
        Integrals over the halves.
    """

    a: Doubles
    middle: Doubles
    b: Doubles
    left: Doubles
    right: Doubles

    def where(self, kept: NDArray[np.bool_]) -> Panels:
        """Return some of the intervals."""
        return Panels(*(x[..., kept] for x in self))


def panels(times: Doubles, f: Callable[[Doubles], Any], batch: tuple[int, ...], tol: float = EXACT) -> Iterator[Panels]:
    """Yield intervals that cover all segments, in any order, with integrals to the relative tolerance `tol`."""
    times = np.broadcast_to(times, (*batch, times.shape[-1]))
    a, b = times[..., :-1], times[..., 1:]
    whole = rule(a, b, f)
    scale = np.abs(whole).sum(axis=-1)
    before, stalled = np.full(batch, np.inf), np.zeros(batch, dtype=int)
    while True:
        middle = a / 2 + b / 2
        own = Panels(a, middle, b, rule(a, middle, f), rule(middle, b, f))
        error = np.abs(own.left + own.right - whole)
        left = error.sum(axis=-1)
        stalled = stalled + ~(left <= before / 2)
        before = left
        # An interval is bisected for all curves of the batch if one of them needs it.
        open_still = (stalled <= _PATIENCE)[..., None] & (error > tol * scale[..., None])
        rough = open_still.reshape(-1, a.shape[-1]).any(axis=0)
        if not rough.any():
            yield own
            return
        yield own.where(~rough)
        split = own.where(rough)
        a = np.concatenate([split.a, split.middle], axis=-1)
        b = np.concatenate([split.middle, split.b], axis=-1)
        whole = np.concatenate([split.left, split.right], axis=-1)


def rule(a: Doubles, b: Doubles, f: Callable[[Doubles], Any]) -> Doubles:
    """Integrate over intervals from a to b by the Gauss–Legendre rule."""
    half = (b - a) / 2
    x = (a / 2 + b / 2)[..., None] + half[..., None] * _NODES
    values = f(np.ascontiguousarray(x.reshape(*a.shape[:-1], -1))).reshape(x.shape)
    return np.asarray((values @ _WEIGHTS) * half)


class Evaluable(Protocol):
    """Curve with a length and an energy: it is smooth between `times`, and its norms can be evaluated."""

    @property
    def times(self) -> Doubles: ...
    @property
    def batch(self) -> tuple[int, ...]: ...
    @property
    def quad_rtol(self) -> float: ...

    def evaluate(self, x: Doubles, quantity: str, outside: str, per_curve: bool) -> Any: ...


def bending_energy(curve: Evaluable) -> Number:
    """Compute ∫ |∇γ'|² dt, equation (1), for each curve."""
    # The unit of time is the whole domain: otherwise squares of accelerations can overflow or underflow.
    times = curve.times
    unit = np.broadcast_to(times[..., -1:] - times[..., :1], (*curve.batch, 1))

    def power(x: Doubles) -> Doubles:
        bend: Doubles = curve.evaluate(x, "bend", "continue", True) * unit * unit
        return bend * bend / unit

    with np.errstate(all="ignore"):
        return integrate(times, power, curve.batch, curve.quad_rtol) / unit[..., 0] / unit[..., 0] / unit[..., 0]


def alternative_energy(parts: Sequence[Evaluable], reports: list[Report]) -> Any:
    """Return the lowest energy of the alternative curves through the points of a product, or None.

    An alternative curve replaces the solution in one factor by the alternative solution of that factor.
    """
    if all(report.alternative_energy is None for report in reports):
        return None
    energies: list[Any] = [bending_energy(part) for part in parts]
    others = [
        sum(energies) - energy + report.alternative_energy
        for energy, report in zip(energies, reports, strict=True)
        if report.alternative_energy is not None
    ]
    return np.fmin.reduce(others)

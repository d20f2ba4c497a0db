"""Lengths, bending energies and arc lengths of curves of any kind, which the compiled core integrates."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from .. import _core
from .._base.report import Report
from .._base.typing import Number
from .._spaces import Doubles
from .curve import CurveArrays


class Evaluable(Protocol):
    """Curve with a length and an energy: it is smooth between `times`, and its norms can be evaluated."""

    @property
    def times(self) -> Doubles: ...
    @property
    def batch(self) -> tuple[int, ...]: ...
    @property
    def quad_rtol(self) -> float: ...

    def evaluate(self, x: Doubles, quantity: str, outside: str, per_curve: bool) -> Any: ...


def _rows(curve: Evaluable) -> Doubles:
    """Return knots with one row per curve."""
    times = curve.times
    shape = (math.prod(curve.batch), times.shape[-1])
    return np.ascontiguousarray(np.broadcast_to(times, (*curve.batch, shape[1])).reshape(shape))


def _norm(curve: Evaluable, quantity: str) -> _core.Curve | Callable[[Doubles], Doubles]:
    """Return what the core integrates: its own curve, or a function of times of shape (curves, m)."""
    if isinstance(curve, CurveArrays) and curve.is_compiled:
        return curve.compiled

    def norm(x: Doubles) -> Doubles:
        times = np.ascontiguousarray(x.reshape(*curve.batch, x.shape[-1]))
        # Values beyond the floating-point range become infinite, and a curve without a solution is NaN.
        with np.errstate(all="ignore"):
            return np.ascontiguousarray(curve.evaluate(times, quantity, "continue", True)).reshape(x.shape)

    return norm


def _integral(curve: Evaluable, quantity: str) -> Number:
    if 0 in curve.batch:
        return np.zeros(curve.batch)
    found = _core.integrals(_rows(curve), _norm(curve, quantity), quantity, curve.quad_rtol)
    result: Number = found.reshape(curve.batch)[()]
    return result


def length(curve: Evaluable) -> Number:
    """Compute the length of each curve."""
    return _integral(curve, "speed")


def bending_energy(curve: Evaluable) -> Number:
    """Compute ∫ |∇γ'|² dt, equation (1), for each curve."""
    return _integral(curve, "bend")


class ArcLength:
    """The arc length of curves. Times and lengths have shape (*batch, m).

    Attributes
    ----------
    times : ndarray, shape (curves, k)
        Ends of short intervals, increasing; they include all knots.
    lengths : ndarray, shape (curves, k)
        Arc lengths from the first knot to these times. NaN for curves that failed.
    """

    def __init__(self, curve: Evaluable) -> None:
        self._table = _core.ArcLength(_rows(curve), _norm(curve, "speed"), curve.quad_rtol)
        self.times, self.lengths = self._table.times, self._table.lengths

    def _call(self, method: Callable[..., Doubles], *arrays: Doubles) -> Doubles:
        rows = [np.ascontiguousarray(array.reshape(len(self.times), -1)) for array in arrays]
        return method(*rows).reshape(arrays[0].shape)

    def at(self, x: Doubles) -> Doubles:
        """Return the arc lengths from the first knot to times x."""
        return self._call(self._table.at, x)

    def between(self, a: Doubles, b: Doubles) -> Doubles:
        """Return the lengths from times a to times b, which are not before a."""
        return self._call(self._table.between, a, b)

    def times_at(self, s: Doubles) -> Doubles:
        """Return the first times at which the arc length is s, between 0 and the length of the curve."""
        return self._call(self._table.times_at, s)


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

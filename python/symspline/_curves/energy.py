"""Bending energy of curves."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from .._report import Report
from .._typing import Number
from .curve import CurveArrays, Doubles
from .integrals import integrate


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


def alternative_energy(curve: CurveArrays, reports: list[Report]) -> Any:
    """Return the lowest energy of the alternative curves through the points of a product, or None.

    An alternative curve replaces the solution in one factor by the alternative solution of that factor.
    """
    if all(report.alternative_energy is None for report in reports):
        return None
    energies: list[Any] = [bending_energy(part) for part in curve.parts]
    others = [
        sum(energies) - energy + report.alternative_energy
        for energy, report in zip(energies, reports, strict=True)
        if report.alternative_energy is not None
    ]
    return np.fmin.reduce(others)

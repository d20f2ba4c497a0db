"""How much curves bend."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from .._report import Report
from .._typing import Number
from .curve import CurveArrays, Doubles
from .integrals import integrate


class Evaluable(Protocol):
    """What lengths and energies need of a curve: times between which it is smooth, batch axes, and its norms."""

    @property
    def times(self) -> Doubles: ...
    @property
    def batch(self) -> tuple[int, ...]: ...
    @property
    def quad_rtol(self) -> float: ...

    def evaluate(self, x: Doubles, quantity: str, outside: str, per_curve: bool) -> Any: ...


def bending_energy(curve: Evaluable) -> Number:
    """∫ |∇γ'|² dt, (1); shape of the batch axes."""
    # In units of the whole time: squares of accelerations would overflow or vanish where times are far from one.
    times = curve.times
    unit = np.broadcast_to(times[..., -1:] - times[..., :1], (*curve.batch, 1))

    def power(x: Doubles) -> Doubles:
        bend: Doubles = curve.evaluate(x, "bend", "continue", True) * unit * unit
        return bend * bend / unit

    with np.errstate(all="ignore"):
        return (
            integrate(times, power, curve.batch, curve.quad_rtol) / unit[..., 0] / unit[..., 0] / unit[..., 0]
        )


def alternative_energy(curve: CurveArrays, reports: list[Report]) -> Any:
    """The least energy of other curves that were found through the points of a product: those with the alternative
    of one factor, if any has one."""
    if all(report.alternative_energy is None for report in reports):
        return None
    energies: list[Any] = [bending_energy(part) for part in curve.parts]
    others = [
        sum(energies) - energy + report.alternative_energy
        for energy, report in zip(energies, reports, strict=True)
        if report.alternative_energy is not None
    ]
    return np.fmin.reduce(others)

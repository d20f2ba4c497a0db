"""Fit, evaluation and geodesics, one row per space, on one core."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

import symspline as ss

from . import data, geodesics, geometries
from .data import Array
from .side_by_side import QUANTITIES
from .tables import table, versus
from .timing import Effort, Result, in_unit, measure, ready, shared
from .walks import walks

NAMES = (
    *("r:3", "sphere:1", "sphere:2", "sphere:3", "sphere:7", "h:2", "h:3", "ds:3", "ads:4"),
    *("rp:2", "rp:3", "cp:1", "cp:3", "cp:7", "hp:1", "hp:2", "ch:1", "ch:2"),
    *("gr:2,4", "gr:2,6", "gr:3,8", "cgr:2,4", "igr:1,1,2,2", "st:2,4"),
    *("so:2", "so:3", "so:4", "so:5", "o:3", "u:1", "u:2", "u:4", "su:2", "su:3", "se:2", "se:3"),
    *("spd:2", "spd:3", "spd:4", "spd:6", "sspd:3", "hpd:2", "hpd:3", "siegel:1", "siegel:2"),
    *("gl:2", "gl:3", "sl:2", "sp:2", "aff:2", "sim:3", "cgl:2", "lorentz:3"),
)
"""The spaces of the paper's Table 1 and beyond, in small sizes."""
KNOTS = 12
HEAD = (
    *("space", "fit, µs per knot", "NumPy", *(f"{quantity}, ns" for quantity in QUANTITIES)),
    *("acceleration ÷ value", "geodesic: pyriemann", "exp: pymanopt", "log: pymanopt"),
)


def text(names: Sequence[str], curves: int, samples: int, effort: Effort) -> str:
    """A row per space: times of symspline, and how many times as long other libraries take."""
    return table(HEAD, [_row(ss.space(name), curves, samples, effort) for name in names])


def _row(space: ss.Space, curves: int, samples: int, effort: Effort) -> list[object]:
    points = walks(space, curves, KNOTS)
    contestants = {"symspline": ready(partial(ss.CubicSpline, None, points, space))}
    if geometries.known(space):
        geodesics.agree(_gap(points, space), geodesics.TOLERANCE, f"NumPy: fit in {space!r}")
        contestants["NumPy"] = ready(partial(geometries.velocities, points, space))
    fits = measure(contestants, effort)
    spline = ss.CubicSpline(None, points, space)
    x = data.times(KNOTS, samples)
    found = measure({name: ready(partial(spline, x, nu)) for nu, name in enumerate(QUANTITIES)}, effort)
    value, *_, acceleration = found.values()
    return [
        f"`{space}`",
        in_unit(shared(fits["symspline"], curves * KNOTS), 1e-6),
        versus(fits, "NumPy", "symspline")[0],
        *(in_unit(shared(each, curves * samples), 1e-9) for each in found.values()),
        _ratio(acceleration, value),
        *_peers(space, points, effort),
    ]


def _gap(points: Array, space: ss.Space) -> float:
    expected = ss.CubicSpline(None, points, space).velocities
    return float(np.abs(geometries.velocities(points, space) - expected).max())


def _ratio(slow: Result, fast: Result) -> object:
    return versus({"slow": slow, "fast": fast}, "slow", "fast")[0]


def _peers(space: ss.Space, points: Array, effort: Effort) -> list[object]:
    """How many times as long others take for the geodesics between the first points of the curves."""
    p, q = points[:, 0].copy(), points[:, 1].copy()
    cells: list[object] = []
    for peer, operation in (("pyriemann", "geodesic"), ("pymanopt", "exp"), ("pymanopt", "log")):
        if not geodesics.offers(peer, space, operation):
            cells.append(None)
            continue
        work = geodesics.checked(peer, space, operation, p, q)
        found = measure(
            {peer: ready(work), "symspline": ready(geodesics.own(space, operation, p, q))}, effort
        )
        cells.append(versus(found, peer, "symspline")[0])
    return cells

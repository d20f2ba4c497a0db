"""symspline's splines beside Riemannian cubics, the minimisers of ∫ |∇γ'|² dt, on S² and SO(3).

python docs/comparisons/riemannian_cubics.py [--write]

Half a minute. SO(3) needs ``pip install interpolatepy`` and is left out without it.
"""

from __future__ import annotations

import time
import timeit
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import Any, NamedTuple

import cubic_s2
import cubic_so3
import numpy as np
from figure import loglog
from motions import Array, between, knots, track, tumble
from page import HERE, insert, parser, table, versions
from threadpoolctl import threadpool_limits
from variations import Variation, defect, nodes, vary

import symspline as ss

SIZES = (3, 6, 12, 24, 48)
VARIED = 6
"""Number of points of the curves that are tested for being critical."""


class Case(NamedTuple):
    """A space, a smooth curve in it, and what finds Riemannian cubics."""

    space: ss.Space
    motion: Callable[[Array], Array]
    cubic: Callable[[ss.CubicSpline], Any]
    solver: str


SPHERE = Case(ss.Sphere(2), track, cubic_s2.RiemannianCubic, "SciPy's solve_bvp")
ROTATIONS = Case(ss.SpecialOrthogonal(3), tumble, cubic_so3.RiemannianCubic, "interpolatepy's shooting")


class Row(NamedTuple):
    """What is found with n points."""

    n: int
    step: float
    energy: float
    excess: float
    distance: float
    error: float
    spline_time: float
    cubic_time: float


def compare(case: Case, n: int) -> Row:
    """Spline and Riemannian cubic through the same n points of the motion."""
    t = knots(n)
    points = case.motion(t)
    spline, spline_time = _timed(lambda: ss.CubicSpline(t, points, case.space))
    cubic, cubic_time = _timed(lambda: case.cubic(spline))
    x = between(t)
    curve, energy = cubic(x), cubic.energy()
    return Row(
        n,
        float(case.space.distance(points[:-1], points[1:]).max()),
        energy,
        spline.bending_energy() / energy - 1,
        float(case.space.distance(curve, spline(x)).max()),
        float(case.space.distance(case.motion(x), curve).max()),
        spline_time,
        cubic_time,
    )


def variations(case: Case, n: int = VARIED, fields: int = 20) -> tuple[list[Variation], list[Variation]]:
    """The same random variations of the Riemannian cubic and of the spline."""
    t = knots(n)
    spline = ss.CubicSpline(t, case.motion(t), case.space)
    cubic = case.cubic(spline)
    rngs = np.random.default_rng(1), np.random.default_rng(1)
    cubics, splines = (
        [vary(case.space, t, curve, rng) for _ in range(fields)]
        for curve, rng in zip((cubic, spline), rngs, strict=True)
    )
    return cubics, splines


def residual(n: int = VARIED) -> float:
    """How well the equation of Riemannian cubics is satisfied on S²."""
    t = knots(n)
    cubic = cubic_s2.RiemannianCubic(ss.CubicSpline(t, track(t), SPHERE.space))
    return defect(t, *cubic.ambient(nodes()))


def text(rows: Sequence[Row]) -> str:
    """The table; orders from one row to the next."""
    cells = []
    for before, row in zip((None, *rows), rows, strict=False):
        order = None
        if before is not None:
            order = f"{np.log(before.distance / row.distance) / np.log((row.n - 1) / (before.n - 1)):.1f}"
        cells.append(
            [
                row.n,
                f"{row.step:.2f}",
                f"{row.energy:.6g}",
                f"{row.excess:.1e}",
                f"{row.distance:.1e}",
                order,
                f"{row.error:.1e}",
                _seconds(row.spline_time),
                _seconds(row.cubic_time),
            ]
        )
    head = (
        "points",
        "step, rad",
        "energy",
        "excess",
        "distance, rad",
        "order",
        "to motion, rad",
        "spline",
        "cubic",
    )
    return table(head, cells)


def words(cubics: Sequence[Variation], splines: Sequence[Variation]) -> str:
    """What the variations say."""
    slopes = [max(abs(one.slope) for one in found) for found in (cubics, splines)]
    rise = min(one.rise for one in cubics)
    return (
        f"{len(cubics)} random variations of the curve through {VARIED} points: the derivative of the energy, "
        f"relative to the energy, is at most {slopes[0]:.0e} for the cubic and {slopes[1]:.0e} for the spline; "
        f"moved either way, the energy of the cubic grows, by {rise:.0e} or more."
    )


def draw(found: dict[str, list[Row]], file: str = "riemannian_cubics.png") -> None:
    lines, slopes = {}, {}
    for name, rows in found.items():
        lines[f"{name}: spline to cubic"] = [row.distance for row in rows]
        lines[f"{name}: cubic to motion"] = [row.error for row in rows]
        slopes[f"{name}: spline to cubic"] = 4
    title = "symspline and Riemannian cubics, natural ends"
    loglog(HERE / file, SIZES, lines, slopes, "largest distance, rad", title)


def _timed(make: Callable[[], Any]) -> tuple[Any, float]:
    """What is made, and the processor time that takes, the mean of 0.2 s or of one call."""
    # More threads make the small matrices of `solve_bvp` slower, not faster.
    with threadpool_limits(1):
        made = make()
        calls, total = timeit.Timer(make, timer=time.process_time).autorange()
    return made, total / calls


def _seconds(value: float) -> str:
    return (
        f"{1e6 * value:.0f} µs"
        if value < 1e-3
        else f"{1e3 * value:.3g} ms"
        if value < 1
        else f"{value:.1f} s"
    )


def main() -> None:
    given = parser(__doc__).parse_args()
    cases, packages = {"S²": SPHERE}, ["symspline", "scipy"]
    if find_spec("interpolatepy"):
        cases["SO(3)"] = ROTATIONS
        packages.append("interpolatepy")
    found, parts = {}, []
    for name, case in cases.items():
        found[name] = [compare(case, n) for n in SIZES]
        parts += [f"**{name}**, cubics from {case.solver}:", text(found[name]), words(*variations(case))]
        if case is SPHERE:
            parts[-1] += f" The differential equation is satisfied to {residual():.0e}."
    parts.append(versions(*packages))
    whole = "\n\n".join(parts)
    print(whole)
    if given.write:
        insert("cubics", whole)
        draw(found)


if __name__ == "__main__":
    main()

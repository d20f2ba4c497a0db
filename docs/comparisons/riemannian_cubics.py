"""symspline's splines beside Riemannian cubics, the minimisers of ∫ |∇γ'|² dt, on S² and SO(3).

python docs/comparisons/riemannian_cubics.py [--write]

Half a minute. The solver that SO(3) is compared with needs ``pip install interpolatepy``, and is left out without it.
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
from variations import Variation, defect, nodes, slopes, vary

import symspline as ss

SIZES = (3, 6, 12, 24, 48)
VARIED = 6
"""Number of points of the curves that are tested for being critical."""
FINE = 64
"""Refinement of these curves, whose derivatives are used."""


class Case(NamedTuple):
    """A space, a smooth curve in it, and another solver of Riemannian cubics."""

    space: ss.Space
    motion: Callable[[Array], Array]
    other: Callable[[ss.CubicSpline], Any]
    solver: str


SPHERE = Case(ss.Sphere(2), track, cubic_s2.RiemannianCubic, "solve_bvp")
ROTATIONS = Case(ss.SpecialOrthogonal(3), tumble, cubic_so3.RiemannianCubic, "interpolatepy")


class Row(NamedTuple):
    """What is found with n points, and by the other solver if it is installed."""

    n: int
    step: float
    energy: float
    excess: float
    distance: float
    error: float
    spline_time: float
    cubic_time: float
    energy_of_other: float | None
    time_of_other: float | None


def compare(case: Case, n: int, others: bool = True) -> Row:
    """Spline and Riemannian cubic through the same n points of the motion."""
    t = knots(n)
    points = case.motion(t)
    spline, spline_time = _timed(lambda: ss.CubicSpline(t, points, case.space))
    cubic, cubic_time = _timed(lambda: ss.riemannian_cubic(spline))
    other, other_time = _timed(lambda: case.other(spline)) if others else (None, None)
    x = between(t)
    curve = cubic.curve(x)
    return Row(
        n,
        float(case.space.distance(points[:-1], points[1:]).max()),
        cubic.energy,
        spline.bending_energy() / cubic.energy - 1,
        cubic.distance,
        float(case.space.distance(case.motion(x), curve).max()),
        spline_time,
        cubic_time,
        other and other.energy(),
        other_time,
    )


def variations(case: Case, n: int = VARIED, fields: int = 20) -> tuple[list[Variation], list[Variation]]:
    """The same random variations of the Riemannian cubic and of the spline."""
    t = knots(n)
    spline = ss.CubicSpline(t, case.motion(t), case.space)
    cubic = ss.riemannian_cubic(spline, refinement=FINE).curve
    rngs = np.random.default_rng(1), np.random.default_rng(1)
    cubics, splines = (
        [vary(case.space, t, curve, rng) for _ in range(fields)]
        for curve, rng in zip((cubic, spline), rngs, strict=True)
    )
    return cubics, splines


def residual(n: int = VARIED) -> float:
    """How well the equation of Riemannian cubics is satisfied on S², by points alone."""
    t = knots(n)
    cubic = ss.riemannian_cubic(ss.CubicSpline(t, track(t), SPHERE.space), refinement=512).curve
    x = cubic(t[:-1, None] + np.diff(t)[:, None] * nodes())
    v = slopes(t, x, x)
    a = slopes(t, x, v)
    return defect(t, x, v, a, slopes(t, x, a))


def text(rows: Sequence[Row], solver: str) -> str:
    """The table; orders from one row to the next."""
    cells = []
    for before, row in zip((None, *rows), rows, strict=False):
        order = None
        if before is not None:
            order = f"{np.log(before.distance / row.distance) / np.log((row.n - 1) / (before.n - 1)):.1f}"
        others = []
        if row.energy_of_other is not None and row.time_of_other is not None:
            others = [f"{row.energy_of_other / row.energy - 1:.0e}", _seconds(row.time_of_other)]
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
                *others,
            ]
        )
    head = [
        "points",
        "step, rad",
        "energy",
        "excess",
        "distance, rad",
        "order",
        "to motion, rad",
        "spline",
        "cubic",
    ]
    if rows[0].energy_of_other is not None:
        head += [f"{solver}: energy", f"{solver}: time"]
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


def times(sizes: Sequence[int] = (6, 30, 100, 300, 1000)) -> str:
    """How long spline and cubic take."""
    rows = []
    for n in sizes:
        t = knots(n)
        row: list[object] = [n]
        for case in (SPHERE, ROTATIONS):
            points = case.motion(t)
            spline, spline_time = _timed(lambda p=points, s=case.space, t=t: ss.CubicSpline(t, p, s))
            _, cubic_time = _timed(lambda spline=spline: ss.riemannian_cubic(spline))
            row += [_seconds(spline_time), _seconds(cubic_time), f"{cubic_time / spline_time:.0f}"]
        rows.append(row)
    head = [f"{space}: {what}" for space in ("S²", "SO(3)") for what in ("spline", "cubic", "ratio")]
    return table(["points", *head], rows)


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
    has_interpolatepy = find_spec("interpolatepy") is not None
    packages = ["symspline", "scipy"] + ["interpolatepy"] * has_interpolatepy
    found, parts = {}, []
    for name, case in {"S²": SPHERE, "SO(3)": ROTATIONS}.items():
        found[name] = [compare(case, n, case is SPHERE or has_interpolatepy) for n in SIZES]
        parts += [f"**{name}**:", text(found[name], case.solver), words(*variations(case))]
        if case is SPHERE:
            parts[-1] += f" The differential equation is satisfied to {residual():.0e}."
    parts += ["**Many points**:", times()]
    parts.append(versions(*packages))
    whole = "\n\n".join(parts)
    print(whole)
    if given.write:
        insert("cubics", whole)
        draw(found)


if __name__ == "__main__":
    main()

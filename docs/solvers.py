"""Which solver converges where, in how many iterations and how fast: the tables and figures of ``solvers_tables.md``.

python docs/solvers.py [--write]

Some minutes.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import solvers_figures as figures
from comparisons.page import insert, parser, table, versions
from numpy.typing import NDArray
from solvers_energy import energy_table, spaces_table
from solvers_uneven import uneven_table

import symspline as ss

Array = NDArray[np.float64]

HERE = Path(__file__).parent
PAGE = HERE / "solvers_tables.md"
METHODS = ("fixed-point", "quasi-newton", "newton", "auto")
ENDED = ("quasi-newton", "newton", "homotopy")
S2, S3, ROTATIONS = ss.Sphere(2), ss.Sphere(3), ss.SpecialOrthogonal(3)
GRASSMANNIAN = ss.Grassmannian(2, 5)
ZIGZAGS = (0.2, 0.5, 1.0, 1.5, 2.0, 2.5, 2.8, 3.0)
STEPS = (0.3, 0.6, 0.9, 1.2, 1.5, 1.8, 2.1, 2.4, 2.7, 3.0)
SEEDS = range(15)
HOME = 4.0
"""How far walks go from where they started in a space without end, where rounding grows with distance."""


# ---- data ----


def zigzag(step: float, n: int = 20) -> Array:
    """Points on S² whose longitude alternates between 0 and ``step``, 0.1 apart in latitude."""
    i = np.arange(n)
    lon, lat = step * (i % 2), 0.1 * (i - (n - 1) / 2)
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)


def walk(space: ss.Space, step: float, seed: int, n: int = 20) -> Array:
    """A random walk: every step in a direction of its own."""
    rng = np.random.default_rng(seed)
    p = [space.random_point(rng)]
    for _ in range(n - 1):
        v = space.random_tangent(rng, p[-1])
        if np.isinf(space.injectivity_radius) and space.distance(p[0], p[-1]) > HOME:
            v = space.log(p[-1], p[0])
        p.append(space.project(space.exp(p[-1], step * v / space.norm(p[-1], v))))
    return np.array(p)


@cache
def walks(space: ss.Space, step: float) -> Array:
    return np.array([walk(space, step, seed) for seed in SEEDS])


def unequal_knots(n: int = 20) -> Array:
    """Times with gaps between 0.2 and 2, one row a seed."""
    gaps = [np.random.default_rng(1000 + seed).uniform(0.2, 2.0, n - 1) for seed in SEEDS]
    return np.array([np.concatenate([[0.0], np.cumsum(gap)]) for gap in gaps])


def fit(p: Array, space: ss.Space, t: Array | None = None, **options: object) -> ss.CubicSpline:
    return ss.CubicSpline(t, p, space, on_failure="ignore", **options)


# ---- tables ----


def zigzag_table(steps: Sequence[float] = ZIGZAGS) -> str:
    """Iterations and energies of every solver; a dagger where it found another curve than auto."""
    rows = []
    for step in steps:
        curves = {method: fit(zigzag(step), S2, method=method) for method in METHODS}
        path = curves["auto"].report.method
        cells = [_iterations(curve, curves["auto"]) for curve in curves.values()]
        rows.append([f"{step:g}", *cells, path if curves["auto"].report.converged else None])
    return table(["D", *METHODS, "auto ended with"], rows)


def _iterations(curve: ss.CubicSpline, reference: ss.CubicSpline) -> str:
    if not curve.report.converged:
        return f"none in {curve.report.iterations}"
    energies = curve.bending_energy(), reference.bending_energy()
    same = abs(energies[0] - energies[1]) < 1e-3 * energies[1]
    return f"{curve.report.iterations}, {energies[0]:.4g}{'' if same else ' †'}"


def walk_table(space: ss.Space, steps: Sequence[float] = STEPS, t: Array | None = None) -> str:
    """How many of the walks converge, and the median of their iterations."""
    rows = []
    for step in steps:
        row = [f"{step:g}"]
        for method in METHODS:
            # One by one, because a batch names one solver for all.
            reports = [
                fit(p, space, None if t is None else t[i], method=method).report
                for i, p in enumerate(walks(space, step))
            ]
            done = [r for r in reports if r.converged]
            row.append(f"{len(done)}, {np.median([r.iterations for r in done]):.0f}" if done else "0")
        ended = Counter(r.method for r in done)
        rest = len(done) - sum(ended[name] for name in ENDED)
        rows.append([*row, " + ".join([*(str(ended[name]) for name in ENDED), str(rest)])])
    return table(["step", *METHODS, "auto: q.-n. + newton + homotopy + others"], rows)


def time_table(copies: int = 16) -> str:
    """Microseconds a curve of 20 points, alone and in a batch of 15 × `copies` walks."""
    rows = []
    for space, steps in ((S2, (0.3, 1.2, 2.1)), (GRASSMANNIAN, (0.3, 0.9))):
        for step in steps:
            p = walks(space, step)
            many = np.tile(p, (copies, *[1] * (p.ndim - 1)))
            row = [repr(space), f"{step:g}"]
            for method in METHODS:
                alone = np.median([_seconds(one, space, method) for one in p])
                row.append(f"{1e6 * alone:.0f}, {1e6 * _seconds(many, space, method) / len(many):.1f}")
            rows.append(row)
    return table(["space", "step", *METHODS], rows)


def _seconds(p: Array, space: ss.Space, method: str, repeats: int = 4) -> float:
    """Processor time of the fastest of some fits."""
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        fit(p, space, method=method)
        times.append(time.process_time() - begin)
    return min(times)


# ---- figures ----


def measured(space: ss.Space, far: float, count: int, n: int = 12) -> figures.Points:
    """Fixed-point iterations on walks of n points with K D up to `far`, the near ones more often: K D, K V of
    the solution, contraction and convergence."""
    rows = []
    k = space.curvature
    for seed, part in enumerate(np.random.default_rng(0).uniform(0.0, 1.0, count)):
        p = walk(space, far * part**1.5 / k, seed, n)
        curve = fit(p, space, method="fixed-point")
        handle = space.norm(p, curve.velocities).max() / 3
        rows.append((k * curve.report.max_step, k * handle, curve.report.rate, curve.report.converged))
    columns = np.array(rows, float).T
    return figures.Points(*columns[:3], columns[3] > 0)


def residuals(p: Array, space: ss.Space, method: str, most: int = 50) -> list[float]:
    """The least residual of the first 2, 3, … evaluations, until it is at rounding or stays."""
    found: list[float] = []
    for limit in range(2, most + 1):
        found.append(fit(p, space, method=method, tol=0.0, max_iter=limit).report.residual)
        if found[-1] < 3e-16 or found[-3:].count(found[-1]) == 3:
            break
    return found


def main() -> None:
    write = parser(__doc__).parse_args().write
    t = unequal_knots()
    parts = {
        "zigzags": zigzag_table(),
        "walks": f"**S²**\n\n{walk_table(S2)}\n\n**S³**\n\n{walk_table(S3)}",
        "energy": energy_table(),
        "spaces": spaces_table(),
        "uneven": uneven_table(),
        "knots": f"**S²**\n\n{walk_table(S2, t=t)}\n\n**S³**\n\n{walk_table(S3, t=t)}",
        "time": f"{time_table()}\n\n{versions('symspline')}",
    }
    print("\n\n".join(parts.values()))
    if not write:
        return
    for part, text in parts.items():
        insert(part, text, PAGE)
    found = {
        "S²": measured(S2, 3.0, 250),
        "H²": measured(ss.Hyperbolic(2), 3.0, 250),
        "Gr(2, 5)": measured(GRASSMANNIAN, 2.1, 150),
    }
    figures.region(found).savefig(HERE / "solvers_region.png", dpi=120)
    curves = {
        f"{name}, steps of {step:g} rad": {m: residuals(walk(space, step, 1), space, m) for m in METHODS[:3]}
        for name, space in (("S²", S2), ("SO(3)", ROTATIONS))
        for step in (0.3, 1.2)
    }
    figures.sweeps(curves).savefig(HERE / "solvers_residuals.png", dpi=120)


if __name__ == "__main__":
    main()

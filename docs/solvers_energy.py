"""Of several C² curves through points far apart, which one is found: two tables of ``solvers_tables.md``."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator

import numpy as np
from comparisons.page import table
from numpy.typing import NDArray

import symspline as ss

Array = NDArray[np.float64]

OTHERS = ("quasi-newton", "newton", "fixed-point", "homotopy")
SETS = 60
BENDS = ("natural", "periodic", "not-a-knot")


def _walk(space: ss.Space, part: float, n: int, rng: np.random.Generator) -> Array:
    p = [space.random_point(rng)]
    for _ in range(n - 1):
        v = space.random_tangent(rng, p[-1])
        p.append(space.exp(p[-1], part * np.pi * v / space.norm(p[-1], v)))
    return np.array(p)


def _zigzag(space: ss.Space, part: float, n: int, rng: np.random.Generator) -> Array:
    i = np.arange(min(n, 15))
    p = np.zeros((len(i), space.point_shape[0]))
    p[:, :3] = ss.geo.from_lonlat(180 * part * (i % 2), np.degrees(0.1 * (i - (len(i) - 1) / 2)))
    p += 0.02 * rng.standard_normal(p.shape)
    return p / np.linalg.norm(p, axis=1, keepdims=True)


KINDS: dict[str, Callable[[ss.Space, int, np.random.Generator], Array]] = {
    "random points": lambda space, n, rng: space.random_point(rng, n),
    **{
        f"walks of {part:g}": lambda s, n, rng, part=part: _walk(s, part, n, rng)
        for part in (0.5, 0.7, 0.9, 0.97, 0.999)
    },
    **{
        f"zigzags of {part:g}": lambda s, n, rng, part=part: _zigzag(s, part, n, rng)
        for part in (0.9, 0.99, 0.999)
    },
}


def data(kind: str, sets: int) -> Iterator[tuple[Array | None, Array, ss.Space, str]]:
    """Knots, points, space and ends: S² and S³ in turn, three ends, equal and unequal knots, 3 to 50 points."""
    rng = np.random.default_rng(5)
    for k in range(sets):
        space = ss.Sphere(2 + k % 2)
        p = KINDS[kind](space, int(rng.integers(3, 51)), rng)
        ends = BENDS[k % 3]
        if ends == "periodic":
            p = np.concatenate([p, p[:1]])
        yield None if k % 4 < 2 else np.cumsum(rng.uniform(0.2, 2.0, len(p))), p, space, ends


def energy_table(sets: int = SETS) -> str:
    """How often `auto` fails, how often another method succeeds there, and how much higher the energy of `auto` is."""
    rows = []
    for kind in KINDS:
        failed = found = more = both = 0
        worst = 1.0
        for t, p, space, ends in data(kind, sets):
            with warnings.catch_warnings():
                # The points of S³ are no quaternions.
                warnings.simplefilter("ignore")
                curves = {
                    m: ss.CubicSpline(t, p, space, bc_type=ends, method=m, on_failure="ignore")
                    for m in ("auto", *OTHERS)
                }
            auto = curves.pop("auto")
            energies = [curve.bending_energy() for curve in curves.values() if curve.report.converged]
            if not auto.report.converged:
                failed += 1
                found += bool(energies)
            elif energies:
                both += 1
                ratio = auto.bending_energy() / min(energies)
                more += ratio > 1.01
                worst = max(worst, ratio)
        rows.append([kind, str(failed), str(found), f"{more} of {both}", f"{worst:.3f}"])
    head = [
        "data",
        "`auto` fails",
        "of these, another finds one",
        "`auto` energy > 1 % higher",
        "largest energy ratio",
    ]
    return table(head, rows)


# ---- other spaces ----

SPACES = ("sphere:2", "sphere:3", "so:3", "cp:1", "cp:2", "gr:2,4", "spd:3", "h:2")
# How far walks go from where they started in a space without a cut locus.
HOME = 4.0


def far_points(space: ss.Space, rng: np.random.Generator) -> Array:
    """A walk or, one time in four, a zigzag, of 4 to 20 points with steps of 0.45 to 0.95 of the injectivity radius."""
    reach = min(space.injectivity_radius, np.pi)
    step, n = rng.uniform(0.45, 0.95) * reach, int(rng.integers(4, 21))
    first = space.random_point(rng)
    if rng.random() < 0.25:
        v, w = (space.random_tangent(rng, first) for _ in range(2))
        v /= space.norm(first, v)
        drift = w - space.inner(first, v, w) * v
        drift /= space.norm(first, drift)
        base = space.exp(first, 0.08 * (np.arange(n) - n / 2)[(...,) + (None,) * drift.ndim] * drift)
        across = space.transport(first, base, v)
        return space.project(
            space.exp(base, (np.arange(n) % 2 * step)[(...,) + (None,) * drift.ndim] * across)
        )
    p = [first]
    for _ in range(n - 1):
        v = space.random_tangent(rng, p[-1])
        if np.isinf(space.injectivity_radius) and space.distance(p[0], p[-1]) > HOME:
            v = space.log(p[-1], p[0])
        p.append(space.project(space.exp(p[-1], step * v / space.norm(p[-1], v))))
    return np.array(p)


def spaces_table(sets: int = 125) -> str:
    """How many far sets every solver solves, and how often the energy of `auto` exceeds the least of them, by space."""
    methods = ("fixed-point", "quasi-newton", "newton", "homotopy")
    rows = []
    for name in SPACES:
        space, rng = ss.space(name), np.random.default_rng(6)
        solved = dict.fromkeys((*methods, "auto"), 0)
        more, worst = 0, 1.0
        for k in range(sets):
            p = far_points(space, rng)
            chords = space.log(p[0], p[1]), space.log(p[-1], p[-2])
            ends = "natural" if k % 2 else ((1, rng.random() * chords[0]), (1, -rng.random() * chords[1]))
            energies = {}
            for method in solved:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    curve = ss.CubicSpline(None, p, space, bc_type=ends, method=method, on_failure="ignore")
                if curve.report.converged:
                    solved[method] += 1
                    energies[method] = curve.bending_energy()
            if energies:
                ratio = energies.get("auto", np.inf) / min(energies.values())
                more += ratio > 1.001
                worst = max(worst, ratio)
        rows.append([repr(space), *map(str, solved.values()), f"{more}", f"{worst:.4f}"])
    return table(["space", *solved, "`auto` energy > 0.1 % higher", "largest energy ratio"], rows)

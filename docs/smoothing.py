"""How good smoothing splines are, beside other ways and beside their goals: the tables of ``smoothing_accuracy.md``.

python docs/smoothing.py [--write] [PART ...]

Five to ten minutes on one core. Parts: flat, iterations, choice, hard, coverage, outliers, time.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np
import smoothing_peers as peers
from comparisons.page import insert, parser, table, versions
from numpy.typing import NDArray
from scipy.interpolate import make_smoothing_spline

import symspline as ss

Array = NDArray[np.float64]

PAGE = Path(__file__).parent / "smoothing_accuracy.md"
SPACES = {
    "S²": "sphere:2",
    "SO(3)": "so:3",
    "SPD(3)": "spd:3",
    "Gr(2, 5)": "gr:2,5",
    "H²": "hyperbolic:2",
}
SEEDS = 5
SIGMAS = (0.02, 0.1, 0.4)
LARGEST = {"Gr(2, 5)": 0.2}
"""Where the largest is less: at 0.4 nearly all of these curves need the full Gauss-Newton solver, seconds each."""
END = 10.0


# ---- data ----


class Data(NamedTuple):
    """Curves with noise: noisy points and true ones, shape (seeds, N, *point_shape)."""

    space: ss.Space
    t: Array
    noisy: Array
    truth: Array


def wander(space: ss.Space, rng: np.random.Generator, t: Array, steps: int = 6, step: float = 0.6) -> Array:
    """A C² curve through points a step apart, each in a direction of its own; it bends at its ends, too."""
    points = [space.random_point(rng)]
    for _ in range(steps):
        points.append(space.exp(points[-1], step * _direction(space, rng, points[-1])))
    knots = np.linspace(0, END, steps + 1)
    return np.asarray(ss.CubicSpline(knots, np.array(points), space, bc_type="not-a-knot")(t))


def straight(space: ss.Space, rng: np.random.Generator, t: Array, length: float) -> Array:
    """A geodesic."""
    p = space.random_point(rng)
    way = np.multiply.outer(t / END * length, _direction(space, rng, p))
    return np.asarray(space.exp(np.broadcast_to(p, way.shape), way))


def _direction(space: ss.Space, rng: np.random.Generator, p: Array) -> Array:
    v = space.random_tangent(rng, p)
    return np.asarray(v / np.sqrt(space.inner(p, v, v)))


Motion = Callable[[ss.Space, np.random.Generator, Array], Array]


@cache
def data(name: str, sigma: float, seeds: int = SEEDS, count: int = 100, motion: Motion = wander) -> Data:
    """Motions with noise of standard deviation ``sigma`` in every coordinate."""
    space, t = ss.space(name), np.linspace(0, END, count)
    truth = np.array([motion(space, np.random.default_rng(seed), t) for seed in range(seeds)])
    noise = [space.random_tangent(np.random.default_rng(1000 + seed), truth[seed]) for seed in range(seeds)]
    return Data(space, t, np.asarray(space.exp(truth, sigma * np.array(noise))), truth)


def smooth(given: Data, lam: object = None, **options: Any) -> ss.SmoothingSpline:
    return ss.make_smoothing_spline(given.t, given.noisy, given.space, lam, **options)


def rms(space: ss.Space, p: Array, q: Array) -> Array:
    """Root mean squared distance of each curve."""
    return np.asarray(np.sqrt(np.mean(space.distance(p, q) ** 2, axis=-1)))


def missed(given: Data, spline: ss.SmoothingSpline) -> Array:
    """Errors of curves; infinite where there is none."""
    points = spline(given.t)
    there = np.isfinite(points).reshape(len(points), -1).all(axis=-1)
    found = np.full(len(points), np.inf)
    found[there] = rms(given.space, points[there], given.truth[there])
    return found


# ---- the flat case ----


def reinsch(t: Array, y: Array, lam: float) -> Array:
    """The smoothing spline at its knots in 50 digits (Green & Silverman 1994, §2.3.3): all is pentadiagonal."""
    with mp.workdps(50):
        x, z, weight = [mp.mpf(float(a)) for a in t], [mp.mpf(float(a)) for a in y], mp.mpf(float(lam))
        h = [b - a for a, b in pairwise(x)]
        n = len(h) - 1
        q = [(1 / h[j], -1 / h[j] - 1 / h[j + 1], 1 / h[j + 1]) for j in range(n)]
        right = [sum(a * z[j + k] for k, a in enumerate(q[j])) for j in range(n)]
        bands = [[(h[j] + h[j + 1]) / 3 for j in range(n)], [h[j + 1] / 6 for j in range(n)], [mp.mpf(0)] * n]
        for j in range(n):
            for d in range(min(3, n - j)):
                bands[d][j] += weight * sum(q[j][k + d] * q[j + d][k] for k in range(3 - d))
        gamma = _pentadiagonal(bands, right)
        pull = [mp.mpf(0)] * (n + 2)
        for j in range(n):
            for k in range(3):
                pull[j + k] += q[j][k] * gamma[j]
        return np.array([float(a - weight * b) for a, b in zip(z, pull, strict=True)])


def _pentadiagonal(bands: Sequence[Sequence[mp.mpf]], right: Sequence[mp.mpf]) -> list[mp.mpf]:
    """LDLᵀ without exchanges."""
    n = len(right)
    d: list[mp.mpf] = []
    one: list[mp.mpf] = []
    two: list[mp.mpf] = []
    x = list(right)
    for j in range(n):
        near = one[j - 1] * d[j - 1] if j > 0 else 0
        far = two[j - 2] * d[j - 2] if j > 1 else 0
        d.append(bands[0][j] - (near * one[j - 1] if j > 0 else 0) - (far * two[j - 2] if j > 1 else 0))
        one.append((bands[1][j] - (near * two[j - 1] if j > 0 else 0)) / d[j])
        two.append(bands[2][j] / d[j])
        x[j] -= (one[j - 1] * x[j - 1] if j > 0 else 0) + (two[j - 2] * x[j - 2] if j > 1 else 0)
    for j in range(n - 1, -1, -1):
        x[j] /= d[j]
        x[j] -= (one[j] * x[j + 1] if j + 1 < n else 0) + (two[j] * x[j + 2] if j + 2 < n else 0)
    return x


def flat_table(counts: Sequence[int] = (60, 2000)) -> str:
    """Largest error of symspline and SciPy."""
    rows = []
    for n in counts:
        for even in (True, False):
            rng = np.random.default_rng(0)
            t = np.linspace(0, 1, n) if even else np.sort(rng.random(n))
            y = np.sin(5 * t) + rng.standard_normal(n)
            row: list[object] = [f"{n}, {'even' if even else 'random'}"]
            for size in (1e-2, 1.0, 1e2, 1e4):
                lam = size * ((t[-1] - t[0]) / (n - 1)) ** 3
                exact = reinsch(t, y, lam)
                own = ss.make_smoothing_spline(t, y[:, None], "r:1", lam)(t)[:, 0]
                other = make_smoothing_spline(t, y, lam=lam)(t)
                row.append(", ".join(f"{np.abs(x - exact).max():.0e}" for x in (own, other)))
            rows.append(row)
    return table(["knots", "λ/h̄³ = 0.01", "1", "100", "10⁴"], rows)


# ---- iterations ----


def iteration_table(
    names: Sequence[str] = tuple(SPACES), sigmas: Sequence[float] = (0.01, 0.1, 0.5), seeds: int = 2
) -> str:
    rows = []
    for name in names:
        for size in sigmas:
            sigma = min(size, LARGEST.get(name, size))
            rows.append([name, f"{sigma:g}", *_both_ways(data(SPACES[name], sigma, seeds))])
    if "S²" in names:
        turns = data("sphere:2", 0.1, seeds, 200, _two_turns)
        rows.append(["S², two turns", "0.1", *_both_ways(turns)])
    head = [
        "space",
        "σ",
        "GCV, default",
        "λ given",
        "linearised to 1e-9",
        "full to 1e-9",
        "difference of the solvers/error",
    ]
    return table(head, rows)


def _two_turns(space: ss.Space, rng: np.random.Generator, t: Array) -> Array:
    return straight(space, rng, t, 4 * np.pi)


def _both_ways(given: Data) -> list[str]:
    """Medians and the most of iterations, and the distance of the two results over the error."""
    chosen = smooth(given, on_failure="ignore")
    again = smooth(given, chosen.lam, on_failure="ignore")
    tight = {"tol": 1e-9, "max_iter": 60, "on_failure": "ignore"}
    exact = smooth(given, chosen.lam, method="newton", **tight)
    error = rms(given.space, exact(given.t), given.truth)
    cells = [_count(s) for s in (chosen, again)]
    flat = smooth(given, chosen.lam, method="linearized", **tight)
    apart = rms(given.space, flat(given.t), exact(given.t)) / error
    good = np.asarray(flat.report.converged) & np.asarray(exact.report.converged)
    return [*cells, _count(flat), _count(exact), f"{apart[good].max():.0e}" if good.any() else "–"]


def _count(spline: ss.SmoothingSpline) -> str:
    good = np.asarray(spline.report.converged)
    if not good.any():
        return "none"
    found = np.sort(np.asarray(spline.report.iterations)[good])
    middle = found[len(found) // 2]
    failed = f", {np.sum(~good)} of {good.size} not" if not good.all() else ""
    most = f" (≤ {found[-1]})" if found[-1] > middle else ""
    return f"{middle}{most}{failed}"


# ---- the choice of λ, and other ways ----

CRITERIA: dict[str, dict[str, Any]] = {
    "GCV": {"gamma": 1.0},
    "GCV 1.4": {"criterion": "gcv", "gamma": 1.4},
    "REML": {"criterion": "reml"},
    "C_p": {"criterion": "cp"},
}
OTHERS = ("tangent + SciPy", "components + SciPy", "moving average*", "local lines*")


class Errors(NamedTuple):
    """Mean errors of one kind of data."""

    best: float
    """At the best λ for each curve."""
    ways: dict[str, float]
    unconverged: int


def errors(
    given: Data, sigma: float, octaves: int = 6, per: float = 2.0, method: str = "linearized"
) -> Errors:
    """Of all ways; λ for the best between ``per**±octaves`` of what GCV chose in the median, by a method."""
    found, chosen, bad = {}, None, 0
    for criterion, options in CRITERIA.items():
        known = {"sigma": sigma} if criterion == "C_p" else {}
        spline = smooth(given, on_failure="ignore", **options, **known)
        chosen = spline if chosen is None else chosen
        bad += int(np.sum(~np.asarray(spline.report.converged)))
        found[criterion] = missed(given, spline)
    assert chosen is not None
    around = np.median(chosen.lam) * per ** np.arange(-octaves, octaves + 1)
    tried = [smooth(given, float(lam), method=method, on_failure="ignore") for lam in around]
    own = [np.where(s.report.converged, missed(given, s), np.inf) for s in tried]
    best = np.min([*own, *found.values()], axis=0)
    for name, each in _other_ways(given).items():
        found[name] = each
    return Errors(float(best.mean()), {name: float(np.mean(each)) for name, each in found.items()}, bad)


def _other_ways(given: Data) -> dict[str, Array]:
    space, t, noisy, truth = given
    windows, lines = peers.moving_averages(len(t)), peers.local_lines(len(t))
    found: dict[str, list[float]] = {name: [] for name in OTHERS}
    for points, true in zip(noisy, truth, strict=True):
        charts = [peers.tangent(space, points), peers.ambient(space, points)]
        for name, chart in zip(OTHERS[:2], charts, strict=True):
            found[name].append(float(rms(space, peers.scipy_spline(t, chart), true)))
        for name, matrices in zip(OTHERS[2:], (windows, lines), strict=True):
            tried = [rms(space, c.points(w @ c.numbers), true) for c in charts for w in matrices]
            found[name].append(float(np.nanmin(tried)))
    return {name: np.array(each) for name, each in found.items()}


def choice_table(
    names: Sequence[str] = tuple(SPACES), sigmas: Sequence[float] = SIGMAS, seeds: int = SEEDS
) -> str:
    """Errors over those at the best λ."""
    rows = []
    for name in names:
        for size in sigmas:
            sigma = min(size, LARGEST.get(name, size))
            rows.append([name, f"{sigma:g}", *_ratios(errors(data(SPACES[name], sigma, seeds), sigma))])
    return table(["space", "σ", "best", *CRITERIA, *OTHERS], rows)


def _ratios(found: Errors) -> list[str]:
    mark = f" ({found.unconverged} †)" if found.unconverged else ""
    return [f"{found.best:.3g}{mark}", *(f"{error / found.best:.2f}" for error in found.ways.values())]


def _one_turn(space: ss.Space, rng: np.random.Generator, t: Array) -> Array:
    return straight(space, rng, t, 2 * np.pi)


def _long_way(space: ss.Space, rng: np.random.Generator, t: Array) -> Array:
    return wander(space, rng, t, 20, 0.6)


def hard_table(seeds: Sequence[int] = (24, 3), names: Sequence[str] = ("S²", "SO(3)", "H²")) -> str:
    """Geodesics of length 2π, and paths of 20 steps."""
    rows = []
    for words, motion, curves, count, sigmas in (
        ("geodesic", _one_turn, seeds[0], 100, (0.02, 0.1)),
        ("20 steps", _long_way, seeds[1], 300, (0.02, 0.1)),
    ):
        for name in names:
            for sigma in sigmas:
                given = data(SPACES[name], sigma, curves, count, motion)
                rows.append(
                    [f"{words}, {name}", f"{sigma:g}", *_ratios(errors(given, sigma, 4, 4.0, "auto"))]
                )
    return table(["motion", "σ", "best", *CRITERIA, *OTHERS], rows)


# ---- bands ----


def coverage_table(
    names: Sequence[str] = tuple(SPACES), sigmas: Sequence[float] = SIGMAS, seeds: int = 100
) -> str:
    """How many true points are in the 95 % bands: all, those at the two ends, and at the five times beside each."""
    rows = []
    for name in names:
        row: list[object] = [name]
        for size in sigmas:
            sigma = min(size, LARGEST.get(name, size))
            given = data(SPACES[name], sigma, seeds)
            spline = smooth(given, on_failure="ignore")
            inside = given.space.distance(spline(given.t), given.truth) <= spline.band(given.t)
            ends, beside = inside[:, [0, -1]].mean(), np.r_[inside[:, 1:6], inside[:, -6:-1]].mean()
            mark = "" if sigma == size else f" (σ = {sigma:g})"
            row.append(f"{inside.mean():.3f}, {beside:.2f}, {ends:.2f}{mark}")
        rows.append(row)
    return table(["space", *(f"σ = {sigma:g}" for sigma in sigmas)], rows)


# ---- outliers ----


def outlier_table(names: Sequence[str] = tuple(SPACES), sigma: float = 0.1, seeds: int = 12) -> str:
    """Errors without outliers, with them, and where those who know which they are leave them out."""
    losses = ("linear", "huber", "cauchy")
    rows = []
    for name in names:
        given = data(SPACES[name], sigma, seeds)
        rng = np.random.default_rng(0)
        bad = rng.random(given.noisy.shape[:2]) < 0.15
        dirty = given.noisy.copy()
        far = given.space.random_tangent(rng, given.truth[bad])
        dirty[bad] = given.space.exp(given.truth[bad], 12 * sigma * far)
        found, failed = [], 0
        for noisy in (given.noisy, dirty):
            for loss in losses:
                spline = smooth(given._replace(noisy=noisy), loss=loss, on_failure="ignore")
                found.append(float(missed(given, spline).mean()))
                failed += int(np.sum(~np.asarray(spline.report.converged)))
        told = smooth(given._replace(noisy=dirty), weights=np.where(bad, 0.0, 1.0))
        ratio = f"{found[5] / found[0]:.2f}{f' ({failed} †)' if failed else ''}"
        spared = f"{missed(given, told).mean() / found[0]:.2f}"
        rows.append([name, *(f"{error:.4f}" for error in found), ratio, spared])
    head = [
        "space",
        *losses,
        *(f"15 %: {loss}" for loss in losses),
        "cauchy/clean, linear",
        "outliers removed*/clean",
    ]
    return table(head, rows)


# ---- time ----


def time_table(counts: Sequence[int] = (1000, 10_000, 100_000), repeats: int = 5) -> str:
    """Medians of interleaved calls."""
    rows: list[list[object]] = []
    for n in counts:
        ways, taken = _timed(n)
        found = _medians(ways, repeats)
        first, *rest = found.items()
        cells = [_readable(first[1]), *(f"{_readable(time)} ({time / first[1]:.0f})" for _, time in rest)]
        rows.append([n, *cells, *[None] * (len(TIMED) - len(cells)), taken])
    return table(["points", *TIMED, "knots used"], rows)


TIMED = (
    "CubicSpline",
    "λ given, all knots",
    "GCV, all knots",
    "λ given",
    "GCV",
    "GCV, cauchy",
    "SciPy, GCV, one component",
)


def _timed(count: int) -> tuple[dict[str, Callable[[], object]], int]:
    """What is timed, and how many knots a spline takes if it may."""
    space, t, (noisy,), (truth,) = data("sphere:2", 0.1, 1, count)
    spline = ss.make_smoothing_spline(t, noisy, space)
    ways: list[Callable[[], object]] = [
        lambda: ss.CubicSpline(t, truth, space),
        lambda: ss.make_smoothing_spline(t, noisy, space, spline.lam, knots=t),
        lambda: ss.make_smoothing_spline(t, noisy, space, knots=t),
        lambda: ss.make_smoothing_spline(t, noisy, space, spline.lam),
        lambda: ss.make_smoothing_spline(t, noisy, space),
        lambda: ss.make_smoothing_spline(t, noisy, space, loss="cauchy"),
        lambda: make_smoothing_spline(t, noisy[:, 0]),
    ]
    kept = ways if count <= 10_000 else ways[:-1]
    return dict(zip(TIMED, kept, strict=False)), len(spline.points)


def _medians(ways: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    seconds: dict[str, list[float]] = {name: [] for name in ways}
    for round_ in range(repeats + 1):
        for name, way in ways.items():
            if round_ > 1 and name.startswith("SciPy") and seconds[name][0] > 2:
                continue
            begin = time.perf_counter()
            way()
            # The first round warms up.
            if round_ or name.startswith("SciPy"):
                seconds[name].append(time.perf_counter() - begin)
    return {name: float(np.median(each)) for name, each in seconds.items()}


def _readable(seconds: float) -> str:
    if seconds >= 1:
        return f"{seconds:.2g} s"
    return f"{1e3 * seconds:.2g} ms" if seconds < 0.1 else f"{1e3 * seconds:.0f} ms"


PARTS: dict[str, Callable[[], str]] = {
    "flat": flat_table,
    "iterations": iteration_table,
    "choice": choice_table,
    "hard": hard_table,
    "coverage": coverage_table,
    "outliers": outlier_table,
    "time": lambda: f"{time_table()}\n\n{versions('symspline', 'scipy')}",
}


def main() -> None:
    arguments = parser(__doc__)
    arguments.add_argument("parts", nargs="*", metavar="PART", help="tables to make; all by default")
    asked = arguments.parse_args()
    ss.set_num_threads(1)
    for part in asked.parts or PARTS:
        text = PARTS[part]()
        print(f"{part}\n\n{text}\n", flush=True)
        if asked.write:
            insert(part, text, PAGE)


if __name__ == "__main__":
    main()

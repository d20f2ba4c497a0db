"""Cost of a fit against the number of knots."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from . import memory
from .data import Array, Sizes
from .side_by_side import ALL_CORES
from .tables import count, table
from .timing import Result, Timing, seconds

Built = Mapping[int, Mapping[str, Result]]
LINES = ("symspline", ALL_CORES, "RotationSpline")


def text(built: Built) -> str:
    """Time and time per knot; slopes; the goal."""
    rows = [
        [count(n), *(cell for name in LINES for cell in _cells(n, found.get(name)))]
        for n, found in built.items()
    ]
    head = ("knots", "one core", "per knot", "all cores", "per knot", "RotationSpline", "per knot")
    return f"{table(head, rows)}\n\n{_slopes(built)}{_goal(built)}"


def memory_text(walk: Array, sizes: Sizes) -> str:
    """Peak memory of a fit on all cores, by number of knots."""
    rows = []
    for n in sizes.knots:
        if n >= sizes.least_memory:
            size = memory.of_fit(walk[:n])
            beyond = size["growth"] - size["output"]
            rows.append([count(n), *(f"{value / 1e6:.1f}" for value in (*size.values(), beyond))])
    head = ("knots", "input, MB", "output, MB", "growth of the peak, MB", "of it beyond the output, MB")
    return table(head, rows)


def slope(built: Built, name: str) -> float | None:
    """Exponent p of time ~ Nᵖ over N >= 1000, by least squares; None with fewer than two times."""
    found = {n: results.get(name) for n, results in built.items() if n >= 1000}
    points = [(n, time.median) for n, time in found.items() if isinstance(time, Timing)]
    if len(points) < 2:
        return None
    logs = np.log(points)
    return float(np.polyfit(logs[:, 0], logs[:, 1], 1)[0])


def draw(built: Built, file: Path) -> None:
    """Time against number of knots."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
    looks = (("tab:blue", "o", "one core"), ("tab:green", "s", "all cores"), ("tab:red", "^", ""))
    for name, (colour, marker, cores) in zip(LINES, looks, strict=True):
        found = {n: results.get(name) for n, results in built.items()}
        points = [(n, time.median) for n, time in found.items() if isinstance(time, Timing)]
        label = f"symspline, {cores}" if cores else "SciPy RotationSpline"
        if points:
            axes.loglog(*np.transpose(points), color=colour, marker=marker, markersize=5, label=label)
    axes.set(xlabel="number of knots", ylabel="time of the fit, s", title="C² spline through rotations")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    figure.savefig(file, dpi=120)
    plt.close(figure)


def _cells(n: int, result: Result | None) -> list[object]:
    per_knot = seconds(result.median / n) if isinstance(result, Timing) else None
    return [result, per_knot]


def _slopes(built: Built) -> str:
    slopes = {name: slope(built, name) for name in LINES}
    parts = [f"{name} {value:.2f}" for name, value in slopes.items() if value is not None]
    return f"Slope of log time against log knots, from 1000 knots on: {'; '.join(parts)} (1 is linear)."


def _goal(built: Built) -> str:
    """Ten million knots in two seconds, as a user would call it: on all cores."""
    if 10**7 not in built:
        return ""
    result = built[10**7][ALL_CORES]
    reached = isinstance(result, Timing) and result.median < 2
    return f" Goal for 10⁷ knots on all cores: under 2 s, {'reached' if reached else 'not reached'}."

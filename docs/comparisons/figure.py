"""Errors against the number of points, both logarithmic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

LOOKS = (("#1f5fa8", "o"), ("#2f8f5b", "s"), ("#c0392b", "^"), ("#b8860b", "D"))
DASHES = {2: "--", 4: ":"}


def loglog(
    file: Path,
    sizes: Sequence[int],
    lines: Mapping[str, Sequence[float]],
    slopes: Mapping[str, int],
    ylabel: str,
    title: str,
) -> None:
    """One line per method, and below the last points of those in ``slopes`` a line of that order."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4.6), layout="constrained")
    axes = figure.subplots()
    axes.set_xscale("log")
    axes.set_yscale("log")
    for (name, values), (colour, marker) in zip(lines.items(), LOOKS, strict=False):
        axes.plot(sizes, values, color=colour, marker=marker, markersize=5, label=name)
    guided = set()
    ends = np.array(sizes[-3:])
    for name, order in slopes.items():
        guide = 0.35 * lines[name][-1] * ((ends[-1] - 1) / (ends - 1)) ** order
        label = None if order in guided else f"order {order}"
        axes.plot(ends, guide, color="#555555", linestyle=DASHES[order], linewidth=1, label=label)
        guided.add(order)
    axes.set_xticks(sizes, [str(size) for size in sizes])
    axes.minorticks_off()
    axes.set(xlabel="number of points", ylabel=ylabel, title=title)
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=9)
    figure.savefig(file, dpi=120)

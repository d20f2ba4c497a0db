"""The figures of ``solvers_tables.md``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

Array = NDArray[np.float64]

MARKERS = ("o", "^", "s")
SEA, SAND, RED = "#bcd9ee", "#f3c98b", "#c0392b"
COLOURS = {"fixed-point": "#1f5fa8", "quasi-newton": "#2f8f5b", "newton": RED}


class Points(NamedTuple):
    """Measured curves: K D, K V, contraction and whether the iteration converged."""

    kd: Array
    kv: Array
    rate: Array
    converged: NDArray[np.bool_]


def roots(kd: Array, kv: Array) -> tuple[Array, Array, Array]:
    """Where (38) holds: K D, and the smallest and the largest K V of those given."""
    u = kd[:, None] + 2 * kv
    with np.errstate(divide="ignore", invalid="ignore"):
        holds = (u < np.pi) & (0.5 * u / np.sin(u) * (u - kv) <= kv)
    some = holds.any(axis=1)
    first, last = holds.argmax(axis=1), len(kv) - 1 - holds[:, ::-1].argmax(axis=1)
    return kd[some], kv[first[some]], kv[last[some]]


def contraction(kd: Array, kv: Array) -> Array:
    """The bound of the contraction of Algorithm 1 where handles are at most V (docs/convergence.md)."""
    ku = kd + 2 * kv
    stretch = np.sinh(kv) / kv
    own = (2 - ku / np.tan(ku)) * stretch - 1 + ku * (np.cosh(kv) - 1) / kv
    return np.where(ku < np.pi, (ku / np.sin(ku) * stretch + own) / 2, np.inf)


def region(found: Mapping[str, Points]) -> Figure:
    """The paper's Figure 10 with measurements: near the region of (38), and everywhere."""
    figure = Figure(figsize=(10, 4.6), layout="constrained")
    near, everywhere = figure.subplots(1, 2)
    kd, low, high = roots(np.linspace(1e-4, 0.27, 1500), np.linspace(1e-4, 1.0, 5000))
    for ax in (near, everywhere):
        ax.fill_between(kd, low, high, color=SEA, linewidth=0, zorder=0)
        ax.plot(kd, low, color="#31688e", linewidth=1, zorder=1)
        grid = np.meshgrid(np.linspace(1e-4, 1.6, 600), np.linspace(1e-4, 0.6, 300))
        ax.contourf(*grid, contraction(*grid), levels=[0, 1], colors=[SAND], alpha=0.6, zorder=0)
        for points, marker in zip(found.values(), MARKERS, strict=False):
            dots = _draw(ax, points, marker)
        ax.set(xlabel="K D", ylabel="K V")
        ax.spines[["top", "right"]].set_visible(False)
    near.set(xlim=(0, 0.36), ylim=(0, 1), title="Region of Theorem 3.1")
    near.text(0.04, 0.6, "(38) holds: handles stay below V", fontsize=10, color="#31688e")
    near.text(0.275, 0.23, "α < 1:\nsweeps\ncontract", fontsize=10, color="#9a5b00")
    near.text(0.12, 0.01, "longest handles of the solutions", fontsize=9, color="#333333")
    everywhere.set(xlim=(0, 3.1), ylim=(0, 2.1), title="Everywhere")
    for name, marker in zip(found, MARKERS, strict=False):
        everywhere.scatter([], [], marker=marker, s=18, color="#777777", label=name)
    everywhere.scatter([], [], marker="x", s=22, color=RED, label="not in 10 000 sweeps")
    everywhere.legend(frameon=False, fontsize=9, loc="upper left", bbox_to_anchor=(0.1, 1.0))
    figure.colorbar(dots, ax=[near, everywhere], label="contraction of the residual per sweep", shrink=0.9)
    return figure


def _draw(ax: Any, points: Points, marker: str) -> Any:
    good = points.converged
    dots = ax.scatter(
        points.kd[good],
        points.kv[good],
        c=points.rate[good],
        marker=marker,
        s=18,
        cmap="viridis",
        vmin=0.45,
        vmax=1.0,
        zorder=2,
    )
    ax.scatter(points.kd[~good], points.kv[~good], marker="x", s=22, color=RED, linewidth=1, zorder=3)
    return dots


def sweeps(curves: Mapping[str, Mapping[str, Sequence[float]]]) -> Figure:
    """Residuals against the number of evaluations."""
    figure = Figure(figsize=(9, 6.4), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for ax, (title, lines) in zip(axes.flat, curves.items(), strict=True):
        ax.set_yscale("log")
        for name, values in lines.items():
            steps = np.arange(2, len(values) + 2)
            ax.plot(steps, values, color=COLOURS[name], marker="o", markersize=3.5, linewidth=1.2, label=name)
        sweep = np.arange(2, 46)
        half = lines["fixed-point"][0] * 0.5 ** (sweep - 2.0)
        ax.plot(sweep, half, "--", color="#777777", linewidth=1, label="rate ½")
        ax.set(title=title, ylim=(1e-17, 3), xlim=(0, 51))
        ax.grid(alpha=0.25)
        ax.spines[["top", "right"]].set_visible(False)
    for ax in axes[:, 0]:
        ax.set_ylabel("residual")
    for ax in axes[1]:
        ax.set_xlabel("evaluations of the C² condition")
    axes[0, 0].legend(frameon=False, fontsize=9)
    return figure

"""Curves in R¹, R² and R³."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import FigureBase
from matplotlib.ticker import MaxNLocator
import numpy as np

from .curves import Curve
from .style import EDGE, GRID, INK, inside, plain, window
from .timeline import timelines


def draw_graph(panel: FigureBase, curves: Sequence[Curve]) -> None:
    """R¹: the graph."""
    (axes,) = timelines(panel, curves, ["x"])
    for curve in curves:
        curve.draw_line(axes, np.column_stack([curve.times, curve.points]))
        curve.draw_dots(axes, np.column_stack([curve.times, curve.points])[curve.knots])


def draw_plane(panel: FigureBase, curves: Sequence[Curve]) -> None:
    """R²: the curve, with equal scales."""
    axes = panel.add_axes(inside(panel, 0.8, 0.55, 0.25, 0.2))
    plain(axes)
    axes.set(xlabel="x₁", ylabel="x₂")
    for curve in curves:
        curve.draw_line(axes, curve.points)
        curve.draw_dots(axes, curve.spline.points)
    axes.set_aspect("equal", adjustable="datalim")


def draw_room(panel: FigureBase, curves: Sequence[Curve]) -> None:
    """R³: the curve in a box with equal scales, and its shadow on the floor."""
    axes: Any = panel.add_axes(inside(panel, 0.1, 0.15, 0.35, 0.0), projection="3d")
    middle, half = window(np.concatenate([curve.points for curve in curves]), 1.1)
    half = half or 1.0
    axes.set(**{f"{a}lim": (m - half, m + half) for a, m in zip("xyz", middle, strict=True)})
    for curve in curves:
        shadow = curve.points.copy()
        shadow[:, 2] = middle[2] - half
        curve.draw_line(axes, shadow, color=GRID, linewidth=1.2, zorder=2)
        curve.draw_line(axes, curve.points)
        curve.draw_dots(axes, curve.spline.points)
    _light(axes)


def _light(axes: Any) -> None:
    """White walls with faint lines."""
    axes.set_facecolor("none")
    axes.tick_params(labelcolor=INK, labelsize=8, pad=0)
    axes.view_init(elev=24, azim=-58)
    for axis, label in ((axes.xaxis, "x₁"), (axes.yaxis, "x₂"), (axes.zaxis, "x₃")):
        axis.set_pane_color("white")
        axis.pane.set_edgecolor(GRID)
        axis.line.set_color(EDGE)
        axis._axinfo["grid"].update(color=GRID, linewidth=0.6)
        axis.set_major_locator(MaxNLocator(5))
        axis.label.set(text=label, color=INK, fontsize=10)

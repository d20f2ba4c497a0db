"""Curves in R¹, R² and R³."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from .bands import CIRCLE, draw_strip, draw_tube, places_of_discs
from .curves import Curve
from .style import EDGE, GRID, INK, inside, plain, window
from .timeline import timelines


def draw_graph(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """R¹: the graph."""
    (axes,) = timelines(panel, curves, ["x"])
    for curve in curves:
        line, given = curve.marked(np.ravel)
        if curve.radii is not None:
            draw_strip(axes, curve, line, curve.radii)
        curve.draw_line(axes, np.column_stack([curve.times, line]))
        curve.draw_dots(axes, np.column_stack([curve.on_axis(curve.given_x), given]))


def draw_plane(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """R²: the curve, with equal scales."""
    axes = plane(panel)
    for curve in curves:
        if curve.radii is not None:
            some = places_of_discs(curve)
            draw_tube(axes, curve, curve.points[some, None] + curve.radii[some, None, None] * CIRCLE)
        curve.draw_line(axes, curve.points)
        curve.draw_dots(axes, curve.given)


def draw_room(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """R³: the curve in a box with equal scales, and its shadow on the floor."""
    axes = room(panel, [curve.points for curve in curves], others=[curve.given for curve in curves])
    for curve in curves:
        if curve.radii is not None:
            _draw_hose(axes, curve, curve.radii)
        curve.draw_line(axes, curve.points)
        curve.draw_dots(axes, curve.given)


def _draw_hose(axes: Any, curve: Curve, radii: NDArray[np.float64]) -> None:
    """The surface at these distances from a curve in space."""
    some = places_of_discs(curve)[::2]
    along = np.gradient(curve.points[some], axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    aside = np.empty_like(along)
    last = np.eye(3)[np.abs(along[0]).argmin()]
    for i, direction in enumerate(along):
        # It turns as little as it can.
        last = last - (last @ direction) * direction
        last = aside[i] = last / np.linalg.norm(last)
    frame = np.stack([aside, np.cross(along, aside)], axis=1)
    ring = np.concatenate([CIRCLE, CIRCLE[:1]]) @ frame * radii[some, None, None]
    x, y, z = np.moveaxis(curve.points[some, None] + ring, -1, 0)
    look: Any = {"color": curve.color, "alpha": 0.08, "linewidth": 0, "shade": False}
    axes.plot_surface(x, y, z, rstride=1, cstride=2, antialiased=False, **look)


def plane(panel: SubFigure) -> Axes:
    """Axes with equal scales."""
    axes = panel.add_axes(inside(panel, 0.8, 0.55, 0.25, 0.2))
    plain(axes)
    axes.set(xlabel="x₁", ylabel="x₂")
    axes.set_aspect("equal", adjustable="datalim")
    return axes


def room(
    panel: SubFigure,
    lines: Sequence[NDArray[np.float64]],
    margin: float = 1.1,
    below: float = 0.1,
    others: Sequence[NDArray[np.float64]] = (),
) -> Any:
    """A box with equal scales around lines of shape (m, 3), with their shadows on the floor.

    Args:
        margin: width of the box as a multiple of that of the lines.
        below: inches that are left free.
        others: places that are in the box, too.
    """
    axes: Any = panel.add_axes(inside(panel, 0.0, below, 0.3, 0.0), projection="3d")
    everything = np.concatenate([*lines, *others])
    middle, half = window(everything, margin)
    half = half or 1.0
    axes.set(**{f"{a}lim": (m - half, m + half) for a, m in zip("xyz", middle, strict=True)})
    for line in lines:
        shadow = line.copy()
        shadow[:, 2] = middle[2] - half
        axes.plot(*shadow.T, color=GRID, linewidth=1.2, zorder=2)
    _light(axes)
    spread = {azimuth: np.std(_sideways(everything, azimuth)) for azimuth in (-60, -30, 30, 60)}
    axes.view_init(elev=24, azim=max(spread, key=spread.__getitem__))
    return axes


def _sideways(points: NDArray[np.float64], azimuth: float) -> NDArray[np.float64]:
    """How far to the right points are, seen from an azimuth."""
    angle = np.radians(azimuth)
    right: NDArray[np.float64] = points[:, 1] * np.cos(angle) - points[:, 0] * np.sin(angle)
    return right


def _light(axes: Any) -> None:
    """White walls with faint lines."""
    axes.set_facecolor("none")
    axes.tick_params(color=EDGE, labelcolor=INK, labelsize=8, pad=0)
    axes.set_box_aspect((1, 1, 1), zoom=0.9)
    for axis, label in ((axes.xaxis, "x₁"), (axes.yaxis, "x₂"), (axes.zaxis, "x₃")):
        axis.set_pane_color("white")
        axis.pane.set_edgecolor(GRID)
        axis.line.set_color(EDGE)
        axis._axinfo["grid"].update(color=GRID, linewidth=0.6)
        axis.set_major_locator(MaxNLocator(5))
        axis.label.set(text=label, color=INK, fontsize=10)

"""Curves in R² and R³."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.ticker import MaxNLocator

from .curves import CIRCLE, Curve, disc_indices, draw_in_plane
from .style import EDGE, GRID, INK, Array, inside, plain, window


def draw_plane(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw curves in R² with equal scales."""
    axes = plane(panel)
    for curve in curves:
        draw_in_plane(axes, curve, np.asarray, lambda p, radii: p[:, None] + radii[:, None, None] * CIRCLE)


def draw_3d(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw curves in R³ in a box with equal scales, with their shadows on the floor."""
    axes = box(panel, [curve.points for curve in curves], [curve.given for curve in curves])
    for curve in curves:
        if curve.radii is not None:
            _draw_hose(axes, curve, curve.radii)
        curve.draw_line(axes, curve.points)
        curve.draw_dots(axes, curve.given)


def _draw_hose(axes: Any, curve: Curve, radii: Array) -> None:
    """Draw the surface at given distances from a curve in R³."""
    discs = disc_indices(curve)[::2]
    along = np.gradient(curve.points[discs], axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    aside = np.empty_like(along)
    last = np.eye(3)[np.abs(along[0]).argmin()]
    for i, direction in enumerate(along):
        # The next normal vector is the projection of the last one, so that the frame does not twist.
        last = last - (last @ direction) * direction
        last = aside[i] = last / np.linalg.norm(last)
    frame = np.stack([aside, np.cross(along, aside)], axis=1)
    ring = np.concatenate([CIRCLE, CIRCLE[:1]]) @ frame * radii[discs, None, None]
    x, y, z = np.moveaxis(curve.points[discs, None] + ring, -1, 0)
    look: Any = {"color": curve.color, "alpha": 0.08, "linewidth": 0, "shade": False}
    axes.plot_surface(x, y, z, rstride=1, cstride=2, antialiased=False, **look)


def plane(panel: SubFigure) -> Axes:
    """Add axes with equal scales."""
    axes = panel.add_axes(inside(panel, 0.8, 0.55, 0.25, 0.2), xlabel="x₁", ylabel="x₂")
    plain(axes)
    axes.set_aspect("equal", adjustable="datalim")
    return axes


def box(
    panel: SubFigure, lines: Sequence[Array], others: Sequence[Array], margin: float = 1.1, below: float = 0.1
) -> Any:
    """Add a box with equal scales around lines of shape (m, 3), with their shadows on the floor.

    The box contains the points ``others``, too. Its width is ``margin`` times that of the lines, and ``below`` inches
    under it stay empty.
    """
    axes: Any = panel.add_axes(inside(panel, 0.0, below, 0.3, 0.0), projection="3d", facecolor="none")
    everything = np.concatenate([*lines, *others])
    middle, half = window(everything, margin)
    half = half or 1.0
    for line in lines:
        axes.plot(*line.T[:2], np.full(len(line), middle[2] - half), color=GRID, linewidth=1.2, zorder=2)
    axes.tick_params(color=EDGE, labelcolor=INK, labelsize=8, pad=0)
    axes.set_box_aspect((1, 1, 1), zoom=0.9)
    for axis, number, name in zip("xyz", middle, "₁₂₃", strict=True):
        getattr(axes, f"set_{axis}lim")(number - half, number + half)
        # White walls with faint lines.
        wall = getattr(axes, f"{axis}axis")
        wall.set_pane_color("white")
        wall.pane.set_edgecolor(GRID)
        wall.line.set_color(EDGE)
        wall._axinfo["grid"].update(color=GRID, linewidth=0.6)
        wall.set_major_locator(MaxNLocator(5))
        wall.label.set(text=f"x{name}", color=INK, fontsize=10)
    # Choose the direction from which the curve looks widest.
    angles = np.radians([-60, -30, 30, 60])
    right = everything[:, 1:2] * np.cos(angles) - everything[:, :1] * np.sin(angles)
    axes.view_init(elev=24, azim=(-60, -30, 30, 60)[np.std(right, axis=0).argmax()])
    return axes

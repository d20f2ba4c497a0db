"""Panels below the figure of an estimated curve: bands, and residuals of measurements that are not points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D

from .._curves.curve import SidePanel
from .curves import ALPHA, Curve
from .graphs import timelines
from .rates import NORMAL
from .style import BOTTOM, DATA, DISTINCT, EDGE, INK, TOP, legend, points

_HEIGHT = 1.35
_LEAST = 3.6
"""The smallest limit of the vertical axis. Residuals far beyond most others are drawn at the edge."""


def panels_of(spline: Any, curve: Curve, has_band: Sequence[bool]) -> list[SidePanel]:
    """Return the panels of a spline, without the bands of factors whose picture shows them; a batch has none."""
    if not curve.alone or curve.is_mean:
        return []
    panels = spline._panels_below(curve.x)
    return [own for own in panels if len(own.x) and (own.factor is None or not has_band[own.factor])]


def height(panels: Sequence[SidePanel]) -> float:
    """Return the height of the panels in inches."""
    return BOTTOM + TOP + _HEIGHT * len(panels)


def draw(panel: SubFigure, curve: Curve, panels: Sequence[SidePanel]) -> None:
    """Draw radii of bands, and residuals in standard deviations."""
    columns = timelines(panel, [curve], [own.label for own in panels], marked=False)
    for axes, own in zip(columns, panels, strict=True):
        (_draw_residuals if own.factor is None else _draw_radii)(axes, curve, own)


def _draw_radii(axes: Axes, curve: Curve, own: SidePanel) -> None:
    """Draw the radius of a band against time."""
    radii = own.values[:, 0]
    axes.fill_between(curve.times, 0, radii, color=curve.color, alpha=ALPHA, linewidth=0, label="band")
    axes.plot(curve.times, radii, color=curve.color, linewidth=1.2)
    axes.set_ylim(0, 1.15 * radii.max())
    words = "radius of the ball that contains the true point with 95 % probability"
    axes.text(1, 1.02, words, transform=axes.transAxes, ha="right", va="bottom", color=INK, fontsize=points(9))


def _draw_residuals(axes: Axes, curve: Curve, own: SidePanel) -> None:
    """Draw residuals, and the limits between which 95 % of them should lie."""
    times = curve.on_axis(own.x)
    values = own.values
    sizes = np.abs(values)
    top = max(_LEAST, min(1.1 * float(sizes.max()), 1.5 * float(np.quantile(sizes, 0.99))))
    axes.set_ylim(-top, top)
    axes.axhspan(-NORMAL, NORMAL, facecolor=curve.color, alpha=0.08, linewidth=0, zorder=0.6, label="95 %")
    axes.axhline(0.0, color=EDGE, linewidth=0.8, zorder=1)
    size = float(np.clip(40 / np.sqrt(values.size), 1.2, 3.5))
    look: Any = {"linestyle": "none", "markeredgewidth": 0, "zorder": 3, "rasterized": values.size > 5000}
    colors = DISTINCT if own.names else [DATA]
    for k, column in enumerate(values.T):
        color = colors[k % len(colors)]
        inside = np.abs(column) <= top
        axes.plot(times[inside], column[inside], marker="o", markersize=size, color=color, alpha=0.6, **look)
        for sign, marker in ((1, "^"), (-1, "v")):
            far = sign * column > top
            edge = np.full(int(far.sum()), 0.95 * sign * top)
            axes.plot(times[far], edge, marker=marker, markersize=6, color=color, **look)
    words = f"{100 * np.mean(sizes > NORMAL):.1f} % beyond ±{NORMAL} (5 % expected)"
    beyond = int((sizes > top).sum())
    words += f"; {beyond} beyond the axis (triangles)" if beyond else ""
    axes.text(1, 1.02, words, transform=axes.transAxes, ha="right", va="bottom", color=INK, fontsize=points(9))
    if own.names:
        handles = [Line2D([], [], linestyle="none", marker="o", markersize=5, color=color) for color in DISTINCT]
        place: Any = {"loc": "lower left", "bbox_to_anchor": (0, 1), "borderaxespad": 0}
        legend(axes, handles[: len(own.names)], list(own.names), handlelength=0.8, columnspacing=1.2, **place)

"""Colours, sizes and the look of axes, the same in all pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps, dates
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

EDGE, GRID, INK, PAPER = "#a8a18f", "#b9c8d1", "#22303a", "#eff4f7"
SPLINE = "#0b559f"
DATA = "#7d8f9c"
"""Of noisy data beside the only curve."""
GAP = "#faeee4"
"""Of bands where points are missing."""
DISTINCT = ["#0b559f", "#d95f0e", "#009e73", "#cc79a7", "#56b4e9", "#8a6d00"]
"""Colours that colour-blind readers tell apart too."""
AXES = ["#d55e00", "#009e73", "#0072b2"]
"""Red, green and blue for the axes of a frame, in shades that colour-blind readers tell apart."""
HALO = [withStroke(linewidth=2.5, foreground="white", alpha=0.85)]
DPI = 150
DATES: Any = dates
"""The module of matplotlib, which has no types."""


def colors(number: int) -> list[Any]:
    """A colour a curve: the house colour for one, from dark to light for many."""
    return [SPLINE] if number == 1 else list(colormaps["viridis"](np.linspace(0, 0.85, number)))


def heading(figure: Figure, title: str, subtitle: str, height: float) -> None:
    """Title and subtitle in the upper left corner."""
    figure.text(0.03, height, title, color=INK, fontsize=18, weight="bold")
    figure.text(0.03, height - 0.3 / figure.get_figheight(), subtitle, color=INK, fontsize=12)


def size(panel: SubFigure) -> tuple[float, float]:
    """Width and height in inches."""
    return panel.bbox.width / panel.dpi, panel.bbox.height / panel.dpi


def inside(
    panel: SubFigure, left: float, bottom: float, right: float, top: float
) -> tuple[float, float, float, float]:
    """The rectangle, for ``add_axes``, with these margins in inches."""
    width, height = size(panel)
    return left / width, bottom / height, 1 - (left + right) / width, 1 - (bottom + top) / height


def plain(axes: Axes) -> None:
    """Light axes with a faint grid and no box."""
    axes.set_facecolor("none")
    axes.grid(color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(EDGE)
    axes.tick_params(color=EDGE, labelcolor=INK, labelsize=9)
    for axis in (axes.xaxis, axes.yaxis):
        axis.label.set(color=INK, fontsize=10)
        axis.offsetText.set(color=INK, fontsize=9)


def window(places: NDArray[np.float64], margin: float) -> tuple[NDArray[np.float64], float]:
    """Centre and half width of the square, or cube, around places of shape (m, n)."""
    low, high = places.min(axis=0), places.max(axis=0)
    return (low + high) / 2, margin * float((high - low).max()) / 2

"""Colours, sizes and the look of axes, the same in all pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps, dates
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

EDGE, GRID, INK, PAPER = "#a8a18f", "#b9c8d1", "#22303a", "#eff4f7"
SPLINE = "#0b559f"
DATA = "#7d8f9c"
"""Of noisy data beside the only curve."""
GAP = "#faeee4"
"""Of bands where points are missing."""
DISTINCT = ["#0b559f", "#d95f0e", "#009e73", "#cc79a7", "#56b4e9", "#8a6d00"]
"""Colours that colour-blind readers can distinguish, too."""
AXES = ["#d55e00", "#009e73", "#0072b2"]
"""Red, green and blue for the axes of a frame, in shades that colour-blind readers can distinguish."""
HALO = [withStroke(linewidth=2.5, foreground="white", alpha=0.85)]
DPI = 150
DATES: Any = dates
"""The module of Matplotlib, which has no types."""


def colors(number: int) -> list[Any]:
    """One colour per curve: the house colour for one, from dark to light for many."""
    return [SPLINE] if number == 1 else list(time_colors(np.linspace(0, 1, number)))


def time_colors(share: Any) -> Any:
    """Colours from dark to light for numbers from 0 to 1."""
    return colormaps["viridis"](0.85 * share)


def heading(figure: Figure, title: str, subtitle: str, height: float) -> None:
    """Title and subtitle in the upper left corner."""
    figure.text(0.03, height, title, color=INK, fontsize=18, weight="bold")
    figure.text(0.03, height - 0.3 / figure.get_figheight(), subtitle, color=INK, fontsize=12)


def note(panel: SubFigure, text: str) -> None:
    """A line below a picture."""
    panel.text(0.5, 0.02, text, ha="center", color=INK, fontsize=9)


def legend(axes: Axes, handles: list[Any], labels: list[str], **look: Any) -> None:
    """A legend without a frame."""
    axes.legend(handles, labels, frameon=False, labelcolor=INK, fontsize=9, **look)


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


def show_dates(axes: Axes, least: int, most: int) -> None:
    """Dates below axes over time, at least and at most so many."""
    locator = DATES.AutoDateLocator(minticks=least, maxticks=most)
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(DATES.ConciseDateFormatter(locator))


def window(places: Array, margin: float) -> tuple[Array, float]:
    """Centre and half width of the square, or cube, around places of shape (m, n)."""
    low, high = places.min(axis=0), places.max(axis=0)
    return (low + high) / 2, margin * float((high - low).max()) / 2


def evenly(count: int, most: int) -> Indices:
    """At most so many of the numbers from 0 to count − 1, evenly."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))


def closest(steps: Any, value: float) -> float:
    """The step whose ratio to a value is closest to 1."""
    return float(steps[np.abs(np.log(steps / value)).argmin()])

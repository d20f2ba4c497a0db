"""Colours, sizes and the look of axes, which all pictures share."""

from __future__ import annotations

import re
from textwrap import fill
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from matplotlib import colormaps, dates, rcParams
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase, SubFigure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import ScalarFormatter
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

EDGE, GRID, INK, PAPER = "#a8a18f", "#b9c8d1", "#22303a", "#eff4f7"
SPLINE = "#0b559f"
DATA = "#7d8f9c"
"""Colour of noisy data if there is one curve."""
MARK = "#c4402f"
"""Colour of the outline of a frame on a globe."""
GAP = "#faeee4"
"""Colour of long gaps between points."""
DISTINCT = ["#0b559f", "#d95f0e", "#009e73", "#cc79a7", "#56b4e9", "#8a6d00"]
"""Colours that colour-blind readers can distinguish."""
AXES = ["#d55e00", "#009e73", "#0072b2"]
"""Red, green and blue for the axes of a frame, in shades that colour-blind readers can distinguish."""
HALO = [withStroke(linewidth=2.5, foreground="white", alpha=0.85)]
DPI = 150
LEFT, RIGHT, BOTTOM, TOP = 0.95, 0.6, 0.55, 0.25
"""Margins in inches, which align the time axes of several panels."""
OWN_AXES: WeakKeyDictionary[Axes, float] = WeakKeyDictionary()
"""Axes of the user, whose look does not change, and the factor by which symbols and text in them are reduced."""
_FAR = 1e3
"""An axis counts from a round number if its numbers are larger than this multiple of their range."""
_POWERS = -3, 5
"""Numbers on axes outside these powers of ten have a common power of ten."""
_POWER = re.compile(r"(?:^1|([+−]?[\d.]+))e\+?(−?\d+)")
SUPERSCRIPTS = str.maketrans("0123456789−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
DATES: Any = dates
"""The module of matplotlib, which has no types."""


def colors(number: int) -> list[Any]:
    """Return one colour per curve: the default colour for one curve, and dark to light colours for several."""
    return [SPLINE] if number == 1 else [tuple(own) for own in time_colors(np.linspace(0, 1, number))]


def time_colors(share: Any) -> Any:
    """Return colours from dark to light for numbers from 0 to 1."""
    return colormaps["viridis"](0.85 * share)


def points(size: float) -> float:
    """Return a font size for users whose default size is not that of matplotlib."""
    return size * float(rcParams["font.size"]) / 10


def font_factor() -> float:
    """Return how much larger than usual the default font size is, at least 1."""
    return max(1.0, points(1))


def heading(figure: Figure, title: str, subtitle: str, height: float) -> None:
    """Write title and subtitle in the upper left corner. A long title is smaller, or has several lines."""
    # Bold letters are about 0.62 times as wide as their size, in points of 1/72 inch.
    letters = 0.94 * figure.get_figwidth() * 72 / (0.62 * 18)
    size = max(0.6, min(1.0, letters / len(title)))
    title = fill(title, max(int(letters / size), 10))
    look: Any = {"fontsize": points(18 * size), "weight": "bold", "linespacing": 1.0}
    figure.text(0.03, height, title, color=INK, va="bottom" if "\n" in title else "baseline", **look)
    figure.text(0.03, height - 0.3 / figure.get_figheight(), subtitle, color=INK, fontsize=points(12))


def note(panel: SubFigure, text: str) -> None:
    """Write a line below a picture."""
    panel.text(0.5, 0.02, text, ha="center", color=INK, fontsize=points(9))


def legend(
    axes: Axes | FigureBase, handles: list[Any], labels: list[str], width: float = np.inf, rows: int = 1, **look: Any
) -> None:
    """Add a legend without a frame, which is read row by row, in as many rows as a width in inches requires."""
    inches = [points(1) * (0.45 + 0.065 * len(label)) for label in labels]
    columns = -(-len(labels) // max(rows, int(np.ceil(sum(inches) / width))))
    if sum(inches) > width:
        columns = max(1, min(columns, int(width / max(inches))))
    # A legend fills its columns one after the other.
    order = [i for column in range(columns) for i in range(column, len(labels), columns)]
    handles, labels = [handles[i] for i in order], [labels[i] for i in order]
    size = points(9) * (text_factor(axes) if isinstance(axes, Axes) else 1.0)
    axes.legend(handles, labels, frameon=False, labelcolor=INK, fontsize=size, ncols=columns, **look)


def size(panel: SubFigure) -> tuple[float, float]:
    """Return width and height in inches."""
    return panel.bbox.width / panel.dpi, panel.bbox.height / panel.dpi


def text_factor(axes: Axes) -> float:
    """Return the factor by which text is reduced in axes of the user, which is legible if they are small."""
    return max(0.75, OWN_AXES.get(axes, 1.0))


def axes_size(axes: Axes) -> tuple[float, float]:
    """Return width and height of axes in inches, or in reduced inches for small axes of the user."""
    figure: Any = axes.get_figure(root=True)
    scale = figure.dpi * OWN_AXES.get(axes, 1.0)
    return axes.bbox.width / scale, axes.bbox.height / scale


def inside(panel: SubFigure, left: float, bottom: float, right: float, top: float) -> tuple[float, float, float, float]:
    """Return the rectangle for ``add_axes`` with given margins in inches."""
    width, height = size(panel)
    return left / width, bottom / height, 1 - (left + right) / width, 1 - (bottom + top) / height


class Numbers(ScalarFormatter):
    """Numbers on an axis, with a common power of ten beside it if they are large or small.

    They are plain text: parsing the usual mathematical text would take a quarter of the time to draw a page.
    """

    def __init__(self) -> None:
        super().__init__()
        self.set_powerlimits(_POWERS)

    def get_offset(self) -> str:
        """Return the common power, such as "×10⁻⁸", and the number to add, such as "+5.2×10⁶"."""
        return _POWER.sub(lambda own: f"{own[1] or ''}×10{own[2].translate(SUPERSCRIPTS)}", super().get_offset())


def plain(axes: Axes) -> None:
    """Give axes a light look: a faint grid and no box. Axes of the user keep theirs."""
    if axes in OWN_AXES:
        return
    axes.set_facecolor("none")
    axes.grid(color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(EDGE)
    axes.tick_params(color=EDGE, labelcolor=INK, labelsize=points(9))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(Numbers())
        axis.label.set(color=INK, fontsize=points(10))
        axis.offsetText.set(color=INK, fontsize=points(9))


def round_start(first: Any, last: Any) -> Any:
    """Return a round number below numbers that are far from zero compared to their range, and zero below others."""
    span = float(last - first)
    if not span > 0 or abs(float(first)) < _FAR * span:
        return 0
    unit = 10 ** int(np.ceil(np.log10(span)))
    if np.asarray(first).dtype.kind in "iu":
        return int(first) // int(max(unit, 1)) * int(max(unit, 1))
    return float(np.floor(first / unit) * unit)


def named_from(name: str, start: Any) -> str:
    """Return the name of numbers that are counted from a start."""
    if not start:
        return name
    return f"{name} {'−' if start > 0 else '+'} {abs(start) if isinstance(start, int) else f'{abs(start):.15g}'}"


def show_dates(axis: Any, least: int, most: int) -> None:
    """Label an axis by at least ``least`` and at most ``most`` dates."""
    locator = DATES.AutoDateLocator(minticks=least, maxticks=most)
    axis.set_major_locator(locator)
    formatter = DATES.ConciseDateFormatter(locator)
    # The usual labels of seconds are numbers without the minute.
    formatter.formats[5] = "%H:%M:%S.%f"
    formatter.offset_formats[5] = "%Y-%b-%d"
    axis.set_major_formatter(formatter)


def window(positions: Array, margin: float) -> tuple[Array, float]:
    """Return centre and half width of the square, or cube, around positions of shape (m, n)."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    return (low + high) / 2, margin * float((high - low).max()) / 2


def evenly(count: int, most: int) -> Indices:
    """Return at most ``most`` evenly spaced numbers from 0 to count − 1."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))


def apart(values: Array, least: float) -> Indices:
    """Return the indices of increasing values, the first among them, whose distances are ``least`` or more."""
    kept = [0] if len(values) else []
    for i, value in enumerate(values):
        if value - values[kept[-1]] >= least * (1 - 1e-9):
            kept.append(i)
    return np.array(kept, dtype=np.intp)


def round_below(value: float) -> float:
    """Return the largest of 1, 2 and 5 times powers of ten up to a value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step for step in (power, 2 * power, 5 * power) if step < 1.01 * value))


def closest(steps: Any, value: float) -> float:
    """Return the step whose ratio to a value is closest to 1."""
    return float(steps[np.abs(np.log(steps / value)).argmin()])

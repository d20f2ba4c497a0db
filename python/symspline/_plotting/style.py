"""Colours of the active style, sizes, numbers and dates on axes, legends and notes, which all pictures share."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import colormaps, dates, rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.quiver import Quiver
from matplotlib.typing import ColorType
from numpy.typing import NDArray

from .._base.typing import Array, FloatArray, Look

Indices = NDArray[np.intp]
Numbers = Callable[[Array], FloatArray]
"""Takes points, and returns numbers or positions, one row per point."""

DATA = "#7d8f9c"
"""Colour of noisy data if there is one curve, and of curves in the background."""
MARK = "#c4402f"
"""Colour of limits, and of the rim of a half sphere."""
GAP: ColorType = ("#d95f0e", 0.1)
"""Colour of long gaps between points."""
AXES = ["#d55e00", "#009e73", "#0072b2"]
"""Red, green and blue for the axes of a frame, in shades that colour-blind readers can distinguish."""
DOTTED = (0, (1, 2))
_DISTINCT = ["#d95f0e", "#009e73", "#cc79a7", "#56b4e9", "#8a6d00"]
_FAR = 1e3
"""An axis counts from a round number if its numbers are larger than this multiple of their range."""
SUBSCRIPTS = str.maketrans("0123456789,", "₀₁₂₃₄₅₆₇₈₉,")
_FULL = 3.2
"""The shorter side in inches of axes whose symbols have their full size."""
SMALLEST = 6.0
"""The smallest size of letters in points that pages have, as journals require, unless the usual font is smaller."""
_SMALL_SHARE = 0.833
"""Size of text that matplotlib calls small, as a part of the usual size."""
_LETTER = 0.0078
"""Mean width of a letter in inches, per point of its size."""
DATES: Any = dates
"""The module of matplotlib, which has no types."""


# ---- colours ----


def ink(share: float = 1.0, color: ColorType | None = None) -> tuple[float, float, float]:
    """Return the colour of text in the active style, or another one, mixed with the background."""
    *rgb, alpha = to_rgba(rcParams["figure.facecolor"])
    ground = 1 - alpha * (1 - np.array(rgb))
    red, green, blue = share * np.array(to_rgb(color or rcParams["text.color"])) + (1 - share) * ground
    return float(red), float(green), float(blue)


def spline_color() -> str:
    """Return the usual colour of a curve, which is visible on the background of the active style."""
    return "#0b559f" if np.mean(ink(0)) > 0.5 else "#56b4e9"


def paper(share: float) -> tuple[float, float, float]:
    """Return a bluish background."""
    return ink(share, spline_color())


def distinct() -> list[ColorType]:
    """Return colours that colour-blind readers can distinguish."""
    return [spline_color(), *_DISTINCT]


def halo() -> list[AbstractPathEffect]:
    """Return the effect that separates text from lines behind it."""
    return [withStroke(linewidth=2.5, foreground=ink(0), alpha=0.85)]


def colors(number: int) -> list[ColorType]:
    """Return one colour per curve: the default colour for one curve, and dark to light colours for several."""
    return [spline_color()] if number == 1 else [tuple(color) for color in time_colors(np.linspace(0, 1, number))]


def time_colors(share: Any) -> Any:
    """Return colours from dark to light for numbers from 0 to 1, which are visible on the background."""
    return colormaps["viridis"](0.85 * share + (0.0 if np.mean(ink(0)) > 0.5 else 0.15))


# ---- sizes ----


def font_factor() -> float:
    """Return how much larger than usual the default font size is, at least 1."""
    return max(1.0, float(rcParams["font.size"]) / 10)


def least_factor() -> float:
    """Return the factor by which text may be reduced, so that small text has the smallest size that is allowed."""
    return min(1.0, SMALLEST / (_SMALL_SHARE * float(rcParams["font.size"])))


def small() -> float:
    """Return the size of small text in points."""
    return _SMALL_SHARE * float(rcParams["font.size"])


def letters_in(inches: float) -> int:
    """Return the number of letters of small text that fit into a width."""
    return max(10, int(inches / (_LETTER * small())))


def most_ticks(inches: float, letters: float) -> int:
    """Return the largest number of ticks whose labels, with so many letters, have space between them.

    The layout makes axes narrower than they are now.
    """
    return max(1, int(0.8 * inches / (_LETTER * small() * (letters + 2))))


def axes_size(axes: Axes) -> tuple[float, float]:
    """Return width and height of axes in inches."""
    box, figure = axes.get_window_extent(), axes.get_figure(root=True)
    assert figure is not None
    return float(box.width / figure.dpi), float(box.height / figure.dpi)


def scale_of(axes: Axes) -> float:
    """Return the factor by which symbols are reduced in small axes."""
    return float(np.clip(min(axes_size(axes)) / _FULL, 0.5, 1.0))


def shrink(artists: Iterable[Artist], factor: float) -> None:
    """Multiply the widths of lines and the sizes of markers by a factor."""
    for artist in artists:
        shape: Any = artist
        if isinstance(artist, Line2D):
            shape.set(markersize=factor * shape.get_markersize(), markeredgewidth=factor * shape.get_markeredgewidth())
        if isinstance(artist, Quiver):
            shape.width *= factor
        elif isinstance(artist, (Line2D, Patch, Collection)):
            shape.set_linewidth(factor * np.asarray(shape.get_linewidth()))


# ---- text ----


def note(axes: Any, text: str) -> None:
    """Write lines below a picture."""
    beside = float(axes.xaxis.label.get_fontsize())
    below = -4 if not axes.axison else -2 * beside if axes.name == "3d" else -2.7 * beside - 8
    text = "\n".join(fill(line, max(24, letters_in(axes_size(axes)[0]))) for line in text.splitlines())
    look: Look = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": "center", "va": "top"}
    axes.annotate(text, (0.5, 0), (0, below), fontsize="small", **look)


def legend(holder: Axes | FigureBase, handles: Sequence[Any], labels: Sequence[str], width: float, **look: Any) -> None:
    """Add a legend without a frame, which is read row by row, in as many rows as a width in inches requires."""
    letter = 0.0065 * float(rcParams["font.size"])
    inches = [letter * (7 + len(label)) for label in labels]
    columns = -(-len(labels) // max(1, int(np.ceil(sum(inches) / width))))
    while columns > 1 and sum(max(inches[i::columns]) for i in range(columns)) > width:
        columns -= 1
    # A legend fills its columns one after the other.
    order = [i for column in range(columns) for i in range(column, len(labels), columns)]
    handles, labels = [handles[i] for i in order], [labels[i] for i in order]
    usual: Look = {"frameon": False, "fontsize": "small", "borderaxespad": 0.0, "columnspacing": 1.4}
    holder.legend(handles, labels, ncols=max(columns, 1), handlelength=1.6, **usual | look)


def plain(axes: Axes) -> None:
    """Give axes of a page a light look: a faint grid and no box."""
    axes.grid(color=ink(0.2), linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(ink(0.4))
    axes.tick_params(color=ink(0.4), labelsize="small")
    axes.ticklabel_format(scilimits=(-3, 5), useMathText=False)


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


# ---- numbers ----


def window(positions: FloatArray, margin: float) -> tuple[FloatArray, float]:
    """Return centre and half width of the square, or cube, around positions of shape (m, n)."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    return (low + high) / 2, margin * float((high - low).max()) / 2


def evenly(count: int, most: int) -> Indices:
    """Return at most ``most`` evenly spaced numbers from 0 to count − 1."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))


def apart(values: FloatArray, least: float) -> Indices:
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

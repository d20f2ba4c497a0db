"""The page of curves: a heading, pictures of the space, and velocity and acceleration against time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from math import lcm
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import rc_context, rcParams
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.gridspec import GridSpec
from matplotlib.lines import Line2D

from .._spaces import Product
from .chart import Box
from .curves import Curve
from .lines import LEGEND
from .panels import Panel, View
from .rates import IN_ROW, columns_of, draw_rates, draw_residuals
from .style import font_factor, legend, shrink
from .views import FACTORS, captions, view_of, views_of_factors

_DPI = 150
_HEAD = 1.0
_RATES_WIDTH, _RATE, _RESIDUAL, _LABELS = 5.8, 1.6, 1.35, 0.8
"""Width of rates beside a picture, heights of a rate and of a panel of residuals, and that of the labels of times."""
_CELL = 4.8, 4.6
"""Width and height of a factor of a product."""
_MAP = 4.6, 6.8
"""Widths of a globe and of the map beside it."""
_SMALLEST = 0.6
"""Text is not reduced by less than this factor, unless there is no space for a page otherwise."""
_TEXT: Any = (
    "font.size",
    "axes.labelpad",
    "axes.titlepad",
    *(f"{x}tick.major.{own}" for x in "xy" for own in ("pad", "size")),
)


class CurveFigure(Figure):
    """A figure that notebooks show although it does not belong to pyplot."""

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.savefig(buffer, format="png")
        return buffer.getvalue()


@contextmanager
def drawing(natural: tuple[float, float], figsize: Any, show: bool) -> Iterator[Figure]:
    """Create a figure to draw into, which belongs to pyplot only if a window opens.

    Lines, symbols and text are reduced if the figure is smaller than its natural size, in inches. That size is larger
    for users with a large font.
    """
    larger = font_factor()
    size = np.multiply(natural, larger) if figsize is None else np.asarray(figsize, float)
    share = float((size / np.multiply(natural, larger)).min())
    factor = min(1.0, max(share, min(_SMALLEST, 1.4 * share)))
    look: Any = {"figsize": tuple(size.tolist()), "layout": "constrained"}
    with rc_context({name: factor * rcParams[name] for name in _TEXT}):
        if show:
            from matplotlib import pyplot

            figure: Figure = pyplot.figure(FigureClass=CurveFigure, **look)
        else:
            figure = CurveFigure(dpi=_DPI, **look)
        yield figure
    if factor * larger != 1:
        shrink(figure.findobj(), factor * larger)


def draw_page(
    curves: list[Curve],
    title: str,
    words: str,
    figsize: tuple[float, float] | None = None,
    show: bool = False,
    residuals: Sequence[Any] = (),
) -> Figure:
    """Draw a heading, the pictures of the space, rates, and residuals."""
    space = curves[0].space
    if isinstance(space, Product):
        pictures, names = views_of_factors(curves), captions(space)
        rows = 1 if len(pictures) <= IN_ROW else 2
        across = -(-len(pictures) // rows)
        whole = View(pictures[0][0].draw, _CELL[0] * across, _CELL[1] * rows)
    else:
        whole = view_of(curves)
        pictures, names, rows, across = [(whole, curves)], [], 1, 1
    columns = columns_of(curves[0], curves[0].axis.seconds, FACTORS, whole.is_wide)
    count = max(map(len, columns), default=0)
    beside, below = (0, count) if whole.is_wide else (count, 0)
    # Wide pages have cells of one grid, so that time axes one below the other are aligned. A picture has some of them.
    units = lcm(*(view.rows for view, _ in pictures if view.is_time)) if whole.is_wide else 1
    bottom = lcm(*map(len, columns)) if below else 0
    high = max(whole.height, _LABELS + _RATE * beside)
    heights = [high / (rows * units)] * rows * units + [(_LABELS + _RATE * below) / max(bottom, 1)] * bottom
    heights += [_RESIDUAL] * len(residuals)
    cells = lcm(across, len(columns)) if below else across
    widths = [whole.width / cells] * cells + [_RATES_WIDTH] * bool(beside)
    with drawing((sum(widths), _HEAD + sum(heights)), figsize, show) as figure:
        body: Any = figure.subfigures()
        grid = GridSpec(len(heights), len(widths), body, width_ratios=widths, height_ratios=heights, **_ABOUT)

        def stack(top: int, height: int, left: int, width: int, number: int, projection: Any = None) -> list[Axes]:
            """Add axes one below the other that fill some of the cells, or divide them."""
            step = height // number
            if whole.is_wide and step:
                places: Any = [grid[i : i + step, left : left + width] for i in range(top, top + height, step)]
            else:
                inner = grid[top : top + height, left : left + width].subgridspec(number, 1)
                places = [inner[i, 0] for i in range(number)]
            made = [body.add_subplot(place, axes_class=Box if projection else None) for place in places]
            if not whole.is_wide:
                body.align_ylabels(made)
            return made

        for i, (view, drawn) in enumerate(pictures):
            row, column = divmod(i, across)
            place = row * units, units, column * cells // across, cells // across
            if view.rows > 1 and not view.is_time:
                inner = grid[:units, :cells].subgridspec(1, view.rows, width_ratios=_MAP)
                axes = [body.add_subplot(inner[0, k]) for k in range(view.rows)]
            else:
                axes = stack(*place, view.rows, view.projection)
            view.draw_into(Panel(axes, mine=True), drawn)
            if names:
                _caption(axes[0], names[i])
        for k, group in enumerate(columns):
            width = cells // len(columns)
            place = (rows * units, bottom, k * width, width) if below else (0, rows * units, cells, 1)
            draw_rates(stack(*place, len(group)), curves, group)
        if residuals:
            place = rows * units + bottom, len(residuals), 0, len(widths)
            draw_residuals(stack(*place, len(residuals)), curves[0], residuals)
        if whole.is_wide:
            body.align_ylabels([axes for axes in body.axes if axes.get_gid() == "time"])
        head(figure, body, title, words, curves)
    return figure


_ABOUT: Any = {"left": 0.07, "right": 0.97, "bottom": 0.07, "top": 0.9, "hspace": 0.04, "wspace": 0.06}
"""About the margins that the layout will find. Symbols are as large as the axes permit before it does."""


def _caption(axes: Any, name: str) -> None:
    """Write the name of a factor above its picture, and above explanations that the picture has there."""
    top = max(own.get_window_extent().y1 for own in (axes._left_title, axes.get_legend()) if own is not None)
    above = 72 * (top - axes.bbox.y1) / axes.figure.dpi + 4
    look: Any = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": "center", "fontsize": "large"}
    axes.annotate(name, (0.5, 1), (0, above), **look)


def head(figure: Figure, body: SubFigure, title: str, words: str, curves: Sequence[Curve] = ()) -> None:
    """Write the title and a description, and explain lines, markers and bands."""
    width, font = figure.get_figwidth(), float(rcParams["font.size"])
    # Bold letters are about 0.62 times as wide as their size, in points of 1/72 inch.
    letters = 0.94 * width * 72 / (0.62 * 1.7 * font)
    size = max(0.6, min(1.0, letters / len(title)))
    title = fill(title, max(int(letters / size), 10))
    figure.suptitle(title, x=0.01, ha="left", weight="bold", fontsize=1.7 * size * font, linespacing=1.0)
    named: dict[str, Any] = {}
    for curve in (part for own in curves if not own.faint for part in own.unbroken):
        if curve.label:
            look: Any = {} if curve.has_line else {"linestyle": "none", "marker": "o", "markerfacecolor": "none"}
            named.setdefault(curve.label, Line2D([], [], color=curve.color, linewidth=2, **look))
    for axes in body.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    order = sorted(named, key=_rank)
    words = fill(words, max(20, int(0.94 * width * 72 / (0.53 * 1.2 * font))))
    look = {"loc": "outside upper left", "title": words, "title_fontsize": "large", "alignment": "left"}
    legend(body, [named[label] for label in order], order, 0.94 * width, **look)
    for key in body.legends[0].legend_handles:
        if isinstance(key, Line2D) and key.get_marker() not in ("", "None"):
            key.set_markersize(5)


def _rank(label: str) -> int:
    """Return the place of a label in the legend. Names of curves come first."""
    return next((i for i, start in enumerate(LEGEND) if label.startswith(start)), -1)

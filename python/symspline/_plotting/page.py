"""The page of a curve: a heading, the picture of the space, and velocity and acceleration against time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from .._spaces import Product, SpecialEuclidean, cover_of, factors_of
from . import residuals
from .collect import axis_of, curves_of
from .curves import (
    AFTER,
    AFTER_COLOR,
    BAND,
    BEHIND,
    BODIES,
    BODY,
    BODY_COLOR,
    BRIDGE,
    CONTROL,
    DATA_DOTS,
    DOTS,
    END,
    FAINT,
    GAPS,
    KNOTS,
    POSES,
    QUANTILES,
    START,
    TICKS,
    Axis,
    Curve,
    common_gaps,
)
from .figure import (
    FACTORS,
    draw_picture,
    drawing,
    finish,
    fitted,
    layout,
    picture_of,
    picture_of_factors,
    shows_band,
)
from .panels import check_axes, draw_into, has_dark_background, next_color
from .rates import LIMIT, MEDIAN, columns_of, draw_rates, is_angular
from .style import BOTTOM, DATA, EDGE, GAP, INK, MARK, TOP, Array, font_factor, heading, legend
from .theme import is_dark, kept_color
from .titles import title_on

_HEAD, _LINE, _RATES_WIDTH, _RATES_HEIGHT = 1.2, 0.2, 5.8, 4.0
_UNITS = (172_800, 86_400, "d"), (7200, 3600, "h"), (100, 60, "min"), (0, 1, "s")
"""The least number of seconds for which a unit is used, its length in seconds, and its name."""
_METRICS = dict.fromkeys(("spd", "hpd", "sspd"), "affine-invariant") | {"logspd": "log-Euclidean"}
"""Metrics of families for which several are in use."""
_ROW, _LEAST_ROW = 1.8, 1.35
"""Height of a rate in inches, if there are more than two in a column, and the smallest one beside a picture."""


class Page(NamedTuple):
    """A figure with what it shows.

    Attributes
    ----------
    figure : Figure
        The figure.
    curves : list of Curve
        The curves.
    picture : SubFigure
        Panel with the picture of the space.
    """

    figure: Figure
    curves: list[Curve]
    picture: SubFigure


def plot(curve: Any, file: Any = None, *, ax: Any = None, show: bool = False, **look: Any) -> Any:
    """Draw a curve: a page with panels, or the picture alone into axes. See `symspline.CubicSpline.plot`."""
    if ax is not None:
        return _plot_into(curve, ax, show=show, **look)
    figure = page_of(curve, show=show, **look).figure
    return finish(figure, file, show)


def page_of(
    curve: Any,
    color: Any = None,
    label: str | None = None,
    title: str | None = None,
    figsize: tuple[float, float] | None = None,
    show: bool = False,
    radius: float | None = None,
) -> Page:
    """Draw the page of a curve, on the Earth if its radius in metres is given."""
    color = kept_color(color, is_dark(rcParams["figure.facecolor"]))
    curves, words = curves_of(curve, _axis(curve), color, label)
    curves = [own.on_earth(radius) for own in curves]
    space = curve.space
    parts = [curves[0].part(i) for i in range(len(factors_of(space)))] if isinstance(space, Product) else curves[:1]
    has_band = [shows_band(part) for part in parts]
    below = residuals.panels_of(curve, curves[0], has_band)
    title = title or title_on(curve._kind, space)
    others = int(np.prod(curve._curve.batch)) - sum(not own.faint and not own.is_mean for own in curves)
    return draw_page(curves, title, words + _description(curve, curves), figsize, show, below, others)


def draw_page(
    curves: list[Curve],
    title: str,
    words: str,
    figsize: tuple[float, float] | None = None,
    show: bool = False,
    below: Sequence[Any] = (),
    others: int = 0,
) -> Page:
    """Draw a heading, the picture of the space, rates and further panels; ``others`` curves have no points."""
    space = curves[0].space
    picture = picture_of_factors(curves) if isinstance(space, Product) else fitted(picture_of(space), curves)
    wide = picture.width > 1.5 * picture.height
    widths = [picture.width] if wide else [picture.width, _RATES_WIDTH]
    rates = any(curve.has_line for curve in curves)
    head = _HEAD + _LINE * _extra_lines(curves, widths[0] if wide or not rates else sum(widths))
    count = max(map(len, columns_of(curves[0], False, FACTORS, wide)))
    beside = 0.0 if wide or not rates else BOTTOM + TOP + _LEAST_ROW * count
    heights = [head, max(picture.height, beside)]
    if wide and rates:
        heights.append(_RATES_HEIGHT if count < 3 else BOTTOM + TOP + _ROW * count)
    if below:
        heights.append(residuals.height(below))
    natural = (sum(widths) if rates or wide else widths[0], sum(heights))
    size, factor = layout(natural, figsize)
    final = np.multiply(size, font_factor()) if figsize is None else figsize
    with drawing(size, show, factor) as figure:
        heights = [head, *(h * (size[1] - head) / sum(heights[1:]) for h in heights[1:])]
        grid = figure.add_gridspec(len(heights), len(widths), width_ratios=widths, height_ratios=heights)
        heading(figure, title, words, 1 - 0.5 / size[1])
        panel = figure.add_subfigure(grid[1, 0] if wide or rates else grid[1, :])
        if isinstance(space, Product):
            picture.draw(panel, curves)
        else:
            draw_picture(panel, space, curves)
        if rates:
            draw_rates(figure.add_subfigure(grid[2, 0] if wide else grid[1, 1]), curves, FACTORS, wide)
        if below:
            residuals.draw(figure.add_subfigure(grid[-1, :]), curves[0], below)
        _explain(figure, curves, 1 - 0.92 / size[1], others, 0.9 * float(final[0]))
    if figsize is not None:
        figure.set_size_inches(figsize)
    return Page(figure, curves, panel)


def _extra_lines(curves: Sequence[Curve], width: float) -> int:
    """Return the number of lines that the names of curves need in a legend, beyond two."""
    names = {own.label for curve in curves if not curve.faint for own in curve.unbroken if own.label}
    longest = max(map(len, names), default=0)
    columns = max(1, int(0.9 * width / (0.45 + 0.065 * longest)))
    return max(0, -(-len(names) // columns) - 1)


def _axis(curve: Any, raw: bool = False) -> Any:
    return axis_of([curve.domain], curve._time_axis, raw)


def _plot_into(
    curve: Any,
    ax: Any,
    color: Any = None,
    label: str | None = None,
    title: str | None = None,
    show: bool = False,
    radius: float | None = None,
) -> Any:
    """Draw the picture of a curve into axes."""
    check_axes(ax, curve.space)
    color = kept_color(color or next_color(ax), has_dark_background(ax))
    curves, _ = curves_of(curve, _axis(curve, raw=True), color, label)
    return draw_into(ax, [own.on_earth(radius) for own in curves], title, show)


def _description(spline: Any, curves: Sequence[Curve]) -> str:
    """Describe the data, the convergence of the solver, the number of curves with bands, and the number of gaps."""
    words = [spline._made_of(curves[0].radius)]
    if isinstance(cover_of(spline.space), SpecialEuclidean):
        # The acceleration of the position is that of a body in such a motion.
        words[0] = words[0].replace("natural ends", "natural ends (constant twist)")
    if ", noise " in words[0] and curves[0].radius is None and is_angular(spline.space):
        words[0] += " rad"
    family = str(cover_of(spline.space)).partition(":")[0]
    if family in _METRICS:
        words.append(f"{_METRICS[family]} metric")
    factors = len(factors_of(spline.space))
    if factors > FACTORS:
        words.append(f"{FACTORS} of {factors} factors")
    if spline._unconverged:
        words.append(f"{spline._unconverged} failed" if spline._curve.batch else "not converged")
    if curves[0].noise is not None:
        words.append("band 95 %")
    if len(curves[0].breaks):
        count = int(np.sum(curves[0].breaks[:, 1] > curves[0].breaks[:, 0]))
        words.append(f"{count} gap{'s' if count != 1 else ''}")
        return ", ".join(filter(None, words))
    gaps = len(common_gaps(curves))
    if gaps:
        words.append(f"{gaps} long gap{'s' if gaps > 1 else ''}")
    return ", ".join(filter(None, words))


def _lengths(gaps: Array, axis: Axis) -> str:
    """Describe the lengths of gaps, given on matplotlib's axis, in seconds if the axis has a unit."""
    longest = float(np.diff(gaps).max()) * (86_400 if axis.dates else 1)
    length = f"{longest:.3g}"
    if axis.seconds:
        unit, name = next((unit, name) for least, unit, name in _UNITS if longest >= least)
        length = f"{longest / unit:.3g} {name}"
    return f"gap of {length}" if len(gaps) == 1 else f"gaps of up to {length}"


def _labels(axes: Axes) -> set[object]:
    return {artist.get_label() for artist in axes.get_children()}


def _explain(figure: Figure, curves: Sequence[Curve], height: float, others: int, width: float) -> None:
    """Explain lines, markers and bands in lines of a given width in inches below the heading.

    ``others`` curves have no points.
    """
    drawn = set().union(*(_labels(axes) for axes in figure.axes))
    few = [curve for curve in curves if not curve.faint]
    count = 0 if few[0].batch is None else int(few[0].batch.valid.sum())
    dot: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 5}
    handles: list[Artist] = []
    labels: list[str] = []

    def add(handle: Artist, label: str) -> None:
        handles.append(handle)
        labels.append(label)

    for curve in (part for own in few for part in own.unbroken):
        if curve.label and curve.label not in labels:
            look = {} if curve.has_line else dot | {"markerfacecolor": "none"}
            add(Line2D([], [], color=curve.color, linewidth=2, **look), curve.label)
    color = few[0].color_of_dots if few[0].alone else DATA
    body: dict[str, Any] = {"linestyle": "none", "marker": BODY, "markersize": 10, "markeredgecolor": few[0].color}
    some_of_many = BODIES in drawn and POSES not in drawn and few[0].noise is None and few[0].has_nodes
    if START in drawn:
        look = body if POSES in drawn or some_of_many else dot | {"markeredgewidth": 1.2}
        add(Line2D([], [], **look | {"color": "white", "markeredgecolor": color}), "start")
    if END in drawn:
        add(Line2D([], [], **dot | {"marker": "s", "color": color}), "end")
    if DOTS in drawn:
        dots = (line.get_color() for axes in figure.axes for line in axes.lines if line.get_label() == DOTS)
        add(Line2D([], [], color=next(dots) if few[0].alone else DATA, **dot), "given points")
    if POSES in drawn:
        add(Line2D([], [], **body | {"markeredgecolor": color, "color": color}), "given poses")
    if BODIES in drawn:
        add(Line2D([], [], **body, color=BODY_COLOR), "some of the poses" if some_of_many else "poses of the curve")
    if CONTROL in drawn:
        add(
            Line2D([], [], color=few[0].color, marker="s", markersize=5, markerfacecolor="white", linewidth=0.9),
            "control points",
        )
    if DATA_DOTS in drawn and all(own.has_line for own in few):
        add(Line2D([], [], color=DATA, **dot), "data")
    if BAND in drawn:
        both = few[0].noise is not None and few[0].noise.speed is not None
        add(Patch(facecolor=few[0].color, alpha=0.22), "95 % band of curve" + " and speed" * both)
    if BEHIND in drawn:
        add(Line2D([], [], color=few[0].color, linewidth=1, linestyle=(0, (2, 2)), alpha=0.6), "far side")
    if AFTER in drawn:
        add(Line2D([], [], color=AFTER_COLOR, linewidth=2), "after the first gap")
    if BRIDGE in drawn:
        words = "curve in a gap" + ", where near the data" * (few[0].noise is None)
        add(Line2D([], [], color=few[0].color, linewidth=1.2, linestyle=(0, (4, 2))), words)
    if GAPS in drawn:
        lengths = _lengths(common_gaps(few), few[0].axis)
        banded = few[0].noise is not None and few[0].noise.speed is not None
        graphs = any(axes.get_gid() == "time" and _labels(axes) & {DOTS, START} for axes in figure.axes)
        left_out = "acceleration" if banded else "curve" if graphs and BRIDGE not in drawn else "rates"
        between = any(len(own.breaks) for own in few)
        add(Patch(facecolor=GAP), f"{lengths} without data" + f", {left_out} not drawn" * (not between))
    if LIMIT in drawn:
        add(Line2D([], [], color=MARK, linewidth=1, linestyle="--"), "limit")
    if FAINT in drawn:
        drawn_ones = sum(own.faint for own in curves)
        hidden = f", {drawn_ones} of {others}" if drawn_ones < others else ""
        add(Line2D([], [], color=DATA, linewidth=0.7), ("single curves" if few[0].is_mean else "other curves") + hidden)
    if MEDIAN in drawn:
        add(Line2D([], [], color=INK, linewidth=1.8), f"median of {count} curves")
    if QUANTILES in drawn:
        add(Patch(facecolor=DATA, alpha=0.35), f"5–95 % of {count} curves")
    if drawn & {KNOTS, TICKS}:
        look = {"linestyle": ":"} if KNOTS in drawn else {"linestyle": "none", "marker": "|", "markeredgewidth": 1.6}
        times = "times of data" if few[0].noise is not None else "times of points" if few[0].has_nodes else "knots"
        add(Line2D([], [], color=EDGE, linewidth=1, **look), times)
    if handles:
        place: Any = {"loc": "upper left", "bbox_to_anchor": (0.03, height), "borderaxespad": 0, "borderpad": 0}
        legend(figure, handles, labels, width, handlelength=1.4, columnspacing=1.4, **place)

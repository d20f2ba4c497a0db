"""Plots of one curve, and of several curves and data: the page, or one picture in axes of the user."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from math import lcm
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import rc_context, rcParams
from matplotlib.axes import Axes
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure, SubFigure
from matplotlib.gridspec import GridSpec
from matplotlib.lines import Line2D
from matplotlib.typing import ColorType

from .._base.arrays import as_array, short_repr
from .._base.system import path_of, replacing
from .._base.time import TimeAxis, knots_of
from .._base.typing import Look
from .._core import ValidationError
from .._spaces import AnySpace, Product, Space, SpecialEuclidean, cover_of, factors_of, parts_of
from .chart import Box
from .curves import OTHERS, Axis, Curve, common_gaps, curves_of, scatter_of
from .panels import FRAME, LEGEND, START, Panel, View
from .rates import IN_ROW, columns_of, draw_rates, draw_residuals, is_angular, residuals_of
from .style import DATA, distinct, font_factor, least_factor, legend, scale_of, shrink, time_colors
from .views import FACTORS, FRAMES, captions, title_on, view_of, views_of_factors

_LARGEST = 200.0
"""The largest side of a figure in inches."""
_METRICS = dict.fromkeys(("spd", "hpd", "sspd"), "affine-invariant") | {"logspd": "log-Euclidean"}
"""Metrics of families for which several are in use."""
FigureSize = tuple[float, float | None]
"""Width and height in inches; None if the height is chosen."""
_MOVING = (".gif", ".mp4", ".apng", ".webm", ".mov", ".avi")


# ---- one curve ----


def plot(
    curve: Any,
    file: Any = None,
    *,
    ax: Any = None,
    show: bool = False,
    color: ColorType | None = None,
    label: str | None = None,
    radius: float | None = None,
    **look: Any,
) -> Any:
    """Draw a curve, on the Earth if its radius in metres is given. See `symspline.CubicSpline.plot`."""
    if ax is None:
        return finish(page_of(curve, color, label, radius, show=show, **look)[0], file, show)
    check_axes(ax, curve.space)
    curves, _ = curves_of(curve, _axis(curve, raw=True), color or _next_color(ax), label)
    return _draw_into(ax, [part.on_earth(radius) for part in curves], show=show, **look)


def page_of(
    curve: Any,
    color: ColorType | None = None,
    label: str | None = None,
    radius: float | None = None,
    title: str | None = None,
    figsize: FigureSize | None = None,
    show: bool = False,
) -> tuple[Figure, list[Curve]]:
    """Return the page of a curve, and the curves that it shows."""
    curves, words = curves_of(curve, _axis(curve), color, label)
    curves = [part.on_earth(radius) for part in curves]
    space = curve.space
    views = views_of_factors(curves[:1]) if isinstance(space, Product) else [(view_of(curves[:1]), curves)]
    residuals = residuals_of(curve, curves[0], [view.has_band for view, _ in views])
    title = title or title_on(curve._kind, space)
    return draw_page(curves, title, words + _description(curve, curves), figsize, show, residuals), curves


def _axis(curve: Any, raw: bool = False) -> Axis:
    return Axis.of([curve.domain], curve._time_axis, raw)


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
    elif gaps := len(common_gaps(curves)):
        words.append(f"{gaps} long gap{'s' if gaps > 1 else ''}")
    return ", ".join(filter(None, words))


# ---- several curves and data ----


def compare(
    items: Sequence[Any],
    labels: object,
    file: Any = None,
    *,
    colors: object = None,
    ax: Any = None,
    show: bool = False,
    title: str | None = None,
    figsize: Any = None,
    radius: float | None = None,
) -> Any:
    """Draw curves and data, on the Earth if its radius in metres is given. See `symspline.plot`."""
    first = next(item for item in items if not isinstance(item, tuple))
    space = first.space
    if ax is not None:
        check_axes(ax, space)
    names = _checked_labels(labels, len(items))
    chosen = _checked_colors(colors, items, space)
    data = [_data_of(item, space, i) if isinstance(item, tuple) else None for i, item in enumerate(items)]
    _check_times(items, data, first._time_axis)
    ends = [item.domain if given is None else given[:2] for item, given in zip(items, data, strict=True)]
    axis = Axis.of(ends, first._time_axis, raw=ax is not None)
    drawn: list[Curve] = []
    has_data = any(given is not None for given in data)
    for item, given, name, color in zip(items, data, names, chosen, strict=True):
        if given is None:
            made, _ = curves_of(item, axis, color, name, alone=False)
            # Beside data, the points of curves would be a second kind of dots.
            drawn += [replace(curve, has_start=False, has_nodes=False) if has_data else curve for curve in made]
        else:
            start, _, times, points = given
            drawn.append(scatter_of(space, start, times, points, axis, color, name))
    drawn = [curve.on_earth(radius) for curve in drawn]
    # Lines are in front of data, and the first of them determines the view.
    drawn.sort(key=lambda curve: not curve.has_line)
    if ax is not None:
        return _draw_into(ax, drawn, title, show)
    count = sum(curve.has_line for curve in drawn)
    words = [f"{count} curve{'s' if count > 1 else ''}"]
    if count < len(drawn):
        words.append(f"{sum(len(curve.x) for curve in drawn if not curve.has_line)} data")
    title = title or ("Tracks" if radius is not None else title_on("Comparison", space))
    return finish(draw_page(drawn, title, ", ".join(words), figsize, show), file, show)


def _checked_labels(labels: object, count: int) -> list[str | None]:
    if labels is None:
        return [None] * count
    if isinstance(labels, str) or not isinstance(labels, Sequence) or len(labels) != count:
        raise ValidationError(f"labels must be a list of {count} strings, one per curve, not {short_repr(labels)}")
    for i, label in enumerate(labels):
        if label is not None and not isinstance(label, str):
            raise TypeError(f"labels[{i}] must be a string, not {short_repr(label)}")
    return list(labels)


def _checked_colors(colors: object, items: Sequence[Any], space: AnySpace) -> list[Any]:
    """Return the colours of the user, or distinct ones for curves and grey ones for data."""
    if colors is not None:
        if isinstance(colors, str) or not isinstance(colors, Sequence) or len(colors) != len(items):
            raise ValidationError(
                f"colors must be a list of {len(items)} colours, one per curve, not {short_repr(colors)}"
            )
        return [_checked_color(value, f"colors[{i}]") for i, value in enumerate(colors)]
    count = sum(not isinstance(value, tuple) for value in items)
    # Frames have colours of their own.
    usual = OTHERS if any(str(cover_of(value)) in FRAMES for value in factors_of(space)) else distinct()
    lines = iter(usual if count <= len(usual) else map(tuple, time_colors(np.linspace(0, 1, count))))
    dots = iter([DATA, *distinct()[::-1]] * len(items))
    return [next(dots) if isinstance(value, tuple) else next(lines) for value in items]


def _data_of(pair: tuple[Any, Any], space: AnySpace, i: int) -> tuple[Any, Any, Any, Any]:
    """Return first and last time, times on the axis of the core and points, without missing ones and sorted."""
    t, points = pair
    name = f"curves[{i}]"
    try:
        pairs = zip(factors_of(space), parts_of(points, space, "points"), strict=True)
        parts = [factor._array(part, "points") for factor, part in pairs]
        for part, factor in zip(parts, factors_of(space), strict=True):
            if part.shape[1:] != factor.point_shape or not len(part):
                raise ValidationError(
                    f"points have shape {part.shape}, but data on {factor!r} need shape {('n', *factor.point_shape)}"
                )
        _, shown, times = knots_of(t, (), len(parts[0]))
        kept = np.all([np.isfinite(part.reshape(len(part), -1)).all(axis=1) for part in parts], axis=0)
        if not kept.any():
            raise ValidationError("all points are missing")
        parts = [
            factor.project(part[kept].astype(factor.dtype))
            for part, factor in zip(parts, factors_of(space), strict=True)
        ]
    except ValidationError as error:
        raise ValidationError(f"{name}: {error}") from None
    if not np.isfinite(times).all():
        raise ValidationError(f"{name}: t must be finite")
    order = np.argsort(times[kept], kind="stable")
    parts = [part[order] for part in parts]
    shown, times = shown[kept][order], times[kept][order]
    return shown[0], shown[-1], times, tuple(parts) if isinstance(space, Product) else parts[0]


def _check_times(items: Sequence[Any], data: Sequence[Any], reference: TimeAxis) -> None:
    """Raise ValidationError unless all times are numbers, or all are dates."""
    for i, (item, given) in enumerate(zip(items, data, strict=True)):
        dates = item._time_axis.dates if given is None else isinstance(given[0], np.datetime64)
        if dates != reference.dates:
            raise ValidationError(
                f"curves[{i}] has {'dates' if dates else 'numbers'} as times, but other curves have "
                f"{'numbers' if dates else 'dates'}. Use one kind of times."
            )


# ---- axes of the user ----


def check_axes(ax: Axes, space: Space) -> None:
    """Raise an error unless a picture of the space can be drawn into axes."""
    if not isinstance(ax, Axes):
        raise TypeError(f"ax must be axes of matplotlib, not {short_repr(ax)}")
    if isinstance(space, Product):
        raise ValidationError(
            f"ax is one set of axes, but a curve on {space!r} has one picture per factor. Omit ax to draw a page."
        )


def _draw_into(ax: Axes, curves: Sequence[Curve], title: str | None = None, show: bool = False) -> Any:
    """Draw the picture of curves into axes that `check_axes` has accepted."""
    view = view_of(curves)
    if ax.has_data() and (view.is_turned or view.in_rows):
        why = "symbols of several curves would overlap"
        why = "the view of this picture depends on the curves" if view.is_turned else why
        function = "symspline.plot" if curves[0].radius is None else "symspline.geo.plot"
        raise ValidationError(
            f"ax already contains a picture, and {why}. Draw all of them in one call: "
            f"{function}([first, second], ax=ax)."
        )
    return draw_picture_into(ax, view.projection, lambda panel: view.draw_into(panel, curves), title, show)


def draw_picture_into(
    ax: Any, projection: str | None, draw: Callable[[Panel], object], title: str | None, show: bool
) -> Any:
    """Draw a picture into axes of the user, whose limits then contain what was there, too."""
    wanted = projection or "rectilinear"
    if ax.name != wanted:
        kind = f"projection='{wanted}'" if projection else "no projection"
        raise ValidationError(
            f"ax has the projection {ax.name!r}, but this picture needs axes with {kind}. Create them by "
            + (f"figure.add_subplot(projection='{wanted}')." if projection else "figure.add_subplot().")
        )
    before, factor = set(ax.get_children()), scale_of(ax)
    limits = {name: getattr(ax, f"get_{name}lim")() for name in ax._axis_map if ax.has_data()}
    with rc_context({"font.size": max(0.75, factor) * rcParams["font.size"]}):
        draw(Panel([ax], mine=False))
    for name, (low, high) in limits.items():
        # Pictures with limits of their own must not hide what was there.
        if not getattr(ax, f"get_autoscale{name}_on")():
            ends = getattr(ax, f"get_{name}lim")()
            getattr(ax, f"set_{name}lim")(min(low, ends[0]), max(high, ends[1]))
    new = [artist for artist in ax.get_children() if artist not in before]
    shrink(new, factor)
    hidden = tuple(ends for ends in LEGEND if ends not in (START, *FRAME))
    for artist in new:
        # Legends of the user have the names of curves.
        if str(artist.get_label()).startswith(hidden):
            artist.set_label(f"_{artist.get_label()}")
    if title is not None:
        ax.set_title(title)
    if show:
        from matplotlib import pyplot

        pyplot.show()
    return ax


def _next_color(ax: Any) -> Any:
    """Return the next colour of the property cycle of axes."""
    (probe,) = ax.plot(*[[]] * (3 if ax.name == "3d" else 2))
    color = probe.get_color()
    probe.remove()
    return color


# ---- files and options ----


def finish(figure: Figure, file: Any, show: bool) -> Figure:
    """Save the figure if there is a file, and open windows."""
    if file is not None:
        save(figure, file)
    if show:
        from matplotlib import pyplot

        pyplot.show()
    return figure


def save(figure: Figure, file: Any) -> None:
    """Write a figure to an open file, or to a path whose suffix selects the format."""
    path = path_of(file, method="write")
    if path is None:
        figure.savefig(file)
        return
    known = sorted(set(figure.canvas.get_supported_filetypes()) - {suffix[1:] for suffix in _MOVING})
    ending = path.suffix[1:].lower()
    if not ending:
        ending = figure.canvas.get_default_filetype()
        path = path.with_name(f"{path.name}.{ending}")
    if f".{ending}" in _MOVING:
        raise ValidationError(
            f"file = {short_repr(str(path))} is an animation, but plot writes still images. Use the method animate of "
            "a curve, or a name such as 'curve.png'."
        )
    if ending not in known:
        raise ValidationError(f"file = {short_repr(str(path))}: the name of a picture must end in .{', .'.join(known)}")
    with replacing(path) as temporary:
        figure.savefig(temporary, format=ending)


def checked_look(
    file: object, ax: object, color: object, label: object, title: object, figsize: object, show: object
) -> Look:
    """Return the options that were given as keyword arguments of the function that draws.

    Raises
    ------
    ValidationError
        If an option is invalid.
    """
    if not isinstance(show, bool):
        raise TypeError(f"show must be True or False, not {short_repr(show)}")
    look: Look = {}
    if color is not None:
        look["color"] = _checked_color(color, "color")
    for name, text in (("label", label), ("title", title)):
        if text is not None:
            if not isinstance(text, str):
                raise TypeError(f"{name} must be a string, not {short_repr(text)}")
            look[name] = text
    if figsize is not None:
        look["figsize"] = _checked_size(figsize)
    if ax is not None and figsize is not None:
        raise ValidationError("figsize and ax exclude each other. The size of ax is that of its figure.")
    if ax is not None and file is not None:
        raise ValidationError("file and ax exclude each other. Save the figure of ax: ax.figure.savefig(file).")
    return look


def _checked_color(color: object, name: str) -> Any:
    """Return a colour in any form that matplotlib accepts."""
    try:
        valid = is_color_like(color)
    except (TypeError, ValueError):
        valid = False
    if not valid:
        raise ValidationError(f"{name} must be a colour of matplotlib, such as 'tab:red', not {short_repr(color)}")
    return color


def _checked_size(figsize: Any) -> FigureSize:
    """Return width and height; None for the height if the width alone is given."""
    size = as_array(figsize, "figsize")
    valid = size.shape in ((), (2,)) and size.dtype.kind in "iuf"
    if not (valid and np.isfinite(size).all() and (size > 0).all() and (size <= _LARGEST).all()):
        raise ValidationError(
            f"figsize must be a width in inches, or width and height, positive numbers up to {_LARGEST:g}, not "
            f"{short_repr(figsize)}"
        )
    return (float(size), None) if size.ndim == 0 else (float(size[0]), float(size[1]))


# ---- the page of curves: a heading, pictures of the space, and velocity and acceleration against time ----

_DPI = 150
_HEAD, _PADS = 1.0, 0.12
_RATES_WIDTH, _RATE, _RESIDUAL, _LABELS = 5.8, 1.6, 1.35, 0.8
"""Width of rates beside a picture, heights of a rate and of a panel of residuals, and that of the labels of times."""
_CELL = 4.8, 4.6
"""Width and height of a factor of a product."""
_MAP, _MAP_ABOVE = (4.6, 6.8), 1.75
"""Widths of a globe and of the map beside it, and how much higher the picture is if the globe is above the map."""
_THINNEST, _LOWEST = 0.55, 0.62
"""The smallest factors of lines and symbols, and of the heights of panels, if a page is small."""
_STACKED, _CELL_WIDTH = 0.55, 1.65
"""Pages narrower than this part of their usual width have pictures and rates one below the other, in columns of at
least this width in inches."""
_TICKS = [f"{x}tick.major.{name}" for x in "xy" for name in ("pad", "size")]
_TEXT: Any = ("font.size", "axes.labelpad", "axes.titlepad", *_TICKS)


class CurveFigure(Figure):
    """A figure that notebooks show although it does not belong to pyplot."""

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.savefig(buffer, format="png")
        return buffer.getvalue()


@dataclass(frozen=True)
class Sheet:
    """The size of a page.

    Attributes
    ----------
    width : float
        Width in inches, divided by the factor of a large font.
    height : float or None
        Likewise; None if it is chosen.
    share : float
        Part of the usual width, at most 1.
    """

    width: float
    height: float | None
    share: float

    @classmethod
    def of(cls, usual: float, figsize: FigureSize | None) -> Sheet:
        """Return the page with a usual width, or the size that the user wants."""
        width, height = (usual, None) if figsize is None else figsize
        larger = 1.0 if figsize is None else font_factor()
        width, height = width / larger, height and height / larger
        return cls(width, height, min(1.0, width / usual))

    @property
    def is_narrow(self) -> bool:
        """Whether pictures and rates are one below the other."""
        return self.share < _STACKED and (self.height is None or self.height >= self.width)

    @property
    def text(self) -> float:
        """Factor of the size of text on a page with enough height."""
        return max(self.share, least_factor())

    def scaled(self, heights: Sequence[float]) -> list[float]:
        """Return heights of panels on this page."""
        return [max(self.share, _LOWEST) * height for height in heights]


@contextmanager
def drawing(sheet: Sheet, height: float, show: bool) -> Iterator[Figure]:
    """Create a figure to draw into, which belongs to pyplot only if a window opens.

    Lines, symbols and text are reduced if the figure is narrower than usual or lower than ``height``, in inches. It is
    larger for users with a large font. A height that is chosen contains the whole heading.
    """
    larger = font_factor()
    size = larger * np.array([sheet.width, sheet.height or height])
    share = min(sheet.share, (sheet.height or height) / height)
    factor = max(share, least_factor())
    look: Look = {"figsize": tuple(size.tolist()), "layout": "constrained"}
    with rc_context({name: factor * rcParams[name] for name in _TEXT}):
        if show:
            from matplotlib import pyplot

            figure: Figure = pyplot.figure(FigureClass=CurveFigure, **look)
        else:
            figure = CurveFigure(dpi=_DPI, **look)
        yield figure
    if sheet.height is None and sheet.share < 1:
        figure.set_figheight(float(size[1]) + max(0.0, heading_height(figure) - larger * _HEAD * sheet.text))
    thinner = max(share, _THINNEST) * larger
    if thinner != 1:
        shrink(figure.findobj(), thinner)


def heading_height(figure: Figure) -> float:
    """Return the height in inches of the title, the description and the legend of a page."""
    whole: Any = figure
    parts = [whole._suptitle, *(legend for body in figure.subfigs for legend in body.legends)]
    return float(sum(part.get_window_extent().height for part in parts) / figure.dpi + _PADS)


def draw_page(
    curves: list[Curve],
    title: str,
    words: str,
    figsize: FigureSize | None = None,
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
    seconds = curves[0].axis.seconds
    sheet = Sheet.of(whole.width + (0 if whole.is_wide else _RATES_WIDTH), figsize)
    wide, is_map = whole.is_wide or sheet.is_narrow, not pictures[0][0].is_time and pictures[0][0].rows > 1
    high = whole.height
    if sheet.is_narrow:
        # As many pictures in a row as have space, or a globe above its map.
        least = _CELL_WIDTH * (1 if all(view.is_time and not view.in_rows for view, _ in pictures) else 2)
        across = min(across, max(1, int(sheet.width / least)))
        rows = -(-len(pictures) // across)
        high = _CELL[1] * rows if names else high * (_MAP_ABOVE if is_map else 1)
        if not whole.is_wide and not names:
            high *= sheet.width / (whole.width * max(sheet.share, _LOWEST))
    columns = columns_of(curves[0], seconds, FACTORS, wide, across if names else IN_ROW)
    count = max(map(len, columns), default=0)
    beside, below = (0, count) if wide else (count, 0)
    # Wide pages have cells of one grid, so that time axes one below the other are aligned. A picture has some of them.
    units = lcm(*(view.rows for view, _ in pictures if view.is_time)) if wide else 1
    bottom = lcm(*map(len, columns)) if below else 0
    high = max(high, _LABELS + _RATE * beside)
    heights = [high / (rows * units)] * rows * units + [(_LABELS + _RATE * below) / max(bottom, 1)] * bottom
    heights = sheet.scaled(heights + [_RESIDUAL] * len(residuals))
    cells = lcm(across, len(columns)) if below else across
    widths = [whole.width / cells] * cells + [_RATES_WIDTH] * bool(beside)
    with drawing(sheet, _HEAD * sheet.text + sum(heights), show) as figure:
        body: Any = figure.subfigures()
        grid = GridSpec(len(heights), len(widths), body, width_ratios=widths, height_ratios=heights, **_ABOUT)

        def stack(top: int, height: int, left: int, width: int, number: int, projection: Any = None) -> list[Axes]:
            """Add axes one below the other that fill some of the cells, or divide them."""
            step = height // number
            if wide and step:
                places: Any = [grid[i : i + step, left : left + width] for i in range(top, top + height, step)]
            else:
                inner = grid[top : top + height, left : left + width].subgridspec(number, 1)
                places = [inner[i, 0] for i in range(number)]
            made = [body.add_subplot(place, axes_class=Box if projection else None) for place in places]
            if not wide:
                body.align_ylabels(made)
            return made

        for i, (view, drawn) in enumerate(pictures):
            row, column = divmod(i, across)
            place = row * units, units, column * cells // across, cells // across
            if view.rows > 1 and not view.is_time:
                shape = (view.rows, 1) if sheet.is_narrow else (1, view.rows)
                ratios: Look = {"height_ratios": _MAP[::-1]} if sheet.is_narrow else {"width_ratios": _MAP}
                inner = grid[:units, :cells].subgridspec(*shape, **ratios)
                axes = [body.add_subplot(inner[k]) for k in range(view.rows)]
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
        if wide:
            body.align_ylabels([axes for axes in body.axes if axes.get_gid() == "time"])
        head(figure, body, title, words, curves)
    return figure


_ABOUT: Look = {"left": 0.07, "right": 0.97, "bottom": 0.07, "top": 0.9, "hspace": 0.04, "wspace": 0.06}
"""About the margins that the layout will find. Symbols are as large as the axes permit before it does."""


def _caption(axes: Any, name: str) -> None:
    """Write the name of a factor above its picture, and above explanations that the picture has there."""
    above = axes._left_title, axes.get_legend(), *axes.texts
    top = max(artist.get_window_extent().y1 for artist in above if artist is not None)
    above = 72 * (top - axes.bbox.y1) / axes.figure.dpi + 6
    look: Look = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": "center", "fontsize": "large"}
    axes.annotate(name, (0.5, 1), (0, above), **look)


def head(figure: Figure, body: SubFigure, title: str, words: str, curves: Sequence[Curve] = ()) -> None:
    """Write the title and a description, and explain lines, markers and bands."""
    width, font = figure.get_figwidth(), float(rcParams["font.size"])
    # Bold letters are about 0.62 times as wide as their size, in points of 1/72 inch.
    letters = 0.94 * width * 72 / (0.62 * 1.7 * font)
    size = max(0.6, min(1.0, letters / len(title)))
    title = fill(title, max(int(letters / size), 10))
    figure.suptitle(title, x=0.01, ha="left", weight="bold", fontsize=1.7 * size * font, linespacing=1.0)
    named: Look = {}
    for curve in (part for whole in curves if not whole.faint for part in whole.unbroken):
        if curve.label:
            look: Look = {} if curve.has_line else {"linestyle": "none", "marker": "o", "markerfacecolor": "none"}
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

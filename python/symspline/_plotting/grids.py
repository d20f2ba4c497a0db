"""The figure of a grid: a heading, and one panel per factor with the points over the first two axes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes

from .._core import ValidationError
from .fields import RIGHT, Field, draw_field
from .figure import FACTORS, captions, drawing, finish, layout
from .panels import check_axes, panel_of
from .style import DATES, INK, OWN_AXES, Array, axes_size, heading, inside, plain, points, show_dates
from .surfaces import draw_surface
from .titles import title_on

_HEAD, _LEFT, _BOTTOM, _TOP, _NAMED = 0.95, 0.85, 0.6, 0.1, 0.4
"""Heights and margins in inches. Panels with a name have a larger margin at the top."""
_SURFACES = {"euclidean:3", "se:3"}
_HIGH = 4.4
"""Smallest height of panels with surfaces in inches."""
_SIDE = 4.4
"""Longer side of an image in inches."""
_PIXELS, _NUMBERS = 240, 4e6
"""Pixels along the longer side, and the largest number of coordinates of all points; large points get fewer pixels."""
_GAP, _NARROW = 0.36, 0.28
"""Distance between symbols in inches, and the smallest one between those at nodes."""
_DENSE = 0.06
"""Nodes that are closer than this distance in inches have no dots."""


class Side(NamedTuple):
    """One axis of the picture.

    Attributes
    ----------
    axis : GridAxis
        Axis of the grid.
    inches : float
        Length of the image.
    name : str
        Label.
    """

    axis: Any
    inches: float
    name: str

    @property
    def ends(self) -> tuple[float, float]:
        """First and last knot in numbers of the core."""
        return float(self.axis.knots[0]), float(self.axis.knots[-1])

    @property
    def has_dates(self) -> bool:
        """Whether the axis shows dates, which matplotlib resolves to a microsecond."""
        return bool(self.axis.time_axis.dates and self.axis.knots[-1] - self.axis.knots[0] > 1e-3)

    def pixels(self, most: int) -> Array:
        """Return the coordinates of the centres of pixels."""
        first, last = self.ends
        return first + (last - first) * (np.arange(most) + 0.5) / most

    def symbols(self) -> Array:
        """Return the coordinates of symbols: those of the nodes if there is space, or evenly spaced ones."""
        knots = self.axis.knots
        shortest = self.inches * np.diff(knots).min() / (knots[-1] - knots[0])
        if shortest >= _NARROW:
            parts = max(1, int(shortest / _GAP))
            counts = np.arange(parts * (len(knots) - 1) + 1) / parts
            return np.asarray(np.interp(counts, np.arange(len(knots)), knots))
        return np.linspace(*self.ends, int(self.inches / _GAP) + 1)

    def on_axis(self, x: Array) -> Array:
        """Return the positions of coordinates on matplotlib's axis."""
        origin = self.axis.time_axis.origin
        if self.has_dates:
            return np.asarray(DATES.date2num(origin + np.rint(1e6 * x).astype("timedelta64[us]")))
        return x if origin is None or self.axis.time_axis.dates else float(origin) + x

    @property
    def label(self) -> str:
        """Label of the axis in the picture."""
        if self.axis.time_axis.dates and not self.has_dates:
            return f"{self.name}, seconds since {self.axis.time_axis.origin}"
        return f"{self.name}, seconds" if self.axis.time_axis.durations else self.name


def plot_grid(
    grid: Any,
    file: Any = None,
    *,
    ax: Any = None,
    title: str | None = None,
    figsize: tuple[float, float] | None = None,
    show: bool = False,
) -> Any:
    """Draw a grid with two or more axes: a figure, or its picture into axes. See `GridSpline.plot`."""
    axes = grid._axes
    sides = _sides(axes)
    # Further axes are fixed at their middle node, so that the nodes of the section are those of the grid.
    middles = [len(axis.knots) // 2 for axis in axes[2:]]
    fixed = [axis.knots[i : i + 1] for axis, i in zip(axes[2:], middles, strict=True)]
    factors = grid._factors[:FACTORS]
    sections = [factor.points[(slice(None), slice(None), *middles)] for factor in factors]
    if ax is not None:
        check_axes(ax, grid.space)
        with panel_of(ax, False, title, show) as own:
            inches = axes_size(ax)
            sides = [side._replace(inches=length) for side, length in zip(sides, inches, strict=True)]
            _draw_factor(own, grid, factors[0], sections[0], sides, fixed, (0, 0))
        return ax
    columns = min(len(factors), 3)
    rows = -(-len(factors) // columns)
    top = _NAMED if len(factors) > 1 else _TOP
    width, height = sides[0].inches + _LEFT + RIGHT, sides[1].inches + _BOTTOM + top
    if any(str(factor.space) in _SURFACES for factor in factors):
        height = max(height, _HIGH)
    title = title or title_on(grid._kind, grid.space, int(6 * columns * width))
    size, factor = layout((columns * width, _HEAD + rows * height), figsize)
    with drawing(size, show, factor) as figure:
        cells = figure.add_gridspec(1 + rows, columns, height_ratios=[_HEAD] + [height] * rows)
        heading(figure, title, _description(grid, middles), 1 - 0.5 / (_HEAD + rows * height))
        for i, (one, nodes, name) in enumerate(zip(factors, sections, captions(grid.space), strict=False)):
            panel = figure.add_subfigure(cells[1 + i // columns, i % columns])
            _draw_factor(panel, grid, one, nodes, sides, fixed, (height - sides[1].inches - top, top))
            if len(factors) > 1:
                panel.text(_LEFT / width, 1 - 0.28 / height, name, color=INK, fontsize=points(12))
    if figsize is not None:
        figure.set_size_inches(figsize)
    return finish(figure, file, show)


def _sides(axes: Any) -> list[Side]:
    """Return the first two axes. Their scales are equal unless one has dates or is much longer than the other."""
    spans = [axis.knots[-1] - axis.knots[0] for axis in axes[:2]]
    ratio = spans[1] / spans[0]
    if any(axis.time_axis.dates or axis.time_axis.durations for axis in axes[:2]) or not 1 / 3 <= ratio <= 3:
        ratio = 0.75
    lengths = (_SIDE / max(ratio, 1.0), _SIDE * min(ratio, 1.0))
    return [Side(axis, inches, f"axis {k}") for k, (axis, inches) in enumerate(zip(axes, lengths, strict=False))]


def _draw_factor(
    panel: Any,
    grid: Any,
    factor: Any,
    nodes: Any,
    sides: list[Side],
    fixed: list[Array],
    margins: tuple[float, float],
) -> None:
    """Draw one factor over the first two axes, with a dot per node. The margins are those at the bottom and top."""
    space = factor.space
    valid = space._where_finite(nodes)
    if not valid.any():
        raise ValidationError("there is nothing to plot: all nodes of the section are missing")
    longest = max(side.inches for side in sides)
    most = min(_PIXELS, int(np.sqrt(_NUMBERS / np.prod(space.point_shape))))
    pixels = [side.pixels(max(8, round(most * side.inches / longest))) for side in sides]
    symbols = [side.symbols() for side in sides]
    (left, right), (low, high) = ends = [side.on_axis(np.array(side.ends)) for side in sides]
    i, j = _middle(valid)
    section = (slice(None), slice(None), *[0] * len(fixed))
    field = Field(
        space,
        pixels=grid._values_of(factor, [*pixels, *fixed])[section],
        x=sides[0].on_axis(symbols[0]),
        y=sides[1].on_axis(symbols[1]),
        symbols=grid._values_of(factor, [*symbols, *fixed])[section],
        reference=nodes[i, j],
        ring=(sides[0].on_axis(sides[0].axis.knots)[i], sides[1].on_axis(sides[1].axis.knots)[j]),
        extent=(left, right, low, high),
        gap=min(side.inches * np.diff(x).min() / np.ptp(x) for side, x in zip(sides, symbols, strict=True)),
    )
    if str(space) in _SURFACES:
        draw_surface(panel, field, nodes)
        return
    axes = panel.add_axes(inside(panel, _LEFT, margins[0], RIGHT, margins[1]), label="field")
    plain(axes)
    if axes not in OWN_AXES:
        axes.grid(visible=False)
    draw_field(panel, axes, field)
    _draw_nodes(axes, sides, valid)
    for side, (first, last), letter in zip(sides, ends, "xy", strict=True):
        margin = 0.06 * (last - first)
        getattr(axes, f"set_{letter}lim")(first - margin, last + margin)
        getattr(axes, f"set_{letter}label")(getattr(axes, f"get_{letter}label")() or side.label)
        if side.has_dates:
            show_dates(getattr(axes, f"{letter}axis"), 2, 6)


def _draw_nodes(axes: Axes, sides: list[Side], valid: Any) -> None:
    """Draw dots at nodes that are not missing, unless they are dense."""
    x, y = (side.on_axis(side.axis.knots) for side in sides)
    spacing = min(side.inches / (len(side.axis.knots) - 1) for side in sides)
    if spacing >= _DENSE:
        i, j = np.nonzero(valid)
        look: Any = {"color": INK, "markeredgecolor": "white", "markeredgewidth": 0.4, "clip_on": False, "zorder": 2}
        axes.plot(x[i], y[j], "o", markersize=float(np.clip(14 * spacing, 1.2, 3.6)), label="nodes", **look)


def _middle(valid: Any) -> tuple[int, int]:
    """Return the valid node that is closest to the middle."""
    nodes = np.argwhere(valid)
    i, j = nodes[np.abs(nodes / np.maximum(np.array(valid.shape) - 1, 1) - 0.5).sum(axis=1).argmin()]
    return int(i), int(j)


def _description(grid: Any, middles: list[int]) -> str:
    """Describe the section, the nodes and the end conditions."""
    words = []
    for k, i in enumerate(middles, 2):
        at = grid.axes[k][i]
        words.append(f"axis {k} at {at:.4g}" if at.dtype.kind in "iuf" else f"axis {k} at {at}")
    words.append(" × ".join(str(len(axis.knots)) for axis in grid._axes) + " nodes")
    missing = grid.report.missing
    if missing:
        words.append(f"{missing} missing")
    if not grid.report.converged:
        words.append("not converged")
    if len(grid._factors) > FACTORS:
        words.append(f"{FACTORS} of {len(grid._factors)} factors")
    return ", ".join(words)

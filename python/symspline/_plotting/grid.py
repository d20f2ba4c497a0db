"""Pictures of grids over their first two axes, of which the first is vertical, as in xarray.

Most are an image with arrows, ellipses or contour lines over it, and a key of the colours to its right. Positions and
poses are a surface in space. To give a new space its picture, write a function that draws it and returns what its
symbols mean, and add a line to `_DRAWN`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import LightSource, ListedColormap, hsv_to_rgb
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Affine2D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from .._base.arrays import as_array, short_repr
from .._base.typing import Array, FloatArray, Look
from .._core import ValidationError
from .._spaces import AnySpace, Quotient, factors_of, short_name
from .chart import Box, draw_box, draw_frames, name_axis, positions_of
from .globe import bloch_vectors
from .graphs import ANGLES
from .matrices import MATRICES, ROTATIONS, Inches, draw_bar, outlines
from .panels import Panel
from .plot import FigureSize, Sheet, check_axes, draw_picture_into, drawing, finish, head
from .style import (
    DATES,
    Numbers,
    axes_size,
    evenly,
    ink,
    letters_in,
    most_ticks,
    note,
    paper,
    plain,
    round_below,
    show_dates,
    small,
)
from .views import FACTORS, captions, title_on

_HEAD, _LEFT, _BOTTOM, _NAMED, _KEY = 1.2, 0.85, 0.6, 0.4, 1.45
"""Heights and margins in inches: of the heading, of labels, of the name of a factor, and of the key beside an image."""
_NARROWEST = 2.6
"""The smallest width in inches of a picture with labels and key, and of an image on a page of the usual size."""
_SURFACES = {"euclidean:3", "se:3"}
_SIDE = 4.4
"""Longer side of an image, and smallest height of a surface, in inches."""
_PIXELS, _NUMBERS = 240, 4e6
"""Pixels along the longer side, and the largest number of coordinates of all points; large points get fewer pixels."""
_GAP, _NARROW = 0.36, 0.28
"""Distance between symbols in inches, and the smallest one between those at nodes."""
_DENSE = 0.15
"""Nodes that are closer than this distance in inches have no dots."""
_LIGHT = ListedColormap(colormaps["YlGnBu"](np.linspace(0, 0.6, 256)))
"""Colours under dark arrows and ellipses."""
_DARK = "#22303a"
"""Colour of symbols over an image, whose colours do not depend on the style."""
_LABELS_APART = 6.0
"""Smallest distance of labels of contour lines, if the size of a letter is 1."""
_GLOW = [withStroke(linewidth=2.5, foreground="white", alpha=0.85)]
_NORTH = np.array([0.0, 0.0, 1.0])
_SMALL = 1 / 8
"""Angles that differ by less than this part of a turn are drawn with colours for their range."""
_LINES, _FRAMES = 80, 9
"""Points along an axis of the surface, and the largest number of frames along it."""
_SUN = LightSource(azdeg=225, altdeg=70)


# ---- the figure ----


class _Side(NamedTuple):
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

    def pixels(self, most: int) -> FloatArray:
        """Return the coordinates of the centres of pixels."""
        first, last = self.ends
        return first + (last - first) * (np.arange(most) + 0.5) / most

    def symbols(self) -> FloatArray:
        """Return the coordinates of symbols: those of the nodes if there is space, or evenly spaced ones."""
        knots = self.axis.knots
        shortest = self.inches * np.diff(knots).min() / (knots[-1] - knots[0])
        if shortest >= _NARROW:
            parts = max(1, int(shortest / _GAP))
            counts = np.arange(parts * (len(knots) - 1) + 1) / parts
            return np.asarray(np.interp(counts, np.arange(len(knots)), knots))
        return np.linspace(*self.ends, int(self.inches / _GAP) + 1)

    def on_axis(self, x: FloatArray) -> FloatArray:
        """Return the positions of coordinates on matplotlib's axis."""
        origin = self.axis.time_axis.origin
        if self.has_dates:
            return np.asarray(DATES.date2num(origin + np.rint(1e6 * x).astype("timedelta64[us]")))
        return x if origin is None or self.axis.time_axis.dates else float(origin) + x

    def scaled(self, factor: float) -> _Side:
        """Return the axis with another length of the image."""
        return self._replace(inches=factor * self.inches)

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
    figsize: FigureSize | None = None,
    show: bool = False,
    axis_names: Sequence[str] | None = None,
    direction: FloatArray | None = None,
) -> Any:
    """Draw a grid with two or more axes: a figure, or its picture into axes. See `GridSpline.plot`."""
    names = axis_names or [f"axis {k}" for k in range(len(grid._axes))]
    # Further axes are fixed at their middle node, so that the nodes of the section are those of the grid.
    middles = [len(axis.knots) // 2 for axis in grid._axes[2:]]
    factors = grid._factors[:FACTORS]
    sides = _sides(grid._axes, names)
    if ax is not None:
        check_axes(ax, grid.space)
        sides = [side._replace(inches=length) for side, length in zip(sides, axes_size(ax), strict=True)]
        projection = "3d" if str(grid.space) in _SURFACES else None
        draw = partial(_draw_factor, grid=grid, number=0, sides=sides, middles=middles, direction=direction)
        return draw_picture_into(ax, projection, draw, title, show)
    columns = min(len(factors), 3)
    sheet = Sheet.of(columns * (sides[0].inches + _LEFT + _KEY), figsize)
    columns = min(columns, max(1, int(sheet.width / _NARROWEST)))
    rows = -(-len(factors) // columns)
    # Images are as wide as labels and keys permit.
    wide = sheet.width / columns - sheet.text * (_LEFT + _KEY)
    sides = [side.scaled(max(wide / sides[0].inches, 0.1)) for side in sides]
    high = max([sides[1].inches] + [sides[0].inches for part in factors if str(part.space) in _SURFACES])
    high += sheet.text * (_BOTTOM + _NAMED * (len(factors) > 1))
    title = title or title_on(grid._kind, grid.space)
    with drawing(sheet, sheet.text * _HEAD + rows * high, show) as figure:
        body: Any = figure.subfigures()
        for i, (factor, name) in enumerate(zip(factors, captions(grid.space), strict=False)):
            axes: Any = body.add_subplot(
                rows, columns, i + 1, axes_class=Box if str(factor.space) in _SURFACES else None
            )
            if sheet.height is not None:
                sides = [side._replace(inches=length) for side, length in zip(sides, axes_size(axes), strict=True)]
            words = _draw_factor(Panel([axes], mine=True), grid, i, sides, middles, direction)
            lines = [name] * (len(factors) > 1) + [fill(words, letters_in(axes_size(axes)[0]))] * bool(words)
            axes.set_title("\n".join(lines), loc="left", fontsize="small", weight="normal", pad=6)
        head(figure, body, title, _description(grid, middles, names))
    return finish(figure, file, show)


def checked_axis_names(names: object, count: int) -> list[str] | None:
    """Return the names of the axes of a grid, or None."""
    if names is None:
        return None
    if isinstance(names, str) or not isinstance(names, Sequence) or len(names) != count:
        raise ValidationError(f"axis_names must be a list of {count} strings, one per axis, not {short_repr(names)}")
    for i, name in enumerate(names):
        if not isinstance(name, str):
            raise TypeError(f"axis_names[{i}] must be a string, not {short_repr(name)}")
    return list(names)


def checked_direction(direction: Any, space: AnySpace) -> FloatArray | None:
    """Return a unit vector, or None."""
    if direction is None:
        return None
    if not any(_sector(factor) for factor in factors_of(space)):
        raise ValidationError(
            f"direction is for maps of crystals, on a Quotient of so:3 by a point group {', '.join(_SECTORS)}, not for "
            f"{short_name(space)}. Omit it."
        )
    vector = as_array(direction, "direction")
    if vector.shape != (3,) or vector.dtype.kind not in "iuf" or not np.isfinite(vector).all() or not vector.any():
        raise ValidationError(
            f"direction must be three numbers that are not all zero, such as (1, 0, 0), not {short_repr(direction)}"
        )
    return np.asarray(vector / np.linalg.norm(vector))


def _sides(axes: Any, names: Sequence[str]) -> list[_Side]:
    """Return the horizontal axis, which is the second of the grid, and the vertical one, which is the first.

    Their scales are equal unless one has dates or is much longer than the other.
    """
    spans = [axis.knots[-1] - axis.knots[0] for axis in axes[:2]]
    ratio = spans[0] / spans[1]
    if any(axis.time_axis.dates or axis.time_axis.durations for axis in axes[:2]) or not 1 / 3 <= ratio <= 3:
        ratio = 0.75
    width = max(_SIDE / max(ratio, 1.0), _NARROWEST)
    return [_Side(axes[1], width, names[1]), _Side(axes[0], ratio * width, names[0])]


def _draw_factor(
    panel: Panel, grid: Any, number: int, sides: list[_Side], middles: list[int], direction: FloatArray | None = None
) -> str:
    """Draw one factor over the first two axes, with a dot per node, and return what the symbols mean.

    Points have the horizontal axis first.
    """
    factor, space = grid._factors[number], factors_of(grid.space)[number]
    nodes = factor.points[(slice(None), slice(None), *middles)].swapaxes(0, 1)
    fixed = [axis.knots[i : i + 1] for axis, i in zip(grid._axes[2:], middles, strict=True)]
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

    def points_at(positions: list[FloatArray]) -> Any:
        return grid._values_of(factor, [*positions[::-1], *fixed])[section].swapaxes(0, 1)

    field = Field(
        space,
        pixels=points_at(pixels),
        x=sides[0].on_axis(symbols[0]),
        y=sides[1].on_axis(symbols[1]),
        symbols=points_at(symbols),
        reference=nodes[i, j],
        ring=(sides[0].on_axis(sides[0].axis.knots)[i], sides[1].on_axis(sides[1].axis.knots)[j]),
        extent=(left, right, low, high),
        gap=min(side.inches * np.diff(x).min() / np.ptp(x) for side, x in zip(sides, symbols, strict=True)),
    )
    if str(space) in _SURFACES:
        return _draw_surface(panel, field, nodes, [side.name for side in sides])
    (axes,) = panel.axes
    if panel.mine:
        plain(axes)
        axes.grid(visible=False)
        axes.set_label("field")
        axes.set_box_aspect(sides[1].inches / sides[0].inches)
    draw = partial(_draw_inverse_poles, direction) if _sector(space) else _PICTURES.get(str(space), _draw_distance)
    words = draw(axes, field)
    _draw_nodes(axes, sides, valid)
    for side, (first, last), letter in zip(sides, ends, "xy", strict=True):
        # Symbols extend beyond the outer nodes.
        margin = max(0.06, 0.55 * field.gap / side.inches * bool(words)) * (last - first)
        getattr(axes, f"set_{letter}lim")(first - margin, last + margin)
        getattr(axes, f"set_{letter}label")(getattr(axes, f"get_{letter}label")() or side.label)
        most = most_ticks(side.inches, 8) if letter == "x" else 6
        if side.has_dates:
            show_dates(getattr(axes, f"{letter}axis"), 1 if most < 5 else 2, int(np.clip(most, 3, 6)))
    if words and not panel.mine:
        note(axes, words)
    return words


def _draw_nodes(axes: Axes, sides: list[_Side], valid: Array) -> None:
    """Draw dots at nodes that are not missing, unless they are dense."""
    x, y = (side.on_axis(side.axis.knots) for side in sides)
    spacing = min(side.inches / (len(side.axis.knots) - 1) for side in sides)
    if spacing >= _DENSE:
        i, j = np.nonzero(valid)
        look: Look = {"color": _DARK, "markeredgecolor": "white", "markeredgewidth": 0.4, "clip_on": False, "zorder": 2}
        axes.plot(x[i], y[j], "o", markersize=float(np.clip(14 * spacing, 1.2, 3.6)), label="nodes", **look)


def _middle(valid: Array) -> tuple[int, int]:
    """Return the valid node that is closest to the middle."""
    nodes = np.argwhere(valid)
    i, j = nodes[np.abs(nodes / np.maximum(np.array(valid.shape) - 1, 1) - 0.5).sum(axis=1).argmin()]
    return int(i), int(j)


def _description(grid: Any, middles: list[int], names: Sequence[str]) -> str:
    """Describe the section, the nodes and the end conditions."""
    words = []
    for k, i in enumerate(middles, 2):
        at = grid.axes[k][i]
        words.append(f"{names[k]} at {at:.4g}" if at.dtype.kind in "iuf" else f"{names[k]} at {at}")
    words.append(" × ".join(str(len(axis.knots)) for axis in grid._axes) + " nodes")
    missing = grid.report.missing
    if missing:
        words.append(f"{missing} missing")
    if not grid.report.converged:
        words.append("not converged")
    if len(grid._factors) > FACTORS:
        words.append(f"{FACTORS} of {len(grid._factors)} factors")
    return ", ".join(words)


# ---- points over the axes ----


@dataclass(frozen=True)
class Field:
    """Points of one space over two axes. Missing points are NaN.

    Attributes
    ----------
    space : Space
        Space of the points.
    pixels : ndarray, shape (m, n, *point_shape)
        Points at the pixels of the image.
    x, y : ndarray
        Positions of the symbols along the axes of the picture.
    symbols : ndarray, shape (len(x), len(y), *point_shape)
        Points at the symbols.
    reference : ndarray, shape point_shape
        Point of a node in the middle, which has a ring if the picture refers to it.
    ring : tuple of float
        Position of that node.
    extent : tuple of float
        Left, right, lower and upper end of the image.
    gap : float
        Distance between neighbouring symbols in inches.
    """

    space: AnySpace
    pixels: Any
    x: FloatArray
    y: FloatArray
    symbols: Any
    reference: Any
    ring: tuple[float, float]
    extent: tuple[float, float, float, float]
    gap: float

    def at_pixels(self, function: Numbers) -> FloatArray:
        """Apply a function of points, one row per point, to the pixels; NaN where nodes are missing."""
        valid = self.space._where_finite(self.pixels)
        values = function(self.pixels[valid])
        out = np.full((*valid.shape, *values.shape[1:]), np.nan)
        out[valid] = values
        return out

    def at_symbols(self, function: Numbers) -> tuple[FloatArray, FloatArray]:
        """Return the positions of the symbols that have points, shape (k, 2), and a function of the points."""
        valid = self.space._where_finite(self.symbols)
        positions = np.stack(np.meshgrid(self.x, self.y, indexing="ij"), axis=-1)
        return positions[valid], function(self.symbols[valid])


_Draw = Callable[[Axes, Field], str]
"""Draws a field, and returns what its symbols mean."""


# ---- images and their keys ----


def _show(axes: Axes, field: Field, values: FloatArray, **look: Any) -> Any:
    """Draw numbers, shape (m, n), or colours, shape (m, n, 3), as an image that is blank where points are missing."""
    if values.ndim > 2:
        shown = np.nan_to_num(np.concatenate([values, np.isfinite(values[..., :1])], axis=-1))
    else:
        shown = np.ma.masked_invalid(values)
    shown = shown.swapaxes(0, 1)
    return axes.imshow(
        shown, origin="lower", extent=field.extent, aspect="auto", interpolation="nearest", zorder=1, **look
    )


def _show_numbers(axes: Axes, field: Field, values: FloatArray, label: str, **look: Any) -> Axes:
    """Draw numbers as an image with a colour bar, whose axes are returned."""
    image = _show(axes, field, values, **look)
    bar = axes.inset_axes((1.03, 0.04, 0.03, 0.92))
    made: Any = axes.figure.colorbar(ScalarMappable(image.norm, image.cmap), cax=bar)
    made.outline.set_visible(False)
    bar.tick_params(color=ink(0.4), labelsize="small")
    bar.set_ylabel(label)
    return bar


def _key(axes: Axes, caption: str, words: str) -> Axes:
    """Add a square for the key of colours to the right, with a caption above and words below."""
    size = axes_size(axes)
    side = min(1.05, 0.3 * min(size))
    # The caption is wider than the square, but does not touch the image.
    text = max(len(line) for line in (*caption.splitlines(), *words.splitlines())) / letters_in(1.0)
    left = 1.03 + max(0.0, text - side) / 2 / size[0]
    key = axes.inset_axes((left, 1 - 1.5 * side / size[1], side / size[0], side / size[1]))
    key.set(xlim=(-1, 1), ylim=(-1, 1), aspect="equal")
    key.set_axis_off()
    look: Look = {"fontsize": "small", "ha": "center", "transform": key.transAxes}
    key.text(0.5, 1.05 if len(words) else 1.25, caption, va="bottom", **look)
    key.text(0.5, -0.08, words, va="top", **look)
    return key


def _contours(axes: Axes, field: Field, values: FloatArray, unit: str) -> None:
    """Draw labelled contour lines of distances to the node in the middle, and a ring around this node."""
    look: Look = {"color": "none", "markersize": 9, "clip_on": False, "zorder": 5}
    axes.plot(*field.ring, "o", markeredgecolor="white", markeredgewidth=3, **look)
    axes.plot(*field.ring, "o", markeredgecolor=_DARK, markeredgewidth=1.4, label="ringed node", **look)
    if not np.isfinite(values).any() or np.nanmax(values) <= 0:
        return
    levels = MaxNLocator(7, steps=[1, 2, 5, 10]).tick_values(0, float(np.nanmax(values)))[1:-1]
    if not len(levels):
        return
    left, right, low, high = field.extent
    m, n = values.shape
    x, y = (left + (right - left) * (np.arange(m) + 0.5) / m), (low + (high - low) * (np.arange(n) + 0.5) / n)
    lines = axes.contour(
        x, y, np.ma.masked_invalid(values).T, levels, colors=_DARK, linewidths=0.8, alpha=0.7, zorder=3
    )
    # Labels that are close to others are omitted.
    kept = np.empty((0, 2))
    across = np.array(axes_size(axes)) * 72 / small()
    for text in axes.clabel(lines, fmt=lambda level: f"{level:g}{unit}", fontsize=small(), colors=_DARK):
        at = axes.transAxes.inverted().transform(axes.transData.transform(text.get_position())) * across
        if np.any(np.linalg.norm(kept - at, axis=1) < _LABELS_APART):
            text.remove()
            continue
        kept = np.append(kept, [at], axis=0)
        text.set(path_effects=_GLOW)


# ---- numbers and angles ----


def _draw_distance(axes: Axes, field: Field) -> str:
    """Draw the distance to the node that has a ring, for spaces without a picture of their own."""
    distances = field.at_pixels(lambda points: np.asarray(field.space.distance(field.reference, points)))
    _show_numbers(axes, field, distances, "distance to the ringed node")
    _contours(axes, field, distances, "")
    return ""


def _draw_number(axes: Axes, field: Field) -> str:
    """Draw numbers as an image."""
    _show_numbers(axes, field, field.at_pixels(lambda points: points[:, 0]), "x")
    return ""


def _draw_angle(angles: Numbers, period: float, axes: Axes, field: Field) -> str:
    """Draw an angle by its hue, or by colours for the range of the angles if they are close together."""
    middle = float(angles(field.reference[None])[0])
    turned = field.at_pixels(angles) - middle
    turned -= period * np.rint(turned / period)
    if np.nanmax(np.abs(turned), initial=0) < _SMALL * period:
        _show_numbers(axes, field, np.degrees(middle + turned), "angle, degrees")
        return ""
    around = np.degrees((middle + turned + period / 2) % period - period / 2)
    half = np.degrees(period / 2)
    look: Look = {"cmap": "twilight", "vmin": -half, "vmax": half}
    bar = _show_numbers(axes, field, around, "angle, degrees", **look)
    bar.set_yticks(np.linspace(-half, half, 5))
    return ""


# ---- arrows ----


def _draw_arrows(axes: Axes, field: Field, vectors: Numbers, longest: float) -> None:
    """Draw vectors, shape (k, 2), as arrows around their positions. The longest one fits between symbols."""
    positions, arrows = field.at_symbols(vectors)
    look: Look = {"units": "inches", "scale_units": "inches", "angles": "uv", "pivot": "mid", "clip_on": False}
    look |= {"width": 0.022, "headwidth": 4, "headlength": 5, "headaxislength": 4.5, "minlength": 0.5}
    scale = (longest or 1.0) / (0.9 * field.gap)
    axes.quiver(*positions.T, *arrows.T, color=_DARK, scale=scale, zorder=4, in_layout=False, **look)


def _draw_vectors(axes: Axes, field: Field) -> str:
    """Draw vectors of R² as arrows over an image of their lengths."""
    lengths = field.at_pixels(lambda points: np.linalg.norm(points, axis=-1))
    _show_numbers(axes, field, lengths, "length", cmap=_LIGHT)
    _draw_arrows(axes, field, np.asarray, float(np.nanmax(lengths, initial=0)))
    return "arrows: x₁ to the right, x₂ upwards"


def _draw_directions(vectors: Numbers, label: str, words: str, axes: Axes, field: Field) -> str:
    """Draw unit vectors: arrows of the first two coordinates, over an image of the angle to the third axis."""

    def polar(points: Array) -> FloatArray:
        x, y, z = vectors(points).T
        return np.asarray(np.degrees(np.arctan2(np.hypot(x, y), z)))

    _show_numbers(axes, field, field.at_pixels(polar), label, cmap=_LIGHT)
    _draw_arrows(axes, field, lambda points: vectors(points)[:, :2], 1.0)
    return words


# ---- orientations ----


def _draw_orientations(matrices: Numbers, axes: Axes, field: Field) -> str:
    """Draw rotations as an orientation map: the colour is the direction of the axis that moves most.

    Contour lines of the misorientation to the node that has a ring show the rest of the rotation.
    """
    frames = field.at_pixels(matrices)
    middle = matrices(field.reference[None])
    seen = np.concatenate([frames[np.isfinite(frames[..., 0, 0])], middle])
    number = int(np.linalg.norm(seen.mean(axis=0), axis=0).argmin())
    _show(axes, field, direction_colors(frames[..., number]))
    words = ("first", "second", "third")[number]
    key = _key(axes, f"{words} axis\npoints to", "rim: −x₃")
    x, y = np.meshgrid(*[np.linspace(-1, 1, 161)] * 2, indexing="ij")
    radius = np.hypot(x, y)
    polar = np.pi * radius
    share = np.sin(polar) / np.maximum(radius, 1e-12)
    disc = direction_colors(np.stack([share * x, share * y, np.cos(polar)], axis=-1))
    disc = np.concatenate([disc, (radius <= 1)[..., None]], axis=-1)
    key.imshow(disc.swapaxes(0, 1), origin="lower", extent=(-1, 1, -1, 1))
    for at, name in (((0, 0), "x₃"), ((0.5, 0), "x₁"), ((0, 0.5), "x₂")):
        look: Look = {"ha": "center", "va": "center", "path_effects": _GLOW}
        key.text(at[0], at[1], name, color=_DARK, fontsize="small", **look)
    angles = field.at_pixels(lambda points: np.degrees(ROTATIONS.distance(middle, matrices(points))))
    _contours(axes, field, angles, "°")
    return f"colour: direction of the {words} axis; lines: rotation from the ringed node"


class _Sector(NamedTuple):
    """The directions of a crystal that differ under its symmetry.

    Attributes
    ----------
    group : ndarray, shape (k, 3, 3)
        Its rotations.
    is_left : bool
        Whether they multiply orientations from the left, which then map vectors of the sample to those of the crystal.
    corners : ndarray, shape (3, 3)
        Unit vectors to the corners of the sector, in rows.
    names : tuple of str
        Their indices.
    """

    group: FloatArray
    is_left: bool
    corners: FloatArray
    names: tuple[str, str, str]

    def shares(self, directions: FloatArray) -> FloatArray:
        """Return the shares of the corners in equivalent directions of the sector, shape (..., 3).

        Reflections generate these groups together with the inversion, so that every direction has exactly one image in
        the sector, where no share is negative.
        """
        images = np.concatenate([self.group, -self.group]) @ np.linalg.inv(self.corners)
        shares = np.einsum("...i,kij->...kj", directions, images)
        best = shares.min(axis=-1).argmax(axis=-1)
        return np.asarray(np.take_along_axis(shares, best[..., None, None], axis=-2)[..., 0, :])


_SECTORS = {
    "222": ([[0, 0, 1], [1, 0, 0], [0, 1, 0]], ("001", "100", "010")),
    "422": ([[0, 0, 1], [1, 0, 0], [1, 1, 0]], ("001", "100", "110")),
    "622": ([[0, 0, 1], [1, 0, 0], [np.sqrt(3), 1, 0]], ("0001", "2-1-10", "10-10")),
    "432": ([[0, 0, 1], [1, 0, 1], [1, 1, 1]], ("001", "101", "111")),
}
"""Corners of the sectors of orthorhombic, tetragonal, hexagonal and cubic crystals, whose Laue groups reflections
generate, in the order of red, green and blue."""


def _sector(space: AnySpace) -> _Sector | None:
    """Return the sector of a crystal, or None if the space is not that of orientations with such a symmetry."""
    if not isinstance(space, Quotient) or str(space.cover) != "so:3":
        return None
    group = space.group if space.left_group is None else space.left_group if space.group is None else None
    for name, (corners, names) in _SECTORS.items():
        if str(space) in (f"so:3/{name}", f"{name}\\so:3") and group is not None:
            units = np.array(corners) / np.linalg.norm(corners, axis=1, keepdims=True)
            return _Sector(np.asarray(group), space.group is None, units, names)
    return None


def _draw_inverse_poles(direction: FloatArray | None, axes: Axes, field: Field) -> str:
    """Draw orientations of crystals by the direction of the crystal that is parallel to one of the sample.

    The colours are those of an inverse pole figure: red, green and blue at the corners of the sector. Contour lines
    show the disorientation to the node that has a ring, for readers who cannot distinguish them.
    """
    sector = _sector(field.space)
    assert sector is not None
    sample = _NORTH if direction is None else direction

    def colors(orientations: Array) -> FloatArray:
        # Rows times a matrix are its transpose times columns.
        turned = orientations @ sample if sector.is_left else sample @ orientations
        return inverse_pole_colors(sector.shares(turned))

    _show(axes, field, field.at_pixels(colors))
    name = _direction_name(sample)
    key = _key(axes, "crystal direction\nalong " + name, "")
    # The stereographic projection, in the square around the sector.
    edge = np.linspace(0, 1, 33)[:, None]
    pairs = [(sector.corners[i - 1], sector.corners[i]) for i in range(3)]
    outline = np.concatenate([(1 - edge) * a + edge * b for a, b in pairs])
    outline /= np.linalg.norm(outline, axis=1, keepdims=True)
    flat = outline[:, :2] / (1 + outline[:, 2:])
    high = float(np.ptp(flat, axis=0).max())
    x, y = np.meshgrid(*[np.linspace(0, high, 161)] * 2, indexing="ij")
    length = 1 + x**2 + y**2
    inside = np.stack([2 * x / length, 2 * y / length, (2 - length) / length], axis=-1)
    shares = inside @ np.linalg.inv(sector.corners)
    shown = np.concatenate([inverse_pole_colors(np.maximum(shares, 0)), (shares.min(axis=-1) >= 0)[..., None]], axis=-1)
    key.imshow(shown.swapaxes(0, 1), origin="lower", extent=(0, high, 0, high))
    key.plot(*flat.T, color=ink(0.5), linewidth=0.8, clip_on=False)
    key.set(xlim=(-0.05 * high, 1.05 * high), ylim=(-0.05 * high, 1.05 * high))
    for corner, text in zip(sector.corners, sector.names, strict=True):
        place = corner[:2] / (1 + corner[2])
        above = place[1] > 1e-9
        look: Look = {"ha": "center", "va": "bottom" if above else "top", "fontsize": "small"}
        key.text(place[0], place[1] + (0.06 if above else -0.06) * high, text, **look)
    distances = field.at_pixels(lambda points: np.degrees(field.space.distance(field.reference, points)))
    _contours(axes, field, distances, "°")
    return f"colour: crystal direction along {name} of the sample; lines: disorientation to the ringed node"


def _direction_name(vector: FloatArray) -> str:
    """Return the name of an axis, or the components of a direction."""
    (large,) = np.nonzero(vector)
    if len(large) == 1 and vector[large[0]] > 0:
        return f"x{'₁₂₃'[large[0]]}"
    return "(" + ", ".join(f"{x:.3g}" for x in vector) + ")"


def inverse_pole_colors(shares: FloatArray) -> FloatArray:
    """Return the colours of directions from the shares of the corners of a sector, which are red, green and blue."""
    return np.asarray(np.sqrt(np.maximum(shares, 0) / shares.max(axis=-1, keepdims=True)))


def direction_colors(vectors: FloatArray) -> FloatArray:
    """Return colours of unit vectors: white for the third axis, dark opposite to it, and hues around them."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    hue = np.arctan2(y, x) / (2 * np.pi) % 1
    # Black and saturated colours would hide dots and lines.
    light = 0.5 + np.arcsin(np.clip(z, -1, 1)) / np.pi
    value = 0.2 + 0.8 * np.minimum(2 * light, 1)
    saturation = 0.85 * np.where(light > 0.5, 2 * (1 - light), 1.0)
    colors = hsv_to_rgb(np.nan_to_num(np.stack([hue, saturation, value], axis=-1)))
    return np.where(np.isfinite(vectors), colors, np.nan)


# ---- positive definite matrices ----


def anisotropy(matrices: FloatArray) -> FloatArray:
    """Return the fractional anisotropy of positive definite matrices: 0 for a multiple of the identity, at most 1."""
    n = matrices.shape[-1]
    middle = np.trace(matrices, axis1=-2, axis2=-1)[..., None, None] / n * np.eye(n)
    ratio = np.linalg.norm(matrices - middle, axis=(-2, -1)) / np.linalg.norm(matrices, axis=(-2, -1))
    return np.asarray(ratio * np.sqrt(n / (n - 1)))


def _draw_ellipses(axes: Axes, field: Field) -> str:
    """Draw the ellipses of the first two coordinates, all on one scale, and a bar of a length that is returned."""
    positions, blocks = field.at_symbols(lambda points: points[:, :2, :2])
    rings = outlines(blocks)
    inches = 0.46 * field.gap / (np.abs(rings).max(initial=0) or 1.0)
    length = round_below(0.4 / inches)
    draw_bar(axes, inches * length, -0.1, 0.12)
    look: Look = {
        "offsets": positions,
        "offset_transform": axes.transData,
        "transform": Affine2D().scale(inches) + Inches(axes),
        "clip_on": False,
    }
    axes.add_collection(
        PolyCollection(list(rings), facecolors=(1, 1, 1, 0.45), edgecolors=_DARK, linewidths=0.9, zorder=4, **look)
    )
    return f"{length:g}"


def _draw_flat_tensors(axes: Axes, field: Field) -> str:
    """Draw ellipses over an image of the anisotropy."""
    values = field.at_pixels(anisotropy)
    _show_numbers(axes, field, values, "anisotropy", cmap=_LIGHT, vmin=0)
    return f"ellipses: half axes √eigenvalues; the bar is {_draw_ellipses(axes, field)}"


def _draw_tensors(axes: Axes, field: Field) -> str:
    """Draw ellipses over an image whose colours show the longest axis and the anisotropy."""
    _show(axes, field, field.at_pixels(tensor_colors))
    key = _key(axes, "longest axis", "white: isotropic")
    for i, color in enumerate(np.eye(3)):
        key.barh(0.75 - 0.5 * i, 0.5, 0.3, left=-0.7, color=tuple(color))
        key.text(0.0, 0.75 - 0.5 * i, f"x{'₁₂₃'[i]}", fontsize="small", va="center")
    length = _draw_ellipses(axes, field)
    return f"ellipses: seen along x₃, half axes √eigenvalues; the bar is {length}"


def tensor_colors(matrices: FloatArray) -> FloatArray:
    """Return colours of tensors: the longest axis in red, green and blue, paler for less anisotropy.

    The usual colours of diffusion tensors jump where the two longest axes are equally long. These are continuous,
    because the cube of the tensor gives the longest axis the largest weight only.
    """
    cubes = np.diagonal(np.linalg.matrix_power(matrices, 3), axis1=-2, axis2=-1)
    axis = np.sqrt(cubes / cubes.sum(axis=-1, keepdims=True))
    return np.asarray(1 - anisotropy(matrices)[..., None] * (1 - axis))


# ---- surfaces ----


def _draw_surface(panel: Panel, field: Field, nodes: Any, names: Sequence[str]) -> str:
    """Draw positions of R³, or poses of SE(3) with their frames, and the nodes as dots. Missing areas are blank."""
    place = positions_of if field.pixels.ndim > 3 else np.asarray
    positions = place(field.pixels)
    i, j = (evenly(size, _LINES) for size in positions.shape[:2])
    positions = positions[np.ix_(i, j)]
    known = np.isfinite(positions[..., 0])
    dots = place(nodes).reshape(-1, 3)
    dots = dots[np.isfinite(dots[:, 0])]
    axes = draw_box(panel, [], [positions[known], dots], np.zeros(3))
    areas = np.nan_to_num(np.cross(np.diff(positions, axis=0)[:, 1:], np.diff(positions, axis=1)[1:]))
    # A surface without area has no bright side. The order of the axes decides which side that is.
    look: Look = {"linewidths": 0, "facecolors": paper(0.15), "antialiaseds": False, "lightsource": _SUN}
    look["shade"] = bool(np.any(areas))
    grid = positions if areas[..., 2].sum() > 0 else positions.swapaxes(0, 1)
    faces = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2).reshape(-1, 4, 3)
    axes.add_collection3d(Poly3DCollection(faces[np.isfinite(faces).all(axis=(1, 2))], **look))
    symbols = place(field.symbols)
    # Lines on the surface at the pixels that are closest to the symbols.
    fine, (left, right, low, high) = place(field.pixels), field.extent
    across, along = (
        np.clip(np.rint((x - start) / (stop - start) * count - 0.5), 0, count - 1).astype(int)
        for x, start, stop, count in zip((field.x, field.y), (left, low), (right, high), fine.shape, strict=False)
    )
    for lines in (fine[across], fine[:, along].swapaxes(0, 1)):
        broken = np.concatenate([lines, np.full_like(lines[:, :1], np.nan)], axis=1)
        axes.plot(*broken.reshape(-1, 3).T, color=ink(), linewidth=0.5, alpha=0.45, zorder=4)
    axes.plot(*dots.T, "o", color=ink(), markersize=2.2, label="nodes", zorder=5)
    for name, at in zip(names, (symbols[-1, 0], symbols[0, -1]), strict=True):
        if np.isfinite(at).all():
            # Above the labels of ticks that the corner may touch.
            name_axis(axes, at + 0.1 * float(np.ptp(axes.get_zlim())) * _NORTH, f"{name} →")
    if field.pixels.ndim > 3:
        poses = field.symbols[np.ix_(*(evenly(size, _FRAMES) for size in field.symbols.shape[:2]))].reshape(-1, 4, 4)
        poses = poses[np.isfinite(poses[:, 0, 0])]
        draw_frames(axes, poses, 0.07 * float(np.ptp(axes.get_xlim())), np.zeros(3), linewidth=1.2)
    return ""


_ARROWS = "arrows: {} seen along x₃, x₁ to the right, x₂ upwards"
_DRAWN: list[tuple[str, _Draw]] = [
    ("euclidean:1", _draw_number),
    ("euclidean:2", _draw_vectors),
    *((names, partial(_draw_angle, angles, period)) for names, (angles, period) in ANGLES.items()),
    ("sphere:2", partial(_draw_directions, np.asarray, "angle to x₃, degrees", _ARROWS.format("unit vector"))),
    (
        "cp:1 cgr:1,2",
        partial(_draw_directions, bloch_vectors, "angle to |0⟩, degrees", _ARROWS.format("Bloch vector")),
    ),
    *((name, partial(_draw_orientations, MATRICES[name])) for name in ("sphere:3", "so:3", "su:2")),
    ("spd:2", _draw_flat_tensors),
    ("spd:3", _draw_tensors),
]
_PICTURES = {name: draw for names, draw in _DRAWN for name in names.split()}

"""Pictures of points over two axes of a grid: an image, and arrows, ellipses or contour lines over it.

To give a space its picture, add a drawing function and a line of `_DRAWN`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap, hsv_to_rgb
from matplotlib.figure import SubFigure
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Affine2D

from .._spaces import Space
from .graphs import ANGLES
from .matrices import MATRICES, ROTATIONS, outlines
from .sphere import bloch_vectors
from .style import EDGE, HALO, INK, OWN_AXES, Array, axes_size, points, size
from .theme import KEPT

RIGHT = 1.35
"""Width in inches of the margin beside the image, which has the key of its colours."""
_LIGHT = ListedColormap(colormaps["YlGnBu"](np.linspace(0, 0.6, 256)))
"""Colours under dark arrows and ellipses."""
_SMALL = 1 / 8
"""Angles that differ by less than this part of a turn are drawn with colours for their range."""


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

    space: Space[Any]
    pixels: Any
    x: Array
    y: Array
    symbols: Any
    reference: Any
    ring: tuple[float, float]
    extent: tuple[float, float, float, float]
    gap: float

    def at_pixels(self, function: Callable[[Any], Array]) -> Array:
        """Apply a function of points, one row per point, to the pixels; NaN where nodes are missing."""
        valid = self.space._where_finite(self.pixels)
        values = function(self.pixels[valid])
        out = np.full((*valid.shape, *values.shape[1:]), np.nan)
        out[valid] = values
        return out

    def at_symbols(self, function: Callable[[Any], Array]) -> tuple[Array, Array]:
        """Return the positions of the symbols that have points, shape (k, 2), and a function of the points."""
        valid = self.space._where_finite(self.symbols)
        positions = np.stack(np.meshgrid(self.x, self.y, indexing="ij"), axis=-1)
        return positions[valid], function(self.symbols[valid])


Draw = Callable[[SubFigure, Axes, Field], None]


def draw_field(panel: SubFigure, axes: Axes, field: Field) -> None:
    """Draw the picture of a space into axes, and its key to the right of them."""
    _PICTURES.get(str(field.space), draw_distance)(panel, axes, field)


# ---- images and their keys ----


def _show(axes: Axes, field: Field, values: Array, **look: Any) -> Any:
    """Draw numbers, shape (m, n), or colours, shape (m, n, 3), as an image that is blank where points are missing."""
    if values.ndim > 2:
        shown: Any = np.nan_to_num(np.concatenate([values, np.isfinite(values[..., :1])], axis=-1))
    else:
        shown = np.ma.masked_invalid(values)
    shown = shown.swapaxes(0, 1)
    return axes.imshow(
        shown, origin="lower", extent=field.extent, aspect="auto", interpolation="nearest", zorder=1, **look
    )


def _show_numbers(panel: SubFigure, axes: Axes, field: Field, values: Array, label: str, **look: Any) -> Axes:
    """Draw numbers as an image with a colour bar, whose axes are returned."""
    image = _show(axes, field, values, **look)
    bar = _beside(panel, axes, 0.14, 0.92 * _size_of(panel, axes)[1], 0.04)
    scale = ScalarMappable(image.norm, image.cmap)
    made: Any = axes.figure.colorbar(scale, cax=bar)
    made.outline.set_visible(False)
    bar.tick_params(color=EDGE, labelcolor=INK, labelsize=points(9))
    bar.yaxis.offsetText.set(color=INK, fontsize=points(9))
    bar.set_ylabel(label, color=INK, fontsize=points(10))
    return bar


def _size_of(panel: Any, axes: Axes) -> tuple[float, float]:
    """Return width and height of axes in the inches of their panel."""
    if axes in OWN_AXES:
        return axes_size(axes)
    bounds, whole = axes.get_position().bounds, size(panel)
    return bounds[2] * whole[0], bounds[3] * whole[1]


def _beside(panel: Any, axes: Axes, width: float, height: float, low: float) -> Axes:
    """Add axes to the right of others, with a size in inches; ``low`` is a part of the height of the others."""
    own = _size_of(panel, axes)
    rectangle = np.array([1 + 0.15 / own[0], low, width / own[0], height / own[1]])
    if axes in OWN_AXES:
        return axes.inset_axes(tuple(rectangle))
    left, bottom, across, high = axes.get_position().bounds
    made: Axes = panel.add_axes(tuple(rectangle * [across, high, across, high] + [left, bottom, 0, 0]))
    return made


def _key(panel: SubFigure, axes: Axes, caption: str) -> Axes:
    """Add a square for the key of colours, with a caption above."""
    key = _beside(panel, axes, 1.05, 1.05, 1 - 1.5 / _size_of(panel, axes)[1])
    key.set(xlim=(-1, 1), ylim=(-1, 1), aspect="equal")
    key.set_axis_off()
    key.text(0, 1.15, caption, color=INK, fontsize=points(9), ha="center", va="bottom")
    return key


def _contours(axes: Axes, field: Field, values: Array, unit: str, gid: str | None = None) -> None:
    """Draw labelled contour lines of distances to the node in the middle, and a ring around this node."""
    look: Any = {"color": "none", "markersize": 9, "clip_on": False, "zorder": 5}
    axes.plot(*field.ring, "o", markeredgecolor="white", markeredgewidth=3, **look)
    axes.plot(*field.ring, "o", markeredgecolor=INK, markeredgewidth=1.4, label="ringed node", **look)
    if not np.isfinite(values).any() or np.nanmax(values) <= 0:
        return
    levels = MaxNLocator(7, steps=[1, 2, 5, 10]).tick_values(0, float(np.nanmax(values)))[1:-1]
    if not len(levels):
        return
    left, right, low, high = field.extent
    m, n = values.shape
    x, y = (left + (right - left) * (np.arange(m) + 0.5) / m), (low + (high - low) * (np.arange(n) + 0.5) / n)
    lines = axes.contour(x, y, np.ma.masked_invalid(values).T, levels, colors=INK, linewidths=0.8, alpha=0.7, zorder=3)
    lines.set_gid(gid)
    for text in axes.clabel(lines, fmt=lambda level: f"{level:g}{unit}", fontsize=points(8), colors=INK):
        text.set(path_effects=HALO, gid=gid)


# ---- numbers and angles ----


def draw_distance(panel: SubFigure, axes: Axes, field: Field) -> None:
    """Draw the distance to the node that has a ring, for spaces without a picture of their own."""
    distances = field.at_pixels(lambda points: np.asarray(field.space.distance(field.reference, points)))
    _show_numbers(panel, axes, field, distances, "distance to the ringed node")
    _contours(axes, field, distances, "")


def draw_number(panel: SubFigure, axes: Axes, field: Field) -> None:
    """Draw numbers as an image."""
    _show_numbers(panel, axes, field, field.at_pixels(lambda points: points[:, 0]), "x")


def _draw_angle(angles: Callable[[Any], Array], period: float, panel: SubFigure, axes: Axes, field: Field) -> None:
    """Draw an angle by its hue, or by colours for the range of the angles if they are close together."""
    middle = float(angles(field.reference[None])[0])
    turned = field.at_pixels(angles) - middle
    turned -= period * np.rint(turned / period)
    if np.nanmax(np.abs(turned), initial=0) < _SMALL * period:
        _show_numbers(panel, axes, field, np.degrees(middle + turned), "angle, degrees")
        return
    around = np.degrees((middle + turned + period / 2) % period - period / 2)
    half = np.degrees(period / 2)
    look: Any = {"cmap": "twilight", "vmin": -half, "vmax": half}
    bar = _show_numbers(panel, axes, field, around, "angle, degrees", **look)
    bar.set_yticks(np.linspace(-half, half, 5))


# ---- arrows ----


def _draw_arrows(axes: Axes, field: Field, vectors: Callable[[Any], Array], longest: float) -> None:
    """Draw vectors, shape (k, 2), as arrows around their positions. The longest one fits between symbols."""
    positions, arrows = field.at_symbols(vectors)
    look: Any = {"units": "inches", "scale_units": "inches", "angles": "uv", "pivot": "mid", "clip_on": False}
    look |= {
        "width": 0.022,
        "headwidth": 4,
        "headlength": 5,
        "headaxislength": 4.5,
        "minlength": 0.5,
        "in_layout": False,
    }
    scale = (longest or 1.0) / (0.9 * field.gap)
    axes.quiver(*positions.T, *arrows.T, color=INK, scale=scale, zorder=4, **look)


def draw_vectors(panel: SubFigure, axes: Axes, field: Field) -> None:
    """Draw vectors of R² as arrows over an image of their lengths."""
    lengths = field.at_pixels(lambda points: np.linalg.norm(points, axis=-1))
    _show_numbers(panel, axes, field, lengths, "length", cmap=_LIGHT)
    _draw_arrows(axes, field, np.asarray, float(np.nanmax(lengths, initial=0)))


def _draw_directions(vectors: Callable[[Any], Array], words: str, panel: SubFigure, axes: Axes, field: Field) -> None:
    """Draw unit vectors: arrows of the first two coordinates, over an image of the angle to the third axis."""

    def polar(points: Any) -> Array:
        x, y, z = vectors(points).T
        return np.asarray(np.degrees(np.arctan2(np.hypot(x, y), z)))

    _show_numbers(panel, axes, field, field.at_pixels(polar), words, cmap=_LIGHT)
    _draw_arrows(axes, field, lambda points: vectors(points)[:, :2], 1.0)


# ---- orientations ----


def _draw_orientations(matrices: Callable[[Any], Array], panel: SubFigure, axes: Axes, field: Field) -> None:
    """Draw rotations as an orientation map: the colour is the direction of the axis that moves most.

    Contour lines of the misorientation to the node that has a ring show the rest of the rotation.
    """
    frames = field.at_pixels(matrices)
    middle = matrices(field.reference[None])
    seen = np.concatenate([frames[np.isfinite(frames[..., 0, 0])], middle])
    number = int(np.linalg.norm(seen.mean(axis=0), axis=0).argmin())
    _show(axes, field, direction_colors(frames[..., number]))
    words = ("first", "second", "third")[number]
    key = _key(panel, axes, f"direction of the\n{words} axis")
    x, y = np.meshgrid(*[np.linspace(-1, 1, 161)] * 2, indexing="ij")
    radius = np.hypot(x, y)
    polar = np.pi * radius
    share = np.sin(polar) / np.maximum(radius, 1e-12)
    disc = direction_colors(np.stack([share * x, share * y, np.cos(polar)], axis=-1))
    disc = np.concatenate([disc, (radius <= 1)[..., None]], axis=-1)
    key.imshow(disc.swapaxes(0, 1), origin="lower", extent=(-1, 1, -1, 1))
    for at, name in (((0, 0), "x₃"), ((0.5, 0), "x₁"), ((0, 0.5), "x₂")):
        look: Any = {"ha": "center", "va": "center", "path_effects": HALO, "gid": KEPT}
        key.text(at[0], at[1], name, color=INK, fontsize=points(9), **look)
    words = "rim: −x₃\n\nlines: misorien-\ntation to the\nringed node"
    key.text(0, -1.15, words, color=INK, fontsize=points(9), ha="center", va="top")
    angles = field.at_pixels(lambda points: np.degrees(ROTATIONS.distance(middle, matrices(points))))
    _contours(axes, field, angles, "°", KEPT)


def direction_colors(vectors: Array) -> Array:
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


def anisotropy(matrices: Array) -> Array:
    """Return the fractional anisotropy of positive definite matrices: 0 for a multiple of the identity, at most 1."""
    n = matrices.shape[-1]
    middle = np.trace(matrices, axis1=-2, axis2=-1)[..., None, None] / n * np.eye(n)
    ratio = np.linalg.norm(matrices - middle, axis=(-2, -1)) / np.linalg.norm(matrices, axis=(-2, -1))
    return np.asarray(ratio * np.sqrt(n / (n - 1)))


def _draw_ellipses(axes: Axes, field: Field, **look: Any) -> None:
    """Draw the ellipses of the first two coordinates, all on one scale."""
    positions, blocks = field.at_symbols(lambda points: points[:, :2, :2])
    rings = outlines(blocks)
    inches = 0.46 * field.gap / (np.abs(rings).max(initial=0) or 1.0)
    look |= {
        "offsets": positions,
        "offset_transform": axes.transData,
        "transform": Affine2D().scale(inches) + axes.figure.dpi_scale_trans,
        "clip_on": False,
    }
    axes.add_collection(
        PolyCollection(list(rings), facecolors=(1, 1, 1, 0.45), edgecolors=INK, linewidths=0.9, zorder=4, **look)
    )


def draw_flat_tensors(panel: SubFigure, axes: Axes, field: Field) -> None:
    """Draw ellipses over an image of the anisotropy."""
    values = field.at_pixels(anisotropy)
    _show_numbers(panel, axes, field, values, "anisotropy", cmap=_LIGHT, vmin=0)
    _draw_ellipses(axes, field)


def draw_tensors(panel: SubFigure, axes: Axes, field: Field) -> None:
    """Draw ellipses over an image whose colours show the longest axis and the anisotropy."""
    _show(axes, field, field.at_pixels(tensor_colors))
    key = _key(panel, axes, "longest axis")
    for i, color in enumerate(np.eye(3)):
        key.barh(0.75 - 0.5 * i, 0.5, 0.3, left=-0.7, color=tuple(color), gid=KEPT)
        key.text(0.0, 0.75 - 0.5 * i, f"x{'₁₂₃'[i]}", color=INK, fontsize=points(9), va="center")
    key.text(
        0, -0.75, "white:\nisotropic\n\nellipses: seen\nalong x₃", color=INK, fontsize=points(9), ha="center", va="top"
    )
    _draw_ellipses(axes, field, gid=KEPT)


def tensor_colors(matrices: Array) -> Array:
    """Return colours of tensors: the longest axis in red, green and blue, paler for less anisotropy.

    The usual colours of diffusion tensors jump where the two longest axes are equally long. These are continuous,
    because the cube of the tensor gives the longest axis the largest weight only.
    """
    cubes = np.diagonal(np.linalg.matrix_power(matrices, 3), axis1=-2, axis2=-1)
    axis = np.sqrt(cubes / cubes.sum(axis=-1, keepdims=True))
    return np.asarray(1 - anisotropy(matrices)[..., None] * (1 - axis))


_DRAWN: list[tuple[str, Draw]] = [
    ("euclidean:1", draw_number),
    ("euclidean:2", draw_vectors),
    *((names, partial(_draw_angle, angles, period)) for names, (angles, period) in ANGLES.items()),
    ("sphere:2", partial(_draw_directions, np.asarray, "angle to x₃, degrees")),
    ("cp:1 cgr:1,2", partial(_draw_directions, bloch_vectors, "Bloch vector: angle to |0⟩, degrees")),
    *((name, partial(_draw_orientations, MATRICES[name])) for name in ("sphere:3", "so:3", "su:2")),
    ("spd:2", draw_flat_tensors),
    ("spd:3", draw_tensors),
]
_PICTURES = {name: draw for names, draw in _DRAWN for name in names.split()}

"""Dark styles of matplotlib: the colours of a picture with inverted lightness."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from matplotlib import rc_context, rcParams, rcParamsDefault
from matplotlib.artist import Artist
from matplotlib.cm import ScalarMappable
from matplotlib.collections import Collection
from matplotlib.colors import ListedColormap, to_rgba, to_rgba_array
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

from .style import EDGE, GRID, INK

_COLOURS: tuple[Any, ...] = (
    "figure.facecolor",
    "axes.facecolor",
    "axes.edgecolor",
    "axes.labelcolor",
    "text.color",
    "grid.color",
)
_COLOURS += (
    "xtick.color",
    "ytick.color",
    "xtick.labelcolor",
    "ytick.labelcolor",
    "legend.labelcolor",
    "patch.edgecolor",
)
KEPT = "kept"
"""Group of artists whose colours have a meaning, or that are drawn over such colours; they are not inverted."""
_WEIGHTS = np.array([0.299, 0.587, 0.114])


def is_dark(color: Any) -> bool:
    """Whether a background is darker than a middle grey; transparent ones count as white."""
    *rgb, alpha = to_rgba(color)
    return bool(1 - alpha * (1 - _WEIGHTS @ rgb) < 0.5)


@contextmanager
def light_colors(dark: bool) -> Iterator[None]:
    """Draw with the default colours of matplotlib, if they are inverted afterwards."""
    if not dark:
        yield
        return
    with rc_context({name: rcParamsDefault[name] for name in _COLOURS}):
        yield


def inverted(color: Any, background: Any) -> Any:
    """Return colours with inverted lightness, shape (..., 4). White becomes the background."""
    rgba = np.array(color, np.float64)
    rgb = rgba[..., :3]
    # In HLS, the lightness is the mean of the largest and the smallest component.
    twice = rgb.max(axis=-1, keepdims=True) + rgb.min(axis=-1, keepdims=True)
    base = np.array(to_rgba(background)[:3])
    rgba[..., :3] = base + (1 - base) * np.clip(rgb + 1 - twice, 0, 1)
    return rgba


def kept_color(color: Any, dark: bool) -> Any:
    """Return a colour of the user as it must be drawn, so that it is the same after colours have been inverted."""
    return tuple(inverted(to_rgba(color), "black")) if dark and color is not None else color


def invert(artists: Sequence[Artist], background: Any) -> None:
    """Invert the lightness of the colours of artists, whatever they are."""

    def new(color: Any) -> Any:
        return tuple(inverted(to_rgba(color), background))

    for artist in artists:
        if artist.get_gid() == KEPT:
            continue
        if isinstance(artist, Text):
            artist.set_color(new(artist.get_color()))
            arrow = getattr(artist, "arrow_patch", None)
            if arrow is not None:
                _change(arrow, ("facecolor", "edgecolor"), new)
        elif isinstance(artist, Line2D):
            _change(artist, ("color", "markerfacecolor", "markeredgecolor"), new)
        elif isinstance(artist, Patch):
            _change(artist, ("facecolor", "edgecolor"), new)
        elif isinstance(artist, Collection) and artist.get_array() is None:
            for name in ("facecolor", "edgecolor"):
                values = to_rgba_array(getattr(artist, f"get_{name}")())
                if len(values):
                    getattr(artist, f"set_{name}")(inverted(values, background))
        if isinstance(artist, ScalarMappable) and artist.get_array() is not None:
            shades = artist.get_cmap()(np.linspace(0, 1, 256))
            artist.set_cmap(ListedColormap(inverted(shades, background)))
        if artist.get_path_effects():
            artist.set_path_effects([withStroke(linewidth=2.5, foreground=background, alpha=0.85)])


def _change(artist: Any, names: Sequence[str], new: Any) -> None:
    # All colours are read first, because the colour of a line is that of its markers by default.
    values = {name: getattr(artist, f"get_{name}")() for name in names}
    for name, value in values.items():
        if not (isinstance(value, str) and value in ("none", "auto")):
            getattr(artist, f"set_{name}")(new(value))


def invert_page(figure: Any) -> None:
    """Invert the lightness of all colours of a figure. White becomes the background of the style of the user."""
    background = rcParams["figure.facecolor"]
    for axes in figure.axes:
        invert_ticks(axes, background)
    kept = {id(tick) for axes in figure.axes for axis in axes._axis_map.values() for tick in _of_ticks(axis)}
    invert([artist for artist in figure.findobj() if id(artist) not in kept], background)


def invert_ticks(axes: Any, background: Any) -> None:
    """Invert the lightness of ticks, their labels, grids and the walls of boxes."""
    edge, ink, grid, white = (tuple(inverted(to_rgba(own), background)) for own in (EDGE, INK, GRID, "white"))
    axes.tick_params(axis="both", which="both", color=edge, labelcolor=ink, grid_color=grid)
    if axes.name == "3d":
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.set_pane_color(white)


def _of_ticks(axis: Any) -> list[Artist]:
    """Return the artists of ticks, which have their colours from the parameters of the axis."""
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    panes = [axis.pane] if hasattr(axis, "pane") else []
    return [artist for tick in ticks for artist in tick.findobj()] + panes


__all__ = ["invert", "invert_page", "invert_ticks", "is_dark", "kept_color", "light_colors"]

"""Axes of the user in place of a panel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from .._base.arrays import short_repr
from .._core import ValidationError
from .._spaces import Product, Space, cover_of
from .curves import START, Curve
from .figure import IN_ROWS, PATHS, VIEWS, draw_picture
from .matrices import are_graphs
from .shrink import shrink
from .style import BOTTOM, INK, LEFT, OWN_AXES, RIGHT, TOP, axes_size, points, text_factor
from .theme import invert, invert_ticks, is_dark, light_colors

_FULL, _SMALLEST = 3.2, 0.5
"""The shorter side in inches of axes whose symbols have their full size, and the smallest factor for others."""


class AxesPanel:
    """Existing axes with the methods of a ``SubFigure`` that pictures use.

    A picture adds its axes and gets those of the user. The look of their frame does not change.

    Parameters
    ----------
    axes : Axes
        Axes to draw into.
    square : bool
        Whether the panel is as wide as high at most, so that pictures have no second part.
    """

    def __init__(self, axes: Axes, square: bool) -> None:
        self.axes = axes
        figure: Any = axes.get_figure(root=True)
        box = axes.get_window_extent()
        # Small axes count as larger ones, reduced.
        self.factor = float(np.clip(min(box.width, box.height) / figure.dpi / _FULL, _SMALLEST, 1.0))
        self.dpi = self.factor * figure.dpi
        width, height = box.width / self.dpi + LEFT + RIGHT, box.height / self.dpi + BOTTOM + TOP
        width, height = (min(width, height),) * 2 if square else (width, height)
        self.bbox = Bbox.from_bounds(0, 0, width * self.dpi, height * self.dpi)
        self._used = False
        OWN_AXES[axes] = self.factor

    def add_axes(self, rectangle: Any, projection: str | None = None, **look: Any) -> Any:
        """Return the axes of the user; further ones are insets."""
        if self._used:
            return self.axes.inset_axes(rectangle, projection=projection, **look)
        wanted = projection or "rectilinear"
        if self.axes.name != wanted:
            kind = f"projection='{wanted}'" if projection else "no projection"
            raise ValidationError(
                f"ax has the projection {self.axes.name!r}, but this picture needs axes with {kind}. Create them by "
                + (f"figure.add_subplot(projection='{wanted}')." if projection else "figure.add_subplot().")
            )
        self._used = True
        # Names of axes that the user chose remain.
        kept = {name: value for name, value in look.items() if name not in ("facecolor", "label")}
        for name in ("xlabel", "ylabel", "zlabel"):
            if name in kept and getattr(self.axes, f"get_{name}")():
                del kept[name]
        self.axes.set(**kept)
        return self.axes

    def text(self, x: float, y: float, words: str, **look: Any) -> Any:
        """Write words below the axes, in as many lines as their width requires."""
        letters = max(20, int(axes_size(self.axes)[0] * self.factor / text_factor(self.axes) / 0.065))
        words = "\n".join(fill(line, letters) for line in words.splitlines())
        own: Any = {"ha": "center", "color": INK, "fontsize": points(9)} | look
        return self.axes.annotate(
            words,
            (0.5, 0),
            (0, -28 if self.axes.axison and self.axes.name != "3d" else -8),
            xycoords="axes fraction",
            textcoords="offset points",
            va="top",
            **own,
        )


def draw_into(ax: Axes, curves: Sequence[Curve], title: str | None, show: bool) -> Axes:
    """Draw the picture of curves into axes that `check_axes` has accepted."""
    name = str(cover_of(curves[0].space))
    if ax.has_data() and name in IN_ROWS and not are_graphs(curves):
        raise ValidationError(
            "ax already contains a picture, and symbols of several curves would overlap. Draw all of them in one call: "
            "symspline.plot([first, second], ax=ax)."
        )
    with panel_of(ax, name in PATHS, title, show) as panel:
        draw_picture(panel, curves[0].space, curves)
    return ax


@contextmanager
def panel_of(ax: Axes, square: bool, title: str | None, show: bool) -> Iterator[AxesPanel]:
    """Return axes of the user as a panel, and adapt what is drawn into it to their style and size."""
    panel = AxesPanel(ax, square)
    before, had = set(ax.findobj()), ax.has_data()
    names = list(ax._axis_map)
    limits = {name: getattr(ax, f"get_{name}lim")() for name in names if had}
    figure: Any = ax.get_figure(root=True)
    dark = has_dark_background(ax)
    with light_colors(dark):
        yield panel
    for name, (low, high) in limits.items():
        # Pictures with limits of their own must not hide what was there.
        if not getattr(ax, f"get_autoscale{name}_on")():
            own = getattr(ax, f"get_{name}lim")()
            getattr(ax, f"set_{name}lim")(min(low, own[0]), max(high, own[1]))
    _name_start(ax)
    own = _own(ax)
    legend = {text for own in [ax.get_legend()] if own is not None for text in own.findobj(Text)}
    shrink([artist for artist in ax.findobj() if artist not in before | own | legend], panel.factor, text_factor(ax))
    if dark:
        _darken(ax, before, figure.get_facecolor())
    if title is not None:
        # Explanations of symbols are above the axes.
        above = ax.get_legend() is not None or any(float(np.asarray(text.get_position())[1]) > 1 for text in ax.texts)
        ax.set_title(title, pad=26 if above else None)
    if show:
        from matplotlib import pyplot

        pyplot.show()


def has_dark_background(ax: Axes) -> bool:
    """Whether axes of the user are dark."""
    figure: Any = ax.get_figure(root=True)
    facecolor: Any = ax.get_facecolor()
    return is_dark(facecolor if ax.axison and facecolor[3] else figure.get_facecolor())


def _own(ax: Any) -> set[Artist]:
    """Return the artists of the axis of axes, which belong to the user."""
    return {artist for own in ax._axis_map.values() for artist in own.findobj()}


def _darken(ax: Any, before: set[Artist], background: Any) -> None:
    """Invert new artists in axes of the user; ticks and labels have the colours of the user, except in boxes."""
    box, kept = ax.name == "3d", _own(ax)
    labels = [axis.label for axis in ax._axis_map.values()] if box else []
    invert([artist for artist in ax.findobj() if artist not in before and artist not in kept] + labels, background)
    if box:
        invert_ticks(ax, background)


def _name_start(ax: Axes) -> None:
    """Name the first of the markers of starting points in legends."""
    marks = [line for line in ax.lines if line.get_label() in (START, "start")]
    if marks and all(line.get_label() == START for line in marks):
        # Markers on the far side of a globe are faint.
        next((line for line in marks if line.get_alpha() is None), marks[0]).set_label("start")


def check_axes(ax: Any, space: Space) -> None:
    """Raise an error unless a picture of the space can be drawn into axes."""
    if not isinstance(ax, Axes):
        raise TypeError(f"ax must be axes of matplotlib, not {short_repr(ax)}")
    if isinstance(space, Product):
        raise ValidationError(
            f"ax is one set of axes, but a curve on {space!r} has one picture per factor. Omit ax to draw a page."
        )
    if str(cover_of(space)) in VIEWS and ax.has_data():
        raise ValidationError(
            "ax already contains a picture, and the view of this picture depends on the curves. Draw all of them in "
            "one call: symspline.plot([first, second], ax=ax)."
        )


def next_color(ax: Any) -> Any:
    """Return the next colour of the property cycle of axes."""
    (probe,) = ax.plot(*[[]] * (3 if ax.name == "3d" else 2))
    color = probe.get_color()
    probe.remove()
    return color

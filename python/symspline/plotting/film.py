"""Films of landmarks: a strip along the time axis, and small multiples."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from .._core import ValidationError
from .figure import CurveFigure, save
from .frames import VIEW
from .style import DATES, DPI, EDGE, HALO, INK, heading, window

Array = NDArray[np.float64]

# Drawings in the strip, and in each row of the small multiples.
_STRIP, _ROWS, _COLUMNS = 25, 2, 6
_WIDTH, _HEIGHT = 11.4, 7.6


class Film(Protocol):
    """What is asked of a film: that is a `symspline.shapes.AffineMorph`."""

    @property
    def t(self) -> NDArray[Any]:
        """The times of the drawings."""

    @property
    def landmarks(self) -> Array:
        """The drawings that were given, shape (N+1, landmarks, n)."""

    def __call__(self, x: Any) -> Array:
        """Drawings at times x."""


def plot_film(film: Film, file: Any = None) -> Figure:
    """The figure of a film, saved if ``file`` is given. See `symspline.shapes.AffineMorph.plot`."""
    drawings, count, n = film.landmarks.shape
    if n > 3:
        raise ValidationError(f"pictures of landmarks are made in 2 or 3 dimensions, not in {n}")
    strip, multiples = _times(film.t, _STRIP), _times(film.t, _ROWS * _COLUMNS)
    seen = [_seen(film(x)) for x in (film.t, strip, multiples)]
    # Every drawing fits into a square of this size around its middle.
    size = 2.1 * max(float(np.abs(x - _middle(x)).max()) for x in seen)
    figure = CurveFigure(figsize=(_WIDTH, _HEIGHT), dpi=DPI, facecolor="white")
    heading(
        figure, "Morph along a C² spline of affine shapes", f"{drawings} drawings of {count} landmarks", 0.93
    )
    _draw_strip(figure.add_axes((0.05, 0.58, 0.9, 0.26)), film.t, strip, seen[0], seen[1], size)
    for i, (x, drawing) in enumerate(zip(multiples, seen[2], strict=True)):
        row, column = divmod(i, _COLUMNS)
        axes = figure.add_axes((0.03 + column * 0.157, 0.26 - row * 0.25, 0.15, 0.24))
        _draw_one(axes, x, drawing, seen[2], _color(i / (len(multiples) - 1)))
    if file is not None:
        save(figure, file)
    return figure


def _times(t: NDArray[Any], number: int) -> NDArray[Any]:
    """Times from the first to the last, equally spaced."""
    if t.dtype.kind == "M":
        # Those in whole days would be rounded to days.
        t = t.astype("datetime64[us]")
    times: NDArray[Any] = t[0] + (t[-1] - t[0]) * np.arange(number) / (number - 1)
    times[-1] = t[-1]
    return times


def _seen(drawings: Array) -> Array:
    """Landmarks as they look on paper."""
    return drawings if drawings.shape[-1] == 2 else drawings @ VIEW[:2].T


def _middle(drawings: Array) -> Array:
    middle: Array = (drawings.max(axis=-2, keepdims=True) + drawings.min(axis=-2, keepdims=True)) / 2
    return middle


def _draw_strip(axes: Axes, t: NDArray[Any], x: NDArray[Any], given: Array, film: Array, size: float) -> None:
    """Drawings beside one another, their middles on the time axis; the given ones filled."""
    axes.set_facecolor("none")
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.spines["bottom"].set_color(EDGE)
    axes.tick_params(color=EDGE, labelcolor=INK, labelsize=9)
    axes.set(yticks=[], ylim=(-1, 1))
    dates = t.dtype.kind == "M"
    places, knots = (np.asarray(DATES.date2num(values) if dates else values, float) for values in (x, t))
    if dates:
        locator = DATES.AutoDateLocator(minticks=3, maxticks=8)
        axes.xaxis.set_major_locator(locator)
        axes.xaxis.set_major_formatter(DATES.ConciseDateFormatter(locator))
    else:
        axes.set_xlabel("t", color=INK)
    span = places[-1] - places[0]
    # Half a drawing of the axes' height fits before the first time and behind the last.
    box = axes.get_position()
    share = box.height * _HEIGHT / (box.width * _WIDTH)
    total = span / (1 - share)
    axes.set_xlim(places[0] - share * total / 2, places[-1] + share * total / 2)
    # In these units height and width are the same on paper.
    upright = np.array([share * total / 2, 1]) * 1.9 / size
    for times, drawings, bold in ((places, film, False), (knots, given, True)):
        for place, drawing in zip(times, drawings, strict=True):
            color = _color((place - places[0]) / span)
            corners = [place, 0] + (drawing - _middle(drawing)) * upright
            width, fill = (1.8, 0.25) if bold else (0.7, 0.0)
            axes.fill(
                *corners.T, facecolor=(*color[:3], fill), edgecolor=color, linewidth=width, zorder=3 + bold
            )


def _draw_one(axes: Axes, x: Any, drawing: Array, film: Array, color: Any) -> None:
    """One drawing, where it is, with the numbers of its landmarks."""
    middle, half = window(film.reshape(-1, 2), 1.25)
    axes.set(aspect="equal", xticks=[], yticks=[])
    axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half))
    axes.spines[:].set_color(EDGE)
    axes.spines[:].set_linewidth(0.5)
    axes.fill(*drawing.T, facecolor=(*color[:3], 0.15), edgecolor=color, linewidth=1.4)
    axes.plot(*drawing.T, "o", color=color, markersize=3)
    for number, place in enumerate(drawing):
        axes.annotate(
            str(number), place, (3, 3), textcoords="offset points", fontsize=7, color=INK, path_effects=HALO
        )
    name = np.datetime_as_string(x, "m").replace("T", " ") if isinstance(x, np.datetime64) else f"t = {x:.3g}"
    axes.text(0.03, 0.95, name, transform=axes.transAxes, va="top", fontsize=8, color=INK)


def _color(share: float) -> Any:
    return colormaps["viridis"](0.85 * share)

"""Films of landmarks: a film strip along the time axis, and small multiples."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from .._core import ValidationError
from .matrices import VIEW
from .page import drawing
from .plot import finish
from .style import DATES, Array, halo, ink, plain, show_dates, time_colors, window

# Drawings in the strip, and in each row of the small multiples.
_STRIP, _ROWS, _COLUMNS = 19, 2, 6
_WIDTH, _HEIGHT = 11.4, 7.6
_NUMBERED = 12
"""The largest number of landmarks that all have their number; of more, the first one has a white dot."""


def plot_film(t: NDArray[Any], landmarks: Array, film: Callable[[Any], Array], file: Any = None) -> Figure:
    """Draw the figure of a film, and save it if ``file`` is given. See `symspline.shapes.AffineMorph.plot`.

    Parameters
    ----------
    t : ndarray
        Times of the given drawings.
    landmarks : ndarray, shape (N+1, landmarks, n)
        Given drawings.
    film : callable
        Returns the drawings at given times.
    file : path or file object, optional
        File to save the figure to.
    """
    drawings, count, n = landmarks.shape
    if n > 3:
        raise ValidationError(f"pictures of landmarks are made in 2 or 3 dimensions, not in {n}")
    strip, multiples = _times(t, _STRIP), _with_given(_times(t, _ROWS * _COLUMNS), t)
    seen = [film(x) if n == 2 else film(x) @ VIEW[:2].T for x in (t, strip, multiples)]
    # Every drawing fits into a square of this size around its centre.
    size = 2.1 * max(float(np.abs(_centred(x)).max()) for x in seen)
    middle, half = window(seen[2].reshape(-1, 2), 1.25)
    words = f"{drawings} given drawings of {count} landmarks, and others between them; colour: time"
    with drawing((_WIDTH, _HEIGHT), None, False) as figure:
        figure.set_layout_engine(None)
        title = "Morph along a C² spline of affine shapes"
        figure.text(0.03, 0.93, title, weight="bold", fontsize="xx-large")
        figure.text(0.03, 0.93 - 0.3 / _HEIGHT, words, fontsize="large")
        _draw_strip(figure.add_axes((0.05, 0.58, 0.9, 0.24)), t, strip, seen[0], seen[1], size)
        caption: Any = {"fontsize": "small"}
        figure.text(0.03, 0.84, "each drawing centred at its time; filled: given", **caption)
        dot = "; white dot: first landmark" * (count > _NUMBERED)
        figure.text(0.03, 0.51, f"drawings at their positions; bold frames: given{dot}", **caption)
        for i, (x, landmarks) in enumerate(zip(multiples, seen[2], strict=True)):
            row, column = divmod(i, _COLUMNS)
            axes = figure.add_axes((0.03 + column * 0.157, 0.26 - row * 0.25, 0.15, 0.24), aspect="equal")
            axes.set(xticks=[], yticks=[])
            axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half))
            _draw_one(axes, x, landmarks, time_colors(i / (len(multiples) - 1)), bool(np.any(x == t)))
    return finish(figure, file, False)


def _times(t: NDArray[Any], number: int) -> NDArray[Any]:
    """Return equidistant times from the first to the last."""
    if t.dtype.kind == "M":
        # Times that count whole days would be rounded to days.
        t = t.astype("datetime64[us]")
    times: NDArray[Any] = t[0] + (t[-1] - t[0]) * np.arange(number) / (number - 1)
    times[-1] = t[-1]
    return times


def _with_given(times: NDArray[Any], t: NDArray[Any]) -> NDArray[Any]:
    """Return times with given ones in place of the closest ones, if they are few."""
    t = t.astype(np.result_type(times, t))
    places = np.abs(np.subtract.outer(t, times)).argmin(axis=1)
    if len(np.unique(places)) == len(t):
        times[places] = t
    return times


def _centred(drawings: Array) -> Array:
    """Return drawings relative to the centres of their bounding boxes."""
    middles: Array = (drawings.max(axis=-2, keepdims=True) + drawings.min(axis=-2, keepdims=True)) / 2
    return drawings - middles


def _draw_strip(axes: Axes, t: NDArray[Any], strip: NDArray[Any], given: Array, film: Array, size: float) -> None:
    """Draw a row of drawings with their centres at their times. Given ones are filled."""
    plain(axes)
    axes.grid(visible=False)
    axes.spines["left"].set_visible(False)
    axes.set(yticks=[], ylim=(-1, 1))
    dates = t.dtype.kind == "M"
    positions, knots = (np.asarray(DATES.date2num(values) if dates else values, float) for values in (strip, t))
    if dates:
        show_dates(axes.xaxis, 3, 8)
    else:
        axes.set_xlabel("t")
    span = positions[-1] - positions[0]
    # There is space for half a drawing of the axes' height before the first time and after the last.
    box = axes.get_position()
    share = box.height * _HEIGHT / (box.width * _WIDTH)
    half = share * span / (1 - share) / 2
    axes.set_xlim(positions[0] - half, positions[-1] + half)
    # These units are equally long on paper in both directions.
    upright = np.array([half, 1]) * 1.9 / size
    for times, drawings, bold in ((positions, film, False), (knots, given, True)):
        width, fill = (1.8, 0.25) if bold else (0.5, 0.0)
        for at, (x, y) in zip(times, np.moveaxis(_centred(drawings) * upright, -1, 1), strict=True):
            color = time_colors((at - positions[0]) / span)
            axes.fill(
                at + x,
                y,
                facecolor=(color, fill),
                edgecolor=(color, 1 if bold else 0.6),
                linewidth=width,
                zorder=3 + bold,
            )


def _draw_one(axes: Axes, x: Any, drawing: Array, color: Any, given: bool) -> None:
    """Draw one drawing at its position, with the numbers of its landmarks if they are few. Given ones have a frame."""
    axes.spines[:].set(color=ink() if given else ink(0.4), linewidth=1.4 if given else 0.5)
    axes.fill(*drawing.T, facecolor=(color, 0.15), edgecolor=color, linewidth=1.4)
    axes.plot(*drawing.T, "o", color=color, markersize=float(np.clip(12 / np.sqrt(len(drawing)), 1.2, 3)))
    if len(drawing) > _NUMBERED:
        axes.plot(*drawing[0], "o", color="white", markeredgecolor=color, markersize=4.5)
    look: Any = {"textcoords": "offset points", "fontsize": "x-small", "path_effects": halo()}
    for number, at in enumerate(drawing if len(drawing) <= _NUMBERED else ()):
        axes.annotate(str(number), at, (3, 3), **look)
    name = np.datetime_as_string(x, "m").replace("T", " ") if isinstance(x, np.datetime64) else f"t = {x:.3g}"
    axes.text(0.03, 0.95, name, transform=axes.transAxes, va="top", fontsize="small")

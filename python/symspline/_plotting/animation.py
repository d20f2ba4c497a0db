"""Animations: a marker or a body that moves along a curve, a line at the time in all graphs, and the time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation, writers
from matplotlib.axes import Axes

from .._base.arrays import checked_number, short_repr, whole_number
from .._base.system import path_of, replacing
from .._base.typing import FloatArray, Look
from .._core import ValidationError
from .curves import Curve
from .plot import page_of
from .style import DATES, MARK, ink

_DPI = 80
_MOST_FRAMES = 10_000
_FORMATS = {".gif": "pillow", ".apng": "pillow", ".webp": "pillow", ".mp4": "ffmpeg", ".webm": "ffmpeg"}
_Update = Callable[[float], None]
"""Shows the state at a time of the core."""


def animate(curve: Any, file: Any = None, frames: int = 60, fps: float = 15, **look: Any) -> FuncAnimation:
    """Return an animation, and save it if ``file`` is given. See `symspline.Curve.animate`."""
    frames = whole_number(frames, "frames", 2)
    if frames > _MOST_FRAMES:
        raise ValidationError(f"frames must be at most {_MOST_FRAMES}, not {frames}")
    checked_number(fps, "fps must be a number between 0.1 and 1000", lambda x: 0.1 <= x <= 1000)
    if curve._batch:
        raise ValidationError(f"this is a batch of {len(curve)} curves. Animate one of them: curves[0].animate(...).")
    path = None if file is None else _checked_path(file)
    figure, (drawn,) = page_of(curve, **look)
    # Frames at equal distances in time, without those in gaps.
    even = np.linspace(drawn.x[0], drawn.x[-1], frames)
    times = drawn.x[np.unique(np.clip(np.searchsorted(drawn.x, even), 0, len(drawn.x) - 1))]
    updates = list(_updates(figure.axes, drawn))
    clock = figure.text(0.99, 0.99, "", ha="right", va="top", fontsize="large")

    def update(x: float) -> list[Any]:
        clock.set_text(_time(drawn, x))
        for one in updates:
            one(x)
        return []

    moving = FuncAnimation(figure, update, frames=times.tolist(), interval=1000 / fps, blit=False, repeat=True)
    if path is not None:
        with replacing(path) as temporary:
            kind: Any = writers[_FORMATS[path.suffix.lower()]]
            moving.save(temporary, writer=kind(fps=fps), dpi=_DPI)
    return moving


def _checked_path(file: object) -> Path:
    """Return the path of an animation whose format can be written."""
    path = path_of(file, method="write")
    if path is None:
        raise ValidationError(f"file must be the name of a file, such as 'curve.gif', not {short_repr(file)}")
    kind = _FORMATS.get(path.suffix.lower())
    if kind is None:
        raise ValidationError(
            f"file = {short_repr(str(path))}: the name of an animation must end in {', '.join(_FORMATS)}"
        )
    if not writers.is_available(kind):
        raise ValidationError(
            f"file = {short_repr(str(path))}: {path.suffix} needs the program {kind}, which is not installed. Install "
            "it, or choose a name that ends in .gif."
        )
    return path


def _time(curve: Curve, x: float) -> str:
    """Return the time on the axis of the figure as text."""
    (at,) = curve.on_axis(np.array([x]))
    if curve.axis.dates:
        return f"{DATES.num2date(at):%Y-%m-%d %H:%M:%S}"
    return f"{curve.axis.name} = {at:.4g}"


def _updates(figures: list[Axes], curve: Curve) -> Iterator[_Update]:
    """Move a marker along every line, a vertical line in every graph, and bodies of pictures."""
    for axes, x, positions in curve.tracks:
        yield _marker(axes, x, positions)
    for axes in figures:
        if axes.get_gid() == "time":
            line = axes.axvline(curve.times[0], color=MARK, linewidth=1.2, zorder=2.5)
            yield lambda x, line=line: line.set_xdata(curve.on_axis(np.array([x, x])))  # type: ignore[misc]
    for x, body in curve.bodies:
        move = body()
        yield lambda time, move=move, x=x: move(min(int(np.searchsorted(x, time)), len(x) - 1))  # type: ignore[misc]


def _marker(axes: Any, x: FloatArray, positions: FloatArray) -> _Update:
    """Return a function that moves a marker to the position at a time, or hides it outside a segment."""
    nowhere = np.full((positions.shape[1], 1), np.nan)
    look: Look = {"marker": "o", "markersize": 9, "color": MARK, "markeredgecolor": ink(0), "linestyle": "none"}
    (dot,) = axes.plot(*nowhere, zorder=8, **look)

    def update(time: float) -> None:
        row = int(np.searchsorted(x, time))
        at = positions[row][:, None] if row < len(x) and x[row] == time else nowhere
        (dot.set_data_3d if len(at) == 3 else dot.set_data)(*at)

    return update

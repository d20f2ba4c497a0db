"""Animations: a marker or a frame that moves along a curve, and a line at the time in all panels."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation, writers
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import SubFigure
from matplotlib.quiver import Quiver

from .._base.arrays import checked_number, short_repr, whole_number
from .._base.disk import path_of, replacing
from .._core import ValidationError
from .._spaces import Product, cover_of, factors_of
from .chart import origin_of
from .curves import LINE, Curve
from .figure import FACTORS
from .matrices import MATRICES, outlines
from .page import page_of
from .rows import REACH, VIEW
from .style import AXES, Array

_DPI = 80
_MOST_FRAMES = 10_000
_CURSOR = "#d95f0e"
_FORMATS = {".gif": "pillow", ".apng": "pillow", ".webp": "pillow", ".mp4": "ffmpeg", ".webm": "ffmpeg"}
Update = Callable[[int], None]


def animate(
    curve: Any,
    file: Any = None,
    frames: int = 60,
    fps: float = 15,
    **look: Any,
) -> FuncAnimation:
    """Return an animation, and save it if ``file`` is given. See `symspline.Curve.animate`."""
    frames = whole_number(frames, "frames", 2)
    if frames > _MOST_FRAMES:
        raise ValidationError(f"frames must be at most {_MOST_FRAMES}, not {frames}")
    checked_number(fps, "fps must be a number between 0.1 and 1000", lambda x: 0.1 <= x <= 1000)
    if curve._batch:
        raise ValidationError(f"this is a batch of {len(curve)} curves. Animate one of them: curves[0].animate(...).")
    path = None if file is None else _checked_path(file)
    page = page_of(curve, **look)
    (own,) = page.curves
    # Frames at equal distances in time, without those in gaps.
    even = np.linspace(own.x[0], own.x[-1], frames)
    rows = np.unique(np.clip(np.searchsorted(own.x, even), 0, len(own.x) - 1))
    updates = [*_markers(page.figure.axes, own), *_cursors(page.figure.axes, own), *_bodies(page.picture, own)]

    def update(row: int) -> list[Any]:
        for one in updates:
            one(int(row))
        return []

    moving = FuncAnimation(page.figure, update, frames=rows.tolist(), interval=1000 / fps, blit=False, repeat=True)
    if path is not None:
        with replacing(path) as temporary:
            kind: Any = writers[_FORMATS[path.suffix.lower()]]
            moving.save(temporary, writer=kind(fps=fps), dpi=_DPI)
    return moving


def _checked_path(file: Any) -> Path:
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


# ---- what moves ----


def _markers(figures: list[Axes], curve: Curve) -> Iterator[Update]:
    """Move a marker along every line of the curve, wherever pictures draw it."""
    for axes in figures:
        for line in axes.lines:
            if line.get_gid() != LINE:
                continue
            data = _samples_of(line)
            found = _rows_of(data, curve)
            if found is not None:
                yield _marker(axes, data, found)


def _samples_of(line: Any) -> Array:
    """Return the positions of a line in two or three dimensions."""
    data = line.get_data_3d() if hasattr(line, "get_data_3d") else line.get_data(orig=False)
    return np.column_stack([np.ma.filled(np.asarray(own, np.float64), np.nan) for own in data])


def _rows_of(data: Array, curve: Curve) -> Array | None:
    """Return the sample of the curve of each row of a line, −1 for rows that break it; None for other lines.

    A line that leaves a map has three rows more, of which the middle one is NaN.
    """
    for part in curve.unbroken:
        first = int(np.searchsorted(curve.x, part.x[0]))
        extra = len(data) - len(part.x)
        kept = np.ones(len(data), bool)
        if extra > 0:
            (gaps,) = np.nonzero(np.isnan(data[:, 0]))
            if 3 * len(gaps) != extra:
                continue
            kept[np.clip(np.add.outer(gaps, [-1, 0, 1]), 0, len(data) - 1)] = False
        if kept.sum() == len(part.x):
            found = np.full(len(data), -1)
            found[kept] = first + np.arange(len(part.x))
            return found
    return None


def _marker(axes: Any, data: Array, found: Array) -> Update:
    """Return a function that moves a marker to the row of a sample, or hides it."""
    positions = {int(sample): data[i] for i, sample in enumerate(found) if sample >= 0}
    look: Any = {"marker": "o", "markersize": 9, "color": _CURSOR, "markeredgecolor": "white", "linestyle": "none"}
    (dot,) = axes.plot(*[[np.nan]] * data.shape[1], zorder=8, **look)

    def update(row: int) -> None:
        at = positions.get(row, np.full(data.shape[1], np.nan))[:, None]
        if len(at) == 3:
            dot.set_data_3d(*at)
        else:
            dot.set_data(*at)

    return update


def _cursors(figures: list[Axes], curve: Curve) -> Iterator[Update]:
    """Move a vertical line in every panel with a time axis."""
    for axes in figures:
        if axes.get_gid() == "time":
            yield _cursor(axes, curve)


def _cursor(axes: Axes, curve: Curve) -> Update:
    line = axes.axvline(curve.times[0], color=_CURSOR, linewidth=1.2, zorder=2.5)

    def update(row: int) -> None:
        line.set_xdata([curve.times[row]] * 2)

    return update


def _bodies(picture: SubFigure, curve: Curve) -> Iterator[Update]:
    """Move the frame of a rotation or a pose, or the ellipse of a matrix."""
    space = curve.space
    if not isinstance(space, Product):
        yield from _body(picture, str(cover_of(space)), curve)
        return
    # The panels of factors follow their captions.
    panels = [panel for panel in picture.subfigs if panel.axes or panel.subfigs]
    for i, (panel, factor) in enumerate(zip(panels, factors_of(space)[:FACTORS], strict=True)):
        yield from _body(panel, str(cover_of(factor)), curve.part(i))


def _body(panel: SubFigure, name: str, curve: Curve) -> Iterator[Update]:
    axes: Any = next(iter(panel.axes), None)
    if name in MATRICES and any(isinstance(own, Quiver) for own in axes.collections):
        yield _frame_at_time(axes, MATRICES[name](curve.points), curve)
    elif name == "se:3":
        yield _frame_in_space(axes, curve.points, origin_of(panel, [curve], lambda poses: poses[:, :3, 3]))
    elif name in ("spd:2", "spd:3"):
        view = VIEW if name == "spd:3" else np.eye(2)
        yield _ellipse(axes, view @ curve.points @ view.T, curve)


def _row_of_curve(axes: Axes) -> float:
    """Return the height of the row of samples of the curve, which is the last one."""
    return axes.get_ylim()[0] + 0.5


def _frame_at_time(axes: Axes, matrices: Array, curve: Curve) -> Update:
    """Return a function that moves a frame along the time axis."""
    look: Any = {"units": "inches", "scale_units": "inches", "scale": 1, "clip_on": False, "in_layout": False}
    look |= {"width": 0.05, "headwidth": 3.2, "headlength": 4, "headaxislength": 3.8, "color": AXES, "zorder": 9}
    start, height = curve.times[:1].repeat(3), np.full(3, _row_of_curve(axes))
    arrows = axes.quiver(start, height, np.ones(3), np.ones(3), **look)

    def update(row: int) -> None:
        right, up, _ = 1.2 * REACH * VIEW @ matrices[row]
        arrows.set_offsets(np.column_stack([curve.times[row].repeat(3), height]))
        arrows.set_UVC(right, up)

    return update


def _frame_in_space(axes: Any, poses: Array, origin: Array) -> Update:
    """Return a function that moves a frame along a path, which counts from an origin."""
    length = 0.2 * float(np.ptp(axes.get_xlim()))
    sticks = [axes.plot([], [], [], color=color, linewidth=3.5, zorder=9)[0] for color in AXES]

    def update(row: int) -> None:
        foot = poses[row, :3, 3] - origin
        for i, stick in enumerate(sticks):
            stick.set_data_3d(*np.stack([foot, foot + length * poses[row, :3, i]], axis=1))

    return update


def _ellipse(axes: Any, matrices: Array, curve: Curve) -> Update:
    """Return a function that moves an ellipse along the time axis, on the scale of the others."""
    drawn = [own for own in axes.collections if isinstance(own, PolyCollection) and own.get_label() != "band"]
    # The last collection begins with the ellipse at the first sample, in inches.
    ellipse: Any = drawn[-1].get_paths()[0].vertices
    inches = np.abs(ellipse).max() / np.abs(outlines(matrices[:1])).max()
    height = _row_of_curve(axes)
    body = PolyCollection([np.zeros((3, 2))], facecolors="none", edgecolors=_CURSOR, linewidths=2.2, zorder=9)
    body.set(offsets=[[curve.times[0], height]], offset_transform=axes.transData, clip_on=False)
    body.set_transform(drawn[-1].get_transform())
    axes.add_collection(body, autolim=False)

    def update(row: int) -> None:
        body.set_verts(list(inches * outlines(matrices[row : row + 1])))
        body.set_offsets([[curve.times[row], height]])

    return update

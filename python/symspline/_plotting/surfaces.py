"""Pictures of positions and poses over two axes of a grid: a surface in space, with frames for poses."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import LightSource
from matplotlib.figure import SubFigure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from .chart import box, explain_frames
from .fields import Field
from .style import AXES, HALO, INK, Array, evenly, points

_LINES, _FRAMES = 80, 9
"""Points along an axis of the surface, and the largest number of frames along it."""
_FACE = "#d9e6ef"
_SUN = LightSource(azdeg=225, altdeg=70)


def draw_surface(panel: SubFigure, field: Field, nodes: Any) -> None:
    """Draw positions of R³, or poses of SE(3) with their frames, and the nodes as dots. Missing areas are blank."""
    positions = _positions(field.pixels)
    i, j = (evenly(size, _LINES) for size in positions.shape[:2])
    positions = positions[np.ix_(i, j)]
    known = np.isfinite(positions[..., 0])
    dots = _positions(nodes).reshape(-1, 3)
    dots = dots[np.isfinite(dots[:, 0])]
    axes = box(panel, [], [np.concatenate([positions[known], dots])], below=0.4)
    areas = np.nan_to_num(np.cross(np.diff(positions, axis=0)[:, 1:], np.diff(positions, axis=1)[1:]))
    # A surface without area has no bright side. The order of the axes decides which side that is.
    shade = bool(np.any(areas))
    look: Any = {"linewidths": 0, "facecolors": _FACE, "antialiaseds": False, "shade": shade, "lightsource": _SUN}
    grid = positions if areas[..., 2].sum() > 0 else positions.swapaxes(0, 1)
    faces = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2).reshape(-1, 4, 3)
    axes.add_collection3d(Poly3DCollection(faces[np.isfinite(faces).all(axis=(1, 2))], **look))
    symbols = _positions(field.symbols)
    # Lines on the surface at the pixels that are closest to the symbols.
    fine, (left, right, low, high) = _positions(field.pixels), field.extent
    across, along = (
        np.clip(np.rint((x - start) / (stop - start) * count - 0.5), 0, count - 1).astype(int)
        for x, start, stop, count in zip((field.x, field.y), (left, low), (right, high), fine.shape, strict=False)
    )
    for lines in (fine[across], fine[:, along].swapaxes(0, 1)):
        broken = np.concatenate([lines, np.full_like(lines[:, :1], np.nan)], axis=1)
        axes.plot(*broken.reshape(-1, 3).T, color=INK, linewidth=0.5, alpha=0.45, zorder=4)
    axes.plot(*dots.T, "o", color=INK, markersize=2.2, label="nodes", zorder=5)
    _name_axes(axes, symbols)
    if field.pixels.ndim > 3:
        _draw_frames(axes, field)
        explain_frames(panel, axes)


def _positions(points: Any) -> Array:
    """Return the positions of points of R³ or poses."""
    return np.asarray(points if points.shape[-2:] != (4, 4) else points[..., :3, 3])


def _name_axes(axes: Any, lines: Array) -> None:
    """Write the names of the axes where each of them ends, if there is a value."""
    for k, at in enumerate((lines[-1, 0], lines[0, -1])):
        if np.isfinite(at).all():
            axes.text(*at, f"  axis {k} →", color=INK, fontsize=points(9), path_effects=HALO, zorder=6)


def _draw_frames(axes: Any, field: Field) -> None:
    """Draw the columns of the rotations of some poses."""
    poses = field.symbols[np.ix_(*(evenly(size, _FRAMES) for size in field.symbols.shape[:2]))].reshape(-1, 4, 4)
    poses = poses[np.isfinite(poses[:, 0, 0])]
    length = 0.07 * float(np.ptp(axes.get_xlim()))
    feet = poses[:, :3, 3]
    for i, color in enumerate(AXES):
        sticks = np.stack([feet, feet + length * poses[:, :3, i], np.full_like(feet, np.nan)], axis=1)
        axes.plot(*sticks.reshape(-1, 3).T, color=color, linewidth=1.2, zorder=5)

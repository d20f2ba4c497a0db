"""Rigid motions: where a body goes and how it is turned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import SubFigure
from numpy.typing import NDArray

from .curves import Curve
from .flat import plane, room
from .frames import explain, given_note
from .style import AXES, DATA, INK, window

Array = NDArray[np.float64]

_ARROW = np.array([[1.0, 0.0], [-0.7, 0.55], [-0.35, 0.0], [-0.7, -0.55]])
"""A body of the plane that points along its first axis."""
_MANY = 24
"""How many bodies all curves together have, or two each."""


def draw_flat_poses(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """SE(2): arrow heads that stand on the path and point along their first axis; the given ones filled."""
    axes = plane(panel)
    _, half = window(np.concatenate([curve.extent[:, :2, 2] for curve in curves]), 1.0)
    length = 0.07 * (half or 1.0) * (1 if curves[0].alone else 0.6)
    for curve in curves:
        curve.draw_line(axes, curve.points[:, :2, 2], linewidth=1.2, alpha=0.6)
        bold, between = curve.picked(max(2, _MANY // len(curves)))
        edge = INK if curve.alone else curve.color
        if curve.noise is not None:
            curve.draw_dots(axes, curve.given[:, :2, 2])
            some = curve.picked_data(max(2, _MANY // len(curves)))
            light = DATA if curve.alone else curve.color
            _draw_bodies(axes, curve.given[some], length, facecolor="none", edgecolor=light, alpha=0.6)
        _draw_bodies(axes, curve.points[between], length, facecolor="none", edgecolor=curve.color)
        _draw_bodies(axes, curve.points[bold[1:]], length, facecolor=edge, edgecolor=edge)
        _draw_bodies(axes, curve.points[bold[:1]], length, facecolor="white", edgecolor=edge)
    axes.autoscale_view()


def _draw_bodies(axes: Axes, poses: Array, length: float, **look: Any) -> None:
    turned = length * _ARROW @ poses[:, :2, :2].swapaxes(1, 2)
    axes.add_collection(PolyCollection(list(turned + poses[:, None, :2, 2]), zorder=5, **look))


def draw_poses(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """SE(3): frames that stand on the path; the given ones bold."""
    paths = [curve.points[:, :3, 3] for curve in curves]
    axes = room(panel, paths, 1.2, below=0.4, others=[curve.given[:, :3, 3] for curve in curves])
    length = 0.12 * float(np.ptp(axes.get_xlim()))
    for curve, path in zip(curves, paths, strict=True):
        curve.draw_line(axes, path, linewidth=1.2)
        bold, between = curve.picked(max(2, _MANY // len(curves)))
        _draw_frames(axes, curve.points[between], 0.8 * length, linewidth=0.8, alpha=0.55)
        _draw_frames(axes, curve.points[bold], length, linewidth=2.0 if curve.alone else 1.3)
        if curve.noise is None:
            curve.draw_dots(axes, path[bold], markersize=3.5 if curve.alone else 2)
        else:
            curve.draw_dots(axes, curve.given[:, :3, 3])
            some = curve.picked_data(max(2, _MANY // len(curves)))
            _draw_frames(axes, curve.given[some], 0.8 * length, linewidth=0.8, alpha=0.55)
    explain(axes, given_note(curves), height=-0.06)


def _draw_frames(axes: Any, poses: Array, length: float, **look: Any) -> None:
    """The columns of the rotations, one line of all with the same number."""
    feet = poses[:, :3, 3]
    for i, color in enumerate(AXES):
        ends = feet + length * poses[:, :3, i]
        sticks = np.stack([feet, ends, np.full_like(feet, np.nan)], axis=1).reshape(-1, 3)
        axes.plot(*sticks.T, color=color, zorder=5, **look)

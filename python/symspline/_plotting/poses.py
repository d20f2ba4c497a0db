"""Rigid motions: the path of a body, and its orientation along the path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection

from .chart import Positions, box_around, draw_frames, draw_stems, origin_of, plane, plane_axes, solid
from .curves import Curve, Mover
from .lines import SHADOW, START, draw_dots, draw_line, fresh
from .panels import Panel, View
from .style import Array, apart, axes_size, ink, note, paper, scale_of, window

_BODY: Array = np.array([[1.0, 0.0], [-0.7, 0.55], [-0.35, 0.0], [-0.7, -0.55]])
"""A body in the plane that points along its first axis."""
_LENGTH = 0.14
"""Distance in inches from the position of a body in the plane to its tip."""
_MANY = 24
"""The number of bodies of all curves, or two per curve if that is more."""
_FRAMES = 16
"""The largest number of frames in space, of all curves together."""
_FAN = np.radians(30)
"""Bodies that turn on the spot are drawn at angles of this size."""


def in_plane(curves: Sequence[Curve]) -> View:
    """Return the view of poses of SE(2): bodies that point along their first axis."""
    return plane(curves, lambda poses: poses[:, :2, 2], _draw_bodies)


def _draw_bodies(panel: Panel, curves: Sequence[Curve]) -> None:
    """Draw poses of SE(2) as bodies.

    Given poses are filled bodies if they are far enough from each other, the first one hollow; light bodies are along
    the curve. Otherwise they are dots, and some of them light bodies.
    """
    axes, origin = plane_axes(panel, curves, lambda poses: poses[:, :2, 2])
    positions = np.concatenate([curve.extent[:, :2, 2] for curve in curves])
    unit = float(np.max(np.ptp(positions, axis=0) / axes_size(axes))) or 1.0
    framed = [curve for curve in curves if not curve.faint]
    light = paper(0.2)

    def draw(poses: Array, label: str, **look: Any) -> None:
        if len(poses):
            feet = poses[:, :2, 2] - origin
            bodies = length * _BODY @ poses[:, :2, :2].swapaxes(1, 2) + feet[:, None]
            axes.add_collection(PolyCollection(list(bodies), zorder=6.6, label=fresh(axes, label), **look))
            # Where the body is.
            color = ink(0) if look["facecolor"] == ink() else ink()
            axes.plot(*feet.T, "o", color=color, markersize=1.8, zorder=6.7, label="_feet")

    for curve in curves:
        length = _LENGTH * scale_of(axes) * unit * (1 if curve.alone else 0.6)
        given, edge = curve.given, ink() if curve.alone and curve.has_line else curve.color
        path = curve.points[:, :2, 2] - origin
        draw_line(axes, curve, curve.near_data(path), linewidth=1.6)
        if curve.faint:
            continue
        has_nodes = curve.has_nodes and not curve.is_mean
        has_bodies = curve.noise is None and has_nodes and len(_apart(given, 2 * length)) == len(given)
        if has_bodies:
            draw(given[:1], START, facecolor=ink(0), edgecolor=edge)
            draw(given[1:], "given poses", facecolor=edge, edgecolor=edge)
        elif not curve.is_mean:
            small = float(np.clip(22 / np.sqrt(max(len(given), 1)), 1.5, 4.0))
            # The first of the given poses is a body.
            dots = replace(curve, has_start=not curve.has_nodes)
            draw_dots(axes, dots, given[:, :2, 2] - origin, markersize=small)
        way = float(np.sum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
        spread = _apart if way > length else _turned_apart
        dense = curve.noise is None and has_nodes and not has_bodies
        some = spread(given if dense else curve.points[~curve.bridges], max(4 * length, way * len(framed) / _MANY))
        if has_bodies:
            free = np.linalg.norm(some[:, None, :2, 2] - given[:, :2, 2], axis=-1) > 2 * length
            some = some[free.all(axis=1)]
        first, look = int(dense), {"edgecolor": curve.color, "linewidth": 0.8}
        draw(some[:first], START, facecolor=ink(0), **look)
        draw(some[first:], "some of the poses" if dense else "poses of the curve", facecolor=light, **look)
    axes.autoscale_view()


def _apart(poses: Array, least: float) -> Array:
    """Return poses, the first among them, whose distances along the path are ``least`` or more."""
    steps = np.linalg.norm(np.diff(poses[:, :2, 2], axis=0, prepend=poses[:1, :2, 2]), axis=1)
    return np.asarray(poses[apart(np.cumsum(steps), least)])


def _turned_apart(poses: Array, _: float) -> Array:
    """Return poses of a body that turns on the spot, the first among them, which differ by some angle."""
    angles = np.unwrap(np.arctan2(poses[:, 1, 0], poses[:, 0, 0]))
    return np.asarray(poses[apart(np.cumsum(np.abs(np.diff(angles, prepend=angles[:1]))), _FAN)])


def in_space(curves: Sequence[Curve]) -> View:
    """Return the view of poses of SE(3): frames on the path."""
    return solid(curves, lambda poses: poses[:, :3, 3], _draw_frames)


def _draw_frames(panel: Panel, curves: Sequence[Curve]) -> None:
    """Draw poses of SE(3) as frames on the path. Given ones are bold."""
    origin = origin_of(panel, curves, lambda poses: poses[:, :3, 3])
    place: Positions = lambda poses: poses[:, :3, 3] - origin  # noqa: E731
    everything = np.concatenate([place(curve.extent) for curve in curves])
    length = 0.14 * window(everything, 1.0)[1] or 0.2
    framed = [curve for curve in curves if not curve.faint]
    number = max(2, _FRAMES // len(framed))
    some = {id(curve): curve.samples(number) for curve in framed}
    # The box contains the tips of all frames that are drawn.
    drawn = [poses for groups in some.values() for poses in groups.values()]
    tips = [place(poses) + length * poses[:, :3, i] for poses in drawn for i in range(3)]
    axes = box_around(panel, curves, place, origin, tips)
    for curve in curves:
        # The usual colour is that of the third axis.
        dark = {"color": ink()} if curve.usual and not len(curve.gaps) else {}
        path = curve.near_data(place(curve.points))
        draw_line(axes, curve, path, **{"linewidth": 2.0 if curve.alone else 1.4} | dark)
        if curve.faint:
            continue
        draw_stems(axes, curve, place(curve.given))
        for group, poses in some[id(curve)].items():
            if group == "data":
                draw_frames(axes, poses, 0.7 * length, origin, linewidth=1.2, alpha=0.7)
                continue
            draw_frames(axes, poses, length, origin, linewidth=2.0 if curve.alone else 1.3)
            if curve.noise is None:
                draw_dots(axes, curve, place(poses), markersize=3.5 if curve.alone else 2)
            else:
                draw_dots(axes, curve, place(curve.given))
    words = f"frames: {_words(curves[0], list(some.values()), framed)}"
    if panel.mine:
        axes.plot([], [], [], linestyle="none", label=words)
    else:
        note(axes, f"{words}; thin: {SHADOW}")

    def body() -> Mover:
        poses = np.concatenate([curve.points for curve in curves])
        sticks = draw_frames(axes, poses[:1], 0.2 * float(np.ptp(axes.get_xlim())), origin, linewidth=3.5, zorder=9)

        def move(sample: int) -> None:
            length = 0.2 * float(np.ptp(axes.get_xlim()))
            foot = place(poses[sample : sample + 1])[0]
            for i, stick in enumerate(sticks):
                stick.set_data_3d(*np.stack([foot, foot + length * poses[sample, :3, i]], axis=1))

        return move

    curves[0].bodies.append((np.concatenate([curve.x for curve in curves]), body))


def _words(first: Curve, groups: Sequence[dict[str, Any]], framed: Sequence[Curve]) -> str:
    """Describe which poses have frames."""
    if first.is_mean:
        return "mean curve at times of points"
    if first.noise is not None:
        return "some poses of the curve" + ", lighter: data" * bool(len(first.noise.x[0]))
    if not first.has_nodes:
        return "some poses of the curve"
    shown, count = sum(len(own.get("bold", ())) for own in groups), sum(len(own.given) for own in framed)
    return "given poses" if shown == count else f"{shown} of {count} given poses"

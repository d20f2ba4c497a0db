"""The land of the Earth, for curves of longitude and latitude.

The file ``land.npz`` has the 128 rings of ``ne_110m_land`` of Natural Earth (https://www.naturalearthdata.com), which
is in the public domain: coastlines at 1:110 million and the shore of the Caspian Sea. The array ``points`` has
longitudes and latitudes in hundredths of a degree, ring by ring, and ``starts`` the first rows of all rings except the
first. Rings are counterclockwise, and the Caspian Sea is clockwise. Equal neighbours are omitted.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path as Outline

from .._base.lonlat import from_lonlat
from .globe import View
from .style import EDGE, Array

LAND = "#e4dfd2"
_CHORD = 0.1
"""Longest chord along the horizon in radians."""


@cache
def rings() -> tuple[Array, ...]:
    """Return the rings of the land in degrees, shape (m, 2) each, with equal first and last rows."""
    with np.load(Path(__file__).with_name("land.npz")) as file:
        return tuple(np.split(file["points"] / 100, file["starts"]))


@cache
def _coasts() -> tuple[tuple[Array, Array], ...]:
    """Return the rings as unit vectors, and again with NaN where they follow the date line or the south pole."""
    found = []
    for ring in rings():
        points = from_lonlat(*ring.T)
        edge = (np.abs(ring[:, 0]) == 180) | (ring[:, 1] == -90)
        found.append((points, np.insert(points, np.flatnonzero(edge[1:] & edge[:-1]) + 1, np.nan, axis=0)))
    return tuple(found)


def draw_on_globe(axes: Axes, view: View) -> None:
    """Draw the land that is seen on a globe, or on a part of it."""
    outlines = []
    for points, _ in _coasts():
        if not (points @ view.up > 0).any():
            continue
        steps = _azimuth_steps(points, view)
        outlines.append(Outline(_outline(points, steps, view)))
        if np.rint(steps.sum() / (2 * np.pi)) == -1:
            # The ring contains the point opposite to the viewer. Its outline goes once clockwise around the horizon,
            # which this circle compensates.
            outlines.append(Outline.unit_circle())
    if outlines:
        look = {"facecolor": LAND, "linewidth": 0, "zorder": 1, "label": "_land"}
        land = axes.add_artist(PathPatch(Outline.make_compound_path(*outlines), **look))
        land.set_clip_path(Circle((0, 0), 1, transform=axes.transData))
    broken = [np.concatenate([line, np.full((1, 3), np.nan)]) for _, line in _coasts()]
    axes.plot(*view.visible(np.concatenate(broken)).T, color=EDGE, linewidth=0.5, zorder=1.5, label="_coastline")


def _azimuth_steps(points: Array, view: View) -> Array:
    """Return the steps of the azimuth along a ring as seen by the viewer, in (−π, π]."""
    azimuth = np.arctan2(points @ view.north, points @ view.east)
    return np.asarray((np.diff(azimuth) + np.pi) % (2 * np.pi) - np.pi)


def _outline(points: Array, steps: Array, view: View) -> Array:
    """Return the projection of a ring with its far part moved to the horizon, and arcs instead of long chords there."""
    flat = view.outline(points)
    hidden = points @ view.up <= 0
    long = np.flatnonzero((np.abs(steps) > _CHORD) & hidden[1:] & hidden[:-1])
    parts, done = [], 0
    for i in long.tolist():
        angles = np.arctan2(flat[i, 1], flat[i, 0]) + np.linspace(0, steps[i], int(abs(steps[i]) / _CHORD) + 2)[1:-1]
        parts += [flat[done : i + 1], np.stack([np.cos(angles), np.sin(angles)], axis=-1)]
        done = i + 1
    return np.concatenate([*parts, flat[done:]])


def draw_on_map(axes: Axes) -> None:
    """Draw the land on a map of all longitudes and latitudes."""
    whole = Outline.make_compound_path(*map(Outline, rings()))
    axes.add_artist(PathPatch(whole, facecolor=LAND, edgecolor=EDGE, linewidth=0.4, zorder=0.5, label="_land"))

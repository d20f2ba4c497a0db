"""Curves on the sphere S²."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from numpy.typing import NDArray

from ..places import to_lonlat
from .bands import CIRCLE, draw_tube, places_of_discs
from .curves import Curve
from .globe import View, degrees, draw_frame, draw_globe, middle_of
from .style import GRID, PAPER, inside, plain, size, window

Array = NDArray[np.float64]

_SMALL = np.radians(25)
_WIDEST = 1.5
_POLE = 60
"""Neighbouring samples whose longitudes differ by more have the pole between them."""


def draw_sphere(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """S²: a globe and, if there is room, a map of all longitudes and latitudes."""
    points = np.concatenate([curve.extent for curve in curves])
    axes, view = part_of_globe(panel, points) or _globe(panel, points)
    for curve in curves:
        draw_on_globe(axes, view, curve, curve.points, curve.given, curve.radii)
    width, height = size(panel)
    if width > 2 * height:
        _draw_map(panel, curves, height)


def draw_on_globe(
    axes: Axes, view: View, curve: Curve, line: Array, given: Array, radii: Array | None = None
) -> None:
    """A curve on a globe, dashed on the far side.

    Args:
        line: unit vectors along the curve, shape (m, 3).
        given: those of the given points.
        radii: of a band along the curve, at its samples, as angles.
    """
    if radii is not None:
        some = places_of_discs(curve)
        rings = caps(line[some], radii[some])
        seen = np.max(rings @ view.up, axis=1)[:, None, None] > 0
        draw_tube(axes, curve, np.where(seen, view.outline(rings), np.nan))
    curve.draw_line(axes, view.hidden(line), linewidth=1, linestyle=(0, (2, 2)), alpha=0.6)
    curve.draw_line(axes, view.visible(line))
    curve.draw_dots(axes, view.hidden(given), alpha=0.35)
    curve.draw_dots(axes, view.visible(given))


def part_of_globe(panel: SubFigure, points: Array) -> tuple[Axes, View] | None:
    """The part of a globe, in the left of a panel, where points are; None if they are not close together."""
    view = View.above(*middle_of(points))
    far = np.arctan2(np.linalg.norm(view.flat(points), axis=-1), points @ view.up).max()
    if not 1e-7 < far < _SMALL:
        return None
    width, height = size(panel)
    room = min(width, height)
    axes = panel.add_axes(inside(panel, 0.95, 0.5, width - room + 0.2, height - room + 0.65))
    draw_frame(axes, view, *window(view.flat(points), 1.22))
    axes.tick_params(labelsize=8)
    return axes, view


def _globe(panel: SubFigure, points: Array) -> tuple[Axes, View]:
    """A whole globe in the left of a panel, turned towards points."""
    view = View.above(*middle_of(points))
    width, height = size(panel)
    axes = panel.add_axes(inside(panel, 0.1, 0.1, width - min(width, height) + 0.1, 0.1))
    draw_globe(axes, view, 15)
    return axes, view


def _draw_map(panel: SubFigure, curves: Sequence[Curve], left: float) -> None:
    axes = panel.add_axes(inside(panel, left + 0.65, 0.5, 0.3, 0.2))
    plain(axes)
    axes.set(aspect="equal", xlim=(-180, 180), ylim=(-90, 90), facecolor=PAPER, label="map")
    axes.set_xticks(range(-180, 181, 60), [degrees(x, "E", "W") for x in range(-180, 181, 60)])
    axes.set_yticks(range(-90, 91, 30), [degrees(y, "N", "S") for y in range(-90, 91, 30)])
    axes.set_xticks(range(-180, 181, 30), minor=True)
    axes.grid(which="minor", color=GRID, linewidth=0.6)
    axes.tick_params(which="minor", length=0)
    for curve in curves:
        places, given = curve.marked(lonlat_of)
        if curve.radii is not None:
            _draw_band(axes, curve, places, curve.radii)
        curve.draw_line(axes, broken(places))
        curve.draw_dots(axes, given, clip_on=False, **{} if curve.noise else {"markersize": 4.5})


def caps(points: Array, radii: Array) -> Array:
    """The rims of caps of a sphere around points, shape (m, k, 3)."""
    radii = np.minimum(radii, _WIDEST)[:, None, None]
    aside = np.cross(points, np.eye(3)[np.abs(points).argmin(axis=1)])
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    frame = np.stack([aside, np.cross(points, aside)], axis=1)
    rims: Array = np.cos(radii) * points[:, None] + np.sin(radii) * (CIRCLE @ frame)
    return rims


def _draw_band(axes: Axes, curve: Curve, places: Array, radii: Array) -> None:
    """The band on the map, on both sides of the date line; caps around a pole have no rim there."""
    some = places_of_discs(curve)
    rims = caps(curve.points[some], radii[some])
    lon, lat = to_lonlat(rims)
    middle = np.unwrap(places[some, 0], period=360)[:, None]
    lon = middle + (lon - middle + 180) % 360 - 180
    wide = np.ptp(lon, axis=1) > 180
    rings = np.where(wide[:, None, None], np.nan, np.stack([lon, lat], axis=-1))
    turns = np.unique(np.rint(middle / 360))
    # All in one, so that no part is filled twice; what is beyond the map is left out.
    copies = [rings - [360 * turn, 0] for turn in np.arange(turns[0] - 1, turns[-1] + 2)]
    copies = [np.where(_on_map(copy), copy, np.nan) for copy in copies]
    gap = np.full((1, *rings.shape[1:]), np.nan)
    draw_tube(axes, curve, np.concatenate([part for copy in copies for part in (copy, gap)]))


def _on_map(rings: Array) -> NDArray[np.bool_]:
    """Whether rings are between 180° west and east in part, shape (m, 1, 1)."""
    lon = rings[..., :1]
    seen: NDArray[np.bool_] = (lon.max(axis=1) > -180) & (lon.min(axis=1) < 180)
    return seen[:, None]


def lonlat_of(points: Array) -> Array:
    """Longitude and latitude of samples of a curve, shape (m, 2); at a pole the longitude from before."""
    lon, lat = to_lonlat(points)
    known = np.hypot(points[:, 0], points[:, 1]) > 1e-9
    last = np.maximum.accumulate(np.where(known, np.arange(len(points)), -1))
    return np.column_stack([lon[np.where(last < 0, known.argmax(), last)], lat])


def broken(places: Array) -> Array:
    """A line of longitudes and latitudes broken, by NaN, at the date line and at the poles."""
    step = np.diff(places[:, 0])
    short = step - 360 * np.rint(step / 360)
    (jumps,) = np.nonzero((np.abs(step) > 180) | (np.abs(short) > _POLE))
    gaps = [_gap(places[i], places[i + 1], short[i]) for i in jumps]
    return np.insert(places, np.repeat(jumps + 1, 3), np.reshape(gaps, (-1, 2)), axis=0)


def _gap(before: Array, after: Array, step: float) -> list[Array]:
    """Where a line that goes ``step`` degrees to the east leaves the map, NaN, and where it comes back."""
    if abs(step) > _POLE:
        pole = np.copysign(90, before[1])
        return [np.array([before[0], pole]), np.full(2, np.nan), np.array([after[0], pole])]
    edge = np.copysign(180, step)
    lat = before[1] + (edge - before[0]) / step * (after[1] - before[1])
    return [np.array([edge, lat]), np.full(2, np.nan), np.array([-edge, lat])]

"""Curves on a sphere: on S² itself, states of a qubit, and lines and planes through the origin of R³.

A line through the origin meets the upper half sphere once; a plane is shown by its normal. Opposite points of
the rim are the same line: a curve that leaves there comes back on the other side.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from numpy.typing import NDArray

from .._lonlat import to_lonlat
from .bands import CIRCLE, draw_tube, places_of_discs
from .curves import Curve
from .globe import View, degrees, draw_frame, draw_globe, label_directions, middle_of
from .style import GRID, PAPER, Array, inside, note, plain, size, window

_SMALL = np.radians(25)
_WIDEST = 1.5
_POLE = 60
"""Neighbouring samples whose longitudes differ by more have the pole between them."""
_HEIGHT = 42
"""From how many degrees above the rim the half sphere is seen."""
_RIM = 1e-9
"""A point closer to the plane of the rim may be on either side by rounding."""
_BLOCH = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "|0⟩": (0.0, 0.0, 1.0), "|1⟩": (0.0, 0.0, -1.0)}
_AXES = {"x₁": (1.0, 0.0, 0.0), "x₂": (0.0, 1.0, 0.0), "x₃": (0.0, 0.0, 1.0)}


def draw_sphere(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """S²: a globe and, if there is room, a map of all longitudes and latitudes."""
    points = np.concatenate([curve.extent for curve in curves])
    width, height = size(panel)
    part = _part_of_globe(panel, points)
    axes, view = part or _ball(panel, points, 0.1, width - min(width, height) + 0.1)
    for curve in curves:
        _draw_on_globe(axes, view, curve, curve.points, curve.given, curve.radii)
    if width > 2 * height:
        _draw_map(panel, curves, height)


def draw_bloch(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """CP¹: the Bloch sphere, |0⟩ at the top, or, where states are close together, a part of it."""
    everything = np.concatenate([bloch_vectors(curve.extent) for curve in curves])
    part = _part_of_globe(panel, everything)
    axes, view = part or _ball(panel, everything, spacing=30, lats=(10, 20), labels=_BLOCH)
    for curve in curves:
        # States turn half as far as their vectors.
        radii = None if curve.radii is None else 2 * curve.radii
        _draw_on_globe(axes, view, curve, *curve.marked(bloch_vectors), radii)
    note(panel, "part of the Bloch sphere: longitude from x, |0⟩ is 90°N" if part else "Bloch sphere")


def bloch_vectors(states: Any) -> Array:
    """The unit vectors of states of shape (m, 2) or (m, 2, 1), whatever their phase."""
    a, b = states.reshape(-1, 2).T
    across = 2 * a.conj() * b
    return np.stack([across.real, across.imag, np.abs(a) ** 2 - np.abs(b) ** 2], axis=-1)


def _draw_on_half(
    what: str, vectors: Callable[[Any], Array], panel: SubFigure, curves: Sequence[Curve]
) -> None:
    """Lines, given by unit vectors, on the half sphere, or on a part of the sphere where they are close together."""
    lines = [lifted(vectors(curve.points)) for curve in curves]
    lines = [line if line[0] @ lines[0][0] >= 0 else -line for line in lines]
    if sum(np.sum(line[:, 2]) for line in lines) < 0:
        lines = [-line for line in lines]
    part = _part_of_globe(panel, np.concatenate(lines))
    above = lines if part else [line * sides(line) for line in lines]
    axes, view = part or _ball(panel, np.concatenate(above), lats=(_HEIGHT, _HEIGHT), labels=_AXES, half=True)
    for curve, line, given in zip(curves, lines, above, strict=True):
        if curve.noise is None:
            given = given[curve.knots]
        else:
            near, given = curve.beside(line) if part else np.array([0.0, 0.0, 1.0]), vectors(curve.given)
            given = given * np.where(np.sum(given * near, axis=1) < 0, -1.0, 1.0)[:, None]
        whole, radii = (line, curve.radii) if part else (broken_at_rim(line), None)
        _draw_on_globe(axes, view, curve, whole, given, radii)
    words = "part of the sphere: opposite points" if part else "opposite points of the rim"
    note(panel, f"{words} are the same {what}" + ("; points are normals" if what == "plane" else ""))


# RP² and Gr(1, 3): where lines meet the half sphere. Gr(2, 3): where the normals of planes meet it.
draw_lines = partial(_draw_on_half, "line", lambda points: points.reshape(-1, 3))
draw_normals = partial(_draw_on_half, "plane", lambda bases: np.cross(bases[..., 0], bases[..., 1]))


# ---- on a globe ----


def _draw_on_globe(
    axes: Axes, view: View, curve: Curve, line: Array, given: Array, radii: Array | None
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


def _part_of_globe(panel: SubFigure, points: Array) -> tuple[Axes, View] | None:
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


def _ball(
    panel: SubFigure,
    points: Array,
    below: float = 0.35,
    right: float = 0.1,
    spacing: int = 15,
    lats: tuple[float, float] = (-90, 90),
    labels: Any = None,
    half: bool = False,
) -> tuple[Axes, View]:
    """A whole globe, or its northern half, turned towards points.

    Args:
        below, right: margins in inches.
        spacing: of the graticule, in degrees.
        lats: from which latitudes it may be seen.
        labels: of directions, such as "x".
    """
    lon, lat = middle_of(points)
    view = View.above(lon, float(np.clip(lat, *lats)))
    axes = panel.add_axes(inside(panel, 0.1, below, right, 0.1))
    draw_globe(axes, view, spacing, half)
    if labels:
        room = (-0.85, 1.1) if half else (-1.22, 1.22)
        axes.set(xlim=(-1.2, 1.2) if half else room, ylim=room)
        label_directions(axes, view, labels)
    return axes, view


def caps(points: Array, radii: Array) -> Array:
    """The rims of caps of a sphere around points, shape (m, k, 3)."""
    radii = np.minimum(radii, _WIDEST)[:, None, None]
    aside = np.cross(points, np.eye(3)[np.abs(points).argmin(axis=1)])
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    frame = np.stack([aside, np.cross(points, aside)], axis=1)
    rims: Array = np.cos(radii) * points[:, None] + np.sin(radii) * (CIRCLE @ frame)
    return rims


# ---- on the half sphere ----


def lifted(vectors: Array) -> Array:
    """Unit vectors ±x of samples of a curve, shape (m, 3), with signs such that they do not jump."""
    turned = np.sum(vectors[1:] * vectors[:-1], axis=1) < 0
    line: Array = vectors * np.cumprod(np.append(1.0, np.where(turned, -1.0, 1.0)))[:, None]
    return line


def sides(line: Array) -> Array:
    """1 above the rim and −1 below, shape (m, 1); at the rim itself as before."""
    return np.where(line[_last(np.abs(line[:, 2]) > _RIM), 2] < 0, -1.0, 1.0)[:, None]


def _last(known: NDArray[np.bool_]) -> NDArray[np.intp]:
    """For every sample the last one until then that is known, or the first of all."""
    last = np.maximum.accumulate(np.where(known, np.arange(len(known)), -1))
    return np.where(last < 0, known.argmax(), last)


def broken_at_rim(line: Array) -> Array:
    """The curve on the upper half sphere, broken by NaN where it goes through the rim."""
    side = sides(line)
    (crossings,) = np.nonzero(np.diff(side[:, 0]))
    gaps = []
    for i in crossings:
        before, after = line[i : i + 2] * side[i]
        share = np.clip(before[2] / (before[2] - after[2]), 0, 1)
        rim = (before + share * (after - before)) * [1, 1, 0]
        rim /= np.linalg.norm(rim)
        gaps.append([rim, np.full(3, np.nan), -rim])
    return _interrupted(line * side, crossings, gaps)


def _interrupted(line: Array, after: Any, gaps: Any) -> Array:
    """A line with three more rows behind each of some rows."""
    return np.insert(line, np.repeat(after + 1, 3), np.reshape(gaps, (-1, line.shape[1])), axis=0)


# ---- on the map ----


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


def _draw_band(axes: Axes, curve: Curve, places: Array, radii: Array) -> None:
    """The band on the map, on both sides of the date line; caps around a pole have no rim there."""
    some = places_of_discs(curve)
    lon, lat = to_lonlat(caps(curve.points[some], radii[some]))
    middle = np.unwrap(places[some, 0], period=360)[:, None]
    lon = middle + (lon - middle + 180) % 360 - 180
    lon[np.ptp(lon, axis=1) > 180] = np.nan
    turns = np.unique(np.rint(middle / 360))
    # All in one, so that no part is filled twice; copies beyond the map are omitted.
    copies = []
    for turn in np.arange(turns[0] - 1, turns[-1] + 2):
        moved = lon - 360 * turn
        seen = (moved.max(axis=1) > -180) & (moved.min(axis=1) < 180)
        ring = np.where(seen[:, None, None], np.stack([moved, lat], axis=-1), np.nan)
        copies += [ring, np.full_like(ring[:1], np.nan)]
    draw_tube(axes, curve, np.concatenate(copies))


def lonlat_of(points: Array) -> Array:
    """Longitude and latitude of samples of a curve, shape (m, 2); at a pole the longitude from before."""
    lon, lat = to_lonlat(points)
    return np.column_stack([lon[_last(np.hypot(points[:, 0], points[:, 1]) > 1e-9)], lat])


def broken(places: Array) -> Array:
    """A line of longitudes and latitudes broken, by NaN, at the date line and at the poles."""
    step = np.diff(places[:, 0])
    short = step - 360 * np.rint(step / 360)
    (jumps,) = np.nonzero((np.abs(step) > 180) | (np.abs(short) > _POLE))
    return _interrupted(places, jumps, [_gap(places[i], places[i + 1], short[i]) for i in jumps])


def _gap(before: Array, after: Array, step: float) -> Any:
    """Where a line that goes ``step`` degrees to the east leaves the map, NaN, and where it comes back."""
    if abs(step) > _POLE:
        pole = np.copysign(90, before[1])
        return [[before[0], pole], [np.nan] * 2, [after[0], pole]]
    edge = np.copysign(180, step)
    lat = before[1] + (edge - before[0]) / step * (after[1] - before[1])
    return [[edge, lat], [np.nan] * 2, [-edge, lat]]

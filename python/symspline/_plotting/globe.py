"""Views of a globe: curves on S², states of a qubit, and lines and planes through the origin of R³.

A line through the origin meets the upper hemisphere in one point, and a plane is represented by its normal. Opposite
points of the rim are the same line: a curve that leaves the hemisphere there returns on the other side.

The file ``land.npz`` has the 128 rings of ``ne_110m_land`` of Natural Earth (https://www.naturalearthdata.com), which
is in the public domain: coastlines at 1:110 million and the shore of the Caspian Sea. The array ``points`` has
longitudes and latitudes in hundredths of a degree, ring by ring, and ``starts`` the first rows of all rings except the
first. Rings are counterclockwise, and the Caspian Sea is clockwise. Equal neighbours are omitted.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path as Outline
from numpy.typing import NDArray

from .._base.angles import from_lonlat, to_lonlat
from .._base.typing import Array, FloatArray, Look
from .._spaces import Euclidean, Space
from .curves import Curve
from .panels import (
    CIRCLE,
    FAR,
    Panel,
    View,
    disc_indices,
    draw_arrows,
    draw_dots,
    draw_end,
    draw_line,
    draw_polygon,
    draw_tube,
    fresh,
)
from .style import MARK, Numbers, axes_size, closest, halo, ink, note, paper, plain, round_below, window

LAND = 0.13
"""Share of the colour of text in that of land."""
_CHORD = 0.1
"""Longest chord along the horizon in radians."""
_CLEAR = 0.12
"""Distance of a label from curves, if the radius of the globe is 1."""
_RIM = 1e-9
"""Rounding errors of points on the rim."""
_FRONT, _START = 0.3, 0.15
"""Height above the rim of points that are well in front, and the share of points for which the first one counts."""
_STEPS = np.append(np.multiply.outer(10.0 ** np.arange(-9, 1), [1, 2, 5]).ravel(), [10, 15, 30, 45, 90])


@dataclass(frozen=True)
class Globe:
    """A globe seen from far above a position, by unit vectors to the east, to the north and up."""

    east: FloatArray
    north: FloatArray
    up: FloatArray

    @classmethod
    def above(cls, lon: float, lat: float) -> Globe:
        """Return the globe with a position in the middle."""
        east, up = from_lonlat(lon + 90, 0), from_lonlat(lon, lat)
        return cls(east, np.cross(up, east), up)

    def flat(self, points: FloatArray) -> FloatArray:
        """Return the orthographic projection, shape (..., 2)."""
        return np.stack([points @ self.east, points @ self.north], axis=-1)

    def visible(self, points: FloatArray) -> FloatArray:
        """Return the projection of points on the near side; NaN, which breaks a line, on the far side."""
        return np.where(self._near(points), self.flat(points), np.nan)

    def hidden(self, points: FloatArray) -> FloatArray:
        """Return the projection of points on the far side; NaN on the near side."""
        return np.where(self._near(points), np.nan, self.flat(points))

    def _near(self, points: FloatArray) -> NDArray[np.bool_]:
        """Whether points are on the near side, which includes the rim."""
        return np.asarray((points @ self.up > -_RIM)[..., None])

    def outline(self, ring: FloatArray) -> FloatArray:
        """Return the projection of a ring of points, with its far part moved to the horizon."""
        flat = self.flat(ring)
        horizon = flat / np.linalg.norm(flat, axis=-1, keepdims=True)
        return np.where((ring @ self.up > 0)[..., None], flat, horizon)


def centre_of(space: Space, points: FloatArray) -> FloatArray:
    """Return the centre of the smallest ball around points of a space.

    The steps towards the farthest point become shorter, as in Bădoiu and Clarkson, Smaller core-sets for balls (2003).
    """
    centre = space.project(points.mean(axis=0))
    for i in range(2, 200):
        centre = space.geodesic(centre, points[space.distance(centre, points).argmax()], 1 / i)
    return np.asarray(centre)


def middle_of(points: FloatArray) -> tuple[float, float]:
    """Return longitude and latitude of a position above which points, shape (m, 3), are seen well.

    It is the centre of the smallest circle around the points, or their mean if they do not fit into a hemisphere. If
    the points are all around the globe, the plane closest to them is seen at an angle.
    """
    points = points[:: 1 + len(points) // 2000]
    middle = centre_of(Euclidean(3), points)
    if np.linalg.norm(middle) < 0.25:
        middle = points.mean(axis=0)
    if np.linalg.norm(middle) < 0.25:
        normal = np.linalg.svd(points, full_matrices=False)[2][2]
        middle = middle + 0.2 * points[0]
        middle -= (middle @ normal) * normal
        middle = middle / np.linalg.norm(middle) + (0.6 if normal[2] >= 0 else -0.6) * normal
    lon, lat = to_lonlat(middle)
    return float(lon), float(lat)


def facing(points: FloatArray) -> Globe:
    """Return a globe on which most points, and the first of them, are well in front, close to that of `middle_of`."""
    points = np.concatenate([points[:1], points[:: 1 + len(points) // 500]])
    lon, lat = middle_of(points)
    best, highest = Globe.above(lon, lat), -np.inf
    for aside in range(-75, 76, 15):
        for up in range(-30, 31, 15):
            globe = Globe.above(lon + aside, float(np.clip(lat + up, -90, 90)))
            height = points @ globe.up
            score = np.mean(height > _FRONT) + _START * (height[0] > _FRONT) - 1e-3 * np.hypot(aside, up)
            if score > highest:
                best, highest = globe, float(score)
    return best


def draw_globe(axes: Axes, globe: Globe, spacing: int, half: bool = False) -> None:
    """Draw a shaded globe with a graticule, or the half of it that is seen, with a red rim and its own graticule."""
    axes.set_axis_off()
    axes.set(aspect="equal", xlim=(-1.06, 1.06), ylim=(-1.06, 1.06))
    steps = np.linspace(-180, 180, 721)
    # The brightness of a ball of radius 1 around the middle.
    x, y = np.meshgrid(np.linspace(-1, 1, 400), np.linspace(-1, 1, 400))
    light = np.sqrt(np.maximum(1 - ((x + 0.25) ** 2 + (y - 0.25) ** 2) / 1.9, 0))
    sea = LinearSegmentedColormap.from_list("sea", [paper(0.25), paper(0.13), paper(0.05)])
    image = axes.imshow(light, extent=(-1, 1, -1, 1), origin="lower", cmap=sea, zorder=0)
    edge: Look = {"edgecolor": MARK, "linewidth": 1.4} if half else {"edgecolor": ink(0.4), "linewidth": 1}
    image.set_clip_path(axes.add_patch(Circle((0, 0), 1, fill=False, zorder=3, **edge)))
    lines = [from_lonlat(steps, lat) for lat in range(-90 + spacing, 90, spacing)]
    lines += [from_lonlat(lon, np.linspace(-90, 90, 721)) for lon in range(-180, 180, spacing)]
    turn = np.stack([globe.east, globe.north, globe.up]) if half else np.eye(3)
    for line in (points @ turn for points in lines):
        axes.plot(*globe.visible(line).T, color=ink(0.25), linewidth=0.6, alpha=0.7, zorder=2)


def label_directions(
    axes: Axes, globe: Globe, directions: Mapping[str, tuple[float, float, float]], avoided: FloatArray
) -> None:
    """Draw labelled half axes from the centre of a ball. Those on the far side are faint.

    A label is at the end of its axis or, if positions ``avoided``, shape (m, 2), are there, beside it.
    """
    for label, direction in directions.items():
        end = np.array(direction)
        alpha = 0.9 if end @ globe.up > -1e-9 else 0.5
        stick = globe.flat(np.stack([0 * end, end]))
        axes.plot(*stick.T, color=ink(), linewidth=0.8, alpha=0.6 * alpha, zorder=3)
        x, y = _free(globe.flat(1.17 * end), globe.flat(end), avoided)
        look: Look = {"ha": "center", "va": "center", "path_effects": halo()}
        axes.text(x, y, label, alpha=alpha, zorder=7, **look)


def _free(wanted: FloatArray, tip: FloatArray, avoided: FloatArray) -> FloatArray:
    """Return a position of a label that is not too close to others, or the best one around a tip."""
    angles = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    around = tip + 0.17 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    candidates = np.concatenate([wanted[None], around])
    gaps = np.linalg.norm(candidates[:, None] - avoided, axis=-1)
    closest = np.nanmin(gaps, axis=1, initial=np.inf)
    return np.asarray(candidates[0 if closest[0] > _CLEAR else closest.argmax()])


def draw_frame(axes: Axes, globe: Globe, middle: FloatArray, half: float | FloatArray) -> None:
    """Draw a frame with a graticule, which has labels on the left and at the bottom.

    ``middle`` is the centre of the frame in the projection, and ``half`` half of its width and height. One number is
    that of a square.
    """
    half = np.broadcast_to(half, 2)
    (west, south), (east, north) = middle - half, middle + half
    lon, lat = (float(value) for value in to_lonlat(globe.up))
    reach = np.arcsin(min(1.0, float(np.linalg.norm(middle)) + 1.02 * float(np.linalg.norm(half))))
    aside = np.sin(reach) / np.cos(np.radians(lat))
    around = np.degrees(np.arcsin(aside)) if aside < 1 else 180.0
    reach = np.degrees(reach)
    spacing = closest(_STEPS, np.degrees(2 * half[1]) / 5), closest(_STEPS, around / 3.5) if around < 180 else 30
    parallels = _multiples(spacing[0], max(lat - reach, -90), min(lat + reach, 90))
    meridians = _multiples(spacing[1], lon - around, lon + around)
    steps = np.linspace(-1, 1, 721)
    bottom = [globe.visible(from_lonlat(x, np.clip(lat + reach * steps, -90, 90))) for x in meridians]
    left = [globe.visible(from_lonlat(lon + around * steps, y)) for y in parallels]
    for line in (*bottom, *left):
        axes.plot(*line.T, color=ink(0.25), linewidth=0.7, zorder=2)
    axes.set_xticks(*_ticks(bottom, meridians, spacing[1], "EW", south, west, east))
    axes.set_yticks(*_ticks([line[:, ::-1] for line in left], parallels, spacing[0], "NS", west, south, north))
    axes.set(aspect="equal", xlim=(west, east), ylim=(south, north), facecolor=paper(0.06))
    axes.tick_params(length=0, labelsize="small")


def _multiples(step: float, low: float, high: float) -> list[float]:
    """Return multiples of a step that divides 360 degrees, each direction once."""
    numbers = np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1)
    return [round(float(step * number), 9) for number in numbers if low + 360 - step * number > 1e-9]


def _ticks(
    lines: Iterable[FloatArray],
    values: Iterable[float],
    step: float,
    letters: str,
    level: float,
    low: float,
    high: float,
) -> tuple[list[float], list[str]]:
    """Return the positions where lines cross a level of the second coordinate, and labels that do not overlap.

    Values are multiples of ``step``; if their labels overlap, those of multiples of 2, 5 or more steps remain.
    """
    marks = []
    for line, value in zip(lines, values, strict=True):
        above = line[:, 1] > level
        (i,) = np.nonzero((above[1:] != above[:-1]) & np.isfinite(line[1:, 1] - line[:-1, 1]))
        share = (level - line[i, 1]) / (line[i + 1, 1] - line[i, 1])
        crossed = line[i, 0] + share * (line[i + 1, 0] - line[i, 0])
        marks += [(x, round(value / step), degrees(value, *letters)) for x in crossed.tolist() if low <= x <= high]
    marks.sort()
    kept = marks
    for every in (2, 5, 10, 20):
        widths = [0.02 + (0.018 * len(label) if letters == "EW" else 0.03) for *_, label in kept[1:]]
        if np.all(np.diff([x for x, *_ in kept]) > np.multiply(widths, high - low)):
            break
        kept = [mark for mark in marks if mark[1] % every == 0] or kept[:1]
    return [x for x, *_ in kept], [label for *_, label in kept]


def degrees(value: float, positive: str, negative: str) -> str:
    """``-30`` is 30°W or 30°S; 190 is 170°W."""
    value = value - 360 * np.ceil((value - 180) / 360)
    return f"{abs(value):.10g}°" + ("" if value in (0, 180) else positive if value > 0 else negative)


# ---- the land of the Earth ----


@cache
def rings() -> tuple[FloatArray, ...]:
    """Return the rings of the land in degrees, shape (m, 2) each, with equal first and last rows."""
    with np.load(Path(__file__).with_name("land.npz")) as file:
        return tuple(np.split(file["points"] / 100, file["starts"]))


@cache
def _coasts() -> tuple[tuple[FloatArray, FloatArray], ...]:
    """Return the rings as unit vectors, and again with NaN where they follow the date line or the south pole."""
    coasts = []
    for ring in rings():
        points = from_lonlat(*ring.T)
        edge = (np.abs(ring[:, 0]) == 180) | (ring[:, 1] == -90)
        coasts.append((points, np.insert(points, np.flatnonzero(edge[1:] & edge[:-1]) + 1, np.nan, axis=0)))
    return tuple(coasts)


def draw_land(axes: Axes, globe: Globe) -> None:
    """Draw the land that is seen on a globe, or on a part of it."""
    outlines = []
    for points, _ in _coasts():
        if not (points @ globe.up > 0).any():
            continue
        steps = _azimuth_steps(points, globe)
        outlines.append(Outline(_outline(points, steps, globe)))
        if np.rint(steps.sum() / (2 * np.pi)) == -1:
            # The ring contains the point opposite to the viewer. Its outline goes once clockwise around the horizon,
            # which this circle compensates.
            outlines.append(Outline.unit_circle())
    if outlines:
        look: Look = {"facecolor": ink(LAND), "linewidth": 0, "zorder": 1, "label": "_land"}
        land = axes.add_artist(PathPatch(Outline.make_compound_path(*outlines), **look))
        land.set_clip_path(Circle((0, 0), 1, transform=axes.transData))
    broken = [np.concatenate([line, np.full((1, 3), np.nan)]) for _, line in _coasts()]
    axes.plot(*globe.visible(np.concatenate(broken)).T, color=ink(0.4), linewidth=0.5, zorder=1.5, label="_coastline")


def _azimuth_steps(points: FloatArray, globe: Globe) -> FloatArray:
    """Return the steps of the azimuth along a ring as seen by the viewer, in (−π, π]."""
    azimuth = np.arctan2(points @ globe.north, points @ globe.east)
    return np.asarray((np.diff(azimuth) + np.pi) % (2 * np.pi) - np.pi)


def _outline(points: FloatArray, steps: FloatArray, globe: Globe) -> FloatArray:
    """Return the projection of a ring with its far part moved to the horizon, and arcs instead of long chords there."""
    flat = globe.outline(points)
    hidden = points @ globe.up <= 0
    long = np.flatnonzero((np.abs(steps) > _CHORD) & hidden[1:] & hidden[:-1])
    parts, done = [], 0
    for i in long.tolist():
        angles = np.arctan2(flat[i, 1], flat[i, 0]) + np.linspace(0, steps[i], int(abs(steps[i]) / _CHORD) + 2)[1:-1]
        parts += [flat[done : i + 1], np.stack([np.cos(angles), np.sin(angles)], axis=-1)]
        done = i + 1
    return np.concatenate([*parts, flat[done:]])


def draw_land_on_map(axes: Axes) -> None:
    """Draw the land on a map of all longitudes and latitudes."""
    whole = Outline.make_compound_path(*map(Outline, rings()))
    look: Look = {"facecolor": ink(LAND), "edgecolor": ink(0.4), "linewidth": 0.4, "zorder": 0.5, "label": "_land"}
    axes.add_artist(PathPatch(whole, **look))


_SMALL, _SMALL_ON_SPHERE = np.radians([25, 50])
"""The largest distance from the middle of curves that are drawn in a frame, and of those on S²."""
_COARSE = np.radians(2)
"""Frames narrower than this have no land, as the coastlines are too coarse."""
_WIDEST = 1.5
_FREE = 60
"""The smallest range of longitudes without curves, in degrees, that becomes the edges of a map."""
_PART = 120
"""Maps of curves in a smaller range, from the middle in degrees, are parts of the whole one."""
_POLE = 60
"""Neighbouring samples are on both sides of a pole if their longitudes differ by more degrees."""
_NORTH = np.array([0.0, 0.0, 1.0])
_TEXTBOOK = 30.0, 20.0
"""Longitude and latitude from which a whole Bloch sphere is seen."""
_CROSSINGS = 8
"""The largest number of crossings of the rim that have letters."""
_TWICE = "\nangles on it are twice the distances of states"
_BLOCH = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "|0⟩": (0.0, 0.0, 1.0), "|1⟩": (0.0, 0.0, -1.0)}
_AXES = {"x₁": (1.0, 0.0, 0.0), "x₂": (0.0, 1.0, 0.0), "x₃": (0.0, 0.0, 1.0)}


# ---- the views ----


def sphere(curves: Sequence[Curve]) -> View:
    """Return the view of curves on S²: a globe and a map of longitudes and latitudes, or a part of the globe."""
    look: Look = {"has_band": True, "has_many": True, "is_turned": True}
    if _frame(_extent(curves), _SMALL_ON_SPHERE, 1.0) is not None:
        return View(_draw_sphere, **look)
    return View(_draw_sphere, 11.4, 4.6, rows=2, **look)


def _extent(curves: Sequence[Curve], faint: bool = True) -> FloatArray:
    """Return the points of all curves, or of those that have given points."""
    return np.concatenate([curve.extent for curve in curves if faint or not curve.faint])


def _draw_sphere(panel: Panel, curves: Sequence[Curve]) -> None:
    """Draw curves on a globe and, if there are axes for it, on a map. Those on the Earth have land and a scale bar."""
    radius, axes = curves[0].radius, panel.axes[0]
    globe, is_part = _draw_globe(axes, _extent(curves), _extent(curves, faint=False), _SMALL_ON_SPHERE)
    for curve in curves:
        draw_polygon(axes, curve, globe.visible)
        _draw_on_globe(axes, globe, curve, curve.points, curve.given, curve.radii)
    has_land = radius is not None and (not is_part or bool(np.ptp(axes.get_xlim()) > _COARSE))
    if has_land:
        draw_land(axes, globe)
    if radius is not None and is_part:
        _draw_scale(axes, radius / 1000)
        if not has_land:
            note(axes, "no coastlines at this scale")
    for beside in panel.axes[1:]:
        _draw_map(beside, curves, radius is not None)


def _draw_scale(axes: Axes, radius: float) -> None:
    """Draw a bar in the lower right corner of a frame, whose length is 1, 2 or 5 times a power of ten in km."""
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    length = round_below(0.25 * (east - west) * radius)
    end, height = east - 0.03 * (east - west), south + 0.06 * (north - south)
    look: Look = {"color": ink(), "zorder": 7}
    axes.plot([end - length / radius, end], [height] * 2, "|-", linewidth=1.2, markersize=6, label="_scale", **look)
    middle, above = end - length / radius / 2, height + 0.015 * (north - south)
    look |= {"ha": "center", "va": "bottom", "fontsize": "small", "path_effects": halo()}
    axes.text(middle, above, f"{length:g} km" if length >= 1 else f"{1000 * length:g} m", **look)


def _draw_bloch(panel: Panel, curves: Sequence[Curve]) -> None:
    """Draw states of CP¹ on the Bloch sphere or, if they are close together, on a part of it.

    As in textbooks, |0⟩ is at the top, x points to the viewer and to the left, and y to the right.
    """
    (axes,) = panel.axes
    points = np.concatenate([bloch_vectors(curve.extent) for curve in curves])
    globe, is_part = _draw_globe(axes, points, points, spacing=30, view=_TEXTBOOK, labels=_BLOCH)
    for curve in curves:
        # Angles between Bloch vectors are twice the distances of states.
        radii = None if curve.radii is None else 2 * curve.radii
        draw_polygon(axes, curve, lambda states: globe.visible(bloch_vectors(states)))
        _draw_on_globe(axes, globe, curve, *curve.marked(bloch_vectors), radii)
    note(axes, ("part of the Bloch sphere: longitude from x, |0⟩ is 90°N" if is_part else "Bloch sphere") + _TWICE)


BLOCH = View(_draw_bloch, has_many=True, is_turned=True)


def bloch_vectors(states: Array) -> FloatArray:
    """Return the unit vectors of states of shape (m, 2) or (m, 2, 1). They do not depend on the phase."""
    a, b = states.reshape(-1, 2).T
    across = 2 * a.conj() * b
    return np.stack([across.real, across.imag, np.abs(a) ** 2 - np.abs(b) ** 2], axis=-1)


def _hemisphere(what: str, vectors: Numbers) -> View:
    """Return the view of lines, given by unit vectors: a hemisphere or, if they are close together, a part of it."""

    def draw(panel: Panel, curves: Sequence[Curve]) -> None:
        (axes,) = panel.axes
        lines = [lifted(vectors(curve.points)) for curve in curves]
        lines = [line if line[0] @ lines[0][0] >= 0 else -line for line in lines]
        if sum(np.sum(line[:, 2]) for line in lines) < 0:
            lines = [-line for line in lines]
        # The half sphere is centred on the curves, so that most of them do not cross its rim.
        pole = Globe.above(*middle_of(np.concatenate(lines))).up
        upper = {name: np.multiply(end, 1 if np.dot(end, pole) >= 0 else -1) for name, end in _AXES.items()}
        above = [line * sides(line, pole) for line in lines]
        globe, is_part = _draw_globe(axes, np.concatenate(lines), np.concatenate(above), labels=upper, half=True)
        for curve, line, shown in zip(curves, lines, lines if is_part else above, strict=True):
            given = shown[curve.knots]
            if curve.noise is not None:
                near, given = (curve.closest_samples(line) if is_part else pole, vectors(curve.given))
                given = given * np.where(np.sum(given * near, axis=1) < 0, -1.0, 1.0)[:, None]
            whole, radii = (line, curve.radii) if is_part else (broken_at_rim(line, pole), None)
            _draw_on_globe(axes, globe, curve, whole, given, radii)
            if len(whole) > len(line):
                curve.tracks.append((axes, curve.x, globe.flat(shown)))
                if curve.alone:
                    _name_crossings(axes, globe, whole)
        meaning = "is the normal of a plane" if what == "plane" else "is the direction of a line"
        words = f"{'part of the sphere' if is_part else 'half sphere from above'}: each point {meaning}"
        note(axes, words + ("" if is_part else f"\nopposite points of the red rim are the same {what}"))

    return View(draw, has_many=True, is_turned=True)


def _name_crossings(axes: Axes, globe: Globe, line: FloatArray) -> None:
    """Write one letter at both points of the rim where a curve leaves the half sphere and where it returns."""
    (breaks,) = np.nonzero(np.isnan(line[:, 0]))
    look: Look = {"ha": "center", "va": "center", "fontsize": "small", "color": MARK, "zorder": 7}
    for letter, i in zip("abcdefgh"[:_CROSSINGS], breaks, strict=False):
        for at in (line[i - 1], line[i + 1]):
            x, y = 1.09 * globe.flat(at)
            axes.text(x, y, letter, **look)


# Points of RP² and Gr(1, 3) are lines. Points of Gr(2, 3) are planes, represented by their normals.
LINES = _hemisphere("line", lambda points: points.reshape(-1, 3))
PLANES = _hemisphere("plane", lambda bases: np.cross(bases[..., 0], bases[..., 1]))


# ---- on a globe ----


def _draw_on_globe(
    axes: Axes, globe: Globe, curve: Curve, line: FloatArray, given: FloatArray, radii: FloatArray | None
) -> None:
    """Draw a curve on a globe, dashed on the far side.

    ``line`` and ``given`` are the unit vectors of samples and of given points, shape (m, 3). ``radii`` are the angular
    radii of a band at the samples.
    """
    if radii is not None:
        discs = disc_indices(curve)
        rings = caps(line[discs], radii[discs])
        seen = np.max(rings @ globe.up, axis=1)[:, None, None] > 0
        draw_tube(axes, curve, np.where(seen, globe.outline(rings), np.nan))
    hidden = globe.hidden(line)
    draw_line(axes, curve, globe.visible(line))
    draw_arrows(axes, curve, globe.visible(line), globe.visible(given))
    if not curve.faint and np.isfinite(hidden).any():
        draw_line(axes, curve, hidden, linewidth=1, linestyle=(0, (2, 2)), alpha=0.6, label=fresh(axes, FAR))
    draw_end(axes, curve, globe.hidden(line[-1:]), alpha=0.35)
    draw_dots(axes, curve, globe.visible(given))
    draw_dots(axes, curve, globe.hidden(given), alpha=0.35)


def _frame(vectors: FloatArray, small: float, ratio: float) -> tuple[Globe, FloatArray, FloatArray] | None:
    """Return globe, centre and half sides of a frame around vectors; None if they are not close together.

    ``ratio`` is that of width and height.
    """
    globe = Globe.above(*middle_of(vectors))
    flat = globe.flat(vectors)
    far = np.arctan2(np.linalg.norm(flat, axis=-1), vectors @ globe.up).max()
    if not 1e-9 < far < small:
        return None
    middle, _ = window(flat, 1.0)
    across, high = 0.61 * np.ptp(flat, axis=0)
    high = max(high, across / ratio)
    half = np.array([ratio * high, high])
    # The corners of the frame must be on the globe.
    return (globe, middle, half) if np.linalg.norm(np.abs(middle) + half) < 1 else None


def _draw_globe(
    axes: Axes,
    vectors: FloatArray,
    seen: FloatArray,
    small: float = _SMALL,
    spacing: int = 15,
    view: tuple[float, float] | None = None,
    labels: Any = None,
    half: bool = False,
) -> tuple[Globe, bool]:
    """Draw the part of a globe where vectors are, or all of it if they are not close together.

    Returns the globe, and whether it is a part. A whole globe is turned towards the vectors ``seen``.

    Parameters
    ----------
    axes : Axes
        Axes to draw into.
    vectors, seen : ndarray, shape (m, 3)
        Unit vectors of all curves, and of those towards which a whole globe is turned.
    small : float
        The largest distance from the middle of curves that are drawn in a frame.
    spacing : int
        Spacing of the graticule in degrees.
    view : pair of float or None
        Longitude and latitude from which a whole globe is seen; None if they depend on the curves.
    labels : dict or None
        Labelled directions, such as "x".
    half : bool
        Whether only the northern half is drawn.
    """
    width, height = axes_size(axes)
    frame = _frame(vectors, small, float(np.clip(width / height, 0.5, 2.0))) or _frame(vectors, small, 1.0)
    if frame is not None:
        draw_frame(axes, *frame)
        return frame[0], True
    globe = Globe.above(*(view or middle_of(vectors))) if view or half else facing(seen)
    draw_globe(axes, globe, spacing, half)
    if labels:
        axes.set(xlim=(-1.22, 1.22), ylim=(-1.22, 1.22))
        label_directions(axes, globe, labels, globe.flat(seen))
    return globe, False


def caps(points: FloatArray, radii: FloatArray) -> FloatArray:
    """Return the rims of spherical caps around points, shape (m, k, 3)."""
    radii = np.minimum(radii, _WIDEST)[:, None, None]
    aside = np.cross(points, np.eye(3)[np.abs(points).argmin(axis=1)])
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    frame = np.stack([aside, np.cross(points, aside)], axis=1)
    return np.asarray(np.cos(radii) * points[:, None] + np.sin(radii) * (CIRCLE @ frame))


# ---- on the hemisphere ----


def lifted(vectors: FloatArray) -> FloatArray:
    """Choose the signs of unit vectors ±x along a curve, shape (m, 3), so that they do not jump."""
    turned = np.sum(vectors[1:] * vectors[:-1], axis=1) < 0
    return np.asarray(vectors * np.cumprod(np.append(1.0, np.where(turned, -1.0, 1.0)))[:, None])


def sides(line: FloatArray, pole: FloatArray = _NORTH) -> FloatArray:
    """Return 1 above the rim and −1 below, shape (m, 1). On the rim, the sign is that of the previous sample."""
    heights = line @ pole
    return np.where(heights[_last(np.abs(heights) > _RIM)] < 0, -1.0, 1.0)[:, None]


def _last(known: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return for every sample the last known sample up to it, or the first known one."""
    last = np.maximum.accumulate(np.where(known, np.arange(len(known)), -1))
    return np.where(last < 0, known.argmax(), last)


def broken_at_rim(line: FloatArray, pole: FloatArray = _NORTH) -> FloatArray:
    """Return the curve on the hemisphere around a pole, broken by NaN where it crosses the rim."""
    side = sides(line, pole)
    (crossings,) = np.nonzero(np.diff(side[:, 0]))
    gaps = []
    for i in crossings:
        before, after = line[i : i + 2] * side[i]
        share = np.clip(before @ pole / ((before - after) @ pole), 0, 1)
        rim = before + share * (after - before)
        rim -= (rim @ pole) * pole
        rim /= np.linalg.norm(rim)
        gaps.append([rim, np.full(3, np.nan), -rim])
    return _interrupted(line * side, crossings, gaps)


def _interrupted(line: FloatArray, after: Any, gaps: Any) -> FloatArray:
    """Insert three rows after some of the rows of a line: its end, NaN, and where it begins again."""
    return np.insert(line, np.repeat(after + 1, 3), np.reshape(gaps, (-1, line.shape[1])), axis=0)


# ---- on the map ----


def _draw_map(axes: Axes, curves: Sequence[Curve], has_land: bool) -> None:
    """Draw a map. Without land it is centred on the curves, by a multiple of 60 degrees, and may be a part of it."""
    plain(axes)
    middle = 0 if has_land else _middle_meridian(np.concatenate([curve.extent for curve in curves if not curve.faint]))
    axes.set(aspect="equal", facecolor=paper(0.06), label="map")
    if has_land:
        draw_land_on_map(axes)
    turn = np.stack([from_lonlat(middle, 0), from_lonlat(middle + 90, 0), [0, 0, 1]], axis=-1)
    seen = []
    for curve in curves:
        positions, given = curve.marked(lambda points: lonlat_of(points @ turn))
        seen += [positions, given]
        if curve.radii is not None:
            _draw_band(axes, curve, positions, curve.points @ turn, curve.radii)
        whole = broken(positions)
        if len(whole) > len(positions):
            curve.tracks.append((axes, curve.x, positions))
        draw_line(axes, curve, whole)
        draw_arrows(axes, curve, whole, given)
        draw_dots(axes, curve, given, clip_on=False, **{} if curve.noise else {"markersize": 4.5})
    everything = np.concatenate(seen)
    # Maps are twice as wide as high.
    half = 1.15 * float((np.ptp(everything, axis=0) / [2, 1]).max())
    step = 30 if half < _PART and not has_land else 60
    half = half if step == 30 else 180.0
    lon, lat = np.clip(window(everything, 1.0)[0], [half - 180, half / 2 - 90], [180 - half, 90 - half / 2]).tolist()
    axes.set_xticks(range(-180, 181, step), [degrees(x + middle, "E", "W") for x in range(-180, 181, step)])
    axes.set_yticks(range(-90, 91, step // 2), [degrees(y, "N", "S") for y in range(-90, 91, step // 2)])
    axes.set_xticks(range(-180, 181, step // 2), minor=True)
    axes.grid(which="minor", color=ink(0.2), linewidth=0.6)
    axes.tick_params(which="minor", length=0)
    axes.set(xlim=(lon - half, lon + half), ylim=(lat - half / 2, lat + half / 2))


def _middle_meridian(points: FloatArray) -> int:
    """Return the longitude of the middle of a map that a curve does not leave, or else 0."""
    lon = np.sort(to_lonlat(points)[0])
    steps = np.diff(lon, append=lon[0] + 360)
    widest = int(steps.argmax())
    edge = lon[widest] + steps[widest] / 2
    if steps[widest] < _FREE or lon[widest] + steps[widest] >= 180 >= lon[widest]:
        return 0
    return int(60 * np.rint((edge + 180) / 60)) % 360


def _draw_band(axes: Axes, curve: Curve, positions: FloatArray, points: FloatArray, radii: FloatArray) -> None:
    """Draw the band on the map, on both sides of the date line. Caps around a pole have no rim there."""
    discs = disc_indices(curve)
    lon, lat = to_lonlat(caps(points[discs], radii[discs]))
    middle = np.unwrap(positions[discs, 0], period=360)[:, None]
    lon = middle + (lon - middle + 180) % 360 - 180
    lon[np.ptp(lon, axis=1) > 180] = np.nan
    windings = np.unique(np.rint(middle / 360))
    # All copies are one polygon, so that overlaps are filled once. Copies beyond the map are omitted.
    copies = []
    for winding in np.arange(windings[0] - 1, windings[-1] + 2):
        moved = lon - 360 * winding
        seen = (moved.max(axis=1) > -180) & (moved.min(axis=1) < 180)
        ring = np.where(seen[:, None, None], np.stack([moved, lat], axis=-1), np.nan)
        copies += [ring, np.full_like(ring[:1], np.nan)]
    draw_tube(axes, curve, np.concatenate(copies))


def lonlat_of(points: FloatArray) -> FloatArray:
    """Return longitude and latitude of samples of a curve, shape (m, 2). At a pole, keep the previous longitude."""
    lon, lat = to_lonlat(points)
    return np.column_stack([lon[_last(np.hypot(points[:, 0], points[:, 1]) > 1e-9)], lat])


def broken(positions: FloatArray) -> FloatArray:
    """Break a line of longitudes and latitudes, by NaN, at the date line and at the poles."""
    step = np.diff(positions[:, 0])
    short = step - 360 * np.rint(step / 360)
    (jumps,) = np.nonzero((np.abs(step) > 180) | (np.abs(short) > _POLE))
    return _interrupted(positions, jumps, [_gap(positions[i], positions[i + 1], short[i]) for i in jumps])


def _gap(before: FloatArray, after: FloatArray, step: float) -> Any:
    """Return the points where a line to the east, ``step`` degrees long, leaves and enters the map; NaN between."""
    if abs(step) > _POLE:
        pole = np.copysign(90, before[1])
        return [[before[0], pole], [np.nan] * 2, [after[0], pole]]
    edge = np.copysign(180, step)
    lat = before[1] + (edge - before[0]) / step * (after[1] - before[1])
    return [[edge, lat], [np.nan] * 2, [-edge, lat]]

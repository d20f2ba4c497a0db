"""A globe seen from far away with its graticule, an enlarged part of it, and the land of the Earth.

The file ``land.npz`` has the 128 rings of ``ne_110m_land`` of Natural Earth (https://www.naturalearthdata.com), which
is in the public domain: coastlines at 1:110 million and the shore of the Caspian Sea. The array ``points`` has
longitudes and latitudes in hundredths of a degree, ring by ring, and ``starts`` the first rows of all rings except the
first. Rings are counterclockwise, and the Caspian Sea is clockwise. Equal neighbours are omitted.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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
from .._spaces import Euclidean, Space
from .style import MARK, Array, closest, halo, ink, paper

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

    east: Array
    north: Array
    up: Array

    @classmethod
    def above(cls, lon: float, lat: float) -> Globe:
        """Return the globe with a position in the middle."""
        east, up = from_lonlat(lon + 90, 0), from_lonlat(lon, lat)
        return cls(east, np.cross(up, east), up)

    def flat(self, points: Array) -> Array:
        """Return the orthographic projection, shape (..., 2)."""
        return np.stack([points @ self.east, points @ self.north], axis=-1)

    def visible(self, points: Array) -> Array:
        """Return the projection of points on the near side; NaN, which breaks a line, on the far side."""
        return np.where(self._near(points), self.flat(points), np.nan)

    def hidden(self, points: Array) -> Array:
        """Return the projection of points on the far side; NaN on the near side."""
        return np.where(self._near(points), np.nan, self.flat(points))

    def _near(self, points: Array) -> NDArray[np.bool_]:
        """Whether points are on the near side, which includes the rim."""
        return np.asarray((points @ self.up > -_RIM)[..., None])

    def outline(self, ring: Array) -> Array:
        """Return the projection of a ring of points, with its far part moved to the horizon."""
        flat = self.flat(ring)
        horizon = flat / np.linalg.norm(flat, axis=-1, keepdims=True)
        return np.where((ring @ self.up > 0)[..., None], flat, horizon)


def centre_of(space: Space, points: Array) -> Array:
    """Return the centre of the smallest ball around points of a space.

    The steps towards the farthest point become shorter, as in Bădoiu and Clarkson, Smaller core-sets for balls (2003).
    """
    centre = space.project(points.mean(axis=0))
    for i in range(2, 200):
        centre = space.geodesic(centre, points[space.distance(centre, points).argmax()], 1 / i)
    return np.asarray(centre)


def middle_of(points: Array) -> tuple[float, float]:
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


def facing(points: Array, lats: tuple[float, float]) -> Globe:
    """Return the globe above a latitude in a range in which most points, and the first of them, are well in front.

    It is close to that of `middle_of`.
    """
    points = np.concatenate([points[:1], points[:: 1 + len(points) // 500]])
    lon, lat = middle_of(points)
    best, highest = Globe.above(lon, float(np.clip(lat, *lats))), -np.inf
    for aside in range(-75, 76, 15):
        for up in range(-30, 31, 15):
            globe = Globe.above(lon + aside, float(np.clip(lat + up, *lats)))
            height = points @ globe.up
            score = np.mean(height > _FRONT) + _START * (height[0] > _FRONT) - 1e-3 * np.hypot(aside, up)
            if score > highest:
                best, highest = globe, float(score)
    return best


def draw_globe(axes: Axes, globe: Globe, spacing: int, half: bool = False) -> None:
    """Draw a shaded globe with a graticule, or the half of it that is seen, with a red rim."""
    axes.set_axis_off()
    axes.set(aspect="equal", xlim=(-1.06, 1.06), ylim=(-1.06, 1.06))
    steps = np.linspace(-180, 180, 721)
    # The brightness of a ball of radius 1 around the middle.
    x, y = np.meshgrid(np.linspace(-1, 1, 400), np.linspace(-1, 1, 400))
    light = np.sqrt(np.maximum(1 - ((x + 0.25) ** 2 + (y - 0.25) ** 2) / 1.9, 0))
    sea = LinearSegmentedColormap.from_list("sea", [paper(0.25), paper(0.13), paper(0.05)])
    image = axes.imshow(light, extent=(-1, 1, -1, 1), origin="lower", cmap=sea, zorder=0)
    edge: Any = {"edgecolor": MARK, "linewidth": 1.4} if half else {"edgecolor": ink(0.4), "linewidth": 1}
    image.set_clip_path(axes.add_patch(Circle((0, 0), 1, fill=False, zorder=3, **edge)))
    lines = [from_lonlat(steps, lat) for lat in range(-90 + spacing, 90, spacing)]
    lines += [from_lonlat(lon, np.linspace(-90, 90, 721)) for lon in range(-180, 180, spacing)]
    for line in lines:
        axes.plot(*globe.visible(line).T, color=ink(0.25), linewidth=0.6, alpha=0.7, zorder=2)


def label_directions(
    axes: Axes, globe: Globe, directions: Mapping[str, tuple[float, float, float]], avoided: Array
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
        look: Any = {"ha": "center", "va": "center", "path_effects": halo()}
        axes.text(x, y, label, alpha=alpha, zorder=7, **look)


def _free(wanted: Array, tip: Array, avoided: Array) -> Array:
    """Return a position of a label that is not too close to others, or the best one around a tip."""
    angles = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    around = tip + 0.17 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    candidates = np.concatenate([wanted[None], around])
    gaps = np.linalg.norm(candidates[:, None] - avoided, axis=-1)
    closest = np.nanmin(gaps, axis=1, initial=np.inf)
    return np.asarray(candidates[0 if closest[0] > _CLEAR else closest.argmax()])


def draw_frame(axes: Axes, globe: Globe, middle: Array, half: float | Array) -> None:
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
    lines: Iterable[Array], values: Iterable[float], step: float, letters: str, level: float, low: float, high: float
) -> tuple[list[float], list[str]]:
    """Return the positions where lines cross a level of the second coordinate, and labels that do not overlap.

    Values are multiples of ``step``; if their labels overlap, those of multiples of 2, 5 or more steps remain.
    """
    found = []
    for line, value in zip(lines, values, strict=True):
        above = line[:, 1] > level
        (i,) = np.nonzero((above[1:] != above[:-1]) & np.isfinite(line[1:, 1] - line[:-1, 1]))
        share = (level - line[i, 1]) / (line[i + 1, 1] - line[i, 1])
        crossed = line[i, 0] + share * (line[i + 1, 0] - line[i, 0])
        found += [(x, round(value / step), degrees(value, *letters)) for x in crossed.tolist() if low <= x <= high]
    found.sort()
    kept = found
    for every in (2, 5, 10, 20):
        widths = [0.02 + (0.018 * len(label) if letters == "EW" else 0.03) for *_, label in kept[1:]]
        if np.all(np.diff([x for x, *_ in kept]) > np.multiply(widths, high - low)):
            break
        kept = [own for own in found if own[1] % every == 0] or kept[:1]
    return [x for x, *_ in kept], [label for *_, label in kept]


def degrees(value: float, positive: str, negative: str) -> str:
    """``-30`` is 30°W or 30°S; 190 is 170°W."""
    value = value - 360 * np.ceil((value - 180) / 360)
    return f"{abs(value):.10g}°" + ("" if value in (0, 180) else positive if value > 0 else negative)


# ---- the land of the Earth ----


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
        look: Any = {"facecolor": ink(LAND), "linewidth": 0, "zorder": 1, "label": "_land"}
        land = axes.add_artist(PathPatch(Outline.make_compound_path(*outlines), **look))
        land.set_clip_path(Circle((0, 0), 1, transform=axes.transData))
    broken = [np.concatenate([line, np.full((1, 3), np.nan)]) for _, line in _coasts()]
    axes.plot(*globe.visible(np.concatenate(broken)).T, color=ink(0.4), linewidth=0.5, zorder=1.5, label="_coastline")


def _azimuth_steps(points: Array, globe: Globe) -> Array:
    """Return the steps of the azimuth along a ring as seen by the viewer, in (−π, π]."""
    azimuth = np.arctan2(points @ globe.north, points @ globe.east)
    return np.asarray((np.diff(azimuth) + np.pi) % (2 * np.pi) - np.pi)


def _outline(points: Array, steps: Array, globe: Globe) -> Array:
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
    look: Any = {"facecolor": ink(LAND), "edgecolor": ink(0.4), "linewidth": 0.4, "zorder": 0.5, "label": "_land"}
    axes.add_artist(PathPatch(whole, **look))

"""The pictures of the demo: storm tracks on a globe, three points on a globe, and what C² buys."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from hurdat import Storm
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray
from tracks import GLOBE, KMH, Comparison, Times, comparison, every, samples, slerp_pieces

from symspline import CubicSpline
from symspline._plotting.globe import Globe, degrees, draw_frame, draw_globe
from symspline._plotting.style import halo, ink, spline_color, window
from symspline.geo import from_lonlat, to_lonlat

Array = NDArray[np.float64]

DPI = 150
SPLINE = spline_color()
SPEED = LinearSegmentedColormap.from_list(
    "speed", ["#7fb2d6", "#3b6fb6", "#5b3a9a", "#a3297f", "#dd4a3f", "#f7a51c"]
)
SLERP, LONLAT = "#d95f0e", "#3a9a68"


# ---- the land ----


def coastlines() -> list[Array]:
    """Outlines of the land as unit vectors, shape (n, 3) each."""
    rows = (Path(__file__).parent / "coastline.csv").read_text("ascii").splitlines()[1:]
    breaks = [-1, *(i for i, row in enumerate(rows) if row == ","), len(rows)]
    lines = [rows[a + 1 : b] for a, b in pairwise(breaks)]
    return [from_lonlat(*np.array([row.split(",") for row in line], dtype=float).T) for line in lines]


def _draw_land(axes: Axes, view: Globe) -> None:
    for ring in coastlines():
        if (ring @ view.up > 0).any():
            axes.fill(*view.outline(ring).T, facecolor=ink(0.13), linewidth=0, zorder=1)
            axes.plot(*view.visible(ring).T, color=ink(0.4), linewidth=0.7, zorder=1)


def _head(figure: Figure, title: str, subtitle: str, height: float) -> None:
    """Write title and subtitle in the upper left corner."""
    figure.text(0.03, height, title, fontsize=18, weight="bold")
    figure.text(0.03, height - 0.3 / figure.get_figheight(), subtitle, fontsize=12)


# ---- the tracks ----

NIGHT = "#14181e"
"""The background of dark pages."""
_DARK = {"figure.facecolor": NIGHT} | dict.fromkeys(
    ("text.color", "axes.labelcolor", "xtick.color", "xtick.labelcolor"), "#e8edf2"
)

_LON, _LAT = -62, 28
_OVERVIEW = Globe.above(_LON, _LAT)
# Names that fit beside their track: at its first (0) or last (-1) fix, moved by so many points.
_NAMES = {
    "Bonnie 2022": (-1, (8, 4), "left"),
    "Danielle 2022": (-1, (7, -4), "left"),
    "Elsa 2021": (0, (6, -4), "left"),
    "Fiona 2022": (-1, (7, 3), "left"),
    "Grace 2021": (-1, (-6, -4), "right"),
    "Hermine 2022": (0, (6, -6), "left"),
    "Julia 2022": (-1, (-7, -1), "right"),
    "Larry 2021": (-1, (0, 7), "center"),
    "Martin 2022": (-1, (-2, 7), "center"),
    "Nicole 2022": (0, (7, -3), "left"),
    "Sam 2021": (-1, (0, 7), "center"),
    "Victor 2021": (0, (6, -4), "left"),
    "Wanda 2021": (-1, (7, 0), "left"),
}


def draw_tracks(
    storms: Sequence[Storm], splines: Sequence[CubicSpline], path: Path, dark: bool = False
) -> None:
    """Draw all tracks on a globe, coloured by speed, on a transparent ground; for dark pages if `dark` is True."""
    with rc_context(_DARK if dark else {}):
        _tracks(storms, splines).savefig(path, transparent=True)


def _tracks(storms: Sequence[Storm], splines: Sequence[CubicSpline]) -> Figure:
    figure = Figure(figsize=(13, 10.4), dpi=DPI)
    axes = figure.add_axes((0.01, 0.085, 0.98, 0.845))
    draw_globe(axes, _OVERVIEW, 15)
    axes.set_ylim(-0.54, 1.02)
    _draw_land(axes, _OVERVIEW)
    _label_graticule(axes)
    for spline in splines:
        lines = _draw_track(axes, spline)
    for storm, spline in zip(storms, splines, strict=True):
        if storm.label in _NAMES:
            _draw_name(axes, storm, spline)
    bar = figure.colorbar(
        ScalarMappable(lines.norm, SPEED),
        cax=figure.add_axes((0.3, 0.055, 0.4, 0.016)),
        orientation="horizontal",
        extend="max",
    )
    bar.set_label("speed of the storm, km/h", color=ink(), fontsize=11)
    bar.outline.set_visible(False)
    title = f"{len(storms)} Atlantic storms as C² curves on the sphere"
    _head(figure, title, "best tracks of 2021 and 2022, NOAA HURDAT2; dots: fixes", 0.955)
    return figure


def _draw_track(axes: Axes, spline: CubicSpline) -> LineCollection:
    x = every(np.timedelta64(30, "m"), spline.t)
    line = _OVERVIEW.flat(spline(x))
    track = LineCollection(
        list(np.stack([line[:-1], line[1:]], axis=1)),
        array=KMH * spline.speed(x[:-1] + (x[1:] - x[:-1]) / 2),
        cmap=SPEED,
        norm=Normalize(0, 70),
        linewidths=2.6,
        capstyle="round",
        zorder=4,
    )
    axes.add_collection(track)
    axes.plot(
        *_OVERVIEW.flat(spline.points).T, ".", color="white", markersize=2.2, markeredgewidth=0, zorder=5
    )
    return track


def _draw_name(axes: Axes, storm: Storm, spline: CubicSpline) -> None:
    end, shift, alignment = _NAMES[storm.label]
    x, y = _OVERVIEW.flat(spline.points[end])
    axes.annotate(
        storm.name,
        (x, y),
        shift,
        textcoords="offset points",
        ha=alignment,
        color=ink(),
        fontsize=10.5,
        weight="bold",
        path_effects=halo(),
        zorder=6,
    )


def _label_graticule(axes: Axes) -> None:
    """Parallels at the horizon, meridians on the equator."""
    look: dict[str, Any] = {"color": ink(0.4), "fontsize": 8.5, "va": "center", "zorder": 3}
    for lat in (0, 15, 30, 45, 60):
        limb = np.degrees(np.arccos(-np.tan(np.radians(lat)) * np.tan(np.radians(_LAT))))
        for side, ha in ((-1, "right"), (1, "left")):
            x, y = 1.012 * _OVERVIEW.flat(from_lonlat(_LON + side * limb, lat))
            axes.text(x, y, degrees(lat, "N", "S"), ha=ha, **look)
    for lon in range(-120, 0, 15):
        x, y = _OVERVIEW.flat(from_lonlat(lon, 0))
        axes.text(x + 0.006, y - 0.014, degrees(lon, "E", "W"), ha="left", **look)


# ---- three points ----


def draw_three_points(spline: CubicSpline, path: Path) -> None:
    """A spline through e1, e2, e3 of S² beside the great-circle arcs between them."""
    figure = Figure(figsize=(8, 8.9), dpi=DPI)
    axes = figure.add_axes((0.02, 0.01, 0.96, 0.86))
    view = Globe.above(52, 24)
    draw_globe(axes, view, 15)
    t = np.linspace(0, 2, 401)
    arcs = GLOBE.geodesic(spline.points[:-1, None], spline.points[1:, None], np.linspace(0, 1, 101))
    for arc in arcs:
        axes.plot(*view.flat(arc).T, "--", color=SLERP, linewidth=2, zorder=4)
    axes.plot(*view.flat(spline(t)).T, color=SPLINE, linewidth=3.4, zorder=5)
    axes.plot(*view.flat(spline(t[::20])).T, "o", color="white", markersize=3.6, markeredgewidth=0, zorder=6)
    axes.plot(*view.flat(spline.points).T, "o", color=ink(), markersize=9, zorder=7)
    for i, shift in enumerate([(-14, -22), (12, -16), (-10, 14)]):
        x, y = view.flat(spline.points[i])
        axes.annotate(
            f"$e_{i + 1}$",
            (x, y),
            shift,
            textcoords="offset points",
            color=ink(),
            fontsize=19,
            path_effects=halo(),
            zorder=8,
        )
    _head(figure, "Three points on the sphere", "times 0, 1, 2, natural ends; white dots: every 0.1", 0.955)
    handles = [Line2D([], [], color=SPLINE, linewidth=3.4), Line2D([], [], color=SLERP, linewidth=2, ls="--")]
    labels = ["C² spline", "great-circle arcs"]
    figure.legend(
        handles, labels, loc="upper right", bbox_to_anchor=(0.98, 0.985), frameon=False, fontsize=11
    )
    figure.savefig(path)


# ---- what C² buys ----

_STYLES: list[dict[str, Any]] = [
    {"color": SPLINE, "linewidth": 2.4, "zorder": 3},
    {"color": SLERP, "linewidth": 1.6, "zorder": 2},
    {"color": LONLAT, "linewidth": 1.6, "linestyle": (0, (2.5, 2)), "zorder": 2.5},
]


def draw_comparison(storm: Storm, spline: CubicSpline, path: Path) -> None:
    """Speed, course and turn rate along one storm for three ways to interpolate, beside its track."""
    figure = Figure(figsize=(14, 7.8), dpi=DPI)
    _draw_storm(figure.add_axes((0.045, 0.06, 0.445, 0.8)), spline)
    place = {"left": 0.545, "right": 0.985, "bottom": 0.06, "top": 0.86, "hspace": 0.1}
    panels = list(figure.subplots(3, 1, gridspec_kw=place))
    _draw_motions(panels, comparison(storm, spline))
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower right", bbox_to_anchor=(0.99, 0.862), frameon=False, ncols=3)
    subtitle = (
        "speed, course and turn rate are continuous along the spline; the turn rate has corners at the fixes"
    )
    _head(figure, f"What C² buys: {storm.label}", subtitle, 0.945)
    figure.savefig(path)


def _draw_motions(panels: Sequence[Axes], compared: Comparison) -> None:
    x = compared.times.ravel()
    days = compared.times[_midnight(compared.times[:, 0]), 0]
    for (name, motion), style in zip(compared.motions.items(), _STYLES, strict=True):
        for axes, values in zip(panels, (motion.speed, motion.course, motion.turn), strict=True):
            axes.plot(x, values.ravel(), label=name.replace("C2", "C²"), **style)
    for axes, label in zip(panels, ("speed, km/h", "course", "turn rate to the right, °/h"), strict=True):
        axes.set_ylabel(label, color=ink())
        axes.grid(color=ink(0.2), linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_xticks(days, [_day(time) for time in days] if axes is panels[-1] else [])
        axes.set_xlim(x[0], x[-1])
    _name_courses(panels[1])
    note = "arcs and linear lon/lat: about 0 between the fixes,\ninfinite at them, where the course jumps"
    panels[2].text(0.15, 0.06, note, transform=panels[2].transAxes, color=ink(), fontsize=9.5)


def _name_courses(axes: Axes) -> None:
    """N, E, S, W beside a course in degrees that may go round more than once."""
    low, high = axes.get_ylim()
    quarters = range(int(np.ceil(low / 90)), int(high // 90) + 1)
    axes.set_yticks([90 * q for q in quarters], ["NESW"[q % 4] for q in quarters])


def _midnight(times: Times) -> NDArray[np.bool_]:
    is_midnight: NDArray[np.bool_] = times == times.astype("datetime64[D]")
    return is_midnight


def _day(time: np.datetime64) -> str:
    """Such as ``24 Sep``."""
    return f"{time.item():%d %b}"


def _draw_storm(axes: Axes, spline: CubicSpline) -> None:
    """The track from above, with the date at every midnight."""
    lon, lat = (float(value) for value in to_lonlat(spline.points.mean(axis=0)))
    view = Globe.above(lon, lat)
    line = view.flat(spline(every(np.timedelta64(10, "m"), spline.t)))
    draw_frame(axes, view, *window(line, 1.22))
    dots, arcs = view.flat(spline.points), slerp_pieces(spline)
    axes.plot(*line.T, color=SPLINE, linewidth=2.8, zorder=4)
    for arc in arcs.at(samples(arcs, 13)):
        axes.plot(*view.flat(arc).T, color=SLERP, linewidth=1.2, zorder=5)
    axes.plot(*dots.T, "o", color=ink(), markersize=4, zorder=6)
    left = view.flat(spline.velocities) @ np.array([[0, 1], [-1, 0]])
    left /= np.linalg.norm(left, axis=-1, keepdims=True)
    for i in np.flatnonzero(_midnight(spline.t)):
        axes.annotate(
            _day(spline.t[i]),
            (dots[i, 0], dots[i, 1]),
            (20 * left[i, 0], 20 * left[i, 1]),
            textcoords="offset points",
            ha="center",
            va="center",
            color=ink(),
            path_effects=halo(),
            zorder=7,
        )

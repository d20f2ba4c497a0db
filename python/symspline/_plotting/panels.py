"""Axes of one picture, the view of a space that is drawn into them, time axes, and what is drawn along a curve.

The labels of artists are those of the legend of a page; `LEGEND` has their order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from .._base.typing import FloatArray, Look
from .curves import Axis, Batch, Curve, common_gaps
from .style import (
    DATA,
    DOTTED,
    GAP,
    Indices,
    Numbers,
    axes_size,
    evenly,
    ink,
    letters_in,
    most_ticks,
    note,
    plain,
    scale_of,
    show_dates,
    small,
)

FEW_KNOTS, _LINED, _TICKS = 40, 12, 30
"""The largest numbers of knots that are few, that have lines, and that have ticks, which is per inch."""
_UNITS = (172_800, 86_400, "d"), (7200, 3600, "h"), (100, 60, "min"), (0, 1, "s")
"""The least number of seconds for which a unit is used, its length in seconds, and its name."""
_WIDE, _DATE, _FEWEST = 7, 8, 3
"""Width in inches of axes with more dates, the number of letters of a date, and the smallest largest number of dates
for which the locator finds an interval."""


@dataclass(frozen=True)
class Panel:
    """Axes into which a picture is drawn.

    Attributes
    ----------
    axes : list of Axes
        As many as the view has rows on a page, or those of the user.
    mine : bool
        Whether they are on a page; axes of the user keep their style.
    """

    axes: list[Axes]
    mine: bool

    def explain(self, words: str, right: float = 0.0) -> None:
        """Explain symbols above axes with a time axis on a page, and below axes of the user.

        On a page, the words leave space for ``right`` inches of other symbols.
        """
        if words and self.mine:
            # The layout makes axes narrower than they are now.
            words = fill(words, letters_in(0.85 * axes_size(self.axes[0])[0] - right))
            self.axes[0].set_title(words, loc="left", fontsize="small", weight="normal", pad=3)
        elif words:
            note(self.axes[0], words)


class View(NamedTuple):
    """What is drawn of the curves on a space.

    Attributes
    ----------
    draw : callable
        Draws curves into a panel.
    width, height : float
        Size in inches if the view is the only one. Speed and acceleration are beside it, or below a view that is much
        wider than high.
    rows : int
        Number of axes one below the other, or side by side if they have no time axis.
    is_time : bool
        Whether the axes have a time axis.
    projection : {None, "3d"}
        Projection of the axes.
    has_band : bool
        Whether the view shows uncertainty bands.
    has_many : bool
        Whether it shows all curves of a batch.
    in_rows : bool
        Whether it has symbols in rows, one per curve, so that later curves would overlap them.
    is_turned : bool
        Whether the direction of view depends on the curves, so that later ones cannot be added.
    """

    draw: Callable[[Panel, Sequence[Curve]], None]
    width: float = 5.2
    height: float = 5.2
    rows: int = 1
    is_time: bool = False
    projection: str | None = None
    has_band: bool = False
    has_many: bool = False
    in_rows: bool = False
    is_turned: bool = False

    @property
    def is_wide(self) -> bool:
        """Whether speed and acceleration are below the view."""
        return self.width > 1.5 * self.height

    def draw_into(self, panel: Panel, curves: Sequence[Curve]) -> None:
        """Draw those of the curves that the view shows."""
        if not self.has_many:
            curves = [curve for curve in curves if not curve.faint]
        self.draw(panel, curves if self.in_rows else [part for curve in curves for part in curve.unbroken])


def timeline(draw: Callable[[Panel, Sequence[Curve]], None], height: float = 3.2, rows: int = 1, **more: Any) -> View:
    """Return a view with a time axis."""
    return View(draw, 10.5, height, rows, is_time=True, **more)


def time_axes(panel: Panel, curves: Sequence[Curve], labels: Sequence[str], marked: bool = True) -> list[Axes]:
    """Give the axes of a panel the time axis of curves, and a label of the vertical axis each.

    Unless `marked` is False, they show the times of the given points and long gaps.
    """
    axis = curves[0].axis
    if not panel.mine:
        (axes,) = panel.axes
        axes.set(xlabel=axes.get_xlabel() or axis.name, ylabel=axes.get_ylabel() or labels[0])
        if axis.dates:
            show_dates(axes.xaxis, 3, 7)
        _mark_gaps(axes, curves)
        return [axes]
    first, last = min(curve.times[0] for curve in curves), max(curve.times[-1] for curve in curves)
    for i, (axes, label) in enumerate(zip(panel.axes, labels, strict=True)):
        width, height = axes_size(axes)
        is_lowest = i == len(labels) - 1
        plain(axes)
        axes.set_gid("time")
        axes.grid(visible=False, axis="x")
        axes.set_ylabel(label)
        most = int(np.clip(36 * height / small(), 1, 9))
        axes.yaxis.set_major_locator(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10], min_n_ticks=min(3, most)))
        axes.set_xlim(first - 0.01 * (last - first), last + 0.01 * (last - first))
        if axis.dates:
            # For some spans the locator does not find an interval between narrower limits.
            most = max(_FEWEST, min(10 if width > _WIDE else 5, most_ticks(width, _DATE)))
            show_dates(axes.xaxis, 3 if width > _WIDE else min(2, most - 2), most)
        axes.set_xlabel(axis.name if is_lowest else "")
        axes.tick_params(labelbottom=is_lowest)
        axes.xaxis.offsetText.set_visible(is_lowest)
        if marked:
            mark_knots(axes, curves)
            _mark_gaps(axes, curves)
    return panel.axes


def mark_knots(axes: Axes, curves: Sequence[Curve]) -> None:
    """Mark knots by thin lines, or by short ticks if lines would be too many. Noisy data have short ticks."""
    knots = np.unique(np.concatenate([curve.marks for curve in curves if not curve.faint]))
    lines = len(knots) <= _LINED and curves[0].noise is None
    if len(knots) <= _TICKS * axes_size(axes)[0]:
        look: Look = {"transform": axes.get_xaxis_transform(), "color": ink(0.4), "linewidth": 0.8, "zorder": 1}
        look |= {"linestyle": DOTTED if lines else "-", "label": fresh(axes, curves[0].name_of_marks)}
        axes.vlines(knots, 0, 1.0 if lines else 0.04, **look)


def _mark_gaps(axes: Axes, curves: Sequence[Curve]) -> None:
    """Shade long gaps that all curves have."""
    gaps = common_gaps(curves)
    if not len(gaps):
        return
    label = f"{_lengths(gaps, curves[0].axis)} without data"
    if not any(len(curve.breaks) for curve in curves):
        banded = curves[0].noise is not None and curves[0].noise.speed is not None
        label += f", {'acceleration' if banded else 'rates'} not drawn"
    spans = [(start, end - start) for start, end in gaps.tolist()]
    look: Look = {"transform": axes.get_xaxis_transform(), "facecolor": GAP, "linewidth": 0, "zorder": 0.5}
    axes.broken_barh(spans, (0, 1), label=fresh(axes, label), **look)


def _lengths(gaps: FloatArray, axis: Axis) -> str:
    """Describe the lengths of gaps, given on matplotlib's axis, in seconds if the axis has a unit."""
    longest = float(np.diff(gaps).max()) * (86_400 if axis.dates else 1)
    length = f"{longest:.3g}"
    if axis.seconds:
        unit, name = next((unit, name) for least, unit, name in _UNITS if longest >= least)
        length = f"{longest / unit:.3g} {name}"
    return f"gap of {length}" if len(gaps) == 1 else f"gaps of up to {length}"


# ---- what pictures draw along a curve: its line, given points, data, ends, arrow heads, and bands ----

FRAME = ("first axis", "second axis", "third axis")
"""Names of the axes of frames."""
START, END, DOTS, FAR, AFTER = "start", "end", "given points", "far side", "after the first gap"
SHADOW = "shadow on the floor"
LEGEND = (
    *(START, END, DOTS, "given poses", "some of the poses", "poses of the curve", "control points", "data", *FRAME),
    *("frames", "95 %", FAR, SHADOW, AFTER, "curve in a gap", "gap", "limit", "single curves", "other curves"),
    *("median", "5–95 %", "residual", "times of", "knots"),
)
"""How the labels of artists begin, in the order of the legend of a page, after names of curves."""
LINE = "_curve"
"""Group of lines along curves."""
ALPHA = 0.22
_AFTER_COLOR = "#6aa5d8"
MANY = 150
"""A larger number of points is drawn behind the curve, which they would hide."""
_ANGLES = np.linspace(0, 2 * np.pi, 24, endpoint=False)
CIRCLE: FloatArray = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=-1)
"""Positions on the unit circle."""
_HEAD = np.array([[0.09, 0.0], [-0.06, 0.065], [-0.025, 0.0], [-0.06, -0.065]])
"""Corners of an arrow head in inches."""
_HEADS, _FEW_HEADS, _SHORT = 3, 2, 0.04
"""Numbers of arrow heads of a single curve and of one of several, and the share of parts that have none."""
_NEAR = np.linspace(-0.3, 0.3, 21)
"""How far they are moved away from given points, as parts of the length that belongs to each."""


def fresh(axes: Any, label: str) -> str:
    """Return the label of an artist, which legends ignore if other axes of its kind have it already."""
    return f"_{label}" if any(artist.get_label() == label for artist in (*axes.lines, *axes.collections)) else label


# ---- lines and points ----


def draw_line(axes: Axes, curve: Curve, positions: FloatArray, **look: Any) -> None:
    """Draw a line through positions of shape (m, 2) or (m, 3)."""
    if not curve.has_line:
        return
    # A narrow band must remain visible beside the line.
    width = 1.4 if not curve.alone and not curve.is_mean else 2.4 if curve.noise is None else 1.8
    label = fresh(axes, curve.label) if curve.label else LINE
    look = {"color": curve.color, "linewidth": width, "zorder": 4, "label": label} | look
    if curve.faint:
        look |= {"linewidth": 0.8, "alpha": 0.5, "zorder": 3.2, "label": label}
    if positions.shape[1] == 3:
        # Curves in space have no arrow heads.
        draw_end(axes, curve, positions[-1:])
        if curve.usual and len(curve.gaps):
            # Without a time axis, the parts before and after a gap could not be distinguished.
            after = (curve.times >= curve.gaps[0, 1])[:, None]
            later = look | {"color": _AFTER_COLOR, "label": AFTER}
            plot_line(axes, curve, np.where(after, positions, np.nan), **later)
            positions = np.where(after, np.nan, positions)
    plot_line(axes, curve, positions, **look)


def plot_line(axes: Axes, curve: Curve, positions: FloatArray, **look: Any) -> None:
    """Draw a line, thin and dashed in long gaps."""
    if len(positions) == len(curve.x) and not curve.faint:
        curve.tracks.append((axes, curve.x, positions))
        if np.isfinite(positions[curve.bridges]).all(axis=1).any():
            # One sample on both sides connects the parts.
            near = curve.bridges.copy()
            near[1:] |= curve.bridges[:-1]
            near[:-1] |= curve.bridges[1:]
            name = "curve in a gap" + ", where near the data" * (curve.noise is None)
            light = {"linewidth": 0.5 * look["linewidth"], "linestyle": (0, (4, 2)), "label": fresh(axes, name)}
            *others, last = positions.T
            axes.plot(*others, np.where(near, last, np.nan), **look | light)
            positions = np.column_stack([*others, curve.outside_gaps(last)])
    (line,) = axes.plot(*positions.T, **look)
    line.set_gid(LINE)


def draw_end(axes: Axes, curve: Curve, end: FloatArray, **look: Any) -> None:
    """Draw a square at the end of a curve, shape (1, 2) or (1, 3), unless it is closed."""
    if curve.noise is None and curve.has_line and not curve.faint and not curve.is_closed:
        usual: Look = {"markersize": 7 if curve.alone else 5, "markeredgecolor": ink(0), "zorder": 6.6}
        axes.plot(*end.T, "s", color=curve.color_of_dots, label=fresh(axes, END), **usual | look)


def draw_dots(axes: Axes, curve: Curve, positions: FloatArray, **look: Any) -> None:
    """Draw given points, shape (N+1, 2) or (N+1, 3). The first is hollow; noisy data are small and light."""
    if curve.faint:
        return
    count = max(len(positions), 1)
    dots: Look = {"linestyle": "none", "marker": "o"}
    if not curve.has_line:
        look = {"markersize": float(np.clip(60 / np.sqrt(count), 3, 8)), "markerfacecolor": "none", "zorder": 7} | look
        axes.plot(*positions.T, color=curve.color, label=fresh(axes, curve.label or "data"), **dots | look)
        return
    if curve.noise is not None:
        dots |= {"markersize": float(np.clip(30 / np.sqrt(count), 2.0, 4.0)), "alpha": 0.75 if curve.alone else 0.4}
        dots |= {"color": DATA if curve.alone else curve.color, "markeredgewidth": 0, "zorder": 3.5}
        axes.plot(*positions.T, label=fresh(axes, "data"), **dots | look)
        return
    size = float(np.clip(30 / np.sqrt(count), 2, 6.5)) * (1 if curve.alone else 0.6)
    # Many points would hide the curve.
    look = {"color": curve.color_of_dots, "markersize": size, "zorder": 6 if count <= MANY else 1.8} | look
    look |= {"color": DATA} if count > MANY else {}
    look["markeredgecolor"] = look["color"]
    if curve.has_nodes and not curve.is_mean:
        axes.plot(*positions.T, label=fresh(axes, DOTS), **dots | look)
    if curve.has_start and axes.get_gid() != "time":
        look |= {"color": ink(0), "markeredgewidth": 1.4, "zorder": 6.5, "markersize": 1.3 * look["markersize"]}
        # On the far side of a globe the edge alone is faint.
        look["markeredgecolor"] = to_rgba(look["markeredgecolor"], look.pop("alpha", None))
        axes.plot(*positions[:1].T, label=fresh(axes, START), **dots | look)


def draw_polygon(axes: Axes, curve: Curve, positions: Numbers) -> None:
    """Draw the control polygon at positions of shape (m, 2) or (m, 3)."""
    if curve.polygon is None:
        return
    line, control = map(positions, curve.polygon)
    axes.plot(*line.T, color=curve.color, linewidth=0.9, alpha=0.5, zorder=3.3)
    look: Look = {"color": curve.color, "markerfacecolor": ink(0), "markersize": 5, "linestyle": "none"}
    axes.plot(*control.T, marker="s", zorder=5.5, label=fresh(axes, "control points"), **look)


def draw_arrows(axes: Axes, curve: Curve, positions: FloatArray, dots: FloatArray) -> None:
    """Draw arrow heads on a line through positions of shape (m, 2), which may be broken by NaN, and mark its end.

    The scales of both axes are equal. Arrow heads are far from ``dots``, the positions of given points.
    """
    if curve.faint or not curve.has_line:
        return
    draw_end(axes, curve, positions[-1:])
    steps = np.diff(positions, axis=0)
    lengths = np.linalg.norm(np.nan_to_num(steps), axis=1)
    total = np.cumsum(lengths)
    # The speed of a point at rest is a rounding error.
    moved = curve.at("speed").max() * (curve.x[-1] - curve.x[0])
    if moved <= 1e-12 * np.abs(curve.points).max() or not total[-1] > 0:
        return
    # Every part of a line that is broken has an arrow head, unless it is very short.
    starts = np.flatnonzero(np.diff(np.isfinite(positions[:, 0]).astype(int), prepend=0) == 1)
    first = total[np.minimum(starts, len(total) - 1)]
    parts = np.diff(first, append=total[-1])
    number = _HEADS if curve.alone else _FEW_HEADS
    counts = [max(int(share > _SHORT), round(number * share)) for share in (parts / total[-1]).tolist()]
    shares = [(np.arange(count) + 0.5) / max(count, 1) for count in counts]
    wanted = np.concatenate([start + part * share for start, part, share in zip(first, parts, shares, strict=True)])
    reach = np.concatenate([np.full(count, part / max(count, 1)) for count, part in zip(counts, parts, strict=True)])
    near = np.searchsorted(total, wanted[:, None] + np.multiply.outer(reach, _NEAR))
    at = near[:, len(_NEAR) // 2]
    if curve.noise is None and np.isfinite(dots).any():
        dots = dots[np.isfinite(dots[:, 0])]
        free = np.linalg.norm(positions[near][..., None, :] - dots, axis=-1).min(axis=-1)
        at = near[np.arange(len(near)), np.nan_to_num(free).argmax(axis=1)]
    (x, y), middles = (steps[at] / lengths[at, None]).T, (positions[at] + positions[at + 1]) / 2
    turns = np.stack([np.stack([x, y], axis=-1), np.stack([-y, x], axis=-1)], axis=1)
    scale = Affine2D().scale(scale_of(axes) * (1.0 if curve.alone else 0.8)) + axes.figure.dpi_scale_trans
    look: Look = {"offsets": middles, "offset_transform": axes.transData, "clip_on": False, "zorder": 4.5}
    axes.add_collection(
        PolyCollection(list(_HEAD @ turns), facecolor=curve.color, linewidth=0, transform=scale, label="_time", **look)
    )


# ---- bands ----


def draw_in_plane(
    axes: Axes, curve: Curve, flat: Numbers, rims: Callable[[FloatArray, FloatArray], FloatArray]
) -> None:
    """Draw a curve in a map of a surface, with its band and its points.

    ``flat`` returns positions of points in the map. ``rims`` returns discs of given radii around such positions, shape
    (m, k, 2).
    """
    path, given = flat(curve.points), flat(curve.given)
    if curve.radii is not None:
        discs = disc_indices(curve)
        draw_tube(axes, curve, rims(path[discs], curve.radii[discs]))
    draw_polygon(axes, curve, flat)
    draw_arrows(axes, curve, curve.near_data(path), given)
    draw_line(axes, curve, curve.near_data(path))
    draw_dots(axes, curve, given)


def draw_graph_of(
    axes: Axes, curve: Curve, line: FloatArray, given: FloatArray, unit: FloatArray | None, **dots: Any
) -> None:
    """Draw numbers against time with their band, and those of the given points.

    Radii are multiplied by ``unit``; None means that there is no band. Further arguments are the look of given points.
    """
    if curve.radii is not None and unit is not None:
        fill_band(axes, curve, line - unit * curve.radii, line + unit * curve.radii)
    draw_line(axes, curve, np.column_stack([curve.times, line]))
    draw_dots(axes, curve, np.column_stack([curve.on_axis(curve.given_x), given]), **dots)


def shade_quantiles(axes: Axes, batch: Batch, values: FloatArray) -> list[float]:
    """Fill the area between the 5 % and the 95 % quantile of numbers, one row per curve, and return its limits."""
    if not np.isfinite(values).all():
        # Single curves are drawn instead.
        return []
    low, high = np.quantile(values, [0.05, 0.95], axis=0)
    label = fresh(axes, f"5–95 % of {batch.count} curves")
    axes.fill_between(batch.times, low, high, color=DATA, alpha=0.35, linewidth=0, label=label, zorder=1.5)
    return [float(low.min()), float(high.max())]


def fill_band(axes: Axes, curve: Curve, low: FloatArray, high: FloatArray) -> None:
    """Draw a band against time."""
    look: Look = {"color": curve.color, "alpha": ALPHA, "linewidth": 0, "zorder": 3}
    axes.fill_between(curve.times, low, high, label=fresh(axes, curve.band_name), **look)


def disc_indices(curve: Curve) -> Indices:
    """Return the samples of a curve at which a band has discs."""
    return evenly(len(curve.x), 500)


def draw_tube(axes: Axes, curve: Curve, rings: FloatArray) -> None:
    """Fill discs along a curve, and the areas between neighbouring discs.

    ``rings`` are the rims of the discs, shape (m, k, 2). They are NaN where a disc is missing.
    """
    good: NDArray[np.bool_] = np.all(np.isfinite(rings), axis=(1, 2))
    if not good.any():
        return
    pairs = good[1:] & good[:-1]
    polygons = [_turned_left(rings[good])]
    if pairs.any():
        polygons.append(_between(rings[:-1][pairs], rings[1:][pairs]))
    # All polygons have the same orientation, so that overlapping areas are filled once.
    path = Path.make_compound_path(*map(Path.make_compound_path_from_polys, polygons))
    # ``add_patch`` would compute the extent of every side in a slow loop.
    axes.update_datalim(rings[good].reshape(-1, 2))
    look: Look = {"facecolor": curve.color, "alpha": ALPHA, "linewidth": 0, "zorder": 3}
    axes.add_artist(PathPatch(path, label=curve.band_name, **look))


def _turned_left(rings: FloatArray) -> FloatArray:
    x, y = np.moveaxis(rings - rings.mean(axis=1, keepdims=True), -1, 0)
    area = np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
    return np.where((area < 0)[:, None, None], rings[:, ::-1], rings)


def _between(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the quadrangles that touch two neighbouring discs on both sides."""
    along = second.mean(axis=1) - first.mean(axis=1)
    corners = []
    for rings in (first, second):
        aside = along[:, :1] * rings[..., 1] - along[:, 1:] * rings[..., 0]
        corners += [rings[np.arange(len(rings)), i] for i in (aside.argmin(axis=1), aside.argmax(axis=1))]
    right, left, next_right, next_left = corners
    return np.stack([right, next_right, next_left, left], axis=1)

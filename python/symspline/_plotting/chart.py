"""Curves in R² and R³, paths of rigid motions, and the hyperbolic plane, drawn in the Poincaré disk."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox, TransformedBbox
from mpl_toolkits.mplot3d import Axes3D, proj3d

from .._base.typing import FloatArray, Look
from .._spaces import Hyperbolic
from .curves import Curve, Mover
from .globe import centre_of
from .panels import (
    CIRCLE,
    FRAME,
    SHADOW,
    START,
    Panel,
    View,
    disc_indices,
    draw_dots,
    draw_in_plane,
    draw_line,
    draw_polygon,
    fresh,
)
from .style import (
    AXES,
    Numbers,
    apart,
    axes_size,
    closest,
    halo,
    ink,
    named_from,
    note,
    paper,
    plain,
    round_start,
    scale_of,
    small,
    window,
)

_PLANE = Hyperbolic(2)
_ORIGIN = np.array([1.0, 0.0, 0.0])
_STEMS = 25
"""The largest number of points with lines down to the floor."""
_STEPS = np.multiply.outer(10.0 ** np.arange(-9, 3), [1, 2, 5]).ravel()
_LONG = 2.0
"""Curves are in a view that is wide or narrow if one side is longer than the other by this factor."""
_FILLED, _ZOOM, _AROUND = 0.76, 1.4, (0.4, 0.05)
"""The part of axes that a box fills, if it is enlarged by no more than this factor, and the smallest space around it in
inches, with a part per point of the size of labels."""


# ---- the plane ----


def plane(curves: Sequence[Curve], positions: Numbers = np.asarray, draw: Any = None, **look: Any) -> View:
    """Return the view of curves in the plane with equal scales, with the proportions of the curves."""
    view = View(draw or _draw_plane, has_many=True, **look)
    across, high = np.ptp(np.concatenate([positions(curve.extent) for curve in curves]), axis=0)
    if across > _LONG * high:
        return view._replace(width=10.5, height=float(np.clip(10.5 * high / max(across, 1e-300), 1.2, 4.0)) + 1.2)
    if high > _LONG * across:
        return view._replace(width=float(np.clip(5.2 * across / high, 2.0, 4.0)) + 1.2)
    return view


def _draw_plane(panel: Panel, curves: Sequence[Curve]) -> None:
    """Draw curves in R²."""
    axes, origin = plane_axes(panel, curves, np.asarray)
    rims = lambda p, radii: p[:, None] + radii[:, None, None] * CIRCLE  # noqa: E731
    for curve in curves:
        draw_in_plane(axes, curve, lambda points: np.asarray(points) - origin, rims)


def plane_axes(panel: Panel, curves: Sequence[Curve], positions: Numbers) -> tuple[Axes, FloatArray]:
    """Return axes with equal scales, and the position from which they count, which their labels name."""
    (axes,) = panel.axes
    origin = origin_of(panel, curves, positions)
    for name, subscript, start in zip("xy", "₁₂", origin.tolist(), strict=True):
        if panel.mine or not getattr(axes, f"get_{name}label")():
            getattr(axes, f"set_{name}label")(named_from(f"x{subscript}", start))
    if panel.mine:
        plain(axes)
    axes.set_aspect("equal", adjustable="datalim")
    return axes, origin


def origin_of(panel: Panel, curves: Sequence[Curve], positions: Numbers) -> FloatArray:
    """Return a position from which pictures count: a round number for coordinates that are far from zero.

    In axes of the user it is zero, as others draw into them.
    """
    everything = np.concatenate([positions(curve.extent) for curve in curves])
    if not panel.mine:
        return np.zeros(everything.shape[1])
    return np.array([round_start(*ends) for ends in zip(everything.min(axis=0), everything.max(axis=0), strict=True)])


# ---- space ----


def solid(curves: Sequence[Curve], positions: Numbers = np.asarray, draw: Any = None, **look: Any) -> View:
    """Return the view of curves in R³ in a box with equal scales, which is wide for curves that are long and flat."""
    view = View(draw or _draw_space, 5.8, 5.4, projection="3d", has_many=True, **look)
    extents = np.ptp(np.concatenate([positions(curve.extent) for curve in curves]), axis=0)
    longest, second, _ = np.sort(extents)[::-1]
    return view._replace(width=10.5, height=4.8) if longest > max(extents[2], _LONG * second) else view


def _draw_space(panel: Panel, curves: Sequence[Curve]) -> None:
    """Draw curves in R³, with their shadows on the floor."""
    origin = origin_of(panel, curves, np.asarray)
    place: Numbers = lambda points: np.asarray(points) - origin  # noqa: E731
    control = [place(curve.polygon[0]) for curve in curves if curve.polygon is not None]
    axes = box_around(panel, curves, place, origin, control)
    for curve in curves:
        draw_stems(axes, curve, place(curve.given))
        if curve.radii is not None:
            _draw_hose(axes, curve, place(curve.points), curve.radii)
        draw_polygon(axes, curve, place)
        draw_line(axes, curve, curve.near_data(place(curve.points)))
        draw_dots(axes, curve, place(curve.given))
    if not panel.mine:
        note(axes, f"thin: {SHADOW}")


def box_around(
    panel: Panel, curves: Sequence[Curve], positions: Numbers, origin: FloatArray, more: Sequence[FloatArray] = ()
) -> Any:
    """Draw a box around curves, with their shadows on the floor in the colours of named curves, and in grey."""
    paths = [curve.near_data(positions(curve.points)) for curve in curves]
    shadows = [
        (curve.outside_gaps(path), to_rgba(curve.color, 0.3) if curve.label and not curve.is_mean else ink(0.4))
        for curve, path in zip(curves, paths, strict=True)
        if not curve.faint
    ]
    given = [positions(curve.given) for curve in curves]
    return draw_box(panel, shadows, [*paths, *given, *more], origin)


def draw_stems(axes: Any, curve: Curve, given: FloatArray) -> None:
    """Draw thin lines from a few given points down to the floor, where their shadows are."""
    if curve.alone and curve.noise is None and len(given) <= _STEMS and not curve.is_mean:
        feet = given * [1, 1, 0] + [0, 0, axes.get_zlim()[0]]
        lines = np.stack([given, feet, np.full_like(given, np.nan)], axis=1).reshape(-1, 3)
        axes.plot(*lines.T, color=ink(0.4), linewidth=0.8, linestyle=":", zorder=2, label="_stems")


def _draw_hose(axes: Any, curve: Curve, points: FloatArray, radii: FloatArray) -> None:
    """Draw the surface at given distances from the points of a curve in R³."""
    discs = disc_indices(curve)[::2]
    along = np.gradient(points[discs], axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    aside = np.empty_like(along)
    last = np.eye(3)[np.abs(along[0]).argmin()]
    for i, direction in enumerate(along):
        # The next normal vector is the projection of the last one, so that the frame does not twist.
        last = last - (last @ direction) * direction
        last = aside[i] = last / np.linalg.norm(last)
    frame = np.stack([aside, np.cross(along, aside)], axis=1)
    ring = np.concatenate([CIRCLE, CIRCLE[:1]]) @ frame * radii[discs, None, None]
    x, y, z = np.moveaxis(points[discs, None] + ring, -1, 0)
    look: Look = {"color": curve.color, "alpha": 0.08, "linewidth": 0, "shade": False}
    axes.plot_surface(x, y, z, rstride=1, cstride=2, antialiased=False, **look)


def draw_box(
    panel: Panel, shadows: Sequence[tuple[FloatArray, Any]], others: Sequence[FloatArray], origin: FloatArray
) -> Any:
    """Draw a box with equal scales around points of shape (m, 3), with lines in given colours on its floor.

    Rows that are NaN are ignored. The sides are longer than the extent of all points by a part of the longest one at
    both ends. The labels of the axes name the ``origin`` from which they count.
    """
    axes: Any = panel.axes[0]
    # Markers of both ends are in front of lines. Surfaces hide what is behind them.
    axes.computed_zorder = not shadows
    everything = np.concatenate(others)
    everything = everything[np.isfinite(everything[:, 0])]
    middle, half = window(everything, 1.0)
    half = half or 1.0
    # No side is shorter than a fifth of the longest one.
    sides = np.maximum(np.ptp(everything, axis=0) / 2 + 0.1 * half, 0.2 * half)
    for line, color in shadows:
        look: Look = {"color": color, "linewidth": 1.2, "zorder": 2, "label": fresh(axes, SHADOW)}
        axes.plot(*line.T[:2], np.full(len(line), middle[2] - sides[2]), **look)
    axes.set_facecolor("none")
    axes.tick_params(labelsize="small", pad=0)
    few = scale_of(axes) < 1
    for name, number, side, subscript, start in zip("xyz", middle, sides, "₁₂₃", origin.tolist(), strict=True):
        getattr(axes, f"set_{name}lim")(number - side, number + side)
        wall = getattr(axes, f"{name}axis")
        wall.set_pane_color(ink(0))
        wall.pane.set_edgecolor(ink(0.2))
        wall.line.set_color(ink(0.4))
        wall._axinfo["grid"].update(color=ink(0.2), linewidth=0.6)
        wall.set_major_locator(MaxNLocator(max(1 if few else 3, round((3 if few else 5) * side / sides.max()))))
        if panel.mine or not wall.label.get_text():
            wall.label.set_text(named_from(f"x{subscript}", start))
            # Matplotlib adds 21 points, whatever the size of text is.
            wall.labelpad = 5 * bool(start) + 3.6 * small() - 21
    # Flat boxes are seen from farther above. Choose the direction from which the curve looks widest, and of two similar
    # ones that from which it runs to the right.
    wide = panel.axes[0].bbox.width > 1.5 * panel.axes[0].bbox.height
    turn = 15 if wide else 30
    azimuths = turn - 90, -turn, turn, 90 - turn
    angles = np.radians(azimuths)
    right = everything[:, 1:2] * np.cos(angles) - everything[:, :1] * np.sin(angles)
    first = right[: np.isfinite(shadows[0][0][:, 0]).sum()] if shadows else right
    widths = np.std(right, axis=0) * (1 + 0.3 * np.sign(first[-1] - first[0]))
    elevation = float(np.interp(sides[2] / sides[:2].max(), [0.2, 1], [28 if wide else 46, 24]))
    axes.view_init(elev=elevation, azim=azimuths[widths.argmax()])
    _fill(axes, sides, middle + sides * np.array(list(product((-1, 1), repeat=3))))
    return axes


class Box(Axes3D):  # type: ignore[misc]
    """Axes of a box in space that fills the place which the layout of a page gives to it."""

    shares: FloatArray = np.ones(2)
    """Width and height of the box as parts of the square into which it is projected."""

    def apply_aspect(self, position: Any = None) -> None:
        """Choose the square for the box and the labels around it."""
        place, figure = self.get_position(original=True), self.get_figure().bbox
        size = np.array([place.width * figure.width, place.height * figure.height])
        labels = (_AROUND[0] + _AROUND[1] * self.xaxis.label.get_fontsize()) * self.get_figure(root=True).dpi
        filled = np.maximum(np.minimum(_FILLED * size, size - 2 * labels), 0.2 * size)
        side = float((filled / self.shares).min()) / np.array([figure.width, figure.height])
        middle = np.array([place.x0 + place.x1, place.y0 + place.y1]) / 2
        self._set_position(Bbox.from_bounds(*(middle - side / 2), *side), which="active")

    def get_tightbbox(self, *_: Any, **__: Any) -> Bbox:
        """Return the place of the box, which contains its labels."""
        place = self.get_position(original=True)
        return TransformedBbox(place, self.get_figure().transSubfigure).frozen()


def _fill(axes: Any, sides: FloatArray, corners: FloatArray) -> None:
    """Enlarge a box in its axes, where there is space."""
    axes.set_box_aspect(tuple(sides))
    x, y, _ = proj3d.proj_transform(*corners.T, axes.get_proj())
    flat = axes.transAxes.inverted().transform(axes.transData.transform(np.column_stack([x, y])))
    if isinstance(axes, Box):
        axes.shares = np.ptp(flat, axis=0)
    else:
        axes.set_box_aspect(tuple(sides), zoom=float(np.clip(_FILLED / np.ptp(flat, axis=0).max(), 1.0, _ZOOM)))


def draw_frames(axes: Any, poses: FloatArray, length: float, origin: FloatArray, **look: Any) -> list[Any]:
    """Draw the columns of the rotations of poses of SE(3) as sticks, and return one line per column."""
    feet = positions_of(poses) - origin
    lines = []
    for i, (color, name) in enumerate(zip(AXES, FRAME, strict=True)):
        # All sticks of one colour are one line with breaks.
        sticks = np.stack([feet, feet + length * poses[:, :3, i], np.full_like(feet, np.nan)], axis=1)
        lines += axes.plot(*sticks.reshape(-1, 3).T, color=color, **{"zorder": 5, "label": fresh(axes, name)} | look)
    return lines


def name_axis(axes: Any, at: FloatArray, text: str) -> None:
    """Write the name of an axis beside a position in space."""
    axes.text(*at, text, fontsize="small", path_effects=halo(), zorder=6)


# ---- the hyperbolic plane ----


def _draw_disk(panel: Panel, curves: Sequence[Curve]) -> None:
    """Draw curves in the disk, with two families of geodesics at right angles to the axes.

    Curves far from the middle are moved there, and small ones are enlarged.
    """
    middle, reach = _middle(np.concatenate([curve.extent for curve in curves]))
    half = 1.04 if reach > 1.2 or reach < 1e-7 else 1.4 * np.tanh(reach / 2)
    (axes,) = panel.axes
    axes.set_axis_off()
    axes.set(aspect="equal", xlim=(-half, half), ylim=(-half, half))
    spacing = 0.5 if half > 1 else closest(_STEPS, 0.6 * reach)
    _draw_grid(axes, spacing)
    for curve in curves:
        draw_in_plane(axes, curve, partial(flat, middle=middle), rims)
    text = "part of the " * bool(half < 1) + f"Poincaré disk; grid of geodesics, {spacing:g} apart on the axes"
    if middle is not _ORIGIN:
        text += "\ncentred at the point (" + ", ".join(f"{x:.4g}" for x in middle) + ")"
    note(axes, text)


DISK = View(_draw_disk, has_band=True, has_many=True, is_turned=True)


def flat(points: FloatArray, middle: FloatArray) -> FloatArray:
    """Return the positions of points in the disk with a given middle, shape (..., 2)."""
    moved = _PLANE.transvection(middle, _PLANE.log(middle, _ORIGIN), points)
    return np.asarray(moved[..., 1:] / (1 + moved[..., :1]))


def rims(positions: FloatArray, radii: FloatArray) -> FloatArray:
    """Return the rims of hyperbolic discs around positions in the disk, shape (m, k, 2).

    They are circles around the middle, moved by Möbius transformations.
    """
    middle = (positions @ [1, 1j])[:, None]
    around = np.tanh(radii / 2)[:, None] * (CIRCLE @ [1, 1j])
    moved = (around + middle) / (1 + middle.conj() * around)
    return np.stack([moved.real, moved.imag], axis=-1)


def _middle(points: FloatArray) -> tuple[FloatArray, float]:
    """Return the middle of the disk, and its distance to the farthest point.

    The middle is the centre of the smallest circle around the points, unless they lie around (1, 0, 0).
    """
    points = points[:: 1 + len(points) // 2000]
    middle = centre_of(_PLANE, points)
    around_origin, around_middle = (float(_PLANE.distance(centre, points).max()) for centre in (_ORIGIN, middle))
    return (middle, around_middle) if around_middle < 0.8 * around_origin else (_ORIGIN, around_origin)


def _draw_grid(axes: Axes, spacing: float) -> None:
    """Draw the disk, and geodesics at right angles to either axis, ten on each side of the other axis."""
    axes.add_patch(Circle((0, 0), 1, facecolor=paper(0.06), edgecolor=ink(0.4), linewidth=1, zorder=0))
    along = 14 * np.linspace(-1, 1, 301) ** 3
    for number in range(-10, 11):
        aside = np.cosh(along) * np.sinh(number * spacing)
        line = np.column_stack([np.cosh(along) * np.cosh(number * spacing), aside, np.sinh(along)])
        upright = flat(line, _ORIGIN)
        look: Look = {"color": ink(0.2), "linewidth": 0.6 if number else 0.9, "zorder": 1}
        axes.plot(*upright.T, **look)
        axes.plot(*upright[:, ::-1].T, **look)


# ---- rigid motions: the path of a body, and its orientation along the path ----

_BODY: FloatArray = np.array([[1.0, 0.0], [-0.7, 0.55], [-0.35, 0.0], [-0.7, -0.55]])
"""A body in the plane that points along its first axis."""
_LENGTH = 0.14
"""Distance in inches from the position of a body in the plane to its tip."""
_MANY = 24
"""The number of bodies of all curves, or two per curve if that is more."""
_FRAMES = 16
"""The largest number of frames in space, of all curves together."""
_FAN = np.radians(30)
"""Bodies that turn on the spot are drawn at angles of this size."""


def positions_of(poses: FloatArray) -> FloatArray:
    """Return the positions of poses of SE(n)."""
    return poses[..., :-1, -1]


def draw_bodies(panel: Panel, curves: Sequence[Curve]) -> None:
    """Draw poses of SE(2) as bodies.

    Given poses are filled bodies if they are far enough from each other, the first one hollow; light bodies are along
    the curve. Otherwise they are dots, and some of them light bodies.
    """
    axes, origin = plane_axes(panel, curves, positions_of)
    positions = np.concatenate([positions_of(curve.extent) for curve in curves])
    unit = float(np.max(np.ptp(positions, axis=0) / axes_size(axes))) or 1.0
    framed = [curve for curve in curves if not curve.faint]
    light = paper(0.2)

    def draw(poses: FloatArray, label: str, **look: Any) -> None:
        if len(poses):
            feet = positions_of(poses) - origin
            bodies = length * _BODY @ poses[:, :2, :2].swapaxes(1, 2) + feet[:, None]
            axes.add_collection(PolyCollection(list(bodies), zorder=6.6, label=fresh(axes, label), **look))
            # Where the body is.
            color = ink(0) if look["facecolor"] == ink() else ink()
            axes.plot(*feet.T, "o", color=color, markersize=1.8, zorder=6.7, label="_feet")

    for curve in curves:
        length = _LENGTH * scale_of(axes) * unit * (1 if curve.alone else 0.6)
        given, edge = curve.given, ink() if curve.alone and curve.has_line else curve.color
        path = positions_of(curve.points) - origin
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
            draw_dots(axes, dots, positions_of(given) - origin, markersize=small)
        way = float(np.sum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
        spread = _apart if way > length else _turned_apart
        dense = curve.noise is None and has_nodes and not has_bodies
        some = spread(given if dense else curve.points[~curve.bridges], max(4 * length, way * len(framed) / _MANY))
        if has_bodies:
            free = np.linalg.norm(positions_of(some)[:, None] - positions_of(given), axis=-1) > 2 * length
            some = some[free.all(axis=1)]
        first, look = int(dense), {"edgecolor": curve.color, "linewidth": 0.8}
        draw(some[:first], START, facecolor=ink(0), **look)
        draw(some[first:], "some of the poses" if dense else "poses of the curve", facecolor=light, **look)
    axes.autoscale_view()


def _apart(poses: FloatArray, least: float) -> FloatArray:
    """Return poses, the first among them, whose distances along the path are ``least`` or more."""
    steps = np.linalg.norm(np.diff(positions_of(poses), axis=0, prepend=positions_of(poses[:1])), axis=1)
    return np.asarray(poses[apart(np.cumsum(steps), least)])


def _turned_apart(poses: FloatArray, _: float) -> FloatArray:
    """Return poses of a body that turns on the spot, the first among them, which differ by some angle."""
    angles = np.unwrap(np.arctan2(poses[:, 1, 0], poses[:, 0, 0]))
    return np.asarray(poses[apart(np.cumsum(np.abs(np.diff(angles, prepend=angles[:1]))), _FAN)])


def draw_on_path(panel: Panel, curves: Sequence[Curve]) -> None:
    """Draw poses of SE(3) as frames on the path. Given ones are bold."""
    origin = origin_of(panel, curves, positions_of)
    place: Numbers = lambda poses: positions_of(poses) - origin  # noqa: E731
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


def _words(first: Curve, groups: Sequence[Look], framed: Sequence[Curve]) -> str:
    """Describe which poses have frames."""
    if first.is_mean:
        return "mean curve at times of points"
    if first.noise is not None:
        return "some poses of the curve" + ", lighter: data" * bool(len(first.noise.x[0]))
    if not first.has_nodes:
        return "some poses of the curve"
    shown, count = sum(len(entry.get("bold", ())) for entry in groups), sum(len(entry.given) for entry in framed)
    return "given poses" if shown == count else f"{shown} of {count} given poses"

"""Matrices as symbols along a time axis or a path.

Rotations are frames, as in Fig. 5 of Bogfjellmo, Modin and Verdier (2018), and so are rigid motions. Positive definite
matrices are ellipses and ellipsoids. Their semi-axes are parallel to the eigenvectors and as long as the square roots
of the eigenvalues: one standard deviation, if the matrices are covariances.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba, to_rgba_array
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from .._base.quaternions import matrices_of_quaternions
from .._core import CutLocusError, convert_rotations
from .._spaces import SpecialOrthogonal, cover_of
from .chart import SHADOW, box, count_from, draw_stems, explain_frames, frame_handles, origin_of, plane, shadow_colors
from .curves import BODIES, BODY, BODY_COLOR, FAINT, KNOTS, POSES, START, Curve, are_compared
from .globe import centre_of
from .graphs import FEW_KNOTS, SUBSCRIPTS, component_names, draw_components, draw_coordinates, draw_numbers, timelines
from .rates import QUATERNIONS
from .rows import REACH, VIEW, Rows
from .sphere import caps
from .style import (
    AXES,
    EDGE,
    INK,
    LEFT,
    OWN_AXES,
    RIGHT,
    Array,
    apart,
    axes_size,
    evenly,
    legend,
    note,
    points,
    round_below,
    size,
    time_colors,
    window,
)
from .theme import KEPT

ROTATIONS = SpecialOrthogonal(3)
_LENGTH = 0.14
"""Distance in inches from the position of a body in the plane to its tip."""
_MANY = 24
"""The number of bodies of all curves, or two per curve if that is more."""
_FRAMES = 16
"""The largest number of frames in space, of all curves together."""
_LEAST, _SHORT = 12.0, 0.32
"""Arrows are shorter than the time axis by a factor, and the smallest length in inches if there are many."""
_BESIDE = 20
"""The largest number of curves of a batch that are drawn beside their mean."""
_PAIRS = 15
"""The largest number of correlations that have names."""
_FAN = np.radians(30)
"""Bodies that turn on the spot are drawn at angles of this size."""
_SMALL = np.radians(12)
"""Rotations by less than this are graphs."""
_LARGE = np.radians(150)
"""Rotations by less than this from the first or the middle one are graphs if there are gaps, noise or other factors."""
_JUMP = np.radians(170)
"""Rotation vectors are drawn up to this length."""
_ANGLES = np.linspace(0, 2 * np.pi, 97)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), 0 * _ANGLES], axis=-1)


# ---- rotations ----


def draw_rotations(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw the columns of rotation matrices as arrows along a time axis, or graphs of their rotation vectors.

    Discs at the tips contain the true direction of an axis with the probability of the band.
    """
    reference = _reference(curves)
    if reference is not None:
        _draw_rotation_vectors(panel, [part for curve in curves for part in curve.unbroken], *reference)
        return
    matrices = MATRICES[str(cover_of(curves[0].space))]
    rows = Rows.of(panel, curves)
    length = min(max(_SHORT, min(REACH, 1.2 * rows.reach_between())), 0.48 * rows.height, rows.width / _LEAST)
    words = _left_out(rows, curves)
    for i, row in enumerate(rows.rows):
        times, symbols, radii = rows.symbols(i, 0.8 * length)
        frames = matrices(symbols)
        if radii is not None:
            _draw_discs(rows, i, times, length, frames, radii)
            words = "discs: 95 % bands"
        light = np.full(len(times), row.name == "data")
        if row.name == "curve" and row.curve.noise is None and row.curve.has_nodes:
            # Those between the given points are lighter.
            light = ~np.isin(times, row.curve.times[row.curve.knots])
        frames = frames * np.where(light, 0.75, 1.0)[:, None, None]
        _draw_arrows(rows.axes, times, -i, length * frames, np.where(light, 0.5, 1.0))
    if rows.axes not in OWN_AXES:
        if not words and rows.rows[-1].name == "curve" and curves[0].has_nodes:
            words = "lighter: between given ones"
        if str(cover_of(curves[0].space)) in QUATERNIONS:
            words = "; ".join(filter(None, ("frames: rotations by unit quaternions", words)))
    _explain(rows.axes, words, rows.width)
    rows.draw_view()


def are_graphs(curves: Sequence[Curve]) -> bool:
    """Whether curves are drawn as graphs of rotation vectors."""
    return _reference(curves) is not None


def _reference(curves: Sequence[Curve]) -> tuple[Array, str] | None:
    """Return the rotation from which rotation vectors are measured, and its name. None if there are frames.

    Frames would look equal, would not show long gaps or noisy data, or have no space beside other factors of a product
    and other curves.
    """
    matrices = MATRICES.get(str(cover_of(curves[0].space)))
    if matrices is None:
        return None
    first = matrices(curves[0].first_point)
    # Points of O(3) have one determinant along a curve.
    turned = np.concatenate([first.T @ matrices(curve.extent) for curve in curves])
    largest = ROTATIONS.distance(np.eye(3), turned).max()
    if largest < _SMALL:
        return first, "start of the curve"
    if not (are_compared(curves) or any(own.is_factor or len(own.gaps) or own.noise is not None for own in curves)):
        return None
    if largest < _LARGE:
        return first, "start of the curve"
    try:
        middle = centre_of(ROTATIONS, turned[:: 1 + len(turned) // 2000])
    except CutLocusError:
        return None
    return (first @ middle, "middle rotation") if ROTATIONS.distance(middle, turned).max() < _LARGE else None


def _draw_rotation_vectors(panel: SubFigure, curves: Sequence[Curve], first: Array, name: str) -> None:
    """Draw the graphs of the rotation vectors of rotations from a given one."""
    matrices = MATRICES[str(cover_of(curves[0].space))]

    def numbers(points: Any) -> Array:
        vectors = _rotation_vectors(matrices(points), first)
        # In long gaps the vector may jump where the angle reaches half a turn.
        return np.where(np.linalg.norm(vectors, axis=1, keepdims=True) < _JUMP, vectors, np.nan)

    def growth(angles: Array) -> Array:
        # The largest singular value of the inverse of the left Jacobian.
        return np.asarray(1 / np.sinc(angles / 2 / np.pi))

    names = ["about x₁", "about x₂", "about x₃"]
    name = name.replace("curve", "mean curve") if curves[0].is_mean else name
    title = f"rotation vector log(R R₀ᵀ) in rad, R₀: {name}"
    draw_coordinates(panel, curves, names, numbers, growth, title, equal_scales=True)


def _rotation_vectors(matrices: Array, first: Array) -> Array:
    """Return the rotation vectors of rotations from a first matrix, shape (m, 3)."""
    return convert_rotations(np.ascontiguousarray(matrices @ first.T), "matrix", "vector", 1e-7)[0]


def _left_out(rows: Rows, curves: Sequence[Curve]) -> str:
    """Describe how many curves of a batch have a row, if not all have."""
    return (
        f"{len(rows.rows)} of {len(curves)} curves" if rows.rows[0].name == "" and len(rows.rows) < len(curves) else ""
    )


def quaternions(matrices: NDArray[Any]) -> Array:
    """Return the unit quaternions w, x, y, z of matrices w − i(xσ₁ + yσ₂ + zσ₃) of SU(2), shape (..., 4)."""
    a, b = matrices[..., 0, 0], matrices[..., 1, 0]
    return np.stack([a.real, -b.imag, b.real, -a.imag], axis=-1)


# Points of S³ are unit quaternions, scalar first. Those of SU(2) act on R³ as rotations.
MATRICES: dict[str, Callable[[Any], Array]] = {
    "sphere:3": matrices_of_quaternions,
    "so:3": np.asarray,
    "o:3": np.asarray,
    "su:2": lambda matrices: matrices_of_quaternions(quaternions(matrices)),
}
"""Matrices of rotations, shape (..., 3, 3)."""


def _draw_arrows(axes: Axes, times: Array, row: int, frames: Array, opacity: Array) -> None:
    """Draw the columns of matrices, shape (m, 3, 3), in inches. Nearer columns cover farther ones."""
    seen = VIEW @ frames
    order = np.argsort(seen[:, 2], axis=-1)
    right, up, _ = np.moveaxis(np.take_along_axis(seen, order[:, None], axis=-1), 1, 0)
    # Layouts would add the length of the arrows in data to their extent.
    look: Any = {"units": "inches", "scale_units": "inches", "scale": 1, "clip_on": False, "in_layout": False}
    look |= {"headwidth": 3.5, "headlength": 4.5, "headaxislength": 4.2, "zorder": 4}
    look["width"] = 0.028 if opacity.max() == 1 else 0.018
    colors = to_rgba_array(np.array(AXES)[order.ravel()])
    colors[:, 3] = np.repeat(opacity, 3)
    positions = np.repeat(times, 3), np.full(3 * len(times), row)
    axes.quiver(*positions, right.ravel(), up.ravel(), color=colors, **look)


def _draw_discs(rows: Rows, row: int, times: Array, length: float, frames: Array, radii: Array) -> None:
    """Draw the caps of angular radii ``radii`` around the columns of rotation matrices, shape (m, 3, 3).

    The rotations by angles up to r move a unit vector to all points of the cap of radius r around it.
    """
    for i, color in enumerate(AXES):
        rings = length * caps(frames[:, :, i], radii) @ VIEW[:2].T
        look: Any = {"facecolors": [to_rgba(color, 0.3)], "linewidths": 0, "label": "band", "zorder": 5}
        rows.axes.add_collection(PolyCollection(list(rings), **look, **rows.in_inches(times, row)))


def _explain(axes: Axes, more: str, width: float) -> None:
    """Draw a legend of the colours above axes of a given width in inches, with further words."""
    handles, labels = frame_handles()
    if axes in OWN_AXES:
        # For legends that the user adds.
        for handle, label in zip(handles, labels, strict=True):
            axes.plot([], [], color=handle.get_color(), linewidth=handle.get_linewidth(), label=label)
    if more:
        handles.append(Line2D([], [], linestyle="none"))
        labels.append(more)
    anchor: Any = {"loc": "lower left", "bbox_to_anchor": (0, 1), "borderaxespad": 0.2}
    legend(axes, handles, labels, width, handlelength=1.2, columnspacing=1.2, **anchor)


# ---- rigid motions: the path of a body, and its orientation ----


def draw_flat_poses(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw poses of SE(2) as bodies that point along their first axis.

    Given poses are filled bodies if they are far enough from each other, the first one white; light bodies are along
    the curve. Otherwise they are dots, and some of them light bodies.
    """
    axes = plane(panel)
    origin = count_from(panel, axes, curves, lambda poses: poses[:, :2, 2])
    positions = np.concatenate([curve.extent[:, :2, 2] for curve in curves])
    unit = float(np.max(np.ptp(positions, axis=0) / axes_size(axes))) or 1.0
    framed = [curve for curve in curves if not curve.faint]

    def draw(poses: Array, label: str, **look: Any) -> None:
        if len(poses):
            turned = length * BODY[:-1] @ poses[:, :2, :2].swapaxes(1, 2)
            feet = poses[:, :2, 2] - origin
            bodies = list(turned + feet[:, None])
            axes.add_collection(PolyCollection(bodies, zorder=6.6, label=label, **look))
            # Where the body is.
            dot = INK if look["facecolor"] != INK else "white"
            axes.plot(*feet.T, "o", color=dot, markersize=1.8, zorder=6.7, label="_feet")

    for curve in curves:
        length = _LENGTH * unit * (1 if curve.alone else 0.6)
        given, edge = curve.given, INK if curve.alone and curve.has_line else curve.color
        path = curve.points[:, :2, 2] - origin
        curve.draw_line(axes, curve.near_data(path), linewidth=1.6)
        if curve.faint:
            continue
        has_nodes = curve.has_nodes and not curve.is_mean
        has_bodies = curve.noise is None and has_nodes and len(_apart(given, 2 * length)) == len(given)
        if has_bodies:
            draw(given[1:], POSES, facecolor=edge, edgecolor=edge)
            draw(given[:1], START, facecolor="white", edgecolor=edge)
        elif not curve.is_mean:
            small = float(np.clip(22 / np.sqrt(max(len(given), 1)), 1.5, 4.0))
            # The first of the given poses is a body.
            dots = replace(curve, has_start=not curve.has_nodes)
            dots.draw_dots(axes, given[:, :2, 2] - origin, markersize=small)
        way = float(np.sum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
        spread = _apart if way > length else _turned_apart
        dense = curve.noise is None and has_nodes and not has_bodies
        some = spread(given if dense else curve.points[~curve.bridges], max(4 * length, way * len(framed) / _MANY))
        if has_bodies:
            free = np.linalg.norm(some[:, None, :2, 2] - given[:, :2, 2], axis=-1) > 2 * length
            some = some[free.all(axis=1)]
        first = int(dense)
        draw(some[:first], START, facecolor="white", edgecolor=curve.color, linewidth=0.8)
        draw(some[first:], BODIES, facecolor=BODY_COLOR, edgecolor=curve.color, linewidth=0.8)
    axes.autoscale_view()


def _apart(poses: Array, least: float) -> Array:
    """Return poses, the first among them, whose distances along the path are ``least`` or more."""
    steps = np.linalg.norm(np.diff(poses[:, :2, 2], axis=0, prepend=poses[:1, :2, 2]), axis=1)
    return np.asarray(poses[apart(np.cumsum(steps), least)])


def _turned_apart(poses: Array, _: float) -> Array:
    """Return poses of a body that turns on the spot, the first among them, which differ by some angle."""
    angles = np.unwrap(np.arctan2(poses[:, 1, 0], poses[:, 0, 0]))
    return np.asarray(poses[apart(np.cumsum(np.abs(np.diff(angles, prepend=angles[:1]))), _FAN)])


def draw_poses(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw poses of SE(3) as frames on the path. Given ones are bold."""
    origin = origin_of(panel, curves, lambda poses: poses[:, :3, 3])
    paths = [curve.near_data(curve.points[:, :3, 3] - origin) for curve in curves]
    given = [curve.given[:, :3, 3] - origin for curve in curves]
    everything = np.concatenate([*paths, *given])
    length = 0.14 * window(everything[np.isfinite(everything[:, 0])], 1.0)[1] or 0.2
    framed = [curve for curve in curves if not curve.faint]
    number = max(2, _FRAMES // len(framed))
    # The box contains the tips of all frames that are drawn.
    tips = [
        (poses[:, :3, 3] - origin + length * poses[:, :3, i])
        for curve in framed
        for poses in curve.samples(number).values()
        for i in range(3)
    ]
    shadows = [curve.outside_gaps(path) for curve, path in zip(curves, paths, strict=True) if not curve.faint]
    axes = box(panel, shadows, paths + given + tips, 0.02, 0.45, shadow_colors(curves), origin)

    def draw(poses: Array, length: float, **look: Any) -> None:
        feet = poses[:, :3, 3] - origin
        for i, color in enumerate(AXES):
            # All sticks of one colour are one line with breaks.
            sticks = np.stack([feet, feet + length * poses[:, :3, i], np.full_like(feet, np.nan)], axis=1)
            axes.plot(*sticks.reshape(-1, 3).T, color=color, zorder=5, **look)

    for curve, path in zip(curves, paths, strict=True):
        # The usual colour is that of the third axis.
        dark = {"color": INK} if curve.color_of_dots == INK and not len(curve.gaps) else {}
        curve.draw_line(axes, path, linewidth=2.0 if curve.alone else 1.4, **dark)
        if curve.faint:
            continue
        draw_stems(axes, curve, curve.given[:, :3, 3] - origin)
        for group, poses in curve.samples(number).items():
            if group == "data":
                draw(poses, 0.7 * length, linewidth=1.2, alpha=0.7)
                continue
            draw(poses, length, linewidth=2.0 if curve.alone else 1.3)
            if curve.noise is None:
                curve.draw_dots(axes, poses[:, :3, 3] - origin, markersize=3.5 if curve.alone else 2)
            else:
                curve.draw_dots(axes, curve.given[:, :3, 3] - origin)
    shown = sum(len(curve.samples(number).get("bold", ())) for curve in framed)
    count = sum(len(curve.given) for curve in framed)
    name = "given poses" if shown == count else f"{shown} of {count} given poses"
    words = curves[0].legend_of(name, "some poses of the curve", "lighter: data")
    words = "mean curve at times of points" if curves[0].is_mean else words
    explain_frames(panel, axes)
    note(panel, f"frames: {words}; {SHADOW}")


# ---- positive definite matrices ----


def draw_covariances(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw the standard deviations and correlations of covariance matrices; components of several curves."""
    if not isinstance(panel, SubFigure) or are_compared(curves):
        draw_components(panel, curves)
        return
    n = curves[0].space.point_shape[0]
    rows, columns = np.triu_indices(n, 1)

    def deviations(_: Any, points: Array) -> Array:
        return np.sqrt(np.diagonal(points, axis1=1, axis2=2))

    names = [f"σ{i + 1}".translate(SUBSCRIPTS) for i in range(n)]
    entries = np.reshape(component_names((n, n), False), (n, n))
    pairs = [f"ρ{entry[1:]}" for entry in entries[rows, columns].tolist()]
    panels: Any = panel.subfigures(2, 1, height_ratios=[1.2, 1])
    draw_numbers(panels[0], curves, "standard\ndeviations", names, deviations)
    panels[0].axes[0].set_xlabel("")
    (axes,) = timelines(panels[1], curves, ["correlations"], marked=False)
    axes.grid(visible=False)
    axes.set_ylim(len(pairs), 0)
    every = -(-len(pairs) // _PAIRS)
    axes.set_yticks(np.arange(len(pairs))[::every] + 0.5, pairs[::every])
    axes.tick_params(axis="y", length=0)
    for curve in curves:
        roots = deviations(None, curve.points)
        shares = curve.outside_gaps(curve.points[:, rows, columns] / (roots[:, rows] * roots[:, columns]))
        look: Any = {"cmap": "RdBu_r", "vmin": -1, "vmax": 1, "shading": "gouraud", "rasterized": True}
        # One row of pixels per pair needs two equal rows of samples.
        for k, share in enumerate(shares.T):
            image = axes.pcolormesh(curve.times, [k + 0.03, k + 0.97], np.stack([share, share]), **look)
            image.set_gid(KEPT)
        if len(curve.marks) <= FEW_KNOTS:
            axes.vlines(curve.marks, 0, len(pairs), color=EDGE, linewidth=0.8, linestyle=(0, (1, 2)), label=KNOTS)
    width, _ = size(panels[1])
    side = axes.inset_axes((1 + 0.12 / (width - LEFT - RIGHT), 0, 0.1 / (width - LEFT - RIGHT), 1))
    bar = panel.get_figure(root=True).colorbar(image, cax=side, ticks=[-1, 0, 1])
    bar.ax.tick_params(labelsize=points(8), length=0, labelcolor=INK)
    bar.outline.set_visible(False)


def outlines(matrices: Array) -> Array:
    """Return the ellipses of matrices or the outlines of ellipsoids, shape (m, 97, 2)."""
    roots, axes = _half_axes(matrices[:, :2, :2])
    return np.asarray(_CIRCLE[:, :2] * roots[:, None] @ axes)


def sections(matrices: Array) -> Array:
    """Return the near halves of the sections through two semi-axes, shape (m, 3, 97, 2); the far halves are NaN."""
    roots, axes = (array[:, None] for array in _half_axes(matrices))
    rings = np.stack([np.roll(_CIRCLE[:, [1, 0, 2]], i + 1, axis=1) for i in range(3)])
    normals = rings / roots[..., None, :] @ axes
    return np.asarray(np.where(normals[..., 2:] > 0, (rings * roots[..., None, :] @ axes)[..., :2], np.nan))


def _half_axes(matrices: Array) -> tuple[Array, Array]:
    """Return the square roots of the eigenvalues, and the eigenvectors in rows."""
    values, vectors = np.linalg.eigh(matrices)
    # Rounding can make an eigenvalue 0 or negative.
    return np.sqrt(np.maximum(values, 1e-16 * values[:, -1:])), vectors.swapaxes(1, 2)


def _draw_in_rows(view: Array, panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw rows of ellipses along the time axis, coloured by time and on the same scale. Given ones are filled.

    The rows of ``view`` are the directions to the right, up and, for ellipsoids, towards the viewer.
    """
    rows = Rows.of(panel, curves)
    # The largest horizontal and vertical half widths of the ellipses.
    across, high = (
        np.sqrt(max(float((view[i] @ row.curve.extent @ view[i]).max()) for row in rows.rows)) for i in (0, 1)
    )
    inches = min(max(0.65 * REACH, min(REACH, rows.reach_between())) / across, 0.45 * rows.height / high)
    arcs = "; arcs: front halves of principal sections" * (len(view) == 3)
    words = [f"half axes: √eigenvalues{arcs}" + "; colour: time" * (not curves[0].is_mean), _left_out(rows, curves)]
    for i in range(len(rows.rows)):
        times, symbols, radii = rows.symbols(i, 1.05 * inches * across)
        _draw_row(rows, i, inches, times, view @ symbols @ view.T, radii)
        if radii is not None:
            words[1] = "shaded: 95 % bands"
        curve = rows.rows[i].curve
        if curve.is_mean and curve.batch is not None:
            samples = np.searchsorted(curve.batch.times, times).clip(max=len(curve.batch.x) - 1)
            others = curve.batch.at("point")[:, samples]
            for one in others[evenly(len(others), _BESIDE)]:
                rings = inches * outlines(view @ one @ view.T)
                look: Any = {"facecolors": "none", "edgecolors": to_rgba(INK, 0.25), "linewidths": 0.6}
                look |= {"label": FAINT, "zorder": 3.5}
                rows.axes.add_collection(PolyCollection(list(rings), **look, **rows.in_inches(times, i)))
    # The scale to the right of the words is an inch wide, and the view as well.
    has_view = len(view) == 3
    text = fill("; ".join(filter(None, words)), max(14, int((rows.width - 1 - has_view) / 0.075)))
    rows.axes.text(0, 1.02, text, transform=rows.axes.transAxes, color=INK, fontsize=points(9), va="bottom")
    _draw_scale(rows, inches, 1.0 * has_view)
    if has_view:
        rows.draw_view()


draw_ellipses = partial(_draw_in_rows, np.eye(2))
draw_ellipsoids = partial(_draw_in_rows, VIEW)


def _draw_scale(rows: Rows, inches: float, right: float) -> None:
    """Draw a bar above the axes whose length is 1, 2 or 5 times a power of ten, ``right`` inches from the corner."""
    length = round_below(0.8 / inches)
    # The whole width of the axes, also if symbols have a margin in them.
    width, _ = axes_size(rows.axes)
    end, height = 1 - right / width, 1 + 0.14 / (rows.height * len(rows.rows))
    ends = [end - length * inches / width, end]
    look: dict[str, Any] = {"transform": rows.axes.transAxes, "color": INK, "clip_on": False}
    rows.axes.plot(ends, [height, height], "|-", linewidth=1.2, markersize=5, **look)
    start = ends[0] - 0.05 / width
    rows.axes.text(start, height, f"{length:g}", fontsize=points(9), ha="right", va="center_baseline", **look)


def _draw_row(rows: Rows, row: int, inches: float, times: Array, matrices: Array, radii: Array | None) -> None:
    """Draw ellipses in a row, coloured by time; those of noisy data have one colour.

    ``inches`` is the length of 1 on paper, as the time axis has another scale. Bands are shaded. The matrices at
    distances up to r from P in the affine-invariant metric have ellipses between those of exp(−r)P and exp(r)P, and
    touch both.
    """
    axes, name = rows.axes, rows.rows[row].name
    first, last = (edge([float(own.curve.times[i]) for own in rows.rows]) for edge, i in ((min, 0), (max, -1)))
    colors = time_colors((times - first) / (last - first))
    if name == "data" or rows.rows[row].curve.is_mean:
        colors[:] = to_rgba(INK if name == "data" else rows.rows[row].curve.color)
    rings, look = inches * outlines(matrices), rows.in_inches(times, row)
    if radii is not None:
        scales = np.exp(radii / 2)[:, None, None]
        shaded = np.concatenate([scales * rings, (rings / scales)[:, ::-1]], axis=1)
        faces = colors * [1, 1, 1, 0.3]
        axes.add_collection(PolyCollection(list(shaded), facecolors=faces, linewidths=0, label="band", **look))
    look |= {"edgecolors": colors, "linewidths": {"given": 1.6, "data": 0.8}.get(name, 1.2), "zorder": 4}
    filled = colors * [1, 1, 1, {"given": 0.45, "": 0.25}.get(name, 0.0)]
    axes.add_collection(PolyCollection(list(rings), facecolors=filled, **look))
    if matrices.shape[1] == 3:
        look["linewidths"] = 0.6 * look["linewidths"]
        for lines in inches * sections(matrices).swapaxes(0, 1):
            axes.add_collection(LineCollection(list(lines), **look))

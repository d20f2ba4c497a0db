"""Curves in R² and R³, and in the hyperbolic plane, drawn in the Poincaré disk."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import proj3d

from .._spaces import Hyperbolic
from .arrows import draw_arrows
from .bands import disc_indices, draw_in_plane
from .curves import CIRCLE, Curve
from .globe import centre_of
from .style import (
    AXES,
    EDGE,
    GRID,
    INK,
    LEFT,
    OWN_AXES,
    PAPER,
    RIGHT,
    Array,
    closest,
    inside,
    legend,
    named_from,
    note,
    plain,
    points,
    round_start,
    size,
    text_factor,
    window,
)

_PLANE = Hyperbolic(2)
_ZERO: Array = np.zeros(3)
_ORIGIN = np.array([1.0, 0.0, 0.0])
SHADOW = "thin: shadow on the floor"
_BESIDE, _UNDER, _ABOVE = 0.66, 0.3, 0.1
"""Margins of a box in inches, which have the labels of its axes."""
_STEMS = 25
"""The largest number of points with lines down to the floor."""
_STEPS = np.multiply.outer(10.0 ** np.arange(-9, 3), [1, 2, 5]).ravel()


def draw_plane(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw curves in R² with equal scales."""
    axes = plane(panel)
    origin = count_from(panel, axes, curves, np.asarray)
    for curve in curves:
        draw_arrows(axes, curve, curve.near_data(curve.points - origin), curve.given - origin)
        rims = lambda p, radii: p[:, None] + radii[:, None, None] * CIRCLE  # noqa: E731
        draw_in_plane(axes, curve, lambda points: np.asarray(points) - origin, rims)


def draw_3d(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw curves in R³ in a box with equal scales, with their shadows on the floor."""
    origin = origin_of(panel, curves, np.asarray)
    paths = [curve.near_data(curve.points - origin) for curve in curves]
    shadows = [curve.outside_gaps(path) for curve, path in zip(curves, paths, strict=True) if not curve.faint]
    given = [curve.given - origin for curve in curves]
    control = [curve.polygon[0] - origin for curve in curves if curve.polygon is not None]
    axes = box(panel, shadows, paths + given + control, colors=shadow_colors(curves), origin=origin)
    for curve, path, own in zip(curves, paths, given, strict=True):
        draw_stems(axes, curve, own)
        if curve.radii is not None:
            _draw_hose(axes, curve, curve.points - origin, curve.radii)
        curve.draw_polygon(axes, lambda points: points - origin)
        curve.draw_line(axes, path)
        curve.draw_dots(axes, own)
    note(panel, SHADOW)


def draw_stems(axes: Any, curve: Curve, given: Array) -> None:
    """Draw thin lines from a few given points down to the floor, where their shadows are."""
    if curve.alone and curve.noise is None and len(given) <= _STEMS and not curve.is_mean:
        feet = given * [1, 1, 0] + [0, 0, axes.get_zlim()[0]]
        lines = np.stack([given, feet, np.full_like(given, np.nan)], axis=1).reshape(-1, 3)
        axes.plot(*lines.T, color=EDGE, linewidth=0.8, linestyle=":", zorder=2, label="_stems")


def origin_of(panel: Any, curves: Sequence[Curve], positions: Callable[[Any], Array]) -> Array:
    """Return a position from which pictures count: a round number for coordinates that are far from zero.

    In axes of the user it is zero, as others draw into them.
    """
    everything = np.concatenate([positions(own.extent) for own in curves])
    if not isinstance(panel, SubFigure):
        return np.zeros(everything.shape[1])
    return np.array([round_start(*ends) for ends in zip(everything.min(axis=0), everything.max(axis=0), strict=True)])


def count_from(panel: Any, axes: Axes, curves: Sequence[Curve], positions: Callable[[Any], Array]) -> Array:
    """Return the position from which the axes of a plane count, which their labels name."""
    origin = origin_of(panel, curves, positions)
    for name, start in zip("xy", origin.tolist(), strict=True):
        if start:
            getattr(axes, f"set_{name}label")(named_from(f"x{'₁' if name == 'x' else '₂'}", start))
    return origin


def shadow_colors(curves: Sequence[Curve]) -> list[Any]:
    """Return the colours of shadows: those of named curves, and grey of others."""
    return [to_rgba(curve.color, 0.3) if curve.label else EDGE for curve in curves if not curve.faint]


def _draw_hose(axes: Any, curve: Curve, points: Array, radii: Array) -> None:
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
    look: Any = {"color": curve.color, "alpha": 0.08, "linewidth": 0, "shade": False}
    axes.plot_surface(x, y, z, rstride=1, cstride=2, antialiased=False, **look)


def plane(panel: SubFigure) -> Axes:
    """Add axes with equal scales."""
    width, height = size(panel)
    # The edges of wide axes are those of the rates below.
    left, right = (LEFT, RIGHT) if width > 1.5 * height else (0.8, 0.25)
    axes = panel.add_axes(inside(panel, left, 0.55, right, 0.2), xlabel="x₁", ylabel="x₂")
    plain(axes)
    axes.set_aspect("equal", adjustable="datalim")
    return axes


def box(
    panel: SubFigure,
    lines: Sequence[Array],
    others: Sequence[Array],
    margin: float = 0.05,
    below: float = 0.3,
    colors: Sequence[Any] = (),
    origin: Array = _ZERO,
) -> Any:
    """Add a box with equal scales around lines of shape (m, 3), with their shadows in given colours on the floor.

    The box contains the points ``others``, too. Rows that are NaN are ignored. Its sides are longer than the extent of
    all points by ``margin`` times the longest one at both ends. It fills the panel, of which ``below`` inches at the
    bottom stay empty. The labels of the axes name the ``origin`` from which they count.
    """
    axes: Any = panel.add_axes((0, 0, 1, 1), projection="3d", facecolor="none")
    # Markers of both ends are in front of lines. Surfaces hide what is behind them.
    axes.computed_zorder = not lines
    everything = np.concatenate([*lines, *others])
    everything = everything[np.isfinite(everything[:, 0])]
    middle, half = window(everything, 1.0)
    half = half or 1.0
    # No side is shorter than a fifth of the longest one.
    sides = np.maximum(np.ptp(everything, axis=0) / 2 + 2 * margin * half, 0.2 * half)
    for line, color in zip(lines, colors, strict=True):
        look: Any = {"color": color, "linewidth": 1.2, "zorder": 2, "label": "_shadow"}
        axes.plot(*line.T[:2], np.full(len(line), middle[2] - sides[2]), **look)
    axes.tick_params(color=EDGE, labelcolor=INK, labelsize=points(8) * text_factor(axes), pad=0)
    axes.tick_params(axis="z", pad=3)
    axes.zaxis.labelpad = 1
    factor = OWN_AXES.get(axes, 1.0)
    for axis, number, side, name, start in zip("xyz", middle, sides, "₁₂₃", origin.tolist(), strict=True):
        getattr(axes, f"set_{axis}lim")(number - side, number + side)
        # White walls with faint lines.
        wall = getattr(axes, f"{axis}axis")
        wall.set_pane_color("white")
        wall.pane.set_edgecolor(GRID)
        wall.line.set_color(EDGE)
        wall._axinfo["grid"].update(color=GRID, linewidth=0.6)
        wall.set_major_locator(MaxNLocator(max(1 + 2 * (factor == 1), round(5 * factor * side / sides.max()))))
        wall.labelpad += 5 * bool(start)
        wall.label.set(text=named_from(f"x{name}", start), color=INK, fontsize=points(10))
    # Flat boxes are seen from farther above. Choose the direction from which the curve looks widest, and of two similar
    # ones that from which it runs to the right.
    width, height = size(panel)
    wide = width > 1.5 * height
    turn = 15 if wide else 30
    azimuths = turn - 90, -turn, turn, 90 - turn
    angles = np.radians(azimuths)
    right = everything[:, 1:2] * np.cos(angles) - everything[:, :1] * np.sin(angles)
    first = right[: np.isfinite(lines[0][:, 0]).sum()] if lines else right
    widths = np.std(right, axis=0) * (1 + 0.3 * np.sign(first[-1] - first[0]))
    elevation = float(np.interp(sides[2] / sides[:2].max(), [0.2, 1], [28 if wide else 46, 24]))
    axes.view_init(elev=elevation, azim=azimuths[widths.argmax()])
    axes.set_box_aspect(tuple(sides))
    _fill(panel, axes, middle + sides * np.array(list(product((-1, 1), repeat=3))), below)
    return axes


def _fill(panel: SubFigure, axes: Any, corners: Array, below: float) -> None:
    """Choose the position of axes so that a box fills the panel, with margins for the labels around it.

    Axes of the user keep their position. The box is enlarged in them, where there is space.
    """
    width, height = size(panel)
    free = np.array([width - 2 * _BESIDE, height - below - _UNDER - _ABOVE])
    square = min(width, height)
    if axes not in OWN_AXES:
        axes.set_position((0, 0, square / width, square / height))
    # Positions of the corners in the square of the axes.
    x, y, _ = proj3d.proj_transform(*corners.T, axes.get_proj())
    flat = axes.transAxes.inverted().transform(axes.transData.transform(np.column_stack([x, y])))
    low, extent = flat.min(axis=0), np.ptp(flat, axis=0)
    if axes in OWN_AXES:
        axes.set_box_aspect(axes._box_aspect, zoom=float(np.clip(0.74 / extent.max(), 1.0, 1.3)))
        return
    side = float((free / extent).min())
    left, bottom = np.array([_BESIDE, below + _UNDER]) + (free - side * extent) / 2 - side * low
    axes.set_position((left / width, bottom / height, side / width, side / height))


def frame_handles() -> tuple[list[Any], list[str]]:
    """Return the handles and labels of a legend of the colours of frames."""
    return [Line2D([], [], color=color, linewidth=2.4) for color in AXES], ["first axis", "second", "third"]


def explain_frames(panel: Any, axes: Any) -> None:
    """Draw a legend of the colours of frames below a box, or above axes of the user."""
    holder, anchor = (axes, (0, 1)) if axes in OWN_AXES else (panel, (0.02, 0.28 / size(panel)[1]))
    look: Any = {"loc": "lower left", "bbox_to_anchor": anchor, "handlelength": 1.2, "columnspacing": 1.2}
    legend(holder, *frame_handles(), **look)


# ---- the hyperbolic plane ----


def draw_disk(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw curves in the disk, with two families of geodesics at right angles to the axes.

    Curves far from the middle are moved there, and small ones are enlarged.
    """
    everything = np.concatenate([curve.extent for curve in curves])
    middle, reach = _middle(everything)
    half = 1.04 if reach > 1.2 or reach < 1e-7 else 1.4 * np.tanh(reach / 2)
    axes = panel.add_axes(inside(panel, 0.25, 0.45, 0.25, 0.1), aspect="equal")
    axes.set_axis_off()
    axes.set(xlim=(-half, half), ylim=(-half, half))
    spacing = 0.5 if half > 1 else closest(_STEPS, 0.6 * reach)
    _draw_grid(axes, spacing)
    for curve in curves:
        draw_arrows(axes, curve, flat(curve.points, middle), flat(curve.given, middle))
        draw_in_plane(axes, curve, partial(flat, middle=middle), rims)
    text = "part of the " * bool(half < 1) + f"Poincaré disk; grid of geodesics, {spacing:g} apart on the axes"
    if middle is not _ORIGIN:
        text += "\ncentred at the point (" + ", ".join(f"{x:.4g}" for x in middle) + ")"
    note(panel, text)


def flat(points: Array, middle: Array) -> Array:
    """Return the positions of points in the disk with a given middle, shape (..., 2)."""
    moved = _PLANE.transvection(middle, _PLANE.log(middle, _ORIGIN), points)
    return np.asarray(moved[..., 1:] / (1 + moved[..., :1]))


def rims(positions: Array, radii: Array) -> Array:
    """Return the rims of hyperbolic discs around positions in the disk, shape (m, k, 2).

    They are circles around the middle, moved by Möbius transformations.
    """
    middle = (positions @ [1, 1j])[:, None]
    around = np.tanh(radii / 2)[:, None] * (CIRCLE @ [1, 1j])
    moved = (around + middle) / (1 + middle.conj() * around)
    return np.stack([moved.real, moved.imag], axis=-1)


def _middle(points: Array) -> tuple[Array, float]:
    """Return the middle of the disk, and its distance to the farthest point.

    The middle is the centre of the smallest circle around the points, unless they lie around (1, 0, 0).
    """
    points = points[:: 1 + len(points) // 2000]
    middle = centre_of(_PLANE, points)
    around_origin, around_middle = (float(_PLANE.distance(centre, points).max()) for centre in (_ORIGIN, middle))
    return (middle, around_middle) if around_middle < 0.8 * around_origin else (_ORIGIN, around_origin)


def _draw_grid(axes: Axes, spacing: float) -> None:
    """Draw the disk, and geodesics at right angles to either axis, ten on each side of the other axis."""
    axes.add_patch(Circle((0, 0), 1, facecolor=PAPER, edgecolor=EDGE, linewidth=1, zorder=0))
    along = 14 * np.linspace(-1, 1, 301) ** 3
    for number in range(-10, 11):
        aside = np.cosh(along) * np.sinh(number * spacing)
        line = np.column_stack([np.cosh(along) * np.cosh(number * spacing), aside, np.sinh(along)])
        upright = flat(line, _ORIGIN)
        look: dict[str, Any] = {"color": GRID, "linewidth": 0.6 if number else 0.9, "zorder": 1}
        axes.plot(*upright.T, **look)
        axes.plot(*upright[:, ::-1].T, **look)

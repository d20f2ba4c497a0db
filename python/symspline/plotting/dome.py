"""Lines and planes of three dimensions as points of a half sphere.

A line through the origin meets the upper half sphere once; a plane is shown by its normal. Opposite points of
the rim are the same line: a curve that leaves there comes back on the other side.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from ..places import from_lonlat
from .curves import Curve
from .globe import View, label_directions, middle_of, shade
from .sphere import draw_on_globe, part_of_globe
from .style import EDGE, GRID, INK, inside

Array = NDArray[np.float64]

_HEIGHT = 42
"""From how many degrees above the rim the half sphere is seen."""
_RIM = 1e-9
"""What is closer to the plane of the rim may be on either side by rounding."""
_LABELS = {"x₁": (1.0, 0.0, 0.0), "x₂": (0.0, 1.0, 0.0), "x₃": (0.0, 0.0, 1.0)}


def draw_lines(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """RP² and Gr(1, 3): where lines meet the half sphere."""
    _draw(panel, curves, lambda points: points.reshape(-1, 3), "line")


def draw_normals(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Gr(2, 3): where the normals of planes meet the half sphere."""
    _draw(panel, curves, lambda points: np.cross(points[..., 0], points[..., 1]), "plane")


def _draw(panel: SubFigure, curves: Sequence[Curve], vectors: Callable[[Any], Array], what: str) -> None:
    lines = [lifted(vectors(curve.points)) for curve in curves]
    lines = [line if line[0] @ lines[0][0] >= 0 else -line for line in lines]
    if sum(np.sum(line[:, 2]) for line in lines) < 0:
        lines = [-line for line in lines]
    part = part_of_globe(panel, np.concatenate(lines))
    if part:
        note = f"part of the sphere: opposite points are the same {what}"
    else:
        note = f"opposite points of the rim are the same {what}"
    axes, view = part or _dome(panel, np.concatenate([line * sides(line) for line in lines]))
    for curve, line in zip(curves, lines, strict=True):
        whole = line if part else broken(line)
        if curve.noise is None:
            given = (line if part else line * sides(line))[curve.knots]
        else:
            given = vectors(curve.given)
            given = given * _sides_of(given, curve.beside(line) if part else np.array([0.0, 0.0, 1.0]))
        draw_on_globe(axes, view, curve, whole, given, curve.radii if part else None)
    note += "; points are normals" if what == "plane" else ""
    panel.text(0.5, 0.02, note, ha="center", color=INK, fontsize=9)


def lifted(vectors: Array) -> Array:
    """Unit vectors ±x of samples of a curve, shape (m, 3), with signs such that they do not jump."""
    turned = np.sum(vectors[1:] * vectors[:-1], axis=1) < 0
    signs = np.cumprod(np.where(turned, -1.0, 1.0))
    line: Array = vectors * np.append(1.0, signs)[:, None]
    return line


def sides(line: Array) -> Array:
    """1 above the rim and −1 below, shape (m, 1); at the rim itself as before."""
    known = np.abs(line[:, 2]) > _RIM
    last = np.maximum.accumulate(np.where(known, np.arange(len(line)), -1))
    last = np.where(last < 0, known.argmax(), last)
    return np.where(line[last, 2] < 0, -1.0, 1.0)[:, None]


def _sides_of(vectors: Array, near: Array) -> Array:
    """1 or −1, shape (m, 1), such that vectors are on the side of others."""
    return np.where(np.sum(vectors * near, axis=1) < 0, -1.0, 1.0)[:, None]


def broken(line: Array) -> Array:
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
    return np.insert(line * side, np.repeat(crossings + 1, 3), np.reshape(gaps, (-1, 3)), axis=0)


def _dome(panel: SubFigure, points: Array) -> tuple[Axes, View]:
    """The half sphere, turned towards points."""
    view = View.above(middle_of(points)[0], _HEIGHT)
    axes = panel.add_axes(inside(panel, 0.1, 0.35, 0.1, 0.1))
    axes.set_axis_off()
    turn = np.linspace(-180, 180, 361)
    rim = from_lonlat(turn, 0)
    arc = np.radians(np.linspace(0, 180, 181))
    front = view.visible(rim)
    front = front[np.isfinite(front[:, 0])]
    outline = np.concatenate([np.column_stack([np.cos(arc), np.sin(arc)]), front[front[:, 0].argsort()]])
    shade(axes, Polygon(outline))
    axes.add_patch(Polygon(outline, fill=False, edgecolor=EDGE, linewidth=1, zorder=3))
    axes.plot(*view.hidden(rim).T, color=EDGE, linewidth=0.8, linestyle=(0, (4, 3)), zorder=2)
    grid = [from_lonlat(turn, lat) for lat in range(15, 90, 15)]
    grid += [from_lonlat(lon, np.linspace(0, 90, 91)) for lon in range(-180, 180, 15)]
    for line in grid:
        axes.plot(*view.visible(line).T, color=GRID, linewidth=0.6, zorder=2)
    axes.set(aspect="equal", xlim=(-1.2, 1.2), ylim=(-0.85, 1.1))
    label_directions(axes, view, _LABELS)
    return axes, view

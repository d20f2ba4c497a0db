"""Curves in the hyperbolic plane, in the Poincaré disk."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from ..spaces import Hyperbolic
from .bands import CIRCLE, draw_tube, places_of_discs
from .curves import Curve
from .style import EDGE, GRID, INK, PAPER, inside

Array = NDArray[np.float64]

_PLANE = Hyperbolic(2)
_ORIGIN = np.array([1.0, 0.0, 0.0])
_STEPS = np.array([1, 2, 5]) * 10.0 ** np.arange(-9, 3)[:, None]


def draw_disk(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """The disk, with two families of geodesics at right angles to the axes.

    A curve that is far from the middle is moved there, and a small one is enlarged.
    """
    everything = np.concatenate([curve.extent for curve in curves])
    centre, reach = _centre(everything)
    half = 1.04 if reach > 1.2 or reach < 1e-7 else 1.4 * np.tanh(reach / 2)
    axes = panel.add_axes(inside(panel, 0.25, 0.45, 0.25, 0.1))
    axes.set_axis_off()
    axes.set(aspect="equal", xlim=(-half, half), ylim=(-half, half))
    spacing = 0.5 if half > 1 else _nice(0.6 * reach)
    _draw_grid(axes, spacing)
    for curve in curves:
        if curve.radii is not None:
            some = places_of_discs(curve)
            draw_tube(axes, curve, _rims(flat(curve.points[some], centre), curve.radii[some]))
        curve.draw_line(axes, flat(curve.points, centre))
        curve.draw_dots(axes, flat(curve.given, centre))
    note = f"Poincaré disk; geodesics that cross the axes every {spacing:g}"
    if not np.array_equal(centre, _ORIGIN):
        note += "\nmiddle: " + "(" + ", ".join(f"{x:.4g}" for x in centre) + ")"
    panel.text(0.5, 0.02, note, ha="center", color=INK, fontsize=9)


def flat(points: Array, centre: Array) -> Array:
    """Where points are in the disk whose middle is ``centre``, shape (..., 2)."""
    moved = _PLANE.transvection(centre, _PLANE.log(centre, _ORIGIN), points)
    places: Array = moved[..., 1:] / (1 + moved[..., :1])
    return places


def _rims(places: Array, radii: Array) -> Array:
    """The rims of discs of the hyperbolic plane around places, shape (m, k, 2): circles around the middle, moved by
    Möbius transformations."""
    middle = (places @ [1, 1j])[:, None]
    around = np.tanh(radii / 2)[:, None] * (CIRCLE @ [1, 1j])
    moved = (around + middle) / (1 + middle.conj() * around)
    return np.stack([moved.real, moved.imag], axis=-1)


def _centre(points: Array) -> tuple[Array, float]:
    """The middle of the disk, and the distance to the farthest point from there.

    It is that of the smallest circle around the points, unless they lie around (1, 0, 0) anyway.
    """
    points = points[:: 1 + len(points) // 2000]
    middle = _PLANE.project(points.mean(axis=0))
    for i in range(2, 200):
        # Bădoiu and Clarkson (2003): ever shorter steps to the farthest point.
        middle = _PLANE.geodesic(middle, points[_PLANE.distance(middle, points).argmax()], 1 / i)
    around, beside = (_PLANE.distance(place, points).max() for place in (_ORIGIN, middle))
    return (middle, float(beside)) if beside < 0.8 * around else (_ORIGIN, float(around))


def _nice(value: float) -> float:
    """The spacing that comes closest."""
    return float(_STEPS.ravel()[np.abs(np.log(_STEPS.ravel() / value)).argmin()])


def _draw_grid(axes: Axes, spacing: float) -> None:
    """The disk, and geodesics at right angles to either axis, ten on each side of the other."""
    axes.add_patch(Circle((0, 0), 1, facecolor=PAPER, edgecolor=EDGE, linewidth=1, zorder=0))
    along = 14 * np.linspace(-1, 1, 301) ** 3
    for number in range(-10, 11):
        aside = np.cosh(along) * np.sinh(number * spacing)
        line = np.column_stack([np.cosh(along) * np.cosh(number * spacing), aside, np.sinh(along)])
        upright = flat(line, _ORIGIN)
        look: dict[str, Any] = {"color": GRID, "linewidth": 0.6 if number else 0.9, "zorder": 1}
        axes.plot(*upright.T, **look)
        axes.plot(*upright[:, ::-1].T, **look)

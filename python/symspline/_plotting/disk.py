"""Curves in the hyperbolic plane, drawn in the Poincaré disk."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.patches import Circle

from .._spaces import Hyperbolic
from .curves import CIRCLE, Curve, draw_in_plane
from .globe import centre_of
from .style import EDGE, GRID, PAPER, Array, closest, inside, note

_PLANE = Hyperbolic(2)
_ORIGIN = np.array([1.0, 0.0, 0.0])
_STEPS = np.multiply.outer(10.0 ** np.arange(-9, 3), [1, 2, 5]).ravel()


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
        draw_in_plane(axes, curve, partial(flat, middle=middle), rims)
    text = f"Poincaré disk; geodesics that cross the axes every {spacing:g}"
    if middle is not _ORIGIN:
        text += "\nmiddle: " + "(" + ", ".join(f"{x:.4g}" for x in middle) + ")"
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

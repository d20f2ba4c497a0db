"""Rotations as frames along a time axis, as in Fig. 5 of Bogfjellmo, Modin and Verdier (2018)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from .curves import Curve
from .style import AXES, INK, size
from .timeline import timelines

Array = NDArray[np.float64]

_ROWS = 5
_BOLD = 24
_VIEW = np.array([[-0.5, 0.866, 0.0], [-0.296, -0.171, 0.940], [0.814, 0.470, 0.342]])
"""Right, up and towards the viewer, for whom the first axis points forwards and the third up."""


def draw_quaternions(panel: FigureBase, curves: Sequence[Curve]) -> None:
    """S³: unit quaternions, scalar first, as rotations."""
    draw_frames(panel, curves, rotations)


def rotations(quaternions: Array) -> Array:
    """The rotation matrices of unit quaternions w, x, y, z; shape (..., 3, 3)."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def draw_frames(panel: FigureBase, curves: Sequence[Curve], matrices: Callable[[Array], Array]) -> None:
    """The columns of rotation matrices as arrows along a time axis; the given ones bold.

    Args:
        matrices: makes of points the rotation matrices, shape (..., 3, 3).
    """
    shown = [curves[i] for i in np.unique(np.linspace(0, len(curves) - 1, min(len(curves), _ROWS)).astype(int))]
    (axes,) = timelines(panel, shown, [""], top=0.45)
    axes.set(ylim=(-0.5, len(shown) - 0.5), yticks=[])
    axes.spines["left"].set_visible(False)
    width, height = (side * length for side, length in zip(axes.get_position().size, size(panel), strict=True))
    length = min(0.6, 0.55 * height / len(shown))
    for row, curve in enumerate(reversed(shown)):
        bold, between = _places(curve, width / (0.45 * length))
        frames = _VIEW @ matrices(curve.points)
        _draw_arrows(axes, curve.times[between], row, length * frames[between], bold=False)
        _draw_arrows(axes, curve.times[bold], row, length * frames[bold], bold=True)
    handles = [Line2D([], [], color=color, linewidth=2.4) for color in AXES]
    title = "axes of the frame; given ones bold" + (f"; {len(shown)} curves" if len(shown) < len(curves) else "")
    place = {"loc": "lower right", "bbox_to_anchor": (1, 1), "ncols": 3, "borderaxespad": 0}
    axes.legend(handles, ["first", "second", "third"], frameon=False, labelcolor=INK, fontsize=9, **place)
    axes.text(0, 1.02, title, transform=axes.transAxes, color=INK, fontsize=9)


def _places(curve: Curve, number: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Among the samples of a curve, knots for bold frames, and places in between for faint ones."""
    knots = np.arange(len(curve.x))[curve.knots]
    bold = knots[:: 1 + (len(knots) - 2) // _BOLD]
    even = np.linspace(curve.x[0], curve.x[-1], int(number))
    gap = np.abs(even[:, None] - curve.x[bold]).min(axis=1)
    between = np.searchsorted(curve.x, even[gap > 0.6 * (even[1] - even[0])])
    return bold, between


def _draw_arrows(axes: Axes, times: Array, row: int, frames: Array, bold: bool) -> None:
    """Frames of shape (m, 3, 3), in inches: right, up, to the viewer; what is nearer is drawn later."""
    order = np.argsort(frames[:, 2], axis=-1)
    right, up, _ = np.moveaxis(np.take_along_axis(frames, order[:, None], axis=-1), 1, 0)
    width = 0.032 if bold else 0.014
    axes.quiver(
        np.repeat(times, 3),
        np.full(3 * len(times), row),
        right.ravel(),
        up.ravel(),
        color=np.array(AXES)[order.ravel()],
        alpha=1 if bold else 0.55,
        units="inches",
        scale_units="inches",
        scale=1,
        width=width,
        headwidth=3.5,
        headlength=4.5,
        headaxislength=4.2,
        clip_on=False,
        zorder=4 if bold else 3,
    )

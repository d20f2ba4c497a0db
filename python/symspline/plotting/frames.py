"""Rotations as frames along a time axis, as in Fig. 5 of Bogfjellmo, Modin and Verdier (2018)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from .curves import Curve
from .style import AXES, INK, size
from .timeline import LEFT, RIGHT, row_axes

Array = NDArray[np.float64]

VIEW = np.array([[-0.5, 0.866, 0.0], [-0.296, -0.171, 0.940], [0.814, 0.470, 0.342]])
"""Right, up and towards the viewer, for whom the first axis points forwards and the third up."""


def draw_quaternions(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """S³: unit quaternions, scalar first, as rotations."""
    draw_frames(panel, curves, rotations)


def draw_rotations(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """SO(3) and O(3): orthogonal matrices as they are."""
    draw_frames(panel, curves, lambda matrices: matrices)


def draw_spins(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """SU(2): the rotations of space that belong to the matrices."""
    draw_frames(panel, curves, lambda matrices: rotations(quaternions(matrices)))


def quaternions(matrices: NDArray[Any]) -> Array:
    """The unit quaternions w, x, y, z of matrices w − i(xσ₁ + yσ₂ + zσ₃) of SU(2), shape (..., 4)."""
    a, b = matrices[..., 0, 0], matrices[..., 1, 0]
    return np.stack([a.real, -b.imag, b.real, -a.imag], axis=-1)


def rotations(quaternions: Array) -> Array:
    """The rotation matrices of unit quaternions w, x, y, z; shape (..., 3, 3)."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def draw_frames(panel: SubFigure, curves: Sequence[Curve], matrices: Callable[[Array], Array]) -> None:
    """The columns of rotation matrices as arrows along a time axis; the given ones bold.

    Args:
        matrices: makes of points the rotation matrices, shape (..., 3, 3).
    """
    width, height = size(panel)
    axes, rows = row_axes(panel, curves)
    length = min(0.7, 0.4 * height / len(rows))
    number = int((width - LEFT - RIGHT) / (0.5 * length))
    for row, i in enumerate(rows):
        bold, between = curves[i].picked(number)
        frames = length * VIEW @ matrices(curves[i].points)
        data = curves[i].picked_data(number)
        if len(data):
            noisy = length * VIEW @ matrices(curves[i].given[data])
            _draw_arrows(axes, curves[i].on_axis(curves[i].given_x[data]), -row, noisy, bold=False)
        _draw_arrows(axes, curves[i].times[between], -row, frames[between], bold=False)
        _draw_arrows(axes, curves[i].times[bold], -row, frames[bold], bold=True)
    note = given_note(curves)
    explain(axes, note if len(rows) == len(curves) else f"{note}; {len(rows)} of the curves")


def given_note(curves: Sequence[Curve]) -> str:
    """Which frames are the given ones."""
    return "bold: given" if curves[0].noise is None else "bold: curve, light: data"


def explain(axes: Axes, note: str, height: float = 1.0) -> None:
    """Which colour is which axis, in a line at a height of the axes."""
    handles = [Line2D([], [], color=color, linewidth=2.4) for color in AXES]
    labels = ["first axis", "second", "third", note]
    handles.append(Line2D([], [], linestyle="none"))
    place: dict[str, Any] = {
        "loc": "lower left",
        "bbox_to_anchor": (0, height),
        "ncols": 4,
        "borderaxespad": 0.2,
    }
    look: dict[str, Any] = {"labelcolor": INK, "fontsize": 9, "handlelength": 1.2, "columnspacing": 1.2}
    axes.legend(handles, labels, frameon=False, **place, **look)


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

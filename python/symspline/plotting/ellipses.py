"""Positive definite matrices as ellipses and ellipsoids along a time axis.

Half axes are the eigenvectors, as long as the roots of the eigenvalues: one standard deviation, if the matrices
are covariances.
"""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import SubFigure
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from .curves import Curve
from .frames import VIEW
from .style import INK, size
from .timeline import LEFT, RIGHT, row_axes

Array = NDArray[np.float64]

_ANGLES = np.linspace(0, 2 * np.pi, 97)


def draw_ellipses(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """SPD(2): ellipses along the time axis, coloured by time; the given ones filled."""
    _draw(panel, curves, np.eye(2))


def draw_ellipsoids(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """SPD(3): ellipsoids, seen as rotated frames are, with their principal sections."""
    _draw(panel, curves, VIEW)


def outlines(matrices: Array) -> Array:
    """The ellipses of matrices or the outlines of ellipsoids, shape (m, 97, 2): what is right and what is up."""
    roots, turn = _half_axes(matrices[:, :2, :2])
    circle = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=-1)
    ellipses: Array = circle * roots[:, None] @ turn
    return ellipses


def sections(matrices: Array) -> Array:
    """The near halves of the ellipsoids' sections between two half axes, shape (m, 3, 97, 2); NaN beyond."""
    roots, turn = (array[:, None] for array in _half_axes(matrices))
    rings = np.zeros((3, len(_ANGLES), 3))
    for i in range(3):
        rings[i, :, i - 1], rings[i, :, i - 2] = np.cos(_ANGLES), np.sin(_ANGLES)
    normals = rings / roots[..., None, :] @ turn
    near: Array = np.where(normals[..., 2:] > 0, (rings * roots[..., None, :] @ turn)[..., :2], np.nan)
    return near


def _half_axes(matrices: Array) -> tuple[Array, Array]:
    """The roots of the eigenvalues, and the eigenvectors in rows."""
    values, vectors = np.linalg.eigh(matrices)
    # By rounding an eigenvalue may be 0.
    roots = np.sqrt(np.maximum(values, 1e-16 * values[:, -1:]))
    return roots, vectors.swapaxes(1, 2)


def _draw(panel: SubFigure, curves: Sequence[Curve], view: Array) -> None:
    """Rows of ellipses, one a curve, all on the same scale.

    Args:
        view: right, up and, of ellipsoids, towards the viewer.
    """
    noisy = curves[0].noise is not None
    note = "half axes: √eigenvalues; filled: " + ("curve, outlines: data" if noisy else "given")
    if len(view) == 3:
        note += "; x₁ forwards, x₂ right, x₃ up"
    # Beside the scale, which is an inch wide.
    note = fill(note, int((size(panel)[0] - LEFT - RIGHT - 1) / 0.075))
    axes, rows = row_axes(panel, curves, top=0.25 + 0.15 * (1 + note.count("\n")))
    if len(rows) < len(curves):
        note += f"; {len(rows)} of the curves"
    axes.text(0, 1.02, note, transform=axes.transAxes, color=INK, fontsize=9, va="bottom")
    width, height = axes.bbox.width / panel.dpi, axes.bbox.height / len(rows) / panel.dpi
    largest = max(np.sqrt(np.linalg.eigvalsh(curves[i].extent).max()) for i in rows)
    inches = min(0.45 * height, 0.7) / largest
    number = int(width / (0.9 * inches * largest))
    for row, i in enumerate(rows):
        matrices = view @ curves[i].points @ view.T
        for picked, bold in zip(curves[i].picked(number)[::-1], (False, True), strict=True):
            places = np.column_stack([curves[i].times[picked], np.full(len(picked), -row)])
            _draw_row(axes, places, matrices[picked], inches, bold)
        data = curves[i].picked_data(number)
        if len(data):
            places = np.column_stack([curves[i].on_axis(curves[i].given_x[data]), np.full(len(data), -row)])
            _draw_row(axes, places, view @ curves[i].given[data] @ view.T, inches, False, INK)
    _draw_scale(axes, width, inches)


def _draw_scale(axes: Axes, width: float, inches: float) -> None:
    """A bar above the right corner that is 1, 2 or 5 times a power of ten long."""
    longest = 0.8 / inches
    power = 10.0 ** np.floor(np.log10(longest))
    length = max(step for step in (power, 2 * power, 5 * power) if step < 1.01 * longest)
    ends = [1 - length * inches / width, 1]
    look: dict[str, Any] = {"transform": axes.transAxes, "color": INK, "clip_on": False}
    axes.plot(ends, [1.07, 1.07], "|-", linewidth=1.2, markersize=5, **look)
    axes.text(ends[0] - 0.01, 1.07, f"{length:g}", fontsize=9, ha="right", va="center_baseline", **look)


def _draw_row(
    axes: Axes, places: Array, matrices: Array, inches: float, bold: bool, color: Any = None
) -> None:
    """Ellipses at places of the axes, in colours by time unless there is one for all.

    Args:
        inches: how long 1 is on paper: the time axis has another scale.
    """
    first, last = axes.get_xlim()
    colors = colormaps["viridis"](0.85 * (places[:, 0] - first) / (last - first))
    if color is not None:
        colors = np.array([to_rgba(color)] * len(places))
    inside = colors * [1, 1, 1, 0.45 if bold else 0]
    where: dict[str, Any] = {
        "offsets": places,
        "offset_transform": axes.transData,
        "transform": Affine2D().scale(inches) + axes.figure.dpi_scale_trans,
        "clip_on": False,
        "zorder": 5 if color is not None else 4 if bold else 3,
        "edgecolors": colors,
    }
    rings = list(outlines(matrices))
    axes.add_collection(PolyCollection(rings, facecolors=inside, linewidths=1.6 if bold else 0.7, **where))
    if matrices.shape[1] == 3:
        for lines in sections(matrices).swapaxes(0, 1):
            axes.add_collection(LineCollection(list(lines), linewidths=0.9 if bold else 0.4, **where))

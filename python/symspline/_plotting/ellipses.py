"""Positive definite matrices as ellipses and ellipsoids along a time axis.

Semi-axes are parallel to the eigenvectors and as long as the square roots of the eigenvalues: one standard deviation,
if the matrices are covariances.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import SubFigure
from matplotlib.transforms import Affine2D

from .curves import Curve
from .frames import VIEW
from .graphs import LEFT, RIGHT, row_axes
from .style import INK, Array, size, time_colors

_ANGLES = np.linspace(0, 2 * np.pi, 97)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), 0 * _ANGLES], axis=-1)


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


def _draw(view: Array, panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw rows of ellipses along the time axis, coloured by time and on the same scale. Given ones are filled.

    The rows of ``view`` are the directions to the right, up and, for ellipsoids, towards the viewer.
    """
    words = "half axes: √eigenvalues; filled: "
    words += "given" if curves[0].noise is None else "curve, outlines: data"
    words += "; x₁ forwards, x₂ right, x₃ up" * (len(view) == 3)
    # The scale to the right of the words is an inch wide.
    words = fill(words, int((size(panel)[0] - LEFT - RIGHT - 1) / 0.075))
    axes, rows = row_axes(panel, curves, top=0.25 + 0.15 * (1 + words.count("\n")))
    if len(rows) < len(curves):
        words += f"; {len(rows)} of the curves"
    axes.text(0, 1.02, words, transform=axes.transAxes, color=INK, fontsize=9, va="bottom")
    width, height = axes.bbox.width / panel.dpi, axes.bbox.height / len(rows) / panel.dpi
    largest = max(np.sqrt(np.linalg.eigvalsh(curves[i].extent).max()) for i in rows)
    inches = min(0.45 * height, 0.7) / largest
    number = int(width / (0.9 * inches * largest))
    for row, i in enumerate(rows):
        for group, (times, points) in curves[i].samples(number).items():
            _draw_row(axes, -row, inches, times, view @ points @ view.T, group)
    _draw_scale(axes, width, inches)


draw_ellipses = partial(_draw, np.eye(2))
draw_ellipsoids = partial(_draw, VIEW)


def _draw_scale(axes: Axes, width: float, inches: float) -> None:
    """Draw a bar above the right corner whose length is 1, 2 or 5 times a power of ten."""
    longest = 0.8 / inches
    power = 10.0 ** np.floor(np.log10(longest))
    length = max(step for step in (power, 2 * power, 5 * power) if step < 1.01 * longest)
    ends = [1 - length * inches / width, 1]
    look: dict[str, Any] = {"transform": axes.transAxes, "color": INK, "clip_on": False}
    axes.plot(ends, [1.07, 1.07], "|-", linewidth=1.2, markersize=5, **look)
    axes.text(ends[0] - 0.01, 1.07, f"{length:g}", fontsize=9, ha="right", va="center_baseline", **look)


def _draw_row(axes: Axes, row: int, inches: float, times: Array, matrices: Array, group: str) -> None:
    """Draw ellipses in a row of the axes, coloured by time; those of noisy data have one colour.

    ``inches`` is the length of 1 on paper, as the time axis has another scale. The groups are those of `Curve.samples`.
    """
    first, last = axes.get_xlim()
    colors, bold = time_colors((times - first) / (last - first)), group == "bold"
    if group == "data":
        colors[:] = to_rgba(INK)
    look: dict[str, Any] = {
        "offsets": np.column_stack([times, np.full(len(times), row)]),
        "offset_transform": axes.transData,
        "transform": Affine2D().scale(inches) + axes.figure.dpi_scale_trans,
        "clip_on": False,
        "zorder": {"between": 3, "bold": 4, "data": 5}[group],
        "edgecolors": colors,
    }
    filled = colors * [1, 1, 1, 0.45 if bold else 0]
    rings = list(outlines(matrices))
    axes.add_collection(PolyCollection(rings, facecolors=filled, linewidths=1.6 if bold else 0.7, **look))
    if matrices.shape[1] == 3:
        for lines in sections(matrices).swapaxes(0, 1):
            axes.add_collection(LineCollection(list(lines), linewidths=0.9 if bold else 0.4, **look))

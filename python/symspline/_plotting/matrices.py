"""Matrices as symbols along a time axis or a path.

Rotations are frames, as in Fig. 5 of Bogfjellmo, Modin and Verdier (2018), and so are rigid motions. Positive definite
matrices are ellipses and ellipsoids. Their semi-axes are parallel to the eigenvectors and as long as the square roots
of the eigenvalues: one standard deviation, if the matrices are covariances.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from .._quaternions import rotation_rows
from .chart import box, plane
from .curves import Curve
from .graphs import LEFT, RIGHT, row_axes
from .style import AXES, DATA, INK, Array, legend, size, time_colors, window

VIEW = np.array([[-0.5, 0.866, 0.0], [-0.296, -0.171, 0.940], [0.814, 0.470, 0.342]])
"""Directions to the right, up and towards the viewer, who sees the first axis point forwards and the third up."""

_ARROW = np.array([[1.0, 0.0], [-0.7, 0.55], [-0.35, 0.0], [-0.7, -0.55]])
"""A body in the plane that points along its first axis."""
_MANY = 24
"""The number of bodies of all curves, or two per curve if that is more."""
_ANGLES = np.linspace(0, 2 * np.pi, 97)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), 0 * _ANGLES], axis=-1)


# ---- rotations ----


def _draw_rotations(matrices: Callable[[Any], Array], panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw the columns of rotation matrices, shape (..., 3, 3), as arrows along a time axis. Given ones are bold."""
    width, height = size(panel)
    axes, rows = row_axes(panel, curves)
    length = min(0.7, 0.4 * height / len(rows))
    number = int((width - LEFT - RIGHT) / (0.5 * length))
    for row, i in enumerate(rows):
        for group, (times, points) in curves[i].samples(number).items():
            _draw_arrows(axes, times, -row, length * matrices(points), group == "bold")
    _explain(axes, curves, "" if len(rows) == len(curves) else f"; {len(rows)} of the curves")


def rotations(quaternions: Array) -> Array:
    """Return the rotation matrices of unit quaternions w, x, y, z; shape (..., 3, 3)."""
    return np.moveaxis(np.array(rotation_rows(*np.moveaxis(quaternions, -1, 0))), (0, 1), (-2, -1))


def quaternions(matrices: NDArray[Any]) -> Array:
    """Return the unit quaternions w, x, y, z of matrices w − i(xσ₁ + yσ₂ + zσ₃) of SU(2), shape (..., 4)."""
    a, b = matrices[..., 0, 0], matrices[..., 1, 0]
    return np.stack([a.real, -b.imag, b.real, -a.imag], axis=-1)


# Points of S³ are unit quaternions, scalar first. Those of SU(2) act on R³ as rotations.
draw_quaternions = partial(_draw_rotations, rotations)
draw_rotations = partial(_draw_rotations, np.asarray)
draw_spins = partial(_draw_rotations, lambda matrices: rotations(quaternions(matrices)))


def _draw_arrows(axes: Axes, times: Array, row: int, frames: Array, bold: bool) -> None:
    """Draw the columns of matrices, shape (m, 3, 3), in inches. Nearer columns cover farther ones."""
    seen = VIEW @ frames
    order = np.argsort(seen[:, 2], axis=-1)
    right, up, _ = np.moveaxis(np.take_along_axis(seen, order[:, None], axis=-1), 1, 0)
    look: Any = {"units": "inches", "scale_units": "inches", "scale": 1, "clip_on": False}
    look |= {"headwidth": 3.5, "headlength": 4.5, "headaxislength": 4.2}
    look |= {"width": 0.032, "alpha": 1, "zorder": 4} if bold else {"width": 0.014, "alpha": 0.55, "zorder": 3}
    positions = np.repeat(times, 3), np.full(3 * len(times), row)
    axes.quiver(*positions, right.ravel(), up.ravel(), color=np.array(AXES)[order.ravel()], **look)


def _explain(axes: Axes, curves: Sequence[Curve], more: str, height: float = 1.0) -> None:
    """Draw a legend of the colours in one line at a given height of the axes."""
    handles = [Line2D([], [], color=color, linewidth=2.4) for color in AXES]
    given = curves[0].legend_of("bold: given", "bold: curve", "light: data")
    anchor: Any = {"loc": "lower left", "bbox_to_anchor": (0, height), "ncols": 4, "borderaxespad": 0.2}
    handles.append(Line2D([], [], linestyle="none"))
    labels = ["first axis", "second", "third", given + more]
    legend(axes, handles, labels, handlelength=1.2, columnspacing=1.2, **anchor)


# ---- rigid motions: the path of a body, and its orientation ----


def draw_flat_poses(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw poses of SE(2) as arrow heads on the path that point along their first axis. Given ones are filled."""
    axes = plane(panel)
    _, half = window(np.concatenate([curve.extent[:, :2, 2] for curve in curves]), 1.0)
    number = max(2, _MANY // len(curves))

    def draw(poses: Array, **look: Any) -> None:
        turned = length * _ARROW @ poses[:, :2, :2].swapaxes(1, 2)
        axes.add_collection(PolyCollection(list(turned + poses[:, None, :2, 2]), zorder=5, **look))

    for curve in curves:
        length = 0.07 * (half or 1.0) * (1 if curve.alone else 0.6)
        curve.draw_line(axes, curve.points[:, :2, 2], linewidth=1.2, alpha=0.6)
        groups = {group: poses for group, (_, poses) in curve.samples(number).items()}
        edge, light = (INK, DATA) if curve.alone else (curve.color, curve.color)
        if "data" in groups:
            curve.draw_dots(axes, curve.given[:, :2, 2])
            draw(groups["data"], facecolor="none", edgecolor=light, alpha=0.6)
        draw(groups["between"], facecolor="none", edgecolor=curve.color)
        draw(groups["bold"][1:], facecolor=edge, edgecolor=edge)
        draw(groups["bold"][:1], facecolor="white", edgecolor=edge)
    axes.autoscale_view()


def draw_poses(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw poses of SE(3) as frames on the path. Given ones are bold."""
    paths = [curve.points[:, :3, 3] for curve in curves]
    axes = box(panel, paths, [curve.given[:, :3, 3] for curve in curves], 1.2, below=0.4)
    number = max(2, _MANY // len(curves))
    length = 0.12 * float(np.ptp(axes.get_xlim()))

    def draw(poses: Array, length: float, **look: Any) -> None:
        feet = poses[:, :3, 3]
        for i, color in enumerate(AXES):
            # All sticks of one colour are one line with breaks.
            sticks = np.stack([feet, feet + length * poses[:, :3, i], np.full_like(feet, np.nan)], axis=1)
            axes.plot(*sticks.reshape(-1, 3).T, color=color, zorder=5, **look)

    for curve, path in zip(curves, paths, strict=True):
        curve.draw_line(axes, path, linewidth=1.2)
        for group, (_, poses) in curve.samples(number).items():
            if group != "bold":
                draw(poses, 0.8 * length, linewidth=0.8, alpha=0.55)
                continue
            draw(poses, length, linewidth=2.0 if curve.alone else 1.3)
            if curve.noise is None:
                curve.draw_dots(axes, poses[:, :3, 3], markersize=3.5 if curve.alone else 2)
            else:
                curve.draw_dots(axes, curve.given[:, :3, 3])
    _explain(axes, curves, "", height=-0.06)


# ---- positive definite matrices ----


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
    words = f"half axes: √eigenvalues; filled: {curves[0].legend_of('given', 'curve', 'outlines: data')}"
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


draw_ellipses = partial(_draw_in_rows, np.eye(2))
draw_ellipsoids = partial(_draw_in_rows, VIEW)


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

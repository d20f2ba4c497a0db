"""The numbers of which a point is made, against time: the picture for spaces without a better one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import FigureBase
from numpy.typing import NDArray

from .curves import Curve
from .style import DISTINCT, INK
from .timeline import timelines

_MOST, _IN_ROW = 12, 6
_SUBSCRIPTS = str.maketrans("0123456789,", "₀₁₂₃₄₅₆₇₈₉,")


def draw_components(panel: FigureBase, curves: Sequence[Curve]) -> None:
    """Every component against time, the first twelve with their names."""
    names = component_names(curves[0].spline.space.point_shape, np.iscomplexobj(curves[0].points))
    rows = -(-min(len(names), _MOST) // _IN_ROW)
    (axes,) = timelines(panel, curves, ["components"], top=0.25 + 0.22 * rows)
    for curve in curves:
        numbers = components(curve.points)
        width = 1.8 if curve.alone else 0.9
        axes.plot(curve.times, numbers[:, _MOST:], color=INK, linewidth=0.4, alpha=0.4)
        for i, name in enumerate(names[:_MOST]):
            look = {"color": DISTINCT[i % 6], "linestyle": "--" if i >= 6 else "-", "linewidth": width}
            axes.plot(curve.times, numbers[:, i], label=name if curve is curves[0] else None, **look)
            if curve.alone:
                knots = curve.knots
                axes.plot(curve.times[knots], numbers[knots, i], "o", color=DISTINCT[i % 6], markersize=3)
    place = {"loc": "lower right", "bbox_to_anchor": (1, 1), "ncols": _IN_ROW, "borderaxespad": 0}
    axes.legend(frameon=False, labelcolor=INK, fontsize=9, handlelength=1.6, **place)


def components(points: NDArray[np.generic]) -> NDArray[np.float64]:
    """One row a point; of complex numbers the real and the imaginary parts by turns."""
    flat = points.reshape(len(points), -1)
    parts = np.stack([flat.real, flat.imag], axis=-1) if np.iscomplexobj(flat) else flat
    result: NDArray[np.float64] = parts.reshape(len(points), -1)
    return result


def component_names(shape: tuple[int, ...], is_complex: bool) -> list[str]:
    """Such as x₁, x₂ or, for matrices, x₁₁; counted from 1."""
    comma = "," if max(shape) > 9 else ""
    indices = [comma.join(str(i + 1) for i in index) for index in np.ndindex(*shape)]
    names = [f"x{index.translate(_SUBSCRIPTS)}" for index in indices]
    return [f"{part} {name}" for name in names for part in ("Re", "Im")] if is_complex else names

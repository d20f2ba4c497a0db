"""The numbers of which a point is made, against time: the picture for spaces without a better one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import SubFigure
from numpy.typing import NDArray

from .curves import Curve
from .style import DISTINCT, INK, size
from .timeline import LEFT, RIGHT, timelines

_MOST = 12
_SUBSCRIPTS = str.maketrans("0123456789,", "₀₁₂₃₄₅₆₇₈₉,")


def draw_components(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Every component against time, the first twelve with their names."""
    names = component_names(curves[0].spline.space.point_shape, np.iscomplexobj(curves[0].points))
    in_row = min(6, int((size(panel)[0] - LEFT - RIGHT) / 0.9))
    rows = -(-min(len(names), _MOST) // in_row)
    (axes,) = timelines(panel, curves, ["components"], top=0.25 + 0.22 * rows)
    for curve in curves:
        numbers = components(curve.points)
        width = 1.8 if curve.alone else 0.9
        axes.plot(curve.times, numbers[:, _MOST:], color=INK, linewidth=0.4, alpha=0.4)
        for i, name in enumerate(names[:_MOST]):
            look: dict[str, Any] = {
                "color": DISTINCT[i % 6],
                "linestyle": "--" if i >= 6 else "-",
                "linewidth": width,
            }
            axes.plot(curve.times, numbers[:, i], label=name if curve is curves[0] else None, **look)
            if curve.alone:
                knots = curve.knots
                axes.plot(curve.times[knots], numbers[knots, i], "o", color=DISTINCT[i % 6], markersize=3)
    handles = axes.get_legend_handles_labels()[0]
    by_rows = [handle for column in range(in_row) for handle in handles[column::in_row]]
    place: dict[str, Any] = {
        "loc": "lower right",
        "bbox_to_anchor": (1, 1),
        "ncols": in_row,
        "borderaxespad": 0,
    }
    axes.legend(handles=by_rows, frameon=False, labelcolor=INK, fontsize=9, handlelength=1.6, **place)


def components(points: NDArray[Any]) -> NDArray[np.float64]:
    """One row a point; of complex numbers the real and the imaginary parts by turns."""
    flat = points.reshape(len(points), -1)
    parts = [flat.real, flat.imag] if np.iscomplexobj(flat) else [flat]
    return np.stack(parts, axis=-1).reshape(len(points), -1)


def component_names(shape: tuple[int, ...], is_complex: bool) -> list[str]:
    """Such as x₁, x₂ or, for matrices, x₁₁; counted from 1."""
    comma = "," if max(shape) > 9 else ""
    indices = [comma.join(str(i + 1) for i in index) for index in np.ndindex(*shape)]
    names = [f"x{index.translate(_SUBSCRIPTS)}" for index in indices]
    return [f"{part} {name}" for name in names for part in ("Re", "Im")] if is_complex else names

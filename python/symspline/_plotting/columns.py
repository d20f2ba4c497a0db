"""Graphs of the columns of matrices, such as orthonormal frames, with one panel per column."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D

from .curves import DOTS, Curve, are_compared
from .graphs import SUBSCRIPTS, draw_components, timelines
from .style import DISTINCT, legend

_COLUMNS = 4
"""The largest number of columns that have a panel each. Rows have distinct colours, of which there are six."""


def draw_columns(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw the entries of every column in one panel, in the colours of their rows; all components of large matrices."""
    n, k = curves[0].space.point_shape
    if k > _COLUMNS or n > len(DISTINCT) or are_compared(curves) or not isinstance(panel, SubFigure):
        draw_components(panel, curves)
        return
    made = timelines(panel, curves, [f"column {j + 1}" for j in range(k)], top=0.35)
    width = 1.8 if curves[0].alone else 0.9
    for curve in curves:
        line, given = curve.marked(np.asarray)
        for j, axes in enumerate(made):
            for i in range(n):
                axes.plot(curve.times, line[:, i, j], color=DISTINCT[i], linewidth=width)
                if curve.alone and (curve.has_nodes or curve.noise is not None):
                    axes.plot(
                        curve.on_axis(curve.given_x), given[:, i, j], "o", color=DISTINCT[i], markersize=3, label=DOTS
                    )
    low, high = (np.array([axes.get_ylim() for axes in made]).T[i] for i in (0, 1))
    for axes in made:
        axes.set_ylim(low.min(), high.max())
    handles = [Line2D([], [], color=color, linewidth=width) for color in DISTINCT[:n]]
    names = [f"x{i + 1}".translate(SUBSCRIPTS) for i in range(n)]
    legend(made[0], handles, names, handlelength=1.6, loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0)

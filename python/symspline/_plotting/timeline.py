"""Axes with a time axis, on which knots are marked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure

from .curves import Curve
from .style import EDGE, GAP, Indices, evenly, inside, plain, show_dates, size

LEFT, RIGHT, BOTTOM, TOP = 0.95, 0.6, 0.55, 0.25
"""Margins in inches, which align the time axes of several panels."""

_LINES, _TICKS = 60, 2000


def timelines(
    panel: SubFigure, curves: Sequence[Curve], labels: Sequence[str], top: float = TOP
) -> list[Axes]:
    """Add a column of axes with the same time axis, one per label of the vertical axis."""
    height = (size(panel)[1] - BOTTOM - top) / len(labels)
    made = []
    for i, label in enumerate(labels):
        lower, upper = BOTTOM + (len(labels) - 1 - i) * height, top + i * height
        axes = panel.add_axes(inside(panel, LEFT, lower + (0.3 if lower > BOTTOM else 0), RIGHT, upper))
        plain(axes)
        axes.grid(visible=False, axis="x")
        axes.set_ylabel(label)
        _set_times(axes, curves, size(panel)[0] - LEFT - RIGHT, lowest=i == len(labels) - 1)
        _mark_knots(axes, curves)
        made.append(axes)
    return made


def row_axes(panel: SubFigure, curves: Sequence[Curve], top: float = 0.4) -> tuple[Axes, Indices]:
    """Add axes for rows of pictures along the time axis, and return the indices of the curves that have a row.

    Row i is at height −i. There are as many rows as fit.
    """
    rows = evenly(len(curves), int(size(panel)[1] // 0.8))
    (axes,) = timelines(panel, curves, [""], top=top)
    axes.set(ylim=(0.5 - len(rows), 0.5), yticks=[])
    axes.spines["left"].set_visible(False)
    return axes, rows


def _set_times(axes: Axes, curves: Sequence[Curve], width: float, lowest: bool) -> None:
    first, last = min(curve.times[0] for curve in curves), max(curve.times[-1] for curve in curves)
    axes.set_xlim(first - 0.01 * (last - first), last + 0.01 * (last - first))
    if curves[0].dates:
        # For some spans the locator does not find an interval between narrower limits.
        show_dates(axes, *((3, 10) if width > 7 else (2, 5)))
    axes.set_xlabel(curves[0].time_name if lowest else "")
    axes.tick_params(labelbottom=lowest)
    axes.xaxis.offsetText.set_visible(lowest)


def _mark_knots(axes: Axes, curves: Sequence[Curve]) -> None:
    """Mark knots or noisy data by thin lines, or by short ticks if lines would be too many.

    Bands mark long gaps between points.
    """
    knots = np.unique(np.concatenate([curve.marks for curve in curves]))
    height = 1.0 if len(knots) <= _LINES else 0.04
    look: Any = {"transform": axes.get_xaxis_transform()}
    line: Any = {"color": EDGE, "linewidth": 0.8, "linestyle": (0, (1, 2)), "zorder": 1}
    axes.vlines(knots[:: 1 + len(knots) // _TICKS], 0, height, **look, **line)
    gaps = np.unique(np.concatenate([curve.gaps for curve in curves]), axis=0)
    if len(gaps):
        spans = [(start, end - start) for start, end in gaps.tolist()]
        axes.broken_barh(spans, (0, 1), label="gaps", facecolor=GAP, linewidth=0, zorder=0.5, **look)

"""Axes over time, with the knots marked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import FigureBase

from .curves import Curve
from .style import EDGE, INK, inside, plain, size

LEFT, RIGHT, BOTTOM, TOP = 0.85, 0.6, 0.55, 0.2
"""Margins in inches: panels above one another have their time axes aligned."""

_LINES, _TICKS = 60, 2000


def timelines(panel: FigureBase, curves: Sequence[Curve], labels: Sequence[str], top: float = TOP) -> list[Axes]:
    """Axes above one another over the same times, one a label of the vertical axis."""
    height = (size(panel)[1] - BOTTOM - top) / len(labels)
    made = []
    for i, label in enumerate(labels):
        lower, upper = BOTTOM + (len(labels) - 1 - i) * height, top + i * height
        axes = panel.add_axes(inside(panel, LEFT, lower + (0.13 if lower > BOTTOM else 0), RIGHT, upper))
        plain(axes)
        axes.set_ylabel(label)
        _set_times(axes, curves, last=i == len(labels) - 1)
        _mark_knots(axes, curves)
        made.append(axes)
    return made


def _set_times(axes: Axes, curves: Sequence[Curve], last: bool) -> None:
    axes.set_xlim(min(curve.times[0] for curve in curves), max(curve.times[-1] for curve in curves))
    if curves[0].dates:
        locator = AutoDateLocator()
        axes.xaxis.set_major_locator(locator)
        axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))
    elif last:
        axes.set_xlabel("t")
    axes.tick_params(labelbottom=last)
    axes.xaxis.offsetText.set_visible(last)


def _mark_knots(axes: Axes, curves: Sequence[Curve]) -> None:
    """Thin lines at the knots; short ticks where lines would be too many."""
    knots = np.unique(np.concatenate([curve.times[curve.knots] for curve in curves]))
    height = 1.0 if len(knots) <= _LINES else 0.04
    knots = knots[:: 1 + len(knots) // _TICKS]
    axes.vlines(
        knots, 0, height, transform=axes.get_xaxis_transform(), color=EDGE, linewidth=0.8, linestyle=(0, (1, 2)), zorder=1
    )

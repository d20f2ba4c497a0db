"""Axes of one picture, the view of a space that is drawn into them, and axes with a time axis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from .curves import Axis, Curve, common_gaps
from .lines import fresh
from .style import DOTTED, GAP, Array, axes_size, ink, note, plain, show_dates

FEW_KNOTS, _TICKS = 40, 300
"""The largest numbers of knots that have lines, and ticks."""
_UNITS = (172_800, 86_400, "d"), (7200, 3600, "h"), (100, 60, "min"), (0, 1, "s")
"""The least number of seconds for which a unit is used, its length in seconds, and its name."""
_WIDE = 7
"""Width in inches of axes with more dates."""


@dataclass(frozen=True)
class Panel:
    """Axes into which a picture is drawn.

    Attributes
    ----------
    axes : list of Axes
        As many as the view has rows on a page, or those of the user.
    mine : bool
        Whether they are on a page; axes of the user keep their style.
    """

    axes: list[Axes]
    mine: bool

    def explain(self, words: str) -> None:
        """Explain symbols above axes with a time axis on a page, and below axes of the user."""
        if words and self.mine:
            self.axes[0].set_title(words, loc="left", fontsize="small", weight="normal", pad=3)
        elif words:
            note(self.axes[0], words)


class View(NamedTuple):
    """What is drawn of the curves on a space.

    Attributes
    ----------
    draw : callable
        Draws curves into a panel.
    width, height : float
        Size in inches if the view is the only one. Speed and acceleration are beside it, or below a view that is much
        wider than high.
    rows : int
        Number of axes one below the other, or side by side if they have no time axis.
    is_time : bool
        Whether the axes have a time axis.
    projection : {None, "3d"}
        Projection of the axes.
    has_band : bool
        Whether the view shows uncertainty bands.
    has_many : bool
        Whether it shows all curves of a batch.
    in_rows : bool
        Whether it has symbols in rows, one per curve, so that later curves would overlap them.
    is_turned : bool
        Whether the direction of view depends on the curves, so that later ones cannot be added.
    """

    draw: Callable[[Panel, Sequence[Curve]], None]
    width: float = 5.2
    height: float = 5.2
    rows: int = 1
    is_time: bool = False
    projection: str | None = None
    has_band: bool = False
    has_many: bool = False
    in_rows: bool = False
    is_turned: bool = False

    @property
    def is_wide(self) -> bool:
        """Whether speed and acceleration are below the view."""
        return self.width > 1.5 * self.height

    def draw_into(self, panel: Panel, curves: Sequence[Curve]) -> None:
        """Draw those of the curves that the view shows."""
        if not self.has_many:
            curves = [curve for curve in curves if not curve.faint]
        self.draw(panel, curves if self.in_rows else [part for curve in curves for part in curve.unbroken])


def timeline(draw: Callable[[Panel, Sequence[Curve]], None], height: float = 3.2, rows: int = 1, **more: Any) -> View:
    """Return a view with a time axis."""
    return View(draw, 10.5, height, rows, is_time=True, **more)


def time_axes(panel: Panel, curves: Sequence[Curve], labels: Sequence[str], marked: bool = True) -> list[Axes]:
    """Give the axes of a panel the time axis of curves, and a label of the vertical axis each.

    Unless `marked` is False, they show the times of the given points and long gaps.
    """
    axis = curves[0].axis
    if not panel.mine:
        (axes,) = panel.axes
        axes.set(xlabel=axes.get_xlabel() or axis.name, ylabel=axes.get_ylabel() or labels[0])
        if axis.dates:
            show_dates(axes.xaxis, 3, 7)
        _mark_gaps(axes, curves)
        return [axes]
    first, last = min(curve.times[0] for curve in curves), max(curve.times[-1] for curve in curves)
    for i, (axes, label) in enumerate(zip(panel.axes, labels, strict=True)):
        width, height = axes_size(axes)
        is_lowest = i == len(labels) - 1
        plain(axes)
        axes.set_gid("time")
        axes.grid(visible=False, axis="x")
        axes.set_ylabel(label)
        axes.yaxis.set_major_locator(
            MaxNLocator(int(np.clip(height / 0.3, 4, 9)), steps=[1, 2, 2.5, 5, 10], min_n_ticks=3)
        )
        axes.set_xlim(first - 0.01 * (last - first), last + 0.01 * (last - first))
        if axis.dates:
            # For some spans the locator does not find an interval between narrower limits.
            show_dates(axes.xaxis, *((3, 10) if width > _WIDE else (2, 5)))
        axes.set_xlabel(axis.name if is_lowest else "")
        axes.tick_params(labelbottom=is_lowest)
        axes.xaxis.offsetText.set_visible(is_lowest)
        if marked:
            mark_knots(axes, curves)
            _mark_gaps(axes, curves)
    return panel.axes


def mark_knots(axes: Axes, curves: Sequence[Curve]) -> None:
    """Mark knots by thin lines, or by short ticks if lines would be too many. Noisy data have short ticks."""
    knots = np.unique(np.concatenate([curve.marks for curve in curves if not curve.faint]))
    lines = len(knots) <= FEW_KNOTS and curves[0].noise is None
    if len(knots) <= _TICKS:
        look: Any = {"transform": axes.get_xaxis_transform(), "color": ink(0.4), "linewidth": 0.8, "zorder": 1}
        look |= {"linestyle": DOTTED if lines else "-", "label": fresh(axes, curves[0].name_of_marks)}
        axes.vlines(knots, 0, 1.0 if lines else 0.04, **look)


def _mark_gaps(axes: Axes, curves: Sequence[Curve]) -> None:
    """Shade long gaps that all curves have."""
    gaps = common_gaps(curves)
    if not len(gaps):
        return
    label = f"{_lengths(gaps, curves[0].axis)} without data"
    if not any(len(own.breaks) for own in curves):
        banded = curves[0].noise is not None and curves[0].noise.speed is not None
        label += f", {'acceleration' if banded else 'rates'} not drawn"
    spans = [(start, end - start) for start, end in gaps.tolist()]
    look: Any = {"transform": axes.get_xaxis_transform(), "facecolor": GAP, "linewidth": 0, "zorder": 0.5}
    axes.broken_barh(spans, (0, 1), label=fresh(axes, label), **look)


def _lengths(gaps: Array, axis: Axis) -> str:
    """Describe the lengths of gaps, given on matplotlib's axis, in seconds if the axis has a unit."""
    longest = float(np.diff(gaps).max()) * (86_400 if axis.dates else 1)
    length = f"{longest:.3g}"
    if axis.seconds:
        unit, name = next((unit, name) for least, unit, name in _UNITS if longest >= least)
        length = f"{longest / unit:.3g} {name}"
    return f"gap of {length}" if len(gaps) == 1 else f"gaps of up to {length}"

"""Symbols in rows along a time axis, such as frames and ellipses.

The only curve of a figure has two rows: its given points, and the curve at equidistant times. Curves of a batch have
one row each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.transforms import Affine2D

from .curves import Curve
from .graphs import timelines
from .style import INK, OWN_AXES, Array, apart, axes_size, evenly, points

VIEW = np.array([[-0.5, 0.866, 0.0], [-0.296, -0.171, 0.940], [0.814, 0.470, 0.342]])
"""Directions to the right, up and towards the viewer, who sees the first axis point forwards and the third up."""
REACH = 0.5
"""The largest distance in inches by which a symbol extends to the left and right, which the margins have space for."""

_TOP, _LEAST = 0.65, 0.6
"""Margin at the top, and the smallest height of a row in inches."""


@dataclass(frozen=True)
class Row:
    """One row.

    Attributes
    ----------
    curve : Curve
        Curve of the row.
    name : {"given", "data", "curve", ""}
        Whether the row has given points, noisy data or samples of the curve; empty for a curve of a batch.
    """

    curve: Curve
    name: str

    def count(self, width: float, reach: float) -> str:
        """Describe how many of the given points have a symbol, if not all have."""
        shown, given = len(self.symbols(width, reach)[0]), len(self.curve.given)
        return f"{shown} of {given}" if self.has_given and shown < given else ""

    @property
    def has_given(self) -> bool:
        """Whether the symbols are given points."""
        return self.name in ("given", "data") or not self.curve.has_line

    def symbols(self, width: float, reach: float) -> tuple[Array, Any, Array | None]:
        """Return times on matplotlib's axis, points, and the radii of the band, for symbols that fit into the row.

        The time axis has ``width`` inches, and symbols extend by at most ``reach`` inches to the left and right. Given
        points that are close together are omitted; samples of the curve are equidistant. If all given points have a
        symbol, the curve has one below each of them, and equidistant ones between.
        """
        curve = self.curve
        if self.has_given:
            times = curve.on_axis(curve.given_x)
            kept = apart(times, 1.1 * reach / width * (curve.times[-1] - curve.times[0]))
            return times[kept], curve.given[kept], None
        number = max(2, int(width / (2 * reach)) + 1)
        wanted = np.linspace(curve.x[0], curve.x[-1], number)
        step = wanted[1] - wanted[0]
        nodes = curve.x[curve.knots]
        if curve.noise is None and curve.has_nodes and self.name and np.diff(nodes).min(initial=np.inf) > 0.55 * step:
            inner = [np.linspace(*ends, 1 + max(1, int((ends[1] - ends[0]) / step + 0.6))) for ends in pairwise(nodes)]
            wanted = np.unique(np.concatenate(inner))
        even = np.searchsorted(curve.x, wanted)
        # There are no samples in gaps.
        even = np.unique(even[curve.x[even] - wanted < 0.1 * step])
        # Short segments have a symbol, too.
        bounds = np.searchsorted(curve.x, [[part.x[0], part.x[-1]] for part in curve.unbroken])
        empty = [(first + last) // 2 for first, last in bounds if not ((even >= first) & (even <= last)).any()]
        even = np.union1d(even, np.array(empty, int))
        return curve.times[even], curve.points[even], None if curve.radii is None else curve.radii[even]


@dataclass(frozen=True)
class Rows:
    """Axes with rows of symbols. Row i is at height −i.

    Attributes
    ----------
    axes : Axes
        The axes.
    rows : list of Row
        The rows.
    width, height : float
        Length of the time axis, and height of a row, in inches.
    """

    axes: Axes
    rows: list[Row]
    width: float
    height: float

    @classmethod
    def of(cls, panel: SubFigure, curves: Sequence[Curve]) -> Rows:
        """Add axes to a panel, with as many rows as fit."""
        (axes,) = timelines(panel, curves, [""], top=_TOP)
        width, high = axes_size(axes)
        if axes in OWN_AXES:
            # Other axes have margins for the symbols at both ends.
            start, stop = min(curve.times[0] for curve in curves), max(curve.times[-1] for curve in curves)
            margin = REACH * (stop - start) / max(width - 2 * REACH, 1.0)
            axes.set_xlim(start - margin, stop + margin)
            width = max(width - 2 * REACH, 1.0)
        first = curves[0]
        if len(curves) == 1 and first.has_line:
            rows = [Row(first, "curve")]
            if len(first.given) and (first.noise is not None or first.has_nodes) and not first.is_mean:
                rows.insert(0, Row(first, "given" if first.noise is None else "data"))
        else:
            rows = [Row(curves[i], "") for i in evenly(len(curves), max(1, int(high // _LEAST)))]
        axes.set_ylim(0.5 - len(rows), 0.5)
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
        return cls(axes, rows, width, high / len(rows))

    def reach_between(self) -> float:
        """Return the reach of symbols of which one fits between any two given points."""
        row = self.rows[-1]
        return self.width / (4.2 * len(row.curve.given)) if row.name == "curve" and row.curve.noise is None else REACH

    def symbols(self, i: int, reach: float) -> tuple[Array, Any, Array | None]:
        """Name a row, and return its symbols, which extend by at most ``reach`` inches; see `Row.symbols`."""
        row = self.rows[i]
        times, symbols, radii = row.symbols(self.width, reach)
        look: Any = {"transform": self.axes.get_yaxis_transform(), "clip_on": False}
        left = -0.9 / self.width
        if self.axes in OWN_AXES:
            names = [
                "\n".join(
                    filter(None, (": ".join(filter(None, (own.curve.label, own.name))), own.count(self.width, reach)))
                )
                for own in self.rows
            ]
            self.axes.set_yticks([-k for k in range(len(names))], names)
            self.axes.tick_params(axis="y", length=0)
            return times, symbols, radii
        if not row.name and row.curve.label:
            name = "\n".join(
                filter(
                    None,
                    ("\n".join(wrap(row.curve.label, 13, max_lines=3, placeholder=" …")), row.count(self.width, reach)),
                )
            )
            self.axes.text(left, -i, name, color=row.curve.color, fontsize=points(9), va="center", **look)
            return times, symbols, radii
        if not row.name:
            self.axes.plot([left, left + 0.2 / self.width], [-i, -i], color=row.curve.color, linewidth=3, **look)
            return times, symbols, radii
        look |= {"color": INK, "fontsize": points(9)}
        self.axes.text(left, -i, "mean\ncurve" if row.curve.is_mean else row.name, va="bottom", **look)
        self.axes.text(left, -i, row.count(self.width, reach), va="top", **look | {"fontsize": points(8)})
        return times, symbols, radii

    def in_inches(self, times: Array, row: int) -> dict[str, Any]:
        """Return the options of a collection with paths in inches around times in a row."""
        return {
            "offsets": np.column_stack([times, np.full(len(times), -row)]),
            "offset_transform": self.axes.transData,
            "transform": Affine2D() + self.axes.figure.dpi_scale_trans,
            "clip_on": False,
        }

    def draw_view(self) -> None:
        """Draw the axes of space above the right corner, as they are seen. Axes of the user have no space for them."""
        if self.axes in OWN_AXES:
            return
        axes, inches = self.axes, np.array([1 / self.width, 1 / (self.height * len(self.rows))])
        foot = np.array([1.0, 1.0]) + [0.05, 0.24] * inches
        look: Any = {"xycoords": "axes fraction", "color": INK, "ha": "center", "va": "center"}
        arrow: Any = {"arrowstyle": "-|>,head_width=0.12,head_length=0.25", "color": INK, "linewidth": 0.9}
        arrow |= {"shrinkA": 0, "shrinkB": 0}
        for name, end in zip(("x₁", "x₂", "x₃"), VIEW[:2].T, strict=True):
            axes.annotate(
                "", tuple(foot + 0.26 * end * inches), tuple(foot), xycoords="axes fraction", arrowprops=arrow
            )
            axes.annotate(name, tuple(foot + 0.38 * end * inches), fontsize=points(8), **look)
        axes.annotate("view", tuple(foot + [-0.35, 0.2] * inches), fontsize=points(9), **look)

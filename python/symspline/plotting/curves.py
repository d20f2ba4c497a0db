"""Curves, sampled to be drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from .._core import ValidationError
from ..curves.curve import Curve as Data
from ..spaces import Space
from .style import DATES, INK, colors

Doubles = NDArray[np.float64]

_SECOND = np.timedelta64(1, "s")
_LONG = 10
"""So many times the median is a long gap between points."""
MOST = 50
"""The largest number of curves of a batch that are drawn."""


class Spline(Protocol):
    """What is asked of a spline that is to be drawn: a `symspline.CubicSpline` or `symspline.HermiteSpline`."""

    _curve: Data

    @property
    def _kind(self) -> str:
        """What it is called."""

    @property
    def _ends(self) -> str:
        """What its velocities follow from."""

    @property
    def _unconverged(self) -> int:
        """How many curves have not converged."""

    @property
    def t(self) -> NDArray[Any]:
        """The knots as they were given."""

    @property
    def space(self) -> Space:
        """The space."""


@dataclass(frozen=True)
class Curve:
    """One curve and how it is drawn.

    Attributes:
        data: one curve, not a batch.
        first: its first knot as it was given.
        x: times, as the core counts them; among them all knots.
        color: of its line.
        alone: whether it is the only curve of the figure.
        start: the first date of all, if times are dates.
        dates: whether time axes show dates: matplotlib's are good to a microsecond.
    """

    data: Data
    first: Any
    x: Doubles
    color: Any
    alone: bool
    start: Any
    dates: bool

    @property
    def space(self) -> Space:
        """Where the curve runs."""
        return self.data.space

    @property
    def given(self) -> Any:
        """The given points."""
        return self.data.points

    @cached_property
    def points(self) -> Any:
        """The points at the times x."""
        return self._at("point")

    @cached_property
    def speed(self) -> Doubles:
        """|γ'| at the times x."""
        speed: Doubles = self._at("speed")
        return speed

    @cached_property
    def bend(self) -> Doubles:
        """|∇γ'| at the times x."""
        bend: Doubles = self._at("bend")
        return bend

    @cached_property
    def times(self) -> Doubles:
        """The times x where matplotlib puts them on an axis."""
        first, since = self.first, self.x - self.x[0]
        if self.dates:
            return np.asarray(DATES.date2num(first + np.rint(1e6 * since).astype("timedelta64[us]")))
        if self.start is not None:
            first = (first - self.start) / _SECOND
        return np.asarray(float(first) + since)

    @property
    def knots(self) -> slice:
        """Where the knots are among the times x."""
        return slice(None, None, (len(self.x) - 1) // (self.data.times.size - 1))

    @cached_property
    def gaps(self) -> Doubles:
        """Starts and ends on a time axis of the gaps between points that are far longer than most, shape (m, 2)."""
        knots = self.times[self.knots]
        gaps = np.diff(knots)
        long = gaps > _LONG * np.median(gaps)
        return np.stack([knots[:-1][long], knots[1:][long]], axis=1)

    def picked(self, number: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Which of the times x to draw something large at: at most ``number`` knots, and times in between."""
        knots = np.arange(len(self.x))[self.knots]
        bold = knots[np.unique(np.linspace(0, len(knots) - 1, min(len(knots), number)).astype(int))]
        even = np.linspace(self.x[0], self.x[-1], number)
        gap = np.abs(even[:, None] - self.x[bold]).min(axis=1)
        between = np.searchsorted(self.x, even[gap > 0.6 * (even[1] - even[0])])
        return bold, between

    @property
    def time_name(self) -> str:
        """What is written below a time axis."""
        if self.dates:
            return ""
        return "t" if self.start is None else f"seconds since {self.start}"

    def part(self, number: int) -> Curve:
        """The curve in one factor of a product."""
        return replace(self, data=self.data.parts[number])

    def _at(self, quantity: str) -> Any:
        return self.data.evaluate(self.x, quantity, "raise", False)

    # ---- on axes of two or three dimensions ----

    def draw_line(self, axes: Axes, places: Doubles, **look: Any) -> None:
        """A line through places of shape (m, 2) or (m, 3)."""
        look = {"color": self.color, "linewidth": 2.4 if self.alone else 1.4, "zorder": 4} | look
        axes.plot(*places.T, **look)

    def draw_dots(self, axes: Axes, places: Doubles, **look: Any) -> None:
        """The given points, shape (N+1, 2) or (N+1, 3); the first is white."""
        size = float(np.clip(30 / np.sqrt(len(places)), 2, 6.5)) * (1 if self.alone else 0.6)
        color = INK if self.alone else self.color
        look = {"color": color, "markersize": size, "markeredgecolor": color, "zorder": 6} | look
        axes.plot(*places.T, "o", **look)
        axes.plot(*places[:1].T, "o", **look | {"color": "white", "markeredgewidth": 1.2})


def curves_of(spline: Spline) -> tuple[list[Curve], str]:
    """The curves to draw, and in words which they are.

    Raises:
        ValidationError: no curve is finite.
    """
    batch = spline._curve.batch
    everything = int(np.prod(batch))
    good = np.flatnonzero(_finite(spline._curve))
    if not good.size:
        raise ValidationError(
            "there is nothing to plot: the fit failed (a cut-locus fault, see spline.report)"
        )
    chosen = good[np.unique(np.linspace(0, len(good) - 1, min(len(good), MOST)).astype(int))]
    number = f"{len(chosen)} of {everything}" if len(chosen) < everything else f"{everything}"
    alone = len(chosen) == 1
    start = spline.t.min() if spline.t.dtype.kind == "M" else None
    dates = start is not None and bool((spline.t.max() - start) / _SECOND > 1e-3)
    firsts = np.broadcast_to(spline.t, (*batch, spline.t.shape[-1]))[..., 0]
    curves = []
    for i, color in zip(chosen, colors(len(chosen)), strict=True):
        index = np.unravel_index(i, batch)
        data = _pick(spline._curve, index)
        curves.append(Curve(data, firsts[index], _samples(data.times), color, alone, start, dates))
    return curves, f"{number} curves, " if batch else ""


def _finite(data: Data) -> NDArray[np.bool_]:
    """Which curves are finite, one after the other."""
    start = np.broadcast_to(data.times, (*data.batch, data.times.shape[-1]))[..., :1]
    finite: NDArray[np.bool_] = np.isfinite(
        data.evaluate(np.ascontiguousarray(start), "speed", "raise", True)
    )
    return finite.ravel()


def _pick(data: Data, index: Sequence[Any]) -> Data:
    """One curve of a batch."""
    for i in index:
        data = data.picked(i)
    return data


def _samples(knots: Doubles) -> Doubles:
    """Times that divide every segment evenly."""
    segments = len(knots) - 1
    number = max(1200 // segments, 16 if segments <= 10_000 else 1)
    inner = knots[:-1, None] + np.diff(knots)[:, None] * np.arange(number) / number
    return np.append(inner.ravel(), knots[-1])

"""Curves, sampled to be drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from .._core import ValidationError
from ..curves.curve import Curve as Data
from ..curves.noise import Noise
from ..report import long_gaps
from ..spaces import Space
from .style import DATA, DATES, INK, colors

Doubles = NDArray[np.float64]

_SECOND = np.timedelta64(1, "s")
MOST = 50
"""The largest number of curves of a batch that are drawn."""
FEW = 5
"""The largest number of those whose noisy data are drawn."""


class Spline(Protocol):
    """What is asked of a spline that is to be drawn: a `symspline.CubicSpline` or `symspline.HermiteSpline`."""

    _curve: Data

    @property
    def _kind(self) -> str:
        """What it is called."""

    @property
    def _made_of(self) -> str:
        """What it is made of."""

    def _noise_beside(self, index: tuple[int, ...], x: Doubles) -> Noise | None:
        """Noisy data near one curve, and its bands at times x."""

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
        noise: noisy data that are not on the curve, and bands at the times x; None where the knots are the data.
        shown: whether those are drawn.
    """

    data: Data
    first: Any
    x: Doubles
    color: Any
    alone: bool
    start: Any
    dates: bool
    noise: Noise | None = None
    shown: bool = True

    @property
    def space(self) -> Space:
        """Where the curve runs."""
        return self.data.space

    @property
    def given(self) -> Any:
        """The given points: those at the knots, or noisy data that are drawn."""
        if self.noise is None:
            return self.data.points
        (points,) = self.noise.points
        return points if self.shown else points[:0]

    @property
    def given_x(self) -> Doubles:
        """Their times, as the core counts them."""
        if self.noise is None:
            return self.x[self.knots]
        return self.noise.x if self.shown else self.noise.x[:0]

    @property
    def radii(self) -> Doubles | None:
        """Radii at the times x of the band around the curve, if it has one that is drawn."""
        return self.noise.radii[0] if self.noise is not None and self.shown else None

    @property
    def extent(self) -> Any:
        """All points for which there must be room."""
        return self.points if self.noise is None else np.concatenate([self.points, self.given])

    def marked(self, numbers: Callable[[Any], Doubles]) -> tuple[Doubles, Doubles]:
        """What a function makes of the points at the times x, one row a point, and of the given points."""
        line = numbers(self.points)
        if self.noise is None:
            return line, line[self.knots]
        return line, numbers(self.given) if len(self.given) else line[:0]

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
        return self.on_axis(self.x)

    def on_axis(self, x: Doubles) -> Doubles:
        """Where matplotlib puts times on an axis."""
        first, since = self.first, x - self.x[0]
        if self.dates:
            return np.asarray(DATES.date2num(first + np.rint(1e6 * since).astype("timedelta64[us]")))
        if self.start is not None:
            first = (first - self.start) / _SECOND
        return np.asarray(float(first) + since)

    @cached_property
    def knots(self) -> NDArray[np.intp]:
        """Where the knots are among the times x."""
        return np.searchsorted(self.x, self.data.times)

    @cached_property
    def gaps(self) -> Doubles:
        """Starts and ends on a time axis of the gaps between points that are far longer than most, shape (m, 2)."""
        times = self.marks
        long = long_gaps(times)
        return np.stack([times[:-1][long], times[1:][long]], axis=1)

    @cached_property
    def marks(self) -> Doubles:
        """The times of given points, also of data that are not drawn, on a time axis."""
        return self.times[self.knots] if self.noise is None else self.on_axis(np.unique(self.noise.x))

    def picked(self, number: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Which of the times x to draw something large at: at most ``number`` knots, and times in between.

        Of noisy data times next to those of some data, see `picked_data`, and none in between.
        """
        if self.noise is not None:
            some = self.given_x[self.picked_data(number)]
            wanted = some if len(some) else np.linspace(self.x[0], self.x[-1], number)
            return np.unique(self._nearest(wanted)), np.empty(0, np.intp)
        knots = self.knots
        bold = knots[np.unique(np.linspace(0, len(knots) - 1, min(len(knots), number)).astype(int))]
        even = np.linspace(self.x[0], self.x[-1], number)
        gap = np.abs(even[:, None] - self.x[bold]).min(axis=1)
        between = np.searchsorted(self.x, even[gap > 0.6 * (even[1] - even[0])])
        return bold, between

    def picked_data(self, number: int) -> NDArray[np.intp]:
        """At most ``number`` of the noisy data, evenly in time; none of other curves."""
        if self.noise is None or not len(self.given_x):
            return np.empty(0, np.intp)
        even = np.linspace(self.given_x[0], self.given_x[-1], number)
        return np.unique(np.abs(self.given_x[:, None] - even).argmin(axis=0))

    def _nearest(self, x: Doubles) -> NDArray[np.intp]:
        """Which of the times x are next to these."""
        after = np.clip(np.searchsorted(self.x, x), 1, len(self.x) - 1)
        return np.where(x - self.x[after - 1] < self.x[after] - x, after - 1, after)

    def beside(self, line: Doubles) -> Doubles:
        """The rows of samples of the curve that are next to the given points in time."""
        return line[self._nearest(self.given_x)]

    @property
    def time_name(self) -> str:
        """What is written below a time axis."""
        if self.dates:
            return ""
        return "t" if self.start is None else f"seconds since {self.start}"

    def part(self, number: int) -> Curve:
        """The curve in one factor of a product."""
        noise = None if self.noise is None else self.noise.part(number)
        return replace(self, data=self.data.parts[number], noise=noise)

    def _at(self, quantity: str) -> Any:
        return self.data.evaluate(self.x, quantity, "raise", False)

    # ---- on axes of two or three dimensions ----

    def draw_line(self, axes: Axes, places: Doubles, **look: Any) -> None:
        """A line through places of shape (m, 2) or (m, 3)."""
        # Bands are narrow, and must show beside it.
        width = 1.4 if not self.alone else 2.4 if self.noise is None else 1.8
        look = {"color": self.color, "linewidth": width, "zorder": 4} | look
        axes.plot(*places.T, **look)

    def draw_dots(self, axes: Axes, places: Doubles, **look: Any) -> None:
        """The given points, shape (N+1, 2) or (N+1, 3); the first is white. Noisy data are small and light."""
        if self.noise is not None:
            size = float(np.clip(25 / np.sqrt(max(len(places), 1)), 1.5, 3.5))
            dots: Any = {"color": DATA if self.alone else self.color, "alpha": 0.75 if self.alone else 0.4}
            axes.plot(
                *places.T, "o", **dots | {"markersize": size, "markeredgewidth": 0, "zorder": 3.5} | look
            )
            return
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
    if not everything:
        raise ValidationError("there is nothing to plot: the batch has no curves")
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
    few = chosen[np.unique(np.linspace(0, len(chosen) - 1, min(len(chosen), FEW)).astype(int))]
    curves = []
    for i, color in zip(chosen, colors(len(chosen)), strict=True):
        index = tuple(map(int, np.unravel_index(i, batch)))
        data = _pick(spline._curve, index)
        x = _samples(data.times)
        noise = spline._noise_beside(index, x)
        curves.append(Curve(data, firsts[index], x, color, alone, start, dates, noise, bool(i in few)))
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
    """Times that divide every segment evenly, long ones more finely."""
    segments, lengths = len(knots) - 1, np.diff(knots)
    least = max(1200 // segments, 16 if segments <= 10_000 else 1)
    numbers = np.maximum(least, np.ceil(1200 * lengths / np.ptp(knots))).astype(int)
    segment = np.repeat(np.arange(segments), numbers)
    step = np.arange(len(segment)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    return np.append(knots[segment] + lengths[segment] * step / numbers[segment], knots[-1])

"""Curves, sampled to be drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from .._core import ValidationError
from .._curves.band import UncertaintyBand
from .._curves.curve import CurveArrays as Data
from .._report import long_gaps
from .._spaces import Space
from .style import DATA, DATES, INK, Array, Indices, colors, evenly

_SECOND = np.timedelta64(1, "s")
MOST = 50
"""The largest number of curves of a batch that are drawn."""
FEW = 5
"""The largest number of those whose noisy data are drawn."""


class Spline(Protocol):
    """The interface of a spline that can be drawn, such as a `symspline.CubicSpline`.

    Attributes:
        _kind: its name in the title.
        _made_of: a description of its data.
        _unconverged: the number of curves that have not converged.
    """

    _curve: Data

    @property
    def _kind(self) -> str: ...
    @property
    def _made_of(self) -> str: ...
    @property
    def _unconverged(self) -> int: ...
    @property
    def t(self) -> NDArray[Any]: ...
    @property
    def space(self) -> Space[Any]: ...
    def _noise_beside(self, index: tuple[int, ...], x: Array) -> UncertaintyBand | None: ...


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
        dates: whether time axes show dates: those of Matplotlib are good to a microsecond.
        noise: noisy data that are not on the curve, and bands at the times x; None where the knots are the data.
        shown: whether those are drawn.
    """

    data: Data
    first: Any
    x: Array
    color: Any
    alone: bool
    start: Any
    dates: bool
    noise: UncertaintyBand | None = None
    shown: bool = True

    @property
    def space(self) -> Space:
        """The space of the curve."""
        return self.data.space

    @property
    def given(self) -> Any:
        """The given points: those at the knots, or noisy data that are drawn."""
        return self.data.points if self.noise is None else self.noise.points[0][: None if self.shown else 0]

    @property
    def given_x(self) -> Array:
        """Their times, as the core counts them."""
        return self.x[self.knots] if self.noise is None else self.noise.x[: None if self.shown else 0]

    @property
    def radii(self) -> Array | None:
        """Radii at the times x of the band around the curve, if it has one that is drawn."""
        return self.noise.radii[0] if self.noise is not None and self.shown else None

    @property
    def extent(self) -> Any:
        """All points that the picture must contain."""
        return self.points if self.noise is None else np.concatenate([self.points, self.given])

    def marked(self, numbers: Callable[[Any], Array]) -> tuple[Array, Array]:
        """A function of the points at the times x, one row per point, and of the given points."""
        line = numbers(self.points)
        if self.noise is None:
            return line, line[self.knots]
        return line, numbers(self.given) if len(self.given) else line[:0]

    @cached_property
    def points(self) -> Any:
        """The points at the times x."""
        return self.at("point")

    @cached_property
    def times(self) -> Array:
        """The times x where Matplotlib puts them on an axis."""
        return self.on_axis(self.x)

    def on_axis(self, x: Array) -> Array:
        """Where Matplotlib puts times on an axis."""
        first, since = self.first, x - self.x[0]
        if self.dates:
            return np.asarray(DATES.date2num(first + np.rint(1e6 * since).astype("timedelta64[us]")))
        return np.asarray(float(first if self.start is None else (first - self.start) / _SECOND) + since)

    @cached_property
    def knots(self) -> Indices:
        """Where the knots are among the times x."""
        return np.searchsorted(self.x, self.data.times)

    @cached_property
    def gaps(self) -> Array:
        """Starts and ends on a time axis of the gaps between points that are far longer than most, shape (m, 2)."""
        long = long_gaps(self.marks)
        return np.stack([self.marks[:-1][long], self.marks[1:][long]], axis=1)

    @cached_property
    def marks(self) -> Array:
        """The times of given points, also of data that are not drawn, on a time axis."""
        return self.times[self.knots] if self.noise is None else self.on_axis(np.unique(self.noise.x))

    def samples(self, number: int) -> dict[str, tuple[Array, Any]]:
        """At most ``number`` times on an axis and points at which to draw something large.

        The group "bold" is drawn at knots, "between" evenly between them. For noisy data "bold" is next to some data,
        the group "data" are those data, and nothing is between.
        """
        even = np.linspace(self.x[0], self.x[-1], number)
        if self.noise is None:
            bold = self.knots[evenly(len(self.knots), number)]
            gap = np.abs(even[:, None] - self.x[bold]).min(axis=1)
            between = np.searchsorted(self.x, even[gap > 0.6 * (even[1] - even[0])])
        else:
            given, between = self.given_x, np.empty(0, np.intp)
            data = np.empty(0, np.intp)
            if len(given):
                even = np.linspace(given[0], given[-1], number)
                data = np.unique(np.abs(given[:, None] - even).argmin(axis=0))
                even = given[data]
            bold = np.unique(self._nearest(even))
        groups = {
            "between": (self.times[between], self.points[between]),
            "bold": (self.times[bold], self.points[bold]),
        }
        if self.noise is not None:
            groups["data"] = self.on_axis(given[data]), self.given[data]
        return groups

    def _nearest(self, x: Array) -> Indices:
        """Which of the times x are next to these."""
        after = np.clip(np.searchsorted(self.x, x), 1, len(self.x) - 1)
        return np.where(x - self.x[after - 1] < self.x[after] - x, after - 1, after)

    def beside(self, line: Array) -> Array:
        """The rows of samples of the curve that are next to the given points in time."""
        return line[self._nearest(self.given_x)]

    @property
    def time_name(self) -> str:
        """The label of a time axis."""
        return "" if self.dates else "t" if self.start is None else f"seconds since {self.start}"

    def part(self, number: int) -> Curve:
        """The curve in one factor of a product."""
        noise = None if self.noise is None else self.noise.part(number)
        return replace(self, data=self.data.parts[number], noise=noise)

    def at(self, quantity: str) -> Any:
        """A quantity at the times x."""
        return self.data.evaluate(self.x, quantity, "raise", False)

    # ---- on axes of two or three dimensions ----

    def draw_line(self, axes: Axes, places: Array, **look: Any) -> None:
        """A line through places of shape (m, 2) or (m, 3)."""
        # Bands are narrow, and must show beside it.
        width = 1.4 if not self.alone else 2.4 if self.noise is None else 1.8
        axes.plot(*places.T, **{"color": self.color, "linewidth": width, "zorder": 4} | look)

    def draw_dots(self, axes: Axes, places: Array, **look: Any) -> None:
        """The given points, shape (N+1, 2) or (N+1, 3); the first is white. Noisy data are small and light."""
        if self.noise is not None:
            size = float(np.clip(25 / np.sqrt(max(len(places), 1)), 1.5, 3.5))
            dots: Any = {"color": DATA if self.alone else self.color, "alpha": 0.75 if self.alone else 0.4}
            dots |= {"markersize": size, "markeredgewidth": 0, "zorder": 3.5}
            axes.plot(*places.T, "o", **dots | look)
            return
        size = float(np.clip(30 / np.sqrt(len(places)), 2, 6.5)) * (1 if self.alone else 0.6)
        color = INK if self.alone else self.color
        look = {"color": color, "markersize": size, "markeredgecolor": color, "zorder": 6} | look
        axes.plot(*places.T, "o", **look)
        axes.plot(*places[:1].T, "o", **look | {"color": "white", "markeredgewidth": 1.2})


def curves_of(spline: Spline) -> tuple[list[Curve], str]:
    """The curves to draw, and a description of them.

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
    drawn = good[evenly(len(good), MOST)]
    few = drawn[evenly(len(drawn), FEW)]
    start = spline.t.min() if spline.t.dtype.kind == "M" else None
    dates = start is not None and bool((spline.t.max() - start) / _SECOND > 1e-3)
    firsts = np.broadcast_to(spline.t, (*batch, spline.t.shape[-1]))[..., 0]
    curves = []
    for i, color in zip(drawn, colors(len(drawn)), strict=True):
        index = tuple(map(int, np.unravel_index(i, batch)))
        data = spline._curve
        for place in index:
            data = data.picked(place)
        x = _samples(data.times)
        noise = spline._noise_beside(index, x)
        alone = len(drawn) == 1
        curves.append(Curve(data, firsts[index], x, color, alone, start, dates, noise, bool(i in few)))
    number = f"{len(drawn)} of {everything}" if len(drawn) < everything else f"{everything}"
    return curves, f"{number} curves, " if batch else ""


def _finite(data: Data) -> NDArray[np.bool_]:
    """Which curves are finite, one after the other."""
    start = np.broadcast_to(data.times, (*data.batch, data.times.shape[-1]))[..., :1]
    finite: NDArray[np.bool_] = np.isfinite(
        data.evaluate(np.ascontiguousarray(start), "speed", "raise", True)
    )
    return finite.ravel()


def _samples(knots: Array) -> Array:
    """Times that divide every segment evenly, long ones more finely."""
    segments, lengths = len(knots) - 1, np.diff(knots)
    least = max(1200 // segments, 16 if segments <= 10_000 else 1)
    numbers = np.maximum(least, np.ceil(1200 * lengths / np.ptp(knots))).astype(int)
    segment = np.repeat(np.arange(segments), numbers)
    step = np.arange(len(segment)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    return np.append(knots[segment] + lengths[segment] * step / numbers[segment], knots[-1])

"""Curves with samples to draw, and bands around them in two-dimensional pictures. A band is a union of discs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from .._core import ValidationError
from .._curves.curve import CurveArrays as Data
from .._curves.curve import UncertaintyBand
from .._report import long_gaps
from .._spaces import Space
from .style import DATA, DATES, INK, Array, Indices, colors, evenly

_SECOND = np.timedelta64(1, "s")
MOST = 50
"""The largest number of curves of a batch that are drawn."""
FEW = 5
"""The largest number of curves whose noisy data are drawn."""

_SEGMENTS = 3
"""The smallest length of a gap between measurements of several kinds, in median segments."""
ALPHA = 0.22
_ANGLES = np.linspace(0, 2 * np.pi, 24, endpoint=False)
CIRCLE: Array = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=-1)
"""Positions on the unit circle."""


@dataclass(frozen=True)
class Curve:
    """A curve and its look.

    Attributes
    ----------
    data : CurveArrays
        A single curve.
    first : scalar
        First knot as the user gave it.
    x : ndarray
        Sampling times on the time axis of the core. They contain all knots.
    color : color
        Colour of the line.
    alone : bool
        Whether it is the only curve of the figure.
    start : datetime64 or None
        First date of all curves, if times are dates.
    dates : bool
        Whether time axes show dates, which matplotlib resolves to a microsecond.
    noise : UncertaintyBand or None
        Noisy data near the curve, and bands at the times x. None if the knots are the data.
    shown : bool
        Whether noisy data and bands are drawn.
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
        """Space of the curve."""
        return self.data.space

    @property
    def given(self) -> Any:
        """Given points: those at the knots, or noisy data that are drawn."""
        return self.data.points if self.noise is None else self.noise.points[0][: None if self.shown else 0]

    @property
    def given_x(self) -> Array:
        """Times of the given points on the time axis of the core."""
        return self.x[self.knots] if self.noise is None else self.noise.x[0][: None if self.shown else 0]

    @property
    def radii(self) -> Array | None:
        """Radii of the band at the times x; None if no band is drawn."""
        return self.noise.radii[0] if self.noise is not None and self.shown else None

    @property
    def extent(self) -> Any:
        """All points that the picture must contain."""
        return self.points if self.noise is None else np.concatenate([self.points, self.given])

    def marked(self, numbers: Callable[[Any], Array]) -> tuple[Array, Array]:
        """Apply a function to the points at the times x, one row per point, and to the given points."""
        line = numbers(self.points)
        if self.noise is None:
            return line, line[self.knots]
        return line, numbers(self.given) if len(self.given) else line[:0]

    @cached_property
    def points(self) -> Any:
        """Points at the times x."""
        return self.at("point")

    @cached_property
    def times(self) -> Array:
        """Positions of the times x on matplotlib's axis."""
        return self.on_axis(self.x)

    def on_axis(self, x: Array) -> Array:
        """Return the positions of times on matplotlib's axis."""
        first, since = self.first, x - self.x[0]
        if self.dates:
            return np.asarray(DATES.date2num(first + np.rint(1e6 * since).astype("timedelta64[us]")))
        return np.asarray(float(first if self.start is None else (first - self.start) / _SECOND) + since)

    @cached_property
    def knots(self) -> Indices:
        """Indices of the knots among the times x."""
        return np.searchsorted(self.x, self.data.times)

    @cached_property
    def gaps(self) -> Array:
        """Starts and ends, on matplotlib's axis, of gaps that are far longer than most; shape (m, 2).

        If several sensors report at different rates, only gaps that are also longer than some segments count.
        """
        x = self.data.times if self.noise is None else self.noise.times
        if len(x) < 3:
            return np.empty((0, 2))
        long = long_gaps(x)
        if self.noise is not None and len(self.noise.others):
            long &= np.diff(x) > _SEGMENTS * np.median(np.diff(self.data.times))
        at = self.on_axis(x)
        return np.stack([at[:-1][long], at[1:][long]], axis=1)

    @cached_property
    def marks(self) -> Array:
        """Times of all given points on matplotlib's axis, also of data that are not drawn."""
        if self.noise is None:
            return self.times[self.knots]
        return self.on_axis(np.unique(np.concatenate(self.noise.x)))

    def legend_of(self, given: str, curve: str, data: str) -> str:
        """Explain the large symbols: those of given points, or of the curve and of noisy data if there are any."""
        if self.noise is None:
            return given
        return f"{curve}, {data}" if len(self.noise.x[0]) else curve

    def samples(self, number: int) -> dict[str, tuple[Array, Any]]:
        """Return groups of times on matplotlib's axis and points, at which large symbols are drawn.

        The group "bold" has at most ``number`` knots; the group "between" is evenly spaced between them. For noisy
        data, the group "data" has some of the data, "bold" has the samples of the curve that are closest to them, and
        "between" is empty.
        """
        even = np.linspace(self.x[0], self.x[-1], number)
        if self.noise is None:
            bold = self.knots[evenly(len(self.knots), number)]
            gap = np.abs(even[:, None] - self.x[bold]).min(axis=1)
            between = np.searchsorted(self.x, even[gap > 0.6 * (even[1] - even[0])])
            return {name: (self.times[i], self.points[i]) for name, i in (("between", between), ("bold", bold))}
        x, points = self.given_x, self.given
        if len(x):
            data = np.unique(np.abs(x[:, None] - np.linspace(x[0], x[-1], number)).argmin(axis=0))
            x, points = x[data], points[data]
        bold = np.unique(self._nearest(x if len(x) else even))
        groups = {"between": (self.times[:0], self.points[:0]), "bold": (self.times[bold], self.points[bold])}
        return groups | {"data": (self.on_axis(x), points)}

    def _nearest(self, x: Array) -> Indices:
        """Return the indices of the times x that are closest to given times."""
        after = np.clip(np.searchsorted(self.x, x), 1, len(self.x) - 1)
        return np.where(x - self.x[after - 1] < self.x[after] - x, after - 1, after)

    def closest_samples(self, line: Array) -> Array:
        """Return the rows of samples of the curve that are closest in time to the given points."""
        return line[self._nearest(self.given_x)]

    @property
    def time_name(self) -> str:
        """Label of a time axis."""
        return "" if self.dates else "t" if self.start is None else f"seconds since {self.start}"

    def part(self, number: int) -> Curve:
        """Return the curve in one factor of a product space."""
        noise = None if self.noise is None else self.noise.part(number)
        return replace(self, data=self.data.parts[number], noise=noise)

    def at(self, quantity: str) -> Any:
        """Evaluate a quantity at the times x."""
        return self.data.evaluate(self.x, quantity, "raise", False)

    # ---- on axes of two or three dimensions ----

    def draw_line(self, axes: Axes, positions: Array, **look: Any) -> None:
        """Draw a line through positions of shape (m, 2) or (m, 3)."""
        # A narrow band must remain visible beside the line.
        width = 1.4 if not self.alone else 2.4 if self.noise is None else 1.8
        axes.plot(*positions.T, **{"color": self.color, "linewidth": width, "zorder": 4} | look)

    def draw_dots(self, axes: Axes, positions: Array, **look: Any) -> None:
        """Draw given points, shape (N+1, 2) or (N+1, 3). The first is white; noisy data are small and light."""
        if self.noise is not None:
            size = float(np.clip(25 / np.sqrt(max(len(positions), 1)), 1.5, 3.5))
            dots: Any = {"color": DATA if self.alone else self.color, "alpha": 0.75 if self.alone else 0.4}
            dots |= {"markersize": size, "markeredgewidth": 0, "zorder": 3.5}
            axes.plot(*positions.T, "o", **dots | look)
            return
        size = float(np.clip(30 / np.sqrt(len(positions)), 2, 6.5)) * (1 if self.alone else 0.6)
        color = INK if self.alone else self.color
        look = {"color": color, "markersize": size, "markeredgecolor": color, "zorder": 6} | look
        axes.plot(*positions.T, "o", **look)
        axes.plot(*positions[:1].T, "o", **look | {"color": "white", "markeredgewidth": 1.2})


def curves_of(spline: Any) -> tuple[list[Curve], str]:
    """Return the curves to draw, and a description of them.

    Raises
    ------
    ValidationError
        No curve is finite.
    """
    batch = spline._curve.batch
    everything = int(np.prod(batch))
    good = np.flatnonzero(_finite(spline._curve))
    if not everything:
        raise ValidationError("there is nothing to plot: the batch has no curves")
    if not good.size:
        raise ValidationError("there is nothing to plot: the fit failed (a cut-locus fault, see spline.report)")
    drawn = good[evenly(len(good), MOST)]
    few = drawn[evenly(len(drawn), FEW)]
    start = spline.t.min() if spline.t.dtype.kind == "M" else None
    dates = start is not None and bool((spline.t.max() - start) / _SECOND > 1e-3)
    firsts = np.broadcast_to(spline.t, (*batch, spline.t.shape[-1]))[..., 0]
    curves = []
    for i, color in zip(drawn, colors(len(drawn)), strict=True):
        index = tuple(map(int, np.unravel_index(i, batch)))
        data = reduce(lambda curves, k: curves.take_batch(k), index, spline._curve)
        x = _samples(data.times)
        noise = spline._noise_beside(index, x)
        alone = len(drawn) == 1
        curves.append(Curve(data, firsts[index], x, color, alone, start, dates, noise, bool(i in few)))
    number = f"{len(drawn)} of {everything}" if len(drawn) < everything else f"{everything}"
    return curves, f"{number} curves, " if batch else ""


def _finite(data: Data) -> NDArray[np.bool_]:
    """Return whether each curve is finite, in a flat array."""
    start = np.broadcast_to(data.times, (*data.batch, data.times.shape[-1]))[..., :1]
    return np.asarray(np.isfinite(data.evaluate(np.ascontiguousarray(start), "speed", "raise", True))).ravel()


def _samples(knots: Array) -> Array:
    """Return times that divide every segment evenly, with more of them in long segments."""
    segments, lengths = len(knots) - 1, np.diff(knots)
    least = max(1200 // segments, 16 if segments <= 10_000 else 1)
    numbers = np.maximum(least, np.ceil(1200 * lengths / np.ptp(knots))).astype(int)
    segment = np.repeat(np.arange(segments), numbers)
    step = np.arange(len(segment)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    return np.append(knots[segment] + lengths[segment] * step / numbers[segment], knots[-1])


# ---- bands ----


def draw_in_plane(
    axes: Axes, curve: Curve, flat: Callable[[Any], Array], rims: Callable[[Array, Array], Array]
) -> None:
    """Draw a curve in a map of a surface, with its band and its points.

    ``flat`` returns positions of points in the map. ``rims`` returns discs of given radii around such positions, shape
    (m, k, 2).
    """
    if curve.radii is not None:
        discs = disc_indices(curve)
        draw_tube(axes, curve, rims(flat(curve.points[discs]), curve.radii[discs]))
    curve.draw_line(axes, flat(curve.points))
    curve.draw_dots(axes, flat(curve.given))


def draw_graph_of(axes: Axes, curve: Curve, line: Array, given: Array, unit: float = 1.0) -> None:
    """Draw numbers against time with their band, and those of the given points. Radii are multiplied by ``unit``."""
    if curve.radii is not None:
        fill_band(axes, curve, line - unit * curve.radii, line + unit * curve.radii, zorder=3)
    curve.draw_line(axes, np.column_stack([curve.times, line]))
    curve.draw_dots(axes, np.column_stack([curve.on_axis(curve.given_x), given]))


def fill_band(axes: Axes, curve: Curve, low: Array, high: Array, **look: Any) -> None:
    """Draw a band against time."""
    look |= {"color": curve.color, "alpha": ALPHA, "linewidth": 0, "label": "band"}
    axes.fill_between(curve.times, low, high, **look)


def disc_indices(curve: Curve) -> Indices:
    """Return the samples of a curve at which a band has discs."""
    return evenly(len(curve.x), 500)


def draw_tube(axes: Axes, curve: Curve, rings: Array) -> None:
    """Fill discs along a curve, and the areas between neighbouring discs.

    ``rings`` are the rims of the discs, shape (m, k, 2). They are NaN where a disc is missing.
    """
    good: NDArray[np.bool_] = np.all(np.isfinite(rings), axis=(1, 2))
    if not good.any():
        return
    pairs = good[1:] & good[:-1]
    polygons = [_turned_left(rings[good])]
    if pairs.any():
        polygons.append(_between(rings[:-1][pairs], rings[1:][pairs]))
    # All polygons have the same orientation, so that overlapping areas are filled once.
    path = Path.make_compound_path(*map(Path.make_compound_path_from_polys, polygons))
    # ``add_patch`` would compute the extent of every side in a slow loop.
    axes.update_datalim(rings[good].reshape(-1, 2))
    axes.add_artist(PathPatch(path, facecolor=curve.color, alpha=ALPHA, linewidth=0, zorder=3, label="band"))


def _turned_left(rings: Array) -> Array:
    x, y = np.moveaxis(rings - rings.mean(axis=1, keepdims=True), -1, 0)
    area = np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
    return np.where((area < 0)[:, None, None], rings[:, ::-1], rings)


def _between(first: Array, second: Array) -> Array:
    """Return the quadrangles that touch two neighbouring discs on both sides."""
    along = second.mean(axis=1) - first.mean(axis=1)
    corners = []
    for rings in (first, second):
        aside = along[:, :1] * rings[..., 1] - along[:, 1:] * rings[..., 0]
        corners += [rings[np.arange(len(rings)), i] for i in (aside.argmin(axis=1), aside.argmax(axis=1))]
    right, left, next_right, next_left = corners
    return np.stack([right, next_right, next_left, left], axis=1)

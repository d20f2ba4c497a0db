"""Curves with samples to draw."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from numpy.typing import NDArray

from .._base.report import long_gaps
from .._curves.composed import AnyCurve
from .._curves.controlled import ControlledCurve
from .._curves.curve import UncertaintyBand
from .._spaces import Space
from .style import DATA, DATES, INK, SPLINE, Array, Indices, evenly

SECOND = np.timedelta64(1, "s")
_NO_GAPS: Array = np.empty((0, 2))
# Labels of artists that the legend of a page explains. Those with an underscore are not in legends of matplotlib.
LINE, DOTS, START, DATA_DOTS, FAINT = "_curve", "_given", "_start", "_data", "_others"
QUANTILES, BAND, BRIDGE, GAPS, POSES, BODIES = "_quantiles", "band", "_bridge", "gaps", "_poses", "_bodies"
KNOTS, TICKS, END, AFTER, CONTROL, BEHIND = "_knots", "_ticks", "_end", "_after", "_control", "_behind"
WITH_POLYGON = {"euclidean:2", "euclidean:3", "sphere:2", "hyperbolic:2", "cp:1"}
"""Spaces whose picture shows the control points of a curve."""
BODY: Array = np.array([[1.0, 0.0], [-0.7, 0.55], [-0.35, 0.0], [-0.7, -0.55], [1.0, 0.0]])
"""A body in the plane that points along its first axis."""
BODY_COLOR = "#cfe0ee"
MANY = 150
"""A larger number of points is drawn behind the curve, which they would hide."""
AFTER_COLOR = "#6aa5d8"
"""Colour of curves in space after their first long gap."""

_CLOSED = 1e-9
"""The largest distance of the ends of a closed curve, as a part of the largest component of its points."""
_SEGMENTS = 3
"""The smallest length of a gap between measurements of several kinds, in median segments."""
BEYOND = 0.15
"""How far pictures follow a curve into a long gap, as part of the extent of its data."""
ALPHA = 0.22
_ANGLES = np.linspace(0, 2 * np.pi, 24, endpoint=False)
CIRCLE: Array = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=-1)
"""Positions on the unit circle."""


@dataclass(frozen=True)
class Axis:
    """The time axis that all curves of a figure share.

    Attributes
    ----------
    dates : bool
        Whether it shows dates, which matplotlib resolves to a microsecond.
    start : datetime64, number or None
        Time from which the axis counts. None if it shows the times of the curves.
    name : str
        Label of the axis.
    seconds : bool
        Whether times are dates or durations, so that rates are per second.
    """

    dates: bool = False
    start: Any = None
    name: str = "t"
    seconds: bool = False

    def positions(self, first: Any, since: Array) -> Array:
        """Return the positions of times, given as differences from a first time."""
        if self.dates:
            return np.asarray(DATES.date2num(first + np.rint(1e6 * since).astype("timedelta64[us]")))
        if isinstance(self.start, np.datetime64):
            return np.asarray(float((first - self.start) / SECOND) + since)
        # The difference of integers is exact.
        return np.asarray(float(first if self.start is None else first - self.start) + since)


@dataclass(frozen=True)
class Curve:
    """A curve and its look.

    Attributes
    ----------
    data : curve
        A single curve, as `_curves.composed.AnyCurve` describes it.
    first : scalar
        First time as the user gave it.
    x0 : float
        The same time on the time axis of the core.
    x : ndarray
        Sampling times on the time axis of the core. They contain the nodes.
    nodes : ndarray
        Times of the given points. If there are none, the first time.
    axis : Axis
        Time axis of the figure.
    color : color
        Colour of the line.
    alone : bool
        Whether it is the only curve of the figure.
    noise : UncertaintyBand or None
        Noisy data near the curve, and bands at the times x. None if the nodes are the data.
    has_nodes : bool
        Whether the curve has given points.
    has_line : bool
        Whether there is a curve, and not only points.
    faint : bool
        Whether the curve is one of many in the background, without points.
    label : str or None
        Name of the curve in a legend.
    breaks : ndarray, shape (m, 2)
        Starts and ends of gaps in the curve, on the time axis of the core.
    segments : tuple of Curve
        Parts between the gaps. Empty for a curve without gaps.
    reference : point, optional
        First point of a curve of which this is a segment.
    batch : Batch or None
        The batch of which this is the first of a few curves.
    radius : float or None
        Radius of the Earth in metres, if the curve is one of longitude and latitude.
    limits : tuple of pair
        Limits of speed and acceleration in each factor of the space; empty if there are none.
    is_mean : bool
        Whether it is the mean of a batch, without points.
    has_start : bool
        Whether a marker shows where the curve starts.
    is_factor : bool
        Whether it is the curve in one factor of a product space.
    """

    data: AnyCurve
    first: Any
    x0: float
    x: Array
    nodes: Array
    axis: Axis
    color: Any
    alone: bool
    noise: UncertaintyBand | None = None
    has_nodes: bool = True
    has_line: bool = True
    faint: bool = False
    label: str | None = None
    breaks: Array = field(default_factory=lambda: _NO_GAPS)
    segments: tuple[Curve, ...] = ()
    reference: Any = None
    batch: Batch | None = None
    radius: float | None = None
    limits: tuple[tuple[float, float], ...] = ()
    is_mean: bool = False
    has_start: bool = True
    is_factor: bool = False

    def on_earth(self, radius: float | None) -> Curve:
        """Return the curve with a radius of the Earth."""
        return replace(self, radius=radius, segments=tuple(replace(own, radius=radius) for own in self.segments))

    @property
    def space(self) -> Space:
        """Space of the curve."""
        return self.data.space

    @property
    def given(self) -> Any:
        """Given points: those at the nodes, or noisy data."""
        return self.points[self.knots] if self.noise is None else self.noise.points[0]

    @property
    def given_x(self) -> Array:
        """Times of the given points on the time axis of the core."""
        return self.x[self.knots] if self.noise is None else self.noise.x[0]

    @property
    def radii(self) -> Array | None:
        """Radii of the band at the times x; None if no band is drawn."""
        return self.noise.radii[0] if self.noise is not None else None

    @property
    def extent(self) -> Any:
        """All points that the picture must contain: given points, and the curve outside long gaps."""
        points = self.points[~self.bridges]
        if self.polygon is not None:
            points = np.concatenate([points, self.polygon[0]])
        return points if self.noise is None else np.concatenate([points, self.given])

    @cached_property
    def polygon(self) -> tuple[Any, Any] | None:
        """Samples of the geodesics between control points, and the control points; None if there are none."""
        if not isinstance(self.data, ControlledCurve) or self.faint or str(self.space) not in WITH_POLYGON:
            return None
        control = self.data.control_points
        inner = (slice(None), None)
        shares = np.linspace(0, 1, 30).reshape(-1, *[1] * (len(self.space.point_shape) - 1))
        lines = self.space.geodesic(control[:-1][inner], control[1:][inner], shares)
        return lines.reshape(-1, *self.space.point_shape), control

    def draw_polygon(self, axes: Axes, positions: Callable[[Any], Array]) -> None:
        """Draw the control polygon at positions of shape (m, 2) or (m, 3)."""
        if self.polygon is None:
            return
        line, control = map(positions, self.polygon)
        axes.plot(*line.T, color=self.color, linewidth=0.9, alpha=0.5, zorder=3.3, label="_polygon")
        look: Any = {"color": self.color, "markerfacecolor": "white", "markersize": 5, "linestyle": "none"}
        axes.plot(*control.T, "s", zorder=5.5, label=CONTROL, **look)

    def near_data(self, positions: Array) -> Array:
        """Return positions of samples, shape (m, n), NaN in long gaps where they are far from all others.

        Bands show how far a smoothing spline may be from its data in a gap.
        """
        if self.noise is not None or not self.bridges.any():
            return positions
        others = positions[~self.bridges]
        low, high = others.min(axis=0), others.max(axis=0)
        margin = BEYOND * (high - low).max()
        far = np.any((positions < low - margin) | (positions > high + margin), axis=1)
        return np.where((far & self.bridges)[:, None], np.nan, positions)

    def graph(self, line: Array) -> Array:
        """Return one number per sample, NaN in long gaps unless the curve is a smoothing spline.

        No data determine an interpolating spline there, and no band shows it.
        """
        return line if self.noise is not None else self.outside_gaps(line[:, None])[:, 0]

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
        return self.axis.positions(self.first, x - self.x0)

    @cached_property
    def knots(self) -> Indices:
        """Indices of the nodes among the times x."""
        return np.searchsorted(self.x, self.nodes)

    @cached_property
    def gaps(self) -> Array:
        """Starts and ends of gaps on matplotlib's axis, shape (m, 2).

        They are the gaps between segments or, in one curve, those between data that are far longer than most. If
        several sensors report at different rates, only gaps that are also longer than some segments count.
        """
        if len(self.breaks):
            return self.on_axis(self.breaks)
        x = self.nodes if self.noise is None else self.noise.times
        if len(x) < 3 or not self.has_line:
            return _NO_GAPS
        long = long_gaps(x)
        if self.noise is not None and len(self.noise.others):
            long &= np.diff(x) > _SEGMENTS * np.median(np.diff(self.data.times))
        at = self.on_axis(x)
        return np.stack([at[:-1][long], at[1:][long]], axis=1)

    @cached_property
    def bridges(self) -> NDArray[np.bool_]:
        """Whether the times x are inside long gaps between data."""
        after = np.searchsorted(np.ravel(self.gaps), self.times) % 2 == 1
        return np.asarray(after & ~np.isin(self.times, self.gaps))

    def outside_gaps(self, positions: Array) -> Array:
        """Return positions of samples, shape (m, n), NaN in long gaps."""
        return np.where(self.bridges[:, None], np.nan, positions)

    @cached_property
    def marks(self) -> Array:
        """Times of all given points on matplotlib's axis, also of data that are not drawn.

        If there are none, they are the times between which the curve is smooth.
        """
        if self.noise is None:
            return self.times[self.knots] if self.has_nodes else self.on_axis(self.data.times)
        return self.on_axis(np.unique(np.concatenate(self.noise.x)))

    def legend_of(self, given: str, curve: str, data: str) -> str:
        """Explain the large symbols: those of given points, or of the curve and of noisy data if there are any."""
        if self.noise is None:
            return given if self.has_nodes else curve
        return f"{curve}, {data}" if len(self.noise.x[0]) else curve

    def samples(self, number: int) -> dict[str, Any]:
        """Return at most ``number`` points at which large symbols are drawn.

        The group "bold" has given points, or evenly spaced ones of curves without them. For noisy data, the group
        "data" has some of the data, and "bold" has the samples of the curve that are closest to them.
        """
        if not self.has_line:
            return {"data": self.points[evenly(len(self.x), number)]}
        even = np.linspace(self.x[0], self.x[-1], number)
        if self.noise is None:
            some = self.knots[evenly(len(self.knots), number)] if self.has_nodes else np.unique(self._nearest(even))
            return {"bold": self.points[some]}
        x, points = self.given_x, self.given
        if len(x):
            data = np.unique(np.abs(x[:, None] - np.linspace(x[0], x[-1], number)).argmin(axis=0))
            x, points = x[data], points[data]
        return {"bold": self.points[np.unique(self._nearest(x if len(x) else even))], "data": points}

    def _nearest(self, x: Array) -> Indices:
        """Return the indices of the times x that are closest to given times."""
        after = np.clip(np.searchsorted(self.x, x), 1, len(self.x) - 1)
        return np.where(x - self.x[after - 1] < self.x[after] - x, after - 1, after)

    def closest_samples(self, line: Array) -> Array:
        """Return the rows of samples of the curve that are closest in time to the given points."""
        return line[self._nearest(self.given_x)]

    def part(self, number: int) -> Curve:
        """Return the curve in one factor of a product space."""
        noise = None if self.noise is None else self.noise.part(number)
        segments = tuple(own.part(number) for own in self.segments)
        own: dict[str, Any] = {"noise": noise, "segments": segments, "batch": self.batch and self.batch.part(number)}
        reference = None if self.reference is None else self.reference[number]
        own["limits"] = self.limits[number : number + 1]
        return replace(self, is_factor=True, data=self.data.parts[number], reference=reference, **own)

    @property
    def unbroken(self) -> tuple[Curve, ...]:
        """The segments between gaps, or the curve itself."""
        return self.segments or (self,)

    @property
    def first_point(self) -> Any:
        """First point of the curve, also if this is a later segment."""
        return self.points[0] if self.reference is None else self.reference

    def at(self, quantity: str) -> Any:
        """Evaluate a quantity at the times x."""
        return self.data.evaluate(self.x, quantity, "raise", False)

    # ---- on axes of two or three dimensions ----

    def draw_line(self, axes: Axes, positions: Array, **look: Any) -> None:
        """Draw a line through positions of shape (m, 2) or (m, 3)."""
        if not self.has_line:
            return
        # A narrow band must remain visible beside the line.
        width = 1.4 if not self.alone and not self.is_mean else 2.4 if self.noise is None else 1.8
        # The first line of a curve has its name in legends.
        known = {line.get_label() for line in axes.lines}
        label = self.label if self.label and self.label not in known and "linestyle" not in look else LINE
        own: dict[str, Any] = {"color": self.color, "linewidth": width, "zorder": 4, "label": label}
        if self.faint:
            look = look | {"linewidth": 0.8, "alpha": 0.5, "zorder": 3.2, "label": FAINT}
        if positions.shape[1] == 3:
            # Curves in space have no arrow heads.
            self.draw_end(axes, positions[-1:])
        if positions.shape[1] == 3 and self.alone and self.color == SPLINE and len(self.gaps):
            # Without a time axis, the parts before and after a gap could not be distinguished.
            after = (self.times >= self.gaps[0, 1])[:, None]
            self.plot_line(
                axes, np.where(after, positions, np.nan), **own | {"color": AFTER_COLOR, "label": AFTER} | look
            )
            positions = np.where(after, np.nan, positions)
        self.plot_line(axes, positions, **own | look)

    @property
    def is_closed(self) -> bool:
        """Whether the curve ends where it began."""
        first, last = self.points[[0, -1]]
        # States that differ in their phase are equal.
        return bool(self.space.distance(first, last) <= _CLOSED * np.abs(self.points).max())

    def draw_end(self, axes: Axes, end: Array, **look: Any) -> None:
        """Draw a square at the end of a curve, shape (1, 2) or (1, 3), unless it is closed."""
        if self.noise is None and self.has_line and not self.faint and not self.is_closed:
            size = 7 if self.alone else 5
            own: Any = {"markersize": size, "markeredgecolor": "white", "zorder": 6.6, "label": END}
            axes.plot(*end.T, "s", color=self.color_of_dots, **own | look)

    @property
    def color_of_dots(self) -> Any:
        """Colour of given points: dark ones for a curve in the usual colour."""
        return INK if self.alone and self.color == SPLINE and self.label is None else self.color

    def plot_line(self, axes: Axes, positions: Array, **look: Any) -> None:
        """Draw a line, thin and dashed in long gaps, and mark it for animations."""
        bridged = len(positions) == len(self.x) and not self.faint
        if bridged and np.isfinite(positions[self.bridges]).all(axis=1).any():
            # One sample on both sides connects the parts.
            near = self.bridges.copy()
            near[1:] |= self.bridges[:-1]
            near[:-1] |= self.bridges[1:]
            light = look | {"linewidth": 0.5 * look["linewidth"], "linestyle": (0, (4, 2)), "label": BRIDGE}
            *others, last = positions.T
            axes.plot(*others, np.where(near, last, np.nan), **light)
            positions = np.column_stack([*others, np.where(self.bridges, np.nan, last)])
        (line,) = axes.plot(*positions.T, **look)
        line.set_gid(LINE)

    def draw_dots(self, axes: Axes, positions: Array, **look: Any) -> None:
        """Draw given points, shape (N+1, 2) or (N+1, 3). The first is white; noisy data are small and light."""
        if self.faint:
            return
        if not self.has_line:
            size = float(np.clip(60 / np.sqrt(max(len(positions), 1)), 3, 8))
            rings: dict[str, Any] = {"color": self.color, "markersize": size, "markerfacecolor": "none", "zorder": 7}
            known = {line.get_label() for line in axes.lines}
            label = self.label if self.label and self.label not in known else DATA_DOTS
            axes.plot(*positions.T, "o", **rings | {"label": label} | look)
            return
        if self.noise is not None:
            size = float(np.clip(25 / np.sqrt(max(len(positions), 1)), 1.5, 3.5))
            dots: Any = {"color": DATA if self.alone else self.color, "alpha": 0.75 if self.alone else 0.4}
            dots |= {"markersize": size, "markeredgewidth": 0, "zorder": 3.5, "label": DATA_DOTS}
            axes.plot(*positions.T, "o", **dots | look)
            return
        size = float(np.clip(30 / np.sqrt(max(len(positions), 1)), 2, 6.5)) * (1 if self.alone else 0.6)
        color = self.color_of_dots
        # Many points would hide the curve.
        front = 6 if len(positions) <= MANY else 1.8
        look = {"color": color, "markersize": size, "zorder": front} | look
        look |= {"color": DATA} if len(positions) > MANY else {}
        look["markeredgecolor"] = look["color"]
        if self.has_nodes and not self.is_mean:
            axes.plot(*positions.T, "o", label=DOTS, **look)
        if self.has_start and axes.get_gid() != "time":
            look |= {"color": "white", "markeredgewidth": 1.4, "zorder": 6.5, "markersize": 1.3 * look["markersize"]}
            # On the far side of a globe the edge alone is faint.
            look["markeredgecolor"] = to_rgba(look["markeredgecolor"], look.pop("alpha", None))
            axes.plot(*positions[:1].T, "o", label=START, **look)


@dataclass(frozen=True)
class Batch:
    """Many curves with the same times, for quantiles.

    Attributes
    ----------
    data : curve
        The curves, as `_curves.composed.AnyCurve` describes them.
    valid : ndarray of bool
        Curves that did not fail, in a flat array.
    x : ndarray
        Times on the time axis of the core.
    times : ndarray
        Positions of these times on matplotlib's axis.
    """

    data: AnyCurve
    valid: NDArray[np.bool_]
    x: Array
    times: Array

    def part(self, number: int) -> Batch:
        """Return the curves in one factor of a product space."""
        return replace(self, data=self.data.parts[number])

    def at(self, quantity: str) -> Any:
        """Evaluate a quantity of all curves at the times x, shape (curves, m, ...)."""
        values = self.data.evaluate(self.x, quantity, "raise", False)
        count = len(self.data.batch)
        return values.reshape(-1, *values.shape[count:])[self.valid]


def are_compared(curves: Sequence[Curve]) -> bool:
    """Whether a figure has several curves, whose numbers need axes of their own."""
    return curves[0].batch is not None or (len(curves) > 1 and not curves[0].alone)


def common_gaps(curves: Sequence[Curve]) -> Array:
    """Return starts and ends on matplotlib's axis of the times at which all curves have a gap, shape (m, 2)."""
    found, *others = [curve.gaps for curve in curves if curve.has_line and not curve.faint] or [_NO_GAPS]
    for gaps in others:
        low, high = np.maximum(found[:, None, 0], gaps[:, 0]), np.minimum(found[:, None, 1], gaps[:, 1])
        found = np.stack([low[low < high], high[low < high]], axis=1)
    return found

"""Curves and data as pictures draw them: samples, given points, noise, gaps, batches, and a common time axis."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.typing import ColorType
from numpy.typing import NDArray

from .._base.input import UTC_ZONE
from .._base.report import long_gaps
from .._base.time import TimeAxis
from .._base.typing import Array, FloatArray, Look
from .._core import ConvergenceError, CutLocusError, ValidationError
from .._curves.composed import AnyCurve
from .._curves.curve import ControlledCurve, UncertaintyBand
from .._curves.ends import NATURAL
from .._curves.fit import FitProblem, fit, read
from .._curves.solve import DEFAULTS
from .._spaces import AmbiguousMeanWarning, AnySpace, Product, Space, SpecialEuclidean, Sphere
from .style import (
    DATA,
    DATES,
    Indices,
    Numbers,
    colors,
    distinct,
    evenly,
    ink,
    named_from,
    round_start,
    spline_color,
)

SECOND = np.timedelta64(1, "s")
FEW, _OF_MANY = 5, 3
"""The largest number of curves of a batch that are all drawn with their points, and the number of larger batches."""
MOST = 50
"""The largest number of curves of a batch that are drawn, those in the background included."""
_FOR_QUANTILES, _FOR_MEAN = 2000, 200
"""The largest numbers of curves along the first batch axis from which quantiles and means are computed."""
_QUANTILE_TIMES = 300
_SAMPLES = 1200
"""Samples of a curve with few segments."""
OTHERS = ["#7b3294", "#56b4e9", "#4d4d4d", "#cc79a7", "#8a6d00", "#a6611a"]
"""Colours of segments, if they are few, and of curves beside frames; other colours than those of components."""
_WITH_POLYGON = {"euclidean:2", "euclidean:3", "sphere:2", "hyperbolic:2", "cp:1"}
"""Spaces whose picture shows the control points of a curve."""
_BEYOND = 0.15
"""How far pictures follow a curve into a long gap, as part of the extent of its data."""
_CLOSED = 1e-9
"""The largest distance of the ends of a closed curve, as a part of the largest component of its points."""
_SEGMENTS = 3
"""The smallest length of a gap between measurements of several kinds, in median segments."""
_NO_GAPS: FloatArray = np.empty((0, 2))
Mover = Callable[[int], None]
"""Moves a body to the point of a curve at one of its samples."""


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

    @classmethod
    def of(cls, ends: Sequence[tuple[Any, Any]], times: TimeAxis, raw: bool = False) -> Axis:
        """Return the time axis for curves with given first and last times.

        Numbers that are far from zero, such as seconds since 1970, are shown as differences from a round number unless
        ``raw`` is True. Dates that differ by less than a millisecond are shown as seconds since the first.
        """
        firsts, lasts = (np.concatenate([np.ravel(pair[i]) for pair in ends]) for i in (0, 1))
        first, last = firsts.min(), lasts.max()
        if firsts.dtype.kind == "M":
            if (last - first) / SECOND > 1e-3:
                return cls(dates=True, name="UTC" if times.zone == UTC_ZONE else "", seconds=True)
            return cls(start=first, name=f"seconds since {first}", seconds=True)
        name = "t, seconds" if times.durations else "t"
        start = 0 if raw else round_start(first, last)
        return cls(start=start or None, name=named_from(name, start), seconds=times.durations)

    def positions(self, first: Any, since: FloatArray) -> FloatArray:
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
    usual : bool
        Whether the user gave neither colour nor name, so that pictures may use further colours.
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
    tracks : list of tuple
        Axes, times x and positions of every line that was drawn along the curve; for animations.
    bodies : list of tuple
        Times x, and a function that adds a body which moves along the curve and returns its mover; for animations.
    """

    data: AnyCurve
    first: Any
    x0: float
    x: FloatArray
    nodes: FloatArray
    axis: Axis
    color: ColorType
    alone: bool
    usual: bool = False
    noise: UncertaintyBand | None = None
    has_nodes: bool = True
    has_line: bool = True
    faint: bool = False
    label: str | None = None
    breaks: FloatArray = field(default_factory=lambda: _NO_GAPS)
    segments: tuple[Curve, ...] = ()
    reference: Any = None
    batch: Batch | None = None
    radius: float | None = None
    limits: tuple[tuple[float, float], ...] = ()
    is_mean: bool = False
    has_start: bool = True
    is_factor: bool = False
    tracks: list[tuple[Axes, FloatArray, FloatArray]] = field(default_factory=list)
    bodies: list[tuple[FloatArray, Callable[[], Mover]]] = field(default_factory=list)

    # ---- parts ----

    @property
    def space(self) -> Space:
        """Space of the curve."""
        return self.data.space

    @property
    def unbroken(self) -> tuple[Curve, ...]:
        """The segments between gaps, or the curve itself."""
        return self.segments or (self,)

    def part(self, number: int) -> Curve:
        """Return the curve in one factor of a product space."""
        data = self.data.parts[number]
        return replace(
            self,
            is_factor=True,
            data=data,
            radius=self.radius if data.space == Sphere(2) else None,
            noise=self.noise and self.noise.part(number),
            segments=tuple(segment.part(number) for segment in self.segments),
            reference=None if self.reference is None else self.reference[number],
            batch=self.batch and self.batch.part(number),
            limits=self.limits[number : number + 1],
        )

    def on_earth(self, radius: float | None) -> Curve:
        """Return the curve with a radius of the Earth."""
        return replace(
            self, radius=radius, segments=tuple(replace(segment, radius=radius) for segment in self.segments)
        )

    # ---- points ----

    def at(self, quantity: str) -> Any:
        """Evaluate a quantity at the times x."""
        return self.data.evaluate(self.x, quantity, "raise", False)

    @cached_property
    def points(self) -> Any:
        """Points at the times x."""
        return self.at("point")

    @property
    def first_point(self) -> Any:
        """First point of the curve, also if this is a later segment."""
        return self.points[0] if self.reference is None else self.reference

    @cached_property
    def knots(self) -> Indices:
        """Indices of the nodes among the times x."""
        return np.searchsorted(self.x, self.nodes)

    @property
    def given(self) -> Any:
        """Given points: those at the nodes, or noisy data."""
        return self.points[self.knots] if self.noise is None else self.noise.points[0]

    @property
    def given_x(self) -> FloatArray:
        """Times of the given points on the time axis of the core."""
        return self.x[self.knots] if self.noise is None else self.noise.x[0]

    def marked(self, numbers: Numbers) -> tuple[FloatArray, FloatArray]:
        """Apply a function to the points at the times x, one row per point, and to the given points."""
        line = numbers(self.points)
        if self.noise is None:
            return line, line[self.knots]
        return line, numbers(self.given) if len(self.given) else line[:0]

    @property
    def radii(self) -> FloatArray | None:
        """Radii of the band at the times x; None if no band is drawn."""
        return self.noise.radii[0] if self.noise is not None else None

    @property
    def band_name(self) -> str:
        """Name of the band in the legend of a page."""
        return "95 % band of curve" + " and speed" * (self.noise is not None and self.noise.speed is not None)

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
        if not isinstance(self.data, ControlledCurve) or self.faint or str(self.space) not in _WITH_POLYGON:
            return None
        control = self.data.control_points
        inner = (slice(None), None)
        shares = np.linspace(0, 1, 30).reshape(-1, *[1] * (len(self.space.point_shape) - 1))
        lines = self.space.geodesic(control[:-1][inner], control[1:][inner], shares)
        return lines.reshape(-1, *self.space.point_shape), control

    @property
    def is_closed(self) -> bool:
        """Whether the curve ends where it began."""
        first, last = self.points[[0, -1]]
        # States that differ in their phase are equal.
        return bool(self.space.distance(first, last) <= _CLOSED * np.abs(self.points).max())

    @property
    def color_of_dots(self) -> Any:
        """Colour of given points: that of text for a curve in the usual colour."""
        return ink() if self.usual else self.color

    def samples(self, number: int) -> Look:
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

    def _nearest(self, x: FloatArray) -> Indices:
        """Return the indices of the times x that are closest to given times."""
        after = np.clip(np.searchsorted(self.x, x), 1, len(self.x) - 1)
        return np.where(x - self.x[after - 1] < self.x[after] - x, after - 1, after)

    def closest_samples(self, line: FloatArray) -> FloatArray:
        """Return the rows of samples of the curve that are closest in time to the given points."""
        return line[self._nearest(self.given_x)]

    # ---- times ----

    def on_axis(self, x: FloatArray) -> FloatArray:
        """Return the positions of times on matplotlib's axis."""
        return self.axis.positions(self.first, x - self.x0)

    @cached_property
    def times(self) -> FloatArray:
        """Positions of the times x on matplotlib's axis."""
        return self.on_axis(self.x)

    @cached_property
    def marks(self) -> FloatArray:
        """Times of all given points on matplotlib's axis, also of data that are not drawn.

        If there are none, they are the times between which the curve is smooth.
        """
        if self.noise is None:
            return self.times[self.knots] if self.has_nodes else self.on_axis(self.data.times)
        return self.on_axis(np.unique(np.concatenate(self.noise.x)))

    @property
    def name_of_marks(self) -> str:
        """What happens at these times."""
        return "times of data" if self.noise is not None else "times of points" if self.has_nodes else "knots"

    @cached_property
    def gaps(self) -> FloatArray:
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

    def outside_gaps(self, values: FloatArray) -> FloatArray:
        """Return values at the times x, NaN in long gaps."""
        return np.where(self.bridges.reshape(-1, *[1] * (values.ndim - 1)), np.nan, values)

    def graph(self, line: FloatArray) -> FloatArray:
        """Return one number per sample, NaN in long gaps unless the curve is a smoothing spline.

        No data determine an interpolating spline there, and no band shows it.
        """
        return line if self.noise is not None else self.outside_gaps(line)

    def near_data(self, positions: FloatArray) -> FloatArray:
        """Return positions of samples, shape (m, n), NaN in long gaps where they are far from all others.

        Bands show how far a smoothing spline may be from its data in a gap.
        """
        if self.noise is not None or not self.bridges.any():
            return positions
        others = positions[~self.bridges]
        low, high = others.min(axis=0), others.max(axis=0)
        margin = _BEYOND * (high - low).max()
        far = np.any((positions < low - margin) | (positions > high + margin), axis=1)
        return np.where((far & self.bridges)[:, None], np.nan, positions)


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
    x: FloatArray
    times: FloatArray

    def part(self, number: int) -> Batch:
        """Return the curves in one factor of a product space."""
        return replace(self, data=self.data.parts[number])

    def at(self, quantity: str) -> Any:
        """Evaluate a quantity of all curves at the times x, shape (curves, m, ...)."""
        values = self.data.evaluate(self.x, quantity, "raise", False)
        count = len(self.data.batch)
        return values.reshape(-1, *values.shape[count:])[self.valid]

    @property
    def count(self) -> int:
        """Number of curves that did not fail."""
        return int(self.valid.sum())


def are_compared(curves: Sequence[Curve]) -> bool:
    """Whether a figure has several curves, whose numbers need axes of their own."""
    return curves[0].batch is not None or (len(curves) > 1 and not curves[0].alone)


def common_gaps(curves: Sequence[Curve]) -> FloatArray:
    """Return starts and ends on matplotlib's axis of the times at which all curves have a gap, shape (m, 2)."""
    common, *others = [curve.gaps for curve in curves if curve.has_line and not curve.faint] or [_NO_GAPS]
    for gaps in others:
        low, high = np.maximum(common[:, None, 0], gaps[:, 0]), np.minimum(common[:, None, 1], gaps[:, 1])
        common = np.stack([low[low < high], high[low < high]], axis=1)
    return common


# ---- curves of the user ----


def curves_of(
    curve: Any, axis: Axis, color: ColorType | None = None, label: str | None = None, alone: bool = True
) -> tuple[list[Curve], str]:
    """Return the curves to draw, and a description of them. The first has the batch, if there are many.

    Raises
    ------
    ValidationError
        If no curve is finite.
    """
    batch = curve._curve.batch
    everything = int(np.prod(batch))
    if not everything:
        raise ValidationError("there is nothing to plot: the batch has no curves")
    valid = _finite(curve._curve)
    good = np.flatnonzero(valid)
    if not good.size:
        raise ValidationError("there is nothing to plot: the fit failed (a cut-locus fault, see spline.report)")
    drawn = good[evenly(len(good), MOST)]
    few = drawn[evenly(len(drawn), FEW if len(drawn) <= FEW else _OF_MANY)]
    # A few of many curves differ from each other and from the grey ones behind them.
    looks = dict(zip(few.tolist(), colors(len(few)) if len(few) == len(drawn) else distinct(), strict=False))
    made: list[Curve] = []
    mean = _mean_of(curve, valid, axis, color, label, alone) if len(drawn) > len(few) else None
    if mean is not None:
        # Thin lines, or quantiles, show the other curves.
        few, looks, made = drawn, {}, [mean]
    behind = "single curves" if mean is not None else "other curves"
    hidden = everything - (0 if mean is not None else len(few)), len(drawn) - len(looks)
    if hidden[1] < hidden[0]:
        behind += f", {hidden[1]} of {hidden[0]}"
    # Curves with points come first.
    for i in [*looks, *(i for i in drawn.tolist() if i not in looks)]:
        index = tuple(map(int, np.unravel_index(i, batch)))
        one = reduce(lambda curves, k: curves._picked(k), index, curve)
        name = label if not batch else f"curve {index[0] if len(index) == 1 else index}"
        single = alone and len(drawn) == 1
        look = {"color": color or looks.get(i), "alone": single, "label": name if i in looks else behind}
        look["usual"] = single and color is None and name is None
        made.append(_drawn(one, curve._noise_beside, index, axis, look, faint=i not in looks))
    if mean is None and len(drawn) > len(few):
        made[0] = replace(made[0], batch=_batch_of(curve, made[0], valid))
    number = f"{len(few)} of {everything}" if len(few) < everything else f"{everything}"
    return made, f"{number} curves, " if batch else ""


def _drawn(one: Any, noise_beside: Any, index: object, axis: Axis, look: Look, faint: bool) -> Curve:
    """Return one curve with its samples."""
    data = one._curve
    nodes, breaks = one._node_times, one._breaks
    x, parts = samples(data.times, breaks)
    noise = None if faint else noise_beside(index, x)
    if faint:
        look = look | {"color": DATA}
    has_nodes = len(nodes) > 0
    nodes = nodes if has_nodes else x[:1]
    first, x0 = one.domain[0], float(data.times[0])
    look |= {"noise": noise, "has_nodes": has_nodes, "faint": faint, "breaks": breaks, "limits": one._rate_limits}
    made = Curve(data, first, x0, x, nodes, axis, **look)
    if len(parts) < 2:
        return made
    start = made.points[0] if not isinstance(data.space, Product) else tuple(times[0] for times in made.points)
    few = len(parts) <= len(OTHERS)
    segments = []
    ends = np.cumsum([0, *map(len, parts)]).tolist()
    for i, times in enumerate(parts):
        within = nodes[(nodes >= times[0]) & (nodes <= times[-1])] if has_nodes else times[:1]
        beside = noise and noise.between(times[0], times[-1], slice(*ends[i : i + 2]))
        part = replace(
            made, x=times, nodes=within, reference=start if i else None, has_start=few or not i, noise=beside
        )
        named = few and made.usual
        segments.append(replace(part, color=OTHERS[i], label=f"segment {i}", usual=False) if named else part)
    return replace(made, segments=tuple(segments))


def _mean_of(
    curve: Any, valid: NDArray[np.bool_], axis: Axis, color: ColorType | None, label: str | None, alone: bool
) -> Curve | None:
    """Return the curve through the Karcher means of a batch, or None if the batch is not close to it.

    A batch is close to its mean if, at half of the times, 95 % of the curves are nearer to the mean than half of the
    extent of the mean curve.
    """
    space, data, nodes = curve.space, curve._curve, curve._node_times
    if isinstance(space, Product):
        return None
    first, x0 = np.ravel(curve.domain[0])[0], float(data.times.flat[0])
    x = data.times.ravel()
    # The usual colour is that of the third axis of frames.
    color = color or (OTHERS[0] if isinstance(space, SpecialEuclidean) else spline_color())
    mean = Curve(data, first, x0, x, nodes, axis, color, alone, label=label or "mean curve", is_mean=True)
    batch = _batch_of(curve, mean, valid)
    if batch is None:
        return None
    many = np.union1d(batch.x, data.times)
    points = replace(batch, x=many).at("point")
    points = points[evenly(len(points), _FOR_MEAN)].swapaxes(0, 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", AmbiguousMeanWarning)
            means = space.mean(points)
    except (AmbiguousMeanWarning, ConvergenceError, CutLocusError, NotImplementedError, ValidationError):
        # Points of hyperbolic space that are far away are rounded off it, and some spaces have no means.
        return None
    spread = np.quantile(space.distance(means[:, None], points), 0.95, axis=1)
    if np.median(spread) > 0.5 * space.distance(means[0], means).max():
        return None
    x, _ = samples(data.times, _NO_GAPS)
    problem = FitProblem(space, many, read(means, space), [NATURAL], DEFAULTS)
    return replace(mean, data=fit(problem).curve, x=x, batch=batch)


def _batch_of(curve: Any, first: Curve, valid: NDArray[np.bool_]) -> Batch | None:
    """Return the batch for quantiles, or None if the curves have their own times."""
    data = curve._curve
    if data.times.ndim > 1:
        return None
    step = -(-len(curve) // _FOR_QUANTILES)
    kept = valid.reshape(data.batch)[::step].ravel()
    x = np.linspace(data.times[0], data.times[-1], _QUANTILE_TIMES)
    return Batch(curve[::step]._curve, kept, x, first.on_axis(x))


def _finite(data: Any) -> NDArray[np.bool_]:
    """Return whether each curve is finite, in a flat array."""
    start = np.broadcast_to(data.times, (*data.batch, data.times.shape[-1]))[..., :1]
    return np.asarray(np.isfinite(data.evaluate(np.ascontiguousarray(start), "speed", "raise", True))).ravel()


def samples(times: FloatArray, breaks: FloatArray) -> tuple[FloatArray, list[FloatArray]]:
    """Return sampling times, and those of each part between breaks.

    They divide every interval evenly, with more of them in long intervals.
    """
    bounds = [times[0], *np.ravel(breaks), times[-1]]
    made = []
    for i, (start, stop) in enumerate(zip(bounds[::2], bounds[1::2], strict=True)):
        knots = times[(times >= start) & (times <= stop)]
        # A curve that meets the next one there has the values of the next one.
        last = np.nextafter(stop, start) if 2 * i + 2 < len(bounds) and bounds[2 * i + 2] == stop else stop
        made.append(np.append(_divided(knots)[:-1], last))
    return np.concatenate(made), made


def _divided(knots: FloatArray) -> FloatArray:
    segments, lengths = len(knots) - 1, np.diff(knots)
    least = max(_SAMPLES // segments, 16 if segments <= 10_000 else 1)
    numbers = np.maximum(least, np.ceil(_SAMPLES * lengths / np.ptp(knots))).astype(int)
    segment = np.repeat(np.arange(segments), numbers)
    step = np.arange(len(segment)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    return np.append(knots[segment] + lengths[segment] * step / numbers[segment], knots[-1])


# ---- data of the user ----


class _Scatter:
    """Points at given times, with the interface of curves; evaluated at these times only."""

    def __init__(self, space: AnySpace, times: FloatArray, points: Array) -> None:
        self.space, self.times, self.points = space, times, points
        self.batch: tuple[int, ...] = ()
        self.quad_rtol, self.max_nu = 0.0, 0

    @property
    def parts(self) -> tuple[_Scatter, ...]:
        """The points in each factor of a product."""
        if not isinstance(self.space, Product):
            return (self,)
        pairs = zip(self.space.factors, self.points, strict=True)
        return tuple(_Scatter(factor, self.times, points) for factor, points in pairs)

    def evaluate(self, x: FloatArray, quantity: str, outside: str, per_curve: bool, progress: object = None) -> Any:
        """Return the points."""
        return self.points


def scatter_of(
    space: AnySpace, first: Any, times: FloatArray, points: Array, axis: Axis, color: ColorType, label: Any
) -> Curve:
    """Return data as a curve without a line. Times must not decrease."""
    data = _Scatter(space, times, points)
    return Curve(data, first, float(times[0]), times, times, axis, color, False, has_line=False, label=label)

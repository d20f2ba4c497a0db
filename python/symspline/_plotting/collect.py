"""Curves and data of the user as curves with samples to draw, with a common time axis."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.input import UTC_ZONE
from .._base.time import TimeAxis
from .._core import ConvergenceError, CutLocusError, ValidationError
from .._curves.ends import NATURAL
from .._curves.fit import FitProblem, fit, read
from .._curves.solve import DEFAULTS
from .._spaces import AmbiguousMeanWarning, Product, Space, SpecialEuclidean
from .curves import SECOND, Axis, Batch, Curve
from .style import SPLINE, Array, colors, evenly, named_from, round_start

FEW, _OF_MANY = 5, 3
"""The largest number of curves of a batch that are all drawn with their points, and the number of larger batches."""
MOST = 50
"""The largest number of curves of a batch that are drawn, those in the background included."""
_FOR_QUANTILES, _FOR_MEAN = 2000, 200
"""The largest numbers of curves along the first batch axis from which quantiles and means are computed."""
_QUANTILE_TIMES = 300
OTHERS = ["#7b3294", "#56b4e9", "#4d4d4d", "#cc79a7", "#8a6d00", "#a6611a"]
"""Colours of segments, if they are few, and of curves beside frames; other colours than those of components."""
_SAMPLES = 1200
"""Samples of a curve with few segments."""


class Scatter:
    """Points at given times, with the interface of curves; evaluated at these times only."""

    def __init__(self, space: Space[Any], times: Array, points: Any) -> None:
        self.space, self.times, self.points = space, times, points
        self.batch: tuple[int, ...] = ()
        self.quad_rtol, self.max_nu = 0.0, 0

    @property
    def parts(self) -> tuple[Scatter, ...]:
        """The points in each factor of a product."""
        if not isinstance(self.space, Product):
            return (self,)
        each = zip(self.space.factors, self.points, strict=True)
        return tuple(Scatter(factor, self.times, points) for factor, points in each)

    def evaluate(self, x: Array, quantity: str, outside: str, per_curve: bool, progress: Any = None) -> Any:
        """Return the points."""
        return self.points


def axis_of(ends: Sequence[tuple[Any, Any]], times: TimeAxis, raw: bool = False) -> Axis:
    """Return the time axis for curves with given first and last times.

    Numbers that are far from zero, such as seconds since 1970, are shown as differences from a round number unless
    ``raw`` is True. Dates that differ by less than a millisecond are shown as seconds since the first.
    """
    firsts, lasts = (np.concatenate([np.ravel(pair[i]) for pair in ends]) for i in (0, 1))
    first, last = firsts.min(), lasts.max()
    if firsts.dtype.kind == "M":
        if (last - first) / SECOND > 1e-3:
            return Axis(dates=True, name="UTC" if times.zone == UTC_ZONE else "", seconds=True)
        return Axis(start=first, name=f"seconds since {first}", seconds=True)
    name = "t, seconds" if times.durations else "t"
    start = 0 if raw else round_start(first, last)
    if not start:
        return Axis(name=name, seconds=times.durations)
    return Axis(start=start, name=named_from(name, start), seconds=times.durations)


def curves_of(
    curve: Any, axis: Axis, color: Any = None, label: str | None = None, alone: bool = True
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
    looks = dict(zip(few.tolist(), colors(len(few)), strict=True))
    made: list[Curve] = []
    mean = _mean_of(curve, valid, axis, color, label, alone) if len(drawn) > len(few) else None
    if mean is not None:
        # Thin lines, or quantiles, show the other curves.
        few, looks, made = drawn, {}, [mean]
    # Curves with points come first.
    for i in [*looks, *(i for i in drawn.tolist() if i not in looks)]:
        index = tuple(map(int, np.unravel_index(i, batch)))
        one = reduce(lambda curves, k: curves._picked(k), index, curve)
        name = label if not batch else f"curve {index[0] if len(index) == 1 else index}"
        look = {"color": color or looks.get(i), "alone": alone and len(drawn) == 1, "label": name}
        made.append(_drawn(one, curve._noise_beside, index, axis, look, faint=i not in looks))
    if mean is None and len(drawn) > len(few):
        made[0] = replace(made[0], batch=_batch_of(curve, made[0], valid))
    number = f"{len(few)} of {everything}" if len(few) < everything else f"{everything}"
    return made, f"{number} curves, " if batch else ""


def _drawn(one: Any, noise_beside: Any, index: Any, axis: Axis, look: dict[str, Any], faint: bool) -> Curve:
    """Return one curve with its samples."""
    data = one._curve
    nodes, breaks = one._node_times, one._breaks
    x, parts = samples(data.times, breaks)
    noise = None if faint else noise_beside(index, x)
    if faint:
        look = look | {"color": "#7d8f9c"}
    has_nodes = len(nodes) > 0
    nodes = nodes if has_nodes else x[:1]
    first, x0 = one.domain[0], float(data.times[0])
    made = Curve(data, first, x0, x, nodes, axis, noise=noise, has_nodes=has_nodes, faint=faint, breaks=breaks, **look)
    made = replace(made, limits=tuple(one._rate_limits))
    if len(parts) < 2:
        return made
    start = made.points[0] if not isinstance(data.space, Product) else tuple(own[0] for own in made.points)
    few = len(parts) <= len(OTHERS)
    has_names = few and made.alone and made.color == SPLINE and made.label is None
    segments = []
    ends = np.cumsum([0, *map(len, parts)]).tolist()
    for i, own in enumerate(parts):
        within = nodes[(nodes >= own[0]) & (nodes <= own[-1])] if has_nodes else own[:1]
        beside = noise and noise.between(own[0], own[-1], slice(*ends[i : i + 2]))
        part = replace(made, x=own, nodes=within, reference=start if i else None, has_start=few or not i, noise=beside)
        segments.append(replace(part, color=OTHERS[i], label=f"segment {i}") if has_names else part)
    return replace(made, segments=tuple(segments))


def _mean_of(
    curve: Any, valid: NDArray[np.bool_], axis: Axis, color: Any, label: str | None, alone: bool
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
    color = color or (OTHERS[0] if isinstance(space, SpecialEuclidean) else SPLINE)
    own = Curve(data, first, x0, x, nodes, axis, color, alone, label=label or "mean curve", is_mean=True)
    batch = _batch_of(curve, own, valid)
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
    x, _ = samples(data.times, np.empty((0, 2)))
    problem = FitProblem(space, many, read(means, space), [NATURAL], DEFAULTS)
    return replace(own, data=fit(problem).curve, x=x, batch=batch)


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


def samples(times: Array, breaks: Array) -> tuple[Array, list[Array]]:
    """Return sampling times, and those of each part between breaks.

    They divide every interval evenly, with more of them in long intervals.
    """
    bounds = [times[0], *np.ravel(breaks), times[-1]]
    made = []
    for i, (start, stop) in enumerate(zip(bounds[::2], bounds[1::2], strict=True)):
        own = times[(times >= start) & (times <= stop)]
        # A curve that meets the next one there has the values of the next one.
        last = np.nextafter(stop, start) if 2 * i + 2 < len(bounds) and bounds[2 * i + 2] == stop else stop
        made.append(np.append(_divided(own)[:-1], last))
    return np.concatenate(made), made


def _divided(knots: Array) -> Array:
    segments, lengths = len(knots) - 1, np.diff(knots)
    least = max(_SAMPLES // segments, 16 if segments <= 10_000 else 1)
    numbers = np.maximum(least, np.ceil(_SAMPLES * lengths / np.ptp(knots))).astype(int)
    segment = np.repeat(np.arange(segments), numbers)
    step = np.arange(len(segment)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    return np.append(knots[segment] + lengths[segment] * step / numbers[segment], knots[-1])


def scatter_of(space: Space[Any], first: Any, times: Array, points: Any, axis: Axis, color: Any, label: Any) -> Curve:
    """Return data as a curve without a line. Times must not decrease."""
    data = Scatter(space, times, points)
    return Curve(data, first, float(times[0]), times, times, axis, color, False, has_line=False, label=label)


def finite_rows(parts: Sequence[NDArray[Any]]) -> NDArray[np.bool_]:
    """Return which points have no missing values in any factor."""
    return np.asarray(np.all([np.isfinite(own.reshape(len(own), -1)).all(axis=1) for own in parts], axis=0))

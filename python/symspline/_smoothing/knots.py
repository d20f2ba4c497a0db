"""The knots of a curve near noisy data: those of the user, or as many as the degrees of freedom require."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import as_array, short_repr
from .._base.input import times_of
from .._base.report import long_gaps
from .._core import ValidationError
from .._spaces import Array, Doubles, Space, SpecialEuclidean, factors_of
from .data import Part, SmoothingData
from .noise import smoothed_spaces

# Segments longer than this fraction of the curve are divided if no curve was found without additional knots.
_GAPS = 12
# Largest number of parts of a long gap between data.
_IN_GAP = 32
# If there are more knots than the first number, the fit begins with the second number of knots or more.
_MANY, _FIRST = 4000, 2000
# Number of evenly distributed short parts that are fitted before, and the smallest and largest number of data of each.
_PARTS, _FEW, _PART = 8, 50, 1000
# Motion shows in the distances between data and those that follow after this number of others.
_LAG = 5
# Largest number of times that the knots are adapted to λ.
_TRIES = 5
# Factor of the λ for which rounding errors are negligible, after a fit that failed.
_COARSER = 1e4
# Number of knots from which the length of a geodesic is determined. Two knots are joined by one geodesic if they are
# closer than the second number times the injectivity radius; more knots are at most as far apart as the third one.
_OF_GEODESIC, _NEAR, _STEP = 32, 0.9, 0.3
# Part of the message for a smoothing without a result.
NO_CURVE = "no spline joins"
# Part of the message for too few data with penalty="jerk".
TOO_FEW = "needs at least 3 data"

DfOfPart = Callable[[Part, SmoothingData, "Knots"], Array]
"""Returns the degrees of freedom of curves through some of the data."""


class Knots(NamedTuple):
    """Knots as the user sees them, and as the core counts them; shape (K,) or (..., K)."""

    t: Array
    times: Doubles

    def of_curves(self, chosen: NDArray[np.intp] | None) -> Knots:
        """Return the knots of some curves of a batch; None selects all curves."""
        if chosen is None or self.times.ndim == 1:
            return self
        t, times = (x.reshape(-1, x.shape[-1])[chosen] for x in (self.t, self.times))
        return Knots(t, np.ascontiguousarray(times))


def knots_for(noisy: SmoothingData, knots: Any) -> Knots:
    """Return the knots of a curve from the argument `knots`: None, their number, or the knots themselves."""
    t, times = noisy.t, noisy.times
    if isinstance(knots, (int, np.integer)) and not isinstance(knots, bool):
        return thin_knots(_different(t, times), int(knots))
    if knots is None:
        return _different(t, times)
    if isinstance(knots, (str, bool)):
        raise ValidationError(f"knots must be None, a number of knots, or an array of them, not {short_repr(knots)}")
    given = as_array(times_of(knots, "knots")[0], "knots")
    if given.ndim != 1:
        raise ValidationError(
            f"knots has shape {given.shape}, but must have shape (K,). All curves have the same knots."
        )
    found, _ = noisy.time_axis.at(knots, noisy.batch, False)
    if found.shape[-1:] < (2,):
        raise ValidationError("knots must have at least two entries")
    if not np.all(np.diff(found) > 0):
        index = int(np.argwhere(~(np.diff(found) > 0))[0][-1])
        raise ValidationError(f"knots[{index + 1}] is not after knots[{index}], but knots must increase")
    ends = np.stack([found[..., 0], found[..., -1]], axis=-1)
    data_ends = np.stack([times[..., 0], times[..., -1]], axis=-1)
    size = np.abs(data_ends).max(axis=-1, keepdims=True)
    if noisy.time_axis.origin is not None and not noisy.time_axis.dates:
        size = size + np.abs(np.asarray(noisy.time_axis.origin, np.float64))[..., None]
    # The last knot of linspace may be a few units in the last place before the last datum.
    beside = (ends != data_ends) & (np.abs(ends - data_ends) <= 4 * np.spacing(size))
    if beside.any():
        found = np.broadcast_to(
            found, (*np.broadcast_shapes(found.shape[:-1], ends.shape[:-1]), found.shape[-1])
        ).copy()
        found[..., [0, -1]] = np.where(beside, data_ends, ends)
    if np.any(found[..., 0] > times[..., 0]) or np.any(found[..., -1] < times[..., -1]):
        raise ValidationError("knots must reach from the first to the last time of the data")
    if noisy.time_axis.dates:
        given = given.astype(np.promote_types(given.dtype, t.dtype))
    elif noisy.time_axis.plain:
        given = found
    # Curves with an origin of time of their own have one row of knots each.
    return Knots(np.broadcast_to(given, found.shape).copy(), found)


def has_all_times(knots: Knots, noisy: SmoothingData) -> bool:
    """Whether there is a knot at every time of data with a nonzero weight."""
    used = np.broadcast_to(noisy.used, (*noisy.batch, noisy.times.shape[-1]))
    if noisy.times.ndim == 1:
        used = np.logical_or.reduce(used.reshape(-1, used.shape[-1]))
    if knots.times.ndim == 1 and noisy.times.ndim == 1:
        return bool(np.isin(noisy.times[used], knots.times).all())
    return bool(np.all([np.isin(t[u], k).all() for t, u, k in zip(noisy.times, used, knots.times, strict=True)]))


def _different(t: Array, times: Doubles) -> Knots:
    if times.ndim == 1:
        _, index = np.unique(times, return_index=True)
        return Knots(t[index], times[index])
    if np.any(np.diff(times) == 0):
        raise ValidationError(
            "times repeat, and each curve has its own times. Pass knots, which apply to all curves, or smooth the "
            "curves one by one."
        )
    return Knots(t, times)


def thin_knots(knots: Knots, count: int) -> Knots:
    """Select a number of knots, distributed evenly in the mean of index and time.

    Neither crowded nor sparse parts then receive too few.
    """
    there = knots.times.shape[-1]
    if count < 2:
        raise ValidationError(f"knots must be at least 2, not {count}")
    if count >= there:
        return knots
    place = np.linspace(0, 1, there)
    if knots.times.ndim == 1:
        place = 0.5 * (place + (knots.times - knots.times[0]) / np.ptp(knots.times))
    index = np.searchsorted(place, np.linspace(0, 1, count) * (1 - 1e-12))
    return _picked(knots, np.unique(np.append(index[:-1], there - 1)))


def merge_close_knots(knots: Knots, noisy: SmoothingData, lam: float | None, power: int, coarser: float = 1.0) -> Knots:
    """Remove knots that are too close together, or move them where curves have knots of their own.

    Rounding errors of λ/h³, or λ/h⁵ for the jerk, would otherwise exceed the weights of the data.

    Parameters
    ----------
    lam : float or None
        λ. If it is None, a λ is assumed that has the same effect as the weights for evenly distributed knots.
    power : int
        Power of time in λ.
    coarser : float, default 1
        Factor of λ, for fits that failed.
    """
    most = 1e11
    times = knots.times
    if times.shape[-1] <= 4 or 0 in noisy.batch:
        return knots
    span = times[..., -1] - times[..., 0]
    mean = span / (times.shape[-1] - 1)
    weight = float(max([np.max(np.mean(own.weights, axis=-1)) for own in noisy.noise]))
    # Units of the mean distance prevent overflow.
    ratio = 1.0 if lam is None else lam / weight
    for _ in range(0 if lam is None else power):
        ratio = ratio / mean
    least = np.minimum(mean * (coarser * ratio / most) ** (1 / power), span / 15)
    if np.all(np.diff(times).min(axis=-1) >= least):
        return knots
    if times.ndim == 1:
        return _picked(knots, _far_apart(times, float(least)))
    shown = knots.t.copy()
    for index in np.ndindex(times.shape[:-1]):
        shown[index] = _moved_apart(shown[index], times[index], _far_apart(times[index], float(least[index])))
    moved, _ = noisy.time_axis.at(shown, times.shape[:-1], True)
    moved[..., [0, -1]] = times[..., [0, -1]]
    return Knots(shown, moved) if np.all(np.diff(moved) > 0) else knots


def _far_apart(times: Doubles, least: float) -> NDArray[np.intp]:
    """Return indices of times that are at least `least` apart, including the first and the last one."""
    # For each time, the index of the first time that is far enough after it.
    following = np.searchsorted(times, times + least).tolist()
    stop = int(np.searchsorted(times, times[-1] - least, side="right"))
    kept, i = [], 0
    while i < max(stop, 1):
        kept.append(i)
        i = max(following[i], i + 1)
    return np.array([*kept, len(times) - 1])


def _moved_apart(t: Array, times: Doubles, kept: NDArray[np.intp]) -> Array:
    """Return the knots that are kept, and new ones in the middle of the longest segments, as many as before in all."""
    own, at = t[kept].tolist() if t.dtype.kind == "f" else list(t[kept]), times[kept].tolist()
    while len(own) < len(t):
        i = int(np.argmax(np.diff(at)))
        step = own[i + 1] - own[i]
        own.insert(i + 1, own[i] + (step / 2 if t.dtype.kind == "f" else step // 2))
        at.insert(i + 1, 0.5 * (at[i] + at[i + 1]))
    return np.array(own, t.dtype)


def with_enough_knots(
    whole: Knots,
    noisy: SmoothingData,
    parts: list[Part],
    run: Callable[[Knots], list[Any]],
    df_of_part: DfOfPart,
    penalty: str,
) -> tuple[list[Any], Knots]:
    """Fit with as many knots as λ and the degrees of freedom require, and return the results and the knots."""
    lams = np.concatenate([part.lam for part in parts])
    given = _of_all(lams) if np.isfinite(lams).all() else None
    power, coarser = (3 if penalty == "acceleration" else 5), 1.0
    at = merge_close_knots(whole, noisy, given, power)
    if at.times.shape[-1] > _MANY:
        at = thin_knots(at, max(_FIRST, _n_knots_for_df(_df_from_parts(noisy, parts, df_of_part, power))))
    for tries in range(_TRIES):
        found = run(at)
        count = at.times.shape[-1]
        faults = [fault.what for own in found for fault in own.faults]
        if any(NO_CURVE not in what and TOO_FEW not in what for what in faults) and tries < _TRIES - 1:
            coarser *= _COARSER
            fewer = merge_close_knots(whole, noisy, given, power, coarser)
            if not np.array_equal(fewer.times, at.times) and fewer.times.shape[-1] <= count:
                at = fewer
                continue
        reports = [own.smoothed.report for own in found]
        apart = merge_close_knots(whole, noisy, _of_all([report.lam for report in reports]), power, coarser)
        most = apart.times.shape[-1]
        enough = _n_knots_for_df([report.df for report in reports])
        if tries == _TRIES - 1 or (count >= most > 0.8 * count and count > 0.8 * min(enough, most)):
            break
        # A stiff curve needs fewer knots than it had, and a rough curve more.
        better = thin_knots(apart, max(_FIRST, 2 * enough)) if most > max(_MANY, 2 * enough) else apart
        if np.array_equal(better.times, at.times):
            break
        at = better
    return found, at


def _df_from_parts(noisy: SmoothingData, parts: list[Part], df_of_part: DfOfPart, power: int) -> float:
    """Estimate the degrees of freedom of a long recording from short parts, in which all times are knots.

    For few knots, the choice of λ takes fast motion for noise. The estimate is that of the liveliest part in any of the
    smoothed spaces, without the geodesic that each part has. It is 0 if there are too few data for parts.
    """
    densest = 0.0
    for part in parts:
        (used,) = np.nonzero((part.noise.weights > 0).reshape(-1, part.noise.weights.shape[-1]).all(axis=0))
        length = min(_PART, len(used) // (2 * _PARTS))
        if length < _FEW or 0 in noisy.batch:
            continue
        for start in _starts(part.space, np.take(part.points, used, axis=part.axis), part.axis, length):
            index = used[start : start + length]
            rows = noisy.rows(index)
            if not (rows.times[..., -1] > rows.times[..., 0]).all():
                continue
            knots = merge_close_knots(_different(rows.t, rows.times), rows, None, power)
            excess = df_of_part(part.rows(index), rows, knots) - 2
            # The share of the recording, as `thin_knots` counts it.
            spans = [np.ptp(times, axis=-1).max() for times in (rows.times, noisy.times)]
            share = 0.5 * (length / len(used) + spans[0] / spans[1])
            densest = float(np.max(excess / share, initial=densest, where=np.isfinite(excess)))
    return densest


def _starts(space: Space, points: Array, axis: int, length: int) -> list[int]:
    """Return where parts of a recording begin: evenly distributed ones, and those in which the data move most.

    ``axis`` is that of the data among the axes of the points.
    """
    total, size = points.shape[axis], length // 4
    starts = np.linspace(0, total - length, _PARTS).astype(int).tolist()
    count = (total - _LAG) // size
    first, second = (points[(slice(None),) * axis + (slice(i, i + count * size),)] for i in (0, _LAG))
    # Outliers do not change the median.
    motion = np.median(space.distance(first, second).reshape(-1, count, size), axis=-1).max(axis=0)
    liveliest = np.argsort(motion)[-_PARTS // 2 :] * size + size // 2 - length // 2
    return sorted({*starts, *np.clip(liveliest, 0, total - length).tolist()})


def _of_all(lams: Any) -> float:
    """Return one λ from which the knots of all curves are selected.

    It is the smallest λ, so that the roughest curve has enough knots, but at least 1e-3 of the largest one.
    """
    flat = np.ravel(lams)
    flat = flat[np.isfinite(flat)]
    return float(max(flat.min(), 1e-3 * flat.max())) if flat.size else 0.0


def _n_knots_for_df(df: Any) -> int:
    """Return a number of knots that is enough for these degrees of freedom.

    Three times as many knots would already lose nothing.
    """
    return 4 * int(np.ceil(np.max(df, initial=2.0, where=np.isfinite(df)))) + 8


def in_gaps(knots: Knots, noisy: SmoothingData) -> Knots:
    """Add knots in long gaps.

    Between two points far apart, the curve of the space may turn faster than one segment can.
    """
    if knots.times.ndim > 1 or len(knots.times) < 3:
        return knots
    h = np.diff(knots.times)
    return _divided(knots, noisy, np.ceil(h * _GAPS / h.sum()).astype(int))


def in_long_gaps(knots: Knots, noisy: SmoothingData) -> Knots:
    """Add knots in long gaps, as far apart as the data usually are, so that the curve minimises the jerk there.

    The minimiser of the integrated squared third derivative is a polynomial of degree five between data. One cubic
    segment per gap cannot approximate it.
    """
    if knots.times.ndim > 1 or len(knots.times) < 3:
        return knots
    h = np.diff(knots.times)
    usual = np.median(h)
    parts = np.where(long_gaps(knots.times), np.minimum(np.ceil(h / usual), _IN_GAP), 1).astype(int)
    return knots if parts.max() == 1 else _divided(knots, noisy, parts)


def places(parts: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the number of the segment of every part, and its number there, for numbers of parts of all segments."""
    i = np.repeat(np.arange(len(parts)), parts)
    return i, np.arange(len(i)) - np.repeat(np.cumsum(parts) - parts, parts)


def _divided(knots: Knots, noisy: SmoothingData, parts: NDArray[np.intp]) -> Knots:
    """Divide every segment into a number of equal parts."""
    i, j = places(parts)
    # Dates are divided in their own unit.
    first, step = knots.t[i], knots.t[i + 1] - knots.t[i]
    whole = step.dtype.kind in "ium"
    shown_times = np.append(first + (step * j // parts[i] if whole else step * (j / parts[i])), knots.t[-1:])
    times, _ = noisy.time_axis.at(shown_times, (), False)
    inner = np.flatnonzero(j == 0)
    times[inner], times[-1] = knots.times[:-1], knots.times[-1]
    return Knots(shown_times, times) if np.all(np.diff(times) > 0) else knots


def _picked(knots: Knots, index: NDArray[np.intp]) -> Knots:
    return Knots(knots.t[..., index], np.ascontiguousarray(knots.times[..., index]))


def geodesic_knots(every: Knots, space: Space, run: Callable[[Knots], list[Array]]) -> Knots:
    """Return the two knots of a geodesic, or more if it is so long that two knots do not determine it.

    Poses keep all knots: rotations and positions on geodesics are not a geodesic of poses.

    Parameters
    ----------
    every : Knots
        The times of the data, or the knots that were given.
    run : callable
        Function that returns the points at given knots in every space in which data are smoothed.
    """
    if any(isinstance(factor, SpecialEuclidean) for factor in factors_of(space)):
        return every
    found = run(thin_knots(every, _OF_GEODESIC))
    ratio = 0.0
    for part, rows in zip(smoothed_spaces(space), found, strict=True):
        starts, ends = part._neighbours(rows)
        good = part._where_finite(starts) & part._where_finite(ends)
        steps = np.zeros(good.shape)
        steps[good] = part.distance(starts[good], ends[good])
        ratio = max(ratio, float(np.max(steps.sum(axis=-1), initial=0.0)) / part.injectivity_radius)
    return thin_knots(every, 2 if ratio < _NEAR else 1 + int(np.ceil(ratio / _STEP)))

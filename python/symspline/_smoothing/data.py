"""Noisy data: validation, and the choice of knots."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._arrays import as_array, refuse, short_repr
from .._core import ValidationError
from .._curves.ends import End, end_kinds, map_ends, split_ends
from .._curves.fit import Points, moved_ends, read, read_ends, validated
from .._faults import INVALID, Fault
from .._input import times_of
from .._options import with_atol
from .._spaces import Array, Doubles, Space, factors_of
from .._time import TimeAxis, knots_of
from .._typing import TimesLike
from .._validation import one_of
from .factors import grouped, smoothed_spaces, split
from .precision import Precision, read_precision

# Segments longer than this fraction of the curve are divided if no curve was found without additional knots.
_GAPS = 12
# The cube of the time between the first and the last datum must not overflow.
_LONGEST = 1e100
# If there are more knots than the first number, the fit begins with the second number of knots or more.
_MANY, _FIRST = 4000, 2000
# Number of short parts of a long recording that are fitted before, and the largest number of data of each.
_PARTS, _PART = 8, 1000
# Motion shows in the distances between data and those that follow after this number of others.
_LAG = 5
# Largest number of times that the knots are adapted to λ.
_TRIES = 4


class SmoothingData(NamedTuple):
    """Noisy data of curves after validation.

    Attributes
    ----------
    time_axis : TimeAxis
        Conversion of times.
    t : ndarray, shape (N,) or (..., N)
        Times as the user sees them.
    times : ndarray
        The same times as the core counts them.
    points : list of ndarray
        Points on the space in every factor. Data of weight zero are replaced by others; masked curves are NaN.
    precisions : list of Precision
        Weights in every space in which data are smoothed.
    batch : tuple of int
        Batch axes.
    """

    time_axis: TimeAxis
    t: Array
    times: Doubles
    points: list[Array]
    precisions: list[Precision]
    batch: tuple[int, ...]

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which data have a nonzero weight in some factor, shape (N,) or (..., N)."""
        return reduce(np.logical_or, [own.weights > 0 for own in self.precisions])

    def map(self, function: Callable[[Any], Any], batch: tuple[int, ...]) -> SmoothingData:
        """Apply a function to the arrays that have batch axes, such as the selection of some curves."""
        t, times = (x if x.ndim == 1 else function(x) for x in (self.t, self.times))
        points, precisions = [function(own) for own in self.points], [own.map(function) for own in self.precisions]
        return self._replace(t=t, times=times, points=points, precisions=precisions, batch=batch)

    def rows(self, index: NDArray[np.intp]) -> SmoothingData:
        """Return some of the data of each curve."""
        at = (slice(None),) * len(self.batch) + (index,)
        points, precisions = [own[at] for own in self.points], [own.rows(index) for own in self.precisions]
        return self._replace(t=self.t[..., index], times=self.times[..., index], points=points, precisions=precisions)


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


Ends = list[list[End] | None]
RunPart = Callable[[Knots, SmoothingData], list[Any]]


def read_noisy(
    t: TimesLike | None, points: Any, space: Space, weights: Any, frames: Any, bc_type: Any, atol: float | None
) -> tuple[SmoothingData, list[Points], Ends]:
    """Return the data of a user without points, the points in every factor, and the end conditions.

    The points are not checked.

    Raises
    ------
    ValidationError
        If another argument is invalid.
    """
    data = with_atol(read(points, space), atol)
    batch, count = data[0].batch, data[0].nodes
    time_axis, shown_times, times = _times_of(t, batch, count)
    precisions = read_precision(weights, frames, space, data)
    if weights is not None:
        each = zip(data, grouped(space, precisions), strict=True)
        data = [_without_missing(part, [one.weights for one in own]) for part, own in each]
    ends = read_ends(moved_ends(bc_type, space, data), space, batch)
    return SmoothingData(time_axis, shown_times, times, [], precisions, batch), data, ends


def checked_ends(bc_type: Any, penalty: Any, method: Any) -> Any:
    """Return the end conditions, by default those that belong to the penalty.

    Raises
    ------
    ValidationError
        If the penalty is unknown, or the end conditions or the method are not available for it.
    """
    if one_of(penalty, "penalty", "acceleration", "jerk") == "jerk":
        if isinstance(method, str) and method == "newton":
            raise ValidationError("method='newton' is not available for penalty='jerk'. Use 'auto' or 'linearized'.")
        if bc_type is not None and not (isinstance(bc_type, str) and bc_type in ("not-a-knot", "periodic")):
            raise ValidationError(
                f"bc_type {short_repr(bc_type)} is not available for penalty='jerk', whose ends are free. Use "
                "'not-a-knot' or 'periodic'."
            )
        return bc_type or "not-a-knot"
    ends = "natural" if bc_type is None else bc_type
    if not isinstance(ends, str):
        split_ends(ends)
    for kind in end_kinds(ends) or []:
        if kind not in ("natural", "velocity"):
            raise ValidationError(
                f"bc_type {kind!r} is not available for smoothing splines. Use 'natural', 'clamped', 'periodic' or "
                "(1, velocity)."
            )
    return ends


def valid_curves(
    noisy: SmoothingData, data: list[Points], ends: Ends, space: Space, mask: NDArray[np.bool_] | None, strict: bool
) -> tuple[SmoothingData, Ends, NDArray[np.intp] | None, list[Fault]]:
    """Select the valid curves of the mask, and project their points onto the space.

    Returns
    -------
    noisy : SmoothingData
        The data of these curves. If some curves are masked, there is one batch axis.
    ends : list
        Their end conditions in every factor.
    chosen : ndarray of int or None
        Their indices in the batch of the user; None for all curves.
    faults : list of Fault
        Faults of curves that became masked.

    Raises
    ------
    ValidationError
        If a point is invalid, or a curve has data at fewer than two times. Unless `strict`, such curves of a batch are
        masked instead.
    """
    batch = noisy.batch
    skip = bool(batch) and not strict
    # Only points are checked here. Times may repeat, knots need not be times of the data, and the ends of a closed
    # curve are noisy and differ.
    plain = np.arange(data[0].nodes, dtype=np.float64)
    natural = read_ends("natural", space, batch)
    points, faults = validated(
        space, plain, data, [own or other for own, other in zip(ends, natural, strict=True)], skip, mask
    )
    noisy = noisy._replace(points=points)
    kept = np.ones(batch, bool) if mask is None else mask.copy()
    kept.flat[[fault.curve for fault in faults]] = False
    for precision in noisy.precisions:
        for number in np.flatnonzero(kept & ~_enough(noisy.times, precision.weights, batch)).tolist():
            too_few = _too_few(precision.weights, batch, number)
            if not skip:
                raise ValidationError(too_few)
            faults.append(Fault(number, INVALID, too_few))
            kept.flat[number] = False
    if kept.all():
        return noisy, ends, None, faults
    chosen = np.flatnonzero(kept)

    def rows(array: Any) -> Any:
        return np.ascontiguousarray(array.reshape(-1, *array.shape[len(batch) :])[chosen])

    return noisy.map(rows, (len(chosen),)), [map_ends(own, rows) for own in ends], chosen, faults


def _times_of(t: TimesLike | None, batch: tuple[int, ...], count: int) -> tuple[TimeAxis, Array, Doubles]:
    time_axis, shown_times, times = knots_of(t, batch, count)
    refuse(~np.isfinite(times), "t", lambda i: f"is {times[i]}; times must be finite")
    back = np.argwhere(np.diff(times) < 0)
    if len(back):
        *curve, i = back[0].tolist()
        raise ValidationError(
            f"t{[*curve, i + 1]} is before t{[*curve, i]}. Sort times and points together, for instance with "
            "order = np.argsort(t)."
        )
    if np.any(times[..., -1] / 2 - times[..., 0] / 2 > _LONGEST):
        raise ValidationError(f"t spans more than {_LONGEST:.0e}, too much for smoothing. Choose another unit of time.")
    return time_axis, shown_times, times


def _without_missing(part: Points, weights: list[Doubles]) -> Points:
    """Replace points of weight zero, which may be NaN, by the last point with a weight before them.

    Points without such a predecessor become the first point that has a weight.
    """
    missing = reduce(np.logical_and, [np.broadcast_to(own == 0, (*part.batch, part.nodes)) for own in weights])
    if not missing.any():
        return part
    order = np.arange(part.nodes)
    last = np.maximum.accumulate(np.where(missing, -1, order), axis=-1)
    first = np.argmin(missing, axis=-1)[..., None]
    found = np.where(last < 0, first, last)
    axes = part.numbers.ndim - found.ndim
    doubles = np.take_along_axis(part.numbers, found.reshape(*found.shape, *[1] * axes), axis=found.ndim - 1)
    return part._replace(numbers=np.ascontiguousarray(doubles))


def _enough(times: Doubles, weights: Doubles, batch: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return which curves have data at two or more different times."""
    shape = (*batch, times.shape[-1])
    used, own = np.broadcast_to(weights > 0, shape), np.broadcast_to(times, shape)
    first, last = np.where(used, own, np.inf).min(-1), np.where(used, own, -np.inf).max(-1)
    return np.asarray(last > first)


def _too_few(weights: Doubles, batch: tuple[int, ...], number: int) -> str:
    index = np.unravel_index(number, batch)
    of = f" of curve {','.join(map(str, index))}" if batch else ""
    own = weights[index] if weights.ndim > 1 else weights
    if not np.any(own > 0):
        return f"All weights of the data{of} are 0. A curve needs points at two or more times."
    return f"The data{of} have one time only. A curve needs points at two or more times."


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


def merge_close_knots(knots: Knots, noisy: SmoothingData, lam: float | None) -> Knots:
    """Remove knots that are too close together.

    Rounding errors of λ/h³ would otherwise exceed the weights of the data. If λ is None, a λ is assumed that has the
    same effect as the weights for evenly distributed knots.
    """
    most = 1e11
    times = knots.times
    if times.ndim > 1 or len(times) <= 16 or 0 in noisy.batch:
        return knots
    span = float(times[-1] - times[0])
    mean = span / (len(times) - 1)
    weight = max(float(np.max(np.mean(own.weights, axis=-1))) for own in noisy.precisions)
    # Units of the mean distance prevent overflow.
    ratio = 1.0 if lam is None else lam / weight / mean / mean / mean
    least = min(mean * (ratio / most) ** (1 / 3), span / 15)
    if np.diff(times).min() >= least:
        return knots
    # Index of the first knot that is far enough from each knot.
    following = np.searchsorted(times, times + least).tolist()
    stop = int(np.searchsorted(times, times[-1] - least, side="right"))
    kept, i = [], 0
    while i < max(stop, 1):
        kept.append(i)
        i = following[i]
    return _picked(knots, np.array([*kept, len(times) - 1]))


def with_enough_knots(
    whole: Knots,
    noisy: SmoothingData,
    space: Space,
    lams: list[Any],
    run: Callable[[Knots], list[Any]],
    run_part: RunPart,
) -> tuple[list[Any], Knots]:
    """Fit with as many knots as λ and the degrees of freedom require, and return the results and the knots.

    ``run_part`` fits other data with free ends.
    """
    given = all(np.isfinite(lam).all() for lam in lams)
    at = merge_close_knots(whole, noisy, _of_all(lams) if given else None)
    if at.times.shape[-1] > _MANY:
        at = thin_knots(at, max(_FIRST, _n_knots_for_df(_df_from_parts(noisy, space, run_part))))
    for tries in range(_TRIES):
        found = run(at)
        count = at.times.shape[-1]
        known = [np.asarray(part.report.lam) for _, part, _ in found]
        apart = merge_close_knots(whole, noisy, _of_all(known))
        most = apart.times.shape[-1]
        enough = max(_n_knots_for_df(part.report.df) for _, part, _ in found)
        if tries == _TRIES - 1 or (most > 0.8 * count and count > 0.8 * min(enough, most)):
            break
        at = thin_knots(apart, max(_FIRST, 2 * enough)) if most > max(_MANY, 2 * enough) else apart
    return found, at


def _df_from_parts(noisy: SmoothingData, space: Space, run_part: RunPart) -> float:
    """Estimate the degrees of freedom of a long recording from short parts, in which all times are knots.

    The choice of λ would take motion for noise that is too fast for the knots. The estimate is that of the liveliest
    part, without the geodesic that each part has.
    """
    (used,) = np.nonzero(np.logical_or.reduce(noisy.used.reshape(-1, noisy.used.shape[-1])))
    length = min(_PART, len(used) // (2 * _PARTS))
    densest = 0.0
    for start in _starts(noisy, space, used, length):
        part = noisy.rows(used[start : start + length])
        if (part.times[..., -1] > part.times[..., 0]).all():
            found = run_part(merge_close_knots(_different(part.t, part.times), part, None), part)
            excess = np.concatenate([np.ravel(own.report.df) for _, own, _ in found]) - 2
            # As `thin_knots` distributes knots.
            spans = [np.ptp(own.times, axis=-1).max() for own in (part, noisy)]
            share = 0.5 * (length / len(used) + spans[0] / spans[1])
            densest = float(np.max(excess / share, initial=densest, where=np.isfinite(excess)))
    return densest


def _starts(noisy: SmoothingData, space: Space, used: NDArray[np.intp], length: int) -> list[int]:
    """Return where parts of a recording begin: evenly distributed ones, and those in which the data move most."""
    starts = np.linspace(0, len(used) - length, _PARTS).astype(int).tolist()
    size = length // 4
    count = (len(used) - _LAG) // size
    for part, points in points_of(noisy, space):
        first, second = (np.take(points, used[i : i + count * size], axis=len(noisy.batch)) for i in (0, _LAG))
        steps = part.distance(first, second).reshape(-1, count, size)
        # Outliers do not change the median.
        motion = np.median(steps, axis=-1).max(axis=0, initial=0.0)
        liveliest = np.argsort(motion)[-_PARTS // 2 :] * size + size // 2 - length // 2
        starts += np.clip(liveliest, 0, len(used) - length).tolist()
    return sorted(set(starts))


def _of_all(lams: list[Any]) -> float:
    """Return one λ from which the knots of all curves are selected.

    It is the smallest λ, so that the roughest curve has enough knots, but at least 1e-3 of the largest one.
    """
    flat = np.concatenate([np.ravel(lam) for lam in lams])
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
    parts = np.ceil(h * _GAPS / h.sum()).astype(int)
    i = np.repeat(np.arange(len(h)), parts)
    j = np.arange(len(i)) - np.repeat(np.cumsum(parts) - parts, parts)
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


def points_of(noisy: SmoothingData, space: Space) -> list[tuple[Space, Array]]:
    """Return every space in which data are smoothed, with its points."""
    points = [own for pair in zip(factors_of(space), noisy.points, strict=True) for own in split(*pair)]
    return list(zip(smoothed_spaces(space), points, strict=True))

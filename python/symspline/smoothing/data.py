"""Noisy data as users give them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import ValidationError
from ..arrays import as_array, cast, shown
from ..curves.fit import Points, read, read_ends, validated
from ..options import within
from ..spaces import Array, Space, factors_of
from ..times import Clock, clock_of

Doubles = NDArray[np.float64]


class Noisy(NamedTuple):
    """Noisy data of curves.

    Attributes:
        clock: how times are counted.
        t: times, shape (N,) or (..., N), as they are shown.
        times: the same in the core.
        points: in every factor, on the space; data of weight zero stand for others.
        weights: shape (N,) or (..., N).
    """

    clock: Clock
    t: Array
    times: Doubles
    points: list[Array]
    weights: Doubles
    batch: tuple[int, ...]


class Knots(NamedTuple):
    """Knots as they are shown, and in the core; shape (K,) or (..., K)."""

    t: Array
    times: Doubles


def read_noisy(
    t: ArrayLike | None, points: Any, space: Space, weights: ArrayLike | None, atol: float | None
) -> Noisy:
    """The data, after all checks.

    Raises:
        ValidationError: something is wrong with them; it says where.
    """
    data = within(read(points, space), atol)
    batch, count = data[0].batch, data[0].nodes
    clock, shown_times, times = _times_of(t, batch, count)
    checked = checked_weights(weights, batch, count)
    if weights is not None:
        data = [_without_missing(part, checked) for part in data]
    # Points only: times may repeat, and knots need not be where data are.
    plain = np.arange(count, dtype=np.float64)
    on_space = validated(space, plain, data, read_ends("natural", space, batch))
    _check_enough(times, checked, batch, count)
    return Noisy(clock, shown_times, times, on_space, checked, batch)


def _times_of(t: ArrayLike | None, batch: tuple[int, ...], count: int) -> tuple[Clock, Array, Doubles]:
    if t is None:
        plain = np.arange(count, dtype=np.float64)
        return Clock(), plain, plain
    clock, shown_times = clock_of(t)
    if shown_times.shape != (count,) and shown_times.shape != (*batch, count):
        own = f" or {(*batch, count)}" if batch else ""
        raise ValidationError(f"t has shape {shown_times.shape}, but {count} points need {(count,)}{own}")
    times = clock.knots(shown_times)
    if not np.isfinite(times).all():
        index = np.argwhere(~np.isfinite(times))[0].tolist()
        raise ValidationError(f"t{index} is {times[tuple(index)]}; times must be finite")
    back = np.argwhere(np.diff(times) < 0)
    if len(back):
        *curve, i = back[0].tolist()
        raise ValidationError(
            f"t{[*curve, i + 1]} is before t{[*curve, i]}; sort times and points together, e.g. "
            "order = np.argsort(t)"
        )
    return clock, shown_times, times


def checked_weights(weights: ArrayLike | None, batch: tuple[int, ...], count: int) -> Doubles:
    """Weights, one of every point."""
    if weights is None:
        return np.ones(count)
    array = as_array(weights, "weights")
    if array.dtype.kind not in "iufb":
        raise ValidationError(f"weights must be numbers, not {array.dtype}")
    found = cast(array)
    if found.shape != (count,) and found.shape != (*batch, count):
        own = f" or {(*batch, count)}" if batch else ""
        raise ValidationError(f"weights has shape {found.shape}, but {count} points need {(count,)}{own}")
    bad = ~(np.isfinite(found) & (found >= 0))
    if bad.any():
        index = np.argwhere(bad)[0].tolist()
        raise ValidationError(
            f"weights{index} is {found[tuple(index)]}; weights are numbers >= 0, and 0 leaves a point out"
        )
    return found


def _without_missing(part: Points, weights: Doubles) -> Points:
    """Points of weight zero, which may be NaN, stand for the nearest others before or after them."""
    missing = np.broadcast_to(weights == 0, (*part.batch, part.nodes))
    if not missing.any():
        return part
    order = np.arange(part.nodes)
    last = np.maximum.accumulate(np.where(missing, -1, order), axis=-1)
    first = np.argmin(missing, axis=-1)[..., None]
    found = np.where(last < 0, first, last)
    axes = part.doubles.ndim - found.ndim
    doubles = np.take_along_axis(part.doubles, found.reshape(*found.shape, *[1] * axes), axis=found.ndim - 1)
    return part._replace(doubles=np.ascontiguousarray(doubles))


def _check_enough(times: Doubles, weights: Doubles, batch: tuple[int, ...], count: int) -> None:
    """Two different times at least."""
    shape = (*batch, count)
    used = np.broadcast_to(weights > 0, shape)
    own = np.where(used, np.broadcast_to(times, shape), np.nan)
    good = used.any(axis=-1)
    first, last = np.where(good, np.nanmin(np.where(used, own, np.inf), -1), 0), np.zeros(batch)
    last = np.where(good, np.nanmax(np.where(used, own, -np.inf), -1), 0)
    if not np.all(last > first):
        index = np.argwhere(~(last > first))[0].tolist()
        of = f" of curve {','.join(map(str, index))}" if batch else ""
        raise ValidationError(f"the data{of} lie at one time; a curve needs points at two times at least")


def knots_for(noisy: Noisy, knots: Any) -> Knots:
    """Knots: None for all different times, a number of them, or the knots themselves."""
    t, times = noisy.t, noisy.times
    if isinstance(knots, (int, np.integer)) and not isinstance(knots, bool):
        return _some(_different(t, times), int(knots))
    if knots is None:
        return _different(t, times)
    if isinstance(knots, (str, bool)):
        raise ValidationError(
            f"knots must be None, a number of knots, or an array of them, not {shown(knots)}"
        )
    found, _ = noisy.clock.at(knots, noisy.batch, False)
    if found.ndim > 1 and np.ndim(noisy.clock.origin) == 0:
        raise ValidationError("knots are those of all curves, shape (K,)")
    if found.shape[-1:] < (2,):
        raise ValidationError("knots: a curve needs at least two")
    if not np.all(np.diff(found) > 0):
        index = int(np.argwhere(~(np.diff(found) > 0))[0][-1])
        raise ValidationError(f"knots[{index + 1}] is not behind knots[{index}]; knots must increase")
    if np.any(found[..., 0] > times[..., 0]) or np.any(found[..., -1] < times[..., -1]):
        raise ValidationError("knots must reach from the first to the last time of the data")
    given = np.asarray(knots)
    if noisy.clock.dates:
        given = given.astype(np.promote_types(given.dtype, t.dtype))
    elif noisy.clock.plain:
        given = found
    return Knots(given, found)


def _different(t: Array, times: Doubles) -> Knots:
    if times.ndim == 1:
        _, index = np.unique(times, return_index=True)
        return Knots(t[index], times[index])
    if np.any(np.diff(times) == 0):
        raise ValidationError(
            "times repeat, and curves have times of their own: give knots, which all curves have alike, or smooth "
            "the curves one by one"
        )
    return Knots(t, times)


def _some(all_knots: Knots, count: int) -> Knots:
    """So many of the knots, evenly counted."""
    there = all_knots.times.shape[-1]
    if count < 2:
        raise ValidationError(f"knots must be at least 2, not {count}")
    index = np.unique(np.round(np.linspace(0, there - 1, min(count, there))).astype(int))
    return Knots(all_knots.t[..., index], np.ascontiguousarray(all_knots.times[..., index]))


def points_of(noisy: Noisy, space: Space) -> list[tuple[Space, Array]]:
    """Every factor with its points."""
    return list(zip(factors_of(space), noisy.points, strict=True))

"""Noisy data as users give them."""

from __future__ import annotations

from functools import reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import ValidationError
from ..arrays import as_array, shown
from ..curves.ends import End
from ..curves.fit import Points, read, read_ends, validated
from ..handed import times_of
from ..options import within
from ..spaces import Array, Space, factors_of
from ..times import Clock, knots_of
from .weighing import Weighing, read_weighing

Doubles = NDArray[np.float64]


class Noisy(NamedTuple):
    """Noisy data of curves.

    Attributes:
        clock: how times are counted.
        t: times, shape (N,) or (..., N), as they are shown.
        times: the same in the core.
        points: in every factor, on the space; data of weight zero stand for others.
        weighing: in every factor.
    """

    clock: Clock
    t: Array
    times: Doubles
    points: list[Array]
    weighing: list[Weighing]
    batch: tuple[int, ...]

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which data count in some factor, shape (N,) or (..., N)."""
        return reduce(np.logical_or, [own.weights > 0 for own in self.weighing])


class Knots(NamedTuple):
    """Knots as they are shown, and in the core; shape (K,) or (..., K)."""

    t: Array
    times: Doubles


def read_noisy(
    t: ArrayLike | None,
    points: Any,
    space: Space,
    weights: Any,
    frames: Any,
    bc_type: Any,
    atol: float | None,
) -> tuple[Noisy, list[list[End] | None]]:
    """The data, and the conditions at the ends in every factor, after all checks.

    Raises:
        ValidationError: something is wrong with them; it says where.
    """
    data = within(read(points, space), atol)
    batch, count = data[0].batch, data[0].nodes
    clock, shown_times, times = _times_of(t, batch, count)
    weighing = read_weighing(weights, frames, space, data)
    if weights is not None:
        data = [_without_missing(part, own.weights) for part, own in zip(data, weighing, strict=True)]
    # Points only: times may repeat, and knots need not be where data are.
    plain = np.arange(count, dtype=np.float64)
    ends = read_ends(bc_type, space, batch)
    for kind, _ in (end for own in ends for end in own or []):
        if kind not in ("natural", "velocity"):
            raise ValidationError(
                f"bc_type {kind!r} is no end of a smooth curve: 'natural', 'clamped', 'periodic', or (1, velocity)"
            )
    # The ends of a closed curve are noisy, too, and differ.
    natural = read_ends("natural", space, batch)
    on_space = validated(space, plain, data, [own or other for own, other in zip(ends, natural, strict=True)])
    for own in weighing:
        _check_enough(times, own.weights, batch, count)
    return Noisy(clock, shown_times, times, on_space, weighing, batch), ends


def _times_of(t: ArrayLike | None, batch: tuple[int, ...], count: int) -> tuple[Clock, Array, Doubles]:
    clock, shown_times, times = knots_of(t, batch, count)
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
    own = np.broadcast_to(times, shape)
    first, last = np.where(used, own, np.inf).min(-1), np.where(used, own, -np.inf).max(-1)
    if not np.all(last > first):
        index = np.argwhere(~(last > first))[0].tolist()
        of = f" of curve {','.join(map(str, index))}" if batch else ""
        if not used[tuple(index)].any():
            raise ValidationError(
                f"all weights of the data{of} are 0; a curve needs points at two times at least"
            )
        raise ValidationError(f"the data{of} lie at one time; a curve needs points at two times at least")


def knots_for(noisy: Noisy, knots: Any) -> Knots:
    """Knots: None for all different times, a number of them, or the knots themselves."""
    t, times = noisy.t, noisy.times
    if isinstance(knots, (int, np.integer)) and not isinstance(knots, bool):
        return some(_different(t, times), int(knots))
    if knots is None:
        return _different(t, times)
    if isinstance(knots, (str, bool)):
        raise ValidationError(
            f"knots must be None, a number of knots, or an array of them, not {shown(knots)}"
        )
    given = as_array(times_of(knots, "knots")[0], "knots")
    if given.ndim != 1:
        raise ValidationError("knots are those of all curves, shape (K,)")
    found, _ = noisy.clock.at(knots, noisy.batch, False)
    if found.shape[-1:] < (2,):
        raise ValidationError("knots: a curve needs at least two")
    if not np.all(np.diff(found) > 0):
        index = int(np.argwhere(~(np.diff(found) > 0))[0][-1])
        raise ValidationError(f"knots[{index + 1}] is not behind knots[{index}]; knots must increase")
    if np.any(found[..., 0] > times[..., 0]) or np.any(found[..., -1] < times[..., -1]):
        raise ValidationError("knots must reach from the first to the last time of the data")
    if noisy.clock.dates:
        given = given.astype(np.promote_types(given.dtype, t.dtype))
    elif noisy.clock.plain:
        given = found
    # Curves that count from a time of their own each have them.
    return Knots(np.broadcast_to(given, found.shape).copy(), found)


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


def some(knots: Knots, count: int) -> Knots:
    """So many of the knots, even in what is half their number and half time: neither crowds nor thin places get few."""
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


def sparse(knots: Knots, noisy: Noisy, lam: float | None) -> Knots:
    """The knots without those that lie too near to each other: beside λ/h³ rounding makes the weights of data vanish.
    None for a λ like a weight on knots at equal distances."""
    most = 1e11
    times = knots.times
    if times.ndim > 1 or len(times) <= 16:
        return knots
    span = float(times[-1] - times[0])
    mean = span / (len(times) - 1)
    weight = max(float(np.max(np.mean(own.weights, axis=-1))) for own in noisy.weighing)
    # In units of the mean distance nothing overflows.
    ratio = 1.0 if lam is None else lam / weight / mean / mean / mean
    least = min(mean * (ratio / most) ** (1 / 3), span / 15)
    if np.diff(times).min() >= least:
        return knots
    # From each knot to the first that is far enough.
    following = np.searchsorted(times, times + least).tolist()
    stop = int(np.searchsorted(times, times[-1] - least, side="right"))
    kept, i = [], 0
    while i < max(stop, 1):
        kept.append(i)
        i = following[i]
    return _picked(knots, np.array([*kept, len(times) - 1]))


def _picked(knots: Knots, index: NDArray[np.intp]) -> Knots:
    return Knots(knots.t[..., index], np.ascontiguousarray(knots.times[..., index]))


def points_of(noisy: Noisy, space: Space) -> list[tuple[Space, Array]]:
    """Every factor with its points."""
    return list(zip(factors_of(space), noisy.points, strict=True))

"""Noisy data and their validation."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import one_of, short_repr
from .._base.faults import INVALID, Fault
from .._base.time import TimeAxis, knots_of
from .._base.typing import TimesLike
from .._core import ValidationError
from .._curves.ends import NATURAL, End, end_kinds, map_ends, split_ends
from .._curves.fit import Points, moved_ends, read, read_ends, validated
from .._curves.missing import refuse_nan_times
from .._curves.options import with_atol
from .._spaces import Array, Doubles, Space, factors_of
from .noise import Noise, grouped, parts_of_factor, per_part, read_precision, split

# The cube of the time between the first and the last datum must not overflow.
_LONGEST = 1e100


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
    noise : list of Noise
        Noise in every space in which data are smoothed.
    batch : tuple of int
        Batch axes.
    """

    time_axis: TimeAxis
    t: Array
    times: Doubles
    points: list[Array]
    noise: list[Noise]
    batch: tuple[int, ...]

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which data have a nonzero weight in some factor, shape (N,) or (..., N)."""
        return reduce(np.logical_or, [own.weights > 0 for own in self.noise])

    def map(self, function: Callable[[Any], Any], batch: tuple[int, ...]) -> SmoothingData:
        """Apply a function to the arrays that have batch axes, such as the selection of some curves."""
        t, times = (x if x.ndim == 1 else function(x) for x in (self.t, self.times))
        points, noise = [function(own) for own in self.points], [own.map(function) for own in self.noise]
        return self._replace(t=t, times=times, points=points, noise=noise, batch=batch)

    def rows(self, index: NDArray[np.intp]) -> SmoothingData:
        """Return some of the data of each curve."""
        points = [np.take(own, index, axis=len(self.batch)) for own in self.points]
        noise = [own.rows(index) for own in self.noise]
        return self._replace(t=self.t[..., index], times=self.times[..., index], points=points, noise=noise)


Ends = list[list[End] | None]


def read_noisy(
    t: TimesLike | None,
    points: Any,
    space: Space,
    weights: Any,
    frames: Any,
    sigma: Any,
    loss: Any,
    bc_type: Any,
    atol: float | None,
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
    given = read_precision(weights, frames, space, data)
    if weights is not None:
        each = zip(data, grouped(space, given), strict=True)
        data = [_without_missing(part, [one.weights for one in own]) for part, own in each]
    ends = read_ends(moved_ends(bc_type, space, data), space, batch)
    sigmas = per_part(space, sigma, "sigma", batch)
    # Two points have no outliers and do not determine the noise level.
    loss = "linear" if count == 2 else loss
    noise = [own._replace(sigma=sigma, loss=loss) for own, sigma in zip(given, sigmas, strict=True)]
    return SmoothingData(time_axis, shown_times, times, [], noise, batch), data, ends


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
    for noise in noisy.noise:
        for number in np.flatnonzero(kept & ~_enough(noisy.times, noise.weights, batch)).tolist():
            too_few = _too_few(noise.weights, batch, number)
            if not skip:
                raise ValidationError(too_few)
            faults.append(Fault(number, INVALID, too_few))
            kept.flat[number] = False
    if kept.all():
        return noisy, ends, None, faults
    chosen = np.flatnonzero(kept)

    def rows(array: Any) -> Any:
        return np.ascontiguousarray(array.reshape(-1, *array.shape[len(batch) :])[chosen])

    noisy = noisy.map(rows, (len(chosen),))
    noisy = noisy._replace(noise=[own._replace(sigma=own.sigma[chosen]) for own in noisy.noise])
    return noisy, [map_ends(own, rows) for own in ends], chosen, faults


def _times_of(t: TimesLike | None, batch: tuple[int, ...], count: int) -> tuple[TimeAxis, Array, Doubles]:
    time_axis, shown_times, times = knots_of(t, batch, count)
    refuse_nan_times(times)
    back = np.argwhere(np.diff(times) < 0)
    if len(back):
        *curve, i = back[0].tolist()
        later, earlier = shown_times[(*curve, i + 1)], shown_times[(*curve, i)]
        raise ValidationError(
            f"t{[*curve, i + 1]} = {later} is before t{[*curve, i]} = {earlier}. Sort times and points together, for "
            "instance with order = np.argsort(t)."
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


def points_of(noisy: SmoothingData, space: Space) -> list[tuple[Space, Array]]:
    """Return every space in which data are smoothed, with its points."""
    return [
        pair
        for factor, points in zip(factors_of(space), noisy.points, strict=True)
        for pair in zip(parts_of_factor(factor), split(factor, points), strict=True)
    ]


class Part(NamedTuple):
    """Data in one of the spaces in which they are smoothed.

    Attributes
    ----------
    space : Space
        The space.
    points : ndarray, shape (..., N, *point_shape)
        Points.
    noise : Noise
        Their noise.
    lam : ndarray, shape (curves,)
        λ, infinite for geodesics and NaN where it is chosen.
    ends : list of End or None
        End conditions; None for closed curves.
    """

    space: Space
    points: Array
    noise: Noise
    lam: Doubles
    ends: list[End] | None

    @property
    def axis(self) -> int:
        """The axis of the data among those of the points."""
        return self.points.ndim - len(self.space.point_shape) - 1

    def map(self, function: Callable[[Any], Any], noise: Noise) -> Part:
        """Apply a function to the arrays, such as one that adds masked curves, and replace the noise."""
        ends = map_ends(self.ends, function)
        return Part(self.space, function(self.points), noise, function(self.lam), ends)

    def rows(self, index: NDArray[np.intp]) -> Part:
        """Return some of the data of each curve, with natural ends."""
        points, noise = np.take(self.points, index, axis=self.axis), self.noise.rows(index)
        return self._replace(points=points, noise=noise, ends=NATURAL)


def parts_of(noisy: SmoothingData, space: Space, lams: list[Doubles], ends: Ends) -> list[Part]:
    """Return the data in every space in which they are smoothed."""
    each = zip(points_of(noisy, space), noisy.noise, lams, ends, strict=True)
    return [Part(*pair, noise, lam, own) for pair, noise, lam, own in each]

"""Points of smooth curves at their knots: the choice of the knots, and calls of the compiled core.

The knots are those of the user, or as many as the degrees of freedom require. The core starts from means of
neighbouring data. If the noise is a large fraction of the distance to the cut locus, or consecutive data are far apart,
the iteration may end in a minimum that is not the global one. Further starts are then tried.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.arrays import as_array, short_repr
from .._base.faults import UNCONVERGED, Fault
from .._base.input import times_of
from .._base.report import long_gaps
from .._base.typing import BCType, Number, Progress, TimesLike
from .._core import ValidationError
from .._curves.curve import CurveArrays
from .._curves.failures import cut_fractions_in_core
from .._curves.reduced import Span, reduced
from .._spaces import (
    AnySpace,
    Array,
    ComplexGrassmannian,
    ComplexProjective,
    Doubles,
    Euclidean,
    Grassmannian,
    RealProjective,
    Space,
    SpecialEuclidean,
    SpecialOrthogonal,
    Sphere,
    Torus,
    factors_of,
    nearest_rotations,
)
from .noise import Noise, Part, SmoothingData, smoothed_spaces
from .report import METHODS, Posterior, SmoothingReport

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
# States of curves, as the core numbers them: converged, not converged, no spline joins the points, the data do not
# determine the curve, the choice of λ does not converge.
CONVERGED, UNSOLVED, NO_CURVE, UNDETERMINED, UNSETTLED = range(5)
# Smallest number of data with a penalty on the jerk.
_FEWEST = 3

DfOfPart = Callable[[Part, SmoothingData, "Knots"], Array]
"""Returns the degrees of freedom of curves through some of the data."""


class Knots(NamedTuple):
    """Knots as the user sees them, and as the core counts them; shape (K,) or (..., K)."""

    t: Array
    times: Doubles

    def of_curves(self, chosen: NDArray[np.intp]) -> Knots:
        """Return the knots of some curves of a batch."""
        if self.times.ndim == 1:
            return self
        t, times = (x.reshape(-1, x.shape[-1])[chosen] for x in (self.t, self.times))
        return Knots(t, np.ascontiguousarray(times))


def knots_for(noisy: SmoothingData, knots: TimesLike | None) -> Knots:
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
    at, _ = noisy.time_axis.at(knots, noisy.batch, False)
    if at.shape[-1:] < (2,):
        raise ValidationError("knots must have at least two entries")
    if not np.all(np.diff(at) > 0):
        index = int(np.argwhere(~(np.diff(at) > 0))[0][-1])
        raise ValidationError(f"knots[{index + 1}] is not after knots[{index}], but knots must increase")
    ends = np.stack([at[..., 0], at[..., -1]], axis=-1)
    data_ends = np.stack([times[..., 0], times[..., -1]], axis=-1)
    size = np.abs(data_ends).max(axis=-1, keepdims=True)
    if noisy.time_axis.origin is not None and not noisy.time_axis.dates:
        size = size + np.abs(np.asarray(noisy.time_axis.origin, np.float64))[..., None]
    # The last knot of linspace may be a few units in the last place before the last datum.
    beside = (ends != data_ends) & (np.abs(ends - data_ends) <= 4 * np.spacing(size))
    if beside.any():
        at = np.broadcast_to(at, (*np.broadcast_shapes(at.shape[:-1], ends.shape[:-1]), at.shape[-1])).copy()
        at[..., [0, -1]] = np.where(beside, data_ends, ends)
    if np.any(at[..., 0] > times[..., 0]) or np.any(at[..., -1] < times[..., -1]):
        raise ValidationError("knots must reach from the first to the last time of the data")
    if noisy.time_axis.dates:
        given = given.astype(np.promote_types(given.dtype, t.dtype))
    elif noisy.time_axis.plain:
        given = at
    # Curves with an origin of time of their own have one row of knots each.
    return Knots(np.broadcast_to(given, at.shape).copy(), at)


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
    ratio = 1.0
    if lam is not None:
        heaviest = 0.0
        for noise in noisy.noise:
            heaviest = max(heaviest, float(np.max(np.mean(noise.weights, axis=-1))))
        ratio = lam / heaviest
        # Units of the mean distance prevent overflow.
        for _ in range(power):
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
    shown, at = t[kept].tolist() if t.dtype.kind == "f" else list(t[kept]), times[kept].tolist()
    while len(shown) < len(t):
        i = int(np.argmax(np.diff(at)))
        step = shown[i + 1] - shown[i]
        shown.insert(i + 1, shown[i] + (step / 2 if t.dtype.kind == "f" else step // 2))
        at.insert(i + 1, 0.5 * (at[i] + at[i + 1]))
    return np.array(shown, t.dtype)


def with_enough_knots(
    whole: Knots,
    noisy: SmoothingData,
    parts: list[Part],
    lams: list[Doubles],
    run: Callable[..., list[SmoothCurves]],
    df_of_part: DfOfPart,
    penalty: str,
) -> tuple[list[SmoothCurves], Knots]:
    """Fit with as many knots as λ and the degrees of freedom require, and return the results and the knots.

    If λ or σ may vary, the knots are those of a fit with one λ, but at least as many as the liveliest part requires.
    """
    adapts = any(any(part.adapts) for part in parts)
    given = _of_all(np.concatenate(lams)) if np.isfinite(lams).all() else None
    power, coarser = (3 if penalty == "acceleration" else 5), 1.0
    at = merge_close_knots(whole, noisy, given, power)
    if at.times.shape[-1] > _MANY:
        at = thin_knots(at, max(_FIRST, _n_knots_for_df(_df_from_parts(noisy, parts, df_of_part, power))))
    for tries in range(_TRIES):
        results = run(at)
        count = at.times.shape[-1]
        if tries < _TRIES - 1 and any(map(_may_settle, results, parts)):
            coarser *= _COARSER
            fewer = merge_close_knots(whole, noisy, given, power, coarser)
            if not np.array_equal(fewer.times, at.times) and fewer.times.shape[-1] <= count:
                at = fewer
                continue
        chosen, dfs = [], []
        for result in results:
            report = result.smoothed.report
            chosen.append(report.lam)
            dfs.append(report.df)
        apart = merge_close_knots(whole, noisy, _of_all(np.array(chosen)), power, coarser)
        most, enough = apart.times.shape[-1], _n_knots_for_df(np.array(dfs))
        if tries == _TRIES - 1 or (count >= most > 0.8 * count and count > 0.8 * min(enough, most)):
            break
        # A stiff curve needs fewer knots than it had, and a rough curve more.
        better = thin_knots(apart, max(_FIRST, 2 * enough)) if most > max(_MANY, 2 * enough) else apart
        if np.array_equal(better.times, at.times) or (adapts and better.times.shape[-1] <= count):
            break
        at = better
    if adapts:
        results = run(at, adapt=True)
        enough = _n_knots_for_df(np.concatenate([np.ravel(result.smoothed.report.df) for result in results]))
        if at.times.shape[-1] < min(enough, apart.times.shape[-1]):
            at = thin_knots(apart, 2 * enough)
            results = run(at, adapt=True)
    return results, at


def _may_settle(result: SmoothCurves, part: Part) -> bool:
    """Whether a curve failed that may converge with fewer knots."""
    failed = (result.states != CONVERGED) & (result.states != NO_CURVE)
    if failed.any() and result.smoothed.penalty == "jerk":
        failed &= (result.states != UNDETERMINED) | (np.sum(part.noise.weights > 0, axis=-1).ravel() >= _FEWEST)
    return bool(failed.any())


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


def _of_all(lams: Doubles) -> float:
    """Return one λ from which the knots of all curves are selected.

    It is the smallest λ, so that the roughest curve has enough knots, but at least 1e-3 of the largest one.
    """
    flat = np.ravel(lams)
    flat = flat[np.isfinite(flat)]
    return float(max(flat.min(), 1e-3 * flat.max())) if flat.size else 0.0


def _n_knots_for_df(df: Doubles | float) -> int:
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
    points = run(thin_knots(every, _OF_GEODESIC))
    ratio = 0.0
    for part, rows in zip(smoothed_spaces(space), points, strict=True):
        starts, ends = part._neighbours(rows)
        good = part._where_finite(starts) & part._where_finite(ends)
        steps = np.zeros(good.shape)
        steps[good] = part.distance(starts[good], ends[good])
        ratio = max(ratio, float(np.max(steps.sum(axis=-1), initial=0.0)) / part.injectivity_radius)
    return thin_knots(every, 2 if ratio < _NEAR else 1 + int(np.ceil(ratio / _STEP)))


# ---- calls of the core ----

# Standard deviation of the noise, divided by the injectivity radius, from which a second start is tried: 34° on a
# circle. In all experiments with less noise, the first start led to the best minimum.
_NOISY = 0.19
# The same ratio from which the best minimum found may be a wrong one: 52° on a circle.
_TOO_NOISY = 0.29
# Median step between the data, as a fraction of the distance to the cut locus, from which the data are a start, unless
# the noise of the curve found is less than the second number times the injectivity radius.
_FAST, _SMALL = 0.6, 0.05
# Noise, divided by the injectivity radius, from which the curve of data with far steps may be wrong.
_FAST_NOISY = 0.03
# Objectives that differ by less than this multiple of the variance are nearly equal. Curves are different if they are
# farther apart than this fraction of the injectivity radius.
_EQUAL, _OTHER = 12.0, 0.5
# Largest number of coordinates of an embedding.
_WIDE = 64

# Kinds of results that may be wrong.
UNIQUE, TWO, NOISY, FAST = range(4)


class Smoothed(NamedTuple):
    """Properties of the smoothing in one space.

    Attributes
    ----------
    report : SmoothingReport
        Report.
    band : ndarray, shape (..., K, 4), or (..., K + 2, 4) for closed curves
        Band of A⁻¹, from which the variances of the curve for noise of variance one follow.
    band_lam : float or ndarray
        The λ that belongs to `band`; for a robust loss, that of the pseudo-data.
    sigma : float or ndarray
        Standard deviation of one coordinate that scales the bands, estimated or given.
    posterior : Posterior or None
        Matrix from which covariances and samples follow; None for curves from files of older versions.
    between : bool
        Whether the variance between the knots is included. It is if there is a knot at every time of the data: the
        curve is then the mean of a process. With other knots it is a spline, which has no such freedom.
    penalty : str
        Penalty of the fit.
    profile : ndarray or None, shape (..., K - 1)
        λ of the segments divided by λ of the report, their geometric mean; None for one λ.
    noise_profile : ndarray or None, shape (..., K)
        ln σ² at the knots minus that of `sigma`, linear between them; None for one σ.
    """

    report: SmoothingReport
    band: Doubles
    band_lam: Number
    sigma: Number
    between: bool
    posterior: Posterior | None = None
    penalty: str = "acceleration"
    profile: Doubles | None = None
    noise_profile: Doubles | None = None

    def map(self, function: Callable[[Any], Any]) -> Smoothed:
        """Apply a function to all arrays, such as the selection of some curves.

        Profiles that are constant in all of the curves are omitted, as if these curves had been fitted alone.
        """
        return self._replace(
            report=self.report.map(function),
            band=function(self.band),
            band_lam=function(self.band_lam),
            sigma=function(self.sigma),
            posterior=self.posterior and self.posterior.map(function),
            profile=None if self.profile is None else if_varying(function(self.profile)),
            noise_profile=None if self.noise_profile is None else if_varying(function(self.noise_profile)),
        )

    def profile_of(self, index: tuple[int, ...]) -> Doubles | None:
        """Return λ of the segments of one curve divided by λ; None if they are equal."""
        return None if self.profile is None else if_varying(np.ascontiguousarray(self.profile[index]))


def if_varying(profile: Doubles) -> Doubles | None:
    """Return a profile, or None if it is constant in every curve. Failed and masked curves have NaN."""
    return profile if np.any(np.abs(np.diff(profile, axis=-1)) > 0) else None


class SmoothedSpline(Protocol):
    """What the audit and the bands in gaps read of a smoothing spline."""

    _noisy: SmoothingData
    _smoothed: list[Smoothed]
    _curve: CurveArrays

    @property
    def space(self) -> AnySpace: ...

    @property
    def _bc_type(self) -> BCType: ...

    def _knots_of(self, index: tuple[int, ...]) -> Doubles: ...

    def _posterior(self, part: Smoothed) -> Posterior: ...

    def _plain_spread(self, number: int, index: tuple[int, ...], x: Doubles, nu: int) -> Doubles: ...


class SolverOptions(NamedTuple):
    """Options of the smoothing. The core validates the words."""

    criterion: str
    gamma: float
    penalty: str
    method: str
    tol: float
    max_iter: int
    raise_lam: bool


class SmoothCurves(NamedTuple):
    """Smooth curves in one space.

    Attributes
    ----------
    points : ndarray, shape (..., K, *point_shape)
        Points at the knots.
    smoothed : Smoothed
        Properties of the smoothing.
    states : ndarray of int, shape (curves,)
        States of the curves, `CONVERGED` or one of the failures.
    selection, rejected : ndarray of int
        Kind of the selection of a robust loss, which is 0 if it can be trusted, and the number of rejected data.
    minima : ndarray of int
        Kinds of the minima, see `best_of_starts`.
    doubts : ndarray, shape (..., 3)
        Of λ and σ that vary: 1 if both of them do although only one may, 1 if the data hardly decide which of them
        does, and the time of an isolated outlier or NaN.
    """

    points: Array
    smoothed: Smoothed
    states: NDArray[np.int_]
    selection: NDArray[np.int_]
    rejected: NDArray[np.int_]
    minima: NDArray[np.int_]
    doubts: Doubles

    def map(self, function: Callable[[Array], Array]) -> SmoothCurves:
        """Apply a function to all arrays, such as one that adds masked curves."""
        columns = map(function, (self.selection, self.rejected, self.minima, self.doubts))
        return SmoothCurves(function(self.points), self.smoothed.map(function), self.states, *columns)


def smoothed(
    parts: list[Part],
    noisy: SmoothingData,
    knots: Knots,
    options: SolverOptions,
    between: bool,
    progress: Progress | None,
    adapt: bool = False,
) -> list[SmoothCurves]:
    """Compute the points of smooth curves at the knots in every space in which data are smoothed.

    λ and σ vary where the parts allow it, but only if `adapt` is True.
    """
    batch, t, at = noisy.batch, np.ascontiguousarray(noisy.times), np.ascontiguousarray(knots.times)
    how = *options[:3], parts[0].noise.loss, *options[3:], progress
    inside, factors = [], []
    for part in parts:
        noise, ends, matrices = part.noise, part.ends, part.noise.information
        small, points, span = reduced(part.space, part.points)
        if span is not None and any(vector is not None for _, vector in ends or []):
            raise ValidationError(f"the dimension of {part.space!r} is too large for end velocities. Use natural ends.")
        if matrices is not None:
            matrices = np.ascontiguousarray(np.broadcast_to(matrices, (*batch, *matrices.shape[-3:])))
        points = np.ascontiguousarray(points)
        inside.append((small, points, span))
        factors.append(
            (
                *(small._handle, small._as_doubles(points), noise.weights, matrices, part.lam, noise.sigma, ends),
                *(None, part.profile, (False, False)),
            )
        )
    results = []
    for part, (small, points, span), factor, raw in zip(
        parts, inside, factors, _core.smooth(factors, t, at, *how), strict=True
    ):

        def solve(lam: Doubles, start: Doubles, factor: _core._Smoothable = factor) -> Raw:
            return Raw.of(_core.smooth([(*factor[:4], lam, *factor[5:7], start, *factor[8:])], t, at, *how)[0])

        samples = Samples(t, points, part.noise.weights, at, len(small._point_shape), part.ends is None)
        best, minima = best_of_starts(small, samples, part.lam, Raw.of(raw), solve)
        if adapt and any(part.adapts) and at.shape[-1] > 2:
            start = np.ascontiguousarray(best.points)
            varying = Raw.of(_core.smooth([(*factor[:7], start, part.profile, part.adapts)], t, at, *how)[0])
            best = best.or_varying(varying)
        results.append(_smooth_curves(part, noisy, options, between, small, span, best, minima))
    return results


def _smooth_curves(
    part: Part,
    noisy: SmoothingData,
    options: SolverOptions,
    between: bool,
    small: Space,
    span: Span | None,
    raw: Raw,
    minima: NDArray[np.int_],
) -> SmoothCurves:
    batch, sigma = noisy.batch, part.noise.sigma
    shaped: list[Any] = []
    for column in (*raw.columns, np.where(np.isnan(sigma), raw.columns.sigma, sigma)):
        shaped.append(column.reshape(batch) if batch else column[0].item())
    state, iterations, lam, band_lam, at_bound, df, estimated, step, rate, _, exact, _, _, _, scale = shaped
    selection, rejected = raw.columns.selection.reshape(batch), raw.columns.rejected.reshape(batch)
    method = METHODS[int(np.any(exact))]
    profile, noise_profile, gains = part.profile, None, None
    doubts = [np.zeros(batch), np.zeros(batch), np.full(batch, np.nan)]
    if raw.profiles is not None:
        profile, noise_profile, gains, *doubts = raw.profiles
    if part.profile is not None:
        profile = part.profile
    if profile is not None:
        profile = if_varying(profile.reshape(*batch, -1))
    if noise_profile is not None:
        noise_profile = if_varying(noise_profile)
    gain = gains if batch or gains is None else gains.item()
    report = SmoothingReport(method, state == 0, iterations, step, rate, lam, at_bound, df, estimated, gain)
    numbers = small._numbers(raw.points)
    matrix, turn, size = raw.system
    # Coordinates in a span of lower dimension are not those of the space.
    posterior = Posterior.of(matrix, turn, size) if span is None or size == 1 else None
    result = Smoothed(report, raw.band, band_lam, scale, between, posterior, options.penalty, profile, noise_profile)
    points = numbers if span is None else span.embed(numbers)
    of_curves = np.stack([np.reshape(doubt, batch) for doubt in doubts], axis=-1)
    return SmoothCurves(points, result, raw.columns.state, selection, rejected, minima.reshape(batch), of_curves)


def faults_of(
    parts: list[Part], results: list[SmoothCurves], noisy: SmoothingData, knots: int, options: SolverOptions
) -> list[Fault]:
    """Return the faults of the curves that failed, with their messages, in the first part in which some failed."""
    for part, result in zip(parts, results, strict=True):
        if result.states.any():
            return [
                Fault(number, UNCONVERGED, _reason(result, number, part.noise, noisy, knots, options))
                for number in np.flatnonzero(result.states).tolist()
            ]
    return []


def _reason(
    result: SmoothCurves, number: int, noise: Noise, noisy: SmoothingData, knots: int, options: SolverOptions
) -> str:
    """Return the message about a curve that failed."""
    state, report = result.states[number], result.smoothed.report
    if state == NO_CURVE:
        return (
            "The smoothing{of} led to points that no spline joins: the curve turns too far between two knots. Pass "
            "more knots in the gaps of the data, a larger lam, or cut the recording at its gaps "
            "(symspline.fit_segments). Check units and signs of the data."
        )
    if state == UNDETERMINED and options.penalty == "jerk":
        weights = np.broadcast_to(noise.weights, (*noisy.batch, noise.weights.shape[-1]))
        has_weight = weights.reshape(-1, weights.shape[-1])[number] > 0
        used = int(has_weight.sum())
        if used < _FEWEST:
            return (
                f"The data{{of}} do not determine the curve: penalty='jerk' needs at least {_FEWEST} data, not {used}."
            )
        if not has_weight.all():
            return (
                f"The data{{of}} do not determine the curve: for penalty='jerk', too many of the {knots} knots have no "
                "data near them. Remove the times before the first and after the last datum with a nonzero weight. If "
                f"there is a gap between the data, pass fewer knots, for example knots={max(knots // 6, 10)}."
            )
    if state == UNDETERMINED:
        return (
            "The data{of} do not determine the curve. With lam=0 there must be data near every knot: pass fewer "
            "knots. Otherwise the weights differ by more than the precision of floating-point numbers: remove data "
            "with tiny weights."
        )
    lam, step, iterations = (np.ravel(x)[number] for x in (report.lam, report.step, report.iterations))
    if state == UNSETTLED:
        return (
            f"The choice of lam{{of}} did not converge; its last value is {lam:.3g}. Pass this lam, or another "
            "criterion."
        )
    other = "" if options.method == "newton" else " or pass method='newton'"
    gap = _longest_gap(number, noisy, noise)
    return (
        f"No convergence of the smoothing{{of}}: the last step is {step:.1e} standard deviations after "
        f"{iterations} iterations (tol {options.tol:.1e}). {gap}Raise max_iter{other}."
    )


def _longest_gap(number: int, noisy: SmoothingData, noise: Noise) -> str:
    """Describe the longest gap between the data of a curve, if it is far longer than most."""
    t, times, weights = (
        np.broadcast_to(array, (*noisy.batch, array.shape[-1])).reshape(-1, array.shape[-1])[number]
        for array in (noisy.t, noisy.times, noise.weights)
    )
    t = t[weights > 0]
    different, index = np.unique(times[weights > 0], return_index=True)
    if len(index) < 3 or not long_gaps(different).any():
        return ""
    longest = int(np.diff(different).argmax())
    first, last = (short_repr(t[i]) for i in index[longest : longest + 2])
    return (
        f"No data determine how far the curve turns between t = {first} and {last}: cut the recording at such gaps "
        "(symspline.fit_segments). "
    )


# ---- several starts ----


class Columns(NamedTuple):
    """Properties of curves, one number per curve, in the order of the core."""

    state: NDArray[np.int_]
    iterations: NDArray[np.int_]
    lam: Doubles
    band_lam: Doubles
    at_bound: NDArray[np.bool_]
    df: Doubles
    sigma: Doubles
    step: Doubles
    rate: Doubles
    kappa: Doubles
    exact: NDArray[np.bool_]
    selection: NDArray[np.int_]
    rejected: NDArray[np.int_]
    objective: Doubles


class Raw(NamedTuple):
    """Results of the core for a batch of curves: points at the knots, the band of A⁻¹, columns of the report, A.

    If λ or σ may vary, `profiles` has λ of the segments and ln σ² at the knots, and the gains.
    """

    points: Doubles
    band: Doubles
    columns: Columns
    system: tuple[Doubles, Doubles, int]
    profiles: list[Doubles] | None = None

    @classmethod
    def of(cls, result: _core._SmoothResult) -> Raw:
        """Return the results of one call of the core."""
        points, band, columns, system, profiles = result
        return cls(points, band, Columns(*columns), system, profiles)

    def or_varying(self, other: Raw) -> Raw:
        """Return other curves, whose λ or σ may vary, where they vary and converged, and otherwise these.

        The gain of curves that vary but did not converge is NaN.
        """
        if other.profiles is None:
            return other
        lams, noises, gains, *doubts = other.profiles
        count = len(self.columns.state)
        varies = (lams.reshape(count, -1) != 1).any(axis=-1) | (noises.reshape(count, -1) != 0).any(axis=-1)
        lost = varies & self.converged & ~other.converged
        taken = varies & ~lost
        rows = taken.reshape(gains.shape)[..., None]
        profiles = [np.where(rows, lams, 1.0), np.where(rows, noises, 0.0)]
        profiles += [np.where(lost.reshape(gains.shape), np.nan, gains), *doubts]
        return self.where(taken, other)._replace(profiles=profiles)

    @property
    def converged(self) -> NDArray[np.bool_]:
        """Whether the curves converged."""
        return np.asarray(self.columns.state == CONVERGED)

    def where(self, chosen: NDArray[np.bool_], other: Raw) -> Raw:
        """Return the chosen curves from the other results, and all others from these."""
        if chosen.all() or (chosen.any() and self.system[2] != other.system[2]):
            return other
        if not chosen.any():
            return self

        def pick(these: Array, those: Array) -> Array:
            flat = these.reshape(len(chosen), -1), those.reshape(len(chosen), -1)
            return np.where(chosen[:, None], flat[1], flat[0]).reshape(these.shape)

        columns = Columns(*map(pick, self.columns, other.columns))
        matrix, turn = map(pick, self.system[:2], other.system[:2])
        return Raw(
            pick(self.points, other.points), pick(self.band, other.band), columns, (matrix, turn, self.system[2])
        )


class Samples(NamedTuple):
    """Data of a batch of curves: times (N,) or (..., N), points with `axes` axes of a point, weights, and knots."""

    times: Doubles
    points: Array
    weights: Doubles
    knots: Doubles
    axes: int
    closed: bool


Solve = Callable[[Doubles, Doubles], Raw]
"""Function that smooths with given λ (NaN to choose λ) and initial points at the knots."""


def best_of_starts(space: Space, data: Samples, lam: Doubles, first: Raw, solve: Solve) -> tuple[Raw, NDArray[np.int_]]:
    """Smooth from further starts where the first result, from the start of the core, may not be the best.

    Returns
    -------
    tuple
        The best results, and their kinds: one of `UNIQUE`, `TWO`, `NOISY`, `FAST` for each curve.
    """
    kinds = np.zeros(lam.size, int)
    radius = space.injectivity_radius
    if not (np.isfinite(radius) and radius > 0) or not lam.size:
        return first, kinds
    radii = radius * np.sqrt(_usual_weights(data, lam.size))
    fast = _median_steps(space, data) > _FAST
    noisy = _noise(first) > _NOISY * radii
    if not (noisy | fast).any():
        return first, kinds
    best = first
    if fast.any():
        for start in _fast_starts(space, data):
            if not (fast & (_noise(best) > _SMALL * radii)).any():
                break
            other = solve(lam, start)
            chooses = np.isnan(lam)
            less = np.where(chooses, _noise(other) < 0.7 * _noise(best), _is_less(other, best))
            best = best.where(fast & other.converged & (less | ~best.converged), other)
    noisy = _noise(best) > _NOISY * radii
    if noisy.any():
        given = np.where(best.converged, best.columns.lam, lam)
        inside = _embedded_start(space, data, given)
        if inside is not None:
            other = solve(given, inside)
            both = best.converged & other.converged
            apart = _apart(space, best.points, other.points) > _OTHER * radius
            variance = _noise(best) ** 2
            differ = np.abs(other.columns.objective - best.columns.objective)
            kinds[noisy & both & apart & (differ < _EQUAL * variance)] = TWO
            best = best.where(noisy & other.converged & (_is_less(other, best) | ~best.converged), other)
    kinds[(kinds == UNIQUE) & ~fast & (_noise(best) > _TOO_NOISY * radii)] = NOISY
    kinds[fast & (_noise(best) > _FAST_NOISY * radii)] = FAST
    return best, kinds


def _usual_weights(data: Samples, curves: int) -> Doubles:
    """Return the median weight of every curve, because noise levels refer to weight one."""
    rows = data.weights.reshape(-1, data.weights.shape[-1])
    return np.nanmedian(np.where(rows > 0, rows, np.nan), axis=-1) * np.ones(curves)


def _noise(raw: Raw) -> Doubles:
    """Return the noise levels, infinite for curves that did not converge."""
    return np.where(raw.converged, raw.columns.sigma, np.inf)


def _is_less(other: Raw, best: Raw) -> NDArray[np.bool_]:
    return np.asarray(other.columns.objective < best.columns.objective * (1 - 1e-6))


def _apart(space: Space, p: Doubles, q: Doubles) -> Doubles:
    """Return the largest distance between two curves at their knots."""
    a, b = space._numbers(p), space._numbers(q)
    good = space._where_finite(a) & space._where_finite(b)
    distances = np.zeros(good.shape)
    distances[good] = space._apply("distance", p=a[good], q=b[good])
    distances[~np.isfinite(distances)] = space.injectivity_radius
    rows = distances.reshape(-1, p.shape[distances.ndim - 1])
    return np.asarray(rows.max(axis=-1))


def _median_steps(space: Space, data: Samples) -> Doubles:
    """Return the median step of every curve, as a fraction of the distance to the cut locus."""
    fractions = cut_fractions_in_core(space, data.points)
    rows = fractions.reshape(-1, fractions.shape[-1])
    if data.weights.all() and np.isfinite(rows).all():
        return np.asarray(np.median(rows, axis=-1))
    weights = np.broadcast_to(data.weights, (*fractions.shape[:-1], data.weights.shape[-1]))
    used = weights.reshape(len(rows), -1) > 0
    rows = np.where(used[:, 1:] & used[:, :-1], rows, np.nan)
    known = np.isfinite(rows).any(axis=-1)
    medians = np.zeros(len(rows))
    if known.any():
        medians[known] = np.nanmedian(rows[known], axis=-1)
    return medians


# ---- consecutive data that are far apart ----


def _fast_starts(space: Space, data: Samples) -> Iterator[Doubles]:
    """Yield the data themselves, and on rotations a slow path times a path that turns by the most frequent step."""
    near = _nearest(data)
    lead = data.points.ndim - data.axes - 1

    def at_knots(points: Array) -> Doubles:
        flat = points.reshape(-1, *points.shape[lead:])
        rows = flat[np.arange(len(flat))[:, None], near]
        shaped = rows.reshape(*points.shape[:lead], *rows.shape[1:])
        return np.ascontiguousarray(space._as_doubles(np.ascontiguousarray(shaped)))

    yield at_knots(data.points)
    if isinstance(space, SpecialOrthogonal):
        flat = np.ascontiguousarray(data.points.reshape(-1, *data.points.shape[lead:]))
        # The data are slow · turn, or turn · slow.
        turns, in_fixed = _core.usual_turns(space._handle, flat)
        turns, fixed = turns.reshape(data.points.shape), np.reshape(in_fixed, (*data.points.shape[:lead], 1, 1, 1))
        back = np.swapaxes(turns, -1, -2)
        slow = np.ascontiguousarray(np.where(fixed, back @ data.points, data.points @ back))
        smooth = _linear(space, data, space._as_doubles(slow), np.full(len(flat), np.nan))
        if smooth is not None:
            turned, turn = space._numbers(smooth), space._numbers(at_knots(turns))
            whole = np.ascontiguousarray(np.where(fixed, turn @ turned, turned @ turn))
            yield np.ascontiguousarray(space._as_doubles(whole))


def _nearest(data: Samples) -> NDArray[np.intp]:
    """Return the index of the datum nearest to each knot, one row per curve, or one row if all have the same times."""
    times, knots = (x.reshape(-1, x.shape[-1]) for x in (data.times, data.knots))
    curves = max(len(times), len(knots))
    pairs = zip(*(np.broadcast_to(x, (curves, x.shape[1])) for x in (times, knots)), strict=True)
    after = np.stack([np.clip(np.searchsorted(t, at), 1, len(t) - 1) for t, at in pairs])
    t = np.broadcast_to(times, (curves, times.shape[1]))
    before, behind = (np.take_along_axis(t, index, axis=-1) for index in (after - 1, after))
    return np.where(knots - before < behind - knots, after - 1, after)


# ---- data with much noise ----


def _embedded_start(space: Space, data: Samples, lam: Doubles) -> Doubles | None:
    """Return the data smoothed in the embedding Euclidean space and projected; None without a known embedding."""
    x = data.points
    if isinstance(space, Torus):
        inside = np.concatenate([np.cos(x), np.sin(x)], axis=-1)
    elif isinstance(space, (Sphere, SpecialOrthogonal)):
        inside = x
    elif isinstance(space, (RealProjective, ComplexProjective, Grassmannian, ComplexGrassmannian)):
        columns = x[..., None] if isinstance(space, (RealProjective, ComplexProjective)) else x
        inside = columns @ np.swapaxes(columns.conj(), -1, -2)
    else:
        return None
    lead = x.shape[: x.ndim - len(space.point_shape)]
    flat = np.ascontiguousarray(inside).view(np.float64).reshape(*lead, -1)
    if flat.shape[-1] > _WIDE:
        return None
    smooth = _linear(Euclidean(flat.shape[-1]), data, np.ascontiguousarray(flat), lam)
    if smooth is None:
        return None
    near = np.ascontiguousarray(smooth).view(inside.dtype).reshape(*smooth.shape[:-1], *inside.shape[len(lead) :])
    return np.ascontiguousarray(space._as_doubles(np.ascontiguousarray(_projected(space, near))))


def _projected(space: Space, x: Array) -> Array:
    if isinstance(space, Torus):
        cos, sin = np.split(x, 2, axis=-1)
        return np.asarray(np.arctan2(sin, cos))
    if isinstance(space, Sphere):
        return np.asarray(x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), np.finfo(float).tiny))
    if isinstance(space, SpecialOrthogonal):
        return nearest_rotations(x)
    _, vectors = np.linalg.eigh(x)
    if isinstance(space, (RealProjective, ComplexProjective)):
        return vectors[..., -1]
    return vectors[..., -space.point_shape[-1] :]


def _linear(space: Space, data: Samples, points: Doubles, lam: Doubles) -> Doubles | None:
    """Return the points at the knots of a curve that is smoothed by least squares; None if it does not exist."""
    sigma, closed = np.full(lam.size, np.nan), None if data.closed else [("natural", None)] * 2
    options = "gcv", 1.4, "acceleration", "linear", "auto", 1e-2, 50, False
    factor = space._handle, points, data.weights, None, lam, sigma, closed, None, None, (False, False)
    smooth = _core.smooth([factor], data.times, data.knots, *options, None)[0][0]
    return smooth if np.isfinite(smooth).all() else None

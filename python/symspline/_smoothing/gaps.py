"""Calibrate bands in long gaps and beyond the ends of the data.

The posterior standard deviation is too small where there are no data. Parts of the recording as long as the gap are
predicted without their data, and the errors of these predictions determine a factor; see `smoothing/src/calibrate.rs`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.arrays import short_repr
from .._base.faults import of_index, warn
from .._base.typing import Time
from .._curves.ends import end_kinds, is_closed
from .._spaces import AnySpace, Array, Doubles, Euclidean, Space, SpecialEuclidean, factors_of
from .audit import corner_of
from .noise import SINGULAR, grouped, in_part, smoothed_spaces, split
from .report import Index, Known, SmoothingWarning, frames_at
from .solve import SmoothedSpline

# A gap is long if the variance in its middle exceeds the first multiple of the median variance at the data, and its
# length the second multiple of the median time step, so that sparse data have no gaps.
_WIDE, _SPARSE = 4.0, 3.0
# The same number if λ varies: in shorter gaps, λ is that of the data beside them.
_SPARSE_IF_VARYING = 10.0
# Relative size of the changes of λ that are rounding errors.
_SAME = 1e-9
# Largest number of entries of the frames that are computed in one call.
_TOGETHER = 1 << 22
# Data of a robust fit beyond this quantile of the noise do not count as evidence, as in the fit.
_KEPT = 0.999


class Gap(NamedTuple):
    """A long gap between the data of a curve, or the time before the first or after the last datum.

    Attributes
    ----------
    start, stop : float or datetime64
        Times of the data at its ends. Before the data, ``start`` is ``-inf``; after the data, ``stop`` is ``inf``. For
        dates, these are NaT.
    factor : float
        Factor k of the standard deviation in the middle of the gap, see the notes of `SmoothingSpline.std`. Before and
        after the data it is the largest factor of all distances. NaN if no part of the recording allows an estimate.
    blocks : int
        Number of parts of the recording, as long as the gap, that were predicted without their data. It is 0 for a gap
        that is longer than any such part. Its factor is then the largest one of all shorter lengths.
    """

    start: Time
    stop: Time
    factor: float
    blocks: int


class Course(NamedTuple):
    """The process whose posterior mean is the curve.

    Attributes
    ----------
    order : int
        The order of the derivative that is penalised, 2 or 3.
    lam : float
        Its weight λ; if that varies, the harmonic mean, which has the mean variance of the process.
    variance : callable
        Variance of a coordinate for noise of variance one, for times and the order of a derivative, 0 or 1.
    line : callable
        Covariance (2, 2) of a coordinate and its velocity at a time, likewise.
    acceleration : float
        Mean square of a coordinate of the acceleration, for noise of variance one.
    """

    order: int
    lam: float
    variance: Callable[[Doubles, int], Doubles]
    line: Callable[[float], Doubles]
    acceleration: float

    def drift(self, distance: Doubles, nu: int = 0) -> Doubles:
        """Return the variance of the deviation of the process, or of its velocity, from a line of constant velocity.

        The curve continues as such a line. A process with a penalty on its jerk also has an acceleration.
        """
        d = np.maximum(distance, 0.0)
        if self.order == 2:
            return d**3 / (3 * self.lam) if nu == 0 else d / self.lam
        noise = d**5 / (20 * self.lam) if nu == 0 else d**3 / (3 * self.lam)
        return noise + self.acceleration * (d**4 / 4 if nu == 0 else d**2)


class SensorEvidence(NamedTuple):
    """Measurements of any kind, linearised at a curve. Points are predicted, the others are only omitted.

    Attributes
    ----------
    knots : ndarray
        Knots.
    known : tuple
        The matrix A, as the core reads it.
    times : ndarray, shape (n,)
        Times of the measurements, in increasing order.
    firsts : ndarray of int, shape (n,)
        First coefficient on which each measurement depends.
    factors, sides : ndarray, shape (n, q, 4m) and (n, q, p)
        Factors of four coefficients and of the parameters in q whitened rows; rows of zeros have no effect.
    residuals : ndarray, shape (n, q) or (n, q, columns)
        Whitened measurements minus their values at the curve. Columns are coordinates that A does not couple.
    counts : ndarray of bool, shape (n,)
        Whether each measurement is a point that is not an outlier.
    weights : ndarray, shape (n,)
        Mean weight of a coordinate that every point observes.
    coordinates : int
        Number of coordinates of a point.
    pseudo : ndarray
        Residuals of the pseudo-data of a robust loss; the same residuals for least squares.
    observed : ndarray, shape (n,)
        Number of coordinates that each point observes, one if A couples none.
    line : list of ndarray
        Roots of the weights (n, q, m), and the curve and its velocity at the data in coordinates of frames along the
        curve, divided by the standard deviation of the noise. It is only needed beyond the data.
    changes : tuple or None
        If λ varies: its changes in segments where data are omitted, from which it would not be known, the accelerations
        at the knots in the coordinates of the residuals, and the penalty.
    """

    knots: Doubles
    known: Known
    times: Doubles
    firsts: NDArray[np.int64]
    factors: Doubles
    sides: Doubles
    residuals: Doubles
    counts: NDArray[np.bool_]
    weights: Doubles
    coordinates: int
    pseudo: Doubles
    observed: Doubles
    line: list[Doubles]
    changes: tuple[Doubles, Doubles, str] | None = None

    @property
    def linearised(self) -> _core._Linearised:
        """The arrays that the core reads."""
        residuals = [np.ascontiguousarray(rows) for rows in (self.pseudo, self.residuals)]
        of_points = self.counts, [self.weights, self.observed], self.coordinates
        return self.times, self.firsts, [self.factors, self.sides], residuals, *of_points


@dataclass(frozen=True, eq=False)
class Calibration:
    """How the variances of a curve change in gaps and beyond its data.

    Attributes
    ----------
    course : Course
        The process.
    gaps : list of tuple
        Start, stop, factor and number of blocks of every long gap.
    at_data : callable
        Function that returns the median variance at the data, of points (0) or velocities (1).
    width : float
        Width h of the smoother.
    outer : tuple of float
        Times of the first and the last datum; infinite if variances beyond them do not change.
    period : float
        Period of a closed curve; NaN for others.
    beyond : callable or None
        Function that returns distances beyond the ends with their factors, shape (n, 2), and the number of blocks.
    """

    course: Course
    gaps: list[tuple[float, float, float, int]]
    at_data: Callable[[int], float]
    width: float
    outer: tuple[float, float] = (-np.inf, np.inf)
    period: float = np.nan
    beyond: Callable[[], tuple[Doubles, int]] | None = None

    @property
    def ends(self) -> list[tuple[float, float, float, int]]:
        """The times before the first and after the last datum, with the largest factor and the number of blocks."""
        if self.beyond is None:
            return []
        rungs, blocks = self._beyond
        largest = float(rungs[:, 1].max()) if len(rungs) else np.nan
        first, last = self.outer
        return [(-np.inf, first, largest, blocks), (last, np.inf, largest, blocks)]

    @cached_property
    def _beyond(self) -> tuple[Doubles, int]:
        return self.beyond() if self.beyond else (np.zeros((0, 2)), 0)

    @cached_property
    def _at_ends(self) -> Doubles:
        """Variance of the point, its covariance with the velocity, and variance of the velocity, at both ends."""
        return np.array([self.course.line(float(end))[[0, 0, 1], [0, 1, 1]] for end in self.outer])

    def inflation(self, x: Doubles, nu: int) -> Doubles:
        """Return the factors of standard deviations at times x: exactly 1 away from gaps and between the ends."""
        out = np.ones(x.shape)
        near, excess = self._in_gaps(x)
        outside = (x < self.outer[0]) | (x > self.outer[1])
        near &= ~outside
        if near.any():
            v = self.course.variance(x[near], nu)
            out[near] = _ratio(v + excess[near] * np.maximum(v - self.at_data(nu), 0.0), v)
        if outside.any():
            v = self.course.variance(x[outside], nu)
            out[outside] = _ratio(self._variance_beyond(x[outside], v, nu), v)
        return out

    def _in_gaps(self, x: Doubles) -> tuple[NDArray[np.bool_], Doubles]:
        """Return whether times are near gaps, and k² − 1 there, which decreases to zero between h and 2h from a gap."""
        excess, undetermined = np.zeros(x.shape), np.zeros(x.shape, bool)
        turns = [0.0]
        if self.gaps and not np.isnan(self.period):
            turns, first = [-self.period, 0.0, self.period], self.gaps[0][0]
            x = first + np.mod(x - first, self.period)
        for start, stop, factor, _ in self.gaps:
            for turn in turns:
                away = np.maximum(np.maximum(start + turn - x, x - stop - turn), 0.0)
                if np.isnan(factor):
                    undetermined |= (x > start + turn) & (x < stop + turn)
                    continue
                excess = np.maximum(excess, (factor**2 - 1) * np.clip(2.0 - away / self.width, 0.0, 1.0))
        excess[undetermined] = np.nan
        return undetermined | (excess > 0), excess

    def _factors_beyond(self, distance: Doubles) -> Doubles:
        """Return the factors at distances from the ends."""
        rungs, _ = self._beyond
        if not len(rungs):
            return np.full(distance.shape, np.nan)
        at, factors = np.log(rungs.T)
        return np.asarray(np.exp(np.interp(np.log(distance), at, factors)))

    def _variance_beyond(self, x: Doubles, v: Doubles, nu: int) -> Doubles:
        """Return the variance at times beyond the ends, where the variance of the spline is v."""
        behind = x > self.outer[1]
        of_end = self._at_ends[behind.astype(int)]
        d = np.where(behind, x - self.outer[1], self.outer[0] - x)
        # Backwards in time, the velocity has the opposite sign.
        sign = np.where(behind, 1.0, -1.0)
        here = of_end[:, 2 * nu]
        line = here + (2 * sign * d * of_end[:, 1] + d**2 * of_end[:, 2] if nu == 0 else 0.0)
        process = np.maximum(v, line + self.course.drift(d, nu))
        return np.asarray(process + (self._factors_beyond(d) ** 2 - 1) * np.maximum(process - here, 0.0))


def _ratio(more: Doubles, v: Doubles) -> Doubles:
    """Return the square root of the ratio of two variances, 1 where the denominator is zero."""
    out = np.ones(v.shape)
    np.sqrt(np.divide(more, v, out=out, where=~(v <= 0)), out=out)
    return out


def calibrate(
    times: Doubles,
    weights: Doubles,
    course: Course,
    period: float,
    evidence: Callable[[], SensorEvidence],
    ends: bool = True,
    sparse: float = _SPARSE,
) -> Calibration:
    """Find the long gaps of a curve and the factors of its standard deviations in them.

    Parameters
    ----------
    times, weights : ndarray, shape (n,)
        Times of the data, in increasing order, and their weights.
    course : Course
        The process.
    period : float
        Period of a closed curve; NaN for others.
    evidence : callable
        Function that returns the linearised data. It is called only if there are gaps, or for times beyond the data.
    ends : bool
        Whether variances beyond the data change as well. This needs the `line` of the evidence.
    sparse : float
        Shortest length of a long gap in median time steps.

    References
    ----------
    S. N. Wood, On neighbourhood cross validation, arXiv 2404.16490 (2024).

    P. Burman, E. Chow, D. Nolan, A cross-validatory method for dependent data, Biometrika 81 (1994).
    """
    closed = not np.isnan(period)
    whole = np.append(times, times[0] + period) if closed else times
    apart = np.diff(whole)
    usual = float(np.median(apart[apart > 0]))

    @cache
    def at_data(nu: int) -> float:
        return float(np.median(course.variance(times, nu)))

    def width_without(lengths: Doubles) -> float:
        return float(((apart.sum() - np.sum(lengths)) / weights.sum() * course.lam) ** (0.5 / course.order))

    width = width_without(apart[apart > 10 * usual])
    candidates = np.flatnonzero(apart > max(2 * width, sparse * usual))
    long = candidates[:0]
    if len(candidates):
        middles = whole[candidates] + 0.5 * apart[candidates]
        long = candidates[course.variance(middles, 0) > _WIDE * at_data(0)]
    spans = np.stack([whole[long], whole[long + 1]], axis=-1)
    width = width_without(apart[long])
    gaps = []
    if len(spans):
        data, turn = evidence(), period if closed else None
        known, changes = (data.knots, data.known, data.linearised), data.changes
        if changes is not None:
            # Beside gaps that are too short for a burst, λ is that of the data, and so it is where data are omitted.
            place = np.searchsorted(data.knots[1:-1], middles[np.isin(candidates, long)], "right")
            if np.abs(changes[0][place]).max() > _SAME * np.abs(changes[0]).max():
                changes = None
        factors = _core.gap_factors(*known, spans.tolist(), width, at_data(0), turn, changes)
        gaps = [(float(start), float(stop), *factor) for (start, stop), factor in zip(spans, factors, strict=True)]
    if closed or not ends:
        return Calibration(course, gaps, at_data, width, period=period)

    def beyond() -> tuple[Doubles, int]:
        data = evidence()
        along = data.line, course.order, course.lam, course.acceleration
        rungs, count = _core.end_factors(data.knots, data.known, data.linearised, along, usual)
        return np.array(rungs).reshape(-1, 2), count

    outer = float(times[0]), float(times[-1])
    return Calibration(course, gaps, at_data, width, outer, beyond=beyond)


def calibration_of(spline: SmoothedSpline, number: int) -> Calibration | None:
    """Return the calibration of one curve in gaps, in the smoothed space with a given number.

    The result is None for curves without an estimate of their error: interpolating curves, least squares without a
    penalty, geodesics with ``lam=inf``, and curves that did not converge.
    """
    part = spline._smoothed[number]
    space = smoothed_spaces(spline.space)[number]
    lam, sigma = (float(np.asarray(value)) for value in (part.band_lam, part.sigma))
    if part.profile is not None:
        h = np.diff(spline._knots_of(()))
        lam *= float(h.sum() / np.sum(h / part.profile))
    known = np.isfinite(part.report.lam) and part.report.converged
    usable = 0 < lam < np.inf and 0 < sigma < np.inf and bool(known)
    noise, times = spline._noisy.noise[number], spline._noisy.times
    used = noise.weights > 0
    t = times[used]
    if not usable or part.posterior is None or len(np.unique(t)) < 3:
        return None
    knots, kinds = spline._knots_of(()), end_kinds(spline._bc_type)
    m = space.dim
    posterior = part.posterior

    def line(at: float) -> Doubles:
        covariance = posterior.covariance(space, knots, (), kinds, np.array([at]), None, [0, 1])[0].reshape(2, m, 2, m)
        return np.asarray(np.trace(covariance, axis1=1, axis2=3) / m)

    def variance(x: Doubles, nu: int) -> Doubles:
        return np.asarray((spline._plain_spread(number, (), x, nu) / sigma) ** 2)

    order = 3 if part.penalty == "jerk" else 2

    @cache
    def evidence() -> SensorEvidence:
        return _evidence(spline, number, np.flatnonzero(used), sigma)

    acceleration = 0.0
    if order == 3:
        at = t[:: max(1, len(t) // 1000)]
        vectors = _coordinates(spline, number, at, "acceleration")
        acceleration = float(np.mean((vectors / sigma) ** 2))
    course = Course(order, lam, variance, line, acceleration)
    period = float(knots[-1] - knots[0]) if is_closed(spline._bc_type) else np.nan
    sparse = _SPARSE if part.profile is None else _SPARSE_IF_VARYING
    return calibrate(t, noise.weights[used], course, period, evidence, sparse=sparse)


def _evidence(spline: SmoothedSpline, number: int, used: NDArray[np.intp], sigma: float) -> SensorEvidence:
    noisy, part = spline._noisy, spline._smoothed[number]
    space, data = smoothed_spaces(spline.space)[number], _in_part(spline.space, noisy.points, number)
    noise, m = noisy.noise[number], space.dim
    t, y = noisy.times[used], data[used]
    residuals = _coordinates(spline, number, t, "point", y) / sigma
    velocities, accelerations = (
        _coordinates(spline, number, t, quantity) / sigma for quantity in ("velocity", "acceleration")
    )
    h = np.diff(t)[:, None]
    steps = 0.5 * h * (velocities[:-1] + velocities[1:]) + h**2 / 12 * (accelerations[:-1] - accelerations[1:])
    positions = np.concatenate([np.zeros((1, m)), np.cumsum(steps, axis=0)])
    weights, posterior = noise.weights[used], spline._posterior(part)
    # If A couples no coordinates, it is that of one of them, and the others are columns.
    size, n = posterior.size, len(t)
    if size == 1:
        roots, observed = np.sqrt(weights)[:, None, None], np.ones(n)
    else:
        matrices = np.eye(m) * weights[:, None, None]
        if noise.information is not None:
            matrices = _in_frames(spline, number, t, y, noise.information[used])
        roots = _roots(matrices)
        observed = np.maximum(roots.any(axis=2).sum(axis=1), 1.0)
        weights = (roots**2).sum(axis=(1, 2)) / observed
    whitened = roots @ residuals.reshape(n, size, -1)
    squares = (whitened**2).sum(axis=(1, 2))
    counts, pseudo = np.ones(n, bool), whitened
    if noise.loss != "linear":
        counts = squares <= _core.chi_squared(m, _KEPT)
        pseudo = whitened * _soft(noise.loss, squares, m)[:, None, None]
    knots, kinds = spline._knots_of(()), end_kinds(spline._bc_type)
    firsts, factors = _core.coefficient_factors(knots, kinds, t, 0)
    rows = np.ascontiguousarray(np.einsum("nqc,nk->nqkc", roots, factors).reshape(n, roots.shape[1], -1))
    changes = None
    if part.profile is not None:
        lam = float(np.asarray(part.band_lam)) * part.profile
        h = np.diff(knots)
        bends = np.ascontiguousarray(_coordinates(spline, number, knots, "acceleration") / sigma)
        changes = np.ascontiguousarray(h.sum() / np.sum(h / lam) - lam), bends, part.penalty
    known, line = posterior.known((), kinds), [np.ascontiguousarray(x) for x in (roots, positions, velocities)]
    none = np.zeros((n, roots.shape[1], 0))
    of_points = counts, weights, m, pseudo, observed, line
    return SensorEvidence(knots, known, t, firsts, rows, none, whitened, *of_points, changes)


def _soft(loss: str, squares: Doubles, m: int) -> Doubles:
    """Return factors that turn residuals into those of pseudo-data, for noise of variance one (Cox 1983)."""
    q = squares / corner_of(loss, m)
    if loss == "huber":
        q = np.maximum(q, 1.0)
        factors = 1 / np.sqrt(q)
        slopes = np.where(q > 1, (m - 1) / m * factors, 1.0)
    else:
        factors = 1 / (1 + q)
        slopes = factors - 2 * q * factors**2 / m
    return np.asarray(factors / max(slopes.mean(), 0.05))


def _roots(matrices: Doubles) -> Doubles:
    """Return R with W = RᵀR for symmetric matrices W; rows of directions without information are zero."""
    values, vectors = np.linalg.eigh(matrices)
    values = np.where(values > SINGULAR * values[:, -1:], values, 0.0)
    return np.asarray(np.sqrt(values)[:, :, None] * np.swapaxes(vectors, -1, -2))


def _in_part(space: AnySpace, arrays: Sequence[Array], number: int) -> Array:
    """Return the arrays of one smoothed space from those of all factors."""
    return [rows for pair in zip(factors_of(space), arrays, strict=True) for rows in split(*pair)][number]


def _parts_at(spline: SmoothedSpline, number: int, t: Doubles, quantity: str) -> tuple[Space, Array, Array]:
    """Return the factor of a smoothed space, the points at its knots, and a quantity at times."""
    owners = [i for i, of_factor in enumerate(grouped(spline.space, spline._smoothed)) for _ in of_factor]
    factor, curve = factors_of(spline.space)[owners[number]], spline._curve.parts[owners[number]]
    place = number - owners.index(owners[number])
    values = curve.evaluate(t, quantity, "raise", False)
    return factor, split(factor, curve.points)[place], split(factor, values)[place]


def _coordinates(spline: SmoothedSpline, number: int, t: Doubles, quantity: str, y: Array | None = None) -> Doubles:
    """Return coordinates of tangent vectors along the curve: its derivatives, or logarithms of points y."""
    space = smoothed_spaces(spline.space)[number]
    factor, points, vectors = _parts_at(spline, number, t, quantity)
    _, _, p = _parts_at(spline, number, t, "point")
    if y is not None:
        one = space if isinstance(factor, SpecialEuclidean) else factor
        vectors = one._apply("log", p=p, q=y)
    return _of_frames(space, spline._knots_of(()), points, t, p, vectors[:, None])[:, 0]


def _of_frames(space: Space, knots: Doubles, points: Array, t: Doubles, p: Array, vectors: Array) -> Doubles:
    """Return coordinates of vectors (n, k, *point_shape) in the frames along a curve, shape (n, k, m)."""
    n, k, m = len(t), vectors.shape[1], space.dim
    flat = np.asarray(space._as_doubles(np.ascontiguousarray(vectors))).reshape(n, k, -1)
    if isinstance(space, Euclidean):
        return flat
    out = np.empty((n, k, m))
    step = max(1, _TOGETHER // (m * flat.shape[-1]))
    for first in range(0, n, step):
        some = slice(first, first + step)
        frames = frames_at(space, knots, points, t[some], p[some])
        rows = np.asarray(space._as_doubles(np.ascontiguousarray(frames))).reshape(-1, m, flat.shape[-1])
        q, r = np.linalg.qr(np.swapaxes(rows, 1, 2))
        out[some] = np.swapaxes(np.linalg.solve(r, np.swapaxes(q, 1, 2) @ np.swapaxes(flat[some], 1, 2)), 1, 2)
    return out


def _in_frames(spline: SmoothedSpline, number: int, t: Doubles, y: Array, information: Doubles) -> Doubles:
    """Return information matrices in frames along the curve, to which the frames at the data are transported."""
    space = smoothed_spaces(spline.space)[number]
    _, points, p = _parts_at(spline, number, t, "point")
    frames = np.moveaxis(space.frame(y), 1, 0)
    moved = np.stack([space._apply("transport", p=y, q=p, v=vectors) for vectors in frames], axis=1)
    # Rows are the transported frame vectors, in coordinates of the frames along the curve.
    turn = np.linalg.inv(_of_frames(space, spline._knots_of(()), points, t, p, moved))
    return np.asarray(turn @ information @ np.swapaxes(turn, 1, 2))


# ---- bands in gaps ----


def warn_of_cubics() -> None:
    """Warn that standard deviations beyond the ends are not those of a curve that continues its cubics."""
    warn(
        "extrapolate=True continues the first and the last cubic of the curve. Standard deviations and bands beyond "
        "the ends are those of a curve that continues with constant velocity, so that they do not contain the error of "
        "these cubics. Pass extrapolate='geodesic' to make_smoothing_spline.",
        SmoothingWarning,
    )


def widest_band(space: Space, spread: NDArray[np.float64]) -> float:
    """Return the radius of the widest 95 % band relative to the injectivity radius, or to π radii of curvature if less.

    It is 0 on flat spaces, where computations in tangent spaces are exact.
    """
    if not space.curvature > 0:
        return 0.0
    reach = min(space.injectivity_radius, np.pi / space.curvature)
    return float(np.nanmax(spread, initial=0.0) * np.sqrt(_core.chi_squared(space.dim, 0.95)) / reach)


def warn_of_wide_bands(spline: SmoothedSpline, number: int, index: tuple[int, ...], wide: float) -> None:
    """Warn of a band so wide that computations in tangent spaces are not valid."""
    of = of_index(index) + in_part(spline.space, number)
    warn(
        f"the 95 % band{of} is up to {wide:.2g} of the injectivity radius (or of π radii of curvature) wide. Bands are "
        "computed in tangent spaces along the curve and may be too narrow. Do not rely on this part of the curve: cut "
        "the recording there (symspline.fit_segments), or add data.",
        SmoothingWarning,
        index,
    )


def warn_of_gaps(
    space: AnySpace,
    gaps_of: Callable[[int, Index], list[Gap]],
    calibrations: dict[tuple[int, Index], Calibration | None],
) -> None:
    """Warn once of the longest gap among those longer than any part of the recording that could be predicted.

    Parameters
    ----------
    space : Space
        The space.
    gaps_of : callable
        Function that returns the gaps of a part of a curve by their index.
    calibrations : dict
        Calibrations by part and index of the curve; None for curves without any.
    """
    blind = [
        (stop - start, key, place)
        for key, calibration in calibrations.items()
        for place, (start, stop, _, blocks) in enumerate([] if calibration is None else calibration.gaps)
        if not blocks
    ]
    if not blind:
        return
    _, (number, index), place = max(blind)
    calibration, count = calibrations[number, index], len(blind)
    assert calibration is not None
    gap = gaps_of(number, index)[place + len(calibration.ends[:1])]
    of = of_index(index) + in_part(space, number)
    more = f" (and {count - 1} more gaps)" if count > 1 else ""
    if np.isnan(gap.factor):
        known = (
            "The error of the curve in the gap cannot be estimated, so its standard deviation is NaN there. Cut the "
            "recording at this gap (symspline.fit_segments), or pass calibrated=False for the posterior."
        )
    else:
        known = (
            f"The band in the gap is up to {gap.factor:.2g} times as wide as that of the posterior. This factor comes "
            "from shorter parts of the recording and may be too small. Do not rely on the curve in the gap: cut the "
            "recording there (symspline.fit_segments), or add data."
        )
    warn(
        f"there are no data{of} between t = {short_repr(gap.start)} and {short_repr(gap.stop)}{more}, and no other "
        f"part of the recording is as long. {known}",
        SmoothingWarning,
        index,
    )

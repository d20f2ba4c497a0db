"""Calibrate bands in long gaps and beyond the ends of the data.

The posterior standard deviation is too small where there are no data, because λ is optimal for the data and the true
motion is rarely a sample of the prior process. To calibrate it, parts of the recording as long as the gap are predicted
without their data. The errors of these predictions determine a factor of the standard deviation.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._spaces import Doubles

# A gap is long if the variance in its middle exceeds the first multiple of the median variance at the data, and its
# length the second multiple of the median time step, so that sparse data have no gaps.
_WIDE, _SPARSE = 4.0, 3.0
# Omitted data count only where their variance exceeds this multiple of the median. The posterior is right at the edges
# of a block, which would hide errors inside.
_INSIDE = 2.0
# The coverage for which the factors are calibrated.
_LEVEL = 0.95
# Largest numbers of blocks of one length, of lengths, and of predicted data per block; least number of predicted data.
_BLOCKS, _LENGTHS, _PREDICTED, _FEW = 24, 6, 200, 3
# Fraction of a recording that is predicted beyond the end of a part of it, and the largest factor there.
_BEYOND, _MOST = 1 / 3, 20.0


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

    start: Any
    stop: Any
    factor: float
    blocks: int


class Course(NamedTuple):
    """The process whose posterior mean is the curve.

    Attributes
    ----------
    order : int
        The order of the derivative that is penalised, 2 or 3.
    lam : float
        Its weight λ.
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
        own = d**5 / (20 * self.lam) if nu == 0 else d**3 / (3 * self.lam)
        return own + self.acceleration * (d**4 / 4 if nu == 0 else d**2)


class Evidence(NamedTuple):
    """Data of a curve, linearised at the curve and divided by their standard deviations.

    Attributes
    ----------
    knots : ndarray
        Knots.
    known : tuple
        The matrix A, as the core reads it.
    times : ndarray, shape (n,)
        Times of the data, in increasing order.
    roots : ndarray, shape (n,) or (n, q, m)
        Roots of the weights: numbers, or matrices if A couples the m coordinates.
    residuals : ndarray, shape (n, m)
        Coordinates of the vectors from the curve to the data, divided by the standard deviation of the noise.
    counts : ndarray of bool, shape (n,)
        Whether each datum counts; False for outliers.
    soft : ndarray, shape (n,)
        Factors that turn residuals into those of the pseudo-data of a robust loss; 1 for least squares.
    positions, velocities : ndarray, shape (n, m)
        The curve and its velocity in coordinates of frames along the curve, divided by the same standard deviation.
    """

    knots: Doubles
    known: Any
    times: Doubles
    roots: Doubles
    residuals: Doubles
    counts: NDArray[np.bool_]
    soft: Doubles
    positions: Doubles
    velocities: Doubles

    @property
    def coordinates(self) -> int:
        """Number of coordinates of a datum."""
        return int(self.residuals.shape[1])

    @property
    def rows_per_datum(self) -> int:
        """Number of linear functions of the coefficients for one datum."""
        return 1 if self.roots.ndim == 1 else int(self.roots.shape[1])

    @property
    def weights(self) -> Doubles:
        """Mean weight of a coordinate of every datum."""
        if self.roots.ndim == 1:
            return self.roots**2
        return np.asarray((self.roots**2).sum(axis=(1, 2)) / self.residuals.shape[1])

    def rows(self, data: NDArray[np.intp], firsts: NDArray[np.int64], factors: Doubles) -> Any:
        """Return linear functions of the coefficients with these factors, multiplied by the roots."""
        if self.roots.ndim == 1:
            return firsts, np.ascontiguousarray(self.roots[data, None] * factors), np.zeros((len(data), 0))
        own = np.einsum("nqc,nk->nqkc", self.roots[data], factors)
        q = own.shape[1]
        return np.repeat(firsts, q), np.ascontiguousarray(own.reshape(len(data) * q, -1)), np.zeros((len(data) * q, 0))

    def whitened(self, data: NDArray[np.intp], vectors: Doubles) -> Doubles:
        """Return vectors multiplied by the roots, one row per row of `rows`."""
        if self.roots.ndim == 1:
            return np.ascontiguousarray(self.roots[data, None] * vectors)
        return np.ascontiguousarray(np.einsum("nqc,nc->nq", self.roots[data], vectors).reshape(-1, 1))

    def system(self) -> tuple[NDArray[np.int64], Doubles, Any, Doubles]:
        """Return the first coefficients and their factors at all data, and the linear problem: rows and residuals."""
        every = np.arange(len(self.times))
        firsts, factors = _core.coefficient_factors(self.knots, self.known[2], self.times, 0)
        residuals = self.whitened(every, self.residuals * self.soft[:, None])
        return firsts, factors, self.rows(every, firsts, factors), residuals

    def per_datum(self, data: NDArray[np.intp], rows: Doubles) -> Doubles:
        """Return means over the coordinates that each datum observes, from sums over one row or several."""
        if self.roots.ndim == 1:
            return np.asarray(rows.reshape(len(rows), -1).mean(axis=1))
        return np.asarray(rows.reshape(-1, self.roots.shape[1]).sum(axis=1) / self._observed(data))

    def observed_weights(self, data: NDArray[np.intp]) -> Doubles:
        """Return mean weights of the coordinates that each datum observes."""
        weights = self.weights[data]
        return weights if self.roots.ndim == 1 else weights * self.residuals.shape[1] / self._observed(data)

    def _observed(self, data: NDArray[np.intp]) -> NDArray[np.intp]:
        return np.asarray(np.maximum(self.roots[data].any(axis=2).sum(axis=1), 1))


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
    residuals : ndarray, shape (n, q)
        Whitened measurements minus their values at the curve.
    counts : ndarray of bool, shape (n,)
        Whether each measurement is a point that is not an outlier.
    weights : ndarray, shape (n,)
        Mean weight of a coordinate of every point.
    coordinates : int
        Number of coordinates of a point.
    """

    knots: Doubles
    known: Any
    times: Doubles
    firsts: NDArray[np.int64]
    factors: Doubles
    sides: Doubles
    residuals: Doubles
    counts: NDArray[np.bool_]
    weights: Doubles
    coordinates: int

    @property
    def rows_per_datum(self) -> int:
        """Number of linear functions of the coefficients for one measurement."""
        return int(self.factors.shape[1])

    def rows(self, data: NDArray[np.intp], firsts: NDArray[np.int64], factors: Doubles) -> Any:
        """Return linear functions of the coefficients and parameters with these factors."""
        q = self.rows_per_datum
        each = (np.ascontiguousarray(own.reshape(len(data) * q, -1)) for own in (factors, self.sides[data]))
        return np.repeat(firsts, q), *each

    def whitened(self, data: NDArray[np.intp], vectors: Doubles) -> Doubles:
        """Return vectors, which are whitened, with one row per row of `rows`."""
        return np.ascontiguousarray(vectors.reshape(-1, 1))

    def system(self) -> tuple[NDArray[np.int64], Doubles, Any, Doubles]:
        """Return the first coefficients and their factors at all data, and the linear problem: rows and residuals."""
        every = np.arange(len(self.times))
        return (
            self.firsts,
            self.factors,
            self.rows(every, self.firsts, self.factors),
            self.whitened(every, self.residuals),
        )

    def per_datum(self, data: NDArray[np.intp], rows: Doubles) -> Doubles:
        """Return means over the coordinates of points, from sums over their rows."""
        return np.asarray(rows.reshape(len(data), -1).sum(axis=1) / self.coordinates)

    def observed_weights(self, data: NDArray[np.intp]) -> Doubles:
        """Return mean weights of the coordinates of points."""
        return self.weights[data]


class Predicted(NamedTuple):
    """Predictions without data: squared errors and variances per coordinate in units of the noise, and distances."""

    squares: Doubles
    variances: Doubles
    at_data: Doubles
    distances: Doubles

    def of(self, chosen: Any) -> Predicted:
        """Return the chosen predictions."""
        return Predicted(*(own[chosen] for own in self))


def factor_of(predictions: Predicted, m: int, disjoint: float) -> float:
    """Return the factor k ≥ 1 for which `v + (k² − 1)(v − v₀)` are the variances of predictions; NaN without any.

    Parameters
    ----------
    predictions : Predicted
        Squared errors e², variances v, and variances v₀ at data.
    m : int
        Number of coordinates.
    disjoint : float
        Number of disjoint blocks. As the factor is estimated from few blocks, the F distribution replaces χ².
    """
    predictions = predictions.of(
        np.isfinite(predictions.variances) & (predictions.variances > _INSIDE * predictions.at_data)
    )
    e, v, excess = predictions.squares, predictions.variances, predictions.variances - predictions.at_data
    if len(e) < _FEW:
        return np.nan

    def surplus(log_k: float) -> float:
        return float(np.mean(e / (v + np.expm1(2 * log_k) * excess + 1)) - 1)

    low, high = 0.0, 1.0
    if surplus(low) > 0:
        while surplus(high) > 0:
            low, high = high, 2 * high
        while high - low > 1e-3:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if surplus(middle) > 0 else (low, middle)
    else:
        high = 0.0
    plain = _core.chi_squared(m, _LEVEL)
    independent = max(1, round(min(disjoint, len(e))))
    spread = np.sqrt(_core.chi_squared_ratio(m, m * independent, _LEVEL) / plain)
    # The factor for which the bands contain the required share of the errors. It protects against bursts.
    covering = np.quantile((m * e / plain - 1 - predictions.at_data) / excess, _LEVEL)
    return float(max(1.0, spread * np.exp(high), np.sqrt(max(covering, 0.0))))


class Calibration:
    """How the variances of a curve change in gaps and beyond its data.

    Parameters
    ----------
    course : Course
        The process.
    gaps : list of tuple
        Start, stop, factor and number of blocks of every long gap.
    at_data : callable
        Function that returns the median variance at the data, of points (0) or velocities (1).
    width : float
        Width h of the smoother.
    ends : tuple of float
        Times of the first and the last datum; infinite if variances beyond them do not change.
    period : float
        Period of a closed curve; NaN for others.
    beyond : callable
        Function that returns distances beyond the ends with their factors, shape (n, 2), and the number of blocks.
    """

    def __init__(
        self,
        course: Course,
        gaps: list[tuple[float, float, float, int]],
        at_data: Callable[[int], float],
        width: float,
        ends: tuple[float, float] = (-np.inf, np.inf),
        period: float = np.nan,
        beyond: Callable[[], tuple[Doubles, int]] | None = None,
    ) -> None:
        self.gaps, self.width, self.at_data = gaps, width, cache(at_data)
        self._course, self._period, self._ends = course, period, ends
        self._of_ends = beyond

    @property
    def ends(self) -> list[tuple[float, float, float, int]]:
        """The times before the first and after the last datum, with the largest factor and the number of blocks."""
        if self._of_ends is None:
            return []
        rungs, blocks = self._beyond
        largest = float(rungs[:, 1].max()) if len(rungs) else np.nan
        first, last = self._ends
        return [(-np.inf, first, largest, blocks), (last, np.inf, largest, blocks)]

    @cached_property
    def _beyond(self) -> tuple[Doubles, int]:
        return self._of_ends() if self._of_ends else (np.zeros((0, 2)), 0)

    @cached_property
    def _at_ends(self) -> Doubles:
        """Variance of the point, its covariance with the velocity, and variance of the velocity, at both ends."""
        return np.array([self._course.line(float(end))[[0, 0, 1], [0, 1, 1]] for end in self._ends])

    def inflation(self, x: Doubles, nu: int) -> Doubles:
        """Return the factors of standard deviations at times x: exactly 1 away from gaps and between the ends."""
        out = np.ones(x.shape)
        near, excess = self._in_gaps(x)
        outside = (x < self._ends[0]) | (x > self._ends[1])
        near &= ~outside
        if near.any():
            v = self._course.variance(x[near], nu)
            out[near] = _ratio(v + excess[near] * np.maximum(v - self.at_data(nu), 0.0), v)
        if outside.any():
            v = self._course.variance(x[outside], nu)
            out[outside] = _ratio(self._variance_beyond(x[outside], v, nu), v)
        return out

    def _in_gaps(self, x: Doubles) -> tuple[NDArray[np.bool_], Doubles]:
        """Return whether times are near gaps, and k² − 1 there, which decreases to zero between h and 2h from a gap."""
        excess, undetermined = np.zeros(x.shape), np.zeros(x.shape, bool)
        turns = [0.0] if np.isnan(self._period) else [-self._period, 0.0, self._period]
        if turns[1:]:
            x = self._start_of_period + np.mod(x - self._start_of_period, self._period)
        for start, stop, factor, _ in self.gaps:
            for turn in turns:
                away = np.maximum(np.maximum(start + turn - x, x - stop - turn), 0.0)
                if np.isnan(factor):
                    undetermined |= (x > start + turn) & (x < stop + turn)
                    continue
                excess = np.maximum(excess, (factor**2 - 1) * np.clip(2.0 - away / self.width, 0.0, 1.0))
        excess[undetermined] = np.nan
        return undetermined | (excess > 0), excess

    @property
    def _start_of_period(self) -> float:
        return self.gaps[0][0] if self.gaps else 0.0

    def _factors_beyond(self, distance: Doubles) -> Doubles:
        """Return the factors at distances from the ends."""
        rungs, _ = self._beyond
        if not len(rungs):
            return np.full(distance.shape, np.nan)
        at, factors = np.log(rungs.T)
        return np.asarray(np.exp(np.interp(np.log(distance), at, factors)))

    def _variance_beyond(self, x: Doubles, v: Doubles, nu: int) -> Doubles:
        """Return the variance at times beyond the ends, where the variance of the spline is v."""
        behind = x > self._ends[1]
        of_end = self._at_ends[behind.astype(int)]
        d = np.where(behind, x - self._ends[1], self._ends[0] - x)
        # Backwards in time, the velocity has the opposite sign.
        sign = np.where(behind, 1.0, -1.0)
        here = of_end[:, 2 * nu]
        line = here + (2 * sign * d * of_end[:, 1] + d**2 * of_end[:, 2] if nu == 0 else 0.0)
        process = np.maximum(v, line + self._course.drift(d, nu))
        return np.asarray(process + (self._factors_beyond(d) ** 2 - 1) * np.maximum(process - here, 0.0))


def _ratio(more: Doubles, v: Doubles) -> Doubles:
    """Return the square root of the ratio of two variances, 1 where the denominator is zero."""
    out = np.ones(v.shape)
    np.sqrt(np.divide(more, v, out=out, where=~(v <= 0)), out=out)
    return out


def calibrate(
    times: Doubles, weights: Doubles, course: Course, period: float, evidence: Callable[[], Any], ends: bool = True
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
        Whether variances beyond the data change as well. This needs `Evidence`.

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

    def width_without(lengths: Any) -> float:
        return float(((apart.sum() - np.sum(lengths)) / weights.sum() * course.lam) ** (0.5 / course.order))

    width = width_without(apart[apart > 10 * usual])
    candidates = np.flatnonzero(apart > max(2 * width, _SPARSE * usual))
    long = candidates[:0]
    if len(candidates):
        middles = whole[candidates] + 0.5 * apart[candidates]
        long = candidates[course.variance(middles, 0) > _WIDE * at_data(0)]
    spans = np.stack([whole[long], whole[long + 1]], axis=-1)
    width = width_without(apart[long])
    gaps = []
    if len(spans):
        factors = _factors_of_gaps(_Blocks(evidence(), spans, width, at_data(0), period), spans)
        gaps = [(float(start), float(stop), *own) for (start, stop), own in zip(spans, factors, strict=True)]
    if closed or not ends:
        return Calibration(course, gaps, at_data, width, period=period)
    outer = float(times[0]), float(times[-1])
    return Calibration(course, gaps, at_data, width, outer, beyond=lambda: _beyond(evidence(), course, usual))


def _factors_of_gaps(blocks: _Blocks, gaps: Doubles) -> list[tuple[float, int]]:
    """Return the factor and the number of blocks for every gap."""
    lengths = gaps[:, 1] - gaps[:, 0]
    shortest, longest = lengths.min(), lengths.max()
    steps = min(_LENGTHS, int(np.ceil(np.log2(longest / shortest) - 1e-9)) + 1)
    ladder = np.geomspace(shortest, longest, steps) if steps > 1 else np.array([longest])
    known = {float(length): own for length in ladder if (own := blocks.factor(length)) is not None}
    shorter = float(shortest)
    while not known and shorter > max(2 * blocks.width, shortest / 2**_LENGTHS):
        # No block is as long as the shortest gap, so shorter ones are tried.
        shorter /= 2
        own = blocks.factor(shorter)
        if own is not None:
            known[shorter] = own
    if len(known) == 1 and min(known) < shortest:
        # The factor may increase with the length, so the maximum over shorter lengths is used.
        for length in (shorter / 2, shorter / 4):
            own = blocks.factor(length) if length > blocks.width else None
            if own is not None:
                known[length] = own
    if not known:
        return [blocks.any_factor(length) for length in lengths]
    at = np.array(sorted(known))
    values = np.array([known[length][0] for length in at])
    out = []
    for length in lengths:
        if length > at[-1] * (1 + 1e-9):
            out.append((float(values.max()), 0))
        else:
            factor = np.exp(np.interp(np.log(length), np.log(at), np.log(values)))
            out.append((float(factor), known[float(at[np.searchsorted(at, length * (1 - 1e-9))])][1]))
    return out


class _Blocks:
    """Parts of a recording whose data can be omitted."""

    def __init__(
        self, evidence: Evidence | SensorEvidence, gaps: Doubles, width: float, at_data: float, period: float
    ) -> None:
        self.evidence, self.gaps, self.width, self.at_data = evidence, gaps, width, at_data
        t = evidence.times
        self.closed, self.count = not np.isnan(period), len(t)
        # Blocks of closed curves may contain the first and the last datum.
        self.times = np.concatenate([t, t + period]) if self.closed else t
        self.all_gaps = np.concatenate([gaps, gaps + period]) if self.closed else gaps
        self.span = (t[0], t[0] + period) if self.closed else (t[0], t[-1])
        self.firsts, self.factors, self.data, self.residuals = evidence.system()

    def factor(self, length: float) -> tuple[float, int] | None:
        """Return the factor for gaps of a length and the number of blocks, or None if there are none."""
        edge = min(2 * self.width, length)
        first, last = self.span[0], self.span[1] - length
        if not self.closed:
            first, last = first + edge, last - edge
        if last < first:
            return None
        starts = np.linspace(first, last, 1 + int(min(max(8 * (last - first) / length, 1), 4096)))
        edges = np.stack([starts - edge, starts, starts + length, starts + length + edge])
        inside = np.zeros(len(starts))
        good = np.ones(len(starts), bool)
        for start, stop in self.all_gaps:
            good &= ~((edges > start) & (edges < stop)).any(axis=0)
            inside += np.maximum(np.minimum(stop, starts + length) - np.maximum(start, starts), 0.0)
        return self._of(starts[good & (inside <= 0.5 * length)], length)

    def any_factor(self, length: float) -> tuple[float, int]:
        """Return the factor from blocks anywhere between the first and the last datum, including other gaps."""
        starts = np.linspace(self.span[0], self.span[1] - length, 4 * _BLOCKS)
        return self._of(starts, length) or (np.nan, 0)

    def _of(self, starts: Doubles, length: float) -> tuple[float, int] | None:
        omitted = []
        for start in starts:
            a, b = np.searchsorted(self.times, (start, start + length), side="right")
            own = np.arange(a, b) % self.count
            # A block needs data on both sides, and a datum in it that is not an outlier.
            beside = b - a < self.count if self.closed else a > 0 and b < len(self.times)
            if beside and self.evidence.counts[own].any():
                omitted.append((start, own))
        if not omitted:
            return None
        disjoint, reached = 0, -np.inf
        for start, _ in omitted:
            if start >= reached:
                disjoint, reached = disjoint + 1, start + length
        omitted = [omitted[i] for i in _some(len(omitted), _BLOCKS)]
        found = self._predicted([own for _, own in omitted])
        factor = factor_of(found, self.evidence.coordinates, disjoint)
        return None if np.isnan(factor) else (factor, len(omitted))

    def _predicted(self, omitted: list[NDArray[np.intp]]) -> Predicted:
        evidence = self.evidence
        probed = []
        for own in omitted:
            some = own[evidence.counts[own]]
            probed.append(some[_some(len(some), _PREDICTED)])
        chosen = np.concatenate(probed)
        probes = evidence.rows(chosen, self.firsts[chosen], self.factors[chosen])
        values, variances = _without(evidence, self.data, self.residuals, probes, omitted, [len(p) for p in probed])
        errors = evidence.whitened(chosen, evidence.residuals[chosen]) - values
        squares, v = (evidence.per_datum(chosen, own) for own in (errors**2, variances))
        return Predicted(squares, v, self.at_data * evidence.observed_weights(chosen), np.zeros(len(chosen)))


def _some(count: int, most: int) -> NDArray[np.intp]:
    """Return evenly distributed ones of so many indices, the first and the last among them."""
    return np.linspace(0, count - 1, min(count, most)).astype(int)


def _without(
    evidence: Evidence | SensorEvidence,
    data: Any,
    residuals: Doubles,
    probes: Any,
    omitted: list[Any],
    counts: list[int],
) -> tuple[Doubles, Doubles]:
    """Return changes and variances of linear functions without the omitted data; each block has `counts` functions."""
    rows = evidence.rows_per_datum
    each = [(own[:, None] * rows + np.arange(rows)).ravel() for own in omitted]
    stops = np.cumsum([len(own) for own in each])
    of_probes = np.cumsum(counts) * rows
    blocks = [
        [int(stop) - len(own), int(stop), int(last) - count * rows, int(last)]
        for own, stop, last, count in zip(each, stops, of_probes, counts, strict=True)
    ]
    flat = np.ascontiguousarray(np.concatenate(each), np.int64)
    return _core.predictions_without(evidence.knots, evidence.known, data, residuals, probes, flat, blocks)


def _beyond(evidence: Evidence, course: Course, usual: float) -> tuple[Doubles, int]:
    """Return distances beyond the ends with their factors, and the number of predictions.

    Each prediction omits all data after a datum in the last two thirds of the recording, and continues the curve from
    there with constant velocity. The same is done backwards in time.
    """
    t, (n, m) = evidence.times, evidence.residuals.shape
    span = t[-1] - t[0]
    reach = _BEYOND * span
    firsts, factors, data, residuals = evidence.system()
    slopes = _core.coefficient_factors(evidence.knots, evidence.known[2], t, 1)[1]
    omitted, counts, lines = [], [], []
    for direction in (1, -1):
        here = direction * t[::direction]
        cuts = np.linspace(here[0] + reach, here[-1] - min(2 * usual, 0.1 * span), _BLOCKS // 2)
        for cut in np.unique(np.searchsorted(here, cuts, side="right")):
            stop = int(np.searchsorted(here, here[cut - 1] + reach, side="right"))
            # The remaining data must determine more than a line.
            if cut < max(_FEW, course.order + 1) or cut >= n:
                continue
            ahead = np.arange(cut, stop)
            ahead = ahead[_some(len(ahead), _PREDICTED)]
            index = np.arange(n)[::direction]
            omitted.append(index[cut:])
            at, ahead = np.full(len(ahead) + 1, index[cut - 1]), np.append(index[ahead], index[cut - 1])
            counts.append(len(ahead))
            lines.append((at, ahead))
    if not lines:
        return np.zeros((0, 2)), 0
    at, ahead = (np.concatenate(own) for own in zip(*lines, strict=True))
    d = t[ahead] - t[at]
    probes = evidence.rows(ahead, firsts[at], factors[at] + d[:, None] * slopes[at])
    values, variances = _without(evidence, data, residuals, probes, omitted, counts)
    line = evidence.positions[at] + d[:, None] * evidence.velocities[at]
    left = evidence.residuals[ahead] + evidence.positions[ahead] - line
    squares = evidence.per_datum(ahead, (evidence.whitened(ahead, left) - values) ** 2)
    v, weights = evidence.per_datum(ahead, variances), evidence.observed_weights(ahead)
    # The last probe of every block is the end itself.
    last = np.cumsum(counts) - 1
    v0 = np.repeat(v[last] / weights[last], counts) * weights
    found = Predicted(squares, v + weights * course.drift(np.abs(d)), v0, np.abs(d))
    found = found.of(evidence.counts[ahead] & (found.distances > 0))
    rungs, factors_of = [], []
    high = reach
    while high > max(usual, reach / 2**_LENGTHS):
        factor = factor_of(
            found.of((found.distances > 0.5 * high) & (found.distances <= high)),
            m,
            min(2 / 3 * span / high, len(lines)),
        )
        if not np.isnan(factor):
            rungs.append(0.75 * high)
            factors_of.append(min(factor, _MOST))
        high /= 2
    return np.array([rungs[::-1], factors_of[::-1]]).T.reshape(-1, 2), len(lines)

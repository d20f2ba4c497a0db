"""Lengths and bending energies of curves of any kind, closest points, extrema and crossings of values."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from .. import _core
from .._base.report import Report
from .._base.typing import Array, BatchIndex, Number
from .._core import CutLocusError, ValidationError
from .._spaces import AnySpace, Doubles, Quotient, factors_of, parts_of, product_norm
from ..manifolds import Manifold
from .curve import CurveArrays
from .failures import cut_fractions


class Evaluable(Protocol):
    """Curve with a length and an energy: it is smooth between `times`, and its norms can be evaluated."""

    @property
    def times(self) -> Doubles: ...
    @property
    def batch(self) -> tuple[int, ...]: ...
    @property
    def quad_rtol(self) -> float: ...

    def evaluate(self, x: Doubles, quantity: str, outside: str, per_curve: bool) -> Any: ...


def _rows(curve: Evaluable) -> Doubles:
    """Return knots with one row per curve."""
    times = curve.times
    shape = (math.prod(curve.batch), times.shape[-1])
    return np.ascontiguousarray(np.broadcast_to(times, (*curve.batch, shape[1])).reshape(shape))


def _norm(curve: Evaluable, quantity: str) -> _core.Curve | Callable[[Doubles], Doubles]:
    """Return what the core integrates: its own curve, or a function of times of shape (curves, m)."""
    if isinstance(curve, CurveArrays) and curve.is_compiled:
        return curve.compiled

    def norm(x: Doubles) -> Doubles:
        times = np.ascontiguousarray(x.reshape(*curve.batch, x.shape[-1]))
        # Values beyond the floating-point range become infinite, and a curve without a solution is NaN.
        with np.errstate(all="ignore"):
            return np.ascontiguousarray(curve.evaluate(times, quantity, "continue", True)).reshape(x.shape)

    return norm


def _integral(curve: Evaluable, quantity: str) -> Number:
    if 0 in curve.batch:
        return np.zeros(curve.batch)
    integrals = _core.integrals(_rows(curve), _norm(curve, quantity), quantity, curve.quad_rtol)
    result: Number = integrals.reshape(curve.batch)[()]
    return result


def length(curve: Evaluable) -> Number:
    """Compute the length of each curve."""
    return _integral(curve, "speed")


def bending_energy(curve: Evaluable) -> Number:
    """Compute ∫ |∇γ'|² dt, equation (1), for each curve."""
    return _integral(curve, "bend")


class ArcLength:
    """The arc length of curves. Times and lengths have shape (*batch, m).

    Attributes
    ----------
    times : ndarray, shape (curves, k)
        Ends of short intervals, increasing; they include all knots.
    lengths : ndarray, shape (curves, k)
        Arc lengths from the first knot to these times. NaN for curves that failed.
    """

    def __init__(self, curve: Evaluable) -> None:
        self._table = _core.ArcLength(_rows(curve), _norm(curve, "speed"), curve.quad_rtol)
        self.times, self.lengths = self._table.times, self._table.lengths

    def _call(self, method: Callable[..., Doubles], *arrays: Doubles) -> Doubles:
        rows = [np.ascontiguousarray(array.reshape(len(self.times), -1)) for array in arrays]
        return method(*rows).reshape(arrays[0].shape)

    def at(self, x: Doubles) -> Doubles:
        """Return the arc lengths from the first knot to times x."""
        return self._call(self._table.at, x)

    def between(self, a: Doubles, b: Doubles) -> Doubles:
        """Return the lengths from times a to times b, which are not before a."""
        return self._call(self._table.between, a, b)

    def times_at(self, s: Doubles) -> Doubles:
        """Return the first times at which the arc length is s, between 0 and the length of the curve."""
        return self._call(self._table.times_at, s)


def alternative_energy(parts: Sequence[Evaluable], reports: list[Report]) -> Any:
    """Return the lowest energy of the alternative curves through the points of a product, or None.

    An alternative curve replaces the solution in one factor by the alternative solution of that factor.
    """
    if all(report.alternative_energy is None for report in reports):
        return None
    energies: list[Any] = [bending_energy(part) for part in parts]
    others = [
        sum(energies) - energy + report.alternative_energy
        for energy, report in zip(energies, reports, strict=True)
        if report.alternative_energy is not None
    ]
    return np.fmin.reduce(others)


# ---- the nearest points of curves: their samples and distances, for the search of the core ----

Indices = NDArray[np.int64]

# Samples per interval of the table of arc lengths, which resolves the speed. Between two samples, the squared distance
# is close to a cubic polynomial.
_SAMPLES = 2
# A factor whose speed is below this part of the whole speed is at rest.
_REST = 1e-12


class ClosestPoints:
    """Search for the nearest points of the curves of a batch.

    Parameters
    ----------
    curve : Evaluable
        The curves, in a space with a distance.
    arc : ArcLength
        Their arc lengths.
    """

    def __init__(self, curve: Evaluable, space: AnySpace, arc: ArcLength) -> None:
        self._curve, self._space, self._arc = curve, space, arc
        self.factors = factors_of(space)

    def search(self, targets: list[Array], curve: Indices) -> tuple[Doubles, Doubles]:
        """Return the times of the nearest points and their distances; NaN for curves that failed.

        Parameters
        ----------
        targets : list of ndarray, shape (m, *point_shape)
            Points in each factor.
        curve : ndarray of int, shape (m,)
            Index of the curve of each point in the flattened batch, not decreasing.
        """
        times, distances = np.full((2, len(curve)), np.nan)
        good = np.flatnonzero(np.isfinite(self._arc.lengths[curve, -1]))
        if not good.size:
            return times, distances
        nearest = self._nearest([x[good] for x in targets], curve[good])
        if not np.isfinite(nearest[1]).all():
            raise ValidationError(
                "points are too far from the curve, or too large, for finite distances. Rescale them."
            )
        times[good], distances[good] = nearest
        return times, distances

    def _nearest(self, targets: list[Array], curve: Indices) -> tuple[Doubles, Doubles]:
        compiled = self._compiled
        if compiled is None:
            distances = _Distances(self, targets, curve)
            return _core.closest(self.times, self.lengths, curve, distances.of_samples, distances.at)
        samples, points = (
            [np.ascontiguousarray(f._as_doubles(x)) for f, x in zip(self.factors, arrays, strict=True)]
            for arrays in (self.points, targets)
        )
        return compiled.closest(self.times, self.lengths, samples, points, curve)

    @cached_property
    def _compiled(self) -> _core.Curve | None:
        """The curve of the core, if it can compute all points and distances."""
        curve = self._curve
        if not isinstance(curve, CurveArrays) or not curve.is_smooth:
            return None
        # Distances in quotients are those of the nearest representatives.
        return None if any(isinstance(factor, Quotient) for factor in self.factors) else curve.compiled

    @cached_property
    def times(self) -> Doubles:
        """Times of the samples, shape (curves, k); they include the knots."""
        ends = self._arc.times
        parts = np.arange(_SAMPLES) / _SAMPLES
        inner = ends[:, :-1, None] + parts * np.diff(ends)[..., None]
        return np.concatenate([inner.reshape(self.count, -1), ends[:, -1:]], axis=-1)

    @cached_property
    def lengths(self) -> Doubles:
        """Arc lengths up to the samples."""
        return self._arc.at(self.times)

    @cached_property
    def points(self) -> list[Array]:
        """Points of the curves at the samples in each factor."""
        return self.at_rows(self.times, "point")

    @property
    def count(self) -> int:
        """Number of curves."""
        return math.prod(self._curve.batch)

    def at_rows(self, x: Doubles, quantity: str) -> list[Array]:
        """Evaluate the curves at times of shape (curves, m)."""
        values = self._curve.evaluate(
            np.ascontiguousarray(x.reshape(*self._curve.batch, -1)), quantity, "continue", True
        )
        pairs = zip(self.factors, parts_of(values, self._space, quantity), strict=True)
        return [array.reshape(*x.shape, *factor.point_shape) for factor, array in pairs]

    def at(self, curve: Indices, x: Doubles, quantity: str) -> list[Array]:
        """Evaluate curves at one time each; indices of curves may repeat, and do not decrease."""
        if self.count == 1:
            return [array[0] for array in self.at_rows(x[None], quantity)]
        # The core evaluates all curves at equally many times.
        counts = np.bincount(curve, minlength=self.count)
        column = np.arange(len(curve)) - (np.cumsum(counts) - counts)[curve]
        rows = np.repeat(self.times[:, :1], counts.max(initial=1), axis=1)
        rows[curve, column] = x
        return [array[curve, column] for array in self.at_rows(rows, quantity)]


class _Distances:
    """Distances between some points and curves of any kind, for the search of the core."""

    def __init__(self, table: ClosestPoints, targets: list[Array], curve: Indices) -> None:
        self.table, self.targets, self.curve = table, targets, curve

    def of_samples(self, target: Indices, number: Indices) -> Doubles:
        """Return the distances between targets and samples."""
        curve = self.curve[target]
        return self._distances([points[curve, number] for points in self.table.points], target)

    def at(self, target: Indices, x: Doubles) -> tuple[Doubles, Doubles]:
        """Return the distances d at times x, and the derivatives of d²/2: −⟨log q, γ'⟩.

        They are NaN where there is no logarithm.
        """
        points, velocities = (self.table.at(self.curve[target], x, what) for what in ("point", "velocity"))
        factors = self.table.factors
        rows = zip(factors, points, velocities, self.targets, strict=True)
        parts = np.stack([-_inner(factor, p, _logarithms(factor, p, q[target]), v) for factor, p, v, q in rows])
        if len(factors) > 1 and np.isnan(parts).any():
            # At the cut locus in a factor that is at rest, the distance in this factor does not change.
            speeds = np.stack([np.asarray(f.norm(p, v)) for f, p, v in zip(factors, points, velocities, strict=True)])
            parts = np.where(speeds <= _REST * product_norm(tuple(speeds)), 0.0, parts)
        return self._distances(points, target), np.asarray(parts.sum(axis=0))

    def _distances(self, points: list[Array], target: Indices) -> Doubles:
        rows = zip(self.table.factors, points, self.targets, strict=True)
        return np.asarray(product_norm(tuple(_distances(factor, p, q[target]) for factor, p, q in rows)))


# ---- operations of one factor on rows ----


def _distances(space: AnySpace, p: Array, q: Array) -> Doubles:
    """Return distances; infinite if they are unknown."""
    try:
        return np.asarray(space.distance(p, q))
    except CutLocusError:
        # Only on a manifold made of functions.
        p, q = np.broadcast_arrays(p, q)
        v = _logarithms(space, p, q)
        norm = np.sqrt(_inner(space, p, v, v))
        return np.where(np.isfinite(norm), norm, np.inf)


def _logarithms(space: AnySpace, p: Array, q: Array) -> Array:
    """Return logarithms; NaN at the cut locus."""
    try:
        return np.asarray(space.log(p, q))
    except CutLocusError:
        vectors = np.full(p.shape, np.nan, space.dtype)
        if isinstance(space, Manifold):
            return space.operations.log(p, q)
        good = np.flatnonzero(cut_fractions(space, np.stack([p, q], axis=1))[:, 0] < 1 - 1e-9)
        vectors[good] = space.log(p[good], q[good])
        return vectors


def _inner(space: AnySpace, p: Array, u: Array, v: Array) -> Doubles:
    good = space._where_finite(u)
    if good.all():
        return np.asarray(space.inner(p, u, v))
    products = np.full(good.shape, np.nan)
    products[good] = space.inner(p[good], u[good], v[good])
    return products


# ---- extrema of functions of time, and times at which they have a given value ----

Function = Callable[[Doubles], Doubles]

# Chebyshev nodes per interval, and how often an interval is halved if a polynomial does not represent the function.
_NODES = 24
_DEPTH = 7
# Part of the largest value below which the last coefficients of a polynomial and the changes of a constant are rounding
# errors.
_SMALL = 1e-10
# Rounding errors by which values of a spline can deviate, relative to those of its points divided by a power of the
# knot spacing: second differences of points have coefficients of up to 12, in several coordinates.
_NOISE = 64 * float(np.finfo(np.float64).eps)
# Points per interval at which the signs of the derivative are compared.
_SIGNS = 49

# Steps of golden-section search, which divide an interval by 10¹⁰.
_GOLDEN = 48
_RATIO = (np.sqrt(5) - 1) / 2

_POINTS = chebyshev.chebpts1(_NODES)
# From values at the nodes to the coefficients of the interpolating polynomial.
_TO_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(_POINTS, _NODES - 1))


class Intervals(NamedTuple):
    """A function as a polynomial on each of several intervals, which cover the domain in order.

    Attributes
    ----------
    a, b : ndarray, shape (m,)
        Ends of the intervals.
    values : ndarray, shape (m, n)
        Values at the Chebyshev nodes.
    rough : ndarray of bool, shape (m,)
        Whether the polynomial does not represent the function, as next to a kink.
    noise : ndarray, shape (m,)
        Size of the rounding errors of the function.
    """

    a: Doubles
    b: Doubles
    values: Doubles
    rough: NDArray[np.bool_]
    noise: Doubles

    @classmethod
    def of(cls, f: Function, knots: Doubles, noise: Doubles) -> Self:
        """Sample a function between the knots. Intervals are halved until polynomials represent it."""
        a, b, scale, done = knots[:-1], knots[1:], 0.0, []
        for depth in range(_DEPTH + 1):
            values = f(_nodes(a, b).ravel()).reshape(-1, _NODES)
            scale = max(scale, float(np.abs(values).max()))
            # Halving an interval does not remove its rounding errors.
            rough = np.abs(values @ _TO_COEFFICIENTS[-3:].T).max(axis=-1) > np.maximum(_SMALL * scale, noise)
            kept = ~rough | (depth == _DEPTH)
            done.append(cls(a[kept], b[kept], values[kept], rough[kept], noise[kept]))
            if kept.all():
                break
            middle = (a + b)[rough] / 2
            a, b = (np.stack(x, axis=-1).ravel() for x in ((a[rough], middle), (middle, b[rough])))
            noise = np.repeat(noise[rough], 2)
        columns = [np.concatenate(x) for x in zip(*done, strict=True)]
        order = np.argsort(columns[0])
        return cls(*(x[order] for x in columns))

    @property
    def coefficients(self) -> Doubles:
        """Coefficients of the Chebyshev polynomials, shape (n, m)."""
        return np.asarray(_TO_COEFFICIENTS @ self.values.T)

    def time(self, number: Any, tau: Doubles) -> Doubles:
        """Return times in intervals, where tau is from -1 to 1."""
        return np.asarray(self.a[number] + (self.b - self.a)[number] * (tau + 1) / 2)


def _nodes(a: Doubles, b: Doubles) -> Doubles:
    return a[:, None] + (b - a)[:, None] * (_POINTS + 1) / 2


def rounding_noise(sizes: Doubles, spacing: Doubles, order: int) -> Doubles:
    """Return the size of rounding errors of a derivative between knots.

    Errors of points, ε times their size, are divided by the spacing of the knots to the power of the order. At a dense
    sampling, the second derivative consists of them: the error is 4e-8 for unit vectors at 1 kHz.

    Parameters
    ----------
    sizes : ndarray, shape (n,)
        Sizes of the points at the knots.
    spacing : ndarray, shape (n - 1,)
        Spacing of the knots.
    """
    # The errors of an interval decay over the next ones, which may be longer.
    shortest = np.minimum(spacing, np.minimum(np.append(spacing[1:], np.inf), np.append(np.inf, spacing[:-1])))
    with np.errstate(over="ignore", divide="ignore"):
        return np.asarray(_NOISE * np.maximum(sizes[1:], sizes[:-1]) / shortest**order)


def extrema(f: Function, knots: Doubles, sign: float, noise: Doubles) -> Doubles:
    """Return the times of local maxima (sign 1) or minima (sign -1), including those at the ends of the domain.

    Parameters
    ----------
    noise : ndarray, shape (n - 1,)
        Size of the rounding errors of the function between the knots. Extrema that they explain are omitted.
    """
    intervals = Intervals.of(f, knots, noise)
    candidates = _candidates(f, intervals, knots, sign)
    return _prominent(f, intervals, knots, sign, candidates) if noise.any() else candidates


def _prominent(f: Function, intervals: Intervals, knots: Doubles, sign: float, candidates: Doubles) -> Doubles:
    """Return the maxima on both sides of which the function falls by more than its rounding errors.

    Of several maxima that are not separated by such a fall, only the largest one is returned.
    """
    sampled = np.concatenate([knots[:1], _nodes(intervals.a, intervals.b).ravel(), knots[-1:]])
    values = sign * np.concatenate([f(knots[:1]), intervals.values.ravel(), f(knots[-1:])])
    allowed = np.repeat(intervals.noise, _NODES)
    allowed = np.concatenate([allowed[:1], allowed, allowed[-1:]])
    if np.ptp(values) <= allowed.max():
        # A constant: all its values are largest.
        return np.asarray(knots[[0, -1]])
    peaks = sign * f(candidates)
    # Between two maxima, only the smallest value matters.
    starts = np.searchsorted(sampled, candidates)
    ends = np.append(starts, len(sampled))
    lows = [
        values[a:b].min(initial=np.inf) for a, b in zip(np.append(0, ends[:-1]).tolist(), ends.tolist(), strict=True)
    ]
    tolerance = allowed[np.minimum(starts, len(allowed) - 1)].tolist()
    kept: list[int] = []
    best, low = -1, lows[0]
    for i, (peak, after) in enumerate(zip(peaks.tolist(), lows[1:], strict=True)):
        # `low` is the smallest value since the best maximum so far, or since the last one that was kept.
        if best < 0:
            if not kept or peak - low > tolerance[i]:
                best, low = i, after
            else:
                low = min(low, after)
        elif peak > peaks[best]:
            best, low = i, after
        else:
            low = min(low, after)
        if best >= 0 and peaks[best] - low > tolerance[best]:
            kept.append(best)
            best = -1
    if best >= 0:
        kept.append(best)
    return candidates[kept]


def _candidates(f: Function, intervals: Intervals, knots: Doubles, sign: float) -> Doubles:
    """Return the times of all maxima, including those caused by rounding errors."""
    scale = float(np.abs(intervals.values).max())
    slopes = sign * chebyshev.chebder(intervals.coefficients)
    tau = np.linspace(-1, 1, _SIGNS)
    values = chebyshev.chebval(tau, slopes)
    # Changes that rounding errors explain do not have a sign.
    values[np.abs(values) <= np.maximum(_SMALL * scale, intervals.noise)[:, None]] = 0.0
    number, place = np.nonzero(values)
    if not len(number):
        return np.asarray(knots[[0, -1]])
    signs = np.sign(values[number, place])
    turns = np.flatnonzero((signs[:-1] > 0) & (signs[1:] < 0))
    candidates = intervals.time(number[turns], tau[place[turns]])
    inside = number[turns] == number[turns + 1]
    # In other cases, the maximum is at a knot, or a constant part begins there.
    candidates[~inside] = intervals.b[number[turns[~inside]]]
    sign_changes = turns[inside]
    ends = tau[place[sign_changes]], tau[place[sign_changes + 1]]

    def slope(index: BatchIndex, x: Doubles) -> Doubles:
        return np.asarray(chebyshev.chebval(x, slopes[:, number[sign_changes[index]]], tensor=False))

    starts, stops = (values[number[i], place[i]] for i in (sign_changes, sign_changes + 1))
    root = _core.roots(slope, ends, (starts, stops), (ends[0] + ends[1]) / 2)
    candidates[inside] = intervals.time(number[sign_changes], root)
    rough = np.flatnonzero(inside)[intervals.rough[number[sign_changes]]]
    candidates[rough], real = _refined(lambda x: sign * f(x), intervals, number[turns[rough]], candidates[rough])
    candidates = np.delete(candidates, rough[~real])
    outer = [knots[:1]] if signs[0] < 0 else []
    return np.concatenate([*outer, candidates, *([knots[-1:]] if signs[-1] > 0 else [])])


def _refined(
    f: Function, intervals: Intervals, number: NDArray[np.intp], x: Doubles
) -> tuple[Doubles, NDArray[np.bool_]]:
    """Improve maxima next to kinks by golden-section search, and return whether they are maxima of the function."""
    if not len(x):
        return x, np.zeros(0, np.bool_)
    reach = (intervals.b - intervals.a)[number] / _NODES
    a, b = np.maximum(x - reach, intervals.a[number]), np.minimum(x + reach, intervals.b[number])
    ends = np.maximum(f(a), f(b))
    for _ in range(_GOLDEN):
        left, right = b - _RATIO * (b - a), a + _RATIO * (b - a)
        lower = f(left) < f(right)
        a, b = np.where(lower, left, a), np.where(lower, b, right)
    middle = (a + b) / 2
    return middle, f(middle) > ends


def crossings(f: Function, knots: Doubles, value: float, noise: Doubles) -> Doubles:
    """Return the times at which a function crosses a value, in increasing order.

    Values that differ from it by less than the rounding errors `noise` between the knots do not have a sign.
    """
    intervals = Intervals.of(f, knots, noise)
    ends = f(knots[[0, -1]])
    times = np.concatenate([knots[:1], _nodes(intervals.a, intervals.b).ravel(), knots[-1:]])
    values = np.concatenate([ends[:1], intervals.values.ravel(), ends[1:]]) - value
    allowed = np.concatenate([[0.0], np.repeat(intervals.noise, _NODES), [0.0]])
    signed = (np.abs(values) > allowed) | (values == 0)
    times, values = times[signed], values[signed]
    exact = np.flatnonzero((values == 0) & np.append(True, values[:-1] != 0))
    sign_changes = np.flatnonzero(values[:-1] * values[1:] < 0)
    interval, outer = (times[sign_changes], times[sign_changes + 1]), (values[sign_changes], values[sign_changes + 1])
    guess = (interval[0] + interval[1]) / 2
    roots = _core.roots(lambda _, x: f(x) - value, interval, outer, guess)
    return np.sort(np.concatenate([times[exact], roots]))


def checked_values(values: object, times: Array) -> Doubles:
    """Return the values of a function of the user at some times."""
    array = np.asarray(values)
    if array.shape != times.shape or array.dtype.kind not in "biuf":
        raise ValidationError(
            f"function must return one real number per time, shape {times.shape}; got {array.dtype} of shape "
            f"{array.shape}"
        )
    good = np.isfinite(array)
    if not good.all():
        i = np.unravel_index(np.argmin(good), good.shape)
        raise ValidationError(
            f"function must return finite numbers in the whole domain of the curve; at the time {times[i]} it returned "
            f"{array[i]}"
        )
    return array.astype(np.float64)

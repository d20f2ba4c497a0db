"""The nearest points of curves, by bounds from the arc length and minima of the squared distance."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from .._core import CutLocusError
from .._curves.arc_length import ArcLength
from .._curves.integrals import Evaluable
from .._representatives import cut_fractions
from .._spaces import Array, Doubles, Space, factors_of, parts_of, product_norm
from ..manifolds import Manifold
from .roots import roots

Indices = NDArray[np.intp]

# Samples per interval of the table of arc lengths, which resolves the speed. Between two samples, the squared distance
# is close to a cubic polynomial.
_SAMPLES = 2
# Intervals at which the search begins.
_COARSE = 64
# Points whose intervals are searched in one call.
_BLOCK = 4096
# Intervals that are divided in one call, which bounds the memory of the search.
_MOST = 2**18
# Rounds in which intervals between samples are divided further.
_ROUNDS = 6
# A factor whose speed is below this part of the whole speed is at rest.
_REST = 1e-12
# Largest part of the depth of a minimum by which its estimate from a cubic polynomial can be too high.
_MARGIN = 0.25


class Pairs(NamedTuple):
    """Intervals of curves in which the nearest point can be, in the order of the targets.

    Attributes
    ----------
    target : ndarray of int, shape (m,)
        Indices of the targets.
    start, stop : ndarray, shape (m,)
        Ends of the intervals: numbers of samples, or times.
    first, last : ndarray, shape (m,)
        Distances at both ends.
    length : ndarray, shape (m,)
        Arc lengths.
    """

    target: Indices
    start: Any
    stop: Any
    first: Doubles
    last: Doubles
    length: Doubles

    def where(self, kept: Any) -> Self:
        """Return some of the intervals."""
        index = kept if isinstance(kept, slice) else np.flatnonzero(kept)
        kept_values: Any = (x[index] for x in self)
        return type(self)(*kept_values)

    @property
    def bound(self) -> Doubles:
        """Lower bounds of the distance, by the triangle inequality."""
        return np.asarray((self.first + self.last - self.length) / 2)

    def split(self, at: Any, distance: Doubles, lengths: tuple[Doubles, Doubles]) -> Self:
        """Return both parts of every interval, given the distance at the time in between and their lengths."""
        halves: tuple[tuple[Any, Any], ...] = (
            (self.target, self.target),
            (self.start, at),
            (at, self.stop),
            (self.first, distance),
            (distance, self.last),
            lengths,
        )
        interleaved: Any = (np.stack(both, axis=-1).ravel() for both in halves)
        return type(self)(*interleaved)


class ClosestPoints:
    """Search for the nearest points of the curves of a batch.

    Parameters
    ----------
    curve : Evaluable
        The curves, in a space with a distance.
    arc : ArcLength
        Their arc lengths.
    """

    def __init__(self, curve: Evaluable, space: Space[Any], arc: ArcLength) -> None:
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
        good = np.flatnonzero(np.isfinite(self._arc.lengths.reshape(self.count, -1)[curve, -1]))
        for i in range(0, len(good), _BLOCK):
            own = good[i : i + _BLOCK]
            times[own], distances[own] = _Search(self, [x[own] for x in targets], curve[own]).result()
        return times, distances

    @cached_property
    def times(self) -> Doubles:
        """Times of the samples, shape (curves, k); they include the knots."""
        ends = self._arc.times.reshape(self.count, -1)
        parts = np.arange(_SAMPLES) / _SAMPLES
        inner = ends[:, :-1, None] + parts * np.diff(ends)[..., None]
        return np.concatenate([inner.reshape(self.count, -1), ends[:, -1:]], axis=-1)

    @cached_property
    def lengths(self) -> Doubles:
        """Arc lengths up to the samples."""
        times = np.ascontiguousarray(self.times.reshape(*self._curve.batch, -1))
        return self._arc.at(times).reshape(self.count, -1)

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
        each = zip(self.factors, parts_of(values, self._space, quantity), strict=True)
        return [own.reshape(*x.shape, *factor.point_shape) for factor, own in each]

    def at(self, curve: Indices, x: Doubles, quantity: str) -> list[Array]:
        """Evaluate curves at one time each; indices of curves may repeat, and do not decrease."""
        if self.count == 1:
            return [own[0] for own in self.at_rows(x[None], quantity)]
        # The core evaluates all curves at equally many times.
        counts = np.bincount(curve, minlength=self.count)
        column = np.arange(len(curve)) - (np.cumsum(counts) - counts)[curve]
        rows = np.repeat(self.times[:, :1], counts.max(initial=1), axis=1)
        rows[curve, column] = x
        return [own[curve, column] for own in self.at_rows(rows, quantity)]


class _Search:
    """The search for some points. Targets are in the order of their curves."""

    def __init__(self, table: ClosestPoints, targets: list[Array], curve: Indices) -> None:
        self.table, self.targets, self.curve = table, targets, curve
        self.distance = np.full(len(curve), np.inf)
        self.time = table.times[curve, 0].copy()

    def result(self) -> tuple[Doubles, Doubles]:
        stack = [self._coarse()]
        while stack:
            stride, pairs = stack.pop()
            pairs = self._kept(pairs)
            if len(pairs.target) > _MOST:
                middle = len(pairs.target) // 2
                stack += [(stride, pairs.where(half)) for half in (slice(middle, None), slice(middle))]
            elif stride > 1:
                stack.append((stride // 2, self._halves(pairs, stride // 2)))
            else:
                self._in_intervals(pairs)
        return self.time, self.distance

    def _coarse(self) -> tuple[int, Pairs]:
        """Return few intervals that cover the curves, for all targets, and the number of samples in each."""
        count, targets = self.table.times.shape[-1] - 1, len(self.curve)
        stride = 2 ** max(0, math.ceil(math.log2(count / _COARSE)))
        edges = np.append(np.arange(0, count, stride), count)
        target = np.repeat(np.arange(targets), len(edges)).reshape(targets, -1)
        number = np.broadcast_to(edges, target.shape)
        each = zip(self.table.factors, self.table.points, self.targets, strict=True)
        distance = product_norm(tuple(_distances(factor, p[:, edges][self.curve], q[:, None]) for factor, p, q in each))
        self._improve(target.ravel(), self.table.times[:, edges][self.curve].ravel(), distance.ravel())
        parts: Any = (
            x.ravel() for x in (target[:, 1:], number[:, :-1], number[:, 1:], distance[:, :-1], distance[:, 1:])
        )
        own, start, stop, first, last = parts
        return stride, Pairs(own, start, stop, first, last, self._length(own, start, stop))

    def _halves(self, pairs: Pairs, stride: int) -> Pairs:
        """Divide intervals after `stride` samples. The last one of a curve can be shorter, and is kept whole."""
        # A half that would not contain any interval between samples is omitted.
        middle = np.minimum(pairs.start + stride, pairs.stop)
        lengths = self._length(pairs.target, pairs.start, middle), self._length(pairs.target, middle, pairs.stop)
        halves = pairs.split(middle, self._of_samples(pairs.target, middle), lengths)
        return halves.where(halves.start < halves.stop)

    def _length(self, target: Indices, start: Indices, stop: Indices) -> Doubles:
        lengths, curve = self.table.lengths, self.curve[target]
        return np.asarray(lengths[curve, stop] - lengths[curve, start])

    def _of_samples(self, target: Indices, number: Indices) -> Doubles:
        """Return the distances between targets and samples of the table."""
        curve = self.curve[target]
        distance = self._distances([own[curve, number] for own in self.table.points], target)
        self._improve(target, self.table.times[curve, number], distance)
        return distance

    def _kept(self, pairs: Pairs) -> Pairs:
        return pairs.where(~(pairs.bound >= self.distance[pairs.target]))

    def _improve(self, target: Indices, x: Doubles, distance: Doubles) -> None:
        """Take over times that are nearer than those found so far."""
        if not len(target):
            return
        first = np.flatnonzero(np.append(True, target[1:] != target[:-1]))
        nearest = np.fmin.reduceat(distance, first)
        better = nearest < self.distance[target[first]]
        self.distance[target[first[better]]] = nearest[better]
        changed = np.zeros(len(self.curve), np.bool_)
        changed[target[first[better]]] = True
        hit = np.flatnonzero(changed[target] & (distance == self.distance[target]))
        # If several times are equally near, the first is assigned last and counts.
        self.time[target[hit[::-1]]] = x[hit[::-1]]

    def _in_intervals(self, samples: Pairs) -> None:
        """Find the minima of f = d²/2 in intervals between samples."""
        table, curve = self.table, self.curve[samples.target]
        start, stop = table.times[curve, samples.start], table.times[curve, samples.stop]
        pairs = samples._replace(start=start, stop=stop)
        if not len(pairs.target):
            return
        # The velocity may jump at a knot, so that the derivative at the end of an interval is taken before it.
        slopes = [self._slope(pairs.target, x) for x in (start, _before(stop, start))]
        for _ in range(_ROUNDS):
            guess, lowest = _cubic_minimum(pairs, *slopes)
            f = self.distance[pairs.target] ** 2 / 2
            depth = np.maximum(pairs.first, pairs.last) ** 2 / 2 - lowest
            unknown = ~np.isfinite(slopes[0] + slopes[1])
            open_still = (lowest - _MARGIN * depth < f) | unknown
            # Differences that rounding errors explain are not minima.
            flat = ~unknown & (depth <= 1e-15 * f)
            kept = ~(pairs.bound >= self.distance[pairs.target]) & open_still & ~flat
            pairs, guess, slopes = pairs.where(kept), guess[kept], [x[kept] for x in slopes]
            if not len(pairs.target):
                break
            bracketed = (slopes[0] < 0) & (slopes[1] > 0)
            self._minimum(pairs.where(bracketed), guess[bracketed], *(x[bracketed] for x in slopes))
            rest = ~bracketed
            pairs, x = pairs.where(rest), guess[rest]
            before, after = (own[rest] for own in slopes)
            if not len(pairs.target):
                break
            distance, slope = self._distance(pairs.target, x), self._slope(pairs.target, x)
            # The length of the interval bounds those of its parts.
            pairs = pairs.split(x, distance, (pairs.length, pairs.length))
            slopes = [np.stack(both, axis=-1).ravel() for both in ((before, slope), (slope, after))]

    def _minimum(self, pairs: Pairs, guess: Doubles, before: Doubles, after: Doubles) -> None:
        """Find the root of the derivative in intervals in which it changes its sign from negative to positive."""
        if not len(pairs.target):
            return

        def slope(x: Doubles, index: Indices) -> Doubles:
            return self._slope(pairs.target[index], x)

        tol = 1e-14 * (pairs.stop - pairs.start)
        x = roots(slope, (pairs.start, pairs.stop), (before, after), guess, tol)
        self._improve(pairs.target, x, self._distance(pairs.target, x))

    def _distance(self, target: Indices, x: Doubles) -> Doubles:
        """Return distances at times x, and take over the nearest."""
        distance = self._distances(self.table.at(self.curve[target], x, "point"), target)
        self._improve(target, x, distance)
        return distance

    def _distances(self, points: list[Array], target: Indices) -> Doubles:
        each = zip(self.table.factors, points, self.targets, strict=True)
        return product_norm(tuple(_distances(factor, p, q[target]) for factor, p, q in each))

    def _slope(self, target: Indices, x: Doubles) -> Doubles:
        """Return the derivative of d²/2 at times x: −⟨log q, γ'⟩. It is NaN where there is no logarithm."""
        points, velocities = (self.table.at(self.curve[target], x, what) for what in ("point", "velocity"))
        factors = self.table.factors
        each = zip(factors, points, velocities, self.targets, strict=True)
        parts = np.stack([-_inner(factor, p, _logarithms(factor, p, q[target]), v) for factor, p, v, q in each])
        if len(factors) > 1 and np.isnan(parts).any():
            # At the cut locus in a factor that is at rest, the distance in this factor does not change.
            speeds = np.stack([np.asarray(f.norm(p, v)) for f, p, v in zip(factors, points, velocities, strict=True)])
            parts = np.where(speeds <= _REST * product_norm(tuple(speeds)), 0.0, parts)
        return np.asarray(parts.sum(axis=0))


def _before(x: Doubles, start: Doubles) -> Doubles:
    """Return times just before x, at which a curve belongs to the segment that ends at x."""
    return np.maximum(start, np.minimum(np.nextafter(x, -np.inf), x - 1e-12 * (x - start)))


def _cubic_minimum(pairs: Pairs, before: Doubles, after: Doubles) -> tuple[Doubles, Doubles]:
    """Return the time and the value of the minimum of the cubic Hermite interpolant of d²/2 inside each interval.

    Without an interior minimum, the value is infinite. Without derivatives, the time is the midpoint.
    """
    h = pairs.stop - pairs.start
    with np.errstate(all="ignore"):
        f, g = pairs.first**2 / 2, pairs.last**2 / 2
        a, b = h * before, h * after
        # f + a τ + c τ² + e τ³, whose derivative is a + 2 c τ + 3 e τ²
        c, e = 3 * (g - f) - 2 * a - b, 2 * (f - g) + a + b
        root = np.sqrt(c * c - 3 * a * e)
        # The root with positive second derivative, without cancellation.
        tau = np.where(c > 0, -a / (c + root), (root - c) / (3 * e))
        inside = (tau > 0) & (tau < 1)
        lowest = np.where(inside, f + tau * (a + tau * (c + tau * e)), np.inf)
        # A change of sign is a minimum, whatever rounding errors make of the polynomial.
        bracketed = (before < 0) & (after > 0) & ~inside
        lowest = np.where(bracketed, np.minimum(f, g), lowest)
        x = pairs.start + np.where(inside, tau, 0.5) * h
    return np.clip(x, pairs.start, pairs.stop), lowest


# ---- operations of one factor on rows ----


def _distances(space: Space[Any], p: Array, q: Array) -> Doubles:
    """Return distances; infinite if they are unknown."""
    try:
        return np.asarray(space.distance(p, q))
    except CutLocusError:
        # Only on a manifold made of functions.
        p, q = np.broadcast_arrays(p, q)
        v = _logarithms(space, p, q)
        norm = np.sqrt(_inner(space, p, v, v))
        return np.where(np.isfinite(norm), norm, np.inf)


def _logarithms(space: Space[Any], p: Array, q: Array) -> Array:
    """Return logarithms; NaN at the cut locus."""
    try:
        return np.asarray(space.log(p, q))
    except CutLocusError:
        found = np.full(p.shape, np.nan, space.dtype)
        if isinstance(space, Manifold):
            return space.operations.log(p, q)
        good = np.flatnonzero(cut_fractions(space, np.stack([p, q], axis=1))[:, 0] < 1 - 1e-9)
        found[good] = space.log(p[good], q[good])
        return found


def _inner(space: Space[Any], p: Array, u: Array, v: Array) -> Doubles:
    good = space._where_finite(u)
    if good.all():
        return np.asarray(space.inner(p, u, v))
    found = np.full(good.shape, np.nan)
    found[good] = space.inner(p[good], u[good], v[good])
    return found

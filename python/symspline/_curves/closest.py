"""The nearest points of curves: their samples and distances, for the search of the core."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import CutLocusError, ValidationError
from .._spaces import Array, Doubles, Quotient, Space, factors_of, parts_of, product_norm
from ..manifolds import Manifold
from .curve import CurveArrays
from .failures import cut_fractions
from .length import ArcLength, Evaluable

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
        good = np.flatnonzero(np.isfinite(self._arc.lengths[curve, -1]))
        if not good.size:
            return times, distances
        found = self._found([x[good] for x in targets], curve[good])
        if not np.isfinite(found[1]).all():
            raise ValidationError(
                "points are too far from the curve, or too large, for finite distances. Rescale them."
            )
        times[good], distances[good] = found
        return times, distances

    def _found(self, targets: list[Array], curve: Indices) -> tuple[Doubles, Doubles]:
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


class _Distances:
    """Distances between some points and curves of any kind, for the search of the core."""

    def __init__(self, table: ClosestPoints, targets: list[Array], curve: Indices) -> None:
        self.table, self.targets, self.curve = table, targets, curve

    def of_samples(self, target: Indices, number: Indices) -> Doubles:
        """Return the distances between targets and samples."""
        curve = self.curve[target]
        return self._distances([own[curve, number] for own in self.table.points], target)

    def at(self, target: Indices, x: Doubles) -> tuple[Doubles, Doubles]:
        """Return the distances d at times x, and the derivatives of d²/2: −⟨log q, γ'⟩.

        They are NaN where there is no logarithm.
        """
        points, velocities = (self.table.at(self.curve[target], x, what) for what in ("point", "velocity"))
        factors = self.table.factors
        each = zip(factors, points, velocities, self.targets, strict=True)
        parts = np.stack([-_inner(factor, p, _logarithms(factor, p, q[target]), v) for factor, p, v, q in each])
        if len(factors) > 1 and np.isnan(parts).any():
            # At the cut locus in a factor that is at rest, the distance in this factor does not change.
            speeds = np.stack([np.asarray(f.norm(p, v)) for f, p, v in zip(factors, points, velocities, strict=True)])
            parts = np.where(speeds <= _REST * product_norm(tuple(speeds)), 0.0, parts)
        return self._distances(points, target), np.asarray(parts.sum(axis=0))

    def _distances(self, points: list[Array], target: Indices) -> Doubles:
        each = zip(self.table.factors, points, self.targets, strict=True)
        return np.asarray(product_norm(tuple(_distances(factor, p, q[target]) for factor, p, q in each)))


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

"""Velocities from geodesics between neighbouring points, and the curves of these geodesics."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.faults import between_neighbours, of_index, warn
from .._base.report import FarPointsWarning
from .._base.typing import Array
from .._core import CutLocusError, ValidationError
from .._spaces import AnySpace, Doubles, Euclidean, cover_of, factors_of
from ..manifolds import Manifold
from .curve import CurveArrays, FactorArrays
from .fit import curve_of_factors

METHODS = ("catmull-rom", "akima", "pchip")
# Weights of Akima's formula below this part of the largest one are rounding errors, as in SciPy.
_AKIMA_ROUNDING = 1e-9
# In Slopes, the segment before a node and the segment after it.
_BEFORE, _AFTER = 1, 2


def geodesic_velocities(space: AnySpace, times: Doubles, points: Array) -> tuple[Array, Array]:
    """Return the velocities of the geodesics between neighbouring points, at their starts and at their ends.

    They are NaN, with a warning, between two points that no unique geodesic joins.

    Parameters
    ----------
    times : ndarray, shape (n,) or (..., n)
        Knots.
    points : ndarray, shape (..., n, *point_shape)
        Points on the space.

    Raises
    ------
    CutLocusError
        If all neighbouring points lie at or past each other's cut locus, or two of them do on a `Manifold`.
    """
    cover = cover_of(space)
    p, q = cover._neighbours(points)
    h = wide(np.diff(times), cover)
    if not p.size:
        return np.zeros_like(p), np.zeros_like(p)
    try:
        return cover.log(p, q) / h, -cover.log(q, p) / h
    except CutLocusError as error:
        lead = p.shape[: p.ndim - len(cover.point_shape)]
        joined = _are_joined(cover, *(x.reshape(-1, *cover.point_shape) for x in (p, q))).reshape(lead)
        *curve, i = (int(k) for k in np.argwhere(~joined)[0])
        pair = f"points[{i}] and points[{i + 1}]{of_index(curve)}"
        if isinstance(cover, Manifold) or not joined.any():
            located = between_neighbours(error, "points", lead)
            raise located._with_message(f"{located}. Put a point between them.") from None
        others = np.count_nonzero(~joined) - 1
        more = f" (and {others} more such pairs)" if others else ""
        warn(
            f"{pair} lie at or past each other's cut locus{more}: the geodesic between them is not unique, and the "
            "curve is NaN there. Put a point between them, or divide the data there (fit_segments).",
            FarPointsWarning,
            tuple(curve),
            i,
        )
        starts, ends = np.full_like(p, np.nan), np.full_like(p, np.nan)
        p, q, h = p[joined], q[joined], np.broadcast_to(h, wide(joined, cover).shape)[joined]
        starts[joined], ends[joined] = cover.log(p, q) / h, -cover.log(q, p) / h
        return starts, ends


def _are_joined(space: AnySpace, p: Array, q: Array) -> NDArray[np.bool_]:
    """Return which rows are points with a unique geodesic between them, by bisection."""
    try:
        space.log(p, q), space.log(q, p)
    except CutLocusError:
        half = len(p) // 2
        parts = [(p[half_of_pairs], q[half_of_pairs]) for half_of_pairs in (slice(half), slice(half, None))]
        return np.concatenate([_are_joined(space, *part) for part in parts]) if half else np.zeros(1, bool)
    return np.ones(len(p), bool)


def local_velocities(space: AnySpace, times: Doubles, points: Array, method: str) -> Array:
    """Return velocities at the nodes that depend on a few neighbouring points only.

    Parameters
    ----------
    method : {"catmull-rom", "akima", "pchip"}
        Formula, see `symspline.HermiteSpline.from_points`.

    Returns
    -------
    ndarray
        Velocities; NaN at two neighbours that no unique geodesic joins. The velocities on either side of them are
        those of the points on this side alone.
    """
    cover = cover_of(space)
    starts, ends = geodesic_velocities(space, times, points)
    gaps = ~cover._where_finite(starts)
    if not gaps.any():
        return _local(cover, times, points, starts, ends, method)
    result = np.full_like(points, np.nan)
    for curve in np.ndindex(gaps.shape[:-1]):
        t, cuts = np.broadcast_to(times, (*gaps.shape[:-1], times.shape[-1]))[curve], np.flatnonzero(gaps[curve])
        for first, stop in pairwise([0, *(cuts + 1), len(t)]):
            if stop - first > 1:
                nodes, segments = slice(first, stop), slice(first, stop - 1)
                arrays = points[curve][nodes], starts[curve][segments], ends[curve][segments]
                result[curve][nodes] = _local(cover, t[nodes], *arrays, method)
        result[curve][cuts] = result[curve][cuts + 1] = np.nan
    return result


def _local(space: AnySpace, times: Doubles, points: Array, starts: Array, ends: Array, method: str) -> Array:
    axis = points.ndim - len(space.point_shape) - 1
    if points.shape[axis] == 2:
        # One segment is a geodesic.
        return np.concatenate([starts, ends], axis=axis)
    slopes = _Slopes(space, times, points, starts, ends)
    if method == "akima":
        return slopes.akima()
    return slopes.catmull_rom() if method == "catmull-rom" else slopes.pchip()


class _Slopes:
    """Velocities of the geodesics of the four segments around each node, transported to the node.

    Parameters
    ----------
    space : Space
        A space that is not a quotient.
    starts, ends : ndarray
        Velocities of `geodesic_velocities`.
    """

    def __init__(self, space: AnySpace, times: Doubles, points: Array, starts: Array, ends: Array) -> None:
        self.space, self.axes = space, len(space.point_shape)
        # The axis of nodes comes first, so that formulas are those of SciPy.
        self.points, starts, ends = (np.moveaxis(array, -1 - self.axes, 0) for array in (points, starts, ends))
        h = np.moveaxis(np.broadcast_to(np.diff(times), (*points.shape[: -1 - self.axes], len(starts))), -1, 0)
        self.h = wide(h, space)
        n = len(self.points)
        m = np.zeros((4, *self.points.shape), points.dtype)
        m[_AFTER, :-1], m[_BEFORE, 1:] = starts, ends
        # Along its own geodesic a velocity is parallel, so that only the outer segments need a transport.
        m[3, :-2] = space.transport(self.points[1:-1], self.points[:-2], starts[1:])
        m[0, 2:] = space.transport(self.points[1:-1], self.points[2:], ends[:-1])
        # Beyond the ends, the velocities of segments form an arithmetic sequence, as in SciPy's Akima1DInterpolator.
        m[1, 0] = 2 * m[2, 0] - m[3, 0]
        m[0, 0] = 2 * m[1, 0] - m[2, 0]
        m[0, 1] = 2 * m[1, 1] - m[2, 1]
        m[3, n - 2] = 2 * m[2, n - 2] - m[1, n - 2]
        m[2, -1] = 2 * m[1, -1] - m[0, -1]
        m[3, -1] = 2 * m[2, -1] - m[1, -1]
        self.m = m

    def catmull_rom(self) -> Array:
        """Return the velocities of parabolas through three points in the tangent space."""
        _, before, after, _ = self.m
        h = self.h
        v = np.empty_like(self.points)
        v[1:-1] = (h[1:] * before[1:-1] + h[:-1] * after[1:-1]) / (h[:-1] + h[1:])
        v[0], v[-1] = self._end(0)[0], self._end(-1)[0]
        return self._nodes_last(v)

    def akima(self) -> Array:
        """Return velocities by Akima's formula."""
        first, before, after, last = self.m
        left, right = self._size(before - first), self._size(last - after)
        total = left + right
        limit = total.max(axis=tuple(i for i in range(total.ndim) if i == 0 or i >= total.ndim - self.axes))
        limit = limit.reshape(*limit.shape, *(1,) * self.axes)
        weighted = total > _AKIMA_ROUNDING * limit
        ratio = left / np.where(weighted, total, 1.0)
        return self._nodes_last(np.where(weighted, before + ratio * (after - before), (first + last) / 2))

    def pchip(self) -> Array:
        """Return velocities by the weighted harmonic mean of Fritsch and Butland."""
        _, before, after, _ = self.m
        v = np.empty_like(self.points)
        neighbours = [velocities[1:-1] for velocities in (before, after)]
        sizes = [self._size(velocities, 1) for velocities in neighbours]
        # The harmonic mean along the bisector of both directions, where they have equal signs, times the cosine of half
        # the angle between them. Across the bisector signs differ, and the formula for components gives zero. In one
        # dimension, half the sum of the directions is 1, -1 or 0, and this is the formula of SciPy.
        with np.errstate(all="ignore"):
            units = [np.nan_to_num(velocities / size) for velocities, size in zip(neighbours, sizes, strict=True)]
            sum_of_units = units[0] + units[1]
            w1, w2 = 2 * self.h[1:] + self.h[:-1], self.h[1:] + 2 * self.h[:-1]
            mean = np.nan_to_num((w1 + w2) / (w1 / sizes[0] + w2 / sizes[1]))
        v[1:-1] = np.where((sizes[0] > 0) & (sizes[1] > 0), mean * sum_of_units / 2, 0.0)
        for i, end, near, next_ in ((0, *self._end(0)), (-1, *self._end(-1))):
            v[i] = self._limited(end, near, next_, i)
        return self._nodes_last(v)

    def _end(self, i: int) -> tuple[Array, Array, Array]:
        """Return the velocity of a parabola at an end, and those of the two nearest segments."""
        near, next_ = (self.m[2, 0], self.m[3, 0]) if i == 0 else (self.m[1, -1], self.m[0, -1])
        h0, h1 = (self.h[0], self.h[1]) if i == 0 else (self.h[-1], self.h[-2])
        return ((2 * h0 + h1) * near - h0 * next_) / (h0 + h1), near, next_

    def _limited(self, v: Array, near: Array, next_: Array, i: int) -> Array:
        """Limit the velocity at an end as `scipy.interpolate.PchipInterpolator` does."""
        at = self.points[i]
        turns = self._sign(at, near, next_) <= 0
        size, most = self._size(v, at=at), 3 * self._size(near, at=at)
        v = np.where(turns & (size > most), v * (most / np.where(size > 0, size, 1.0)), v)
        return np.where(self._sign(at, v, near) > 0, v, 0.0)

    def _size(self, v: Array, skip: int = 0, at: Array | None = None) -> Array:
        """Return the norms of vectors with the axes of points, or in flat space the size of each component."""
        if isinstance(self.space, Euclidean):
            return np.abs(v)
        p = self.points[skip : len(self.points) - skip] if at is None else at
        return wide(np.asarray(self.space.norm(p, v)), self.space)

    def _sign(self, p: Array, v: Array, w: Array) -> Array:
        """Return numbers with the signs of inner products, or in flat space of products of components."""
        if isinstance(self.space, Euclidean):
            return np.sign(v) * np.sign(w)
        return wide(np.asarray(self.space.inner(p, v, w)), self.space)

    def _nodes_last(self, array: Array) -> Array:
        return np.ascontiguousarray(np.moveaxis(array, 0, -1 - self.axes))


def check_method(method: object) -> None:
    """Raise ValidationError unless a formula of `local_velocities` has this name."""
    if not isinstance(method, str) or method not in METHODS:
        raise ValidationError(f"method must be one of {', '.join(map(repr, METHODS))}, not {method!r}")


def wide(values: Array, space: AnySpace) -> Array:
    """Append the axes of a point."""
    return values.reshape(values.shape + (1,) * len(space.point_shape))


# ---- curves of geodesics between neighbouring points, as arrays ----


def jumps(curve: CurveArrays) -> list[Doubles]:
    """Return the norms of the jumps of the velocity at the inner knots in each factor, as parts of the speed before.

    They are NaN at the ends of segments without a geodesic.
    """
    return [_jumps(factor) for factor in curve.factors]


def _jumps(factor: FactorArrays) -> Doubles:
    space = factor.space
    inner: Any = (..., slice(1, -1), *[slice(None)] * len(space.point_shape))
    assert factor.before is not None
    p, before, after = (array[inner] for array in (factor.points, factor.before, factor.velocities))
    if not p.size:
        return np.zeros(p.shape[: p.ndim - len(space.point_shape)])
    gaps = ~(space._where_finite(before) & space._where_finite(after))
    before, after = (np.where(wide(gaps, space), 0, velocities) for velocities in (before, after))
    with np.errstate(all="ignore"):
        jumps: Doubles = np.nan_to_num(space.norm(p, after - before) / space.norm(p, before), nan=0.0)
    jumps[gaps] = np.nan
    return jumps


def joined(space: AnySpace, times: Doubles, points: list[Array]) -> CurveArrays:
    """Return the curve of geodesics between neighbouring points, given in each factor.

    It is a curve of cubic segments with corners at the knots. Between two points that no unique geodesic joins,
    velocities and the curve are NaN.

    Raises
    ------
    CutLocusError
        If all neighbouring points lie at or past each other's cut locus.
    """
    factors = []
    for factor, nodes in zip(factors_of(space), points, strict=True):
        starts, ends = geodesic_velocities(factor, times, nodes)
        axis = nodes.ndim - len(factor.point_shape) - 1
        first, last = np.take(starts, [0], axis=axis), np.take(ends, [-1], axis=axis)
        after, before = np.concatenate([starts, last], axis=axis), np.concatenate([first, ends], axis=axis)
        factors.append(FactorArrays(factor, nodes, after, before))
    return curve_of_factors(space, times, tuple(factors), fitted=False)

"""Karcher means and geometric medians of groups of points.

Points are rows, one group after another, so that a batch is a single call and groups may differ in size.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import adjoint, as_array, refuse
from .._base.faults import warn
from .._base.typing import Array
from .._core import ConvergenceError, CutLocusError, ValidationError

# Points or vectors, one per row; those of a product are a tuple of arrays.
Rows = Any
# A `Space`, which is defined in terms of this module.
Geometry = Any
Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


# ---- exact means and medians on circles of length 2π, in O(n log n) ----

TURN = 2 * np.pi
# Objectives are equal up to this relative difference.
_EQUAL = 1e-9


class Minima(NamedTuple):
    """Global minimum of an objective on the circle, and the lowest of its other local minima.

    Attributes
    ----------
    angle, objective : float
        The global minimum.
    other_angle, other_objective : float
        The lowest other local minimum farther away than the standard error of the mean; infinite if none exists.
    """

    angle: float
    objective: float
    other_angle: float
    other_objective: float

    @property
    def excess(self) -> float:
        """Relative difference of both objectives; infinite if there is no other minimum."""
        return self.other_objective / self.objective - 1 if self.objective > 0 else np.inf

    @property
    def apart(self) -> float:
        """Distance of both minima; infinite if there is no other one."""
        return abs(float(wrap(np.asarray(self.other_angle - self.angle)))) if self.excess < np.inf else np.inf


def wrap(angles: Floats) -> Floats:
    """Return angles in [−π, π)."""
    return np.asarray((angles + np.pi) % TURN - np.pi)


def circular_mean(angles: Floats, weights: Floats) -> Minima:
    """Minimise the weighted sum of squared distances.

    If the circle is cut between two neighbouring data and unrolled, the average of the data is a candidate. The mean is
    the best of the candidates for all cuts, whose sums of squares follow from prefix sums (Hotz and Huckemann,
    Intrinsic means on the circle, Ann. Inst. Stat. Math. 67, 2015).
    """
    v, w = _sorted(angles, weights)
    total = w.sum()
    # In candidate k, the k smallest data are moved by one turn.
    moved = np.concatenate([[0], np.cumsum(w)[:-1]])
    first = (w * v).sum() + TURN * moved
    second = (w * v * v).sum() + np.concatenate([[0], np.cumsum(w * TURN * (2 * v + TURN))[:-1]])
    objective = np.maximum(second - first**2 / total, 0.0)
    means = first / total
    # A candidate is a local minimum if no unrolled datum is farther than half a turn from it.
    low, high = v, np.concatenate([[v[-1]], v[:-1] + TURN])
    local = (means - low <= np.pi) & (high - means <= np.pi)
    return _minima(means, objective, local, standard_error(objective.min(), w))


def circular_median(angles: Floats, weights: Floats) -> Minima:
    """Minimise the weighted sum of distances.

    The objective is piecewise linear with corners at the data and their antipodes, and concave at the antipodes.
    Therefore one of the data is a minimum.
    """
    v, w = _sorted(angles, weights)
    n = len(v)
    turns = np.concatenate([v, v + TURN, v + 2 * TURN])
    before = np.concatenate([[0], np.cumsum(np.tile(w, 3))])
    sums = np.concatenate([[0], np.cumsum(np.tile(w, 3) * turns)])

    def objective(x: Floats) -> Floats:
        """Sum of distances at points of the middle turn."""
        at = np.searchsorted(turns, x)
        low = np.searchsorted(turns, x - np.pi)
        high = low + n
        left = x * (before[at] - before[low]) - (sums[at] - sums[low])
        return np.asarray(left + (sums[high] - sums[at]) - x * (before[high] - before[at]))

    # Between data and antipodes, the objective is linear.
    corners = np.sort(np.concatenate([v, (v - v[0] + np.pi) % TURN + v[0]])) + TURN
    values = objective(corners)
    best = int(np.argmin(values))
    corners, values = np.roll(corners, -best), np.roll(values, -best)
    slack = _EQUAL * (1 + values)
    # Minima without a barrier between them and the best one belong to it.
    barrier = np.minimum(np.maximum.accumulate(values), np.maximum.accumulate(values[::-1])[::-1])
    local = (
        (np.roll(values, 1) >= values - slack) & (np.roll(values, -1) >= values - slack) & (barrier > values + slack)
    )
    mean_square = circular_mean(v, w).objective
    return _minima(corners, values, local, standard_error(mean_square, w))


def _sorted(angles: Floats, weights: Floats) -> tuple[Floats, Floats]:
    wrapped = wrap(angles)
    order = np.lexsort((weights, wrapped))
    return wrapped[order], weights[order]


def standard_error(square_sum: float, weights: Floats) -> float:
    """Return the standard error of the mean from the weighted sum of squared distances.

    It is the root mean square over the root of the effective number of data.
    """
    total = weights.sum()
    return float(np.sqrt(square_sum / total * np.sum(weights**2)) / total)


def _minima(angles: Floats, objective: Floats, local: NDArray[np.bool_], error: float) -> Minima:
    wrapped = wrap(angles)
    # Of equal minima, choose the one with the smallest angle, which does not depend on the order of the data.
    equal = np.flatnonzero(objective <= objective.min() * (1 + _EQUAL) + _EQUAL**2)
    best = equal[np.argmin(wrapped[equal])]
    others = local & (np.abs(wrap(wrapped - wrapped[best])) > max(error, _EQUAL))
    if not others.any():
        return Minima(float(wrapped[best]), float(objective[best]), np.inf, np.inf)
    other = np.flatnonzero(others)[np.argmin(objective[others])]
    return Minima(float(wrapped[best]), float(objective[best]), float(wrapped[other]), float(objective[other]))


# ---- congruences that make positive definite matrices well-conditioned before an iteration ----

# The affine-invariant metric does not change under congruences A → L⁻¹ A L⁻ᴴ, but rounding errors do: they grow with
# the condition number, which is large for matrices with entries in mixed units. If L is the Cholesky factor of the
# average of the data, the transformed matrices are close to the identity wherever the data are close to each other,
# independently of the units. Cholesky factorisation and triangular solves commute with diagonal scaling up to rounding
# errors.


class Whitening(NamedTuple):
    """Congruences of positive definite matrices.

    Attributes
    ----------
    factor : ndarray, shape (..., n, n)
        Lower triangular factors L, which broadcast against matrices.
    space : SymmetricPositiveDefinite or HermitianPositiveDefinite
        Space of the transformed matrices. The spaces of special and of symplectic matrices are totally geodesic in it,
        so that their means and medians are the same.
    """

    factor: Array
    space: Geometry

    def forward(self, points: Array) -> Array:
        """Return L⁻¹ A L⁻ᴴ."""
        half = np.linalg.solve(self.factor, points)
        moved = np.linalg.solve(self.factor, adjoint(half))
        return np.asarray((moved + adjoint(moved)) / 2)

    def back(self, points: Array) -> Array:
        """Return L A Lᴴ."""
        moved = self.factor @ points @ adjoint(self.factor)
        return np.asarray((moved + adjoint(moved)) / 2)


# ---- groups of points, and descents to local minima of their sums of distances ----

# Limits of the iterations. Means of points close together need a few steps, medians converge linearly.
_STEPS = 5000
# Accuracy of a median, relative to the mean distance of the data.
_MEDIAN_TOL, _MEDIAN_LIMIT = 1e-12, 1e-7
_EPS = float(np.finfo(np.float64).eps)


class Groups(NamedTuple):
    """Rows of points in groups.

    Attributes
    ----------
    points : ndarray, shape (rows, *point_shape), or a tuple of these
        Points; those of a product are a tuple.
    counts : ndarray of int
        Number of points in each group, at least 1.
    weights : ndarray, shape (rows,)
        Positive weights.
    """

    points: Rows
    counts: Indices
    weights: Floats

    @property
    def starts(self) -> Indices:
        """Index of the first row of each group."""
        return np.cumsum(self.counts) - self.counts

    def of(self, which: NDArray[np.bool_]) -> Groups:
        """Select some groups."""
        if which.all():
            return self
        rows = np.repeat(which, self.counts)
        return Groups(take(self.points, rows), self.counts[which], self.weights[rows])

    def sums(self, rows: Rows) -> Rows:
        """Sum rows over each group."""
        starts = self.starts
        return _map(lambda x: np.add.reduceat(x, starts, axis=0), rows)

    def spread(self, rows: Rows) -> Rows:
        """Repeat one row per group for all points of the group."""
        return _map(lambda x: np.repeat(x, self.counts, axis=0), rows)


def _map(function: Any, *values: Rows) -> Rows:
    """Apply a function to arrays, or to the entries of tuples of arrays."""
    if isinstance(values[0], tuple):
        return tuple(function(*arrays) for arrays in zip(*values, strict=True))
    return function(*values)


def take(rows: Rows, index: object) -> Rows:
    return _map(lambda x: x[index], rows)


def scaled(rows: Rows, factors: Floats) -> Rows:
    """Multiply every row by a number."""
    return _map(lambda x: x * factors.reshape(-1, *[1] * (x.ndim - 1)), rows)


def joined(rows: list[Rows]) -> Rows:
    """Concatenate rows of points."""
    return _map(lambda *arrays: np.concatenate(arrays), *rows)


def put(rows: Rows, index: Any, values: Rows) -> None:
    def replace(array: Array, value: Array) -> None:
        array[index] = value

    _map(replace, rows, values)


def grouped(points: Array, axes: int, weights: ArrayLike | None, what: str) -> tuple[tuple[int, ...], Array, Floats]:
    """Return the leading axes of points, the points, and their weights, for the arguments of `Space.mean`.

    Points of weight 0 are replaced by others of their batch.

    Parameters
    ----------
    points : ndarray, shape (..., n, *point_shape)
        Points.
    axes : int
        Number of axes of a point.
    weights : array_like or None
        The argument.
    what : str
        What is computed, for messages.
    """
    lead = points.shape[: points.ndim - axes]
    if not lead or not lead[-1]:
        raise ValidationError(
            f"`points` has shape {points.shape}, but a {what} needs at least one point. Pass shape "
            "(..., n, *point_shape)."
        )
    if weights is None:
        return lead, points, np.ones(lead)
    given = as_array(weights, "weights")
    if given.dtype.kind not in "biuf":
        raise ValidationError(f"weights must be real numbers, not {given.dtype}")
    if given.shape not in (lead[-1:], lead):
        raise ValidationError(
            f"weights has shape {given.shape}, but the points have the leading axes {lead}. Pass one weight per point, "
            f"shape {lead[-1:]} or {lead}."
        )
    given = given.astype(np.float64)
    refuse(~(np.isfinite(given) & (given >= 0)), "weights", lambda i: f"is {given[i]}, but must be finite and >= 0")
    used = given > 0
    if not used.any(axis=-1).all():
        raise ValidationError(f"`weights` are all 0, but a {what} needs a point of positive weight.")
    used, full = np.broadcast_to(used, lead), np.broadcast_to(given / given.max(axis=-1, keepdims=True), lead)
    first = np.argmax(used, axis=-1).reshape(*lead[:-1], 1, *[1] * axes)
    kept = np.take_along_axis(points, first, axis=len(lead) - 1)
    return lead, np.where(used.reshape(*lead, *[1] * axes), points, kept), np.where(used, full, 0.0)


def groups_of(lead: tuple[int, ...], points: Array, weights: Floats) -> Groups:
    """Return batches of equally many points as groups, without points of weight 0."""
    used = weights.reshape(-1, lead[-1]) > 0
    rows = points.reshape(-1, *points.shape[len(lead) :])[used.ravel()]
    return Groups(rows, used.sum(axis=-1), weights.reshape(-1)[used.ravel()])


def _hessians(space: Geometry, lengths: Floats) -> Floats:
    """Return bounds of the Hessians of half the squared distances.

    The Hessian of d²/2 is at most K d coth(K d) where sectional curvatures are at least −K² (Karcher 1977, equation
    (1.1.2)), and at most 1 where they are not negative. Spaces without cut locus are those of nonpositive curvature.
    """
    k = space.curvature
    if not (np.isinf(space.injectivity_radius) and np.isfinite(k) and k > 0):
        return np.ones_like(lengths)
    x = k * lengths
    return np.where(x > 1e-4, x / np.tanh(np.maximum(x, 1e-4)), 1.0)


def _size(space: Geometry, p: Rows, v: Rows) -> Floats:
    """Return lengths of tangent vectors; without a metric, those of their arrays."""
    if np.isfinite(space.curvature):
        return np.asarray(space.norm(p, v))
    return np.asarray(np.sqrt(np.sum(np.abs(v.reshape(len(v), -1)) ** 2, axis=-1)))


class Descent(NamedTuple):
    """End points of descents to local minima from given starts, one per group.

    Attributes
    ----------
    points : ndarray, shape (groups, *point_shape), or a tuple of these
        The minima.
    objective : ndarray, shape (groups,)
        Weighted sum of the distances or of their squares, at the iterate before the last.
    radius : ndarray, shape (groups,)
        Largest distance of the data from that iterate.
    unfinished : ndarray of bool, shape (groups,)
        Whether the iteration did not converge.
    """

    points: Rows
    objective: Floats
    radius: Floats
    unfinished: NDArray[np.bool_]


def descend_to_mean(space: Geometry, groups: Groups, means: Rows, steps: int = _STEPS) -> Descent:
    """Descend to a local minimum of the mean squared distance from every start.

    The gradient of half the mean squared distance is the negative mean logarithm. Its descent with the inverse of a
    bound of the Hessian as step length decreases the function in every step.
    """
    floor = 8 * _EPS * np.asarray(space._rounding(means))
    count = len(groups.counts)
    state = Descent(means, np.full(count, np.inf), np.zeros(count), np.zeros(count, bool))
    active, last = np.ones(count, bool), np.full(count, np.inf)
    for _ in range(steps):
        some, index = groups.of(active), np.flatnonzero(active)
        here = take(means, index)
        at = some.spread(here)
        logs = space.log(at, some.points)
        lengths = _size(space, at, logs)
        hessians = some.sums(some.weights * _hessians(space, lengths))
        # Without the projection, logarithms to points beyond a quarter turn amplify rounding errors of the iterate.
        step = space.project_tangent(here, scaled(some.sums(scaled(logs, some.weights)), 1 / hessians))
        put(means, index, space.exp(here, step))
        size, before, least = _size(space, here, step), last[active], floor[active]
        last[active] = size
        # Rounding errors of distant points may exceed the floor.
        active[index] = (size > least) & ((size < before) | (size > 1e4 * least))
        if not active[index].all():
            _note(state, index, some, lengths, 2)
        if not active.any():
            return state
    _note(state, index, some, lengths, 2)
    return state._replace(unfinished=active)


def descend_to_median(space: Geometry, groups: Groups, medians: Rows, steps: int = _STEPS) -> Descent:
    """Descend to a local minimum of the mean distance from every start, by Weiszfeld's algorithm.

    An iterate at a datum moves on as in Vardi & Zhang (2000), equations (2.5) and (2.6), and a datum that satisfies
    the condition of optimality is the median.
    """
    count = len(groups.counts)
    state = Descent(medians, np.full(count, np.inf), np.zeros(count), np.zeros(count, bool))
    active, tested = np.ones(count, bool), np.full(count, -1)
    last, rate = np.full(count, np.inf), np.zeros(count)
    scale = np.zeros(count)
    for _ in range(steps):
        some, index = groups.of(active), np.flatnonzero(active)
        here = take(medians, index)
        step, size, distances = _weiszfeld(space, some, here)
        # The mean distance from the first iterate, which is a datum.
        scale[index] = np.maximum(scale[index], some.sums(some.weights * distances) / some.sums(some.weights))
        nearest = _argmin(distances, some)
        candidates = take(some.points, some.starts + nearest)
        fresh = nearest != tested[index]
        tested[index] = nearest
        optimal = np.zeros(len(index), bool)
        if fresh.any():
            _, length, _ = _weiszfeld(space, some.of(fresh), take(candidates, fresh))
            optimal[fresh] = length == 0
        put(medians, index, space.exp(here, step))
        put(medians, index[optimal], take(candidates, optimal))
        with np.errstate(all="ignore"):
            rate[index] = np.where(last[index] > 0, size / last[index], 0.0)
        last[index] = size
        floor = 8 * _EPS * np.asarray(space._rounding(here)) + _MEDIAN_TOL * scale[index]
        active[index] = ~optimal & (size > floor)
        if not active[index].all():
            _note(state, index, some, distances, 1)
        if not active.any():
            return state
    _note(state, index, some, distances, 1)
    error = last / (1 - np.minimum(rate, 1 - 1e-6))
    return state._replace(unfinished=active & (error > _MEDIAN_LIMIT * scale))


def _note(state: Descent, index: Indices, groups: Groups, distances: Floats, power: int) -> None:
    """Store the objective and the radius of some groups."""
    state.objective[index] = groups.sums(groups.weights * distances**power)
    state.radius[index] = np.maximum.reduceat(distances, groups.starts)


def _weiszfeld(space: Geometry, groups: Groups, at: Rows) -> tuple[Rows, Floats, Floats]:
    """Return the steps of Weiszfeld's algorithm, their lengths, and the distances of the points."""
    repeated = groups.spread(at)
    logs = space.log(repeated, groups.points)
    distances = np.asarray(space.norm(repeated, logs))
    # Distances within rounding errors are zero: their directions are arbitrary.
    there = distances > 4 * _EPS * np.asarray(space._rounding(repeated))
    inverse = np.where(there, groups.weights / np.where(there, distances, 1.0), 0.0)
    pull = space.project_tangent(at, groups.sums(scaled(logs, inverse)))
    strength = np.asarray(space.norm(at, pull))
    held = groups.sums(np.where(there, 0.0, groups.weights))
    total = groups.sums(inverse * _hessians(space, distances))
    # Rounding of the sum counts as no pull.
    most = groups.sums(groups.weights)
    free = (strength > held * (1 + 1e-12)) & (strength > 1e-15 * most)
    with np.errstate(all="ignore"):
        factor = np.where(free, (1 - held / strength) / total, 0.0)
    step = scaled(pull, factor)
    return step, factor * strength, distances


def _argmin(values: Floats, groups: Groups) -> Indices:
    """Return the index of the smallest value in every group."""
    least = groups.spread(np.minimum.reduceat(values, groups.starts))
    hits = np.flatnonzero(values == least)
    number = np.repeat(np.arange(len(groups.counts)), groups.counts)
    _, first = np.unique(number[hits], return_index=True)
    return np.asarray(hits[first] - groups.starts)


def require_metric(space: Geometry, what: str) -> None:
    """Raise ValidationError for spaces without an invariant, positive definite metric."""
    if not np.isfinite(space.curvature):
        raise ValidationError(
            f"{what} needs distances, but {space!r} has no invariant metric that is positive definite. Use a product "
            "such as 'so:3 x r:3' for poses."
        )


# ---- global minima ----

# A local minimum is the global one if all data lie in a ball about it with half of the injectivity radius (a quarter
# for medians). Otherwise, the problem is solved exactly on circles, and elsewhere descents from several starts are
# compared.

# Up to the first number of data, all are starts; of more data, the second number of those with the lowest objectives.
_ALL, _BEST = 30, 12
# Largest number of data whose objectives are compared.
_SAMPLE = 200
# Number of steps of the descents that are compared. End points are iterated until they converge if their objectives
# exceed the lowest one by at most the second number, relatively, and if they are farther apart than the third number
# times the injectivity radius. The fourth number is the largest count of such end points.
_SHORT, _NEARLY, _APART, _FINISHED = 100, 1e-3, 1e-2, 4
# Distance of starts beyond a minimum, as a fraction of the injectivity radius.
_BEYOND = 0.9
# Rows of points that are processed at a time.
_ROWS = 200_000
# If the objectives of two minima differ by less than this fraction, the mean is ambiguous.
_AMBIGUOUS = 0.05
# Points are equal up to this fraction of the injectivity radius.
_SAME = 1e-6


class AmbiguousMeanWarning(UserWarning):
    """Warning that points have a second mean or median that is nearly as good, far from the returned one."""


class _Kind(NamedTuple):
    """Kind of centre: the minimum of the sum of distances to a given power."""

    name: str
    power: int
    descend: Callable[..., Descent]
    on_circle: Callable[[Floats, Floats], Minima]
    # In a ball of this radius, in units of the injectivity radius, a local minimum at its centre is the global one
    # (Afsari, Riemannian Lp center of mass: existence, uniqueness, and convexity, Proc. AMS 139, 2011, Theorem 2.1).
    convex: float


_MEAN = _Kind("mean", 2, descend_to_mean, circular_mean, 0.5)
_MEDIAN = _Kind("median", 1, descend_to_median, circular_median, 0.25)


class _Found(NamedTuple):
    """Global minimum of a group, and the distance and relative excess of the next minimum (infinite if none exists)."""

    point: Rows
    distance: float
    excess: float
    error: float


def karcher_mean(space: Geometry, groups: Groups) -> Rows:
    """Return the Karcher mean of every group, and warn where another minimum is nearly as low."""
    return _minimum(space, groups, _MEAN)


def geometric_median(space: Geometry, groups: Groups) -> Rows:
    """Return the geometric median of every group, and warn where another minimum is nearly as low."""
    return _minimum(space, groups, _MEDIAN)


def _minimum(space: Geometry, groups: Groups, kind: _Kind) -> Rows:
    whitening = space._whitening(groups)
    if whitening is None:
        return _minimum_of_arrays(space, groups, kind)
    rows = whitening._replace(factor=groups.spread(whitening.factor))
    moved = groups._replace(points=rows.forward(groups.points))
    return whitening.back(_minimum_of_arrays(whitening.space, moved, kind))


def _minimum_of_arrays(space: Geometry, groups: Groups, kind: _Kind) -> Rows:
    starts = space._first_means(groups)
    descent, failed = _descents(space, groups, starts, kind, (_SHORT,))
    if np.isfinite(space.curvature):
        # A ball of radius 0 contains its centre only.
        outside = failed | ((descent.radius >= kind.convex * space.injectivity_radius) & (descent.radius > 0))
    else:
        outside = failed
    points, several = descent.points, np.flatnonzero(outside)
    slow = descent.unfinished & ~outside
    if slow.any():
        rest = kind.descend(space, groups.of(slow), take(points, slow))
        put(points, slow, rest.points)
        descent.unfinished[slow] = rest.unfinished
    results = []
    for group in map(int, several):
        one = groups.of(np.arange(len(groups.counts)) == group)
        results.append(_global_minimum(space, one, kind, group if len(groups.counts) > 1 else None))
        put(points, group, results[-1].point)
    descent.unfinished[several] = False
    if descent.unfinished.any():
        _raise_unfinished(kind, np.flatnonzero(descent.unfinished)[0] if len(groups.counts) > 1 else None)
    _warn_ambiguous(kind, several if len(groups.counts) > 1 else None, results)
    return points


def _descents(
    space: Geometry, groups: Groups, starts: Rows, kind: _Kind, steps: tuple[int, ...] = ()
) -> tuple[Descent, NDArray[np.bool_]]:
    """Descend in every group, and return which descents met a cut locus."""
    count = len(groups.counts)
    try:
        return kind.descend(space, groups, _map(np.copy, starts), *steps), np.zeros(count, bool)
    except CutLocusError:
        if count == 1:
            nothing = np.zeros(1, bool)
            return Descent(_map(np.copy, starts), np.full(1, np.inf), np.full(1, np.inf), nothing), ~nothing
    halves = np.arange(count) < count // 2, np.arange(count) >= count // 2
    parts = [_descents(space, groups.of(half), take(starts, half), kind, steps) for half in halves]
    points = joined([descent.points for descent, _ in parts])
    numbers = [np.concatenate(arrays) for arrays in zip(*(descent[1:] for descent, _ in parts), strict=True)]
    return Descent(points, *numbers), np.concatenate([failed for _, failed in parts])


def _global_minimum(space: Geometry, group: Groups, kind: _Kind, number: int | None) -> _Found:
    """Return the global minimum of one group whose data are spread."""
    order = _order(group.points)
    # Sort the data by their coordinates, so that the result does not depend on the given order.
    data, weights = take(group.points, order), group.weights[order]
    group = group._replace(points=data, weights=weights)
    if space._has_angles and (kind is _MEAN or space.dim == 1):
        return _on_torus(group, kind)
    if space.dim == 1 and np.isfinite(space.curvature) and 0 < space.injectivity_radius < np.inf:
        return _on_circle(space, group, kind)
    if not np.isfinite(space.curvature):
        # Without a metric, minima cannot be compared.
        descent = kind.descend(space, group, take(data, np.arange(1)))
        if descent.unfinished.any():
            _raise_unfinished(kind, number)
        return _Found(take(descent.points, 0), np.inf, np.inf, 0.0)
    return _from_several_starts(space, group, kind, number)


def _order(points: Rows) -> NDArray[np.intp]:
    """Return the lexicographic order of points."""
    arrays = points if isinstance(points, tuple) else (points,)
    rows = [np.ascontiguousarray(x).reshape(len(x), -1).view(np.float64) for x in arrays]
    return np.asarray(np.lexsort(np.concatenate(rows, axis=1).T[::-1]))


# ---- circles ----


def _on_torus(group: Groups, kind: _Kind) -> _Found:
    """Solve for every angle separately, which is exact for sums of squares, and for one angle also for medians."""
    minima = [kind.on_circle(column, group.weights) for column in group.points.T]
    angles = np.array([one.angle for one in minima])
    # Choose the representative nearest to the average of the given numbers.
    average = group.weights @ group.points / group.weights.sum()
    nearest = angles + 2 * np.pi * np.round((average - angles) / (2 * np.pi))
    worst = min(minima, key=lambda one: one.excess)
    total = sum(one.objective for one in minima)
    return _Found(nearest, worst.apart, worst.excess, standard_error(total, group.weights))


def _on_circle(space: Geometry, group: Groups, kind: _Kind) -> _Found:
    """Solve exactly on a space that is isometric to a circle."""
    base, unit, angles, scale = _angles(space, group.points)
    minima = kind.on_circle(angles, group.weights)
    if kind is _MEDIAN:
        point = group.points[np.argmin(np.abs(wrap(angles - minima.angle)))]
    else:
        point = space.exp(base, minima.angle / scale * unit)
    error = standard_error(circular_mean(angles, group.weights).objective, group.weights)
    return _Found(_near(space, group, point), minima.apart / scale, minima.excess, error / scale)


def _angles(space: Geometry, points: Array) -> tuple[Array, Array, Floats, float]:
    """Return a base point, a unit vector there, the angles of points from it, and the angle per unit of length."""
    scale = np.pi / space.injectivity_radius
    start = points[0]
    unit = space.frame(start)[0]
    error: CutLocusError | None = None
    # Logarithms require a base that is not opposite to a datum. Steps of the golden angle avoid data at regular angles.
    for turn in np.arange(12) * np.pi * (3 - np.sqrt(5)):
        base = space.exp(start, wrap(np.asarray(turn)) / scale * unit)
        at = np.broadcast_to(base, points.shape)
        try:
            logs = space.log(at, points)
        except CutLocusError as failure:
            error = error or failure
            continue
        here = space.frame(base)[0]
        angles = scale * np.asarray(space.inner(at, np.broadcast_to(here, logs.shape), logs))
        return base, here, angles, scale
    assert error is not None
    raise error


# ---- several starts ----


def _from_several_starts(space: Geometry, group: Groups, kind: _Kind, number: int | None) -> _Found:
    """Descend from the best data, extrinsic means, and points beyond the lowest minimum; keep the lowest minimum."""
    starts = joined([_best_data(space, group, kind), *_extrinsic(space, group)])
    ends, objective = _all_descents(space, group, starts, kind)
    if np.isfinite(objective).any():
        lowest = take(ends, _best(space, group, ends, objective))
        more, values = _all_descents(space, group, _beyond(space, group, lowest), kind)
        ends, objective = joined([ends, more]), np.append(objective, values)
    if not np.isfinite(objective).any():
        # Raises CutLocusError.
        kind.descend(space, group, take(starts, np.arange(1)))

    def converges(i: int) -> bool:
        whole, failed = _descents(space, group, take(ends, np.arange(i, i + 1)), kind)
        if failed[0] or whole.unfinished[0]:
            return False
        put(ends, i, take(whole.points, 0))
        objective[i] = whole.objective[0]
        return True

    # Only the lowest end points are iterated until they converge.
    for i in _lowest(space, ends, objective):
        if not converges(i) and objective[i] == objective.min():
            _raise_unfinished(kind, number)
    # The best one may be a neighbour of one of them.
    best = _best(space, group, ends, objective)
    converges(best)
    point = take(ends, best)
    far = space.distance(point, ends)
    square = float(np.sum(group.weights * space.distance(point, group.points) ** 2))
    error = standard_error(square, group.weights)
    apart = np.isfinite(objective) & (far > max(error, _SAME * space.injectivity_radius))
    result = _near(space, group, point)
    if not apart.any() or objective[best] == 0:
        return _Found(result, np.inf, np.inf, error)
    other = np.flatnonzero(apart)[np.argmin(objective[apart])]
    return _Found(result, float(far[other]), float(objective[other] / objective[best] - 1), error)


def _all_descents(space: Geometry, group: Groups, starts: Rows, kind: _Kind) -> tuple[Rows, Floats]:
    """Return end points of short descents in one group, and their objectives (infinite at a cut locus)."""
    count = len(group.weights)
    size = len(starts[0]) if isinstance(starts, tuple) else len(starts)
    parts = []
    for some in np.array_split(np.arange(size), max(1, -(-size * count // _ROWS))):
        rows = np.tile(np.arange(count), len(some))
        repeated = Groups(take(group.points, rows), np.full(len(some), count), np.tile(group.weights, len(some)))
        parts.append(_descents(space, repeated, take(starts, some), kind, (_SHORT,)))
    objective = np.concatenate([np.where(failed, np.inf, descent.objective) for descent, failed in parts])
    return joined([descent.points for descent, _ in parts]), objective


def _lowest(space: Geometry, ends: Rows, objective: Floats) -> list[int]:
    """Return indices of end points that are nearly as low as the lowest one and not near each other."""
    kept: list[int] = []
    for i in np.argsort(objective, kind="stable"):
        if objective[i] > objective.min() * (1 + _NEARLY) or len(kept) == _FINISHED:
            break
        others = [float(space.distance(take(ends, i), take(ends, np.arange(k, k + 1)))[0]) for k in kept]
        if all(other > _APART * space.injectivity_radius for other in others):
            kept.append(int(i))
    return kept


def _beyond(space: Geometry, group: Groups, point: Rows) -> Rows:
    """Return starts near the cut locus of a minimum, along the direction in which the data are spread most.

    Two opposite clusters have a minimum on either side, and descents from the data may all lead to the same one.
    """
    if isinstance(point, tuple) or not space.injectivity_radius > 0:
        return take(group.points, np.arange(1))
    try:
        logs = space.log(point, group.points)
        rows = np.ascontiguousarray(logs).reshape(len(logs), -1).view(np.float64)
        direction = np.tensordot(np.linalg.svd(rows, full_matrices=False)[0][:, 0], logs, 1)
        step = _BEYOND * space.injectivity_radius / space.norm(point, direction) * direction
        return np.stack([space.exp(point, step), space.exp(point, -step)])
    except (CutLocusError, ValidationError):
        return take(group.points, np.arange(1))


def _best_data(space: Geometry, group: Groups, kind: _Kind) -> Rows:
    """Return all data; of many data, those with the lowest objectives, computed from a sample."""
    count = len(group.weights)
    if count <= _ALL:
        return _map(np.copy, group.points)
    sample = np.unique(np.linspace(0, count - 1, min(count, _SAMPLE)).round().astype(np.intp))
    data, weights = take(group.points, sample), group.weights[sample]
    objective = np.array([weights @ space.distance(take(data, i), data) ** kind.power for i in range(len(sample))])
    return take(data, np.argsort(objective, kind="stable")[:_BEST])


def _extrinsic(space: Geometry, group: Groups) -> list[Rows]:
    """Return minimisers of the distance in the embedding space, projected to the manifold where possible."""
    try:
        starts = space._extrinsic_means(group.points, group.weights / group.weights.sum())
        return [] if starts is None else [space.project(np.ascontiguousarray(starts))]
    except (CutLocusError, ValidationError):
        # Evenly spread points can have an average that is not near any point of the space.
        return []


def _best(space: Geometry, group: Groups, ends: Rows, objective: Floats) -> int:
    """Return the index of the lowest minimum; of equal ones, that whose distances to the data are first in order."""
    lowest = objective.min()
    equal = np.flatnonzero(objective <= lowest * (1 + _EQUAL) + _EQUAL**2)
    scale = space.injectivity_radius
    if len(equal) == 1 or not scale > 0:
        return int(equal[0])
    keys = [np.round(space.distance(take(ends, i), group.points) / (_SAME * scale)) for i in equal]
    return int(equal[np.lexsort(np.array(keys).T[::-1])[0]])


def _near(space: Geometry, group: Groups, point: Rows) -> Rows:
    """Return the representative of a point near the first datum."""
    first = take(group.points, 0)
    try:
        moved = space.exp(first, space.log(first, point))
    except (CutLocusError, ValidationError):
        return point
    arrays = zip(*(x if isinstance(x, tuple) else (x,) for x in (moved, point)), strict=True)
    return point if all(np.abs(a - b).max() < _SAME for a, b in arrays) else moved


# ---- messages ----


def _raise_unfinished(kind: _Kind, number: int | None) -> None:
    of = "" if number is None else f" of group {number}"
    raise ConvergenceError(
        f"the {kind.name}{of} did not converge, because the points are spread too far. Use points that are closer "
        "together, or more points."
    )


def _warn_ambiguous(kind: _Kind, numbers: NDArray[np.intp] | None, results: list[_Found]) -> None:
    """Warn once of all groups that have two minima of nearly the same value."""
    bad = [i for i, result in enumerate(results) if result.excess < _AMBIGUOUS and result.distance > result.error]
    if not bad:
        return
    first = results[bad[0]]
    more = f" and {len(bad) - 1} more" if len(bad) > 1 else ""
    of = "" if numbers is None else f" of group {numbers[bad[0]]}{more}"
    squared = "squared " if kind is _MEAN else ""
    warn(
        f"`points`: the {kind.name}{of} is ambiguous. The sum of {squared}distances has a second local minimum at the "
        f"distance {first.distance:.3g} from the returned one, which exceeds the standard error {first.error:.3g}. Its "
        f"sum is only {100 * first.excess:.2g} % larger. Either single points are opposite to the others, or the "
        f"points are spread so far that no {kind.name} is meaningful. Remove the opposite points, or divide the points "
        "into clusters. If opposite points are equivalent, use `Quotient` or `RealProjective`.",
        AmbiguousMeanWarning,
    )

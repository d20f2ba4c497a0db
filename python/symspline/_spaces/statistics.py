"""Groups of points, and descents to local minima of their sums of distances.

Points are rows, one group after another, so that a batch is a single call and groups may differ in size.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import as_array, refuse
from .._core import ValidationError

Array = NDArray[Any]
Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

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

    points: Any
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

    def sums(self, rows: Any) -> Any:
        """Sum rows over each group."""
        starts = self.starts
        return _map(lambda x: np.add.reduceat(x, starts, axis=0), rows)

    def spread(self, rows: Any) -> Any:
        """Repeat one row per group for all points of the group."""
        return _map(lambda x: np.repeat(x, self.counts, axis=0), rows)


def _map(function: Any, *values: Any) -> Any:
    """Apply a function to arrays, or to the entries of tuples of arrays."""
    if isinstance(values[0], tuple):
        return tuple(function(*each) for each in zip(*values, strict=True))
    return function(*values)


def take(rows: Any, index: Any) -> Any:
    return _map(lambda x: x[index], rows)


def scaled(rows: Any, factors: Floats) -> Any:
    """Multiply every row by a number."""
    return _map(lambda x: x * factors.reshape(-1, *[1] * (x.ndim - 1)), rows)


def joined(rows: list[Any]) -> Any:
    """Concatenate rows of points."""
    return _map(lambda *each: np.concatenate(each), *rows)


def put(rows: Any, index: Any, values: Any) -> None:
    def replace(own: Array, value: Array) -> None:
        own[index] = value

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


def _hessians(space: Any, lengths: Floats) -> Floats:
    """Return bounds of the Hessians of half the squared distances.

    The Hessian of d²/2 is at most K d coth(K d) where sectional curvatures are at least −K² (Karcher 1977, equation
    (1.1.2)), and at most 1 where they are not negative. Spaces without cut locus are those of nonpositive curvature.
    """
    k = space.curvature
    if not (np.isinf(space.injectivity_radius) and np.isfinite(k) and k > 0):
        return np.ones_like(lengths)
    x = k * lengths
    return np.where(x > 1e-4, x / np.tanh(np.maximum(x, 1e-4)), 1.0)


def _size(space: Any, p: Any, v: Any) -> Floats:
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

    points: Any
    objective: Floats
    radius: Floats
    unfinished: NDArray[np.bool_]


def descend_to_mean(space: Any, groups: Groups, means: Any, steps: int = _STEPS) -> Descent:
    """Descend to a local minimum of the mean squared distance from every start.

    The gradient of half the mean squared distance is the negative mean logarithm. Its descent with the inverse of a
    bound of the Hessian as step length decreases the function in every step.
    """
    floor = 8 * _EPS * np.asarray(space._rounding(means))
    count = len(groups.counts)
    state = Descent(means, np.full(count, np.inf), np.zeros(count), np.zeros(count, bool))
    active, last = np.ones(count, bool), np.full(count, np.inf)
    for _ in range(steps):
        own, index = groups.of(active), np.flatnonzero(active)
        here = take(means, index)
        at = own.spread(here)
        logs = space.log(at, own.points)
        lengths = _size(space, at, logs)
        hessians = own.sums(own.weights * _hessians(space, lengths))
        # Without the projection, logarithms to points beyond a quarter turn amplify rounding errors of the iterate.
        step = space.project_tangent(here, scaled(own.sums(scaled(logs, own.weights)), 1 / hessians))
        put(means, index, space.exp(here, step))
        size, before, least = _size(space, here, step), last[active], floor[active]
        last[active] = size
        # Rounding errors of distant points may exceed the floor.
        active[index] = (size > least) & ((size < before) | (size > 1e4 * least))
        if not active[index].all():
            _note(state, index, own, lengths, 2)
        if not active.any():
            return state
    _note(state, index, own, lengths, 2)
    return state._replace(unfinished=active)


def descend_to_median(space: Any, groups: Groups, medians: Any, steps: int = _STEPS) -> Descent:
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
        own, index = groups.of(active), np.flatnonzero(active)
        here = take(medians, index)
        step, size, distances = _weiszfeld(space, own, here)
        # The mean distance from the first iterate, which is a datum.
        scale[index] = np.maximum(scale[index], own.sums(own.weights * distances) / own.sums(own.weights))
        nearest = _argmin(distances, own)
        candidates = take(own.points, own.starts + nearest)
        fresh = nearest != tested[index]
        tested[index] = nearest
        optimal = np.zeros(len(index), bool)
        if fresh.any():
            _, length, _ = _weiszfeld(space, own.of(fresh), take(candidates, fresh))
            optimal[fresh] = length == 0
        put(medians, index, space.exp(here, step))
        put(medians, index[optimal], take(candidates, optimal))
        with np.errstate(all="ignore"):
            rate[index] = np.where(last[index] > 0, size / last[index], 0.0)
        last[index] = size
        floor = 8 * _EPS * np.asarray(space._rounding(here)) + _MEDIAN_TOL * scale[index]
        active[index] = ~optimal & (size > floor)
        if not active[index].all():
            _note(state, index, own, distances, 1)
        if not active.any():
            return state
    _note(state, index, own, distances, 1)
    error = last / (1 - np.minimum(rate, 1 - 1e-6))
    return state._replace(unfinished=active & (error > _MEDIAN_LIMIT * scale))


def _note(state: Descent, index: Indices, groups: Groups, distances: Floats, power: int) -> None:
    """Store the objective and the radius of some groups."""
    state.objective[index] = groups.sums(groups.weights * distances**power)
    state.radius[index] = np.maximum.reduceat(distances, groups.starts)


def _weiszfeld(space: Any, groups: Groups, at: Any) -> tuple[Any, Floats, Floats]:
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
    found = np.flatnonzero(values == least)
    number = np.repeat(np.arange(len(groups.counts)), groups.counts)
    _, first = np.unique(number[found], return_index=True)
    return np.asarray(found[first] - groups.starts)


def require_metric(space: Any, what: str) -> None:
    """Raise ValidationError for spaces without an invariant, positive definite metric."""
    if not np.isfinite(space.curvature):
        raise ValidationError(
            f"{what} needs distances, but {space!r} has no invariant metric that is positive definite. Use a product "
            "such as 'so:3 x r:3' for poses."
        )

"""Karcher means and geometric medians: global minima of sums of distances or squared distances.

A local minimum is the global one if all data lie in a ball about it with half of the injectivity radius (a quarter for
medians). Otherwise, the problem is solved exactly on circles, and elsewhere descents from several starts are compared.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.faults import warn
from .._core import ConvergenceError, CutLocusError, ValidationError
from .circle import Floats, Minima, circular_mean, circular_median, standard_error, wrap
from .statistics import Array, Descent, Groups, descend_to_mean, descend_to_median, joined, put, take

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
# Objectives are equal up to the first relative difference, and points up to the second fraction of the injectivity
# radius.
_EQUAL, _SAME = 1e-9, 1e-6


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

    point: Any
    distance: float
    excess: float
    error: float


def karcher_mean(space: Any, groups: Groups) -> Any:
    """Return the Karcher mean of every group, and warn where another minimum is nearly as low."""
    return _minimum(space, groups, _MEAN)


def geometric_median(space: Any, groups: Groups) -> Any:
    """Return the geometric median of every group, and warn where another minimum is nearly as low."""
    return _minimum(space, groups, _MEDIAN)


def _minimum(space: Any, groups: Groups, kind: _Kind) -> Any:
    whitening = space._whitening(groups)
    if whitening is None:
        return _minimum_of_arrays(space, groups, kind)
    rows = whitening._replace(factor=groups.spread(whitening.factor))
    own = groups._replace(points=rows.forward(groups.points))
    return whitening.back(_minimum_of_arrays(whitening.space, own, kind))


def _minimum_of_arrays(space: Any, groups: Groups, kind: _Kind) -> Any:
    starts = space._first_means(groups)
    found, failed = _descents(space, groups, starts, kind, (_SHORT,))
    if np.isfinite(space.curvature):
        # A ball of radius 0 contains its centre only.
        outside = failed | ((found.radius >= kind.convex * space.injectivity_radius) & (found.radius > 0))
    else:
        outside = failed
    points, several = found.points, np.flatnonzero(outside)
    slow = found.unfinished & ~outside
    if slow.any():
        rest = kind.descend(space, groups.of(slow), take(points, slow))
        put(points, slow, rest.points)
        found.unfinished[slow] = rest.unfinished
    results = []
    for group in map(int, several):
        one = groups.of(np.arange(len(groups.counts)) == group)
        results.append(_global_minimum(space, one, kind, group if len(groups.counts) > 1 else None))
        _assign(points, group, results[-1].point)
    found.unfinished[several] = False
    if found.unfinished.any():
        _raise_unfinished(kind, np.flatnonzero(found.unfinished)[0] if len(groups.counts) > 1 else None)
    _warn_ambiguous(kind, several if len(groups.counts) > 1 else None, results)
    return points


def _descents(
    space: Any, groups: Groups, starts: Any, kind: _Kind, steps: tuple[int, ...] = ()
) -> tuple[Descent, NDArray[np.bool_]]:
    """Descend in every group, and return which descents met a cut locus."""
    count = len(groups.counts)
    try:
        return kind.descend(space, groups, _copied(starts), *steps), np.zeros(count, bool)
    except CutLocusError:
        if count == 1:
            nothing = np.zeros(1, bool)
            return Descent(_copied(starts), np.full(1, np.inf), np.full(1, np.inf), nothing), ~nothing
    halves = np.arange(count) < count // 2, np.arange(count) >= count // 2
    each = [_descents(space, groups.of(half), take(starts, half), kind, steps) for half in halves]
    points = joined([found.points for found, _ in each])
    numbers = [np.concatenate(own) for own in zip(*(found[1:] for found, _ in each), strict=True)]
    return Descent(points, *numbers), np.concatenate([failed for _, failed in each])


def _global_minimum(space: Any, group: Groups, kind: _Kind, number: int | None) -> _Found:
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
        found = kind.descend(space, group, take(data, np.arange(1)))
        if found.unfinished.any():
            _raise_unfinished(kind, number)
        return _Found(take(found.points, 0), np.inf, np.inf, 0.0)
    return _from_several_starts(space, group, kind, number)


def _order(points: Any) -> NDArray[np.intp]:
    """Return the lexicographic order of points."""
    arrays = points if isinstance(points, tuple) else (points,)
    rows = [np.ascontiguousarray(x).reshape(len(x), -1).view(np.float64) for x in arrays]
    return np.asarray(np.lexsort(np.concatenate(rows, axis=1).T[::-1]))


# ---- circles ----


def _on_torus(group: Groups, kind: _Kind) -> _Found:
    """Solve for every angle separately, which is exact for sums of squares, and for one angle also for medians."""
    each = [kind.on_circle(own, group.weights) for own in group.points.T]
    angles = np.array([own.angle for own in each])
    # Choose the representative nearest to the average of the given numbers.
    average = group.weights @ group.points / group.weights.sum()
    nearest = angles + 2 * np.pi * np.round((average - angles) / (2 * np.pi))
    excess = [own.other_objective / own.objective - 1 if own.objective > 0 else np.inf for own in each]
    worst = int(np.argmin(excess))
    distance = (
        float(abs(float(wrap(np.asarray(each[worst].other_angle - angles[worst])))))
        if excess[worst] < np.inf
        else np.inf
    )
    total = sum(own.objective for own in each)
    return _Found(nearest, distance, excess[worst], standard_error(total, group.weights))


def _on_circle(space: Any, group: Groups, kind: _Kind) -> _Found:
    """Solve exactly on a space that is isometric to a circle."""
    base, unit, angles, scale = _angles(space, group.points)
    found = kind.on_circle(angles, group.weights)
    if kind is _MEDIAN:
        point = group.points[np.argmin(np.abs(wrap(angles - found.angle)))]
    else:
        point = space.exp(base, found.angle / scale * unit)
    distance, excess = np.inf, np.inf
    if np.isfinite(found.other_objective) and found.objective > 0:
        distance = abs(float(wrap(np.asarray(found.other_angle - found.angle)))) / scale
        excess = found.other_objective / found.objective - 1
    square = circular_mean(angles, group.weights).objective
    return _Found(_near(space, group, point), distance, excess, standard_error(square, group.weights) / scale)


def _angles(space: Any, points: Array) -> tuple[Array, Array, Floats, float]:
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
        except CutLocusError as found:
            error = error or found
            continue
        here = space.frame(base)[0]
        angles = scale * np.asarray(space.inner(at, np.broadcast_to(here, logs.shape), logs))
        return base, here, angles, scale
    assert error is not None
    raise error


# ---- several starts ----


def _from_several_starts(space: Any, group: Groups, kind: _Kind, number: int | None) -> _Found:
    """Descend from the best data, extrinsic means, and points beyond the lowest minimum; keep the lowest minimum."""
    starts = joined([_best_data(space, group, kind), *_extrinsic(space, group)])
    found, objective = _all_descents(space, group, starts, kind)
    if np.isfinite(objective).any():
        lowest = take(found, _best(space, group, found, objective))
        more, values = _all_descents(space, group, _beyond(space, group, lowest), kind)
        found, objective = joined([found, more]), np.append(objective, values)
    if not np.isfinite(objective).any():
        # Raises CutLocusError.
        kind.descend(space, group, take(starts, np.arange(1)))

    def converges(i: int) -> bool:
        whole, failed = _descents(space, group, take(found, np.arange(i, i + 1)), kind)
        if failed[0] or whole.unfinished[0]:
            return False
        _assign(found, i, take(whole.points, 0))
        objective[i] = whole.objective[0]
        return True

    # Only the lowest end points are iterated until they converge.
    for i in _lowest(space, found, objective):
        if not converges(i) and objective[i] == objective.min():
            _raise_unfinished(kind, number)
    # The best one may be a neighbour of one of them.
    best = _best(space, group, found, objective)
    converges(best)
    point = take(found, best)
    far = _distances(space, point, found)
    square = float(np.sum(group.weights * _distances(space, point, group.points) ** 2))
    error = standard_error(square, group.weights)
    apart = np.isfinite(objective) & (far > max(error, _SAME * space.injectivity_radius))
    result = _near(space, group, point)
    if not apart.any() or objective[best] == 0:
        return _Found(result, np.inf, np.inf, error)
    other = np.flatnonzero(apart)[np.argmin(objective[apart])]
    return _Found(result, float(far[other]), float(objective[other] / objective[best] - 1), error)


def _all_descents(space: Any, group: Groups, starts: Any, kind: _Kind) -> tuple[Any, Floats]:
    """Return end points of short descents in one group, and their objectives (infinite at a cut locus)."""
    count = len(group.weights)
    size = len(starts[0]) if isinstance(starts, tuple) else len(starts)
    each = []
    for some in np.array_split(np.arange(size), max(1, -(-size * count // _ROWS))):
        rows = np.tile(np.arange(count), len(some))
        repeated = Groups(take(group.points, rows), np.full(len(some), count), np.tile(group.weights, len(some)))
        each.append(_descents(space, repeated, take(starts, some), kind, (_SHORT,)))
    objective = np.concatenate([np.where(failed, np.inf, own.objective) for own, failed in each])
    return joined([own.points for own, _ in each]), objective


def _lowest(space: Any, found: Any, objective: Floats) -> list[int]:
    """Return indices of end points that are nearly as low as the lowest one and not near each other."""
    kept: list[int] = []
    for i in np.argsort(objective, kind="stable"):
        if objective[i] > objective.min() * (1 + _NEARLY) or len(kept) == _FINISHED:
            break
        others = [float(_distances(space, take(found, i), take(found, np.arange(k, k + 1)))[0]) for k in kept]
        if all(other > _APART * space.injectivity_radius for other in others):
            kept.append(int(i))
    return kept


def _beyond(space: Any, group: Groups, point: Any) -> Any:
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


def _distances(space: Any, point: Any, points: Any) -> Floats:
    """Return the distances of points from one point."""
    count = len(points[0]) if isinstance(points, tuple) else len(points)
    one = tuple(np.broadcast_to(x, (count, *x.shape)) for x in point) if isinstance(point, tuple) else point
    return np.asarray(space.distance(one, points))


def _best_data(space: Any, group: Groups, kind: _Kind) -> Any:
    """Return all data; of many data, those with the lowest objectives, computed from a sample."""
    count = len(group.weights)
    if count <= _ALL:
        return _copied(group.points)
    sample = np.unique(np.linspace(0, count - 1, min(count, _SAMPLE)).round().astype(np.intp))
    data, weights = take(group.points, sample), group.weights[sample]
    objective = np.array([weights @ _distances(space, take(data, i), data) ** kind.power for i in range(len(sample))])
    return take(data, np.argsort(objective, kind="stable")[:_BEST])


def _extrinsic(space: Any, group: Groups) -> list[Any]:
    """Return minimisers of the distance in the embedding space, projected to the manifold where possible."""
    try:
        found = space._extrinsic_means(group.points, group.weights / group.weights.sum())
        return [] if found is None else [space.project(np.ascontiguousarray(found))]
    except (CutLocusError, ValidationError):
        # Evenly spread points can have an average that is not near any point of the space.
        return []


def _best(space: Any, group: Groups, found: Any, objective: Floats) -> int:
    """Return the index of the lowest minimum; of equal ones, that whose distances to the data are first in order."""
    lowest = objective.min()
    equal = np.flatnonzero(objective <= lowest * (1 + _EQUAL) + _EQUAL**2)
    scale = space.injectivity_radius
    if len(equal) == 1 or not scale > 0:
        return int(equal[0])
    keys = [np.round(_distances(space, take(found, i), group.points) / (_SAME * scale)) for i in equal]
    return int(equal[np.lexsort(np.array(keys).T[::-1])[0]])


def _near(space: Any, group: Groups, point: Any) -> Any:
    """Return the representative of a point near the first datum."""
    first = take(group.points, 0)
    try:
        found = space.exp(first, space.log(first, point))
    except (CutLocusError, ValidationError):
        return point
    arrays = zip(*(x if isinstance(x, tuple) else (x,) for x in (found, point)), strict=True)
    return point if all(np.abs(a - b).max() < _SAME for a, b in arrays) else found


# ---- messages ----


def _raise_unfinished(kind: _Kind, number: int | None) -> None:
    of = "" if number is None else f" of group {number}"
    raise ConvergenceError(
        f"the {kind.name}{of} did not converge, because the points are spread too far. Use points that are closer "
        "together, or more points."
    )


def _warn_ambiguous(kind: _Kind, numbers: NDArray[np.intp] | None, results: list[_Found]) -> None:
    """Warn once of all groups that have two minima of nearly the same value."""
    bad = [i for i, own in enumerate(results) if own.excess < _AMBIGUOUS and own.distance > own.error]
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


def _copied(points: Any) -> Any:
    return tuple(x.copy() for x in points) if isinstance(points, tuple) else points.copy()


def _assign(points: Any, index: int, value: Any) -> None:
    if isinstance(points, tuple):
        for own, new in zip(points, value, strict=True):
            own[index] = new
    else:
        points[index] = value

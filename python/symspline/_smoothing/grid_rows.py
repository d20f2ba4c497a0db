"""Smoothing of a grid, axis after axis, with one λ for all rows along an axis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.faults import silenced
from .._curves.ends import end_kinds, is_closed
from .._spaces import Array, Doubles, Euclidean, Space
from .make import make_smoothing_spline
from .spline import SmoothingSpline

# Variances do not depend on the space.
_LINE = Euclidean(1)


class Rows(NamedTuple):
    """Rows of a grid along one axis, in a space that is not a product.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Coordinates of the nodes.
    points : ndarray, shape (R, n, *point_shape)
        Noisy points. Those of weight zero are NaN.
    weights : ndarray, shape (R, n)
        Weights of the points.
    space : Space
        The space.
    bc_type : object
        End conditions of all rows.
    """

    t: Doubles
    points: Array
    weights: Doubles
    space: Space[Any]
    bc_type: Any

    def take(self, chosen: Any) -> Rows:
        """Return some of the rows."""
        return self._replace(points=self.points[chosen], weights=self.weights[chosen])

    def data_of(self, number: int) -> Rows:
        """Return one row without its nodes of weight zero."""
        used, own = self.weights[number] > 0, self.take([number])
        return Rows(self.t[used], own.points[:, used], own.weights[:, used], self.space, self.bc_type)

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of data in each row."""
        return np.asarray(np.count_nonzero(self.weights, axis=-1))

    @property
    def null(self) -> int:
        """Degrees of freedom of a row without bending energy."""
        kinds = end_kinds(self.bc_type)
        return 2 if kinds and all(kind == "natural" for kind in kinds) else 1

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Which nodes lie between data of their row, shape (R, n). On a closed row every node does."""
        used = self.weights > 0
        if is_closed(self.bc_type):
            return np.broadcast_to(used.any(axis=-1, keepdims=True), used.shape)
        return np.logical_or.accumulate(used, axis=-1) & np.logical_or.accumulate(used[:, ::-1], axis=-1)[:, ::-1]


class SmoothedRows(NamedTuple):
    """Smoothed rows.

    Attributes
    ----------
    points : ndarray, shape (R, n, *point_shape)
        Points of the smooth rows at the nodes between data; the others are NaN.
    df, rss : ndarray, shape (R,)
        Effective degrees of freedom, and the weighted sum of squared distances.
    iterations : ndarray of int, shape (R,)
        Number of iterations.
    converged : ndarray of bool, shape (R,)
        Whether the iteration converged.
    """

    points: Array
    df: Doubles
    rss: Doubles
    iterations: NDArray[np.int64]
    converged: NDArray[np.bool_]


def smooth(rows: Rows, lam: float) -> SmoothedRows:
    """Smooth all rows with one λ.

    A row with one datum keeps it, and a row without data stays empty.
    """
    space, count = rows.space, rows.counts
    zeros = np.zeros(len(count))
    blank, none = np.full_like(rows.points, np.nan), np.zeros(len(count), int)
    found = SmoothedRows(blank, np.minimum(count, 1.0), zeros, none, count < 2)
    single = (count == 1)[:, None] & (rows.weights > 0)
    found.points[single] = rows.points[single]
    many = np.flatnonzero(count > 1)
    if len(many):
        own = rows.take(many)
        spline = _fit(own, lam)
        _store(found, many, spline, np.where(_lifted(own.inside, own.points), spline(own.t), np.nan))
    # Nodes without data at small distances make the matrix of a row singular to rounding. Its data alone do not.
    for number in np.flatnonzero(~found.converged & (count < rows.weights.shape[-1])).tolist():
        spline, inside = _fit(rows.data_of(number), lam), rows.take([number]).inside[0]
        filled = np.full_like(rows.points[[number]], np.nan)
        filled[:, inside] = spline(rows.t[inside])
        _store(found, [number], spline, filled)
    used = (rows.weights > 0) & space._where_finite(found.points)
    squares = np.zeros(used.shape)
    squares[used] = space._apply("distance", p=found.points[used], q=rows.points[used]) ** 2
    return found._replace(rss=np.sum(rows.weights * squares, axis=-1))


def _fit(rows: Rows, lam: Any) -> SmoothingSpline[Any, Any]:
    options: Any = {"weights": rows.weights, "bc_type": rows.bc_type, "sigma": 1.0}
    with silenced(Warning):
        return make_smoothing_spline(rows.t, rows.points, rows.space, lam, on_failure="ignore", **options)


def _store(found: SmoothedRows, at: Any, spline: SmoothingSpline[Any, Any], points: Array) -> None:
    report = spline.report
    found.points[at], found.df[at] = points, report.df
    found.iterations[at], found.converged[at] = report.iterations, report.converged


def _lifted(mask: NDArray[np.bool_], points: Array) -> NDArray[np.bool_]:
    """Return a mask of points as a mask of their entries."""
    return mask.reshape(*mask.shape, *[1] * (points.ndim - mask.ndim))


def posterior_variance(t: Doubles, weights: Doubles, lam: float, bc_type: Any) -> Doubles:
    """Return the posterior variance at the nodes of rows with these weights, for noise of variance one.

    Parameters
    ----------
    weights : ndarray, shape (R, n)
        Weights. Nodes that do not lie between data have an infinite variance.

    Notes
    -----
    It is the diagonal of (W + λK)⁻¹, with K the matrix of the bending energy of the natural spline through the nodes.
    It does not depend on the points, so that rows with equal weights share it.
    """
    kinds, which = np.unique(weights, axis=0, return_inverse=True)
    rows = Rows(t, np.zeros((*kinds.shape, 1)), kinds, _LINE, bc_type)
    inside, count = rows.inside, rows.counts
    variance = np.where(kinds > 0, 1 / np.where(kinds > 0, kinds, 1), np.inf)
    many = np.flatnonzero(count > 1)
    if len(many):
        own = rows.take(many)
        with np.errstate(invalid="ignore"):
            found = np.where(own.inside, _fit(own, lam).std(t, calibrated=False) ** 2, np.inf)
        variance[many] = found
        # As in `smooth`, the data alone where the whole row is singular to rounding.
        for number in many[np.isnan(found).any(axis=-1) | ~(found > 0).all(axis=-1)]:
            at = inside[number]
            variance[number, at] = _fit(rows.data_of(number), lam).std(t[at], calibrated=False) ** 2
    return variance[which.reshape(-1)]


def complete_variance(t: Doubles, weight: float, lam: float, bc_type: Any, repeats: bool) -> Doubles:
    """Return the posterior variance of `posterior_variance` at the nodes of a row in which all weights are equal.

    Parameters
    ----------
    repeats : bool
        Whether the last node of a closed row is the first one, and not a datum of its own.
    """
    weights = np.full((1, len(t)), weight)
    if repeats:
        weights[:, -1] = 0.0
    return np.asarray(posterior_variance(t, weights, lam, bc_type)[0])


# ---- the choice of λ ----

# The search takes steps of this many decades, which are halved this many times around the minimum.
_DECADES, _HALVINGS = 0.5, 2
# Largest number of steps in one direction.
_MOST = 30
# Rows of about this many nodes in total determine λ; more would not change it noticeably.
_NODES = 20_000
# Rows whose own λ give the start of the search.
_FIRST = 50
# Least weight of a degree of freedom in the choice of λ for a single row.
_GAMMA = 1.4
# Fraction of the rows that may fail to converge at a λ.
_FAILED = 0.1
# If the degrees of freedom per row exceed those without bending energy by this little, every larger λ is equally good.
_STRAIGHT = 0.01


class LamCriterion(NamedTuple):
    """A criterion for λ.

    Attributes
    ----------
    gamma : float
        Weight of a degree of freedom in cross-validation.
    sigma : float or None
        Standard deviation of the noise for Mallows' C_p; None for cross-validation.
    """

    gamma: float
    sigma: float | None


class Data(NamedTuple):
    """Nodes of a grid, or of its rows along an axis, after some axes were smoothed.

    Attributes
    ----------
    points : ndarray, shape (n_1, ..., n_D, *point_shape) or (R, n, *point_shape)
        Points; NaN where the weight is 0.
    weights : ndarray, shape (n_1, ..., n_D) or (R, n)
        Weights: inverse posterior variances in units of `scale`; 0 for missing nodes.
    scale : ndarray, shape (n_1, ..., n_D) or (R,)
        Posterior variance of a node with weight one for noise of variance one. It is constant along the axes that were
        not smoothed.
    """

    points: Array
    weights: Doubles
    scale: Doubles


class Choice(NamedTuple):
    """The chosen λ, whether it is at a bound of the search, the number of values that were tried, and the score.

    The score of a given λ is infinite.
    """

    lam: float
    at_bound: bool
    evaluations: int
    score: float = np.inf


class _Totals(NamedTuple):
    """Sums over all data for one λ, per coordinate and per datum.

    Attributes
    ----------
    rss : float
        Weighted sum of squared distances of the data from the smooth rows.
    df : float
        Effective degrees of freedom of the surface.
    is_known : bool
        Whether the rows converged and have degrees of freedom left for the noise.
    is_straight : bool
        Whether hardly any row has bending energy.
    """

    rss: float
    df: float
    is_known: bool
    is_straight: bool


def common_lam(rows: Rows, data: Data, criterion: LamCriterion, start: float | None) -> Choice:
    """Return the λ that minimises the criterion of the surface, near a value from which the search starts.

    Without a start, the search begins at the median of the λ that some of the rows have alone.

    Notes
    -----
    The criteria are those of `make_smoothing_spline` for all data of the grid. Sums of squares and degrees of freedom
    include the effect of the axes that are smooth already. The noise that they leave determines λ, but the level of the
    noise follows from all residuals. Rows alone, which are correlated, would determine it less well.
    """
    if rows.counts.max() <= 2:
        # Such rows do not change.
        return Choice(_cube(rows), False, 0)
    rows, data = _some(rows, data)
    seen: dict[float, _Totals] = {}

    def look(x: float) -> None:
        if x not in seen:
            seen[x] = _totals(rows, data, 10.0**x)

    middle = np.log10(start) if start else _start(rows, criterion)
    for step in (-1, 0, 1):
        look(middle + step * _DECADES)
    for _ in range(_MOST):
        at, scores = _scores(seen, criterion)
        best = int(np.argmin(scores))
        if 0 < best < len(at) - 1:
            break
        if best == 0:
            # Curves through all data, or curves that fail.
            if not np.isfinite(scores[0]):
                look(at[-1] + _DECADES)
                continue
            look(at[0] - _DECADES)
        elif seen[at[-1]].is_straight:
            break
        else:
            look(at[-1] + _DECADES)
    at, scores = _scores(seen, criterion)
    best = int(np.argmin(scores))
    bound = best in (0, len(at) - 1)
    for halving in range(0 if bound else _HALVINGS):
        step = _DECADES / 2 ** (halving + 1)
        look(at[best] - step)
        look(at[best] + step)
        at, scores = _scores(seen, criterion)
        best = int(np.argmin(scores))
    if bound or seen[at[best]].is_straight or not np.isfinite(scores[best - 1]):
        return Choice(10.0 ** at[best], True, len(seen), float(scores[best]))
    found = 10.0 ** _vertex(at[best - 1 : best + 2], scores[best - 1 : best + 2])
    return Choice(found, False, len(seen), float(scores[best]))


def score_of(rows: Rows, data: Data, criterion: LamCriterion, lam: float) -> float:
    """Return the criterion of the surface for one λ of the rows."""
    _, scores = _scores({np.log10(lam): _totals(*_some(rows, data), lam)}, criterion)
    return float(scores[0])


def _some(rows: Rows, data: Data) -> tuple[Rows, Data]:
    """Return as many rows as the choice of λ needs."""
    every = -(-int(rows.counts.sum()) // _NODES)
    return rows.take(slice(None, None, every)), Data(*(own[::every] for own in data))


def _cube(rows: Rows) -> float:
    """Return the cube of the mean step, with which a node and its neighbours have a similar influence."""
    return float((np.ptp(rows.t) / (len(rows.t) - 1)) ** 3)


def _start(rows: Rows, criterion: LamCriterion) -> float:
    """Return the decimal logarithm of the median of the λ that some of the rows would have alone."""
    own = rows.take(slice(None, None, -(-len(rows.weights) // _FIRST)))
    options: Any = {"weights": own.weights, "bc_type": own.bc_type, "gamma": max(criterion.gamma, _GAMMA)}
    with silenced(Warning):
        report = make_smoothing_spline(own.t, own.points, own.space, on_failure="ignore", **options).report
    lam, bound = np.asarray(report.lam), np.asarray(report.at_bound)
    good = np.isfinite(lam) & (lam > 0) & np.asarray(report.converged)
    for mask in (good & ~bound, good):
        if mask.any():
            return float(np.median(np.log10(lam[mask])))
    return float(np.log10(_cube(rows) * rows.weights.mean()))


def _totals(rows: Rows, data: Data, lam: float) -> _Totals:
    found, space = smooth(rows, lam), rows.space
    good = found.converged & np.isfinite(found.df)
    used = (data.weights > 0) & space._where_finite(found.points) & good[:, None]
    n, weights = max(int(np.count_nonzero(used)), 1), data.weights[used]
    variance = data.scale[:, None] * posterior_variance(rows.t, rows.weights, lam, rows.bc_type)
    distances = space._apply("distance", p=found.points[used], q=data.points[used])
    rss = float(np.sum(weights * distances**2)) / space.dim / n
    energetic = np.maximum(found.df[good] - np.minimum(rows.null, rows.counts[good]), 0.0)
    return _Totals(
        max(rss, _rounding(rows)),
        float(np.sum(weights * variance[used])) / n,
        bool(np.mean(~good) <= _FAILED and n > 1),
        bool(np.sum(energetic) <= _STRAIGHT * len(energetic)),
    )


def _rounding(rows: Rows) -> float:
    """Return a weighted squared distance that is due to rounding. Exact data have no larger ones for any λ."""
    size = np.abs(rows.points).max(initial=1.0, where=np.isfinite(rows.points))
    return float((1e-13 * size) ** 2 * rows.weights.mean())


def _scores(seen: dict[float, _Totals], criterion: LamCriterion) -> tuple[list[float], Doubles]:
    """Return the decimal logarithms of λ in increasing order, and the scores."""
    at = sorted(seen)
    rss, df, known, _ = (np.array(own) for own in zip(*(seen[x] for x in at), strict=True))
    left = 1 - criterion.gamma * df
    if criterion.sigma is None:
        known = known & (left > 1e-6)
        scores = np.log(rss) - 2 * np.log(np.where(known, left, 1.0))
    else:
        known = known & (df < 1 - 1e-6)
        scores = rss + 2 * criterion.sigma**2 * df
    return at, np.where(known, scores, np.inf)


def _vertex(x: list[float], y: Doubles) -> float:
    """Return the minimum of the parabola through three points, of which the middle one is the lowest."""
    (a, b), (down, up) = np.diff(x), np.diff(y) / np.diff(x)
    bend = (up - down) / (a + b)
    at = (x[0] + x[1]) / 2 - down / (2 * bend) if bend > 0 else x[1]
    return float(np.clip(at, x[0], x[2]))


# ---- one axis after the other ----

# Degrees of freedom per node along each axis, of which all combinations are tried.
_PROBES = (0.4, 0.75)
# Largest number of rounds from the best combination, and the relative change of the score that ends them.
_ROUNDS, _ENOUGH = 4, 1e-3


class Nodes(NamedTuple):
    """Noisy nodes of a grid in a space that is not a product.

    Attributes
    ----------
    axes : tuple of ndarray
        Coordinates along every axis, as the core counts them.
    points : ndarray, shape (n_1, ..., n_D, *point_shape)
        Points. Those of weight zero are NaN.
    weights : ndarray, shape (n_1, ..., n_D)
        Weights.
    space : Space
        The space.
    bc_types : tuple
        End conditions along every axis.
    """

    axes: tuple[Doubles, ...]
    points: Array
    weights: Doubles
    space: Space[Any]
    bc_types: tuple[Any, ...]


@dataclass(frozen=True)
class SmoothedAxis:
    """Properties of the smoothing along one axis. Sums are those over all rows.

    Attributes
    ----------
    lam : float
        Weight λ of the bending energy.
    at_bound : bool
        Whether the chosen λ is at a bound.
    evaluations : int
        Number of λ that were tried; 0 if λ was given.
    count, df, rss : float
        Number of data, degrees of freedom, and weighted sum of squared distances.
    iterations : int
        Largest number of iterations of a row.
    failed : int
        Number of rows that did not converge.
    """

    lam: float
    at_bound: bool
    evaluations: int
    count: int
    df: float
    rss: float
    iterations: int
    failed: int

    def sigma(self, dim: int) -> float:
        """Return the estimated standard deviation of the noise in one coordinate before this axis was smoothed."""
        return noise_level(self.rss, self.count, self.df, dim)


class SmoothedNodes(NamedTuple):
    """Smoothed nodes of a grid.

    Attributes
    ----------
    points : ndarray, shape (n_1, ..., n_D, *point_shape)
        Points of the surface; NaN where rows do not have data on both sides.
    variance : ndarray, shape (n_1, ..., n_D)
        Posterior variance of one coordinate for noise of variance one; NaN where points are NaN.
    axes : list of SmoothedAxis
        Properties of the smoothing along every axis.
    failed : tuple of int or None
        Axis of the first row that did not converge, and the index of this row among those along the axis.
    """

    points: Array
    variance: Doubles
    axes: list[SmoothedAxis]
    failed: tuple[int, ...] | None


def noise_level(rss: float, count: float, df: float, dim: int) -> float:
    """Return the estimated standard deviation of the noise in one coordinate; NaN if there are no data for it."""
    left = dim * (count - df)
    return float(np.sqrt(rss / left)) if left > 1e-6 * dim * count else float("nan")


def smooth_axes(
    nodes: Nodes,
    lams: tuple[float | None, ...],
    criterion: LamCriterion,
    progress: Callable[[int, int], object],
) -> SmoothedNodes:
    r"""Smooth the rows along the first axis, then the rows of the smooth nodes along the second axis, and so on.

    Parameters
    ----------
    lams : tuple of float or None
        λ along every axis. None chooses it by the criterion.
    progress : callable
        Function that is called with the finished and the total number of passes.

    Notes
    -----
    With equal weights, every pass multiplies the nodes by a matrix :math:`S_k = (1 + λ_k K_k / w)^{-1}`, so that the
    posterior covariance of the nodes is :math:`σ^2 S_1 ⊗ S_2 ⊗ … / w`.

    With other weights, and with missing data, the variances of the nodes differ along a row of a later pass. Their
    weights there are the inverse posterior variances, in units of that of a complete row with the mean weight.

    The criterion for λ is that of the surface. In a first round it is minimised along one axis after the other, each
    time with the axes before. The λ of the first axes are then too large, because the noise that the other axes would
    remove is still there. In a second round, each λ is chosen again for nodes that are smooth along all other axes.

    As a function of several λ, the criterion may have more than one minimum. With few nodes per period, rows along each
    axis look like noise until the other axes are smoothed, and both rounds end at a plane. The criterion is therefore
    also evaluated for a grid of λ between those of a plane and of an interpolating surface. If one of these is better,
    further rounds start from it.
    """
    count = len(lams)
    start = Data(nodes.points, nodes.weights, np.ones(nodes.weights.shape))
    order = range(count)
    chosen = {k: Choice(lam, False, 0) for k, lam in enumerate(lams) if lam is not None}
    asked = [k for k in order if k not in chosen]
    again = asked if count > 1 else []
    done, total = 0, count * (1 + bool(asked) + len(again)) - len(again)

    state = start

    def passed(state: Data, k: int) -> tuple[Data, SmoothedAxis, tuple[int, ...] | None]:
        nonlocal done
        result = _smooth_axis(nodes, state, k, chosen[k])
        done += 1
        progress(done, total)
        return result

    def seen_from(state: Data, k: int) -> tuple[Rows, Data]:
        data = Data(_flat(nodes.points, nodes, k), _flat(nodes.weights, nodes, k), _flat(state.scale, nodes, k)[:, 0])
        return _rows(nodes, state, k), data

    def choose(state: Data, k: int) -> None:
        before = chosen.get(k)
        found = common_lam(*seen_from(state, k), criterion, before.lam if before else None)
        chosen[k] = found._replace(evaluations=found.evaluations + (before.evaluations if before else 0))

    def choose_again() -> None:
        nonlocal state
        for k in again:
            state = start
            for other in order:
                if other != k:
                    state, *_ = passed(state, other)
            choose(state, k)

    for k in order if asked else ():
        if k in asked:
            choose(state, k)
        state, *_ = passed(state, k)
    choose_again()
    if len(asked) > 1:
        best = dict(chosen)
        probe, score = _best_probe(
            nodes, start, chosen, asked, lambda state, k, lam: score_of(*seen_from(state, k), criterion, lam)
        )
        if score < best[asked[-1]].score:
            chosen |= {k: best[k]._replace(lam=lam, score=score) for k, lam in probe.items()}
            for _ in range(_ROUNDS):
                total += len(again) * (count - 1)
                before = chosen[asked[-1]].score
                choose_again()
                if not chosen[asked[-1]].score < before - _ENOUGH * abs(before):
                    break
            if not chosen[asked[-1]].score < best[asked[-1]].score:
                chosen.update(best)
    state, found, first = start, [], None
    for k in order:
        state, own, failed = passed(state, k)
        found.append(own)
        first = first or failed
    there = nodes.space._where_finite(state.points)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.where(there, state.scale / state.weights, np.nan)
    return SmoothedNodes(np.ascontiguousarray(state.points), variance, found, first)


def _best_probe(
    nodes: Nodes,
    start: Data,
    given: dict[int, Choice],
    asked: list[int],
    score: Callable[[Data, int, float], float],
) -> tuple[dict[int, float], float]:
    """Return the best of some combinations of λ along the axes, and its score.

    Parameters
    ----------
    given : dict
        λ of all axes. Those of the axes `asked` are replaced.
    score : callable
        Function of nodes smoothed along all other axes, of the last of the axes `asked`, and of its λ.
    """
    last = asked[-1]
    tried = {k: [_lam_of_df(nodes, k, df) for df in _PROBES] for k in asked}
    best: tuple[dict[int, float], float] = ({}, np.inf)

    def visit(state: Data, rest: list[int], lams: dict[int, float]) -> None:
        nonlocal best
        if not rest:
            for lam in tried[last]:
                found = score(state, last, lam)
                if found < best[1]:
                    best = {**lams, last: lam}, found
            return
        k, *rest = rest
        for lam in tried.get(k, [given[k].lam]):
            moved, *_ = _smooth_axis(nodes, state, k, given[k]._replace(lam=lam))
            visit(moved, rest, {**lams, k: lam} if k in tried else lams)

    visit(start, [k for k in given if k != last], {})
    return best


def _lam_of_df(nodes: Nodes, k: int, share: float) -> float:
    """Return the λ for which complete rows along an axis have a given number of degrees of freedom per node."""
    t, weight = nodes.axes[k], float(nodes.weights[nodes.weights > 0].mean())
    unit = weight * float(np.ptp(t) / (len(t) - 1)) ** 3
    low, high = -6.0, 12.0
    for _ in range(12):
        middle = 0.5 * (low + high)
        variance = complete_variance(t, weight, 10.0**middle * unit, nodes.bc_types[k], False)
        low, high = (middle, high) if weight * variance.mean() > share else (low, middle)
    return float(10.0**low * unit)


def _rows(nodes: Nodes, state: Data, k: int) -> Rows:
    """Return the rows along axis k."""
    points, weights = (_flat(own, nodes, k) for own in (state.points, state.weights))
    return Rows(nodes.axes[k], points, weights, nodes.space, nodes.bc_types[k])


def _flat(array: Any, nodes: Nodes, k: int) -> Any:
    """Return the rows along axis k of an array with the axes of the grid."""
    last = len(nodes.axes) - 1
    moved = np.moveaxis(array, k, last)
    return np.ascontiguousarray(moved.reshape(-1, *moved.shape[last:]))


def _smooth_axis(
    nodes: Nodes, state: Data, k: int, choice: Choice
) -> tuple[Data, SmoothedAxis, tuple[int, ...] | None]:
    """Smooth the rows along axis k. Return the new state, the properties of the smoothing, and the first failed row."""
    shape = state.weights.shape
    others, t, bc_type = shape[:k] + shape[k + 1 :], nodes.axes[k], nodes.bc_types[k]

    def unflat(rows: Any) -> Any:
        return np.moveaxis(rows.reshape(*others, *rows.shape[1:]), len(others), k)

    rows = _rows(nodes, state, k)
    smoothed = smooth(rows, choice.lam)
    used = rows.weights > 0
    failed = np.flatnonzero(~smoothed.converged)
    own = SmoothedAxis(
        *choice[:3],
        count=int(np.count_nonzero(used)),
        df=float(smoothed.df.sum()),
        rss=float(smoothed.rss.sum()),
        iterations=int(smoothed.iterations.max(initial=0)),
        failed=len(failed),
    )
    repeats = is_closed(bc_type) and not used[:, -1].any()
    mean = float(rows.weights[used].mean())
    per_node = mean * complete_variance(t, mean, choice.lam, bc_type, repeats)
    at_nodes = posterior_variance(t, rows.weights, choice.lam, bc_type)
    points = unflat(smoothed.points)
    weights = np.where(nodes.space._where_finite(points), unflat(per_node / at_nodes), 0.0)
    along = np.ones(len(shape), int)
    along[k] = len(t)
    first = (k, *map(int, np.unravel_index(failed[0], others or (1,)))) if len(failed) else None
    return Data(points, weights, state.scale * per_node.reshape(along)), own, first

"""Smoothing of noisy points on a grid, axis after axis, with one λ for all rows along an axis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import as_array, checked_atol, checked_number, one_of, refuse
from .._base.faults import silenced, warn
from .._base.report import ConvergenceWarning
from .._base.typing import (
    Extrapolate,
    FloatArray,
    GridCriterion,
    Number,
    Numbers,
    OnFailure,
    P,
    PointsLike,
    Progress,
    SmoothingBCType,
    SmoothingWord,
    TimesLike,
)
from .._core import ConvergenceError, ValidationError
from .._curves.ends import end_kinds, is_closed
from .._curves.options import check_policies
from .._grid import GridReport, GridSpline
from .._grid.axes import GridAxis, read_axes, read_nodes, validate_nodes
from .._spaces import AnySpace, Array, Doubles, Euclidean, Product, Space, cover_of, factors_of, space_named
from .._splines.archive import Entries, entry, read_array, suffix_of
from ..manifolds._manifold import refuse_functions
from .audit import warn_of_spread
from .make import make_smoothing_spline
from .noise import grouped, is_several, join, per_part, smoothed_spaces, split
from .report import SmoothingWarning
from .spline import AnySmoothingSpline

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
    space: AnySpace
    bc_type: SmoothingBCType

    def take(self, chosen: slice | list[int] | NDArray[np.intp]) -> Rows:
        """Return some of the rows."""
        return self._replace(points=self.points[chosen], weights=self.weights[chosen])

    def data_of(self, number: int) -> Rows:
        """Return one row without its nodes of weight zero."""
        used, row = self.weights[number] > 0, self.take([number])
        return Rows(self.t[used], row.points[:, used], row.weights[:, used], self.space, self.bc_type)

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
    result = SmoothedRows(blank, np.minimum(count, 1.0), zeros, none, count < 2)
    single = (count == 1)[:, None] & (rows.weights > 0)
    result.points[single] = rows.points[single]
    many = np.flatnonzero(count > 1)
    if len(many):
        several = rows.take(many)
        spline = _fit(several, lam)
        _store(result, many, spline, np.where(_lifted(several.inside, several.points), spline(several.t), np.nan))
    # Nodes without data at small distances make the matrix of a row singular to rounding. Its data alone do not.
    for number in np.flatnonzero(~result.converged & (count < rows.weights.shape[-1])).tolist():
        spline, inside = _fit(rows.data_of(number), lam), rows.take([number]).inside[0]
        filled = np.full_like(rows.points[[number]], np.nan)
        filled[:, inside] = spline(rows.t[inside])
        _store(result, [number], spline, filled)
    used = (rows.weights > 0) & space._where_finite(result.points)
    squares = np.zeros(used.shape)
    squares[used] = space._apply("distance", p=result.points[used], q=rows.points[used]) ** 2
    return result._replace(rss=np.sum(rows.weights * squares, axis=-1))


def _fit(rows: Rows, lam: Number) -> AnySmoothingSpline:
    options: Any = {"weights": rows.weights, "bc_type": rows.bc_type, "sigma": 1.0}
    with silenced(Warning):
        return make_smoothing_spline(rows.t, rows.points, rows.space, lam, on_failure="ignore", **options)


def _store(result: SmoothedRows, at: list[int] | NDArray[np.intp], spline: AnySmoothingSpline, points: Array) -> None:
    report = spline.report
    result.points[at], result.df[at] = points, report.df
    result.iterations[at], result.converged[at] = report.iterations, report.converged


def _lifted(mask: NDArray[np.bool_], points: Array) -> NDArray[np.bool_]:
    """Return a mask of points as a mask of their entries."""
    return mask.reshape(*mask.shape, *[1] * (points.ndim - mask.ndim))


def posterior_variance(t: Doubles, weights: Doubles, lam: float, bc_type: SmoothingBCType) -> Doubles:
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
        several = rows.take(many)
        with np.errstate(invalid="ignore"):
            variances = np.where(several.inside, _fit(several, lam).std(t, calibrated=False) ** 2, np.inf)
        variance[many] = variances
        # As in `smooth`, the data alone where the whole row is singular to rounding.
        for number in many[np.isnan(variances).any(axis=-1) | ~(variances > 0).all(axis=-1)]:
            at = inside[number]
            variance[number, at] = _fit(rows.data_of(number), lam).std(t[at], calibrated=False) ** 2
    return variance[which.reshape(-1)]


def complete_variance(t: Doubles, weight: float, lam: float, bc_type: SmoothingBCType, repeats: bool) -> Doubles:
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
    lam = 10.0 ** _vertex(at[best - 1 : best + 2], scores[best - 1 : best + 2])
    return Choice(lam, False, len(seen), float(scores[best]))


def score_of(rows: Rows, data: Data, criterion: LamCriterion, lam: float) -> float:
    """Return the criterion of the surface for one λ of the rows."""
    _, scores = _scores({np.log10(lam): _totals(*_some(rows, data), lam)}, criterion)
    return float(scores[0])


def _some(rows: Rows, data: Data) -> tuple[Rows, Data]:
    """Return as many rows as the choice of λ needs."""
    every = -(-int(rows.counts.sum()) // _NODES)
    return rows.take(slice(None, None, every)), Data(*(rows[::every] for rows in data))


def _cube(rows: Rows) -> float:
    """Return the cube of the mean step, with which a node and its neighbours have a similar influence."""
    return float((np.ptp(rows.t) / (len(rows.t) - 1)) ** 3)


def _start(rows: Rows, criterion: LamCriterion) -> float:
    """Return the decimal logarithm of the median of the λ that some of the rows would have alone."""
    sample = rows.take(slice(None, None, -(-len(rows.weights) // _FIRST)))
    options: Any = {"weights": sample.weights, "bc_type": sample.bc_type, "gamma": max(criterion.gamma, _GAMMA)}
    with silenced(Warning):
        report = make_smoothing_spline(sample.t, sample.points, sample.space, on_failure="ignore", **options).report
    lam, bound = np.asarray(report.lam), np.asarray(report.at_bound)
    good = np.isfinite(lam) & (lam > 0) & np.asarray(report.converged)
    for mask in (good & ~bound, good):
        if mask.any():
            return float(np.median(np.log10(lam[mask])))
    return float(np.log10(_cube(rows) * rows.weights.mean()))


def _totals(rows: Rows, data: Data, lam: float) -> _Totals:
    result, space = smooth(rows, lam), rows.space
    good = result.converged & np.isfinite(result.df)
    used = (data.weights > 0) & space._where_finite(result.points) & good[:, None]
    n, weights = max(int(np.count_nonzero(used)), 1), data.weights[used]
    variance = data.scale[:, None] * posterior_variance(rows.t, rows.weights, lam, rows.bc_type)
    distances = space._apply("distance", p=result.points[used], q=data.points[used])
    rss = float(np.sum(weights * distances**2)) / space.dim / n
    energetic = np.maximum(result.df[good] - np.minimum(rows.null, rows.counts[good]), 0.0)
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
    rss, df, known, _ = (np.array(column) for column in zip(*(seen[x] for x in at), strict=True))
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
    space: AnySpace
    bc_types: tuple[Any, ...]

    def along(self, array: Array, k: int) -> Array:
        """Return the rows along axis k of an array with the axes of the grid."""
        last = len(self.axes) - 1
        moved = np.moveaxis(array, k, last)
        return np.ascontiguousarray(moved.reshape(-1, *moved.shape[last:]))

    def rows(self, state: Data, k: int) -> Rows:
        """Return the rows along axis k after some axes were smoothed."""
        points, weights = self.along(state.points, k), self.along(state.weights, k)
        return Rows(self.axes[k], points, weights, self.space, self.bc_types[k])

    def smoothed(self, state: Data, k: int, choice: Choice) -> tuple[Data, SmoothedAxis, tuple[int, ...] | None]:
        """Smooth the rows along axis k.

        Return the new state, the properties of the smoothing, and the axis and the index of the first row that failed.
        """
        shape = state.weights.shape
        others, t, bc_type = shape[:k] + shape[k + 1 :], self.axes[k], self.bc_types[k]

        def unflat(rows: Array) -> Array:
            return np.moveaxis(rows.reshape(*others, *rows.shape[1:]), len(others), k)

        rows = self.rows(state, k)
        result = smooth(rows, choice.lam)
        used, failed = rows.weights > 0, np.flatnonzero(~result.converged)
        properties = SmoothedAxis(
            *choice[:3],
            count=int(np.count_nonzero(used)),
            df=float(result.df.sum()),
            rss=float(result.rss.sum()),
            iterations=int(result.iterations.max(initial=0)),
            failed=len(failed),
        )
        repeats = is_closed(bc_type) and not used[:, -1].any()
        mean = float(rows.weights[used].mean())
        per_node = mean * complete_variance(t, mean, choice.lam, bc_type, repeats)
        at_nodes = posterior_variance(t, rows.weights, choice.lam, bc_type)
        points = unflat(result.points)
        weights = np.where(self.space._where_finite(points), unflat(per_node / at_nodes), 0.0)
        along = np.ones(len(shape), int)
        along[k] = len(t)
        first = (k, *map(int, np.unravel_index(failed[0], others or (1,)))) if len(failed) else None
        return Data(points, weights, state.scale * per_node.reshape(along)), properties, first


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


class SmoothedPart(NamedTuple):
    """Properties of the smoothing in one part of the space.

    Attributes
    ----------
    axes : list of SmoothedAxis
        Properties along every axis.
    variance : ndarray, shape (n_1, ..., n_D)
        Posterior variance at the nodes for noise of variance one.
    df : float
        Effective degrees of freedom of the surface per coordinate.
    sigma : float
        Standard deviation of the noise, given or estimated.
    """

    axes: list[SmoothedAxis]
    variance: Doubles
    df: float
    sigma: float


def noise_level(rss: float, count: float, df: float, dim: int) -> float:
    """Return the estimated standard deviation of the noise in one coordinate; NaN if there are no data for it."""
    left = dim * (count - df)
    return float(np.sqrt(rss / left)) if left > 1e-6 * dim * count else float("nan")


def smooth_axes(
    nodes: Nodes,
    lams: tuple[float | None, ...],
    criterion: LamCriterion,
    sigma: float,
    progress: Callable[[int, int], object],
) -> tuple[Array, SmoothedPart, tuple[int, ...] | None]:
    r"""Smooth the rows along the first axis, then the rows of the smooth nodes along the second axis, and so on.

    Parameters
    ----------
    lams : tuple of float or None
        λ along every axis. None chooses it by the criterion.
    sigma : float
        Standard deviation of the noise; NaN estimates it.
    progress : callable
        Function that is called with the finished and the total number of passes.

    Returns
    -------
    points : ndarray, shape (n_1, ..., n_D, *point_shape)
        Points of the surface; NaN where rows do not have data on both sides.
    part : SmoothedPart
        Properties of the smoothing.
    failed : tuple of int or None
        Axis of the first row that did not converge, and the index of this row among those along the axis.

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
        result = nodes.smoothed(state, k, chosen[k])
        done += 1
        progress(done, total)
        return result

    def seen_from(state: Data, k: int) -> tuple[Rows, Data]:
        data = Data(nodes.along(nodes.points, k), nodes.along(nodes.weights, k), nodes.along(state.scale, k)[:, 0])
        return nodes.rows(state, k), data

    def choose(state: Data, k: int) -> None:
        before = chosen.get(k)
        choice = common_lam(*seen_from(state, k), criterion, before.lam if before else None)
        chosen[k] = choice._replace(evaluations=choice.evaluations + (before.evaluations if before else 0))

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
    state, smoothed_axes, first = start, [], None
    for k in order:
        state, smoothed_axis, failed = passed(state, k)
        smoothed_axes.append(smoothed_axis)
        first = first or failed
    there = nodes.space._where_finite(state.points)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.where(there, state.scale / state.weights, np.nan)
    used = (nodes.weights > 0) & there
    weights = nodes.weights[used]
    distances = nodes.space._apply("distance", p=state.points[used], q=nodes.points[used])
    df = float(np.sum(weights * variance[used]))
    if np.isnan(sigma):
        sigma = noise_level(float(np.sum(weights * distances**2)), weights.size, df, nodes.space.dim)
    return np.ascontiguousarray(state.points), SmoothedPart(smoothed_axes, variance, df, sigma), first


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
                value = score(state, last, lam)
                if value < best[1]:
                    best = {**lams, last: lam}, value
            return
        k, *rest = rest
        for lam in tried.get(k, [given[k].lam]):
            moved, *_ = nodes.smoothed(state, k, given[k]._replace(lam=lam))
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


# ---- the surface ----

# Ratio of the degrees of freedom to the number of data from which rows follow nearly all data.
_ALL = 0.9
# A jump is a step between neighbouring nodes that is longer than the first number of median steps along the axis, and
# than the second number of times the steps before and after it. Noise and outliers cause no jumps, because the steps
# next to a long step are long as well.
_MEDIANS, _BESIDE = 8.0, 4.0
# Least number of jumps, as a fraction of the number of nodes along a side of the map.
_SHARE = 0.3
# A number for each axis, or for products and poses a tuple with one number per part.
PerAxis = tuple[float | tuple[float, ...], ...]


class SmoothingGridReport(GridReport):
    """Report of a `SmoothingGrid`: that of a `GridSpline`, and properties of the smoothing.

    Properties of the smoothing are tuples with one entry per axis, in the order in which the axes were smoothed. For a
    `Product`, and for poses, each entry is a tuple with one number per factor or part.

    See Also
    --------
    SmoothingGrid.report : The report of a grid.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 30)
    >>> noisy = np.sin(3 * u[:, None] + v) + 0.1 * np.random.default_rng(0).standard_normal((20, 30))
    >>> report = ss.make_smoothing_grid((u, v), noisy[..., None], "r:1").report
    >>> report.converged, report.at_bound, round(report.sigma[0], 1)
    (True, (False, False), 0.1)
    """

    _space: AnySpace
    _smoothed: list[SmoothedPart]

    @property
    def converged(self) -> bool:
        """Whether the smoothing of all rows converged, and the splines along the first axis."""
        return super().converged and not any(axis.failed for part in self._smoothed for axis in part.axes)

    @property
    def lam(self) -> PerAxis:
        """Weight λ of the bending energy."""
        return self._per_axis(lambda axis, _: axis.lam)

    @property
    def at_bound(self) -> PerAxis:
        """Whether the chosen λ is at a bound: rows are geodesics, or pass through nearly all nodes."""
        return self._per_axis(lambda axis, _: axis.at_bound)

    @property
    def evaluations(self) -> PerAxis:
        """Number of values of λ that were tried; 0 if λ was given."""
        return self._per_axis(lambda axis, _: axis.evaluations)

    @property
    def df(self) -> PerAxis:
        """Effective degrees of freedom per coordinate, summed over all rows along the axis."""
        return self._per_axis(lambda axis, _: axis.df)

    @property
    def rss(self) -> PerAxis:
        """Weighted sum of squared distances between the nodes before and after the axis was smoothed."""
        return self._per_axis(lambda axis, _: axis.rss)

    @property
    def sigma(self) -> PerAxis:
        """Standard deviation of the noise in one coordinate, estimated from the rows along the axis.

        Along the first axis it is that of the data. Along others it is that of nodes that are already smooth along the
        axes before.
        """
        return self._per_axis(lambda axis, dim: axis.sigma(dim))

    @property
    def iterations(self) -> PerAxis:
        """Largest number of iterations of a row."""
        return self._per_axis(lambda axis, _: axis.iterations)

    def _per_axis(self, value: Callable[[SmoothedAxis, int], float]) -> PerAxis:
        dims = [space.dim for space in smoothed_spaces(self._space)]
        of_parts = [[value(axis, dim) for axis in part.axes] for part, dim in zip(self._smoothed, dims, strict=True)]
        of_axes = zip(*of_parts, strict=True)
        return tuple(values if is_several(self._space) else values[0] for values in of_axes)


class SmoothingGrid(GridSpline[P], Generic[P]):
    """A C² surface close to noisy points on a grid.

    `make_smoothing_grid` returns objects of this class; it has no public constructor. All methods of `GridSpline` are
    available. `points` are those of the smooth surface at the nodes, and `vjp` differentiates with respect to them, not
    to the data. Files keep the data.

    For a `Product`, and for poses, `df`, `sigma` and `std` are tuples with one entry per factor or part.

    See Also
    --------
    make_smoothing_grid : Fit a surface close to noisy points on a grid.
    SmoothingGridReport : Report of the smoothing.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 30)
    >>> noisy = np.sin(3 * u[:, None] + v) + 0.1 * np.random.default_rng(0).standard_normal((20, 30))
    >>> ss.make_smoothing_grid((u, v), noisy[..., None], "r:1")
    <SmoothingGrid on Euclidean(1): 20 x 30 nodes>
    """

    _format = "symspline-smoothing-grid"
    _kind = "Smoothing grid"
    _data: list[Array]
    _weights: Doubles
    _smoothed: list[SmoothedPart]

    def __init__(self) -> None:
        raise TypeError("SmoothingGrid has no public constructor. Use symspline.make_smoothing_grid.")

    @classmethod
    def _through(
        cls,
        axes: Any,
        points: Any,
        space: Any,
        data: list[Array],
        weights: Doubles,
        smoothed: list[SmoothedPart],
        options: dict[str, Any],
    ) -> Self:
        """Return the grid through smooth points."""
        self = cls.__new__(cls)
        self._data, self._weights, self._smoothed = data, weights, smoothed
        GridSpline.__init__(self, axes, points, space, **options)
        return self

    @cached_property
    def report(self) -> SmoothingGridReport:
        """Report of the grid and of the smoothing.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> noisy = np.random.default_rng(0).standard_normal((8, 9, 1))
        >>> ss.make_smoothing_grid((None, None), noisy, "r:1", lam=2.0).report.lam
        (2.0, 2.0)
        """
        report = SmoothingGridReport._of(self._axes, self._factors)
        report._space, report._smoothed = self._space, self._smoothed
        return report

    @property
    def lam(self) -> PerAxis:
        """Weight λ of the bending energy along each axis.

        For products and poses each entry is a tuple with one number per part. `make_smoothing_grid` accepts this value
        as its argument `lam`.
        """
        return self.report.lam

    @property
    def df(self) -> float | tuple[float, ...]:
        """Effective degrees of freedom of the surface per coordinate."""
        df: float | tuple[float, ...] = self._per_space([part.df for part in self._smoothed])
        return df

    @property
    def sigma(self) -> float | tuple[float, ...]:
        """Standard deviation of the noise of the data in one coordinate, for weight one.

        This is the given value, or else the estimate ``sqrt(sum(weights * distance**2) / (dim * (N - df)))`` with the
        distances of the N data from the surface.
        """
        sigma: float | tuple[float, ...] = self._per_space([part.sigma for part in self._smoothed])
        return sigma

    @property
    def data(self) -> P:
        """Points that were smoothed, shape (n_1, ..., n_D, *point_shape); NaN where they are missing."""
        data: P = self._joined(self._data)
        return data

    @property
    def residuals(self) -> P:
        """Tangent vectors from the surface to the data at the nodes, shape (n_1, ..., n_D, *point_shape).

        They are logarithms at the surface, and their lengths are the distances. They are NaN at nodes without data.
        """
        residuals_of_factors = []
        for factor, data in zip(self._factors, self._data, strict=True):
            used = (self._weights > 0) & factor.space._where_finite(factor.points)
            vectors = np.full(data.shape, np.nan, data.dtype)
            vectors[used] = factor.space._apply("log", p=factor.points[used], q=data[used])
            residuals_of_factors.append(vectors)
        residuals: P = self._joined(residuals_of_factors)
        return residuals

    def std(self) -> FloatArray | tuple[FloatArray, ...]:
        r"""Compute the standard deviation of the surface at its nodes, in one coordinate of an orthonormal frame.

        Returns
        -------
        ndarray or tuple, shape (n_1, ..., n_D)
            Standard deviations, for products and poses a tuple with one entry per part. NaN where the surface has no
            point.

        See Also
        --------
        SmoothingGrid.sigma : The standard deviation of the noise.

        Notes
        -----
        With equal weights and without missing nodes, the posterior variance of a node is
        :math:`\sigma^2 \prod_k (S_k)_{i_k i_k} / w` with the smoothing matrices :math:`S_k` of the axes. Otherwise it
        follows from the variances along the last axis, whose weights there are those of nodes that are smooth along the
        other axes; correlations between these nodes are not taken into account.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 30)
        >>> noisy = np.sin(3 * u[:, None] + v) + 0.1 * np.random.default_rng(0).standard_normal((20, 30))
        >>> std = ss.make_smoothing_grid((u, v), noisy[..., None], "r:1").std()
        >>> bool(std[10, 15] < std[0, 15] < std[0, 0] < 0.1)
        True
        """
        deviations = [part.sigma * np.sqrt(part.variance) for part in self._smoothed]
        std: FloatArray | tuple[FloatArray, ...] = self._per_space(deviations)
        return std

    def _per_space(self, values: list[Any]) -> Any:
        return tuple(values) if is_several(self._space) else values[0]

    # ---- files and pickles ----

    def _state(self) -> dict[str, Any]:
        state = super()._state()
        state["noise"] = [
            {"axes": [vars(axis) for axis in part.axes], "df": part.df, "sigma": part.sigma} for part in self._smoothed
        ]
        state["data_weights"] = self._weights
        state |= {"data" + suffix_of(self._space, i): array for i, array in enumerate(self._data)}
        return state | {f"variance_{i}": part.variance for i, part in enumerate(self._smoothed)}

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        self = super()._from_state(state)
        grid = tuple(len(axis.knots) for axis in self._axes)
        self._data = [
            read_array(state, "data" + suffix_of(self._space, i), factor)
            for i, factor in enumerate(factors_of(self._space))
        ]
        for array, factor in zip(self._data, self._factors, strict=True):
            if array.shape != factor.points.shape:
                raise ValidationError(f"entry 'data': the data have shape {array.shape}")
        self._weights = _numbers(state, "data_weights", grid)
        with entry("noise"):
            noise = state["noise"]
            if len(noise) != len(smoothed_spaces(self._space)):
                raise ValidationError("it must have one entry per part of the space")
            self._smoothed = []
            for i, part in enumerate(noise):
                axes = [SmoothedAxis(**fields) for fields in part["axes"]]
                if len(axes) != len(grid):
                    raise ValidationError(f"there are {len(axes)} axes")
                variance = _numbers(state, f"variance_{i}", grid)
                self._smoothed.append(SmoothedPart(axes, variance, float(part["df"]), float(part["sigma"])))
        return self


def _numbers(state: Entries, name: str, shape: tuple[int, ...]) -> Doubles:
    """Return an array of numbers from a file."""
    array: Doubles = state[name]
    with entry(name):
        if array.dtype != np.float64 or array.shape != shape:
            raise ValidationError(f"it is {array.dtype} of shape {array.shape}, but must have shape {shape}")
    return array


def make_smoothing_grid(
    axes: Sequence[TimesLike | None],
    points: PointsLike,
    space: Space[P] | str,
    *,
    lam: Numbers | Sequence[Numbers | None] | None = None,
    weights: Numbers | None = None,
    criterion: GridCriterion = "gcv",
    gamma: float = 1.0,
    sigma: Numbers | None = None,
    bc_type: SmoothingWord | Sequence[SmoothingWord | tuple[SmoothingWord, SmoothingWord]] = "natural",
    extrapolate: Extrapolate = None,
    on_failure: OnFailure = "raise",
    atol: float | None = None,
    progress: Progress | None = None,
) -> SmoothingGrid[P]:
    r"""Fit a C² surface close to noisy points on a grid.

    The rows along the first axis are smoothed, then the rows of the smooth points along the second axis, and so on.
    All rows along an axis have the same λ, which the data determine unless `lam` is given. On a Euclidean space the
    result is the tensor-product smoothing spline.

    Parameters
    ----------
    axes : sequence of array_like
        Coordinates of the nodes along each axis, strictly increasing numbers or dates. None means 0, 1, ...,
        n - 1.
    points : array_like, shape (n_1, ..., n_D, *space.point_shape)
        Noisy points at the nodes. For a `Product`, a tuple with one array per factor. Nodes that are NaN or masked are
        missing. They are filled between the data of a row, and remain NaN outside; see Notes.
    space : Space or str
        A space or its name. Points of `SpecialEuclidean` are smoothed as rotations and positions.
    lam : float or sequence, optional
        Weight λ ≥ 0 of the bending energy, in units of weight · length³ of the axis (seconds for dates): one number for
        all axes, or a sequence with one entry per axis. Entries that are None are chosen by `criterion`. For products
        and poses an entry can be a tuple with one number per part.
    weights : array_like, shape (n_1, ..., n_D), optional
        Weights ≥ 0 of the nodes: the inverse variances of their noise up to a common factor. Nodes of weight 0 are
        missing.
    criterion : {"gcv", "cp"}, default "gcv"
        Criterion for λ: generalised cross-validation, or Mallows' C_p, which requires `sigma`.
    gamma : float, default 1.0
        Weight of a degree of freedom in ``"gcv"``, at least 1. A value of 1.2 is safer for grids of fewer than about
        100 nodes, where the surface occasionally passes through all data. On larger grids it smooths too much, and
        standard deviations are then too small.
    sigma : float or tuple, optional
        Standard deviation of the noise in one coordinate for weight one, as a length in the space: radians on the unit
        sphere. For products and poses a tuple with one number per part.
    bc_type : {"natural", "clamped", "periodic"} or sequence, default "natural"
        End conditions for all axes, or a sequence with one entry per axis, each of these or a pair for the start and
        the end. The last nodes along a periodic axis belong to the same points of the surface as the first ones. They
        can be further data, NaN, or copies of the first nodes, which count once.
    extrapolate, on_failure, atol : optional
        As for `GridSpline`.
    progress : callable, optional
        Function that is called after each pass over the grid with the finished and the total number of nodes.

    Returns
    -------
    SmoothingGrid
        A `GridSpline` through the smooth points, with λ, the noise level and standard deviations.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    CutLocusError
        If neighbouring points of the surface are at or past each other's cut locus.
    ConvergenceError
        If the smoothing of a row does not converge. The attribute ``spline`` holds the surface.

    Warns
    -----
    SmoothingWarning
        If a chosen λ is at a bound: the rows follow nearly all data, or have no bending energy. If many neighbouring
        nodes are far apart compared with the nodes beside them, as at the boundary of two grains.
    ConvergenceWarning
        If a row fails and `on_failure` is ``"warn"``.
    UserWarning
        If the data are about as far from the surface as random points of a compact space would be.

    See Also
    --------
    GridSpline : Interpolate points on a grid.
    make_smoothing_spline : Fit a curve close to noisy points.

    Notes
    -----
    Let :math:`K_k` be the matrix of the bending energy of the natural spline through the nodes of axis k. On a
    Euclidean space with equal weights w, the points at the nodes are

    .. math:: (1 + \lambda_1 K_1 / w)^{-1} \otimes (1 + \lambda_2 K_2 / w)^{-1} \otimes \dots

    times the data. The natural spline through them is the minimiser of a sum of squares and penalties. On other spaces
    the order of the axes matters, but little for smooth data.

    The criterion for λ is that of the surface: it contains the distances of all data from the surface, and the degrees
    of freedom of the surface. It is minimised along one axis after the other, in two rounds. In grids of more than
    20 000 nodes, rows with about this many nodes in total, which are distributed evenly, determine each λ.

    Missing nodes have weight zero. After the pass along an axis, the row fills the nodes between its first and its last
    datum. The weights of the next pass are the inverse variances that the nodes then have, in units of those in a
    complete row: filled nodes, and nodes beside gaps, count less. A row with a single datum keeps it.

    References
    ----------
    P. Craven, G. Wahba, Smoothing noisy data with spline functions, Numer. Math. 31 (1979).

    L. Xiao, Y. Li, D. Ruppert, Fast bivariate P-splines: the sandwich smoother, J. R. Stat. Soc. B 75 (2013).

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 30)
    >>> turns = np.stack(np.broadcast_arrays(np.sin(2 * u)[:, None], u[:, None] * v, v), axis=-1)
    >>> truth, space = ss.rotations.from_rotation_vectors(turns), ss.space("so:3")
    >>> noisy = space.exp(truth, 0.02 * space.random_tangent(np.random.default_rng(0), truth))
    >>> surface = ss.make_smoothing_grid((u, v), noisy, space)
    >>> bool(space.distance(surface.points, truth).max() < 0.02), round(surface.sigma, 2)
    (True, 0.02)
    """
    space = space_named(space)
    refuse_functions(space, "smoothing grids are not made")
    check_policies(extrapolate, on_failure, progress)
    chosen_by = one_of(criterion, "criterion", "gcv", "cp")
    if chosen_by == "cp" and sigma is None:
        raise ValidationError("criterion='cp' needs the standard deviation of the noise. Pass sigma.")
    gamma = checked_number(gamma, "gamma must be a number >= 1", lambda x: 1 <= x < np.inf)
    if not isinstance(axes, (tuple, list)):
        read_axes(axes, None, bc_type)
    data, tols, shape = read_nodes(points, space, len(axes))
    node_axes = _checked_ends(read_axes(axes, shape, bc_type))
    w = _read_weights(weights, shape)
    for array in data:
        array[w == 0] = np.nan
    # Noisy data at both ends of a periodic axis may differ.
    validate_nodes(
        space,
        data,
        tols if atol is None else [checked_atol(atol)] * len(tols),
        [axis._replace(ends=("natural", "natural")) for axis in node_axes],
    )
    w = _without_copies(np.where(factors_of(space)[0]._where_finite(data[0]), w, 0.0), data, node_axes)
    lams, sigmas = _lams(lam, len(shape), space), _in_parts(sigma, "sigma", space)

    bc_types = tuple(axis.bc_type for axis in node_axes)
    # Representatives in quotients are continuous over the grid, so that they are smoothed in the covering space.
    spaces = tuple(map(cover_of, smoothed_spaces(space)))
    arrays = [rows for pair in zip(factors_of(space), data, strict=True) for rows in split(*pair)]
    size, points_of_parts, smoothed, failed = int(np.prod(shape)), [], [], None
    for i, (part, array) in enumerate(zip(spaces, arrays, strict=True)):

        def advance(done: int, total: int, i: int = i) -> None:
            if progress is not None:
                progress((i * total + done) * size, len(spaces) * total * size)

        used = np.where((w > 0).reshape(*shape, *[1] * len(part.point_shape)), array, np.nan)
        nodes = Nodes(tuple(axis.knots for axis in node_axes), used, w, part, bc_types)
        rule = LamCriterion(1.0, sigmas[i]) if chosen_by == "cp" else LamCriterion(gamma, None)
        smooth_points, properties, first = smooth_axes(nodes, lams[i], rule, sigmas[i], advance)
        points_of_parts.append(smooth_points)
        smoothed.append(properties)
        failed = failed or first

    joined = list(map(join, factors_of(space), grouped(space, points_of_parts)))
    through: Any = tuple(joined) if isinstance(space, Product) else joined[0]
    options = {
        "bc_type": tuple(axis.bc_type for axis in node_axes),
        "extrapolate": extrapolate,
        "on_failure": on_failure,
    }
    surface: SmoothingGrid[P] = SmoothingGrid._through(tuple(axes), through, space, data, w, smoothed, options)
    if failed and on_failure != "ignore":
        _raise_or_warn(failed, surface, on_failure)
    _warn_of_bounds(space, smoothed, lams)
    warn_of_boundaries(list(zip(spaces, arrays, strict=True)), w)
    for part, array, points_of_part, one in zip(spaces, arrays, points_of_parts, smoothed, strict=True):
        rows = (points_of_part.reshape(-1, *part.point_shape), array.reshape(-1, *part.point_shape), np.ravel(w > 0))
        count = int(np.count_nonzero(rows[2] & part._where_finite(rows[0])))
        warn_of_spread(part, *rows, count, one.df, "surface")
    return surface


def _checked_ends(axes: list[GridAxis]) -> list[GridAxis]:
    for k, axis in enumerate(axes):
        if axis.ends is not None and "not-a-knot" in axis.ends:
            raise ValidationError(
                f"bc_type 'not-a-knot' of axis {k} is not available for smoothing grids. Use 'natural', 'clamped' or "
                "'periodic'."
            )
        if axis.is_periodic and len(axis.knots) < 4:
            raise ValidationError(f"axis {k} is periodic and needs at least 4 nodes, but has {len(axis.knots)}")
    return axes


def _read_weights(weights: Any, shape: tuple[int, ...]) -> Doubles:
    if weights is None:
        return np.ones(shape)
    array = as_array(weights, "weights")
    if array.shape != shape or array.dtype.kind not in "iufb":
        raise ValidationError(
            f"weights must be numbers of shape {shape}, one per node, not {array.dtype} of shape {array.shape}"
        )
    numbers = array.astype(np.float64)
    bad = ~(np.isfinite(numbers) & (numbers >= 0))
    refuse(bad, "weights", lambda i: f"is {numbers[i]}, but must be finite and >= 0. Use 0 for missing nodes.")
    return numbers


def _without_copies(weights: Doubles, data: list[Array], axes: list[GridAxis]) -> Doubles:
    """Return the weights without those of the last nodes of periodic axes that are copies of the first nodes."""
    for k, axis in enumerate(axes):
        if not axis.is_periodic:
            continue
        ends = [(np.take(rows, 0, axis=k), np.take(rows, -1, axis=k)) for rows in (*data, weights)]
        if all(np.array_equal(first, last, equal_nan=True) for first, last in ends):
            np.moveaxis(weights, k, 0)[-1] = 0.0
    if not np.any(weights):
        raise ValidationError("all weights are 0. A surface needs at least one node with data.")
    return weights


def _lams(lam: Any, dims: int, space: AnySpace) -> list[tuple[float | None, ...]]:
    """Return the given λ of every axis for each part of the space."""
    is_sequence = isinstance(lam, (tuple, list)) or (isinstance(lam, np.ndarray) and lam.ndim > 0)
    if is_sequence and len(lam) != dims:
        raise ValidationError(
            f"lam has {len(lam)} entries, but there are {dims} axes. Pass one number for all, or one entry for each."
        )
    of_axes = [_in_parts(one, f"lam[{k}]", space) for k, one in enumerate(lam)] if is_sequence else None
    per_axis = of_axes or [_in_parts(lam, "lam", space)] * dims
    return [tuple(None if np.isnan(x) else x for x in of_part) for of_part in zip(*per_axis, strict=True)]


def _in_parts(value: Numbers | None, name: str, space: AnySpace) -> list[float]:
    """Return a number >= 0 for each part of the space; NaN for None."""
    return [float(one[0]) for one in per_part(space, smoothed_spaces(space), value, name, ())]


def _raise_or_warn(first: tuple[int, ...], surface: SmoothingGrid[Any], on_failure: str) -> None:
    """Raise an error or warn about rows that did not converge; `first` is the axis and the index of the first one."""
    k, *others = first
    row = ", ".join(map(str, [*others[:k], ":", *others[k:]] if len(surface.axes) > 1 else [":"]))
    failed = sum(axis.failed for part in surface._smoothed for axis in part.axes)
    message = (
        f"No convergence of the smoothing along axis {k} in the row points[{row}]"
        + (f" (and in {failed - 1} more rows)" if failed > 1 else "")
        + ". Check units and signs of the data, or pass a larger lam."
    )
    if on_failure == "warn":
        warn(message, ConvergenceWarning)
        return
    error = ConvergenceError(message)
    error.spline = surface
    raise error


def _warn_of_bounds(space: AnySpace, smoothed: list[SmoothedPart], lams: list[tuple[float | None, ...]]) -> None:
    """Warn once if a chosen λ is at a bound, or close to it."""
    for i, (part, smoothed_part, given) in enumerate(zip(smoothed_spaces(space), smoothed, lams, strict=True)):
        for k, axis in enumerate(smoothed_part.axes):
            rough = axis.df > _ALL * axis.count
            if given[k] is not None or not axis.evaluations or not (axis.at_bound or rough):
                continue
            of = f" in part {i}, {part!r}," if is_several(space) else ""
            if rough:
                what = "a lam so small that rows follow nearly all nodes"
                advice = (
                    "The standard deviations are only valid if the data are that accurate. Correlated noise causes "
                    "this. Pass a larger gamma, sigma= with criterion='cp', or lam=."
                )
            else:
                what = "a lam so large that rows are geodesics"
                advice = (
                    "This is correct for data along geodesics. Otherwise the surface bends faster than the nodes "
                    "resolve, or less than their noise: plot the data, and pass lam= to set the smoothness."
                )
            warn(
                f"The smoothing{of} along axis {k} chose {what} ({axis.df:.3g} degrees of freedom for {axis.count} "
                f"nodes). {advice}",
                SmoothingWarning,
            )
            return


# ---- maps with boundaries, such as those between the grains of a crystal ----


def warn_of_boundaries(parts: list[tuple[AnySpace, Array]], weights: Doubles) -> None:
    """Warn once if many neighbouring nodes of a map are far apart compared with the nodes beside them.

    Parameters
    ----------
    parts : list
        Each space with its points, of shape (n_1, ..., n_D, *point_shape).
    weights : ndarray, shape (n_1, ..., n_D)
        Weights; nodes of weight zero do not count.
    """
    for space, points in parts:
        count, first = 0, None
        for k in range(weights.ndim):
            steps = _steps(space, points, weights, k)
            jumps = np.argwhere(_are_jumps(steps))
            count += len(jumps)
            if first is None and len(jumps):
                # Steps have their axis last.
                *others, i = jumps[0].tolist()
                nodes = [[*others[:k], j, *others[k:]] for j in (i, i + 1)]
                first = nodes, float(steps[tuple(jumps[0])]), float(np.nanmedian(steps))
        if first is None or count < _SHARE * weights.size ** (1 - 1 / weights.ndim):
            continue
        nodes, distance, usual = first
        warn(
            f"the map has a boundary that the smooth surface cannot follow: {count} pairs of neighbouring nodes are "
            f"far apart, for example points{nodes[0]} and points{nodes[1]}, whose distance is {distance:.2g}. The "
            f"median distance of neighbours is {usual:.2g}. If the map has regions such as grains, label them, and "
            "smooth each region with weights of zero at all other nodes.",
            SmoothingWarning,
        )
        return


def _steps(space: AnySpace, points: Array, weights: Doubles, k: int) -> Doubles:
    """Return the distances of neighbours along axis k, which becomes the last one; NaN where a node is missing."""
    axis = weights.ndim - 1
    there, rows = np.moveaxis(weights > 0, k, axis), np.moveaxis(points, k, axis)
    left, right = (np.take(rows, range(i, rows.shape[axis] - 1 + i), axis) for i in (0, 1))
    good = there[..., :-1] & there[..., 1:] & space._where_finite(left) & space._where_finite(right)
    steps = np.full(good.shape, np.nan)
    if good.any():
        steps[good] = space._apply("distance", p=left[good], q=right[good])
    return steps


def _are_jumps(steps: Doubles) -> NDArray[np.bool_]:
    """Return a mask of the steps that are much longer than the median step and than the steps next to them."""
    if steps.shape[-1] < 4 or not np.isfinite(steps).any():
        return np.zeros(steps.shape, bool)
    known = np.nan_to_num(steps, nan=0.0)
    # The first and the last step may be long because of an outlier at the end.
    beside = np.full(steps.shape, np.inf)
    beside[..., 1:-1] = np.maximum(known[..., :-2], known[..., 2:])
    return (known > _MEDIANS * np.nanmedian(steps)) & (known > _BESIDE * beside)

"""Smoothing of a grid, axis after axis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .._curves.ends import is_closed
from .._spaces import Array, Doubles, Space
from .common_lam import Choice, Data, LamCriterion, common_lam, score_of
from .rows import Rows, complete_variance, posterior_variance, smooth

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


class _State(NamedTuple):
    """Nodes after some axes were smoothed.

    Attributes
    ----------
    points : ndarray, shape (n_1, ..., n_D, *point_shape)
        Points; NaN where the weight is 0.
    weights : ndarray, shape (n_1, ..., n_D)
        Weights: inverse posterior variances in units of `scale`.
    scale : ndarray, shape (n_1, ..., n_D)
        Posterior variance of a node with weight one for noise of variance one. It is constant along the axes that were
        not smoothed.
    """

    points: Array
    weights: Doubles
    scale: Doubles


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
    start = _State(nodes.points, nodes.weights, np.ones(nodes.weights.shape))
    order = range(count)
    chosen = {k: Choice(lam, False, 0) for k, lam in enumerate(lams) if lam is not None}
    asked = [k for k in order if k not in chosen]
    again = asked if count > 1 else []
    done, total = 0, count * (1 + bool(asked) + len(again)) - len(again)

    state = start

    def passed(state: _State, k: int) -> tuple[_State, SmoothedAxis, tuple[int, ...] | None]:
        nonlocal done
        result = _smooth_axis(nodes, state, k, chosen[k])
        done += 1
        progress(done, total)
        return result

    def seen_from(state: _State, k: int) -> tuple[Rows, Data]:
        data = Data(_flat(nodes.points, nodes, k), _flat(nodes.weights, nodes, k), _flat(state.scale, nodes, k)[:, 0])
        return _rows(nodes, state, k), data

    def choose(state: _State, k: int) -> None:
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
    start: _State,
    given: dict[int, Choice],
    asked: list[int],
    score: Callable[[_State, int, float], float],
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

    def visit(state: _State, rest: list[int], lams: dict[int, float]) -> None:
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


def _rows(nodes: Nodes, state: _State, k: int) -> Rows:
    """Return the rows along axis k."""
    points, weights = (_flat(own, nodes, k) for own in (state.points, state.weights))
    return Rows(nodes.axes[k], points, weights, nodes.space, nodes.bc_types[k])


def _flat(array: Any, nodes: Nodes, k: int) -> Any:
    """Return the rows along axis k of an array with the axes of the grid."""
    last = len(nodes.axes) - 1
    moved = np.moveaxis(array, k, last)
    return np.ascontiguousarray(moved.reshape(-1, *moved.shape[last:]))


def _smooth_axis(
    nodes: Nodes, state: _State, k: int, choice: Choice
) -> tuple[_State, SmoothedAxis, tuple[int, ...] | None]:
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
    return _State(points, weights, state.scale * per_node.reshape(along)), own, first

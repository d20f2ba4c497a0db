"""The choice of one λ for all rows of a grid along one axis."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .._base.warnings import silenced
from .._spaces import Array, Doubles
from .make import make_smoothing_spline
from .rows import Rows, posterior_variance, smooth

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
    """Noisy data at the nodes of rows, of which other axes may be smooth already.

    Attributes
    ----------
    points : ndarray, shape (R, n, *point_shape)
        Data.
    weights : ndarray, shape (R, n)
        Their weights; 0 for missing nodes.
    scale : ndarray, shape (R,)
        Posterior variance of a point of the row with weight one.
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

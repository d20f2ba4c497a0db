"""Exact means and medians on circles of length 2π, in O(n log n)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

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
    found = objective(corners)
    best = int(np.argmin(found))
    corners, found = np.roll(corners, -best), np.roll(found, -best)
    slack = _EQUAL * (1 + found)
    # Minima without a barrier between them and the best one belong to it.
    barrier = np.minimum(np.maximum.accumulate(found), np.maximum.accumulate(found[::-1])[::-1])
    local = (np.roll(found, 1) >= found - slack) & (np.roll(found, -1) >= found - slack) & (barrier > found + slack)
    mean_square = circular_mean(v, w).objective
    return _minima(corners, found, local, standard_error(mean_square, w))


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

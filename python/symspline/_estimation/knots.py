"""Choose the knots of an estimate: as dense as the measurements require, and in gaps as dense as next to them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._base.time import TimeAxis
from .._smoothing.knots import places
from .._spaces import Array, Doubles
from .solve import Iteration, Setup, fitted
from .start import Start

# Initial number of equal intervals, and the largest number of times that they are bisected.
_FIRST, _ROUNDS = 12, 24
# The mean square of residuals in standard deviations may exceed one by this number plus three of its standard errors.
_SLACK = 0.1
# Times closer than this fraction of the mean distance of the knots are merged.
_CLOSE = 1e-6
# Intervals shorter than this multiple of the median time step of a sensor are not bisected.
_CLOSEST = 1.01
# Intervals without data are gaps if they are longer than this number of usual knot distances.
_GAP = 2.5
# Largest number of knots for which the residuals of the initial curve itself are computed.
_MOST = 200_000


def merged(times: Doubles, count: int) -> NDArray[np.intp]:
    """Return the indices of increasing times, omitting times too close to the one before for this number of knots."""
    least = _CLOSE * float(times[-1] - times[0]) / max(count, len(times))
    cells = np.floor((times - times[0]) / least) if least > 0 else np.arange(len(times))
    # Two times in neighbouring cells may also be close.
    apart = np.append(True, (np.diff(cells) > 0) & (np.diff(times) > least))
    apart[-1] = True
    index = np.flatnonzero(apart)
    if len(index) > 2 and times[index[-1]] - times[index[-2]] <= least:
        index = np.delete(index, -2)
    return index


def filled(knots: Doubles, data: Doubles) -> Doubles:
    """Add knots in the gaps of the data, as close together as next to the gap.

    The uncertainty grows within a gap. One cubic cannot represent this, so that bands would be too narrow.
    """
    h = np.diff(knots)
    # Longest distance without data within each interval.
    inner = np.unique(np.concatenate([knots, data]))
    widest = np.maximum.reduceat(np.diff(inner), np.searchsorted(inner, knots[:-1]))
    usual = float(np.median(h[widest <= 0.5 * h])) if np.any(widest <= 0.5 * h) else float(np.median(h))
    gaps = (widest > 0.5 * h) & (h > _GAP * usual)
    parts = np.where(gaps, np.ceil(h / usual), 1.0)
    # Gaps receive at most as many knots as the rest.
    more = parts.sum() - len(h)
    if more > len(h):
        parts = np.where(gaps, np.maximum(np.ceil(parts * len(h) / more), 2.0), 1.0)
    i, j = places(parts.astype(int))
    return np.append(knots[i] + h[i] * (j / parts[i]), knots[-1])


def graded(knots: Doubles) -> Doubles:
    """Add knots until the lengths of neighbouring intervals differ by at most a factor of two."""
    while True:
        h = np.diff(knots)
        long = h > 2.01 * np.minimum(np.append(np.inf, h[:-1]), np.append(h[1:], np.inf))
        if not long.any():
            return knots
        knots = bisected(knots, long)


def bisected(knots: Doubles, chosen: NDArray[np.bool_] | None = None) -> Doubles:
    """Add the midpoints of all intervals, or of the chosen ones."""
    middles = 0.5 * (knots[1:] + knots[:-1])
    return np.sort(np.concatenate([knots, middles if chosen is None else middles[chosen]]))


def shown_times(axis: TimeAxis, ends: Array, x: Doubles) -> Array:
    """Convert times of the core to the form passed by the user; the first and the last one are `ends`."""
    found: Array
    if axis.origin is not None and not axis.dates:
        # Large integers cannot be represented as floating-point numbers.
        found = axis.origin + np.rint(x).astype(np.int64)
    else:
        found = np.array(axis.shown(x, ()))
        found = found.astype(np.promote_types(found.dtype, ends.dtype))
    found[[0, -1]] = ends[[0, -1]]
    return found


def first_knots(begin: float, end: float) -> Doubles:
    """Return the knots with which the search for automatic knots begins."""
    return np.linspace(begin, end, _FIRST + 1)


def that_reproduce(setup: Setup, start: Start, data: Doubles) -> Doubles:
    """Return knots for which the spline through an initial curve has the same residuals as that curve.

    An interval is bisected if the mean square of the residuals of a sensor, over three intervals, exceeds one by more
    than three standard errors, and the residuals differ from those of the initial curve.

    Parameters
    ----------
    setup : Setup
        The problem, with the first knots.
    start : Start
        Initial curve.
    data : ndarray
        All times of the measurements, merged.
    """
    fine = np.unique(np.concatenate([setup.knots, data]))
    fine = fine[merged(fine, len(fine))]
    own = None if len(fine) > _MOST else residuals(setup._replace(knots=fine), start)
    knots = setup.knots
    values = {name: np.array(constant.start) for name, constant in setup.constants.items()} | start.values
    for _ in range(_ROUNDS):
        found = residuals(setup._replace(knots=knots), start)
        if found is None:
            bad = np.diff(knots) > 0
        else:
            bad = np.zeros(len(knots) - 1, bool)
            for k, (term, rows) in enumerate(zip(setup.terms, found, strict=True)):
                bad |= _exceeding(knots, term.shifted_times(values), rows, None if own is None else own[k])
        if not bad.any() or len(knots) > 2 * len(fine):
            break
        knots = bisected(knots, bad)
    return graded(knots)


def _exceeding(knots: Doubles, times: Doubles, rows: Doubles, own: Doubles | None) -> NDArray[np.bool_]:
    """Return the intervals in which residuals are larger than their noise and differ from those of the start."""
    i = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(knots) - 2)
    size = rows.shape[1]

    def three(weights: Doubles | None) -> Doubles:
        sums = np.bincount(i, weights, minlength=len(knots) - 1)
        return np.convolve(sums, np.ones(3), "same")

    count = three(None)
    squares = three(np.sum(rows**2, axis=1)) / np.maximum(size * count, 1)
    large = squares > 1 + _SLACK + 3 * np.sqrt(2 / np.maximum(size * count, 1))
    if own is not None:
        apart = three(np.sum((rows - own) ** 2, axis=1)) / np.maximum(size * count, 1)
        # More knots would not reduce residuals that the initial curve has as well.
        large &= apart > _SLACK
    # At most about one knot per sample, by the median time step because some samples may be very close together.
    steps = np.diff(np.unique(times))
    least = _CLOSEST * float(np.median(steps)) if len(steps) else np.inf
    return np.asarray(large & (np.bincount(i, minlength=len(knots) - 1) > 1) & (np.diff(knots) > least))


def residuals(setup: Setup, start: Start) -> list[Doubles] | None:
    """Return the residuals of all terms for the spline through an initial curve; None if it does not exist."""
    points = start.points(setup.knots)
    curves = fitted(setup, points)
    if curves is None:
        return None
    at = Iteration(setup, points, None, start.values)
    at.curves = curves
    found = []
    for term in setup.terms:
        x = np.clip(term.shifted_times(at.values), setup.knots[0], setup.knots[-1])
        found.append(term.measure(at.motion_at(x, term.parts, term.nu), at.values) / term.noise)
    return found

"""The knots of an estimate: as dense as the measurements show, and in gaps as dense as beside them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._smoothing.knots import places
from .._spaces import Array, Doubles
from .._time import TimeAxis
from .solve import Iteration, Setup, fitted
from .start import Start

# The first number of equal intervals, and how often they are bisected at most.
_FIRST, _ROUNDS = 12, 24
# The mean square of residuals in standard deviations may exceed one by this and by three standard deviations of it.
_SLACK = 0.1
# Times closer than this fraction of the mean distance of the knots are one.
_CLOSE = 1e-6
# Intervals of this fraction of the usual distance of the times of a sensor are not bisected.
_CLOSEST = 1.01
# Gaps without data are longer than this number of usual distances of the knots.
_GAP = 2.5
# Largest number of knots at which the start itself is compared with the sensors.
_MOST = 200_000


def merged(times: Doubles, count: int) -> NDArray[np.intp]:
    """Return the indices of increasing times without those that follow another one closely, for a number of knots."""
    least = _CLOSE * float(times[-1] - times[0]) / max(count, len(times))
    cells = np.floor((times - times[0]) / least) if least > 0 else np.arange(len(times))
    # Two times of neighbouring cells may be close, too.
    apart = np.append(True, (np.diff(cells) > 0) & (np.diff(times) > least))
    apart[-1] = True
    index = np.flatnonzero(apart)
    if len(index) > 2 and times[index[-1]] - times[index[-2]] <= least:
        index = np.delete(index, -2)
    return index


def filled(knots: Doubles, data: Doubles) -> Doubles:
    """Return knots with others in the gaps of the data, where they are as close together as beside the gap.

    The uncertainty grows within a gap. One cubic cannot represent that, so that bands would be too narrow.
    """
    h = np.diff(knots)
    # The longest distance of data between two knots.
    inner = np.unique(np.concatenate([knots, data]))
    widest = np.maximum.reduceat(np.diff(inner), np.searchsorted(inner, knots[:-1]))
    usual = float(np.median(h[widest <= 0.5 * h])) if np.any(widest <= 0.5 * h) else float(np.median(h))
    gaps = (widest > 0.5 * h) & (h > _GAP * usual)
    parts = np.where(gaps, np.ceil(h / usual), 1.0)
    # Gaps do not take more knots than the data.
    more = parts.sum() - len(h)
    if more > len(h):
        parts = np.where(gaps, np.maximum(np.ceil(parts * len(h) / more), 2.0), 1.0)
    i, j = places(parts.astype(int))
    return np.append(knots[i] + h[i] * (j / parts[i]), knots[-1])


def graded(knots: Doubles) -> Doubles:
    """Return knots with others between them, so that neighbouring distances differ by at most a factor of two."""
    while True:
        h = np.diff(knots)
        long = h > 2.01 * np.minimum(np.append(np.inf, h[:-1]), np.append(h[1:], np.inf))
        if not long.any():
            return knots
        knots = bisected(knots, long)


def bisected(knots: Doubles, chosen: NDArray[np.bool_] | None = None) -> Doubles:
    """Return knots with the middles of all intervals, or of chosen ones."""
    middles = 0.5 * (knots[1:] + knots[:-1])
    return np.sort(np.concatenate([knots, middles if chosen is None else middles[chosen]]))


def shown_times(axis: TimeAxis, ends: Array, x: Doubles) -> Array:
    """Return times of the core as the user sees them, from the first to the last of two times."""
    found: Array
    if axis.origin is not None and not axis.dates:
        # Large whole numbers, which floating-point numbers do not represent.
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
    """Return knots with which the spline through an initial curve has the residuals of that curve.

    Intervals are bisected in which the mean square of the residuals of a sensor, taken over three intervals, exceeds
    one by more than three of its standard deviations, and in which it differs from that of the initial curve.

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
        # Residuals that the initial curve has as well do not ask for more knots.
        large &= apart > _SLACK
    # Not more than about one knot per sample. Some samples may be very close together.
    steps = np.diff(np.unique(times))
    least = _CLOSEST * float(np.median(steps)) if len(steps) else np.inf
    return np.asarray(large & (np.bincount(i, minlength=len(knots) - 1) > 1) & (np.diff(knots) > least))


def residuals(setup: Setup, start: Start) -> list[Doubles] | None:
    """Return the residuals of all terms for the spline through an initial curve, or None if there is no spline."""
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

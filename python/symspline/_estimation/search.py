"""The search for an estimate: try initial curves and knots, and keep the best result."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.exceptions import ConvergenceError, SymsplineError
from .._base.faults import warn
from .._base.time import TimeAxis
from .._base.typing import Progress
from .._core import ValidationError
from .._smoothing import SmoothingWarning
from .._smoothing.knots import places
from .._spaces import Array, Doubles, Space
from ..measure import Points
from .solve import Setup, Solution, iterate, residuals
from .start import Start, starts
from .terms import PointTerm, RateTerm

# A sensor contradicts a curve if the mean square of its residuals exceeds the first number by more than the second
# number of standard errors.
_LARGE, _DEVIATIONS = 1.5, 4.0
# Knots are divided again if the residuals exceed their standard deviations by this factor and more knots may help.
_MISSES = 1.2
# Two results are equally good if their losses differ by less than the first number. They are different if they are
# farther apart than the second number of standard deviations.
_EQUAL, _APART = 10.0, 5.0
# Points move by more than this number of standard deviations if there are too few knots.
_MOVED = 0.5
# Largest number of times that all intervals are divided, and that this is repeated without an effect.
_HALVINGS, _IN_VAIN = 14, 2
# With fewer knots per datum than this, the motion may be so fast that dividing intervals has no effect at first.
_FEW = 0.1
_UNCONFIRMED = (
    "The automatic knots may be too few: the residuals are larger than the given standard deviations, and with twice "
    "as many knots the estimate does not converge. Check sigma, and pass knots."
)
# Intervals of given knots are gaps if they are longer than this number of median intervals.
_LONG = 5.0
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


class Starts:
    """Initial curves in decreasing order of promise, computed on demand and stored."""

    def __init__(self, setup: Setup, space: Space[Any], axis: TimeAxis, start: Any) -> None:
        self._coming = starts(setup, space, axis, start)
        self._known: list[Start] = []

    def __getitem__(self, number: int) -> Start:
        """Return the initial curve with this number; raise IndexError if there are fewer."""
        while len(self._known) <= number:
            following = next(self._coming, None)
            if following is None:
                raise IndexError(number)
            self._known.append(following)
        return self._known[number]


class Search(NamedTuple):
    """The best result of several initial curves.

    Attributes
    ----------
    found : Solution
        The best result.
    rival : float
        Distance in standard deviations to another result that is equally good, or 0.
    place : int
        Index of the knot at which that result is farthest away.
    """

    found: Solution
    rival: float = 0.0
    place: int = 0

    def warn_of_rival(self, shown: Array) -> None:
        """Warn if another curve is equally good."""
        if self.rival:
            warn(
                "Two different curves agree equally well with the measurements. The other one is up to "
                f"{self.rival:.2g} standard deviations away, at t = {shown[self.place]}. To decide between them, pass "
                "`start`, a Constant with sigma, or further measurements.",
                SmoothingWarning,
            )


def solved(setup: Setup, begin: Starts, progress: Progress | None) -> Search:
    """Iterate from the first initial curve, and from further ones while a sensor contradicts the best result."""
    best: Solution | None = None
    refused: SymsplineError | None = None
    rival, place = 0.0, 0
    number = 0
    while best is None or best.failure or _contradicts(setup, best):
        try:
            start = begin[number]
        except IndexError:
            break
        number += 1
        try:
            found = iterate(setup, start.points(setup.knots), start.values, progress)
        except (ValidationError, ConvergenceError) as error:
            refused = refused or error
            continue
        if best is None:
            best = found
        elif not found.failure:
            better = bool(best.failure) or found.loss < best.loss
            if not best.failure and abs(found.loss - best.loss) < _EQUAL:
                apart, at = _distance(setup, found, best)
                if apart > _APART:
                    rival, place = apart, at
            else:
                rival = 0.0 if better else rival
            best = found if better else best
    if best is None:
        assert refused is not None
        raise refused
    return Search(best, rival, place)


def _contradicts(setup: Setup, found: Solution) -> bool:
    """Whether the residuals of a sensor are larger than its noise."""
    for term, own in zip(setup.terms, found.rows, strict=True):
        rows = own.residuals
        squares = np.sum(rows**2, axis=1)
        size = rows.shape[1]
        if term.loss == "linear":
            if squares.mean() / size > _LARGE + _DEVIATIONS * np.sqrt(2 / rows.size):
                return True
        elif np.median(squares) > (_LARGE + _DEVIATIONS * np.sqrt(4 / rows.size)) * _core.chi_squared(size, 0.5):
            return True
    return False


def _distance(setup: Setup, one: Solution, other: Solution) -> tuple[float, int]:
    """Return the largest distance of two results at the knots in standard deviations, and where it is."""
    squares = np.zeros(len(setup.knots))
    for space, p, q in zip(setup.spaces, one.points, other.points, strict=True):
        squares += space._apply("distance", p=p, q=q) ** 2
    apart = np.sqrt(squares / one.variances.sum(axis=1))
    at = int(np.argmax(apart))
    return float(apart[at]), at


def automatic(
    setup: Setup, begin: Starts, axis: TimeAxis, ends: Array, data: Doubles, progress: Progress | None
) -> tuple[Array, Setup, Search]:
    """Choose the knots, and estimate.

    The first knots reproduce the initial curve. All intervals are then divided until no point moves by more than half
    of its standard deviation and the residuals do not decrease.
    """

    def with_knots(knots: Doubles) -> tuple[Array, Setup]:
        shown = shown_times(axis, ends, knots)
        times = axis.knots(shown)
        later = np.append(True, np.diff(times) > 0)
        later[-1] = True
        return shown[later], setup._replace(knots=times[later])

    knots = filled(that_reproduce(setup, begin[0], data), data)
    most = 2 * len(data) + len(setup.knots)
    shown, now = with_knots(knots)
    before: tuple[Array, Setup, Search] | None = None
    in_vain = 0
    for _ in range(_HALVINGS):
        refused: SymsplineError | None = None
        try:
            search = solved(now, begin, progress)
        except (ValidationError, ConvergenceError) as error:
            refused = error
        if refused or search.found.failure:
            # With more knots the numerical problem may become too difficult. The last result then remains.
            if before is not None:
                if _misses(before[2].found):
                    warn(_UNCONFIRMED, SmoothingWarning)
                return before
            if len(now.knots) > most:
                break
        else:
            if before is not None:
                sigma, last = (float(own.found.reports[0].sigma) for own in (search, before[2]))
                at_bound = any(bool(own.at_bound) for own in search.found.reports)
                few = at_bound or len(now.knots) < _FEW * len(data)
                in_vain = 0 if sigma < 0.95 * last or few else in_vain + 1
                misses = _misses(search.found) and in_vain < _IN_VAIN
                if not misses and _moved(before[1], before[2].found, now, search.found) <= _MOVED:
                    break
            if len(now.knots) > most:
                break
            before = (shown, now, search)
        shown, now = with_knots(bisected(now.knots))
    if refused:
        raise refused
    return shown, now, search


def _misses(found: Solution) -> bool:
    """Whether the residuals are so large that more knots may be needed."""
    return float(found.reports[0].sigma) > _MISSES


def _moved(coarse: Setup, before: Solution, fine: Setup, found: Solution) -> float:
    """Return the largest distance of the curve with fewer knots, in standard deviations."""
    x = np.clip(fine.knots, coarse.knots[0], coarse.knots[-1])
    # The distances are the lengths of the residuals of points.
    each = enumerate(zip(fine.spaces, found.points, strict=True))
    points: list[Any] = [
        PointTerm("", Points(x, y, sigma=1.0), x, part, space, y, np.ones((len(x), space.dim)))
        for part, (space, y) in each
    ]
    apart = residuals(coarse._replace(terms=points), before.points, before.values)
    if apart is None:
        return float("inf")
    squares = sum((rows**2).sum(axis=1) for rows in apart)
    return float(np.sqrt(np.max(squares / found.variances.sum(axis=1))))


# ---- knots as dense as the measurements require, and in gaps as dense as next to them ----


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
    own = None if len(fine) > _MOST else residuals(setup._replace(knots=fine), start.points(fine), start.values)
    knots = setup.knots
    values = {name: np.array(constant.start) for name, constant in setup.constants.items()} | start.values
    for _ in range(_ROUNDS):
        found = residuals(setup._replace(knots=knots), start.points(knots), start.values)
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


# ---- warnings about knots ----


def warn_of_gaps(shown: Array, knots: Doubles, data: Doubles) -> None:
    """Warn if a gap in the data contains no given knots."""
    h = np.diff(knots)
    if len(h) < 4 or not len(data):
        return
    within = np.searchsorted(data, knots[1:], side="left") - np.searchsorted(data, knots[:-1], side="right")
    long = (h > _LONG * np.median(h)) & (within == 0)
    long &= (data[0] < knots[1:]) & (data[-1] > knots[:-1])
    if long.any():
        i = int(np.argmax(np.where(long, h, 0)))
        warn(
            f"There are no data and no knots between knots[{i}] = {shown[i]} and knots[{i + 1}] = {shown[i + 1]}. The "
            "curve is a single cubic there, and its bands are too narrow. Add knots in this gap, as close together as "
            "next to it, or pass the number of knots.",
            SmoothingWarning,
        )


def warn_of_turns(setup: Setup, shown: Array) -> None:
    """Warn if measured rates turn a body by more than half a turn between two knots."""
    for term in setup.terms:
        if not isinstance(term, RateTerm) or not term.body.is_rotation:
            continue
        order = np.argsort(term.times, kind="stable")
        t, omega = term.times[order], term.omega[order]
        angles = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * np.diff(t)[:, None] * (omega[1:] + omega[:-1]), 0)])
        # The norm of the integrated rates is a lower bound of the turn, and hardly affected by noise.
        at = np.stack([np.interp(setup.knots, t, row) for row in angles.T], axis=-1)
        turns = np.linalg.norm(np.diff(at, axis=0), axis=1)
        i = int(np.argmax(turns))
        if turns[i] > np.pi:
            warn(
                f"{term.label} turns the body by {np.degrees(turns[i]):.0f}° between knots[{i}] = {shown[i]} and "
                f"knots[{i + 1}] = {shown[i + 1]}. The curve has at most half a turn between two knots. Pass more "
                "knots, or knots='auto', and check the unit of the rates.",
                SmoothingWarning,
            )
            return

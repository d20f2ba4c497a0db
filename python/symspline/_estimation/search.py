"""The search for an estimate: try initial curves and knots, and keep the best result."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .. import _core
from .._base.exceptions import ConvergenceError, SymsplineError
from .._base.time import TimeAxis
from .._base.typing import Progress
from .._base.warnings import warn
from .._core import ValidationError
from .._smoothing import SmoothingWarning
from .._spaces import Array, Doubles, Space
from .knots import bisected, filled, shown_times, that_reproduce
from .solve import Iteration, Setup, Solution, fitted
from .start import Start, starts
from .terms import RateTerm

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
_GAP = 5.0


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


def _run(setup: Setup, start: Start, progress: Progress | None) -> Solution:
    """Iterate from an initial curve."""
    try:
        return Iteration(setup, start.points(setup.knots), progress, start.values).run()
    except np.linalg.LinAlgError as error:
        raise ConvergenceError(
            f"The linear problem could not be solved ({error}). Check sigma and the units of the measurements, or pass "
            "fewer knots."
        ) from error


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
            found = _run(setup, start, progress)
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
    for term, loss in zip(found.linearised, setup.losses, strict=True):
        rows = term.residuals
        squares = np.sum(rows**2, axis=1)
        size = rows.shape[1]
        if loss == "linear":
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
    curves = fitted(coarse, before.points)
    if curves is None:
        return float("inf")
    squares = np.zeros(len(fine.knots))
    x = np.clip(fine.knots, coarse.knots[0], coarse.knots[-1])
    for space, curve, q in zip(fine.spaces, curves, found.points, strict=True):
        p = curve.evaluate(x, "point", "raise", False)
        squares += space._apply("distance", p=p, q=q) ** 2
    return float(np.sqrt(np.max(squares / found.variances.sum(axis=1))))


# ---- warnings about knots ----


def warn_of_gaps(shown: Array, knots: Doubles, data: Doubles) -> None:
    """Warn if a gap in the data contains no given knots."""
    h = np.diff(knots)
    if len(h) < 4 or not len(data):
        return
    within = np.searchsorted(data, knots[1:], side="left") - np.searchsorted(data, knots[:-1], side="right")
    long = (h > _GAP * np.median(h)) & (within == 0)
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

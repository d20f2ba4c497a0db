"""Test whether the smoothness of a motion and its noise are constant along a curve, as one λ and one σ assume."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .. import _core
from .._base.arrays import short_repr
from .._base.faults import of_index
from .._base.warnings import warn
from .._curves.curve import CurveArrays
from .._spaces import Array, Doubles, Space, factors_of
from .data import SmoothingData
from .factors import grouped, is_several
from .solve import Smoothed
from .warned import SmoothingWarning

# Smallest number of data, and of degrees of freedom of the curve and of the residuals per coordinate, for the tests.
_DATA, _FREEDOM = 100, 13
# Least number of local degrees of freedom of a bin.
_BIN = 6.0
# Scores beyond which a test fails, in standard deviations of a normal distribution. The levels are empirical, because
# motions are not samples of the prior process: in 700 recordings of constant smoothness (sums of five sines and
# Matérn-like processes, 200 to 1000 data), no score exceeded 5.1 and 2.9. Sums of three sines that beat on S² and SO(3)
# reached 9.1, but these are excluded by the limit of the ratio below.
_SMOOTHNESS, _NOISE = 7.0, 4.5
# Least energy per degree of freedom in the fast part, relative to the whole curve. Waves that beat reach 2.2.
_FASTER = 4.0


class Finding(NamedTuple):
    """A test that failed: its score divided by the limit, and the message."""

    score: float
    message: str


class Recording(NamedTuple):
    """One curve in one space with its data of nonzero weight.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Times of the data in the form passed by the user.
    times, weights, squares : ndarray, shape (n,)
        The same times in the units of the core, weights, and squared distances from the curve.
    at, energy : ndarray, shape (k,)
        Knots in the units of the core, and the squared acceleration integrated up to each knot.
    leverage : ndarray, shape (n,)
        Posterior variances at the data, for noise of variance one.
    m : int
        Number of coordinates.
    """

    t: Array
    times: Doubles
    weights: Doubles
    squares: Doubles
    at: Doubles
    energy: Doubles
    leverage: Doubles
    m: int


def findings(recording: Recording, robust: bool = False) -> list[Finding]:
    """Return the tests that failed, in decreasing order of their scores. Robust losses have no test of the noise."""
    h = recording.weights * recording.leverage
    df, squares = float(h.sum()), recording.weights * recording.squares
    left = len(h) - df
    if len(h) < _DATA or min(df, left) < _FREEDOM or not np.isfinite(squares).all() or squares.sum() == 0:
        return []
    smoothness, noise = _core.unequal_bins(
        recording.times, h, squares, recording.at, recording.energy, recording.m, _BIN
    )
    found = []
    score, place, ratio = smoothness
    if score > _SMOOTHNESS and ratio > _FASTER:
        faster = _interval(recording.t, place)
        # A robust loss may have selected a run of outliers.
        remedy = (
            ", or the curve follows outliers. Plot the data, and pass weights of 0 for outliers. If there are none, "
            "fit this part and the others separately"
            if robust
            else ". The curve is too smooth there, and follows the noise elsewhere. Fit this part and the others "
            "separately, or pass a smaller lam"
        )
        found.append(
            Finding(
                score / _SMOOTHNESS,
                f"the motion is faster between t = {faster} than one lam for the whole recording allows{remedy}",
            )
        )
    score, place, _ = noise
    if score > _NOISE and not robust:
        noisier = _interval(recording.t, place)
        found.append(
            Finding(
                score / _NOISE,
                f"the residuals are larger between t = {noisier} than elsewhere: the noise is larger there, or the "
                "curve does not follow the motion. Pass weights= with the inverse variances of the data, loss='huber' "
                "if only some data are worse, or a smaller lam",
            )
        )
    return sorted(found, reverse=True)


def _interval(t: Array, place: list[int]) -> str:
    first, last = place
    return f"{short_repr(t[first])} and {short_repr(t[last])}"


def warn_of_varying(
    space: Space[Any],
    curve: CurveArrays,
    at_data: list[Array],
    noisy: SmoothingData,
    smoothed: list[Smoothed],
    chosen: list[Any],
    kinds: Any,
    robust: bool,
) -> None:
    """Warn once if the motion or its noise varies along a curve whose λ was chosen.

    Parameters
    ----------
    curve : CurveArrays
        The curves.
    at_data : list of ndarray
        Their points at the data, in every space in which data were smoothed.
    noisy : SmoothingData
        The data.
    smoothed : list of Smoothed
        Results in every space in which data were smoothed.
    chosen : list of ndarray of bool
        Whether λ was chosen from the data, for each curve.
    kinds : list of str or None
        Kinds of the ends.
    robust : bool
        Whether the loss is robust.
    """
    if noisy.times.shape[-1] < _DATA:
        return
    numbers = iter(range(len(smoothed)))
    of_factors = zip(factors_of(space), curve.parts, noisy.points, grouped(space, smoothed), strict=True)
    for factor, part, points, own in of_factors:
        number, *more = (next(numbers) for _ in own)
        # The acceleration of a pose is not that of its rotation and position.
        if more or noisy.precisions[number].information is not None:
            continue
        report = own[0].report
        good = np.asarray(report.converged) & ~np.asarray(report.at_bound) & (np.asarray(report.df) > _FREEDOM)
        failed: list[tuple[tuple[int, ...], Finding]] = []
        for index in map(tuple, np.argwhere(good & np.reshape(chosen[number], good.shape)).tolist()):
            alone = part.take_batch(index) if index else part
            pairs = at_data[number][index], points[index]
            found = findings(_recording(factor, alone, pairs, noisy, number, own[0], index, kinds), robust)
            failed += [(index, found[0])] if found else []
        if failed:
            index, first = failed[0]
            of = of_index(index) + (f" in factor {number}, {factor!r}" if is_several(space) else "")
            others = f" (and of curves {', '.join(str(list(i))[1:-1] for i, _ in failed[1:9])})" if failed[1:] else ""
            warn(f"In the data{of}{others}, {first.message}.", SmoothingWarning, index)
            return


def _recording(
    space: Space[Any],
    curve: Any,
    pairs: tuple[Array, Array],
    noisy: SmoothingData,
    number: int,
    smoothed: Smoothed,
    index: tuple[int, ...],
    kinds: Any,
) -> Recording:
    t, times, weights = (
        x[index] if x.ndim > 1 else x for x in (noisy.t, noisy.times, noisy.precisions[number].weights)
    )
    used = weights > 0
    t, times, weights, at, points = t[used], np.ascontiguousarray(times[used]), weights[used], *(x[used] for x in pairs)
    knots = np.ascontiguousarray(curve.times)
    # The acceleration is nearly linear between knots.
    middle = 0.5 * (knots[1:] + knots[:-1])
    energy = np.diff(knots) * curve.evaluate(middle, "bend", "raise", False) ** 2
    leverage = _core.smoothing_variance(knots, np.ascontiguousarray(smoothed.band[index]), 0.0, times, 0, kinds)
    squares = space._apply("distance", p=at, q=points) ** 2
    return Recording(t, times, weights, squares, knots, np.append(0.0, np.cumsum(energy)), leverage, space.dim)

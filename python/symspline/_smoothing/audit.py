"""Warnings about fits that cannot be trusted: residuals, outliers, the choice of λ, other minima, varying motion."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.arrays import short_repr
from .._base.faults import is_silent, of_index, warn
from .._base.typing import Number
from .._curves.curve import CurveArrays
from .._curves.ends import end_kinds
from .._spaces import AnySpace, Array, Doubles, Space, SpecialEuclidean
from .noise import Part, SmoothingData, distances_of, in_part, is_several, smoothed_spaces, split
from .report import SmoothingReport, SmoothingWarning
from .solve import FAST, NOISY, TWO, UNIQUE, SmoothCurves, SmoothedSpline

# Quantiles of χ² at which the losses begin to grow more slowly, as in `loss.rs`.
_CORNERS = {"huber": 0.82, "cauchy": 0.95}
# Eigenvalues of a root of an information matrix below this relative size are rounding errors.
_NOTHING = 1e-6
# Autocorrelations above this are not caused by a wrong σ.
_SMOOTH = 0.3
# Ratios of common units, and the largest difference of a logarithm of a ratio from theirs.
DEGREES, _UNITS, _NEAR = 180 / np.pi, {1e3: "1000, the ratio of m and mm, or of s and ms"}, 0.15
# Kinds of selections by a robust loss that cannot be trusted, as numbered in `Selection` of the core.
_INTERPOLATED, _UNSETTLED, _PULLED = 1, 2, 4
# Ratio of the degrees of freedom to the number of data from which a curve follows nearly all data.
_ALL = 0.9
# Smallest number of data, and of degrees of freedom, for the tests of a varying motion, as in `audit.rs`.
_DATA, _FREEDOM = 100, 13
# Scores beyond which these tests fail, in standard deviations of a normal distribution. The levels are empirical,
# because motions are not samples of the prior process: in 700 recordings of constant smoothness (sums of five sines and
# Matérn-like processes, 200 to 1000 data), no score exceeded 5.1 and 2.9. Sums of three sines that beat on S² and SO(3)
# reached 9.1, but these are excluded by the limit of the ratio below.
_SMOOTHNESS, _NOISE = 7.0, 4.5
# Least energy per degree of freedom in the fast part, relative to the whole curve. Waves that beat reach 2.2.
_FASTER = 4.0
# Limit of the ratio of squared distances. The ratio is below it where smoothing still recovers the curve, as with noise
# of half a radian on S², SO(3) or RP². It is above it for random points, unless the curve follows them.
_FAR = 0.5
# Number of data of a curve that are enough for the check.
_SAMPLE = 1000


class Fitted(NamedTuple):
    """The fit in one of the spaces in which data are smoothed. Arrays with one value per curve have the batch axes.

    Attributes
    ----------
    part : Part
        Data.
    result : SmoothCurves
        Smooth curves.
    report : SmoothingReport
        Their report.
    curve : CurveArrays
        The curves in the factor of the space to which the part belongs.
    at : ndarray, shape (..., N, *point_shape)
        Points of the curves at the times of the data.
    converged : ndarray of bool
        Whether the curves converged.
    chosen, given : ndarray of bool
        Whether λ was chosen from the data, and whether σ is given.
    """

    part: Part
    result: SmoothCurves
    report: SmoothingReport
    curve: CurveArrays
    at: Array
    converged: NDArray[np.bool_]
    chosen: NDArray[np.bool_]
    given: NDArray[np.bool_]


def audit(
    spline: SmoothedSpline,
    parts: list[Part],
    results: list[SmoothCurves],
    good: NDArray[np.bool_],
    choices: NDArray[np.bool_],
) -> None:
    """Issue at most one warning of each kind about smoothing splines.

    Parameters
    ----------
    spline : SmoothingSpline
        The splines.
    parts, results : list
        Data and results in every space in which data were smoothed, with the batch axes.
    good : ndarray of bool
        Which curves are not masked.
    choices : ndarray of bool
        Which curves have a λ to choose.
    """
    space, noisy, batch = spline._curve.space, spline._noisy, spline._noisy.batch
    at_data: list[tuple[CurveArrays, Array]] = []
    for curve in spline._curve.parts:
        for rows in split(curve.space, curve.evaluate(noisy.times, "point", "raise", noisy.times.ndim > 1)):
            at_data.append((curve, rows))
    fits, reports, trusted, counts, selected, unique = [], [], [], [], True, True
    for part, result, (curve, rows) in zip(parts, results, at_data, strict=True):
        report = result.smoothed.report
        converged = np.asarray(report.converged)
        chosen = np.isnan(part.lam).reshape(batch) & choices
        given = np.isfinite(part.noise.sigma).reshape(batch) & good
        fits.append(Fitted(part, result, report, curve, rows, converged, chosen, given))
        reports.append(report)
        selected &= not result.selection.any()
        unique &= not result.minima.any()
        trusted.append(chosen & (result.selection == 0) & (result.minima == UNIQUE))
        counts.append(np.sum(part.noise.weights > 0, axis=-1))
    if not selected:
        _warn_of_outliers(space, fits, counts)
    if not unique:
        _warn_of_minima(space, fits)
    warn_of_bounds(space, reports, trusted, counts)
    _warn_of_adaptation(space, noisy, fits)
    if not is_silent(SmoothingWarning):
        _warn_of_residuals(space, noisy, fits)
        if fits[0].result.smoothed.penalty == "acceleration" and noisy.times.shape[-1] >= _DATA:
            _warn_of_varying(space, noisy, spline, fits)
    _warn_of_spreads(noisy, fits)


def _first(space: Space, affected: list[NDArray[np.bool_]], mark: str = "") -> tuple[int, tuple[int, ...], str] | None:
    """Return the first of the affected curves: its part, its index, and words that name it and count the others."""
    counts = [int(np.count_nonzero(curves)) for curves in affected]
    if not any(counts):
        return None
    number = counts.index(next(filter(None, counts)))
    index = tuple(map(int, np.argwhere(affected[number])[0]))
    more = f" (and {sum(counts) - 1} more)" if sum(counts) > 1 else ""
    return number, index, of_index(index) + in_part(space, number, mark) + more


# ---- data that a robust loss rejects ----


def _warn_of_outliers(space: Space, fits: list[Fitted], counts: list[Array]) -> None:
    """Warn if the data that were rejected from a curve may be the wrong ones."""
    # Data without noise, such as those of a body at rest, contain no outliers.
    bad = [
        (fit.result.selection != 0) & fit.converged & ((fit.result.rejected != 0) | (np.asarray(fit.report.sigma) > 0))
        for fit in fits
    ]
    if not (first := _first(space, bad)):
        return
    number, index, of = first
    fit = fits[number]
    kind, rejected = int(fit.result.selection[index]), int(fit.result.rejected[index])
    df = float(np.asarray(fit.report.df)[index])
    count = int(np.broadcast_to(counts[number], bad[number].shape)[index])
    what = f"The smoothing{of} with loss={fit.part.noise.loss!r}"
    if kind == _INTERPOLATED:
        message = (
            f"{what} follows nearly all data ({df:.3g} degrees of freedom for {count} data): their noise is smaller "
            f"than their sampling can show. It rejected {rejected} data that deviate far more than others, and cannot "
            "find smaller outliers. Its standard deviations are only valid if the data are that accurate. Pass sigma= "
            "to find smaller outliers, or sample more often."
        )
    elif kind == _UNSETTLED:
        message = (
            f"{what} could not determine which data are outliers: the selection alternates between two sets of data. "
            f"The last one rejects {rejected} of {count} data. Plot the residuals, and pass sigma=, or weights of 0 "
            "for the wrong data."
        )
    elif kind == _PULLED:
        message = (
            f"{what} has an outlier that moves the curve by more than five standard deviations, because there are no "
            "other data near it. Pass loss='cauchy', or weights of 0 for outliers in gaps."
        )
    else:
        message = (
            f"{what} rejects many data: {rejected} of {count} data are far from the curve. If these are not outliers, "
            "the noise varies along the recording, or the data belong to several curves. Plot the residuals, and pass "
            "sigma= or weights=."
        )
    warn(message, SmoothingWarning, index)


# ---- other minima ----


def _warn_of_minima(space: Space, fits: list[Fitted]) -> None:
    """Warn if a curve may not be the one with the least objective."""
    if first := _first(space, [(fit.result.minima != UNIQUE) & fit.converged for fit in fits], ","):
        number, index, of = first
        noise = f"{float(np.asarray(fits[number].report.sigma)[index]):.2g}"
        message = _MINIMA[int(fits[number].result.minima[index])]
        warn(message.format(of=of, noise=noise, space=smoothed_spaces(space)[number]), SmoothingWarning, index)


_MINIMA = {
    TWO: (
        "Two curves fit the data{of} nearly equally well (noise {noise}): they go around {space!r} in different ways. "
        "The better one was returned. Plot it, and sample more often, or pass weights of 0 for wrong data."
    ),
    NOISY: (
        "The noise of the data{of}, {noise} per coordinate, is so large a part of the distance to the cut locus of "
        "{space!r} that the curve may go around it in the wrong way. Check the units of angles. Plot the curve, and "
        "sample more often, or pass a larger lam, or weights of 0 for wrong data."
    ),
    FAST: (
        "The data{of} turn by more than half of the distance to the cut locus of {space!r} from one to the next, and "
        "their noise is {noise}, so that the curve may turn by wrong angles. Sample more often. If the angular "
        "velocity is known, remove this rotation from the data first."
    ),
}


def _warn_of_adaptation(space: Space, noisy: SmoothingData, fits: list[Fitted]) -> None:
    """Warn if λ and σ should vary in another way along a curve."""
    gains = [np.asarray(0.0 if fit.report.gain is None else fit.report.gain, np.float64) for fit in fits]
    if first := _first(space, [np.isnan(gain) & fit.converged for gain, fit in zip(gains, fits, strict=True)]):
        number, index, of = first
        other = "" if fits[number].result.smoothed.penalty == "jerk" else "method='newton', or "
        warn(
            f"The smoothing{of} did not converge with a lam or a noise level that varies along the curve. The result "
            f"has one of each. Pass {other}more knots where the motion is fast.",
            SmoothingWarning,
            index,
        )
    if first := _first(space, [(fit.result.doubts[..., 0] > 0) & fit.converged for fit in fits]):
        number, index, of = first
        words = ("motion", "noise", "noise") if fits[number].part.adapts[0] else ("noise", "motion", "lam")
        warn(
            f"What the smoothing{of} takes for {words[0]} may be {words[1]}: {words[2]} varies along the curve, too. "
            "Pass lam='adaptive' with noise='adaptive'.",
            SmoothingWarning,
            index,
        )
    if first := _first(space, [(fit.result.doubts[..., 1] > 0) & fit.converged for fit in fits]):
        _, index, of = first
        warn(
            f"The data{of} hardly decide whether their noise or the motion varies. Plot the curve, and pass only one "
            "of lam='adaptive' and noise='adaptive' if you know which.",
            SmoothingWarning,
            index,
        )
    varies = [fit.result.smoothed.profile is not None for fit in fits]
    outliers = [
        np.isfinite(fit.result.doubts[..., 2]) & fit.converged & changes
        for fit, changes in zip(fits, varies, strict=True)
    ]
    if first := _first(space, outliers):
        number, index, of = first
        times = noisy.times[index] if noisy.times.ndim > 1 else noisy.times
        at = int(np.searchsorted(times, fits[number].result.doubts[(*index, 2)]))
        warn(
            f"The curve{of} may follow an outlier: points[{at}] is far from its neighbours, which agree without it, "
            "and lam varies. Pass loss='cauchy', or weights of 0 for outliers.",
            SmoothingWarning,
            index,
        )


# ---- the choice of λ ----


def warn_of_bounds(space: Space, reports: list[SmoothingReport], chosen: list[Array], counts: list[Array]) -> None:
    """Warn once if a chosen λ is at a bound, or close to it.

    Parameters
    ----------
    reports : list of SmoothingReport
        Reports of every space in which data were smoothed.
    chosen : list of ndarray of bool
        Whether λ was chosen from the data, for each curve.
    counts : list of ndarray of int
        Number of data of each curve.
    """
    for number, (report, asked, count) in enumerate(zip(reports, chosen, counts, strict=True)):
        rough = (np.asarray(report.df) > _ALL * count) & (np.asarray(count) > 4)
        at_bound = np.argwhere((np.asarray(report.at_bound) | rough) & np.asarray(report.converged) & asked)
        if not len(at_bound):
            continue
        index = tuple(map(int, at_bound[0]))
        of = of_index(index) + in_part(space, number)
        of += f" (and of {len(at_bound) - 1} more curves)" if len(at_bound) > 1 else ""
        if report.is_stiff(index):
            lam = "the largest lam: the curve is a geodesic"
            advice = (
                "This is correct for data along a geodesic. Otherwise the true curve bends faster than the data are "
                "sampled, or less than their noise: plot the data, and pass lam= to set the smoothness."
            )
        elif rough[index]:
            lam = "a lam so small that the curve follows nearly all data"
            advice = (
                "Its standard deviations are only valid if the data are that accurate. Data at nearly equal times and "
                "correlated noise cause this. Pass a larger gamma, criterion='reml', sigma= with criterion='cp', or "
                "lam=."
            )
        else:
            lam = "the smallest lam for which a curve was found"
            advice = (
                "With less smoothing, the curve would turn too far between two knots. Pass more knots in the gaps of "
                "the data, or cut the recording at its gaps (symspline.fit_segments)."
            )
        df = float(np.asarray(report.df)[index])
        warn(f"The smoothing{of} chose {lam} ({df:.3g} degrees of freedom). {advice}", SmoothingWarning, index)
        return


# ---- residuals that are not those of independent noise ----


class Residuals(NamedTuple):
    """Standardised residuals of a sensor, in the order of time.

    Attributes
    ----------
    rows : ndarray, shape (n, d)
        Residuals in standard deviations. Entries without information, such as those of directions in which an
        information matrix is 0, are NaN.
    leverage : float
        Mean variance of the fitted values in units of the noise.
    between : float
        Mean covariance of neighbouring fitted values, in the same units.
    loss : str
        Loss of the sensor.
    corner : float
        Square of the standardised length at which the loss begins to grow more slowly; infinite for least squares.
    exact : bool
        Whether residuals that are too small are reported. They are expected for conditions imposed as measurements.
    """

    rows: Doubles
    leverage: float
    between: float = 0.0
    loss: str = "linear"
    corner: float = np.inf
    exact: bool = True


class Finding(NamedTuple):
    """The result of the examination of one sensor, as `smoothing/src/examine.rs` describes it."""

    ratio: float
    freedom: float
    correlation: float
    large: bool
    small: bool
    correlated: bool
    step: int | None
    outliers: list[int]
    largest: float
    rejected: float
    run: list[int] | None

    @property
    def failed(self) -> bool:
        """Whether a test failed."""
        unlikely = self.large or self.small or self.correlated or self.step is not None
        return unlikely or bool(self.outliers) or self.rejected > 0 or self.run is not None

    @property
    def smooth(self) -> bool:
        """Whether the residuals are so correlated that a wrong σ is not their only cause."""
        return self.correlated and self.correlation > _SMOOTH


class Sensor(NamedTuple):
    """Data of one kind in one part of the space, with the result of the examination.

    Attributes
    ----------
    name, label : str
        Name with the kind of data, and name of the argument.
    numbers : ndarray of int
        Index of each row among the data passed by the user.
    finding : Finding
        The result.
    """

    name: str
    label: str
    numbers: NDArray[np.intp]
    finding: Finding


def corner_of(loss: str, d: int) -> float:
    """Return the squared length of d components in standard deviations at which a loss begins to grow more slowly.

    It is infinite for least squares.
    """
    return np.inf if loss == "linear" else _core.chi_squared(d, _CORNERS[loss])


def roots_of(information: Doubles) -> tuple[Doubles, NDArray[np.bool_]]:
    """Return matrices R with RᵀR = W for information matrices W, and a mask of their rows with information."""
    values, vectors = np.linalg.eigh(information)
    roots = np.sqrt(np.maximum(values, 0.0))
    known = roots > _NOTHING * roots.max(axis=-1, keepdims=True)
    return roots[..., None] * np.swapaxes(vectors, -1, -2), known


def examine(given: Residuals) -> Finding:
    """Examine the residuals of one sensor, which are in the order of time."""
    corner = None if given.loss == "linear" else given.corner
    rows = np.ascontiguousarray(given.rows)
    return Finding(*_core.examine(rows, given.leverage, given.between, corner, given.exact))


_STIFF = (
    "Either the curve is too stiff, or the noise is correlated, as in rounded, repeated or filtered data. Plot the "
    "curve with the data. If the curve is too stiff, pass criterion='reml', a smaller lam or more knots. If the noise "
    "is correlated, do not use the bands."
)
_BYPASSED = (
    "the loss rejects data on both sides of the part from index {0} to {1}, but a curve without this part is near "
    "them. If the data of this part are outliers, pass weights of 0 for them. If the motion is fast there, pass "
    "loss='linear' or smooth this part by itself."
)


def _warn_of_residuals(space: Space, noisy: SmoothingData, fits: list[Fitted]) -> None:
    """Warn if the residuals of a curve are not those of independent noise.

    Curves with given λ and estimated σ are not examined, because the user has decided how closely they follow the data.
    """
    failures: list[tuple[tuple[int, ...], str]] = []
    for number, fit in enumerate(fits):
        curves = np.flatnonzero(fit.converged & (fit.given | fit.chosen))
        for curve, facts in _complaints(noisy, number, fit, curves) if len(curves) else ():
            index = tuple(map(int, np.unravel_index(curve, noisy.batch)))
            of = of_index(index) + in_part(space, number, ",")
            failures.append((index, f"The residuals of the smoothing{of} are not those of independent noise: {facts}"))
    if failures:
        index, message = failures[0]
        more = f" This holds for {len(failures) - 1} more curves or factors." if len(failures) > 1 else ""
        warn(message + more, SmoothingWarning, index)


def _complaints(noisy: SmoothingData, number: int, fit: Fitted, curves: NDArray[np.intp]) -> list[tuple[int, str]]:
    """Return the curves that failed a test among the given ones, with descriptions of the tests and their remedies."""
    space, noise, n = fit.part.space, noisy.noise[number], noisy.times.shape[-1]

    def of_curves(array: Array, axes: tuple[int, ...] = ()) -> Array:
        rows: Array = np.broadcast_to(array, (*noisy.batch, n, *axes)).reshape(-1, n, *axes)[curves]
        return rows

    at = fit.at.reshape(-1, n, *space._point_shape)[curves]
    points = fit.part.points.reshape(-1, n, *space._point_shape)[curves]
    data = [of_curves(noisy.times), space._as_doubles(at), space._as_doubles(points), of_curves(noise.weights)]
    rows, deviations = _core.residuals_at(space._handle, *data)
    if noise.information is None:
        rows *= np.sqrt(data[-1])[..., None]
    else:
        used = np.isfinite(rows).any(axis=-1)
        roots, known = roots_of(of_curves(noise.information, (space.dim, space.dim))[used])
        rows[used] = np.where(known, np.einsum("nij,nj->ni", roots, rows[used]), np.nan)
    observed: NDArray[np.bool_] = np.asarray(np.isfinite(rows).any(axis=-1))
    leverage = np.minimum(np.ravel(fit.report.df)[curves] / np.maximum(observed.sum(axis=-1), 1), 1.0)
    loss = fit.part.noise.loss
    corner = None if loss == "linear" else corner_of(loss, space.dim)
    given = np.where(fit.given, fit.result.smoothed.sigma, np.nan).ravel()[curves]
    failures = _core.examine_curves(space._handle, data, rows, deviations, leverage, given, corner)
    complaints = []
    for k, *tests in failures:
        complaints.append((int(curves[k]), _described(np.flatnonzero(observed[k]), tests)))
    return complaints


def _described(numbers: NDArray[np.intp], tests: list[Any]) -> str:
    """Describe failed tests of one curve, whose rows with information have these numbers."""
    bypassed, of_given, of_estimated = tests
    if bypassed:
        return _BYPASSED.format(*bypassed)
    if of_given:
        sensor = Sensor("data", "the data", numbers, Finding(*of_given))
        stiff = sensor.finding.smooth or sensor.finding.step is not None
        return " ".join([described(sensor), *([_STIFF] if stiff else advice([sensor]))])
    ratio, correlation, (count, first, size), run = of_estimated
    facts, remedies = [], []
    if ratio > 1:
        facts.append(f"they are {ratio:.2g} times as large as the noise estimated from neighbouring data")
    if correlation:
        facts.append(f"neighbouring residuals have a correlation of {correlation:.2f}")
    if ratio > 1 or correlation > 0:
        remedies.append(_STIFF)
    if correlation < 0:
        remedies.append(
            "Residuals of alternating sign indicate a motion that is too fast for the sampling. Check the times and "
            "units, or sample more often."
        )
    if run:
        facts.append(f"the loss rejects all data from index {run[0]} to {run[1]}")
        remedies.append(
            "If the motion is fast there and these data are right, pass loss='linear' or smooth this part by itself."
        )
    if count:
        facts.append(f"{_counted(count)}, at index {first}, is {size:.2g} times the noise")
        remedies.append("If these are outliers, pass loss='cauchy'.")
    return f"{', '.join(facts)}. {' '.join(remedies)}"


def _counted(count: int) -> str:
    return "one outlier" if count == 1 else f"the largest of {count} outliers"


def described(sensor: Sensor) -> str:
    """Return the tests of a sensor that failed."""
    finding = sensor.finding
    facts = []
    if finding.large or finding.small:
        facts.append(f"the residuals are {finding.ratio:.2g} times as large as sigma")
    if finding.correlated:
        facts.append(f"neighbouring residuals have a correlation of {finding.correlation:.2f}")
    if finding.step is not None:
        facts.append(f"the mean of the residuals changes at index {sensor.numbers[finding.step]}")
    if finding.outliers:
        which, first = _counted(len(finding.outliers)), sensor.numbers[finding.outliers[0]]
        facts.append(f"{which}, at index {first}, is {finding.largest:.2g} times sigma")
    if finding.rejected:
        facts.append(f"the loss rejects {finding.rejected:.0%} of the measurements")
    if finding.run:
        first, last = finding.run
        where = f"from index {sensor.numbers[first]} to {sensor.numbers[last]}"
        facts.append(f"the loss rejects {last - first + 1} consecutive measurements, {where}")
    return f"{sensor.name}: {', '.join(facts)}."


def advice(sensors: list[Sensor]) -> list[str]:
    """Return sentences with likely causes of the failed tests and remedies."""
    texts = []
    outlying = [sensor for sensor in sensors if sensor.finding.outliers]
    if outlying:
        texts.append(f"If these are outliers, pass loss='cauchy' to {_labels(outlying)}.")
    wrong = [sensor for sensor in sensors if sensor.finding.large or sensor.finding.small or sensor.finding.rejected]
    # Missing effects make residuals smooth; a wrong σ does not.
    smooth = [
        sensor
        for sensor in sensors
        if sensor.finding.smooth or sensor.finding.run or (sensor.finding.step is not None and sensor not in wrong)
    ]
    if (
        smooth
        and (any(sensor.finding.run for sensor in smooth) or any(sensor in wrong for sensor in smooth) or not wrong)
        and not outlying
    ):
        texts.append(
            f"Check the frame (rotated or swapped axes), the units and the times of {_labels(smooth)}, and add missing "
            "effects, such as bias= or time_offset=. If the curve turns in the wrong direction between two "
            "measurements, pass another `start`. If the motion is fast, pass more knots."
        )
    for sensor in wrong if not outlying else []:
        if sensor.finding.smooth:
            continue
        ratio = sensor.finding.ratio
        texts.append(_of_units(sensor, ratio) or f"Multiply sigma of {sensor.label} by {ratio:.2g} if it is uncertain.")
    correlated = [
        sensor for sensor in sensors if sensor.finding.correlated and sensor not in wrong and sensor not in smooth
    ]
    if correlated and not texts:
        texts.append(
            f"The noise of {_labels(correlated)} is correlated, but the covariance assumes independent noise. Pass a "
            "larger sigma or fewer measurements."
        )
    return texts


def _labels(sensors: list[Sensor]) -> str:
    return " and ".join(dict.fromkeys(sensor.label for sensor in sensors))


def _of_units(sensor: Sensor, ratio: float) -> str:
    if not ratio > 0:
        return ""
    for factor, text in {DEGREES: "57.3, the ratio of degrees and radians", **_UNITS}.items():
        for quotient in (ratio / factor, ratio * factor):
            if abs(np.log(quotient)) < _NEAR:
                return f"{ratio:.2g} is close to {text}: check the unit of sigma of {sensor.label}."
    return ""


# ---- a motion or noise that varies along the recording, while λ and σ are constant ----


def _warn_of_varying(space: AnySpace, noisy: SmoothingData, spline: SmoothedSpline, fits: list[Fitted]) -> None:
    """Warn if the motion or its noise varies along a curve whose λ was chosen."""
    for number, (fit, noise) in enumerate(zip(fits, noisy.noise, strict=True)):
        part, factor = fit.curve, fit.curve.space
        # The acceleration of a pose is not that of its rotation and position.
        if isinstance(factor, SpecialEuclidean) or noise.information is not None:
            continue
        df = np.asarray(fit.report.df)
        good = fit.converged & ~np.asarray(fit.report.at_bound) & (df > _FREEDOM) & fit.chosen
        curves = np.flatnonzero(good)
        if not len(curves):
            continue

        def rows(array: Array, chosen: Array = curves, batch: tuple[int, ...] = noisy.batch, axes: int = 1) -> Array:
            whole = np.broadcast_to(array, (*batch, *array.shape[array.ndim - axes :]))
            return np.ascontiguousarray(whole.reshape(-1, *array.shape[array.ndim - axes :])[chosen])

        knots = rows(part.times)
        # The acceleration is nearly linear between knots.
        middle = 0.5 * (part.times[..., 1:] + part.times[..., :-1])
        bend = part.evaluate(np.ascontiguousarray(middle), "bend", "raise", middle.ndim > 1)
        energy = np.cumsum(np.diff(knots) * rows(bend) ** 2, axis=-1)
        band, times, kinds = rows(fit.result.smoothed.band, axes=2), rows(noisy.times), end_kinds(spline._bc_type)
        leverage = _core.smoothing_variance(knots, band, np.zeros(len(curves)), None, times, 0, kinds)
        squares = np.full(fit.at.shape[: len(noisy.batch) + 1], np.nan)
        squares[good] = factor._apply("distance", p=fit.at[good], q=fit.part.points[good]) ** 2
        energy = np.concatenate([np.zeros((len(curves), 1)), energy], axis=-1)
        tests = _core.are_constant(times, rows(noise.weights), leverage, rows(squares), knots, energy, factor.dim)
        failed = []
        for curve_number, result in zip(curves, tests, strict=True):
            index = tuple(map(int, np.unravel_index(curve_number, noisy.batch)))
            shown = noisy.t[index] if noisy.t.ndim > 1 else noisy.t
            if result and (message := varying(shown, result, fit.part.noise.loss != "linear", fit.part.adapts)):
                failed.append((index, message))
        if failed:
            index, message = failed[0]
            of = of_index(index) + (f" in factor {number}, {factor!r}" if is_several(space) else "")
            others = f" (and of curves {', '.join(str(list(i))[1:-1] for i, _ in failed[1:9])})" if failed[1:] else ""
            warn(f"In the data{of}{others}, {message}.", SmoothingWarning, index)
            return


def varying(
    t: Array,
    tests: list[tuple[float, list[int], float]],
    robust: bool = False,
    adapts: tuple[bool, bool] = (False, False),
) -> str | None:
    """Describe what varies along a curve, from the results of both tests. Robust losses have no test of the noise.

    λ and σ that may vary are not tested.
    """
    smoothness, noise = tests
    messages = []
    if t.dtype.kind == "f":
        # A thousandth of the recording is accurate enough for a message.
        t = np.round(t, max(0, 3 - int(np.floor(np.log10(np.ptp(t))))))
    score, (first, last), ratio = smoothness
    if score > _SMOOTHNESS and ratio > _FASTER and not adapts[0]:
        # A robust loss may have selected a run of outliers.
        remedy = (
            ", or the curve follows outliers. Plot the data, and pass weights of 0 for outliers. If there are none, "
            "pass lam='adaptive'"
            if robust
            else ". The curve is too smooth there, and follows the noise elsewhere. Pass lam='adaptive'"
        )
        between = f"t = {short_repr(t[first])} and {short_repr(t[last])}"
        what = f"the motion is faster between {between} than one lam for the whole recording allows{remedy}"
        messages.append((score / _SMOOTHNESS, what))
    score, (first, last), _ = noise
    if score > _NOISE and not robust and not adapts[1]:
        between = f"t = {short_repr(t[first])} and {short_repr(t[last])}"
        what = (
            f"the residuals are larger between {between} than elsewhere: the noise is larger there, or the curve does "
            "not follow the motion. Pass noise='adaptive' and lam='adaptive', weights= with the inverse variances of "
            "the data, or loss='huber' if only some data are worse"
        )
        messages.append((score / _NOISE, what))
    return max(messages)[1] if messages else None


# ---- data that are spread over all of a compact space, so that a smooth curve has little meaning ----


def _warn_of_spreads(noisy: SmoothingData, fits: list[Fitted]) -> None:
    """Warn if data of a curve are about as far from it as random points of the space would be.

    The degrees of freedom with which the curve follows the data are taken into account.
    """
    every = -(-noisy.times.shape[-1] // _SAMPLE)
    some = (slice(None),) * len(noisy.batch) + (slice(None, None, every),)
    for fit, noise in zip(fits, noisy.noise, strict=True):
        # Negligible weights do not count.
        counts = noise.weights > 1e-6 * noise.weights.max(axis=-1, keepdims=True)
        counts = np.broadcast_to(counts, (*noisy.batch, noisy.times.shape[-1]))
        data = fit.at[some], fit.part.points[some], counts[some]
        if warn_of_spread(fit.part.space, *data, np.sum(counts, axis=-1), np.asarray(fit.report.df), "curve"):
            return


def warn_of_spread(
    space: Space, at: Array, points: Array, counts: NDArray[np.bool_], number: Array | int, df: Number, name: str
) -> bool:
    """Warn if data are about as far from a smooth fit as random points of a compact space would be.

    Parameters
    ----------
    at, points : ndarray, shape (..., N, *point_shape)
        Points of the fits, and data.
    counts : ndarray of bool, shape (..., N)
        Data that count.
    number, df : ndarray
        Number of all data, and degrees of freedom with which the fit follows them.
    name : str
        Name of a fit.

    Returns
    -------
    bool
        Whether a warning was issued.
    """
    expected = random_distance(space)
    if expected is None:
        return False
    used = counts & space._where_finite(at)
    distances = np.full(used.shape, np.nan)
    distances[used] = distances_of(space, at[used], points[used])
    # Fits that failed have the distance 0.
    distances[~used.any(axis=-1)] = 0.0
    median_distance = np.asarray(np.nanmedian(distances, axis=-1))
    # A fit through all data has no residuals to compare.
    far = np.argwhere((median_distance**2 * number > _FAR * expected**2 * (number - df)) & (number - df >= 1))
    if not len(far):
        return False
    index = tuple(map(int, far[0]))
    more = f" (and {len(far) - 1} more curves)" if len(far) > 1 else ""
    warn(
        f"half of the data{of_index(index)} are {median_distance[index]:.2g} or more away from their smooth "
        f"{name}{more}. For random points of {space!r} this distance is {expected:.2g}, so the {name} has little "
        "meaning. Check the units and signs of the data.",
        UserWarning,
        index,
    )
    return True


@lru_cache(maxsize=64)
def random_distance(space: Space) -> float | None:
    """Return the median distance of random points, or None for spaces without a largest distance."""
    if not np.isfinite(space.injectivity_radius) or np.isnan(space.curvature):
        return None
    random = space.random_point(np.random.default_rng(0), (2, _SAMPLE))
    return float(np.median(space._apply("distance", p=random[0], q=random[1])))

"""Warn about residuals of smoothing splines that are not those of independent noise."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.faults import of_index
from .._base.warnings import warn
from .._spaces import Array, Doubles, Space
from .audit import Finding, Residuals, SmoothingFinding, corner_of, examine, examine_smoothing, roots_of
from .data import SmoothingData, points_of
from .factors import in_part
from .solve import Smoothed
from .warned import SmoothingWarning

# Ratios of common units, and the largest difference of a logarithm of a ratio from theirs.
DEGREES, _UNITS, _NEAR = 180 / np.pi, {1e3: "1000, the ratio of m and mm, or of s and ms"}, 0.15

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


class Sensor(NamedTuple):
    """Data of one kind in one part of the space, with the result of the audit.

    Attributes
    ----------
    name, label : str
        Name with the kind of data, and name of the argument.
    numbers : ndarray of int
        Index of each row among the data passed by the user.
    finding : Finding
        Result of the audit.
    """

    name: str
    label: str
    numbers: NDArray[np.intp]
    finding: Finding


def warn_of_residuals(
    space: Space,
    at_data: list[Array],
    noisy: SmoothingData,
    smoothed: list[Smoothed],
    given: list[Any],
    chosen: list[Any],
    loss: str,
) -> None:
    """Warn once if the residuals of a curve are not those of independent noise.

    Parameters
    ----------
    space : Space
        Space of the curves.
    at_data : list of ndarray
        Points of the curves at the data, in every part.
    noisy : SmoothingData
        Data.
    smoothed : list of Smoothed
        Results in every part.
    given, chosen : list of ndarray of bool
        Whether the standard deviation is given, and whether λ was chosen, for each curve in every part. Curves with
        neither are not examined, because the user has decided how closely they follow the data.
    loss : str
        Loss of all data.
    """
    batch = noisy.batch
    found: list[tuple[tuple[int, ...], str]] = []
    for number, (x, (part, y), own) in enumerate(zip(at_data, points_of(noisy, space), smoothed, strict=True)):
        known, asked, good = (np.reshape(flags, -1) for flags in (given[number], chosen[number], own.report.converged))
        examined = np.flatnonzero(good & (known | asked))
        if not len(examined):
            continue
        one = _Examined.of(part, noisy, number, x, y, own, examined)
        of_part = in_part(space, number, ",")
        for k, facts in one.complaints(known[examined], loss):
            index = tuple(map(int, np.unravel_index(examined[k], batch)))
            what = f"The residuals of the smoothing{of_index(index)}{of_part} are not those of independent noise: "
            found.append((index, what + facts))
    if found:
        index, message = found[0]
        more = f" This holds for {len(found) - 1} more curves or factors." if len(found) > 1 else ""
        warn(message + more, SmoothingWarning, index)


class _Examined(NamedTuple):
    """Residuals of some curves in one part, scaled to weight one.

    Attributes
    ----------
    space : Space
        The part.
    data : tuple of ndarray, shape (curves, N, ...)
        Times, points of the curves, data, and weights.
    rows : ndarray, shape (curves, N, d)
        Residuals; NaN without information.
    deviations : ndarray, shape (curves, N)
        Squared deviations of data from the geodesics between their neighbours, divided by their variances.
    leverages, sigmas : ndarray, shape (curves,)
        Mean leverage of the data, and standard deviations.
    """

    space: Space
    data: tuple[Doubles, Doubles, Doubles, Doubles]
    rows: Doubles
    deviations: Doubles
    leverages: Doubles
    sigmas: Doubles

    @classmethod
    def of(
        cls, space: Space, noisy: SmoothingData, number: int, x: Array, y: Array, own: Smoothed, curves: Any
    ) -> _Examined:
        """Return the residuals of curves with these numbers."""
        n, shape = noisy.times.shape[-1], space.point_shape
        precision = noisy.precisions[number]

        def of_curves(array: Any, axes: tuple[int, ...]) -> Array:
            rows: Array = np.broadcast_to(array, (*noisy.batch, n, *axes)).reshape(-1, n, *axes)[curves]
            return rows

        times, weights = of_curves(noisy.times, ()), of_curves(precision.weights, ())
        x, y = (space._as_doubles(of_curves(points, shape)) for points in (x, y))
        data = times, x, y, weights
        rows, deviations = _core.residuals_at(space._handle, *data)
        if precision.information is None:
            rows *= np.sqrt(weights)[..., None]
        else:
            used = np.isfinite(rows).any(axis=-1)
            roots, known = roots_of(of_curves(precision.information, (space.dim, space.dim))[used])
            rows[used] = np.where(known, np.einsum("nij,nj->ni", roots, rows[used]), np.nan)
        counts = np.maximum(np.isfinite(rows).any(axis=-1).sum(axis=-1), 1)
        df, sigma = (np.reshape(value, -1)[curves] for value in (own.report.df, own.sigma))
        return cls(space, data, rows, deviations, np.minimum(df / counts, 1.0), sigma)

    def _sizes(self, k: int) -> Doubles:
        """Return the sizes of the residuals of a curve in given standard deviations, 0 without information."""
        return np.asarray(np.abs(np.nan_to_num(self.rows[k])).max(axis=-1) / self.sigmas[k])

    def complaints(self, known: NDArray[np.bool_], loss: str) -> Iterator[tuple[int, str]]:
        """Yield the number of each curve with failed checks, and a text with these checks and their remedies.

        Parameters
        ----------
        known : ndarray of bool
            Whether the standard deviation of each curve is given.
        loss : str
            Loss of the data.
        """
        corner, robust = corner_of(loss, self.space.dim), loss != "linear"
        estimated = examine_smoothing(self.rows, self.deviations, self.leverages, robust)
        for k in range(len(known)):
            sizes = self._sizes(k) if known[k] else estimated.sizes[k]
            times, x, y, weights = (own[k] for own in self.data)
            if robust and (part := _core.bypassed(self.space._handle, times, x, y, weights, sizes)):
                yield k, _BYPASSED.format(*part)
                continue
            if not known[k]:
                if estimated.failed[k]:
                    yield k, _of_estimated(estimated, k)
                continue
            used = np.flatnonzero(np.isfinite(self.rows[k]).any(axis=1))
            given = Residuals(self.rows[k][used] / self.sigmas[k], float(self.leverages[k]), 0.0, loss, corner)
            sensor = Sensor("data", "the data", used, examine(given))
            if sensor.finding.failed:
                stiff = sensor.finding.smooth or sensor.finding.step is not None
                yield k, " ".join([described(sensor), *([_STIFF] if stiff else advice([sensor]))])


def _of_estimated(finding: SmoothingFinding, curve: int) -> str:
    """Describe failed checks of data whose noise level is estimated."""
    ratio, correlation = float(finding.ratio[curve]), float(finding.correlation[curve])
    sizes = np.where(finding.outliers[curve], finding.sizes[curve], 0.0)
    count, first = int(np.count_nonzero(sizes)), int(sizes.argmax())
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
    run = finding.runs[curve]
    if run:
        facts.append(f"the loss rejects all data from index {run[0]} to {run[1]}")
        remedies.append(
            "If the motion is fast there and these data are right, pass loss='linear' or smooth this part by itself."
        )
    if count:
        which = "one outlier" if count == 1 else f"the largest of {count} outliers"
        facts.append(f"{which}, at index {first}, is {sizes[first]:.2g} times the noise")
        remedies.append("If these are outliers, pass loss='cauchy'.")
    return f"{', '.join(facts)}. {' '.join(remedies)}"


def described(sensor: Sensor) -> str:
    """Return the checks of a sensor that failed."""
    finding = sensor.finding
    facts = []
    if finding.large or finding.small:
        facts.append(f"the residuals are {finding.ratio:.2g} times as large as sigma")
    if finding.correlated:
        facts.append(f"neighbouring residuals have a correlation of {finding.correlation:.2f}")
    if finding.step is not None:
        facts.append(f"the mean of the residuals changes at index {sensor.numbers[finding.step]}")
    if len(finding.outliers):
        count = len(finding.outliers)
        which = "one outlier" if count == 1 else f"the largest of {count} outliers"
        facts.append(f"{which}, at index {sensor.numbers[finding.outliers[0]]}, is {finding.largest:.2g} times sigma")
    if finding.rejected:
        facts.append(f"the loss rejects {finding.rejected:.0%} of the measurements")
    if finding.run:
        first, last = finding.run
        where = f"from index {sensor.numbers[first]} to {sensor.numbers[last]}"
        facts.append(f"the loss rejects {last - first + 1} consecutive measurements, {where}")
    return f"{sensor.name}: {', '.join(facts)}."


def advice(sensors: list[Sensor]) -> list[str]:
    """Return sentences with likely causes of the failed checks and remedies."""
    texts = []
    outlying = [sensor for sensor in sensors if len(sensor.finding.outliers)]
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
        for own in (ratio / factor, ratio * factor):
            if abs(np.log(own)) < _NEAR:
                return f"{ratio:.2g} is close to {text}: check the unit of sigma of {sensor.label}."
    return ""

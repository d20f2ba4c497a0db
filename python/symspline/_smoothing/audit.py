"""Test whether the residuals of a fit are those of independent noise with the given standard deviations.

Each check compares a statistic with a limit that data without a fault exceed about once in 10⁴ fits. A second limit on
the size of the effect is needed because negligible deviations are statistically significant in long recordings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._spaces import Doubles

# Quantiles of χ² at which the losses begin to grow more slowly, as in `loss.rs`.
_CORNERS = {"huber": 0.82, "cauchy": 0.95}
# Eigenvalues of a root of an information matrix below this relative size are rounding errors.
_NOTHING = 1e-6
# Limit, in standard deviations, of the mean square and of the autocorrelation.
SIGNIFICANT = 4.5
# Ratios of residuals to σ between this factor and its inverse are negligible. The second factor is for robust losses,
# where medians measure the ratio and grow with the share of outliers.
_RATIO, _ROBUST_RATIO = 1.1, 1.6
# Autocorrelations below the first number are negligible; those above the second are not caused by a wrong σ.
_CORRELATED, _SMOOTH = 0.1, 0.3
# Limit of the largest centred partial sum (Ploberger and Krämer 1992), and the negligible size as a fraction of √n. It
# corresponds to steps of a quarter of the standard deviation.
_PARTIAL_SUM, _STEP = 2.0, 0.0625
# Smallest limit of the largest residual. In long recordings, normal residuals exceed the limit with this probability.
_LARGEST, _PROBABILITY = 6.0, 1e-5
# Share of the measurements that a robust loss may reject, the number of its standard errors by which chance may exceed
# it, and the multiple of the corner of the loss beyond which measurements are rejected.
_REJECTED, _CHANCE, _BEYOND = 0.3, 2.0, 9.0
# More consecutive rejected measurements than this number, and than this share of all, are reported, because outliers of
# a sensor are mostly isolated.
_RUN, _RUN_SHARE = 8, 0.05
# The same for smoothing, where every datum is a point: six in a row are rare among 15 % of isolated outliers.
_RUN_OF_DATA, _SHARE_OF_DATA = 5, 0.02
# Residuals below this fraction of σ are those of data without noise.
_EXACT = 1e-6
# Residuals of fewer measurements, or with a larger leverage, are not examined.
_FEWEST, _LEVERAGE = 5, 0.9
# For fits that estimate the noise level: the limit of the ratio of the residuals to the noise estimated from
# neighbouring data, and the leverage up to which the residuals have nearly the covariance of the noise. Beyond this
# leverage, only outliers are tested, with a limit multiplied by the third number, up to the fourth number.
_NEIGHBOURS, _MODERATE, _UNEVEN, _HIGH = 1.75, 0.3, 1.5, 0.6
# For such fits, the least number of data, and the number of data on either side with which an outlier is compared.
_FEW_DATA, _NEAR = 20, 10
# Efficiency of the median of squares as an estimate of the variance, relative to that of the mean square.
_EFFICIENCY = 0.37


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
    """The result of the audit of one sensor.

    Attributes
    ----------
    ratio : float
        Ratio of the residuals to σ: 1 if σ is right, NaN if the ratio cannot be determined.
    freedom : float
        Degrees of freedom of the residuals.
    correlation : float
        Lag-one autocorrelation, corrected for the leverage.
    large, small, correlated : bool
        Whether the residuals are too large, too small, or correlated.
    step : int or None
        First row after a change of the mean of the residuals.
    outliers : ndarray of int
        Rows of outliers under least squares, in decreasing order of size.
    largest : float
        The largest residual.
    rejected : float
        Share of the measurements that a robust loss rejects, if it is too large, else 0.
    run : tuple of int or None
        First and last row of too many consecutive measurements that a robust loss rejects.
    """

    ratio: float = np.nan
    freedom: float = 0.0
    correlation: float = 0.0
    large: bool = False
    small: bool = False
    correlated: bool = False
    step: int | None = None
    outliers: NDArray[np.intp] = np.empty(0, np.intp)
    largest: float = 0.0
    rejected: float = 0.0
    run: tuple[int, int] | None = None

    @property
    def failed(self) -> bool:
        """Whether a check failed."""
        found = self.large or self.small or self.correlated or self.step is not None
        return found or bool(len(self.outliers)) or self.rejected > 0 or self.run is not None

    @property
    def smooth(self) -> bool:
        """Whether the residuals are so correlated that a wrong σ is not their only cause."""
        return self.correlated and self.correlation > _SMOOTH


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


def normal_of_chi_squared(ratio: float, freedom: float) -> float:
    """Transform χ² divided by its degrees of freedom to a standard normal score (Wilson and Hilferty 1931)."""
    spread = 2.0 / (9.0 * freedom)
    return float((np.cbrt(ratio) - (1.0 - spread)) / np.sqrt(spread))


def median_of_chi_squared(d: float) -> float:
    """Return the median of the squared length of d independent standard normal numbers, for d rounded to 1 or more."""
    return _core.chi_squared(max(1, round(d)), 0.5)


def median_square(squares: Doubles, d: float) -> float:
    """Return the variance of normal residuals from the median of the squared lengths of their d components."""
    return float(np.median(squares)) / median_of_chi_squared(d)


def autocorrelation(rows: Doubles) -> tuple[float, int]:
    """Return the lag-one autocorrelation of all columns, and the number of products in the estimate."""
    products = rows[1:] * rows[:-1]
    count = int(np.isfinite(products).sum())
    square = float(np.nanmean(rows**2))
    return (float(np.nansum(products)) / count / square if count and square > 0 else 0.0), count


def largest_partial_sum(rows: Doubles) -> tuple[float, int]:
    """Return the largest centred partial sum of a column, divided by s√n, and the row after it."""
    known = np.isfinite(rows)
    counts = known.sum(axis=0)
    used = counts >= _FEWEST
    filled = np.where(known, rows, 0.0)[:, used]
    means = filled.sum(axis=0) / counts[used]
    centred = np.where(known[:, used], filled - means, 0.0)
    spread = np.sqrt((centred**2).sum(axis=0))
    if not np.any(spread > 0):
        return 0.0, 0
    sums = np.abs(np.cumsum(centred, axis=0)) / np.where(spread > 0, spread, np.inf)
    row = int(sums.max(axis=1).argmax())
    return float(sums[row].max()), row + 1


def largest_expected(count: int) -> float:
    """Return the limit of the largest of independent normal residuals."""
    return max(_LARGEST, float(np.sqrt(2 * np.log(max(count, 1) / _PROBABILITY))))


def long_run(rejected: NDArray[np.bool_], most: float) -> tuple[int, int] | None:
    """Return the first and the last row of the longest run of rejected measurements if it exceeds `most`, else None."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rejected, [False]])))
    starts, ends = edges[::2], edges[1::2]
    if not len(starts):
        return None
    longest = int((ends - starts).argmax())
    first, last = int(starts[longest]), int(ends[longest]) - 1
    return (first, last) if last - first + 1 > most else None


def examine(given: Residuals) -> Finding:
    """Examine the residuals of one sensor.

    Parameters
    ----------
    given : Residuals
        Residuals in the order of time, and the leverage of their measurements.

    Returns
    -------
    Finding
        Statistics, and the checks that failed.
    """
    rows = given.rows
    known = np.isfinite(rows)
    count, used = int(known.sum()), known.any(axis=1)
    left = 1.0 - given.leverage
    if used.sum() < _FEWEST or left < 1.0 - _LEVERAGE:
        return Finding()
    squares = np.nansum(rows**2, axis=1)
    robust = given.loss != "linear"
    scale = median_square(squares[used], count / used.sum()) / left
    finding = Finding(freedom=count * left)
    if robust:
        # Outliers would dominate the mean square, so the median replaces it.
        square, efficiency, limit = scale, _EFFICIENCY, _ROBUST_RATIO
        far = squares > _BEYOND * given.corner
        share = float(np.mean(far[used]))
        run = long_run(far, max(_RUN, _RUN_SHARE * len(far)))
        most = _REJECTED + _CHANCE * np.sqrt(_REJECTED * (1 - _REJECTED) / used.sum())
        finding = finding._replace(rejected=share if share > most else 0.0, run=run)
        rows = np.where(squares[:, None] > max(1.0, scale) * given.corner, np.nan, rows)
    else:
        sizes = np.nanmax(np.where(known, np.abs(rows), 0.0), axis=1)
        # If σ is too small, residuals are compared with their median instead.
        far = np.flatnonzero(sizes > largest_expected(count) * np.sqrt(max(1.0, scale)))
        finding = finding._replace(largest=float(sizes.max()), outliers=far[np.argsort(-sizes[far])])
        inner = np.delete(rows, far, axis=0)
        square, efficiency, limit = float(np.nanmean(inner**2)) / left, 1.0, _RATIO
    freedom = count * left * efficiency
    large = normal_of_chi_squared(square, freedom) > SIGNIFICANT and square > limit**2
    # With the hat matrix H, residuals have the covariance I − H if the curve is as rough as the penalty expects, and
    # (I − H)² if it is smoother.
    least = square / left
    small = given.exact and normal_of_chi_squared(least, freedom * left) < -SIGNIFICANT and least < _RATIO**-2
    small = small and least > _EXACT**2
    finding = finding._replace(ratio=float(np.sqrt(least if small else square)), large=large, small=small)
    # Residuals smaller than σ contain only negligible effects.
    if small or square < _EXACT**2 or np.isfinite(rows).any(axis=1).sum() < _FEWEST:
        return finding
    correlation, products = autocorrelation(rows)
    correlation += given.between / left
    correlated = correlation * np.sqrt(products) > SIGNIFICANT and correlation > _CORRELATED
    value, step = largest_partial_sum(rows)
    jumps = value > max(_PARTIAL_SUM, _STEP * np.sqrt(len(rows)))
    return finding._replace(correlation=correlation, correlated=correlated, step=step if jumps else None)


class SmoothingFinding(NamedTuple):
    """The result of the audit of curves whose noise level the fit estimates, with one entry per curve.

    Attributes
    ----------
    ratio : ndarray
        Ratio of the residuals to the noise estimated from neighbouring data if it is too large, else 1.
    correlation : ndarray
        Lag-one autocorrelation of the residuals, corrected for the leverage, if it is too large or too small, else 0.
    outliers : ndarray of bool, shape (curves, n)
        Outliers under least squares.
    sizes : ndarray, shape (curves, n)
        Sizes of the residuals in standard deviations.
    runs : list of tuple of int or None
        First and last of too many consecutive data that a robust loss rejects, for every curve.
    """

    ratio: Doubles
    correlation: Doubles
    outliers: NDArray[np.bool_]
    sizes: Doubles
    runs: list[tuple[int, int] | None]

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether a check failed."""
        rejected = np.array([run is not None for run in self.runs], bool)
        return np.asarray((self.ratio > 1) | (self.correlation != 0) | self.outliers.any(axis=1) | rejected)


def examine_smoothing(rows: Doubles, neighbours: Doubles, leverage: Doubles, robust: bool) -> SmoothingFinding:
    """Examine the residuals of smooth curves without given standard deviations.

    Parameters
    ----------
    rows : ndarray, shape (curves, n, d)
        Residuals scaled to weight one, in the order of time; NaN where there is no information.
    neighbours : ndarray, shape (curves, n)
        Squared deviations of data from the geodesics between their neighbours, divided by their variance for unit
        noise; NaN at the ends and for data without weight.
    leverage : ndarray, shape (curves,)
        Mean leverage of the data.
    robust : bool
        Whether the loss is robust.
    """
    known = np.isfinite(rows)
    used = known.any(axis=2)
    counts, entries = used.sum(axis=1), known.sum(axis=(1, 2))
    chi = np.array([median_of_chi_squared(own) for own in (entries / np.maximum(counts, 1)).tolist()])
    moderate = leverage <= _MODERATE
    # Variances divided by medians of squared lengths.
    variance = 1 / chi / np.where(leverage < 1, 1.0 - leverage, np.nan)
    # The limits are larger for few data, which vary more.
    few = 1.0 + 2.0 / np.sqrt(np.maximum(counts, 1))
    limit = np.array([largest_expected(own) for own in entries.tolist()]) * few * np.where(moderate, 1.0, _UNEVEN)
    columns, products, sizes = _core.residual_statistics(rows, neighbours, limit, variance)
    lengths, deviations, square, lagged = map(np.array, columns)
    scale, noise = lengths * variance, deviations / chi
    # If the median residual is zero, the curve is exact. Equal neighbours, as of rounded data, contain no estimate of
    # the noise.
    enough = (counts >= _FEW_DATA) & (leverage <= _HIGH) & (scale > 0) & (noise > 0)
    enough &= np.isfinite(neighbours).sum(axis=1) >= _FEW_DATA // 2
    stiff = enough & moderate & (scale > (_NEIGHBOURS * few) ** 2 * noise)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(stiff, np.sqrt(scale / noise), 1.0)
        sizes = sizes / np.sqrt(np.where(scale > 0, scale, np.inf))[:, None]
    far = sizes > limit[:, None]
    correlation = lagged / np.where(square > 0, square, np.inf) + leverage
    correlated = np.abs(correlation) > np.maximum(_CORRELATED, SIGNIFICANT / np.sqrt(products))
    outliers = far & enough[:, None] & (not robust)
    for curve, i in np.argwhere(outliers):
        # Where the noise is larger along a part of the curve, neighbouring residuals are large as well.
        near = np.concatenate([sizes[curve, max(0, i - _NEAR) : i], sizes[curve, i + 1 : i + 1 + _NEAR]])
        outliers[curve, i] = sizes[curve, i] > limit[curve] * max(1.0, float(np.median(near)))
    # A burst of motion looks like consecutive outliers.
    runs: list[tuple[int, int] | None] = []
    for rejected, has_weight in zip(far, np.asarray(used), strict=True):
        numbers = np.flatnonzero(has_weight)
        run = long_run(rejected[numbers], max(_RUN_OF_DATA, _SHARE_OF_DATA * len(numbers))) if robust else None
        runs.append(run and (int(numbers[run[0]]), int(numbers[run[1]])))
    return SmoothingFinding(ratio, np.where(enough & moderate & correlated, correlation, 0.0), outliers, sizes, runs)

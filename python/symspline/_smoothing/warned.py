"""Warnings about the chosen amount of smoothing, and about data that are far from their curve."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.arrays import short_repr
from .._base.faults import of_index
from .._base.warnings import warn
from .._spaces import Array, Space
from .data import SmoothingData, points_of
from .factors import in_part

# Ratio of the degrees of freedom to the number of data from which a curve follows nearly all data.
_ALL = 0.9
# Limit of the ratio of squared distances. The ratio is below it where smoothing still recovers the curve, as with noise
# of half a radian on S², SO(3) or RP². It is above it for random points, unless the curve follows them.
_FAR = 0.5
# Number of data of a curve that are enough for the check.
_SAMPLE = 1000


class SmoothingWarning(UserWarning):
    """Warning that a statistical fit cannot be trusted.

    Reasons are a chosen λ at a bound, residuals that are not those of independent noise with the given standard
    deviations, a robust loss that may have rejected the wrong data, another curve that may fit as well, and a gap in
    which the error of the curve cannot be estimated.
    """


def first_affected(
    space: Space, affected: list[NDArray[np.bool_]], mark: str = ""
) -> tuple[int, tuple[int, ...], str] | None:
    """Return the first of the affected curves, for warnings; None if there is none.

    Parameters
    ----------
    affected : list of ndarray of bool
        Which curves are affected, in every space in which data were smoothed.
    mark : str
        Punctuation mark after the name of a factor.

    Returns
    -------
    tuple
        Number of the smoothed space, index of the curve, and words that name it and count the others.
    """
    total = sum(int(np.count_nonzero(own)) for own in affected)
    for number, own in enumerate(affected):
        if own.any():
            index = tuple(map(int, np.argwhere(own)[0]))
            more = f" (and {total - 1} more)" if total > 1 else ""
            return number, index, of_index(index) + in_part(space, number, mark) + more
    return None


def warn_of_bounds(space: Space, reports: list[Any], chosen: list[Any], counts: list[Any]) -> None:
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
        good = (np.asarray(report.at_bound) | rough) & np.asarray(report.converged)
        found = np.argwhere(good & np.reshape(asked, good.shape))
        if not len(found):
            continue
        index = tuple(map(int, found[0]))
        of = of_index(index) + in_part(space, number)
        of += f" (and of {len(found) - 1} more curves)" if len(found) > 1 else ""
        message = _message(of, float(np.asarray(report.df)[index]), bool(rough[index]), report.is_stiff(index))
        warn(message, SmoothingWarning, index)
        return


def _message(of: str, df: float, rough: bool, stiff: bool) -> str:
    if stiff:
        lam = "the largest lam: the curve is a geodesic"
        advice = (
            "This is correct for data along a geodesic. Otherwise the true curve bends faster than the data are "
            "sampled, or less than their noise: plot the data, and pass lam= to set the smoothness."
        )
    elif rough:
        lam = "a lam so small that the curve follows nearly all data"
        advice = (
            "Its standard deviations are only valid if the data are that accurate. Data at nearly equal times and "
            "correlated noise cause this. Pass a larger gamma, criterion='reml', sigma= with criterion='cp', or lam=."
        )
    else:
        lam = "the smallest lam for which a curve was found"
        advice = (
            "With less smoothing, the curve would turn too far between two knots. Pass more knots in the gaps of the "
            "data, or cut the recording at its gaps (symspline.fit_segments)."
        )
    return f"The smoothing{of} chose {lam} ({df:.3g} degrees of freedom). {advice}"


# ---- data that are spread over all of a compact space, so that a smooth curve has little meaning ----


def warn_of_spread(space: Space, at_data: list[Array], noisy: SmoothingData, dfs: list[Any]) -> None:
    """Warn once if data of a curve are about as far from it as random points of the space would be.

    The degrees of freedom with which the curve follows the data are taken into account.

    Parameters
    ----------
    at_data : list of ndarray
        Points of the curve at the data, in every space in which data were smoothed.
    noisy : SmoothingData
        Data.
    dfs : list of ndarray
        Degrees of freedom in the same spaces.
    """
    every = -(-noisy.times.shape[-1] // _SAMPLE)
    chosen = (slice(None),) * len(noisy.batch) + (slice(None, None, every),)
    for x, (factor, own), precision, df in zip(at_data, points_of(noisy, space), noisy.precisions, dfs, strict=True):
        expected = random_distance(factor)
        if expected is None:
            continue
        counts = np.broadcast_to(_counts(precision.weights), (*noisy.batch, noisy.times.shape[-1]))
        found = _median_distance(factor, x[chosen], own[chosen], counts[..., ::every])
        count = np.sum(counts, axis=-1)
        # A curve through all data has no residuals to compare.
        far = np.argwhere(is_far(found, expected, count, df))
        if len(far):
            index = tuple(map(int, far[0]))
            more = f" (and {len(far) - 1} more curves)" if len(far) > 1 else ""
            warn(
                f"half of the data{of_index(index)} are {found[index]:.2g} or more away from their smooth curve{more}. "
                f"For random points of {factor!r} this distance is {expected:.2g}, so the curve has little meaning. "
                "Check the units and signs of the data.",
                UserWarning,
                index,
            )
            return


@lru_cache(maxsize=64)
def random_distance(space: Space) -> float | None:
    """Return the median distance of random points, or None for spaces without a largest distance."""
    if not np.isfinite(space.injectivity_radius) or np.isnan(space.curvature):
        return None
    random = space.random_point(np.random.default_rng(0), (2, _SAMPLE))
    return float(np.median(space._apply("distance", p=random[0], q=random[1])))


def is_far(distance: Any, expected: float, count: Any, df: Any) -> Any:
    """Return whether data are about as far from a smooth fit as random points would be.

    Parameters
    ----------
    distance, expected : float or ndarray
        Median distances of the data from the fit, and of random points.
    count, df : float or ndarray
        Number of data, and degrees of freedom with which the fit follows them. A fit through all data has no residuals
        to compare.
    """
    return (distance**2 * count > _FAR * expected**2 * (count - df)) & (count - df >= 1)


def _counts(weights: Array) -> Any:
    """Return which data have a weight that is not negligible."""
    return weights > 1e-6 * weights.max(axis=-1, keepdims=True)


def _median_distance(space: Space, x: Array, y: Array, counts: Any) -> Array:
    """Return the median distance between the curve and the data that count; 0 for curves that failed."""
    lead = x.shape[: x.ndim - len(space.point_shape)]
    used = np.broadcast_to(counts, lead) & space._where_finite(x)
    distances = np.full(lead, np.nan)
    distances[used] = space._apply("distance", p=x[used], q=y[used])
    distances[~used.any(axis=-1)] = 0.0
    return np.asarray(np.nanmedian(distances, axis=-1))


# ---- bands in gaps ----


def warn_of_cubics() -> None:
    """Warn that standard deviations beyond the ends are not those of a curve that continues its cubics."""
    warn(
        "extrapolate=True continues the first and the last cubic of the curve. Standard deviations and bands beyond "
        "the ends are those of a curve that continues with constant velocity, so that they do not contain the error of "
        "these cubics. Pass extrapolate='geodesic' to make_smoothing_spline.",
        SmoothingWarning,
    )


def widest_band(space: Space, spread: NDArray[np.float64]) -> float:
    """Return the radius of the widest 95 % band relative to the injectivity radius, or to π radii of curvature if less.

    It is 0 on flat spaces, where computations in tangent spaces are exact.
    """
    if not space.curvature > 0:
        return 0.0
    reach = min(space.injectivity_radius, np.pi / space.curvature)
    return float(np.nanmax(spread, initial=0.0) * np.sqrt(_core.chi_squared(space.dim, 0.95)) / reach)


def warn_of_wide_bands(spline: Any, number: int, index: tuple[int, ...], wide: float) -> None:
    """Warn of a band so wide that computations in tangent spaces are not valid."""
    of = of_index(index) + in_part(spline.space, number)
    warn(
        f"the 95 % band{of} is up to {wide:.2g} of the injectivity radius (or of π radii of curvature) wide. Bands are "
        "computed in tangent spaces along the curve and may be too narrow. Do not rely on this part of the curve: cut "
        "the recording there (symspline.fit_segments), or add data.",
        SmoothingWarning,
        index,
    )


def warn_of_gaps(spline: Any, found: dict[tuple[int, tuple[int, ...]], Any]) -> None:
    """Warn once of the longest gap among those longer than any part of the recording that could be predicted.

    Parameters
    ----------
    spline : SmoothingSpline
        Curve.
    found : dict
        Calibrations by part and index of the curve; None for curves without any.
    """
    blind = [
        (stop - start, key, place)
        for key, known in found.items()
        for place, (start, stop, _, blocks) in enumerate([] if known is None else known.gaps)
        if not blocks
    ]
    if not blind:
        return
    _, (number, index), place = max(blind)
    gap, count = spline._gaps_of(number, index)[place + len(found[number, index].ends[:1])], len(blind)
    of = of_index(index) + in_part(spline.space, number)
    more = f" (and {count - 1} more gaps)" if count > 1 else ""
    if np.isnan(gap.factor):
        known = (
            "The error of the curve in the gap cannot be estimated, so its standard deviation is NaN there. Cut the "
            "recording at this gap (symspline.fit_segments), or pass calibrated=False for the posterior."
        )
    else:
        known = (
            f"The band in the gap is up to {gap.factor:.2g} times as wide as that of the posterior. This factor comes "
            "from shorter parts of the recording and may be too small. Do not rely on the curve in the gap: cut the "
            "recording there (symspline.fit_segments), or add data."
        )
    warn(
        f"there are no data{of} between t = {short_repr(gap.start)} and {short_repr(gap.stop)}{more}, and no other "
        f"part of the recording is as long. {known}",
        SmoothingWarning,
        index,
    )

"""Fits of recordings with gaps: one curve for each segment between them."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from datetime import timedelta
from typing import Any, Literal, NamedTuple, Required, TypedDict, Unpack, overload

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import as_array, checked_flag, checked_number, one_of, short_repr, whole_number
from .._base.exceptions import SymsplineError
from .._base.faults import UNCONVERGED, Fault, warn
from .._base.input import times_of
from .._base.report import FarPointsWarning
from .._base.time import Moments, seconds_of, time_axis_of, warn_of_rounded_times
from .._base.typing import (
    Duplicates,
    FitOptions,
    FloatArray,
    OnFailure,
    P,
    PointsLike,
    PProduct,
    Progress,
    SmoothingOptions,
    TimesLike,
)
from .._core import ConvergenceError, ValidationError
from .._curves.failures import raise_or_warn
from .._curves.fit import read_given
from .._curves.missing import (
    counts_all_samples,
    data_without_missing,
    recounted,
    refuse_missing,
    refuse_nan_times,
    without_missing,
)
from .._curves.options import check_on_failure, check_progress
from .._spaces import (
    AnySpace,
    Array,
    Groups,
    Product,
    Quotient,
    Space,
    SpecialEuclidean,
    factors_of,
    karcher_mean,
    parts_of,
    space_named,
)
from .._splines.composed import SegmentedCurve
from .._splines.cubic import CubicSpline
from .._splines.functional import fit_many
from ..manifolds import Manifold
from .make import make_smoothing_spline
from .noise import read_precision
from .report import SmoothingReport
from .spline import AnySmoothingSpline, SmoothingSpline

# Neighbours this near to each other's cut locus, as a fraction of the distance to it, have no unique geodesic.
_AT_CUT_LOCUS = 1e-12


class CutOptions(TypedDict, total=False):
    """The keywords of `fit_segments` that cut the recording."""

    max_gap: Required[float | str | timedelta | np.timedelta64]
    min_points: int
    duplicates: Duplicates
    skipna: bool


class FitCuts(CutOptions, FitOptions, total=False):
    """The keywords of `fit_segments` without smoothing."""


class SmoothCuts(CutOptions, SmoothingOptions, total=False):
    """The keywords of `fit_segments` with smoothing."""


@overload
def fit_segments(  # type: ignore[overload-overlap]
    t: TimesLike, points: PointsLike, space: Product[PProduct], *, smooth: Literal[True], **options: Unpack[SmoothCuts]
) -> SegmentedCurve[PProduct, SmoothingSpline[PProduct, tuple[SmoothingReport, ...]]]: ...


@overload
def fit_segments(
    t: TimesLike, points: PointsLike, space: SpecialEuclidean, *, smooth: Literal[True], **options: Unpack[SmoothCuts]
) -> SegmentedCurve[FloatArray, SmoothingSpline[FloatArray, tuple[SmoothingReport, ...]]]: ...


@overload
def fit_segments(
    t: TimesLike, points: PointsLike, space: Space[P] | str, *, smooth: Literal[True], **options: Unpack[SmoothCuts]
) -> SegmentedCurve[P, SmoothingSpline[P]]: ...


@overload
def fit_segments(
    t: TimesLike,
    points: PointsLike,
    space: Space[P] | str,
    *,
    smooth: Literal[False] = False,
    **options: Unpack[FitCuts],
) -> SegmentedCurve[P, CubicSpline[P]]: ...


@counts_all_samples
def fit_segments(
    t: TimesLike,
    points: PointsLike,
    space: AnySpace | str,
    *,
    max_gap: float | str | timedelta | np.timedelta64,
    min_points: int = 2,
    duplicates: Duplicates = "raise",
    smooth: bool = False,
    skipna: bool = False,
    **options: Any,
) -> SegmentedCurve[Any, Any]:
    """Fit a recording with gaps, one curve per segment.

    The recording is cut wherever neighbouring times are more than `max_gap` apart. A single curve across a long gap
    would swing far out and still look plausible.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,)
        Times of the points, in non-decreasing order.
    points : array_like, shape (n, *space.point_shape)
        Points. For a `Product`, a tuple with one array per factor. On ``so:3``, also a SciPy ``Rotation``.
    space : Space or str
        A space or its name, such as ``Sphere(2)`` or ``"sphere:2"``.
    max_gap : float, str or timedelta64
        Longest time between neighbours of one curve, in the unit of t (seconds for dates). For dates and durations,
        also a text such as ``"3h"`` or ``"10min"``, with one of the units ns, us, ms, s, min, h and d.
    min_points : int, default 2
        Segments with fewer points are dropped. At least 2.
    duplicates : {"raise", "first", "mean"}, default "raise"
        Treatment of points with equal times. ``"raise"`` raises `ValidationError`, ``"first"`` keeps the first point
        of each time, and ``"mean"`` replaces them by their Karcher mean.
    smooth : bool, default False
        Whether the points are noisy. If True, each segment is fitted by `make_smoothing_spline`, with its own λ and
        noise level. All points with equal times then count, unless `duplicates` is ``"first"``; consecutive copies of
        a point count as one point.
    skipna : bool, default False
        True to omit missing samples, where the point or its time is NaN, NaT or masked.
    **options
        Keyword arguments of `CubicSpline` or, with `smooth`, of `make_smoothing_spline`. They apply to all segments.
        ``weights`` and ``frames`` refer to all points of the recording, and ``knots`` is the number of knots of each
        segment. Points of weight zero are removed before the recording is cut.

    Returns
    -------
    SegmentedCurve
        One curve per segment, a `CubicSpline` or a `SmoothingSpline`, in the order of time. The result is a sequence of
        these curves, and also a function of time, which is NaN in the gaps.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above, or no segment has `min_points` points.
    CutLocusError, ConvergenceError
        As for `fit_many`. The attribute ``spline`` is the list of all curves.

    Warns
    -----
    FarPointsWarning
        If two neighbours lie at each other's cut locus, such as opposite directions. The recording is also cut between
        them, unless `smooth` is True.

    See Also
    --------
    fit_many : Fit curves of different lengths in one call.
    make_smoothing_spline : Fit a curve close to noisy points.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> t = [0, 1, 1, 2, 14, 15]
    >>> morning, noon = ss.fit_segments(t, [[0], [1], [2], [4], [0], [3]], "r:1", max_gap=5, duplicates="mean")
    >>> morning.t, morning.points[:, 0], noon.t
    (array([0., 1., 2.]), array([0. , 1.5, 4. ]), array([14., 15.]))

    The result is also one function of time:

    >>> day = ss.fit_segments([0, 1, 2, 14, 15], [[0], [1], [4], [0], [3]], "r:1", max_gap=5)
    >>> day([1.0, 5.0, 14.5])[:, 0]
    array([1. , nan, 1.5])

    Noisy data:

    >>> t = np.r_[0:10:0.1, 30:40:0.1]
    >>> y = np.sin(t) + 0.1 * np.random.default_rng(0).standard_normal(200)
    >>> curves = ss.fit_segments(t, y[:, None], "r:1", max_gap=1, smooth=True)
    >>> [round(curve.sigma, 1) for curve in curves]
    [0.1, 0.1]
    """
    space = space_named(space)
    check_smooth(smooth, duplicates, options)
    weight_options = {key: options.pop(key, None) for key in ("weights", "frames")} if smooth else {}
    names = None
    if checked_flag(skipna, "skipna"):
        weights, frames = (weight_options.get(key) for key in ("weights", "frames"))
        names = np.flatnonzero(without_missing(t, points, space)[2])
        t, points, weights, frames = data_without_missing(t, points, weights, frames, space)
        weight_options = {"weights": weights, "frames": frames} if smooth else {}
    used = _used(weight_options, points, space) if smooth else None
    curves, rows, steps, gap = cut(t, points, space, max_gap, min_points, duplicates, used, names)
    if not curves:
        raise ValidationError(
            f"no segment has {min_points} points: {np.sum(steps > gap)} of {len(steps)} time steps are longer than "
            f"max_gap={max_gap}, and the median step is {np.median(steps) if len(steps) else 0:.3g}"
        )
    curves_with_options = [
        (*curve, {key: _of_rows(value, kept) for key, value in weight_options.items()})
        for curve, kept in zip(curves, rows, strict=True)
    ]
    try:
        fitted = smooth_many(curves_with_options, space, **options) if smooth else fit_many(curves, space, **options)
    except SymsplineError as error:
        raise recounted(error, rows) from None
    return SegmentedCurve(fitted, extrapolate=_policy(options))


def _policy(options: dict[str, Any]) -> Literal[False] | None:
    """Return the extrapolation policy of the whole. Gaps are NaN; other policies apply to single segments only."""
    return False if options.get("extrapolate") is False else None


def check_smooth(smooth: object, duplicates: str, options: dict[str, Any]) -> None:
    """Raise ValidationError if `smooth` is invalid, or does not agree with the other options."""
    if not isinstance(smooth, (bool, np.bool_)):
        raise ValidationError(
            f"smooth must be True or False, not {short_repr(smooth)}. Pass lam, criterion and similar options as "
            "separate keywords."
        )
    if not smooth:
        return
    if duplicates == "mean":
        raise ValidationError("with smooth=True, all points with equal times count. Omit duplicates='mean'.")
    if np.ndim(options.get("knots", 0)) > 0:
        raise ValidationError(
            "knots must be the number of knots of each segment, because segments have different times"
        )


def _used(weight_options: dict[str, Any], points: PointsLike, space: Space) -> NDArray[np.bool_]:
    """Return which points have a nonzero weight."""
    noise = read_precision(**weight_options, space=space, data=read_given(points, space))
    return np.asarray(np.any([of_part.weights > 0 for of_part in noise], axis=0))


def _of_rows(value: Any, rows: NDArray[np.intp]) -> Any:
    """Select the rows of an array that belong to some points; for a product, in every factor."""
    if isinstance(value, tuple):
        return tuple(_of_rows(one, rows) for one in value)
    return None if value is None else np.asarray(value)[rows]


class Cut(NamedTuple):
    """A recording cut into segments.

    Attributes
    ----------
    curves : list of pair
        Times and points of each segment; empty if all segments are too short.
    rows : list of ndarray
        Indices of these points in the recording.
    steps : ndarray
        Differences of neighbouring times, as the core counts them.
    gap : float
        Longest difference within a segment.
    """

    curves: list[tuple[Any, Any]]
    rows: list[NDArray[np.intp]]
    steps: NDArray[np.float64]
    gap: float


def cut(
    t: TimesLike,
    points: PointsLike,
    space: AnySpace | str,
    max_gap: Any,
    min_points: int,
    duplicates: str,
    used: NDArray[np.bool_] | None = None,
    names: NDArray[np.intp] | None = None,
) -> Cut:
    """Cut a recording into the segments that `fit_segments` fits.

    With `used`, only these points count, and their times may repeat. `names` are the indices of the points in warnings.
    """
    space = space_named(space)
    least = whole_number(min_points, "min_points", 2)
    one_of(duplicates, "duplicates", "raise", "first", "mean")
    data = read_given(points, space)
    if data[0].batch:
        raise ValidationError(f"points has batch axes {data[0].batch}, but a recording must be a single curve")
    given, zone = times_of(t, "t")
    time_axis, times = time_axis_of(Moments(given, zone))
    if times.shape != (data[0].nodes,):
        raise ValidationError(f"t has shape {times.shape}, but there are {data[0].nodes} points")
    seconds = time_axis.knots(times)
    if time_axis.plain:
        warn_of_rounded_times(times)
    all_count = used is not None and duplicates == "raise"
    _check_order(times, seconds, "first" if all_count else duplicates)
    arrays = [
        factor._array(part, "points")
        for factor, part in zip(factors_of(space), parts_of(points, space, "points"), strict=True)
    ]
    refuse_missing(without_missing(None, points, space)[2], used)
    # Times stay in the form in which they were given, so that the curves keep time zones and durations.
    moments = as_array(given, "t")
    rows = np.arange(len(seconds))
    if used is not None:
        rows = rows[used]
        arrays, moments, seconds = [a[used] for a in arrays], moments[used], seconds[used]
    new = np.diff(seconds, prepend=-np.inf) > 0
    if not all_count and not new.all():
        starts = np.flatnonzero(new)
        arrays = [_at_once(f, a, starts, duplicates) for f, a in zip(factors_of(space), arrays, strict=True)]
        rows, moments, seconds, new = rows[new], moments[new], seconds[new], new[new]
    gap = _seconds(max_gap, time_axis.dates or time_axis.durations)
    apart = np.diff(seconds) > gap
    # Without a limit, the recording is one curve, whose fit raises an error.
    if used is None and np.isfinite(gap):
        opposite = _opposite(space, arrays) & ~apart
        _warn_of_opposite(opposite, rows if names is None else names[rows], moments)
        apart |= opposite
    cuts = np.flatnonzero(apart) + 1
    segments = [
        slice(a, b)
        for a, b in zip([0, *cuts], [*cuts, len(seconds)], strict=True)
        if np.count_nonzero(new[a:b]) >= least
    ]
    curves = [
        (
            Moments(moments[segment], zone),
            tuple(a[segment] for a in arrays) if isinstance(space, Product) else arrays[0][segment],
        )
        for segment in segments
    ]
    return Cut(curves, [rows[segment] for segment in segments], np.diff(seconds), gap)


def _opposite(space: Space, arrays: list[Array]) -> NDArray[np.bool_]:
    """Return a mask of the neighbours without a unique shortest geodesic between them, in any factor."""
    opposite = np.zeros(max(len(arrays[0]) - 1, 0), bool)
    for factor, points in zip(factors_of(space), arrays, strict=True):
        if isinstance(factor, (Manifold, Quotient)) or not np.isfinite(factor.injectivity_radius):
            continue
        with np.errstate(all="ignore"):
            opposite |= factor._apply("cut_fraction", p=points[:-1], q=points[1:]) >= 1 - _AT_CUT_LOCUS
    return opposite


def _warn_of_opposite(opposite: NDArray[np.bool_], rows: NDArray[np.intp], moments: Array) -> None:
    if not opposite.any():
        return
    i = int(np.argmax(opposite))
    count = int(np.count_nonzero(opposite))
    more = f" (and {count - 1} more such pairs)" if count > 1 else ""
    warn(
        f"`points[{rows[i]}]` and `points[{rows[i + 1]}]`, at t = {moments[i]} and {moments[i + 1]}{more}, lie at each "
        "other's cut locus: no unique shortest geodesic joins them. The recording is divided between them. Add a point "
        "between them to join the two parts.",
        FarPointsWarning,
        node=int(rows[i]),
    )


def _seconds(max_gap: Any, dates: bool) -> float:
    """Return the longest gap as the core counts times."""
    max_gap = seconds_of(max_gap, "max_gap", dates)
    unit = " of seconds, a timedelta64 or a text such as '3h'" if dates else ""
    checked_number(max_gap, f"max_gap must be a number{unit}", lambda x: x == x)
    if not max_gap > 0:
        raise ValidationError(f"max_gap must be more than 0, not {max_gap}")
    return float(max_gap)


def _check_order(times: Array, seconds: NDArray[np.float64], duplicates: str) -> None:
    refuse_nan_times(seconds)
    steps = np.diff(seconds)
    falls = np.flatnonzero(steps < 0)
    if len(falls):
        i = falls[0]
        raise ValidationError(
            f"t[{i + 1}] = {times[i + 1]} is before t[{i}] = {times[i]}. Sort times and points, for instance with "
            "numpy.argsort(t, kind='stable')."
        )
    same = np.flatnonzero(steps == 0)
    if len(same) and duplicates == "raise":
        i = same[0]
        more = f" (and {len(same) - 1} more such pairs)" if len(same) > 1 else ""
        raise ValidationError(
            f"t[{i}] and t[{i + 1}] are both {times[i]}{more}. Pass duplicates='first' to keep the first point of "
            "each time, or duplicates='mean' to average them."
        )


def _at_once(space: Space, points: Array, starts: NDArray[np.intp], duplicates: str) -> Array:
    """Return one point per distinct time, the first or the Karcher mean. Points of other times are not changed.

    Parameters
    ----------
    starts : ndarray of int
        Index of the first point of every time.
    """
    kept = points[starts]
    if duplicates == "first":
        return kept
    counts = np.diff(np.append(starts, len(points)))
    several = counts > 1
    rows = space.project(points[np.repeat(several, counts)])
    means = karcher_mean(space, Groups(rows, counts[several], np.ones(len(rows))))
    kept = kept.astype(kept.dtype if kept.dtype.kind in "fc" else np.float64)
    kept[several] = means
    return kept


# ---- smoothing splines of different lengths ----


def smooth_many(
    curves: Iterable[tuple[Any, Any, dict[str, Any]]],
    space: AnySpace,
    *,
    on_failure: OnFailure = "raise",
    progress: Progress | None = None,
    **options: Any,
) -> list[AnySmoothingSpline]:
    """Fit one spline per curve, each with its own λ.

    Parameters
    ----------
    curves : iterable of tuple
        Times, points and keyword arguments of each curve.
    **options
        Keyword arguments of `make_smoothing_spline` for all curves.

    Raises
    ------
    ValidationError
        If a curve is invalid. The message names the curve.
    ConvergenceError
        If a curve fails. The attribute ``spline`` is the list of all curves.
    """
    check_on_failure(on_failure)
    check_progress(progress)
    given = list(curves)
    splines: list[AnySmoothingSpline] = []
    faults: list[Fault] = []
    noted: list[tuple[int, warnings.WarningMessage]] = []
    for number, (t, points, options_of_curve) in enumerate(given):
        with warnings.catch_warnings(record=True) as seen:
            warnings.simplefilter("always")
            try:
                splines.append(make_smoothing_spline(t, points, space, **options_of_curve, **options))
            except ConvergenceError as error:
                splines.append(error.spline)
                faults.append(Fault(number, UNCONVERGED, f"curve {number}: {error}", node=error.node))
            except ValidationError as error:
                raise error._of_curve(number) from None
        noted += [(number, note) for note in seen]
        if progress is not None:
            progress(number + 1, len(given))
    # All curves share one warning of each kind, which begins with the same words. Numbers differ between curves.
    for kind, words in dict.fromkeys(map(_kind, (note for _, note in noted))):
        first, *more = [(number, note) for number, note in noted if _kind(note) == (kind, words)]
        others = f" (and {len(more)} more curves)" if more else ""
        number, note = first
        warn(f"curve {number}: {note.message}{others}", kind, (number,), getattr(note.message, "node", None))
    if faults:
        raise_or_warn(faults, on_failure, splines)
    return splines


def _kind(note: warnings.WarningMessage) -> tuple[type[Warning], str]:
    words = [word for word in str(note.message).split() if not any(character.isdigit() for character in word)]
    return note.category, " ".join(words[:4])

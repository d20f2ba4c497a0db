"""Recordings with pauses: one curve for each stretch between them."""

from __future__ import annotations

from datetime import timedelta
from typing import Any, Literal, NamedTuple, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import as_array, short_repr, whole_number
from ._core import ValidationError
from ._cubic import CubicSpline
from ._curves.fit import read
from ._functional import fit_many
from ._input import times_of
from ._smoothing import SmoothingSpline
from ._smoothing.many import smooth_many
from ._smoothing.precision import read_precision
from ._spaces import Array, Product, Space, factors_of, parts_of
from ._spaces import space as space_named
from ._time import Moments, time_axis_of
from ._typing import Duplicates, FitOptions, P, PointsLike, SmoothingOptions

_DUPLICATES = ("raise", "first", "mean")
# The mean of points near each other is found by a few steps, each of which leaves the third power of their distance.
_STEPS = 50


@overload
def fit_segments(
    t: ArrayLike,
    points: PointsLike,
    space: Space[P] | str,
    *,
    max_gap: float | timedelta | np.timedelta64,
    min_points: int = 2,
    duplicates: Duplicates = "raise",
    smooth: Literal[True],
    **options: Unpack[SmoothingOptions],
) -> list[SmoothingSpline[P, Any]]: ...


@overload
def fit_segments(
    t: ArrayLike,
    points: PointsLike,
    space: Space[P] | str,
    *,
    max_gap: float | timedelta | np.timedelta64,
    min_points: int = 2,
    duplicates: Duplicates = "raise",
    smooth: Literal[False] = False,
    **options: Unpack[FitOptions],
) -> list[CubicSpline[P]]: ...


def fit_segments(
    t: ArrayLike,
    points: PointsLike,
    space: Space[Any] | str,
    *,
    max_gap: float | timedelta | np.timedelta64,
    min_points: int = 2,
    duplicates: Duplicates = "raise",
    smooth: bool = False,
    **options: Any,
) -> list[Any]:
    """Fit a recording that pauses: cut where neighbouring times are more than ``max_gap`` apart, one curve a piece.

    A curve drawn across a pause swings out far and looks plausible. What lies between the curves is not known.

    Args:
        t: times of the points, not falling, shape (n,): numbers or ``datetime64``.
        points: shape (n, *space.point_shape), for a `Product` a tuple of arrays; a SciPy ``Rotation`` on ``so:3``.
        space: a space or its name.
        max_gap: the longest time between neighbours of one curve, in the unit of t, seconds for dates; or a
            ``timedelta64``.
        min_points: pieces of fewer points are left out; 2 or more.
        duplicates: what happens where a time comes several times: ``"raise"`` an error, keep the ``"first"`` point, or
            take their ``"mean"``, the point from which the directions to them add up to zero.
        smooth: whether the points are noisy: every piece is a `SmoothingSpline` then, with a smoothness and a noise of
            its own. Of points with one time all count, unless the ``"first"`` are to be kept; copies of a
            point are one.
        options: those of `CubicSpline`, or with ``smooth`` those of `make_smoothing_spline`, for all pieces alike;
            ``weights`` and ``frames`` are those of all points, ``knots`` is a number in each piece. Points of weight
            zero are left out before the recording is cut, so that many of them are a pause.

    Returns:
        The curves in the order of time, each a `CubicSpline` or a `SmoothingSpline`: ``curve.t[0]`` and
        ``curve.t[-1]`` are where it begins and ends.

    Raises:
        ValidationError: the input is not what is described above, times fall or repeat, or no piece has ``min_points``.
        CutLocusError, ConvergenceError: as for `fit_many`; the exception's ``.spline`` is the list of all curves.

    >>> import symspline as ss
    >>> t = [0, 1, 1, 2, 14, 15]
    >>> here, there = ss.fit_segments(t, [[0], [1], [2], [4], [0], [3]], "r:1", max_gap=5, duplicates="mean")
    >>> here.t, here.points[:, 0], there.t
    (array([0., 1., 2.]), array([0. , 1.5, 4. ]), array([14., 15.]))

    >>> import numpy as np
    >>> t = np.r_[0:10:0.1, 30:40:0.1]
    >>> y = np.sin(t) + 0.1 * np.random.default_rng(0).standard_normal(200)
    >>> pieces = ss.fit_segments(t, y[:, None], "r:1", max_gap=1, smooth=True)
    >>> [round(piece.sigma, 1) for piece in pieces]
    [0.1, 0.1]
    """
    space = space_named(space)
    check_smooth(smooth, duplicates, options)
    weighing = {key: options.pop(key, None) for key in ("weights", "frames")} if smooth else {}
    used = _used(weighing, points, space) if smooth else None
    curves, rows, steps, gap = cut(t, points, space, max_gap, min_points, duplicates, used)
    if not curves:
        raise ValidationError(
            f"no piece has {min_points} points: {np.sum(steps > gap)} of {len(steps)} steps are longer than "
            f"max_gap={max_gap}, the median step is {np.median(steps) if len(steps) else 0:.3g}"
        )
    if not smooth:
        return fit_many(curves, space, **options)
    own = [
        (*curve, {key: _of_rows(value, kept) for key, value in weighing.items()})
        for curve, kept in zip(curves, rows, strict=True)
    ]
    return smooth_many(own, space, **options)


def check_smooth(smooth: Any, duplicates: str, options: dict[str, Any]) -> None:
    """Raise unless pieces can be smoothed like that, if they are to be."""
    if not isinstance(smooth, (bool, np.bool_)):
        raise ValidationError(
            f"smooth must be True or False, not {short_repr(smooth)}; lam, criterion and the like are "
            "separate keywords"
        )
    if not smooth:
        return
    if duplicates == "mean":
        raise ValidationError("with smooth all points of one time count; leave duplicates='mean' out")
    if np.ndim(options.get("knots", 0)) > 0:
        raise ValidationError(
            "knots: give a number of knots for each piece, or none; pieces have their own times"
        )


def _used(weighing: dict[str, Any], points: Any, space: Space) -> NDArray[np.bool_]:
    """Which noisy points have a weight."""
    found = read_precision(**weighing, space=space, data=read(points, space))
    used: NDArray[np.bool_] = np.any([own.weights > 0 for own in found], axis=0)
    return used


def _of_rows(value: Any, rows: NDArray[np.intp]) -> Any:
    """What belongs to some of the points; of a product in every factor."""
    if isinstance(value, tuple):
        return tuple(_of_rows(one, rows) for one in value)
    return None if value is None else np.asarray(value)[rows]


class Cut(NamedTuple):
    """A recording in pieces.

    Attributes:
        curves: times and points of each; none where all are too short.
        rows: which points these are.
        steps: all between neighbouring times, as the core counts them.
        gap: the longest of a piece.
    """

    curves: list[tuple[Any, Any]]
    rows: list[NDArray[np.intp]]
    steps: NDArray[np.float64]
    gap: float


def cut(
    t: ArrayLike,
    points: Any,
    space: Space[Any] | str,
    max_gap: Any,
    min_points: int,
    duplicates: str,
    used: NDArray[np.bool_] | None = None,
) -> Cut:
    """The pieces as `fit_segments` says; of noisy points those that are used, whose times may repeat."""
    space = space_named(space)
    least = whole_number(min_points, "min_points", 2)
    if not isinstance(duplicates, str) or duplicates not in _DUPLICATES:
        raise ValidationError(f"duplicates must be 'raise', 'first' or 'mean', not {short_repr(duplicates)}")
    data = read(points, space)
    if data[0].batch:
        raise ValidationError(f"points has batch axes {data[0].batch}; a recording is a single curve")
    given, zone = times_of(t, "t")
    clock, times = time_axis_of(Moments(given, zone))
    if times.shape != (data[0].nodes,):
        raise ValidationError(f"t has shape {times.shape}, but there are {data[0].nodes} points")
    seconds = clock.knots(times)
    all_count = used is not None and duplicates == "raise"
    _check_order(times, seconds, "first" if all_count else duplicates)
    arrays = [
        factor._array(part, "points")
        for factor, part in zip(factors_of(space), parts_of(points, space, "points"), strict=True)
    ]
    # As they were given, so that curves know of a zone, and of durations.
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
    gap = _seconds(max_gap, clock.dates)
    cuts = np.flatnonzero(np.diff(seconds) > gap) + 1
    pieces = [
        slice(a, b)
        for a, b in zip([0, *cuts], [*cuts, len(seconds)], strict=True)
        if np.count_nonzero(new[a:b]) >= least
    ]
    curves = [
        (
            Moments(moments[own], zone),
            tuple(a[own] for a in arrays) if isinstance(space, Product) else arrays[0][own],
        )
        for own in pieces
    ]
    return Cut(curves, [rows[own] for own in pieces], np.diff(seconds), gap)


def _seconds(max_gap: Any, dates: bool) -> float:
    """The longest gap as the core counts times."""
    if dates and isinstance(max_gap, (np.timedelta64, timedelta)):
        max_gap = np.timedelta64(max_gap) / np.timedelta64(1, "s")
    if isinstance(max_gap, (bool, np.timedelta64)) or not isinstance(
        max_gap, (int, float, np.integer, np.floating)
    ):
        kind = "a number of seconds or a timedelta64" if dates else "a number"
        raise ValidationError(f"max_gap must be {kind}, not {short_repr(max_gap)}")
    if not max_gap > 0:
        raise ValidationError(f"max_gap must be more than 0, not {max_gap}")
    return float(max_gap)


def _check_order(times: NDArray[Any], seconds: NDArray[np.float64], duplicates: str) -> None:
    bad = np.flatnonzero(~np.isfinite(seconds))
    if len(bad):
        raise ValidationError(f"t[{bad[0]}] = {times[bad[0]]} is not finite")
    steps = np.diff(seconds)
    falls = np.flatnonzero(steps < 0)
    if len(falls):
        i = falls[0]
        raise ValidationError(
            f"t[{i + 1}] = {times[i + 1]} is before t[{i}] = {times[i]}; sort times and points, for instance by "
            "numpy.argsort(t, kind='stable')"
        )
    same = np.flatnonzero(steps == 0)
    if len(same) and duplicates == "raise":
        i = same[0]
        more = f" (and {len(same) - 1} more such pairs)" if len(same) > 1 else ""
        raise ValidationError(
            f"t[{i}] and t[{i + 1}] are both {times[i]}{more}; duplicates='first' keeps the first point of each time, "
            "duplicates='mean' takes their mean"
        )


def _at_once(space: Space, points: Array, starts: NDArray[np.intp], duplicates: str) -> Array:
    """One point for every time, of those from its start to the next; single points stay as they are."""
    kept = points[starts]
    if duplicates == "first":
        return kept
    counts = np.diff(np.append(starts, len(points)))
    several = np.flatnonzero(counts > 1)
    rows = np.repeat(counts > 1, counts)
    group = np.repeat(np.arange(len(several)), counts[several])
    kept = kept.astype(kept.dtype if kept.dtype.kind in "fc" else np.float64)
    kept[several] = _means(space, space.project(points[rows]), group)
    return kept


def _means(space: Space, points: Array, group: NDArray[np.intp]) -> Array:
    """The mean of every group of points that follow each other: where the logarithms add up to zero.

    Source: Karcher, Riemannian center of mass and mollifier smoothing (1977).
    """
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    counts = np.diff(np.append(starts, len(points))).reshape(-1, *[1] * len(space.point_shape))
    means: Array = points[starts]
    floor = 8 * np.finfo(np.float64).eps * space.rounding(means)
    for _ in range(_STEPS):
        step = np.add.reduceat(space.log(means[group], points), starts, axis=0) / counts
        means = space.exp(means, step)
        if (space.norm(means, step) <= floor).all():
            break
    return means

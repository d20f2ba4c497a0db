"""Splines with further points at their end."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .._base.arrays import as_array, refuse, whole_number
from .._base.input import times_of
from .._base.report import INTEGERS, NUMBERS, Columns
from .._base.typing import TimesLike
from .._core import ValidationError
from .._curves.ends import is_closed
from .._curves.fit import Fit, FitProblem, Problem, curve_of, moved_ends, read, read_ends
from .._curves.solve import DEFAULTS
from .._spaces import Array, Doubles, Product, Quotient, Space, factors_of, parts_of

# Adjacent rows of reports that a local fit does not determine for the whole curve, those of which the largest value
# counts, and the one of which the value of the last part counts.
_UNKNOWN = slice(NUMBERS.index("invariant_radius"), NUMBERS.index("alternative_energy") + 1)
_LARGEST = ("residual", "max_step")
_MAXIMA = np.array([[name != "rate"] for name in NUMBERS])
_CONVERGED = INTEGERS.index("converged")


class Local(NamedTuple):
    """The fit of the last part of a curve and of the points that follow it.

    Attributes
    ----------
    t : ndarray
        Knots of the whole curve as the user counts them.
    times : ndarray
        Knots of the whole curve as numbers of the core.
    problem : Problem
        The last part, which begins with the velocity of the curve there.
    kept : int
        Number of segments of the curve before this part.
    """

    t: Array
    times: Doubles
    problem: FitProblem
    kept: int


def local_fit(spline: Any, t: TimesLike, points: Any, lag: int | None) -> Local:
    """Return the problem of a new fit, after validation of the times, the points and the lag."""
    bc_type, space, curve = spline._bc_type, spline.space, spline._curve
    if is_closed(bc_type):
        raise ValidationError("a closed curve has no end to which points can be appended")
    segments = curve.times.shape[-1] - 1
    kept = 0 if lag is None else max(segments - whole_number(lag, "lag", 2), 0)
    new_t, single = _new_times(spline, t)
    batch, parts = curve.batch, curve.parts
    data = read(_with_new(space, parts, points, batch, kept, None if single else new_t.shape[-1]), space)
    if isinstance(space, (Product, Quotient)):
        bc_type = moved_ends(bc_type, space, data)
    ends = read_ends(bc_type, space, batch)
    if kept:
        at = (slice(None),) * len(batch) + (kept,)
        starts = [np.ascontiguousarray(part.space._as_doubles(part.velocities[at])) for part in parts]
        ends = [own and [("velocity", start), own[1]] for own, start in zip(ends, starts, strict=True)]
    shown = np.concatenate([spline._t, new_t], axis=-1)
    times = spline._time_axis.knots(shown)
    last, names = np.ascontiguousarray(times[..., kept:]), range(kept, times.shape[-1])
    return Local(shown, times, Problem(space, last, data, ends, DEFAULTS, names=names), kept)


def _with_new(space: Space[Any], parts: Any, points: Any, batch: tuple[int, ...], kept: int, count: int | None) -> Any:
    """Return the last points of a curve and the new ones; without `count`, there is one without an axis."""
    axis = len(batch)
    tail, one = (slice(None),) * axis + (slice(kept, None),), (slice(None),) * axis + (None,)
    joined = []
    for factor, part, given in zip(factors_of(space), parts, parts_of(points, space, "points"), strict=True):
        new = factor._array(given, "points")
        shape = batch + (() if count is None else (count,)) + factor.point_shape
        if new.shape != shape:
            raise ValidationError(f"points has shape {np.shape(given)}, but {shape} is needed for these times")
        joined.append(np.concatenate([part.points[tail], new[one] if count is None else new], axis=axis))
    return tuple(joined) if isinstance(space, Product) else joined[0]


def _new_times(spline: Any, t: TimesLike) -> tuple[Array, bool]:
    """Return the times of the new points, and whether there is only one point without an axis."""
    if spline._time_axis.plain and spline._t.ndim == 1 and type(t) in (float, int, np.float64):
        # Points that arrive one by one are the usual case.
        time = np.array([t], np.float64)
        if np.isfinite(time[0]) and time[0] > spline._t[-1]:
            return time, True
    # Conversion validates the kind of the times and their time zone.
    later, _ = spline._time_axis.at(t, spline._batch, spline._t.ndim > 1, name="t")
    array = as_array(times_of(t, "t")[0], "t")
    # Durations are shown as seconds.
    array = later if array.dtype.kind == "m" else array
    single = array.ndim == spline._t.ndim - 1
    if (
        array.ndim not in (spline._t.ndim - 1, spline._t.ndim)
        or array.shape[: spline._t.ndim - 1] != spline._t.shape[:-1]
    ):
        raise ValidationError(f"t has shape {array.shape}, but must be one time or the times (m,), as the knots are")
    array, later = (x[..., None] if single else x for x in (array, later))
    known = np.broadcast_to(spline._curve.times[..., -1:], (*later.shape[:-1], 1))
    rises = np.isfinite(later) & (np.diff(np.concatenate([known, later], axis=-1)) > 0)
    last = f"the last knot {spline.domain[1]}" if spline._t.ndim == 1 else "the last knot of its curve"
    advice = f"times must be finite and increase from {last} on. Sort the points, or remove those that the curve has."
    refuse(~(rises[..., 0] if single else rises), "t", lambda i: f"is {array[(*i, 0) if single else i]}, but {advice}")
    return array, single


def joined(spline: Any, found: Fit, local: Local) -> Fit:
    """Return the first segments of a curve, followed by another curve, with the report of both."""
    curve, kept = spline._curve, local.kept
    axis = len(curve.batch)
    head = (slice(None),) * axis + (slice(kept),)
    arrays = [
        (
            np.concatenate([a.points[head], b.points], axis=axis),
            np.concatenate([a.velocities[head], b.velocities], axis=axis),
        )
        for a, b in zip(curve.parts, found.curve.parts, strict=True)
    ]
    columns = [_joined_columns(a, b) for a, b in zip(columns_of(spline), found.columns, strict=True)]
    return Fit(curve_of(spline.space, local.times, arrays), columns, found.method, found.faults)


def _joined_columns(first: Columns, second: Columns) -> Columns:
    """Return the report of a curve whose last part was fitted again, in the arrays of that fit."""
    np.fmax(first.numbers, second.numbers, out=second.numbers, where=_MAXIMA)
    second.numbers[_UNKNOWN] = np.nan
    second.integers[_CONVERGED] &= first.integers[_CONVERGED]
    return second


def columns_of(spline: Any) -> list[Columns]:
    """Return the reports of a spline in each factor as tables, also of one that was loaded."""
    if "_fit" in vars(spline):
        columns: list[Columns] = spline._fit.columns
        return columns
    found = []
    for report in spline._reports:
        own = Columns.empty(np.size(report.converged))
        own.row("converged")[:] = np.ravel(report.converged)
        for name in _LARGEST:
            value = getattr(report, name)
            own.row(name)[:] = np.nan if value is None else np.ravel(value)
        found.append(own)
    return found

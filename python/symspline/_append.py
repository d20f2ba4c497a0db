"""Splines with further points at their end."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ._arrays import as_array, short_repr, whole_number
from ._core import ValidationError
from ._curves.curve import CurveArrays
from ._curves.ends import is_closed
from ._curves.fit import curve_of
from ._input import times_of
from ._report import NUMBERS, Columns
from ._spaces import Array, Product, factors_of, parts_of
from ._time import Moments
from ._typing import TimesLike

# Fields of reports that a local fit does not determine for the whole curve.
_UNKNOWN = ("invariant_radius", "contraction_bound", "guaranteed_sweeps", "alternative_energy")
_LARGEST = ("residual", "max_step", "velocity_error")


class Local(NamedTuple):
    """The data of the last part of a curve and of the points that follow it.

    Attributes
    ----------
    t : TimesLike
        Knots.
    points : ndarray or tuple of ndarray
        Points, in the form in which a user passes them.
    bc_type : pair
        The velocity of the curve at the first knot, and the condition at the last one.
    kept : int
        Number of segments of the curve before this part.
    """

    t: Any
    points: Any
    bc_type: Any
    kept: int


def local_data(spline: Any, t: TimesLike, points: Any, lag: int | None) -> Local:
    """Return the points of a new fit, after validation of the times, the points and the lag."""
    if is_closed(spline.bc_type):
        raise ValidationError("a closed curve has no end to which points can be appended")
    segments = spline._curve.times.shape[-1] - 1
    count = segments if lag is None else min(whole_number(lag, "lag", 2), segments)
    kept = segments - count
    space, axis = spline.space, len(spline._batch)
    tail = (slice(None),) * axis + (slice(kept, None),)
    new_t, single = _new_times(spline, t)
    own = []
    for factor, part, given in zip(
        factors_of(space), spline._curve.parts, parts_of(points, space, "points"), strict=True
    ):
        new = factor._array(given, "points")
        new = new[(slice(None),) * axis + (None,)] if single else new
        if new.shape != (*spline._batch, new_t.shape[-1], *factor.point_shape):
            shape = (*spline._batch, *(() if single else (new_t.shape[-1],)), *factor.point_shape)
            raise ValidationError(f"points has shape {np.shape(given)}, but {shape} is needed for these times")
        own.append(np.concatenate([part.points[tail], new], axis=axis))
    bc_type = spline.bc_type
    if kept:
        start = [part.velocities[(slice(None),) * axis + (kept,)] for part in spline._curve.parts]
        last = bc_type if isinstance(bc_type, str) else bc_type[1]
        bc_type = ((1, tuple(start) if isinstance(space, Product) else start[0]), last)
    joined = np.concatenate([spline._t[..., kept:], new_t], axis=-1)
    times = Moments(joined, spline._time_axis.zone) if spline._time_axis.dates else joined
    return Local(times, tuple(own) if isinstance(space, Product) else own[0], bc_type, kept)


def _new_times(spline: Any, t: TimesLike) -> tuple[Array, bool]:
    """Return the times of the new points, and whether there is only one point without an axis."""
    if spline._time_axis.plain and spline._t.ndim == 1 and type(t) in (float, int, np.float64):
        # Points that arrive one by one are the usual case.
        time = np.array([t], np.float64)
        if np.isfinite(time[0]) and time[0] > spline._t[-1]:
            return time, True
    # Conversion validates the kind of the times and their time zone.
    later, _ = spline._time_axis.at(t, spline._batch, spline._t.ndim > 1)
    array = as_array(times_of(t, "t")[0], "t")
    single = array.ndim == spline._t.ndim - 1
    if (
        array.ndim not in (spline._t.ndim - 1, spline._t.ndim)
        or array.shape[: spline._t.ndim - 1] != spline._t.shape[:-1]
    ):
        raise ValidationError(f"t has shape {array.shape}, but must be one time or the times (m,), as the knots are")
    array, later = (x[..., None] if single else x for x in (array, later))
    known = np.broadcast_to(spline._curve.times[..., -1:], (*later.shape[:-1], 1))
    if not (np.diff(np.concatenate([known, later], axis=-1)) > 0).all():
        raise ValidationError(
            f"t = {short_repr(t)} must increase from the last knot on, {spline.domain[1]}. Sort the "
            "points, or remove those that the curve already has."
        )
    return array, single


def joined_curve(first: CurveArrays, second: CurveArrays, times: Any, kept: int) -> CurveArrays:
    """Return the first segments of one curve, followed by another curve."""
    axis = len(first.batch)
    head = (slice(None),) * axis + (slice(kept),)
    arrays = [
        (
            np.concatenate([a.points[head], b.points], axis=axis),
            np.concatenate([a.velocities[head], b.velocities], axis=axis),
        )
        for a, b in zip(first.parts, second.parts, strict=True)
    ]
    return curve_of(first.space, times, arrays)


def joined_columns(first: Columns, second: Columns) -> Columns:
    """Return the report of a curve whose last part was fitted again."""
    numbers = second.numbers.copy()
    for name in _LARGEST:
        row = NUMBERS.index(name)
        numbers[row] = np.fmax(first.numbers[row], second.numbers[row])
    for name in _UNKNOWN:
        numbers[NUMBERS.index(name)] = np.nan
    joined = Columns(second.integers.copy(), numbers)
    joined.row("converged")[:] &= first.row("converged")
    return joined


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

"""Missing samples of recordings: points with NaN or masked numbers, and times that are NaN or NaT."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import as_array, filled, refuse
from .._base.exceptions import SymsplineError
from .._base.faults import Sample, renamed
from .._base.input import times_of
from .._base.typing import Array, Keywords
from .._core import ValidationError
from .._spaces import AnySpace, Doubles, Product, factors_of, parts_of, space_named
from .fit import Points

Mask = NDArray[np.bool_]
_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def missing_times(times: Array) -> Mask:
    """Return where times are NaN or NaT."""
    return np.isnan(times) if times.dtype.kind in "fmM" else np.zeros(times.shape, bool)


def without_missing(t: object, points: Any, space: AnySpace) -> tuple[Any, Any, Mask]:
    """Return times and points without missing samples, and a mask of the samples that are present in each curve.

    A sample is missing if its time, or a number of its point in any factor, is NaN, NaT or masked. Samples that are
    missing only in some curves of a batch are kept.

    Returns
    -------
    t : array_like or None
        Times; the indices of the samples if no times were given.
    points : array_like or tuple
        Points.
    present : ndarray of bool, shape (..., n)
        Whether each of the given samples is present.
    """
    parts = [factor._array(filled(p), "points") for factor, p in zip(*_factors_and_parts(points, space), strict=True)]
    masks = [missing_points(factor, part) for factor, part in zip(factors_of(space), parts, strict=True)]
    moments = None if t is None else as_array(times_of(filled(t), "t")[0], "t")
    if moments is not None:
        masks.append(missing_times(moments))
    try:
        missing = np.any(np.broadcast_arrays(*masks), axis=0)
    except ValueError:
        # The fit raises an error for these shapes.
        return t, points, ~masks[0]
    if missing.ndim == 0 or not missing.any():
        return t, points, ~missing
    kept = ~missing.all(axis=tuple(range(missing.ndim - 1)))
    times = np.arange(len(kept), dtype=np.float64)[kept] if t is None else rows_of(filled(t), kept)
    return times, _rows_of_points(points, kept, space), ~missing


def curves_without_missing(t: object, points: object, space: AnySpace) -> tuple[Any, Any]:
    """Return times and points of interpolating curves without missing samples.

    Raises
    ------
    ValidationError
        If different samples are missing in the curves of a batch.
    """
    times, present_points, present = without_missing(t, points, space)
    _check_alike(present)
    return times, present_points


def inner_velocities_of_present(t: object, points: object, space: AnySpace, velocities: object) -> Any:
    """Return velocities at some samples, by their indices among the samples that are present."""
    _, _, present = without_missing(t, points, space)
    kept = np.asarray(present.any(axis=tuple(range(present.ndim - 1))))
    if not isinstance(velocities, Mapping) or kept.all():
        return velocities
    place = np.where(kept, np.cumsum(kept) - 1, -1).tolist()
    present_velocities = {}
    for i, vector in velocities.items():
        known = isinstance(i, (int, np.integer)) and 0 <= i < len(place)
        if known and place[i] < 0:
            raise ValidationError(f"velocities has the key {i}, but this point is missing (NaN). Remove the key.")
        present_velocities[place[i] if known else i] = vector
    return present_velocities


def nodes_without_missing(t: object, points: Any, velocities: Any, space: AnySpace) -> tuple[Any, Any, Any]:
    """Return times, points and velocities without samples in which any of these is missing."""
    _, vectors, moving = without_missing(None, velocities, space)
    _, places, present = without_missing(t, points, space)
    if moving.shape != present.shape:
        # The fit raises an error for these shapes.
        return t, points, velocities
    both = present & moving
    _check_alike(both)
    kept = np.asarray(both.any(axis=tuple(range(both.ndim - 1))))
    count = np.arange(len(kept), dtype=np.float64)
    times = rows_of(count if t is None else filled(t), kept)
    places, vectors = (_rows_of_points(values, kept, space) for values in (points, velocities))
    return times, places, vectors


def data_without_missing(
    t: object, points: object, weights: Any, frames: Any, space: AnySpace
) -> tuple[Any, Any, Any, Any]:
    """Return noisy data without missing samples; samples missing only in some curves get the weight zero."""
    times, present_points, present = without_missing(t, points, space)
    kept = np.asarray(present.any(axis=tuple(range(present.ndim - 1))))
    if kept.all() and present.all():
        return times, present_points, weights, frames
    frames = tuple(rows_of(part, kept) for part in frames) if isinstance(frames, tuple) else rows_of(frames, kept)
    return times, present_points, _weights(weights, present, kept), frames


def _weights(weights: Any, present: Mask, kept: Mask) -> Any:
    if isinstance(weights, tuple):
        return tuple(_weights(part, present, kept) for part in weights)
    if weights is None or (present | ~kept).all():
        some = None if (present | ~kept).all() else present[..., kept].astype(np.float64)
        return some if weights is None else rows_of(weights, kept)
    array = as_array(weights, "weights")
    if array.shape[-1:] == kept.shape:
        return (array * present)[..., kept]
    return (array * present[..., None, None])[..., kept, :, :]


def _check_alike(present: Mask) -> None:
    differ = np.argwhere(present.any(axis=tuple(range(present.ndim - 1))) & ~present)
    if len(differ):
        *curve, i = differ[0].tolist()
        raise ValidationError(
            f"points[{i}] of curve {','.join(map(str, curve))} is missing (NaN), but not in all curves of the batch, "
            "so that the curves have different lengths. Pass the curves to symspline.fit_many with skipna=True."
        )


def _rows_of_points(points: Any, kept: Mask, space: AnySpace) -> Any:
    def rows(factor: AnySpace, part: Any) -> Any:
        index: Any = (..., kept, *[slice(None)] * len(factor.point_shape))
        return factor._array(filled(part), "points")[index]

    present_parts = tuple(map(rows, *_factors_and_parts(points, space)))
    return present_parts if isinstance(space, Product) else present_parts[0]


def rows_of(value: Any, kept: Mask) -> Any:
    """Return the rows of a value that has one per sample; other values, such as one number for all, do not change."""
    if value is None or np.ndim(value) == 0:
        return value
    if isinstance(value, (list, tuple)):
        return [row for row, keep in zip(value, kept, strict=True) if keep] if len(value) == len(kept) else value
    if not isinstance(value, np.ndarray):
        return value[kept] if len(value) == len(kept) else value
    if value.shape[0] == len(kept):
        return value[kept]
    axis = next((i for i in range(value.ndim - 1, 0, -1) if value.shape[i] == len(kept)), None)
    return value if axis is None else np.compress(kept, value, axis=axis)


def recounting(
    rows_present: Callable[[Keywords], list[NDArray[np.intp]]],
) -> Callable[[Callable[_Arguments, _Result]], Callable[_Arguments, _Result]]:
    """Return a decorator for functions with `skipna`: indices in their errors then also count the missing samples.

    The argument returns, from the arguments by name, the rows that are present in each recording.
    """

    def decorator(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
        @functools.wraps(function)
        def counting(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
            try:
                return function(*args, **kwargs)
            except SymsplineError as error:
                skipna = kwargs.get("skipna")
                if not isinstance(skipna, (bool, np.bool_)) or not skipna:
                    raise
                # The error may be about the arguments from which the rows would follow.
                with suppress(Exception):
                    given = inspect.signature(function).bind(*args, **kwargs).arguments
                    error = recounted(error, rows_present(given))
                raise error from None

        return counting

    return decorator


def _rows_of_recordings(given: Keywords) -> list[NDArray[np.intp]]:
    vectors = given.get("velocities")
    extra = [] if vectors is None or isinstance(vectors, Mapping) else [(None, vectors)]
    curves = given["curves"] if "curves" in given else [(given["t"], given["points"])]
    return [_rows_present([curve, *extra], given["space"]) for curve in curves]


def _rows_present(data: Iterable[tuple[Any, Any]], space: AnySpace) -> NDArray[np.intp]:
    """Return the indices of the samples that are present in all of several recordings with the same times."""
    masks = [without_missing(t, points, space_named(space))[2] for t, points in data]
    return np.flatnonzero(np.all([mask.any(axis=tuple(range(mask.ndim - 1))) for mask in masks], axis=0))


counts_all_samples = recounting(_rows_of_recordings)


def recounted(error: SymsplineError, rows: Sequence[NDArray[np.intp]]) -> SymsplineError:
    """Return an error whose message counts all samples of the user, including those that were omitted."""

    def name(sample: Sample) -> tuple[str, int]:
        known = (sample.measurement, sample.curve, *(error.curve or ()), 0)
        number = next(number for number in known if number is not None)
        present = rows[min(number, len(rows) - 1)]
        return sample.argument, int(present[sample.node]) if sample.node < len(present) else sample.node

    return renamed(error, name)


def with_remedy(
    error: ValidationError, data: Sequence[Points], times: Doubles | None = None, of_many: bool = False
) -> ValidationError:
    """Return the error, with a remedy if it is about a sample that is missing.

    Data and times are those of the curves together, or with `of_many` those of the curve that the error is about.
    """
    if error.node is None:
        return error
    at = (*(() if of_many else error.curve or ()), error.node)
    if times is not None and np.isnan(times[at if times.ndim > 1 else error.node]):
        return error._with_message(f"{error}. Pass skipna=True to omit missing samples.")
    # A batch without curves has knots, and no points.
    if any(part.numbers.size and np.isnan(part.numbers[at]).any() for part in data):
        return error._with_message(f"{error}. Pass skipna=True to omit missing points (NaN).")
    return error


def refuse_missing(present: Mask, used: Mask | None = None) -> None:
    """Raise ValidationError for the first sample that is missing, among those that are used."""
    gone = np.flatnonzero(~present if used is None else used & ~present)
    if len(gone):
        more = f" ({len(gone)} of {len(present)} points are)" if len(gone) > 1 else ""
        raise ValidationError(f"points[{gone[0]}] is missing (NaN){more}. Pass skipna=True to omit such points.")


def refuse_nan_times(times: NDArray[np.float64]) -> None:
    """Raise ValidationError for the first time that is not finite."""

    def described(i: Any) -> str:
        remedy = ". Pass skipna=True to omit missing samples." if np.isnan(times[i]) else ""
        return f"is {times[i]}; times must be finite{remedy}"

    refuse(~np.isfinite(times), "t", described)


def _factors_and_parts(points: Any, space: AnySpace) -> tuple[tuple[AnySpace, ...], tuple[Any, ...]]:
    return factors_of(space), parts_of(points, space, "points")


def missing_points(factor: AnySpace, array: Array) -> Mask:
    """Return where a number of a point of a space that is not a product is NaN. Infinite numbers are not missing."""
    axes = tuple(range(max(0, array.ndim - len(factor.point_shape)), array.ndim))
    if array.dtype.kind not in "fc":
        return np.zeros(array.shape[: axes[0]] if axes else (), bool)
    return np.asarray(np.isnan(array).any(axis=axes))

"""Missing samples of recordings: points with NaN or masked numbers, and times that are NaN or NaT."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import as_array, filled, refuse
from .._base.exceptions import SymsplineError
from .._base.input import times_of
from .._core import ValidationError
from .._spaces import Product, Space, factors_of, parts_of, space_named
from .fit import Points

Mask = NDArray[np.bool_]
# Parts of the core's messages about times and points that are not finite.
_NAN_TIME = "is NaN; times must be finite"
_NOT_FINITE = "No point is close to it; correct it or remove it"
# Samples in messages: `points[3]`, `t[0][3]` of the first curve, `measurements[0].y: point 3`.
_SAMPLE = re.compile(r"\b(t|points|velocities|omega|measurements\[(\d+)\]\.\w+)(?:\[(\d+)\](?=\[))?(\[|: point )(\d+)")

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def missing_times(times: NDArray[Any]) -> Mask:
    """Return where times are NaN or NaT."""
    return np.isnan(times) if times.dtype.kind in "fmM" else np.zeros(times.shape, bool)


def without_missing(t: Any, points: Any, space: Space[Any]) -> tuple[Any, Any, Mask]:
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
    parts = [factor._array(filled(p), "points") for factor, p in zip(*_each(points, space), strict=True)]
    found = [missing_points(factor, part) for factor, part in zip(factors_of(space), parts, strict=True)]
    moments = None if t is None else as_array(times_of(filled(t), "t")[0], "t")
    if moments is not None:
        found.append(missing_times(moments))
    try:
        missing = np.any(np.broadcast_arrays(*found), axis=0)
    except ValueError:
        # The fit raises an error for these shapes.
        return t, points, ~found[0]
    if missing.ndim == 0 or not missing.any():
        return t, points, ~missing
    kept = ~missing.all(axis=tuple(range(missing.ndim - 1)))
    times = np.arange(len(kept), dtype=np.float64)[kept] if t is None else rows_of(filled(t), kept)
    return times, _rows_of_points(points, kept, space), ~missing


def curves_without_missing(t: Any, points: Any, space: Space[Any]) -> tuple[Any, Any]:
    """Return times and points of interpolating curves without missing samples.

    Raises
    ------
    ValidationError
        If different samples are missing in the curves of a batch.
    """
    times, own, present = without_missing(t, points, space)
    _check_alike(present)
    return times, own


def inner_velocities_of_present(t: Any, points: Any, space: Space[Any], velocities: Any) -> Any:
    """Return velocities at some samples, by their indices among the samples that are present."""
    _, _, present = without_missing(t, points, space)
    kept = np.asarray(present.any(axis=tuple(range(present.ndim - 1))))
    if not isinstance(velocities, Mapping) or kept.all():
        return velocities
    place = np.where(kept, np.cumsum(kept) - 1, -1).tolist()
    found = {}
    for i, vector in velocities.items():
        known = isinstance(i, (int, np.integer)) and 0 <= i < len(place)
        if known and place[i] < 0:
            raise ValidationError(f"velocities has the key {i}, but this point is missing (NaN). Remove the key.")
        found[place[i] if known else i] = vector
    return found


def nodes_without_missing(t: Any, points: Any, velocities: Any, space: Space[Any]) -> tuple[Any, Any, Any]:
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
    places, vectors = (_rows_of_points(own, kept, space) for own in (points, velocities))
    return times, places, vectors


def data_without_missing(
    t: Any, points: Any, weights: Any, frames: Any, space: Space[Any]
) -> tuple[Any, Any, Any, Any]:
    """Return noisy data without missing samples; samples missing only in some curves get the weight zero."""
    times, own, present = without_missing(t, points, space)
    kept = np.asarray(present.any(axis=tuple(range(present.ndim - 1))))
    if kept.all() and present.all():
        return times, own, weights, frames
    frames = tuple(rows_of(part, kept) for part in frames) if isinstance(frames, tuple) else rows_of(frames, kept)
    return times, own, _weights(weights, present, kept), frames


def _weights(weights: Any, present: Mask, kept: Mask) -> Any:
    if isinstance(weights, tuple):
        return tuple(_weights(own, present, kept) for own in weights)
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


def _rows_of_points(points: Any, kept: Mask, space: Space[Any]) -> Any:
    def rows(factor: Space[Any], part: Any) -> Any:
        index: Any = (..., kept, *[slice(None)] * len(factor.point_shape))
        return factor._array(filled(part), "points")[index]

    own = tuple(map(rows, *_each(points, space)))
    return own if isinstance(space, Product) else own[0]


def rows_of(value: Any, kept: Mask) -> Any:
    """Return the rows of a value that has one per sample; other values, such as one number for all, do not change."""
    if value is None or np.ndim(value) == 0:
        return value
    if isinstance(value, (list, tuple)):
        return [own for own, keep in zip(value, kept, strict=True) if keep] if len(value) == len(kept) else value
    if not isinstance(value, np.ndarray):
        return value[kept] if len(value) == len(kept) else value
    if value.shape[0] == len(kept):
        return value[kept]
    axis = next((i for i in range(value.ndim - 1, 0, -1) if value.shape[i] == len(kept)), None)
    return value if axis is None else np.compress(kept, value, axis=axis)


def recounting(
    rows_present: Callable[[dict[str, Any]], list[NDArray[np.intp]]],
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


def _rows_of_recordings(given: dict[str, Any]) -> list[NDArray[np.intp]]:
    vectors = given.get("velocities")
    extra = [] if vectors is None or isinstance(vectors, Mapping) else [(None, vectors)]
    curves = given["curves"] if "curves" in given else [(given["t"], given["points"])]
    return [_rows_present([own, *extra], given["space"]) for own in curves]


def _rows_present(data: Iterable[tuple[Any, Any]], space: Any) -> NDArray[np.intp]:
    """Return the indices of the samples that are present in all of several recordings with the same times."""
    found = [without_missing(t, points, space_named(space))[2] for t, points in data]
    return np.flatnonzero(np.all([own.any(axis=tuple(range(own.ndim - 1))) for own in found], axis=0))


counts_all_samples = recounting(_rows_of_recordings)


def recounted(error: SymsplineError, rows: Sequence[NDArray[np.intp]]) -> SymsplineError:
    """Return an error about selected rows of recordings with the indices of these rows, given for each recording."""

    def index(match: re.Match[str]) -> str:
        name, measurement, curve, opening, i = match.groups()
        own = rows[min(int(measurement or curve or (error.curve or [0])[0]), len(rows) - 1)]
        first = "" if curve is None else f"[{curve}]"
        return f"{name}{first}{opening}{own[int(i)] if int(i) < len(own) else i}"

    return error._with_message(_SAMPLE.sub(index, str(error)))


@contextmanager
def missing_named(data: Iterable[Points]) -> Iterator[None]:
    """Add the remedy ``skipna=True`` to an error about points that are missing."""
    try:
        yield
    except ValidationError as error:
        raise with_remedy(error, data) from None


def with_remedy(error: ValidationError, data: Iterable[Points]) -> ValidationError:
    """Return the error, with the remedy ``skipna=True`` if points are missing."""
    if _NAN_TIME in str(error):
        return error._with_message(f"{error}. Pass skipna=True to omit missing samples.")
    if _NOT_FINITE not in str(error):
        return error
    missing = sum(int(np.isnan(part.numbers).any(axis=-1).sum()) for part in data)
    if not missing:
        return error
    return error._with_message(f"{error}. Pass skipna=True to omit missing points (NaN).")


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


def _each(points: Any, space: Space[Any]) -> tuple[tuple[Space[Any], ...], tuple[Any, ...]]:
    return factors_of(space), parts_of(points, space, "points")


def missing_points(factor: Space[Any], array: NDArray[Any]) -> Mask:
    """Return where a number of a point of a space that is not a product is NaN. Infinite numbers are not missing."""
    axes = tuple(range(max(0, array.ndim - len(factor.point_shape)), array.ndim))
    if array.dtype.kind not in "fc":
        return np.zeros(array.shape[: axes[0]] if axes else (), bool)
    return np.asarray(np.isnan(array).any(axis=axes))

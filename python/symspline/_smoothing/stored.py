"""Entries of NPZ files for smoothing splines: the data and the properties of the noise."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._archive import SMOOTHING, plain, times_arrays
from .._arrays import short_repr
from .._core import ValidationError
from .._curves.curve import CurveArrays
from .._spaces import Product, Space, factors_of
from .._time import TimeAxis
from .data import SmoothingData
from .factors import is_several, smoothed_spaces
from .precision import Precision
from .report import SmoothingReport
from .solve import Smoothed

_KINDS = {"converged": "b", "iterations": "i", "at_bound": "b"}
_NUMBERS = ("step", "rate", "lam", "df", "sigma", "band_lam", "scale")


def noisy_arrays(space: Space[Any], noisy: SmoothingData, smoothed: list[Smoothed]) -> dict[str, Any]:
    """Return the entries of a smoothing spline besides those of the curve."""
    arrays: dict[str, Any] = {
        "format": SMOOTHING,
        **times_arrays("data_t", noisy.t, noisy.clock),
        "noise": json.dumps([_plain(found) for found in smoothed]),
    }
    first, *others = noisy.weighing
    alike = all(np.array_equal(first.weights, own.weights) for own in others)
    if alike:
        arrays["data_weights"] = first.weights
    for i, points in enumerate(noisy.points):
        arrays["data" + (f"_{i}" if isinstance(space, Product) else "")] = points
    for i, (weighing, found) in enumerate(zip(noisy.weighing, smoothed, strict=True)):
        suffix = _suffix(space, i)
        arrays["band" + suffix] = found.band
        if not alike:
            arrays["data_weights" + suffix] = weighing.weights
        if weighing.information is not None:
            arrays["data_information" + suffix] = weighing.information
    return arrays


def _suffix(space: Space, i: int) -> str:
    """Return the suffix of entries for the i-th space in which data were smoothed."""
    return f"_{i}" if is_several(space) else ""


def _plain(found: Smoothed) -> dict[str, Any]:
    numbers = vars(found.report) | {"band_lam": found.band_lam, "scale": found.sigma}
    return {key: plain(value) for key, value in numbers.items()} | {"between": found.between}


def read_stored(
    arrays: Mapping[str, NDArray[Any]], clock: TimeAxis, t: NDArray[Any], curve: CurveArrays, closed: bool
) -> tuple[SmoothingData, list[Smoothed]]:
    """Return the data of a curve and the properties of their noise from the entries of a file.

    Parameters
    ----------
    clock, t
        Time axis and times of the data.
    closed : bool
        Whether the curve is closed.

    Raises
    ------
    ValidationError
        If an entry is invalid.
    """
    space, batch, times = curve.space, curve.batch, clock.knots(t)
    count, knots = times.shape[-1], curve.times.shape[-1]
    if times.shape not in ((count,), (*batch, count)):
        raise ValidationError(f"the times of the data have shape {times.shape}")
    if not (np.isfinite(times).all() and (np.diff(times) >= 0).all()):
        raise ValidationError("the times of the data are not finite, or decrease")
    if np.any(times[..., 0] < curve.times[..., 0]) or np.any(times[..., -1] > curve.times[..., -1]):
        raise ValidationError("there are data before the first or after the last knot")
    points, weighing, smoothed = [], [], []
    for i, factor in enumerate(factors_of(space)):
        name = f"data_{i}" if isinstance(space, Product) else "data"
        rows = factor._numbers(factor._doubles(arrays[name], name))
        if rows.shape != (*batch, count, *factor.point_shape):
            raise ValidationError(f"the data have shape {rows.shape}")
        # Masked curves are NaN, and so are their data.
        own = curve.parts[i].points
        there = np.isfinite(own).all(axis=tuple(range(len(batch), own.ndim)))
        factor.check_point(rows[there])
        points.append(rows)
    parts = zip(smoothed_spaces(space), json.loads(str(arrays["noise"])), strict=True)
    for i, (part, numbers) in enumerate(parts):
        suffix = _suffix(space, i)
        weighing.append(_weighing(arrays, suffix, part.dim, batch, count))
        band = arrays["band" + suffix]
        # The first coefficients of a closed curve are repeated at the end.
        _check_shape("the band", band, (*batch, knots + (2 if closed else 0), 4))
        found = _smoothed(numbers, band, batch)
        if not np.isfinite(band[np.asarray(found.report.converged)]).all():
            raise ValidationError("the band is not finite")
        smoothed.append(found)
    return SmoothingData(clock, t, times, points, weighing, batch), smoothed


def _weighing(
    arrays: Mapping[str, NDArray[Any]], suffix: str, m: int, batch: tuple[int, ...], count: int
) -> Precision:
    """Return the weights of the data in one factor."""
    own = "data_weights" + suffix
    weights = arrays[own if own in arrays else "data_weights"]
    _check_shape("the weights", weights, (count,), (*batch, count))
    if not (np.isfinite(weights) & (weights >= 0)).all():
        raise ValidationError("the weights are not numbers >= 0")
    information = arrays.get("data_information" + suffix)
    if information is not None:
        _check_shape("the information matrices", information, (count, m, m), (*batch, count, m, m))
        if not np.isfinite(information).all():
            raise ValidationError("the information matrices are not finite")
    return Precision(weights, information)


def _check_shape(what: str, array: NDArray[Any], *shapes: tuple[int, ...]) -> None:
    if array.dtype != np.float64 or array.shape not in shapes:
        raise ValidationError(f"{what} are {array.dtype} of shape {array.shape}")


def _smoothed(numbers: dict[str, Any], band: NDArray[np.float64], batch: tuple[int, ...]) -> Smoothed:
    method = numbers.pop("method")
    if method not in ("linearized", "newton"):
        raise ValidationError(f"the method of the smoothing is {short_repr(method)}")
    between = numbers.pop("between")
    if not isinstance(between, bool):
        raise ValidationError(f"between of the smoothing is {short_repr(between)}")
    columns = {}
    for key, kind in (_KINDS | dict.fromkeys(_NUMBERS, "f")).items():
        value = numbers.pop(key)
        array = np.asarray(value)
        if array.shape != batch or array.dtype.kind != kind:
            raise ValidationError(f"{key} of the smoothing is {short_repr(value)}")
        columns[key] = array if batch else value
    if numbers:
        raise ValidationError(f"the smoothing has unknown entries: {short_repr(list(numbers))}")
    band_lam, scale = columns.pop("band_lam"), columns.pop("scale")
    return Smoothed(SmoothingReport(method, **columns), band, band_lam, scale, between)

"""Measurements without missing samples."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from .._base.arrays import as_array, filled
from .._base.input import times_of
from .._curves.missing import Mask, missing_times, recounting, rows_of
from .measurements import Constant, Function, Measurement


def measurement_without_missing(given: Measurement) -> Measurement:
    """Return a measurement without the samples in which a number or the time is NaN, NaT or masked."""
    present = _present_in(given)
    if present.all():
        return given
    found = copy(given)
    for name, value in {"t": filled(given.t), **_values(given)}.items():
        setattr(found, name, _rows(value, present))
    return found


def _values(given: Measurement) -> dict[str, Any]:
    """Return the arrays of a measurement besides its times."""
    return {
        name: filled(value)
        for name, value in vars(given).items()
        if name != "t" and not isinstance(value, (Constant, str)) and value is not None
    }


def _present_in(given: Measurement) -> Mask:
    t = as_array(times_of(filled(given.t), "t")[0], "t")
    present = ~missing_times(t)
    if isinstance(given, Function) or t.ndim != 1:
        return np.ones_like(present)
    for name, value in _values(given).items():
        if name not in ("sigma", "weights", "frames"):
            present = present & _present(value, len(t))
    return present


counts_all_samples = recounting(lambda given: [np.flatnonzero(_present_in(own)) for own in given["measurements"]])


def _present(value: Any, count: int) -> Mask:
    if isinstance(value, tuple):
        return np.asarray(np.all([_present(part, count) for part in map(filled, value)], axis=0))
    array = np.asarray(value)
    if array.dtype.kind not in "fc" or array.shape[:1] != (count,):
        return np.ones(count, bool)
    return np.asarray(~np.isnan(array).any(axis=tuple(range(1, array.ndim))))


def _rows(value: Any, present: Mask) -> Any:
    return (
        tuple(_rows(filled(part), present) for part in value) if isinstance(value, tuple) else rows_of(value, present)
    )

"""Equality of objects that contain arrays."""

from __future__ import annotations

from typing import Any

import numpy as np


def same(first: Any, second: Any) -> bool:
    """Whether two values are equal. Arrays are compared as a whole, and missing numbers are equal.

    Examples
    --------
    >>> same((np.zeros(2), None), (np.zeros(2), None))
    True
    """
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        a, b = np.asarray(first), np.asarray(second)
        kinds = a.dtype.kind + b.dtype.kind
        return a.shape == b.shape and bool(np.array_equal(a, b, equal_nan=set(kinds) <= set("fcmM")))
    if isinstance(first, tuple) and isinstance(second, tuple):
        return len(first) == len(second) and all(map(same, first, second))
    return bool(first == second)


def same_fields(first: Any, second: Any) -> bool:
    """Whether two objects of one class have equal attributes."""
    return same(tuple(vars(first).values()), tuple(vars(second).values()))

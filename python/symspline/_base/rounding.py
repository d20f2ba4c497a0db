"""Tolerance for points off a manifold, from the accuracy of their numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Tolerances for numbers in double precision, for numbers that were stored in single precision or in text with up to
# nine significant digits, and for numbers with very few decimals. Nine significant digits identify a number in single
# precision.
POINT_TOL, POINT_TOL_ROUNDED, POINT_TOL_LARGEST = 1e-8, 1e-4, 5e-3
_DIGITS = 9
# Up to this many points of large arrays are inspected.
_SAMPLE = 500
# The accuracy is that of more than this share of the numbers.
_MOST = 0.75
# Tolerance of the test for whole numbers after multiplication by a power of ten.
_ROUNDING = 2e-6
# Relative difference from single precision of such numbers that were written with ten significant digits or more.
_NEAR_SINGLE = 1e-10
_BITS_SINGLE = 2.0**24


def point_tol(numbers: NDArray[Any], size: int | None = None) -> float:
    """Return the largest distance from the manifold of points that consist of these numbers.

    Rounding changes every number by at most half a unit in the last decimal. The tolerance for single precision is
    larger than its rounding error, because errors of computations in single precision add up. The majority of the
    numbers determines the tolerance, so that a single wrong point does not affect it.

    Parameters
    ----------
    numbers : ndarray
        Numbers of the points as passed by the user. Numbers that are not finite are ignored.
    size : int, optional
        How many numbers a point consists of, by default the length of the last axis.

    Examples
    --------
    >>> import numpy as np
    >>> point_tol(np.array([1 / 3, 2 / 3])), point_tol(np.array([0.333333, 0.666667]))
    (1e-08, 0.0001)
    >>> round(point_tol(np.array([0.424, 0.906])), 6)
    0.000707
    """
    count = numbers.size
    if numbers.dtype.kind not in "fc" or not count or numbers.itemsize < 8 or numbers.dtype == np.complex64:
        return dtype_tol(numbers.dtype)
    # Usually these three numbers have full precision, and no others are inspected.
    for i in (0, count // 2, count - 1):
        x = numbers.item(i).real
        mantissa = abs(math.frexp(x)[0]) * _BITS_SINGLE % 1.0
        margin = _NEAR_SINGLE * _BITS_SINGLE
        if float(f"{x:.{_DIGITS}g}") == x or not margin < mantissa < 1 - margin:
            return _tol_of_rounded(numbers, size or (numbers.shape[-1] if numbers.ndim else 1))
    return POINT_TOL


def dtype_tol(dtype: np.dtype[Any]) -> float:
    """Return the tolerance for points with this data type."""
    if dtype == np.float16:
        return POINT_TOL_LARGEST
    return POINT_TOL_ROUNDED if dtype in (np.float32, np.complex64) else POINT_TOL


def _tol_of_rounded(numbers: NDArray[Any], size: int) -> float:
    rows = numbers.reshape(-1, size)
    rows = rows[:: len(rows) // _SAMPLE + 1]
    if rows.dtype.kind == "c":
        rows = np.concatenate([rows.real, rows.imag], axis=1)
    with np.errstate(all="ignore"):
        rows = np.abs(rows.astype(np.float64))
        sizes = rows.max(axis=1)
        used = np.isfinite(sizes) & (sizes > 0)
        # Whole numbers are exact.
        x = rows[used][~_are_whole(rows[used])]
        single = np.abs(x - x.astype(np.float32)) <= _NEAR_SINGLE * x
        rounded = single | _are_whole(x * 10.0 ** (_DIGITS - 1 - np.floor(np.log10(x))))
        if np.count_nonzero(rounded) <= _MOST * len(x):
            return POINT_TOL
        decimals = next((d for d in range(1, _DIGITS) if np.mean(_are_whole(x * 10.0**d)) > _MOST), _DIGITS)
        rounding = 0.5 * math.sqrt(rows.shape[1]) * 10.0**-decimals / max(1.0, sizes[used].min())
    return float(min(max(POINT_TOL_ROUNDED, rounding), POINT_TOL_LARGEST))


def _are_whole(x: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.asarray(np.abs(x - np.rint(x)) <= _ROUNDING)

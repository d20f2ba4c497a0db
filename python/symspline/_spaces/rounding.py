"""How far points may be off a manifold: the rounding of their numbers, by their accuracy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Tolerances for numbers in double precision, for numbers that went through single precision or text of up to nine
# significant digits, and for numbers of very few decimals. Nine decimals identify a number in single precision.
POINT_TOL, POINT_TOL_ROUNDED, POINT_TOL_LARGEST = 1e-8, 1e-4, 5e-3
_DIGITS = 9
# Of large arrays some hundred points are inspected.
_SAMPLE = 500
# Share of numbers that decides.
_MOST = 0.75
# Rounding errors of products by powers of ten, in units of the last of nine decimals.
_ROUNDING = 2e-6
# Numbers of single precision that were written with ten decimals or more differ from single precision by less.
_NEAR_SINGLE = 1e-10
_BITS_SINGLE = 2.0**24


def point_tol(numbers: NDArray[Any], size: int | None = None) -> float:
    """Return the largest distance from the manifold of points that consist of these numbers.

    Rounding moves a point by at most half a unit in the last decimal of every number. Points in single precision are
    often results of a computation in single precision, whose errors add up; they have more tolerance. Most of the
    numbers decide, so that a single wrong point does not affect the others.

    Parameters
    ----------
    numbers : ndarray
        Numbers of the points as the user gave them. Numbers that are not finite do not count.
    size : int, optional
        Count of the numbers of a point, by default the length of the last axis.

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
    # Usually these numbers are accurate, and no others are inspected.
    for i in (0, count // 2, count - 1):
        x = numbers.item(i).real
        mantissa = abs(math.frexp(x)[0]) * _BITS_SINGLE % 1.0
        margin = _NEAR_SINGLE * _BITS_SINGLE
        if float(f"{x:.{_DIGITS}g}") == x or not margin < mantissa < 1 - margin:
            return _tol_of_rounded(numbers, size or (numbers.shape[-1] if numbers.ndim else 1))
    return POINT_TOL


def dtype_tol(dtype: np.dtype[Any]) -> float:
    """Return the tolerance for all points with this type of numbers."""
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

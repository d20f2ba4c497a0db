"""Arrays as a user gives them: their conversion, validation, tolerances and equality."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from .._core import ValidationError
from .input import refuse_objects, to_numpy
from .typing import Array


def as_array(value: ArrayLike, name: str) -> Array:
    """The value as an array; ragged nested lists, masked numbers and objects are an error of the caller's."""
    if type(value) is np.ndarray and value.dtype.kind != "O":
        return value
    value = to_numpy(value, name)
    masked = _first_masked(value)
    if masked is not None:
        raise ValidationError(
            f"{name}{list(masked) or ''} is masked, but masked entries have no value. Remove missing entries, or pass "
            "skipna=True to a function that has this option."
        )
    try:
        array = np.asarray(value)
    except ValueError:
        raise ValidationError(
            f"{name} is not an array of equally long rows: rows differ in length or shape; give all of them the same"
        ) from None
    if array.dtype.kind == "O":
        refuse_objects(array, name)
    return array


def filled(value: object) -> Any:
    """Replace masked numbers by NaN and masked times by NaT, also within lists."""
    if isinstance(value, np.ma.MaskedArray):
        missing: Any = np.array("NaT", value.dtype)[()] if value.dtype.kind in "mM" else np.nan
        numbers: Any = value if value.dtype.kind in "fcmM" else value.astype(np.float64)
        return numbers.filled(missing)
    if isinstance(value, list) and any(issubclass(kind, np.ma.MaskedArray) for kind in set(map(type, value))):
        return [filled(entry) for entry in value]
    return value


def _first_masked(value: object) -> tuple[int, ...] | None:
    """The index of the first masked number of an array, or of a list of arrays."""
    if isinstance(value, np.ma.MaskedArray):
        masked = np.argwhere(np.ma.getmaskarray(value))
        return tuple(masked[0].tolist()) if len(masked) else None
    if isinstance(value, (list, tuple)) and any(issubclass(kind, np.ma.MaskedArray) for kind in set(map(type, value))):
        for i, row in enumerate(value):
            index = _first_masked(row)
            if index is not None:
                return i, *index
    return None


def short_repr(value: object) -> str:
    """A value in a message: on one line, and not too long."""
    if isinstance(value, np.ndarray) and value.size > 1000:
        # With many short axes NumPy would write out all of it.
        return f"an array of shape {value.shape}"
    # Scalars of NumPy are shown as numbers and dates, without the names of their types.
    return brief(str(value) if isinstance(value, (np.number, np.datetime64, np.timedelta64)) else repr(value))


def brief(text: object, most: int = 150) -> str:
    """A text on one line, and not too long."""
    # More than is shown is not looked at, except for a space at its end.
    line = " ".join(str(text)[: 4 * most].split())
    # What a terminal would obey, such as an escape character of a name in a file, is written out.
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)
    return line if len(line) <= most else f"{line[:most]}…"


def cast(array: Array, dtype: Any = np.float64) -> Array:
    """The numbers in contiguous, aligned memory and of a type; those it cannot hold become infinite or zero."""
    if array.dtype == dtype:
        flags = array.flags
        # Arrays in memory that others laid out, such as columns of packed records, may begin anywhere.
        if flags.c_contiguous and flags.aligned:
            return array
    bytes_needed = math.prod(array.shape) * np.dtype(dtype).itemsize
    # Broadcast arrays can have more entries than fit into memory.
    if bytes_needed >= 2**63:
        raise MemoryError(
            f"an array of shape {array.shape} needs {bytes_needed / 1e9:.3g} GB of memory. Process it in parts."
        )
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        return np.require(array, dtype, ["C", "ALIGNED"])


def read_only(array: Array) -> Array:
    """A view that cannot be written to."""
    view = array.view()
    view.flags.writeable = False
    return view


def whole_number(value: object, name: str, least: int) -> int:
    """A whole number that fits into a machine word."""
    if isinstance(value, (bool, np.timedelta64)) or not isinstance(value, (int, np.integer)):
        raise ValidationError(f"{name} must be a whole number, not {short_repr(value)}")
    if not least <= int(value) < 2**62:
        raise ValidationError(f"{name} must be at least {least} and not beyond 2**62, not {value}")
    return int(value)


def checked_flag(value: object, name: str) -> bool:
    """True or False; of an array neither would be meant."""
    if not isinstance(value, (bool, np.bool_)):
        raise ValidationError(f"{name} must be True or False, not {short_repr(value)}")
    return bool(value)


def is_single(dtype: DTypeLike) -> bool:
    """Whether a type of results is single precision; it may be double precision, too."""
    # NumPy parses texts as Python expressions, which may be invalid.
    with suppress(TypeError, ValueError, SyntaxError):
        if np.dtype(dtype) in (np.float32, np.complex64):
            return True
        if np.dtype(dtype) in (np.float64, np.complex128):
            return False
    raise ValidationError(f"dtype must be 'float32' or 'float64', not {short_repr(dtype)}")


def in_single(values: Any) -> Any:
    """Numbers in single precision; those too large for it are infinite."""
    if isinstance(values, tuple):
        return tuple(map(in_single, values))
    return cast(values, np.complex64 if values.dtype.kind == "c" else np.float32)


def checked_atol(atol: object) -> float:
    """How far off a space points may be, if that is a number that makes sense."""
    return checked_number(atol, "atol must be a number from 0 to 1", lambda x: 0 <= x < 1)


def checked_number(value: Any, requirement: str, is_valid: Callable[[Any], bool]) -> float:
    """Return a real number, or raise ValidationError with what is required of it."""
    # Durations of NumPy are whole numbers by their type.
    number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, (bool, np.timedelta64))
    if not number or not is_valid(value):
        raise ValidationError(f"{requirement}, not {short_repr(value)}")
    return float(value)


def adjoint(x: Array) -> Array:
    """Return conjugate transposes."""
    return np.asarray(np.swapaxes(x, -1, -2).conj())


def refuse(bad: NDArray[np.bool_] | np.bool_, name: str, say: Callable[[tuple[int, ...]], str]) -> None:
    """Raise ValidationError for the first bad entry, with the message ``say(index)``."""
    if bad.any():
        index = tuple(np.argwhere(bad)[0].tolist())
        raise ValidationError(f"{name}{list(index) or ''} {say(index)}")


# ---- equality of objects that contain arrays ----


def same(first: object, second: object) -> bool:
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


def same_fields(first: object, second: object) -> bool:
    """Whether two objects of one class have equal attributes."""
    return same(tuple(vars(first).values()), tuple(vars(second).values()))


# ---- tolerance for points off a manifold, from the accuracy of their numbers ----

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


def point_tol(numbers: Array, size: int | None = None) -> float:
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


def _tol_of_rounded(numbers: Array, size: int) -> float:
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


# ---- validation of arrays of numbers, vectors and matrices, and of words ----

REMOVE = "remove missing values"


@contextmanager
def unmoved_by_underflow() -> Iterator[None]:
    """Let numbers too small for double precision become zero, whatever NumPy's error settings."""
    with np.errstate(under="ignore"):
        yield


def one_of(value: object, name: str, *choices: str) -> str:
    """Return a word, or raise ValidationError if it is not one of the choices."""
    if not isinstance(value, str) or value not in choices:
        listed = ", ".join(map(repr, choices[:-1]))
        raise ValidationError(f"{name} must be {listed} or {choices[-1]!r}, not {short_repr(value)}")
    return value


def numbers(value: ArrayLike, name: str, axes: int) -> tuple[Array, float]:
    """Return a real or complex array in double precision, and the tolerance for its points.

    Examples
    --------
    >>> numbers([1, 2], "x", 1)
    (array([1., 2.]), 1e-08)
    """
    array, tol = _cast_numbers(value, name, axes)
    check_finite(array, name)
    return array.copy(), tol


def _cast_numbers(value: ArrayLike, name: str, axes: int) -> tuple[Array, float]:
    array = as_array(value, name)
    if array.dtype.kind not in "biufc":
        raise ValidationError(f"{name} must be an array of numbers, not of {array.dtype}")
    if array.ndim < axes:
        raise ValidationError(f"{name} has shape {array.shape}, but needs at least {axes} axes")
    return cast(array, np.complex128 if array.dtype.kind == "c" else np.float64), point_tol(array)


def check_finite(array: Array, name: str, remedy: str = REMOVE) -> None:
    """Raise ValidationError for numbers that are not finite."""
    refuse(~np.isfinite(array), name, lambda i: f"is {array[i]}, but must be finite; {remedy}")


def real_numbers(value: ArrayLike, name: str, shape: tuple[int | None, ...]) -> tuple[Array, float]:
    """Return the same for real numbers with the given last axes; None allows any length except 0."""
    array, tol = numbers(value, name, len(shape))
    _check_real(array, name, shape)
    return array, tol


def unchecked_numbers(value: ArrayLike, name: str, shape: tuple[int | None, ...]) -> tuple[Array, float]:
    """Return the same for real numbers that may be infinite or NaN; the array may be `value` itself."""
    array, tol = _cast_numbers(value, name, len(shape))
    _check_real(array, name, shape)
    return array, tol


def _check_real(array: Array, name: str, shape: tuple[int | None, ...]) -> None:
    last = array.shape[array.ndim - len(shape) :]
    fits = all(n == m or (m is None and n > 0) for n, m in zip(last, shape, strict=True))
    if array.dtype.kind == "c" or not fits:
        wanted = ", ".join("n" if m is None else str(m) for m in shape)
        kind = "complex" if array.dtype.kind == "c" else "real"
        raise ValidationError(f"{name} must be real, of shape (..., {wanted}), not {kind} of shape {array.shape}")


def square_matrices(value: ArrayLike, name: str) -> tuple[Array, float]:
    """Return the same for square matrices, real or complex."""
    array, tol = numbers(value, name, 2)
    if array.shape[-1] != array.shape[-2] or array.shape[-1] == 0:
        raise ValidationError(f"{name} must be square matrices, of shape (..., n, n), not {array.shape}")
    return array, tol


def unit_vectors(x: Array, tol: float, name: str, what: str, advice: str = "divide it by its length") -> Array:
    """Normalise unit vectors.

    Raises
    ------
    ValidationError
        If the length of a vector is not 1.
    """
    lengths = length(np.abs(x))
    refuse(~(np.abs(lengths - 1) <= tol), name, lambda i: f"is not {what}: its length is {lengths[i]}, not 1; {advice}")
    return x / lengths[..., None]


def length(x: Array) -> Array:
    """Return |x| of real vectors without intermediate overflow, shape of the leading axes."""
    with np.errstate(over="ignore"):
        result: Array = np.hypot.reduce(x, axis=-1)
    return result


def off_one(x: Array) -> Array:
    """Return the deviation of columns from orthonormal: the largest entry of |X*X − 1| of every matrix."""
    # Of input that is far off.
    with np.errstate(over="ignore", invalid="ignore"):
        return largest(adjoint(x) @ x - np.eye(x.shape[-1]))


def largest(x: Array) -> Array:
    """Return the largest entry of every matrix by magnitude."""
    result: Array = np.abs(x).max(axis=(-2, -1))
    return result


def hermitian_part(x: Array) -> Array:
    """Return (X + X*) / 2."""
    return np.asarray((x + adjoint(x)) / 2)


def check_symmetric(x: Array, allowed: object, name: str, kind: str = "symmetric", advice: str = "") -> None:
    """Raise ValidationError for matrices whose entries differ by more than is allowed from those across the diagonal.

    For the kind "Hermitian", the entries across the diagonal must be complex conjugates.
    """
    # Input that is far off may overflow.
    with np.errstate(over="ignore", invalid="ignore"):
        off = largest(x - (adjoint(x) if kind == "Hermitian" else np.swapaxes(x, -1, -2)))
    refuse(~(off <= allowed), name, lambda i: f"is not {kind}: entries differ by {off[i]:.3e}{advice}")


def check_orthonormal(x: Array, tol: float, name: str, advice: str) -> None:
    """Raise ValidationError for matrices whose columns are not orthonormal."""
    off = off_one(x)
    refuse(~(off <= tol), name, lambda i: f"does not have orthonormal columns: |X*X - 1| is {off[i]:.3e}; {advice}")

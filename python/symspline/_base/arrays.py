"""Arrays as a user gives them, and equality of objects that contain arrays."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import ValidationError
from .input import refuse_objects, to_numpy


def as_array(value: ArrayLike, name: str) -> NDArray[Any]:
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


def filled(value: Any) -> Any:
    """Replace masked numbers by NaN and masked times by NaT, also within lists."""
    if isinstance(value, np.ma.MaskedArray):
        missing: Any = np.array("NaT", value.dtype)[()] if value.dtype.kind in "mM" else np.nan
        numbers: Any = value if value.dtype.kind in "fcmM" else value.astype(np.float64)
        return numbers.filled(missing)
    if isinstance(value, list) and any(issubclass(kind, np.ma.MaskedArray) for kind in set(map(type, value))):
        return [filled(entry) for entry in value]
    return value


def _first_masked(value: Any) -> tuple[int, ...] | None:
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


def short_repr(value: Any) -> str:
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


def cast(array: NDArray[Any], dtype: Any = np.float64) -> NDArray[Any]:
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


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """A view that cannot be written to."""
    view = array.view()
    view.flags.writeable = False
    return view


def whole_number(value: Any, name: str, least: int) -> int:
    """A whole number that fits into a machine word."""
    if isinstance(value, (bool, np.timedelta64)) or not isinstance(value, (int, np.integer)):
        raise ValidationError(f"{name} must be a whole number, not {short_repr(value)}")
    if not least <= int(value) < 2**62:
        raise ValidationError(f"{name} must be at least {least} and not beyond 2**62, not {value}")
    return int(value)


def checked_flag(value: Any, name: str) -> bool:
    """True or False; of an array neither would be meant."""
    if not isinstance(value, (bool, np.bool_)):
        raise ValidationError(f"{name} must be True or False, not {short_repr(value)}")
    return bool(value)


def is_single(dtype: Any) -> bool:
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


def checked_atol(atol: Any) -> float:
    """How far off a space points may be, if that is a number that makes sense."""
    return checked_number(atol, "atol must be a number from 0 to 1", lambda x: 0 <= x < 1)


def checked_number(value: Any, requirement: str, is_valid: Callable[[Any], bool]) -> float:
    """Return a real number, or raise ValidationError with what is required of it."""
    # Durations of NumPy are whole numbers by their type.
    number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, (bool, np.timedelta64))
    if not number or not is_valid(value):
        raise ValidationError(f"{requirement}, not {short_repr(value)}")
    return float(value)


def adjoint(x: NDArray[Any]) -> NDArray[Any]:
    """Return conjugate transposes."""
    return np.asarray(np.swapaxes(x, -1, -2).conj())


def refuse(bad: NDArray[np.bool_], name: str, say: Callable[[Any], str]) -> None:
    """Raise ValidationError for the first bad entry, with the message ``say(index)``."""
    if bad.any():
        index = tuple(np.argwhere(bad)[0].tolist())
        raise ValidationError(f"{name}{list(index) or ''} {say(index)}")


# ---- equality of objects that contain arrays ----


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

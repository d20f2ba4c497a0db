"""Arrays as a user gives them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import ValidationError


def as_array(value: ArrayLike, name: str) -> NDArray[Any]:
    """The value as an array; ragged nested lists are an error of the caller's."""
    try:
        return np.asarray(value)
    except ValueError as error:
        raise ValidationError(f"{name} is not an array of equally long rows: {error}") from None


def shown(value: Any) -> str:
    """A value in a message: on one line, and not too long."""
    if isinstance(value, np.ndarray) and value.size > 1000:
        # With many short axes NumPy would write out all of it.
        return f"an array of shape {value.shape}"
    return brief(repr(value))


def brief(text: object, most: int = 150) -> str:
    """A text on one line, and not too long."""
    line = " ".join(str(text).split())
    return line if len(line) <= most else f"{line[:most]}…"


def cast(array: NDArray[Any], dtype: Any = np.float64) -> NDArray[Any]:
    """The numbers in contiguous memory and of a type; those it cannot hold become infinite or zero."""
    if array.dtype == dtype:
        return np.asarray(array, order="C")
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        return np.asarray(array, dtype=dtype, order="C")


def whole_number(value: Any, name: str, least: int) -> int:
    """A whole number that fits into a machine word."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise ValidationError(f"{name} must be a whole number, not {shown(value)}")
    if not least <= int(value) < 2**62:
        raise ValidationError(f"{name} must be at least {least} and not beyond 2**62, not {value}")
    return int(value)

"""Results in existing arrays of the user, as for the argument ``out`` of NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._core import ValidationError
from .._spaces import Array


def check_out(out: Any, shape: tuple[int, ...], dtype: Any) -> None:
    """Raise ValidationError if an array cannot hold a result of this shape and type."""
    if not isinstance(out, np.ndarray):
        raise ValidationError(f"out must be a NumPy array, not {type(out).__name__}")
    if out.shape != shape:
        raise ValidationError(f"out has shape {out.shape}, but the result has {shape}")
    if not np.can_cast(dtype, out.dtype, "same_kind"):
        raise ValidationError(f"out has dtype {out.dtype}, which cannot hold {np.dtype(dtype)}")
    if not out.flags.writeable:
        raise ValidationError("out is read-only")


def can_write_into(out: Array, dtype: Any, read: Array) -> bool:
    """Whether the core can write directly into an array while it reads another one."""
    apart = not np.may_share_memory(out, read)
    return apart and out.dtype == dtype and out.flags.c_contiguous and out.flags.aligned

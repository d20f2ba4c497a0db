"""Results in arrays that users bring, as NumPy's ``out``."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._core import ValidationError
from .._spaces import Array


def check_out(out: Any, shape: tuple[int, ...], dtype: Any) -> None:
    """Complains of what cannot take a result of this shape and type."""
    if not isinstance(out, np.ndarray):
        raise ValidationError(f"out must be a NumPy array, not {type(out).__name__}")
    if out.shape != shape:
        raise ValidationError(f"out has shape {out.shape}, but the result has {shape}")
    if not np.can_cast(dtype, out.dtype, "same_kind"):
        raise ValidationError(f"out is of {out.dtype}, which does not hold numbers of {np.dtype(dtype)}")
    if not out.flags.writeable:
        raise ValidationError("out is read-only")


def can_write_into(out: Array, dtype: Any, read: Array) -> bool:
    """Whether the core may write into an array while it reads another."""
    apart = not np.may_share_memory(out, read)
    return apart and out.dtype == dtype and out.flags.c_contiguous and out.flags.aligned

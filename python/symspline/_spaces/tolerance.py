"""How far off a space points may be."""

from __future__ import annotations

from typing import Any

import numpy as np

POINT_TOL = 1e-8
POINT_TOL_FLOAT32 = 1e-4


def point_tol(dtype: np.dtype[Any]) -> float:
    """How far off a space points of a type may be."""
    return POINT_TOL_FLOAT32 if dtype in (np.float32, np.float16, np.complex64) else POINT_TOL

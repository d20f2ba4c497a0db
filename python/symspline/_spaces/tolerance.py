"""Tolerances for the distance of points from the manifold."""

from __future__ import annotations

from typing import Any

import numpy as np

POINT_TOL = 1e-8
POINT_TOL_FLOAT32 = 1e-4


def point_tol(dtype: np.dtype[Any]) -> float:
    """Return the largest distance from the manifold of points with this type of numbers."""
    return POINT_TOL_FLOAT32 if dtype in (np.float32, np.float16, np.complex64) else POINT_TOL

"""Conversions between rotation matrices and unit quaternions, as formulas for numbers and for NumPy or JAX arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Rows = tuple[tuple[Any, ...], ...]


def rotation_rows(w: Any, x: Any, y: Any, z: Any) -> Rows:
    """Return the rows of the rotation matrix of a unit quaternion."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def matrices_of_quaternions(q: Any) -> NDArray[np.float64]:
    """Return the rotation matrices of quaternions (w, x, y, z), which need not have unit length."""
    q = np.asarray(q, np.float64)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.stack([np.stack(row, axis=-1) for row in rotation_rows(*np.moveaxis(q, -1, 0))], axis=-2)


def quaternion_rows(matrix: Any) -> Rows:
    """Return the rows of 4qqᵀ for the unit quaternion q of a rotation matrix, shape (..., 3, 3).

    All rows are multiples of q. The row with the largest diagonal entry has no cancellation.

    References
    ----------
    S. W. Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1 (1978).
    """
    (a, b, c), (d, e, f), (g, h, i) = ([matrix[..., row, column] for column in range(3)] for row in range(3))
    return (
        (1 + a + e + i, h - f, c - g, d - b),
        (h - f, 1 + a - e - i, b + d, c + g),
        (c - g, b + d, 1 - a + e - i, f + h),
        (d - b, c + g, f + h, 1 - a - e + i),
    )

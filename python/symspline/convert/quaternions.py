"""Rotations of space as matrices and as unit quaternions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._core import ValidationError
from ..arrays import checked_atol
from .reading import Array, length, off_one, real_numbers, refuse, unit_vectors, unmoved_by_underflow


@unmoved_by_underflow
def matrix_to_quaternion(matrix: ArrayLike, *, scalar_first: bool | None = None) -> Array:
    """The unit quaternions of rotations, accurate for small angles and for angles near π.

    Of the two quaternions ±q of a rotation it is the one whose scalar part is not negative: along a curve
    the sign may jump. For curves of rotations use ``SpecialOrthogonal(3)``, where there is no sign.
    Source: Shepperd, Quaternion from rotation matrix (1978).

    Args:
        matrix: rotations, points of ``SpecialOrthogonal(3)``, shape (..., 3, 3).
        scalar_first: True for (w, x, y, z), False for (x, y, z, w) as in SciPy and ROS. It must be given.

    Returns:
        Unit vectors, shape (..., 4).

    Raises:
        ValidationError: a matrix is not a rotation, or ``scalar_first`` is not given.

    >>> matrix_to_quaternion([[0, -1, 0], [1, 0, 0], [0, 0, 1]], scalar_first=True).round(8)
    array([0.70710678, 0.        , 0.        , 0.70710678])
    """
    first = checked_order(scalar_first)
    r, tol = real_numbers(matrix, "matrix", (3, 3))
    _check_rotations(r, tol)
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(r, (-2, -1), (0, 1))
    # 4qqᵀ; in its row with the largest diagonal entry nothing cancels.
    table = _matrices(
        [
            [1 + a + e + i, h - f, c - g, d - b],
            [h - f, 1 + a - e - i, d + b, c + g],
            [c - g, d + b, 1 - a + e - i, h + f],
            [d - b, c + g, h + f, 1 - a - e + i],
        ]
    )
    best = np.argmax(np.diagonal(table, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(table, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.where(q[..., 0] < 0, -length(q), length(q))[..., None]
    return q if first else np.roll(q, -1, axis=-1)


@unmoved_by_underflow
def quaternion_to_matrix(
    quaternion: ArrayLike, *, scalar_first: bool | None = None, atol: float | None = None
) -> Array:
    """The rotation matrices of unit quaternions.

    Args:
        quaternion: unit vectors, shape (..., 4).
        scalar_first: True for (w, x, y, z), False for (x, y, z, w) as in SciPy and ROS. It must be given.
        atol: how far from 1 lengths may be, such as 1e-5 for numbers of six decimals; None for 1e-8 of doubles.

    Returns:
        Rotations, points of ``SpecialOrthogonal(3)``, shape (..., 3, 3).

    Raises:
        ValidationError: a quaternion is not of length 1, or ``scalar_first`` is not given.

    >>> quaternion_to_matrix([0.6, 0.0, 0.0, 0.8], scalar_first=True).round(8)
    array([[-0.28, -0.96,  0.  ],
           [ 0.96, -0.28,  0.  ],
           [ 0.  ,  0.  ,  1.  ]])
    """
    first = checked_order(scalar_first)
    q, tol = real_numbers(quaternion, "quaternion", (4,))
    tol = tol if atol is None else checked_atol(atol)
    q = unit_vectors(q, tol, "quaternion", "a unit quaternion")
    w, x, y, z = np.moveaxis(q if first else np.roll(q, 1, axis=-1), -1, 0)
    return _matrices(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _matrices(rows: list[list[Array]]) -> Array:
    """Matrices with given entries."""
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def checked_order(scalar_first: bool | None) -> bool:
    """Whether the scalar part is the first of the four numbers, which must have been said."""
    if scalar_first is True or scalar_first is False:
        return scalar_first
    raise ValidationError(
        "the order of the four numbers is in doubt, and they do not show it: say scalar_first=True for "
        f"(w, x, y, z) or scalar_first=False for (x, y, z, w) as in SciPy and ROS; got {scalar_first!r}"
    )


def _check_rotations(r: Array, tol: float) -> None:
    off = off_one(r)
    refuse(
        ~(off <= tol),
        "matrix",
        lambda i: (
            f"is not a rotation: |RᵀR - 1| is {off[i]:.3e}; SpecialOrthogonal(3).project(matrix) turns nearby "
            "matrices into rotations"
        ),
    )
    determinants = np.linalg.det(r)
    refuse(
        ~(determinants > 0),
        "matrix",
        lambda i: (
            f"is a reflection, not a rotation: its determinant is {determinants[i]:.3g}; swap two columns, or "
            "change the sign of one"
        ),
    )

"""Rotations of space as matrices and as unit quaternions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import checked_atol, refuse
from .._core import ValidationError
from .._quaternions import Rows, quaternion_rows, rotation_rows
from .._validation import Array, length, off_one, real_numbers, unit_vectors, unmoved_by_underflow


@unmoved_by_underflow()
def matrix_to_quaternion(matrix: ArrayLike, *, scalar_first: bool | None = None) -> Array:
    """Convert rotation matrices to unit quaternions, accurately for small angles and for angles near π.

    Of the two quaternions ±q of a rotation, the result has a non-negative scalar part, so the sign may jump along a
    curve. For curves of rotations use ``SpecialOrthogonal(3)``, where the sign does not matter.

    Parameters
    ----------
    matrix : array_like, shape (..., 3, 3)
        Rotations, points of ``SpecialOrthogonal(3)``.
    scalar_first : bool
        Required. True for (w, x, y, z), False for (x, y, z, w) as in SciPy and ROS.

    Returns
    -------
    ndarray, shape (..., 4)
        Unit quaternions.

    Raises
    ------
    ValidationError
        If a matrix is not a rotation, or `scalar_first` is missing.

    References
    ----------
    Shepperd, "Quaternion from rotation matrix", 1978.

    Examples
    --------
    >>> matrix_to_quaternion([[0, -1, 0], [1, 0, 0], [0, 0, 1]], scalar_first=True).round(8)
    array([0.70710678, 0.        , 0.        , 0.70710678])
    """
    first = checked_order(scalar_first)
    r, tol = real_numbers(matrix, "matrix", (3, 3))
    off = off_one(r)
    advice = "SpecialOrthogonal(3).project(matrix) projects nearby matrices onto the rotations"
    refuse(~(off <= tol), "matrix", lambda i: f"is not a rotation: |RᵀR - 1| is {off[i]:.3e}; {advice}")
    determinants = np.linalg.det(r)
    what, advice = "is a reflection, not a rotation: its determinant is", "swap two columns, or change the sign of one"
    refuse(~(determinants > 0), "matrix", lambda i: f"{what} {determinants[i]:.3g}; {advice}")
    table = _matrices(quaternion_rows(r))
    best = np.argmax(np.diagonal(table, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(table, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.where(q[..., 0] < 0, -length(q), length(q))[..., None]
    return q if first else np.roll(q, -1, axis=-1)


@unmoved_by_underflow()
def quaternion_to_matrix(
    quaternion: ArrayLike, *, scalar_first: bool | None = None, atol: float | None = None
) -> Array:
    """Convert unit quaternions to rotation matrices.

    Parameters
    ----------
    quaternion : array_like, shape (..., 4)
        Unit quaternions.
    scalar_first : bool
        Required. True for (w, x, y, z), False for (x, y, z, w) as in SciPy and ROS.
    atol : float, optional
        Largest deviation of the norms from 1, such as 1e-5 for numbers of six decimal places. None means 1e-8 in double
        precision.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Rotations, points of ``SpecialOrthogonal(3)``.

    Raises
    ------
    ValidationError
        If the norm of a quaternion is not 1, or `scalar_first` is missing.

    Examples
    --------
    >>> quaternion_to_matrix([0.6, 0.0, 0.0, 0.8], scalar_first=True).round(8)
    array([[-0.28, -0.96,  0.  ],
           [ 0.96, -0.28,  0.  ],
           [ 0.  ,  0.  ,  1.  ]])
    """
    first = checked_order(scalar_first)
    q, tol = real_numbers(quaternion, "quaternion", (4,))
    tol = tol if atol is None else checked_atol(atol)
    q = unit_vectors(q, tol, "quaternion", "a unit quaternion")
    return _matrices(rotation_rows(*np.moveaxis(q if first else np.roll(q, 1, axis=-1), -1, 0)))


def _matrices(rows: Rows) -> Array:
    """Return matrices with the given entries."""
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def checked_order(scalar_first: bool | None) -> bool:
    """Return `scalar_first`, or raise ValidationError if it is missing."""
    if scalar_first is True or scalar_first is False:
        return scalar_first
    raise ValidationError(
        "scalar_first is required, because the four numbers do not show their order: pass scalar_first=True for "
        f"(w, x, y, z) or scalar_first=False for (x, y, z, w) as in SciPy and ROS; got {scalar_first!r}"
    )

"""Rotations of space as matrices and as unit quaternions."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import (
    REMOVE,
    as_array,
    check_finite,
    checked_atol,
    checked_flag,
    filled,
    off_one,
    refuse,
    short_repr,
    unchecked_numbers,
    unit_vectors,
    unmoved_by_underflow,
)
from .._base.typing import Array
from .._core import ValidationError, convert_rotations
from .._spaces import point_tol

Form = Literal["matrix", "scalar first", "scalar last", "vector"]
# Forms for which callers offer `skipna`, and the remedy in messages.
_SKIPPED = ("scalar first", "scalar last", "vector")
_MISSING = "remove missing values, or pass skipna=True, which returns NaN for them"
_SHAPES: dict[Form, tuple[int, ...]] = {"matrix": (3, 3), "scalar first": (4,), "scalar last": (4,), "vector": (3,)}


@unmoved_by_underflow()
def matrix_to_quaternion(matrix: ArrayLike, *, scalar_first: bool) -> Array:
    """Return unit quaternions with a non-negative scalar part, so that the sign may jump along a curve."""
    return converted(matrix, "matrix", "matrix", quaternion_form(scalar_first))


@unmoved_by_underflow()
def quaternion_to_matrix(quaternion: ArrayLike, *, scalar_first: bool) -> Array:
    """Return the rotations of unit quaternions."""
    return converted(quaternion, "quaternion", quaternion_form(scalar_first), "matrix")


def converted(
    value: ArrayLike, name: str, form: Form, wanted: Form, atol: float | None = None, skipna: bool = False
) -> Array:
    """Convert rotations to another form by the core; messages refer to them by `name`.

    With `skipna`, rotations with missing numbers become NaN.

    Raises
    ------
    ValidationError
        If the numbers are not rotations within the tolerance.
    """
    if checked_flag(skipna, "skipna"):
        return _with_missing(filled(value), name, form, wanted, atol)
    x, tol = unchecked_numbers(value, name, _SHAPES[form])
    if form == "matrix":
        # |RᵀR − 1| is twice the distance from the rotations.
        tol = 2 * point_tol(as_array(value, name), 9)
    tol = tol if atol is None else checked_atol(atol)
    result, valid = convert_rotations(x, form, wanted, tol)
    if not valid:
        check_finite(x, name, _MISSING if form in _SKIPPED else REMOVE)
        if form == "matrix":
            _check_rotations(x, tol, name)
        elif form == "vector":
            _check_angles(x, result, tol, name)
        else:
            unit_vectors(x, tol, name, "a unit quaternion", "divide it by its length, or pass a larger atol")
    return result


def _with_missing(value: ArrayLike, name: str, form: Form, wanted: Form, atol: float | None) -> Array:
    x = as_array(value, name)
    axes = len(_SHAPES[form])
    if x.ndim < axes:
        return converted(x, name, form, wanted, atol)
    is_missing = np.isnan(x) if x.dtype.kind == "f" else np.zeros(x.shape, bool)
    missing = np.asarray(is_missing.any(axis=tuple(range(x.ndim - axes, x.ndim))))
    if not missing.any():
        return converted(x, name, form, wanted, atol)
    result = np.full((*missing.shape, *_SHAPES[wanted]), np.nan)
    # Messages have the indices of all rotations, so that the missing ones are replaced and not removed.
    first = x[~missing][:1]
    if len(first):
        whole = converted(np.where(missing[(..., *[None] * axes)], first[0], x), name, form, wanted, atol)
        result[~missing] = whole[~missing]
    return result


def _check_angles(v: Array, turns: Array, tol: float, name: str) -> None:
    good = off_one(turns) <= tol
    refuse(~good, name, lambda i: f"is {v[i]}, but angles must be small enough for sine and cosine; reduce them")


def _check_rotations(r: Array, tol: float, name: str) -> None:
    off = off_one(r)
    advice = f"SpecialOrthogonal(3).project({name}) projects nearby matrices onto the rotations"
    refuse(~(off <= tol), name, lambda i: f"is not a rotation: |RᵀR - 1| is {off[i]:.3e}; {advice}")
    determinants = np.linalg.det(r)
    what, advice = "is a reflection, not a rotation: its determinant is", "swap two columns, or change the sign of one"
    refuse(~(determinants > 0), name, lambda i: f"{what} {determinants[i]:.3g}; {advice}")


def quaternion_form(scalar_first: bool | None) -> Form:
    """Return the name of the order of quaternions in the core."""
    return "scalar first" if checked_order(scalar_first) else "scalar last"


def checked_order(scalar_first: bool | None) -> bool:
    """Return `scalar_first`, or raise ValidationError if it is missing."""
    if scalar_first is True or scalar_first is False:
        return scalar_first
    raise ValidationError(
        "scalar_first is required, because the four numbers do not show their order: pass scalar_first=True for "
        f"(w, x, y, z) or scalar_first=False for (x, y, z, w) as in SciPy and ROS; got {short_repr(scalar_first)}"
    )

"""Labelled landmarks as points of Grassmannians, and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import ValidationError
from ..arrays import shown
from ..convert.reading import numbers, off_one, refuse

Array = NDArray[np.float64]

# Landmarks closer to a hyperplane, in units of their largest extent, have a shape of rounding only.
_FLAT = 1e-10


def from_landmarks(x: ArrayLike, base: int | None = None) -> Array:
    """The affine shapes of labelled landmarks.

    Args:
        x: drawings of k + 1 landmarks in Rⁿ, shape (..., k + 1, n), k > n.
        base: the landmark from which the others are measured, as in the paper; None for their centre, which prefers
            none. Curves differ a little.

    Returns:
        Matrices with orthonormal columns, points of ``Grassmannian(n, k + 1)``, or with a base, whose row is left
        out, of ``Grassmannian(n, k)``.

    Raises:
        ValidationError: the landmarks of a drawing lie in a hyperplane, or are too few to have different shapes.

    >>> from_landmarks([[0, 0], [1, 0], [1, 1], [0, 1]], base=0).round(8) + 0.0
    array([[ 0.78867513, -0.21132487],
           [ 0.57735027,  0.57735027],
           [-0.21132487,  0.78867513]])
    """
    drawing = read(x, "x", base)
    return orthonormal(relative(drawing, base), "x")


def to_landmarks(shape: ArrayLike, like: ArrayLike, base: int | None = None) -> Array:
    """Drawings of shapes: of all affine images the one closest to a given drawing.

    Args:
        shape: points of the Grassmannian, any basis, as `from_landmarks` makes them.
        like: drawings, shape (..., k + 1, n), whose centre, or landmark ``base``, stays where it is.
        base: as for `from_landmarks`.

    Returns:
        Drawings, shape (..., k + 1, n).

    Raises:
        ValidationError: the shapes are no matrices with orthonormal columns, or do not fit the drawings.

    >>> square = [[0, 0], [1, 0], [1, 1], [0, 1]]
    >>> to_landmarks(from_landmarks(square), square).round(8) + 0.0
    array([[0., 0.],
           [1., 0.],
           [1., 1.],
           [0., 1.]])
    """
    drawing = read(like, "like", base)
    basis, tol = numbers(shape, "shape", 2)
    rows = drawing.shape[-2] - (base is not None)
    if basis.dtype.kind == "c" or basis.shape[-2:] != (rows, drawing.shape[-1]):
        raise ValidationError(
            f"shape must be real, of shape (..., {rows}, {drawing.shape[-1]}) for these drawings, not {basis.shape}"
        )
    off = off_one(basis)
    refuse(
        ~(off <= tol),
        "shape",
        lambda i: f"does not have orthonormal columns: |YᵀY - 1| is {off[i]:.3e}; from_landmarks makes such",
    )
    return placed(basis @ (np.swapaxes(basis, -1, -2) @ relative(drawing, base)), place(drawing, base), base)


def read(x: ArrayLike, name: str, base: Any) -> Array:
    """Drawings, and the landmark from which they are measured, checked."""
    drawing, _ = numbers(x, name, 2)
    if drawing.dtype.kind == "c":
        raise ValidationError(
            f"{name} must be real landmarks, not complex; take real and imaginary parts as columns"
        )
    count, n = drawing.shape[-2:]
    if count < n + 2 or n < 1:
        raise ValidationError(
            f"{name} has shape {drawing.shape}: {count} landmarks in {n} dimensions; affine shapes differ from "
            f"{n + 2} landmarks on"
        )
    whole = isinstance(base, (int, np.integer)) and not isinstance(base, bool)
    if base is not None and not (whole and 0 <= base < count):
        raise ValidationError(
            f"base must be None or the number of a landmark, 0 to {count - 1}, not {shown(base)}"
        )
    return drawing


def relative(drawing: Array, base: int | None) -> Array:
    """Landmarks measured from their centre, or from one of them, which is left out."""
    moved = drawing - place(drawing, base)[..., None, :]
    return moved if base is None else np.delete(moved, base, axis=-2)


def place(drawing: Array, base: int | None) -> Array:
    """The centre of drawings, or the landmark ``base``, shape (..., n)."""
    middle: Array = drawing.mean(axis=-2) if base is None else drawing[..., base, :]
    return middle


def placed(moved: Array, place: Array, base: int | None) -> Array:
    """The inverse of `relative`."""
    whole = moved if base is None else np.insert(moved, base, 0.0, axis=-2)
    return whole + place[..., None, :]


def orthonormal(moved: Array, name: str) -> Array:
    """The matrices with orthonormal columns next to given ones: their polar factors."""
    left, sizes, right = np.linalg.svd(moved, full_matrices=False)
    refuse(
        ~(sizes[..., -1] > _FLAT * sizes[..., 0]),
        name,
        lambda i: (
            f"lies in a hyperplane: its extents are {', '.join(f'{size:.3g}' for size in sizes[i])}; landmarks "
            f"must span all {moved.shape[-1]} dimensions to have an affine shape"
        ),
    )
    basis: Array = left @ right
    return basis

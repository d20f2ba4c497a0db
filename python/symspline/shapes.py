"""Affine shapes: labelled landmarks up to affine maps (§4.3 of the paper).

k + 1 landmarks in Rⁿ form a matrix with one row per landmark. Its centred columns span a subspace of Rᵏ⁺¹ that is
invariant under affine maps of Rⁿ: a point of ``Grassmannian(n, k + 1)``. If the landmarks are measured from one of
them, as in the paper, the result is a point of ``Grassmannian(n, k)``, which gives preference to that landmark.

Examples
--------
>>> import numpy as np, symspline as ss
>>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
>>> sheared = square @ [[1, 0.5], [0, 1]] + 3
>>> space = ss.Grassmannian(2, 4)
>>> space.distance(*map(ss.shapes.from_landmarks, (square, sheared))).round(8)
np.float64(0.0)
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._base.arrays import check_orthonormal, numbers, refuse, short_repr
from ._base.typing import FloatArray
from ._core import ValidationError

__all__ = ["from_landmarks", "to_landmarks"]


def __dir__() -> list[str]:
    return __all__


# If landmarks are closer to a hyperplane than this, in units of their largest extent, their shape is a rounding error.
_FLAT = 1e-10


def from_landmarks(x: ArrayLike, *, base: int | None = None) -> FloatArray:
    """Convert labelled landmarks to affine shapes.

    Parameters
    ----------
    x : array_like, shape (..., k + 1, n)
        Drawings of k + 1 landmarks in Rⁿ, with k > n.
    base : int, optional
        Landmark from which the others are measured, as in the paper. None means their centre, so that no landmark is
        preferred. The resulting curves differ slightly.

    Returns
    -------
    ndarray, shape (..., k + 1, n) or (..., k, n)
        Matrices with orthonormal columns: points of ``Grassmannian(n, k + 1)``, or with a base, whose row is dropped,
        of ``Grassmannian(n, k)``.

    Raises
    ------
    ValidationError
        If the landmarks of a drawing lie in a hyperplane, or are too few to have different shapes.

    Examples
    --------
    >>> from_landmarks([[0, 0], [1, 0], [1, 1], [0, 1]], base=0).round(8) + 0.0
    array([[ 0.78867513, -0.21132487],
           [ 0.57735027,  0.57735027],
           [-0.21132487,  0.78867513]])
    """
    drawing = _read(x, "x", base)
    return _orthonormal(_relative(drawing, base), "x")


def to_landmarks(shape: ArrayLike, like: ArrayLike, *, base: int | None = None) -> FloatArray:
    """Convert affine shapes to drawings, choosing the affine image closest to a given drawing.

    Parameters
    ----------
    shape : array_like, shape (..., k + 1, n) or (..., k, n)
        Points of the Grassmannian in any basis, as returned by `from_landmarks`.
    like : array_like, shape (..., k + 1, n)
        Drawings, whose centre, or landmark `base`, is kept.
    base : int, optional
        See `from_landmarks`.

    Returns
    -------
    ndarray, shape (..., k + 1, n)
        Drawings.

    Raises
    ------
    ValidationError
        If the columns of a shape are not orthonormal, or the shapes do not fit the drawings.

    Examples
    --------
    >>> square = [[0, 0], [1, 0], [1, 1], [0, 1]]
    >>> to_landmarks(from_landmarks(square), square).round(8) + 0.0
    array([[0., 0.],
           [1., 0.],
           [1., 1.],
           [0., 1.]])
    """
    drawing = _read(like, "like", base)
    basis, tol = numbers(shape, "shape", 2)
    rows = drawing.shape[-2] - (base is not None)
    if basis.dtype.kind == "c" or basis.shape[-2:] != (rows, drawing.shape[-1]):
        raise ValidationError(
            f"shape must be real, of shape (..., {rows}, {drawing.shape[-1]}) for these drawings, not {basis.shape}"
        )
    check_orthonormal(basis, tol, "shape", "use from_landmarks")
    return _placed(basis @ (np.swapaxes(basis, -1, -2) @ _relative(drawing, base)), _place(drawing, base), base)


def _read(x: ArrayLike, name: str, base: Any) -> FloatArray:
    """Validate drawings and the base landmark."""
    drawing, _ = numbers(x, name, 2)
    if drawing.dtype.kind == "c":
        raise ValidationError(f"{name} must be real landmarks, not complex; pass real and imaginary parts as columns")
    count, n = drawing.shape[-2:]
    if count < n + 2 or n < 1:
        raise ValidationError(
            f"{name} has shape {drawing.shape}: {count} landmarks in {n} dimensions; affine shapes in "
            f"{n} dimensions need at least {n + 2} landmarks"
        )
    whole = isinstance(base, (int, np.integer)) and not isinstance(base, bool)
    if base is not None and not (whole and 0 <= base < count):
        raise ValidationError(
            f"base must be None or the number of a landmark, 0 to {count - 1}, not {short_repr(base)}"
        )
    return drawing


def _relative(drawing: FloatArray, base: int | None) -> FloatArray:
    """Return landmarks measured from their centre, or from one of them, which is dropped."""
    moved = drawing - _place(drawing, base)[..., None, :]
    return moved if base is None else np.delete(moved, base, axis=-2)


def _place(drawing: FloatArray, base: int | None) -> FloatArray:
    """Return the centre of drawings, or the landmark ``base``, shape (..., n)."""
    return np.asarray(drawing.mean(axis=-2) if base is None else drawing[..., base, :])


def _placed(moved: FloatArray, place: FloatArray, base: int | None) -> FloatArray:
    """Compute the inverse of `_relative`."""
    whole = moved if base is None else np.insert(moved, base, 0.0, axis=-2)
    return whole + place[..., None, :]


def _orthonormal(moved: FloatArray, name: str) -> FloatArray:
    """Return the nearest matrices with orthonormal columns, the polar factors."""
    left, sizes, right = np.linalg.svd(moved, full_matrices=False)
    refuse(
        ~(sizes[..., -1] > _FLAT * sizes[..., 0]),
        name,
        lambda i: (
            f"lies in a hyperplane: its extents are {', '.join(f'{size:.3g}' for size in sizes[i])}; landmarks "
            f"must span all {moved.shape[-1]} dimensions to have an affine shape"
        ),
    )
    return np.asarray(left @ right)

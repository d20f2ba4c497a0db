"""Subspaces of an indefinite form as reflections, which are points of `IndefiniteGrassmannian`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import refuse
from .._core import ValidationError
from ._reading import Array, largest, real_numbers, unmoved_by_underflow


def _signs(n: int, negative: int) -> Array:
    """The diagonal of the form."""
    if isinstance(negative, bool) or not isinstance(negative, (int, np.integer)) or not 0 <= negative <= n:
        raise ValidationError(f"negative must be a whole number from 0 to {n}, not {negative!r}")
    return np.where(np.arange(n) < negative, -1.0, 1.0)


@unmoved_by_underflow
def basis_to_reflection(basis: ArrayLike, *, negative: int) -> Array:
    """Return the reflections of the subspaces that bases span.

    Parameters
    ----------
    basis : array_like, shape (..., n, k)
        Real matrices whose columns are linearly independent.
    negative : int
        Number of negative squares of the form, which come first: the form is η = diag(-1, ..., -1, 1, ..., 1).

    Returns
    -------
    numpy.ndarray, shape (..., n, n)
        Matrices P that are 1 on a subspace and -1 on its orthogonal complement in the form: points of
        `IndefiniteGrassmannian`.

    Raises
    ------
    ValidationError
        If columns are linearly dependent, or the form is degenerate on a subspace.

    Notes
    -----
    With a basis B the reflection is :math:`2 B (B^T η B)^{-1} B^T η - 1`.

    Examples
    --------
    >>> basis_to_reflection([[0.0], [2.0]], negative=1)
    array([[-1.,  0.],
           [ 0.,  1.]])
    """
    y, tol = real_numbers(basis, "basis", (None, None))
    n, k = y.shape[-2:]
    if not 1 <= k < n:
        raise ValidationError(f"basis must be of shape (..., n, k) with 1 <= k < n, not {y.shape}")
    signs = _signs(n, negative)
    length = np.linalg.norm(y, axis=-2, keepdims=True)
    y = y / np.where(length > 0, length, 1.0)
    singular = np.linalg.svd(y, compute_uv=False)[..., -1]
    what = "does not have linearly independent columns: their least singular value is"
    refuse(~(singular > tol), "basis", lambda i: f"{what} {singular[i]:.3e}")
    q = np.linalg.qr(y).Q
    turned = np.swapaxes(q, -1, -2) * signs
    gram = turned @ q
    least = np.abs(np.linalg.eigvalsh(gram)).min(axis=-1, initial=1.0)
    what = "does not span a subspace with a reflection: the form is degenerate on it"
    why = "since it contains a vector orthogonal to the whole subspace"
    refuse(~(least > tol), "basis", lambda i: f"{what} (least eigenvalue {least[i]:.3e}), {why}")
    return np.asarray(2 * q @ np.linalg.solve(gram, turned) - np.eye(n))


@unmoved_by_underflow
def reflection_to_basis(reflection: ArrayLike, *, negative: int) -> Array:
    """Return bases of the subspaces that reflections leave fixed.

    Parameters
    ----------
    reflection : array_like, shape (..., n, n)
        Points of `IndefiniteGrassmannian`, of subspaces of one dimension k.
    negative : int
        Number of negative squares of the form, which come first.

    Returns
    -------
    numpy.ndarray, shape (..., n, k)
        Matrices B with :math:`B^T η B = diag(-1, ..., -1, 1, ..., 1)`.

    Raises
    ------
    ValidationError
        If a matrix is not a reflection that preserves the form, or its subspace has another dimension than the first.

    Examples
    --------
    >>> abs(reflection_to_basis([[-1.0, 0.0], [0.0, 1.0]], negative=1))
    array([[0.],
           [1.]])
    """
    p, tol = real_numbers(reflection, "reflection", (None, None))
    n = p.shape[-1]
    if p.shape[-2] != n:
        raise ValidationError(f"reflection must be square matrices, of shape (..., n, n), not {p.shape}")
    signs = _signs(n, negative)
    with np.errstate(over="ignore", invalid="ignore"):
        size = np.maximum(1.0, largest(p)) ** 2
        off = largest(p @ p - np.eye(n)) / size
        skew = largest(signs[:, None] * p - np.swapaxes(signs[:, None] * p, -1, -2)) / size
    refuse(~(off <= tol), "reflection", lambda i: f"is not a reflection: |P² - 1| is {off[i]:.3e} of |P|²")
    refuse(~(skew <= tol), "reflection", lambda i: f"does not preserve the form: |ηP - Pᵀη| is {skew[i]:.3e} of |P|²")
    counts = np.rint((n + np.trace(p, axis1=-2, axis2=-1)) / 2).astype(int)
    k = int(counts.flat[0]) if counts.size else 0
    what, advice = "fixes a subspace of dimension", "convert one dimension at a time"
    refuse(
        np.asarray(counts != k), "reflection", lambda i: f"{what} {counts[i]}, the first one of dimension {k}; {advice}"
    )
    if not 0 < k < n:
        raise ValidationError("reflection is 1, -1 or empty, but must leave a proper subspace fixed")
    q = np.linalg.svd(p + np.eye(n))[0][..., :k]
    values, vectors = np.linalg.eigh((np.swapaxes(q, -1, -2) * signs) @ q)
    return np.asarray(q @ vectors / np.sqrt(np.abs(values))[..., None, :])

"""States as kets, and of one qubit on the Bloch sphere."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._core import ValidationError
from ..convert._reading import Array, numbers, real_numbers, unit_vectors, unmoved_by_underflow


def from_kets(kets: Any) -> Array:
    """Convert kets to points of `ComplexProjective`.

    Parameters
    ----------
    kets : qutip.Qobj, array_like of shape (n, 1), or nested lists of these
        Normalised kets.

    Returns
    -------
    ndarray, shape (..., n)
        Unit vectors.

    Raises
    ------
    ValidationError
        If a ket is not a column of length 1.

    Examples
    --------
    >>> from_kets([[[1], [0]], [[0.6], [0.8j]]])
    array([[1. +0.j , 0. +0.j ],
           [0.6+0.j , 0. +0.8j]])
    """
    columns, tol = numbers(_full(kets), "kets", 2)
    if columns.shape[-1] != 1:
        raise ValidationError(
            f"kets must be columns, of shape (..., n, 1), not {columns.shape}; for rows, such as bras, pass the adjoint"
        )
    return unit_vectors(columns[..., 0].astype(complex), tol, "kets", "a state")


def _full(kets: Any) -> Any:
    """Return the arrays of objects such as ``Qobj``, which are recognised by their method ``full``."""
    if hasattr(kets, "full"):
        return kets.full()
    if isinstance(kets, (list, tuple)) or (isinstance(kets, np.ndarray) and kets.dtype == object):
        return [_full(ket) for ket in kets]
    return kets


@unmoved_by_underflow
def bloch_vector(state: ArrayLike) -> Array:
    """Compute the points of qubit states on the Bloch sphere, the expectations of the Pauli matrices.

    Distances on the Bloch sphere are twice those of ``ComplexProjective(1)``.

    Parameters
    ----------
    state : array_like, shape (..., 2)
        Complex unit vectors with any phase.

    Returns
    -------
    ndarray, shape (..., 3)
        Unit vectors: (1, 0) is mapped to (0, 0, 1), (1, 1)/√2 to (1, 0, 0), and (1, i)/√2 to (0, 1, 0).

    Raises
    ------
    ValidationError
        If a state does not have two components, or its length is not 1.

    References
    ----------
    Nielsen & Chuang, "Quantum Computation and Quantum Information", section 1.2.

    Examples
    --------
    >>> bloch_vector([0.6, 0.8j]).round(8) + 0.0
    array([ 0.  ,  0.96, -0.28])
    """
    psi, tol = numbers(state, "state", 1)
    if psi.shape[-1] != 2:
        raise ValidationError(f"state must be of shape (..., 2), states of one qubit, not {psi.shape}")
    a, b = np.moveaxis(unit_vectors(psi, tol, "state", "a state"), -1, 0)
    across = 2 * a.conj() * b
    return np.stack([across.real, across.imag, (np.abs(a) - np.abs(b)) * (np.abs(a) + np.abs(b))], axis=-1)


@unmoved_by_underflow
def from_bloch_vector(vector: ArrayLike) -> Array:
    """Convert points of the Bloch sphere to qubit states, points of ``ComplexProjective(1)``.

    The phase is chosen such that the larger component is positive.

    Parameters
    ----------
    vector : array_like, shape (..., 3)
        Unit vectors.

    Returns
    -------
    ndarray, shape (..., 2)
        Unit vectors.

    Raises
    ------
    ValidationError
        If the length of a vector is not 1. Points inside the ball are mixed states.

    Examples
    --------
    >>> from_bloch_vector([0.0, 0.96, -0.28]).round(8)
    array([0. -0.6j, 0.8+0.j ])
    """
    v, tol = real_numbers(vector, "vector", (3,))
    v = unit_vectors(v, tol, "vector", "a pure state")
    up = v[..., 2] >= 0
    large = np.sqrt((1 + np.abs(v[..., 2])) / 2)
    small = (v[..., 0] + 1j * np.where(up, v[..., 1], -v[..., 1])) / (2 * large)
    return np.stack([np.where(up, large, small), np.where(up, small, large)], axis=-1)

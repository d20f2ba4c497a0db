"""States as kets, and of one qubit on the Bloch sphere."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._core import ValidationError
from ..convert.reading import Array, numbers, real_numbers, unit_vectors, unmoved_by_underflow


def from_kets(kets: Any) -> Array:
    """Points of `ComplexProjective` of kets: QuTiP's ``Qobj``, or columns of shape (n, 1).

    Args:
        kets: a ket, or lists of them.

    Returns:
        Unit vectors, shape (..., n).

    Raises:
        ValidationError: a ket is no column of length 1.

    >>> from_kets([[[1], [0]], [[0.6], [0.8j]]])
    array([[1. +0.j , 0. +0.j ],
           [0.6+0.j , 0. +0.8j]])
    """
    columns, tol = numbers(_full(kets), "kets", 2)
    if columns.shape[-1] != 1:
        raise ValidationError(
            f"kets must be columns, of shape (..., n, 1), not {columns.shape}; of rows, such as bras, use the adjoint"
        )
    return unit_vectors(columns[..., 0].astype(complex), tol, "kets", "a state")


def _full(kets: Any) -> Any:
    """The arrays of objects such as ``Qobj``, recognised by what they can do."""
    if hasattr(kets, "full"):
        return kets.full()
    if isinstance(kets, (list, tuple)) or (isinstance(kets, np.ndarray) and kets.dtype == object):
        return [_full(ket) for ket in kets]
    return kets


@unmoved_by_underflow
def bloch_vector(state: ArrayLike) -> Array:
    """The places of states of a qubit on the Bloch sphere: the expectations of Pauli's matrices.

    Distances there are twice those of ``ComplexProjective(1)``. Source: Nielsen & Chuang, Quantum Computation and
    Quantum Information, §1.2.

    Args:
        state: complex unit vectors, shape (..., 2), whatever their phase.

    Returns:
        Unit vectors, shape (..., 3): (1, 0) is at (0, 0, 1), (1, 1)/√2 at (1, 0, 0), (1, i)/√2 at (0, 1, 0).

    Raises:
        ValidationError: a state is not of two numbers, or not of length 1.

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
    """The states of a qubit at places of the Bloch sphere, points of ``ComplexProjective(1)``.

    Of all phases it is the one in which the larger component is positive.

    Args:
        vector: unit vectors, shape (..., 3).

    Returns:
        Unit vectors, shape (..., 2).

    Raises:
        ValidationError: a vector is not of length 1: inside the ball there are mixed states.

    >>> from_bloch_vector([0.0, 0.96, -0.28]).round(8)
    array([0. -0.6j, 0.8+0.j ])
    """
    v, tol = real_numbers(vector, "vector", (3,))
    v = unit_vectors(v, tol, "vector", "a pure state")
    up = v[..., 2] >= 0
    large = np.sqrt((1 + np.abs(v[..., 2])) / 2)
    small = (v[..., 0] + 1j * np.where(up, v[..., 1], -v[..., 1])) / (2 * large)
    return np.stack([np.where(up, large, small), np.where(up, small, large)], axis=-1)

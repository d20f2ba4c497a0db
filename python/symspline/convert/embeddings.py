"""Symmetric spaces that lie in others as totally geodesic parts: curves through points of one stay in it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._core import ValidationError
from .reading import Array, adjoint, largest, numbers, real_numbers, refuse, square_matrices


def siegel_to_positive_definite(z: ArrayLike) -> Array:
    """Points X + iY of Siegel's upper half space as symplectic positive definite matrices.

    The half space Sp(2n, R)/U(n) lies in `SymmetricPositiveDefinite(2n)` as the matrices
    (Y + XY⁻¹X, XY⁻¹; Y⁻¹X, Y⁻¹); for n = 1 it is the hyperbolic plane.

    Source: Siegel, Symplectic geometry (1943), §§2, 3.

    Args:
        z: complex symmetric matrices whose imaginary part is positive definite, shape (..., n, n).

    Returns:
        Points of ``siegel:n``, shape (..., 2n, 2n).

    Raises:
        ValidationError: a matrix is not symmetric, or its imaginary part is not positive definite.

    >>> siegel_to_positive_definite([[1 + 2j]])
    array([[2.5, 0.5],
           [0.5, 0.5]])
    """
    given, tol = square_matrices(z, "z")
    off = largest(given - np.swapaxes(given, -1, -2))
    allowed = tol * largest(given)
    refuse(~(off <= allowed), "z", lambda i: f"is not symmetric: entries differ by {off[i]:.3e}")
    given = 0.5 * (given + np.swapaxes(given, -1, -2))
    x, y = np.real(given), np.imag(given)
    least = np.linalg.eigvalsh(y)[..., 0]
    refuse(
        ~(least > 0),
        "z",
        lambda i: (
            f"has an imaginary part that is not positive definite: its smallest eigenvalue is {least[i]:.6e}"
        ),
    )
    back = np.linalg.inv(y)
    back = 0.5 * (back + np.swapaxes(back, -1, -2))
    beside = x @ back
    whole = np.concatenate(
        [
            np.concatenate([y + beside @ x, beside], axis=-1),
            np.concatenate([np.swapaxes(beside, -1, -2), back], axis=-1),
        ],
        axis=-2,
    )
    symmetric: Array = 0.5 * (whole + np.swapaxes(whole, -1, -2))
    return symmetric


def positive_definite_to_siegel(p: ArrayLike) -> Array:
    """The inverse of `siegel_to_positive_definite`.

    Args:
        p: symplectic positive definite matrices, shape (..., 2n, 2n).

    Returns:
        Complex symmetric matrices, shape (..., n, n).

    Raises:
        ValidationError: a matrix is not symmetric, not positive definite or not symplectic.

    >>> positive_definite_to_siegel([[2.5, 0.5], [0.5, 0.5]])
    array([[1.+2.j]])
    """
    given, tol = square_matrices(p, "p")
    n, odd = divmod(given.shape[-1], 2)
    if odd or np.iscomplexobj(given):
        raise ValidationError(
            f"p must be real, of shape (..., 2n, 2n), not {given.dtype} of shape {given.shape}"
        )
    off = largest(given - np.swapaxes(given, -1, -2))
    refuse(~(off <= tol * largest(given)), "p", lambda i: f"is not symmetric: entries differ by {off[i]:.3e}")
    values, vectors = np.linalg.eigh(given)
    refuse(
        ~(values[..., 0] > 0),
        "p",
        lambda i: f"is not positive definite: its smallest eigenvalue is {values[i][0]:.6e}",
    )
    # Seen from p^½ the symplectic p is its image Jp⁻¹Jᵀ, to rounding times its condition.
    j = np.block([[np.zeros((n, n)), np.eye(n)], [-np.eye(n), np.zeros((n, n))]])
    back = vectors / np.sqrt(values)[..., None, :]
    seen = np.swapaxes(back, -1, -2) @ j @ back
    off = largest(np.swapaxes(seen, -1, -2) @ seen - np.eye(2 * n))
    allowed = tol + 100 * np.finfo(np.float64).eps * values[..., -1] / values[..., 0]
    refuse(~(off <= allowed), "p", lambda i: f"is not symplectic: p and Jp⁻¹Jᵀ are {off[i]:.3e} apart")
    y = np.linalg.inv(given[..., n:, n:])
    z = given[..., :n, n:] @ y + 1j * y
    return 0.5 * (z + np.swapaxes(z, -1, -2))


def quaternions_to_subspace(q: ArrayLike) -> Array:
    """Points of quaternionic projective space HPⁿ as planes of C²ⁿ⁺².

    A unit vector of n + 1 quaternions a + bi + cj + dk, up to a unit quaternion on its right, spans a line; with
    (a + bi, c + di; −c + di, a − bi) for every quaternion it is a plane of C²ⁿ⁺²: a point of ``hp:n`` and of
    ``cgr:2,2n+2``, where curves through such points stay among them.

    Source: Besse, Manifolds all of whose geodesics are closed (1978), §3.

    Args:
        q: unit vectors of quaternions, shape (..., n + 1, 4), real part first.

    Returns:
        Points of ``hp:n``, bases of planes, shape (..., 2n + 2, 2).

    Raises:
        ValidationError: a vector does not have length 1.

    >>> quaternions_to_subspace([[0.6, 0, 0, 0], [0, 0, 0.8, 0]]).real
    array([[ 0.6,  0. ],
           [ 0. ,  0.6],
           [ 0. ,  0.8],
           [-0.8,  0. ]])
    """
    given, tol = real_numbers(q, "q", (None, 4))
    size = np.sqrt(np.sum(given**2, axis=(-2, -1)))
    refuse(~(np.abs(size - 1) <= tol), "q", lambda i: f"has length {size[i]:.9g}, not 1")
    a, b, c, d = np.moveaxis(given / size[..., None, None], -1, 0)
    rows = np.stack([np.stack([a + 1j * b, c + 1j * d], -1), np.stack([-c + 1j * d, a - 1j * b], -1)], -2)
    return rows.reshape(*given.shape[:-2], -1, 2)


def subspace_to_quaternions(basis: ArrayLike) -> Array:
    """A vector of quaternions of the line that `quaternions_to_subspace` makes a plane of: that whose first complex
    column is the first of the basis.

    Args:
        basis: orthonormal columns, shape (..., 2n + 2, 2).

    Returns:
        Unit vectors of quaternions, shape (..., n + 1, 4).

    Raises:
        ValidationError: a plane is no quaternionic line.

    >>> subspace_to_quaternions(quaternions_to_subspace([[0.6, 0, 0, 0], [0, 0, 0.8, 0]])) + 0.0
    array([[0.6, 0. , 0. , 0. ],
           [0. , 0. , 0.8, 0. ]])
    """
    given, tol = numbers(basis, "basis", 2)
    if given.shape[-1] != 2 or given.shape[-2] % 2 or given.shape[-2] < 2:
        raise ValidationError(f"basis must be of shape (..., 2n + 2, 2), not {given.shape}")
    first = given[..., 0] + 0j
    even, odd = first[..., ::2], first[..., 1::2]
    # The second column of the vector: j times the first.
    partner = np.stack([-odd.conj(), even.conj()], -1).reshape(*first.shape, 1)
    off = largest(partner - given @ (adjoint(given) @ partner))
    refuse(~(off <= tol), "basis", lambda i: f"spans no quaternionic line: j times it is {off[i]:.3e} off it")
    return np.stack([even.real, even.imag, -odd.real, odd.imag], -1)

"""Totally geodesic embeddings of symmetric spaces: curves through points of the submanifold stay in it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import refuse
from .._core import ValidationError
from ._reading import Array, adjoint, largest, numbers, real_numbers, square_matrices


def siegel_to_positive_definite(z: ArrayLike) -> Array:
    """Convert points X + iY of Siegel's upper half space to symplectic positive definite matrices.

    Parameters
    ----------
    z : array_like, shape (..., n, n)
        Complex symmetric matrices whose imaginary part is positive definite.

    Returns
    -------
    ndarray, shape (..., 2n, 2n)
        Points of ``siegel:n``.

    Raises
    ------
    ValidationError
        If a matrix is not symmetric, or its imaginary part is not positive definite.

    Notes
    -----
    The half space Sp(2n, R)/U(n) is embedded in `SymmetricPositiveDefinite(2n)` as the matrices
    (Y + XY⁻¹X, XY⁻¹; Y⁻¹X, Y⁻¹) [1]_. For n = 1 it is the hyperbolic plane.

    References
    ----------
    .. [1] Siegel, "Symplectic geometry", 1943, sections 2 and 3.

    Examples
    --------
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
    what = "has an imaginary part that is not positive definite: its smallest eigenvalue is"
    refuse(~(least > 0), "z", lambda i: f"{what} {least[i]:.6e}")
    back = np.linalg.inv(y)
    back = 0.5 * (back + np.swapaxes(back, -1, -2))
    beside = x @ back
    whole = np.block([[y + beside @ x, beside], [np.swapaxes(beside, -1, -2), back]])
    return np.asarray(0.5 * (whole + np.swapaxes(whole, -1, -2)))


def positive_definite_to_siegel(p: ArrayLike) -> Array:
    """Convert symplectic positive definite matrices to points of Siegel's upper half space.

    This is the inverse of `siegel_to_positive_definite`.

    Parameters
    ----------
    p : array_like, shape (..., 2n, 2n)
        Symplectic positive definite matrices.

    Returns
    -------
    ndarray, shape (..., n, n)
        Complex symmetric matrices.

    Raises
    ------
    ValidationError
        If a matrix is not symmetric, not positive definite or not symplectic.

    Examples
    --------
    >>> positive_definite_to_siegel([[2.5, 0.5], [0.5, 0.5]])
    array([[1.+2.j]])
    """
    given, tol = square_matrices(p, "p")
    n, odd = divmod(given.shape[-1], 2)
    if odd or np.iscomplexobj(given):
        raise ValidationError(f"p must be real, of shape (..., 2n, 2n), not {given.dtype} of shape {given.shape}")
    off = largest(given - np.swapaxes(given, -1, -2))
    refuse(~(off <= tol * largest(given)), "p", lambda i: f"is not symmetric: entries differ by {off[i]:.3e}")
    values, vectors = np.linalg.eigh(given)
    refuse(
        ~(values[..., 0] > 0), "p", lambda i: f"is not positive definite: its smallest eigenvalue is {values[i][0]:.6e}"
    )
    # Relative to p^½, a symplectic p equals Jp⁻¹Jᵀ up to rounding errors times its condition number.
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
    """Convert points of quaternionic projective space HPⁿ to planes of C²ⁿ⁺².

    Parameters
    ----------
    q : array_like, shape (..., n + 1, 4)
        Unit vectors of quaternions, real part first.

    Returns
    -------
    ndarray, shape (..., 2n + 2, 2)
        Points of ``hp:n``, bases of planes.

    Raises
    ------
    ValidationError
        If the length of a vector is not 1.

    Notes
    -----
    A unit vector of n + 1 quaternions a + bi + cj + dk, up to a unit quaternion on its right, spans a line [1]_.
    Replacing every quaternion by the matrix (a + bi, c + di; −c + di, a − bi) gives a plane of C²ⁿ⁺²: a point of
    ``hp:n`` and of ``cgr:2,2n+2``, where curves through such points remain points of ``hp:n``.

    References
    ----------
    .. [1] Besse, "Manifolds all of whose geodesics are closed", 1978, section 3.

    Examples
    --------
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
    """Convert planes of C²ⁿ⁺² to vectors of quaternions, the inverse of `quaternions_to_subspace`.

    Among the vectors of a line, the result is the one whose first complex column is the first column of the basis.

    Parameters
    ----------
    basis : array_like, shape (..., 2n + 2, 2)
        Matrices with orthonormal columns.

    Returns
    -------
    ndarray, shape (..., n + 1, 4)
        Unit vectors of quaternions.

    Raises
    ------
    ValidationError
        If a plane is not a quaternionic line.

    Examples
    --------
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
    refuse(~(off <= tol), "basis", lambda i: f"does not span a quaternionic line: j times it differs by {off[i]:.3e}")
    return np.stack([even.real, even.imag, -odd.real, odd.imag], -1)

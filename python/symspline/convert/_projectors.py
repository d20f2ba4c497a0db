"""Subspaces as projectors, and pure quantum states as density matrices, which do not depend on the basis or the
phase."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import refuse
from .._core import ValidationError
from ._reading import (
    Array,
    adjoint,
    largest,
    length,
    numbers,
    off_one,
    square_matrices,
    unit_vectors,
    unmoved_by_underflow,
)


@unmoved_by_underflow
def basis_to_projector(basis: ArrayLike) -> Array:
    """Convert bases of subspaces to orthogonal projectors Y Y*, which do not depend on the basis.

    Parameters
    ----------
    basis : array_like, shape (..., n, k)
        Points of a Grassmannian, real or complex matrices with orthonormal columns.

    Returns
    -------
    ndarray, shape (..., n, n)
        Hermitian matrices.

    Raises
    ------
    ValidationError
        If the columns are not orthonormal.

    References
    ----------
    Bendokat, Zimmermann & Absil, "A Grassmann manifold handbook", 2020, section 2.

    Examples
    --------
    >>> basis_to_projector([[0.6], [0.8]]).round(8)
    array([[0.36, 0.48],
           [0.48, 0.64]])
    """
    y, tol = numbers(basis, "basis", 2)
    if not 1 <= y.shape[-1] <= y.shape[-2]:
        raise ValidationError(f"basis must be of shape (..., n, k) with 1 <= k <= n, not {y.shape}")
    off = off_one(y)
    advice = "orthonormalise it, for example by numpy.linalg.qr(basis).Q"
    refuse(~(off <= tol), "basis", lambda i: f"does not have orthonormal columns: |Y*Y - 1| is {off[i]:.3e}; {advice}")
    q = np.linalg.qr(y).Q
    return _hermitian_part(q @ adjoint(q))


@unmoved_by_underflow
def projector_to_basis(projector: ArrayLike) -> Array:
    """Convert orthogonal projectors to orthonormal bases of their subspaces, points of a Grassmannian.

    Parameters
    ----------
    projector : array_like, shape (..., n, n)
        Real or complex Hermitian matrices P = P², all of the same rank k.

    Returns
    -------
    ndarray, shape (..., n, k)
        Matrices with orthonormal columns.

    Raises
    ------
    ValidationError
        If a matrix is not a projector, or the ranks differ.

    Examples
    --------
    >>> abs(projector_to_basis([[0.36, 0.48], [0.48, 0.64]])).round(8)
    array([[0.6],
           [0.8]])
    """
    p, tol = square_matrices(projector, "projector")
    _check_projectors(p, tol, "projector", "a projector", "use basis_to_projector to convert bases")
    ranks = np.rint(np.trace(p, axis1=-2, axis2=-1).real).astype(int)
    rank = int(ranks.max(initial=0))
    bad = np.asarray(ranks != rank)
    advice = "convert subspaces of one dimension at a time"
    refuse(bad, "projector", lambda i: f"has rank {ranks[i]}, but others have rank {rank}; {advice}")
    if rank == 0:
        raise ValidationError("projector is zero or empty, but must have rank 1 or more")
    return np.asarray(np.linalg.eigh(p).eigenvectors[..., p.shape[-1] - rank :])


@unmoved_by_underflow
def state_to_density(state: ArrayLike) -> Array:
    """Convert pure states to density matrices ψψ*, which do not depend on the phase of ψ.

    Parameters
    ----------
    state : array_like, shape (..., n)
        Unit vectors, points of `ComplexProjective` or `RealProjective`.

    Returns
    -------
    ndarray, shape (..., n, n)
        Hermitian matrices with trace 1.

    Raises
    ------
    ValidationError
        If the length of a vector is not 1.

    Examples
    --------
    >>> state_to_density([0.6, 0.8j]).round(8)
    array([[0.36+0.j  , 0.  -0.48j],
           [0.  +0.48j, 0.64+0.j  ]])
    """
    psi, tol = numbers(state, "state", 1)
    psi = unit_vectors(psi, tol, "state", "a state")
    return np.asarray(psi[..., :, None] * psi[..., None, :].conj())


@unmoved_by_underflow
def density_to_state(density: ArrayLike) -> Array:
    """Convert density matrices of pure states to state vectors, points of `ComplexProjective`.

    The phase is chosen such that the largest component is positive.

    Parameters
    ----------
    density : array_like, shape (..., n, n)
        Hermitian matrices ρ = ρ² with trace 1.

    Returns
    -------
    ndarray, shape (..., n)
        Unit vectors.

    Raises
    ------
    ValidationError
        If a matrix is not a density matrix, or the density matrix of a mixed state.

    References
    ----------
    Nielsen & Chuang, "Quantum Computation and Quantum Information", section 2.4.

    Examples
    --------
    >>> density_to_state([[0.64, -0.48j], [0.48j, 0.36]]).round(8)
    array([0.8+0.j , 0. +0.6j])
    """
    rho, tol = square_matrices(density, "density")
    traces = np.trace(rho, axis1=-2, axis2=-1)
    bad = ~(np.abs(traces - 1) <= tol)
    advice = "divide it by its trace"
    refuse(bad, "density", lambda i: f"is not a density matrix: its trace is {traces[i]}, not 1; {advice}")
    _check_projectors(rho, tol, "density", "a pure state", "only pure states, of purity tr P² = 1, have a state vector")
    rho = _hermitian_part(rho)
    best = np.argmax(np.diagonal(rho, axis1=-2, axis2=-1).real, axis=-1)
    psi = np.take_along_axis(rho, best[..., None, None], axis=-1)[..., 0]
    return np.asarray(psi / length(np.abs(psi))[..., None])


def _check_projectors(p: Array, tol: float, name: str, what: str, advice: str) -> None:
    # Input that is far off may overflow.
    with np.errstate(over="ignore", invalid="ignore"):
        skew, square = largest(p - adjoint(p)), p @ p
        off = largest(square - p)
    refuse(~(skew <= tol), name, lambda i: f"is not Hermitian: |P - P*| is {skew[i]:.3e}; {advice}")

    what = f"is not {what}: |P² - P| is"
    refuse(~(off <= tol), name, lambda i: f"{what} {off[i]:.3e}, tr P² is {np.trace(square[i]).real:.6g}; {advice}")


def _hermitian_part(x: Array) -> Array:
    return np.asarray((x + adjoint(x)) / 2)

"""Models of hyperbolic space and Siegel's half-space, subspaces, and pure quantum states.

The formulas are those of Ratcliffe, Foundations of Hyperbolic Manifolds, §4.5 and §4.6. The origins of the three models
correspond: (1, 0, …, 0), the centre of the ball, and (0, …, 0, 1) in the half-space, whose last coordinate is the
height. The point at infinity of the half-space is (0, …, 0, 1) on the boundary of the ball.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import (
    adjoint,
    check_orthonormal,
    check_symmetric,
    hermitian_part,
    largest,
    length,
    numbers,
    real_numbers,
    refuse,
    square_matrices,
    unit_vectors,
    unmoved_by_underflow,
)
from .._base.typing import Array
from .._core import ValidationError


@unmoved_by_underflow()
def hyperboloid_to_ball(x: ArrayLike) -> Array:
    """Convert points of `Hyperbolic` to the Poincaré ball, by stereographic projection.

    Parameters
    ----------
    x : array_like, shape (..., n + 1)
        Points of the hyperboloid, time-like coordinate first.

    Returns
    -------
    ndarray, shape (..., n)
        Vectors shorter than 1.

    Raises
    ------
    ValidationError
        If a point is not on the hyperboloid, or at a distance of more than about 36, where it rounds to the boundary.

    Examples
    --------
    >>> hyperboloid_to_ball([1.25, 0.0, 0.75]).round(8)
    array([0.        , 0.33333333])
    """
    return _to_ball(_from_hyperboloid(x), "x")


@unmoved_by_underflow()
def ball_to_hyperboloid(y: ArrayLike) -> Array:
    """Convert points of the Poincaré ball to points of `Hyperbolic`.

    Parameters
    ----------
    y : array_like, shape (..., n)
        Vectors shorter than 1.

    Returns
    -------
    ndarray, shape (..., n + 1)
        Points of the hyperboloid, time-like coordinate first.

    Raises
    ------
    ValidationError
        If a vector is not inside the unit ball.

    Examples
    --------
    >>> ball_to_hyperboloid([0.0, 1 / 3]).round(8)
    array([1.25, 0.  , 0.75])
    """
    return _to_hyperboloid(_from_ball(y))


@unmoved_by_underflow()
def hyperboloid_to_half_space(x: ArrayLike) -> Array:
    """Convert points of `Hyperbolic` to the upper half-space.

    Parameters
    ----------
    x : array_like, shape (..., n + 1)
        Points of the hyperboloid, time-like coordinate first.

    Returns
    -------
    ndarray, shape (..., n)
        Points with positive height, which is the last coordinate.

    Raises
    ------
    ValidationError
        If a point is not on the hyperboloid.

    Examples
    --------
    >>> hyperboloid_to_half_space([1.25, 0.0, 0.75])
    array([0., 2.])
    """
    return _to_half_space(_from_hyperboloid(x))


@unmoved_by_underflow()
def half_space_to_hyperboloid(z: ArrayLike) -> Array:
    """Convert points of the upper half-space to points of `Hyperbolic`.

    Parameters
    ----------
    z : array_like, shape (..., n)
        Points with positive last coordinate.

    Returns
    -------
    ndarray, shape (..., n + 1)
        Points of the hyperboloid, time-like coordinate first.

    Raises
    ------
    ValidationError
        If a height is not positive, or a point is so distant that its coordinates overflow.

    Examples
    --------
    >>> half_space_to_hyperboloid([0.0, 2.0])
    array([1.25, 0.  , 0.75])
    """
    return _to_hyperboloid(_from_half_space(z))


@unmoved_by_underflow()
def ball_to_half_space(y: ArrayLike) -> Array:
    """Convert points of the Poincaré ball to the upper half-space.

    Parameters
    ----------
    y : array_like, shape (..., n)
        Vectors shorter than 1.

    Returns
    -------
    ndarray, shape (..., n)
        Points with positive height, which is the last coordinate.

    Raises
    ------
    ValidationError
        If a vector is not inside the unit ball.

    Examples
    --------
    >>> ball_to_half_space([0.0, 1 / 3]).round(8)
    array([0., 2.])
    """
    return _to_half_space(_from_ball(y))


@unmoved_by_underflow()
def half_space_to_ball(z: ArrayLike) -> Array:
    """Convert points of the upper half-space to the Poincaré ball.

    Parameters
    ----------
    z : array_like, shape (..., n)
        Points with positive last coordinate.

    Returns
    -------
    ndarray, shape (..., n)
        Vectors shorter than 1.

    Raises
    ------
    ValidationError
        If a height is not positive, or a point is at a distance of more than about 36, where it rounds to the boundary.

    Examples
    --------
    >>> half_space_to_ball([0.0, 2.0]).round(8)
    array([0.        , 0.33333333])
    """
    return _to_ball(_from_half_space(z), "z")


# Every conversion goes through the space-like coordinates x₁, …, xₙ of the hyperboloid, which determine the first one.


def _from_hyperboloid(value: ArrayLike) -> Array:
    x, tol = real_numbers(value, "x", (None,))
    if x.shape[-1] < 2:
        raise ValidationError(f"x has shape {x.shape}, but points of the hyperboloid need at least two numbers")
    time = _time(x[..., 1:])[..., 0]
    bad = ~(np.abs(x[..., 0] - time) <= tol * time)
    advice = "Hyperbolic(n).project(x) projects points onto it"
    what = "is not on the hyperboloid: its time-like coordinate, the first, is"
    refuse(bad, "x", lambda i: f"{what} {x[i][0]}, but sqrt(1 + |rest|²) is {time[i]}; {advice}")
    return x[..., 1:]


def _from_ball(value: ArrayLike) -> Array:
    y, _ = real_numbers(value, "y", (None,))
    lengths = length(y)
    advice = "points of the Poincaré ball must be shorter than 1"
    refuse(~(lengths < 1), "y", lambda i: f"is not inside the unit ball: its length is {lengths[i]}; {advice}")
    return np.asarray(2 * y / ((1 - lengths) * (1 + lengths))[..., None])


def _from_half_space(value: ArrayLike) -> Array:
    z, _ = real_numbers(value, "z", (None,))
    ground, height = z[..., :-1], z[..., -1:]
    what = "is not in the upper half-space: its last coordinate, the height, is"
    advice = "it must be positive (put the height last)"
    refuse(~(height[..., 0] > 0), "z", lambda i: f"{what} {z[i][-1]}; {advice}")
    with np.errstate(over="ignore", invalid="ignore"):
        rest = ground / height
        last = (np.sum(rest * ground, axis=-1, keepdims=True) + (height - 1) * (1 + 1 / height)) / 2
        rest = np.concatenate([rest, last], axis=-1)
    bad = ~np.isfinite(length(rest))
    refuse(bad, "z", lambda i: f"is too distant for the hyperboloid, where it overflows: its height is {height[i][0]}")
    return rest


def _to_hyperboloid(rest: Array) -> Array:
    return np.concatenate([_time(rest), rest], axis=-1)


def _to_ball(rest: Array, name: str) -> Array:
    y: Array = rest / (1 + _time(rest))
    lengths = length(y)
    what = "is too distant for the ball: in double precision its length is"
    advice = "must be below 1; use the hyperboloid or the half-space"
    refuse(~(lengths < 1), name, lambda i: f"{what} {lengths[i]}, but {advice}")
    return y


def _to_half_space(rest: Array) -> Array:
    ground, last = rest[..., :-1], rest[..., -1:]
    sum_ = _time(rest) + np.abs(last)
    # (x₀ − |xₙ|)(x₀ + |xₙ|) = 1 + x₁² + …: the difference itself would cancel.
    across = _time(ground)
    steep = np.where(last > 0, across / sum_ * across, sum_)
    return np.concatenate([ground / steep, 1 / steep], axis=-1)


def _time(rest: Array) -> Array:
    """Return sqrt(1 + |x|²), shape (..., 1)."""
    return np.asarray(np.hypot(1.0, length(rest))[..., None])


# ---- Siegel's upper half-space ----


def siegel_to_positive_definite(z: ArrayLike) -> Array:
    r"""Convert points X + iY of Siegel's upper half space to symplectic positive definite matrices.

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
    The half space :math:`Sp(2n, \mathbb R)/U(n)` is embedded in `SymmetricPositiveDefinite(2n)` as the
    matrices :math:`\begin{pmatrix} Y + XY^{-1}X & XY^{-1} \\ Y^{-1}X & Y^{-1} \end{pmatrix}` [1]_. For n = 1 it is the
    hyperbolic plane.

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
    check_symmetric(given, tol * largest(given), "z")
    x, y = hermitian_part(given.real), hermitian_part(given.imag)
    least = np.linalg.eigvalsh(y)[..., 0]
    what = "has an imaginary part that is not positive definite: its smallest eigenvalue is"
    refuse(~(least > 0), "z", lambda i: f"{what} {least[i]:.6e}")
    back = hermitian_part(np.linalg.inv(y))
    beside = x @ back
    return hermitian_part(np.block([[y + beside @ x, beside], [adjoint(beside), back]]))


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
    check_symmetric(given, tol * largest(given), "p")
    values, vectors = np.linalg.eigh(given)
    refuse(
        ~(values[..., 0] > 0), "p", lambda i: f"is not positive definite: its smallest eigenvalue is {values[i][0]:.6e}"
    )
    # Relative to p^½, a symplectic p equals Jp⁻¹Jᵀ up to rounding errors times its condition number.
    j = np.block([[np.zeros((n, n)), np.eye(n)], [-np.eye(n), np.zeros((n, n))]])
    back = vectors / np.sqrt(values)[..., None, :]
    seen = adjoint(back) @ j @ back
    off = largest(adjoint(seen) @ seen - np.eye(2 * n))
    allowed = tol + 100 * np.finfo(np.float64).eps * values[..., -1] / values[..., 0]
    refuse(~(off <= allowed), "p", lambda i: f"is not symplectic: p and Jp⁻¹Jᵀ are {off[i]:.3e} apart")
    y = np.linalg.inv(given[..., n:, n:])
    z = given[..., :n, n:] @ y + 1j * y
    return 0.5 * (z + np.swapaxes(z, -1, -2))


# ---- projectors ----


@unmoved_by_underflow()
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
    check_orthonormal(y, tol, "basis", "orthonormalise it, for example by numpy.linalg.qr(basis).Q")
    q = np.linalg.qr(y).Q
    return hermitian_part(q @ adjoint(q))


@unmoved_by_underflow()
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


@unmoved_by_underflow()
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


@unmoved_by_underflow()
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
    rho = hermitian_part(rho)
    best = np.argmax(np.diagonal(rho, axis1=-2, axis2=-1).real, axis=-1)
    psi = np.take_along_axis(rho, best[..., None, None], axis=-1)[..., 0]
    return np.asarray(psi / length(np.abs(psi))[..., None])


def _check_projectors(p: Array, tol: float, name: str, what: str, advice: str) -> None:
    check_symmetric(p, tol, name, "Hermitian", f"; {advice}")
    # Input that is far off may overflow.
    with np.errstate(over="ignore", invalid="ignore"):
        square = p @ p
        off = largest(square - p)
    what = f"is not {what}: |P² - P| is"
    refuse(~(off <= tol), name, lambda i: f"{what} {off[i]:.3e}, tr P² is {np.trace(square[i]).real:.6g}; {advice}")


# ---- reflections in an indefinite form ----


@unmoved_by_underflow()
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


@unmoved_by_underflow()
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
    square_matrices(p, "reflection")
    n = p.shape[-1]
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


def _signs(n: int, negative: int) -> Array:
    """The diagonal of the form."""
    if isinstance(negative, bool) or not isinstance(negative, (int, np.integer)) or not 0 <= negative <= n:
        raise ValidationError(f"negative must be a whole number from 0 to {n}, not {negative!r}")
    return np.where(np.arange(n) < negative, -1.0, 1.0)


# ---- quaternionic lines ----


def quaternions_to_subspace(q: ArrayLike) -> Array:
    r"""Convert points of quaternionic projective space HPⁿ to planes of C²ⁿ⁺².

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
    A unit vector of n + 1 quaternions a + bi + cj + dk, up to a unit quaternion on its right, spans a line
    [1]_. Replacing every quaternion by the matrix
    :math:`\begin{pmatrix} a + bi & c + di \\ -c + di & a - bi \end{pmatrix}` gives a plane of :math:`\mathbb C^{2n+2}`:
    a point of ``hp:n`` and of ``cgr:2,2n+2``, where curves through such points remain points of ``hp:n``.

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

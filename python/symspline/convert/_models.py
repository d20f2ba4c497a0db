"""Models of hyperbolic space: the hyperboloid, the Poincaré ball, the upper half-space, also that of Siegel.

The formulas are those of Ratcliffe, Foundations of Hyperbolic Manifolds, §4.5 and §4.6. The origins of the three models
correspond: (1, 0, …, 0), the centre of the ball, and (0, …, 0, 1) in the half-space, whose last coordinate is the
height. The point at infinity of the half-space is (0, …, 0, 1) on the boundary of the ball.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import adjoint, refuse
from .._base.validation import (
    Array,
    check_symmetric,
    hermitian_part,
    largest,
    length,
    real_numbers,
    square_matrices,
    unmoved_by_underflow,
)
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

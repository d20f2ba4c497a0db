"""Geodesics of subspaces and of positive definite matrices in JAX."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax.scipy.linalg import expm, solve_triangular

from ._models import Model
from ._spectral import adjoint, arcs, hermitian, logarithm

# Newton's iteration for the nearest orthonormal columns is at rounding after so many steps from singular values
# between .4 and 1.5.
_STEPS = 9
# cos and sin of a matrix are series of what is this many times halved, which angles up to 2³ need.
_HALVINGS = 3
_TERMS = 12


class Planes(Model):
    """Orthonormal columns up to a unitary factor on their right: Edelman, Arias & Smith (1998)."""

    axes = 2

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        points = orthonormal(points)
        return points, velocities - points @ (adjoint(points) @ velocities)

    def exp(self, p: Any, v: Any) -> Any:
        cosine, sine = _trigonometric(adjoint(v) @ v)
        return p @ cosine + v @ sine

    def log(self, p: Any, q: Any) -> Any:
        overlap = adjoint(p) @ q
        beside = q - p @ overlap
        return beside @ arcs(adjoint(beside) @ beside) @ adjoint(overlap)


class Positive(Model):
    """Positive definite matrices with the affine-invariant metric."""

    axes = 2

    def to_internal(self, points: Any, velocities: Any) -> tuple[Any, Any]:
        return hermitian(points), hermitian(velocities)

    def exp(self, p: Any, v: Any) -> Any:
        root = jnp.linalg.cholesky(p)
        return root @ expm(_whitened(root, v)) @ adjoint(root)

    def log(self, p: Any, q: Any) -> Any:
        root = jnp.linalg.cholesky(p)
        return root @ logarithm(_whitened(root, q)) @ adjoint(root)

    def between(self, p: Any, q: Any, t: Any) -> Any:
        root = jnp.linalg.cholesky(p)
        step = logarithm(_whitened(root, q))
        return root @ expm(self.times(t, step)) @ adjoint(root)


def orthonormal(columns: Any) -> Any:
    """The nearest orthonormal columns; NaN where the given ones are so far off that the iteration does not end."""
    one = jnp.eye(columns.shape[-1], dtype=columns.dtype)
    for _ in range(_STEPS):
        columns = 0.5 * columns @ (3 * one - adjoint(columns) @ columns)
    off = jnp.abs(adjoint(columns) @ columns - one).max(axis=(-2, -1), keepdims=True)
    return jnp.where(off < 1e-5, columns, jnp.nan)


def _trigonometric(square: Any) -> tuple[Any, Any]:
    """cos √z and sin √z / √z of Hermitian matrices z without negative eigenvalues."""
    one = jnp.eye(square.shape[-1], dtype=square.dtype)
    z = square / 4**_HALVINGS
    cosine = sine = one
    for n in range(_TERMS, 0, -1):
        cosine = one - z @ cosine / (2 * n * (2 * n - 1))
        sine = one - z @ sine / (2 * n * (2 * n + 1))
    for _ in range(_HALVINGS):
        cosine, sine, z = one - 2 * z @ sine @ sine, cosine @ sine, 4 * z
    return cosine, sine


def _whitened(root: Any, x: Any) -> Any:
    """L⁻¹ x L⁻* for a Hermitian x."""
    left = solve_triangular(root, x, lower=True)
    return hermitian(adjoint(solve_triangular(root, adjoint(left), lower=True)))

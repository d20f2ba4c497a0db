"""Functions of Hermitian matrices in JAX, with derivatives of any order."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._closed_forms.divided import Divided, derivative
from .._closed_forms.divided import logarithm as divided_logarithm
from .._closed_forms.library import hermitian
from ._precision import full_precision
from ._series import arc


def logarithm(a: Any) -> Any:
    """log of positive definite matrices, shape (..., n, n)."""
    return _function(_log, a)


def arcs(a: Any) -> Any:
    """φ / (sin φ cos φ) of Hermitian matrices sin²φ, shape (..., n, n)."""
    return _function(_arc, a)


def _function(divided: Divided, a: Any) -> Any:
    a = hermitian(a)
    values, vectors = jnp.linalg.eigh(jax.lax.stop_gradient(a))
    return _derivative(divided, a, values, vectors, ())


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _derivative(divided: Divided, a: Any, values: Any, vectors: Any, directions: Any) -> Any:
    """The derivative of order k in k directions, at a matrix with these eigenvalues and eigenvectors."""
    return derivative(jnp, divided, values, vectors, directions)


@_derivative.defjvp
@full_precision
def _next(divided: Divided, primals: Any, tangents: Any) -> Any:
    a, values, vectors, directions = primals
    da, _, _, changes = tangents
    call = partial(_derivative, divided, a, values, vectors)
    moved = call((*directions, da))
    for i, change in enumerate(changes):
        moved += call((*directions[:i], change, *directions[i + 1 :]))
    return call(directions), moved


# ---- divided differences ----


def _log(*x: Any) -> Any:
    return divided_logarithm(jnp, lambda array, like: jnp.asarray(array, like.dtype), *x)


def _arc(*y: Any) -> Any:
    if len(y) == 1:
        return arc(y[0], 1 - y[0])
    # ∫ du / (1 − y(1 − u²)) over u from 0 to 1.
    nodes, weights = np.polynomial.legendre.leggauss(80)
    nodes, weights = nodes[40:], weights[40:]
    square = 1 - nodes**2
    total = weights * square ** (len(y) - 1)
    for own in y:
        total = total / (1 - own[..., None] * square)
    return jnp.sum(total, axis=-1)

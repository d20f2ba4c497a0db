"""Functions of Hermitian matrices in JAX, with derivatives of any order.

The derivative of a function of a matrix is made of divided differences of the function between eigenvalues
(Daleckii & Krein 1965; Higham, *Functions of Matrices*, §3.2), which are smooth where eigenvalues coincide. So are
those of higher order, and eigenvectors are never differentiated.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import permutations
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ._series import arc

# Divided differences between some numbers, arrays that broadcast; of one number the function.
Divided = Callable[..., Any]


def adjoint(a: Any) -> Any:
    """The conjugate transpose of matrices."""
    return jnp.conj(jnp.swapaxes(a, -1, -2))


def hermitian(a: Any) -> Any:
    """The Hermitian part of matrices."""
    return 0.5 * (a + adjoint(a))


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
    """The derivative of order k in k directions.

    With directions H, in the basis of eigenvectors it is Σ f[λ_i, λ_j, …, λ_l] H_ij … H_ml, over all orders of the
    directions and all indices between i and l.
    """
    k, n = len(directions), values.shape[-1]
    # λ along an axis of its own for each of the k + 1 indices.
    own = [values.reshape(*values.shape[:-1], *(n if i == j else 1 for j in range(k + 1))) for i in range(k + 1)]
    weights = divided(*own)
    if not directions:
        return (vectors * weights[..., None, :]) @ adjoint(vectors)
    turned = [adjoint(vectors) @ h @ vectors for h in directions]
    letters = "abcdefghijklmnopqrstuvwxyz"[: k + 1]
    pairs = ",".join(f"...{letters[i : i + 2]}" for i in range(k))
    rule = f"...{letters},{pairs}->...{letters[0]}{letters[-1]}"
    total = sum(jnp.einsum(rule, weights, *order) for order in permutations(turned))
    return vectors @ total @ adjoint(vectors)


@_derivative.defjvp
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
    if len(x) == 1:
        return jnp.log(x[0])
    if len(x) == 2:
        ratio = (x[0] - x[1]) / (x[0] + x[1])
        same = ratio == 0
        slope = jnp.where(same, 1.0, jnp.arctanh(ratio) / jnp.where(same, 1.0, ratio))
        return 2 * slope / (x[0] + x[1])
    # ∓ ∫ Π 1/(x_i + s) ds over all s > 0, by the trapezoidal rule in log s, whose error is exp(−2π²/step).
    step = 0.5
    mean = jnp.exp(sum(jnp.log(own) for own in x) / len(x))
    sign = (-1.0) ** len(x)
    shift = np.exp(step * np.arange(-90, 91))
    s = mean[..., None] * shift
    total = step * jnp.sum(
        s / jnp.prod(jnp.stack([own[..., None] + s for own in jnp.broadcast_arrays(*x)]), axis=0), axis=-1
    )
    return sign * total


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

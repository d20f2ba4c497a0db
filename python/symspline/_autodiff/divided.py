"""Derivatives of functions of Hermitian matrices by divided differences, of any order.

The derivative of a function of a matrix is made of divided differences of the function between eigenvalues
(Daleckii & Krein 1965; Higham, *Functions of Matrices*, §3.2), which are smooth where eigenvalues coincide. So are
those of higher order, and eigenvectors are never differentiated.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations
from typing import Any

import numpy as np

from .library import adjoint

# Divided differences between some numbers, arrays that broadcast; of one number the function.
Divided = Callable[..., Any]


def derivative(xp: Any, divided: Divided, values: Any, vectors: Any, directions: Any) -> Any:
    """Return the derivative of order k in k directions at a matrix with these eigenvalues and eigenvectors.

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
    total = sum(xp.einsum(rule, weights, *order) for order in permutations(turned))
    return vectors @ total @ adjoint(vectors)


def logarithm(xp: Any, constant: Any, *x: Any) -> Any:
    """Return divided differences of log."""
    if len(x) == 1:
        return xp.log(x[0])
    if len(x) == 2:
        ratio = (x[0] - x[1]) / (x[0] + x[1])
        same = ratio == 0
        slope = xp.where(same, 1.0, xp.arctanh(ratio) / xp.where(same, 1.0, ratio))
        return 2 * slope / (x[0] + x[1])
    # ∓ ∫ Π 1/(x_i + s) ds over all s > 0, by the trapezoidal rule in log s, whose error is exp(−2π²/step).
    step = 0.5
    mean = xp.exp(sum(xp.log(own) for own in x) / len(x))
    s = mean[..., None] * constant(np.exp(step * np.arange(-90, 91)), mean)
    total = s
    for own in x:
        total = total / (own[..., None] + s)
    return (-1.0) ** len(x) * step * total.sum(axis=-1)


def arc(xp: Any, constant: Any, function: Any, *y: Any) -> Any:
    """Return divided differences of `library.Library.arc`."""
    if len(y) == 1:
        return function(y[0], 1 - y[0])
    # ∫ du / (1 − y(1 − u²)) over u from 0 to 1.
    nodes, weights = np.polynomial.legendre.leggauss(80)
    square = constant(1 - nodes[40:] ** 2, y[0])
    total = constant(weights[40:], y[0]) * square ** (len(y) - 1)
    for own in y:
        total = total / (1 - own[..., None] * square)
    return total.sum(axis=-1)

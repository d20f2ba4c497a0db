"""What the formulas need of a library of arrays with derivatives, and derivatives of functions of matrices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import permutations
from math import factorial
from typing import Any

import numpy as np

from .._base.typing import AnyFunction

# Series are used up to here, and closed forms from here on. Both are smooth there, so that a library differentiates
# them as they are; the series have enough terms for derivatives of third order.
_STUMPFF, _STUMPFF_TERMS = 4.0, 22
_ARC, _ARC_TERMS = 0.3, 46


Tensor = Any
"""An array of JAX or of PyTorch."""
Module = Any
"""The library itself, `jax.numpy` or `torch`."""


@dataclass(frozen=True)
class Library:
    """Functions of a library of arrays.

    Attributes
    ----------
    name, module : str
        The library, such as ``"JAX"``, and the module of symspline, such as ``"jax"``, in messages.
    general : bool
        Whether complex spaces, projective spaces and Grassmannians are supported.
    xp : module
        ``jax.numpy`` or ``torch``. The formulas use names and keywords that both have.
    array : callable
        ``array(value, name, like)`` converts an argument to the precision and the device of `like`.
    promote : callable
        ``promote(space, points, *others)`` converts points, and arrays of their shape, to one precision.
    constant : callable
        ``constant(array, like)`` converts an array of NumPy to the library, in the precision and on the device of
        `like`.
    logarithm, exponential : callable
        The logarithm of positive definite matrices, and the exponential of any.
    arcs : callable or None
        `Library.arc` of Hermitian matrices.
    solve_lower : callable
        ``solve_lower(root, x)`` is root⁻¹ x for lower triangular matrices.
    fold : callable
        ``fold(step, start, numbers)`` applies ``value = step(value, number)`` for one number after another.
    along : callable
        ``along(function, x)`` returns a function of times and its derivative with respect to these.
    search : callable
        ``search(t, x)`` is the number of knots up to times x, both along the last axis.
    take_along : callable
        ``take_along(array, index, axis)``, as in NumPy.
    """

    name: str
    module: str
    general: bool
    xp: Module
    array: Callable[[object, str, Tensor], Tensor]
    promote: Callable[..., tuple[Tensor, ...]]
    constant: Callable[[Tensor, Tensor], Tensor]
    logarithm: Callable[[Tensor], Tensor]
    exponential: Callable[[Tensor], Tensor]
    arcs: Callable[[Tensor], Tensor] | None
    solve_lower: Callable[[Tensor, Tensor], Tensor]
    fold: Callable[[Callable[[Tensor, Tensor], Tensor], Tensor, list[float]], Tensor]
    along: Callable[[Callable[[Tensor], Tensor], Tensor], tuple[Tensor, Tensor]]
    search: Callable[[Tensor, Tensor], Tensor]
    take_along: Callable[[Tensor, Tensor, int], Tensor]

    def stumpff(self, n: int, sign: int, z: Tensor) -> Tensor:
        """Return Stumpff's function c_n(±z) = Σ (∓z)ᵏ / (2k + n)! for z ≥ 0 and a sign.

        c₀ is cos √z, or cosh √z for sign −1, and c₁ is sin √z / √z. Stiefel & Scheifele, *Linear and Regular Celestial
        Mechanics* (1971), §11.
        """
        xp, near = self.xp, z < _STUMPFF
        weights = [(-sign) ** k / factorial(2 * k + n) for k in range(_STUMPFF_TERMS)]
        series = self._horner(weights, xp.where(near, z, 0.0))
        far = xp.where(near, _STUMPFF, z)
        root = xp.sqrt(far)
        cosine, sine = (xp.cos, xp.sin) if sign > 0 else (xp.cosh, xp.sinh)
        closed = cosine(root) if n % 2 == 0 else sine(root) / root
        for k in range(n % 2, n, 2):
            closed = (1 / factorial(k) - closed) / (sign * far)
        return xp.where(near, series, closed)

    def arc(self, y: Tensor, rest: Tensor, sign: int = 1) -> Tensor:
        """Return φ / (sin φ cos φ) of y = sin² φ and rest = cos² φ; for sign −1 φ / (sinh φ cosh φ) of y = sinh² φ."""
        xp, near = self.xp, y < _ARC
        # Σ 4ᵏ k!² / (2k + 1)! yᵏ (Abramowitz & Stegun 15.1.6).
        weights = [4.0**k * sign**k * factorial(k) ** 2 / factorial(2 * k + 1) for k in range(_ARC_TERMS)]
        series = self._horner(weights, xp.where(near, y, 0.0))
        far, rest = xp.where(near, 0.5, y), xp.where(near, 1 - 0.5 * sign, rest)
        root, other = xp.sqrt(far), xp.sqrt(rest)
        angle = xp.arctan2(root, other) if sign > 0 else xp.arcsinh(root)
        return xp.where(near, series, angle / (root * other))

    def _horner(self, weights: list[float], z: Tensor) -> Tensor:
        total = self.xp.full_like(z, weights[-1])
        for weight in weights[-2::-1]:
            total = total * z + weight
        return total


def adjoint(a: Tensor) -> Tensor:
    """Return the conjugate transpose of matrices."""
    return a.swapaxes(-1, -2).conj()


def hermitian(a: Tensor) -> Tensor:
    """Return the Hermitian part of matrices."""
    return 0.5 * (a + adjoint(a))


# ---- derivatives of functions of Hermitian matrices by divided differences, of any order ----

# The derivative of a function of a matrix is made of divided differences of the function between eigenvalues (Daleckii
# & Krein 1965; Higham, *Functions of Matrices*, §3.2), which are smooth where eigenvalues coincide. So are those of
# higher order, and eigenvectors are never differentiated.

# Divided differences between some numbers, arrays that broadcast; of one number the function.
Divided = Callable[..., Tensor]


def matrix_derivative(xp: Module, divided: Divided, values: Tensor, vectors: Tensor, directions: Tensor) -> Tensor:
    """Return the derivative of order k in k directions at a matrix with these eigenvalues and eigenvectors.

    With directions H, in the basis of eigenvectors it is Σ f[λ_i, λ_j, …, λ_l] H_ij … H_ml, over all orders of the
    directions and all indices between i and l.
    """
    k, n = len(directions), values.shape[-1]
    # λ along an axis of its own for each of the k + 1 indices.
    along = [values.reshape(*values.shape[:-1], *(n if i == j else 1 for j in range(k + 1))) for i in range(k + 1)]
    weights = divided(*along)
    if not directions:
        return (vectors * weights[..., None, :]) @ adjoint(vectors)
    turned = [adjoint(vectors) @ h @ vectors for h in directions]
    letters = "abcdefghijklmnopqrstuvwxyz"[: k + 1]
    pairs = ",".join(f"...{letters[i : i + 2]}" for i in range(k))
    rule = f"...{letters},{pairs}->...{letters[0]}{letters[-1]}"
    total = sum(xp.einsum(rule, weights, *order) for order in permutations(turned))
    return vectors @ total @ adjoint(vectors)


def divided_logarithm(xp: Module, constant: Tensor, *x: Tensor) -> Tensor:
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
    mean = xp.exp(sum(xp.log(argument) for argument in x) / len(x))
    s = mean[..., None] * constant(np.exp(step * np.arange(-90, 91)), mean)
    total = s
    for argument in x:
        total = total / (argument[..., None] + s)
    return (-1.0) ** len(x) * step * total.sum(axis=-1)


def divided_arc(xp: Module, constant: Tensor, function: AnyFunction, *y: Tensor) -> Tensor:
    """Return divided differences of `Library.arc`."""
    if len(y) == 1:
        return function(y[0], 1 - y[0])
    # ∫ du / (1 − y(1 − u²)) over u from 0 to 1.
    nodes, weights = np.polynomial.legendre.leggauss(80)
    square = constant(1 - nodes[40:] ** 2, y[0])
    total = constant(weights[40:], y[0]) * square ** (len(y) - 1)
    for argument in y:
        total = total / (1 - argument[..., None] * square)
    return total.sum(axis=-1)

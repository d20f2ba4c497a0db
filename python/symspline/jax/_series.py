"""Functions of a squared angle, in JAX, with derivatives of any order where the angle is zero.

Each belongs to a family that has its own derivatives, so that JAX differentiates neither series nor roots: near zero
every member is a power series, elsewhere it follows from closed forms by a recurrence.
"""

from __future__ import annotations

from functools import partial
from math import factorial, prod
from typing import Any

import jax
import jax.numpy as jnp

# Series are used up to here, where recurrences begin to be good.
_STUMPFF = 4.0
_ARC = 0.3


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def stumpff(n: int, sign: int, z: Any) -> Any:
    """Stumpff's function c_n(±z) = Σ (∓z)ᵏ / (2k + n)! for z ≥ 0 and a sign: c₀ is cos √z, or cosh √z for sign −1, and
    c₁ sin √z / √z. Only what the sign asks for is compiled.

    Stiefel & Scheifele, *Linear and Regular Celestial Mechanics* (1971), §11.
    """
    near = z < _STUMPFF
    series = _horner([(-sign) ** k / factorial(2 * k + n) for k in range(15)], jnp.where(near, z, 0.0))
    far = jnp.where(near, _STUMPFF, z)
    root = jnp.sqrt(far)
    cosine, sine = (jnp.cos, jnp.sin) if sign > 0 else (jnp.cosh, jnp.sinh)
    closed = cosine(root) if n % 2 == 0 else sine(root) / root
    for k in range(n % 2, n, 2):
        closed = (1 / factorial(k) - closed) / (sign * far)
    return jnp.where(near, series, closed)


@stumpff.defjvp
def _stumpff_jvp(n: int, sign: int, primals: Any, tangents: Any) -> Any:
    (z,), (dz,) = primals, tangents
    slope = 0.5 * sign * (n * stumpff(n + 2, sign, z) - stumpff(n + 1, sign, z))
    return stumpff(n, sign, z), slope * dz


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _arc(n: int, sign: int, y: Any, rest: Any) -> Any:
    """The n-th derivative of `arc`."""
    near = y < _ARC
    # Σ 4ᵏ k!² / (2k + 1)! yᵏ (Abramowitz & Stegun 15.1.6), n times differentiated.
    weights = [
        4.0**k * sign**k * factorial(k) ** 2 / factorial(2 * k + 1) * prod(range(k - n + 1, k + 1))
        for k in range(n, n + 36)
    ]
    series = _horner(weights, jnp.where(near, y, 0.0))
    far, rest = jnp.where(near, 0.5, y), jnp.where(near, 1 - 0.5 * sign, rest)
    root, other = jnp.sqrt(far), jnp.sqrt(rest)
    angle = jnp.arctan2(root, other) if sign > 0 else jnp.arcsinh(root)
    before = found = angle / (root * other)
    # 2y(1 − y) f' = 1 − (1 − 2y) f, and what follows from it; for sign −1 with −y.
    middle, twice = sign - 2 * far, 2 * far * rest
    if n:
        before, found = found, (1 - (1 - 2 * sign * far) * found) / twice
    for k in range(1, n):
        before, found = found, sign * (2 * k * k * before - (2 * k + 1) * middle * found) / twice
    return jnp.where(near, series, found)


@_arc.defjvp
def _arc_jvp(n: int, sign: int, primals: Any, tangents: Any) -> Any:
    (y, rest), (dy, _) = primals, tangents
    return _arc(n, sign, y, rest), _arc(n + 1, sign, y, rest) * dy


def arc(y: Any, rest: Any, sign: int = 1) -> Any:
    """φ / (sin φ cos φ) of y = sin² φ and rest = cos² φ; for sign −1 φ / (sinh φ cosh φ) of y = sinh² φ."""
    return _arc(0, sign, y, rest)


def _horner(weights: list[float], z: Any) -> Any:
    total = jnp.full_like(z, weights[-1])
    for weight in weights[-2::-1]:
        total = total * z + weight
    return total

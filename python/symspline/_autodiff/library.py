"""What the formulas need of a library of arrays with derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import factorial
from typing import Any

# Series are used up to here, and closed forms from here on. Both are smooth there, so that a library differentiates
# them as they are; the series have enough terms for derivatives of third order.
_STUMPFF, _STUMPFF_TERMS = 4.0, 22
_ARC, _ARC_TERMS = 0.3, 46


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
    xp: Any
    array: Callable[[Any, str, Any], Any]
    promote: Callable[..., tuple[Any, ...]]
    constant: Callable[[Any, Any], Any]
    logarithm: Callable[[Any], Any]
    exponential: Callable[[Any], Any]
    arcs: Callable[[Any], Any] | None
    solve_lower: Callable[[Any, Any], Any]
    fold: Callable[[Callable[[Any, Any], Any], Any, list[float]], Any]
    along: Callable[[Callable[[Any], Any], Any], tuple[Any, Any]]
    search: Callable[[Any, Any], Any]
    take_along: Callable[[Any, Any, int], Any]

    def stumpff(self, n: int, sign: int, z: Any) -> Any:
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

    def arc(self, y: Any, rest: Any, sign: int = 1) -> Any:
        """Return φ / (sin φ cos φ) of y = sin² φ and rest = cos² φ; for sign −1 φ / (sinh φ cosh φ) of y = sinh² φ."""
        xp, near = self.xp, y < _ARC
        # Σ 4ᵏ k!² / (2k + 1)! yᵏ (Abramowitz & Stegun 15.1.6).
        weights = [4.0**k * sign**k * factorial(k) ** 2 / factorial(2 * k + 1) for k in range(_ARC_TERMS)]
        series = self._horner(weights, xp.where(near, y, 0.0))
        far, rest = xp.where(near, 0.5, y), xp.where(near, 1 - 0.5 * sign, rest)
        root, other = xp.sqrt(far), xp.sqrt(rest)
        angle = xp.arctan2(root, other) if sign > 0 else xp.arcsinh(root)
        return xp.where(near, series, angle / (root * other))

    def _horner(self, weights: list[float], z: Any) -> Any:
        total = self.xp.full_like(z, weights[-1])
        for weight in weights[-2::-1]:
            total = total * z + weight
        return total


def adjoint(a: Any) -> Any:
    """Return the conjugate transpose of matrices."""
    return a.swapaxes(-1, -2).conj()


def hermitian(a: Any) -> Any:
    """Return the Hermitian part of matrices."""
    return 0.5 * (a + adjoint(a))

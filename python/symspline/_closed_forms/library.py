"""What the formulas need of a library of arrays with derivatives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Library(NamedTuple):
    """Functions of a library of arrays.

    Attributes
    ----------
    xp : module
        ``jax.numpy`` or ``torch``. The formulas use names and keywords that both have.
    constant : callable
        ``constant(array, like)`` converts an array of NumPy to the library, in the precision and on the device of
        `like`.
    stumpff, arc : callable
        ``stumpff(n, sign, z)`` and ``arc(y, rest, sign)``, see `symspline.jax._series`.
    logarithm, exponential : callable
        The logarithm of positive definite matrices, and the exponential of any.
    arcs : callable or None
        `arc` of Hermitian matrices.
    solve_lower : callable
        ``solve_lower(root, x)`` is root⁻¹ x for lower triangular matrices.
    fold : callable
        ``fold(step, start, numbers)`` applies ``value = step(value, number)`` for one number after another.
    """

    xp: Any
    constant: Callable[[Any, Any], Any]
    stumpff: Callable[[int, int, Any], Any]
    arc: Callable[..., Any]
    logarithm: Callable[[Any], Any]
    exponential: Callable[[Any], Any]
    arcs: Callable[[Any], Any] | None
    solve_lower: Callable[[Any, Any], Any]
    fold: Callable[[Callable[[Any, Any], Any], Any, list[float]], Any]


def adjoint(a: Any) -> Any:
    """Return the conjugate transpose of matrices."""
    return a.swapaxes(-1, -2).conj()


def hermitian(a: Any) -> Any:
    """Return the Hermitian part of matrices."""
    return 0.5 * (a + adjoint(a))

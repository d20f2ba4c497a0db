"""Validation of arrays of numbers, vectors and matrices, and of words."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import ValidationError
from .arrays import adjoint, as_array, cast, refuse, short_repr
from .rounding import point_tol

Array = NDArray[Any]
REMOVE = "remove missing values"


@contextmanager
def unmoved_by_underflow() -> Iterator[None]:
    """Let numbers too small for double precision become zero, whatever NumPy's error settings."""
    with np.errstate(under="ignore"):
        yield


def one_of(value: Any, name: str, *choices: str) -> str:
    """Return a word, or raise ValidationError if it is not one of the choices."""
    if not isinstance(value, str) or value not in choices:
        listed = ", ".join(map(repr, choices[:-1]))
        raise ValidationError(f"{name} must be {listed} or {choices[-1]!r}, not {short_repr(value)}")
    return value


def numbers(value: ArrayLike, name: str, axes: int) -> tuple[Array, float]:
    """Return a real or complex array in double precision, and the tolerance for its points.

    Examples
    --------
    >>> numbers([1, 2], "x", 1)
    (array([1., 2.]), 1e-08)
    """
    array, tol = _cast_numbers(value, name, axes)
    check_finite(array, name)
    return array.copy(), tol


def _cast_numbers(value: ArrayLike, name: str, axes: int) -> tuple[Array, float]:
    array = as_array(value, name)
    if array.dtype.kind not in "biufc":
        raise ValidationError(f"{name} must be an array of numbers, not of {array.dtype}")
    if array.ndim < axes:
        raise ValidationError(f"{name} has shape {array.shape}, but needs at least {axes} axes")
    return cast(array, np.complex128 if array.dtype.kind == "c" else np.float64), point_tol(array)


def check_finite(array: Array, name: str, remedy: str = REMOVE) -> None:
    """Raise ValidationError for numbers that are not finite."""
    refuse(~np.isfinite(array), name, lambda i: f"is {array[i]}, but must be finite; {remedy}")


def real_numbers(value: ArrayLike, name: str, shape: tuple[int | None, ...]) -> tuple[Array, float]:
    """Return the same for real numbers with the given last axes; None allows any length except 0."""
    array, tol = numbers(value, name, len(shape))
    _check_real(array, name, shape)
    return array, tol


def unchecked_numbers(value: ArrayLike, name: str, shape: tuple[int | None, ...]) -> tuple[Array, float]:
    """Return the same for real numbers that may be infinite or NaN; the array may be `value` itself."""
    array, tol = _cast_numbers(value, name, len(shape))
    _check_real(array, name, shape)
    return array, tol


def _check_real(array: Array, name: str, shape: tuple[int | None, ...]) -> None:
    last = array.shape[array.ndim - len(shape) :]
    fits = all(n == m or (m is None and n > 0) for n, m in zip(last, shape, strict=True))
    if array.dtype.kind == "c" or not fits:
        wanted = ", ".join("n" if m is None else str(m) for m in shape)
        kind = "complex" if array.dtype.kind == "c" else "real"
        raise ValidationError(f"{name} must be real, of shape (..., {wanted}), not {kind} of shape {array.shape}")


def square_matrices(value: ArrayLike, name: str) -> tuple[Array, float]:
    """Return the same for square matrices, real or complex."""
    array, tol = numbers(value, name, 2)
    if array.shape[-1] != array.shape[-2] or array.shape[-1] == 0:
        raise ValidationError(f"{name} must be square matrices, of shape (..., n, n), not {array.shape}")
    return array, tol


def unit_vectors(x: Array, tol: float, name: str, what: str, advice: str = "divide it by its length") -> Array:
    """Normalise unit vectors.

    Raises
    ------
    ValidationError
        If the length of a vector is not 1.
    """
    lengths = length(np.abs(x))
    refuse(~(np.abs(lengths - 1) <= tol), name, lambda i: f"is not {what}: its length is {lengths[i]}, not 1; {advice}")
    return x / lengths[..., None]


def length(x: Array) -> Array:
    """Return |x| of real vectors without intermediate overflow, shape of the leading axes."""
    with np.errstate(over="ignore"):
        result: Array = np.hypot.reduce(x, axis=-1)
    return result


def off_one(x: Array) -> Array:
    """Return the deviation of columns from orthonormal: the largest entry of |X*X − 1| of every matrix."""
    # Of input that is far off.
    with np.errstate(over="ignore", invalid="ignore"):
        return largest(adjoint(x) @ x - np.eye(x.shape[-1]))


def largest(x: Array) -> Array:
    """Return the largest entry of every matrix by magnitude."""
    result: Array = np.abs(x).max(axis=(-2, -1))
    return result


def hermitian_part(x: Array) -> Array:
    """Return (X + X*) / 2."""
    return np.asarray((x + adjoint(x)) / 2)


def check_symmetric(x: Array, allowed: Any, name: str, kind: str = "symmetric", advice: str = "") -> None:
    """Raise ValidationError for matrices whose entries differ by more than is allowed from those across the diagonal.

    For the kind "Hermitian", the entries across the diagonal must be complex conjugates.
    """
    # Input that is far off may overflow.
    with np.errstate(over="ignore", invalid="ignore"):
        off = largest(x - (adjoint(x) if kind == "Hermitian" else np.swapaxes(x, -1, -2)))
    refuse(~(off <= allowed), name, lambda i: f"is not {kind}: entries differ by {off[i]:.3e}{advice}")


def check_orthonormal(x: Array, tol: float, name: str, advice: str) -> None:
    """Raise ValidationError for matrices whose columns are not orthonormal."""
    off = off_one(x)
    refuse(~(off <= tol), name, lambda i: f"does not have orthonormal columns: |X*X - 1| is {off[i]:.3e}; {advice}")

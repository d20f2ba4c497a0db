"""Functions of a squared angle and of symmetric matrices, with derivatives also where they are singular formulas."""

from __future__ import annotations

from functools import partial
from math import factorial
from typing import Any

import torch

from .._closed_forms import divided
from .._closed_forms.library import Library, hermitian

# Series are used up to here. Both sides are smooth there, so that PyTorch differentiates them as they are.
_STUMPFF = 1.0
_ARC = 0.15


def stumpff(n: int, sign: int, z: Any) -> Any:
    """Return Stumpff's function c_n(±z) = Σ (∓z)ᵏ / (2k + n)! for z ≥ 0 and a sign: c₀ is cos √z, or cosh √z.

    Stiefel & Scheifele, *Linear and Regular Celestial Mechanics* (1971), §11.
    """
    near = z < _STUMPFF
    series = _horner([(-sign) ** k / factorial(2 * k + n) for k in range(12)], torch.where(near, z, 0.0))
    far = torch.where(near, _STUMPFF, z)
    root = torch.sqrt(far)
    cosine, sine = (torch.cos, torch.sin) if sign > 0 else (torch.cosh, torch.sinh)
    closed = cosine(root) if n % 2 == 0 else sine(root) / root
    for k in range(n % 2, n, 2):
        closed = (1 / factorial(k) - closed) / (sign * far)
    return torch.where(near, series, closed)


def arc(y: Any, rest: Any, sign: int) -> Any:
    """Return φ / (sin φ cos φ) of y = sin² φ and rest = cos² φ; for sign −1 φ / (sinh φ cosh φ) of y = sinh² φ."""
    near = y < _ARC
    # Σ 4ᵏ k!² / (2k + 1)! yᵏ (Abramowitz & Stegun 15.1.6).
    weights = [4.0**k * sign**k * factorial(k) ** 2 / factorial(2 * k + 1) for k in range(24)]
    series = _horner(weights, torch.where(near, y, 0.0))
    far, rest = torch.where(near, 0.5, y), torch.where(near, 1 - 0.5 * sign, rest)
    root, other = torch.sqrt(far), torch.sqrt(rest)
    angle = torch.arctan2(root, other) if sign > 0 else torch.arcsinh(root)
    return torch.where(near, series, angle / (root * other))


def _horner(weights: list[float], z: Any) -> Any:
    total = torch.full_like(z, weights[-1])
    for weight in weights[-2::-1]:
        total = total * z + weight
    return total


def constant(array: Any, like: Any) -> Any:
    """Return an array of NumPy as a tensor, in the precision and on the device of another one."""
    return torch.as_tensor(array, dtype=like.dtype, device=like.device)


_divided_logarithm = partial(divided.logarithm, torch, constant)


class _Logarithm(torch.autograd.Function):
    """The derivative of order k of log A, a symmetric matrix, in k symmetric directions.

    It is symmetric in all directions, and in the direction that a cotangent adds, because log is the gradient of
    tr(A log A − A). So its derivatives in reverse and in forward mode are derivatives of order k + 1.
    """

    generate_vmap_rule = True

    @staticmethod
    def forward(a: Any, *directions: Any) -> Any:
        values, vectors = torch.linalg.eigh(a)
        return divided.derivative(torch, _divided_logarithm, values, vectors, directions)

    @staticmethod
    def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
        ctx.save_for_backward(*inputs)
        ctx.save_for_forward(*inputs)

    @staticmethod
    def backward(ctx: Any, *cotangents: Any) -> Any:
        a, *directions = ctx.saved_tensors
        along = hermitian(cotangents[0])
        found: list[Any] = [_Logarithm.apply(a, *directions, along) if ctx.needs_input_grad[0] else None]
        for i in range(len(directions)):
            others = (*directions[:i], along, *directions[i + 1 :])
            found.append(_Logarithm.apply(a, *others) if ctx.needs_input_grad[i + 1] else None)
        return tuple(found)

    @staticmethod
    def jvp(ctx: Any, *changes: Any) -> Any:
        a, *directions = ctx.saved_tensors
        moved = None
        for i, change in enumerate(changes):
            if change is not None:
                own = (*directions, change) if i == 0 else (*directions[: i - 1], change, *directions[i:])
                part = _Logarithm.apply(a, *own)
                moved = part if moved is None else moved + part
        return moved


def logarithm(a: Any) -> Any:
    """Return log of positive definite matrices, shape (..., n, n)."""
    return _Logarithm.apply(hermitian(a))


def _solve_lower(root: Any, x: Any) -> Any:
    return torch.linalg.solve_triangular(root, x, upper=False)


def _fold(step: Any, value: Any, numbers: Any) -> Any:
    for number in numbers:
        value = step(value, number)
    return value


LIBRARY = Library(torch, constant, stumpff, arc, logarithm, torch.linalg.matrix_exp, None, _solve_lower, _fold)


def along(function: Any, x: Any) -> tuple[Any, Any]:
    """Return values of a function of times, and their derivatives with respect to these.

    The derivative in forward mode is that of the derivative in reverse mode with respect to the cotangent, which
    PyTorch computes faster than by dual numbers.
    """
    values, backward = torch.func.vjp(function, x)
    zero = torch.zeros_like(values) if isinstance(values, torch.Tensor) else tuple(map(torch.zeros_like, values))
    return values, torch.func.vjp(lambda cotangent: backward(cotangent)[0], zero)[1](torch.ones_like(x))[0]

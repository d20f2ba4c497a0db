"""What the formulas of `symspline._autodiff` need of PyTorch."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import torch

from .._autodiff import divided
from .._autodiff.library import Library, hermitian
from .._base.arrays import short_repr
from .._core import ValidationError
from .._spaces import Space


def tensor(value: Any, name: str, like: torch.Tensor | None = None) -> torch.Tensor:
    """Convert an argument to a tensor of real floating-point numbers.

    Parameters
    ----------
    like : tensor, optional
        Tensor whose precision and device the result has. By default, those of `value`; integers have the default
        precision of PyTorch.

    Raises
    ------
    ValidationError
        If `value` does not consist of real numbers.
    """
    if isinstance(value, np.ndarray):
        # PyTorch warns of arrays that are read-only, such as those of a spline, and refuses other byte orders.
        value = np.array(value, value.dtype.newbyteorder("="))
    try:
        found = torch.as_tensor(value)
    except (TypeError, ValueError, RuntimeError, OverflowError):
        raise ValidationError(f"{name} must be a tensor of real numbers, not {short_repr(value)}") from None
    if found.is_complex() or found.dtype == torch.bool:
        raise ValidationError(f"{name} must be a tensor of real numbers, not of {found.dtype}")
    if like is not None:
        return found.to(like)
    return found if found.is_floating_point() else found.to(torch.get_default_dtype())


def promoted(space: Space[Any], points: Any, *others: Any) -> tuple[torch.Tensor, ...]:
    """Convert points, and arrays of their shape, to tensors in the precision of the points."""
    first = tensor(points, "points")
    return first, *(tensor(other, "velocities", first) for other in others)


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


def along(function: Any, x: Any) -> tuple[Any, Any]:
    """Return values of a function of times, and their derivatives with respect to these.

    The derivative in forward mode is that of the derivative in reverse mode with respect to the cotangent, which
    PyTorch computes faster than by dual numbers.
    """
    values, backward = torch.func.vjp(function, x)
    zero = torch.zeros_like(values) if isinstance(values, torch.Tensor) else tuple(map(torch.zeros_like, values))
    return values, torch.func.vjp(lambda cotangent: backward(cotangent)[0], zero)[1](torch.ones_like(x))[0]


def search(t: Any, x: Any) -> Any:
    """Return the number of knots up to times, both along the last axis."""
    return torch.searchsorted(t.detach().contiguous(), x.detach().contiguous(), right=True)


LIBRARY = Library(
    name="PyTorch",
    module="torch",
    general=False,
    xp=torch,
    array=tensor,
    promote=promoted,
    constant=constant,
    logarithm=logarithm,
    exponential=torch.linalg.matrix_exp,
    arcs=None,
    solve_lower=_solve_lower,
    fold=_fold,
    along=along,
    search=search,
    take_along=torch.take_along_dim,
)

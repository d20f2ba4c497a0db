"""Fits and curves written in PyTorch: Newton's method, and derivatives by further steps from the solution.

`LIBRARY` has what the formulas of `symspline._autodiff` need of PyTorch.
"""

from __future__ import annotations

from functools import partial
from typing import Any, overload

import numpy as np
import torch
from numpy.typing import ArrayLike

from .._autodiff import curves
from .._autodiff.condition import Problem, cyclic_reduction
from .._autodiff.library import Library, Tensor, divided_logarithm, hermitian, matrix_derivative
from .._base.arrays import short_repr
from .._base.typing import AnyFunction, CubicBCType, PointsLike
from .._core import ConvergenceError, ValidationError
from .._curves.ends import ends_in_factors
from .._spaces import AnySpace, Product, Space, parts_of

# What PyTorch passes to the methods of a function; attributes are added to it.
Context = Any


def tensor(value: Tensor, name: str, like: torch.Tensor | None = None) -> torch.Tensor:
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
        converted = torch.as_tensor(value)
    except (TypeError, ValueError, RuntimeError, OverflowError):
        raise ValidationError(f"{name} must be a tensor of real numbers, not {short_repr(value)}") from None
    if converted.is_complex() or converted.dtype == torch.bool:
        raise ValidationError(f"{name} must be a tensor of real numbers, not of {converted.dtype}")
    if like is not None:
        return converted.to(like)
    return converted if converted.is_floating_point() else converted.to(torch.get_default_dtype())


def promoted(space: AnySpace, points: Tensor, *others: Tensor) -> tuple[torch.Tensor, ...]:
    """Convert points, and arrays of their shape, to tensors in the precision of the points."""
    first = tensor(points, "points")
    return first, *(tensor(other, "velocities", first) for other in others)


def constant(array: Tensor, like: Tensor) -> Tensor:
    """Return an array of NumPy as a tensor, in the precision and on the device of another one."""
    return torch.as_tensor(array, dtype=like.dtype, device=like.device)


_divided_logarithm = partial(divided_logarithm, torch, constant)


class _Logarithm(torch.autograd.Function):
    """The derivative of order k of log A, a symmetric matrix, in k symmetric directions.

    It is symmetric in all directions, and in the direction that a cotangent adds, because log is the gradient of
    tr(A log A − A). So its derivatives in reverse and in forward mode are derivatives of order k + 1.
    """

    generate_vmap_rule = True

    @staticmethod
    def forward(a: Tensor, *directions: Tensor) -> Tensor:
        values, vectors = torch.linalg.eigh(a)
        return matrix_derivative(torch, _divided_logarithm, values, vectors, directions)

    @staticmethod
    def setup_context(ctx: Context, inputs: Tensor, output: Tensor) -> None:
        ctx.save_for_backward(*inputs)
        ctx.save_for_forward(*inputs)

    @staticmethod
    def backward(ctx: Context, *cotangents: Tensor) -> Tensor:
        a, *directions = ctx.saved_tensors
        along = hermitian(cotangents[0])
        gradients: list[Tensor] = [_Logarithm.apply(a, *directions, along) if ctx.needs_input_grad[0] else None]
        for i in range(len(directions)):
            others = (*directions[:i], along, *directions[i + 1 :])
            gradients.append(_Logarithm.apply(a, *others) if ctx.needs_input_grad[i + 1] else None)
        return tuple(gradients)

    @staticmethod
    def jvp(ctx: Context, *changes: Tensor) -> Tensor:
        a, *directions = ctx.saved_tensors
        moved = None
        for i, change in enumerate(changes):
            if change is not None:
                changed = (*directions, change) if i == 0 else (*directions[: i - 1], change, *directions[i:])
                part = _Logarithm.apply(a, *changed)
                moved = part if moved is None else moved + part
        return moved


def logarithm(a: Tensor) -> Tensor:
    """Return log of positive definite matrices, shape (..., n, n)."""
    return _Logarithm.apply(hermitian(a))


def _solve_lower(root: Tensor, x: Tensor) -> Tensor:
    return torch.linalg.solve_triangular(root, x, upper=False)


def _fold(step: AnyFunction, value: Tensor, numbers: Tensor) -> Tensor:
    for number in numbers:
        value = step(value, number)
    return value


def along(function: AnyFunction, x: Tensor) -> tuple[Tensor, Tensor]:
    """Return values of a function of times, and their derivatives with respect to these.

    The derivative in forward mode is that of the derivative in reverse mode with respect to the cotangent, which
    PyTorch computes faster than by dual numbers.
    """
    values, backward = torch.func.vjp(function, x)
    zero = torch.zeros_like(values) if isinstance(values, torch.Tensor) else tuple(map(torch.zeros_like, values))
    return values, torch.func.vjp(lambda cotangent: backward(cotangent)[0], zero)[1](torch.ones_like(x))[0]


def search(t: Tensor, x: Tensor) -> Tensor:
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


# ---- fits and curves ----

# Newton's method needs four to six steps where it converges.
_MOST_STEPS = 30
# Steps with the same Jacobian after the last one of Newton's method. Each makes derivatives of one more order exact.
_STEPS_TO_DIFFERENTIATE = 2


@overload
def evaluate(
    t: ArrayLike, points: PointsLike, velocities: PointsLike, space: Space | str, x: ArrayLike, *, nu: int = 0
) -> torch.Tensor: ...


@overload
def evaluate(
    t: ArrayLike, points: PointsLike, velocities: PointsLike, space: Product, x: ArrayLike, *, nu: int = 0
) -> tuple[torch.Tensor, ...]: ...


def evaluate(t: Tensor, points: Tensor, velocities: Tensor, space: AnySpace | str, x: Tensor, *, nu: int = 0) -> Tensor:
    """Evaluate curves with given knots, points and velocities, in PyTorch alone.

    This is `symspline.evaluate` written in PyTorch. It runs on the device and in the precision of the points, and is
    differentiable with respect to all tensors, any number of times.

    Parameters
    ----------
    t : tensor, shape (n,) or (..., n)
        Strictly increasing knots, shared by all curves or one row per curve.
    points : tensor, shape (..., n, *space.point_shape)
        Points; for a `Product` a tuple. Leading axes are batch axes.
    velocities : tensor, shape of points
        Velocities, such as those of `symspline.torch.fit`.
    space : Space or str
        Space or its name: ``r``, ``sphere``, ``hyperbolic``, ``spd``, ``so:2``, ``so:3``, ``se:2``, ``se:3`` or
        products of them.
    x : tensor
        Times, any shape. Values at times outside the knots are NaN.
    nu : {0, 1, 2}, default 0
        0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.

    Returns
    -------
    tensor, shape ``(*batch axes, *x.shape, *space.point_shape)``
        Values; for a `Product` a tuple.

    Raises
    ------
    ValidationError
        If the space is not supported, or shapes do not match.

    See Also
    --------
    fit : Compute the velocities of a C² spline.
    curve : Evaluate a spline on any space by the compiled core.

    Notes
    -----
    Between two knots the curve is the cubic Bézier curve of geodesics, (8) of the paper. Derivatives are finite also
    where points coincide, velocities are zero or eigenvalues repeat.

    Points are first projected onto the manifold and velocities onto the tangent spaces, so derivatives are tangent as
    well. Values are not validated, because this would wait for the device: for matrices far off the manifold and for
    knots that do not increase, results are NaN or meaningless.

    Examples
    --------
    >>> import torch
    >>> from symspline.torch import evaluate
    >>> p = torch.tensor([[1.0, 0, 0], [0, 1, 0]], requires_grad=True)
    >>> value = evaluate([0.0, 1.0], p, torch.zeros(2, 3), "sphere:2", 0.5)
    >>> value[0].backward()
    >>> p.grad.shape
    torch.Size([2, 3])
    """
    return curves.evaluate(LIBRARY, t, points, velocities, space, x, nu)


@overload
def fit(t: ArrayLike, points: PointsLike, space: Space | str, *, bc_type: CubicBCType = "natural") -> torch.Tensor: ...


@overload
def fit(
    t: ArrayLike, points: PointsLike, space: Product, *, bc_type: CubicBCType = "natural"
) -> tuple[torch.Tensor, ...]: ...


def fit(t: Tensor, points: Tensor, space: AnySpace | str, *, bc_type: CubicBCType = "natural") -> Tensor:
    """Compute the velocities of C² splines through points, in PyTorch alone.

    This is `symspline.fit` written in PyTorch. It runs on the device and in the precision of the points. First and
    second derivatives with respect to knots, points and end velocities are available in reverse and forward mode.

    Parameters
    ----------
    t : tensor, shape (n,) or (..., n)
        Strictly increasing knots, shared by all curves or one row per curve.
    points : tensor, shape (..., n, *space.point_shape)
        Points, which are first projected onto the manifold; for a `Product` a tuple. Leading axes are batch axes.
    space : Space or str
        Space or its name: ``r``, ``sphere``, ``spd``, ``so:2``, ``so:3``, ``se:2``, ``se:3`` or products of them.
    bc_type : {"natural", "clamped"} or pair, default "natural"
        End conditions. A pair has one of these words or ``(1, velocity)`` for either end.

    Returns
    -------
    tensor, shape of points
        Velocities at the knots; for a `Product` a tuple.

    Raises
    ------
    ValidationError
        If the space or the end conditions are not supported, or shapes do not match.
    ConvergenceError
        If Newton's method does not converge for a curve of the batch, which the attribute ``curve`` names. Use
        `symspline.fit`, which has other solvers for points that are far apart.

    See Also
    --------
    evaluate : Evaluate curves with given velocities.
    curve : Evaluate a spline on any space by the compiled core.

    Notes
    -----
    Newton's method solves the C² condition F(u, d) = 0 for the velocities u of data d. It starts from the velocities of
    parabolas through three points. Cyclic reduction solves its block tridiagonal systems. Two more steps with the
    Jacobian J of the solution,

    .. math:: u_{k+1} = u_k - J^{-1} F(u_k, d),

    are differentiated. The derivative of the right-hand side with respect to u is zero at the solution, so that each
    step makes derivatives of one more order exact: the first gives those of the implicit function theorem. Derivatives
    of third and higher order are not exact. The memory does not grow with the number of Newton's steps.

    Newton's method ends when the relative residual, which is the change of a velocity by one more sweep of (17) of the
    paper divided by the largest velocity, is below 4e-11 in double and 2e-5 in single precision; the two further steps
    reach rounding. For this decision one Boolean per step is read from the device. No array leaves it.

    Examples
    --------
    >>> import torch
    >>> from symspline.torch import fit
    >>> fit(torch.arange(3.0), torch.eye(3), "sphere:2").shape
    torch.Size([3, 3])
    """
    space = curves.named(LIBRARY, space)
    if isinstance(space, Product):
        factors = zip(parts_of(points, space, "points"), space.factors, ends_in_factors(bc_type, space), strict=True)
        return tuple(fit(t, p, factor, bc_type=bc) for p, factor, bc in factors)
    problem, leave = curves.problem_of(LIBRARY, t, points, space, bc_type)
    return leave(_velocities(problem))


def _residual(problem: Problem, u: Tensor) -> Tensor:
    """Return the residual, in which the normal part of u counts as such, so that the solution is tangent."""
    tangent = problem.chain.tangent(problem.p, u)
    middle = problem.weights()[1]
    normal = problem.residual(tangent)
    return normal + problem.chain.model.times(middle, u - tangent)


def _velocities(problem: Problem) -> Tensor:
    """Return velocities that are differentiable functions of the data."""
    arrays = ("h", "p", "first", "last")
    u, jacobian = _solution(problem._replace(**{name: getattr(problem, name).detach() for name in arrays}))
    for _ in range(_STEPS_TO_DIFFERENTIATE):
        u = u - _solved(jacobian, _residual(problem, u))
    return u


def _solution(problem: Problem) -> tuple[Tensor, Tensor]:
    """Return the velocities that solve a problem without derivatives, and the Jacobian there."""
    u, middle = _start(problem), problem.weights()[1]
    # In double precision 4e-11, from where a further step reaches rounding. Points that are equal up to rounding have
    # velocities of rounding.
    eps = torch.finfo(u.dtype).eps
    tol, floor = eps ** (2 / 3), 8 * eps * problem.chain.scale(problem.p) / torch.amin(problem.h, 0)
    for _ in range(_MOST_STEPS):
        residual = _residual(problem, u)
        good = torch.amax(problem.sizes(residual) / middle, 0) <= tol * torch.amax(problem.sizes(u), 0) + floor
        jacobian = _jacobian(problem, u)
        if good.all():
            return u, jacobian
        u = u - _solved(jacobian, residual)
    index = tuple(int(i) for i in (~good).nonzero()[0])
    where = f" of curve {index}" if index else ""
    error = ConvergenceError(
        f"Newton's method did not converge for the velocities{where}. Add points between those that are far apart, or "
        "use symspline.fit, which has other solvers"
    )
    error.curve = index
    raise error


def _start(problem: Problem) -> Tensor:
    """Return the velocities of parabolas through three points in flat space, or given ones (Bessel's method).

    From zero velocities, whose handles are at the points, the Jacobian is almost singular for points π/2 apart.
    """
    chain, h = problem.chain, problem.h
    still = torch.zeros_like(problem.first).expand(len(h), *problem.first.shape)
    ahead, back = chain.logs(problem.p, still, still)
    after, before = chain.model.times(1 / h, ahead), chain.model.times(-1 / h, back)
    share = h[1:] / (h[:-1] + h[1:])
    inner = chain.model.times(share, before[:-1]) + chain.model.times(1 - share, after[1:])
    first = problem.first if problem.given[0] else after[0]
    last = problem.last if problem.given[1] else before[-1]
    return torch.cat([first[None], inner, last[None]])


def _jacobian(problem: Problem, u: Tensor) -> Tensor:
    """Return the blocks below, on and above the diagonal, shape (n, 3, *batch, k, k).

    A residual depends on the velocities of its own node and of the next ones on either side. So the residuals of every
    third node are differentiated at once, one component after another along an axis behind that of the nodes.
    """
    n, core = len(u), problem.chain.model.axes
    shape, batch = u.shape[u.ndim - core :], u.shape[1 : u.ndim - core]
    size = shape.numel()
    node = torch.arange(n, device=u.device)
    rows = torch.nn.functional.one_hot(node % 3, 3).to(u).reshape(n, 3, *(1,) * u.ndim)
    components = torch.eye(size, dtype=u.dtype, device=u.device).reshape(size, *(1,) * len(batch), *shape)
    wide = u[:, None].expand(n, 3 * size, *u.shape[1:]).contiguous()
    expanded = problem._replace(h=problem.h[:, None], p=problem.p[:, None])
    expanded = expanded._replace(first=problem.first[None], last=problem.last[None])
    _, gradient = torch.func.vjp(lambda u: _residual(expanded, u), wide)
    (blocks,) = gradient((rows * components).flatten(1, 2).expand_as(wide))
    # By the node whose velocity moves, with a row of zeros before the first and after the last.
    blocks = blocks.reshape(n, 3, size, *batch, size).movedim(2, -2)
    zero = torch.zeros_like(blocks[:1])
    moving = node[:, None] + torch.arange(3, device=u.device)
    return torch.cat([zero, blocks, zero])[moving, (node % 3)[:, None]]


def _solved(jacobian: Tensor, rows: Tensor) -> Tensor:
    """Solve the block tridiagonal systems for the residuals of all nodes."""
    flat = rows.reshape(*jacobian.shape[:1], *jacobian.shape[2:-1], 1)
    below, diagonal, above = jacobian.unbind(1)
    return cyclic_reduction(torch, _solve_blocks, below, diagonal, above, flat).reshape(rows.shape)


def _solve_blocks(diagonal: Tensor, *columns: Tensor) -> Tensor:
    return torch.linalg.solve(diagonal, torch.cat(columns, dim=-1)).split([a.shape[-1] for a in columns], dim=-1)

"""Fits written in PyTorch: Newton's method, and derivatives by further steps from the solution."""

from __future__ import annotations

from typing import Any, NamedTuple, overload

import torch

from .._adapters import split
from .._base.arrays import short_repr
from .._closed_forms.condition import Chain, chain_of, residual, weights
from .._closed_forms.tridiagonal import cyclic_reduction
from .._core import ConvergenceError, ValidationError
from .._curves.ends import ends_in_factors
from .._spaces import Product, Space, parts_of, refuse_quotients, space_named
from ._arrays import model_of, points_and_knots, tensor
from ._functions import LIBRARY

# Newton's method needs four to six steps where it converges.
_MOST_STEPS = 30
# Steps with the same Jacobian after the last one of Newton's method. Each makes derivatives of one more order exact.
_STEPS_TO_DIFFERENTIATE = 2


@overload
def fit(t: Any, points: Any, space: Space | str, *, bc_type: Any = "natural") -> torch.Tensor: ...


@overload
def fit(t: Any, points: Any, space: Product, *, bc_type: Any = "natural") -> tuple[torch.Tensor, ...]: ...


def fit(t: Any, points: Any, space: Space[Any] | str, *, bc_type: Any = "natural") -> Any:
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
    space = space_named(space)
    refuse_quotients(space, "functions of PyTorch are not made")
    if isinstance(space, Product):
        each = zip(parts_of(points, space, "points"), space.factors, ends_in_factors(bc_type, space), strict=True)
        return tuple(fit(t, p, factor, bc_type=bc) for p, factor, bc in each)
    chain = chain_of(model_of(space, "fit"))
    if chain is None:
        raise ValidationError(
            f"symspline.torch.fit does not support {space}; use symspline.torch.curve, which supports every space"
        )
    points, knots = points_and_knots(t, points, space)
    given, (first, last) = _ends(bc_type, points, space)
    middle = torch.zeros_like(points[1:-1])
    p, rows = chain.enter(points, torch.cat([first[None], middle, last[None]]))
    problem = _Problem(chain, given, knots[1:] - knots[:-1], p, rows[0], rows[-1])
    return chain.leave(p, _velocities(problem)).movedim(0, points.ndim - len(space.point_shape) - 1)


def _ends(bc_type: Any, points: Any, space: Space) -> tuple[tuple[bool, bool], list[Any]]:
    """Return which ends have a given velocity, and its value or zero."""
    kinds, vectors = split(bc_type)
    pair = (kinds, kinds) if isinstance(kinds, str) else kinds
    if any(kind not in ("natural", "clamped", 1) for kind in pair):
        raise ValidationError(
            "bc_type must be 'natural', 'clamped', or a pair with one of these or (1, velocity) for either end; got "
            f"{short_repr(bc_type)}"
        )
    ends = []
    for vector, name in zip(vectors, ("start", "end"), strict=True):
        if vector is None:
            ends.append(torch.zeros_like(points[0]))
            continue
        own = tensor(vector, f"the {name} velocity", points)
        try:
            ends.append(own.expand(points.shape[1:]))
        except RuntimeError:
            raise ValidationError(
                f"the {name} velocity has shape {tuple(own.shape)}, which does not broadcast to "
                f"{tuple(points.shape[1:])}"
            ) from None
    return (pair[0] != "natural", pair[1] != "natural"), ends


class _Problem(NamedTuple):
    """The C² condition of curves: lengths of intervals, nodes, and velocities at the ends, which count if given.

    Nodes are along the first axis, and axes of the batch follow.
    """

    chain: Chain
    given: tuple[bool, bool]
    h: Any
    p: Any
    first: Any
    last: Any

    def detached(self) -> _Problem:
        return self._replace(**{name: getattr(self, name).detach() for name in ("h", "p", "first", "last")})

    def residual(self, u: Any) -> Any:
        """Return the residual, in which the normal part of u counts as such, so that the solution is tangent."""
        tangent = self.chain.tangent(self.p, u)
        middle = weights(LIBRARY, self.given, self.h)[1]
        found = residual(self.chain, self.given, self.h, self.p, tangent, self.first, self.last)
        return found + self.chain.model.times(middle, u - tangent)

    def expanded(self) -> _Problem:
        """Return the problem with an axis of length 1 behind that of the nodes."""
        return self._replace(h=self.h[:, None], p=self.p[:, None], first=self.first[None], last=self.last[None])


def _velocities(problem: _Problem) -> Any:
    """Return velocities that are differentiable functions of the data."""
    u, jacobian = _solution(problem.detached())
    for _ in range(_STEPS_TO_DIFFERENTIATE):
        u = u - _solved(jacobian, problem.residual(u))
    return u


def _solution(problem: _Problem) -> tuple[Any, Any]:
    """Return the velocities that solve a problem without derivatives, and the Jacobian there."""
    core = problem.chain.model.axes
    u = _start(problem)
    middle = weights(LIBRARY, problem.given, problem.h)[1]
    # In double precision 4e-11, from where a further step reaches rounding. Points that are equal up to rounding have
    # velocities of rounding.
    eps = torch.finfo(u.dtype).eps
    tol, floor = eps ** (2 / 3), 8 * eps * problem.chain.scale(problem.p) / torch.amin(problem.h, 0)
    for _ in range(_MOST_STEPS):
        found = problem.residual(u)
        change, size = (a.flatten(-core).norm(dim=-1) for a in (found, u))
        good = torch.amax(change / middle, 0) <= tol * torch.amax(size, 0) + floor
        jacobian = _jacobian(problem, u)
        if good.all():
            return u, jacobian
        u = u - _solved(jacobian, found)
    index = tuple(int(i) for i in (~good).nonzero()[0])
    where = f" of curve {index}" if index else ""
    error = ConvergenceError(
        f"Newton's method did not converge for the velocities{where}. Add points between those that are far apart, or "
        "use symspline.fit, which has other solvers"
    )
    error.curve = index
    raise error


def _start(problem: _Problem) -> Any:
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


def _jacobian(problem: _Problem, u: Any) -> Any:
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
    _, gradient = torch.func.vjp(problem.expanded().residual, wide)
    (found,) = gradient((rows * components).flatten(1, 2).expand_as(wide))
    # By the node whose velocity moves, with a row of zeros before the first and after the last.
    found = found.reshape(n, 3, size, *batch, size).movedim(2, -2)
    zero = torch.zeros_like(found[:1])
    moving = node[:, None] + torch.arange(3, device=u.device)
    return torch.cat([zero, found, zero])[moving, (node % 3)[:, None]]


def _solved(jacobian: Any, rows: Any) -> Any:
    """Solve the block tridiagonal systems for the residuals of all nodes."""
    flat = rows.reshape(*jacobian.shape[:1], *jacobian.shape[2:-1], 1)
    below, diagonal, above = jacobian.unbind(1)
    return cyclic_reduction(torch, _solve_blocks, below, diagonal, above, flat).reshape(rows.shape)


def _solve_blocks(diagonal: Any, *columns: Any) -> Any:
    return torch.linalg.solve(diagonal, torch.cat(columns, dim=-1)).split([a.shape[-1] for a in columns], dim=-1)

"""Splines as differentiable functions in PyTorch, on the CPU."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from .adapters import fitted, movable, split
from .curves.ends import ends_in_factors
from .manifolds.manifold import refuse_functions
from .spaces import Product, Space, parts_of
from .spaces import space as space_named


def curve(
    x: Any, t: Any, points: Any, space: Space | str, *, bc_type: Any = "natural", **options: Any
) -> Any:
    """The spline through points at times x: ``CubicSpline(t, points, space, ...)(x)``.

    It has derivatives of first order, backward and forward, with respect to x, t, points and the vectors in
    ``bc_type``. Numbers are computed in double precision, and come back in that of the points.

    Points and vectors are first moved to the nearest of the space, so that points which an optimiser moved are
    welcome. Where many arrays are one point (projective spaces, Grassmannians), differentiate what does not
    depend on the choice.

    With ``on_failure="ignore"`` or ``"warn"`` a curve that did not converge has values, of the best iterate, but its
    derivatives are NaN: they follow from the C² condition, which it does not fulfil.

    Args:
        x: times, any shape.
        t: knots, shape (N+1,), or (..., N+1).
        points: shape (..., N+1, *point_shape); for a `Product` a tuple.
        space: the space or its name.
        bc_type: as for `CubicSpline`; vectors may be tensors.
        options: further options of `CubicSpline`. With ``on_failure="ignore"`` derivatives of curves that have not
            converged are NaN.

    Returns:
        Shape batch axes + x.shape + point_shape; for a `Product` a tuple.
    """
    space = space_named(space)
    refuse_functions(space, "derivatives with respect to the data are not made")
    if isinstance(space, Product):
        pieces = zip(
            parts_of(points, space, "points"), space.factors, ends_in_factors(bc_type, space), strict=True
        )
        return tuple(curve(x, t, p, factor, bc_type=bc, **options) for p, factor, bc in pieces)
    kinds, vectors = split(bc_type)
    points = torch.as_tensor(points)
    x, t = torch.as_tensor(x), torch.as_tensor(t)
    ends = [None if v is None else torch.as_tensor(v) for v in vectors]
    return _Curve.apply(x, t, points, *ends, (space, kinds, options))


class _Curve(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, x: Any, t: Any, points: Any, start: Any, end: Any, fixed: Any) -> Any:
        space, kinds, options = fixed
        arrays = [None if a is None else a.detach().numpy() for a in (t, points, start, end)]
        # What is rounding beyond the last knot depends on the precision of the times.
        at = x.detach().numpy()
        ctx.x = at if at.dtype.kind == "f" else at.astype(float)
        spline = fitted(arrays[0], arrays[1], (arrays[2], arrays[3]), space, kinds, options)
        ctx.movable = movable(spline)
        ctx.like = [None if a is None else (a.dtype, a.shape) for a in (x, t, points, start, end)]
        return torch.as_tensor(spline(ctx.x)).to(points.dtype)

    @staticmethod
    def backward(ctx: Any, *cotangents: Any) -> Any:
        cotangent = cotangents[0].detach().resolve_conj().numpy()
        along, t, points, ends = ctx.movable.pull(ctx.x, cotangent)
        return *(_tensor(a, like) for a, like in zip((along, t, points, *ends), ctx.like, strict=True)), None

    @staticmethod
    def jvp(ctx: Any, *changes: Any) -> Any:
        dx, dt, points, *ends = (
            None if a is None else a.detach().resolve_conj().numpy() for a in changes[:5]
        )
        moved = ctx.movable.push(ctx.x, dx, points, dt, ends)
        return torch.as_tensor(moved).to(ctx.like[2][0])


def _tensor(array: Any, like: Any) -> Any:
    """A gradient in the type of its input."""
    if array is None or like is None:
        return None
    dtype, shape = like
    return torch.as_tensor(np.ascontiguousarray(array)).to(dtype).reshape(shape)

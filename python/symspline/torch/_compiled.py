"""The compiled spline as a differentiable function, on the CPU."""

from __future__ import annotations

from typing import Any, Unpack, overload

import numpy as np
import torch

from .._adapters import fitted, movable, split
from .._curves.ends import ends_in_factors
from .._spaces import Product, Space, parts_of, space_named
from .._typing import CurveOptions
from ..manifolds._manifold import refuse_functions


@overload
def curve(x: Any, t: Any, points: Any, space: Space | str, **options: Unpack[CurveOptions]) -> torch.Tensor: ...


@overload
def curve(x: Any, t: Any, points: Any, space: Product, **options: Unpack[CurveOptions]) -> tuple[torch.Tensor, ...]: ...


def curve(x: Any, t: Any, points: Any, space: Space[Any] | str, *, bc_type: Any = "natural", **options: Any) -> Any:
    """Evaluate a spline through points, with derivatives in PyTorch.

    The result equals ``CubicSpline(t, points, space, ...)(x)``. First derivatives with respect to x, t, points and the
    vectors in `bc_type` are available in reverse and forward mode. Computations use double precision; the result has
    the precision of the points.

    Parameters
    ----------
    x : tensor
        Times, any shape.
    t : tensor, shape (n,) or (..., n)
        Knots.
    points : tensor, shape (..., n, *space.point_shape)
        Points; for a `Product` a tuple. Points and end vectors are projected onto the manifold first, so an optimiser
        may move them off it.
    space : Space or str
        Space or its name.
    bc_type : str, tuple or pair, default "natural"
        End conditions, as for `CubicSpline`. Vectors may be tensors.
    **options
        Other options of `CubicSpline`.

    Returns
    -------
    tensor, shape ``(*batch axes, *x.shape, *space.point_shape)``
        Points of the curve; for a `Product` a tuple.

    Notes
    -----
    Where many arrays represent the same point (projective spaces, Grassmannians), differentiate only functions that do
    not depend on the representative.

    With ``on_failure="ignore"`` or ``"warn"``, a curve that did not converge has the values of the best iterate. Its
    derivatives are NaN, because they are derived from the C² condition, which the iterate does not satisfy.
    """
    space = space_named(space)
    refuse_functions(space, "derivatives with respect to the data are not available")
    if isinstance(space, Product):
        each = zip(parts_of(points, space, "points"), space.factors, ends_in_factors(bc_type, space), strict=True)
        return tuple(curve(x, t, p, factor, bc_type=bc, **options) for p, factor, bc in each)
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
        along, t, points, ends = ctx.movable.vjp(ctx.x, cotangent)
        return *(_tensor(a, like) for a, like in zip((along, t, points, *ends), ctx.like, strict=True)), None

    @staticmethod
    def jvp(ctx: Any, *changes: Any) -> Any:
        dx, dt, points, *ends = (None if a is None else a.detach().resolve_conj().numpy() for a in changes[:5])
        moved = ctx.movable.jvp(ctx.x, dx, points, dt, ends)
        return torch.as_tensor(moved).to(ctx.like[2][0])


def _tensor(array: Any, like: Any) -> Any:
    """Return a gradient in the type of its input."""
    if array is None or like is None:
        return None
    dtype, shape = like
    return torch.as_tensor(np.ascontiguousarray(array)).to(dtype).reshape(shape)

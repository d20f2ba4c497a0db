"""The compiled spline as a differentiable function."""

from __future__ import annotations

from typing import Unpack, overload

import numpy as np
import torch
from numpy.typing import ArrayLike

from .._autodiff.compiled import Kinds, fitted, movable, split
from .._autodiff.library import Tensor
from .._base.typing import Array, CubicBCType, CurveOptions, Keywords, PointsLike, SolverOptions
from .._curves.ends import ends_in_factors
from .._spaces import AnySpace, Product, Space, parts_of, space_named
from ..manifolds._manifold import refuse_functions
from ._native import Context


@overload
def curve(
    x: ArrayLike, t: ArrayLike, points: PointsLike, space: Space | str, **options: Unpack[CurveOptions]
) -> torch.Tensor: ...


@overload
def curve(
    x: ArrayLike, t: ArrayLike, points: PointsLike, space: Product, **options: Unpack[CurveOptions]
) -> tuple[torch.Tensor, ...]: ...


def curve(
    x: Tensor,
    t: Tensor,
    points: Tensor,
    space: AnySpace | str,
    *,
    bc_type: CubicBCType = "natural",
    **options: Unpack[SolverOptions],
) -> Tensor:
    """Evaluate a spline through points, with derivatives in PyTorch.

    The result equals ``CubicSpline(t, points, space, ...)(x)``. First derivatives with respect to x, t, points and the
    vectors in `bc_type` are available in reverse and forward mode. Computations use double precision, on the CPU; the
    result has the precision and the device of the points.

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
        factors = zip(parts_of(points, space, "points"), space.factors, ends_in_factors(bc_type, space), strict=True)
        return tuple(curve(x, t, p, factor, bc_type=bc, **options) for p, factor, bc in factors)
    kinds, vectors = split(bc_type)
    points = torch.as_tensor(points)
    x, t = torch.as_tensor(x), torch.as_tensor(t)
    ends = [None if v is None else torch.as_tensor(v) for v in vectors]
    return _Curve.apply(x, t, points, *ends, (space, kinds, options))


class _Curve(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Context,
        x: Tensor,
        t: Tensor,
        points: Tensor,
        start: Tensor,
        end: Tensor,
        fixed: tuple[Space, Kinds, Keywords],
    ) -> Tensor:
        space, kinds, options = fixed
        ends = tuple(None if a is None else _numpy(a) for a in (start, end))
        # What is rounding beyond the last knot depends on the precision of the times.
        at = _numpy(x)
        ctx.x = at if at.dtype.kind == "f" else at.astype(float)
        spline = fitted(_numpy(t), _numpy(points), (ends[0], ends[1]), space, kinds, options)
        ctx.movable = movable(spline)
        ctx.like = [None if a is None else (a.dtype, a.device, a.shape) for a in (x, t, points, start, end)]
        return torch.as_tensor(spline(ctx.x)).to(points)

    @staticmethod
    def backward(ctx: Context, *cotangents: Tensor) -> tuple[Tensor, ...]:
        cotangent = _numpy(cotangents[0])
        along, t, points, ends = ctx.movable.vjp(ctx.x, cotangent)
        return *(_tensor(a, like) for a, like in zip((along, t, points, *ends), ctx.like, strict=True)), None

    @staticmethod
    def jvp(ctx: Context, *changes: Tensor) -> Tensor:
        dx, dt, points, *ends = (None if a is None else _numpy(a) for a in changes[:5])
        moved = ctx.movable.jvp(ctx.x, dx, points, dt, ends)
        dtype, device, _ = ctx.like[2]
        return torch.as_tensor(moved).to(device, dtype)


def _numpy(value: Tensor) -> Array:
    """Return a tensor of any device as an array."""
    array: Array = value.detach().resolve_conj().cpu().numpy()
    return array


def _tensor(array: Array | None, like: Tensor) -> Tensor:
    """Return a gradient in the type and on the device of its input."""
    if array is None or like is None:
        return None
    dtype, device, shape = like
    # The gradient of a real input, such as a velocity of zeros on a complex space, is real.
    real = array if dtype.is_complex else np.real(array)
    return torch.as_tensor(np.ascontiguousarray(real)).to(device, dtype).reshape(shape)

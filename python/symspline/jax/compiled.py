"""The compiled spline as a differentiable function, on the CPU."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero

from ..adapters import split
from ..curves.curve import order_of
from ..curves.ends import ends_in_factors
from ..manifolds.manifold import refuse_functions
from ..spaces import Product, Space, parts_of
from ..spaces import space as space_named
from .embedding import bent
from .primitives import Fixed, fit_p, push_p

Array = jax.Array


def curve(
    x: Any,
    t: Any,
    points: Any,
    space: Space | str,
    *,
    nu: int = 0,
    bc_type: Any = "natural",
    **options: Any,
) -> Any:
    """The spline through points at times x: ``CubicSpline(t, points, space, ...)(x, nu)``, by the compiled core.

    It has derivatives of first order, forward and backward, with respect to x, t, points and the vectors in
    ``bc_type``; `jax.jit` works, and `jax.vmap`, also of derivatives and however often, is one call of the core.
    Numbers are computed in double precision, and come back in that of the points: most uses want
    ``jax.config.update("jax_enable_x64", True)``.

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
        nu: 0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.
        bc_type: as for `CubicSpline`; vectors may be arrays of JAX.
        options: further options of `CubicSpline`.

    Returns:
        Shape batch axes + x.shape + point_shape; for a `Product` a tuple. JAX differentiates these arrays: the
        derivative of a velocity in a direction has the part normal to the space, too.

    Raises:
        NotImplementedError: ∇γ' is to be differentiated in x, or something a second time.
    """
    nu = order_of(nu)
    space = space_named(space)
    refuse_functions(space, "derivatives with respect to the data are not made")
    if isinstance(space, Product):
        pieces = zip(
            parts_of(points, space, "points"), space.factors, ends_in_factors(bc_type, space), strict=True
        )
        return tuple(curve(x, t, p, factor, nu=nu, bc_type=bc, **options) for p, factor, bc in pieces)
    kinds, given = split(bc_type)
    points = jnp.asarray(points)
    points = points.astype(jnp.result_type(points, jnp.complex64 if space.dtype.kind == "c" else jnp.float32))
    real = points.real.dtype
    x, t = jnp.asarray(x, real), jnp.asarray(t, real)
    vectors = tuple(jnp.asarray(v, points.dtype) for v in given if v is not None)
    return _curve(Fixed(space, kinds, tuple(sorted(options.items()))), int(nu), x, t, points, *vectors)


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _curve(fixed: Fixed, nu: int, x: Array, t: Array, points: Array, *vectors: Array) -> Any:
    return fit_p.bind(x, t, points, *vectors, fixed=fixed, lead=0, orders=(nu,))[0]


@partial(_curve.defjvp, symbolic_zeros=True)
def _curve_jvp(fixed: Fixed, nu: int, primals: Any, tangents: Any) -> Any:
    x, *data = primals
    dx, *changes = tangents
    in_time = not isinstance(dx, SymbolicZero)
    moving = tuple(not isinstance(change, SymbolicZero) for change in changes)
    if in_time and nu == 2:
        raise NotImplementedError(
            "∇γ' is not differentiated in x, which would be a third derivative; symspline.jax.evaluate has it"
        )
    orders = tuple(range(nu + in_time + 1))
    *found, velocities = fit_p.bind(*primals, fixed=fixed, lead=0, orders=orders)
    point, value = found[0], found[nu]
    moved = jnp.zeros_like(value)
    if in_time:
        ahead = found[nu + 1]
        if nu:
            ahead += bent(fixed.space, point, value, found[1])
        moved += ahead * jnp.expand_dims(dx, tuple(range(-len(fixed.space.point_shape), 0)))
    if any(moving):
        # One vector: its transpose is asked for as a whole.
        pieces = [jnp.ravel(c).astype(value.dtype) for c, m in zip(changes, moving, strict=True) if m]
        push = partial(push_p.bind, jnp.concatenate(pieces), x, *data, velocities)
        moved += push(fixed=fixed, lead=0, nu=nu, moving=moving)
        if nu:
            moved += bent(fixed.space, point, value, push(fixed=fixed, lead=0, nu=0, moving=moving))
    return value, moved

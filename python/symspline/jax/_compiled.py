"""The compiled spline as a differentiable function, on the CPU."""

from __future__ import annotations

from functools import partial
from typing import Unpack, overload

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from numpy.typing import ArrayLike

from .._autodiff.compiled import split
from .._autodiff.curves import second_fundamental_form
from .._autodiff.library import Tensor
from .._base.typing import CubicBCType, CurveOptions, PointsLike, SolverOptions
from .._curves.ends import ends_in_factors
from .._curves.options import order_of
from .._spaces import AnySpace, Product, Space, parts_of, refuse_quotients, space_named
from ..manifolds._manifold import refuse_functions
from ._primitives import Fixed, fit_p, jvp_p

Array = jax.Array


@overload
def curve(
    x: ArrayLike, t: ArrayLike, points: PointsLike, space: Space | str, *, nu: int = 0, **options: Unpack[CurveOptions]
) -> Array: ...


@overload
def curve(
    x: ArrayLike, t: ArrayLike, points: PointsLike, space: Product, *, nu: int = 0, **options: Unpack[CurveOptions]
) -> tuple[Array, ...]: ...


def curve(
    x: Tensor,
    t: Tensor,
    points: Tensor,
    space: AnySpace | str,
    *,
    nu: int = 0,
    bc_type: CubicBCType = "natural",
    **options: Unpack[SolverOptions],
) -> Tensor:
    """Evaluate a spline through points by the compiled core, with derivatives in JAX.

    The result equals ``CubicSpline(t, points, space, ...)(x, nu)``. First derivatives with respect to x, t, points and
    the vectors in `bc_type` are available in forward and reverse mode. `jax.jit` works, and `jax.vmap`, nested or of
    derivatives, makes one call of the core.

    Parameters
    ----------
    x : array
        Times, any shape.
    t : array, shape (n,) or (..., n)
        Knots.
    points : array, shape (..., n, *space.point_shape)
        Points; for a `Product` a tuple. Points and end vectors are projected onto the manifold first, so an optimiser
        may move them off it.
    space : Space or str
        Space or its name.
    nu : {0, 1, 2}, default 0
        0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.
    bc_type : str, tuple or pair, default "natural"
        End conditions, as for `CubicSpline`. Vectors may be JAX arrays.
    **options
        Other options of `CubicSpline`.

    Returns
    -------
    array, shape ``(*batch axes, *x.shape, *space.point_shape)``
        Values, in the precision of the points; for a `Product` a tuple. JAX differentiates these arrays, so the
        derivative of a velocity also has a component normal to the manifold.

    Raises
    ------
    NotImplementedError
        If ∇γ' is differentiated with respect to x, or a second derivative is taken.

    Notes
    -----
    Computations use double precision. Most uses need ``jax.config.update("jax_enable_x64", True)``.

    Where many arrays represent the same point (projective spaces, Grassmannians), differentiate only functions that do
    not depend on the representative.

    With ``on_failure="ignore"`` or ``"warn"``, a curve that did not converge has the values of the best iterate. Its
    derivatives are NaN, because they are derived from the C² condition, which the iterate does not satisfy.

    Examples
    --------
    >>> import jax
    >>> from symspline.jax import curve
    >>> gradient = jax.grad(lambda p: curve(0.5, [0.0, 1.0, 2.0], p, "r:1").sum())([[0.0], [1.0], [0.0]])
    >>> [round(float(g[0]), 4) for g in gradient]
    [0.4062, 0.6875, -0.0938]
    """
    nu = order_of(nu)
    space = space_named(space)
    refuse_quotients(space, "functions of JAX are not made")
    refuse_functions(space, "derivatives with respect to the data are not made")
    if isinstance(space, Product):
        factors = zip(parts_of(points, space, "points"), space.factors, ends_in_factors(bc_type, space), strict=True)
        return tuple(curve(x, t, p, factor, nu=nu, bc_type=bc, **options) for p, factor, bc in factors)
    kinds, given = split(bc_type)
    points = jnp.asarray(points)
    points = points.astype(jnp.result_type(points, jnp.complex64 if space.dtype.kind == "c" else jnp.float32))
    real = points.real.dtype
    x, t = jnp.asarray(x, real), jnp.asarray(t, real)
    vectors = tuple(jnp.asarray(v, points.dtype) for v in given if v is not None)
    return _curve(Fixed(space, kinds, tuple(sorted(options.items()))), nu, x, t, points, *vectors)


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _curve(fixed: Fixed, nu: int, x: Array, t: Array, points: Array, *vectors: Array) -> Tensor:
    return fit_p.bind(x, t, points, *vectors, fixed=fixed, lead=0, orders=(nu,))[0]


@partial(_curve.defjvp, symbolic_zeros=True)
def _curve_jvp(fixed: Fixed, nu: int, primals: Tensor, tangents: Tensor) -> Tensor:
    x, *data = primals
    dx, *changes = tangents
    in_time = not isinstance(dx, SymbolicZero)
    moving = tuple(not isinstance(change, SymbolicZero) for change in changes)
    if in_time and nu == 2:
        raise NotImplementedError(
            "∇γ' is not differentiated in x, which would be a third derivative; symspline.jax.evaluate has it"
        )
    orders = tuple(range(nu + in_time + 1))
    *values, velocities = fit_p.bind(*primals, fixed=fixed, lead=0, orders=orders)
    point, value = values[0], values[nu]
    moved = jnp.zeros_like(value)
    if in_time:
        ahead = values[nu + 1]
        if nu:
            ahead += second_fundamental_form(jnp, fixed.space, point, value, values[1])
        moved += ahead * jnp.expand_dims(dx, tuple(range(-len(fixed.space.point_shape), 0)))
    if any(moving):
        # One vector: its transpose is asked for as a whole.
        parts = [jnp.ravel(c).astype(value.dtype) for c, m in zip(changes, moving, strict=True) if m]
        orders = (nu, 0) if nu else (0,)
        steps = jvp_p.bind(
            jnp.concatenate(parts), x, *data, velocities, fixed=fixed, lead=0, orders=orders, moving=moving
        )
        moved += steps[..., 0]
        if nu:
            moved += second_fundamental_form(jnp, fixed.space, point, value, steps[..., 1])
    return value, moved

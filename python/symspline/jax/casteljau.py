"""Curves with given velocities by de Casteljau's algorithm in JAX itself."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp

from .._core import ValidationError
from ..curves.curve import order_of
from ..spaces import Product, Space, parts_of
from ..spaces import space as space_named
from .embedding import bent
from .known import QUOTIENTS, model_of
from .models import Model
from .spectral import adjoint


def evaluate(t: Any, points: Any, velocities: Any, x: Any, space: Space | str, nu: int = 0) -> Any:
    """The curve with given knots, points and velocities at times x: `symspline.evaluate` in JAX itself.

    It has derivatives of any order, forward and backward, with respect to all arrays, also where points coincide,
    velocities are zero or eigenvalues repeat; it runs where JAX runs. Between two knots it is the cubic Bézier curve
    of geodesics, (8) of the paper, whose control points follow from points and velocities: with the velocities of
    `symspline.jax.fit` or of `symspline.fit` the C² spline.

    Points are first moved to the nearest of the space and velocities to be tangent there, so that derivatives are
    tangent, too. Nothing is checked: at times outside the knots, and where a matrix is far off the space, results
    are NaN.

    Args:
        t: knots, shape (N+1,), or (..., N+1).
        points: shape (..., N+1, *point_shape); for a `Product` a tuple.
        velocities: of the same shape.
        x: times, any shape.
        space: the space or its name: ``r``, ``sphere``, ``hyperbolic``, ``rp``, ``cp``, ``gr``, ``cgr``, ``spd``,
            ``hpd``, ``so:2``, ``so:3``, ``se:2``, ``se:3`` or products of them.
        nu: 0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.

    Returns:
        Shape batch axes + x.shape + point_shape; for a `Product` a tuple. On projective spaces and Grassmannians
        other arrays than those of the compiled core may stand for the same points.

    Raises:
        ValidationError: curves in the space are not made in JAX, or shapes do not match.

    >>> import jax
    >>> import jax.numpy as jnp
    >>> from symspline.jax import evaluate
    >>> p = jnp.array([[1.0, 0, 0], [0, 1, 0]])
    >>> curve = lambda x: evaluate(jnp.arange(2.0), p, jnp.zeros((2, 3)), x, "sphere:2")
    >>> jax.jacfwd(jax.jacfwd(curve))(0.5).shape
    (3,)
    """
    nu = order_of(nu)
    space = space_named(space)
    if isinstance(space, Product):
        pieces = zip(
            parts_of(points, space, "points"),
            parts_of(velocities, space, "velocities"),
            space.factors,
            strict=True,
        )
        return tuple(evaluate(t, p, v, x, factor, nu) for p, v, factor in pieces)
    model = model_of(space)
    points, velocities, t, x = arrays_of(space, points, velocities, t, x)
    batch = points.ndim - 1 - len(space.point_shape)

    def one(t: Any, points: Any, velocities: Any) -> Any:
        return _values(model, space, t, points, velocities, x, nu)

    for _ in range(batch):
        one = jax.vmap(one, (0 if t.ndim > 1 else None, 0, 0))
    return one(t, points, velocities)


def arrays_of(space: Space, points: Any, velocities: Any, t: Any, x: Any) -> tuple[Any, Any, Any, Any]:
    """Arrays of one precision, once their shapes are right."""
    points, velocities = jnp.asarray(points), jnp.asarray(velocities)
    narrow = jnp.complex64 if space.dtype.kind == "c" else jnp.float32
    kind = jnp.result_type(points, velocities, narrow)
    points, velocities = points.astype(kind), velocities.astype(kind)
    t, x = jnp.asarray(t, points.real.dtype), jnp.asarray(x, points.real.dtype)
    core = len(space.point_shape)
    nodes = points.shape[-core - 1] if points.ndim > core else 0
    if points.shape[points.ndim - core :] != space.point_shape or nodes < 2:
        raise ValidationError(
            f"points has shape {points.shape}; a curve in {space} needs (..., N+1, *{space.point_shape}), N >= 1"
        )
    if velocities.shape != points.shape:
        raise ValidationError(f"velocities has shape {velocities.shape}, but points {points.shape}")
    if t.shape not in ((nodes,), points.shape[: points.ndim - core]):
        raise ValidationError(f"t has shape {t.shape}; {nodes} points need ({nodes},), or one row a curve")
    return points, velocities, t, x


def _values(model: Model, space: Space, t: Any, points: Any, velocities: Any, x: Any, nu: int) -> Any:
    """One curve."""

    def curve(x: Any) -> Any:
        return model.leave(_casteljau(model, t, *model.enter(points, velocities), x))

    def velocity(x: Any) -> Any:
        return jax.jvp(curve, (x,), (jnp.ones_like(x),))

    def acceleration(x: Any) -> Any:
        return jax.jvp(velocity, (x,), (jnp.ones_like(x),))

    if nu == 0:
        found = curve(x)
    elif nu == 1:
        point, found = velocity(x)
        if isinstance(space, QUOTIENTS):
            found = _horizontal(space, point, found)
    else:
        (point, first), (_, second) = acceleration(x)
        if isinstance(space, QUOTIENTS):
            found = _horizontal(space, point, first, second)
        else:
            found = second - bent(space, point, first, first)
    # As in `symspline.times.onto_ends`, a few units in the last place beyond the ends are rounding.
    reach = 4 * jnp.finfo(x.dtype).eps * jnp.maximum(jnp.abs(t[0]), jnp.abs(t[-1]))
    inside = (x >= t[0] - reach) & (x <= t[-1] + reach)
    return jnp.where(jnp.expand_dims(inside, tuple(range(x.ndim, found.ndim))), found, jnp.nan)


def _horizontal(space: Space, y: Any, first: Any, second: Any = None) -> Any:
    """(I − YY*)Y', or the covariant acceleration (I − YY*)(Y'' − 2Y'(Y*Y')), for any representatives Y of a curve."""
    if len(space.point_shape) == 1:
        columns = (None if a is None else a[..., None] for a in (y, first, second))
        return _horizontal_columns(*columns)[..., 0]
    return _horizontal_columns(y, first, second)


def _horizontal_columns(y: Any, first: Any, second: Any) -> Any:
    change = first if second is None else second - 2 * first @ (adjoint(y) @ first)
    return change - y @ (adjoint(y) @ change)


def _casteljau(model: Model, t: Any, points: Any, velocities: Any, x: Any) -> Any:
    """(8) of the paper, in the arrays of the model. Geodesics of one stage are one computation: JAX compiles each."""
    h = jnp.diff(t)
    p, q = points[:-1], points[1:]
    legs = jnp.stack([model.times(h / 3, velocities[:-1]), model.times(-h / 3, velocities[1:])])
    inner = model.exp(jnp.stack([p, q]), legs)
    starts = jnp.stack([p, inner[0], q])
    legs = jnp.stack([legs[0], model.log(inner[0], inner[1]), legs[1]])
    i = jnp.clip(jnp.searchsorted(t, x, side="right") - 1, 0, t.shape[0] - 2)
    s = (x - t[i]) / h[i]
    a, b, c = model.exp(starts[:, i], model.times(jnp.stack([s, s, 1 - s]), legs[:, i]))
    left, right = model.between(jnp.stack([a, b]), jnp.stack([b, c]), s)
    return model.between(left, right, s)

"""Curves with given velocities by de Casteljau's algorithm, written in JAX."""

from __future__ import annotations

from typing import Any, overload

import jax
import jax.numpy as jnp

from .._closed_forms import casteljau
from .._closed_forms.models import Model
from .._core import ValidationError
from .._curves.options import order_of
from .._spaces import Product, Space, parts_of, refuse_quotients, space_named
from ._precision import full_precision
from ._registry import LIBRARY, model_of


@overload
def evaluate(t: Any, points: Any, velocities: Any, space: Space | str, x: Any, *, nu: int = 0) -> jax.Array: ...


@overload
def evaluate(t: Any, points: Any, velocities: Any, space: Product, x: Any, *, nu: int = 0) -> tuple[jax.Array, ...]: ...


@full_precision
def evaluate(t: Any, points: Any, velocities: Any, space: Space[Any] | str, x: Any, *, nu: int = 0) -> Any:
    """Evaluate curves with given knots, points and velocities, in JAX alone.

    This is `symspline.evaluate` written in JAX. It runs on the device of JAX and has derivatives of any order, in
    forward and reverse mode, with respect to all arrays.

    Parameters
    ----------
    t : array, shape (n,) or (..., n)
        Knots.
    points : array, shape (..., n, *space.point_shape)
        Points; for a `Product` a tuple.
    velocities : array, shape of points
        Velocities, such as those of `symspline.jax.fit` or `symspline.fit`.
    space : Space or str
        Space or its name: ``r``, ``sphere``, ``hyperbolic``, ``rp``, ``cp``, ``gr``, ``cgr``, ``spd``, ``hpd``,
        ``so:2``, ``so:3``, ``se:2``, ``se:3`` or products of them.
    x : array
        Times, any shape.
    nu : {0, 1, 2}, default 0
        0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.

    Returns
    -------
    array, shape ``(*batch axes, *x.shape, *space.point_shape)``
        Values; for a `Product` a tuple. On projective spaces and Grassmannians the representatives may differ from
        those of the compiled core.

    Raises
    ------
    ValidationError
        If the space is not supported in JAX, or shapes do not match.

    Notes
    -----
    Between two knots the curve is the cubic Bézier curve of geodesics, (8) of the paper. Derivatives are finite also
    where points coincide, velocities are zero or eigenvalues repeat.

    Points are first projected onto the manifold and velocities onto the tangent spaces, so derivatives are tangent as
    well. Values are not validated: at times outside the knots, and for matrices far off the space, results are NaN.

    Examples
    --------
    >>> import jax
    >>> import jax.numpy as jnp
    >>> from symspline.jax import evaluate
    >>> p = jnp.array([[1.0, 0, 0], [0, 1, 0]])
    >>> curve = lambda x: evaluate(jnp.arange(2.0), p, jnp.zeros((2, 3)), "sphere:2", x)
    >>> jax.jit(jax.jacfwd(jax.jacfwd(curve)))(0.5).shape
    (3,)
    """
    nu = order_of(nu)
    space = space_named(space)
    refuse_quotients(space, "functions of JAX are not made")
    if isinstance(space, Product):
        each = zip(
            parts_of(points, space, "points"), parts_of(velocities, space, "velocities"), space.factors, strict=True
        )
        return tuple(evaluate(t, p, v, factor, x, nu=nu) for p, v, factor in each)
    model = model_of(space)
    points, velocities, t, x = arrays_of(space, points, velocities, t, x)
    batch = points.ndim - 1 - len(space.point_shape)

    def one(t: Any, points: Any, velocities: Any) -> Any:
        return _values(model, space, t, points, velocities, x, nu)

    for _ in range(batch):
        one = jax.vmap(one, (0 if t.ndim > 1 else None, 0, 0))
    return one(t, points, velocities)


def arrays_of(space: Space, points: Any, velocities: Any, t: Any, x: Any) -> tuple[Any, Any, Any, Any]:
    """Convert arrays to one precision and validate their shapes."""
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
        return model.from_internal(_casteljau(model, t, *model.to_internal(points, velocities), x))

    def velocity(x: Any) -> Any:
        return jax.jvp(curve, (x,), (jnp.ones_like(x),))

    def acceleration(x: Any) -> Any:
        return jax.jvp(velocity, (x,), (jnp.ones_like(x),))

    if nu == 0:
        found = curve(x)
    elif nu == 1:
        found = casteljau.velocity(space, *velocity(x))
    else:
        (point, first), (_, second) = acceleration(x)
        found = casteljau.acceleration(LIBRARY, space, point, first, second)
    # As in `symspline._time.onto_ends`, a few units in the last place beyond the ends are rounding.
    reach = 4 * jnp.finfo(x.dtype).eps * jnp.maximum(jnp.abs(t[0]), jnp.abs(t[-1]))
    inside = (x >= t[0] - reach) & (x <= t[-1] + reach)
    return jnp.where(jnp.expand_dims(inside, tuple(range(x.ndim, found.ndim))), found, jnp.nan)


def _casteljau(model: Model, t: Any, points: Any, velocities: Any, x: Any) -> Any:
    """Evaluate one curve in the arrays of the model."""
    h = jnp.diff(t)
    starts, handles = casteljau.control(model, h, points, velocities)
    i = jnp.clip(jnp.searchsorted(t, x, side="right") - 1, 0, t.shape[0] - 2)
    return casteljau.bezier(model, starts[:, i], handles[:, i], (x - t[i]) / h[i])

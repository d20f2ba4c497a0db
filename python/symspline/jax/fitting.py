"""Fits in JAX itself: many curves of equal length, a fixed number of quasi-Newton steps."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp

from .._core import ValidationError
from ..adapters import split
from ..arrays import shown
from ..spaces import Space, SpecialOrthogonal, Sphere
from ..spaces import space as space_named
from .casteljau import arrays_of
from .chain import Data, defects, step_of, weights
from .models import Curved, Model
from .motions import Rotations


def fit(
    t: Any, points: Any, space: Space | str, *, bc_type: Any = "natural", steps: int = 40
) -> tuple[Any, Any]:
    """The velocities of the C² splines through points of a sphere, or of rotations: `symspline.fit` in JAX itself.

    All curves take the same number of steps: each solves a tridiagonal system in frames carried in parallel along the
    points, which in flat space is the spline at once. A step divides the error by about 30 for points .3 apart (half
    an angle, for rotations), by 6 for .8, by 3 for 1.2. For points farther apart than about 1.5 use `symspline.fit`,
    which has other solvers; look at the residual.

    It has derivatives of any order, forward and backward, by the implicit function theorem: the same steps for the
    equation of the derivative, without a record of the steps of the fit. It runs where JAX runs. Points are first
    moved to the nearest of the space.

    Args:
        t: knots, shape (N+1,), or (..., N+1).
        points: shape (..., N+1, *point_shape).
        space: ``sphere:n``, ``so:2`` or ``so:3``.
        bc_type: ``"natural"``, ``"clamped"``, or a pair with one of these or ``(1, velocity)`` for either end.
        steps: how many quasi-Newton steps.

    Returns:
        The velocities, of the shape of the points, and for every curve the residual: by how much a further sweep of
        the paper's (17) would change a velocity, relative to the largest.

    Raises:
        ValidationError: the space or the end conditions are others, or shapes do not match.

    >>> import jax.numpy as jnp
    >>> from symspline.jax import fit
    >>> u, residual = fit(jnp.arange(3.0), jnp.eye(3), "sphere:2")
    >>> u.shape, residual.shape
    ((3, 3), ())
    """
    space = space_named(space)
    model = _model_of(space)
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
        raise ValidationError(f"steps must be a whole number from 1 on, not {shown(steps)}")
    points, _, t, _ = arrays_of(space, points, jnp.zeros_like(jnp.asarray(points)), t, 0.0)
    core = len(space.point_shape)
    batch = points.shape[: points.ndim - core - 1]
    given, ends = _ends(bc_type, points, core)

    def one(t: Any, points: Any, first: Any, last: Any) -> Any:
        rows = jnp.zeros_like(points).at[0].set(first).at[-1].set(last)
        p, v = model.enter(points, rows)
        if isinstance(model, Rotations):
            # Of both signs of a quaternion the one nearer to that before.
            signs = jnp.where(jnp.sum(p[:-1] * p[1:], axis=-1) < 0, -1.0, 1.0)
            along = jnp.concatenate([jnp.ones_like(signs[:1]), jnp.cumprod(signs)])[:, None]
            p, v = along * p, along * v
        data = Data(t, p, v[0], v[-1])
        u = _velocities(given, steps, data)
        left = jnp.linalg.norm(defects(given, u, data), axis=-1) / weights(given, t)[1]
        largest = jnp.max(jnp.linalg.norm(jax.lax.stop_gradient(u), axis=-1))
        residual = jnp.max(jax.lax.stop_gradient(left)) / jnp.where(largest > 0, largest, 1.0)
        return _velocities_outside(model, p, u), residual

    for _ in batch:
        one = jax.vmap(one, (0 if t.ndim > 1 else None, 0, 0, 0))
    found: tuple[Any, Any] = one(t, points, *ends)
    return found


def _velocities_outside(model: Model, p: Any, u: Any) -> Any:
    """Velocities of the arrays that a model stands for."""
    moved = jax.jvp(model.leave, (p,), (u,))[1]
    return moved


def _model_of(space: Space) -> Model:
    if isinstance(space, Sphere):
        return Curved(1)
    if isinstance(space, SpecialOrthogonal) and space.point_shape[0] in (2, 3):
        return Rotations(space.point_shape[0])
    raise ValidationError(
        f"curves in {space} are not fitted in JAX itself, which fits in sphere:n, so:2 and so:3; symspline.jax.curve "
        "has every space"
    )


def _ends(bc_type: Any, points: Any, core: int) -> tuple[tuple[bool, bool], list[Any]]:
    """Which ends have a given velocity, and what it is; zero where there is none."""
    kinds, vectors = split(bc_type)
    pair = (kinds, kinds) if isinstance(kinds, str) else kinds
    if any(kind not in ("natural", "clamped", 1) for kind in pair):
        raise ValidationError(
            "bc_type is 'natural', 'clamped', or a pair with one of these or (1, velocity) for either end; got "
            f"{shown(bc_type)}"
        )
    shape = points.shape[: points.ndim - core - 1] + points.shape[points.ndim - core :]
    ends = []
    for vector, name in zip(vectors, ("start", "end"), strict=True):
        array = jnp.asarray(0.0 if vector is None else vector, points.dtype)
        try:
            ends.append(jnp.broadcast_to(array, shape))
        except ValueError:
            raise ValidationError(
                f"the {name} velocity has shape {array.shape}, which does not broadcast to {shape}"
            ) from None
    return (pair[0] != "natural", pair[1] != "natural"), ends


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _velocities(given: tuple[bool, bool], steps: int, data: Data) -> Any:
    step = step_of(given, data.t, data.p)

    def further(u: Any, _: Any) -> Any:
        return u + step(defects(given, u, data)), None

    return jax.lax.scan(further, jnp.zeros_like(data.p), None, length=steps)[0]


@_velocities.defjvp
def _velocities_jvp(given: tuple[bool, bool], steps: int, primals: Any, tangents: Any) -> Any:
    """F(u, data) = 0: u follows its data like −F_u⁻¹ F_data, by the same steps."""
    (data,), (change,) = primals, tangents
    u = _velocities(given, steps, data)
    # A tangent vector leaves the tangent space when its point moves.
    normal = -jnp.sum(u * change.p, axis=-1, keepdims=True) * data.p
    ahead = jax.jvp(partial(defects, given), (u, data), (normal, change))[1]
    _, linear = jax.linearize(lambda u: defects(given, u, data), u)
    step = step_of(given, data.t, data.p)

    def further(du: Any, _: Any) -> Any:
        return du + step(linear(du) + ahead), None

    du = jax.lax.scan(further, jnp.zeros_like(u), None, length=steps)[0]
    return u, du + normal

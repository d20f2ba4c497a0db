"""Fits written in JAX: many curves of equal length, a fixed number of quasi-Newton steps."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp

from .._adapters import split
from .._base.arrays import short_repr
from .._closed_forms.condition import Chain, weights
from .._core import ValidationError
from .._spaces import Space, refuse_quotients, space_named
from ._casteljau import arrays_of
from ._chain import Data, residual_of, step_of
from ._precision import full_precision
from ._registry import LIBRARY, chain_of


@full_precision
def fit(
    t: Any, points: Any, space: Space | str, *, bc_type: Any = "natural", steps: int = 40
) -> tuple[jax.Array, jax.Array]:
    """Compute the velocities of C² splines through points, in JAX alone.

    This is `symspline.fit` written in JAX. It runs on the device of JAX and has derivatives of any order, in forward
    and reverse mode.

    Parameters
    ----------
    t : array, shape (n,) or (..., n)
        Knots.
    points : array, shape (..., n, *space.point_shape)
        Points, which are first projected onto the manifold.
    space : Space or str
        ``r:n``, ``sphere:n``, ``spd:n``, ``hpd:n``, ``so:2``, ``so:3``, ``se:2`` or ``se:3``.
    bc_type : {"natural", "clamped"} or pair, default "natural"
        End conditions. A pair has one of these words or ``(1, velocity)`` for either end.
    steps : int, default 40
        Number of quasi-Newton steps, the same for all curves.

    Returns
    -------
    velocities : array, shape of points
        Velocities at the knots.
    residual : array, shape batch axes
        Relative residual of every curve: the change of a velocity by one more sweep of (17) of the paper, divided by
        the largest velocity.

    Raises
    ------
    ValidationError
        If the space or the end conditions are not supported, or shapes do not match.

    Notes
    -----
    Each step solves a tridiagonal system in frames that are transported in parallel along the points. In flat space one
    step gives the spline. A step divides the error by about 30 for points .3 apart (half an angle, for rotations), by 6
    for .8, and by 3 for 1.2. Check the residual. For points farther apart than about 1.5 use `symspline.fit`, which has
    other solvers.

    Derivatives use the implicit function theorem: the same steps are applied to the linearised equation, without
    storing the steps of the fit.

    Examples
    --------
    >>> import jax.numpy as jnp
    >>> from symspline.jax import fit
    >>> u, residual = fit(jnp.arange(3.0), jnp.eye(3), "sphere:2")
    >>> u.shape, residual.shape
    ((3, 3), ())
    """
    space = space_named(space)
    refuse_quotients(space, "functions of JAX are not made")
    chain = chain_of(space)
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
        raise ValidationError(f"steps must be a whole number from 1 on, not {short_repr(steps)}")
    points, _, t, _ = arrays_of(space, points, jnp.zeros_like(jnp.asarray(points)), t, 0.0)
    core = len(space.point_shape)
    batch = points.shape[: points.ndim - core - 1]
    given, ends = _ends(bc_type, points, core)

    def one(t: Any, points: Any, first: Any, last: Any) -> Any:
        rows = jnp.zeros_like(points).at[0].set(first).at[-1].set(last)
        p, v = chain.enter(points, rows)
        data = Data(t, p, v[0], v[-1])
        u = _velocities(chain, given, steps, data)
        left = _norms(residual_of(chain, given, u, data)) / weights(LIBRARY, given, jnp.diff(t))[1]
        largest = jnp.max(_norms(jax.lax.stop_gradient(u)))
        residual = jnp.max(jax.lax.stop_gradient(left)) / jnp.where(largest > 0, largest, 1.0)
        return chain.leave(p, u), residual

    for _ in batch:
        one = jax.vmap(one, (0 if t.ndim > 1 else None, 0, 0, 0))
    found: tuple[Any, Any] = one(t, points, *ends)
    return found


def _norms(rows: Any) -> Any:
    """Return the length of every row."""
    return jnp.linalg.norm(rows.reshape(len(rows), -1), axis=-1)


def _ends(bc_type: Any, points: Any, core: int) -> tuple[tuple[bool, bool], list[Any]]:
    """Return which ends have a given velocity, and its value or zero."""
    kinds, vectors = split(bc_type)
    pair = (kinds, kinds) if isinstance(kinds, str) else kinds
    if any(kind not in ("natural", "clamped", 1) for kind in pair):
        raise ValidationError(
            "bc_type must be 'natural', 'clamped', or a pair with one of these or (1, velocity) for either end; got "
            f"{short_repr(bc_type)}"
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


@partial(jax.custom_jvp, nondiff_argnums=(0, 1, 2))
def _velocities(chain: Chain, given: tuple[bool, bool], steps: int, data: Data) -> Any:
    step = step_of(chain, given, data.t, data.p)

    def further(u: Any, _: Any) -> Any:
        return u + step(residual_of(chain, given, u, data)), None

    start = jnp.zeros((len(data.p), *data.first.shape), data.first.dtype)
    return jax.lax.scan(further, start, None, length=steps)[0]


@_velocities.defjvp
@full_precision
def _velocities_jvp(chain: Chain, given: tuple[bool, bool], steps: int, primals: Any, tangents: Any) -> Any:
    """Differentiate F(u, data) = 0: du = −F_u⁻¹ F_data, by the same steps."""
    (data,), (change,) = primals, tangents
    u = _velocities(chain, given, steps, data)
    # A tangent vector leaves the tangent space when its point moves.
    normal = chain.normal_change(data.p, u, change.p)
    condition = partial(residual_of, chain, given)
    ahead = jax.jvp(condition, (u, data), (normal, change))[1]
    _, linear = jax.linearize(lambda u: condition(u, data), u)
    step = step_of(chain, given, data.t, data.p)

    def further(du: Any, _: Any) -> Any:
        return du + step(linear(du) + ahead), None

    du = jax.lax.scan(further, jnp.zeros_like(u), None, length=steps)[0]
    return u, du + normal

"""The C² condition on spheres in JAX, and the quasi-Newton step from its residual.

Knots t, points p and velocities u of one curve have shapes (N+1,), (N+1, n+1) and (N+1, n+1).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from ._models import Curved
from ._series import stumpff

_SPHERE = Curved(1)


class Data(NamedTuple):
    """What a curve is made of: knots, points, and velocities at the ends, which count where one is given."""

    t: Any
    p: Any
    first: Any
    last: Any


def defects(given: tuple[bool, bool], u: Any, data: Data) -> Any:
    """Return the residuals of the C² condition at inner knots and of the end conditions.

    On unequal knots (13) has factors sinh(ad)/ad. Each residual is a velocity times its weight in `weights`.

    Parameters
    ----------
    given : tuple of bool
        Whether the velocity is given at the start and at the end; otherwise the acceleration is zero, (20).
    """
    t, p, first, last = data
    h = jnp.diff(t)[:, None]
    ahead, back = h * u[:-1] / 3, -h * u[1:] / 3
    left, right = _SPHERE.exp(p[:-1], ahead), _SPHERE.exp(p[1:], back)
    starts = jnp.stack([left, right])
    logs = _transported(starts, jnp.stack([p[:-1], p[1:]]), _SPHERE.log(starts, starts[::-1]))
    after, before = (logs - jnp.stack([ahead, back])) / h**2
    inner = _stretched(back[:-1], after[1:]) - _stretched(ahead[1:], before[:-1])
    start = first - u[0] if given[0] else 3 * after[0]
    end = last - u[-1] if given[1] else -3 * before[-1]
    return jnp.concatenate([start[None], 3 * inner, end[None]])


def weights(given: tuple[bool, bool], t: Any) -> tuple[Any, Any, Any]:
    """Return the three diagonals of the condition in flat space."""
    r = 1 / jnp.diff(t)
    zero = jnp.zeros(1, r.dtype)
    middle = 2 * (jnp.concatenate([zero, r]) + jnp.concatenate([r, zero]))
    below, above = jnp.concatenate([zero, r]), jnp.concatenate([r, zero])
    if given[0]:
        middle, above = middle.at[0].set(1.0), above.at[0].set(0.0)
    if given[1]:
        middle, below = middle.at[-1].set(1.0), below.at[-1].set(0.0)
    return below, middle, above


def step_of(given: tuple[bool, bool], t: Any, p: Any) -> Any:
    """Return the quasi-Newton step from residuals to velocities.

    The step solves a tridiagonal system in frames that are transported in parallel from point to point. The choice of
    frames does not affect the solution, so the step is not differentiated.
    """
    below, middle, above = weights(given, jax.lax.stop_gradient(t))
    frames = _frames(jax.lax.stop_gradient(p))

    def step(defect: Any) -> Any:
        rows = jnp.einsum("iab,ia->ib", frames, defect)
        return jnp.einsum("iab,ib->ia", frames, jax.lax.linalg.tridiagonal_solve(below, middle, above, rows))

    return step


def _frames(p: Any) -> Any:
    """Return rotations that transport tangent vectors at the first point along the polygon to each point."""
    a, b = p[:-1], p[1:]
    s = a + b
    one = jnp.eye(p.shape[-1], dtype=p.dtype)
    scale = 1 + jnp.sum(a * b, axis=-1)
    outer = s[:, :, None] * s[:, None, :] / scale[:, None, None]
    turns = one - outer + 2 * b[:, :, None] * a[:, None, :]
    return jax.lax.associative_scan(lambda x, y: y @ x, jnp.concatenate([one[None], turns]))


def _transported(a: Any, b: Any, v: Any) -> Any:
    """Transport tangent vectors at a in parallel along geodesics to b."""
    return v - _SPHERE.inner(v, b) / (1 + _SPHERE.inner(a, b)) * (a + b)


def _stretched(v: Any, w: Any) -> Any:
    """sinh(ad_v)/ad_v of w: across v by sin|v|/|v|, and along v as it is."""
    z = _SPHERE.inner(v, v)
    return stumpff(1, 1, z) * w + stumpff(3, 1, z) * _SPHERE.inner(v, w) * v

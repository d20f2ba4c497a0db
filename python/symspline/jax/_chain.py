"""The quasi-Newton step from the residual of the C² condition, in JAX.

Knots, nodes and velocities of one curve have n rows, in the arrays of the chain.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from .._closed_forms.condition import Chain, PoseChain, PositiveChain, SphereChain, residual, weights
from .._closed_forms.library import adjoint
from .._closed_forms.motions import turned
from .._closed_forms.tridiagonal import cyclic_reduction
from ._registry import LIBRARY


class Data(NamedTuple):
    """The data of a curve: knots, nodes, and velocities at the ends, which count where one is given."""

    t: Any
    p: Any
    first: Any
    last: Any


def residual_of(chain: Chain, given: tuple[bool, bool], u: Any, data: Data) -> Any:
    """Return the residuals of the C² condition and of the end conditions."""
    return residual(chain, given, jnp.diff(data.t), data.p, u, data.first, data.last)


def step_of(chain: Chain, given: tuple[bool, bool], t: Any, p: Any) -> Any:
    """Return the quasi-Newton step from residuals to velocities.

    The step solves a tridiagonal system in frames that are transported in parallel from node to node. The choice of
    frames does not affect the solution, so the step is not differentiated.
    """
    below, middle, above = weights(LIBRARY, given, jnp.diff(jax.lax.stop_gradient(t)))
    to_first, from_first = _transport(chain, jax.lax.stop_gradient(p))

    def step(rows: Any) -> Any:
        flat = to_first(rows).reshape(len(rows), -1)
        return from_first(_solved(below, middle, above, flat).reshape(rows.shape))

    return step


def _solved(below: Any, middle: Any, above: Any, rows: Any) -> Any:
    def lapack(below: Any, middle: Any, above: Any, rows: Any) -> Any:
        below, middle, above = (a.astype(rows.dtype) for a in (below, middle, above))
        return jax.lax.linalg.tridiagonal_solve(below, middle, above, rows)

    def reduction(below: Any, middle: Any, above: Any, rows: Any) -> Any:
        below, middle, above = (a[:, None, None] for a in (below, middle, above))
        return cyclic_reduction(jnp, _solve_scalars, below, middle, above, rows[:, None, :])[:, 0]

    # On a GPU `tridiagonal_solve` takes one column of all curves after another: 10 000 curves take seconds.
    return jax.lax.platform_dependent(below, middle, above, rows, cpu=lapack, default=reduction)


def _solve_scalars(diagonal: Any, *columns: Any) -> Any:
    return [a / diagonal for a in columns]


def _transport(chain: Chain, p: Any) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    """Return the parallel transport of vectors along the nodes to the first one, and its inverse."""
    if isinstance(chain, SphereChain):
        frames = _rotations(p)
        return lambda v: jnp.einsum("iab,ia->ib", frames, v), lambda v: jnp.einsum("iab,ib->ia", frames, v)
    if isinstance(chain, PositiveChain):
        # In frames L the transport is the unitary factor of L_p⁻¹ L_q.
        left, _, right = jnp.linalg.svd(LIBRARY.solve_lower(p[:-1], p[1:]))
        frames = _products(adjoint(left @ right))
        return lambda v: adjoint(frames) @ v @ frames, lambda v: frames @ v @ adjoint(frames)
    if isinstance(chain, PoseChain):
        # A geodesic exp(sd) transports by Ad(exp(−sd/2)) in the frame of the body.
        columns = _adjoint_columns(chain, chain.model.exp(_at_rest(p[1:]), -0.5 * chain.model.log(p[:-1], p[1:])))
        frames = _products(columns)
        inverse = jnp.linalg.inv(frames)
        return lambda v: jnp.einsum("iab,ib->ia", inverse, v), lambda v: jnp.einsum("iab,ib->ia", frames, v)
    return lambda v: v, lambda v: v


def _products(steps: Any) -> Any:
    """Return the products of matrices from the first node to each node."""
    one = jnp.eye(steps.shape[-1], dtype=steps.dtype)
    return jax.lax.associative_scan(lambda x, y: y @ x, jnp.concatenate([one[None], steps]))


def _rotations(p: Any) -> Any:
    """Return the rotations that transport tangent vectors at the first point along the polygon to each point."""
    a, b = p[:-1], p[1:]
    s = a + b
    scale = 1 + jnp.sum(a * b, axis=-1)
    outer = s[:, :, None] * s[:, None, :] / scale[:, None, None]
    return _products(jnp.eye(p.shape[-1], dtype=p.dtype) - outer + 2 * b[:, :, None] * a[:, None, :])


def _at_rest(p: Any) -> Any:
    """Return poses without rotation and translation."""
    return jnp.zeros_like(p).at[..., 0].set(1.0)


def _adjoint_columns(chain: Chain, poses: Any) -> Any:
    """Return the matrices of Ad, which maps the twist (ω, v) to (Rω, Rv + x × Rω)."""
    quaternion, place = poses[:, None, :4], poses[:, None, 4:]
    twists = jnp.eye(6, dtype=poses.dtype)
    turn = turned(chain.lib, quaternion, twists[:, :3])
    ahead = turned(chain.lib, quaternion, twists[:, 3:]) + jnp.cross(place, turn)
    return jnp.swapaxes(jnp.concatenate([turn, ahead], axis=-1), -1, -2)

"""Curves to be fitted in any space."""

from __future__ import annotations

import numpy as np

import symspline as ss

from .data import Array

LONGEST = 0.3
"""Longest step between neighbours, in the metric of the space; the shortest is a third of it."""
TURN = 0.5
"""How much of a random direction is added to the direction of the step before."""


def walks(space: ss.Space, curves: int, knots: int, seed: int = 4) -> Array:
    """Points of smooth random walks, shape (curves, knots, *point_shape)."""
    rng = np.random.default_rng(seed)
    if isinstance(space, ss.Grassmannian):
        n, k = space.point_shape
        if n > 2 * knots * k:
            # No curve needs more dimensions than its knots together.
            basis = np.linalg.qr(rng.standard_normal((n, knots * k)))[0]
            return basis @ walks(ss.Grassmannian(k, knots * k), curves, knots, seed)
    p = _starts(space, curves, rng)
    direction = _unit(space, p, space.random_tangent(rng, p))
    points = [p]
    for _ in range(knots - 1):
        step = _times(space, rng.uniform(LONGEST / 3, LONGEST, curves), direction)
        q = space.project(space.exp(p, step))
        # Parallel transport is not known on a Stiefel manifold.
        direction, p = direction if isinstance(space, ss.Manifold) else space.transport(p, q, direction), q
        turn = _unit(space, p, space.random_tangent(rng, p))
        direction = _unit(space, p, space.project_tangent(p, direction + TURN * turn))
        points.append(p)
    return np.stack(points, axis=1)


def _starts(space: ss.Space, curves: int, rng: np.random.Generator) -> Array:
    """Random points; of the spaces without bounds one point close to the middle."""
    if isinstance(space, ss.SymmetricPositiveDefinite | ss.HermitianPositiveDefinite | ss.SpecialEuclidean):
        middle = np.broadcast_to(np.eye(space.point_shape[0]), (curves, *space.point_shape))
        return space.exp(middle, _times(space, 0.3, _unit(space, middle, space.random_tangent(rng, middle))))
    return space.random_point(rng, curves)


def _unit(space: ss.Space, p: Array, v: Array) -> Array:
    return _times(space, 1 / space.norm(p, v), v)


def _times(space: ss.Space, factor: Array | float, v: Array) -> Array:
    """Vectors times one number each."""
    return np.reshape(factor, np.shape(factor) + (1,) * len(space.point_shape)) * v

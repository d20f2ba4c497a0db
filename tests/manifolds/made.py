"""Manifolds for the tests, and curves on them."""

import numpy as np
from cases import one_sided
from manifolds import ellipsoid

import symspline as ss


def twin(space, **changes):
    """A space of the library as a manifold that a user brings."""
    functions = {
        "exp": space.exp,
        "log": space.log,
        "project_tangent": space.project_tangent,
        "inner": space.inner,
        "project": space.project,
        "injectivity_radius": space.injectivity_radius,
        "point_shape": space.point_shape,
        "dim": space.dim,
        "dtype": space.dtype,
    }
    return ss.Manifold(**(functions | changes))


def flat(n):
    def add(p, v):
        return p + v

    def minus(p, q):
        return q - p

    def same(p, v):
        return v

    return ss.Manifold(
        exp=add, log=minus, project_tangent=same, inner=lambda p, u, v: np.sum(u * v, axis=1), point_shape=n
    )


# The shortest conjugate distance is π times the smallest radius of curvature.
ELLIPSOID = ellipsoid()


def walk(space, step, n, seed, start=None):
    """Points with equal steps whose direction turns by about half a radian."""
    rng = np.random.default_rng(seed)

    def unit(p):
        v = space.random_tangent(rng, p)
        return v / space.norm(p, v)

    p = [space.random_point(rng) if start is None else start]
    direction = unit(p[0])
    for _ in range(n - 1):
        q = space.exp(p[-1], step * direction)
        direction = -space.log(q, p[-1]) / step + 0.5 * unit(q)
        direction = direction / space.norm(q, direction)
        p.append(q)
    return np.array(p)


def knots(kind, n, seed):
    gaps = np.ones(n - 1) if kind == "equal" else np.random.default_rng(seed).uniform(0.5, 1.5, n - 1)
    return np.concatenate([[0.0], np.cumsum(gaps)])


def jump(spline, nu=2):
    """The largest jump of a derivative at a knot, relative to the largest derivative."""
    starts, ends = one_sided(spline, nu)
    left, right = ends[:-1], starts[1:]
    if spline.bc_type == "periodic":
        left, right = ends, np.roll(starts, -1, axis=0)
    return np.abs(left - right).max() / max(np.abs(starts).max(), np.abs(ends).max())

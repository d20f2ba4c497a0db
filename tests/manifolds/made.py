"""Manifolds for the tests, and curves on them."""

from functools import partial

import numpy as np
from cases import one_sided

import symspline as ss

AXES = np.array([1.0, 1.2, 0.8])
RADII = 2.0, 0.8


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


def ellipsoid_equation(x):
    return np.sum((x / AXES) ** 2, axis=-1) - 1


def _ellipsoid_grad(x):
    return 2 * x / AXES**2


def _ellipsoid_hess(x):
    return np.broadcast_to(np.diag(2 / AXES**2), (len(x), 3, 3))


def _torus(x):
    return (np.hypot(x[:, 0], x[:, 1]) - RADII[0]) ** 2 + x[:, 2] ** 2 - RADII[1] ** 2


def _torus_grad(x):
    s = np.hypot(x[:, 0], x[:, 1])
    c = 2 * (s - RADII[0]) / s
    return np.stack([c * x[:, 0], c * x[:, 1], 2 * x[:, 2]], axis=-1)


def _torus_hess(x):
    s = np.hypot(x[:, 0], x[:, 1])
    n = np.stack([x[:, 0] / s, x[:, 1] / s, 0 * s], axis=-1)
    around = np.diag([1.0, 1.0, 0.0])
    c, k = 2 * (s - RADII[0]) / s, 2 * RADII[0] / s
    return c[:, None, None] * around + k[:, None, None] * n[:, :, None] * n[:, None, :] + 2 * np.diag([0.0, 0.0, 1.0])


# The shortest conjugate distances are π times the smallest radius of curvature.
ellipsoid = partial(ss.manifolds.from_surface, ellipsoid_equation, _ellipsoid_grad, 3)
torus = partial(ss.manifolds.from_surface, _torus, _torus_grad, 3)
ELLIPSOID = ellipsoid(hess=_ellipsoid_hess)
TORUS = torus(hess=_torus_hess)


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

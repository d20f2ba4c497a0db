"""The spaces that the law suite runs over, and data on them. A new space joins with one line."""

from dataclasses import dataclass

import numpy as np

import symspline as ss

EPS = np.finfo(float).eps


@dataclass(frozen=True)
class Case:
    """A space, and the scale of data on it.

    Attributes:
        name: the space's name.
        far: the longest step between neighbours that the solver laws use.
        smooth: whether to run the laws on smooth curves (needs dimension 2 or more).
    """

    name: str
    far: float = 2.5
    smooth: bool = True

    @property
    def space(self):
        return ss.space(self.name)


CASES = [
    Case("euclidean:1", smooth=False),
    Case("euclidean:3"),
    Case("sphere:1", smooth=False),
    Case("sphere:2"),
    Case("sphere:3"),
    Case("sphere:7"),
    Case("hyperbolic:1", far=1.5, smooth=False),
    Case("hyperbolic:2", far=1.5),
    Case("hyperbolic:5", far=1.5),
]


def condition(space, points):
    """By how much rounding of points near these counts: |p|² on the hyperboloid (in flat space |p|)."""
    if isinstance(space, ss.Hyperbolic):
        return float(np.max(np.sum(np.square(points), axis=-1)))
    return max(1.0, float(np.max(np.abs(points))))


def base_point(space, rng):
    """A random point that is not far from the middle of a non-compact space."""
    p = space.random_point(rng)
    if np.isfinite(space.injectivity_radius):
        return p
    centre = np.zeros(space.point_shape)
    if isinstance(space, ss.Hyperbolic):
        centre[0] = 1.0
    return space.exp(centre, 0.3 * space.log(centre, p))


def unit_tangent(space, p, rng):
    v = space.random_tangent(rng, p)
    return v / space.norm(p, v)


def walk(space, step, n, rng, turn=0.5):
    """Points with equal steps whose direction changes by about `turn` radians a step.

    On spaces without a cut locus the walk turns back when it has gone far: rounding grows with the
    distance there.
    """
    p = [base_point(space, rng)]
    direction = unit_tangent(space, p[0], rng)
    for _ in range(n - 1):
        q = space.project(space.exp(p[-1], step * direction))
        direction = space.transport(p[-1], q, direction)
        direction = direction + turn * unit_tangent(space, q, rng)
        if not np.isfinite(space.injectivity_radius) and space.distance(p[0], q) > 2.0:
            direction = space.log(q, p[0]) + 0.5 * direction
        size = space.norm(q, direction)
        direction = direction / size if size > 0.1 else unit_tangent(space, q, rng)
        p.append(q)
    return np.array(p)


def closed_walk(space, step, n, rng):
    """A walk there and back."""
    there = walk(space, step, n // 2 + 1, rng)
    return np.concatenate([there, there[-2::-1]])


def one_sided(spline, nu):
    """γ⁽ᵛ⁾ at both ends of every segment, from that segment alone: shapes (N, *point_shape)."""
    t, p, u = np.asarray(spline.t, float), spline.points, spline.velocities
    h = np.diff(t)
    pairs = np.stack([p[:-1], p[1:]], axis=1), np.stack([u[:-1], u[1:]], axis=1)
    knots = np.stack([0 * h, h], axis=1)
    values = ss.evaluate(knots, knots, *pairs, spline.space, nu, per_curve=True)
    return values[:, 0], values[:, 1]


def jumps(spline):
    """Largest jump of γ, γ', ∇γ' at a knot, as multiples of what the C² law allows."""
    space, p = spline.space, spline.points
    h = np.diff(np.asarray(spline.t, float))
    found = []
    for nu in range(3):
        start, end = one_sided(spline, nu)
        left, right, shorter = end[:-1], start[1:], np.minimum(h[:-1], h[1:])
        if isinstance(spline.bc_type, str) and spline.bc_type == "periodic":
            left, right = np.concatenate([left, end[-1:]]), np.concatenate([right, start[:1]])
            shorter = np.append(shorter, min(h[0], h[-1]))
        largest = max(np.abs(start).max(), np.abs(end).max())
        # 50 ε for the rounding of either side.
        allowed = 1e-12 * largest + 2 * 50 * EPS * condition(space, p) / shorter**nu
        difference = np.abs(left - right).reshape(len(left), -1).max(axis=1, initial=0.0)
        found.append(float((difference / allowed).max(initial=0.0)))
    return found

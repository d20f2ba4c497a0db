"""Motions with irregular times, and what sensors would report about them."""

import numpy as np

import symspline as ss

SO3 = ss.SpecialOrthogonal(3)
GRAVITY = np.array([0, 0, -9.80665])


def turning(end, rng, rate=0.5):
    """A smooth rotation as a curve on SO(3)."""
    t = np.linspace(0, end, 20 * int(end) + 21)
    phase = rng.uniform(0, 6, (3, 3))
    size = [0.8, 0.6, 0.4]
    v = sum(
        np.stack([s * np.sin(rate * (k + 1) * t + p) for s, p in zip(size, row, strict=True)], -1) / (k + 1)
        for k, row in enumerate(phase)
    )
    return ss.CubicSpline(t, ss.rotations.from_rotation_vectors(v), SO3, bc_type="not-a-knot")


def moving(end, rng):
    """A smooth path in metres."""
    t = np.linspace(0, end, 20 * int(end) + 21)
    a, b, c = rng.uniform(0.15, 0.6, (3, 3, 1)), rng.uniform(0, 6, (3, 3, 1)), rng.uniform(2, 20, (3, 3, 1))
    x = (c * np.sin(a * t + b)).sum(axis=0).T
    return ss.CubicSpline(t, x, "r:3", bc_type="not-a-knot")


def times(rng, start, end, n):
    """Irregular times with a repetition."""
    t = np.sort(rng.uniform(start, end, n))
    t[n // 2] = t[n // 2 - 1]
    return t


def walk(space, rng, n, step=0.2):
    """Points of a space, each near the one before."""
    points = [space.random_point(rng)]
    velocity = space.random_tangent(rng, points[0])
    for _ in range(n - 1):
        size = max(1.0, float(np.abs(velocity).max()))
        points.append(space.project(space.exp(points[-1], step * velocity / size)))
        velocity = space.random_tangent(rng, points[-1])
    return np.array(points)


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))

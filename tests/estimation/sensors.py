"""Motions with irregular times, and what sensors would report about them."""

from typing import NamedTuple

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


class Motion(NamedTuple):
    """The motion of a curve in a space at n times, with frames along it."""

    space: ss.Space
    p: np.ndarray
    v: np.ndarray
    a: np.ndarray
    frames: np.ndarray


def moved(motion, j, nu, step):
    """The motion after the derivative of order `nu` of the move has changed along the j-th vectors of the frames."""
    space, p, v, a, frames = motion
    vectors = frames[:, j]
    if nu == 2:
        return motion._replace(a=a + step * vectors)
    if nu == 1:
        return motion._replace(v=v + step * vectors)
    there = space.exp(p, step * vectors)
    turned = a + step * curvature(motion, vectors)
    return motion._replace(p=there, v=space.transport(p, there, v), a=space.transport(p, there, turned))


def curvature(motion, x):
    """R(x, u)u for the velocities u: −[u, [u, x]] on groups, and K (⟨u, u⟩x − ⟨x, u⟩u) for constant curvature."""
    space, p, u, *_ = motion
    if space == SO3:
        u, x = (np.swapaxes(p, -1, -2) @ own for own in (u, x))
        inner = u @ x - x @ u
        return -p @ (u @ inner - inner @ u) / 4
    if isinstance(space, ss.Sphere):
        each = (slice(None), None)
        return (u * u).sum(-1)[each] * x - (u * x).sum(-1)[each] * u
    return np.zeros_like(x)

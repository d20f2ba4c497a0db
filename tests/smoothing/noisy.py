"""Noisy data that the tests share."""

import numpy as np

import symspline as ss


def truth(space, seed=0, segments=6, step=0.6, end=10.0):
    """A smooth curve with random directions."""
    rng = np.random.default_rng(seed)
    points = [space.random_point(rng)]
    for _ in range(segments):
        v = space.random_tangent(rng, points[-1])
        points.append(space.exp(points[-1], v * step / np.sqrt(space.inner(points[-1], v, v))))
    return ss.CubicSpline(np.linspace(0, end, segments + 1), np.array(points), space)


def beside(space, points, sigma, seed=0):
    """Points with noise."""
    rng = np.random.default_rng(1000 + seed)
    return space.exp(points, sigma * space.random_tangent(rng, points))


def example(name, sigma=0.1, n=60, seed=0, **options):
    """Space, times, noisy points and the true ones."""
    space = ss.space(name)
    t = np.linspace(0, 10, n)
    points = truth(space, seed, **options)(t)
    return space, t, beside(space, points, sigma, seed), points


def rms(space, p, q):
    """Root mean squared distance."""
    return np.sqrt(np.mean(space.distance(p, q) ** 2, axis=-1))


def each(value):
    """One value, or those of the parts of a product or of poses."""
    return value if isinstance(value, tuple) else (value,)

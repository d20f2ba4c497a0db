"""Crystal orientations as people record them: smooth motions, noise, and representatives at random."""

import numpy as np

import symspline as ss

SO3 = ss.SpecialOrthogonal(3)
CUBIC = ss.Quotient("so:3", "432")


def path(t):
    """Orientations of a smooth motion that turns by about 200 degrees in unit time."""
    t = np.asarray(t)
    vectors = np.stack([1.9 * np.sin(1.3 * t), 1.1 * np.cos(2 * t) - 1.1, 2.3 * t**2 - 0.4 * t], axis=-1)
    return ss.rotations.from_rotation_vectors(vectors)


def noisy(points, sigma, rng):
    noise = sigma * rng.standard_normal((*points.shape[:-2], 3))
    return points @ ss.rotations.from_rotation_vectors(noise)


def at_random(space, points, rng):
    """Replace points by random representatives."""
    lead = points.shape[: points.ndim - len(space.point_shape)]
    return space._moved_by(points, rng.integers(0, space._group.size, lead))


def brute_distance(p, q, left, right):
    """The smallest angle between p and the products of elements, from logarithms of SciPy."""
    from scipy.spatial.transform import Rotation

    each = [Rotation.from_matrix(np.swapaxes(p, -1, -2) @ g @ q @ h).magnitude() for g in left for h in right]
    return np.min(each, axis=0)

"""SO(4) is the product of two spheres of quaternions, up to sign."""

import numpy as np
import pytest
from cases import EPS, walk

import symspline as ss

SEED = 1729


def quaternion_product(a, b):
    return np.stack(
        [
            a[..., 0] * b[..., 0] - np.sum(a[..., 1:] * b[..., 1:], axis=-1),
            *np.moveaxis(a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:]), -1, 0),
        ],
        axis=-1,
    )


def turn_in_four(a, b):
    """The rotation q → a q b̄ of R⁴."""
    b = b * [1, -1, -1, -1]
    images = [quaternion_product(quaternion_product(a, e), b) for e in np.eye(4)]
    return np.stack(np.broadcast_arrays(*images), axis=-1)


@pytest.mark.parametrize("ends", ["natural", "not-a-knot"])
def test_so4_is_two_quaternions(ends, rng):
    space, product = ss.SpecialOrthogonal(4), ss.Product(ss.Sphere(3), ss.Sphere(3))
    a, b = walk(ss.Sphere(3), 0.5, 12, rng), walk(ss.Sphere(3), 0.7, 12, rng)
    p = turn_in_four(a, b)
    # The angles of the rotation are the sum and the difference of those of the quaternions.
    angles = np.hypot(ss.Sphere(3).distance(a[1:], a[:-1]), ss.Sphere(3).distance(b[1:], b[:-1]))
    assert np.abs(space.distance(p[1:], p[:-1]) - np.sqrt(2) * angles).max() <= 20 * EPS
    t = np.cumsum(rng.uniform(0.7, 1.3, 12))
    one, other = (
        ss.CubicSpline(t, points, where, bc_type=ends, tol=0.0) for points, where in ((p, space), ((a, b), product))
    )
    x = np.linspace(t[0], t[-1], 80)
    assert np.abs(one(x) - turn_in_four(*other(x))).max() <= 50 * EPS
    for nu in (1, 2):
        norm = np.sqrt(2) * product.norm(other(x), other(x, nu))
        assert np.abs(space.norm(one(x), one(x, nu)) - norm).max() <= 1000 * EPS

"""exp, log, geodesic and distance of subspaces of large spaces, computed in the span of two points."""

import numpy as np
import pytest
from cases import loop_over

import symspline as ss

SEED = 1000
N = 300


def isometry(space, m, rng):
    """An isometry of m dimensions into those of a space."""
    x = rng.normal(size=(space.point_shape[0], m))
    if space.dtype == complex:
        x = x + 1j * rng.normal(size=x.shape)
    return np.linalg.qr(x)[0]


@pytest.mark.parametrize("rank", [3, 2, 1, 0])
@loop_over("size", [1.2, 1e-3, 1e-9])
@pytest.mark.parametrize("kind", [ss.Grassmannian, ss.ComplexGrassmannian])
def test_large_spaces_hold_small_ones(kind, size, rank, rng):
    small, large = kind(3, 8), kind(3, N)
    p = small.random_point(rng, 4)
    v = small.random_tangent(rng, p)
    v[..., rank:] = 0
    v *= size / np.maximum(small.norm(p, v), 1e-300)[:, None, None]
    q = small.exp(p, v)
    up = isometry(large, 8, rng)
    assert np.abs(large.exp(up @ p, up @ v) - up @ q).max() < 2e-15
    # Points carry 1e-16, and what leads from one to the other no less.
    log = large.log(up @ p, up @ q)
    assert np.abs(log - up @ small.log(p, q)).max() < 1e-15
    # Along p there is nothing, however short it is.
    assert np.abs(np.swapaxes((up @ p).conj(), -1, -2) @ log).max() < 1e-15 * size
    assert np.abs(large.distance(up @ p, up @ q) - small.distance(p, q)).max() < 2e-15
    t = np.linspace(-0.5, 1.5, 5)[:, None]
    assert np.abs(large.geodesic(up @ p, up @ q, t) - up @ small.geodesic(p, q, t)).max() < 2e-15

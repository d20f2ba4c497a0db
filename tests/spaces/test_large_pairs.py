"""exp, log, geodesic and distance of subspaces of large spaces, computed in the span of two points."""

import numpy as np
import pytest
from cases import loop_over
from refused import raises

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


def test_leading_axes_broadcast(rng):
    space = ss.Grassmannian(2, N)
    p, q = space.random_point(rng, (3, 1)), space.random_point(rng, (2,))
    v = space.log(p, q)
    assert v.shape == (3, 2, N, 2)
    assert np.array_equal(v[2, 1], space.log(p[2, 0], q[1]))
    assert space.geodesic(p, q, np.zeros((4, 1, 1))).shape == (4, 3, 2, N, 2)


@pytest.mark.parametrize("k", [127, 128, 150, 250])
def test_more_than_half_of_the_dimensions(k, rng):
    space = ss.Grassmannian(k, 256)
    p = space.random_point(rng)
    v = space.random_tangent(rng, p)
    v *= 1.2 / space.norm(p, v)
    q = space.exp(p, v)
    space.check_point(q)
    assert np.abs(space.log(p, q) - v).max() < 1e-14
    assert space.distance(p, q) == pytest.approx(1.2, rel=1e-14)


def test_errors_are_those_of_small_spaces():
    space, one, e = ss.Grassmannian(2, N), np.eye(N, 2), np.eye(N)
    raises("pair 1", space.log, one, np.stack([one, e[:, [0, 2]], one]), error=ss.CutLocusError)
    with pytest.raises(ss.ValidationError, match=r"exp of row \[1\] is not finite"):
        space.exp(np.stack([one, one]), np.stack([0 * one, np.full((N, 2), np.nan)]))
    with pytest.raises(ss.ValidationError, match=r"do not broadcast: p \(2, 300, 2\), v \(3, 300, 2\)"):
        space.exp(np.zeros((2, N, 2)), np.zeros((3, N, 2)))

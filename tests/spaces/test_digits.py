"""Rounding errors of projections, of random points, and of large matrices."""

import numpy as np
import pytest
from cases import EPS, condition, loop_over, unit_tangent, walk

import symspline as ss


@pytest.mark.parametrize("name", ["so:2", "so:3", "so:5", "o:4", "u:3", "su:3", "gr:2,5", "cgr:2,4", "rp:3", "cp:2"])
def test_projection_is_the_nearest_point(name, rng):
    space = ss.space(name)
    for size in (1e-6, 1e-2, 0.15):
        p = space.random_point(rng)
        noise = rng.standard_normal(p.shape)
        if p.dtype.kind == "c":
            noise = noise + 1j * rng.standard_normal(p.shape)
        x = (1.2 if size > 0.1 else 1.0) * p + size * noise
        u, _, w = np.linalg.svd(x.reshape(len(x), -1), full_matrices=False)
        nearest = (u @ w).reshape(p.shape)
        if name.startswith("su"):
            nearest = nearest * np.exp(-1j * np.angle(np.linalg.det(nearest)) / len(p))
        assert np.abs(space.project(x) - nearest).max() <= 20 * EPS


@pytest.mark.parametrize("name", ["gr:3,8", "cgr:3,8", "so:8", "u:8", "su:8", "rp:7"])
def test_random_points_are_on_the_space_to_rounding(name, rng):
    space = ss.space(name)
    x = space.random_point(rng, 200)
    x = x[..., None] if x.ndim == 2 else x
    assert np.abs(x.conj().swapaxes(-1, -2) @ x - np.eye(x.shape[-1])).max() <= 20 * EPS


@loop_over("length", [1e-6, 0.3, 1.4])
@pytest.mark.parametrize("name", ["so:11", "u:11", "su:13", "spd:11", "hpd:11", "gr:11,23", "cgr:11,22", "gr:5,31"])
def test_large_matrices_of_odd_size(name, length, rng):
    """Products of large matrices go by blocks of columns, which need not divide their number."""
    space = ss.space(name)
    p = walk(space, 0.1, 1, rng)[0]
    v = length * unit_tangent(space, p, rng)
    q = space.exp(p, v)
    space.check_point(q)
    allowed = 200 * EPS * condition(space, [p, q])
    assert np.abs(space.log(p, q) - v).max() <= allowed
    assert abs(space.distance(p, q) - length) <= allowed
    assert abs(space.norm(q, space.transport(p, q, v)) - length) <= allowed


def test_rounding_of_points():
    """|p|², the condition, |p|, and 1 or more."""
    far = ss.Hyperbolic(1).exp([1.0, 0.0], [[0.0, 5.0], [0.0, 0.0]])
    assert ss.Hyperbolic(1)._rounding(far) == pytest.approx([np.cosh(10), 1.0], rel=1e-12)
    for space in (ss.SymmetricPositiveDefinite(2), ss.HermitianPositiveDefinite(2)):
        assert space._rounding(np.diag([1e-3, 10.0])) == pytest.approx(10.001 * 1000.1, rel=1e-12)
    assert ss.Euclidean(1)._rounding([[-7.0], [0.3]]).tolist() == [7.0, 1.0]
    assert (ss.Sphere(2)._rounding(np.eye(3)) == 1.0).all()
    pair = ss.space("r:1 x h:1")
    assert pair._rounding(([3.0], [1.25, 0.75])) == 3.0

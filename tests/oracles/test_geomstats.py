"""The geometry against geomstats, by exp, log, distance, inner product and parallel transport.

Run by ``make test-oracles``, in an environment of its own: geomstats needs an older NumPy.
"""

import numpy as np
import pytest
from cases import base_point, unit_tangent
from geomstats.geometry.grassmannian import Grassmannian
from geomstats.geometry.hpd_matrices import HPDMatrices
from geomstats.geometry.hyperbolic import Hyperbolic
from geomstats.geometry.hypersphere import Hypersphere
from geomstats.geometry.invariant_metric import BiInvariantMetric
from geomstats.geometry.spd_matrices import SPDMatrices
from geomstats.geometry.special_euclidean import SpecialEuclidean
from geomstats.geometry.special_orthogonal import SpecialOrthogonal

import symspline as ss

SEED = 2024

LENGTHS = [1e-3, 0.1, 0.7, 1.4]


def bi_invariant(n):
    group = SpecialOrthogonal(n, equip=False)
    group.equip_with_metric(BiInvariantMetric)
    return group


# Name, their space, their length divided by ours, and the tolerance: their arc cosines lose half the digits
# of small distances.
SPACES = [
    ("sphere:2", Hypersphere(2), 1.0, 1e-7),
    ("sphere:5", Hypersphere(5), 1.0, 1e-7),
    ("hyperbolic:2", Hyperbolic(2), 1.0, 1e-7),
    ("hyperbolic:4", Hyperbolic(4), 1.0, 1e-7),
    ("gr:2,5", Grassmannian(5, 2), np.sqrt(2), 1e-10),
    ("gr:1,3", Grassmannian(3, 1), np.sqrt(2), 1e-10),
    ("gr:3,4", Grassmannian(4, 3), np.sqrt(2), 1e-10),
    ("so:2", bi_invariant(2), 1.0, 1e-10),
    ("so:3", bi_invariant(3), 1.0, 1e-10),
    ("so:4", bi_invariant(4), 1.0, 1e-10),
    ("spd:2", SPDMatrices(2), 1.0, 1e-10),
    ("spd:4", SPDMatrices(4), 1.0, 1e-10),
    ("hpd:3", HPDMatrices(3), 1.0, 1e-10),
]
every = pytest.mark.parametrize(("name", "theirs", "scale", "tol"), SPACES, ids=[row[0] for row in SPACES])


@every
@pytest.mark.parametrize("length", LENGTHS)
def test_geometry_is_that_of_geomstats(name, theirs, scale, tol, length, rng):
    space, metric = ss.space(name), theirs.metric
    for _ in range(5):
        p = base_point(space, rng)
        v, w = length * unit_tangent(space, p, rng), unit_tangent(space, p, rng)
        q, product = space.exp(p, v), scale**2 * space.inner(p, v, w)
        moved = space.transport(p, q, w)
        if isinstance(space, ss.Grassmannian):
            # Points are projectors there, with tr uv, which is twice the metric.
            moved, v, w = (u @ y.T + y @ u.T for y, u in ((q, moved), (p, v), (p, w)))
            p, q = p @ p.T, q @ q.T
        assert np.abs(metric.exp(v, p) - q).max() <= tol
        assert np.abs(metric.log(q, p) - v).max() <= tol
        assert metric.dist(p, q) == pytest.approx(scale * length, abs=tol)
        assert metric.inner_product(v, w, p) == pytest.approx(product, abs=tol)
        assert np.abs(metric.parallel_transport(w, p, direction=v) - moved).max() <= tol


@pytest.mark.parametrize("n", [2, 3])
def test_screw_motions_are_those_of_geomstats(n, rng):
    """Of the group of poses, whose exponential is that of the Cartan–Schouten connection."""
    space, group = ss.SpecialEuclidean(n), SpecialEuclidean(n, equip=False)
    for length in LENGTHS:
        p = base_point(space, rng)
        v = length * unit_tangent(space, p, rng)
        q = space.exp(p, v)
        assert np.abs(group.exp(v, p) - q).max() <= 1e-10
        assert np.abs(group.log(q, p) - v).max() <= 1e-10


@pytest.mark.parametrize("n", [2, 4])
@pytest.mark.parametrize("distance", [1e-3, 1.0, 5.0])
def test_models_are_those_of_geomstats(n, distance, rng):
    space = ss.Hyperbolic(n)
    o = np.eye(n + 1)[0]
    x = space.exp(o, [distance * unit_tangent(space, o, rng) for _ in range(20)])
    ball, half = ss.convert.hyperboloid_to_ball(x), ss.convert.hyperboloid_to_half_space(x)
    change = Hyperbolic(n).change_coordinates_system
    assert np.abs(change(x, "extrinsic", "ball") - ball).max() <= 1e-12
    assert np.abs(change(x, "extrinsic", "half-space") - half).max() <= 1e-12 * half.max()
    assert np.abs(change(ball, "ball", "half-space") - half).max() <= 1e-10 * half.max()
    assert np.abs(change(half, "half-space", "ball") - ball).max() <= 1e-12


def test_quaternions_are_those_of_geomstats(rng):
    group = SpecialOrthogonal(3, point_type="vector", equip=False)
    r = ss.SpecialOrthogonal(3).random_point(rng, 50)
    ours, theirs = ss.rotations.as_quaternions(r, scalar_first=True), group.quaternion_from_matrix(r)
    assert np.minimum(np.abs(ours - theirs), np.abs(ours + theirs)).max() <= 1e-8
    assert np.abs(group.matrix_from_quaternion(ours) - r).max() <= 1e-12

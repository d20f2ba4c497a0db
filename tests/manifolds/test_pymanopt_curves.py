"""Manifolds of pymanopt."""

import numpy as np
import pytest
from made import jump, walk
from pymanopt import manifolds

import symspline as ss
from symspline.manifolds import from_pymanopt

RNG = np.random.default_rng(1)


@pytest.mark.parametrize(
    ("theirs", "ours", "scale"),
    [
        (manifolds.Sphere(3), ss.Sphere(2), 1.0),
        (manifolds.SymmetricPositiveDefinite(2), ss.SymmetricPositiveDefinite(2), 1.0),
        (manifolds.Grassmann(4, 2), ss.Grassmannian(2, 4), 1.0),
        (manifolds.ComplexGrassmann(3, 1), ss.ComplexGrassmannian(1, 3), 1.0),
    ],
    ids=["sphere", "spd", "grassmannian", "complex grassmannian"],
)
def test_the_curve_is_that_of_our_space(theirs, ours, scale):
    space = from_pymanopt(theirs)
    assert space.point_shape == ours.point_shape and space.dim == ours.dim and space.dtype == ours.dtype
    p = [ours.random_point(RNG)]
    for _ in range(4):
        v = ours.random_tangent(RNG, p[-1])
        p.append(ours.exp(p[-1], 0.4 * v / ours.norm(p[-1], v)))
    spline, core = ss.CubicSpline(None, np.array(p), space), ss.CubicSpline(None, np.array(p), ours)
    x = np.linspace(0, 4, 9)
    # Their logarithms are good to 1e-12 or so; and one array of a point of a quotient is not the other.
    assert ours.distance(ours.project(spline(x)), core(x)).max() <= 1e-10
    assert np.abs(spline.speed(x) - scale * core.speed(x)).max() <= 1e-9


def test_rotations_have_velocities_in_the_lie_algebra():
    space = from_pymanopt(manifolds.SpecialOrthogonalGroup(2))
    turns = np.array([0.0, 0.5, 0.7])
    p = np.stack(
        [np.stack([np.cos(turns), -np.sin(turns)], -1), np.stack([np.sin(turns), np.cos(turns)], -1)], -2
    )
    spline = ss.CubicSpline(None, p, space)
    flat = ss.CubicSpline(None, turns[:, None], "r:1")
    assert np.abs(spline.velocities[:, 1, 0] - flat.velocities[:, 0]).max() <= 1e-11
    assert np.abs(spline.velocities + np.swapaxes(spline.velocities, 1, 2)).max() <= 1e-15


def test_hyperbolic_space_as_a_ball():
    """Its arrays are no submanifold, and its metric depends on the point."""
    space = from_pymanopt(manifolds.PoincareBall(2))
    p = 0.5 * walk(ss.Sphere(2), 0.3, 6, 2)[:, :2]
    spline = ss.CubicSpline(None, p, space)
    hyperboloid = ss.CubicSpline(None, ss.convert.ball_to_hyperboloid(p), "h:2")
    x = np.linspace(0, 5, 11)
    assert np.abs(ss.convert.hyperboloid_to_ball(hyperboloid(x)) - spline(x)).max() <= 1e-10
    assert jump(spline) <= 1e-8


def test_the_state_of_random_numbers_is_left_alone():
    np.random.seed(5)  # noqa: NPY002
    expected = np.random.standard_normal()  # noqa: NPY002
    np.random.seed(5)  # noqa: NPY002
    from_pymanopt(manifolds.Sphere(3))
    assert np.random.standard_normal() == expected  # noqa: NPY002


def test_adapters_are_values():
    sphere = manifolds.Sphere(3)
    assert from_pymanopt(sphere) == from_pymanopt(sphere) != from_pymanopt(manifolds.Sphere(3))


@pytest.mark.parametrize(
    ("theirs", "what"),
    [
        (manifolds.Stiefel(5, 2), "has no log"),
        (manifolds.FixedRankEmbedded(4, 3, 2), "has no exp and no log"),
        (manifolds.Product([manifolds.Sphere(3), manifolds.Sphere(2)]), "make a symspline.Product"),
    ],
)
def test_what_cannot_be_taken(theirs, what):
    with pytest.raises(ss.ValidationError, match=what):
        from_pymanopt(theirs)


def test_a_space_without_a_metric():
    with pytest.raises(ss.ValidationError, match="has no metric"):
        ss.manifolds.from_geomstats(object())

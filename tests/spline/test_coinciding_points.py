"""Curves that stand still, pause, or hardly move."""

import numpy as np
import pytest
from cases import COMMON, EPS, walk
from curves import S2, each, every_common, largest_difference, points_on
from scipy.interpolate import CubicSpline as FlatSpline

import symspline as ss


@every_common
@pytest.mark.parametrize("bc_type", ["natural", "clamped", "not-a-knot", "periodic"])
@pytest.mark.parametrize("n", [2, 3, 4, 30])
def test_a_curve_that_stands_still(space, bc_type, n):
    p = each(lambda q: np.repeat(q, n, axis=0), points_on(space, 1))
    spline = ss.CubicSpline(None, p, space, bc_type=bc_type)
    assert spline.report.converged
    x = np.linspace(0, n - 1, 50)
    here = each(lambda q: q[0], p)
    assert largest_difference(spline(x), here) < 20 * EPS
    for nu in (1, 2):
        # Rounding of points, which the hyperboloid counts squared, over h or h².
        assert largest_difference(spline(x, nu=nu), each(np.zeros_like, here)) < 500 * EPS


@pytest.mark.parametrize("space", COMMON[:3], ids=str)
@pytest.mark.parametrize("size", [1e-9, 1e-12, 1e-15, 1e-100])
@pytest.mark.parametrize("bc_type", ["natural", "clamped", "not-a-knot"])
def test_points_a_hair_apart_are_as_in_flat_space(space, size, bc_type):
    rng = np.random.default_rng(3)
    p = points_on(space, 1)[0]
    t = np.array([0.0, 1, 1.5, 3, 4, 4.5])
    v = size * space.random_tangent(rng, np.broadcast_to(p, (6, *p.shape)))
    spline = ss.CubicSpline(t, space.exp(p, v), space, bc_type=bc_type)
    assert spline.report.converged
    flat, x = FlatSpline(t, v, bc_type=bc_type), np.linspace(0, 4.5, 30)
    # Curvature counts with size³; what is left is the rounding of points.
    assert largest_difference(spline(x), p + flat(x)) < 20 * EPS
    assert largest_difference(spline(x, nu=1), flat(x, 1)) < 200 * EPS


@every_common
def test_a_curve_that_pauses(space):
    q = points_on(space, 5)
    p = each(lambda a: a[[0, 1, 2, 2, 2, 2, 3, 4]], q)
    spline = ss.CubicSpline(None, p, space)
    assert spline.report.converged
    assert largest_difference(spline(spline.t), p) < 20 * EPS
    assert np.isfinite(spline.length()) and spline.length() > 4 * 0.69


def test_repeated_points_with_a_jump_between():
    p = np.repeat(np.eye(3), 3, axis=0)
    spline = ss.CubicSpline(None, p, S2)
    assert spline.report.converged and largest_difference(spline(spline.t), p) < 20 * EPS


@pytest.fixture
def rng():
    return np.random.default_rng(1815)


@pytest.mark.parametrize("ends", ["periodic", "clamped"])
@pytest.mark.parametrize("name", ["r:2", "sphere:2", "so:3", "su:2", "spd:2", "gr:2,5", "hyperbolic:2"])
def test_there_and_back_stands_still_at_every_knot(name, ends, rng):
    """All velocities are rounding errors then, and so is their defect."""
    space = ss.space(name)
    for step in (1e-3, 0.3, 1.0):
        p = walk(space, step, 2, rng)[[0, 1, 0]]
        report = ss.CubicSpline(None, p, space, bc_type=ends).report
        assert report.converged and report.residual <= 1e-12

"""Derivatives of grids against finite differences and against each other."""

import numpy as np
import pytest
from cases import REPRESENTATIVE, SINGLE, loop_over
from grids.grid_fields import Field, factors_of, inside, knots
from scipy.interpolate import RectBivariateSpline

import symspline as ss

H = 1e-4
NOT_PRODUCTS = [space for space in REPRESENTATIVE if not hasattr(space, "factors")][1::2]


def shifted(x, axis, h):
    return tuple(own + h * (k == axis) for k, own in enumerate(x))


def first_difference(space, grid, x, axis):
    """The central difference of points along an axis."""
    here = grid(x)
    ahead, behind = (space.log(here, grid(shifted(x, axis, h))) for h in (H, -H))
    return (ahead - behind) / (2 * H)


def second_difference(space, grid, x, order, axis):
    """The covariant central difference along an axis of a first derivative."""
    here, found = grid(x), []
    for h in (H, -H):
        at = shifted(x, axis, h)
        found.append(space.transport(grid(at), here, grid(at, order)))
    return (found[0] - found[1]) / (2 * H)


def make(space, symmetric=False, seed=20):
    rng = np.random.default_rng(seed)
    axes = knots(rng, 7), knots(rng, 6), knots(rng, 4)
    return ss.GridSpline(axes, Field(space, size=0.3).on(*axes), space, symmetric=symmetric), inside(rng, axes, 4)


@pytest.mark.parametrize("space", SINGLE, ids=str)
def test_first_derivatives_are_those_of_the_points(space):
    grid, x = make(space)
    for axis in range(3):
        order = tuple(int(k == axis) for k in range(3))
        expected = first_difference(space, grid, x, axis)
        assert np.abs(grid(x, order) - expected).max() < 1e-6 * max(1, np.abs(expected).max())
        single = tuple(own[:1] for own in x)
        assert np.abs(grid.grid(*single, nu=order)[0, 0, 0] - grid(x, order)[0]).max() < 1e-11


@pytest.mark.parametrize("space", NOT_PRODUCTS, ids=str)
@pytest.mark.parametrize("symmetric", [False, True])
@loop_over("nu", [(2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (1, 0, 1), (0, 1, 1)])
def test_second_derivatives_are_covariant(space, symmetric, nu):
    grid, x = make(space, symmetric)
    axis = nu.index(2) if 2 in nu else nu.index(1)
    order = tuple(n - (k == axis) for k, n in enumerate(nu))
    expected = second_difference(space, grid, x, order, axis)
    assert np.abs(grid(x, nu) - expected).max() < 2e-6 * max(1, np.abs(expected).max())


@pytest.mark.parametrize("symmetric", [False, True])
def test_products_have_the_derivatives_of_their_factors(symmetric):
    space = ss.space("so:3 x r:2")
    grid, x = make(space, symmetric)
    for nu in [(1, 0, 0), (0, 1, 1), (2, 0, 0)]:
        for k, factor in enumerate(factors_of(space)):
            alone = ss.GridSpline(grid.axes, grid.points[k], factor, symmetric=symmetric)
            assert np.array_equal(grid(x, nu)[k], alone(x, nu))


def test_flat_derivatives_are_those_of_scipy():
    rng = np.random.default_rng(21)
    axes = knots(rng, 9) * 100, knots(rng, 8) * 0.01
    points = rng.normal(size=(9, 8, 1))
    grid, expected = ss.GridSpline(axes, points, "r:1"), RectBivariateSpline(*axes, points[..., 0], s=0)
    x = (
        np.concatenate([inside(rng, axes, 20)[0], axes[0]]),
        np.concatenate([inside(rng, axes, 20)[1], axes[1], [0.005]]),
    )
    for nu in [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]:
        own = expected(*x, dx=nu[0], dy=nu[1], grid=False)
        assert np.abs(grid(x, nu)[:, 0] - own).max() < 1e-9 * np.abs(own).max()


def test_outer_products_have_the_same_derivatives():
    rng = np.random.default_rng(22)
    axes = knots(rng, 9), knots(rng, 8)
    points = Field(ss.space("so:3")).on(*axes)
    points[-1] = points[0]
    grid = ss.GridSpline(axes, points, "so:3", bc_type=("periodic", "natural"))
    x = np.concatenate([rng.uniform(-1, 2, 5), axes[0]]), np.concatenate([rng.uniform(0, 1, 4), axes[1]])
    for nu in [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]:
        pairs = grid(tuple(own.ravel() for own in np.meshgrid(*x, indexing="ij")), nu)
        outer = grid.grid(*x, nu=nu).reshape(pairs.shape)
        assert np.abs(outer - pairs).max() < 1e-9 * np.abs(outer).max()


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("nu", [(0, 0), (0, 1), (2, 0), (1, 1)])
def test_derivatives_repeat_with_the_period(nu, symmetric):
    rng = np.random.default_rng(23)
    axes = 0.7 + 2 * knots(rng, 9), knots(rng, 6)
    points = rng.normal(size=(9, 6, 2))
    points[-1] = points[0]
    grid = ss.GridSpline(axes, points, "r:2", bc_type=("periodic", "natural"), symmetric=symmetric)
    u, v = np.array([0.8, 1.33, 2.6]), np.array([0.2, 0.5, 0.9])
    first = grid((u, v), nu)
    for turns in (-1, 1, 3):
        assert np.abs(grid((u + 2 * turns, v), nu) - first).max() < 1e-8 * np.abs(first).max()


def test_derivatives_continue_outside():
    grid, _ = make(ss.Sphere(2))
    x = (np.array([1.05, 0.5]), np.array([0.5, -0.04]), np.array([0.5, 1.03]))

    def continued(at, nu=None):
        return grid(at, nu, extrapolate=True)

    for axis in range(3):
        order = tuple(int(k == axis) for k in range(3))
        expected = first_difference(ss.Sphere(2), continued, x, axis)
        assert np.abs(continued(x, order) - expected).max() < 1e-6 * np.abs(expected).max()
        twice = tuple(2 * n for n in order)
        expected = second_difference(ss.Sphere(2), continued, x, order, axis)
        assert np.abs(continued(x, twice) - expected).max() < 1e-5 * np.abs(expected).max()

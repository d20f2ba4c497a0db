"""Grids of points with equivalent representatives."""

import warnings

import numpy as np
import pytest
from grids.grid_fields import Field, inside, knots

import symspline as ss

SO3, CUBIC = ss.space("so:3"), ss.space("so:3/432")


def shuffled(rng, points):
    """The same orientations by other representatives."""
    group = ss.rotations.point_group("432")
    return points @ group[rng.integers(0, 24, points.shape[:-2])]


def test_equivalent_representatives_give_the_same_grid():
    rng = np.random.default_rng(40)
    axes = knots(rng, 9), knots(rng, 8)
    points = Field(SO3).on(*axes)
    given = shuffled(rng, points)
    given[4, 3] = points[4, 3] = np.nan
    grid, expected = ss.GridSpline(axes, given, CUBIC), ss.GridSpline(axes, points, "so:3")
    x = inside(rng, axes, 40)
    found, there = grid(x), expected(x)
    known = np.isfinite(there[:, 0, 0])
    assert np.array_equal(np.isfinite(found[:, 0, 0]), known)
    assert CUBIC.distance(found[known], there[known]).max() < 1e-12
    assert np.array_equal(grid.points[0, 0], given[0, 0])
    assert grid.space == CUBIC
    speeds = [np.linalg.norm(own(x, (1, 0))[known], axis=(1, 2)) for own in (grid, expected)]
    assert np.abs(speeds[0] - speeds[1]).max() < 1e-10
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        naive = ss.GridSpline(axes, given, "so:3", on_failure="ignore")(x)
    known &= np.isfinite(naive[:, 0, 0])
    assert np.median(CUBIC.distance(naive[known], there[known])) > 0.1


def test_products_have_quotients_as_factors():
    rng = np.random.default_rng(41)
    axes = knots(rng, 6), knots(rng, 5)
    points, offsets = Field(SO3).on(*axes), rng.normal(size=(6, 5, 3))
    grid = ss.GridSpline(axes, (shuffled(rng, points), offsets), "so:3/432 x r:3", symmetric=True)
    turn, offset = grid(inside(rng, axes, 5))
    assert turn.shape == (5, 3, 3)
    assert offset.shape == (5, 3)


def test_a_loop_with_a_defect_is_reported_with_its_nodes():
    """Around the centre of a disclination, an axis returns with the opposite sign."""
    u = np.linspace(-1, 1, 8)
    angle = np.arctan2(u[:, None], u) / 2
    axes = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    with pytest.warns(UserWarning, match=r"\(3, 3\) – \(4, 3\) – \(4, 4\) – \(3, 4\)"), warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.filterwarnings("ignore", category=ss.ConvergenceWarning)
        ss.GridSpline((u, u), axes, ss.Quotient("sphere:2", [1, -1]), on_failure="ignore")

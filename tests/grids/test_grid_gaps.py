"""Missing nodes: runs of rows, isolated nodes, and what a missing node changes."""

import numpy as np
import pytest
from grids.grid_fields import Field, knots
from refused import raises

import symspline as ss
from symspline._grid.axes import Sites
from symspline._grid.evaluation import ManifoldGrid

SO3 = ss.space("so:3")


def holes(rng, shape, share, periodic):
    """Random missing nodes, the same at both ends of periodic axes."""
    missing = rng.uniform(size=shape) < share
    for k in np.flatnonzero(periodic):
        first = np.take(missing, 0, axis=k)
        np.moveaxis(missing, k, 0)[-1] = first
    return missing


@pytest.mark.parametrize(
    "bc_type", ["not-a-knot", "natural", "clamped", (("natural", "clamped"), ("clamped", "natural"))]
)
@pytest.mark.parametrize("share", [0.05, 0.2, 0.5])
def test_gaps_divide_rows_into_runs(bc_type, share):
    """The compiled loops against those for manifolds, which fit each run by itself."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        axes = knots(rng, rng.integers(3, 9)), knots(rng, rng.integers(2, 9))
        points = Field(SO3, seed, size=0.2).on(*axes)
        points[holes(rng, points.shape[:2], share, (False, False))] = np.nan
        if np.isnan(points).all():
            continue
        grid = ss.GridSpline(axes, points, SO3, bc_type=bc_type)
        x = [np.concatenate([rng.uniform(0, 1, 6), t]) for t in axes]
        found = grid.grid(*x)
        expected, *_ = ManifoldGrid(SO3, grid._axes, grid.points).run(Sites(x, True, ["continue"] * 2), None, 0, None)
        assert np.array_equal(np.isnan(found), np.isnan(expected))
        assert np.nanmax(np.abs(found - expected), initial=0) < 1e-13
        # Values at the nodes are the nodes.
        assert np.nanmax(np.abs(found[6:, 6:] - points), initial=0) < 1e-13
        assert np.array_equal(np.isnan(found[6:, 6:]), np.isnan(points))


@pytest.mark.parametrize("bc_type", ["not-a-knot", ("periodic", "natural"), ("natural", "periodic"), "periodic"])
@pytest.mark.parametrize("share", [0.0, 0.3])
def test_scattered_coordinates_see_the_same_gaps(bc_type, share):
    periodic = [word == "periodic" for word in ([bc_type] * 2 if isinstance(bc_type, str) else bc_type)]
    for seed in range(1):
        rng = np.random.default_rng(100 + seed)
        axes = knots(rng, rng.integers(4, 10)), knots(rng, rng.integers(4, 20))
        points = Field(SO3, seed, size=0.2).on(*axes)
        for k in np.flatnonzero(periodic):
            np.moveaxis(points, k, 0)[-1] = np.take(points, 0, axis=k)
        points[holes(rng, points.shape[:2], share, periodic)] = np.nan
        grid = ss.GridSpline(axes, points, SO3, bc_type=bc_type)
        x = [np.concatenate([rng.uniform(0, 1, 5), t]) for t in axes]
        for nu in [None, (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]:
            outer = grid.grid(*x, nu=nu).reshape(-1, 3, 3)
            chosen = rng.choice(len(outer), 40)
            pairs = grid(tuple(own.ravel()[chosen] for own in np.meshgrid(*x, indexing="ij")), nu)
            outer = outer[chosen]
            assert np.array_equal(np.isnan(outer), np.isnan(pairs))
            size = np.nanmax(np.abs(outer), initial=1)
            assert np.nanmax(np.abs(outer - pairs), initial=0) < (1e-12 if nu is None else 1e-8) * size


def test_a_run_across_the_ends_of_a_periodic_axis_is_one_run():
    rng = np.random.default_rng(1)
    t = knots(rng, 12)
    points = rng.normal(size=(12, 1))
    points[-1] = points[0]
    points[[4, 5]] = np.nan
    grid = ss.GridSpline((t,), points, "r:1", bc_type="periodic")
    turned = np.concatenate([t[6:], t[1:4] + t[-1] - t[0]])
    expected = ss.CubicSpline(turned, np.concatenate([points[6:], points[1:4]]), "r:1", bc_type="not-a-knot")
    x = rng.uniform(turned[0], turned[-1], 50)
    assert np.abs(grid(x) - expected(x)).max() < 1e-13
    assert np.isnan(grid(rng.uniform(t[3] + 1e-9, t[6] - 1e-9, 9))).all()


@pytest.mark.parametrize("gap", [1, -2])
def test_the_first_node_of_a_periodic_axis_beside_a_gap_belongs_to_the_run_on_its_other_side(gap):
    rng = np.random.default_rng(2)
    t = 5 + knots(rng, 9)
    points = rng.normal(size=(9, 1))
    points[-1] = points[0]
    points[gap] = np.nan
    grid = ss.GridSpline((t,), points, "r:1", bc_type="periodic")
    run = slice(2, 9) if gap == 1 else slice(0, 7)
    alone = ss.CubicSpline(t[run], points[run], "r:1", bc_type="not-a-knot")
    for nu in range(3):
        expected = alone(t[-1] if gap == 1 else t[0], nu)
        assert np.abs(grid(t[[0, -1]], nu) - expected).max() < 1e-11 * max(1, abs(expected[0]))


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("nu", [(0, 0), (1, 0), (2, 0), (1, 1)])
def test_the_last_node_before_a_gap_belongs_to_its_run(nu, symmetric):
    rng = np.random.default_rng(4)
    u, v = 0.3 + knots(rng, 9), knots(rng, 6)
    points = rng.normal(size=(9, 6, 2))
    points[5] = np.nan
    grid, run = (
        ss.GridSpline((t, v), points[: len(t)], "r:2", bc_type="not-a-knot", symmetric=symmetric) for t in (u, u[:5])
    )
    x = (u[[4, 4]], np.array([0.2, 0.7]))
    expected = run(x, nu)
    assert np.abs(grid(x, nu) - expected).max() < 1e-8 * np.abs(expected).max()


def test_periodic_axes_of_manifolds_made_of_functions_repeat():
    space, rng = ss.Stiefel(2, 4), np.random.default_rng(0)
    base = np.broadcast_to(space.random_point(rng), (9, 4, 4, 2))
    points = space.exp(base, 0.2 * space.random_tangent(rng, base))
    points[-1] = points[0]
    points[4] = np.nan
    axes = np.linspace(0.7, 2.7, 9), np.linspace(0, 1, 4)
    grid = ss.GridSpline(axes, points, space, bc_type=("periodic", "natural"))
    u, v = np.array([0.8, 1.1, 2.3, 2.6]), np.array([0.2, 0.5, 0.9, 0.1])
    first = grid((u, v))
    assert np.isfinite(first).all()
    for turns in (-1, 1, 3):
        assert np.abs(grid((u + 2 * turns, v)) - first).max() < 1e-12


def test_an_isolated_node_has_a_point_and_no_derivative():
    points = np.arange(15.0).reshape(5, 3, 1)
    points[[1, 3], :] = np.nan
    grid = ss.GridSpline((None, None), points, "r:1")
    assert np.abs(grid((2.0, 1.5)) - 7.5).max() < 1e-13
    assert np.isnan(grid((2.0, 1.5), (1, 0))).all()
    assert np.abs(grid((2.0, 1.5), (0, 1)) - 1).max() < 1e-13
    assert np.isnan(grid((2.1, 1.5))).all()


def test_a_missing_node_changes_only_what_its_rows_and_columns_demand():
    """Values are NaN between the neighbours of a missing node, and there only; elsewhere its influence decays."""
    rng = np.random.default_rng(2)
    axes = np.arange(41.0), np.arange(41.0)
    points = Field(SO3, size=0.3).on(axes[0] / 40, axes[1] / 40)
    whole = ss.GridSpline(axes, points, SO3)
    gap = points.copy()
    gap[20, 20] = np.nan
    grid = ss.GridSpline(axes, gap, SO3)
    x = np.sort(rng.uniform(0, 40, (2, 120)))
    found, before = grid.grid(*x), whole.grid(*x)
    missing = np.isnan(found).all(axis=(2, 3))
    near = [np.abs(own - 20) < 1 for own in x]
    assert np.array_equal(missing, near[0][:, None] & near[1][None])
    change = np.abs(found - before).max(axis=(2, 3))
    far = (np.abs(x[0] - 20) > 15)[:, None] | (np.abs(x[1] - 20) > 15)[None]
    assert np.nanmax(change[far & ~missing]) < 1e-14
    assert 1e-9 < np.nanmax(change) < 1e-6


def test_a_failed_row_is_missing_for_the_next_axis():
    points = Field(ss.Sphere(2)).on(np.linspace(0, 1, 6), np.linspace(0, 1, 5))
    points[3, 2] = -points[2, 2]
    raises(
        r"points\[2, 2\] and points\[3, 2\]", ss.GridSpline, (None, None), points, "sphere:2", error=ss.CutLocusError
    )
    with pytest.warns(ss.ConvergenceWarning, match="along axis 0"):
        grid = ss.GridSpline((None, None), points, "sphere:2", on_failure="warn")
    assert not grid.report.converged
    found = grid.grid(np.linspace(0, 5, 11), np.linspace(0, 4, 9))
    # The points at the nodes of the first axis do not depend on the failed row.
    assert np.isnan(found[1::2, 3:6]).all()
    alone = ss.CubicSpline(None, points[1], "sphere:2", bc_type="not-a-knot")
    np.testing.assert_allclose(found[2], alone(np.linspace(0, 4, 9)), atol=1e-14)
    assert np.isfinite(found[:, :3]).all()


def test_errors_of_symmetric_grids_name_the_axis():
    """Neighbours along axis 0 are antipodal half-way along axis 1: the order of axes in which it is the last one."""
    a = 0.5
    points = [[[np.cos(a), np.sin(a), 0], [np.cos(a), -np.sin(a), 0]], [[-1.0, 0, 0]] * 2]
    grid = ss.GridSpline((None, None), points, "sphere:2", symmetric=True)
    raises("along axis 0", grid, (0.5, 0.5), error=ss.CutLocusError)


def test_values_at_nodes_do_not_depend_on_rows_that_fail():
    """Directions of two columns that are opposite to each other half-way along the first axis."""
    points = np.radians([[[0.0], [170]], [[0.0], [190]]])
    grid = ss.GridSpline(([0, 1], [0, 1]), points, "torus:1")
    np.testing.assert_allclose(np.degrees(grid((0.5, 1.0))) % 360, 180, atol=1e-12)
    assert grid((0.5, 0.0)) == 0
    np.testing.assert_allclose(np.degrees(grid.grid([0.5], [0, 1]))[0, :, 0] % 360, [0, 180], atol=1e-12)
    np.testing.assert_allclose(
        np.degrees(grid((np.array([0.5, 0.25]), np.array([1.0, 0.5]))))[:, 0] % 360, [180, 87.5], atol=1e-12
    )
    for at in ((0.5, 0.5), (0.5, 0.999)):
        raises(r"points\[0\] and points\[1\] of a row along axis 1", grid, at, error=ss.CutLocusError)
    with pytest.raises(ss.CutLocusError):
        grid((0.5, 1.0), nu=(0, 1))
    loose = ss.GridSpline(([0, 1], [0, 1]), points, "torus:1", on_failure="ignore")
    found = np.degrees(loose.grid([0.25, 0.5], [0, 0.5, 1]))[..., 0]
    np.testing.assert_allclose(found % 360, [[0, 87.5, 175], [0, np.nan, 180]], atol=1e-12)

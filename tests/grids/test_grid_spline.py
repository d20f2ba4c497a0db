"""Values of grids: the definition, flat space, convergence, windows and the order of axes."""

import numpy as np
import pytest
from cases import REPRESENTATIVE, SINGLE, SPACES
from grids.grid_fields import Field, apart, inside, knots
from refused import raises
from scipy.interpolate import RectBivariateSpline, make_interp_spline

import symspline as ss


def by_definition(axes, points, space, x, bc_type="not-a-knot"):
    """Splines along each axis in turn, on an outer product of coordinates."""
    for k, (t, own) in enumerate(zip(axes, x, strict=True)):
        rows = np.ascontiguousarray(np.moveaxis(points, k, len(axes) - 1))
        values = ss.CubicSpline(t, rows, space, bc_type=bc_type)(own)
        points = np.moveaxis(values, len(axes) - 1, k)
    return points


@pytest.mark.parametrize("space", SPACES, ids=str)
def test_the_grid_passes_through_its_points(space):
    rng = np.random.default_rng(1)
    axes = knots(rng, 7), knots(rng, 5)
    points = Field(space).on(*axes)
    grid = ss.GridSpline(axes, points, space)
    assert np.max(apart(space, grid.grid(*axes), points)) < 1e-13
    assert np.max(apart(space, grid(tuple(np.meshgrid(*axes, indexing="ij"))), points)) < 1e-13


@pytest.mark.parametrize("space", SINGLE, ids=str)
def test_the_grid_is_splines_along_each_axis_in_turn(space):
    rng = np.random.default_rng(2)
    axes = knots(rng, 6), knots(rng, 5), knots(rng, 4)
    points = Field(space).on(*axes)
    x = inside(rng, axes, 3)
    grid = ss.GridSpline(axes, points, space)
    expected = by_definition(axes, points, space, x)
    assert np.max(apart(space, grid.grid(*x), expected)) < 1e-13
    scattered = grid(tuple(np.stack(np.meshgrid(*x, indexing="ij")).reshape(3, -1)))
    assert np.max(apart(space, scattered.reshape(expected.shape), expected)) < 1e-13


def test_the_report_has_the_largest_residual_and_the_longest_steps():
    rng = np.random.default_rng(2)
    axes = 0.3 + knots(rng, 8), 2 * knots(rng, 6)
    points = Field(ss.Sphere(2), size=0.8).on(*axes)
    report = ss.GridSpline(axes, points, "sphere:2").report
    rows = ss.CubicSpline(axes[0], points.swapaxes(0, 1), "sphere:2", bc_type="not-a-knot")
    assert 0 < report.residual == rows.report.residual.max()
    along = [ss.Sphere(2).distance(p[1:], p[:-1]).max() for p in (points, points.swapaxes(0, 1))]
    assert report.max_step == pytest.approx(along, rel=1e-14)


@pytest.mark.parametrize(
    "bc_type", ["natural", "clamped", ("not-a-knot", "natural"), (("natural", "clamped"), "natural")]
)
def test_end_conditions_belong_to_axes(bc_type):
    rng = np.random.default_rng(3)
    axes = knots(rng, 8), knots(rng, 6)
    points = Field(ss.Sphere(2)).on(*axes)
    x = inside(rng, axes, 5)
    grid = ss.GridSpline(axes, points, "sphere:2", bc_type=bc_type)
    first, second = (bc_type, bc_type) if isinstance(bc_type, str) else bc_type
    rows = ss.CubicSpline(axes[0], points.swapaxes(0, 1), "sphere:2", bc_type=first)(x[0])
    expected = ss.CubicSpline(axes[1], np.ascontiguousarray(rows.swapaxes(0, 1)), "sphere:2", bc_type=second)(x[1])
    assert np.abs(grid.grid(*x) - expected).max() < 1e-14


def test_flat_space_gives_the_tensor_product_of_scipy():
    rng = np.random.default_rng(4)
    axes = knots(rng, 9) * 1e3, knots(rng, 8) * 1e-3
    points = rng.normal(size=(9, 8, 2)) * [1e6, 1e-6]
    x = inside(rng, axes, 40)
    found = ss.GridSpline(axes, points, "r:2")(x)
    for k in range(2):
        expected = RectBivariateSpline(*axes, points[..., k], s=0)(*x, grid=False)
        assert np.abs(found[:, k] - expected).max() < 1e-12 * np.abs(points[..., k]).max()


def test_periodic_axes_repeat():
    rng = np.random.default_rng(5)
    axes = knots(rng, 9) * 6, knots(rng, 7)
    points = rng.normal(size=(9, 7, 2))
    points[-1] = points[0]
    grid = ss.GridSpline(axes, points, "r:2", bc_type=("periodic", "not-a-knot"))
    x = rng.uniform(0, 6, 30), rng.uniform(0, 1, 30)
    rows = make_interp_spline(axes[0], points, k=3, bc_type="periodic")(x[0])
    expected = np.stack([make_interp_spline(axes[1], row)(y) for row, y in zip(rows, x[1], strict=True)])
    assert np.abs(grid(x) - expected).max() < 1e-13
    assert np.abs(grid((x[0] - 12, x[1])) - expected).max() < 1e-12
    assert np.abs(grid((x[0] + 6, x[1]), (1, 0)) - grid(x, (1, 0))).max() < 1e-11


@pytest.mark.parametrize("space", [*SINGLE, ss.space("so:3 x r:3"), ss.space("gr:2,5 x hpd:2 x se:3")], ids=str)
def test_the_error_has_order_four(space):
    rng = np.random.default_rng(6)
    field, x = Field(space, size=0.3), inside(rng, ([0, 1], [0, 1]), 60)
    truth, errors = field(*x), []
    for n in (21, 41):
        axes = np.linspace(0, 1, n) ** 1.1, np.linspace(0, 1, n)
        errors.append(np.max(apart(space, ss.GridSpline(axes, field.on(*axes), space)(x), truth)))
    assert np.log2(errors[0] / errors[1]) > 3.7 or errors[1] < 1e-12


@pytest.mark.parametrize("space", REPRESENTATIVE, ids=str)
def test_symmetric_grids_do_not_depend_on_the_order_of_axes(space):
    rng = np.random.default_rng(7)
    axes = knots(rng, 6), knots(rng, 5)
    points = Field(space, size=0.6).on(*axes)
    turned = tuple(p.swapaxes(0, 1) for p in points) if isinstance(points, tuple) else points.swapaxes(0, 1)
    x = inside(rng, axes, 6)
    forward = ss.GridSpline(axes, points, space)
    backward = ss.GridSpline(axes[::-1], turned, space)
    middle = ss.GridSpline(axes, points, space, symmetric=True)
    expected = space.geodesic(forward(x), backward(x[::-1]), 0.5)
    assert np.max(apart(space, middle(x), expected)) < 1e-14
    again = ss.GridSpline(axes[::-1], turned, space, symmetric=True)
    assert np.max(apart(space, again(x[::-1]), middle(x))) < 1e-13
    assert np.max(apart(space, middle.grid(*x), by_pairs(middle, x))) < 1e-13


def by_pairs(grid, x):
    """The values on an outer product of two coordinates, as scattered ones."""
    return grid(tuple(np.meshgrid(*x, indexing="ij")))


@pytest.mark.parametrize("bc_type", ["not-a-knot", "natural", "periodic"])
def test_scattered_coordinates_use_windows(bc_type):
    """Along axes of more than 50 nodes, scattered coordinates leave out distant nodes."""
    rng = np.random.default_rng(8)
    axes = knots(rng, 130), knots(rng, 90), knots(rng, 3)
    steps = Field(ss.Sphere(2), size=0.8).on(2 * np.pi * axes[0], 2 * np.pi * axes[1], axes[2])
    points = ss.Sphere(2).project(steps + 0.05 * rng.normal(size=steps.shape))
    if bc_type == "periodic":
        points[-1], points[:, -1], points[:, :, -1] = points[0], points[:, 0], points[:, :, 0]
    grid = ss.GridSpline(axes, points, "sphere:2", bc_type=bc_type)
    x = tuple(np.concatenate([own, t[[0, 1, -2, -1]]]) for own, t in zip(inside(rng, axes, 6), axes, strict=True))
    scattered = grid(tuple(np.stack(np.meshgrid(*x, indexing="ij")).reshape(3, -1)))
    assert np.abs(scattered.reshape(10, 10, 10, 3) - grid.grid(*x)).max() < 1e-13
    points[rng.uniform(size=points.shape[:3]) < 0.01] = np.nan
    for edge in (points, points.swapaxes(0, 1), points.swapaxes(0, 2)):
        edge[-1] = edge[0]
    grid = ss.GridSpline(axes, points, "sphere:2", bc_type=bc_type)
    scattered, outer = grid(tuple(np.stack(np.meshgrid(*x, indexing="ij")).reshape(3, -1))), grid.grid(*x)
    assert np.array_equal(np.isnan(scattered), np.isnan(outer).reshape(-1, 3))
    assert np.nanmax(np.abs(scattered - outer.reshape(-1, 3))) < 1e-13


def test_blocks_and_threads_do_not_change_bits():
    rng = np.random.default_rng(9)
    axes = knots(rng, 30), knots(rng, 20)
    grid = ss.GridSpline(axes, Field(ss.space("so:3")).on(*axes), "so:3")
    x = np.linspace(0, 1, 301), np.linspace(0, 1, 111)
    whole = grid.grid(*x)
    assert np.array_equal(whole[140:160], grid.grid(x[0][140:160], x[1]))
    before = ss.num_threads()
    try:
        ss.set_num_threads(1)
        assert np.array_equal(whole, grid.grid(*x))
    finally:
        ss.set_num_threads(0 if before > 1 else 1)


def test_a_section_is_a_spline_over_the_other_axes():
    rng = np.random.default_rng(10)
    axes = knots(rng, 8), knots(rng, 7), knots(rng, 6)
    field = Field(ss.space("so:3"))
    surface = ss.GridSpline(axes[:2], field.on(*axes[:2]), "so:3")
    curve = surface.section(axis=0, at=0.3)
    assert isinstance(curve, ss.CubicSpline)
    assert np.abs(curve([0.2, 0.9]) - surface((0.3, [0.2, 0.9]))).max() < 1e-14
    across = surface.section(axis=1, at=0.3)
    assert np.abs(across(axes[0]) - surface((axes[0], 0.3))).max() < 1e-13
    assert np.abs(across(0.55) - surface((0.55, 0.3))).max() < 2 * surface.report.axis_order_gap
    volume = ss.GridSpline(axes, field.on(*axes), "so:3", bc_type=("natural", "not-a-knot", "natural"))
    slice_ = volume.section(axis=0, at=0.7)
    assert slice_.bc_type == ("not-a-knot", "natural")
    assert np.abs(slice_((0.4, 0.6)) - volume((0.7, 0.4, 0.6))).max() < 1e-14


def test_one_axis_gives_the_spline():
    rng = np.random.default_rng(11)
    t = knots(rng, 9)
    points = Field(ss.space("spd:2")).on(t)
    grid = ss.GridSpline((t,), points, "spd:2")
    spline = ss.CubicSpline(t, points, "spd:2", bc_type="not-a-knot")
    x = rng.uniform(0, 1, 20)
    for nu in range(3):
        assert np.abs(grid(x, nu) - spline(x, nu)).max() < 1e-12 * np.abs(spline(x, nu)).max()
        assert np.array_equal(grid.grid(x, nu=nu), grid(x, nu))


def test_large_spaces_are_reduced_to_the_span_of_the_points():
    rng = np.random.default_rng(12)
    axes = knots(rng, 5), knots(rng, 4)
    small = Field(ss.space("gr:2,6")).on(*axes)
    frame = np.linalg.qr(rng.normal(size=(3000, 6)))[0]
    grid = ss.GridSpline(axes, frame @ small, "gr:2,3000")
    x = inside(rng, axes, 4)
    expected = frame @ ss.GridSpline(axes, small, "gr:2,6")(x)
    assert np.max(grid.space.distance(grid(x), expected)) < 1e-12
    assert grid(x, (1, 1)).shape == (4, 3000, 2)


def test_manifolds_of_functions_have_grids():
    rng = np.random.default_rng(13)
    axes = knots(rng, 6), knots(rng, 5)
    points = np.stack([np.linalg.qr(m)[0] for m in 0.2 * rng.normal(size=(30, 4, 2)) + np.eye(4, 2)])
    grid = ss.GridSpline(axes, points.reshape(6, 5, 4, 2), ss.Stiefel(2, 4))
    x = inside(rng, axes, 3)
    rows = ss.CubicSpline(axes[0], points.reshape(6, 5, 4, 2).swapaxes(0, 1), grid.space, bc_type="not-a-knot")(x[0])
    expected = ss.CubicSpline(axes[1], rows.swapaxes(0, 1), grid.space, bc_type="not-a-knot")(x[1])
    assert np.abs(grid.grid(*x) - expected).max() < 1e-12
    assert np.abs(grid(x) - expected[np.arange(3), np.arange(3)]).max() < 1e-12
    raises("along axis 0", grid, x, (1, 0))

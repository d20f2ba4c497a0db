"""What grids accept and refuse: axes, coordinates, dates, products, files."""

import io
import pickle

import numpy as np
import pytest
from grids.grid_fields import Field, inside, knots
from refused import raises

import symspline as ss

RNG = np.random.default_rng(30)
AXES = knots(RNG, 6), knots(RNG, 5)
POINTS = Field(ss.space("so:3")).on(*AXES)
GRID = ss.GridSpline(AXES, POINTS, "so:3")
OFF = np.where(np.arange(30).reshape(6, 5, 1, 1) == 13, 1.1, 1.0) * POINTS


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((AXES, POINTS, "so:3", {"bc_type": "cubic"}), "bc_type must be 'natural'"),
        ((AXES, POINTS, "so:3", {"bc_type": ("natural",)}), "for 2 axes"),
        ((AXES, POINTS, "so:3", {"bc_type": ("natural", ("periodic", "natural"))}), "bc_type must be"),
        (((AXES[0], AXES[1][::-1]), POINTS, "so:3", {}), r"axes\[1\]\[1\] = .* is not greater than axes\[1\]\[0\]"),
        (((AXES[0], [0, 1, 1, 2, 3]), POINTS, "so:3", {}), r"axes\[1\]\[2\] = 1"),
        (((AXES[0], [0, 1, np.nan, 2, 3]), POINTS, "so:3", {}), r"axes\[1\]\[2\] is nan"),
        (((AXES[0], AXES[0]), POINTS, "so:3", {}), r"axes\[1\] has shape \(6,\), but points has 5 nodes along axis 1"),
        ((AXES[:1], POINTS, "so:3", {}), r"the grid axes \(6, 5\), but there are 1 axes"),
        (((*AXES, AXES[0]), POINTS, "so:3", {}), "2 grid axes, but there are 3"),
        ((AXES[0], POINTS, "so:3", {}), "axes must be a tuple"),
        (((), POINTS, "so:3", {}), "axes must be a tuple"),
        ((AXES, OFF, "so:3", {}), r"points\[2, 3\] is off the space"),
        ((AXES, POINTS * np.inf, "so:3", {}), r"points\[0, 0\] is infinite"),
        ((AXES, POINTS * np.nan, "so:3", {}), "no valid node"),
        ((AXES, POINTS[..., :2], "so:3", {}), r"needs shape \(..., 3, 3\)"),
        (((AXES[0], [0.0]), POINTS[:, :1], "so:3", {}), "axis 1 of points has 1 nodes"),
        ((AXES, POINTS, "so:3", {"bc_type": ("periodic", "natural")}), r"periodic, but .* points\[:, 0\]"),
        ((AXES, POINTS, "so:3", {"symmetric": 1}), "symmetric"),
        ((AXES, POINTS, "so:3", {"on_failure": "nan"}), "on_failure"),
        ((AXES, POINTS, "so:3", {"extrapolate": "nan"}), "extrapolate"),
        ((AXES, (POINTS, POINTS[:5, :, 0]), "so:3 x r:3", {}), "different numbers of nodes"),
    ],
)
def test_invalid_grid_splines_raise(arguments, message):
    axes, points, space, options = arguments
    raises(message, lambda: ss.GridSpline(axes, points, space, **options))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: GRID((0.5,)), "1 coordinates, but the grid has 2 axes"),
        (lambda: GRID(([0.1, 0.2], [0.1, 0.2, 0.3])), "do not broadcast"),
        (lambda: GRID(np.zeros((4, 3))), "last axis must hold the 2 coordinates"),
        (lambda: GRID((0.5, [0.1, 1.5])), "1.5 is outside axis 1"),
        (lambda: GRID((0.5, [0.1, np.nan])), r"x\[1\]\[1\] is not finite"),
        (lambda: GRID.grid([[0.5]], 0.1), "must be a vector"),
        (lambda: GRID((0.5, 0.5), (1,)), "one order per axis"),
        (lambda: GRID((0.5, 0.5), 1), "one order per axis"),
        (lambda: GRID((0.5, 0.5), (1, 2)), "second order in total"),
        (lambda: GRID((0.5, 0.5), (1.0, 0)), "one order per axis"),
        (lambda: GRID((1.1, 0.5), (1, 0), extrapolate="geodesic"), "last axis only"),
        (lambda: GRID.section(2, 0.5), "axis must be less than 2"),
        (lambda: GRID.section(0, 1.5), "outside axis 0"),
        (lambda: ss.GridSpline(AXES[:1], POINTS[:, 0], "so:3").section(0, 0.5), "one axis only"),
    ],
)
def test_invalid_calls_raise(call, message):
    raises(message, call)


def test_coordinates_broadcast_as_in_scipy():
    x, y = inside(np.random.default_rng(31), AXES, 4)
    pairs = GRID((x, y))
    assert np.array_equal(GRID(np.stack([x, y], axis=-1)), pairs)
    assert np.array_equal(GRID((x.reshape(2, 2), y.reshape(2, 2))), pairs.reshape(2, 2, 3, 3))
    assert np.array_equal(GRID((x[0], y[0])), pairs[0])
    assert np.array_equal(GRID((x, y[1])), GRID((x, np.full(4, y[1]))))
    outer = GRID.grid(x, y)
    assert np.abs(GRID((x[:, None], y)) - outer).max() < 1e-15
    assert np.array_equal(GRID.grid(x[2], y), outer[2])
    assert GRID.grid(x[2], y[1]).shape == (3, 3)
    assert GRID(([], [])).shape == (0, 3, 3)
    assert GRID.grid([], y).shape == (0, 4, 3, 3)


def test_extrapolation_follows_the_policy():
    x = (1.02, 0.5)
    assert np.isnan(GRID(x, extrapolate=False)).all()
    assert np.isnan(GRID.grid([0.5, 1.02], [0.5], extrapolate=False)[1]).all()
    straight = GRID(x, extrapolate="geodesic")
    end, velocity = GRID((1.0, 0.5)), GRID((1.0, 0.5), (1, 0))
    space = ss.space("so:3")
    assert np.abs(straight - space.exp(end, 0.02 * velocity)).max() < 1e-3
    assert np.abs(GRID(x, extrapolate=True) - straight).max() < 1e-2
    assert np.abs(GRID((1.0 + 1e-16, 0.5)) - end).max() < 1e-15


def test_dates_on_an_axis_of_a_grid_spline():
    dates = np.datetime64("2024-03-30T12") + np.array([0, 5, 13, 24, 30, 47]) * np.timedelta64(1, "h")
    hours = (dates - dates[0]) / np.timedelta64(1, "h")
    grid = ss.GridSpline((dates, AXES[1]), POINTS, "so:3")
    plain = ss.GridSpline((hours * 3600, AXES[1]), POINTS, "so:3")
    at = dates[0] + np.array([30, 90, 2000]) * np.timedelta64(1, "m")
    assert np.abs(grid.grid(at, 0.3) - plain.grid([1800, 5400, 120000], 0.3)).max() < 1e-14
    assert np.abs(grid((at, 0.3), (1, 0)) - plain(([1800, 5400, 120000], 0.3), (1, 0))).max() < 1e-14
    assert grid.section(1, 0.3).domain == (dates[0], dates[-1])
    raises("dates", grid, (0.5, 0.3))


def test_products_give_tuples_and_missing_nodes_count_in_all_factors():
    offsets = np.random.default_rng(32).normal(size=(6, 5, 3))
    offsets[2, 3] = np.nan
    pose = ss.GridSpline(AXES, (POINTS, offsets), "so:3 x r:3")
    assert pose.report.missing == 1
    turn, offset = pose.grid(*AXES)
    assert np.isnan(turn[2, 3]).all()
    assert np.nanmax(np.abs(offset - offsets)) < 1e-13
    assert len(pose.report.max_step) == 2


def test_single_precision_is_accepted_with_its_tolerance():
    grid = ss.GridSpline(AXES, POINTS.astype(np.float32), "so:3")
    x = inside(np.random.default_rng(33), AXES, 5)
    assert np.abs(grid(x) - GRID(x)).max() < 1e-5
    assert np.abs(ss.GridSpline(AXES, OFF, "so:3", atol=0.5)(x) - GRID(x)).max() < 1e-2


def test_far_points_are_reported():
    rng = np.random.default_rng(34)
    turns = ss.space("so:3").random_point(rng, (8, 7))
    with pytest.warns(ss.FarPointsWarning, match="along axis"):
        ss.GridSpline((None, None), turns, "so:3", on_failure="ignore")


@pytest.mark.parametrize("space", ["so:3", "u:2 x r:3", "cp:2", "gr:2,3000"])
@pytest.mark.parametrize("options", [{}, {"symmetric": True, "bc_type": ("natural", ("clamped", "natural"))}])
def test_files_and_pickles_hold_the_grid(space, options, tmp_path):
    rng = np.random.default_rng(35)
    if space == "gr:2,3000":
        points = np.linalg.qr(rng.normal(size=(3000, 6)))[0] @ Field(ss.space("gr:2,6")).on(*AXES)
    else:
        points = Field(ss.space(space)).on(*AXES)
    grid = ss.GridSpline(AXES, points, space, extrapolate=True, **options)
    x = inside(rng, AXES, 4)
    file = tmp_path / "grid.npz"
    grid.save(file)
    ss.save(grid, tmp_path / "same.npz")
    for other in (ss.load(file), ss.load(tmp_path / "same.npz"), pickle.loads(pickle.dumps(grid))):
        assert other == grid
        assert (other.bc_type, other.symmetric, repr(other)) == (grid.bc_type, grid.symmetric, repr(grid))
        pair = other(x), grid(x)
        for own, expected in zip(*pair, strict=True):
            assert np.array_equal(own, expected)


def test_damaged_files_of_grids_raise():
    file = io.BytesIO()
    GRID.save(file)
    file.seek(0)
    arrays = dict(np.load(file))
    for name, value in [
        ("velocities", arrays["velocities"][:3]),
        ("axis_0", arrays["axis_0"][::-1]),
        ("grid", np.array("{}")),
        ("grid", np.array('{"bc_type": ["x", "natural"], "symmetric": false, "on_failure": "raise"}')),
        ("points", arrays["points"][0]),
    ]:
        damaged = io.BytesIO()
        np.savez(damaged, **(arrays | {name: value}))
        damaged.seek(0)
        with pytest.raises(ss.ValidationError):
            ss.load(damaged)


def test_progress_counts_to_the_end():
    calls = []
    GRID.grid(np.linspace(0, 1, 300), np.linspace(0, 1, 300), progress=lambda done, total: calls.append((done, total)))
    assert calls[-1] == (180000, 180000)
    GRID((np.full(1000, 0.5), np.full(1000, 0.3)), progress=lambda done, total: calls.append((done, total)))
    assert calls[-1] == (1000, 1000)


def test_users_arrays_are_kept():
    points, knots_ = POINTS.copy(), AXES[0].copy()
    grid = ss.GridSpline((knots_, AXES[1]), points, "so:3")
    points[:], knots_[:] = 0, 0
    assert np.abs(grid.points - POINTS).max() < 1e-15
    assert np.array_equal(grid.axes[0], AXES[0])
    with pytest.raises(ValueError, match="read-only"):
        grid.points[0, 0] = 1

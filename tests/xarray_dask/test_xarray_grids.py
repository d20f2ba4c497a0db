"""Grids in xarray objects: values of the grid spline, in blocks that agree with the whole."""

import re

import dask
import numpy as np
import pytest
import xarray as xr
from compare import same
from curves import S2
from refused import raises

import symspline as ss
import symspline.xarray as sx


def uneven(n, start, rng):
    """Irregular nodes, with steps from 0.5 to 1.5."""
    return start + np.cumsum(rng.uniform(0.5, 1.5, n))


def directions(x, y, noise=0.05):
    """Directions on a grid, smooth up to noise."""
    x, y = np.meshgrid(x, y, indexing="ij")
    points = ss.geo.from_lonlat(40 * np.sin(x / 7) + 3 * y, 30 * np.cos(y / 5 + x / 20))
    return S2.exp(points, noise * S2.random_tangent(np.random.default_rng(0), points))


def field(nx=12, ny=9, noise=0.05):
    """Two layers of directions on a grid with irregular axes, the dimensions in mixed order."""
    x, y = uneven(nx, -3.0, np.random.default_rng(1)), uneven(ny, 1e4, np.random.default_rng(2))
    points = np.stack([directions(x, y - 1e4, noise), directions(x + 2, y - 1e4, noise)])
    return xr.DataArray(
        points,
        dims=("level", "x", "y", "q"),
        coords={
            "x": ("x", x, {"units": "m"}),
            "y": y,
            "level": [850, 500],
            "name": ("level", ["low", "high"]),
            "area": (("x", "y"), np.ones((nx, ny))),
        },
        attrs={"source": "a model"},
        name="wind",
    ).transpose("y", "q", "level", "x")


def inner(nodes, count):
    return np.linspace(nodes[0], nodes[-1], count)


def plain(da, level, x, y, **options):
    grid = ss.GridSpline(
        (da.x.values, da.y.values), da.isel(level=level).transpose("x", "y", "q").values, S2, **options
    )
    return grid.grid(x, y)


def test_values_are_those_of_the_grid_spline():
    da = field()
    x, y = inner(da.x.values, 17), da.y.values[[4, 1, 1]] + 0.2
    found = sx.resample(da, S2, {"x": x, "y": y})
    assert found.dims == ("level", "y", "x", "q") and found.name == "wind" and found.attrs == da.attrs
    assert set(found.coords) == {"x", "y", "level", "name"} and found.x.attrs == {"units": "m"}
    assert same(found.x.values, x) and same(found.y.values, y)
    for level in range(2):
        assert same(found.isel(level=level).transpose("x", "y", "q").values, plain(da, level, x, y))
    # The order of the mapping is that of the splines.
    turned = sx.resample(da, S2, {"y": y, "x": x})
    assert turned.dims == found.dims and 1e-9 < abs(turned - found).max() < 0.05
    grid = ss.GridSpline((da.y.values, da.x.values), da.isel(level=0).transpose("y", "x", "q").values, S2)
    assert same(turned.isel(level=0).values, grid.grid(y, x))


def test_end_conditions_and_options_reach_the_grid_spline():
    da = field()
    to = {"x": inner(da.x.values, 7), "y": inner(da.y.values, 6)}
    whole = plain(da, 1, **to, bc_type=("natural", "clamped"), symmetric=True)
    found = sx.resample(da, S2, to, bc_type={"x": "natural", "y": "clamped"}, symmetric=True)
    assert same(found.isel(level=1).transpose("x", "y", "q").values, whole)
    natural = sx.resample(da, S2, to, bc_type="natural")
    assert same(natural.isel(level=0).transpose("x", "y", "q").values, plain(da, 0, **to, bc_type="natural"))
    single = sx.resample(da, S2, to, bc_type={"y": "natural"}).isel(level=0).transpose("x", "y", "q").values
    assert same(single, plain(da, 0, **to, bc_type=("not-a-knot", "natural")))


@pytest.mark.parametrize("bc_type", ["not-a-knot", "natural", "clamped"])
@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_blocks_agree_with_the_whole(bc_type, noise):
    da = field(150, 80, noise)[:, :, :1]
    x, y = inner(da.x.values, 233), inner(da.y.values, 11)
    whole = sx.resample(da, S2, {"x": x, "y": y}, bc_type=bc_type)
    blocks = sx.resample(da.chunk(x=40, y=27), S2, {"x": x, "y": y}, bc_type=bc_type)
    assert blocks.chunksizes["x"] == (59, 59, 59, 56) and blocks.chunksizes["y"] == (4, 4, 3)
    assert 0 < abs(blocks - whole).max() < 1e-12


def test_missing_points_and_masks_in_blocks(rng):
    da = field(120, 12)
    full, mask = da.copy(deep=True), np.ones((120, 12), bool)
    mask[30:33, 4], mask[71, :], mask[:, 0] = False, False, False
    mask[100:] = rng.uniform(size=(20, 12)) > 0.2
    da = da.where(xr.DataArray(mask, dims=("x", "y")))
    to = {"x": inner(da.x.values, 241), "y": inner(da.y.values, 25)}
    whole = sx.resample(da, S2, to)
    missing = whole.isnull()
    assert same(missing.isel(level=0).transpose("x", "y", "q").values, np.isnan(plain(da, 0, **to)))
    assert 0.05 < missing.mean() < 0.9
    for found in (
        sx.resample(da.chunk(x=30, y=5), S2, to),
        sx.resample(full.chunk(x=30), S2, to, where=xr.DataArray(mask, dims=("x", "y"))),
    ):
        assert same(found.isnull().values, missing.values)
        assert abs(found - whole).max() < 1e-12


def test_dates_on_an_axis(rng):
    hours = np.datetime64("2021-08-28", "s") + (np.cumsum(rng.integers(1, 4, 60)) * 3600).astype("m8[s]")
    y = np.arange(6.0)
    points = directions(np.arange(60), y)
    da = xr.DataArray(points, dims=("time", "y", "q"), coords={"time": hours, "y": y})
    texts = ["2021-08-28T20:30", "2021-08-29T05:10", "2021-08-30"]
    found = sx.resample(da.chunk(time=20), S2, {"time": texts, "y": y[1:]})
    assert found.time.dtype == np.array(texts, "M8[s]").dtype and found.dims == ("time", "y", "q")
    expected = ss.GridSpline((hours, y), points, S2).grid(np.array(texts, "M8[s]"), y[1:])
    np.testing.assert_allclose(found, expected, atol=1e-12)
    raises("the knots are dates", sx.resample, da, S2, {"time": [0.5], "y": y})


def test_one_dimension_and_single_positions():
    da = field()
    one = sx.resample(da, S2, {"x": [0.5, 1.5]})
    curves = sx.resample(da, S2, [0.5, 1.5], dim="x", bc_type="not-a-knot")
    assert one.dims == ("y", "level", "x", "q") == curves.dims
    np.testing.assert_allclose(one, curves, atol=1e-14)
    point = sx.resample(da, S2, {"x": 0.5, "y": da.y.values[2:4]})
    assert point.dims == ("level", "y", "q") and float(point.x) == 0.5
    assert same(point.values, sx.resample(da, S2, {"x": [0.5], "y": da.y.values[2:4]}).isel(x=0).values)


def test_periodic_axes_are_not_split():
    angle = np.linspace(0, 2 * np.pi, 61)
    y = np.arange(5.0)
    points = ss.geo.from_lonlat(np.degrees(angle)[:, None] + 5 * y, 20 * np.sin(2 * angle)[:, None] + y)
    da = xr.DataArray(points, dims=("angle", "y", "q"), coords={"angle": angle, "y": y})
    to = {"angle": inner(angle, 91), "y": [0.5, 3.5]}
    ends = {"angle": "periodic"}
    whole = sx.resample(da, S2, to, bc_type=ends)
    assert same(sx.resample(da.chunk(angle=20), S2, to, bc_type=ends).values, whole.values)
    np.testing.assert_allclose(whole[0], whole[-1], atol=1e-14)
    turned = sx.resample(da.chunk(angle=20), S2, {"angle": to["angle"] + 4 * np.pi, "y": to["y"]}, bc_type=ends)
    np.testing.assert_allclose(turned, whole, atol=1e-12)


def test_positions_outside():
    da = field(90, 8)
    to = {"x": da.x.values[[0, -1]] + [-1, 1], "y": da.y.values}
    whole = sx.resample(da, S2, to, extrapolate="geodesic")
    assert abs(sx.resample(da.chunk(x=30), S2, to, extrapolate="geodesic") - whole).max() < 1e-12
    assert np.isfinite(whole).all() and sx.resample(da.chunk(x=30), S2, to, extrapolate=False).isnull().all()
    length = da.x.values[-1] - da.x.values[0]
    beyond = {"x": da.x.values[10:20] + length, "y": da.y.values[1:3]}
    found = sx.resample(da.chunk(x=30), S2, beyond, extrapolate="periodic")
    inside = sx.resample(da, S2, beyond | {"x": da.x.values[10:20]})
    np.testing.assert_allclose(found, inside, atol=1e-12)


@pytest.mark.parametrize("space", ["so:3", "spd:2", "cp:1"])
def test_matrices_and_complex_points(space):
    space = ss.space(space)
    rng = np.random.default_rng(0)
    p = space.random_point(rng)
    x, y = np.meshgrid(np.linspace(0, 1, 6), np.linspace(0, 1, 5), indexing="ij")
    x, y = (own.reshape(*own.shape, *(1,) * len(space.point_shape)) for own in (x, y))
    points = space.exp(p, 0.4 * (x * space.random_tangent(rng, p) + np.sin(3 * y) * space.random_tangent(rng, p)))
    dims = tuple("rs"[: len(space.point_shape)])
    da = xr.DataArray(points, dims=("x", "y", *dims))
    found = sx.resample(da.chunk(x=3), space, {"x": [0.5, 4.5], "y": [0, 1.5, 4]}, point_dims=dims)
    assert found.dtype == space.dtype
    np.testing.assert_allclose(
        found, ss.GridSpline((None, None), points, space).grid([0.5, 4.5], [0, 1.5, 4]), atol=1e-13
    )


def test_from_store_to_store_without_reading_everything(tmp_path):
    pytest.importorskip("zarr")
    da = field(160, 40).transpose("level", "x", "y", "q")
    da.drop_vars("name").chunk(level=1, x=40, y=40).to_zarr(tmp_path / "in.zarr", consolidated=False)
    lazy = xr.open_zarr(tmp_path / "in.zarr", consolidated=False)["wind"]
    to = {"x": inner(da.x.values, 319), "y": inner(da.y.values, 5)}
    made = sx.resample(lazy, S2, to)
    assert dask.is_dask_collection(made) and made.chunksizes["level"] == (1, 1) and len(made.chunksizes["x"]) == 4
    made.to_zarr(tmp_path / "out.zarr", consolidated=False)
    back = xr.open_zarr(tmp_path / "out.zarr", consolidated=False)["wind"]
    assert abs(back - sx.resample(da.drop_vars("name"), S2, to)).max() < 1e-12 and back.attrs == da.attrs
    # One block needs its own nodes and the halo: nodes up to 40 + 26, and thus the chunks up to 80.
    sizes = []
    lazy = lazy.copy(data=lazy.data.map_blocks(lambda block: sizes.append(block.shape) or block, dtype=float))
    sizes.clear()
    first = sx.resample(lazy, S2, to).isel(level=0, x=slice(0, 80)).compute(scheduler="synchronous")
    assert sizes == [(1, 40, 40, 3)] * 2
    np.testing.assert_allclose(first, back.isel(level=0, x=slice(0, 80)), atol=1e-15)


@pytest.mark.parametrize(
    "match, to, options",
    [
        ("to['x']: x[1] = 99 is outside the knots", {"x": [0.5, 99.0]}, {}),
        ("to['x']: x[0]", {"x": [np.nan]}, {}),
        ("da has the dimensions ('y', 'q', 'level', 'x'), but not 'z'", {"z": [0.5]}, {}),
        ("to ('x', 'q') and point_dims ('q',) name a dimension twice", {"x": [0.5], "q": [0.5]}, {}),
        ("to['x'] has the dimensions ('level',), but needs ('x',)", {"x": xr.DataArray([0.5, 1], dims="level")}, {}),
        ("x has shape (1, 2); pass a DataArray", {"x": [[0.5, 1.0]]}, {}),
        ("method is an option of curves along one dimension", {"x": [0.5]}, {"method": "newton"}),
        ("bc_type has the dimension 'y', but to has ('x',)", {"x": [0.5]}, {"bc_type": {"y": "natural"}}),
        ("bc_type", {"x": [0.5]}, {"bc_type": "guess"}),
        ("where must be a DataArray of bool whose dimensions are among ('y', 'level', 'x')", {"x": [0.5]},
         {"where": xr.DataArray([True], dims="z")}),
        ("symmetric=True is for grids", [0.5], {"dim": "x", "symmetric": True}),
        ("bc_type by dimension is for grids", [0.5], {"dim": "x", "bc_type": {"x": "natural"}}),
        ("is a product", {"x": [0.5]}, {"space": "sphere:2 x r:1"}),
    ],
)  # fmt: skip
@pytest.mark.parametrize("chunks", [None, {"x": 4}])
def test_invalid_grids_raise(match, to, options, chunks):
    da = field()
    da = da if chunks is None else da.chunk(chunks)
    options = {"space": S2} | options
    if options.get("dim"):
        da = da.compute()
    raises(re.escape(match), sx.resample, da, options.pop("space"), to, **options)


def test_points_at_their_cut_locus_warn_and_are_missing():
    da = field(60, 8)[:, :, :1]
    da[3, :, 0, 30] = -da[3, :, 0, 31].values
    to = {"x": inner(da.x.values, 119), "y": da.y.values}
    with pytest.warns(ss.ConvergenceWarning, match="cut locus"):
        found = sx.resample(da, S2, to)
    assert 0 < found.isnull().mean() < 0.5
    raises("cut locus", sx.resample, da, S2, to, on_failure="raise", error=ss.CutLocusError)


def test_points_must_not_be_split():
    raises("'q' is cut into 3 chunks", sx.resample, field().chunk(q=1), S2, {"x": [0.5]})

"""Blocks of dask: lazy, bit-identical for every scheduler, and one thread per worker."""

import pickle

import dask
import numpy as np
import pytest
import xarray as xr
from compare import same
from curves import S2
from fields import field, numbers, point_dims

import symspline as ss
import symspline.xarray as sx

X = np.array([0.0, 0.3, 2.5, 7.7, 13.0])


@pytest.mark.parametrize("scheduler", ["synchronous", "threads", "processes"])
def test_blocks_are_bit_identical_to_the_whole(scheduler):
    da = field("so:3")
    where = xr.DataArray(np.arange(12).reshape(2, 6) != 5, dims=("lat", "lon"))
    dims = point_dims("so:3")
    expected = sx.fit(da, "so:3", point_dims=dims, where=where)
    blocks = da.transpose("s", "lon", ...).chunk(lon=4, lat=1)
    ds = sx.fit(blocks, "so:3", point_dims=dims, where=where.chunk(lon=2))
    values, speed = sx.evaluate(ds, X, nu=1), sx.speed(ds, X)
    made = sx.resample(blocks, "so:3", X, point_dims=dims, where=where)
    lazy = (ds, values, speed, made)
    assert all(dask.is_dask_collection(found) for found in lazy)
    ds, values, speed, made = dask.compute(*lazy, scheduler=scheduler, num_workers=1 if scheduler == "processes" else 2)
    assert same(numbers(ds.velocities, "time", *dims), expected.velocities.values)
    assert same(numbers(ds.converged), expected.converged.values) and ds.converged.sum() == 11
    assert same(numbers(values, "time", *dims), sx.evaluate(expected, X, nu=1).values)
    assert same(numbers(speed, "time"), sx.speed(expected, X).values)
    assert same(numbers(made, "time", *dims), sx.evaluate(expected, X).values)


def test_nothing_is_computed_before_it_is_asked_for():
    def never(block):
        raise AssertionError

    da = field(chunks={"lon": 3})
    lazy = da.copy(data=da.data.map_blocks(never, dtype=float, meta=np.empty((0, 0, 0, 0))))
    ds = sx.fit(lazy, S2, point_dims=("r",), bc_type=((1, lazy[:, :, 0]), "natural"))
    assert ds.velocities.chunks == ((2,), (3, 3), (10,), (3,)) and ds.residual.chunks == ((2,), (3, 3))
    assert ds.points.dtype == float and ds.converged.dtype == bool and ds.iterations.dtype == int
    for values in (sx.evaluate(ds, X), sx.lift(ds, X), sx.resample(lazy, S2, X, point_dims=("r",))):
        assert values.shape == (2, 6, 5, 3)
    with pytest.raises(AssertionError):
        ds.compute(scheduler="synchronous")


def test_lazy_times():
    da = field(chunks={"lon": 3})
    x = xr.DataArray(np.linspace(0, 13, 30).reshape(6, 5), dims=("lon", "sample"))
    ds = sx.fit(da, S2, point_dims=("r",))
    assert same(sx.evaluate(ds, x.chunk(lon=2)).values, sx.evaluate(ds.compute(), x).values)
    assert dask.is_dask_collection(sx.evaluate(ds.compute(), x.chunk(lon=2)))


def test_blocks_are_those_of_the_points():
    da = field(chunks={"lon": 4})
    where = xr.DataArray(np.ones((2, 6), bool), dims=("lat", "lon"))
    ds = sx.fit(da, S2, point_dims=("r",), where=where.chunk(lon=1, lat=1))
    # Consistent with the coordinate, or this would raise.
    assert ds.chunksizes["lon"] == (4, 2) and "place" in ds.coords
    x = xr.DataArray(np.linspace(0, 13, 30).reshape(6, 5), dims=("lon", "sample"))
    for times in (x.chunk(lon=1), x.chunk(sample=2), x.chunk(sample=2, lon=3)):
        values = sx.evaluate(ds, times)
        assert values.variable.chunksizes["lon"] == (4, 2)
        assert same(values.values, sx.evaluate(ds.compute(), x).values)


def test_a_failure_says_that_it_counts_in_its_block():
    da = field()
    da[1, 5, 3] = np.nan
    ds = sx.fit(da.chunk(lon=4), S2, point_dims=("r",), on_failure="raise")
    with pytest.raises(ss.ValidationError, match=r"points?.*3.* of curve 1,1") as caught:
        ds.compute(scheduler="synchronous")
    assert caught.value.__notes__ == ["Indices of curves count within one block of the dask array."]
    da[1, 5, 3] = -da.values[1, 5, 2]
    ds = sx.fit(da.chunk(lon=4), S2, point_dims=("r",), on_failure="raise")
    with pytest.raises(ss.CutLocusError, match=r"of curve 1,1") as caught:
        ds.compute(scheduler="synchronous")
    sent = pickle.loads(pickle.dumps(caught.value))
    assert type(sent) is ss.CutLocusError and sent.spline is None and sent.__notes__


@pytest.mark.parametrize("space", ["sphere:2", "cp:2", "so:3"])
def test_curves_come_back_from_zarr(space, tmp_path):
    dims = point_dims(space)
    da = field(space, chunks={"lon": 2}).assign_coords(
        time=np.datetime64("2021-08-28", "ms") + np.arange(10) * np.timedelta64(90, "m")
    )
    x = np.datetime64("2021-08-28T01", "s") + np.arange(3)
    da.to_zarr(tmp_path / "in.zarr", consolidated=False)
    read = xr.open_zarr(tmp_path / "in.zarr", consolidated=False)["direction"]
    sx.fit(read, space, point_dims=dims, bc_type="clamped", extrapolate="geodesic").to_zarr(
        tmp_path / "out.zarr", consolidated=False
    )
    ds = xr.open_zarr(tmp_path / "out.zarr", consolidated=False)
    expected = ss.CubicSpline(da.time.values, da.values, space, bc_type="clamped", extrapolate="geodesic")
    assert same(sx.evaluate(ds, x).values, expected(x))
    late = np.datetime64("2021-08-30")
    assert same(sx.speed(ds, late).values, expected.speed(late))
    assert ds.attrs["space"] == space and bool(ds.converged.all())

"""Invalid input raises an error at once, before any block is computed."""

import re

import numpy as np
import pytest
import xarray as xr
from cases import loop_over
from curves import S2, run_python
from fields import field
from refused import raises

import symspline as ss
import symspline.xarray as sx

DATES = np.datetime64("2021-08-28", "s") + np.arange(10)


def refused(match, call, kind=ss.ValidationError):
    raises(re.escape(match), call, error=kind)


@pytest.mark.parametrize(
    "match, change, options",
    [
        ("da must be an xarray.DataArray, not ndarray", lambda da: da.values, {}),
        ("da has the dimensions ('lat', 'lon', 'when', 'r'), but not 'time'", lambda da: da.rename(time="when"), {}),
        ("but not 'q'", None, {"point_dims": ("q",)}),
        ("point_dims must be 1 names in a tuple, not ('r', 's')", None, {"point_dims": ("r", "s")}),
        ("name a dimension twice", None, {"point_dims": ("time",)}),
        ("('r',) have sizes (3,), but a point of sphere:3 has shape (4,)", None, {"space": "sphere:3"}),
        ("is a product, whose factors are independent", None, {"space": "sphere:2 x r:1"}),
        ("did you mean ComplexProjective?", lambda da: da.astype(complex), {}),
        ("da must be an array of real numbers, not of <U", lambda da: da.astype(str), {}),
        ("'time' is cut into 5 chunks, but a curve needs all of its points at once; pass da.chunk({'time': -1})",
         lambda da: da.chunk(time=2), {}),
        ("'r' is cut into 3 chunks, but a point needs all", lambda da: da.chunk(r=1), {}),
        ("t[1] = 0", lambda da: da.assign_coords(time=np.zeros(10)), {}),
        ("a curve needs at least two points", lambda da: da.isel(time=[0]), {}),
        ("t must be numbers or datetime64, not complex", lambda da: da.assign_coords(time=1j * np.arange(10)), {}),
        ("method", None, {"method": "guess"}),
        ("on_failure must be", None, {"on_failure": "hide"}),
        ("bc_type must be 'natural'", None, {"bc_type": ("free", (1, [0, 0, 0]))}),
        ("the start vector has shape (2,), a point of sphere:2 (3,)", None, {"bc_type": ((1, [0, 0]), "natural")}),
        ("the end vector has the dimensions ('lat',)", None,
         {"bc_type": ("natural", (1, xr.DataArray([0, 0], dims="lat")))}),
        ("where must be a DataArray of bool whose dimensions are among ('lat', 'lon')", None,
         {"where": np.ones((2, 6), bool)}),
        ("where must be a DataArray", None, {"where": xr.DataArray(np.ones(10, bool), dims="time")}),
    ],
)  # fmt: skip
@loop_over("chunks", [None, {"lat": 1}])
def test_invalid_fits_raise(match, change, options, chunks):
    da = field(chunks=chunks)
    if change is not None:
        da = change(da)
    options = {"space": S2, "point_dims": ("r",)} | options
    space = options.pop("space")
    refused(match, lambda: sx.fit(da, space, **options))
    refused(match, lambda: sx.resample(da, space, [0.5], **options))


@pytest.mark.parametrize(
    "match, x, options",
    [
        ("x[1] = 14 is outside the knots [0, 13]", [0.5, 14.0], {}),
        ("x[0]", [np.nan], {}),
        ("x has shape (1, 2); pass a DataArray", [[0.5, 1.0]], {}),
        ("x has the dimension 'r' of a point", xr.DataArray([0.5], dims="r"), {}),
        ("the knots are numbers", DATES, {}),
        ("extrapolate must be", [0.5], {"extrapolate": "up"}),
    ],
)
@loop_over("chunks", [None, {"lat": 1}])
def test_invalid_times_of_arrays_with_names_raise(match, x, options, chunks):
    da = field(chunks=chunks)
    ds = sx.fit(da, S2, point_dims=("r",))
    for call in (sx.evaluate, sx.speed, sx.lift):
        refused(match, lambda call=call: call(ds, x, **options))
    refused(match, lambda: sx.resample(da, S2, x, point_dims=("r",), **options))


def test_dates_need_dates():
    ds = sx.fit(field().assign_coords(time=DATES), S2, point_dims=("r",))
    refused("the knots are dates, so x must be datetime64", lambda: sx.evaluate(ds, 0.5))
    refused("times are seconds since 2021-08-28T00:00:00", lambda: sx.evaluate(ds, DATES + 5))


def test_invalid_datasets_raise():
    ds = sx.fit(field(), S2, point_dims=("r",))
    refused("ds is not what symspline.xarray.fit returns", lambda: sx.evaluate(ds.drop_vars("velocities"), 0.5))
    refused("it has no 'space'", lambda: sx.evaluate(ds.drop_attrs(), 0.5))
    refused("its attribute 'point_dims' is 'r'", lambda: sx.evaluate(ds.assign_attrs(point_dims="r"), 0.5))
    refused("is not what symspline.xarray.fit returns", lambda: sx.evaluate(field(), 0.5))
    refused("'time' is cut into 10 chunks", lambda: sx.evaluate(ds.chunk(time=1), 0.5))


def test_coordinates_must_agree():
    where = xr.DataArray([True, False], dims="lat", coords={"lat": [10.0, 21.0]})
    raises("exact", sx.fit, field(), S2, error=ValueError, point_dims=("r",), where=where)


def test_the_package_does_not_import_xarray():
    run_python("""
import sys, symspline
assert not {"xarray", "dask", "zarr", "pandas"} & set(sys.modules)
""")


def test_times_under_another_name_are_used():
    """As in files of trajectories by the CF conventions."""
    points = np.broadcast_to(np.eye(3), (2, 3, 3))
    for coords in [
        {"time": (("traj", "obs"), [[0.0, 1, 5], [0, 2, 3]])},
        {"when": ("obs", np.array(["2021-08-28", "2021-08-29", "2021-09-03"], "datetime64[ns]"))},
        {"s": ("obs", [0.0, 1, 5], {"units": "seconds since 2021-08-28"})},
        {"s": ("obs", [0.0, 1, 5], {"standard_name": "time"})},
    ]:
        da = xr.DataArray(points, dims=("traj", "obs", "q"), coords=coords)
        assert (sx.fit(da, "sphere:2", dim="obs").max_gap > 1).all()
        assert (sx.fit(da.drop_vars(list(coords)), "sphere:2", dim="obs").max_gap == 1).all()


def test_unrelated_coordinates_are_ignored():
    da = xr.DataArray(np.eye(3), dims=("obs", "q"), coords={"depth": ("obs", [3.0, 1.0, 2.0])})
    assert sx.fit(da, "sphere:2", dim="obs").max_gap == 1

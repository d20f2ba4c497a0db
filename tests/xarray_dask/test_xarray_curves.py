"""Curves in xarray objects are bit-identical to those of plain arrays, whatever the order of dimensions."""

import dataclasses

import numpy as np
import pytest
import xarray as xr
from compare import same
from curves import S2
from fields import KNOTS, LAT, LON, field, numbers, point_dims
from refused import raises

import symspline as ss
import symspline.xarray as sx

SPACES = ["euclidean:3", "sphere:2", "rp:2", "cp:2", "gr:2,5", "so:3", "spd:2", "hpd:2", "se:3", "sphere:300"]
X = np.array([0.0, 0.3, 2.5, 7.7, 13.0])


def plain(da, space, **options):
    """The splines of the same numbers without names."""
    axes = ("time", *point_dims(space))
    return ss.CubicSpline(da.time.values, numbers(da, *axes), space, **{"on_failure": "ignore"} | options)


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("turned", [False, True])
def test_numbers_are_those_of_the_spline(space, turned):
    dims = point_dims(space)
    da = field(space, order=(*dims[::-1], "time", "lon", "lat") if turned else None)
    expected = plain(da, space, bc_type="not-a-knot")
    ds = sx.fit(da, space, point_dims=dims, bc_type="not-a-knot")
    assert same(numbers(ds.points, "time", *dims), expected.points)
    assert same(numbers(ds.velocities, "time", *dims), expected.velocities)
    columns = {field.name for field in dataclasses.fields(ss.Report)} - {"method", "curvature", "skipped"}
    assert set(ds.data_vars) == {"points", "velocities", *columns}
    for name in ("converged", "iterations", "residual", "max_step", "max_gap", "rate"):
        assert same(numbers(ds[name]), getattr(expected.report, name))
        assert ds[name].dtype == getattr(expected.report, name).dtype
    # Velocities that are given may be off the span of the points by rounding.
    off = {"rtol": 1e-12, "atol": 1e-13} if space == "sphere:300" else {"rtol": 0}
    for nu in range(3):
        values = sx.evaluate(ds, X, nu=nu)
        assert values.dims == (*ds.converged.dims, "time", *dims)
        np.testing.assert_allclose(numbers(values, "time", *dims), expected(X, nu=nu), **off)
    np.testing.assert_allclose(numbers(sx.speed(ds, X), "time"), expected.speed(X), **off)
    np.testing.assert_allclose(numbers(sx.lift(ds, X), "time", *dims), expected.lift(X), **off)
    made = sx.resample(da, space, X, point_dims=dims, bc_type="not-a-knot")
    assert same(numbers(made, "time", *dims), expected(X))


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_dates_keep_their_unit(unit):
    dates = np.datetime64("2021-08-28", unit) + np.arange(KNOTS) * np.timedelta64(1, "h").astype(f"m8[{unit}]")
    da = field().assign_coords(time=dates)
    ds = sx.fit(da, S2, point_dims=("r",))
    assert ds.time.dtype == dates.dtype and (ds.time.values == dates).all()
    x = np.array(["2021-08-28T00:30", "2021-08-28T05:10"], "M8[s]")
    values = sx.evaluate(ds, x)
    assert values.time.dtype == x.dtype and (values.time.values == x).all()
    assert same(values.values, plain(da, "sphere:2")(x))
    texts = sx.resample(da, S2, ["2021-08-28T00:30", "2021-08-28T05:10"], point_dims=("r",))
    assert same(texts.values, values.values)
    assert sx.evaluate(ds, "2021-08-28T00:30").time.values == x[0]


def test_coordinates_and_attributes_carry_over():
    da = field()
    ds = sx.fit(da, S2, point_dims=("r",))
    for name in da.coords:
        xr.testing.assert_identical(ds[name], da[name].drop_vars(set(da[name].coords) - set(ds[name].coords)))
        assert name in ds.points.coords
    assert ds.points.attrs == da.attrs and not ds.velocities.attrs and not ds.converged.attrs
    assert ds.attrs["space"] == "sphere:2"
    values = sx.evaluate(ds, X)
    assert set(values.coords) == {"time", "lat", "place", "r"} and values.attrs == da.attrs
    assert values.lat.attrs == da.lat.attrs and (values.time == X).all()
    assert not sx.evaluate(ds, X, nu=1).attrs and not sx.speed(ds, X).attrs
    assert set(sx.speed(ds, X).coords) == {"time", "lat", "place"}
    made = sx.resample(da, S2, X, point_dims=("r",))
    assert made.name == "direction" and made.attrs == da.attrs and set(made.coords) == set(values.coords)
    # What was given is as before.
    xr.testing.assert_identical(da, field())


def test_knots_without_a_coordinate_are_counted():
    da = field().drop_vars("time")
    expected = ss.CubicSpline(None, da.values, S2)
    ds = sx.fit(da, S2, point_dims=("r",))
    assert "time" not in ds.coords
    assert same(sx.evaluate(ds, [0.5, 7.5]).values, expected([0.5, 7.5]))


@pytest.mark.parametrize(
    "dims", [("run", "sample"), ("lon", "sample"), ("sample", "lat", "lon"), ("lat",), ("time", "lon")]
)
def test_times_of_any_dimensions(dims):
    """Shared by all curves, or of every curve its own."""
    da = field()
    sizes = {"lat": LAT, "lon": LON, "run": 3, "sample": 4, "time": 4}
    x = xr.DataArray(np.random.default_rng(0).uniform(0, 13, [sizes[d] for d in dims]), dims=dims)
    own = [d for d in dims if d not in ("lat", "lon")]
    each = x.broadcast_like(xr.DataArray(np.zeros((LAT, LON)), dims=("lat", "lon"))).transpose("lat", "lon", *own)
    expected = plain(da, "sphere:2")(each.values, per_curve=True)
    ds = sx.fit(da, S2, point_dims=("r",))
    for values in (sx.evaluate(ds, x), sx.resample(da, S2, x, point_dims=("r",))):
        assert same(values.transpose("lat", "lon", *own, "r").values, expected)
        if dims != ("time", "lon"):
            assert set(values.time.dims) == set(dims)


def broken():
    """A field in which one curve has a hole, one a step beyond the cut locus, and one is not wanted."""
    da = field()
    da[0, 1, 3] = np.nan
    da[1, 2, 5] = -da.values[1, 2, 4]
    return da, xr.DataArray(np.array([True, True, True, True, False, True]), dims="lon")


def test_curves_that_fail_are_nan_and_say_so():
    da, where = broken()
    ds = sx.fit(da, S2, point_dims=("r",), where=where)
    mask = np.broadcast_to(where.values, (LAT, LON))
    expected = plain(da, "sphere:2", where=mask)
    assert ds.converged.values.sum() == 8 and same(ds.converged.values, expected.report.converged)
    good = ds.converged.values
    for values in (
        sx.evaluate(ds, X),
        sx.resample(da, S2, X, point_dims=("r",), where=where),
        sx.speed(ds, X),
        sx.evaluate(ds, where.astype(float)),
    ):
        assert same(np.isfinite(values.values).reshape(LAT, LON, -1).all(-1), good)
        assert same(np.isnan(values.values).reshape(LAT, LON, -1).all(-1), ~good)
    assert same(sx.evaluate(ds, X).values, expected(X))
    none = sx.fit(da, S2, point_dims=("r",), where=where & False)
    assert np.isnan(sx.evaluate(none, X)).all() and sx.evaluate(none, X).shape == (LAT, LON, 5, 3)
    assert np.isnan(sx.lift(none, X)).all() and sx.speed(none, X).shape == (LAT, LON, 5)


def test_what_does_not_converge_keeps_its_iterate_in_a_fit_and_is_nan_resampled():
    da = field(step=1.0)
    ds = sx.fit(da, S2, point_dims=("r",), max_iter=2)
    assert not ds.converged.any()
    assert same(sx.evaluate(ds, X).values, plain(da, "sphere:2", max_iter=2)(X))
    assert np.isnan(sx.resample(da, S2, X, point_dims=("r",), max_iter=2)).all()
    raises("of curve 0,0", sx.fit, da, S2, point_dims=("r",), max_iter=2, on_failure="raise", error=ss.ConvergenceError)
    with pytest.warns(ss.ConvergenceWarning):
        sx.fit(da, S2, point_dims=("r",), max_iter=2, on_failure="warn")


def test_end_vectors_by_name():
    da = field()
    p = da.values
    first = S2.random_tangent(np.random.default_rng(0), p[:, :, 0])
    last = S2.random_tangent(np.random.default_rng(1), p[:, :, -1])
    start = xr.DataArray(first, dims=("lat", "lon", "r")).transpose("r", "lon", "lat")
    end = xr.DataArray(last, dims=("lat", "lon", "r"))
    ds = sx.fit(da.transpose("lon", ...), S2, point_dims=("r",), bc_type=((1, start), (2, end)))
    expected = plain(da, "sphere:2", bc_type=((1, first), (2, last)))
    assert same(numbers(ds.velocities, "time", "r"), expected.velocities)
    assert ds.attrs["bc_type"] == "[1, 2]"


def test_beyond_the_knots():
    da = field()
    da = xr.concat([da, da.isel(time=[0]).assign_coords(time=[15.0])], "time")
    closed = sx.fit(da, S2, point_dims=("r",), bc_type="periodic")
    assert same(sx.evaluate(closed, 16.0).values, sx.evaluate(closed, 1.0).values)
    geodesic = sx.fit(da, S2, point_dims=("r",), extrapolate="geodesic")
    np.testing.assert_allclose(sx.speed(geodesic, [15.0, 18.0]).diff("time"), 0, atol=1e-13)
    on = sx.evaluate(geodesic, 16.0, extrapolate=True)
    assert same(numbers(on, "r"), plain(da, "sphere:2")(16.0, extrapolate=True))
    made = sx.resample(da, S2, 16.0, point_dims=("r",), extrapolate="geodesic")
    assert same(made.values, sx.evaluate(geodesic, 16.0).values)


def test_the_holonomy_of_closed_curves():
    p = ss.ComplexProjective(1).project(np.array([[1, 0], [1, 1], [1, 1j], [1, 0]]) / np.sqrt([[1], [2], [2], [1]]))
    da = xr.DataArray(p[None], dims=("curve", "time", "q"))
    ds = sx.fit(da, "cp:1", bc_type="periodic")
    spline = ss.CubicSpline(None, p[None], "cp:1", bc_type="periodic")
    x = np.linspace(0, 6, 13)
    assert same(sx.lift(ds, x).values, spline.lift(x)) and same(sx.lift(ds, x, nu=1).values, spline.lift(x, nu=1))


@pytest.mark.parametrize("space", ["sphere:2", "so:3"])
def test_curves_come_back_from_netcdf(space, tmp_path):
    # SciPy writes version 3 of the format, which has no lists of texts, no Boolean values and no 64-bit integers.
    dims = point_dims(space)
    da = field(space)
    ds = sx.fit(da, space, point_dims=dims, bc_type="not-a-knot")
    ds.to_netcdf(tmp_path / "curves.nc", engine="scipy")
    read = xr.load_dataset(tmp_path / "curves.nc", engine="scipy")
    assert sx.evaluate(read, X).identical(sx.evaluate(ds, X))
    smoothed = sx.smooth(da, space, point_dims=dims, std=True, lam=1.0)
    smoothed.to_netcdf(tmp_path / "smoothed.nc", engine="scipy")
    assert xr.load_dataset(tmp_path / "smoothed.nc", engine="scipy").points.identical(smoothed.points)

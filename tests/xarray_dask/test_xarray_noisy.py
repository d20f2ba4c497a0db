"""Smoothing in xarray objects: the numbers are those of the functions of plain arrays."""

import re

import numpy as np
import pytest
import xarray as xr
from refused import raises

import symspline as ss
import symspline.xarray as sx

S2, SO3 = ss.Sphere(2), ss.SpecialOrthogonal(3)
T = np.linspace(0, 10, 40)
X = np.array([0.0, 0.3, 4.7, 10.0])
START = np.datetime64("2024-05-01T00:00", "ns")


def dates(t):
    return START + (1e9 * np.asarray(t)).astype("m8[ns]")


def noisy(order=("lat", "lon", "time", "q"), chunks=None, times=T):
    """Noisy tracks on a grid of 2 × 3."""
    rng = np.random.default_rng(1)
    phase = rng.uniform(0, 6, (2, 3, 1))
    p = np.stack([np.cos(0.2 * T + phase), np.sin(0.2 * T + phase), 0.3 * np.sin(0.4 * T + phase)], axis=-1)
    p = S2.project(p)
    p = S2.exp(p, 0.05 * S2.random_tangent(rng, p))
    coords = {"time": times, "lat": [10.0, 20.0]}
    da = xr.DataArray(p, dims=("lat", "lon", "time", "q"), coords=coords, attrs={"source": "a test"}).transpose(*order)
    return da if chunks is None else da.chunk(chunks)


def rows(da, *dims):
    return da.transpose("lat", "lon", *dims).values


@pytest.mark.parametrize("options", [{}, {"penalty": "jerk"}, {"sigma": 0.05, "criterion": "cp", "loss": "huber"}])
@pytest.mark.parametrize("chunks", [None, {"lat": 1}])
def test_smoothed_numbers_are_those_of_the_spline(options, chunks):
    da = noisy(("q", "lon", "time", "lat"), chunks)
    ds = sx.smooth(da, "sphere:2", X, std=True, level=0.9, **options)
    expected = ss.make_smoothing_spline(T, rows(da, "time", "q"), "sphere:2", **options)
    assert set(ds.data_vars) == {"points", "std", "band", "lam", "df", "sigma", "at_bound", "converged"}
    np.testing.assert_array_equal(rows(ds.points, "time", "q"), expected(X))
    np.testing.assert_array_equal(rows(ds["std"], "time"), expected.std(X))
    np.testing.assert_array_equal(rows(ds.band, "time"), expected.band(X, 0.9))
    for name in ("lam", "df", "sigma"):
        np.testing.assert_array_equal(rows(ds[name]), getattr(expected, name))
    assert ds.points.attrs == da.attrs and ds["std"].attrs == {"units": "rad"} and ds.converged.all()
    assert (ds.time == X).all() and (ds.lat == da.lat).all()


def test_smoothing_is_lazy_and_keeps_the_times_of_the_data():
    da = noisy(chunks={"lat": 1}, times=dates(T))
    ds = sx.smooth(da, "sphere:2")
    assert ds.points.chunks is not None and set(ds.data_vars) >= {"points", "lam"} and "std" not in ds
    assert (ds.time.values == da.time.values).all() and ds.points.sizes["time"] == 40
    expected = ss.make_smoothing_spline(dates(T), da.values, "sphere:2")
    np.testing.assert_array_equal(ds.points.values, expected(dates(T)))


def test_missing_points_have_no_influence():
    da = noisy()
    da[0, 1, 5:9] = np.nan
    da[1, 2] = np.nan
    ds = sx.smooth(da, "sphere:2", X, std=True)
    kept = np.isfinite(da.values[0, 1]).all(axis=-1)
    weights = np.where(kept, 1.0, 0.0)
    filled = np.where(kept[:, None], da.values[0, 1], da.values[0, 1, 0])
    alone = ss.make_smoothing_spline(T, filled, "sphere:2", weights=weights)
    np.testing.assert_allclose(ds.points.values[0, 1], alone(X), atol=1e-8)
    assert not ds.converged[1, 2] and np.isnan(ds.points[1, 2]).all() and np.isnan(ds["std"][1, 2]).all()
    assert int(ds.converged.sum()) == 5
    one = sx.smooth(da[1, 2], "sphere:2", X)
    assert one.converged.ndim == 0 and not one.converged and np.isnan(one.points).all()


def test_masked_curves_and_times_per_curve():
    da = noisy()
    where = xr.DataArray([True, False, True], dims="lon")
    own = xr.DataArray(np.linspace(1, 9, 6).reshape(2, 3), dims=("lat", "lon"))
    ds = sx.smooth(da, "sphere:2", own, std=True, where=where)
    assert np.isnan(ds.points[:, 1]).all() and ds.points.dims == ("lat", "lon", "q")
    curve = ss.make_smoothing_spline(T, da.values[1, 2], "sphere:2")
    np.testing.assert_allclose(ds.points[1, 2], curve(own.values[1, 2]), atol=1e-12)
    np.testing.assert_allclose(ds["std"][1, 2], curve.std(own.values[1, 2]), rtol=1e-9)


def turning(t):
    return ss.rotations.from_rotation_vectors(0.8 * np.sin(0.9 * np.asarray(t)[:, None] + [0.0, 1.0, 2.0]))


def poses():
    p = np.broadcast_to(np.eye(4), (40, 4, 4)).copy()
    p[:, :3, :3] = SO3.exp(turning(T), 0.03 * SO3.random_tangent(np.random.default_rng(2), turning(T)))
    p[:, :3, 3] = np.sin(T)[:, None] * [1, 2, 3] + 0.1 * np.random.default_rng(3).standard_normal((40, 3))
    return xr.DataArray(p, dims=("time", "row", "column"), coords={"time": T})


def test_poses_have_numbers_per_part():
    ds = sx.smooth(poses(), "se:3", X, point_dims=("row", "column"), std=True, sigma=(0.03, 0.1), criterion="cp")
    expected = ss.make_smoothing_spline(T, poses().values, "se:3", sigma=(0.03, 0.1), criterion="cp")
    np.testing.assert_array_equal(ds.points, expected(X))
    np.testing.assert_array_equal(ds.std_rotation, expected.std(X)[0])
    np.testing.assert_array_equal(ds.std_position, expected.std(X)[1])
    assert float(ds.lam_position) == expected.lam[1] and ds.std_rotation.attrs == {"units": "rad"}


@pytest.mark.parametrize("chunks", [None, {"lat": 1}])
@pytest.mark.parametrize(
    ("match", "options"),
    [
        ("level must lie between 0 and 1", {"level": 95}),
        ("penalty must be 'acceleration' or 'jerk'", {"penalty": "snap"}),
        ("criterion='cp' needs the standard deviation", {"criterion": "cp"}),
        ("x[0] = 11", {"to": [11.0]}),
        ("lam", {"lam": -1.0}),
        ("'q'", {"point_dims": ("r",)}),
    ],
)
def test_invalid_smoothing_raises_at_once(match, options, chunks):
    options = {"to": X} | options
    to = options.pop("to")
    raises(".*" if match == "'q'" else re.escape(match), lambda: sx.smooth(noisy(chunks=chunks), S2, to, **options))


def test_curves_at_a_bound_are_marked_without_a_warning():
    """Lines of noise; warnings are errors in tests."""
    da = xr.DataArray(np.random.default_rng(0).standard_normal((20, 30, 1)), dims=("run", "time", "q"))
    for own in (da, da.chunk(run=5)):
        assert sx.smooth(own, "r:1").at_bound.values.any()
    with pytest.warns(ss.SmoothingWarning):
        ss.make_smoothing_spline(None, da.values, "r:1")


def bursts(chunks=None):
    """A run with a burst of motion, one without, and one with a part of larger noise."""
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 60, 300))
    burst = np.exp(-(((t - 30) / 1.8) ** 2) / 2) * np.sin(np.pi * (t - 30))
    sigma = np.full((3, 300), 0.02)
    sigma[2, (t > 20) & (t < 40)] = 0.2
    y = 0.3 * np.sin(0.1 * np.pi * t) + np.outer([1, 0, 0], burst) + sigma * rng.standard_normal((3, 300))
    coords = {"time": dates(t)}
    da = xr.DataArray(y[..., None], dims=("run", "time", "q"), coords=coords, attrs={"units": "m"})
    return da if chunks is None else da.chunk(chunks)


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
@pytest.mark.parametrize(
    "options", [{"lam": "adaptive"}, {"noise": "adaptive"}, {"lam": "adaptive", "noise": "adaptive"}]
)
@pytest.mark.parametrize("chunks", [None, {"run": 1}])
def test_numbers_that_vary_are_those_of_the_spline(options, chunks):
    da = bursts(chunks)
    x = da.time.values[10:290:20] + np.timedelta64(1, "ms")
    ds = sx.smooth(da, "r:1", x, std=True, **options)
    expected = ss.make_smoothing_spline(da.time.values, da.values, "r:1", **options)
    methods = [{"lam": "lam_at", "noise": "sigma_at"}[name] for name in options]
    assert set(ds.data_vars) == {
        *("points", "std", "lam", "df", "sigma", "at_bound", "converged", "gain"),
        *methods,
    }
    for name in methods:
        assert ds[name].dims == ("run", "time")
        np.testing.assert_array_equal(ds[name], getattr(expected, name)(x))
    np.testing.assert_array_equal(ds.gain, expected.report.gain)
    np.testing.assert_array_equal(ds["std"], expected.std(x))
    if "noise" in options:
        assert ds.sigma_at.attrs == {"units": "m"}


def test_numbers_that_vary_in_masked_curves_and_at_times_per_curve():
    da = bursts().isel(q=0).expand_dims("q", -1)
    x = xr.DataArray(da.time.values[30:270:20].reshape(3, 4), dims=("run", "instant"))
    where = xr.DataArray([True, False, True], dims="run")
    ds = sx.smooth(da, "r:1", x, where=where, lam="adaptive", noise="adaptive")
    assert np.isnan(ds.lam_at[1]).all() and np.isnan(ds.sigma_at[1]).all() and np.isnan(ds.gain[1])
    for i in (0, 2):
        alone = ss.make_smoothing_spline(da.time.values, da.values[i], "r:1", lam="adaptive", noise="adaptive")
        np.testing.assert_array_equal(ds.lam_at[i], alone.lam_at(x.values[i]))
        np.testing.assert_array_equal(ds.sigma_at[i], alone.sigma_at(x.values[i]))
        assert ds.gain[i] == alone.report.gain


def test_samples_without_times_have_no_numbers_that_vary():
    da = bursts()
    times = np.tile(da.time.values, (3, 1))
    times[1, 100:] = np.datetime64("NaT")
    da = da.drop_vars("time").assign_coords(time=(("run", "time"), times))
    ds = sx.smooth(da, "r:1", da.time, dim="time", lam="adaptive")
    assert np.isnan(ds.lam_at[1, 100:]).all() and np.isfinite(ds.lam_at[1, :100]).all()
    alone = ss.make_smoothing_spline(times[0], da.values[0], "r:1", lam="adaptive")
    np.testing.assert_array_equal(ds.lam_at[0], alone.lam_at(times[0]))


def test_one_part_of_poses_varies():
    options = {"lam": ("adaptive", None)}
    ds = sx.smooth(poses(), "se:3", X, point_dims=("row", "column"), **options)
    expected = ss.make_smoothing_spline(T, poses().values, "se:3", **options)
    for ending, lam in zip(("_rotation", "_position"), expected.lam_at(X), strict=True):
        np.testing.assert_array_equal(ds[f"lam_at{ending}"], lam)
    assert float(ds.gain_rotation) == expected.report[0].gain and np.isnan(ds.gain_position)
    assert "sigma_at_rotation" not in ds

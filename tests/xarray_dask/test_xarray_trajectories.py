"""Trajectories with times and missing samples of their own, compared with one spline per trajectory."""

import numpy as np
import pytest
import xarray as xr
from refused import raises

import symspline as ss
import symspline.xarray as sx

S2 = ss.Sphere(2)
START = np.datetime64("2024-05-01T06:00", "ns")
# Samples of four drifters. Incomplete multidimensional arrays of the CF conventions are padded with NaN and NaT.
LENGTHS = (12, 7, 12, 1)
OBS = max(LENGTHS)
HOUR = np.timedelta64(3600 * 10**9, "ns")


def drifters(chunks=None, pad="ns"):
    """Positions of four drifters at irregular times; the second stops early, and the last has one position."""
    seconds = np.cumsum(np.random.default_rng(3).uniform(1800, 30000, (4, OBS)), axis=1)
    time = START + (1e9 * seconds).astype("m8[ns]") if pad == "ns" else seconds
    lon = np.array([0, 120, 178, -60])[:, None] + 2e-5 * seconds
    points = ss.geo.from_lonlat((lon + 180) % 360 - 180, 20 * np.sin(seconds / 1e5 + lon))
    points = np.where(np.arange(OBS)[:, None] < np.array(LENGTHS)[:, None, None], points, np.nan)
    time = np.where(np.arange(OBS) < np.array(LENGTHS)[:, None], time, np.datetime64("NaT") if pad == "ns" else np.nan)
    points[2, 4:6, 1] = np.nan
    coords = {"time": (("traj", "obs"), time), "traj": list("abcd"), "depth": ("traj", [1.0, 2, 3, 4])}
    da = xr.DataArray(points, dims=("traj", "obs", "q"), coords=coords, attrs={"source": "GPS"}, name="track")
    return da.transpose("q", "obs", "traj") if chunks is None else da.chunk(chunks)


def alone(da, name, fit=ss.CubicSpline, **options):
    """The spline of one drifter through its valid samples."""
    own = da.sel(traj=name).transpose("obs", "q")
    times = own.time.values
    kept = np.isfinite(own.values).all(axis=1) & ~(np.isnat(times) if times.dtype.kind == "M" else np.isnan(times))
    return fit(times[kept], own.values[kept], "sphere:2", **options)


@pytest.mark.parametrize("chunks", [None, {"traj": 3}])
@pytest.mark.parametrize("pad", ["ns", "seconds"])
def test_each_trajectory_has_its_own_times(chunks, pad):
    da = drifters(chunks, pad)
    ds = sx.fit(da, "sphere:2", dim="obs", skipna=True, bc_type="not-a-knot")
    assert ds.converged.values.tolist() == [True, True, True, False]
    assert ds.attrs["curve_time"] == "time" and set(ds.time.dims) == {"traj", "obs"}
    for name in "abc":
        spline = alone(da, name, bc_type="not-a-knot")
        x = spline.t[0] + (spline.t[-1] - spline.t[0]) / 7 * np.arange(7)
        own = ds.sel(traj=[name])
        at = xr.DataArray(x[None], dims=("traj", "when"), coords={"traj": [name]})
        for nu in range(3):
            np.testing.assert_allclose(sx.evaluate(own, at, nu=nu)[0], spline(x, nu=nu), rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(sx.speed(own, x)[0], spline.speed(x), rtol=1e-12)
        np.testing.assert_allclose(sx.lift(own, x)[0], spline.lift(x), rtol=1e-12)
        assert sx.evaluate(own, x).dims == ("traj", "time", "q") and (sx.evaluate(own, x).time == x).all()
        assert ds.max_gap.sel(traj=name) == spline.report.max_gap
    # At the samples themselves, missing ones are NaN.
    back = sx.evaluate(ds, ds.time).transpose("traj", "obs", "q")
    assert set(back.time.dims) == {"traj", "obs"} and back.attrs == da.attrs and back.depth.dims == ("traj",)
    expected = da.transpose("traj", "obs", "q").values.copy()
    expected[3] = np.nan
    valid = np.isfinite(expected).all(axis=2)
    np.testing.assert_allclose(back.values[valid], expected[valid], atol=1e-14)
    assert np.isnan(back.values[0:2][~valid[0:2]]).all() and np.isfinite(back.values[2]).all()


@pytest.mark.parametrize("chunks", [None, {"traj": 1}])
def test_all_trajectories_at_the_same_hours(chunks):
    da = drifters(chunks)
    hours = np.arange(START.astype("M8[h]"), START.astype("M8[h]") + 40, dtype="M8[h]").astype("M8[ns]")
    options = {"dim": "obs", "skipna": True, "extrapolate": False}
    made = sx.resample(da, "sphere:2", hours, **options)
    assert made.dims == ("traj", "time", "q") and made.name == "track" and (made.time == hours).all()
    for name in "abc":
        spline = alone(da, name)
        inside = (hours >= spline.t[0]) & (hours <= spline.t[-1])
        assert 0 < inside.sum() <= len(hours)
        np.testing.assert_allclose(made.sel(traj=name).values[inside], spline(hours[inside]), rtol=1e-13, atol=1e-15)
        assert np.isnan(made.sel(traj=name).values[~inside]).all()
    assert np.isnan(made.sel(traj="d")).all()
    masked = xr.DataArray([True, False, True, True], dims="traj", coords={"traj": list("abcd")})
    part = sx.resample(da, "sphere:2", hours, where=masked, **options)
    assert np.isnan(part.sel(traj="b")).all()
    xr.testing.assert_identical(part.sel(traj=["a", "c"]).compute(), made.sel(traj=["a", "c"]).compute())


def test_smoothed_trajectories_with_standard_errors():
    da = drifters()
    noise = 0.01 * S2.random_tangent(
        np.random.default_rng(6), S2.project(np.nan_to_num(da.transpose("traj", "obs", "q").values, nan=0.5))
    )
    noisy = da.transpose("traj", "obs", "q")
    noisy = noisy.copy(data=np.where(np.isfinite(noisy), S2.exp(S2.project(noisy.fillna(0.5).values), noise), np.nan))
    for given in (noisy, noisy.chunk(traj=2)):
        ds = sx.smooth(given, "sphere:2", dim="obs", std=True, level=0.95, lam=1e9)
        assert ds.points.dims == ("traj", "obs", "q") and ds["std"].dims == ("traj", "obs")
        assert ds.time.dims == ("traj", "obs") and ds.converged.values.tolist() == [True, True, True, False]
        # A missing point keeps its knot, which changes the third curve slightly.
        for name in "abc":
            spline = alone(noisy, name, ss.make_smoothing_spline, lam=1e9)
            kept = np.isfinite(noisy.sel(traj=name).values).all(axis=1)
            own = ds.sel(traj=name).isel(obs=kept)
            np.testing.assert_allclose(own.points, spline(spline.t), atol=1e-6)
            np.testing.assert_allclose(own["std"], spline.std(spline.t), rtol=1e-4)
            np.testing.assert_allclose(own.band, spline.band(spline.t, 0.95), rtol=1e-4)
            np.testing.assert_allclose(own.df, spline.df, rtol=1e-4)
        assert np.isnan(ds["std"].sel(traj="b")[LENGTHS[1] :]).all() and np.isnan(ds.points.sel(traj="d")).all()
        at = sx.smooth(given.sel(traj=["a", "b"]), "sphere:2", [START + 12 * HOUR], dim="obs", std=True, lam=1e9)
        assert at.points.dims == ("traj", "time", "q")
        spline = alone(noisy, "b", ss.make_smoothing_spline, lam=1e9)
        np.testing.assert_allclose(at["std"].sel(traj="b")[0], spline.std(START + 12 * HOUR), rtol=1e-6)


def test_smoothed_poses_with_missing_times():
    t = np.array([[0.0, 1, 2.5, 3, 4, np.nan], [0, 2, np.nan, 3, 5, 6]])
    angles = np.nan_to_num(t)[..., None] * [0.1, 0.2, -0.1]
    poses = ss.poses.join(ss.rotations.from_rotation_vectors(angles), 3 * angles)
    da = xr.DataArray(poses, dims=("run", "i", "row", "col"), coords={"stamp": (("run", "i"), t)})
    options = {"dim": "i", "time": "stamp", "point_dims": ("row", "col"), "std": True, "lam": (1.0, 2.0)}
    ds = sx.smooth(da, "se:3", [0.0, 1.5], **options)
    for run in range(2):
        kept = ~np.isnan(t[run])
        spline = ss.make_smoothing_spline(t[run][kept], poses[run][kept], "se:3", lam=(1.0, 2.0))
        np.testing.assert_allclose(ds.points[run], spline([0.0, 1.5]), atol=1e-9)
        for ending, own in zip(("_rotation", "_position"), spline.std([0.0, 1.5]), strict=True):
            np.testing.assert_allclose(ds["std" + ending][run], own, rtol=1e-6, atol=1e-12)


@pytest.mark.filterwarnings("ignore:The residuals:symspline.SmoothingWarning")
def test_one_coordinate_of_times_for_all_curves():
    """The axis has no coordinate, or a counter; the times are irregular, so a counter gives another curve."""
    times = START + np.array([0, 1, 5, 6, 9, 10]) * HOUR
    points = ss.geo.from_lonlat([0, 2, 7, 8, 15, 16], [0, 1, -3, 5, 2, 0])
    da = xr.DataArray(points, dims=("obs", "q"), coords={"when": ("obs", times)})
    x = START + np.array([3, 8]) * HOUR
    expected = ss.CubicSpline(times, points, "sphere:2")
    for given, chosen in [(da, {}), (da, {"time": "when"}), (da.assign_coords(obs=np.arange(6)), {"time": "when"})]:
        made = sx.resample(given, "sphere:2", x, dim="obs", **chosen)
        assert made.dims == ("when", "q")
        np.testing.assert_array_equal(made, expected(x))
        ds = sx.fit(given, "sphere:2", dim="obs", **chosen)
        np.testing.assert_allclose(sx.evaluate(ds, x, nu=1), expected(x, nu=1), rtol=1e-13)
    counted = sx.resample(da.drop_vars("when"), "sphere:2", [2.0], dim="obs")
    np.testing.assert_allclose(counted[0], points[2], atol=1e-15)
    late = da.assign_coords(when=("obs", np.r_[times[:-1], np.datetime64("NaT")]))
    short = ss.CubicSpline(times[:-1], points[:-1], "sphere:2")
    made = sx.resample(late, "sphere:2", x, dim="obs", skipna=True)
    np.testing.assert_allclose(made, short(x), atol=1e-15)
    ds = sx.smooth(late, "sphere:2", dim="obs", std=True, lam=1e-3)
    assert (ds.when.values == times[:-1]).all()
    smooth = ss.make_smoothing_spline(times[:-1], points[:-1], "sphere:2", lam=1e-3)
    np.testing.assert_allclose(ds["std"], smooth.std(times[:-1]), rtol=1e-9)


def test_several_coordinates_in_doubt_raise():
    da = drifters().assign_coords(received=("obs", START + np.arange(OBS) * HOUR))
    found = (
        "several coordinates could hold the times along 'obs': 'time' with dimensions .*, 'received' with dimensions"
    )
    for call, more in ((sx.fit, ()), (sx.resample, ([START],)), (sx.smooth, ())):
        raises(f"{found}.*Pass time= to choose", call, da, "sphere:2", *more, dim="obs")
        raises(
            "time must be the name of a coordinate along 'obs'", call, da, "sphere:2", *more, dim="obs", time="depth"
        )
        raises("time must be the name", call, da, "sphere:2", *more, dim="obs", time=3)
    counted = drifters().assign_coords(obs=np.arange(OBS))
    raises("could hold the times along 'obs': 'obs' .*, 'time' ", sx.fit, counted, "sphere:2", dim="obs")
    assert sx.fit(da, "sphere:2", dim="obs", time="received", skipna=True).max_gap.max() > 3000
    raises("skipna must be", sx.fit, da, "sphere:2", dim="obs", time="time", skipna="yes")
    grid = {"to": {"obs": [0.5]}}
    raises("time and skipna are for curves along one dimension", sx.resample, da, "sphere:2", skipna=True, **grid)
    raises("Make one the coordinate of 'obs'", sx.resample, da, "sphere:2", **grid)
    raises(r"'time' with dimensions .* looks like times", sx.resample, drifters(), "sphere:2", **grid)


def test_short_and_invalid_trajectories():
    da = drifters().transpose("traj", "obs", "q")
    raises(r"curve 3 has 1 valid samples, but needs at least two", sx.fit, da, "sphere:2", dim="obs", skipna=True,
           on_failure="raise")  # fmt: skip
    with pytest.warns(ss.ConvergenceWarning, match="curve 3 has 1 valid samples"):
        sx.fit(da, "sphere:2", dim="obs", skipna=True, on_failure="warn")
    # Without skipna, the padding is an invalid time.
    raises(r"t\[1, 7\] is NaT", sx.fit, da, "sphere:2", dim="obs")
    time = da.time.values.copy()
    time[2, 2] = time[2, 1]
    repeated = da.assign_coords(time=(("traj", "obs"), time))
    raises(r"t\[2\]\[2\] = .* repeats t\[2\]\[1\]", sx.fit, repeated, "sphere:2", dim="obs", skipna=True)
    ds = sx.fit(da, "sphere:2", dim="obs", skipna=True)
    raises(r"x\[0\].* of curve 0|outside the knots", sx.evaluate, ds, [START])
    single = sx.fit(da.isel(traj=3), "sphere:2", dim="obs", skipna=True)
    assert not single.converged and np.isnan(single.points).all()
    split = da.chunk(traj=2).assign_coords(time=da.time.chunk(obs=3))
    raises("'obs' is cut into 4 chunks, but a curve needs all of its times", sx.fit, split, "sphere:2", dim="obs")

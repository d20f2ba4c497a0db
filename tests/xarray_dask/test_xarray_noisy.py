"""Smoothing and estimation in xarray objects: the numbers are those of the functions of plain arrays."""

import re

import numpy as np
import pytest
import xarray as xr
from refused import raises

import symspline as ss
import symspline.xarray as sx
from symspline import measure

RNG = np.random.default_rng(0)
S2, SO3 = ss.Sphere(2), ss.SpecialOrthogonal(3)
T = np.linspace(0, 10, 40)
X = np.array([0.0, 0.3, 4.7, 10.0])
START = np.datetime64("2024-05-01T00:00", "ns")


def dates(t):
    return START + (1e9 * np.asarray(t)).astype("m8[ns]")


def noisy(order=("lat", "lon", "time", "q"), chunks=None, times=T):
    """Noisy tracks on a grid of 2 × 3."""
    phase = RNG.uniform(0, 6, (2, 3, 1))
    p = np.stack([np.cos(0.2 * T + phase), np.sin(0.2 * T + phase), 0.3 * np.sin(0.4 * T + phase)], axis=-1)
    p = S2.project(p)
    p = S2.exp(p, 0.05 * S2.random_tangent(np.random.default_rng(1), p))
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


# ---- estimation ----

S = np.sort(np.random.default_rng(4).uniform(0, 10, 300))
BIAS = np.array([0.05, -0.03, 0.02])


def attitudes(times=lambda t: t, **attrs):
    p = SO3.exp(turning(T), 0.03 * SO3.random_tangent(np.random.default_rng(5), turning(T)))
    return xr.DataArray(p, dims=("time", "row", "column"), coords={"time": times(T)}, attrs=attrs)


def gyro(times=lambda t: t, units="rad/s"):
    fine = np.linspace(0, 10, 300)
    truth = ss.CubicSpline(fine, turning(fine), SO3, bc_type="not-a-knot")
    omega = ss.rotations.angular_velocity(truth, S) + BIAS + 0.01 * np.random.default_rng(6).standard_normal((300, 3))
    coords = {"sample": times(S), "axis": ["x", "y", "z"]}
    return xr.DataArray(omega, dims=("sample", "axis"), coords=coords, attrs={"units": units})


ROTATION = {"sigma": 0.03, "rate_sigma": 0.01, "rate_dim": "sample", "rate_bias": True, "penalty": "jerk"}
ROTATION |= {"point_dims": ("row", "column")}


def estimated(points, rates, knots="auto", t=T, s=S):
    both = [
        measure.Points(t, points, sigma=0.03),
        measure.BodyRates(s, rates, sigma=0.01, bias=measure.Constant(3)),
    ]
    return ss.estimate(both, knots, "so:3", penalty="jerk")


@pytest.mark.parametrize("times", [lambda t: t, dates])
def test_estimates_are_those_of_the_curve(times):
    points, rates = attitudes(times), gyro(times)
    x = times(X)
    ds = sx.estimate(points.transpose("column", ...), "so:3", x, rates=rates.T, level=0.9, **ROTATION)
    curve = estimated(points.values, rates.values, t=times(T), s=times(S))
    np.testing.assert_array_equal(ds.points, curve(x))
    np.testing.assert_array_equal(ds["std"], curve.std(x))
    np.testing.assert_array_equal(ds.band, curve.band(x, 0.9))
    bias = curve.parameters["gyro bias"]
    np.testing.assert_array_equal(ds.gyro_bias, bias.value)
    np.testing.assert_array_equal(ds.gyro_bias_std, bias.std)
    assert (np.abs(ds.gyro_bias - BIAS) < 5 * ds.gyro_bias_std).all()
    assert ds.points.dims == ("time", "row", "column") and (ds.time.values == x).all()
    assert list(ds.axis.values) == ["x", "y", "z"] and ds.gyro_bias.attrs == ds.gyro_bias_std.attrs == {
        "units": "rad/s"
    }
    assert ds["std"].attrs == {"units": "rad"} and float(ds.lam) == curve.lam and ds.attrs == {"space": "so:3"}


def test_missing_values_and_dask():
    points, rates = attitudes(), gyro()
    points[3], rates[7, 1], rates[100:120] = np.nan, np.nan, np.nan
    ds = sx.estimate(points.chunk(time=10), "so:3", rates=rates.chunk(sample=50), **ROTATION)
    kept, good = np.delete(np.arange(40), 3), np.isfinite(rates.values).all(axis=1)
    curve = estimated(points.values[kept], rates.values[good], t=T[kept], s=S[good])
    np.testing.assert_array_equal(ds.points, curve(T))
    assert ds.sizes["time"] == 40


@pytest.mark.filterwarnings("ignore:The residuals:symspline.SmoothingWarning")
def test_positions_and_velocities():
    path = np.stack([np.sin(T), np.cos(T)], axis=-1)
    speed = np.stack([np.cos(S), -np.sin(S)], axis=-1)
    points = xr.DataArray(path, dims=("time", "q"), coords={"time": T, "q": ["x", "y"]}, attrs={"units": "m"})
    given = xr.DataArray(speed, dims=("sample", "q"), coords={"sample": S})
    ds = sx.estimate(points, "r:2", X, sigma=0.1, velocities=given, velocity_sigma=0.1, velocity_dim="sample", knots=20)
    both = [measure.Points(T, path, sigma=0.1), measure.Velocities(S, speed, speed, sigma=0.1)]
    np.testing.assert_allclose(ds.points, ss.estimate(both, 20, "r:2")(X), atol=1e-12)
    assert ds["std"].attrs == {"units": "m"} and ds.points.attrs == {"units": "m"} and list(ds.q.values) == ["x", "y"]
    more = [measure.Function(S, lambda x: x[:, 0] - np.sin(S), sigma=0.01)]
    assert sx.estimate(points, "r:2", 0.5, sigma=0.1, measurements=more, knots=20).points.dims == ("q",)


@pytest.mark.parametrize(
    ("match", "change"),
    [
        ("rates has the units 'deg/s', but radians are needed", {"rates": gyro(units="deg/s")}),
        ("rates need the standard deviation of a component", {"rate_sigma": None}),
        ("rate_sigma and rate_bias belong to rates", {"rates": None}),
        ("'time'. Pass the name of its times", {"rate_dim": None}),
        ("one dimension of three components", {"rates": gyro()[:, :2]}),
        ("'sample' of rates has no coordinate", {"rates": gyro().drop_vars("sample")}),
        ("rates must be an xarray.DataArray", {"rates": gyro().values}),
        ("some measurements have dates and others have numbers", {"rates": gyro(dates)}),
        ("velocity_sigma belongs to velocities", {"velocity_sigma": 1.0}),
        ("outside the knots", {"to": [11.0]}),
    ],
)
def test_invalid_estimates_raise(match, change):
    options = {"rates": gyro(), "to": X} | ROTATION | change
    raises(re.escape(match), lambda: sx.estimate(attitudes(), "so:3", **options))


def test_one_curve_is_estimated():
    several = xr.concat([attitudes(), attitudes()], "run")
    raises(
        "points has the dimensions run besides", sx.estimate, several, "so:3", sigma=1.0, point_dims=("row", "column")
    )
    raises("points must be an xarray.DataArray", sx.estimate, attitudes().values, "so:3", sigma=1.0)
    lonely = {"sigma": 0.1, "velocities": noisy()[0, 0].rename(time="s"), "velocity_sigma": 0.1, "velocity_dim": "s"}
    shifted = lonely | {"velocities": lonely["velocities"].assign_coords(s=T + 0.01)}
    raises("are tangent vectors at the points", sx.estimate, noisy()[0, 0], "sphere:2", **shifted)


def test_curves_at_a_bound_are_marked_without_a_warning():
    """Lines of noise; warnings are errors in tests."""
    da = xr.DataArray(np.random.default_rng(0).standard_normal((20, 30, 1)), dims=("run", "time", "q"))
    for own in (da, da.chunk(run=5)):
        assert sx.smooth(own, "r:1").at_bound.values.any()
    with pytest.warns(ss.SmoothingWarning):
        ss.make_smoothing_spline(None, da.values, "r:1")

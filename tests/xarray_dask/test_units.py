"""The attribute ``units`` of angles on a torus."""

import warnings

import numpy as np
import pytest
import xarray as xr

import symspline.xarray as sx

DIRECTIONS = np.array([350, 10.5, 30, 20, 355, 340.25, 3, 0])
T = 5 + np.arange(8) ** 1.3


def data(angles=DIRECTIONS, **attrs):
    return xr.DataArray(angles[:, None], dims=("time", "q"), coords={"time": T}, attrs=attrs)


@pytest.mark.parametrize("unit", ["degree", "degrees", "deg", "Degrees"])
def test_angles_in_degrees_are_converted(unit):
    da, x = data(units=unit, long_name="wind"), np.linspace(T[0], T[-1], 9)
    right = sx.resample(data(np.radians(DIRECTIONS), units="radian"), "torus:1", x)
    found = sx.resample(da, "torus:1", x)
    np.testing.assert_allclose(found, np.degrees(right), atol=1e-9)
    assert found.attrs == da.attrs
    np.testing.assert_allclose(sx.resample(da.chunk(), "torus:1", x), found, atol=1e-12)
    ds = sx.fit(da, "torus:1")
    np.testing.assert_allclose(sx.evaluate(ds, x), right, atol=1e-12)
    assert ds.points.attrs["units"] == sx.evaluate(ds, x).attrs["units"] == "radian"
    smooth = sx.smooth(da, "torus:1", x, lam=1e-3, std=True)
    expected = sx.smooth(data(np.radians(DIRECTIONS)), "torus:1", x, lam=1e-3)
    np.testing.assert_allclose(smooth.points, expected.points, atol=1e-12)
    assert smooth.points.attrs["units"] == "radian" and smooth["std"].attrs["units"] == "rad"


def test_grids():
    angles = (DIRECTIONS.reshape(2, 4) + np.arange(4)) % 360
    da = xr.DataArray(angles[..., None], dims=("y", "x", "q"), attrs={"units": "degree"})
    to = {"x": [0.5, 2.0], "y": [0.0, 0.5]}
    right = np.degrees(sx.resample(np.radians(da).assign_attrs(units="radian"), "torus:1", to))
    np.testing.assert_allclose(sx.resample(da, "torus:1", to), right, atol=1e-9)


def test_angles_that_look_like_degrees_warn():
    for call in (lambda da: sx.fit(da, "torus:1"), lambda da: sx.resample(da, "torus:1", T[2:4])):
        with pytest.warns(UserWarning, match=r"angles up to 355 look like degrees.*units"):
            call(data())
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            call(data(units="degree"))
            warnings.filterwarnings("ignore", "more than half of the steps")
            call(data(np.radians(DIRECTIONS)))
            call(data(units="radian"))

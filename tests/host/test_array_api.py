"""Functions return arrays of the library that their input comes from; blocks of dask raise an error."""

import array_api_strict as strict
import dask.array
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from compare import same
from curves import S2, points_on
from refused import raises

import symspline as ss

X = np.array([0.5, 2.0, 4.5])
POINTS = points_on(S2, 6, (2,))


@pytest.mark.parametrize("space", ["sphere:2", "so:3", "cp:2"])
def test_array_api_strict(space):
    p = points_on(ss.space(space), 6, (2,))
    u, report = ss.fit(None, strict.asarray(p), space)
    plain, expected = ss.fit(None, p, space)
    assert type(u) is type(strict.asarray(p)) and u.dtype == strict.asarray(plain).dtype
    assert same(np.asarray(u), plain) and report == expected
    values = ss.evaluate(strict.asarray(np.arange(6.0)), strict.asarray(p), u, space, strict.asarray(X), nu=1)
    assert type(values) is type(u) and same(np.asarray(values), ss.evaluate(None, p, plain, space, X, nu=1))
    for mixed in (ss.evaluate(None, p, plain, space, strict.asarray(X)), ss.evaluate(None, p, u, space, X)):
        assert type(mixed) is type(u) and same(np.asarray(mixed), ss.evaluate(None, p, plain, space, X))


def test_jax():
    u, _ = ss.fit(None, jnp.asarray(POINTS), S2)
    values = ss.evaluate(None, jnp.asarray(POINTS), u, S2, jnp.asarray(X))
    assert isinstance(u, jnp.ndarray) and isinstance(values, jnp.ndarray) and values.shape == (2, 3, 3)
    # JAX has single precision unless it is told otherwise.
    expected = ss.CubicSpline(None, POINTS, S2)
    np.testing.assert_allclose(u, expected.velocities, atol=1e-6)
    np.testing.assert_allclose(values, expected(X), atol=1e-6)


def test_parts_of_a_product():
    p = POINTS, np.arange(12.0).reshape(2, 6, 1)
    u, _ = ss.fit(None, tuple(map(strict.asarray, p)), "sphere:2 x r:1")
    assert [type(part) for part in u] == [type(strict.asarray(X))] * 2
    values = ss.evaluate(None, p, u, "sphere:2 x r:1", X)
    assert [part.shape for part in values] == [(2, 3, 3), (2, 3, 1)]
    np.testing.assert_allclose(np.asarray(values[1])[0, :, 0], X, atol=1e-14)


def test_numpy_stays():
    u, _ = ss.fit(None, POINTS.tolist(), S2)
    assert type(u) is np.ndarray and type(ss.evaluate(None, POINTS, u, S2, 0.5)) is np.ndarray
    u, _ = ss.fit(None, xr.DataArray(POINTS), S2)
    assert type(u) is np.ndarray


@pytest.mark.parametrize("wrap", [dask.array.from_array, lambda a: xr.DataArray(a).chunk(1)], ids=["dask", "xarray"])
def test_blocks_of_dask_are_refused(wrap):
    u, _ = ss.fit(None, POINTS, S2)
    spline = ss.CubicSpline(None, POINTS, S2)
    dates = np.datetime64("2021-08-28") + np.arange(6)
    for call, name in (
        (lambda: ss.fit(None, wrap(POINTS), S2), "points"),
        (lambda: ss.CubicSpline(None, wrap(POINTS), S2), "points"),
        (lambda: ss.fit(wrap(np.arange(6.0)), POINTS, S2), "t"),
        (lambda: ss.fit(wrap(dates), POINTS, S2), "t"),
        (lambda: ss.evaluate(None, POINTS, u, S2, wrap(X)), "x"),
        (lambda: ss.evaluate(None, POINTS, wrap(u), S2, X), "velocities"),
        (lambda: spline(wrap(X)), "x"),
        (lambda: S2.distance(POINTS, wrap(POINTS)), "q"),
    ):
        raises(f"^{name} is in blocks of dask, .* symspline.xarray works block by", call)
    assert ss.CubicSpline(None, xr.DataArray(POINTS), S2) == spline

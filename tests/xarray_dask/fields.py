"""Curves in xarray objects that the tests of the adapter share."""

import numpy as np
import xarray as xr
from curves import points_on

import symspline as ss

LAT, LON, KNOTS = 2, 6, 10


def point_dims(space):
    return tuple("rs"[: len(ss.space(space).point_shape)])


def field(space="sphere:2", chunks=None, order=None, step=0.4):
    """Points of 2 × 6 curves with knots at 0, 1, 2.5, 4, …, by names of dimensions."""
    p = points_on(ss.space(space), KNOTS, (LAT, LON), step=step)
    times = np.r_[0.0, 1.0, 2.5 + 1.5 * np.arange(KNOTS - 2)]
    da = xr.DataArray(
        p,
        dims=("lat", "lon", "time", *point_dims(space)),
        coords={
            "time": ("time", times, {"long_name": "when"}),
            "flag": ("time", np.arange(KNOTS)),
            "lat": ("lat", [10.0, 20.0], {"units": "degrees_north"}),
            "place": (("lat", "lon"), np.arange(LAT * LON).reshape(LAT, LON)),
            "s" if len(p.shape) > 4 else "r": np.arange(p.shape[-1]) + 5,
        },
        attrs={"units": "1", "source": "a test"},
        name="direction",
    )
    if order is not None:
        da = da.transpose(*order)
    return da if chunks is None else da.chunk(chunks)


def numbers(array, *last):
    """The numbers of a DataArray in the order of the dimensions of curves, then of these."""
    return array.transpose("lat", "lon", *last).values

"""Curves that were fitted before, at times."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from .._arrays import short_repr
from .._core import ValidationError
from .._options import checked_extrapolate, extrapolation_mode
from .._spaces import space_named
from ._blocks import Inputs, apply, values_at
from ._spec import check_dims, rehearse, times_with_names

# The dimension of the knots where a result has times of its own, which may have the same name.
KNOTS = "symspline_knots"


def along(ds: xr.Dataset, x: Any, quantity: str, extrapolate: Any, lifted: bool = False) -> xr.DataArray:
    """A quantity of curves at times x."""
    if not isinstance(ds, xr.Dataset):
        raise ValidationError(f"ds is not what symspline.xarray.fit returns: it is {short_repr(ds)}")
    try:
        space = space_named(ds.attrs["space"])
        dim, point_dims, policy = (ds.attrs[name] for name in ("curve_dim", "point_dims", "extrapolate"))
        points, velocities = ds["points"], ds["velocities"]
    except (AttributeError, KeyError) as error:
        raise ValidationError(f"ds is not what symspline.xarray.fit returns: it has no {error}") from None
    # Some file formats make one text of a list with one.
    point_dims = [point_dims] if isinstance(point_dims, str) else list(point_dims)
    for array in (points, velocities):
        check_dims(array, space, dim, point_dims)
    if extrapolate is not None:
        policy = extrapolation_mode(checked_extrapolate(extrapolate), ds.attrs.get("bc_type"))
    times, axes = times_with_names(x, dim, point_dims, [d for d in points.dims if d not in (dim, *point_dims)])
    t = points[dim].values if dim in points.coords else None
    rehearse(times, t, points.sizes[dim], policy)
    own = [KNOTS, *point_dims]
    shape = [] if quantity == "speed" else point_dims
    inputs: Inputs = [(bare(points, dim), own), (bare(velocities, dim), own), (times, axes)]
    fixed = {"space": space, "t": t, "quantity": quantity, "policy": policy, "x_axes": len(axes), "lifted": lifted}
    (values,) = apply(values_at, inputs, [[*axes, *shape]], [space.dtype if shape else np.float64], **fixed)
    if quantity == "point":
        values.attrs = dict(points.attrs)
    return timed_by(values, times, dim).rename(quantity)


def bare(array: xr.DataArray, dim: str) -> xr.DataArray:
    """An array whose dimension of knots has nothing to do with times of that name."""
    return array.drop_vars([name for name, c in array.coords.items() if dim in c.dims]).rename({dim: KNOTS})


def timed_by(values: xr.DataArray, times: xr.DataArray, dim: str) -> xr.DataArray:
    """The values with their times as a coordinate, where that can have the name of the dimension of time."""
    fits = dim not in times.dims or times.ndim == 1
    return values.assign_coords({dim: times}) if fits else values

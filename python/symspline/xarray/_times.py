"""The coordinate that holds the times of points in an xarray object."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import cast

import xarray as xr

from .._base.arrays import short_repr
from .._core import ValidationError


def times_along(
    da: xr.DataArray, dim: str, time: Hashable | None, point_dims: Sequence[str], remedy: str = "Pass time= to choose"
) -> xr.DataArray | None:
    """Return the coordinate of the times along a dimension, or None if there is none.

    A coordinate of several dimensions, ``time(traj, obs)``, is the layout of trajectories in the CF conventions 1.11,
    section H.4.

    Parameters
    ----------
    da : xarray.DataArray
        Points.
    dim : str
        Dimension along the curves.
    time : str, optional
        Name of the coordinate. By default the coordinate of `dim`, or the only other one that looks like times.
    point_dims : sequence of str
        Dimensions of a point, which times cannot have.
    remedy : str
        What to do if the coordinate is in doubt.
    """
    along = [name for name, c in da.coords.items() if dim in c.dims and not set(c.dims) & set(point_dims)]
    if time is not None:
        if not isinstance(time, str) or time not in along:
            names = ", ".join(map(repr, along)) if along else "none"
            raise ValidationError(
                f"time must be the name of a coordinate along {dim!r} without dimensions of points, not "
                f"{short_repr(time)}. Such coordinates are: {names}."
            )
        return cast(xr.DataArray, da.coords[time])
    own = dim in da.coords
    others = [name for name in along if name != dim and _are_times(name, da.coords[name])]
    if own and (not others or _are_times(dim, da.coords[dim])):
        return cast(xr.DataArray, da.coords[dim])
    if not others:
        return None
    if own or len(others) > 1:
        named = [dim] * own + others
        names = ", ".join(f"{name!r} with dimensions {da.coords[name].dims}" for name in named)
        raise ValidationError(f"several coordinates could hold the times along {dim!r}: {names}. {remedy}.")
    return cast(xr.DataArray, da.coords[others[0]])


def _are_times(name: Hashable, coordinate: xr.DataArray) -> bool:
    """Whether a coordinate holds times, by its type, its name, or its attributes of the CF conventions (4.4)."""
    words = coordinate.attrs
    return (
        coordinate.dtype.kind in "mM"
        or str(name).lower() in ("t", "time", "times")
        or words.get("standard_name") == "time"
        or words.get("axis") == "T"
        or " since " in str(words.get("units", ""))
    )

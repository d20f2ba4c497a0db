"""Angles in degrees, by the attribute ``units`` of an array."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from .._base.warnings import warn
from .._spaces import Space, Torus, space_named
from .._spaces.degrees import is_degrees, look_like_degrees


def in_radians(da: Any, space: Space[Any] | str) -> Any:
    """Return points with the angles of a torus in radians, by their attribute ``units``; others do not change.

    Warns
    -----
    UserWarning
        If there is no such attribute, and the angles look like degrees.
    """
    if not isinstance(da, xr.DataArray) or not isinstance(space_named(space), Torus):
        return da
    if is_degrees(da.attrs.get("units", "")):
        return (da * (np.pi / 180)).assign_attrs(da.attrs | {"units": "radian"})
    if "units" not in da.attrs and da.chunks is None and da.dtype.kind in "iuf" and da.ndim:
        largest = look_like_degrees(space_named(space), da.values)
        if largest is not None:
            warn(
                f"angles up to {largest:g} look like degrees, but angles on {space} are in radians. If they are "
                "degrees, set da.attrs['units'] = 'degree'; otherwise set 'radian'.",
                UserWarning,
            )
    return da


def in_units_of(values: xr.DataArray, da: xr.DataArray, space: Space[Any]) -> xr.DataArray:
    """Return points of `space` with the attributes of `da`, angles of a torus in its units."""
    if isinstance(space, Torus) and is_degrees(da.attrs.get("units", "")):
        values = values * (180 / np.pi)
    values.attrs = dict(da.attrs)
    return values

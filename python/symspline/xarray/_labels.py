"""Coordinates of times, units of angles, and missing samples in xarray objects."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from typing import Any, cast

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .._autodiff.compiled import joined
from .._base.arrays import short_repr
from .._base.faults import warn
from .._base.report import ConvergenceWarning
from .._core import ValidationError
from .._curves.missing import Mask, missing_points, missing_times
from .._spaces import AnySpace, Array, Torus, space_named
from .._spaces.degrees import is_degrees, look_like_degrees
from .._splines.cubic import CubicSpline
from .._splines.functional import fit_many


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
    has_own = dim in da.coords
    others = [name for name in along if name != dim and _are_times(name, da.coords[name])]
    if has_own and (not others or _are_times(dim, da.coords[dim])):
        return cast(xr.DataArray, da.coords[dim])
    if not others:
        return None
    if has_own or len(others) > 1:
        named = [dim] * has_own + others
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


# ---- angles in degrees, by the attribute ``units`` of an array ----


def in_radians(da: Any, space: AnySpace | str) -> Any:
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


def in_units_of(values: xr.DataArray, da: xr.DataArray, space: AnySpace) -> xr.DataArray:
    """Return points of `space` with the attributes of `da`, angles of a torus in its units."""
    if isinstance(space, Torus) and is_degrees(da.attrs.get("units", "")):
        values = values * (180 / np.pi)
    values.attrs = dict(da.attrs)
    return values


# ---- curves with missing samples, which are dropped curve by curve ----


def times_of_rows(t: Array | None, batch: tuple[int, ...], nodes: int) -> Array:
    """Return the times of each curve of a flattened batch, shape (curves, nodes)."""
    t = np.arange(nodes, dtype=np.float64) if t is None else t
    return np.broadcast_to(t, (*batch, nodes)).reshape(-1, nodes)


def of_equal_length(valid: Mask) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Group curves by their number of valid samples.

    Parameters
    ----------
    valid : ndarray of bool, shape (curves, nodes)
        Valid samples.

    Yields
    ------
    curves : ndarray of int, shape (k,)
        Curves with the same number m of valid samples, at least two.
    nodes : ndarray of int, shape (k, m)
        The valid samples of each of them.
    """
    counts = valid.sum(axis=1)
    for count in np.unique(counts[counts > 1]):
        curves = np.flatnonzero(counts == count)
        yield curves, np.nonzero(valid[curves])[1].reshape(len(curves), count)


def fit_valid(
    points: Array, t: Array | None, named: dict[str, Array], space: AnySpace, kinds: Any, how: dict[str, Any]
) -> tuple[Array, Array, list[CubicSpline[Any]]]:
    """Fit each curve of a block to its valid samples.

    Returns
    -------
    points, velocities : ndarray, shape (*batch, nodes, *point_shape)
        NaN at missing samples, and for curves that do not exist.
    splines : list of CubicSpline
        The curves of the flattened batch.
    """
    lead = points.ndim - 1 - len(space.point_shape)
    batch, nodes = points.shape[:lead], points.shape[lead]
    rows = points.reshape(-1, nodes, *space.point_shape)
    times = times_of_rows(t, batch, nodes)
    valid = ~missing_points(space, rows) & ~missing_times(times)
    mask = np.broadcast_to(named.get("where", np.True_), batch).reshape(-1)
    enough = valid.sum(axis=1) > 1
    _report_short(np.flatnonzero(mask & ~enough), valid, batch, how["on_failure"])
    # Curves that are too short are masked. Their times must increase nevertheless.
    pairs = [
        (times[i][samples], rows[i][samples]) if enough[i] else (np.arange(2.0), rows[i][[0, 0]])
        for i, samples in enumerate(valid)
    ]
    start, end = (named[name].reshape(-1, *space.point_shape) if name in named else None for name in ("start", "end"))
    try:
        splines = fit_many(pairs, space, bc_type=joined(kinds, (start, end)), where=mask & enough, **how)
    except ValidationError as error:
        raise named_curve(error, batch, np.arange(len(rows))) from None
    arrays = np.full((2, *rows.shape), np.nan, space.dtype)
    for i, spline in enumerate(splines):
        if enough[i]:
            arrays[0, i, valid[i]], arrays[1, i, valid[i]] = spline.points, spline.velocities
    return arrays[0].reshape(points.shape), arrays[1].reshape(points.shape), splines


def _report_short(short: NDArray[np.intp], valid: Mask, batch: tuple[int, ...], on_failure: str) -> None:
    """Raise or warn if curves have too few samples."""
    if not short.size or on_failure == "ignore":
        return
    first, more = short[0], f" (and {len(short) - 1} more curves)" if len(short) > 1 else ""
    index = tuple(map(int, np.unravel_index(first, batch))) if batch else ()
    of = f"curve {','.join(map(str, index))}" if index else "the curve"
    message = (
        f"{of}{more} has {valid[first].sum()} valid samples, but needs at least two. Mask it by where=, or pass "
        "on_failure='ignore' to make it NaN."
    )
    if on_failure == "warn":
        return warn(message, ConvergenceWarning, index)
    error = ValidationError(message)
    error.curve = index
    raise error


def named_curve(error: Any, batch: tuple[int, ...], curves: NDArray[np.intp]) -> Any:
    """Return an error whose curve is named by its index in the batch instead of its number among some curves."""
    number = getattr(error, "curve", None)
    if not number:
        return error
    index = tuple(map(int, np.unravel_index(curves[number[0]], batch))) if batch else ()
    name = f"curve {','.join(map(str, index))}" if index else "the curve"
    error = error._with_message(str(error).replace(f"curve {number[0]}", name))
    error.curve = index
    return error

"""Blocks of curves: functions of plain arrays, and how they are called on those of dask."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from .._autodiff.compiled import joined
from .._base.report import Report, columns_of
from .._base.system import one_thread
from .._core import ConvergenceError, CutLocusError, ValidationError
from .._curves.composed import call_at_times
from .._curves.missing import missing_times
from .._spaces import Array, Space
from .._splines.cubic import CubicSpline
from .._splines.functional import given
from ._labels import fit_valid, named_curve, of_equal_length, times_of_rows

# Arrays with their core dimensions, which a block has all of.
Inputs = list[tuple[xr.DataArray, Sequence[Hashable]]]

# The columns of the report, one value per curve.
COLUMNS = columns_of(Report)


def apply(
    function: Any, inputs: Inputs, output_core_dims: list[list[Hashable]], output_dtypes: list[Any], **kwargs: Any
) -> tuple[xr.DataArray, ...]:
    """The outputs of a function of blocks."""
    arrays = _cut_alike([array for array, _ in inputs])
    kwargs["function"] = function
    # A worker of dask is one of many and uses one thread; other arrays are computed by all threads.
    kwargs["alone"] = any(array.chunks is not None for array in arrays)
    found = xr.apply_ufunc(
        _block,
        *arrays,
        input_core_dims=[core for _, core in inputs],
        output_core_dims=output_core_dims,
        dask="parallelized",
        # Types alone would be cast from that of the points, and dask warns where those are complex.
        dask_gufunc_kwargs={"meta": tuple(np.empty(0, dtype) for dtype in output_dtypes)},
        join="exact",
        # Of coordinates, too; those of variables are set afterwards.
        keep_attrs="override",
        kwargs=kwargs,
    )
    outputs: tuple[xr.DataArray, ...] = found if isinstance(found, tuple) else (found,)
    for output in outputs:
        output.attrs = {}
    return outputs


def _cut_alike(arrays: list[xr.DataArray]) -> list[xr.DataArray]:
    """Arrays of dask in the blocks of the first array; dimensions that it does not have are one chunk."""
    first, *others = arrays
    cuts = first.variable.chunksizes
    return [first, *(a if a.chunks is None else a.chunk({d: cuts.get(d, -1) for d in a.dims}) for a in others)]


def _block(*arrays: Array, function: Any, alone: bool, **kwargs: Any) -> Any:
    if not alone:
        return function(*arrays, **kwargs)
    with one_thread():
        try:
            return function(*arrays, **kwargs)
        except (ConvergenceError, CutLocusError, ValidationError) as error:
            # The good curves of one block are nothing to send to another process.
            vars(error).pop("spline", None)
            error.add_note("Indices of curves count within one block of the dask array.")
            raise


def spline_of(
    points: Array, rest: Sequence[Array], space: Space, t: Any, kinds: Any, names: list[str], how: dict[str, Any]
) -> CubicSpline:
    """The splines of a block."""
    named = dict(zip(names, rest, strict=True))
    batch = points.shape[: points.ndim - 1 - len(space.point_shape)]
    mask = np.broadcast_to(named["where"], batch) if "where" in named else None
    bc_type = joined(kinds, (named.get("start"), named.get("end")))
    t = knots_of_block(t, named, batch)
    return CubicSpline(t, points, space, bc_type=bc_type, where=mask, **how)


def knots_of_block(t: Array | None, named: dict[str, Array], batch: tuple[int, ...]) -> Array | None:
    """Return the knots: those of all curves, or those of each curve, which are an input of the block."""
    return np.broadcast_to(named["t"], (*batch, named["t"].shape[-1])) if "t" in named else t


def fitted(
    points: Array, *rest: Array, space: Space, t: Any, kinds: Any, names: list[str], how: dict[str, Any], skipna: bool
) -> tuple[Array, ...]:
    """Points, velocities and the columns of the report of a block."""
    if not skipna:
        spline = spline_of(points, rest, space, t, kinds, names, how)
        found, velocities, reports = spline.points, spline.velocities, [spline.report]
    else:
        named = dict(zip(names, rest, strict=True))
        batch = points.shape[: points.ndim - 1 - len(space.point_shape)]
        knots = knots_of_block(t, named, batch)
        found, velocities, splines = fit_valid(points, knots, named, space, kinds, how)
        reports = [spline.report for spline in splines]
    columns: list[Array] = []
    for name, dtype in COLUMNS.items():
        values = [getattr(own, name) for own in reports]
        column: Array = np.asarray([np.nan if value is None else value for value in values], dtype)
        columns.append(column.reshape(batch) if skipna else column[0])
    return found, velocities, *(np.broadcast_to(c, columns[0].shape) for c in columns)


def resampled(points: Array, x: Array, *rest: Array, x_axes: int, skipna: bool, policy: str, **options: Any) -> Array:
    """Values of the splines of a block."""
    if skipna:
        found, velocities, *columns = fitted(points, *rest, skipna=True, **options)
        named = dict(zip(options["names"], rest, strict=True))
        t = knots_of_block(options["t"], named, points.shape[: points.ndim - 1 - len(options["space"].point_shape)])
        fixed: dict[str, Any] = {"space": options["space"], "quantity": "point", "policy": policy}
        values = values_at(found, velocities, x, t=t, x_axes=x_axes, skipna=True, **fixed)
        values[~columns[list(COLUMNS).index("converged")]] = np.nan
        return values
    spline = spline_of(points, rest, **options)
    x, per_curve = per_curve_times(x, spline._curve.batch, x_axes)
    values = spline(x, per_curve=per_curve)
    values[~np.asarray(spline.report.converged)] = np.nan
    return values


def values_at(
    points: Array,
    velocities: Array,
    x: Array,
    *knots: Array,
    space: Space,
    t: Array | None,
    quantity: str,
    policy: str,
    x_axes: int,
    lifted: bool = False,
    skipna: bool = False,
) -> Array:
    """A quantity of the curves of a block; curves that were not fitted are NaN.

    The knots are `t`, for all curves or of each curve, or an input of the block.
    """
    lead = points.ndim - 1 - len(space.point_shape)
    batch = points.shape[:lead]
    x, per_curve = per_curve_times(x, batch, x_axes)
    if knots:
        t = np.broadcast_to(knots[0], (*batch, points.shape[lead]))
    options: dict[str, Any] = {"space": space, "quantity": quantity, "policy": policy, "lifted": lifted}
    if skipna:
        return _values_of_valid(points, velocities, x, t, batch, per_curve, options)
    good = space._where_finite(velocities).all(axis=-1)
    everyone = bool(good.all())
    if not everyone:
        points, velocities, x = points[good], velocities[good], x[good] if per_curve else x
        t = t[good] if t is not None and t.ndim > 1 else t
    shape = () if quantity == "speed" else space.point_shape
    if not good.any():
        return np.full(batch + x.shape[x.ndim - x_axes :] + shape, np.nan, space.dtype if shape else float)
    time_axis, curve = given(t, points, velocities, space)
    method = curve.lift if lifted else curve.evaluate
    found = call_at_times(
        curve, time_axis, x, per_curve, policy, lambda x, outside, own: method(x, quantity, outside, own)
    )
    if everyone:
        return np.asarray(found)
    values = np.full(batch + found.shape[1:], np.nan, found.dtype)
    values[good] = found
    return values


def _values_of_valid(
    points: Array,
    velocities: Array,
    x: Array,
    t: Array | None,
    batch: tuple[int, ...],
    per_curve: bool,
    options: dict[str, Any],
) -> Array:
    """A quantity of curves through their valid samples. Missing sampling times of a curve give NaN."""
    space = options["space"]
    nodes, shape = points.shape[len(batch)], () if options["quantity"] == "speed" else space.point_shape
    own_shape = x.shape[len(batch) :] if per_curve else x.shape
    rows, rates = (own.reshape(-1, nodes, *space.point_shape) for own in (points, velocities))
    times = times_of_rows(t, batch, nodes)
    at = np.broadcast_to(x, (*batch, *own_shape)).reshape(len(rows), *own_shape) if per_curve else x
    values = np.full((len(rows), *own_shape, *shape), np.nan, space.dtype if shape else float)
    for curves, kept in of_equal_length(space._where_finite(rates) & ~missing_times(times)):
        chosen, knots = (curves[:, None], kept), times[curves[:, None], kept]
        here, gone = at, None
        if per_curve:
            gone = missing_times(at[curves])
            here = np.where(gone, knots[:, 0].reshape(-1, *[1] * len(own_shape)), at[curves])
        try:
            found = values_at(rows[chosen], rates[chosen], here, t=knots, x_axes=len(own_shape), **options)
        except ValidationError as error:
            raise named_curve(error, batch, curves) from None
        if gone is not None:
            found[gone] = np.nan
        values[curves] = found
    return values.reshape(*batch, *own_shape, *shape)


def per_curve_times(x: Array, batch: tuple[int, ...], axes: int) -> tuple[Array, bool]:
    """Times for every curve, if they have its dimensions."""
    if x.ndim == axes:
        return x, False
    return np.broadcast_to(x, batch + x.shape[x.ndim - axes :]), True

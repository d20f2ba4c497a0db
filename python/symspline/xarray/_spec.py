"""Coordinates of times, units of angles, and missing samples in xarray objects."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from typing import Any, TypeVar, cast

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .._autodiff.compiled import joined, split
from .._base.arrays import as_array, short_repr
from .._base.faults import warn
from .._base.input import times_of
from .._base.report import ConvergenceWarning, Report, columns_of
from .._base.system import one_thread
from .._base.typing import Array, Keywords
from .._core import ConvergenceError, CutLocusError, ValidationError
from .._curves.composed import call_at_times
from .._curves.missing import Mask, missing_points, missing_times
from .._spaces import AnySpace, Euclidean, Product, Space, Torus, space_named
from .._spaces.degrees import is_degrees, look_like_degrees
from .._splines.cubic import CubicSpline
from .._splines.functional import fit_many, given


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
    has_coordinate = dim in da.coords
    others = [name for name in along if name != dim and _are_times(name, da.coords[name])]
    if has_coordinate and (not others or _are_times(dim, da.coords[dim])):
        return cast(xr.DataArray, da.coords[dim])
    if not others:
        return None
    if has_coordinate or len(others) > 1:
        named = [dim] * has_coordinate + others
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


def of_equal_length(
    valid: Mask, times: Array, at: Array, per_curve: bool
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp], Array, Array, Mask | None]]:
    """Group curves by their number of valid samples.

    Parameters
    ----------
    valid, times : ndarray, shape (curves, nodes)
        Valid samples, and the times of all samples.
    at : ndarray
        Sampling times, with the curves along the first axis if `per_curve` is True.

    Yields
    ------
    curves : ndarray of int, shape (k,)
        Curves with the same number m of valid samples, at least two.
    nodes : ndarray of int, shape (k, m)
        The valid samples of each of them.
    knots : ndarray, shape (k, m)
        Their times.
    at : ndarray
        Sampling times of these curves, any ones where they are missing.
    gone : ndarray of bool or None
        Missing sampling times; None if all curves share them.
    """
    counts = valid.sum(axis=1)
    for count in np.unique(counts[counts > 1]):
        curves = np.flatnonzero(counts == count)
        nodes = np.nonzero(valid[curves])[1].reshape(len(curves), count)
        knots, here, gone = times[curves[:, None], nodes], at, None
        if per_curve:
            gone = missing_times(at[curves])
            here = np.where(gone, knots[:, 0].reshape(-1, *[1] * (at.ndim - 1)), at[curves])
        yield curves, nodes, knots, here, gone


def fit_valid(
    points: Array, t: Array | None, named: dict[str, Array], space: AnySpace, kinds: Any, how: Keywords
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


# ---- the specification of fits in an xarray object, checked before any block is computed ----

T = TypeVar("T", xr.DataArray, xr.Dataset)

# A curve of numbers that stands still raises for every invalid option.
LINE = Euclidean(1)
# The dimension of the knots where a result has times of its own, which may have the same name.
KNOTS = "symspline_knots"


def spec_of(
    da: xr.DataArray,
    space: AnySpace | str,
    dim: str,
    point_dims: Sequence[str],
    where: xr.DataArray | None,
    bc_type: Any,
    time: str | None = None,
    skipna: bool = False,
    **options: Any,
) -> tuple[Inputs, Keywords, xr.DataArray | None]:
    """Check a fit as far as that is possible without its points.

    Returns
    -------
    inputs : list of pair
        The points, then all else that has dimensions of the curves, each with its core dimensions.
    spec : dict
        Arguments of `spline_of`.
    times : xarray.DataArray or None
        Coordinate of the knots. If it has dimensions of the curves, it is an input as well.
    """
    space = space_named(space)
    check_dims(da, space, dim, point_dims)
    # Its type is refused or taken with the points.
    space._doubles(np.zeros(space.point_shape, da.dtype), "da")
    kinds, vectors = split(bc_type)
    times = times_along(da, dim, time, point_dims)
    t = None if times is None or times.ndim > 1 else np.asarray(times.values)
    rehearsed = t[~missing_times(t)] if skipna and t is not None else t
    if skipna and (rehearsed is None or len(rehearsed) < 2):
        rehearsed = np.arange(2.0)
    still = np.zeros((da.sizes[dim] if rehearsed is None else len(rehearsed), 1))
    CubicSpline(rehearsed, still, LINE, bc_type=joined(kinds, (np.zeros(1), np.zeros(1))), **options)
    core = [dim, *point_dims]
    curves = [d for d in da.dims if d not in core]
    inputs: Inputs = [(da, core)]
    names = []
    if times is not None and t is None:
        check_whole(times, dim, "a curve needs all of its times")
        names.append("t")
        inputs.append((bare(times, dim), [KNOTS]))
    if where is not None:
        if not isinstance(where, xr.DataArray) or where.dtype != bool or not set(where.dims) <= set(curves):
            raise ValidationError(f"where must be a DataArray of bool whose dimensions are among {tuple(curves)}")
        names.append("where")
        inputs.append((where, []))
    for name, vector in zip(("start", "end"), vectors, strict=True):
        if vector is not None:
            names.append(name)
            inputs.append((_vector(vector, name, space, point_dims, curves), list(point_dims)))
    return inputs, {"space": space, "t": t, "kinds": kinds, "names": names, "how": options}, times


def check_dims(da: xr.DataArray, space: Space, dim: str, point_dims: Sequence[str]) -> None:
    """Raise ValidationError unless an array has these dimensions, and chunks do not split a curve."""
    check_names(da, space, [dim], point_dims)
    check_whole(da, dim, "a curve needs all of its points")
    for name in point_dims:
        check_whole(da, name, "a point needs all of its numbers")


def check_names(da: xr.DataArray, space: Space, dims: Sequence[str], point_dims: Sequence[str]) -> None:
    """Raise ValidationError unless an array has the dimensions of nodes and of points."""
    if not isinstance(da, xr.DataArray):
        raise ValidationError(f"da must be an xarray.DataArray, not {type(da).__name__}")
    if isinstance(space, Product):
        raise ValidationError(f"{space} is a product, whose factors are independent; fit each factor separately")
    if not isinstance(point_dims, (tuple, list)) or len(point_dims) != len(space.point_shape):
        raise ValidationError(
            f"a point of {space} has shape {space.point_shape}, so point_dims must be {len(space.point_shape)} names "
            f"in a tuple, not {short_repr(point_dims)}"
        )
    for name in (*dims, *point_dims):
        if name not in da.dims:
            raise ValidationError(f"da has the dimensions {da.dims}, but not {name!r}; pass dim= and point_dims=")
    if len({*dims, *point_dims}) < len(dims) + len(point_dims):
        named = f"dim {dims[0]!r}" if len(dims) == 1 else f"to {tuple(dims)}"
        raise ValidationError(f"{named} and point_dims {tuple(point_dims)} name a dimension twice")
    sizes = tuple(da.sizes[name] for name in point_dims)
    if sizes != space.point_shape:
        raise ValidationError(
            f"{tuple(point_dims)} have sizes {sizes}, but a point of {space} has shape {space.point_shape}"
        )


def check_whole(da: xr.DataArray, name: str, reason: str) -> None:
    """Raise ValidationError if chunks split a dimension."""
    # Not of its coordinates, which may be cut otherwise.
    parts = da.variable.chunksizes.get(name, ())
    if len(parts) > 1:
        raise ValidationError(
            f"{name!r} is cut into {len(parts)} chunks, but {reason} at once; pass da.chunk({{{name!r}: -1}}), with "
            "smaller chunks along other dimensions"
        )


def _vector(vector: Any, name: str, space: Space, point_dims: Sequence[str], curves: list[Hashable]) -> xr.DataArray:
    """A vector of an end condition."""
    if not isinstance(vector, xr.DataArray):
        array = as_array(vector, f"the {name} vector")
        if array.shape != space.point_shape:
            raise ValidationError(
                f"the {name} vector has shape {array.shape}, a point of {space} {space.point_shape}; if every curve "
                f"has its own, pass a DataArray, with the dimensions {tuple(point_dims)} and those of the curves"
            )
        return xr.DataArray(array, dims=point_dims)
    if not set(point_dims) <= set(vector.dims) <= {*point_dims, *curves}:
        raise ValidationError(
            f"the {name} vector has the dimensions {vector.dims}; it needs {tuple(point_dims)}, and may have those of "
            f"the curves, {tuple(curves)}"
        )
    return vector


def times_with_names(
    x: object, dim: Hashable, point_dims: Sequence[str], curves: list[Hashable]
) -> tuple[xr.DataArray, list[Hashable]]:
    """Times with names of their dimensions, and those of them that no curve has.

    Times without names have the dimension `dim`.
    """
    if not isinstance(x, xr.DataArray):
        array = as_array(times_of(x, "x")[0], "x")
        if array.ndim > 1:
            raise ValidationError(f"x has shape {array.shape}; pass a DataArray, which names its dimensions")
        x = xr.DataArray(array, dims=[dim][: array.ndim], coords={dim: array} if array.ndim else None)
    if both := set(x.dims) & set(point_dims):
        raise ValidationError(f"x has the dimension {min(map(str, both))!r} of a point; rename it")
    return x, [d for d in x.dims if d not in curves]


def rehearse(times: xr.DataArray, t: Array | None, nodes: int, policy: str) -> None:
    """Raise now what the curves would raise about their times, if all have the same knots."""
    if times.chunks is None:
        still = np.zeros((nodes, 1))
        values_at(still, still, times.values, space=LINE, t=t, quantity="point", policy=policy, x_axes=times.ndim)


def bare(array: xr.DataArray, dim: Hashable) -> xr.DataArray:
    """An array whose dimension of knots has nothing to do with times of that name."""
    return array.drop_vars([name for name, c in array.coords.items() if dim in c.dims]).rename({dim: KNOTS})


def timed_by(values: T, times: xr.DataArray, dim: Hashable) -> T:
    """The values with their times as a coordinate, where that can have the name of the dimension of time."""
    fits = dim not in times.dims or times.ndim == 1
    return values.assign_coords({dim: times}) if fits else values


# ---- blocks of curves: functions of plain arrays, and how they are called on those of dask ----

# Arrays with their core dimensions, which a block has all of.
Inputs = list[tuple[xr.DataArray, Sequence[Hashable]]]

# The columns of the report, one value per curve.
COLUMNS = columns_of(Report)


def apply(
    function: object, inputs: Inputs, output_core_dims: list[list[Hashable]], output_dtypes: list[Any], **kwargs: Any
) -> tuple[xr.DataArray, ...]:
    """The outputs of a function of blocks."""
    arrays = _cut_alike([array for array, _ in inputs])
    kwargs["function"] = function
    # A worker of dask is one of many and uses one thread; other arrays are computed by all threads.
    kwargs["alone"] = any(array.chunks is not None for array in arrays)
    result = xr.apply_ufunc(
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
    outputs: tuple[xr.DataArray, ...] = result if isinstance(result, tuple) else (result,)
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
    points: Array, rest: Sequence[Array], space: Space, t: Any, kinds: Any, names: list[str], how: Keywords
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
    points: Array, *rest: Array, space: Space, t: Any, kinds: Any, names: list[str], how: Keywords, skipna: bool
) -> tuple[Array, ...]:
    """Points, velocities and the columns of the report of a block."""
    if not skipna:
        spline = spline_of(points, rest, space, t, kinds, names, how)
        nodes, velocities, reports = spline.points, spline.velocities, [spline.report]
    else:
        named = dict(zip(names, rest, strict=True))
        batch = points.shape[: points.ndim - 1 - len(space.point_shape)]
        knots = knots_of_block(t, named, batch)
        nodes, velocities, splines = fit_valid(points, knots, named, space, kinds, how)
        reports = [spline.report for spline in splines]
    columns: list[Array] = []
    for name, dtype in COLUMNS.items():
        values = [getattr(report, name) for report in reports]
        column: Array = np.asarray([np.nan if value is None else value for value in values], dtype)
        columns.append(column.reshape(batch) if skipna else column[0])
    return nodes, velocities, *(np.broadcast_to(c, columns[0].shape) for c in columns)


def resampled(points: Array, x: Array, *rest: Array, x_axes: int, skipna: bool, policy: str, **options: Any) -> Array:
    """Values of the splines of a block."""
    if skipna:
        nodes, velocities, *columns = fitted(points, *rest, skipna=True, **options)
        named = dict(zip(options["names"], rest, strict=True))
        t = knots_of_block(options["t"], named, points.shape[: points.ndim - 1 - len(options["space"].point_shape)])
        fixed: Keywords = {"space": options["space"], "quantity": "point", "policy": policy}
        values = values_at(nodes, velocities, x, t=t, x_axes=x_axes, skipna=True, **fixed)
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
    options: Keywords = {"space": space, "quantity": quantity, "policy": policy, "lifted": lifted}
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
    result = call_at_times(
        curve, time_axis, x, per_curve, policy, lambda x, outside, per_row: method(x, quantity, outside, per_row)
    )
    if everyone:
        return np.asarray(result)
    values = np.full(batch + result.shape[1:], np.nan, result.dtype)
    values[good] = result
    return values


def _values_of_valid(
    points: Array,
    velocities: Array,
    x: Array,
    t: Array | None,
    batch: tuple[int, ...],
    per_curve: bool,
    options: Keywords,
) -> Array:
    """A quantity of curves through their valid samples. Missing sampling times of a curve give NaN."""
    space = options["space"]
    nodes, shape = points.shape[len(batch)], () if options["quantity"] == "speed" else space.point_shape
    times_shape = x.shape[len(batch) :] if per_curve else x.shape
    rows, rates = (array.reshape(-1, nodes, *space.point_shape) for array in (points, velocities))
    times = times_of_rows(t, batch, nodes)
    at = np.broadcast_to(x, (*batch, *times_shape)).reshape(len(rows), *times_shape) if per_curve else x
    values = np.full((len(rows), *times_shape, *shape), np.nan, space.dtype if shape else float)
    valid = space._where_finite(rates) & ~missing_times(times)
    for curves, kept, knots, here, gone in of_equal_length(valid, times, at, per_curve):
        chosen = curves[:, None], kept
        try:
            part = values_at(rows[chosen], rates[chosen], here, t=knots, x_axes=len(times_shape), **options)
        except ValidationError as error:
            raise named_curve(error, batch, curves) from None
        if gone is not None:
            part[gone] = np.nan
        values[curves] = part
    return values.reshape(*batch, *times_shape, *shape)


def per_curve_times(x: Array, batch: tuple[int, ...], axes: int) -> tuple[Array, bool]:
    """Times for every curve, if they have its dimensions."""
    if x.ndim == axes:
        return x, False
    return np.broadcast_to(x, batch + x.shape[x.ndim - axes :]), True

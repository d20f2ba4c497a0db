"""The specification of fits in an xarray object, checked before any block is computed."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from .._autodiff.compiled import joined, split
from .._base.arrays import as_array, short_repr
from .._base.input import times_of
from .._core import ValidationError
from .._curves.missing import missing_times
from .._spaces import Array, Euclidean, Product, Space, space_named
from .._splines.cubic import CubicSpline
from ._blocks import Inputs, values_at
from ._labels import times_along

T = TypeVar("T", xr.DataArray, xr.Dataset)

# A curve of numbers that stands still raises for every invalid option.
LINE = Euclidean(1)
# The dimension of the knots where a result has times of its own, which may have the same name.
KNOTS = "symspline_knots"


def spec_of(
    da: xr.DataArray,
    space: Space[Any] | str,
    dim: str,
    point_dims: Sequence[str],
    where: xr.DataArray | None,
    bc_type: Any,
    time: str | None = None,
    skipna: bool = False,
    **options: Any,
) -> tuple[Inputs, dict[str, Any], xr.DataArray | None]:
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
    own = [dim, *point_dims]
    curves = [d for d in da.dims if d not in own]
    inputs: Inputs = [(da, own)]
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
    found = tuple(da.sizes[name] for name in point_dims)
    if found != space.point_shape:
        raise ValidationError(
            f"{tuple(point_dims)} have sizes {found}, but a point of {space} has shape {space.point_shape}"
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
    x: Any, dim: Hashable, point_dims: Sequence[str], curves: list[Hashable]
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

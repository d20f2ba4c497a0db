"""Splines over several dimensions of an xarray object, in blocks with halos."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from .._base.typing import Array, Keywords
from .._core import ValidationError
from .._curves.options import checked_extrapolate, extrapolation_mode
from .._grid import GridSpline
from .._spaces import AnySpace, space_named
from ._spec import (
    KNOTS,
    LINE,
    Inputs,
    apply,
    check_names,
    check_whole,
    in_radians,
    in_units_of,
    rehearse,
    times_along,
    times_with_names,
)

# The influence of a node on a spline decays by 0.27 per node, to 2e-15 of its size.
_HALO = 26
# Nodes per axis of the grid on which options are checked.
_FEW = 5
_OPTIONS = ("extrapolate", "on_failure", "atol")


class _Axis(NamedTuple):
    """One dimension of the grid: its nodes, if it has a coordinate, and the new positions."""

    dim: str
    nodes: Array | None
    x: xr.DataArray
    blocks: list[tuple[slice, slice]]
    """Positions and the nodes that are needed for them."""


def resample_grid(
    da: xr.DataArray,
    space: AnySpace | str,
    to: Mapping[str, Any],
    *,
    point_dims: Sequence[str],
    where: xr.DataArray | None,
    bc_type: Any,
    symmetric: bool,
    options: Mapping[str, Any],
) -> xr.DataArray:
    """Return the values of splines over the dimensions in ``to``; see `resample`."""
    space = space_named(space)
    given, da = da, in_radians(da, space)
    check_names(da, space, list(to), point_dims)
    for name in point_dims:
        check_whole(da, name, "a point needs all of its numbers")
    space._doubles(np.zeros(space.point_shape, da.dtype), "da")
    if unknown := set(options) - set(_OPTIONS):
        raise ValidationError(
            f"{min(unknown)} is an option of curves along one dimension; for a grid, the options are bc_type, "
            f"symmetric, {', '.join(_OPTIONS)}"
        )
    how = {"on_failure": "warn", **options, "bc_type": _ends(bc_type, list(to)), "symmetric": symmetric}
    GridSpline((None,) * len(to), np.zeros([min(da.sizes[dim], _FEW) for dim in to] + [1]), LINE, **how)
    if where is not None:
        da = da.where(_mask(where, da, point_dims))
    batch = [d for d in da.dims if d not in (*to, *point_dims)]
    outside = checked_extrapolate(options.get("extrapolate"))
    axes = [
        _axis(da, dim, x, point_dims, extrapolation_mode(outside, ends), ends)
        for (dim, x), ends in zip(to.items(), how["bc_type"], strict=True)
    ]
    values = _joined(da.drop_vars(list(da.coords)), axes, [], {"space": space, "how": how}, list(point_dims))
    values = values.transpose(*batch, *(d for d in da.dims if d in to), *point_dims)
    kept = {name: c.variable for name, c in da.coords.items() if not set(c.dims) & set(to)}
    values = values.assign_coords(kept | {axis.dim: axis.x.variable for axis in axes})
    values = in_units_of(values, given, space)
    single = {dim: 0 for dim, x in to.items() if np.ndim(x) == 0}
    return values.isel(single).rename(da.name)


def _ends(bc_type: object, dims: list[str]) -> tuple[Any, ...]:
    """Return the end conditions of each dimension."""
    if not isinstance(bc_type, Mapping):
        return (bc_type,) * len(dims)
    if unknown := set(bc_type) - set(dims):
        raise ValidationError(f"bc_type has the dimension {min(map(str, unknown))!r}, but to has {tuple(dims)}")
    return tuple(bc_type.get(dim, "not-a-knot") for dim in dims)


def _mask(where: ArrayLike | None, da: xr.DataArray, point_dims: Sequence[str]) -> xr.DataArray:
    dims = tuple(d for d in da.dims if d not in point_dims)
    if not isinstance(where, xr.DataArray) or where.dtype != bool or not set(where.dims) <= set(dims):
        raise ValidationError(f"where must be a DataArray of bool whose dimensions are among {dims}")
    return where


def _axis(da: xr.DataArray, dim: str, x: ArrayLike, point_dims: Sequence[str], policy: str, ends: object) -> _Axis:
    """Check the positions along one dimension, and divide them into blocks."""
    times = None if dim in da.coords else times_along(da, dim, None, point_dims, f"Make one the coordinate of {dim!r}")
    if times is not None:
        raise ValidationError(
            f"{dim!r} has no own coordinate, but {times.name!r} with dimensions {times.dims} looks like times. Pass "
            f"da.swap_dims({{{dim!r}: {times.name!r}}}) with to={{{times.name!r}: ...}}, or "
            f"da.drop_vars({times.name!r}) for the nodes 0, 1, 2, ..."
        )
    nodes, count = (da[dim].values if dim in da.coords else None), da.sizes[dim]
    given, _ = times_with_names(x, dim, point_dims, [])
    if given.dims not in ((), (dim,)):
        raise ValidationError(
            f"to[{dim!r}] has the dimensions {given.dims}, but needs {(dim,)}: the new positions along {dim!r} are the "
            "same for all others"
        )
    at = xr.DataArray(
        np.atleast_1d(given.values), dims=dim, attrs=given.attrs or (da[dim].attrs if nodes is not None else {})
    )
    try:
        rehearse(at, nodes, count, policy)
    except ValidationError as error:
        raise ValidationError(f"to[{dim!r}]: {error}") from None
    cuts = da.variable.chunksizes.get(dim, (count,))
    step = max(1, -(-at.size // len(cuts)))
    # Zarr needs blocks of equal size.
    outputs = [slice(start, min(start + step, at.size)) for start in range(0, at.size, step)] or [slice(0, 0)]
    whole = ends == "periodic" or policy == "periodic"
    positions = np.arange(count) if nodes is None else nodes
    windows = [slice(None) if whole or len(cuts) == 1 else _window(positions, at.values[span]) for span in outputs]
    return _Axis(dim, nodes, at, list(zip(outputs, windows, strict=True)))


def _window(nodes: Array, x: Array) -> slice:
    """Return the nodes around positions, with a halo on either side."""
    first = int(np.searchsorted(nodes, x.min(), "right")) - 1
    last = int(np.searchsorted(nodes, x.max(), "left"))
    first, last = (min(max(index, 0), len(nodes) - 2) for index in (first, last))
    return slice(max(first - _HALO, 0), last + _HALO + 1)


def _joined(
    da: xr.DataArray, axes: list[_Axis], chosen: list[tuple[slice, slice]], fixed: Keywords, point_dims: list[str]
) -> xr.DataArray:
    """Return the values of all blocks, joined along the dimensions of the grid."""
    if len(chosen) < len(axes):
        axis = axes[len(chosen)]
        parts = [_joined(da, axes, [*chosen, block], fixed, point_dims) for block in axis.blocks]
        return parts[0] if len(parts) == 1 else xr.concat(parts, axis.dim)
    windows = {axis.dim: nodes for axis, (_, nodes) in zip(axes, chosen, strict=True)}
    part = da.isel(windows)
    if part.chunks is not None:
        part = part.chunk(dict.fromkeys(windows, -1))
    names = {axis.dim: f"{KNOTS}_{axis.dim}" for axis in axes}
    inputs: Inputs = [(part.rename(names), [*names.values(), *point_dims])]
    inputs += [(axis.x[span], [axis.dim]) for axis, (span, _) in zip(axes, chosen, strict=True)]
    nodes = [None if axis.nodes is None else axis.nodes[windows[axis.dim]] for axis in axes]
    offsets = [windows[axis.dim].start or 0 for axis in axes]
    core: list[Hashable] = [*names, *point_dims]
    (values,) = apply(_gridded, inputs, [core], [fixed["space"].dtype], nodes=nodes, offsets=offsets, **fixed)
    return values


def _gridded(
    points: Array, *x: Array, space: AnySpace, how: Keywords, nodes: list[Array | None], offsets: list[int]
) -> Array:
    """Values of the splines of a block, one per batch index."""
    first = points.ndim - len(space.point_shape) - len(nodes)
    sizes = points.shape[first : first + len(nodes)]
    # Nodes without a coordinate are counted from the start of the array.
    axes = [
        offset + np.arange(n, dtype=np.float64) if positions is None else positions
        for positions, offset, n in zip(nodes, offsets, sizes, strict=True)
    ]
    values = np.full((*points.shape[:first], *map(len, x), *space.point_shape), np.nan, space.dtype)
    for index in np.ndindex(points.shape[:first]):
        # Nothing is interpolated where all points are missing, such as outside a mask.
        if space._where_finite(points[index]).any():
            values[index] = GridSpline(axes, points[index], space, **how).grid(*x)
    return values

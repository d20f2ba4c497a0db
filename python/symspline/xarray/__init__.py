"""Splines of many curves in xarray objects, by blocks in dask where these are dask's.

Curves do not depend on each other, so that an array of them is cut between curves and never along one. Every function
here is one call of ``xarray.apply_ufunc``, of functions of plain arrays that any scheduler of dask can send to its
workers. Dimensions are known by their names, and their order does not matter.
"""

from __future__ import annotations

import json
from collections.abc import Hashable, Sequence
from typing import Any

import xarray as xr

from ..curves.curve import quantity_of
from ..options import checked_policy, outside
from ..spaces import Space
from ..version import VERSION
from .asked import asked_of, rehearse, times_with_names
from .blocks import COLUMNS, Inputs, apply, fitted, resampled
from .results import KNOTS, along, bare, timed_by

__all__ = ["evaluate", "fit", "lift", "resample", "speed"]


def fit(
    da: xr.DataArray,
    space: Space | str,
    dim: str = "time",
    point_dims: Sequence[str] = ("q",),
    *,
    bc_type: Any = "natural",
    method: str = "auto",
    tol: float = 1e-12,
    max_iter: int | None = None,
    extrapolate: bool | str | None = None,
    on_failure: str = "ignore",
    atol: float | None = None,
    where: xr.DataArray | None = None,
) -> xr.Dataset:
    """The C² splines through the points along one dimension of an array.

    Args:
        da: the points. Of a dask array nothing is computed before it is asked for.
        space: the space or its name; not a `Product`, whose factors are fitted each by itself.
        dim: the dimension along the curves. Its coordinate holds the knots, numbers or ``datetime64`` (rates are then
            per second); without one they are 0, 1, …, N, and another coordinate that looks like times is an error.
        point_dims: the dimensions of a point's array, in their order: for matrices rows and columns.
        bc_type: as for `CubicSpline`. Vectors have the shape of a point, or are DataArrays.
        method, tol, max_iter, extrapolate, atol: as for `CubicSpline`.
        on_failure: as for `CubicSpline`. With ``"ignore"`` a curve with a point that is none (NaN, off the space), or
            a step beyond the cut locus, is NaN, one that did not converge keeps its best iterate, and ``converged``
            is False for both. With ``"raise"`` the index in the message counts within one block of dask.
        where: True for the curves that are wanted, with dimensions of the curves; the others are NaN.

    Returns:
        A Dataset with ``points`` (moved onto the space) and ``velocities``, the dimensions of the curves first, then
        ``dim`` and ``point_dims``; and the columns of `Report` for every curve. Coordinates are those of ``da``,
        whose attributes the points keep. Attributes name the space and what else `evaluate`, `lift` and `speed` need,
        also after the Dataset was stored and read again.

    Raises:
        ValidationError: names, shapes, times or options are wrong, or a curve is cut by chunks.

    >>> import numpy as np, xarray as xr
    >>> import symspline.xarray
    >>> da = xr.DataArray(np.eye(3)[None], dims=("curve", "time", "q"), coords={"time": [0.0, 1.0, 3.0]})
    >>> ds = symspline.xarray.fit(da, "sphere:2")
    >>> ds.velocities.dims, ds.converged.values
    (('curve', 'time', 'q'), array([ True]))
    """
    asked = asked_of(
        da,
        space,
        dim,
        point_dims,
        where,
        bc_type,
        method=method,
        tol=tol,
        max_iter=max_iter,
        extrapolate=extrapolate,
        on_failure=on_failure,
        atol=atol,
    )
    axes: list[Hashable] = [dim, *point_dims]
    dtype = asked.space.dtype
    variables = apply(
        fitted,
        asked.inputs,
        [axes, axes, *([] for _ in COLUMNS)],
        [dtype, dtype, *COLUMNS.values()],
        **asked.options,
    )
    ds = xr.Dataset(dict(zip(("points", "velocities", *COLUMNS), variables, strict=True)))
    ds.points.attrs = dict(da.attrs)
    words = asked.options["kinds"]
    ds.attrs = {
        "space": str(asked.space),
        "curve_dim": dim,
        "point_dims": list(point_dims),
        "bc_type": words if isinstance(words, str) else json.dumps(words),
        "extrapolate": outside(extrapolate, bc_type),
        "symspline": VERSION,
    }
    return ds


def evaluate(ds: xr.Dataset, x: Any, nu: int = 0, *, extrapolate: bool | str | None = None) -> xr.DataArray:
    """The curves that `fit` found, at times x.

    Args:
        ds: what `fit` returned, or what was stored of it: points, velocities and attributes.
        x: one time; a row of times, whose dimension is then that of the knots; or a DataArray with any dimensions. If
            some are those of the curves, every curve has its own times.
        nu: 0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.
        extrapolate: as for `CubicSpline`; None for what `fit` was told.

    Returns:
        The dimensions of the curves, then those of x, then those of a point. The times are a coordinate. Points have
        the attributes of the data, rates none. Curves that were not found are NaN.

    Raises:
        ValidationError: a time is not finite, or outside the knots and ``extrapolate`` is None.

    >>> import numpy as np, xarray as xr
    >>> import symspline.xarray
    >>> ds = symspline.xarray.fit(xr.DataArray(np.eye(3), dims=("time", "q")), "sphere:2")
    >>> symspline.xarray.evaluate(ds, [0.5, 1.0]).sel(time=0.5).values.round(8)
    array([ 0.61308303,  0.76368565, -0.20227067])
    """
    return along(ds, x, quantity_of(nu), extrapolate)


def lift(ds: xr.Dataset, x: Any, nu: int = 0, *, extrapolate: bool | str | None = None) -> xr.DataArray:
    """The curves by arrays that move continuously, see `CubicSpline.lift`. The arguments are those of `evaluate`."""
    return along(ds, x, quantity_of(nu), extrapolate, lifted=True)


def speed(ds: xr.Dataset, x: Any, *, extrapolate: bool | str | None = None) -> xr.DataArray:
    """|γ'| at times x. The arguments are those of `evaluate`; the result has no dimensions of a point."""
    return along(ds, x, "speed", extrapolate)


def resample(
    da: xr.DataArray,
    space: Space | str,
    to: Any,
    dim: str = "time",
    point_dims: Sequence[str] = ("q",),
    *,
    where: xr.DataArray | None = None,
    bc_type: Any = "natural",
    **options: Any,
) -> xr.DataArray:
    """Points of the splines at other times, in one go: nothing else of the fit is kept.

    Args:
        da, space, dim, point_dims, where, bc_type, options: as for `fit`.
        to: times, as x for `evaluate`.

    Returns:
        Values as of `evaluate`, with name and attributes of ``da``. Curves that did not converge are NaN, as there is
        no report that could say so.

    >>> import numpy as np, xarray as xr
    >>> import symspline.xarray
    >>> days = np.array(["2021-08-28", "2021-08-29", "2021-08-30"], "datetime64[s]")
    >>> da = xr.DataArray(np.eye(3), dims=("time", "q"), coords={"time": days})
    >>> symspline.xarray.resample(da, "sphere:2", to=["2021-08-28T12:00"]).values.round(4)
    array([[ 0.6131,  0.7637, -0.2023]])
    """
    asked = asked_of(da, space, dim, point_dims, where, bc_type, **{"on_failure": "ignore"} | options)
    curves = [d for d in da.dims if d not in (dim, *point_dims)]
    times, axes = times_with_names(to, dim, point_dims, curves)
    policy = outside(checked_policy(options.get("extrapolate")), bc_type)
    rehearse(times, asked.options["t"], da.sizes[dim], policy)
    first, *rest = asked.inputs
    inputs: Inputs = [(bare(first[0], dim), [KNOTS, *point_dims]), (times, axes), *rest]
    (values,) = apply(
        resampled,
        inputs,
        [[*axes, *point_dims]],
        [asked.space.dtype],
        x_axes=len(axes),
        **asked.options,
    )
    values.attrs = dict(da.attrs)
    return timed_by(values, times, dim).rename(da.name)

"""Splines of many curves and grids in xarray objects, block by block with dask.

Curves are independent of each other, so blocks contain whole curves, and each function calls ``xarray.apply_ufunc``
once. Blocks of a grid overlap, with one call per block. The functions of plain arrays that are called can be sent to
workers by any dask scheduler. Dimensions are identified by name, in any order.
"""

from __future__ import annotations

import json
from collections.abc import Hashable, Mapping, Sequence
from typing import Any, Unpack

import numpy as np
import xarray as xr

from .._base import VERSION
from .._base.arrays import checked_flag, short_repr
from .._base.typing import BCType, Extrapolate, Keywords, Method, OnFailure, SolverOptions, TimesLike
from .._core import ValidationError
from .._curves.options import checked_extrapolate, extrapolation_mode, quantity_of
from .._spaces import Space, space_named
from ._grids import resample_grid
from ._smoothing import smooth
from ._spec import (
    COLUMNS,
    KNOTS,
    Inputs,
    apply,
    bare,
    check_dims,
    fitted,
    in_radians,
    in_units_of,
    rehearse,
    resampled,
    spec_of,
    timed_by,
    times_with_names,
    values_at,
)

__all__ = ["evaluate", "fit", "lift", "resample", "smooth", "speed"]


def __dir__() -> list[str]:
    return __all__


def fit(
    da: xr.DataArray,
    space: Space | str,
    *,
    dim: str = "time",
    time: str | None = None,
    point_dims: Sequence[str] = ("q",),
    skipna: bool = False,
    bc_type: BCType = "natural",
    method: Method = "auto",
    tol: float = 1e-12,
    max_iter: int | None = None,
    extrapolate: Extrapolate = None,
    on_failure: OnFailure = "ignore",
    atol: float | None = None,
    where: xr.DataArray | None = None,
) -> xr.Dataset:
    """Fit C² splines to the points along one dimension of an array.

    Parameters
    ----------
    da : xarray.DataArray
        Points. Dask arrays are computed lazily. Angles of `Torus` are in radians, unless the attribute ``units`` is
        degrees, as in ``"degree"`` and ``"deg"``. They are then converted, and the attribute becomes ``"radian"``.
    space : Space or str
        Space or its name. Products are not supported: fit each factor separately.
    dim : str, default "time"
        Dimension along the curves.
    time : str, optional
        Coordinate of the knots, numbers or ``datetime64`` (rates are then per second). It may have batch dimensions, as
        ``time(traj, obs)`` with a row of times per curve. By default the coordinate of `dim`, or the only other
        coordinate along `dim` that looks like times by its type, name or attributes. Without any, the knots are 0, 1,
        ...
    point_dims : sequence of str, default ("q",)
        Dimensions of a point's array in order, such as rows and columns of matrices.
    skipna : bool, default False
        True to drop missing samples, where the point or its time is NaN or NaT, from each curve. Curves with fewer than
        two samples left are NaN, subject to `on_failure`.
    bc_type : str, tuple or pair, default "natural"
        End conditions, as for `CubicSpline`. Vectors have the shape of a point, or are DataArrays.
    method, tol, max_iter, extrapolate, atol
        As for `CubicSpline`.
    on_failure : {"ignore", "warn", "raise"}, default "ignore"
        As for `CubicSpline`. With ``"ignore"``, a curve with invalid points (NaN, off the space) or with a step beyond
        the cut locus is NaN, a curve that did not converge keeps its best iterate, and ``converged`` is False for both.
        With ``"raise"``, the message gives the index within one block of dask.
    where : xarray.DataArray of bool, optional
        Mask over the batch dimensions. Curves where it is False are not fitted and are NaN.

    Returns
    -------
    xarray.Dataset
        ``points`` (projected onto the manifold) and ``velocities``, with batch dimensions first, then `dim` and
        `point_dims`; and the columns of `Report` for every curve. Coordinates are those of `da`, and the points keep
        its attributes. With `skipna`, missing samples are NaN in both. Attributes of the Dataset hold the space and all
        other information that `evaluate`, `lift` and `speed` need, also after the Dataset was stored and read again.

    Raises
    ------
    ValidationError
        If names, shapes, times or options are invalid, chunks split a curve, or several coordinates could hold the
        times.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> import symspline.xarray
    >>> da = xr.DataArray(np.eye(3)[None], dims=("curve", "time", "q"), coords={"time": [0.0, 1.0, 3.0]})
    >>> ds = symspline.xarray.fit(da, "sphere:2")
    >>> ds.velocities.dims, ds.converged.values
    (('curve', 'time', 'q'), array([ True]))

    Trajectories with separate times, the second of which ends early:

    >>> time = np.array([["2024-05-01", "2024-05-02", "2024-05-04"], ["2024-05-07", "2024-05-08", "NaT"]], "M8[ns]")
    >>> points = np.stack([np.eye(3), [[1, 0, 0], [0, 1, 0], [np.nan] * 3]])
    >>> da = xr.DataArray(points, dims=("traj", "obs", "q"), coords={"time": (("traj", "obs"), time)})
    >>> ds = symspline.xarray.fit(da, "sphere:2", dim="obs", skipna=True)
    >>> x = np.array(["2024-05-03", "2024-05-07T12"], "M8[ns]")
    >>> symspline.xarray.evaluate(ds, x, extrapolate=False).isel(q=1).round(3).values
    array([[0.65 ,   nan],
           [  nan, 0.707]])
    """
    options: Keywords = {"method": method, "tol": tol, "max_iter": max_iter, "extrapolate": extrapolate}
    options |= {"atol": atol, "on_failure": on_failure, "time": time, "skipna": checked_flag(skipna, "skipna")}
    da = in_radians(da, space)
    inputs, spec, times = spec_of(da, space, dim, point_dims, where, bc_type, **options)
    axes: list[Hashable] = [dim, *point_dims]
    dtype = spec["space"].dtype
    variables = apply(
        fitted, inputs, [axes, axes, *([] for _ in COLUMNS)], [dtype, dtype, *COLUMNS.values()], skipna=skipna, **spec
    )
    ds = xr.Dataset(dict(zip(("points", "velocities", *COLUMNS), variables, strict=True)))
    ds.points.attrs = dict(da.attrs)
    words = spec["kinds"]
    ds.attrs = {
        "space": str(spec["space"]),
        "curve_dim": dim,
        # Not a list, since netCDF of version 3 stores no lists of texts.
        "point_dims": json.dumps(list(point_dims)),
        "bc_type": words if isinstance(words, str) else json.dumps(words),
        "extrapolate": extrapolation_mode(extrapolate, bc_type),
        "symspline": VERSION,
    }
    if times is not None and times.name != dim:
        ds.attrs["curve_time"] = times.name
    if skipna:
        # Attributes of netCDF files cannot be Boolean.
        ds.attrs["skipna"] = 1
    return ds


def evaluate(
    ds: xr.Dataset, x: TimesLike | xr.DataArray, *, nu: int = 0, extrapolate: Extrapolate = None
) -> xr.DataArray:
    """Evaluate the curves of `fit`.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of `fit`, or points, velocities and attributes that were stored and read again.
    x : time, array_like or xarray.DataArray
        One time, a one-dimensional array of times, or a DataArray with any dimensions. If it has batch dimensions,
        every curve has its own times. An array has the dimension `dim`, or the name of the coordinate of the times.
    nu : {0, 1, 2}, default 0
        0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.
    extrapolate : bool or str, optional
        Extrapolation policy, as for `CubicSpline`. None means the policy passed to `fit`.

    Returns
    -------
    xarray.DataArray
        Batch dimensions, then those of `x`, then those of a point. The times are a coordinate. Points keep the
        attributes of the data, rates do not. Curves that do not exist are NaN. With ``skipna=True`` in `fit`, missing
        times of a curve's own give NaN.

    Raises
    ------
    ValidationError
        If a time is not finite, or is outside the knots and `extrapolate` is None.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> import symspline.xarray
    >>> ds = symspline.xarray.fit(xr.DataArray(np.eye(3), dims=("time", "q")), "sphere:2")
    >>> symspline.xarray.evaluate(ds, [0.5, 1.0]).sel(time=0.5).values.round(8)
    array([ 0.61308303,  0.76368565, -0.20227067])
    """
    return _along(ds, x, quantity_of(nu), extrapolate)


def lift(ds: xr.Dataset, x: TimesLike | xr.DataArray, *, nu: int = 0, extrapolate: Extrapolate = None) -> xr.DataArray:
    """Evaluate the curves by continuous representatives, see `CubicSpline.lift`.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of `fit`.
    x : time, array_like or xarray.DataArray
        Times, as for `evaluate`.
    nu : {0, 1, 2}, default 0
        Order of the derivative, as for `evaluate`.
    extrapolate : bool or str, optional
        Extrapolation policy, as for `evaluate`.

    Returns
    -------
    xarray.DataArray
        Dimensions as from `evaluate`.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> import symspline.xarray
    >>> lines = xr.DataArray([[1, 0], [0.6, 0.8], [0.28, -0.96]], dims=("time", "q"))
    >>> ds = symspline.xarray.fit(lines, "rp:1")
    >>> symspline.xarray.lift(ds, 2.0).values.round(12)
    array([-0.28,  0.96])
    """
    return _along(ds, x, quantity_of(nu), extrapolate, lifted=True)


def speed(ds: xr.Dataset, x: TimesLike | xr.DataArray, *, extrapolate: Extrapolate = None) -> xr.DataArray:
    """Compute the speed of the curves, the norm of γ'.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of `fit`.
    x : time, array_like or xarray.DataArray
        Times, as for `evaluate`.
    extrapolate : bool or str, optional
        Extrapolation policy, as for `evaluate`.

    Returns
    -------
    xarray.DataArray
        Dimensions as from `evaluate`, without those of a point.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> import symspline.xarray
    >>> ds = symspline.xarray.fit(xr.DataArray([[0.0], [3.0], [6.0]], dims=("time", "q")), "r:1")
    >>> symspline.xarray.speed(ds, [0.5, 1.5]).values.round(12)
    array([3., 3.])
    """
    return _along(ds, x, "speed", extrapolate)


def resample(
    da: xr.DataArray,
    space: Space | str,
    to: Any,
    *,
    dim: str = "time",
    time: str | None = None,
    point_dims: Sequence[str] = ("q",),
    skipna: bool = False,
    where: xr.DataArray | None = None,
    bc_type: BCType | Mapping[str, Any] | None = None,
    symmetric: bool = False,
    **options: Unpack[SolverOptions],
) -> xr.DataArray:
    """Fit splines and evaluate them at other times or positions in one call.

    With a mapping, such as ``to={"x": ..., "y": ...}``, the points are on a grid, and the values are those of a
    `GridSpline` over all of its dimensions.

    Parameters
    ----------
    da : xarray.DataArray
        Points, as for `fit`.
    space : Space or str
        Space or its name.
    to : time, array_like, xarray.DataArray, or mapping of str to array_like
        New times, as `x` of `evaluate`; or the new positions along each dimension of a grid, one position or a
        one-dimensional array each. The splines follow the order of the mapping.
    dim : str, default "time"
        Dimension along the curves. A mapping names the dimensions instead.
    time : str, optional
        Coordinate of the times, for example ``time(traj, obs)`` with a row of times per curve. By default the
        coordinate of `dim`, or the only other coordinate along `dim` that looks like times.
    point_dims : sequence of str, default ("q",)
        Dimensions of a point's array.
    skipna : bool, default False
        True to drop missing samples from each curve, as for `fit`. A grid always skips missing points.
    where : xarray.DataArray of bool, optional
        Mask over the batch dimensions, for a grid also over its dimensions.
    bc_type : str, tuple, pair or mapping, optional
        End conditions, by default ``"natural"`` along one dimension and ``"not-a-knot"`` on a grid. On a grid, a
        mapping such as ``{"x": "periodic"}`` gives those of each dimension.
    symmetric : bool, default False
        Whether values on a grid are the midpoint of both orders of its dimensions, as for `GridSpline`.
    **options
        Other options of `fit`. A grid has `extrapolate`, `on_failure` (by default ``"warn"``) and `atol`.

    Returns
    -------
    xarray.DataArray
        Points as from `evaluate`, with name, units and other attributes of `da`. Curves that did not converge are NaN.
        Batch dimensions come first, then those of the grid in the order of `da`. Values on a grid that depend on
        neighbouring points at their cut locus are NaN.

    Raises
    ------
    ValidationError
        If names, shapes, times or options are invalid, or chunks split a curve or a point.

    Notes
    -----
    Chunks may split a grid along its dimensions. Each block reads 26 more nodes on either side, because the influence
    of a node decays by about 0.27 per node. The values differ from those of the whole grid by about 1e-14 of the
    distance between neighbouring points. The nodes of a halo are read and fitted again, so that chunks should have a
    hundred nodes or more along each dimension. A periodic dimension is not split.

    Points of a grid that are off the space raise an error when their block is computed. Missing points (NaN) divide the
    rows into runs, each with a spline of its own. Values that are not between points of a run along every dimension are
    NaN.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> import symspline.xarray
    >>> days = np.array(["2021-08-28", "2021-08-29", "2021-08-30"], "datetime64[s]")
    >>> da = xr.DataArray(np.eye(3), dims=("time", "q"), coords={"time": days})
    >>> symspline.xarray.resample(da, "sphere:2", to=["2021-08-28T12:00"]).values.round(4)
    array([[ 0.6131,  0.7637, -0.2023]])

    A grid of directions, twice as fine:

    >>> grid = xr.DataArray(np.eye(3)[[[0, 1], [2, 2]]], dims=("y", "x", "q"), coords={"x": [0, 1], "y": [0, 2]})
    >>> fine = symspline.xarray.resample(grid, "sphere:2", to={"x": [0, 0.5, 1], "y": [0, 1, 2]})
    >>> fine.sel(x=0.5).values.round(4)
    array([[0.7071, 0.7071, 0.    ],
           [0.5   , 0.5   , 0.7071],
           [0.    , 0.    , 1.    ]])
    """
    if isinstance(to, Mapping):
        if time is not None or checked_flag(skipna, "skipna"):
            raise ValidationError(
                "time and skipna are for curves along one dimension; a grid has the coordinates of its dimensions, and "
                "skips missing points. Omit them."
            )
        grid: Keywords = {"point_dims": point_dims, "where": where, "symmetric": symmetric, "options": options}
        return resample_grid(da, space, to, bc_type="not-a-knot" if bc_type is None else bc_type, **grid)
    if checked_flag(symmetric, "symmetric") or isinstance(bc_type, Mapping):
        name = "symmetric=True" if symmetric else "bc_type by dimension"
        raise ValidationError(f"{name} is for grids; pass to as a mapping of dimensions to positions")
    bc_type = "natural" if bc_type is None else bc_type
    chosen: Keywords = {"time": time, "skipna": checked_flag(skipna, "skipna"), "on_failure": "ignore", **options}
    given, da = da, in_radians(da, space)
    (_, *rest), spec, knots = spec_of(da, space, dim, point_dims, where, bc_type, **chosen)
    curves = [d for d in da.dims if d not in (dim, *point_dims)]
    label = dim if knots is None else knots.name
    times, axes = times_with_names(to, label, point_dims, curves)
    policy = extrapolation_mode(checked_extrapolate(options.get("extrapolate")), bc_type)
    if not (skipna or "t" in spec["names"]):
        rehearse(times, spec["t"], da.sizes[dim], policy)
    inputs: Inputs = [(bare(da, dim), [KNOTS, *point_dims]), (times, axes), *rest]
    spec |= {"x_axes": len(axes), "skipna": skipna, "policy": policy}
    (values,) = apply(resampled, inputs, [[*axes, *point_dims]], [spec["space"].dtype], **spec)
    values = in_units_of(values, given, spec["space"])
    return timed_by(values, times, label).rename(da.name)


def _along(ds: xr.Dataset, x: object, quantity: str, extrapolate: Any, lifted: bool = False) -> xr.DataArray:
    """A quantity of curves at times x."""
    if not isinstance(ds, xr.Dataset):
        raise ValidationError(f"ds is not what symspline.xarray.fit returns: it is {short_repr(ds)}")
    try:
        space = space_named(ds.attrs["space"])
        dim, names, policy = (ds.attrs[name] for name in ("curve_dim", "point_dims", "extrapolate"))
        points, velocities = ds["points"], ds["velocities"]
    except (AttributeError, KeyError) as error:
        raise ValidationError(f"ds is not what symspline.xarray.fit returns: it has no {error}") from None
    try:
        point_dims = list(json.loads(names))
    except (TypeError, ValueError):
        raise ValidationError(
            f"ds is not what symspline.xarray.fit returns: its attribute 'point_dims' is {short_repr(names)}"
        ) from None
    for array in (points, velocities):
        check_dims(array, space, dim, point_dims)
    if extrapolate is not None:
        policy = extrapolation_mode(checked_extrapolate(extrapolate), ds.attrs.get("bc_type"))
    knots = _knots(ds, dim)
    label, skipna = (dim if knots is None else knots.name), bool(ds.attrs.get("skipna", 0))
    times, axes = times_with_names(x, label, point_dims, [d for d in points.dims if d not in (dim, *point_dims)])
    core: list[Hashable] = [KNOTS, *point_dims]
    shape = [] if quantity == "speed" else point_dims
    inputs: Inputs = [(bare(points, dim), core), (bare(velocities, dim), core), (times, axes)]
    fixed: Keywords = {"space": space, "t": None, "quantity": quantity, "policy": policy, "skipna": skipna}
    if knots is not None and knots.ndim > 1:
        inputs.append((bare(knots, dim), [KNOTS]))
    else:
        fixed["t"] = None if knots is None else knots.values
        if not skipna:
            rehearse(times, fixed["t"], points.sizes[dim], policy)
    fixed |= {"x_axes": len(axes), "lifted": lifted}
    (values,) = apply(values_at, inputs, [[*axes, *shape]], [space.dtype if shape else np.float64], **fixed)
    if quantity == "point":
        values.attrs = dict(points.attrs)
    return timed_by(values, times, label).rename(quantity)


def _knots(ds: xr.Dataset, dim: str) -> Any:
    """Return the coordinate of the knots of the curves of `fit`."""
    name = ds.attrs.get("curve_time", dim)
    if name in ds.points.coords:
        return ds.points.coords[name]
    if "curve_time" in ds.attrs:
        raise ValidationError(f"ds is not what symspline.xarray.fit returns: it has no coordinate {name!r} of times")
    return None

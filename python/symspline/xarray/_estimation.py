"""Estimation of a curve from points and rates in xarray objects."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any, Unpack

import numpy as np
import xarray as xr

from .. import measure
from .._core import ValidationError
from .._estimation import estimate as estimate_curve
from .._estimation.make import EstimateOptions
from .._estimation.measurements import Measurement
from .._missing import missing_points, missing_times
from .._smoothing.factors import is_several
from .._spaces import Array, Euclidean, Space, space_named
from .._typing import Numbers, TimesLike
from ._smoothing import unit_of
from ._spec import check_dims, timed_by, times_with_names
from ._times import times_along
from ._units import in_radians


def estimate(
    points: xr.DataArray,
    space: Space[Any] | str,
    to: Any = None,
    *,
    sigma: Numbers,
    rates: xr.DataArray | None = None,
    rate_sigma: Numbers | None = None,
    rate_bias: bool = False,
    velocities: xr.DataArray | None = None,
    velocity_sigma: Numbers | None = None,
    measurements: Sequence[Measurement] = (),
    dim: str = "time",
    time: str | None = None,
    rate_dim: str | None = None,
    velocity_dim: str | None = None,
    point_dims: Sequence[str] = ("q",),
    knots: TimesLike = "auto",
    level: float | None = None,
    **options: Unpack[EstimateOptions],
) -> xr.Dataset:
    """Fit one curve to points, angular velocities and velocities, each with its own times.

    The function calls `symspline.estimate`. Measurements whose values or times are missing (NaN, NaT)
    are omitted, and dask arrays are computed. The times of rates and velocities are the coordinate of their dimension,
    or the only other coordinate along it that looks like times.

    Parameters
    ----------
    points : xarray.DataArray
        Points with a coordinate of times along `dim`.
    space : Space or str
        Space or its name. Products are not supported.
    to : time, array_like or xarray.DataArray, optional
        Times at which the curve is evaluated, between the first and the last measurement. By default those of the
        points.
    sigma : float, tuple or array_like
        Standard deviation of the points, as for `symspline.measure.Points`.
    rates : xarray.DataArray, optional
        Angular velocities in the frame of the body, as for `symspline.measure.BodyRates`, in radians per unit of time
        (per second for dates). The dimensions are `rate_dim` and one with the three components.
    rate_sigma : float, optional
        Standard deviation of a component of the rates.
    rate_bias : bool, default False
        Whether a constant that is added to the rates is estimated.
    velocities : xarray.DataArray, optional
        Velocities with the dimensions of points: on a Euclidean space at any times, on other spaces tangent vectors at
        the points, with the times of the points.
    velocity_sigma : float, optional
        Standard deviation of a coordinate of the velocities.
    measurements : sequence, optional
        Further measurements, objects of `symspline.measure`.
    dim : str, default "time"
        Dimension of the points along the curve.
    time : str, optional
        Coordinate of the times of the points. By default the coordinate of `dim`, or the only other coordinate along
        `dim` that looks like times.
    rate_dim, velocity_dim : str, optional
        Dimensions along the curve of rates and velocities, by default `dim`.
    point_dims : sequence of str, default ("q",)
        Dimensions of a point's array.
    knots : int, array_like or "auto", default "auto"
        Knots, as for `symspline.estimate`.
    level : float, optional
        Probability, such as 0.95. The result then has the radius of the band.
    **options
        Keyword arguments of `symspline.estimate`, such as ``penalty="jerk"``.

    Returns
    -------
    xarray.Dataset
        ``points``, ``std`` and, if requested, ``band`` at the times `to`; ``lam`` and ``df``; and for every estimated
        constant, such as the bias of the rates, ``gyro_bias`` and ``gyro_bias_std``. A bias has the dimension of the
        components of `rates` and their units. For poses, standard deviations, ``lam`` and ``df`` have the endings
        ``_rotation`` and ``_position``.

    Raises
    ------
    ValidationError
        If names, shapes, times or units are invalid, or a standard deviation is missing.
    ConvergenceError
        If the iteration does not converge.

    See Also
    --------
    symspline.estimate : Fit a curve to measurements of any kind.
    smooth : Fit curves to points only.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> import symspline as ss, symspline.xarray
    >>> t, s = np.linspace(0, 5, 26), np.linspace(0, 5, 501)
    >>> rng = np.random.default_rng(0)
    >>> vectors = np.sin(t)[:, None] * [0.0, 0.0, 1.0] + 0.03 * rng.standard_normal((26, 3))
    >>> turning = ss.rotations.from_rotation_vectors(vectors)
    >>> omega = np.cos(s)[:, None] * [0, 0, 1] + [0.1, 0, 0] + 0.02 * rng.standard_normal((501, 3))
    >>> ds = symspline.xarray.estimate(
    ...     xr.DataArray(turning, dims=("time", "row", "column"), coords={"time": t}),
    ...     "so:3",
    ...     sigma=0.03,
    ...     rates=xr.DataArray(omega, dims=("sample", "axis"), coords={"sample": s}, attrs={"units": "rad/s"}),
    ...     rate_dim="sample",
    ...     rate_sigma=0.02,
    ...     rate_bias=True,
    ...     point_dims=("row", "column"),
    ...     penalty="jerk",
    ... )
    >>> ds.gyro_bias.dims, ds.gyro_bias.attrs["units"], bool(abs(ds.gyro_bias[0] - 0.1) < 0.02)
    (('axis',), 'rad/s', True)
    """
    space = space_named(space)
    if not isinstance(points, xr.DataArray):
        raise ValidationError(f"points must be an xarray.DataArray, not {type(points).__name__}")
    points = in_radians(points, space)
    check_dims(points.compute(), space, dim, point_dims)
    own = [dim, *point_dims]
    _refuse_others(points, own, "points")
    rows = points.transpose(*own)
    times_of_points = _times(points, dim, "points", time, point_dims)
    y, at = np.asarray(rows.values), np.asarray(times_of_points.values)
    present = ~missing_points(space, y) & ~missing_times(at)
    sigmas = sigma if isinstance(sigma, tuple) or np.ndim(sigma) == 0 else np.asarray(sigma)[present]
    given: list[Measurement] = [measure.Points(at[present], y[present], sigma=sigmas)]
    components: xr.DataArray | None = None
    if rates is not None:
        along = dim if rate_dim is None else rate_dim
        given.append(_body_rates(rates, along, rate_sigma, rate_bias))
        components = rates.isel({along: 0}, drop=True)
    elif rate_sigma is not None or rate_bias:
        raise ValidationError("rate_sigma and rate_bias belong to rates, but there are no rates. Pass rates.")
    if velocities is not None:
        along = dim if velocity_dim is None else velocity_dim
        given.append(_velocities(velocities, along, velocity_sigma, space, point_dims, at, y))
    elif velocity_sigma is not None:
        raise ValidationError("velocity_sigma belongs to velocities, but there are none. Pass velocities.")
    curve: Any = estimate_curve([*given, *measurements], knots, space, **options)
    label = times_of_points.name
    times, axes = times_with_names(times_of_points[~missing_times(at)] if to is None else to, label, point_dims, [])
    return _result(curve, space, points, times, [*axes, *point_dims], label, level, components)


def _refuse_others(array: xr.DataArray, own: Sequence[Hashable], name: str) -> None:
    if others := [str(d) for d in array.dims if d not in own]:
        raise ValidationError(
            f"{name} has the dimensions {', '.join(others)} besides {', '.join(map(str, own))}, but one curve is "
            f"estimated at a time. Select one with isel."
        )


def _times(
    array: xr.DataArray, along: str, name: str, time: str | None = None, point_dims: Sequence[str] = ()
) -> xr.DataArray:
    if along not in array.dims:
        raise ValidationError(f"{name} has the dimensions {array.dims}, but not {along!r}. Pass the name of its times.")
    remedy = "Pass time= to choose" if name == "points" else f"Remove the others by {name}.drop_vars"
    times = times_along(array, along, time, point_dims, remedy)
    if times is None:
        raise ValidationError(f"{along!r} of {name} has no coordinate, which would hold the times. Assign one.")
    if times.ndim > 1:
        _refuse_others(array, [along, *point_dims], name)
    return times


def _body_rates(rates: xr.DataArray, along: str, sigma: Any, bias: bool) -> measure.BodyRates:
    if not isinstance(rates, xr.DataArray):
        raise ValidationError(f"rates must be an xarray.DataArray, not {type(rates).__name__}")
    times = np.asarray(_times(rates, along, "rates").values)
    rest = [d for d in rates.dims if d != along]
    if len(rest) != 1 or rates.sizes[rest[0]] != 3:
        raise ValidationError(
            f"rates has the dimensions {dict(rates.sizes)}, but {along!r} and one dimension of three components are "
            "needed"
        )
    unit = str(rates.attrs.get("units", ""))
    if unit.lower().startswith("deg"):
        raise ValidationError(f"rates has the units {unit!r}, but radians are needed. Pass np.radians(rates).")
    if sigma is None:
        raise ValidationError("rates need the standard deviation of a component. Pass rate_sigma.")
    omega = np.asarray(rates.transpose(along, *rest).values)
    good = ~np.isnan(omega).any(axis=1) & ~missing_times(times)
    constant = measure.Constant(3) if bias else None
    return measure.BodyRates(times[good], omega[good], sigma=sigma, bias=constant)


def _velocities(
    velocities: xr.DataArray, along: str, sigma: Any, space: Space[Any], point_dims: Sequence[str], at: Array, y: Array
) -> measure.Velocities:
    if not isinstance(velocities, xr.DataArray):
        raise ValidationError(f"velocities must be an xarray.DataArray, not {type(velocities).__name__}")
    times = np.asarray(_times(velocities, along, "velocities", None, point_dims).values)
    check_dims(velocities.compute(), space, along, point_dims)
    _refuse_others(velocities, [along, *point_dims], "velocities")
    if sigma is None:
        raise ValidationError("velocities need the standard deviation of a coordinate. Pass velocity_sigma.")
    v = np.asarray(velocities.transpose(along, *point_dims).values)
    flat = isinstance(space, Euclidean)
    if not flat and not np.array_equal(times, at, equal_nan=True):
        raise ValidationError(
            f"velocities on {space} are tangent vectors at the points, and need their times. Pass other velocities as "
            "symspline.measure.Velocities in `measurements`."
        )
    feet = np.zeros_like(v) if flat else y
    good = ~(missing_times(times) | missing_points(space, v) | missing_points(space, feet))
    return measure.Velocities(times[good], feet[good], v[good], sigma=sigma)


def _result(
    curve: Any,
    space: Space[Any],
    points: xr.DataArray,
    times: xr.DataArray,
    dims: list[Hashable],
    label: Hashable,
    level: float | None,
    components: xr.DataArray | None,
) -> xr.Dataset:
    x, several = times.values, is_several(space)
    endings = ["_rotation", "_position"] if several else [""]
    axes = dims[: times.ndim]
    variables: dict[str, Any] = {"points": (dims, curve(x), dict(points.attrs))}
    spreads = {"std": curve.std(x)} | ({} if level is None else {"band": curve.band(x, level)})
    for kind, found in spreads.items():
        for ending, own in zip(endings, found if several else (found,), strict=True):
            variables[kind + ending] = (axes, own, unit_of(space, points, kind + ending))
    for name in ("lam", "df"):
        found = getattr(curve, name)
        for ending, own in zip(endings, found if several else (found,), strict=True):
            variables[name + ending] = ((), own)
    coords: dict[Hashable, Any] = {d: points[d] for d in dims[times.ndim :] if d in points.coords}
    for key, parameter in curve.parameters.items():
        name = key.replace(" ", "_")
        attrs: dict[str, Any] = {}
        own_dims: tuple[Hashable, ...] = (f"{name}_component",)
        if key == "gyro bias" and components is not None:
            own_dims = components.dims
            attrs = {"units": components.attrs["units"]} if "units" in components.attrs else {}
            coords |= {d: components[d] for d in own_dims if d in components.coords}
        for ending, values in (("", parameter.value), ("_std", parameter.std)):
            variables[name + ending] = (own_dims, values, attrs)
    ds = timed_by(xr.Dataset(variables, coords=coords), times, label)
    ds.attrs = {"space": str(space)}
    return ds

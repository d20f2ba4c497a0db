"""Smoothing splines of curves in an xarray object."""

from __future__ import annotations

import warnings
from collections.abc import Hashable, Sequence
from functools import reduce
from operator import getitem
from typing import Any, NamedTuple, Unpack

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from .._base.arrays import checked_number
from .._base.exceptions import SymsplineError
from .._base.faults import silenced
from .._base.typing import Array, Keywords, SmoothOptions, TimesLike
from .._curves.missing import missing_points, missing_times
from .._curves.options import checked_extrapolate, extrapolation_mode
from .._smoothing import SmoothingWarning, make_smoothing_spline
from .._smoothing.noise import is_several
from .._spaces import AnySpace, SpecialOrthogonal, space_named
from ._spec import (
    KNOTS,
    LINE,
    Inputs,
    apply,
    bare,
    in_radians,
    knots_of_block,
    named_curve,
    of_equal_length,
    per_curve_times,
    rehearse,
    spec_of,
    timed_by,
    times_of_rows,
    times_with_names,
)

# Columns of the report of a smoothing fit, per part of the space; the last one if λ or the noise may vary.
_COLUMNS: dict[str, type] = {"lam": np.float64, "df": np.float64, "sigma": np.float64, "at_bound": np.bool_}
_GAIN: dict[str, type] = {"gain": np.float64}
# Options that let a number vary along the curve, and the methods that return it.
_VARYING = {"lam": "lam_at", "noise": "sigma_at"}


def smooth(
    da: xr.DataArray,
    space: AnySpace | str,
    to: Any = None,
    *,
    dim: str = "time",
    time: str | None = None,
    point_dims: Sequence[str] = ("q",),
    where: xr.DataArray | None = None,
    std: bool = False,
    level: float | None = None,
    **options: Unpack[SmoothOptions],
) -> xr.Dataset:
    """Fit smoothing splines to noisy points, and evaluate them in one call.

    Points that are NaN are missing and have no influence. Samples whose time is NaN or NaT are dropped from each curve.
    Each curve has its own λ.

    Parameters
    ----------
    da : xarray.DataArray
        Noisy points, as for `fit`. Dask arrays are computed lazily.
    space : Space or str
        Space or its name. Products are not supported: smooth each factor separately.
    to : time, array_like or xarray.DataArray, optional
        Times at which the curves are evaluated, as `x` of `evaluate`. By default those of the data;
        values at missing times are NaN.
    dim : str, default "time"
        Dimension along the curves.
    time : str, optional
        Coordinate of the times, for example ``time(traj, obs)`` with a row of times per curve. By default the
        coordinate of `dim`, or the only other coordinate along `dim` that looks like times.
    point_dims : sequence of str, default ("q",)
        Dimensions of a point's array.
    where : xarray.DataArray of bool, optional
        Mask over the batch dimensions.
    std : bool, default False
        Whether the result has the standard deviation of the curve in one coordinate, as `SmoothingSpline.std`.
    level : float, optional
        Probability, such as 0.95. The result then has the radius of the band, as `SmoothingSpline.band`.
    **options
        Keyword arguments of `make_smoothing_spline`, such as ``penalty="jerk"``, `lam`, `noise`, `criterion`, `sigma`,
        `knots` and `loss`. The default of `on_failure` is ``"ignore"``.

    Returns
    -------
    xarray.Dataset
        ``points`` with the dimensions of `evaluate` and the attributes of `da`; ``std`` and ``band`` if requested; and
        ``lam``, ``df``, ``sigma``, ``at_bound`` and ``converged`` for every curve. With ``lam="adaptive"`` or
        ``noise="adaptive"`` also ``lam_at`` or ``sigma_at`` at the times of ``points``, and ``gain`` for every curve.
        For poses, all but ``points`` and ``converged`` have the endings ``_rotation`` and ``_position``. Curves that do
        not exist or did not converge are NaN.

    Raises
    ------
    ValidationError
        If names, shapes, times or options are invalid, or chunks split a curve.

    See Also
    --------
    fit : Fit curves through the points.

    Notes
    -----
    If there are more than 4000 times, or times that are very close together, knots are selected for all curves of a
    block of dask together. Pass `knots` for results that do not depend on the blocks.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> import symspline.xarray
    >>> t = np.linspace(0, 1, 50)
    >>> noisy = np.sin(6 * t) + 0.1 * np.random.default_rng(0).standard_normal((3, 50))
    >>> da = xr.DataArray(noisy[..., None], dims=("run", "time", "q"), coords={"time": t})
    >>> ds = symspline.xarray.smooth(da, "r:1", [0.25, 0.5], std=True, penalty="jerk")
    >>> ds.points.dims, ds["std"].dims, bool((ds.sigma < 0.15).all())
    (('run', 'time', 'q'), ('run', 'time'), True)
    """
    space = space_named(space)
    da = in_radians(da, space)
    given: Keywords = {"on_failure": "ignore", **options}
    if level is not None:
        level = checked_number(level, "level must lie between 0 and 1", lambda x: 0 < x < 1)
    chosen: Keywords = {"time": time, "skipna": True, "on_failure": given["on_failure"]}
    (_, *rest), spec, knots = spec_of(da, space, dim, point_dims, where, "natural", **chosen)
    has_times, t, label = "t" in spec["names"], spec["t"], dim if knots is None else knots.name
    if knots is not None and t is not None and (gone := missing_times(t)).any():
        knots, t = knots[~gone], t[~gone]
    _rehearse_options(t, da.sizes[dim] if t is None else len(t), given)
    if to is None:
        to = xr.DataArray(np.arange(da.sizes[dim]), dims=dim) if knots is None else knots
    curves = [d for d in da.dims if d not in (dim, *point_dims)]
    times, axes = times_with_names(to, label, point_dims, curves)
    ends = "periodic" if given.get("bc_type") == "periodic" else "natural"
    if not has_times:
        policy = extrapolation_mode(checked_extrapolate(given.get("extrapolate")), ends)
        rehearse(times, t, da.sizes[dim] if t is None else len(t), policy)
    inputs: Inputs = [(bare(da, dim), [KNOTS, *point_dims]), (times, axes), *rest]
    endings = ["_rotation", "_position"] if is_several(space) else [""]
    methods: list[tuple[str, tuple[float, ...]]] = [("std", ())] * std + ([] if level is None else [("band", (level,))])
    varying = [(method, ()) for name, method in _VARYING.items() if _is_adaptive(given.get(name))]
    methods += varying
    of_report = _COLUMNS | _GAIN if varying else _COLUMNS
    spreads = [name + ending for name, _ in methods for ending in endings]
    columns = [name + ending for name in of_report for ending in endings]
    dims: list[list[Hashable]] = [[*axes, *point_dims], *([*axes] for _ in spreads), *([] for _ in (*columns, "one"))]
    dtypes: list[Any] = [space.dtype, *(np.float64 for _ in spreads)]
    dtypes += [dtype for dtype in of_report.values() for _ in endings] + [np.bool_]
    fixed = {"t": spec["t"], "names": spec["names"], "wanted": _Wanted(space, given, methods, of_report)}
    variables = apply(_smoothed, inputs, dims, dtypes, x_axes=len(axes), **fixed)
    ds = xr.Dataset(dict(zip(["points", *spreads, *columns, "converged"], variables, strict=True)))
    ds["points"].attrs = dict(da.attrs)
    for name in spreads:
        ds[name].attrs = {} if name.startswith("lam_at") else unit_of(space, da, name)
    timed: xr.Dataset = timed_by(ds, times, label)
    return timed


def unit_of(space: AnySpace, da: xr.DataArray, name: str) -> Keywords:
    """Return the attributes of a standard deviation or radius: its units, if they are known."""
    if (
        name.endswith("_rotation")
        or isinstance(space, SpecialOrthogonal)
        or space._name in ("sphere", "rp", "cp", "torus")
    ):
        return {"units": "rad"}
    return {"units": da.attrs["units"]} if space._name == "euclidean" and "units" in da.attrs else {}


def _is_adaptive(value: object) -> bool:
    """Whether a number may vary along the curve, in a part of it at least."""
    entries = value if isinstance(value, tuple) else (value,)
    return any(isinstance(entry, str) and entry == "adaptive" for entry in entries)


def _rehearse_options(t: TimesLike | None, count: int, given: Keywords) -> None:
    """Raise errors about the options now, before any block is computed."""
    # Tuples are for poses, and end conditions may have vectors of the space.
    shaped = [name for name in ("lam", "sigma", "noise", "bc_type") if np.ndim(given.get(name, 0)) != 0]
    plain = {name: value for name, value in given.items() if name not in shaped}
    if given.get("criterion") == "cp" and given.get("sigma") is not None:
        plain.setdefault("sigma", 1.0)
    if plain.get("lam") in (None, "adaptive"):
        plain["lam"] = 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        make_smoothing_spline(t, np.zeros((count, 1)), LINE, **plain)


class _Wanted(NamedTuple):
    """What is fitted and evaluated in every block."""

    space: AnySpace
    how: Keywords
    spreads: list[tuple[str, tuple[float, ...]]]
    """Methods of the curve and their arguments."""
    columns: dict[str, type]
    """Columns of the report and their types."""


def _smoothed(
    points: Array,
    x: Array,
    *rest: Array,
    t: Any,
    names: list[str],
    wanted: _Wanted,
    x_axes: int,
) -> tuple[Array, ...]:
    """Smooth the curves of a block."""
    space = wanted.space
    named = dict(zip(names, rest, strict=True))
    batch = points.shape[: points.ndim - 1 - len(space.point_shape)]
    x, per_curve = per_curve_times(x, batch, x_axes)
    t = knots_of_block(t, named, batch)
    # A single curve is a batch of one, whose failure does not raise unless that is requested.
    whole = batch or (1,)
    mask = np.broadcast_to(named["where"], batch).reshape(whole) if "where" in named else None
    rows = points.reshape(*whole, *points.shape[len(batch) :])
    at = x.reshape(*whole, *x.shape[len(batch) :]) if per_curve else x
    if t is None or not missing_times(t).any():
        outputs = _smooth_rows(rows, t, at, per_curve, mask, wanted)
    else:
        outputs = _smooth_timed(rows, t, at, per_curve, mask, wanted)
    return tuple(np.asarray(output if batch else output[0]) for output in outputs)


def _smooth_timed(
    rows: Array, t: Array, at: Array, per_curve: bool, mask: Array | None, wanted: _Wanted
) -> list[Array]:
    """Smooth curves without the samples whose time is missing. Curves with fewer than two samples are NaN."""
    space, nodes = wanted.space, t.shape[-1]
    whole = rows.shape[: rows.ndim - 1 - len(space.point_shape)]
    times_shape = at.shape[len(whole) :] if per_curve else at.shape
    times = times_of_rows(t, whole, nodes)
    rows = rows.reshape(-1, nodes, *space.point_shape)
    chosen = np.ones(len(rows), bool) if mask is None else mask.reshape(-1)
    at = at.reshape(-1, *times_shape) if per_curve else at
    parts = 2 if is_several(space) else 1
    shapes = [(*times_shape, *space.point_shape), *[times_shape] * (len(wanted.spreads) * parts)]
    outputs = [np.full((len(rows), *shape), np.nan, space.dtype if i == 0 else float) for i, shape in enumerate(shapes)]
    for dtype in (*(part for part in wanted.columns.values() for _ in range(parts)), np.bool_):
        outputs.append(np.full(len(rows), np.nan if dtype is np.float64 else False, dtype))
    for curves, kept, knots, here, gone in of_equal_length(~missing_times(times), times, at, per_curve):
        try:
            parts_of_curves = _smooth_rows(rows[curves[:, None], kept], knots, here, per_curve, chosen[curves], wanted)
        except SymsplineError as error:
            raise named_curve(error, whole, curves) from None
        for i, (output, part) in enumerate(zip(outputs, parts_of_curves, strict=True)):
            if gone is not None and i < len(shapes):
                part[gone] = np.nan
            output[curves] = part
    return [part.reshape(*whole, *part.shape[1:]) for part in outputs]


def _smooth_rows(
    rows: Array, t: ArrayLike, at: Array, per_curve: bool, mask: Array | None, wanted: _Wanted
) -> list[Array]:
    """Smooth curves whose times are all known: values, spreads, columns of the report, and convergence."""
    space = wanted.space
    whole = rows.shape[: rows.ndim - 1 - len(space.point_shape)]
    missing = missing_points(space, rows)
    weights = (~missing).astype(np.float64) if missing.any() else None
    # The variable at_bound describes the curves about which a warning would be.
    with silenced(SmoothingWarning):
        curve: Any = make_smoothing_spline(t, rows, space, weights=weights, where=mask, **wanted.how)
    several = is_several(space)
    reports = curve.report if several else (curve.report,)
    converged = np.all([np.asarray(entry.converged) for entry in reports], axis=0)
    values = curve(at, per_curve=per_curve)
    spreads: list[Array] = []
    for name, arguments in wanted.spreads:
        if per_curve:
            rows_of = [getattr(reduce(getitem, i, curve), name)(at[i], *arguments) for i in np.ndindex(whole)]
            pairs = [entry if several else (entry,) for entry in rows_of]
            spreads += [np.reshape(part, at.shape) for part in zip(*pairs, strict=True)]
        else:
            spread = getattr(curve, name)(at, *arguments)
            spreads += spread if several else [spread]
    columns: list[Array] = []
    for name in ("lam", "df", "sigma"):
        numbers = getattr(curve, name)
        columns += [np.broadcast_to(entry, whole) for entry in (numbers if several else (numbers,))]
    columns += [np.asarray(entry.at_bound) for entry in reports]
    if "gain" in wanted.columns:
        # Parts whose λ and noise are constant by request have none.
        columns += [np.full(whole, np.nan) if entry.gain is None else np.asarray(entry.gain) for entry in reports]
    for entry in (values, *spreads):
        entry[~converged] = np.nan
    return [values, *spreads, *columns, converged]

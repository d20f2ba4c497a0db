"""Curves in files: NPZ, read without pickle and without a new fit."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _archive
from ._archive import (
    FORMAT,
    HERMITE,
    LISTS,
    MANY,
    SMOOTHING,
    VERSION,
    Entries,
    entry,
    json_in,
    rich,
    text_in,
    write,
)
from ._arrays import brief, short_repr
from ._core import ValidationError
from ._cubic import CubicSpline
from ._curves.ends import is_closed
from ._curves.fit import curve_of, read_ends
from ._disk import path_of
from ._hermite import HermiteSpline
from ._input import NO_ZONE, UTC_ZONE
from ._options import checked_extrapolate
from ._report import OPTIONAL, SOLVERS, Report, longest_gap
from ._smoothing import SmoothingSpline
from ._smoothing.stored import read_stored
from ._spaces import Array, Product, Space, factors_of
from ._spaces import space as space_named
from ._time import Moments, TimeAxis, time_axis_of
from ._typing import File

_T = TypeVar("_T")


def save_many(curves: Mapping[str, CubicSpline[Any]], file: File) -> None:
    """Write curves of one space, of any lengths, to one NPZ file, which `load_many` reads back.

    Knots, points and velocities of all curves follow each other in one array each; ``knots`` holds how
    many of them every curve has, ``names`` and the conditions and reports are lists in JSON. Smoothing splines keep
    their data and bands.

    Args:
        curves: names and curves, none of them a batch; the knots of all are numbers, or all dates of one unit. All are
            smoothing splines or none is.
        file: where to write, a name or an open file.

    >>> import io, symspline as ss
    >>> square = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    >>> long, short = ss.fit_many([(None, square), ([0, 2], square[:2])], "sphere:2")
    >>> file = io.BytesIO()
    >>> ss.save_many({"long": long, "short": short}, file)
    >>> _ = file.seek(0)
    >>> ss.load_many(file) == {"long": long, "short": short}
    True
    """
    if not isinstance(curves, Mapping) or not all(isinstance(c, CubicSpline) for c in curves.values()):
        raise TypeError("curves must be a dictionary of names and objects of CubicSpline")
    if not all(isinstance(name, str) for name in curves):
        raise ValidationError("names of curves must be text")
    if any(spline._batch for spline in curves.values()):
        raise ValidationError("save_many takes single curves; a batch has a method save of its own")
    if len({(spline.space, spline._t.dtype, spline._clock.zone) for spline in curves.values()}) != 1:
        raise ValidationError(
            "save_many needs curves, all of one space and with knots of one type, dates all with a time zone or without"
        )
    each = [spline._arrays() for spline in curves.values()]
    if len({(a["format"], a.get("data_t_unit")) for a in each}) != 1:
        raise ValidationError(
            "save_many takes smoothing splines, with data at times of one type, or other curves, not both"
        )
    arrays: dict[str, Any] = {
        "format": MANY,
        "names": json.dumps(list(curves)),
        "knots": [len(a["t"]) for a in each],
    }
    if each[0]["format"] == SMOOTHING:
        arrays["samples"] = [len(a["data_t"]) for a in each]
    for key in each[0]:
        values = [a[key] for a in each]
        if key in LISTS:
            arrays[key] = json.dumps([json.loads(value) for value in values])
        elif isinstance(values[0], np.ndarray):
            arrays[key] = np.concatenate(values)
        else:
            arrays.setdefault(key, values[0])
    write(file, arrays)


def load(file: File) -> CubicSpline | HermiteSpline:
    """Read a curve that `CubicSpline.save`, `SmoothingSpline.save` or `HermiteSpline.save` wrote, as the kind of curve
    that it was.

    Raises:
        ValidationError: the file is damaged, or not a symspline curve.
        OSError: the file cannot be read.

    >>> import io, symspline as ss
    >>> file = io.BytesIO()
    >>> spline = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "sphere:2")
    >>> spline.save(file)
    >>> _ = file.seek(0)
    >>> ss.load(file) == spline
    True
    """
    return _opened(file, _read)


def load_many(file: File) -> dict[str, CubicSpline]:
    """Read the curves that `save_many`, or ``symspline fit --curve`` on the command line, wrote.

    Returns:
        Names and curves, in the order in which they were written.

    Raises:
        ValidationError: the file is damaged, or does not hold symspline curves.
        OSError: the file cannot be read.
    """
    return _opened(file, _read_many)


def _opened(file: Any, read: Callable[[Entries], _T]) -> _T:
    path = path_of(file, method="read")
    name = getattr(file, "name", "the file") if path is None else path
    try:
        if path is None:
            return read(_arrays_of(file))
        with open(path, "rb") as opened:
            return read(_arrays_of(opened))
    except (OSError, MemoryError):
        raise
    except ValidationError as error:
        raise ValidationError(f"{name}: {error}") from None
    except Exception as error:
        # Damage shows as errors of zipfile, of its decompressors, of NumPy and of JSON.
        raise ValidationError(f"{name} is damaged or not a symspline curve: {brief(error)}") from None


def _arrays_of(file: Any) -> Entries:
    try:
        arrays = _archive.read(file, _archive.is_curve)
    except zipfile.BadZipFile:
        raise ValidationError("this is damaged or not a symspline curve: it is not an NPZ file") from None
    if "format" not in arrays:
        raise ValidationError("this is not a symspline curve")
    return arrays


def _read_many(arrays: Entries) -> dict[str, CubicSpline]:
    kind = text_in(arrays, "format")
    if kind in (FORMAT, SMOOTHING, HERMITE):
        raise ValidationError("this file holds one curve or a batch; read it with symspline.load")
    if kind != MANY:
        raise ValidationError(f"entry 'format' is {short_repr(kind)}, but must be {MANY!r}")
    names, own = json_in(arrays, "names"), _slices(arrays, "knots", "t")
    smooth = "samples" in arrays
    data = _slices(arrays, "samples", "data_t") if smooth else own
    lists = {key: json_in(arrays, key) for key in LISTS if key in arrays}
    for key, values in {"names": names, **lists}.items():
        if not isinstance(values, list) or len(values) != len(own):
            raise ValidationError(
                f"entry {key!r} must be a list with one value for each of {len(own)} curves"
            )
    if not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise ValidationError("entry 'names' must hold texts, none of them twice")
    curves = {}
    for i, (name, knots, samples) in enumerate(zip(names, own, data, strict=True)):
        one = Entries(
            (key, array[samples if key.startswith("data") else knots] if array.ndim else array)
            for key, array in arrays.items()
        )
        one |= {key: np.array(json.dumps(values[i])) for key, values in lists.items()}
        try:
            curves[name] = _smoothing(one) if smooth else _cubic(one)
        except ValidationError as error:
            raise ValidationError(f"curve {short_repr(name)}: {error}") from None
    return curves


def _slices(arrays: Entries, counts: str, times: str) -> list[slice]:
    """Which part of the arrays belongs to which curve."""
    numbers = arrays[counts]
    if numbers.ndim != 1 or numbers.dtype.kind not in "iu" or (numbers.astype(np.int64) < 1).any():
        raise ValidationError(f"entry {counts!r} must hold the number of {counts} of every curve")
    if arrays[times].ndim != 1:
        raise ValidationError(f"entry {times!r} has shape {arrays[times].shape}, but must have one axis")
    ends = np.cumsum(numbers)
    if ends[-1:].tolist() != [len(arrays[times])]:
        raise ValidationError(
            f"entry {counts!r} adds up to {numbers.sum()}, but entry {times!r} has {len(arrays[times])}"
        )
    return [slice(end - count, end) for end, count in zip(ends, arrays[counts], strict=True)]


def _read(arrays: Entries) -> CubicSpline | HermiteSpline:
    kind = text_in(arrays, "format")
    if kind == MANY:
        raise ValidationError("this file holds several curves; read them with symspline.load_many")
    if kind == FORMAT:
        return _cubic(arrays)
    if kind == SMOOTHING:
        return _smoothing(arrays)
    if kind == HERMITE:
        return _hermite(arrays)
    raise ValidationError(
        f"entry 'format' is {short_repr(kind)}, but must be {FORMAT!r}, {SMOOTHING!r} or {HERMITE!r}"
    )


def _smoothing(arrays: Entries) -> SmoothingSpline:
    clock, t = _times(arrays, "data_t")
    spline = _cubic(arrays, clock)
    closed = is_closed(spline.bc_type)
    return SmoothingSpline._like(spline, *read_stored(arrays, clock, t, spline._curve, closed))


def _cubic(arrays: Entries, counted: TimeAxis | None = None) -> CubicSpline:
    space, clock, knots, found, extrapolate = _piecewise(arrays, counted)
    times = clock.knots(knots)
    curve = curve_of(space, times, found)
    plain_ends, plain_reports = json_in(arrays, "bc_type"), json_in(arrays, "report")
    with entry("bc_type"):
        bc_type = rich(plain_ends, space)
        read_ends(bc_type, space, curve.batch)
    with entry("report"):
        if not isinstance(plain_reports, list) or len(plain_reports) != len(found):
            raise ValidationError(f"it must be a list with one report for each of {len(found)} factors")
        reports = [_report(plain, times, curve.batch) for plain in plain_reports]
    for factor, pair, report in zip(factors_of(space), found, reports, strict=True):
        _check(factor, *pair, report.converged)
    return CubicSpline._of(clock, knots, curve, bc_type, extrapolate, reports)


def _hermite(arrays: Entries) -> HermiteSpline:
    space, clock, knots, found, extrapolate = _piecewise(arrays)
    for factor, pair in zip(factors_of(space), found, strict=True):
        _check(factor, *pair, True)
    curve = curve_of(space, clock.knots(knots), found, fitted=False)
    return HermiteSpline._of(clock, knots, curve, extrapolate)


def _piecewise(
    arrays: Entries, counted: TimeAxis | None = None
) -> tuple[Space, TimeAxis, NDArray[Any], list[tuple[Array, Array]], Any]:
    """What curves of every kind have: space, clock, knots as shown, points and velocities in every factor, and what
    happens outside the knots.

    Args:
        counted: the clock, if times are not counted from the first knot.
    """
    version = arrays["version"]
    if version.ndim or version.dtype.kind not in "iu" or int(version) != VERSION:
        raise ValidationError(
            f"entry 'version' is {short_repr(version.tolist())}; this symspline reads version {VERSION}, a newer one "
            "may read this file"
        )
    with entry("space"):
        space = space_named(text_in(arrays, "space"))
    policy = json_in(arrays, "extrapolate")
    with entry("extrapolate"):
        extrapolate = checked_extrapolate(policy)
    clock, knots = _times(arrays, "t")
    if counted is not None:
        if counted.dates != clock.dates:
            raise ValidationError("the times of the knots and of the data are of different kinds")
        clock = counted
    times = clock.knots(knots)
    if not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
        raise ValidationError("entry 't': the knots do not increase")
    found = [
        _arrays_in(factor, arrays, f"_{i}" if isinstance(space, Product) else "", times)
        for i, factor in enumerate(factors_of(space))
    ]
    return space, clock, knots, found, extrapolate


def _times(arrays: Entries, name: str) -> tuple[TimeAxis, NDArray[Any]]:
    """Times as shown, and how they are counted."""
    unit, _, zone = text_in(arrays, f"{name}_unit").partition(" ")
    with entry(f"{name}_unit"):
        if zone not in ("", UTC_ZONE, NO_ZONE):
            raise ValidationError(f"the zone of the times is {short_repr(zone)}, but must be UTC or none")
        kind = np.dtype(f"datetime64[{unit}]") if unit else None
    with entry(name):
        if kind is not None and arrays[name].dtype.kind not in "iu":
            raise ValidationError(f"dates are counted in whole numbers, not in {arrays[name].dtype}")
        return time_axis_of(
            Moments(arrays[name] if kind is None else arrays[name].astype(kind), zone or None)
        )


def _arrays_in(
    factor: Space, arrays: Entries, suffix: str, times: NDArray[np.float64]
) -> tuple[Array, Array]:
    """Points and velocities in a factor."""
    points, velocities = (
        factor._numbers(factor._doubles(arrays[key + suffix], key + suffix))
        for key in ("points", "velocities")
    )
    nodes = points.shape[: points.ndim - len(factor.point_shape)]
    if points.shape != velocities.shape or not nodes or times.shape not in ((nodes[-1],), nodes):
        raise ValidationError(
            f"shapes do not fit: t {times.shape}, points {points.shape}, velocities {velocities.shape}"
        )
    if nodes[-1] < 2:
        raise ValidationError("a curve needs at least two points")
    return points, velocities


def _check(space: Space, points: Array, velocities: Array, converged: Any) -> None:
    """Points are on the space, velocities tangent; only curves that failed, or were left out, may be NaN."""
    axes = tuple(range(-1 - len(space.point_shape), 0))
    there, finite = (np.isfinite(array).all(axis=axes) for array in (points, velocities))
    with entry("points"):
        space.check_point(points[there])
    finite &= there
    if not (finite | ~np.asarray(converged)).all():
        raise ValidationError("entries 'points' and 'velocities' must be finite")
    off = velocities[finite] - space.project_tangent(points[finite], velocities[finite])
    allowed = 1e-8 + 100 * np.finfo(np.float64).eps * float(space.rounding(points).max(initial=1.0))
    if np.abs(off).max(initial=0.0) > allowed * np.abs(velocities[finite]).max(initial=1e-8):
        raise ValidationError("entry 'velocities': the vectors are not tangent at the points")


_DTYPES = {"b": np.bool_, "i": np.int64, "f": np.float64}


def _report(plain: dict[str, Any], times: NDArray[np.float64], batch: tuple[int, ...]) -> Report:
    numbers = dict.fromkeys(("residual", "max_step", "curvature", "rate", *OPTIONAL), "f")
    kinds = {"converged": "b", "iterations": "i"} | numbers
    if not batch:
        kinds["guaranteed_sweeps"] = "i"

    def column(key: str, value: Any) -> Any:
        if key not in kinds or (key in OPTIONAL and value is None):
            return value
        shape = () if key == "curvature" else batch
        # Of no curves a list does not tell what it is of.
        none = isinstance(value, list) and np.size(value) == 0 and 0 in shape
        array = np.zeros(shape, _DTYPES[kinds[key]]) if none else np.asarray(value)
        if array.shape != shape or array.dtype.kind != kinds[key]:
            raise ValidationError(f"{key} is {short_repr(value)}")
        return array if shape else value

    unknown = set(plain) - {field.name for field in fields(Report)} | {"max_gap"} & set(plain)
    if unknown:
        raise ValidationError(f"there is no field {short_repr(min(unknown))}")
    if plain["method"] not in SOLVERS:
        raise ValidationError(
            f"the method is {short_repr(plain['method'])}, but must be one of {', '.join(SOLVERS)}"
        )
    columns = {key: column(key, value) for key, value in plain.items()}
    columns["skipped"] = tuple(map(str, plain.get("skipped", ())))
    return Report(max_gap=longest_gap(times, batch), **columns)

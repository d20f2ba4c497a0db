"""The states of curves, which files and pickles hold, and NPZ files of them.

A state has the entries of `ENTRIES` by name. In a file texts and arrays are stored as they are and all else as JSON. A
pickle holds the state itself, with the space as an object.
"""

from __future__ import annotations

import json
import math
import os
import re
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from typing import Any, Never, TypeVar

import numpy as np

from .._base import VERSION as LIBRARY
from .._base.arrays import brief, short_repr
from .._base.input import NO_ZONE, UTC_ZONE
from .._base.report import Report
from .._base.system import path_of, replacing
from .._base.time import Moments, TimeAxis, time_axis_of
from .._base.typing import Array, File, State
from .._core import ValidationError
from .._curves.curve import CurveArrays
from .._curves.ends import freeze_bc_type
from .._curves.fit import curve_of, read_ends
from .._curves.options import checked_extrapolate
from .._spaces import AnySpace, Doubles, Product, Space, factors_of, space_named
from ..manifolds._manifold import refuse_functions

# Raise it when the entries change, and keep reading files of all earlier versions.
VERSION = 2
# Texts are the same for all curves of a file.
TEXTS = ("format", "space", "t_unit", "data_t_unit")
_AXIS_UNIT = re.compile(r"axis_\d{1,2}_unit")
_JSON = (
    *("bc_type", "c1_nodes", "extrapolate", "report", "noise", "parameters", "degree", "names", "rows", "grid", "law"),
    *("plain", "gaps"),
)
_ARRAY = re.compile(
    r"(?:version|t|data_t|knots|axis_\d{1,2})|(?:points|velocities|control_points|data|data_weights|data_information"
    r"|band|matrix|turn|side|corner|variance|profile|noise_profile)(?:_\d{1,9})?"
)
# Arrays that not all curves of a file have.
OPTIONAL = re.compile(r"(?:data_weights|profile|noise_profile)(?:_\d{1,9})?")
# At most four levels of curves that are made of others.
_PART = re.compile(r"(?:\d{1,6}/){1,4}")
# Compressed entries are at most this much larger than the file, or of this size.
_RATIO, _SMALL = 100, 2**24
_Report = TypeVar("_Report")
_T = TypeVar("_T")


# The classes of curves by the name of their format. They have the methods `_state` and `_from_state`.
FORMATS: dict[str, type[Any]] = {}


class Entries(dict[str, Any]):
    """The entries of a state by name; a missing entry raises ValidationError."""

    def __missing__(self, name: str) -> Never:
        raise ValidationError(f"entry {name!r} is missing")

    def read(self, name: str, check: Callable[[Any], _T]) -> _T:
        """Return an entry as a function returns it, whose errors then name the entry."""
        value = self[name]
        with entry(name):
            return check(value)


class Stored(Entries):
    """The entries of a file, which may hold any points and vectors."""


def check_version(state: Entries) -> None:
    """Raise ValidationError if a newer symspline wrote the curve."""
    version = state["version"]
    if isinstance(version, np.ndarray):
        version = version.tolist()
    if type(version) is not int or version < 1:
        raise ValidationError(f"entry 'version' is {short_repr(version)}, but must be a positive integer")
    if version > VERSION:
        raise ValidationError(
            f"the format has version {version}, but symspline {LIBRARY} reads versions up to {VERSION}. Install a "
            "newer symspline: pip install --upgrade symspline"
        )


def restore(state: State) -> Any:
    """Make the curve that a state describes. Pickles refer to this function by its name."""
    entries = state if isinstance(state, Entries) else Entries(state)
    check_version(entries)
    kind = entries["format"]
    if kind not in FORMATS:
        raise ValidationError(
            f"entry 'format' is {short_repr(kind)}, but must be one of {', '.join(map(repr, FORMATS))}"
        )
    return FORMATS[kind]._from_state(entries)


def write(file: File, state: State) -> None:
    """Write a state to an open file, or replace a file by its name (`_base.system.replacing`)."""
    refuse_functions(
        state["space"],
        "curves are not saved (files hold no functions: pickle them, or keep t, points and velocities)",
        named=True,
    )
    arrays = _flat(state)
    path = path_of(file, method="write")
    if path is None:
        np.savez(file, **arrays)
        return
    with replacing(path) as temporary, open(temporary, "wb") as out:
        np.savez(out, **arrays)


def _flat(state: State) -> State:
    """Return the arrays of a file. Those of the curves of which a curve is made have their number in front."""
    arrays: State = {}
    for name, value in state.items():
        if name.isdigit():
            arrays |= {f"{name}/{key}": entry_value for key, entry_value in _flat(value).items()}
        elif _is_text(name) or isinstance(value, np.ndarray):
            arrays[name] = value
        else:
            arrays[name] = json.dumps(value, default=_as_json)
    return arrays | {"space": str(state["space"]), "version": state["version"]}


def _nested(arrays: State) -> Stored:
    """Return the state of a curve from the arrays of a file, the inverse of `_flat`."""
    state, parts = Stored(), dict[str, Stored]()
    for name, value in arrays.items():
        number, slash, rest = name.partition("/")
        if slash:
            parts.setdefault(number, Stored())[rest] = value
        else:
            state[name] = text_in(arrays, name) if _is_text(name) else json_in(arrays, name) if name in _JSON else value
    return Stored(state | {number: _nested(part) for number, part in parts.items()})


def _is_text(name: str) -> bool:
    return name in TEXTS or _AXIS_UNIT.fullmatch(name) is not None


def _as_json(value: object) -> Any:
    if isinstance(value, np.ndarray) and value.dtype.kind == "c":
        return {"re": value.real.tolist(), "im": value.imag.tolist()}
    if not hasattr(value, "tolist"):
        raise ValidationError(
            "curves with a time law that is a function are not saved. Pickle them, or save the curve."
        )
    return value.tolist()


def read_state(file: File) -> Stored:
    """Return the entries of an open file of curves."""
    try:
        arrays = read(file, _is_entry)
    except zipfile.BadZipFile:
        raise ValidationError("this is damaged or not a symspline curve: it is not an NPZ file") from None
    if "format" not in arrays:
        raise ValidationError("this is not a symspline curve")
    check_version(arrays)
    return _nested(arrays)


def _is_entry(name: str) -> bool:
    """Whether an array of a file is an entry of a state, or of a curve of which a curve is made."""
    prefix = _PART.match(name)
    entry_name = name[prefix.end() :] if prefix else name
    return _is_text(entry_name) or entry_name in _JSON or _ARRAY.fullmatch(entry_name) is not None


# ---- archives ----


def read(file: Any, selected: Callable[[str], object]) -> Entries:
    """Read the arrays of an NPZ file with these names, and no others.

    Sizes are taken from the archive's index before any array is read: compression makes a file of any size from a few
    kilobytes.

    Parameters
    ----------
    file : open file
        In binary mode, one that can seek.
    selected : callable
        Whether the array of a name is to be read.

    Raises
    ------
    ValidationError
        If an array is too large for the size of the file, or does not have the size that its header states.
    Exception
        Damage appears as errors of zipfile, of its decompressors and of NumPy.
    """
    length = file.seek(0, os.SEEK_END)
    file.seek(0)
    with zipfile.ZipFile(file) as archive:
        members = {
            member.filename.removesuffix(".npy"): member
            for member in archive.infolist()
            if member.filename.endswith(".npy") and selected(member.filename.removesuffix(".npy"))
        }
        most, total = max(_SMALL, _RATIO * length), 0
        for name, member in members.items():
            total += member.file_size
            if total > most:
                raise ValidationError(
                    f"entry {name!r} would take {member.file_size} bytes of memory, but the file has {length}: a file "
                    f"may hold {_RATIO} times its own size; write it without compression"
                )
        return Entries((name, _array_in(archive, name, member)) for name, member in members.items())


def _array_in(archive: zipfile.ZipFile, name: str, member: zipfile.ZipInfo) -> Array:
    with archive.open(member) as entry:
        header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
        shape, _, dtype = header[np.lib.format.read_magic(entry)](entry)
        size = member.file_size - entry.tell()
    # NumPy makes an array of this shape before it reads the numbers.
    if dtype.hasobject:
        raise ValidationError(f"entry {name!r} holds Python objects, which are not read; save numbers or texts")
    if math.prod(shape) * dtype.itemsize != size:
        raise ValidationError(f"entry {name!r} is damaged: it has {size} bytes, not those of {dtype} in shape {shape}")
    with archive.open(member) as entry:
        return np.asarray(np.lib.format.read_array(entry, allow_pickle=False))


def text_in(arrays: Mapping[str, Array], name: str) -> str:
    """Return an entry that is one text.

    Raises
    ------
    ValidationError
        If it is something else.
    """
    array = arrays[name]
    if array.ndim or array.dtype.kind != "U":
        raise ValidationError(f"entry {name!r} is not a text: it holds {array.dtype} of shape {array.shape}")
    return str(array)


def json_in(arrays: Mapping[str, Array], name: str) -> Any:
    """Return an entry that is a text in JSON.

    Raises
    ------
    ValidationError
        If it is something else.
    """
    text = text_in(arrays, name)
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValidationError(f"entry {name!r} is not JSON: {brief(error)}") from None


@contextmanager
def entry(name: str) -> Iterator[None]:
    """Name the entry in which something is wrong."""
    try:
        yield
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError) as error:
        # Values of other types than those that are written can cause any of these.
        what = error if isinstance(error, ValidationError) else f"{type(error).__name__}: {error}"
        raise ValidationError(f"entry {name!r}: {brief(what, 500)}") from None


# ---- entries of several classes of curves ----


def head_of(curve: Any) -> State:
    """Return the entries that all classes have."""
    return {"format": curve._format, "version": VERSION, "space": curve.space}


def by_factor(name: str, space: AnySpace, arrays: Iterable[Array]) -> dict[str, Array]:
    """Return the entries of arrays in each factor."""
    return {name + suffix_of(space, i): array for i, array in enumerate(arrays)}


def read_by_factor(state: Entries, name: str, space: AnySpace) -> list[Array]:
    """Return the arrays in each factor, the inverse of `by_factor`."""
    return [read_array(state, name + suffix_of(space, i), factor) for i, factor in enumerate(factors_of(space))]


def read_segments(
    state: Entries, counted: TimeAxis | None = None, *, fitted: bool = True
) -> tuple[TimeAxis, Array, CurveArrays, Any]:
    """Return the time axis, the knots as shown, the curve and the extrapolation policy.

    Parameters
    ----------
    state : Entries
        State of a curve.
    counted : TimeAxis, optional
        The time axis, unless times are counted from the first knot.
    fitted : bool
        Whether the velocities are those of a C² curve.
    """
    space = read_space(state)
    extrapolate = state.read("extrapolate", checked_extrapolate)
    time_axis, knots = read_times(state, "t")
    if counted is not None:
        if counted.dates != time_axis.dates:
            raise ValidationError("the times of the knots and of the data are of different kinds")
        time_axis = counted
    times = time_axis.knots(knots)
    if not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
        raise ValidationError("entry 't': the knots do not increase")
    points, velocities = (read_by_factor(state, name, space) for name in ("points", "velocities"))
    arrays = list(zip(points, velocities, strict=True))
    for factor, (p, v) in zip(factors_of(space), arrays, strict=True):
        _check_nodes(factor, p, v, times)
    return time_axis, knots, curve_of(space, times, arrays, fitted), extrapolate


def read_c1_nodes(state: Entries) -> tuple[int, ...]:
    """Return the nodes with prescribed velocities; most curves have none."""
    nodes = state.get("c1_nodes", [])
    last = len(np.atleast_1d(state["t"]).T) - 1
    if not isinstance(nodes, list) or not all(type(node) is int and 0 < node < last for node in nodes):
        raise ValidationError(f"entry 'c1_nodes' is {short_repr(nodes)}, but must be a list of indices of inner points")
    return tuple(nodes)


def read_fitted(
    state: Entries, counted: TimeAxis | None = None, *, fitted: bool = True
) -> tuple[TimeAxis, Array, CurveArrays, Any, Any, list[Report]]:
    """Return the arguments of `CubicSpline._fitted`: the same with end conditions and reports."""
    time_axis, knots, curve, extrapolate = read_segments(state, counted, fitted=fitted)
    space = curve.space

    def read_bc_type(plain: Any) -> Any:
        bc_type = freeze_bc_type(_read_bc_type(plain, space))
        read_ends(bc_type, space, curve.batch)
        return bc_type

    def read_reports(plain: object) -> list[Report]:
        if not isinstance(plain, list) or len(plain) != len(curve.parts):
            raise ValidationError(f"it must be a list with one report for each of {len(curve.parts)} factors")
        return [read_report(Report, fields, curve.batch) for fields in plain]

    bc_type, reports = state.read("bc_type", read_bc_type), state.read("report", read_reports)
    check_curves(state, curve, [report.converged for report in reports])
    return time_axis, knots, curve, bc_type, extrapolate, reports


def suffix_of(space: AnySpace, i: int) -> str:
    """Return the suffix of the names of entries of the i-th factor."""
    return f"_{i}" if isinstance(space, Product) else ""


def read_space(state: Entries) -> Space:
    """Return the space, which is a name in a file and an object in a pickle."""
    return state.read("space", space_named)


def times_state(name: str, t: Array, time_axis: TimeAxis) -> State:
    """Return times as numbers, and their unit.

    Examples of units are "ns", "10m" for dates that count in tens of minutes, "ns UTC" for dates with a time zone, and
    "duration".
    """
    if not time_axis.dates:
        return {name: t, f"{name}_unit": "duration" if time_axis.durations else ""}
    unit, step = np.datetime_data(t.dtype)
    words = [unit if step == 1 else f"{step}{unit}", time_axis.zone or ""]
    return {name: t.astype(np.int64), f"{name}_unit": " ".join(words).strip()}


def read_times(state: Entries, name: str) -> tuple[TimeAxis, Array]:
    """Return the time axis, and times as shown."""
    unit, _, zone = state[f"{name}_unit"].partition(" ")
    with entry(f"{name}_unit"):
        if zone not in ("", UTC_ZONE, NO_ZONE):
            raise ValidationError(f"the zone of the times is {short_repr(zone)}, but must be UTC or none")
        kind = np.dtype(f"datetime64[{unit}]") if unit not in ("", "duration") else None
    times = state[name]
    with entry(name):
        if kind is None:
            time_axis, shown = time_axis_of(Moments(times, zone or None))
            return (TimeAxis(durations=True) if unit else time_axis), shown
        if times.dtype.kind not in "iu":
            raise ValidationError(f"dates are counted in whole numbers, not in {times.dtype}")
        return time_axis_of(Moments(times.astype(kind), zone or None))


def _check_nodes(factor: Space, points: Array, velocities: Array, times: Doubles) -> None:
    """Raise ValidationError unless points and velocities in one factor belong to the knots."""
    nodes = points.shape[: points.ndim - len(factor.point_shape)]
    if points.shape != velocities.shape or not nodes or times.shape not in ((nodes[-1],), nodes):
        raise ValidationError(
            f"shapes do not fit: t {times.shape}, points {points.shape}, velocities {velocities.shape}"
        )
    if nodes[-1] < 2:
        raise ValidationError("a curve needs at least two points")


def read_array(state: Entries, name: str, space: Space) -> Array:
    """Return an array of points or vectors of a space."""
    return space._numbers(space._doubles(state[name], name))


def check_curves(state: Entries, curve: CurveArrays, converged: list[Any], gaps: bool = False) -> None:
    """Raise ValidationError if points of a file are off the space, or velocities are not tangent. Only curves that
    failed or are masked can be NaN. With `gaps`, velocities can be NaN."""
    if not isinstance(state, Stored):
        return
    for part, good in zip(curve.parts, converged, strict=True):
        space, points, velocities = part.space, part.points, part.velocities
        axes = tuple(range(-1 - len(space.point_shape), 0))
        there, finite = (np.isfinite(array).all(axis=axes) for array in (points, velocities))
        with entry("points"):
            space.check_point(points[there])
        finite &= there
        if not ((there if gaps else finite) | ~np.asarray(good)).all():
            raise ValidationError("entries 'points' and 'velocities' must be finite")
        off = velocities[finite] - space.project_tangent(points[finite], velocities[finite])
        allowed = 1e-8 + 100 * np.finfo(np.float64).eps * float(space._rounding(points).max(initial=1.0))
        if np.abs(off).max(initial=0.0) > allowed * np.abs(velocities[finite]).max(initial=1e-8):
            raise ValidationError("entry 'velocities': the vectors are not tangent at the points")


def _read_bc_type(value: Any, space: Space) -> Any:
    """Return end conditions; in a product vectors are tuples of arrays."""
    if isinstance(value, str):
        return value

    def vectors(plain: Any) -> Any:
        return tuple(map(_vector, plain)) if isinstance(space, Product) else _vector(plain)

    return tuple(end if isinstance(end, str) else (end[0], vectors(end[1])) for end in value)


def _vector(plain: object) -> Any:
    if isinstance(plain, dict):
        return np.asarray(plain["re"], np.float64) + 1j * np.asarray(plain["im"], np.float64)
    return plain if isinstance(plain, np.ndarray) else np.asarray(plain, np.float64)


# Fields of reports in files of earlier versions.
_FORMER = {"velocity_error"}


def read_report(kind: type[_Report], plain: Any, batch: tuple[int, ...]) -> _Report:
    """Return a report from the values of its fields, `vars` of a report."""
    known = {field.name: field.metadata for field in fields(kind)}  # type: ignore[arg-type]
    if unknown := set(plain) - set(known) - _FORMER:
        raise ValidationError(f"there is no field {short_repr(min(unknown))}")
    # Files of older versions do not have all of the optional fields.
    given = {name: plain.get(name) if field.get("optional") else plain[name] for name, field in known.items()}
    return kind(**{name: read_field(name, given[name], batch, **field) for name, field in known.items()})


def read_field(
    name: str,
    value: Any,
    batch: tuple[int, ...],
    *,
    dtype: Any = None,
    words: tuple[str, ...] = (),
    optional: bool = False,
) -> Any:
    """Return the value of a field of a report: one of `words`, or one number per curve of type `dtype`."""
    if words and value not in words:
        raise ValidationError(f"the {name} is {short_repr(value)}, but must be one of {', '.join(words)}")
    if dtype is None:
        return tuple(map(str, value)) if isinstance(value, list) else value
    if optional and value is None:
        return None
    # The list of an empty batch does not show its type.
    array = np.asarray(value, dtype if 0 in batch else None)
    kinds = {"b": "b", "i": "i", "f": "fi" if optional else "f"}[np.dtype(dtype).kind]
    if array.shape != batch or array.dtype.kind not in kinds:
        raise ValidationError(f"{name} is {short_repr(value)}")
    return array if batch else value

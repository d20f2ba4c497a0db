"""How curves stand in an NPZ file, and writing them there."""

from __future__ import annotations

import json
import math
import os
import re
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import brief
from ._base_curve import Curve
from ._core import ValidationError
from ._disk import path_of, replacing
from ._report import Report
from ._spaces import Product, Space
from ._time import TimeAxis
from .manifolds._manifold import refuse_functions

FORMAT = "symspline-curve"
HERMITE = "symspline-hermite"
SMOOTHING = "symspline-smoothing"
MANY = "symspline-curves"
LISTS = ("bc_type", "extrapolate", "report", "noise")
VERSION = 1
_KNOWN = re.compile(
    r"format|version|space|t|t_unit|bc_type|extrapolate|report|names|knots|samples|noise|data_t|data_t_unit"
    r"|(?:points|velocities|data|data_weights|data_information|band)(?:_\d{1,9})?"
)
# What is compressed is at most this much larger than the file, or of this size.
_RATIO, _SMALL = 100, 2**24


def fitted_arrays(spline: Curve[Any], reports: list[Report]) -> dict[str, Any]:
    """The arrays of one fitted curve, or of a batch, and how the fit went in every factor."""
    return arrays_of(spline, FORMAT) | {
        "bc_type": json.dumps(plain(spline._bc_type)),
        "report": json.dumps([_plain_report(report) for report in reports]),
    }


def arrays_of(spline: Curve[Any], format: str) -> dict[str, Any]:
    """The arrays of one curve, or of a batch; the format says which kind of curve it is."""
    refuse_functions(
        spline.space,
        "curves are not saved (files hold no functions: pickle them, or keep t, points and velocities)",
        named=True,
    )
    arrays: dict[str, Any] = {
        "format": format,
        "version": VERSION,
        "space": str(spline.space),
        **times_arrays("t", spline._t, spline._clock),
        "extrapolate": json.dumps(spline.extrapolate),
    }
    for i, part in enumerate(spline._curve.parts):
        suffix = f"_{i}" if isinstance(spline.space, Product) else ""
        arrays["points" + suffix] = part.points
        arrays["velocities" + suffix] = part.velocities
    return arrays


def times_arrays(name: str, t: NDArray[Any], clock: TimeAxis) -> dict[str, Any]:
    """Times as numbers, and the unit of dates."""
    unit = _unit(t.dtype, clock.zone) if clock.dates else ""
    return {name: t.astype(np.int64) if unit else t, f"{name}_unit": unit}


def write(file: Any, arrays: dict[str, Any]) -> None:
    """Write arrays to an open file, or replace a file by its name (`disk.replacing`)."""
    path = path_of(file, method="write")
    if path is None:
        np.savez(file, **arrays)
        return
    with replacing(path) as temporary, open(temporary, "wb") as out:
        np.savez(out, **arrays)


# ---- reading ----


class Entries(dict[str, NDArray[Any]]):
    """Arrays of an archive by name; one that is missing is an error of the file."""

    def __missing__(self, name: str) -> NDArray[Any]:
        raise ValidationError(f"entry {name!r} is missing")


def read(file: Any, wanted: Callable[[str], object]) -> Entries:
    """The arrays of an NPZ file whose names are wanted; of the others nothing is read.

    Sizes are taken from the archive's index before any array is read: compression makes a file of any size from a few
    kilobytes.

    Parameters
    ----------
    file : open file
        In binary mode, one that can seek.
    wanted : function
        Says of a name whether its array is wanted.

    Raises
    ------
    ValidationError
        An array is too large for the size of the file, or does not have the size that its header says.
    Exception
        Damage shows as errors of zipfile, of its decompressors and of NumPy.
    """
    length = file.seek(0, os.SEEK_END)
    file.seek(0)
    with zipfile.ZipFile(file) as archive:
        members = {
            member.filename.removesuffix(".npy"): member
            for member in archive.infolist()
            if member.filename.endswith(".npy") and wanted(member.filename.removesuffix(".npy"))
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


def _array_in(archive: zipfile.ZipFile, name: str, member: zipfile.ZipInfo) -> NDArray[Any]:
    with archive.open(member) as entry:
        header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
        shape, _, dtype = header[np.lib.format.read_magic(entry)](entry)
        size = member.file_size - entry.tell()
    # NumPy makes an array of this shape before it reads the numbers.
    if dtype.hasobject:
        raise ValidationError(
            f"entry {name!r} holds Python objects, which are not read; save numbers or texts"
        )
    if math.prod(shape) * dtype.itemsize != size:
        raise ValidationError(
            f"entry {name!r} is damaged: it has {size} bytes, not those of {dtype} in shape {shape}"
        )
    with archive.open(member) as entry:
        array: NDArray[Any] = np.lib.format.read_array(entry, allow_pickle=False)
    return array


def is_curve(name: str) -> bool:
    """Whether a curve has an entry of this name."""
    return _KNOWN.fullmatch(name) is not None


def text_in(arrays: Mapping[str, NDArray[Any]], name: str) -> str:
    """An entry that is one text.

    Raises
    ------
    ValidationError
        It is something else.
    """
    array = arrays[name]
    if array.ndim or array.dtype.kind != "U":
        raise ValidationError(f"entry {name!r} is not a text: it holds {array.dtype} of shape {array.shape}")
    return str(array)


def json_in(arrays: Mapping[str, NDArray[Any]], name: str) -> Any:
    """An entry that is a text in JSON.

    Raises
    ------
    ValidationError
        It is something else.
    """
    try:
        return json.loads(text_in(arrays, name))
    except (ValueError, RecursionError) as error:
        if isinstance(error, ValidationError):
            raise
        raise ValidationError(f"entry {name!r} is not JSON: {brief(error)}") from None


@contextmanager
def entry(name: str) -> Iterator[None]:
    """Says in which entry something is wrong."""
    try:
        yield
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError) as error:
        # Of values of other types than those that are written anything may be found wrong.
        what = error if isinstance(error, ValidationError) else f"{type(error).__name__}: {error}"
        raise ValidationError(f"entry {name!r}: {brief(what, 500)}") from None


def _unit(dtype: np.dtype[Any], zone: str | None) -> str:
    """The unit of dates: "ns", or "10m" if they count in tens of minutes; and what is known of their zone: "ns UTC"."""
    unit, step = np.datetime_data(dtype)
    counted = unit if step == 1 else f"{step}{unit}"
    return counted if zone is None else f"{counted} {zone}"


def _plain_report(report: Report) -> dict[str, Any]:
    """All but the longest gap, which the knots show."""
    return {key: plain(value) for key, value in vars(report).items() if key != "max_gap"}


def plain(value: Any) -> Any:
    """As JSON can hold it: arrays become lists, complex ones two."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "c":
            return {"re": value.real.tolist(), "im": value.imag.tolist()}
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [plain(item) for item in value]
    return value


def rich(value: Any, space: Space) -> Any:
    """End conditions back from JSON; in a product vectors are tuples of arrays."""
    if isinstance(value, str):
        return value

    def vectors(plain: Any) -> Any:
        return tuple(map(_array, plain)) if isinstance(space, Product) else _array(plain)

    return tuple(end if isinstance(end, str) else (end[0], vectors(end[1])) for end in value)


def _array(plain: Any) -> NDArray[Any]:
    if isinstance(plain, dict):
        numbers = np.empty(np.shape(plain["re"]), np.complex128)
        numbers.real, numbers.imag = plain["re"], plain["im"]
        return numbers
    return np.asarray(plain, dtype=np.float64)

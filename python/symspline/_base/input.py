"""Objects of other libraries as arrays. Their attributes identify them, so that no library is imported."""

from __future__ import annotations

import re
from datetime import UTC, date, datetime, timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import ValidationError
from .typing import Array

_SIMPLE = {bool, int, float, complex, str, np.ndarray, np.float64, np.float32, np.int64, np.complex128}
# Attributes that convert an object to an array, in the order in which messages suggest them.
_CONVERSIONS = ("as_matrix", "full", "to_numpy", "datetime64", "numpy", "toarray", "todense", "magnitude", "as_array")
ISO_DATE = re.compile(
    r"(?P<body>\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d{1,9})?)?)?) ?(?P<zone>Z|[+-]\d\d(?::?\d\d)?)?", re.ASCII
)
_ZEROS = str.maketrans("123456789", "0" * 9)
UTC_ZONE, NO_ZONE = "UTC", "none"


def to_numpy(value: object, name: str) -> Any:
    """Convert tensors and quantum objects to arrays, also within lists. Other values do not change.

    Raises
    ------
    ValidationError
        If the conversion would discard a gradient or a unit.
    """
    kind = type(value)
    if kind in _SIMPLE:
        return value
    if isinstance(value, (list, tuple)):
        if set(map(type, value)) <= _SIMPLE:
            return value
        return [to_numpy(part, f"{name}[{i}]") for i, part in enumerate(value)]
    refuse_blocks(value, name)
    if hasattr(value, "requires_grad") and hasattr(value, "detach"):
        return _tensor(value, name)
    if hasattr(value, "isket") and hasattr(value, "full"):
        return _quantum(value, name)
    unit = getattr(value, "unit", None) if hasattr(value, "to_value") else getattr(value, "units", None)
    if unit is not None and (hasattr(value, "to_value") or hasattr(value, "magnitude")):
        conversion = ".to_value(unit)" if hasattr(value, "to_value") else ".to(unit).magnitude"
        raise ValidationError(f"{name} has the unit {unit}, which would be lost; pass {name}{conversion}")
    return value


def _tensor(value: Any, name: str) -> Any:
    if value.requires_grad:
        raise ValidationError(
            f"{name} requires a gradient, which would be lost; use symspline.torch.curve, or pass {name}.detach()"
        )
    for step in ("detach", "cpu", "resolve_conj", "resolve_neg"):
        value = getattr(value, step)() if hasattr(value, step) else value
    try:
        return value.numpy()
    except (TypeError, RuntimeError) as error:
        raise ValidationError(f"{name} cannot be converted to an array: {error}; pass {name}.double()") from None


def _quantum(value: Any, name: str) -> Array:
    """Convert a ket to a vector, and an operator to a matrix."""
    array = np.asarray(value.full())
    if value.isket:
        return array[:, 0]
    if getattr(value, "isbra", False):
        raise ValidationError(f"{name} is a bra; pass the ket {name}.dag()")
    return array


def refuse_blocks(value: object, name: str) -> None:
    """Raise ValidationError for dask arrays that are not computed, which would be loaded as a whole."""
    if hasattr(value, "__dask_graph__") and value.__dask_graph__() is not None:
        raise ValidationError(
            f"{name} is in blocks of dask, which would be loaded as a whole; symspline.xarray works block by block, "
            f"and {name}.compute() is an array"
        )


def library_of(*values: object) -> Any:
    """Return the namespace (array API standard) of the first array that is not from NumPy, or None.

    Arrays may be entries of a tuple.
    """
    for value in values:
        for part in value if isinstance(value, tuple) else (value,):
            if type(part) not in _SIMPLE and hasattr(part, "__array_namespace__"):
                return part.__array_namespace__()
    return None


def in_library(library: Any, values: Any) -> Any:
    """Convert NumPy arrays, or a tuple of them, to arrays of another library; None means NumPy."""
    if library is None:
        return values
    return tuple(map(library.asarray, values)) if isinstance(values, tuple) else library.asarray(values)


def refuse_objects(array: Array, name: str) -> None:
    """Raise ValidationError that names the first entry other than a number, and suggests a conversion."""
    flat = array.ravel()
    i = next((i for i, entry in enumerate(flat) if not isinstance(entry, (int, float, complex))), None)
    if i is None:
        raise ValidationError(f"{name} must be an array of numbers, not of object; pass {name}.astype(float)")
    entry = flat[i]
    where = name + _index(i, array)
    kind = f"{type(entry).__module__}.{type(entry).__qualname__}".removeprefix("builtins.")
    how = next((c for c in _CONVERSIONS if hasattr(entry, c)), None)
    call = "" if how in ("magnitude", "datetime64") else "()"
    advice = f"pass its .{how}{call}" if how else "leave it out, or convert it to numbers"
    raise ValidationError(f"{where} must be an array of numbers, not of object: it is a {kind}; {advice}")


# ---- times ----


def times_of(value: object, name: str) -> tuple[Any, str | None]:
    """Convert times to a type of NumPy.

    Returns
    -------
    times : array_like
        Times; those with a time zone are converted to UTC.
    zone : {"UTC", "none"} or None
        Whether the times had a time zone. None if it is unknown, as for NumPy arrays.

    Raises
    ------
    ValidationError
        If only some times have a time zone, or a text is not a date.
    """
    refuse_blocks(value, name)
    kind = getattr(value, "dtype", None)
    if type(value) is np.ndarray or isinstance(value, np.generic):
        if value.dtype.kind not in "OU":
            return value, None
    elif kind is not None and hasattr(kind, "tz"):
        # The type is DatetimeTZDtype of pandas.
        return np.asarray(value, dtype=f"datetime64[{getattr(kind, 'unit', 'ns')}]"), UTC_ZONE
    elif getattr(kind, "kind", "") == "M":
        return np.asarray(value), NO_ZONE
    if isinstance(value, (int, float)):
        return value, None
    array = value if isinstance(value, np.ndarray) else None
    if isinstance(value, (str, date, timedelta)):
        array = np.empty((), object)
        array[()] = value
    elif isinstance(value, (list, tuple)) or (kind is not None and getattr(kind, "kind", "") in "OU"):
        if isinstance(value, list) and set(map(type, value)) <= {int, float}:
            return value, None
        try:
            array = np.array(value, dtype=object)
        except ValueError:
            return value, None
    if array is None or not array.size or not isinstance(array.flat[0], (str, date, timedelta)):
        return value, None
    return _moments(array, name)


def _moments(array: Array, name: str) -> tuple[Any, str | None]:
    """Convert dates, texts and durations of Python to NumPy, and return whether they had a time zone."""
    cells = array.ravel().tolist()
    first = cells[0]
    required = str if isinstance(first, str) else timedelta if isinstance(first, timedelta) else date
    for i, cell in enumerate(cells):
        if not isinstance(cell, required) or cell != cell:
            raise ValidationError(
                f"{name}{_index(i, array)} is {_short(cell)}, but {_short(first)} before; write all times alike"
            )
    if required is timedelta:
        durations = [getattr(cell, "asm8", cell) for cell in cells]
        return np.array(durations, "timedelta64").reshape(array.shape), None
    at_once = _moments_of_texts(cells) if required is str else None
    if at_once is not None:
        return at_once[0].reshape(array.shape), UTC_ZONE if at_once[1] else NO_ZONE
    pairs = [_moment(cell, name, i, array) for i, cell in enumerate(cells)]
    zones = [zone for _, zone in pairs]
    if len(set(zones)) > 1:
        i = zones.index(next(zone for zone in zones if zone != zones[0]))
        has = ["no time zone", "a time zone"][zones[0]]
        raise ValidationError(f"{name}{_index(i, array)} is {_short(cells[i])}, but {_short(first)} before has {has}")
    return np.array([moment for moment, _ in pairs]).reshape(array.shape), UTC_ZONE if zones[0] else NO_ZONE


def shapes_of(cells: list[str]) -> list[str]:
    """Return texts with zeros in place of 1 to 9, so that dates of one form become equal."""
    # One translation is several times faster than one per text.
    shapes = "\n".join(cells).translate(_ZEROS).split("\n")
    return shapes if len(shapes) == len(cells) else [cell.translate(_ZEROS) for cell in cells]


def _moments_of_texts(cells: list[str]) -> tuple[Array, bool] | None:
    """Convert texts, all of one form in one step, and return whether they have a time zone.

    The result is None if a text is not a date, or only some have a time zone.
    """
    shapes = shapes_of(cells)
    numbers = {shape: number for number, shape in enumerate(dict.fromkeys(shapes))}
    matches = [ISO_DATE.fullmatch(shape) for shape in numbers]
    zoned = {match is not None and match["zone"] is not None for match in matches}
    if None in matches or len(zoned) > 1:
        return None
    of_cell = np.array([numbers[shape] for shape in shapes])
    texts = np.array(cells)
    groups = []
    for number, match in enumerate(matches):
        assert match is not None
        codes = texts[of_cell == number].view(np.uint32).reshape(-1, texts.itemsize // 4)
        try:
            moments = _column(codes, match.span("body")).astype("datetime64")
        except ValueError:
            return None
        if match["zone"] is not None:
            names, of_row = np.unique(_column(codes, match.span("zone")), return_inverse=True)
            moments = moments - np.array([minutes_of(zone) for zone in names.tolist()], "timedelta64[m]")[of_row]
        groups.append(moments)
    result = np.empty(len(cells), np.result_type(*groups))
    for number, moments in enumerate(groups):
        result[of_cell == number] = moments
    return result, zoned == {True}


def _column(codes: NDArray[np.uint32], span: tuple[int, int]) -> NDArray[np.str_]:
    """Return the same characters of all texts."""
    part = np.ascontiguousarray(codes[:, slice(*span)])
    return part.view(f"U{part.shape[1]}")[:, 0]


def _short(cell: object) -> str:
    """Return the text of a value, shortened for messages."""
    text = repr(cell) if isinstance(cell, str) else str(cell)
    return text if len(text) <= 80 else f"{text[:80]}…"


def _moment(cell: object, name: str, i: int, array: Array) -> tuple[Any, bool]:
    if isinstance(cell, str):
        match = ISO_DATE.fullmatch(cell.strip())
        try:
            if match is None:
                raise ValueError
            moment = np.datetime64(match["body"])
        except ValueError:
            raise ValidationError(
                f"{name}{_index(i, array)} is {_short(cell)}, not a date such as 2021-08-29 or 2021-08-29T16:55:00Z"
            ) from None
        zone = match["zone"]
        return (moment if zone is None else moment - np.timedelta64(minutes_of(zone), "m")), zone is not None
    if not isinstance(cell, datetime):
        return np.datetime64(cell), False
    aware = cell.utcoffset() is not None
    if hasattr(cell, "asm8"):
        # Timestamps of pandas have nanoseconds, which datetime lacks. This value is in UTC.
        return cell.asm8, aware
    return np.datetime64(cell.astimezone(UTC).replace(tzinfo=None) if aware else cell), aware


def minutes_of(zone: str) -> int:
    """Return the offset of a time zone in minutes, such as 150 for ``"+02:30"``."""
    if zone == "Z":
        return 0
    digits = zone[1:].replace(":", "").ljust(4, "0")
    minutes = 60 * int(digits[:2]) + int(digits[2:])
    return -minutes if zone[0] == "-" else minutes


def _index(i: int, array: Array) -> str:
    return str([int(k) for k in np.unravel_index(i, array.shape)]) if array.ndim else ""

"""Objects of other libraries as arrays. They are known by what they can do; no library is imported to find out."""

from __future__ import annotations

import re
from datetime import UTC, date, datetime, timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import ValidationError

_SIMPLE = {bool, int, float, complex, str, np.ndarray, np.float64, np.float32, np.int64, np.complex128}
# What turns an object into an array, by the object that has it.
_CONVERSIONS = (
    "as_matrix",
    "full",
    "to_numpy",
    "datetime64",
    "numpy",
    "toarray",
    "todense",
    "magnitude",
    "as_array",
)
ISO_DATE = re.compile(
    r"(?P<body>\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d{1,9})?)?)?) ?(?P<zone>Z|[+-]\d\d(?::?\d\d)?)?",
    re.ASCII,
)
UTC_ZONE, NO_ZONE = "UTC", "none"


def to_numpy(value: Any, name: str) -> Any:
    """A value in which tensors, quantum objects and columns of tables are arrays, also within lists.

    Raises:
        ValidationError: a part would lose its gradient or its unit.
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
            f"{name} requires a gradient, which would be lost; symspline.torch.curve keeps it, and "
            f"{name}.detach() does without"
        )
    for step in ("detach", "cpu", "resolve_conj", "resolve_neg"):
        value = getattr(value, step)() if hasattr(value, step) else value
    try:
        return value.numpy()
    except (TypeError, RuntimeError) as error:
        raise ValidationError(f"{name} cannot become an array: {error}; pass {name}.double()") from None


def _quantum(value: Any, name: str) -> Any:
    """A ket as a vector, an operator as a matrix."""
    array = np.asarray(value.full())
    if value.isket:
        return array[:, 0]
    if getattr(value, "isbra", False):
        raise ValidationError(f"{name} is a bra; pass the ket {name}.dag()")
    return array


def refuse_blocks(value: Any, name: str) -> None:
    """Raise ValidationError for what dask has not computed yet, which would be loaded as a whole."""
    if hasattr(value, "__dask_graph__") and value.__dask_graph__() is not None:
        raise ValidationError(
            f"{name} is in blocks of dask, which would be loaded as a whole; symspline.xarray works block by block, "
            f"and {name}.compute() is an array"
        )


def library_of(*values: Any) -> Any:
    """The namespace (array API standard) of the first array that is not NumPy's, None if there is none. A tuple stands
    for its parts."""
    for value in values:
        for part in value if isinstance(value, tuple) else (value,):
            if type(part) not in _SIMPLE and hasattr(part, "__array_namespace__"):
                return part.__array_namespace__()
    return None


def in_library(library: Any, values: Any) -> Any:
    """Arrays of NumPy, or a tuple of them, as those of another library."""
    if library is None:
        return values
    return tuple(map(library.asarray, values)) if isinstance(values, tuple) else library.asarray(values)


def refuse_objects(array: NDArray[Any], name: str) -> None:
    """Raise ValidationError, naming the first entry that is no number, and what makes an array of it."""
    flat = array.ravel()
    i = next((i for i, entry in enumerate(flat) if not isinstance(entry, (int, float, complex))), None)
    if i is None:
        raise ValidationError(f"{name} must be an array of numbers, not of object; pass {name}.astype(float)")
    found = flat[i]
    where = name + _index(i, array)
    kind = f"{type(found).__module__}.{type(found).__qualname__}".removeprefix("builtins.")
    how = next((c for c in _CONVERSIONS if hasattr(found, c)), None)
    call = "" if how in ("magnitude", "datetime64") else "()"
    advice = f"pass its .{how}{call}" if how else "leave it out, or convert it to numbers"
    raise ValidationError(f"{where} must be an array of numbers, not of object: it is a {kind}; {advice}")


# ---- times ----


def times_of(value: Any, name: str) -> tuple[Any, str | None]:
    """Times as NumPy's, and whether they had a time zone: ``"UTC"``, to which they were moved, ``"none"``, or None of
    arrays of NumPy, where it is not known.

    Raises:
        ValidationError: some have a time zone and others not, or a text is no date.
    """
    refuse_blocks(value, name)
    kind = getattr(value, "dtype", None)
    if type(value) is np.ndarray or isinstance(value, np.generic):
        if value.dtype.kind not in "OU":
            return value, None
    elif kind is not None and hasattr(kind, "tz"):
        # The type of a column of a table: pandas' DatetimeTZDtype.
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


def _moments(array: NDArray[Any], name: str) -> tuple[Any, str | None]:
    """Dates, texts and durations as Python knows them."""
    cells = array.ravel().tolist()
    first = cells[0]
    wanted = str if isinstance(first, str) else timedelta if isinstance(first, timedelta) else date
    for i, cell in enumerate(cells):
        if not isinstance(cell, wanted) or cell != cell:
            raise ValidationError(
                f"{name}{_index(i, array)} is {_short(cell)}, but {_short(first)} before; write all times alike"
            )
    if wanted is timedelta:
        durations = [getattr(cell, "asm8", cell) for cell in cells]
        return np.array(durations, "timedelta64").reshape(array.shape), None
    pairs = [_moment(cell, name, i, array) for i, cell in enumerate(cells)]
    zones = [zone for _, zone in pairs]
    if len(set(zones)) > 1:
        i = zones.index(next(zone for zone in zones if zone != zones[0]))
        has = ["no time zone", "a time zone"][zones[0]]
        raise ValidationError(
            f"{name}{_index(i, array)} is {_short(cells[i])}, but {_short(first)} before has {has}"
        )
    return np.array([moment for moment, _ in pairs]).reshape(array.shape), UTC_ZONE if zones[0] else NO_ZONE


def _short(cell: Any) -> str:
    """A value in a message."""
    text = repr(cell) if isinstance(cell, str) else str(cell)
    return text if len(text) <= 80 else f"{text[:80]}…"


def _moment(cell: Any, name: str, i: int, array: NDArray[Any]) -> tuple[Any, bool]:
    if isinstance(cell, str):
        match = ISO_DATE.fullmatch(cell.strip())
        try:
            if match is None:
                raise ValueError
            moment = np.datetime64(match["body"])
        except ValueError:
            raise ValidationError(
                f"{name}{_index(i, array)} is {_short(cell)}, no date such as 2021-08-29 or 2021-08-29T16:55:00Z"
            ) from None
        zone = match["zone"]
        return (moment if zone is None else moment - np.timedelta64(minutes_of(zone), "m")), zone is not None
    if not isinstance(cell, datetime):
        return np.datetime64(cell), False
    aware = cell.utcoffset() is not None
    if hasattr(cell, "asm8"):
        # pandas counts finer than Python, and this is UTC.
        return cell.asm8, aware
    return np.datetime64(cell.astimezone(UTC).replace(tzinfo=None) if aware else cell), aware


def minutes_of(zone: str) -> int:
    """``"+02:30"`` is 150."""
    if zone == "Z":
        return 0
    digits = zone[1:].replace(":", "").ljust(4, "0")
    minutes = 60 * int(digits[:2]) + int(digits[2:])
    return -minutes if zone[0] == "-" else minutes


def _index(i: int, array: NDArray[Any]) -> str:
    return str([int(k) for k in np.unravel_index(i, array.shape)]) if array.ndim else ""

"""Tables in the files of other programs: NPZ, Parquet and TUM."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np

from .._base.disk import damage
from .._splines.archive import read
from ..convert._pose_files import TUM, tum_rows, write_tum_rows
from ._messages import Problem, refuse
from ._streams import Source
from ._tables import IM, RE, Array, Layout, Table, Texts

_ZONE = "time_zone"
"""The entry of an NPZ file with the time zone of its dates."""

# ---- NPZ ----


def read_npz(path: Source) -> Table:
    """Read an NPZ file, whose arrays have one entry per row.

    The entries of an array ``a`` with more axes are the columns ``a_0``, ``a_1``, … row by row; complex numbers are
    two columns ``a_0_re`` and ``a_0_im``.
    """
    columns: dict[str, Any] = {}
    groups: dict[str, list[str]] = {}
    with path.open() as file:
        refuse(path, (not zipfile.is_zipfile(file), " is not an NPZ file"))
        file.seek(0)
        with damage(path, "is damaged, or holds other objects than numbers"):
            arrays = read(file, lambda name: True)
    refuse(path, ("format" in arrays, " is a curve that was fitted already, not a table"))
    for key, array in arrays.items():
        if not array.ndim or array.dtype.kind not in "biufcMmU":
            continue
        entries = array.reshape(len(array), math.prod(array.shape[1:])).T
        own = {key if array.ndim == 1 else f"{key}_{i}": entry for i, entry in enumerate(entries)}
        if array.dtype.kind == "c":
            own = {name + end: part for name, z in own.items() for end, part in ((RE, z.real), (IM, z.imag))}
        groups[key] = [*own]
        columns |= {name: Texts(own.tolist()) if own.dtype.kind == "U" else own for name, own in own.items()}
    utc = _ZONE in arrays and arrays[_ZONE].shape == () and str(arrays[_ZONE]) == "UTC"
    return Table(path, columns, groups=groups, is_utc=dict.fromkeys(columns, True) if utc else None)


def write_npz(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write an NPZ file with one array per column and, for dates in UTC, the text ``time_zone``."""
    zone = {_ZONE: np.array("UTC")} if layout.utc and _ZONE not in columns else {}
    np.savez(file, **columns, **zone)  # type: ignore[arg-type]


# ---- Parquet ----


def read_parquet(path: Source) -> Table:
    """Read a Parquet file. Empty cells are NaN, NaT or empty texts."""
    pa, parquet = _pyarrow()
    with path.open() as file:
        try:
            table = parquet.read_table(file)
        except pa.ArrowInvalid:
            raise Problem(f"{path} is damaged or not a Parquet file") from None
    columns = {name: _column(pa, table[name]) for name in table.column_names}
    return Table(path, columns, is_utc={own.name: getattr(own.type, "tz", None) is not None for own in table.schema})


def _column(pa: Any, cells: Any) -> Any:
    kind = getattr(cells.type, "value_type", cells.type) if pa.types.is_dictionary(cells.type) else cells.type
    if any(test(kind) for test in (pa.types.is_string, pa.types.is_large_string, pa.types.is_string_view)):
        return Texts(["" if cell is None else cell for cell in cells.to_pylist()])
    if pa.types.is_time(kind):
        return Texts(list(map(str, cells.to_pylist())))
    if pa.types.is_decimal(kind) or (cells.null_count and (pa.types.is_integer(kind) or pa.types.is_floating(kind))):
        cells = cells.cast(pa.float64())
    return np.asarray(cells.to_numpy())


def write_parquet(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write a Parquet file; dates in UTC have this time zone."""
    pa, parquet = _pyarrow()

    def column(values: Array) -> Any:
        if values.dtype.kind != "M":
            return pa.array(values)
        unit = np.datetime_data(values.dtype)[0]
        unit = unit if unit in ("ms", "us", "ns") else "s"
        return pa.array(values.astype(f"datetime64[{unit}]"), pa.timestamp(unit, "UTC" if layout.utc else None))

    parquet.write_table(pa.table({name: column(values) for name, values in columns.items()}), file)


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise Problem("Parquet files need pyarrow; install it with: pip install 'symspline[parquet]'") from None
    return pyarrow, pyarrow.parquet


# ---- TUM ----


class _Named(io.StringIO):
    """Text with the name that messages give it."""

    name = ""


def read_tum(path: Source) -> Table:
    """Read a trajectory of the TUM RGB-D benchmark: lines of time, position and quaternion, its scalar last."""
    with path.open() as file:
        try:
            text = _Named(file.read().decode("utf-8-sig"))
        except UnicodeDecodeError:
            raise Problem(f"{path} is not text in UTF-8") from None
    text.name = str(path)
    rows, lines = tum_rows(text, missing=True)
    return Table(path, dict(zip(TUM, rows.T, strict=True)), lines.place)


def write_tum(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write a TUM trajectory. The columns are the time, the position and the quaternion."""
    time, *pose = columns.values()
    if time.dtype.kind == "M" and (time < np.datetime64(0, "s")).any():
        raise Problem("times of a TUM trajectory are counted from 1970 on; these dates are earlier")
    text = io.TextIOWrapper(file, "utf-8", newline="\n")
    write_tum_rows(text, time, np.stack(pose, axis=1), f"# timestamp {' '.join(TUM[1:])}")
    text.detach()

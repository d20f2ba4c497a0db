"""Tables in the files of other programs: NPZ, Parquet and TUM."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Mapping, Sequence
from typing import Any, BinaryIO

import numpy as np

from .._archive import read
from .._disk import damage
from .._pose_files import TUM, tum_rows, write_tum_rows
from ._messages import Problem, Progress, refuse
from ._streams import Source
from ._tables import FIRST, IM, RE, Array, Layout, Table
from ._times import is_date_like

# ---- reading ----


class NpzTable(Table):
    """An NPZ file, whose arrays have one entry per row.

    The entries of an array ``a`` with more axes are the columns ``a_0``, ``a_1``, … row by row; complex numbers are
    two columns ``a_0_re`` and ``a_0_im``.
    """

    def __init__(self, path: Source) -> None:
        super().__init__(path)
        with path.open() as file:
            refuse(path, (not zipfile.is_zipfile(file), " is not an NPZ file"))
            file.seek(0)
            with damage(path, "is damaged, or holds other objects than numbers"):
                arrays = read(file, lambda name: True)
        refuse(path, ("format" in arrays, " is a curve that was fitted already, not a table"))
        for key, array in arrays.items():
            if not array.ndim or array.dtype.kind not in "biufcMmSU":
                continue
            entries = array.reshape(len(array), math.prod(array.shape[1:])).T
            own = {key if array.ndim == 1 else f"{key}_{i}": entry for i, entry in enumerate(entries)}
            if array.dtype.kind == "c":
                own = {name + end: part for name, z in own.items() for end, part in ((RE, z.real), (IM, z.imag))}
            self.groups[key] = [*own]
            self.columns |= own
        kinds = {name: column.dtype.kind for name, column in self.columns.items()}
        first = {name: "".join(self.columns[name][:1]) for name, kind in kinds.items() if kind == "U"}
        self.names = list(kinds)
        self.numeric = [name for name, kind in kinds.items() if kind in "biuf"]
        self.dates = [name for name in kinds if kinds[name] in "Mm" or is_date_like(first.get(name, ""))]


class ParquetTable(Table):
    def __init__(self, path: Source) -> None:
        super().__init__(path)
        pa, parquet = _pyarrow()
        with path.open() as file:
            try:
                self._table = parquet.read_table(file)
            except pa.ArrowInvalid:
                raise Problem(f"{path} is damaged or not a Parquet file") from None
        types = {column.name: column.type for column in self._table.schema}
        is_kind = (pa.types.is_integer, pa.types.is_floating, pa.types.is_decimal)
        self.names = self._table.column_names
        self.numeric = [name for name, own in types.items() if any(test(own) for test in is_kind)]
        self.dates = [name for name in types if pa.types.is_temporal(types[name]) or is_date_like(self._text(name))]
        self.is_utc = {name: getattr(own, "tz", None) is not None for name, own in types.items()}

    def _text(self, name: str) -> str:
        """Return the first of the texts at the start of a column, empty if it holds none."""
        cells = self._table.column(name)
        is_text = str(cells.type) in ("string", "large_string", "string_view")
        return next((cell.as_py() for cell in cells[:FIRST] if is_text and cell.is_valid), "")

    def load(self, numbers: Sequence[str], texts: Sequence[str], progress: Progress) -> None:
        pa, _ = _pyarrow()
        for name in (*numbers, *texts):
            cells = self._table.column(name)
            if cells.null_count and name not in self._sparse:
                raise self._problem(name, int(cells.is_null().to_numpy().argmax()), "is empty")
            if pa.types.is_decimal(cells.type) or cells.null_count:
                cells = cells.cast(pa.float64())
            self.columns[name] = np.asarray(cells.to_numpy())


class _Text(io.StringIO):
    """Text with the name that messages give it."""

    name = ""


class TumTable(Table):
    """A trajectory of the TUM RGB-D benchmark: lines of time, position and quaternion, its scalar last."""

    def __init__(self, path: Source) -> None:
        super().__init__(path)
        with path.open() as file:
            try:
                text = _Text(file.read().decode("utf-8-sig"))
            except UnicodeDecodeError:
                raise Problem(f"{path} is not text in UTF-8") from None
        text.name = str(path)
        rows, self._lines = tum_rows(text)
        self.names, self.numeric, self.dates = [*TUM], [*TUM], []
        self.columns = dict(zip(TUM, rows.T, strict=True))

    def place(self, row: int) -> str:
        return self._lines.place(row)


# ---- writing ----


def write_npz(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write an NPZ file with one array per column."""
    np.savez(file, **columns)  # type: ignore[arg-type]


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


def write_tum(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write a TUM trajectory. The columns are the time, the position and the quaternion."""
    time, *pose = columns.values()
    if time.dtype.kind == "M" and (time < np.datetime64(0, "s")).any():
        raise Problem("times of a TUM trajectory are counted from 1970 on; these dates are earlier")
    text = io.TextIOWrapper(file, "utf-8", newline="\n")
    write_tum_rows(text, time, np.stack(pose, axis=1), f"# timestamp {' '.join(TUM[1:])}")
    text.detach()


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise Problem("Parquet files need pyarrow; install it with: pip install 'symspline[parquet]'") from None
    return pyarrow, pyarrow.parquet

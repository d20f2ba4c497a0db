"""Parquet, read and written by pyarrow."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from .errors import Problem, reading
from .tables import Array, ArrayTable
from .times import is_date_like


class ParquetTable(ArrayTable):
    """The columns of a Parquet file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        pa, parquet = _pyarrow()
        with reading(path), open(path, "rb") as file:
            try:
                self._table = parquet.read_table(file)
            except pa.ArrowInvalid:
                raise Problem(f"{path} is damaged or not a Parquet file") from None
        self.names = self._table.column_names
        tests = (pa.types.is_integer, pa.types.is_floating, pa.types.is_decimal)
        self.numeric = [f.name for f in self._table.schema if any(test(f.type) for test in tests)]
        self.dates = [
            f.name for f in self._table.schema if pa.types.is_temporal(f.type) or self._is_text_date(f)
        ]

    def _column(self, name: str) -> Array:
        pa, _ = _pyarrow()
        column = self._table.column(name)
        if column.null_count:
            empty = int(column.is_null().to_numpy().argmax())
            raise Problem(f"{self.path}, row {empty} (counted from 0): column {name!r} is empty")
        if pa.types.is_decimal(column.type):
            column = column.cast(pa.float64())
        values: Array = column.to_numpy()
        return values

    def _is_text_date(self, field: Any) -> bool:
        """Whether the first text of a column is a date."""
        if str(field.type) not in ("string", "large_string", "string_view"):
            return False
        first = next((cell.as_py() for cell in self._table.column(field.name)[:50] if cell.is_valid), "")
        return is_date_like(first)

    def _is_utc(self, name: str) -> bool:
        return getattr(self._table.schema.field(name).type, "tz", None) is not None


def write_parquet(file: BinaryIO, columns: Mapping[str, Array], utc: bool) -> None:
    """Write columns; dates become timestamps."""
    pa, parquet = _pyarrow()
    parquet.write_table(pa.table({name: _array(pa, values, utc) for name, values in columns.items()}), file)


def _array(pa: Any, values: Array, utc: bool) -> Any:
    if values.dtype.kind != "M":
        return pa.array(values)
    unit = np.datetime_data(values.dtype)[0]
    unit = unit if unit in ("ms", "us", "ns") else "s"
    return pa.array(values.astype(f"datetime64[{unit}]"), pa.timestamp(unit, "UTC" if utc else None))


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise Problem(
            "Parquet files need pyarrow; install it with: pip install 'symspline[parquet]'"
        ) from None
    return pyarrow, pyarrow.parquet

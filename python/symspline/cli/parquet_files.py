"""Parquet, read and written by pyarrow."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from .errors import Problem, reading
from .tables import Array, ArrayTable


class ParquetTable(ArrayTable):
    """The columns of a Parquet file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        pa, parquet = _pyarrow()
        with reading(path):
            try:
                self._table = parquet.read_table(path)
            except pa.ArrowInvalid as error:
                raise Problem(f"{path} is damaged or not a Parquet file: {error}") from None
        self.names = self._table.column_names
        types = pa.types
        self.numeric = [
            field.name
            for field in self._table.schema
            if types.is_integer(field.type) or types.is_floating(field.type) or types.is_decimal(field.type)
        ]

    def _column(self, name: str) -> Array:
        pa, _ = _pyarrow()
        column = self._table.column(name)
        if pa.types.is_decimal(column.type):
            column = column.cast(pa.float64())
        values: Array = column.to_numpy()
        return values

    def _is_utc(self, name: str) -> bool:
        return self._table.schema.field(name).type.tz is not None


def write_parquet(file: BinaryIO, columns: Mapping[str, Array], utc: bool) -> None:
    """Write columns; dates become timestamps."""
    pa, parquet = _pyarrow()
    arrays = {name: _array(pa, values, utc) for name, values in columns.items()}
    parquet.write_table(pa.table(arrays), file)


def _array(pa: Any, values: Array, utc: bool) -> Any:
    if values.dtype.kind != "M":
        return pa.array(values)
    unit = np.datetime_data(values.dtype)[0]
    if unit not in ("s", "ms", "us", "ns"):
        unit = "s" if unit in ("D", "h", "m") else "ns"
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

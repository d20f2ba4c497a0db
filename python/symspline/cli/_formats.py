"""The formats of tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import BinaryIO

from ._binary import NpzTable, ParquetTable, TumTable, write_npz, write_parquet, write_tum
from ._csv import CsvTable, write_csv
from ._records import (
    RecordsTable,
    geojson_columns,
    gpx_columns,
    json_columns,
    write_geojson,
    write_gpx,
    write_json,
)
from ._streams import Source, format_of, written
from ._tables import Array, Layout, Table

_Write = Callable[[BinaryIO, Mapping[str, Array], Layout], None]
_FORMATS: dict[str, tuple[Callable[[Source], Table], _Write]] = {
    "csv": (CsvTable, write_csv),
    "npz": (NpzTable, write_npz),
    "parquet": (ParquetTable, write_parquet),
    "json": (partial(RecordsTable, read=json_columns), write_json),
    "geojson": (partial(RecordsTable, read=geojson_columns), write_geojson),
    "gpx": (partial(RecordsTable, read=gpx_columns), write_gpx),
    "tum": (TumTable, write_tum),
}


def open_table(path: Path, given: str | None = None) -> Table:
    """Open the table in a file whose format is the given one or that of its ending."""
    source = Source(path, format_of(path, given))
    return _FORMATS[source.format][0](source)


def write_table(path: Path, form: str, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write columns of equal length to a file."""
    with written(path) as file:
        _FORMATS[form][1](file, columns, layout)

"""Tables in files of any format, by the endings of their names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from .csv_files import CsvTable, write_csv
from .errors import writing
from .npz_files import NpzTable
from .parquet_files import ParquetTable, write_parquet
from .tables import ENDINGS, Array, Table, ending
from .tum_files import ENDINGS as TUM
from .tum_files import TumTable, write_tum


def open_table(path: Path) -> Table:
    """The table in a file."""
    suffix = ending(path, ENDINGS, "a table")
    if suffix == ".csv":
        return CsvTable(path)
    if suffix in TUM:
        return TumTable(path)
    return NpzTable(path) if suffix == ".npz" else ParquetTable(path)


def write_table(path: Path, columns: Mapping[str, Array], utc: bool) -> None:
    """Write columns of equal length to a file, by its ending."""
    suffix = ending(path, ENDINGS, "a table")
    with writing(path) as temporary, open(temporary, "wb") as file:
        if suffix == ".csv":
            write_csv(file, columns, utc)
        elif suffix in TUM:
            write_tum(file, columns)
        elif suffix == ".npz":
            np.savez(file, **columns)  # type: ignore[arg-type]
        else:
            write_parquet(file, columns, utc)

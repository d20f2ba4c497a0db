"""Tables in files: rows of numbers, times and labels under named columns."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .dates import parse_times
from .errors import Problem, did_you_mean, writing
from .progress import Progress

Array = NDArray[Any]
Doubles = NDArray[np.float64]
Place = Callable[[int], str]

ENDINGS = (".csv", ".npz", ".parquet")


@dataclass(frozen=True)
class Rows:
    """What was read of a table.

    Attributes:
        numbers: shape (rows, columns).
        times: numbers or ``datetime64``, None if no time column was asked for.
        utc: whether the times had a Z or an offset, and were converted.
        labels: names of the curves, None if no such column was asked for.
        place: where a row is, such as "line 7".
    """

    numbers: Doubles
    times: Array | None
    utc: bool
    labels: NDArray[np.str_] | None
    place: Place


class Table(ABC):
    """A file with named columns.

    Attributes:
        path: the file.
        names: of all columns, in the order of the file.
        numeric: names of the columns that hold numbers.
    """

    path: Path
    names: list[str]
    numeric: list[str]

    def expand(self, name: str) -> list[str]:
        """The columns that a name stands for: itself, or the two parts of complex numbers."""
        parts = [name + "_re", name + "_im"]
        if name not in self.names and set(parts) <= set(self.names):
            return parts
        self.require(name)
        return [name]

    def require(self, name: str) -> str:
        """The name, if there is such a column."""
        if name not in self.names:
            raise Problem(f"{self.path} has no column {name!r}; {did_you_mean(name, self.names)}")
        return name

    def find(self, *names: str) -> str | None:
        """The first column with one of these names, whatever the case."""
        return next((own for name in names for own in self.names if own.lower() == name), None)

    def points(self, others: Sequence[str | None]) -> list[str]:
        """The columns of the points if nobody says which: all numbers that are nothing else."""
        return [name for name in self.numeric if name not in others]

    @abstractmethod
    def read(self, numbers: Sequence[str], time: str | None, label: str | None, progress: Progress) -> Rows:
        """The rows, with some columns as numbers, one as times and one as labels."""


class ArrayTable(Table):
    """A table whose columns are arrays."""

    @abstractmethod
    def _column(self, name: str) -> Array:
        """One column, as whatever it holds."""

    def _is_utc(self, name: str) -> bool:
        return False

    def read(self, numbers: Sequence[str], time: str | None, label: str | None, progress: Progress) -> Rows:
        def place(row: int) -> str:
            return f"row {row} (counted from 0)"

        columns = []
        for done, name in enumerate(numbers):
            progress(done, len(numbers))
            columns.append(self._numbers(name, place))
        times, utc = self._times(time, place) if time is not None else (None, False)
        labels = self._column(label).astype(np.str_) if label is not None else None
        lengths = {len(c) for c in (*columns, times, labels) if c is not None}
        if len(lengths) > 1:
            raise Problem(f"{self.path}: the columns differ in length: {listed_lengths(lengths)}")
        table = np.stack(columns, axis=1) if columns else np.empty((max(lengths, default=0), 0))
        return Rows(table, times, utc, labels, place)

    def _numbers(self, name: str, place: Place) -> Doubles:
        array = self._column(name)
        if array.dtype.kind not in "biuf":
            raise Problem(f"{self.path}: column {name!r} holds {array.dtype}, not numbers")
        values = array.astype(np.float64)
        check_finite(values, self.path, name, place)
        return values

    def _times(self, name: str, place: Place) -> tuple[Array, bool]:
        array = self._column(name)
        if array.dtype.kind in "OUT":
            return parse_times(array.astype(np.str_).tolist(), self.path, name, place)
        if array.dtype.kind == "M":
            missing = np.flatnonzero(np.isnat(array))
            if missing.size:
                raise Problem(f"{self.path}, {place(missing[0])}: column {name!r} holds no time")
            return array, self._is_utc(name)
        return (array, False) if array.dtype.kind in "iu" else (self._numbers(name, place), False)


def listed_lengths(lengths: set[int]) -> str:
    """Lengths in words."""
    return " and ".join(map(str, sorted(lengths)))


def check_finite(values: Doubles, path: Path, name: str, place: Place) -> None:
    """Raise `Problem` at the first value that is NaN or infinite."""
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        found = "no number" if np.isnan(values[bad[0]]) else "an infinite number"
        raise Problem(f"{path}, {place(bad[0])}: column {name!r} holds {found}")


def ending(path: Path, allowed: Sequence[str], what: str) -> str:
    """The ending of a file name, which says what is in the file."""
    suffix = path.suffix.lower()
    if suffix not in allowed:
        raise Problem(f"{path}: {what} must end in {' or '.join(allowed)}")
    return suffix


def open_table(path: Path) -> Table:
    """The table in a CSV, NPZ or Parquet file."""
    suffix = ending(path, ENDINGS, "the name of a table")
    if suffix == ".csv":
        from .csv_files import CsvTable

        return CsvTable(path)
    if suffix == ".npz":
        from .npz_files import NpzTable

        return NpzTable(path)
    from .parquet_files import ParquetTable

    return ParquetTable(path)


def write_table(path: Path, columns: Mapping[str, Array], utc: bool) -> None:
    """Write columns of equal length to a CSV, NPZ or Parquet file, by its ending."""
    suffix = ending(path, ENDINGS, "the name of a table")
    with writing(path) as temporary, open(temporary, "wb") as file:
        if suffix == ".csv":
            from .csv_files import write_csv

            write_csv(file, columns, utc)
        elif suffix == ".npz":
            np.savez(file, **dict(columns))
        else:
            from .parquet_files import write_parquet

            write_parquet(file, columns, utc)

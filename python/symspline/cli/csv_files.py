"""CSV: text in UTF-8, cells separated by commas, the first line naming the columns."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from os import fstat
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .dates import parse_times
from .errors import Problem, reading
from .progress import Progress
from .tables import Array, Doubles, Rows, Table, check_finite

# Few enough rows to stay in the processor's cache.
_CHUNK = 2000


class CsvTable(Table):
    """A CSV file. Blank lines are skipped; a column is numeric if its first cell is a number."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with self._open() as (rows, _):
            first = list(islice(filter(None, rows), 2))
        if not first:
            raise Problem(f"{path} is empty")
        self.names = [name.strip() for name in first[0]]
        if all(map(is_number, self.names)):
            raise Problem(f"{path}: the first line must name the columns, but holds numbers")
        for name in self.names:
            if self.names.count(name) > 1:
                raise Problem(f"{path}: the first line names the column {name!r} twice")
        if len(first) < 2:
            raise Problem(f"{path} has no rows below the names of the columns")
        self.numeric = [name for name, cell in zip(self.names, first[1], strict=False) if is_number(cell)]

    def read(self, numbers: Sequence[str], time: str | None, label: str | None, progress: Progress) -> Rows:
        where = {name: i for i, name in enumerate(self.names)}
        parts: list[list[Doubles]] = [[] for _ in numbers]
        times: list[str] = []
        labels: list[str] = []
        lines: list[NDArray[np.int64]] = []
        for columns, at in self._chunks(progress):
            for part, name in zip(parts, numbers, strict=True):
                part.append(self._numbers(columns[where[name]], name, at))
            if time is not None:
                times += columns[where[time]]
            if label is not None:
                labels += self._labels(columns[where[label]], label, at)
            lines.append(np.array(at))
        all_lines = np.concatenate(lines)

        def place(row: int) -> str:
            return f"line {all_lines[row]}"

        clock = parse_times(times, self.path, time, place) if time is not None else (None, False)
        # An array takes a quarter of a list's memory, or less; the texts of a long column repeat.
        names = np.array(labels) if label is not None else None
        table = np.stack([np.concatenate(part) for part in parts], axis=1) if parts else np.empty((0, 0))
        return Rows(table, *clock, names, place)

    def _chunks(self, progress: Progress) -> Iterator[tuple[list[tuple[str, ...]], list[int]]]:
        """Columns of some rows at a time, and the lines of these rows."""
        with self._open() as (reader, file):
            size = fstat(file.fileno()).st_size
            next(filter(None, reader))
            while True:
                rows, lines = [], []
                for row in islice(reader, _CHUNK):
                    if row:
                        rows.append(row)
                        lines.append(reader.line_num)
                if rows:
                    yield self._columns(rows, lines), lines
                elif file.tell() == size:
                    return
                progress(file.tell(), size)

    def _columns(self, rows: list[list[str]], lines: list[int]) -> list[tuple[str, ...]]:
        width = len(self.names)
        try:
            columns = list(zip(*rows, strict=True))
        except ValueError:
            columns = []
        if len(columns) != width:
            row, line = next((row, line) for row, line in zip(rows, lines, strict=True) if len(row) != width)
            raise Problem(
                f"{self.path}, line {line}: {len(row)} cells, but the first line names {width} columns"
            )
        return columns

    def _numbers(self, cells: Sequence[str], name: str, lines: list[int]) -> Doubles:
        try:
            values = np.fromiter(map(float, cells), np.float64, len(cells))
        except ValueError:
            i = next(i for i, cell in enumerate(cells) if not is_number(cell))
            found = f"holds {cells[i]!r}, which is not a number" if cells[i].strip() else "is empty"
            raise Problem(f"{self.path}, line {lines[i]}: column {name!r} {found}") from None
        check_finite(values, self.path, name, lambda i: f"line {lines[i]}")
        return values

    def _labels(self, cells: Sequence[str], name: str, lines: list[int]) -> list[str]:
        labels = [cell.strip() for cell in cells]
        if "" in labels:
            raise Problem(f"{self.path}, line {lines[labels.index('')]}: column {name!r} is empty")
        return labels

    @contextmanager
    def _open(self) -> Iterator[tuple[Any, BinaryIO]]:
        """A reader of rows, and the file below, which knows how far it was read."""
        with reading(self.path), open(self.path, "rb") as file:
            reader = csv.reader(io.TextIOWrapper(file, "utf-8-sig", newline=""), skipinitialspace=True)
            try:
                yield reader, file
            except UnicodeDecodeError:
                raise Problem(f"{self.path} is not a text in UTF-8") from None
            except csv.Error as error:
                raise Problem(f"{self.path}, line {reader.line_num}: {error}") from None


def is_number(cell: str) -> bool:
    """Whether a cell holds a number."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def write_csv(file: BinaryIO, columns: Mapping[str, Array], utc: bool) -> None:
    """Write columns; numbers with all the digits that tell them apart, dates in ISO 8601."""
    text = io.TextIOWrapper(file, "utf-8", newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    total = max(map(len, columns.values()))
    with Progress("writing") as progress:
        for start in range(0, total, _CHUNK):
            progress(start, total)
            writer.writerows(
                zip(*(_cells(c[start : start + _CHUNK], utc) for c in columns.values()), strict=True)
            )
    text.flush()
    text.detach()


def _cells(values: Array, utc: bool) -> list[Any]:
    if values.dtype.kind == "M":
        return [cell + "Z" if utc else cell for cell in np.datetime_as_string(values).tolist()]
    cells: list[Any] = values.tolist()
    return cells

"""CSV: text in UTF-8, cells separated by commas, the columns named in the first line."""

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

from .errors import Problem, first_twice, reading
from .layout import Doubles
from .numbers import is_number
from .numbers import numbers as as_numbers
from .progress import Progress
from .tables import Array, Rows, Table
from .times import is_date_like, is_packed_day, parse_times

# Few enough rows to stay in the processor's cache: three times faster than many.
_CHUNK = 2000
# Rows in which dates are looked for: the first ones may hold units, or nothing.
_FIRST = 50


class CsvTable(Table):
    """A CSV file. Blank lines are skipped; a column is numeric if it has a name and its first cell is a number."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with self._open() as (reader, _):
            first = list(islice(filter(None, reader), _FIRST))
        if not first:
            raise Problem(f"{path} is empty")
        self.names = [name.strip() for name in first[0]]
        if len(self.names) == 1 and set(";\t") & set(self.names[0]):
            raise Problem(f"{path}: cells must be separated by commas; the first line is {self.names[0]!r}")
        if all(map(is_number, self.names)):
            raise Problem(f"{path}: the first line must name the columns, but holds numbers")
        twice = first_twice([name for name in self.names if name])
        if twice is not None:
            raise Problem(f"{path}: the first line names two columns {twice!r}")
        if len(first) < 2:
            raise Problem(f"{path} has no rows below the names of its columns")
        cells = zip(self.names, first[1], strict=False)
        self.numeric = [name for name, cell in cells if name and is_number(cell)]
        self.dates = [name for i, name in enumerate(self.names) if _dated(first[1:], i)]

    def read(self, numbers: Sequence[str], time: str | None, label: str | None, progress: Progress) -> Rows:
        where = {name: i for i, name in enumerate(self.names)}
        tables: list[Doubles] = []
        times: list[str] = []
        labels: list[str] = []
        lines: list[int] = []
        for columns, at in self._chunks(progress):
            tables.append(self._numbers({name: columns[where[name]] for name in numbers}, at))
            if time is not None:
                times += columns[where[time]]
            if label is not None:
                labels += self._labels(columns[where[label]], label, at)
            lines += at

        def place(row: int) -> str:
            return f"line {lines[row]}"

        clock, utc = np.empty(0), False
        if time is not None:
            clock, utc = parse_times(times, self._fail(time, place))
        return Rows(np.concatenate(tables), clock, utc, labels if label is not None else None, place)

    def _chunks(self, progress: Progress) -> Iterator[tuple[list[tuple[str, ...]], list[int]]]:
        """Columns of some rows at a time, and the lines of these rows."""
        with self._open() as (reader, file):
            size = fstat(file.fileno()).st_size
            next(filter(None, reader))
            before = -1
            while reader.line_num != before:
                before = reader.line_num
                rows, lines = [], []
                for row in islice(reader, _CHUNK):
                    if row:
                        rows.append(row)
                        lines.append(reader.line_num)
                if rows:
                    yield self._columns(rows, lines), lines
                progress(file.tell(), size)

    def _columns(self, rows: list[list[str]], lines: list[int]) -> list[tuple[str, ...]]:
        width = len(self.names)
        for row, line in zip(rows, lines, strict=True):
            if len(row) != width:
                raise Problem(
                    f"{self.path}, line {line}: {len(row)} cells, but the first line names {width} columns"
                )
        return list(zip(*rows, strict=True))

    def _numbers(self, cells: Mapping[str, Sequence[str]], lines: list[int]) -> Doubles:
        def place(row: int) -> str:
            return f"line {lines[row]}"

        table = np.empty((len(lines), len(cells)))
        for column, (name, texts) in zip(table.T, cells.items(), strict=True):
            try:
                column[:] = as_numbers(texts)
            except ValueError:
                i = next(i for i, text in enumerate(texts) if not is_number(text))
                found = f"holds {texts[i]!r}, which is not a number" if texts[i].strip() else "is empty"
                if i == 0 and texts[i].strip():
                    found += "; if this line holds units, remove it"
                raise self._fail(name, place)(i, found) from None
            self._finite(column, name, place)
        return table

    def _labels(self, cells: Sequence[str], name: str, lines: list[int]) -> list[str]:
        labels = [cell.strip() for cell in cells]
        if "" in labels:
            raise self._fail(name, lambda row: f"line {lines[row]}")(labels.index(""), "is empty")
        return labels

    @contextmanager
    def _open(self) -> Iterator[tuple[Any, BinaryIO]]:
        """A reader of rows, and the file below it, which knows how far it was read."""
        with reading(self.path), open(self.path, "rb") as file:
            text = io.TextIOWrapper(file, "utf-8-sig", newline="")
            reader = csv.reader(text, skipinitialspace=True, strict=True)
            try:
                yield reader, file
            except UnicodeDecodeError:
                raise Problem(f"{self.path} is not text in UTF-8") from None
            except csv.Error as error:
                raise Problem(f"{self.path}, line {reader.line_num}: {error}") from None


def _dated(rows: list[list[str]], column: int) -> bool:
    """Whether the first cell of a column that looks like a date or a number looks like a date, 20210829 too."""
    cells = (row[column] for row in rows if column < len(row))
    found = (cell for cell in cells if is_number(cell) or is_date_like(cell))
    return next((not is_number(cell) or is_packed_day(cell) for cell in found), False)


def write_csv(file: BinaryIO, columns: Mapping[str, Array], utc: bool) -> None:
    """Write columns: numbers with as many digits as tell them apart, dates in ISO 8601."""
    text = io.TextIOWrapper(file, "utf-8", newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    total = max(map(len, columns.values()))
    with Progress("writing") as progress:
        for start in range(0, total, _CHUNK):
            progress(start, total)
            cells = [_cells(values[start : start + _CHUNK], utc) for values in columns.values()]
            writer.writerows(zip(*cells, strict=True))
    text.flush()
    text.detach()


def _cells(values: Array, utc: bool) -> list[Any]:
    if values.dtype.kind == "M":
        return [date + "Z" if utc else date for date in np.datetime_as_string(values).tolist()]
    cells: list[Any] = values.tolist()
    return cells

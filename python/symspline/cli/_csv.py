"""Tables in text: CSV with commas, semicolons or tabs."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import groupby, islice, zip_longest
from typing import Any, BinaryIO

import numpy as np

from .._core import number_lines
from ._messages import Problem, Progress, first_duplicate, refuse
from ._streams import Source
from ._tables import FIRST, Array, Layout, Table
from ._times import is_date_like, is_number, is_packed_day, numbers

# So few rows stay in the processor's cache, which is three times faster than reading all at once.
_CHUNK = 2000
# Bytes from which on pyarrow saves more time than its import takes.
_LARGE = 1_000_000
_WRITTEN = 50_000
"""Rows that are written between two updates of the progress."""


class CsvTable(Table):
    """Text in UTF-8 with cells separated by commas, semicolons or tabs, and names of columns in the first line.

    Blank lines are skipped. Only the columns that are needed are read. A column is numeric if it has a name and its
    first cell is a number. Between semicolons, numbers may have a decimal comma.
    """

    def __init__(self, path: Source) -> None:
        super().__init__(path)
        self._delimiter = ","
        with path.open() as file:
            first = next(filter(bytes.strip, file), b"")
        self._delimiter = max(",;\t", key=lambda mark: first.count(mark.encode()))
        with self._reader() as (reader, _):
            names = [name.strip() for name in next(filter(None, reader), [])]
            self._head_lines = reader.line_num
            rows = list(islice(filter(None, reader), FIRST))
        self.names = names
        twice = first_duplicate([name for name in names if name])
        refuse(
            path,
            (not names, " is empty"),
            (all(map(self._is_number, names)), ": the first line must name the columns, but holds numbers"),
            (twice is not None, f": the first line names two columns {twice!r}"),
            (not rows, " has no rows below the names of its columns"),
        )
        self.numeric = [name for name, cell in zip(names, rows[0], strict=False) if name and self._is_number(cell)]
        self._first = list(zip(names, zip_longest(*rows, fillvalue=""), strict=False))
        self.dates = [name for name, cells in self._first if self._holds_dates(cells)]

    def allow_missing(self) -> None:
        first = {name: next(filter(str.strip, cells), "") for name, cells in self._first}
        self.numeric = [name for name, cell in first.items() if name and self._is_number(cell)]

    def load(self, numbers: Sequence[str], texts: Sequence[str], progress: Progress) -> None:
        if self.path.size >= _LARGE and self._load_at_once(numbers, texts):
            return
        index = {name: i for i, name in enumerate(self.names)}
        cells: dict[str, list[Any]] = {name: [] for name in (*numbers, *texts)}
        with self._reader() as (reader, file):
            size, start = self.path.size, 0
            next(filter(None, reader))
            while rows := list(islice(filter(None, reader), _CHUNK)):
                for i, row in enumerate(rows, start):
                    if len(row) != len(self.names):
                        width = f"{len(row)} cells, but the first line names {len(self.names)} columns"
                        raise Problem(f"{self.path}, {self.place(i)}: {width}")
                columns = list(zip(*rows, strict=True))
                for name in numbers:
                    cells[name].append(self._converted(columns[index[name]], name, start))
                for name in texts:
                    cells[name] += columns[index[name]]
                start += len(rows)
                progress(file.tell(), size)
        self.columns = cells | {name: np.concatenate(cells[name]) for name in numbers}

    def _load_at_once(self, numbers: Sequence[str], texts: Sequence[str]) -> bool:
        """Read the columns with pyarrow, if it is installed and finds nothing unusual, such as an empty cell."""
        try:
            import pyarrow as pa
            from pyarrow import compute
            from pyarrow import csv as reader
        except ImportError:
            return False
        keys = {name: str(i) for i, name in enumerate(self.names)}
        comma = self._delimiter == ";" and any("," in cell for _, cells in self._first for cell in cells)
        time = self._time if self._time in self.numeric else None
        if time is not None:
            numbers, texts = [*numbers, time], [name for name in texts if name != time]
        types = {keys[name]: pa.string() for name in texts} | {keys[name]: pa.float64() for name in numbers}
        try:
            with self.path.open() as file:
                table = reader.read_csv(
                    file,
                    reader.ReadOptions(column_names=list(keys.values()), skip_rows=self._head_lines),
                    reader.ParseOptions(delimiter=self._delimiter),
                    reader.ConvertOptions(
                        column_types=types,
                        include_columns=list(types),
                        null_values=[""],
                        decimal_point="," if comma else ".",
                    ),
                )
        except pa.ArrowInvalid:
            return False
        for name in numbers:
            if table[keys[name]].null_count and name not in self._sparse:
                return False
        for name in texts:
            # Blanks before quotes have another meaning there.
            if compute.any(compute.match_substring(table[keys[name]], '"')).as_py():
                return False
        self.columns = {name: _floats(table[keys[name]]) for name in numbers}
        if time is not None and not np.abs(self.columns[time]).max(initial=0.0) <= 2**53:
            # Larger whole numbers are exact as texts only.
            return False
        self.columns |= {name: table[keys[name]].to_pylist() for name in texts}
        return True

    def place(self, row: int) -> str:
        with self._reader() as (reader, _):
            rows = filter(None, reader)
            next(islice(rows, row + 1, None), None)
            return f"line {reader.line_num}"

    def _is_number(self, cell: str) -> bool:
        return is_number(self._plain(cell))

    def _plain(self, cell: str) -> str:
        return cell.replace(",", ".") if self._delimiter == ";" else cell

    def _converted(self, cells: Sequence[str], name: str, start: int) -> Array:
        plain: Sequence[str] = cells
        if name in self._sparse:
            plain = [cell if cell.strip() else "nan" for cell in cells]
        if self._delimiter == ";":
            plain = [self._plain(cell) for cell in plain]
        try:
            return numbers(plain)
        except ValueError:
            i = next(i for i, cell in enumerate(plain) if not is_number(cell))
            found = f"holds {cells[i]!r}, which is not a number" if cells[i].strip() else "is empty"
            units = "; if this line holds units, remove it" if start + i == 0 and cells[i].strip() else ""
            raise self._problem(name, start + i, found + units) from None

    def _holds_dates(self, cells: Sequence[str]) -> bool:
        """Whether the first cell that looks like a date or a number looks like a date, such as 20210829."""
        found = (cell for cell in cells if self._is_number(cell) or is_date_like(cell))
        return next((not self._is_number(cell) or is_packed_day(cell) for cell in found), False)

    @contextmanager
    def _reader(self) -> Iterator[tuple[Any, BinaryIO]]:
        """Yield a reader of rows and the file below it, whose position shows the progress."""
        with self.path.open() as file:
            text = io.TextIOWrapper(file, "utf-8-sig", newline="")
            reader = csv.reader(text, delimiter=self._delimiter, skipinitialspace=True, strict=True)
            try:
                yield reader, file
            except UnicodeDecodeError:
                raise Problem(f"{self.path} is not text in UTF-8") from None
            except csv.Error as error:
                raise Problem(f"{self.path}, line {reader.line_num}: {error}") from None
            finally:
                text.detach()


def _floats(column: Any) -> Array:
    """Return the numbers of a column of pyarrow, whose own conversion would import pandas."""
    full = column.fill_null(np.nan) if column.null_count else column
    chunks = [chunk for chunk in full.chunks if len(chunk)]
    parts = [np.frombuffer(own.buffers()[1])[own.offset : own.offset + len(own)] for own in chunks]
    return np.concatenate([np.empty(0), *parts])


def write_csv(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write numbers as the shortest text that reads back equal, and dates in ISO 8601."""
    file.write(_row(columns))
    total = max(map(len, columns.values()))
    with Progress("writing") as progress:
        for start in range(0, total, _WRITTEN):
            progress(start, total)
            blocks: list[Sequence[str]] = []
            for is_number, group in groupby(columns.values(), lambda values: values.dtype.kind == "f"):
                chunk = [values[start : start + _WRITTEN] for values in group]
                if is_number:
                    blocks.append(number_lines(np.stack(chunk, axis=1), ",").splitlines())
                else:
                    blocks += [_cells(values, layout.utc) for values in chunk]
            lines = blocks[0] if len(blocks) == 1 else map(",".join, zip(*blocks, strict=True))
            file.write("".join(f"{line}\n" for line in lines).encode())


def _cells(values: Array, utc: bool | None) -> list[str]:
    if values.dtype.kind == "M":
        return date_texts(values, utc)
    if values.dtype.kind == "U":
        quoted = {text: _row([text]).decode().removesuffix("\n") for text in np.unique(values).tolist()}
        return [quoted[text] for text in values.tolist()]
    return list(map(str, values.tolist()))


def date_texts(dates: Array, utc: bool | None) -> list[str]:
    """Return dates in ISO 8601, with a Z if they are in UTC."""
    texts: list[str] = np.datetime_as_string(dates).tolist()
    return [text + "Z" for text in texts] if utc else texts


def _row(cells: Any) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()

"""Tables in files: CSV, NPZ, Parquet and TUM, with rows of numbers, times and labels in named columns."""

from __future__ import annotations

import csv
import io
import math
import zipfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import date, time, timedelta
from itertools import islice, zip_longest
from os import fstat
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .._archive import read
from .._arrays import brief
from .._core import ValidationError
from .._pose_files import TUM, tum_rows, write_tum_rows
from ._errors import Problem, did_you_mean, first_duplicate, reading, refuse, writing
from ._terminal import Progress
from ._times import is_date_like, is_number, is_packed_day, numbers, parse_times

Array = NDArray[Any]
Place = Callable[[int], str]

RE, IM = "_re", "_im"
# Few enough rows to stay in the processor's cache: three times faster than many.
_CHUNK = 2000
# Rows in which dates are searched for: the first ones may hold units, or be empty.
_FIRST = 50


@dataclass(frozen=True)
class Rows:
    """Columns that were read from a table.

    Attributes
    ----------
    numbers : ndarray, shape (rows, columns)
    times : ndarray
        Numbers or ``datetime64``; empty without a column of times.
    utc : bool or None
        Whether the times had a Z or an offset and are UTC now. None where the file does not tell.
    labels : list of str or None
        Names of the curves, None without such a column.
    place : callable
        Describes the place of a row, such as ``"line 7"``.
    """

    numbers: NDArray[np.float64]
    times: Array
    utc: bool | None
    labels: list[str] | None
    place: Place


class Table(ABC):
    """A file with named columns.

    Attributes
    ----------
    path : Path
    names, numeric, dates : list of str
        All columns in the order of the file, those with numbers, and those with dates or what looks like them.
    """

    names: list[str]
    numeric: list[str]
    dates: list[str]

    def __init__(self, path: Path) -> None:
        self.path = path
        # The columns of each array of an NPZ file.
        self.groups: dict[str, list[str]] = {}

    @abstractmethod
    def _column(self, name: str) -> Array | list[str]:
        """Return one column with the type that it has in the file."""

    def _load(self, numbers: Sequence[str], texts: Sequence[str], progress: Progress) -> None:  # noqa: B027
        """Read the columns that `_column` will return, if the whole file was not read."""

    def _is_utc(self, name: str) -> bool | None:
        return None

    def _place(self, row: int) -> str:
        return f"row {row} (counted from 0)"

    def require(self, name: str) -> str:
        """Return the name if there is such a column."""
        if name not in self.names:
            near = did_you_mean(name, [*self.groups] or self.names)
            raise Problem(f"{self.path} has no column {name!r}; {near}")
        return name

    def expand(self, name: str) -> list[str]:
        """Return the columns of a name: itself, those of an array, or the two parts of complex numbers."""
        if name in self.groups or name in self.names:
            return self.groups.get(name, [name])
        both = [name + RE, name + IM]
        missing = [part for part in both if part not in self.names]
        if len(missing) == 1:
            (found,) = set(both) - set(missing)
            needs = f"has a column {found!r}, but no {missing[0]!r}; a complex number needs both"
            raise Problem(f"{self.path} {needs}")
        return [self.require(name)] if missing else both

    def points(self, others: Sequence[str | None]) -> list[str]:
        """Return the columns of the points if none are named: all numeric columns but the others."""
        return self.groups.get("points") or [name for name in self.numeric if name not in others]

    def read(self, numbers: Sequence[str], time: str | None, label: str | None) -> Rows:
        """Read some columns as numbers, one as times and one as labels."""
        with Progress("reading") as progress:
            self._load(numbers, [name for name in (time, label) if name is not None], progress)
        columns = [self._numbers(name) for name in numbers]
        times, utc = self._times(time) if time is not None else (np.empty(0), False)
        labels = self._texts(label) if label is not None else None
        given = [*columns, *([times] if time is not None else []), *([labels] if labels is not None else [])]
        lengths = sorted(set(map(len, given)))
        differ = f": arrays differ in length: {' and '.join(map(str, lengths))}"
        refuse(self.path, (len(lengths) > 1, differ), (lengths == [0], " has no rows"))
        table = np.stack(columns, axis=1) if columns else np.empty((0, 0))
        return Rows(table, times, utc, labels, self._place)

    def _numbers(self, name: str) -> NDArray[np.float64]:
        array = np.asarray(self._column(name))
        if array.dtype.kind not in "biuf":
            raise Problem(f"{self.path}: column {name!r} holds {array.dtype}, not numbers")
        values = array.astype(np.float64)
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise self._problem(name, int(bad[0]), f"holds {values[bad[0]]}, which is not a finite number")
        return values

    def _texts(self, name: str) -> list[str]:
        column = self._column(name)
        if isinstance(column, list):
            texts = [cell.strip() for cell in column]
        else:
            for row, cell in enumerate(column.tolist() if column.dtype.kind in "OS" else ()):
                if not isinstance(cell, (str, int, float, date, time, timedelta)):
                    kind = type(cell).__name__
                    raise self._problem(name, row, f"holds {kind}, not a text, a number or a time")
            texts = [text.strip() for text in column.astype(np.str_).tolist()]
        if "" in texts:
            raise self._problem(name, texts.index(""), "is empty")
        return texts

    def _times(self, name: str) -> tuple[Array, bool | None]:
        column = self._column(name)
        if isinstance(column, list) or column.dtype.kind in "OUT":
            return parse_times(self._texts(name), lambda row, found: self._problem(name, row, found))
        if column.dtype.kind in "iu":
            return column, False
        if column.dtype.kind != "M":
            return self._numbers(name), False
        if np.isnat(column).any():
            raise self._problem(name, int(np.isnat(column).argmax()), "holds no time")
        return column, self._is_utc(name)

    def _problem(self, name: str, row: int, found: str) -> Problem:
        return Problem(f"{self.path}, {self._place(row)}: column {name!r} {found}")


class CsvTable(Table):
    """Text in UTF-8 with cells separated by commas and names of columns in the first line.

    Blank lines are skipped. A column is numeric if it has a name and its first cell is a number.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with self._reader() as (reader, _):
            head = list(islice(filter(None, reader), _FIRST))
        refuse(path, (not head, " is empty"))
        self.names = names = [name.strip() for name in head[0]]
        twice = first_duplicate([name for name in names if name])
        semicolons = len(names) == 1 and set(";\t") & set(names[0])
        refuse(
            path,
            (semicolons, f": cells must be separated by commas; the first line is {names[0]!r}"),
            (all(map(is_number, names)), ": the first line must name the columns, but holds numbers"),
            (twice is not None, f": the first line names two columns {twice!r}"),
            (len(head) < 2, " has no rows below the names of its columns"),
        )
        self.numeric = [name for name, cell in zip(names, head[1], strict=False) if name and is_number(cell)]
        columns = zip(names, zip_longest(*head[1:], fillvalue=""), strict=False)
        self.dates = [name for name, cells in columns if _holds_dates(cells)]

    def _load(self, numbers: Sequence[str], texts: Sequence[str], progress: Progress) -> None:
        index = {name: i for i, name in enumerate(self.names)}
        self._lines: list[int] = []
        self._cells: dict[str, list[Any]] = {name: [] for name in (*numbers, *texts)}
        with self._reader() as (reader, file):
            size = fstat(file.fileno()).st_size
            next(filter(None, reader))
            while chunk := [(reader.line_num, row) for row in islice(reader, _CHUNK)]:
                start = len(self._lines)
                for line, row in chunk:
                    if row and len(row) != len(self.names):
                        width = f"{len(row)} cells, but the first line names {len(self.names)} columns"
                        raise Problem(f"{self.path}, line {line}: {width}")
                self._lines += [line for line, row in chunk if row]
                columns = list(zip(*(row for _, row in chunk if row), strict=True)) or [()] * len(self.names)
                for name in numbers:
                    self._cells[name].append(self._converted(columns[index[name]], name, start))
                for name in texts:
                    self._cells[name] += columns[index[name]]
                progress(file.tell(), size)
        self._cells |= {name: np.concatenate(self._cells[name]) for name in numbers}  # type: ignore[misc]

    def _column(self, name: str) -> Array | list[str]:
        return self._cells[name]

    def _place(self, row: int) -> str:
        return f"line {self._lines[row]}"

    def _converted(self, cells: Sequence[str], name: str, start: int) -> Array:
        try:
            return numbers(cells)
        except ValueError:
            i = next(i for i, cell in enumerate(cells) if not is_number(cell))
            found = f"holds {cells[i]!r}, which is not a number" if cells[i].strip() else "is empty"
            units = "; if this line holds units, remove it" if start + i == 0 and cells[i].strip() else ""
            raise self._problem(name, start + i, found + units) from None

    @contextmanager
    def _reader(self) -> Iterator[tuple[Any, BinaryIO]]:
        """Yield a reader of rows and the file below it, whose position shows the progress."""
        with reading(self.path), open(self.path, "rb") as file:
            text = io.TextIOWrapper(file, "utf-8-sig", newline="")
            reader = csv.reader(text, skipinitialspace=True, strict=True)
            try:
                yield reader, file
            except UnicodeDecodeError:
                raise Problem(f"{self.path} is not text in UTF-8") from None
            except csv.Error as error:
                raise Problem(f"{self.path}, line {reader.line_num}: {error}") from None


def _holds_dates(cells: Sequence[str]) -> bool:
    """Whether the first cell that looks like a date or a number looks like a date, such as 20210829."""
    found = (cell for cell in cells if is_number(cell) or is_date_like(cell))
    return next((not is_number(cell) or is_packed_day(cell) for cell in found), False)


class NpzTable(Table):
    """The arrays of an NPZ file, with one entry per row.

    The entries of an array ``a`` with more axes are the columns ``a_0``, ``a_1``, … row by row; complex numbers are
    two columns ``a_0_re`` and ``a_0_im``.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        arrays = {key: a for key, a in _arrays(path).items() if a.ndim and a.dtype.kind in "biufcMmSU"}
        columns = {key: _split(key, array) for key, array in arrays.items()}
        self.groups = {key: [*own] for key, own in columns.items()}
        self._columns = {name: column for own in columns.values() for name, column in own.items()}
        kinds = {name: column.dtype.kind for name, column in self._columns.items()}
        self.names = list(kinds)
        self.numeric = [name for name, kind in kinds.items() if kind in "biuf"]
        first = {name: "".join(self._columns[name][:1]) for name, kind in kinds.items() if kind == "U"}
        self.dates = [name for name in kinds if kinds[name] in "Mm" or is_date_like(first.get(name, ""))]

    def _column(self, name: str) -> Array:
        return self._columns[name]


def _arrays(path: Path) -> dict[str, Array]:
    with reading(path), open(path, "rb") as file:
        refuse(path, (not zipfile.is_zipfile(file), " is not an NPZ file"))
        file.seek(0)
        try:
            arrays = read(file, lambda name: True)
        except (OSError, MemoryError):
            raise
        except ValidationError as error:
            raise Problem(f"{path}: {error}") from None
        except Exception as error:
            # Damage appears as errors of zipfile, of its decompressors and of NumPy.
            raise Problem(f"{path} is damaged, or holds other objects than numbers: {brief(error)}") from None
    refuse(path, ("format" in arrays, " is a curve that was fitted already, not a table"))
    return arrays


def _split(key: str, array: Array) -> dict[str, Array]:
    """Split an array into columns."""
    entries = array.reshape(len(array), math.prod(array.shape[1:])).T
    columns = {key if array.ndim == 1 else f"{key}_{i}": entry for i, entry in enumerate(entries)}
    if array.dtype.kind != "c":
        return columns
    return {name + end: part for name, z in columns.items() for end, part in ((RE, z.real), (IM, z.imag))}


class ParquetTable(Table):
    """The columns of a Parquet file."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._pa, parquet = _pyarrow()
        with reading(path), open(path, "rb") as file:
            try:
                self._table = parquet.read_table(file)
            except self._pa.ArrowInvalid:
                raise Problem(f"{path} is damaged or not a Parquet file") from None
        types = self._pa.types
        self.names = self._table.column_names
        fields = list(self._table.schema)
        numeric = (types.is_integer, types.is_floating, types.is_decimal)
        self.numeric = [field.name for field in fields if any(test(field.type) for test in numeric)]
        dates = (
            field
            for field in fields
            if types.is_temporal(field.type) or is_date_like(self._first_text(field))
        )
        self.dates = [field.name for field in dates]

    def _column(self, name: str) -> Array:
        column = self._table.column(name)
        if column.null_count:
            raise self._problem(name, int(column.is_null().to_numpy().argmax()), "is empty")
        decimal = self._pa.types.is_decimal(column.type)
        values: Array = (column.cast(self._pa.float64()) if decimal else column).to_numpy()
        return values

    def _first_text(self, field: Any) -> str:
        is_text = str(field.type) in ("string", "large_string", "string_view")
        cells = self._table.column(field.name)[:_FIRST] if is_text else ()
        return next((cell.as_py() for cell in cells if cell.is_valid), "")

    def _is_utc(self, name: str) -> bool:
        return getattr(self._table.schema.field(name).type, "tz", None) is not None


class TumTable(Table):
    """A trajectory of the TUM RGB-D benchmark: lines of time, position and quaternion, its scalar last."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.names, self.numeric, self.dates = list(TUM), list(TUM), []
        with reading(path):
            self._rows, self._line = tum_rows(path)

    def _place(self, row: int) -> str:
        return self._line(row)

    def _column(self, name: str) -> Array:
        return self._rows[:, self.names.index(name)]


# ---- writing ----


def _write_csv(file: BinaryIO, columns: Mapping[str, Array], utc: bool) -> None:
    """Write numbers with as many digits as tell them apart, and dates in ISO 8601."""
    text = io.TextIOWrapper(file, "utf-8", newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    total = max(map(len, columns.values()))
    with Progress("writing") as progress:
        for start in range(0, total, _CHUNK):
            progress(start, total)
            chunk = (values[start : start + _CHUNK] for values in columns.values())
            writer.writerows(zip(*(_csv_cells(values, utc) for values in chunk), strict=True))
    text.detach()


def _csv_cells(values: Array, utc: bool) -> list[Any]:
    if values.dtype.kind == "M":
        return [date + "Z" if utc else date for date in np.datetime_as_string(values).tolist()]
    return list(values.tolist())


def _write_npz(file: BinaryIO, columns: Mapping[str, Array], utc: bool) -> None:
    np.savez(file, **columns)  # type: ignore[arg-type]


def _write_parquet(file: BinaryIO, columns: Mapping[str, Array], utc: bool) -> None:
    pa, parquet = _pyarrow()

    def column(values: Array) -> Any:
        if values.dtype.kind != "M":
            return pa.array(values)
        unit = np.datetime_data(values.dtype)[0]
        unit = unit if unit in ("ms", "us", "ns") else "s"
        return pa.array(values.astype(f"datetime64[{unit}]"), pa.timestamp(unit, "UTC" if utc else None))

    parquet.write_table(pa.table({name: column(values) for name, values in columns.items()}), file)


def _write_tum(file: BinaryIO, columns: Mapping[str, Array], utc: bool) -> None:
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
        raise Problem(
            "Parquet files need pyarrow; install it with: pip install 'symspline[parquet]'"
        ) from None
    return pyarrow, pyarrow.parquet


_FORMATS: dict[str, tuple[Callable[[Path], Table], Callable[[BinaryIO, Mapping[str, Array], bool], None]]] = {
    ".csv": (CsvTable, _write_csv),
    ".npz": (NpzTable, _write_npz),
    ".parquet": (ParquetTable, _write_parquet),
    ".tum": (TumTable, _write_tum),
    ".txt": (TumTable, _write_tum),
}
ENDINGS, TUM_ENDINGS = tuple(_FORMATS), (".tum", ".txt")


def check_ending(path: Path, allowed: Sequence[str] = ENDINGS, what: str = "a table") -> str:
    """Return the ending of a file name, which selects the format."""
    suffix = path.suffix.lower()
    refuse(path, (suffix not in allowed, f": the name of {what} must end in {' or '.join(allowed)}"))
    return suffix


def open_table(path: Path) -> Table:
    """Open the table in a file."""
    return _FORMATS[check_ending(path)][0](path)


def write_table(path: Path, columns: Mapping[str, Array], utc: bool) -> None:
    """Write columns of equal length to a file in the format of its ending."""
    with writing(path) as temporary, open(temporary, "wb") as file:
        _FORMATS[check_ending(path)][1](file, columns, utc)

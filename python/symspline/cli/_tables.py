"""Tables in files: CSV, NPZ, Parquet and TUM, with rows of numbers, times and labels in named columns."""

from __future__ import annotations

import csv
import io
import math
import zipfile
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
from .._disk import damage
from .._pose_files import TUM, tum_rows, write_tum_rows
from ._messages import Problem, Progress, did_you_mean, first_duplicate, reading, refuse, writing
from ._times import is_date_like, is_number, is_packed_day, numbers, parse_times

Array = NDArray[Any]
Place = Callable[[int], str]

RE, IM = "_re", "_im"
# So few rows stay in the processor's cache, which is three times faster than reading all at once.
_CHUNK = 2000
# Rows that are searched for dates, as the first ones may hold units or be empty.
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
        Whether the times had a Z or an offset and are UTC now. None if it is unknown.
    labels : list of str or None
        Names of the curves, None without such a column.
    place : callable
        Describes the position of a row, such as ``"line 7"``.
    """

    numbers: NDArray[np.float64]
    times: Array
    utc: bool | None
    labels: list[str] | None
    place: Place


class Table:
    """A file with named columns. Its subclasses read the formats.

    Attributes
    ----------
    path : Path
    names, numeric, dates : list of str
        All columns in the order of the file, those with numbers, and those with dates or text that looks like dates.
    groups : dict
        The columns of each array of an NPZ file.
    is_utc : dict
        Whether a column of dates has the time zone UTC; empty if it is unknown.
    columns : mapping
        Columns that were read, with the type that they have in the file.
    """

    names: list[str]
    numeric: list[str]
    dates: list[str]
    groups: dict[str, list[str]]
    is_utc: dict[str, bool]
    columns: dict[str, Any]

    def __init__(self, path: Path) -> None:
        """Read the names of the columns."""
        self.path, self.groups, self.is_utc, self.columns = path, {}, {}, {}
        self._sparse: frozenset[str] = frozenset()

    def allow_missing(self) -> None:
        """Find columns of numbers whose first cells are empty, too."""

    def load(self, numbers: Sequence[str], texts: Sequence[str], progress: Progress) -> None:
        """Read columns of numbers and columns of text, if the file was not read as a whole."""

    def place(self, row: int) -> str:
        """Describe the position of a row."""
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

    def read(self, numbers: Sequence[str], time: str | None, label: str | None, sparse: Sequence[str] = ()) -> Rows:
        """Read some columns as numbers, one as times and one as labels.

        Cells of the columns `sparse` may be empty or NaN; they are NaN in the result.
        """
        self._sparse = frozenset(sparse)
        with Progress("reading") as progress:
            self.load(numbers, [name for name in (time, label) if name is not None], progress)
        columns = [self._numbers(name) for name in numbers]
        times, utc = self._times(time) if time is not None else (np.empty(0), False)
        labels = self._texts(label) if label is not None else None
        given = [*columns, *([times] if time is not None else []), *([labels] if labels is not None else [])]
        lengths = sorted(set(map(len, given)))
        differ = f": arrays differ in length: {' and '.join(map(str, lengths))}"
        refuse(self.path, (len(lengths) > 1, differ), (lengths == [0], " has no rows"))
        table = np.stack(columns, axis=1) if columns else np.empty((0, 0))
        return Rows(table, times, utc, labels, self.place)

    def _numbers(self, name: str) -> NDArray[np.float64]:
        array = np.asarray(self.columns[name])
        if array.dtype.kind not in "biuf":
            raise Problem(f"{self.path}: column {name!r} holds {array.dtype}, not numbers")
        values = array.astype(np.float64)
        bad = np.flatnonzero(np.isinf(values) if name in self._sparse else ~np.isfinite(values))
        if bad.size:
            raise self._problem(name, int(bad[0]), f"holds {values[bad[0]]}, which is not a finite number")
        return values

    def _texts(self, name: str) -> list[str]:
        column = self.columns[name]
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
        column = self.columns[name]
        if isinstance(column, list) or column.dtype.kind in "OUT":
            return parse_times(self._texts(name), lambda row, found: self._problem(name, row, found))
        if column.dtype.kind in "iu":
            return column, False
        if column.dtype.kind != "M":
            return self._numbers(name), False
        if np.isnat(column).any():
            raise self._problem(name, int(np.isnat(column).argmax()), "holds no time")
        return column, self.is_utc.get(name)

    def _problem(self, name: str, row: int, found: str) -> Problem:
        return Problem(f"{self.path}, {self.place(row)}: column {name!r} {found}")


# ---- reading ----


class _Csv(Table):
    """Text in UTF-8 with cells separated by commas and names of columns in the first line; blank lines are skipped.

    Only the columns that are needed are read. A column is numeric if it has a name and its first cell is a number.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with self._reader() as (reader, _):
            names, *rows = list(islice(filter(None, reader), _FIRST)) or [[]]
        self.names = names = [name.strip() for name in names]
        twice = first_duplicate([name for name in names if name])
        whole = ",".join(names)
        semicolons = len(names) == 1 and set(";\t") & set(whole)
        refuse(
            path,
            (not names, " is empty"),
            (semicolons, f": cells must be separated by commas; the first line is {whole!r}"),
            (all(map(is_number, names)), ": the first line must name the columns, but holds numbers"),
            (twice is not None, f": the first line names two columns {twice!r}"),
            (not rows, " has no rows below the names of its columns"),
        )
        self.numeric = [name for name, cell in zip(names, rows[0], strict=False) if name and is_number(cell)]
        self._first = list(zip(names, zip_longest(*rows, fillvalue=""), strict=False))
        self.dates = [name for name, cells in self._first if _holds_dates(cells)]

    def allow_missing(self) -> None:
        first = {name: next(filter(str.strip, cells), "") for name, cells in self._first}
        self.numeric = [name for name, cell in first.items() if name and is_number(cell)]

    def load(self, numbers: Sequence[str], texts: Sequence[str], progress: Progress) -> None:
        index = {name: i for i, name in enumerate(self.names)}
        self._lines: list[int] = []
        cells: dict[str, list[Any]] = {name: [] for name in (*numbers, *texts)}
        with self._reader() as (reader, file):
            size = fstat(file.fileno()).st_size
            next(filter(None, reader))
            while chunk := [(reader.line_num, row) for row in islice(reader, _CHUNK)]:
                start = len(self._lines)
                rows = [row for _, row in chunk if row]
                self._lines += [line for line, row in chunk if row]
                for i, row in enumerate(rows, start):
                    if len(row) != len(self.names):
                        width = f"{len(row)} cells, but the first line names {len(self.names)} columns"
                        raise Problem(f"{self.path}, {self.place(i)}: {width}")
                columns = list(zip(*rows, strict=True)) or [()] * len(self.names)
                for name in numbers:
                    cells[name].append(self._converted(columns[index[name]], name, start))
                for name in texts:
                    cells[name] += columns[index[name]]
                progress(file.tell(), size)
        self.columns = cells | {name: np.concatenate(cells[name]) for name in numbers}

    def place(self, row: int) -> str:
        return f"line {self._lines[row]}"

    def _converted(self, cells: Sequence[str], name: str, start: int) -> Array:
        if name in self._sparse:
            cells = [cell if cell.strip() else "nan" for cell in cells]
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


class _Npz(Table):
    """An NPZ file, whose arrays have one entry per row.

    The entries of an array ``a`` with more axes are the columns ``a_0``, ``a_1``, … row by row; complex numbers are
    two columns ``a_0_re`` and ``a_0_im``.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with reading(path), open(path, "rb") as file:
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


class _Parquet(Table):
    def __init__(self, path: Path) -> None:
        super().__init__(path)
        pa, parquet = _pyarrow()
        with reading(path), open(path, "rb") as file:
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
        return next((cell.as_py() for cell in cells[:_FIRST] if is_text and cell.is_valid), "")

    def load(self, numbers: Sequence[str], texts: Sequence[str], progress: Progress) -> None:
        pa, _ = _pyarrow()
        for name in (*numbers, *texts):
            cells = self._table.column(name)
            if cells.null_count and name not in self._sparse:
                raise self._problem(name, int(cells.is_null().to_numpy().argmax()), "is empty")
            if pa.types.is_decimal(cells.type) or cells.null_count:
                cells = cells.cast(pa.float64())
            self.columns[name] = np.asarray(cells.to_numpy())


class _Tum(Table):
    """A trajectory of the TUM RGB-D benchmark: lines of time, position and quaternion, its scalar last."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with reading(path):
            rows, self._lines = tum_rows(path)
        self.names, self.numeric, self.dates = [*TUM], [*TUM], []
        self.columns = dict(zip(TUM, rows.T, strict=True))

    def place(self, row: int) -> str:
        return self._lines.place(row)


# ---- writing ----


def _write_csv(file: BinaryIO, columns: Mapping[str, Array], utc: bool) -> None:
    """Write numbers as the shortest text that reads back equal, and dates in ISO 8601."""
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
        raise Problem("Parquet files need pyarrow; install it with: pip install 'symspline[parquet]'") from None
    return pyarrow, pyarrow.parquet


_FORMATS: dict[str, tuple[type[Table], Callable[[BinaryIO, Mapping[str, Array], bool], None]]] = {
    ".csv": (_Csv, _write_csv),
    ".npz": (_Npz, _write_npz),
    ".parquet": (_Parquet, _write_parquet),
    ".tum": (_Tum, _write_tum),
    ".txt": (_Tum, _write_tum),
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

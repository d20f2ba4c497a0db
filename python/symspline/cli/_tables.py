"""Tables in files: their formats, their columns of numbers, dates and texts, and the times and labels in their rows."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import warnings
import zipfile
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC
from decimal import Decimal, InvalidOperation
from email.utils import parsedate_to_datetime
from importlib import import_module
from itertools import chain, count, islice, pairwise
from pathlib import Path, PurePath
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import brief
from .._base.input import ISO_DATE, UTC_ZONE, times_of
from .._base.system import damage
from .._base.time import NANOSECONDS, parts_of_duration
from .._base.typing import Array
from .._core import ValidationError, number_lines
from .._splines.archive import read
from ..convert._pose_files import TUM, tum_rows, write_tum_rows
from ._messages import (
    STANDARD,
    Problem,
    Progress,
    Source,
    alternatives,
    counted,
    did_you_mean,
    first_duplicate,
    listed,
    refuse,
    say,
    written,
)

Place = Callable[[int], str]

RE, IM = "_re", "_im"
UNITS = ("s", "ms", "us", "ns")
EXACT = 2**53
"""Whole numbers up to here are exact as floating-point numbers."""
MISSING = ("", "nan", "na", "null")
"""Texts of missing numbers, in any case."""
_SKIP = "; symspline fit --skipna omits such rows"
FIRST = 50
"""Rows that are searched for numbers and dates, as the first ones may hold units or be empty."""

# 2021-08-29, 29.8.2021, 8/29/21, 20210829T1655, 16:55, 29 Aug 2021, Aug 29, 2021
_MONTH = r"(?:jan|feb|mar|apr|may|jun|jul|aug|sep|oct|nov|dec)[a-z]*"
_DATE_LIKE = re.compile(
    r"(?:(?:mon|tue|wed|thu|fri|sat|sun)[a-z]*[,.]? +)?"
    r"(?:\d{4}([-/.])\d{1,2}\1\d{1,2}(?!\d)|\d{1,2}([-/.])\d{1,2}\2(?:\d{4}|\d{2})(?!\d|\.\d)|\d{8}T\d{4}|\d{1,2}:\d{2}(?!\d)"
    rf"|\d{{1,2}}[-. ]*{_MONTH}[-. ,]*\d{{2}}|{_MONTH}[-. ]*\d{{1,2}}\b)",
    re.IGNORECASE | re.ASCII,
)
_UTC = re.compile(r" *(UTC|GMT)$", re.IGNORECASE)
_PACKED_DAY = re.compile(r"(19|20)\d\d(0[1-9]|1[0-2])(0[1-9]|[12]\d|3[01])", re.ASCII)


# ---- cells ----


def is_number(text: str) -> bool:
    """Whether a text is a number, without the underscores and numerals of other scripts that Python accepts."""
    with suppress(ValueError):
        float(text)
        return "_" not in text and text.strip().isascii()
    return False


def number(text: str) -> float:
    """Read a number in an option."""
    if not is_number(text):
        raise ValueError
    return float(text)


# Exponents of floating-point numbers are smaller.
_EXPONENT = 400


def duration(text: str, option: str) -> tuple[Decimal, str]:
    """Split ``"10min"`` into 10 and ``"min"``."""
    try:
        parts = parts_of_duration(text)
    except InvalidOperation:
        raise Problem(f"{option} {text}: the exponent is too large") from None
    if parts is None:
        raise Problem(
            f"{option} {text}: a duration is a number such as 0.5, or one with a unit such as 10min; "
            f"units are {', '.join(NANOSECONDS)}"
        )
    count, unit = parts
    refuse(
        f"{option} {text}: ",
        (count == 0, "it must be larger than zero"),
        (abs(count.adjusted()) > _EXPONENT, f"that is too {'long' if count > 1 else 'short'}"),
    )
    return count, unit


def _holds_dates(cells: Sequence[str]) -> bool:
    """Whether the first cell that looks like a date or a number looks like a date, such as 20210829."""
    first = next((cell for cell in cells if is_number(cell) or _DATE_LIKE.match(cell)), "")
    return _DATE_LIKE.match(first) is not None or _PACKED_DAY.fullmatch(first) is not None


class Rows(NamedTuple):
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


@dataclass
class Table:
    """Named columns of a file.

    Attributes
    ----------
    path : Source
    columns : dict
        For every name an array of numbers or dates, or texts as an array or a series of pandas.
    place : callable
        Describes the position of a row.
    groups : mapping
        The columns of each array of an NPZ file.
    is_utc : mapping
        Whether a column of dates has the time zone UTC; empty if it is unknown.
    texts : callable or None
        Returns the texts of a column of numbers as they stand in the file. None for files that are not text.
    comma : bool
        Whether numbers may have a decimal comma.
    tracks : str or None
        Column of the names of the tracks, if the format has tracks and the file has several.
    holds : {"", "positions", "poses"}
        Content of all files of this format: longitudes and latitudes, or poses.
    time_format : str or None
        Format of dates, as for ``datetime.strptime``. None for ISO 8601 and RFC 2822.
    """

    path: Source
    columns: dict[str, Array]
    place: Place = "row {} (counted from 0)".format
    groups: Mapping[str, list[str]] = field(default_factory=dict)
    is_utc: Mapping[str, bool] = field(default_factory=dict)
    texts: Callable[[str], list[str]] | None = None
    comma: bool = False
    tracks: str | None = None
    holds: str = ""
    time_format: str | None = None

    def __post_init__(self) -> None:
        """Find the columns of numbers and of dates."""
        self.names = list(self.columns)
        self.height = len(next(iter(self.columns.values()))) if self.columns else 0
        self.numeric = [name for name in self.names if name and self._is_numeric(name)]
        self.dates = [name for name in self.names if self._is_dated(name)]

    def _is_numeric(self, name: str) -> bool:
        column = self.columns[name]
        if _is_text(column):
            return is_number(next(filter(None, self._plain(name, FIRST)), ""))
        return column.dtype.kind in "biu" or (column.dtype.kind == "f" and not np.isnan(column).all())

    def _is_dated(self, name: str) -> bool:
        column = self.columns[name]
        if _is_text(column):
            return _holds_dates(self._plain(name, FIRST))
        whole = self.texts is not None and column.dtype.kind in "iu" and column.size
        return column.dtype.kind in "mM" or bool(whole and _holds_dates([str(column[0])]))

    def require(self, name: str) -> str:
        """Return the name if there is such a column."""
        near = did_you_mean(name, [*self.groups] or self.names)
        refuse(self.path, (name not in self.names, f" has no column {name!r}; {near}"))
        return name

    def expand(self, name: str) -> list[str]:
        """Return the columns of a name: itself, those of an array, or the two parts of complex numbers."""
        if name in self.groups or name in self.names:
            return self.groups.get(name, [name])
        both = [name + RE, name + IM]
        present = [part for part in both if part in self.names]
        if len(present) == 1:
            missing = both[present == both[:1]]
            raise Problem(f"{self.path} has a column {present[0]!r}, but no {missing!r}; a complex number needs both")
        return present or [self.require(name)]

    def cells(self, name: str, rows: int | None = None) -> list[str]:
        """Return the texts of a column, or of its first rows, without blanks at their ends; empty if missing."""
        column = self.columns[name][:rows]
        if _is_text(column):
            cells = column.tolist()
            with suppress(TypeError):
                return list(map(str.strip, cells))
            # A text such as NA is missing among numbers, but may be a name.
            if self.texts is None or rows is not None:
                return ["" if cell != cell else str(cell).strip() for cell in cells]
        return self.texts(name)[:rows] if self.texts is not None else column.astype(np.str_).tolist()

    def _plain(self, name: str, rows: int | None = None) -> list[str]:
        """Return the same with decimal points."""
        cells = self.cells(name, rows)
        return [cell.replace(",", ".") for cell in cells] if self.comma else cells

    def labels(self, name: str) -> list[str]:
        """Return a column as texts, none of which is empty."""
        texts = self.cells(name)
        if "" in texts:
            raise self._problem(name, texts.index(""), "is empty")
        return texts

    def codes(self, name: str) -> NDArray[np.intp]:
        """Return a number from 0 on for every distinct value of a column, none of which is missing."""
        column = self.columns[name]
        return codes_of(column.tolist() if column.dtype.kind in "biu" else self.labels(name))

    def without_empty(self, names: Sequence[str]) -> Table:
        """Return the rows in which none of these columns is missing."""
        kept = ~np.any([self.missing(name) for name in names], axis=0)
        refuse(self.path, (not kept.any(), f" has no row in which {' and '.join(names)} are all given"))
        return self.rows_where(kept)

    def rows_where(self, mask: NDArray[np.bool_]) -> Table:
        """Return the rows at which a mask is True."""
        kept = np.flatnonzero(mask)
        columns = {name: column.take(kept) for name, column in self.columns.items()}
        place, texts = self.place, self.texts
        left = None if texts is None else lambda name: np.array(texts(name), object)[kept].tolist()
        return replace(self, columns=columns, place=lambda row: place(int(kept[row])), texts=left)

    def without_values(self, words: Sequence[str]) -> Table:
        """Return the table with missing values in place of these numbers or texts."""
        values = [float(word) for word in words if is_number(word)]
        columns: dict[str, Array] = {}
        for name, column in self.columns.items():
            if _is_text(column):
                cells = self.cells(name)
                gone = np.array([cell in words or (is_number(cell) and float(cell) in values) for cell in cells])
                columns[name] = np.where(gone, "", np.asarray(column, object)) if gone.any() else column
            else:
                gone = np.isin(column, values) if column.dtype.kind in "iuf" and values else np.zeros(len(column), bool)
                columns[name] = np.where(gone, np.nan, column) if gone.any() else column
        return replace(self, columns=columns)

    def points(self, others: Sequence[str | None]) -> list[str]:
        """Return the columns of the points if none are named: all numeric columns but the others."""
        return self.groups.get("points") or [name for name in self.numeric if name not in others]

    def shown(self, name: str) -> Array:
        """Return the values of a column, as numbers if they all are, to describe them."""
        column = self.columns[name]
        if not _is_text(column):
            return np.asarray(column)
        if name in self.numeric:
            with suppress(Problem):
                return self._parsed(name)
        return np.array(self.cells(name))

    def missing(self, name: str) -> NDArray[np.bool_]:
        """Return which entries of a column are empty or NaN."""
        column = self.columns[name]
        if _is_text(column):
            return np.array([text.lower() in MISSING for text in self.cells(name)])
        return np.asarray(column != column)

    def read(self, names: Sequence[str], time: str | None, label: str | None, unix: str | None = None) -> Rows:
        """Read some columns as numbers, one as times and one as labels.

        Numeric times count the unit `unix` since 1970, if it is given.
        """
        columns = [self.numbers(name) for name in names]
        if self.comma:
            points = [name for name in names if self.columns[name].dtype.kind == "f"]
            commas = [name for name in names if _is_text(self.columns[name])]
            point = next((name for name in points if (self.columns[name] % 1 != 0).any()), None)
            mixed = f": numbers have decimal points in column {point!r}, and decimal commas in column "
            refuse(self.path, (point and commas, f"{mixed}{''.join(commas[:1])!r}; use one of them"))
        refuse("--unix", (unix and time is None, " is for times that are numbers, and there is no column of times"))
        times, utc = self.times(time, unix) if time is not None else (np.empty(0), False)
        labels = self.labels(label) if label is not None else None
        given = [*columns, *([times] if time is not None else []), *([labels] if labels is not None else [])]
        lengths = sorted(set(map(len, given)))
        differ = f": arrays differ in length: {' and '.join(map(str, lengths))}"
        refuse(self.path, (len(lengths) > 1, differ), (lengths == [0], " has no rows"))
        return Rows(np.stack(columns, axis=1) if columns else np.empty((0, 0)), times, utc, labels, self.place)

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return a column of finite numbers."""
        column = self.columns[name]
        if _is_text(column):
            values = self._parsed(name)
        elif column.dtype.kind in "biuf":
            values = column.astype(np.float64)
        else:
            raise Problem(f"{self.path}: column {name!r} holds {column.dtype}, not numbers")
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            value = values[bad[0]]
            problem = f"is empty or NaN{_SKIP}" if np.isnan(value) else f"holds {value}, which is not a finite number"
            raise self._problem(name, int(bad[0]), problem)
        return np.asarray(values)

    def _parsed(self, name: str) -> NDArray[np.float64]:
        cells = self._plain(name)
        if self.comma:
            marks = [
                next((cell for cell in self.cells(name) if mark in cell and is_number(cell.replace(",", "."))), None)
                for mark in ".,"
            ]
            mixed = (
                f": column {name!r} has decimal points and decimal commas, {marks[0]} and {marks[1]}; use one of them"
            )
            refuse(self.path, (None not in marks, mixed))
        bad = next((row for row, cell in enumerate(cells) if cell and not is_number(cell)), None)
        if bad is not None:
            units = "; if this line holds units, remove it" if bad == 0 else ""
            raise self._problem(name, bad, f"holds {self.cells(name)[bad]!r}, which is not a number{units}")
        return np.fromiter((float(cell or "nan") for cell in cells), np.float64, len(cells))

    def times(self, name: str, unix: str | None = None) -> tuple[Array, bool | None]:
        """Return a column as times, and whether they are dates in UTC, None if this is unknown."""
        column = self.columns[name]
        numeric = name in self.numeric or not (_is_text(column) or column.dtype.kind == "M")
        if self.time_format is not None:
            return self._formatted(name, self.time_format)
        refuse("--unix is for times that are numbers", (unix and not numeric, f"; column {name!r} has dates"))
        if numeric:
            times = self._counted(name)
            return (times, False) if unix is None else (self._since_1970(name, times, unix), True)
        if column.dtype.kind == "M":
            if np.isnat(column).any():
                raise self._problem(name, int(np.isnat(column).argmax()), "holds no time")
            return column, self.is_utc.get(name)
        return self._dates(name)

    def _counted(self, name: str) -> Array:
        """Return times that are numbers. Whole numbers that are not exact as floating-point numbers stay whole."""
        column = self.columns[name]
        if column.dtype.kind in "iu" and column.size:
            large = max(abs(int(column.min())), abs(int(column.max()))) > EXACT
            return np.asarray(column if large else column.astype(np.float64))
        values = self.numbers(name)
        if np.abs(values).max(initial=0.0) > EXACT:
            with suppress(ValueError, OverflowError):
                return np.array([int(cell) for cell in self._plain(name)], np.int64)
        return values

    def _since_1970(self, name: str, times: Array, unit: str) -> Array:
        """Return dates in UTC for numbers that count a unit since 1970; fractions in a file of text are exact."""
        scale = NANOSECONDS[unit]
        whole = times if times.dtype.kind in "iu" else np.floor(times)
        limit = np.iinfo(np.int64).max // scale
        far = np.flatnonzero((whole > limit) | (whole < -limit))
        if far.size:
            place = f"{self.path}, {self.place(int(far[0]))}"
            raise Problem(f"{place}: --unix {unit}: time {times[far[0]]} is too far from 1970; is it in ns?")
        fraction = 0
        if (whole != times).any():
            if self.texts is not None or _is_text(self.columns[name]):
                with suppress(InvalidOperation):
                    exact = [int((Decimal(cell) * scale).to_integral_value()) for cell in self._plain(name)]
                    return np.array(exact, np.int64).astype("datetime64[ns]")
            # The accuracy of floating-point numbers is their spacing.
            digits = max(0, int(-np.log10(np.spacing(np.abs(times).max(initial=1.0)))))
            fraction = np.rint(np.round(times - whole, digits) * scale).astype(np.int64)
        return np.asarray((whole.astype(np.int64) * scale + fraction).astype("datetime64[ns]"))

    def _formatted(self, name: str, form: str) -> tuple[Array, bool]:
        """Return texts in a format of ``strptime`` as dates, in UTC if the format has a time zone."""
        _require("dates in a format", "cli", "pandas")
        import pandas as pd

        cells = self.labels(name)
        zoned = "%z" in form or form.endswith(("Z", "UTC", "GMT"))
        try:
            dates = pd.to_datetime(pd.Series(cells), format=form, errors="coerce", utc=zoned)
        except ValueError as error:
            raise Problem(f"--time-format {form}: {brief(error)}") from None
        wrong = np.flatnonzero(dates.isna())
        if wrong.size:
            row = int(wrong[0])
            raise self._problem(name, row, f"holds {cells[row]!r}, which does not match --time-format {form}")
        return (dates.dt.tz_convert(None) if zoned else dates).to_numpy(), zoned

    def _dates(self, name: str) -> tuple[Array, bool]:
        cells = self.labels(name)
        if cells and ISO_DATE.fullmatch(cells[0]) is None:
            cells = _in_iso(cells)
        with suppress(ValidationError):
            times, zone = times_of(cells, "time")
            if isinstance(times, np.ndarray):
                return times, zone == UTC_ZONE
        first = ISO_DATE.fullmatch(cells[0]) if cells else None
        for row, cell in enumerate(cells):
            match = ISO_DATE.fullmatch(cell)
            if match is None:
                what = (
                    "not a time: write 0.5, 2021-08-29 or 2021-08-29T16:55:00Z, or give the format of dates, such as "
                    "--time-format '%d.%m.%Y %H:%M'"
                )
            elif first is not None and (match["zone"] is None) != (first["zone"] is None):
                what = f"but {cells[0]!r} before; give all times a time zone, or none"
            else:
                with suppress(ValueError):
                    np.datetime64(match["body"])
                    continue
                what = "which is not a date of the calendar"
            raise self._problem(name, row, f"holds {cell!r}, {what}")
        raise Problem(f"{self.path}: column {name!r} has no times")

    def _problem(self, name: str, row: int, problem: str) -> Problem:
        return Problem(f"{self.path}, {self.place(row)}: column {name!r} {problem}")


def _in_iso(cells: Sequence[str]) -> list[str]:
    """Return dates such as ``"2021-08-29 16:55 UTC"`` or those of RFC 2822 in ISO 8601, and other texts as they are."""
    texts = [_UTC.sub("Z", cell) for cell in cells]
    if ISO_DATE.fullmatch(texts[0]):
        return texts
    with suppress(ValueError):
        return [parsedate_to_datetime(cell).isoformat() for cell in cells]
    return list(cells)


def codes_of(labels: Sequence[Any]) -> NDArray[np.intp]:
    """Return a number for every distinct label, in the order in which they first occur."""
    codes = {label: code for code, label in enumerate(dict.fromkeys(labels))}
    return np.fromiter(map(codes.__getitem__, labels), np.intp, len(labels))


def _is_text(column: Any) -> bool:
    return bool(column.dtype.kind == "O")


# ---- formats ----


def _require(what: str, extra: str, *libraries: str) -> None:
    """Raise `Problem` unless the libraries that an extra installs can be imported."""
    for name in libraries:
        try:
            import_module(name)
        except ImportError:
            raise Problem(f"{what} need {name}; install it with: pip install 'symspline[{extra}]'") from None


class Layout(NamedTuple):
    """The meaning of the columns that are written.

    Attributes
    ----------
    time : str
        Column of times.
    curve : str or None
        Column of the names of curves.
    lonlat : tuple of str or None
        Columns of longitude and latitude in degrees, and perhaps of the height.
    utc : bool
        Whether dates are in UTC.
    lines : bool
        Whether GeoJSON has one line per curve instead of points.
    """

    time: str
    curve: str | None
    lonlat: tuple[str, ...] | None
    utc: bool
    lines: bool = False


# ---- CSV ----

# The cells of a line ``sep=;``, with which Excel begins.
_SEPARATOR = ["sep=", ""]
_COMPLEX = re.compile(r"\(?[-+]?[\d.e]+([-+]?\d+)?([-+][\d.e]+([-+]\d+)?)?j\)?", re.ASCII)
_MOTIVE = "Format Version"
"""The first cell of an export of OptiTrack's Motive."""
_OF_MOTIVE = [*(f"Rotation {axis}" for axis in "XYZW"), *(f"Position {axis}" for axis in "XYZ")]
"""The columns of a pose in an export of one body."""
_EUROC = [f"p_RS_R_{axis}" for axis in "xyz"] + [f"q_RS_{axis}" for axis in "wxyz"]
"""The columns of a pose in the ground truth of the EuRoC data sets, without their units."""
_WRITTEN = 50_000
"""Rows that are written between two updates of the progress."""


def _read_csv(path: Source) -> Table:
    """Read text in UTF-8 or UTF-16 with cells separated by commas, semicolons, tabs or blanks.

    The first line names the columns. Blank lines are skipped, a line ``sep=;`` as well, and comments, which begin with
    #; the last comment above the numbers may name their columns. Between semicolons, numbers may have a decimal comma.
    Complex numbers such as ``(1+2j)``, as pandas writes them, become two columns.
    """
    mark, head, names, skipped = _heading(path)
    twice = first_duplicate([name for name in names if name])
    rows = _rows(path, mark, head)
    refuse(
        path,
        (not names, " is empty"),
        (all(is_number(name.replace(",", ".")) for name in names), ": the first line must name the columns, but "
         "holds numbers"),
        (twice is not None, f": the first line names two columns {twice!r}"),
        (next(rows, None) is None, " has no rows below the names of its columns"),
    )  # fmt: skip
    rows.close()
    missing = [word for text in MISSING for word in (text, text.upper(), text.title(), text.replace("nan", "NaN"))]
    frame = _frame(path, mark, names, skipped, head, keep_default_na=False, na_values=missing)
    columns: dict[str, Array] = {}
    for i, name in enumerate(names):
        if name:
            # Words such as true are texts.
            columns |= _converted(name, frame[i].astype(object) if frame[i].dtype.kind == "b" else frame[i])

    def texts(name: str) -> list[str]:
        if name not in names:
            return list(map(str, columns[name].tolist()))
        i = names.index(name)
        cells = _frame(path, mark, names, skipped, head, usecols=[i], dtype=str, na_filter=False)[i]
        return list(map(str.strip, cells.tolist()))

    def place(row: int) -> str:
        return f"line {next(islice(_rows(path, mark, head), row, None))[0]}"

    return _with_poses(Table(path, columns, place, texts=texts, comma=mark == ";"))


class _Heading(NamedTuple):
    """The separator of cells, the number of the row with the names, the names, and the numbers of rows to skip."""

    mark: str
    head: int
    names: list[str]
    skipped: list[int]


def _heading(path: Source) -> _Heading:
    """Find the names of the columns."""
    with path.open() as file:
        lines = list(islice(filter(bytes.strip, file), FIRST))
        file.seek(0)
        # Comments below the names are rare, and are searched for at once.
        later = b"\n#" in file.read()
    data = [line for line in lines if not line.startswith((b"#", b"sep="))]
    # Comments may have any marks.
    first = next(iter(data), b"")
    mark = max(",;\t", key=lambda mark: first.count(mark.encode()))
    if mark.encode() not in first and len(first.split()) > 1 and len({len(line.split()) for line in data[:3]}) == 1:
        mark = " "
    comments: list[tuple[int, list[str]]] = []
    for _, number, cells in _rows(path, mark, 0, comments=True):
        if cells[0] == _MOTIVE:
            return _heading_of_motive(path)
        if cells[0].lstrip().startswith("#"):
            name = cells[0].lstrip("# ")
            comments.append((number, [name, *cells[1:]] if name else cells[1:]))
            continue
        # Names have no numbers below a comment with as many cells.
        if comments and len(comments[-1][1]) == len(cells) and any(is_number(cell) for cell in cells):
            number, cells = comments[-1]
        skipped = list(range(number))
        if later:
            below = _rows(path, mark, number, comments=True)
            skipped += [row - 1 for _, row, cells in below if cells[0].lstrip().startswith("#")]
        return _Heading(mark, number, [name.strip() for name in cells], skipped)
    return _Heading(mark, 0, [], [])


def _heading_of_motive(path: Source) -> _Heading:
    """Find the columns of an export of Motive, whose bodies, quantities and axes have one row each."""
    above: list[list[str]] = []
    for _, number, cells in _rows(path, ",", 0):
        if cells[0] == "Frame":
            bodies = next((row for row in above if row[1] == "Name"), [])
            kinds = above[-1]
            several = len(set(filter(None, bodies[2:]))) > 1
            names = [
                " ".join(filter(None, [body if several else "", kind, axis]))
                for body, kind, axis in zip(bodies[2:], kinds[2:], cells[2:], strict=True)
            ]
            return _Heading(",", number, ["", "time", *names], list(range(number)))
        above.append(cells)
    raise Problem(f"{path}: an export of Motive has a row of names that begins with Frame; export it again as CSV")


def _with_poses(table: Table) -> Table:
    """Return a table of the EuRoC data sets or of Motive with its poses, and other tables as they are."""
    if set(_OF_MOTIVE) <= {*table.names}:
        return replace(table, groups={"points": _OF_MOTIVE}, holds="poses")
    time, *pose = table.names[:8] or [""]
    plain = [name.partition(" ")[0] for name in pose]
    if not time.startswith("timestamp") or plain != _EUROC or table.columns[time].dtype.kind != "i":
        return table
    columns = {**table.columns, time: table.columns[time].astype("datetime64[ns]")}
    return replace(table, columns=columns, is_utc={time: True}, groups={"points": pose}, holds="poses")


def _converted(name: str, column: Any) -> dict[str, Array]:
    """Return a column of pandas as an array of numbers, as those of its real and imaginary parts, or as texts."""
    if column.dtype.kind in "biufmM":
        return {name: column.to_numpy()}
    texts = column.astype(object) if column.dtype == "category" else column
    first = next((str(cell).strip() for cell in texts[:FIRST].tolist() if cell == cell), "")
    if _COMPLEX.fullmatch(first):
        with suppress(ValueError):
            values = np.array([complex("nan" if cell != cell else cell.strip()) for cell in texts.tolist()])
            return {name + RE: values.real, name + IM: values.imag}
    return {name: texts}


def _frame(path: Source, mark: str, names: Sequence[str], skipped: list[int], head: int, **options: Any) -> Any:
    """Read the rows that are not skipped by pandas; columns are numbered."""
    _require("CSV files", "cli", "pandas")
    import pandas as pd

    # Numbers are exact by default from this version on.
    exact = {} if tuple(map(int, pd.__version__.split(".")[:2])) >= (3, 1) else {"float_precision": "round_trip"}
    with path.open() as file, Progress("reading"), warnings.catch_warnings():
        # It would omit further cells of a line.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        try:
            return pd.read_csv(
                file, sep=r"\s+" if mark == " " else mark, header=None, names=range(len(names)), index_col=False,
                skiprows=skipped, skipinitialspace=True, low_memory=False, **exact, **options
            )  # fmt: skip
        except (pd.errors.ParserError, pd.errors.ParserWarning, UnicodeDecodeError) as error:
            problem = brief(error)
    for line, _, row in _rows(path, mark, head):
        if len(row) > len(names):
            named = f"{len(row)} cells, but the first line names {len(names)} column{'s' * (len(names) > 1)}"
            named += "; remove lines above the names, such as comments" if len(names) == 1 else ""
            raise Problem(f"{path}, line {line}: {named}")
    raise Problem(f"{path}: {problem}")


def _rows(path: Source, mark: str, head: int, comments: bool = False) -> Generator[tuple[int, int, list[str]]]:
    """Yield the line, the number and the cells of every row below the row ``head`` that is not blank.

    Blank rows and comments are counted; comments are yielded only if ``comments`` is True.
    """
    with path.open() as binary:
        text = io.TextIOWrapper(binary, encoding="utf-8-sig", newline="")
        lines: Iterable[str] = map(str.strip, text) if mark == " " else text
        reader = csv.reader(lines, delimiter=mark, skipinitialspace=True, strict=True)
        try:
            for number, row in enumerate(reader, 1):
                blank = row == _SEPARATOR or not (len(row) > 1 or "".join(row).strip())
                if number > head and not blank and (comments or not row[0].lstrip().startswith("#")):
                    yield reader.line_num, number, row
        except UnicodeDecodeError:
            raise Problem(f"{path} is not text in UTF-8; convert it, such as by iconv -f cp1252 -t utf-8") from None
        except csv.Error as error:
            raise Problem(f"{path}, line {reader.line_num}: {error}") from None
        finally:
            text.detach()


def _write_csv(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write numbers as the shortest text that reads back equal, and dates in ISO 8601."""
    file.write(_line(columns))
    total = max(map(len, columns.values()))
    with Progress("writing") as progress:
        for start in range(0, total, _WRITTEN):
            progress(start, total)
            cells = [_cells(values[start : start + _WRITTEN], layout.utc) for values in columns.values()]
            file.write("".join(f"{','.join(row)}\n" for row in zip(*cells, strict=True)).encode())


def _cells(values: Array, utc: bool) -> list[str]:
    if values.dtype.kind == "M":
        return _date_texts(values, utc)
    if values.dtype.kind == "f":
        return number_lines(values[:, None], ",").splitlines()
    if values.dtype.kind == "U":
        quoted = {text: _line([text]).decode().removesuffix("\n") for text in np.unique(values).tolist()}
        return [quoted[text] for text in values.tolist()]
    return list(map(str, values.tolist()))


def _date_texts(dates: Array, utc: bool) -> list[str]:
    """Return dates in ISO 8601, with a Z if they are in UTC."""
    return [text + "Z" * utc for text in np.datetime_as_string(dates).tolist()]


def _line(cells: Any) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()


# ---- NPZ ----

_ZONE = "time_zone"
"""The entry of an NPZ file with the time zone of its dates."""


def _read_npz(path: Source) -> Table:
    """Read an NPZ file, whose arrays have one entry per row.

    The entries of an array ``a`` with more axes are the columns ``a_0``, ``a_1``, … row by row; complex numbers are
    two columns ``a_0_re`` and ``a_0_im``.
    """
    with path.open() as file:
        refuse(path, (not zipfile.is_zipfile(file), " is not an NPZ file"))
        file.seek(0)
        with damage(path, "is damaged, or holds other objects than numbers"):
            arrays = read(file, lambda name: True)
    refuse(path, ("format" in arrays, " is a curve that was fitted already, not a table"))
    return _of_arrays(path, arrays)


def _of_arrays(path: Source, arrays: Mapping[str, Array]) -> Table:
    columns: dict[str, Array] = {}
    groups: dict[str, list[str]] = {}
    for key, array in arrays.items():
        if not array.ndim or array.dtype.kind not in "biufcMmU":
            continue
        entries = array.reshape(len(array), math.prod(array.shape[1:])).T
        entries = entries.astype(object) if array.dtype.kind == "U" else entries
        parts = {key if array.ndim == 1 else f"{key}_{i}": entry for i, entry in enumerate(entries)}
        if array.dtype.kind == "c":
            parts = {name + end: part for name, z in parts.items() for end, part in ((RE, z.real), (IM, z.imag))}
        groups[key] = [*parts]
        columns |= parts
    utc = _ZONE in arrays and arrays[_ZONE].shape == () and str(arrays[_ZONE]) == "UTC"
    return Table(path, columns, groups=groups, is_utc=dict.fromkeys(columns, True) if utc else {})


def _read_npy(path: Source) -> Table:
    """Read an array with the numbers of one point per row, or a structured array with named columns."""
    with path.open() as file, damage(path, "is damaged, or not an array of numbers"):
        array = np.lib.format.read_array(file, allow_pickle=False)
    names = array.dtype.names
    return _of_arrays(path, {"points": array} if names is None else {name: array[name] for name in names})


def _write_npy(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write a structured array."""
    table = np.empty(len(next(iter(columns.values()))), [(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        table[name] = column
    np.save(file, table)


def _write_npz(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write an NPZ file with one array per column and, for dates in UTC, the text ``time_zone``."""
    zone = {_ZONE: np.array("UTC")} if layout.utc and _ZONE not in columns else {}
    np.savez(file, **columns, **zone)  # type: ignore[arg-type]


# ---- Parquet ----


def _read_parquet(path: Source) -> Table:
    """Read a Parquet file. Empty cells are NaN, NaT or empty texts."""
    _require("Parquet files", "parquet", "pandas", "pyarrow")
    import pandas as pd
    from pyarrow import ArrowInvalid

    with path.open() as file:
        try:
            frame = pd.read_parquet(file)
        except (ArrowInvalid, OSError):
            raise Problem(f"{path} is damaged or not a Parquet file") from None
    zones = {name: getattr(frame[name].dtype, "tz", None) is not None for name in frame}
    columns: dict[str, Array] = {}
    for name, zoned in zones.items():
        columns |= _converted(name, frame[name].dt.tz_convert(None) if zoned else frame[name])
    return Table(path, columns, is_utc=zones)


def _write_parquet(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write a Parquet file; dates in UTC have this time zone."""
    _require("Parquet files", "parquet", "pandas", "pyarrow")
    import pandas as pd

    frame = pd.DataFrame(columns)
    for name in [name for name in columns if layout.utc and columns[name].dtype.kind == "M"]:
        frame[name] = frame[name].dt.tz_localize("UTC")
    frame.to_parquet(file, index=False)


# ---- TUM ----


class _Named(io.StringIO):
    """Text with the name that messages give it."""

    name = ""


def _read_tum(path: Source) -> Table:
    """Read a trajectory of the TUM RGB-D benchmark: lines of time, position and quaternion, its scalar last."""
    with path.open() as file:
        try:
            text = _Named(file.read().decode("utf-8-sig"))
        except UnicodeDecodeError:
            raise Problem(f"{path} is not text in UTF-8") from None
    text.name = str(path)
    try:
        rows, lines = tum_rows(text, missing=True)
    except ValidationError as error:
        kitti = "; KITTI's poses have 12: give --from kitti" if ": 12 numbers, but" in str(error) else ""
        raise Problem(f"{error}{kitti}") from None
    return Table(path, dict(zip(TUM, rows.T, strict=True)), lines.place, holds="poses")


def _write_tum(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write a TUM trajectory. The columns are the time, the position and the quaternion."""
    time, *pose = columns.values()
    if time.dtype.kind == "M" and (time < np.datetime64(0, "s")).any():
        raise Problem("times of a TUM trajectory are counted from 1970 on; these dates are earlier")
    text = io.TextIOWrapper(file, "utf-8", newline="\n")
    write_tum_rows(text, time, np.stack(pose, axis=1), f"# timestamp {' '.join(TUM[1:])}")
    text.detach()


# ---- KITTI ----

_MATRIX = [
    f"{name}{i}{j}" if name else f"t{'xyz'[i - 1]}"
    for i in (1, 2, 3)
    for name, j in (("r", 1), ("r", 2), ("r", 3), ("", 0))
]


def _read_kitti(path: Source) -> Table:
    """Read poses of KITTI's odometry benchmark, lines with the twelve numbers of [R | x], without times."""
    with path.open() as file:
        try:
            rows = np.loadtxt(file, ndmin=2)
        except ValueError as error:
            raise Problem(f"{path}: {error}") from None
    refuse(path, (rows.shape[1] != 12, f": a line of KITTI's poses has 12 numbers, not {rows.shape[1]}"))
    columns = dict(zip(_MATRIX, rows.T, strict=True))
    # Rotations come before positions, as in so:3 x r:3.
    names = sorted(columns, key=lambda name: name[0] == "t")
    return Table(path, {name: columns[name] for name in names}, lambda row: f"line {row + 1}", holds="poses")


def _write_kitti(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    raise Problem("KITTI's format has no times: write the poses as a TUM trajectory, .tum, or with symspline.poses")


# ---- JSON and GeoJSON ----

_TIME, _LON, _LAT, _HEIGHT, _TRACK = "time", "lon", "lat", "ele", "track"
# Properties of lines that hold the times of their points.
_LINE_TIMES = ("coordTimes", "times")
_LINES = "LineString", "MultiLineString"
_KINDS = "GeoJSON must be a collection of features that are points or lines"
_CUT = 10
"""Degrees of longitude up to which two segments, one on each side of the date line, are one track."""
_Row = dict[str, Any]


def _read_json(path: Source) -> Table:
    """Read a list of objects with one value per column, an object with one list per column, or JSON lines."""
    return _table(path, _json(path))


def _json(path: Source) -> Any:
    with path.open() as file:
        try:
            text = file.read().decode("utf-8-sig")
            try:
                return json.loads(text)
            except json.JSONDecodeError as error:
                if not error.msg.startswith("Extra data"):
                    raise
            return [_json_line(path, i, line) for i, line in enumerate(text.split("\n"), 1) if line.strip()]
        except (ValueError, RecursionError) as error:
            raise Problem(f"{path} is not JSON: {error}") from None


def _json_line(path: Source, number: int, line: str) -> Any:
    try:
        return json.loads(line)
    except ValueError as error:
        raise Problem(f"{path}, line {number} is not JSON: {error}") from None


def _table(path: Source, content: Any) -> Table:
    if isinstance(content, dict) and content and all(isinstance(values, list) for values in content.values()):
        return Table(path, {name: _values(values) for name, values in content.items()})
    shape = " is not a table: give a list of objects, one per row, or an object of lists, one per column"
    rows = isinstance(content, list) and content and all(isinstance(row, dict) for row in content)
    refuse(path, (not rows, shape))
    names = dict.fromkeys(name for row in content for name in row)
    return Table(path, {name: _values([row.get(name) for row in content]) for name in names})


def _values(values: list[Any]) -> Array:
    """Return numbers as an array, and other values as texts."""
    kinds = set(map(type, values)) - {type(None)}
    # Larger whole numbers are exact as texts only.
    if kinds and kinds <= {int, float} and all(type(value) is not int or abs(value) <= EXACT for value in values):
        return np.array([np.nan if value is None else value for value in values], np.float64)
    return np.array(["" if value is None else str(value) for value in values], object)


def _read_geojson(path: Source) -> Table:
    """Read a collection of features: points with properties, or lines with their times in ``coordTimes``.

    The name of a line is in the column ``track``, and heights are in the column ``ele``.
    """
    content = _json(path)
    points: list[_Row] = []
    lines: list[tuple[str, list[list[_Row]]]] = []
    try:
        features = content["features"] if content["type"] == "FeatureCollection" else [content]
        for number, feature in enumerate(features):
            properties = dict(feature.get("properties") or {})
            geometry = feature["geometry"]
            if geometry["type"] == "Point":
                points.append(_position(geometry["coordinates"]) | properties)
            else:
                refuse(path, (geometry["type"] not in _LINES, f": {_KINDS}, not {geometry['type']}"))
                lines.append((str(properties.get("name", number)), _parts(geometry, properties)))
    except (KeyError, TypeError, ValueError, AttributeError):
        raise Problem(f"{path}: {_KINDS}") from None
    return _with_tracks(path, points, lines)


def _parts(geometry: Any, properties: Mapping[str, Any]) -> list[list[_Row]]:
    """Return the points of a line, or of all parts of a MultiLineString, whose times may be one list per part."""
    whole = geometry["type"] == "LineString"
    parts = [list(map(_position, part)) for part in ([geometry["coordinates"]] if whole else geometry["coordinates"])]
    times = next((properties[name] for name in _LINE_TIMES if name in properties), None)
    if times is None:
        return parts
    times = times if whole or not isinstance(times[0], list) else [time for part in times for time in part]
    stamps = iter([{_TIME: time} for time, _ in zip(times, [row for part in parts for row in part], strict=True)])
    return [[next(stamps) | row for row in part] for part in parts]


def _with_tracks(path: Source, points: list[_Row], tracks: Sequence[tuple[str, list[list[_Row]]]]) -> Table:
    """Return the table of single points and of the points of tracks, with names that distinguish the tracks.

    Every segment of a track is a track of its own, except that tracks which were cut at the date line, as RFC 7946
    recommends, are whole again. Segments of one point, which is not a curve, are omitted.
    """
    named = []
    for name, parts in tracks:
        segments: list[list[_Row]] = []
        for part in filter(None, parts):
            if segments and _across_date_line(segments[-1][-1], part[0]):
                # The point on the date line may belong to both parts.
                segments[-1] += part[1:] if _same_place(segments[-1][-1], part[0]) else part
            else:
                segments.append(list(part))
        names = [name] if len(segments) == 1 else [f"{name}/{i}" for i in range(1, len(segments) + 1)]
        named += list(zip(names, segments, strict=True))
    single = [name for name, segment in named if len(segment) == 1]
    if 0 < len(single) < len(named):
        say(f"{path}: {counted(len(single), 'track')} of one point omitted: {listed(single)}")
        named = [pair for pair in named if len(pair[1]) > 1]
    rows, taken = list(points), set[str]()
    for name, segment in named:
        label = next(text for text in chain([name], map(f"{name} ({{}})".format, count(2))) if text not in taken)
        taken.add(label)
        rows += [row | {_TRACK: label} for row in segment]
    refuse(path, (not rows, " has no tracks with points"))
    return replace(_table(path, rows), tracks=_TRACK if len(named) > 1 else None, holds="positions")


def _across_date_line(last: _Row, first: _Row) -> bool:
    """Whether the shorter way from one position to another crosses the date line, and is short."""
    return abs(abs(float(last[_LON]) - float(first[_LON])) - 360) <= _CUT


def _same_place(last: _Row, first: _Row) -> bool:
    return abs(last[_LON]) == abs(first[_LON]) == 180 and last == first | {_LON: last[_LON]}


def _position(coordinates: Any) -> _Row:
    lon, lat, *height = coordinates
    return {_LON: lon, _LAT: lat} | ({_HEIGHT: height[0]} if height else {})


def _lists(columns: Mapping[str, Array], layout: Layout) -> dict[str, list[Any]]:
    """Return columns as lists of numbers and texts; NaN becomes None."""
    return {
        # NaN is not equal to itself.
        name: _date_texts(x, layout.utc) if x.dtype.kind == "M" else [v if v == v else None for v in x.tolist()]
        for name, x in columns.items()
    }


def _write_json(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write a list of objects, one per row and line."""
    rows = zip(*_lists(columns, layout).values(), strict=True)
    lines = ",\n".join(json.dumps(dict(zip(columns, row, strict=True)), ensure_ascii=False) for row in rows)
    file.write(f"[\n{lines}\n]\n".encode())


def _write_json_lines(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write one object per line."""
    for row in zip(*_lists(columns, layout).values(), strict=True):
        file.write(json.dumps(dict(zip(columns, row, strict=True)), ensure_ascii=False).encode() + b"\n")


def _write_geojson(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write a collection of points, one per row and line, whose other columns are properties, or of lines."""
    names = _lonlat(columns, layout, "GeoJSON")
    values = _lists(columns, layout)
    places = list(zip(*map(values.pop, names), strict=True))
    features = [json.dumps(line) for line in _lines(places, values, layout)] if layout.lines else []
    for place, *others in zip(places, *values.values(), strict=True) if not layout.lines else ():
        geometry = {"type": "Point", "coordinates": place}
        properties = dict(zip(values, others, strict=True))
        features.append(json.dumps({"type": "Feature", "properties": properties, "geometry": geometry}))
    collection = ",\n".join(features)
    file.write(f'{{"type": "FeatureCollection", "features": [\n{collection}\n]}}\n'.encode())


def _lines(places: list[Any], values: Mapping[str, list[Any]], layout: Layout) -> list[dict[str, Any]]:
    """Return one line per curve with its times and other columns as lists, cut where it crosses the date line."""
    labels = [""] * len(places) if layout.curve is None else values[layout.curve]
    features = []
    for label in dict.fromkeys(labels):
        rows = [row for row, name in enumerate(labels) if name == label]
        cuts = [i + 1 for i in range(len(rows) - 1) if abs(places[rows[i]][0] - places[rows[i + 1]][0]) > 180]
        parts = [rows[start:end] for start, end in pairwise([0, *cuts, len(rows)])]

        def of(column: Sequence[Any], parts: Sequence[Sequence[int]] = parts) -> Any:
            lists = [[column[row] for row in part] for part in parts]
            return lists[0] if len(lists) == 1 else lists

        properties: dict[str, Any] = {} if layout.curve is None else {"name": label}
        properties[_LINE_TIMES[0]] = of(values[layout.time])
        others = [name for name in values if name not in (layout.time, layout.curve)]
        properties |= {name: of(values[name]) for name in others}
        kind = _LINES[len(parts) > 1]
        geometry = {"type": kind, "coordinates": of(places)}
        features.append({"type": "Feature", "properties": properties, "geometry": geometry})
    return features


def _lonlat(columns: Mapping[str, Array], layout: Layout, what: str) -> tuple[str, ...]:
    if layout.lonlat is None:
        raise Problem(f"{what} has longitude and latitude: write it for curves on sphere:2, with --lonlat")
    refuse("", (layout.lonlat[0] not in columns, f"{what} needs the points beside their derivatives: give --nu 0,1"))
    return layout.lonlat


# ---- GPX ----


def _read_gpx(path: Source) -> Table:
    """Read the time, longitude, latitude and height of all points of a GPX file, and the name of their track."""
    _require("GPX files", "gpx", "gpxpy")
    import gpxpy.gpx

    with path.open() as file:
        try:
            gpx = gpxpy.parse(file.read().decode("utf-8-sig"))
        except (UnicodeDecodeError, ValueError, gpxpy.gpx.GPXException) as error:
            raise Problem(f"{path} is damaged or not a GPX file: {error}") from None
    tracks = []
    for number, track in enumerate(gpx.tracks, 1):
        parts = [[_gpx_row(point) for point in segment.points] for segment in track.segments]
        tracks.append((track.name or str(number), parts))
    return _with_tracks(path, [], tracks)


def _gpx_row(point: Any) -> _Row:
    # Times of GPX are in UTC, also those without a Z.
    time = point.time and (point.time if point.time.tzinfo else point.time.replace(tzinfo=UTC)).astimezone(UTC)
    row = {_TIME: time and time.isoformat(), _LON: point.longitude, _LAT: point.latitude, _HEIGHT: point.elevation}
    return {name: value for name, value in row.items() if value is not None}


def _write_gpx(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write one track per curve."""
    _require("GPX files", "gpx", "gpxpy")
    from gpxpy import gpx

    lon, lat, *height = _lonlat(columns, layout, "GPX")
    rates = [name for name in columns if name.endswith(("_d1", "_d2"))]
    dates = columns[layout.time]
    refuse(
        "",
        (rates, "GPX has positions and no derivatives; write those to a .csv, .npz or .parquet file"),
        (dates.dtype.kind != "M", "GPX files have dates, but the times of these curves are numbers"),
    )
    times = dates.astype("datetime64[us]").tolist()
    names = columns[layout.curve].tolist() if layout.curve is not None else [None] * len(times)
    whole, tracks = gpx.GPX(), {}
    heights = columns[height[0]].tolist() if height else [None] * len(times)
    positions = zip(columns[lon].tolist(), columns[lat].tolist(), heights, strict=True)
    for name, time, (x, y, z) in zip(names, times, positions, strict=True):
        if name not in tracks:
            track, segment = gpx.GPXTrack(name=name), gpx.GPXTrackSegment()
            track.segments.append(segment)
            whole.tracks.append(track)
            tracks[name] = segment
        tracks[name].points.append(gpx.GPXTrackPoint(y, x, z, time.replace(tzinfo=UTC)))
    file.write(whole.to_xml().encode())


# ---- the list of formats ----


class _Format(NamedTuple):
    read: Callable[[Source], Table]
    write: Callable[[BinaryIO, Mapping[str, Array], Layout], None]
    endings: tuple[str, ...]
    text: bool = True


_FORMATS = {
    "csv": _Format(_read_csv, _write_csv, ("csv", "tsv")),
    "npz": _Format(_read_npz, _write_npz, ("npz",), False),
    "parquet": _Format(_read_parquet, _write_parquet, ("parquet",), False),
    "npy": _Format(_read_npy, _write_npy, ("npy",), False),
    "json": _Format(_read_json, _write_json, ("json",)),
    "jsonl": _Format(_read_json, _write_json_lines, ("jsonl", "ndjson")),
    "geojson": _Format(_read_geojson, _write_geojson, ("geojson",)),
    "gpx": _Format(_read_gpx, _write_gpx, ("gpx",)),
    "tum": _Format(_read_tum, _write_tum, ("tum", "txt")),
    "kitti": _Format(_read_kitti, _write_kitti, ()),
}
TABLES = tuple(_FORMATS)
CURVES = ("npz",)


def format_of(path: Path, given: str | None, known: Sequence[str] = TABLES, what: str = "a table") -> str:
    """Return the format of a file: the given one, that of its ending, or the first one for streams and pipes."""
    if given is not None or path == STANDARD or path.is_fifo():
        return given or known[0]
    name = PurePath(path.name.lower())
    unpacked = PurePath(name.stem) if name.suffix == ".gz" else name
    formats = {f".{end}": form for form in known for end in _FORMATS[form].endings}
    form = formats.get(unpacked.suffix, "")
    wrong = not form or (unpacked != name and is_binary(form))
    refuse(path, (wrong, f": the name of {what} must end in {alternatives([*formats])}"))
    return form


def is_binary(form: str) -> bool:
    """Whether files of this format are not text."""
    return not _FORMATS[form].text


def endings() -> str:
    """List the endings of names of tables for a help text."""
    return ", ".join(f".{end}" for form in _FORMATS.values() for end in form.endings)


def open_table(path: Path, given: str | None = None) -> Table:
    """Read the table in a file whose format is the given one or that of its ending."""
    source = Source(path, format_of(path, given))
    return _FORMATS[source.format].read(source)


def write_table(path: Path, form: str, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write columns of equal length to a file."""
    with written(path) as file:
        _FORMATS[form].write(file, columns, layout)

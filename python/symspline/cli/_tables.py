"""Tables: columns of numbers, dates and texts in files, and the times, numbers and labels in their rows."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from decimal import Decimal, InvalidOperation
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.input import ISO_DATE, UTC_ZONE, times_of
from .._base.time import NANOSECONDS
from .._core import ValidationError
from ._files import Source
from ._messages import Problem, did_you_mean, refuse

Array = NDArray[Any]
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
    r"\d{4}([-/.])\d{1,2}\1\d{1,2}(?!\d)|\d{1,2}([-/.])\d{1,2}\2(?:\d{4}|\d{2})(?!\d|\.\d)|\d{8}T\d{4}|\d{1,2}:\d{2}(?!\d)"
    rf"|\d{{1,2}}[-. ]*{_MONTH}[-. ,]*\d{{2}}|{_MONTH}[-. ]*\d{{1,2}}\b",
    re.IGNORECASE | re.ASCII,
)
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
    """

    path: Source
    columns: dict[str, Any]
    place: Place = "row {} (counted from 0)".format
    groups: Mapping[str, list[str]] = field(default_factory=dict)
    is_utc: Mapping[str, bool] = field(default_factory=dict)
    texts: Callable[[str], list[str]] | None = None
    comma: bool = False

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
        found = [part for part in both if part in self.names]
        if len(found) == 1:
            missing = both[found == both[:1]]
            raise Problem(f"{self.path} has a column {found[0]!r}, but no {missing!r}; a complex number needs both")
        return found or [self.require(name)]

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
        kept = np.flatnonzero(~np.any([self.missing(name) for name in names], axis=0))
        refuse(self.path, (not kept.size, f" has no row in which {' and '.join(names)} are all given"))
        columns = {name: column.take(kept) for name, column in self.columns.items()}
        place, texts = self.place, self.texts
        left = None if texts is None else lambda name: np.array(texts(name), object)[kept].tolist()
        return replace(self, columns=columns, place=lambda row: place(int(kept[row])), texts=left)

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
            found = f"is empty or NaN{_SKIP}" if np.isnan(value) else f"holds {value}, which is not a finite number"
            raise self._problem(name, int(bad[0]), found)
        return np.asarray(values)

    def _parsed(self, name: str) -> NDArray[np.float64]:
        cells = self._plain(name)
        bad = next((row for row, cell in enumerate(cells) if cell and not is_number(cell)), None)
        if bad is not None:
            units = "; if this line holds units, remove it" if bad == 0 else ""
            raise self._problem(name, bad, f"holds {self.cells(name)[bad]!r}, which is not a number{units}")
        return np.fromiter((float(cell or "nan") for cell in cells), np.float64, len(cells))

    def times(self, name: str, unix: str | None = None) -> tuple[Array, bool | None]:
        """Return a column as times, and whether they are dates in UTC, None if this is unknown."""
        column = self.columns[name]
        numeric = name in self.numeric or not (_is_text(column) or column.dtype.kind == "M")
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
        fraction: Any = 0
        if (whole != times).any():
            if self.texts is not None or _is_text(self.columns[name]):
                with suppress(InvalidOperation):
                    exact = [int((Decimal(cell) * scale).to_integral_value()) for cell in self._plain(name)]
                    return np.array(exact, np.int64).astype("datetime64[ns]")
            # The accuracy of floating-point numbers is their spacing.
            digits = max(0, int(-np.log10(np.spacing(np.abs(times).max(initial=1.0)))))
            fraction = np.rint(np.round(times - whole, digits) * scale).astype(np.int64)
        return np.asarray((whole.astype(np.int64) * scale + fraction).astype("datetime64[ns]"))

    def _dates(self, name: str) -> tuple[Array, bool]:
        cells = self.labels(name)
        with suppress(ValidationError):
            times, zone = times_of(cells, "time")
            if isinstance(times, np.ndarray):
                return times, zone == UTC_ZONE
        first = ISO_DATE.fullmatch(cells[0]) if cells else None
        for row, cell in enumerate(cells):
            match = ISO_DATE.fullmatch(cell)
            if match is None:
                what = "not a time: write 0.5, 2021-08-29 or 2021-08-29T16:55:00Z"
            elif first is not None and (match["zone"] is None) != (first["zone"] is None):
                what = f"but {cells[0]!r} before; give all times a time zone, or none"
            else:
                with suppress(ValueError):
                    np.datetime64(match["body"])
                    continue
                what = "which is not a date of the calendar"
            raise self._problem(name, row, f"holds {cell!r}, {what}")
        raise Problem(f"{self.path}: column {name!r} has no times")

    def _problem(self, name: str, row: int, found: str) -> Problem:
        return Problem(f"{self.path}, {self.place(row)}: column {name!r} {found}")


def codes_of(labels: Sequence[Any]) -> NDArray[np.intp]:
    """Return a number for every distinct label, in the order in which they first occur."""
    codes = {label: code for code, label in enumerate(dict.fromkeys(labels))}
    return np.fromiter(map(codes.__getitem__, labels), np.intp, len(labels))


def _is_text(column: Any) -> bool:
    return bool(column.dtype.kind == "O")

"""Tables: columns of numbers, dates and texts, and their rows as numbers, times and labels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._messages import Problem, did_you_mean, refuse
from ._streams import Source
from ._times import EXACT, first_date, from_unix, is_number, numbers, parse_times

Array = NDArray[Any]
Place = Callable[[int], str]

RE, IM = "_re", "_im"
_MISSING = {"", "nan", "na", "null"}
"""Texts of missing numbers."""
_SKIP = "; symspline fit --skipna omits such rows"
FIRST = 50
"""Rows that are searched for numbers and dates, as the first ones may hold units or be empty."""


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


@dataclass(frozen=True)
class Layout:
    """The meaning of the columns that are written.

    Attributes
    ----------
    time : str
        Column of times.
    curve : str or None
        Column of the names of curves.
    lonlat : tuple of str or None
        Columns of longitude and latitude in degrees.
    utc : bool
        Whether dates are in UTC.
    """

    time: str
    curve: str | None
    lonlat: tuple[str, ...] | None
    utc: bool


class Texts:
    """A column of text, as a list or, in large files, as an array of pyarrow.

    Parameters
    ----------
    cells : list of str or pyarrow.ChunkedArray
        One text per row.
    comma : bool
        Whether numbers may have a decimal comma.
    """

    def __init__(self, cells: Any, comma: bool = False) -> None:
        self._cells, self._comma = cells, comma

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self._cells)

    def tolist(self, rows: int | None = None) -> list[str]:
        """Return all texts, or those of the first rows, without blanks at their ends."""
        cells = self._cells[:rows] if rows is not None else self._cells
        return list(map(str.strip, cells if isinstance(cells, list) else cells.to_pylist()))

    def plain(self, rows: int | None = None) -> list[str]:
        """Return texts with decimal points, from which numbers are read."""
        cells = self.tolist(rows)
        return [cell.replace(",", ".") for cell in cells] if self._comma else cells

    @property
    def is_numeric(self) -> bool:
        """Whether the first text that is not empty is a number."""
        return is_number(next(filter(None, self.plain(FIRST)), ""))

    def rows(self, kept: NDArray[np.intp]) -> Texts:
        """Return the texts of some rows."""
        cells = [self._cells[i] for i in kept] if isinstance(self._cells, list) else self._cells.take(kept)
        return Texts(cells, self._comma)

    def converted(self) -> NDArray[np.float64] | None:
        """Return an array of pyarrow as numbers, NaN where it is empty; None if another cell is not a number."""
        if isinstance(self._cells, list):
            return None
        import pyarrow as pa
        from pyarrow import compute

        cells = compute.utf8_trim_whitespace(self._cells)
        if self._comma:
            cells = compute.replace_substring(cells, ",", ".")
        try:
            found = compute.replace_substring_regex(cells, "^$", "nan").cast(pa.float64())
        except pa.ArrowInvalid:
            return None
        # The conversion of pyarrow would import pandas.
        chunks = [chunk for chunk in found.chunks if len(chunk)]
        parts = [np.frombuffer(own.buffers()[1])[own.offset : own.offset + len(own)] for own in chunks]
        return np.concatenate([np.empty(0), *parts])


class Table:
    """Named columns of a file.

    Attributes
    ----------
    path : Source
    columns : dict
        For every name an array of numbers or dates, or `Texts`.
    groups : mapping
        The columns of each array of an NPZ file.
    is_utc : mapping
        Whether a column of dates has the time zone UTC; empty if it is unknown.
    place : callable
        Describes the position of a row.
    height : int
        Number of rows.
    """

    def __init__(
        self,
        path: Source,
        columns: dict[str, Any],
        place: Place = "row {} (counted from 0)".format,
        groups: Mapping[str, list[str]] | None = None,
        is_utc: Mapping[str, bool] | None = None,
    ) -> None:
        self.path, self.columns, self.place = path, columns, place
        self.groups, self.is_utc = groups or {}, is_utc or {}
        self.names = list(columns)
        self.height = len(next(iter(columns.values()))) if columns else 0
        self.numeric = [name for name, own in columns.items() if name and _is_numeric(own)]
        self.dates = [name for name, own in columns.items() if _holds_dates(own)]

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
        found = [part for part in both if part in self.names]
        if len(found) == 1:
            missing = both[found == both[:1]]
            raise Problem(f"{self.path} has a column {found[0]!r}, but no {missing!r}; a complex number needs both")
        return found or [self.require(name)]

    def points(self, others: Sequence[str | None]) -> list[str]:
        """Return the columns of the points if none are named: all numeric columns but the others."""
        return self.groups.get("points") or [name for name in self.numeric if name not in others]

    def shown(self, name: str) -> Array:
        """Return the values of a column, as numbers if they all are, to describe them."""
        column = self.columns[name]
        if not isinstance(column, Texts):
            return np.asarray(column)
        if column.is_numeric:
            with suppress(Problem):
                return self._numbers(name, True)
        return np.array(column.tolist())

    def without_empty(self, names: Sequence[str]) -> Table:
        """Return the rows in which none of these columns is missing."""
        kept = np.flatnonzero(~np.any([_missing(self.columns[name]) for name in names], axis=0))
        columns = {name: own.rows(kept) if isinstance(own, Texts) else own[kept] for name, own in self.columns.items()}
        refuse(self.path, (not kept.size, f" has no row in which {' and '.join(names)} are all given"))
        place = self.place
        return Table(self.path, columns, lambda row: place(int(kept[row])), self.groups, self.is_utc)

    def read(
        self,
        names: Sequence[str],
        time: str | None,
        label: str | None,
        sparse: Sequence[str] = (),
        unix: str | None = None,
    ) -> Rows:
        """Read some columns as numbers, one as times and one as labels.

        Cells of the columns `sparse` may be empty or NaN; they are NaN in the result. Numeric times count the unit
        `unix` since 1970, if it is given.
        """
        columns = [self._numbers(name, name in sparse) for name in names]
        times, utc = self._times(time) if time is not None else (np.empty(0), False)
        if unix is not None:
            if time is None:
                raise Problem("--unix is for times that are numbers, and there is no column of times")
            refuse("--unix is for times that are numbers", (times.dtype.kind == "M", f"; column {time!r} has dates"))
            column = self.columns[time]
            cells = column.plain() if isinstance(column, Texts) else None
            times, utc = from_unix(times, unix, cells, lambda row: f"{self.path}, {self.place(row)}"), True
        labels = self.labels(label) if label is not None else None
        given = [*columns, *([times] if time is not None else []), *([labels] if labels is not None else [])]
        lengths = sorted(set(map(len, given)))
        differ = f": arrays differ in length: {' and '.join(map(str, lengths))}"
        refuse(self.path, (len(lengths) > 1, differ), (lengths == [0], " has no rows"))
        table = np.stack(columns, axis=1) if columns else np.empty((0, 0))
        return Rows(table, times, utc, labels, self.place)

    def _numbers(self, name: str, sparse: bool) -> NDArray[np.float64]:
        column = self.columns[name]
        if isinstance(column, Texts):
            values = self._read(name, column, sparse)
        elif column.dtype.kind in "biuf":
            values = column.astype(np.float64)
        else:
            raise Problem(f"{self.path}: column {name!r} holds {column.dtype}, not numbers")
        bad = np.flatnonzero(np.isinf(values) if sparse else ~np.isfinite(values))
        if bad.size:
            value = values[bad[0]]
            found = f"is empty or NaN{_SKIP}" if np.isnan(value) else f"holds {value}, which is not a finite number"
            raise self._problem(name, int(bad[0]), found)
        return values

    def _read(self, name: str, column: Texts, sparse: bool) -> NDArray[np.float64]:
        """Return texts as numbers."""
        found = column.converted()
        if found is not None and (sparse or not np.isnan(found).any()):
            return found
        cells = column.plain()
        cells = [cell or "nan" for cell in cells] if sparse else cells
        try:
            return numbers(cells)
        except ValueError:
            row = next(i for i, cell in enumerate(cells) if not is_number(cell))
            if not cells[row]:
                raise self._problem(name, row, f"is empty{_SKIP}") from None
            units = "; if this line holds units, remove it" if row == 0 else ""
            shown = column.tolist()[row]
            raise self._problem(name, row, f"holds {shown!r}, which is not a number{units}") from None

    def _times(self, name: str) -> tuple[Array, bool | None]:
        column = self.columns[name]
        if isinstance(column, Texts):
            found = column.converted() if column.is_numeric else None
            # Larger whole numbers are exact as texts only.
            if found is not None and np.abs(found).max(initial=0.0) <= EXACT:
                return found, False
            cells = self.labels(name)
            cells = column.plain() if column.is_numeric else cells
            return parse_times(cells, lambda row, what: self._problem(name, row, what))
        if column.dtype.kind in "iu":
            return column, False
        if column.dtype.kind != "M":
            return self._numbers(name, False), False
        if np.isnat(column).any():
            raise self._problem(name, int(np.isnat(column).argmax()), "holds no time")
        return column, self.is_utc.get(name)

    def labels(self, name: str) -> list[str]:
        """Return a column as texts, none of which is empty."""
        column = self.columns[name]
        if isinstance(column, np.ndarray) and column.dtype.kind == "O":
            raise Problem(f"{self.path}: column {name!r} holds {column.dtype}, not texts, numbers or times")
        texts = column.tolist() if isinstance(column, Texts) else column.astype(np.str_).tolist()
        if "" in texts:
            raise self._problem(name, texts.index(""), "is empty")
        return texts

    def _problem(self, name: str, row: int, found: str) -> Problem:
        return Problem(f"{self.path}, {self.place(row)}: column {name!r} {found}")


def _missing(column: Any) -> NDArray[np.bool_]:
    """Return which entries of a column are empty or NaN."""
    if isinstance(column, Texts):
        return np.array([text.lower() in _MISSING for text in column.tolist()])
    return np.asarray(column != column)


def _is_numeric(column: Any) -> bool:
    return column.is_numeric if isinstance(column, Texts) else column.dtype.kind in "biuf"


def _holds_dates(column: Any) -> bool:
    if isinstance(column, Texts):
        return first_date(list(islice(column.plain(FIRST), FIRST)))
    return column.dtype.kind in "Mm"

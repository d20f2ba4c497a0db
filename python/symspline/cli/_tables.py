"""Rows of numbers, times and labels in the named columns of a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date, time, timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._messages import Problem, Progress, did_you_mean, refuse
from ._streams import Source
from ._times import parse_times

Array = NDArray[Any]
Place = Callable[[int], str]

RE, IM = "_re", "_im"
FIRST = 50
"""Rows that are searched for dates, as the first ones may hold units or be empty."""


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


class Table:
    """A file with named columns. Its subclasses read the formats.

    Attributes
    ----------
    path : Source
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

    def __init__(self, path: Source) -> None:
        """Read the names of the columns."""
        self.path, self.groups, self.is_utc, self.columns = path, {}, {}, {}
        self.names, self.numeric, self.dates = [], [], []
        self._sparse: frozenset[str] = frozenset()
        self._time: str | None = None

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
        self._sparse, self._time = frozenset(sparse), time
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

"""Tables in files: rows of numbers, times and labels under named columns."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import Problem, did_you_mean
from .layout import IM, RE, Doubles
from .progress import Progress
from .times import Fail, parse_times

Array = NDArray[Any]
Place = Callable[[int], str]

ENDINGS = (".csv", ".npz", ".parquet", ".tum", ".txt")


@dataclass(frozen=True)
class Rows:
    """What was read of a table.

    Attributes:
        numbers: shape (rows, columns).
        times: numbers or ``datetime64``; empty if no column of times was asked for.
        utc: whether the times had a Z or an offset; they are UTC then. None where that is not known.
        labels: names of the curves, None if no such column was asked for.
        place: where a row is, such as ``"line 7"``.
    """

    numbers: Doubles
    times: Array
    utc: bool | None
    labels: list[str] | None
    place: Place


class Table(ABC):
    """A file with named columns.

    Attributes:
        path: the file.
        names: of all columns, in the order of the file.
        numeric: names of the columns that hold numbers.
        dates: names of the columns that hold dates, or what looks like them.
    """

    path: Path
    names: list[str]
    numeric: list[str]
    dates: list[str]

    def require(self, name: str) -> str:
        """The name, if there is such a column."""
        if name not in self.names:
            raise Problem(f"{self.path} has no column {name!r}; {did_you_mean(name, self.names)}")
        return name

    def find(self, *names: str) -> str | None:
        """The first column with one of these names in lower case, whatever its case."""
        return next((own for name in names for own in self.names if own.lower() == name), None)

    def expand(self, name: str) -> list[str]:
        """The columns that a name stands for: itself, or the two parts of complex numbers."""
        parts = [name + RE, name + IM]
        found = [part for part in parts if part in self.names]
        if name in self.names or not found:
            return [self.require(name)]
        if len(found) == 1:
            (missing,) = set(parts) - set(found)
            raise Problem(
                f"{self.path} has a column {found[0]!r}, but no {missing!r}; a complex number needs both"
            )
        return parts

    def points(self, others: Sequence[str | None]) -> list[str]:
        """The columns of the points if nobody says which: all with numbers but the others."""
        return [name for name in self.numeric if name not in others]

    @abstractmethod
    def read(self, numbers: Sequence[str], time: str | None, label: str | None, progress: Progress) -> Rows:
        """The rows, with some columns as numbers, one as times and one as labels."""

    def _fail(self, name: str, place: Place) -> Fail:
        """Problems of a column."""
        return lambda row, found: Problem(f"{self.path}, {place(row)}: column {name!r} {found}")

    def _finite(self, values: Doubles, name: str, place: Place) -> Doubles:
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise self._fail(name, place)(
                int(bad[0]), f"holds {values[bad[0]]}, which is not a finite number"
            )
        return values


class ArrayTable(Table):
    """A table whose columns are arrays."""

    @abstractmethod
    def _column(self, name: str) -> Array:
        """One column, as whatever it holds."""

    def _is_utc(self, name: str) -> bool | None:
        return None

    def read(self, numbers: Sequence[str], time: str | None, label: str | None, progress: Progress) -> Rows:
        columns = []
        for done, name in enumerate(numbers):
            progress(done, len(numbers))
            columns.append(self._numbers(name))
        times, utc = self._times(time) if time is not None else (np.empty(0), False)
        labels = self._texts(label) if label is not None else None
        given = [*columns, *([times] if time is not None else []), *([labels] if labels is not None else [])]
        lengths = sorted(set(map(len, given)))
        if len(lengths) > 1:
            raise Problem(f"{self.path}: arrays differ in length: {' and '.join(map(str, lengths))}")
        if lengths == [0]:
            raise Problem(f"{self.path} has no rows")
        return Rows(_table(columns), times, utc, labels, _row)

    def _numbers(self, name: str) -> Doubles:
        array = self._column(name)
        if array.dtype.kind not in "biuf":
            raise Problem(f"{self.path}: column {name!r} holds {array.dtype}, not numbers")
        return self._finite(array.astype(np.float64), name, _row)

    def _texts(self, name: str) -> list[str]:
        """A column as texts; bytes, lists and records are none."""
        array = self._column(name)
        for row, cell in enumerate(array.tolist() if array.dtype.kind in "OS" else ()):
            if not isinstance(cell, (str, int, float, date, time, timedelta)):
                raise self._fail(name, _row)(
                    row, f"holds {type(cell).__name__}, not a text, a number or a time"
                )
        texts: list[str] = array.astype(np.str_).tolist()
        return texts

    def _times(self, name: str) -> tuple[Array, bool | None]:
        array = self._column(name)
        if array.dtype.kind in "OUT":
            return parse_times(self._texts(name), self._fail(name, _row))
        if array.dtype.kind in "iu":
            return array, False
        if array.dtype.kind != "M":
            return self._numbers(name), False
        if np.isnat(array).any():
            raise self._fail(name, _row)(int(np.isnat(array).argmax()), "holds no time")
        return array, self._is_utc(name)


def _row(row: int) -> str:
    return f"row {row} (counted from 0)"


def _table(columns: Sequence[Doubles]) -> Doubles:
    """Columns side by side."""
    return np.stack(columns, axis=1) if columns else np.empty((0, 0))


# ---- files ----


def ending(path: Path, allowed: Sequence[str], what: str) -> str:
    """The ending of a file name, which says what is in the file."""
    suffix = path.suffix.lower()
    if suffix not in allowed:
        raise Problem(f"{path}: the name of {what} must end in {' or '.join(allowed)}")
    return suffix

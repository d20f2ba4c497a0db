"""Which columns of a table hold the numbers of a point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..spaces import Space
from .layout import IM, RE, Doubles, complex_numbers


@dataclass(frozen=True)
class Entry:
    """One number of a point.

    Attributes:
        name: that of its column, or of its two columns without their endings.
        columns: one, or two with real and imaginary part.
    """

    name: str
    columns: tuple[str, ...]

    @property
    def other_half(self) -> str | None:
        """If the only column is one of two by its name, the other one."""
        (*_, column) = self.columns
        halves = {RE: IM, IM: RE}
        if len(self.columns) > 1 or column[-3:] not in halves:
            return None
        return column[:-3] + halves[column[-3:]]


def paired(columns: Sequence[str]) -> list[Entry]:
    """Columns as numbers: A_re and A_im are one, wherever they stand, at the place of the first of them."""
    known = set(columns)
    entries = [_entry(column, known) for column in columns]
    return list(dict.fromkeys(entries))


def _entry(column: str, known: set[str]) -> Entry:
    name = column[:-3]
    both = (name + RE, name + IM)
    return Entry(name, both) if column in both and known.issuperset(both) else Entry(column, (column,))


def completed(numbers: Doubles, entries: Sequence[Entry], space: Space) -> Doubles:
    """The numbers in these entries' columns, with zeros where a complex number has one column only."""
    missing: list[int] = []
    read = 0
    for entry, two in zip(entries, complex_numbers(space), strict=True):
        read += len(entry.columns)
        if two and len(entry.columns) == 1:
            missing.append(read)
    return np.insert(numbers, missing, 0.0, axis=1) if missing else numbers

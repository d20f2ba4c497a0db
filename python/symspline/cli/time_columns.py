"""Which column of a table holds the times: found by its name, and never passed over in silence."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from .errors import Problem, listed
from .progress import Progress
from .tables import Rows, Table

NUMBERED = "none"
"""What --time says to number the points of every curve, if no column has this name."""

_TIME = {"t", "time", "times", "timestamp", "timestamps", "date", "dates", "datetime"}
# What goes with these words: standards, and units.
_KINDS = {"iso", "utc", "gmt", "unix", "posix", "epoch", "base", "local"}
_UNITS = {"s", "ms", "us", "ns", "sec", "secs", "second", "seconds", "nsec"}
_PARTS = {
    "year",
    "month",
    "day",
    "doy",
    "hour",
    "hours",
    "minute",
    "minutes",
    "second",
    "seconds",
    "jd",
    "mjd",
}
_WORDS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")
_IN_BRACKETS = re.compile(r"[(\[].*?[)\]]")
# A day as one number, 20210829, in a column that is called a date, and in any other one.
_PACKED = 10_000_101, 99_991_231
_PACKED_NOW = 19_000_101, 20_991_231


def time_column(table: Table, given: str | None, others: Sequence[str | None]) -> str | None:
    """The column of times: the one that was named, or one called like a time.

    Args:
        table: the table.
        given: the column that the user named, ``"none"`` to have the points numbered.
        others: columns that are for something else.

    Returns:
        Its name, None if points are to be numbered.

    Raises:
        Problem: there is no such column, or which one is in doubt.
    """
    if given is not None:
        return None if given == NUMBERED and given not in table.names else table.require(given)
    left = [name for name in table.names if name not in others]
    numeric = set(table.numeric)
    usual = [name for name in left if _is_usual(name)]
    # Numbers are taken without a word under the two plainest names only: others leave their unit in doubt.
    certain = [name for name in usual if name not in numeric or name.lower() in ("t", "time")]
    doubtful = [name for name in left if name not in certain and (name in usual or name.lower() in _PARTS)]
    if len(certain) == 1 and (not doubtful or _is_whole(certain[0], numeric)):
        return certain[0]
    found = [*certain, *doubtful] or [name for name in table.dates if name in left]
    if not found:
        return None
    may = (
        "may hold the times" if len(found) == 1 else "may all belong to the times, which stand in one column"
    )
    raise Problem(
        f"{table.path}: {listed(found)} {may}; say --time {found[0]}, or --time {NUMBERED} to number the points "
        "0, 1, 2, ..."
    )


def column_of_names(table: Table, time: str | None, used: Sequence[str | None]) -> str | None:
    """A column that is not used and tells rows of equal times apart: it may hold the names of several curves.

    Parameters
    ----------
    table : Table
        The table.
    time : str or None
        Its column of times.
    used : sequence of str or None
        Columns that are used.

    Returns
    -------
    str or None
        The first column of which every value stands in two rows or more, none of them at the same time.
    """
    if time is None:
        return None
    for name in table.names:
        if name in used or name in table.dates:
            continue
        try:
            with Progress("reading") as progress:
                rows = table.read([], time, name, progress)
        except Problem:
            # A cell is empty, or holds no text.
            continue
        labels = np.unique(np.array(rows.labels), return_inverse=True)[1]
        order = np.lexsort((rows.times, labels))
        same = (np.diff(labels[order]) == 0) & (rows.times[order][1:] == rows.times[order][:-1])
        if 1 < labels.max() + 1 <= len(labels) / 2 and np.bincount(labels).min() > 1 and not same.any():
            return name
    return None


def check_days(table: Table, name: str | None, rows: Rows) -> None:
    """Raise `Problem` if days are written as one number, such as 20210829, which is no number of days."""
    times = rows.times
    if name is None or times.dtype.kind == "M":
        return
    first, last = _PACKED if "date" in _words(name) else _PACKED_NOW
    whole = times.astype(np.int64) if np.all(np.abs(times) < 2.0**62) else np.zeros(1, np.int64)
    if (whole < first).any() or (whole > last).any() or (whole != times).any():
        return
    month, day = whole // 100 % 100, whole % 100
    if ((month >= 1) & (month <= 12) & (day >= 1) & (day <= 31)).all():
        raise Problem(
            f"{table.path}, {rows.place(0)}: column {name!r} holds {whole[0]}, which is a day but no number of days; "
            f"write {whole[0] // 10000}-{month[0]:02}-{day[0]:02}"
        )


def _words(name: str) -> list[str]:
    """``"#timestamp [ns]"`` is timestamp, ``"BaseDateTime"`` is base, date, time."""
    return [word.lower() for word in _WORDS.findall(_IN_BRACKETS.sub("", name))]


def _is_whole(name: str, numeric: set[str]) -> bool:
    """Whether a column of a usual name holds dates with their time of day, as its name says: beside a ``date`` there
    may be an ``hour``."""
    return name not in numeric and "time" in name.lower()


def _is_usual(name: str) -> bool:
    words = _words(name)
    rest = [word for word in words if word not in _KINDS]
    while len(rest) > 1 and rest[-1] in _UNITS:
        rest.pop()
    return "".join(rest) in _TIME or (not rest and bool({"utc", "epoch"} & set(words)))

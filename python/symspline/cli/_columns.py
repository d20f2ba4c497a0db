"""The columns of a table that hold times, points and names of curves."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .._spaces import Space, factors_of
from ._messages import Problem, first_duplicate, listed, refuse
from ._points import POSES, ROTATIONS, complex_numbers, count_with_quaternion, described, width
from ._tables import IM, RE, Array, Rows, Table

NUMBERED = "none"
"""The value of --time that numbers the points of every curve, unless a column has this name."""
ORDERS = ("wxyz", "xyzw")
_HALVES = {RE: IM, IM: RE}

_IN_BRACKETS = re.compile(r"[(\[].*?[)\]]")
_WORDS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")
# Names of times, in words: "BaseDateTime" is base, date, time, and "#timestamp [ns]" is timestamp.
_KIND = "(?:iso|utc|gmt|unix|posix|epoch|base|local)"
_UNIT = "(?:s|ms|us|ns|secs?|seconds?|nsec)"
_TIME = re.compile(
    rf"(?:{_KIND} )*(?:t|times?|timestamps?|dates?|date ?time)(?: {_KIND})*(?: {_UNIT})*"
    rf"|(?:{_KIND} )*(?:utc|epoch)(?: {_KIND})*(?: {_UNIT})*"
)
_TIME_PART = re.compile("year|month|day|doy|hours?|minutes?|seconds?|jd|mjd")
# A day as one number, 20210829, in a column that is called a date, and in any other column.
_PACKED = 10_000_101, 99_991_231
_PACKED_NOW = 19_000_101, 20_991_231


# ---- times ----


def time_column(table: Table, given: str | None, others: Sequence[str | None]) -> str | None:
    """Return the column of times: the given one, or one that is called like a time; None to number the points.

    Raises
    ------
    Problem
        There is no such column, or it is in doubt which one is meant.
    """
    if given is not None:
        return None if given == NUMBERED and given not in table.names else table.require(given)
    left = [name for name in table.names if name not in others]
    usual = [name for name in left if _TIME.fullmatch(_words(name))]
    # Numbers are accepted as times only under the two plainest names, as the unit of others is in doubt.
    certain = [name for name in usual if name not in table.numeric or name.lower() in ("t", "time")]
    doubtful = [name for name in left if name not in certain and (name in usual or _TIME_PART.fullmatch(name.lower()))]
    if len(certain) == 1:
        # A column of dates with their time of day needs no other columns.
        is_whole = certain[0] not in table.numeric and "time" in certain[0].lower()
        if is_whole or not doubtful:
            return certain[0]
    found = [*certain, *doubtful] or [name for name in table.dates if name in left]
    if not found:
        return None
    what = "hold the times" if len(found) == 1 else "all belong to the times, which stand in one column"
    raise Problem(
        f"{table.path}: {listed(found)} may {what}; say --time {found[0]}, or --time {NUMBERED} to number the points "
        "0, 1, 2, ..."
    )


def _words(name: str) -> str:
    return " ".join(_WORDS.findall(_IN_BRACKETS.sub("", name))).lower()


def check_days(table: Table, name: str | None, rows: Rows) -> None:
    """Raise `Problem` if days are written as one number, such as 20210829, which is not a number of days."""
    times = rows.times
    if name is None or times.dtype.kind == "M":
        return
    first, last = _PACKED if "date" in _words(name).split() else _PACKED_NOW
    if (times < first).any() or (times > last).any() or (times != np.floor(times)).any():
        return
    whole = times.astype(np.int64)
    month, day = whole // 100 % 100, whole % 100
    if ((month >= 1) & (month <= 12) & (day >= 1) & (day <= 31)).all():
        iso = f"{whole[0] // 10000}-{month[0]:02}-{day[0]:02}"
        raise Problem(
            f"{table.path}, {rows.place(0)}: column {name!r} holds {whole[0]}, which is a day but not a number of "
            f"days; write {iso}"
        )


def column_of_names(table: Table, time: str | None, used: Sequence[str | None]) -> str | None:
    """Return an unused column that distinguishes rows of equal times: it may hold the names of several curves.

    Each of its values occurs in two rows or more, never twice at one time.
    """
    for name in table.names if time is not None else ():
        if name in used or name in table.dates:
            continue
        try:
            rows = table.read([], time, name)
        except Problem:
            # A cell is empty, or does not hold a text.
            continue
        labels = np.unique(np.array(rows.labels), return_inverse=True)[1]
        order = np.lexsort((rows.times, labels))
        same = (np.diff(labels[order]) == 0) & (rows.times[order][1:] == rows.times[order][:-1])
        if labels.max() > 0 and np.bincount(labels).min() > 1 and not same.any():
            return name
    return None


# ---- points ----


@dataclass(frozen=True)
class Entry:
    """One number of a point: its name, and its column, or the two columns with real and imaginary part."""

    name: str
    columns: tuple[str, ...]


def _paired(columns: Sequence[str]) -> list[Entry]:
    """Columns as numbers: A_re and A_im are one number, at the position of the first of them."""
    entries = []
    for column in columns:
        both = (column[:-3] + RE, column[:-3] + IM)
        paired = column in both and set(both) <= set(columns)
        entries.append(Entry(column[:-3], both) if paired else Entry(column, (column,)))
    return list(dict.fromkeys(entries))


def completed(numbers: Array, entries: Sequence[Entry], space: Space) -> Array:
    """Insert zeros for the imaginary parts of complex numbers that have one column."""
    counts = np.array([len(entry.columns) for entry in entries])
    missing = np.cumsum(counts)[np.array(complex_numbers(space)) & (counts == 1)]
    return np.insert(numbers, missing, 0.0, axis=1)


def split_names(text: str | None) -> list[str]:
    """Split names at commas; a name with a comma is quoted."""
    try:
        (names,) = csv.reader([text or ""], skipinitialspace=True)
    except (csv.Error, ValueError):
        raise Problem(f"{text!r} is not a list of names separated by commas") from None
    return [name.strip() for name in names]


def point_entries(
    table: Table, given: list[str], others: list[str | None], space: Space, lonlat: bool, order: str | None
) -> tuple[list[Entry], list[int] | None]:
    """Return the numbers of a point, in the given columns or in all other columns.

    If a rotation is a quaternion, the second value is the column of each of its numbers (`Columns.quaternion`).
    """
    groups = [table.expand(name) for name in given] or [_lonlat(table) if lonlat else table.points(others)]
    columns = [column for group in groups for column in group]
    # In a real space A_re and A_im are two numbers if both are named.
    groups = [columns] if any(complex_numbers(space)) else groups
    entries = [entry for group in groups for entry in _paired(group)]
    names, count = [entry.name for entry in entries], count_with_quaternion(space)
    for used in (columns, names):
        twice = first_duplicate([*filter(None, others), *used])
        refuse("column ", (twice is not None, f"{twice!r} of {table.path} cannot have two meanings"))
    if len(names) == count:
        return entries, _quaternion_columns(names, space, order)
    wrong = f" {order}: {listed(names) or 'no columns'} are not the {count} numbers of a quaternion in {space}"
    none = f" is for so:3, se:3 and products with one of them, not for {space}"
    refuse("--quaternion", (order and count is None, none), (order, wrong))
    if not lonlat:
        _check_halves(table, entries, space, bool(given))
    _check_count(table, entries, others, space, lonlat, bool(given))
    return entries, None


def _lonlat(table: Table) -> list[str]:
    """The first column of each pair of names, whatever their case."""
    lower = {name.lower(): name for name in reversed(table.names)}
    columns = [lower.get(short) or lower.get(long) for short, long in (("lon", "longitude"), ("lat", "latitude"))]
    if None in columns:
        raise Problem(
            f"{table.path}: --lonlat needs columns lon and lat, or longitude and latitude, or two --columns; "
            f"there are {listed(table.names)}"
        )
    return [name for name in columns if name]


def _check_halves(table: Table, entries: list[Entry], space: Space, given: bool) -> None:
    """Raise `Problem` unless real numbers have one column, and complex ones both or one without an ending."""
    kinds = complex_numbers(space)
    if len(entries) != len(kinds):
        # The number of a column is unknown, but all numbers may be of one kind.
        kinds = kinds[:1] * len(entries) if len(set(kinds)) == 1 else []
    for entry, two in zip(entries, kinds, strict=False):
        if len(entry.columns) > 1 and not two:
            raise Problem(
                f"{table.path}: {' and '.join(entry.columns)} are a complex number where a real one belongs: a point "
                f"of {space} has {described(space)}; name its columns one by one with --columns, or give a space of "
                "complex points, such as cp:1 for sphere:1"
            )
        # A column that is the real or imaginary part by its name.
        start, end = entry.columns[0][:-3], entry.columns[0][-3:]
        if two and len(entry.columns) == 1 and end in _HALVES:
            half = start + _HALVES[end]
            where = "in --columns" if given else "with numbers" if half in table.names else "in the table"
            raise Problem(
                f"{table.path}: column {entry.columns[0]!r} is half of a complex number, "
                f"and there is no {half!r} {where}"
            )


def _check_count(
    table: Table, entries: list[Entry], others: list[str | None], space: Space, lonlat: bool, given: bool
) -> None:
    if len(entries) == (2 if lonlat else len(complex_numbers(space))):
        return
    advice = "" if given else "; say which with --columns"
    known = {"", *table.numeric, *filter(None, others)}
    other = [name for name in table.names if name not in known]
    if other and not given:
        advice += f" (no numbers in the first row of {listed(other)})"
    point = "longitude and latitude are 2 numbers" if lonlat else f"a point of {space} has {described(space)}"
    kind = "numbers" if any(len(entry.columns) > 1 for entry in entries) else "columns"
    names = listed([entry.name for entry in entries])
    found = f"{len(entries)} {kind}: {names}" if entries else "no columns"
    raise Problem(f"{table.path}: {point}, and there are {found}{advice}")


def _quaternion_columns(names: list[str], space: Space, order: str | None) -> list[int]:
    """Return the column of every number of a point, where positions come first and quaternions have their scalar first.

    Raises
    ------
    Problem
        The names do not show which number is which, or contradict ``order``.
    """
    found = quaternion_by_names(names, space)
    if order is None and found is None:
        raise Problem(
            f"{listed(names)} may be a quaternion{' and a position' if len(names) > 4 else ''}, but the names do not "
            "say which number is which: call them qw, qx, qy, qz (and x, y, z), or say --quaternion wxyz or xyzw"
        )
    if order is None or found is None:
        return found or _quaternion_in_order(space, ORDERS.index(order or ""))
    if found != _quaternion_in_order(space, ORDERS.index(order)):
        raise Problem(f"--quaternion {order} contradicts the names {listed(names)}; omit it or rename them")
    return found


def _quaternion_in_order(space: Space, scalar_last: int) -> list[int]:
    columns: list[int] = []
    for factor in factors_of(space):
        own = list(range(len(columns), len(columns) + width(factor, True)))
        if factor in (ROTATIONS, POSES):
            own[-4:] = np.roll(own[-4:], scalar_last).tolist()
        columns += own
    return columns


def quaternion_by_names(names: Sequence[str], space: Space) -> list[int] | None:
    """Return these columns for names that end in w, x, y and z after a common beginning; None for other names.

    Positions whose names end in x, y and z may also be in any order.
    """
    plain = [_IN_BRACKETS.sub("", name).strip().lower() for name in names]
    scalars = [name for name in plain if name.endswith("w")]
    quaternion = [scalars[0][:-1] + letter for letter in "wxyz"] if len(scalars) == 1 else []
    if not quaternion or any(plain.count(name) != 1 for name in quaternion):
        return None
    scalar_first = [plain.index(name) for name in quaternion]
    rest = [i for i in range(len(names)) if i not in scalar_first]
    columns: list[int] = []
    for factor in factors_of(space):
        count = width(factor, True) - (4 if factor in (ROTATIONS, POSES) else 0)
        own, rest = rest[:count], rest[count:]
        by_letter = sorted(own, key=lambda i: plain[i][-1:])
        if [plain[i][-1:] for i in by_letter] == [*"xyz"]:
            own = by_letter
        elif factor == POSES:
            return None
        columns += own + (scalar_first if factor in (ROTATIONS, POSES) else [])
    return columns

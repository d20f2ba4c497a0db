"""The columns of a table that hold times, points and names of curves."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from shlex import quote
from typing import Any

import numpy as np

from .._base.exceptions import SymsplineError
from .._spaces import LogEuclidean, Space, SymmetricPositiveDefinite, Torus, factors_of
from .._spaces.degrees import is_degrees, look_like_degrees
from ..geo import NAMED, are_tracks
from ._files import Source
from ._messages import Problem, first_duplicate, listed, refuse, say
from ._points import (
    IN_BRACKETS,
    complex_numbers,
    count_with_quaternion,
    described,
    in_order,
    matrix,
    points_of,
    quaternion_by_names,
    width,
)
from ._tables import IM, RE, Array, Place, Rows, Table

NUMBERED = "none"
"""The value of --time that numbers the points of every curve, unless a column has this name."""
ORDERS = ("wxyz", "xyzw")
_LON, _LAT = ("lon", "lng", "longitude", "location-long"), ("lat", "latitude", "location-lat")
_HALVES = {RE: IM, IM: RE}

# Names of times without blanks and marks: "BaseDateTime", "#timestamp [ns]", "ISO_TIME", "header.stamp".
_TIME = re.compile(
    "(iso|utc|gmt|unix|posix|base|local|header|rosbag)*(t|times?|(time)?stamps?|dates?|datetime|utc|epoch)"
    "(iso|utc|gmt|unix|local)*(s|ms|us|ns|secs?|seconds?|nsec)?"
)
_TIME_PART = re.compile("year|month|day|doy|hours?|minutes?|secs?|seconds?|nsecs?|nanosecs?|jd|mjd")
# Nanoseconds since 1970 up to this number of seconds fit into 64 bits.
_FARTHEST = 9e9
# A day as one number, 20210829, in a column that is called a date, and in any other column.
_PACKED, _PACKED_NOW = (10_000_101, 99_991_231), (19_000_101, 20_991_231)


# ---- times ----


def time_column(table: Table, given: str | None, others: Sequence[str | None], unix: bool = False) -> str | None:
    """Return the column of times: the given one, or one that is called like a time; None to number the points.

    Raises
    ------
    Problem
        There is no such column, or it is in doubt which one is meant.
    """
    if given is not None:
        return None if given == NUMBERED and given not in table.names else table.require(given)
    left = [name for name in table.names if name not in others]
    usual = [name for name in left if _TIME.fullmatch(_letters(name))]
    # Numbers are accepted as times only under the two plainest names, as the unit of others is in doubt.
    certain = [name for name in usual if unix or name not in table.numeric or name.lower() in ("t", "time")]
    doubtful = [name for name in left if name not in certain and (name in usual or _TIME_PART.fullmatch(name.lower()))]
    # Stamps of ROS 2: header.stamp.sec and header.stamp.nanosec.
    beside = [re.sub("sec$", part, name) for name in usual for part in ("nanosec", "nsec") if name.endswith(".sec")]
    doubtful += [name for name in left if name in beside and name not in doubtful]
    if len(certain) == 1:
        # A column of dates with their time of day needs no other columns.
        is_whole = certain[0] not in table.numeric and "time" in certain[0].lower()
        if is_whole or not doubtful:
            return certain[0]
    found = [*certain, *doubtful] or [name for name in table.dates if name in left]
    if not found:
        return None
    what = "hold the times" if len(found) == 1 else "all belong to the times, which stand in one column"
    meant, unit = found[0], ", with --unix if it counts from 1970" if found[0] in table.numeric else ""
    if len(found) == 2 and re.search("n(ano)?secs?$", _letters(found[1])):
        meant, unit = ",".join(found), ", which adds seconds and nanoseconds since 1970"
    raise Problem(
        f"{table.path}: {listed(found)} may {what}; say --time {quote(meant)}{unit}, or --time {NUMBERED} to number "
        "the points 0, 1, 2, ..."
    )


def with_stamps(table: Table, given: str | None, skipna: bool) -> tuple[Table, str | None]:
    """Return the table with one column of dates for two columns of seconds and nanoseconds, and its name.

    Rows without one of them are omitted if ``skipna`` is True.
    """
    names = split_names(given) if given is not None and given not in table.names else []
    if len(names) != 2:
        return table, given
    table = table.without_empty([*map(table.require, names)]) if skipna else table
    stamps = table.read([*map(table.require, names)], None, None).numbers
    wrong = np.flatnonzero((stamps != np.floor(stamps)).any(axis=1) | (np.abs(stamps) > _FARTHEST).any(axis=1))
    if wrong.size:
        found = " and ".join(f"{value:.17g}" for value in stamps[wrong[0]])
        what = "which are not whole seconds since 1970 and nanoseconds"
        raise Problem(f"{table.path}, {table.place(int(wrong[0]))}: --time {given}: the columns hold {found}, {what}")
    seconds, rest = stamps.T.astype(np.int64)
    columns = {name: own for name, own in table.columns.items() if name not in names}
    time = given if given is not None and "time" in columns else "time"
    columns[time] = (10**9 * seconds + rest).astype("datetime64[ns]")
    return replace(table, columns=columns, is_utc={**table.is_utc, time: True}), time


def _letters(name: str) -> str:
    return re.sub("[^a-z]", "", IN_BRACKETS.sub("", name).lower())


def check_days(table: Table, name: str | None, rows: Rows) -> None:
    """Raise `Problem` if days are written as one number, such as 20210829, which is not a number of days."""
    times = rows.times
    if name is None or times.dtype.kind == "M":
        return
    first, last = _PACKED if "date" in _letters(name) else _PACKED_NOW
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
    """Return an unused column that may hold the names of several curves.

    Each of its values occurs in two rows or more. It distinguishes most of the rows of equal times or, if there are no
    times, it is a text whose values have one block of rows each.
    """
    times = np.empty(0) if time is None else table.read([], time, None).times
    repeated = len(times) - len(np.unique(times))
    for name in table.names:
        if name in used or name in table.dates or (time is None and name in table.numeric):
            continue
        # A cell may be empty, or not hold a text.
        with suppress(Problem):
            labels = table.codes(name)
            if labels.max() == 0 or np.bincount(labels).min() < 2:
                continue
            if time is None and np.count_nonzero(np.diff(labels)) == labels.max():
                return name
            if time is not None and len(labels) == len(times):
                order = np.lexsort((times, labels))
                same = (np.diff(labels[order]) == 0) & (times[order][1:] == times[order][:-1])
                if not same.any() or 2 * np.count_nonzero(same) < repeated:
                    return name
    return None


def column_of_tracks(table: Table, used: Sequence[str | None], space: Space, points: Any) -> str | None:
    """Return an unused column whose values seem to be the names of several tracks, in rows that are one curve.

    The path through all rows is then at least twice as long as the paths through the rows of each name.
    """
    for name in table.names:
        if name in used or name in table.dates or (name in table.numeric and not NAMED.search(name)):
            continue
        # Cells can be empty or without text, and some spaces have no distances.
        with suppress(Problem, SymsplineError):
            labels = table.codes(name)
            if are_tracks(labels, lambda order: _steps(space, points, order)):
                return name
    return None


def _steps(space: Space, points: Any, order: Array) -> Array:
    before, after = (
        tuple(part[rows] for part in points) if isinstance(points, tuple) else points[rows]
        for rows in (order[:-1], order[1:])
    )
    return np.asarray(space.distance(before, after))


# ---- points ----

Entry = tuple[str, ...]
"""One number of a point: its name and its column, or the two columns with its real and imaginary part."""


# Everything except the unit in names such as heading_deg or "heading (deg)".
_UNIT = re.compile(r".*[\[(_ ]|[\])]")


@dataclass(frozen=True)
class PointColumns:
    """The columns of the points of a space in a table.

    Attributes
    ----------
    path : Source
    space : Space
    entries : list of Entry
    lonlat : bool
        Whether points are longitude and latitude in degrees.
    quaternion : list of int or None
        The column of each number of a point whose rotation is a quaternion, as in `Columns`.
    degrees : bool
        Whether angles of tori are in degrees.
    """

    path: Source
    space: Space
    entries: list[Entry]
    lonlat: bool
    quaternion: list[int] | None
    degrees: bool = False

    @property
    def names(self) -> list[str]:
        """The name of every number."""
        return [name for name, *_ in self.entries]

    @property
    def used(self) -> list[str]:
        """All columns."""
        return [column for _, *columns in self.entries for column in columns]

    def read(self, numbers: Array, place: Place) -> Any:
        """Return the points in rows of these columns; ``place`` describes a row."""
        if not (self.lonlat or self.quaternion):
            # Complex numbers that have one column are real.
            counts = np.array([len(columns) for _, *columns in self.entries])
            missing = np.cumsum(counts)[np.array(complex_numbers(self.space)) & (counts == 1)]
            numbers = np.insert(numbers, missing, 0.0, axis=1)
        self._warn_of_degrees(numbers)
        return points_of(self.space, numbers, self.lonlat, self.quaternion, self.path, place, self.degrees)

    def _warn_of_degrees(self, numbers: Array) -> None:
        """Warn if angles in radians look like degrees, by their values or the names of their columns."""
        if self.degrees or self.quaternion or not any(isinstance(factor, Torus) for factor in factors_of(self.space)):
            return
        ends = np.cumsum([0, *(width(factor, False) for factor in factors_of(self.space))]).tolist()
        for factor, start, end in zip(factors_of(self.space), ends, ends[1:], strict=False):
            largest = look_like_degrees(factor, numbers[:, start:end])
            named = [name for name in self.names[start:end] if is_degrees(_UNIT.sub("", name))]
            if not isinstance(factor, Torus) or (largest is None and not named):
                continue
            why = f"angles up to {largest:g} look like degrees" if largest else f"the name {named[0]!r} means degrees"
            say(f"{self.path}: {why}, but angles on {factor} are in radians; give --degrees if they are in degrees")


def _paired(columns: Sequence[str]) -> list[Entry]:
    """Columns as numbers: A_re and A_im are one number, at the position of the first of them."""
    entries: list[Entry] = []
    for column in columns:
        both = (column[:-3] + RE, column[:-3] + IM)
        paired = column in both and set(both) <= set(columns)
        entry = (column[:-3], *both) if paired else (column, column)
        if not (paired and entry in entries):
            entries.append(entry)
    return entries


def split_names(text: str | None) -> list[str]:
    """Split names at commas; a name with a comma is quoted."""
    try:
        (names,) = csv.reader([text or ""], skipinitialspace=True)
    except (csv.Error, ValueError):
        raise Problem(f"{text!r} is not a list of names separated by commas") from None
    return [name.strip() for name in names]


def point_columns(
    table: Table, given: list[str], others: list[str | None], space: Space, lonlat: bool, order: str | None
) -> PointColumns:
    """Return the given columns of a point, or all other columns; ``order`` is that of a quaternion."""
    swapped = lonlat and len(given) == 2 and given[0].lower() in _LAT and given[1].lower() in _LON
    refuse(f"--columns {','.join(given)}: ", (swapped, f"longitude comes first: --columns {','.join(given[::-1])}"))
    groups = [table.expand(name) for name in given] or [_lonlat(table) if lonlat else table.points(others)]
    columns = [column for group in groups for column in group]
    # In a real space A_re and A_im are two numbers if both are named.
    groups = [columns] if any(complex_numbers(space)) else groups
    entries = [entry for group in groups for entry in _paired(group)]
    names, count = [name for name, *_ in entries], count_with_quaternion(space)
    for used in (columns, names):
        # A column may stand on both sides of a symmetric matrix.
        own = dict.fromkeys(used) if any(map(matrix, factors_of(space))) else used
        twice = first_duplicate([*filter(None, others), *own])
        refuse("column ", (twice is not None, f"{twice!r} of {table.path} cannot have two meanings"))
    if len(names) == count:
        return PointColumns(table.path, space, entries, lonlat, _quaternion_columns(names, space, order))
    wrong = f" {order}: {listed(names) or 'no columns'} are not the {count} numbers of a quaternion in {space}"
    none = f" is for so:3, se:3 and products with one of them, not for {space}"
    refuse("--quaternion", (order and count is None, none), (order, wrong))
    if not lonlat:
        _check_halves(table, entries, space, bool(given))
    _check_count(table, entries, others, space, lonlat, bool(given))
    return PointColumns(table.path, space, entries, lonlat, None)


def _lonlat(table: Table) -> list[str]:
    """The first column of each pair of names, whatever their case."""
    lower = {name.lower(): name for name in reversed(table.names)}
    columns = [next(filter(None, map(lower.get, names)), None) for names in (_LON, _LAT)]
    if None in columns:
        raise Problem(
            f"{table.path}: --lonlat needs columns {' or '.join(_LON)}, and {' or '.join(_LAT)}, or two --columns; "
            f"there are {listed(table.names)}"
        )
    return [name for name in columns if name]


def _check_halves(table: Table, entries: list[Entry], space: Space, given: bool) -> None:
    """Raise `Problem` unless real numbers have one column, and complex ones both or one without an ending."""
    kinds = complex_numbers(space)
    if len(entries) != len(kinds):
        # The number of a column is unknown, but all numbers may be of one kind.
        kinds = kinds[:1] * len(entries) if len(set(kinds)) == 1 else []
    for (_, *columns), two in zip(entries, kinds, strict=False):
        if len(columns) > 1 and not two:
            raise Problem(
                f"{table.path}: {' and '.join(columns)} are a complex number where a real one belongs: a point of "
                f"{space} has {described(space)}; name its columns one by one with --columns, or give a space of "
                "complex points, such as cp:1 for sphere:1"
            )
        # A column that is the real or imaginary part by its name.
        half = columns[0][:-3] + _HALVES.get(columns[0][-3:], "")
        if two and len(columns) == 1 and columns[0][-3:] in _HALVES:
            where = "in --columns" if given else "with numbers" if half in table.names else "in the table"
            raise Problem(
                f"{table.path}: column {columns[0]!r} is half of a complex number, and there is no {half!r} {where}"
            )


def _check_count(
    table: Table, entries: list[Entry], others: list[str | None], space: Space, lonlat: bool, given: bool
) -> None:
    if len(entries) == (2 if lonlat else len(complex_numbers(space))):
        return
    symmetric = isinstance(space, (SymmetricPositiveDefinite, LogEuclidean))
    symmetric = symmetric and 2 * len(entries) == space.point_shape[0] * (space.point_shape[0] + 1)
    advice = "" if given else "; say which with --columns, and --time if one holds the times"
    advice = "; name both sides of the matrix, such as --columns a,b,b,c for [[a, b], [b, c]]" if symmetric else advice
    known = {"", *table.numeric, *filter(None, others)}
    other = [name for name in table.names if name not in known]
    if other and not given:
        advice += f" (no numbers in the first row of {listed(other)})"
    turned = count_with_quaternion(space)
    either = f", or {turned} numbers with a quaternion" if turned else ""
    point = "longitude and latitude are 2 numbers" if lonlat else f"a point of {space} has {described(space)}{either}"
    kind = "numbers" if any(len(entry) > 2 for entry in entries) else "columns"
    found = f"{len(entries)} {kind}: {listed([name for name, *_ in entries])}" if entries else "no columns"
    raise Problem(f"{table.path}: {point}, and there are {found}{advice}")


def _quaternion_columns(names: list[str], space: Space, order: str | None) -> list[int]:
    """Return the column of every number of a point, where positions come first and quaternions have their scalar first.

    Raises
    ------
    Problem
        The names do not show which number is which, or contradict ``order``.
    """
    found = quaternion_by_names(names, space)
    given = None if order is None else in_order(space, ORDERS.index(order))
    if given is None and found is None:
        raise Problem(
            f"{listed(names)} may be a quaternion{' and a position' if len(names) > 4 else ''}, but the names do not "
            "say which number is which: call them qw, qx, qy, qz (and x, y, z), or say --quaternion wxyz or xyzw"
        )
    if given and found and given != found:
        raise Problem(f"--quaternion {order} contradicts the names {listed(names)}; omit it or rename them")
    return found or given or []

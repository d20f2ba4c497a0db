"""The columns of a table that hold times, points and names of curves."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import count
from shlex import quote
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.angles import from_lonlat
from .._base.exceptions import SymsplineError
from .._base.typing import Array
from .._core import ValidationError
from .._spaces import Doubles, LogEuclidean, Product, Space, SymmetricPositiveDefinite, Torus, factors_of, space_named
from .._spaces.degrees import TWO_TURNS, is_degrees
from ..convert._pose_files import join, rotations_in_rows
from ..geo import NAMED, are_tracks
from ._messages import Problem, Source, first_duplicate, for_command_line, listed, refuse
from ._tables import IM, RE, Place, Rows, Table

GLOBE, ROTATIONS, POSES = map(space_named, ("sphere:2", "so:3", "se:3"))
WITH_HEIGHT = space_named("sphere:2 x r:1")
LONLAT = ["lon", "lat"]
NUMBERED = "none"
"""The value of --time that numbers the points of every curve, unless a column has this name."""
JOINED = "none"
"""The value of --curve that makes one curve of all tracks of a file, unless a column has this name."""
ORDERS = ("wxyz", "xyzw")
_LON, _LAT = ("lon", "lng", "longitude", "location-long"), ("lat", "latitude", "location-lat")
_HEIGHTS = ("ele", "elevation", "alt", "altitude", "height", "height-above-ellipsoid", "height-above-msl")
# Longitudes may start at -180 or at 0, or continue across the date line. 400 is an error, and 999 a missing value.
_LARGEST = {"longitude": 360, "latitude": 90}
_IN_BRACKETS = re.compile(r"[(\[].*?[)\]]")
# Everything except the unit in names such as heading_deg or "heading (deg)".
_UNIT = re.compile(r".*[\[(_ ]|[\])]")
_NORMALISE = "; --atol 0.1 normalises quaternions that are only inaccurate, and --skipna omits those that are zero"
_OFF = re.compile(r"off the space by ([\d.e+-]+)")
_INACCURATE = 0.5
"""Distance from a space up to which points may be inaccurate and not wrong."""
_DEGREES = re.compile(r"[ _.-]*(degs?|degrees?|°)$")

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


@dataclass(frozen=True)
class Columns:
    """Names of columns, and what they hold.

    Attributes
    ----------
    points : list of str
        For every number of a point; for complex numbers without their endings.
    time, curve : str
        For times and for names of curves.
    lonlat : bool
        Whether points are longitude and latitude in degrees.
    utc : bool or None
        Whether dates had a time zone, and are written with a Z. None if that is not known.
    quaternion : list of int or None
        For rotations as quaternions the column of every number of a point, position first and scalar first.
    cut : bool
        Whether NAME/1, NAME/2, ... are the segments of one recording, which was cut at gaps.
    degrees : bool
        Whether angles of tori are in degrees.
    decimals : dict or None
        Number of decimals of every column in tables of text. None for all significant digits.
    """

    points: list[str]
    time: str = "time"
    curve: str = "curve"
    lonlat: bool = False
    utc: bool | None = None
    quaternion: list[int] | None = None
    cut: bool = False
    degrees: bool = False
    decimals: dict[str, int] | None = None


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
    # Stamps of ROS 2: header.stamp.sec and header.stamp.nanosec.
    beside = {re.sub("sec$", part, name) for name in usual for part in ("nanosec", "nsec") if name.endswith(".sec")}
    parts = [name for name in left if name in usual or _TIME_PART.fullmatch(name.lower()) or name in beside]
    doubtful = [name for name in parts if name not in certain]
    # A column of dates with their time of day needs no other columns.
    whole = len(certain) == 1 and certain[0] not in table.numeric and "time" in certain[0].lower()
    whole = whole and not _is_time_of_day(table.cells(certain[0], 1))
    if whole or (len(certain) == 1 and not doubtful):
        return certain[0]
    likely = [*certain, *doubtful] or [name for name in table.dates if name in left]
    if not likely:
        return None
    what = "hold the times" if len(likely) == 1 else "all belong to the times, which stand in one column"
    meant, unit = likely[0], ", with --unix if it counts from 1970" if likely[0] in table.numeric else ""
    if len(likely) == 2 and re.search("n(ano)?secs?$", _letters(likely[1])):
        meant, unit = ",".join(likely), ", which adds seconds and nanoseconds since 1970"
    if len(likely) == 2 and {*likely} <= {*table.dates} and any(map(_is_time_of_day, map(table.cells, likely, [1, 1]))):
        likely.sort(key=lambda name: _is_time_of_day(table.cells(name, 1)))
        meant, unit = ",".join(likely), ", which joins a date and a time of day"
    raise Problem(
        f"{table.path}: {listed(likely)} may {what}; say --time {quote(meant)}{unit}, or --time {NUMBERED} to number "
        "the points 0, 1, 2, ..."
    )


def _is_time_of_day(cells: Sequence[str]) -> bool:
    return bool(cells) and re.match(r"\d{1,2}:\d\d", cells[0]) is not None


def _letters(name: str) -> str:
    return re.sub("[^a-z]", "", _IN_BRACKETS.sub("", name).lower())


def with_stamps(table: Table, given: str | None, skipna: bool) -> tuple[Table, str | None]:
    """Return the table with one column of dates for two columns of seconds and nanoseconds, and its name.

    Rows without one of them are omitted if ``skipna`` is True.
    """
    names = split_names(given) if given is not None and given not in table.names else []
    if given is None or len(names) != 2:
        return table, given
    table = table.without_empty([*map(table.require, names)]) if skipna else table
    if any(name in table.dates and _DIGITS.search(table.cells(name, 1)[0]) for name in names):
        return _with_joined(table, names)
    stamps = table.read([*map(table.require, names)], None, None).numbers
    wrong = np.flatnonzero((stamps != np.floor(stamps)).any(axis=1) | (np.abs(stamps) > _FARTHEST).any(axis=1))
    if wrong.size:
        cells = " and ".join(f"{value:.17g}" for value in stamps[wrong[0]])
        what = "which are not whole seconds since 1970 and nanoseconds"
        raise Problem(f"{table.path}, {table.place(int(wrong[0]))}: --time {given}: the columns hold {cells}, {what}")
    seconds, rest = stamps.T.astype(np.int64)
    columns = {name: column for name, column in table.columns.items() if name not in names}
    time = given if "time" in columns else "time"
    columns[time] = (10**9 * seconds + rest).astype("datetime64[ns]")
    return replace(table, columns=columns, is_utc={**table.is_utc, time: True}), time


_DIGITS = re.compile(r"\d\D\d")
"""Matches dates and times of day, but not numbers of seconds."""


def _with_joined(table: Table, names: list[str]) -> tuple[Table, str]:
    """Return the table with one column for a date and a time of day, and its name."""
    days, clocks = map(table.labels, names)
    columns = {name: column for name, column in table.columns.items() if name not in names}
    time = ",".join(names) if "time" in columns else "time"
    columns[time] = np.array([f"{day} {clock}" for day, clock in zip(days, clocks, strict=True)], object)
    return replace(table, columns=columns), time


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


# ---- names of curves ----


def column_of_names(table: Table, time: str | None, used: Sequence[str | None]) -> str | None:
    """Return an unused column that may hold the names of several curves.

    Each of its values occurs in two rows or more. It distinguishes most of the rows of equal times or, if there are no
    times, it is a text whose values have one block of rows each.
    """
    times = np.empty(0) if time is None else table.times(time)[0]
    repeated = len(times) - len(np.unique(times))

    def fits(codes: NDArray[np.intp]) -> bool:
        if codes.max(initial=0) == 0 or np.bincount(codes).min() < 2:
            return False
        if time is None:
            return bool(np.count_nonzero(np.diff(codes)) == codes.max())
        if len(codes) != len(times):
            return False
        order = np.lexsort((times, codes))
        same = (np.diff(codes[order]) == 0) & (times[order][1:] == times[order][:-1])
        return bool(not same.any() or 2 * np.count_nonzero(same) < repeated)

    return _first_of(table, [*used, *(table.numeric if time is None else [])], fits)


def column_of_blocks(table: Table, used: Sequence[str | None]) -> str | None:
    """Return an unused column that may hold the names of tracks which follow each other in time.

    It has one block of at least two rows for each of its values, and is a text or has a name such as id.
    """
    unnamed = [name for name in table.numeric if not NAMED.search(name)]
    return _first_of(
        table, [*used, *unnamed], lambda codes: codes.max(initial=0) > 0 and bool(np.bincount(codes).min() > 1)
        and np.count_nonzero(np.diff(codes)) == codes.max()
    )  # fmt: skip


def column_of_tracks(table: Table, used: Sequence[str | None], space: Space, points: Any) -> str | None:
    """Return an unused column whose values seem to be the names of several tracks, in rows that are one curve.

    The path through all rows is then at least twice as long as the paths through the rows of each name.
    """

    def steps(order: Array) -> Array:
        before, after = (
            tuple(part[rows] for part in points) if isinstance(points, tuple) else points[rows]
            for rows in (order[:-1], order[1:])
        )
        return np.asarray(space.distance(before, after))

    unnamed = [name for name in table.numeric if not NAMED.search(name)]
    return _first_of(table, [*used, *unnamed], lambda codes: are_tracks(codes, steps))


def _first_of(table: Table, used: Sequence[str | None], fits: Callable[[NDArray[np.intp]], bool]) -> str | None:
    for name in table.names:
        # A cell may be empty, and some spaces have no distances.
        with suppress(Problem, SymsplineError):
            if name not in used and name not in table.dates and fits(table.codes(name)):
                return name
    return None


# ---- numbers of a point ----


def require_globe(space: Space) -> None:
    """Raise `Problem` unless the points of a space have longitude and latitude, and perhaps a height."""
    what = f"--lonlat is for sphere:2, and for {WITH_HEIGHT} with a height, "
    refuse(what, (space not in (GLOBE, WITH_HEIGHT), f"not for {space}"))


def in_degrees(factor: Space, lonlat: bool, degrees: bool) -> bool:
    """Whether distances on a factor of a space are in degrees, on the command line and in tables."""
    return (lonlat and factor == GLOBE) or (degrees and isinstance(factor, Torus))


_ACCURATE = 8
"""Significant digits that samples have at least, as data such as 1 are not as inaccurate as they look."""
_DOUBLE = 13
"""Numbers with more significant digits are as accurate as floating-point numbers."""


def decimals_of(names: Sequence[str], numbers: Doubles) -> dict[str, int] | None:
    """Return the number of decimals with which columns are written.

    They are two more than in the table, and at least eight significant digits. None if a column is in double precision.
    """
    decimals = {}
    for name, column in zip(names, numbers.T, strict=True):
        size = math.ceil(math.log10(max(float(np.abs(column).max()), 1e-300)))
        for places in range(max(0, _DOUBLE - size) + 1):
            scaled = column * 10.0**places
            # Both the number and its multiple are rounded.
            if (np.abs(scaled - np.rint(scaled)) <= 2 * np.spacing(np.abs(scaled))).all():
                decimals[name] = max(places + 2, _ACCURATE - size)
                break
        else:
            return None
    return decimals


def suggested(table: Table) -> str:
    """Suggest the space of the points in a table by the names of its columns."""
    with suppress(Problem):
        return f"columns {' and '.join(positions_in(table))} look like positions on the Earth: give --lonlat"
    names = [name for name in table.numeric if not _TIME.fullmatch(_letters(name))]
    for space, what in (("so:3", "a unit quaternion"), ("so:3 x r:3", "a position and a unit quaternion")):
        known = space_named(space)
        if len(names) == count_with_quaternion(known) and quaternion_by_names(names, known):
            return f"the columns look like {what}: give --space {quote(space)}"
    return ""


def complex_numbers(space: Space) -> list[bool]:
    """For every number of a point whether it is complex."""
    return [factor._complex for factor in factors_of(space) for _ in range(math.prod(factor.point_shape))]


def labels(space: Space) -> list[str]:
    """Name the numbers of a point x0, x1, … in vectors, m11, m12, … in a matrix, m1_11, … in several matrices."""
    factors = factors_of(space)
    several = sum(map(_is_matrix, factors)) > 1
    names: list[str] = []
    vectors, matrices = count(), count(1)
    for factor in factors:
        if _is_matrix(factor):
            start = f"m{next(matrices)}_" if several else "m"
            between = "_" if max(factor.point_shape) > 9 else ""
            names += [f"{start}{i + 1}{between}{j + 1}" for i, j in np.ndindex(*factor.point_shape)]
        else:
            names += [f"x{next(vectors)}" for _ in range(*factor.point_shape)]
    return names


def _described(space: Space) -> str:
    """Describe the numbers of a point and their order."""
    if isinstance(space, Product):
        parts = "; ".join(f"{factor}: {_described(factor)}" for factor in factors_of(space))
        return f"{len(labels(space))} numbers ({parts})"
    size = math.prod(space.point_shape)
    text = f"{size} {'complex number' if space._complex else 'number'}{'s' if size > 1 else ''}"
    text += f", A{RE} and A{IM} each" if space._complex else ""
    return f"{text}, a {_matrix(space)}" if _is_matrix(space) else text


def _matrix(space: Space) -> str:
    """Describe a matrix in columns; empty for vectors."""
    return f"{' x '.join(map(str, space.point_shape))} matrix row by row" if _is_matrix(space) else ""


def _is_matrix(space: Space) -> bool:
    return len(space.point_shape) > 1


# ---- quaternions ----


def count_with_quaternion(space: Space) -> int | None:
    """Count the numbers of a point whose rotation is a quaternion; None without exactly one rotation in space."""
    factors = factors_of(space)
    if sum(factor in (ROTATIONS, POSES) for factor in factors) != 1 or any(factor._complex for factor in factors):
        return None
    return sum(width(factor, True) for factor in factors)


def width(space: Space, quaternion: bool) -> int:
    """Count the columns of a point of a space, not a product."""
    if quaternion and space in (ROTATIONS, POSES):
        return 4 if space == ROTATIONS else 7
    return math.prod(space.point_shape) * (2 if space._complex else 1)


def _in_order(space: Space, scalar_last: int) -> list[int]:
    """Return `Columns.quaternion` for columns in the order of the factors, the scalar first (0) or last (1)."""
    columns: list[int] = []
    for factor in factors_of(space):
        numbers = list(range(len(columns), len(columns) + width(factor, True)))
        if factor in (ROTATIONS, POSES):
            numbers[-4:] = np.roll(numbers[-4:], scalar_last).tolist()
        columns += numbers
    return columns


def quaternion_by_names(names: Sequence[str], space: Space) -> list[int] | None:
    """Return `Columns.quaternion` for names that end in w, x, y and z after a common beginning; None for other names.

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
        turns = factor in (ROTATIONS, POSES)
        count = width(factor, True) - (4 if turns else 0)
        numbers, rest = rest[:count], rest[count:]
        by_letter = sorted(numbers, key=lambda i: plain[i][-1:])
        if [plain[i][-1:] for i in by_letter] == [*"xyz"]:
            numbers = by_letter
        elif factor == POSES:
            return None
        columns += numbers + (scalar_first if turns else [])
    return columns


def _quaternion_columns(names: list[str], space: Space, order: str | None) -> list[int]:
    """Return the column of every number of a point, where positions come first and quaternions have their scalar first.

    Raises
    ------
    Problem
        The names do not show which number is which, or contradict ``order``.
    """
    named = quaternion_by_names(names, space)
    given = None if order is None else _in_order(space, ORDERS.index(order))
    if given is None and named is None:
        raise Problem(
            f"{listed(names)} may be a quaternion{' and a position' if len(names) > 4 else ''}, but the names do not "
            "say which number is which: call them qw, qx, qy, qz (and x, y, z), or say --quaternion wxyz or xyzw"
        )
    contradicts = given and named and given != named
    refuse("--quaternion ", (contradicts, f"{order} contradicts the names {listed(names)}; omit it or rename them"))
    return named or given or []


# ---- Euler angles ----

_ANGLES = {"roll": "X", "pitch": "Y", "yaw": "Z", "heading": "Z"}
EULER = [first + second + third for first in "XYZ" for second in "XYZ" for third in "XYZ" if first != second != third]
"""Orders of rotations about the axes of the body; those with lower-case letters are about fixed axes."""


def with_quaternions(table: Table, order: str, given: list[str], others: Sequence[str | None], degrees: bool) -> Table:
    """Return the table with a unit quaternion qw, qx, qy, qz in place of three Euler angles."""
    names = [*map(table.require, given)] or [name for name in table.numeric if name not in others]
    known = [name for name in names if _bare(name) in _ANGLES]
    angles = known if len(known) == 3 else names[:3] if len(names) in (3, 6) else []
    refuse(
        table.path,
        (not angles, f": --euler {order} needs three angles, and there are {listed(names)}; name them with --columns"),
    )
    if angles == known:
        by_axis = {_ANGLES[_bare(name)]: name for name in known}
        wrong = f"--euler {order} does not suit the names {listed(known)}"
        refuse("", (sorted(by_axis) != sorted(order.upper()), wrong))
        angles = [by_axis[axis] for axis in order.upper()]
    total = np.eye(4)[[0] * table.height]
    for axis, name in zip(order, angles, strict=True):
        half = (np.radians(table.numbers(name)) if degrees else table.numbers(name)) / 2
        turn = np.zeros((table.height, 4))
        turn[:, 0], turn[:, 1 + "XYZ".index(axis.upper())] = np.cos(half), np.sin(half)
        # Rotations about fixed axes are applied from the left.
        total = _times(total, turn) if order.isupper() else _times(turn, total)
    columns = {name: column for name, column in table.columns.items() if name not in angles}
    return replace(table, columns=columns | dict(zip(QUATERNION, total.T, strict=True)))


QUATERNION = ["qw", "qx", "qy", "qz"]


def _times(p: Doubles, q: Doubles) -> Doubles:
    """Multiply quaternions, scalar first."""
    (a, u), (b, v) = ((x[:, :1], x[:, 1:]) for x in (p, q))
    return np.concatenate([a * b - (u * v).sum(1, keepdims=True), a * v + b * u + np.cross(u, v)], axis=1)


# ---- points ----

Entry = tuple[str, ...]
"""One number of a point: its name and its column, or the two columns with its real and imaginary part."""


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
    degrees : bool or None
        Whether angles of tori are in degrees. None if the user did not say so.
    atol : float or None
        Distance from the space within which points are projected. None for the usual one.
    """

    path: Source
    space: Space
    entries: list[Entry]
    lonlat: bool
    quaternion: list[int] | None
    degrees: bool | None = None
    atol: float | None = None

    @property
    def names(self) -> list[str]:
        """The name of every number."""
        return [name for name, *_ in self.entries]

    @property
    def used(self) -> list[str]:
        """All columns."""
        return [column for _, *columns in self.entries for column in columns]

    def are_zero(self, table: Table) -> NDArray[np.bool_]:
        """Return the rows of a table whose quaternion is zero, as some programs mark missing rotations."""
        ends = np.cumsum([width(factor, True) for factor in factors_of(self.space)])
        turned = [end for end, factor in zip(ends, factors_of(self.space), strict=True) if factor in (ROTATIONS, POSES)]
        columns = [self.used[i] for i in (self.quaternion or [])[turned[0] - 4 : turned[0]]]
        return np.asarray(np.all([table.numbers(name) == 0 for name in columns], axis=0))

    def read(self, numbers: Doubles, place: Place) -> Any:
        """Return the points in rows of these columns, projected onto the space if they are off it by rounding only.

        Raises
        ------
        Problem
            A point is farther off.
        """
        if self.lonlat:
            return self._on_globe(numbers, place)
        names = self.names
        if self.quaternion:
            numbers, names = numbers[:, self.quaternion], [names[i] for i in self.quaternion]
        else:
            # Complex numbers that have one column are real.
            counts = np.array([len(columns) for _, *columns in self.entries])
            missing = np.cumsum(counts)[np.array(complex_numbers(self.space)) & (counts == 1)]
            numbers = np.insert(numbers, missing, 0.0, axis=1)
        factors = factors_of(self.space)
        ends = np.cumsum([0, *(width(factor, bool(self.quaternion)) for factor in factors)]).tolist()
        parts = []
        for factor, start, end in zip(factors, ends, ends[1:], strict=False):
            columns = np.ascontiguousarray(numbers[:, start:end])
            if self.quaternion and factor in (ROTATIONS, POSES):
                rotations = rotations_in_rows(columns[:, -4:], self.path, place, self.atol, _NORMALISE)
                part = join(rotations, columns[:, :3]) if factor == POSES else rotations
            else:
                part = columns.view(factor.dtype).reshape(len(columns), *factor.point_shape)
            if isinstance(factor, Torus):
                self._refuse_degrees(factor, part, names[start:end] if len(names) == ends[-1] else [])
                part = np.radians(part) if self.degrees else part
            parts.append(self._projected(factor, part, place))
        return tuple(parts) if isinstance(self.space, Product) else parts[0]

    def _on_globe(self, numbers: Doubles, place: Place) -> Any:
        for (name, largest), values in zip(_LARGEST.items(), numbers[:, :2].T, strict=True):
            wild = np.flatnonzero(np.abs(values) > largest)
            if wild.size:
                raise Problem(
                    f"{self.path}, {place(int(wild[0]))}: {name} {values[wild[0]]:g} is not between -{largest} and "
                    f"{largest} degrees; omit missing values, or say with --columns LON,LAT which is which"
                )
        positions = from_lonlat(*numbers[:, :2].T)
        return (positions, np.ascontiguousarray(numbers[:, 2:])) if self.space == WITH_HEIGHT else positions

    def _refuse_degrees(self, torus: Space, angles: Array, names: Sequence[str]) -> None:
        """Raise `Problem` if angles of an unknown unit may be in degrees, by their values or their names."""
        largest = float(np.abs(angles).max(initial=0.0))
        named = [name for name in names if is_degrees(_UNIT.sub("", name))]
        if self.degrees is None and (largest > TWO_TURNS or named):
            why = f"the name {named[0]!r} means degrees" if named else f"angles up to {largest:g} may be in degrees"
            raise Problem(f"{self.path}: {why}, but angles on {torus} are in radians; give --degrees or --radians")

    def _projected(self, factor: Space, points: Array, place: Place) -> Array:
        doubles = factor._doubles(points, "points")
        lead = factor._lead(doubles)
        try:
            factor._handle.check_points(factor._rows(doubles, lead), lead, self.atol or factor._tol(points))
        except ValidationError as error:
            row, _, problem = for_command_line(error).removeprefix("point ").partition(" ")
            of = f"the part in {factor} of " if isinstance(self.space, Product) else ""
            order = f"; the columns of the table are a {_matrix(factor)}" if _is_matrix(factor) else ""
            # The distance is rounded in the message.
            far = _OFF.search(problem)
            off = float(f"{1.05 * float(far[1]):.1e}") if far else 1.0
            advice = f"; --atol {off:g} projects points that are only inaccurate" if off <= _INACCURATE else ""
            raise Problem(f"{self.path}: {of}the point in {place(int(row))} {problem}{order}{advice}") from None
        return factor.project(points)


def point_columns(
    table: Table, given: list[str], others: list[str | None], space: Space, lonlat: bool, order: str | None
) -> PointColumns:
    """Return the given columns of a point, or all other columns; ``order`` is that of a quaternion."""
    swapped = lonlat and len(given) >= 2 and _bare(given[0]) in _LAT and _bare(given[1]) in _LON
    right = ",".join([*given[1::-1], *given[2:]])
    refuse(f"--columns {','.join(given)}: ", (swapped, f"longitude comes first: --columns {right}"))
    groups = [table.expand(name) for name in given]
    if not given:
        groups = [_on_earth(table, space) if lonlat else table.points(others)]
    columns = [column for group in groups for column in group]
    # In a real space A_re and A_im are two numbers if both are named.
    groups = [columns] if any(complex_numbers(space)) else groups
    entries = [entry for group in groups for entry in _paired(group)]
    names, count = [name for name, *_ in entries], count_with_quaternion(space)
    for used in (columns, names):
        # A column may stand on both sides of a symmetric matrix.
        meant = dict.fromkeys(used) if any(map(_is_matrix, factors_of(space))) else used
        twice = first_duplicate([*filter(None, others), *meant])
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


def _bare(name: str) -> str:
    """Return the name of a column in lower case without its unit, such as of ``"Longitude (deg)"`` or ``lon_deg``."""
    return _DEGREES.sub("", _IN_BRACKETS.sub("", name).strip().lower())


def positions_in(table: Table) -> list[str]:
    """Return the columns of longitude and latitude, the first one of each pair of names."""
    names = {_bare(name): name for name in reversed(table.names)}
    columns = [next(filter(None, map(names.get, known)), None) for known in (_LON, _LAT)]
    if None in columns:
        raise Problem(
            f"{table.path}: --lonlat needs columns {' or '.join(_LON)}, and {' or '.join(_LAT)}, or two --columns; "
            f"there are {listed(table.names)}"
        )
    return [name for name in columns if name]


def height_in(table: Table) -> str | None:
    """Return the column of heights, if there is one."""
    names = {_bare(name): name for name in reversed(table.names) if name in table.numeric}
    return next(filter(None, map(names.get, _HEIGHTS)), None)


def _on_earth(table: Table, space: Space) -> list[str]:
    height = height_in(table)
    needs = f": {space} needs a column of heights, called {' or '.join(_HEIGHTS)}, or three --columns"
    refuse(table.path, (space == WITH_HEIGHT and height is None, needs))
    return [*positions_in(table), *([height] if height is not None and space == WITH_HEIGHT else [])]


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
                f"{space} has {_described(space)}; name its columns one by one with --columns, or give a space of "
                "complex points, such as cp:1 for sphere:1"
            )
        # A column that is the real or imaginary part by its name.
        half = columns[0][:-3] + {RE: IM, IM: RE}.get(columns[0][-3:], "")
        if two and len(columns) == 1 and columns[0].endswith((RE, IM)):
            where = "in --columns" if given else "with numbers" if half in table.names else "in the table"
            raise Problem(
                f"{table.path}: column {columns[0]!r} is half of a complex number, and there is no {half!r} {where}"
            )


def _check_count(
    table: Table, entries: list[Entry], others: list[str | None], space: Space, lonlat: bool, given: bool
) -> None:
    on_earth = 3 if space == WITH_HEIGHT else 2
    if len(entries) == (on_earth if lonlat else len(complex_numbers(space))):
        return
    symmetric = isinstance(space, (SymmetricPositiveDefinite, LogEuclidean))
    symmetric = symmetric and 2 * len(entries) == space.point_shape[0] * (space.point_shape[0] + 1)
    advice = "" if given else "; say which with --columns, and --time if one holds the times"
    advice = "; name both sides of the matrix, such as --columns a,b,b,c for [[a, b], [b, c]]" if symmetric else advice
    if sum(_bare(name) in _ANGLES for name, *_ in entries) == 3:
        advice += "; --euler ZYX --degrees reads roll, pitch and yaw in degrees"
    known = {"", *table.numeric, *filter(None, others)}
    other = [name for name in table.names if name not in known]
    if other and not given:
        advice += f" (no numbers in the first row of {listed(other)})"
    turned = count_with_quaternion(space)
    either = f", or {turned} numbers with a quaternion" if turned else ""
    earth = "longitude and latitude are 2 numbers" + ("" if space == GLOBE else ", and a height is the third")
    point = earth if lonlat else f"a point of {space} has {_described(space)}{either}"
    kind = "numbers" if any(len(entry) > 2 for entry in entries) else "columns"
    present = f"{len(entries)} {kind}: {listed([name for name, *_ in entries])}" if entries else "no columns"
    raise Problem(f"{table.path}: {point}, and there are {present}{advice}")

"""The rows of a table as curves to fit."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import CutLocusError, ValidationError
from ..spaces import Product, Space
from .curves import Columns
from .errors import Problem, with_names
from .layout import matrix, unflatten
from .points import from_degrees, onto
from .quaternions import points_of
from .recording import Repair, means
from .tables import Rows

Groups = Mapping[str, NDArray[np.int64]]

# What helps in Python only.
_ADVICE = re.compile(r"; use space\.project\(x\).*|, or raise max_iter| \(np\.[^()]*\)")

# From -180, from 0, or counted on where a track goes round the globe; what is beyond is a slip, such as 400, or
# stands for a place that is not known, such as 999.
_FARTHEST = 360

_NOTHING = Repair()


class Data:
    """Rows, curve by curve.

    Attributes:
        groups: names of the curves, in the order in which they begin, and the rows of each.
        named: whether these names mean something.
        joined, alone: how many rows had the time of another one, and how many points stood alone between gaps.
    """

    def __init__(
        self,
        path: Path,
        rows: Rows,
        repair: Repair = _NOTHING,
        repeats: bool = False,
        hint: Callable[[], str | None] = lambda: None,
    ) -> None:
        """With ``repeats`` several points of a curve may have one time; the hint is a column that may hold the names of
        several curves."""
        self._hint = hint
        self._path = path
        self._rows = rows
        self._repair = repair
        self.dedup = repair.dedup
        repair.check(bool(rows.times.size))
        self._runs = {name: repair.ordered(own, rows.times) for name, own in group(rows).items()}
        firsts = {name: own[starts] for name, (own, starts) in self._runs.items()}
        self.joined = sum(len(own) - len(starts) for own, starts in self._runs.values())
        for name, own in firsts.items():
            self._check_curve(name, own, repeats)
        self.groups, self.alone = repair.cut(firsts, rows.times, rows.labels is not None)
        self.named = rows.labels is not None or repair.max_gap is not None
        self.repeated = sum(_repeats(rows.times[own]) for own in firsts.values()) if repeats else 0
        if not self.groups:
            raise Problem(
                f"{path}: with --max-gap {repair.max_gap} every point stands alone; a curve needs two"
            )

    def curves(self, space: Space, columns: Columns) -> list[tuple[Any, Any]]:
        """Times and points of every curve."""
        times = self._rows.times
        points = self._places() if columns.lonlat else self._points(space, columns.quaternion)
        if self._repair.dedup == "mean":
            points = self._with_means(space, points)
        return [(times[own] if times.size else None, _picked(points, own)) for own in self.groups.values()]

    def located(self, message: str) -> str:
        """A message of the library, with lines of the file and names of curves instead of numbers."""
        found = re.search(r"\bcurve (\d+)", message)
        name = list(self.groups)[int(found[1]) if found else 0]
        own = self.groups[name]
        text = re.sub(
            r"points\[(\d+)\]", lambda m: f"the point in {self._rows.place(own[int(m[1])])}", message
        )
        text = re.sub(
            r"\bt\[(\d+)\] = (\S+)", lambda m: f"time {m[2]} in {self._rows.place(own[int(m[1])])}", text
        )
        called = f"curve {name!r}" if self.named else "the curve"
        text = text.replace(found[0], called) if found else text
        of_file = f"{self._path}: " if text != message else ""
        return of_file + _ADVICE.sub("", text)

    def _points(self, space: Space, quaternion: list[int] | None) -> Any:
        if quaternion is None:
            parts = unflatten(space, self._rows.numbers)
        else:
            parts = points_of(space, self._rows.numbers, quaternion, self._place)
        if not isinstance(space, Product):
            return self._onto(space, parts[0])
        pairs = zip(space.factors, parts, strict=True)
        return tuple(self._onto(factor, part, f"the part in {factor} of ") for factor, part in pairs)

    def _place(self, row: int) -> str:
        return f"{self._path}, {self._rows.place(row)}"

    def _onto(self, space: Space, points: NDArray[Any], of: str = "") -> NDArray[Any]:
        try:
            return onto(space, points)
        except ValidationError as error:
            text = re.sub(
                r"^point (\d+)", lambda m: f"{of}the point in {self._rows.place(int(m[1]))}", str(error)
            )
            order = f"; the columns of the table are a {matrix(space)}" if matrix(space) else ""
            raise Problem(f"{self._path}: {with_names(_ADVICE.sub('', text))}{order}") from None

    def _places(self) -> NDArray[np.float64]:
        degrees = self._rows.numbers
        wild = np.flatnonzero(np.abs(degrees[:, 0]) > _FARTHEST)
        if wild.size:
            where = self._rows.place(wild[0])
            raise Problem(
                f"{self._path}, {where}: longitude {degrees[wild[0], 0]:g} is not between -{_FARTHEST} and "
                f"{_FARTHEST} degrees; leave out what is missing"
            )
        off = np.flatnonzero(np.abs(degrees[:, 1]) > 90)
        if off.size:
            where = self._rows.place(off[0])
            raise Problem(
                f"{self._path}, {where}: latitude {degrees[off[0], 1]:g} is not between -90 and 90 degrees; "
                "say with --columns LON,LAT which column is which"
            )
        return from_degrees(degrees)

    def _with_means(self, space: Space, points: Any) -> Any:
        """The points, where the first of those with one time is their mean."""
        for name, (own, starts) in self._runs.items():
            if len(starts) == len(own):
                continue
            try:
                found = means(space, _picked(points, own), starts)
            except CutLocusError:
                of = f" of curve {name!r}" if self._rows.labels is not None else ""
                raise Problem(
                    f"{self._path}: points{of} with one time are too far apart to have a mean; --dedup first takes "
                    "the first of them"
                ) from None
            for all_points, mean in zip(*map(_as_tuple, (points, found)), strict=True):
                all_points[own[starts]] = mean
        return points

    def _check_curve(self, name: str, own: NDArray[np.int64], repeats: bool) -> None:
        """Raise `Problem` unless there are two points, and their times increase, or do not fall."""
        of = f" of curve {name!r}" if self._rows.labels is not None else ""
        if len(own) < 2:
            where = f", {self._rows.place(own[0])}" if len(own) else ""
            raise Problem(f"{self._path}{where}: this is the only point{of}; a curve needs two")
        if not self._rows.times.size:
            return
        times = self._rows.times[own]
        bad = np.flatnonzero(~((times[1:] > times[:-1]) | (repeats & (times[1:] == times[:-1]))))
        if bad.size:
            before, here = (self._rows.place(own[i]) for i in (bad[0], bad[0] + 1))
            same = times[bad[0] + 1] == times[bad[0]]
            column = self._hint()
            curves = "" if column is None else f"--curve {column} makes a curve of each {column}, "
            repair = "--dedup first or mean makes one point of them" if same else "--sort puts rows in order"
            raise Problem(
                f"{self._path}, {here}: time {times[bad[0] + 1]}{of} does not come after {times[bad[0]]} in {before}; "
                f"times must {'not fall' if repeats else 'increase'}; {curves}{repair}"
            )


def _repeats(times: NDArray[Any]) -> int:
    """How many times come again."""
    return int((times[1:] == times[:-1]).sum())


def group(rows: Rows) -> Groups:
    """The rows of every curve, which is the one curve "" if rows have no labels."""
    if rows.labels is None:
        return {"": np.arange(len(rows.numbers))}
    codes: dict[str, int] = {}
    of_row = np.array([codes.setdefault(label, len(codes)) for label in rows.labels], dtype=np.int64)
    order = np.argsort(of_row, kind="stable")
    return dict(zip(codes, np.split(order, np.cumsum(np.bincount(of_row))[:-1]), strict=True))


def _as_tuple(points: Any) -> tuple[Any, ...]:
    return points if isinstance(points, tuple) else (points,)


def _picked(points: Any, own: NDArray[np.int64]) -> Any:
    return tuple(part[own] for part in points) if isinstance(points, tuple) else points[own]

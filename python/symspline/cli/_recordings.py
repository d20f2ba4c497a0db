"""The rows of a table as curves to fit: sorted, merged and cut into segments as the user asked; probable outliers."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.exceptions import SymsplineError
from .._base.time import time_axis_of
from .._core import CutLocusError
from .._smoothing import SmoothingSpline
from .._smoothing.segments import cut
from .._spaces import Doubles, Product, Space, factors_of
from .._splines.cubic import CubicSpline
from ..geo import ZIGZAG
from ._columns import GLOBE, PointColumns, column_of_names, column_of_tracks
from ._messages import Problem, counted, refuse
from ._tables import Rows, Table, codes_of
from ._times import longest_gap

Index = NDArray[np.int64]

_FAST, _FAR = 10.0, 10.0
"""Multiples of the median speed and of the median distance from a smooth curve that outliers exceed."""
_ROUNDING = 1e-9
"""Distances that are a smaller part of the largest component of a point are rounding errors."""
_FEWEST = 8
"""The smallest number of points of a curve that is searched for outliers."""


def group(rows: Rows) -> Mapping[str, Index]:
    """Return the rows of every curve, which is one curve named "" if rows have no labels."""
    if rows.labels is None:
        return {"": np.arange(max(len(rows.numbers), len(rows.times)))}
    codes = codes_of(rows.labels)
    order = np.argsort(codes, kind="stable")
    return dict(zip(dict.fromkeys(rows.labels), np.split(order, np.cumsum(np.bincount(codes))[:-1]), strict=True))


class Recordings:
    """The curves in the rows of a table.

    Attributes
    ----------
    path : Source
        File of the table.
    space : Space
    curves : list of tuple
        Times and points of each curve.
    groups : dict
        Name and rows of each curve, in the order in which the curves begin.
    named, has_times : bool
        Whether these names have a meaning, and whether there is a column of times.
    merged, alone, repeated, empty : int
        Numbers of rows: those merged with another row of the same time, single points between gaps, which are omitted,
        those that share their time with another row of noisy data, and those omitted because of empty cells.
    """

    def __init__(
        self, table: Table, rows: Rows, time: str | None, columns: PointColumns, options: Namespace, omitted: int
    ) -> None:
        self.path, self.space = table.path, columns.space
        self._table, self._rows, self._time, self._options = table, rows, time, options
        self._used, self._points = [time, *columns.used], columns.read(rows.numbers, rows.place)
        self.has_times = time is not None
        self.named = rows.labels is not None or options.max_gap is not None
        self.merged = self.alone = self.repeated = 0
        self.empty = omitted
        self.curves: list[tuple[Any, Any]] = []
        self.groups: dict[str, Index] = {}
        asked = next((name for name in ("sort", "dedup", "max_gap") if getattr(options, name)), "")
        needs = f"--{asked.replace('_', '-')} needs times, and there is no column of times; say which with --time"
        refuse("", (asked and not self.has_times, needs))
        groups = group(rows)
        for name, index in groups.items():
            if options.sort:
                index = index[np.argsort(rows.times[index], kind="stable")]
            segments = self._segments(index, f" of curve {name!r}" if rows.labels is not None else "")
            for number, (curve, kept) in enumerate(segments, 1):
                new = name
                if options.max_gap is not None and rows.labels is None:
                    new = str(number)
                elif len(segments) > 1:
                    new = f"{name}/{number}"
                if new in self.groups or (new != name and new in groups):
                    raise Problem(f"--max-gap: two curves would have the name {new!r}")
                self.groups[new] = kept
                self.curves.append(curve)
        if not self.groups:
            steps = np.concatenate([np.diff(rows.times[index]) for index in groups.values()])
            unit, step = (" s", steps / np.timedelta64(1, "s")) if steps.dtype.kind == "m" else ("", steps)
            alone = f"with --max-gap {options.max_gap} every point is alone"
            raise Problem(f"{self.path}: {alone}; the median step is {np.median(step):.6g}{unit}")

    def _segments(self, index: Index, of: str) -> list[tuple[tuple[Any, Any], Index]]:
        """Return the curves in the rows of one name, and the rows of each."""
        options, smooth = self._options, self._options.smooth
        times = self._rows.times[index] if self.has_times else None
        again = np.zeros(len(index), bool)
        if times is not None:
            again[1:] = times[1:] == times[:-1]
        first = index if options.dedup is None else index[~again]
        self._check(first, of)
        self.merged += len(index) - len(first)
        self.repeated += int(again.sum()) if smooth and options.dedup is None else 0
        given = self._points
        points = tuple(part[index] for part in given) if isinstance(given, tuple) else given[index]
        if times is None or (options.dedup is None and options.max_gap is None):
            return [((times, points), index)]
        gap = np.inf if options.max_gap is None else longest_gap(options.max_gap, times.dtype.kind == "M")
        used = np.ones(len(index), bool) if smooth else None
        try:
            found = cut(times, points, self.space, gap, 2, options.dedup or "raise", used)
        except CutLocusError:
            far = f"points{of} with one time are too far apart to have a mean; --dedup first takes the first of them"
            raise Problem(f"{self.path}: {far}") from None
        self.alone += len(first) - sum(map(len, found.rows))
        return [(curve, index[kept]) for curve, kept in zip(found.curves, found.rows, strict=True)]

    def _check(self, index: Index, of: str) -> None:
        """Raise `Problem` unless there are two points whose times increase, or do not decrease."""
        if len(index) < 2:
            where = f", {self.place(int(index[0]))}" if len(index) else ""
            raise Problem(f"{self.path}{where}: this is the only point{of}; a curve needs two")
        if not self.has_times:
            return
        times, smooth = self._rows.times[index], self._options.smooth
        bad = np.flatnonzero(~((times[1:] > times[:-1]) | (smooth & (times[1:] == times[:-1]))))
        if bad.size:
            i = bad[0]
            before, here = self.place(int(index[i])), self.place(int(index[i + 1]))
            column = self._names()
            curves = "" if column is None else f"--curve {column} fits one curve per {column}; otherwise "
            same, zone = times[i + 1] == times[i], " UTC" if self._rows.utc else ""
            repair = "--dedup first or mean makes one point of them" if same else "--sort puts the rows in order"
            raise Problem(
                f"{self.path}, {here}: time {times[i + 1]}{zone}{of} does not come after {times[i]} in {before}; "
                f"times must {'not decrease' if smooth else 'increase'}; {curves}{repair}"
            )

    def _names(self) -> str | None:
        """Return a column that may hold the names of several curves."""
        return column_of_names(self._table, self._time, self._used) if self._rows.labels is None else None

    def doubt(self) -> str:
        """Describe why rows that became one curve may be several; empty without a reason."""
        same = self.merged or self.repeated
        column = self._names() if same or not self.has_times else None
        if column is not None:
            what = f"{same} rows have a time that another row has, and column {column!r} distinguishes them"
            what = what if same else f"column {column!r} has one block of rows for each of its texts"
            return f"{what}: if the table holds several tracks, fit each of them with --curve {column}"
        if self._rows.labels is None:
            column = column_of_tracks(self._table, self._used, self.space, self._points)
        return (
            ""
            if column is None
            else (
                f"{self.path}: the path through all rows is more than {ZIGZAG:g} times as long as the paths of each "
                f"{column!r}; if the table holds several tracks, fit each of them with --curve {column}"
            )
        )

    def changes(self) -> str:
        """Describe the rows that were merged or omitted, which the curves do not show."""
        dedup = self._options.dedup
        same = "merged with others of the same time" if dedup == "mean" else "omitted after another of their time"
        counts = (
            (self.empty, "with empty cells omitted (--skipna)"),
            (self.merged, f"{same} (--dedup {dedup})"),
            (self.alone, "alone between gaps omitted"),
        )
        return "".join(f"; {counted(count, 'row')} {what}" for count, what in counts if count)

    def place(self, row: int) -> str:
        """Describe the position of a row in the file."""
        return self._rows.place(row)

    def located(self, note: Any) -> str:
        """Return the message of an error or a warning with lines of the file and names instead of numbers.

        ``note`` has the fields of a `SymsplineError`.
        """
        curve, node, fitted = (getattr(note, field, None) for field in ("curve", "node", "spline"))
        number = curve[0] if curve else 0
        name, index = list(self.groups.items())[number]
        times = fitted[number].t if isinstance(fitted, list) else ()
        text = str(note)
        # A message is about a node and its neighbours.
        for i in () if node is None else range(max(node - 1, 0), min(node + 2, len(index))):
            place = self.place(int(index[i]))
            text = text.replace(f"points[{i}]", f"the point in {place}")
            if i < len(times):
                text = text.replace(f"t[{i}] = {times[i]}", f"time {times[i]} in {place}")
        if curve:
            text = text.replace(f"curve {number}", f"curve {name!r}" if self.named else "the curve")
        return f"{self.path}: {text}" if text != str(note) else text


# ---- outliers ----


def outliers(data: Recordings, curves: Sequence[CubicSpline] | None, lonlat: bool) -> str:
    """Describe the rows that are probably outliers, with a remedy; empty if there are none.

    ``curves`` are those that were fitted, or None if the fit failed. Points are compared with a smooth curve, or with
    their neighbours.
    """
    found: list[tuple[int, float, float]] = []
    smooth = curves if curves is not None and isinstance(curves[0], SmoothingSpline) else None
    for i, (index, (times, points)) in enumerate(zip(data.groups.values(), data.curves, strict=True)):
        if len(index) < _FEWEST:
            continue
        # Not all spaces have distances between all points.
        with suppress(SymsplineError):
            near = None if smooth is None else smooth[i](times)
            several = isinstance(data.space, Product)
            parts = points if several else (points,)
            beside = [None] * len(parts) if near is None else near if several else (near,)
            for space, part, curve in zip(factors_of(data.space), parts, beside, strict=True):
                far, sizes, usual = _spikes(space, times, part) if curve is None else _far(space, part, curve)
                found += [(int(index[k]), float(sizes[k]), usual) for k in np.flatnonzero(far)]
    if not found:
        return ""
    row, *lengths = found[0]
    scale, unit = (180 / np.pi, "°") if lonlat and data.space == GLOBE else (1.0, "")
    size, usual_size = (f"{scale * length:.3g}{unit}" for length in lengths)
    where = f"{size} from its neighbours, and most steps are {usual_size}"
    remedy = "omit outliers, or fit near the points with --smooth --robust"
    if smooth is not None:
        where = f"{size} from the curve, and half of the points are within {usual_size}"
        remedy = "--robust reduces the influence of outliers"
    rest = len({k for k, *_ in found}) - 1
    others = f" (and in {counted(rest, 'other row')})" if rest else ""
    return f"{data.place(row)}: the point is probably an outlier{others}, {where}; {remedy}"


def _spikes(space: Space, times: Any, points: Any) -> tuple[NDArray[np.bool_], Doubles, float]:
    """Return which points are far from both neighbours, which are closer to each other, and the usual step."""
    steps = np.asarray(space.distance(points[1:], points[:-1]))
    lengths = np.ones(len(steps))
    if times is not None:
        axis, knots = time_axis_of(times)
        lengths = np.diff(axis.knots(knots))
        lengths = np.maximum(lengths, 1e-3 * lengths.mean())
    found = np.zeros(len(points), bool)
    if not lengths.min() > 0:
        return found, found.astype(np.float64), 0.0
    speeds = steps / lengths
    sizes, slowest = (np.r_[0.0, np.minimum(both[1:], both[:-1]), 0.0] for both in (steps, speeds))
    usual = float(np.median(speeds))
    fast = np.flatnonzero((slowest > _FAST * usual) & (usual > 0))
    around = space.distance(points[fast + 1], points[fast - 1])
    found[fast] = sizes[fast] > np.maximum(around, _ROUNDING * np.abs(points).max())
    return found, sizes, float(np.median(steps))


def _far(space: Space, points: Any, near: Any) -> tuple[NDArray[np.bool_], Doubles, float]:
    """Return which points are far from a curve, their distances, and the distance within which most points are."""
    distances = np.asarray(space.distance(points, near))
    usual = float(np.median(distances))
    return distances > max(_FAR * usual, _ROUNDING * np.abs(points).max()), distances, usual

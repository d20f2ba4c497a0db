"""The rows of a table as curves to fit: sorted, merged and cut into segments as the user asked."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import CutLocusError
from .._smoothing.segments import cut
from .._spaces import Space
from ._messages import Problem, refuse
from ._summary import counted
from ._tables import Rows
from ._times import longest_gap

Index = NDArray[np.int64]
Hint = Callable[[], str | None]


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

    def __init__(self, path: object, rows: Rows, points: Any, space: Space, options: Namespace, hint: Hint) -> None:
        """Read the curves. ``hint`` returns a column that may hold the names of several curves."""
        self.path, self._rows, self._points, self.space, self._hint = path, rows, points, space, hint
        self._options, self._smooth, self.has_times = options, options.smooth, rows.times.size > 0
        self.named = rows.labels is not None or options.max_gap is not None
        self.merged = self.alone = self.repeated = self.empty = 0
        self.curves: list[tuple[Any, Any]] = []
        self.groups: dict[str, Index] = {}
        asked = next((name for name in ("sort", "dedup", "max_gap") if getattr(options, name)), "")
        needs = f"--{asked.replace('_', '-')} needs times, and there is no column of times; say which with --time"
        refuse("", (asked and not rows.times.size, needs))
        groups = group(rows)
        for name, own in groups.items():
            if options.sort:
                own = own[np.argsort(rows.times[own], kind="stable")]
            segments = self._segments(own, f" of curve {name!r}" if rows.labels is not None else "")
            for number, (curve, kept) in enumerate(segments, 1):
                part = name if len(segments) == 1 else f"{name}/{number}"
                new = name if options.max_gap is None else part if rows.labels is not None else str(number)
                if new in self.groups or (new != name and new in groups):
                    raise Problem(f"--max-gap: two curves would have the name {new!r}")
                self.groups[new] = kept
                self.curves.append(curve)
        if not self.groups:
            raise Problem(f"{path}: with --max-gap {options.max_gap} every point is alone{self._usual_step(groups)}")

    def _usual_step(self, groups: Mapping[str, Index]) -> str:
        steps = np.concatenate([np.diff(self._rows.times[own]) for own in groups.values()])
        unit, dates = np.timedelta64(1, "s"), steps.dtype.kind == "m"
        return f"; the median step is {np.median(steps / unit if dates else steps):.6g}{' s' if dates else ''}"

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
        name, own = list(self.groups.items())[number]
        times = fitted[number].t if isinstance(fitted, list) else ()
        text = str(note)
        # A message is about a node and its neighbours.
        for i in () if node is None else range(max(node - 1, 0), min(node + 2, len(own))):
            place = self.place(int(own[i]))
            text = text.replace(f"points[{i}]", f"the point in {place}")
            if i < len(times):
                text = text.replace(f"t[{i}] = {times[i]}", f"time {times[i]} in {place}")
        if curve:
            text = text.replace(f"curve {number}", f"curve {name!r}" if self.named else "the curve")
        return f"{self.path}: {text}" if text != str(note) else text

    def _segments(self, own: Index, of: str) -> list[tuple[tuple[Any, Any], Index]]:
        """Return the curves in the rows of one name, and the rows of each."""
        options, times = self._options, self._rows.times[own] if self._rows.times.size else None
        again = np.zeros(len(own), bool)
        if times is not None:
            again[1:] = times[1:] == times[:-1]
        first = own if options.dedup is None else own[~again]
        self._check(first, of)
        self.merged += len(own) - len(first)
        self.repeated += int(again.sum()) if self._smooth and options.dedup is None else 0
        given = self._points
        points = tuple(part[own] for part in given) if isinstance(given, tuple) else given[own]
        if times is None or (options.dedup is None and options.max_gap is None):
            return [((times, points), own)]
        gap = np.inf if options.max_gap is None else longest_gap(options.max_gap, times.dtype.kind == "M")
        used = np.ones(len(own), bool) if self._smooth else None
        try:
            found = cut(times, points, self.space, gap, 2, options.dedup or "raise", used)
        except CutLocusError:
            raise Problem(
                f"{self.path}: points{of} with one time are too far apart to have a mean; --dedup first takes the "
                "first of them"
            ) from None
        self.alone += len(first) - sum(map(len, found.rows))
        return [(curve, own[kept]) for curve, kept in zip(found.curves, found.rows, strict=True)]

    def _check(self, own: Index, of: str) -> None:
        """Raise `Problem` unless there are two points whose times increase, or do not decrease."""
        if len(own) < 2:
            where = f", {self._rows.place(int(own[0]))}" if len(own) else ""
            raise Problem(f"{self.path}{where}: this is the only point{of}; a curve needs two")
        if not self._rows.times.size:
            return
        times = self._rows.times[own]
        bad = np.flatnonzero(~((times[1:] > times[:-1]) | (self._smooth & (times[1:] == times[:-1]))))
        if bad.size:
            i = bad[0]
            before, here = self._rows.place(int(own[i])), self._rows.place(int(own[i + 1]))
            column = self._hint()
            curves = "" if column is None else f"--curve {column} fits one curve per {column}; otherwise "
            same, zone = times[i + 1] == times[i], " UTC" if self._rows.utc else ""
            repair = "--dedup first or mean makes one point of them" if same else "--sort puts the rows in order"
            raise Problem(
                f"{self.path}, {here}: time {times[i + 1]}{zone}{of} does not come after {times[i]} in {before}; "
                f"times must {'not decrease' if self._smooth else 'increase'}; {curves}{repair}"
            )


def group(rows: Rows) -> Mapping[str, Index]:
    """Return the rows of every curve, which is one curve named "" if rows have no labels."""
    if rows.labels is None:
        return {"": np.arange(max(len(rows.numbers), len(rows.times)))}
    codes = {label: code for code, label in enumerate(dict.fromkeys(rows.labels))}
    of_row = np.fromiter(map(codes.__getitem__, rows.labels), np.int64, len(rows.labels))
    order = np.argsort(of_row, kind="stable")
    return dict(zip(codes, np.split(order, np.cumsum(np.bincount(of_row))[:-1]), strict=True))

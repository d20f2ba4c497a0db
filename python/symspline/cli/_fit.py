"""Fit C² splines to the points in a table, through them or, with --smooth, near them

A table is a CSV, NPZ or Parquet file or a TUM trajectory; the ending of its name selects the format. Every row is a
point at a time. Times are numbers, or ISO dates such as 2021-08-29, 2021-08-29 16:55 or 2021-08-29T16:55:00.5+02:00,
all written in the same way. Dates with Z or an offset are converted to UTC, and rates are per second.

The numbers of a point are in columns in the order of its array, and --columns names them in that order: a matrix
row by row, in a product one factor after the other. A complex number A has the columns A_re and A_im, which --columns
calls A, or one column A if it is real. Points within 1e-4 of the space are projected onto it. A rotation of so:3 may
also be a unit quaternion in columns whose names end in w, x, y and z, in any order, and a pose of se:3 or so:3 x r:3
a position, such as tx, ty, tz, and a quaternion.

Without --time, the times are in the column t or time, or, if they are dates, in a column that is called time, date,
datetime or timestamp, in the plural or with words such as iso, utc, unix, base, local, ns: ISO_TIME, "Date (UTC)".
The command asks if another column seems to hold times. Without any, times are 0, 1, 2, ...

CSV files name the columns in their first line; blank lines are skipped. In an NPZ file columns are arrays with one
entry per row, which may be complex, or vectors or matrices; an array `points` may hold all numbers of the points. A
.tum or .txt file is a trajectory of the TUM benchmark: time tx ty tz qx qy qz qw.

Curves pass through the points. --smooth is for noisy points: the curve passes near them, as smooth as the data
suggest, and symspline sample also writes its standard deviation.

examples:
  symspline fit track.csv --lonlat -o track.npz
  symspline fit storms.csv --lonlat --time date --curve storm -o storms.npz
  symspline fit attitude.parquet --space so:3 --columns w,x,y,z --bc-type not-a-knot -o attitude.npz
  symspline fit states.csv --space cp:1 --columns up,down -o states.npz
  symspline fit gps.csv --lonlat --smooth -o gps.npz

symspline.load reads the curve in Python; with --curve or --max-gap, it returns a dictionary of all curves by name.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .._cubic import CubicSpline
from .._exceptions import SymsplineError
from .._functional import fit_many
from .._report import long_gaps
from .._representatives import IN_PYTHON
from .._smoothing import SmoothingSpline, SmoothingWarning
from .._smoothing.many import smooth_many
from .._spaces import Space, space_named
from . import _smoothing
from ._columns import ORDERS, check_days, column_of_names, completed, point_entries, split_names, time_column
from ._curves import ENDING, Curves, write_curves
from ._errors import Problem, check_target
from ._points import GLOBE, Columns, points_of, require_globe
from ._recordings import Recordings
from ._tables import check_ending, open_table
from ._terminal import Progress, say
from ._times import number

_FOR_ROTATIONS = "For rotations give --space so:3, or rp:3, where signs do not count"
_EXTRAPOLATE: dict[str, Any] = {"continue": True, "geodesic": "geodesic", "periodic": "periodic"}
_METHODS = "auto (default), quasi-newton, newton, homotopy or fixed-point"
_ENDS = "natural (default), not-a-knot, clamped, periodic; or two of the first three with a comma, for start and end"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline fit``."""
    add = parser.add_argument
    add("input", type=Path, metavar="IN", help="table to read: .csv, .npz, .parquet, .tum or .txt")
    add("--space", metavar="S", help="such as sphere:2, so:3, spd:3, cp:1 or 'so:3 x r:3'")
    add("--time", metavar="COL", help="column of times, or none for 0, 1, 2, ...; see above for the default")
    add("--columns", metavar="A,B,...", help="columns of a point (default: all other numeric columns)")
    add("--curve", metavar="COL", help="column of names: the rows with one name are one curve")
    add("--lonlat", action="store_true", help="points on sphere:2 are longitude and latitude in degrees")
    add("--quaternion", choices=ORDERS, help="order of a quaternion, if the names do not show it")
    add("--sort", action="store_true", help="put the rows of every curve in the order of their times")
    add("--dedup", choices=("first", "mean"), help="keep the first of the points of one time, or their mean")
    add(
        "--max-gap",
        metavar="DT",
        help="cut curves at longer gaps between neighbouring times: a number or, for dates, a duration such as 12h; "
        "the segments are curves 1, 2, ... or, with --curve, NAME/1, NAME/2, ...; single points are omitted",
    )
    add("--bc-type", default="natural", metavar="END", help=_ENDS)
    add("--method", default="auto", metavar="M", help=_METHODS)
    add("--tol", type=number, help="relative C² residual that counts as converged (default: 1e-12)")
    add("--extrapolate", choices=_EXTRAPOLATE, help="continue the last segment outside the times, or go on along a "
        "geodesic, or periodically (default: times outside are an error)")  # fmt: skip
    _smoothing.add_arguments(parser)
    add("-o", dest="output", type=Path, metavar="OUT", required=True, help="file of curves to write: .npz")


def run(options: argparse.Namespace) -> int:
    """Read, fit and write."""
    check_ending(options.output, ENDING, "a file of curves")
    check_target(options.output)
    smooth = _smoothing.smoothing_options(options)
    space = _space(options.space, options.lonlat)
    table = open_table(options.input)
    curve = table.require(options.curve) if options.curve is not None else None
    given = split_names(options.columns)
    time = time_column(table, options.time, [curve, *given])
    entries, order = point_entries(table, given, [time, curve], space, options.lonlat, options.quaternion)
    used = [column for entry in entries for column in entry.columns]
    rows = table.read(used, time, curve)
    check_days(table, time, rows)
    numbers = rows.numbers if options.lonlat or order else completed(rows.numbers, entries, space)
    names = [entry.name for entry in entries]
    columns = Columns(names, time or "time", curve or "curve", options.lonlat, rows.utc, order)
    points = points_of(space, numbers, columns, table.path, rows.place)
    hint = partial(column_of_names, table, time, [time, *used]) if curve is None else lambda: None
    data = Recordings(table.path, rows, points, space, options, hint)
    fitted = _fitted(data, space, options, smooth)
    write_curves(options.output, Curves(dict(zip(data.groups, fitted, strict=True)), data.named, columns))
    smoothed = [spline for spline in fitted if isinstance(spline, SmoothingSpline)]
    what = _smoothing.summary(smoothed, options.lonlat) if smoothed else _summary(fitted)
    print(f"{options.output}: {what}{_prepared(data, options.dedup)}{_gaps(fitted)}")
    same = data.merged or data.repeated
    column = hint() if same else None
    if column is not None:
        say(
            f"{same} rows have a time that another row has, and column {column!r} distinguishes them: if the table "
            f"holds several tracks, fit each of them with --curve {column}"
        )
    return 0


def _space(name: str | None, lonlat: bool) -> Space:
    if name is None and not lonlat:
        raise Problem("say which space the points are on with --space, such as --space sphere:2")
    space = GLOBE if name is None else space_named(name)
    if lonlat:
        require_globe(space)
    return space


def _fitted(
    data: Recordings, space: Space, options: argparse.Namespace, smooth: dict[str, Any] | None
) -> Sequence[CubicSpline]:
    """All curves, fitted in one call."""
    common: dict[str, Any] = {"extrapolate": _EXTRAPOLATE.get(options.extrapolate)}
    ends = _bc_type(options.bc_type)
    tol = {} if options.tol is None else {"tol": options.tol}
    fitted: Sequence[CubicSpline]
    try:
        with warnings.catch_warnings(record=True) as noted, Progress("fitting") as progress:
            # The summary counts the curves whose λ is at a bound.
            warnings.simplefilter("ignore", SmoothingWarning)
            common["progress"] = progress
            if smooth is None:
                fitted = fit_many(data.curves, space, bc_type=ends, method=options.method, **tol, **common)
            else:
                fitted = smooth_many([(*curve, {}) for curve in data.curves], space, **common, **smooth)
    except SymsplineError as error:
        raise error._with_message(data.located(error)) from None
    for note in noted:
        say(data.located(note.message).replace(IN_PYTHON, _FOR_ROTATIONS))
    return fitted


def _bc_type(text: str) -> Any:
    ends = tuple(end.strip() for end in text.split(","))
    if ends != ("periodic",) and (len(ends) > 2 or not set(ends) <= {"natural", "not-a-knot", "clamped"}):
        raise Problem(f"--bc-type {text}: give {_ENDS.replace(' (default)', '')}")
    return ends[0] if len(ends) == 1 else ends


def _prepared(data: Recordings, dedup: str | None) -> str:
    """Report the rows that were merged or omitted, which the curves do not show."""
    same = "merged with others of the same time" if dedup == "mean" else "omitted after another of their time"
    counts = ((data.merged, f"{same} (--dedup {dedup})"), (data.alone, "alone between gaps omitted"))
    return "".join(f"; {count} row{'s' if count > 1 else ''} {what}" for count, what in counts if count)


def _gaps(splines: Sequence[CubicSpline]) -> str:
    """Report steps that are far longer than most, across which nothing was measured."""
    found = []
    for spline in splines:
        times = spline._times
        if isinstance(spline, SmoothingSpline):
            times = np.unique(spline._noisy.times[spline._noisy.used])
        found += np.diff(times)[long_gaps(times)].tolist()
    if not found:
        return ""
    gaps = f"{len(found)} long gap{'s' if len(found) > 1 else ''}"
    unit = " s" if splines[0].t.dtype.kind == "M" else ""
    return f"; {gaps}, up to {max(found):.4g}{unit} (--max-gap cuts there)"


def _summary(splines: Sequence[CubicSpline]) -> str:
    reports = [spline.report for spline in splines]
    iterations, residual = max(r.iterations for r in reports), max(r.residual for r in reports)
    many, most = ("s", "at most ") if len(splines) > 1 else ("", "")
    return (
        f"{len(splines)} curve{many} through {sum(len(spline.t) for spline in splines)} points of {splines[0].space}, "
        f"converged: {reports[0].method}, {most}{iterations} iterations, residual {most}{residual:.1e}"
    )

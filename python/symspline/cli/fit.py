"""``symspline fit``: a table of points becomes a file of curves."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from .._core import ConvergenceError, CutLocusError, ValidationError
from ..functions import fit_many
from ..report import long_gaps
from ..signs import IN_PYTHON
from ..smoothing import SmoothingSpline, SmoothingWarning
from ..smoothing.many import smooth_many
from ..spaces import Space
from ..spaces import space as space_named
from ..spline import CubicSpline
from . import smoothing
from .curves import ENDING, Columns, Curves, write_curves
from .data import Data
from .entries import completed
from .errors import Problem, check_target, say
from .formats import open_table
from .numbers import real
from .points import GLOBE, require_globe
from .progress import Progress
from .quaternions import ORDERS
from .recording import Repair
from .roles import named_columns, point_entries, split_names
from .tables import ending
from .time_columns import check_days, column_of_names, time_column

SUMMARY = "fit C2 splines to the points in a table, through them or, with --smooth, near them"
DESCRIPTION = """\
Fit C2 splines to the points in a table: CSV, NPZ or Parquet, by the ending of its name.

Every row is a point at a time. Columns of a CSV file are named in its first line; blank lines are skipped.
Times are numbers, or ISO dates such as 2021-08-29, 2021-08-29 16:55 or 2021-08-29T16:55:00.5+02:00, all
written in the same way; those with Z or an offset become UTC, and rates are per second.

The numbers of a point stand in columns in the order of its array, and --columns names them in that order: a
matrix row by row, in a product one factor after the other. A complex number A has the columns A_re and A_im,
which --columns calls A, or one column A if it is real. Points that are off the space by no more than 1e-4, as
rounding in a file makes them, are moved onto it. A rotation of so:3 may also be a unit quaternion in columns whose
names end in w, x, y and z, in any order, and a pose of se:3 or so:3 x r:3 a place, such as tx, ty, tz, and a
quaternion. A .tum or .txt file is a trajectory of the TUM benchmark: time tx ty tz qx qy qz qw.

Curves go through the points. --smooth is for noisy ones: the curve passes near them, as smooth as the data say, and
symspline sample writes its standard deviation, too.

In an NPZ file columns are arrays with one entry a row, which may be complex, or vectors or matrices; an array
`points` may hold all numbers of the points."""
EPILOG = """\
examples:
  symspline fit track.csv --lonlat -o track.npz
  symspline fit storms.csv --lonlat --time date --curve storm -o storms.npz
  symspline fit attitude.parquet --space so:3 --columns w,x,y,z --bc-type not-a-knot -o attitude.npz
  symspline fit states.csv --space cp:1 --columns up,down -o states.npz
  symspline fit gps.csv --lonlat --smooth -o gps.npz

symspline.load reads the curve in Python; with --curve, symspline.load_many reads all of them."""

_FOR_ROTATIONS = "For rotations give --space so:3, or rp:3, where signs do not count"
_TOL = 1e-12
_EXTRAPOLATE: dict[str, Any] = {"continue": True, "geodesic": "geodesic", "periodic": "periodic"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``symspline fit``."""
    add = parser.add_argument
    add("input", type=Path, metavar="IN", help="table to read: .csv, .npz, .parquet, .tum or .txt")
    add("--space", metavar="S", help="such as sphere:2, so:3, spd:3, cp:1 or 'so:3 x r:3'")
    add(
        "--time",
        metavar="COL",
        help="column of times (default: t, time, or dates in a column called like timestamp, date, ISO_TIME; if there "
        "is none, 0, 1, 2, ..., as with none)",
    )
    add(
        "--columns",
        metavar="A,B,...",
        help="columns of a point, in the order of its numbers (default: all others that hold numbers)",
    )
    add("--curve", metavar="COL", help="column of names: rows with one name are one curve, in their order")
    add(
        "--lonlat",
        action="store_true",
        help="points are longitude and latitude in degrees, in columns lon and lat, or longitude and "
        "latitude, or the two --columns; the space is sphere:2",
    )
    add(
        "--quaternion",
        choices=ORDERS,
        help="order of the four numbers of a quaternion in the columns of so:3 or se:3, if their names do not end in "
        "w, x, y and z",
    )
    add("--sort", action="store_true", help="put the rows of every curve in the order of their times")
    add(
        "--dedup",
        choices=("first", "mean"),
        help="of points with one time keep the first, or their mean (default: they are an error)",
    )
    add(
        "--max-gap",
        metavar="DT",
        help="cut curves where neighbouring times are farther apart than a number or, for dates, a duration such "
        "as 12h; pieces are curves named 1, 2, ... or, with --curve, NAME/1, NAME/2, ...; single points are left out",
    )
    add(
        "--bc-type",
        default="natural",
        metavar="END",
        help="natural (default), not-a-knot, clamped, periodic; "
        "or two of the first three with a comma, for start and end",
    )
    add(
        "--method",
        default="auto",
        metavar="M",
        help="auto (default), quasi-newton, newton, homotopy or fixed-point",
    )
    add(
        "--tol",
        type=real,
        help="relative C2 defect that counts as converged (default: 1e-12)",
    )
    add(
        "--extrapolate",
        choices=_EXTRAPOLATE,
        help="the curve outside its times: the last segment continued, a geodesic at constant speed, "
        "or the same again (default: there is none)",
    )
    smoothing.add_arguments(parser)
    add("-o", dest="output", type=Path, metavar="OUT", required=True, help="file of curves to write: .npz")


def run(options: argparse.Namespace) -> int:
    """Read, fit and write."""
    ending(options.output, ENDING, "a file of curves")
    check_target(options.output)
    smooth = smoothing.asked(options)
    space = _space(options.space, options.lonlat)
    table = open_table(options.input)
    curve = table.require(options.curve) if options.curve is not None else None
    given = split_names(options.columns)
    time = time_column(table, options.time, [curve, *given])
    entries, quaternion = point_entries(
        table, given, [time, curve], space, options.lonlat, options.quaternion
    )
    with Progress("reading") as progress:
        rows = table.read([name for entry in entries for name in entry.columns], time, curve, progress)
    check_days(table, time, rows)
    if not options.lonlat and quaternion is None:
        rows = replace(rows, numbers=completed(rows.numbers, entries, space))
    used = [time, curve, *(column for entry in entries for column in entry.columns)]
    hint = partial(column_of_names, table, time, used) if curve is None else lambda: None
    repair = Repair(options.sort, options.dedup, options.max_gap)
    data = Data(table.path, rows, repair, smooth is not None, hint)
    columns = named_columns(entries, time, curve, options.lonlat)
    columns = replace(columns, utc=rows.utc, quaternion=quaternion)
    splines = _fit(data, space, columns, options, smooth)
    write_curves(options.output, Curves(splines, data.named, columns))
    fitted = list(splines.values())
    said = (
        _summary(fitted)
        if smooth is None
        else smoothing.summary(cast(list[SmoothingSpline], fitted), options.lonlat)
    )
    print(f"{options.output}: {said}{_repaired(data)}{_gaps(fitted)}")
    column = hint() if data.joined or data.repeated else None
    if column is not None:
        say(
            f"{data.joined or data.repeated} rows have a time that another row has, and column {column!r} tells them "
            f"apart: if the table holds several tracks, fit each of them with --curve {column}"
        )
    return 0


def _space(name: str | None, lonlat: bool) -> Space:
    if name is None and not lonlat:
        raise Problem("say which space the points are on with --space, such as --space sphere:2")
    space = GLOBE if name is None else space_named(name)
    if lonlat:
        require_globe(space)
    return space


def _fit(
    data: Data, space: Space, columns: Columns, options: argparse.Namespace, smooth: smoothing.Asked | None
) -> dict[str, CubicSpline]:
    """All curves in one call."""
    bc_type = _bc_type(options.bc_type)
    extrapolate = _EXTRAPOLATE.get(options.extrapolate)
    fitted: Sequence[CubicSpline]
    try:
        with warnings.catch_warnings(record=True) as noted, Progress("fitting") as progress:
            # The summary says of how many curves λ is at a bound.
            warnings.simplefilter("ignore", SmoothingWarning)
            if smooth is None:
                fitted = fit_many(
                    data.curves(space, columns),
                    space,
                    bc_type=bc_type,
                    method=options.method,
                    tol=_TOL if options.tol is None else options.tol,
                    extrapolate=extrapolate,
                    progress=progress,
                )
            else:
                fitted = smooth_many(
                    [(*curve, {}) for curve in data.curves(space, columns)],
                    space,
                    extrapolate=extrapolate,
                    progress=progress,
                    **smooth.keywords,
                )
    except (ValidationError, CutLocusError, ConvergenceError) as error:
        raise type(error)(data.located(str(error))) from None
    for note in noted:
        say(data.located(str(note.message).replace(IN_PYTHON, _FOR_ROTATIONS)))
    return dict(zip(data.groups, fitted, strict=True))


def _bc_type(text: str) -> str | tuple[str, ...]:
    words = tuple(word.strip() for word in text.split(","))
    if words == ("periodic",) or (
        len(words) in (1, 2) and set(words) <= {"natural", "not-a-knot", "clamped"}
    ):
        return words[0] if len(words) == 1 else words
    raise Problem(
        f"--bc-type {text}: give natural, not-a-knot, clamped or periodic, or two of the first three with a comma"
    )


def _repaired(data: Data) -> str:
    """What was put right, of which nothing is seen in the curves."""
    said = [
        f"{count} row{'s' if count > 1 else ''} {what}"
        for count, what in (
            (
                data.joined,
                "merged with others of the same time (--dedup mean)"
                if data.dedup == "mean"
                else "left out, whose time an earlier row has (--dedup first)",
            ),
            (data.alone, "alone between gaps left out"),
        )
        if count
    ]
    return "".join(f"; {part}" for part in said)


def _gaps(splines: Sequence[CubicSpline]) -> str:
    """How many steps are far longer than most, across which nothing was measured."""
    found = []
    for spline in splines:
        times = spline._times
        if isinstance(spline, SmoothingSpline):
            times = np.unique(spline._noisy.times[spline._noisy.used])
        long = long_gaps(times)
        found += np.diff(times)[long].tolist()
    if not found:
        return ""
    unit = " s" if splines[0]._clock.dates else ""
    gaps = f"{len(found)} long gap{'s' if len(found) > 1 else ''}"
    return f"; {gaps}, up to {max(found):.4g}{unit} (--max-gap cuts there)"


def _summary(splines: Sequence[CubicSpline]) -> str:
    points = sum(len(spline.t) for spline in splines)
    reports = [spline.report for spline in splines]
    iterations, residual = max(r.iterations for r in reports), max(r.residual for r in reports)
    curves = f"{len(splines)} curve{'s' if len(splines) > 1 else ''}"
    most = "at most " if len(splines) > 1 else ""
    return (
        f"{curves} through {points} points of {splines[0].space}, converged: {reports[0].method}, "
        f"{most}{iterations} iterations, residual {most}{residual:.1e}"
    )

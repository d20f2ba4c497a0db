"""Fit C² splines to the points in a table, through them or, with --smooth, near them

A table is a CSV, NPZ, Parquet, JSON, GeoJSON or GPX file or a TUM trajectory; the ending of its name or --from selects
the format. Every row is a point at a time. Times are numbers, or ISO dates such as 2021-08-29, 2021-08-29 16:55 or
2021-08-29T16:55:00.5+02:00, all with a time zone or all without. Dates with Z or an offset are converted to UTC, and
rates are per second.

The numbers of a point are in columns in the order of its array, and --columns names them in that order: a matrix row
by row, in a product one factor after the other. A complex number A has the columns A_re and A_im, which --columns
calls A, or one column A, with texts such as (1+2j) in CSV files or if it is real. Rounded points are projected onto the
space, within 1e-4 if they have at most nine significant digits. A rotation of so:3 may also be a unit quaternion in
columns whose names end in w, x, y and z, in any order, and a pose of se:3 or so:3 x r:3 a position, such as tx, ty, tz,
and a quaternion. Angles of torus:n are in radians, or with --degrees in degrees.

Without --time, the times are in the column t or time, or, if they are dates, in a column that is called time, date,
datetime, stamp or timestamp, in the plural or with words such as iso, utc, unix, base, local, ns: ISO_TIME,
"Date (UTC)". The command asks if another column seems to hold times. Without any, times are 0, 1, 2, ... Numbers in
the column of times have no unit; with --unix ns they are nanoseconds since 1970, and become dates in UTC.

CSV files, which pandas reads, name the columns in their first line; blank lines are skipped. Cells are separated by
commas, semicolons or tabs, and between semicolons numbers may have decimal commas. In an NPZ file columns are arrays
with one entry per row, which may be complex, or vectors or matrices; an array `points` may hold all numbers of the
points. A .tum or .txt file is a trajectory of the TUM benchmark: time tx ty tz qx qy qz qw. In GPX and GeoJSON files,
tracks and lines have their name in the column track, and points their height in the column ele. With --skipna, rows
without a point are omitted.

Curves pass through the points. --smooth is for noisy points: the curve passes near them, as smooth as the data
suggest, and symspline sample also writes its standard deviation.

examples:
  symspline fit track.csv --lonlat -o track.npz
  symspline fit storms.csv --lonlat --time date --curve storm -o storms.npz
  symspline fit attitude.parquet --space so:3 --columns w,x,y,z --bc-type not-a-knot -o attitude.npz
  symspline fit states.csv --space cp:1 --columns up,down -o states.npz
  symspline fit gps.csv --lonlat --smooth -o gps.npz

symspline.load reads the curve in Python. With --curve, it returns a dictionary of all curves by name, and with
--max-gap alone a SegmentedCurve.
"""

from __future__ import annotations

import argparse
import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from .._base.exceptions import SymsplineError
from .._curves.failures import IN_PYTHON
from .._smoothing import SmoothingWarning
from .._smoothing.segments import smooth_many
from .._spaces import Space, Torus, factors_of, space_named
from .._splines.cubic import CubicSpline
from .._splines.functional import fit_many
from ._columns import (
    GLOBE,
    ORDERS,
    Columns,
    check_days,
    point_columns,
    require_globe,
    split_names,
    time_column,
    with_stamps,
)
from ._curves import Curves, write_curves
from ._files import called, check_target
from ._formats import CURVES, TABLES, endings, format_of, open_table
from ._info import bridged, fitted
from ._messages import VERBOSE, Problem, Progress, for_command_line, listed, refuse, say, tell
from ._recordings import Recordings, outliers
from ._tables import UNITS, is_number, number

_METHODS = "auto (default), quasi-newton, newton, homotopy or fixed-point"
_ENDS = "natural (default), not-a-knot, clamped, periodic; or two of the first three with a comma, for start and end"
_POLICIES = {"continue": True, "geodesic": "geodesic", "periodic": "periodic"}
_EXTRAPOLATE = (
    "continue the last segment outside the times, or go on along a geodesic, or periodically (default: times outside "
    "are an error)"
)
_MAX_GAP = (
    "cut curves at longer gaps between neighbouring times: a number or, for dates, a duration such as 12h; the "
    "segments are curves 1, 2, ... or, with --curve, NAME/1, NAME/2, ...; single points are omitted"
)
_CRITERION = "how λ is chosen: gcv (default), reml, or cp, Mallows' C_p, which needs --sigma and is the default with it"
_SIGMA = (
    "known standard deviation of the noise in a coordinate: in the unit of distances, radians for rotations, degrees "
    "with --lonlat or --degrees; in a product perhaps one per factor with commas"
)
_TIME = (
    "column of times, none for 0, 1, 2, ..., or two columns with a comma, whole seconds and nanoseconds since 1970; "
    "see above for the default"
)
_HEIGHTS = ("ele", "elevation", "alt", "altitude", "height", "height-above-ellipsoid", "height-above-msl")
_FOR_ROTATIONS = "For rotations give --space so:3, or rp:3, where signs do not count"
# Options of the library for curves through points and for curves near them.
_THROUGH = {"bc_type": "--bc-type", "method": "--method", "tol": "--tol"}
_NEAR = {"criterion": "--criterion", "lam": "--lam", "sigma": "--sigma", "loss": "--robust", "penalty": "--penalty"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline fit``."""
    add = parser.add_argument
    add("input", type=Path, metavar="IN", help=f"table to read: {endings()}, or - for standard input")
    add("--from", dest="format", choices=TABLES, help="format of the table (default: as its name ends, CSV for -)")
    add("--space", metavar="S", help="such as sphere:2, so:3, spd:3, cp:1 or 'so:3 x r:3'")
    add("--time", metavar="COL", help=_TIME)
    add("--unix", choices=UNITS, help="times are numbers that count this unit since 1970-01-01 in UTC")
    add("--columns", metavar="A,B,...", help="columns of a point (default: all other numeric columns)")
    add("--curve", metavar="COL", help="column of names: the rows with one name are one curve")
    add("--lonlat", action="store_true", help="points on sphere:2 are longitude and latitude in degrees")
    add("--degrees", action="store_true", help="angles of torus:n are in degrees, also in the samples of the curve")
    add("--quaternion", choices=ORDERS, help="order of a quaternion, if the names do not show it")
    add("--sort", action="store_true", help="put the rows of every curve in the order of their times")
    add("--skipna", action="store_true", help="omit rows without a point or a time: empty cells, NaN, NA or null")
    add("--dedup", choices=("first", "mean"), help="keep the first of the points of one time, or their mean")
    add("--max-gap", metavar="DT", help=_MAX_GAP)
    add("--bc-type", type=_ends, metavar="END", help=_ENDS)
    add("--method", metavar="M", help=_METHODS)
    add("--tol", type=number, help="relative C² residual that counts as converged (default: 1e-12)")
    add("--extrapolate", choices=_POLICIES, help=_EXTRAPOLATE)
    out = "file of curves to write: .npz, or - for standard output"
    add("-o", dest="output", type=Path, metavar="OUT", required=True, help=out)
    add = parser.add_argument_group("noisy data").add_argument
    add("--smooth", action="store_true", help="fit curves near the points")
    add("--criterion", choices=("gcv", "cp", "reml"), help=_CRITERION)
    add(
        "--lam",
        type=_numbers,
        metavar="L",
        help="a number λ >= 0 instead, in a product perhaps one per factor with commas",
    )
    add("--sigma", type=_deviations, metavar="S", help=_SIGMA)
    add(
        "--robust",
        dest="loss",
        action="store_const",
        const="cauchy",
        help="reduce the influence of outliers (loss 'cauchy')",
    )
    add("--penalty", choices=("acceleration", "jerk"), help="derivative that is kept small (default: acceleration)")


def _numbers(text: str) -> Any:
    """Read finite numbers that are not negative: one, or a tuple of several."""
    cells = text.split(",")
    if not all(is_number(cell) and 0 <= float(cell) < math.inf for cell in cells):
        raise argparse.ArgumentTypeError(f"{text}: give a finite number >= 0, such as 0.1")
    return float(cells[0]) if len(cells) == 1 else tuple(map(float, cells))


def _deviations(text: str) -> Any:
    values = _numbers(text)
    if 0 in (values if isinstance(values, tuple) else (values,)):
        raise argparse.ArgumentTypeError(f"{text}: the standard deviation must be greater than 0")
    return values


def _ends(text: str) -> Any:
    ends = tuple(end.strip() for end in text.split(","))
    if ends != ("periodic",) and (len(ends) > 2 or not set(ends) <= {"natural", "not-a-knot", "clamped"}):
        raise argparse.ArgumentTypeError(f"{text}: give {_ENDS.replace(' (default)', '')}")
    return ends[0] if len(ends) == 1 else ends


def run(options: argparse.Namespace) -> int:
    """Read, fit and write."""
    format_of(options.output, None, CURVES, "a file of curves")
    check_target(options.output, options.input, binary=True)
    space = _space(options)
    keywords = _keywords(options, space)
    data, columns = _read(options, space)
    curves = _fitted(data, options, keywords)
    far = outliers(data, curves, options.lonlat) if options.loss is None else ""
    segmented = options.max_gap is not None and options.curve is None
    named = dict(zip(data.groups, curves, strict=True))
    write_curves(options.output, Curves(named, data.named, columns, segmented))
    in_degrees = options.lonlat or (options.degrees and isinstance(space, Torus))
    words = f"{fitted(curves, in_degrees)}{data.changes()}{bridged(curves)}"
    if not data.has_times and options.time is None:
        words += "; no column of times: the points are at 0, 1, 2, ..."
    tell(f"{called(options.output)}: {words}")
    for note in filter(None, (far and f"{data.path}, {far}", data.doubt())):
        say(note)
    return 0


def _space(options: argparse.Namespace) -> Space:
    if options.space is None and not options.lonlat:
        raise Problem(
            "say which space the points are on: --lonlat for longitude and latitude, or --space, such as --space "
            "sphere:2 for unit vectors and --space so:3 for rotations"
        )
    space = GLOBE if options.space is None else space_named(options.space)
    if options.lonlat:
        require_globe(space)
    on_torus = any(isinstance(factor, Torus) for factor in factors_of(space))
    refuse("--degrees", (options.degrees and not on_torus, f" is for torus:n and products with it, not for {space}"))
    return space


def _keywords(options: argparse.Namespace, space: Space) -> dict[str, Any]:
    """Return the arguments of `symspline.fit_many`, or of `symspline.make_smoothing_spline` with --smooth."""
    given = {name: getattr(options, name) for name in (*_THROUGH, *_NEAR)}
    # The defaults of the library contradict nothing.
    given = {name: value for name, value in given.items() if value not in (None, "natural", "auto")}
    other, remedy = _NEAR, "is for noisy data; give --smooth, too"
    if options.smooth:
        other, remedy = _THROUGH, "is for curves through the points; omit it with --smooth"
    wrong = next((option for name, option in other.items() if name in given), None)
    refuse(
        "",
        (wrong, f"{wrong} {remedy}"),
        (options.smooth and options.dedup == "mean", "with --smooth all points of one time count; omit --dedup mean"),
        ({"lam", "criterion"} <= {*given}, "--lam gives λ, which --criterion would choose; omit one of them"),
        (options.criterion == "cp" and not options.sigma, "--criterion cp needs the noise; give it with --sigma"),
    )
    if "sigma" in given and "lam" not in given:
        given.setdefault("criterion", "cp")
    angles = options.lonlat or (options.degrees and isinstance(space, Torus))
    if angles and isinstance(options.sigma, float):
        given["sigma"] = math.radians(options.sigma)
    return given | {"extrapolate": _POLICIES.get(options.extrapolate)}


def _read(options: argparse.Namespace, space: Space) -> tuple[Recordings, Columns]:
    """Return the curves in the table, and the names of their columns."""
    whole = open_table(options.input, options.format)
    table, time = with_stamps(whole, options.time, options.skipna)
    curve = table.require(options.curve) if options.curve is not None else None
    given = split_names(options.columns)
    time = time_column(table, time, [curve, *given], options.unix is not None)
    points = point_columns(table, given, [time, curve], space, options.lonlat, options.quaternion)
    points = replace(points, degrees=options.degrees)
    needed = [*points.used, *filter(None, [time, curve])]
    table = table.without_empty(needed) if options.skipna else table
    rows = table.read(points.used, time, curve, options.unix)
    check_days(table, time, rows)
    at = "times 0, 1, 2, ..." if time is None else f"times in column {time}"
    tell(f"{table.path}: {table.path.format} table, points in columns {listed(points.names)}, {at}", VERBOSE)
    data = Recordings(table, rows, time, points, options, whole.height - table.height)
    heights = [name for name in table.names if options.lonlat and name.lower() in _HEIGHTS and name not in needed]
    if heights:
        tell(f"{table.path}: heights in column {heights[0]} are not used; --space r:1 --columns {heights[0]} fits them")
    cut = options.max_gap is not None and curve is not None
    names = points.names, time or "time", curve or "curve"
    return data, Columns(*names, options.lonlat, rows.utc, points.quaternion, cut, options.degrees)


def _fitted(data: Recordings, options: argparse.Namespace, keywords: dict[str, Any]) -> Sequence[CubicSpline]:
    """Fit all curves in one call."""
    try:
        with warnings.catch_warnings(record=True) as noted, Progress("fitting") as progress:
            # The summary counts the curves whose λ is at a bound.
            warnings.simplefilter("ignore", SmoothingWarning)
            curves: Sequence[CubicSpline]
            if options.smooth:
                curves = smooth_many([(*curve, {}) for curve in data.curves], data.space, progress=progress, **keywords)
            else:
                curves = fit_many(data.curves, data.space, progress=progress, **keywords)
    except SymsplineError as error:
        far = outliers(data, None, options.lonlat)
        raise error._with_message("; ".join(filter(None, (data.located(error), far)))) from None
    for note in noted:
        say(for_command_line(data.located(note.message).replace(IN_PYTHON, _FOR_ROTATIONS)))
    return curves

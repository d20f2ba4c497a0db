"""Fit C² splines to the points in a table, through them or, with --smooth, near them

A table is a CSV, NPZ, Parquet, JSON, GeoJSON or GPX file or a TUM trajectory; the ending of its name or --from selects
the format. Every row is a point at a time. Times are numbers, or ISO dates such as 2021-08-29, 2021-08-29 16:55 or
2021-08-29T16:55:00.5+02:00, all written in the same way. Dates with Z or an offset are converted to UTC, and rates are
per second.

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

CSV files name the columns in their first line; blank lines are skipped. Cells are separated by commas, semicolons or
tabs, and between semicolons numbers may have decimal commas. In an NPZ file columns are arrays with one entry per row,
which may be complex, or vectors or matrices; an array `points` may hold all numbers of the points. A .tum or .txt file
is a trajectory of the TUM benchmark: time tx ty tz qx qy qz qw. In GPX and GeoJSON files, tracks and lines have their
name in the column track, and points their height in the column ele. With --skipna, rows without a point are omitted.

Curves pass through the points. --smooth is for noisy points: the curve passes near them, as smooth as the data
suggest, and symspline sample also writes its standard deviation.

With --smooth, the table may have angular velocities (--rates) and velocities (--velocities) next to the points, and one
curve is fitted to all of them. Give the standard deviation of each. --penalty is then jerk, unless you give another
one. Rows can be in any order, and a row can contain only some of the measurements; the other columns are empty or NaN.
--rates are in the frame of the body, in radians per unit of time (per second for dates). With --rate-bias, the constant
error of a gyroscope is estimated as well. --velocities are those of positions, in the fixed frame; on other spaces they
are tangent vectors at the point in their row, and with --lonlat the velocities to the east and to the north in degrees
of arc.

examples:
  symspline fit track.csv --lonlat -o track.npz
  symspline fit storms.csv --lonlat --time date --curve storm -o storms.npz
  symspline fit attitude.parquet --space so:3 --columns w,x,y,z --bc-type not-a-knot -o attitude.npz
  symspline fit states.csv --space cp:1 --columns up,down -o states.npz
  symspline fit gps.csv --lonlat --smooth -o gps.npz
  symspline fit imu.csv --smooth --space so:3 --columns qw,qx,qy,qz --sigma 0.05 --rates wx,wy,wz --rate-sigma 0.02
      --rate-bias -o attitude.npz
  symspline fit car.csv --smooth --space r:2 --columns x,y --sigma 3 --velocities vx,vy --velocity-sigma 0.1
      -o car.npz

symspline.load reads the curve in Python. With --curve, it returns a dictionary of all curves by name, and with
--max-gap alone a SegmentedCurve.
"""

from __future__ import annotations

import argparse
import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from .._base.exceptions import SymsplineError
from .._curves.representatives import IN_PYTHON
from .._smoothing import SmoothingWarning
from .._smoothing.segments import smooth_many
from .._spaces import Space, Torus, factors_of, space_named
from .._splines.cubic import CubicSpline
from .._splines.functional import fit_many
from .._tracks import ZIGZAG
from . import _summary
from ._columns import (
    ORDERS,
    check_days,
    column_of_names,
    column_of_tracks,
    point_columns,
    split_names,
    time_column,
    with_stamps,
)
from ._curves import Curves, write_curves
from ._formats import CURVES, TABLES, endings, format_of, open_table
from ._messages import VERBOSE, Problem, Progress, for_command_line, listed, refuse, say, tell
from ._outliers import outliers
from ._points import GLOBE, Columns, require_globe
from ._recordings import Recordings
from ._sensors import Fusion, sensors_of
from ._streams import called, check_target
from ._times import UNITS, number, option_numbers

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
_CRITERION = (
    "how λ is chosen: gcv (default), reml, or cp, Mallows' C_p, which needs --sigma and is the default with it, "
    "without rates and velocities"
)
_SIGMA = (
    "known standard deviation of the noise in a coordinate: in the unit of distances, radians for rotations, degrees "
    "with --lonlat or --degrees; in a product perhaps one per factor with commas"
)
_TIME = (
    "column of times, none for 0, 1, 2, ..., or two columns with a comma, whole seconds and nanoseconds since 1970; "
    "see above for the default"
)
_PENALTY = "derivative that is kept small (default: acceleration, and jerk with --rates or --velocities)"
_RATES = (
    "columns of angular velocities in the frame of the body, for so:3, sphere:3, se:3 and products with one of them"
)
_HEIGHTS = ("ele", "elevation", "alt", "altitude", "height", "height-above-ellipsoid", "height-above-msl")
_FOR_ROTATIONS = "For rotations give --space so:3, or rp:3, where signs do not count"
_NOISY = ("criterion", "lam", "sigma", "robust", "penalty", "rates", "rate_sigma", "rate_bias", "velocities",
          "velocity_sigma")  # fmt: skip
"""Options that need --smooth."""


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
    add("--bc-type", default="natural", metavar="END", help=_ENDS)
    add("--method", default="auto", metavar="M", help=_METHODS)
    add("--tol", type=number, help="relative C² residual that counts as converged (default: 1e-12)")
    add("--extrapolate", choices=_POLICIES, help=_EXTRAPOLATE)
    out = "file of curves to write: .npz, or - for standard output"
    add("-o", dest="output", type=Path, metavar="OUT", required=True, help=out)
    add = parser.add_argument_group("noisy data").add_argument
    add("--smooth", action="store_true", help="fit curves near the points")
    add("--criterion", choices=("gcv", "cp", "reml"), help=_CRITERION)
    add("--lam", metavar="L", help="a number λ >= 0 instead, in a product perhaps one per factor with commas")
    add("--sigma", metavar="S", help=_SIGMA)
    add("--robust", action="store_true", help="reduce the influence of outliers (loss 'cauchy')")
    add("--penalty", choices=("acceleration", "jerk"), help=_PENALTY)
    add = parser.add_argument_group("rates and velocities, with --smooth").add_argument
    add("--rates", metavar="A,B,C", help=_RATES)
    add("--rate-sigma", metavar="S", help="standard deviation of one of these numbers")
    add("--rate-bias", action="store_true", help="estimate a constant that is added to the rates")
    add("--velocities", metavar="A,B,...", help="columns of velocities; see above")
    add("--velocity-sigma", metavar="S", help="standard deviation of one of these numbers, with --lonlat in degrees")


def run(options: argparse.Namespace) -> int:
    """Read, fit and write."""
    format_of(options.output, None, CURVES, "a file of curves")
    check_target(options.output, options.input, binary=True)
    space = _space(options.space, options.lonlat)
    smooth = _smoothing_options(options, space)
    whole = open_table(options.input, options.format)
    table, options.time = with_stamps(whole, options.time, options.skipna)
    sensors = sensors_of(table, options, space, smooth and smooth["sigma"])
    extra = sensors.names if sensors else []
    curve = table.require(options.curve) if options.curve is not None else None
    given = split_names(options.columns)
    time = time_column(table, options.time, [curve, *given, *extra], options.unix is not None)
    on_torus = any(isinstance(factor, Torus) for factor in factors_of(space))
    refuse("--degrees", (options.degrees and not on_torus, f" is for torus:n and products with it, not for {space}"))
    points = point_columns(table, given, [time, curve, *extra], space, options.lonlat, options.quaternion)
    points = replace(points, degrees=options.degrees)
    needed = [*points.used, *filter(None, [time, curve])]
    table = table.without_empty(needed) if options.skipna and not sensors else table
    rows = table.read([*points.used, *extra], time, curve, [*points.used, *extra] if sensors else [], options.unix)
    check_days(table, time, rows)
    at = "times 0, 1, 2, ..." if time is None else f"times in column {time}"
    tell(f"{table.path}: {table.path.format} table, points in columns {listed(points.names)}, {at}", VERBOSE)
    cut = options.max_gap is not None and curve is not None
    columns = Columns(points.names, time or "time", curve or "curve", options.lonlat, rows.utc, points.quaternion, cut)
    columns = replace(columns, degrees=options.degrees)
    if sensors and smooth:
        _fit_sensors(options, smooth, Fusion(table, rows, points, sensors), columns)
        return 0
    hint = partial(column_of_names, table, time, [time, *points.used]) if curve is None else lambda: None
    given_points = points.read(rows.numbers, rows.place)
    data = Recordings(table.path, rows, given_points, space, options, hint)
    unused = [name for name in table.names if options.lonlat and name.lower() in _HEIGHTS and name not in needed]
    if unused:
        tell(f"{table.path}: heights in column {unused[0]} are not used; --space r:1 --columns {unused[0]} fits them")
    data.empty = whole.height - table.height
    _fit_points(options, smooth, data, columns)
    same = data.merged or data.repeated
    column = hint() if same or time is None else None
    if column is not None:
        what = f"{same} rows have a time that another row has, and column {column!r} distinguishes them"
        what = what if same else f"column {column!r} has one block of rows for each of its texts"
        say(f"{what}: if the table holds several tracks, fit each of them with --curve {column}")
    elif curve is None and (merged := column_of_tracks(table, [time, *points.used], space, given_points)) is not None:
        say(
            f"{table.path}: the path through all rows is more than {ZIGZAG:g} times as long as the paths of each "
            f"{merged!r}; if the table holds several tracks, fit each of them with --curve {merged}"
        )
    return 0


def _fit_sensors(options: argparse.Namespace, smooth: dict[str, Any], fusion: Fusion, columns: Columns) -> None:
    """Fit curves to points, rates and velocities, and write them."""
    named = options.curve is not None
    kept = {name: smooth[name] for name in ("lam", "loss", "penalty")}
    extrapolate = _POLICIES.get(options.extrapolate)
    curves = fusion.fitted({**kept, "criterion": options.criterion, "extrapolate": extrapolate})
    write_curves(options.output, Curves(curves, named, columns))
    first, *biases = _summary.estimated(curves, named, fusion.counts, fusion.omitted)
    for line in (f"{called(options.output)}: {first}", *biases):
        tell(line)


def _fit_points(options: argparse.Namespace, smooth: dict[str, Any] | None, data: Recordings, columns: Columns) -> None:
    """Fit curves through the points, or near them, and write them."""
    fitted = _fitted(data, options, smooth)
    far = outliers(data, fitted, options.lonlat) if not options.robust else ""
    segmented = options.max_gap is not None and options.curve is None
    write_curves(options.output, Curves(dict(zip(data.groups, fitted, strict=True)), data.named, columns, segmented))
    in_degrees = options.lonlat or (options.degrees and isinstance(data.space, Torus))
    words = f"{_summary.fitted(fitted, in_degrees)}{data.changes()}{_summary.bridged(fitted)}"
    if not data.has_times and options.time is None:
        words += "; no column of times: the points are at 0, 1, 2, ..."
    tell(f"{called(options.output)}: {words}")
    if far:
        say(f"{data.path}, {far}")


def _space(name: str | None, lonlat: bool) -> Space:
    if name is None and not lonlat:
        raise Problem(
            "say which space the points are on: --lonlat for longitude and latitude, or --space, such as --space "
            "sphere:2 for unit vectors and --space so:3 for rotations"
        )
    space = GLOBE if name is None else space_named(name)
    if lonlat:
        require_globe(space)
    return space


def _fitted(data: Recordings, options: argparse.Namespace, smooth: dict[str, Any] | None) -> Sequence[CubicSpline]:
    """All curves, fitted in one call."""
    common: dict[str, Any] = {"extrapolate": _POLICIES.get(options.extrapolate)}
    if smooth is None:
        common |= {"bc_type": _bc_type(options.bc_type), "method": options.method}
        common |= {} if options.tol is None else {"tol": options.tol}
    try:
        with warnings.catch_warnings(record=True) as noted, Progress("fitting") as progress:
            # The summary counts the curves whose λ is at a bound.
            warnings.simplefilter("ignore", SmoothingWarning)
            fitted: Sequence[CubicSpline]
            if smooth is None:
                fitted = fit_many(data.curves, data.space, progress=progress, **common)
            else:
                curves: Any = [(*curve, {}) for curve in data.curves]
                fitted = smooth_many(curves, data.space, progress=progress, **common, **smooth)
    except SymsplineError as error:
        far = outliers(data, None, options.lonlat)
        raise error._with_message("; ".join(filter(None, (data.located(error), far)))) from None
    for note in noted:
        say(for_command_line(data.located(note.message).replace(IN_PYTHON, _FOR_ROTATIONS)))
    return fitted


def _bc_type(text: str) -> Any:
    ends = tuple(end.strip() for end in text.split(","))
    if ends != ("periodic",) and (len(ends) > 2 or not set(ends) <= {"natural", "not-a-knot", "clamped"}):
        raise Problem(f"--bc-type {text}: give {_ENDS.replace(' (default)', '')}")
    return ends[0] if len(ends) == 1 else ends


def _smoothing_options(options: argparse.Namespace, space: Space) -> dict[str, Any] | None:
    """Return the options of `symspline.make_smoothing_spline`; None to fit curves through the points.

    Raises
    ------
    Problem
        Options contradict each other.
    """
    if not options.smooth:
        option = next((name for name in _NOISY if getattr(options, name) not in (None, False)), "")
        refuse(f"--{option.replace('_', '-')}", (option, " is for noisy data; give --smooth, too"))
        return None
    rates = options.rate_sigma is not None or options.rate_bias
    velocities = options.velocity_sigma is not None
    through = "is for curves through the points; omit it with --smooth"
    refuse(
        "",
        (options.bc_type != "natural", f"--bc-type {options.bc_type} {through}: smoothing has natural ends"),
        (options.tol is not None, f"--tol {through}"),
        (options.method != "auto", f"--method {through}"),
        (options.dedup == "mean", "with --smooth all points of one time count; omit --dedup mean"),
        (options.lam and options.criterion, "--lam gives λ, which --criterion would choose; omit one of them"),
        (options.criterion == "cp" and options.sigma is None, "--criterion cp needs the noise; give it with --sigma"),
        (rates and options.rates is None, "there are no --rates, to which --rate-sigma and --rate-bias belong"),
        (velocities and options.velocities is None, "there are no --velocities, to which --velocity-sigma belongs"),
    )
    lam = None if options.lam is None else option_numbers(options.lam, "--lam")
    sigma = None if options.sigma is None else option_numbers(options.sigma, "--sigma", positive=True)
    angles = options.lonlat or (options.degrees and isinstance(space, Torus))
    if angles and isinstance(sigma, float):
        sigma = math.radians(sigma)
    criterion = options.criterion or ("cp" if sigma is not None and lam is None else "gcv")
    loss = "cauchy" if options.robust else "linear"
    # Measured rates and velocities ask for the jerk, as in `estimate`.
    measured = options.rates is not None or options.velocities is not None
    penalty = options.penalty or ("jerk" if measured else "acceleration")
    return {"criterion": criterion, "lam": lam, "sigma": sigma, "loss": loss, "penalty": penalty}

"""Fit C² splines to the points in a table, through them or, with --smooth, near them

A table is a CSV, NPZ, NPY, Parquet, JSON, GeoJSON or GPX file or a TUM trajectory; the ending of its name or --from
selects the format. Every row is a point at a time. Times are numbers, or ISO dates such as 2021-08-29, 2021-08-29 16:55
or 2021-08-29T16:55:00.5+02:00, or dates such as Sun, 29 Aug 2021 16:55:00 GMT, all with a time zone or all without.
Dates with Z, UTC or an offset are converted to UTC, and rates are per second. --time-format reads other dates.

The numbers of a point are in columns in the order of its array, and --columns names them in that order: a matrix row by
row, in a product one factor after the other. A complex number A has the columns A_re and A_im, which --columns calls A,
or one column A, with texts such as (1+2j) in CSV files or if it is real. Rounded points are projected onto the space,
within 1e-4 if they have at most nine significant digits. A rotation of so:3 may also be a unit quaternion in columns
whose names end in w, x, y and z, in any order, and a pose of se:3 or so:3 x r:3 a position, such as tx, ty, tz, and a
quaternion. Angles of torus:n, such as headings, are in radians, or with --degrees in degrees.

Without --time, the times are in the column t or time, or, if they are dates, in a column that is called time, date,
datetime, stamp or timestamp, in the plural or with words such as iso, utc, unix, base, local, ns: ISO_TIME, "Date
(UTC)". The command asks if another column seems to hold times. Without any, times are 0, 1, 2, ... Numbers in the
column of times have no unit; with --unix ns they are nanoseconds since 1970, and become dates in UTC.

CSV files, which pandas reads, name the columns in their first line; blank lines and comments after # are skipped. Cells
are separated by commas, semicolons, tabs or blanks, and between semicolons numbers may have decimal commas. In an NPZ
file columns are arrays with one entry per row, which may be complex, or vectors or matrices; an array `points` may hold
all numbers of the points. A .tum or .txt file is a trajectory of the TUM benchmark: time tx ty tz qx qy qz qw, on so:3
x r:3. GPX and GeoJSON files imply --lonlat, and each of their tracks, segments and lines is a curve of its own, whose
name is in the column track; --curve none makes one curve of all. Positions with a column of heights, such as ele, are
on sphere:2 x r:1; --space sphere:2 omits the heights. With --skipna, rows without a point are omitted.

Curves pass through the points. --smooth is for noisy points: the curve passes near them, as smooth as the data suggest,
and symspline sample also writes its standard deviation. With --smooth adaptive, the smoothness varies along the curve
if the data require it, for motion that rests and bursts.

examples:
  symspline fit track.csv --lonlat -o track.npz
  symspline fit storms.csv --lonlat --time date --curve storm -o storms.npz
  symspline fit attitude.parquet --space so:3 --columns w,x,y,z --bc-type not-a-knot -o attitude.npz
  symspline fit states.csv --space cp:1 --columns up,down -o states.npz
  symspline fit wind.csv --space torus:1 --columns direction --degrees -o wind.npz
  symspline fit gps.csv --lonlat --smooth -o gps.npz
  symspline fit hand.csv --space r:3 --smooth adaptive --noise adaptive -o hand.npz

symspline.load reads the curve in Python. With --curve, it returns a dictionary of all curves by name, and with
--max-gap alone a SegmentedCurve."""

from __future__ import annotations

import argparse
import math
import warnings
from argparse import Namespace
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from .._base.exceptions import SymsplineError
from .._base.time import NANOSECONDS, time_axis_of
from .._base.typing import Keywords
from .._core import CutLocusError
from .._curves.failures import IN_PYTHON
from .._smoothing import SmoothingSpline, SmoothingWarning
from .._smoothing.noise import grouped, is_several, smoothed_spaces
from .._smoothing.segments import cut, smooth_many
from .._spaces import Doubles, Product, Space, Torus, factors_of, space_named
from .._splines.cubic import CubicSpline
from .._splines.functional import fit_many
from ..geo import ZIGZAG
from ._columns import (
    EULER,
    GLOBE,
    JOINED,
    ORDERS,
    QUATERNION,
    WITH_HEIGHT,
    Columns,
    PointColumns,
    check_days,
    column_of_blocks,
    column_of_names,
    column_of_tracks,
    decimals_of,
    height_in,
    in_degrees,
    point_columns,
    require_globe,
    split_names,
    suggested,
    time_column,
    with_quaternions,
    with_stamps,
)
from ._curves import Curves, write_curves
from ._info import bridged, fitted
from ._messages import (
    VERBOSE,
    Problem,
    Progress,
    called,
    check_target,
    counted,
    listed,
    printed_warnings,
    refuse,
    say,
    tell,
)
from ._tables import (
    CURVES,
    TABLES,
    UNITS,
    Rows,
    Table,
    codes_of,
    duration,
    endings,
    format_of,
    is_number,
    number,
    open_table,
)

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
_SMOOTH = (
    "fit curves near the points, with one λ (constant, the default) or, for motion that rests and bursts, one that "
    "varies along the curve if the data require it (adaptive)"
)
_NOISE = (
    "constant (default), or adaptive: the standard deviation of the noise varies along the curve if the data require it"
)
_ADAPTIVE = ("constant", "adaptive")
_LAM = "a number λ >= 0 instead, in a product perhaps one per factor with commas"
_SIGMA = (
    "known standard deviation of the noise in a coordinate: in the unit of distances, radians for rotations, degrees "
    "with --lonlat or --degrees; in a product perhaps one per factor with commas"
)
_CURVE = (
    "column of names: the rows with one name are one curve (default: the tracks of GPX and GeoJSON files; none for one "
    "curve of all)"
)
_TIME = (
    "column of times, none for 0, 1, 2, ..., or two columns with a comma: whole seconds and nanoseconds since 1970, or "
    "a date and a time of day; see above for the default"
)
_EULER = (
    "three angles are rotations of so:3 about the axes of the body in this order, or with lower-case letters about "
    "fixed axes; columns roll, pitch and yaw are about x, y and z; in radians unless --degrees is given"
)
_ATOL = (
    "project points onto the space, and normalise quaternions, if they are at most this far off (default: as far as "
    "their decimals allow)"
)
_TIME_FORMAT = "format of dates that are not in ISO 8601, such as '%%d.%%m.%%Y %%H:%%M', as for strptime; %%z is a zone"
_FOR_ROTATIONS = "For rotations give --space so:3, or rp:3, where signs do not count"
# Options of the library for curves through points and for curves near them.
_THROUGH = {"bc_type": "--bc-type", "method": "--method", "tol": "--tol"}
_NEAR = {"criterion": "--criterion", "lam": "--lam", "sigma": "--sigma", "noise": "--noise", "loss": "--robust"}
_NEAR |= {"penalty": "--penalty"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline fit``."""
    out = "file of curves to write: .npz, or - for standard output"
    parser.add_argument("-o", "--output", type=Path, metavar="OUT", required=True, help=out)
    add_fit(parser)


def add_fit(parser: argparse.ArgumentParser) -> None:
    """Add the options of a fit."""
    add = parser.add_argument
    add("input", type=Path, metavar="IN", help=f"table to read: {endings()}, or - for standard input")
    add("--from", dest="format", choices=TABLES, help="format of the table (default: as its name ends, CSV for -)")
    add("--space", metavar="S", help="such as sphere:2, so:3, spd:3, cp:1 or 'so:3 x r:3'")
    add("--time", metavar="COL", help=_TIME)
    add("--unix", choices=UNITS, help="times are numbers that count this unit since 1970-01-01 in UTC")
    add("--time-format", metavar="F", help=_TIME_FORMAT)
    add("--columns", metavar="A,B,...", help="columns of a point (default: all other numeric columns)")
    add("--curve", metavar="COL", help=_CURVE)
    add("--lonlat", action="store_true", help="points are longitude and latitude in degrees, and perhaps a height")
    unit = parser.add_mutually_exclusive_group().add_argument
    degrees = "angles of torus:n, such as headings, are in degrees, also in the samples of the curve"
    unit("--degrees", action="store_const", const=True, help=degrees)
    radians = "angles of torus:n are in radians, also those beyond two turns (4 pi), which are otherwise refused"
    unit("--radians", dest="degrees", action="store_const", const=False, help=radians)
    add("--quaternion", choices=ORDERS, help="order of a quaternion, if the names do not show it")
    add("--euler", choices=EULER + [order.lower() for order in EULER], metavar="ZYX", help=_EULER)
    add("--sort", action="store_true", help="put the rows of every curve in the order of their times")
    skipna = "omit rows without a point or a time: empty cells, NaN, NA or null, quaternions of zeros"
    add("--skipna", action="store_true", help=skipna)
    add("--atol", type=_tolerance, metavar="D", help=_ATOL)
    add("--na", type=split_names, metavar="W,...", help="further texts or numbers of missing values, such as -999")
    add("--dedup", choices=("first", "mean"), help="keep the first of the points of one time, or their mean")
    add("--max-gap", metavar="DT", help=_MAX_GAP)
    add("--bc-type", type=_ends, metavar="END", help=_ENDS)
    add("--method", metavar="M", help=_METHODS)
    add("--tol", type=number, help="relative C² residual that counts as converged (default: 1e-12)")
    add("--extrapolate", choices=_POLICIES, help=_EXTRAPOLATE)
    add = parser.add_argument_group("noisy data").add_argument
    add("--smooth", nargs="?", const="constant", choices=_ADAPTIVE, help=_SMOOTH)
    add("--criterion", choices=("gcv", "cp", "reml"), help=_CRITERION)
    add("--lam", type=_numbers, metavar="L", help=_LAM)
    add("--sigma", type=_deviations, metavar="S", help=_SIGMA)
    add("--noise", choices=_ADAPTIVE, help=_NOISE)
    robust = "reduce the influence of outliers (loss 'cauchy')"
    add("--robust", dest="loss", action="store_const", const="cauchy", help=robust)
    add("--penalty", choices=("acceleration", "jerk"), help="derivative that is kept small (default: acceleration)")


def _tolerance(text: str) -> float:
    if not (is_number(text) and 0 < float(text) < 1):
        raise argparse.ArgumentTypeError(f"{text}: give a number between 0 and 1, such as 0.01")
    return float(text)


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
    curves, description, notes = fit_table(options)
    write_curves(options.output, curves)
    tell(f"{called(options.output)}: {description}")
    for note in notes:
        say(note)
    return 0


def fit_table(options: argparse.Namespace) -> tuple[Curves, str, list[str]]:
    """Read a table and fit its curves. Return them, their description, and doubts about them."""
    if options.space is not None:
        space_named(options.space)
    table = replace(open_table(options.input, options.format), time_format=options.time_format)
    table = table if options.na is None else table.without_values(options.na)
    space = _space(options, table)
    keywords = _keywords(options, space)
    data, columns = _read(options, table, space)
    curves = _fitted(data, columns, options, keywords)
    far = outliers(data, curves, columns) if options.loss is None else ""
    segmented = options.max_gap is not None and options.curve is None
    words = f"{fitted(curves, columns)}{data.changes()}{bridged(curves)}"
    if not data.has_times and options.time is None:
        words += "; no column of times: the points are at 0, 1, 2, ..."
    notes = [far and f"{data.path}, {far}", data.doubt()]
    named = dict(zip(data.groups, curves, strict=True))
    return Curves(named, data.named, columns, segmented), words, [*filter(None, notes)]


def _space(options: argparse.Namespace, table: Table) -> Space:
    """Return the space of the points, and set the option --lonlat for files of positions."""
    space = None if options.space is None else space_named(options.space)
    if table.holds == "positions" and options.columns is None and space in (None, GLOBE, WITH_HEIGHT):
        options.lonlat = True
    if space is None and table.holds == "poses" and not options.lonlat:
        space = space_named("so:3 x r:3")
    if space is None and options.lonlat:
        space = WITH_HEIGHT if _has_heights(options, table) else GLOBE
    if space is None:
        advice = suggested(table) if options.columns is None else ""
        raise Problem(
            f"{table.path}: {advice}"
            if advice
            else "say which space the points are on: --lonlat for longitude and latitude, or --space, such as --space "
            "sphere:2 for unit vectors and --space so:3 for rotations"
        )
    if options.lonlat:
        require_globe(space)
    on_torus = options.euler is not None or any(isinstance(factor, Torus) for factor in factors_of(space))
    flag = "--degrees" if options.degrees else "--radians"
    refuse(
        flag, (options.degrees is not None and not on_torus, f" is for torus:n and products with it, not for {space}")
    )
    return space


def _in_radians(options: argparse.Namespace, space: Space) -> Any:
    """Return the standard deviations of --sigma, those in degrees in radians."""
    parts, given = smoothed_spaces(space), options.sigma
    several = isinstance(given, tuple)
    heights = (
        f"--sigma {given} is one number, but positions with heights need two: degrees and the unit of the heights, "
        f"such as --sigma {given},5; --space sphere:2 fits positions without heights"
    )
    refuse("", (options.lonlat and space == WITH_HEIGHT and not several, heights))
    degrees = [in_degrees(part, options.lonlat, bool(options.degrees)) for part in parts]
    if several and len(given) == len(parts):
        return tuple(math.radians(sigma) if part else sigma for sigma, part in zip(given, degrees, strict=True))
    return math.radians(given) if all(degrees) and not several else given


def _has_heights(options: argparse.Namespace, table: Table) -> bool:
    """Whether positions have a height: three columns are given, or a column of heights is complete."""
    if options.columns is not None:
        return len(split_names(options.columns)) == 3
    height = height_in(table)
    if height is None or height == options.time:
        return False
    missing = int(table.missing(height).sum())
    if missing:
        tell(f"{table.path}: heights in column {height} are not used, as {missing} of {table.height} are missing")
    return not missing


def _keywords(options: argparse.Namespace, space: Space) -> Keywords:
    """Return the arguments of `symspline.fit_many`, or of `symspline.make_smoothing_spline` with --smooth."""
    given = {name: getattr(options, name) for name in (*_THROUGH, *_NEAR)}
    # The defaults of the library contradict nothing.
    given = {name: value for name, value in given.items() if value not in (None, "natural", "auto")}
    other, remedy = _NEAR, "is for noisy data; give --smooth, too"
    adapts = options.smooth == "adaptive"
    if options.smooth:
        other, remedy = _THROUGH, "is for curves through the points; omit it with --smooth"
    wrong = next((option for name, option in other.items() if name in given), None)
    refuse(
        "",
        (wrong, f"{wrong} {remedy}"),
        (options.smooth and options.dedup == "mean", "with --smooth all points of one time count; omit --dedup mean"),
        (adapts and "lam" in given, "--lam gives one λ, and --smooth adaptive lets it vary; omit one of them"),
        ({"lam", "criterion"} <= {*given}, "--lam gives λ, which --criterion would choose; omit one of them"),
        (options.criterion == "cp" and not options.sigma, "--criterion cp needs the noise; give it with --sigma"),
    )
    if "sigma" in given and "lam" not in given:
        given.setdefault("criterion", "cp")
    if adapts:
        given["lam"] = "adaptive"
    if options.sigma is not None:
        given["sigma"] = _in_radians(options, space)
    return given | {"extrapolate": _POLICIES.get(options.extrapolate)}


def _read(options: argparse.Namespace, whole: Table, space: Space) -> tuple[Recordings, Columns]:
    """Return the curves in the table, and the names of their columns."""
    table, time = with_stamps(whole, options.time, options.skipna)
    if options.curve is None and table.tracks is not None:
        count = len(set(table.labels(table.tracks)))
        tell(f"{table.path}: {count} tracks, each of which becomes a curve; --curve {JOINED} makes one curve of them")
        options.curve = table.tracks
    elif options.curve == JOINED and JOINED not in table.names:
        options.curve = None
    curve = table.require(options.curve) if options.curve is not None else None
    given = split_names(options.columns)
    time = time_column(table, time, [curve, *given], options.unix is not None or options.time_format)
    if options.euler is not None:
        table = with_quaternions(table, options.euler, given, [time, curve], bool(options.degrees))
        given = [*(name for name in given if name in table.names), *QUATERNION] if given else []
        given = given or [name for name in table.numeric if name not in (time, curve)]
    points = point_columns(table, given, [time, curve], space, options.lonlat, options.quaternion)
    points = replace(points, degrees=options.degrees, atol=options.atol)
    needed = [*points.used, *filter(None, [time, curve])]
    table = table.without_empty(needed) if options.skipna else table
    if options.skipna and points.quaternion:
        table = table.rows_where(~points.are_zero(table))
    rows = table.read(points.used, time, curve, options.unix)
    check_days(table, time, rows)
    _note_on_units(table, time, rows)
    at = "times 0, 1, 2, ..." if time is None else f"times in column {time}"
    tell(f"{table.path}: {table.path.format} table, points in columns {listed(points.names)}, {at}", VERBOSE)
    data = Recordings(table, rows, time, points, options, whole.height - table.height)
    cut = options.max_gap is not None and curve is not None
    names = points.names, time or "time", curve or "curve"
    decimals = decimals_of(points.used, rows.numbers)
    return data, Columns(*names, options.lonlat, rows.utc, points.quaternion, cut, bool(options.degrees), decimals)


def _note_on_units(table: Table, time: str | None, rows: Rows) -> None:
    """Describe the unit that times without one probably have, such as microseconds since a computer was started."""
    times = rows.times
    if time is None or times.dtype.kind == "M" or len(times) < 2 or (times != np.floor(times)).any():
        return
    step = float(np.median(np.abs(np.diff(times.astype(np.float64)))))
    if step >= _TICKS and "time" in time.lower():
        unit = "ns" if step >= 1000 * _TICKS else "us"
        tell(
            f"{table.path}: most steps of column {time} are {step:g}; if it counts {unit}, also since a start, give "
            f"--unix {unit}, and rates are per second"
        )


def _fitted(
    data: Recordings, columns: Columns, options: argparse.Namespace, keywords: Keywords
) -> Sequence[CubicSpline]:
    """Fit all curves in one call."""

    def text(note: object) -> str:
        return data.located(note).replace(IN_PYTHON, _FOR_ROTATIONS)

    try:
        with printed_warnings(text), Progress("fitting") as progress:
            # The summary counts the curves whose λ is at a bound.
            warnings.simplefilter("ignore", SmoothingWarning)
            curves: Sequence[CubicSpline]
            if options.smooth:
                curves = smooth_many([(*curve, {}) for curve in data.curves], data.space, progress=progress, **keywords)
            else:
                curves = fit_many(data.curves, data.space, progress=progress, **keywords)
    except SymsplineError as error:
        far = outliers(data, None, columns)
        raise error._with_message("; ".join(filter(None, (data.located(error), far)))) from None
    return curves


# ---- the rows of a table as curves to fit: sorted, merged and cut into segments as the user asked ----

Index = NDArray[np.int64]

_TICKS = 1000
"""Steps of whole numbers from which on they probably count microseconds or nanoseconds."""
_JUMP = 30.0
"""Multiple of the median step and speed that a step from one track to another exceeds."""
_FAST, _FAR = 10.0, 10.0
"""Multiples of the median speed and of the median distance from a smooth curve that outliers exceed."""
_ROUNDING = 1e-9
"""Distances that are a smaller part of the largest component of a point are rounding errors."""
_LEVERAGE = 0.9
"""Largest leverage that counts. Beside a gap it is nearly 1, and a bias of the curve would be magnified."""
_BOUND, _MOST_BOUND = 3.0, 5
"""Data that natural ends bind, in data per degree of freedom, and their largest number at an end."""
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
            for count, (curve, kept) in enumerate(segments, 1):
                new = name
                if options.max_gap is not None and rows.labels is None:
                    new = str(count)
                elif len(segments) > 1:
                    new = f"{name}/{count}"
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
        options, smooth = self._options, self._options.smooth is not None
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
        gap = np.inf
        if options.max_gap is not None:
            count, unit = duration(options.max_gap, "--max-gap")
            dates = times.dtype.kind == "M"
            wrong = f"--max-gap {options.max_gap}: the times are numbers; give a gap without a unit"
            refuse("", (unit and not dates, wrong))
            gap = float(count * NANOSECONDS[unit or "s"] / NANOSECONDS["s"] if dates else count)
        used = np.ones(len(index), bool) if smooth else None
        try:
            divided = cut(times, points, self.space, gap, 2, options.dedup or "raise", used)
        except CutLocusError:
            far = f"points{of} with one time are too far apart to have a mean; --dedup first takes the first of them"
            raise Problem(f"{self.path}: {far}") from None
        self.alone += len(first) - sum(map(len, divided.rows))
        return [(curve, index[kept]) for curve, kept in zip(divided.curves, divided.rows, strict=True)]

    def _check(self, index: Index, of: str) -> None:
        """Raise `Problem` unless there are two points whose times increase, or do not decrease."""
        if len(index) < 2:
            where = f", {self.place(int(index[0]))}" if len(index) else ""
            raise Problem(f"{self.path}{where}: this is the only point{of}; a curve needs two")
        if not self.has_times:
            return
        times, smooth = self._rows.times[index], self._options.smooth is not None
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
        if column is not None and same:
            what = f"{same} rows have a time that another row has, and column {column!r} distinguishes them"
            return f"{what}: if the table holds several tracks, fit each of them with --curve {column}"
        if column is None and self._rows.labels is None:
            column = column_of_blocks(self._table, self._used)
        if column is not None:
            what = f"column {column!r} has one block of rows for each of its values"
            return f"{self.path}: {what}: if the table holds several tracks, fit each of them with --curve {column}"
        if self._rows.labels is None:
            column = column_of_tracks(self._table, self._used, self.space, self._points)
        if column is None:
            return self._jump() if self._rows.labels is None else ""
        return (
            f"{self.path}: the path through all rows is more than {ZIGZAG:g} times as long as the paths of each "
            f"{column!r}; if the table holds several tracks, fit each of them with --curve {column}"
        )

    def _jump(self) -> str:
        """Describe a single step that is far longer and faster than the others; empty if there is none."""
        for index, (times, points) in zip(self.groups.values(), self.curves, strict=True):
            if len(index) < _FEWEST:
                continue
            space = factors_of(self.space)[0]
            part = points[0] if isinstance(points, tuple) else points
            with suppress(SymsplineError):
                steps = np.asarray(space.distance(part[1:], part[:-1]))
                speeds = steps / _lengths_of(times, len(steps))
                usual = np.median(steps)
                far = (steps > _JUMP * usual) & (speeds > _JUMP * np.median(speeds)) & (usual > 0)
                # An outlier has two such steps, there and back, and a flight between two rests has several.
                beside = np.maximum(np.r_[0, speeds[:-1]], np.r_[speeds[1:], 0])
                alone = np.flatnonzero(far & (beside < speeds / _FAST))
                if alone.size:
                    i = int(alone[0])
                    before, after = self.place(int(index[i])), self.place(int(index[i + 1]))
                    return (
                        f"{self.path}: the step from {before} to {after} is {steps[i] / usual:.0f} times as long as "
                        "most; if the table holds several tracks, give a column of their names with --curve"
                    )
        return ""

    def changes(self) -> str:
        """Describe the rows that were merged or omitted, which the curves do not show."""
        dedup = self._options.dedup
        same = "merged with others of the same time" if dedup == "mean" else "omitted after another of their time"
        counts = (
            (self.empty, "without a point or a time omitted (--skipna)"),
            (self.merged, f"{same} (--dedup {dedup})"),
            (self.alone, "alone between gaps omitted"),
        )
        return "".join(f"; {counted(count, 'row')} {what}" for count, what in counts if count)

    def place(self, row: int) -> str:
        """Describe the position of a row in the file."""
        return self._rows.place(row)

    def located(self, note: object) -> str:
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


def outliers(data: Recordings, curves: Sequence[CubicSpline] | None, columns: Columns) -> str:
    """Describe the rows that are probably outliers, with a remedy; empty if there are none.

    ``curves`` are those that were fitted, or None if the fit failed. Points are compared with a smooth curve, or with
    their neighbours.
    """
    spikes: list[tuple[int, float, float, bool]] = []
    smooth = [curve for curve in curves or () if isinstance(curve, SmoothingSpline)] or None
    for i, (index, (times, points)) in enumerate(zip(data.groups.values(), data.curves, strict=True)):
        if len(index) < _FEWEST:
            continue
        # Not all spaces have distances between all points.
        with suppress(SymsplineError):
            several = isinstance(data.space, Product)
            parts = points if several else (points,)
            beside = [None] * len(parts) if smooth is None else _deleted(smooth[i], times, parts)
            for space, part, deviations in zip(factors_of(data.space), parts, beside, strict=True):
                far, sizes, usual = _spikes(space, times, part)
                if deviations is not None:
                    far, sizes, usual = _far(far, *deviations, float(_ROUNDING * np.abs(part).max()))
                by_angle = in_degrees(space, columns.lonlat, columns.degrees)
                # The largest one is the least doubtful.
                order = sorted(np.flatnonzero(far), key=lambda k: -sizes[k])
                spikes += [(int(index[k]), float(sizes[k]), usual, by_angle) for k in order]
    if not spikes:
        return ""
    row, *lengths, degrees = spikes[0]
    scale, unit = (180 / np.pi, "°") if degrees else (1.0, "")
    size, usual_size = (f"{scale * length:.3g}{unit}" for length in lengths)
    where = f"{size} from its neighbours, and most steps are {usual_size}"
    remedy = "omit outliers, or fit near the points with --smooth --robust"
    if smooth is not None:
        where = f"{size} from the curve, and half of the points are within {usual_size}"
        remedy = "--robust reduces the influence of outliers"
    rest = len({k for k, *_ in spikes}) - 1
    others = f" (and in {counted(rest, 'other row')})" if rest else ""
    return f"{data.place(row)}: the point is probably an outlier{others}, {where}; {remedy}"


def _spikes(space: Space, times: Any, points: Any) -> tuple[NDArray[np.bool_], Doubles, float]:
    """Return which points are far from both neighbours, which are closer to each other, and the usual step."""
    steps = np.asarray(space.distance(points[1:], points[:-1]))
    lengths = _lengths_of(times, len(steps))
    is_spike = np.zeros(len(points), bool)
    if not lengths.min(initial=1.0) > 0:
        return is_spike, is_spike.astype(np.float64), 0.0
    speeds = steps / lengths
    usual = float(np.median(speeds))
    sizes = np.r_[0.0, np.minimum(steps[1:], steps[:-1]), 0.0]
    fast, rounding = (speeds > _FAST * usual) & (usual > 0), _ROUNDING * np.abs(points).max()
    # One point, and two neighbours, that are away from the points before and after them.
    for count in (1, 2):
        first = 1 + np.flatnonzero(fast[:-count] & fast[count:])
        around = space.distance(points[first + count], points[first - 1])
        away = np.minimum(steps[first - 1], steps[first + count - 1])
        for k in range(count):
            found = first[away > np.maximum(around, rounding)] + k
            is_spike[found] = True
            sizes[found] = np.maximum(sizes[found], away[away > np.maximum(around, rounding)])
    return is_spike, sizes, float(np.median(steps))


def _lengths_of(times: Any, count: int) -> Doubles:
    """Return the lengths of time steps, none of which is tiny beside the others; 1 without times."""
    if times is None:
        return np.ones(count)
    axis, knots = time_axis_of(times)
    lengths = np.diff(axis.knots(knots))
    return np.asarray(np.maximum(lengths, 1e-3 * lengths.mean()))


_Deviations = tuple[Doubles, Doubles]


def _deleted(curve: SmoothingSpline[Any, Any], times: Any, parts: Sequence[Any]) -> list[_Deviations]:
    """Return the distances of data from a curve, and from the curve without them in standard deviations.

    A deleted residual is r / (1 - h) with the leverage h (Cook and Weisberg, Residuals and influence in regression,
    1982, §2.2). Its standard deviation is σ / √(1 - h). The variance of the curve at a datum is h σ². Distances of
    poses, which mix two units, are returned as they are.
    """
    several = is_several(curve.space)
    std, near, varying, mean = curve.std(times), curve(times), curve.sigma_at(times), curve.sigma
    groups = [grouped(curve.space, value if several else (value,)) for value in (std, varying, mean)]
    near = near if isinstance(curve.space, Product) else (near,)
    deviations = []
    for space, part, at, *noise in zip(factors_of(curve.space), parts, near, *groups, strict=True):
        distances = np.asarray(space.distance(part, at))
        if len(noise[0]) > 1 or not noise[2][0] > 0:
            deviations.append((distances, distances))
            continue
        spread, sigma, level = (np.asarray(value[0]) for value in noise)
        leverage = np.minimum((spread / sigma) ** 2, _LEVERAGE)
        deviations.append((distances, distances / np.sqrt(1 - leverage) * level / sigma))
    ends = _end_of(curve)
    for _, deleted in deviations:
        # Natural ends bind the curve, which misses exact data there.
        deleted[:ends] = np.minimum(deleted[:ends], np.median(deleted))
        deleted[len(deleted) - ends :] = np.minimum(deleted[len(deleted) - ends :], np.median(deleted))
    return deviations


def _end_of(curve: SmoothingSpline[Any, Any]) -> int:
    """Return the number of data at an end that the end condition binds: a few per degree of freedom."""
    if curve.bc_type != "natural":
        return 0
    fewest = min(float(part.report.df) for part in curve._smoothed)
    count = len(curve.data[0])
    return int(min(math.ceil(_BOUND * count / max(fewest, 1.0)), _MOST_BOUND, count // 4))


def _far(
    spikes: NDArray[np.bool_], distances: Doubles, deleted: Doubles, rounding: float
) -> tuple[NDArray[np.bool_], Doubles, float]:
    """Return which points are far from a curve, their distances, and the distance within which most points are.

    Outliers pull the curve, which misses their neighbours.
    """
    usual = float(np.median(deleted))
    far = (deleted > _FAR * usual) & (distances > rounding)
    spikes = spikes & (deleted > _FAR / 2 * usual) & (distances > rounding)
    beside = np.convolve(spikes, np.ones(5), "same") > 0
    largest = sliding_window_view(np.pad(deleted, 2), 5).max(axis=1)
    return spikes | (far & ~beside & (deleted == largest)), distances, float(np.median(distances))

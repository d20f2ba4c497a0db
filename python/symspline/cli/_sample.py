"""Make a table of points along curves

The table is a CSV, NPZ, Parquet, JSON, GeoJSON or GPX file or a TUM trajectory; the ending of its name or --to selects
the format. Columns are the time, the name of the curve if there are several, and the numbers of the point. They are
named as in the table that was fitted, or x0, x1, ... in the order of the array, m11, m12, ... for a matrix, row by row,
and x0_re and x0_im for a complex number.

--nu 1 writes the velocity, x0_d1, ... or x0_d1_re, ..., and --nu 2 the covariant acceleration, x0_d2, ..., per unit of
time, which is a second for dates. For longitude and latitude these are east_d1, north_d1, ..., in degrees of arc. For
unit quaternions, whose sign does not jump along a curve, they are the angular velocity wx, wy, wz in the frame of the
body, in radians per unit of time, and the angular acceleration wx_d1, wy_d1, wz_d1.

Curves fitted with --smooth have the standard error of a coordinate of the point, std, and of the velocity, std_d1, in
the units of the columns next to them:

  std           degrees for longitude and latitude; radians of the angle for rotation matrices, and half of that for a
                number of a unit quaternion, which changes by half of the angle; otherwise the unit of the points
  std_d1        the same per unit of time
  std_wx, ...   the standard errors of wx, wy and wz, in radians per unit of time

A product has std1, std2, ... for its factors, and a pose has std_position and
std_rotation, in the unit of the position and in radians as above. A
line or a subspace has many arrays: the representative may change from one segment of a curve to the next, and vectors
belong to the one in their row.

examples:
  symspline sample track.npz --every 10min -o track.csv
  symspline sample attitude.npz -n 1000 --nu 0,1,2 -o attitude.parquet
  symspline sample storms.npz --at satellites.csv --nu 0,1 -o storms.csv

With dates, --every 1h samples at full hours in UTC and --every 1d at midnight, as symspline.geo.resample does: the
times are whole multiples of the step since 1970-01-01. The first sample is at or after the start of a curve, and the
last one at or before its end. Use -n for samples from the start to the end. With numbers, --every counts from the
start.

With recordings that --max-gap cut into segments, --at evaluates each time on its segment and omits times in gaps. A
TUM trajectory is one file with all segments in the order of time. -o 'x_{curve}.csv' writes one file per curve.

--at reads the column of times of the table that was fitted, or finds one as symspline fit does. If the file also has
the column of the curves' names, every row is for its curve, otherwise for all curves.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.time import onto_ends
from .._smoothing import SmoothingSpline
from .._spaces import Doubles, space_named
from .._splines.cubic import CubicSpline
from ..convert._pose_files import TUM
from ._columns import Columns, quaternion_by_names, time_column, with_stamps
from ._curves import Curves, Samples, deviations_of, read_curves, samples_of
from ._files import called, check_inputs, check_target
from ._formats import TABLES, Layout, endings, format_of, is_binary, open_table, write_table
from ._messages import Problem, Progress, counted, did_you_mean, first_duplicate, refuse, say, tell
from ._recordings import group
from ._tables import UNITS, Rows, Table, number
from ._times import Times, every, spread

_EACH = "{curve}"
"""Replaced by the name of a curve in the name of the output."""
_MOST = 10**9
_TUM_NAMES = list(TUM[1:])
_TUM_SPACES = [space_named(name) for name in ("se:3", "so:3 x r:3", "r:3 x so:3")]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline sample``."""
    add = parser.add_argument
    add("curves", type=Path, metavar="CURVE", help="file of curves to read: .npz, or - for standard input")
    which = parser.add_mutually_exclusive_group(required=True)
    steps = (
        "a step: for dates a duration in ns, us, ms, s (or no unit), min, h or d, with samples at its whole multiples "
        "in UTC, such as full hours; for numbers a number, with samples from the start on"
    )
    which.add_argument("--every", metavar="DT", help=steps)
    count = "the number of equidistant samples from the start to the end"
    which.add_argument("-n", dest="number", type=number, metavar="N", help=count)
    which.add_argument("--at", type=Path, metavar="FILE", help=f"a table with times: {endings()}, or -")
    add("--curve", action="append", metavar="NAME", help="which curve; may be repeated (default: all)")
    add("--unix", choices=UNITS, help="times of --at are numbers that count this unit since 1970-01-01 in UTC")
    add("--nu", default="0", metavar="0,1,2", help="points (0, default), velocities (1), accelerations (2)")
    add("--lonlat", action="store_true", help="write longitude and latitude of any curve on sphere:2")
    add("--digits", type=int, metavar="N", help="round the numbers to N significant digits, but not the times")
    add(
        "--time",
        metavar="COL",
        help="column of times in the table of --at (default: that of the table that was fitted)",
    )
    add("--from", dest="format", choices=TABLES, help="format of the table of --at (default: as its name ends)")
    add("--to", choices=TABLES, help="format to write (default: as the name of OUT ends, CSV for -)")
    out = f"table to write: {endings()}, or - for standard output; {_EACH} in its name makes one file per curve"
    add("-o", dest="output", type=Path, metavar="OUT", required=True, help=out)


def run(options: argparse.Namespace) -> int:
    """Evaluate, and write the table."""
    form = format_of(options.output, options.to)
    check_inputs(options.curves, options.at)
    inputs = options.curves, options.at
    check_target(options.output, *inputs, binary=is_binary(form))
    orders, digits = _orders(options.nu), options.digits
    refuse(f"--digits {digits}: ", (digits is not None and not 1 <= digits <= 17, "give a number between 1 and 17"))
    every_curve = read_curves(options.curves, options.lonlat)
    curves = every_curve.chosen(options.curve)
    columns = _tum_columns(curves, orders) if form == "tum" else curves.columns
    times, rows, labels = _times(options, curves, every_curve)
    samples = _sampled(curves, times, orders, columns, form != "tum", digits)
    if _EACH in options.output.name:
        paths = [
            options.output.with_name(options.output.name.replace(_EACH, name.replace("/", "_"))) for name in samples
        ]
        twice = first_duplicate([str(path).lower() for path in paths])
        refuse(f"-o {options.output}: ", (twice, f"two curves would have the file {twice}; choose one with --curve"))
        for path in paths:
            check_target(path, *inputs)
        for name, path in zip(samples, paths, strict=True):
            _write(path, form, {name: times[name]}, samples, None, columns, {})
        return 0
    if form == "tum":
        _check_order(curves)
    _write(options.output, form, times, samples, rows, columns, labels if curves.named and form != "tum" else {})
    return 0


def _sampled(
    curves: Curves, times: dict[str, Times], orders: list[int], columns: Columns, stds: bool, digits: int | None
) -> dict[str, Samples]:
    """Return the columns of every curve, with standard deviations if all curves have them and ``stds`` is True."""
    smooth = stds and all(isinstance(spline, SmoothingSpline) for spline in curves.splines.values())
    functions: Any = (samples_of, deviations_of) if smooth else (samples_of,)
    samples: dict[str, Samples] = {}
    with Progress("sampling") as progress:
        for done, (name, x) in enumerate(times.items(), 1):
            blocks = [function(curves.splines[name], x, nu, columns) for nu in orders for function in functions]
            found = list(chain.from_iterable(blocks))
            samples[name] = [(key, _rounded(own, digits)) for key, own in found] if digits else found
            progress(done, len(times))
    return samples


def _write(
    path: Path,
    form: str,
    times: dict[str, Times],
    samples: dict[str, Samples],
    rows: NDArray[np.int64] | None,
    columns: Columns,
    labels: Mapping[str, str],
) -> None:
    """Write the table of some curves, in the order of ``rows``, with a column of ``labels`` if there are any."""
    pairs: list[tuple[str, NDArray[Any]]] = [(columns.time, np.concatenate(list(times.values())))]
    if labels:
        pairs.append((columns.curve, np.repeat([labels[name] for name in times], [len(x) for x in times.values()])))
    for parts in zip(*(samples[name] for name in times), strict=True):
        pairs.append((parts[0][0], np.concatenate([numbers for _, numbers in parts])))
    twice = first_duplicate([name for name, _ in pairs])
    refuse("", (twice is not None, f"two columns would have the name {twice!r}; rename them"))
    order = slice(None) if rows is None else np.argsort(rows)
    lonlat = tuple(columns.points) if columns.lonlat else None
    layout = Layout(columns.time, columns.curve if labels else None, lonlat, bool(columns.utc))
    write_table(path, form, {name: column[order] for name, column in pairs}, layout)
    tell(f"{called(path)}: {counted(len(pairs[0][1]), 'row')}")


def _rounded(numbers: Doubles, digits: int) -> Doubles:
    """Round to significant digits."""
    texts = (f"{number:.{digits - 1}e}" for number in numbers.tolist())
    return np.fromiter(map(float, texts), np.float64, len(numbers))


def _orders(text: str) -> list[int]:
    orders = [part.strip() for part in text.split(",")]
    if not set(orders) <= {"0", "1", "2"} or len(set(orders)) < len(orders):
        raise Problem(f"--nu {text}: give one or more of 0, 1 and 2, separated by commas")
    return list(map(int, orders))


def _tum_columns(curves: Curves, orders: list[int]) -> Columns:
    space = next(iter(curves.splines.values())).space
    spaces = " or of ".join(map(str, _TUM_SPACES))
    refuse(
        "a TUM trajectory ",
        (space not in _TUM_SPACES, f"has poses, points of {spaces}, not of {space}"),
        (orders != [0], "has poses and no derivatives; write those to a .csv, .npz or .parquet file"),
    )
    return Columns(_TUM_NAMES, quaternion=quaternion_by_names(_TUM_NAMES, space))


def _check_order(curves: Curves) -> None:
    """Raise `Problem` unless every curve begins after the end of the previous one."""
    for (name, own), (other, following) in pairwise(curves.splines.items()):
        if not own.t[-1] < following.t[0]:
            raise Problem(
                f"a TUM trajectory has increasing times, but {curves.called(other)} begins before the end of "
                f"{curves.called(name)}; choose one with --curve, or write one file per curve, such as -o x_{_EACH}.txt"
            )


# ---- times ----


def _times(
    options: argparse.Namespace, curves: Curves, every_curve: Curves
) -> tuple[dict[str, Times], NDArray[np.int64] | None, dict[str, str]]:
    """Return the times of every curve, their rows if every row of a table is for one curve, and names for the table."""
    if options.at is not None:
        table, given = with_stamps(open_table(options.at, options.format), options.time, False)
        return _given(table, given, curves, every_curve, options.unix)
    times = {name: _along(spline.t, options) for name, spline in curves.splines.items()}
    empty = f"no multiple of this step lies between the start and the end of {'any' if curves.named else 'the'} curve"
    none = not any(map(len, times.values()))
    refuse(f"--every {options.every}: ", (none, f"{empty}; use a shorter step, or -n"))
    return times, None, {name: name for name in times}


def _along(knots: Times, options: argparse.Namespace) -> Times:
    if options.every is not None:
        return every(options.every, knots)
    count = options.number
    wrong = f"-n {count:g}: the number of samples must be a whole number between 1 and 10^9"
    refuse("", (not 1 <= count <= _MOST or count != int(count), wrong))
    return spread(int(count), knots)


def _given(
    table: Table, given: str | None, curves: Curves, every_curve: Curves, unix: str | None
) -> tuple[dict[str, Times], NDArray[np.int64] | None, dict[str, str]]:
    path, usual, label = table.path, curves.columns.time, curves.columns.curve
    only = table.names[0] if len(table.names) == 1 else None
    usual_or_only = usual if usual in table.names else only
    time = time_column(table, given, [], unix is not None) if given or not usual_or_only else usual_or_only
    if time is None:
        raise Problem(f"{path} has no column {usual!r} of times; {did_you_mean(usual, table.names)}")
    labelled = every_curve.named and label in table.names
    rows = table.read([], time, label if labelled else None, unix=unix)
    recordings = curves.recordings
    segments = {name: [name] for name in curves.splines} | recordings
    if labelled:
        known = {*every_curve.splines, *every_curve.recordings}
        asked = {name: own for name, own in group(rows).items() if name in segments or name not in known}
    else:
        asked = dict.fromkeys(recordings, group(rows)[""])
    groups: dict[str, NDArray[np.int64]] = {}
    labels: dict[str, str] = {}
    for name, own in asked.items():
        if name not in segments:
            near = did_you_mean(name, list(segments))
            raise Problem(f"{path}, {rows.place(int(own[0]))}: there is no curve {name!r}; {near}")
        parts = _by_segment(rows, own, {part: curves.splines[part] for part in segments[name]})
        groups |= parts
        # Segments have the name that the table gives their recording.
        labels |= {part: name if labelled else part for part in parts}
    for name, own in groups.items():
        _check_times(path, rows, own, curves, name)
    refuse(path, (not any(map(len, groups.values())), " has no times of these curves"))
    order = np.concatenate(list(groups.values())) if labelled or len(recordings) == 1 else None
    return {name: rows.times[own] for name, own in groups.items()}, order, labels


def _by_segment(rows: Rows, own: NDArray[np.int64], splines: Mapping[str, CubicSpline]) -> dict[str, NDArray[np.int64]]:
    """Divide rows between the segments of a recording; those in the gaps between segments are omitted."""
    times = rows.times[own]
    starts, ends = (np.array([spline.t[i] for spline in splines.values()]) for i in (0, -1))
    if times.dtype.kind != starts.dtype.kind and "M" in (times.dtype.kind, starts.dtype.kind):
        # `_check_times` describes the difference.
        return {next(iter(splines)): own}
    segment = np.maximum(np.searchsorted(starts, times, "right") - 1, 0)
    in_gap = (times > ends[segment]) & (segment < len(starts) - 1)
    if in_gap.any():
        say(f"{int(in_gap.sum())} of {len(in_gap)} times lie in gaps between segments, and are omitted")
    return {name: own[(segment == i) & ~in_gap] for i, name in enumerate(splines)}


def _check_times(path: object, rows: Rows, own: NDArray[np.int64], curves: Curves, name: str) -> None:
    """Raise `Problem` unless the curve has points at these times."""
    spline, curve = curves.splines[name], curves.called(name)
    times, knots = rows.times[own], spline.t
    dates = knots.dtype.kind == "M"
    expected, found = ("dates", "numbers") if dates else ("numbers", "dates")
    these, those = ("a time zone", "none") if rows.utc else ("no time zone", "one")
    unix = "; give --unix if they count from 1970" if dates else ""
    kinds = f": the times of {curve} are {expected}, but these are {found}{unix}"
    zones = f": its times have {these}, but those of {curve} have {those}: which time is meant is in doubt"
    mixed = dates and {rows.utc, curves.columns.utc} == {True, False}
    refuse(path, ((times.dtype.kind == "M") != dates, kinds), (mixed, f"{zones}; write both with a zone, or neither"))
    if spline._extrapolation_mode != "raise":
        return
    inside = onto_ends(times, knots, (), False)[0] if times.dtype.kind == knots.dtype.kind == "f" else times
    outside = np.flatnonzero((inside < knots[0]) | (inside > knots[-1]))
    if outside.size:
        zone = " UTC" if curves.columns.utc else ""
        raise Problem(
            f"{path}, {rows.place(int(own[outside[0]]))}: time {times[outside[0]]}{zone} is outside {curve}, which "
            f"runs from {knots[0]} to {knots[-1]}{zone}; fit with --extrapolate to define the curve there"
        )

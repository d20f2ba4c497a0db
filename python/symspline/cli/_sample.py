"""Make a table of points along curves

The table is a CSV, NPZ or Parquet file or a TUM trajectory; the ending of its name selects the format. Columns are
the time, the name of the curve if there are several, and the numbers of the point. They are named as in the table that
was fitted, or x0, x1, ... in the order of the array, m11, m12, ... for a matrix, row by row, and x0_re and x0_im for
a complex number.

--nu 1 writes the velocity, x0_d1, ... or x0_d1_re, ..., and --nu 2 the covariant acceleration, x0_d2, ..., per unit of
time, which is a second for dates. For longitude and latitude these are east_d1, north_d1, ..., in degrees of arc; for
unit quaternions, whose sign does not jump along a curve, the derivatives on their sphere.

Curves fitted with --smooth have the standard deviation of a coordinate of the point, std, and of the velocity, std_d1,
in the units of the columns next to them: degrees for longitude and latitude, radians for rotation matrices, half of
that for unit quaternions. A product has std1, std2, ... for its factors, and a pose std_position and std_rotation. A
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

--at reads the column of times of the table that was fitted, or finds one as symspline fit does. If the file also has
the column of the curves' names, every row is for its curve, otherwise for all curves.
"""

from __future__ import annotations

import argparse
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._pose_files import TUM
from .._smoothing import SmoothingSpline
from .._spaces import space_named
from .._time import onto_ends
from ._columns import quaternion_by_names, time_column
from ._curves import Curves, read_curves
from ._messages import Problem, Progress, check_target, did_you_mean, first_duplicate, refuse
from ._points import Columns, Samples, deviations_of, samples_of
from ._recordings import Groups, group
from ._tables import TUM_ENDINGS, Rows, check_ending, open_table, write_table
from ._times import Times, every, number, spread

_MOST = 10**9
_TUM_NAMES = list(TUM[1:])
_TUM_SPACES = [space_named(name) for name in ("se:3", "so:3 x r:3", "r:3 x so:3")]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline sample``."""
    add = parser.add_argument
    add("curves", type=Path, metavar="CURVE", help="file of curves to read: .npz")
    which = parser.add_mutually_exclusive_group(required=True)
    steps = (
        "a step: for dates a duration in ns, us, ms, s (or no unit), min, h or d, with samples at its whole multiples "
        "in UTC, such as full hours; for numbers a number, with samples from the start on"
    )
    which.add_argument("--every", metavar="DT", help=steps)
    count = "the number of equidistant samples from the start to the end"
    which.add_argument("-n", dest="number", type=number, metavar="N", help=count)
    which.add_argument("--at", type=Path, metavar="FILE", help="a table with times: .csv, .npz or .parquet")
    add("--nu", default="0", metavar="0,1,2", help="points (0, default), velocities (1), accelerations (2)")
    add("--lonlat", action="store_true", help="write longitude and latitude of any curve on sphere:2")
    add("-o", dest="output", type=Path, metavar="OUT", required=True, help="table to write")


def run(options: argparse.Namespace) -> int:
    """Evaluate, and write the table."""
    suffix = check_ending(options.output)
    check_target(options.output)
    orders = _orders(options.nu)
    curves = read_curves(options.curves, options.lonlat)
    splines, columns = curves.splines, curves.columns
    stds = all(isinstance(spline, SmoothingSpline) for spline in splines.values())
    if suffix in TUM_ENDINGS:
        # A trajectory has no columns for standard deviations.
        columns, stds = _tum_columns(curves, orders), False
    if options.at is not None:
        times, rows = _given(options.at, curves)
    else:
        times, rows = {name: _along(spline.t, options) for name, spline in splines.items()}, None
        empty = (
            f"no multiple of this step lies between the start and the end of {'any' if curves.named else 'the'} curve"
        )
        none = not any(map(len, times.values()))
        refuse(f"--every {options.every}: ", (none, f"{empty}; use a shorter step, or -n"))
    functions: Any = (samples_of, deviations_of) if stds else (samples_of,)
    samples: list[Samples] = []
    with Progress("sampling") as progress:
        for done, (name, x) in enumerate(times.items(), 1):
            blocks = [function(splines[name], x, nu, columns) for nu in orders for function in functions]
            samples.append(list(chain.from_iterable(blocks)))
            progress(done, len(times))
    pairs: list[tuple[str, NDArray[Any]]] = [(columns.time, np.concatenate(list(times.values())))]
    if curves.named:
        pairs.append((columns.curve, np.repeat(list(times), [len(x) for x in times.values()])))
    for parts in zip(*samples, strict=True):
        pairs.append((parts[0][0], np.concatenate([numbers for _, numbers in parts])))
    twice = first_duplicate([name for name, _ in pairs])
    refuse("", (twice is not None, f"two columns would have the name {twice!r}; rename them"))
    order = slice(None) if rows is None else np.argsort(rows)
    write_table(options.output, {name: column[order] for name, column in pairs}, bool(columns.utc))
    print(f"{options.output}: {len(pairs[0][1])} rows")
    return 0


def _orders(text: str) -> list[int]:
    orders = [part.strip() for part in text.split(",")]
    if not set(orders) <= {"0", "1", "2"} or len(set(orders)) < len(orders):
        raise Problem(f"--nu {text}: give one or more of 0, 1 and 2, separated by commas")
    return list(map(int, orders))


def _tum_columns(curves: Curves, orders: list[int]) -> Columns:
    space = next(iter(curves.splines.values())).space
    spaces = " or of ".join(map(str, _TUM_SPACES))
    other = "write {} to a .csv, .npz or .parquet file"
    refuse(
        "a TUM trajectory ",
        (space not in _TUM_SPACES, f"has poses, points of {spaces}, not of {space}"),
        (curves.named, f"is one curve; {other.format('several')}"),
        (orders != [0], f"has poses and no derivatives; {other.format('those')}"),
    )
    return Columns(_TUM_NAMES, quaternion=quaternion_by_names(_TUM_NAMES, space))


# ---- times ----


def _along(knots: Times, options: argparse.Namespace) -> Times:
    if options.every is not None:
        return every(options.every, knots)
    count = options.number
    wrong = f"-n {count:g}: the number of samples must be a whole number between 1 and 10^9"
    refuse("", (not 1 <= count <= _MOST or count != int(count), wrong))
    return spread(int(count), knots)


def _given(path: Path, curves: Curves) -> tuple[dict[str, Times], NDArray[np.int64] | None]:
    """Return the times of every curve in a file, and their rows if every row is for one curve."""
    table, usual = open_table(path), curves.columns.time
    only = table.names[0] if len(table.names) == 1 else None
    time = usual if usual in table.names else only or time_column(table, None, [])
    if time is None:
        raise Problem(f"{path} has no column {usual!r} of times; {did_you_mean(usual, table.names)}")
    labelled = curves.named and curves.columns.curve in table.names
    rows = table.read([], time, curves.columns.curve if labelled else None)
    groups: Groups = group(rows) if labelled else dict.fromkeys(curves.splines, group(rows)[""])
    for name, own in groups.items():
        if name not in curves.splines:
            near = did_you_mean(name, list(curves.splines))
            raise Problem(f"{path}, {rows.place(int(own[0]))}: there is no curve {name!r}; {near}")
        _check_times(path, rows, own, curves, name)
    order = np.concatenate(list(groups.values())) if labelled else None
    return {name: rows.times[own] for name, own in groups.items()}, order


def _check_times(path: Path, rows: Rows, own: NDArray[np.int64], curves: Curves, name: str) -> None:
    """Raise `Problem` unless the curve has points at these times."""
    spline, called = curves.splines[name], curves.called(name)
    times, knots = rows.times[own], spline.t
    dates = knots.dtype.kind == "M"
    expected, found = ("dates", "numbers") if dates else ("numbers", "dates")
    these, those = ("a time zone", "none") if rows.utc else ("no time zone", "one")
    kinds = f": the times of {called} are {expected}, but these are {found}"
    zones = f": its times have {these}, but those of {called} have {those}: which time is meant is in doubt"
    mixed = dates and {rows.utc, curves.columns.utc} == {True, False}
    refuse(path, ((times.dtype.kind == "M") != dates, kinds), (mixed, f"{zones}; write both with a zone, or neither"))
    if spline._extrapolation_mode != "raise":
        return
    inside = onto_ends(times, knots, (), False)[0] if times.dtype.kind == knots.dtype.kind == "f" else times
    outside = np.flatnonzero((inside < knots[0]) | (inside > knots[-1]))
    if outside.size:
        raise Problem(
            f"{path}, {rows.place(int(own[outside[0]]))}: time {times[outside[0]]} is outside {called}, which runs "
            f"from {knots[0]} to {knots[-1]}; fit with --extrapolate to define the curve there"
        )

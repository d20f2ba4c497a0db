"""``symspline sample``: a file of curves becomes a table."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..curves.ends import is_closed
from ..smoothing import SmoothingSpline
from ..spline import CubicSpline
from ..times import onto_ends
from .curves import Columns, Curves, read_curves
from .data import Groups, group
from .errors import Problem, check_target, did_you_mean, first_twice
from .formats import open_table, write_table
from .layout import column_names, flatten
from .numbers import whole
from .points import motion_degrees, motion_labels, to_degrees
from .progress import Progress
from .quaternions import Signs, columns_of
from .smoothing import spread_names, spreads
from .tables import ENDINGS, Rows, Table, ending
from .time_columns import time_column
from .times import Times, every, spread
from .tum_files import ENDINGS as TUM
from .tum_files import as_tum

SUMMARY = "make a table of points along curves"
DESCRIPTION = """\
Make a table of points along curves: CSV, NPZ, Parquet or a TUM trajectory, by the ending of its name. Columns
are the time, the name of the curve if there are several, and the numbers of the point, named as in the table that was
fitted, or x0, x1, ... in the order of its array, and m11, m12, ... for a matrix, row by row; of a complex
number x0_re and x0_im. With --nu 1 there is the velocity, x0_d1, ... or x0_d1_re, ..., and with --nu 2 the
covariant acceleration, x0_d2, ..., per unit of time, which is a second for dates. For longitude and latitude
these are east_d1, north_d1, ..., in degrees of arc; for unit quaternions, whose sign
does not jump along a curve, the derivatives on their sphere. Of curves fitted with --smooth there is the standard
deviation of a coordinate of the point, std, and of the velocity, std_d1, in the units of the columns beside it: degrees
for longitude and latitude, radians for rotation matrices, half of that for unit quaternions. A product has std1, std2,
... of its factors, and a pose std_position and std_rotation. A line or a subspace has many arrays: which one stands for
it may change from one segment of a curve to the next, and vectors go with the one in their row."""
EPILOG = """\
examples:
  symspline sample track.npz --every 10min -o track.csv
  symspline sample attitude.npz -n 1000 --nu 0,1,2 -o attitude.parquet
  symspline sample storms.npz --at satellites.csv --nu 0,1 -o storms.csv

--at reads the column of times of the table that was fitted, or t or time; if the file also has the column of
the curves' names, every row is for its curve, else for all."""

# Samples at a time.
_CHUNK = 100_000
_MOST = 10**9


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``symspline sample``."""
    add = parser.add_argument
    add("curves", type=Path, metavar="CURVE", help="file of curves to read: .npz")
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument(
        "--every",
        metavar="DT",
        help="from the start in steps: a number in the unit of the times, seconds for dates; or for dates "
        "a duration in ns, us, ms, s, min, h or d",
    )
    which.add_argument(
        "-n", dest="number", type=whole, metavar="N", help="so many, from the start to the end"
    )
    which.add_argument(
        "--at", type=Path, metavar="FILE", help="at the times in a table: .csv, .npz or .parquet"
    )
    add(
        "--nu",
        default="0",
        metavar="0,1,2",
        help="points (0, the default), velocities (1), accelerations (2)",
    )
    add("--lonlat", action="store_true", help="write longitude and latitude, also of curves fitted otherwise")
    add("-o", dest="output", type=Path, metavar="OUT", required=True, help="table to write")


def run(options: argparse.Namespace) -> int:
    """Evaluate, and write the table."""
    ending(options.output, ENDINGS, "a table")
    check_target(options.output)
    orders = _orders(options.nu)
    curves = read_curves(options.curves, options.lonlat)
    is_tum = options.output.suffix.lower() in TUM
    if is_tum:
        curves = as_tum(curves, orders)
    if options.at is not None:
        times, rows = _given(options.at, curves)
    else:
        times = {name: _along(spline.t, options) for name, spline in curves.splines.items()}
        rows = None
    # A trajectory of TUM has no place for deviations.
    names = _names(curves, orders, not is_tum)
    with Progress("sampling") as progress:
        values = _values(curves, times, orders, not is_tum, progress)
    columns: list[NDArray[Any]] = [np.concatenate(list(times.values())), *values.T]
    if curves.named:
        columns.insert(1, np.repeat(list(times), [len(x) for x in times.values()]))
    if rows is not None:
        columns = [column[np.argsort(rows)] for column in columns]
    write_table(options.output, dict(zip(names, columns, strict=True)), bool(curves.columns.utc))
    print(f"{options.output}: {len(values)} rows")
    return 0


# ---- times ----


def _along(knots: Times, options: argparse.Namespace) -> Times:
    if options.every is not None:
        return every(options.every, knots)
    if not 1 <= options.number <= _MOST:
        raise Problem(f"-n {options.number}: the number of samples must be between 1 and 10^9")
    return spread(options.number, knots)


def _given(path: Path, curves: Curves) -> tuple[dict[str, Times], NDArray[np.int64] | None]:
    """Times of every curve in a file, and their rows if every row is for one curve."""
    table = open_table(path)
    time = _time_column(table, curves.columns.time)
    curve = curves.columns.curve if curves.named and curves.columns.curve in table.names else None
    with Progress("reading") as progress:
        rows = table.read([], time, curve, progress)
    if rows.labels is None:
        groups: Groups = {name: np.arange(len(rows.times)) for name in curves.splines}
    else:
        groups = group(rows)
    for name, own in groups.items():
        if name not in curves.splines:
            near = did_you_mean(name, list(curves.splines))
            raise Problem(f"{path}, {rows.place(own[0])}: there is no curve {name!r}; {near}")
        _check_times(path, rows, own, curves, name)
    times = {name: rows.times[own] for name, own in groups.items()}
    return times, None if rows.labels is None else np.concatenate(list(groups.values()))


def _time_column(table: Table, usual: str) -> str:
    if usual in table.names or len(table.names) == 1:
        return usual if usual in table.names else table.names[0]
    found = time_column(table, None, [])
    if found is None:
        raise Problem(f"{table.path} has no column {usual!r} of times; {did_you_mean(usual, table.names)}")
    return found


def _check_times(path: Path, rows: Rows, own: NDArray[np.int64], curves: Curves, name: str) -> None:
    """Raise `Problem` unless the curve has points at these times."""
    spline = curves.splines[name]
    times, knots = rows.times[own], spline.t
    if (times.dtype.kind == "M") != (knots.dtype.kind == "M"):
        kinds = "dates", "numbers"
        wanted, found = kinds if knots.dtype.kind == "M" else kinds[::-1]
        raise Problem(f"{path}: the times of {curves.called(name)} are {wanted}, but these are {found}")
    if knots.dtype.kind == "M" and {rows.utc, curves.columns.utc} == {True, False}:
        these, those = ("a time zone", "none") if rows.utc else ("no time zone", "one")
        raise Problem(
            f"{path}: its times have {these}, but those that {curves.called(name)} was fitted to have {those}: which "
            "time is meant is in doubt; write both with a zone, or both without"
        )
    if spline.extrapolate is not None or is_closed(spline.bc_type):
        return
    inside = times
    if times.dtype.kind == knots.dtype.kind == "f":
        inside, _ = onto_ends(times, knots, (), False)
    outside = np.flatnonzero((inside < knots[0]) | (inside > knots[-1]))
    if outside.size:
        raise Problem(
            f"{path}, {rows.place(own[outside[0]])}: time {times[outside[0]]} is outside {curves.called(name)}, "
            f"which runs from {knots[0]} to {knots[-1]}; fit with --extrapolate to say what is meant there"
        )


# ---- columns ----


def _orders(text: str) -> list[int]:
    orders = [part.strip() for part in text.split(",")]
    if not set(orders) <= {"0", "1", "2"} or len(set(orders)) < len(orders):
        raise Problem(f"--nu {text}: give one or more of 0, 1 and 2, separated by commas")
    return list(map(int, orders))


def _names(curves: Curves, orders: list[int], with_spreads: bool) -> list[str]:
    columns, space = curves.columns, next(iter(curves.splines.values())).space
    names = [columns.time, *([columns.curve] if curves.named else [])]
    for nu in orders:
        if columns.quaternion is not None:
            names += [f"{name}_d{nu}" if nu else name for name in columns.points]
        elif columns.lonlat:
            names += motion_labels(nu) if nu else columns.points
        else:
            names += column_names(space, columns.points, nu)
        if with_spreads and _all_smooth(curves):
            names += spread_names(space, nu)
    twice = first_twice(names)
    if twice is not None:
        raise Problem(f"two columns would have the name {twice!r}; fit with other names")
    return names


def _all_smooth(curves: Curves) -> bool:
    """Whether deviations are known of all curves."""
    return all(isinstance(spline, SmoothingSpline) for spline in curves.splines.values())


def _values(
    curves: Curves, times: Mapping[str, Times], orders: list[int], with_spreads: bool, progress: Progress
) -> NDArray[np.float64]:
    """The numbers of all samples, one curve after the other."""
    total = sum(map(len, times.values()))
    with_spreads = with_spreads and _all_smooth(curves)
    blocks: list[NDArray[np.float64]] = []
    done = 0
    for name, all_times in times.items():
        signs = [Signs() for _ in orders]
        for start in range(0, len(all_times), _CHUNK):
            x = all_times[start : start + _CHUNK]
            spline, parts = curves.splines[name], []
            for nu, sign in zip(orders, signs, strict=True):
                parts.append(_quantity(spline, x, nu, curves.columns, sign))
                if with_spreads and isinstance(spline, SmoothingSpline):
                    parts.append(
                        spreads(spline, x, nu, curves.columns.lonlat, curves.columns.quaternion is not None)
                    )
            blocks.append(np.concatenate(parts, axis=1))
            done += len(x)
            progress(done, total)
    return np.concatenate(blocks)


def _quantity(spline: CubicSpline, x: Times, nu: int, columns: Columns, signs: Signs) -> NDArray[np.float64]:
    values = spline(x, nu)
    if columns.quaternion is not None:
        points = spline(x) if nu else values
        return columns_of(spline.space, points, values, nu, columns.quaternion, signs)
    if not columns.lonlat:
        return flatten(spline.space, values)
    return motion_degrees(spline(x), values) if nu else to_degrees(values)

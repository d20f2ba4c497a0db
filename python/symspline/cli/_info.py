"""Describe a table or a file of curves

For a table the columns are listed, with their ranges and missing values, the column of times with its step, its repeats
and its gaps, and a column that may hold the names of several curves. For curves the space, the nodes, the time span and
the ends are listed, for those near noisy points also λ and the noise.

Without FILE, the spaces, the formats of files and the optional libraries are listed.

examples:
  symspline info track.csv
  symspline info storms.npz
  symspline info
"""

from __future__ import annotations

import argparse
import zipfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from .._base.arrays import brief
from .._base.time import time_axis_of
from .._grid import GridSpline
from .._smoothing import SmoothingSpline
from .._spaces import Doubles
from .._spaces.base import CLASSES, example_of
from .._splines.files import load
from ._columns import NUMBERED, column_of_names, time_column
from ._curves import read_curves
from ._formats import CURVES, TABLES, endings, format_of, open_table
from ._messages import Problem, listed, refuse
from ._streams import Source
from ._summary import counted, gaps_in, parameters_of, smoothed
from ._tables import Array, Rows, Table

_LIBRARIES = {"pyarrow": "Parquet and large CSV files", "gpxpy": "GPX files", "matplotlib": "symspline plot"}
_LIBRARIES |= {"zarr": "Zarr stores", "shtab": "completion in shells"}


_LONGEST = 1000
_COLUMNS = 12
"""Columns of an array that are described."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline info``."""
    parser.add_argument("file", nargs="?", type=Path, metavar="FILE", help="table or file of curves, or -")
    parser.add_argument("--from", dest="format", choices=TABLES, help="format of FILE (default: as its name ends)")
    parser.add_argument("--time", metavar="COL", help="column of times")


def run(options: argparse.Namespace) -> int:
    """Print a description on standard output."""
    path = options.file
    if path is None:
        lines = _installation()
    elif _is_curve(Source(path, format_of(path, options.format, what="a table or a file of curves"))):
        lines = _curves(path)
    else:
        lines = _table(open_table(path, options.format), options.time)
    # Lines may quote any part of a file.
    for line in lines:
        print(line[: len(line) - len(line.lstrip())] + brief(line.lstrip(), _LONGEST))
    return 0


def _installation() -> list[str]:
    spaces = [(example_of(cls).rpartition("'")[0].rpartition("'")[2], cls) for cls in CLASSES.values()]
    lines = ["spaces, such as:"]
    lines += [f"  {name}: {(cls.__doc__ or '').partition(chr(10))[0]}" for name, cls in spaces]
    lines += [f"formats of tables: {endings()}", "optional libraries:"]
    return lines + [
        f"  {name}: {'installed' if find_spec(name) else 'missing'}, {use}" for name, use in _LIBRARIES.items()
    ]


def _is_curve(source: Source) -> bool:
    with source.open() as file:
        return zipfile.is_zipfile(file) and "format.npy" in zipfile.ZipFile(file).namelist()


# ---- tables ----


def _table(table: Table, given: str | None) -> list[str]:
    columns = {name: own for name, own in table.columns.items() if name}
    refuse(table.path, (not columns, " has no columns"))
    groups = {key: own for key, own in table.groups.items() if len(own) > 1}
    if groups and len(set(map(len, columns.values()))) > 1:
        sizes = [
            f"  {key}: {len(columns[own[0]])}{f' x {len(own)}' * (len(own) > 1)} numbers"
            for key, own in table.groups.items()
        ]
        return [f"{table.path}: arrays of different lengths, such as a grid; see symspline grid --help", *sizes]
    lines = [f"{table.path}: {table.path.format} table, {table.height} rows"]
    hidden = {name for own in groups.values() for name in own[_COLUMNS:]}
    shown = [name for name in columns if name not in hidden]
    lines += [f"  {name}: {_described(table.shown(name))}" for name in shown]
    lines += [f"  ... {own[-1]}: {key} has {len(own)} columns" for key, own in groups.items() if len(own) > _COLUMNS]
    if given not in (None, NUMBERED):
        table.require(given)
    try:
        time = time_column(table, given, [])
        rows = table.read([], time, None) if time is not None else None
    except Problem as problem:
        return [*lines, str(problem)]
    if rows is None or time is None:
        lines.append("times: no column; the points are at 0, 1, 2, ...")
        names = column_of_names(table, None, [])
        return lines if names is None else [*lines, f"--curve {names} fits one curve per {names}"]
    axis, knots = time_axis_of(rows.times)
    seconds = axis.knots(knots)
    lines.append(f"times in column {time!r}: {_times(rows, seconds)}")
    names = column_of_names(table, time, [time]) if (np.diff(seconds) <= 0).any() else None
    return lines if names is None else [*lines, f"--curve {names} fits one curve per {names}"]


def _described(values: Array) -> str:
    if values.dtype.kind in "OUST":
        cells = list(map(str, values.tolist()))
        texts = list(dict.fromkeys(filter(None, cells)))
        missing = cells.count("")
        shown = f"{counted(len(texts), 'distinct text')}: {', '.join(texts[:3])}{', ...' if len(texts) > 3 else ''}"
    else:
        found = values[values == values]
        missing = len(values) - len(found)
        shown = f"{found.min()} to {found.max()}" if len(found) else ""
    if missing == len(values):
        return "no values"
    return f"{shown}{f', {missing} missing' if missing else ''}"


def _times(rows: Rows, seconds: Doubles) -> str:
    times, steps = rows.times, np.diff(seconds)
    unit = " s" if times.dtype.kind == "M" else ""
    parts = [f"{times.min()} to {times.max()}{' UTC' if rows.utc else ''}"]
    ahead = steps[steps > 0]
    if ahead.size:
        parts.append(f"usual step {np.median(ahead):.6g}{unit}")
    repeats, back = int((steps == 0).sum()), int((steps < 0).sum())
    parts += [counted(repeats, "repeated time")] if repeats else []
    parts += [f"{counted(back, 'step')} back in time"] if back else []
    parts += [gaps_in([np.unique(seconds)], unit)] if ahead.size and not back else []
    return ", ".join(filter(None, parts))


# ---- curves ----


def _curves(path: Path) -> list[str]:
    with Source(path, CURVES[0]).open() as file:
        found = load(file)
    if isinstance(found, GridSpline):
        sizes = " x ".join(str(len(axis)) for axis in found.axes)
        ranges = [f"  axis {k}: {axis[0]} to {axis[-1]}" for k, axis in enumerate(found.axes)]
        return [f"{path}: a spline through {sizes} points of {found.space}; see symspline grid --help", *ranges]
    curves = read_curves(path)
    count = len(curves.splines)
    space = next(iter(curves.splines.values())).space
    words = f"{count} segments of one recording" if curves.segmented else counted(count, "curve")
    lines = [f"{curves.file}: {words} on {space}, columns {listed(curves.columns.points)}"]
    for name, spline in curves.splines.items():
        zone = " UTC" if curves.columns.utc else ""
        parts = [f"{len(spline.t)} nodes, {spline.t[0]} to {spline.t[-1]}{zone}"]
        if isinstance(spline, SmoothingSpline):
            parts += [smoothed([spline], curves.columns.lonlat), *parameters_of(spline)]
        else:
            ends = spline.bc_type if isinstance(spline.bc_type, str) else ", ".join(map(str, spline.bc_type))
            parts.append(f"{ends} ends, residual {spline.report.residual:.1e}")
        lines.append(f"  {f'{name}: ' if curves.named else ''}{'; '.join(parts)}")
    return lines

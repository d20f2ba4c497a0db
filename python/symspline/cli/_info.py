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
from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from .._base.arrays import brief
from .._base.report import long_gaps
from .._base.system import damage
from .._base.time import time_axis_of
from .._base.typing import Array
from .._smoothing import SmoothingSpline
from .._smoothing.noise import is_several, smoothed_spaces
from .._smoothing.solve import Smoothed
from .._spaces import Doubles, Space
from .._spaces.base import CLASSES, example_of
from .._splines.cubic import CubicSpline
from ..geo import EARTH_RADIUS
from ._columns import GLOBE, JOINED, NUMBERED, Columns, column_of_blocks, column_of_names, in_degrees, time_column
from ._curves import read_curves
from ._messages import Problem, Source, counted, listed, refuse
from ._tables import TABLES, Rows, Table, endings, format_of, open_table

_LIBRARIES = {"pandas": "CSV files", "pyarrow": "Parquet files", "gpxpy": "GPX files", "matplotlib": "symspline plot"}
_LIBRARIES |= {"shtab": "completion in shells"}


_ROUGH = 2.5
"""Degrees of freedom from which on a curve is not a geodesic."""
_PROFILES = "profile", "noise_profile"
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


def name_of_example(cls: Any) -> str:
    """Return the name of a space of a class, such as sphere:2."""
    return example_of(cls).rpartition("'")[0].rpartition("'")[2]


def _installation() -> list[str]:
    spaces = [(name_of_example(cls), cls) for cls in CLASSES.values()]
    lines = ["spaces, such as:"]
    lines += [f"  {name}: {(cls.__doc__ or '').partition(chr(10))[0]}" for name, cls in spaces]
    lines += ["formats of tables:", f"  {endings()}", "optional libraries:"]
    return lines + [
        f"  {name}: {'installed' if find_spec(name) else 'missing'}, {use}" for name, use in _LIBRARIES.items()
    ]


def _is_curve(source: Source) -> bool:
    with source.open() as file, damage(source, "is damaged or not an NPZ file"):
        return zipfile.is_zipfile(file) and "format.npy" in zipfile.ZipFile(file).namelist()


# ---- tables ----


def _table(table: Table, given: str | None) -> list[str]:
    columns = {name: column for name, column in table.columns.items() if name}
    refuse(table.path, (not columns, " has no columns"))
    groups = {key: parts for key, parts in table.groups.items() if len(parts) > 1}
    lines = [f"{table.path}: {table.path.format} table, {table.height} rows"]
    hidden = {name for parts in groups.values() for name in parts[_COLUMNS:]}
    shown = [name for name in columns if name not in hidden]
    lines += [f"  {name}: {_described(table.shown(name))}" for name in shown]
    long = {key: parts for key, parts in groups.items() if len(parts) > _COLUMNS}
    lines += [f"  ... {parts[-1]}: {key} has {len(parts)} columns" for key, parts in long.items()]
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
    if table.tracks is not None:
        return [*lines, f"fit makes one curve per {table.tracks}; --curve {JOINED} makes one curve of all"]
    names = column_of_names(table, time, [time]) if (np.diff(seconds) <= 0).any() else None
    names = names or column_of_blocks(table, [time])
    return lines if names is None else [*lines, f"--curve {names} fits one curve per {names}"]


def _described(values: Array) -> str:
    if values.dtype.kind in "OUST":
        cells = list(map(str, values.tolist()))
        texts = list(dict.fromkeys(filter(None, cells)))
        missing = cells.count("")
        shown = f"{counted(len(texts), 'distinct text')}: {', '.join(texts[:3])}{', ...' if len(texts) > 3 else ''}"
    else:
        known = values[values == values]
        missing = len(values) - len(known)
        shown = f"{known.min()} to {known.max()}" if len(known) else ""
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
    curves = read_curves(path)
    count = len(curves.splines)
    space = next(iter(curves.splines.values())).space
    words = f"{count} segments of one recording" if curves.segmented else counted(count, "curve")
    lines = [f"{curves.file}: {words} on {space}, columns {listed(curves.columns.points)}"]
    for name, spline in curves.splines.items():
        zone = " UTC" if curves.columns.utc else ""
        parts = [f"{len(spline.t)} nodes, {spline.t[0]} to {spline.t[-1]}{zone}"]
        if isinstance(spline, SmoothingSpline):
            parts += [_smoothed([spline], curves.columns), *_parameters_of(spline)]
        else:
            ends = spline.bc_type if isinstance(spline.bc_type, str) else ", ".join(map(str, spline.bc_type))
            parts.append(f"{ends} ends, residual {spline.report.residual:.1e}")
        lines.append(f"  {f'{name}: ' if curves.named else ''}{'; '.join(parts)}")
    return lines


# ---- descriptions of fitted curves ----


def _spread(values: Sequence[Any]) -> str:
    """Return the range of some numbers."""
    least, most = f"{min(values):.3g}", f"{max(values):.3g}"
    return least if least == most else f"{least} to {most}"


def gaps_in(recordings: Iterable[Doubles], unit: str) -> str:
    """Describe the steps that are far longer than most of a recording; empty if there are none."""
    gaps = np.concatenate([np.diff(times)[long_gaps(times)] for times in recordings])
    return f"{counted(gaps.size, 'long gap')}, up to {gaps.max():.6g}{unit}" if gaps.size else ""


def fitted(splines: Sequence[CubicSpline], columns: Columns) -> str:
    """Describe curves through points, or near them."""
    smooth = [spline for spline in splines if isinstance(spline, SmoothingSpline)]
    points = sum(len(spline.data[0]) for spline in smooth) or sum(len(spline.t) for spline in splines)
    where = "near" if smooth else "through"
    words = f"{counted(len(splines), 'curve')} {where} {points} points of {splines[0].space}, converged: "
    if smooth:
        return words + _smoothed(smooth, columns)
    reports = [spline.report for spline in splines]
    most = "at most " if len(splines) > 1 else ""
    iterations, residual = max(r.iterations for r in reports), max(r.residual for r in reports)
    return f"{words}{reports[0].method}, {most}{iterations} iterations, residual {most}{residual:.1e}"


def _smoothed(splines: Sequence[SmoothingSpline[Any, Any]], columns: Columns) -> str:
    """Describe λ, the degrees of freedom and the noise for every space in which the curves were smoothed."""
    space = splines[0].space
    several = is_several(space)
    parts = zip(*(spline._smoothed for spline in splines), strict=True)
    return "; ".join(
        _chosen(f"{part}: " if several else "", of_space, *_units_of(part, columns))
        for part, of_space in zip(smoothed_spaces(space), parts, strict=True)
    )


def _units_of(part: Space, columns: Columns) -> tuple[bool, bool]:
    """Return whether the noise in a smoothed space is in degrees, and whether it is one of positions on the Earth."""
    return in_degrees(part, columns.lonlat, columns.degrees), columns.lonlat and part == GLOBE


def _on_ground(sigmas: Sequence[float]) -> str:
    """Return angles in radians as distances on the Earth, in kilometres from 1000 metres on."""
    metres = [EARTH_RADIUS * sigma for sigma in sigmas]
    far = max(metres) >= 1000
    return f" ({_spread([metre / 1000 if far else metre for metre in metres])} {'km' if far else 'm'})"


def _chosen(name: str, parts: Sequence[Smoothed], degrees: bool, earth: bool) -> str:
    reports = [part.report for part in parts]
    lam_varies, noise_varies = (_varying([getattr(part, name) for part in parts]) for name in _PROFILES)
    varying = [part.report for part in parts if part.profile is not None or part.noise_profile is not None]
    gains = [report.gain for report in varying if report.gain is not None]
    gain = f", gain {_spread(gains)}" if gains else ""
    bound = sum(bool(report.at_bound) for report in reports)
    at_bound = "" if not bound else " (at its bound)" if len(reports) == 1 else f" ({bound} at a bound)"
    rough = sum(bool(report.at_bound) and report.df > _ROUGH for report in reports)
    through = "the curve passes" if len(reports) == 1 else f"{rough} curves pass"
    advice = f" (no noise was found: {through} through the points; give --sigma or a λ)" if rough else ""
    noise = _spread([np.degrees(report.sigma) if degrees else report.sigma for report in reports])
    return (
        f"{name}λ {_spread([report.lam for report in reports])}{lam_varies}{at_bound}, "
        f"{_spread([report.df for report in reports])} degrees of freedom, noise {noise}{'°' if degrees else ''}"
        f"{_on_ground([float(np.max(report.sigma)) for report in reports]) if earth else ''}"
        f"{noise_varies}{advice}{gain}"
    )


def _varying(profiles: Sequence[Doubles | None]) -> str:
    """Describe in how many of the curves a number varies."""
    count = sum(profile is not None for profile in profiles)
    return "" if not count else " (varies)" if len(profiles) == 1 else f" (varies in {count})"


def bridged(splines: Sequence[CubicSpline]) -> str:
    """Describe the gaps across which curves pass although nothing was measured there."""
    gaps = gaps_in(map(_data_times, splines), " s" if splines[0].t.dtype.kind == "M" else "")
    return f"; {gaps} (--max-gap cuts there)" if gaps else ""


def _data_times(spline: CubicSpline) -> Doubles:
    if isinstance(spline, SmoothingSpline):
        return np.unique(spline._noisy.times[spline._noisy.used])
    return spline._times


def _parameters_of(curve: SmoothingSpline[Any, Any]) -> list[str]:
    """Describe the unknowns that were estimated with a curve, such as a bias."""
    numbers = {key: zip(estimate.value, estimate.std, strict=True) for key, estimate in curve.parameters.items()}
    return [f"{key}: {', '.join(f'{value:.3g} ± {std:.2g}' for value, std in pairs)}" for key, pairs in numbers.items()]

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
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from .._base.time import NANOSECONDS, onto_ends
from .._base.typing import Array
from .._smoothing import SmoothingSpline
from .._spaces import Doubles, space_named
from .._splines.cubic import CubicSpline
from ..convert._pose_files import TUM
from ._columns import Columns, quaternion_by_names, time_column, with_stamps
from ._curves import Curves, Samples, deviations_of, read_curves, samples_of
from ._fit import Index, group
from ._messages import (
    Problem,
    Progress,
    called,
    check_inputs,
    check_target,
    counted,
    did_you_mean,
    first_duplicate,
    refuse,
    say,
    tell,
)
from ._tables import (
    EXACT,
    TABLES,
    UNITS,
    Layout,
    Rows,
    duration,
    endings,
    format_of,
    is_binary,
    number,
    open_table,
    write_table,
)

_EACH = "{curve}"
"""Replaced by the name of a curve in the name of the output."""
_SIGNIFICANT = 10
"""Significant digits of rates and standard errors in text, if those of points are known."""
_MOST = 10**9
"""The largest number of samples of one curve."""
Times = Array
_TUM_NAMES = list(TUM[1:])
_TUM_SPACES = [space_named(name) for name in ("se:3", "so:3 x r:3", "r:3 x so:3")]


class _Part(NamedTuple):
    """What is sampled of one curve.

    Attributes
    ----------
    name, label : str
        The curve, and what the written table calls it: segments are called like their recording.
    times : ndarray
    rows : ndarray or None
        The rows of these times in the table of --at; None if its rows are not each for one curve.
    """

    name: str
    label: str
    times: Times
    rows: Index | None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline sample``."""
    add = parser.add_argument
    add("curves", type=Path, metavar="CURVE", help="file of curves to read: .npz, or - for standard input")
    which = add_output(parser)
    which.add_argument("--at", type=Path, metavar="FILE", help=f"a table with times: {endings()}, or -")
    add("--curve", action="append", metavar="NAME", help="which curve; may be repeated (default: all)")
    add("--unix", choices=UNITS, help="times of --at are numbers that count this unit since 1970-01-01 in UTC")
    add("--lonlat", action="store_true", help="write longitude and latitude of any curve on sphere:2")
    time = "column of times in the table of --at (default: that of the table that was fitted)"
    add("--time", metavar="COL", help=time)
    add("--from", dest="format", choices=TABLES, help="format of the table of --at (default: as its name ends)")


def add_output(parser: argparse.ArgumentParser) -> Any:
    """Add the options of samples, and return the group of their times."""
    add = parser.add_argument
    which = parser.add_mutually_exclusive_group(required=True)
    steps = (
        "a step: for dates a duration in ns, us, ms, s (or no unit), min, h or d, with samples at its whole multiples "
        "in UTC, such as full hours; for numbers a number, with samples from the start on"
    )
    which.add_argument("--every", metavar="DT", help=steps)
    count = "the number of equidistant samples from the start to the end"
    which.add_argument("-n", dest="number", type=_count, metavar="N", help=count)
    orders = "points (0, default), velocities (1), accelerations (2)"
    add("--nu", type=_orders, default=[0], metavar="0,1,2", help=orders)
    digits = (
        "round the numbers to N significant digits, but not the times (default: points in text two decimals more than "
        "the table that was fitted; 17 for all)"
    )
    add("--digits", type=_digits, metavar="N", help=digits)
    add("--lines", action="store_true", help="GeoJSON with one line per curve instead of points")
    add("--to", choices=TABLES, help="format to write (default: as the name of OUT ends, CSV for -)")
    out = f"table to write: {endings()}, or - for standard output; {_EACH} in its name makes one file per curve"
    add("-o", "--output", type=Path, metavar="OUT", required=True, help=out)
    return which


def _count(text: str) -> int:
    count = number(text)
    if not 1 <= count <= _MOST or count != int(count):
        raise argparse.ArgumentTypeError(f"{text}: the number of samples must be a whole number between 1 and 10^9")
    return int(count)


def _orders(text: str) -> list[int]:
    orders = [part.strip() for part in text.split(",")]
    if not set(orders) <= {"0", "1", "2"} or len(set(orders)) < len(orders):
        raise argparse.ArgumentTypeError(f"{text}: give one or more of 0, 1 and 2, separated by commas")
    return list(map(int, orders))


def _digits(text: str) -> int:
    if text not in map(str, range(1, 18)):
        raise argparse.ArgumentTypeError(f"{text}: give a number between 1 and 17")
    return int(text)


def run(options: argparse.Namespace) -> int:
    """Evaluate, and write the table."""
    check_inputs(options.curves, options.at)
    check_output(options, options.curves, options.at)
    whole = read_curves(options.curves, options.lonlat)
    return sample(whole, whole.chosen(options.curve), options, options.curves, options.at)


def check_output(options: argparse.Namespace, *inputs: Path | None) -> str:
    """Return the format of the output, which must be possible."""
    form = format_of(options.output, options.to)
    check_target(options.output, *inputs, binary=is_binary(form))
    lines = "--lines is for GeoJSON with points; "
    refuse(
        lines,
        (options.lines and form != "geojson", f"{form} has none"),
        (options.lines and options.nu != [0], "omit --nu"),
    )
    return form


def sample(whole: Curves, curves: Curves, options: argparse.Namespace, *inputs: Path | None) -> int:
    """Evaluate some curves of a file, and write the table; the inputs are not overwritten."""
    form = format_of(options.output, options.to)
    tum = form == "tum"
    columns = _tum_columns(curves, options.nu) if tum else curves.columns
    parts = _along(curves, options) if options.at is None else _given(options, curves, whole)
    text = not is_binary(form) and not tum
    samples = _sampled(curves, parts, options, columns, not tum, columns.decimals if text else None)
    if _EACH not in options.output.name:
        if tum:
            _check_order(curves)
        _write(options.output, form, parts, samples, columns, curves.named and not tum, options.lines)
        return 0
    names = [options.output.name.replace(_EACH, part.name.replace("/", "_")) for part in parts]
    paths = [options.output.with_name(name) for name in names]
    twice = first_duplicate([str(path).lower() for path in paths])
    refuse(f"-o {options.output}: ", (twice, f"two curves would have the file {twice}; choose one with --curve"))
    for path in paths:
        check_target(path, *inputs)
    for path, part, block in zip(paths, parts, samples, strict=True):
        _write(path, form, [part._replace(rows=None)], [block], columns, False, options.lines)
    return 0


def _sampled(
    curves: Curves,
    parts: Sequence[_Part],
    options: argparse.Namespace,
    columns: Columns,
    stds: bool,
    decimals: Mapping[str, int] | None,
) -> list[Samples]:
    """Return the columns of every curve, with standard deviations if all curves have them and ``stds`` is True."""
    smooth = stds and all(isinstance(spline, SmoothingSpline) for spline in curves.splines.values())
    functions: Any = (samples_of, deviations_of) if smooth else (samples_of,)
    samples = []
    with Progress("sampling") as progress:
        for done, part in enumerate(parts, 1):
            spline = curves.splines[part.name]
            blocks = [function(spline, part.times, nu, columns) for nu in options.nu for function in functions]
            pairs = chain.from_iterable(blocks)
            samples.append([(name, _rounded(name, numbers, options.digits, decimals)) for name, numbers in pairs])
            progress(done, len(parts))
    return samples


def _rounded(name: str, numbers: Doubles, digits: int | None, decimals: Mapping[str, int] | None) -> Doubles:
    """Round to significant digits if they are given, and otherwise to the decimals of a column."""
    if digits is None and decimals is None:
        return numbers
    if digits is None and decimals is not None and name in decimals:
        # Adding zero makes -0 a 0.
        return np.round(numbers, decimals[name]) + 0.0
    accuracy = _SIGNIFICANT if digits is None else digits
    texts = (f"{number:.{accuracy - 1}e}" for number in numbers.tolist())
    return np.fromiter(map(float, texts), np.float64, len(numbers))


def _write(
    path: Path,
    form: str,
    parts: Sequence[_Part],
    samples: Sequence[Samples],
    columns: Columns,
    named: bool,
    lines: bool,
) -> None:
    """Write the table of some curves, in the order of their rows, with a column of their names if ``named`` is True."""
    pairs: list[tuple[str, Any]] = [(columns.time, np.concatenate([part.times for part in parts]))]
    if named:
        pairs.append((columns.curve, np.repeat([part.label for part in parts], [len(part.times) for part in parts])))
    for same in zip(*samples, strict=True):
        pairs.append((same[0][0], np.concatenate([numbers for _, numbers in same])))
    twice = first_duplicate([name for name, _ in pairs])
    refuse("", (twice is not None, f"two columns would have the name {twice!r}; rename them"))
    rows = [part.rows for part in parts if part.rows is not None]
    order = np.argsort(np.concatenate(rows)) if rows else slice(None)
    lonlat = tuple(columns.points) if columns.lonlat else None
    layout = Layout(columns.time, columns.curve if named else None, lonlat, bool(columns.utc), lines)
    write_table(path, form, {name: column[order] for name, column in pairs}, layout)
    tell(f"{called(path)}: {counted(len(pairs[0][1]), 'row')}")


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
    for (name, curve), (other, following) in pairwise(curves.splines.items()):
        if not curve.t[-1] < following.t[0]:
            raise Problem(
                f"a TUM trajectory has increasing times, but {curves.called(other)} begins before the end of "
                f"{curves.called(name)}; choose one with --curve, or write one file per curve, such as -o x_{_EACH}.txt"
            )


# ---- times ----


def _along(curves: Curves, options: argparse.Namespace) -> list[_Part]:
    """Return equidistant times of every curve."""
    parts = []
    for name, spline in curves.splines.items():
        times = every(options.every, spline.t) if options.every is not None else spread(options.number, spline.t)
        parts.append(_Part(name, name, times, None))
    empty = f"no multiple of this step lies between the start and the end of {'any' if curves.named else 'the'} curve"
    none = not any(len(part.times) for part in parts)
    refuse(f"--every {options.every}: ", (none, f"{empty}; use a shorter step, or -n"))
    return parts


def _given(options: argparse.Namespace, curves: Curves, whole: Curves) -> list[_Part]:
    """Return the times in the table of --at. If it has a column of names, each row is for the curve that it names."""
    table, time = with_stamps(open_table(options.at, options.format), options.time, False)
    path, usual, label = table.path, curves.columns.time, curves.columns.curve
    if time is None and (usual in table.names or len(table.names) == 1):
        time = usual if usual in table.names else table.names[0]
    time = time_column(table, time, [], options.unix is not None)
    if time is None:
        raise Problem(f"{path} has no column {usual!r} of times; {did_you_mean(usual, table.names)}")
    labelled = whole.named and label in table.names
    rows = table.read([], time, label if labelled else None, options.unix)
    recordings = curves.recordings
    segments = {name: [name] for name in curves.splines} | recordings
    known = {*whole.splines, *whole.recordings}
    groups = group(rows) if labelled else dict.fromkeys(recordings, group(rows)[""])
    tied = labelled or len(recordings) == 1
    parts = []
    for label, index in groups.items():
        if label not in segments and label in known:
            continue
        if label not in segments:
            near = did_you_mean(label, list(segments))
            raise Problem(f"{path}, {rows.place(int(index[0]))}: there is no curve {label!r}; {near}")
        splines = {part: curves.splines[part] for part in segments[label]}
        for name, inside in _by_segment(rows, index, splines).items():
            _check_times(path, rows, inside, curves, name)
            if len(inside):
                shown = label if labelled else name
                parts.append(_Part(name, shown, rows.times[inside], inside if tied else None))
    refuse(path, (not parts, " has no times of these curves"))
    return parts


def _by_segment(rows: Rows, index: Index, splines: Mapping[str, CubicSpline]) -> dict[str, Index]:
    """Divide rows between the segments of a recording; those in the gaps between segments are omitted."""
    times = rows.times[index]
    starts, ends = (np.array([spline.t[i] for spline in splines.values()]) for i in (0, -1))
    if times.dtype.kind != starts.dtype.kind and "M" in (times.dtype.kind, starts.dtype.kind):
        # `_check_times` describes the difference.
        return {next(iter(splines)): index}
    segment = np.maximum(np.searchsorted(starts, times, "right") - 1, 0)
    in_gap = (times > ends[segment]) & (segment < len(starts) - 1)
    if in_gap.any():
        say(f"{int(in_gap.sum())} of {len(in_gap)} times lie in gaps between segments, and are omitted")
    return {name: index[(segment == i) & ~in_gap] for i, name in enumerate(splines)}


def _check_times(path: object, rows: Rows, index: Index, curves: Curves, name: str) -> None:
    """Raise `Problem` unless the curve has points at these times."""
    spline, curve = curves.splines[name], curves.called(name)
    times, knots = rows.times[index], spline.t
    dates = knots.dtype.kind == "M"
    expected, given = ("dates", "numbers") if dates else ("numbers", "dates")
    these, those = ("a time zone", "none") if rows.utc else ("no time zone", "one")
    unix = "; give --unix if they count from 1970" if dates else ""
    kinds = f": the times of {curve} are {expected}, but these are {given}{unix}"
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
            f"{path}, {rows.place(int(index[outside[0]]))}: time {times[outside[0]]}{zone} is outside {curve}, which "
            f"runs from {knots[0]} to {knots[-1]}{zone}; fit with --extrapolate to define the curve there"
        )


# ---- sampling times along a curve ----


def every(step: str, knots: Times) -> Times:
    """Return times from the first to the last knot, one per step.

    Dates are whole multiples of the step since 1970-01-01 in UTC, as those of `symspline.geo.resample`. Numbers start
    at the first knot.
    """
    count, unit = duration(step, "--every")
    kind = knots.dtype.kind
    if unit and kind != "M":
        raise Problem(f"--every {step}: the times of this curve are numbers; give a step without a unit")
    if kind == "f":
        length = float(count)
        if not 0 < length < float("inf"):
            raise Problem(f"--every {step}: that is too {'long' if length else 'short'}")
        # The last sample is at the end if the step divides the curve up to rounding.
        samples = _samples((float(knots[-1]) - float(knots[0])) / length * (1 + 1e-12), step)
        return np.asarray(np.minimum(_equidistant(_decimal(knots[0]), Fraction(count), samples), knots[-1]))
    count *= NANOSECONDS[unit or "s"] if kind == "M" else 1
    whole = "of nanoseconds" if kind == "M" else "as the times are"
    refuse(f"--every {step}: ", (count != int(count), f"a step must be a whole number {whole}"))
    ends, jump = _in_ticks(knots, int(count)) if kind == "M" else (knots[[0, -1]], int(count))
    first, last = _integers(ends)
    start = -(-first // jump) * jump if kind == "M" else first
    samples = _samples((last - start) // jump, step) if start <= last else 0
    # A step that is longer than the time between the ends may not fit into 64 bits.
    return _after(start, np.uint64(min(jump, last - first)) * np.arange(samples, dtype=np.uint64), ends.dtype)


def _in_ticks(knots: Times, nanoseconds: int) -> tuple[Times, int]:
    """Return the ends and a step in the coarsest unit in which both are whole numbers."""
    unit = next(unit for unit in UNITS if nanoseconds % NANOSECONDS[unit] == 0)
    ends = _in_unit(knots, unit)
    ticks = int(np.ones(1, f"datetime64[{unit}]").astype(ends.dtype).astype(np.int64)[0])
    return ends, nanoseconds // NANOSECONDS[unit] * ticks


def _integers(ends: Times) -> list[int]:
    numbers: list[int] = ends.astype(np.int64 if ends.dtype.kind == "M" else ends.dtype).tolist()
    return numbers


def spread(count: int, knots: Times) -> Times:
    """Return equidistant times from the first to the last knot, dates to a microsecond."""
    if knots.dtype.kind == "f":
        first, last = _decimal(knots[0]), _decimal(knots[-1])
        return _equidistant(first, (last - first) / max(count - 1, 1), count)
    dates = knots.dtype.kind == "M"
    ends = _in_unit(knots, "us") if dates else knots[[0, -1]]
    start, stop = _integers(ends)
    steps = np.rint(np.linspace(0, stop - start, count)[: count - 1]).astype(np.uint64)
    times = _after(start, np.append(steps, np.uint64(stop - start if count > 1 else 0)), ends.dtype)
    return _coarsest(times) if dates else times


def _decimal(time: Any) -> Fraction:
    """Return the shortest decimal number that reads back as a floating-point number."""
    return Fraction(repr(float(time)))


def _equidistant(first: Fraction, step: Fraction, count: int) -> NDArray[np.float64]:
    """Return the numbers ``first + i step`` for i < count, each rounded once from its exact value."""
    scale = math.lcm(first.denominator, step.denominator)
    start, jump = int(first * scale), int(step * scale)
    if max(abs(start) + abs(jump) * count, scale) <= EXACT:
        # All of these integers are exact as floating-point numbers.
        return np.asarray((start + jump * np.arange(count)) / scale)
    return np.fromiter(((start + jump * i) / scale for i in range(count)), np.float64, count)


def _after(start: int, steps: NDArray[np.uint64], dtype: DTypeLike) -> Times:
    """Return a start plus whole numbers. The sum is exact, as it is computed modulo 2**64."""
    return np.asarray((np.uint64(start % 2**64) + steps).astype(np.int64).astype(dtype))


def _in_unit(knots: Times, unit: Any) -> Times:
    """Return the first and the last date in a unit or a finer one."""
    ends = knots[[0, -1]]
    with suppress(OverflowError):
        fine = ends.astype(np.promote_types(knots.dtype, f"datetime64[{unit}]"))
        # NumPy does not report all overflows.
        if (fine.astype(knots.dtype) == ends).all():
            return fine
    tick = np.timedelta64(1, unit)
    raise Problem(f"the dates from {ends[0]} to {ends[1]} cannot be counted in units of {tick}")


def _coarsest(dates: Times) -> Times:
    """Return the dates in the coarsest unit from seconds on that represents them exactly."""
    for unit in ("s", "ms", "us"):
        # Dates in attoseconds cannot be converted to seconds.
        with suppress(OverflowError):
            coarse = dates.astype(f"datetime64[{unit}]")
            if (coarse == dates).all():
                return coarse
    return dates


def _samples(steps: float, option: str) -> int:
    if steps >= _MOST:
        raise Problem(f"--every {option}: that makes {float(steps):.1e} samples of one curve")
    return int(steps) + 1

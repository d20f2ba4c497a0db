"""Interpolate points on a grid over several axes, such as maps and volumes

The input is an NPZ file (.npz) or a Zarr store (.zarr); the ending of its name selects the format.

  .npz   an array `points` of shape (N1, N2, ..., *shape of a point), in a product points_0, points_1, ..., one array
         per factor; and one array of increasing numbers or dates per axis, which --axes names in the order of the
         axes. By default these are all other arrays with one axis, in the order of the file. Without any, axes
         count 0, 1, 2, ... A file that this command wrote without --to, --zoom and --points is a spline.
  .zarr  the dimensions --axes of a variable, all others of which are separate grids; the last dimensions are those of
         a point. Blocks are read, interpolated and written one by one, so that the store may be larger than memory.

Points that are NaN are missing. They divide rows into runs, each with a spline of its own, and values that are not
between points along every axis are NaN. Points within 1e-4 of the space are projected onto it.

Values are those of splines along the first axis, then along the second through these values, and so on. --symmetric
takes the midpoint with those of the reverse order. Angles of torus:n are in radians, or with --degrees in degrees.

The output has the format of the input. Without --to, --zoom and --points it is the spline itself, an NPZ file that
symspline.load reads in Python. A file name of - means standard input or output, an NPZ file.

examples:
  symspline grid wind.npz --space sphere:2 --axes lat,lon --bc-type not-a-knot,periodic --zoom 2 -o fine.npz
  symspline grid wind.zarr --space sphere:2 --variable wind --axes lat,lon --points 361,720 -o fine.zarr
  symspline grid wind.npz --space sphere:2 --axes lat,lon -o spline.npz
"""

from __future__ import annotations

import argparse
import math
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from .._base.disk import damage
from .._base.report import FarPointsWarning
from .._degrees import with_angles
from .._grid import GridSpline
from .._splines.archive import read
from ._curves import add_entry
from ._grid_files import (
    AXIS_NAMES,
    NPZ,
    ZARR,
    Grid,
    ending_of,
    read_arrays,
    read_store,
    resample_store,
    write_arrays,
)
from ._messages import Problem, Progress, reading, refuse, say, tell
from ._streams import called, check_target, writing
from ._tables import Array
from ._times import is_number, spread

_ENDS = ("not-a-knot", "natural", "clamped", "periodic")
_VALUES = ("to", "zoom", "points")
_MOST = 10**9


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline grid``."""
    add = parser.add_argument
    add("input", type=Path, metavar="IN", help="grid to read: .npz or .zarr, or - for NPZ")
    add("--space", metavar="S", help="such as sphere:2, so:3 or spd:3")
    add("--axes", metavar="A,B,...", help="arrays or dimensions of the axes, in the order of the splines")
    add("--degrees", action="store_true", help="angles of torus:n are in degrees, also in the values")
    add("--variable", metavar="NAME", help="variable of a Zarr store that has several")
    ends = f"{', '.join(_ENDS)}: one for all axes, or one per axis with commas (default: {_ENDS[0]})"
    add("--bc-type", default=_ENDS[0], metavar="END", help=ends)
    add("--symmetric", action="store_true", help="take the midpoint of both orders of the axes")
    add = parser.add_mutually_exclusive_group().add_argument
    add("--to", type=Path, metavar="FILE", help="values at the axes in an NPZ file")
    add("--zoom", metavar="Z", help="intervals between values per interval of nodes: one number, or one per axis")
    add("--points", metavar="N,M,...", help="this number of equidistant values along each axis")
    out = "file to write, in the format of IN, or .npz; - for NPZ on standard output"
    parser.add_argument("-o", dest="output", type=Path, metavar="OUT", required=True, help=out)


def run(options: argparse.Namespace) -> int:
    """Read, fit, and write values or the spline."""
    source, target = ending_of(options.input), ending_of(options.output)
    check_target(options.output, options.input, options.to, binary=True)
    option = next((name for name in _VALUES if getattr(options, name) is not None), None)
    _check_formats(options, source, target, option)
    how = {"bc_type": _bc_type(options.bc_type), "symmetric": options.symmetric}
    with _far_points_noted():
        if target == ZARR:
            done = resample_store(options, how, lambda names, axes: _positions(options, option, names, axes))
        else:
            done = _resampled(options, source, option, how)
    tell(f"{called(options.output)}: {done}")
    return 0


def _check_formats(options: argparse.Namespace, source: str, target: str, option: str | None) -> None:
    """Raise `Problem` for options of other formats, and outputs that the input cannot be written to."""
    refuse("--variable ", (options.variable is not None and source != ZARR, f"is not for {source} files"))
    refuse(
        f"{options.output}: ",
        (option is None and target != NPZ, "give --to, --zoom or --points, or write the spline to an .npz file"),
        (option and target not in (source, NPZ), f"values of a {source} file are written to such a file"),
    )


def _bc_type(text: str) -> Any:
    ends = tuple(end.strip() for end in text.split(","))
    unknown = [end for end in ends if end not in _ENDS]
    refuse(f"--bc-type {text}: ", (unknown, f"give {', '.join(_ENDS)}, one for all axes or one per axis"))
    return ends[0] if len(ends) == 1 else ends


@contextmanager
def _far_points_noted() -> Iterator[None]:
    """Print the warning about points that are far apart."""
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", FarPointsWarning)
        yield
    for note in noted:
        say(note.message)


def _resampled(options: argparse.Namespace, source: str, option: str | None, how: dict[str, Any]) -> str:
    """Write the spline, or an NPZ file of its values, and describe the result."""
    read_grid = read_store if source == ZARR else read_arrays
    grid = read_grid(options)
    spline = grid.spline or _fitted(grid, how)
    gap = f", axis order gap {spline.report.axis_order_gap:.1e}"
    if option is None:
        refuse(f"{options.input}: ", (grid.spline, "this is a spline; give --to, --zoom or --points"))
        with writing(options.output) as temporary, open(temporary, "wb") as file:
            spline.save(file)
            file.close()
            add_entry(temporary, AXIS_NAMES, np.array(grid.names))
        return f"a spline through {' x '.join(str(len(axis)) for axis in spline.axes)} points of {spline.space}{gap}"
    x = _positions(options, option, grid.names, spline.axes)
    with Progress("sampling") as progress:
        values = spline.grid(*x, progress=progress)
    values = with_angles(spline.space, values, np.degrees) if grid.degrees else values
    write_arrays(options.output, grid.names, x, values)
    first = values[0] if isinstance(values, tuple) else values
    missing = np.isnan(first).mean() if first.size else 0.0
    share = f", {100 * missing:.2g} % of them missing" if missing else ""
    return f"{' x '.join(str(len(axis)) for axis in x)} values of {spline.space}{share}{gap}"


def _fitted(grid: Grid, how: dict[str, Any]) -> GridSpline:
    with Progress("fitting") as progress:
        return GridSpline(grid.axes, grid.points, grid.space, progress=progress, **how)


# ---- positions of the values ----


def _numbers(options: argparse.Namespace, option: str, count: int) -> list[float]:
    """Read one number per axis, or one number for all of them."""
    text = getattr(options, option)
    cells = text.split(",")
    zoom = option == "zoom"
    numbers = [float(cell) for cell in cells if is_number(cell)]
    good = [0 < x <= _MOST if zoom else 2 <= x <= _MOST and x == int(x) for x in numbers]
    needed = "numbers larger than 0" if zoom else "whole numbers from 2 on"
    one = zoom and len(cells) == 1
    refuse(
        f"--{option} {text}: ",
        (not all(good) or len(good) < len(cells), f"give {needed}, separated by commas"),
        (len(cells) != count and not one, f"there are {count} axes, which need {count} numbers, not {len(cells)}"),
    )
    return numbers * (count if one else 1)


def _positions(
    options: argparse.Namespace, option: str | None, names: Sequence[str], axes: Sequence[Array]
) -> list[Array]:
    """Return the positions along each axis, numbers or dates as its nodes are."""
    if option == "to":
        return _positions_in_file(options.to, names)
    floats = [axis if axis.dtype.kind == "M" else axis.astype(np.float64) for axis in axes]
    numbers = _numbers(options, option or "", len(axes))
    if option == "points":
        return [spread(int(count), axis) for count, axis in zip(numbers, floats, strict=True)]
    return [_between(axis, zoom) for axis, zoom in zip(floats, numbers, strict=True)]


def _between(axis: Array, zoom: float) -> Array:
    """Divide the interval between two nodes into ``zoom`` equal ones, wherever the nodes are."""
    last = len(axis) - 1
    x = np.minimum(np.arange(math.floor(last * zoom + 1e-6) + 1) / zoom, last)
    if axis.dtype.kind != "M":
        return np.interp(x, np.arange(last + 1), axis)
    # Dates are whole numbers, at least of microseconds.
    axis = axis.astype(np.promote_types(axis.dtype, "datetime64[us]"))
    after = (axis - axis[0]).astype(np.int64)
    return np.asarray(axis[0] + np.rint(np.interp(x, np.arange(last + 1), after)).astype(np.int64))


def _positions_in_file(path: Path, names: Sequence[str]) -> list[Array]:
    refuse(path, (path.suffix.lower() != NPZ, ": positions are read from an .npz file with one array per axis"))
    with reading(path), open(path, "rb") as file, damage(path, "is damaged or not an NPZ file"):
        arrays = read(file, lambda name: name in names)
    for name in names:
        if name not in arrays or arrays[name].ndim != 1:
            raise Problem(f"{path} has no array {name!r} with one axis, the positions along {name!r}")
    return [arrays[name] for name in names]

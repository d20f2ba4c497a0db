"""Interpolate points on a grid over several axes, such as maps and volumes

The input is an NPZ file (.npz), a NIfTI volume of diffusion tensors (.nii, .nii.gz) or a Zarr store (.zarr); the ending
of its name selects the format.

  .npz   an array `points` of shape (N1, N2, ..., *shape of a point), in a product points_0, points_1, ..., one array
         per factor; and one array of increasing numbers or dates per axis, which --axes names in the order of the
         axes. By default these are all other arrays with one axis, in the order of the file. Without any, axes
         count 0, 1, 2, ... A file that this command wrote without --to, --zoom and --points is a spline.
  .nii   six numbers per voxel; --order is that of the program that wrote them. The axes count voxels. Voxels outside
         the mask are missing, and zero in the output. Units, codes and affine maps of the header are kept.
  .zarr  the dimensions --axes of a variable, all others of which are separate grids; the last dimensions are those of
         a point. Blocks are read, interpolated and written one by one, so that the store may be larger than memory.

Points that are NaN are missing. They divide rows into runs, each with a spline of its own, and values that are not
between points along every axis are NaN. Points within 1e-4 of the space are projected onto it.

Values are those of splines along the first axis, then along the second through these values, and so on. --symmetric
takes the midpoint with those of the reverse order.

The output has the format of the input. Without --to, --zoom and --points it is the spline itself, an NPZ file that
symspline.load reads in Python.

examples:
  symspline grid wind.npz --space sphere:2 --axes lat,lon --bc-type not-a-knot,periodic --zoom 2 -o fine.npz
  symspline grid dti.nii.gz --order fsl --mask brain.nii.gz --zoom 2 -o fine.nii.gz
  symspline grid wind.zarr --space sphere:2 --variable wind --axes lat,lon --points 361,720 -o fine.zarr
  symspline grid wind.npz --space sphere:2 --axes lat,lon -o spline.npz
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from .._grid import GridSpline
from .._spaces import POINT_TOL_FLOAT32
from . import _grid_stores, _grid_volumes
from ._grid_files import (
    NPZ,
    VOLUMES,
    ZARR,
    Grid,
    check_ending_of,
    far_points_noted,
    missing,
    read_arrays,
    sizes,
    write_arrays,
)
from ._grid_positions import positions, values_option
from ._messages import Progress, refuse, tell
from ._streams import check_target, writing

_ENDS = ("not-a-knot", "natural", "clamped", "periodic")
_ORDERS = ("dipy", "fsl", "mrtrix", "itk")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline grid``."""
    add = parser.add_argument
    add("input", type=Path, metavar="IN", help="grid to read: .npz, .nii, .nii.gz or .zarr")
    add("--space", metavar="S", help="such as sphere:2, so:3 or spd:3, which is the default for NIfTI files")
    add("--axes", metavar="A,B,...", help="arrays or dimensions of the axes, in the order of the splines")
    add("--variable", metavar="NAME", help="variable of a Zarr store that has several")
    add("--order", choices=_ORDERS, help="program that wrote a NIfTI file, unless its intent is symmetric matrices")
    add("--mask", type=Path, metavar="FILE", help="NIfTI file whose nonzero voxels are read")
    ends = f"{', '.join(_ENDS)}: one for all axes, or one per axis with commas (default: {_ENDS[0]})"
    add("--bc-type", default=_ENDS[0], metavar="END", help=ends)
    add("--symmetric", action="store_true", help="take the midpoint of both orders of the axes")
    add = parser.add_mutually_exclusive_group().add_argument
    add("--to", type=Path, metavar="FILE", help="values at the axes in an NPZ file, or at the voxels of a NIfTI file")
    add("--zoom", metavar="Z", help="intervals between values per interval of nodes: one number, or one per axis")
    add("--points", metavar="N,M,...", help="this number of equidistant values along each axis")
    add = parser.add_argument
    add(
        "-o", dest="output", type=Path, metavar="OUT", required=True, help="file to write, in the format of IN, or .npz"
    )


def run(options: argparse.Namespace) -> int:
    """Read, fit, and write values or the spline."""
    source, target = (check_ending_of(path) for path in (options.input, options.output))
    check_target(options.output, options.input, options.to, options.mask)
    option = values_option(options)
    volume, store = source in VOLUMES, source == ZARR
    unused = [
        name
        for name, used in (("order", volume), ("mask", volume), ("variable", store), ("axes", not volume))
        if getattr(options, name) is not None and not used
    ]
    same = target == source or (volume and target in VOLUMES)
    refuse(f"--{''.join(unused[:1])} ", (unused, f"is not for {source} files"))
    refuse(
        f"{options.output}: ",
        (option is None and target != NPZ, "give --to, --zoom or --points, or write the spline to an .npz file"),
        (option and not same and (volume or target != NPZ), f"values of a {source} file are written to such a file"),
    )
    how = {"bc_type": _bc_type(options.bc_type), "symmetric": options.symmetric}
    if volume and option:
        tell(f"{options.output}: {_grid_volumes.resampled(options, option, how)}")
        return 0
    if target == ZARR:
        tell(f"{options.output}: {_grid_stores.resampled(options, how)}")
        return 0
    read = _grid_volumes.read_grid if volume else _grid_stores.read_grid if store else read_arrays
    grid = read(options)
    spline = grid.spline or _fitted(grid, how)
    if option is None:
        refuse(f"{options.input}: ", (grid.spline, "this is a spline; give --to, --zoom or --points"))
        with writing(options.output) as temporary, open(temporary, "wb") as file:
            spline.save(file)
        done = f"a spline through {sizes(map(len, spline.axes))} points of {spline.space}"
    else:
        x = positions(options, grid.names, spline.axes)
        with Progress("sampling") as progress:
            values = spline.grid(*x, progress=progress)
        write_arrays(options.output, grid.names, x, values)
        done = f"{sizes(map(len, x))} values of {spline.space}{missing(values)}"
    tell(f"{options.output}: {done}{_summary(spline)}")
    return 0


def _bc_type(text: str) -> Any:
    ends = tuple(end.strip() for end in text.split(","))
    unknown = [end for end in ends if end not in _ENDS]
    refuse(f"--bc-type {text}: ", (unknown, f"give {', '.join(_ENDS)}, one for all axes or one per axis"))
    return ends[0] if len(ends) == 1 else ends


def _fitted(grid: Grid, how: dict[str, Any]) -> GridSpline:
    with far_points_noted(), Progress("fitting") as progress:
        return GridSpline(grid.axes, grid.points, grid.space, atol=POINT_TOL_FLOAT32, progress=progress, **how)


def _summary(spline: GridSpline) -> str:
    return f", axis order gap {spline.report.axis_order_gap:.1e}"

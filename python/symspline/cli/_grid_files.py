"""Grids of points in NPZ files: an array of points, and one array per axis."""

from __future__ import annotations

import argparse
import warnings
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._archive import Entries, read
from .._disk import damage
from .._files import load
from .._grid import GridSpline
from .._report import FarPointsWarning
from .._spaces import Product, Space, factors_of, space_named
from ._columns import split_names
from ._messages import did_you_mean, reading, refuse, say
from ._streams import writing

Array = NDArray[Any]

NPZ, ZARR = ".npz", ".zarr"
VOLUMES = (".nii", ".nii.gz")


@dataclass(frozen=True)
class Grid:
    """Points on a grid, or a spline through them that was fitted already.

    Attributes
    ----------
    names : list of str
        Names of the axes.
    axes : sequence of ndarray or None
        Nodes of each axis. None means 0, 1, 2, ...
    points : ndarray or tuple of ndarray
    space : Space, or None for a spline
    spline : GridSpline or None
    """

    names: list[str]
    axes: Sequence[Array | None] = ()
    points: Any = None
    space: Any = None
    spline: GridSpline[Any] | None = None


def check_ending_of(path: Path) -> str:
    """Return the ending of the name of a grid, which selects the format."""
    endings = (NPZ, *VOLUMES, ZARR)
    found = [ending for ending in endings if path.name.lower().endswith(ending)]
    refuse(path, (not found, f": the name of a grid must end in {' or '.join(endings)}"))
    return found[0]


def space_of(options: argparse.Namespace) -> Space[Any]:
    """Return the space that is given by its name."""
    refuse("", (options.space is None, "say which space the points are on with --space, such as --space sphere:2"))
    return space_named(options.space)


def sizes(numbers: Iterable[int]) -> str:
    """Return sizes such as 57 x 61."""
    return " x ".join(map(str, numbers))


def missing(values: Any) -> str:
    """Describe how many values are NaN."""
    first = values[0] if isinstance(values, tuple) else values
    share = np.isnan(first).mean() if first.size else 0.0
    return f", {100 * share:.2g} % of them missing" if share else ""


@contextmanager
def far_points_noted() -> Iterator[None]:
    """Print the warning about points that are far apart."""
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", FarPointsWarning)
        yield
    for note in noted:
        say(note.message)


def read_arrays(options: argparse.Namespace) -> Grid:
    """Read the grid or the spline in an NPZ file."""
    path = options.input
    with reading(path), open(path, "rb") as file:
        refuse(path, (not zipfile.is_zipfile(file), " is not an NPZ file"))
        file.seek(0)
        with damage(path, "is damaged, or holds other objects than numbers"):
            arrays = read(file, lambda name: True)
    if "format" in arrays:
        return _spline(options)
    space = space_of(options)
    keys = [f"points_{i}" for i in range(len(factors_of(space)))] if isinstance(space, Product) else ["points"]
    absent = next((key for key in keys if key not in arrays), None)
    refuse(path, (absent, f" has no array {absent!r} of points; {did_you_mean('points', [*arrays])}"))
    points = [arrays[key] for key in keys]
    factor = factors_of(space)[0]
    count = points[0].ndim - len(factor.point_shape)
    wrong = count < 1 or points[0].shape[count:] != factor.point_shape
    needed = f"has shape {points[0].shape}, which must end in {factor.point_shape}, the shape of a point of {factor}"
    refuse(path, (wrong, f": {keys[0]!r} {needed}, after the sizes of the axes"))
    names = _names(options, arrays, keys, count)
    axes = [arrays[name] for name in names] if names else [None] * count
    return Grid(names or usual_names(count), axes, tuple(points) if isinstance(space, Product) else points[0], space)


def usual_names(count: int) -> list[str]:
    """Name axes that have no names."""
    return [f"axis{i}" for i in range(count)]


def _names(options: argparse.Namespace, arrays: Entries, keys: Sequence[str], count: int) -> list[str]:
    """Return the names of the arrays of the axes; empty if the file has none."""
    path, given = options.input, split_names(options.axes)
    for name in given:
        refuse(path, (name not in arrays, f" has no array {name!r}; {did_you_mean(name, [*arrays])}"))
    names = given or [name for name, array in arrays.items() if array.ndim == 1 and name not in keys]
    listed = ", ".join(map(repr, names))
    wrong = f": there are arrays {listed} for the axes, but the points have {count} axes; name these with --axes"
    refuse(path, (names and len(names) != count, wrong))
    return names


def _spline(options: argparse.Namespace) -> Grid:
    given = [f"--{name}" for name in ("space", "axes") if getattr(options, name) is not None]
    spline = load(options.input)
    refuse(
        options.input,
        (not isinstance(spline, GridSpline), " is a curve, not a grid; see symspline sample"),
        (given, f" is a spline, for which {' and '.join(given)} cannot be given"),
    )
    return Grid(usual_names(len(spline.axes)), spline=spline)


def write_arrays(path: Path, names: Sequence[str], axes: Sequence[Array], points: Any) -> None:
    """Write values on a grid, with the arrays that `read_arrays` reads."""
    several = isinstance(points, tuple)
    arrays = {f"points_{i}": part for i, part in enumerate(points)} if several else {"points": points}
    with writing(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, **dict(zip(names, axes, strict=True)), **arrays)  # type: ignore[arg-type]

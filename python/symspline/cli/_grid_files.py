"""Grids of points in NPZ files and Zarr stores."""

from __future__ import annotations

import argparse
import os
import secrets
import shutil
import zipfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._base.arrays import brief
from .._base.disk import damage
from .._base.exceptions import SymsplineError
from .._degrees import is_degrees, look_like_degrees, with_angles
from .._grid import GridSpline
from .._spaces import Product, Space, Torus, factors_of, space_named
from .._splines.archive import read
from .._splines.files import load
from ._columns import split_names
from ._messages import Problem, Progress, alternatives, did_you_mean, reading, refuse, say
from ._streams import STANDARD, Source, writing
from ._tables import Array

NPZ, ZARR = ".npz", ".zarr"
AXIS_NAMES = "axis_names"
"""The entry with the names of the axes in the file of a spline."""


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
    degrees : bool
        Whether the angles of tori were converted from degrees, and values are to be in degrees.
    """

    names: list[str]
    axes: Sequence[Array | None] = ()
    points: Any = None
    space: Any = None
    spline: GridSpline[Any] | None = None
    degrees: bool = False


def ending_of(path: Path) -> str:
    """Return the ending of the name of a grid, which selects the format."""
    endings = (NPZ, ZARR)
    found = [ending for ending in endings if path == STANDARD or path.name.lower().endswith(ending)]
    refuse(path, (not found, f": the name of a grid must end in {alternatives(endings)}"))
    return found[0]


def _space_of(options: argparse.Namespace) -> Space[Any]:
    refuse("", (options.space is None, "say which space the points are on with --space, such as --space sphere:2"))
    space = space_named(options.space)
    on_torus = any(isinstance(factor, Torus) for factor in factors_of(space))
    refuse("--degrees", (options.degrees and not on_torus, f" is for torus:n and products with it, not for {space}"))
    return space


def _in_radians(points: Any, space: Space[Any], options: argparse.Namespace) -> Any:
    """Return points with angles in radians. Warn if angles look like degrees and the option is absent."""
    if options.degrees:
        return with_angles(space, points, np.radians)
    largest = look_like_degrees(space, points)
    if largest is not None:
        why = f"angles up to {largest:g} look like degrees, but angles on {space} are in radians"
        say(f"{options.input}: {why}; give --degrees if they are in degrees")
    return points


def _usual_names(count: int) -> list[str]:
    return [f"axis{i}" for i in range(count)]


# ---- NPZ ----


def read_arrays(options: argparse.Namespace) -> Grid:
    """Read the grid or the spline in an NPZ file."""
    path = Source(options.input, "npz")
    with path.open() as file:
        refuse(path, (not zipfile.is_zipfile(file), " is not an NPZ file"))
        file.seek(0)
        with damage(path, "is damaged, or holds other objects than numbers"):
            arrays = read(file, lambda name: True)
        if "format" in arrays:
            file.seek(0)
            return _spline(options, path, load(file), arrays.get(AXIS_NAMES))
    space = _space_of(options)
    several = isinstance(space, Product)
    keys = [f"points_{i}" for i in range(len(factors_of(space)))] if several else ["points"]
    absent = next((key for key in keys if key not in arrays), None)
    refuse(path, (absent, f" has no array {absent!r} of points; {did_you_mean('points', [*arrays])}"))
    points = [arrays[key] for key in keys]
    factor = factors_of(space)[0]
    count = points[0].ndim - len(factor.point_shape)
    wrong = count < 1 or points[0].shape[count:] != factor.point_shape
    needed = f"has shape {points[0].shape}, which must end in {factor.point_shape}, the shape of a point of {factor}"
    refuse(path, (wrong, f": {keys[0]!r} {needed}, after the sizes of the axes"))
    given = split_names(options.axes)
    for name in given:
        refuse(path, (name not in arrays, f" has no array {name!r}; {did_you_mean(name, [*arrays])}"))
    names = given or [name for name, array in arrays.items() if array.ndim == 1 and name not in keys]
    listed = ", ".join(map(repr, names))
    wrong = f": there are arrays {listed} for the axes, but the points have {count} axes; name these with --axes"
    refuse(path, (names and len(names) != count, wrong))
    _check_sizes(path, {name: len(arrays[name]) for name in names}, points[0].shape[:count])
    axes = [arrays[name] for name in names] if names else [None] * count
    numbers = _in_radians(tuple(points) if several else points[0], space, options)
    return Grid(names or _usual_names(count), axes, numbers, space, degrees=options.degrees)


def _check_sizes(path: Source, sizes: dict[str, int], nodes: tuple[int, ...]) -> None:
    """Raise `Problem` unless the arrays of the axes have as many positions as the points have nodes along them."""
    if not sizes or tuple(sizes.values()) == nodes:
        return
    order = [name for n in dict.fromkeys(nodes) for name, size in sizes.items() if size == n]
    fits = tuple(sizes[name] for name in order) == nodes
    advice = f"; give --axes {','.join(order)}" if fits else ""
    found = " and ".join(f"{name} has {size} positions" for name, size in sizes.items())
    raise Problem(f"{path}: {found}, but the points have {' x '.join(map(str, nodes))} nodes{advice}")


def _spline(options: argparse.Namespace, path: Source, spline: Any, names: Any) -> Grid:
    given = " and ".join(f"--{name}" for name in ("space", "axes") if getattr(options, name) is not None)
    refuse(
        path,
        (not isinstance(spline, GridSpline), " is a curve, not a grid; see symspline sample"),
        (given, f" is a spline, for which {given} cannot be given"),
    )
    count = len(spline.axes)
    names = [str(name) for name in names] if names is not None and np.shape(names) == (count,) else _usual_names(count)
    return Grid(names, spline=spline, degrees=options.degrees)


def write_arrays(path: Path, names: Sequence[str], axes: Sequence[Array], points: Any) -> None:
    """Write values on a grid, with the arrays that `read_arrays` reads."""
    several = isinstance(points, tuple)
    arrays = {f"points_{i}": part for i, part in enumerate(points)} if several else {"points": points}
    with writing(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, **dict(zip(names, axes, strict=True)), **arrays)  # type: ignore[arg-type]


# ---- Zarr, read and written block by block ----


def read_store(options: argparse.Namespace) -> Grid:
    """Read a variable as a whole."""
    array, axes, point_dims = _opened(options)
    others = [name for name in array.dims if name not in (*axes, *point_dims)]
    several = f": the dimensions {', '.join(map(str, others))} are those of several grids; write them to a .zarr store"
    refuse(options.input, (others, several))
    from ..xarray._units import in_radians

    space, degrees = _space_of(options), is_degrees(array.attrs.get("units", ""))
    points = in_radians(array.transpose(*axes, *point_dims).compute(), space).values
    return Grid(axes, _nodes(array, axes), points, space, degrees=degrees)


def resample_store(
    options: argparse.Namespace, how: dict[str, Any], positions: Callable[[list[str], list[Array]], list[Array]]
) -> str:
    """Write the values of a variable to another store, and describe the result."""
    array, axes, point_dims = _opened(options)
    from dask import callbacks, config, system

    from ..xarray import resample

    ends = how["bc_type"]
    if not isinstance(ends, str):
        refuse("--bc-type ", (len(ends) != len(axes), f"has {len(ends)} entries, but there are {len(axes)} axes"))
        how = how | {"bc_type": dict(zip(axes, ends, strict=True))}
    to = dict(zip(axes, positions(axes, _nodes(array, axes)), strict=True))
    made = resample(array, _space_of(options), to, point_dims=point_dims, on_failure="raise", **how)
    blocks: dict[str, int] = {}

    def finished(*_: Any) -> None:
        blocks["done"] += 1
        progress(blocks["done"], blocks["all"])

    counter: Any = callbacks.Callback
    counted = counter(start=lambda graph: blocks.update(done=0, all=len(graph)), posttask=finished)
    with _new_store(options.output) as store, Progress("resampling") as progress, counted:
        try:
            # If a block fails, other threads are still writing. They end before the store is removed.
            with ThreadPoolExecutor(system.CPU_COUNT) as pool, config.set(pool=pool):
                made.to_dataset(name=array.name).to_zarr(store, consolidated=False)
        except (SymsplineError, OSError, MemoryError):
            raise
        except Exception as error:
            # Damaged chunks raise errors of their decompressors.
            raise Problem(f"{options.input} is damaged: {brief(error)}") from None
    sizes = " x ".join(str(made.sizes[name]) for name in made.dims if name not in point_dims)
    return f"{sizes} values of {_space_of(options)}"


def _nodes(array: Any, axes: list[str]) -> list[Array]:
    return [array[name].values if name in array.coords else np.arange(float(array.sizes[name])) for name in axes]


def _opened(options: argparse.Namespace) -> tuple[Any, list[str], list[str]]:
    """Return the variable of a store, and the names of the axes of the grid and of the points."""
    space, path = _space_of(options), options.input
    refuse(path, (isinstance(space, Product), f": {space} is a product, which a Zarr store cannot hold"))
    try:
        import xarray
        import zarr  # noqa: F401
    except ImportError:
        needed = "install them with: pip install 'symspline[xarray]' zarr"
        raise Problem(f"Zarr stores need xarray and zarr; {needed}") from None
    with reading(path):
        os.listdir(path)
    with damage(path, "is damaged or not a Zarr store"):
        store = xarray.open_zarr(path, consolidated=False)
    names = [str(name) for name in store.data_vars]
    several = f" has the variables {', '.join(names)}; select one with --variable"
    refuse(path, (options.variable is None and len(names) != 1, several))
    name = options.variable or names[0]
    refuse(path, (name not in names, f" has no variable {name!r}; {did_you_mean(name, names)}"))
    array = store[name].assign_attrs({"units": "degree"} if options.degrees else {})
    dims = [str(dim) for dim in array.dims]
    count = len(space.point_shape)
    few = f": {name!r} has the dimensions {', '.join(dims)}, but a point of {space} alone has {count}"
    refuse(path, (len(dims) <= count, few))
    others, point_dims = dims[:-count], dims[-count:]
    axes = split_names(options.axes) or others
    for axis in axes:
        refuse(path, (axis not in others, f" has no axis {axis!r}; {did_you_mean(axis, others)}"))
    return array.chunk(dict.fromkeys(point_dims, -1)), axes, point_dims


@contextmanager
def _new_store(path: Path) -> Iterator[Path]:
    """Yield a temporary folder that becomes a store if the body succeeds."""
    temporary = path.with_name(f".{secrets.token_hex(8)}{path.name[-32:]}")
    try:
        with reading(path, "write"):
            yield temporary
            temporary.rename(path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)

"""Grids in Zarr stores, which are read and written block by block."""

from __future__ import annotations

import argparse
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import brief
from .._disk import damage
from .._exceptions import SymsplineError
from .._spaces import Product
from ._columns import split_names
from ._grid_files import Grid, sizes, space_of
from ._grid_positions import positions
from ._messages import Problem, Progress, did_you_mean, reading, refuse


def read_grid(options: argparse.Namespace) -> Grid:
    """Read a variable as a whole."""
    array, axes, point_dims = _opened(options)
    others = [name for name in array.dims if name not in (*axes, *point_dims)]
    several = f": the dimensions {', '.join(map(str, others))} are those of several grids; write them to a .zarr store"
    refuse(options.input, (others, several))
    nodes = [array[name].values if name in array.coords else np.arange(float(array.sizes[name])) for name in axes]
    return Grid(axes, nodes, array.transpose(*axes, *point_dims).values, space_of(options))


def resampled(options: argparse.Namespace, how: dict[str, Any]) -> str:
    """Write the values of a variable to another store, and describe the result."""
    array, axes, point_dims = _opened(options)
    from dask import callbacks

    from ..xarray import resample

    nodes = [array[name].values if name in array.coords else np.arange(float(array.sizes[name])) for name in axes]
    x = positions(options, axes, nodes)
    ends = how["bc_type"]
    if not isinstance(ends, str):
        refuse("--bc-type ", (len(ends) != len(axes), f"has {len(ends)} entries, but there are {len(axes)} axes"))
        how = how | {"bc_type": dict(zip(axes, ends, strict=True))}
    to = dict(zip(axes, x, strict=True))
    made = resample(array, space_of(options), to, point_dims=point_dims, on_failure="raise", **how)
    counter: Any = callbacks.Callback
    done = [0, 0]

    def start(graph: Any) -> None:
        done[:] = 0, len(graph)

    def finished(*_: Any) -> None:
        done[0] += 1
        progress(*done)

    with (
        _new_store(options.output) as store,
        Progress("resampling") as progress,
        counter(start=start, posttask=finished),
    ):
        _write(made.to_dataset(name=array.name), store, options.input)
    return f"{sizes(made.sizes[name] for name in made.dims if name not in point_dims)} values of {space_of(options)}"


def _opened(options: argparse.Namespace) -> tuple[Any, list[str], list[str]]:
    """Return the variable of a store, and the names of the axes of the grid and of the points."""
    space, path = space_of(options), options.input
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
    name = options.variable or (names[0] if len(names) == 1 else None)
    refuse(
        path,
        (name is None, f" has the variables {', '.join(names)}; select one with --variable"),
        (name is not None and name not in names, f" has no variable {name!r}; {did_you_mean(str(name), names)}"),
    )
    array = store[name]
    dims = [str(dim) for dim in array.dims]
    count = len(space.point_shape)
    few = f": {name!r} has the dimensions {', '.join(dims)}, but a point of {space} alone has {count}"
    refuse(path, (len(dims) <= count, few))
    point_dims = dims[-count:]
    axes = split_names(options.axes) or dims[:-count]
    for axis in axes:
        refuse(path, (axis not in dims[:-count], f" has no axis {axis!r}; {did_you_mean(axis, dims[:-count])}"))
    return array.chunk(dict.fromkeys(point_dims, -1)), axes, point_dims


def _write(dataset: Any, store: Path, source: Path) -> None:
    """Compute and write all blocks."""
    try:
        dataset.to_zarr(store, consolidated=False)
    except (SymsplineError, OSError, MemoryError):
        raise
    except Exception as error:
        # Damaged chunks raise errors of their decompressors.
        raise Problem(f"{source} is damaged: {brief(error)}") from None


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

"""Positions along the axes of a grid, by ``--to``, ``--zoom`` or ``--points``."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._archive import read
from .._disk import damage
from ._messages import Problem, reading, refuse
from ._times import is_number, spread

Array = NDArray[Any]

_MOST = 10**9


def values_option(options: argparse.Namespace) -> str | None:
    """Return which of the three options is given, if any."""
    return next((name for name in ("to", "zoom", "points") if getattr(options, name) is not None), None)


def numbers_of(options: argparse.Namespace, option: str, count: int) -> list[float]:
    """Read one number per axis, or one number for all of them."""
    text = getattr(options, option)
    cells = text.split(",")
    what = "numbers" if option == "zoom" else "whole numbers"
    bad = [cell for cell in cells if not is_number(cell) or not _fits(float(cell), option)]
    one = option == "zoom" and len(cells) == 1
    refuse(
        f"--{option} {text}: ",
        (bad, f"give {what} {'larger than 0' if option == 'zoom' else 'from 2 on'}, separated by commas"),
        (len(cells) != count and not one, f"there are {count} axes, which need {count} numbers, not {len(cells)}"),
    )
    return [float(cell) for cell in cells] * (count if one else 1)


def _fits(number: float, option: str) -> bool:
    return 0 < number <= _MOST if option == "zoom" else 2 <= number <= _MOST and number == int(number)


def positions(options: argparse.Namespace, names: Sequence[str], axes: Sequence[Array]) -> list[Array]:
    """Return the positions along each axis, numbers or dates as its nodes are."""
    option = values_option(options)
    if option == "to":
        return _of_file(options, names)
    floats = [axis if axis.dtype.kind == "M" else axis.astype(np.float64) for axis in axes]
    numbers = numbers_of(options, option or "", len(axes))
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


def _of_file(options: argparse.Namespace, names: Sequence[str]) -> list[Array]:
    path = options.to
    refuse(path, (path.suffix.lower() != ".npz", ": positions are read from an .npz file with one array per axis"))
    with reading(path), open(path, "rb") as file, damage(path, "is damaged or not an NPZ file"):
        arrays = read(file, lambda name: name in names)
    for name in names:
        if name not in arrays or arrays[name].ndim != 1:
            raise Problem(f"{path} has no array {name!r} with one axis, the positions along {name!r}")
    return [arrays[name] for name in names]

"""Volumes of diffusion tensors in NIfTI files."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from .._spaces import space_named
from ..tensors import Volume, read_nifti, resample, write_nifti
from ..tensors._nifti import written_order
from ._grid_files import Grid, far_points_noted, sizes
from ._grid_positions import numbers_of
from ._messages import Problem, Progress, reading, refuse

_SPACE = "spd:3"


def read_grid(options: argparse.Namespace) -> Grid:
    """Read the tensors of a file on a grid of voxels, NaN outside the mask."""
    volume = _volume(options)
    nodes = np.full((*volume.mask.shape, 3, 3), np.nan)
    nodes[volume.mask] = volume.tensors
    return Grid(["i", "j", "k"], [None] * 3, nodes, space_named(_SPACE))


def resampled(options: argparse.Namespace, option: str, how: dict[str, Any]) -> str:
    """Write the tensors at other voxels, and describe the result."""
    volume = _volume(options)
    shape = volume.mask.shape
    voxels: dict[str, Any]
    if option == "to":
        with reading(options.to), open(options.to, "rb"):
            voxels = {"like": options.to}
    elif option == "zoom":
        voxels = {"zoom": numbers_of(options, option, len(shape))}
    else:
        counts = numbers_of(options, option, len(shape))
        voxels = {"zoom": [(count - 1) / max(n - 1, 1) for count, n in zip(counts, shape, strict=True)]}
    with far_points_noted(), Progress("resampling") as progress:
        fine = resample(volume, **voxels, **how, progress=progress)
    write_nifti(options.output, fine, order=written_order(volume, options.order))
    inside = f"{len(fine.tensors)} of them inside the mask"
    return f"{sizes(fine.mask.shape)} voxels, {inside}, from {len(volume.tensors)} of {sizes(shape)}"


def _volume(options: argparse.Namespace) -> Volume:
    other = options.space is not None and space_named(options.space) != space_named(_SPACE)
    refuse(options.input, (other, f" holds diffusion tensors, points of {_SPACE}, not of {options.space}"))
    for path in (options.input, options.mask):
        if path is not None:
            # Errors of nibabel have no name of a file.
            with reading(path), open(path, "rb"):
                pass
    try:
        return read_nifti(options.input, order=options.order, mask=options.mask)
    except ImportError as error:
        raise Problem(str(error)) from None

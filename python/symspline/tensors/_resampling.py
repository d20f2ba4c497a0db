"""Volumes of tensors on other voxels, by splines along the three axes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import as_array, short_repr
from .._base.typing import Progress, TensorOrder, VoxelOptions
from .._core import ValidationError
from .._grid import GridSpline
from ._nifti import File, Volume, check_volume, checked_path, image_of, read_nifti, write_nifti, written_order
from ._orders import Array

Floats = NDArray[np.float64]

# NIfTI files store the number of voxels along an axis in 16 bits.
_MOST_VOXELS = 2**15 - 1
# Tensors that are evaluated at once: 19 MB.
_BLOCK = 2**18
# Affine maps in files have single precision.
_ROUNDING = 1e-4


def resample(
    volume: Volume,
    *,
    zoom: ArrayLike | None = None,
    voxel_size: ArrayLike | None = None,
    like: Any = None,
    bc_type: Any = "not-a-knot",
    symmetric: bool = False,
    progress: Progress | None = None,
) -> Volume:
    """Interpolate a volume of tensors at the centres of other voxels.

    The tensors between the voxels are those of a `GridSpline` on ``spd:3``: they are positive definite, and twice
    continuously differentiable along each axis. Nothing is extrapolated.

    Parameters
    ----------
    volume : Volume
        Tensors and mask. Every tensor must be positive definite.
    zoom : float or three floats, optional
        Number of new voxels per old voxel along the axes. Pass exactly one of `zoom`, `voxel_size` and `like`.
    voxel_size : float or three floats, optional
        Size of the new voxels, in the unit of the affine map.
    like : path, nibabel image or Volume, optional
        Volume with the new voxels. Its axes must be parallel to those of `volume`, in the same order and direction.
    bc_type : str or sequence, default "not-a-knot"
        End conditions, as for `GridSpline`.
    symmetric : bool, default False
        Whether the result is the midpoint of both orders of the axes, as for `GridSpline`.
    progress : callable, optional
        Called with the finished and the total number of new voxels.

    Returns
    -------
    Volume
        Tensors, mask and affine map of the new voxels, with the header of `volume` and the precision of its tensors.

    Raises
    ------
    ValidationError
        If the arguments are invalid, a tensor is not positive definite, or the axes of `like` are not parallel to those
        of the volume.
    ConvergenceError
        If the spline of a row does not converge.

    See Also
    --------
    resample_nifti : The same from file to file.

    Notes
    -----
    With `zoom` and `voxel_size`, the centre of the first voxel stays where it is, and the last new centre is at most at
    the last old one: n voxels become ``floor((n - 1) * zoom) + 1``. An axis with a single voxel is not resampled.

    Tensors outside the mask are missing. They divide the rows of voxels into runs, each with a spline of its own. A new
    voxel is in the new mask if it is between voxels of the mask along every axis, so that a layer of less than one
    voxel is lost at the border.

    Examples
    --------
    >>> import numpy as np
    >>> from symspline import tensors
    >>> matrices = [[[1, 1], [1, 1]], [[1, 1], [1, 4]]] * np.eye(3)[:, :, None, None, None]
    >>> volume = tensors.Volume(matrices.T.reshape(8, 3, 3), np.ones((2, 2, 2), bool), np.diag([2.0, 2.0, 2.0, 1.0]))
    >>> fine = tensors.resample(volume, voxel_size=1)
    >>> fine.mask.shape, fine.affine.diagonal(), fine.tensors[-2].diagonal().round(12)
    ((3, 3, 3), array([1., 1., 1., 1.]), array([2., 2., 2.]))
    """
    if not check_volume(volume).any():
        raise ValidationError("the mask of the volume is empty, so that there are no tensors to interpolate")
    positions, affine = _target(volume, zoom, voxel_size, like)
    _check_tensors(volume)
    shape = tuple(map(len, positions))
    mask = np.zeros(shape, bool)
    found: list[Array] = []
    for start, block in _blocks(volume, positions, bc_type, symmetric, progress):
        good = np.isfinite(block).all(axis=(-2, -1))
        mask[start : start + len(block)] = good
        found.append(block[good].astype(volume.tensors.dtype, copy=False))
    return replace(volume, tensors=np.concatenate(found), mask=mask, affine=affine)


def resample_nifti(
    src: File,
    dst: File,
    *,
    order: TensorOrder | None = None,
    mask: ArrayLike | File | None = None,
    **options: Unpack[VoxelOptions],
) -> None:
    """Interpolate the tensors in a NIfTI file at the centres of other voxels, and write them to another file.

    Units, codes, intent and texts of the header are kept. Tensors that are all zero are outside the mask, in the source
    and in the result.

    Parameters
    ----------
    src : path
        File to read.
    dst : path
        File to write, in the order of `src`.
    order : {"dipy", "fsl", "mrtrix", "itk"}, optional
        Order of the six numbers, as for `read_nifti`.
    mask : array_like of shape (X, Y, Z), or path, optional
        Voxels to read, as for `read_nifti`.
    **options
        Keyword arguments of `resample`: `zoom`, `voxel_size`, `like`, `bc_type`, `symmetric` and `progress`.

    Raises
    ------
    ImportError
        If nibabel is not installed.
    ValidationError
        If a file, the mask or an argument is invalid, or a tensor is not positive definite.
    ConvergenceError
        If the spline of a row does not converge.

    See Also
    --------
    resample : The same for a volume in memory.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from symspline import tensors
    >>> volume = tensors.Volume(np.tile(np.eye(3), (8, 1, 1)), np.ones((2, 2, 2), bool), np.diag([2.0, 2.0, 2.0, 1.0]))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     tensors.write_nifti(f"{folder}/dti.nii.gz", volume, order="fsl")
    ...     tensors.resample_nifti(f"{folder}/dti.nii.gz", f"{folder}/fine.nii.gz", order="fsl", voxel_size=1)
    ...     tensors.read_nifti(f"{folder}/fine.nii.gz", order="fsl").mask.shape
    (3, 3, 3)
    """
    source, target = checked_path(src, "src"), checked_path(dst, "dst")
    volume = read_nifti(source, order=order, mask=mask)
    write_nifti(target, resample(volume, **options), order=written_order(volume, order))


def _blocks(
    volume: Volume, positions: Sequence[Floats], bc_type: Any, symmetric: bool, progress: Progress | None
) -> Iterator[tuple[int, Floats]]:
    """Yield the start along the first axis, and tensors at the outer product of positions, NaN outside the mask."""
    shape = tuple(map(len, positions))
    full = np.full((*volume.mask.shape, 3, 3), np.nan)
    full[volume.mask] = volume.tensors
    # A spline needs two nodes per axis, so axes with a single voxel are omitted.
    kept = [axis for axis, n in enumerate(volume.mask.shape) if n > 1]
    nodes = full.squeeze(tuple(axis for axis in range(3) if axis not in kept))
    ends = bc_type if isinstance(bc_type, str) or len(bc_type) != 3 else [bc_type[axis] for axis in kept]
    spline = GridSpline((None,) * len(kept), nodes, "spd:3", bc_type=ends, symmetric=symmetric) if kept else None
    step = max(1, _BLOCK // math.prod(shape[1:]))
    for start in range(0, shape[0], step):
        block = positions[0][start : start + step], *positions[1:]
        found = np.full((*map(len, block), 3, 3), np.nan)
        inside = [(x >= 0) & (x <= n - 1) for x, n in zip(block, volume.mask.shape, strict=True)]
        if spline is None:
            found[np.ix_(*inside)] = full
        elif all(own.any() for own in inside):
            values = spline.grid(*(block[axis][inside[axis]] for axis in kept))
            found[np.ix_(*inside)] = values.reshape(*(own.sum() for own in inside), 3, 3)
        yield start, found
        if progress is not None:
            progress((start + len(found)) * math.prod(shape[1:]), math.prod(shape))


def _target(volume: Volume, zoom: Any, voxel_size: Any, like: Any) -> tuple[list[Floats], Floats]:
    """Return the positions of the new voxels along each axis, in old voxels, and the new affine map."""
    given = [name for name, value in (("zoom", zoom), ("voxel_size", voxel_size), ("like", like)) if value is not None]
    if len(given) != 1:
        raise ValidationError(
            f"exactly one of zoom, voxel_size and like must be given, not {' and '.join(given) or 'none'}"
        )
    shape = volume.mask.shape
    affine = np.asarray(volume.affine, float)
    if like is not None:
        return _voxels_of(like, shape, affine)
    sizes = np.linalg.norm(affine[:3, :3], axis=0)
    with np.errstate(over="ignore"):
        step = 1 / _three(zoom, "zoom") if zoom is not None else _three(voxel_size, "voxel_size") / sizes
    step[np.equal(shape, 1)] = 1.0
    name = "zoom" if zoom is not None else "voxel_size"
    with np.errstate(over="ignore", divide="ignore"):
        most = (np.array(shape) - 1) / step
    if not (most < _MOST_VOXELS).all() or not np.isfinite(step).all():
        raise ValidationError(
            f"{name} = {short_repr(zoom if zoom is not None else voxel_size)} gives more than {_MOST_VOXELS} voxels "
            "along an axis. Choose larger voxels."
        )
    counts = [math.floor((n - 1) / own + 1e-6) + 1 for n, own in zip(shape, step, strict=True)]
    positions = [np.minimum(own * np.arange(count), n - 1.0) for n, own, count in zip(shape, step, counts, strict=True)]
    return positions, affine @ np.diag([*step, 1.0])


def _voxels_of(like: Any, shape: tuple[int, ...], affine: Floats) -> tuple[list[Floats], Floats]:
    """Return the voxels of another volume in those of a shape and an affine map."""
    if isinstance(like, Volume):
        counts, target = like.mask.shape, np.asarray(like.affine, float)
    else:
        image = image_of(like)
        counts, target = image.shape[:3], np.asarray(image.affine, float)
    voxels = np.linalg.solve(affine, target)
    step = voxels[:3, :3].diagonal()
    turned = np.abs(voxels[:3, :3] - np.diag(step)).max()
    if not (step > 0).all() or turned > _ROUNDING * step.max():
        raise ValidationError(
            f"the axes of like are not those of the volume: from its voxels to those of the volume leads the matrix "
            f"{voxels[:3, :3].round(3).tolist()}, which must be diagonal and positive. Reorient one of the volumes."
        )
    positions = []
    for axis, (count, n) in enumerate(zip(counts, shape, strict=True)):
        x = voxels[axis, 3] + step[axis] * np.arange(count)
        # Positions that are nodes up to the rounding of files, ends of the volume among them.
        near = np.rint(x)
        close = np.abs(x - near) < _ROUNDING
        positions.append(np.where(close & (near >= 0) & (near < n), near, x))
    return positions, target


def _three(value: Any, name: str) -> Floats:
    numbers = as_array(value, name)
    good = numbers.dtype.kind in "iuf" and numbers.shape in ((), (3,))
    if not good or not (np.isfinite(numbers) & (numbers > 0)).all():
        raise ValidationError(f"{name} must be one or three positive numbers, not {short_repr(value)}")
    return np.array(np.broadcast_to(numbers, 3), float)


def _check_tensors(volume: Volume) -> None:
    """Raise ValidationError for tensors that are not points of ``spd:3``, with their voxels."""
    smallest = np.linalg.eigvalsh(volume.tensors)[:, 0]
    bad = ~(smallest > 0)
    if bad.any():
        first = int(bad.argmax())
        voxel = tuple(np.argwhere(volume.mask)[first].tolist())
        raise ValidationError(
            f"{bad.sum()} of {len(bad)} tensors are not positive definite; the first is that of voxel {voxel}, whose "
            f"smallest eigenvalue is {smallest[first]:.3g}. Raise the eigenvalues, as in the example of "
            "symspline.tensors, or omit these voxels by a mask."
        )

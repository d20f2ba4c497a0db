"""Volumes of diffusion tensors in NIfTI files, through nibabel."""

from __future__ import annotations

from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import ValidationError
from ..arrays import as_array, brief, shown
from ..disk import path_of, replacing
from .orders import Array, from_vectors, to_vectors

File = str | PathLike[str]

# nifti1.h: the lower triangle row by row along the fifth axis.
_SYMMATRIX = 1005


@dataclass(frozen=True)
class Volume:
    """The tensors of the voxels inside a mask.

    Attributes:
        tensors: shape (V, 3, 3), voxels in the order of the mask's True entries.
        mask: shape (X, Y, Z).
        affine: from voxels to millimetres, shape (4, 4).
        header: that of the file that was read, whose units, codes and texts `write_nifti` keeps; None for a new one.
    """

    tensors: Array
    mask: NDArray[np.bool_]
    affine: NDArray[np.float64]
    header: Any = field(default=None, compare=False, repr=False)


def read_nifti(file: File, order: str | None = None, mask: ArrayLike | File | None = None) -> Volume:
    """The tensors of a NIfTI file with six volumes.

    The curves through V voxels of several files with one mask are a batch: stack their ``tensors`` along axis 1 to
    shape (V, N+1, 3, 3).

    Args:
        file: shape (X, Y, Z, 6), or (X, Y, Z, 1, 6) with the intent of symmetric matrices, as ITK and ANTs write it.
        order: as for `from_vectors`; not needed where the file says that it holds symmetric matrices, whose order is
            a part of NIfTI, that of ``"dipy"``.
        mask: which voxels to take, shape (X, Y, Z), or a file with such a volume: those that are not zero; None for
            those whose six numbers are finite and not all zero. For several files take the mask of one for all.

    Returns:
        The tensors, the mask and the affine map. Single precision stays single.

    Raises:
        ImportError: nibabel is not installed.
        ValidationError: the file or the mask is of another shape, the mask is not finite, negative, or a file with
            another affine map, or the order is not given or not what the file says.
    """
    path = _path(file)
    image, numbers = _load(path)
    if int(image.header["intent_code"]) == _SYMMATRIX:
        if order not in (None, "dipy", "itk"):
            raise ValidationError(
                f"{path} says that it holds symmetric matrices in the order of NIfTI, not in that of "
                f"{order!r}; leave order out"
            )
        order = "dipy"
    elif order is None:
        raise ValidationError(
            f"{path} does not say in which order its six volumes are; say order='dipy', 'fsl' or 'mrtrix', "
            "after the program that wrote it"
        )
    if numbers.ndim == 5 and numbers.shape[3] == 1:
        numbers = numbers[:, :, :, 0]
    if numbers.ndim != 4 or numbers.shape[3] != 6:
        raise ValidationError(f"{path} has shape {numbers.shape}, but tensors need shape (X, Y, Z, 6)")
    inside = _mask(mask, numbers, image.affine)
    return Volume(from_vectors(numbers[inside], order), inside, np.asarray(image.affine, float), image.header)


def write_nifti(file: File, volume: Volume, order: str) -> None:
    """Write tensors to a NIfTI file; outside the mask its six numbers are zero.

    The six numbers are put in another order, but stay in the axes in which they were: FSL writes tensors in those of
    the voxels, MRtrix in those of the scanner. Between such programs turn them by the affine map's rotation yourself.

    Args:
        file: its name ends in .nii or .nii.gz.
        volume: tensors of the voxels in a mask, the affine map, and the header of the file that they came from, whose
            units, codes and texts are kept; for new tensors use ``dataclasses.replace(volume, tensors=...)``.
        order: as for `from_vectors`: the program that will read the file. For ``"itk"`` the file has five axes, the
            intent of symmetric matrices, and their order.

    Raises:
        ImportError: nibabel is not installed.
        ValidationError: the tensors are not as many as the mask has voxels, or not symmetric.
    """
    nibabel = _nibabel()
    path = _path(file)
    if not path.name.endswith((".nii", ".nii.gz")):
        raise ValidationError(
            f"file = {shown(str(path))}: the name of a NIfTI file must end in .nii or .nii.gz"
        )
    if not isinstance(volume, Volume):
        raise TypeError(f"volume must be a symspline.tensors.Volume, not {shown(volume)}")
    mask = np.asarray(volume.mask, bool)
    if np.shape(volume.tensors) != (np.count_nonzero(mask), 3, 3):
        raise ValidationError(
            f"tensors have shape {np.shape(volume.tensors)}, but the mask has {np.count_nonzero(mask)} voxels, which "
            f"need shape ({np.count_nonzero(mask)}, 3, 3)"
        )
    inside = to_vectors(volume.tensors, "dipy" if order == "itk" else order)
    numbers = np.zeros((*mask.shape, 6), inside.dtype)
    numbers[mask] = inside
    shaped = numbers[:, :, :, None] if order == "itk" else numbers
    if volume.header is None:
        image = nibabel.Nifti1Image(shaped, volume.affine)
    else:
        # Its type of numbers would round these.
        image = nibabel.Nifti1Image(shaped, volume.affine, volume.header, dtype=numbers.dtype)
    was = int(image.header["intent_code"]) == _SYMMATRIX
    if order == "itk" or was:
        code, rows = (_SYMMATRIX, 3) if order == "itk" else (0, 0)
        image.header["intent_code"], image.header["intent_p1"] = code, rows
    with replacing(path) as temporary:
        nibabel.save(image, temporary)


def _path(file: Any, name: str = "file") -> Path:
    path = path_of(file, name, method="read")
    if path is None:
        raise TypeError(f"{name} must be the name of a file: nibabel takes no open ones")
    return path


def _load(path: Path) -> tuple[Any, Array]:
    """The image in a file, and its numbers."""
    try:
        image = _nibabel().load(path)
        return image, np.asanyarray(image.dataobj)
    except (OSError, MemoryError, ImportError):
        raise
    except Exception as error:
        # Damage shows as errors of nibabel, NumPy, zlib and of whatever else reads the formats that it knows.
        raise ValidationError(f"{path} is damaged or not a NIfTI file: {brief(error)}") from None


def _mask(mask: Any, numbers: Array, affine: NDArray[np.float64]) -> NDArray[np.bool_]:
    if mask is None:
        return np.asarray(np.isfinite(numbers).all(axis=-1) & numbers.any(axis=-1))
    if isinstance(mask, (str, PathLike)):
        image, voxels = _load(_path(mask, "mask"))
        # Headers hold single precision.
        if not np.allclose(image.affine, affine, rtol=1e-4, atol=1e-4):
            raise ValidationError(
                f"the mask {mask} has another affine map than the tensors; bring it to their voxels first"
            )
        mask = voxels
    values = as_array(mask, "mask")
    bad = np.argwhere(~(values >= 0))
    if len(bad):
        place = tuple(map(int, bad[0]))
        raise ValidationError(f"mask[{', '.join(map(str, place))}] is {values[place]}; it must be 0 or more")
    inside: NDArray[np.bool_] = values.astype(bool)
    if inside.shape != numbers.shape[:3]:
        raise ValidationError(f"the mask has shape {inside.shape}, but the volume {numbers.shape[:3]}")
    return inside


def _nibabel() -> Any:
    try:
        import nibabel
    except ImportError:
        raise ImportError("NIfTI files need nibabel; install it with: pip install nibabel") from None
    return nibabel

"""Volumes of tensors in NIfTI files."""

from __future__ import annotations

from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import as_array, refuse, short_repr
from .._base.disk import damage, path_of, replacing
from .._base.equality import same
from .._base.typing import TensorOrder
from .._core import ValidationError
from ._orders import Array, from_vectors, to_vectors

File = str | PathLike[str]

# nifti1.h: the lower triangle row by row along the fifth axis.
_SYMMATRIX = 1005


@dataclass(frozen=True, eq=False)
class Volume:
    """Tensors of the voxels inside a mask.

    Attributes
    ----------
    tensors : ndarray, shape (V, 3, 3)
        Tensors in the order of the True entries of the mask.
    mask : ndarray of bool, shape (X, Y, Z)
        Mask.
    affine : ndarray, shape (4, 4)
        Map from indices of voxels to positions, in the unit of the header, which is usually millimetres.
    header : object, optional
        Header of the file that was read, an object of nibabel: ``header.get_xyzt_units()``,
        ``header.get_sform(coded=True)``, ``header["intent_code"]``, ``header["descrip"]``. `write_nifti` keeps it. None
        for a new volume.

    Examples
    --------
    >>> import numpy as np
    >>> from symspline import tensors
    >>> mask = np.zeros((2, 2, 1), bool)
    >>> mask[0, 0] = True
    >>> tensors.Volume(1e-3 * np.eye(3)[None], mask, np.eye(4)).tensors.shape
    (1, 3, 3)
    """

    tensors: Array
    mask: NDArray[np.bool_]
    affine: NDArray[np.float64]
    header: Any = field(default=None, repr=False)

    def __eq__(self, other: object) -> bool:
        """Whether tensors, masks and affine maps are equal; headers are not compared."""
        if not isinstance(other, Volume):
            return NotImplemented
        return same((self.tensors, self.mask, self.affine), (other.tensors, other.mask, other.affine))


def read_nifti(file: File, *, order: TensorOrder | None = None, mask: ArrayLike | File | None = None) -> Volume:
    """Read diffusion tensors from a NIfTI file with six volumes.

    Several files with V voxels in the same mask form a batch of curves: stack their ``tensors`` along axis 1 to shape
    (V, n, 3, 3).

    Parameters
    ----------
    file : path
        File of shape (X, Y, Z, 6), or of shape (X, Y, Z, 1, 6) with the intent of symmetric matrices, as written by ITK
        and ANTs.
    order : {"dipy", "fsl", "mrtrix", "itk"}, optional
        Order of the six numbers; see `from_vectors`. Omit it if the intent of the file is symmetric matrices, whose
        order is defined by NIfTI as that of ``"dipy"``.
    mask : array_like of shape (X, Y, Z), or path, optional
        Voxels to read: the nonzero ones of an array or a file. None means those whose six numbers are finite and not
        all zero. For several files, pass the mask of one of them to all.

    Returns
    -------
    Volume
        Tensors, mask and affine map. Single precision is preserved.

    Raises
    ------
    ImportError
        If nibabel is not installed.
    ValidationError
        If the file or the mask has another shape, the mask is negative, not finite, or a file with another affine map,
        or the order is missing or contradicts the file.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from symspline import tensors
    >>> volume = tensors.Volume(np.eye(3)[None], np.ones((1, 1, 1), bool), np.eye(4))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     tensors.write_nifti(f"{folder}/dti.nii.gz", volume, order="fsl")
    ...     tensors.read_nifti(f"{folder}/dti.nii.gz", order="fsl").mask.shape
    (1, 1, 1)
    """
    path = checked_path(file)
    image, numbers = _load(path)
    if _is_symmatrix(image.header):
        if order not in (None, "dipy", "itk"):
            raise ValidationError(
                f"the intent of {path} is symmetric matrices in the order of NIfTI, not in that of "
                f"{order!r}; omit order"
            )
        order = "dipy"
    elif order is None:
        raise ValidationError(
            f"order is required, because {path} does not state the order of its six volumes; pass order='dipy', 'fsl' "
            "or 'mrtrix', the program that wrote the file"
        )
    if numbers.ndim == 5 and numbers.shape[3] == 1:
        numbers = numbers[:, :, :, 0]
    if numbers.ndim != 4 or numbers.shape[3] != 6:
        raise ValidationError(f"{path} has shape {numbers.shape}, but tensors need shape (X, Y, Z, 6)")
    inside = _mask(mask, numbers, image.affine)
    return Volume(from_vectors(numbers[inside], order=order), inside, np.asarray(image.affine, float), image.header)


def write_nifti(file: File, volume: Volume, *, order: TensorOrder, like: Any = None) -> None:
    """Write diffusion tensors to a NIfTI file, with zeros outside the mask.

    Units, the codes of both affine maps, texts, times and extensions of the original file are kept.

    Parameters
    ----------
    file : path
        File name that ends in .nii or .nii.gz.
    volume : Volume
        Tensors, mask, affine map, and header of the original file. For new tensors use
        ``dataclasses.replace(volume, tensors=...)``.
    order : {"dipy", "fsl", "mrtrix", "itk"}
        Program that will read the file; see `from_vectors`. For ``"itk"`` the file has five axes, and the intent and
        order of symmetric matrices.
    like : path, nibabel image or Volume, optional
        Source of the header, instead of `volume`.

    Raises
    ------
    ImportError
        If nibabel is not installed.
    ValidationError
        If the number of tensors differs from the number of voxels in the mask, or a tensor is not symmetric.

    Notes
    -----
    The numbers are reordered, but their axes do not change. FSL writes tensors in the axes of the voxels, MRtrix in
    those of the scanner. To convert between such programs, rotate the tensors by the rotation of the affine map.

    A header has up to two affine maps, the qform and the sform, each with a code that names its target, such as the
    scanner or a standard brain. Where the affine map of the volume differs from that of the header, because the voxels
    are others, both maps are composed with the map from new to old voxels, and keep their codes. A file of a volume
    without a header has millimetres as unit. Timing of slices is dropped if the shape changes.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from symspline import tensors
    >>> volume = tensors.Volume(np.eye(3)[None], np.ones((1, 1, 1), bool), np.eye(4))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     tensors.write_nifti(f"{folder}/dti.nii.gz", volume, order="fsl")
    ...     tensors.read_nifti(f"{folder}/dti.nii.gz", order="fsl").tensors.shape
    (1, 3, 3)
    """
    nibabel = _nibabel()
    path = checked_path(file)
    if not path.name.endswith((".nii", ".nii.gz")):
        raise ValidationError(f"file = {short_repr(str(path))}: the name of a NIfTI file must end in .nii or .nii.gz")
    mask = check_volume(volume)
    inside = to_vectors(volume.tensors, order="dipy" if order == "itk" else order)
    numbers = np.zeros((*mask.shape, 6), inside.dtype)
    numbers[mask] = inside
    shaped = numbers[:, :, :, None] if order == "itk" else numbers
    source = volume if like is None else like
    header = source.header if isinstance(source, Volume) else image_of(source).header
    kind = nibabel.Nifti2Image if isinstance(header, nibabel.Nifti2Header) else nibabel.Nifti1Image
    # The type of the numbers in the header would round these.
    image = kind(shaped, volume.affine, header, dtype=numbers.dtype)
    if header is None:
        image.header.set_xyzt_units("mm")
    else:
        _keep_maps(image, header)
    if order == "itk" or _is_symmatrix(image.header):
        image.header["intent_code"], image.header["intent_p1"] = (_SYMMATRIX, 3) if order == "itk" else (0, 0)
    with replacing(path) as temporary:
        nibabel.save(image, temporary)


def check_volume(volume: Volume) -> NDArray[np.bool_]:
    """Return the mask, or raise an error unless there is one tensor per voxel of it."""
    if not isinstance(volume, Volume):
        raise TypeError(f"volume must be a symspline.tensors.Volume, not {short_repr(volume)}")
    mask = np.asarray(volume.mask, bool)
    found, needed = np.shape(volume.tensors), (int(mask.sum()), 3, 3)
    if found != needed:
        raise ValidationError(
            f"tensors have shape {found}, but the mask has {needed[0]} voxels, which need shape {needed}"
        )
    return mask


def image_of(like: Any) -> Any:
    """Return a NIfTI image that is given as such or by the name of its file."""
    image = _image(checked_path(like, "like")) if isinstance(like, (str, PathLike)) else like
    if not isinstance(image, _nibabel().Nifti1Pair):
        raise TypeError(f"like must be a path, a NIfTI image of nibabel or a Volume, not {short_repr(like)}")
    return image


def written_order(volume: Volume, order: TensorOrder | None) -> TensorOrder:
    """Return the order in which to write a volume that was read from a file in this order."""
    return "itk" if order is None or _is_symmatrix(volume.header) else order


def _is_symmatrix(header: Any) -> bool:
    """Whether the intent of a header is symmetric matrices, in the order of NIfTI."""
    return int(header["intent_code"]) == _SYMMATRIX


def _keep_maps(image: Any, header: Any) -> None:
    """Compose the two affine maps of a header with the map from the voxels of an image to those of the header."""
    voxels = np.linalg.solve(header.get_best_affine(), image.affine)
    # Headers hold single precision.
    if np.allclose(voxels, np.eye(4), rtol=0, atol=1e-5):
        voxels = np.eye(4)
    if header["sform_code"] or header["qform_code"]:
        for name in ("sform", "qform"):
            map, code = getattr(header, f"get_{name}")(coded=True)
            getattr(image, f"set_{name}")(None if map is None else map @ voxels, int(code))
    image.header["pixdim"][1:4] = header["pixdim"][1:4] * np.linalg.norm(voxels[:3, :3], axis=0)
    if image.shape[:3] != header.get_data_shape()[:3]:
        for name in ("slice_code", "slice_start", "slice_end", "slice_duration"):
            image.header[name] = 0


def checked_path(file: Any, name: str = "file") -> Path:
    path = path_of(file, name, method="read")
    if path is None:
        raise TypeError(f"{name} must be the name of a file, because nibabel does not accept open files")
    return path


def _image(path: Path) -> Any:
    nibabel = _nibabel()
    with damage(path, "is damaged or not a NIfTI file"):
        image = nibabel.load(path)
        if not isinstance(image, nibabel.Nifti1Pair):
            raise ValidationError("this is not a NIfTI file. Convert it, for example with nib-convert.")
        return image


def _load(path: Path) -> tuple[Any, Array]:
    """Return the image in a file, and its numbers."""
    image = _image(path)
    with damage(path, "is damaged or not a NIfTI file"):
        return image, np.asanyarray(image.dataobj)


def _mask(mask: Any, numbers: Array, affine: NDArray[np.float64]) -> NDArray[np.bool_]:
    if mask is None:
        return np.asarray(np.isfinite(numbers).all(axis=-1) & numbers.any(axis=-1))
    if isinstance(mask, (str, PathLike)):
        image, voxels = _load(checked_path(mask, "mask"))
        # Headers hold single precision.
        if not np.allclose(image.affine, affine, rtol=1e-4, atol=1e-4):
            raise ValidationError(
                f"the mask {mask} has another affine map than the tensors; resample it to their voxels first"
            )
        mask = voxels
    values = as_array(mask, "mask")
    refuse(~(values >= 0), "mask", lambda i: f"is {values[i]}; it must be 0 or more")
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

"""Diffusion tensors: six numbers in the order of each program, and volumes in NIfTI files.

Examples
--------
>>> import symspline as ss
>>> t = ss.tensors.from_vectors([[2, 0, 1, 0, 0, 1], [1, 0.5, 2, 0, 0, 1]], order="dipy")
>>> ss.tensors.to_vectors(ss.CubicSpline(None, t, "spd:3")(0.5), order="mrtrix").shape
(6,)

Fits of noisy signals sometimes have negative eigenvalues. Such tensors are not points of ``spd:3``. Raise the
eigenvalues to a threshold well above the noise, because small eigenvalues are far from all other points of that space:

>>> import numpy as np
>>> sizes, axes = np.linalg.eigh(np.diag([1.5e-3, 4e-4, -4e-5]))
>>> raised = np.einsum("...ij,...j,...kj->...ik", axes, np.maximum(sizes, 1e-4), axes)

Alternatively, drop such voxels from the batch, or mask them by ``where=``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import as_array, refuse, short_repr
from ._core import ValidationError
from ._disk import damage, path_of, replacing
from ._spaces import point_tol
from ._typing import TensorOrder
from ._validation import largest

__all__ = ["Volume", "from_vectors", "read_nifti", "to_vectors", "write_nifti"]

Array = NDArray[Any]
File = str | PathLike[str]

_ORDERS = {
    # Lower triangle row by row: dipy.reconst.dti.from_lower_triangular. So are NIfTI files with the intent
    # NIFTI_INTENT_SYMMATRIX (nifti1.h), which ITK, ANTs and DTI-TK write.
    "dipy": "xx xy yy xz yz zz",
    # Upper triangle row by row: what dtifit --save_tensor writes and fslmaths -tensor_decomp reads.
    "fsl": "xx xy xz yy yz zz",
    # Diagonal first: "volumes 0-5: D11, D22, D33, D12, D13, D23" in the help of dwi2tensor.
    "mrtrix": "xx yy zz xy xz yz",
    # Upper triangle row by row: itk::SymmetricSecondRankTensor in memory (itkNiftiImageIO.cxx, UpperToLowerOrder).
    "itk": "xx xy xz yy yz zz",
}
# nifti1.h: the lower triangle row by row along the fifth axis.
_SYMMATRIX = 1005


# ---- six numbers ----


def from_vectors(x: ArrayLike, *, order: TensorOrder) -> Array:
    """Convert six numbers per tensor to symmetric matrices, points of ``SymmetricPositiveDefinite(3)``.

    Parameters
    ----------
    x : array_like, shape (..., 6)
        Six numbers per tensor.
    order : {"dipy", "fsl", "mrtrix", "itk"}
        Order of the entries:

        - ``"dipy"``: xx, xy, yy, xz, yz, zz, as in ``dipy.reconst.dti.from_lower_triangular`` and in NIfTI files of
          symmetric matrices. The command ``dipy_fit_dti`` has written the order of FSL.
        - ``"fsl"``: xx, xy, xz, yy, yz, zz, as written by ``dtifit --save_tensor``.
        - ``"mrtrix"``: xx, yy, zz, xy, xz, yz, as written by ``dwi2tensor``.
        - ``"itk"``: xx, xy, xz, yy, yz, zz, as in ``SymmetricSecondRankTensor`` in memory. NIfTI files written by ITK
          and ANTs have the order ``"dipy"``; `read_nifti` accounts for this.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Symmetric matrices, in single precision if x is. Numbers that are not finite are kept. A spline raises an error
        for matrices that are not positive definite.

    Raises
    ------
    ValidationError
        If x is not real of shape (..., 6), or the order is unknown.

    Examples
    --------
    >>> from_vectors([1, 2, 3, 4, 5, 6], order="mrtrix")
    array([[1., 4., 5.],
           [4., 2., 6.],
           [5., 6., 3.]])
    """
    pairs = _pairs(order)
    array = _real(x, "x")
    if array.ndim < 1 or array.shape[-1] != 6:
        raise ValidationError(f"x has shape {array.shape}, but needs shape (..., 6), six numbers per tensor")
    index = np.zeros((3, 3), int)
    for number, (i, j) in enumerate(pairs):
        index[i, j] = index[j, i] = number
    return array[..., index]


def to_vectors(matrices: ArrayLike, *, order: TensorOrder) -> Array:
    """Convert symmetric matrices to six numbers per tensor, the inverse of `from_vectors`.

    Parameters
    ----------
    matrices : array_like, shape (..., 3, 3)
        Symmetric matrices.
    order : {"dipy", "fsl", "mrtrix", "itk"}
        Order of the entries; see `from_vectors`.

    Returns
    -------
    ndarray, shape (..., 6)
        Six numbers per tensor, in single precision if the matrices are.

    Raises
    ------
    ValidationError
        If a matrix is not symmetric, or the order is unknown.

    Examples
    --------
    >>> to_vectors([[1, 4, 5], [4, 2, 6], [5, 6, 3]], order="fsl")
    array([1., 4., 5., 2., 6., 3.])
    """
    pairs = _pairs(order)
    array = _real(matrices, "matrices")
    if array.ndim < 2 or array.shape[-2:] != (3, 3):
        raise ValidationError(f"matrices has shape {array.shape}, but needs shape (..., 3, 3)")
    with np.errstate(invalid="ignore"):
        off = largest(array - np.swapaxes(array, -1, -2))
        bad = off > point_tol(array.dtype) * largest(array)
        advice = "six numbers can represent symmetric matrices only"
        refuse(bad, "matrices", lambda i: f"is not symmetric: |A - Aᵀ| is {off[i]:.3e}; {advice}")
    rows, columns = np.transpose(pairs)
    return array[..., rows, columns]


def _pairs(order: Any) -> list[list[int]]:
    """Return the row and the column of each of the six numbers."""
    if isinstance(order, str) and order in _ORDERS:
        return [["xyz".index(axis) for axis in pair] for pair in _ORDERS[order].split()]
    raise ValidationError(
        f"order must be {', '.join(map(repr, _ORDERS))}, the program that wrote the six numbers, not "
        f"{short_repr(order)}: the numbers do not show it"
    )


def _real(value: ArrayLike, name: str) -> Array:
    """Return real numbers in single or double precision."""
    array = as_array(value, name)
    if array.dtype.kind not in "biuf":
        raise ValidationError(f"{name} must be an array of real numbers, not of {array.dtype}")
    return array.astype(np.float32 if array.dtype in (np.float16, np.float32) else np.float64, copy=False)


# ---- NIfTI files ----


@dataclass(frozen=True)
class Volume:
    """Tensors of the voxels inside a mask.

    Attributes
    ----------
    tensors : ndarray, shape (V, 3, 3)
        Tensors in the order of the True entries of the mask.
    mask : ndarray of bool, shape (X, Y, Z)
        Mask.
    affine : ndarray, shape (4, 4)
        Map from voxels to millimetres.
    header : object, optional
        Header of the file that was read. `write_nifti` keeps its units, codes and texts. None for a new volume.

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
    header: Any = field(default=None, compare=False, repr=False)


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
    path = _path(file)
    image, numbers = _load(path)
    if int(image.header["intent_code"]) == _SYMMATRIX:
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


def write_nifti(file: File, volume: Volume, *, order: TensorOrder) -> None:
    """Write diffusion tensors to a NIfTI file, with zeros outside the mask.

    Parameters
    ----------
    file : path
        File name that ends in .nii or .nii.gz.
    volume : Volume
        Tensors, mask, affine map, and header of the original file, whose units, codes and texts are kept. For new
        tensors use ``dataclasses.replace(volume, tensors=...)``.
    order : {"dipy", "fsl", "mrtrix", "itk"}
        Program that will read the file; see `from_vectors`. For ``"itk"`` the file has five axes, and the intent and
        order of symmetric matrices.

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
    path = _path(file)
    if not path.name.endswith((".nii", ".nii.gz")):
        raise ValidationError(f"file = {short_repr(str(path))}: the name of a NIfTI file must end in .nii or .nii.gz")
    if not isinstance(volume, Volume):
        raise TypeError(f"volume must be a symspline.tensors.Volume, not {short_repr(volume)}")
    mask = np.asarray(volume.mask, bool)
    found, needed = np.shape(volume.tensors), (int(mask.sum()), 3, 3)
    if found != needed:
        raise ValidationError(
            f"tensors have shape {found}, but the mask has {needed[0]} voxels, which need shape {needed}"
        )
    inside = to_vectors(volume.tensors, order="dipy" if order == "itk" else order)
    numbers = np.zeros((*mask.shape, 6), inside.dtype)
    numbers[mask] = inside
    shaped = numbers[:, :, :, None] if order == "itk" else numbers
    # The type of the numbers in the header would round these.
    image = nibabel.Nifti1Image(shaped, volume.affine, volume.header, dtype=numbers.dtype)
    if order == "itk" or int(image.header["intent_code"]) == _SYMMATRIX:
        image.header["intent_code"], image.header["intent_p1"] = (_SYMMATRIX, 3) if order == "itk" else (0, 0)
    with replacing(path) as temporary:
        nibabel.save(image, temporary)


def _path(file: Any, name: str = "file") -> Path:
    path = path_of(file, name, method="read")
    if path is None:
        raise TypeError(f"{name} must be the name of a file, because nibabel does not accept open files")
    return path


def _load(path: Path) -> tuple[Any, Array]:
    """Return the image in a file, and its numbers."""
    with damage(path, "is damaged or not a NIfTI file"):
        image = _nibabel().load(path)
        return image, np.asanyarray(image.dataobj)


def _mask(mask: Any, numbers: Array, affine: NDArray[np.float64]) -> NDArray[np.bool_]:
    if mask is None:
        return np.asarray(np.isfinite(numbers).all(axis=-1) & numbers.any(axis=-1))
    if isinstance(mask, (str, PathLike)):
        image, voxels = _load(_path(mask, "mask"))
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

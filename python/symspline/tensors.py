"""Diffusion tensors: six numbers in the order of each program.

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

In the gallery, "A DTI volume on finer voxels" reads a volume in a NIfTI file and interpolates it between its voxels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ._base.arrays import as_array, largest, refuse, short_repr
from ._base.typing import Array, TensorOrder
from ._core import ValidationError
from ._spaces import point_tol

__all__ = ["from_vectors", "to_vectors"]


def __dir__() -> list[str]:
    return __all__


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
        bad = off > point_tol(array) * largest(array)
        advice = "six numbers can represent symmetric matrices only"
        refuse(bad, "matrices", lambda i: f"is not symmetric: |A - Aᵀ| is {off[i]:.3e}; {advice}")
    rows, columns = np.transpose(pairs)
    return array[..., rows, columns]


def _pairs(order: object) -> list[list[int]]:
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

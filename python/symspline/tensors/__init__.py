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

`resample` interpolates a volume at other voxels, and `resample_nifti` does so from file to file.
"""

from ._nifti import Volume, read_nifti, write_nifti
from ._orders import from_vectors, to_vectors
from ._resampling import resample, resample_nifti

__all__ = ["Volume", "from_vectors", "read_nifti", "resample", "resample_nifti", "to_vectors", "write_nifti"]

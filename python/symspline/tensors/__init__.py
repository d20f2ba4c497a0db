"""Diffusion tensors: six numbers in the order of each program, and volumes in NIfTI files.

>>> import symspline as ss
>>> t = ss.tensors.from_vectors([[2, 0, 1, 0, 0, 1], [1, 0.5, 2, 0, 0, 1]], order="dipy")
>>> ss.tensors.to_vectors(ss.CubicSpline(None, t, "spd:3")(0.5), order="mrtrix").shape
(6,)
"""

from .nifti import Volume, read_nifti, write_nifti
from .orders import from_vectors, to_vectors

__all__ = ["Volume", "from_vectors", "read_nifti", "to_vectors", "write_nifti"]

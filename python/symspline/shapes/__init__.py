"""Affine shapes: labelled landmarks up to affine maps, and morphs between drawings (§4.3 of the paper).

k + 1 landmarks in Rⁿ are a matrix with a row each; its columns, centred, span a subspace of Rᵏ⁺¹ that no affine map
of Rⁿ changes: a point of ``Grassmannian(n, k + 1)``. Measured from one of them, as in the paper, they give a point of
``Grassmannian(n, k)``, which prefers that landmark.

>>> import numpy as np, symspline as ss
>>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
>>> sheared = square @ [[1, 0.5], [0, 1]] + 3
>>> space = ss.Grassmannian(2, 4)
>>> space.distance(*map(ss.shapes.from_landmarks, (square, sheared))).round(8)
np.float64(0.0)
"""

from .landmarks import from_landmarks, to_landmarks
from .morph import AffineMorph

__all__ = ["AffineMorph", "from_landmarks", "to_landmarks"]

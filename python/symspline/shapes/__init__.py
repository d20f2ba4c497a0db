"""Affine shapes: labelled landmarks up to affine maps, and morphs between drawings (§4.3 of the paper).

k + 1 landmarks in Rⁿ form a matrix with one row per landmark. Its centred columns span a subspace of Rᵏ⁺¹ that is
invariant under affine maps of Rⁿ: a point of ``Grassmannian(n, k + 1)``. If the landmarks are measured from one of
them, as in the paper, the result is a point of ``Grassmannian(n, k)``, which gives preference to that landmark.

Examples
--------
>>> import numpy as np, symspline as ss
>>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
>>> sheared = square @ [[1, 0.5], [0, 1]] + 3
>>> space = ss.Grassmannian(2, 4)
>>> space.distance(*map(ss.shapes.from_landmarks, (square, sheared))).round(8)
np.float64(0.0)
"""

from ._landmarks import from_landmarks, to_landmarks
from ._morph import AffineMorph

__all__ = ["AffineMorph", "from_landmarks", "to_landmarks"]

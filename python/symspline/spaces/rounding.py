"""How much rounding a point carries."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import Space
from .positive import HermitianPositiveDefinite, SymmetricPositiveDefinite


def rounding(space: Space, points: NDArray[Any]) -> float:
    """By how much rounding counts near points of a space, not a product: |p|² far out in hyperbolic spaces, the
    condition of positive definite matrices, |p| elsewhere, and 1 or more; the largest of all points.

    >>> from symspline.spaces import Hyperbolic, Sphere
    >>> rounding(Sphere(1), np.array([[1.0, 0.0]])), rounding(Hyperbolic(1), np.array([[1.25, 0.75]]))
    (1.0, 2.125)
    """
    if isinstance(space, (SymmetricPositiveDefinite, HermitianPositiveDefinite)):
        return float(np.linalg.cond(points).max())
    return max(1.0, float(np.abs(points).max()), float(space._rounding(points).max()))

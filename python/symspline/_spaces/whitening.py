"""Congruences that make positive definite matrices well-conditioned before an iteration.

The affine-invariant metric does not change under congruences A → L⁻¹ A L⁻ᴴ, but rounding errors do: they grow with the
condition number, which is large for matrices with entries in mixed units. If L is the Cholesky factor of the average of
the data, the transformed matrices are close to the identity wherever the data are close to each other, independently of
the units. Cholesky factorisation and triangular solves commute with diagonal scaling up to rounding errors.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .._base.arrays import adjoint
from .statistics import Array


class Whitening(NamedTuple):
    """Congruences of positive definite matrices.

    Attributes
    ----------
    factor : ndarray, shape (..., n, n)
        Lower triangular factors L, which broadcast against matrices.
    space : SymmetricPositiveDefinite or HermitianPositiveDefinite
        Space of the transformed matrices. The spaces of special and of symplectic matrices are totally geodesic in it,
        so that their means and medians are the same.
    """

    factor: Array
    space: Any

    def forward(self, points: Array) -> Array:
        """Return L⁻¹ A L⁻ᴴ."""
        half = np.linalg.solve(self.factor, points)
        found = np.linalg.solve(self.factor, adjoint(half))
        return np.asarray((found + adjoint(found)) / 2)

    def back(self, points: Array) -> Array:
        """Return L A Lᴴ."""
        found = self.factor @ points @ adjoint(self.factor)
        return np.asarray((found + adjoint(found)) / 2)

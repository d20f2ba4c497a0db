"""Positive definite matrices: covariances and the like."""

from __future__ import annotations

from .base import Space


class SymmetricPositiveDefinite(Space):
    """Symmetric positive definite n × n matrices with the affine-invariant metric tr p⁻¹u p⁻¹v:
    covariance matrices, diffusion tensors. Errors are rounding times the condition of the matrix.

    >>> import numpy as np, symspline as ss
    >>> ss.SymmetricPositiveDefinite(2).geodesic(np.eye(2), 4 * np.eye(2), 0.5).round(12)
    array([[2., 0.],
           [0., 2.]])
    """

    _name = "spd"

    def __init__(self, n: int) -> None:
        super().__init__(n)


class SpecialPositiveDefinite(Space):
    """Symmetric positive definite n × n matrices of determinant 1, SL(n)/SO(n): the shape of a tensor without its
    size. A totally geodesic part of `SymmetricPositiveDefinite`, with its metric.

    >>> import numpy as np, symspline as ss
    >>> ss.SpecialPositiveDefinite(2).geodesic(np.eye(2), np.diag([4, 0.25]), 0.5).round(12)
    array([[2. , 0. ],
           [0. , 0.5]])
    """

    _name = "sspd"

    def __init__(self, n: int) -> None:
        super().__init__(n)


class HermitianPositiveDefinite(Space):
    """Hermitian positive definite n × n matrices with the affine-invariant metric Re tr p⁻¹u p⁻¹v.

    >>> import symspline as ss
    >>> ss.HermitianPositiveDefinite(2).dim
    4
    """

    _name = "hpd"

    def __init__(self, n: int) -> None:
        super().__init__(n)

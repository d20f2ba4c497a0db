"""Positive definite matrices: covariances and the like."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .._core import ValidationError
from .._typing import ComplexArray, FloatArray, P
from .actions import Congruent, preserves, require
from .base import Array

# Beyond this size random exponents are scaled so that they do not grow with the size: exp of a random symmetric matrix
# has a condition of e^√(8n) and more, and is not positive definite in floating-point numbers from n = 200 on.
_FREE_SIZE = 20


class _PositiveDefinite(Congruent[P]):
    """Matrices whose random points are exponentials."""

    @property
    def _scatter_scale(self) -> float:
        return min(1.0, math.sqrt(_FREE_SIZE / self.point_shape[0]))


class SymmetricPositiveDefinite(_PositiveDefinite[FloatArray]):
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


class SpecialPositiveDefinite(_PositiveDefinite[FloatArray]):
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

    def _require_subgroup(self, g: Array, tol: float) -> None:
        defects = np.abs(np.abs(np.linalg.det(g)) - 1)
        require(self, defects, tol, "|det g| − 1", "Divide g by abs(numpy.linalg.det(g)) ** (1 / n).")


class HermitianPositiveDefinite(_PositiveDefinite[ComplexArray]):
    """Hermitian positive definite n × n matrices with the affine-invariant metric Re tr p⁻¹u p⁻¹v.

    >>> import symspline as ss
    >>> ss.HermitianPositiveDefinite(2).dim
    4
    """

    _name = "hpd"

    def __init__(self, n: int) -> None:
        super().__init__(n)


class Siegel(_PositiveDefinite[FloatArray]):
    """Siegel's upper half space Sp(2n, R)/U(n) of complex symmetric n × n matrices X + iY with positive definite Y:
    points are the symplectic positive definite matrices (Y + XY⁻¹X, XY⁻¹; Y⁻¹X, Y⁻¹) of 2n rows, which
    `symspline.convert.siegel_to_positive_definite` makes. A totally geodesic part of `SymmetricPositiveDefinite`,
    with its metric: distances are √2 times those of Siegel's metric tr Y⁻¹dZ Y⁻¹dZ̄.

    For n = 1 it is the hyperbolic plane with √2 times its distances.

    >>> import numpy as np, symspline as ss
    >>> p, q = ss.convert.siegel_to_positive_definite([[[1j]], [[1 + 2j]]])
    >>> middle = ss.Siegel(1).geodesic(p, q, 0.5)
    >>> ss.convert.positive_definite_to_siegel(middle).round(8)
    array([[0.33333333+1.49071198j]])
    """

    _name = "siegel"

    def __init__(self, n: int) -> None:
        super().__init__(n)

    def _require_subgroup(self, g: Array, tol: float) -> None:
        form = np.kron([[0.0, 1.0], [-1.0, 0.0]], np.eye(self._parameters[0]))
        preserves(self, g, form, tol, "Pass a symplectic matrix: gᵀJg = J, J = (0, 1; −1, 0).")

    def _array(self, value: Any, name: str) -> Array:
        array = super()._array(value, name)
        if np.iscomplexobj(array) and name in ("points", "p", "q"):
            raise ValidationError(
                f"{name} has complex numbers, but points of {self!r} are real matrices of shape {self.point_shape}; "
                "symspline.convert.siegel_to_positive_definite makes them of complex symmetric ones"
            )
        return array

"""Positive definite matrices, such as covariance matrices."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .._base.arrays import adjoint
from .._base.typing import Array, ComplexArray, FloatArray, P
from .._core import ValidationError
from .actions import Congruent, preserves, require
from .statistics import Groups, Whitening, scaled

# Beyond this size, random exponents are scaled so that they do not grow with the size. Otherwise the exponential of a
# random symmetric matrix has a condition number above e^√(8n), and from n = 200 on it is not positive definite in
# floating-point arithmetic.
_FREE_SIZE = 20


class _PositiveDefinite(Congruent[P]):
    """Positive definite matrices, whose random points are exponentials of random matrices."""

    # Whether congruences with any invertible matrix are isometries of the space of all positive definite matrices.
    _is_affine_invariant = True

    def _whitening(self, groups: Groups) -> Whitening | None:
        average = groups.sums(scaled(groups.points, groups.weights)) / groups.sums(groups.weights)[:, None, None]
        return self._whitening_at(average)

    def _whitening_at(self, points: Array) -> Whitening | None:
        if not self._is_affine_invariant:
            return None
        kind = HermitianPositiveDefinite if np.iscomplexobj(points) else SymmetricPositiveDefinite
        return Whitening(np.linalg.cholesky(points), kind(self.point_shape[0]))

    @property
    def _scatter_scale(self) -> float:
        return min(1.0, math.sqrt(_FREE_SIZE / self.point_shape[0]))


class SymmetricPositiveDefinite(_PositiveDefinite[FloatArray]):
    r"""Symmetric positive definite matrices with the affine-invariant metric.

    A point is a symmetric positive definite n × n matrix, such as a covariance matrix or a diffusion tensor.

    Parameters
    ----------
    n : int
        Size of the matrices, at least 1.

    See Also
    --------
    SpecialPositiveDefinite : Matrices of determinant 1.
    HermitianPositiveDefinite : Complex matrices.
    symspline.tensors : Diffusion tensors.

    Notes
    -----
    The metric at p is :math:`\operatorname{tr} p^{-1} u p^{-1} v`, and

    .. math:: \exp_p(v) = p^{1/2} \exp(p^{-1/2} v p^{-1/2})\, p^{1/2}, \qquad
              \log_p(q) = p^{1/2} \log(p^{-1/2} q p^{-1/2})\, p^{1/2}.

    The relative rounding error is proportional to the condition number of a point.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> ss.SymmetricPositiveDefinite(2).geodesic(np.eye(2), 4 * np.eye(2), 0.5).round(12)
    array([[2., 0.],
           [0., 2.]])
    """

    _name = "spd"


class LogEuclidean(_PositiveDefinite[FloatArray]):
    r"""Symmetric positive definite matrices with the log-Euclidean metric.

    A point is a symmetric positive definite n × n matrix. The matrix logarithm is an isometry to the flat space of
    symmetric matrices, so that the spline is the exponential of the cubic spline of the logarithms.

    Parameters
    ----------
    n : int
        Size of the matrices, at least 1.

    See Also
    --------
    SymmetricPositiveDefinite : The same matrices with the affine-invariant metric.
    symspline.tensors : Diffusion tensors.

    Notes
    -----
    The metric at P is that of the derivative of the logarithm, :math:`\lVert D\log_P V \rVert_F`, and
    :math:`\exp_P(V) = \exp(\log P + D\log_P V)` [1]_. Distances are invariant under rotations, scaling and inversion,
    but not under all congruences. Use this space for comparison with software for diffusion tensors;
    `SymmetricPositiveDefinite` does not depend on the choice of coordinates.
    References
    ----------
    .. [1] V. Arsigny, P. Fillard, X. Pennec, N. Ayache, Geometric means in a novel vector space structure on symmetric
       positive-definite matrices, SIAM J. Matrix Anal. Appl. 29 (2007).

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> ss.LogEuclidean(2).geodesic(np.eye(2), 4 * np.eye(2), 0.5).round(12)
    array([[2., 0.],
           [0., 2.]])
    """

    _name = "logspd"
    _is_affine_invariant = False

    def _reflected(self, p: Array, x: Array) -> Any:
        return _function(np.exp, 2 * _function(np.log, p) - _function(np.log, x))

    def _require_subgroup(self, g: Array, tol: float) -> None:
        square = g @ adjoint(g)
        size = np.trace(square, axis1=-2, axis2=-1)[..., None, None] / g.shape[-1]
        defects = np.abs(square / size - np.eye(g.shape[-1])).max(axis=(-2, -1))
        require(self, defects, tol, "|ggᵀ/c − 1|", "Pass a multiple of an orthogonal matrix.")


def _function(f: Any, x: Array) -> Any:
    """Return a function of symmetric matrices."""
    values, vectors = np.linalg.eigh(x)
    return (vectors * f(values)[..., None, :]) @ adjoint(vectors)


class SpecialPositiveDefinite(_PositiveDefinite[FloatArray]):
    """Symmetric positive definite matrices of determinant 1, SL(n)/SO(n).

    A point describes the shape of a tensor without its size. The space is a totally geodesic subspace of
    `SymmetricPositiveDefinite` and has its metric.

    Parameters
    ----------
    n : int
        Size of the matrices, at least 2.

    See Also
    --------
    SymmetricPositiveDefinite : Matrices of any determinant.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> ss.SpecialPositiveDefinite(2).geodesic(np.eye(2), np.diag([4, 0.25]), 0.5).round(12)
    array([[2. , 0. ],
           [0. , 0.5]])
    """

    _name = "sspd"

    def _require_subgroup(self, g: Array, tol: float) -> None:
        defects = np.abs(np.abs(np.linalg.det(g)) - 1)
        require(self, defects, tol, "|det g| − 1", "Divide g by abs(numpy.linalg.det(g)) ** (1 / n).")


class HermitianPositiveDefinite(_PositiveDefinite[ComplexArray]):
    r"""Hermitian positive definite matrices with the affine-invariant metric.

    A point is a Hermitian positive definite n × n matrix.

    Parameters
    ----------
    n : int
        Size of the matrices, at least 1.

    See Also
    --------
    SymmetricPositiveDefinite : Real matrices.

    Notes
    -----
    The metric at p is :math:`\operatorname{Re} \operatorname{tr} p^{-1} u p^{-1} v`.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.HermitianPositiveDefinite(2).dim
    4
    """

    _name = "hpd"


class Siegel(_PositiveDefinite[FloatArray]):
    r"""Siegel's upper half space Sp(2n, ℝ)/U(n).

    The elements of the half space are complex symmetric n × n matrices X + iY with positive definite Y. A point is the
    symplectic positive definite matrix [[Y + XY⁻¹X, XY⁻¹], [Y⁻¹X, Y⁻¹]] of size 2n, which
    `symspline.convert.siegel_to_positive_definite` computes.

    Parameters
    ----------
    n : int
        Size of the complex matrices, at least 1.

    See Also
    --------
    SymmetricPositiveDefinite : The space that contains it.
    Symplectic : The group that acts on it.

    Notes
    -----
    The space is a totally geodesic subspace of `SymmetricPositiveDefinite` and has its metric. Distances
    are :math:`\sqrt2` times those of Siegel's metric :math:`\operatorname{tr} Y^{-1} dZ\, Y^{-1} d\bar Z`. For n = 1 it
    is the hyperbolic plane with distances multiplied by :math:`\sqrt2`.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> p, q = ss.convert.siegel_to_positive_definite([[[1j]], [[1 + 2j]]])
    >>> middle = ss.Siegel(1).geodesic(p, q, 0.5)
    >>> ss.convert.positive_definite_to_siegel(middle).round(8)
    array([[0.33333333+1.49071198j]])
    """

    _name = "siegel"

    def _require_subgroup(self, g: Array, tol: float) -> None:
        form = np.kron([[0.0, 1.0], [-1.0, 0.0]], np.eye(self._parameters[0]))
        preserves(self, g, form, tol, "Pass a symplectic matrix: gᵀJg = J, J = (0, 1; −1, 0).")

    def _array(self, value: Any, name: str) -> Array:
        array = super()._array(value, name)
        if np.iscomplexobj(array) and name in ("points", "p", "q"):
            raise ValidationError(
                f"{name} has complex numbers, but points of {self!r} are real matrices of shape {self.point_shape}; "
                "symspline.convert.siegel_to_positive_definite converts complex symmetric matrices to points"
            )
        return array

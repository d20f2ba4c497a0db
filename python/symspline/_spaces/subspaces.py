"""Projective spaces, complex hyperbolic space and Grassmannians, where several arrays represent one point."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import point_tol
from .._base.typing import Array, ComplexArray, FloatArray, P
from .._core import ValidationError
from .actions import Preserving, largest, require
from .base import LARGE, Space

# Tolerance for recognising density matrices. It only selects the text of an error message, since rows of density
# matrices are not unit vectors.
_NEAR = 1e-4
# Eigenvectors of the mean projection from which a search for the mean starts.
_EIGENVECTORS = 4


class _Projective(Preserving[P]):
    """Projective spaces, whose lines are sometimes given as projection matrices."""

    # The space of positive definite matrices of the same numbers.
    _definite: str

    def _extrinsic_means(self, points: Array, weights: FloatArray) -> Array | None:
        # The first eigenvectors of the mean projection.
        scatter = np.einsum("i,ij,ik->jk", weights, points, points.conj())
        return np.asarray(np.linalg.eigh(scatter)[1][:, ::-1].T[:_EIGENVECTORS])

    def _array(self, value: Any, name: str) -> Array:
        array = super()._array(value, name)
        if name in ("points", "p", "q") and _are_densities(array):
            purity = np.einsum("...ij,...ji->...", array, array).real
            advice = (
                "symspline.convert.density_to_state converts those of pure states"
                if (purity > 1 - _NEAR).all()
                else "mixed states are not represented by vectors. Density matrices of full rank are points of "
                f"{self._definite}({array.shape[-1]}), but curves there do not keep the trace 1"
            )
            raise ValidationError(
                f"{name} has shape {array.shape} and looks like density matrices, Hermitian of trace 1, but points of "
                f"{self!r} are unit vectors; {advice}"
            )
        return array


def _are_densities(array: Array) -> bool:
    """Whether an array consists of Hermitian matrices of trace 1 whose purity does not exceed that of pure states."""
    square = array.ndim > 1 and array.shape[-2] == array.shape[-1] > 1
    if not square or not array.size or array.dtype.kind not in "ifc":
        return False
    flat = array.reshape(-1, *array.shape[-2:])
    return _is_density(flat[:1]) and _is_density(flat)


def _is_density(x: Array) -> bool:
    with np.errstate(all="ignore"):
        skew = np.abs(x - np.swapaxes(x.conj(), -1, -2)).max()
        trace = np.trace(x, axis1=-2, axis2=-1)
        return bool(
            skew < _NEAR
            and (np.abs(trace - 1) < _NEAR).all()
            and ((np.abs(x) ** 2).sum(axis=(-2, -1)) < 1 + _NEAR).all()
        )


class RealProjective(_Projective[FloatArray]):
    """Real projective space ℝPⁿ, the lines through the origin of ℝⁿ⁺¹.

    A point is a unit vector of n + 1 numbers; x and −x are the same point. Distance is the angle between lines, at
    most π/2.

    Parameters
    ----------
    n : int
        Dimension, at least 1.

    See Also
    --------
    Sphere : Unit vectors, where x and −x are different points.
    Grassmannian : Subspaces of any dimension.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.RealProjective(2).distance([1, 0, 0], [-1, 0, 0]).round(8)
    np.float64(0.0)
    """

    _name = "rp"
    _linear = True
    _definite = "SymmetricPositiveDefinite"


class ComplexProjective(_Projective[ComplexArray]):
    r"""Complex projective space ℂPⁿ, the pure quantum states of n + 1 levels.

    A point is a complex unit vector of n + 1 numbers, up to a phase. `symspline.convert.density_to_state` converts
    density matrices of pure states to points. CP¹ is the Bloch sphere, with radius ½.

    Parameters
    ----------
    n : int
        Complex dimension, at least 1.

    See Also
    --------
    ComplexGrassmannian : Complex subspaces of any dimension.
    symspline.quantum : Hamiltonians, pulses and propagators of curves.

    Notes
    -----
    The metric is that of Fubini and Study: the distance is :math:`\arccos |\langle p, q \rangle|`.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.ComplexProjective(1).distance([1, 0], [0.6, 0.8j]).round(8)
    np.float64(0.92729522)
    """

    _name = "cp"
    _linear = True
    _definite = "HermitianPositiveDefinite"


class ComplexHyperbolic(Preserving[ComplexArray]):
    r"""Complex hyperbolic space ℂHⁿ.

    A point is a complex array (z₀, z₁, …, zₙ) with −|z₀|² + |z₁|² + … + |zₙ|² = −1, up to a phase.

    Parameters
    ----------
    n : int
        Complex dimension, at least 1.

    See Also
    --------
    Hyperbolic : Real hyperbolic space.

    Notes
    -----
    The metric has curvature −4 along complex lines: the distance is
    :math:`\operatorname{arcosh} |\langle p, q \rangle|`. CH¹ is the hyperbolic plane with half its distances.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> ss.ComplexHyperbolic(1).distance([1, 0], [np.cosh(2), 1j * np.sinh(2)]).round(8)
    np.float64(2.0)
    """

    _name = "ch"
    _negative = (0,)


class _Subspaces(Preserving[P]):
    """Grassmannians. In large ambient spaces, operations on two points are computed in the span of both."""

    _linear = True

    def __init__(self, k: int, n: int) -> None:
        Space.__init__(self, k, n)

    def _extrinsic_means(self, points: Array, weights: FloatArray) -> Array | None:
        # The first eigenvectors of the mean projection.
        scatter = np.einsum("i,ijl,ikl->jk", weights, points, points.conj())
        return np.asarray(np.linalg.eigh(scatter)[1][:, ::-1][None, :, : self._parameters[0]])

    def _finite(self, operation: str, t: NDArray[np.float64] | None = None, **inputs: ArrayLike) -> Any:
        k, n = self._parameters
        if operation not in ("exp", "log", "geodesic", "distance") or n < LARGE or n <= 2 * k:
            return super()._finite(operation, t, **inputs)
        pair = {name: self._numbers(self._doubles(value, name)) for name, value in inputs.items()}
        lead = self._leads({name: x.shape for name, x in pair.items()})
        p, rest = (np.broadcast_to(x, lead + self.point_shape) for x in pair.values())
        # The second point is p·along + basis·beyond. A second projection removes the rounding errors along p, which
        # matter if the remainder is small.
        along = np.zeros((*lead, k, k), self.dtype)
        with np.errstate(all="ignore"):
            for _ in range(2):
                part = np.swapaxes(p.conj(), -1, -2) @ rest
                along, rest = along + part, rest - p @ part
        basis, beyond = np.linalg.qr(rest)
        rows = (np.broadcast_to(np.eye(k), along.shape), np.zeros_like(along)), (along, beyond)
        coordinates = [np.concatenate(parts, axis=-2) for parts in rows]
        result = type(self)(k, 2 * k)._finite(operation, t, **dict(zip(pair, coordinates, strict=True)))
        return result if operation == "distance" else p @ result[..., :k, :] + basis @ result[..., k:, :]


class Grassmannian(_Subspaces[FloatArray]):
    r"""The Grassmannian Gr(k, n) of k-dimensional subspaces of ℝⁿ.

    A point is an n × k matrix with orthonormal columns, any basis of the subspace.

    Parameters
    ----------
    k : int
        Dimension of the subspaces.
    n : int
        Dimension of the ambient space, greater than k.

    See Also
    --------
    ComplexGrassmannian : Complex subspaces.
    symspline.subspaces : Reduced bases over a parameter.

    Notes
    -----
    The distance is :math:`\sqrt{\sum_i \theta_i^2}` with the principal angles :math:`\theta_i` between two subspaces.
    For a tangent vector with the singular value decomposition :math:`v = U \Theta V^T`,

    .. math:: \exp_p(v) = p V \cos\Theta\, V^T + U \sin\Theta\, V^T.

    Subspaces with a principal angle of a right angle have no unique shortest geodesic.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.Grassmannian(2, 5).dim
    6
    """

    _name = "gr"


class ComplexGrassmannian(_Subspaces[ComplexArray]):
    """The complex Grassmannian of k-dimensional subspaces of ℂⁿ.

    A point is a complex n × k matrix with orthonormal columns, any basis of the subspace.

    Parameters
    ----------
    k : int
        Dimension of the subspaces.
    n : int
        Dimension of the ambient space, greater than k.

    See Also
    --------
    Grassmannian : Real subspaces.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.ComplexGrassmannian(2, 5).dim
    12
    """

    _name = "cgr"


class QuaternionicProjective(Preserving[ComplexArray]):
    r"""Quaternionic projective space ℍPⁿ, the lines of n + 1 quaternions.

    A point is a complex (2n + 2) × 2 matrix with orthonormal columns, any basis of the plane in ℂ²ⁿ⁺² that represents
    the line. `symspline.convert.quaternions_to_subspace` converts vectors of quaternions to points.

    Parameters
    ----------
    n : int
        Quaternionic dimension, at least 1.

    See Also
    --------
    ComplexGrassmannian : The space that contains it.

    Notes
    -----
    The space is a totally geodesic subspace of `ComplexGrassmannian` and has its metric. Distances are
    :math:`\sqrt2` times the angles :math:`\arccos |\langle p, q \rangle|` between lines. :math:`\mathbb{HP}^1` is the
    sphere :math:`S^4` of radius :math:`1/\sqrt2`.

    Examples
    --------
    >>> import symspline as ss
    >>> p, q = ss.convert.quaternions_to_subspace([[[1, 0, 0, 0], [0, 0, 0, 0]], [[0.6, 0, 0, 0], [0, 0, 0.8, 0]]])
    >>> (ss.QuaternionicProjective(1).distance(p, q) / 2**0.5).round(8)
    np.float64(0.92729522)
    """

    _name = "hp"

    def _element(self, g: Any) -> Any:
        g = super()._element(g)
        # Multiplication by the quaternion j is x ↦ J x̄, and matrices of quaternions commute with it.
        j = np.kron(np.eye(self._parameters[0] + 1), [[0.0, -1.0], [1.0, 0.0]])
        remedy = "Pass a matrix of quaternions a + bi + cj + dk as blocks (a + bi, c + di; −c + di, a − bi)."
        require(self, largest(g @ j - j @ g.conj()), point_tol(np.asarray(g)), "|gJ − Jḡ|", remedy)
        return g

    def _array(self, value: Any, name: str) -> Array:
        array = super()._array(value, name)
        lines = (self._parameters[0] + 1, 4)
        if name in ("points", "p", "q") and array.shape[-2:] == lines and not np.iscomplexobj(array):
            raise ValidationError(
                f"{name} has shape {array.shape} and looks like vectors of quaternions, but points of {self!r} are "
                f"complex matrices of shape {self.point_shape}; convert them with "
                "symspline.convert.quaternions_to_subspace"
            )
        return array

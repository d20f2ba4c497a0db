"""Groups of invertible matrices, which have no bi-invariant metric."""

from __future__ import annotations

from .._typing import ComplexArray, FloatArray
from .actions import Group
from .disconnected import DisconnectedGroup


class GeneralLinear(DisconnectedGroup[FloatArray], Group[FloatArray]):
    r"""The general linear group GL(n, ℝ).

    A point is an invertible real n × n matrix. Curves through points of a closed subgroup stay in the subgroup.

    Parameters
    ----------
    n : int
        Size of the matrices, at least 1.

    See Also
    --------
    ComplexGeneralLinear : Invertible complex matrices.
    Affine : Affine maps.
    SpecialLinear : Matrices of determinant 1.

    Notes
    -----
    The geodesic symmetry at p is :math:`x \mapsto p x^{-1} p`. Geodesics are :math:`p \exp(t \Omega)`, and
    :math:`\log_p(q) = p \log(p^{-1} q)` with the principal logarithm, which exists unless :math:`p^{-1} q` has a
    negative eigenvalue. The group has no bi-invariant metric. Lengths are Frobenius norms of :math:`\Omega = p^{-1} v`
    and serve for reporting only. The relative rounding error is proportional to the condition number of a point.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.GeneralLinear(2).log([[1, 0], [0, 1]], [[1, 3], [0, 1]]).round(12)
    array([[0., 3.],
           [0., 0.]])
    """

    _name = "gl"


class ComplexGeneralLinear(Group[ComplexArray]):
    """The complex general linear group GL(n, ℂ).

    A point is an invertible complex n × n matrix. Geodesics and lengths are as in `GeneralLinear`.

    Parameters
    ----------
    n : int
        Size of the matrices, at least 1.

    See Also
    --------
    GeneralLinear : Invertible real matrices.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.ComplexGeneralLinear(2).dim
    8
    """

    _name = "cgl"


class Affine(DisconnectedGroup[FloatArray], Group[FloatArray]):
    """The group of affine maps x ↦ Ax + b.

    A point is a matrix [[A, b], [0, 1]] with an invertible n × n matrix A. Geodesics and lengths are as in
    `GeneralLinear`.

    Parameters
    ----------
    n : int
        Dimension, at least 1.

    See Also
    --------
    GeneralLinear : Invertible real matrices.
    Similarity : Maps that preserve angles.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.Affine(2).point_shape, ss.Affine(2).dim
    ((3, 3), 6)
    """

    _name = "aff"


class Similarity(Group[FloatArray]):
    """The group of similarities x ↦ sRx + b.

    A point is a matrix [[sR, b], [0, 1]] with a rotation R and a scale s > 0, such as a camera pose with a scale that
    drifts. Geodesics and lengths are as in `GeneralLinear`.

    Parameters
    ----------
    n : int
        Dimension, at least 2.

    See Also
    --------
    SpecialEuclidean : Rigid motions, without a scale.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.Similarity(3).dim
    7
    """

    _name = "sim"


class SpecialLinear(Group[FloatArray]):
    """The special linear group SL(n, ℝ).

    A point is a real n × n matrix of determinant 1. For n = 3 these represent homographies of the plane. Geodesics and
    lengths are as in `GeneralLinear`.

    Parameters
    ----------
    n : int
        Size of the matrices, at least 2.

    See Also
    --------
    GeneralLinear : Invertible real matrices.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.SpecialLinear(3).dim
    8
    """

    _name = "sl"


class Symplectic(Group[FloatArray]):
    """The symplectic group Sp(n, ℝ).

    A point is a real n × n matrix X with XᵀJX = J, where J = [[0, 1], [−1, 0]]: a linear canonical transformation of
    n/2 positions and n/2 momenta. Geodesics and lengths are as in `GeneralLinear`.

    Parameters
    ----------
    n : int
        Size of the matrices, even and at least 2.

    See Also
    --------
    GeneralLinear : Invertible real matrices.
    Siegel : Siegel's upper half space, on which the group acts.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.Symplectic(4).dim
    10
    """

    _name = "sp"


class Lorentz(Group[FloatArray]):
    """The Lorentz group SO⁺(1, n).

    A point is a (1 + n) × (1 + n) matrix that preserves −t² + x², the orientation and the direction of time. The first
    coordinate is the time t. Geodesics and lengths are as in `GeneralLinear`.

    Parameters
    ----------
    n : int
        Dimension of space, at least 1.

    See Also
    --------
    GeneralLinear : Invertible real matrices.
    Hyperbolic : Hyperbolic space, on which the group acts.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.space("so:1,3")
    Lorentz(3)
    """

    _name = "lorentz"

"""Groups of invertible matrices, to which no metric belongs."""

from __future__ import annotations

from .._typing import ComplexArray, FloatArray
from .actions import Group
from .disconnected import DisconnectedGroup


class GeneralLinear(DisconnectedGroup[FloatArray], Group[FloatArray]):
    """GL(n), invertible real matrices, with the symmetries x ↦ p x⁻¹ p.

    Geodesics are p exp(tΩ), and ``log(p, q) = p log(p⁻¹q)`` with the principal logarithm, which exists while no
    eigenvalue of p⁻¹q is a negative number. The group has no invariant metric: lengths are those of Ω = p⁻¹v,
    the root of the sum of squares, and serve for reporting only. Curves through points of a closed subgroup stay in
    it. Digits are lost as the condition number of a point has them.

    >>> import symspline as ss
    >>> ss.GeneralLinear(2).log([[1, 0], [0, 1]], [[1, 3], [0, 1]]).round(12)
    array([[0., 3.],
           [0., 0.]])
    """

    _name = "gl"

    def __init__(self, n: int) -> None:
        super().__init__(n)


class ComplexGeneralLinear(Group[ComplexArray]):
    """GL(n, C), invertible complex matrices; see `GeneralLinear`.

    >>> import symspline as ss
    >>> ss.ComplexGeneralLinear(2).dim
    8
    """

    _name = "cgl"

    def __init__(self, n: int) -> None:
        super().__init__(n)


class Affine(DisconnectedGroup[FloatArray], Group[FloatArray]):
    """Affine maps x ↦ Ax + b of n dimensions as matrices (A, b; 0, 1); see `GeneralLinear`.

    >>> import symspline as ss
    >>> ss.Affine(2).point_shape, ss.Affine(2).dim
    ((3, 3), 6)
    """

    _name = "aff"

    def __init__(self, n: int) -> None:
        super().__init__(n)


class Similarity(Group[FloatArray]):
    """Similarities x ↦ sRx + b, with a rotation R and s > 0, as matrices (sR, b; 0, 1): poses whose scale
    drifts. See `GeneralLinear`.

    >>> import symspline as ss
    >>> ss.Similarity(3).dim
    7
    """

    _name = "sim"

    def __init__(self, n: int) -> None:
        super().__init__(n)


class SpecialLinear(Group[FloatArray]):
    """SL(n), real matrices of determinant one: homographies of the plane for n = 3. See `GeneralLinear`.

    >>> import symspline as ss
    >>> ss.SpecialLinear(3).dim
    8
    """

    _name = "sl"

    def __init__(self, n: int) -> None:
        super().__init__(n)


class Symplectic(Group[FloatArray]):
    """Sp(n, R), real n × n matrices with XᵀJX = J for J = (0, 1; -1, 0), n even: linear canonical transformations of
    n/2 positions and n/2 momenta. See `GeneralLinear`.

    >>> import symspline as ss
    >>> ss.Symplectic(4).dim
    10
    """

    _name = "sp"

    def __init__(self, n: int) -> None:
        super().__init__(n)


class Lorentz(Group[FloatArray]):
    """The Lorentz group of n dimensions of space, SO⁺(1, n): (1 + n) × (1 + n) matrices that preserve -t² + x², the
    orientation and the direction of time, which is the first coordinate. See `GeneralLinear`.

    >>> import symspline as ss
    >>> ss.space("so:1,3")
    Lorentz(3)
    """

    _name = "lorentz"

    def __init__(self, n: int) -> None:
        super().__init__(n)

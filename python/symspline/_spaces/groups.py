"""Groups of matrices: rotations, unitary matrices and rigid motions."""

from __future__ import annotations

from typing import Any

from .._typing import ComplexArray, FloatArray
from .actions import Group
from .base import Array
from .disconnected import DisconnectedGroup


class SpecialOrthogonal(Group[FloatArray]):
    """Rotations of n dimensions: orthogonal n × n matrices of determinant 1, with ⟨u, v⟩ = ½ tr uᵀv.
    In SO(3) distance is the angle of the rotation from one to the other, and a SciPy ``Rotation`` of any shape,
    or a list of them, is taken wherever points are.

    >>> import numpy as np, symspline as ss
    >>> quarter = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    >>> ss.SpecialOrthogonal(3).distance(np.eye(3), quarter).round(8)
    np.float64(1.57079633)
    """

    _name = "so"
    _unitary = True

    def __init__(self, n: int) -> None:
        super().__init__(n)

    def _array(self, value: Any, name: str) -> Array:
        return super()._array(_matrices(value) if self.point_shape == (3, 3) else value, name)


def _matrices(value: Any) -> Any:
    """The matrices of a `scipy.spatial.transform.Rotation` or of a list of them, known by their method ``as_matrix``,
    so that SciPy need not be there; any other value as it is."""
    if hasattr(value, "as_matrix"):
        return value.as_matrix()
    if isinstance(value, (list, tuple)) and any(hasattr(part, "as_matrix") for part in value):
        return [_matrices(part) for part in value]
    return value


class Orthogonal(DisconnectedGroup[FloatArray], Group[FloatArray]):
    """Orthogonal n × n matrices, rotations and reflections, with ⟨u, v⟩ = ½ tr uᵀv. A curve stays in one
    of the two parts.

    >>> import symspline as ss
    >>> ss.Orthogonal(2).dim
    1
    """

    _name = "o"
    _unitary = True

    def __init__(self, n: int) -> None:
        super().__init__(n)


class SpecialUnitary(Group[ComplexArray]):
    """Unitary n × n matrices of determinant 1, with ⟨u, v⟩ = Re tr u*v.

    >>> import symspline as ss
    >>> ss.SpecialUnitary(2).dim
    3
    """

    _name = "su"
    _unitary = True

    def __init__(self, n: int) -> None:
        super().__init__(n)


class Unitary(Group[ComplexArray]):
    """Unitary n × n matrices, with ⟨u, v⟩ = Re tr u*v.

    >>> import symspline as ss
    >>> ss.Unitary(1).distance([[1]], [[1j]]).round(8)
    np.float64(1.57079633)
    """

    _name = "u"
    _unitary = True

    def __init__(self, n: int) -> None:
        super().__init__(n)


class SpecialEuclidean(Group[FloatArray]):
    """Rigid motions of n = 2 or 3 dimensions, poses: homogeneous (n+1) × (n+1) matrices [[R, t], [0, 1]].

    Geodesics are screw motions g exp(tξ). The group has no invariant metric: lengths are those of
    (ω, v) = g⁻¹u, the rates in the body, and serve for reporting only. For positions that move
    independently of the rotation use ``Product(SpecialOrthogonal(3), Euclidean(3))``.

    The covariant acceleration of a curve (``nu=2``) is that of the group's connection: its last column is ẍ − ω × ẋ
    with the angular velocity ω in the world, and not ẍ. A body that turns with its path along a circle has 0 there.
    `symspline.poses.linear_acceleration` gives ẍ.

    >>> import symspline as ss
    >>> ss.SpecialEuclidean(3).point_shape
    (4, 4)
    """

    _name = "se"

    def __init__(self, n: int) -> None:
        super().__init__(n)

"""Compact groups of matrices, and rigid motions."""

from __future__ import annotations

from typing import Any

from .._typing import ComplexArray, FloatArray
from .actions import Group
from .base import Array
from .disconnected import DisconnectedGroup


class SpecialOrthogonal(Group[FloatArray]):
    r"""The rotation group SO(n).

    A point is an orthogonal n × n matrix of determinant 1. In SO(3), distance is the angle of the rotation from one
    point to the other, and a SciPy ``Rotation`` of any shape, or a list of them, is accepted wherever points are.

    Parameters
    ----------
    n : int
        Size of the matrices, at least 2.

    See Also
    --------
    Orthogonal : Rotations and reflections.
    SpecialEuclidean : Rigid motions.
    symspline.rotations : Angular velocities, quaternions and rotation vectors.

    Notes
    -----
    The metric is :math:`\langle u, v \rangle = \tfrac12 \operatorname{tr} u^T v`.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> quarter = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    >>> ss.SpecialOrthogonal(3).distance(np.eye(3), quarter).round(8)
    np.float64(1.57079633)
    """

    _name = "so"
    _unitary = True

    def _array(self, value: Any, name: str) -> Array:
        return super()._array(_matrices(value) if self.point_shape == (3, 3) else value, name)


def _matrices(value: Any) -> Any:
    """Return the matrices of a SciPy ``Rotation`` or of a list of them; any other value is returned unchanged.

    Rotations are recognised by their method ``as_matrix``, so that SciPy need not be installed.
    """
    if hasattr(value, "as_matrix"):
        return value.as_matrix()
    if isinstance(value, (list, tuple)) and any(hasattr(part, "as_matrix") for part in value):
        return [_matrices(part) for part in value]
    return value


class Orthogonal(DisconnectedGroup[FloatArray], Group[FloatArray]):
    r"""The orthogonal group O(n).

    A point is an orthogonal n × n matrix, a rotation or a reflection. The group has two components, and a curve stays
    in one of them.

    Parameters
    ----------
    n : int
        Size of the matrices, at least 2.

    See Also
    --------
    SpecialOrthogonal : Rotations only.

    Notes
    -----
    The metric is :math:`\langle u, v \rangle = \tfrac12 \operatorname{tr} u^T v`.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.Orthogonal(2).dim
    1
    """

    _name = "o"
    _unitary = True


class SpecialUnitary(Group[ComplexArray]):
    r"""The special unitary group SU(n).

    A point is a unitary n × n matrix of determinant 1, such as a quantum gate without a global phase.

    Parameters
    ----------
    n : int
        Size of the matrices, at least 2.

    See Also
    --------
    Unitary : Unitary matrices of any determinant.

    Notes
    -----
    The metric is :math:`\langle u, v \rangle = \operatorname{Re} \operatorname{tr} u^* v`.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.SpecialUnitary(2).dim
    3
    """

    _name = "su"
    _unitary = True


class Unitary(Group[ComplexArray]):
    r"""The unitary group U(n).

    A point is a unitary n × n matrix.

    Parameters
    ----------
    n : int
        Size of the matrices, at least 1.

    See Also
    --------
    SpecialUnitary : Unitary matrices of determinant 1.

    Notes
    -----
    The metric is :math:`\langle u, v \rangle = \operatorname{Re} \operatorname{tr} u^* v`.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.Unitary(1).distance([[1]], [[1j]]).round(8)
    np.float64(1.57079633)
    """

    _name = "u"
    _unitary = True


class SpecialEuclidean(Group[FloatArray]):
    r"""The group SE(n) of rigid motions, or poses.

    A point is a homogeneous (n + 1) × (n + 1) matrix [[R, t], [0, 1]]. Geodesics are screw motions. For positions that
    move independently of the rotation, use ``Product(SpecialOrthogonal(3), Euclidean(3))``.

    Parameters
    ----------
    n : {2, 3}
        Dimension of the space in which the body moves.

    See Also
    --------
    SpecialOrthogonal : Rotations.
    Similarity : Poses with a scale.
    symspline.poses : Velocities, accelerations and files of poses.

    Notes
    -----
    Geodesics are :math:`g \exp(t \xi)`. The group has no bi-invariant metric. Lengths are those of the body rates
    :math:`(\omega, v) = g^{-1} u` and serve for reporting only.

    The covariant acceleration of a curve (``nu=2``) belongs to the connection of the group. Its last column is
    :math:`\ddot x - \omega \times \dot x` with the angular velocity ω in the world frame, not :math:`\ddot x`. It is
    zero for a body that turns with its path along a circle. `symspline.poses.linear_acceleration` returns :math:`\ddot
    x`.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.SpecialEuclidean(3).point_shape
    (4, 4)
    """

    _name = "se"

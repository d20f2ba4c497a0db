"""Groups of matrices: compact ones, rigid motions, and groups of invertible matrices."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._base.angles import matrices_of_quaternions
from .._base.arrays import point_tol, refuse
from .._base.typing import Array, ComplexArray, FloatArray, PointsLike
from .._core import ValidationError
from .actions import DisconnectedGroup, Group
from .statistics import Groups, karcher_mean, scaled


class SpecialOrthogonal(Group[FloatArray]):
    r"""The rotation group SO(n).

    A point is an orthogonal n × n matrix of determinant 1. In SO(3), distance is the angle of the rotation from one
    point to the other. A SciPy ``Rotation`` or orix ``Orientation`` of any shape, or a list of them, is accepted
    wherever points are.

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
    The metric is :math:`\langle u, v \rangle = \tfrac12 \operatorname{tr} u^T v`, and

    .. math:: \exp_p(v) = p \exp(p^{-1} v), \qquad \log_p(q) = p \log(p^{-1} q).

    Rotations that differ by a half turn have no unique shortest geodesic.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> quarter = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    >>> ss.SpecialOrthogonal(3).distance(np.eye(3), quarter).round(8)
    np.float64(1.57079633)
    """

    _name = "so"
    _unitary = True

    def _extrinsic_means(self, points: Array, weights: FloatArray) -> Array | None:
        return np.tensordot(weights, points, 1)[None]

    def _array(self, value: Any, name: str) -> Array:
        convertible = type(value) is not np.ndarray and self._point_shape == (3, 3)
        return super()._array(_matrices(value) if convertible else value, name)

    def _conversion(self, shape: tuple[int, ...], name: str) -> str:
        if self.point_shape != (3, 3):
            return ""
        if shape[-2:] == (4, 4) and len(shape) > 2:
            return ". symspline.poses.split(poses) returns the rotations and positions of poses."
        if shape[-1:] == (4,):
            return ". symspline.rotations.from_quaternions converts quaternions to rotations."
        if shape[-1:] != (3,):
            return ""
        if names_points(name):
            return ". symspline.rotations.from_rotation_vectors converts rotation vectors to rotations."
        return ". symspline.rotations.velocities(rotations, rates) converts angular velocities to tangent vectors."


# Tolerance for rounding errors in the last row of a pose.
_LAST_ROW = 1e-6


def names_points(name: str) -> bool:
    """Whether an argument with this name contains points, not tangent vectors. Measurements have points `y`."""
    return name in ("points", "p", "q") or name.endswith(".y")


def _are_rotations(value: object) -> bool:
    return hasattr(value, "as_matrix") or hasattr(value, "improper")


def _matrices(value: Any) -> Any:
    """Return the matrices of rotations or poses, or of a list of them; other values are returned unchanged.

    Objects of SciPy are recognised by their method ``as_matrix`` and those of orix by their attribute ``improper``, so
    that neither need be installed.
    """
    if hasattr(value, "as_matrix"):
        return value.as_matrix()
    if _are_rotations(value):
        improper = np.argwhere(value.improper)
        if len(improper):
            raise ValidationError(
                f"rotation {improper[0].tolist()} is improper, a rotation followed by the inversion, but points of "
                "so:3 are rotations. Remove improper rotations."
            )
        return matrices_of_quaternions(value.data)
    if isinstance(value, (list, tuple)) and any(map(_are_rotations, value)):
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
    move independently of the rotation, use ``Product(SpecialOrthogonal(3), Euclidean(3))``. A SciPy
    ``RigidTransform`` of any shape, or a list of them, is accepted wherever points of SE(3) are, and
    ``RigidTransform.from_matrix`` converts points back.

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

    def _first_means(self, groups: Groups) -> Array:
        # The map to the rotation is a homomorphism, so that the rotation of a barycentre is a barycentre of rotations.
        first: Array = super()._first_means(groups)
        n = self.point_shape[0] - 1
        turns = np.ascontiguousarray(groups.points[:, :n, :n])
        apart = np.linalg.norm(turns - groups.spread(first[:, :n, :n]), axis=(1, 2))
        if apart.max() < 1:
            # All rotations are within an eighth of a turn of each other, so that any start is good.
            return first
        first[:, :n, :n] = karcher_mean(SpecialOrthogonal(n), groups._replace(points=turns))
        moved = groups.sums(scaled(groups.points[:, :n, n], groups.weights))
        first[:, :n, n] = moved / groups.sums(groups.weights)[:, None]
        return first

    def _array(self, value: Any, name: str) -> Array:
        if self.point_shape == (4, 4):
            if isinstance(value, tuple) and len(value) == 2 and _are_parts(*value):
                raise ValidationError(
                    f"{name} is a pair of rotations and positions, but points of {self!r} are 4 × 4 matrices. "
                    "symspline.poses.join(rotations, positions) returns them, and curves on so:3 x r:3 accept the pair."
                )
            value = _matrices(value)
        return super()._array(value, name)

    def _tol(self, array: Array) -> float:
        # Positions may have any accuracy.
        n = self.point_shape[0] - 1
        return point_tol(array[..., :n, :n], n * n)

    def _conversion(self, shape: tuple[int, ...], name: str) -> str:
        if self.point_shape != (4, 4):
            return ""
        if shape[-1:] == (7,):
            return (
                ". symspline.poses.join(rotations, positions) returns poses, and "
                "symspline.rotations.from_quaternions converts quaternions to rotations."
            )
        if shape[-2:] == (3, 3):
            return ". symspline.poses.join(rotations, positions) returns poses; curves of rotations are on so:3."
        if shape[-1:] == (6,) and not names_points(name):
            return ". symspline.poses.velocities(poses, twists) converts twists to tangent vectors."
        return ""


def nearest_rotations(matrices: Array) -> Array:
    """Return the rotations R with the largest trace of RᵀB for matrices B."""
    u, _, v = np.linalg.svd(matrices)
    u[..., -1] *= np.where(np.linalg.det(u) * np.linalg.det(v) < 0, -1.0, 1.0)[..., None]
    return np.asarray(u @ v)


def rotations_and_positions(poses: object, name: str) -> tuple[Array, Array]:
    """Split poses, shape (..., 4, 4), into rotations and positions.

    Raises
    ------
    ValidationError
        If the last row of a pose is not (0, 0, 0, 1).
    """
    g = SpecialEuclidean(3)._array(poses, name)
    if g.shape[-2:] != (4, 4):
        raise ValidationError(f"{name} must have shape (..., 4, 4), not {g.shape}")
    last = g[..., 3, :]
    # Poses in gaps of a recording are NaN.
    wrong = ~np.isnan(last).any(axis=-1) & ~(np.abs(last - [0, 0, 0, 1]) <= _LAST_ROW).all(axis=-1)

    def described(i: Any) -> str:
        remedy = f"The last row of a pose [[R, x], [0, 1]] is (0, 0, 0, 1). Check {name}."
        if np.allclose(g[i][:3, 3], 0) and np.isclose(last[i][3], 1):
            remedy = f"The poses look transposed: pass np.swapaxes({name}, -1, -2)."
        elif np.allclose(last[i][:3], 0):
            remedy = f"Divide homogeneous matrices by their last entry: {name} / {name}[..., 3:, 3:]."
        return f"has the last row {np.round(last[i], 6).tolist()}, not (0, 0, 0, 1). {remedy}"

    refuse(np.asarray(wrong), name or "poses", described)
    return g[..., :3, :3].copy(), g[..., :3, 3].copy()


def _are_parts(rotations: PointsLike, positions: object) -> bool:
    """Whether the first of two values looks like rotations or quaternions, and the second like positions."""
    first, second = _shape(rotations), _shape(positions)
    turns = _are_rotations(rotations) or first[-2:] == (3, 3) or first[-1:] == (4,)
    return turns and second[-1:] == (3,)


def _shape(value: Any) -> tuple[int, ...]:
    """Return the shape of a value, or () if it has none."""
    try:
        return tuple(np.shape(value))
    except (TypeError, ValueError, RuntimeError):
        return ()


# ---- groups of invertible matrices, which have no bi-invariant metric ----


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

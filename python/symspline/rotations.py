"""Curves of rotations in the words of those who turn things: angular velocity, quaternions without jumps of
sign, rotation vectors, six numbers.

Rotations take vectors of the body to the world, as the matrices of SciPy's ``Rotation`` do. Points may be given as
such a ``Rotation`` or as matrices of shape (..., 3, 3); curves are on ``so:3``, on ``se:3``, or on a product with one
of them, such as ``so:3 x r:3``.

>>> import numpy as np, symspline as ss
>>> from symspline import rotations
>>> turning = rotations.from_rotation_vectors([[0, 0, 0], [0, 0, 1], [0, 0, 2.0]])
>>> spline = ss.CubicSpline([0, 1, 2], turning, "so:3")
>>> rotations.angular_velocity(spline, 0.5).round(12) + 0.0
array([0., 0., 1.])
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from ._core import ValidationError
from .arrays import shown
from .convert import matrix_to_quaternion, quaternion_to_matrix
from .convert.quaternions import checked_order
from .convert.reading import length, real_numbers, refuse
from .curves.curve import Curve, Doubles
from .curves.fit import curve_of
from .hermite import HermiteSpline
from .piecewise import check_curve, evaluated
from .spaces import Array, SpecialEuclidean, SpecialOrthogonal, Sphere
from .spline import CubicSpline

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = [
    "angular_acceleration",
    "angular_velocity",
    "as_quaternions",
    "as_rotation_vectors",
    "as_six_numbers",
    "from_quaternions",
    "from_rotation_vectors",
    "from_six_numbers",
    "quaternion",
    "rotation",
    "velocities",
]

Spline = CubicSpline | HermiteSpline

_SO3, _SE3, _S3 = SpecialOrthogonal(3), SpecialEuclidean(3), Sphere(3)
_FRAMES = ("body", "world")
_SIX = ("columns", "rows", "interleaved")
# Two of the six numbers' vectors that are closer to parallel than this have no third in single precision.
_PARALLEL = 1e-6
# Curves made of others, whose making goes over all knots: the rotations of poses, and the curves on S³ above curves
# on SO(3).
_ATTITUDES: WeakKeyDictionary[Curve, Curve] = WeakKeyDictionary()
_LIFTS: WeakKeyDictionary[Curve, Curve] = WeakKeyDictionary()


# ---- along a curve ----


def rotation(
    spline: Spline, x: ArrayLike, *, extrapolate: bool | str | None = None, per_curve: bool = False
) -> Rotation:
    """The rotations at times x as SciPy's ``Rotation``.

    Args:
        spline: a curve on ``so:3``, ``se:3``, or a product with one of them.
        x, extrapolate, per_curve: as for calling the spline.

    Returns:
        A ``Rotation`` of shape batch axes + x.shape; SciPy before 1.17 has only those of one axis or none.

    Raises:
        ImportError: SciPy is not installed.
    """
    try:
        from scipy.spatial.transform import Rotation
    except ImportError:
        raise ImportError(
            "rotation gives back a Rotation of SciPy; install it with: pip install scipy"
        ) from None
    found: Rotation = Rotation.from_matrix(_at(spline, x, "point", extrapolate, per_curve))
    return found


def angular_velocity(
    spline: Spline,
    x: ArrayLike,
    frame: str = "body",
    *,
    extrapolate: bool | str | None = None,
    per_curve: bool = False,
) -> Array:
    """The angular velocity ω at times x: R' = R ω̂ in the frame of the body, what a gyroscope there measures.

    Args:
        spline: a curve on ``so:3``, ``se:3``, or a product with one of them.
        x, extrapolate, per_curve: as for calling the spline.
        frame: ``"body"`` for ω, as SciPy's ``RotationSpline(t, R)(x, 1)``, or ``"world"`` for Rω.

    Returns:
        Radians per unit of time (per second for dates), shape batch axes + x.shape + (3,).

    Raises:
        ValidationError: the spline has no rotation, or ``frame`` is another word.
    """
    return _rate(spline, x, "velocity", frame, extrapolate, per_curve)


def angular_acceleration(
    spline: Spline,
    x: ArrayLike,
    frame: str = "body",
    *,
    extrapolate: bool | str | None = None,
    per_curve: bool = False,
) -> Array:
    """The angular acceleration at times x: ω' in the frame of the body, (Rω)' = Rω' in the world; continuous.

    Args and errors are those of `angular_velocity`; ``RotationSpline(t, R)(x, 2)`` is that of the body.

    Returns:
        Radians per unit of time squared, shape batch axes + x.shape + (3,).
    """
    return _rate(spline, x, "acceleration", frame, extrapolate, per_curve)


def quaternion(
    spline: Spline,
    x: ArrayLike,
    *,
    scalar_first: bool | None = None,
    extrapolate: bool | str | None = None,
    per_curve: bool = False,
) -> Array:
    """Unit quaternions at times x that never jump from q to −q: one continuous curve on S³.

    It begins at the quaternion of the first point whose scalar part is not negative. After a closed curve it may
    be at −q where it was at q, and a time then has the quaternion of its own turn.

    Args:
        spline: a curve on ``so:3``, ``se:3``, or a product with one of them.
        x, extrapolate, per_curve: as for calling the spline.
        scalar_first: True for (w, x, y, z), False for (x, y, z, w) as in SciPy and ROS. It must be given.

    Returns:
        Shape batch axes + x.shape + (4,). The first call also goes over all knots.

    >>> import numpy as np, symspline as ss
    >>> turns = ss.CubicSpline(None, from_rotation_vectors([[0, 0, i] for i in range(8)]), "so:3")
    >>> quaternion(turns, [0, 2 * np.pi], scalar_first=True).round(8) + 0.0
    array([[ 1.,  0.,  0.,  0.],
           [-1.,  0.,  0.,  0.]])
    """
    first = checked_order(scalar_first)
    curve = _lift(attitude(spline))
    where = spline._where(extrapolate)
    ends = curve.points[..., 0, :], curve.points[..., -1, :]
    if where == "periodic" and np.any(_dot(*ends) < 0):
        times, per_curve = spline._clock.at(x, curve.batch, per_curve, curve.times)
        times, turns = _wrapped(curve, times, per_curve)
        q = curve.evaluate(times, "point", "raise", True)
        flipped = (_dot(*ends) < 0).reshape(curve.batch + (1,) * (turns.ndim - len(curve.batch)))
        q = np.where((flipped & (turns % 2 == 1))[..., None], -q, q)
    else:
        q = evaluated(curve, spline._clock, x, "point", where, per_curve, None)
    return q if first else np.roll(q, -1, axis=-1)


def velocities(rotations: ArrayLike | Rotation, rates: ArrayLike, frame: str = "body") -> Array:
    """The velocities R ω̂ of rotations that turn with angular velocities, as a `symspline.HermiteSpline` or an end takes
    them; what `angular_velocity` makes of a curve, backwards.

    Args:
        rotations: points of ``so:3``, shape (..., 3, 3), or a SciPy ``Rotation``.
        rates: angular velocities, radians per unit of time, shape (..., 3).
        frame: ``"body"`` for rates as a gyroscope measures them, or ``"world"``.

    Returns:
        Tangent vectors at the rotations, shape (..., 3, 3).

    >>> velocities(np.eye(3), [0, 0, 2])
    array([[ 0., -2.,  0.],
           [ 2.,  0.,  0.],
           [ 0.,  0.,  0.]])
    """
    check_frame(frame)
    r, hat = _given(rotations), _hat(real_numbers(rates, "rates", (3,))[0])
    _SO3.check_point(r)
    return (r @ hat if frame == "body" else hat @ r) + 0.0


def attitude(spline: Spline) -> Curve:
    """The curve of the rotations alone, on SO(3).

    Raises:
        ValidationError: the spline has none, or several.
    """
    check_curve(spline)
    found = [part for part in spline._curve.parts if part.space in (_SO3, _SE3)]
    if len(found) != 1:
        raise ValidationError(
            f"a curve of rotations is on so:3, se:3, or a product with one of them, not on {spline.space}; quaternions "
            "become points of so:3 by symspline.rotations.from_quaternions"
        )
    curve = found[0]
    if curve.space == _SO3:
        return curve
    if curve not in _ATTITUDES:
        # The rotation of a screw motion is a geodesic of SO(3), and so the control points are those of its curve.
        parts = [np.ascontiguousarray(array[..., :3, :3]) for array in (curve.points, curve.velocities)]
        _ATTITUDES[curve] = curve_of(_SO3, curve.times, [(parts[0], parts[1])], fitted=False)
    return _ATTITUDES[curve]


def check_frame(frame: Any) -> None:
    """Raise ValidationError unless it is one of the two words."""
    if not isinstance(frame, str) or frame not in _FRAMES:
        raise ValidationError(f"frame must be 'body' or 'world', not {shown(frame)}")


def _at(spline: Spline, x: ArrayLike, quantity: str, extrapolate: Any, per_curve: bool) -> Array:
    curve, where = attitude(spline), spline._where(extrapolate)
    values: Array = evaluated(curve, spline._clock, x, quantity, where, per_curve, None)
    return values


def _rate(
    spline: Spline, x: ArrayLike, quantity: str, frame: str, extrapolate: Any, per_curve: bool
) -> Array:
    """The body's angular velocity or acceleration, turned into the frame."""
    check_frame(frame)
    body = _at(spline, x, f"body {quantity}", extrapolate, per_curve)
    return body if frame == "body" else turned(_at(spline, x, "point", extrapolate, per_curve), body)


def _vee(r: Array, d: Array) -> Array:
    """The vector of RᵀD, the half difference of its entries across the diagonal."""
    after, before = [1, 2, 0], [2, 0, 1]
    result: Array = (r[..., before] * d[..., after] - r[..., after] * d[..., before]).sum(axis=-2) / 2
    return result


def turned(r: Array, v: Array) -> Array:
    """Rv for matrices and vectors."""
    result: Array = np.einsum("...ij,...j->...i", r, v)
    return result


def _dot(p: Array, q: Array) -> Array:
    result: Array = (p * q).sum(axis=-1)
    return result


def _lift(curve: Curve) -> Curve:
    """The curve on S³ above a curve on SO(3).

    The Bézier segments of the one are above those of the other, where neighbouring control points are less than
    half a turn apart: from those quaternions follow the signs at the knots.
    """
    if curve not in _LIFTS:
        _LIFTS[curve] = _lifted(curve)
    return _LIFTS[curve]


def _lifted(curve: Curve) -> Curve:
    q = matrix_to_quaternion(curve.points, scalar_first=True)
    # q' = ½ q (0, ω), and so half the velocity of the rotation in the frame that q makes.
    rate = _velocity_above(q, curve)
    control = _above(curve, q, rate).control_points()
    changes = np.where(_dot(control[..., 1, :], control[..., 2, :]) < 0, -1.0, 1.0)
    signs = np.ones((*q.shape[:-1], 1))
    np.cumprod(changes, axis=-1, out=signs[..., 1:, 0])
    return _above(curve, signs * q, signs * rate)


def _above(curve: Curve, q: Array, velocities: Array) -> Curve:
    """A curve on S³ with the times of another."""
    # The core reads memory in order.
    pair = np.ascontiguousarray(q), np.ascontiguousarray(velocities)
    return curve_of(_S3, curve.times, [pair], fitted=False)


def _velocity_above(q: Array, curve: Curve) -> Array:
    """½ q (0, ω), scalar first, for the velocities R ω̂ of a curve at the quaternions q of its points R."""
    omega = _vee(curve.points, curve.velocities)
    w, v = q[..., :1], q[..., 1:]
    return np.concatenate([-_dot(v, omega)[..., None], w * omega + np.cross(v, omega)], axis=-1) / 2


def _wrapped(curve: Curve, times: Doubles, per_curve: bool) -> tuple[Doubles, Doubles]:
    """Times moved into the knots by whole periods, with the batch axes, and by how many."""
    batch = curve.batch
    own = times.shape[len(batch) :] if per_curve else times.shape
    times = np.broadcast_to(times, batch + own)
    knots = np.broadcast_to(curve.times, (*batch, curve.times.shape[-1]))
    start, end = (knots[..., i].reshape(batch + (1,) * len(own)) for i in (0, -1))
    turns = np.floor((times - start) / (end - start))
    return np.clip(times - turns * (end - start), start, end), turns


# ---- other forms of rotations ----


def as_quaternions(rotations: ArrayLike | Rotation, *, scalar_first: bool | None = None) -> Array:
    """The unit quaternions of rotations, each with a scalar part that is not negative.

    For those along a curve, without jumps of sign, see `quaternion`.

    Args:
        rotations: points of ``so:3``, shape (..., 3, 3), or a SciPy ``Rotation``.
        scalar_first: True for (w, x, y, z), False for (x, y, z, w) as in SciPy and ROS. It must be given.

    Returns:
        Shape (..., 4).

    >>> as_quaternions([[0, -1, 0], [1, 0, 0], [0, 0, 1]], scalar_first=False).round(8)
    array([0.        , 0.        , 0.70710678, 0.70710678])
    """
    return matrix_to_quaternion(_given(rotations), scalar_first=scalar_first)


def from_quaternions(
    quaternions: ArrayLike, *, scalar_first: bool | None = None, atol: float | None = None
) -> Array:
    """The rotations of unit quaternions: q and −q are the same one.

    Args:
        quaternions: unit vectors, shape (..., 4).
        scalar_first: True for (w, x, y, z), False for (x, y, z, w) as in SciPy and ROS. It must be given.
        atol: how far from 1 lengths may be, such as 1e-5 for numbers of six decimals; None for 1e-8 of doubles.

    Returns:
        Points of ``so:3``, shape (..., 3, 3).
    """
    return quaternion_to_matrix(quaternions, scalar_first=scalar_first, atol=atol)


def as_rotation_vectors(rotations: ArrayLike | Rotation) -> Array:
    """Axis times angle in radians, the angle from 0 to π, shape (..., 3).

    >>> as_rotation_vectors([[0, -1, 0], [1, 0, 0], [0, 0, 1]]).round(8)
    array([0.        , 0.        , 1.57079633])
    """
    q = as_quaternions(rotations, scalar_first=True)
    w, v = q[..., 0], q[..., 1:]
    sine = length(v)
    # angle / sin(angle/2); of no turn v is zero, and any number does.
    factor = 2 * np.arctan2(sine, w) / np.where(sine > 0, sine, 1)
    result: Array = factor[..., None] * v
    return result


def from_rotation_vectors(vectors: ArrayLike) -> Array:
    """Rotations from axis times angle in radians, shape (..., 3), as points of ``so:3``, shape (..., 3, 3).

    >>> from_rotation_vectors([0, 0, np.pi / 2]).round(8) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    return _SO3.exp(np.eye(3), _hat(real_numbers(vectors, "vectors", (3,))[0]))


def as_six_numbers(rotations: ArrayLike | Rotation, *, order: str | None = None) -> Array:
    """The six numbers of machine learning, continuous over all rotations: two columns, or rows, of the matrix.

    Source: Zhou, Barnes, Lu, Yang & Li, On the Continuity of Rotation Representations in Neural Networks (CVPR
    2019).

    Args:
        rotations: points of ``so:3``, shape (..., 3, 3), or a SciPy ``Rotation``.
        order: ``"columns"`` for the first column and then the second, as in the paper; ``"rows"`` for the first two
            rows, as in PyTorch3D; ``"interleaved"`` for the 3 × 2 matrix of the two columns row by row, as in SPIN.
            It must be given.

    Returns:
        Shape (..., 6).

    >>> as_six_numbers([[0, -1, 0], [1, 0, 0], [0, 0, 1]], order="columns")
    array([ 0.,  1.,  0., -1.,  0.,  0.])
    """
    _check_six(order)
    given = _given(rotations)
    _SO3.check_point(given)
    r = np.asarray(given, dtype=float)
    six = r[..., :2, :] if order == "rows" else r[..., :2] if order == "interleaved" else _swapped(r[..., :2])
    return six.reshape(*r.shape[:-2], 6)


def from_six_numbers(numbers: ArrayLike, *, order: str | None = None) -> Array:
    """The rotations that six numbers of any network stand for, by Gram and Schmidt (Zhou et al. 2019, (15)).

    Args:
        numbers: two vectors of any length that are not parallel, shape (..., 6).
        order: as for `as_six_numbers`. It must be given.

    Returns:
        Points of ``so:3``, shape (..., 3, 3).

    Raises:
        ValidationError: a vector is zero, or the two are parallel.

    >>> from_six_numbers([2, 0, 0, 1, 1, 0], order="columns")
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    _check_six(order)
    six, _ = real_numbers(numbers, "numbers", (6,))
    two = six.reshape(*six.shape[:-1], *((3, 2) if order == "interleaved" else (2, 3)))
    a, b = np.moveaxis(two, -1 if order == "interleaved" else -2, 0)
    sizes = length(a), length(b)
    with np.errstate(invalid="ignore", divide="ignore"):
        first, second = a / sizes[0][..., None], b / sizes[1][..., None]
        second = second - _dot(first, second)[..., None] * first
        sine = length(second)
        refuse(
            ~(sine > _PARALLEL),
            "numbers",
            lambda i: f"are {a[i]} and {b[i]}: two vectors that are not zero and not parallel are needed",
        )
        second = second / sine[..., None]
    rows = np.stack([first, second, np.cross(first, second)], axis=-2)
    return _SO3.project(rows if order == "rows" else _swapped(rows))


def _hat(v: Array) -> Array:
    """The matrix of the cross product with a vector."""
    hat = np.zeros((*v.shape[:-1], 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        hat[..., k, j], hat[..., j, k] = v[..., i], -v[..., i]
    return hat


def _given(rotations: Any) -> Array:
    return _SO3._array(rotations, "rotations")


def _swapped(x: Array) -> Array:
    return np.swapaxes(x, -1, -2)


def _check_six(order: Any) -> None:
    if not isinstance(order, str) or order not in _SIX:
        raise ValidationError(
            "the order of the six numbers is in doubt, and they do not show it: say order='columns' (Zhou et al.), "
            f"'rows' (PyTorch3D) or 'interleaved' (SPIN); got {shown(order)}"
        )

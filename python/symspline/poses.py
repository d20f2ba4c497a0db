"""Recordings of poses: files, velocities, accelerations, and the signals of an inertial sensor.

A pose maps the body frame to the world frame: [[R, x], [0, 1]] with attitude R and position x. Fit curves of poses on
``so:3 x r:3``. This product has an invariant metric, and the noise and smoothing of attitude and position stay
separate. `symspline.poses.split` converts 4 × 4 matrices, such as ``poses_se3`` of evo, to its points. The matrices
themselves are points of ``se:3``, whose geodesics are the screw motions of joints and tools.

Examples
--------
>>> import io, symspline as ss
>>> from symspline import poses
>>> t, given = poses.read_tum(io.StringIO("0 0 0 0 0 0 0 1\\n1 2 0 0 0 0 0.6 0.8\\n"))
>>> spline = ss.CubicSpline(t, poses.split(given), "so:3 x r:3")
>>> gyro, specific_force = poses.imu(spline, 0.5)
>>> gyro.round(8) + 0.0
array([0.        , 0.        , 1.28700222])
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike

from ._base.arrays import as_array, checked_flag, one_of, real_numbers, short_repr
from ._base.typing import Array, Extrapolate, Frame, TimesLike
from ._core import ValidationError
from ._curves.composed import AnyCurve, evaluated
from ._estimation.uncertainty import Jacobians, Motion, check_uncertain, standard_errors
from ._smoothing.noise import smoothed_spaces
from ._spaces import Euclidean, SpecialEuclidean, SpecialOrthogonal, cover_of
from .convert._pose_files import (
    check_seconds,
    join,
    read_euroc,
    read_kitti,
    read_tum,
    split,
    write_euroc,
    write_kitti,
    write_tum,
)
from .measure import GRAVITY
from .rotations import Spline, attitude, check_motion, rate_jacobians, rotation_of, turned
from .rotations import velocities as rotation_velocities

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform, Rotation

__all__ = [
    "Imu",
    "imu",
    "join",
    "linear_acceleration",
    "linear_velocity",
    "read_euroc",
    "read_kitti",
    "read_tum",
    "split",
    "transform",
    "twist",
    "velocities",
    "write_euroc",
    "write_kitti",
    "write_tum",
]


def __dir__() -> list[str]:
    return __all__


_SE3, _SO3, _R3 = SpecialEuclidean(3), SpecialOrthogonal(3), Euclidean(3)


class Imu(NamedTuple):
    """Measurements of an inertial sensor at the origin of the body, in the body frame.

    Attributes
    ----------
    gyro : ndarray, shape (..., 3)
        Angular velocity, radians per unit of time.
    specific_force : ndarray, shape (..., 3)
        :math:`R^T(\\ddot x - g)`, units of length per unit of time squared.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> still = ss.CubicSpline(None, [np.eye(4), np.eye(4)], "se:3")
    >>> gyro, specific_force = imu(still, 0.5)
    >>> gyro + 0.0, specific_force
    (array([0., 0., 0.]), array([0.     , 0.     , 9.80665]))
    """

    gyro: Array
    specific_force: Array


@overload
def imu(
    spline: Spline,
    x: TimesLike,
    gravity: ArrayLike = GRAVITY,
    *,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
    return_std: Literal[False] = False,
) -> Imu: ...


@overload
def imu(
    spline: Spline,
    x: TimesLike,
    gravity: ArrayLike = GRAVITY,
    *,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
    return_std: Literal[True],
) -> tuple[Imu, Imu]: ...


def imu(
    spline: Spline,
    x: TimesLike,
    gravity: ArrayLike = GRAVITY,
    *,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
    return_std: bool = False,
) -> Imu | tuple[Imu, Imu]:
    r"""Compute the signals of a gyroscope and an accelerometer at the origin of the body.

    Parameters
    ----------
    spline : CubicSpline, HermiteSpline or CumulativeBSpline
        Curve on ``se:3``, or on a product with one ``so:3`` and one ``r:3``.
    x : array_like
        Times.
    gravity : array_like, shape (3,), default (0.0, 0.0, -9.80665)
        Gravity g in the world frame, in the units of positions and times; by default metres and seconds, with z
        upwards. A body at rest measures −g.
    extrapolate : bool or str, optional
        Extrapolation policy, as for ``spline(x)``.
    per_curve : bool, default False
        True if every curve of a batch has its own times.
    return_std : bool, default False
        True to return standard errors as well. `spline` must then be a `SmoothingSpline`.

    Returns
    -------
    signals : Imu
        Named tuple of two arrays of shape ``(*batch axes, *x.shape, 3)``.
    std : Imu
        Standard errors of all components in the same units, only if `return_std` is True.

    Raises
    ------
    ValidationError
        If the curve does not contain exactly one pose, gravity is not three numbers, the times are nanoseconds since
        1970 instead of seconds, or standard errors are requested of a curve without a covariance or beyond its knots.

    See Also
    --------
    symspline.rotations.angular_velocity : Compute the angular velocity alone.
    symspline.measure.SpecificForce : Accelerometer readings, from which `symspline.estimate` fits a curve.

    Notes
    -----
    At natural ends the acceleration of a curve is zero. The accelerometer then measures gravity alone there, also on
    both sides of a gap. For poses without noise, pass ``bc_type="not-a-knot"`` if the recording begins or ends in
    motion.

    The specific force is :math:`f = R^T(\ddot x - g)`. If the attitude turns by η in the body frame, and the
    acceleration changes by :math:`\delta\ddot x`, then f changes by :math:`R^T\delta\ddot x - \eta \times f` to first
    order. An error of the attitude therefore acts on gravity as well. Standard errors follow from the joint covariance
    of η and :math:`\delta\ddot x`, which accelerometer readings correlate. They are those of a spline with the knots of
    the curve. Acceleration that varies faster than the knots is not included.

    On ``se:3`` the standard errors are those of one spline for the attitude and another for the position, as they are
    estimated. Curves of `SmoothingSpline.sample` on ``se:3`` scatter more, because the position of a screw motion
    depends on the attitude between the knots. Use ``so:3 x r:3`` for samples.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> still = ss.CubicSpline(None, [np.eye(4), np.eye(4)], "se:3")
    >>> imu(still, 0.5).specific_force
    array([0.     , 0.     , 9.80665])

    Noisy poses of a body that swings, and the standard errors of its signals:

    >>> rng, t = np.random.default_rng(0), np.linspace(0, 3, 151)
    >>> angles = np.sin(2 * t)[:, None] * [0, 0, 1] + 0.01 * rng.standard_normal((151, 3))
    >>> x = np.sin(2 * t)[:, None] * [1, 0, 0] + 0.01 * rng.standard_normal((151, 3))
    >>> noisy = ss.rotations.from_rotation_vectors(angles), x
    >>> curve = ss.make_smoothing_spline(t, noisy, "so:3 x r:3", knots=13)
    >>> signals, std = imu(curve, 1.5, return_std=True)
    >>> bool(np.all(std.gyro < 0.05)), bool(np.all(std.specific_force < 0.5))
    (True, True)
    """
    check_motion(spline)
    g = as_array(gravity, "gravity")
    if g.shape != (3,) or g.dtype.kind not in "iuf" or not np.isfinite(g).all():
        raise ValidationError(f"gravity must be three numbers, a vector in the world, not {short_repr(gravity)}")
    check_seconds(np.asarray(spline.domain), "t")
    motion = _Motion(spline, x, "body", extrapolate, per_curve)
    signals = Imu(motion.turning, motion.in_frame(motion.position("acceleration") - g))
    if not checked_flag(return_std, "return_std"):
        return signals
    curve = check_uncertain(spline)
    spaces = smoothed_spaces(curve.space)
    parts = [spaces.index(_SO3), spaces.index(_R3)]
    force = signals.specific_force.reshape(-1, 3)

    def jacobians(motions: list[Motion]) -> Jacobians:
        turning, moving = motions
        moved, changed = (by_part[parts[0]] for by_part in rate_jacobians(turning, parts[0], "body"))
        none = np.zeros_like(moved)
        tilted = np.cross(force[:, None], np.swapaxes(changed, -1, -2))
        accelerated = np.swapaxes(moving.frames @ turning.p, -1, -2)
        return [
            {parts[0]: np.concatenate([moved, np.swapaxes(tilted, -1, -2)], axis=1)},
            {parts[0]: np.concatenate([changed, none], axis=1)},
            {parts[1]: np.concatenate([np.zeros_like(accelerated), accelerated], axis=1)},
        ]

    std = standard_errors(curve, x, parts, jacobians, curve._where(extrapolate), per_curve)
    return signals, Imu(std[..., :3], std[..., 3:])


def twist(
    spline: Spline, x: TimesLike, frame: Frame = "body", *, extrapolate: Extrapolate = None, per_curve: bool = False
) -> Array:
    """Compute the twist (ω, v), angular part first.

    Parameters
    ----------
    spline : CubicSpline, HermiteSpline or CumulativeBSpline
        Curve on ``se:3``, or on a product with one ``so:3`` and one ``r:3``.
    x : array_like
        Times.
    frame : {"body", "world"}, default "body"
        ``"body"`` for g⁻¹g': ω and the velocity of the body's origin in the body frame. ``"world"`` for g'g⁻¹: Rω, and
        the velocity ẋ − Rω × x of the point of the body that passes the origin of the world.
    extrapolate : bool or str, optional
        Extrapolation policy, as for ``spline(x)``.
    per_curve : bool, default False
        True if every curve of a batch has its own times.

    Returns
    -------
    ndarray, shape ``(*batch axes, *x.shape, 6)``
        Twists.

    References
    ----------
    Lynch & Park, "Modern Robotics", 2017, section 3.3.2.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> start, end = np.eye(4), np.eye(4)
    >>> end[:3, 3] = 1, 2, 3
    >>> twist(ss.CubicSpline(None, [start, end], "se:3"), 0.5).round(12) + 0.0
    array([0., 0., 0., 1., 2., 3.])
    """
    motion = _Motion(spline, x, frame, extrapolate, per_curve)
    omega, velocity = motion.turning, motion.position("velocity")
    if frame == "world":
        omega = turned(motion.rotation, omega)
        velocity = velocity - np.cross(omega, motion.position("point"))
    return np.concatenate([omega, motion.in_frame(velocity)], axis=-1)


@overload
def velocities(
    poses: tuple[ArrayLike | Rotation, ArrayLike], twists: ArrayLike, frame: Frame = "body"
) -> tuple[Array, Array]: ...


@overload
def velocities(poses: ArrayLike | RigidTransform, twists: ArrayLike, frame: Frame = "body") -> Array: ...


def velocities(poses: Any, twists: ArrayLike, frame: Frame = "body") -> Array | tuple[Array, Array]:
    """Convert twists to tangent vectors at poses.

    This is the inverse of `twist`. Use the result as velocities of a `symspline.HermiteSpline` or as end vectors.

    Parameters
    ----------
    poses : array_like, shape (..., 4, 4), scipy.spatial.transform.RigidTransform, or tuple
        Points of ``se:3``, or a tuple of rotations and positions, points of ``so:3 x r:3``.
    twists : array_like, shape (..., 6)
        Twists (ω, v), angular part first.
    frame : {"body", "world"}, default "body"
        Frame of the twists, as for `twist`.

    Returns
    -------
    ndarray, shape (..., 4, 4), or tuple
        Tangent vectors :math:`g \\hat\\xi` (body) or :math:`\\hat\\xi g` (world). For a tuple of rotations and
        positions, a tuple of tangent vectors of shape (..., 3, 3) and velocities of shape (..., 3).

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.

    See Also
    --------
    symspline.rotations.velocities : Convert angular velocities to tangent vectors.

    References
    ----------
    Lynch & Park, "Modern Robotics", 2017, section 3.3.2.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> pose = ss.poses.join(np.eye(3), [1.0, 0, 0])
    >>> velocities(pose, [0, 0, 2, 0, 0, 3])
    array([[ 0., -2.,  0.,  0.],
           [ 2.,  0.,  0.,  0.],
           [ 0.,  0.,  0.,  3.],
           [ 0.,  0.,  0.,  0.]])
    >>> velocities(pose, [0, 0, 2, 0, 0, 3], "world")[:3, 3]
    array([0., 2., 3.])
    """
    one_of(frame, "frame", "body", "world")
    pair = isinstance(poses, tuple) and len(poses) == 2
    g = join(*poses) if pair else _SE3._array(poses, "poses")
    _SE3.check_point(g)
    xi = real_numbers(twists, "twists", (6,))[0]
    r, x = np.asarray(g[..., :3, :3], np.float64), np.asarray(g[..., :3, 3], np.float64)
    try:
        np.broadcast_shapes(x.shape[:-1], xi.shape[:-1])
    except ValueError:
        raise ValidationError(f"poses {g.shape} and twists {xi.shape} do not broadcast") from None
    turning = rotation_velocities(r, xi[..., :3], frame)
    moving = turned(r, xi[..., 3:]) if frame == "body" else xi[..., 3:] + np.cross(xi[..., :3], x)
    if pair:
        return turning, moving
    vectors = np.zeros((*moving.shape[:-1], 4, 4))
    vectors[..., :3, :3], vectors[..., :3, 3] = turning, moving
    return vectors


def transform(
    spline: Spline, x: TimesLike, *, extrapolate: Extrapolate = None, per_curve: bool = False
) -> RigidTransform:
    """Evaluate a curve as a SciPy ``RigidTransform``.

    Parameters
    ----------
    spline : CubicSpline or HermiteSpline
        Curve on ``se:3``, or on a product with one ``so:3`` and one ``r:3``.
    x : array_like
        Times.
    extrapolate : bool or str, optional
        Extrapolation policy, as for ``spline(x)``.
    per_curve : bool, default False
        True if every curve of a batch has its own times.

    Returns
    -------
    scipy.spatial.transform.RigidTransform, shape ``(*batch axes, *x.shape)``
        Poses. SciPy before 1.17 supports at most one axis.

    Raises
    ------
    ImportError
        If SciPy is not installed, or older than 1.16.
    ValidationError
        If a value is NaN.

    See Also
    --------
    symspline.rotations.rotation : Evaluate a curve as a ``Rotation``.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> x = np.array([[0.0, 0, 0], [1, 2, 3], [2, 4, 6]])
    >>> path = ss.CubicSpline(None, (np.tile(np.eye(3), (3, 1, 1)), x), "so:3 x r:3")
    >>> transform(path, 0.5).translation.round(12)
    array([0.5, 1. , 1.5])
    """
    try:
        from scipy.spatial.transform import RigidTransform
    except ImportError:
        raise ImportError(
            "transform returns a SciPy RigidTransform; install SciPy 1.16 or newer with: pip install 'scipy>=1.16'"
        ) from None
    motion = _Motion(spline, x, "world", extrapolate, per_curve)
    motions: RigidTransform = RigidTransform.from_components(motion.position("point"), rotation_of(motion.rotation))
    return motions


def linear_velocity(
    spline: Spline, x: TimesLike, frame: Frame = "world", *, extrapolate: Extrapolate = None, per_curve: bool = False
) -> Array:
    """Compute the velocity ẋ of the position.

    Parameters
    ----------
    spline : CubicSpline, HermiteSpline or CumulativeBSpline
        Curve on ``se:3``, or on a product with one ``so:3`` and one ``r:3``.
    x : array_like
        Times.
    frame : {"world", "body"}, default "world"
        ``"world"`` for ẋ, ``"body"`` for Rᵀẋ.
    extrapolate : bool or str, optional
        Extrapolation policy, as for ``spline(x)``.
    per_curve : bool, default False
        True if every curve of a batch has its own times.

    Returns
    -------
    ndarray, shape ``(*batch axes, *x.shape, 3)``
        Velocities.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> start, end = np.eye(4), np.eye(4)
    >>> end[:3, 3] = 1, 2, 3
    >>> linear_velocity(ss.CubicSpline(None, [start, end], "se:3"), 0.5).round(12)
    array([1., 2., 3.])
    """
    motion = _Motion(spline, x, frame, extrapolate, per_curve)
    return motion.in_frame(motion.position("velocity"))


def linear_acceleration(
    spline: Spline, x: TimesLike, frame: Frame = "world", *, extrapolate: Extrapolate = None, per_curve: bool = False
) -> Array:
    """Compute the acceleration ẍ of the position, without gravity.

    See `imu` for measured accelerations. On ``se:3`` the result differs from the last column of ``spline(x, nu=2)``,
    which is ẍ − ω × ẋ with ω in the world frame.

    Parameters
    ----------
    spline : CubicSpline, HermiteSpline or CumulativeBSpline
        Curve on ``se:3``, or on a product with one ``so:3`` and one ``r:3``.
    x : array_like
        Times.
    frame : {"world", "body"}, default "world"
        ``"world"`` for ẍ, ``"body"`` for Rᵀẍ.
    extrapolate : bool or str, optional
        Extrapolation policy, as for ``spline(x)``.
    per_curve : bool, default False
        True if every curve of a batch has its own times.

    Returns
    -------
    ndarray, shape ``(*batch axes, *x.shape, 3)``
        Accelerations.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> turns, places = np.tile(np.eye(3), (3, 1, 1)), [[0.0, 0, 0], [1, 0, 0], [0, 0, 0]]
    >>> linear_acceleration(ss.CubicSpline(None, (turns, places), "so:3 x r:3"), 1).round(12) + 0.0
    array([-3.,  0.,  0.])
    """
    motion = _Motion(spline, x, frame, extrapolate, per_curve)
    return motion.in_frame(motion.position("acceleration"))


def _cross(a: Array, b: Array) -> Array:
    """Return the cross product of vectors, with fewer copies than ``numpy.cross`` makes."""
    (x, y, z), (u, v, w) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


class _Motion:
    """Motion of a body at times x, with vectors in a frame."""

    def __init__(self, spline: Spline, x: TimesLike, frame: str, extrapolate: Extrapolate, per_curve: bool) -> None:
        self._in_body = one_of(frame, "frame", "body", "world") == "body"
        self._attitude = attitude(spline)
        parts = spline._curve.parts
        moving = [part for part in parts if cover_of(part.space) in (_SE3, _R3)]
        if len(moving) != 1:
            raise ValidationError(
                f"the curve must be on se:3, or on a product with one so:3 and one r:3, not on {spline.space}"
            )
        self._position = moving[0]
        self._is_se3 = cover_of(moving[0].space) == _SE3
        self._time_axis, self._x = spline._time_axis, x
        self._where, self._per_curve = spline._where(extrapolate), per_curve

    @cached_property
    def _screw(self) -> tuple[Array, Array, Array]:
        """On se:3, the twist (ω, v) = g⁻¹g', its derivative, and the pose, from one evaluation."""
        values = self._at(self._position, "motion")
        return values[..., :6], values[..., 6:12], values[..., 12:].reshape(*values.shape[:-1], 4, 4)

    @cached_property
    def rotation(self) -> Array:
        return self._screw[2][..., :3, :3] if self._is_se3 else self._at(self._attitude, "point")

    @cached_property
    def turning(self) -> Array:
        """The angular velocity in the frame of the body."""
        return self._screw[0][..., :3] if self._is_se3 else self._at(self._attitude, "body velocity")

    def position(self, quantity: str) -> Array:
        """The position in the frame of the world, or its velocity or acceleration."""
        if not self._is_se3:
            return self._at(self._position, quantity)
        twist, change, pose = self._screw
        if quantity == "point":
            return pose[..., :3, 3]
        along = twist[..., 3:]
        if quantity == "acceleration":
            # ẋ = Rv and ẍ = R(v' + ω × v)
            along = change[..., 3:] + _cross(twist[..., :3], along)
        return turned(pose[..., :3, :3], along)

    def in_frame(self, v: Array) -> Array:
        """Rᵀv for vectors in the world if the frame is that of the body."""
        return turned(np.swapaxes(self.rotation, -1, -2), v) if self._in_body else v

    def _at(self, curve: AnyCurve, quantity: str) -> Array:
        return np.asarray(evaluated(curve, self._time_axis, self._x, quantity, self._where, self._per_curve))

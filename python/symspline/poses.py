"""Recordings of poses: files, velocities, accelerations, and the signals of an inertial sensor.

A pose maps the body frame to the world frame: [[R, x], [0, 1]] with attitude R and position x. Fit curves of poses on
``so:3 x r:3``. This product has an invariant metric, and the noise and smoothing of attitude and position stay
separate. `split` converts 4 × 4 matrices, such as ``poses_se3`` of evo, to its points. The matrices themselves are
points of ``se:3``, whose geodesics are the screw motions of joints and tools.

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
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import as_array, short_repr
from ._base_curve import check_curve, evaluated
from ._core import ValidationError
from ._curves.curve import CurveArrays
from ._pose_files import (
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
from ._spaces import Array, Euclidean, SpecialEuclidean
from ._typing import Extrapolate, Frame, TimesLike
from .rotations import Spline, attitude, check_frame, turned

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
    "twist",
    "write_euroc",
    "write_kitti",
    "write_tum",
]

_SE3, _R3 = SpecialEuclidean(3), Euclidean(3)


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
    (array([0., 0., 0.]), array([0.  , 0.  , 9.81]))
    """

    gyro: Array
    specific_force: Array


def imu(
    spline: Spline,
    x: TimesLike,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    *,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
) -> Imu:
    """Compute the signals of a gyroscope and an accelerometer at the origin of the body.

    Parameters
    ----------
    spline : CubicSpline or HermiteSpline
        Curve on ``se:3``, or on a product with one ``so:3`` and one ``r:3``.
    x : array_like
        Times.
    gravity : array_like, shape (3,), default (0.0, 0.0, -9.81)
        Gravity g in the world frame, in the units of positions and times; by default metres and seconds, with z
        upwards. A body at rest measures −g.
    extrapolate : bool or str, optional
        Extrapolation policy, as for ``spline(x)``.
    per_curve : bool, default False
        True if every curve of a batch has its own times.

    Returns
    -------
    Imu
        Named tuple of two arrays of shape ``(*batch axes, *x.shape, 3)``.

    Raises
    ------
    ValidationError
        If the curve does not contain exactly one pose, gravity is not three numbers, or the times are nanoseconds since
        1970 instead of seconds.

    Notes
    -----
    At natural ends the acceleration of a curve is zero. The accelerometer then measures gravity alone there, also on
    both sides of a gap. For poses without noise, pass ``bc_type="not-a-knot"`` if the recording begins or ends in
    motion.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> still = ss.CubicSpline(None, [np.eye(4), np.eye(4)], "se:3")
    >>> imu(still, 0.5).specific_force
    array([0.  , 0.  , 9.81])
    """
    check_curve(spline)
    g = as_array(gravity, "gravity")
    if g.shape != (3,) or g.dtype.kind not in "iuf" or not np.isfinite(g).all():
        raise ValidationError(f"gravity must be three numbers, a vector in the world, not {short_repr(gravity)}")
    check_seconds(spline.t, "t")
    motion = _Motion(spline, x, extrapolate, per_curve)
    return Imu(motion.turning, motion.in_body(motion.acceleration - g))


def twist(
    spline: Spline, x: TimesLike, frame: Frame = "body", *, extrapolate: Extrapolate = None, per_curve: bool = False
) -> Array:
    """Compute the twist (ω, v), angular part first.

    Parameters
    ----------
    spline : CubicSpline or HermiteSpline
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
    check_frame(frame)
    motion = _Motion(spline, x, extrapolate, per_curve)
    if frame == "body":
        return np.concatenate([motion.turning, motion.in_body(motion.velocity)], axis=-1)
    omega = motion.turning_in_world
    return np.concatenate([omega, motion.velocity - np.cross(omega, motion.place)], axis=-1)


def linear_velocity(
    spline: Spline, x: TimesLike, frame: Frame = "world", *, extrapolate: Extrapolate = None, per_curve: bool = False
) -> Array:
    """Compute the velocity ẋ of the position.

    Parameters
    ----------
    spline : CubicSpline or HermiteSpline
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
    check_frame(frame)
    motion = _Motion(spline, x, extrapolate, per_curve)
    return motion.velocity if frame == "world" else motion.in_body(motion.velocity)


def linear_acceleration(
    spline: Spline, x: TimesLike, frame: Frame = "world", *, extrapolate: Extrapolate = None, per_curve: bool = False
) -> Array:
    """Compute the acceleration ẍ of the position, without gravity.

    See `imu` for measured accelerations. On ``se:3`` the result differs from the last column of ``spline(x, nu=2)``,
    which is ẍ − ω × ẋ with ω in the world frame.

    Parameters
    ----------
    spline : CubicSpline or HermiteSpline
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
    check_frame(frame)
    motion = _Motion(spline, x, extrapolate, per_curve)
    return motion.acceleration if frame == "world" else motion.in_body(motion.acceleration)


class _Motion:
    """Motion of a body at times x; each quantity is evaluated on first access and cached."""

    def __init__(self, spline: Spline, x: TimesLike, extrapolate: Any, per_curve: bool) -> None:
        self._attitude, self._position = attitude(spline), _position(spline)
        self._time_axis, self._x = spline._time_axis, x
        self._where, self._per_curve = spline._where(extrapolate), per_curve

    @cached_property
    def rotation(self) -> Array:
        return self._at(self._attitude, "point")

    @cached_property
    def turning(self) -> Array:
        """The angular velocity in the frame of the body."""
        return self._at(self._attitude, "body velocity")

    @cached_property
    def turning_in_world(self) -> Array:
        return turned(self.rotation, self.turning)

    @cached_property
    def place(self) -> Array:
        return self._of_position("point")

    @cached_property
    def velocity(self) -> Array:
        return self._of_position("velocity")

    @cached_property
    def acceleration(self) -> Array:
        """ẍ, which on SE(3) is not the acceleration of the connection."""
        a = self._of_position("acceleration")
        return a + np.cross(self.turning_in_world, self.velocity) if self._position.space == _SE3 else a

    def in_body(self, v: Array) -> Array:
        """Rᵀv for vectors in the world."""
        return turned(np.swapaxes(self.rotation, -1, -2), v)

    def _of_position(self, quantity: str) -> Array:
        values = self._at(self._position, quantity)
        return values[..., :3, 3] if self._position.space == _SE3 else values

    def _at(self, curve: CurveArrays, quantity: str) -> Array:
        return np.asarray(evaluated(curve, self._time_axis, self._x, quantity, self._where, self._per_curve))


def _position(spline: Spline) -> CurveArrays:
    """Return the curve that contains the positions: the one of poses, or the one on R³.

    Raises
    ------
    ValidationError
        If the curve does not contain exactly one position.
    """
    attitude(spline)
    found = [part for part in spline._curve.parts if part.space in (_SE3, _R3)]
    if len(found) != 1:
        raise ValidationError(
            f"the curve must be on se:3, or on a product with one so:3 and one r:3, not on {spline.space}"
        )
    return found[0]

"""Recordings of poses: files in and out, velocities, accelerations, and what an inertial sensor on the body measures.

Poses take the body to the world, [[R, x], [0, 1]] with R the attitude and x the position. Fit curves of them on
``so:3 x r:3``: the product has an invariant metric, and noise and smoothing of attitude and position stay separate.
`split` makes its points of 4 × 4 matrices, such as ``poses_se3`` of evo. Such matrices are points of ``se:3`` as they
are; geodesics there are screw motions, as joints and tools make them.

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

from ._core import ValidationError
from .arrays import as_array, shown
from .curves.curve import Curve
from .piecewise import check_curve, evaluated
from .pose_files import (
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
from .rotations import Spline, attitude, check_frame, turned
from .spaces import Array, Euclidean, SpecialEuclidean

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
    """What an inertial sensor at the origin of the body measures, in the frame of the body.

    Attributes:
        gyro: angular velocity, radians per unit of time, shape (..., 3).
        specific_force: Rᵀ(ẍ − g), units of length per unit of time squared, shape (..., 3).
    """

    gyro: Array
    specific_force: Array


def imu(
    spline: Spline,
    x: ArrayLike,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    *,
    extrapolate: bool | str | None = None,
    per_curve: bool = False,
) -> Imu:
    """What a gyroscope and an accelerometer at the origin of the body measure at times x.

    At natural ends a curve has no acceleration: there, and so on both sides of a gap, the accelerometer shows nothing
    but gravity. Of poses without noise take ``bc_type="not-a-knot"`` for a recording that begins or ends in motion.

    Args:
        spline: a curve on ``se:3``, or on a product with one ``so:3`` and one ``r:3``.
        x, extrapolate, per_curve: as for calling the spline.
        gravity: g in the world, shape (3,), in the units of positions and times: metres and seconds here, z upwards.
            A body at rest measures −g.

    Returns:
        A pair `Imu` of arrays of shape batch axes + x.shape + (3,).

    Raises:
        ValidationError: the spline has no poses, gravity is not three numbers, or times are no seconds but nanoseconds
            since 1970.

    >>> import numpy as np, symspline as ss
    >>> still = ss.CubicSpline(None, [np.eye(4), np.eye(4)], "se:3")
    >>> imu(still, 0.5).specific_force
    array([0.  , 0.  , 9.81])
    """
    check_curve(spline)
    g = as_array(gravity, "gravity")
    if g.shape != (3,) or g.dtype.kind not in "iuf" or not np.isfinite(g).all():
        raise ValidationError(f"gravity must be three numbers, a vector in the world, not {shown(gravity)}")
    check_seconds(spline.t, "t")
    motion = _Motion(spline, x, extrapolate, per_curve)
    return Imu(motion.turning, motion.in_body(motion.acceleration - g))


def twist(
    spline: Spline,
    x: ArrayLike,
    frame: str = "body",
    *,
    extrapolate: bool | str | None = None,
    per_curve: bool = False,
) -> Array:
    """The twist (ω, v) at times x, the angular part first.

    Source: Lynch & Park, Modern Robotics (2017), 3.3.2.

    Args:
        spline: a curve on ``se:3``, or on a product with one ``so:3`` and one ``r:3``.
        x, extrapolate, per_curve: as for calling the spline.
        frame: ``"body"`` for g⁻¹g': ω and the velocity of the body's origin in the frame of the body; ``"world"`` for
            g'g⁻¹: Rω, and the velocity ẋ − Rω × x of that point of the body that passes the world's origin.

    Returns:
        Shape batch axes + x.shape + (6,).
    """
    check_frame(frame)
    motion = _Motion(spline, x, extrapolate, per_curve)
    if frame == "body":
        return np.concatenate([motion.turning, motion.in_body(motion.velocity)], axis=-1)
    omega = motion.turning_in_world
    return np.concatenate([omega, motion.velocity - np.cross(omega, motion.place)], axis=-1)


def linear_velocity(
    spline: Spline,
    x: ArrayLike,
    frame: str = "world",
    *,
    extrapolate: bool | str | None = None,
    per_curve: bool = False,
) -> Array:
    """The velocity ẋ of the position at times x.

    Args:
        spline: a curve on ``se:3``, or on a product with one ``so:3`` and one ``r:3``.
        x, extrapolate, per_curve: as for calling the spline.
        frame: ``"world"`` for ẋ, or ``"body"`` for Rᵀẋ.

    Returns:
        Shape batch axes + x.shape + (3,).
    """
    check_frame(frame)
    motion = _Motion(spline, x, extrapolate, per_curve)
    return motion.velocity if frame == "world" else motion.in_body(motion.velocity)


def linear_acceleration(
    spline: Spline,
    x: ArrayLike,
    frame: str = "world",
    *,
    extrapolate: bool | str | None = None,
    per_curve: bool = False,
) -> Array:
    """The acceleration ẍ of the position at times x, without gravity; see `imu` for what is measured.

    On ``se:3`` it is not the last column of ``spline(x, nu=2)``, which is ẍ − ω × ẋ with ω in the world.

    Args:
        spline: a curve on ``se:3``, or on a product with one ``so:3`` and one ``r:3``.
        x, extrapolate, per_curve: as for calling the spline.
        frame: ``"world"`` for ẍ, or ``"body"`` for Rᵀẍ.

    Returns:
        Shape batch axes + x.shape + (3,).
    """
    check_frame(frame)
    motion = _Motion(spline, x, extrapolate, per_curve)
    return motion.acceleration if frame == "world" else motion.in_body(motion.acceleration)


class _Motion:
    """A moving body at times x. Each quantity is evaluated when it is first asked for, and then kept."""

    def __init__(self, spline: Spline, x: ArrayLike, extrapolate: Any, per_curve: bool) -> None:
        self._attitude, self._position = attitude(spline), _position(spline)
        self._clock, self._x = spline._clock, x
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

    def _at(self, curve: Curve, quantity: str) -> Array:
        values: Array = evaluated(curve, self._clock, self._x, quantity, self._where, self._per_curve, None)
        return values


def _position(spline: Spline) -> Curve:
    """The curve that has the positions: of poses, or the one on R³.

    Raises:
        ValidationError: there is none, or several.
    """
    attitude(spline)
    found = [part for part in spline._curve.parts if part.space in (_SE3, _R3)]
    if len(found) != 1:
        raise ValidationError(
            f"a curve of poses is on se:3, or on a product with one so:3 and one r:3, not on {spline.space}"
        )
    return found[0]

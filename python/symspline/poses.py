"""Recordings of poses: files in and out, velocities, accelerations, and what an inertial sensor on the body measures.

Poses take the body to the world, [[R, x], [0, 1]] with R the attitude and x the position. Curves of them are on
``se:3``, where geodesics are screw motions, or on ``so:3 x r:3``, where positions go their own way; lists of 4 × 4
matrices, such as ``poses_se3`` of evo, are points of ``se:3`` as they are.

>>> import io, symspline as ss
>>> from symspline import poses
>>> t, given = poses.read_tum(io.StringIO("0 0 0 0 0 0 0 1\\n1 2 0 0 0 0 0.6 0.8\\n"))
>>> spline = ss.CubicSpline(t, given, "se:3")
>>> gyro, specific_force = poses.imu(spline, 0.5)
>>> gyro.round(8) + 0.0
array([0.        , 0.        , 1.28700222])
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ._core import ValidationError
from .curves.curve import Curve
from .piecewise import evaluated
from .pose_files import join, read_euroc, read_kitti, read_tum, split, write_euroc, write_kitti, write_tum
from .rotations import Spline, angular_velocity, attitude, check_frame, turned
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

    Args:
        spline: a curve on ``se:3``, or on a product with one ``so:3`` and one ``r:3``.
        x, extrapolate, per_curve: as for calling the spline.
        gravity: g in the world, shape (3,), in the units of positions and times: metres and seconds here, z upwards.
            A body at rest measures −g.

    Returns:
        A pair `Imu` of arrays of shape batch axes + x.shape + (3,).

    Raises:
        ValidationError: the spline has no poses, or gravity is not three numbers.

    >>> import numpy as np, symspline as ss
    >>> still = ss.CubicSpline(None, [np.eye(4), np.eye(4)], "se:3")
    >>> imu(still, 0.5).specific_force
    array([0.  , 0.  , 9.81])
    """
    g = np.asarray(gravity)
    if g.shape != (3,) or g.dtype.kind not in "iuf" or not np.isfinite(g).all():
        raise ValidationError(f"gravity must be three numbers, a vector in the world, not {gravity!r}")
    options: Any = {"extrapolate": extrapolate, "per_curve": per_curve}
    force = linear_acceleration(spline, x, **options) - g
    return Imu(angular_velocity(spline, x, **options), _in_body(spline, x, force, extrapolate, per_curve))


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
    options: Any = {"extrapolate": extrapolate, "per_curve": per_curve}
    omega = angular_velocity(spline, x, frame, **options)
    v = linear_velocity(spline, x, frame, **options)
    if frame == "world":
        v = v - np.cross(omega, _place(spline, x, "point", extrapolate, per_curve))
    return np.concatenate([omega, v], axis=-1)


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
    v = _place(spline, x, "velocity", extrapolate, per_curve)
    return v if frame == "world" else _in_body(spline, x, v, extrapolate, per_curve)


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
    a = _place(spline, x, "acceleration", extrapolate, per_curve)
    if _position(spline).space == _SE3:
        omega = angular_velocity(spline, x, "world", extrapolate=extrapolate, per_curve=per_curve)
        a = a + np.cross(omega, _place(spline, x, "velocity", extrapolate, per_curve))
    return a if frame == "world" else _in_body(spline, x, a, extrapolate, per_curve)


def _in_body(spline: Spline, x: ArrayLike, v: Array, extrapolate: Any, per_curve: bool) -> Array:
    """Rᵀv for vectors in the world at times x."""
    where = spline._where(extrapolate)
    r = evaluated(attitude(spline), spline._clock, x, "point", where, per_curve, None)
    return turned(np.swapaxes(r, -1, -2), v)


def _place(spline: Spline, x: ArrayLike, quantity: str, extrapolate: Any, per_curve: bool) -> Array:
    """The position at times x, its velocity, or the acceleration of the space's connection there."""
    curve, where = _position(spline), spline._where(extrapolate)
    values: Array = evaluated(curve, spline._clock, x, quantity, where, per_curve, None)
    return values[..., :3, 3] if curve.space == _SE3 else values


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

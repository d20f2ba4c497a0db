"""One face for the libraries: what is prepared beforehand and what is timed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import symspline as ss
from symspline import rotations

from .data import SPHERE, Array, product


@dataclass(frozen=True)
class Library:
    """How a library is used.

    Attributes:
        name: its name in the tables.
        arguments: times and quaternions as the library wants them; not timed.
        curve: the spline from these arguments.
        at: the function of a spline that takes times and nu = 0, 1, 2 for value, rate, acceleration.
        numbers: values as quaternions, scalar first, and rates in the frame of the body; not timed.
    """

    name: str
    arguments: Callable[[Array, Array], tuple[Any, ...]]
    curve: Callable[..., Any]
    at: Callable[[Any], Callable[[Any, int], Any]]
    numbers: Callable[[Any, Array, int], Array]


def all_libraries() -> list[Library]:
    """symspline and the others. One that is not installed fails when it is used."""
    return [symspline(), _or_missing("RotationSpline", scipy), _or_missing("splines", splines)]


def symspline() -> Library:
    return Library(
        "symspline",
        lambda t, q: (t, q, SPHERE),
        ss.CubicSpline,
        lambda curve: curve,
        lambda curve, x, nu: body_rate(curve, x, nu) if nu else curve(x),
    )


def body_rate(curve: ss.CubicSpline, x: Array, nu: int) -> Array:
    """Angular velocity (nu = 1) or acceleration (2) in the frame of the body, 2 q̄ γ' and 2 q̄ ∇γ'."""
    conjugate = curve(x) * [1.0, -1.0, -1.0, -1.0]
    return 2 * product(conjugate, curve(x, nu))[..., 1:]


def angular(t: Array, points: Array, x: Array, nu: int) -> Callable[[], Array]:
    """Angular velocity (nu = 1) or acceleration (2) of the rotations of quaternions."""
    curve = ss.CubicSpline(t, rotations.from_quaternions(points, scalar_first=True), "so:3")
    rate = (rotations.angular_velocity, rotations.angular_acceleration)[nu - 1]
    return partial(rate, curve, x)


def scipy() -> Library:
    from scipy.spatial.transform import Rotation, RotationSpline

    return Library(
        "RotationSpline",
        lambda t, q: (t, Rotation.from_quat(np.roll(q, -1, axis=-1))),
        RotationSpline,
        lambda curve: curve,
        lambda curve, x, nu: curve(x, nu) if nu else np.roll(curve(x).as_quat(), 1, axis=-1),
    )


def splines() -> Library:
    from splines.quaternion import CatmullRom, UnitQuaternion

    def arguments(t: Array, q: Array) -> tuple[Any, ...]:
        return [UnitQuaternion.from_unit_xyzw((x, y, z, w)) for w, x, y, z in q.tolist()], t.tolist()

    def numbers(curve: CatmullRom, x: Array, nu: int) -> Array:
        values = curve.evaluate(x)
        if nu == 0:
            return np.array([q.wxyz for q in values])
        turned = zip(values, curve.evaluate(x, nu), strict=True)
        return np.array([q.inverse().rotate_vector(rate) for q, rate in turned])

    return Library("splines", arguments, CatmullRom, lambda curve: curve.evaluate, numbers)


def _or_missing(name: str, make: Callable[[], Library]) -> Library:
    try:
        return make()
    except ImportError as error:
        reason = str(error)

    def fail(*_: Any) -> Any:
        raise ImportError(reason)

    return Library(name, fail, fail, fail, fail)

"""Models of hyperbolic space: the hyperboloid, the Poincaré ball, the upper half-space.

The formulas are those of Ratcliffe, Foundations of Hyperbolic Manifolds, §4.5 and §4.6. All three have the
same middle: (1, 0, …, 0), the centre of the ball, and (0, …, 0, 1) in the half-space, whose height is the
last coordinate. Its point at infinity is (0, …, 0, 1) on the boundary of the ball.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._core import ValidationError
from .reading import Array, length, real_numbers, refuse, unmoved_by_underflow


@unmoved_by_underflow
def hyperboloid_to_ball(x: ArrayLike) -> Array:
    """The points of `Hyperbolic` in the Poincaré ball, by stereographic projection.

    Args:
        x: points of the hyperboloid, time-like coordinate first, shape (..., n + 1).

    Returns:
        Vectors shorter than 1, shape (..., n).

    Raises:
        ValidationError: a point is not on the hyperboloid, or so far out, at a distance of some 36, that it
            rounds to the boundary of the ball.

    >>> hyperboloid_to_ball([1.25, 0.0, 0.75]).round(8)
    array([0.        , 0.33333333])
    """
    time, rest = _hyperboloid(x)
    return _inside(rest / (1 + time)[..., None], "x")


@unmoved_by_underflow
def ball_to_hyperboloid(y: ArrayLike) -> Array:
    """The points of `Hyperbolic` with given places in the Poincaré ball.

    Args:
        y: vectors shorter than 1, shape (..., n).

    Returns:
        Points of the hyperboloid, time-like coordinate first, shape (..., n + 1).

    Raises:
        ValidationError: a vector is not inside the unit ball.

    >>> ball_to_hyperboloid([0.0, 1 / 3]).round(8)
    array([1.25, 0.  , 0.75])
    """
    y, room = _ball(y)
    return _with_time(2 * y / room)


@unmoved_by_underflow
def hyperboloid_to_half_space(x: ArrayLike) -> Array:
    """The points of `Hyperbolic` in the upper half-space, whose last coordinate is the height.

    Args:
        x: points of the hyperboloid, time-like coordinate first, shape (..., n + 1).

    Returns:
        Points with positive height, shape (..., n).

    Raises:
        ValidationError: a point is not on the hyperboloid.

    >>> hyperboloid_to_half_space([1.25, 0.0, 0.75])
    array([0., 2.])
    """
    time, rest = _hyperboloid(x)
    ground, last = rest[..., :-1], rest[..., -1]
    sum_ = time + np.abs(last)
    # (x₀ − |xₙ|)(x₀ + |xₙ|) = 1 + x₁² + …: the difference itself would cancel.
    across = np.hypot(1.0, length(ground))
    steep = np.where(last > 0, across / sum_ * across, sum_)[..., None]
    return np.concatenate([ground / steep, 1 / steep], axis=-1)


@unmoved_by_underflow
def half_space_to_hyperboloid(z: ArrayLike) -> Array:
    """The points of `Hyperbolic` with given places in the upper half-space.

    Args:
        z: points with positive last coordinate, shape (..., n).

    Returns:
        Points of the hyperboloid, time-like coordinate first, shape (..., n + 1).

    Raises:
        ValidationError: a height is not positive, or a point so far out that its coordinates overflow.

    >>> half_space_to_hyperboloid([0.0, 2.0])
    array([1.25, 0.  , 0.75])
    """
    ground, height = _half_space(z)
    with np.errstate(over="ignore", invalid="ignore"):
        rest = ground / height
        last = (np.sum(rest * ground, axis=-1, keepdims=True) + (height - 1) * (1 + 1 / height)) / 2
        x = _with_time(np.concatenate([rest, last], axis=-1))
    refuse(
        ~np.isfinite(length(x)),
        "z",
        lambda i: f"is too far out for the hyperboloid, where it overflows: its height is {height[i][0]}",
    )
    return x


@unmoved_by_underflow
def ball_to_half_space(y: ArrayLike) -> Array:
    """From the Poincaré ball to the upper half-space, whose last coordinate is the height.

    Args:
        y: vectors shorter than 1, shape (..., n).

    Returns:
        Points with positive height, shape (..., n).

    Raises:
        ValidationError: a vector is not inside the unit ball.

    >>> ball_to_half_space([0.0, 1 / 3]).round(8)
    array([0., 2.])
    """
    y, room = _ball(y)
    ground, last = y[..., :-1], y[..., -1:]
    square = np.sum(ground**2, axis=-1, keepdims=True) + (1 - last) ** 2
    z: Array = np.concatenate([2 * ground, room], axis=-1) / square
    return z


@unmoved_by_underflow
def half_space_to_ball(z: ArrayLike) -> Array:
    """From the upper half-space to the Poincaré ball.

    Args:
        z: points with positive last coordinate, shape (..., n).

    Returns:
        Vectors shorter than 1, shape (..., n).

    Raises:
        ValidationError: a height is not positive, or a point so far out, at a distance of some 36, that it
            rounds to the boundary of the ball.

    >>> half_space_to_ball([0.0, 2.0]).round(8)
    array([0.        , 0.33333333])
    """
    ground, height = _half_space(z)
    # Divided by their size, so that no square overflows.
    size = np.maximum(np.maximum(1.0, height), length(ground)[..., None])
    ground, above, below = ground / size, (height + 1) / size, (height - 1) / size
    flat = np.sum(ground**2, axis=-1, keepdims=True)
    y = np.concatenate([2 * ground / size, flat + above * below], axis=-1)
    return _inside(y / (flat + above**2), "z")


def _hyperboloid(value: ArrayLike) -> tuple[Array, Array]:
    """The time-like coordinate, made exact, and the others."""
    x, tol = real_numbers(value, "x", (None,))
    if x.shape[-1] < 2:
        raise ValidationError(
            f"x has shape {x.shape}, but points of the hyperboloid have two or more numbers"
        )
    time = np.hypot(1.0, length(x[..., 1:]))
    refuse(
        ~(np.abs(x[..., 0] - time) <= tol * time),
        "x",
        lambda i: (
            f"is not on the hyperboloid: its time-like coordinate, the first, is {x[i][0]}, but "
            f"sqrt(1 + |rest|²) is {time[i]}; Hyperbolic(n).project(x) moves points there"
        ),
    )
    return time, x[..., 1:]


def _ball(value: ArrayLike) -> tuple[Array, Array]:
    """Vectors y of the ball, and 1 − |y|², shape (..., 1)."""
    y, _ = real_numbers(value, "y", (None,))
    lengths = length(y)
    refuse(
        ~(lengths < 1),
        "y",
        lambda i: (
            f"is not inside the unit ball: its length is {lengths[i]}; places in the Poincaré ball are shorter "
            "than 1"
        ),
    )
    return y, ((1 - lengths) * (1 + lengths))[..., None]


def _half_space(value: ArrayLike) -> tuple[Array, Array]:
    """What lies on the ground, and the height, shape (..., 1)."""
    z, _ = real_numbers(value, "z", (None,))
    height = z[..., -1:]
    refuse(
        ~(height[..., 0] > 0),
        "z",
        lambda i: (
            f"is not in the upper half-space: its last coordinate, the height, is {z[i][-1]}; it must be "
            "positive (put the height last)"
        ),
    )
    return z[..., :-1], height


def _inside(y: Array, name: str) -> Array:
    """Vectors that are inside the ball in spite of rounding."""
    lengths = length(y)
    refuse(
        ~(lengths < 1),
        name,
        lambda i: (
            f"is too far out for the ball: in doubles its length there is {lengths[i]}, not below 1; the "
            "hyperboloid and the half-space can hold it"
        ),
    )
    return y


def _with_time(rest: Array) -> Array:
    return np.concatenate([np.hypot(1.0, length(rest))[..., None], rest], axis=-1)

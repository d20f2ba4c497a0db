"""Models of hyperbolic space: the hyperboloid, the Poincaré ball, the upper half-space.

The formulas are those of Ratcliffe, Foundations of Hyperbolic Manifolds, §4.5 and §4.6. The origins of the three models
correspond: (1, 0, …, 0), the centre of the ball, and (0, …, 0, 1) in the half-space, whose last coordinate is the
height. The point at infinity of the half-space is (0, …, 0, 1) on the boundary of the ball.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import refuse
from .._core import ValidationError
from ._reading import Array, length, real_numbers, unmoved_by_underflow


@unmoved_by_underflow
def hyperboloid_to_ball(x: ArrayLike) -> Array:
    """Convert points of `Hyperbolic` to the Poincaré ball, by stereographic projection.

    Parameters
    ----------
    x : array_like, shape (..., n + 1)
        Points of the hyperboloid, time-like coordinate first.

    Returns
    -------
    ndarray, shape (..., n)
        Vectors shorter than 1.

    Raises
    ------
    ValidationError
        If a point is not on the hyperboloid, or at a distance of more than about 36, where it rounds to the boundary.

    Examples
    --------
    >>> hyperboloid_to_ball([1.25, 0.0, 0.75]).round(8)
    array([0.        , 0.33333333])
    """
    time, rest = _hyperboloid(x)
    return _inside(rest / (1 + time)[..., None], "x")


@unmoved_by_underflow
def ball_to_hyperboloid(y: ArrayLike) -> Array:
    """Convert points of the Poincaré ball to points of `Hyperbolic`.

    Parameters
    ----------
    y : array_like, shape (..., n)
        Vectors shorter than 1.

    Returns
    -------
    ndarray, shape (..., n + 1)
        Points of the hyperboloid, time-like coordinate first.

    Raises
    ------
    ValidationError
        If a vector is not inside the unit ball.

    Examples
    --------
    >>> ball_to_hyperboloid([0.0, 1 / 3]).round(8)
    array([1.25, 0.  , 0.75])
    """
    y, room = _ball(y)
    return _with_time(2 * y / room)


@unmoved_by_underflow
def hyperboloid_to_half_space(x: ArrayLike) -> Array:
    """Convert points of `Hyperbolic` to the upper half-space.

    Parameters
    ----------
    x : array_like, shape (..., n + 1)
        Points of the hyperboloid, time-like coordinate first.

    Returns
    -------
    ndarray, shape (..., n)
        Points with positive height, which is the last coordinate.

    Raises
    ------
    ValidationError
        If a point is not on the hyperboloid.

    Examples
    --------
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
    """Convert points of the upper half-space to points of `Hyperbolic`.

    Parameters
    ----------
    z : array_like, shape (..., n)
        Points with positive last coordinate.

    Returns
    -------
    ndarray, shape (..., n + 1)
        Points of the hyperboloid, time-like coordinate first.

    Raises
    ------
    ValidationError
        If a height is not positive, or a point is so distant that its coordinates overflow.

    Examples
    --------
    >>> half_space_to_hyperboloid([0.0, 2.0])
    array([1.25, 0.  , 0.75])
    """
    ground, height = _half_space(z)
    with np.errstate(over="ignore", invalid="ignore"):
        rest = ground / height
        last = (np.sum(rest * ground, axis=-1, keepdims=True) + (height - 1) * (1 + 1 / height)) / 2
        x = _with_time(np.concatenate([rest, last], axis=-1))
    bad = ~np.isfinite(length(x))
    refuse(bad, "z", lambda i: f"is too distant for the hyperboloid, where it overflows: its height is {height[i][0]}")
    return x


@unmoved_by_underflow
def ball_to_half_space(y: ArrayLike) -> Array:
    """Convert points of the Poincaré ball to the upper half-space.

    Parameters
    ----------
    y : array_like, shape (..., n)
        Vectors shorter than 1.

    Returns
    -------
    ndarray, shape (..., n)
        Points with positive height, which is the last coordinate.

    Raises
    ------
    ValidationError
        If a vector is not inside the unit ball.

    Examples
    --------
    >>> ball_to_half_space([0.0, 1 / 3]).round(8)
    array([0., 2.])
    """
    y, room = _ball(y)
    ground, last = y[..., :-1], y[..., -1:]
    square = np.sum(ground**2, axis=-1, keepdims=True) + (1 - last) ** 2
    return np.asarray(np.concatenate([2 * ground, room], axis=-1) / square)


@unmoved_by_underflow
def half_space_to_ball(z: ArrayLike) -> Array:
    """Convert points of the upper half-space to the Poincaré ball.

    Parameters
    ----------
    z : array_like, shape (..., n)
        Points with positive last coordinate.

    Returns
    -------
    ndarray, shape (..., n)
        Vectors shorter than 1.

    Raises
    ------
    ValidationError
        If a height is not positive, or a point is at a distance of more than about 36, where it rounds to the boundary.

    Examples
    --------
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
    """Return the time-like coordinate, recomputed from the others, and the others."""
    x, tol = real_numbers(value, "x", (None,))
    if x.shape[-1] < 2:
        raise ValidationError(f"x has shape {x.shape}, but points of the hyperboloid need at least two numbers")
    time = np.hypot(1.0, length(x[..., 1:]))
    bad = ~(np.abs(x[..., 0] - time) <= tol * time)
    advice = "Hyperbolic(n).project(x) projects points onto it"
    what = "is not on the hyperboloid: its time-like coordinate, the first, is"
    refuse(bad, "x", lambda i: f"{what} {x[i][0]}, but sqrt(1 + |rest|²) is {time[i]}; {advice}")
    return time, x[..., 1:]


def _ball(value: ArrayLike) -> tuple[Array, Array]:
    """Return vectors y of the ball, and 1 − |y|², shape (..., 1)."""
    y, _ = real_numbers(value, "y", (None,))
    lengths = length(y)
    advice = "points of the Poincaré ball must be shorter than 1"
    refuse(~(lengths < 1), "y", lambda i: f"is not inside the unit ball: its length is {lengths[i]}; {advice}")
    return y, ((1 - lengths) * (1 + lengths))[..., None]


def _half_space(value: ArrayLike) -> tuple[Array, Array]:
    """Return the coordinates on the ground, and the height, shape (..., 1)."""
    z, _ = real_numbers(value, "z", (None,))
    height = z[..., -1:]
    what = "is not in the upper half-space: its last coordinate, the height, is"
    advice = "it must be positive (put the height last)"
    refuse(~(height[..., 0] > 0), "z", lambda i: f"{what} {z[i][-1]}; {advice}")
    return z[..., :-1], height


def _inside(y: Array, name: str) -> Array:
    """Raise ValidationError for vectors that rounding errors move out of the ball."""
    lengths = length(y)
    what = "is too distant for the ball: in double precision its length is"
    advice = "must be below 1; use the hyperboloid or the half-space"
    refuse(~(lengths < 1), name, lambda i: f"{what} {lengths[i]}, but {advice}")
    return y


def _with_time(rest: Array) -> Array:
    return np.concatenate([np.hypot(1.0, length(rest))[..., None], rest], axis=-1)

"""Smooth curves, known everywhere, to take points from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
DURATION = 1.5


def knots(n: int) -> Array:
    """n equidistant times."""
    return np.linspace(0, DURATION, n)


def track(t: Array) -> Array:
    """A track on S² that stays away from the poles, shape (..., 3)."""
    latitude = 0.7 * np.sin(2.1 * t + 0.3) + 0.2 * np.cos(5 * t)
    longitude = 2.6 * t + 0.5 * np.sin(3 * t)
    cos = np.cos(latitude)
    return np.stack([cos * np.cos(longitude), cos * np.sin(longitude), np.sin(latitude)], axis=-1)


def tumble(t: Array) -> Array:
    """A tumbling body, shape (..., 3, 3): two rotations, none about a fixed axis."""
    zero = np.zeros_like(t)
    outer = Rotation.from_rotvec(np.stack([2 * np.sin(2 * t + 0.3), zero, 0.5 * t], axis=-1))
    inner = Rotation.from_rotvec(
        np.stack([zero, 0.8 * np.cos(4 * t), 2.5 * t + 0.4 * np.sin(3 * t)], axis=-1)
    )
    return (outer * inner).as_matrix()


def between(t: Array, per_interval: int = 16) -> Array:
    """Times in all intervals between the knots t, the knots among them."""
    inside = t[:-1, None] + np.diff(t)[:, None] * np.arange(per_interval) / per_interval
    return np.append(inside.ravel(), t[-1])

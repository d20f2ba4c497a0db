"""Angles between rotations, and the angular velocity of a curve of rotations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def angle(a: Array, b: Array) -> Array:
    """Angles in radians between rotation matrices, exact also where they are tiny."""
    return (Rotation.from_matrix(a).inv() * Rotation.from_matrix(b)).magnitude()


def body_rate(r: Array, rate: Array) -> Array:
    """Angular velocity in the frame of the body, shape (..., 3), from R and R': RᵀR' = [ω]×."""
    omega = np.swapaxes(r, -1, -2) @ rate
    return np.stack([omega[..., 2, 1], omega[..., 0, 2], omega[..., 1, 0]], axis=-1)


def from_body_rate(r: Array, omega: Array) -> Array:
    """R' from R and the angular velocity in the frame of the body."""
    x, y, z = np.moveaxis(omega, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1)
    return r @ cross.reshape(*cross.shape[:-1], 3, 3)

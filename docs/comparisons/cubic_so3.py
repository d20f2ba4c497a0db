"""Riemannian cubics through rotations, by the multiple shooting of interpolatepy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import symspline as ss

Array = NDArray[np.float64]


class RiemannianCubic:
    """The C² curve of Riemannian cubics with natural ends through the rotations of a spline.

    Needs ``pip install interpolatepy``, 3.3 or newer.
    """

    def __init__(self, spline: ss.CubicSpline, tol: float = 1e-11) -> None:
        from interpolatepy import Quaternion, ShootingConfig, ShootingQuaternionInterpolation

        numbers = Rotation.from_matrix(spline.points).as_quat()
        quaternions = [Quaternion(w, x, y, z) for x, y, z, w in numbers.tolist()]
        config = ShootingConfig(tolerance=tol, max_iterations=100, max_integration_steps=4096)
        self._curve = ShootingQuaternionInterpolation(spline.t.tolist(), quaternions, config)

    def __call__(self, x: Array) -> Array:
        """Rotation matrices at times x, shape (len(x), 3, 3)."""
        quaternions = [self._curve.evaluate(time) for time in np.ravel(x).tolist()]
        return Rotation.from_quat([(q.x, q.y, q.z, q.w) for q in quaternions]).as_matrix()

    def energy(self) -> float:
        """∫ |∇γ'|² dt."""
        return self._curve.acceleration_energy

"""Flat space, spheres and hyperbolic spaces: points are vectors, the curvature is constant."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._typing import FloatArray
from .actions import Preserving, homogeneous, require
from .base import Array, Space


class Euclidean(Space[FloatArray]):
    """Flat space Rⁿ: points are arrays of n numbers, splines the classical ones.

    >>> import symspline as ss
    >>> ss.Euclidean(3)
    Euclidean(3)
    """

    _name = "euclidean"

    def __init__(self, n: int) -> None:
        super().__init__(n)

    def _reflected(self, p: Array, x: Array) -> Any:
        return 2 * p - x

    def _element(self, g: Any) -> Any:
        return homogeneous(self, g, self.dim)

    def _moved(self, g: Array, x: Array) -> Any:
        return (g[..., :-1, :-1] @ x[..., None])[..., 0] + g[..., :-1, -1]


class Sphere(Preserving[FloatArray]):
    """The unit sphere Sⁿ: points are unit vectors of n + 1 numbers.

    S² are directions or places on a globe, S³ unit quaternions: q and −q are two points here, and for curves of
    rotations there is `SpecialOrthogonal`. Distance is the angle.

    >>> import symspline as ss
    >>> ss.Sphere(2).distance([1, 0, 0], [0, 1, 0]).round(8)
    np.float64(1.57079633)
    """

    _name = "sphere"
    _linear = True

    def __init__(self, n: int) -> None:
        super().__init__(n)


class Hyperbolic(Preserving[FloatArray]):
    """Hyperbolic space Hⁿ: points are arrays (x₀, x₁, …, xₙ) on the hyperboloid
    −x₀² + x₁² + … + xₙ² = −1 with x₀ > 0, the time-like coordinate first. Rounding errors of a point p are ε|p|²;
    curves are made as far as distance 15 from (1, 0, …), where they are 10⁻³.

    >>> import numpy as np, symspline as ss
    >>> ss.Hyperbolic(1).distance([1, 0], [np.cosh(2), np.sinh(2)]).round(8)
    np.float64(2.0)
    """

    _name = "hyperbolic"
    _linear = True
    _negative = (0,)

    def __init__(self, n: int) -> None:
        super().__init__(n)

    def _element(self, g: Any) -> Any:
        g = super()._element(g)
        # The other matrices swap the two sheets.
        require(self, -g[..., 0, 0], 0.0, "−g[0, 0]", "Pass −g, which keeps the sheet x₀ > 0.")
        return g

    def _normal_tangent(self, p: ArrayLike, noise: Array) -> FloatArray:
        # Only at the middle is the metric that of the ambient numbers.
        middle = np.eye(1, self.point_shape[0])[0]
        noise[..., 0] = 0.0
        return self.transport(middle, p, noise)

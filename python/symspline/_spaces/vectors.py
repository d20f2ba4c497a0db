"""Euclidean space, spheres and hyperbolic spaces: spaces of constant curvature, whose points are vectors."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._typing import FloatArray
from .actions import Preserving, homogeneous, require
from .base import Array, Space


class Euclidean(Space[FloatArray]):
    """Euclidean space ℝⁿ.

    A point is an array of n numbers. Splines are the classical cubic splines.

    Parameters
    ----------
    n : int
        Dimension, at least 1.

    See Also
    --------
    Product : Combine Euclidean space with other spaces, such as rotations.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.Euclidean(2).distance([0, 0], [3, 4])
    np.float64(5.0)
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
    """The unit sphere Sⁿ.

    A point is a unit vector of n + 1 numbers. Distance is the angle between two vectors. S² describes directions and
    positions on a globe, and S³ unit quaternions. On S³, q and −q are different points; use `SpecialOrthogonal` for
    curves of rotations.

    Parameters
    ----------
    n : int
        Dimension, at least 1.

    See Also
    --------
    RealProjective : Lines, on which x and −x are the same point.
    SpecialOrthogonal : Rotations.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.Sphere(2).distance([1, 0, 0], [0, 1, 0]).round(8)
    np.float64(1.57079633)
    """

    _name = "sphere"
    _linear = True


class Hyperbolic(Preserving[FloatArray]):
    r"""Hyperbolic space Hⁿ as a hyperboloid.

    A point is an array (x₀, x₁, …, xₙ) with −x₀² + x₁² + … + xₙ² = −1 and x₀ > 0; the time-like coordinate comes
    first.

    Parameters
    ----------
    n : int
        Dimension, at least 1.

    See Also
    --------
    DeSitter : The analogous space for the opposite sign.
    ComplexHyperbolic : Complex hyperbolic space.

    Notes
    -----
    The rounding error of a point p is about :math:`\varepsilon \lVert p \rVert^2`. Points up to distance 15 from
    (1, 0, …) are supported; the error is about 10⁻³ there.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> ss.Hyperbolic(1).distance([1, 0], [np.cosh(2), np.sinh(2)]).round(8)
    np.float64(2.0)
    """

    _name = "hyperbolic"
    _linear = True
    _negative = (0,)

    def _element(self, g: Any) -> Any:
        g = super()._element(g)
        # Matrices with g₀₀ < 0 swap the two sheets of the hyperboloid.
        require(self, -g[..., 0, 0], 0.0, "−g[0, 0]", "Pass −g, which keeps the sheet x₀ > 0.")
        return g

    def _normal_tangent(self, p: ArrayLike, noise: Array) -> FloatArray:
        # The metric equals that of the ambient space at the origin (1, 0, …) only.
        middle = np.eye(1, self.point_shape[0])[0]
        noise[..., 0] = 0.0
        return self.transport(middle, p, noise)

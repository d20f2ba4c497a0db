"""Euclidean space, tori, spheres and hyperbolic spaces: spaces of constant curvature, whose points are vectors."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import as_array, dtype_tol, refuse
from .._base.typing import Array, FloatArray
from .._core import ValidationError
from .actions import Preserving, homogeneous, require
from .base import Space


class _Flat(Space[FloatArray]):
    """Vectors that are added."""

    def __init__(self, n: int) -> None:
        super().__init__(n)

    def _tol(self, array: Array) -> float:
        # Every vector is a point. The tolerance is used for the ends of closed curves. It does not depend on the number
        # of decimals, because angles may contain many turns.
        return dtype_tol(array.dtype)

    def _reflected(self, p: Array, x: Array) -> Array:
        return 2 * p - x

    def _element(self, g: Any) -> Any:
        return homogeneous(self, g, self.dim)

    def _moved(self, g: Array, x: Array) -> Array:
        return (g[..., :-1, :-1] @ x[..., None])[..., 0] + g[..., :-1, -1]


class Euclidean(_Flat):
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


class Torus(_Flat):
    r"""The flat torus Tⁿ, whose points are n angles.

    A point is an array of n angles in radians, such as wind directions or the torsion angles of a molecule. Angles that
    differ by whole turns are the same point. Input may have any number of turns, unless the rounding errors of the
    angles exceed the tolerance of points: 4.5e7 rad at 1e-8. Points that are returned are in (−π, π]. Use
    ``numpy.unwrap(spline(x), axis=-2)`` for angles without jumps.

    Parameters
    ----------
    n : int
        Number of angles, at least 1.

    See Also
    --------
    Euclidean : Angles that count whole turns.
    Sphere.from_angles : Unit vectors of the plane with given angles.

    Notes
    -----
    Neighbouring points are joined the shorter way around each circle, so that a step of 200° is one of −160°. Steps of
    exactly π in any angle raise `CutLocusError`. If angles turn by more than π between two samples, use `Euclidean` and
    angles that count turns, or `HermiteSpline` with measured velocities. Also use `Euclidean` for joints with stops,
    which cannot pass ±π: on a torus, a joint moves from 160° to −160° through 180°.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> spline = ss.CubicSpline(None, np.radians([[170.0, 0], [-170, 10], [-150, 20]]), "torus:2")
    >>> np.degrees(spline([0.25, 1.5])).round(8)
    array([[ 175. ,    2.5],
           [-160. ,   15. ]])
    """

    _name = "torus"
    _has_angles = True

    def _element(self, g: Any) -> Any:
        g = super()._element(g)
        linear = g[..., :-1, :-1]
        require(
            self,
            np.abs(linear - np.round(linear)).max(axis=(-2, -1)),
            1e-8,
            "the distance of its linear part from integers",
            "Pass [[A, b], [0, 1]] with a signed permutation A of the angles and angles b.",
        )
        return g


class Sphere(Preserving[FloatArray]):
    r"""The unit sphere Sⁿ.

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

    Notes
    -----
    With the length :math:`\theta` of v in the exponential, and the angle :math:`\theta` between p and q in the
    logarithm,

    .. math:: \exp_p(v) = \cos\theta\, p + \frac{\sin\theta}{\theta}\, v, \qquad
              \log_p(q) = \frac{\theta}{\sin\theta}\, (q - \cos\theta\, p).

    Antipodal points have no unique shortest geodesic.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.Sphere(2).distance([1, 0, 0], [0, 1, 0]).round(8)
    np.float64(1.57079633)
    """

    _name = "sphere"
    _linear = True

    def _extrinsic_means(self, points: Array, weights: FloatArray) -> Array | None:
        return np.tensordot(weights, points, 1)[None]

    def from_angles(self, angles: ArrayLike) -> FloatArray:
        """Convert angles to points of the circle, ``Sphere(1)``.

        Parameters
        ----------
        angles : array_like, any shape
            Angles in radians.

        Returns
        -------
        ndarray, shape (..., 2)
            The unit vectors (cos, sin).

        Raises
        ------
        ValidationError
            If the sphere is not ``Sphere(1)``, or an angle is not a finite number.

        See Also
        --------
        Sphere.as_angles : The inverse operation.
        Torus : Several angles as a point.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> ss.Sphere(1).from_angles([0.0, np.pi / 2]).round(15)
        array([[1., 0.],
               [0., 1.]])
        """
        self._require_circle("from_angles")
        given = as_array(angles, "angles")
        if given.dtype.kind not in "biuf":
            raise ValidationError(f"angles must be real numbers, not {given.dtype}")
        given = given.astype(np.float64)
        refuse(~np.isfinite(given), "angles", lambda i: f"is {given[i]}, but angles must be finite")
        return np.stack([np.cos(given), np.sin(given)], axis=-1)

    def as_angles(self, points: ArrayLike) -> FloatArray:
        """Convert points of the circle, ``Sphere(1)``, to angles.

        Parameters
        ----------
        points : array_like, shape (..., 2)
            Points.

        Returns
        -------
        ndarray, shape (...)
            Angles in radians, in (−π, π].

        Raises
        ------
        ValidationError
            If the sphere is not ``Sphere(1)``, or an array is not a point of it.

        See Also
        --------
        Sphere.from_angles : The inverse operation.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(1).as_angles([0.0, -1.0])
        np.float64(-1.5707963267948966)
        """
        self._require_circle("as_angles")
        self.check_point(points)
        x = self._doubles(points, "points")
        # A sine of −0 would give −π.
        angles: FloatArray = np.arctan2(x[..., 1] + 0.0, x[..., 0])
        return angles

    def _require_circle(self, method: str) -> None:
        if self.dim != 1:
            raise ValidationError(
                f"{method} converts angles on the circle, but this is {self!r}. Use Sphere(1).{method}."
            )


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
    With the Minkowski product :math:`\langle u, v \rangle = -u_0 v_0 + u_1 v_1 + \dots + u_n v_n`, the length
    :math:`\theta` of v in the exponential, and :math:`\cosh\theta = -\langle p, q \rangle` in the logarithm,

    .. math:: \exp_p(v) = \cosh\theta\, p + \frac{\sinh\theta}{\theta}\, v, \qquad
              \log_p(q) = \frac{\theta}{\sinh\theta}\, (q - \cosh\theta\, p).

    The rounding error of a point p is about :math:`\varepsilon \lVert p \rVert^2`. Points up to distance 15
    from (1, 0, …) are supported; the error is about :math:`10^{-3}` there.

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

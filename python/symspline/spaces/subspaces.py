"""Lines and subspaces: projective and complex hyperbolic spaces and Grassmannians, where many arrays are one
point."""

from __future__ import annotations

from .base import Space


class RealProjective(Space):
    """Real projective space RPⁿ, lines through the origin of Rⁿ⁺¹: points are unit vectors of n + 1
    numbers, of which x and −x are the same point. Distance is the angle between lines, at most π/2.

    >>> import symspline as ss
    >>> ss.RealProjective(2).distance([1, 0, 0], [-1, 0, 0]).round(8)
    np.float64(0.0)
    """

    _name = "rp"
    _linear = True

    def __init__(self, n: int) -> None:
        super().__init__(n)


class ComplexProjective(Space):
    """Complex projective space CPⁿ, pure quantum states of n + 1 levels: points are complex unit vectors
    of n + 1 numbers up to a phase, with the Fubini–Study metric: distance is arccos |⟨p, q⟩|.

    CP¹ is the Bloch sphere, of radius ½.

    >>> import symspline as ss
    >>> ss.ComplexProjective(1).distance([1, 0], [0.6, 0.8j]).round(8)
    np.float64(0.92729522)
    """

    _name = "cp"
    _linear = True

    def __init__(self, n: int) -> None:
        super().__init__(n)


class ComplexHyperbolic(Space):
    """Complex hyperbolic space CHⁿ: points are complex arrays (z₀, z₁, …, zₙ) with
    −|z₀|² + |z₁|² + … + |zₙ|² = −1 up to a phase, with the metric of curvature −4 along complex lines:
    distance is arcosh |⟨p, q⟩|.

    CH¹ is the hyperbolic plane with half its distances.

    >>> import numpy as np, symspline as ss
    >>> ss.ComplexHyperbolic(1).distance([1, 0], [np.cosh(2), 1j * np.sinh(2)]).round(8)
    np.float64(2.0)
    """

    _name = "ch"

    def __init__(self, n: int) -> None:
        super().__init__(n)


class Grassmannian(Space):
    """The Grassmannian Gr(k, n), k-dimensional subspaces of Rⁿ: points are n × k matrices with
    orthonormal columns, any basis of the subspace. Distance is √(Σ θᵢ²) of the principal angles.

    >>> import symspline as ss
    >>> ss.Grassmannian(2, 5).dim
    6
    """

    _name = "gr"
    _linear = True

    def __init__(self, k: int, n: int) -> None:
        super().__init__(k, n)


class ComplexGrassmannian(Space):
    """The complex Grassmannian, k-dimensional subspaces of Cⁿ: points are complex n × k matrices with
    orthonormal columns, any basis of the subspace.

    >>> import symspline as ss
    >>> ss.ComplexGrassmannian(2, 5).dim
    12
    """

    _name = "cgr"
    _linear = True

    def __init__(self, k: int, n: int) -> None:
        super().__init__(k, n)

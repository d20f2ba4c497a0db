"""Symmetric spaces whose invariant metric is indefinite: de Sitter and anti-de Sitter space, and the subspaces of an
indefinite form."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._typing import FloatArray, P
from .actions import Preserving, adjoint, matrices, preserves
from .base import Array, Space


class Indefinite(Space[P]):
    """A space with an invariant metric that is indefinite.

    Such a metric gives no lengths, so ``inner``, ``norm`` and ``distance`` do not use it. They are the Euclidean ones
    of arrays (see each class), depend on the coordinate system, and serve for reporting only; `curvature` is NaN.
    Splines do not depend on them: they commute with every isometry of the indefinite metric.
    """

    def invariant_form(self, p: ArrayLike, u: ArrayLike, v: ArrayLike) -> FloatArray:
        """Evaluate the invariant indefinite metric.

        Parameters
        ----------
        p : array_like, shape (..., *point_shape)
            Points.
        u, v : array_like, shape (..., *point_shape)
            Tangent vectors at p.

        Returns
        -------
        numpy.ndarray, shape (...)
            The metric of u and v, which may be negative or zero also for u = v. Parallel transport and isometries
            preserve it.

        Examples
        --------
        A time-like, a null and a space-like vector:

        >>> import symspline as ss
        >>> v = [[1.0, 0, 0], [1, 0, 1], [0, 0, 1]]
        >>> ss.DeSitter(2).invariant_form([0, 1, 0], v, v)
        array([-1.,  0.,  1.])
        """
        arrays = {name: self._doubles(x, name) for name, x in (("p", p), ("u", u), ("v", v))}
        lead = self._leads({name: x.shape for name, x in arrays.items()})
        result = self._form(arrays["u"], arrays["v"])
        return np.broadcast_to(result, lead)[()].copy()

    def distance(self, p: ArrayLike, q: ArrayLike) -> FloatArray:
        """Return the size of ``log(p, q)``, by ``norm``; shape of the leading axes.

        Raises
        ------
        CutLocusError
            If not exactly one geodesic joins the two points.
        """
        return self.norm(p, self.log(p, q))

    def _form(self, u: Array, v: Array) -> Array:
        raise NotImplementedError


class DeSitter(Indefinite[FloatArray], Preserving[FloatArray]):
    """De Sitter space dSⁿ, n ≥ 2: arrays (x₀, x₁, …, xₙ) with −x₀² + x₁² + … + xₙ² = 1, the time-like coordinate first.

    The metric ⟨u, v⟩ = −u₀v₀ + u₁v₁ + … + uₙvₙ has one negative square, the group of isometries is O(1, n), and the
    curvature is 1. Geodesics are trigonometric, straight or hyperbolic as their velocity is space-like, null or
    time-like. Points with ⟨p, q⟩ > −1 are joined by one geodesic of less than half a turn; no geodesic joins points
    with ⟨p, q⟩ < −1. Space-like geodesics are closed.

    ``invariant_form`` is the metric. It gives no lengths, so that ``inner``, ``norm`` and ``distance`` are those of
    the arrays of numbers: `distance(p, q)` is the size of `log(p, q)`, and not symmetric. Rounding errors of a point
    are ε|p|².

    >>> import numpy as np, symspline as ss
    >>> ss.DeSitter(2).log([0, 1, 0], [np.sinh(2), np.cosh(2), 0]).round(8)
    array([2., 0., 0.])
    >>> ss.DeSitter(2).log([0, 1, 0], [3, 1, 3])  # null
    array([3., 0., 3.])
    """

    _name = "ds"
    _negative = (0,)

    def __init__(self, n: int) -> None:
        super().__init__(n)

    def _form(self, u: Array, v: Array) -> Array:
        return np.asarray((u[..., 1:] * v[..., 1:]).sum(axis=-1) - u[..., 0] * v[..., 0])


class AntiDeSitter(Indefinite[FloatArray], Preserving[FloatArray]):
    """Anti-de Sitter space AdSⁿ, n ≥ 2: arrays (x₀, x₁, …, xₙ) with −x₀² − x₁² + x₂² + … + xₙ² = −1, the two
    time-like coordinates first.

    The metric is the form −u₀v₀ − u₁v₁ + u₂v₂ + … + uₙvₙ on tangent vectors, where it has one negative square. The
    group of isometries is O(2, n − 1), and the curvature is −1. Geodesics are trigonometric, straight or hyperbolic
    as their velocity is time-like, null or space-like. Points with ⟨p, q⟩ < 1 are joined by one geodesic of less than
    half a turn; no geodesic joins points with ⟨p, q⟩ > 1. Time-like geodesics are closed.

    ``invariant_form`` is the metric. It gives no lengths, so that ``inner``, ``norm`` and ``distance`` are those of
    the arrays of numbers: `distance(p, q)` is the size of `log(p, q)`, and not symmetric. Rounding errors of a point
    are ε|p|².

    >>> import numpy as np, symspline as ss
    >>> ss.AntiDeSitter(2).log([1, 0, 0], [np.cos(2), np.sin(2), 0]).round(8)
    array([0., 2., 0.])
    """

    _name = "ads"
    _negative = (0, 1)

    def __init__(self, n: int) -> None:
        super().__init__(n)

    def _form(self, u: Array, v: Array) -> Array:
        return np.asarray((u[..., 2:] * v[..., 2:]).sum(axis=-1) - (u[..., :2] * v[..., :2]).sum(axis=-1))


class IndefiniteGrassmannian(Indefinite[FloatArray]):
    """Subspaces of R^{p,q} on which the form has signature (a, b): O(p, q) / (O(a, b) × O(p − a, q − b)).

    Of both signatures the number of negative squares comes first: the form is −x₁² − … − x_p² + x_{p+1}² + …, and on a
    subspace it has a negative and b positive squares. A point is the reflection P of the subspace, which is 1 on it and
    −1 on its orthogonal complement: a (p + q) × (p + q) matrix with P² = 1 that preserves the form.
    `symspline.convert.basis_to_reflection` makes reflections of bases.

    Geodesics are P exp(tΩ), as in `GeneralLinear`, and ``log(P, Q) = P log(PQ)`` exists while no eigenvalue of PQ is a
    negative number. ``invariant_form`` is the metric, ⟨u, v⟩ = tr(uv)/8: on a line spanned by x, with the velocity v
    orthogonal to x, it is ⟨v, v⟩/⟨x, x⟩. It gives no lengths; ``inner``, ``norm`` and ``distance`` are those of Ω =
    P⁻¹v as an array of numbers. ``igr:0,1,1,n`` is `DeSitter` with x and −x as one point, ``igr:1,0,2,n-1`` is
    `AntiDeSitter`.

    >>> import symspline as ss
    >>> space = ss.IndefiniteGrassmannian(0, 1, 1, 2)
    >>> space.dim, space.point_shape
    (2, (3, 3))
    >>> ss.convert.basis_to_reflection([[3.0], [1], [3]], negative=1).round(12)
    array([[-19.,   6.,  18.],
           [ -6.,   1.,   6.],
           [-18.,   6.,  17.]])
    """

    _name = "igr"

    def __init__(self, a: int, b: int, p: int, q: int) -> None:
        super().__init__(a, b, p, q)

    def _reflected(self, p: Array, x: Array) -> Any:
        return p @ x @ p

    def _element(self, g: Any) -> Any:
        _, _, negative, positive = self._parameters
        array, tol = matrices(self, g, negative + positive, np.float64)
        form = np.diag([-1.0] * negative + [1.0] * positive)
        preserves(self, array, form, tol, "Pass a matrix with gᵀJg = J, J = diag(−1, …, −1, 1, …, 1).")
        return array

    def _moved(self, g: Array, x: Array) -> Any:
        # g x g⁻¹.
        return adjoint(np.linalg.solve(adjoint(g), adjoint(g @ x)))

    def _form(self, u: Array, v: Array) -> Array:
        return np.asarray(np.einsum("...ij,...ji->...", u, v) / 8)

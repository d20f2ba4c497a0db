"""Symmetric spaces whose invariant metric is indefinite.

De Sitter space, anti-de Sitter space, and the subspaces of an indefinite form.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import adjoint
from .._base.typing import Array, FloatArray, P
from .actions import Preserving, matrices, preserves
from .base import Space


class Indefinite(Space[P]):
    """Base class of spaces whose invariant metric is indefinite.

    Such a metric does not give lengths, so ``inner``, ``norm`` and ``distance`` do not use it. They are Euclidean ones
    of arrays (see each class), depend on the coordinate system, and serve for reporting only. `curvature` is NaN.
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
        """Compute the length of ``log(p, q)`` with the norm at p.

        The invariant metric does not give distances. This number depends on the coordinate system, and it is not
        symmetric in p and q.

        Parameters
        ----------
        p, q : array_like, shape (..., *point_shape)
            Points.

        Returns
        -------
        ndarray or float, shape (...)
            The number ``norm(p, log(p, q))``.

        Raises
        ------
        CutLocusError
            If not exactly one geodesic joins the two points.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.DeSitter(2).distance([0, 1, 0], [3, 1, 3]).round(8)
        np.float64(4.24264069)
        """
        return self.norm(p, self.log(p, q))

    def _form(self, u: Array, v: Array) -> Array:
        raise NotImplementedError


class DeSitter(Indefinite[FloatArray], Preserving[FloatArray]):
    r"""De Sitter space dSⁿ.

    A point is an array (x₀, x₁, …, xₙ) with −x₀² + x₁² + … + xₙ² = 1; the time-like coordinate comes first.

    Parameters
    ----------
    n : int
        Dimension, at least 2.

    See Also
    --------
    AntiDeSitter : The analogous space with two time-like coordinates.
    Hyperbolic : The hyperboloid of the opposite sign.

    Notes
    -----
    The invariant metric :math:`-u_0 v_0 + u_1 v_1 + \dots + u_n v_n` has one negative square, and its
    curvature is 1. The group of isometries is :math:`O(1, n)`. Geodesics are trigonometric, straight or hyperbolic if
    their velocity is space-like, null or time-like, respectively. Points with :math:`\langle p, q \rangle > -1` are
    joined by one geodesic of less than half a turn. No geodesic joins points with :math:`\langle p, q \rangle < -1`.
    Space-like geodesics are closed.

    ``invariant_form`` evaluates the metric. It does not give lengths, so ``inner``, ``norm`` and ``distance`` are
    Euclidean ones of the arrays. ``distance(p, q)`` is the length of ``log(p, q)`` and is not symmetric. The rounding
    error of a point is about :math:`\varepsilon \lVert p \rVert^2`.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> ss.DeSitter(2).log([0, 1, 0], [np.sinh(2), np.cosh(2), 0]).round(8) + 0
    array([2., 0., 0.])
    >>> ss.DeSitter(2).log([0, 1, 0], [3, 1, 3])  # null
    array([3., 0., 3.])
    """

    _name = "ds"
    _negative = (0,)

    def _form(self, u: Array, v: Array) -> Array:
        return np.asarray((u[..., 1:] * v[..., 1:]).sum(axis=-1) - u[..., 0] * v[..., 0])


class AntiDeSitter(Indefinite[FloatArray], Preserving[FloatArray]):
    r"""Anti-de Sitter space AdSⁿ.

    A point is an array (x₀, x₁, …, xₙ) with −x₀² − x₁² + x₂² + … + xₙ² = −1; the two time-like coordinates come first.

    Parameters
    ----------
    n : int
        Dimension, at least 2.

    See Also
    --------
    DeSitter : The analogous space with one time-like coordinate.

    Notes
    -----
    The invariant metric is the form :math:`-u_0 v_0 - u_1 v_1 + u_2 v_2 + \dots + u_n v_n`. On tangent
    vectors it has one negative square, and its curvature is −1. The group of isometries is :math:`O(2, n - 1)`.
    Geodesics are trigonometric, straight or hyperbolic if their velocity is time-like, null or space-like,
    respectively. Points with :math:`\langle p, q \rangle < 1` are joined by one geodesic of less than half a turn. No
    geodesic joins points with :math:`\langle p, q \rangle > 1`. Time-like geodesics are closed.

    ``invariant_form`` evaluates the metric. It does not give lengths, so ``inner``, ``norm`` and ``distance`` are
    Euclidean ones of the arrays. ``distance(p, q)`` is the length of ``log(p, q)`` and is not symmetric. The rounding
    error of a point is about :math:`\varepsilon \lVert p \rVert^2`.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> ss.AntiDeSitter(2).log([1, 0, 0], [np.cos(2), np.sin(2), 0]).round(8)
    array([0., 2., 0.])
    """

    _name = "ads"
    _negative = (0, 1)

    def _form(self, u: Array, v: Array) -> Array:
        return np.asarray((u[..., 2:] * v[..., 2:]).sum(axis=-1) - (u[..., :2] * v[..., :2]).sum(axis=-1))


class IndefiniteGrassmannian(Indefinite[FloatArray]):
    r"""Subspaces on which an indefinite form of signature (p, q) has signature (a, b).

    The form on ℝᵖ⁺ᑫ is −x₁² − … − x_p² + x_{p+1}² + …: in both signatures the number of negative squares comes first.
    A point is the reflection P in a subspace, which is 1 on it and −1 on its orthogonal complement. It is a square
    matrix of size p + q with P² = 1 that preserves the form. `symspline.convert.basis_to_reflection` converts bases
    to reflections.

    Parameters
    ----------
    a, b : int
        Signature of the form on the subspaces.
    p, q : int
        Signature of the form on the ambient space.

    See Also
    --------
    Grassmannian : Subspaces of a Euclidean space.

    Notes
    -----
    The space is :math:`O(p, q) / (O(a, b) \times O(p - a, q - b))`. Geodesics are :math:`P \exp(t\Omega)`,
    as in `GeneralLinear`, and :math:`\log_P(Q) = P \log(PQ)` exists unless PQ has a negative eigenvalue.
    ``invariant_form`` evaluates the metric :math:`\langle u, v \rangle = \operatorname{tr}(uv)/8`. On a line spanned by
    x, with the velocity v orthogonal to x, it is :math:`\langle v, v \rangle / \langle x, x \rangle`. It does not give
    lengths; ``inner``, ``norm`` and ``distance`` are those of :math:`\Omega = P^{-1}v` as an array of numbers.

    ``igr:0,1,1,n`` is `DeSitter` with x and −x as one point, and ``igr:1,0,2,n-1`` is `AntiDeSitter` with the same
    identification.

    Examples
    --------
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

    def _reflected(self, p: Array, x: Array) -> Array:
        return p @ x @ p

    def _element(self, g: Any) -> Any:
        _, _, negative, positive = self._parameters
        array, tol = matrices(self, g, negative + positive, np.float64)
        form = np.diag([-1.0] * negative + [1.0] * positive)
        preserves(self, array, form, tol, "Pass a matrix with gᵀJg = J, J = diag(−1, …, −1, 1, …, 1).")
        return array

    def _moved(self, g: Array, x: Array) -> Array:
        # g x g⁻¹.
        return adjoint(np.linalg.solve(adjoint(g), adjoint(g @ x)))

    def _form(self, u: Array, v: Array) -> Array:
        return np.asarray(np.einsum("...ij,...ji->...", u, v) / 8)

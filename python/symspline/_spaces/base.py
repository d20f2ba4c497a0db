"""Operations that all spaces share, and the conversion of arrays for the compiled core."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from functools import cached_property, wraps
from inspect import signature
from typing import Any, ClassVar, Generic, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import as_array, cast, point_tol, refuse, short_repr, whole_number
from .._base.typing import Array, FloatArray, P, PointsLike
from .._core import Handle, ValidationError
from .statistics import Groups, Whitening, geometric_median, grouped, groups_of, karcher_mean, require_metric, take

Doubles = FloatArray

# From this ambient dimension on, frames of the whole tangent space are not computed.
LARGE = 256
# Operations whose result is one number per point.
_NUMBERS = ("distance", "cut_fraction", "inner", "rounding")
# Largest number of entries of a point: 8 TB.
_MOST = 2**40


# The classes of all spaces except products, by name.
CLASSES: dict[str, type[AnySpace]] = {}
# Functions that read names of spaces derived from others, by a text that only such names contain.
DERIVED: dict[str, Callable[[str], AnySpace]] = {}
# Complex counterparts of real spaces, for the message about complex points.
COMPLEX_TWINS = {
    "rp": "ComplexProjective",
    "gr": "ComplexGrassmannian",
    "o": "Unitary",
    "so": "SpecialUnitary",
    "spd": "HermitianPositiveDefinite",
    "sphere": "ComplexProjective",
}


class Space(Generic[P]):
    """Base class of symmetric spaces.

    All methods work on arrays of points, whose leading axes broadcast. Tangent vectors are arrays with the shape of
    points. ``str(space)`` is the name that `space` reads back, and ``repr(space)`` is the constructor call.

    Parameters
    ----------
    *parameters : int
        Parameters of the space, such as its dimension. Only subclasses can be instantiated.

    See Also
    --------
    space : Return a space by its name.
    Manifold : A manifold given by functions.
    Product : The product of spaces.

    Notes
    -----
    A symmetric space is a manifold on which every point p has an isometry that fixes p and reverses all geodesics
    through p, the geodesic symmetry. The subclasses include all spaces of Table 1 of the paper.

    References
    ----------
    G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
    Anal. 56 (2018), Section 2 and Table 1.

    Examples
    --------
    >>> import symspline as ss
    >>> sphere = ss.Sphere(2)
    >>> sphere.point_shape, sphere.dim, str(sphere)
    ((3,), 2, 'sphere:2')
    """

    _name: ClassVar[str]
    # Further names of spaces that the compiled core does not implement.
    _aliases: ClassVar[tuple[str, ...]] = ()
    # Whether points are vectors or bases of subspaces, so that curves stay in the linear span of their points.
    _linear: ClassVar[bool] = False
    # Whether curves are computed in the span of their points, since the dimension is large.
    _is_large: bool = False
    # Whether the space, or a factor of a product, is a quotient.
    _has_quotients: bool = False
    # Whether points of the space are made of functions in Python.
    _in_python: ClassVar[bool] = False
    _handle: Handle
    _parameters: tuple[int, ...]
    _complex: bool
    _dtype: np.dtype[np.float64] | np.dtype[np.complex128]
    # Shape of the floating-point numbers of one point; a complex number is two.
    _doubles_shape: tuple[int, ...]
    # The axes of a point among those of an array, counted from the last one.
    _point_axes: tuple[int, ...]

    def __init__(self, *parameters: int) -> None:
        if not hasattr(type(self), "_name"):
            raise TypeError(
                f"{type(self).__name__} is abstract and takes no arguments. Use a subclass, such as Sphere(2)."
            )
        for value in parameters:
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 0:
                raise ValidationError(
                    f"the parameters of {type(self).__name__} must be integers >= 0, not {short_repr(value)}"
                )
        self._parameters = tuple(int(value) for value in parameters)
        try:
            self._handle = Handle(self._name, list(self._parameters))
        except OverflowError:
            raise ValidationError(f"{self!r} is too large") from None
        self._point_shape = tuple(self._handle.point_shape())
        if max(self._parameters, default=0) >= _MOST or math.prod(self._point_shape) >= _MOST:
            raise ValidationError(f"{self!r} is too large: one point would not fit into memory")
        self._is_large = self._linear and self._point_shape[0] >= LARGE
        self._complex = self._handle.is_complex()
        self._dtype = np.dtype(np.complex128) if self._complex else np.dtype(np.float64)
        *first, last = self._point_shape
        self._doubles_shape = (*first, 2 * last if self._complex else last)
        self._point_axes = tuple(range(-len(self._point_shape), 0))

    # ---- properties ----

    @property
    def point_shape(self) -> tuple[int, ...]:
        """Shape of the array of one point."""
        return self._point_shape

    @property
    def dim(self) -> int:
        """Dimension of the manifold."""
        return self._handle.dim()

    @property
    def injectivity_radius(self) -> float:
        """Distance below which two points are joined by a unique shortest geodesic."""
        return self._handle.injectivity_radius()

    @property
    def curvature(self) -> float:
        """K of (22) in the paper, a bound of the curvature.

        It is 0 for flat space and 1/r for a sphere of radius r. It is NaN for spaces without an invariant metric that
        is positive definite, such as poses.
        """
        return self._handle.curvature()

    @property
    def dtype(self) -> np.dtype[np.float64] | np.dtype[np.complex128]:
        """Type of the numbers of a point, float64 or complex128."""
        return self._dtype

    @cached_property
    def _text(self) -> str:
        # Cached because spaces are compared by name several times during a fit.
        return f"{self._name}:{','.join(map(str, self._parameters))}"

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(map(str, self._parameters))})"

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Space) and type(self) is type(other) and self._text == other._text)

    def __hash__(self) -> int:
        return hash(self._text)

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), self._parameters

    # ---- geometry ----

    def exp(self, p: ArrayLike, v: ArrayLike) -> P:
        r"""Follow the geodesic from p with velocity v for unit time.

        Parameters
        ----------
        p : array_like, shape (..., *point_shape)
            Points.
        v : array_like, shape (..., *point_shape)
            Tangent vectors at p.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            The points :math:`\exp_p(v)`.

        Raises
        ------
        ValidationError
            If an array does not have the shape of points, or if the result is not finite.

        See Also
        --------
        Space.log : The inverse operation.
        Space.geodesic : Evaluate the geodesic between two points.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).exp([1, 0, 0], [0, ss.Sphere(2).injectivity_radius / 2, 0]).round(15)
        array([0., 1., 0.])
        """
        return self._finite("exp", p=p, v=v)

    def log(self, p: ArrayLike, q: ArrayLike) -> P:
        r"""Compute the velocity at p of the geodesic that reaches q in unit time.

        Parameters
        ----------
        p, q : array_like, shape (..., *point_shape)
            Points.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            The tangent vectors :math:`\log_p(q)`.

        Raises
        ------
        ValidationError
            If an array does not have the shape of points, or if the result is not finite.
        CutLocusError
            If two points lie at or past each other's cut locus.

        See Also
        --------
        Space.exp : The inverse operation.

        References
        ----------
        G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
        Anal. 56 (2018), equation (11).

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).log([1, 0, 0], [0, 1, 0]).round(8)
        array([0.        , 1.57079633, 0.        ])
        """
        return self._finite("log", p=p, q=q)

    def geodesic(self, p: ArrayLike, q: ArrayLike, t: ArrayLike) -> P:
        """Evaluate the geodesic from p to q at times t.

        Parameters
        ----------
        p, q : array_like, shape (..., *point_shape)
            Points.
        t : array_like, shape (...)
            Times: 0 gives p, and 1 gives q. They broadcast against the leading axes of p and q.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            The points :math:`[p, q]_t` in the notation of the paper.

        Raises
        ------
        ValidationError
            If an array does not have the required shape, or if the result is not finite.
        CutLocusError
            If two points lie at or past each other's cut locus.

        See Also
        --------
        Space.log : Compute the velocity of this geodesic.

        References
        ----------
        G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
        Anal. 56 (2018), equation (6).

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).geodesic([1, 0, 0], [0, 1, 0], 0.5).round(8)
        array([0.70710678, 0.70710678, 0.        ])
        """
        times = as_array(t, "t")
        if times.dtype.kind not in "biuf":
            raise ValidationError(f"t must be real numbers, not {times.dtype}")
        return self._finite("geodesic", t=cast(times), p=p, q=q)

    def distance(self, p: ArrayLike, q: ArrayLike) -> FloatArray:
        """Compute the length of the shortest geodesic between p and q.

        Parameters
        ----------
        p, q : array_like, shape (..., *point_shape)
            Points.

        Returns
        -------
        ndarray or float, shape (...)
            Distances.

        Raises
        ------
        ValidationError
            If an array does not have the shape of points, or if the result is not finite.

        See Also
        --------
        Space.norm : Compute the length of a tangent vector.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).distance([1, 0, 0], [[0, 1, 0], [-1, 0, 0]]).round(8)
        array([1.57079633, 3.14159265])
        """
        return self._finite("distance", p=p, q=q)

    def transvection(self, p: ArrayLike, v: ArrayLike, x: ArrayLike) -> P:
        r"""Move points x by the transvection along a geodesic.

        Parameters
        ----------
        p : array_like, shape (..., *point_shape)
            Points at which the geodesics start.
        v : array_like, shape (..., *point_shape)
            Tangent vectors at p.
        x : array_like, shape (..., *point_shape)
            Points to move.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            The points :math:`E_p(v) \cdot x`. The transvection moves p to :math:`\exp_p(v)`.

        Raises
        ------
        ValidationError
            If an array does not have the shape of points, or if the result is not finite.

        See Also
        --------
        Space.symmetry : Apply the geodesic symmetry at a point.
        Space.act : Apply an element of the group of the space.

        References
        ----------
        G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
        Anal. 56 (2018), equation (10).

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> ss.Sphere(2).transvection([1, 0, 0], [0, np.pi / 2, 0], [0, 1, 0]).round(15) + 0.0
        array([-1.,  0.,  0.])
        """
        return self._finite("transvection", p=p, v=v, x=x)

    def transport(self, p: ArrayLike, q: ArrayLike, v: ArrayLike) -> P:
        """Transport tangent vectors in parallel along the geodesic from p to q.

        Parameters
        ----------
        p, q : array_like, shape (..., *point_shape)
            Points.
        v : array_like, shape (..., *point_shape)
            Tangent vectors at p.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            Tangent vectors at q.

        Raises
        ------
        ValidationError
            If an array does not have the shape of points, or if the result is not finite.
        CutLocusError
            If two points lie at or past each other's cut locus.

        See Also
        --------
        CubicSpline.transport : Transport tangent vectors along a curve.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).transport([1, 0, 0], [0, 1, 0], [0, 1, 2]).round(15) + 0.0
        array([-1.,  0.,  2.])
        """
        return self._finite("transport", p=p, q=q, v=v)

    def symmetry(self, p: ArrayLike, x: ArrayLike) -> P:
        """Apply the geodesic symmetry at p to points x.

        The symmetry reverses every geodesic through p. It is computed without a logarithm, so that it is also
        defined where x is at the cut locus of p.

        Parameters
        ----------
        p, x : array_like, shape (..., *point_shape)
            Points. Leading axes broadcast. On a `Product`, tuples of such arrays.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            The points :math:`\\sigma_p(x) = \\exp_p(-\\log_p(x))`. On a `Product`, a tuple of arrays.

        Raises
        ------
        ValidationError
            If the arrays do not have the shape of points, or if the space is a `Manifold`, which need not be
            symmetric.

        See Also
        --------
        transvection : The composition of two symmetries.
        act : Apply an element of the group of the space.

        Notes
        -----
        The symmetry is :math:`2p - x` in flat space; the reflection :math:`2P - 1` in the line or subspace p, with
        its orthogonal projection P, on spheres, hyperbolic and projective spaces and Grassmannians; and
        :math:`p x^{-1} p` for groups and positive definite matrices. It is the function :math:`I_p` of Lemma A.3
        of the paper, and :math:`E_p(v) = \\sigma_m \\sigma_p` with the midpoint :math:`m = \\exp_p(v/2)`.

        References
        ----------
        G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J.
        Numer. Anal. 56 (2018), Appendix A.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).symmetry([0, 0, 1], [0.6, 0.0, 0.8])
        array([-0.6,  0. ,  0.8])
        """
        return self._isometric("symmetry", self._reflected, p=p, x=x)

    def act(self, g: ArrayLike | tuple[Any, ...], x: ArrayLike) -> P:
        """Apply an element g of the group of the space to points x.

        Every element is an isometry, or on groups without a metric an automorphism of the connection: the spline
        through the points ``space.act(g, points)`` is the image of the spline through ``points``.

        Parameters
        ----------
        g : array_like, or tuple of array_like
            Element of the group, in the form that Notes gives for each space. Leading axes of matrices broadcast
            against those of x. On a `Product`, a tuple with one element per factor.
        x : array_like, shape (..., *point_shape)
            Points. On a `Product`, a tuple of such arrays.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            The points g · x. On a `Product`, a tuple of arrays.

        Raises
        ------
        ValidationError
            If g does not have the required form or is not in the group, within the same tolerance as for points,
            or if the space is a `Manifold`.

        See Also
        --------
        symmetry : Apply the geodesic symmetry at a point.
        transvection : The group element that moves points along a geodesic.

        Notes
        -----
        The groups are those of Table 1 of the paper:

        ==================================================  ===========================================  =========
        space                                               g                                            g · x
        ==================================================  ===========================================  =========
        `Euclidean`                                         (A, b; 0, 1), A orthogonal                   A x + b
        `Sphere`, `RealProjective`, `Grassmannian`          orthogonal matrix                            g x
        `ComplexProjective`, `ComplexGrassmannian`          unitary matrix                               g x
        `QuaternionicProjective`                            unitary matrix of n + 1 by n + 1             g x
                                                            quaternions, as 2 × 2 complex blocks
        `Hyperbolic`, `ComplexHyperbolic`                   g*Jg = J, J = diag(−1, 1, …, 1); for         g x
                                                            `Hyperbolic` with g₀₀ > 0
        `Torus`                                             (A, b; 0, 1), A a signed permutation         A x + b
        `SymmetricPositiveDefinite`                         invertible matrix                            g x gᵀ
        `LogEuclidean`                                      multiple of an orthogonal matrix             g x gᵀ
        `HermitianPositiveDefinite`                         invertible matrix                            g x g*
        `SpecialPositiveDefinite`                           matrix of determinant ±1                     g x gᵀ
        `Siegel`                                            symplectic matrix                            g x gᵀ
        all groups                                          pair (a, b) of elements of the group         a x b⁻¹
        ==================================================  ===========================================  =========

        References
        ----------
        G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J.
        Numer. Anal. 56 (2018), Table 1 and equation (9).

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> quarter_turn = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
        >>> ss.Sphere(2).act(quarter_turn, [[1, 0, 0], [0, 0, 1]]) + 0.0
        array([[0., 1., 0.],
               [0., 0., 1.]])
        >>> ss.SpecialOrthogonal(3).act((quarter_turn, np.eye(3)), np.eye(3)).shape
        (3, 3)
        """
        # The checks report matrices that are too large or singular.
        with np.errstate(all="ignore"):
            element = self._element(g)
        return self._isometric("act", lambda x: self._moved(element, x), x=x)

    def _isometric(self, name: str, function: Callable[..., Array], **inputs: ArrayLike) -> P:
        """Apply a formula to arrays of points, and project the result onto the space to remove rounding errors."""
        arrays = {key: self._numbers(self._doubles(value, key)) for key, value in inputs.items()}
        self._leads({key: array.shape for key, array in arrays.items()})
        try:
            with np.errstate(all="ignore"):
                result = self._apply("project", x=function(*arrays.values()))
        except np.linalg.LinAlgError as error:
            raise ValidationError(f"{name} failed: a matrix is not a point of {self!r} ({error})") from None
        except ValueError as error:
            if isinstance(error, ValidationError):
                raise
            raise ValidationError(f"the leading axes of g and x {np.shape(inputs['x'])} do not broadcast") from None
        points: P = self._require_finite(name, result)
        return points

    # The classes in `actions` define these methods for `symmetry` and `act`.

    def _reflected(self, p: Array, x: Array) -> Array:
        raise self._not_symmetric("geodesic symmetries")

    def _element(self, g: Any) -> Any:
        """Return the argument of `act` as checked arrays."""
        raise self._not_symmetric("group")

    def _moved(self, g: Any, x: Array) -> Array:
        raise self._not_symmetric("group")

    def _not_symmetric(self, what: str) -> ValidationError:
        return ValidationError(f"{self!r} is not known to be symmetric: it has no {what}")

    def inner(self, p: ArrayLike, u: ArrayLike, v: ArrayLike) -> FloatArray:
        """Compute the inner product of two tangent vectors at p.

        Parameters
        ----------
        p : array_like, shape (..., *point_shape)
            Points.
        u, v : array_like, shape (..., *point_shape)
            Tangent vectors at p.

        Returns
        -------
        ndarray or float, shape (...)
            Inner products.

        Raises
        ------
        ValidationError
            If an array does not have the shape of points, or if the result is not finite.

        See Also
        --------
        Space.norm : Compute the length of a tangent vector.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).inner([1, 0, 0], [0, 1, 2], [0, 3, 4])
        np.float64(11.0)
        """
        return self._finite("inner", p=p, u=u, v=v)

    def norm(self, p: ArrayLike, v: ArrayLike) -> FloatArray:
        """Compute the length of a tangent vector at p.

        Parameters
        ----------
        p : array_like, shape (..., *point_shape)
            Points.
        v : array_like, shape (..., *point_shape)
            Tangent vectors at p.

        Returns
        -------
        ndarray or float, shape (...)
            Lengths.

        Raises
        ------
        ValidationError
            If an array does not have the shape of points, or if the result is not finite.

        See Also
        --------
        Space.inner : Compute the inner product of two tangent vectors.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).norm([1, 0, 0], [0, 3, 4])
        np.float64(5.0)
        """
        result: FloatArray = np.sqrt(np.maximum(self._finite("inner", p=p, v=v, again=v), 0.0))
        return result

    # ---- membership ----

    def project(self, x: ArrayLike) -> P:
        """Project arrays near the manifold onto it.

        Parameters
        ----------
        x : array_like, shape (..., *point_shape)
            Arrays near points of the space, such as points with rounding errors.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            Points of the space.

        Raises
        ------
        ValidationError
            If x is not finite or has no point close to it, such as a zero vector on a sphere.

        See Also
        --------
        Space.check_point : Check whether arrays are points.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).project([3, 0, 4])
        array([0.6, 0. , 0.8])
        """
        result: Any = self._apply("project", x=x)
        good = self._where_finite(result) & self._where_finite(cast(self._array(x, "x"), self.dtype))
        why = "cannot be projected: it is not finite, or no point of"
        refuse(~good, "x", lambda _: f"{why} {self!r} is close to it")
        try:
            self.check_point(result)
        except ValidationError as error:
            raise ValidationError(f"x cannot be projected; for the nearest array, {error}") from None
        points: P = result
        return points

    def project_tangent(self, p: ArrayLike, v: ArrayLike) -> P:
        """Project arrays onto the tangent space at p.

        Parameters
        ----------
        p : array_like, shape (..., *point_shape)
            Points.
        v : array_like, shape (..., *point_shape)
            Arrays with the shape of points.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            Tangent vectors at p.

        Raises
        ------
        ValidationError
            If an array does not have the shape of points, or if the result is not finite.

        See Also
        --------
        Space.check_tangent : Check whether arrays are tangent vectors.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).project_tangent([1, 0, 0], [5, 1, 2])
        array([0., 1., 2.])
        """
        return self._finite("project_tangent", p=p, v=v)

    def _rounding(self, p: ArrayLike) -> FloatArray:
        """Return the distance between neighbouring floating-point points at p in units of 2.2e-16.

        The result has the shape of the leading axes. It is |p|² in hyperbolic space, tr p · tr p⁻¹ (about the
        condition) for positive definite matrices, the length of vectors and translations, and at least 1.
        """
        return self._apply("rounding", p=p)

    def check_point(self, p: ArrayLike) -> None:
        """Raise an exception unless all arrays are points of the space.

        Parameters
        ----------
        p : array_like, shape (..., *point_shape)
            Arrays to check.

        Raises
        ------
        ValidationError
            If an array is farther from the manifold than the accuracy of its numbers allows: 1e-8 in double precision,
            1e-4 for numbers of single precision or of at most nine significant digits. The message names its index.

        See Also
        --------
        Space.project : Project arrays onto the manifold.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).check_point([0.6, 0, 0.8])
        """
        array = self._doubles(p, "p")
        lead = self._lead(array)
        self._handle.check_points(self._rows(array, lead), lead, self._tol(self._array(p, "p")))

    def check_tangent(self, p: ArrayLike, v: ArrayLike) -> None:
        """Raise an exception unless all arrays are tangent vectors.

        Parameters
        ----------
        p : array_like, shape (..., *point_shape)
            Points.
        v : array_like, shape (..., *point_shape)
            Arrays to check.

        Raises
        ------
        ValidationError
            If p is not a point, or if the normal component of v exceeds the tolerance of `check_point`. The message
            names the index.

        See Also
        --------
        Space.project_tangent : Project arrays onto a tangent space.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).check_tangent([1, 0, 0], [0, 2, 3])
        """
        self.check_point(p)
        points, vectors = self._doubles(p, "p"), self._doubles(v, "v")
        try:
            lead = np.broadcast_shapes(self._lead(points), self._lead(vectors))
        except ValueError:
            raise ValidationError(f"p {np.shape(p)} and v {np.shape(v)} do not broadcast") from None
        defects = self._handle.tangent_defects(self._rows(points, lead), self._rows(vectors, lead))
        tol = max(self._tol(self._array(value, name)) for value, name in ((p, "p"), (v, "v")))
        bad = np.flatnonzero(~(defects <= tol))
        if bad.size:
            index = ",".join(map(str, np.unravel_index(bad[0], lead)))
            raise ValidationError(
                f"vector {index or 'v'} is not tangent at its point: its normal component is {defects[bad[0]]:.3e} "
                f"(allowed: {tol:.0e}); use space.project_tangent(p, v)"
            )

    def frame(self, p: ArrayLike) -> P:
        """Compute a basis of the tangent space at every point.

        Parameters
        ----------
        p : array_like, shape (..., *point_shape)
            Points.

        Returns
        -------
        ndarray, shape (..., dim, *point_shape)
            Tangent vectors that span the tangent space. They are orthonormal if the space has a metric. The frame is
            not a continuous function of p.

        Raises
        ------
        ValidationError
            If p does not have the shape of points, or if the dimension of the space is too large for frames.

        See Also
        --------
        Space.random_tangent : Draw random tangent vectors.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.SpecialOrthogonal(3).frame([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]).shape
        (3, 3, 3)
        """
        if self._is_large:
            raise ValidationError(f"the dimension of {self!r} is too large for frames")
        doubles = self._doubles(p, "p")
        base_points = np.expand_dims(doubles, len(self._lead(doubles)))
        size = math.prod(self._doubles_shape)
        units = np.eye(self.dim, size).reshape(-1, *self._doubles_shape)
        # The core combines a frame at p with random coefficients. Unit coefficients give the frame itself.
        return self._finite("random_tangent", p=self._numbers(base_points), noise=self._numbers(units))

    # ---- statistics ----

    def mean(self, points: ArrayLike, weights: ArrayLike | None = None) -> P:
        r"""Compute the Karcher mean of points.

        Parameters
        ----------
        points : array_like, shape (..., n, *point_shape)
            Points, at least one. The mean is over the last axis before those of a point; the axes before it are batch
            axes. On a `Product`, a tuple of such arrays.
        weights : array_like, shape (n,) or (..., n), optional
            Weights >= 0. Points of weight 0 are ignored and may be NaN. By default all points have the same weight.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            The means. On a `Product`, a tuple of arrays. On quotients, projective spaces and Grassmannians, they are
            representatives near the first point of each batch.

        Raises
        ------
        ValidationError
            If an array does not have the required shape, a point is not in the space, or a weight is invalid.
        CutLocusError
            If points are opposite to each other so that no mean can be computed.
        ConvergenceError
            If the points are spread too far for a mean.

        Warns
        -----
        AmbiguousMeanWarning
            If there is a second local minimum whose sum is less than 5 % larger, and that is farther away than the
            standard error of the mean.

        See Also
        --------
        Space.median : A mean that is robust against outliers.
        tangent_pca : Principal components about the mean.

        Notes
        -----
        The mean minimises :math:`\sum_i w_i\, d(m, x_i)^2`. It is unique if the points are in a ball of radius less
        than half the injectivity radius [1]_. Points that are spread farther can have several local minima. The mean
        is then the lowest minimum found, independently of the order of the points. On circles, tori, plane rotations
        and phases, this minimum is exact [3]_. Elsewhere it is the lowest end point of descents from the extrinsic
        mean and from the data; of more than 30 data, from the 12 with the lowest sums. These descents can miss the
        global minimum of points that are spread over the whole space. On groups without an invariant metric, such as
        `SpecialEuclidean`, the mean is the point at which the weighted sum of the logarithms vanishes [2]_.

        Means of positive definite matrices do not depend on units: the mean of D A D is D mean(A) D, up to rounding
        errors, for any invertible diagonal matrix D.

        References
        ----------
        .. [1] H. Karcher, Riemannian center of mass and mollifier smoothing, Comm. Pure Appl. Math. 30 (1977).
        .. [2] X. Pennec, V. Arsigny, Exponential barycenters of the canonical Cartan connection and invariant means on
           Lie groups, in: Matrix Information Geometry, Springer (2013).
        .. [3] T. Hotz, S. Huckemann, Intrinsic means on the circle: uniqueness, locus and asymptotics, Ann. Inst.
           Stat. Math. 67 (2015).

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Sphere(2).mean([[1, 0, 0], [0, 1, 0]]).round(8)
        array([0.70710678, 0.70710678, 0.        ])
        >>> ss.Euclidean(1).mean([[0.0], [1.0]], weights=[1, 3])
        array([0.75])
        """
        lead, groups = self._samples(points, weights, "mean")
        result: P = self._batched(karcher_mean(self, groups), lead[:-1])
        return result

    def median(self, points: ArrayLike, weights: ArrayLike | None = None) -> P:
        r"""Compute the geometric median of points, which outliers hardly affect.

        Parameters
        ----------
        points, weights : array_like
            Points and weights, as for `Space.mean`.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            The medians. On a `Product`, a tuple of arrays.

        Raises
        ------
        ValidationError
            If an array does not have the required shape, a point is not in the space, a weight is invalid, or the
            space has no invariant, positive definite metric.
        CutLocusError
            If points are opposite to each other so that no median can be computed.
        ConvergenceError
            If the iteration does not converge.

        Warns
        -----
        AmbiguousMeanWarning
            If there is a second local minimum, as for `Space.mean`.

        See Also
        --------
        Space.mean : The Karcher mean.

        Notes
        -----
        The median minimises :math:`\sum_i w_i\, d(m, x_i)` [1]_. On circles it is computed exactly. Elsewhere it is
        computed by Weiszfeld's algorithm, from several starts if the points are spread farther than a quarter of the
        injectivity radius. Where an iterate is one of the points, the step of [2]_ either moves on or shows that this
        point is the median. On a line the median of an even number of points is not unique, and any of the medians is
        returned.

        References
        ----------
        .. [1] P. T. Fletcher, S. Venkatasubramanian, S. Joshi, The geometric median on Riemannian manifolds with
           application to robust atlas estimation, NeuroImage 45 (2009).
        .. [2] Y. Vardi, C.-H. Zhang, The multivariate L1-median and associated data depth, PNAS 97 (2000).

        Examples
        --------
        >>> import symspline as ss
        >>> ss.Euclidean(2).median([[0, 0], [2, 0], [1, 1], [1, -1], [1, 0], [500, 0]])
        array([1., 0.])
        """
        require_metric(self, "median")
        lead, groups = self._samples(points, weights, "median")
        result: P = self._batched(geometric_median(self, groups), lead[:-1])
        return result

    def _samples(self, points: PointsLike, weights: ArrayLike | None, what: str) -> tuple[tuple[int, ...], Groups]:
        """Return the leading axes of checked points, and the points of positive weight in groups."""
        given = self._array(points, "points")
        array = self._numbers(self._doubles(given, "points"))
        lead, kept, full = grouped(array, len(self._point_shape), weights, what)
        # Single precision has another tolerance.
        self.check_point(kept.astype(given.dtype) if given.dtype.kind in "fc" else kept)
        return lead, groups_of(lead, kept, full)

    # How `karcher_mean` and `geometric_median` treat a space.

    _has_angles: ClassVar[bool] = False

    def _first_means(self, groups: Groups) -> Any:
        """Return the initial point of the iteration in every group."""
        return self.project(take(groups.points, groups.starts))

    def _extrinsic_means(self, points: Array, weights: FloatArray) -> Array | None:
        """Return minimisers of a distance in the embedding space, before their projection to the manifold."""
        return None

    def _whitening(self, groups: Groups) -> Whitening | None:
        """Return isometries that make the points of each group well-conditioned; None if not needed."""
        return None

    def _whitening_at(self, points: Array) -> Whitening | None:
        """Return isometries that move the given points to the identity; None if not needed."""
        return None

    def _batched(self, rows: Any, batch: tuple[int, ...]) -> Any:
        return rows.reshape(batch + self._point_shape)

    # ---- random points ----

    def random_point(self, rng: np.random.Generator, shape: int | tuple[int, ...] = ()) -> P:
        """Draw random points.

        Parameters
        ----------
        rng : numpy.random.Generator
            Source of random numbers.
        shape : int or tuple of int, default ()
            Shape of the array of points.

        Returns
        -------
        ndarray, shape ``(*shape, *point_shape)``
            Random points. On a compact space their distribution is uniform.

        Raises
        ------
        ValidationError
            If the shape is invalid.

        See Also
        --------
        Space.random_tangent : Draw random tangent vectors.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> ss.Sphere(2).random_point(np.random.default_rng(0), (4, 5)).shape
        (4, 5, 3)
        """
        if not isinstance(shape, (int, np.integer, tuple, list)):
            raise ValidationError(f"shape must be an integer or a tuple of integers, not {short_repr(shape)}")
        sizes = (shape,) if isinstance(shape, (int, np.integer)) else tuple(shape)
        noise = self._noise(rng, tuple(whole_number(n, "shape", 0) for n in sizes))
        points: Any = self._apply("scatter", x=self._scatter_scale * noise)
        result: P = points
        return result

    @property
    def _scatter_scale(self) -> float:
        """Factor of the standard normal numbers from which random points are computed."""
        return 1.0

    def random_tangent(self, rng: np.random.Generator, p: ArrayLike) -> P:
        """Draw random tangent vectors with the standard normal distribution.

        Parameters
        ----------
        rng : numpy.random.Generator
            Source of random numbers.
        p : array_like, shape (..., *point_shape)
            Points.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            One tangent vector at each point.

        Raises
        ------
        ValidationError
            If p does not have the shape of points, or if the result is not finite.

        See Also
        --------
        Space.random_point : Draw random points.

        Examples
        --------
        Noise of standard deviation 0.1 in each of the two tangent directions:

        >>> import numpy as np, symspline as ss
        >>> sphere, p = ss.Sphere(2), [1, 0, 0]
        >>> noisy = sphere.exp(p, 0.1 * sphere.random_tangent(np.random.default_rng(0), p))
        >>> sphere.distance(p, noisy).round(3)
        np.float64(0.018)
        """
        noise = self._noise(rng, self._lead(self._doubles(p, "p")))
        if self._is_large:
            return self._normal_tangent(p, noise)
        return self._finite("random_tangent", p=p, noise=noise)

    def _normal_tangent(self, p: ArrayLike, noise: Array) -> P:
        """Return standard normal tangent vectors without a frame at p."""
        return self.project_tangent(p, noise)

    def _noise(self, rng: np.random.Generator, lead: tuple[int, ...]) -> Array:
        """Return standard normal numbers in the shape of points."""
        if not hasattr(rng, "standard_normal"):
            raise TypeError(f"rng must be a numpy.random.Generator, not {short_repr(rng)}")
        try:
            return self._numbers(rng.standard_normal(lead + self._doubles_shape))
        except ValueError as error:
            raise ValidationError(f"cannot draw points of shape {lead}: {error}") from None

    # ---- arrays ----

    def _numbers(self, doubles: NDArray[np.float64]) -> Array:
        """Return floating-point numbers of the core as numbers of points; on complex spaces, pairs become complex
        numbers.
        """
        return doubles.view(np.complex128) if self._complex else doubles

    def _as_doubles(self, numbers: Array) -> NDArray[np.float64]:
        """Return numbers of points in contiguous memory as floating-point numbers of the core."""
        return numbers.view(np.float64) if self._complex else numbers

    def _array(self, value: Any, name: str) -> Array:
        """Return points as an array. Subclasses accept objects of other libraries as well."""
        return as_array(value, name)

    def _tol(self, array: Array) -> float:
        """Return the tolerance for points off the manifold, from the accuracy of their numbers."""
        return point_tol(array, math.prod(self._point_shape))

    def _conversion(self, shape: tuple[int, ...], name: str) -> str:
        """Return the part of a message that names the function for values of another shape, or an empty text."""
        return ""

    def _one_number(self, shape: tuple[int, ...], name: str) -> str:
        """Return the remedy for an array without the axes of a point, on spaces whose points are single numbers."""
        if math.prod(self._point_shape) != 1 or not shape:
            return ""
        return f". A point is an array of one number: pass {name}[..., {', '.join(['None'] * len(self._point_shape))}]."

    def _neighbours(self, points: Array) -> tuple[Array, Array]:
        """Return the starts and the ends of the segments between points along the last of the leading axes."""
        index = (slice(None),) * (points.ndim - len(self._point_shape) - 1)
        return points[(*index, slice(-1))], points[(*index, slice(1, None))]

    def _where_finite(self, points: Array) -> NDArray[np.bool_]:
        """Return which points or vectors are finite."""
        return np.asarray(np.isfinite(points).all(axis=self._point_axes))

    def _doubles(self, value: ArrayLike, name: str) -> NDArray[np.float64]:
        """Return points as contiguous floating-point numbers of the core.

        The last axis of complex points holds real and imaginary parts in turn.
        """
        array = self._array(value, name)
        if array.dtype.kind not in ("biufc" if self._complex else "biuf"):
            numbers = "numbers" if self._complex else "real numbers"
            complex_twin = COMPLEX_TWINS.get(getattr(self, "_name", "")) if array.dtype.kind == "c" else None
            hint = f"; did you mean {complex_twin}?" if complex_twin else ""
            raise ValidationError(f"{name} must be an array of {numbers}, not of {array.dtype}{hint}")
        shape = self._point_shape
        if array.shape[array.ndim - len(shape) :] != shape or array.ndim < len(shape):
            raise ValidationError(
                f"{name} has shape {array.shape}, but {self!r} needs shape (..., {', '.join(map(str, shape))})"
                f"{self._conversion(array.shape, name) or self._one_number(array.shape, name)}"
            )
        return cast(array, self._dtype).view(np.float64)

    def _rows(self, array: NDArray[np.float64], lead: tuple[int, ...]) -> NDArray[np.float64]:
        shape = self._doubles_shape
        rows = array if array.shape == lead + shape else np.broadcast_to(array, lead + shape)
        return np.ascontiguousarray(rows).reshape(-1, math.prod(shape))

    def _lead(self, array: NDArray[np.float64]) -> tuple[int, ...]:
        """Return the axes before those of a point."""
        return array.shape[: array.ndim - len(self._point_shape)]

    def _leads(self, shapes: Mapping[str, tuple[int, ...]], further: tuple[int, ...] = ()) -> tuple[int, ...]:
        """Return the broadcast leading axes of arrays of points with these shapes."""
        axes = len(self._point_shape)
        leads = {shape[: len(shape) - axes] for shape in shapes.values()}
        if len(leads) == 1 and not further:
            return leads.pop()
        try:
            return np.broadcast_shapes(*leads, further)
        except ValueError:
            named = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
            raise ValidationError(f"the leading axes do not broadcast: {named}") from None

    def _apply(self, operation: str, t: NDArray[np.float64] | None = None, **inputs: ArrayLike) -> Array:
        arrays = {name: self._doubles(value, name) for name, value in inputs.items()}
        shapes = {name: self._numbers(a).shape for name, a in arrays.items()}
        lead = self._leads(shapes, () if t is None else t.shape)
        rows = [self._rows(a, lead) for a in arrays.values()]
        times = None if t is None else np.ascontiguousarray(np.broadcast_to(t, lead).ravel())
        result = self._handle.apply(operation, rows, times)
        if operation in _NUMBERS:
            return result.reshape(lead)[()]
        return self._numbers(result.reshape(lead + self._doubles_shape))

    @overload
    def _finite(
        self, operation: Literal["distance", "inner"], t: NDArray[np.float64] | None = None, **inputs: ArrayLike
    ) -> FloatArray: ...

    @overload
    def _finite(self, operation: str, t: NDArray[np.float64] | None = None, **inputs: ArrayLike) -> P: ...

    def _finite(self, operation: str, t: NDArray[np.float64] | None = None, **inputs: ArrayLike) -> Any:
        """Apply an operation of the core, and raise ValidationError if a result is not finite."""
        return self._require_finite(operation, self._apply(operation, t, **inputs))

    def _require_finite(self, operation: str, result: Array) -> Any:
        if not np.isfinite(result).all():
            axes = () if operation in _NUMBERS else self._point_axes
            bad = np.argwhere(~np.isfinite(result).all(axis=axes))[0].tolist()
            raise ValidationError(
                f"{operation} of row {bad or 0} is not finite: the input is not finite, is too large, or is not a "
                "point of the space"
            )
        return result

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if hasattr(cls, "_name"):
            CLASSES[cls._name] = cls
            cls.__init__ = _taking_numbers(cls, cls.__init__)  # type: ignore[method-assign]


AnySpace = Space[Any]
"""A space whose points may have any type, such as a product."""


def example_of(cls: type[AnySpace]) -> str:
    """Return an example of a space of this class, as a constructor call and as a name."""
    numbers = {"gr": "2, 4", "cgr": "2, 4", "stiefel": "2, 4", "igr": "0, 1, 1, 2"}.get(cls._name, "2")
    return f"{cls.__name__}({numbers}) or '{cls._name}:{numbers.replace(' ', '')}'"


def _taking_numbers(cls: type[AnySpace], init: Callable[..., None]) -> Callable[..., None]:
    """Wrap a constructor so that a wrong number of arguments raises an error that names the parameters."""
    names = [*signature(init).parameters][1:]

    @wraps(init)
    def checked(self: AnySpace, *numbers: object, **named: Any) -> None:
        # A check in advance would take longer than the constructor.
        try:
            init(self, *numbers, **named)
        except TypeError:
            if len(numbers) + len(named) == len(names) and set(named) <= set(names):
                raise
            what = re.split("[:.]", " ".join((cls.__doc__ or "").split()))[0]
            raise TypeError(
                f"{cls.__name__} takes {' and '.join(names)}, such as {example_of(cls)}: {what[:1].lower()}{what[1:]}"
            ) from None

    return checked

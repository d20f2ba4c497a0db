"""What all spaces share: the operations on arrays of points, and how arrays go to the compiled core."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from functools import cached_property, wraps
from inspect import signature
from typing import Any, ClassVar, Generic, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import as_array, cast, short_repr, whole_number
from .._core import Handle, ValidationError
from .._typing import AnyArray, FloatArray, P
from .tolerance import point_tol

Array = AnyArray

# From this ambient dimension on nothing is made that needs a frame of all tangent vectors.
LARGE = 256
# Operations that give one number a row, not a point.
_NUMBERS = ("distance", "inner", "rounding")
# So many numbers are 8 TB.
_MOST = 2**40


# The classes of all spaces by their names, products apart.
CLASSES: dict[str, type[Space[Any]]] = {}
# What a complex array may have been meant for.
COMPLEX_TWINS = {
    "rp": "ComplexProjective",
    "gr": "ComplexGrassmannian",
    "o": "Unitary",
    "so": "SpecialUnitary",
    "spd": "HermitianPositiveDefinite",
    "sphere": "ComplexProjective",
}


class Space(Generic[P]):
    """A symmetric space. Every method works on arrays of points: leading axes broadcast.

    Tangent vectors are arrays of the point's shape. ``str(space)`` is the name that
    `symspline.space` reads back, ``repr(space)`` the constructor call.
    """

    _name: ClassVar[str]
    # Further names, of spaces that the compiled core does not know.
    _aliases: ClassVar[tuple[str, ...]] = ()
    # Whether points are vectors or bases of subspaces, so that curves stay in the span of their points.
    _linear: ClassVar[bool] = False
    _handle: Handle
    _parameters: tuple[int, ...]
    _complex: bool
    _dtype: np.dtype[np.float64] | np.dtype[np.complex128]
    # Shape of one point's doubles, where a complex number is two.
    _doubles_shape: tuple[int, ...]

    def __init__(self, *parameters: int) -> None:
        if not hasattr(type(self), "_name"):
            raise TypeError(
                f"{type(self).__name__} takes no parameters itself; make one of its kinds, as Sphere(2)"
            )
        for value in parameters:
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 0:
                raise ValidationError(f"{type(self).__name__} takes whole numbers, not {short_repr(value)}")
        self._parameters = tuple(int(value) for value in parameters)
        try:
            self._handle = Handle(self._name, list(self._parameters))
        except OverflowError:
            raise ValidationError(f"{self!r} is too large") from None
        self._point_shape = tuple(self._handle.point_shape())
        if max(self._parameters, default=0) >= _MOST or math.prod(self._point_shape) >= _MOST:
            raise ValidationError(f"{self!r} is too large: no memory holds a point of it")
        self._complex = self._handle.is_complex()
        self._dtype = np.dtype(np.complex128) if self._complex else np.dtype(np.float64)
        *first, last = self._point_shape
        self._doubles_shape = (*first, 2 * last if self._complex else last)

    # ---- what it is ----

    @property
    def point_shape(self) -> tuple[int, ...]:
        """Shape of the array of one point."""
        return self._point_shape

    @property
    def dim(self) -> int:
        """Dimension of the space."""
        return self._handle.dim()

    @property
    def injectivity_radius(self) -> float:
        """Distance below which the geodesic between two points is unique, whatever its direction."""
        return self._handle.injectivity_radius()

    @property
    def curvature(self) -> float:
        """K of (22) in the paper: 0 for flat space, 1/r for a sphere of radius r; NaN for poses and other
        spaces without an invariant metric that is positive definite."""
        return self._handle.curvature()

    @property
    def dtype(self) -> np.dtype[np.float64] | np.dtype[np.complex128]:
        """Type of the numbers of a point: float64, or complex128."""
        return self._dtype

    @cached_property
    def _text(self) -> str:
        # Spaces are compared by it, several times in a fit.
        return f"{self._name}:{','.join(map(str, self._parameters))}"

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(map(str, self._parameters))})"

    def __eq__(self, other: object) -> bool:
        return self is other or (type(self) is type(other) and str(self) == str(other))

    def __hash__(self) -> int:
        return hash(str(self))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._parameters

    # ---- geometry ----

    def exp(self, p: ArrayLike, v: ArrayLike) -> P:
        """The point reached from p in unit time on the geodesic with velocity v.

        Args:
            p: points, shape (..., *point_shape).
            v: tangent vectors at p, shape (..., *point_shape).

        >>> import symspline as ss
        >>> ss.Sphere(2).exp([1, 0, 0], [0, ss.Sphere(2).injectivity_radius / 2, 0]).round(15)
        array([0., 1., 0.])
        """
        return self._finite("exp", p=p, v=v)

    def log(self, p: ArrayLike, q: ArrayLike) -> P:
        """The velocity at p of the geodesic that reaches q in unit time; inverse of `exp`.

        Raises:
            CutLocusError: the two points lie at or past each other's cut locus.
        """
        return self._finite("log", p=p, q=q)

    def geodesic(self, p: ArrayLike, q: ArrayLike, t: ArrayLike) -> P:
        """The geodesic from p (t = 0) to q (t = 1), the paper's [p, q]_t.

        ``t`` broadcasts against the leading axes of p and q.

        Raises:
            CutLocusError: the two points lie at or past each other's cut locus.
        """
        times = as_array(t, "t")
        if times.dtype.kind not in "biuf":
            raise ValidationError(f"t must be real numbers, not {times.dtype}")
        return self._finite("geodesic", t=cast(times), p=p, q=q)

    def distance(self, p: ArrayLike, q: ArrayLike) -> FloatArray:
        """Length of the shortest geodesic between p and q; shape of the leading axes."""
        return self._finite("distance", p=p, q=q)

    def transvection(self, p: ArrayLike, v: ArrayLike, x: ArrayLike) -> P:
        """The transvection E_p(v) of (10), applied to the point x: it moves p to exp_p(v)."""
        return self._finite("transvection", p=p, v=v, x=x)

    def transport(self, p: ArrayLike, q: ArrayLike, v: ArrayLike) -> P:
        """Parallel transport of the tangent vector v from p to q along the geodesic between them.

        Raises:
            CutLocusError: the two points lie at or past each other's cut locus.
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
            If g does not have the required form or is not in the group, within the same tolerance as for points
            (1e-8, or 1e-4 for float32), or if the space is a `Manifold`.

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
        `SymmetricPositiveDefinite`                         invertible matrix                            g x gᵀ
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
        # Of matrices that are too large or singular the checks make an error of their own.
        with np.errstate(all="ignore"):
            element = self._element(g)
        return self._isometric("act", lambda x: self._moved(element, x), x=x)

    def _isometric(self, name: str, function: Callable[..., Array], **inputs: ArrayLike) -> P:
        """Points that a formula makes of arrays of points, on the space to rounding."""
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
            raise ValidationError(
                f"the leading axes of g and x {np.shape(inputs['x'])} do not broadcast"
            ) from None
        points: P = self._require_finite(name, result)
        return points

    # What every kind of symmetric space has to define for `symmetry` and `act`: see `actions`.

    def _reflected(self, p: Array, x: Array) -> Any:
        raise self._not_symmetric("geodesic symmetries")

    def _element(self, g: Any) -> Any:
        """The argument of `act` as checked arrays."""
        raise self._not_symmetric("group")

    def _moved(self, g: Any, x: Array) -> Any:
        raise self._not_symmetric("group")

    def _not_symmetric(self, what: str) -> ValidationError:
        return ValidationError(f"{self!r} is not known to be symmetric: it has no {what}")

    def inner(self, p: ArrayLike, u: ArrayLike, v: ArrayLike) -> FloatArray:
        """Inner product of two tangent vectors at p; shape of the leading axes."""
        return self._finite("inner", p=p, u=u, v=v)

    def norm(self, p: ArrayLike, v: ArrayLike) -> FloatArray:
        """Length of the tangent vector v at p; shape of the leading axes."""
        result: FloatArray = np.sqrt(np.maximum(self._finite("inner", p=p, v=v, again=v), 0.0))
        return result

    # ---- membership ----

    def project(self, x: ArrayLike) -> P:
        """A point of the space close to x, for x near the space.

        Raises:
            ValidationError: no point is close to x (a zero vector, or not finite).
        """
        result: Any = self._apply("project", x=x)
        good = np.isfinite(result) & np.isfinite(cast(self._array(x, "x"), self.dtype))
        if not good.all():
            bad = np.argwhere(~good.all(axis=self._point_axes(result)))[0].tolist()
            raise ValidationError(
                f"x{bad or ''} cannot be projected: no point of the space is close to it, or it is not finite"
            )
        try:
            self.check_point(result)
        except ValidationError as error:
            raise ValidationError(f"x cannot be projected; of what comes nearest, {error}") from None
        points: P = result
        return points

    def project_tangent(self, p: ArrayLike, v: ArrayLike) -> P:
        """The tangential part of v at p."""
        return self._finite("project_tangent", p=p, v=v)

    def rounding(self, p: ArrayLike) -> FloatArray:
        """By how much rounding counts at points p: how far apart neighbouring floating-point points are, in units of
        2.2e-16, shape of the leading axes. |p|² in hyperbolic space, tr p · tr p⁻¹ (about the condition) of positive
        definite matrices, the length of vectors and translations; 1 or more.

        >>> import symspline as ss
        >>> ss.Sphere(1).rounding([1.0, 0.0]), ss.Hyperbolic(1).rounding([1.25, 0.75])
        (np.float64(1.0), np.float64(2.125))
        """
        return self._apply("rounding", p=p)

    def check_point(self, p: ArrayLike) -> None:
        """Raise ValidationError unless p (or every one of an array of points) is a point."""
        array = self._doubles(p, "p")
        lead = self._lead(array)
        self._handle.check_points(self._rows(array, lead), lead, point_tol(self._array(p, "p").dtype))

    def check_tangent(self, p: ArrayLike, v: ArrayLike) -> None:
        """Raise ValidationError unless v is a tangent vector at the point p."""
        self.check_point(p)
        points, vectors = self._doubles(p, "p"), self._doubles(v, "v")
        try:
            lead = np.broadcast_shapes(self._lead(points), self._lead(vectors))
        except ValueError:
            raise ValidationError(f"p {np.shape(p)} and v {np.shape(v)} do not broadcast") from None
        defects = self._handle.tangent_defects(self._rows(points, lead), self._rows(vectors, lead))
        tol = max(point_tol(self._array(value, name).dtype) for value, name in ((p, "p"), (v, "v")))
        bad = np.flatnonzero(~(defects <= tol))
        if bad.size:
            index = ",".join(map(str, np.unravel_index(bad[0], lead)))
            raise ValidationError(
                f"vector {index or 'v'} is not tangent at its point: a part of {defects[bad[0]]:.3e} of it points "
                f"off the space (allowed: {tol:.0e}); use space.project_tangent(p, v)"
            )

    def frame(self, p: ArrayLike) -> P:
        """Tangent vectors that span the tangent space at every one of the points p, shape (..., dim, *point_shape):
        orthonormal, where the space has a metric. There are many such frames; this one is no continuous function of p.

        >>> import symspline as ss
        >>> ss.SpecialOrthogonal(3).frame([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]).shape
        (3, 3, 3)
        """
        if self._linear and self.point_shape[0] >= LARGE:
            raise ValidationError(f"{self!r} has too many dimensions for frames")
        doubles = self._doubles(p, "p")
        at_each = np.expand_dims(doubles, len(self._lead(doubles)))
        size = math.prod(self._doubles_shape)
        units = np.eye(self.dim, size).reshape(-1, *self._doubles_shape)
        # From a frame at p the core makes random vectors; these are what it makes of single ones.
        return self._finite("random_tangent", p=self._numbers(at_each), noise=self._numbers(units))

    # ---- chance ----

    def random_point(self, rng: np.random.Generator, shape: int | tuple[int, ...] = ()) -> P:
        """Random points, shape ``shape + point_shape``: uniform on a compact space."""
        if not isinstance(shape, (int, np.integer, tuple, list)):
            raise ValidationError(f"shape must be a whole number or a tuple of them, not {short_repr(shape)}")
        sizes = (shape,) if isinstance(shape, (int, np.integer)) else tuple(shape)
        noise = self._noise(rng, tuple(whole_number(n, "shape", 0) for n in sizes))
        points: Any = self._apply("scatter", x=self._scatter_scale * noise)
        result: P = points
        return result

    @property
    def _scatter_scale(self) -> float:
        """What random points multiply standard normal numbers by."""
        return 1.0

    def random_tangent(self, rng: np.random.Generator, p: ArrayLike) -> P:
        """Standard normal tangent vectors at the points p."""
        noise = self._noise(rng, self._lead(self._doubles(p, "p")))
        if self._linear and self.point_shape[0] >= LARGE:
            return self._normal_tangent(p, noise)
        return self._finite("random_tangent", p=p, noise=noise)

    def _normal_tangent(self, p: ArrayLike, noise: Array) -> P:
        """Standard normal tangent vectors, made of standard normal numbers without a frame at p."""
        return self.project_tangent(p, noise)

    def _noise(self, rng: np.random.Generator, lead: tuple[int, ...]) -> Array:
        """Standard normal numbers in the shape of points."""
        if not hasattr(rng, "standard_normal"):
            raise TypeError(f"rng must be a numpy.random.Generator, not {short_repr(rng)}")
        try:
            return self._numbers(rng.standard_normal(lead + self._doubles_shape))
        except ValueError as error:
            raise ValidationError(f"cannot make points of shape {lead}: {error}") from None

    # ---- arrays ----

    def _numbers(self, doubles: NDArray[np.float64]) -> Array:
        """The compiled core's doubles as the numbers of points: pairs are complex numbers."""
        return doubles.view(np.complex128) if self._complex else doubles

    def _as_doubles(self, numbers: Array) -> NDArray[np.float64]:
        """The inverse: numbers of points, in contiguous memory, as doubles."""
        return numbers.view(np.float64) if self._complex else numbers

    def _array(self, value: Any, name: str) -> Array:
        """Points as they are given, as an array: where objects that are no arrays are taken, too."""
        return as_array(value, name)

    def _point_axes(self, array: Array) -> tuple[int, ...]:
        return tuple(range(array.ndim - len(self.point_shape), array.ndim))

    def _doubles(self, value: ArrayLike, name: str) -> NDArray[np.float64]:
        """The value as contiguous doubles whose last axes are those of a point; of complex numbers the
        last axis holds real and imaginary parts side by side."""
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
            )
        return cast(array, self._dtype).view(np.float64)

    def _rows(self, array: NDArray[np.float64], lead: tuple[int, ...]) -> NDArray[np.float64]:
        shape = self._doubles_shape
        return np.ascontiguousarray(np.broadcast_to(array, lead + shape).reshape(-1, math.prod(shape)))

    def _lead(self, array: NDArray[np.float64]) -> tuple[int, ...]:
        """The axes before those of a point."""
        return array.shape[: array.ndim - len(self.point_shape)]

    def _leads(self, shapes: Mapping[str, tuple[int, ...]], further: tuple[int, ...] = ()) -> tuple[int, ...]:
        """The leading axes that arrays of points of these shapes have together."""
        try:
            return np.broadcast_shapes(
                *(shape[: len(shape) - len(self.point_shape)] for shape in shapes.values()), further
            )
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
        self,
        operation: Literal["distance", "inner"],
        t: NDArray[np.float64] | None = None,
        **inputs: ArrayLike,
    ) -> FloatArray: ...

    @overload
    def _finite(self, operation: str, t: NDArray[np.float64] | None = None, **inputs: ArrayLike) -> P: ...

    def _finite(self, operation: str, t: NDArray[np.float64] | None = None, **inputs: ArrayLike) -> Any:
        """The same, but with an error where it is not finite."""
        return self._require_finite(operation, self._apply(operation, t, **inputs))

    def _require_finite(self, operation: str, result: Array) -> Any:
        if not np.isfinite(result).all():
            axes = () if operation in _NUMBERS else self._point_axes(result)
            bad = np.argwhere(~np.isfinite(result).all(axis=axes))[0].tolist()
            raise ValidationError(
                f"{operation} of row {bad or 0} is not finite: its numbers are not finite, too large, or no point of "
                "the space"
            )
        return result

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if hasattr(cls, "_name"):
            CLASSES[cls._name] = cls
            cls.__init__ = _taking_numbers(cls, cls.__init__)  # type: ignore[method-assign]


def example_of(cls: type[Space[Any]]) -> str:
    """How one of a family of spaces is written."""
    numbers = {"gr": "2, 4", "cgr": "2, 4", "stiefel": "2, 4", "igr": "0, 1, 1, 2"}.get(cls._name, "2")
    return f"{cls.__name__}({numbers}) or '{cls._name}:{numbers.replace(' ', '')}'"


def _taking_numbers(cls: type[Space[Any]], init: Callable[..., None]) -> Callable[..., None]:
    """The constructor, whose error says which numbers are wanted where they are not given."""
    names = [*signature(init).parameters][1:]

    @wraps(init)
    def checked(self: Space[Any], *numbers: Any, **named: Any) -> None:
        # Not asked beforehand, which would take longer than to make the space.
        try:
            init(self, *numbers, **named)
        except TypeError:
            if len(numbers) + len(named) == len(names) and set(named) <= set(names):
                raise
            what = re.split("[:.]", " ".join((cls.__doc__ or "").split()))[0]
            raise TypeError(
                f"{cls.__name__} takes {' and '.join(names)}, such as {example_of(cls)}: "
                f"{what[:1].lower()}{what[1:]}"
            ) from None

    return checked

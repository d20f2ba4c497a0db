"""Manifolds that are defined by functions."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import checked_number, short_repr, whole_number
from .._base.typing import AnyFunction, Array
from .._core import ValidationError
from .._spaces import AnySpace, Space, factors_of
from ._operations import Functions, Operations, basis_at, described, dlog_by_differences

_NEEDED = ("exp", "log", "project_tangent", "inner")


class Manifold(Space):
    """Define a Riemannian manifold by functions of your own.

    `CubicSpline` fits C² curves on it. The manifold does not have to be symmetric. The curves are those of Popiel and
    Noakes [1]_: de Casteljau's algorithm with geodesics, with covariant accelerations that agree at the points.

    All functions take arrays of points and of tangent vectors, shape (m, *point_shape) with the same m, and return an
    array of this shape; ``inner`` returns shape (m,).

    Parameters
    ----------
    exp : callable
        ``exp(p, v)``, the point reached from p in unit time on the geodesic with velocity v.
    log : callable
        ``log(p, q)``, the velocity at p of the geodesic that reaches q in unit time, or NaN if there is none.
    project_tangent : callable
        ``project_tangent(p, v)``, the tangent vector at p nearest to an array v. It must be linear in v, and return v
        if v is tangent.
    inner : callable
        ``inner(p, u, v)``, the inner product of tangent vectors at p.
    dlog : callable, optional
        ``dlog(p, q, w)``, the derivative of ``log(p, ·)`` at q in the direction w, a tangent vector at q. The result is
        tangent at p. By default it is computed by differences of order four.
    transport : callable, optional
        ``transport(p, q, v)``, the parallel transport of v along the geodesic from p to q, or an approximation. It
        makes the solver faster and does not change the solution. By default vectors are projected.
    injectivity_radius : float, optional
        Distance below which geodesics are unique. Points and control points farther apart raise `CutLocusError`. By
        default there is no limit, and ``log`` decides.
    point_shape : int or tuple of int
        Shape of the array of one point.
    project : callable, optional
        ``project(x)``, the point near an array x, for x near the manifold. Given points are compared with it and
        replaced by it. Without it, ``exp(p, 0)`` must return p.
    dim : int, optional
        Dimension of the manifold, which `Space.dim` returns.
    dtype : {float64, complex128}, default float64
        Type of the numbers of a point.

    Raises
    ------
    ValidationError
        If an argument does not meet the requirements above.

    See Also
    --------
    symspline.manifolds.from_geomstats : Use a manifold of geomstats.
    symspline.manifolds.from_pymanopt : Use a manifold of pymanopt.
    symspline.testing.check : Check the functions.

    Notes
    -----
    Tangent vectors are arrays with the shape of points. Real multiples and sums of them must be tangent vectors, but
    they do not have to be derivatives of the arrays of points. The curve is C² up to the errors of the functions, which
    should be about 1e-15.

    Without `dlog`, about three significant digits are lost: relative accelerations have errors of about 1e-12. The
    errors are larger for points closer than a hundredth of the injectivity radius, unless that radius is given.

    References
    ----------
    .. [1] T. Popiel, L. Noakes, "Bézier curves and C² interpolation in Riemannian manifolds", J. Approx. Theory 148
           (2007).

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> def exp(p, v):
    ...     angle = np.linalg.norm(v, axis=-1, keepdims=True)
    ...     return np.cos(angle) * p + np.sinc(angle / np.pi) * v
    >>> def log(p, q):
    ...     cosine = np.sum(p * q, axis=-1, keepdims=True)
    ...     v = q - cosine * p
    ...     sine = np.linalg.norm(v, axis=-1, keepdims=True)
    ...     return v / np.sinc(np.arctan2(sine, cosine) / np.pi)
    >>> sphere = ss.Manifold(
    ...     exp=exp, log=log, inner=lambda p, u, v: np.sum(u * v, axis=-1),
    ...     project_tangent=lambda p, v: v - np.sum(p * v, axis=-1, keepdims=True) * p,
    ...     injectivity_radius=np.pi, point_shape=(3,),
    ... )
    >>> spline = ss.CubicSpline([0, 1, 3], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], sphere)
    >>> bool(abs(spline(0.5) - ss.CubicSpline([0, 1, 3], np.eye(3), "sphere:2")(0.5)).max() < 1e-11)
    True
    """

    _in_python = True
    # What to do about two points without a unique geodesic.
    _remedy = "put a point between them"

    def __init__(
        self,
        *,
        exp: AnyFunction,
        log: AnyFunction,
        project_tangent: AnyFunction,
        inner: AnyFunction,
        dlog: AnyFunction | None = None,
        transport: AnyFunction | None = None,
        injectivity_radius: float | None = None,
        point_shape: int | tuple[int, ...],
        project: AnyFunction | None = None,
        dim: int | None = None,
        dtype: Any = np.float64,
    ) -> None:
        self.functions: Functions = Functions(exp, log, project_tangent, inner, dlog, transport, project)
        for name, function in self.functions._asdict().items():
            if not callable(function) and (function is not None or name in _NEEDED):
                raise ValidationError(f"{name} must be a function, not {short_repr(function)}")
        self._point_shape = _shape(point_shape)
        self._radius = _radius(injectivity_radius)
        self._dim = None if dim is None else whole_number(dim, "dim", 1)
        self._dtype = np.dtype(dtype)
        if self._dtype not in (np.float64, np.complex128):
            raise ValidationError(f"dtype must be float64 or complex128, not {self._dtype}")
        self._complex = self._dtype == np.complex128
        *first, last = self._point_shape
        self._doubles_shape = (*first, 2 * last if self._complex else last)
        self._point_axes = tuple(range(-len(self._point_shape), 0))
        self.operations: Operations = Operations(self)
        # The counterpart of the operations of the compiled core.
        self._handle: Any = self.operations

    def dlog(self, p: ArrayLike, q: ArrayLike, w: ArrayLike) -> Array:
        """Compute the derivative of ``log(p, ·)`` at the point q in a direction.

        Parameters
        ----------
        p, q : array_like, shape (..., *point_shape)
            Points. Leading axes broadcast.
        w : array_like, shape (..., *point_shape)
            Tangent vectors at q.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            Tangent vectors at p.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> space = ss.Stiefel(1, 3)
        >>> p, q, w = np.eye(3)[:, :1], np.eye(3)[:, 1:2], np.eye(3)[:, 2:]
        >>> space.dlog(p, q, w).round(8).ravel().tolist()
        [0.0, 0.0, 1.57079633]
        """
        inputs = [self._numbers(self._doubles(x, name)) for x, name in ((p, "p"), (q, "q"), (w, "w"))]
        a, b, c = np.broadcast_arrays(*inputs)
        return self.operations.dlog(a, self.log(a, b), b, c)

    def _dlog(self, p: Array, v: Array, q: Array, w: Array) -> Array:
        """Return `dlog` of rows at q = exp(p, v)."""
        if self.functions.dlog is not None:
            return np.asarray(self.functions.dlog(p, q, w))
        return dlog_by_differences(self.operations, p, v, q, w, self._radius)

    def frame(self, p: ArrayLike) -> Array:
        """Return orthonormal tangent vectors.

        Parameters
        ----------
        p : array_like, shape (..., *point_shape)
            Points.

        Returns
        -------
        ndarray, shape (..., dim, *point_shape)
            An orthonormal basis of each tangent space.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> ss.Stiefel(2, 3).frame(np.eye(3)[:, :2]).shape
        (3, 3, 2)
        """
        points = self._numbers(self._doubles(p, "p"))
        frames = basis_at(self.operations, points)
        return frames.reshape(*frames.shape[:-1], *self.point_shape)

    def random_point(self, rng: np.random.Generator, shape: int | tuple[int, ...] = ()) -> Array:
        """Return random points: standard normal numbers, projected by ``project``.

        Parameters
        ----------
        rng : numpy.random.Generator
            Source of randomness.
        shape : int or tuple of int, default ()
            Leading axes of the result.

        Returns
        -------
        ndarray, shape ``(*shape, *point_shape)``
            Points.

        Raises
        ------
        ValidationError
            If the manifold was made without ``project``.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> ss.Stiefel(2, 3).random_point(np.random.default_rng(0), 5).shape
        (5, 3, 2)
        """
        return super().random_point(rng, shape)

    def random_tangent(self, rng: np.random.Generator, p: ArrayLike) -> Array:
        """Return standard normal tangent vectors.

        Parameters
        ----------
        rng : numpy.random.Generator
            Source of randomness.
        p : array_like, shape (..., *point_shape)
            Points.

        Returns
        -------
        ndarray, shape (..., *point_shape)
            Tangent vectors.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> ss.Stiefel(2, 3).random_tangent(np.random.default_rng(0), np.eye(3)[:, :2]).shape
        (3, 2)
        """
        frames = self.frame(p)
        lead = frames.shape[: frames.ndim - len(self.point_shape)]
        numbers = rng.standard_normal(lead)
        scaled = numbers.reshape(*lead, *[1] * len(self.point_shape)) * frames
        return np.asarray(scaled.sum(axis=len(lead) - 1))

    def distance(self, p: ArrayLike, q: ArrayLike) -> Array:
        """Compute the length of the geodesic between two points.

        Parameters
        ----------
        p, q : array_like, shape (..., *point_shape)
            Points. Leading axes broadcast.

        Returns
        -------
        ndarray, shape (...)
            Distances.

        Raises
        ------
        CutLocusError
            If ``log`` is not finite.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> p, q = np.eye(3)[:, :1], np.eye(3)[:, 1:2]
        >>> round(float(ss.Stiefel(1, 3).distance(p, q)), 8)
        1.57079633
        """
        return self.norm(p, self.log(p, q))

    def _description(self) -> str:
        return f"exp={described(self.functions.exp)}, point_shape={self.point_shape}"

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._description()})"

    def __str__(self) -> str:
        # `symspline.space` cannot read a name of functions.
        return repr(self)

    def _key(self) -> tuple[object, ...]:
        return self.functions, self._radius, self._point_shape, self._dim, self._dtype

    def __eq__(self, other: object) -> bool:
        """Whether both manifolds are made of the same functions and parameters."""
        return type(self) is type(other) and isinstance(other, Manifold) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __reduce__(self) -> tuple[object, ...]:
        radius = None if np.isinf(self._radius) else self._radius
        options = self.functions._asdict() | {"injectivity_radius": radius, "point_shape": self._point_shape}
        return partial(Manifold, **options, dim=self._dim, dtype=self._dtype), ()


def _shape(value: object) -> tuple[int, ...]:
    sizes = (value,) if isinstance(value, (int, np.integer)) else value
    if not isinstance(sizes, (tuple, list)) or not sizes:
        raise ValidationError(f"point_shape must be a whole number or a tuple of them, not {short_repr(value)}")
    return tuple(whole_number(size, "point_shape", 1) for size in sizes)


def _radius(value: object) -> float:
    requirement = "injectivity_radius must be a positive number, or None for no limit"
    return math.inf if value is None else checked_number(value, requirement, lambda x: x > 0)


def refuse_functions(space: AnySpace, what: str, named: bool = False) -> None:
    """Raise ValidationError if the space or a factor of it is a manifold made of functions.

    With `named`, the manifolds of the library, which have a name, are accepted.
    """
    for factor in factors_of(space):
        if isinstance(factor, Manifold) and not (named and hasattr(factor, "_name")):
            raise ValidationError(f"{what} on a manifold made of functions, {factor!r}")

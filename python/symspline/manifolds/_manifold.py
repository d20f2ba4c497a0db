"""Manifolds that users bring."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import short_repr, whole_number
from .._core import ValidationError
from .._spaces import Array, Space, factors_of
from ._differences import dlog_by_differences
from ._frames import basis_at
from ._operations import Function, Functions, Operations, described

_NEEDED = ("exp", "log", "project_tangent", "inner")


class Manifold(Space):
    """Any Riemannian manifold, by its functions: `symspline.CubicSpline` makes C² curves on it.

    The curves are those of Popiel and Noakes (J. Approx. Theory 148, 2007): de Casteljau's algorithm with geodesics,
    with covariant accelerations that agree at the points. No symmetry is needed.

    All functions take arrays of points and of tangent vectors, shape (m, *point_shape) with one m for all, and return
    the same; ``inner`` returns shape (m,). Tangent vectors are arrays of the shape of points, real multiples and sums
    of which are tangent vectors; they need not be derivatives of those arrays. What they return in double precision
    should be exact to some 1e-15: the curve is C² as far as they are.

    Args:
        exp: exp(p, v), the point reached from p in unit time on the geodesic with velocity v.
        log: log(p, q), the velocity at p of the geodesic that reaches q in unit time; NaN where there is none.
        project_tangent: project_tangent(p, v), linear, the tangent vector at p nearest to an array v; v itself if it
            is tangent.
        inner: inner(p, u, v), the inner product of tangent vectors at p.
        dlog: dlog(p, q, w), the derivative of log(p, ·) at q in the direction w, a tangent vector at q; the result
            is tangent at p. None for differences of order four, which lose about three digits: with an exact log
            relative accelerations are good to some 1e-12, where points are closer than a hundredth of the injectivity
            radius worse in proportion, unless that radius is given.
        transport: transport(p, q, v), parallel transport of v along the geodesic from p to q, or what comes near to
            it. It only speeds up the solver, which solves the same equations with any: None for projection.
        injectivity_radius: distance below which geodesics are known to be unique; points and control points farther
            apart are an error. None for no limit: then it is ``log`` that decides.
        point_shape: the shape of the array of one point.
        project: project(x), the point near an array x, for x near the manifold. Given points are checked and moved by
            it. None if there is none: then a point is what ``exp(p, 0)`` leaves where it is.
        dim: the dimension, if `Space.dim` is asked for.
        dtype: float64, or complex128 if points have complex numbers.

    Raises:
        ValidationError: an argument is not what is described above.

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

    def __init__(
        self,
        *,
        exp: Function,
        log: Function,
        project_tangent: Function,
        inner: Function,
        dlog: Function | None = None,
        transport: Function | None = None,
        injectivity_radius: float | None = None,
        point_shape: int | tuple[int, ...],
        project: Function | None = None,
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
        self.operations: Operations = Operations(self)
        # What the compiled core's operations are to other spaces.
        self._handle: Any = self.operations

    def dlog(self, p: ArrayLike, q: ArrayLike, w: ArrayLike) -> Array:
        """The derivative of log(p, ·) at the point q in the direction w, a tangent vector at q.

        Args:
            p, q, w: shape (..., *point_shape); leading axes broadcast.

        Returns:
            A tangent vector at p, shape (..., *point_shape).
        """
        inputs = [self._numbers(self._doubles(x, name)) for x, name in ((p, "p"), (q, "q"), (w, "w"))]
        a, b, c = np.broadcast_arrays(*inputs)
        return self.operations.dlog(a, self.log(a, b), b, c)

    def _dlog(self, p: Array, v: Array, q: Array, w: Array) -> Array:
        """The same at q = exp(p, v), of rows."""
        if self.functions.dlog is not None:
            result: Array = self.functions.dlog(p, q, w)
            return result
        return dlog_by_differences(self.operations, p, v, q, w, self._radius)

    def frame(self, p: ArrayLike) -> Array:
        """Orthonormal tangent vectors at the points p, shape (..., dim, *point_shape)."""
        points = self._numbers(self._doubles(p, "p"))
        frames = basis_at(self.operations, points)
        return frames.reshape(*frames.shape[:-1], *self.point_shape)

    def random_point(self, rng: np.random.Generator, shape: int | tuple[int, ...] = ()) -> Array:
        """Random points, shape ``shape + point_shape``: normal numbers, projected by ``project``.

        Raises:
            ValidationError: there is no ``project``.
        """
        return super().random_point(rng, shape)

    def random_tangent(self, rng: np.random.Generator, p: ArrayLike) -> Array:
        """Standard normal tangent vectors at the points p."""
        frames = self.frame(p)
        lead = frames.shape[: frames.ndim - len(self.point_shape)]
        numbers = rng.standard_normal(lead)
        scaled = numbers.reshape(*lead, *[1] * len(self.point_shape)) * frames
        return np.asarray(scaled.sum(axis=len(lead) - 1))

    def distance(self, p: ArrayLike, q: ArrayLike) -> Array:
        """Length of the geodesic between p and q that ``log`` gives; shape of the leading axes.

        Raises:
            CutLocusError: ``log`` gives none.
        """
        return self.norm(p, self.log(p, q))

    def _description(self) -> str:
        return f"exp={described(self.functions.exp)}, point_shape={self.point_shape}"

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._description()})"

    def __str__(self) -> str:
        # There is no name that could be read back.
        return repr(self)

    def _key(self) -> tuple[Any, ...]:
        return self.functions, self._radius, self._point_shape, self._dim, self._dtype

    def __eq__(self, other: object) -> bool:
        """Whether it is made of the same functions and numbers."""
        return type(self) is type(other) and isinstance(other, Manifold) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __reduce__(self) -> tuple[Any, ...]:
        return _remade, (
            self.functions,
            None if np.isinf(self._radius) else self._radius,
            self._point_shape,
            self._dim,
            self._dtype,
        )


def _remade(
    functions: Functions, radius: float | None, shape: tuple[int, ...], dim: int | None, dtype: Any
) -> Manifold:
    return Manifold(**functions._asdict(), injectivity_radius=radius, point_shape=shape, dim=dim, dtype=dtype)


def _shape(value: Any) -> tuple[int, ...]:
    sizes = (value,) if isinstance(value, (int, np.integer)) else value
    if not isinstance(sizes, (tuple, list)) or not sizes:
        raise ValidationError(
            f"point_shape must be a whole number or a tuple of them, not {short_repr(value)}"
        )
    return tuple(whole_number(size, "point_shape", 1) for size in sizes)


def _radius(value: Any) -> float:
    if value is None:
        return float(np.inf)
    number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not number or not value > 0:
        raise ValidationError(
            f"injectivity_radius must be a positive number, or None for no limit, not {short_repr(value)}"
        )
    return float(value)


def refuse_functions(space: Space[Any], what: str, named: bool = False) -> None:
    """Raise ValidationError if the space, or a factor of it, is a manifold that is made of functions, on which there is
    no such thing; ``named`` ones, which the library makes by their names, may be let through."""
    for factor in factors_of(space):
        if isinstance(factor, Manifold) and not (named and hasattr(factor, "_name")):
            raise ValidationError(f"{what} on a manifold that is made of functions, {factor!r}")

"""The functions of a manifold as the table of operations that every space has, their derivatives, and frames."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike

from .._base.arrays import short_repr
from .._base.typing import AnyFunction, Array
from .._core import CutLocusError, ValidationError
from .._spaces import AnySpace, Doubles


class Functions(NamedTuple):
    """The functions that a manifold is made of, see `symspline.Manifold`."""

    exp: AnyFunction
    log: AnyFunction
    project_tangent: AnyFunction
    inner: AnyFunction
    dlog: AnyFunction | None = None
    transport: AnyFunction | None = None
    project: AnyFunction | None = None


class Operations:
    """The counterpart of the `Handle` of the compiled core: operations on rows of floating-point numbers.

    The methods with names of geometry take arrays of points with any equal leading axes, and call the functions with
    one.
    """

    def __init__(self, space: AnySpace) -> None:
        # A `Manifold`, which is defined in terms of this class.
        self.space: Any = space

    # ---- geometry, on arrays of numbers ----

    def exp(self, p: Array, v: Array) -> Array:
        return self._call("exp", p, v)

    def log(self, p: Array, q: Array) -> Array:
        """NaN where there is no logarithm."""
        logs = self._applied("log", partial(rows_or_nan, self._function("log")), (p, q))
        # Formulas that divide by the distance are undefined at equal points.
        same = (p == q).all(axis=self.space._point_axes)
        if same.any():
            # A copy: logarithms of other libraries may be read-only arrays.
            logs = logs.copy()
            logs[same] = 0.0
        return logs

    def project_tangent(self, p: Array, v: Array) -> Array:
        return self._call("project_tangent", p, v)

    def transport(self, p: Array, q: Array, v: Array) -> Array:
        return self._call("transport", p, q, v)

    def project(self, x: Array) -> Array:
        return self._call("project", x)

    def inner(self, p: Array, u: Array, v: Array) -> Doubles:
        return self._call("inner", p, u, v)

    def basis(self, p: Array) -> Array:
        """Orthonormal tangent vectors at points: shape (..., dim, numbers of a point)."""
        return basis_at(self, p)

    def turns(self, p: Array, basis: Array) -> Doubles:
        """See `turns_between`."""
        return turns_between(self, p, basis)

    def forms(self, p: Array, frames: Array) -> Array | None:
        """Vectors whose scalar products with the numbers of tangent vectors are the inner products of `frames`, of
        shape (curves, nodes, dim, numbers of a point), with them; None if they are not known."""
        return None

    def norm(self, p: Array, v: Array) -> Doubles:
        return np.asarray(np.sqrt(np.maximum(self.inner(p, v, v), 0.0)))

    def dlog(self, p: Array, v: Array, q: Array, w: Array) -> Array:
        """The derivative of log_p at q = exp_p(v) in the direction w."""
        return self._applied("dlog", self.space._dlog, (p, v, q, w))

    def bends(self, p: Array, v: Array) -> Array:
        """D log of the vector to the other inner control point minus the handle v, at both ends of segments, which the
        first axis has: h²/6 times the accelerations."""
        q = self.exp(p, v)
        return self.dlog(p, v, q, self.log(q, q[::-1])) - v

    # Whether `curve` has derivatives.
    differentiates = False

    def curve(self, order: int, tau: Doubles, p: Array, v: Array, q: Array, w: Array) -> tuple[Array, ...]:
        """De Casteljau's algorithm: points of segments, given by their control polygons, at tau from 0 to 1; with order
        1 or 2 also the velocities or the covariant accelerations with respect to tau."""
        t = tau.reshape(-1, *[1] * (p.ndim - 2))
        # The outer handles are given by their velocities, which is exact for long ones, too.
        starts = np.stack([p[0], q[0], p[1]])
        a, b, c = self.exp(starts, np.stack([t * v[0], t * w[0], (1 - t) * v[1]]))
        d, e = self._between(np.stack([a, b]), np.stack([b, c]), t)
        return (self._between(d, e, t),)

    def _between(self, p: Array, q: Array, t: Array) -> Array:
        return self.exp(p, t * self.log(p, q))

    def _call(self, name: str, *inputs: Array) -> Array:
        return self._applied(name, self._function(name), inputs)

    def _applied(self, name: str, function: AnyFunction, inputs: tuple[Array, ...]) -> Array:
        """What a function gives for rows of finite numbers, and NaN for others, which decompositions of matrices
        refuse."""
        space = self.space
        lead = inputs[0].shape[: inputs[0].ndim - len(space.point_shape)]
        count = math.prod(lead)
        shape, dtype = ((), np.dtype(np.float64)) if name == "inner" else (space.point_shape, space.dtype)
        rows = [x.reshape(count, *space.point_shape) for x in inputs]
        axes = tuple(range(1, rows[0].ndim))
        good = np.logical_and.reduce([np.isfinite(x).all(axis=axes) for x in rows])
        if good.all() and count:
            return self._of_rows(name, function, rows, shape, dtype).reshape(lead + shape)
        result = np.full((count, *shape), np.nan, dtype)
        if good.any():
            result[good] = self._of_rows(name, function, [x[good] for x in rows], shape, dtype)
        return result.reshape(lead + shape)

    def _of_rows(
        self, name: str, function: AnyFunction, rows: list[Array], shape: tuple[int, ...], dtype: DTypeLike
    ) -> Array:
        """Call a function, and check the shape and the type of its result."""
        with np.errstate(all="ignore"):
            values = np.asarray(function(*rows))
        wanted = (len(rows[0]), *shape)
        if values.shape != wanted:
            raise ValidationError(
                f"the function {name} of {self.space!r} gave an array of shape {values.shape} for {wanted[0]} points; "
                f"{wanted} is needed"
            )
        if values.dtype.kind not in ("iuf" if dtype == np.float64 else "iufc"):
            raise ValidationError(
                f"the function {name} of {self.space!r} gave numbers of type {values.dtype}; {dtype} is needed"
            )
        return np.ascontiguousarray(values, dtype)

    def _function(self, name: str) -> AnyFunction:
        function: AnyFunction | None = getattr(self.space.functions, name)
        if function is None:
            raise ValidationError(f"{self.space!r} was made without {name}=, which is needed here")
        return function

    # ---- the interface of a handle of the compiled core ----

    def dim(self) -> int:
        if self.space._dim is None:
            raise ValidationError(f"{self.space!r} was made without dim=, which is needed here")
        return int(self.space._dim)

    def injectivity_radius(self) -> float:
        return float(self.space._radius)

    def curvature(self) -> float:
        return math.nan

    def fibre(self) -> int:
        return 0

    def apply(self, operation: str, inputs: list[Doubles], t: Any = None) -> Doubles:
        if operation == "rounding":
            return np.ones(len(inputs[0]))
        if operation == "transvection":
            raise ValidationError(f"{self.space!r} is not known to be symmetric: it has no transvections")
        shape = (len(inputs[0]), *self.space._doubles_shape)
        points = [self.space._numbers(np.ascontiguousarray(x).reshape(shape)) for x in inputs]
        work: dict[str, Callable[..., Array]] = {
            "log": self._log,
            "geodesic": lambda p, q: self.exp(p, t.reshape(-1, *[1] * (p.ndim - 1)) * self._log(p, q)),
            "distance": lambda p, q: self.norm(p, self.log(p, q)),
            "scatter": self.project,
            "random_tangent": self.project_tangent,
        }
        values = work[operation](*points) if operation in work else self._call(operation, *points)
        return np.asarray(values if values.ndim == 1 else self.space._as_doubles(values).reshape(len(values), -1))

    def _log(self, p: Array, q: Array) -> Array:
        logs = self.log(p, q)
        bad = np.flatnonzero(~np.isfinite(logs.reshape(len(logs), -1)).all(axis=1))
        if bad.size:
            raise CutLocusError(
                f"pair {bad[0]}: the points lie at or past each other's cut locus: the function log of "
                f"{self.space!r} is not finite there"
            )
        return logs

    def check_points(self, points: Doubles, shape: Any, tol: float) -> None:
        """Raise unless every row is a point within ``tol``; ``shape`` is how the rows were laid out."""
        rows = self.space._numbers(np.ascontiguousarray(points).reshape(-1, *self.space._doubles_shape))
        bad = self.first_off(rows, tol)
        if bad is not None:
            index = ",".join(map(str, np.unravel_index(bad[0], tuple(shape)))) if shape else ""
            raise ValidationError(f"point{f' {index}' if index else ''} is off the space{bad[1]}")

    def first_off(self, points: Array, tol: float) -> tuple[int, str] | None:
        """The first of the points that is off the space by more than ``tol``, and why."""
        rows = points.reshape(-1, *self.space.point_shape)
        finite = np.isfinite(rows).reshape(len(rows), -1).all(axis=1)
        if not finite.all():
            return int(np.flatnonzero(~finite)[0]), ": it is not finite"
        if self.space.functions.project is None:
            near, how = self.exp(rows, np.zeros_like(rows)), "exp(p, 0) is another point"
        else:
            near, how = self.project(rows), "project(p) is another point"
        size = np.maximum(1.0, np.abs(rows).reshape(len(rows), -1).max(axis=1))
        off = np.abs(near - rows).reshape(len(rows), -1).max(axis=1)
        bad = np.flatnonzero(~(off <= tol * size))
        if not bad.size:
            return None
        return int(bad[0]), (
            f" by {off[bad[0]]:.3e}: {how} (allowed: {tol:.0e}); use space.project(x) if this is meant to be a point"
        )

    def tangent_defects(self, points: Doubles, vectors: Doubles) -> Doubles:
        """Return the relative size of the normal part of vectors."""
        shape = (len(points), *self.space._doubles_shape)
        p, v = (self.space._numbers(np.ascontiguousarray(x).reshape(shape)) for x in (points, vectors))
        size = np.abs(v).reshape(len(v), -1).max(axis=1)
        off = np.abs(v - self.project_tangent(p, v)).reshape(len(v), -1).max(axis=1)
        return np.asarray(np.divide(off, size, out=np.where(np.isfinite(size), 0.0, np.nan), where=size > 0))


def rows_or_nan(log: AnyFunction, p: Array, q: Array, errors: tuple[type[Exception], ...] = (CutLocusError,)) -> Array:
    """Logarithms of rows, NaN where there are none. Functions of this library raise for all rows then."""
    try:
        return np.asarray(log(p, q))
    except errors:
        logs = np.full(q.shape, np.nan, q.dtype)
    for i in range(len(q)):
        with suppress(*errors):
            logs[i] = log(p[i : i + 1], q[i : i + 1])[0]
    return logs


def described(value: object) -> str:
    """A function in the name of a manifold."""
    return str(getattr(value, "__qualname__", None) or short_repr(value))


# ---- derivatives by differences: of the logarithm, and of curves ----

# Steps along the geodesic at q, as parts of the injectivity radius, or of the distance of p and q and the length of
# the direction: where errors of order four are as large as those of rounding.
_OF_RADIUS = 5e-4
_OF_HANDLES = 4e-3
_PLACES = np.array([-2.0, -1.0, 1.0, 2.0])
_WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0

# Of order eight: weights of the values at 1, 2, 3, 4 steps; behind them they are minus and plus the same.
_FIRST = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
_SECOND = np.array([8 / 5, -1 / 5, 8 / 315, -1 / 560])
_EIGHTH = np.array([-56.0, 28.0, -8.0, 1.0])
STEPS = np.concatenate([np.arange(-4.0, 0.0), np.arange(1.0, 5.0)])


def dlog_by_differences(operations: Operations, p: Array, v: Array, q: Array, w: Array, radius: float) -> Array:
    """The derivative of log_p at q = exp_p(v) in the direction w, by differences of order four along its geodesic."""
    size = operations.norm(q, w)
    step = _OF_RADIUS * radius if math.isfinite(radius) else _OF_HANDLES * np.hypot(size, operations.norm(p, v))
    # Times along the geodesic with velocity w.
    s = np.divide(step, size, out=np.zeros_like(size), where=size > 0)
    ahead = np.multiply.outer(_PLACES, s).reshape(len(_PLACES), -1, *[1] * (w.ndim - 1))
    shape = (len(_PLACES), *p.shape)
    x = operations.exp(np.broadcast_to(q, shape), ahead * w)
    logs = operations.log(np.broadcast_to(p, shape), x)
    inverse = np.divide(1.0, s, out=np.zeros_like(s), where=s > 0).reshape(-1, *[1] * (w.ndim - 1))
    # Differences of logarithms, not of the products, so that what they share cancels at once.
    return np.asarray(np.tensordot(_WEIGHTS, logs, 1) * inverse)


def first_derivative(values: Array, step: Array) -> Array:
    """The derivative of a function by its values at `STEPS`, which come first."""
    odd = values[4:] - values[3::-1]
    return np.asarray(np.tensordot(_FIRST, odd, 1) / step)


def second_derivative(values: Array, step: Array) -> Array:
    """The second derivative of a function that is zero in the middle."""
    even = values[4:] + values[3::-1]
    return np.asarray(np.tensordot(_SECOND, even, 1) / step / step)


def eighth_difference(values: Array) -> Array:
    """What polynomials of degree seven have none of: large where a function is not smooth on the scale of the steps."""
    return np.asarray(np.tensordot(_EIGHTH, values[4:] + values[3::-1], 1))


# ---- orthonormal frames along the points, in which all neighbours are related by the identity ----

# Vectors at different points can then be added as if space were flat, which is what makes the tridiagonal matrix of the
# flat spline a good approximation of the derivative of the C² condition. Nothing but the speed of the solver depends on
# the frames.

# Squared lengths, relative to the longest, below which vectors are not independent.
_RANK = 1e-8
# Numbers that are worked on at a time.
_AT_ONCE = 1 << 22


def basis_at(operations: Operations, p: Array) -> Array:
    """Orthonormal tangent vectors at points: shape (..., dim, numbers of a point).

    They are made of the projections of all arrays with a single 1 (and i).

    Raises:
        ValidationError: projections and products are not those of tangent spaces of one dimension.
    """
    space = operations.space
    shape = space.point_shape
    rows = p.reshape(-1, *shape)
    units = np.eye(rows[0].size).reshape(-1, *shape) if len(rows) else np.empty((0, *shape))
    if space._complex:
        units = np.concatenate([units, 1j * units])
    pairs = len(rows), len(units), *shape
    points = np.broadcast_to(rows[:, None], pairs)
    vectors = operations.project_tangent(points, np.broadcast_to(units.astype(space.dtype), pairs))
    gram = products(operations, points[:, 0], vectors, vectors)
    if not np.isfinite(gram).all():
        index = int(np.argwhere(~np.isfinite(gram))[0, 0])
        raise ValidationError(f"inner or project_tangent of {space!r} is not finite at points[{index}]")
    values, turned = np.linalg.eigh((gram + np.swapaxes(gram, -1, -2)) / 2)
    large = values > _RANK * np.abs(values).max(axis=1, keepdims=True)
    dims = np.count_nonzero(large, axis=1)
    if len(dims) and (dims.min() == 0 or (dims != dims[0]).any()):
        raise ValidationError(
            f"project_tangent and inner of {space!r} give tangent spaces of {sorted(set(dims.tolist()))} dimensions; "
            "inner must be positive, and all tangent spaces have one dimension"
        )
    dim = int(dims[0]) if len(dims) else 0
    values, turned = values[:, -dim:], turned[:, :, -dim:]
    flat = vectors.reshape(*vectors.shape[:2], -1)
    frames = np.swapaxes(turned / np.sqrt(values)[:, None, :], -1, -2) @ flat
    return np.asarray(frames).reshape(*p.shape[: p.ndim - len(shape)], dim, -1)


def products(operations: Operations, p: Array, a: Array, b: Array) -> Array:
    """All inner products of two rows of tangent vectors: p of shape (m, ...), a and b (m, rows, ...)."""
    m, shape = len(p), operations.space.point_shape
    result = np.empty((m, a.shape[1], b.shape[1]))
    pairs = a.shape[1] * b.shape[1] * math.prod(shape)
    for some in np.array_split(np.arange(m), max(1, min(m, math.ceil(m * pairs / _AT_ONCE)))):
        full = len(some), a.shape[1], b.shape[1], *shape
        expanded = [
            p[some].reshape(-1, 1, 1, *shape),
            a[some].reshape(-1, a.shape[1], 1, *shape),
            b[some].reshape(-1, 1, b.shape[1], *shape),
        ]
        result[some] = operations.inner(*(np.broadcast_to(x, full) for x in expanded))
    return result


def frames_along(operations: Operations, p: Array) -> Array:
    """Frames at the points of curves, p of shape (curves, nodes, ...), each transported from the one before.

    Returns:
        Shape (curves, nodes, dim, numbers of a point).
    """
    curves, nodes = p.shape[:2]
    basis = operations.basis(p)
    turns = operations.turns(p, basis)
    dim = basis.shape[2]
    total = np.empty((curves, nodes, dim, dim))
    total[:, 0] = np.eye(dim)
    for i in range(nodes - 1):
        np.matmul(total[:, i], turns[:, i], out=total[:, i + 1])
    return np.asarray(total @ basis)


def turns_between(operations: Operations, p: Array, basis: Array) -> Doubles:
    """Rotations between the bases at neighbouring points, shape (curves, nodes - 1, dim, dim): row i has the components
    of the transported vector i in the basis at the next point."""
    space = operations.space
    curves, nodes, dim = basis.shape[:3]
    tangents = basis.reshape(curves, nodes, dim, *space.point_shape)
    shape = (curves, nodes - 1, dim, *space.point_shape)
    here, there = (np.broadcast_to(x[:, :, None], shape) for x in (p[:, :-1], p[:, 1:]))
    if space.functions.transport is None:
        transported = operations.project_tangent(there, tangents[:, :-1])
    else:
        transported = operations.transport(here, there, tangents[:, :-1])
    at = p[:, 1:].reshape(-1, *space.point_shape)
    maps = products(
        operations,
        at,
        transported.reshape(-1, dim, *space.point_shape),
        tangents[:, 1:].reshape(-1, dim, *space.point_shape),
    ).reshape(curves, nodes - 1, dim, dim)
    # The rotation nearest to the map between tangent spaces: transport is one, projection nearly.
    u, _, v = np.linalg.svd(np.where(np.isfinite(maps), maps, np.eye(dim)))
    return np.asarray(u @ v)

"""Curves on manifolds that are made of functions, which are evaluated in Python."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any, Literal, NamedTuple, Never, Self

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._base.typing import Array, Progress
from .._core import ValidationError
from .._spaces import AnySpace, Doubles, Euclidean, parts_of, product_norm
from ..manifolds._manifold import Manifold
from ..manifolds._operations import STEPS, Operations, eighth_difference, first_derivative, second_derivative
from .curve import NORMS, REAL, CurveArrays, FactorArrays, share

# Samples that are computed at a time.
_AT_ONCE = 1 << 12
# Of the length of a segment. Errors of order eight of a segment that turns by a radian, and rounding, are some 1e-12
# of its squared speed in its acceleration.
STEP = 1 / 64
# Eighth differences beyond this part of the way, and this part of the size of arrays, show that a segment is not
# smooth on that scale: de Casteljau's inner geodesics jump where their ends pass each other's cut locus. Then steps
# are halved, this often at most.
ROUGH, NOISE, HALVINGS = 1e-8, 1e-9, 7
# Relative tolerance of integrals, since derivatives are differences.
RTOL = 1e-9


class OnManifold(CurveArrays):
    """Curves on a `Manifold`."""

    space: Manifold
    is_compiled = False
    quad_rtol = RTOL

    def _evaluate(self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None) -> Any:
        if quantity in REAL and quantity not in NORMS:
            self._refuse(f"{quantity} is that of rotations, not")
        if quantity == "jerk":
            return jerk(self, x, outside, per_curve, progress)
        self._check_domain(x, outside, per_curve)
        batch, space = self.batch, self.space
        count = math.prod(batch)
        shape = x.shape if per_curve else batch + x.shape
        samples = math.prod(shape[len(batch) :])
        times_of_curves = np.broadcast_to(x, shape).reshape(count, samples)
        value_shape, dtype = ((), float) if quantity in NORMS else (space.point_shape, space.dtype)
        values = np.empty((count * samples, *value_shape), dtype)
        for start in range(0, len(values), _AT_ONCE):
            number = np.arange(start, min(start + _AT_ONCE, len(values)))
            values[number] = self._at(number // max(samples, 1), times_of_curves.ravel()[number], quantity, outside)
            if progress is not None:
                progress(int(number[-1]) + 1, len(values))
        return values.reshape(shape + values.shape[1:])

    def _at(self, curve: NDArray[np.int64], x: Doubles, quantity: str, outside: str) -> Array:
        """A quantity at one time for each of some curves."""
        operations, rows = self.space.operations, self._rows(curve, x, outside)
        if quantity == "point":
            return points_at(operations, rows)
        at, vectors = derivative(operations, rows, 1 if quantity in ("velocity", "speed") else 2)
        return operations.norm(at, vectors) if quantity in NORMS else vectors

    def _rows(self, curve: NDArray[np.int64], x: Doubles, outside: str) -> Rows:
        knots = self._knots
        first, last = knots[curve, 0], knots[curve, -1]
        if outside == "periodic":
            x = first + np.mod(x - first, last - first)
        # The segment that begins last before x; of the end the last one.
        i = np.empty(len(x), np.int64)
        if self.times.ndim == 1:
            i = np.searchsorted(self.times, x, side="right") - 1
        else:
            for c in np.unique(curve):
                i[curve == c] = np.searchsorted(knots[c], x[curve == c], side="right") - 1
        i = np.clip(i, 0, knots.shape[1] - 2)
        h = knots[curve, i + 1] - knots[curve, i]
        tau = (x - knots[curve, i]) / h
        straight = np.full(len(x), outside == "geodesic") & ((x < first) | (x > last))
        return Rows(tau, h, self._polygon.at((curve, i)), straight)

    @cached_property
    def _knots(self) -> Doubles:
        """Knots of every curve, in one row each."""
        nodes = self.times.shape[-1]
        return np.broadcast_to(self.times, (*self.batch, nodes)).reshape(-1, nodes)

    @cached_property
    def _polygon(self) -> ControlPolygon:
        """Control polygons of all segments; kept from the first use on."""
        nodes, shape = self.times.shape[-1], self.space.point_shape
        (factor,) = self.factors
        arrays = (factor.points, factor.velocities, factor.velocities if factor.before is None else factor.before)
        rows = [array.reshape(-1, nodes, *shape) for array in arrays]
        return control_polygons(self.space.operations, np.diff(self._knots), *rows)

    def _check_domain(self, x: Doubles, outside: str, per_curve: bool) -> None:
        """Of a curve in flat space the core checks the same."""
        flat = np.zeros((*self.batch, self.times.shape[-1], 1))
        _core.Curve([(Euclidean(1)._handle, self.times, flat, flat, None)]).evaluate(x, "point", outside, per_curve)

    def lift(self, *_: object, **__: Any) -> Never:
        self._refuse("no horizontal lift is known")

    def transport(self, *_: object, **__: Any) -> Never:
        self._refuse("parallel transport along curves is not made")

    def jvp(self, *_: object, **__: Any) -> Never:
        self._refuse("derivatives with respect to the data are not made")

    vjp = jvp

    def _refuse(self, what: str) -> Never:
        raise ValidationError(f"{what} on a manifold that is made of functions, {self.space!r}")


class Mixed(CurveArrays):
    """Curves in a product in which some factors, but not all, are spaces of the core."""

    is_compiled = False
    quad_rtol = RTOL

    def _of_factor(self, factor: FactorArrays) -> CurveArrays:
        kind = OnManifold if isinstance(factor.space, Manifold) else CurveArrays
        return kind(factor.space, self.times, (factor,), self.fitted)

    def _evaluate(self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None) -> Any:
        count = len(self.parts)
        values = tuple(
            part.evaluate(x, quantity, outside, per_curve, share(progress, i, count))
            for i, part in enumerate(self.parts)
        )
        return np.asarray(product_norm(values)) if quantity in NORMS else values

    def lift(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        start: object = None,
        progress: Progress | None = None,
    ) -> Any:
        starts = [None] * len(self.parts) if start is None else parts_of(start, self.space, "start")
        pairs = zip(self.parts, starts, strict=True)
        return tuple(part.lift(x, quantity, outside, per_curve, begin, progress) for part, begin in pairs)

    def transport(self, times: tuple[float, float], outside: str, v: ArrayLike) -> Any:
        pairs = zip(self.parts, parts_of(v, self.space, "v"), strict=True)
        return tuple(part.transport(times, outside, vectors) for part, vectors in pairs)


# ---- control polygons ----


class ControlPolygon(NamedTuple):
    """The control polygon of segments: handles v from the points p to the inner control points q, and the logarithm w
    from each q to the other one. The first axis, of length 2, has the starts and the ends; the shape is
    (2, curves, N, *point_shape)."""

    p: Array
    v: Array
    q: Array
    w: Array

    def at(self, index: Any) -> ControlPolygon:
        """Return the control polygons at an index of the axes after the first."""
        index = index if isinstance(index, tuple) else (index,)
        return ControlPolygon(*(part[(slice(None), *index)] for part in self))


def control_polygons(
    operations: Operations, h: Doubles, p: Array, u: Array, before: Array | None = None
) -> ControlPolygon:
    """The control polygons of curves with points and velocities, and those before the knots if they differ.

    They are NaN where there is no logarithm.
    """
    at, v = handles(h, p, u)
    if before is not None:
        v[1] = handles(h, p, before)[1][1]
    q = operations.exp(at, v)
    return ControlPolygon(at, v, q, operations.log(q, q[::-1]))


def handles(h: Doubles, p: Array, u: Array) -> tuple[Array, Array]:
    """The ends of segments, and the handles there."""
    third = (h / 3).reshape(*h.shape, *[1] * (p.ndim - 2))
    return np.stack([p[:, :-1], p[:, 1:]]), np.stack([third * u[:, :-1], -third * u[:, 1:]])


# ---- de Casteljau's algorithm with exp and log, and derivatives by differences ----


class Rows(NamedTuple):
    """Positions on segments, one per row.

    Attributes
    ----------
    tau : ndarray, shape (rows,)
        0 at the start of the segment and 1 at its end.
    h : ndarray, shape (rows,)
        Duration of the segment.
    polygon : ControlPolygon
        Control polygon of the segment, with rows in place of curves and segments.
    straight : ndarray of bool, shape (rows,)
        Whether the curve continues as a geodesic, before the start of the segment or after its end.
    """

    tau: Doubles
    h: Doubles
    polygon: ControlPolygon
    straight: NDArray[np.bool_]

    def at(self, chosen: NDArray[np.int64]) -> Rows:
        """Some of the rows."""
        return Rows(self.tau[chosen], self.h[chosen], self.polygon.at(chosen), self.straight[chosen])


def points_at(operations: Operations, rows: Rows) -> Array:
    """The curve (8), by its control polygon."""
    polygon = rows.polygon
    if not rows.straight.any():
        return _bezier(operations, rows.tau, polygon)
    result: Array = np.empty_like(polygon.p[0])
    for chosen, work in ((~rows.straight, _bezier), (rows.straight, _geodesic)):
        result[chosen] = work(operations, rows.tau[chosen], polygon.at(chosen))
    return result


def _bezier(operations: Operations, tau: Doubles, polygon: ControlPolygon) -> Array:
    return operations.curve(0, tau, *polygon)[0]


def _geodesic(operations: Operations, tau: Doubles, polygon: ControlPolygon) -> Array:
    before = (tau < 0.5).reshape(-1, *[1] * (polygon.p.ndim - 2))
    t = tau.reshape(before.shape)
    return operations.exp(
        np.where(before, polygon.p[0], polygon.p[1]), 3 * np.where(before, t * polygon.v[0], (1 - t) * polygon.v[1])
    )


def derivative(operations: Operations, rows: Rows, nu: int) -> tuple[Array, Array]:
    """Points, and there the velocity or the covariant acceleration. Beyond its ends a segment goes on, so that they are
    those of one segment everywhere."""
    if not operations.differentiates:
        return _by_differences(operations, rows, nu)
    if not rows.straight.any():
        return _by_formulas(operations, rows, nu)
    here, vectors = np.empty_like(rows.polygon.p[0]), np.empty_like(rows.polygon.p[0])
    for chosen, work in ((~rows.straight, _by_formulas), (rows.straight, _by_differences)):
        here[chosen], vectors[chosen] = work(operations, rows.at(np.flatnonzero(chosen)), nu)
    return here, vectors


def _by_formulas(operations: Operations, rows: Rows, nu: int) -> tuple[Array, Array]:
    here, vectors = operations.curve(nu, rows.tau, *rows.polygon)
    # Vectors that are almost zero have rounding errors of other directions.
    vectors = operations.project_tangent(here, vectors)
    return here, vectors / (rows.h**nu).reshape(-1, *[1] * (here.ndim - 1))


def _by_differences(operations: Operations, rows: Rows, nu: int) -> tuple[Array, Array]:
    """The same by differences of order eight in normal coordinates. Where the segment goes over a cut locus soon, steps
    are shorter."""
    here = points_at(operations, rows)
    vectors, least = np.empty_like(here), np.full(len(here), np.inf)
    axes = tuple(range(1, here.ndim))
    left, step = np.arange(len(here)), STEP
    for halvings in range(HALVINGS + 1):
        moved = _around(operations, rows.at(left), here[left], step)
        difference = first_derivative if nu == 1 else second_derivative
        derivatives = difference(moved, (step * rows.h[left]).reshape(-1, *[1] * (here.ndim - 1)))
        jump, size = (np.abs(x).max(axis=axes) for x in (eighth_difference(moved), here[left]))
        # What the jump may have done to the derivative: where it is noise of the logarithm, longer steps are better.
        harm = jump / step**nu
        better = (harm < least[left]) | (halvings == 0)
        vectors[left[better]], least[left[better]] = derivatives[better], harm[better]
        least[np.isnan(least)] = np.inf
        smooth = jump <= ROUGH * np.abs(moved).max(axis=(0, *(a + 1 for a in axes))) + NOISE * size
        left, step = left[~smooth], step / 2
        if not left.size:
            break
    return here, vectors


def _around(operations: Operations, rows: Rows, here: Array, step: float) -> Array:
    """Return the logarithms of the curve at `STEPS` from the points `here`."""
    shape = (len(STEPS), *here.shape)
    tau = rows.tau + np.multiply.outer(STEPS * step, np.ones_like(rows.tau))

    def repeated(x: Array) -> Array:
        return np.broadcast_to(x[:, None], (2, *shape)).reshape(2, -1, *here.shape[1:])

    # A geodesic goes on through the knot at which it begins.
    around = Rows(
        tau.ravel(),
        np.tile(rows.h, len(STEPS)),
        ControlPolygon(*map(repeated, rows.polygon)),
        np.tile(rows.straight, len(STEPS)),
    )
    return operations.log(np.broadcast_to(here, shape), points_at(operations, around).reshape(shape))


# ---- the covariant derivative of the acceleration on a manifold that is made of functions ----

# Chebyshev nodes of half a segment, on which the acceleration is interpolated.
_NODES = 16


def differentiation(nodes: Doubles, x: Doubles) -> Doubles:
    """Return the weights of values at nodes in the derivative of their interpolating polynomial at x."""
    degree = len(nodes) - 1
    derivatives = np.stack(
        [chebyshev.chebval(x, chebyshev.chebder(np.eye(degree + 1)[n])) for n in range(degree + 1)], axis=-1
    )
    return np.asarray(derivatives @ np.linalg.inv(chebyshev.chebvander(nodes, degree)))


class Intervals(NamedTuple):
    """Intervals in which a curve is smooth, one around each time.

    Attributes
    ----------
    x, starts, widths : ndarray
        The times, and the intervals in which they lie.
    """

    x: Doubles
    starts: Doubles
    widths: Doubles

    @classmethod
    def of(
        cls, knots: Doubles, x: Doubles, outside: str, side: Literal["left", "right"] = "right", halves: bool = False
    ) -> Self:
        """Return the segments, or the halves of segments, around times; at a knot, that on one side."""
        first, last = knots[0], knots[-1]
        turns = np.floor((x - first) / (last - first)) * (last - first) if outside == "periodic" else np.zeros_like(x)
        i = np.clip(np.searchsorted(knots, x - turns, side=side) - 1, 0, len(knots) - 2)
        starts, widths = knots[i] + turns, knots[i + 1] - knots[i]
        if halves:
            widths = widths / 2
            starts = np.where(x >= starts + widths, starts + widths, starts)
        if outside in ("continue", "geodesic"):
            # The first and the last segment, or the geodesics that follow them.
            starts = np.where(x > last, x, np.where(x < first, x - widths, starts))
        return cls(x, starts, widths)

    def derivative(
        self,
        space: AnySpace,
        here: Array,
        values: Callable[[Doubles], tuple[Array, Array]],
        nodes: int,
        shape: tuple[int, ...],
        progress: Progress | None = None,
    ) -> Array:
        """Differentiate vectors along a curve by interpolation at Chebyshev nodes of the intervals.

        The vectors are transported along geodesics. Transport along geodesics and along the curve differ by terms of
        third order, so that this is the covariant derivative.

        Parameters
        ----------
        here : ndarray
            Points of the curve at the times, to which vectors are transported.
        values : callable
            Function of times that returns points of the curve and vectors there.
        shape : tuple of int
            Shape of the times that broadcasts with the vectors.
        """
        at = np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes)
        weights = differentiation(at, 2 * (self.x - self.starts) / self.widths - 1) * (2 / self.widths)[..., None]
        result: Array = np.zeros_like(here)
        for k in range(nodes):
            points, vectors = values(np.ascontiguousarray(self.starts + self.widths * (at[k] + 1) / 2))
            result += weights[..., k].reshape(shape) * transported(space, points, here, vectors)
            if progress is not None:
                progress(k + 1, nodes)
        return result


def jerk(part: CurveArrays, x: Doubles, outside: str, per_curve: bool, progress: Progress | None) -> Array:
    """Return the covariant jerk ∇∇γ' of a curve in one factor, from its acceleration on half a segment."""
    space, axes = part.space, len(part.batch)
    if (per_curve and x.ndim == axes) or not x.ndim:
        # One time per curve.
        values = jerk(part, x[..., None], outside, per_curve, progress)
        return np.asarray(np.take(values, 0, axis=axes))
    # This call validates the times.
    here = part.evaluate(x, "point", outside, per_curve)
    if part.times.ndim > 1 and not per_curve:
        x, per_curve = np.broadcast_to(x, part.batch + x.shape), True
    knots, rows = part.times, [x]
    if knots.ndim > 1:
        knots = np.broadcast_to(knots, (*part.batch, knots.shape[-1])).reshape(-1, knots.shape[-1])
        rows = list(x.reshape(len(knots), -1))
    intervals = [Intervals.of(*pair, outside, halves=True) for pair in zip(np.atleast_2d(knots), rows, strict=True)]
    starts, widths = (np.reshape([getattr(row, name) for row in intervals], x.shape) for name in ("starts", "widths"))

    def values_at(times: Doubles) -> tuple[Array, Array]:
        points, vectors = (part.evaluate(times, name, outside, per_curve) for name in ("point", "acceleration"))
        return points, vectors

    shape = x.shape + (1,) * len(space.point_shape)
    return Intervals(x, starts, widths).derivative(space, here, values_at, _NODES, shape, progress)


def transported(space: AnySpace, p: Array, q: Array, vectors: Any) -> Array:
    """Transport vectors from p to q along geodesics; NaN where anything is missing."""
    valid = space._where_finite(p) & space._where_finite(q) & space._where_finite(vectors)
    out = np.full(vectors.shape, np.nan, vectors.dtype)
    if valid.any():
        out[valid] = space.transport(p[valid], q[valid], vectors[valid])
    return out

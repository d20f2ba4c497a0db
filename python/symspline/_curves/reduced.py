"""Curves in the span of their points: high ambient dimension without high cost.

Vectors or subspaces of n dimensions that span only m < n lie in a copy of the space of m dimensions that
is totally geodesic: geodesics and transvections between them never leave it. One QR decomposition gives
coordinates there; the curve is fitted and evaluated in them and lifted back.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, Never, Self

import numpy as np

from .._core import ValidationError
from .._spaces import Array, Space
from .._spaces.base import LARGE as _LARGE
from .core_curve import CoreCurve
from .curve import NORMS, Doubles
from .gradient import SampleTimes
from .solve import Options, Progress, Solved, Task, one_by_one, solve_single, solve_some
from .subspan import Span, span_of


def reduced(space: Space[Any], points: Array) -> tuple[Space[Any], Array, Span | None]:
    """A space, and points in it, to compute with; and the span to lift results from, if they lie in one."""
    if not ReducedCurve.suits(space):
        return space, points, None
    span = span_of(space, points)
    return span.space, span.coordinates(points), span


class ReducedCurve(CoreCurve):
    """Curves in a large space, made of plain ones in a small space.

    Args:
        fitted: whether velocities are those of a C² curve, which lie in the span of the points and the velocities
            at the ends.
    """

    _compiled = False

    def __init__(
        self, space: Space, times: Doubles, points: Array, velocities: Array, fitted: bool = True
    ) -> None:
        super().__init__(space, times, points, velocities)
        self._fitted = fitted

    @staticmethod
    def suits(space: Space) -> bool:
        return space._linear and space.point_shape[0] >= _LARGE

    @staticmethod
    def solve(task: Task, options: Options, progress: Progress | None = None) -> Solved:
        if task.offsets is None:
            return solve_some(task, options, progress, _solve)
        return one_by_one(task, options, progress, _solve)

    @cached_property
    def small(self) -> tuple[Span, CoreCurve]:
        """The span, and the curves in it; kept from the first use on."""
        vectors = self.velocities
        if self._fitted:
            vectors = np.take(vectors, [0, -1], axis=len(self.batch))
        span = span_of(self.space, self.points, vectors)
        return span, CoreCurve(
            span.space, self.times, span.coordinates(self.points), span.coordinates(self.velocities)
        )

    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        span, small = self.small
        values = small.evaluate(x, quantity, outside, per_curve, progress)
        return values if quantity in NORMS else span.embed_samples(values, self.batch)

    def _lifted(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        start: Doubles,
        progress: Progress | None,
    ) -> Array:
        # The span has the same factors.
        span, small = self.small
        return span.embed_samples(small._lifted(x, quantity, outside, per_curve, start, progress), self.batch)

    def transport(self, times: tuple[float, float], outside: str, v: Any) -> Array:
        # What the vector has outside the span of the curve is carried, too.
        knots = len(self.batch)
        rows = np.expand_dims(np.asarray(v, self.space.dtype), knots)
        span = span_of(self.space, self.points, self.velocities, rows)
        small = CoreCurve(
            span.space, self.times, span.coordinates(self.points), span.coordinates(self.velocities)
        )
        found = small.transport(times, outside, np.squeeze(span.coordinates(rows), knots))
        return np.squeeze(span.embed(np.expand_dims(found, knots)), knots)

    def jvp(self, at: SampleTimes, bc_type: Any, points: Any, t: Any, ends: Any) -> Never:
        self._refuse_derivatives()

    def vjp(self, at: SampleTimes, bc_type: Any, cotangent: Any) -> Never:
        self._refuse_derivatives()

    def _refuse_derivatives(self) -> Never:
        raise ValidationError(
            f"derivatives with respect to the data are not made in as many dimensions as {self.space} has: "
            "motions of points leave the span in which the curve is computed"
        )

    def _with(self, times: Doubles, points: Array, velocities: Array) -> Self:
        return type(self)(self.space, times, points, velocities, self._fitted)

    def __reduce__(self) -> tuple[Any, ...]:
        kind, arguments = super().__reduce__()
        return kind, (*arguments, self._fitted)


def _solve(task: Task, options: Options, progress: Progress | None) -> Solved:
    """Curves of one length."""
    space = task.space
    points = space._numbers(task.points)
    # Vectors at the ends as rows of one knot.
    axis = -1 - len(space.point_shape)
    vectors = [
        None if value is None else np.expand_dims(space._numbers(value), axis) for _, value in task.ends or []
    ]
    span = span_of(space, points, *(vector for vector in vectors if vector is not None))
    ends = task.ends and [
        (kind, None if vector is None else span.space._as_doubles(span.coordinates(vector).squeeze(axis)))
        for (kind, _), vector in zip(task.ends, vectors, strict=True)
    ]
    small = task._replace(
        space=span.space, points=span.space._as_doubles(span.coordinates(points)), ends=ends
    )
    found = solve_single(small, options, progress)
    return found._replace(points=points, velocities=span.embed(found.velocities))

"""Low-rank reduction: curves in large spaces are computed in the span of their points.

Points in n dimensions that span only m < n dimensions lie in a totally geodesic copy of the same space in m
dimensions: geodesics and transvections between them stay in it. One QR decomposition yields coordinates in the span.
Curves are fitted and evaluated in these coordinates, and the results are embedded in the large space.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._base.typing import Array, Progress
from .._spaces import AnySpace, ComplexGrassmannian, Doubles, Grassmannian, Hyperbolic, Space, cover_of
from .ends import map_ends, original_nodes
from .solve import Options, Solved, Task, solve_single


class Span(NamedTuple):
    """A large space, the small space of coordinates in a span, and a basis of that span.

    In hyperbolic space, the basis is that of the space-like part. The time-like coordinate does not change.

    Attributes
    ----------
    large : Space
        The large space.
    space : Space
        The space of coordinates.
    basis : ndarray, shape (..., n, m)
        Orthonormal columns.
    """

    large: Space
    space: Space
    basis: Array

    def coordinates(self, x: Array) -> Array:
        """Return coordinates of points or vectors of shape (..., knots, *point_shape)."""
        time, columns, shape = _columns(self.space, x)
        small = np.swapaxes(self.basis.conj(), -1, -2) @ columns
        return _uncolumns(self.space, time, small, shape)

    def embed(self, x: Array) -> Array:
        """Return the points or vectors with given coordinates."""
        time, columns, shape = _columns(self.space, x)
        return _uncolumns(self.space, time, self.basis @ columns, shape)

    def embed_samples(self, values: Array, batch: tuple[int, ...]) -> Array:
        """Embed points or vectors of shape batch + times + (*point_shape)."""
        axes = len(self.space.point_shape)
        times = values.shape[len(batch) : values.ndim - axes]
        flat = values.reshape(*batch, math.prod(times), *self.space.point_shape)
        return self.embed(flat).reshape(*batch, *times, *self.large.point_shape)


def span_of(space: Space, *arrays: Array) -> Span:
    """Compute the span of points or vectors, in arrays of shape batch + (knots, *point_shape)."""
    columns = np.concatenate([_columns(space, array)[1] for array in arrays], axis=-1)
    basis = np.linalg.qr(columns)[0]
    return Span(space, _small(space, basis.shape[-1]), basis)


def _small(space: Space, m: int) -> Space:
    space = cover_of(space)
    if isinstance(space, (Grassmannian, ComplexGrassmannian)):
        return type(space)(space.point_shape[1], m)
    if isinstance(space, Hyperbolic):
        return Hyperbolic(m)
    small: Space = type(space)(m - 1)
    return small


def _columns(space: Space, x: Array) -> tuple[Array | None, Array, tuple[int, ...]]:
    """Return the time-like part, one matrix of shape (..., n, knots · width) with all columns, and the shape of x."""
    if len(space.point_shape) == 1:
        time, rest = (x[..., :1], x[..., 1:]) if isinstance(space, Hyperbolic) else (None, x)
        return time, np.swapaxes(rest, -1, -2), x.shape
    moved = np.moveaxis(x, -3, -2)
    *lead, knots, width = moved.shape
    return None, moved.reshape(*lead, knots * width), x.shape


def _uncolumns(space: Space, time: Array | None, columns: Array, shape: tuple[int, ...]) -> Array:
    if len(space.point_shape) == 1:
        rows = np.swapaxes(columns, -1, -2)
        return np.ascontiguousarray(rows if time is None else np.concatenate([time, rows], axis=-1))
    knots, width = shape[-3], shape[-1]
    stacked = columns.reshape(*columns.shape[:-1], knots, width)
    return np.ascontiguousarray(np.moveaxis(stacked, -2, -3))


def reduced(space: AnySpace, points: Array) -> tuple[AnySpace, Array, Span | None]:
    """Return the space and the points to compute with, and the span of a low-rank reduction or None."""
    if not space._is_large:
        return space, points, None
    span = span_of(space, points)
    return span.space, span.coordinates(points), span


def solve_in_span(task: Task, options: Options, progress: Progress | None) -> Solved:
    """Solve a task of curves with equal numbers of points in the span of the points."""
    space = task.space
    points = space._numbers(task.points)
    batch, inner = task.batch, task.inner or {}

    def as_knots(value: Doubles) -> Array:
        # Vectors have shape (..., k, *point_shape), as arrays with k knots.
        numbers = space._numbers(value)
        single = numbers.ndim == len(batch) + len(space.point_shape)
        return np.expand_dims(numbers, len(batch)) if single else numbers

    def coordinates(value: Doubles) -> Doubles:
        reduced = span.space._as_doubles(span.coordinates(as_knots(value)))
        return reduced.reshape(*value.shape[: value.ndim - len(space._doubles_shape)], *span.space._doubles_shape)

    vectors = [vector for _, vector in task.ends or [] if vector is not None]
    span = span_of(space, points, *map(as_knots, [*vectors, *inner.values()]))
    small = task._replace(
        space=span.space,
        points=coordinates(task.points),
        ends=map_ends(task.ends, coordinates),
        inner={node: coordinates(vector) for node, vector in inner.items()},
    )
    solution = solve_single(small, options, progress)
    nodes = task.times.shape[-1]
    if nodes > points.shape[len(batch)]:
        whole = span.embed(solution.points)
        np.moveaxis(whole, len(batch), 0)[original_nodes(task.ends, nodes)] = np.moveaxis(points, len(batch), 0)
        points = whole
    return solution._replace(points=points, velocities=span.embed(solution.velocities))

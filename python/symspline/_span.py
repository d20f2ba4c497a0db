"""Curves in the span of their points: high ambient dimension without high cost.

Vectors or subspaces of n dimensions that span only m < n lie in a copy of the space of m dimensions that
is totally geodesic: geodesics and transvections between them never leave it. One QR decomposition gives
coordinates there; the curve is fitted and evaluated in them and lifted back.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _core
from .spaces import LARGE as _LARGE
from .spaces import ComplexGrassmannian, Grassmannian, Hyperbolic, Space

Array = NDArray[Any]
Progress = Callable[[int, int], object]


def is_large(space: Space) -> bool:
    """Whether curves in a space are made in the span of their points."""
    return space._linear and space.point_shape[0] >= _LARGE


class Span(NamedTuple):
    """A large space, a small one, and an orthonormal basis of the span: shape (..., n, m). In hyperbolic
    space the basis is of the space-like part; the time-like coordinate stays."""

    large: Space
    space: Space
    basis: Array

    def down(self, x: Array) -> Array:
        """Coordinates of points or vectors of one space, shape (..., knots, *point_shape)."""
        time, columns, shape = _columns(self.space, x)
        small = np.swapaxes(self.basis.conj(), -1, -2) @ columns
        return _uncolumns(self.space, time, small, shape)

    def up(self, x: Array) -> Array:
        """Points or vectors with given coordinates."""
        time, columns, shape = _columns(self.space, x)
        return _uncolumns(self.space, time, self.basis @ columns, shape)


def span_of(space: Space, *arrays: Array) -> Span:
    """The span of arrays of points or vectors, each of shape batch + (knots, *point_shape)."""
    columns = np.concatenate([_columns(space, array)[1] for array in arrays], axis=-1)
    basis = np.linalg.qr(columns)[0]
    return Span(space, _small(space, basis.shape[-1]), basis)


def fit_in_span(
    space: Space, times: Array, points: Array, ends: Any, options: Any, progress: Progress | None
) -> tuple[Array, Any, list[Any]]:
    """What the compiled core says of a fit: velocities, the columns of the report, and faults.

    Points and end conditions have been validated; ``options`` are method, tol and max_iter.
    """
    # Vectors at the ends as rows of one knot.
    axis = -1 - len(space.point_shape)
    vectors = [
        None if value is None else np.expand_dims(space._numbers(value), axis) for _, value in ends or []
    ]
    span = span_of(space, points, *(vector for vector in vectors if vector is not None))
    small_ends = ends and [
        (kind, None if vector is None else _doubles(span.down(vector).squeeze(axis)))
        for (kind, _), vector in zip(ends, vectors, strict=True)
    ]
    method, tol, max_iter = options
    _, velocities, columns, faults = _core.fit(
        span.space._handle,
        times,
        _doubles(span.down(points)),
        small_ends,
        method,
        tol,
        max_iter,
        False,
        0.0,
        progress=progress,
    )
    return span.up(span.space._numbers(velocities)), columns, faults


def fit_each_in_span(
    space: Space,
    times: Array,
    points: Array,
    offsets: Array,
    ends: Any,
    options: Any,
    progress: Progress | None,
) -> tuple[Array, Any, list[Any]]:
    """The same for curves that follow each other in one array, each in a span of its own."""
    velocities, columns, faults = [], [], []
    for i, (start, stop) in enumerate(pairwise(offsets)):
        own_ends = ends and [(kind, None if value is None else value[i : i + 1]) for kind, value in ends]
        share = progress and partial(_advance, progress, int(start), len(points))
        found, column, fault = fit_in_span(
            space, times[start:stop], points[None, start:stop], own_ends, options, share
        )
        velocities.append(found[0])
        columns.append(column)
        faults += [(i, kind, why.replace(" of curve 0", f" of curve {i}")) for _, kind, why in fault]
    return np.concatenate(velocities), tuple(map(np.concatenate, zip(*columns, strict=True))), faults


def _advance(progress: Progress, before: int, total: int, finished: int, _: int) -> object:
    return progress(before + finished, total)


def _doubles(numbers: Array) -> NDArray[np.float64]:
    return np.ascontiguousarray(numbers).view(np.float64)


def lifted(span: Span, values: Array, batch: tuple[int, ...]) -> Array:
    """Points or vectors of shape batch + times + (*point_shape) of the small space, back in the large."""
    axes = len(span.space.point_shape)
    times = values.shape[len(batch) : values.ndim - axes]
    flat = values.reshape(*batch, math.prod(times), *span.space.point_shape)
    return span.up(flat).reshape(*batch, *times, *span.large.point_shape)


def _small(space: Space, m: int) -> Space:
    if isinstance(space, (Grassmannian, ComplexGrassmannian)):
        return type(space)(space.point_shape[1], m)
    if isinstance(space, Hyperbolic):
        return Hyperbolic(m)
    small: Space = type(space)(m - 1)
    return small


def _columns(space: Space, x: Array) -> tuple[Array | None, Array, tuple[int, ...]]:
    """The columns of all knots side by side, shape (..., n, knots · width), and the time-like part."""
    if len(space.point_shape) == 1:
        time, rest = (x[..., :1], x[..., 1:]) if isinstance(space, Hyperbolic) else (None, x)
        return time, np.swapaxes(rest, -1, -2), x.shape
    moved = np.moveaxis(x, -3, -2)
    return None, moved.reshape(*moved.shape[:-2], -1), x.shape


def _uncolumns(space: Space, time: Array | None, columns: Array, shape: tuple[int, ...]) -> Array:
    if len(space.point_shape) == 1:
        rows = np.swapaxes(columns, -1, -2)
        return np.ascontiguousarray(rows if time is None else np.concatenate([time, rows], axis=-1))
    knots, width = shape[-3], shape[-1]
    stacked = columns.reshape(*columns.shape[:-1], knots, width)
    return np.ascontiguousarray(np.moveaxis(stacked, -2, -3))

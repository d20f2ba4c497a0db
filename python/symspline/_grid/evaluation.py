"""Values and derivatives of grids in one factor of a space."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from .. import _core
from .._base.arrays import short_repr
from .._base.typing import Progress
from .._core import ValidationError
from .._curves.on_manifold.jerk import differentiation, transported
from .._curves.reduced import span_of
from .._spaces import Array, Doubles, Space
from ..manifolds import Manifold
from .axes import GridAxis, Sites
from .compiled import CompiledGrid, Found
from .on_manifold import ManifoldGrid

# Chebyshev nodes of a segment, on which a derivative is interpolated to be differentiated once more.
_NODES = 12


class FactorGrid:
    """A grid in a space that is not a product.

    Parameters
    ----------
    points : ndarray, shape (n_1, ..., n_D, *point_shape)
        Points on the space; NaN for missing nodes.
    symmetric : bool
        Whether values are the midpoints of both orders of axes.
    velocities : ndarray, optional
        Velocities along the first axis in the coordinates of the core. By default they are computed.
    """

    def __init__(
        self,
        space: Space[Any],
        axes: list[GridAxis],
        points: Array,
        symmetric: bool,
        velocities: Array | None = None,
        progress: Progress | None = None,
    ) -> None:
        self.space, self.axes, self.points, self.symmetric = space, axes, points, symmetric
        self.forward: CompiledGrid | ManifoldGrid
        if isinstance(space, Manifold):
            self.forward = ManifoldGrid(space, axes, points)
            return
        if not space._is_large:
            self.forward = CompiledGrid(space, axes, points, None, velocities, progress)
            return
        flat = points.reshape(-1, *space.point_shape)
        valid = space._where_finite(flat)
        span = span_of(space, flat[valid])
        small = np.full((len(flat), *span.space.point_shape), np.nan, span.space.dtype)
        small[valid] = span.coordinates(flat[valid])
        small = small.reshape(*points.shape[: len(axes)], *span.space.point_shape)
        self.forward = CompiledGrid(span.space, axes, small, span, velocities, progress)

    @cached_property
    def backward(self) -> CompiledGrid | ManifoldGrid:
        """The grid with the order of axes reversed."""
        return self.forward.backwards()

    @property
    def is_missing(self) -> bool:
        """Whether the grid has missing nodes."""
        return not self.space._where_finite(self.points).all()

    def evaluate(self, sites: Sites, nu: tuple[int, ...], progress: Progress | None = None) -> tuple[Array, Found]:
        """Evaluate points, or a derivative of first or second order."""
        if sum(nu) < 2 or (nu[-1] and not self.symmetric):
            points, vectors, found = self._direct(sites, nu, progress)
            return (points if vectors is None else vectors), found
        return self._second(sites, nu)

    def gap(self, sites: Sites) -> Doubles:
        """Return the distances between the values in both orders of axes."""
        p, q = (own[0] for own in self._orders(sites, (0,) * len(self.axes), None))
        valid = self.space._where_finite(p) & self.space._where_finite(q)
        out = np.full(valid.shape, np.nan)
        out[valid] = self.space.distance(p[valid], q[valid])
        return out

    def _direct(
        self, sites: Sites, nu: tuple[int, ...], progress: Progress | None
    ) -> tuple[Array, Array | None, Found]:
        """Evaluate what the core computes directly: points, and derivatives there."""
        if not self.symmetric:
            return self.forward.run(sites, *_derivative(nu), progress)
        (p, v, found), (q, w, others) = self._orders(sites, nu, progress)
        points, vectors = _midpoint(self.space, (p, q), None if v is None or w is None else (v, w))
        return points, vectors, found.merged(others)

    def _orders(
        self, sites: Sites, nu: tuple[int, ...], progress: Progress | None
    ) -> list[tuple[Array, Array | None, Found]]:
        """Evaluate in both orders of axes."""
        first = self.forward.run(sites, *_derivative(nu), progress)
        points, vectors, found = self.backward.run(sites.reversed(), *_derivative(nu[::-1]), progress)
        if sites.outer:
            dims = len(self.axes)
            order = (*range(dims)[::-1], *range(dims, points.ndim))
            points = points.transpose(order)
            vectors = None if vectors is None else vectors.transpose(order)
        return [first, (points, vectors, found)]

    def _second(self, sites: Sites, nu: tuple[int, ...]) -> tuple[Array, Found]:
        """Compute a second derivative from first ones.

        The first derivative is smooth on each segment of the other axis. It is evaluated at Chebyshev nodes of the
        segment, transported to the point along geodesics, interpolated and differentiated there. Transport along
        geodesics and along the curve differ by terms of third order, so that this is the covariant derivative.
        """
        axis = max(k for k, order in enumerate(nu) if order)
        first = min(k for k, order in enumerate(nu) if order)
        order = tuple(int(k == first) for k in range(len(nu)))
        result, here, found = self._differentiated(sites, axis, order, False)
        knots = self.axes[axis].knots
        # At the last node of a run, only the segment before it has values.
        at_knot = np.isin(sites.x[axis], knots[1:])
        if self.is_missing and at_knot.any():
            missing = self.space._where_finite(here) & ~self.space._where_finite(result)
            other, _, more = self._differentiated(sites, axis, order, True)
            result[missing] = other[missing]
            found = found.merged(more)
        return result, found

    def _differentiated(
        self, sites: Sites, axis: int, order: tuple[int, ...], left: bool
    ) -> tuple[Array, Array, Found]:
        """Differentiate the first derivative `order` along an axis. Return it, the points and a report."""
        here, _, found = self._direct(sites, (0,) * len(order), None)
        x = sites.x[axis]
        starts, widths = _segments(self.axes[axis].knots, x, left, sites.modes[axis])
        nodes = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
        at = starts[:, None] + widths[:, None] * (nodes + 1) / 2
        weights = differentiation(nodes, 2 * (x - starts) / widths - 1) * (2 / widths)[:, None]
        result = np.zeros_like(here)
        shape = (1,) * axis + (-1,) if sites.outer else (-1,)
        lead = len(sites.shape) + len(self.space.point_shape)
        for k in range(_NODES):
            points, vectors, own = self._direct(sites.along(axis, np.ascontiguousarray(at[:, k])), order, None)
            found = found.merged(own)
            factor = weights[:, k].reshape(shape + (1,) * (lead - len(shape)))
            result += factor * transported(self.space, points, here, vectors)
        return result, here, found


def order_of_each(nu: Any, dims: int) -> tuple[int, ...]:
    """Validate the orders of a derivative along all axes."""
    if nu is None:
        return (0,) * dims
    given = (nu,) if dims == 1 and isinstance(nu, (int, np.integer)) else nu
    valid = isinstance(given, (tuple, list)) and len(given) == dims
    if not valid or any(isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < 0 for n in given):
        raise ValidationError(f"nu must be a tuple with one order per axis ({dims}), not {short_repr(nu)}")
    if sum(given) > 2:
        raise ValidationError(f"nu is {tuple(given)}, but derivatives exist up to the second order in total")
    return tuple(int(n) for n in given)


def _derivative(nu: tuple[int, ...]) -> tuple[int | None, int]:
    """Return the axis before the last one with a derivative, and the order along the last axis."""
    along = next((k for k, order in enumerate(nu[:-1]) if order), None)
    return along, nu[-1]


def _segments(knots: Doubles, x: Doubles, left: bool, mode: str) -> tuple[Doubles, Doubles]:
    """Return an interval around each coordinate on which the grid is smooth: its start and its width."""
    i = np.clip(np.searchsorted(knots, x, side="left" if left else "right") - 1, 0, len(knots) - 2)
    starts, widths = knots[i], knots[i + 1] - knots[i]
    if mode == "periodic":
        period = knots[-1] - knots[0]
        turns = np.floor((x - knots[0]) / period)
        inside = x - turns * period
        i = np.clip(np.searchsorted(knots, inside, side="left" if left else "right") - 1, 0, len(knots) - 2)
        return knots[i] + turns * period, knots[i + 1] - knots[i]
    # The first and the last segment continue outside the knots.
    starts = np.where(x > knots[-1], x, np.where(x < knots[0], x - widths, starts))
    return starts, widths


def _midpoint(
    space: Space[Any], points: tuple[Array, Array], vectors: tuple[Array, Array] | None
) -> tuple[Array, Array | None]:
    """Return midpoints of geodesics, and their derivatives; NaN where a point is missing."""
    valid = space._where_finite(points[0]) & space._where_finite(points[1])
    shape = points[0].shape
    out = np.full(shape, np.nan, space.dtype)
    p, q = (np.ascontiguousarray(each[valid]) for each in points)
    if isinstance(space, Manifold):
        if vectors is not None:
            raise ValidationError(f"derivatives of symmetric grids are not available on {space!r}")
        out[valid] = space.geodesic(p, q, np.full(len(p), 0.5))
        return out, None
    pair = None if vectors is None else tuple(space._as_doubles(np.ascontiguousarray(v[valid])) for v in vectors)
    middle, moved = _core.grid_midpoint(space._handle, (space._as_doubles(p), space._as_doubles(q)), pair)
    out[valid] = space._numbers(middle)
    if moved is None:
        return out, None
    derivative = np.full(shape, np.nan, space.dtype)
    derivative[valid] = space._numbers(moved)
    return out, derivative

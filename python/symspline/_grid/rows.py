"""Rows of nodes along one axis of a grid: their runs, their values, and the transpose of their evaluation."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.typing import Array
from .._curves.curve import CurveArrays
from .._curves.derivatives import sample_times, vjp
from .._curves.fit import curve_of
from .._spaces import AnySpace, Doubles
from .axes import GridAxis

Mask = NDArray[np.bool_]


def rows_alike(valid: Mask) -> Iterator[NDArray[np.intp]]:
    """Return the numbers of the rows that are valid at the same nodes, group by group."""
    if valid.all():
        yield np.arange(len(valid))
        return
    patterns, group = np.unique(valid, axis=0, return_inverse=True)
    for number in range(len(patterns)):
        yield np.flatnonzero(group.reshape(-1) == number)


def runs_of(valid: Mask) -> list[tuple[int, int]]:
    """Return the first node and the end of every run of valid nodes."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], valid, [False]]).astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def beside_gaps(axis: GridAxis, first: int, stop: int) -> tuple[str, str]:
    """Return the end conditions of a run: natural on natural axes, and otherwise not-a-knot beside a gap."""
    ends = axis.ends or ("not-a-knot", "not-a-knot")
    at_end = first == 0, stop == len(axis.knots)
    start, end = (
        "not-a-knot" if word == "clamped" and not there else word for word, there in zip(ends, at_end, strict=True)
    )
    return start, end


class _Run(NamedTuple):
    """Splines through a run of nodes, in rows that are alike.

    Attributes
    ----------
    rows : ndarray
        Numbers of the rows.
    nodes : ndarray
        Numbers of the nodes, shared by these rows.
    curve : CurveArrays
        The splines, a batch with one curve per row.
    bc_type : str or tuple of str
        End conditions of the splines.
    x : ndarray, shape (rows, m)
        Coordinates as times of the splines. Those outside the run are replaced by its first knot.
    inside : ndarray of bool, shape (rows, m)
        Whether the coordinates are inside the run.
    """

    rows: NDArray[np.intp]
    nodes: NDArray[np.intp]
    curve: CurveArrays
    bc_type: Any
    x: Doubles
    inside: Mask


class RowSplines:
    """Splines through rows of nodes along one axis, and coordinates at which they are evaluated.

    Parameters
    ----------
    points : ndarray, shape (..., n, *point_shape)
        Points at the nodes; NaN for missing nodes.
    velocities : ndarray, shape (..., n, *point_shape)
        Velocities at the nodes; NaN at nodes without a spline.
    x : ndarray, shape (..., m)
        Coordinates in each row, inside the axis.
    """

    def __init__(self, space: AnySpace, axis: GridAxis, points: Array, velocities: Array, x: Doubles) -> None:
        self.space, self.axis, self._shape = space, axis, x.shape
        rows = len(axis.knots), *space.point_shape
        self._points, self._velocities = points.reshape(-1, *rows), velocities.reshape(-1, *rows)
        self._x = x.reshape(-1, x.shape[-1])
        # The last node of a periodic axis repeats the first one.
        self._different = len(axis.knots) - axis.is_periodic

    def values(self) -> Array:
        """Return the points at the coordinates, shape (..., m, *point_shape); NaN where a row has no points."""
        out = np.full((*self._x.shape, *self.space.point_shape), np.nan, self.space.dtype)
        row, node, at = self._bare_nodes
        out[at] = self._points[row, node]
        for run in self._runs:
            inside = self._over_points(run.inside)
            out[run.rows] = np.where(inside, run.curve.evaluate(run.x, "point", "continue", True), out[run.rows])
        return out.reshape(*self._shape, *self.space.point_shape)

    def pull(self, cotangent: Array) -> Array:
        """Return the gradient of ``sum(cotangent * values)`` with respect to the points at the nodes.

        It consists of tangent vectors. Cotangents of values that are NaN have no effect.
        """
        weights = cotangent.reshape(*self._x.shape, *self.space.point_shape)
        gradient = np.zeros_like(self._points)
        row, node, at = self._bare_nodes
        np.add.at(gradient, (row, node), _tangent_gradient(self.space, self._points[row, node], weights[at]))
        for run in self._runs:
            within = np.where(self._over_points(run.inside), weights[run.rows], 0.0)
            gradient[np.ix_(run.rows, run.nodes)] += _pull(run.curve, run.x, run.bc_type, within)
        return gradient.reshape(*self._shape[:-1], *gradient.shape[1:])

    def _over_points(self, mask: Mask) -> Mask:
        """Add the axes of a point to a mask."""
        return mask[(..., *(None,) * len(self.space.point_shape))]

    @cached_property
    def _has_spline(self) -> Mask:
        """Which nodes are on a spline, shape (rows, n)."""
        return self.space._where_finite(self._velocities)

    @cached_property
    def _bare_nodes(self) -> tuple[NDArray[np.intp], NDArray[np.intp], tuple[NDArray[np.intp], ...]]:
        """Rows and nodes that are values without a spline, and the indices of these values."""
        row = np.arange(len(self._x))[:, None]
        node = np.searchsorted(self.axis.knots, self._x)
        bare = (self.axis.knots[node] == self._x) & ~self._has_spline[row, node]
        bare &= self.space._where_finite(self._points)[row, node]
        at = np.nonzero(bare)
        return at[0], node[at] % self._different, at

    @cached_property
    def _runs(self) -> list[_Run]:
        """The splines of all rows."""
        runs = []
        for rows in rows_alike(self._has_spline):
            valid, x, knots = self._has_spline[rows[0]], self._x[rows], self.axis.knots
            nodes, closed = np.arange(len(knots)), self.axis.is_periodic and bool(valid.all())
            if self.axis.is_periodic and not closed:
                nodes, knots, x = self._from_gap(valid, x)
            for first, stop in runs_of(valid[nodes]):
                of_run, times = nodes[first:stop], np.ascontiguousarray(knots[first:stop])
                inside = (x >= times[0]) & (x <= times[-1])
                if not inside.any():
                    continue
                at = np.ix_(rows, of_run)
                curve = curve_of(self.space, times, [(self._points[at], self._velocities[at])])
                bc_type = "periodic" if closed else beside_gaps(self.axis, first, stop)
                runs.append(_Run(rows, of_run, curve, bc_type, np.where(inside, x, times[0]), inside))
        return runs

    def _from_gap(self, valid: Mask, x: Doubles) -> tuple[NDArray[np.intp], Doubles, Doubles]:
        """Number the nodes of periodic rows from one after a gap on, so that the ends of the axis divide no run.

        Return the nodes, their knots and the coordinates in this order.
        """
        t, count = self.axis.knots, self._different
        start = int(np.argmin(valid)) + 1
        numbers = np.arange(start, start + count)
        knots = np.concatenate([t[:-1], t[:-1] + (t[-1] - t[0])])[numbers]
        x = np.where(x == t[-1], t[0], x)
        return numbers % count, knots, np.where(x < knots[0], x + (t[-1] - t[0]), x)


def _pull(curve: CurveArrays, x: Doubles, bc_type: Any, cotangent: Array) -> Array:
    """Return the gradient of ``sum(cotangent * curve(x))`` with respect to the points, for times of each curve."""
    gradient: Array = vjp(curve, sample_times(curve.times, curve.batch, x, True, 0), bc_type, cotangent).points
    return gradient


def _tangent_gradient(space: AnySpace, points: Array, cotangent: Array) -> Array:
    """Return the gradient of ``sum(cotangent * points)``: that of curves that stand still, at their first points."""
    pairs = np.stack([points, points], axis=1)
    still = curve_of(space, np.array([0.0, 1.0]), [(pairs, np.zeros_like(pairs))])
    return _pull(still, np.zeros((len(points), 1)), "natural", cotangent[:, None])[:, 0]

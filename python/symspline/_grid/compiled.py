"""Grids in spaces of the compiled core."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .. import _core
from .._base.faults import CUT_LOCUS, UNCONVERGED, Fault, from_core, imprecise
from .._base.report import Columns
from .._base.typing import Progress
from .._curves.reduced import Span
from .._spaces import Array, Doubles, Space
from .axes import GridAxis, Sites


class Found(NamedTuple):
    """What the fits of many rows report together.

    Attributes
    ----------
    failed : int
        Number of rows that failed.
    fault : Fault or None
        The fault of the first of them.
    residual : float
        Largest residual of the others.
    """

    failed: int = 0
    fault: Fault | None = None
    residual: float = 0.0

    def merged(self, other: Found) -> Found:
        """Return both reports as one."""
        residual = max(self.residual, other.residual)
        return Found(self.failed + other.failed, self.fault or other.fault, residual)


class _Arrays(NamedTuple):
    """Arrays of a grid for the core: points and velocities as rows along axis 0, which comes last."""

    axes: list[tuple[Doubles, list[str] | None, str]]
    points: Doubles
    velocities: Doubles


class CompiledGrid:
    """Nodes of a grid in a space of the core, with the splines along its first axis.

    Parameters
    ----------
    points : ndarray, shape (n_1, ..., n_D, *point_shape)
        Points on the space; NaN for missing nodes.
    span : Span or None
        Span of a low-rank reduction, in which points and velocities are coordinates.
    velocities : ndarray, optional
        Velocities along the first axis. By default they are computed.
    order : {1, -1}
        Whether the axes are in the order of the user, for messages.
    """

    def __init__(
        self,
        space: Space[Any],
        axes: list[GridAxis],
        points: Array,
        span: Span | None,
        velocities: Array | None = None,
        progress: Progress | None = None,
        order: int = 1,
    ) -> None:
        self.space, self.axes, self.span, self._order = space, axes, span, order
        self.points = points
        self.found = Found()
        self._rows = self._in_rows(points)
        if velocities is None:
            own, summary = _core.grid_rows(space._handle, self._axis(0, "continue"), self._rows, progress)
            self._velocities, self.found = own, self._read(summary)
        else:
            self._velocities = self._in_rows(velocities)

    @property
    def velocities(self) -> Array:
        """Velocities at the nodes along the first axis, in the order of the axes."""
        return np.moveaxis(self.space._numbers(self._velocities), len(self.axes) - 1, 0)

    def backwards(self) -> CompiledGrid:
        """Return the grid with the order of axes reversed."""
        dims = len(self.axes)
        order = (*range(dims)[::-1], *range(dims, self.points.ndim))
        points = np.ascontiguousarray(self.points.transpose(order))
        return CompiledGrid(self.space, self.axes[::-1], points, self.span, order=-self._order)

    def run(
        self, sites: Sites, along: int | None, last: int, progress: Progress | None
    ) -> tuple[Array, Array | None, Found]:
        """Evaluate points, and a derivative there.

        Parameters
        ----------
        along : int or None
            Axis before the last one along which the first derivative is taken.
        last : {0, 1, 2}
            Order of the derivative along the last axis; at most 1 together with `along`.

        Returns
        -------
        tuple
            Points, the derivative or None, and the report of the fits.
        """
        axes = [self._axis(k, mode) for k, mode in enumerate(sites.modes)]
        arrays = _Arrays(axes, self._rows, self._velocities)
        if sites.outer:
            points, vectors, summary = _core.grid_product(self.space._handle, arrays, sites.x, along, last, progress)
        else:
            x = np.ascontiguousarray(np.stack(sites.x, axis=-1))
            points, vectors, summary = _core.grid_scattered(self.space._handle, arrays, x, along, last, progress)
        return self._shown(points), None if vectors is None else self._shown(vectors), self._read(summary)

    def _axis(self, k: int, mode: str) -> tuple[Doubles, list[str] | None, str]:
        axis = self.axes[k]
        return axis.knots, None if axis.ends is None else list(axis.ends), mode

    def _in_rows(self, array: Array) -> Doubles:
        """Move the first axis behind the others."""
        return self.space._as_doubles(np.ascontiguousarray(np.moveaxis(array, 0, len(self.axes) - 1)))

    def _shown(self, doubles: Doubles) -> Array:
        """Return results of the core as points or vectors of the user's space."""
        numbers = self.space._numbers(doubles)
        return numbers if self.span is None else self.span.embed_samples(numbers, ())

    def _read(self, summary: Any) -> Found:
        failed, first, residual, *_ = summary
        if first is None:
            return Found(0, None, residual)
        axis, kind, node, value, limit, own = first
        number = axis if self._order > 0 else len(self.axes) - 1 - axis
        return Found(failed, row_fault(number, kind, node, value, limit, own), residual)


def row_fault(
    axis: int, kind: str, node: int | None, value: float, limit: float, residual: float, tol: float = 1e-12
) -> Fault:
    """Return the fault of a row along an axis."""
    where = f" of a row along axis {axis}"
    if kind == "unconverged":
        what = f"no convergence{where}: the residual is {residual:.3e}, the tolerance {tol:.0e}"
        return Fault(0, UNCONVERGED, what, "add nodes where neighbouring points are far apart", None, residual, tol)
    if kind == "imprecise":
        return Fault(0, UNCONVERGED, *imprecise(where, value, tol), None, value, tol)
    fault = from_core((0, kind, node, value, limit, None), Columns.empty(1), tol, False)
    return fault._replace(kind=CUT_LOCUS, what=fault.what.replace("{of}", where))

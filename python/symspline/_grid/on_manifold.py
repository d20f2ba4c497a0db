"""Grids on manifolds that are made of functions, row by row in Python.

The compiled core follows the same definition (`crates/grid`), with windows around scattered coordinates.
"""

from __future__ import annotations

from itertools import groupby
from typing import Any

import numpy as np

from .._base.report import ConvergenceWarning, FarPointsWarning
from .._base.typing import Extrapolate, Progress
from .._base.warnings import silenced
from .._core import ValidationError
from .._spaces import Array, Doubles, Space
from .._splines.cubic import CubicSpline
from .axes import GridAxis, Sites
from .compiled import Found, row_fault

_POLICIES: dict[str, Extrapolate] = {"continue": True, "geodesic": "geodesic", "periodic": "periodic"}


class ManifoldGrid:
    """Nodes of a grid on a `Manifold`; see `CompiledGrid`."""

    span = None

    def __init__(self, space: Space[Any], axes: list[GridAxis], points: Array) -> None:
        self.space, self.axes, self.points = space, axes, points
        self.found = Found()

    def backwards(self) -> ManifoldGrid:
        """Return the grid with the order of axes reversed."""
        dims = len(self.axes)
        order = (*range(dims)[::-1], *range(dims, self.points.ndim))
        return ManifoldGrid(self.space, self.axes[::-1], self.points.transpose(order))

    def run(
        self, sites: Sites, along: int | None, last: int, progress: Progress | None
    ) -> tuple[Array, Array | None, Found]:
        """Evaluate points, and a derivative there; see `CompiledGrid.run`."""
        if along is not None:
            raise ValidationError(
                f"derivatives along axis {along} need the sensitivity of splines to their points, which is not "
                f"available on {self.space!r}. Differentiate along the last axis, or reorder the axes."
            )
        if not sites.outer:
            return self._scattered(sites, last, progress)
        found, nodes, vectors = Found(), self.points, None
        for k, (axis, x, mode) in enumerate(zip(self.axes, sites.x, sites.modes, strict=True)):
            rows = np.moveaxis(nodes, k, len(self.axes) - 1)
            orders = [0, last] if k + 1 == len(self.axes) and last else [0]
            *_, values = evaluated = [self._row_values(axis, rows, x, mode, nu, k) for nu in orders]
            nodes = np.moveaxis(evaluated[0][0], len(self.axes) - 1, k)
            vectors = np.moveaxis(values[0], len(self.axes) - 1, k) if len(orders) > 1 else None
            found = found.merged(evaluated[0][1])
            if progress:
                progress(k + 1, len(self.axes))
        return nodes, vectors, found

    def _scattered(self, sites: Sites, last: int, progress: Progress | None) -> tuple[Array, Array | None, Found]:
        """Evaluate scattered coordinates one at a time."""
        count = len(sites.x[0])
        points = np.full((count, *self.space.point_shape), np.nan, self.space.dtype)
        vectors = points.copy() if last else None
        found = Found()
        for i in range(count):
            one = Sites([x[i : i + 1] for x in sites.x], True, sites.modes)
            p, v, own = self.run(one, None, last, None)
            points[i] = p.reshape(self.space.point_shape)
            if vectors is not None and v is not None:
                vectors[i] = v.reshape(self.space.point_shape)
            found = found.merged(own)
            if progress:
                progress(i + 1, count)
        return points, vectors, found

    def _row_values(
        self, axis: GridAxis, rows: Array, x: Doubles, mode: str, nu: int, number: int
    ) -> tuple[Array, Found]:
        """Evaluate all rows at the same coordinates; NaN outside the runs of a row."""
        shape, lead = self.space.point_shape, rows.shape[: len(self.axes) - 1]
        flat = rows.reshape(-1, len(axis.knots), *shape)
        out = np.full((len(flat), len(x), *shape), np.nan, self.space.dtype)
        if mode == "periodic":
            start, period = axis.knots[0], axis.knots[-1] - axis.knots[0]
            x = np.where((x < start) | (x > axis.knots[-1]), start + (x - start) % period, x)
        valid = self.space._where_finite(flat)
        found = Found()
        order = sorted(range(len(flat)), key=lambda row: valid[row].tobytes())
        for _, same in groupby(order, key=lambda row: valid[row].tobytes()):
            own = np.array(list(same))
            for first, stop in _runs(valid[own[0]]):
                inside = (x >= axis.knots[first]) & (x <= axis.knots[stop - 1])
                if stop == len(axis.knots):
                    inside |= x > axis.knots[-1]
                if first == 0:
                    inside |= x < axis.knots[0]
                if stop - first == 1:
                    if nu == 0:
                        out[np.ix_(own, x == axis.knots[first])] = flat[own, first][:, None]
                    continue
                whole = stop - first == len(axis.knots)
                bc: Any = axis.bc_type if whole else _beside_gaps(axis, first, stop)
                points = np.ascontiguousarray(flat[own, first:stop])
                with silenced(ConvergenceWarning), silenced(FarPointsWarning):
                    spline = CubicSpline(
                        axis.knots[first:stop], points, self.space, bc_type=bc, check=False, on_failure="ignore"
                    )
                out[np.ix_(own, inside)] = spline(x[inside], nu, extrapolate=_POLICIES[mode])
                found = found.merged(_found(spline, number))
        return out.reshape(*lead, len(x), *shape), found


def _runs(valid: Any) -> list[tuple[int, int]]:
    """Return the first node and the end of every run of valid nodes."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], valid, [False]]).astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _beside_gaps(axis: GridAxis, first: int, stop: int) -> tuple[str, str]:
    """Return the end conditions of a run: natural on natural axes, and otherwise not-a-knot beside a gap."""
    ends = axis.ends or ("not-a-knot", "not-a-knot")
    at_end = first == 0, stop == len(axis.knots)
    start, end = (
        "not-a-knot" if word == "clamped" and not there else word for word, there in zip(ends, at_end, strict=True)
    )
    return start, end


def _found(spline: CubicSpline[Any], number: int) -> Found:
    report = spline.report
    failed = ~np.atleast_1d(np.asarray(report.converged))
    residuals = np.atleast_1d(np.asarray(report.residual, np.float64))
    if not failed.any():
        return Found(0, None, float(residuals.max(initial=0.0)))
    first = float(residuals[failed][0])
    return Found(int(failed.sum()), row_fault(number, "unconverged", None, first, np.nan, first), 0.0)

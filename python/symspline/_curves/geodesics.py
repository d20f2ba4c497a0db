"""Curves of geodesics between neighbouring points, as arrays."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Self

import numpy as np

from .._base.typing import Progress
from .._spaces import Array, Doubles, Product, Space, factors_of
from .curve import CoreCurve, CurveArrays, ProductCurve
from .fit import kind_of
from .slopes import geodesic_velocities, wide


class GeodesicCurve(CoreCurve):
    """Curves of geodesics in a space that is not a product.

    They are curves of cubic segments in which every inner knot occurs twice, with the velocities before and after it.
    The segment of length zero in between is never evaluated, because a time belongs to the last segment that begins at
    or before it. Between two points that no unique geodesic joins, velocities and the curve are NaN.

    Attributes
    ----------
    velocities : ndarray, shape (..., N+1, *point_shape)
        Velocities after the knots; at the last knot, the velocity before it.
    """

    _compiled = False

    def __init__(self, space: Space[Any], times: Doubles, points: Array, starts: Array, ends: Array) -> None:
        axis = points.ndim - len(space.point_shape) - 1
        self._starts, self._ends, self._axis = starts, ends, axis
        last = np.take(ends, [-1], axis=axis)
        super().__init__(space, times, points, np.concatenate([starts, last], axis=axis), fitted=False)
        self.quad_rtol = kind_of(space).quad_rtol

    @cached_property
    def _doubled(self) -> CoreCurve:
        """The curve with every inner knot twice."""
        space, axis = self.space, self._axis
        n = self.times.shape[-1]
        inner = np.repeat(np.arange(n), 2)[1:-1]
        pairs = np.stack([self._starts, self._ends], axis=axis + 1)
        velocities = pairs.reshape(*self.batch, 2 * (n - 1), *space.point_shape)
        times = np.ascontiguousarray(self.times[..., inner])
        return kind_of(space)(space, times, np.take(self.points, inner, axis=axis), velocities, False)

    def evaluate(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        progress: Progress | None = None,
        out: Array | None = None,
    ) -> Any:
        values = self._doubled.evaluate(x, quantity, outside, per_curve, progress, out)
        if quantity == "point":
            self._write_nodes(values, x, per_curve)
        return values

    def _write_nodes(self, values: Array, x: Doubles, per_curve: bool) -> None:
        """Write the points at which a segment without a geodesic begins."""
        gaps = ~self.space._where_finite(self._starts)
        for curve in np.argwhere(gaps.any(axis=-1)):
            index = tuple(curve)
            t, own = self.times[index] if self.times.ndim > 1 else self.times, x[index] if per_curve else x
            nodes = np.asarray(np.searchsorted(t[:-2], own))
            at = (t[nodes] == own) & gaps[index][nodes]
            values[index][at] = self.points[index][nodes[at]]

    def lift(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        start: Any = None,
        progress: Progress | None = None,
    ) -> Array:
        return self._doubled.lift(x, quantity, outside, per_curve, start, progress)

    def transport(self, times: tuple[float, float], outside: str, v: Any) -> Any:
        return self._doubled.transport(times, outside, v)

    def control_points(self) -> Any:
        return np.take(self._doubled.control_points(), np.arange(0, 2 * self.times.shape[-1] - 3, 2), axis=self._axis)

    def jumps(self) -> Doubles:
        """Return the norms of the jumps of the velocity at the inner knots, as parts of the speed before them.

        They are NaN at the ends of segments without a geodesic.
        """
        before, after = (
            np.take(velocities, own, axis=self._axis)
            for velocities, own in (
                (self._ends, np.arange(self.times.shape[-1] - 2)),
                (self._starts, np.arange(1, self.times.shape[-1] - 1)),
            )
        )
        p = np.take(self.points, np.arange(1, self.times.shape[-1] - 1), axis=self._axis)
        if not p.size:
            return np.zeros((*self.batch, 0))
        gaps = ~(self.space._where_finite(before) & self.space._where_finite(after))
        before, after = (np.where(wide(gaps, self.space), 0, own) for own in (before, after))
        with np.errstate(all="ignore"):
            jumps: Doubles = np.nan_to_num(self.space.norm(p, after - before) / self.space.norm(p, before), nan=0.0)
        jumps[gaps] = np.nan
        return jumps

    def take_batch(self, index: Any) -> Self:
        times = np.ascontiguousarray(self.times[index]) if self.times.ndim > 1 else self.times
        arrays = (np.ascontiguousarray(x[index]) for x in (self.points, self._starts, self._ends))
        return type(self)(self.space, times, *arrays)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.space, self.times, self.points, self._starts, self._ends)


def joined(space: Space[Any], times: Doubles, points: list[Array]) -> CurveArrays:
    """Return the curve of geodesics between neighbouring points, given in each factor.

    Raises
    ------
    CutLocusError
        If all neighbouring points lie at or past each other's cut locus.
    """
    parts = tuple(
        GeodesicCurve(factor, times, own, *geodesic_velocities(factor, times, own))
        for factor, own in zip(factors_of(space), points, strict=True)
    )
    return ProductCurve(space, parts) if isinstance(space, Product) else parts[0]

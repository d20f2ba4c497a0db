"""Curves on manifolds that are made of functions, evaluated in Python."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Never

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import ValidationError
from .._curves.core_curve import CoreCurve
from .._curves.curve import NORMS, REAL, Doubles, SampleTimes
from .._curves.solve import Options, Progress, Solved, Task, one_by_one, solve_unmasked
from .._faults import Fault
from .._spaces import Array, Euclidean, Space
from ._checks import validate_on_manifold
from ._condition import ControlPolygon, control_polygons
from ._evaluation import Rows, derivative, points
from ._fit import fit_of_one_length
from ._manifold import Manifold

# Samples that are computed at a time.
_AT_ONCE = 1 << 12


class OnManifold(CoreCurve):
    """Curves on a `Manifold`."""

    space: Manifold
    # Derivatives are differences.
    quad_rtol = 1e-9
    _compiled = False

    @staticmethod
    def suits(space: Space) -> bool:
        return isinstance(space, Manifold)

    @staticmethod
    def solve(task: Task, options: Options, progress: Progress | None = None) -> Solved:
        if task.offsets is not None:
            return one_by_one(task, options, progress, fit_of_one_length)
        return solve_unmasked(task, options, progress, fit_of_one_length)

    @staticmethod
    def validate(task: Task, options: Options) -> tuple[Task, list[Fault]]:
        return validate_on_manifold(task, options)

    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        if quantity in REAL and quantity not in NORMS:
            self._refuse(f"{quantity} is that of rotations, not")
        self._check_times(x, per_curve)
        self._check_domain(x, outside, per_curve)
        batch, space = self.batch, self.space
        count = math.prod(batch)
        shape = x.shape if per_curve else batch + x.shape
        each = math.prod(shape[len(batch) :])
        own = np.broadcast_to(x, shape).reshape(count, each)
        norm = quantity in NORMS
        values = np.empty(
            (count * each, *(() if norm else space.point_shape)), float if norm else space.dtype
        )
        for start in range(0, len(values), _AT_ONCE):
            number = np.arange(start, min(start + _AT_ONCE, len(values)))
            values[number] = self._at(number // max(each, 1), own.ravel()[number], quantity, outside)
            if progress is not None:
                progress(int(number[-1]) + 1, len(values))
        return values.reshape(shape + values.shape[1:])

    def _at(self, curve: NDArray[np.int64], x: Doubles, quantity: str, outside: str) -> Array:
        """A quantity at one time for each of some curves."""
        operations, rows = self.space.operations, self._rows(curve, x, outside)
        if quantity == "point":
            return points(operations, rows)
        at, vectors = derivative(operations, rows, 1 if quantity in ("velocity", "speed") else 2)
        return operations.norm(at, vectors) if quantity in NORMS else vectors

    def _rows(self, curve: NDArray[np.int64], x: Doubles, outside: str) -> Rows:
        t = (
            self._knots[curve]
            if self.times.ndim > 1
            else np.broadcast_to(self.times, (len(x), self.times.size))
        )
        first, last = t[:, 0], t[:, -1]
        if outside == "periodic":
            x = first + np.mod(x - first, last - first)
        # The segment that begins last before x; of the end the last one.
        i = np.empty(len(x), np.int64)
        if self.times.ndim == 1:
            i = np.searchsorted(self.times, x, side="right") - 1
        else:
            for c in np.unique(curve):
                i[curve == c] = np.searchsorted(self._knots[c], x[curve == c], side="right") - 1
        i = np.clip(i, 0, t.shape[1] - 2)
        number = np.arange(len(x))
        h = t[number, i + 1] - t[number, i]
        tau = (x - t[number, i]) / h
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
        rows = [a.reshape(-1, nodes, *shape) for a in (self.points, self.velocities)]
        return control_polygons(self.space.operations, np.diff(self._knots), rows[0], rows[1])

    def _check_domain(self, x: Doubles, outside: str, per_curve: bool) -> None:
        """Of a curve in flat space the core checks the same."""
        flat = np.zeros((*self.batch, self.times.shape[-1], 1))
        _core.evaluate(Euclidean(1)._handle, self.times, flat, flat, x, "point", outside, per_curve, None)

    def lift(self, *_: Any, **__: Any) -> Never:
        self._refuse("no horizontal lift is known")

    def transport(self, times: tuple[float, float], outside: str, v: Any) -> Never:
        self._refuse("parallel transport along curves is not made")

    def jvp(self, at: SampleTimes, bc_type: Any, points: Any, t: Any, ends: Any) -> Never:
        self._refuse("derivatives with respect to the data are not made")

    def vjp(self, at: SampleTimes, bc_type: Any, cotangent: Any) -> Never:
        self._refuse("derivatives with respect to the data are not made")

    def _refuse(self, what: str) -> Never:
        raise ValidationError(f"{what} on a manifold that is made of functions, {self.space!r}")

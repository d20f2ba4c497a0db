"""Curves in a product space: one curve per factor, with the same knots."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .._spaces import Doubles, Product, parts_of, product_norm
from .._typing import Progress
from .core_curve import CoreCurve
from .curve import NORMS, CurveArrays, Gradient, SampleTimes
from .derivatives import pair_of
from .ends import ends_in_factors

Tuple = tuple[Any, ...]


class ProductCurve(CurveArrays):
    """Curves in a product space."""

    space: Product

    def __init__(self, space: Product, parts: tuple[CoreCurve, ...]) -> None:
        self.space, self._parts, self.times = space, parts, parts[0].times
        self.points: Tuple = tuple([part.points for part in parts])
        self.velocities: Tuple = tuple([part.velocities for part in parts])

    @property
    def quad_rtol(self) -> float:  # type: ignore[override]
        return max(part.quad_rtol for part in self._parts)

    @property
    def batch(self) -> tuple[int, ...]:
        return self._parts[0].batch

    @property
    def parts(self) -> tuple[CoreCurve, ...]:
        return self._parts

    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        count = len(self._parts)
        values = tuple(
            part.evaluate(x, quantity, outside, per_curve, share(progress, i, count))
            for i, part in enumerate(self._parts)
        )
        return np.asarray(product_norm(values)) if quantity in NORMS else values

    def write(
        self, out: Any, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None
    ) -> Any:
        count = len(self._parts)
        return tuple(
            part.write(one, x, quantity, outside, per_curve, share(progress, i, count))
            for i, (part, one) in enumerate(zip(self._parts, parts_of(out, self.space, "out"), strict=True))
        )

    def lift(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, start: Any, progress: Progress | None = None
    ) -> Tuple:
        count = len(self._parts)
        starts = (None,) * count if start is None else parts_of(start, self.space, "start")
        return tuple(
            part.lift(x, quantity, outside, per_curve, one, share(progress, i, count))
            for i, (part, one) in enumerate(zip(self._parts, starts, strict=True))
        )

    def transport(self, times: tuple[float, float], outside: str, v: Any) -> Tuple:
        each = zip(self._parts, parts_of(v, self.space, "v"), strict=True)
        return tuple(part.transport(times, outside, one) for part, one in each)

    def control_points(self) -> Tuple:
        return tuple(part.control_points() for part in self._parts)

    def jvp(self, at: SampleTimes, bc_type: Any, points: Any, t: Any, ends: Any) -> Tuple:
        count = len(self._parts)
        moved = (None,) * count if points is None else parts_of(points, self.space, "points")
        vectors = [
            (None,) * count if end is None else parts_of(end, self.space, "an end vector") for end in pair_of(ends)
        ]
        conditions = ends_in_factors(bc_type, self.space)
        each = zip(self._parts, conditions, moved, zip(*vectors, strict=True), strict=True)
        return tuple(part.jvp(at, bc, p, t, pair) for part, bc, p, pair in each)

    def vjp(self, at: SampleTimes, bc_type: Any, cotangent: Any) -> Gradient[Any]:
        cotangents = parts_of(cotangent, self.space, "cotangent")
        each = zip(self._parts, ends_in_factors(bc_type, self.space), cotangents, strict=True)
        parts = [part.vjp(at, bc, c) for part, bc, c in each]
        first, last = (None if parts[0].ends[e] is None else tuple(g.ends[e] for g in parts) for e in (0, 1))
        t = np.sum([g.t for g in parts], axis=0)
        points: Any = tuple(g.points for g in parts)
        return Gradient(points, t, (first, last))

    def take_batch(self, index: Any) -> ProductCurve:
        return ProductCurve(self.space, tuple(part.take_batch(index) for part in self._parts))

    def __reduce__(self) -> Tuple:
        return ProductCurve, (self.space, self._parts)


def share(progress: Progress | None, i: int, count: int) -> Progress | None:
    """Return a function that converts the progress of the i-th of `count` equal tasks to that of all of them."""
    return progress and partial(_advance, progress, i, count)


def _advance(progress: Progress, i: int, count: int, finished: int, total: int) -> object:
    return progress(i * total + finished, count * total)


def longest_step(curve: CurveArrays) -> Any:
    """Compute D in equation (21), the longest distance between neighbours in the product metric."""
    pairs = ((part.space, *part.space._neighbours(part.points)) for part in curve.parts)
    steps = [space._apply("distance", p=p, q=q) for space, p, q in pairs]
    longest = np.max(product_norm(tuple(steps)), axis=-1)
    return float(longest) if np.ndim(longest) == 0 else longest

"""The segments of a curve one by one, and what they do where they meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._cubic import CubicSpline
from ._functional import evaluate
from ._spaces import Space
from .manifolds import Manifold

Array = NDArray[Any]
Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class Jumps:
    """Jumps of γ, γ' or ∇γ' at the knots where two segments meet.

    Attributes:
        size: shape (knots,).
        largest: the largest value at an end of a segment.
    """

    size: Doubles
    largest: float

    @property
    def relative(self) -> float:
        """The largest jump, relative to the largest value."""
        most = float(self.size.max(initial=0.0))
        return most / self.largest if most else 0.0


@dataclass(frozen=True)
class Segments:
    """Segments as curves of their own, each with two knots: they know nothing of their neighbours.

    Attributes:
        space: their space, not a product.
        t: shape (S, 2).
        points, velocities: shape (S, 2, *point_shape).
    """

    space: Space
    t: Array
    points: Array
    velocities: Array

    def at(self, x: Array, nu: int = 0) -> Array:
        """Every segment at its own times, the rows of x: shape (S, m, *point_shape)."""
        values: Array = evaluate(self.t, self.points, self.velocities, self.space, x, nu=nu, per_curve=True)
        return values

    def jumps(self, nu: int, closed: bool = False) -> Jumps:
        """How the ends of segments differ from the starts of the next ones, with ``closed`` also of the
        last from that of the first.

        Each value is that of its segment alone. Vectors are carried from end to start before they are
        compared, as one point may have two arrays, and their lengths are those of the space: rounding
        far out in hyperbolic space is the same as near its middle then, but for the condition |p|².
        """
        last = None if closed else -1
        places = self.at(self.t)
        end, start = places[:last, 1], _next(places)[:last]
        if nu == 0:
            flat = places.reshape(*places.shape[:2], -1)
            return Jumps(self.space.distance(end, start), float(np.linalg.norm(flat, axis=-1).max()))
        vectors = self.at(self.t, nu)
        carried = vectors[:last, 1]
        # Points of a manifold that was made without it have one array each.
        if not isinstance(self.space, Manifold) or self.space.functions.transport is not None:
            carried = self.space.transport(end, start, carried)
        size = self.space.norm(start, carried - _next(vectors)[:last])
        return Jumps(size, float(self.space.norm(places, vectors).max()))


def segments_of(spline: CubicSpline) -> Segments:
    """The segments of one curve, not in a product."""
    return Segments(spline.space, pairs(spline.t), pairs(spline.points), pairs(spline.velocities))


def pairs(values: Array) -> Array:
    """Neighbours, shape (N, 2, ...)."""
    return np.stack([values[:-1], values[1:]], axis=1)


def _next(values: Array) -> Array:
    """What comes at the start of the segment after each, after the last that of the first."""
    return np.roll(values[:, 0], -1, axis=0)

"""Segments of a curve as separate curves, and their jumps at the knots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._spaces import Array, Doubles, Space
from ..manifolds import Manifold
from .cubic import CubicSpline
from .functional import evaluate


@dataclass(frozen=True)
class Jumps:
    """Jumps of γ, γ' or ∇γ' at the knots where two segments meet.

    Attributes
    ----------
    size : ndarray, shape (knots,)
        Size of each jump.
    largest : float
        Largest value at an end of a segment.
    """

    size: Doubles
    largest: float

    @property
    def relative(self) -> float:
        """Largest jump, relative to the largest value."""
        most = float(self.size.max(initial=0.0))
        return most / self.largest if most else 0.0


@dataclass(frozen=True)
class Segments:
    """Segments as separate curves with two knots each, evaluated without their neighbours.

    Attributes
    ----------
    space : Space
        Their space, not a product.
    t : ndarray, shape (S, 2)
        Knots.
    points, velocities : ndarray, shape (S, 2, *point_shape)
        Points and velocities at the knots.
    """

    space: Space
    t: Array
    points: Array
    velocities: Array

    def at(self, x: Array, nu: int = 0) -> Array:
        """Evaluate every segment at its own times, the rows of x; shape (S, m, *point_shape)."""
        return np.asarray(evaluate(self.t, self.points, self.velocities, self.space, x, nu=nu, per_curve=True))

    def jumps(self, nu: int, closed: bool = False) -> Jumps:
        """Return the differences between the ends of segments and the starts of the next ones.

        Parameters
        ----------
        nu : {0, 1, 2}
            Order of the derivative.
        closed : bool
            Whether the last segment is compared with the first one as well.

        Notes
        -----
        Each value is computed from its segment alone. One point may have several representatives, so vectors are
        transported in parallel from end to start before they are compared. Their lengths are those of the space.
        Rounding errors far out in hyperbolic space are then comparable to those near its origin, up to the condition
        number |p|².
        """
        last = None if closed else -1
        points = self.at(self.t)
        end, start = points[:last, 1], _next(points)[:last]
        if nu == 0:
            flat = points.reshape(*points.shape[:2], -1)
            return Jumps(self.space.distance(end, start), float(np.linalg.norm(flat, axis=-1).max()))
        vectors = self.at(self.t, nu)
        transported = vectors[:last, 1]
        # A manifold made of functions without `transport` has one representative per point.
        if not isinstance(self.space, Manifold) or self.space.functions.transport is not None:
            transported = self.space.transport(end, start, transported)
        size = self.space.norm(start, transported - _next(vectors)[:last])
        return Jumps(size, float(self.space.norm(points, vectors).max()))


def segments_of(spline: CubicSpline) -> Segments:
    """Return the segments of a single curve, not in a product."""
    return Segments(spline.space, pairs(spline.t), pairs(spline.points), pairs(spline.velocities))


def pairs(values: Array) -> Array:
    """Return pairs of neighbours, shape (N, 2, ...)."""
    return np.stack([values[:-1], values[1:]], axis=1)


def _next(values: Array) -> Array:
    """Return the values at the start of the segment after each; after the last one comes the first."""
    return np.roll(values[:, 0], -1, axis=0)

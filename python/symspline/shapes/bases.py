"""Bases of the shapes along their spline, which do not turn within them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..convert.reading import refuse
from ..spaces import Grassmannian
from ..spline import CubicSpline
from .landmarks import Array


class Bases:
    """The horizontal lift X(t) of a spline of shapes.

    Attributes:
        shape: the spline, on a Grassmannian.
        start: X at the first knot.
        closed: whether the spline is.
    """

    def __init__(self, t: ArrayLike | None, points: Array, bc_type: Any) -> None:
        self.shape = CubicSpline(t, points, Grassmannian(*points.shape[:0:-1]), bc_type=bc_type)
        self.start, self.closed = points[0], bc_type == "periodic"

    def __call__(self, x: Array) -> Array:
        """X at times x, shape x.shape + (rows, n); at the end of a closed spline as it comes there."""
        first, last = self.shape.t[0], self.shape.t[-1]
        shape = self.shape
        own = shape._clock.at(x, (), False, shape._times)[0]
        refuse(
            ~((own >= shape._times[0]) & (own <= shape._times[-1])),
            "x",
            lambda i: f"is {x[i]}, outside the drawings, which go from {first} to {last}",
        )
        basis: Array = self.shape.lift(x, start=self.start)
        return basis

    def turn(self) -> Array:
        """The orthogonal matrix h by which X of a closed spline has turned when it comes back."""
        turn: Array = self.start.T @ self(self.shape.t[-1])
        return turn

    def share(self, x: Array) -> Array:
        """Times from 0 at the first knot to 1 at the last."""
        times, knots = self.shape._clock.at(x, (), False, self.shape._times)[0], self.shape._times
        return np.asarray((times - knots[0]) / (knots[-1] - knots[0]))

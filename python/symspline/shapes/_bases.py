"""Horizontal lifts of curves of shapes."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._arrays import refuse
from .._cubic import CubicSpline
from .._spaces import Grassmannian
from .._typing import TimesLike
from ._landmarks import Array


class Bases:
    """Horizontal lift X(t) of a spline of shapes.

    Attributes
    ----------
    shape : CubicSpline
        Spline on a Grassmannian.
    start : ndarray
        X at the first knot.
    closed : bool
        Whether the spline is closed.
    """

    def __init__(self, t: TimesLike | None, points: Array, bc_type: Any) -> None:
        self.shape = CubicSpline(t, points, Grassmannian(*points.shape[:0:-1]), bc_type=bc_type)
        self.start, self.closed = points[0], bc_type == "periodic"

    def __call__(self, x: Array) -> Array:
        """Return X at times x, shape x.shape + (rows, n); at the end of a closed spline, the lifted value."""
        first, last = self.shape.t[0], self.shape.t[-1]
        shape = self.shape
        own = shape._time_axis.at(x, (), False, shape._times)[0]
        refuse(
            ~((own >= shape._times[0]) & (own <= shape._times[-1])),
            "x",
            lambda i: f"is {x[i]}, but must be between the times of the first and last drawings, {first} and {last}",
        )
        return np.asarray(self.shape.lift(x, start=self.start))

    def turn(self) -> Array:
        """Return the orthogonal matrix h by which X of a closed spline is rotated after one period."""
        return np.asarray(self.start.T @ self(self.shape.t[-1]))

    def share(self, x: Array) -> Array:
        """Map times to the interval from 0 at the first knot to 1 at the last."""
        times, knots = self.shape._time_axis.at(x, (), False, self.shape._times)[0], self.shape._times
        return np.asarray((times - knots[0]) / (knots[-1] - knots[0]))

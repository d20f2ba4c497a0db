"""The motion of a curve at the times of measurements, and its moves in frames along it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import _core
from .._smoothing.posterior import coordinates
from .._spaces import Array, Doubles, Space

# Relative step of central differences: their truncation and rounding errors are then both about 1e-11.
STEP = 6e-6


class Motion(NamedTuple):
    """The motion of a curve in one space that is not a product, at n times.

    Attributes
    ----------
    space : Space
        The space.
    first : int
        Number of its first coordinate among those of all factors.
    p, v, a : ndarray, shape (n, *point_shape)
        Points, velocities and covariant accelerations; v and a are empty if no measurement needs them.
    frames : ndarray, shape (n, dim, *point_shape)
        Frames along the curve.
    """

    space: Space
    first: int
    p: Array
    v: Array
    a: Array
    frames: Array

    def coordinates(self, vectors: Array) -> Doubles:
        """Return the coordinates of tangent vectors in the frames, shape (n, dim)."""
        return coordinates(self.space, self.p, self.frames, vectors)

    def moved(self, j: int, nu: int, step: float) -> Motion:
        """Return the motion after the derivative of order `nu` of the move has changed along frame vector j.

        If the point moves by ξ, parallel transport to the new point leaves the velocity unchanged, and the acceleration
        changes by R(ξ, γ')γ'.
        """
        vector = self.frames[:, j]
        if nu == 2:
            return self._replace(a=self.a + step * vector)
        if nu == 1:
            return self._replace(v=self.v + step * vector)
        space = self.space
        there = space._apply("exp", p=self.p, v=step * vector)

        def transported(vectors: Array) -> Array:
            return space._apply("transport", p=self.p, q=there, v=vectors)

        a = self.a
        if len(a):
            a = transported(a + step * self._curvature(j))
        return self._replace(p=there, v=transported(self.v) if len(self.v) else self.v, a=a)

    def _curvature(self, j: int) -> Array:
        """Return R(ξ, γ')γ' for the frame vectors ξ of number j."""
        if self.space.curvature == 0:
            return np.zeros_like(self.p)
        unit = np.zeros((len(self.p), self.space.dim))
        unit[:, j] = 1.0
        found = _core.curvature_along(self.space._handle, self.coordinates(self.v), unit)
        result: Array = np.einsum("ij,ij...->i...", found, self.frames)
        return result

    def scale(self, nu: int) -> float:
        """Return the step of a difference in the derivative of order `nu`."""
        if nu == 0 and self.space.curvature != 0:
            return STEP
        vectors = (self.p, self.v, self.a)[nu]
        if nu == 0:
            vectors = vectors - vectors.mean(axis=0)
        return STEP * (1.0 + float(np.sqrt(np.mean(np.abs(vectors) ** 2))))

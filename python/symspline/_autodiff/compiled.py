"""What the adapters for libraries of automatic differentiation share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base.arrays import cast
from .._base.time import onto_ends
from .._base.typing import Array, CubicBCType, Keywords
from .._curves.curve import CurveArrays
from .._curves.derivatives import sample_times
from .._curves.ends import split_ends
from .._spaces import Space
from .._splines.cubic import CubicSpline

# End conditions without their vectors: a word, or a pair of words and orders.
Kinds = str | tuple[str | int, str | int]
# The vectors in them, None where there is none.
Ends = tuple[Array | None, Array | None]


def split(bc_type: CubicBCType) -> tuple[Kinds, tuple[object, object]]:
    """End conditions as something to hash, and the vectors in them (None where there is none)."""
    if isinstance(bc_type, str):
        return bc_type, (None, None)
    (_, first, a), (_, last, b) = split_ends(bc_type)
    return (first, last), (a, b)


def joined(kinds: Kinds, vectors: tuple[object, object]) -> Any:
    """The inverse of `split`."""
    if isinstance(kinds, str):
        return kinds
    return tuple(kind if isinstance(kind, str) else (kind, vector) for kind, vector in zip(kinds, vectors, strict=True))


def fitted(t: Array, points: Array, vectors: Ends, space: Space, kinds: Kinds, options: Keywords) -> CubicSpline:
    """The spline through the points of the space beside the given ones: numbers that an optimiser or a
    finite difference makes are a little off it."""
    projected = space.project(points)
    ends = list(vectors)
    for i, vector in enumerate(vectors):
        if vector is not None:
            axis = projected.ndim - len(space.point_shape) - 1
            ends[i] = space.project_tangent(projected.take(-i, axis=axis), vector)
    return CubicSpline(t, projected, space, bc_type=joined(kinds, (ends[0], ends[1])), **options)


class Movable(NamedTuple):
    """A fitted curve in a space that is not a product, and its end conditions."""

    curve: CurveArrays
    bc_type: CubicBCType

    def jvp(
        self, x: Array, dx: Array | None, points: Array | None, t: Array | None, ends: Sequence[Array | None]
    ) -> Array:
        """How the curve at times x moves, with these times and with its data."""
        at = sample_times(self.curve.times, self.curve.batch, x, False, 0)
        moved: Array = self.curve.jvp(at, self.bc_type, points, t, ends)
        if dx is None:
            return moved
        moved += self._velocity(x) * dx.reshape(dx.shape + (1,) * len(self.curve.space.point_shape))
        return moved

    def vjp(self, x: Array, cotangent: Array) -> tuple[Array, Array, Array, Ends]:
        """The transpose: gradients with respect to x, t, points and the vectors at the ends."""
        at = sample_times(self.curve.times, self.curve.batch, x, False, 0)
        gradient = self.curve.vjp(at, self.bc_type, cotangent)
        axes = tuple(range(-len(self.curve.space.point_shape), 0))
        along = np.sum((np.conj(cotangent) * self._velocity(x)).real, axis=axes)
        return along.reshape(-1, *x.shape).sum(axis=0), gradient.t, gradient.points, gradient.ends

    def _velocity(self, x: Array) -> Array:
        curve = self.curve
        times, per_curve = onto_ends(cast(x), curve.times, curve.batch, False, x.dtype)
        return np.asarray(curve.evaluate(times, "velocity", "raise", per_curve))


def movable(spline: CubicSpline) -> Movable:
    """A spline, not in a product, whose derivatives are computed."""
    return Movable(spline._solved(), spline.bc_type)

"""Derivatives with respect to data: where they are wanted, and what comes of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._typing import FloatArray, P


@dataclass(frozen=True)
class Gradient(Generic[P]):
    """The gradient of a number with respect to what a spline is made of, see `symspline.CubicSpline.vjp`.

    Attributes:
        points: tangent vectors at the points, of their shape.
        t: one number a knot, of the shape of the knots.
        ends: tangent vectors for the velocity or acceleration that was given at either end, of its shape; None
            where none was given.
    """

    points: P
    t: FloatArray
    ends: tuple[P | None, P | None]


class Places(NamedTuple):
    """Where on the curves of a batch derivatives are wanted.

    Attributes:
        x: times, shape (curves, times of each).
        shape: of a result, but for the axes of a point.
        nu: of γ, γ' or ∇γ'.
    """

    x: NDArray[np.float64]
    shape: tuple[int, ...]
    nu: int

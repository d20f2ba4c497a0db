"""Derivatives with respect to data: the times at which they are computed, and their results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._typing import FloatArray, P


@dataclass(frozen=True)
class Gradient(Generic[P]):
    """Gradient of a function of a spline with respect to its data.

    `CubicSpline.vjp` returns objects of this class.

    Attributes
    ----------
    points : ndarray or tuple of ndarray
        Tangent vectors at the points, with their shape.
    t : ndarray
        One number per knot, with the shape of the knots.
    ends : tuple
        Tangent vectors for the velocity or acceleration prescribed at either end, with its shape; None where none was
        prescribed.

    See Also
    --------
    CubicSpline.vjp : Compute the gradient of a function of the curve.

    Examples
    --------
    >>> import symspline as ss
    >>> spline = ss.CubicSpline([0, 1, 2], [[0.0], [1.0], [0.0]], "r:1")
    >>> gradient = spline.vjp(0.5, [1.0])
    >>> gradient.points.shape, gradient.t.shape, gradient.ends
    ((3, 1), (3,), (None, None))
    """

    points: P
    t: FloatArray
    ends: tuple[P | None, P | None]


class SampleTimes(NamedTuple):
    """Times on the curves of a batch at which derivatives are computed.

    Attributes
    ----------
    x : ndarray, shape (curves, times)
        Times of each curve.
    shape : tuple of int
        Shape of a result, without the axes of a point.
    nu : {0, 1, 2}
        Order of the derivative in time.
    """

    x: NDArray[np.float64]
    shape: tuple[int, ...]
    nu: int

"""What every kind of curve can do."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._spaces import Space
from .gradient import Gradient, SampleTimes
from .integrals import EXACT
from .solve import Progress

Doubles = NDArray[np.float64]

NORMS = ("speed", "bend")
# What is no point or vector of the space.
REAL = (*NORMS, "body velocity", "body acceleration")


class CurveArrays(ABC):
    """Curves of a batch, made of knots, points and velocities, with times as the compiled core counts them.

    Attributes:
        space: where they run.
        times: knots, shape (N+1,) or (..., N+1).
        points, velocities: shape (..., N+1, *point_shape); in a product tuples of such arrays.
        quad_rtol: to what relative error integrals of speed and acceleration are worth computing.
    """

    quad_rtol: float = EXACT
    space: Space[Any]
    times: Doubles
    points: Any
    velocities: Any

    @property
    @abstractmethod
    def batch(self) -> tuple[int, ...]:
        """The axes of the batch."""

    @property
    @abstractmethod
    def parts(self) -> tuple[CurveArrays, ...]:
        """The curves in the factors of a product; a curve in another space is its only part."""

    @abstractmethod
    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        """A quantity at times x: ``"point"``, ``"velocity"``, ``"acceleration"``, ``"speed"`` or ``"bend"``, |∇γ'|; of
        rotations also ``"body velocity"`` and ``"body acceleration"``. ``outside`` the knots ``"raise"``,
        ``"continue"``, ``"geodesic"`` or ``"periodic"``."""

    @abstractmethod
    def write(
        self, out: Any, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None
    ) -> Any:
        """The same of points or vectors, written into an array that takes them, which is returned."""

    @abstractmethod
    def lift(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        start: Any,
        progress: Progress | None = None,
    ) -> Any:
        """The same of the horizontal lift that starts at ``start``, see `symspline.CubicSpline.lift`."""

    @abstractmethod
    def transport(self, times: tuple[float, float], outside: str, v: Any) -> Any:
        """Parallel transport of a tangent vector of each curve from one time to another, see
        `symspline.CubicSpline.transport`."""

    @abstractmethod
    def control_points(self) -> Any:
        """Control points of the Bézier segments, shape (..., N, 4, *point_shape)."""

    @abstractmethod
    def jvp(self, at: SampleTimes, bc_type: Any, points: Any, t: Any, ends: Any) -> Any:
        """How the curve moves with its data, see `symspline.CubicSpline.jvp`."""

    @abstractmethod
    def vjp(self, at: SampleTimes, bc_type: Any, cotangent: Any) -> Gradient[Any]:
        """The transpose, see `symspline.CubicSpline.vjp`."""

    @abstractmethod
    def take_batch(self, index: Any) -> CurveArrays:
        """One curve, or a slice, along the first axis of the batch."""

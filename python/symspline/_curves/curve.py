"""Interface of all classes of curves."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, Self

from .._spaces import Array, Doubles, Space
from .._typing import FloatArray, P, Progress
from .integrals import EXACT

NORMS = ("speed", "bend")
# Quantities that are real numbers or vectors, not points or tangent vectors of the space.
REAL = (*NORMS, "body velocity", "body acceleration")


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

    x: Doubles
    shape: tuple[int, ...]
    nu: int


class UncertaintyBand(NamedTuple):
    """Noisy data near one curve, and the credible band of the curve.

    Attributes
    ----------
    x : ndarray
        Times of the data as numbers of the core.
    points : list of ndarray
        The data in each factor.
    radii : list of ndarray
        Radii of the 95 % band around the curve at the requested times, in each factor.
    speed : ndarray or None
        Standard deviation of the velocity in one direction; None in a product.
    """

    x: Doubles
    points: list[Array]
    radii: list[Doubles]
    speed: Doubles | None

    def part(self, number: int) -> Self:
        """Return the data and the band in one factor of a product."""
        return self._replace(points=[self.points[number]], radii=[self.radii[number]], speed=None)


class CurveArrays(ABC):
    """Curves of a batch: knots, points and velocities. Times are numbers of the compiled core.

    Attributes
    ----------
    space : Space
        The space of the points.
    times : ndarray, shape (N+1,) or (..., N+1)
        Knots.
    points, velocities : ndarray, shape (..., N+1, *point_shape)
        Values at the knots; for a product, tuples of such arrays.
    quad_rtol : float
        Relative tolerance of integrals along the curve, not below the accuracy of its speed and acceleration.
    """

    quad_rtol: float = EXACT
    space: Space[Any]
    times: Doubles
    points: Any
    velocities: Any

    @property
    @abstractmethod
    def batch(self) -> tuple[int, ...]:
        """Shape of the batch axes."""

    @property
    @abstractmethod
    def parts(self) -> tuple[CurveArrays, ...]:
        """The curve in each factor of a product; outside products, the curve itself."""

    @abstractmethod
    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        """Evaluate a quantity at times x.

        Parameters
        ----------
        x : ndarray
            Sampling times.
        quantity : str
            ``"point"``, ``"velocity"``, ``"acceleration"``, ``"speed"`` or ``"bend"``, which is |∇γ'|. Rotations also
            have ``"body velocity"`` and ``"body acceleration"``.
        outside : {"raise", "continue", "geodesic", "periodic"}
            Extrapolation policy.
        per_curve : bool
            Whether the leading axes of x are the batch axes.
        progress : callable, optional
            Function to call with the numbers of finished and of all steps.
        """

    @abstractmethod
    def write(
        self, out: Any, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None
    ) -> Any:
        """Evaluate points or vectors into `out`, and return it."""

    @abstractmethod
    def lift(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, start: Any, progress: Progress | None = None
    ) -> Any:
        """Evaluate the horizontal lift that starts at `start`; see `symspline.CubicSpline.lift`."""

    @abstractmethod
    def transport(self, times: tuple[float, float], outside: str, v: Any) -> Any:
        """Transport one tangent vector per curve in parallel from one time to another; see
        `symspline.CubicSpline.transport`."""

    @abstractmethod
    def control_points(self) -> Any:
        """Compute the control points of the Bézier segments, shape (..., N, 4, *point_shape)."""

    @abstractmethod
    def jvp(self, at: SampleTimes, bc_type: Any, points: Any, t: Any, ends: Any) -> Any:
        """Compute the change of the curve for a change of its data; see `symspline.CubicSpline.jvp`."""

    @abstractmethod
    def vjp(self, at: SampleTimes, bc_type: Any, cotangent: Any) -> Gradient[Any]:
        """Compute the gradient with respect to the data; see `symspline.CubicSpline.vjp`."""

    @abstractmethod
    def take_batch(self, index: Any) -> CurveArrays:
        """Return one curve or a slice of curves along the first batch axis."""

"""Searches along curves, as methods of the curves."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property
from typing import Any, Generic, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import checked_flag, checked_number, short_repr
from .._base.typing import FloatArray, P, Time
from .._core import ValidationError
from .._curves.closest import ClosestPoints
from .._curves.composed import Retimed
from .._curves.extrema import checked_values, crossings, extrema, rounding_noise
from .._curves.length import ArcLength, Evaluable
from .._spaces import Array, Doubles, Space, factors_of, parts_of
from ..manifolds import Manifold

# Names of quantities in the core.
_QUANTITIES = {"speed": "speed", "acceleration": "bend"}


class Searchable(ABC, Generic[P]):
    """Base class of curves, with the searches along them."""

    _curve: Evaluable

    @property
    @abstractmethod
    def space(self) -> Space[P]:
        """Space of the curve."""

    @cached_property
    def _arc(self) -> ArcLength:
        return ArcLength(self._curve)

    @abstractmethod
    def _shown_times(self, x: Doubles) -> NDArray[Any]:
        """Return times as the user counts them. The numbers of the core have the batch axes in front."""

    def closest(
        self, points: ArrayLike | tuple[ArrayLike, ...], *, per_curve: bool = False
    ) -> tuple[Time, FloatArray | float]:
        r"""Find the nearest points of the curve to given points.

        Parameters
        ----------
        points : array_like, shape (..., *space.point_shape)
            Points of the space, near the curve or far from it. For a `Product`, a tuple with one array per factor.
        per_curve : bool, default False
            True if every curve of a batch has its own points. The leading axes of the points are then the batch axes.

        Returns
        -------
        times : ndarray or float, shape ``(*batch axes, ...)``
            Times in the domain at which the curve is nearest to each point. If several are equally near, one of them.
            Dates are in nanoseconds. Curves that failed have NaN or NaT.
        distances : ndarray or float, shape ``(*batch axes, ...)``
            Distances between the points and the curve.

        Raises
        ------
        ValidationError
            If an array does not consist of points of the space, or if the space has no distance that belongs to an
            invariant metric, such as `SpecialEuclidean`.

        See Also
        --------
        Space.distance : Compute the distance between points.
        Curve.arc_length : Compute the length of the curve up to a time.

        Notes
        -----
        The search is global. Let :math:`d_i` and :math:`d_{i+1}` be the distances of a point from two samples of the
        curve, and :math:`L` the arc length between these. By the triangle inequality, the distance from the curve
        between them is at least :math:`(d_i + d_{i+1} - L)/2`. Intervals in which this bound exceeds the distance from
        another sample are excluded, and the others are bisected down to a fraction of a segment. In the remaining
        intervals, the minimum is a root of the derivative of the squared distance,
        :math:`-2\langle\log_{\gamma}(q), \gamma'\rangle`.

        The first call computes a table of arc lengths and samples, which further calls reuse. On a `Manifold`, the
        distance is the length of the geodesic that its function ``log`` returns.

        Examples
        --------
        The nearest time of a circle of latitude, and the distance from it:

        >>> import numpy as np
        >>> import symspline as ss
        >>> equator = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [-1, 0, 0]], "sphere:2")
        >>> time, distance = equator.closest([0.0, np.cos(0.3), np.sin(0.3)])
        >>> time.round(8), distance.round(8)
        (np.float64(1.0), np.float64(0.3))
        """
        space, own = self.space, checked_flag(per_curve, "per_curve")
        _check_metric(space)
        targets = [
            _checked(factor, value)
            for factor, value in zip(factors_of(space), parts_of(points, space, "points"), strict=True)
        ]
        batch, lead = self._curve.batch, _lead(space, targets)
        if own and lead[: len(batch)] != batch:
            raise ValidationError(
                f"with per_curve=True the shape of points must begin with the batch axes {batch}; "
                f"got leading axes {lead}"
            )
        shape = lead if own else batch + lead
        if 0 in shape:
            return self._shown_times(np.zeros(shape)), np.zeros(shape)
        inner = shape[len(batch) :]
        rows = [
            np.broadcast_to(x, shape + factor.point_shape).reshape(-1, *factor.point_shape)
            for x, factor in zip(targets, factors_of(space), strict=True)
        ]
        curve = np.repeat(np.arange(math.prod(batch), dtype=np.int64), math.prod(inner))
        with np.errstate(all="ignore"):
            times, distances = self._closest.search(rows, curve)
        return self._shown_times(times.reshape(shape))[()], distances.reshape(shape)[()]

    def extrema(
        self,
        function: Literal["speed", "acceleration"] | Callable[[Any], Any] = "speed",
        *,
        kind: Literal["max", "min"] = "max",
    ) -> tuple[NDArray[Any], FloatArray]:
        r"""Find the local maxima or minima of the speed, or of another function of time.

        Parameters
        ----------
        function : {"speed", "acceleration"} or callable, default "speed"
            The norm of the velocity, the norm of the covariant acceleration, or a function that takes an array of times
            and returns an array of real numbers of the same shape.
        kind : {"max", "min"}, default "max"
            Whether maxima or minima are returned.

        Returns
        -------
        times : ndarray, shape (m,)
            Increasing times of the extrema. An end of the domain counts if the function is larger (or smaller) there
            than next to it. The largest of all values is therefore among them.
        values : ndarray, shape (m,)
            Values of the function at these times.

        Raises
        ------
        ValidationError
            If the curve is a batch, or an argument is invalid.

        See Also
        --------
        Curve.solve : Find the times at which a function has a given value.

        Notes
        -----
        The function is interpolated at 24 Chebyshev nodes on every segment, and the extrema are the roots of the
        derivative of the polynomial. Segments are halved up to seven times until the polynomial represents the
        function to ten significant digits. Extrema at which the function varies less than that, or features much
        shorter than a segment, can be missed. A function that jumps at knots has the value after the knot there.

        Rounding errors of points cause errors of the speed of about :math:`\varepsilon/h` times the size of the points,
        and of the acceleration of about :math:`\varepsilon/h^2`, where h is the spacing of the knots: 1e-8 for
        rotations at 1 kHz. Extrema of the two quantities that are less prominent than that are omitted.

        Examples
        --------
        >>> import symspline as ss
        >>> curve = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> times, speeds = curve.extrema("speed")
        >>> times.round(8), speeds.round(8)
        (array([0., 2.]), array([1.5, 1.5]))
        >>> curve.extrema(lambda x: curve(x)[..., 0])[0].round(8)
        array([1.])
        """
        if not isinstance(kind, str) or kind not in ("max", "min"):
            raise ValidationError(f"kind must be 'max' or 'min', not {short_repr(kind)}")
        f = self._function(function)
        times = extrema(f, self._curve.times, 1.0 if kind == "max" else -1.0, self._noise(function))
        return self._shown_times(times), f(times)

    def solve(
        self, function: Literal["speed", "acceleration"] | Callable[[Any], Any], value: float = 0.0
    ) -> NDArray[Any]:
        """Find the times at which the speed, or another function of time, has a given value.

        Parameters
        ----------
        function : {"speed", "acceleration"} or callable
            The norm of the velocity, the norm of the covariant acceleration, or a function that takes an array of times
            and returns an array of real numbers of the same shape.
        value : float, default 0.0
            The value to find.

        Returns
        -------
        ndarray, shape (m,)
            Increasing times at which the function crosses the value, also by a jump.

        Raises
        ------
        ValidationError
            If the curve is a batch, or an argument is invalid.

        See Also
        --------
        Curve.extrema : Find the local maxima or minima of a function.

        Notes
        -----
        Sign changes between the Chebyshev nodes that `extrema` uses are refined by Chandrupatla's method. Two crossings
        between neighbouring nodes, and times at which the function touches the value without crossing it, can be
        missed. Rounding errors of the speed and of the acceleration do not count as crossings, see `extrema`.

        Examples
        --------
        The times at which a motion has reached half of its height:

        >>> import symspline as ss
        >>> curve = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> curve.solve(lambda x: curve(x)[..., 0], 0.5).round(6)
        array([0.347296, 1.652704])
        """
        number = checked_number(value, "value must be a finite number", math.isfinite)
        f = self._function(function)
        return self._shown_times(crossings(f, self._curve.times, number, self._noise(function)))

    def _function(self, function: Any) -> Callable[[Doubles], Doubles]:
        """Return a function of times of the core, of one curve."""
        if self._curve.batch:
            raise ValidationError(
                "the curve is a batch, but extrema belong to one curve. Use one of them, as curve[0]."
            )
        if callable(function):
            return lambda x: _called(function, self._shown_times(x))
        if not isinstance(function, str) or function not in _QUANTITIES:
            raise ValidationError(
                f"function must be 'speed', 'acceleration' or a function of times, not {short_repr(function)}"
            )
        quantity = _QUANTITIES[function]
        return lambda x: checked_values(
            self._curve.evaluate(np.ascontiguousarray(x), quantity, "continue", False), self._shown_times(x)
        )

    def _noise(self, function: Any) -> Doubles:
        """Return the rounding errors of a quantity between the times of the curve; zero for functions of the user."""
        if callable(function):
            return np.zeros(len(self._curve.times) - 1)
        return _noise_of(self._curve, 1 if function == "speed" else 2)

    @cached_property
    def _closest(self) -> ClosestPoints:
        return ClosestPoints(self._curve, self.space, self._arc)


def _noise_of(curve: Any, order: int) -> Doubles:
    """Return the size of rounding errors of a derivative of a curve between its times."""
    if isinstance(curve, Retimed):
        # The errors are those of the source, at other times.
        middle = curve.times[:-1] / 2 + curve.times[1:] / 2
        source = _noise_of(curve.source, order)
        at = np.searchsorted(curve.source.times, curve.law(middle), side="right") - 1
        return np.asarray(source[np.clip(at, 0, len(source) - 1)] * np.abs(curve.law(middle, 1)) ** order)
    points = parts_of(curve.evaluate(curve.times, "point", "continue", False), curve.space, "points")
    sizes = [space._rounding(own) for space, own in zip(factors_of(curve.space), points, strict=True)]
    return rounding_noise(np.max(sizes, axis=0), np.diff(curve.times), order)


def _called(function: Callable[[Any], Any], times: NDArray[Any]) -> Doubles:
    return checked_values(function(times), times)


def _check_metric(space: Space[Any]) -> None:
    """Raise ValidationError if distances do not belong to a metric."""
    for factor in factors_of(space):
        if not isinstance(factor, Manifold) and np.isnan(factor.curvature):
            raise ValidationError(
                f"{factor!r} has no invariant metric, so that no point of the curve is nearest. Use a space with a "
                "metric, such as 'so:3 x r:3' for poses."
            )


def _checked(space: Space[Any], value: Any) -> Array:
    """Return points of one factor as an array of numbers, projected onto the space."""
    array = space._array(value, "points")
    doubles = space._doubles(array, "points")
    if isinstance(space, Manifold):
        try:
            space.check_point(array)
        except ValidationError as error:
            raise ValidationError(f"points are invalid: {error}") from None
        return space._numbers(doubles)
    lead = space._lead(doubles)
    space._handle.check_points(space._rows(doubles, lead), lead, space._tol(array), "points")
    return space._apply("project", x=space._numbers(doubles))


def _lead(space: Space[Any], arrays: list[Array]) -> tuple[int, ...]:
    shapes = [x.shape[: x.ndim - len(f.point_shape)] for x, f in zip(arrays, factors_of(space), strict=True)]
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        raise ValidationError(f"the leading axes of points do not broadcast: {shapes}") from None

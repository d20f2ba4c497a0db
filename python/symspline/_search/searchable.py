"""Searches along curves, as methods of the curves."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any, Generic

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import checked_flag
from .._core import ValidationError
from .._curves.arc_length import ArcLength
from .._curves.integrals import Evaluable
from .._spaces import Array, Doubles, Space, factors_of, parts_of
from .._typing import FloatArray, P, Time
from ..manifolds import Manifold
from .closest import ClosestPoints


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
        inner = shape[len(batch) :]
        rows = [
            np.broadcast_to(x, shape + factor.point_shape).reshape(-1, *factor.point_shape)
            for x, factor in zip(targets, factors_of(space), strict=True)
        ]
        curve = np.repeat(np.arange(math.prod(batch)), math.prod(inner))
        with np.errstate(all="ignore"):
            times, distances = self._closest.search(rows, curve)
        return self._shown_times(times.reshape(shape))[()], distances.reshape(shape)[()]

    @cached_property
    def _closest(self) -> ClosestPoints:
        return ClosestPoints(self._curve, self.space, self._arc)


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
    numbers = space._numbers(space._doubles(array, "points"))
    try:
        space.check_point(array)
    except ValidationError as error:
        raise ValidationError(f"points are invalid: {error}") from None
    return numbers if isinstance(space, Manifold) else space._apply("project", x=numbers)


def _lead(space: Space[Any], arrays: list[Array]) -> tuple[int, ...]:
    shapes = [x.shape[: x.ndim - len(f.point_shape)] for x, f in zip(arrays, factors_of(space), strict=True)]
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        raise ValidationError(f"the leading axes of points do not broadcast: {shapes}") from None

"""Reports of smoothing grids."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from .._grid import GridReport
from .._spaces import Doubles, Space
from .axes import SmoothedAxis
from .factors import is_several, smoothed_spaces

# A number for each axis, or for products and poses a tuple with one number per part.
PerAxis = tuple[float | tuple[float, ...], ...]


class SmoothedPart(NamedTuple):
    """Properties of the smoothing in one part of the space.

    Attributes
    ----------
    axes : list of SmoothedAxis
        Properties along every axis.
    variance : ndarray, shape (n_1, ..., n_D)
        Posterior variance at the nodes for noise of variance one.
    df : float
        Effective degrees of freedom of the surface per coordinate.
    sigma : float
        Standard deviation of the noise, given or estimated.
    """

    axes: list[SmoothedAxis]
    variance: Doubles
    df: float
    sigma: float


class SmoothingGridReport(GridReport):
    """Report of a `SmoothingGrid`: that of a `GridSpline`, and properties of the smoothing.

    Properties of the smoothing are tuples with one entry per axis, in the order in which the axes were smoothed. For a
    `Product`, and for poses, each entry is a tuple with one number per factor or part.

    See Also
    --------
    SmoothingGrid.report : The report of a grid.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 30)
    >>> noisy = np.sin(3 * u[:, None] + v) + 0.1 * np.random.default_rng(0).standard_normal((20, 30))
    >>> report = ss.make_smoothing_grid((u, v), noisy[..., None], "r:1").report
    >>> report.converged, report.at_bound, round(report.sigma[0], 1)
    (True, (False, False), 0.1)
    """

    _space: Space[Any]
    _smoothed: list[SmoothedPart]

    @property
    def converged(self) -> bool:
        """Whether the smoothing of all rows converged, and the splines along the first axis."""
        return super().converged and not any(own.failed for part in self._smoothed for own in part.axes)

    @property
    def lam(self) -> PerAxis:
        """Weight λ of the bending energy."""
        return self._per_axis(lambda own, _: own.lam)

    @property
    def at_bound(self) -> PerAxis:
        """Whether the chosen λ is at a bound: rows are geodesics, or pass through nearly all nodes."""
        return self._per_axis(lambda own, _: own.at_bound)

    @property
    def evaluations(self) -> PerAxis:
        """Number of values of λ that were tried; 0 if λ was given."""
        return self._per_axis(lambda own, _: own.evaluations)

    @property
    def df(self) -> PerAxis:
        """Effective degrees of freedom per coordinate, summed over all rows along the axis."""
        return self._per_axis(lambda own, _: own.df)

    @property
    def rss(self) -> PerAxis:
        """Weighted sum of squared distances between the nodes before and after the axis was smoothed."""
        return self._per_axis(lambda own, _: own.rss)

    @property
    def sigma(self) -> PerAxis:
        """Standard deviation of the noise in one coordinate, estimated from the rows along the axis.

        Along the first axis it is that of the data. Along others it is that of nodes that are already smooth along the
        axes before.
        """
        return self._per_axis(lambda own, dim: own.sigma(dim))

    @property
    def iterations(self) -> PerAxis:
        """Largest number of iterations of a row."""
        return self._per_axis(lambda own, _: own.iterations)

    def _per_axis(self, value: Callable[[SmoothedAxis, int], float]) -> PerAxis:
        dims = [space.dim for space in smoothed_spaces(self._space)]
        of_parts = [[value(own, dim) for own in part.axes] for part, dim in zip(self._smoothed, dims, strict=True)]
        each = zip(*of_parts, strict=True)
        return tuple(values if is_several(self._space) else values[0] for values in each)

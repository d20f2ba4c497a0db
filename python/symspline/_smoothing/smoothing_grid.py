"""Smoothing grids, the results of the smoothing of noisy grids."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Generic, Self

import numpy as np

from .._base.typing import FloatArray, P
from .._core import ValidationError
from .._grid import GridSpline
from .._spaces import Array, Doubles, factors_of
from .._splines.archive import Entries, entry, read_array, suffix_of
from .axes import SmoothedAxis
from .factors import is_several, smoothed_spaces
from .grid_report import PerAxis, SmoothedPart, SmoothingGridReport


class SmoothingGrid(GridSpline[P], Generic[P]):
    """A C² surface close to noisy points on a grid.

    `make_smoothing_grid` returns objects of this class; it has no public constructor. All methods of `GridSpline` are
    available. `points` are those of the smooth surface at the nodes. Files keep the data.

    For a `Product`, and for poses, `df`, `sigma` and `std` are tuples with one entry per factor or part.

    See Also
    --------
    make_smoothing_grid : Fit a surface close to noisy points on a grid.
    SmoothingGridReport : Report of the smoothing.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 30)
    >>> noisy = np.sin(3 * u[:, None] + v) + 0.1 * np.random.default_rng(0).standard_normal((20, 30))
    >>> ss.make_smoothing_grid((u, v), noisy[..., None], "r:1")
    <SmoothingGrid on Euclidean(1): 20 x 30 nodes>
    """

    _format = "symspline-smoothing-grid"
    _kind = "Smoothing grid"
    _data: list[Array]
    _weights: Doubles
    _smoothed: list[SmoothedPart]

    def __init__(self) -> None:
        raise TypeError("SmoothingGrid has no public constructor. Use symspline.make_smoothing_grid.")

    @classmethod
    def _through(
        cls,
        axes: Any,
        points: Any,
        space: Any,
        data: list[Array],
        weights: Doubles,
        smoothed: list[SmoothedPart],
        options: dict[str, Any],
    ) -> Self:
        """Return the grid through smooth points."""
        self = cls.__new__(cls)
        self._data, self._weights, self._smoothed = data, weights, smoothed
        GridSpline.__init__(self, axes, points, space, **options)
        return self

    @cached_property
    def report(self) -> SmoothingGridReport:
        """Report of the grid and of the smoothing.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> noisy = np.random.default_rng(0).standard_normal((8, 9, 1))
        >>> ss.make_smoothing_grid((None, None), noisy, "r:1", lam=2.0).report.lam
        (2.0, 2.0)
        """
        report = SmoothingGridReport._of(self._axes, self._factors)
        report._space, report._smoothed = self._space, self._smoothed
        return report

    @property
    def lam(self) -> PerAxis:
        """Weight λ of the bending energy along each axis.

        For products and poses each entry is a tuple with one number per part. `make_smoothing_grid` accepts this value
        as its argument `lam`.
        """
        return self.report.lam

    @property
    def df(self) -> float | tuple[float, ...]:
        """Effective degrees of freedom of the surface per coordinate."""
        df: float | tuple[float, ...] = self._each([part.df for part in self._smoothed])
        return df

    @property
    def sigma(self) -> float | tuple[float, ...]:
        """Standard deviation of the noise of the data in one coordinate, for weight one.

        This is the given value, or else the estimate ``sqrt(sum(weights * distance**2) / (dim * (N - df)))`` with the
        distances of the N data from the surface.
        """
        sigma: float | tuple[float, ...] = self._each([part.sigma for part in self._smoothed])
        return sigma

    @property
    def data(self) -> P:
        """Points that were smoothed, shape (n_1, ..., n_D, *point_shape); NaN where they are missing."""
        data: P = self._joined(self._data)
        return data

    @property
    def residuals(self) -> P:
        """Tangent vectors from the surface to the data at the nodes, shape (n_1, ..., n_D, *point_shape).

        They are logarithms at the surface, and their lengths are the distances. They are NaN at nodes without data.
        """
        found = []
        for factor, data in zip(self._factors, self._data, strict=True):
            used = (self._weights > 0) & factor.space._where_finite(factor.points)
            vectors = np.full(data.shape, np.nan, data.dtype)
            vectors[used] = factor.space._apply("log", p=factor.points[used], q=data[used])
            found.append(vectors)
        residuals: P = self._joined(found)
        return residuals

    def std(self) -> FloatArray | tuple[FloatArray, ...]:
        r"""Compute the standard deviation of the surface at its nodes, in one coordinate of an orthonormal frame.

        Returns
        -------
        ndarray or tuple, shape (n_1, ..., n_D)
            Standard deviations, for products and poses a tuple with one entry per part. NaN where the surface has no
            point.

        See Also
        --------
        SmoothingGrid.sigma : The standard deviation of the noise.

        Notes
        -----
        With equal weights and without missing nodes, the posterior variance of a node is
        :math:`\sigma^2 \prod_k (S_k)_{i_k i_k} / w` with the smoothing matrices :math:`S_k` of the axes. Otherwise it
        follows from the variances along the last axis, whose weights there are those of nodes that are smooth along the
        other axes; correlations between these nodes are not taken into account.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 30)
        >>> noisy = np.sin(3 * u[:, None] + v) + 0.1 * np.random.default_rng(0).standard_normal((20, 30))
        >>> std = ss.make_smoothing_grid((u, v), noisy[..., None], "r:1").std()
        >>> bool(std[10, 15] < std[0, 15] < std[0, 0] < 0.1)
        True
        """
        each = [part.sigma * np.sqrt(part.variance) for part in self._smoothed]
        std: FloatArray | tuple[FloatArray, ...] = self._each(each)
        return std

    def _each(self, values: list[Any]) -> Any:
        return tuple(values) if is_several(self._space) else values[0]

    # ---- files and pickles ----

    def _state(self) -> dict[str, Any]:
        state = super()._state()
        state["noise"] = [
            {"axes": [vars(own) for own in part.axes], "df": part.df, "sigma": part.sigma} for part in self._smoothed
        ]
        state["data_weights"] = self._weights
        state |= {"data" + suffix_of(self._space, i): own for i, own in enumerate(self._data)}
        return state | {f"variance_{i}": part.variance for i, part in enumerate(self._smoothed)}

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        self = super()._from_state(state)
        grid = tuple(len(axis.knots) for axis in self._axes)
        self._data = [
            read_array(state, "data" + suffix_of(self._space, i), own) for i, own in enumerate(factors_of(self._space))
        ]
        for own, factor in zip(self._data, self._factors, strict=True):
            if own.shape != factor.points.shape:
                raise ValidationError(f"entry 'data': the data have shape {own.shape}")
        self._weights = _numbers(state, "data_weights", grid)
        with entry("noise"):
            noise = state["noise"]
            if len(noise) != len(smoothed_spaces(self._space)):
                raise ValidationError("it must have one entry per part of the space")
            self._smoothed = []
            for i, part in enumerate(noise):
                axes = [SmoothedAxis(**own) for own in part["axes"]]
                if len(axes) != len(grid):
                    raise ValidationError(f"there are {len(axes)} axes")
                variance = _numbers(state, f"variance_{i}", grid)
                self._smoothed.append(SmoothedPart(axes, variance, float(part["df"]), float(part["sigma"])))
        return self


def _numbers(state: Entries, name: str, shape: tuple[int, ...]) -> Doubles:
    """Return an array of numbers from a file."""
    array: Doubles = state[name]
    with entry(name):
        if array.dtype != np.float64 or array.shape != shape:
            raise ValidationError(f"it is {array.dtype} of shape {array.shape}, but must have shape {shape}")
    return array

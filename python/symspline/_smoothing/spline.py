"""Smoothing splines, the results of smoothing fits."""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Generic, Self, overload

import numpy as np

from .. import _core
from .._archive import Entries, read_fitted, read_times
from .._arrays import checked_number
from .._core import ValidationError
from .._cubic import CubicSpline
from .._curves.curve import CurveArrays, UncertaintyBand
from .._curves.ends import fixed_velocities, is_closed
from .._options import order_of
from .._spaces import Array, Doubles, Product, Space, factors_of
from .._time import TimeAxis
from .._typing import AnyArray, FloatArray, Number, P, TimesLike
from .data import SmoothingData
from .factors import grouped, is_several, smoothed_spaces
from .report import SmoothingReport
from .solve import Smoothed
from .stored import noise_state, read_noise

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    # The report: one, or on products and for poses one for each part.
    R = TypeVar("R", bound=SmoothingReport | tuple[SmoothingReport, ...], covariant=True, default=SmoothingReport)

    class noise_property:
        """A property with the type of a number for one report, and of a tuple of them for several."""

        def __init__(self, get: Callable[[Any], Number | tuple[Number, ...]]) -> None: ...

        @overload
        def __get__(self, spline: SmoothingSpline[Any, SmoothingReport], owner: Any = None) -> Number: ...

        @overload
        def __get__(
            self, spline: SmoothingSpline[Any, tuple[SmoothingReport, ...]], owner: Any = None
        ) -> tuple[Number, ...]: ...

        def __get__(self, spline: SmoothingSpline[Any, Any], owner: Any = None) -> Any: ...

else:
    from typing import TypeVar

    R = TypeVar("R", covariant=True)
    noise_property = property


_T = TypeVar("_T")


class SmoothingSpline(CubicSpline[P, R], Generic[P, R]):
    """A C² cubic spline close to noisy data.

    `make_smoothing_spline` and `make_lsq_spline` return objects of this class; it has no public constructor. All
    methods of `CubicSpline` are available. `points` are those of the smooth curve at its knots, and `jvp` and `vjp`
    differentiate with respect to them, not to the data. Files keep the data and the bands, and plots show them.

    Properties of the noise are arrays with the batch axes for a batch of curves. For a `Product`, and for poses, they
    are tuples with one entry per factor or part.

    See Also
    --------
    make_smoothing_spline : Fit a curve close to noisy points.
    make_lsq_spline : Fit a curve with given knots by least squares.
    SmoothingReport : Report of a smoothing fit.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> t = np.linspace(0, 1, 50)
    >>> y = np.sin(6 * t) + 0.1 * np.random.default_rng(0).standard_normal(50)
    >>> ss.make_smoothing_spline(t, y[:, None], "r:1")
    <SmoothingSpline on Euclidean(1): 50 data, 50 knots>
    """

    _kind = "Smoothing spline"
    _format = "symspline-smoothing"

    def __init__(self) -> None:
        raise TypeError("SmoothingSpline has no public constructor. Use symspline.make_smoothing_spline.")

    _noisy: SmoothingData
    _smoothed: list[Smoothed]

    def _fill(self, *parts: Any) -> None:
        """Set the state of a `CubicSpline`, the noisy data and the results of the smoothing."""
        *own, self._noisy, self._smoothed = parts
        super()._fill(*own)

    def _each(self, values: list[_T]) -> _T | tuple[_T, ...]:
        """Return one value, or a tuple with one value per space in which data were smoothed."""
        return tuple(values) if is_several(self.space) else values[0]

    def _in_factors(self, values: list[Any]) -> Any:
        """Return one value, or a tuple with one value per factor."""
        return tuple(values) if isinstance(self.space, Product) else values[0]

    @property
    def report(self) -> R:
        """Report of the smoothing fit, a `SmoothingReport` or a tuple of them."""
        reports: Any = self._each([found.report for found in self._smoothed])
        result: R = reports
        return result

    @noise_property
    def lam(self) -> Number | tuple[Number, ...]:
        """Weight λ of the bending energy."""
        return self._each([found.report.lam for found in self._smoothed])

    @noise_property
    def df(self) -> Number | tuple[Number, ...]:
        """Effective degrees of freedom per coordinate.

        They are 2 for a geodesic, and the number of data for interpolation.
        """
        return self._each([found.report.df for found in self._smoothed])

    @noise_property
    def sigma(self) -> Number | tuple[Number, ...]:
        """Standard deviation of the noise in one coordinate, for weight one.

        This is the given value, or else the estimate ``sqrt(sum(weights * distance**2) / (dim * (N - df)))``.
        Coordinates refer to an orthonormal frame.
        """
        return self._each([found.sigma for found in self._smoothed])

    @property
    def data(self) -> tuple[AnyArray, P]:
        """Times and points that were smoothed."""
        return self._noisy.t, self._in_factors(self._noisy.points)

    @property
    def residuals(self) -> P:
        """Tangent vectors from the curve to the data, shape (..., N, *point_shape).

        They are logarithms at the curve, and their lengths are the distances. Data of weight zero have NaN.
        """
        noisy = self._noisy
        at = self._curve.evaluate(noisy.times, "point", "raise", noisy.times.ndim > 1)
        found = []
        gammas = at if isinstance(self.space, Product) else (at,)
        for space, gamma, points, precisions in zip(
            factors_of(self.space), gammas, noisy.points, grouped(self.space, noisy.precisions), strict=True
        ):
            counts = np.any([own.weights > 0 for own in precisions], axis=0)
            used = np.broadcast_to(counts, (*noisy.batch, points.shape[len(noisy.batch)]))
            used = used & space._where_finite(gamma)
            vectors = np.full(points.shape, np.nan, points.dtype)
            vectors[used] = space._apply("log", p=gamma[used], q=points[used])
            found.append(vectors)
        residuals: P = self._in_factors(found)
        return residuals

    @overload
    def std(self: SmoothingSpline[Any, SmoothingReport], x: TimesLike, *, nu: int = 0) -> FloatArray: ...

    @overload
    def std(
        self: SmoothingSpline[Any, tuple[SmoothingReport, ...]], x: TimesLike, *, nu: int = 0
    ) -> tuple[FloatArray, ...]: ...

    def std(self, x: TimesLike, *, nu: int = 0) -> Any:
        r"""Compute the standard deviation of the curve in one coordinate of an orthonormal frame.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape. Beyond the knots, the standard deviation is that of a curve that continues with
            constant velocity, or periodically if it is closed.
        nu : {0, 1}, default 0
            0 for the point, 1 for the velocity.

        Returns
        -------
        ndarray, float or tuple, shape ``(*batch axes, *x.shape)``
            Standard deviations, for products and poses a tuple with one entry per part.

        Raises
        ------
        ValidationError
            If a time is not finite, or `nu` is invalid.

        See Also
        --------
        SmoothingSpline.band : Compute the radius of a credible ball.

        Notes
        -----
        The variance at time t is :math:`\sigma^2 b(t)^T A^{-1} b(t)`, the posterior variance of a spline in frames
        along the curve. b(t) are the values of the B-splines, and A is the matrix of the linearised problem. If the
        knots are the times of the data, as they are by default, the variance of the curve between the knots is added,
        as the smoothness determines it. A spline with knots of your own has no such freedom.

        References
        ----------
        G. Wahba, Bayesian "confidence intervals" for the cross-validated smoothing spline, J. R. Stat. Soc. B 45
        (1983).

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> t = np.linspace(0, 1, 50)
        >>> y = np.sin(6 * t) + 0.1 * np.random.default_rng(0).standard_normal(50)
        >>> s = ss.make_smoothing_spline(t, y[:, None], "r:1")
        >>> bool(0.02 < s.std(0.5) < s.std(0.0) < 0.1)
        True
        """
        nu = order_of(nu, 1)
        times, per_curve = self._time_axis.at(x, self._batch, False)
        if not np.isfinite(times).all():
            raise ValidationError("x must be finite")
        batch = self._batch
        own = times.shape[len(batch) :] if per_curve else times.shape
        found = []
        for part in self._smoothed:
            out = np.empty((*batch, *own))
            for index in np.ndindex(batch):
                at = times[index] if per_curve else times
                out[index] = self._spread(part, index, np.ravel(at), nu).reshape(own)
            found.append(out[()])
        return self._each(found)

    def _spread(self, part: Smoothed, index: tuple[int, ...], x: Doubles, nu: int) -> Doubles:
        """Return the standard deviation of one curve in one part at times x of the core."""
        knots = self._times[index] if self._times.ndim > 1 else self._times
        lam, sigma = (np.asarray(value)[index].item() for value in (part.band_lam, part.sigma))
        if not part.between:
            # With λ = 0 the curve has no variance between the knots besides that of the spline.
            lam = 0.0
        knots, band, x = (np.ascontiguousarray(own) for own in (knots, part.band[index], x))
        variance = _core.smoothing_variance(knots, band, lam, x, nu, fixed_velocities(self._bc_type))
        return np.asarray(sigma * np.sqrt(variance))

    @overload
    def band(self: SmoothingSpline[Any, SmoothingReport], x: TimesLike, level: float = 0.95) -> FloatArray: ...

    @overload
    def band(
        self: SmoothingSpline[Any, tuple[SmoothingReport, ...]], x: TimesLike, level: float = 0.95
    ) -> tuple[FloatArray, ...]: ...

    def band(self, x: TimesLike, level: float = 0.95) -> Any:
        """Compute the radius of the ball that contains the true point with a given probability.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape.
        level : float, default 0.95
            Probability between 0 and 1.

        Returns
        -------
        ndarray, float or tuple, shape ``(*batch axes, *x.shape)``
            Distances in the space, for products and poses a tuple with one entry per part.

        Raises
        ------
        ValidationError
            If a time is not finite, or `level` is not between 0 and 1.

        See Also
        --------
        SmoothingSpline.std : Compute the standard deviation of the curve.

        Notes
        -----
        `level` is the coverage on average over all times. The coverage is lower in long gaps, and at end points with
        natural conditions if the true curve has an acceleration there. The band is not valid if λ is at its bound
        (``report.at_bound``).

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> t = np.linspace(0, 1, 50)
        >>> y = np.sin(6 * t) + 0.1 * np.random.default_rng(0).standard_normal(50)
        >>> s = ss.make_smoothing_spline(t, y[:, None], "r:1")
        >>> (s.band(0.5) / s.std(0.5)).round(2)
        np.float64(1.96)
        """
        level = checked_number(level, "level must lie between 0 and 1", lambda x: 0 < x < 1)
        whole: SmoothingSpline[Any, Any] = self
        spreads = whole.std(x)
        each = spreads if is_several(self.space) else (spreads,)
        return self._each(
            [_radius(part, level) * spread for part, spread in zip(smoothed_spaces(self.space), each, strict=True)]
        )

    # ---- plots ----

    @property
    def _made_of(self) -> str:
        count = int(np.max(np.sum(self._noisy.used, axis=-1)))
        df = _ranges([part.report.df for part in self._smoothed], 3)
        sigma = _ranges([part.sigma for part in self._smoothed], 2)
        each = " each" if self._batch else ""
        return f"{count} data{each}, {df} degrees of freedom, noise {sigma}"

    def _noise_beside(self, index: tuple[int, ...], x: Doubles) -> UncertaintyBand:
        noisy = self._noisy.map(itemgetter(index), ())
        # The parts of a pose have different units; plots show the band of the position.
        radii = [
            _radius(own[-1][0], 0.95) * self._spread(own[-1][1], index, x, 0)
            for own in grouped(self.space, zip(smoothed_spaces(self.space), self._smoothed, strict=True))
        ]
        several = is_several(self.space)
        speed = None if several else self._spread(self._smoothed[0], index, x, 1)
        return UncertaintyBand(noisy.times[noisy.used], [own[noisy.used] for own in noisy.points], radii, speed)

    @property
    def _unconverged(self) -> int:
        return int(np.sum(~np.all([np.asarray(found.report.converged) for found in self._smoothed], axis=0)))

    def _with(self, time_axis: TimeAxis, t: Array, curve: CurveArrays, index: Any) -> Any:
        part = super()._with(time_axis, t, curve, index)
        pick = itemgetter(index)
        noisy = self._noisy.map(pick, curve.batch)._replace(time_axis=time_axis)
        return self._like(part, noisy, [found.map(pick) for found in self._smoothed])

    @property
    def _parts(self) -> tuple[SmoothingSpline[Any, Any], ...]:
        """Splines in the factors of a product."""
        noisy = self._noisy
        precisions = grouped(self.space, noisy.precisions)
        found = grouped(self.space, self._smoothed)
        return tuple(
            self._like(part, noisy._replace(points=[points], precisions=own), noise)
            for part, points, own, noise in zip(super()._parts, noisy.points, precisions, found, strict=True)
        )

    @classmethod
    def _like(cls, spline: CubicSpline[Any, Any], noisy: SmoothingData, smoothed: list[Smoothed]) -> Self:
        """Return a smoothing spline from a spline through the smooth points and the properties of the noise."""
        parts = (spline._time_axis, spline._t, spline._curve, spline._bc_type, spline._extrapolate, spline._reports)
        return cls._of(*parts, noisy, smoothed)

    def _state(self) -> dict[str, Any]:
        return super()._state() | noise_state(self.space, self._noisy, self._smoothed)

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        time_axis, t = read_times(state, "data_t")
        parts = read_fitted(state, time_axis)
        _, _, curve, bc_type, *_ = parts
        return cls._of(*parts, *read_noise(state, time_axis, t, curve, is_closed(bc_type)))

    def __repr__(self) -> str:
        data, knots = self._noisy.times.shape[-1], self._times.shape[-1]
        return f"<SmoothingSpline on {self.space!r}: {self._batch_text}{data} data, {knots} knots>"


def _radius(space: Space, level: float) -> float:
    """Return the radius of the ball that contains a normal vector with this probability, in standard deviations."""
    return float(np.sqrt(_core.chi_squared(space.dim, level)))


def _ranges(factors: list[Any], digits: int) -> str:
    """Return the range of a number for every factor, or one range for all if there are more than three factors."""
    few = factors if len(factors) <= 3 else [np.concatenate([np.ravel(values) for values in factors])]
    return " and ".join(_range(np.ravel(values), digits) for values in few)


def _range(values: Doubles, digits: int) -> str:
    good = values[np.isfinite(values)]
    ends = (good.min(), good.max()) if good.size else ()
    # dict.fromkeys drops the second of two equal texts.
    return " to ".join(dict.fromkeys(f"{value:.{digits}g}" for value in ends)) or "unknown"

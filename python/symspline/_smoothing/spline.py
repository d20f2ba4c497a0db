"""Smoothing splines, the results of smoothing fits, and their state in files."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Concatenate, Generic, ParamSpec, Self, overload

import numpy as np

from .. import _core
from .._base.arrays import checked_flag, checked_number, one_of, short_repr, whole_number
from .._base.time import TimeAxis
from .._base.typing import AnyArrays, Array, CovarianceOrder, FloatArray, Number, P, TimesLike
from .._core import ValidationError
from .._curves.curve import CurveArrays, SidePanel, UncertaintyBand
from .._curves.ends import end_kinds, is_closed
from .._curves.options import order_of
from .._spaces import AnySpace, Doubles, Product, Space, SpecialOrthogonal, Sphere, factors_of, short_name
from .._splines.archive import (
    Entries,
    Stored,
    entry,
    read_array,
    read_field,
    read_fitted,
    read_report,
    read_times,
    suffix_of,
    times_state,
)
from .._splines.cubic import CubicSpline
from .gaps import Calibration, Gap, calibration_of, warn_of_cubics, warn_of_gaps, warn_of_wide_bands, widest_band
from .noise import Noise, SmoothingData, grouped, is_several, join, parts_of_factor, smoothed_spaces, split
from .report import Index, Parameter, Posterior, SmoothingReport, fields_of, frames_at, process_ratio
from .solve import Smoothed

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    # The report: one, or on products and for poses one for each part.
    R = TypeVar("R", bound=SmoothingReport | tuple[SmoothingReport, ...], covariant=True, default=SmoothingReport)

    class noise_property:
        """A property with the type of a number for one report, and of a tuple of them for several."""

        def __init__(self, get: Callable[[Any], Number | tuple[Number, ...]]) -> None: ...

        @overload
        def __get__(self, spline: SmoothingSpline[Any, SmoothingReport], owner: object = None) -> Number: ...

        @overload
        def __get__(
            self, spline: SmoothingSpline[Any, tuple[SmoothingReport, ...]], owner: object = None
        ) -> tuple[Number, ...]: ...

        def __get__(self, spline: AnySmoothingSpline, owner: object = None) -> Any: ...

    Q = ParamSpec("Q")

    class noise_method(Generic[Q]):
        """A method that returns an array for one report, and a tuple of them for several."""

        def __init__(self, method: Callable[Concatenate[Any, Q], Any]) -> None: ...

        @overload
        def __get__(
            self, spline: SmoothingSpline[Any, SmoothingReport], owner: object = None
        ) -> Callable[Q, FloatArray]: ...

        @overload
        def __get__(
            self, spline: SmoothingSpline[Any, tuple[SmoothingReport, ...]], owner: object = None
        ) -> Callable[Q, tuple[FloatArray, ...]]: ...

        def __get__(self, spline: AnySmoothingSpline, owner: object = None) -> Callable[Q, Any]: ...

else:
    from typing import TypeVar

    R = TypeVar("R", covariant=True)
    noise_property = property

    def noise_method(method):
        return method


_T = TypeVar("_T")
# The largest number of factors whose numbers are all in the title of a plot.
_OWN_RANGES = 3
# Rotations, whose distances are angles.
_TURNING = (SpecialOrthogonal(2), SpecialOrthogonal(3))


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
    <SmoothingSpline on Euclidean(1): 50 data, 50 knots, from 0 to 1>
    """

    _kind = "Smoothing spline"
    _format = "symspline-smoothing"

    def __init__(self) -> None:
        raise TypeError("SmoothingSpline has no public constructor. Use symspline.make_smoothing_spline.")

    _noisy: SmoothingData
    _smoothed: list[Smoothed]
    _warned_of: frozenset[str] = frozenset()

    def _per_space(self, values: list[_T]) -> _T | tuple[_T, ...]:
        """Return one value, or a tuple with one value per space in which data were smoothed."""
        return tuple(values) if is_several(self.space) else values[0]

    def _in_factors(self, values: list[Array]) -> Any:
        """Return one value, or a tuple with one value per factor."""
        return tuple(values) if isinstance(self.space, Product) else values[0]

    @property
    def report(self) -> R:
        """Report of the smoothing fit, a `SmoothingReport` or a tuple of them."""
        reports: Any = self._per_space([part.report for part in self._smoothed])
        result: R = reports
        return result

    @noise_property
    def lam(self) -> Number | tuple[Number, ...]:
        """Weight λ of the bending energy."""
        return self._per_space([part.report.lam for part in self._smoothed])

    @noise_property
    def df(self) -> Number | tuple[Number, ...]:
        """Effective degrees of freedom per coordinate.

        They are 2 for a geodesic, and the number of data for interpolation.
        """
        return self._per_space([part.report.df for part in self._smoothed])

    @noise_property
    def sigma(self) -> Number | tuple[Number, ...]:
        """Standard deviation of the noise in one coordinate, for weight one.

        This is the given value, or else the estimate ``sqrt(sum(weights * distance**2) / (dim * (N - df)))``.
        Coordinates refer to an orthonormal frame.
        """
        return self._per_space([part.sigma for part in self._smoothed])

    @noise_method
    def lam_at(self, x: TimesLike) -> FloatArray | tuple[FloatArray, ...]:
        """Return the weight λ of the bending energy at some times.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape. Beyond the knots, λ is that of the first or the last segment, or repeats if the curve
            is closed.

        Returns
        -------
        ndarray, float or tuple, shape ``(*batch axes, *x.shape)``
            Weights of the segments at these times, for products and poses a tuple with one entry per part. `lam` is
            their geometric mean.

        Raises
        ------
        ValidationError
            If a time is not finite.

        See Also
        --------
        SmoothingSpline.sigma_at : Return the standard deviation of the noise at some times.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> t = np.linspace(0, 60, 600)
        >>> y = np.exp(-((t - 30) ** 2) / 4) * np.sin(6 * t) + 0.05 * np.random.default_rng(0).standard_normal(600)
        >>> s = ss.make_smoothing_spline(t, y[:, None], "r:1", lam="adaptive")
        >>> bool(s.lam_at(10.0) > 100 * s.lam_at(30.0)), bool(s.report.gain > 6)
        (True, True)
        """
        return self._in_parts_at(x, self._lam_at)

    def _lam_at(self, number: int, index: Index, x: Doubles) -> Doubles:
        """Return λ of one curve in one part at times x of the core."""
        part, knots = self._smoothed[number], self._knots_of(index)
        lam = np.full(x.shape, np.asarray(part.report.lam)[index])
        profile = part.profile_of(index)
        if profile is not None:
            lam *= profile[np.searchsorted(knots[1:-1], self._turned(knots, x), "right")]
        return lam

    @noise_method
    def sigma_at(self, x: TimesLike) -> FloatArray | tuple[FloatArray, ...]:
        """Return the standard deviation of the noise in one coordinate at some times.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape. Beyond the knots, it is that at the first or the last knot, or repeats if the curve is
            closed.

        Returns
        -------
        ndarray, float or tuple, shape ``(*batch axes, *x.shape)``
            Standard deviations for the weight one that was passed to `make_smoothing_spline`, for products and poses a
            tuple with one entry per part. `sigma` is the geometric mean over the data.

        Raises
        ------
        ValidationError
            If a time is not finite.

        See Also
        --------
        SmoothingSpline.lam_at : Return the weight of the bending energy at some times.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> t = np.linspace(0, 60, 600)
        >>> noise = np.where((t > 20) & (t < 40), 0.2, 0.04) * np.random.default_rng(0).standard_normal(600)
        >>> s = ss.make_smoothing_spline(t, (np.sin(t) + noise)[:, None], "r:1", noise="adaptive")
        >>> s.sigma_at([5.0, 35.0]).round(2)
        array([0.04, 0.21])
        """
        return self._in_parts_at(x, self._sigma_at)

    def _sigma_at(self, number: int, index: Index, x: Doubles) -> Doubles:
        """Return the standard deviation of the noise of one curve in one part at times x of the core."""
        part, knots = self._smoothed[number], self._knots_of(index)
        sigma = np.full(x.shape, np.asarray(part.sigma)[index])
        if part.noise_profile is not None:
            sigma *= np.exp(0.5 * np.interp(self._turned(knots, x), knots, part.noise_profile[index]))
        return sigma

    def _turned(self, knots: Doubles, x: Doubles) -> Doubles:
        """Return times of a closed curve within its period."""
        return knots[0] + np.mod(x - knots[0], knots[-1] - knots[0]) if is_closed(self._bc_type) else x

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Unknown constants that `estimate` found, by name, each with ``value``, ``std`` and ``cov``."""
        return {}

    @property
    def data(self) -> tuple[Array, P]:
        """Times and points that were smoothed."""
        return self._noisy.t, self._in_factors(self._noisy.points)

    @property
    def residuals(self) -> P:
        """Tangent vectors from the curve to the data, shape (..., N, *point_shape).

        They are logarithms at the curve, and their lengths are the distances. Data of weight zero have NaN.
        """
        noisy = self._noisy
        at = self._curve.evaluate(noisy.times, "point", "raise", noisy.times.ndim > 1)
        residuals_of_factors = []
        gammas = at if isinstance(self.space, Product) else (at,)
        for space, gamma, points, noise in zip(
            factors_of(self.space), gammas, noisy.points, grouped(self.space, noisy.noise), strict=True
        ):
            counts = np.any([noise_of_part.weights > 0 for noise_of_part in noise], axis=0)
            used = np.broadcast_to(counts, (*noisy.batch, points.shape[len(noisy.batch)]))
            used = used & space._where_finite(gamma)
            vectors = np.full(points.shape, np.nan, points.dtype)
            vectors[used] = space._apply("log", p=gamma[used], q=points[used])
            residuals_of_factors.append(vectors)
        residuals: P = self._in_factors(residuals_of_factors)
        return residuals

    @property
    def gaps(self) -> list[Gap] | tuple[list[Gap], ...] | Array | tuple[Array, ...]:
        """Long gaps in the data, and the times before and after the data, with the factors of the bands there.

        The result is a list of `Gap` in the order of time. For open curves, the first and the last entry are the times
        before and after the data; curves of `estimate` have only gaps in which no sensor measures. Products and poses
        have a tuple with one list per part. A batch has an array of lists with the batch axes. The list is empty if the
        curve has no estimate of its error, as with ``lam=0`` or ``lam=numpy.inf``.

        See Also
        --------
        SmoothingSpline.std : Compute the standard deviation of the curve. Its notes define the factors.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> t = np.linspace(0, 60, 600)
        >>> t = t[(t < 25) | (t > 30)]
        >>> y = np.sin(t) + 0.02 * np.random.default_rng(0).standard_normal(t.size)
        >>> s = ss.make_smoothing_spline(t, y[:, None], "r:1")
        >>> before, gap, after = s.gaps
        >>> round(gap.start), round(gap.stop), gap.factor > 2, float(after.stop)
        (25, 30, True, inf)
        """
        gaps_of_parts = []
        for number in range(len(self._smoothed)):
            gaps_of_curves = np.empty(self._batch, object)
            for index in np.ndindex(self._batch):
                gaps_of_curves[index] = self._gaps_of(number, index)
            gaps_of_parts.append(gaps_of_curves[()])
        return self._per_space(gaps_of_parts)

    def _gaps_of(self, number: int, index: Index) -> list[Gap]:
        known = self._calibrations[number, index]
        if known is None:
            return []
        before, after = known.ends[:1], known.ends[1:]
        axis = self._time_axis
        for place in index:
            axis = axis.take_batch(place)
        every = [*before, *known.gaps, *after]
        ends = np.array([gap[:2] for gap in every]).reshape(-1, 2)
        # Dates have no infinite times.
        times = axis.shown(np.where(np.isinf(ends), np.nan, ends), ())
        if not axis.dates:
            times = np.where(np.isinf(ends), ends, times)
        return [Gap(start, stop, *gap[2:]) for (start, stop), gap in zip(times, every, strict=True)]

    @cached_property
    def _calibrations(self) -> dict[tuple[int, tuple[int, ...]], Calibration | None]:
        """Calibrations of the variances in gaps, by part and index of the curve."""
        calibrations = {}
        for index in np.ndindex(self._batch):
            one: AnySmoothingSpline = self
            for place in index:
                one = one[place]
            calibrations.update({(number, index): one._calibration_of(number) for number in range(len(self._smoothed))})
        return calibrations

    def _calibration_of(self, number: int) -> Calibration | None:
        return calibration_of(self, number)

    def _inflation(self, number: int, index: Index, x: Doubles, nu: int) -> Doubles:
        """Return the factors of the standard deviation of one curve in one part, at times x of the core."""
        knots = self._knots_of(index)
        if self._extrapolate is True and not is_closed(self._bc_type) and np.any((x < knots[0]) | (x > knots[-1])):
            self._warn_once("cubics", warn_of_cubics)
        known = self._calibrations[number, index]
        if known is None:
            return np.ones(x.shape)
        out = known.inflation(x, nu)
        if np.any(out != 1):
            self._warn_once("gaps", lambda: warn_of_gaps(self.space, self._gaps_of, self._calibrations))
        return out

    def _warn_once(self, subject: str, warn: Callable[[], None]) -> None:
        """Warn of a subject, unless this curve has done so before."""
        if subject not in self._warned_of:
            self._warned_of |= {subject}
            warn()

    @noise_method
    def std(self, x: TimesLike, *, nu: int = 0, calibrated: bool = True) -> FloatArray | tuple[FloatArray, ...]:
        r"""Compute the standard deviation of the curve in one coordinate of an orthonormal frame.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape. Beyond the data, the standard deviation is that of a curve that continues with
            constant velocity, or periodically if it is closed. A curve with ``extrapolate=True`` continues its cubics
            instead; this issues a `SmoothingWarning`.
        nu : {0, 1}, default 0
            0 for the point, 1 for the velocity.
        calibrated : bool, default True
            Whether standard deviations in long gaps and beyond the data are calibrated with the factors of
            `SmoothingSpline.gaps`. False returns those of the posterior; see the notes.

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
        as the smoothness determines it. A spline with knots of your own has no such freedom. The random curve is
        an integrated Wiener process, whose second or third derivative is white noise; for the jerk, the variance is
        that of the process at all times. If weights are matrices or curvature couples the coordinates, the variance of
        the spline is multiplied by the ratio that the two variances have for uncoupled coordinates.

        In long gaps, the posterior standard deviation is too small, because the true motion is rarely a sample of this
        process. It is calibrated as follows. Let v be the posterior variance, and :math:`v_0` its median at the data.
        Up to 24 parts of the recording, as long as the gap, are predicted without their data. The variance becomes
        :math:`v + (k^2 - 1)(v - v_0)`, where the factor k ≥ 1 is chosen such that the errors of these predictions agree
        with their variances. A gap is long if v exceeds :math:`4 v_0` in its middle and its length exceeds three median
        time steps and two widths of the smoother. This width is :math:`(\lambda / \rho)^{1/4}`, with the weight ρ of
        the data per unit of time, or :math:`(\lambda / \rho)^{1/6}` for the jerk. The calibration extends up to two
        widths beyond both ends of the gap. Velocities have the same k.

        Beyond the data, at the distance d from the end, the variance :math:`\sigma^2 d^3 / (3 \lambda)` of the process
        is added. The factor k follows from predictions beyond the end of parts of the recording, and is at most 20. For
        ``penalty="jerk"`` the process adds :math:`\sigma^2 d^5 / (20 \lambda) + a^2 d^4 / 4`, with the mean square a²
        of the acceleration. Since k is an average over the recording, it does not account for a burst of motion that
        falls into a gap.

        The factors are computed at the first call. If no part of the recording is as long as a gap, the gap has the
        largest factor of shorter parts, and a `SmoothingWarning` names it. If there is no such part, the result in the
        gap is NaN.

        References
        ----------
        S. N. Wood, On neighbourhood cross validation, arXiv 2404.16490 (2024).

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
        nu, calibrated = order_of(nu, 1), checked_flag(calibrated, "calibrated")
        return self._in_parts_at(x, partial(self._spread, nu=nu, calibrated=calibrated))

    def _in_parts_at(self, x: TimesLike, value: Callable[..., Doubles]) -> FloatArray | tuple[FloatArray, ...]:
        """Return the values of a function of a part, the index of a curve and times, for every part and curve."""
        times, _, per_curve = self._finite_times(x)
        parts = [partial(value, number) for number in range(len(self._smoothed))]
        return self._per_space([self._per_curve(times, per_curve, of_part)[()] for of_part in parts])

    def _per_curve(
        self,
        times: Doubles,
        per_curve: bool,
        value: Callable[..., Array],
        tail: tuple[int, ...] = (),
        dtype: np.dtype[np.float64] | np.dtype[np.complex128] | None = None,
    ) -> Array:
        """Return the values of a function of the index of each curve and of times of the core, with the shape of times.

        Parameters
        ----------
        per_curve : bool
            Whether every curve has its own times.
        tail : tuple of int
            Shape of one value.
        """
        shape = times.shape[len(self._batch) :] if per_curve else times.shape
        out = np.empty((*self._batch, *shape, *tail), dtype)
        for index in np.ndindex(self._batch):
            out[index] = value(index, np.ravel(times[index] if per_curve else times)).reshape((*shape, *tail))
        return out

    def _spread(self, number: int, index: Index, x: Doubles, nu: int, calibrated: bool = True) -> Doubles:
        """Return the standard deviation of one curve in one part at times x of the core."""
        plain = self._plain_spread(number, index, x, nu)
        if not calibrated:
            return plain
        spread = plain * self._inflation(number, index, x, nu)
        wide = widest_band(smoothed_spaces(self.space)[number], spread) if nu == 0 else 0.0
        if wide > 0.5:
            self._warn_once("wide bands", lambda: warn_of_wide_bands(self, number, index, wide))
        return spread

    def _plain_spread(self, number: int, index: Index, x: Doubles, nu: int) -> Doubles:
        """Return the standard deviation of the posterior, without calibration."""
        part, knots = self._smoothed[number], self._knots_of(index)
        sigma = np.asarray(part.sigma)[index]
        # With λ = 0 the curve has no variance between the knots besides that of the spline.
        is_jerk = part.penalty == "jerk"
        lam = np.atleast_1d(np.asarray(part.band_lam)[index]) if part.between and not is_jerk else np.zeros(1)
        band, x = np.ascontiguousarray(part.band[index]), np.ascontiguousarray(x)
        profile = part.profile_of(index)
        variance = _core.smoothing_variance(knots, band, lam, profile, x, nu, end_kinds(self._bc_type))
        if part.between and is_jerk:
            variance = variance * self._ratio(number, index, x, nu)
        return np.asarray(sigma * np.sqrt(variance))

    def _ratio(self, number: int, index: Index, x: Doubles, nu: int) -> Doubles:
        """Return the variance of the process that the jerk penalises, relative to that of the spline."""
        part = self._smoothed[number]
        weights, times = self._noisy.noise[number].weights, self._noisy.times
        times, weights = (values[index] if values.ndim > 1 else values for values in (times, weights))
        coupled = part.posterior is not None and part.posterior.size > 1
        band = None if coupled else part.band[index]
        lam = np.asarray(part.band_lam)[index].item()
        knots, kinds = self._knots_of(index), end_kinds(self._bc_type)
        return process_ratio(times, weights, knots, band, lam, part.profile_of(index), kinds, x, nu)

    @noise_method
    def band(
        self, x: TimesLike, level: float = 0.95, *, calibrated: bool = True
    ) -> FloatArray | tuple[FloatArray, ...]:
        """Compute the radius of the ball that contains the true point with a given probability.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape.
        level : float, default 0.95
            Probability between 0 and 1.
        calibrated : bool, default True
            Whether bands in long gaps and beyond the data are calibrated, as for `std`.

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
        `level` is the coverage on average over all times. The coverage is lower at end points with natural conditions
        if the true curve has an acceleration there. The band is not valid if λ is at its bound (``report.at_bound``).
        In long gaps and beyond the data, its width is calibrated by predictions of other parts of the recording; see
        the notes of `std`.

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
        whole: AnySmoothingSpline = self
        spreads = whole.std(x, calibrated=calibrated)
        of_parts = spreads if is_several(self.space) else (spreads,)
        return self._per_space(
            [radius(part, level) * spread for part, spread in zip(smoothed_spaces(self.space), of_parts, strict=True)]
        )

    @noise_method
    def cov(
        self, x: TimesLike, y: TimesLike | None = None, *, nu: CovarianceOrder = 0, calibrated: bool = True
    ) -> FloatArray | tuple[FloatArray, ...]:
        r"""Compute the covariance of the curve in the frames along it.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape.
        y : array_like of float or datetime64, optional
            Other times of the same shape. By default, the covariance at each time of x is returned.
        nu : {0, 1, "joint"}, default 0
            0 for the point, 1 for the velocity, ``"joint"`` for both, point first. With `y` it must be 0.
        calibrated : bool, default True
            Whether standard deviations in long gaps and beyond the data are calibrated, as for `std`. Correlations do
            not change.

        Returns
        -------
        ndarray or tuple, shape ``(*batch axes, *x.shape, m, m)``
            Covariance of the coordinates in ``frames(x)``, with m = ``space.dim`` or twice that for ``"joint"``; for
            products and poses a tuple with one entry per part. With `y`, rows belong to x and columns to y.

        Raises
        ------
        ValidationError
            If a time is not finite, `nu` is invalid, or the curve comes from a file of an older version.

        See Also
        --------
        SmoothingSpline.frames : Compute the frames to which covariances refer.
        SmoothingSpline.std : Compute the standard deviation of the curve.
        SmoothingSpline.sample : Draw curves from the posterior.

        Notes
        -----
        The covariance is :math:`\sigma^2 b(t)^T A^{-1} b(t)` for the B-splines b and the matrix A of the linearised
        problem, which couples the coordinates if weights are matrices or the space is strongly curved. `std` adds
        the variance between the knots as described there, and so do the covariances of one time for ``nu`` 0 and 1.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> t = np.linspace(0, 1, 50)
        >>> y = np.sin(6 * t) + 0.1 * np.random.default_rng(0).standard_normal(50)
        >>> s = ss.make_smoothing_spline(t, y[:, None], "r:1")
        >>> bool(np.isclose(s.cov(0.5)[0, 0], s.std(0.5) ** 2)), s.cov(0.5, nu="joint").shape
        (True, (2, 2))
        """
        joint = isinstance(nu, str)
        if joint and nu != "joint":
            raise ValidationError(f"nu must be 0, 1 or 'joint', not {short_repr(nu)}")
        orders = [0, 1] if joint else [order_of(nu, 1)]
        if y is not None and orders != [0]:
            raise ValidationError("nu must be 0 for the covariance of two times")
        calibrated = checked_flag(calibrated, "calibrated")
        x, shape, per_curve = self._finite_times(x)
        other = None
        if y is not None:
            other, other_shape, _ = self._finite_times(y)
            if other_shape != shape:
                raise ValidationError(f"y has shape {other_shape}, but x has shape {shape}")

        def covariance(number: int, index: Index, at: Doubles) -> Doubles:
            to = None if other is None else np.ravel(other[index] if per_curve else other)
            posterior = self._covariance(number, index, at, to, orders, to is None and len(orders) == 1)
            return self._inflated([number], index, at, to, orders, posterior) if calibrated else posterior

        tails = [2 * (len(orders) * space.dim,) for space in smoothed_spaces(self.space)]
        covariances = [self._per_curve(x, per_curve, partial(covariance, i), tail) for i, tail in enumerate(tails)]
        return self._per_space(covariances)

    def _covariance(
        self, number: int, index: Index, x: Doubles, y: Doubles | None, orders: list[int], between: bool
    ) -> Doubles:
        """Return the covariance of one part; `between` adds variances of points and velocities between the knots."""
        part, space, kinds = self._smoothed[number], smoothed_spaces(self.space)[number], end_kinds(self._bc_type)
        whole = self._posterior(part).covariance(space, self._knots_of(index), index, kinds, x, y, orders)
        if between and part.between:
            shape = len(orders), space.dim
            self._add_between(number, index, x, orders, whole.reshape(len(x), *shape, *shape))
        return np.asarray(np.asarray(part.sigma)[index].item() ** 2 * whole)

    def _inflated(
        self, parts: list[int], index: Index, x: Doubles, y: Doubles | None, orders: list[int], covariance: Doubles
    ) -> Doubles:
        """Multiply covariances by the calibration factors of both times; accelerations have those of velocities."""
        spaces = smoothed_spaces(self.space)

        def factors(at: Doubles) -> Doubles:
            of_coordinates = [
                np.repeat(self._inflation(number, index, at, min(nu, 1))[:, None], spaces[number].dim, axis=1)
                for nu in orders
                for number in parts
            ]
            return np.concatenate(of_coordinates, axis=1)

        left = factors(x)
        right = left if y is None else factors(y)
        return np.asarray(left[:, :, None] * covariance * right[:, None])

    def _add_between(self, number: int, index: Index, x: Doubles, orders: list[int], covariance: Doubles) -> None:
        """Add the variance between the knots to covariances of points and velocities, for noise of variance one.

        The shape of `covariance` is ``(len(x), len(orders), m, len(orders), m)``.
        """
        part, knots, kinds = self._smoothed[number], self._knots_of(index), end_kinds(self._bc_type)
        lam = np.atleast_1d(np.asarray(part.band_lam)[index])
        band = np.ascontiguousarray(part.band[index])
        for i, nu in enumerate(orders):
            if nu > 1:
                continue
            if part.penalty == "jerk":
                root = np.sqrt(self._ratio(number, index, x, nu))[:, None, None, None]
                covariance[:, i] *= root
                covariance[:, :, :, i] *= root
                continue
            profile = part.profile_of(index)
            process, plain = (
                _core.smoothing_variance(knots, band, w, profile, x, nu, kinds) for w in (lam, np.zeros(1))
            )
            covariance[:, i, :, i] += (process - plain)[:, None, None] * np.eye(covariance.shape[-1])

    def _coupled(self, parts: list[int], index: Index, x: Doubles, orders: list[int]) -> Doubles:
        """Return the covariance of derivatives in several parts at times x, for the propagation of errors.

        The parts of a smoothing spline are independent. Points and velocities include their variances between the
        knots, but not the covariance of the two. Accelerations are those of the spline alone, because the acceleration
        of the random curve between the knots has no finite variance.

        Returns
        -------
        ndarray, shape (n, d, d)
            Covariances, with d = ``len(orders)`` times the sum of the dimensions. The order is the first index, the
            part the second.
        """
        spaces = smoothed_spaces(self.space)
        ends = np.cumsum([0, *(spaces[number].dim for number in parts)])
        count, size = len(orders), int(ends[-1])
        whole = np.zeros((len(x), count, size, count, size))
        for number, start, end in zip(parts, ends[:-1], ends[1:], strict=True):
            shape = len(x), count, int(end - start), count, int(end - start)
            of_part = self._covariance(number, index, x, None, orders, True)
            whole[:, :, start:end, :, start:end] = of_part.reshape(shape)
        return self._inflated(parts, index, x, None, orders, whole.reshape(len(x), count * size, count * size))

    def _posterior(self, part: Smoothed) -> Posterior:
        if part.posterior is None:
            raise ValidationError(
                "this curve comes from a file of an older version, which has no covariances. Fit it again."
            )
        return part.posterior

    def _knots_of(self, index: Index) -> Doubles:
        return np.ascontiguousarray(self._times[index] if self._times.ndim > 1 else self._times)

    def _finite_times(self, x: TimesLike) -> tuple[Doubles, tuple[int, ...], bool]:
        """Return times of the core, their shape for one curve, and whether every curve has its own."""
        times, per_curve = self._time_axis.at(x, self._batch, False)
        if not np.isfinite(times).all():
            raise ValidationError("x must be finite")
        return times, times.shape[len(self._batch) :] if per_curve else times.shape, per_curve

    @overload
    def frames(self: SmoothingSpline[P, SmoothingReport], x: TimesLike) -> P: ...

    @overload
    def frames(self: SmoothingSpline[Any, tuple[SmoothingReport, ...]], x: TimesLike) -> AnyArrays: ...

    def frames(self, x: TimesLike) -> Any:
        """Compute the frames along the curve to which covariances refer.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times between the knots, of any shape.

        Returns
        -------
        ndarray or tuple, shape ``(*batch axes, *x.shape, m, *point_shape)``
            Tangent vectors at the points of the curve, m = ``space.dim`` at each; for products and poses a tuple with
            one entry per part. They are orthonormal if the space has a metric, and change along the curve by parallel
            transport.

        Raises
        ------
        ValidationError
            If a time is not finite or lies outside the knots.

        See Also
        --------
        SmoothingSpline.cov : Compute the covariance in these frames.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> noisy = ss.Sphere(2).project(np.random.default_rng(0).standard_normal((20, 3)) * 0.1 + [0, 0, 1])
        >>> ss.make_smoothing_spline(None, noisy, "sphere:2", lam=1.0).frames([1.5, 2.0]).shape
        (2, 2, 3)
        """
        times, _, per_curve = self._finite_times(x)
        return self._per_space([frames for _, frames in self._frames(times, per_curve)])

    def _frames(self, times: Doubles, per_curve: bool) -> list[tuple[Array, Array]]:
        """Return points and frames along the curve in every part, at times of the core."""

        def frames(space: Space, points: Array, p: Array, index: Index, at: Doubles) -> Array:
            return frames_at(space, self._knots_of(index), points[index], at, p[index].reshape(-1, *space.point_shape))

        frames_of_parts = []
        for part in self._in_parts(times, per_curve):
            space, _, p = part
            tail = (space.dim, *space.point_shape)
            frames_of_parts.append((p, self._per_curve(times, per_curve, partial(frames, *part), tail, space.dtype)))
        return frames_of_parts

    def _in_parts(self, times: Doubles, per_curve: bool) -> list[tuple[Space, Array, Array]]:
        """Return every space in which data were smoothed, the points at the knots, and those at times of the core."""
        parts: list[tuple[Space, Array, Array]] = []
        for factor, curve in zip(factors_of(self.space), self._curve.parts, strict=True):
            values = curve.evaluate(times, "point", "raise", per_curve)
            parts += zip(parts_of_factor(factor), split(factor, curve.points), split(factor, values), strict=True)
        return parts

    def sample(self, rng: np.random.Generator, n: int) -> CubicSpline[P]:
        """Draw curves from the posterior distribution.

        Anything that is computed from such curves has the distribution that noise and smoothness imply: lengths,
        courses, times of arrival.

        Parameters
        ----------
        rng : numpy.random.Generator
            Source of random numbers.
        n : int
            Number of curves.

        Returns
        -------
        CubicSpline
            A batch of n curves. For a batch of shape (...), the result has the batch axes (n, ...).

        Raises
        ------
        ValidationError
            If n is not a positive integer.
        ConvergenceError
            If no spline joins the points of a sample: the posterior is too wide for the knots.

        See Also
        --------
        SmoothingSpline.cov : Compute the covariance of the curve.

        Notes
        -----
        The knots move by a sample of the normal distribution in the frames along the curve, and one batched fit joins
        them. The variance between the knots, which `std` includes, is not part of it. Samples at knots near a gap are
        scaled to the calibrated standard deviations.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> t = np.linspace(0, 1, 50)
        >>> y = np.sin(6 * t) + 0.1 * np.random.default_rng(0).standard_normal(50)
        >>> s = ss.make_smoothing_spline(t, y[:, None], "r:1")
        >>> lengths = s.sample(np.random.default_rng(1), 200).length()
        >>> lengths.shape, bool(0 < lengths.std() < 0.2)
        ((200,), True)
        """
        if not hasattr(rng, "standard_normal"):
            raise TypeError(f"rng must be a numpy.random.Generator, not {short_repr(rng)}")
        n = whole_number(n, "n", 1)
        kinds = end_kinds(self._bc_type)
        moved: list[Array] = []
        valid = np.ones(self._batch, bool)
        drawn: dict[tuple[int, tuple[int, ...]], Doubles] = {}
        per_curve = self._times.ndim > 1
        parts = self._in_parts(self._times, per_curve)
        for number, (space, whole, _) in enumerate(parts):
            part = self._smoothed[number]
            posterior = self._posterior(part)
            out = np.empty((n, *whole.shape), space.dtype)
            for index in np.ndindex(self._batch):
                knots = self._knots_of(index)
                # Coupled parts share one sample.
                key = (id(posterior.band), index)
                if key not in drawn:
                    drawn[key] = posterior.samples(space, knots, index, kinds, rng, n)
                first = posterior.first
                points = whole[index]
                if not space._where_finite(points).all():
                    # Curves that failed or are masked have no posterior.
                    out[(slice(None), *index)], valid[index] = np.nan, False
                    continue
                coordinates = drawn[key][..., first : first + space.dim] * np.asarray(part.sigma)[index].item()
                coordinates = coordinates * self._inflation(number, index, knots, 0)[:, None]
                frames = frames_at(space, knots, points, knots, points)
                vectors = np.einsum("nkj,kj...->nk...", coordinates, frames)
                out[(slice(None), *index)] = space.project(space._apply("exp", p=points, v=vectors))
            if kinds is None:
                axis = len(self._batch) + 1
                out[(slice(None),) * axis + (-1,)] = out[(slice(None),) * axis + (0,)]
            moved.append(out)
        factors = factors_of(self.space)
        joined = [join(factor, rows) for factor, rows in zip(factors, grouped(self.space, moved), strict=True)]
        through: P = self._in_factors(joined)
        where = None if valid.all() else np.broadcast_to(valid, (n, *self._batch))
        options: Any = {"bc_type": self._bc_type, "extrapolate": self._extrapolate, "where": where}
        return CubicSpline(self._t, through, self.space, **options)

    # ---- plots ----

    def _made_of(self, radius: float | None = None) -> str:
        count = int(np.max(np.sum(self._noisy.used, axis=-1)))
        spaces = " and ".join(short_name(part) for part in smoothed_spaces(self.space))
        factors = f" ({spaces})" if 1 < len(self._smoothed) <= _OWN_RANGES else ""
        df = _ranges([part.report.df for part in self._smoothed], 3)
        scales = [radius or 1 if part == Sphere(2) else 1 for part in smoothed_spaces(self.space)]
        sigmas = [part.report.sigma * scale for part, scale in zip(self._smoothed, scales, strict=True)]
        kilometres = bool(radius) and max(float(np.max(values)) for values in sigmas) >= 1000
        sigma = _ranges([values / 1000 if kilometres else values for values in sigmas], 3 if radius else 2)
        of_batch = " each" if self._batch else ""
        unit = (" km" if kilometres else " m") if radius else ""
        return f"{count} data{of_batch}, {df} degrees of freedom, noise {sigma}{unit}{factors}"

    def _noise_beside(self, index: Index, x: Doubles) -> UncertaintyBand:
        noisy = self._noisy.map(itemgetter(index), ())
        # The parts of a pose have different units; plots show the band of the position.
        radii = [of_factor[-1][1] for of_factor in self._radii(index, x)]
        speed = None if is_several(self.space) else self._spread(0, index, x, 1)
        points = [rows[noisy.used] for rows in noisy.points]
        return UncertaintyBand([noisy.times[noisy.used]] * len(points), points, radii, speed)

    def _radii(self, index: Index, x: Doubles) -> list[list[tuple[Space, Doubles]]]:
        """Return the parts of every factor, and the radii of their 95 % bands at times x of the core."""
        parts = enumerate(smoothed_spaces(self.space))
        return grouped(
            self.space, [(part, radius(part, 0.95) * self._spread(number, index, x, 0)) for number, part in parts]
        )

    def _panels_below(self, x: Doubles) -> list[SidePanel]:
        if self._batch:
            return []
        panels = [
            SidePanel(
                f"95 % band\nof {short_name(part)}{', rad' if part in _TURNING else ''}",
                x,
                values[:, None],
                (),
                number,
                "radii",
            )
            for number, radii in enumerate(self._radii((), x))
            for part, values in radii
        ]
        return panels + self._panels_of_varying(x)

    def _panels_of_varying(self, x: Doubles) -> list[SidePanel]:
        """Return λ of the segments and the standard deviation of the noise at times x, where they vary."""
        knots, spaces = self._knots_of(()), smoothed_spaces(self.space)
        names = [f"\nof {short_name(space)}" if len(spaces) > 1 else "" for space in spaces]
        power = "⁵" if self._smoothed[0].penalty == "jerk" else "³"
        unit = "" if self._time_axis.plain else f", s{power}"
        panels = []
        for name, part in zip(names, self._smoothed, strict=True):
            if part.profile is not None:
                lam = part.report.lam * np.append(part.profile, part.profile[-1])
                panels.append(SidePanel(f"λ{name}{unit}", knots, lam[:, None], kind="lam"))
        for number, (space, name, part) in enumerate(zip(spaces, names, self._smoothed, strict=True)):
            if part.noise_profile is not None:
                sigma = self._sigma_at(number, (), x)
                panels.append(SidePanel(f"noise σ{name}", x, sigma[:, None], kind="sigma", space=space))
        return panels

    @property
    def _unconverged(self) -> int:
        return int(np.sum(~np.all([np.asarray(part.report.converged) for part in self._smoothed], axis=0)))

    def _with(self, time_axis: TimeAxis, t: Array, curve: CurveArrays, index: Any) -> Any:
        part = super()._with(time_axis, t, curve, index)
        pick = itemgetter(index)
        noisy = self._noisy.map(pick, curve.batch)._replace(time_axis=time_axis)
        return self._like(part, noisy, [part.map(pick) for part in self._smoothed])

    @property
    def _parts(self) -> tuple[AnySmoothingSpline, ...]:
        """Splines in the factors of a product."""
        noisy = self._noisy
        factors = zip(
            super()._parts,
            noisy.points,
            grouped(self.space, noisy.noise),
            grouped(self.space, self._smoothed),
            strict=True,
        )
        return tuple(
            self._like(part, noisy._replace(points=[points], noise=noise), smoothed)
            for part, points, noise, smoothed in factors
        )

    @classmethod
    def _like(cls, spline: CubicSpline[Any, Any], noisy: SmoothingData, smoothed: list[Smoothed]) -> Self:
        """Return a smoothing spline from a spline through the smooth points and the properties of the noise."""
        curve = cls._fitted(
            spline._time_axis, spline._t, spline._curve, spline._bc_type, spline._extrapolate, spline._reports
        )
        return curve._with_noise(noisy, smoothed)

    def _with_noise(self, noisy: SmoothingData, smoothed: list[Smoothed]) -> Self:
        """Set the data and the properties of the noise of a new spline, and return it."""
        self._noisy, self._smoothed = noisy, smoothed
        return self

    def _state(self) -> dict[str, Any]:
        return super()._state() | noise_state(self.space, self._noisy, self._smoothed)

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        time_axis, t = read_times(state, "data_t")
        self = cls._fitted(*read_fitted(state, time_axis))
        return self._with_noise(*read_noise(state, time_axis, t, self._curve, is_closed(self._bc_type)))

    def __repr__(self) -> str:
        data, knots = self._noisy.times.shape[-1], self._times.shape[-1]
        text = f"{self._batch_text}{data} data, {knots} knots, {self._span_text}{self._failed_text}"
        return f"<SmoothingSpline on {self.space!r}: {text}>"


AnySmoothingSpline = SmoothingSpline[Any, Any]
"""A smoothing spline with points and reports of any type."""


def radius(space: Space, level: float) -> float:
    """Return the radius of the ball that contains a normal vector with this probability, in standard deviations."""
    return float(np.sqrt(_core.chi_squared(space.dim, level)))


def _ranges(factors: list[Number], digits: int) -> str:
    """Return the range of a number for every factor, or one range for all if there are many factors."""
    if len(factors) > _OWN_RANGES:
        factors = [np.concatenate([np.ravel(values) for values in factors])]
    return " and ".join(_range(np.ravel(values), digits) for values in factors)


def _range(values: Doubles, digits: int) -> str:
    good = values[np.isfinite(values)]
    ends = (good.min(), good.max()) if good.size else ()
    # dict.fromkeys drops the second of two equal texts.
    return " to ".join(dict.fromkeys(f"{value:.{digits}g}" for value in ends)) or "unknown"


# ---- the noisy data of smoothing splines in files and pickles ----


def noise_state(space: AnySpace, noisy: SmoothingData, smoothed: list[Smoothed]) -> dict[str, Any]:
    """Return the entries of a smoothing spline in addition to those of a `CubicSpline`."""
    state: dict[str, Any] = {
        **times_state("data_t", noisy.t, noisy.time_axis),
        "noise": [
            fields_of(of_part.report, of_part.profile is not None or of_part.noise_profile is not None)
            | {"band_lam": of_part.band_lam, "scale": of_part.sigma, "between": of_part.between}
            | {"penalty": of_part.penalty, "loss": noise.loss}
            # Version 1 has no matrices.
            | ({} if of_part.posterior is None else {"posterior": True})
            for noise, of_part in zip(noisy.noise, smoothed, strict=True)
        ],
    }
    first, *others = noisy.noise
    alike = all(np.array_equal(first.weights, of_part.weights) for of_part in others)
    if alike:
        state["data_weights"] = first.weights
    state |= {"data" + suffix_of(space, i): points for i, points in enumerate(noisy.points)}
    for i, (noise, of_part) in enumerate(zip(noisy.noise, smoothed, strict=True)):
        suffix = _suffix(space, i)
        state["band" + suffix] = of_part.band
        if of_part.posterior is not None:
            state |= posterior_state(of_part.posterior, suffix, noisy.batch)
        if not alike:
            state["data_weights" + suffix] = noise.weights
        if noise.information is not None:
            state["data_information" + suffix] = noise.information
        for name, profile in (("profile", of_part.profile), ("noise_profile", of_part.noise_profile)):
            if profile is not None:
                state[name + suffix] = profile
    return state


def posterior_state(posterior: Posterior, suffix: str, batch: tuple[int, ...]) -> dict[str, Any]:
    """Return the entries of a posterior.

    Its blocks are numbers or matrices; rows of four numbers are the same for both, so that curves of both kinds can be
    in one file.
    """
    band, turn = posterior.band, posterior.turn
    rows, corner = math.prod(band.shape[-2:]) // 4, math.prod(turn.shape[-2:])
    return {"matrix" + suffix: band.reshape(*batch, rows, 4), "turn" + suffix: turn.reshape(*batch, corner, 1)}


def _suffix(space: Space, i: int) -> str:
    """Return the suffix of entries for the i-th space in which data were smoothed."""
    return f"_{i}" if is_several(space) else ""


def read_noise(
    state: Entries, time_axis: TimeAxis, t: Array, curve: CurveArrays, closed: bool
) -> tuple[SmoothingData, list[Smoothed]]:
    """Return the data of a curve and the results of the smoothing.

    Parameters
    ----------
    state : Entries
        State of the smoothing spline.
    time_axis : TimeAxis
        Time axis of the data.
    t : ndarray
        Times of the data, as shown.
    curve : CurveArrays
        The curve.
    closed : bool
        Whether the curve is closed.

    Raises
    ------
    ValidationError
        If the entries do not match.
    """
    space, batch, times = curve.space, curve.batch, time_axis.knots(t)
    count, knots = times.shape[-1], curve.times.shape[-1]
    with entry("data_t"):
        if times.shape not in ((count,), (*batch, count)):
            raise ValidationError(f"the times of the data have shape {times.shape}")
        if not (np.isfinite(times).all() and (np.diff(times) >= 0).all()):
            raise ValidationError("the times of the data are not finite, or decrease")
        if np.any(times[..., 0] < curve.times[..., 0]) or np.any(times[..., -1] > curve.times[..., -1]):
            raise ValidationError("there are data before the first or after the last knot")
    points = [read_array(state, "data" + suffix_of(space, i), factor) for i, factor in enumerate(factors_of(space))]
    for part, rows in zip(curve.parts, points, strict=True):
        if rows.shape != (*batch, count, *part.space.point_shape):
            raise ValidationError(f"entry 'data': the data have shape {rows.shape}")
        if isinstance(state, Stored):
            # Masked curves are NaN, and so are their data.
            part.space.check_point(rows[part.space._where_finite(part.points).all(axis=-1)])
    noise, smoothed = [], []
    with entry("noise"):
        for i, (space_of_part, numbers) in enumerate(zip(smoothed_spaces(space), state["noise"], strict=True)):
            suffix = _suffix(space, i)
            weights = state["data_weights" + (suffix if "data_weights" + suffix in state else "")]
            information = state.get("data_information" + suffix)
            _check("weights", weights, (count,), (*batch, count))
            if information is not None:
                shape = (count, space_of_part.dim, space_of_part.dim)
                _check("information matrices", information, shape, batch + shape)
            if not (weights >= 0).all():
                raise ValidationError("the weights must be numbers >= 0")
            band, numbers = state["band" + suffix], dict(numbers)
            lam, scale = (read_field(key, numbers.pop(key), batch, dtype=np.float64) for key in ("band_lam", "scale"))
            between = read_field("between", numbers.pop("between"), (), dtype=np.bool_)
            known = numbers.pop("posterior", False)
            # Files of older versions do not name them.
            penalty = one_of(numbers.pop("penalty", "acceleration"), "penalty", "acceleration", "jerk")
            loss = one_of(numbers.pop("loss", "linear"), "loss", "linear", "huber", "cauchy")
            noise.append(Noise(weights, information, loss=loss))
            report = read_report(SmoothingReport, numbers, batch)
            # A closed curve repeats its first coefficients at the end.
            good = np.asarray(report.converged)
            _check("bands", band, (*batch, knots + (2 if closed else 0), 4), finite=good)
            posterior = None
            if known:
                posterior = read_posterior(state, suffix, space_of_part.dim, band.shape[-2], batch, closed, good)
            profile, noise_profile = (state.get(name + suffix) for name in ("profile", "noise_profile"))
            for array, size in ((profile, knots - 1), (noise_profile, knots)):
                if array is not None:
                    _check("profiles", array, (*batch, size), finite=good)
            smoothed.append(Smoothed(report, band, lam, scale, between, posterior, penalty, profile, noise_profile))
    return SmoothingData(time_axis, t, times, points, noise, batch), smoothed


def read_posterior(
    state: Entries, suffix: str, m: int, coefficients: int, batch: tuple[int, ...], closed: bool, good: Array
) -> Posterior:
    """Return the posterior of a curve with a number of coefficients, each of m coordinates."""
    matrix, turn = state["matrix" + suffix], state["turn" + suffix]
    size = math.isqrt(math.prod(matrix.shape[-2:]) // (4 * coefficients))
    if size not in (1, m) or math.prod(matrix.shape[-2:]) != 4 * coefficients * size**2:
        raise ValidationError(f"the matrices have shape {matrix.shape}")
    shapes = (*batch, coefficients * size, 4 * size), (*batch, *(2 * (size if closed else 0,)))
    if math.prod(turn.shape) != math.prod(shapes[1]):
        raise ValidationError(f"the matrices have shape {turn.shape}")
    matrix, turn = (array.reshape(shape) for array, shape in zip((matrix, turn), shapes, strict=True))
    _check("matrices", matrix, shapes[0], finite=good)
    _check("matrices", turn, shapes[1], finite=good)
    return Posterior.of(matrix, turn, size)


def _check(what: str, array: Array, *shapes: tuple[int, ...], finite: Array | bool = True) -> None:
    if array.dtype != np.float64 or array.shape not in shapes:
        raise ValidationError(f"the {what} are {array.dtype} of shape {array.shape}")
    if not np.isfinite(array[np.asarray(finite)]).all():
        raise ValidationError(f"the {what} are not finite")

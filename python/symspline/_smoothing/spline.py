"""Smoothing splines."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, Self, overload

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import short_repr
from .._core import ValidationError
from .._cubic import CubicSpline
from .._curves.band import UncertaintyBand
from .._curves.curve import CurveArrays
from .._curves.ends import fixed_velocities
from .._options import order_of
from .._report import Report
from .._spaces import Array, Product, Space, factors_of
from .._time import TimeAxis
from .._typing import AnyArray, BCType, Extrapolate, FloatArray, Number, P
from .data import Doubles, SmoothingData
from .factors import grouped, is_several, smoothed_spaces
from .report import SmoothingReport
from .solve import Smoothed
from .stored import noisy_arrays

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    # The report: one, or on products and for poses one for each part.
    R = TypeVar(
        "R", bound=SmoothingReport | tuple[SmoothingReport, ...], covariant=True, default=SmoothingReport
    )

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


class SmoothingSpline(CubicSpline[P], Generic[P, R]):
    """A C² cubic spline near noisy data, made by `make_smoothing_spline` or `make_lsq_spline`.

    It has all that a `CubicSpline` has; its points are those of the smooth curve at its knots, and derivatives by
    `jvp` and `vjp` are with respect to them, not to the data. Numbers that belong to the noise are tuples with one
    entry a factor in a `Product`, and arrays with the batch axes for a batch of curves. `save` keeps all of them,
    and the data; `plot` shows the data and 95 % bands.
    """

    _kind = "Smoothing spline"

    def __init__(self) -> None:
        raise TypeError("smoothing splines are made by symspline.make_smoothing_spline")

    def _fill(  # type: ignore[override]
        self,
        clock: TimeAxis,
        t: Array,
        curve: CurveArrays,
        bc_type: BCType,
        extrapolate: Extrapolate,
        reports: list[Report],
        noisy: SmoothingData,
        smoothed: list[Smoothed],
    ) -> None:
        super()._fill(clock, t, curve, bc_type, extrapolate, reports)
        self._noisy, self._smoothed = noisy, smoothed

    def _each(self, values: list[Any]) -> Any:
        """One value, or one for every space in which data were smoothed."""
        return tuple(values) if is_several(self.space) else values[0]

    def _in_factors(self, values: list[Any]) -> Any:
        """One value, or one for every factor."""
        return tuple(values) if isinstance(self.space, Product) else values[0]

    @property
    def report(self) -> R:  # type: ignore[override]
        """How the smoothing went: a `SmoothingReport`, in a product one of every factor."""
        reports: R = self._each([found.report for found in self._smoothed])
        return reports

    @noise_property
    def lam(self) -> Number | tuple[Number, ...]:
        """λ."""
        lam: Number | tuple[Number, ...] = self._each([found.report.lam for found in self._smoothed])
        return lam

    @noise_property
    def df(self) -> Number | tuple[Number, ...]:
        """Degrees of freedom for each coordinate: 2 for a geodesic, the number of data for interpolation."""
        df: Number | tuple[Number, ...] = self._each([found.report.df for found in self._smoothed])
        return df

    @noise_property
    def sigma(self) -> Number | tuple[Number, ...]:
        """Standard deviation of the noise in a coordinate of an orthonormal frame, for weight one: the one that was
        given, or estimated as the root of ``sum(weights * distance**2)/(dim * (N - df))``."""
        sigma: Number | tuple[Number, ...] = self._each([found.sigma for found in self._smoothed])
        return sigma

    @property
    def data(self) -> tuple[AnyArray, P]:
        """The times and the points that were smoothed."""
        return self._noisy.t, self._in_factors(self._noisy.points)

    @property
    def residuals(self) -> P:
        """Vectors from the curve to the data, shape (..., N, *point_shape): the logarithm of a point at the curve,
        whose length is the distance. Data of weight zero have no residual, NaN."""
        noisy = self._noisy
        at = self._curve.evaluate(noisy.times, "point", "raise", noisy.times.ndim > 1)
        found = []
        gammas = at if isinstance(self.space, Product) else (at,)
        for space, gamma, points, weighing in zip(
            factors_of(self.space), gammas, noisy.points, grouped(self.space, noisy.weighing), strict=True
        ):
            counts = np.any([own.weights > 0 for own in weighing], axis=0)
            used = np.broadcast_to(counts, (*noisy.batch, points.shape[len(noisy.batch)]))
            used = used & np.isfinite(gamma).all(axis=tuple(range(len(noisy.batch) + 1, gamma.ndim)))
            vectors = np.full(points.shape, np.nan, points.dtype)
            vectors[used] = space._apply("log", p=gamma[used], q=points[used])
            found.append(vectors)
        residuals: P = self._in_factors(found)
        return residuals

    @overload
    def std(self: SmoothingSpline[Any, SmoothingReport], x: ArrayLike, *, nu: int = 0) -> FloatArray: ...

    @overload
    def std(
        self: SmoothingSpline[Any, tuple[SmoothingReport, ...]], x: ArrayLike, *, nu: int = 0
    ) -> tuple[FloatArray, ...]: ...

    def std(self, x: ArrayLike, *, nu: int = 0) -> Any:
        """Standard deviation of the curve at times x, for one coordinate of an orthonormal frame.

        It is the root of σ² b(t)ᵀA⁻¹b(t), in frames along the curve: the posterior of a spline (Wahba 1983). If the
        knots are the times of the data, as by default, what a curve of this roughness may do between them is added; a
        spline on knots of your own has no such freedom.

        Args:
            x: times, any shape; beyond the knots the curve goes on straight, or round again if it is closed.
            nu: 0 for the point, 1 for the velocity.

        Returns:
            Shape batch axes + x.shape.

        >>> import numpy as np
        >>> import symspline as ss
        >>> t = np.linspace(0, 1, 50)
        >>> y = np.sin(6 * t) + 0.1 * np.random.default_rng(0).standard_normal(50)
        >>> s = ss.make_smoothing_spline(t, y[:, None], "r:1")
        >>> bool(0.02 < s.std(0.5) < s.std(0.0) < 0.1)
        True
        """
        nu = order_of(nu, 1)
        times, per_curve = self._clock.at(x, self._batch, False)
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
        """The standard deviation of one curve in a factor at times x of the core."""
        knots = self._times[index] if self._times.ndim > 1 else self._times
        lam, sigma = (np.asarray(value)[index].item() for value in (part.band_lam, part.sigma))
        if not part.between:
            # As with λ = 0: nothing happens between the knots but what the spline does.
            lam = 0.0
        variance = _core.smoothing_variance(
            np.ascontiguousarray(knots),
            np.ascontiguousarray(part.band[index]),
            lam,
            np.ascontiguousarray(x),
            nu,
            fixed_velocities(self._bc_type),
        )
        spread: Doubles = sigma * np.sqrt(variance)
        return spread

    @overload
    def band(
        self: SmoothingSpline[Any, SmoothingReport], x: ArrayLike, level: float = 0.95
    ) -> FloatArray: ...

    @overload
    def band(
        self: SmoothingSpline[Any, tuple[SmoothingReport, ...]], x: ArrayLike, level: float = 0.95
    ) -> tuple[FloatArray, ...]: ...

    def band(self, x: ArrayLike, level: float = 0.95) -> Any:
        """Radius of the ball about the curve at times x that holds the true point with probability ``level``.

        The mean coverage over all times is what it says; at the two end points it is less where the truth bends
        there, since natural ends do not, and so it is within long gaps. Where λ is at its bound (``report.at_bound``)
        it means nothing.

        Args:
            x: times, any shape.
            level: between 0 and 1.

        Returns:
            Shape batch axes + x.shape: a distance in the space.
        """
        number = isinstance(level, (int, float, np.integer, np.floating)) and not isinstance(level, bool)
        if not number or not 0 < level < 1:
            raise ValidationError(f"level must lie between 0 and 1, not {short_repr(level)}")
        whole: SmoothingSpline[Any, Any] = self
        spreads = whole.std(x)
        each = spreads if is_several(self.space) else (spreads,)
        return self._each(
            [
                _radius(part, level) * spread
                for part, spread in zip(smoothed_spaces(self.space), each, strict=True)
            ]
        )

    # ---- what a plot shows ----

    @property
    def _made_of(self) -> str:
        count = int(np.max(np.sum(self._noisy.used, axis=-1)))
        df = _ranges([part.report.df for part in self._smoothed], 3)
        sigma = _ranges([part.sigma for part in self._smoothed], 2)
        each = " each" if self._batch else ""
        return f"{count} data{each}, {df} degrees of freedom, noise {sigma}"

    def _noise_beside(self, index: tuple[int, ...], x: Doubles) -> UncertaintyBand:
        noisy = self._noisy
        times = noisy.times[index] if noisy.times.ndim > 1 else noisy.times
        used = noisy.used[index] if noisy.used.ndim > 1 else noisy.used
        # Of poses, whose parts have a unit each, pictures show the position.
        radii = [
            _radius(own[-1][0], 0.95) * self._spread(own[-1][1], index, x, 0)
            for own in grouped(self.space, zip(smoothed_spaces(self.space), self._smoothed, strict=True))
        ]
        several = is_several(self.space)
        speed = None if several else self._spread(self._smoothed[0], index, x, 1)
        return UncertaintyBand(times[used], [points[index][used] for points in noisy.points], radii, speed)

    @property
    def _unconverged(self) -> int:
        good = np.all([np.asarray(found.report.converged) for found in self._smoothed], axis=0)
        return int(np.size(good) - np.sum(good))

    def _with(self, clock: TimeAxis, t: Array, curve: CurveArrays, index: Any) -> Any:
        part = super()._with(clock, t, curve, index)
        noisy = self._noisy
        own = noisy._replace(
            clock=clock,
            t=noisy.t[index] if noisy.t.ndim > 1 else noisy.t,
            times=noisy.times[index] if noisy.times.ndim > 1 else noisy.times,
            points=[points[index] for points in noisy.points],
            weighing=[own.map(lambda column: column[index]) for own in noisy.weighing],
            batch=curve.batch,
        )
        return self._like(part, own, [found.map(lambda column: column[index]) for found in self._smoothed])

    @property
    def _parts(self) -> tuple[SmoothingSpline[Any, Any], ...]:
        """The splines in the factors of a product."""
        noisy = self._noisy
        weighing = grouped(self.space, noisy.weighing)
        found = grouped(self.space, self._smoothed)
        return tuple(
            self._like(part, noisy._replace(points=[points], weighing=own), noise)
            for part, points, own, noise in zip(super()._parts, noisy.points, weighing, found, strict=True)
        )

    @classmethod
    def _like(cls, spline: CubicSpline[Any], noisy: SmoothingData, smoothed: list[Smoothed]) -> Self:
        """A spline through smooth points with what is known of the noise."""
        parts = (
            spline._clock,
            spline._t,
            spline._curve,
            spline._bc_type,
            spline._extrapolate,
            spline._reports,
        )
        return cls._of(*parts, noisy, smoothed)

    def __reduce__(self) -> tuple[Any, ...]:
        _, parts = super().__reduce__()
        return SmoothingSpline._of, (*parts, self._noisy, self._smoothed)

    def _arrays(self) -> dict[str, Any]:
        return super()._arrays() | noisy_arrays(self.space, self._noisy, self._smoothed)

    def __repr__(self) -> str:
        batch = f"{' x '.join(map(str, self._batch))} curves, " if self._batch else ""
        data, knots = self._noisy.times.shape[-1], self._times.shape[-1]
        return f"<SmoothingSpline on {self.space!r}: {batch}{data} data, {knots} knots>"


def _radius(space: Space, level: float) -> float:
    """How many standard deviations of a coordinate the ball reaches that holds a normal vector so often."""
    return float(np.sqrt(_core.chi_squared(space.dim, level)))


def _ranges(factors: list[Any], digits: int) -> str:
    """A number of every factor, of a batch the least and the largest; of many factors these, too."""
    few = factors if len(factors) <= 3 else [np.concatenate([np.ravel(values) for values in factors])]
    return " and ".join(_range(np.ravel(values), digits) for values in few)


def _range(values: Doubles, digits: int) -> str:
    good = values[np.isfinite(values)]
    ends = (good.min(), good.max()) if good.size else ()
    # Once, if they look alike.
    return " to ".join(dict.fromkeys(f"{value:.{digits}g}" for value in ends)) or "unknown"

"""Estimated curves, and the long gaps in which no sensor measures them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.typing import P
from .._core import ValidationError
from .._curves.curve import SidePanel, UncertaintyBand
from .._curves.ends import end_kinds
from .._smoothing.gaps import Calibration, Course, SensorEvidence, calibrate
from .._smoothing.noise import SmoothingData, is_several, smoothed_spaces
from .._smoothing.report import Parameter, Posterior, SmoothingReport, fields_of
from .._smoothing.solve import Smoothed
from .._smoothing.spline import AnySmoothingSpline, SmoothingSpline
from .._spaces import AnySpace, Array, Doubles, Product, Space, SpecialEuclidean, factors_of, parts_of
from .._splines.archive import Entries, entry, read_fitted, read_report
from .._splines.cubic import CubicSpline
from ..measure import BodyRates, Measurement, Points, SpecificForce
from .problem import PointTerm, Setup, Solution

# Points beyond this quantile of the noise are not predicted if the loss is robust.
_KEPT = 0.999
# Variance of a coordinate at times, of points (0) or velocities (1).
Variance = Callable[[Doubles, int], Doubles]


class LongGaps(NamedTuple):
    """Gaps of one part of a curve.

    Attributes
    ----------
    gaps : list of tuple
        Start, stop, factor and number of blocks, as in `Calibration`.
    width : float
        Width of the smoother.
    at_data : tuple of float
        Median variance of points and of velocities at the data.
    """

    gaps: list[tuple[float, float, float, int]]
    width: float
    at_data: tuple[float, float]

    def calibration(self, variance: Variance) -> Calibration:
        """Return the calibration of the bands. The bands in gaps depend on the process by its variance only."""
        return Calibration(_course(0, np.nan, variance), self.gaps, lambda nu: self.at_data[nu], self.width)


def read_long_gaps(entry: Any) -> LongGaps | None:
    """Return the gaps of one part from the entry of a file."""
    if entry is None:
        return None
    gaps, width, at_data = entry
    read = [(float(start), float(stop), float(factor), int(blocks)) for start, stop, factor, blocks in gaps]
    return LongGaps(read, float(width), (float(at_data[0]), float(at_data[1])))


def _course(order: int, lam: float, variance: Variance) -> Course:
    return Course(order, lam, variance, lambda _: np.zeros((2, 2)), 0.0)


def long_gaps(setup: Setup, solution: Solution, part: int) -> LongGaps | None:
    """Return the long gaps of a part, or None if there are none or the part has no points that can be predicted."""
    terms, times_of_terms, weights, has_points = [], [], [], False
    for k, term in enumerate(setup.terms):
        if part in term.parts:
            terms.append(k)
            times_of_terms.append(np.clip(term.shifted_times(solution.values), setup.knots[0], setup.knots[-1]))
            weights.append(term.scales**-2.0 if isinstance(term, PointTerm) else np.zeros(len(term.times)))
            has_points |= isinstance(term, PointTerm)
    lam = float(solution.reports[part].lam)
    if setup.profiles and (profile := setup.profiles[part]) is not None:
        h = np.diff(setup.knots)
        lam *= float(h.sum() / np.sum(h / profile))
    if solution.failure or not has_points or not 0 < lam < np.inf:
        return None
    order = np.argsort(np.concatenate(times_of_terms), kind="stable")
    times, weight = np.concatenate(times_of_terms)[order], np.concatenate(weights)[order]
    if not np.ptp(times) > 0:
        return None

    space, kinds = setup.spaces[part], end_kinds(setup.bc_type)
    posterior = solution.posterior._replace(first=sum(space.dim for space in setup.spaces[:part]))

    def evidence() -> SensorEvidence:
        return _evidence(setup, solution, part, terms, order, times, weight)

    def variance(x: Doubles, nu: int) -> Doubles:
        whole = posterior.covariance(space, setup.knots, (), kinds, np.ascontiguousarray(x), None, [nu])
        return np.asarray(np.trace(whole, axis1=1, axis2=2) / space.dim)

    course = _course(3 if setup.penalty == "jerk" else 2, lam, variance)
    result = calibrate(times, weight, course, np.nan, evidence, ends=False)
    return LongGaps(result.gaps, result.width, (result.at_data(0), result.at_data(1))) if result.gaps else None


def _evidence(
    setup: Setup,
    solution: Solution,
    part: int,
    terms: list[int],
    order: NDArray[np.intp],
    times: Doubles,
    weights: Doubles,
) -> SensorEvidence:
    """Return the linearised measurements of a part, in the order of time."""
    kinds, size = end_kinds(setup.bc_type), solution.posterior.size
    parameters = sum(constant.size for constant in setup.constants.values())
    q = max(solution.rows[k].residuals.shape[1] for k in terms)
    known = solution.posterior.known((), kinds)
    factors, sides, residuals, counts = [], [], [], []
    for k in terms:
        term, linearised = setup.terms[k], solution.rows[k]
        (n, d), dim = linearised.residuals.shape, setup.spaces[part].dim
        x = np.clip(term.shifted_times(solution.values), setup.knots[0], setup.knots[-1])
        rows = np.zeros((n, q, 4 * size))
        for nu, columns in enumerate(linearised.jacobians):
            if columns is not None:
                of_curve = _core.coefficient_factors(setup.knots, kinds, x, nu)[1]
                rows[:, :d] += np.einsum("ndm,nk->ndkm", columns, of_curve).reshape(n, d, -1)
        of_parameters, left = np.zeros((n, q, parameters)), np.zeros((n, q))
        of_parameters[:, :d] = 0.0 if linearised.parameters is None else linearised.parameters
        left[:, :d] = -linearised.residuals
        scale = 1.0 if linearised.roots is None else linearised.roots
        factors.append(rows * np.asarray(scale)[..., None])
        sides.append(of_parameters * np.asarray(scale)[..., None])
        residuals.append(left * scale)
        near = np.ones(n, bool)
        if term.loss != "linear":
            near = np.sum(linearised.residuals**2, axis=1) <= _core.chi_squared(dim, _KEPT)
        counts.append(near & isinstance(term, PointTerm))
    firsts, whitened = _core.coefficient_factors(setup.knots, kinds, times, 0)[0], np.concatenate(residuals)[order]
    return SensorEvidence(
        setup.knots,
        known,
        times,
        firsts,
        np.concatenate(factors)[order],
        np.concatenate(sides)[order],
        whitened,
        np.concatenate(counts)[order],
        weights,
        setup.spaces[part].dim,
        pseudo=whitened,
        observed=np.full(len(times), float(setup.spaces[part].dim)),
        line=[],
    )


# ---- curves ----


def _are_partial(points: Points, factor: AnySpace) -> bool:
    """Whether points are positions or rotations of poses only."""
    y: Any = points.y
    partial = isinstance(factor, SpecialEuclidean) and not isinstance(y, tuple)
    return partial and np.shape(y)[1:] != factor.point_shape


def in_parts(
    posterior: Posterior,
    reports: Sequence[SmoothingReport],
    spaces: Sequence[Space],
    profiles: Sequence[Doubles | None] = (),
) -> list[Smoothed]:
    """Return the result in each part. Profiles are λ of the segments divided by λ, if it varies.

    Given standard deviations are trusted, as with ``absolute_sigma`` of SciPy's ``curve_fit``.
    """
    first, results = 0, []
    for report, space, profile in zip(reports, spaces, profiles or [None] * len(spaces), strict=True):
        of_part = posterior._replace(first=first)
        results.append(Smoothed(report, np.zeros((0, 4)), report.lam, 1.0, False, of_part, profile=profile))
        first += space.dim
    return results


def _as_tuple(value: object) -> tuple[Any, ...]:
    return value if isinstance(value, tuple) else (value,)


def _in_words(name: str, found: Parameter) -> str:
    """Describe a constant by its value, rounded as its accuracy permits, and the largest of its standard deviations."""
    std = float(np.max(found.std))
    digits = max(0, 1 - int(np.floor(np.log10(std)))) if std > 0 else 3
    value = ", ".join(f"{x:.{digits}f}" for x in np.ravel(found.value))
    return f"{name} {f'({value})' if np.size(found.value) > 1 else value} ± {std:.2g}"


def _are_used(weights: object, count: int) -> NDArray[np.bool_]:
    """Return which of some points have a weight, or an information matrix, that is not zero."""
    used = np.ones(count, bool)
    for of_factor in _as_tuple(weights):
        if of_factor is not None:
            used &= np.asarray(of_factor).reshape(count, -1).any(axis=-1)
    return used


class EstimatedSpline(SmoothingSpline[P, Any]):
    """A C² cubic spline estimated from measurements of any kind; see `estimate`."""

    _kind = "Estimated spline"
    _format = "symspline-estimate"
    _parameters: dict[str, Parameter]
    _measurements: tuple[Measurement, ...]
    _residuals: tuple[Doubles | tuple[Doubles, ...], ...]
    _long_gaps: list[LongGaps | None]

    def _with_results(
        self,
        smoothed: list[Smoothed],
        parameters: dict[str, Parameter],
        long_gaps: list[LongGaps | None],
        measurements: tuple[Measurement, ...] = (),
        residuals: tuple[Doubles | tuple[Doubles, ...], ...] = (),
    ) -> Self:
        """Set the results of an estimate of a new spline, and return it. What files do not hold may be omitted."""
        self._parameters, self._long_gaps = parameters, long_gaps
        self._measurements, self._residuals = measurements, residuals
        # Measurements replace the noisy points of a smoothing fit.
        noisy: Any = None
        return self._with_noise(noisy, smoothed)

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Estimated constants by name, each with ``value``, ``std`` and ``cov``."""
        return MappingProxyType(self._parameters)

    @property
    def measurements(self) -> tuple[Measurement, ...]:
        """Measurements from which the curve was estimated; empty for a curve from a file."""
        return self._measurements

    @property
    def residuals(self) -> Any:
        """Residuals of each measurement in standard deviations, shape (n, components).

        On products and for poses, points and velocities have a tuple with one array per part. Points of weight zero are
        omitted.
        """
        return self._residuals

    @property
    def data(self) -> Any:
        """Times and points of the first `Points` among the measurements."""
        for measurement in self._measurements:
            if isinstance(measurement, Points):
                return measurement.t, measurement.y
        raise ValidationError("the curve was estimated without points. See the attribute measurements.")

    def _calibration_of(self, number: int) -> Calibration | None:
        gaps = self._long_gaps[number]
        return gaps and gaps.calibration(lambda x, nu: self._plain_spread(number, (), x, nu) ** 2)

    def _plain_spread(self, number: int, index: tuple[int, ...], x: Doubles, nu: int) -> Doubles:
        space = smoothed_spaces(self.space)[number]
        covariance = self._covariance(number, index, np.ascontiguousarray(x), None, [nu], False)
        return np.asarray(np.sqrt(np.trace(covariance, axis1=-2, axis2=-1) / space.dim))

    def _coupled(self, parts: list[int], index: tuple[int, ...], x: Doubles, orders: list[int]) -> Doubles:
        # The measurements may couple the parts, such as attitude and acceleration by an accelerometer.
        spaces, posterior = smoothed_spaces(self.space), self._posterior(self._smoothed[0])
        firsts = [self._posterior(self._smoothed[number]).first for number in parts]
        rows = [first + np.arange(spaces[number].dim) for number, first in zip(parts, firsts, strict=True)]
        kinds = end_kinds(self._bc_type)
        covariance = posterior.coupled(self._knots_of(index), index, kinds, x, None, orders, np.concatenate(rows))
        return self._inflated(parts, index, x, None, orders, covariance)

    def _made_of(self, radius: float | None = None) -> str:
        counts = [f"{len(self._times_of(given))} {type(given).__name__}" for given in self._measurements]
        df = " and ".join(f"{part.report.df:.3g}" for part in self._smoothed[:3])
        words = [*counts, f"{self._times.shape[-1]} knots", f"{df} degrees of freedom"]
        return ", ".join(words + [_in_words(name, found) for name, found in self._parameters.items()])

    # ---- plots ----

    def _noise_beside(self, index: tuple[int, ...], x: Doubles) -> UncertaintyBand:
        radii = [radii_of_part[-1][1] for radii_of_part in self._radii(index, x)]
        speed = None if is_several(self.space) else self._spread(0, index, x, 1)
        others = [self._times_of(sensor) for sensor in self._measurements if not isinstance(sensor, Points)]
        times, points = zip(*map(self._points_in, range(len(factors_of(self.space)))), strict=True)
        return UncertaintyBand(list(times), list(points), radii, speed, np.concatenate([np.empty(0), *others]))

    def _times_of(self, measurement: Measurement) -> Doubles:
        """Return the times of a measurement on the time axis of the core, with their estimated offset."""
        times, _ = self._time_axis.at(measurement.t, (), False)
        offset = measurement.time_offset
        return times if offset is None else times + self._parameters[offset.name or "time offset"].value[0]

    def _points_in(self, number: int) -> tuple[Doubles, Array]:
        """Return times and points of all measured points in one factor, in the order of time."""
        factor = factors_of(self.space)[number]
        times, points = [np.empty(0)], [np.empty((0, *factor.point_shape), factor.dtype)]
        for measurement in self._measurements:
            if not isinstance(measurement, Points) or measurement.factor not in (None, number):
                continue
            if _are_partial(measurement, factor):
                continue
            rows, used = self._rows_of(measurement, number)
            times.append(self._times_of(measurement)[used])
            points.append(np.asarray(factor.project(rows[used])) if used.any() else rows[used])
        order = np.argsort(np.concatenate(times), kind="stable")
        return np.concatenate(times)[order], np.concatenate(points)[order]

    def _rows_of(self, measurement: Points, number: int) -> tuple[Array, NDArray[np.bool_]]:
        """Return the points of a measurement in one factor, and which of them have residuals."""
        factor, weights = factors_of(self.space)[number], measurement.weights
        y: Any = measurement.y
        if measurement.factor is None and isinstance(self.space, Product):
            y = parts_of(y, self.space, "y")[number]
            weights = weights[number] if isinstance(weights, tuple) else weights
        rows = factor._numbers(factor._doubles(y, "y"))
        return rows, factor._where_finite(rows) & _are_used(weights, len(rows))

    def _panels_below(self, x: Doubles) -> list[SidePanel]:
        panels = super()._panels_below(x)
        kinds = [type(measurement).__name__ for measurement in self._measurements]
        for number, (measurement, kind) in enumerate(zip(self._measurements, kinds, strict=True)):
            label = kind if kinds.count(kind) == 1 else f"{kind} {kinds[: number + 1].count(kind)}"
            given = self._residuals[number]
            # Velocities on products and for poses have one array per part.
            values = np.concatenate([array.reshape(len(array), -1) for array in _as_tuple(given)], axis=-1)
            named = isinstance(measurement, (BodyRates, SpecificForce)) and values.shape[1] == 3
            label, times = f"{label}\nresidual / σ", self._times_of(measurement)
            if isinstance(measurement, Points) and len(values) < len(times):
                # Points that are not used have no residuals.
                times = times[self._rows_of(measurement, measurement.factor or 0)[1]]
            panels.append(SidePanel(label, times, values, ("x", "y", "z") if named else ()))
        return panels

    # ---- batches, files and pickles ----

    @property
    def _parts(self) -> Any:
        return CubicSpline._fitted(
            self._time_axis, self._t, self._curve, self._bc_type, self._extrapolate, self._reports
        )._parts

    def _state(self) -> dict[str, Any]:
        posterior = self._posterior(self._smoothed[0])
        return CubicSpline._state(self) | {
            "noise": [fields_of(part.report) for part in self._smoothed],
            "parameters": {name: [one.value.tolist(), one.cov.tolist()] for name, one in self._parameters.items()},
            "matrix": posterior.band,
            "side": posterior.side,
            "corner": posterior.corner,
            "gaps": self._long_gaps,
            **{f"profile_{i}": part.profile for i, part in enumerate(self._smoothed) if part.profile is not None},
        }

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        self = cls._fitted(*read_fitted(state))
        spaces, knots = smoothed_spaces(self.space), self._times.shape[-1]
        m = sum(space.dim for space in spaces)
        with entry("parameters"):
            parameters = {
                name: Parameter(*map(np.asarray, arrays)) for name, arrays in dict(state["parameters"]).items()
            }
            p = sum(len(parameter.value) for parameter in parameters.values())
            matrix, side, corner = (state[name] for name in ("matrix", "side", "corner"))
            shapes = [(knots * m, 4 * m), (knots * m, p), (p, p)]
            if [matrix.shape, side.shape, corner.shape] != shapes or any(
                parameter.cov.shape != 2 * parameter.value.shape for parameter in parameters.values()
            ):
                raise ValidationError("the matrices do not match the parameters and knots")
        with entry("noise"):
            reports = [read_report(SmoothingReport, dict(numbers), ()) for numbers in state["noise"]]
            profiles = [state.get(f"profile_{i}") for i in range(len(spaces))]
            if any(profile is not None and profile.shape != (knots - 1,) for profile in profiles):
                raise ValidationError("the profiles do not match the knots")
            smoothed = in_parts(Posterior(matrix, np.zeros((0, 0)), m, side, corner), reports, spaces, profiles)
        with entry("gaps"):
            gaps = [read_long_gaps(entries) for entries in state.get("gaps", [None] * len(spaces))]
        return self._with_results(smoothed, parameters, gaps)

    def __repr__(self) -> str:
        knots, parameters = self._times.shape[-1], ", ".join(self._parameters) or "no parameters"
        text = f"{knots} knots, {self._span_text}, {parameters}{self._failed_text}"
        return f"<EstimatedSpline on {self.space!r}: {text}>"


class PointsSpline(SmoothingSpline[P, Any]):
    """A smoothing spline that `estimate` fitted to points only, with residuals like those of an `EstimatedSpline`."""

    _format = "symspline-estimate-points"
    _measurements: tuple[Measurement, ...]
    _residuals: tuple[Doubles | tuple[Doubles, ...], ...]

    @classmethod
    def of(cls, fitted: AnySmoothingSpline, given: Points, terms: list[PointTerm]) -> Self:
        """Return the result of `estimate` from the smoothing spline and the terms of its points.

        Parameters
        ----------
        fitted : SmoothingSpline
            The curve.
        given : Points
            The points of the user.
        terms : list of PointTerm
            The same points in every part, with standard deviations of one if none were given.
        """
        residuals_of_parts = []
        for term in terms:
            (part,) = term.parts
            p, frames = fitted._frames(term.times, False)[part]
            rows = term.residuals_at(smoothed_spaces(fitted.space)[part], p, frames)
            scale = 1.0 if given.sigma is not None else float(fitted._smoothed[part].sigma)
            with np.errstate(divide="ignore", invalid="ignore"):
                residuals_of_parts.append(np.asarray(rows / term.noise / scale))
        residuals = residuals_of_parts[0] if len(residuals_of_parts) == 1 else tuple(residuals_of_parts)
        return cls._of(fitted, (given,), (residuals,))

    @classmethod
    def _of(
        cls,
        fitted: AnySmoothingSpline,
        measurements: tuple[Measurement, ...],
        residuals: tuple[Doubles | tuple[Doubles, ...], ...],
    ) -> Self:
        self = super()._like(fitted, fitted._noisy, fitted._smoothed)
        self._measurements, self._residuals = measurements, residuals
        return self

    @property
    def measurements(self) -> tuple[Measurement, ...]:
        """Points from which the curve was estimated; empty for a curve loaded from a file."""
        return self._measurements

    @property
    def residuals(self) -> Any:
        """Residuals of the points in standard deviations, one array of shape (n, components) in a tuple.

        On products and for poses, the entry is a tuple with one array per part. Points of weight zero are omitted. If
        no standard deviation was given, the estimated one is used.
        """
        return self._residuals

    @classmethod
    def _like(cls, spline: CubicSpline[Any, Any], noisy: SmoothingData, smoothed: list[Smoothed]) -> Any:
        # Factors and parts of the curve are smoothing splines.
        return SmoothingSpline._like(spline, noisy, smoothed)

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        spline = SmoothingSpline._from_state(state)
        return cls._of(spline, (), ())

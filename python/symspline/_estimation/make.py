"""Estimation of a curve from measurements of any kind."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypedDict, Unpack, cast, overload

import numpy as np

from .._base.arrays import as_array, checked_flag, checked_number, one_of, short_repr, whole_number
from .._base.faults import UNCONVERGED, Fault
from .._base.input import times_of
from .._base.time import Moments, TimeAxis, knots_of, time_axis_of, warn_of_rounded_times
from .._base.typing import (
    Criterion,
    Extrapolate,
    FloatArray,
    Loss,
    Numbers,
    OnFailure,
    P,
    PProduct,
    Progress,
    SmoothingPenalty,
    TimesLike,
)
from .._core import ValidationError
from .._curves.failures import raise_or_warn, warn_of_held_points
from .._curves.fit import FitProblem, fit, read_ends
from .._curves.fit import Points as CorePoints
from .._curves.missing import recounting
from .._curves.options import check_policies
from .._curves.solve import DEFAULTS
from .._smoothing import SmoothingReport, SmoothingSpline, SmoothingWarning, make_smoothing_spline
from .._smoothing.audit import warn_of_bounds
from .._smoothing.noise import check_profiles, grouped, join, read_smoothness, smoothed_spaces
from .._smoothing.report import Parameter
from .._smoothing.solve import Knots, thin_knots
from .._smoothing.spline import AnySmoothingSpline
from .._spaces import (
    AnySpace,
    Array,
    Doubles,
    Product,
    Space,
    SpecialEuclidean,
    factors_of,
    parts_of,
    refuse_quotients,
    space_named,
)
from .._splines.base import Curve
from ..manifolds._manifold import refuse_functions
from ..measure import (
    SKIPNA,
    BodyRates,
    Constant,
    Measurement,
    Points,
    Velocities,
    measurement_without_missing,
    present_in,
)
from .audit import audit, unit_hints
from .problem import PointTerm, Setup, Solution, Term, bind, with_varying_lams
from .search import (
    Search,
    Starts,
    automatic,
    filled,
    first_knots,
    merged,
    shown_times,
    solved,
    warn_of_gaps,
    warn_of_turns,
)
from .spline import EstimatedSpline, PointsSpline, in_parts, long_gaps

# Largest number of knots. A curve with more knots would not fit into memory.
_MOST_KNOTS = 2**32
# Curves with the largest λ for the jerk have fewer degrees of freedom than this.
_PARABOLA = 3.5


class EstimateOptions(TypedDict, total=False):
    """The keywords of `estimate` that do not affect the type of the result."""

    penalty: SmoothingPenalty | None
    lam: Numbers | None
    criterion: Criterion | None
    gamma: float
    loss: Loss
    start: Curve[Any] | None
    tol: float
    max_iter: int
    extrapolate: Extrapolate
    on_failure: OnFailure
    progress: Progress | None
    skipna: bool


@overload
def estimate(  # type: ignore[overload-overlap]
    measurements: Sequence[Measurement], knots: TimesLike, space: Product[PProduct], **options: Unpack[EstimateOptions]
) -> SmoothingSpline[PProduct, tuple[SmoothingReport, ...]]: ...


@overload
def estimate(
    measurements: Sequence[Measurement], knots: TimesLike, space: SpecialEuclidean, **options: Unpack[EstimateOptions]
) -> SmoothingSpline[FloatArray, tuple[SmoothingReport, ...]]: ...


@overload
def estimate(
    measurements: Sequence[Measurement], knots: TimesLike, space: Space[P] | str, **options: Unpack[EstimateOptions]
) -> SmoothingSpline[P]: ...


@recounting(lambda given: [np.flatnonzero(present_in(measurement)) for measurement in given["measurements"]])
def estimate(
    measurements: Sequence[Measurement],
    knots: TimesLike,
    space: AnySpace | str,
    *,
    penalty: SmoothingPenalty | None = None,
    lam: Numbers | None = None,
    criterion: Criterion | None = None,
    gamma: float = 1.2,
    loss: Loss = "linear",
    start: Curve[Any] | None = None,
    tol: float = 1e-3,
    max_iter: int = 50,
    extrapolate: Extrapolate = None,
    on_failure: OnFailure = "raise",
    progress: Progress | None = None,
    skipna: bool = False,
) -> AnySmoothingSpline:
    r"""Fit a C² curve to measurements of any kind, such as points, rates, directions and accelerations.

    The curve minimises the sum of squared residuals of all measurements in standard deviations, plus λ times the
    integrated squared acceleration or jerk. Unknown constants, such as the bias of a gyroscope, are estimated together
    with the curve.

    Parameters
    ----------
    measurements : sequence of measurements
        Objects of `symspline.measure`. Each has its own times.
    knots : int, array_like or "auto"
        Knots of the curve: their number, or an increasing array whose range includes all times. With ``"auto"``, they
        are as dense as the motion requires: intervals are halved until the residuals agree with those of the initial
        curve, and until further knots do not change the estimate. With a number or ``"auto"``, knots are added in gaps
        of the data, as close together as those next to the gap.
    space : Space or str
        A space or its name. On ``se:3``, rotations and positions are estimated, each with its own λ, and the curve is
        the spline of the space through the estimated poses.
    penalty : {"acceleration", "jerk"}, optional
        The derivative whose squared integral is the penalty. The default is ``"jerk"`` if `BodyRates` or `Velocities`
        are among the measurements, and ``"acceleration"`` otherwise. Use ``"jerk"`` for vehicles and accelerometers.
    lam : float, "adaptive", array_like or tuple, optional
        Weight λ ≥ 0 of the penalty, for products and poses also a tuple with one entry per part. None, the default,
        lets `criterion` choose λ. With ``"adaptive"``, λ varies along the curve if the measurements require it, as for
        `make_smoothing_spline`. The standard deviations of the sensors are then taken as known. An array has one value
        per segment between given knots.
    criterion : {"reml", "gcv", "cp"}, optional
        Criterion for λ, as for `make_smoothing_spline`. The default is ``"reml"``, and ``"gcv"`` for a single `Points`
        term. Cross-validation smooths slow effects such as biases away where sensors differ in number and accuracy,
        and the covariance does not contain that error. With ``"cp"``, the standard deviations must be right.
    gamma : float, default 1.2
        Weight of a degree of freedom in ``"gcv"``.
    loss : {"linear", "huber", "cauchy"}, default "linear"
        Loss of measurements that do not have their own. The others limit the influence of outliers, which begins where
        the given standard deviations make a residual improbable.
    start : Curve, optional
        Initial curve on the space. By default it is computed from rates that are integrated and aligned with the
        measured attitudes, from points, or from directions.
    tol : float, default 1e-3
        The iteration ends when no point and no constant moves by more than this fraction of its standard deviation.
    max_iter : int, default 50
        Largest number of iterations.
    extrapolate, on_failure, progress : optional
        As for `CubicSpline`; `progress` receives the number of iterations and `max_iter`.
    skipna : bool, default False
        True to omit missing samples of each measurement, where the time or a number is NaN, NaT or masked. The
        attribute `measurements` of the curve does not contain them. `symspline.measure.Function` is not affected.

    Returns
    -------
    SmoothingSpline
        The curve, with its covariance. `parameters` holds the constants, `measurements` the data, and `residuals` one
        array per measurement in standard deviations. ``report.sigma`` is the ratio of the residuals to the given
        standard deviations, about 1 if these are right. For a single `Points` without `sigma`, it is the estimated
        standard deviation.

    Raises
    ------
    ValidationError
        If the input is invalid, a measurement lies outside the knots, or the measurements do not determine a constant.
    ConvergenceError
        If the iteration does not converge. Its attribute ``spline`` holds the last curve.

    Warns
    -----
    SmoothingWarning
        In these cases:

        - A chosen λ is at a bound.
        - The residuals of a sensor are not those of independent noise with its standard deviation (see Notes).
        - The curve is not close to the minimum, because it turns far between two knots.
        - Two different curves agree equally well with the measurements.
        - The body turns by more than half a turn between two given knots.
        - A gap in the data contains no given knots.

    See Also
    --------
    symspline.measure : Measurements.
    make_smoothing_spline : Fit a curve to points only.

    Notes
    -----
    The problem is linearised in frames :math:`E` that are parallel along the curve [1]_. If the curve moves by
    :math:`E\xi`, its velocity changes by :math:`E\xi'` and its acceleration by :math:`E\xi'' + R(\xi, \gamma')\gamma'`.
    The matrix is banded, with a border of one row per constant. The covariance is that of the linear problem. It uses
    the given standard deviations; without any, the noise level is estimated.

    The residuals of each measurement are examined after the fit. The checks are the mean square, corrected for the
    leverage; the lag-one autocorrelation; partial sums, which show jumps and drifts [2]_; outliers under least squares;
    the share rejected by a robust loss; and the distances of constants from their priors. Recordings without a fault
    fail a check about once in a thousand fits. Standard deviations that are wrong by less than 10 % are not reported.
    Measurements with fewer than five times are not examined.

    In long gaps in which no sensor measures, the standard deviations are calibrated as for `SmoothingSpline.std`: parts
    of the recording are predicted without the measurements of all sensors.

    If the curve turns by more than about one radian between two knots, the solution of the linearised problem may
    differ from the minimum. The distance is then computed in standard deviations, and reported if it exceeds 0.5.

    References
    ----------
    .. [1] T. D. Barfoot, State Estimation for Robotics, Cambridge University Press (2017), Section 3.4.

    .. [2] W. Ploberger, W. Krämer, The CUSUM test with OLS residuals, Econometrica 60 (1992).

    Examples
    --------
    A gyroscope with an unknown bias, and a few measured attitudes:

    >>> import numpy as np
    >>> import symspline as ss
    >>> rng = np.random.default_rng(0)
    >>> t, s = np.linspace(0, 5, 26), np.linspace(0, 5, 501)
    >>> truth = ss.rotations.from_rotation_vectors(np.sin(t)[:, None] * [0.0, 0.0, 1.0])
    >>> seen = ss.SpecialOrthogonal(3).exp(truth, 0.03 * ss.SpecialOrthogonal(3).random_tangent(rng, truth))
    >>> omega = np.cos(s)[:, None] * [0, 0, 1] + [0.1, 0, 0] + 0.02 * rng.standard_normal((501, 3))
    >>> curve = ss.estimate(
    ...     [
    ...         ss.measure.Points(t, seen, sigma=0.03),
    ...         ss.measure.BodyRates(s, omega, sigma=0.02, bias=ss.measure.Constant(3)),
    ...     ],
    ...     20,
    ...     "so:3",
    ... )
    >>> bias = curve.parameters["gyro bias"]
    >>> bool(np.all(np.abs(bias.value - [0.1, 0, 0]) < 4 * bias.std))
    True
    """
    space = space_named(space)
    refuse_functions(space, "curves are not estimated")
    refuse_quotients(space, "curves are not estimated")
    check_policies(extrapolate, on_failure, progress)
    if isinstance(measurements, Measurement):
        measurements = [measurements]
    if not isinstance(measurements, (list, tuple)):
        raise ValidationError(f"measurements must be a list of symspline.measure, not {short_repr(measurements)}")
    given, has_rates = list(measurements), False
    for i, measurement in enumerate(given):
        if not isinstance(measurement, Measurement):
            raise ValidationError(f"measurements[{i}] must be one of symspline.measure, not {short_repr(measurement)}")
        has_rates |= isinstance(measurement, (BodyRates, Velocities))
    if not given:
        raise ValidationError("there are no measurements")
    if checked_flag(skipna, "skipna"):
        given = [measurement_without_missing(measurement) for measurement in given]
    if penalty is None:
        penalty = "jerk" if has_rates else "acceleration"
    one_of(penalty, "penalty", "acceleration", "jerk")
    if criterion is not None:
        one_of(criterion, "criterion", "gcv", "reml", "cp")
    one_of(loss, "loss", "linear", "huber", "cauchy")
    gamma = checked_number(gamma, "gamma must be a number >= 1", lambda x: 1 <= x < np.inf)
    tol = checked_number(tol, "tol must be a number > 0", lambda x: 0 < x < np.inf)
    most = whole_number(max_iter, "max_iter", 1)
    spaces = smoothed_spaces(space)
    smoothness = read_smoothness(space, spaces, lam, ())
    lams = np.concatenate([given_lam.lam for given_lam in smoothness])
    axis, shown, data = _knots(knots, given)
    if len(given) == 1 and isinstance(given[0], Points) and _is_plain(given[0]) and start is None:
        return _smoothed(
            given[0],
            axis,
            shown,
            knots,
            space,
            lam,
            loss,
            criterion=criterion or "gcv",
            gamma=gamma,
            penalty=penalty,
            tol=tol,
            max_iter=most,
            extrapolate=extrapolate,
            on_failure=on_failure,
            progress=progress,
        )
    terms = _terms(given, axis, space, loss)
    constants = _constants(terms)
    times = axis.knots(shown)
    _check_range(terms, times)
    if penalty == "jerk" and len(times) < 4:
        raise ValidationError(f"penalty='jerk' needs at least 4 knots, but there are {len(times)}")
    check_profiles(smoothness, len(times) - 1, "the knots")
    setup = Setup(
        *(
            spaces,
            times,
            terms,
            constants,
            penalty,
            criterion or "reml",
            gamma,
            tol,
            lams,
            most,
            isinstance(knots, str),
        ),
        adapts=tuple(given_lam.adapts for given_lam in smoothness),
        profiles=tuple(None if part.profile is None else part.profile[0] for part in smoothness),
    )
    begin = Starts(setup, space, axis, start)
    if isinstance(knots, str):
        shown, setup, search = automatic(setup, begin, axis, shown, data, progress)
    else:
        search = solved(setup, begin, progress)
        warn_of_turns(setup, shown)
        warn_of_gaps(shown, times, data)
    setup, solution = with_varying_lams(setup, search.solution, progress)
    search = search._replace(solution=solution)
    return _curve(setup, search, given, space, axis, shown, extrapolate, on_failure)


def _is_plain(points: Points) -> bool:
    """Whether the points are data of `make_smoothing_spline`."""
    return points.time_offset is None and points.factor is None


def _smoothed(
    given: Points,
    axis: TimeAxis,
    shown: Array,
    knots: TimesLike,
    space: AnySpace,
    lam: Numbers | None,
    loss: Loss,
    **options: Any,
) -> PointsSpline[Any]:
    """Fit points only, as a smoothing spline whose weights are the inverse variances."""
    # Without sigma the noise level is estimated, and the weights are relative.
    weighted = given if given.sigma is not None else given._with_sigma(1.0)
    terms = cast(list[PointTerm], _terms([weighted], axis, space, loss))
    t, _ = times_of(given.t, "measurements[0].t")
    order = np.argsort(as_array(t, "measurements[0].t"), kind="stable")

    def in_order(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(in_order(part) for part in value)
        array = None if value is None else as_array(value, "measurements[0]")
        return value if array is None or array.shape[:1] != order.shape else array[order]

    # Convert objects of other libraries to arrays.
    parts = parts_of(given.y, space, "measurements[0].y")
    arrays = tuple(
        factor._array(part, "measurements[0].y") for factor, part in zip(factors_of(space), parts, strict=True)
    )
    y = arrays if isinstance(space, Product) else arrays[0]
    weights, frames, sigma = given.weights, given.frames, None
    if given.sigma is not None:
        # The residuals in the objective are in standard deviations, so that their noise has variance one.
        precisions = grouped(space, [term.precision(len(order)) for term in terms])
        of_factors = tuple(of_factor[0] if len(of_factor) == 1 else tuple(of_factor) for of_factor in precisions)
        weights, frames, sigma = of_factors if isinstance(space, Product) else of_factors[0], None, 1.0
    fitted = make_smoothing_spline(
        in_order(t),
        in_order(y),
        space,
        lam,
        weights=in_order(weights),
        frames=in_order(frames),
        knots=None if isinstance(knots, str) else shown,
        sigma=sigma,
        loss=given.loss or loss,
        **options,
    )
    return PointsSpline.of(fitted, given, terms)


def _knots(knots: TimesLike, given: list[Measurement]) -> tuple[TimeAxis, Array, Doubles]:
    """Return the time axis, the knots as the user sees them, and all times of the measurements."""
    arrays, zone = [], None
    for i, measurement in enumerate(given):
        times, zone_of_times = times_of(measurement.t, f"measurements[{i}].t")
        zone = zone or zone_of_times
        array = as_array(times, f"measurements[{i}].t")
        if array.ndim != 1 or not len(array):
            raise ValidationError(f"measurements[{i}].t has shape {array.shape}, but shape (n,) is needed")
        if array.dtype.kind not in "iufbMm":
            raise ValidationError(f"measurements[{i}].t must be numbers or datetime64, not {array.dtype}")
        bad = np.flatnonzero(~np.isfinite(array))
        if len(bad):
            remedy = "" if np.isinf(array[bad[0]]) else SKIPNA
            raise ValidationError(f"measurements[{i}].t[{bad[0]}] is {array[bad[0]]}, but times must be finite{remedy}")
        # For points alone, `make_smoothing_spline` issues this warning.
        if len(given) > 1 or not isinstance(measurement, Points) or not _is_plain(measurement):
            warn_of_rounded_times(np.sort(array), f"measurements[{i}].t")
        arrays.append(array)
    if len({array.dtype.kind in "Mm" for array in arrays}) > 1:
        raise ValidationError("some measurements have dates and others have numbers as times. Use one of them.")
    if isinstance(knots, str) and knots != "auto":
        raise ValidationError(f"knots must be a number, an array or 'auto', not {short_repr(knots)}")
    union = np.unique(np.concatenate(arrays))
    if isinstance(knots, str) or (isinstance(knots, (int, np.integer)) and not isinstance(knots, bool)):
        if len(union) < 2:
            raise ValidationError("the measurements have one time only. A curve needs measurements at two or more.")
        # The other measurements are compared with this zone when their times are read.
        axis, shown = time_axis_of(Moments(union, zone))
        times = axis.knots(shown)
        if isinstance(knots, str):
            first = first_knots(times[0], times[-1])
            return axis, shown_times(axis, shown, first), times[merged(times, len(times))]
        count = int(knots)
        if not 2 <= count <= _MOST_KNOTS:
            raise ValidationError(f"knots must be from 2 to {_MOST_KNOTS}, not {count}")
        index = merged(times, count)
        shown, times = shown[index], times[index]
        if count > len(index):
            return axis, _even(shown, count), times
        chosen = thin_knots(Knots(shown, times), count)
        with_gaps = filled(chosen.times, times)
        if len(with_gaps) > len(chosen.times):
            return axis, shown_times(axis, shown, with_gaps), times
        return axis, chosen.t, times
    array = as_array(times_of(knots, "knots")[0], "knots")
    if array.ndim != 1 or len(array) < 2:
        raise ValidationError(f"knots has shape {array.shape}, but an increasing array of at least two is needed")
    axis, shown, times = knots_of(knots, (), len(array))
    back = np.flatnonzero(~(np.diff(times) > 0))
    if len(back):
        raise ValidationError(f"knots[{back[0] + 1}] is not after knots[{back[0]}], but knots must increase")
    data = np.empty(0)
    # Times that do not match the knots raise a more specific error later.
    with contextlib.suppress(ValidationError):
        data, _ = axis.at(union, (), False)
    return axis, shown, data


def _even(union: Array, count: int) -> Array:
    """Return equally spaced knots from the first to the last time."""
    fraction = np.linspace(0, 1, count)
    whole = union.dtype.kind in "Mm"
    step = (union[-1] - union[0]).astype(np.float64) * fraction if whole else (union[-1] - union[0]) * fraction
    middle: Array = union[0] + (step.astype(np.int64).astype((union[-1] - union[0]).dtype) if whole else step)
    return middle


def _terms(given: list[Measurement], axis: TimeAxis, space: AnySpace, loss: Loss) -> list[Term]:
    terms: list[Term] = []
    for i, measurement in enumerate(given):
        label = f"measurements[{i}]"
        try:
            times, _ = axis.at(measurement.t, (), False)
        except ValidationError as error:
            raise ValidationError(f"{label}.t: {error}") from None
        terms += bind(measurement, label, np.ascontiguousarray(times), space, loss)
    return terms


def _constants(terms: list[Term]) -> dict[str, Constant]:
    constants: dict[str, Constant] = {}
    for term in terms:
        for name, constant in term.constants.items():
            if constants.setdefault(name, constant) is not constant:
                raise ValidationError(
                    f"two different constants have the name {name!r}. Pass Constant(..., name=...), or the same object "
                    "if they are equal."
                )
    return constants


def _check_range(terms: list[Term], times: Doubles) -> None:
    for term in terms:
        bad = np.flatnonzero((term.times < times[0]) | (term.times > times[-1]))
        if len(bad):
            where = "before the first" if term.times[bad[0]] < times[0] else "after the last"
            raise ValidationError(
                f"{term.label}.t[{bad[0]}] is {where} knot. Extend the knots, or leave that measurement out "
                f"({len(bad)} of {len(term.times)} are outside)."
            )


# ---- the result ----


def _curve(
    setup: Setup,
    search: Search,
    given: list[Measurement],
    space: AnySpace,
    axis: TimeAxis,
    shown: Array,
    policy: Extrapolate,
    on_failure: OnFailure,
) -> AnySmoothingSpline:
    solution = search.solution
    if not solution.failure:
        ratio = audit(setup, solution)
        if not setup.least_squares:
            # The sum of squares in the iteration contains the weights of the robust loss.
            solution = solution._replace(reports=[replace(report, sigma=ratio) for report in solution.reports])
    factors = factors_of(space)
    parts, ends = [], []
    bc_type: Any = setup.bc_type
    for factor, points in zip(factors, grouped(space, solution.points), strict=True):
        doubles = np.ascontiguousarray(factor._as_doubles(join(factor, points)))
        parts.append(CorePoints(doubles, 0.0, (), len(setup.knots)))
        ends.append(read_ends(bc_type, factor, ())[0])
    through = fit(FitProblem(space, setup.knots, parts, ends, DEFAULTS, check=False))
    parameters = {
        name: Parameter(solution.values[name], solution.covariance[at, at]) for name, at in setup.columns.items()
    }
    fitted: EstimatedSpline[Any] = EstimatedSpline._fitted(axis, shown, through.curve, bc_type, policy, through)
    gaps, residuals = [], []
    for number in range(len(setup.spaces)):
        gaps.append(long_gaps(setup, solution, number))
    for i in range(len(given)):
        residuals.append(_residuals_of(setup, solution, f"measurements[{i}]"))
    smoothed = in_parts(solution.posterior, solution.reports, setup.spaces, setup.profiles)
    curve = fitted._with_results(smoothed, parameters, gaps, tuple(given), tuple(residuals))
    if solution.failure:
        hints = unit_hints(setup.terms)
        raise_or_warn([Fault(0, UNCONVERGED, " ".join([solution.failure, *hints]))], on_failure, curve)
    search.warn_of_rival(shown)
    for i, one in enumerate(given):
        if isinstance(one, Points) and not isinstance(one.y, tuple):
            warn_of_held_points(np.asarray(one.t), [np.asarray(one.y)], (), SmoothingWarning, f"measurements[{i}].y")
    # Parabolas have no jerk, so that the largest λ does not need a warning.
    chosen = []
    for lam, report in zip(setup.lams, solution.reports, strict=True):
        is_parabola = setup.penalty == "jerk" and report.df < _PARABOLA
        chosen.append(np.asarray(np.isnan(lam) and not is_parabola))
    warn_of_bounds(space, list(solution.reports), chosen, [np.asarray(np.inf)] * len(setup.spaces))
    return curve


def _residuals_of(setup: Setup, solution: Solution, label: str) -> Doubles | tuple[Doubles, ...]:
    """Return the residuals of one measurement, which has one term per part of the space."""
    of_parts = [rows.residuals for term, rows in zip(setup.terms, solution.rows, strict=True) if term.label == label]
    return of_parts[0] if len(of_parts) == 1 else tuple(of_parts)

"""Test whether each sensor of an estimate agrees with its standard deviations, and suggest causes if it does not."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.faults import warn
from .._curves.ends import end_kinds
from .._smoothing import SmoothingWarning
from .._smoothing.audit import DEGREES, Residuals, Sensor, advice, corner_of, described, examine
from .._smoothing.report import Posterior
from .._spaces import Array, Doubles
from ..measure import GRAVITY
from .problem import (
    ForceTerm,
    FunctionTerm,
    PointTerm,
    RateTerm,
    Rows,
    Setup,
    Solution,
    Term,
    distance_from_minimum,
)

# Number of measurements of a sensor in the estimate of its mean leverage.
_SAMPLE = 64
# Improbable distance from the centre of a prior, in standard deviations of the prior.
_PRIOR = 4.0
# Distance from the minimum, in standard deviations, beyond which a warning is issued.
_DISTANCE = 0.5
# Largest difference of the logarithm of a ratio of sizes from that of two units.
_SIMILAR = 0.6
# If the time spans of two sensors differ by this factor, their units of time differ or they hardly overlap.
_SPANS = 100.0


def audit(setup: Setup, solution: Solution) -> float:
    """Issue one warning that names all sensors and constants that do not agree with their standard deviations.

    Returns
    -------
    float
        Ratio of all residuals to their standard deviations, hardly affected by outliers under a robust loss.
    """
    failed, known = [], []
    for sensor in examined(setup, solution):
        finding = sensor.finding
        if finding.failed:
            failed.append(sensor)
        if np.isfinite(finding.ratio):
            known.append((finding.ratio, finding.freedom))
    complaints = [*map(described, failed), *_of_priors(setup, solution)]
    if complaints:
        remedies = unit_hints(setup.terms) or advice(failed)
        warn(
            "The residuals do not agree with the given standard deviations, so that the curve and its covariance may "
            f"be wrong. {' '.join([*complaints, *remedies])}",
            SmoothingWarning,
        )
    ratios, freedoms = np.array(known).reshape(-1, 2).T
    freedom = freedoms.sum()
    distance = distance_from_minimum(setup, solution)
    if distance > _DISTANCE:
        warn(
            f"The curve is {distance:.2g} standard deviations from the minimum of its objective. It turns by "
            f"up to {solution.turn:.2g} rad between two knots, where the linearised problem is inaccurate. Pass more "
            "knots.",
            SmoothingWarning,
        )
    return float(np.sqrt((ratios**2 * freedoms).sum() / freedom)) if freedom else float("nan")


def examined(setup: Setup, solution: Solution) -> list[Sensor]:
    """Examine all sensors."""
    sensors = []
    leverages = _leverages(setup, solution)
    labels = [term.label for term in setup.terms]
    for term, term_rows, (leverage, between) in zip(setup.terms, solution.rows, leverages, strict=True):
        order = np.argsort(term.times, kind="stable")
        rows = term.informative(term_rows.residuals)[order]
        entries = max(1, int(np.isfinite(rows).sum()))
        corner = corner_of(term.loss, term_rows.residuals.shape[1])
        exact = not isinstance(term, FunctionTerm)
        given = Residuals(rows, leverage / entries, between / entries, term.loss, corner, exact)
        name = f"{term.label} ({type(term.given).__name__})"
        if labels.count(term.label) > 1:
            name += f" on {' and '.join(repr(setup.spaces[part]) for part in term.parts)}"
        sensors.append(Sensor(name, term.label, term.rows[order], examine(given)))
    return sensors


def _leverages(setup: Setup, solution: Solution) -> list[tuple[float, float]]:
    """Return the sum of the leverages of each term, and for points the sum of the covariances between neighbours.

    The leverage of a measurement is the variance of its fitted value. That of all constants is at most their number.
    """
    # The leverage is that of the curve for known parameters.
    posterior, kinds = Posterior.of(*solution.posterior[:3]), end_kinds(setup.bc_type)
    m, result = posterior.size, []
    for term, term_rows in zip(setup.terms, solution.rows, strict=True):
        orders, constants = [], 0
        for nu, jacobian in enumerate(term_rows.jacobians):
            if jacobian is not None:
                orders.append(nu)
        for constant in term.constants.values():
            if constant.sigma is None:
                constants += constant.size
        n = len(term.times)
        order = np.argsort(term.times, kind="stable")
        some = np.unique(np.linspace(0, n - 1, min(n, _SAMPLE)).round().astype(int))
        x = np.clip(term.shifted_times(solution.values)[order], setup.knots[0], setup.knots[-1])

        def rows(at: NDArray[np.intp], orders: list[int], term_rows: Rows = term_rows, order: Array = order) -> Doubles:
            jacobians: list[Any] = term_rows.jacobians
            whole = np.concatenate([jacobians[nu][order[at]] for nu in orders], axis=-1)
            return whole if term_rows.roots is None else whole * term_rows.roots[order[at], :, None]

        def covariance(at: NDArray[np.intp], orders: list[int], others: Array | None = None, x: Doubles = x) -> Doubles:
            there = None if others is None else np.ascontiguousarray(x[others])
            return posterior.coupled(setup.knots, (), kinds, np.ascontiguousarray(x[at]), there, orders, np.arange(m))

        if not orders:
            result.append((float(constants), 0.0))
            continue
        whole = rows(some, orders)
        mean, between = float(((whole @ covariance(some, orders)) * whole).sum(axis=(1, 2)).mean()), 0.0
        if orders == [0] and n > 1:
            first = some[some < n - 1]
            crossed = rows(first, [0]) @ covariance(first, [0], first + 1)
            between = float((crossed * rows(first + 1, [0])).sum(axis=(1, 2)).mean())
        result.append((n * mean + constants, n * between))
    return result


def _of_priors(setup: Setup, solution: Solution) -> list[str]:
    """Describe constants that are far from their priors."""
    complaints = []
    for name, constant in setup.constants.items():
        if constant.sigma is None:
            continue
        off = (solution.values[name] - constant.start) / constant.sigma
        if np.abs(off).max() > _PRIOR:
            complaints.append(
                f"The constant {name!r} is {solution.values[name].round(6).tolist()}, {np.abs(off).max():.2g} standard "
                "deviations from its prior. Check the units and the frame of its measurements, or pass a larger sigma "
                "for the constant."
            )
    return complaints


def unit_hints(terms: list[Term]) -> list[str]:
    """Describe measurements whose sizes suggest that their units differ from those of other measurements."""
    hints = []
    spans = [float(np.ptp(term.times)) for term in terms]
    long = int(np.argmax(spans))
    for term, span in zip(terms, spans, strict=True):
        if len(term.times) > 20 and span * _SPANS < spans[long]:
            hints.append(
                f"The times of {term.label} span {span:.3g}, but those of {terms[long].label} span {spans[long]:.3g}: "
                "check the unit of the times."
            )
    for term in terms:
        if isinstance(term, RateTerm):
            points = [
                points_term
                for points_term in terms
                if isinstance(points_term, PointTerm) and points_term.roots is None and points_term.parts == term.parts
            ]
            ratio = _rates_over_steps(term, points)
            if ratio is not None and abs(np.log(ratio / DEGREES)) < _SIMILAR:
                hints.append(
                    f"The rates of {term.label} are {ratio:.2g} times as large as those between the points: pass "
                    "radians instead of degrees per unit of time."
                )
        if isinstance(term, ForceTerm):
            size, g = (float(np.median(np.linalg.norm(vectors, axis=-1))) for vectors in (term.f, term.gravity[None]))
            if size > 0 and g > 0 and abs(np.log(size * -GRAVITY[2] / g)) < _SIMILAR:
                hints.append(
                    f"The specific force of {term.label} is {size:.2g}, but gravity is {g:.3g}: pass it in the units "
                    "of `gravity` instead of multiples of g."
                )
    return list(dict.fromkeys(hints))


def _rates_over_steps(term: RateTerm, points: list[PointTerm]) -> float | None:
    """Return the ratio of the measured rates to those between neighbouring points; None if it is unknown."""
    if not points or not term.body.is_rotation:
        return None
    times = np.concatenate([term.times for term in points])
    order = np.argsort(times, kind="stable")
    y, t = np.concatenate([term.y for term in points])[order], times[order]
    step = np.diff(t)
    used = step > 0
    if not used.any():
        return None
    space = term.body.space
    unit = 2.0 if space.point_shape == (4,) else 1.0
    rates = unit * np.asarray(space._apply("distance", p=y[:-1], q=y[1:]))[used] / step[used]
    # The median excludes long steps, which may contain whole turns, and short ones, where noise dominates.
    expected, measured = float(np.median(rates)), float(np.median(np.linalg.norm(term.omega, axis=-1)))
    return measured / expected if expected > 0 and measured > 0 else None

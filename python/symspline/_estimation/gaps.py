"""Long gaps in which no sensor measures a part of an estimated curve, with the factors of its bands there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._curves.ends import end_kinds
from .._smoothing.gaps import Calibration, Course, SensorEvidence, calibrate
from .._smoothing.posterior import Posterior
from .._spaces import Doubles
from .solve import Setup, Solution
from .start import scales_of
from .terms import InformationTerm, PointTerm

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
    each = [(float(start), float(stop), float(factor), int(blocks)) for start, stop, factor, blocks in gaps]
    return LongGaps(each, float(width), (float(at_data[0]), float(at_data[1])))


def _course(order: int, lam: float, variance: Variance) -> Course:
    return Course(order, lam, variance, lambda _: np.zeros((2, 2)), 0.0)


def long_gaps(setup: Setup, found: Solution, part: int) -> LongGaps | None:
    """Return the long gaps of a part, or None if there are none or the part has no points that can be predicted."""
    terms = [k for k, term in enumerate(setup.terms) if part in term.parts]
    points = [k for k in terms if isinstance(setup.terms[k], (PointTerm, InformationTerm))]
    lam = float(found.reports[part].lam)
    if found.failure or not points or not 0 < lam < np.inf:
        return None
    each = [np.clip(setup.terms[k].shifted_times(found.values), setup.knots[0], setup.knots[-1]) for k in terms]
    weights = [_weights(setup, k) if k in points else np.zeros(len(x)) for k, x in zip(terms, each, strict=True)]
    order = np.argsort(np.concatenate(each), kind="stable")
    times, weight = np.concatenate(each)[order], np.concatenate(weights)[order]
    if not np.ptp(times) > 0:
        return None

    space, kinds = setup.spaces[part], end_kinds(setup.bc_type)
    posterior = _posterior(setup, found, sum(own.dim for own in setup.spaces[:part]))

    def evidence() -> SensorEvidence:
        return _evidence(setup, found, part, terms, order, times, weight)

    def variance(x: Doubles, nu: int) -> Doubles:
        whole = posterior.covariance(space, setup.knots, (), kinds, np.ascontiguousarray(x), None, [nu])
        return np.asarray(np.trace(whole, axis1=1, axis2=2) / space.dim)

    course = _course(3 if setup.penalty == "jerk" else 2, lam, variance)
    result = calibrate(times, weight, course, np.nan, evidence, ends=False)
    return LongGaps(result.gaps, result.width, (result.at_data(0), result.at_data(1))) if result.gaps else None


def _posterior(setup: Setup, found: Solution, first: int) -> Posterior:
    band, side, corner = found.matrices
    return Posterior(band, np.zeros((0, 0)), sum(space.dim for space in setup.spaces), side, corner, first)


def _weights(setup: Setup, k: int) -> Doubles:
    term = setup.terms[k]
    assert isinstance(term, (PointTerm, InformationTerm))
    return np.asarray(scales_of(term) ** -2.0)


def _evidence(
    setup: Setup,
    found: Solution,
    part: int,
    terms: list[int],
    order: NDArray[np.intp],
    times: Doubles,
    weights: Doubles,
) -> SensorEvidence:
    """Return the linearised measurements of a part, in the order of time."""
    kinds, size = end_kinds(setup.bc_type), sum(space.dim for space in setup.spaces)
    parameters = sum(constant.size for constant in setup.constants.values())
    q = max(found.rows[k].residuals.shape[1] for k in terms)
    known = _posterior(setup, found, 0).known((), kinds)
    factors, sides, residuals, counts = [], [], [], []
    for k in terms:
        term, own = setup.terms[k], found.rows[k]
        (n, d), dim = own.residuals.shape, setup.spaces[part].dim
        x = np.clip(term.shifted_times(found.values), setup.knots[0], setup.knots[-1])
        rows = np.zeros((n, q, 4 * size))
        for nu, columns in enumerate(own.jacobians):
            if columns is not None:
                of_curve = _core.coefficient_factors(setup.knots, kinds, x, nu)[1]
                rows[:, :d] += np.einsum("ndm,nk->ndkm", columns, of_curve).reshape(n, d, -1)
        of_parameters, left = np.zeros((n, q, parameters)), np.zeros((n, q))
        of_parameters[:, :d] = 0.0 if own.parameters is None else own.parameters
        left[:, :d] = -own.residuals
        scale = 1.0 if own.roots is None else own.roots
        factors.append(rows * np.asarray(scale)[..., None])
        sides.append(of_parameters * np.asarray(scale)[..., None])
        residuals.append(left * scale)
        near = np.ones(n, bool)
        if term.loss != "linear":
            near = np.sum(own.residuals**2, axis=1) <= _core.chi_squared(dim, _KEPT)
        counts.append(near & isinstance(term, (PointTerm, InformationTerm)))
    firsts = _core.coefficient_factors(setup.knots, kinds, times, 0)[0]
    return SensorEvidence(
        setup.knots,
        known,
        times,
        firsts,
        np.concatenate(factors)[order],
        np.concatenate(sides)[order],
        np.concatenate(residuals)[order],
        np.concatenate(counts)[order],
        weights,
        setup.spaces[part].dim,
    )

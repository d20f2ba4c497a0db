"""Calls of the compiled core that compute the points of a smooth curve from noisy data."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.arrays import refuse, short_repr
from .._base.faults import UNCONVERGED, Fault
from .._base.report import long_gaps
from .._base.typing import Progress
from .._core import ValidationError
from .._curves.ends import End
from .._curves.reduced import reduced
from .._spaces import Array, Doubles, Space
from .data import SmoothingData
from .knots import NO_CURVE, TOO_FEW, Knots
from .outliers import Outliers
from .posterior import Posterior
from .precision import Precision
from .report import METHODS, SmoothingReport
from .starts import Column, Raw, Samples, best_of_starts

_STATES = ("converged", "unconverged", "no curve", "undetermined", "unsettled")


class Smoothed(NamedTuple):
    """Properties of the smoothing in one space.

    Attributes
    ----------
    report : SmoothingReport
        Report.
    band : ndarray, shape (..., K, 4), or (..., K + 2, 4) for closed curves
        Band of A⁻¹, from which the variances of the curve for noise of variance one follow.
    band_lam : float or ndarray
        The λ that belongs to `band`; for a robust loss, that of the pseudo-data.
    sigma : float or ndarray
        Standard deviation of one coordinate that scales the bands, estimated or given.
    posterior : Posterior or None
        Matrix from which covariances and samples follow; None for curves from files of older versions.
    between : bool
        Whether the variance between the knots is included. It is if there is a knot at every time of the data: the
        curve is then the mean of a process. With other knots it is a spline, which has no such freedom.
    penalty, loss : str
        Penalty and loss of the fit.
    outliers : Outliers or None
        Outcome of the rejection of data, for warnings. Curves that a user has do not have it.
    minima : ndarray of int or None
        Kinds of the minima, see `best_of_starts`, likewise.
    """

    report: SmoothingReport
    band: Doubles
    band_lam: Any
    sigma: Any
    between: bool
    posterior: Posterior | None = None
    penalty: str = "acceleration"
    loss: str = "linear"
    outliers: Outliers | None = None
    minima: NDArray[np.int_] | None = None

    def map(self, function: Any) -> Smoothed:
        """Apply a function to all arrays, such as the selection of some curves, and omit what is for warnings only."""
        return self._replace(
            report=self.report.map(function),
            band=function(self.band),
            band_lam=function(self.band_lam),
            sigma=function(self.sigma),
            posterior=self.posterior and self.posterior.map(function),
            outliers=None,
            minima=None,
        )


class SolverOptions(NamedTuple):
    """Options of the smoothing. The core validates the words."""

    criterion: str
    gamma: float
    penalty: str
    loss: str
    method: str
    tol: float
    max_iter: int
    raise_lam: bool


def smoothed(
    space: Space,
    points: Array,
    precision: Precision,
    lam: Doubles,
    sigma: Doubles,
    ends: list[End] | None,
    noisy: SmoothingData,
    knots: Knots,
    options: SolverOptions,
    between: bool,
    progress: Progress | None,
) -> tuple[Array, Smoothed, list[Fault]]:
    """Compute the points of smooth curves at the knots, in a space that is not a product."""
    small, inside, span = reduced(space, points)
    batch = noisy.batch
    if span is not None and any(vector is not None for _, vector in ends or []):
        raise ValidationError(f"the dimension of {space!r} is too large for end velocities. Use natural ends.")
    matrices = precision.information
    if matrices is not None:
        matrices = np.ascontiguousarray(np.broadcast_to(matrices, (*batch, *matrices.shape[-3:])))
    t, y, at = (np.ascontiguousarray(x) for x in (noisy.times, small._as_doubles(inside), knots.times))
    weights = precision.weights

    def solve(lam: Doubles, start: Doubles | None) -> Raw:
        return Raw(
            *_core.smooth(small._handle, t, y, weights, matrices, at, lam, sigma, ends, *options, start, progress)
        )

    samples = Samples(t, small._numbers(y), weights, at, len(small.point_shape), ends is None)
    (found, band, columns, (matrix, turn, size)), minima = best_of_starts(small, samples, lam, solve)
    state, iterations, lams, band_lam, at_bound, df, noise, step, rate, _, exact, selection, rejected, _, scale = (
        column.reshape(batch) if batch else column[0].item()
        for column in (*columns, np.where(np.isnan(sigma), columns[Column.SIGMA], sigma))
    )
    report = SmoothingReport(METHODS[int(np.any(exact))], state == 0, iterations, step, rate, lams, at_bound, df, noise)
    numbers = small._numbers(found)
    faults = [
        Fault(number, UNCONVERGED, _reason(_STATES[kind], number, report, options, noisy, precision, at.shape[-1]))
        for number, kind in enumerate(np.ravel(state).tolist())
        if kind
    ]
    on_space = numbers if span is None else span.embed(numbers)
    # Coordinates in a span of lower dimension are not those of the space.
    posterior = Posterior.of(matrix, turn, size) if span is None or size == 1 else None
    outliers = Outliers(selection, rejected)
    options_of_fit = options.penalty, options.loss
    noise = Smoothed(report, band, band_lam, scale, between, posterior, *options_of_fit, outliers, minima)
    return on_space, noise, faults


def _reason(
    state: str,
    number: int,
    report: SmoothingReport,
    options: SolverOptions,
    noisy: SmoothingData,
    precision: Precision,
    knots: int,
) -> str:
    if state == "no curve":
        return (
            f"The smoothing{{of}} led to points that {NO_CURVE}: the curve turns too far between two knots. Pass more "
            "knots in the gaps of the data, a larger lam, or cut the recording at its gaps (symspline.fit_segments). "
            "Check units and signs of the data."
        )
    if state == "undetermined" and options.penalty == "jerk":
        weights = np.broadcast_to(precision.weights, (*noisy.batch, precision.weights.shape[-1]))
        has_weight = weights.reshape(-1, weights.shape[-1])[number] > 0
        used = int(has_weight.sum())
        if used < 3:
            return f"The data{{of}} do not determine the curve: penalty='jerk' {TOO_FEW}, not {used}."
        if not has_weight.all():
            return (
                f"The data{{of}} do not determine the curve: for penalty='jerk', too many of the {knots} knots have no "
                "data near them. Remove the times before the first and after the last datum with a nonzero weight. If "
                f"there is a gap between the data, pass fewer knots, for example knots={max(knots // 6, 10)}."
            )
    if state == "undetermined":
        return (
            "The data{of} do not determine the curve. With lam=0 there must be data near every knot: pass fewer "
            "knots. Otherwise the weights differ by more than the precision of floating-point numbers: remove data "
            "with tiny weights."
        )
    lam, step, iterations = (np.ravel(x)[number] for x in (report.lam, report.step, report.iterations))
    if state == "unsettled":
        return (
            f"The choice of lam{{of}} did not converge; its last value is {lam:.3g}. Pass this lam, or another "
            "criterion."
        )
    other = "" if options.method == "newton" else " or pass method='newton'"
    gap = _longest_gap(number, noisy, precision)
    return (
        f"No convergence of the smoothing{{of}}: the last step is {step:.1e} standard deviations after "
        f"{iterations} iterations (tol {options.tol:.1e}). {gap}Raise max_iter{other}."
    )


def _longest_gap(number: int, noisy: SmoothingData, precision: Precision) -> str:
    """Describe the longest gap between the data of a curve, if it is far longer than most."""
    t, times, weights = (
        np.broadcast_to(own, (*noisy.batch, own.shape[-1])).reshape(-1, own.shape[-1])[number]
        for own in (noisy.t, noisy.times, precision.weights)
    )
    t = t[weights > 0]
    different, index = np.unique(times[weights > 0], return_index=True)
    if len(index) < 3 or not long_gaps(different).any():
        return ""
    longest = int(np.diff(different).argmax())
    first, last = (short_repr(t[i]) for i in index[longest : longest + 2])
    return (
        f"No data determine how far the curve turns between t = {first} and {last}: cut the recording at such gaps "
        "(symspline.fit_segments). "
    )


def one_per_curve(value: Any, name: str, batch: tuple[int, ...], infinite: bool = False) -> Doubles:
    """Return a number >= 0 per curve, which may be infinite if `infinite` is True; NaN for None."""
    if value is None:
        return np.full(int(np.prod(batch)), np.nan)
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or array.shape not in ((), batch):
        own = f" or an array of shape {batch}" if batch else ""
        raise ValidationError(f"{name} must be a number{own}, not {short_repr(value)}")
    allowed = ">= 0" if infinite else "finite and >= 0"
    good = (array >= 0) & (infinite | np.isfinite(array))
    refuse(~good, name, lambda i: f"must be {allowed}, not {array[i]}")
    return np.ascontiguousarray(np.broadcast_to(array, batch), np.float64).ravel()

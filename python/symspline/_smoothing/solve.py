"""From noisy data to points of the smooth curve, in the compiled core."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._arrays import short_repr
from .._core import ValidationError
from .._curves.ends import End
from .._curves.reduced import reduced
from .._curves.solve import Progress
from .._faults import UNCONVERGED, Fault
from .._spaces import Array, Space
from .data import Knots, SmoothingData
from .precision import Precision
from .report import SmoothingReport

Doubles = NDArray[np.float64]

# Part of the message where a smoothing ended without a curve.
NO_CURVE = "no spline joins"
_STATES = ("converged", "unconverged", "no curve", "undetermined", "unsettled")


class Smoothed(NamedTuple):
    """What is kept of the smoothing in one space.

    Attributes:
        band: the band of A⁻¹, shape (..., K, 4), (..., K + 2, 4) for closed curves: variances of the curve, at noise of
            variance one.
        band_lam: the λ that goes with it, that of the pseudo-data of a robust loss.
        sigma: the standard deviation of a coordinate by which bands are scaled, estimated or known.
        between: whether the curve is the mean of a process that is free between its knots, as it is with a knot at
            every time of the data; with knots of a user it is a spline, which is not.
    """

    report: SmoothingReport
    band: Doubles
    band_lam: Any
    sigma: Any
    between: bool

    def map(self, function: Any) -> Smoothed:
        """The same for a part of a batch."""
        return Smoothed(
            self.report.map(function),
            function(self.band),
            function(self.band_lam),
            function(self.sigma),
            self.between,
        )


class Asked(NamedTuple):
    """How to smooth; the core checks the words."""

    criterion: str
    gamma: float
    loss: str
    method: str
    tol: float
    max_iter: int
    raise_lam: bool


def smoothed(
    space: Space,
    noisy: SmoothingData,
    points: Array,
    weighing: Precision,
    knots: Knots,
    lam: Doubles,
    sigma: Doubles,
    ends: list[End] | None,
    asked: Asked,
    name: Callable[[int], tuple[int, str]],
    between: bool,
    progress: Progress | None,
) -> tuple[Array, Smoothed, list[Fault]]:
    """The points of smooth curves at the knots, in a space that is no product."""
    small, inside, span = reduced(space, points)
    batch = noisy.batch
    if span is not None and any(vector is not None for _, vector in ends or []):
        raise ValidationError(f"in as many dimensions as {space} has, end velocities cannot be given")
    matrices = weighing.information
    if matrices is not None:
        matrices = np.ascontiguousarray(np.broadcast_to(matrices, (*batch, *matrices.shape[-3:])))
    found, band, columns = _core.smooth(
        small._handle,
        np.ascontiguousarray(noisy.times),
        np.ascontiguousarray(small._as_doubles(inside)),
        weighing.weights,
        matrices,
        np.ascontiguousarray(knots.times),
        lam,
        sigma,
        ends,
        *asked,
        progress,
    )
    state, iterations, lams, band_lam, at_bound, df, noise, step, rate, _, exact = (
        column.reshape(batch) if batch else column[0].item() for column in columns
    )
    report = SmoothingReport(
        "newton" if np.any(exact) else "linearized",
        np.asarray(state) == 0 if batch else state == 0,
        iterations,
        step,
        rate,
        lams,
        at_bound,
        df,
        noise,
    )
    known = sigma.reshape(batch) if batch else sigma[0].item()
    scale = np.where(np.isnan(known), noise, known) if batch else noise if np.isnan(known) else known
    numbers = small._numbers(found)
    faults: list[Fault] = []
    for number, kind in enumerate(np.ravel(state).tolist()):
        if kind:
            there, of = name(number)
            faults.append(Fault(there, UNCONVERGED, _reason(_STATES[kind], of, number, report, asked)))
    return (
        numbers if span is None else span.embed(numbers),
        Smoothed(report, band, band_lam, scale, between),
        faults,
    )


def _reason(state: str, of: str, number: int, report: SmoothingReport, asked: Asked) -> str:
    if state == "no curve":
        return (
            f"The smoothing{of} led to points that {NO_CURVE}: the curve turns too far between two knots. Pass more "
            "knots in the gaps of the data, a larger lam, or cut the recording at its gaps (symspline.fit_segments). "
            "Check units and signs of the data."
        )
    if state == "undetermined":
        return (
            f"The data{of} do not determine the curve. With lam=0 every knot needs data beside it: give fewer knots. "
            "Otherwise the weights differ by more than the precision of floating-point numbers: leave out data of tiny "
            "weight."
        )
    if state == "unsettled":
        return (
            f"The smoothing{of} found no lam: it still moved after many rounds, last to "
            f"{np.ravel(report.lam)[number]:.3g}. Pass this lam, or another criterion."
        )
    step = np.ravel(report.step)[number]
    other = "" if asked.method == "newton" else " or pass method='newton'"
    return (
        f"No convergence of the smoothing{of}: a last step of {step:.1e} standard deviations after "
        f"{np.ravel(report.iterations)[number]} iterations (tol {asked.tol:.1e}). Raise max_iter{other}."
    )


def n_knots_for_df(df: Any) -> int:
    """How many knots are enough for so many degrees of freedom: with three times as many nothing is lost."""
    return 4 * int(np.ceil(np.max(df, initial=2.0, where=np.isfinite(df)))) + 8


def one_a_curve(value: Any, name: str, batch: tuple[int, ...]) -> Doubles:
    """A number >= 0 of each curve; NaN for None."""
    if value is None:
        return np.full(int(np.prod(batch)), np.nan)
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or array.shape not in ((), batch):
        own = f" or an array of shape {batch}" if batch else ""
        raise ValidationError(f"{name} must be a number{own}, not {short_repr(value)}")
    bad = ~(np.isfinite(array) & (array >= 0))
    if bad.any():
        index = np.argwhere(bad)[0].tolist() if array.ndim else ""
        raise ValidationError(f"{name}{index} must be finite and >= 0, not {array[bad].flat[0]}")
    return np.ascontiguousarray(np.broadcast_to(array, batch), np.float64).ravel()

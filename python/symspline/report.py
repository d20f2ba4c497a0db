"""What a fit says about itself."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Number = float | NDArray[np.float64]


class ConvergenceWarning(UserWarning):
    """A curve did not converge, or passes a cut locus, and ``on_failure="warn"``."""


class FarPointsWarning(UserWarning):
    """Most neighbours are so far apart that several C² curves may exist: the points may be in representations that do
    not fit each other."""


@dataclass(frozen=True)
class Report:
    """How a fit went. For a batch of curves every field but ``method`` and ``curvature`` is an array
    with the batch axes.

    Attributes:
        method: the solver that was used: ``"auto"`` tries quasi-newton, then newton, then the homotopy; of
            a batch the last that any curve needed. Where these fail, or points are far apart, ``"trust-region"``.
        converged: whether the residual is below the tolerance, or at the rounding floor (256 ε times
            the condition of the data), and all control legs are inside the cut locus. It is true of the curve:
            across the seam of a closed curve, too.
        iterations: how often the C² residual was evaluated.
        residual: the C² defect of a knot divided by 1/hᵢ₋₁ + 1/hᵢ, relative to the largest speed |u| (or to
            a thousandth of the largest distance over time between neighbours, if all speeds are smaller);
            the largest of all knots. At an end with not-a-knot it is the error of the velocity there, divided by
            1 + h₀/h₁.
        max_step: D of (21), the longest distance between neighbouring points.
        max_gap: the longest time between neighbouring points, in seconds for dates.
        curvature: K of (22).
        invariant_radius: the smallest V of (38): with all ‖h u/3‖ ≤ V, Algorithm 1 keeps them so
            (Theorem 3.1). None where the theorem says nothing, which is normal for points far apart, for
            unequal knots and other ends than natural ones and given velocities; NaN for such a curve of a
            batch. In a product the legs in every factor stay below the radius there, and together below the root
            of the sum of their squares, which is this.
        rate: mean contraction of the residual per iteration.
        alternative_energy: the least bending energy ∫ |∇γ'|² dt of other C² curves through the points that ``"auto"``
            found on its way: points far apart may have several. None where there was none; NaN for such a curve of a
            batch. Through the points of a product another curve has the alternative of one factor.
        velocity_error: on a `Manifold` a bound for the distance of the velocities at the knots from those of the exact
            C² curve, the largest norm of all knots, in units of velocity (per second for dates): see
            :doc:`/manifolds`. inf where there is no bound. None on symmetric spaces. In a product of manifolds the
            root of the sum of squares.
    """

    method: str
    converged: bool | NDArray[np.bool_]
    iterations: int | NDArray[np.int64]
    residual: Number
    max_step: Number
    max_gap: Number
    curvature: float
    invariant_radius: Number | None
    rate: Number
    alternative_energy: Number | None = None
    velocity_error: Number | None = None

    def __str__(self) -> str:
        converged = np.asarray(self.converged)
        if converged.size == 0:
            return f"no curves: {self.method}"
        residual, iterations = _worst(self.residual), np.max(self.iterations)
        if converged.ndim == 0:
            state = "converged" if converged else "NOT converged"
            many = ""
        else:
            state = f"{np.count_nonzero(converged)} of {converged.size} curves converged"
            many = "at most " if converged.size > 1 else ""
        return (
            f"{state}: {self.method}, {many}{iterations} iterations, residual {many}{residual:.1e}, "
            f"longest step {_worst(self.max_step):.3g}, contraction {_worst(self.rate):.2g}"
            f"{self._certificate()}{self._accuracy()}"
        )

    def _certificate(self) -> str:
        radius = self.invariant_radius
        if radius is None or np.isnan(radius).any():
            return ""
        return f", control legs stay below {np.max(radius):.3g} (Theorem 3.1)"

    def _accuracy(self) -> str:
        return "" if self.velocity_error is None else f", velocities within {_worst(self.velocity_error):.1e}"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Report):
            return NotImplemented
        names = [field.name for field in fields(self)]
        return all(_same(getattr(self, name), getattr(other, name)) for name in names)

    def map(self, function: Any) -> Report:
        """The report with a function applied to the fields that are per curve."""

        def known(value: Any) -> Any:
            part = None if value is None else function(value)
            return None if part is None or (np.ndim(part) == 0 and np.isnan(part)) else part

        return Report(
            self.method,
            function(self.converged),
            function(self.iterations),
            function(self.residual),
            function(self.max_step),
            function(self.max_gap),
            self.curvature,
            known(self.invariant_radius),
            function(self.rate),
            known(self.alternative_energy),
            known(self.velocity_error),
        )


def _worst(values: Any) -> Any:
    """The largest of those of curves whose points are good, which may be none."""
    return np.fmax.reduce(np.ravel(values))


def _same(a: Any, b: Any) -> bool:
    if a is None or b is None or isinstance(a, str):
        return bool(a == b)
    return np.array_equal(a, b, equal_nan=True)


# As the compiled core numbers them, in the order in which they are tried.
SOLVERS = ("fixed-point", "quasi-newton", "newton", "homotopy", "trust-region")


def combined(
    reports: Sequence[Report], max_step: Any, curvature: float, alternative_energy: Any = None
) -> Report:
    """The report of curves in a product, from those in its factors: the worst of each field, and what is of the
    whole."""

    def largest(name: str) -> Any:
        result: NDArray[Any] = np.max(np.stack([getattr(report, name) for report in reports]), axis=0)
        return result.item() if result.ndim == 0 else result

    # The theorem is about each factor by itself.
    radii = [report.invariant_radius for report in reports if report.invariant_radius is not None]
    together = len(radii) == len(reports)
    radius: Any = np.sqrt(np.sum(np.square(np.stack(radii)), axis=0))[()] if together else None
    errors = [report.velocity_error for report in reports if report.velocity_error is not None]
    error: Any = (
        np.sqrt(np.sum(np.square(np.stack(errors)), axis=0))[()] if len(errors) == len(reports) else None
    )
    converged: Any = np.all(np.stack([np.asarray(report.converged) for report in reports]), axis=0)
    return Report(
        method=max((report.method for report in reports), key=SOLVERS.index),
        converged=bool(converged) if np.ndim(converged) == 0 else converged,
        iterations=largest("iterations"),
        residual=largest("residual"),
        max_step=max_step,
        max_gap=largest("max_gap"),
        curvature=curvature,
        invariant_radius=radius,
        rate=largest("rate"),
        alternative_energy=alternative_energy,
        velocity_error=error,
    )


def longest_gap(times: NDArray[np.float64], batch: tuple[int, ...]) -> Any:
    """The longest time between neighbouring knots, shape of the batch axes."""
    longest = (times[..., 1:] - times[..., :-1]).max(axis=-1)
    return np.broadcast_to(longest, batch).copy() if batch else float(longest)


def shaped(
    columns: tuple[NDArray[Any], ...],
    times: NDArray[np.float64],
    batch: tuple[int, ...],
    curvature: float,
    method: str,
) -> Report:
    """A report from the compiled core's columns, of curves with these knots; ``method`` is what was asked for. Curves
    on manifolds made of functions have one column more, `Report.velocity_error`."""
    gap = longest_gap(times, batch)
    if batch == ():
        converged, iterations, residual, max_step, rate, last, *rest = [c.item() for c in columns]
        return Report(
            SOLVERS[last],
            converged,
            iterations,
            residual,
            max_step,
            gap,
            curvature,
            None if math.isnan(rest[0]) else rest[0],
            rate,
            *(None if math.isnan(value) else value for value in rest[1:]),
        )
    converged, iterations, residual, max_step, rate, solvers, *rest = [c.reshape(batch) for c in columns]
    used = SOLVERS[solvers.max()] if solvers.size else "quasi-newton" if method == "auto" else method
    radius, *others = (None if np.isnan(column).all() else column for column in rest)
    return Report(used, converged, iterations, residual, max_step, gap, curvature, radius, rate, *others)

"""What a fit says about itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Number = float | NDArray[np.float64]
# So many times the median is a long gap between points.
_LONG = 10
# As the compiled core numbers them, in the order in which they are tried.
SOLVERS = ("fixed-point", "quasi-newton", "newton", "homotopy", "trust-region")

# What stands in the fields of reports: one value per curve of a type, or one of a few words. An optional number is NaN
# where it is undefined, and the field is None where it is undefined for all curves.
BOOL, INT, FLOAT = ({"dtype": dtype} for dtype in (np.bool_, np.int64, np.float64))
_MAYBE = FLOAT | {"optional": True}


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
            (Theorem 3.1). None where the theorem does not apply, which is normal for points far apart, for
            unequal knots and other ends than natural ones and given velocities; NaN for such a curve of a
            batch. In a product the legs in every factor stay below the radius there, and together below the root
            of the sum of their squares, which is this.
        contraction_bound: a bound α < 1 on the contraction of Algorithm 1 per sweep in that region, in the largest
            length of a velocity. With it the region holds exactly one C² curve, and Algorithm 1 converges to it from
            zero velocities. None (NaN in a batch) where the theorem does not apply, or K D > 0.26058. Of a product, the
            largest of its factors.
        guaranteed_sweeps: the number of sweeps of Algorithm 1 after which all ‖h u/3‖ are, by this bound, within
            ``tol`` times ``invariant_radius`` of those of the curve. None (NaN in a batch) where there is no bound.
        rate: mean contraction of the residual per iteration.
        alternative_energy: the least bending energy ∫ |∇γ'|² dt of other C² curves through the points that ``"auto"``
            found on its way: points far apart may have several. None where there was none; NaN for such a curve of a
            batch. Through the points of a product another curve has the alternative of one factor.
        skipped: solvers that ``"auto"`` left out, or stopped early, because they would have cost too much; of a batch
            those of any curve. The search for other curves costs at most a few times what the first curve cost, or a
            fixed budget that is generous up to ten dimensions. With ``method=`` any solver runs to its end.
        velocity_error: on a `Manifold` a bound for the distance of the velocities at the knots from those of the exact
            C² curve, the largest norm of all knots, in units of velocity (per second for dates): see
            :doc:`/manifolds`. inf where there is no bound. None on symmetric spaces. In a product of manifolds the
            root of the sum of squares.
    """

    method: str = field(metadata={"words": SOLVERS})
    converged: bool | NDArray[np.bool_] = field(metadata=BOOL)
    iterations: int | NDArray[np.int64] = field(metadata=INT)
    residual: Number = field(metadata=FLOAT)
    max_step: Number = field(metadata=FLOAT)
    max_gap: Number = field(metadata=FLOAT)
    curvature: float
    invariant_radius: Number | None = field(metadata=_MAYBE)
    rate: Number = field(metadata=FLOAT)
    alternative_energy: Number | None = field(default=None, metadata=_MAYBE)
    contraction_bound: Number | None = field(default=None, metadata=_MAYBE)
    guaranteed_sweeps: Number | None = field(default=None, metadata=_MAYBE)
    skipped: tuple[str, ...] = ()
    velocity_error: Number | None = field(default=None, metadata=_MAYBE)

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
        return same_report(self, other) if isinstance(other, Report) else NotImplemented

    def map(self, function: Callable[[Any], Any]) -> Report:
        """The report with a function applied to the fields that are per curve."""
        return replace(self, **_without_nan(mapped_columns(self, function)))


def _worst(values: Any) -> Any:
    """The largest of those of curves whose points are good, which may be none."""
    return np.fmax.reduce(np.ravel(values))


def columns_of(kind: type) -> dict[str, type]:
    """The fields of a report that have one value per curve, and their types, in their order."""
    return {own.name: own.metadata["dtype"] for own in fields(kind) if "dtype" in own.metadata}


def mapped_columns(report: Any, function: Callable[[Any], Any]) -> dict[str, Any]:
    """The fields that are per curve with a function applied; None stays None."""
    values = {name: getattr(report, name) for name in columns_of(type(report))}
    return {name: None if value is None else function(value) for name, value in values.items()}


def same_report(ours: Any, theirs: Any) -> bool:
    """Whether two reports of one class are equal, with NaN equal to NaN."""
    each = ((getattr(ours, own.name), getattr(theirs, own.name)) for own in fields(ours))
    return all(
        bool(a == b)
        if a is None or b is None or isinstance(a, (str, tuple))
        else np.array_equal(a, b, equal_nan=True)
        for a, b in each
    )


def _without_nan(columns: dict[str, Any]) -> dict[str, Any]:
    """Fields of one curve with None for undefined numbers, and a whole number of sweeps; arrays stay."""
    for name in OPTIONAL:
        if np.ndim(columns[name]) == 0 and columns[name] is not None and np.isnan(columns[name]):
            columns[name] = None
    columns["guaranteed_sweeps"] = _count(columns["guaranteed_sweeps"])
    return columns


# The rows of the two tables of the compiled core.
INTEGERS = ("converged", "iterations", "solver", "skipped")
NUMBERS = (
    *("residual", "max_step", "rate", "invariant_radius", "contraction_bound"),
    *("guaranteed_sweeps", "alternative_energy", "velocity_error"),
)
OPTIONAL = tuple(own.name for own in fields(Report) if own.metadata.get("optional"))
_UNKNOWN = {name: None if name in OPTIONAL else np.nan for name in NUMBERS}
MAX_STEP = NUMBERS.index("max_step")


class Columns(NamedTuple):
    """The fields of reports as two tables with a row for each field and a column for each curve: ``"solver"`` is a
    number in `SOLVERS`, ``"skipped"`` a set of bits.

    Attributes:
        integers: rows in the order of `INTEGERS`.
        numbers: rows in the order of `NUMBERS`.
    """

    integers: NDArray[np.int64]
    numbers: NDArray[np.float64]

    def row(self, name: str) -> NDArray[Any]:
        """The values of a field, one for each curve; a view that can be written to."""
        integer = name in INTEGERS
        values: NDArray[Any] = (
            self.integers[INTEGERS.index(name)] if integer else self.numbers[NUMBERS.index(name)]
        )
        return values

    def part(self, curves: Any) -> Columns:
        """Those of some curves."""
        return Columns(self.integers[:, curves], self.numbers[:, curves])

    def put(self, curves: Any, other: Columns) -> None:
        """Replace those of some curves."""
        self.integers[:, curves], self.numbers[:, curves] = other

    @staticmethod
    def empty(count: int) -> Columns:
        """Those of so many curves that were not fitted."""
        return Columns(np.zeros((len(INTEGERS), count), np.int64), np.full((len(NUMBERS), count), np.nan))

    @staticmethod
    def joined(each: Sequence[Columns]) -> Columns:
        """Those of the curves of all."""
        return Columns(*(np.concatenate(tables, axis=1) for tables in zip(*each, strict=True)))


def combined(
    reports: Sequence[Report], max_step: Any, curvature: float, alternative_energy: Any = None
) -> Report:
    """The report of curves in a product, from those in its factors: the worst of each field, and what is of the
    whole."""

    def largest(name: str) -> Any:
        result: NDArray[Any] = np.max(np.stack([getattr(report, name) for report in reports]), axis=0)
        return result.item() if result.ndim == 0 else result

    def of_all(name: str, whole: Any) -> Any:
        # The theorem is about each factor by itself.
        each = [getattr(report, name) for report in reports]
        return None if any(one is None for one in each) else whole(np.stack(each))[()]

    def root(own: Any) -> Any:
        return np.sqrt(np.sum(np.square(own), axis=0))

    converged: Any = np.all(np.stack([np.asarray(report.converged) for report in reports]), axis=0)
    skipped = {name for report in reports for name in report.skipped}
    return Report(
        method=max((report.method for report in reports), key=SOLVERS.index),
        converged=bool(converged) if np.ndim(converged) == 0 else converged,
        iterations=largest("iterations"),
        residual=largest("residual"),
        max_step=max_step,
        max_gap=largest("max_gap"),
        curvature=curvature,
        invariant_radius=of_all("invariant_radius", root),
        rate=largest("rate"),
        alternative_energy=alternative_energy,
        contraction_bound=of_all("contraction_bound", lambda own: np.max(own, axis=0)),
        guaranteed_sweeps=_count(of_all("guaranteed_sweeps", lambda own: np.max(own, axis=0))),
        skipped=tuple(name for name in SOLVERS if name in skipped),
        velocity_error=of_all("velocity_error", root),
    )


def long_gaps(times: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which steps between the knots of one curve are far longer than most."""
    steps = np.diff(times)
    return np.asarray(steps > _LONG * np.median(steps))


def longest_gap(times: NDArray[np.float64], batch: tuple[int, ...]) -> Any:
    """The longest time between neighbouring knots, shape of the batch axes."""
    longest = np.maximum.reduce(times[..., 1:] - times[..., :-1], axis=-1)
    return np.broadcast_to(longest, batch).copy() if batch else float(longest)


def shaped(
    columns: Columns, times: NDArray[np.float64], batch: tuple[int, ...], curvature: float, method: str
) -> Report:
    """A report from the columns of curves with these knots; ``method`` is what was asked for."""
    gap = longest_gap(times, batch)
    if batch == ():
        converged, iterations, solver, bits = columns.integers[:, 0].tolist()
        # NaN differs from itself.
        known = {name: x for name, x in zip(NUMBERS, columns.numbers[:, 0].tolist(), strict=True) if x == x}
        if "guaranteed_sweeps" in known:
            known["guaranteed_sweeps"] = int(known["guaranteed_sweeps"])
        return Report(
            method=SOLVERS[solver],
            converged=bool(converged),
            iterations=iterations,
            max_gap=gap,
            curvature=curvature,
            skipped=_skipped(bits),
            **_UNKNOWN | known,
        )
    # Each row by itself: a batch may have no curves.
    integers = {name: columns.row(name).reshape(batch) for name in INTEGERS}
    numbers: dict[str, Any] = {name: columns.row(name).reshape(batch) for name in NUMBERS}
    solvers = integers["solver"]
    for name in OPTIONAL:
        if np.isnan(numbers[name]).all():
            numbers[name] = None
    return Report(
        method=SOLVERS[solvers.max()] if solvers.size else "quasi-newton" if method == "auto" else method,
        converged=integers["converged"].astype(bool),
        iterations=integers["iterations"],
        max_gap=gap,
        curvature=curvature,
        skipped=_skipped(int(np.bitwise_or.reduce(integers["skipped"], axis=None))),
        **numbers,
    )


def _count(value: Any) -> Any:
    """A whole number of one curve; arrays, which may hold NaN, stay floats."""
    return value if value is None or np.ndim(value) else int(value)


def _skipped(bits: int) -> tuple[str, ...]:
    return tuple(name for i, name in enumerate(SOLVERS) if bits >> i & 1) if bits else ()

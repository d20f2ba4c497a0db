"""Fits with a velocity and an acceleration at one end, by an additional knot in the outer segment."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.faults import UNCONVERGED, Fault
from .._base.time import TimeAxis
from .._spaces import POINT_TOL, Array, Doubles, Euclidean, Space, cover_of, factors_of
from .curve import CurveArrays, FactorArrays
from .ends import End, map_ends
from .fit import Fit, FitProblem, Points

Solver = Callable[[FitProblem], Fit]

_MOST = 40
# Corrections of an additional point that are below this, relative to the length of its segment or to the rounding of
# its numbers, are rounding errors.
_FLOOR = 1e-14
# Corrections above this are failures. Accelerations on a `Manifold` are differences with an error of some 1e-10.
_FAILED = 1e-7
# Earlier corrections that determine the next one.
_MEMORY = 8


class Knots(NamedTuple):
    """The knots of a curve with additional ones.

    Attributes
    ----------
    shown : ndarray
        Knots as in `CubicSpline.t`.
    times : ndarray
        Knots as numbers of the core.
    which : list of int
        Ends with an additional knot: 0 for the first, 1 for the last.
    """

    shown: NDArray[Any]
    times: Doubles
    which: list[int]

    def node(self, end: int) -> int:
        """Return the index of an additional knot."""
        return 1 if end == 0 else self.times.shape[-1] - 2


def with_knots(
    time_axis: TimeAxis, shown: NDArray[Any], times: Doubles, batch: tuple[int, ...], accelerations: Any
) -> Knots:
    """Add one knot to the outer segment at every end with an additional acceleration, see `split_accelerations`.

    It is the midpoint of the segment. The only segment of a curve with two such ends is divided in thirds.
    """
    which = [end for end, condition in enumerate(accelerations) if not isinstance(condition, str)]
    if time_axis.dates:
        # Midpoints need a finer unit than days.
        shown = shown.astype(time_axis.shown(times, batch).dtype)
    parts = 3 if len(which) == 2 and shown.shape[-1] == 2 else 2
    whole = shown.dtype.kind != "f"

    def between(a: NDArray[Any], b: NDArray[Any], share: int) -> NDArray[Any]:
        return np.asarray(a + share * ((b - a) // parts if whole else (b - a) / parts))

    added = {0: between(shown[..., :1], shown[..., 1:2], 1), 1: between(shown[..., -2:-1], shown[..., -1:], parts - 1)}
    for end in which:
        shown = _inserted(shown, added[end], end, shown.ndim - 1)
    return Knots(shown, time_axis.knots(shown), which)


def _inserted(rows: NDArray[Any], row: NDArray[Any], end: int, axis: int) -> NDArray[Any]:
    """Insert a node after the first one, or before the last one."""
    at = 1 if end == 0 else rows.shape[axis] - 1
    before, after = np.split(rows, [at], axis=axis)
    return np.concatenate([before, row, after], axis=axis)


def fit_with_knots(problem: FitProblem, accelerations: list[list[End]], knots: Knots, solve: Solver) -> Fit:
    """Fit curves with additional knots so that they have the given accelerations at the ends.

    The velocity and the acceleration at one end of a C² spline through points determine the next segment, and with it
    all others. Errors grow by the factor 2 + √3 from one segment to the next, because the homogeneous equation in flat
    space is m₋ + 4m + m₊ = 0. An additional knot whose point is free instead adds the unknown that the additional
    condition needs, and the influence of the condition decays by the same factor.

    The unknown is the tangent vector x at the end for which exp(x) is the additional point. In flat space, the
    acceleration at the end is an affine function of x with a number J as its derivative. The correction
    r = J⁻¹(a − acceleration) therefore solves the problem in one step there. On other spaces, and if both ends have an
    additional knot, Anderson's acceleration combines several corrections.

    Parameters
    ----------
    problem : FitProblem
        Valid curves without the additional knots. The ends with accelerations have velocities.
    accelerations : list of list of End
        Conditions ``("acceleration", a)`` in each factor.
    knots : Knots
        The additional knots.
    solve : callable
        Fit of curves with given points.

    References
    ----------
    D. G. Anderson, Iterative procedures for nonlinear integral equations, J. ACM 12 (1965).
    """
    first = solve(problem)
    if any(fault.failed for fault in first.faults) and not problem.points[0].batch:
        return first
    slopes = _flat_derivatives(problem, knots, solve)
    states = [
        _Unknown(factor, problem, first, i, own, knots)
        for i, (factor, own) in enumerate(zip(factors_of(problem.space), accelerations, strict=True))
    ]
    iterations = [own.row("iterations").copy() for own in first.columns]
    for _ in range(_MOST):
        found = _fit_at(problem, states, knots, solve)
        for i, own in enumerate(found.columns):
            iterations[i] += own.row("iterations")
        for i, state in enumerate(states):
            state.correct(found, i, slopes)
        if all(state.finished for state in states):
            break
    if not all(state.at_best for state in states):
        for state in states:
            state.restore()
        found = _fit_at(problem, states, knots, solve)
    for i, own in enumerate(found.columns):
        own.row("iterations")[:] = iterations[i]
    return found._replace(faults=_faults(found, states))


def _fit_at(problem: FitProblem, states: list[_Unknown], knots: Knots, solve: Solver) -> Fit:
    """Fit the curves through the points and the current additional points."""
    points = [_with_points(own, state.points(), knots) for own, state in zip(problem.points, states, strict=True)]
    return solve(problem._replace(times=knots.times, points=points, check=False))


def _with_points(part: Points, added: list[Doubles], knots: Knots) -> Points:
    numbers, axis = part.numbers, len(part.batch)
    for end, row in zip(knots.which, added, strict=True):
        numbers = _inserted(numbers, np.expand_dims(row, axis), end, axis)
    return Points(numbers, part.tol, part.batch, part.nodes + len(knots.which))


def _flat_derivatives(problem: FitProblem, knots: Knots, solve: Solver) -> Doubles:
    """Return the derivative of each acceleration with respect to its additional point in flat space, shape (..., k)."""
    line, times = Euclidean(1), knots.times
    batch, nodes = times.shape[:-1], times.shape[-1]
    ends = map_ends(problem.ends[0], lambda _: np.zeros((*batch, 1)))
    columns = []
    for end in knots.which:
        row = np.zeros((*batch, nodes, 1))
        row[..., knots.node(end), 0] = 1
        flat = Points(row, POINT_TOL, batch, nodes)
        of_line = problem._replace(
            space=line, times=times, points=[flat], ends=[ends], mask=None, check=False, skip_invalid=False
        )
        curve = solve(of_line).curve
        columns.append(_acceleration(curve.parts[0], end)[..., 0])
    return np.stack(columns, axis=-1)


def _acceleration(part: CurveArrays, end: int) -> Array:
    """Return the acceleration at the first or last knot, in one factor."""
    axis, h = len(part.batch), np.diff(part.times, axis=-1)[..., -end]
    # The reversed last segment begins at the last point itself, and not at another representative of it.
    nodes, sign = ([0, 1], 1) if end == 0 else ([-1, -2], -1)
    points, velocities = (np.take(rows, nodes, axis=axis) for rows in (part.points, part.velocities))
    times = np.stack([np.zeros_like(h), h], axis=-1)
    segment = CurveArrays(part.space, times, (FactorArrays(part.space, points, sign * velocities),), fitted=False)
    return np.asarray(segment.evaluate(np.zeros_like(h), "acceleration", "raise", h.ndim > 0))


class _Unknown:
    """The additional points of one factor, as tangent vectors at the ends, and their corrections."""

    def __init__(
        self, factor: Space, problem: FitProblem, first: Fit, number: int, accelerations: list[End], knots: Knots
    ) -> None:
        self.space, self.which = cover_of(factor), knots.which
        part = first.curve.parts[number]
        axis = len(part.batch)
        self.ends = [np.take(part.points, -end, axis=axis) for end in self.which]
        self.wanted = [self.space._numbers(vector) for _, vector in accelerations if vector is not None]
        x = []
        for end, point in zip(self.which, self.ends, strict=True):
            at = np.array(knots.times[..., knots.node(end)])
            near = np.asarray(part.evaluate(at, "point", "raise", at.ndim > 0))
            x.append(self._where_finite(self.space.log, point, near))
        self.x = self._rows(x)
        size = [self.space._rounding(point).reshape(len(self.x)) for point in self.ends]
        lengths = np.linalg.norm(self.x.reshape(*self.x.shape[:2], -1), axis=-1)
        self.size = np.maximum(lengths, 0.1 * np.stack(size, axis=1)).max(axis=1)
        self.best, self.error = self.x.copy(), np.full(len(self.x), np.inf)
        self.waits = np.zeros(len(self.x), int)
        self.history: list[tuple[Doubles, Doubles]] = []
        self.at_best = True

    def points(self) -> list[Doubles]:
        """Return the current points, as numbers of the core."""
        batch = self.ends[0].shape[: self.ends[0].ndim - len(self.space.point_shape)]
        found = []
        for k, point in enumerate(self.ends):
            vectors = self.space._numbers(np.ascontiguousarray(self.x[:, k]).reshape(batch + self.space._doubles_shape))
            found.append(self.space._as_doubles(self._where_finite(self.space.exp, point, vectors)))
        return found

    def _where_finite(self, operation: Callable[[Array, Array], Array], points: Array, others: Array) -> Array:
        """Apply an operation of the space to the curves without NaN. The results for the others are NaN."""
        axes = tuple(range(-len(self.space.point_shape), 0))
        good = np.isfinite(points).all(axis=axes) & np.isfinite(others).all(axis=axes)
        result = np.full(points.shape, np.nan, points.dtype)
        if good.any():
            result[good] = operation(points[good], others[good])
        return result

    def correct(self, found: Fit, number: int, slopes: Doubles) -> None:
        """Compute the corrections of the current points, and add them unless they are rounding errors."""
        misses = [
            wanted - _acceleration(found.curve.parts[number], end)
            for end, wanted in zip(self.which, self.wanted, strict=True)
        ]
        slopes = slopes.reshape(-1, *slopes.shape[-1:], *[1] * (self.x.ndim - 2))
        r = self._rows(misses) / slopes
        error = np.linalg.norm(r.reshape(len(r), -1), axis=1) / self.size
        better = error < self.error
        self.best[better], self.error[better] = self.x[better], error[better]
        self.waits = np.where(better, 0, self.waits + 1)
        self.at_best = bool(better.all())
        self.history = [*self.history, (self.x.copy(), r)][-_MEMORY:]
        open_ = ~self._settled()
        self.x[open_] = self._next()[open_]

    def _next(self) -> Doubles:
        """Return the next vectors by Anderson's method."""
        x, r = self.history[-1]
        count, old = len(x), self.history[:-1]
        if not old:
            return x + r
        flat = r.reshape(count, -1)
        changes = [
            np.stack([(own - each[i]).reshape(count, -1) for each in old], axis=-1) for i, own in enumerate((x, r))
        ]
        good = np.isfinite(changes[1]).all(axis=(1, 2)) & np.isfinite(flat).all(axis=1)
        weights = np.zeros((count, len(old), 1))
        weights[good] = np.linalg.pinv(changes[1][good], rcond=1e-10) @ flat[good][..., None]
        moved = flat - ((changes[0] + changes[1]) @ weights)[..., 0]
        return x + moved.reshape(x.shape)

    def _settled(self) -> NDArray[np.bool_]:
        # Curves without a solution have no finite error.
        return (self.error <= _FLOOR) | (self.waits >= 3)

    @property
    def finished(self) -> bool:
        return bool(self._settled().all())

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether the accelerations of a curve are not attained."""
        return ~(self.error <= _FAILED)

    def restore(self) -> None:
        """Return to the vectors with the smallest corrections."""
        self.x = self.best.copy()

    def _rows(self, vectors: list[Array]) -> Doubles:
        """Return vectors at all ends as numbers, shape (curves, ends, *numbers of a point)."""
        shape = self.space._doubles_shape
        return np.stack([self.space._as_doubles(np.ascontiguousarray(v)).reshape(-1, *shape) for v in vectors], axis=1)


def _faults(found: Fit, states: list[_Unknown]) -> list[Fault]:
    """Return the faults of the curves, including those that do not have the given accelerations."""
    counted = "points are counted with the additional knots of bc_type"
    known = {own.curve: own._replace(remedy="; ".join(filter(None, (own.remedy, counted)))) for own in found.faults}
    mask = np.any([state.failed for state in states], axis=0)
    for number in np.flatnonzero(mask).tolist():
        if not all(own.row("converged")[number] for own in found.columns):
            continue
        what = "no convergence{of}: no curve was found with the given velocity and acceleration at one end"
        remedy = "prescribe only one of them, or values that suit the points next to the end"
        known.setdefault(number, Fault(number, UNCONVERGED, what, remedy))
        for own in found.columns:
            own.row("converged")[number] = 0
    return [known[number] for number in sorted(known)]

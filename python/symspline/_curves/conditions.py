"""Fits with conditions besides one at either end: velocities at inner nodes, and two conditions at an end."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from itertools import pairwise
from operator import or_
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import short_repr
from .._base.faults import UNCONVERGED, Fault
from .._base.report import INTEGERS, Columns, shaped
from .._base.time import TimeAxis
from .._base.typing import Progress
from .._core import ValidationError
from .._spaces import POINT_TOL, Array, Doubles, Euclidean, Product, Quotient, Space, cover_of, factors_of, parts_of
from .curve import CurveArrays, FactorArrays, share
from .ends import End, map_ends
from .fit import Fit, FitProblem, Points, curve_of, fit, moved_ends, read_ends, solve_tasks, validated, validated_tasks
from .search import alternative_energy
from .solve import Solved, Task, without


def fit_with_conditions(
    problem: FitProblem,
    time_axis: TimeAxis,
    shown: NDArray[Any],
    velocities: Any,
    accelerations: Any,
    progress: Progress | None,
) -> tuple[Fit, NDArray[Any], tuple[int, ...]]:
    """Fit curves with additional conditions.

    Parameters
    ----------
    problem : FitProblem
        Curves with one condition at either end.
    time_axis, shown
        The time axis, and the knots as in `CubicSpline.t`.
    velocities : mapping or None
        The argument `velocities` of `CubicSpline`.
    accelerations : pair or None
        Additional accelerations at the ends; see `split_accelerations`.
    progress : callable or None
        Function to call with the numbers of finished and of all points.

    Returns
    -------
    fit : Fit
    shown : ndarray
        The knots, with additional ones.
    nodes : tuple of int
        Nodes with a prescribed velocity, where the curve is C¹ only.
    """
    inner = {} if velocities is None else read_inner(velocities, problem.space, problem.points)
    if accelerations is None:
        return _solve(problem, inner, progress), shown, tuple(inner)
    knots = with_knots(time_axis, shown, problem.times, problem.points[0].batch, accelerations)
    found, inner = _with_accelerations(problem, inner, accelerations, knots, progress)
    return found, knots.shown, tuple(inner)


def _solve(problem: FitProblem, inner: InnerVelocities, progress: Progress | None = None) -> Fit:
    return fit_in_sections(problem, inner, progress) if inner else fit(problem, progress)


def _with_accelerations(
    problem: FitProblem, inner: InnerVelocities, accelerations: Any, knots: Knots, progress: Progress | None
) -> tuple[Fit, InnerVelocities]:
    """Fit curves with accelerations at the ends. Return the fit, and the inner velocities by node of the new curve."""
    space, times, data, check = problem.space, problem.times, problem.points, problem.check
    batch = data[0].batch
    ends = read_ends(moved_ends(accelerations, space, data), space, batch)
    invalid: list[Fault] = []
    if check:
        skip = problem.check and problem.skip_invalid
        points, invalid = validated(space, times, data, problem.ends, skip, problem.mask)
        _, more = validated(space, times, data, ends, skip, problem.mask)
        invalid += [fault for fault in more if fault.curve not in {own.curve for own in invalid}]
        numbers = [
            own._replace(numbers=factor._as_doubles(np.ascontiguousarray(found)))
            for factor, own, found in zip(factors_of(space), data, points, strict=True)
        ]
        problem = problem._replace(points=numbers, check=False, mask=without(problem.mask, invalid, batch))
    shift = int(0 in knots.which)
    shifted = {node + shift: vectors for node, vectors in inner.items()}

    def solve(own: FitProblem) -> Fit:
        if own.space is space:
            return _solve(own, shifted if own.times is knots.times else inner, progress)
        zero: Array = np.zeros((*own.points[0].batch, 1))
        return _solve(own, {node: [zero] for node in shifted})

    found = fit_with_knots(problem, [own or [] for own in ends], knots, solve)
    faults = {fault.curve: fault for fault in (*found.faults, *invalid)}
    return found._replace(faults=[faults[number] for number in sorted(faults)]), shifted


# ---- fits with prescribed velocities at inner nodes ----

InnerVelocities = dict[int, list[Doubles]]
"""Prescribed velocities in each factor, as numbers of the core, by the index of their node."""


def read_inner(velocities: Any, space: Space[Any], data: list[Points]) -> InnerVelocities:
    """Read the velocities that are prescribed at inner nodes, and return them in the order of the nodes.

    Raises
    ------
    ValidationError
        If they are not a mapping from indices of inner nodes to vectors, or a vector does not have the right shape.
    """
    if not isinstance(velocities, Mapping):
        raise ValidationError(
            "velocities must be a dict from indices of inner points to the velocities there, such as {3: v}, not "
            f"{short_repr(velocities)}"
        )
    last = data[0].nodes - 1
    for node in velocities:
        if isinstance(node, bool) or not isinstance(node, (int, np.integer)) or not 0 < node < last:
            inner = f"1 to {last - 1}" if last > 1 else "none"
            raise ValidationError(
                f"velocities has the key {short_repr(node)}, but keys must be indices of inner points ({inner}). Use "
                "bc_type for velocities at the ends."
            )
    return {int(node): _in_factors(int(node), velocities[node], space, data) for node in sorted(velocities)}


def _in_factors(node: int, vector: Any, space: Space[Any], data: list[Points]) -> list[Doubles]:
    name, found = f"velocities[{node}]", []
    for factor, part, own in zip(factors_of(space), data, parts_of(vector, space, name), strict=True):
        doubles = factor._doubles(own, name)
        if not np.isfinite(doubles).all():
            raise ValidationError(f"{name} must be finite")
        try:
            full = np.broadcast_to(doubles, part.batch + factor._doubles_shape)
        except ValueError:
            raise ValidationError(
                f"{name} has shape {np.shape(own)}, which does not broadcast to {part.batch + factor.point_shape}"
            ) from None
        if part.moves is not None and isinstance(factor, Quotient):
            # The vector is tangent at the representative that the user gave.
            numbers = np.ascontiguousarray(factor._moved_by(factor._numbers(full), part.moves[..., node]))
            full = factor._as_doubles(numbers)
        found.append(np.ascontiguousarray(full))
    return found


def fit_in_sections(problem: FitProblem, inner: InnerVelocities, progress: Progress | None = None) -> Fit:
    """Fit curves with prescribed velocities at inner nodes.

    At such a node the C² condition is replaced by the velocity. The equations on both sides of the node are then
    independent, and each section between two such nodes is a fit with prescribed end velocities. A closed curve is
    rotated to begin at the first of these nodes.
    """
    space, times, points, ends, options, check, mask, skip, _ = problem
    tasks = [
        Task(cover_of(factor), times, part.numbers, end, part.tol if check else None, None, mask, check and skip)
        for factor, part, end in zip(factors_of(space), points, ends, strict=True)
    ]
    tasks, faults = validated_tasks(space, tasks, options)
    if check:
        _check_tangent(space, tasks, inner)
        # The speeds of the inner velocities are checked with each section.
        tasks = [task._replace(tol=POINT_TOL) for task in tasks]
    sections = _sections(tasks, inner)
    solved: list[list[Solved]] = []
    for number, section in enumerate(sections):
        try:
            found, more = solve_tasks(space, section, options, share(progress, number, len(sections)))
        except ValidationError as error:
            names = section[0].names or ()
            raise error._with_message(f"between points[{names[0]}] and points[{names[-1]}]: {error}") from None
        solved.append(found)
        faults += more
    first = {fault.curve: fault for fault in reversed(faults)}
    arrays, columns = [], []
    for i, (factor, task) in enumerate(zip(factors_of(space), tasks, strict=True)):
        own = [found[i] for found in solved]
        arrays.append(_joined(task, next(iter(inner)), own))
        columns.append(_report_of(factor, [section[i] for section in sections], own, options.method))
    curve = curve_of(space, times, arrays, fitted=False)
    return Fit(curve, columns, options.method, [first[number] for number in sorted(first)])


def _check_tangent(space: Space[Any], tasks: list[Task], inner: InnerVelocities) -> None:
    """Raise ValidationError unless all vectors are tangent at the points of curves that are fitted."""
    for number, (factor, task) in enumerate(zip(factors_of(space), tasks, strict=True)):
        own = task.space
        points, axis = own._numbers(task.points), len(task.batch)
        where = np.ones(task.batch, bool) if task.mask is None else task.mask
        for node, vectors in inner.items():
            try:
                own.check_tangent(np.take(points, node, axis=axis)[where], own._numbers(vectors[number])[where])
            except ValidationError as error:
                of = f"factor {number}, {factor!r}: " if isinstance(space, Product) else ""
                raise error._with_message(f"{of}velocities[{node}]: {error}") from None


def _sections(tasks: list[Task], inner: InnerVelocities) -> list[list[Task]]:
    """Return the tasks of all sections, in each factor. Those of closed curves begin at the first node in `inner`."""
    nodes = tasks[0].times.shape[-1]
    names: list[int] = list(range(nodes))
    given = list(inner)
    closed = tasks[0].ends is None
    if closed:
        start = given[0]
        tasks = [_rotated(task, start) for task in tasks]
        names = [(start + i) % (nodes - 1) for i in range(nodes)]
        bounds = [node - start for node in given] + [nodes - 1]
    else:
        bounds = [0, *given, nodes - 1]

    def end(task: Task, factor: int, bound: int, which: int) -> End:
        vectors = inner.get(names[bound])
        if vectors is not None and (closed or 0 < bound < nodes - 1):
            return "velocity", vectors[factor]
        assert task.ends is not None
        return task.ends[which]

    def section(task: Task, factor: int, a: int, b: int) -> Task:
        part = np.take(task.points, range(a, b + 1), axis=len(task.batch))
        ends = [end(task, factor, a, 0), end(task, factor, b, 1)]
        knots = np.ascontiguousarray(task.times[..., a : b + 1])
        return task._replace(times=knots, points=part, ends=ends, names=names[a : b + 1])

    return [[section(task, i, a, b) for i, task in enumerate(tasks)] for a, b in pairwise(bounds)]


def _rotated(task: Task, start: int) -> Task:
    """Return the task of the same closed curves that begins and ends at another node."""
    t, axis, nodes = task.times, len(task.batch), task.times.shape[-1]
    turn = [*range(start, nodes - 1), *range(start + 1)]
    times = np.concatenate([t[..., start:], t[..., 1 : start + 1] + (t[..., -1:] - t[..., :1])], axis=-1)
    return task._replace(times=times, points=np.take(task.points, turn, axis=axis))


def _joined(task: Task, start: int, solved: list[Solved]) -> tuple[Array, Array]:
    """Return points and velocities at all nodes. A curve without a solution in one section is NaN as a whole."""
    axis = len(task.batch)

    def join(arrays: list[Array]) -> Array:
        parts = [arrays[0], *(np.delete(array, 0, axis=axis) for array in arrays[1:])]
        whole = np.concatenate(parts, axis=axis)
        if task.ends is None:
            nodes = whole.shape[axis]
            back = [(i - start) % (nodes - 1) for i in range(nodes)]
            whole = np.take(whole, back, axis=axis)
        whole[np.isnan(whole).any(axis=tuple(range(axis, whole.ndim)))] = np.nan
        return whole

    return join([found.points for found in solved]), join([found.velocities for found in solved])


def _report_of(space: Space, sections: list[Task], solved: list[Solved], method: str) -> Columns:
    """Return the columns of whole curves: the worst values of their sections."""
    each = [found.columns for found in solved]
    integers = [np.min if name == "converged" else np.max for name in INTEGERS]
    stacked = np.stack([own.integers for own in each])
    whole = Columns(
        np.stack([join(stacked[:, row], axis=0) for row, join in enumerate(integers)]),
        # NaN where a number is undefined for any section.
        np.max(np.stack([own.numbers for own in each]), axis=0),
    )
    whole.row("skipped")[:] = reduce(or_, [own.row("skipped") for own in each])
    batch = sections[0].batch
    curves: list[CurveArrays] = []
    reports = []
    for task, found in zip(sections, solved, strict=True):
        curves.append(curve_of(space, task.times, [(found.points, found.velocities)]))
        reports.append(shaped(found.columns, task.times, batch, space, method))
    other = alternative_energy(curves, reports)
    if other is not None:
        whole.row("alternative_energy")[:] = np.ravel(other)
    return whole


# ---- fits with a velocity and an acceleration at one end, by an additional knot in the outer segment ----

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

"""Fits with conditions besides one at either end: velocities at inner points, and two conditions at an end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .._base.arrays import short_repr
from .._base.faults import INVALID, Fault
from .._base.time import TimeAxis
from .._base.typing import Array, PointsLike, Progress
from .._core import ValidationError
from .._spaces import POINT_TOL, AnySpace, Doubles, Product, Quotient, factors_of, parts_of
from .ends import End, both
from .fit import Fit, FitProblem, InnerVelocities, Points, fit, moved_ends, read_ends, tasks_of, validated_tasks
from .solve import Task


def fit_with_conditions(
    problem: FitProblem,
    time_axis: TimeAxis,
    shown: Array,
    velocities: Any,
    accelerations: Any,
    progress: Progress | None,
) -> tuple[Fit, Array, tuple[int, ...]]:
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
    space, data = problem.space, problem.points
    batch, shift = data[0].batch, 0
    inner = {} if velocities is None else read_inner(velocities, space, data)
    if accelerations is not None:
        second = read_ends(moved_ends(accelerations, space, data), space, batch)
        which = [end for end, condition in enumerate(accelerations) if not isinstance(condition, str)]
        shown = with_knots(time_axis, shown, problem.times, batch, which)
        _check_additional(shown, which)
        ends: list[list[End] | None] = [both(*pair, batch) for pair in zip(problem.ends, second, strict=True)]
        problem, shift = problem._replace(times=time_axis.knots(shown), ends=ends), int(0 in which)
    invalid: list[Fault] = []
    if inner:
        problem, invalid = _checked(problem, inner, shift)
    solution = fit(problem._replace(inner=inner), progress)
    if accelerations is not None:
        counted = "points are counted with the additional knots of bc_type"
        for i, fault in enumerate(solution.faults):
            if fault.kind != INVALID:
                solution.faults[i] = fault._replace(remedy="; ".join(filter(None, (fault.remedy, counted))))
    if invalid:
        solution = solution._replace(faults=sorted([*solution.faults, *invalid], key=lambda fault: fault.curve))
    return solution, shown, tuple(node + shift for node in inner)


def with_knots(time_axis: TimeAxis, shown: Array, times: Doubles, batch: tuple[int, ...], which: list[int]) -> Array:
    """Add one knot to the outer segment at some ends: 0 for the first, 1 for the last.

    It is the midpoint of the segment. The only segment of a curve with two such ends is divided in thirds.
    """
    if time_axis.dates:
        # Midpoints need a finer unit than days.
        shown = shown.astype(time_axis.shown(times, batch).dtype)
    parts = 3 if len(which) == 2 and shown.shape[-1] == 2 else 2
    whole = shown.dtype.kind != "f"

    def between(a: Array, b: Array, share: int) -> Array:
        return np.asarray(a + share * ((b - a) // parts if whole else (b - a) / parts))

    first, last = between(shown[..., :1], shown[..., 1:2], 1), between(shown[..., -2:-1], shown[..., -1:], parts - 1)
    start, stop = [[first] if 0 in which else [], [last] if 1 in which else []]
    return np.concatenate([shown[..., :1], *start, shown[..., 1:-1], *stop, shown[..., -1:]], axis=-1)


def _check_additional(shown: Array, which: list[int]) -> None:
    """Raise ValidationError if no number lies between two knots that need an additional knot between them."""
    for end in which:
        before, added, after = np.moveaxis(shown[..., :3] if end == 0 else shown[..., -3:], -1, 0)
        # Knots that do not increase are another error.
        if ((before < after) & ~((before < added) & (added < after))).any():
            name = ("first", "last")[end]
            raise ValidationError(
                f"bc_type prescribes a velocity and an acceleration at the {name} point. They need an additional knot, "
                f"but the {name} two knots are too close for a time between them. Pass times in a finer unit, or "
                "prescribe only one of the two vectors."
            )


def read_inner(velocities: PointsLike, space: AnySpace, data: list[Points]) -> InnerVelocities:
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


def _in_factors(node: int, vector: object, space: AnySpace, data: list[Points]) -> list[Doubles]:
    name, vectors = f"velocities[{node}]", []
    for factor, part, given in zip(factors_of(space), data, parts_of(vector, space, name), strict=True):
        doubles = factor._doubles(given, name)
        if not np.isfinite(doubles).all():
            raise ValidationError(f"{name} must be finite")
        try:
            full = np.broadcast_to(doubles, part.batch + factor._doubles_shape)
        except ValueError:
            raise ValidationError(
                f"{name} has shape {np.shape(given)}, which does not broadcast to {part.batch + factor.point_shape}"
            ) from None
        if part.moves is not None and isinstance(factor, Quotient):
            # The vector is tangent at the representative that the user gave.
            numbers = np.ascontiguousarray(factor._moved_by(factor._numbers(full), part.moves[..., node]))
            full = factor._as_doubles(numbers)
        vectors.append(np.ascontiguousarray(full))
    return vectors


def _checked(problem: FitProblem, inner: InnerVelocities, shift: int) -> tuple[FitProblem, list[Fault]]:
    """Validate curves and the velocities at their inner nodes. Return curves with points on the space, and faults.

    `shift` is 1 if an additional knot follows the first.
    """
    tasks = tasks_of(problem, factors_of(problem.space))
    names, last, closed = list(inner), problem.points[0].nodes - 1, problem.ends[0] is None
    tasks, faults = validated_tasks(problem.space, tasks, problem.options)
    if problem.check:
        _check_tangent(problem.space, tasks, inner)
        bounds = [names[-1] if closed else 0, *names, names[0] if closed else last]
        for i, node in enumerate(names, 1):
            for first, ends, pair in ((node - 1, (0, 1), bounds[i - 1 : i + 1]), (node, (1, 0), bounds[i : i + 2])):
                try:
                    validated_tasks(problem.space, _segment(tasks, inner[node], first, ends, shift), problem.options)
                except ValidationError as error:
                    raise error._with_message(f"between points[{pair[0]}] and points[{pair[1]}]: {error}") from None
    points = [part._replace(numbers=task.points) for part, task in zip(problem.points, tasks, strict=True)]
    return problem._replace(points=points, check=False, mask=tasks[0].mask), faults


def _segment(tasks: list[Task], vectors: list[Doubles], first: int, given: tuple[int, int], shift: int) -> list[Task]:
    """Return the tasks of one segment with a velocity at one end."""
    segment_tasks = []
    for task, vector in zip(tasks, vectors, strict=True):
        ends: list[End] = [("velocity", vector) if which else ("natural", None) for which in given]
        points = np.take(task.points, [first, first + 1], axis=len(task.batch))
        start = first + shift if first else 0
        knots = np.take(task.times, [start, first + 1 + shift], axis=-1)
        segment_tasks.append(task._replace(times=knots, points=points, ends=ends, tol=POINT_TOL, inner=None))
    return segment_tasks


def _check_tangent(space: AnySpace, tasks: list[Task], inner: InnerVelocities) -> None:
    """Raise ValidationError unless all vectors are tangent at the points of curves that are fitted."""
    for number, (factor, task) in enumerate(zip(factors_of(space), tasks, strict=True)):
        cover = task.space
        points, axis = cover._numbers(task.points), len(task.batch)
        where = np.ones(task.batch, bool) if task.mask is None else task.mask
        for node, vectors in inner.items():
            try:
                cover.check_tangent(np.take(points, node, axis=axis)[where], cover._numbers(vectors[number])[where])
            except ValidationError as error:
                of = f"factor {number}, {factor!r}: " if isinstance(space, Product) else ""
                raise error._with_message(f"{of}velocities[{node}]: {error}") from None

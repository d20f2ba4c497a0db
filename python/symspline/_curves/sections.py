"""Fits with prescribed velocities at inner nodes, which separate a curve into sections with given end velocities."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from itertools import pairwise
from operator import or_
from typing import Any

import numpy as np

from .._base.arrays import short_repr
from .._base.report import INTEGERS, Columns, shaped
from .._base.typing import Progress
from .._core import ValidationError
from .._spaces import POINT_TOL, Array, Doubles, Product, Quotient, Space, cover_of, factors_of, parts_of
from .curve import CurveArrays, share
from .ends import End
from .fit import Fit, FitProblem, Points, curve_of, solve_tasks, validated_tasks
from .length import alternative_energy
from .solve import Solved, Task

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

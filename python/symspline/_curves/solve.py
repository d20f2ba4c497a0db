"""Calls of the compiled core that validate and fit curves."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.faults import INVALID, Fault, from_core
from .._base.report import Columns
from .._base.typing import Array, Progress
from .._spaces import Doubles, Space
from .ends import End, map_ends

Mask = NDArray[np.bool_]


class Options(NamedTuple):
    """Options of the solver, as for `symspline.CubicSpline`."""

    method: str
    tol: float
    max_iter: int | None


DEFAULTS = Options("auto", 1e-12, None)


class Task(NamedTuple):
    """Points to interpolate in a space that is not a product.

    Attributes
    ----------
    space : Space
        A space other than a product.
    times : ndarray, shape (N+1,) or (..., N+1)
        Knots, shared or with one row per curve, with those that ends with two conditions add. With `offsets`, one row
        for all curves.
    points : ndarray, shape (..., N+1, *numbers of a point)
        Contiguous floating-point numbers.
    ends : list of End or None
        Conditions at both ends; None for closed curves.
    tol : float or None
        Tolerance of points off the space; None omits all validation.
    offsets : list of int or None
        Where each of several curves of different lengths begins in one long row of points, and where the last ends.
    mask : ndarray of bool or None
        Curves to fit, of the shape of the batch; masked curves are NaN. None fits all curves.
    skip_invalid : bool
        Whether curves with points off the space are masked instead of raising an error.
    names : sequence of int or None
        Indices of the nodes in messages; None for 0, 1, ...
    inner : dict or None
        Prescribed velocities at inner nodes.
    radius : float or None
        Injectivity radius of a quotient of the space.
    """

    space: Space
    times: NDArray[np.float64]
    points: NDArray[np.float64]
    ends: list[End] | None
    tol: float | None
    offsets: list[int] | None = None
    mask: Mask | None = None
    skip_invalid: bool = False
    names: Sequence[int] | None = None
    inner: dict[int, Doubles] | None = None
    radius: float | None = None

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape of the batch."""
        if self.offsets is not None:
            return (len(self.offsets) - 1,)
        return self.points.shape[: self.points.ndim - len(self.space._doubles_shape) - 1]


class Solved(NamedTuple):
    """Points on the space, velocities at the knots, the columns of the report, and faults."""

    points: Array
    velocities: Array
    columns: Columns
    faults: list[Fault]


Solver = Callable[[Task, Options, Progress | None], Solved]


def solve(
    tasks: Sequence[Task], options: Options, progress: Progress | None = None
) -> tuple[list[Solved], list[Fault]]:
    """Validate and solve the tasks of all factors, which share knots and masks, in one call of the core.

    Return the solutions and their faults.
    """
    _, times, _, _, _, offsets, mask, skip, *_ = tasks[0]
    factors, solved, failed = [], [], False
    for task in tasks:
        inner = list(task.inner.items()) if task.inner else None
        factors.append((task.space._handle, task.points, task.ends, task.tol, inner, task.radius))
    results = _core.fit(
        factors, times, *options, offsets, None if mask is None else mask.ravel().tolist(), skip, progress
    )
    for task, (points, velocities, tables, raw) in zip(tasks, results, strict=True):
        space, columns, faults = task.space, Columns(*tables), []
        if raw:
            failed, quaternions = True, space._name == "sphere"
            faults = [from_core(one, columns, options.tol, quaternions, task.names) for one in raw]
        if space._complex:
            points, velocities = space._numbers(points), space._numbers(velocities)
        solved.append(Solved(points, velocities, columns, faults))
    return solved, faults_of(solved, []) if failed else []


def solve_single(task: Task, options: Options, progress: Progress | None = None) -> Solved:
    """Validate and solve the task of one space."""
    return solve([task], options, progress)[0][0]


def faults_of(solved: list[Solved], invalid: list[Fault]) -> list[Fault]:
    """Return the faults of invalid curves and those of one factor, in the order of curves.

    This is the first factor in which a curve failed. If there is none, it is the first factor with faults.
    """
    of_points = [*invalid, *(fault for solution in solved for fault in solution.faults if fault.kind == INVALID)]
    # The first fault of a curve counts.
    skipped = {fault.curve: fault for fault in reversed(of_points)}
    others = [[fault for fault in solution.faults if fault.kind != INVALID] for solution in solved]
    others = sorted(filter(None, others), key=lambda faults: not any(fault.failed for fault in faults))
    return sorted([*skipped.values(), *(others[0] if others else [])], key=lambda fault: fault.curve)


def validate(task: Task) -> tuple[Task, list[Fault]]:
    """Copy the points of a task and project them onto the space, so that no further validation is needed.

    Returns
    -------
    task : Task
        The task with projected points. Its mask excludes the curves that were skipped.
    faults : list of Fault
        The faults of skipped curves.

    Raises
    ------
    ValidationError
        If any other input is invalid.
    """
    space, times, points, ends, tol, offsets, mask, skip, *_ = task
    if tol is None:
        return task._replace(points=points.copy()), []
    on_space, raw = _core.validate(
        space._handle, times, points, ends, tol, offsets, None if mask is None else mask.ravel().tolist(), skip
    )
    task = task._replace(points=on_space, tol=None)
    if not raw:
        return task, []
    faults = [from_core(one, Columns.empty(0), 0.0, False) for one in raw]
    return task._replace(mask=without(mask, faults, task.batch)), faults


def without(mask: Mask | None, faults: list[Fault], batch: tuple[int, ...]) -> Mask | None:
    """Remove the curves with faults from a mask."""
    if not faults:
        return mask
    kept = np.ones(batch, bool) if mask is None else mask.copy()
    kept.flat[[fault.curve for fault in faults]] = False
    return kept


def solve_in_python(task: Task, options: Options, progress: Progress | None, solver: Solver) -> Solved:
    """Solve a validated task by a solver of unmasked curves of one length."""
    return (_one_by_one if task.offsets is not None else _unmasked)(task, options, progress, solver)


def _one_by_one(task: Task, options: Options, progress: Progress | None, solver: Solver) -> Solved:
    """Solve curves of different lengths, stored one after the other, one at a time."""
    offsets = task.offsets or []
    velocities = np.full((offsets[-1], *task.space.point_shape), np.nan, task.space.dtype)
    points = np.array(task.space._numbers(task.points))
    columns, faults = Columns.empty(len(offsets) - 1), []
    for i, (start, stop) in enumerate(pairwise(offsets)):
        if task.mask is not None and not task.mask[i]:
            points[start:stop] = np.nan
            continue
        ends = map_ends(task.ends, operator.itemgetter(slice(i, i + 1)))
        one = Task(task.space, task.times[start:stop], task.points[None, start:stop], ends, None)
        solution = solver(one, options, progress and partial(_advance, progress, start, offsets[-1]))
        velocities[start:stop] = solution.velocities[0]
        columns.put([i], solution.columns)
        faults += [fault._replace(curve=i) for fault in solution.faults]
    return Solved(points, velocities, columns, faults)


def _unmasked(task: Task, options: Options, progress: Progress | None, solver: Solver) -> Solved:
    """Solve the unmasked curves of a batch."""
    if task.mask is None or task.mask.all():
        return solver(task._replace(mask=None), options, progress)
    batch, chosen = task.batch, np.flatnonzero(task.mask)
    columns = Columns.empty(task.mask.size)
    if not chosen.size:
        nothing = np.full((*batch, task.times.shape[-1], *task.space.point_shape), np.nan, task.space.dtype)
        return Solved(nothing, nothing.copy(), columns, [])

    def rows(array: Array) -> Array:
        return np.ascontiguousarray(array.reshape(-1, *array.shape[len(batch) :])[chosen])

    times = rows(task.times) if task.times.ndim > 1 else task.times
    inner = task.inner and {node: rows(vectors) for node, vectors in task.inner.items()}
    ends = map_ends(task.ends, rows)
    some = task._replace(times=times, points=rows(task.points), ends=ends, inner=inner, mask=None)
    solution = solver(some, options, progress)
    columns.put(chosen, solution.columns)
    points, velocities = (in_batch(batch, chosen, item) for item in (solution.points, solution.velocities))
    return Solved(
        points, velocities, columns, [item._replace(curve=int(chosen[item.curve])) for item in solution.faults]
    )


def in_batch(batch: tuple[int, ...], chosen: NDArray[np.intp] | None, column: object) -> Any:
    """Return values of some curves as an array over the whole batch; the others are NaN, False or zero."""
    if chosen is None:
        return column
    rows = np.asarray(column)
    out = np.full((math.prod(batch), *rows.shape[1:]), np.nan if rows.dtype.kind in "fc" else 0, rows.dtype)
    out[chosen] = rows
    return out.reshape(*batch, *rows.shape[1:])


def _advance(progress: Progress, before: int, total: int, finished: int, _: int) -> object:
    return progress(before + finished, total)

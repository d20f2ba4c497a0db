"""What the compiled core fits, and the one place where it is asked to."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..report import Columns
from ..spaces import Array, Space
from .ends import End

Progress = Callable[[int, int], object]
Fault = tuple[int, str, str]
"""The number of a curve, ``"cut-locus"``, ``"unconverged"`` or `ALMOST_CUT`, and what there is to say."""
ALMOST_CUT = "almost-cut"
"""Of a curve that is good, but would go the other way round with a little more."""


def failures(faults: list[Fault]) -> list[Fault]:
    """Those of curves that are not good."""
    return [fault for fault in faults if fault[1] != ALMOST_CUT]


class Options(NamedTuple):
    """How to solve, as `symspline.CubicSpline` takes it."""

    method: str
    tol: float
    max_iter: int | None


class Task(NamedTuple):
    """Points to join by curves.

    Attributes:
        space: not a product.
        times: knots, shape (N+1,), or (..., N+1) with one row per curve; with ``offsets`` all in one row.
        points: contiguous doubles, shape (..., N+1, *doubles of a point).
        ends: conditions at both ends, None for closed curves.
        tol: how far off the space points may be; None if nothing is to be checked.
        offsets: where curves of different lengths begin in one long row of points, and where the last ends.
    """

    space: Space
    times: NDArray[np.float64]
    points: NDArray[np.float64]
    ends: list[End] | None
    tol: float | None
    offsets: list[int] | None = None


class Solved(NamedTuple):
    """Points on the space, velocities there, the columns of the report, and which curves failed."""

    points: Array
    velocities: Array
    columns: Columns
    faults: list[Fault]


def solve(task: Task, options: Options, progress: Progress | None = None, dry: bool = False) -> Solved:
    """Check and solve; if ``dry``, check only."""
    space, times, points, ends, tol, offsets = task
    found, velocities, columns, faults = _core.fit(
        space._handle, times, points, ends, *options, tol is not None, tol or 0.0, offsets, progress, dry
    )
    return Solved(space._numbers(found), space._numbers(velocities), Columns(*columns), faults)


def checked(task: Task, options: Options) -> Task:
    """The task with its points copied and moved onto the space, so that nothing is left to check.

    Raises:
        ValidationError: something is wrong with it.
    """
    points = solve(task, options, dry=True).points
    return task._replace(points=task.space._as_doubles(points), tol=None)


def one_by_one(
    task: Task,
    offsets: list[int],
    options: Options,
    progress: Progress | None,
    solve_one: Callable[[Task, Options, Progress | None], Solved],
) -> Solved:
    """Curves that follow each other in one array, of different lengths, each solved by itself; nothing is checked."""
    each = []
    for i, (start, stop) in enumerate(pairwise(offsets)):
        ends = task.ends and [
            (kind, None if value is None else value[i : i + 1]) for kind, value in task.ends
        ]
        one = Task(task.space, task.times[start:stop], task.points[None, start:stop], ends, None)
        each.append(solve_one(one, options, progress and partial(_advance, progress, start, offsets[-1])))
    faults = [
        (i, kind, why.replace(" of curve 0", f" of curve {i}"))
        for i, found in enumerate(each)
        for _, kind, why in found.faults
    ]
    return Solved(
        task.space._numbers(task.points),
        np.concatenate([found.velocities[0] for found in each]),
        Columns.joined([found.columns for found in each]),
        faults,
    )


def _advance(progress: Progress, before: int, total: int, finished: int, _: int) -> object:
    return progress(before + finished, total)

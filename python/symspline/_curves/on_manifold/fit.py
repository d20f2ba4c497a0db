"""Fits on manifolds made of functions: the C² curves, and the faults of those not found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..._base.faults import CUT_LOCUS, Fault, unconverged
from ..._base.report import SOLVERS, Columns
from ..._base.typing import Progress
from ..._spaces import Array, Doubles
from ...manifolds._manifold import Manifold
from ...manifolds._operations import frames_along
from ..solve import Options, Solved, Task
from .condition import ControlPolygon, End, Problem, control_polygons, not_a_knot
from .iteration import FLOOR, iterate

# Rounding of points in residuals of speed, for points that are so near to each other that it is more than `FLOOR`.
_ROUNDING = 1e3 * np.finfo(float).eps


def fit_of_one_length(task: Task, options: Options, progress: Progress | None) -> Solved:
    """Fit the curves of a validated task, which all have the same length."""
    space, shape = task.space, task.space.point_shape
    assert isinstance(space, Manifold)
    operations = space.operations
    points = space._numbers(task.points)
    batch, nodes = points.shape[: -len(shape) - 1], points.shape[-len(shape) - 1]
    count = math.prod(batch)
    p = points.reshape(count, nodes, *shape)
    h = np.broadcast_to(np.diff(task.times), (*batch, nodes - 1)).reshape(count, nodes - 1)
    steps = operations.log(p[:, :-1], p[:, 1:])
    lengths = operations.norm(p[:, :-1], steps)
    names = range(nodes) if task.names is None else task.names
    faults = _far(space, lengths, "points[{0}] and points[{1}]", names)
    good = np.array([i for i in range(count) if i not in faults], np.int64)
    velocities = np.full(p.shape, np.nan, space.dtype)
    columns = Columns.empty(count)
    columns.row("residual")[:], columns.row("solver")[:] = np.inf, SOLVERS.index("quasi-newton")
    columns.row("max_step")[good] = lengths[good].max(axis=1)
    if good.size:
        ends = _ends(task, h, p)
        frames = frames_along(operations, p)
        problem = Problem(operations, h, p, frames, operations.forms(p, frames), ends).take_batch(good)
        start = np.zeros((good.size, nodes - (ends is None), problem.frames.shape[2]))
        for which, end in enumerate(problem.ends or []):
            if end.kind == "velocity" and end.vector is not None:
                node = 0 if which == 0 else nodes - 1
                start[:, node] = problem.coordinates(end.vector[:, None], slice(node, node + 1))[:, 0]
        scale = np.abs(p[good]).reshape(good.size, -1).max(axis=1)
        longest = columns.row("max_step")[good]
        floor = np.maximum(FLOOR, _ROUNDING * scale / np.where(longest > 0, longest, 1.0))
        pace = (lengths[good] / h[good]).max(axis=1)
        advance = None if progress is None else partial(_report, progress, nodes, count)
        found = iterate(problem, start, pace, floor, options.tol, options.max_iter, advance)
        velocities[good] = found.velocities
        for name in ("converged", "iterations", "residual", "rate"):
            columns.row(name)[good] = getattr(found, name)
        polygon = control_polygons(operations, problem.h, problem.p, found.velocities)
        faults |= _unfit(space, polygon, good, columns, options.tol, names)
        for i in faults:
            if faults[i].kind == CUT_LOCUS:
                velocities[i] = np.nan
                columns.row("converged")[i], columns.row("residual")[i] = False, np.inf
    return Solved(points, velocities.reshape(points.shape), columns, [faults[i] for i in sorted(faults)])


def _report(progress: Progress, nodes: int, count: int, finished: int) -> object:
    return progress(finished * nodes, count * nodes)


def _ends(task: Task, h: Doubles, p: Array) -> list[End] | None:
    """Return end conditions with the numbers of points; with two points not-a-knot is the velocity of the chord."""
    if task.ends is None:
        return None
    space = task.space
    assert isinstance(space, Manifold)
    found = []
    for which, (kind, value) in enumerate(task.ends):
        if kind != "not-a-knot":
            found.append(End(kind, None if value is None else space._numbers(value).reshape(p[:, 0].shape)))
        elif p.shape[1] > 2:
            found.append(not_a_knot(space.operations, p, which))
        else:
            chord = space.operations.log(p[:, -which], p[:, 1 - which])
            width = h.reshape(-1, *[1] * len(space.point_shape))
            found.append(End("velocity", (chord if which == 0 else -chord) / width))
    return found


def _far(space: Manifold, lengths: Doubles, what: str, names: Sequence[int]) -> dict[int, Fault]:
    """Return the faults of curves with two points that are not joined by a unique geodesic."""
    faults: dict[int, Fault] = {}
    limit = space.injectivity_radius
    for curve, i in np.argwhere(~(lengths < limit)).tolist():
        distance = lengths[curve, i]
        why = f"are {distance:.6g} apart, the injectivity radius is {limit:.6g}"
        if not np.isfinite(distance):
            why = f"have no geodesic between them: the function log of {space!r} is not finite there"
        problem = f"{what.format(names[i], names[i + 1])}{{of}} {why}"
        fault = Fault(curve, CUT_LOCUS, problem, space._remedy, names[i], float(distance), limit)
        faults.setdefault(curve, fault)
    return faults


def _unfit(
    space: Manifold,
    polygon: ControlPolygon,
    good: NDArray[np.int64],
    columns: Columns,
    tol: float,
    names: Sequence[int],
) -> dict[int, Fault]:
    """Return the faults of curves that were solved."""
    faults: dict[int, Fault] = {}
    norm = space.operations.norm
    outer = np.maximum(*norm(polygon.p, polygon.v))
    inner = norm(polygon.q[0], polygon.w[0])
    far = _far(space, np.maximum(outer, inner), "the control points between points[{0}] and points[{1}]", names)
    for number, own in enumerate(good.tolist()):
        if not columns.row("converged")[own]:
            faults[own] = unconverged(own, columns, tol, "; exp, log and dlog must fit each other")
        elif number in far:
            faults[own] = far[number]._replace(curve=own)
    return faults

"""Validation of the points, tangent vectors and times of curves on manifolds made of functions."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..._base.faults import INVALID, Fault, of_curve
from ..._core import CutLocusError, ValidationError
from ..._spaces import Array, Euclidean
from ...manifolds._manifold import Manifold
from ..ends import map_ends
from ..solve import Options, Task, validate, without
from .condition import control_polygons

_METHODS = ("auto", "quasi-newton")


def validate_on_manifold(task: Task, options: Options) -> tuple[Task, list[Fault]]:
    """Validate a task and project its points onto the space. Return the task and the faults of skipped curves."""
    space = task.space
    assert isinstance(space, Manifold)
    shape = space._doubles_shape
    width = math.prod(shape)
    if options.method not in _METHODS:
        raise ValidationError(
            f"method {options.method!r} is not available on a manifold made of functions, {space!r}; "
            f"use {' or '.join(map(repr, _METHODS))}"
        )
    if task.tol is None:
        return task._replace(points=task.points.copy()), []
    # Numbers, times and whether the curve is closed do not depend on the space.
    flat = task._replace(
        space=Euclidean(width),
        points=task.points.reshape(*task.points.shape[: -len(shape)], width),
        ends=map_ends(task.ends, lambda v: v.reshape(*v.shape[: -len(shape)], width)),
    )
    flat, faults = validate(flat)
    points = np.array(space._numbers(task.points))
    rows = points.reshape(-1, *space.point_shape)
    lengths = np.diff(task.offsets or [0, points.shape[-len(shape) - 1]])
    curve_of_row = np.repeat(np.arange(math.prod(task.batch)), lengths)
    wanted = np.ones(math.prod(task.batch), bool) if flat.mask is None else flat.mask.ravel().copy()
    while True:
        used = np.flatnonzero(wanted[curve_of_row])
        off = space.operations.first_off(rows[used], task.tol) if used.size else None
        if off is None:
            break
        curve = int(curve_of_row[used[off[0]]])
        node = int(used[off[0]] - np.searchsorted(curve_of_row, curve))
        fault = Fault(curve, INVALID, f"points[{node}]{{of}} is off the space{off[1]}", node=node)
        if not task.skip_invalid:
            error = ValidationError(fault.message(task.batch))
            error.curve, error.node = fault.batch_index(task.batch), node
            raise error
        faults.append(fault)
        wanted[curve] = False
    if space.functions.project is not None and used.size:
        rows[used] = space.operations.project(rows[used])
    _check_ends(task, points, task.tol, np.flatnonzero(wanted))
    if task.ends is None:
        for start, stop in pairwise(task.offsets or [0, points.shape[-len(shape) - 1]]):
            index = (..., stop - 1, *[slice(None)] * len(shape))
            points[index] = points[(..., start, *[slice(None)] * len(shape))]
    mask = without(flat.mask, faults, task.batch)
    return task._replace(points=space._as_doubles(np.ascontiguousarray(points)), tol=None, mask=mask), faults


def _check_ends(task: Task, points: Array, tol: float, wanted: NDArray[np.int64]) -> None:
    """Raise unless the end vectors are tangent and the control handles of velocities end inside the cut locus."""
    space, axes = task.space, len(task.space.point_shape)
    assert isinstance(space, Manifold)
    if task.offsets is None:
        at = [np.take(points, i, axis=-1 - axes) for i in (0, -1)]
        gaps = np.diff(task.times)
        h = [gaps[..., 0], gaps[..., -1]]
    else:
        first, last = np.array(task.offsets[:-1]), np.array(task.offsets[1:]) - 1
        at = [points[first], points[last]]
        h = [task.times[first + 1] - task.times[first], task.times[last] - task.times[last - 1]]
    for (kind, value), name, p, own in zip(task.ends or [], ("start", "end"), at, h, strict=False):
        if value is None or not wanted.size:
            continue
        v = np.broadcast_to(space._numbers(value), p.shape)
        rows = [np.ascontiguousarray(x).reshape(-1, *space.point_shape)[wanted] for x in (p, v)]
        defect = space.operations.tangent_defects(*map(space._as_doubles, rows))
        bad = np.flatnonzero(~(defect <= tol))
        if bad.size:
            raise ValidationError(
                f"the {name} {kind}{of_curve(wanted[bad[0]], task.batch)} is not tangent at its point: its normal "
                f"component is {defect[bad[0]]:.3e} (allowed: {tol:.0e}); use space.project_tangent(p, v)"
            )
        if kind == "velocity":
            speed = space.operations.norm(*rows)
            most = (3 * space.injectivity_radius / np.broadcast_to(own, task.batch)).ravel()[wanted]
            bad = np.flatnonzero(~(speed < most))
            if bad.size:
                raise ValidationError(
                    f"the {name} velocity{of_curve(wanted[bad[0]], task.batch)} has speed {speed[bad[0]]:.6g}, too "
                    "fast for its segment: its control handle would be longer than the injectivity radius; the speed "
                    f"must stay below {most[bad[0]]:.6g}"
                )


def hermite_on_manifold(task: Task, velocities: Array) -> tuple[Array, Array]:
    """Return points on the space and tangent velocities of a Hermite spline.

    Raises
    ------
    ValidationError
        If points or times are invalid, or a velocity is not tangent.
    CutLocusError
        If the inner control points of a segment are at or past each other's cut locus.
    """
    space = task.space
    assert isinstance(space, Manifold)
    task, _ = validate_on_manifold(task, Options("auto", 0.0, None))
    p = space._numbers(task.points)
    space.check_tangent(p, velocities)
    vectors = np.ascontiguousarray(space.project_tangent(p, velocities))
    nodes = p.shape[len(task.batch)]
    rows = (x.reshape(-1, nodes, *space.point_shape) for x in (p, vectors))
    h = np.broadcast_to(np.diff(task.times), (*task.batch, nodes - 1)).reshape(-1, nodes - 1)
    inner = control_polygons(space.operations, h, *rows).w[0]
    bad = np.argwhere(~np.isfinite(inner.reshape(*h.shape, -1)).all(axis=2)).tolist()
    if bad:
        curve, i = bad[0]
        raise CutLocusError(
            f"the inner control points between points[{i}] and points[{i + 1}]{of_curve(curve, task.batch)} have no "
            "unique geodesic between them: the velocities are too large for the time of the segment"
        )
    return p, vectors

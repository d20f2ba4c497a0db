"""What a curve on a manifold made of functions is given: points on it, tangent vectors, times."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from .._core import ValidationError
from ..manifolds import Manifold
from ..spaces import Array, Euclidean
from .solve import Options, Task, solve

_METHODS = ("auto", "quasi-newton")


def checked(task: Task, options: Options) -> Task:
    """A task whose input is good, with its points on the space; else ValidationError."""
    space = task.space
    assert isinstance(space, Manifold)
    shape = space._doubles_shape
    width = math.prod(shape)
    if options.method not in _METHODS:
        raise ValidationError(
            f"method {options.method!r} is not made on a manifold that is made of functions, {space!r}; "
            f"use {' or '.join(map(repr, _METHODS))}"
        )
    # Numbers, times and whether the curve is closed do not depend on the space.
    flat = task._replace(
        space=Euclidean(width),
        points=task.points.reshape(*task.points.shape[: -len(shape)], width),
        ends=task.ends
        and [
            (kind, None if v is None else v.reshape(*v.shape[: -len(shape)], width)) for kind, v in task.ends
        ],
    )
    solve(flat, options, dry=True)
    points = np.array(space._numbers(task.points))
    if task.tol is not None:
        off = space.operations.first_off(points, task.tol)
        if off is not None:
            raise ValidationError(f"points{_place(off[0], task)} is off the space{off[1]}")
        if space.functions.project is not None:
            points = space.operations.project(points)
        _check_ends(task, points, task.tol)
    if task.ends is None:
        for start, stop in pairwise(task.offsets or [0, points.shape[-len(shape) - 1]]):
            index = (..., stop - 1, *[slice(None)] * len(shape))
            points[index] = points[(..., start, *[slice(None)] * len(shape))]
    return task._replace(points=space._as_doubles(np.ascontiguousarray(points)), tol=None)


def _place(row: int, task: Task) -> str:
    """The index of a point, and its curve."""
    if task.offsets is not None:
        curve = int(np.searchsorted(task.offsets, row, side="right")) - 1
        return f"[{row - task.offsets[curve]}] of curve {curve}"
    lead = task.points.shape[: -len(task.space._doubles_shape)]
    *curves, i = np.unravel_index(row, lead)
    return f"[{i}]" + (f" of curve {','.join(map(str, curves))}" if curves else "")


def _check_ends(task: Task, points: Array, tol: float) -> None:
    """Vectors at the ends are tangent, and no velocity is so large that its leg passes the cut locus."""
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
        if value is None:
            continue
        v = np.broadcast_to(space._numbers(value), p.shape)
        rows = [np.ascontiguousarray(x).reshape(-1, *space.point_shape) for x in (p, v)]
        defect = space.operations.tangent_defects(*map(space._as_doubles, rows))
        lead = p.shape[: p.ndim - axes]

        def of(row: int, lead: tuple[int, ...] = lead) -> str:
            index = ",".join(map(str, np.unravel_index(row, lead)))
            return f" of curve {index}" if index else ""

        bad = np.flatnonzero(~(defect <= tol))
        if bad.size:
            raise ValidationError(
                f"the {name} {kind}{of(bad[0])} is not tangent at its point: a part of {defect[bad[0]]:.3e} of it "
                f"points off the space (allowed: {tol:.0e}); use space.project_tangent(p, v)"
            )
        if kind == "velocity":
            speed = space.operations.norm(*rows)
            most = 3 * space.injectivity_radius / np.broadcast_to(own, lead).ravel()
            bad = np.flatnonzero(~(speed < most))
            if bad.size:
                raise ValidationError(
                    f"the {name} velocity{of(bad[0])} has speed {speed[bad[0]]:.6g}, too fast for its segment: its "
                    f"control leg would be longer than the injectivity radius; the speed must stay below "
                    f"{most[bad[0]]:.6g}"
                )

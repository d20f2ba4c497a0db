"""Curves on manifolds that are made of functions: fitted and evaluated in Python."""

from __future__ import annotations

import math
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, Never

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._core import ValidationError
from ..manifolds import Manifold
from ..manifolds.condition import End, Legs, Problem, legs_of, not_a_knot
from ..manifolds.evaluation import Rows, derivative, points
from ..manifolds.frames import frames_along
from ..manifolds.iteration import FLOOR, iterate
from ..report import SOLVERS
from ..spaces import Array, Euclidean
from .curve import NORMS, REAL, Doubles
from .gradient import Places
from .plain import Plain
from .solve import Options, Progress, Solved, Task, one_by_one, solve

# Samples that are computed at a time.
_AT_ONCE = 1 << 12
_METHODS = ("auto", "quasi-newton")
# Rounding of points in residuals of speed, for points that are so near to each other that it is more than `FLOOR`.
_ROUNDING = 1e3 * np.finfo(float).eps


class OnManifold(Plain):
    """Curves on a `Manifold`."""

    space: Manifold
    # Derivatives are differences.
    exact = 1e-9

    @staticmethod
    def solve(task: Task, options: Options, progress: Progress | None) -> Solved:
        if task.tol is not None:
            task = OnManifold.checked(task, options)
        if task.offsets is not None:
            return one_by_one(task, task.offsets, options, progress, _solve)
        return _solve(task, options, progress)

    @staticmethod
    def checked(task: Task, options: Options) -> Task:
        return _checked(task, options)

    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        if quantity in REAL and quantity not in NORMS:
            self._refuse(f"{quantity} is that of rotations, not")
        self._check_times(x, per_curve)
        self._check_places(x, outside, per_curve)
        batch, space = self.batch, self.space
        count = math.prod(batch)
        shape = x.shape if per_curve else batch + x.shape
        each = math.prod(shape[len(batch) :])
        own = np.broadcast_to(x, shape).reshape(count, each)
        norm = quantity in NORMS
        values = np.empty(
            (count * each, *(() if norm else space.point_shape)), float if norm else space.dtype
        )
        for start in range(0, len(values), _AT_ONCE):
            number = np.arange(start, min(start + _AT_ONCE, len(values)))
            values[number] = self._at(number // max(each, 1), own.ravel()[number], quantity, outside)
            if progress is not None:
                progress(int(number[-1]) + 1, len(values))
        return values.reshape(shape + values.shape[1:])

    def _at(self, curve: NDArray[np.int64], x: Doubles, quantity: str, outside: str) -> Array:
        """A quantity at one time for each of some curves."""
        operations, rows = self.space.operations, self._rows(curve, x, outside)
        if quantity == "point":
            return points(operations, rows)
        at, vectors = derivative(operations, rows, 1 if quantity in ("velocity", "speed") else 2)
        return operations.norm(at, vectors) if quantity in NORMS else vectors

    def _rows(self, curve: NDArray[np.int64], x: Doubles, outside: str) -> Rows:
        t = (
            self._knots[curve]
            if self.times.ndim > 1
            else np.broadcast_to(self.times, (len(x), self.times.size))
        )
        first, last = t[:, 0], t[:, -1]
        if outside == "periodic":
            x = first + np.mod(x - first, last - first)
        # The segment that begins last before x; of the end the last one.
        i = np.empty(len(x), np.int64)
        if self.times.ndim == 1:
            i = np.searchsorted(self.times, x, side="right") - 1
        else:
            for c in np.unique(curve):
                i[curve == c] = np.searchsorted(self._knots[c], x[curve == c], side="right") - 1
        i = np.clip(i, 0, t.shape[1] - 2)
        number = np.arange(len(x))
        h = t[number, i + 1] - t[number, i]
        tau = (x - t[number, i]) / h
        straight = np.full(len(x), outside == "geodesic") & ((x < first) | (x > last))
        return Rows(tau, h, Legs(*(part[:, curve, i] for part in self._legs)), straight)

    @cached_property
    def _knots(self) -> Doubles:
        """Knots of every curve, in one row each."""
        nodes = self.times.shape[-1]
        return np.broadcast_to(self.times, (*self.batch, nodes)).reshape(-1, nodes)

    @cached_property
    def _legs(self) -> Legs:
        """Control polygons of all segments; kept from the first use on."""
        nodes, shape = self.times.shape[-1], self.space.point_shape
        rows = [a.reshape(-1, nodes, *shape) for a in (self.points, self.velocities)]
        return legs_of(self.space.operations, np.diff(self._knots), rows[0], rows[1])

    def _check_places(self, x: Doubles, outside: str, per_curve: bool) -> None:
        """Of a curve in flat space the core checks the same."""
        flat = np.zeros((*self.batch, self.times.shape[-1], 1))
        _core.evaluate(Euclidean(1)._handle, self.times, flat, flat, x, "point", outside, per_curve, None)

    def lift(self, *_: Any, **__: Any) -> Never:
        self._refuse("no horizontal lift is known")

    def transport(self, times: tuple[float, float], outside: str, v: Any) -> Never:
        self._refuse("parallel transport along curves is not made")

    def push(self, at: Places, bc_type: Any, points: Any, t: Any, ends: Any) -> Never:
        self._refuse("derivatives with respect to the data are not made")

    def pull(self, at: Places, bc_type: Any, cotangent: Any) -> Never:
        self._refuse("derivatives with respect to the data are not made")

    def _refuse(self, what: str) -> Never:
        raise ValidationError(f"{what} on a manifold that is made of functions, {self.space!r}")


# ---- checks ----


def _checked(task: Task, options: Options) -> Task:
    space = task.space
    assert isinstance(space, Manifold)
    shape = space._doubles_shape
    width = math.prod(shape)
    if options.method in ("newton", "fixed-point"):
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


# ---- the fit ----


def _solve(task: Task, options: Options, progress: Progress | None) -> Solved:
    """Curves of one length, which were checked."""
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
    faults = _far(space, lengths, "points[{0}] and points[{1}]", batch)
    good = np.array([i for i in range(count) if i not in faults], np.int64)
    velocities = np.full(p.shape, np.nan, space.dtype)
    columns = _no_columns(count)
    columns[3][good] = lengths[good].max(axis=1)
    if good.size:
        ends = _ends(task, h, p)
        problem = Problem(operations, h, p, frames_along(operations, p), ends).some(good)
        start = np.zeros((good.size, nodes - (ends is None), problem.frames.shape[2]))
        for which, end in enumerate(problem.ends or []):
            if end.kind == "velocity" and end.vector is not None:
                node = 0 if which == 0 else nodes - 1
                start[:, node] = problem.coordinates(end.vector[:, None], slice(node, node + 1))[:, 0]
        scale = np.abs(p[good]).reshape(good.size, -1).max(axis=1)
        longest = columns[3][good]
        floor = np.maximum(FLOOR, _ROUNDING * scale / np.where(longest > 0, longest, 1.0))
        pace = (lengths[good] / h[good]).max(axis=1)
        advance = None if progress is None else partial(_report, progress, nodes, count)
        found = iterate(problem, start, pace, floor, options.tol, options.max_iter, advance)
        velocities[good] = found.velocities
        for column, own in zip(
            (0, 1, 2, 4), (found.converged, found.iterations, found.residual, found.rate), strict=True
        ):
            columns[column][good] = own
        legs = legs_of(operations, problem.h, problem.p, found.velocities)
        faults |= _unfit(space, problem, legs, good, found.converged, columns, options, batch)
        for i in faults:
            if faults[i][0] == "cut-locus":
                velocities[i] = np.nan
                columns[0][i], columns[2][i] = False, np.inf
    return Solved(
        points,
        velocities.reshape(points.shape),
        tuple(columns),
        [(i, *faults[i]) for i in sorted(faults)],
    )


def _report(progress: Progress, nodes: int, count: int, finished: int) -> object:
    return progress(finished * nodes, count * nodes)


def _no_columns(count: int) -> list[NDArray[Any]]:
    """As the compiled core writes them: converged, iterations, residual, longest step, rate, solver, radius."""
    columns: list[NDArray[Any]] = [np.full(count, np.nan) for _ in range(8)]
    columns[0], columns[1] = np.zeros(count, bool), np.zeros(count, np.int64)
    columns[2] = np.full(count, np.inf)
    columns[5] = np.full(count, SOLVERS.index("quasi-newton"))
    return columns


def _ends(task: Task, h: Doubles, p: Array) -> list[End] | None:
    """End conditions with numbers in place of doubles; with two points not-a-knot is the chord's velocity."""
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
            leg = space.operations.log(p[:, -which], p[:, 1 - which])
            width = h.reshape(-1, *[1] * len(space.point_shape))
            found.append(End("velocity", (leg if which == 0 else -leg) / width))
    return found


def _far(space: Manifold, lengths: Doubles, what: str, batch: tuple[int, ...]) -> dict[int, tuple[str, str]]:
    """Curves of which two points have no geodesic between them that is known to be the only one."""
    faults: dict[int, tuple[str, str]] = {}
    limit = space.injectivity_radius
    for curve, i in np.argwhere(~(lengths < limit)).tolist():
        of = _of(curve, batch)
        distance = lengths[curve, i]
        why = (
            f"are {distance:.6g} apart, the injectivity radius is {limit:.6g}"
            if np.isfinite(distance)
            else f"have no geodesic between them: the function log of {space!r} is not finite there"
        )
        faults.setdefault(
            curve, ("cut-locus", f"{what.format(i, i + 1)}{of} {why}; put a point between them")
        )
    return faults


def _unfit(
    space: Manifold,
    problem: Problem,
    legs: Legs,
    good: NDArray[np.int64],
    converged: NDArray[np.bool_],
    columns: list[NDArray[Any]],
    options: Options,
    batch: tuple[int, ...],
) -> dict[int, tuple[str, str]]:
    """What is wrong with curves that were solved."""
    faults: dict[int, tuple[str, str]] = {}
    norm = space.operations.norm
    outer = np.maximum(*norm(legs.p, legs.v))
    inner = norm(legs.q[0], legs.w[0])
    far = _far(
        space, np.maximum(outer, inner), "the control points between points[{0}] and points[{1}]", batch
    )
    for number, own in enumerate(good):
        i = int(own)
        if converged[number] and number in far:
            kind, why = far[number]
            faults[i] = kind, why.replace(_of(number, batch), _of(i, batch)) if batch else why
        elif not converged[number]:
            faults[i] = (
                "unconverged",
                f"no convergence{_of(i, batch)}: residual {columns[2][i]:.3e} after {columns[1][i]} iterations (tol "
                f"{options.tol:.1e}, longest step {columns[3][i]:.3f}); put more points where steps are long, choose "
                "times that suit the distances, or raise max_iter; exp, log and dlog must fit each other",
            )
    return faults


def _of(curve: int, batch: tuple[int, ...]) -> str:
    return f" of curve {','.join(map(str, map(int, np.unravel_index(curve, batch))))}" if batch else ""

"""Fits of C² curves on manifolds made of functions: validation, the C² condition and its solver."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.faults import CUT_LOCUS, INVALID, Fault, from_core, of_curve, unconverged
from .._base.report import SOLVERS, Columns
from .._base.typing import Array, Progress
from .._core import CutLocusError, ValidationError, solve_tridiagonal
from .._spaces import Doubles, Euclidean
from ..manifolds._manifold import Manifold
from ..manifolds._operations import Operations, basis_at, frames_along, products
from .ends import End as Condition
from .ends import map_ends, original_nodes
from .on_manifold import ControlPolygon, control_polygons, handles
from .solve import Options, Solved, Task, validate, without

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
        gaps = np.diff(task.times[..., original_nodes(task.ends, task.times.shape[-1])])
        h = [gaps[..., 0], gaps[..., -1]]
    else:
        first, last = np.array(task.offsets[:-1]), np.array(task.offsets[1:]) - 1
        at = [points[first], points[last]]
        h = [task.times[first + 1] - task.times[first], task.times[last] - task.times[last - 1]]
    for kind, value, name, p, width in _prescribed(task, at, h):
        if not wanted.size:
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
            most = (3 * space.injectivity_radius / np.broadcast_to(width, task.batch)).ravel()[wanted]
            bad = np.flatnonzero(~(speed < most))
            if bad.size:
                raise ValidationError(
                    f"the {name} velocity{of_curve(wanted[bad[0]], task.batch)} has speed {speed[bad[0]]:.6g}, too "
                    "fast for its segment: its control handle would be longer than the injectivity radius; the speed "
                    f"must stay below {most[bad[0]]:.6g}"
                )


def _prescribed(
    task: Task, points: list[Array], h: list[Doubles]
) -> Iterator[tuple[str, Doubles, str, Array, Doubles]]:
    """Yield the kind of each prescribed vector, the vector, the name of its end, the point and the segment's length."""
    for which, (kind, value) in enumerate(task.ends or []):
        rest = ("start", "end")[which], points[which], h[which]
        if value is None:
            continue
        if kind != "both":
            yield kind, value, *rest
            continue
        for i, part in enumerate(("velocity", "acceleration")):
            yield part, np.take(value, i, axis=len(task.batch)), *rest


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


# ---- the C² condition on any manifold, in the form of Popiel and Noakes (J. Approx. Theory 148, 2007) ----


class Joint(NamedTuple):
    """The segment between an end with two conditions and the additional knot; see `fit/joint.rs` of the core.

    Attributes
    ----------
    first, second : ndarray, shape (curves, *point_shape)
        The control points b₁ and b₂ of this segment, beginning at the end.
    apart : ndarray, shape (curves,)
        Its length in time.
    """

    first: Array
    second: Array
    apart: Doubles


class End(NamedTuple):
    """A condition at one end of curves.

    Attributes
    ----------
    kind : {"natural", "velocity", "acceleration", "not-a-knot", "both"}
        Kind of condition.
    vector : ndarray, shape (curves, *point_shape), or None
        Prescribed vector.
    logs : ndarray, shape (2, curves, *point_shape), or None
        For not-a-knot, the logarithms of the end and of the third point, at the point next to the end.
    joint : Joint or None
        For a velocity and an acceleration.
    """

    kind: str
    vector: Array | None = None
    logs: Array | None = None
    joint: Joint | None = None

    def take_batch(self, chosen: NDArray[np.int64]) -> End:
        """Return the condition for some of the curves."""
        return End(
            self.kind,
            None if self.vector is None else self.vector[chosen],
            None if self.logs is None else self.logs[:, chosen],
            None if self.joint is None else Joint(*(part[chosen] for part in self.joint)),
        )


class Problem(NamedTuple):
    """Curves with unknown velocities.

    Attributes
    ----------
    h : ndarray, shape (curves, N)
        Times between the points.
    p : ndarray, shape (curves, N+1, *point_shape)
        Points.
    frames : ndarray, shape (curves, N+1, dim, numbers of a point)
        Orthonormal frames at the points.
    forms : ndarray of the same shape, or None
        The frames as linear forms, if the manifold has them.
    ends : list of End, or None
        Conditions at both ends, None for closed curves.
    given : tuple of int
        Inner nodes at which the velocity is prescribed instead of the C² condition.
    """

    operations: Operations
    h: Doubles
    p: Array
    frames: Array
    forms: Array | None
    ends: list[End] | None
    given: tuple[int, ...] = ()

    def take_batch(self, chosen: NDArray[np.int64]) -> Problem:
        """Return the problem of some of the curves."""
        ends = self.ends and [end.take_batch(chosen) for end in self.ends]
        forms = None if self.forms is None else self.forms[chosen]
        return self._replace(h=self.h[chosen], p=self.p[chosen], frames=self.frames[chosen], forms=forms, ends=ends)

    def velocities(self, coordinates: Doubles) -> Array:
        """Velocities at all points, of their coordinates in the frames."""
        nodes = coordinates.shape[1]
        u = np.einsum("cna,cnai->cni", coordinates, self.frames[:, :nodes])
        u = u.reshape(*u.shape[:2], *self.p.shape[2:])
        return np.concatenate([u, u[:, :1]], axis=1) if self.ends is None else u

    def coordinates(self, vectors: Array, nodes: slice) -> Doubles:
        """Coordinates of vectors at some nodes of every curve."""
        if self.forms is not None:
            flat = vectors.reshape(*vectors.shape[:2], -1)
            return np.asarray(np.einsum("cnai,cni->cna", self.forms[:, nodes], flat))
        frames = self.frames[:, nodes]
        frames = frames.reshape(*frames.shape[:3], *self.p.shape[2:])
        pairs = np.broadcast_to(self.p[:, nodes, None], frames.shape)
        return self.operations.inner(pairs, frames, np.broadcast_to(vectors[:, :, None], frames.shape))


def c2_residuals(problem: Problem, u: Array) -> Doubles:
    """Return the C² residuals at every node as coordinates: a sixth of the jump of the acceleration, and at an end with
    not-a-knot the error of the velocity."""
    bends = problem.operations.bends(*handles(problem.h, problem.p, u))
    h = problem.h
    square = (h * h).reshape(*h.shape, *[1] * (u.ndim - 2))
    starts, stops = bends / square
    if problem.ends is None:
        jumps = np.concatenate([starts[:, :1] - stops[:, -1:], starts[:, 1:] - stops[:, :-1]], axis=1)
        residual = np.array(problem.coordinates(jumps, slice(0, h.shape[1])))
        residual[:, problem.given] = 0.0
        return residual
    jumps = np.concatenate([starts[:, :1], starts[:, 1:] - stops[:, :-1], -stops[:, -1:]], axis=1)
    # A copy: inner products of other libraries may be read-only arrays.
    residual = np.array(problem.coordinates(jumps, slice(None)))
    residual[:, problem.given] = 0.0
    for which, end in enumerate(problem.ends):
        sign, node = (1, 0) if which == 0 else (-1, h.shape[1])
        if end.kind == "velocity":
            residual[:, node] = 0.0
        elif end.logs is not None:
            residual[:, node] = _not_a_knot(problem, u, which, *end.logs)
        elif end.joint is not None:
            residual[:, node] = _joint_residual(problem, u, which, end.joint)
        elif end.vector is not None:
            given = problem.coordinates(end.vector[:, None], slice(node, node + 1))
            residual[:, node] -= sign * given[:, 0] / 6
    return residual


def _joint_residual(problem: Problem, u: Array, which: int, joint: Joint) -> Doubles:
    """Return the C² residual at the additional knot, in the frame at the end.

    The unknown of the end is the first control point after this knot, as its handle from the end.
    """
    operations, node, beside = problem.operations, -which, 1 - 3 * which
    p, apart, h = problem.p[:, node], *(wide(x, u[:, 0]) for x in (joint.apart, problem.h[:, node]))
    third = (h if which == 0 else -h) / 3
    after = operations.exp(p, third * u[:, node])
    a = additional_points(operations, joint, problem.h[:, node], after)
    q = np.stack([joint.second, after])
    following = np.stack([joint.first, operations.exp(problem.p[:, beside], -third * u[:, beside])])
    at = np.stack([a, a])
    v = operations.log(at, q)
    before, behind = operations.dlog(at, v, q, operations.log(q, following)) - v
    jump = operations.dlog(p, operations.log(p, a), a, behind / h**2 - before / apart**2)
    residual = problem.coordinates(jump[:, None], slice(node, node + 1 or None))[:, 0]
    return residual if which == 0 else -residual


def additional_points(operations: Operations, joint: Joint, h: Doubles, after: Array) -> Array:
    """Return the points between the control points before and after them; h is the time of the segment after them."""
    share = wide(joint.apart / (joint.apart + h), after)
    return operations.exp(joint.second, share * operations.log(joint.second, after))


def joint_of(
    operations: Operations, p: Array, velocity: Array, acceleration: Array, apart: Doubles, which: int
) -> Joint:
    """Return the segment that begins with a velocity and an acceleration. At the last point time runs backwards."""
    h = wide(apart if which == 0 else -apart, p)
    v = h / 3 * velocity
    first = operations.exp(p, v)
    basis = basis_at(operations, first)
    basis = basis.reshape(*basis.shape[:2], *p.shape[1:])
    starts, handles, ends = (np.broadcast_to(x[:, None], basis.shape) for x in (p, v, first))
    images = operations.dlog(starts, handles, ends, basis)
    right = products(operations, p, images, (v + h**2 / 6 * acceleration)[:, None])
    weights = np.linalg.solve(products(operations, p, images, images), right)
    way = np.einsum("ck,ck...->c...", weights[..., 0], basis)
    # Beyond the cut locus of b₁, the geodesic to b₂ would be another one.
    way[~(operations.norm(first, way) < operations.injectivity_radius())] = np.nan
    return Joint(first, operations.exp(first, way), apart)


def wide(numbers: Doubles, points: Array) -> Doubles:
    """Return one number per curve with the axes of points."""
    return numbers.reshape(-1, *[1] * (points.ndim - 1))


def is_parabola(problem: Problem) -> bool:
    """Whether both ends of three points are not-a-knot: then the cubic is a parabola, which needs no velocity."""
    return problem.h.shape[1] == 2 and all(end.kind == "not-a-knot" for end in problem.ends or [End("")])


def not_a_knot(operations: Operations, p: Array, which: int) -> End:
    """Not-a-knot at an end of curves with points p, three or more."""
    end, mid, far = (0, 1, 2) if which == 0 else (-1, -2, -3)
    logs = operations.log(np.stack([p[:, mid], p[:, mid]]), np.stack([p[:, end], p[:, far]]))
    return End("not-a-knot", None, logs)


def _not_a_knot(problem: Problem, u: Array, which: int, x0: Array, x2: Array) -> Doubles:
    """In normal coordinates at the neighbouring knot the curve is one cubic c through three points, up to second
    order: c'(t₀) − D log_{p₁}(p₀)[u₀], in the frame at p₁."""
    operations, p = problem.operations, problem.p
    end, mid = (0, 1) if which == 0 else (-1, -2)
    # Seen from the last knot time runs backwards.
    sign = 1.0 if which == 0 else -1.0
    h0, h1 = (problem.h[:, i].reshape(-1, *[1] * (p.ndim - 2)) for i in ((0, 1) if which == 0 else (-1, -2)))
    left, right = -x0 / h0, x2 / h1
    bend = (right - left) / (h0 + h1)
    slope = left - h0 * bend
    if not is_parabola(problem):
        # The parabola's slope in the middle is left + h0 * bend; a cubic term changes it to the given one.
        slope = slope - (sign * u[:, mid] - left - h0 * bend) * (h0 + h1) / h1
    wanted = sign * slope - operations.dlog(p[:, mid], x0, p[:, end], u[:, end])
    index = 1 if which == 0 else p.shape[1] - 2
    return problem.coordinates(wanted[:, None], slice(index, index + 1))[:, 0]


# ---- fits on manifolds made of functions: the C² curves, and the faults of those not found ----

# Rounding of points in residuals of speed, for points that are so near to each other that it is more than `FLOOR`.
_ROUNDING = 1e3 * np.finfo(float).eps
# Rounds of alternating fits, and the relative change of a velocity that ends them.
_ROUNDS, _SAME = 60, 1e-13


def fit_of_one_length(task: Task, options: Options, progress: Progress | None) -> Solved:
    """Fit the curves of a validated task, which all have the same length."""
    if any(kind == "both" for kind, _ in task.ends or []):
        return _with_additional_knots(task, options, progress)
    return _fit(task, options, progress, [None, None])


def _fit(task: Task, options: Options, progress: Progress | None, joints: list[Joint | None]) -> Solved:
    """Fit curves of which some ends are joints."""
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
        ends = _ends(task, h, p, joints)
        frames = frames_along(operations, p)
        given = tuple(task.inner or ())
        problem = Problem(operations, h, p, frames, operations.forms(p, frames), ends, given).take_batch(good)
        start = np.zeros((good.size, nodes - (ends is None), problem.frames.shape[2]))
        for which, end in enumerate(problem.ends or []):
            if end.kind == "velocity" and end.vector is not None:
                node = 0 if which == 0 else nodes - 1
                start[:, node] = problem.coordinates(end.vector[:, None], slice(node, node + 1))[:, 0]
        for node, vectors in (task.inner or {}).items():
            rows = space._numbers(vectors).reshape(count, 1, *shape)[good]
            start[:, node] = problem.coordinates(rows, slice(node, node + 1))[:, 0]
        scale = np.abs(p[good]).reshape(good.size, -1).max(axis=1)
        longest = columns.row("max_step")[good]
        floor = np.maximum(FLOOR, _ROUNDING * scale / np.where(longest > 0, longest, 1.0))
        pace = (lengths[good] / h[good]).max(axis=1)
        advance = None if progress is None else partial(_report, progress, nodes, count)
        solution = iterate(problem, start, pace, floor, options.tol, options.max_iter, advance)
        velocities[good] = solution.velocities
        for name in ("converged", "iterations", "residual", "rate"):
            columns.row(name)[good] = getattr(solution, name)
        polygon = control_polygons(operations, problem.h, problem.p, solution.velocities)
        faults |= _unfit(space, polygon, good, columns, options.tol, names)
        for i in faults:
            if faults[i].kind == CUT_LOCUS:
                velocities[i] = np.nan
                columns.row("converged")[i], columns.row("residual")[i] = False, np.inf
    return Solved(points, velocities.reshape(points.shape), columns, [faults[i] for i in sorted(faults)])


def _report(progress: Progress, nodes: int, count: int, finished: int) -> object:
    return progress(finished * nodes, count * nodes)


class _Joined(NamedTuple):
    """Curves with two conditions at an end.

    Attributes
    ----------
    task : Task
        The task, with the additional knots but without their points.
    inner : ndarray
        Knots from one additional knot to the other.
    joints : list of Joint or None
        The segments before these knots.
    """

    task: Task
    inner: Doubles
    joints: list[Joint | None]

    @classmethod
    def of(cls, task: Task) -> _Joined:
        """Determine the outer segments from the conditions."""
        space, inner = task.space, task.times
        assert isinstance(space, Manifold)
        p, gaps = _rows(task), _gaps(task, task.times)
        joints: list[Joint | None] = [None, None]
        for which, (kind, value) in enumerate(task.ends or []):
            if kind == "both" and value is not None:
                v, a = np.moveaxis(space._numbers(value).reshape(len(p), 2, *space.point_shape), 1, 0)
                joints[which] = joint_of(space.operations, p[:, -which], v, a, gaps[:, -which], which)
                inner = inner[..., 1:] if which == 0 else inner[..., :-1]
        return cls(task, np.ascontiguousarray(inner), joints)

    def fit(self, ends: list[Condition], options: Options, progress: Progress | None) -> Solved:
        """Find the additional points, with these conditions at other ends, then the curve through all points."""
        task, batch = self.task, self.task.batch
        space, p, gaps = task.space, _rows(task), _gaps(task, self.inner)
        assert isinstance(space, Manifold)
        first = _fit(task._replace(times=self.inner, ends=ends), options, progress, self.joints)
        u, whole = first.velocities.reshape(p.shape), p
        for which, joint in enumerate(self.joints):
            if joint is not None:
                h = gaps[:, -which]
                third = wide((h if which == 0 else -h) / 3, p[:, 0])
                after = space.operations.exp(p[:, -which], third * u[:, -which])
                added = additional_points(space.operations, joint, h, after)
                # Without a curve, any point will do.
                lost = ~np.isfinite(added).reshape(len(added), -1).all(axis=1)
                end, beside = p[:, -which][lost], p[:, 1 - 3 * which][lost]
                added[lost] = space.operations.exp(end, space.operations.log(end, beside) / 2)
                whole = np.insert(whole, 1 if which == 0 else whole.shape[1] - 1, added, axis=1)
        points = space._as_doubles(np.ascontiguousarray(whole).reshape(*batch, whole.shape[1], *space.point_shape))
        # The velocities at the ends with two conditions.
        of_all = [
            ("velocity", np.take(value, 0, axis=len(batch))) if kind == "both" and value is not None else (kind, value)
            for kind, value in task.ends or []
        ]
        shift = int(self.joints[0] is not None)
        given = {node + shift: vectors for node, vectors in (task.inner or {}).items()}
        solved = _fit(task._replace(points=points, ends=of_all, inner=given), options, progress, [None, None])
        solved.columns.row("iterations")[:] += first.columns.row("iterations")
        return solved._replace(faults=_unattained(first, solved, shift))


def _with_additional_knots(task: Task, options: Options, progress: Progress | None) -> Solved:
    """Fit curves with two conditions at an end."""
    joined, ends = _Joined.of(task), list(task.ends or [])
    other = [which for which, (kind, _) in enumerate(ends) if kind == "not-a-knot"]
    if not other or _rows(task).shape[1] > 3:
        return joined.fit(ends, options, progress)
    # This condition depends on the additional point, too: fits with a velocity there alternate with fits of all points,
    # as in `fit/conditions.rs` of the core.
    space, which, batch = task.space, other[0], task.batch
    given, before, factor = np.zeros(0), np.zeros(0), np.ones(0)
    for round_ in range(_ROUNDS):
        vector = space._as_doubles(given.reshape(*batch, *space.point_shape)) if round_ else None
        ends[which] = ("velocity", vector) if round_ else ("natural", None)
        solved = joined.fit(ends, options, progress)
        new = np.take(solved.velocities, -which, axis=len(batch)).reshape(math.prod(batch), -1)
        if round_ == 0:
            given, factor = new, np.ones((len(new), 1))
            continue
        step = new - given
        if not (np.linalg.norm(step, axis=1) > _SAME * np.linalg.norm(new, axis=1)).any():
            break
        if round_ > 1:
            change = step - before
            factor = -factor * np.sum(before * change, axis=1, keepdims=True)
            factor /= np.maximum(np.sum(change * change, axis=1, keepdims=True), np.finfo(float).tiny)
        given, before = given + factor * step, step
    return solved


def _rows(task: Task) -> Array:
    """Return points of shape (curves, nodes, *point_shape)."""
    points = task.space._numbers(task.points)
    return points.reshape(math.prod(task.batch), points.shape[len(task.batch)], *task.space.point_shape)


def _gaps(task: Task, times: Doubles) -> Doubles:
    """Return the lengths of the segments between knots, shape (curves, segments)."""
    return np.broadcast_to(np.diff(times), (*task.batch, times.shape[-1] - 1)).reshape(
        math.prod(task.batch), times.shape[-1] - 1
    )


def _unattained(first: Solved, solved: Solved, shift: int) -> list[Fault]:
    """Return the faults of curves with additional points, of which the first fit determined these points."""
    faults = {fault.curve: fault for fault in solved.faults}
    converged = solved.columns.row("converged")
    for fault in first.faults:
        if fault.kind == CUT_LOCUS:
            faults[fault.curve] = fault._replace(node=fault.node and fault.node + shift)
        elif converged[fault.curve]:
            raw = (fault.curve, "unattained", None, math.nan, math.nan, None)
            faults[fault.curve] = from_core(raw, solved.columns, 0.0, False)
        converged[fault.curve] = 0
    return [faults[i] for i in sorted(faults)]


def _ends(task: Task, h: Doubles, p: Array, joints: list[Joint | None]) -> list[End] | None:
    """Return end conditions with the numbers of points; with two points not-a-knot is the velocity of the chord."""
    if task.ends is None:
        return None
    space = task.space
    assert isinstance(space, Manifold)
    conditions = []
    for which, (kind, value) in enumerate(task.ends):
        if joints[which] is not None:
            conditions.append(End(kind, joint=joints[which]))
        elif kind != "not-a-knot":
            conditions.append(End(kind, None if value is None else space._numbers(value).reshape(p[:, 0].shape)))
        elif p.shape[1] > 2:
            conditions.append(not_a_knot(space.operations, p, which))
        else:
            chord = space.operations.log(p[:, -which], p[:, 1 - which])
            width = h.reshape(-1, *[1] * len(space.point_shape))
            conditions.append(End("velocity", (chord if which == 0 else -chord) / width))
    return conditions


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
    for number, number_of_curve in enumerate(good.tolist()):
        if not columns.row("converged")[number_of_curve]:
            faults[number_of_curve] = unconverged(
                number_of_curve, columns, tol, "; exp, log and dlog must fit each other"
            )
        elif number in far:
            faults[number_of_curve] = far[number]._replace(curve=number_of_curve)
    return faults


# ---- velocities that make curves C²: the tridiagonal quasi-Newton iteration with Anderson mixing ----

# How many steps back are mixed.
_DEPTH = 5
# Added to their normal equations, which makes the weights of dependent steps small.
_RIDGE = 1e-13
_MOST = 200
# A residual that has not been halved in so many evaluations is where exp, log and dlog leave it, if it is below this.
_PATIENCE = 5
FLOOR = 1e-8
# So much above the best residual the iteration goes back to where that was.
_WILD = 10.0


class IterationResult(NamedTuple):
    """Result of the iteration for every curve.

    Attributes:
        velocities: at all points, the best that were found.
        converged, iterations, residual, rate: as in `symspline.Report`.
    """

    velocities: Array
    converged: NDArray[np.bool_]
    iterations: NDArray[np.int64]
    residual: Doubles
    rate: Doubles


class _Iteration:
    """The iteration of curves, in coordinates of their velocities. The first axis of every array has the curves."""

    def __init__(self, start: Doubles) -> None:
        count = len(start)
        self.x, self.best_x, self.best_step = start.copy(), start.copy(), np.zeros_like(start)
        self.best, self.first, self._mark = (np.full(count, np.inf) for _ in range(3))
        self.count, self._since = (np.zeros(count, np.int64) for _ in range(2))
        self._halvings = np.zeros(count)
        self.converged, self.done, self._mixed = (np.zeros(count, bool) for _ in range(3))
        # The last step and the last x plus step, and differences of these; those of a curve without them are zero.
        self._last, self._round = np.zeros((2, count, start[0].size)), 0
        self._changes = np.zeros((2, count, _DEPTH, start[0].size))

    def advance(self, i: NDArray[np.int64], step: Doubles, residual: Doubles, tol: float, floor: Doubles) -> None:
        """Take the steps and the residuals at x of curves i, and go on to the next x, or end."""
        self.first[i] = np.where(self.count[i] == 0, residual, self.first[i])
        self.count[i] += 1
        better = residual < self.best[i]
        new = i[better]
        self.best[new], self.best_x[new], self.best_step[new] = residual[better], self.x[new], step[better]
        best = self.best[i]
        halved = best <= self._mark[i] / 2
        self._since[i] = np.where(halved, 0, self._since[i] + 1)
        self._mark[i] = np.where(halved, best, self._mark[i])
        self._halvings[i] = np.where(halved, 0.0, self._halvings[i])
        resting = (self._since[i] >= _PATIENCE) & (best <= floor)
        self.converged[i] = self.done[i] = done = (best <= tol) | resting
        back = ~done & ~(np.isfinite(residual) & (residual <= _WILD * best))
        self._go_back(i[back])
        self._mix(i[~done & ~back], step[~done & ~back])

    def _go_back(self, i: NDArray[np.int64]) -> None:
        """Return to the best velocities, and halve the step from there."""
        self._halvings[i] += 1
        self._changes[:, i], self._mixed[i] = 0.0, False
        self.x[i] = self.best_x[i] + wide(0.5 ** self._halvings[i], self.x) * self.best_step[i]
        # Zero velocities may not have a finite step.
        self.done[i] = ~np.isfinite(self.best[i]) | (self._halvings[i] > 20)

    def _mix(self, i: NDArray[np.int64], step: Doubles) -> None:
        """Anderson's mixing (J. ACM 12, 1965): the combination of the last steps that is least."""
        now = np.stack([step, self.x[i] + step]).reshape(2, len(i), self._changes.shape[-1])
        self._changes[:, i, self._round] = np.where(self._mixed[i, None], now - self._last[:, i], 0.0)
        self._last[:, i], self._mixed[i] = now, True
        self._round = (self._round + 1) % _DEPTH
        steps, moves = self._changes if len(i) == len(self.x) else self._changes[:, i]
        # Normal equations for columns of length one.
        gram = steps @ np.swapaxes(steps, 1, 2)
        size = np.sqrt(np.einsum("cii->ci", gram))
        size = np.where(size > 0, size, 1.0)
        size = size[:, :, None]
        gram = gram / (size * np.swapaxes(size, 1, 2)) + _RIDGE * np.eye(_DEPTH)
        weights = np.linalg.solve(gram, steps @ now[0, :, :, None] / size) / size
        self.x[i] = (now[1] - (np.swapaxes(weights, 1, 2) @ moves)[:, 0]).reshape(step.shape)


def iterate(
    problem: Problem,
    start: Doubles,
    pace: Doubles,
    floor: Doubles,
    tol: float,
    most: int | None,
    advance: Callable[[int], object] | None,
) -> IterationResult:
    """Solve for the velocities of all curves.

    Args:
        start: coordinates of velocities to begin with.
        pace: the largest distance over time between neighbours, one per curve.
        floor: residuals at which a curve may rest.
        advance: called with the number of finished curves.
    """
    state = _Iteration(start)
    chosen = np.arange(len(start))
    part, matrix = problem, Tridiagonal(problem)
    for _ in range(_MOST if most is None else most):
        left = ~state.done[chosen]
        if not left.any():
            break
        if not left.all():
            chosen = chosen[left]
            part = problem.take_batch(chosen)
            matrix = Tridiagonal(part)
        u = part.velocities(state.x[chosen])
        differences = c2_residuals(part, u)
        rest = residuals(part, matrix, u, differences, pace[chosen])
        with np.errstate(all="ignore"):
            steps = matrix.step(np.where(np.isfinite(differences), differences, 0.0))
            state.advance(chosen, steps, rest, tol, floor[chosen])
        if advance is not None:
            advance(int(np.count_nonzero(state.done)))
    counts, residual = state.count, state.best
    with np.errstate(all="ignore"):
        rates = (np.maximum(residual, 1e-300) / state.first) ** (1 / np.maximum(counts - 1, 1))
    rate = np.where(counts > 1, rates, 0.0)
    return IterationResult(problem.velocities(state.best_x), state.converged, counts, residual, rate)


def residuals(problem: Problem, matrix: Tridiagonal, u: Array, differences: Doubles, pace: Doubles) -> Doubles:
    """Return the largest relative residual of each curve, see `symspline.Report.residual`."""
    sizes = np.linalg.norm(differences, axis=-1) / matrix.weight
    speed = problem.operations.norm(problem.p, u).max(axis=1)
    scale = np.maximum(speed, 1e-3 * pace)
    largest = sizes.max(axis=1)
    # Where all points are one, nothing moves.
    return np.asarray(np.divide(largest, scale, out=largest.copy(), where=scale > 0))


# ---- the matrix of the spline in flat space, with which a quasi-Newton step is made in frames along the points ----


class Tridiagonal:
    """The equations for velocities in flat space, rows 1/hᵢ₋₁, 2/hᵢ₋₁ + 2/hᵢ, 1/hᵢ, one matrix per curve.

    In closed curves the first and the last unknown are neighbours, too.

    Attributes
    ----------
    weight : ndarray, shape (curves, unknowns)
        Divisors of the C² residuals, as in `symspline.Report.residual`.
    """

    weight: Doubles

    def __init__(self, problem: Problem) -> None:
        inverse = 1 / problem.h
        zero = np.zeros((len(inverse), 1))
        closed = problem.ends is None
        before = np.roll(inverse, 1, axis=1) if closed else np.concatenate([zero, inverse], axis=1)
        behind = inverse if closed else np.concatenate([inverse, zero], axis=1)
        # Entries before, on and behind the diagonal.
        self._rows = np.stack([before, 2 * (before + behind), behind], axis=2)
        self.weight = before + behind
        # A residual is a sixth of the jump of the acceleration, and a third of the right-hand side.
        self._right = np.full_like(before, 3.0)
        for which, end in enumerate(problem.ends or []):
            self._set_end(problem, which, end.kind)
        self._rows[:, problem.given] = 0.0, 1.0, 0.0
        self._periodic = _PeriodicCorrection(self, problem, before[:, 0]) if closed else None

    def _set_end(self, problem: Problem, which: int, kind: str) -> None:
        """Set the rows of ends whose residual is an error of the velocity."""
        if kind not in ("velocity", "not-a-knot"):
            return
        node, beside = (0, 2) if which == 0 else (-1, 0)
        ratio = np.zeros(len(problem.h))
        if kind == "not-a-knot" and not is_parabola(problem):
            near, far = (0, 1) if which == 0 else (-1, -2)
            ratio = 1 + problem.h[:, near] / problem.h[:, far]
        self._rows[:, node, beside] = ratio
        self._rows[:, node, 1] = self._right[:, node] = 1.0
        self.weight[:, node] = np.maximum(1.0, ratio)

    def step(self, differences: Doubles) -> Doubles:
        """Return the change of the velocities for which the residuals vanish in flat space, in coordinates."""
        x = self.solved(self._right[:, :, None] * differences)
        return x if self._periodic is None else self._periodic.corrected(x)

    def solved(self, right: Doubles) -> Doubles:
        """The solution without the corners of a closed curve."""
        return solve_tridiagonal(self._rows, np.ascontiguousarray(right))


class _PeriodicCorrection:
    """What the two corners of a closed curve's matrix change, by Woodbury's identity.

    The last point is the first, but the frame transported around the polygon differs by the holonomy.
    """

    def __init__(self, matrix: Tridiagonal, problem: Problem, corner: Doubles) -> None:
        frames = problem.frames
        curves, _, dim, _ = frames.shape
        shape = (curves, dim, *problem.p.shape[2:])
        turn = products(problem.operations, problem.p[:, 0], frames[:, 0].reshape(shape), frames[:, -1].reshape(shape))
        couple = corner[:, None, None] * turn
        self._couple = np.zeros((curves, 2 * dim, 2 * dim))
        self._couple[:, :dim, dim:], self._couple[:, dim:, :dim] = couple, np.swapaxes(couple, 1, 2)
        ends = np.zeros((*matrix.weight.shape, 2))
        ends[:, 0, 0] = ends[:, -1, 1] = 1.0
        self._columns = matrix.solved(ends)
        both = np.einsum("cij,ab->ciajb", self._columns[:, [0, -1]], np.eye(dim))
        self._capacity = np.eye(2 * dim) + self._couple @ both.reshape(curves, 2 * dim, 2 * dim)

    def corrected(self, x: Doubles) -> Doubles:
        curves, _, dim = x.shape
        ends = x[:, [0, -1]].reshape(curves, 2 * dim, 1)
        s = np.linalg.solve(self._capacity, self._couple @ ends).reshape(curves, 2, dim)
        return np.asarray(x - self._columns @ s)

"""Riemannian cubics through the points of curves, by Newton's method.

The compiled core follows Riemannian cubics from the first point of every segment, and computes their derivatives by the
initial values. Newton's method determines these values such that each segment ends at the next point, with the velocity
there, and that accelerations agree at the points. Accelerations and jerks are eliminated in every segment. This leaves
a block tridiagonal system for the velocities, whose matrix is half the Hessian of the least energy of curves with given
velocities at the points.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from .._base.typing import Array
from .._core import ConvergenceError, CurvatureTensor
from .._spaces import AnySpace, Doubles

# Largest K|γ'| times the length of a step of the integration.
_LONGEST_STEP = 0.7
# Largest number of halvings of a step of Newton's method.
_HALVINGS = 8


class Start(NamedTuple):
    """Splines in one factor of the space, from which Newton's method starts.

    Attributes
    ----------
    h : ndarray, shape (curves, segments)
        Lengths of the intervals.
    points, velocities, accelerations : ndarray, shape (curves, segments + 1, *point_shape)
        Points, and velocities and accelerations there.
    fixed : pair of bool
        Whether the velocities at the two ends are given.
    closed : bool
        Whether the curves are closed.
    """

    space: AnySpace
    h: Doubles
    points: Array
    velocities: Array
    accelerations: Array
    fixed: tuple[bool, bool]
    closed: bool


class Found(NamedTuple):
    """The result of Newton's method.

    Attributes
    ----------
    points : ndarray, shape (curves, segments * steps * outputs + 1, *point_shape)
        Points of the curves.
    energy : ndarray, shape (curves,)
    converged, minimum : ndarray of bool, shape (curves,)
        Whether the iteration converged, and whether the second variation of the energy is positive definite.
    iterations : int
    """

    points: Array
    energy: Doubles
    converged: Any
    minimum: Any
    iterations: int


def steps_of(start: Start) -> int:
    """Return the number of steps of the integration per segment, a power of 2."""
    speed = np.asarray(start.space.norm(start.points, start.velocities))
    longest = float((start.h * np.maximum(speed[:, :-1], speed[:, 1:])).max()) * start.space.curvature
    return 1 << math.ceil(math.log2(max(longest / _LONGEST_STEP, 1.0)))


def solve(start: Start, steps: int, outputs: int, tol: float, max_iter: int) -> Found:
    """Find the Riemannian cubics through the points, with `steps` times `outputs` segments between two points."""
    problem = _Problem(start, steps)
    state = problem.state()
    shot = problem.shoot(state)
    if (lost := ~np.isfinite(shot.merit)).any():
        which = f" of curve {int(np.argmax(lost))}" if lost.size > 1 else ""
        raise ConvergenceError(
            f"the equation of Riemannian cubics, followed from the velocities and accelerations of the spline{which}, "
            "does not lead to the next points. Put points between those that are far apart."
        )
    converged = minimum = np.zeros(len(start.h), bool)
    iterations = 0
    while iterations < max_iter and not converged.all():
        change, minimum = problem.newton_step(state, shot)
        small = problem.size(change) <= tol * problem.size(state)
        factor = np.ones(len(start.h))
        iterations += 1
        for _ in range(_HALVINGS):
            tried = problem.moved(state, change, factor)
            if small.all():
                # No derivatives are needed any more.
                break
            new = problem.shoot(tried)
            worse = ~small & ~(new.merit < shot.merit)
            if not worse.any():
                shot = new
                break
            factor = np.where(worse, factor / 2, factor)
        else:
            break
        state, converged = tried, small
    points, energy = problem.points(state, outputs)
    return Found(points, energy, converged, minimum & converged, iterations)


class _State(NamedTuple):
    """Initial values in frames: velocities at the points, shape (curves, segments + 1, m), and accelerations and jerks
    at the start of each segment, shape (curves, segments, m), the latter two in units of the steps of the integration.
    """

    u: Doubles
    a: Doubles
    j: Doubles


class _Shot(NamedTuple):
    """Riemannian cubics with given initial values.

    Attributes
    ----------
    merit : ndarray, shape (curves,)
        Size of the residuals.
    missed : ndarray, shape (rows, 2m)
        Differences of points and velocities at the ends of the segments, in the frames that are parallel along them.
    last : ndarray, shape (rows, m)
        Accelerations there.
    turn : ndarray, shape (rows, m, m)
        Matrices from the frames at the next points to these frames.
    regular : ndarray, shape (rows,)
        1 for a segment without conjugate points, 0 otherwise.
    change : ndarray, shape (rows, 4, m, 3m)
        Derivatives of point, velocity, acceleration and jerk at the end with respect to those at the start.
    """

    merit: Doubles
    missed: Doubles
    last: Doubles
    turn: Doubles
    regular: Doubles
    change: Doubles


class _Problem:
    """The equations of Newton's method."""

    def __init__(self, start: Start, steps: int) -> None:
        space = start.space
        self.start, self.space, self.steps, self.m = start, space, steps, space.dim
        self.curves, self.segments = start.h.shape
        self.curvature = CurvatureTensor(space._handle)
        self.frames = np.asarray(space.frame(start.points))
        self.tau = start.h[..., None] / steps
        p, q = (space._as_doubles(np.ascontiguousarray(x)) for x in (start.points[:, :-1], start.points[:, 1:]))
        self.ends = p.reshape(-1, *p.shape[2:]), q.reshape(-1, *q.shape[2:])
        if start.closed:
            # The last point is the first one, perhaps with another representative. Its frame is that of the first one.
            first, last = (start.points[:, i, None] for i in (0, -1))
            brought = space.transport(first, last, self.frames[:, 0])
            self.seam = self._coordinates(last[:, None], np.expand_dims(self.frames[:, -1], 2), brought[:, None])

    def _coordinates(self, points: Array, frames: Array, vectors: Array) -> Doubles:
        return np.asarray(self.space.inner(points, frames, vectors))

    def state(self) -> _State:
        """Return the initial values of the splines, with jerks for which accelerations are linear."""
        start = self.start
        axis = 2
        first, last = start.points[:, :-1], start.points[:, 1:]
        right = np.asarray(self.space.transport(last, first, start.accelerations[:, 1:]))
        u, a = (
            self._coordinates(np.expand_dims(start.points, axis), self.frames, np.expand_dims(x, axis))
            for x in (start.velocities, start.accelerations)
        )
        b = self._coordinates(np.expand_dims(first, axis), self.frames[:, :-1], np.expand_dims(right, axis))
        if start.closed:
            u[:, -1] = u[:, 0]
        a, b = a[:, :-1] * self.tau**2, b * self.tau**2
        return _State(u, a, (b - a) / self.steps)

    def size(self, state: _State) -> Doubles:
        """Return the largest velocity, or change of velocity in a step: a curve may rest at all points."""
        velocities = np.concatenate([state.u, state.a / self.tau, state.j / self.tau], axis=1)
        return np.asarray(np.abs(velocities).max(axis=(1, 2)))

    def moved(self, state: _State, change: _State, factor: Doubles) -> _State:
        return _State(*(x + factor[:, None, None] * dx for x, dx in zip(state, change, strict=True)))

    def _initial(self, state: _State) -> Doubles:
        """Return ξ, a and j at the start of every segment, in units of a step."""
        return np.concatenate([state.u[:, :-1] * self.tau, state.a, state.j], axis=2).reshape(-1, 3 * self.m)

    def _rule(self, initial: Doubles, outputs: int) -> tuple[Doubles, Doubles, Doubles]:
        # With n nodes, values at the end have the order 2n, and those in between the order n + 1.
        more = 4 if outputs > 1 else 0
        size = self.space.curvature * math.sqrt(np.square(initial[:, : self.m]).sum(axis=1).max())
        return _rule((4 if size < 0.02 else 6 if size < 0.2 else 8) + more, outputs)

    def shoot(self, state: _State) -> _Shot:
        m, initial = self.m, self._initial(state)
        rows = self.curvature.shoot(self._rule(initial, 1), self.steps, *self.ends, initial)
        missed, last, turn, regular, change = np.split(rows, np.cumsum([2 * m, m, m * m, 1]), axis=1)
        turn = turn.reshape(-1, m, m)
        if self.start.closed:
            turn.reshape(self.curves, self.segments, m, m)[:, -1] @= self.seam
        missed[:, m:] -= _times(turn, (state.u[:, 1:] * self.tau).reshape(-1, m))
        # A segment whose end is at the cut locus of the next point is not a solution.
        missed[np.isnan(regular[:, 0])] = np.nan
        jumps = self._jumps(state, _times(turn.swapaxes(1, 2), last).reshape(state.a.shape))
        merit = np.sqrt(np.square(missed.reshape(self.curves, -1)).sum(axis=1) + jumps)
        return _Shot(merit, missed, last, turn, regular[:, 0], change.reshape(-1, 4, m, 3 * m))

    def _jumps(self, state: _State, last: Doubles) -> Doubles:
        """Return the sums of the squared jumps of the acceleration, in units of the adjacent steps."""
        square = self.tau**2
        before, after = last / square, state.a / square
        if self.start.closed:
            jumps = [(before - np.roll(after, -1, axis=1)) * square]
        else:
            jumps = [(before[:, :-1] - after[:, 1:]) * np.minimum(square[:, :-1], square[:, 1:])]
            jumps += [] if self.start.fixed[0] else [state.a[:, :1]]
            jumps += [] if self.start.fixed[1] else [last[:, -1:]]
        return np.asarray(sum(np.square(x).sum(axis=(1, 2)) for x in jumps))

    def _system(self, state: _State, shot: _Shot) -> tuple[tuple[Doubles, ...], Doubles]:
        """Return the equations that accelerations are continuous, for the changes of the velocities, and the changes of
        a and j as affine functions of these.

        The equations are the blocks on, before and after the diagonal, and the right-hand side. On closed curves, the
        blocks before the first row and after the last row belong to the last and first velocity.
        """
        m, tau = self.m, self.tau.reshape(-1, 1, 1)
        # Columns for 1 and for the velocities at both ends of a segment.
        right = np.zeros((len(tau), 2 * m, 1 + 2 * m))
        of_ends = shot.change[:, :2].reshape(-1, 2 * m, 3 * m)
        right[:, :, 0] = shot.missed
        right[:, :, 1 : m + 1] = of_ends[..., :m] * tau
        right[:, m:, m + 1 :] = -shot.turn * tau
        changes = np.asarray(-np.linalg.solve(of_ends[..., m:], right), np.float64)
        last = shot.change[:, 2, :, m:] @ changes
        last[..., 0] += shot.last
        last[..., 1 : m + 1] += shot.change[:, 2, :, :m] * tau
        last = (shot.turn.swapaxes(1, 2) @ last / tau**2).reshape(self.curves, self.segments, m, -1)
        first = changes[:, :m] / tau**2
        first[..., 0] += state.a.reshape(-1, m) / tau[:, 0] ** 2
        first = first.reshape(last.shape)

        middle, before, after = np.zeros((3, self.curves, self.segments + 1, m, m))
        rest = np.zeros((self.curves, self.segments + 1, m, 1))
        middle[:, :-1] = -first[..., 1 : m + 1]
        after[:, :-1] = -first[..., m + 1 :]
        rest[:, :-1] = first[..., :1]
        middle[:, 1:] += last[..., m + 1 :]
        before[:, 1:] = last[..., 1 : m + 1]
        rest[:, 1:] -= last[..., :1]
        if self.start.closed:
            middle[:, 0] += middle[:, -1]
            before[:, 0] = before[:, -1]
            rest[:, 0] += rest[:, -1]
            middle, before, after, rest = (x[:, :-1] for x in (middle, before, after, rest))
        for fixed, at, coupling in ((self.start.fixed[0], 0, before), (self.start.fixed[1], -1, after)):
            if fixed:
                middle[:, at] = np.eye(m)
                before[:, at] = after[:, at] = rest[:, at] = 0.0
                coupling[:, 1 if at == 0 else -2] = 0.0
        return (middle, before, after, rest), changes

    def newton_step(self, state: _State, shot: _Shot) -> tuple[_State, Any]:
        """Return the change of the state, and whether the second variation of the energy is positive definite: on every
        segment with given velocities at its ends, and as a function of the velocities."""
        blocks, of_velocities = self._system(state, shot)
        solved, positive = (_solve_closed if self.start.closed else _solve)(*blocks)
        du = solved[..., 0]
        if self.start.closed:
            du = np.concatenate([du, du[:, :1]], axis=1)
        ones = np.ones((self.curves, self.segments, 1))
        of_ends = np.concatenate([ones, du[:, :-1], du[:, 1:]], axis=2).reshape(len(of_velocities), -1)
        initial = _times(of_velocities, of_ends).reshape(self.curves, self.segments, -1)
        regular = (shot.regular == 1).reshape(self.curves, -1).all(axis=1)
        return _State(du, *np.split(initial, 2, axis=2)), regular & positive

    def points(self, state: _State, outputs: int) -> tuple[Array, Doubles]:
        """Return points at equal steps in all segments, and the energy."""
        initial, space = self._initial(state), self.space
        rows = self.curvature.points(self._rule(initial, outputs), self.steps, self.ends[0], initial)
        # The last output of a segment is the next point.
        doubles = rows[:, :-1].reshape(self.curves, self.segments, -1, *space._doubles_shape)[:, :, :-1]
        inner = space._numbers(np.ascontiguousarray(doubles))
        whole = np.concatenate([self.start.points[:, :-1, None], inner], axis=2)
        points = np.concatenate([whole.reshape(self.curves, -1, *space.point_shape), self.start.points[:, -1:]], axis=1)
        energy = rows[:, -1].reshape(self.curves, self.segments) / self.tau[..., 0] ** 3
        return points, energy.sum(axis=1)


def _times(matrices: Doubles, vectors: Doubles) -> Doubles:
    return np.asarray((matrices @ vectors[..., None])[..., 0])


@lru_cache
def _rule(size: int, outputs: int) -> tuple[Doubles, Doubles, Doubles]:
    """Return the Gauss points in [0, 1], and the matrices of the integrals from 0 to them and to equally spaced
    outputs, of which the last one is 1."""
    x, weights = legendre.leggauss(size)
    coefficients = (np.arange(size) + 0.5)[:, None] * legendre.legvander(x, size - 1).T * weights
    at = np.concatenate([x, 2 * np.arange(1, outputs + 1) / outputs - 1])
    integrals = legendre.legval(at, legendre.legint(np.eye(size), lbnd=-1)).T @ coefficients / 2
    return (x + 1) / 2, integrals[:size].copy(), integrals[size:].copy()


# ---- block tridiagonal systems ----


def _solve(middle: Doubles, before: Doubles, after: Doubles, right: Doubles) -> tuple[Doubles, Any]:
    """Solve block tridiagonal systems by cyclic reduction: even rows are eliminated, and odd rows remain.

    All arrays have shape (systems, rows, m, ...). The second result is whether each matrix is positive definite,
    provided that it is symmetric: it has the signature of the pivots.
    """
    systems, rows, m = middle.shape[:3]
    if rows == 0:
        return right, np.ones(systems, bool)
    even, odd = slice(0, None, 2), slice(1, None, 2)
    pivots = middle[:, even]
    positive = (np.linalg.eigvalsh((pivots + pivots.swapaxes(2, 3)) / 2) > 0).all(axis=(1, 2))
    solved = np.linalg.solve(pivots, np.concatenate([x[:, even] for x in (before, after, right)], axis=3))
    # Every odd row has two neighbours, the last one perhaps without any coefficients.
    padded = np.concatenate([solved, np.zeros_like(solved[:, :1])], axis=1)[:, : rows // 2 + 1]
    left, next_ = before[:, odd] @ padded[:, :-1], after[:, odd] @ padded[:, 1:]
    others, rest = _solve(
        middle[:, odd] - left[..., m : 2 * m] - next_[..., :m],
        -left[..., :m],
        -next_[..., m : 2 * m],
        right[:, odd] - left[..., 2 * m :] - next_[..., 2 * m :],
    )
    beside = np.zeros((systems, rows // 2 + 2, *right.shape[2:]))
    beside[:, 1:-1] = others
    count = pivots.shape[1]
    out = np.empty_like(right)
    out[:, odd] = others
    out[:, even] = (
        solved[..., 2 * m :] - solved[..., :m] @ beside[:, :count] - solved[..., m : 2 * m] @ beside[:, 1 : count + 1]
    )
    return out, positive & rest


def _solve_closed(middle: Doubles, before: Doubles, after: Doubles, right: Doubles) -> tuple[Doubles, Any]:
    """Solve cyclic systems: the first row is eliminated last."""
    zero = np.zeros_like(middle[:, :1])
    if middle.shape[1] == 1:
        return _solve(middle + before + after, zero, zero, right)
    n = right.shape[-1]
    of_first = np.zeros_like(middle[:, 1:])
    of_first[:, 0] += before[:, 1]
    of_first[:, -1] += after[:, -1]
    both = np.concatenate([right[:, 1:], of_first], axis=3)
    solved, positive = _solve(middle[:, 1:], before[:, 1:], after[:, 1:], both)
    row = after[:, :1] @ solved[:, :1] + before[:, :1] @ solved[:, -1:]
    first, rest = _solve(middle[:, :1] - row[..., n:], zero, zero, right[:, :1] - row[..., :n])
    return np.concatenate([first, solved[..., :n] - solved[..., n:] @ first], axis=1), positive & rest

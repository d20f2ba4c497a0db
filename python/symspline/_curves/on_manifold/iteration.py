"""Velocities that make curves C²: the tridiagonal quasi-Newton iteration with Anderson mixing."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..._core import solve_tridiagonal
from ..._spaces import Array, Doubles
from ...manifolds._operations import products
from .condition import Problem, c2_residuals, is_parabola

# How many steps back are mixed.
_DEPTH = 5
_MOST = 200
# A residual that has not been halved in so many evaluations is where exp, log and dlog leave it, if it is below this.
_PATIENCE = 5
FLOOR = 1e-8
# So much above the best residual the iteration goes back to where that was.
_WILD = 10.0


class Found(NamedTuple):
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


class _State:
    """The iteration of one curve, in coordinates of its velocities."""

    def __init__(self, start: Doubles) -> None:
        self.x = self.best_x = start
        self.best_step = np.zeros_like(start)
        self.best = self.first = np.inf
        self.count = 0
        self.converged = False
        self.done = False
        self._halvings = 0
        self._since, self._mark = 0, np.inf
        self._steps: list[Doubles] = []
        self._moves: list[Doubles] = []
        self._last: tuple[Doubles, Doubles] | None = None

    def advance(self, step: Doubles, residual: float, tol: float, floor: float) -> None:
        """Take the step and the residual at x, and go on to the next x, or end."""
        self.count += 1
        if self.count == 1:
            self.first = residual
        bad = not np.isfinite(residual)
        if residual < self.best:
            self.best, self.best_x, self.best_step = residual, self.x, step
        if self.best <= tol:
            self.converged = self.done = True
            return
        if self.best <= self._mark / 2:
            self._since, self._mark, self._halvings = 0, self.best, 0
        else:
            self._since += 1
        if self._since >= _PATIENCE and self.best <= floor:
            self.converged = self.done = True
        elif bad or residual > _WILD * self.best:
            self._go_back()
        else:
            self._mix(step)

    def _go_back(self) -> None:
        """Return to the best velocities, and halve the step from there."""
        self._halvings += 1
        self._steps, self._moves, self._last = [], [], None
        self.x = self.best_x + 0.5**self._halvings * self.best_step
        # Zero velocities may not have a finite step.
        self.done = not np.isfinite(self.best) or self._halvings > 20

    def _mix(self, step: Doubles) -> None:
        """Anderson's mixing (J. ACM 12, 1965): the combination of the last steps that is least."""
        x = self.x
        if self._last is not None:
            self._moves.append(x - self._last[0])
            self._steps.append(step - self._last[1])
            del self._moves[:-_DEPTH], self._steps[:-_DEPTH]
        self._last = x, step
        self.x = x + step
        if self._steps:
            changes = np.stack([s.ravel() for s in self._steps], axis=1)
            weights = np.linalg.lstsq(changes, step.ravel(), rcond=1e-10)[0]
            for weight, move, change in zip(weights, self._moves, self._steps, strict=True):
                self.x = self.x - weight * (move + change)


def iterate(
    problem: Problem,
    start: Doubles,
    pace: Doubles,
    floor: Doubles,
    tol: float,
    most: int | None,
    advance: Callable[[int], object] | None,
) -> Found:
    """Solve for the velocities of all curves.

    Args:
        start: coordinates of velocities to begin with.
        pace: the largest distance over time between neighbours, one per curve.
        floor: residuals at which a curve may rest.
        advance: called with the number of finished curves.
    """
    states = [_State(x) for x in start]
    chosen = np.arange(len(states))
    part, matrix = problem, Tridiagonal(problem)
    for _ in range(_MOST if most is None else most):
        left = np.array([not states[i].done for i in chosen], bool)
        if not left.any():
            break
        if not left.all():
            chosen = chosen[left]
            part = problem.take_batch(chosen)
            matrix = Tridiagonal(part)
        u = part.velocities(np.stack([states[i].x for i in chosen]))
        found = c2_residuals(part, u)
        rest = residuals(part, matrix, u, found, pace[chosen])
        with np.errstate(all="ignore"):
            steps = matrix.step(np.where(np.isfinite(found), found, 0.0))
        for i, step, own in zip(chosen, steps, rest, strict=True):
            states[i].advance(step, float(own), tol, float(floor[i]))
        if advance is not None:
            advance(sum(state.done for state in states))
    best = np.stack([state.best_x for state in states])
    counts = np.array([state.count for state in states])
    residual = np.array([state.best for state in states])
    first = np.array([state.first for state in states])
    with np.errstate(all="ignore"):
        rate = np.where(counts > 1, (np.maximum(residual, 1e-300) / first) ** (1 / np.maximum(counts - 1, 1)), 0.0)
    converged = np.array([state.converged for state in states])
    return Found(problem.velocities(best), converged, counts, residual, rate)


def residuals(problem: Problem, matrix: Tridiagonal, u: Array, found: Doubles, pace: Doubles) -> Doubles:
    """Return the largest relative residual of each curve, see `symspline.Report.residual`."""
    sizes = np.linalg.norm(found, axis=-1) / matrix.weight
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
        self._periodic = _PeriodicCorrection(self, problem, before[:, 0]) if closed else None

    def _set_end(self, problem: Problem, which: int, kind: str) -> None:
        """Set the rows of ends whose residual is an error of the velocity."""
        if kind not in ("velocity", "not-a-knot"):
            return
        node, beside = (0, 2) if which == 0 else (-1, 0)
        own = np.zeros(len(problem.h))
        if kind == "not-a-knot" and not is_parabola(problem):
            near, far = (0, 1) if which == 0 else (-1, -2)
            own = 1 + problem.h[:, near] / problem.h[:, far]
        self._rows[:, node, beside] = own
        self._rows[:, node, 1] = self._right[:, node] = 1.0
        self.weight[:, node] = np.maximum(1.0, own)

    def step(self, found: Doubles) -> Doubles:
        """Return the change of the velocities for which the residuals vanish in flat space, in coordinates."""
        x = self.solved(self._right[:, :, None] * found)
        return x if self._periodic is None else self._periodic.corrected(x)

    def largest_step(self, sizes: Doubles) -> Doubles:
        """Return the longest step at a knot that residuals of these sizes can cause, per curve.

        Open curves have a matrix with positive pivots and positive entries, whose inverse therefore has alternating
        signs: it is an M-matrix but for the signs of every other row and column. Closed curves have a matrix that is
        dominant by ``weight`` in every row, since holonomies preserve lengths.
        """
        if self._periodic is not None:
            return np.asarray((self._right * sizes / self.weight).max(axis=1))
        signs = (-1.0) ** np.arange(sizes.shape[1])
        return np.asarray(np.abs(self.solved((signs * self._right * sizes)[:, :, None])).max(axis=(1, 2)))

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

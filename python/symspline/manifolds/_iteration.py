"""Velocities that make curves C²: the tridiagonal quasi-Newton iteration with Anderson mixing."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._spaces import Array
from ._condition import Problem, c2_residuals
from ._tridiagonal import Tridiagonal

Doubles = NDArray[np.float64]

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
        rate = np.where(
            counts > 1, (np.maximum(residual, 1e-300) / first) ** (1 / np.maximum(counts - 1, 1)), 0.0
        )
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

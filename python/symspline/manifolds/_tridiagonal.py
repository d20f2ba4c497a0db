"""The matrix of the flat spline, with which a quasi-Newton step is made in frames along the points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._condition import Problem, is_parabola
from ._frames import products

Doubles = NDArray[np.float64]


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
        self._low, self._high, self._diagonal = before, behind, 2 * (before + behind)
        self.weight = before + behind
        # A residual is a sixth of the jump of the acceleration, and a third of the right-hand side.
        self._right = np.full_like(before, 3.0)
        for which, end in enumerate(problem.ends or []):
            self._set_end(problem, which, end.kind)
        self._pivots, self._ratios = self._diagonal.copy(), np.zeros_like(before)
        for i in range(1, before.shape[1]):
            self._ratios[:, i] = self._low[:, i] / self._pivots[:, i - 1]
            self._pivots[:, i] -= self._ratios[:, i] * self._high[:, i - 1]
        self._periodic = _PeriodicCorrection(self, problem, before[:, 0]) if closed else None

    def _set_end(self, problem: Problem, which: int, kind: str) -> None:
        """Set the rows of ends whose residual is an error of the velocity."""
        if kind not in ("velocity", "not-a-knot"):
            return
        node, beside = (0, self._high) if which == 0 else (-1, self._low)
        own = np.zeros(len(problem.h))
        if kind == "not-a-knot" and not is_parabola(problem):
            near, far = (0, 1) if which == 0 else (-1, -2)
            own = 1 + problem.h[:, near] / problem.h[:, far]
        beside[:, node] = own
        self._diagonal[:, node] = self._right[:, node] = 1.0
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
            result: Doubles = (self._right * sizes / self.weight).max(axis=1)
            return result
        signs = (-1.0) ** np.arange(sizes.shape[1])
        return np.asarray(np.abs(self.solved((signs * self._right * sizes)[:, :, None])).max(axis=(1, 2)))

    def solved(self, right: Doubles) -> Doubles:
        """The solution without the corners of a closed curve."""
        x = right.copy()
        for i in range(1, x.shape[1]):
            x[:, i] -= self._ratios[:, i, None] * x[:, i - 1]
        x[:, -1] /= self._pivots[:, -1, None]
        for i in range(x.shape[1] - 2, -1, -1):
            x[:, i] = (x[:, i] - self._high[:, i, None] * x[:, i + 1]) / self._pivots[:, i, None]
        return x


class _PeriodicCorrection:
    """What the two corners of a closed curve's matrix change, by Woodbury's identity.

    The last point is the first, but the frame transported around the polygon differs by the holonomy.
    """

    def __init__(self, matrix: Tridiagonal, problem: Problem, corner: Doubles) -> None:
        frames = problem.frames
        curves, _, dim, _ = frames.shape
        shape = (curves, dim, *problem.p.shape[2:])
        turn = products(
            problem.operations, problem.p[:, 0], frames[:, 0].reshape(shape), frames[:, -1].reshape(shape)
        )
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

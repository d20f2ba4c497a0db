"""Points far apart at very uneven times: whether there are C² curves that ``auto`` does not find."""

from __future__ import annotations

import numpy as np
from comparisons.page import table
from numpy.typing import NDArray

import symspline as ss

Array = NDArray[np.float64]

S2 = ss.Sphere(2)
STEPS = (1.0, 1.5, 2.0, 2.5)
KNOTS = 7
# Walks a row; of those without a curve so many are searched, each from so many random velocities.
WALKS, SEARCHED, STARTS = 200, 30, 100
ITERATIONS = 60
# Control legs go no farther than this part of the way to the cut locus.
LIMIT = 0.997 * np.pi
ENDS = np.array([0.0, 1.0])


def walks(step: float, rng: np.random.Generator) -> Array:
    """Points one step apart, every step in a direction of its own."""
    p = [S2.random_point(rng, WALKS)]
    for _ in range(KNOTS - 1):
        v = S2.random_tangent(rng, p[-1])
        p.append(S2.exp(p[-1], step * v / S2.norm(p[-1], v)[:, None]))
    return np.stack(p, axis=1)


class Search:
    """Levenberg and Marquardt's least squares of the jumps of acceleration, from many starts at a time.

    Unknowns are the longer control legs of every knot, (starts, knots, 2) in frames; jumps are in such lengths, too.
    """

    def __init__(self, t: Array, p: Array) -> None:
        self.p, self.h = p, np.diff(t)
        self.frames = np.stack([np.linalg.svd(x[None])[2][1:] for x in p])
        before, behind = np.append(np.inf, self.h), np.append(self.h, np.inf)
        self.longer = np.maximum(np.append(0, self.h), np.append(self.h, 0))
        self.unit = self.longer / 3 / (1 / before + 1 / behind)

    def jumps(self, legs: Array) -> Array:
        u = np.einsum("...nk,nkd->...nd", 3 * legs / self.longer[:, None], self.frames)
        lead, segments = legs.shape[:-2], len(self.h)
        points = np.stack([self.p[:-1], self.p[1:]], axis=1)
        points = np.broadcast_to(points, (*lead, segments, 2, 3)).reshape(-1, 2, 3)
        velocities = np.stack([u[..., :-1, :], u[..., 1:, :]], axis=-2) * self.h[:, None, None]
        a = ss.evaluate(ENDS, points, velocities.reshape(-1, 2, 3), S2, ENDS, nu=2)
        a = a.reshape(*lead, segments, 2, 3) / np.square(self.h)[:, None, None]
        jumps = np.zeros((*lead, segments + 1, 3))
        jumps[..., 1:, :] += a[..., 1, :]
        jumps[..., :-1, :] -= a[..., 0, :]
        jumps *= self.unit[:, None]
        return np.nan_to_num(np.einsum("...nd,nkd->...nk", jumps, self.frames).reshape(*lead, -1))

    def finds(self, rng: np.random.Generator, starts: int) -> bool:
        """Whether any start ends at a C² curve."""
        shape = (starts, len(self.p), 2)
        legs = rng.normal(size=shape)
        legs *= LIMIT * rng.uniform(size=(starts, 1, 1)) / np.linalg.norm(legs, axis=-1, keepdims=True)
        legs *= rng.uniform(size=(*shape[:2], 1))
        unit = np.eye(legs[0].size)
        damping = np.full(starts, 1e-2)
        r = self.jumps(legs)
        for _ in range(ITERATIONS):
            moved = legs[:, None] + 1e-6 * unit.reshape(-1, *shape[1:])
            jacobian = (self.jumps(moved) - r[:, None]) / 1e-6
            normal = np.einsum("sij,skj->sik", jacobian, jacobian) + damping[:, None, None] * unit
            step = -np.linalg.solve(normal, np.einsum("sij,sj->si", jacobian, r)[..., None]).reshape(shape)
            new = legs + step
            new *= np.minimum(1, LIMIT / np.maximum(np.linalg.norm(new, axis=-1, keepdims=True), 1e-300))
            found = self.jumps(new)
            better = np.square(found).sum(axis=-1) < np.square(r).sum(axis=-1)
            legs, r = np.where(better[:, None, None], new, legs), np.where(better[:, None], found, r)
            damping = np.where(better, np.maximum(damping / 5, 1e-14), np.minimum(damping * 4, 1e6))
        inside = np.linalg.norm(legs, axis=-1).max(axis=-1) < 0.9995 * LIMIT
        return bool((inside & (np.linalg.norm(r, axis=-1) < 1e-8)).any())


def uneven_table(steps: tuple[float, ...] = STEPS) -> str:
    """How often `auto` finds a curve, and of those without one how often a search from random starts does."""
    rows = []
    for step in steps:
        row = [f"{step:g}"]
        for ratio in (3, 10):
            rng = np.random.default_rng(7)
            p = walks(step, rng)
            h = ratio ** rng.uniform(size=(WALKS, KNOTS - 1))
            t = np.concatenate([np.zeros((WALKS, 1)), np.cumsum(h, axis=1)], axis=1)
            converged = ss.fit(t, p, S2, on_failure="ignore")[1].converged
            missed = np.flatnonzero(~converged)[:SEARCHED]
            found = sum(Search(t[i], p[i]).finds(rng, STARTS) for i in missed)
            row += [f"{converged.mean():.1%}", f"{found} of {len(missed)}"]
        rows.append(row)
    head = [
        "step",
        "h up to 3 : 1, `auto` converges",
        "of the rest, the search succeeds",
        "10 : 1, `auto` converges",
        "of the rest, the search succeeds",
    ]
    return table(head, rows)

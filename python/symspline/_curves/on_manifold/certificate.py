"""How far computed velocities are from those of the C² curve: an a-posteriori bound.

The velocities u* of the C² curve solve F(u) = 0. With the inverse A of the matrix of the flat spline, u ↦ u + A F(u)
is a contraction with fixed point u*: the argument of Theorem 3.1 of Bogfjellmo, Modin and Verdier (2018), and that of
simplified Newton methods (Deuflhard, Newton Methods for Nonlinear Problems, 2011, section 2.1). If its Lipschitz
constant is q < 1 on a ball that holds u* and û = u + d, then

    |u - u*| <= |d| + |A F(û)| / (1 - q).

The correction d is a partial sum of the Neumann series of the Newton step, so that A F(û) is small and the bound is
sharp. Norms are the largest over the knots of the Riemannian norm of velocities.
"""

from __future__ import annotations

import numpy as np

from ..._spaces import Array, Doubles
from ...manifolds._differences import dlog_by_differences
from ...manifolds._operations import Operations
from .condition import ControlPolygon, Problem, c2_residuals, c2_residuals_of, control_polygons
from .iteration import Tridiagonal

# Terms of the Neumann series behind the first; each costs one evaluation of F.
_TERMS = 4
# Length of difference steps relative to the largest speed: the third difference of a smooth function is then rounding.
_STEP = 1e-5
# Third differences have the weights 1, -3, 3, -1, and so the root of 20 times the standard deviation of noise; three
# standard deviations count.
_NOISE = 3 / np.sqrt(20)
# The contraction is estimated, from below, by as many directions as there are terms. Beyond this there is no bound.
_LARGEST = 0.95
# What is left behind the corrections may therefore be larger than the estimate by this factor.
_CAUTION = 3.0


def velocity_errors(problem: Problem, x: Doubles, pace: Doubles) -> Doubles:
    """Bounds for the errors of velocities, one per curve; inf where there is none.

    Parameters
    ----------
    problem : Problem
        The curves.
    x : ndarray of float, shape (curves, unknowns, dim)
        Coordinates of their velocities.
    pace : ndarray of float, shape (curves,)
        The largest distance over time between neighbours.
    """
    with np.errstate(all="ignore"):
        found = _bounds(problem, Tridiagonal(problem), x, pace)
    return np.where(np.isfinite(found), found, np.inf)


def _bounds(problem: Problem, matrix: Tridiagonal, x: Doubles, pace: Doubles) -> Doubles:
    curves = np.arange(len(x))
    reach = _STEP * np.maximum(_largest(x), pace)
    # Where all points are one, nothing has a scale.
    reach = np.where(reach > 0, reach, _STEP)
    # Four points on a line through x in the direction of the first step: slope and noise.
    u = problem.velocities(x)
    polygon = control_polygons(problem.operations, problem.h, problem.p, u)
    dlog = problem.operations.dlog(*polygon)
    first = c2_residuals_of(problem, u, dlog - polygon.v)
    term = matrix.step(first)
    size = _largest(term)
    unit = np.where(size[:, None, None] > 0, _unit(term), _unit(matrix.step(_free(problem, first))))
    line = problem.take_batch(np.tile(curves, 3))
    samples = np.concatenate([x + k * reach[:, None, None] * unit for k in (1, 2, 3)])
    ahead = c2_residuals(line, line.velocities(samples)).reshape(3, *x.shape)
    third = ahead[2] - 3 * ahead[1] + 3 * ahead[0] - first
    noise = _NOISE * _most(np.linalg.norm(third, axis=-1) / matrix.weight)[:, None] * matrix.weight
    noise += _inconsistency(problem, u, polygon, dlog)
    # The series Σ Mᵏ A F(u), M = 1 + A F', whose ratios estimate the norm of M.
    slope = matrix.step(ahead[0] - first) / reach[:, None, None]
    total, contraction = term.copy(), np.zeros(len(x))
    for k in range(_TERMS):
        image = unit + slope
        ratio = _largest(image)
        contraction = np.maximum(contraction, ratio)
        size = size * ratio
        unit = _unit(image)
        total += size[:, None, None] * unit
        if k + 1 < _TERMS:
            # As far as the terms reach themselves, so that a curve far from its solution shows how M varies.
            away = np.maximum(reach, size)[:, None, None]
            moved = c2_residuals(problem, problem.velocities(x + away * unit))
            slope = matrix.step(moved - first) / away
    rest = _largest(matrix.step(c2_residuals(problem, problem.velocities(x + total))))
    bound = _largest(total) + (_CAUTION * rest + matrix.largest_step(noise)) / (1 - contraction)
    return np.where(contraction < _LARGEST, bound, np.inf)


def _largest(x: Doubles) -> Doubles:
    """The largest norm of velocities at the knots of each curve."""
    return _most(np.linalg.norm(x, axis=-1))


def _most(x: Doubles) -> Doubles:
    return np.asarray(x.max(axis=1))


def _unit(x: Doubles) -> Doubles:
    """The same directions with norm one; zero stays."""
    size = _largest(x)[:, None, None]
    return np.divide(x, size, out=np.zeros_like(x), where=size > 0)


def _free(problem: Problem, like: Doubles) -> Doubles:
    """Return residuals that are one where velocities are unknown, for curves whose own residuals are exactly zero."""
    free = np.ones_like(like)
    for which, end in enumerate(problem.ends or []):
        if end.kind == "velocity":
            free[:, -which] = 0.0
    return free


def _inconsistency(problem: Problem, u: Array, polygon: ControlPolygon, dlog: Array) -> Doubles:
    """Return bounds for the errors of the residuals at every knot that are due to inconsistent functions.

    log(exp(v)) differs from v, exp(log(q)) from q, and D log from the derivative of log by other differences.
    """
    operations, h = problem.operations, problem.h
    p, v, q, w = polygon
    norm = operations.norm
    back = norm(p, operations.log(p, q) - v)
    ratio = norm(q, w) / norm(p, v)
    # Of an error of log that is proportional to the distance D log has the same part.
    back = back * np.where(back > 0, 1 + ratio, 0.0)
    there = norm(q[::-1], operations.log(q[::-1], operations.exp(q, w)))
    other = norm(p, dlog - _other_dlog(operations, p, v, q, w))
    starts, stops = (back + there + other) / (h * h)
    if problem.ends is None:
        return np.concatenate([starts[:, :1] + stops[:, -1:], starts[:, 1:] + stops[:, :-1]], axis=1)
    found = np.concatenate([starts[:, :1], starts[:, 1:] + stops[:, :-1], stops[:, -1:]], axis=1)
    for which, end in enumerate(problem.ends):
        node, beside, behind = (0, 1, 2) if which == 0 else (-1, -2, -3)
        if end.kind == "velocity":
            found[:, node] = 0.0
        elif end.logs is not None:
            # There the condition has the logarithms of two neighbours, and D log of the velocity at the end.
            at = problem.p[:, beside], end.logs[0], problem.p[:, node], u[:, node]
            unlike = norm(at[0], operations.dlog(*at) - _other_dlog(operations, *at))
            off = [
                norm(far, operations.log(far, operations.exp(at[0], own)))
                for far, own in zip((problem.p[:, node], problem.p[:, behind]), end.logs, strict=True)
            ]
            h0, h1 = (h[:, i] for i in ((0, 1) if which == 0 else (-1, -2)))
            turned = off[0] / norm(*at[:2]) * norm(*at[2:])
            found[:, node] = unlike + np.where(off[0] > 0, turned, 0.0) + (off[0] / h0 + off[1] / h1) * (2 + h0 / h1)
    return found


def _other_dlog(operations: Operations, p: Array, v: Array, q: Array, w: Array) -> Array:
    """D log by differences, with steps twice as long as those of `Manifold` if its own are differences."""
    space = operations.space
    stretch = 2.0 if space.functions.dlog is None else 1.0
    a, b, c, d = (x.reshape(-1, *space.point_shape) for x in (p, v, q, w))
    return dlog_by_differences(operations, a, b, c, d, space._radius, stretch).reshape(p.shape)

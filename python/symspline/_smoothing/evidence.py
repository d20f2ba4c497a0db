"""Data of a smoothed curve, linearised at the curve, in coordinates of frames along it."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from .. import _core
from .._curves.ends import end_kinds, is_closed
from .._spaces import Array, Doubles, Euclidean, Space, SpecialEuclidean, factors_of
from .audit import corner_of
from .data import points_of
from .factors import grouped, smoothed_spaces, split
from .gaps import Calibration, Course, Evidence, calibrate
from .posterior import frames_at
from .precision import SINGULAR

# Largest number of entries of the frames that are computed in one call.
_TOGETHER = 1 << 22
# Data of a robust fit beyond this quantile of the noise do not count as evidence, as in the fit.
_KEPT = 0.999


def calibration_of(spline: Any, number: int) -> Calibration | None:
    """Return the calibration of one curve in gaps, in the smoothed space with a given number.

    The result is None for curves without an estimate of their error: interpolating curves, least squares without a
    penalty, geodesics with ``lam=inf``, and curves that did not converge.
    """
    part = spline._smoothed[number]
    space = smoothed_spaces(spline.space)[number]
    lam, sigma = (float(np.asarray(own)) for own in (part.band_lam, part.sigma))
    known = np.isfinite(part.report.lam) and part.report.converged
    usable = 0 < lam < np.inf and 0 < sigma < np.inf and bool(known)
    precision, times = spline._noisy.precisions[number], spline._noisy.times
    used = precision.weights > 0
    t = times[used]
    if not usable or part.posterior is None or len(np.unique(t)) < 3:
        return None
    knots, kinds = spline._knots_of(()), end_kinds(spline._bc_type)
    m = space.dim
    posterior = part.posterior

    def line(at: float) -> Doubles:
        found = posterior.covariance(space, knots, (), kinds, np.array([at]), None, [0, 1])[0].reshape(2, m, 2, m)
        return np.asarray(np.trace(found, axis1=1, axis2=3) / m)

    def variance(x: Doubles, nu: int) -> Doubles:
        return np.asarray((spline._plain_spread(number, (), x, nu) / sigma) ** 2)

    order = 3 if part.penalty == "jerk" else 2

    @cache
    def evidence() -> Evidence:
        return _evidence(spline, number, np.flatnonzero(used), sigma)

    acceleration = 0.0
    if order == 3:
        at = t[:: max(1, len(t) // 1000)]
        vectors = _coordinates(spline, number, at, "acceleration")
        acceleration = float(np.mean((vectors / sigma) ** 2))
    course = Course(order, lam, variance, line, acceleration)
    period = float(knots[-1] - knots[0]) if is_closed(spline._bc_type) else np.nan
    return calibrate(t, precision.weights[used], course, period, evidence)


def _evidence(spline: Any, number: int, used: Any, sigma: float) -> Evidence:
    noisy, part = spline._noisy, spline._smoothed[number]
    space, data = points_of(noisy, spline.space)[number]
    precision = noisy.precisions[number]
    t, y = noisy.times[used], data[used]
    residuals = _coordinates(spline, number, t, "point", y) / sigma
    velocities, accelerations = (
        _coordinates(spline, number, t, quantity) / sigma for quantity in ("velocity", "acceleration")
    )
    h = np.diff(t)[:, None]
    steps = 0.5 * h * (velocities[:-1] + velocities[1:]) + h**2 / 12 * (accelerations[:-1] - accelerations[1:])
    positions = np.concatenate([np.zeros((1, space.dim)), np.cumsum(steps, axis=0)])
    weights = precision.weights[used]
    posterior = spline._posterior(part)
    if posterior.size == 1:
        roots = np.sqrt(weights)
        squares = weights * (residuals**2).sum(axis=1)
    else:
        matrices = np.eye(space.dim) * weights[:, None, None]
        if precision.information is not None:
            matrices = _in_frames(spline, number, t, y, precision.information[used])
        roots = _roots(matrices)
        squares = (np.einsum("nqc,nc->nq", roots, residuals) ** 2).sum(axis=1)
    counts, soft = np.ones(len(t), bool), np.ones(len(t))
    if part.loss != "linear":
        counts = squares <= _core.chi_squared(space.dim, _KEPT)
        soft = _soft(part.loss, squares, space.dim)
    knots, kinds = spline._knots_of(()), end_kinds(spline._bc_type)
    return Evidence(knots, posterior.known((), kinds), t, roots, residuals, counts, soft, positions, velocities)


def _soft(loss: str, squares: Doubles, m: int) -> Doubles:
    """Return factors that turn residuals into those of pseudo-data, for noise of variance one (Cox 1983)."""
    q = squares / corner_of(loss, m)
    if loss == "huber":
        q = np.maximum(q, 1.0)
        factors = 1 / np.sqrt(q)
        slopes = np.where(q > 1, (m - 1) / m * factors, 1.0)
    else:
        factors = 1 / (1 + q)
        slopes = factors - 2 * q * factors**2 / m
    return np.asarray(factors / max(slopes.mean(), 0.05))


def _roots(matrices: Doubles) -> Doubles:
    """Return R with W = RᵀR for symmetric matrices W; rows of directions without information are zero."""
    values, vectors = np.linalg.eigh(matrices)
    values = np.where(values > SINGULAR * values[:, -1:], values, 0.0)
    return np.asarray(np.sqrt(values)[:, :, None] * np.swapaxes(vectors, -1, -2))


def _parts_at(spline: Any, number: int, t: Doubles, quantity: str) -> tuple[Any, Array, Array]:
    """Return the factor of a smoothed space, the points at its knots, and a quantity at times."""
    owners = [i for i, own in enumerate(grouped(spline.space, spline._smoothed)) for _ in own]
    factor, curve = factors_of(spline.space)[owners[number]], spline._curve.parts[owners[number]]
    place = number - owners.index(owners[number])
    values = curve.evaluate(t, quantity, "raise", False)
    return factor, split(factor, curve.points)[place], split(factor, values)[place]


def _coordinates(spline: Any, number: int, t: Doubles, quantity: str, y: Array | None = None) -> Doubles:
    """Return coordinates of tangent vectors along the curve: its derivatives, or logarithms of points y."""
    space = smoothed_spaces(spline.space)[number]
    factor, points, vectors = _parts_at(spline, number, t, quantity)
    _, _, p = _parts_at(spline, number, t, "point")
    if y is not None:
        one = space if isinstance(factor, SpecialEuclidean) else factor
        vectors = one._apply("log", p=p, q=y)
    return _of_frames(space, spline._knots_of(()), points, t, p, vectors[:, None])[:, 0]


def _of_frames(space: Space, knots: Doubles, points: Array, t: Doubles, p: Array, vectors: Array) -> Doubles:
    """Return coordinates of vectors (n, k, *point_shape) in the frames along a curve, shape (n, k, m)."""
    n, k, m = len(t), vectors.shape[1], space.dim
    flat = np.asarray(space._as_doubles(np.ascontiguousarray(vectors))).reshape(n, k, -1)
    if isinstance(space, Euclidean):
        return flat
    out = np.empty((n, k, m))
    step = max(1, _TOGETHER // (m * flat.shape[-1]))
    for first in range(0, n, step):
        some = slice(first, first + step)
        frames = frames_at(space, knots, points, t[some], p[some])
        rows = np.asarray(space._as_doubles(np.ascontiguousarray(frames))).reshape(-1, m, flat.shape[-1])
        q, r = np.linalg.qr(np.swapaxes(rows, 1, 2))
        out[some] = np.swapaxes(np.linalg.solve(r, np.swapaxes(q, 1, 2) @ np.swapaxes(flat[some], 1, 2)), 1, 2)
    return out


def _in_frames(spline: Any, number: int, t: Doubles, y: Array, information: Doubles) -> Doubles:
    """Return information matrices in frames along the curve, to which the frames at the data are transported."""
    space = smoothed_spaces(spline.space)[number]
    _, points, p = _parts_at(spline, number, t, "point")
    frames = np.moveaxis(space.frame(y), 1, 0)
    moved = np.stack([space._apply("transport", p=y, q=p, v=own) for own in frames], axis=1)
    # Rows are the transported frame vectors, in coordinates of the frames along the curve.
    own = np.linalg.inv(_of_frames(space, spline._knots_of(()), points, t, p, moved))
    return np.asarray(own @ information @ np.swapaxes(own, 1, 2))

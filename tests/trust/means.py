"""Means and medians of random sets: global minima, whatever the order of the points and the units.

The oracles do not use the library: a fine grid on circles, descents from many starts on spheres and rotations, and an
iteration that whitens positive definite matrices. An error is the distance from the oracle's minimum in standard
errors; it is 0 where the sum of distances is as low.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import symspline as ss

from .outcome import Outcome, outcome_of

Array = Any
# Spreads (standard deviation per coordinate) up to which the points are close together.
_CLOSE = 0.35


def _judged(space: Any, found: Array, best: Array, points: Array, weights: Array, power: int) -> float:
    """Return the distance of a result from the lowest point in standard errors, or 0 if it is as low."""
    sums = [float(weights @ np.asarray(space.distance(p, points)) ** power) for p in (found, best)]
    if sums[0] <= sums[1] * (1 + 1e-6) + 1e-12:
        return 0.0
    square = weights @ np.asarray(space.distance(best, points)) ** 2
    error = np.sqrt(square / weights.sum() * np.sum(weights**2)) / weights.sum()
    return float(space.distance(found, best) / error)


def _run(space: Any, points: Array, weights: Array, power: int, best: Array, sound: bool, rng: Any) -> Outcome:
    """Compute a mean or median of points in random order."""
    order = rng.permutation(len(points))
    function = space.mean if power == 2 else space.median

    def fit() -> float:
        found = function(points[order], weights[order])
        return _judged(space, found, best, points, weights, power)

    return outcome_of(fit, sound)


def _angles(rng: Any) -> tuple[Array, Array, float]:
    """Draw angles, often with a second cluster or opposite ones, in degrees rounded as people note them."""
    n, spread = int(rng.integers(1, 60)), rng.choice([0.1, 0.3, 0.8, 2.0])
    angles = rng.uniform(-np.pi, np.pi) + rng.normal(0, spread, n)
    kind = rng.integers(4)
    if kind == 1:
        angles[rng.random(n) < 0.1] += np.pi
    elif kind == 2:
        angles[rng.random(n) < 0.4] += 2.5
    if rng.random() < 0.3:
        angles = np.radians(np.round(np.degrees(angles), -1))
    weights = rng.uniform(0.1, 2, n) if rng.random() < 0.5 else np.ones(n)
    return angles, weights, float(spread if kind in (0, 3) else np.inf)


def _circle(name: str, to_point: Callable[[Array], Array], power: int, period: float = 2 * np.pi) -> Any:
    def one(seed: int) -> Outcome:
        rng = np.random.default_rng(seed)
        angles, weights, spread = _angles(rng)
        grid = np.linspace(0, 2 * np.pi, 3601)
        for _ in range(3):
            apart = np.abs((angles[:, None] - grid + np.pi) % (2 * np.pi) - np.pi)
            at = grid[np.argmin(weights @ apart**power)]
            grid = at + np.linspace(-1, 1, 801) * (grid[1] - grid[0])
        scaled = period / (2 * np.pi)
        points, best = to_point(scaled * angles), to_point(scaled * np.array([at]))[0]
        return _run(ss.space(name), points, weights, power, best, spread <= _CLOSE, rng)

    return one


def _lowest(starts: Array, log: Any, exp: Any, weights: Array, power: int) -> Array:
    """Descend from many starts, arrays of shape (starts, k), and return the lowest end point.

    `log(x)` returns the tangent vectors from x to all data, shape (starts, data, k).
    """
    x = starts
    for _ in range(150):
        v = log(x)
        length = np.linalg.norm(v, axis=-1)
        share = weights if power == 2 else weights / np.maximum(length, 1e-9)
        x = exp(
            x,
            np.einsum("sn,snk->sk", np.broadcast_to(share, length.shape), v)
            / np.broadcast_to(share, length.shape).sum(-1)[:, None],
        )
    sums = np.linalg.norm(log(x), axis=-1) ** power @ weights
    return x[np.argmin(sums)]


def _unit_vectors(rng: Any, dimension: int) -> tuple[Array, Array, float]:
    n, spread = int(rng.integers(2, 40)), rng.choice([0.1, 0.3, 0.8, 1.5])
    centre = np.linalg.qr(rng.normal(size=(dimension, dimension)))[0]
    v = rng.normal(0, spread, (n, dimension - 1))
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    x = np.concatenate([np.cos(angle), np.sinc(angle / np.pi) * v], -1) @ centre
    outliers = rng.random() < 0.3
    if outliers:
        x[rng.random(n) < 0.15] *= -1
    weights = rng.uniform(0.1, 2, n) if rng.random() < 0.5 else np.ones(n)
    return x, weights, float(np.inf if outliers else spread)


def _on_sphere(data: Array, weights: Array, power: int, signs: bool, rng: Any) -> Array:
    """Return the lowest point on the sphere, or on the projective space if data count up to their sign."""

    def log(x: Array) -> Array:
        dots = np.clip(x @ data.T, -1, 1)
        flip = np.where(signs & (dots < 0), -1.0, 1.0)
        angle = np.arccos(dots * flip)
        along = data * flip[..., None] - (dots * flip)[..., None] * x[:, None]
        return along / np.maximum(np.sinc(angle / np.pi), 1e-12)[..., None]

    def exp(x: Array, v: Array) -> Array:
        length = np.linalg.norm(v, axis=-1, keepdims=True)
        y = np.cos(length) * x + np.sinc(length / np.pi) * v
        return y / np.linalg.norm(y, axis=-1, keepdims=True)

    starts = rng.normal(size=(60, data.shape[1]))
    starts = np.concatenate(
        [starts / np.linalg.norm(starts, axis=-1, keepdims=True), data + 1e-6 * starts[: len(data)]]
    )
    starts /= np.linalg.norm(starts, axis=-1, keepdims=True)
    return _lowest(starts, log, exp, weights, power)


def _sphere(power: int, projective: bool = False) -> Any:
    def one(seed: int) -> Outcome:
        rng = np.random.default_rng(seed)
        data, weights, spread = _unit_vectors(rng, 3)
        if projective:
            data = data * rng.choice([-1.0, 1.0], (len(data), 1))
        best = _on_sphere(data, weights, power, projective, rng)
        space = ss.RealProjective(2) if projective else ss.Sphere(2)
        return _run(space, data, weights, power, best, spread <= (0.2 if projective else _CLOSE), rng)

    return one


def _rotations(power: int) -> Any:
    """Rotations are quaternions up to sign, with twice the distance."""

    def one(seed: int) -> Outcome:
        rng = np.random.default_rng(seed)
        data, weights, spread = _unit_vectors(rng, 4)
        best = _on_sphere(data, weights, power, True, rng)
        turns, lowest = (ss.rotations.from_quaternions(x, scalar_first=True) for x in (data, best))
        return _run(ss.SpecialOrthogonal(3), turns, weights, power, lowest, spread <= 0.2, rng)

    return one


def _mixed_units(complex_: bool = False) -> Any:
    """Covariances whose axes have units that differ by up to 10¹⁶, by whitening on the scale of one."""

    def one(seed: int) -> Outcome:
        rng = np.random.default_rng(seed)
        m, n = int(rng.integers(2, 7)), int(rng.integers(2, 30))
        s = rng.normal(size=(n, m, m)) + (1j * rng.normal(size=(n, m, m)) if complex_ else 0)
        w, v = np.linalg.eigh((s + np.swapaxes(s.conj(), 1, 2)) / 2)
        data = (v * np.exp(w)[:, None]) @ np.swapaxes(v.conj(), 1, 2)
        factor = np.linalg.cholesky(data[0])
        for _ in range(200):
            x = np.linalg.solve(factor, np.swapaxes(np.linalg.solve(factor, data).conj(), 1, 2))
            w, v = np.linalg.eigh((x + np.swapaxes(x.conj(), 1, 2)) / 2)
            step = ((v * np.log(w)[:, None]) @ np.swapaxes(v.conj(), 1, 2)).mean(0) / 2
            w, v = np.linalg.eigh(step)
            factor = factor @ (v * np.exp(w / 2)) @ v.conj().T
        units = 10.0 ** rng.uniform(-8, 8, m)
        square = np.outer(units, units)
        space = ss.HermitianPositiveDefinite(m) if complex_ else ss.SymmetricPositiveDefinite(m)

        def fit() -> float:
            found = space.mean((data * square)[rng.permutation(n)]) / square
            # An error of 1e-10 counts as five standard errors.
            return float(space.distance((found + found.conj().T) / 2, factor @ factor.conj().T)) / 2e-11

        return outcome_of(fit)

    return one


def _turns(a: Array) -> Array:
    c, s = np.cos(a), np.sin(a)
    return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)


KINDS = {
    "mean of angles": _circle("torus:1", lambda a: a[:, None], 2),
    "median of angles": _circle("torus:1", lambda a: a[:, None], 1),
    "mean on the circle": _circle("sphere:1", lambda a: np.stack([np.cos(a), np.sin(a)], -1), 2),
    "median on the circle": _circle("sphere:1", lambda a: np.stack([np.cos(a), np.sin(a)], -1), 1),
    "mean of plane rotations": _circle("so:2", _turns, 2),
    "median of phases": _circle("u:1", lambda a: np.exp(1j * a)[:, None, None], 1),
    "mean of plane axes": _circle("rp:1", lambda a: np.stack([np.cos(a), np.sin(a)], -1), 2, np.pi),
    "mean of directions": _sphere(2),
    "median of directions": _sphere(1),
    "mean of axes": _sphere(2, True),
    "median of axes": _sphere(1, True),
    "mean of rotations": _rotations(2),
    "median of rotations": _rotations(1),
    "mean of covariances in mixed units": _mixed_units(),
    "mean of Hermitian matrices in mixed units": _mixed_units(True),
}

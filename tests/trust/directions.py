"""Noisy directions and fast spins: smoothing where several curves fit the data."""

from __future__ import annotations

from functools import partial

import numpy as np

import symspline as ss

from .outcome import Outcome, outcome_of

# Noise from which several curves fit the data, so that a warning is due.
_MUCH = np.radians(45.0)


def _error(spline: ss.SmoothingSpline, x: np.ndarray, truth: np.ndarray, space: ss.Space) -> float:
    """Return the largest distance from the truth, in standard deviations of the curve."""
    return float((space.distance(spline(x), truth) / (spline.std(x) * np.sqrt(space.dim))).max())


def _noisy(name: str, seed: int) -> Outcome:
    """Directions with noise of up to 60°, at irregular times."""
    rng = np.random.default_rng(seed)
    space, count = ss.space(name), int(rng.integers(100, 300))
    t = 50 + np.sort(rng.uniform(0, 10, count))
    noise = np.radians(rng.uniform(5, 60)) / np.sqrt(space.dim)
    frequency, phase = rng.uniform(0.2, 0.8, 3), rng.uniform(0, 6.3, 3)

    def path(t: np.ndarray) -> np.ndarray:
        u = t[:, None] - 50
        vectors = 1.2 * np.sin(frequency * u + phase) + 0.1 * u
        if name == "torus:1":
            return vectors[:, :1]
        if name == "so:3":
            return ss.rotations.from_rotation_vectors(vectors)
        north = np.broadcast_to([0.0, 0.0, 1.0], vectors.shape)
        return space.exp(north, vectors * [1.0, 1.0, 0.0])

    points = path(t)
    points = space.exp(points, noise * space.random_tangent(rng, points))
    x = np.linspace(t[3], t[-4], 301)
    return outcome_of(
        lambda: _error(ss.make_smoothing_spline(t, points, space), x, path(x), space),
        sound=bool(noise * np.sqrt(space.dim) < _MUCH),
    )


def _spin(seed: int) -> Outcome:
    """Bodies that turn by 60° to 170° from datum to datum, about an axis that wobbles."""
    rng = np.random.default_rng(seed)
    space, count = ss.SpecialOrthogonal(3), int(rng.integers(100, 200))
    t = 3 + 0.01 * np.arange(count)
    axis, phase = rng.normal(size=3), rng.uniform(0, 6.3, 3)
    axis /= np.linalg.norm(axis)
    step, noise = np.radians(rng.uniform(60, 170)), 10 ** rng.uniform(-3, -0.7)
    around = ss.rotations.from_rotation_vectors

    def path(t: np.ndarray) -> np.ndarray:
        u = t - 3
        wobble = 0.2 * np.stack([np.sin(3 * u + phase[0]), np.sin(2 * u + phase[1]), np.cos(4 * u + phase[2])], axis=-1)
        return around(wobble) @ around((100 * step * u * (1 + 0.02 * np.sin(u)))[:, None] * axis)

    points = path(t)
    points = space.exp(points, noise * space.random_tangent(rng, points))
    x = t[5:-5]
    return outcome_of(
        lambda: _error(ss.make_smoothing_spline(t, points, space), x, path(x), space),
        # Steps beyond 0.6 of the way to the cut locus are reported.
        sound=bool(step < np.radians(105)),
    )


KINDS = {
    **{f"noisy directions, {name}": partial(_noisy, name) for name in ("torus:1", "sphere:2", "so:3")},
    "fast spins": _spin,
}

"""Robust losses: paths with noise of 1e-9 to 0.1 and up to a fifth of outliers, isolated or in runs."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import symspline as ss

from .outcome import Outcome, outcome_of

# More consecutive outliers than this are reported.
_BURST = 5

_Path = Callable[[Any], Any]


def _path(name: str, rng: np.random.Generator) -> _Path:
    """Return a smooth path that moves by about one in a unit of time."""
    frequency, phase = rng.uniform(0.4, 1.5, (3, 3)), rng.uniform(0, 6.3, (3, 3))
    size = rng.normal(size=(3, 3)) * np.array([1.0, 0.5, 0.3])[:, None]

    def vectors(t: Any) -> Any:
        return np.sum(size * np.sin(frequency * np.asarray(t)[..., None, None] + phase), axis=-2)

    if name == "so:3":
        return lambda t: ss.rotations.from_rotation_vectors(vectors(t))
    if name == "sphere:2":
        sphere = ss.Sphere(2)
        north = np.array([0.0, 0.0, 1.0])
        return lambda t: sphere.exp(np.broadcast_to(north, vectors(t).shape), vectors(t) * [1.0, 1.0, 0.0])
    return vectors


def recording(name: str, seed: int) -> tuple[Any, Any, Any, Any]:
    """Return times, points, which of them are outliers, and the path."""
    rng = np.random.default_rng(seed)
    space, count = ss.space(name), int(rng.integers(80, 400))
    path = _path(name, rng)
    t = np.linspace(0, 10, count)
    if rng.random() < 0.5:
        t = np.sort(rng.uniform(0, 10, count))
    noise = 10 ** rng.uniform(-9, -1)
    points = path(t)
    points = space.exp(points, noise * space.random_tangent(rng, points))
    bad = np.zeros(count, bool)
    share, length = rng.choice([0.0, rng.uniform(0, 0.2)], p=[0.2, 0.8]), int(rng.choice([1, 1, 5, 10]))
    for _ in range(int(share * count / length)):
        first = int(rng.integers(3, count - 3 - length))
        if bad[max(first - 1, 0) : first + length + 1].any():
            continue
        bad[first : first + length] = True
        direction = space.random_tangent(rng, points[first])
        size = rng.uniform(0.5, 2) / max(float(space.norm(points[first], direction)), 1e-9)
        if length == 1:
            points[first] = space.exp(points[first], size * direction)
            continue
        # The whole run is displaced alike.
        own = slice(first, first + length)
        moved = space.transport(
            np.broadcast_to(points[first], points[own].shape),
            points[own],
            np.broadcast_to(direction, points[own].shape),
        )
        points[own] = space.exp(points[own], size * moved)
    return t + 3600.25, points, bad, lambda x: path(np.asarray(x) - 3600.25)


def _outcome(name: str, loss: str, seed: int) -> Outcome:
    space = ss.space(name)
    t, points, bad, path = recording(name, seed)
    x = np.linspace(t[3], t[-4], 701)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        right = ss.make_smoothing_spline(t[~bad], points[~bad], space, criterion="reml")
    usual = float(space.distance(right(x), path(x)).max())

    def fit() -> float:
        found = ss.make_smoothing_spline(t, points, space, loss=loss)
        return float(space.distance(found(x), path(x)).max()) / usual

    # Without outliers, too, a warning says that a curve follows nearly all data. Runs of outliers are reported, because
    # they could be bursts of motion.
    edges = np.flatnonzero(np.diff(np.concatenate([[0], bad, [0]])))
    longest = max(np.diff(edges)[::2], default=0)
    return outcome_of(fit, sound=not caught and longest <= _BURST)


KINDS = {
    f"{name} with outliers, {loss}": partial(_outcome, name, loss)
    for name in ("r:3", "so:3", "sphere:2")
    for loss in ("cauchy", "huber")
}

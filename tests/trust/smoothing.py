"""Smoothing of sound recordings: curves with a chosen λ, and their 95 % bands."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import symspline as ss

from .outcome import Outcome, outcome_of


def _recording(name: str, seed: int) -> Outcome:
    space = ss.space(name)
    rng = np.random.default_rng([seed, sum(map(ord, name))])
    n = int(rng.integers(40, 600))
    t = rng.uniform(-100, 100) + np.sort(rng.uniform(0, 1, n)) * 10 ** rng.uniform(-1, 3)
    place = (t - t[0]) / np.ptp(t)
    base = space.random_point(np.random.default_rng(5))
    frame = space.frame(base)
    waves = rng.uniform(1, 2 + n / 40, (3, space.dim))
    motion = np.sum(np.sin(2 * np.pi * (waves * place[:, None, None] + rng.uniform(0, 1, (3, space.dim)))), axis=1)
    truth = space.exp(base, np.tensordot(0.2 * motion, frame, 1))
    sigma = 10 ** rng.uniform(-3, -1)
    noisy = space.exp(truth, sigma * space.random_tangent(rng, truth))
    penalty = "jerk" if rng.uniform() < 0.3 else "acceleration"
    criterion = ("gcv", "reml")[int(rng.integers(2))]

    def error() -> float:
        curve = ss.make_smoothing_spline(t, noisy, space, penalty=penalty, criterion=criterion)
        # Root mean squares of the errors and of their standard deviations.
        apart = space.distance(curve(t), truth)
        return float(np.sqrt(np.mean(apart**2) / space.dim / np.mean(curve.std(t) ** 2)))

    return outcome_of(error)


def _kind(name: str) -> Callable[[int], Outcome]:
    return lambda seed: _recording(name, seed)


KINDS = {f"smoothing on {name}": _kind(name) for name in ("r:2", "sphere:2", "so:3", "spd:2")}

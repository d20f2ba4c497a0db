"""The rotations that all libraries get."""

from __future__ import annotations

from dataclasses import dataclass
from math import isqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

import symspline as ss

Array = NDArray[Any]

SPHERE = ss.Sphere(3)
STEP = 0.3
"""Mean angle between two keys, in radians: of the rotations; on S³ it is half of it."""


@dataclass(frozen=True)
class Sizes:
    """How much of everything."""

    knots: tuple[int, ...]
    most_knots_of_others: int
    knots_to_evaluate: int
    samples: int
    many: tuple[int, int, int]
    long_curve: int
    batch: tuple[int, int]
    most_samples: int
    least_memory: int
    goals: bool


FULL = Sizes(
    knots=tuple(10**k for k in range(1, 8)),
    most_knots_of_others=10**5,
    knots_to_evaluate=1000,
    samples=10**5,
    many=(1000, 20, 200),
    long_curve=10**6,
    batch=(10_000, 20),
    most_samples=10**6,
    least_memory=10**5,
    goals=True,
)
QUICK = Sizes(
    knots=(10, 1000, 3000),
    most_knots_of_others=10,
    knots_to_evaluate=40,
    samples=100,
    many=(3, 20, 10),
    long_curve=1000,
    batch=(10, 20),
    most_samples=1000,
    least_memory=3000,
    goals=False,
)


def rotations(n: int, seed: int = 0) -> Array:
    """Unit quaternions of a smooth random motion, scalar first, each on the side of the one before,
    shape (n, 4)."""
    window = np.hanning(11)[1:-1]
    noise = np.random.default_rng(seed).standard_normal((3, n + len(window) - 1))
    rates = np.stack([np.convolve(row, window, "valid") for row in noise], axis=-1)
    angles = np.linalg.norm(rates, axis=-1, keepdims=True)
    axes, halves = rates / angles, angles * (STEP / 2 / angles.mean())
    return running_product(np.concatenate([np.cos(halves), np.sin(halves) * axes], axis=-1))


def running_product(q: Array) -> Array:
    """q₀, q₀q₁, q₀q₁q₂, …, shape (n, 4): first within rows of √n, then over the rows."""
    n = len(q)
    width = isqrt(n - 1) + 1
    table = np.empty((width, width, 4))
    flat = table.reshape(-1, 4)
    flat[:n], flat[n:] = q, [1.0, 0.0, 0.0, 0.0]
    for j in range(1, width):
        table[:, j] = product(table[:, j - 1], table[:, j])
    for i in range(1, width):
        table[i] = product(table[i - 1, -1], table[i])
    lengths: Array = np.linalg.norm(flat[:n], axis=-1, keepdims=True)
    return flat[:n] / lengths


def product(p: Array, q: Array) -> Array:
    """pq of quaternions, scalar first."""
    a, b, c, d = np.moveaxis(p, -1, 0)
    e, f, g, h = np.moveaxis(q, -1, 0)
    parts = (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )
    return np.stack(parts, axis=-1)


def knots(n: int) -> Array:
    """Times of n keys: 0, 1, 2, …"""
    return np.arange(n, dtype=float)


def uneven(n: int, seed: int = 1) -> tuple[Array, Array]:
    """The same motion at n times with gaps between 0.5 and 1.5: times and quaternions."""
    t = np.cumsum(np.random.default_rng(seed).uniform(0.5, 1.5, n))
    t -= t[0]
    whole = int(t[-1]) + 2
    return t, ss.CubicSpline(None, rotations(whole), SPHERE)(t)


def times(n: int, samples: int) -> Array:
    """Sorted times over all of a curve through n keys."""
    return np.linspace(0, n - 1, samples)


def shuffled(x: Array, seed: int = 2) -> Array:
    """The times in random order."""
    return np.random.default_rng(seed).permutation(x)

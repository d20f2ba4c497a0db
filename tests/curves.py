"""Data and helpers that the tests of the Python interface share."""

import os
import subprocess
import sys

import numpy as np
from cases import walk

import symspline as ss

SPACES = [ss.Euclidean(3), ss.Sphere(2), ss.Hyperbolic(2), ss.Product(ss.Sphere(3), ss.Euclidean(2))]
EPS = np.finfo(float).eps


def points_on(space, n=6, batch=(), step=0.7, seed=1):
    """Points with equal steps, shape batch + (n, *point_shape); a tuple of arrays in a product."""
    if isinstance(space, ss.Product):
        return tuple(points_on(f, n, batch, step, seed + i) for i, f in enumerate(space.factors))
    rng = np.random.default_rng(seed)
    rows = [walk(space, step, n, rng) for _ in range(int(np.prod(batch)))]
    return np.reshape(rows, (*batch, n, *space.point_shape))


def parts(value):
    """The arrays of a value, of which there are several in a product."""
    return value if isinstance(value, tuple) else (value,)


def each(function, *values):
    """A function applied to the arrays of values."""
    made = tuple(map(function, *map(parts, values)))
    return made if any(isinstance(value, tuple) for value in values) else made[0]


def same(a, b):
    """Whether two values agree to the last bit, NaN included."""
    pairs = list(zip(parts(a), parts(b), strict=True))
    return all(np.shape(x) == np.shape(y) and np.array_equal(x, y, equal_nan=True) for x, y in pairs)


def largest_difference(a, b):
    return max(np.abs(np.subtract(x, y)).max() for x, y in zip(parts(a), parts(b), strict=True))


def same_curve(a, b):
    """Whether two splines and their reports agree to the last bit."""
    return a == b and same(a.velocities, b.velocities) and a.report == b.report


def run_python(code, *arguments, timeout=20, **environment):
    """Runs code in a process of its own, which must end well and in time; returns what it printed."""
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=timeout,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def at_node(space, value, i):
    """Points or vectors of node i of every curve."""
    if isinstance(space, ss.Product):
        return tuple(at_node(f, v, i) for f, v in zip(space.factors, value, strict=True))
    return np.take(value, i, axis=-1 - len(space.point_shape))


def tangents_at(space, points, size=0.3, seed=5):
    """Random tangent vectors at points."""
    return each(lambda v: size * v, space.random_tangent(np.random.default_rng(seed), points))

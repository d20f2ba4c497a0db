"""Data that the tests of the Python interface share, and ways to run code."""

import os
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from cases import COMMON, REPRESENTATIVE, SPACES, loop_over, walk
from compare import each, parts, pick

import symspline as ss

every_space = pytest.mark.parametrize("space", SPACES, ids=str)
every_kind = pytest.mark.parametrize("space", REPRESENTATIVE, ids=str)
every_single = pytest.mark.parametrize("space", [s for s in REPRESENTATIVE if not isinstance(s, ss.Product)], ids=str)
every_common = pytest.mark.parametrize("space", COMMON, ids=str)
every_batch = loop_over("batch", [(), (2, 3)])
S2, S3 = ss.Sphere(2), ss.Sphere(3)
# Its axes, as points of S².
THREE = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
KNOTS = np.array([0.0, 1.0, 1.5, 3.0, 4.0, 4.5])


def points_on(space, n=6, batch=(), step=0.7, seed=1):
    """Points with equal steps, shape batch + (n, *point_shape); a tuple of arrays in a product."""
    if isinstance(space, ss.Product):
        return tuple(points_on(f, n, batch, step, seed + i) for i, f in enumerate(space.factors))
    rng = np.random.default_rng(seed)
    rows = [walk(space, step, n, rng) for _ in range(int(np.prod(batch)))]
    return np.reshape(rows, (*batch, n, *space.point_shape))


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


def core_calls(name, function):
    """How often a call of a function of Python calls one of compiled code of that name."""
    calls = []
    sys.setprofile(lambda frame, event, arg: event == "c_call" and arg.__name__ == name and calls.append(arg))
    try:
        function()
    finally:
        sys.setprofile(None)
    return len(calls)


def at_node(space, value, i):
    """Points or vectors of node i of every curve."""
    if isinstance(space, ss.Product):
        return tuple(at_node(f, v, i) for f, v in zip(space.factors, value, strict=True))
    return np.take(value, i, axis=-1 - len(space.point_shape))


def tangents_at(space, points, size=0.3, seed=5):
    """Random tangent vectors at points."""
    return each(lambda v: size * v, space.random_tangent(np.random.default_rng(seed), points))


def with_ends(space, p):
    """End conditions with a vector at either end, for every curve its own."""
    return ((1, tangents_at(space, at_node(space, p, 0))), (2, tangents_at(space, at_node(space, p, -1), seed=6)))


def bezier(space, control, tau):
    """De Casteljau's algorithm with geodesics, (8), at one time."""
    control = [pick(control, k) for k in range(len(parts(control)[0]))]
    while len(control) > 1:
        control = [space.geodesic(p, q, tau) for p, q in pairwise(control)]
    return control[0]


def failing(kind):
    """Three curves of which the middle one fails, and the options with which it does."""
    good = points_on(S2, 20, (3,), step=0.2)
    if kind == "cut locus":
        good[1, 4] = -good[1, 3]
        return good, {}
    # Steps this long take Algorithm 1 hundreds of sweeps, short ones about forty.
    good[1] = points_on(S2, 20, step=2.2, seed=3)
    return good, {"method": "fixed-point", "max_iter": 60}


def scattered(n, seed=0):
    """Points on S³ that are far apart: hard work for Algorithm 1."""
    return S3.random_point(np.random.default_rng(seed), n)


def pair_of_curves(space):
    """A batch of two curves through the axes, in every factor."""
    axes = np.eye(3)
    points = np.stack([axes, axes[[1, 0, 2]]])
    return ss.CubicSpline(None, (points, points) if isinstance(space, ss.Product) else points, space)


def clamped(interior, degree, end=3.0):
    """Knots of a B-spline from 0 to ``end`` at which it starts and ends in its control points."""
    return np.concatenate([[0.0] * (degree + 1), interior, [end] * (degree + 1)])

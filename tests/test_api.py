"""The public interface, sentence by sentence: what goes in, what comes out, and of what shape."""

import copy
import io
import itertools
import os
import pickle
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from curves import EPS, SPACES, each, largest_difference, parts, points_on, run_python, same, same_curve
from numpy.polynomial import Polynomial
from scipy.integrate import quad
from scipy.interpolate import CubicSpline as FlatSpline

import symspline as ss

every_space = pytest.mark.parametrize("space", SPACES, ids=str)
BATCHES = [(), (4,), (2, 3)]
EPOCH = 1_700_000_000_000_000_000
S2 = ss.Sphere(2)
THREE = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]


def point_shapes(space):
    return space.point_shape if isinstance(space, ss.Product) else (space.point_shape,)


def shapes(value):
    return tuple(np.shape(part) for part in parts(value))


def end_vectors(space, points, size=0.3, seed=5):
    """Tangent vectors at the first and the last point of every curve."""
    rng = np.random.default_rng(seed)
    ends = [each(lambda p, s: p[(..., i, *(slice(None),) * len(s))], points, shape_of(space)) for i in (0, -1)]
    return [each(lambda v: size * v, space.random_tangent(rng, p)) for p in ends]


def shape_of(space):
    """Point shapes in a form that `each` walks through."""
    return space.point_shape if isinstance(space, ss.Product) else [*space.point_shape]


# ---- times ----


def test_t_none_counts_from_zero():
    p = points_on(S2, 5)
    spline = ss.CubicSpline(None, p, S2)
    assert same(spline.t, np.arange(5.0))
    assert spline == ss.CubicSpline(np.arange(5.0), p, S2)


def test_one_row_of_times_serves_all_curves():
    p, t = points_on(S2, 5, (2, 3)), np.array([0.0, 1, 1.5, 3, 4])
    spline = ss.CubicSpline(t, p, S2)
    assert spline.t.shape == (5,)
    assert same(spline.velocities[1, 2], ss.CubicSpline(t, p[1, 2], S2).velocities)


def test_every_curve_may_have_its_own_times():
    p = points_on(S2, 5, (2, 3))
    t = np.cumsum(np.random.default_rng(0).uniform(0.5, 2, (2, 3, 5)), axis=-1)
    spline = ss.CubicSpline(t, p, S2)
    assert same(spline.t, t)
    for i, j in itertools.product(range(2), range(3)):
        assert same(spline.velocities[i, j], ss.CubicSpline(t[i, j], p[i, j], S2).velocities)


@pytest.mark.parametrize(
    "t",
    [[0, 1, 3, 4], (0.0, 1.0, 3.0, 4.0), *(np.array([0, 1, 3, 4], d) for d in "bBhiqQefd>")]
    if False
    else [[0, 1, 3, 4], (0.0, 1.0, 3.0, 4.0)] + [np.array([0, 1, 3, 4], d) for d in ("i1", "u4", "i8", "f4", ">f8")],
    ids=str,
)
def test_times_of_any_number_type(t):
    p = points_on(S2, 4)
    spline = ss.CubicSpline(t, p, S2)
    assert spline.t.dtype == np.float64
    assert spline == ss.CubicSpline(np.array([0.0, 1, 3, 4]), p, S2)

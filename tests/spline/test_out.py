"""Results in existing arrays: ``out`` of calls and of `symspline.evaluate`."""

import numpy as np
import pytest
from cases import loop_over
from compare import same
from curves import points_on
from refused import raises

import symspline as ss

SPACES = ["sphere:2", "so:3", "cp:2", "spd:2", "se:3", "euclidean:1", "sphere:300", "so:3 x r:3", "stiefel:2,4"]


def spline_of(name, batch=()):
    if not name.startswith("stiefel"):
        space = ss.space(name)
        return ss.CubicSpline(None, points_on(space, 5, batch, step=0.3), space)
    space, rng = ss.Stiefel(2, 4), np.random.default_rng(5)
    first = space.random_point(rng)
    steps = space.random_tangent(rng, np.broadcast_to(first, (*batch, 5, *first.shape)))
    return ss.CubicSpline(None, space.exp(first, 0.1 * steps), space)


def like(values, dtype=None):
    if isinstance(values, tuple):
        return tuple(like(part, dtype) for part in values)
    return np.full(values.shape, np.nan, dtype or values.dtype)


@loop_over("nu", [0, 1, 2])
@loop_over("batch", [(), (2, 3)])
@pytest.mark.parametrize("name", SPACES)
def test_out_takes_the_result(name, batch, nu):
    if nu and name.startswith("stiefel"):
        nu = 1
    spline, x = spline_of(name, batch), np.array([[0.5, 1.0, 3.9], [0.0, 4.0, 2.2]])
    values = spline(x, nu)
    out = like(values)
    given = spline(x, nu, out=out)
    assert given is out or all(a is b for a, b in zip(given, out, strict=True))
    assert same(values, out)


def test_gaps_in_memory_and_other_types():
    spline, x = spline_of("so:3"), np.linspace(0, 4, 9)
    values = spline(x)
    wide = np.zeros((9, 3, 6))
    spline(x, out=wide[:, :, ::2])
    assert same(wide[:, :, ::2], values) and not wide[:, :, 1::2].any()
    fortran = np.zeros((9, 3, 3), order="F")
    assert same(spline(x, out=fortran), values)
    assert same(spline(x, out=np.empty((9, 3, 3), np.float32)), values.astype(np.float32))
    swapped = np.empty((9, 3, 3), ">f8")
    assert np.array_equal(spline(x, out=swapped), values)
    assert same(spline(x, out=np.empty((9, 3, 3), complex)), values.astype(complex))


def test_times_may_lie_where_results_go():
    spline = ss.CubicSpline(None, np.random.default_rng(0).normal(size=(5, 1)), "euclidean:1")
    x = np.linspace(0, 4, 6)[:, None]
    values = spline(x[:, 0])
    assert same(spline(x[:, 0], out=x), values) and same(x, values)


def test_of_evaluate():
    spline, x = spline_of("cp:2", (2,)), np.linspace(0, 4, 6)
    out = np.empty((2, 6, 3), complex)
    assert ss.evaluate(spline.t, spline.points, spline.velocities, "cp:2", x, nu=1, out=out) is out
    assert same(out, spline(x, 1))


def test_invalid_out_arrays_raise():
    for name, x, out, message in [
        ("sphere:2", np.arange(5.0), np.empty((4, 3)), r"out has shape \(4, 3\), but the result has \(5, 3\)"),
        ("sphere:2", np.arange(5.0), np.empty((5, 3), int), "out has dtype int64, which cannot hold float64"),
        ("sphere:2", np.arange(5.0), [[0.0] * 3] * 5, "out must be a NumPy array, not list"),
        ("sphere:2", np.arange(5.0), np.broadcast_to(0.0, (5, 3)), "out is read-only"),
        ("cp:2", 0.0, np.empty(3), "out has dtype float64, which cannot hold complex128"),
        ("so:3 x r:3", 0.0, np.empty((3, 3)), "out"),
    ]:
        raises(message, spline_of(name), x, out=out)
    raises("dtype and out are both given", spline_of("sphere:2"), 0.0, out=np.empty(3), dtype="float32")

"""Evaluation: shapes, unsorted times, derivatives, speed, and invalid times."""

import math

import numpy as np
import pytest
from compare import each, found, pick, same, shaped
from curves import KNOTS, S2, every_batch, every_common, every_kind, points_on
from refused import INF, NAN, TWO, P, raises

import symspline as ss


@every_kind
@every_batch
def test_evaluation_shapes_and_types(space, batch):
    spline = ss.CubicSpline(KNOTS, points_on(space, batch=batch, step=0.5), space)
    for x in (
        0.7,
        np.float32(0.7),
        np.array(2),
        np.zeros(0),
        [0.5, 4.0],
        np.ones((2, 0, 3)),
        np.ones((2, 1, 3)),
        [[1, 2]],
    ):
        lead = (*batch, *np.shape(x))
        for nu in range(3):
            assert found(spline(x, nu=nu)) == shaped(space, lead)
        assert np.shape(spline.speed(x)) == lead and spline.speed(x).dtype == np.float64
    x = np.linspace(0, 4, math.prod(batch) * 2).reshape(*batch, 2)
    for nu in range(3):
        own = spline(x, nu, per_curve=True)
        assert found(own) == shaped(space, x.shape)
        for i in np.ndindex(*batch):
            assert same(pick(own, i), pick(spline(x[i], nu), i))


@every_common
def test_any_order_of_times(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6, (2,)), space)
    x = np.random.default_rng(2).uniform(0, 4.5, (3, 50))
    order = np.argsort(x, axis=None)
    for nu in range(3):
        at_once = spline(x, nu=nu)
        sorted_ones = spline(x.ravel()[order], nu=nu)
        flat = each(lambda y: y.reshape(2, 150, *y.shape[3:])[:, order], at_once)
        assert same(flat, sorted_ones)


@every_kind
def test_velocity_and_speed(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, batch=(2,), step=0.5), space)
    x = np.linspace(0, 4, 9)
    y, v = spline(x), spline(x, nu=1)
    space.check_point(y)
    space.check_tangent(y, v)
    space.check_tangent(y, spline(x, nu=2))
    assert np.allclose(spline.speed(x), space.norm(y, v), rtol=1e-13, atol=0)


def test_invalid_times_of_evaluation_raise():
    spline = ss.CubicSpline(None, P, S2)
    for x, match in [
        (NAN, r"x is NaN; times must be finite"),
        ([0.5, NAN], r"x\[1\] is NaN; times must be finite"),
        ([0.5, 1, INF], r"x\[2\] is inf; times must be finite"),
        (2.5, r"x = 2\.5 is outside the knots \[0, 2\].*extrapolate=True, 'geodesic' or 'periodic'"),
        ([0, 2, -0.25], r"x\[2\] = -0\.25 is outside the knots"),
        (2 + 2**-47, r"x = 2\.000000000000007 is outside the knots"),
        (1j, r"x must be numbers, not complex128"),
        ("a", r"x is 'a', not a date such as 2021-08-29"),
        (None, r"x must be an array of numbers, not of object: it is a NoneType"),
        (np.timedelta64(1, "s"), r"x must be numbers, not timedelta64"),
        (np.datetime64("2024-01-01"), r"the knots are numbers, so x must be numbers, not datetime64"),
    ]:
        for call in (spline, spline.speed, lambda x: ss.evaluate(None, P, spline.velocities, S2, x)):
            raises(match, call, x)
    for policy in (None, False, True, "geodesic", "periodic"):
        for x in (NAN, INF, -INF):
            match = r"x\[1\] is (NaN|-?inf); times must be finite"
            raises(match, ss.CubicSpline(None, P, S2, extrapolate=policy), [1.0, x])


def test_error_names_the_curve_of_a_bad_time():
    spline = ss.CubicSpline([[0, 1, 2], [0, 1, 3]], TWO, S2)
    for x, per_curve, match in (
        (2.5, False, r"x = 2\.5 is outside the knots \[0, 2\] of curve 0"),
        ([[1, 1], [1, NAN]], True, r"x\[1,1\] is NaN"),
        (np.ones(3), True, r"must begin with the batch axes \(2,\); got \(3,\)"),
    ):
        raises(match, spline, x, per_curve=per_curve)


def test_dates_and_numbers_do_not_mix():
    for x, match in [
        (0.5, r"the knots are dates, so x must be datetime64, not float64"),
        (np.array(["2024-01-01", "NaT"], "M8[D]"), r"x\[1\] is NaT"),
        (np.datetime64("2023-12-31"), r"x = .* is outside the knots"),
    ]:
        raises(match, ss.CubicSpline(np.datetime64("2024-01-01") + np.arange(3), P, S2), x)


@pytest.mark.parametrize("name, kind", [("sphere:2", np.float32), ("cp:1", np.complex64)])
@pytest.mark.parametrize("dtype", ["float32", np.float32, np.dtype("c8")])
def test_results_in_single_precision(name, kind, dtype):
    spline, x = ss.CubicSpline(None, points_on(ss.space(name), 4), name), np.linspace(0, 3, 9)
    for nu in (0, 1, 2):
        found = spline(x, nu, dtype=dtype)
        assert found.dtype == kind and np.array_equal(found, spline(x, nu).astype(kind))
        assert np.array_equal(spline(x, nu, dtype="float64"), spline(x, nu))


def test_single_precision_in_a_product_and_of_one_time():
    spline = ss.CubicSpline(None, points_on(ss.space("cp:1 x r:2"), 4), "cp:1 x r:2")
    assert spline.speed([0.5], dtype="float32").dtype == spline.speed(0.5, dtype="f4").dtype == np.float32
    assert spline.speed(0.5, dtype="f4") == np.float32(spline.speed(0.5))
    assert [part.dtype.name for part in spline(0.5, dtype="float32")] == ["complex64", "float32"]
    for dtype in ("int", "f2", "nonsense", 3):
        raises("dtype must be 'float32' or 'float64', not", spline, 0.5, dtype=dtype)


LINE, MOVED = ss.CubicSpline([0, 1, 2], [[0.0], [1.0], [0.0]], "r:1"), [[0.0], [1.0], [0.0]]
DERIVATIVES = {
    "call": LINE,
    "jvp": lambda x, nu: LINE.jvp(x, points=MOVED, nu=nu),
    "vjp": lambda x, nu: LINE.vjp(x, [1.0], nu=nu).points,
    "lift": lambda x, nu: LINE.lift(x, nu=nu),
    "evaluate": lambda x, nu: ss.evaluate(None, MOVED, MOVED, "r:1", x, nu=nu),
    "Bézier curve": ss.BezierCurve(MOVED, "r:1"),
}


@pytest.mark.parametrize("name", DERIVATIVES)
def test_orders_of_derivatives_are_small_integers(name):
    call = DERIVATIVES[name]
    most, words = (3, "0, 1, 2 or 3") if name == "call" else (2, "0, 1 or 2")
    for nu in (np.int64(1), np.uint8(1)):
        assert np.array_equal(call(0.5, nu=nu), call(0.5, nu=1))
    for nu in (True, 0.5, 1.0, np.float64(1), np.nan, most + 1, -1, "1", None, [1]):
        raises(f"nu must be {words}, not", call, 0.5, nu=nu)

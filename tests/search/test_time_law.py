"""The fastest traversals of paths: limits, closed forms, and the durations of toppra."""

import pickle
from itertools import pairwise

import numpy as np
import pytest
from compare import parts
from curves import points_on
from refused import raises

import symspline as ss

# Durations that toppra 0.6.10 computed with `toppra_duration` below and 4000 intervals. Data come from NumPy's PCG64
# generator with the given seed, which is the same on every machine.
STORED = {
    0: (6, [1.0], [2.0], 5.367836252125117),
    1: (10, [1.0, 2.0, 1.5], [2.0, 3.0, 1.0], 17.411247118846788),
    2: (20, [2.0] * 6, [3.0, 4.0, 5.0, 6.0, 7.0, 8.0], 21.092873159707555),
    3: (5, [1e3, 1e3], [1.0, 1.0], 7.8533020310919905),
}


def joints(seed, n, count):
    """Irregular times, and a random walk of joint angles."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.5, 1.5, n))
    return t - t[0], np.cumsum(rng.normal(0, 1, (n, count)), axis=0)


def toppra_duration(t, q, speeds, accelerations, intervals):
    toppra = pytest.importorskip("toppra")
    from toppra import algorithm, constraint

    each = max(4, intervals // (len(t) - 1))
    grid = np.unique(np.concatenate([np.linspace(a, b, each + 1) for a, b in pairwise(t)]))
    velocity = constraint.JointVelocityConstraint(np.array([[-x, x] for x in speeds]))
    acceleration = constraint.JointAccelerationConstraint(np.array([[-x, x] for x in accelerations]))
    acceleration.set_discretization_type(constraint.DiscretizationType.Interpolation)
    path = toppra.SplineInterpolator(t, q, bc_type="natural")
    task = algorithm.TOPPRA([velocity, acceleration], path, gridpoints=grid, parametrizer="ParametrizeConstAccel")
    return float(task.compute_trajectory(0, 0).duration)


def shares(curve, law, count=20_000):
    """The norms of velocity and acceleration as parts of their limits, by the chain rule; one row per limit."""
    times = np.linspace(0, law.duration, count)[1:-1]
    x, rate, second = (law(times, nu) for nu in (0, 1, 2))
    factors = getattr(curve.space, "factors", (curve.space,))
    values = [parts(curve(x, nu)) for nu in (0, 1, 2)]
    found = []
    for i, space in enumerate(factors):
        one = (-1,) + (1,) * len(space.point_shape)
        p, v, a = (own[i] for own in values)
        a = a * (rate**2).reshape(one) + v * second.reshape(one)
        found.append(space.norm(p, v * rate.reshape(one)) / law.max_speed[i])
        found.append(space.norm(p, a) / law.max_acceleration[i])
    return np.array(found)


@pytest.mark.parametrize("name", ["r:3", "sphere:2", "so:3", "h:2", "spd:2", "cp:2", "gr:2,4", "se:3", "so:3 x r:3"])
@pytest.mark.parametrize("with_speed", [True, False])
def test_keeps_its_limits_and_uses_them(name, with_speed):
    space = ss.space(name)
    t, _ = joints(4, 15, 1)
    curve = ss.CubicSpline(t, points_on(space, 15, step=0.4), space)
    product = isinstance(space, ss.Product)
    speed = (1.0, 0.7) if product else 1.0
    law = ss.time_law(curve, max_speed=speed if with_speed else None, max_acceleration=(2.0, 3.0) if product else 2.0)
    found = shares(curve, law).max(axis=0)
    assert found.max() < 1.01
    assert (found > 0.97).mean() > 0.8
    times = np.linspace(0, law.duration, 5000)
    assert (np.diff(law(times)) > 0).all()
    np.testing.assert_allclose(law([0, law.duration]), curve.domain, rtol=1e-15)
    assert np.abs(law([0, law.duration], nu=1)).max() < 1e-6


def test_derivatives_and_pickles():
    curve = ss.CubicSpline(*joints(4, 15, 3), "r:3")
    law = ss.time_law(curve, max_speed=2.0, max_acceleration=3.0)
    # Within the intervals, where the second derivative is constant.
    knots, width = law.knots, np.diff(law.knots)
    times, h = knots[:-1] + width / 2, 1e-3 * width
    np.testing.assert_allclose((law(times + h) - law(times - h)) / (2 * h), law(times, nu=1), rtol=1e-6)
    np.testing.assert_allclose(
        (law(times + h, 1) - law(times - h, 1)) / (2 * h), law(times, nu=2), rtol=1e-5, atol=1e-6
    )
    # Value and derivative are continuous.
    for nu in (0, 1):
        after, before = law(knots[1:-1], nu), law(np.nextafter(knots[1:-1], 0), nu)
        np.testing.assert_allclose(after, before, rtol=1e-9)
    again = pickle.loads(pickle.dumps(law))
    assert np.array_equal(again(times), law(times)) and repr(again) == repr(law)


@pytest.mark.parametrize("seed", STORED)
def test_agrees_with_toppra(seed):
    n, speeds, accelerations, stored = STORED[seed]
    t, q = joints(seed, n, len(speeds))
    if len(speeds) == 1:
        curve, limits = ss.CubicSpline(t, q, "r:1"), (speeds[0], accelerations[0])
    else:
        columns = tuple(q[:, i : i + 1] for i in range(q.shape[1]))
        curve, limits = (
            ss.CubicSpline(t, columns, " x ".join(["r:1"] * len(columns))),
            (tuple(speeds), tuple(accelerations)),
        )
    law = ss.time_law(curve, max_speed=limits[0], max_acceleration=limits[1], grid_size=4000)
    assert abs(law.duration / stored - 1) < 1e-4


@pytest.mark.parametrize("seed", STORED)
def test_stored_durations_are_those_of_toppra(seed):
    n, speeds, accelerations, stored = STORED[seed]
    found = toppra_duration(*joints(seed, n, len(speeds)), speeds, accelerations, 4000)
    assert abs(found / stored - 1) < 1e-6


def trapezoid(length, speed, acceleration):
    """The duration of the fastest motion between two rests on a straight line."""
    if length * acceleration < speed**2:
        return 2 * np.sqrt(length / acceleration)
    return length / speed + speed / acceleration


@pytest.mark.parametrize("length", [0.5, 3.0])
def test_geodesics_have_trapezoids(length):
    end = [np.cos(length), np.sin(length), 0.0]
    middle = [np.cos(0.6 * length), np.sin(0.6 * length), 0.0]
    corner = [0.0, 0.0, 1.0]
    # The parametrisation is not uniform. The corner adds a rest.
    curve = ss.HermiteSpline.from_points([0.0, 1.0, 1.4], [[1, 0, 0], middle, end], "sphere:2", method="pchip")
    law = ss.time_law(curve, max_speed=1.1, max_acceleration=2.0, grid_size=4000)
    assert abs(law.duration / trapezoid(length, 1.1, 2.0) - 1) < 4e-4
    polygon = ss.PiecewiseGeodesic([0.0, 1.0, 1.4], [[1, 0, 0], end, corner], "sphere:2")
    law = ss.time_law(polygon, max_speed=1.1, max_acceleration=2.0)
    expected = trapezoid(length, 1.1, 2.0) + trapezoid(np.pi / 2, 1.1, 2.0)
    assert abs(law.duration / expected - 1) < 1e-5


@pytest.mark.parametrize("name", ["rp:2", "cp:1", "gr:2,4"])
def test_durations_do_not_depend_on_representatives(name):
    """Velocities at a knot are those of two representatives of its point: their difference is no jump."""
    points, a = points_on(ss.space(name), step=0.3), 1.1 * np.arange(6)
    turns = {"rp:2": (-1.0) ** np.arange(6)[:, None], "cp:1": np.exp(1j * a)[:, None]}
    if name in turns:
        others = points * turns[name]
    else:
        others = points @ np.moveaxis(np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]), -1, 0)
    one, two = (
        ss.time_law(ss.CubicSpline(None, p, name), max_speed=1.0, max_acceleration=2.0) for p in (points, others)
    )
    assert one.duration == pytest.approx(two.duration, rel=1e-4)


def test_speeds_at_the_ends():
    line = ss.CubicSpline([0, 3], [[0.0], [2.0]], "r:1")
    law = ss.time_law(line, max_acceleration=1.0, max_speed=2.0, initial_speed=1.0, final_speed=0.5)
    # v² = v₀² + 2 a s up to the largest speed w, and down: w² = (v₀² + v₁²)/2 + a L.
    w = np.sqrt((1.0 + 0.25) / 2 + 2.0)
    assert abs(law.duration - (w - 1.0 + w - 0.5)) < 1e-4
    np.testing.assert_allclose(line.speed(law([0, law.duration])) * law([0, law.duration], 1), [1.0, 0.5], rtol=1e-9)
    raises("initial_speed is too high", ss.time_law, line, max_acceleration=1.0, initial_speed=2.1)
    raises("final_speed cannot be reached", ss.time_law, line, max_acceleration=1.0, final_speed=2.1)
    raises(
        "initial_speed = 3.0 exceeds the limits",
        ss.time_law,
        line,
        max_acceleration=9.0,
        max_speed=2.0,
        initial_speed=3.0,
    )


def test_velocities_that_vanish():
    """Clamped ends do not slow the traversal down, nor does a turning point without a jump."""
    points = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]
    clamped = ss.CubicSpline(None, points, "r:2", bc_type="clamped")
    law = ss.time_law(clamped, max_speed=1.0, max_acceleration=2.0, grid_size=4000)
    assert abs(law.duration / trapezoid(2.0, 1.0, 2.0) - 1) < 2e-3
    # x = t², whose velocity vanishes inside the domain: the motion is reversed.
    cusp = ss.HermiteSpline([-1.0, 0.0, 1.0], [[1.0], [0.0], [1.0]], [[-2.0], [0.0], [2.0]], "r:1")
    law = ss.time_law(cusp, max_speed=10.0, max_acceleration=2.0)
    assert shares(cusp, law).max() < 1.01
    assert abs(law.duration / (2 * trapezoid(1.0, 10.0, 2.0)) - 1) < 0.02


def test_dates_of_time_laws():
    t = np.datetime64("2026-03-01T12:00") + np.arange(3) * np.timedelta64(1, "h")
    curve = ss.CubicSpline(t, [[0.0], [3600.0], [7200.0]], "r:1")
    law = ss.time_law(curve, max_speed=2.0, max_acceleration=1.0)
    assert law.duration == pytest.approx(3602.0, rel=1e-4)
    # Times of the curve are seconds since its first knot.
    np.testing.assert_allclose(law([0.0, law.duration / 2, law.duration]), [0.0, 3600.0, 7200.0], atol=1e-6)
    assert law(law.duration / 2, nu=1) == pytest.approx(2.0)


def test_retimed_curves_keep_the_limits():
    t, _ = joints(4, 8, 1)
    space = ss.space("so:3")
    curve = ss.CubicSpline(t, points_on(space, 8, step=0.4), space)
    retimed = curve.retime(ss.time_law(curve, max_speed=1.0, max_acceleration=2.0))
    assert retimed.extrema("speed")[1].max() < 1.01
    x = np.linspace(*retimed.domain, 5000)
    assert space.norm(retimed(x), retimed(x, nu=2)).max() < 2.02
    pair = ss.SegmentedCurve([curve, curve.shift(100.0)])
    raises("curve is not finite in its whole domain", ss.time_law, pair, max_acceleration=1.0)


def test_invalid_input_of_time_laws_raises():
    curve = ss.CubicSpline(*joints(4, 5, 2), "r:2")
    pair = ss.CubicSpline(None, points_on(ss.space("so:3 x r:3"), 4), "so:3 x r:3")
    raises("curve must be a curve", ss.time_law, 3, max_acceleration=1.0)
    raises("max_acceleration is needed", ss.time_law, curve, max_acceleration=None)
    raises("max_acceleration must be a positive number", ss.time_law, curve, max_acceleration=0.0)
    raises("max_speed must be a positive number between", ss.time_law, curve, max_acceleration=1.0, max_speed=1e300)
    raises("max_speed must be one number", ss.time_law, curve, max_acceleration=1.0, max_speed=(1.0, 2.0))
    raises("max_acceleration must be a tuple with 2 limits", ss.time_law, pair, max_acceleration=1.0)
    raises("final_speed must be", ss.time_law, curve, max_acceleration=1.0, final_speed=-1.0)
    raises("grid_size must be", ss.time_law, curve, max_acceleration=1.0, grid_size=2.5)
    batch = ss.CubicSpline(None, np.zeros((2, 4, 1)) + np.arange(4.0)[:, None], "r:1")
    raises("curve is a batch", ss.time_law, batch, max_acceleration=1.0)
    rest = ss.PiecewiseGeodesic(None, [[0.0], [1.0], [1.0], [2.0]], "r:1")
    raises("curve does not move between its times 1.0", ss.time_law, rest, max_acceleration=1.0)
    law = ss.time_law(curve, max_acceleration=1.0)
    raises("x = -1.0 is outside the domain", law, -1.0)
    raises("nu must be 0, 1 or 2", law, 0.0, 3)

"""Starts from integrated rates, and automatic knots: recordings in which attitudes alone mislead."""

import warnings

import numpy as np
import pytest

import symspline as ss
from symspline import measure

SO3 = ss.SpecialOrthogonal(3)
TURN = ss.rotations.from_rotation_vectors


def spinning(seed, degrees, end=20.0, between=2.0, sigma=0.01, noise=0.005, bias=(0.05, -0.03, 0.08)):
    """A body that turns by an angle per second and wobbles; times do not begin at zero."""
    rng = np.random.default_rng(seed)
    begin = 37.5
    fine = np.arange(begin - 1, begin + end + 1, 0.01)

    def attitude(t):
        wobble = 0.2 * np.stack([np.sin(0.9 * t), np.cos(0.7 * t), np.sin(1.3 * t + 1)], axis=-1)
        return TURN(wobble) @ TURN(np.outer(np.radians(degrees) * t, [0.6, 0.0, 0.8]))

    truth = ss.CubicSpline(fine, attitude(fine), SO3, bc_type="not-a-knot")
    t = np.arange(begin, begin + end, between)
    t[1:] += rng.uniform(-0.2, 0.2, len(t) - 1) * between
    s = np.arange(begin, begin + end, 0.02)
    seen = truth(t) @ TURN(sigma * rng.standard_normal((len(t), 3)))
    omega = ss.rotations.angular_velocity(truth, s) + bias + noise * rng.standard_normal((len(s), 3))
    return truth, t, seen, s, omega, np.array(bias)


def given(t, seen, s, omega, sigma=0.01, noise=0.005, loss=None, offset=None, prior=None):
    return [
        measure.Points(t, seen, sigma=sigma, loss=loss),
        measure.BodyRates(s, omega, sigma=noise, bias=measure.Constant(3, sigma=prior), time_offset=offset),
    ]


def check(curve, truth, bias, x, limit=5.0):
    """Attitudes and the bias are within five standard deviations."""
    off = ss.rotations.as_rotation_vectors(np.swapaxes(truth(x), -1, -2) @ curve(x))
    assert np.max(np.linalg.norm(off, axis=1) / np.sqrt(3) / curve.std(x)) < limit
    found = curve.parameters["gyro bias"]
    assert np.all(np.abs(found.value - bias) < limit * found.std)


@pytest.mark.parametrize("degrees", [20, 200, 300])
@pytest.mark.parametrize("knots", [161, "auto"])
def test_several_turns_between_attitudes(degrees, knots):
    truth, t, seen, s, omega, bias = spinning(degrees, degrees)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        curve = ss.estimate(given(t, seen, s, omega), knots, "so:3")
    check(curve, truth, bias, np.linspace(t[0], t[-1], 200))


def test_a_large_bias_a_gap_and_wrong_attitudes():
    truth, t, seen, s, omega, bias = spinning(1, 250, end=40.0, bias=(0.4, -0.3, 0.3), sigma=0.05)
    kept = (t < 50) | (t > 60)
    t, seen = t[kept], seen[kept].copy()
    seen[[2, 9]] = SO3.random_point(np.random.default_rng(2), (2,))
    curve = ss.estimate(given(t, seen, s, omega, sigma=0.05, loss="cauchy"), 401, "so:3")
    check(curve, truth, bias, np.linspace(s[0], s[-1], 200))


def test_attitudes_in_the_middle_only_and_quaternions():
    truth, t, seen, s, omega, _ = spinning(3, 150)
    some = (t > 45) & (t < 52)
    # The signs are those of a continuous path of quaternions.
    path = ss.rotations.as_quaternions(truth(s), scalar_first=True)
    path[1:] *= np.cumprod(np.where(np.sum(path[1:] * path[:-1], axis=1) < 0, -1.0, 1.0))[:, None]
    quaternions = ss.rotations.as_quaternions(seen[some], scalar_first=True)
    near = path[np.searchsorted(s, t[some]).clip(max=len(s) - 1)]
    quaternions *= -np.sign(np.sum(near * quaternions, axis=1))[:, None]
    curve = ss.estimate(given(t[some], quaternions, s, omega), 161, "sphere:3")
    x = np.linspace(s[0], s[-1], 100)
    off = SO3.distance(ss.rotations.from_quaternions(curve(x), scalar_first=True), truth(x))
    # Lengths on the sphere of quaternions are half of angles.
    assert np.max(off / np.sqrt(3) / (2 * curve.std(x))) < 6


@pytest.mark.parametrize("late", [0.21, -0.4])
@pytest.mark.parametrize("of_points", [False, True])
def test_delays_of_a_spinning_body(late, of_points):
    _, t, seen, s, omega, bias = spinning(6, 120)
    t, seen = t[(t > s[0] + 0.5) & (t < s[-1] - 0.5)], seen[(t > s[0] + 0.5) & (t < s[-1] - 0.5)]
    offset = measure.Constant(1)
    gyro = measure.BodyRates(s, omega, sigma=0.005, bias=measure.Constant(3))
    points = measure.Points(t - late, seen, sigma=0.01, time_offset=offset)
    knots = np.linspace(s[0], s[-1], 161)
    if not of_points:
        gyro = measure.BodyRates(s - late, omega, sigma=0.005, bias=measure.Constant(3), time_offset=offset)
        points = measure.Points(t, seen, sigma=0.01)
        knots = np.linspace(s[0] - 1, s[-1] + 1, 171)
    curve = ss.estimate([points, gyro], knots, "so:3")
    found = curve.parameters["time offset"]
    assert abs(found.value[0] - late) < 5 * found.std[0] and found.std[0] < 0.01
    assert np.all(np.abs(curve.parameters["gyro bias"].value - bias) < 5 * curve.parameters["gyro bias"].std)


def test_velocities_join_the_start():
    """Positions that are more than half a turn of the sphere apart."""
    globe = ss.Sphere(2)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        fine = np.linspace(5, 25, 801)
        path = np.stack([np.cos(1.4 * fine), np.sin(1.4 * fine), 0.5 * np.sin(0.8 * fine)], axis=-1)
        truth = ss.CubicSpline(fine, globe.project(path), globe, bc_type="not-a-knot")
        t, s = np.linspace(5, 25, 9), np.sort(rng.uniform(5, 25, 300))
        y = globe.exp(truth(s), 0.01 * globe.random_tangent(rng, truth(s)))
        v = globe.transport(truth(s), y, truth(s, 1)) + 0.02 * globe.random_tangent(rng, y)
        seen = globe.exp(truth(t), 0.01 * globe.random_tangent(rng, truth(t)))
        both = [measure.Points(t, seen, sigma=0.01), measure.Velocities(s, y, v, sigma=0.02)]
        curve = ss.estimate(both, 81, globe)
        x = np.linspace(5, 25, 100)
        assert np.max(globe.distance(curve(x), truth(x)) / np.sqrt(2) / curve.std(x)) < 5


def test_the_jerk_is_the_default_where_rates_are_measured():
    _, t, seen, s, omega, _ = spinning(7, 20)
    both, x = given(t, seen, s, omega), np.linspace(40, 50, 7)
    assert np.array_equal(ss.estimate(both, 41, "so:3")(x), ss.estimate(both, 41, "so:3", penalty="jerk")(x))
    y = np.sin(t / 5)[:, None]
    ranges = [measure.Points(t, y, sigma=0.01), measure.Function(t, lambda p: p - y, sigma=0.01)]
    assert np.array_equal(ss.estimate(ranges, 8, "r:1")(x), ss.estimate(ranges, 8, "r:1", penalty="acceleration")(x))
    speeds = [measure.Points(t, y, sigma=0.1), measure.Velocities(t, y, np.cos(t / 5)[:, None] / 5, sigma=0.1)]
    assert np.array_equal(ss.estimate(speeds, 8, "r:1")(x), ss.estimate(speeds, 8, "r:1", penalty="jerk")(x))


# ---- knots ----


@pytest.mark.parametrize(("cycles", "least", "most"), [(1.6, 13, 60), (20, 200, 1500)])
def test_automatic_knots_follow_the_motion(cycles, least, most):
    rng = np.random.default_rng(3)
    # The times of both sensors differ by rounding errors.
    t, s = np.linspace(0, 10, 51), np.linspace(0, 10, 1001)
    assert np.any(np.diff(np.unique(np.concatenate([t, s]))) < 1e-12)
    fine = np.linspace(0, 10, 4001)
    truth = ss.CubicSpline(fine, TURN(np.sin(2 * np.pi * cycles / 10 * fine)[:, None] * [0.2, 0.4, 0.8]), SO3)
    seen = truth(t) @ TURN(0.03 * rng.standard_normal((51, 3)))
    bias = np.array([0.03, -0.02, 0.05])
    omega = ss.rotations.angular_velocity(truth, s) + bias + 0.02 * rng.standard_normal((1001, 3))
    curve = ss.estimate(given(t, seen, s, omega, sigma=0.03, noise=0.02), "auto", "so:3")
    assert least <= len(curve.t) <= most and 0.9 < curve.report.sigma < 1.1
    check(curve, truth, bias, np.linspace(0, 10, 300))


def test_numerical_failures_are_convergence_errors():
    _, t, seen, s, omega, _ = spinning(9, 20)
    for knots in (31, "auto"):
        with np.errstate(all="ignore"), pytest.raises(ss.ConvergenceError, match=r"The linear problem .* Check sigma"):
            ss.estimate(given(t, seen, s, omega, noise=1e-160), knots, "so:3")


def test_knots_at_all_times():
    """Times of sensors that differ by rounding errors are knots 1e-16 apart."""
    _, t, seen, s, omega, _ = spinning(10, 20)
    t = np.linspace(t[0], t[-1], len(t))
    knots = np.unique(np.concatenate([t, s, t + 1e-14]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            curve = ss.estimate(given(t, seen, s, omega), knots, "so:3")
        except ss.SymsplineError as error:
            assert "pass fewer knots" in str(error).lower()
        else:
            assert np.isfinite(curve(t)).all()


@pytest.mark.parametrize(("penalty", "degrees"), [("jerk", 500), ("acceleration", 60)])
def test_the_energy_does_not_determine_the_attitude(penalty, degrees):
    """With precise rates, the covariance is that of an initial attitude and a bias, and few iterations are needed."""
    truth, t, _, s, omega, bias = spinning(11, degrees, end=20.0, noise=0.003)
    sigma = 0.2
    seen = truth(t) @ TURN(sigma * np.random.default_rng(11).standard_normal((len(t), 3)))
    curve = ss.estimate(given(t, seen, s, omega, sigma=sigma, noise=0.003), 801, "so:3", penalty=penalty)
    assert curve.report.iterations <= 9

    def attitudes(x):
        found = ss.CubicSpline(s, ss.rotations.integrate(s, omega - x[3:]), SO3, bc_type="not-a-knot")
        return TURN(x[:3]) @ found(np.minimum(t, s[-1]))

    at, step = np.concatenate([np.zeros(3), bias]), 1e-4
    columns = []
    for change in step * np.eye(6):
        sides = [attitudes(at + sign * change) for sign in (1, -1)]
        columns.append(ss.rotations.as_rotation_vectors(np.swapaxes(sides[1], -1, -2) @ sides[0]).ravel() / (2 * step))
    jacobian = np.stack(columns, axis=-1)
    covariance = sigma**2 * np.linalg.inv(jacobian.T @ jacobian)
    # The variance along the axis of the spin; the energy contains information about the others.
    expected = np.sqrt(np.linalg.eigvalsh(covariance[3:, 3:])[0])
    found = np.sqrt(np.linalg.eigvalsh(curve.parameters["gyro bias"].cov)[0])
    assert found == pytest.approx(expected, rel=0.02)

"""Smoothing splines with given end velocities, and closed ones."""

import numpy as np
import pytest
from noisy import TIGHT, acceleration_energy, beside, distance_to_minimum, example

import symspline as ss


def flatness(space, t, noisy, spline, lam, conditions, closed):
    """How far the curve is from the minimum of the objective."""

    def objective(points):
        if closed:
            points[-1] = points[0]
        curve = ss.CubicSpline(spline.t, points, space, bc_type=conditions(points))
        return np.sum(space.distance(curve(t), noisy) ** 2) + acceleration_energy(space, curve, lam)

    return distance_to_minimum(space, spline.points, objective, seed=0)


@pytest.mark.parametrize(("name", "far"), [("r:2", 1e-9), ("sphere:2", 3e-5), ("so:3", 3e-5)])
def test_given_velocities(name, far):
    """The curve has them, and is the least with them."""
    space, t, noisy, _ = example(name, 0.05, n=25, segments=3)
    rng = np.random.default_rng(1)
    start, end = (0.2 * space.random_tangent(rng, noisy[e]) for e in (0, -1))
    spline = ss.make_smoothing_spline(t, noisy, space, 0.3, bc_type=((1, start), (1, end)), **TIGHT)

    def conditions(points):
        each = zip((0, -1), (start, end), strict=True)
        return tuple((1, space.transport(noisy[e], points[e], v)) for e, v in each)

    for e, (_, v) in zip((0, -1), conditions(spline.points), strict=True):
        assert np.abs(spline.velocities[e] - v).max() < 1e-12
    # The linearised solver solves an estimating equation beside the minimum, whose velocities stay while ends move.
    assert flatness(space, t, noisy, spline, 0.3, conditions, False) < far
    still = ss.make_smoothing_spline(t, noisy, space, bc_type="clamped")
    assert np.abs(still.velocities[[0, -1]]).max() == 0
    # What is fixed is less uncertain.
    free = ss.make_smoothing_spline(t, noisy, space, still.lam)
    assert still.std(0.0) < free.std(0.0) and still.std(0.0, nu=1) < 1e-3 * free.std(0.0, nu=1)
    assert still.std(5.0) == pytest.approx(free.std(5.0), rel=0.1)


def ring(name, n, sigma=0.05):
    """A noisy closed curve without a last point."""
    space = ss.space(name)
    rng = np.random.default_rng(3)
    p = space.random_point(rng)
    v, w = space.random_tangent(rng, p), space.random_tangent(rng, p)
    angle = 2 * np.pi * np.arange(n) / n
    shape = (n,) + (1,) * p.ndim
    # Not so small that its holonomy would not matter.
    truth = space.exp(p, 0.6 * (np.cos(angle).reshape(shape) * v + np.sin(angle).reshape(shape) * w))
    return space, np.arange(n) * 10 / n, beside(space, truth, sigma), truth


@pytest.mark.parametrize(
    ("name", "far"), [("r:2", 1e-9), ("sphere:1", 1e-9), ("sphere:2", 3e-5), ("so:3", 3e-5), ("spd:2", 3e-5)]
)
def test_closed_curves(name, far):
    space, t, noisy, truth = ring(name, 40)
    knots = np.append(t, 10.0)
    spline = ss.make_smoothing_spline(t, noisy, space, 0.3, knots=knots, bc_type="periodic", **TIGHT)
    assert np.array_equal(spline.points[0], spline.points[-1])
    for nu in range(3):
        assert np.abs(spline(10.0 - 1e-9, nu) - spline(1e-9, nu)).max() < 1e-6
    assert np.array_equal(spline(11.0), spline(1.0))
    assert flatness(space, t, noisy, spline, 0.3, lambda _: "periodic", True) < far
    # Wherever the turn begins.
    other = ss.make_smoothing_spline(
        t, np.roll(noisy, -7, axis=0), space, 0.3, knots=knots, bc_type="periodic", **TIGHT
    )
    assert space.distance(np.roll(spline.points[:-1], -7, axis=0), other.points[:-1]).max() < 1e-6
    assert other.std(0.1) == pytest.approx(spline.std(t[7] + 0.1), rel=1e-6)
    assert other.df == pytest.approx(spline.df, rel=1e-6)
    chosen = ss.make_smoothing_spline(t, noisy, space, knots=knots, bc_type="periodic", criterion="reml")
    assert chosen.report.converged and 0.025 < chosen.sigma < 0.075
    errors = space.distance(chosen(t), truth)
    assert np.sqrt(np.mean(errors**2)) < 0.6 * np.sqrt(np.mean(space.distance(noisy, truth) ** 2))
    assert 0.8 < np.mean(errors < chosen.band(t)) <= 1
    assert chosen.std(12.5) == pytest.approx(chosen.std(2.5))


def test_the_first_point_repeated_at_the_end_counts_once():
    # Cross-validation would take the two for data without noise, and the curve through all data for the best.
    t = np.linspace(0, 1, 101)
    truth = np.stack([0.8 * np.cos(2 * np.pi * t), 0.8 * np.sin(2 * np.pi * t), 0.6 + 0 * t], -1)
    space = ss.Sphere(2)
    noisy = beside(space, truth, 0.05)
    noisy[-1] = noisy[0]
    options = {"bc_type": "periodic"}
    closed = ss.make_smoothing_spline(t, noisy, space, **options)
    once = ss.make_smoothing_spline(t, noisy, space, weights=np.where(t < 1, 1.0, 0.0), knots=t, **options)
    assert not closed.report.at_bound and closed.sigma == pytest.approx(0.05, rel=0.2)
    assert closed.lam == pytest.approx(once.lam, rel=1e-12)
    np.testing.assert_allclose(closed.points, once.points, rtol=0, atol=1e-13)
    # It may differ by rounding.
    noisy[-1] = space.project(noisy[0] + 1e-11 * np.array([1.0, 2.0, 3.0]))
    assert ss.make_smoothing_spline(t, noisy, space, **options).df == pytest.approx(closed.df, rel=1e-9)
    # What differs by more is another datum, and so is the same point at another time.
    noisy[-1] = beside(space, truth[:1], 0.05, 7)[0]
    apart = ss.make_smoothing_spline(t, noisy, space, **options)
    assert apart.report.converged and np.abs(apart.points - closed.points).max() > 1e-4

"""Given velocities whose control handles pass the cut locus: whole turns on a torus, and an error on other spaces."""

import pickle

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import symspline as ss

FORTY_SECONDS = [0.0, 40.0]


def wrapped(angles):
    return np.angle(np.exp(1j * angles))


def test_velocities_determine_the_turns_of_angles():
    fast = np.full((2, 1), -np.pi / 10)
    curve = ss.HermiteSpline(FORTY_SECONDS, [[0.0], [-4 * np.pi]], fast, "torus:1")
    x = np.linspace(0, 40, 81)
    np.testing.assert_allclose(wrapped(curve(x)[:, 0] + np.pi / 10 * x), 0, atol=1e-13)
    np.testing.assert_allclose(curve(x, nu=1), -np.pi / 10, rtol=1e-13)
    assert curve.length() == pytest.approx(4 * np.pi, rel=1e-12)
    # Whole numbers of turns at which inner control points are opposite.
    for turns in (1.5, 3, 4.5, 100):
        rate = np.full((2, 1), 2 * np.pi * turns)
        assert ss.HermiteSpline(None, [[0.0], [0.0 if turns % 1 == 0 else np.pi]], rate, "torus:1").length() == (
            pytest.approx(2 * np.pi * turns, rel=1e-12)
        )


def test_fast_and_slow_angles_with_different_turns():
    """A batch of curves, of which each segment is fast in another angle, in a product with a line."""
    rng = np.random.default_rng(0)
    times = np.array([0, 1, 2.5, 3, 5, 6])
    rates = rng.uniform(-2, 2, (4, 6, 2)) * [15, 5]
    h = np.diff(times)[:, None]
    fast = np.maximum(np.abs(rates[:, 1:]), np.abs(rates[:, :-1])) * h > 3 * np.pi
    assert 8 < fast.sum() < 32
    steps = h * (rates[:, 1:] + rates[:, :-1]) / np.where(fast, 2, 3) + rng.uniform(-1, 1, (4, 5, 2))
    angles = np.concatenate([np.zeros((4, 1, 2)), np.cumsum(steps, axis=1)], axis=1)
    curve = ss.HermiteSpline(times, (wrapped(angles), angles), (rates, rates), "torus:2 x r:2")
    x = np.linspace(0, 6, 300)
    for nu in (0, 1, 2):
        found, line = curve(x, nu=nu)
        difference = wrapped(found - line) if nu == 0 else found - line
        assert np.abs(difference).max() < 1e-11 * max(1, np.abs(line).max()), nu
    for i in range(4):
        exact = CubicHermiteSpline(times, angles[i], rates[i])(x)
        assert np.abs(wrapped(curve(x)[0][i] - exact)).max() < 1e-11
    again = ss.HermiteSpline(times, wrapped(angles), rates, "torus:2")
    np.testing.assert_array_equal(again(x), curve(x)[0])
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(again))(x), again(x))
    np.testing.assert_array_equal(ss.evaluate(times, wrapped(angles), rates, "torus:2", x), again(x))


def test_speeds_of_many_thousand_turns_raise():
    with pytest.raises(ss.ValidationError, match=r"between t\[1\] and t\[2\].*Add knots.* use `Euclidean`"):
        ss.HermiteSpline(None, np.zeros((3, 1)), [[0], [0], [1e5]], "torus:1")


def test_a_fast_rotation_raises():
    turns = ss.rotations.from_rotation_vectors([[0, 0, 0], [0, 4 * np.pi, 0.0]])
    rates = np.array([[0, -np.pi / 10, 0]] * 2)
    with pytest.raises(ss.ValidationError, match=r"too fast for a segment of length 40, between t\[0\] and t\[1\]"):
        ss.HermiteSpline(FORTY_SECONDS, turns, ss.rotations.velocities(turns, rates), "so:3")


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "rp:2", "u:1", "gr:1,2"])
def test_the_limit_is_the_cut_locus(name):
    """Just below it the curve has the given velocities; the second curve of a batch is beyond it."""
    rng = np.random.default_rng(1)
    space = ss.space(name)
    p = space.random_point(rng)
    v = space.random_tangent(rng, p)
    v = v / space.norm(p, v) * space.injectivity_radius
    times = np.array([3.0, 5.0])
    slow, fast = (np.stack([1.5 * part * v, 0 * v]) for part in (0.98, 1.02))
    points = np.stack([p, p])
    curve = ss.HermiteSpline(times, points, slow, space)
    np.testing.assert_allclose(curve(3.0, nu=1), slow[0], atol=1e-8 * np.abs(slow).max())
    with pytest.raises(ss.ValidationError, match=r"`velocities\[0\]` of curve 1"):
        ss.HermiteSpline(times, np.stack([points, points]), np.stack([slow, fast]), space)


def test_long_curves_name_the_solvers_that_did_not_run():
    """Curves in sections are not searched for solutions of lower energy."""
    rng = np.random.default_rng(2)

    def walk(count, step):
        points = [np.array([1.0, 0, 0])]
        for _ in range(count - 1):
            v = np.cross(rng.normal(size=3), points[-1])
            points.append(np.cos(step) * points[-1] + np.sin(step) * v / np.linalg.norm(v))
        return np.array(points) / np.linalg.norm(points, axis=-1, keepdims=True)

    near, far = walk(514, 0.3), walk(514, 1.8)
    report = ss.CubicSpline(None, np.stack([near, far]), "sphere:2").report
    assert report.converged.all()
    every = {"fixed-point", "newton", "homotopy", "trust-region"}
    assert set(report.skipped) == every - {report.method}
    assert ss.CubicSpline(None, near, "sphere:2").report.skipped == ()
    assert ss.CubicSpline(None, far, "sphere:2", method="quasi-newton").report.skipped == ()

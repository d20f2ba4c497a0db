"""Given velocities whose control handles pass the cut locus are refused, because the curve would not have them."""

import numpy as np
import pytest

import symspline as ss

FORTY_SECONDS = [0.0, 40.0]


def test_a_turn_of_two_revolutions_between_two_angles_raises():
    fast = np.full((2, 1), -np.pi / 10)
    with pytest.raises(ss.ValidationError, match=r"`velocities\[0\]` has speed 0.314159.*whole turns. Use `Euclidean`"):
        ss.HermiteSpline(FORTY_SECONDS, [[0.0], [-4 * np.pi]], fast, "torus:1")
    # On the line the same data are a straight line.
    line = ss.HermiteSpline(FORTY_SECONDS, [[0.0], [-4 * np.pi]], fast, "r:1")
    assert line(20.0) == pytest.approx(-2 * np.pi, abs=1e-12)


def test_a_fast_rotation_raises():
    turns = ss.rotations.from_rotation_vectors([[0, 0, 0], [0, 4 * np.pi, 0.0]])
    rates = np.array([[0, -np.pi / 10, 0]] * 2)
    with pytest.raises(ss.ValidationError, match="too fast for a segment of length 40"):
        ss.HermiteSpline(FORTY_SECONDS, turns, ss.rotations.velocities(turns, rates), "so:3")


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "torus:2", "rp:2", "u:1", "gr:1,2"])
def test_the_limit_is_the_cut_locus(name):
    """Just below it the curve has the given velocities; the second curve of a batch is beyond it."""
    rng = np.random.default_rng(1)
    space = ss.space(name)
    p = space.random_point(rng)
    v = space.random_tangent(rng, p)
    if name == "torus:2":
        v = np.array([1.0, 0])
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

"""Angles as points: wrapped operations, comparison with flat splines of unwrapped angles, and conversions."""

import numpy as np
import pytest
from refused import raises
from scipy.interpolate import CubicSpline

import symspline as ss

TORUS = ss.Torus(3)


def joints(rng, count=40, step=0.9):
    """Irregular times and angles that turn several times, without wrapping."""
    t = np.cumsum(rng.uniform(0.2, 2.0, count))
    return t, 50 + np.cumsum(rng.uniform(-step, step, (count, 3)), axis=0)


def is_wrapped(angles):
    return ((angles > -np.pi) & (angles <= np.pi)).all()


@pytest.mark.parametrize("bc_type", ["natural", "clamped", "not-a-knot", ((1, [0.3, 0, -2]), (2, [0, 0.1, 0]))])
def test_splines_are_those_of_unwrapped_angles(bc_type):
    t, angles = joints(np.random.default_rng(0))
    spline = ss.CubicSpline(t, angles, TORUS, bc_type=bc_type)
    flat = CubicSpline(t, angles, bc_type=bc_type)
    x = np.linspace(t[0], t[-1], 1001)
    assert is_wrapped(spline(x)) and is_wrapped(spline.points)
    assert np.abs(TORUS.log(spline(x), flat(x))).max() < 1e-12
    np.testing.assert_allclose(np.unwrap(spline(x), axis=0) - spline(x)[0], flat(x) - flat(x)[0], atol=1e-12)
    for nu in (1, 2, 3):
        np.testing.assert_allclose(spline(x[:-1], nu), flat(x[:-1], nu), atol=1e-10 * np.abs(flat(x, nu)).max())
    assert spline.length() == pytest.approx(ss.CubicSpline(t, angles, "r:3", bc_type=bc_type).length())


def test_closed_curves_may_turn():
    t = np.arange(9.0)
    angles = np.stack([2 * np.pi * t / 8, 0.3 * np.sin(2 * np.pi * t / 8)], axis=-1)
    closed = ss.CubicSpline(t, angles, "torus:2", bc_type="periodic")
    np.testing.assert_allclose(closed(np.linspace(0, 8, 50), nu=1)[:, 0], np.pi / 4, atol=1e-13)


def test_operations_wrap():
    rng = np.random.default_rng(2)
    p, q = rng.uniform(-20, 20, (2, 1000, 3))
    v = TORUS.log(p, q)
    assert is_wrapped(v) and is_wrapped(TORUS.project(p)) and is_wrapped(TORUS.transvection(p, 40 * v, q))
    np.testing.assert_allclose(np.exp(1j * TORUS.exp(p, v)), np.exp(1j * q), atol=1e-13)
    np.testing.assert_allclose(TORUS.distance(p, q), np.linalg.norm(np.angle(np.exp(1j * (q - p))), axis=-1))
    edges = [np.pi, -np.pi, np.nextafter(np.pi, 4), np.nextafter(-np.pi, 0), 3 * np.pi]
    np.testing.assert_allclose(ss.Torus(1).project(np.array(edges)[:, None])[:2, 0], [np.pi, np.pi])
    # Steps down to rounding do not lose digits.
    for size in 10.0 ** np.arange(-12, 0):
        np.testing.assert_allclose(TORUS.log(np.zeros(3), [size, -size, 0]), [size, -size, 0], rtol=1e-15)


def test_opposite_angles_raise_and_long_steps_warn():
    with pytest.raises(ss.CutLocusError, match="points\\[1\\] and points\\[2\\]"):
        ss.CubicSpline(None, [[0.0], [1], [1 + np.pi], [2]], "torus:1")
    with pytest.raises(ss.CutLocusError):
        TORUS.log(np.zeros(3), [0.1, -np.pi, 0])
    # A step of 200° is one of −160°, which is long.
    with pytest.warns(ss.FarPointsWarning, match=r"Torus\(1\)"):
        spline = ss.CubicSpline(None, np.radians([[0.0], [200], [400], [600], [800]]), "torus:1")
    np.testing.assert_allclose(spline(0.5), np.radians([-80]))


def test_angles_with_too_many_turns_raise():
    angles = np.array([[0.0, 1], [1e7, 2], [2e7, 3]])
    np.testing.assert_allclose(ss.CubicSpline(None, angles, "torus:2").points[1, 0], np.angle(np.exp(1e7j)), atol=1e-8)
    for size in (1e8, 1e300):
        angles[1, 0] = size
        raises("points.1. is off the space .* rounding error of its angle", ss.CubicSpline, None, angles, "torus:2")
    circle = ss.Torus(1)
    for call in (circle.distance, circle.log, circle.exp):
        raises("not finite", call, [0.1], [1e300])
    raises("cannot be projected", circle.project, [-1e300])


def test_random_angles_are_uniform():
    angles = ss.Torus(2).random_point(np.random.default_rng(3), 20_000)
    for k in (1, 2, 3):
        assert np.abs(np.exp(1j * k * angles).mean(axis=0)).max() < 0.02
    assert is_wrapped(angles)


def test_angles_of_the_circle():
    angles = np.array([[0.0, np.pi, -3.0], [7.0, -np.pi, 1e-9]])
    circle = ss.Sphere(1)
    points = circle.from_angles(angles)
    np.testing.assert_allclose(circle.as_angles(points), [[0, np.pi, -3], [7 - 2 * np.pi, -np.pi, 1e-9]], atol=1e-15)
    assert circle.as_angles([-1.0, -0.0]) == np.pi
    raises(r"Use Sphere\(1\).from_angles", ss.Sphere(2).from_angles, 0.0)
    raises(r"angles\[1\] is nan", circle.from_angles, [0.0, np.nan])
    raises("real numbers", circle.from_angles, [1j])
    raises("off the space", circle.as_angles, [2.0, 0.0])


def test_the_group_is_that_of_signed_permutations_and_shifts():
    g = np.array([[0.0, -1, 3], [1, 0, 0.5], [0, 0, 1]])
    np.testing.assert_allclose(ss.Torus(2).act(g, [1.0, 2.0]), [1.0, 1.5])
    turned = [[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]]
    raises("signed permutation", ss.Torus(2).act, turned, [1.0, 2.0])

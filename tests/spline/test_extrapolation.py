"""Extrapolation before the first knot and after the last one."""

import numpy as np
import pytest
from cases import EPS, QUADRICS, loop_over
from compare import each, largest_difference, off, parts, pick, same, vectors_off
from curves import KNOTS, at_node, bezier, every_common, every_kind, points_on
from refused import raises

import symspline as ss

OUTSIDE = [-0.5, 4.75]


@every_kind
def test_true_continues_the_last_segment(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, step=0.5), space, extrapolate=True)
    for segment, x, tau in ((0, OUTSIDE[0], -0.5), (-1, OUTSIDE[1], 1.5)):
        control = pick(spline.control_points, segment)
        assert off(space, spline(x), bezier(space, control, tau)) < 1e-13


@every_kind
@loop_over(("ends", "start"), [("natural", 0.0), ("periodic", 1.25)])
def test_periodic_wraps(space, ends, start):
    p = points_on(space, 3, step=0.5)
    p = each(lambda q: q[[0, 1, 2, 1, 0]], p)
    # A period that doubles hold exactly, so that wrapping rounds nothing. Closed curves wrap by themselves.
    for extrapolate in ("periodic",) if ends == "natural" else (None, "periodic"):
        spline = ss.CubicSpline(start + np.arange(5) * 0.5, p, space, bc_type=ends, extrapolate=extrapolate)
        x = start + np.array([0.25, 1.25, 1.75])
        for rounds in (-4, -1, 1, 10):
            for nu in range(3):
                assert same(spline(x + 2.0 * rounds, nu), spline(x, nu))


@every_common
def test_the_policy_of_a_call_wins(space):
    p = points_on(space, 6)
    plain = ss.CubicSpline(KNOTS, p, space)
    for policy in (False, True, "geodesic", "periodic"):
        spline = ss.CubicSpline(KNOTS, p, space, extrapolate=policy)
        assert spline.extrapolate == policy
        assert same(spline(OUTSIDE), plain(OUTSIDE, extrapolate=policy))
        assert same(spline.speed(OUTSIDE), plain.speed(OUTSIDE, extrapolate=policy))
        assert same(spline(OUTSIDE, extrapolate="geodesic"), plain(OUTSIDE, extrapolate="geodesic"))
        raises("outside the knots", spline, OUTSIDE, extrapolate="raise")


@every_kind
def test_geodesic_keeps_the_velocity(space):
    p = points_on(space, step=0.5)
    spline = ss.CubicSpline(KNOTS, p, space, bc_type="not-a-knot", extrapolate="geodesic")
    for x, e in zip(OUTSIDE, (0, -1), strict=True):
        p, u = at_node(space, spline.points, e), at_node(space, spline.velocities, e)
        h = x - KNOTS[e]
        reached = space.exp(p, each(lambda v, h=h: h * v, u))
        carried = space.transport(p, reached, u)
        assert off(space, spline(x), reached) < 20 * EPS
        if not isinstance(space, QUADRICS):
            # There the size of a vector is that of its numbers.
            assert spline.speed(x) == pytest.approx(space.norm(p, u), rel=1e-13)
        assert vectors_off(space, spline(x), spline(x, nu=1), reached, carried) < 1e-13
        assert largest_difference(spline(x, nu=2), each(np.zeros_like, u)) < 1e-12


T = np.array([0.0, 1.0, 3.0, 3.5, 5.0])
X = np.array([-1.0, 0.0, 0.5, 5.0, 5.1, np.nextafter(5.0, 6.0)])
BEYOND = np.array([True, False, False, False, True, False])
SPACES = ["r:2", "sphere:2", "rp:2", "so:3", "se:3", "cp:1", "sphere:2 x r:3", "sphere:60"]


def spline(name, **options):
    space = ss.space(name)
    return ss.CubicSpline(T, points_on(space, len(T), step=0.4), space, **options)


@pytest.mark.parametrize("name", SPACES)
def test_false_gives_nan_outside_and_the_curve_inside(name):
    curve, inside = spline(name, extrapolate=False), spline(name)
    for evaluated in (
        *(lambda c, x, nu=nu: c(x, nu) for nu in range(3)),
        lambda c, x: c.lift(x),
        lambda c, x: c.speed(x),
    ):
        for values, expected in zip(parts(evaluated(curve, X)), parts(evaluated(inside, X[~BEYOND])), strict=True):
            assert np.isnan(values[BEYOND]).all()
            np.testing.assert_array_equal(values[~BEYOND], expected)
        assert all(np.isnan(value).all() for value in parts(evaluated(curve, -1.0)))
    assert np.isfinite(curve.length()) and np.isfinite(curve.bending_energy())


@pytest.mark.parametrize("policy", ["raise", None, False])
def test_only_none_lets_closed_curves_wrap(policy):
    points = points_on(ss.space("sphere:2"), 4, step=0.4)
    points = np.concatenate([points, points[:1]])
    curve = ss.CubicSpline(T, points, "sphere:2", bc_type="periodic", extrapolate=policy)
    if policy == "raise":
        raises("outside the knots", curve, 6.0)
    elif policy is None:
        np.testing.assert_allclose(curve(6.0), curve(1.0), atol=1e-15)
    else:
        assert np.isnan(curve(6.0)).all()


def test_other_entries_take_false():
    curve, out = spline("sphere:2"), np.zeros((2, 3))
    assert curve([1.0, 6.0], extrapolate=False, out=out) is out
    assert np.isfinite(out[0]).all() and np.isnan(out[1]).all()
    values = ss.evaluate(T, curve.points, curve.velocities, curve.space, [1.0, 9.0], extrapolate=False)
    assert np.isnan(values[1]).all() and np.isfinite(values[0]).all()
    hermite = ss.HermiteSpline(T, curve.points, curve.velocities, "sphere:2", extrapolate=False)
    assert np.isnan(hermite(9.0)).all()
    dates = np.datetime64("2026-01-01") + np.arange(len(T))
    dated = ss.CubicSpline(dates, curve.points, "sphere:2", extrapolate=False)
    assert np.isnan(dated(np.datetime64("2025-01-01"))).all()


@loop_over("wrong", [0, 1, "nan", "linear", 2.0, [True]])
def test_unknown_policies_raise(wrong):
    for call in (lambda: spline("r:2", extrapolate=wrong), lambda: spline("r:2")(0.5, extrapolate=wrong)):
        raises("extrapolate must be", call)

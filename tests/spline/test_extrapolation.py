"""What a curve is before its first knot and after its last one."""

import numpy as np
import pytest
from cases import EPS, QUADRICS, loop_over
from curves import (
    KNOTS,
    S2,
    at_node,
    bezier,
    each,
    every_common,
    every_kind,
    largest_difference,
    off,
    pick,
    points_on,
    same,
    vectors_off,
)

import symspline as ss

OUTSIDE = [-0.5, 4.75]


@every_kind
def test_none_raises_outside(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, step=0.5), space)
    for x in OUTSIDE:
        with pytest.raises(ss.ValidationError, match="outside the knots"):
            spline(x)
        with pytest.raises(ss.ValidationError, match="outside the knots"):
            spline.speed(x)


@every_kind
def test_true_continues_the_last_segment(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, step=0.5), space, extrapolate=True)
    for segment, x, tau in ((0, OUTSIDE[0], -0.5), (-1, OUTSIDE[1], 1.5)):
        control = pick(spline.control_points, segment)
        assert off(space, spline(x), bezier(space, control, tau)) < 1e-13


@every_kind
@loop_over("ends", ["natural", "periodic"])
def test_periodic_wraps(space, ends):
    p = points_on(space, 3, step=0.5)
    p = each(lambda q: q[[0, 1, 2, 1, 0]], p)
    # A period that doubles hold exactly, so that wrapping rounds nothing. Closed curves wrap by themselves.
    for extrapolate in ("periodic",) if ends == "natural" else (None, "periodic"):
        spline = ss.CubicSpline(np.arange(5) * 0.5, p, space, bc_type=ends, extrapolate=extrapolate)
        x = np.array([0.25, 1.25, 1.75])
        for rounds in (-4, -1, 1, 10):
            for nu in range(3):
                assert same(spline(x + 2.0 * rounds, nu), spline(x, nu))


@every_common
def test_the_policy_of_a_call_wins(space):
    p = points_on(space, 6)
    plain = ss.CubicSpline(KNOTS, p, space)
    for policy in (True, "geodesic", "periodic"):
        spline = ss.CubicSpline(KNOTS, p, space, extrapolate=policy)
        assert spline.extrapolate == policy
        assert same(spline(OUTSIDE), plain(OUTSIDE, extrapolate=policy))
        assert same(spline.speed(OUTSIDE), plain.speed(OUTSIDE, extrapolate=policy))
        assert same(spline(OUTSIDE, extrapolate="geodesic"), plain(OUTSIDE, extrapolate="geodesic"))


@every_common
@loop_over("policy", [None, True, "geodesic", "periodic"])
def test_policies_differ_only_outside(space, policy):
    spline, x = ss.CubicSpline(KNOTS, points_on(space, 6), space), np.linspace(0, 4.5, 31)
    for nu in range(3):
        assert same(spline(x, nu=nu, extrapolate=policy), spline(x, nu=nu))


def test_dates_extrapolate_too():
    t = np.datetime64("2024-01-01") + np.arange(4)
    spline = ss.CubicSpline(t, points_on(S2, 4), S2, extrapolate="periodic")
    assert largest_difference(spline(t[1] + 3), spline(t[1])) < 4 * EPS


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


@pytest.mark.parametrize("start", [-2.75, 0.0, 1.25])
def test_time_wraps_around_from_any_first_knot(start):
    p = points_on(S2, 5, step=0.5)
    t = start + np.array([0.0, 1.0, 1.5, 3.0, 4.0])
    spline = ss.CubicSpline(t, [*p[:4], p[0]], "sphere:2", bc_type="periodic", extrapolate="periodic")
    x = start + np.array([0.25, 1.75, 3.5])
    for turns in (-2, -1, 1, 3):
        assert np.array_equal(spline(x + 4.0 * turns), spline(x))

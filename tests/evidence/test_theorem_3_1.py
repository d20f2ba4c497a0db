"""Theorem 3.1 along whole runs of Algorithm 1: the region that it does not leave, and its guaranteed sweeps."""

import pytest
from cases import CURVED, loop_over, unit_tangent, walk

import symspline as ss

SEED = 2


def steps(space, kd, rng, turn=3.0):
    """A walk with K D = `kd`."""
    return walk(space, kd / space.curvature, 10, rng, turn=turn)


def longest_leg(space, points, velocities):
    return space.norm(points, velocities).max() / 3


@pytest.mark.parametrize("name", CURVED)
@loop_over("kd", [0.01, 0.2, 0.26])
@loop_over("ends", ["natural", "clamped", "velocity"])
def test_algorithm_1_stays_within(name, kd, ends, rng):
    space = ss.space(name)
    for turn in (0.5, 3.0, 100.0):
        p = steps(space, kd, rng, turn=turn)
        bc = ends
        if ends == "velocity":
            # Three times the velocity of the nearest step: the leg h u/3 is as long as the step.
            bc = ((1, 3 * space.log(p[0], p[1])), (1, 3 * unit_tangent(space, p[-1], rng) * kd / space.curvature))
        options = {"bc_type": bc, "method": "fixed-point", "on_failure": "ignore"}
        radius = ss.CubicSpline(None, p, space, bc_type=bc).report.invariant_radius
        for sweeps in range(1, 11):
            spline = ss.CubicSpline(None, p, space, max_iter=sweeps, **options)
            assert spline.report.iterations == sweeps
            assert longest_leg(space, p, spline.velocities) <= radius * (1 + 1e-12)
        done = ss.CubicSpline(None, p, space, **options)
        assert done.report.converged and done.report.rate < 0.6
        assert done.report.invariant_radius == radius
        assert longest_leg(space, p, done.velocities) <= radius


@pytest.mark.parametrize("name", CURVED)
@loop_over("kd", [0.01, 0.2, 0.255])
def test_guaranteed_sweeps_are_enough(name, kd, rng):
    space = ss.space(name)
    p = steps(space, kd, rng)
    exact = ss.CubicSpline(None, p, space).velocities
    for tol in (1e-3, 1e-7):
        report = ss.CubicSpline(None, p, space, tol=tol).report
        options = {"method": "fixed-point", "tol": 0.0, "on_failure": "ignore"}
        spline = ss.CubicSpline(None, p, space, max_iter=report.guaranteed_sweeps + 1, **options)
        assert longest_leg(space, p, spline.velocities - exact) <= tol * report.invariant_radius

"""Laws that every spline obeys."""

import numpy as np
import pytest
from cases import (
    CASES,
    ENDS,
    EPS,
    QUOTIENTS,
    apart,
    base_point,
    by_differences,
    closed_walk,
    condition,
    every_family,
    loop_over,
    some_families,
    unit_tangent,
    walk,
)
from laws import ends_along, knots, sharpness
from scipy.interpolate import CubicSpline as FlatSpline

import symspline as ss

SEED = 20180308
every_smooth = pytest.mark.parametrize("case", [c for c in CASES if c.smooth and not c.few], ids=lambda case: case.name)


@some_families("hyperbolic:2", "ads:4", "cp:2", "gr:2,5", "so:3", "u:2", "spd:3", "se:3")
@loop_over("ends", ["natural", "not-a-knot", "periodic", "velocity"])
def test_solvers_agree(case, ends, rng):
    space = case.space
    # Far apart, several splines fit: the solvers may find different ones.
    for step in (1e-3, 0.3, 1.0 / sharpness(space)):
        p = (closed_walk if ends == "periodic" else walk)(space, step, 14, rng)
        t = knots("random", len(p), rng)
        bc = ends_along(ends, space, p)
        one, *others = (
            ss.CubicSpline(t, p, space, bc_type=bc, method=m, tol=1e-13).velocities
            for m in ("fixed-point", "quasi-newton", "newton")
        )
        # A residual of 1e-13 leaves velocities some 1e-12 apart where the contraction is slow.
        for other in others:
            assert np.abs(one - other).max() <= 2e-12 * np.abs(one).max() * condition(space, p)


@every_family
def test_reversing_time_reverses_the_curve(case, rng):
    space = case.space
    p = walk(space, 0.7, 9, rng)
    t = knots("random", len(p), rng)
    x = np.linspace(t[0], t[-1], 50)
    for ends in ("natural", "not-a-knot", "clamped"):
        forth = ss.CubicSpline(t, p, space, bc_type=ends)
        back = ss.CubicSpline(-t[::-1], p[::-1], space, bc_type=ends)
        allowed = 200 * EPS * condition(space, p)
        assert apart(space, forth(x), back(-x)) <= allowed
        for nu, sign, factor in ((1, -1, 10), (2, 1, 100)):
            there = back(-x, nu)
            if isinstance(space, QUOTIENTS):
                there = space.transport(back(-x), forth(x), there)
            assert np.abs(forth(x, nu) - sign * there).max() <= factor * allowed


@every_family
def test_derivatives_of_splines_agree_with_differences(case, rng):
    space = case.space
    p = walk(space, 0.8, 7, rng)
    t = knots("random", len(p), rng)
    spline = ss.CubicSpline(t, p, space)
    # Inside segments: differences across a knot see its jump in the third derivative.
    x = (t[:-1, None] + np.diff(t)[:, None] * [0.1, 0.37, 0.5, 0.8]).ravel()
    velocity, acceleration = spline(x, 1), spline(x, 2)
    scale = np.abs(acceleration).max() + np.abs(velocity).max()
    found = by_differences(space, spline, x, 0.02)
    for here, exact, allowed in zip(found, (velocity, acceleration), (1e-6, 1e-5), strict=True):
        assert np.abs(here - exact).max() <= allowed * scale


def smooth_curve(space, t, closed):
    """A smooth curve through the space, by exp of a smooth curve of tangent vectors."""
    rng = np.random.default_rng(7)
    o = base_point(space, rng)
    axes = [unit_tangent(space, o, rng) for _ in range(3)]
    w = 2 * np.pi * t
    if closed:
        waves = 0.6 * np.cos(w) + 0.2 * np.sin(2 * w), 0.5 * np.sin(w), 0.2 * np.cos(2 * w)
    else:
        waves = 0.9 * t + 0.3 * np.sin(3 * t), 0.5 * np.cos(2 * t), 0.4 * np.sin(4 * t)
    v = sum(np.multiply.outer(wave, axis) for wave, axis in zip(waves, axes, strict=True))
    return space.exp(o, v)


@every_smooth
@loop_over(("ends", "order"), [("velocity", 4), ("not-a-knot", 4), ("periodic", 4), ("natural", 2)])
def test_a_smooth_curve_is_recovered(case, ends, order):
    space = case.space
    x = np.linspace(0, 1, 2001)
    errors = []
    for n in (48, 96):
        t = np.linspace(0, 1, n + 1)
        p = smooth_curve(space, t, ends == "periodic")
        bc = ends
        if ends == "periodic":
            p[-1] = p[0]
        elif ends == "velocity":
            e = 1e-3 * np.array([-2, -1, 1, 2])
            difference = np.array([1, -8, 8, -1]) / 12e-3
            around = [smooth_curve(space, end + e, False) for end in (0.0, 1.0)]
            # Fourth-order differences: 1e-12, far below the curve's own error.
            bc = [
                (1, space.project_tangent(p[i], np.tensordot(difference, a, 1)))
                for i, a in zip((0, -1), around, strict=True)
            ]
        spline = ss.CubicSpline(t, p, space, bc_type=bc)
        errors.append(space.distance(spline(x), smooth_curve(space, x, ends == "periodic")).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


@some_families("sphere:2", "cp:2", "so:3", "gr:2,5")
def test_batches_of_splines_are_bit_identical_to_single_curves(case, rng):
    space = case.space
    # Of long steps every way to a curve is tried, which takes its time where there are many dimensions.
    longest = 1.5 if space.dim <= 4 else 0.8
    p = np.stack([walk(space, step, 11, rng) for step in np.linspace(1e-3, longest, 11)])
    t = knots("random", 11, rng)
    # In any order, in one segment (from curve to curve too), dense over all, and beyond the knots.
    times = rng.uniform(t[0], t[-1], 37), np.linspace(t[2], t[3], 40)[1:-1], np.linspace(t[0], t[-1], 331)
    beyond = rng.uniform(t[0] - 0.5, t[-1] + 0.5, 40)
    for ends in ("natural", "not-a-knot"):
        batch = ss.CubicSpline(t, p, space, bc_type=ends)
        values = [(x, nu, batch(x, nu)) for x in times for nu in range(3)]
        further = [(nu, batch(beyond, nu, extrapolate="geodesic")) for nu in range(3)]
        for i, points in enumerate(p):
            one = ss.CubicSpline(t, points, space, bc_type=ends)
            assert batch[i] == one
            for x, nu, value in values:
                assert np.array_equal(value[i], one(x, nu))
            for nu, value in further:
                assert np.array_equal(value[i], one(beyond, nu, extrapolate="geodesic"))


@pytest.mark.parametrize("ends", ENDS)
@loop_over("n", [2, 3, 4, 5, 17])
def test_flat_space_of_splines_is_scipy(ends, n, rng):
    space = ss.Euclidean(3)
    t = np.cumsum(rng.uniform(0.2, 2, n))
    p = rng.standard_normal((n, 3))
    if ends == "periodic":
        p[-1] = p[0]
    bc = ends_along(ends, space, p)
    ours, flat = ss.CubicSpline(t, p, space, bc_type=bc), FlatSpline(t, p, bc_type=bc)
    x = np.linspace(t[0], t[-1], 101)
    h = np.diff(t).min()
    for nu in range(3):
        assert np.abs(ours(x, nu) - flat(x, nu)).max() <= 200 * EPS * np.abs(p).max() / h**nu
    outside = [t[0] - 0.5, t[-1] + 0.7]
    for nu in range(3):
        values = (curve(outside, nu, extrapolate=True) for curve in (ours, flat))
        np.testing.assert_allclose(*values, rtol=1e-11, atol=1e-11)

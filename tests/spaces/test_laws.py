"""Laws that every space and every spline obeys, over all spaces and over decades of magnitude."""

import itertools

import numpy as np
import pytest
from cases import (
    CASES,
    EPS,
    POSITIVE,
    QUOTIENTS,
    apart,
    base_point,
    closed_walk,
    condition,
    jumps,
    steep_tangent,
    unit_tangent,
    walk,
)
from scipy.interpolate import CubicSpline as FlatSpline

import symspline as ss
from symspline._core import Handle

every = pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
every_smooth = pytest.mark.parametrize(
    "case", [c for c in CASES if c.smooth and not c.few], ids=lambda case: case.name
)
ENDS = ["natural", "clamped", "not-a-knot", "periodic", "velocity", "acceleration", "mixed"]
# Lengths over decades, close together around the switches between series (angles of a step whose
# square is 0.1 or 2.5, or whose 1 − cos is 0.0075 or 0.09).
LENGTHS = [
    *(10.0**e for e in range(-12, 0)),
    *(s * (1 + d) for s in (0.1225, 0.316, 0.427, 1.581) for d in (-1e-2, -1e-6, 1e-6, 1e-2)),
    1.0,
    2.0,
    3.0,
]


@pytest.fixture
def rng():
    return np.random.default_rng(20180308)


def test_every_space_is_in_the_suite():
    assert {row[0] for row in Handle.names()} == {case.name.partition(":")[0] for case in CASES}


def lengths(space):
    """Lengths inside the cut locus, up to just before it."""
    radius = space.injectivity_radius
    if not np.isfinite(radius):
        return LENGTHS
    return [x for x in LENGTHS if x < radius] + [radius - 10.0**e for e in range(-13, 0)]


# ---- the space ----


@every
def test_exp_and_log_are_inverse(case, rng):
    space = case.space
    for length, direction in itertools.product(lengths(space), (unit_tangent, steep_tangent)):
        p = base_point(space, rng)
        v = length * direction(space, p, rng)
        q = space.exp(p, v)
        space.check_point(q)
        # Rounding of points, and the condition 1/(limit − angle) of the logarithm.
        allowed = 20 * EPS * condition(space, [p, q])
        near_cut = length / min(1.0, (space.injectivity_radius - length))
        assert apart(space, space.exp(p, space.log(p, q)), q) <= allowed, length
        if length > 1e-7:
            assert np.abs(space.log(p, q) - v).max() <= allowed * max(1.0, near_cut), length
        assert abs(space.distance(p, q) - length) <= allowed * max(1.0, length), length


@every
def test_geodesic_divides_the_distance(case, rng):
    space = case.space
    for length in (1e-8, 1e-3, 0.5, 0.9 * min(3.2, space.injectivity_radius)):
        p = base_point(space, rng)
        q = space.exp(p, length * unit_tangent(space, p, rng))
        t = np.array([-0.3, 0.0, 0.25, 0.5, 1.0])
        x = space.geodesic(p, q, t)
        # Near the antipode the direction of the geodesic is known to ε/(π − 2.9).
        allowed = 50 * EPS * condition(space, x)
        assert apart(space, x[1], p) <= allowed
        assert np.abs(space.distance(p, x) - np.abs(t) * length).max() <= allowed
        assert apart(space, x[4], q) <= allowed


def symmetry(space, p, x):
    return space.exp(p, -space.log(p, x))


@every
def test_transvection_is_the_product_of_two_symmetries(case, rng):
    space = case.space
    for length in [x for x in lengths(space) if x < min(2.5, 0.9 * space.injectivity_radius)]:
        p = base_point(space, rng)
        v = length * unit_tangent(space, p, rng)
        x = space.exp(p, 0.4 * unit_tangent(space, p, rng))
        middle = space.exp(p, v / 2)
        moved = space.transvection(p, v, x)
        twice = symmetry(space, middle, symmetry(space, p, x))
        allowed = 100 * EPS * condition(space, [p, x, moved])
        assert apart(space, moved, twice) <= allowed, length
        assert apart(space, space.transvection(p, v, p), space.exp(p, v)) <= allowed, length


@every
def test_transvection_carries_exp_and_keeps_length(case, rng):
    space = case.space
    for length in [x for x in lengths(space) if x < 3.0]:
        p = base_point(space, rng)
        v = length * unit_tangent(space, p, rng)
        q = space.exp(p, v)
        w = 0.7 * unit_tangent(space, p, rng)
        carried = space.transport(p, q, w)
        # Parallel transport needs log(p, q), whose direction is known to ε/length for short steps,
        # but then it matters by length only.
        allowed = 100 * EPS * condition(space, [p, q]) / min(1.0, (space.injectivity_radius - length))
        if not isinstance(space, ss.SpecialEuclidean):
            assert abs(space.norm(q, carried) - 0.7) <= allowed, length
        moved = space.transvection(p, v, space.exp(p, w))
        assert apart(space, moved, space.exp(q, carried)) <= 4 * allowed, length
        assert np.abs(space.transport(p, q, v) + space.log(q, p)).max() <= allowed, length


@every
def test_inner_product_is_that_of_distance(case, rng):
    space = case.space
    p = base_point(space, rng)
    u, v = (space.random_tangent(rng, p) for _ in range(2))
    space.check_tangent(p, u)
    e = 1e-4
    square = space.distance(space.exp(p, e * u), space.exp(p, e * v)) ** 2 / e**2
    if isinstance(space, ss.SpecialEuclidean):
        # There is no invariant metric: distances are those from the first point.
        square = space.distance(p, space.exp(p, e * (u - v))) ** 2 / e**2
    # Curvature enters at e² relative; distances carry ε/e.
    assert square == pytest.approx(space.norm(p, u - v) ** 2, rel=1e-6, abs=1e-6)
    expanded = space.inner(p, u, u) - 2 * space.inner(p, u, v) + space.inner(p, v, v)
    assert expanded == pytest.approx(space.norm(p, u - v) ** 2, rel=1e-12, abs=1e-12)


# ---- the spline ----


def sharpness(space):
    """K where it is above 1: steps on such a space are as long as K times that on a sphere."""
    return max(1.0, np.nan_to_num(space.curvature))


def end_conditions(kind, space, p):
    velocity = 0.8 * space.log(p[0], p[1]), 0.3 * space.log(p[-1], p[-2])
    return {
        "velocity": ((1, velocity[0]), (1, velocity[1])),
        "acceleration": ((2, velocity[0]), (2, velocity[1])),
        "mixed": ("not-a-knot", (1, velocity[1])),
    }.get(kind, kind)


def knots(kind, n, rng):
    return np.concatenate(
        [[0.0], np.cumsum(np.ones(n - 1) if kind == "uniform" else rng.uniform(0.7, 1.3, n - 1))]
    )


@every
@pytest.mark.parametrize("spacing", ["uniform", "random"])
@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("method", ["fixed-point", "quasi-newton", "newton"])
def test_the_curve_is_c2(case, method, ends, spacing, rng):
    space = case.space
    if case.few and (method, spacing) == ("fixed-point", "uniform"):
        return
    steps = (1e-8, 0.3, case.far) if case.few else (1e-8, 1e-5, 1e-2, 0.3, 0.8, 1.2, 1.5, 2.0, 2.5)
    for step in steps:
        if step > case.far or (ends == "periodic" and step > 2.0 / sharpness(space)):
            # There and back with steps near π has no solution with all legs inside the cut locus.
            continue
        if method == "newton" and step > 1.0 / sharpness(space):
            # From zero velocities Newton's method finds splines of near points only; `auto` starts it better.
            continue
        growing = (ss.Hyperbolic, *POSITIVE)
        if ends in ("not-a-knot", "mixed") and isinstance(space, growing) and step > 1.2:
            # The cubic in normal coordinates extrapolates through exponentially growing space: points
            # far apart need more iterations than the default, or do not converge.
            continue
        make = closed_walk if ends == "periodic" else walk
        p = make(space, step, 12, rng)
        t = knots(spacing, len(p), rng)
        # To the rounding floor: the law is about the solution, not about where an iteration stops.
        options = {"bc_type": end_conditions(ends, space, p), "method": method, "tol": 0.0}
        spline = ss.CubicSpline(t, p, space, **options)
        assert spline.report.converged
        assert space.distance(spline(t), p).max() <= 10 * EPS * condition(space, p)
        # The acceleration holds S(v)⁻¹, which for the longest legs is 4.
        largest = max(jumps(spline))
        assert largest <= (1.0 if step * sharpness(space) < 1.6 else 4.0), (step, largest)


@every
@pytest.mark.parametrize("ends", ["natural", "not-a-knot", "periodic", "velocity"])
def test_solvers_agree(case, ends, rng):
    space = case.space
    # Far apart, several splines fit: the solvers may find different ones.
    for step in (1e-3, 0.3, 1.0 / sharpness(space)):
        p = (closed_walk if ends == "periodic" else walk)(space, step, 14, rng)
        t = knots("random", len(p), rng)
        bc = end_conditions(ends, space, p)
        one, *others = (
            ss.CubicSpline(t, p, space, bc_type=bc, method=m, tol=1e-13).velocities
            for m in ("fixed-point", "quasi-newton", "newton")
        )
        # A residual of 1e-13 leaves velocities some 1e-12 apart where the contraction is slow.
        for other in others:
            assert np.abs(one - other).max() <= 2e-12 * np.abs(one).max() * condition(space, p)


@every
def test_the_spline_commutes_with_isometries(case, rng):
    space = case.space
    p = walk(space, 0.6, 9, rng)
    t = knots("random", len(p), rng)
    o = base_point(space, rng)
    v, w = (0.8 * unit_tangent(space, o, rng) for _ in range(2))

    def move(x):
        return space.transvection(o, w, space.transvection(o, v, x))

    x = np.linspace(t[0], t[-1], 50)
    for ends in ("natural", "not-a-knot"):
        here = ss.CubicSpline(t, p, space, bc_type=ends)
        there = ss.CubicSpline(t, move(p), space, bc_type=ends)
        allowed = 200 * EPS * condition(space, [*p, *move(p)])
        assert apart(space, there(x), move(here(x))) <= allowed


@every
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


@every
def test_derivatives_agree_with_differences(case, rng):
    space = case.space
    p = walk(space, 0.8, 7, rng)
    t = knots("random", len(p), rng)
    spline = ss.CubicSpline(t, p, space)
    # Inside segments: differences across a knot see its jump in the third derivative.
    x = (t[:-1, None] + np.diff(t)[:, None] * [0.1, 0.37, 0.5, 0.8]).ravel()
    y = spline(x)

    def differences(h):
        plus, minus = (space.log(y, spline(x + s * h)) for s in (1, -1))
        return (plus - minus) / (2 * h), (plus + minus) / h**2

    # Richardson's extrapolation of central differences at h and h/2.
    (d1, d2), (half1, half2) = differences(0.02), differences(0.01)
    velocity, acceleration = spline(x, 1), spline(x, 2)
    scale = np.abs(acceleration).max() + np.abs(velocity).max()
    assert np.abs((4 * half1 - d1) / 3 - velocity).max() <= 1e-6 * scale
    assert np.abs((4 * half2 - d2) / 3 - acceleration).max() <= 1e-5 * scale


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
@pytest.mark.parametrize(
    ("ends", "order"), [("velocity", 4), ("not-a-knot", 4), ("periodic", 4), ("natural", 2)]
)
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


@every
def test_a_batch_is_its_curves_bit_for_bit(case, rng):
    space = case.space
    p = np.stack([walk(space, step, 11, rng) for step in np.linspace(1e-3, 1.5, 11)])
    t = knots("random", 11, rng)
    # In any order, in one segment (from curve to curve too), and dense over all.
    times = rng.uniform(t[0], t[-1], 37), np.linspace(t[2], t[3], 40)[1:-1], np.linspace(t[0], t[-1], 331)
    for ends in ("natural", "not-a-knot"):
        batch = ss.CubicSpline(t, p, space, bc_type=ends)
        for i, points in enumerate(p):
            one = ss.CubicSpline(t, points, space, bc_type=ends)
            assert batch[i] == one
            for x in times:
                for nu in range(3):
                    assert np.array_equal(batch(x, nu)[i], one(x, nu))


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("n", [2, 3, 4, 5, 17])
def test_flat_space_is_scipy(ends, n, rng):
    space = ss.Euclidean(3)
    t = np.cumsum(rng.uniform(0.2, 2, n))
    p = rng.standard_normal((n, 3))
    if ends == "periodic":
        p[-1] = p[0]
    bc = end_conditions(ends, space, p)
    ours, flat = ss.CubicSpline(t, p, space, bc_type=bc), FlatSpline(t, p, bc_type=bc)
    x = np.linspace(t[0], t[-1], 101)
    h = np.diff(t).min()
    for nu in range(3):
        assert np.abs(ours(x, nu) - flat(x, nu)).max() <= 200 * EPS * np.abs(p).max() / h**nu
    outside = [t[0] - 0.5, t[-1] + 0.7]
    assert np.allclose(
        ours(outside, extrapolate=True), flat(outside, extrapolate=True), rtol=1e-11, atol=1e-11
    )


@pytest.mark.parametrize("ends", ["natural", "not-a-knot", "clamped", "periodic"])
@pytest.mark.parametrize("spacing", ["uniform", "random", "graded"])
@pytest.mark.parametrize("step", [0.3, 1.2])
def test_a_long_curve_is_c2_everywhere(ends, spacing, step, rng):
    """Long curves are solved in overlapping pieces, which must not show."""
    space = ss.Sphere(3)
    p = closed_walk(space, step, 1300, rng) if ends == "periodic" else walk(space, step, 1301, rng)
    t = knots(spacing, len(p), rng)
    if spacing == "graded":
        # By a factor 10⁶ and back, so that the seam of a closed curve is not a jump.
        up = np.exp(np.linspace(0, np.log(1e6), (len(p) - 1) // 2))
        t = np.concatenate([[0.0], np.cumsum([*up, *up[::-1]])])
    spline = ss.CubicSpline(t, p, space, bc_type=ends)
    assert max(jumps(spline)) <= 1.0


def test_the_three_points_of_the_paper():
    spline = ss.CubicSpline(None, np.eye(3), ss.Sphere(2))
    assert np.abs(spline(0.5) - [0.61308303, 0.76368565, -0.20227067]).max() < 5e-9

"""The curve is C² at every knot, to rounding."""

import numpy as np
import pytest
from cases import (
    CASES,
    EPS,
    LARGE,
    LOOPS,
    POSITIVE,
    closed_walk,
    condition,
    jumps,
    loop,
    walk,
    zigzag,
)
from laws import ENDS, end_conditions, knots, sharpness

import symspline as ss


@pytest.fixture
def rng():
    return np.random.default_rng(20180308)


# Of further sizes of a family the solvers know no more than a number of coordinates, to which equal knots are
# no news, and which end conditions they have is asked of one solver; and of the largest they know no more by
# Newton's method than the law of derivatives says, whose system is Newton's.
KINDS = [
    (case, method, spacing, ends)
    for ends in ENDS
    for method in ("fixed-point", "quasi-newton", "newton")
    for spacing in ("uniform", "random")
    for case in CASES + LARGE
    if not case.few or spacing == "random"
    if not case.few or method == "quasi-newton" or ends == "periodic"
    if method == "quasi-newton" or (spacing == "random" and case.space.dim < 15)
    if case not in LARGE or method == "quasi-newton"
]


@pytest.mark.parametrize(
    ("case", "method", "spacing", "ends"),
    KINDS,
    ids=["-".join([case.name, *kind]) for case, *kind in KINDS],
)
def test_the_curve_is_c2(case, method, spacing, ends, rng):
    space = case.space
    few = case.few or spacing == "uniform"
    # The solvers share the formulas: what each adds shows at the ends of what it can do.
    steps = (1e-8, 0.3, 1.0 / sharpness(space), case.far)
    if method == "quasi-newton" and not few:
        steps = (1e-8, 1e-5, 1e-2, 0.3, 0.8, 1.2, 1.5, 2.0, 2.5)
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
        p = make(space, step, 9 if case.few else 12, rng)
        t = knots(spacing, len(p), rng)
        # To the rounding floor: the law is about the solution, not about where an iteration stops.
        options = {"bc_type": end_conditions(ends, space, p), "method": method, "tol": 0.0}
        spline = ss.CubicSpline(t, p, space, **options)
        assert spline.report.converged
        assert space.distance(spline(t), p).max() <= 10 * EPS * condition(space, p)
        # The acceleration holds S(v)⁻¹, which for the longest legs is 4.
        largest = max(jumps(spline))
        assert largest <= (1.0 if step * sharpness(space) < 1.6 else 4.0), (step, largest)


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


# ---- loops: frames come back turned, unlike there and back ----


@pytest.mark.parametrize("method", ["fixed-point", "quasi-newton", "newton"])
@pytest.mark.parametrize("n", [3, 4, 5, 9])
@pytest.mark.parametrize("name", LOOPS)
def test_a_loop_is_c2(name, n, method, rng):
    space = ss.space(name)
    t, p = loop(space, n, rng)
    spline = ss.CubicSpline(t, p, space, bc_type="periodic", method=method, tol=0.0)
    assert max(jumps(spline)) <= 1.0
    if method == "newton":
        # Quadratic convergence, across the seam too.
        assert ss.CubicSpline(t, p, space, bc_type="periodic", method=method).report.iterations <= 7


# ----


@pytest.mark.parametrize("step", [1.3, 1.5, 1.8])
def test_pieces_of_a_long_zigzag_agree(step):
    """What happens at a knot fades slowly along a zigzag: the first overlap of the pieces is too short."""
    spline = ss.CubicSpline(None, zigzag(step, 1301, 0.001), "sphere:2")
    assert max(jumps(spline)) <= 1.0


def test_a_linear_solver_stops_well_below_the_tolerance(rng):
    """A residual of the tolerance would be a jump of twelve times that."""
    for _ in range(5):
        p = walk(ss.Sphere(2), 0.5, 20, rng)
        spline = ss.CubicSpline(None, p, "sphere:2", method="fixed-point")
        assert max(jumps(spline)) <= 1.0

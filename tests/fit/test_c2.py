"""The curve is C² at every knot, to rounding."""

import numpy as np
import pytest
from cases import (
    CASES,
    ENDS,
    EPS,
    LARGE,
    LOOPS,
    POSITIVE,
    closed_walk,
    condition,
    grouped,
    jumps,
    loop,
    loop_over,
    walk,
    zigzag,
)
from laws import ends_along, knots, sharpness

import symspline as ss

SEED = 20180308


# Every space meets every end condition; solvers and spacings take turns, since they know no more of a space than a
# number of coordinates, and all of them meet all end conditions on a few. Of the largest spaces the solvers know no
# more by Newton's method than the law of derivatives says.
METHODS = ("fixed-point", "quasi-newton", "newton")
TURNS = [
    (case, METHODS[(i + j) % (3 if case.space.dim < 15 else 2)], ("random", "uniform")[(i + j) // 3 % 2], ends)
    for i, case in enumerate(CASES)
    for j, ends in enumerate(ENDS)
]
KINDS = {case.name: [kind for kind in TURNS if kind[0] is case] for case in CASES}
for case in LARGE:
    KINDS[case.name] = [(case, "quasi-newton", "random", ends) for ends in ENDS[::3]]
for case in CASES:
    if case.name in ("euclidean:3", "sphere:2", "cp:2", "so:3"):
        KINDS[case.name] = [
            (case, method, spacing, ends) for method in METHODS for spacing in ("uniform", "random") for ends in ENDS
        ]


@grouped("case, method, spacing, ends", KINDS)
def test_the_curve_is_c2(case, method, spacing, ends, rng):
    space = case.space
    few = case.few or spacing == "uniform"
    # The solvers share the formulas: what each adds shows at the ends of what it can do.
    steps = (0.3, case.far) if case.few else (1e-8, 0.3, 1.0 / sharpness(space), case.far)
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
        if ends in ("not-a-knot", "mixed", "turned") and isinstance(space, growing) and step > 1.2:
            # The cubic in normal coordinates extrapolates through exponentially growing space: points
            # far apart need more iterations than the default, or do not converge.
            continue
        make = closed_walk if ends == "periodic" else walk
        p = make(space, step, 9 if case.few else 12, rng)
        t = knots(spacing, len(p), rng)
        # To the rounding floor: the law is about the solution, not about where an iteration stops.
        options = {"bc_type": ends_along(ends, space, p), "method": method, "tol": 0.0}
        spline = ss.CubicSpline(t, p, space, **options)
        assert spline.report.converged, step
        assert space.distance(spline(t), p).max() <= 10 * EPS * condition(space, p)
        # The acceleration holds S(v)⁻¹, which for the longest legs is 4.
        largest = max(jumps(spline))
        assert largest <= (1.0 if step * sharpness(space) < 1.6 else 4.0), (method, spacing, ends, step, largest)


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


@pytest.mark.parametrize("method", ["fixed-point", "quasi-newton", "newton"])
@loop_over("n", [3, 4, 5, 9])
@pytest.mark.parametrize("name", LOOPS)
def test_a_loop_is_c2(name, n, method, rng):
    space = ss.space(name)
    t, p = loop(space, n, rng)
    spline = ss.CubicSpline(t, p, space, bc_type="periodic", method=method, tol=0.0)
    assert max(jumps(spline)) <= 1.0
    if method == "newton":
        # Quadratic convergence, across the seam too.
        assert ss.CubicSpline(t, p, space, bc_type="periodic", method=method).report.iterations <= 7


@pytest.mark.parametrize("step", [1.3, 1.5, 1.8])
def test_long_zigzags_are_c2(step):
    """What happens at a knot fades slowly along a zigzag: the first overlap of the pieces is too short."""
    spline = ss.CubicSpline(None, zigzag(step, 1301, 0.001), "sphere:2")
    assert max(jumps(spline)) <= 1.0


def test_a_linear_solver_stops_well_below_the_tolerance(rng):
    """A residual of the tolerance would be a jump of twelve times that."""
    for _ in range(5):
        p = walk(ss.Sphere(2), 0.5, 20, rng)
        spline = ss.CubicSpline(None, p, "sphere:2", method="fixed-point")
        assert max(jumps(spline)) <= 1.0

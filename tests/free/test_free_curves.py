"""Curves with control points: `BSpline` and `BezierCurve` on every space."""

import numpy as np
import pytest
from cases import EPS, QUOTIENTS, apart, by_differences, condition, every_family, loop_over, walk
from curves import clamped
from scipy.interpolate import BSpline as FlatBSpline

import symspline as ss

SEED = 2007
every_degree = loop_over("degree", range(1, 6))


def assert_differences(curve, x, h):
    """Derivatives are those by differences."""
    velocity, acceleration = curve(x, 1), curve(x, 2)
    scale = np.abs(acceleration).max() + np.abs(velocity).max()
    found = by_differences(curve.space, curve, x, h)
    assert np.abs(found[0] - velocity).max() <= 1e-5 * scale
    assert np.abs(found[1] - acceleration).max() <= 1e-4 * scale


def here(space, x, y, v):
    """Vectors at y, at arrays x of the same points."""
    return space.transport(y, x, v) if isinstance(space, QUOTIENTS) else v


def backwards(curve):
    """The same curve in the other direction: what it has from the right this one has from the left."""
    points = np.flip(curve.control_points, axis=-1 - len(curve.space.point_shape))
    return ss.BSpline(-curve.knots[::-1], points, curve.degree, curve.space)


INTERIOR = {
    "none": [],
    "uniform": [1.0, 2.0],
    "random": [0.3, 1.1, 1.25, 2.9],
    "double": [0.5, 1.5, 1.5, 2.0],
    "to the degree": None,
    "a jump": None,
}


def some_knots(kind, degree):
    interior = INTERIOR[kind]
    if interior is None:
        interior = [0.5, *[1.5] * (degree + (kind == "a jump")), 2.0]
    return clamped(interior, degree)


@loop_over("kind", [*INTERIOR, "not clamped", "one end"])
@every_degree
def test_flat_space_of_free_curves_is_scipy(kind, degree, rng):
    if kind == "double" and degree == 1:
        return
    if kind == "not clamped":
        knots = np.cumsum(rng.uniform(0.2, 1.0, 2 * degree + 7))
    elif kind == "one end":
        knots = np.concatenate([[0.0] * (degree + 1), np.cumsum(rng.uniform(0.2, 1.0, degree + 5))])
    else:
        knots = some_knots(kind, degree)
    points = rng.standard_normal((2, len(knots) - degree - 1, 3))
    ours = ss.BSpline(knots, points, degree, "r:3")
    flat = FlatBSpline(knots, np.moveaxis(points, 1, 0), degree)
    start, end = ours.domain
    assert (start, end) == (knots[degree], knots[-degree - 1])
    inside = knots[(knots >= start) & (knots <= end)]
    x = np.concatenate([inside, rng.uniform(start, end, 100), [start, end]])
    h = np.diff(np.unique(knots)).min()
    for nu in range(3):
        expected = np.moveaxis(flat(x, nu), 1, 0)
        assert np.abs(ours(x, nu) - expected).max() <= 100 * degree * EPS * np.abs(points).max() * (degree / h) ** nu
    assert np.allclose(ours.speed(x), np.linalg.norm(ours(x, 1), axis=-1), rtol=1e-13, atol=1e-13)


@every_family
def test_a_cubic_is_a_segment_of_the_spline(case, rng):
    space = case.space
    p = walk(space, 0.6, 6, rng)
    t = np.array([0.0, 1.0, 1.5, 3.0, 4.0, 4.5])
    spline = ss.CubicSpline(t, p, space)
    segments = ss.BezierCurve(spline.control_points, space)
    tau = np.linspace(0, 1, 9)
    h = np.diff(t)
    x = t[:-1, None] + tau * h[:, None]
    x[:, -1] = t[1:]
    allowed = 200 * EPS * condition(space, p)
    y = spline(x)
    assert apart(space, segments(tau), y) <= allowed
    for nu in (1, 2):
        scale = h.reshape(-1, *[1] * (1 + len(space.point_shape))) ** nu
        ours = here(space, y, segments(tau), segments(tau, nu)) / scale
        theirs = spline(x, nu)
        # ∇γ' of the two segments at a knot agrees up to the residual of the fit.
        assert np.abs(ours - theirs).max() <= 100 * allowed / h.min() ** nu + 1e-11 * np.abs(theirs).max()


@every_family
@loop_over("degree", [2, 3, 5])
def test_derivatives_agree_with_differences(case, degree, rng):
    curve = ss.BSpline(clamped([0.7, 1.9], degree), walk(case.space, 0.4, degree + 3, rng), degree, case.space)
    # Inside the intervals: higher derivatives jump at knots.
    assert_differences(curve, np.array([0.1, 0.4, 0.6, 0.8, 1.2, 1.8, 2.1, 2.5, 2.9]), 0.02)


@pytest.mark.parametrize("name", ["rp:2", "cp:2", "gr:2,5", "cgr:2,4"])
def test_the_array_of_a_point_does_not_matter(name, rng):
    space = ss.space(name)
    points = walk(space, 0.4, 6, rng)
    if len(space.point_shape) == 1:
        turn = np.array([1, -1, -1, 1, -1, 1])[:, None] * (np.exp(1j * np.arange(6))[:, None] if name[0] == "c" else 1)
        other = points * turn
    else:
        group = (ss.Unitary if name[0] == "c" else ss.Orthogonal)(2)
        other = points @ group.random_point(rng, 6)
    x = np.linspace(0, 3, 31)
    one, two = (ss.BSpline(clamped([1.0, 1.5], 3), p, 3, space) for p in (points, other))
    assert apart(space, one(x), two(x)) <= 100 * EPS
    for nu in (1, 2):
        assert np.abs(one(x, nu) - here(space, one(x), two(x), two(x, nu))).max() <= 1e-11


@every_family
def test_corners(case, rng):
    """At a knot repeated as often as the degree the curve goes through a control point, and has a velocity
    from either side."""
    space = case.space
    points = walk(space, 0.4, 7, rng)
    curve = ss.BSpline(clamped([1.0, 1.0, 1.0], 3), points, 3, space)
    points = curve.control_points
    allowed = 100 * EPS * condition(space, points)
    assert apart(space, curve(1.0), points[3]) <= allowed
    right = here(space, points[3], curve(1.0), curve(1.0, nu=1))
    assert np.abs(right - 3 / 2.0 * space.log(points[3], points[4])).max() <= 30 * allowed
    back = backwards(curve)
    left = -here(space, points[3], back(-1.0), back(-1.0, nu=1))
    assert np.abs(left + 3 / 1.0 * space.log(points[3], points[2])).max() <= 30 * allowed
    # Either side is the Bézier curve of its control points.
    tau = np.linspace(0, 1, 7)[:-1]
    for first, start, h in ((0, 0.0, 1.0), (3, 1.0, 2.0)):
        alone = ss.BezierCurve(points[first : first + 4], space)
        assert apart(space, curve(start + h * tau), alone(tau)) <= allowed
        if start + h * tau[0] == 1.0:
            y = curve(1.0)
            bend = here(space, y, alone(0.0), alone(0.0, nu=2)) / h**2
            assert np.abs(curve(1.0, nu=2) - bend).max() <= 300 * allowed


def test_a_bspline_that_ends_at_a_knot_that_repeats(rng):
    """Knots go on beyond the end, where intervals are empty."""
    knots, points = np.array([0.0, 1, 2, 3, 3, 3, 4, 5]), rng.standard_normal((5, 2))
    curve, x = ss.BSpline(knots, points, 2, "r:2"), np.array([2.0, 2.5, 3.0])
    assert curve.domain == (2.0, 3.0)
    # From the left; SciPy takes the end from the right.
    expected = FlatBSpline(knots, points, 2)(np.minimum(x, np.nextafter(3.0, 0.0)))
    assert np.abs(curve(x) - expected).max() <= 20 * EPS

"""The values in a report are true of the returned curve, and impossible input raises an error."""

import itertools
import zlib
from dataclasses import replace

import numpy as np
import pytest
from cases import (
    ENDS,
    EPS,
    WORDS,
    base_point,
    compact,
    condition,
    end_conditions,
    jumps,
    loop_over,
    one_sided,
    steep_tangent,
    unit_tangent,
    walk,
)
from refused import raises

import symspline as ss

# Spaces of few dimensions, so that Newton's method is quick; all kinds of pages and of cut loci.
SPACES = [
    *("r:2", "sphere:1", "sphere:2", "sphere:3", "h:2", "rp:2", "cp:1", "cp:2", "gr:2,4", "cgr:1,2"),
    *("so:2", "so:3", "o:3", "so:4", "u:1", "u:2", "su:2", "spd:2", "hpd:2", "se:2", "se:3"),
    *("sspd:2", "siegel:1", "hp:1"),
]
METHODS = ("auto", "fixed-point", "quasi-newton", "newton")
FAR = 0.95


def seeded(*names):
    return np.random.default_rng(zlib.crc32(" ".join(names).encode()))


def reach(space):
    """The longest step between neighbours."""
    return FAR * space.injectivity_radius if compact(space) or np.isfinite(space.injectivity_radius) else 2.0


def far_points(space, n, rng, closed):
    """Steps of any length up to nearly the cut locus, also in directions that are the first to meet it. A closed
    curve goes between points around one."""
    p = [base_point(space, rng)]
    for _ in range(n - 1):
        tangent = steep_tangent if rng.random() < 0.3 else unit_tangent
        start = p[0] if closed else p[-1]
        step = reach(space) * rng.choice([1.0, rng.random()]) * (0.5 if closed else 1.0)
        p.append(space.project(space.exp(start, step * tangent(space, start, rng))))
    return [*p, p[0]] if closed else p


def unequal_knots(n, curves, rng):
    """Gaps that differ by up to ten, thirty times as long or short as one."""
    gaps = 10.0 ** -rng.random((curves, n - 1)) * rng.choice([0.03, 1.0, 30.0])
    return np.concatenate([np.zeros((curves, 1)), np.cumsum(gaps, axis=1)], axis=1)


def random_ends(kind, space, p, t, rng):
    """Vectors at the ends are legs of up to half the way to the cut locus."""
    if kind in WORDS:
        return kind
    order = 2 if kind in ("acceleration", "turned") else 1
    vectors = []
    for node, near in ((0, 1), (-1, -2)):
        leg = np.stack([0.5 * reach(space) * rng.random() * unit_tangent(space, x, rng) for x in p[:, node]])
        h = np.abs(t[:, near] - t[:, node])
        vectors.append(3 * leg / h.reshape(-1, *(1,) * (leg.ndim - 1)) ** order)
    return end_conditions(kind, *vectors)


@pytest.mark.parametrize("name", SPACES[::2])
def test_reports_of_converged_curves_are_true(name):
    space, rng = ss.space(name), seeded(name)
    converged = curves = 0
    for kind, method in itertools.product(ENDS, METHODS):
        n = int(rng.integers(3, 6))
        p = np.array([far_points(space, n, rng, kind == "periodic") for _ in range(2)])
        t = unequal_knots(p.shape[1], len(p), rng)
        bc = random_ends(kind, space, p, t, rng)
        options = {"bc_type": bc, "method": method, "max_iter": 60, "on_failure": "ignore"}
        spline = ss.CubicSpline(t, p, space, **options)
        for one, points in zip(spline, p, strict=True):
            if one.report.converged:
                # Handles close to the cut locus multiply rounding errors, in a few of these curves by a hundred.
                assert max(jumps(one)) <= 300, (kind, method)
                missed = space.distance(one(one.t), points).max()
                assert missed <= 500 * EPS * condition(space, points), (kind, method)
        converged, curves = converged + np.sum(spline.report.converged), curves + len(p)
    assert converged > 0.3 * curves


TRIANGLE = [[1, 1, -1], [-1, 1, -1], [-1, 0, 1], [1, 1, -1]]


@pytest.mark.parametrize("method", METHODS)
def test_a_closed_curve_on_unequal_knots_closes(method):
    p = ss.Sphere(2).project(TRIANGLE / np.linalg.norm(TRIANGLE, axis=-1, keepdims=True))
    options = {"bc_type": "periodic", "method": method, "on_failure": "ignore"}
    for turn in range(3):
        # Wherever it begins.
        t = np.concatenate([[0], np.cumsum(np.roll([3.0, 3.0, 1.0], turn))])
        spline = ss.CubicSpline(t, np.roll(p[:3], turn, axis=0)[[0, 1, 2, 0]], "sphere:2", **options)
        assert not spline.report.converged or max(jumps(spline)) <= 1.0
        if method == "auto":
            assert spline.report.converged


@pytest.mark.parametrize("name", ["sphere:2", "gr:2,4", "so:3", "r:2"])
def test_ends_of_a_closed_curve_that_nearly_meet_are_made_one(name):
    """Last and first point may be 1e-8 apart; the curve has no such gap."""
    space, rng = ss.space(name), seeded(name)
    p = walk(space, 0.4, 4, rng)
    near = space.exp(p[0], 5e-9 * unit_tangent(space, p[0], rng))
    spline = ss.CubicSpline([0, 1, 3, 4, 6], [*p, near], space, bc_type="periodic")
    assert max(jumps(spline)) <= 1.0
    assert space.distance(spline.points[-1], spline.points[0]) <= 4 * EPS
    assert space.distance(spline.points[-1], near) <= 6e-9


AROUND = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 0]])


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def test_the_middle_geodesic_of_rotations_is_the_shortest():
    """The control points between are 170° + 2·(1.5/3) rad = 227° apart, and 133° the other way."""
    p = np.array([np.eye(3), turned(np.radians(170))])
    ends = ((1, -1.5 * p[0] @ AROUND), (1, -1.5 * p[1] @ AROUND))
    one, other = (ss.CubicSpline([0, 1], p, name, bc_type=ends) for name in ("so:3", "o:3"))
    x = np.linspace(0, 1, 21)
    for nu in range(3):
        assert np.abs(one(x, nu) - other(x, nu)).max() <= 1e-13 * max(1, np.abs(other(x, nu)).max())
    assert np.abs(one(0.5) - turned(np.radians(-95))).max() <= 1e-14


def badly_scaled(name, scale, rng):
    """Points whose tangent vectors have components of very different sizes."""
    space = ss.space(name)
    p = walk(space, 0.5, 6, rng)
    if name == "se:3":
        p[:, :3, 3] *= scale
        return p
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    g = turn * [1, scale**-0.25, scale**-0.5]
    p = g @ p @ g.T
    return (p + np.swapaxes(p, -1, -2)) / 2


@pytest.mark.parametrize(("name", "scale"), [("spd:3", 3e8), ("spd:3", 1e4), ("se:3", 1e6), ("se:3", 1.0)])
def test_gradients_keep_their_digits(name, scale):
    """By the points: `vjp` is the transpose of `jvp` to ε times the condition, not its square."""
    space, rng = ss.space(name), seeded(name)
    p = badly_scaled(name, scale, rng)
    spline = ss.CubicSpline(None, p, space)
    x = np.array([0.4, 1.7, 2.2, 4.9])
    for nu in range(2):
        weights = rng.standard_normal(spline(x).shape)
        gradient = spline.vjp(x, weights, nu=nu).points
        for _ in range(5):
            motion = space.random_tangent(rng, p)
            moved = weights * spline.jvp(x, motion, nu=nu)
            allowed = 1000 * EPS * scale * np.abs(moved).sum()
            assert abs(np.sum(gradient * motion) - moved.sum()) <= allowed
        # The gradient is tangent, the one array of many that pair alike.
        assert np.abs(space.project_tangent(p, gradient) - gradient).max() <= 1e-7 * np.abs(gradient).max()


def test_curves_that_have_not_converged_have_no_derivatives():
    p = np.stack([walk(ss.Sphere(2), step, 6, seeded("derivatives")) for step in (0.4, 2.9)])
    spline = ss.CubicSpline(None, p, "sphere:2", max_iter=12, on_failure="ignore")
    assert spline.report.converged.tolist() == [True, False]
    moved = spline.jvp(1.5, points=np.ones_like(p))
    gradient = spline.vjp(1.5, np.ones((2, 3)))
    for found in (moved, gradient.points):
        assert np.isfinite(found[0]).all() and np.isnan(found[1]).all()


UNITS = [1e-300, 1e-150, 1e-100, 1e-60, 1e60, 1e78, 1e150, 1e300]


@loop_over("unit", UNITS)
@pytest.mark.parametrize("ends", ["natural", "not-a-knot", "periodic", "velocity", "acceleration"])
def test_times_may_have_any_unit(unit, ends):
    """Powers of two change nothing but the exponents."""
    unit = 2.0 ** np.round(np.log2(unit))
    space, t = ss.Sphere(2), np.array([0, 1, 2.5, 3.0])
    p = space.project(TRIANGLE / np.linalg.norm(TRIANGLE, axis=-1, keepdims=True))
    v = 0.5 * space.log(p[0], p[1])
    many = {"velocity": lambda s: ((1, v / s), "natural"), "acceleration": lambda s: ((2, v / s / s), "natural")}
    if ends == "acceleration" and not 1e-140 < unit < 1e140:
        # The acceleration is no double.
        return
    one, scaled = (
        ss.CubicSpline(t * s, p, space, bc_type=many[ends](s) if ends in many else ends) for s in (1.0, unit)
    )
    same = replace(scaled.report, max_gap=one.report.max_gap, alternative_energy=one.report.alternative_energy)
    assert same == one.report
    assert scaled.report.max_gap == one.report.max_gap * unit
    assert np.array_equal(scaled.velocities * unit, one.velocities)
    x = np.linspace(0, 3, 31)
    assert np.array_equal(scaled(x * unit), one(x))
    assert np.abs(scaled(x * unit, 1) * unit - one(x, 1)).max() <= 1e-15 * np.abs(one(x, 1)).max()
    assert np.abs(scaled.speed(x * unit) * unit - one.speed(x)).max() <= 1e-15 * one.speed(x).max()
    assert scaled.length() == pytest.approx(one.length(), rel=1e-14)


@pytest.mark.parametrize("unit", [1e-200, 1e-90, 1.0, 1e90, 1e200])
def test_length_and_energy_are_floating_point_numbers_where_they_can_be(unit):
    for s in (1e-200, 1.0, 1e200):
        # Otherwise velocities are not.
        if 1e-300 < s / unit < 1e300:
            straight = ss.CubicSpline(np.array([0, 1.0, 2]) * unit, s * np.array([[0, 0], [3, 4], [6, 8.0]]), "r:2")
            assert straight.length() == pytest.approx(10 * s, rel=1e-14, abs=0)
    if 1e-100 < unit < 1e100:
        one, spline = (ss.CubicSpline(np.array([0, 1, 3.0]) * h, np.eye(3), "sphere:2") for h in (1.0, unit))
        assert spline.bending_energy() * unit**3 == pytest.approx(one.bending_energy(), rel=1e-12)


def far_out(r, n=6):
    """Points of H² at distance r from (1, 0, 0), steps of about one along a horocycle."""
    angle = np.arange(n) * 2 * np.exp(-r)
    return np.stack([np.full(n, np.cosh(r)), np.sinh(r) * np.cos(angle), np.sinh(r) * np.sin(angle)], axis=-1)


def test_hyperbolic_points_that_doubles_cannot_tell_apart_are_an_error():
    for r in [17.0, 18.0, 20.0, 25.0]:
        p = ss.Hyperbolic(2).project(far_out(r))
        p[:3] = far_out(1.0)[:3]
        raises(rf"points\[3\] .*distance {r:.1f}.* from \(1, 0, .*transvection", ss.CubicSpline, None, p, "h:2")


@pytest.mark.parametrize("name", ["h:2", "h:3", "ch:1", "ch:2", "spd:2", "hpd:2", "sspd:2"])
def test_rounding_of_long_steps_is_reported(name):
    """Geodesics multiply rounding errors by the exponential of their length, however right the velocities are."""
    space, rng = ss.space(name), seeded(name)
    converged = 0
    middle = base_point(space, rng)
    for radius in np.linspace(0.5, 13, 26):
        p = np.stack([space.exp(middle, radius * unit_tangent(space, middle, rng)) for _ in range(3)])
        spline = ss.CubicSpline([0, 1, 2.5], p, space, on_failure="ignore")
        if not spline.report.converged:
            continue
        converged += 1
        starts, ends = one_sided(spline, 0)
        missed = space.distance(ends, p[1:]).max() / max(space.norm(p, spline.velocities))
        # Errors above 1e-8 are those of the report.
        allowed = 2 * max(1e-8, spline.report.residual)
        assert missed <= allowed <= 2e-7, radius
        after, before = one_sided(spline, 1)
        carried = space.transport(ends[:-1], starts[1:], before[:-1])
        largest = max(space.norm(starts, after).max(), space.norm(ends, before).max())
        assert space.norm(starts[1:], carried - after[1:]).max() <= allowed * largest, radius
    assert converged >= 5

"""Theorem 3.1 with numbers: the region that Algorithm 1 does not leave, and its contraction there."""

import numpy as np
import pytest
from cases import CURVED, closed_walk, loop_over, unit_tangent, walk

import symspline as ss

SEED = 2
S2 = ss.Sphere(2)
# Where the smallest and the largest V of (38) meet.
LARGEST_KD, LARGEST_KV = 0.2610895, 0.4420886


def steps(space, kd, rng, n=10, turn=3.0):
    """A walk with K D = `kd`."""
    return walk(space, kd / space.curvature, n, rng, turn=turn)


def excess(kd, kv):
    """The left side of (38) minus the right one, times K."""
    ku = kd + 2 * kv
    return 0.5 * ku / np.sin(ku) * (ku - kv) - kv


@pytest.mark.parametrize("name", CURVED)
@loop_over("kd", [1e-6, 0.01, 0.1, 0.2, 0.25, 0.26, 0.26108])
def test_radius_is_the_smallest_of_38(name, kd, rng):
    space = ss.space(name)
    report = ss.CubicSpline(None, steps(space, kd, rng), space).report
    kd, kv = report.curvature * report.max_step, report.curvature * report.invariant_radius
    assert kv <= LARGEST_KV
    assert excess(kd, kv) <= 1e-14 * kv
    assert excess(kd, kv * (1 - 1e-6)) > 0


@pytest.mark.parametrize("name", ["euclidean:3", "so:2", "spd:1", "rp:1"])
def test_radius_is_the_longest_step_in_flat_space(name, rng):
    space = ss.space(name)
    report = ss.CubicSpline(None, walk(space, 0.5, 6, rng), space).report
    assert report.curvature == 0.0
    assert report.invariant_radius == pytest.approx(report.max_step, rel=1e-15)
    assert report.contraction_bound == 0.5


ZIGZAG = np.array([0, 1, 0, 1.0])


@pytest.mark.parametrize(
    ("space", "points"),
    [
        ("torus:1", lambda a: a[:, None]),
        ("sphere:1", lambda a: np.stack([np.cos(a), np.sin(a)], -1)),
        ("u:1", lambda a: np.exp(1j * a)[:, None, None]),
        ("rp:1", lambda a: np.stack([np.cos(a / 2), np.sin(a / 2)], -1)),
        ("torus:2", lambda a: np.stack([a, 0 * a], -1)),
    ],
    ids=["torus:1", "sphere:1", "u:1", "rp:1", "torus:2"],
)
def test_circles_need_steps_below_a_third_of_the_injectivity_radius(space, points):
    space = ss.space(space)
    for angle, certified in ((0.3 * np.pi, True), (0.34 * np.pi, False), (0.9 * np.pi, False)):
        report = ss.CubicSpline(None, points(angle * ZIGZAG), space).report
        # One batch with a certified curve has NaN for the other one.
        batch = ss.CubicSpline(None, np.stack([points(angle * ZIGZAG), points(0.1 * ZIGZAG)]), space).report
        for name in ("invariant_radius", "contraction_bound", "guaranteed_sweeps"):
            assert (getattr(report, name) is not None) == certified
            assert np.isnan(getattr(batch, name)).tolist() == [not certified, False]
        assert ("Theorem" in str(report)) == certified


def test_a_quotient_uses_its_own_injectivity_radius():
    def about_z(angle):
        return ss.rotations.from_rotation_vectors(angle * np.arange(5)[:, None] * [0, 0, 1])

    cubic = ss.space("so:3/432")
    # Turns by 0.5 one way and by π/2 − 0.5 the other way are the same points of the quotient.
    assert np.allclose(cubic.distance(about_z(0.5), about_z(0.5 - np.pi / 2)), 0, atol=1e-7)
    for rotations in (about_z(0.5), about_z(0.5 - np.pi / 2)):
        assert ss.CubicSpline(None, rotations, cubic).report.contraction_bound is None
    assert ss.CubicSpline(None, about_z(0.5), "so:3").report.contraction_bound is not None
    near = ss.CubicSpline(None, about_z(0.1), cubic).report
    assert near.max_step + 2 * near.invariant_radius < cubic.injectivity_radius
    assert near.contraction_bound == ss.CubicSpline(None, about_z(0.1), "so:3").report.contraction_bound


def test_a_product_has_a_radius_per_factor():
    """The great circle the long way round is a second natural curve, outside the region of its factor."""
    a = 0.05 * np.arange(5)
    p, line = np.stack([np.cos(a), np.sin(a), 0 * a], -1), 10.0 * np.arange(5)[:, None]
    report = ss.CubicSpline(None, (p, line), "sphere:2 x r:1").report
    long_way = (2 * np.pi + 0.05) / 3
    assert report.invariant_radius == (pytest.approx(0.0504, abs=1e-4), pytest.approx(10, rel=1e-12))
    assert report.contraction_bound is not None and long_way > report.invariant_radius[0]
    assert str(report).endswith("control handles stay below 0.0504 and 10 (Theorem 3.1)")


def alpha(kd, kv):
    """The bound of the contraction, written anew from the derivation in docs/convergence.md."""
    ku = kd + 2 * kv
    stretch = np.sinh(kv) / kv
    neighbours = ku / np.sin(ku) * stretch
    own = (2 - ku / np.tan(ku)) * stretch - 1 + ku * (np.cosh(kv) - 1) / kv
    return (neighbours + own) / 2


@pytest.mark.parametrize("kd", [1e-3, 0.1, 0.2, 0.25, 0.2605])
def test_bound_of_the_contraction(kd, rng):
    report = ss.CubicSpline(None, steps(S2, kd, rng), S2).report
    assert report.contraction_bound == pytest.approx(alpha(report.max_step, report.invariant_radius), rel=1e-12)
    expected = {0.1: 0.533, 0.2: 0.665, 0.25: 0.857}.get(kd)
    assert expected is None or report.contraction_bound == pytest.approx(expected, abs=1e-3)
    assert report.guaranteed_sweeps == np.ceil(np.log(1e-12) / np.log(report.contraction_bound))


def test_bound_ends_before_the_region_does(rng):
    # α = 1 at KD = 0.26058, and (38) has a solution up to 0.26109.
    report = ss.CubicSpline(None, steps(S2, 0.2608, rng), S2).report
    assert report.invariant_radius is not None
    assert report.contraction_bound is None and report.guaranteed_sweeps is None


def test_radius_is_none_where_the_theorem_does_not_apply(rng):
    p, t = steps(S2, 0.1, rng), np.arange(10.0)
    t[4] += 1e-6
    far = np.concatenate([p, S2.exp(p[-1], 0.27 * unit_tangent(S2, p[-1], rng))[None]])
    acceleration = (2, 0.1 * unit_tangent(S2, p[0], rng))
    poses = ss.SpecialEuclidean(3)
    for spline in (
        ss.CubicSpline(None, far, S2),
        ss.CubicSpline(t, p, S2),
        ss.CubicSpline(np.cumsum(rng.uniform(0.5, 2, 10)), p, S2),
        ss.CubicSpline(None, p, S2, bc_type="not-a-knot"),
        ss.CubicSpline(None, p, S2, bc_type=("natural", "not-a-knot")),
        ss.CubicSpline(None, p, S2, bc_type=(acceleration, "natural")),
        ss.CubicSpline(None, closed_walk(S2, 0.1, 10, rng), S2, bc_type="periodic"),
        # A space without an invariant metric.
        ss.CubicSpline(None, walk(poses, 0.01, 6, rng), poses),
    ):
        assert spline.report.invariant_radius is None


@pytest.mark.parametrize("end", [0, -1])
def test_given_velocities_widen_the_region(end, rng):
    p = steps(S2, 0.1, rng)
    smallest = ss.CubicSpline(None, p, S2).report.invariant_radius
    # The largest root of (38), by bisection between the two.
    low, high = 0.5, 1.4
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if excess(0.1, middle) < 0 else (low, middle)
    for leg, radius in [
        (0.0, smallest),
        (0.99 * smallest, smallest),
        (1.01 * smallest, 1.01 * smallest),
        (0.5, 0.5),
        (low * (1 - 1e-6), low * (1 - 1e-6)),
        (low * (1 + 1e-6), None),
        (1.2, None),
    ]:
        given = (1, 3 * leg * unit_tangent(S2, p[end], rng))
        ends = (given, "natural") if end == 0 else ("natural", given)
        report = ss.CubicSpline(None, p, S2, bc_type=ends, on_failure="ignore").report
        assert report.invariant_radius == (radius and pytest.approx(radius, rel=1e-12)), leg


def test_every_curve_of_a_batch_has_its_radius_in_the_report_and_its_text(rng):
    batch = ss.CubicSpline(None, np.array([steps(S2, kd, rng) for kd in (0.1, 0.2, 0.5)]), S2)
    radius = batch.report.invariant_radius
    assert radius.shape == (3,) and np.isnan(radius).tolist() == [False, False, True]
    assert [batch[i].report.invariant_radius for i in range(3)] == [radius[0], radius[1], None]
    assert np.array_equal(batch[1:].report.invariant_radius, radius[1:], equal_nan=True)
    far = ss.CubicSpline(None, batch.points[2:], S2)
    assert far.report.invariant_radius is None
    for some, stated in ((batch[1], True), (batch[:2], True), (batch[2], False), (batch, False)):
        assert str(some.report).endswith(", control handles stay below 0.234 (Theorem 3.1)") == stated
        assert ("Theorem" in str(some.report)) == stated
    t = np.array([np.arange(10.0), np.arange(10.0) ** 2, np.arange(10.0)])
    own = ss.CubicSpline(t, batch.points, S2).report.invariant_radius
    assert np.isnan(own).tolist() == [False, True, True]
    many = ss.fit_many(list(zip(t, batch.points, strict=True)), S2)
    assert [one.report.invariant_radius for one in many] == [own[0], None, None]


@pytest.mark.parametrize("first", [S2, ss.Euclidean(2)])
def test_a_product_has_none_where_a_factor_has_none(first, rng):
    near, far = steps(S2, 0.2, rng) if first == S2 else rng.standard_normal((10, 2)), steps(S2, 0.5, rng)
    space = ss.Product(first, S2)
    assert ss.CubicSpline(None, (near, far), space).report.invariant_radius is None
    batch = np.stack([near, near]), np.stack([0.02 * far + far[:1], far])
    radius = ss.CubicSpline(None, (batch[0], S2.project(batch[1])), space).report.invariant_radius
    assert np.isnan(radius).tolist() == [[False, False], [True, True]]

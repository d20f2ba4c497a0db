"""Poles, and points at the cut locus and just before it."""

import numpy as np
import pytest
from cases import EPS, loop_over, steep_tangent, unit_tangent
from refused import CLAMPED, fails, raises

import symspline as ss


@pytest.mark.parametrize("n", [8, 9, 12])
@pytest.mark.parametrize("gap", [1.0, 1e-2, 1e-6])
def test_special_unitary_phases_that_are_all_small(n, gap, rng):
    """n phases of 2π/n add up to 2π: however small they are, one of them is a turn off."""
    space = ss.SpecialUnitary(n)
    p, turn = space.random_point(rng), ss.Unitary(n).random_point(rng)
    part = (2 * np.pi - gap) / n
    phases = np.array([(n - 1) * part, *[-part] * (n - 1)])
    v = space.project_tangent(p, p @ (turn * (1j * phases)) @ turn.conj().T)
    q = space.exp(p, v)
    assert np.abs(space.log(p, q) - v).max() <= 50 * EPS * n / min(1.0, gap)
    assert abs(space.distance(p, q) - np.linalg.norm(phases)) <= 50 * EPS * n


@loop_over("axis", range(3))
@loop_over("gap", [1e-2, 1e-6, 1e-10, 1e-14])
@pytest.mark.parametrize("name", ["so:3", "se:3"])
def test_half_turns_about_each_axis(name, axis, gap, rng):
    """Of the four formulas for the quaternion of a matrix only one keeps its digits there."""
    space = ss.space(name)
    omega = np.cross(np.eye(3), -(np.pi - gap) * np.eye(3)[axis])
    p = np.eye(space.point_shape[0])
    v = np.zeros_like(p)
    v[:3, :3] = omega
    if name == "se:3":
        v[:3, 3] = rng.standard_normal(3)
    q = space.exp(p, v)
    assert np.abs(space.log(p, q) - v).max() <= 50 * EPS
    assert np.abs(space.exp(p, space.log(p, q)) - q).max() <= 50 * EPS


@pytest.mark.filterwarnings("ignore:neighbours almost at the cut locus")
@pytest.mark.parametrize("n", [1, 2, 3, 7])
@loop_over("gap", [0.1, 1e-3, 1e-8, 1e-12, 1e-13, 1e-14])
def test_the_last_digits_before_the_antipode(n, gap):
    """A logarithm there is tangent, of the right length, and leads to the point; so do curves."""
    space, rng = ss.Sphere(n), np.random.default_rng(n)
    p = space.random_point(rng, 20)
    v = space.random_tangent(rng, p)
    q = space.exp(p, (np.pi - gap) * v / space.norm(p, v)[:, None])
    log = space.log(p, q)
    assert np.abs(np.sum(p * log, axis=-1)).max() < 1e-15
    np.testing.assert_allclose(space.norm(p, log), np.pi - gap, rtol=0, atol=2e-15)
    for t in (0.0, 0.3, 1.0):
        np.testing.assert_allclose(space.geodesic(p, q, t), space.exp(p, t * log), atol=1e-15)
    np.testing.assert_allclose(space.exp(p, log), q, atol=2e-15)
    curves = ss.CubicSpline(None, np.stack([p, q], axis=1), space)
    np.testing.assert_allclose(curves(1.0), q, atol=4e-15)
    # A curve's points are normalised, which turns the direction by as much as rounding is of the gap.
    np.testing.assert_allclose(curves(0.3), space.geodesic(p, q, 0.3), atol=4e-15 + 4 * EPS / gap)


@pytest.mark.parametrize("name", ["gr:2,5", "cgr:2,4", "gr:1,3", "rp:2", "cp:2"])
def test_b_splines_of_subspaces_that_reach_the_cut_locus(name):
    space, rng = ss.space(name), np.random.default_rng(1)
    for _ in range(5):
        p = space.random_point(rng)
        q = space.exp(p, space.injectivity_radius * (1 - 4e-15) * steep_tangent(space, p, rng))
        curve = ss.BSpline([0, 0, 1, 1], [p, q], 1, space)
        for nu in range(3):
            assert np.isfinite(curve(0.3, nu)).all()
        assert np.isclose(curve.speed(0.3), space.distance(p, q), atol=1e-12)


def rotation(angle, n=3):
    r = np.eye(n)
    r[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return r


def pose(angle, n=3):
    g = np.eye(n + 1)
    g[:n, :n], g[:n, n] = rotation(angle, n), angle
    return g


def plane(angle, n=5):
    """Principal angles 0.4 of it and all of it to the first two axes."""
    y = np.eye(n)[:, :2].copy()
    y[:, 0] = np.cos(0.4 * angle) * np.eye(n)[0] + np.sin(0.4 * angle) * np.eye(n)[2]
    y[:, 1] = np.cos(angle) * np.eye(n)[1] + np.sin(angle) * np.eye(n)[3]
    return y


def phases(*weights):
    return lambda angle: np.diag(np.exp(1j * angle * np.array(weights)))


# Points at an angle from the first, and the angle at which they meet its cut locus.
REACH = {
    "sphere:2": (lambda a: rotation(a)[0], np.pi),
    "rp:2": (lambda a: rotation(a)[0], np.pi / 2),
    "rp:1": (lambda a: rotation(a)[0, :2], np.pi / 2),
    "cp:1": (lambda a: rotation(a)[0, :2] * [1j, 1], np.pi / 2),
    "cp:2": (lambda a: rotation(a)[0] * 1j, np.pi / 2),
    "gr:1,3": (lambda a: rotation(a)[0][:, None], np.pi / 2),
    "gr:2,5": (plane, np.pi / 2),
    "cgr:2,5": (lambda a: 1j * plane(a), np.pi / 2),
    "so:2": (lambda a: rotation(a, 2), np.pi),
    "so:3": (rotation, np.pi),
    "so:5": (lambda a: rotation(a, 5), np.pi),
    "o:3": (lambda a: -rotation(a), np.pi),
    "u:1": (phases(1), np.pi),
    "u:2": (phases(1, -0.3), np.pi),
    "u:5": (phases(1, -0.3, 0, 0, 0.5), np.pi),
    "se:2": (lambda a: pose(a, 2), np.pi),
    "se:3": (pose, np.pi),
}

LIMIT = {np.pi: r"3\.14159\d*", np.pi / 2: r"1\.57079\d*", 2 * np.pi: r"6\.28318\d*"}


@pytest.mark.parametrize("name", REACH)
def test_points_at_the_cut_locus(name):
    at, limit = REACH[name]
    angle = LIMIT[limit]
    p = np.array([at(0), at(0.3 * limit), at(1.3 * limit)])
    match = rf"points\[1\] and points\[2\] lie at or past .*cut locus: angle {angle}, limit {angle}; put a point"
    fails(match, p, name, ss.CutLocusError)
    space = ss.space(name)
    with pytest.raises(ss.CutLocusError, match=rf"pair 1: .*angle {angle}, limit {angle}"):
        space.log(p[0], np.array([p[1], at(limit)]))
    raises(rf"pair 0: .*angle {angle}, limit {angle}", space.geodesic, p[1], p[2], 0.5, error=ss.CutLocusError)
    # Nearer is fine, and farther is nearer on the other side.
    ss.CubicSpline(None, np.array([at(0), at(0.9 * limit), at(1.8 * limit)]), name)
    ss.CubicSpline(None, np.array([at(0), at(1.2 * limit)]), name)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_special_unitary_matrices_at_the_cut_locus(n):
    """There the deciding angle is the spread of the phases."""
    phase = np.zeros(n)
    phase[:2] = np.pi, -np.pi
    p = np.array([np.eye(n), np.diag(np.exp(1j * phase))])
    match = r"points\[0\] and points\[1\] lie .*cut locus: angle 6\.28318\d*, limit 6\.28318\d*"
    fails(match, p, f"su:{n}", ss.CutLocusError)
    ss.CubicSpline(None, np.array([p[0], np.diag(np.exp(0.9j * phase))]), f"su:{n}")


@pytest.mark.parametrize("name", ["sphere:2", "gr:2,5"])
def test_control_points_that_are_too_far_apart(name):
    at, limit = REACH[name]
    good, bad = np.array([at(0), at(0.4), at(0.8)]), np.array([at(0), at(0.4), at(0.4 + limit)])
    lie = rf"lie at or past .*cut locus: angle {LIMIT[limit]}, limit {LIMIT[limit]}"
    raises(rf"control_points\[1\] and control_points\[2\] {lie}", ss.BezierCurve, bad, name, error=ss.CutLocusError)
    for batch, curve in ((np.stack([good, bad]), "1"), (np.stack([[good, good], [bad, good]]), "1,0")):
        match = rf"control_points\[1\] and control_points\[2\] of curve {curve} {lie}"
        raises(match, ss.BSpline, CLAMPED, batch, 2, name, error=ss.CutLocusError)


def turned(n, planes):
    """Half turns in so many planes."""
    return np.diag([-1.0] * 2 * planes + [1.0] * (n - 2 * planes))


def columns(n, k, shared=0):
    """Two subspaces at right angles but for what they share."""
    e = np.eye(n)
    return e[:, :k], np.hstack([e[:, :shared], e[:, k : 2 * k - shared]])


@pytest.mark.parametrize(
    "name, p, q, distance",
    [
        ("sphere:2", np.eye(3)[0], -np.eye(3)[0], np.pi),
        ("rp:2", *np.eye(3)[:2], np.pi / 2),
        ("cp:3", *np.eye(4)[:2], np.pi / 2),
        ("gr:1,2", *columns(2, 1), np.pi / 2),
        ("gr:2,4", *columns(4, 2), np.pi / np.sqrt(2)),
        ("gr:2,4", *columns(4, 2, 1), np.pi / 2),
        ("cgr:3,7", *columns(7, 3, 1), np.pi / np.sqrt(2)),
        ("gr:10,40", *columns(40, 10, 1), 3 * np.pi / 2),
        ("so:2", np.eye(2), turned(2, 1), np.pi),
        ("so:3", np.eye(3), turned(3, 1), np.pi),
        ("so:4", np.eye(4), turned(4, 1), np.pi),
        ("so:4", np.eye(4), turned(4, 2), np.sqrt(2) * np.pi),
        ("o:5", turned(5, 1), turned(5, 2), np.pi),
        ("so:12", np.eye(12), turned(12, 3), np.sqrt(3) * np.pi),
        ("u:2", np.eye(2), turned(2, 1), np.sqrt(2) * np.pi),
        ("se:3", np.eye(4), turned(4, 1), np.pi),
    ],
)
def test_points_at_the_cut_locus_have_a_distance(name, p, q, distance, rng):
    space = ss.space(name)
    raises("cut locus", space.log, p, q, error=ss.CutLocusError)
    assert space.distance(p, q) == pytest.approx(distance, abs=8 * EPS)
    # Beside others, which have a logarithm.
    near = space.exp(p, 0.1 * unit_tangent(space, p, rng))
    found = space.distance(np.stack([p, p, p]), np.stack([near, q, near]))
    assert found == pytest.approx([0.1, distance, 0.1], abs=20 * EPS)

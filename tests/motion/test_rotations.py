"""Curves of rotations: rates, quaternions and other forms, against SciPy and finite differences."""

import gc
import weakref

import numpy as np
import pytest
from curves import points_on
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline import rotations

SO3, SE3, BOTH = ss.SpecialOrthogonal(3), ss.SpecialEuclidean(3), ss.space("r:2 x so:3")
KNOTS = np.array([0.0, 0.7, 1.5, 3.0, 4.0, 4.5])
X = np.linspace(0.0, 4.5, 301)


def curve(space, batch=(), step=0.9, **options):
    return ss.CubicSpline(KNOTS, points_on(space, 6, batch, step=step), space, **options)


def turns(spline, x, **options):
    """The rotation matrices of a curve."""
    value = spline(x, **options)
    value = value[1] if isinstance(value, tuple) else value
    return value[..., :3, :3]


every_curve = pytest.mark.parametrize("space", [SO3, SE3, BOTH], ids=str)


def test_a_rotation_is_taken_wherever_points_are():
    r = Rotation.from_matrix(points_on(SO3))
    m = r.as_matrix()
    spline = ss.CubicSpline(KNOTS, m, SO3)
    assert ss.CubicSpline(KNOTS, r, "so:3") == spline
    assert ss.CubicSpline(KNOTS, list(r), "so:3") == spline
    assert ss.fit_many([(KNOTS, r)], "so:3") == [spline]
    assert np.array_equal(ss.fit(KNOTS, r, "so:3")[0], spline.velocities)
    assert np.array_equal(ss.evaluate(KNOTS, r, spline.velocities, SO3, X), spline(X))
    assert ss.BezierCurve(r, "so:3") == ss.BezierCurve(m, "so:3")
    flat = np.zeros((6, 2))
    assert ss.CubicSpline(KNOTS, (flat, r), BOTH) == ss.CubicSpline(KNOTS, (flat, m), BOTH)
    SO3.check_point(r)
    assert np.array_equal(SO3.project(r), SO3.project(m))
    assert np.array_equal(SO3.distance(r[0], r), SO3.distance(m[0], m))
    assert np.array_equal(SO3.log(r[0], list(r)), SO3.log(m[0], m))


def test_a_rotation_of_many_axes_is_a_batch():
    class Turn:
        """As SciPy has it since 1.17."""

        def __init__(self, m):
            self.m = m

        def as_matrix(self):
            return self.m

    m = points_on(SO3, batch=(2, 3))
    assert ss.CubicSpline(KNOTS, Turn(m), "so:3") == ss.CubicSpline(KNOTS, m, "so:3")


def test_a_rotation_raises_on_other_spaces():
    for space in ["so:2", "sphere:3", "se:3"]:
        with pytest.raises(ss.ValidationError):
            ss.CubicSpline(KNOTS, Rotation.from_matrix(points_on(SO3)), space)


@every_curve
@pytest.mark.parametrize("batch", [(), (2,)], ids=str)
def test_rates_are_derivatives_of_the_rotations(space, batch):
    spline, h = curve(space, batch), 1e-5
    x = (KNOTS[:-1, None] + np.diff(KNOTS)[:, None] * [0.1, 0.6]).ravel()
    r = turns(spline, x)
    change = r.swapaxes(-1, -2) @ (turns(spline, x + h) - turns(spline, x - h)) / (2 * h)
    omega = rotations.angular_velocity(spline, x)
    assert omega.shape == (*batch, 10, 3)
    assert np.abs(omega - np.stack([change[..., 2, 1], change[..., 0, 2], change[..., 1, 0]], -1)).max() < 1e-8
    for frame in ("body", "world"):
        ahead, behind = (rotations.angular_velocity(spline, y, frame) for y in (x + h, x - h))
        found = rotations.angular_acceleration(spline, x, frame)
        assert np.abs(found - (ahead - behind) / (2 * h)).max() < 1e-7
    world = rotations.angular_velocity(spline, x, "world")
    assert np.abs(np.einsum("...ij,...j", r, omega) - world).max() < 1e-13


@every_curve
@pytest.mark.parametrize("scalar_first", [True, False])
@pytest.mark.parametrize("step", [0.9, 2.6])
def test_quaternions_do_not_jump(space, scalar_first, step):
    spline = curve(space, step=step)
    x = np.linspace(0, 4.5, 20_001)
    q = rotations.quaternion(spline, x, scalar_first=scalar_first)
    assert np.abs(np.linalg.norm(q, axis=-1) - 1).max() < 1e-15
    assert ((q[1:] * q[:-1]).sum(axis=-1) > 0.999).all()
    assert q[0, 0 if scalar_first else 3] >= 0
    for found in (rotations.from_quaternions(q, scalar_first=scalar_first), rotations.rotation(spline, x).as_matrix()):
        assert np.abs(found - turns(spline, x)).max() < 2e-14


@pytest.mark.parametrize("space", [SO3, SE3], ids=str)
def test_knots_are_gone_through_once(monkeypatch, space):
    spline, above, gone = curve(space), rotations.matrix_to_quaternion, []
    expected = rotations.quaternion(curve(space), X, scalar_first=True)
    monkeypatch.setattr(rotations, "matrix_to_quaternion", lambda *a, **k: gone.append(1) or above(*a, **k))
    found = [rotations.quaternion(spline, x, scalar_first=True) for x in X]
    assert np.array_equal(found, expected) and len(gone) == 1
    # What is kept goes with the curve.
    kept = weakref.ref(spline)
    del spline
    gc.collect()
    assert kept() is None


@pytest.mark.parametrize("rounds", [1, 2])
@pytest.mark.parametrize("batch", [(), (2,)], ids=str)
def test_quaternions_of_a_closed_curve_go_on(rounds, batch):
    n = 6 * rounds
    angles = 2 * np.pi * rounds * np.arange(n + 1) / n
    wobble = 0.2 * np.sin(angles / rounds)
    points = Rotation.from_euler("ZX", np.stack([angles, wobble], axis=-1)).as_matrix()
    points[-1] = points[0]
    t = np.arange(n + 1.0) if not batch else np.stack([np.arange(n + 1.0), 2 * np.arange(n + 1.0) + 1])
    points = np.broadcast_to(points, (*batch, n + 1, 3, 3))
    spline = ss.CubicSpline(t, points, "so:3", bc_type="periodic")
    x = np.linspace(-2.5 * n, 3.5 * n, 20_001)
    q = rotations.quaternion(spline, x, scalar_first=True)
    assert q.shape == (*batch, len(x), 4)
    assert ((q[..., 1:, :] * q[..., :-1, :]).sum(axis=-1) > 0.99).all()
    assert np.abs(rotations.from_quaternions(q, scalar_first=True) - spline(x)).max() < 1e-13
    own = np.broadcast_to(x, (*batch, len(x)))
    assert np.array_equal(rotations.quaternion(spline, own, scalar_first=True, per_curve=True), q)
    # After an odd number of turns the sign is the other one.
    start, end = (rotations.quaternion(spline, t.T[i].T[..., None], scalar_first=True, per_curve=True) for i in (0, -1))
    assert np.abs(end - (-1) ** rounds * start).max() < 1e-14
    assert (start[..., 0] > 0.9).all()


def test_quaternions_follow_the_curve_and_not_its_chord():
    """Its points are 170° apart, its inner control points 227° on that way: the curve goes the other way round."""
    angle = np.radians([0, 170])
    points = rotations.from_rotation_vectors(np.outer(angle, [0, 0, 1]))
    back = rotations.velocities(points, [0, 0, -1.5])
    spline = ss.CubicSpline([0, 1], points, "so:3", bc_type=((1, back[0]), (1, back[1])))
    x = np.linspace(0, 1, 101)
    q = rotations.quaternion(spline, x, scalar_first=True)
    assert ((q[1:] * q[:-1]).sum(axis=-1) > 0.99).all()
    assert np.abs(rotations.from_quaternions(q, scalar_first=True) - spline(x)).max() < 1e-14


def test_dates_of_rotations():
    dates = np.array(["2020-01-01T00:00:00", "2020-01-01T00:00:02"], "M8[s]")
    spline = ss.CubicSpline(dates, rotations.from_rotation_vectors([[0, 0, 0], [0, 0, 1]]), "so:3")
    assert np.allclose(rotations.angular_velocity(spline, dates), [0, 0, 0.5], rtol=1e-14)


def test_forms_of_rotations():
    r = Rotation.random(1000, rng=5)
    m = r.as_matrix()
    assert np.abs(rotations.as_quaternions(r, scalar_first=False) - r.as_quat(canonical=True)).max() < 1e-15
    assert np.abs(rotations.as_quaternions(m, scalar_first=False) - r.as_quat(canonical=True)).max() < 1e-15
    v = rotations.as_rotation_vectors(m)
    assert np.abs(v - r.as_rotvec()).max() < 1e-14
    assert np.abs(rotations.from_rotation_vectors(v) - m).max() < 2e-15
    small = np.array([[0.0, 0, 0], [1e-9, 2e-12, 0], [3e-160, 0, 0], [0, np.pi, 0]])
    back = rotations.as_rotation_vectors(rotations.from_rotation_vectors(small))
    assert np.allclose(back, small, rtol=1e-15, atol=0)
    far = [0, 0, 100.0]
    assert np.abs(rotations.from_rotation_vectors(far) - Rotation.from_rotvec(far).as_matrix()).max() < 1e-13


@pytest.mark.parametrize(
    ("order", "entries"),
    [
        ("columns", [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)]),
        ("rows", [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]),
        ("interleaved", [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)]),
    ],
)
def test_six_numbers(order, entries):
    m = Rotation.random(100, rng=6).as_matrix().reshape(4, 25, 3, 3)
    six = rotations.as_rotation_6d(m, order=order)
    assert np.array_equal(six, np.stack([m[..., i, j] for i, j in entries], axis=-1))
    assert np.abs(rotations.from_rotation_6d(six, order=order) - m).max() < 2e-15
    # Any two vectors: the first keeps its direction, the second its half plane.
    raw = np.random.default_rng(0).standard_normal((50, 6))
    found = rotations.from_rotation_6d(raw, order=order)
    SO3.check_point(found)
    pairs = raw.reshape(50, 3, 2).swapaxes(1, 2) if order == "interleaved" else raw.reshape(50, 2, 3)
    a, b = pairs.swapaxes(0, 1)
    first, second, third = np.moveaxis(found, -2 if order == "rows" else -1, 0)
    assert np.allclose(first, a / np.linalg.norm(a, axis=-1, keepdims=True), rtol=0, atol=1e-15)
    assert ((second * b).sum(-1) > 0).all() and np.abs((third * b).sum(-1)).max() < 1e-14


def test_invalid_arguments_of_rotations_raise():
    for call, match in [
        (lambda s: rotations.angular_velocity(s, 0.5, "inertial"), "'body' or 'world', not 'inertial'"),
        (lambda s: rotations.quaternion(s, 0.5), "scalar_first"),
        (lambda s: rotations.as_quaternions(np.eye(3)), "scalar_first"),
        (lambda s: rotations.as_rotation_6d(np.eye(3)), "order='columns'"),
        (lambda s: rotations.from_rotation_6d(np.ones((2, 6)), order="rows"), r"numbers\[0\] are .* not parallel"),
        (lambda s: rotations.from_rotation_6d(np.zeros(6), order="rows"), "must be nonzero"),
        (lambda s: rotations.velocities(2 * np.eye(3), [0, 0, 1]), "off the space"),
        (lambda s: rotations.from_rotation_vectors([1, 2]), "vectors must be real"),
    ]:
        raises(match, call, curve(SO3))


def test_other_spaces_are_refused():
    for name in ("sphere:3", "so:2", "so:3 x so:3"):
        spline = ss.CubicSpline(KNOTS, points_on(ss.space(name)), name)
        raises("so:3", rotations.angular_velocity, spline, 0.5)
    raises("spline must be a curve", rotations.angular_velocity, Rotation.identity(3), 0.5, error=TypeError)


def test_quaternions_that_were_rounded():
    rounded = np.array([1, 1, 1, 0]) * (1 + 1e-6) / np.sqrt(3)
    raises("its length is", rotations.from_quaternions, rounded, scalar_first=True)
    found = rotations.from_quaternions(rounded, scalar_first=True, atol=1e-5)
    assert np.abs(found.T @ found - np.eye(3)).max() < 1e-15
    raises("atol must be a number from 0 to 1, not -1", rotations.from_quaternions, rounded, scalar_first=True, atol=-1)
    points, still = np.stack([rounded, rounded]), np.zeros((2, 4))
    raises("is off", ss.HermiteSpline, None, points, still, "sphere:3")
    assert np.linalg.norm(ss.HermiteSpline(None, points, still, "sphere:3", atol=1e-5)(0.5)) == pytest.approx(1)

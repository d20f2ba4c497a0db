"""SciPy's Rotation and RigidTransform of any shape, in and out, and twists as tangent vectors."""

import numpy as np
import pytest
from cases import loop_over
from curves import points_on
from refused import raises
from scipy.linalg import expm
from scipy.spatial import transform as scipy_transform
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline import poses, rotations

KNOTS = np.array([0.0, 0.7, 1.5, 3.0, 4.0, 4.5])
X = np.array([[0.0, 0.3, 1.4], [2.2, 3.5, 4.5]])
every_space = pytest.mark.parametrize("name", ["se:3", "so:3 x r:3", "r:3 x so:3"])


def rigid_transform():
    """The class of SciPy, or a skipped test."""
    if not hasattr(scipy_transform, "RigidTransform"):
        pytest.skip("SciPy before 1.16 has no RigidTransform")
    return scipy_transform.RigidTransform


def several_axes():
    """Skip the test if rotations of SciPy have one axis at most."""
    try:
        Rotation.from_quat(np.ones((2, 2, 4)))
    except ValueError:
        pytest.skip("Rotation of SciPy before 1.17 has one axis at most")


def curve(name, batch=()):
    return ss.CubicSpline(KNOTS, points_on(ss.space(name), 6, batch, step=0.7), name)


def matrices(spline, x):
    """Poses as 4 × 4 matrices."""
    value = spline(x)
    if not isinstance(value, tuple):
        return value
    r, p = value if value[0].shape[-2:] == (3, 3) and "so:3 x" in str(spline.space) else value[::-1]
    return poses.join(r, p)


# ---- objects of SciPy ----


@every_space
@loop_over("x", [1.0, X[0]])
def test_transforms_are_the_poses_of_the_curve(name, x):
    rigid_transform()
    spline = curve(name)
    found = poses.transform(spline, x)
    assert np.abs(found.as_matrix() - matrices(spline, x)).max() < 1e-14


@every_space
def test_transforms_of_batches_have_all_axes(name):
    rigid_transform()
    several_axes()
    spline = curve(name, (2,))
    found = poses.transform(spline, X)
    assert found.shape == (2, 2, 3)
    assert np.abs(found.as_matrix() - matrices(spline, X)).max() < 1e-14
    own = poses.transform(spline, X, per_curve=True)
    assert own.shape == (2, 3)
    assert np.abs(own.as_matrix()[1] - matrices(spline, X[1])[1]).max() < 1e-14


def test_transforms_restore_their_points():
    kind = rigid_transform()
    given = kind.from_matrix(points_on(ss.space("se:3"), 6))
    spline = ss.CubicSpline(KNOTS, given, "se:3")
    assert np.abs(poses.transform(spline, KNOTS).as_matrix() - given.as_matrix()).max() < 1e-14
    r, x = poses.split(given)
    product = ss.CubicSpline(KNOTS, (r, x), "so:3 x r:3")
    assert np.abs(poses.transform(product, KNOTS).as_matrix() - given.as_matrix()).max() < 1e-14


def test_values_that_are_nan_raise():
    rigid_transform()
    raises(r"value at index \[0\] is NaN", poses.transform, curve("se:3"), [-1.0], extrapolate=False)


@pytest.mark.parametrize("scalar_first", [True, False])
@loop_over("shape", [(), (7,), (2, 3)])
def test_quaternions_and_vectors_of_rotations_are_those_of_their_matrices(scalar_first, shape, rng):
    if len(shape) > 1:
        several_axes()
    turns = Rotation.from_quat(rng.standard_normal((*shape, 4)))
    found = rotations.as_quaternions(turns, scalar_first=scalar_first)
    other = rotations.as_quaternions(turns.as_matrix(), scalar_first=scalar_first)
    assert found.shape == (*shape, 4) and np.abs(found - other).max() < 1e-14
    vectors = rotations.as_rotation_vectors(turns)
    assert np.abs(vectors - rotations.as_rotation_vectors(turns.as_matrix())).max() < 1e-12
    raises("scalar_first is required", rotations.as_quaternions, turns)


# ---- twists ----


@pytest.mark.parametrize("frame", ["body", "world"])
def test_tangent_vectors_are_derivatives_of_motions_with_the_twist(frame, rng):
    g = points_on(ss.space("se:3"), 5)
    xi = rng.standard_normal((5, 6))
    h = 1e-6

    def moved(time):
        hat = np.zeros((5, 4, 4))
        hat[:, :3, 3] = xi[:, 3:]
        for (i, j), w in zip([(2, 1), (0, 2), (1, 0)], xi[:, :3].T, strict=True):
            hat[:, i, j], hat[:, j, i] = w, -w
        each = expm(time * hat)
        return g @ each if frame == "body" else each @ g

    change = (moved(h) - moved(-h)) / (2 * h)
    found = poses.velocities(g, xi, frame)
    assert np.abs(found - change).max() < 1e-8
    turning, moving = poses.velocities((g[:, :3, :3], g[:, :3, 3]), xi, frame)
    assert np.abs(turning - change[:, :3, :3]).max() < 1e-8
    assert np.abs(moving - change[:, :3, 3]).max() < 1e-8


@every_space
@pytest.mark.parametrize("frame", ["body", "world"])
def test_velocities_are_the_inverse_of_the_twist(name, frame):
    if name == "r:3 x so:3":
        pytest.skip("a pair is rotations and positions")
    spline = curve(name)
    found = poses.velocities(spline(KNOTS), poses.twist(spline, KNOTS, frame), frame)
    for own, expected in zip(
        found if isinstance(found, tuple) else [found],
        spline.velocities if isinstance(found, tuple) else [spline.velocities],
        strict=True,
    ):
        assert np.abs(own - expected).max() < 1e-12
    again = ss.HermiteSpline(KNOTS, spline.points, found, name)
    assert np.abs(matrices(again, X) - matrices(spline, X)).max() < 1e-12


def test_messages_name_the_conversion():
    g = points_on(ss.space("se:3"), 6)
    twist = [0, 0, 1, 0, 0, 1]
    for call in (
        lambda: ss.CubicSpline(KNOTS, g, "se:3", bc_type=((1, twist), "natural")),
        lambda: ss.HermiteSpline(KNOTS, g, np.tile(twist, (6, 1)), "se:3"),
    ):
        raises(r"symspline\.poses\.velocities\(poses, twists\) converts twists", call)


def test_invalid_twists_raise():
    g = points_on(ss.space("se:3"), 6)
    raises(
        r"twists must be real, of shape \(\.\.\., 6\), not real of shape \(6, 3\)",
        poses.velocities,
        g,
        np.zeros((6, 3)),
    )
    raises(r"twists", poses.velocities, g, np.full((6, 6), np.nan))
    raises(r"frame must be", poses.velocities, g, np.zeros(6), "space")
    raises(r"poses \(6, 4, 4\) and twists \(5, 6\) do not broadcast", poses.velocities, g, np.zeros((5, 6)))
    raises("off the space", poses.velocities, 2 * g, np.zeros(6))

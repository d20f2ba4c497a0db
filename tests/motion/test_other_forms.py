"""Rotations and poses in other forms: objects of SciPy, and messages that name the function that converts values."""

import io

import numpy as np
import pytest
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline import poses

T = np.array([0.0, 0.7, 1.5, 3.0])
TURNS = Rotation.from_rotvec([[0, 0, 0.4 * i] for i in range(4)])
Q, R = TURNS.as_quat(), TURNS.as_matrix()
X = np.array([[0.0, 0, 0], [1, 0, 0.5], [2, -1, 0], [2, 2, 2]])
G = poses.join(R, X)

FROM_QUATERNIONS = r"needs shape \(\.\.\., 3, 3\)\. symspline\.rotations\.from_quaternions converts quaternions"
VELOCITIES = r"symspline\.rotations\.velocities\(rotations, rates\) converts angular velocities"
JOIN = r"points is a pair of rotations and positions, but .* symspline\.poses\.join\(rotations, positions\) returns"


@pytest.mark.parametrize(
    "message, call",
    [
        (FROM_QUATERNIONS, lambda: ss.CubicSpline(T, Q, "so:3")),
        (FROM_QUATERNIONS, lambda: ss.make_smoothing_spline(T, Q, "so:3")),
        (r"factor 0.*" + FROM_QUATERNIONS, lambda: ss.CubicSpline(T, (Q, X), "so:3 x r:3")),
        (FROM_QUATERNIONS, lambda: ss.SpecialOrthogonal(3).log(R[0], Q[1])),
        (r"symspline\.rotations\.from_quaternions", lambda: poses.join(Q, X)),
        (r"rotations\.from_rotation_vectors", lambda: ss.CubicSpline(T, TURNS.as_rotvec(), "so:3")),
        (r"symspline\.poses\.split\(poses\)", lambda: ss.CubicSpline(T, G, "so:3")),
        (JOIN, lambda: ss.CubicSpline(T, (R, X), "se:3")),
        (JOIN, lambda: ss.CubicSpline(T, (TURNS, X), "se:3")),
        (JOIN, lambda: ss.CubicSpline(T, (R.tolist(), X.tolist()), "se:3")),
        (JOIN, lambda: ss.CubicSpline(T, (Q, X), "se:3")),
        (r"poses\.join.*rotations\.from_quaternions", lambda: ss.CubicSpline(T, np.hstack([X, Q]), "se:3")),
        (r"symspline\.poses\.join\(rotations", lambda: ss.CubicSpline(T, R, "se:3")),
        (
            r"the start velocity has shape \(3,\).*" + VELOCITIES,
            lambda: ss.CubicSpline(T, R, "so:3", bc_type=((1, [0, 0, 1]), "natural")),
        ),
        (VELOCITIES, lambda: ss.HermiteSpline(T, R, np.zeros((4, 3)), "so:3")),
        (VELOCITIES, lambda: ss.SpecialOrthogonal(3).exp(R[0], [0, 0, 1])),
    ],
)
def test_messages_about_points_name_the_conversion(message, call):
    raises(message, call)


def test_messages_of_other_dimensions_name_none():
    for space, shape in [("so:4", (5, 3)), ("so:2", (4, 4, 3)), ("se:2", (3, 7))]:
        with pytest.raises(ss.ValidationError) as caught:
            ss.CubicSpline(None, np.zeros(shape), space)
        assert "rotations." not in str(caught.value) and "poses." not in str(caught.value)


def test_a_tuple_of_two_poses_is_a_list_of_points():
    curve = ss.CubicSpline(None, (G[0], G[1]), "se:3")
    assert np.array_equal(curve.points, G[:2])
    assert np.array_equal(ss.CubicSpline(None, tuple(map(tuple, G[:2].tolist())), "se:3").points, G[:2])


def test_rigid_transforms():
    transforms = pytest.importorskip("scipy.spatial.transform")
    if not hasattr(transforms, "RigidTransform"):
        pytest.skip("SciPy before 1.16 has no RigidTransform")
    rigid = transforms.RigidTransform.from_components(X, TURNS)
    expected = ss.CubicSpline(T, rigid.as_matrix(), "se:3")
    for given in (rigid, list(rigid)):
        curve = ss.CubicSpline(T, given, "se:3")
        assert np.array_equal(curve.points, expected.points)
    back = transforms.RigidTransform.from_matrix(curve(T))
    assert np.abs(back.as_matrix() - rigid.as_matrix()).max() < 1e-15
    rotations, positions = poses.split(rigid)
    assert np.array_equal(positions, X) and np.abs(rotations - R).max() < 1e-15
    files = [io.StringIO(), io.StringIO()]
    poses.write_tum(files[0], T, rigid)
    poses.write_tum(files[1], T, rigid.as_matrix())
    assert files[0].getvalue() == files[1].getvalue()

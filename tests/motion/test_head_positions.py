"""Head positions of magnetoencephalography. Kept numbers are from MNE-Python 1.13.2."""

import io

import numpy as np
import pytest
from refused import raises

import symspline as ss
from symspline import poses

# A file as MaxFilter writes it, by mne.chpi.write_head_pos.
FILE = """\
 Time       q1       q2       q3       q4       q5       q6       g-value  error    velocity
     9.000  0.02150  0.07310 -0.01220  0.00120 -0.00330  0.04810  0.99870  0.10200  0.00000
     9.523  0.02210  0.07450 -0.01180  0.00150 -0.00310  0.04840  0.99910  0.09800  0.08900
    10.031  0.30110 -0.52010  0.44320  0.00200 -0.00280  0.04880  0.98760  0.23000  0.14100
    12.640  0.70711  0.00000  0.70711  0.00250 -0.00270  0.04900  0.97110  0.31000  0.02100
"""
# mne.transforms.quat_to_rot of the third line.
THIRD = [
    [0.06613950000000013, -0.9027825305104515, -0.4249814927086776],
    [0.27637409051045153, 0.42582510000000007, -0.8615627349790094],
    [0.9587715727086775, -0.060470545020990585, 0.2776695600000001],
]


def test_poses_are_those_of_mne():
    t, (rotations, positions) = poses.read_head_pos(io.StringIO(FILE))
    np.testing.assert_array_equal(t, [9, 9.523, 10.031, 12.64])
    np.testing.assert_allclose(rotations[2], THIRD, atol=1e-12)
    np.testing.assert_array_equal(positions[1], [0.0015, -0.0031, 0.0484])
    array = np.loadtxt(io.StringIO(FILE), skiprows=1)
    for given in (array, io.StringIO("\n".join(FILE.splitlines()[1:]))):
        again = poses.read_head_pos(given)
        np.testing.assert_array_equal(again[0], t)
        np.testing.assert_array_equal(again[1][0], rotations)
    spline = ss.CubicSpline(t[:3], (rotations[:3], positions[:3]), "so:3 x r:3")
    np.testing.assert_allclose(spline(9.523)[1], positions[1], atol=1e-15)


def test_files_restore_every_number(tmp_path):
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.2, 2, 50))
    # Scalar parts of both signs, and turns by nearly 180 degrees, for which the scalar part has an error of 1e-8.
    rotations = ss.rotations.from_rotation_vectors(rng.uniform(-2, 2, (50, 3)))
    rotations[7] = ss.rotations.from_rotation_vectors([np.pi - 1e-3, 0, 0])
    x = rng.normal(0, 0.01, (50, 3))
    path = tmp_path / "head.pos"
    poses.write_head_pos(path, t, (rotations, x), gof=rng.uniform(0.9, 1, 50), error=0.2)
    again, (r, y) = poses.read_head_pos(path)
    np.testing.assert_array_equal(again, t)
    np.testing.assert_array_equal(y, x)
    np.testing.assert_allclose(r, rotations, atol=1e-12)
    rows = np.loadtxt(path, skiprows=1)
    assert rows.shape == (50, 10) and (rows[:, 8] == 0.2).all() and rows[:, 7].min() >= 0.9
    np.testing.assert_allclose(rows[1, 9], 100 * np.linalg.norm(x[1] - x[0]) / (t[1] - t[0]), rtol=1e-12)
    # The formula of MNE-Python, written out for the matrix of a unit quaternion.
    b, c, d = rows[:, 1], rows[:, 2], rows[:, 3]
    a = np.sqrt(np.maximum(1 - b * b - c * c - d * d, 0))
    np.testing.assert_allclose(rotations[:, 0, 1], 2 * (b * c - a * d), atol=1e-9)
    np.testing.assert_allclose(rotations[:, 2, 0], 2 * (b * d - a * c), atol=1e-9)
    poses.write_head_pos(path, t, poses.join(rotations, x))
    np.testing.assert_array_equal(poses.read_head_pos(path)[1][1], x)


def test_mne_reads_the_files(tmp_path):
    mne = pytest.importorskip("mne")
    rng = np.random.default_rng(4)
    rotations = ss.rotations.from_rotation_vectors(rng.uniform(-1, 1, (20, 3)))
    path = tmp_path / "head.pos"
    poses.write_head_pos(path, np.arange(20) / 2, (rotations, rng.normal(size=(20, 3))))
    quats = mne.chpi.read_head_pos(path)
    translation, rotation, t = mne.chpi.head_pos_to_trans_rot_t(quats)
    again, (r, x) = poses.read_head_pos(quats)
    np.testing.assert_allclose(r, rotation, atol=1e-12)
    np.testing.assert_array_equal(x, translation)
    np.testing.assert_array_equal(again, t)


def test_invalid_head_positions_raise():
    read = poses.read_head_pos
    raises(r"line 2: 9 numbers, but a line of head positions has 10", read, io.StringIO("Time\n" + "0 " * 9))
    raises("line 3: q1, q2 and q3 have length 1.2", read, io.StringIO(FILE.splitlines()[0] + "\n\n0 0 1.2" + " 0" * 7))
    raises("row 1: q1, q2 and q3 have length 2", read, np.array([[0.0] * 10, [1.0, 2.0] + [0.0] * 8]))
    raises(r"file must be an array of numbers of shape \(n, 10\)", read, np.zeros((2, 9)))
    raises("file.*is not finite|not finite", read, np.full((1, 10), np.nan))
    raises("is empty", read, io.StringIO(FILE.splitlines()[0]))
    out, eye = io.StringIO(), (np.stack([np.eye(3)] * 2), np.zeros((2, 3)))
    raises(r"t\[1\] is 0.0, which is not after", poses.write_head_pos, out, [0.0, 0.0], eye)
    raises("gof must be a number or an array of shape", poses.write_head_pos, out, [0, 1], eye, gof=[1.0] * 3)
    raises("error must be finite", lambda: poses.write_head_pos(out, [0, 1], eye, error=np.nan))
    raises("t has shape", poses.write_head_pos, out, [0], eye)

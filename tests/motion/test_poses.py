"""Velocities and accelerations of poses against closed forms and finite differences; files of poses."""

import io
from functools import partial

import numpy as np
import pandas as pd
import pytest
from curves import core_calls, points_on
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline import poses, rotations

KNOTS = np.array([0.0, 0.7, 1.5, 3.0, 4.0, 4.5])
INNER = (KNOTS[:-1, None] + np.diff(KNOTS)[:, None] * [0.1, 0.6]).ravel()

every_space = pytest.mark.parametrize("name", ["se:3", "so:3 x r:3", "r:3 x sphere:2 x so:3"])


def curve(name, batch=()):
    return ss.CubicSpline(KNOTS, points_on(ss.space(name), 6, batch, step=0.7), name)


def pose(spline, x, nu=0):
    """Rotation and position, or their derivatives, as 4 × 4 matrices."""
    value = spline(x, nu=nu)
    if not isinstance(value, tuple):
        return value
    r, p = (
        next(v for v, f in zip(value, spline.space.factors, strict=True) if str(f) == n)
        for n in ("so:3", "euclidean:3")
    )
    return poses.join(r, p)


@every_space
@pytest.mark.parametrize("batch", [(), (2,)], ids=str)
def test_velocity_and_acceleration_are_derivatives(name, batch):
    spline, h = curve(name, batch), 1e-4
    before, here, after = (pose(spline, INNER + k * h)[..., :3, 3] for k in (-1, 0, 1))
    r = pose(spline, INNER)[..., :3, :3]
    v, a = poses.linear_velocity(spline, INNER), poses.linear_acceleration(spline, INNER)
    assert v.shape == a.shape == (*batch, len(INNER), 3)
    assert np.abs(v - (after - before) / (2 * h)).max() < 3e-7
    assert np.abs(a - (after - 2 * here + before) / h**2).max() < 3e-6
    for world, call in ((v, poses.linear_velocity), (a, poses.linear_acceleration)):
        assert np.abs(call(spline, INNER, "body") - np.einsum("...ji,...j", r, world)).max() < 1e-13


@every_space
def test_twist_is_that_of_the_matrices(name):
    spline = curve(name)
    inverse = np.linalg.inv(pose(spline, INNER))
    h = 1e-5
    change = (pose(spline, INNER + h) - pose(spline, INNER - h)) / (2 * h)
    for frame, hat in (("body", inverse @ change), ("world", change @ inverse)):
        expected = np.stack([hat[:, 2, 1], hat[:, 0, 2], hat[:, 1, 0], *hat[:, :3, 3].T], axis=-1)
        assert np.abs(poses.twist(spline, INNER, frame) - expected).max() < 1e-8
    assert np.abs(poses.twist(spline, INNER)[:, :3] - rotations.angular_velocity(spline, INNER)).max() < 1e-13


def circle(n=40):
    """A body that drives round a circle of radius 2 at 0.5 rad/s, and looks ahead."""
    t = np.linspace(0, 10, n)
    angle = 0.5 * t
    r = Rotation.from_rotvec(angle[:, None] * [0, 0, 1]).as_matrix()
    return t, poses.join(r, 2 * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * t], axis=-1))


def test_a_drive_round_a_circle():
    # In SE(3) it is a geodesic, so that nu=2 is zero, and ẍ is not.
    spline = ss.CubicSpline(*circle(), "se:3")
    x = np.linspace(0, 10, 101)
    assert np.abs(spline(x, nu=2)).max() < 1e-12
    assert np.abs(poses.linear_acceleration(spline, x, "body") - [0, 0.5, 0]).max() < 1e-12
    assert np.abs(poses.twist(spline, x) - [0, 0, 0.5, 1, 0, 0]).max() < 1e-13
    # The axis of the screw is at (0, 2, 0): the point of the body at the origin moves with −ω × (0, 2, 0).
    assert np.abs(poses.twist(spline, x, "world") - [0, 0, 0.5, 1, 0, 0]).max() < 1e-13
    gyro, force = poses.imu(spline, x)
    assert np.abs(gyro - [0, 0, 0.5]).max() < 1e-13
    assert np.abs(force - [0, 0.5, 9.80665]).max() < 1e-12


def test_a_sensor_that_falls_measures_nothing():
    t = np.linspace(0, 1, 5)
    r = Rotation.from_rotvec(np.outer(t, [0.3, -0.2, 0.5])).as_matrix()
    fall = np.array([1.0, 2, 3]) * t[:, None] + 0.5 * np.array([1.0, 0, -9]) * t[:, None] ** 2
    ends = ((2, (np.zeros((3, 3)), [1.0, 0, -9])),) * 2
    spline = ss.CubicSpline(t, (r, fall), "so:3 x r:3", bc_type=ends)
    x = np.linspace(0, 1, 33)
    assert np.abs(poses.imu(spline, x, gravity=(1, 0, -9)).specific_force).max() < 1e-12


@every_space
def test_a_sensor_measures_in_its_own_axes(name):
    spline = curve(name)
    gyro, force = poses.imu(spline, INNER)
    r = pose(spline, INNER)[..., :3, :3]
    rate = rotations.angular_velocity(spline, INNER, "world")
    assert np.allclose(np.einsum("nij,nj->ni", r, gyro), rate, rtol=0, atol=1e-13)
    # What turns about several axes does so in others.
    assert np.abs(gyro - rate).max() > 0.1
    up = poses.linear_acceleration(spline, INNER) - np.array([0, 0, -9.80665])
    assert np.allclose(np.einsum("nij,nj->ni", r, force), up, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["so:3", "se:3", "so:3 x r:3", "r:3 x sphere:2 x so:3"])
def test_calls_are_those_of_a_spline(name):
    spline = curve(name, (2,))
    calls = [rotations.angular_velocity, partial(rotations.quaternion, scalar_first=True)]
    if name != "so:3":
        calls += [poses.twist, poses.linear_acceleration, lambda *a, **k: poses.imu(*a, **k).specific_force]
    for call in calls:
        both = call(spline, INNER)
        assert np.array_equal(call(spline, np.stack([INNER, INNER]), per_curve=True), both)
        assert np.array_equal(call(spline[1], INNER), both[1])
        assert np.array_equal(call(spline, INNER[7]), both[:, 7])
        raises("outside", call, spline, 5.0)
        assert np.isfinite(call(spline, 5.0, extrapolate="geodesic")).all()


def test_spaces_without_poses_are_refused():
    for name in ["so:3", "r:3", "so:3 x r:2", "so:3 x r:3 x r:3", "se:3 x r:3"]:
        spline = ss.CubicSpline(KNOTS, points_on(ss.space(name)), name)
        for call in (poses.twist, poses.linear_velocity, poses.linear_acceleration, poses.imu):
            raises("so:3", call, spline, 0.5)


def test_invalid_frames_gravity_and_curves_raise():
    for call in (poses.twist, poses.linear_velocity, poses.linear_acceleration):
        raises("'body' or 'world'", call, curve("se:3"), 0.5, "camera")
    for gravity in (9.81, (0, 0), (0, 0, np.nan), ("a", "b", "c")):
        raises("gravity must be three numbers", poses.imu, curve("se:3"), 0.5, gravity=gravity)
    with pytest.raises(TypeError, match=r"spline must be a curve with knots and .*CubicSpline, .*, not <BezierCurve"):
        poses.imu(ss.BezierCurve(np.stack([np.eye(4)] * 4), "se:3"), 0.5)


def test_nanoseconds_are_not_seconds():
    given = curve("se:3").points
    stamps = 1_700_000_000_000_000_000 + 10**9 * np.arange(len(given))
    with pytest.raises(ss.ValidationError, match=r"cannot be seconds; convert nanoseconds to dates"):
        poses.imu(ss.CubicSpline(stamps, given, "se:3"), stamps[0])
    stamps = stamps.astype("M8[ns]")
    dated, plain = (poses.imu(ss.CubicSpline(t, list(given), "se:3"), x) for t, x in ((stamps, stamps[1]), (None, 1)))
    assert np.abs(dated.specific_force - plain.specific_force).max() < 1e-12


def test_a_retimed_curve_has_the_signals_of_its_motion():
    spline = curve("se:3")
    slow = spline.retime(lambda x, nu=0: [x**2 / 4, x / 2, 0.5 + 0 * x][nu], domain=(0.5, 4))
    h, x = 1e-4, np.linspace(1, 3.5, 7)
    before, here, after = (slow(x + k * h)[..., :3, 3] for k in (-1, 0, 1))
    assert np.abs(poses.linear_velocity(slow, x) - (after - before) / (2 * h)).max() < 3e-7
    assert np.abs(poses.linear_acceleration(slow, x) - (after - 2 * here + before) / h**2).max() < 3e-6


def test_nothing_is_evaluated_twice():
    for name, call, most in [
        ("se:3", poses.imu, 1),
        ("so:3 x r:3", poses.imu, 3),
        ("se:3", poses.twist, 1),
        ("so:3 x r:3", poses.linear_velocity, 1),
    ]:
        assert 1 <= core_calls("evaluate", partial(call, curve(name), INNER)) <= most


def recording(n=50, seed=4):
    rng = np.random.default_rng(seed)
    t = 1305031102.1758 + np.cumsum(rng.uniform(0.005, 0.02, n))
    return t, poses.join(Rotation.random(n, rng=rng), 10 * rng.standard_normal((n, 3)))


def absolute_pose_error(a, b):
    """As evo_ape with pose_relation full: |A⁻¹B − 1| of every pose."""
    return np.linalg.norm(np.linalg.inv(a) @ b - np.eye(4), axis=(-2, -1))


@pytest.mark.parametrize("form", ["path", "text", "open"])
def test_a_tum_file_goes_in_and_comes_out(tmp_path, form):
    t, given = recording()
    file = {"path": tmp_path / "a.txt", "text": str(tmp_path / "a.txt"), "open": io.StringIO()}[form]
    poses.write_tum(file, t, given)
    if form == "open":
        file.seek(0)
    times, found = poses.read_tum(file)
    assert np.array_equal(times, t)
    assert np.array_equal(found[:, :3, 3], given[:, :3, 3])
    assert absolute_pose_error(given, found).max() < 1e-14
    if form == "path":
        # As NumPy and SciPy read it.
        table = np.loadtxt(file)
        assert np.array_equal(table[:, :4], np.column_stack([t, given[:, :3, 3]]))
        assert np.abs(Rotation.from_quat(table[:, 4:]).as_matrix() - given[:, :3, :3]).max() < 2e-15


def test_kitti_files(tmp_path):
    t, given = recording()
    poses.write_kitti(tmp_path / "a.txt", given)
    (tmp_path / "times.txt").write_text("".join(f"{x!r}\n" for x in t.tolist()))
    times, found = poses.read_kitti(tmp_path / "a.txt", tmp_path / "times.txt")
    assert np.array_equal(times, t) and absolute_pose_error(given, found).max() < 1e-14
    assert np.array_equal(poses.read_kitti(tmp_path / "a.txt")[0], np.arange(50))
    # As in the benchmark's files, with seven digits.
    np.savetxt(tmp_path / "b.txt", given[:, :3].reshape(-1, 12), fmt="%.6e")
    _, rounded = poses.read_kitti(tmp_path / "b.txt")
    ss.SpecialEuclidean(3).check_point(rounded)
    assert absolute_pose_error(given, rounded).max() < 1e-4


def test_euroc_files(tmp_path):
    _, given = recording()
    t = np.datetime64(1403636579758555392, "ns") + np.arange(50) * np.timedelta64(5_000_001, "ns")
    poses.write_euroc(tmp_path / "a.csv", t, given)
    times, found = poses.read_euroc(tmp_path / "a.csv")
    assert np.array_equal(times, t) and times.dtype == "M8[ns]"
    assert absolute_pose_error(given, found).max() < 1e-14
    # The data sets' ground truth has velocities and biases besides.
    lines = (tmp_path / "a.csv").read_text().splitlines()
    wide = "\n".join([lines[0] + ", v", *(line + ",0.1,0.2,0.3" for line in lines[1:])])
    assert np.array_equal(poses.read_euroc(io.StringIO(wide))[1], found)
    seconds = (t - np.datetime64(0, "s")) / np.timedelta64(1, "s")
    # To the nearest nanosecond: products are a little below some of these.
    few = np.arange(1000, 1000 + len(given))
    file = io.StringIO()
    poses.write_euroc(file, few / 1e9, given)
    file.seek(0)
    assert np.array_equal(poses.read_euroc(file)[0].astype(int), few)
    poses.write_euroc(tmp_path / "b.csv", seconds, given)
    assert np.abs(poses.read_euroc(tmp_path / "b.csv")[0] - t).max() < np.timedelta64(300, "ns")


def test_invalid_files_raise():
    for read, text, match in [
        (poses.read_tum, "# nothing\n", "no numbers"),
        (poses.read_tum, "\n0 0 0 0 0 0 1\n", "line 2: 7 numbers, but a line of a TUM trajectory has 8: time tx"),
        (poses.read_tum, "# x\n0 0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n", "the file, line 3: 7 numbers, but a line"),
        (poses.read_tum, "# x\n0 0 0 0 0 0 0 one\n", "line 2: column 'qw' holds 'one', which is not a number"),
        (poses.read_tum, "0 0 0 0 0 0 0 1\n\n1 0 0 nan 0 0 0 1\n", "line 3: column 'tz' holds nan"),
        (poses.read_tum, "0 0 0 0 0 0 0 1\n# x\n1 0 0 0 0 0 1 1\n", r"line 3: the quaternion has length 1\.41421"),
        (poses.read_euroc, "# x\n1,0,0,0,1,1,0,0\n", r"line 2: the quaternion has length 1\.41421, not 1"),
        (poses.read_kitti, "1 0 0 0 0 1 0 0 0 0 1\n", "line 1: 11 numbers, but KITTI poses"),
        (poses.read_kitti, "1 0 0 0 0 1 0 0 0 0 -1 0\n", r"pose \[0\] has no rotation"),
        (poses.read_euroc, "1.5,0,0,0,1,0,0,0\n", "nanoseconds"),
        (poses.read_euroc, "1,0,0,0,1\n", "nanoseconds"),
    ]:
        raises(match, read, io.StringIO(text))


def test_invalid_poses_raise(tmp_path):
    for call, match in [
        (lambda f: poses.write_tum(f, [0.0], np.stack([np.eye(4)] * 2)), r"t has shape \(1,\), but there are 2 poses"),
        (lambda f: poses.write_tum(f, ["a", "b"], np.stack([np.eye(4)] * 2)), r"t\[0\] is 'a', not a date"),
        (lambda f: poses.write_tum(f, [True, False], np.stack([np.eye(4)] * 2)), "numbers or datetime64"),
        (lambda f: poses.write_tum(f, [0.0], 2 * np.eye(4)[None]), "off the space"),
        (lambda f: poses.write_kitti(f, np.eye(4)), r"\(n, 4, 4\)"),
        (lambda f: poses.join(np.eye(3), np.zeros((2, 3))), r"\(3, 3\) and \(2, 3\)"),
        (lambda f: poses.split(np.eye(3)), r"\(\.\.\., 4, 4\)"),
    ]:
        raises(match, call, tmp_path / "a.txt")
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("write", [poses.write_tum, poses.write_euroc])
@pytest.mark.parametrize("scale", [10**9, 1e9, 1e3])
def test_nanoseconds_in_files_raise(write, scale):
    given = curve("se:3").points
    t = scale * (1_700_000_000 + np.arange(len(given)))
    raises(r"t\[0\] is 1.*, which cannot be seconds; convert nanoseconds", write, io.StringIO(), t, given)
    raises(r"time\[0\] is 1.*, which cannot be seconds", poses.read_tum, io.StringIO(f"{t[0]} 0 0 0 0 0 0 1\n"))


def test_the_mark_that_windows_puts_at_the_start_of_a_file_is_skipped():
    assert poses.read_tum(io.StringIO("\ufeff0 0 0 0 0 0 0 1\n"))[0] == [0]


@pytest.mark.parametrize("write", [poses.write_tum, poses.write_euroc])
def test_times_to_write_in_any_form(write):
    given = curve("se:3").points[:2]
    texts = []
    for t in (
        ["2023-11-14T22:13:20Z", "2023-11-14T22:13:21Z"],
        pd.to_datetime(["2023-11-14T22:13:20", "2023-11-14T22:13:21"], utc=True),
        np.array(["2023-11-14T22:13:20", "2023-11-14T22:13:21"], "M8[ms]"),
        [1_700_000_000, 1_700_000_001],
    ):
        file = io.StringIO()
        write(file, t, given)
        texts.append(file.getvalue())
    assert len(set(texts)) == 1
    raises(r"t\[1\] is nan, which is not a time", write, io.StringIO(), [0, np.nan], given)

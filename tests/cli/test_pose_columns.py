"""Rotations as quaternions in columns, poses, and TUM trajectories."""

from pathlib import Path

import numpy as np
import pytest
from curves import points_on
from scipy.spatial.transform import Rotation
from tabular import TIMES, numbers, table, write, write_table

import symspline as ss
from symspline.rotations import from_quaternions

WXYZ = ["qw", "qx", "qy", "qz"]
# More than a whole turn, so that signs of quaternions with w >= 0 jump.
TURNS = Rotation.from_rotvec(np.add(np.outer([0, 1.4, 2.7, 3.8, 5.5, 7.2], [0.36, 0.48, 0.8]), [0.1, 0, 0.02]))
Q = TURNS.as_quat(scalar_first=True)
PLACES = np.random.default_rng(0).normal(size=(6, 3)).cumsum(0)


def poses():
    p = np.zeros((6, 4, 4))
    p[:, :3, :3], p[:, :3, 3], p[:, 3, 3] = from_quaternions(Q, scalar_first=True), PLACES, 1
    return p


def columns(**more):
    return {"t": TIMES, **dict(zip(WXYZ, Q.T, strict=True)), **more}


def test_quaternions_by_their_names_in_any_order(run):
    for names in [WXYZ, ["rot_W", "rot_X", "rot_Y", "rot_Z"], [*"wxyz"], ["q.w []", "q.x []", "q.y []", "q.z []"]]:
        for order in [[0, 1, 2, 3], [1, 2, 3, 0], [2, 0, 3, 1]]:
            write_table("a.csv", {"t": TIMES, **{names[i]: Q[:, i] for i in order}})
            run("fit a.csv --space so:3 -o a.npz")
            spline = ss.load("a.npz")
            np.testing.assert_allclose(spline.points, TURNS.as_matrix(), atol=1e-15)
            run("check a.npz")
            run("sample a.npz -n 200 -o b.csv")
            assert list(table("b.csv")) == ["t", *(names[i] for i in order)]
            q = numbers(table("b.csv"), *names)
            x = np.linspace(0, 5, 200)
            np.testing.assert_allclose(Rotation.from_quat(q, scalar_first=True).as_matrix(), spline(x), atol=1e-14)
            assert ((q[1:] * q[:-1]).sum(1) > 0.99).all() and q[0, 0] >= 0 > q[:, 0].min()


def test_derivatives_of_quaternions_are_angular_velocities(run):
    """In the frame of the body, compared with finite differences of SciPy's rotations."""
    write_table("a.csv", columns())
    run("fit a.csv --space so:3 -o b.npz")
    run("sample b.npz -n 100 --nu 0,1,2 -o c.csv")
    found, h = table("c.csv"), 1e-4
    assert list(found) == ["t", *WXYZ, "wx", "wy", "wz", "wx_d1", "wy_d1", "wz_d1"]
    spline, x = ss.load("b.npz"), np.linspace(0, 5, 100)[1:-1]

    def rates(x):
        before, after = (Rotation.from_matrix(spline(x + step)) for step in (-h / 2, h / 2))
        return (before.inv() * after).as_rotvec() / h

    np.testing.assert_allclose(numbers(found, "wx", "wy", "wz")[1:-1], rates(x), atol=1e-6)
    change = (rates(x + h / 2) - rates(x - h / 2)) / h
    # The acceleration has kinks at the knots.
    away = np.abs(x[:, None] - TIMES).min(axis=1) > 2 * h
    np.testing.assert_allclose(numbers(found, "wx_d1", "wy_d1", "wz_d1")[1:-1][away], change[away], atol=1e-4)


@pytest.mark.parametrize("space", ["se:3", "so:3 x r:3", "r:3 x so:3"])
def test_poses_of_columns(run, space):
    write_table("a.csv", columns(ty=PLACES[:, 1], tx=PLACES[:, 0], tz=PLACES[:, 2]))
    run(f"fit a.csv --space '{space}' -o a.npz")
    spline = ss.load("a.npz")
    p = poses()
    given = {"se:3": p, "so:3 x r:3": (p[:, :3, :3], PLACES), "r:3 x so:3": (PLACES, p[:, :3, :3])}[space]
    expected = ss.CubicSpline(TIMES, given, space)
    x = np.linspace(0, 5, 40)
    run("sample a.npz -n 40 --nu 0,1,2 -o b.csv")
    found = table("b.csv")
    for nu, mark in enumerate(("", "_d1", "_d2")):
        values = expected(x, nu)
        way = values[:, :3, 3] if space == "se:3" else values[space.split(" x ").index("r:3")]
        np.testing.assert_allclose(numbers(found, *(f"t{i}{mark}" for i in "xyz")), way, atol=1e-12)
    turn = Rotation.from_quat(numbers(found, *WXYZ), scalar_first=True).as_matrix()
    own = spline(x)[:, :3, :3] if space == "se:3" else spline(x)[space.split(" x ").index("so:3")]
    np.testing.assert_allclose(turn, own, atol=1e-14)


def test_order_of_quaternions_from_the_option(run, fails):
    write_table("a.csv", {"t": TIMES, **{f"q{i}": Q[:, i] for i in range(4)}})
    problem = fails("fit a.csv --space so:3 -o a.npz")
    assert problem.startswith("q0, q1, q2, q3 may be a quaternion, but the names do not say which number is which")
    run("fit a.csv --space so:3 --quaternion wxyz -o a.npz")
    np.testing.assert_allclose(ss.load("a.npz").points, TURNS.as_matrix(), atol=1e-15)
    run("fit a.csv --space so:3 --quaternion xyzw --columns q1,q2,q3,q0 -o b.npz")
    assert ss.load("b.npz") == ss.load("a.npz")
    write_table("a.csv", columns())
    problem = fails("fit a.csv --space so:3 --quaternion xyzw -o c.npz")
    assert problem.startswith("--quaternion xyzw contradicts the names qw, qx, qy, qz")
    run("fit a.csv --space so:3 --quaternion wxyz -o a.npz")
    assert "--quaternion is for so:3, se:3" in fails("fit a.csv --space s:3 --quaternion wxyz -o c.npz")
    assert "are not the 4 numbers of a quaternion" in fails(
        "fit a.csv --space so:3 --quaternion wxyz --columns qw,qx -o c.npz"
    )
    write_table("b.csv", columns(x=PLACES[:, 0]))
    assert "row by row, or 4 numbers with a quaternion, and there are 5 columns: qw, qx, qy, qz, x; say which" in fails(
        "fit b.csv --space so:3 -o c.npz"
    )
    # On the sphere of quaternions they are what they were.
    run("fit a.csv --space sphere:3 -o a.npz")


def test_rounded_and_invalid_quaternions(run, fails):
    write_table("a.csv", {"t": TIMES, **dict(zip(WXYZ, Q.round(6).T, strict=True))})
    run("fit a.csv --space so:3 -o a.npz")
    np.testing.assert_allclose(ss.load("a.npz").points, TURNS.as_matrix(), atol=5e-6)
    write_table("a.csv", {"t": TIMES, **dict(zip(WXYZ, Q.round(3).T, strict=True))})
    run("fit a.csv --space so:3 -o a.npz")
    np.testing.assert_allclose(ss.load("a.npz").points, TURNS.as_matrix(), atol=5e-3)
    off = Q.copy()
    off[3] *= 1.01
    write_table("a.csv", {"t": TIMES, **dict(zip(WXYZ, off.T, strict=True))})
    problem = fails("fit a.csv --space so:3 -o b.npz")
    assert problem.startswith("a.csv, line 5: the quaternion has length 1.01, not 1")


TUM = "# a comment\n" + "".join(
    f"{1305031102.1758 + t:.4f} {' '.join(f'{v:.4f}' for v in (*p, *np.roll(q, -1)))}\n"
    for t, p, q in zip(TIMES, PLACES, Q, strict=True)
)


@pytest.mark.parametrize("ending", ["tum", "txt"])
@pytest.mark.parametrize("space", ["se:3", "so:3 x r:3", "r:3 x so:3"])
def test_tum_trajectories_in_and_out(run, ending, space):
    write(f"a.{ending}", TUM)
    run(f"fit a.{ending} --space '{space}' -o a.npz")
    spline = ss.load("a.npz")
    np.testing.assert_allclose(spline.t, 1305031102.1758 + TIMES, atol=1e-6)
    run(f"sample a.npz --at a.{ending} -o b.{ending}")
    first, *lines = Path(f"b.{ending}").read_text().splitlines()
    assert first == "# timestamp tx ty tz qx qy qz qw"
    found = np.array([line.split() for line in lines], float)
    given = np.loadtxt(f"a.{ending}")
    np.testing.assert_array_equal(found[:, 0], given[:, 0])
    np.testing.assert_allclose(found[:, 1:4], given[:, 1:4], atol=1e-12)
    turned = [Rotation.from_quat(rows[:, 4:]) for rows in (found, given)]
    assert (turned[0].inv() * turned[1]).magnitude().max() < 1e-12
    run(f"fit b.{ending} --space '{space}' -o c.npz")


def test_a_recording_with_a_gap_is_one_trajectory(run, fails):
    t = np.r_[np.arange(0, 3, 0.05), 15 + np.arange(0, 2, 0.05)] + 1305031102.1758
    turns = Rotation.from_rotvec(np.outer(t - t[0], [0.1, 0.02, 0.3])).as_quat()
    rows = np.column_stack([t, np.cos(t), np.sin(t), 0.1 * (t - t[0]), turns])
    write("a.txt", "".join(" ".join(f"{value:.6f}" for value in row) + "\n" for row in rows))
    assert "; 1 long gap, up to 12.05 (--max-gap cuts there)" in run("fit a.txt --space se:3 -o whole.npz")
    run("fit a.txt --space se:3 --max-gap 1 -o a.npz")
    curve = ss.load("a.npz")
    assert isinstance(curve, ss.SegmentedCurve) and len(curve) == 2
    run("sample a.npz --every 0.5 -o x.txt")
    found = np.loadtxt("x.txt")
    first, second = (own.domain for own in curve)
    np.testing.assert_allclose(
        found[:, 0], np.r_[np.arange(first[0], first[1], 0.5), np.arange(second[0], second[1], 0.5)], atol=1e-6
    )
    np.testing.assert_allclose(found[:, 1:4], curve(found[:, 0])[:, :3, 3], atol=1e-12)
    run("sample a.npz --at a.txt -o y.txt")
    np.testing.assert_allclose(np.loadtxt("y.txt")[:, :4], rows[:, :4], atol=1e-6)
    # Times in the gap are omitted, and one segment is chosen.
    write("at.csv", f"time\n{t[70]}\n{t[50] + 5}\n{t[3]}\n")
    out = run("sample a.npz --at at.csv -o z.csv", notes=True)
    assert "1 of 3 times lie in gaps between segments, and are omitted" in out
    assert (table("z.csv")["curve"], len(table("z.csv")["time"])) == (["2", "1"], 2)
    run("sample a.npz --curve 2 -n 4 -o z.csv")
    assert "curve" not in table("z.csv") and float(table("z.csv")["time"][0]) == second[0]
    run("sample a.npz -n 4 -o 'z_{curve}.txt'")
    np.testing.assert_array_equal(np.loadtxt("z_2.txt")[:, 0], np.array(table("z.csv")["time"], float))
    assert [line.split()[0] for line in run("check a.npz").splitlines()] == ["curve", "1", "2", "All"]
    assert run("check a.npz --curve 2").splitlines()[1].split()[0] == "40"
    assert fails("check a.npz --curve 3") == "a.npz has no curve '3'; there are 1, 2"


def test_bad_tum_trajectories(fails):
    for text, problem in [
        ("# x\n", "a.tum is empty"),
        ("# x\n0 1 2 3\n", "a.tum, line 2: 4 numbers, but a line of a TUM trajectory has 8: time tx ty tz qx"),
        ("0 0 0 0 0 0 0 1\n1 0 0 0 1 0 0 1\n", "a.tum, line 2: the quaternion has length 1.41421"),
        ("0 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n", "a.tum, line 2: time 0.0 does not come after 0.0 in line 1"),
    ]:
        write("a.tum", text)
        assert fails("fit a.tum --space se:3 -o a.npz").startswith(problem)


def test_curves_that_do_not_fit_a_tum_trajectory(run, fails):
    ss.CubicSpline(None, np.eye(3), "s:2").save("a.npz")
    assert "has poses, points of se:3" in fails("sample a.npz -n 3 -o b.tum")
    p = points_on(ss.space("se:3"), 6, step=0.4)
    ss.CubicSpline(None, p, "se:3").save("a.npz")
    assert "no derivatives" in fails("sample a.npz -n 3 --nu 0,1 -o b.tum")
    ss.CubicSpline(None, np.stack([p, p]), "se:3").save("a.npz")
    problem = "curve '1' begins before the end of curve '0'; choose one with --curve, or write one file per curve"
    assert problem in fails("sample a.npz -n 3 -o b.tum")
    run("sample a.npz -n 3 --curve 1 -o b.tum")
    run("sample a.npz -n 3 -o 'c_{curve}.tum'")
    assert Path("b.tum").read_text() == Path("c_1.tum").read_text() == Path("c_0.tum").read_text()
    t = np.array(["1960-01-01", "2020-01-01"], "datetime64[s]")
    ss.CubicSpline(t, p[:2], "se:3").save("a.npz")
    assert "counted from 1970 on" in fails("sample a.npz -n 3 -o b.tum")


def test_tum_of_curves_from_matrices_and_dates(run):
    t = np.array("2021-08-29", "datetime64[ns]") + np.array([0, 1_000_000_007])
    ss.CubicSpline(t, poses()[:2], "se:3").save("a.npz")
    write("t.csv", "t\n" + "".join(f"{time}\n" for time in t))
    run("sample a.npz --at t.csv -o a.tum")
    lines = Path("a.tum").read_text().splitlines()
    assert lines[1].split()[0] == "1630195200.000000000" and lines[2].split()[0] == "1630195201.000000007"


def test_quaternions_that_are_missing_or_inaccurate(run, fails):
    turn = np.sqrt([0.98, 0.02])
    missing = "2,1,2,3,nan,nan,nan,nan\n"
    text = f"t,x,y,z,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n1,1,2,3,0,0,0,0\n{missing}3,1,2,3,{turn[0]},0,0,{turn[1]}\n"
    write("a.csv", text)
    problem = fails("fit a.csv --space 'so:3 x r:3' -o a.npz")
    assert problem.startswith("a.csv, line 4: column 'qw' is empty or NaN; symspline fit --skipna")
    out = run("fit a.csv --space 'so:3 x r:3' --skipna -o a.npz")
    assert "2 rows without a point or a time omitted (--skipna)" in out
    assert ss.load("a.npz").t.tolist() == [0, 3]
    write("b.csv", text.replace(missing, ""))
    problem = fails("fit b.csv --space 'so:3 x r:3' -o b.npz")
    assert "b.csv, line 3: the quaternion has length 0, not 1" in problem and "--skipna omits" in problem
    write("c.csv", "t,qw,qx,qy,qz\n0,1.02,0,0,0\n1,0.776,0.582,0,0\n")
    assert "--atol 0.1 normalises quaternions" in fails("fit c.csv --space so:3 -o c.npz")
    run("fit c.csv --space so:3 --atol 0.1 -o c.npz")
    turned = [[1, 0, 0], [0, 0.28, -0.96], [0, 0.96, 0.28]]
    np.testing.assert_allclose(ss.load("c.npz").points, [np.eye(3), turned], atol=1e-15)


@pytest.mark.parametrize("order", ["ZYX", "XYZ", "zyx", "ZXZ"])
@pytest.mark.parametrize("degrees", [True, False])
def test_euler_angles(run, order, degrees):
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    angles = np.array([[10, 20, 30], [15, 25, 20], [20, 40, 0]]) * (1 if degrees else 0.01)
    rows = [f"{i},{','.join(map(str, row))},{i},2,3\n" for i, row in enumerate(angles)]
    write("a.csv", "t,a,b,c,x,y,z\n" + "".join(rows))
    options = f"--euler {order} {'--degrees' if degrees else ''}"
    run(f"fit a.csv --space so:3 --columns a,b,c {options} -o a.npz")
    expected = rotation.from_euler(order, angles, degrees=degrees).as_matrix()
    np.testing.assert_allclose(ss.load("a.npz").points, expected, atol=1e-14)
    run(f"fit a.csv --space 'so:3 x r:3' {options} -o b.npz")
    turned, moved = ss.load("b.npz").points
    np.testing.assert_allclose(turned, expected, atol=1e-14)
    np.testing.assert_array_equal(moved[:, 0], [0, 1, 2])


def test_roll_pitch_and_yaw(run, fails):
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    write("a.csv", "t,roll,pitch,yaw\n0,0,0,170\n1,1,2,179\n2,2,3,-172\n")
    assert "--euler ZYX --degrees reads roll, pitch and yaw" in fails("fit a.csv --space so:3 -o a.npz")
    run("fit a.csv --space so:3 --euler ZYX --degrees -o a.npz")
    expected = rotation.from_euler("ZYX", [[170, 0, 0], [179, 2, 1], [-172, 3, 2]], degrees=True).as_matrix()
    np.testing.assert_allclose(ss.load("a.npz").points, expected, atol=1e-14)
    run("sample a.npz -n 3 -o b.csv")
    assert list(table("b.csv")) == ["t", "qw", "qx", "qy", "qz"]
    assert "--euler ZXZ does not suit the names" in fails("fit a.csv --space so:3 --euler ZXZ --degrees -o b.npz")


def test_ground_truth_of_euroc(run):
    head = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_x [m/s]"
    write("a.csv", f"{head}\n1403636580838555648,1,2,3,1,0,0,0,9\n1403636580843555648,1,2,4,0.8,0,0,0.6,9\n")
    run("fit a.csv -o a.npz")
    curve = ss.load("a.npz")
    assert str(curve.t[0]) == "2014-06-24T19:03:00.838555648"
    np.testing.assert_array_equal(curve.points[1], [[1, 2, 3], [1, 2, 4]])


def test_an_export_of_motive(run, fails):
    above = "Format Version,1.23,Take Name,a\n\n,Type,Rigid Body,Rigid Body\n"
    body, kinds = ",".join(["Drone"] * 8), ",".join(["Rotation"] * 4 + ["Position"] * 3 + ["Mean Marker Error"])
    numbers = "0,0.0,0,0,0,1,5,0,0,0.1\n1,0.1,0,0,0.6,0.8,6,0,0,0.1\n"
    write("a.csv", f"{above},Name,{body}\n,,{kinds}\nFrame,Time (Seconds),X,Y,Z,W,X,Y,Z,\n{numbers}")
    run("fit a.csv -o a.npz")
    curve = ss.load("a.npz")
    assert str(curve.space) == "so:3 x euclidean:3" and curve.t.tolist() == [0, 0.1]
    np.testing.assert_allclose(curve.points[0][1], [[0.28, -0.96, 0], [0.96, 0.28, 0], [0, 0, 1]], atol=1e-15)
    write("b.csv", f"{above}Frame\n".replace("Frame", "0,1"))
    assert "has a row of names that begins with Frame" in fails("fit b.csv --space r:1 -o b.npz")


def test_poses_of_kitti(run, fails):
    write("a.txt", "1 0 0 5 0 1 0 6 0 0 1 7\n0.28 -0.96 0 5 0.96 0.28 0 6 0 0 1 8\n")
    assert fails("fit a.txt -o a.npz").endswith("; KITTI's poses have 12: give --from kitti")
    run("fit a.txt --from kitti -o a.npz")
    _, poses = ss.poses.read_kitti("a.txt")
    turned, moved = ss.load("a.npz").points
    np.testing.assert_allclose(turned, poses[:, :3, :3], atol=1e-15)
    np.testing.assert_array_equal(moved, poses[:, :3, 3])
    assert "KITTI's format has no times" in fails("sample a.npz -n 3 --to kitti -o b.txt")
    write("b.txt", "1 0 0\n")
    assert "has 12 numbers, not 3" in fails("fit b.txt --from kitti -o b.npz")


def test_ticks_without_a_unit_are_noted(run):
    write("a.csv", "timestamp,x\n112000000,0\n112010000,1\n112020000,2\n")
    said = run("fit a.csv --space r:1 --time timestamp -o a.npz")
    assert "if it counts us, also since a start, give --unix us, and rates are per second" in said
    assert "give --unix" not in run("fit a.csv --space r:1 --unix us -o a.npz")
    assert ss.load("a.npz")(ss.load("a.npz").t[0], nu=1) == pytest.approx(100)

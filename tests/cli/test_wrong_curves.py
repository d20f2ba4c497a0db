"""Tables that would silently give wrong curves raise an error or a warning."""

import numpy as np
from compare import parts
from tabular import read_table, write

import symspline as ss


def ships(order="by ship", identity=("ann", "bob", "cat")):
    """Three tracks at the same times, two degrees apart, and a column that says which row is whose."""
    rows = [
        f"{t}.0,{10 + 0.1 * t + 2 * k:.3f},{50 + 0.05 * t * t:.3f},{name}"
        for k, name in enumerate(identity)
        for t in range(6)
    ]
    if order == "by time":
        rows.sort(key=lambda row: float(row.split(",")[0]))
    write("ships.csv", "time,lon,lat,ship\n" + "\n".join(rows) + "\n")


NUMBERS = (17, 4, 9)


def test_equal_times_of_several_tracks_suggest_their_column_first(run, fails):
    for identity in [("ann", "bob", "cat"), NUMBERS]:
        for order in ["by ship", "by time"]:
            for options in ["", "--sort"]:
                ships(order, identity)
                message = fails(f"fit ships.csv --lonlat {options} -o a.npz")
                assert "; --curve ship fits one curve per ship; otherwise " in message
                assert message.index("--curve") < max(message.find("--dedup"), message.find("--sort"))
                if order == "by time" and not options:
                    run("fit ships.csv --lonlat --curve ship -o a.npz")
                    assert len(ss.load("a.npz")) == 3


def test_tracks_without_times_are_reported(run):
    rows = [f"{lon},{lat},{name}" for name, lat in (("ann", 50), ("bob", 10)) for lon in range(4)]
    write("ships.csv", "lon,lat,ship\n" + "\n".join(rows) + "\n")
    out = run("fit ships.csv --lonlat -o a.npz", notes=True)
    assert "; no column of times: the points are at 0, 1, 2, ...\n" in out
    assert "column 'ship' has one block of rows for each of its values" in out
    assert "fit each of them with --curve ship\n" in out
    assert "--curve ship fits one curve per ship\n" in run("info ships.csv")
    assert "no column of times" not in run("fit ships.csv --lonlat --curve ship --time none -o a.npz")
    rows = [f"{lon},{lon},{quality}" for lon, quality in enumerate(("good", "bad") * 3)]
    write("ships.csv", "lon,lat,quality\n" + "\n".join(rows) + "\n")
    run("fit ships.csv --lonlat -o a.npz")


def test_two_curves_never_share_a_file(run, fails):
    write("a.csv", "t,id,x\n0,a/1,0\n1,a/1,1\n0,a_1,5\n1,a_1,6\n")
    run("fit a.csv --space r:1 --columns x --curve id -o a.npz")
    problem = fails("sample a.npz -n 2 -o 'b_{curve}.csv'")
    assert problem == "-o b_{curve}.csv: two curves would have the file b_a_1.csv; choose one with --curve"


def test_merged_tracks_are_reported(run):
    ships()
    out = run("fit ships.csv --lonlat --sort --dedup mean -o a.npz", notes=True)
    assert "12 rows merged with others of the same time (--dedup mean)" in out
    assert "column 'ship' distinguishes them" in out and "--curve ship" in out


def test_columns_that_do_not_tell_rows_apart_are_not_suggested(fails):
    write("a.csv", "t,x,note\n0,0,a\n1,1,b\n1,2,b\n2,3,a\n")
    assert "--curve" not in fails("fit a.csv --space r:1 --columns x -o a.npz")


def test_deviations_are_in_the_units_of_the_columns(run):
    """Of quaternions, half the angle: a turn by a small angle moves a quaternion half as far."""
    rng, t = np.random.default_rng(0), np.linspace(0, 4, 60)
    turns = ss.rotations.from_rotation_vectors(np.outer(t, [0, 0, 0.5]) + 0.02 * rng.standard_normal((60, 3)))
    q, places = ss.rotations.as_quaternions(turns, scalar_first=True), 3 * rng.standard_normal((60, 3))
    quaternions = dict(zip(("qw", "qx", "qy", "qz"), q.T, strict=True))
    poses = quaternions | dict(zip(("tx", "ty", "tz"), places.T, strict=True))
    both = "'so:3 x r:3' --columns qw,qx,qy,qz,tx,ty,tz"
    for columns, space, scales in [
        ({"points": turns}, "so:3", {"std": 1}),
        (quaternions, "so:3", {"std": 1 / 2}),
        ({"points": ss.poses.join(turns, places)}, "se:3", {"std_rotation": 1, "std_position": 1}),
        (poses, "se:3", {"std_rotation": 1 / 2, "std_position": 1}),
        (poses, both, {"std1": 1 / 2, "std2": 1}),
    ]:
        np.savez("m.npz", t=t, **columns)
        run(f"fit m.npz --space {space} -o c.npz --smooth --lam 0.1")
        run("sample c.npz -n 9 --nu 0,1 -o s.csv")
        spline, found = ss.load("c.npz"), read_table("s.csv")
        for nu, mark in enumerate(("", "_d1")):
            deviations = parts(spline.std(found["t"], nu=nu))
            for (name, scale), expected in zip(scales.items(), deviations, strict=True):
                if nu == 0 or scale == 1:
                    np.testing.assert_allclose(found.pop(name + mark), scale * expected, rtol=1e-12)
                else:
                    # The frame of the body is orthonormal, but turns with the uncertain rotation.
                    rates = [found.pop(f"std_w{axis}") for axis in "xyz"]
                    np.testing.assert_allclose(rates, [expected] * 3, rtol=1e-2)
        assert not [name for name in found if name.startswith("std")]


def test_escape_characters_do_not_reach_the_terminal(run, fails):
    write("a.csv", "t,x,id\n0,0,\x1b[31mred\n1,1,\x1b[31mred\n")
    run("fit a.csv --space r:1 --curve id --columns x -o a.npz")
    assert "\x1b" not in run("check a.npz")
    assert "\x1b" not in fails("plot a.npz --curve no -o a.png")
    write("b.csv", "t,x\n0,\x1b[31m\n")
    assert "\\x1b[31m" in fails("fit b.csv --space r:1 --columns x -o b.npz")

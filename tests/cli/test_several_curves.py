"""Several curves in one table or file."""

from pathlib import Path

import numpy as np
from tabular import PAIR, numbers, table, write

import symspline as ss


def test_curves_in_one_file(run):
    write("pair.csv", PAIR)
    out = run("fit pair.csv --space s:2 --curve id -o pair.npz")
    assert out.startswith("pair.npz: 2 curves through 5 points of sphere:2, converged: ")
    e = np.eye(3)
    fitted = ss.fit_many([([0, 2, 3], e[[0, 2, 1]]), ([1, 2], e[1:])], "s:2")
    assert ss.load("pair.npz") == dict(zip("ab", fitted, strict=True))
    run("sample pair.npz --every 0.5 --digits 17 -o out.csv")
    columns = table("out.csv")
    assert list(columns) == ["t", "id", "x", "y", "z"]
    assert columns["id"] == ["a"] * 7 + ["b"] * 3
    np.testing.assert_array_equal(numbers(columns, *"xyz")[7:], fitted[1]([1, 1.5, 2]))
    lines = run("check pair.npz").splitlines()
    assert [line.split()[0] for line in lines] == ["curve", "a", "b", "All"]
    run("plot pair.npz --curve b -o b.svg")
    assert "<svg" in Path("b.svg").read_text(encoding="utf-8")


def test_several_recordings_that_were_cut_at_gaps(run):
    """Each time belongs to its segment, and times in gaps to none, under the names of the table."""
    rows = [(t, "a", t / 10) for t in (0, 1, 2, 43, 44, 45)] + [(t, "b", -t) for t in (0, 1, 2)]
    write("a.csv", "t,id,x\n" + "".join(f"{t},{name},{x}\n" for t, name, x in rows))
    run("fit a.csv --space r:1 --columns x --curve id --max-gap 10 --extrapolate geodesic -o a.npz")
    assert list(ss.load("a.npz")) == ["a/1", "a/2", "b"]
    write("at.csv", "t\n44.5\n1.5\n30\n")
    out = run("sample a.npz --curve a --at at.csv -o out.csv", notes=True)
    assert "1 of 3 times lie in gaps between segments, and are omitted" in out
    columns = table("out.csv")
    assert columns["id"] == ["a/2", "a/1"]
    np.testing.assert_allclose(numbers(columns, "t", "x"), [[44.5, 4.45], [1.5, 0.15]], atol=1e-12)
    write("at.csv", "t,id\n44.5,a\n1.5,b\n1,a/1\n2,a\n")
    run("sample a.npz --at at.csv -o out.csv")
    assert table("out.csv")["id"] == ["a", "b", "a/1", "a"]
    np.testing.assert_allclose(numbers(table("out.csv"), "x")[:, 0], [4.45, -1.5, 0.1, 0.2], atol=1e-12)
    write("at.csv", "when,id\n44.5,a\n1.5,a\n")
    run("sample a.npz --at at.csv --time when -o out.csv")
    assert table("out.csv")["id"] == ["a", "a"]
    run("plot a.npz --curve a -o a.svg")
    assert run("plot a.npz -o b.svg") == "b.svg: a picture of 2 curves\n"


def test_a_batch_made_in_python(run):
    p = np.stack([np.eye(3), np.eye(3)[::-1]])
    ss.CubicSpline(None, p, "s:2").save("batch.npz")
    run("sample batch.npz -n 3 -o out.csv")
    columns = table("out.csv")
    assert columns["curve"] == ["0"] * 3 + ["1"] * 3
    np.testing.assert_allclose(numbers(columns, "x0", "x1", "x2"), p.reshape(6, 3), atol=1e-15)
    ss.CubicSpline(None, np.stack([p, p]), "s:2").save("batch.npz")
    run("sample batch.npz -n 1 -o out.csv")
    assert table("out.csv")["curve"] == ["0,0", "0,1", "1,0", "1,1"]


def test_problems_of_one_curve_name_it(run, fails):
    write("pair.csv", PAIR)
    run("fit pair.csv --space s:2 --curve id -o pair.npz")
    assert fails("plot pair.npz --curve c -o a.png") == "pair.npz has no curve 'c'; there are a, b"
    write("bad.csv", PAIR + "c,3,1,0,0\n")
    problem = "bad.csv, line 7: this is the only point of curve 'c'; a curve needs two"
    assert fails("fit bad.csv --space s:2 --curve id -o bad.npz").startswith(problem)
    write("bad.csv", PAIR + "b,1.5,1,0,0\n")
    problem = "bad.csv, line 7: time 1.5 of curve 'b' does not come after 2.0 in line 5; times must increase"
    assert fails("fit bad.csv --space s:2 --curve id -o bad.npz").startswith(problem)
    write("bad.csv", PAIR + "b,4,0,0,-1\n")
    problem = fails("fit bad.csv --space s:2 --curve id -o bad.npz")
    assert problem.startswith("bad.csv: the point in line 5 and the point in line 7 of curve 'b' lie at or past")
    write("bad.csv", PAIR + ",5,0,0,1\n")
    assert fails("fit bad.csv --space s:2 --curve id -o bad.npz") == "bad.csv, line 7: column 'id' is empty"


def test_tracks_that_follow_each_other_in_one_table_warn(run):
    rows = [f"{i},{name},{lon + i},{50 + 0.1 * i}" for i, (name, lon) in enumerate([("A", 0)] * 6 + [("B", 90)] * 6)]
    write("a.csv", "time,trip,lon,lat\n" + "\n".join(rows) + "\n")
    assert "fit each of them with --curve trip" in run("fit a.csv --lonlat -o a.npz", notes=True)
    run("fit a.csv --lonlat --curve trip -o b.npz")
    # States along one track.
    write("c.csv", "time,state,lon,lat\n" + "\n".join(f"{i},{'ab'[i // 3 % 2]},{i},50" for i in range(12)) + "\n")
    run("fit c.csv --lonlat -o c.npz")

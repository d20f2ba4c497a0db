"""Tables in CSV, NPZ and Parquet."""

import os
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from tabular import FIXES, TRACK, table, write

import symspline as ss


def test_formats_read_the_same(run):
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    write("a.csv", TRACK)
    clock = np.array([f"2021-08-29T{row[0]}" for row in FIXES], "datetime64[s]")
    lon, lat = np.array([row[1:] for row in FIXES]).T
    np.savez("a.npz", time=clock, lon=lon, lat=lat)
    parquet.write_table(
        pa.table({"time": pa.array(clock, pa.timestamp("s", "UTC")), "lon": lon, "lat": lat}), "a.parquet"
    )
    parquet.write_table(pa.table({"time": [f"{c} +00:00" for c in clock], "lon": lon, "lat": lat}), "b.parquet")
    splines = []
    for name in ("a.csv", "a.npz", "a.parquet", "b.parquet"):
        run(f"fit {name} --lonlat -o curve.npz")
        splines.append(ss.load("curve.npz"))
    for spline in splines:
        np.testing.assert_array_equal(spline.t, clock)
        np.testing.assert_array_equal(spline.velocities, splines[0].velocities)


def test_formats_write_the_same(run):
    parquet = pytest.importorskip("pyarrow.parquet")
    write("a.csv", TRACK)
    run("fit a.csv --lonlat -o curve.npz")
    for ending in ("csv", "npz", "parquet", "CSV"):
        run(f"sample curve.npz --every 1.5h --nu 0,1 --digits 17 -o out.{ending}")
    texts = table("out.csv")
    assert Path("out.CSV").read_bytes() == Path("out.csv").read_bytes()
    arrays, columns = np.load("out.npz"), parquet.read_table("out.parquet")
    assert list(texts) == list(arrays)[:-1] == columns.column_names
    # The dates of an NPZ file are in UTC if it says so.
    assert arrays["time_zone"] == "UTC"
    run("fit out.npz --lonlat -o again.npz")
    run("sample again.npz -n 2 --digits 17 -o again.csv")
    assert table("again.csv")["time"] == ["2021-08-29T00:00:00Z", "2021-08-29T18:00:00Z"]
    assert columns.schema.field("time").type.tz == "UTC"
    assert [text.removesuffix("Z") for text in texts["time"]] == arrays["time"].astype(str).tolist()
    np.testing.assert_array_equal(arrays["time"], columns["time"].to_numpy())
    for name in list(texts)[1:]:
        np.testing.assert_array_equal(np.array(texts[name], float), arrays[name])
        np.testing.assert_array_equal(arrays[name], columns[name].to_numpy())


def test_t_and_points_of_an_npz_file(run, fails):
    np.savez("a.npz", t=[0, 1, 3], points=np.eye(3), velocities=np.ones((3, 3)), note="hello")
    run("fit a.npz --space s:2 -o curve.npz")
    assert ss.load("curve.npz") == ss.CubicSpline([0, 1, 3], np.eye(3), "s:2")
    np.savez("b.npz", when=[0, 1, 3], u=np.eye(3)[:, :2], w=np.eye(3)[:, 2])
    run("fit b.npz --space s:2 --time when --columns u,w -o curve2.npz")
    assert ss.load("curve.npz") == ss.load("curve2.npz")
    for arrays, options, problem in [
        ({"t": [0, 1], "points": np.eye(3)}, "--space s:2", "c.npz: arrays differ in length: 2 and 3"),
        (
            {"t": [0, 1, np.inf], "points": np.eye(3)},
            "--space s:2",
            "c.npz, row 2 (counted from 0): column 't' holds inf",
        ),
        ({"t": np.array(["2020", "NaT"], "M8[D]"), "points": np.eye(2)}, "--space s:1", "column 't' holds no time"),
        ({"t": [0, 1], "points": np.eye(2)}, "--space s:1 --columns point", "did you mean 'points'?"),
        ({"t": [], "points": np.empty((0, 2))}, "--space s:1", "c.npz has no rows"),
        ({"t": [0, 1], "points": np.array([["a"], ["b"]])}, "--space r:1", "holds 'a', which is not a number"),
        ({"t": np.array([{}, {}])}, "--space r:1", "c.npz: entry 't' holds Python objects"),
    ]:
        np.savez("c.npz", **arrays)
        assert problem in fails(f"fit c.npz {options} -o d.npz")
    assert "was fitted already" in fails("fit curve.npz --space s:2 -o d.npz")
    write("e.npz", "no zip")
    assert fails("fit e.npz --space s:2 -o d.npz") == "e.npz is not an NPZ file"


def test_parquet_of_all_kinds(run, fails):
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    from decimal import Decimal

    columns = {
        "id": pa.array(["a", "a", "b", "b"]).dictionary_encode(),
        "time": pa.array(np.array(["2020-01-01", "2020-01-02"] * 2, "datetime64[D]")),
        "x": pa.array([1, 2, 3, 4]),
        "y": pa.array([Decimal("1.5")] * 4),
        "z": pa.array([1.0, None, 2.0, 3.0]),
    }
    parquet.write_table(pa.table(columns), "a.parquet")
    run("fit a.parquet --space r:2 --curve id --columns x,y -o a.npz")
    made = ss.load("a.npz")
    assert list(made) == ["a", "b"]
    np.testing.assert_array_equal(made["b"].points, [[3, 1.5], [4, 1.5]])
    assert str(made["a"].t[1]) == "2020-01-02"
    problem = fails("fit a.parquet --space r:3 --curve id -o b.npz")
    assert (
        problem
        == "a.parquet, row 1 (counted from 0): column 'z' is empty or NaN; symspline fit --skipna omits such rows"
    )
    Path("b.parquet").write_bytes(Path("a.parquet").read_bytes()[:300])
    assert fails("fit b.parquet --space r:3 -o b.npz") == "b.parquet is damaged or not a Parquet file"


def test_csv_without_pandas(fails, monkeypatch):
    write("a.csv", TRACK)
    monkeypatch.setitem(sys.modules, "pandas", None)
    problem = "CSV files need pandas; install it with: pip install 'symspline[cli]'"
    assert fails("fit a.csv --lonlat -o a.npz") == problem


def test_parquet_without_pyarrow(curves, fails, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert "pip install 'symspline[parquet]'" in fails("sample a.npz -n 3 -o out.parquet")
    assert "pip install 'symspline[parquet]'" in fails("fit out.parquet --space s:2 -o b.npz")


def test_csv_dialects_of_other_programs(run):
    """A byte order mark, Windows line ends, blanks behind commas, quotes, blank lines, no last line end."""
    text = '\ufeff"t", "x"\r\n0,1.5\r\n\r\n 1 , "2.5"\r\n\r\n3,1e-3'
    write("a.csv", text)
    run("fit a.csv --space r:1 -o a.npz")
    assert ss.load("a.npz") == ss.CubicSpline([0, 1, 3], [[1.5], [2.5], [1e-3]], "r:1")
    # Columns without a name: an index, and commas at the end of lines.
    write("b.csv", ",t,x,,\n0,0,1.5,,\n1,1,2.5,,\n2,3,1e-3,,\n")
    run("fit b.csv --space r:1 -o b.npz")
    assert ss.load("b.npz") == ss.load("a.npz")


@pytest.mark.parametrize("names", [("NA", "EU"), ("true", "false"), ("007", "7"), ("1.0", "2.50"), ("null", '"a, b"')])
def test_names_are_read_as_they_stand(run, names):
    write("a.csv", "t,id,x\n" + "".join(f"{i},{name},{i * i}\n" for i in range(3) for name in names))
    run("fit a.csv --space r:1 --columns x --curve id -o a.npz")
    assert list(ss.load("a.npz")) == [name.strip('"') for name in names]


def test_long_files_are_read_in_chunks(run, fails):
    n = 4500
    angle = np.arange(n) / 10
    rows = [f"{i},{np.cos(a):.17g},{np.sin(a):.17g},note\n" for i, a in enumerate(angle)]
    rows.insert(3000, "\n" * 5000)
    write("a.csv", "t,x,y,remark\n" + "".join(rows))
    run("fit a.csv --space s:1 -o a.npz")
    np.testing.assert_allclose(ss.load("a.npz").points, np.stack([np.cos(angle), np.sin(angle)], 1), atol=1e-15)
    rows[4000] = "17,1,one,\n"
    write("a.csv", "t,x,y,remark\n" + "".join(rows))
    assert fails("fit a.csv --space s:1 -o b.npz") == "a.csv, line 9001: column 'y' holds 'one', which is not a number"
    run("sample a.npz --every 0.5 -o b.csv")
    assert len(table("b.csv")["t"]) == 2 * n - 1


def test_formats_of_positions_refuse_derivatives_alone(run, fails):
    write("a.csv", TRACK)
    run("fit a.csv --lonlat -o curve.npz")
    for ending in ("geojson", "gpx"):
        problem = fails(f"sample curve.npz -n 3 --nu 1 -o b.{ending}")
        assert problem.endswith(" needs the points beside their derivatives: give --nu 0,1")
    assert fails("sample curve.npz -n 3 --nu 0,1 -o b.gpx").startswith("GPX has positions and no derivatives; write")
    run("sample curve.npz -n 3 --nu 0,1 -o b.geojson")


def test_comments(run, fails):
    expected = ss.CubicSpline([0, 1, 3], [[1], [2], [0]], "r:1")
    for text in (
        "# a comment, with a comma\nt,x\n0,1\n1,2\n3,0\n",
        "# about\n#t, x [m]\n0,1\n# below\n\n1,2\n3,0\n",
        "t x\n0 1\n1   2\n 3 0\n",
        "# t x\n0 1\n1 2\n3 0\n",
    ):
        write("a.csv", text)
        run("fit a.csv --space r:1 -o a.npz")
        assert ss.load("a.npz") == expected
    write("a.csv", "# about\nt,x\n0,1\n# below\n1,no\n3,0\n")
    assert "a.csv, line 5: column 'x' holds 'no'" in fails("fit a.csv --space r:1 -o a.npz")
    write("a.csv", "about this file\nt,x\n0,1\n1,2\n")
    problem = fails("fit a.csv --space r:1 -o a.npz")
    assert problem.endswith("but the first line names 1 column; remove lines above the names, such as comments")


def test_text_in_utf_16(run):
    write("a.csv", TRACK)
    run("fit a.csv --lonlat -o a.npz")
    for encoding in ("utf-16", "utf-16-be"):
        mark = "\ufeff" if encoding.endswith("be") else ""
        Path("b.csv").write_text(mark + TRACK.replace(",", "\t"), encoding=encoding)
        run("fit b.csv --lonlat -o b.npz")
        assert ss.load("b.npz") == ss.load("a.npz")


def test_json_lines(run, fails):
    write("a.csv", TRACK)
    run("fit a.csv --lonlat -o a.npz")
    run("sample a.npz --every 6h -o b.jsonl")
    assert Path("b.jsonl").read_text(encoding="utf-8").count("\n") == 4
    for line in ("b.jsonl", "b.json"):
        Path("b.json").write_bytes(Path("b.jsonl").read_bytes())
        run(f"fit {line} --lonlat -o b.npz")
        np.testing.assert_allclose(ss.load("b.npz").points, ss.load("a.npz").points, atol=1e-15)
    write("c.jsonl", '{"t": 0, "x": 1}\n{"t": 1, "x": \n')
    assert fails("fit c.jsonl --space r:1 -o c.npz").startswith("c.jsonl, line 2 is not JSON: Expecting value")


def test_arrays_of_numpy(run, fails):
    np.save("a.npy", np.eye(3))
    run("fit a.npy --space s:2 -o a.npz")
    assert ss.load("a.npz") == ss.CubicSpline(None, np.eye(3), "s:2")
    run("sample a.npz -n 5 -o b.npy")
    run("fit b.npy --space s:2 -o b.npz")
    np.testing.assert_allclose(ss.load("b.npz").points, ss.load("a.npz")(np.linspace(0, 2, 5)), atol=1e-15)
    np.save("c.npy", np.array([{}]))
    assert "c.npy is damaged, or not an array of numbers" in fails("fit c.npy --space s:2 -o c.npz")


def test_further_missing_values(run, fails):
    write("a.csv", "t,id,x\n0,a,1\n1,a,-999\n2,none,5\n3,a,2\n4,a,n/a\n")
    assert "line 6: column 'x' holds 'n/a'" in fails("fit a.csv --space r:1 --columns x -o a.npz")
    options = "--space r:1 --columns x --curve id --na -999.0,n/a,none"
    assert "line 3: column 'x' is empty or NaN; symspline fit --skipna" in fails(f"fit a.csv {options} -o a.npz")
    run(f"fit a.csv {options} --skipna -o a.npz")
    assert ss.load("a.npz")["a"] == ss.CubicSpline([0, 3], [[1], [2]], "r:1")
    np.savez("b.npz", t=[0, 1, 3], x=[1, -999, 2])
    run("fit b.npz --space r:1 --na=-999 --skipna -o c.npz")
    assert ss.load("c.npz") == ss.load("a.npz")["a"]


def test_points_and_commas_in_one_table_raise(fails, run):
    write("a.csv", "t;x;y\n0;1,5;2\n1;2.5;3\n")
    says = "a.csv: column 'x' has decimal points and decimal commas, 2.5 and 1,5; use one of them"
    assert fails("fit a.csv --space r:2 -o a.npz") == says
    write("a.csv", "t;x;y\n0;1,5;2.5\n1;2;3\n")
    says = "a.csv: numbers have decimal points in column 'y', and decimal commas in column 'x'; use one of them"
    assert fails("fit a.csv --space r:2 -o a.npz") == says
    write("a.csv", "t;x;y\n0;1,5;2\n1;2;3\n")
    run("fit a.csv --space r:2 -o a.npz")


@pytest.mark.skipif(sys.platform == "win32", reason="named pipes are those of POSIX")
def test_pipes_without_an_ending_are_csv(run):
    os.mkfifo("pipe")
    writer = threading.Thread(target=write, args=("pipe", TRACK))
    writer.start()
    run("fit pipe --lonlat -o a.npz")
    writer.join()
    assert len(ss.load("a.npz").t) == 4


def test_one_curve_has_no_name(run, fails):
    write("a.csv", TRACK)
    run("fit a.csv --lonlat -o curve.npz")
    assert fails("sample curve.npz --curve foo -n 3 -o -") == "curve.npz has one curve without a name; omit --curve"

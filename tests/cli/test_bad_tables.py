"""Tables and files of curves that are invalid, damaged or missing."""

import datetime
import os
from pathlib import Path

import numpy as np
import pytest
from tabular import AXES, write

import symspline as ss


def test_invalid_tables(fails):
    for text, options, problem in [
        (AXES, "s:2 --time tt", "a.csv has no column 'tt'; did you mean 't'?"),
        (AXES, "s:2 --columns X,Y,Q", "a.csv has no column 'X'; did you mean 'x'?"),
        (AXES, "s:2 --curve storm", "a.csv has no column 'storm'; there are t, x, y, z"),
        (AXES, "r:2", "a.csv: a point of euclidean:2 has 2 numbers, and there are 3 columns: x, y, z; say which"),
        (AXES, "r:2 --columns x,x", "column 'x' of a.csv cannot have two meanings"),
        (AXES, "r:2 --columns t,x --time t", "column 't' of a.csv cannot have two meanings"),
        (AXES, "foo:2", "unknown space 'foo:2'; symspline info lists the names"),
        (AXES + "4,1,0,n/a\n", "s:2", "a.csv, line 5: column 'z' holds 'n/a', which is not a number"),
        (AXES + "\n\n4,1,0,\n", "s:2", "a.csv, line 7: column 'z' is empty"),
        (AXES + "4,1,0,inf\n", "s:2", "a.csv, line 5: column 'z' holds inf, which is not a finite number"),
        (AXES + "4,1,0\n", "s:2", "a.csv, line 5: column 'z' is empty or NaN; symspline fit --skipna omits such"),
        (AXES + "4,1,0,0,0\n", "s:2", "a.csv, line 5: 5 cells, but the first line names 4 columns"),
        (AXES.replace("0,0\n", "0,0,7\n", 1), "s:2", "a.csv, line 2: 5 cells, but the first line names 4 columns"),
        (AXES + '4,1,0,"0\n', "s:2", "a.csv, line 5: unexpected end of data"),
        (AXES + "4,0,0,-1\n", "s:2", "the point in line 4 and the point in line 5 of the curve lie at or"),
        ("\n\n", "s:2", "a.csv is empty"),
        ("t,x\n", "r:1", "a.csv has no rows below the names of its columns"),
        ("t,x\n1,2\n", "r:1", "a.csv, line 2: this is the only point; a curve needs two"),
        ("1,2\n3,4\n", "r:2", "a.csv: the first line must name the columns, but holds numbers"),
        ("t,x,x\n1,2,3\n", "r:1", "a.csv: the first line names two columns 'x'"),
        (
            "t,x,y\n1,a,3\n2,4,5\n",
            "r:2",
            "columns: y; say which with --columns, and --time if one holds the times (no numbers in the first row",
        ),
        ("t,x\n0,1\n1," + "9" * 5000 + "x\n", "r:1", "9999999999"),
    ]:
        write("a.csv", text)
        message = fails(f"fit a.csv --space {options} -o a.npz")
        assert problem in message and len(message) < 1100
    write("a.csv", "t,lon,lat\n0,deg,deg\n0,1,2\n")
    problem = "line 2: column 'lon' holds 'deg', which is not a number; if this"
    assert problem in fails("fit a.csv --lonlat -o a.npz")
    write("a.csv", "t,x,y\n0,1,2\n0,1,2\n")
    problem = "say which space the points are on: --lonlat for longitude and latitude, or --space, such as --space"
    assert problem in fails("fit a.csv -o a.npz")


def test_unreadable_files(fails):
    assert fails("fit no.csv --space s:2 -o a.npz") == "cannot read no.csv: No such file or directory"
    assert fails("check no.npz") == "cannot read no.npz: No such file or directory"
    os.mkdir("folder.csv")
    assert fails("fit folder.csv --space s:2 -o a.npz") == "cannot read folder.csv: Is a directory"
    Path("latin.csv").write_bytes("t,x\n0,1\n1,2°\n".encode("latin-1"))
    assert (
        fails("fit latin.csv --space r:1 -o a.npz")
        == "latin.csv is not text in UTF-8; convert it, such as by iconv -f cp1252 -t utf-8"
    )
    write("a.npz", "no zip")
    assert fails("check a.npz") == "a.npz is not a file of curves, such as `symspline fit` makes"
    np.savez("a.npz", x=1)
    assert "a.npz" in fails("check a.npz")
    ss.CubicSpline(None, [[0], [1]], "r:1").save("a.npz")
    np.savez("a.npz", **dict(np.load("a.npz")), columns="{}")
    assert fails("check a.npz").startswith("a.npz is damaged")
    Path("end.npz").write_bytes(b"PK\x05\x06" + b"\0" * 8 + b"\1" + b"\0" * 9)
    assert fails("info end.npz").startswith("end.npz is damaged")
    for end in (-300, -10):
        Path("cut.npz").write_bytes(Path("a.npz").read_bytes()[:end])
        assert "cut.npz" in fails("check cut.npz") and "cut.npz" in fails("fit cut.npz --space r:1 -o c.npz")


def test_damaged_column_names(fails):
    ss.CubicSpline(None, np.eye(3), "s:2").save("a.npz")
    for columns in [
        "no JSON",
        "[" * 100_000,
        "[]",
        '{"points": 3}',
        '{"points": ["x", "y"]}',
        '{"points": ["x", "y", 3]}',
        '{"points": ["x", "y", "z"], "time": null}',
        '{"points": ["x", "y", "z"], "curve": 1}',
        '{"points": ["x", "y", "z"], "lonlat": "no"}',
        '{"points": ["x", "y", "z"], "utc": 2}',
        '{"points": ["x", "y", "z"], "lonlat": true}',
        '{"points": ["x", "y", "z"], "surprise": 1}',
    ]:
        np.savez("b.npz", **dict(np.load("a.npz")) | {"columns": columns})
        assert fails("sample b.npz -n 3 -o c.csv").startswith("b.npz is damaged: ")


def test_parquet_columns_of_other_types(fails):
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    times, durations = map(datetime.time, (6, 7, 8)), map(datetime.timedelta, (1, 2, 3))
    for cells in ([b"\xff\xfe", b"a", b""], [*times], [*durations], [[1.0], [2.0], [3.0]], [{"a": 1}, {"a": 2}, {}]):
        parquet.write_table(pa.table({"x": [1.0, 2.0, 4.0], "odd": pa.array(cells)}), "a.parquet")
        for option in ["--time", "--columns", "--curve"]:
            more = "" if option == "--columns" else "--columns x"
            problem = fails(f"fit a.parquet --space r:1 {option} odd {more} -o a.npz")
            assert "a.parquet" in problem and ("'odd'" in problem or "of curve" in problem)


@pytest.mark.parametrize("cell", ["1_000", "١٢", "1_0.5", "１２"])
def test_numbers_in_unusual_notation_are_refused(run, fails, cell):
    for text, options, problem in [
        (f"t,x\n0,1\n1,2\n2,{cell}\n", "", f"line 4: column 'x' holds {cell!r}, which is not a number"),
        (f"t,x\n0,1\n1,2\n{cell},3\n", "", f"line 4: column 't' holds {cell!r}"),
        ("t,x\n0,1\n1,2\n", "--tol 1_0", "--tol: invalid number value: '1_0'"),
    ]:
        write("a.csv", text)
        assert problem in fails(f"fit a.csv --space r:1 {options} -o a.npz")
    write("a.csv", "t,x\n0,1\n1, 2.5 \n")
    run("fit a.csv --space r:1 -o a.npz")
    assert "1_0" in fails("sample a.npz -n 1_0 -o b.csv")


def test_entries_that_claim_another_compression(fails):
    ss.CubicSpline(None, np.eye(3), "s:2").save("curve.npz")
    np.savez("table.npz", t=[0.0, 1, 2], x=[0.0, 1, 0])
    for file, entry, line in [("curve", b"points.npy", "check"), ("table", b"x.npy", "fit --space r:1 -o c.npz")]:
        for method in [8, 12, 14, 99]:
            data = bytearray(Path(f"{file}.npz").read_bytes())
            # Names end the headers of entries, and their lines in the list of all at the end of the file.
            data[data.index(entry) - 30 + 8] = data[data.rindex(entry) - 46 + 10] = method
            Path("bad.npz").write_bytes(data)
            assert "bad.npz" in fails(f"{line} bad.npz")

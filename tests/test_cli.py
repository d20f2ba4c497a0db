"""The command line: every verb, every format, and what it says when something is wrong."""

import csv
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from cases import walk
from curves import each, parts, points_on, same_curve

import symspline as ss
from symspline.cli import main, times
from symspline.cli.errors import Problem
from symspline.lonlat import from_lonlat, to_lonlat

README = Path(__file__).parents[1] / "README.md"
FIXES = [("00:00", 178.5, 28.0), ("06:00", -179.0, 29.1), ("12:00", -177.0, 30.0), ("18:00", -176.2, 31.5)]
TRACK = "time,lon,lat\n" + "".join(f"2021-08-29T{clock}Z,{lon},{lat}\n" for clock, lon, lat in FIXES)
AXES = "t,x,y,z\n0,1,0,0\n1,0,1,0\n3,0,0,1\n"
PAIR = "id,t,x,y,z\na,0,1,0,0\nb,1,0,1,0\na,2,0,0,1\nb,2,0,0,1\na,3,0,1,0\n"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Every test has the current folder to itself."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(capsys):
    """Runs a command line that works, and returns what it prints."""

    def run(line):
        code = main(shlex.split(line))
        out, err = capsys.readouterr()
        assert (code, err) == (0, ""), err
        return out

    return run


@pytest.fixture
def fails(capsys):
    """Runs a command line that fails, and returns the one line that it says."""

    def fails(line, code=2):
        before = sorted(os.listdir())
        assert main(shlex.split(line)) == code
        err = capsys.readouterr().err
        assert err.startswith("symspline: ") and err.count("\n") == 1 and err.endswith("\n"), err
        assert sorted(os.listdir()) == before
        return err[len("symspline: ") : -1]

    return fails


def write(name, text):
    Path(name).write_text(text, encoding="utf-8", newline="")


def table(name):
    """The columns of a CSV file, as texts."""
    with open(name, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    return dict(zip(rows[0], map(list, zip(*rows[1:], strict=True)), strict=True))


def numbers(columns, *names):
    return np.stack([np.array(columns[name], float) for name in names], axis=1)


# ---- the way through ----


def test_the_example_of_the_readme(run):
    section = README.read_text(encoding="utf-8").split("## Command line")[1].split("\n## ")[0]
    write("ida.csv", re.search(r"```csv\n(.*?)```", section, re.S)[1])
    lines = re.search(r"```sh\n(.*?)```", section, re.S)[1].splitlines()
    assert [line.split()[1] for line in lines] == ["fit", "check", "sample", "plot"]
    for line in lines:
        run(line.removeprefix("symspline ").partition("#")[0])
    columns = table("smooth.csv")
    assert list(columns) == ["time", "lon", "lat"]
    assert len(columns["time"]) == 36 * 6 + 1
    assert columns["time"][1] == "2021-08-28T00:10:00Z"
    assert Path("ida.png").read_bytes().startswith(b"\x89PNG")
    assert len(ss.load("ida.npz").t) == 7


def test_a_fit_is_that_of_the_library(run):
    write("axes.csv", AXES)
    out = run("fit axes.csv --space sphere:2 --bc-type not-a-knot,clamped --extrapolate geodesic -o axes.npz")
    assert out.startswith("axes.npz: 1 curve through 3 points of sphere:2, converged: quasi-newton, ")
    spline = ss.CubicSpline(
        [0, 1, 3], np.eye(3), "sphere:2", bc_type=("not-a-knot", "clamped"), extrapolate="geodesic"
    )
    loaded = ss.load("axes.npz")
    assert loaded == spline and loaded.extrapolate == "geodesic"
    run("sample axes.npz -n 7 --nu 0,1,2 -o out.csv")
    columns = table("out.csv")
    assert list(columns) == ["t", *(f"{x}{end}" for end in ("", "_d1", "_d2") for x in "xyz")]
    x = np.linspace(0, 3, 7)
    np.testing.assert_array_equal(np.array(columns["t"], float), x)
    for nu, end in enumerate(("", "_d1", "_d2")):
        np.testing.assert_array_equal(numbers(columns, *(f"{x}{end}" for x in "xyz")), spline(x, nu))


def test_options_of_the_solver(run, fails):
    write("axes.csv", AXES)
    assert "fixed-point" in run("fit axes.csv --space s:2 --method fixed-point --tol 1e-6 -o axes.npz")
    assert 1e-12 < ss.load("axes.npz").report.residual < 1e-6
    assert fails("fit axes.csv --space s:2 --method foo -o b.npz").startswith("method must be")
    assert "tol" in fails("fit axes.csv --space s:2 --tol -1 -o b.npz")
    assert "--tol" in fails("fit axes.csv --space s:2 --tol x -o b.npz")
    assert fails("fit axes.csv --space s:2 --bc-type foo -o b.npz").startswith("--bc-type foo: give natural")
    assert fails("fit axes.csv --space s:2 --bc-type periodic,natural -o b.npz").startswith("--bc-type")
    assert fails("fit axes.csv --space s:2 --bc-type periodic -o b.npz").startswith(
        "axes.csv: bc_type='periodic'"
    )


def test_rows_without_times_are_at_whole_numbers(run):
    write("a.csv", "x,y\n1,2\n3,4\n5,7\n")
    run("fit a.csv --space r:2 -o a.npz")
    assert ss.load("a.npz") == ss.CubicSpline(None, [[1, 2], [3, 4], [5, 7]], "r:2")
    run("sample a.npz --every 1 -o b.csv")
    assert list(table("b.csv")) == ["time", "x", "y"]
    write("a.csv", "t,y\n1,2\n3,4\n5,7\n")
    run("fit a.csv --space r:2 --columns t,y -o b.npz")
    assert ss.load("a.npz") == ss.load("b.npz")


def test_products(run):
    write("a.csv", "t,a,b,c,d,x\n0,1,0,0,0,1\n1,0,1,0,0,2\n2,0,0,1,0,4\n")
    run("fit a.csv --space 'sphere:3 x r:1' -o a.npz")
    spline = ss.CubicSpline(None, (np.eye(4)[:3], [[1], [2], [4]]), "sphere:3 x r:1")
    assert ss.load("a.npz") == spline
    run("check a.npz")
    run("sample a.npz --every 0.5 --nu 1 -o b.csv")
    found = numbers(table("b.csv"), *(f"{name}_d1" for name in "abcdx"))
    np.testing.assert_array_equal(found, np.concatenate(spline(np.arange(5) / 2, 1), axis=1))


def test_help_has_examples(capsys):
    for verb in ("", "fit", "sample", "plot", "check", "demo"):
        with pytest.raises(SystemExit) as end:
            main([*verb.split(), "--help"])
        assert end.value.code == 0
        assert f"  symspline {verb}" in capsys.readouterr().out.split("\nexample")[1]


def test_as_a_module():
    write("axes.csv", AXES)
    line = [sys.executable, "-m", "symspline", "fit", "axes.csv", "--space", "s:2", "-o", "axes.npz"]
    done = subprocess.run(line, capture_output=True, text=True, timeout=20)
    assert (done.returncode, done.stderr) == (0, "")
    assert Path("axes.npz").exists()
    done = subprocess.run([*line, "--time", "tt"], capture_output=True, text=True, timeout=20)
    assert done.returncode == 2
    assert done.stderr == "symspline: axes.csv has no column 'tt'; did you mean 't'?\n"


# ---- formats ----


def test_formats_read_the_same(run):
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    write("a.csv", TRACK)
    clock = np.array([f"2021-08-29T{row[0]}" for row in FIXES], "datetime64[s]")
    lon, lat = np.array([row[1:] for row in FIXES]).T
    np.savez("a.npz", time=clock, lon=lon, lat=lat)
    parquet.write_table(
        pa.table({"time": pa.array(clock, pa.timestamp("s", "UTC")), "lon": lon, "lat": lat}), "a.parquet"
    )
    parquet.write_table(
        pa.table({"time": [f"{c} +00:00" for c in clock], "lon": lon, "lat": lat}), "b.parquet"
    )
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
        run(f"sample curve.npz --every 1.5h --nu 0,1 -o out.{ending}")
    texts = table("out.csv")
    assert Path("out.CSV").read_bytes() == Path("out.csv").read_bytes()
    arrays, columns = np.load("out.npz"), parquet.read_table("out.parquet")
    assert list(texts) == list(arrays) == columns.column_names
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
    np.savez("c.npz", t=[0, 1], points=np.eye(3))
    assert fails("fit c.npz --space s:2 -o d.npz") == "c.npz: arrays differ in length: 2 and 3"
    np.savez("c.npz", t=[0, 1, np.inf], points=np.eye(3))
    assert "c.npz, row 2 (counted from 0): column 't' holds inf" in fails("fit c.npz --space s:2 -o d.npz")
    np.savez("c.npz", t=np.array(["2020-01-01", "NaT"], "datetime64[D]"), points=np.eye(2))
    assert "column 't' holds no time" in fails("fit c.npz --space s:1 -o d.npz")
    assert "did you mean 'points'?" in fails("fit c.npz --space s:1 --columns point -o d.npz")
    np.savez("c.npz", t=[], points=np.empty((0, 2)))
    assert fails("fit c.npz --space s:1 -o d.npz") == "c.npz has no rows"
    np.savez("c.npz", t=[0, 1], points=np.array([["a"], ["b"]]))
    assert "not numbers" in fails("fit c.npz --space r:1 -o d.npz")
    np.savez("c.npz", t=np.array([{}, {}]))
    assert "c.npz is damaged" in fails("fit c.npz --space r:1 -o d.npz")
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
    made = ss.load_many("a.npz")
    assert list(made) == ["a", "b"]
    np.testing.assert_array_equal(made["b"].points, [[3, 1.5], [4, 1.5]])
    assert str(made["a"].t[1]) == "2020-01-02"
    problem = fails("fit a.parquet --space r:3 --curve id -o b.npz")
    assert problem == "a.parquet, row 1 (counted from 0): column 'z' is empty"
    Path("b.parquet").write_bytes(Path("a.parquet").read_bytes()[:300])
    assert fails("fit b.parquet --space r:3 -o b.npz") == "b.parquet is damaged or not a Parquet file"


def test_parquet_without_pyarrow(run, fails, monkeypatch):
    write("axes.csv", AXES)
    run("fit axes.csv --space s:2 -o axes.npz")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert "pip install 'symspline[parquet]'" in fails("sample axes.npz -n 3 -o out.parquet")
    assert "pip install 'symspline[parquet]'" in fails("fit out.parquet --space s:2 -o a.npz")


def test_what_programs_write_as_csv(run):
    """A byte order mark, Windows line ends, blanks behind commas, quotes, blank lines, no last line end."""
    text = '\ufeff"t", "x"\r\n0,1.5\r\n\r\n 1 , "2.5"\r\n\r\n3,1e-3'
    write("a.csv", text)
    run("fit a.csv --space r:1 -o a.npz")
    assert ss.load("a.npz") == ss.CubicSpline([0, 1, 3], [[1.5], [2.5], [1e-3]], "r:1")
    # Columns without a name: an index, and commas at the end of lines.
    write("b.csv", ",t,x,,\n0,0,1.5,,\n1,1,2.5,,\n2,3,1e-3,,\n")
    run("fit b.csv --space r:1 -o b.npz")
    assert ss.load("b.npz") == ss.load("a.npz")


def test_long_files_are_read_in_pieces(run, fails):
    n = 4500
    angle = np.arange(n) / 10
    rows = [f"{i},{np.cos(a):.17g},{np.sin(a):.17g},note\n" for i, a in enumerate(angle)]
    rows.insert(3000, "\n" * 5000)
    write("a.csv", "t,x,y,remark\n" + "".join(rows))
    run("fit a.csv --space s:1 -o a.npz")
    np.testing.assert_allclose(
        ss.load("a.npz").points, np.stack([np.cos(angle), np.sin(angle)], 1), atol=1e-15
    )
    rows[4000] = "17,1,one,\n"
    write("a.csv", "t,x,y,remark\n" + "".join(rows))
    assert (
        fails("fit a.csv --space s:1 -o b.npz")
        == "a.csv, line 9001: column 'y' holds 'one', which is not a number"
    )
    run("sample a.npz --every 0.5 -o b.csv")
    assert len(table("b.csv")["t"]) == 2 * n - 1


# ---- every space ----

SPACES = (
    *("r:2", "s:2", "h:2", "rp:2", "cp:1", "ch:2", "gr:2,4", "cgr:1,2", "so:3", "o:3", "u:2", "su:2"),
    *("spd:2", "hpd:2", "se:2", "se:3", "so:3 x r:3", "r:2 x su:2 x cp:1 x spd:2"),
)
TABLES = pytest.mark.parametrize("ending", ["csv", "npz", "parquet"])
TIMES = np.array([0, 0.7, 2, 2.5, 4, 5])


def numbered(values, mark=""):
    """Columns of points or vectors: a0, a1, … in the first factor of a product, b0, b1, … in the second."""
    columns = {}
    for letter, part in zip("abcd", parts(values), strict=False):
        for i, column in enumerate(part.reshape(len(part), -1).T):
            both = {"_re": column.real, "_im": column.imag} if np.iscomplexobj(column) else {"": column}
            columns |= {f"{letter}{i}{mark}{end}": numbers for end, numbers in both.items()}
    return columns


def write_table(name, columns):
    if name.endswith("csv"):
        rows = [
            ",".join(map(str, row)) for row in zip(*map(np.ndarray.tolist, columns.values()), strict=True)
        ]
        write(name, "\n".join([",".join(columns), *rows]))
    elif name.endswith("npz"):
        np.savez(name, **columns)
    else:
        pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
        parquet.write_table(pa.table(columns), name)


def read_table(name):
    if name.endswith("csv"):
        return {key: np.array(cells, float) for key, cells in table(name).items()}
    if name.endswith("npz"):
        return dict(np.load(name))
    columns = pytest.importorskip("pyarrow.parquet").read_table(name)
    return {key: columns[key].to_numpy() for key in columns.column_names}


def assert_same_columns(found, expected):
    assert list(found) == list(expected)
    for key, numbers in expected.items():
        np.testing.assert_array_equal(found[key], numbers)


def test_the_spaces_are_all_that_there_are():
    words = {part.split(":")[0] for name in SPACES for part in name.split(" x ")}
    assert all(words.intersection(row) for row in ss._core.Handle.names())


@TABLES
@pytest.mark.parametrize("name", SPACES)
def test_tables_of_every_space(run, name, ending):
    space, p = ss.space(name), points_on(ss.space(name), step=0.4)
    write_table(f"a.{ending}", {"t": TIMES, **numbered(p)})
    run(f"fit a.{ending} --space '{name}' --bc-type not-a-knot -o fitted.npz")
    spline = ss.CubicSpline(TIMES, p, space, bc_type="not-a-knot")
    loaded = ss.load("fitted.npz")
    assert same_curve(loaded, spline)
    run("check fitted.npz")
    run(f"sample fitted.npz -n 11 --nu 0,1,2 -o b.{ending}")
    x = np.linspace(0, 5, 11)
    smooth = {"t": x, **numbered(spline(x)), **numbered(spline(x, 1), "_d1"), **numbered(spline(x, 2), "_d2")}
    assert_same_columns(read_table(f"b.{ending}"), smooth)
    # What was written can be read again.
    names = ",".join(key.removesuffix("_re") for key in numbered(p) if not key.endswith("_im"))
    run(f"fit b.{ending} --space '{name}' --columns {names} -o again.npz")
    assert same_curve(ss.load("again.npz"), ss.CubicSpline(x, spline(x), space))
    run("check again.npz")


@pytest.mark.parametrize("name", SPACES)
def test_many_curves_of_every_space(run, name):
    space, p = ss.space(name), points_on(ss.space(name), step=0.4)
    columns = {"t": np.array([*"001122"], float), **numbered(p)}
    write_table("a.npz", {"id": np.array([*"ababab"]), **columns})
    run(f"fit a.npz --space '{name}' --curve id -o b.npz")
    first, second = each(lambda part: part[::2], p), each(lambda part: part[1::2], p)
    fitted = ss.fit_many([([0, 1, 2], first), ([0, 1, 2], second)], space)
    assert ss.load_many("b.npz") == dict(zip("ab", fitted, strict=True))
    run("sample b.npz --every 1 --nu 1 -o c.npz")
    rates = [numbered(spline([0, 1, 2], 1), "_d1") for spline in fitted]
    found = read_table("c.npz")
    assert found.pop("id").tolist() == [*"aaabbb"] and found.pop("t").tolist() == [0, 1, 2] * 2
    assert_same_columns(found, {key: np.concatenate([rate[key] for rate in rates]) for key in rates[0]})
    run("plot b.npz --curve b -o b.png")


@pytest.mark.parametrize(
    "name, names",
    [
        ("s:2", ["x0", "x1", "x2"]),
        ("cp:1", ["x0_re", "x0_im", "x1_re", "x1_im"]),
        ("gr:1,2", ["m11", "m21"]),
        ("u:1", ["m11_re", "m11_im"]),
        ("r:1 x so:2 x s:1", ["x0", "m11", "m12", "m21", "m22", "x1", "x2"]),
        ("spd:1 x u:1 x r:1", ["m1_11", "m2_11_re", "m2_11_im", "x0"]),
    ],
)
def test_names_of_curves_that_were_made_in_python(run, name, names):
    ss.CubicSpline(None, points_on(ss.space(name), step=0.4), name).save("a.npz")
    run("sample a.npz -n 2 -o b.csv")
    assert list(table("b.csv")) == ["time", *names]
    run("sample a.npz -n 2 --nu 2 -o b.csv")
    assert list(table("b.csv")) == ["time", *(re.sub("(_re|_im|)$", r"_d2\1", key, count=1) for key in names)]


def test_names_in_large_matrices(run):
    ss.CubicSpline(None, points_on(ss.space("so:11"), n=3, step=0.4), "so:11").save("a.npz")
    run("sample a.npz -n 2 -o b.csv")
    names = list(table("b.csv"))
    assert (names[1], names[2], names[11], names[121]) == ("m1_1", "m1_2", "m1_11", "m11_11")


def test_arrays_of_matrices_and_of_complex_numbers(run):
    p = points_on(ss.space("so:3 x cp:1"), step=0.4)
    spline = ss.CubicSpline(TIMES, p, "so:3 x cp:1")
    np.savez("a.npz", psi=p[1], when=TIMES, R=p[0])
    run("fit a.npz --space 'so:3 x cp:1' --time when --columns R,psi -o b.npz")
    assert same_curve(ss.load("b.npz"), spline)
    np.savez("a.npz", points=p[0], t=TIMES, R=p[0])
    run("fit a.npz --space so:3 -o b.npz")
    assert same_curve(ss.load("b.npz"), ss.CubicSpline(TIMES, p[0], "so:3"))


def test_columns_of_complex_numbers(run):
    """Halves may stand anywhere; a column of its own is a complex number that is real."""
    up, down = np.array([1, 0.8, 0.6]), np.array([0, 0.6j, 0.64 + 0.48j])
    spline = ss.CubicSpline(None, np.stack([up, down], axis=1), "cp:1")
    columns = {"down_im": down.imag, "note": 0 * up, "up": up, "down_re": down.real}
    write_table("a.csv", columns)
    for names in ("up,down", "up,down_re,down_im", "up,down_im,down_re", "down_im,up,down_re"):
        run(f"fit a.csv --space cp:1 --columns {names} -o a.npz")
        loaded = ss.load("a.npz")
        swapped = np.flip(spline.points, axis=1)
        np.testing.assert_array_equal(loaded.points, swapped if names[:7] == "down_im" else spline.points)
    run("fit a.csv --space cp:1 --columns up,down -o a.npz")
    run("sample a.npz --every 1 -o b.csv")
    assert list(table("b.csv")) == ["time", "up_re", "up_im", "down_re", "down_im"]
    written = numbers(table("b.csv"), "up_re", "up_im", "down_re", "down_im").view(complex)
    np.testing.assert_array_equal(written, spline([0, 1, 2]))
    # In a real space they are two numbers, if both are named.
    run("fit a.csv --space r:2 --columns down_re,down_im -o a.npz")
    np.testing.assert_array_equal(ss.load("a.npz").points, np.stack([down.real, down.imag], 1))


# ---- times ----


def dated(cells):
    write("a.csv", "time,x\n" + "".join(f"{cell},{i}\n" for i, cell in enumerate(cells)))


@pytest.mark.parametrize(
    "cells, t",
    [
        (["2020-01-01", "2020-02-29"], ["2020-01-01", "2020-02-29"]),
        (["2020-01-01 12:00", "2020-02-29 06:30"], ["2020-01-01T12:00", "2020-02-29T06:30"]),
        (
            ["2020-01-01T12:00:00", "2020-01-01T12:00:00.25"],
            ["2020-01-01T12:00:00", "2020-01-01T12:00:00.25"],
        ),
        (["2020-01-01T12:00Z", "2020-01-01T12:30+00:00"], ["2020-01-01T12:00", "2020-01-01T12:30"]),
        (["2019-12-31T23:00-0300", "2020-01-01T05:00+02:30"], ["2020-01-01T02:00", "2020-01-01T02:30"]),
        (
            ["2020-01-01 00:00:00.5 +01", "2020-01-01 00:00:01 Z"],
            ["2019-12-31T23:00:00.5", "2020-01-01T00:00:01"],
        ),
    ],
)
def test_dates(run, cells, t):
    dated(cells)
    run("fit a.csv --space r:1 -o a.npz")
    np.testing.assert_array_equal(ss.load("a.npz").t, np.array(t, "datetime64[ms]"))


@pytest.mark.parametrize(
    "cells, found",
    [
        (
            ["2020-01-01", "2020-01-02T00:00"],
            "line 3: column 'time' holds '2020-01-02T00:00', but '2020-01-01' before",
        ),
        (["2020-01-01T00:00", "2020-01-02 00:00"], "write all times in the same way"),
        (["2020-01-01T00:00Z", "2020-01-02T00:00"], "write all times in the same way"),
        (["2020-01-01", "2020-01-02", "7"], "line 4: column 'time' holds '7', but '2020-01-01' before"),
        (["7", "2020-01-02"], "line 3: column 'time' holds '2020-01-02', but '7' before"),
        (["2020-01-01", "soon"], "line 3: column 'time' holds 'soon', not a time: write 0.5, 2021-08-29 or"),
        (["29.8.2021", "30.8.2021"], "line 2: column 'time' holds '29.8.2021', not a time"),
        (["2020-01-01", "2020-02-30"], "line 3: column 'time' holds '2020-02-30', which is no date"),
        (["2020-01-01", ""], "line 3: column 'time' is empty"),
        (["1", "nan"], "line 3: column 'time' holds 'nan', which is no time"),
        (["2020-01-02", "2020-01-01"], "line 3: time 2020-01-01 does not come after 2020-01-02 in line 2"),
        (["1", "1"], "line 3: time 1.0 does not come after 1.0 in line 2; times must increase"),
    ],
)
def test_times_that_are_not(fails, cells, found):
    dated(cells)
    problem = fails("fit a.csv --space r:1 -o a.npz")
    assert problem.startswith("a.csv, line ") and found in problem


def test_large_whole_times_are_exact(run):
    start = 1_630_000_000_000_000_001
    dated([start, start + 1, start + 3])
    run("fit a.csv --space r:1 -o a.npz")
    assert ss.load("a.npz").t.tolist() == [start, start + 1, start + 3]
    run("sample a.npz --every 1 -o b.csv")
    assert table("b.csv")["time"] == [str(start + i) for i in range(4)]
    run("sample a.npz -n 2 -o b.csv")
    assert table("b.csv")["time"] == [str(start), str(start + 3)]


def test_times_along_a_curve():
    day = np.array(["2020-01-01", "2020-01-02"], "datetime64[D]")
    assert len(times.every("10min", day)) == 145
    assert times.every("6H", day)[-1] == day[-1]
    assert times.every("7h", day).tolist() == times.every("25200", day).tolist()
    assert len(times.every("7h", day)) == 4
    half = times.every("0.5s", np.array(["2020-01-01T00:00:00", "2020-01-01T00:00:01"], "datetime64[s]"))
    assert half.astype(str).tolist()[1] == "2020-01-01T00:00:00.500"
    assert times.every("2d", day).tolist() == [day[0].astype("datetime64[s]").item()]
    np.testing.assert_array_equal(
        times.every("0.1", np.array([0.0, 1.0])), np.minimum(np.arange(11) * 0.1, 1)
    )
    assert times.every("0.3", np.array([0.0, 1.0]))[-1] == 3 * 0.3
    assert times.spread(3, day).astype(str).tolist()[1] == "2020-01-01T12:00:00"
    thirds = times.spread(4, np.array(["2020-01-01T00:00:00", "2020-01-01T00:00:01"], "datetime64[s]"))
    assert thirds.astype(str).tolist()[1] == "2020-01-01T00:00:00.333333"
    for fine in ("ns", "ps"):
        knots = np.array([0, 10**18 + 1], f"datetime64[{fine}]")
        spread = times.spread(1000, knots)
        assert (
            spread[0] == knots[0] and spread[-1] == knots[-1] and (np.diff(spread) > np.timedelta64(0)).all()
        )


@pytest.mark.parametrize(
    "step, found",
    [
        ("0", "larger than zero"),
        ("-1", "a step is a number"),
        ("ten", "a step is a number"),
        ("1y", "units are ns, us, ms, s, min, h, d"),
        ("0.5ns", "whole number of nanoseconds"),
        ("1e-12d", "whole number of nanoseconds"),
        ("1e30d", "too long"),
        ("1ns", "samples of one curve"),
        ("1e400", "too long"),
        ("1e-999999999", "too short"),
        ("1e99999999999999999999", "no number of any use"),
    ],
)
def test_steps_that_are_none(step, found):
    with pytest.raises(Problem, match=found):
        times.every(step, np.array(["2020-01-01", "2020-01-02"], "datetime64[D]"))


def test_steps_of_numbers(fails, run):
    write("axes.csv", AXES)
    run("fit axes.csv --space s:2 -o a.npz")
    assert "give a step without a unit" in fails("sample a.npz --every 10min -o b.csv")
    assert "samples of one curve" in fails("sample a.npz --every 1e-300 -o b.csv")
    assert "-n 0: the number of samples" in fails("sample a.npz -n 0 -o b.csv")
    assert "too long" in fails("sample a.npz --every 1e350 -o b.csv")
    assert "too short" in fails("sample a.npz --every 1e-350 -o b.csv")
    with pytest.raises(Problem, match="large whole numbers"):
        times.every("0.5", np.array([2**60, 2**60 + 5]))


@pytest.mark.parametrize(
    "start, kind", [(2**60, ">i8"), (2**62, "<i8"), (-(2**63), "<i8"), (2**64 - 9, "<u8")]
)
def test_steps_of_large_whole_numbers(start, kind):
    knots = np.array([start, start + 5, start + 8], kind)
    assert times.every("3", knots).tolist() == [start, start + 3, start + 6]
    assert times.every("99999999999999999999", knots).tolist() == [start]
    assert times.spread(3, knots).tolist() == [start, start + 4, start + 8]


def test_dates_that_cannot_be_counted():
    far = np.array(["300000-01-01", "300000-01-03"], "datetime64[D]")
    assert times.every("1d", far).astype("datetime64[D]")[-1] == far[-1]
    short = np.array([0, 10**9], "datetime64[ns]")
    assert times.every("200000d", short).tolist() == short[:1].tolist()
    fine, long = np.array([1, 2], "datetime64[as]"), np.array([-(2**62) - 1, 2**62 + 1], "datetime64[s]")
    assert times.spread(2, fine).tolist() == fine.tolist()
    for knots in (far, fine, long):
        step = "1s" if knots is not far else "1ns"
        with pytest.raises(Problem, match=f"from {knots[0]} to {knots[1]} cannot be counted"):
            times.every(step, knots)
    for knots in (far + np.timedelta64(10**9), long):
        with pytest.raises(Problem, match="cannot be counted in units of 1 microseconds"):
            times.spread(3, knots)


# ---- longitude and latitude ----


def test_a_track_across_the_date_line(run):
    write("a.csv", TRACK)
    run("fit a.csv --lonlat -o a.npz")
    spline = ss.load("a.npz")
    lon, lat = np.array([row[1:] for row in FIXES]).T
    np.testing.assert_allclose(spline.points, from_lonlat(lon, lat), atol=1e-15)
    run("sample a.npz --every 10min --nu 0,1,2 -o b.csv")
    columns = table("b.csv")
    assert list(columns) == ["time", "lon", "lat", "east_d1", "north_d1", "east_d2", "north_d2"]
    track = numbers(columns, "lon", "lat")
    assert (np.abs(track[:, 0]) > 175).all() and (np.abs(track[:, 0]) <= 180).all()
    assert np.count_nonzero(np.abs(np.diff(track[:, 0])) > 300) == 1
    # Differences along the curve, in degrees of arc and seconds.
    rate = numbers(columns, "east_d1", "north_d1")
    middle = np.radians(track[1:-1, 1])
    turn = (track[2:] - track[:-2] + 180) % 360 - 180
    seen = turn / 1200 * np.stack([np.cos(middle), np.ones_like(middle)], axis=1)
    np.testing.assert_allclose(rate[1:-1], seen, rtol=1e-3)
    acceleration = numbers(columns, "east_d2", "north_d2")
    assert np.abs(acceleration[[0, -1]]).max() < 1e-12 * np.abs(acceleration).max()  # natural ends


def test_a_track_over_the_pole(run):
    write("a.csv", "t,Longitude,LATITUDE\n0,10,88\n1,10,90\n2,190,88\n")
    run("fit a.csv --lonlat -o a.npz")
    run("sample a.npz --every 0.5 --nu 0,1 -o b.csv")
    columns = table("b.csv")
    assert list(columns)[:3] == ["t", "Longitude", "LATITUDE"]
    np.testing.assert_allclose(numbers(columns, "LATITUDE")[:, 0], [88, 89, 90, 89, 88], atol=1e-9)
    np.testing.assert_allclose(np.hypot(*numbers(columns, "east_d1", "north_d1").T), 2, atol=1e-9)


def test_lonlat_by_column_names(run, fails):
    write("a.csv", "t,b,l\n0,50,7\n1,51,8\n")
    run("fit a.csv --lonlat --columns l,b -o a.npz")
    np.testing.assert_allclose(to_lonlat(ss.load("a.npz").points), [[7, 8], [50, 51]], atol=1e-13)
    assert "--lonlat needs columns lon and lat" in fails("fit a.csv --lonlat -o b.npz")
    assert "longitude and latitude are 2 numbers" in fails("fit a.csv --lonlat --columns l -o b.npz")
    assert "is for sphere:2, not for sphere:3" in fails("fit a.csv --lonlat --space s:3 -o b.npz")
    write("a.csv", "t,lat,lon\n0,50,7\n1,51,98\n")
    problem = fails("fit a.csv --lonlat --columns lat,lon -o b.npz")
    assert problem.startswith("a.csv, line 3: latitude 98 is not between -90 and 90 degrees")


def test_lonlat_of_a_curve_that_was_made_in_python(run, fails):
    ss.CubicSpline(None, np.eye(3), "s:2").save("a.npz")
    run("sample a.npz -n 3 -o b.csv")
    assert list(table("b.csv")) == ["time", "x0", "x1", "x2"]
    run("sample a.npz -n 3 --lonlat -o b.csv")
    np.testing.assert_allclose(numbers(table("b.csv"), "lon", "lat")[:2], [[0, 0], [90, 0]], atol=1e-13)
    ss.CubicSpline(None, [[0], [1]], "r:1").save("c.npz")
    assert fails("sample c.npz -n 3 --lonlat -o b.csv") == "--lonlat is for sphere:2, not for euclidean:1"


# ---- several curves ----


def test_curves_in_one_file(run):
    write("pair.csv", PAIR)
    out = run("fit pair.csv --space s:2 --curve id -o pair.npz")
    assert out.startswith("pair.npz: 2 curves through 5 points of sphere:2, converged: ")
    e = np.eye(3)
    fitted = ss.fit_many([([0, 2, 3], e[[0, 2, 1]]), ([1, 2], e[1:])], "s:2")
    assert ss.load_many("pair.npz") == dict(zip("ab", fitted, strict=True))
    run("sample pair.npz --every 0.5 -o out.csv")
    columns = table("out.csv")
    assert list(columns) == ["t", "id", "x", "y", "z"]
    assert columns["id"] == ["a"] * 7 + ["b"] * 3
    np.testing.assert_array_equal(numbers(columns, *"xyz")[7:], fitted[1]([1, 1.5, 2]))
    lines = run("check pair.npz").splitlines()
    assert [line.split()[0] for line in lines] == ["curve", "a", "b", "All"]
    run("plot pair.npz --curve b -o b.svg")
    assert "<svg" in Path("b.svg").read_text(encoding="utf-8")


def test_one_curve_with_a_name_is_a_collection_too(run):
    write("pair.csv", "\n".join(line for line in PAIR.splitlines() if not line.startswith("b")))
    run("fit pair.csv --space s:2 --curve id -o one.npz")
    assert list(ss.load_many("one.npz")) == ["a"]
    run("sample one.npz -n 2 -o out.csv")
    assert table("out.csv")["id"] == ["a", "a"]
    run("plot one.npz -o one.png")


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
    assert fails("plot pair.npz -o a.png") == "pair.npz has 2 curves; say which with --curve: a, b"
    assert fails("plot pair.npz --curve c -o a.png") == "pair.npz has no curve 'c'; there are a, b"
    write("bad.csv", PAIR + "c,3,1,0,0\n")
    problem = "bad.csv, line 7: this is the only point of curve 'c'; a curve needs two"
    assert fails("fit bad.csv --space s:2 --curve id -o bad.npz") == problem
    write("bad.csv", PAIR + "b,1.5,1,0,0\n")
    problem = "bad.csv, line 7: time 1.5 of curve 'b' does not come after 2.0 in line 5; times must increase"
    assert fails("fit bad.csv --space s:2 --curve id -o bad.npz") == problem
    write("bad.csv", PAIR + "b,4,0,0,-1\n")
    problem = fails("fit bad.csv --space s:2 --curve id -o bad.npz")
    assert problem.startswith(
        "bad.csv: the point in line 5 and the point in line 7 of curve 'b' lie at or past"
    )
    write("bad.csv", PAIR + ",5,0,0,1\n")
    assert fails("fit bad.csv --space s:2 --curve id -o bad.npz") == "bad.csv, line 7: column 'id' is empty"


def test_samples_at_given_times(run, fails):
    write("pair.csv", PAIR)
    run("fit pair.csv --space s:2 --curve id -o pair.npz")
    a, b = ss.load_many("pair.npz").values()
    write("at.csv", "id,t\nb,1.5\na,0.5\nb,1.25\n")
    run("sample pair.npz --at at.csv -o out.csv")
    columns = table("out.csv")
    assert (columns["id"], columns["t"]) == (["b", "a", "b"], ["1.5", "0.5", "1.25"])
    np.testing.assert_array_equal(numbers(columns, *"xyz"), [b(1.5), a(0.5), b(1.25)])
    np.savez("at.npz", T=[1.5, 1.25])
    run("sample pair.npz --at at.npz -o out.csv")
    assert table("out.csv")["id"] == ["a", "a", "b", "b"]
    write("at.csv", "when\n1\n")
    run("sample pair.npz --at at.csv -o out.csv")
    write("at.csv", "t,id\n1.5,q\n")
    assert (
        fails("sample pair.npz --at at.csv -o x.csv")
        == "at.csv, line 2: there is no curve 'q'; there are a, b"
    )
    write("at.csv", "t\n1.5\n2.5\n")
    problem = (
        "at.csv, line 3: time 2.5 is outside curve 'b', which runs from 1.0 to 2.0; fit with --extrapolate"
    )
    assert fails("sample pair.npz --at at.csv -o x.csv").startswith(problem)
    write("at.csv", "when,id\n1.5,a\n")
    assert "at.csv has no column 't' of times; there are when, id" in fails(
        "sample pair.npz --at at.csv -o x.csv"
    )
    write("at.csv", "t\n2020-01-01\n")
    assert "are numbers, but these are dates" in fails("sample pair.npz --at at.csv -o x.csv")


def test_samples_outside(run):
    write("axes.csv", AXES)
    write("at.csv", "t\n-1\n4\n")
    run("fit axes.csv --space s:2 --extrapolate continue -o axes.npz")
    run("sample axes.npz --at at.csv -o out.csv")
    spline = ss.CubicSpline([0, 1, 3], np.eye(3), "s:2", extrapolate=True)
    np.testing.assert_array_equal(numbers(table("out.csv"), *"xyz"), spline([-1, 4]))
    write("ring.csv", AXES + "4,1,0,0\n")
    run("fit ring.csv --space s:2 --bc-type periodic -o ring.npz")
    run("sample ring.npz --at at.csv -o out.csv")
    run("check ring.npz")


def test_collections_in_python(folder):
    one, other = ss.fit_many([(None, np.eye(3)), ([1, 2], np.eye(3)[:2])], "s:2", bc_type="not-a-knot")
    ss.save_many({"": one, "b\0é": other}, folder / "c.npz")
    loaded = ss.load_many(folder / "c.npz")
    assert loaded == {"": one, "b\0é": other}
    assert loaded[""].report == one.report and loaded[""].bc_type == "not-a-knot"
    product = ss.space("s:2 x r:1")
    v = (np.array([0.0, 1, 0]), np.array([2.0]))
    both = ss.CubicSpline(None, (np.eye(3), np.eye(3)[:, :1]), product, bc_type=((1, v), "natural"))
    ss.save_many({"p": both, "q": both}, folder / "p.npz")
    assert ss.load_many(folder / "p.npz")["q"] == both
    with pytest.raises(ss.ValidationError, match="of one space"):
        ss.save_many({"p": both, "q": one}, folder / "d.npz")
    with pytest.raises(ss.ValidationError, match="of one space"):
        ss.save_many({}, folder / "d.npz")
    with pytest.raises(ss.ValidationError, match="single curves"):
        ss.save_many({"a": ss.CubicSpline(None, [np.eye(3)] * 2, "s:2")}, folder / "d.npz")
    with pytest.raises(ss.ValidationError, match=r"read them with symspline\.load_many"):
        ss.load(folder / "c.npz")
    one.save(folder / "one.npz")
    with pytest.raises(ss.ValidationError, match=r"read it with symspline\.load"):
        ss.load_many(folder / "one.npz")
    arrays = dict(np.load(folder / "c.npz"))
    for key, value in {"knots": [3, 3], "names": '["a"]', "format": "other", "report": "[]"}.items():
        np.savez(folder / "bad.npz", **arrays | {key: value})
        with pytest.raises(ss.ValidationError, match=r"bad\.npz"):
            ss.load_many(folder / "bad.npz")


# ---- check ----


@pytest.mark.parametrize("name", [*SPACES, "s:1", "h:5"])
def test_check_on_every_space(run, fails, name):
    space = ss.space(name)
    t = np.cumsum(np.random.default_rng(3).uniform(0.5, 1.5, 30))
    ss.CubicSpline(t, points_on(space, 30, step=0.5), space, bc_type="not-a-knot").save("a.npz")
    assert "All is within what rounding allows." in run("check a.npz")
    arrays = dict(np.load("a.npz"))
    last = max(key for key in arrays if key.startswith("velocities"))
    arrays[last][17] *= 1 + 1e-6
    np.savez("bent.npz", **arrays)
    assert "more than rounding allows" in fails("check bent.npz", code=1)


@pytest.mark.parametrize("name", ["rp:2", "cp:2", "gr:2,4", "cgr:2,4"])
def test_check_where_a_point_has_many_arrays(run, name):
    space, rng = ss.space(name), np.random.default_rng(6)
    p = points_on(space, 20, step=0.5)
    if len(space.point_shape) == 1:
        p = (
            p * np.exp(1j * rng.uniform(0, 6, (20, 1)))
            if name[0] == "c"
            else p * rng.choice([-1, 1], (20, 1))
        )
    else:
        p = p @ ss.space("u:2" if name[0] == "c" else "o:2").random_point(rng, 20)
    ss.CubicSpline(None, p, space).save("a.npz")
    run("check a.npz")


@pytest.mark.parametrize("name", ["spd:2", "hpd:3"])
@pytest.mark.parametrize("unit", [1e-9, 1, 1e9])
def test_check_of_positive_definite_matrices_of_any_size(run, fails, name, unit):
    """Neither long and thin nor tiny ones count as worse than others."""
    space = ss.space(name)
    stretch = unit * np.geomspace(1, 1e3, space.point_shape[0])
    p = points_on(space, 20, step=0.5)
    spline = ss.CubicSpline(None, stretch[:, None] * p * stretch / unit, space)
    spline.save("a.npz")
    position = run("check a.npz").splitlines()[1].split()[2]
    assert float(position) < 1e-8
    arrays = dict(np.load("a.npz"))
    arrays["velocities"][7] *= 1 + 1e-4
    np.savez("bent.npz", **arrays)
    fails("check bent.npz", code=1)


@pytest.mark.parametrize("far", [1e-6, 1e3, 1e6])
@pytest.mark.parametrize("name", ["se:2", "se:3"])
def test_check_of_poses_far_away(run, name, far):
    p = points_on(ss.space(name), 20, step=0.5)
    p[:, :-1, -1] += far
    ss.CubicSpline(None, p, name).save("a.npz")
    run("check a.npz")


def test_check_far_out_in_hyperbolic_space(run):
    """Ambient numbers are large there; lengths of the space are not."""
    rng = np.random.default_rng(4)
    space = ss.Hyperbolic(2)
    for far in (2, 4, 6):
        moved = space.transvection([1, 0, 0], [0, far, 0], walk(space, 0.3, 20, rng))
        ss.CubicSpline(None, space.project(moved), space).save("a.npz")
        run("check a.npz")


def test_check_finds_what_is_wrong(run, fails, capsys):
    good = ss.CubicSpline(None, walk(ss.Sphere(2), 0.5, 8, np.random.default_rng(1)), "s:2")
    good.save("a.npz")
    arrays = dict(np.load("a.npz"))
    arrays["velocities"][3] *= 1 + 1e-6
    np.savez("bent.npz", **arrays)
    assert main(["check", "bent.npz"]) == 1
    out, err = capsys.readouterr()
    assert err == "symspline: bent.npz: more than rounding allows in the curve\n"
    position, velocity, acceleration = map(float, out.splitlines()[1].split()[2:])
    assert max(position, velocity) < 1e-14 and 1e-7 < acceleration < 1e-4
    bent, lost = ss.load("bent.npz"), np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0.0]])
    lost = ss.CubicSpline(None, lost, "s:2", on_failure="ignore")
    ss.save_many({"good": good, "bent": bent, "lost": lost}, "many.npz")
    problem = fails("check many.npz", code=1)
    assert problem == "many.npz: more than rounding allows in 2 of 3 curves: bent, lost"


def test_check_sees_the_seam(fails):
    ring = walk(ss.Sphere(2), 0.5, 6, np.random.default_rng(2))
    ss.CubicSpline(None, [*ring, ring[0]], "s:2", bc_type="periodic").save("ring.npz")
    arrays = dict(np.load("ring.npz"))
    arrays["velocities"][0] *= 1.01
    np.savez("ring.npz", **arrays)
    fails("check ring.npz", code=1)
    arrays["bc_type"] = json.dumps("natural")
    arrays["velocities"][0] /= 1.01
    np.savez("ring.npz", **arrays)
    assert main(["check", "ring.npz"]) == 0


# ---- what can be wrong ----


@pytest.mark.parametrize(
    "text, options, problem",
    [
        (AXES, "--space s:2 --time tt", "a.csv has no column 'tt'; did you mean 't'?"),
        (AXES, "--space s:2 --columns X,Y,Q", "a.csv has no column 'X'; did you mean 'x'?"),
        (AXES, "--space s:2 --curve storm", "a.csv has no column 'storm'; there are t, x, y, z"),
        (
            AXES,
            "--space r:2",
            "a.csv: a point of euclidean:2 has 2 numbers, and there are 3 columns: x, y, z; say which",
        ),
        (AXES, "--space r:2 --columns x,x", "column 'x' of a.csv cannot have two meanings"),
        (AXES, "--space r:2 --columns t,x --time t", "column 't' of a.csv cannot have two meanings"),
        (AXES, "", "say which space the points are on with --space, such as --space sphere:2"),
        (AXES, "--space foo:2", "unknown space 'foo:2'; known are"),
        (AXES + "4,1,0,n/a\n", "--space s:2", "a.csv, line 5: column 'z' holds 'n/a', which is not a number"),
        (AXES + "\n\n4,1,0,\n", "--space s:2", "a.csv, line 7: column 'z' is empty"),
        (
            AXES + "4,1,0,inf\n",
            "--space s:2",
            "a.csv, line 5: column 'z' holds inf, which is not a finite number",
        ),
        (AXES + "4,1,0\n", "--space s:2", "a.csv, line 5: 3 cells, but the first line names 4 columns"),
        (AXES + '4,1,0,"0\n', "--space s:2", "a.csv, line 5: unexpected end of data"),
        (AXES + "4,1.001,0,0\n", "--space s:2", "a.csv: the point in line 5 is off the space by 1.000e-3"),
        (
            AXES + "4,0,0,-1\n",
            "--space s:2",
            "a.csv: the point in line 4 and the point in line 5 of the curve lie at or",
        ),
        ("", "--space s:2", "a.csv is empty"),
        ("\n\n", "--space s:2", "a.csv is empty"),
        ("t,x\n", "--space r:1", "a.csv has no rows below the names of its columns"),
        ("t,x\n1,2\n", "--space r:1", "a.csv, line 2: this is the only point; a curve needs two"),
        ("1,2\n3,4\n", "--space r:2", "a.csv: the first line must name the columns, but holds numbers"),
        ("t;x\n1;2\n", "--space r:1", "a.csv: cells must be separated by commas; the first line is 't;x'"),
        ("t,x,x\n1,2,3\n", "--space r:1", "a.csv: the first line names two columns 'x'"),
        (
            "t,x,y\n1,a,3\n2,4,5\n",
            "--space r:2",
            "has 2 numbers, and there are 1 columns: y; say which with --columns (no numbers in the first row of x)",
        ),
    ],
)
def test_bad_tables(fails, text, options, problem):
    write("a.csv", text)
    assert problem in fails(f"fit a.csv {options} -o a.npz")


HALVES = "t,a_re,a_im,b_re,b_im\n0,1,0,0,0\n1,0.6,0,0,0.8\n"


@pytest.mark.parametrize(
    "text, options, problem",
    [
        (
            HALVES,
            "--space sphere:1",
            "a.csv: a_re and a_im are a complex number where a real one belongs: a point of sphere:1 has 2 numbers; "
            "did you mean --space cp:1?",
        ),
        (
            HALVES,
            "--space r:2 --columns a",
            "a point of euclidean:2 has 2 numbers; name its columns one by one with",
        ),
        (
            HALVES,
            "--space 'r:1 x cp:1' --columns a,b_re,b_im,t --time t",
            "column 't' of a.csv cannot have two meanings",
        ),
        (
            "t,x," + HALVES[2:].replace("\n0,", "\n0,0,").replace("\n1,", "\n1,0,"),
            "--space 'cp:1 x r:1'",
            "a.csv: b_re and b_im are a complex number where a real one belongs: a point of cp:1 x euclidean:1 has 3 "
            "numbers (cp:1: 2 complex numbers, A_re and A_im each; euclidean:1: 1 number); name its columns",
        ),
        (
            HALVES,
            "--space su:2",
            "a.csv: a point of su:2 has 4 complex numbers, A_re and A_im each, a 2 x 2 matrix row by row, and there "
            "are 2 numbers: a, b; say which with --columns",
        ),
        (
            HALVES,
            "--space se:2 --columns a_re,b_re",
            "a.csv: a point of se:2 has 9 numbers, a 3 x 3 matrix row by row, and there are 2 columns: a_re, b_re",
        ),
        (
            HALVES,
            "--space cp:1 --columns a,b_re",
            "a.csv: column 'b_re' is half of a complex number, and there is no 'b_im' in --columns",
        ),
        (HALVES, "--space cp:1 --columns a,a_re", "column 'a_re' of a.csv cannot have two meanings"),
        (
            HALVES,
            "--space cp:1 --columns a,c",
            "a.csv has no column 'c'; there are t, a_re, a_im, b_re, b_im",
        ),
        (
            HALVES.replace("b_im", "c"),
            "--space cp:1 --columns a,b",
            "a.csv has a column 'b_re', but no 'b_im'; a complex number needs both",
        ),
        (
            HALVES.replace("b_re", "c"),
            "--space cp:2",
            "a.csv: column 'b_im' is half of a complex number, and there is no 'b_re' in the table",
        ),
        (
            HALVES.replace("0,1,0,0,0", "0,1,0,0,"),
            "--space cp:1",
            "a.csv: column 'b_re' is half of a complex number, and there is no 'b_im' with numbers",
        ),
        (
            HALVES.replace("0,1,0,0,0", "0,1,0,0,"),
            "--space cp:1 --columns a,b",
            "a.csv, line 2: column 'b_im' is empty",
        ),
        (HALVES + "2,1,0,0,\n", "--space cp:1", "a.csv, line 4: column 'b_im' is empty"),
        (HALVES + "2,1,0,0,0.1\n", "--space cp:1", "a.csv: the point in line 4 is off the space by 5.000e-3"),
        (HALVES, "--space gr:4,2", "gr:4,2 asks for subspaces larger than the space; did you mean gr:2,4?"),
        (HALVES, "--space se:4", "se:n needs n = 2 or 3, not 4"),
    ],
)
def test_bad_columns_of_complex_numbers_and_matrices(fails, text, options, problem):
    write("a.csv", text)
    assert problem in fails(f"fit a.csv {options} -o a.npz")


@pytest.mark.parametrize(
    "name, change, problem",
    [
        ("so:3", lambda p: 1.01 * p, "the point in line 5 is off the space by 1.741e-2: its columns are not"),
        ("so:3", lambda p: -p, "the point in line 5 is off the space: its determinant is -1"),
        ("o:3", lambda p: -p, "the point in line 4 and the point in line 5 of curve 'a' have opposite"),
        ("r:1 x o:3", lambda p: -p, "the point in line 4 and the point in line 5 of curve 'a' have opposite"),
        ("su:2", lambda p: 1j * p, "its determinant is not 1 but has the phase 3.142e0 (u:2 takes it)"),
        ("spd:2", lambda p: -p, "the point in line 5 is off the space: it is not positive definite"),
        ("hpd:2", lambda p: p + 1j * p[0, 0] * np.eye(2), "line 5 is off the space by"),
        ("se:2", lambda p: p.T, "the point in line 5 is off the space by"),
        ("gr:1,2", lambda p: 2 * p, "the point in line 5 is off the space by"),
        ("r:2 x gr:2,4", lambda p: 2 * p, "the part in gr:2,4 of the point in line 5 is off the space by"),
        (
            "so:3",
            lambda p: p @ np.diag([1, -1, -1]),
            "line 4 and the point in line 5 of curve 'a' lie at or past",
        ),
        ("r:1 x u:1", lambda p: -p, "line 4 and the point in line 5 of curve 'a' lie at or past"),
    ],
)
def test_bad_points_in_matrix_spaces(fails, name, change, problem):
    """The fourth of equal points is another one."""
    space = ss.space(name)
    points = points_on(space, 2, step=0.4)
    rows = each(lambda part: np.concatenate([part[[0, 0, 0]], part[:1]]), points)
    parts(rows)[-1][3] = change(parts(rows)[-1][3])
    columns = {"t": np.arange(4), "id": np.array([*"aaaa"]), **numbered(rows)}
    write_table("a.csv", columns)
    found = fails(f"fit a.csv --space '{name}' --curve id -o b.npz")
    assert found.startswith("a.csv: ") and problem in found
    write_table("a.npz", columns)
    for line, row in (("line 4", "row 2 (counted from 0)"), ("line 5", "row 3 (counted from 0)")):
        problem = problem.replace(line, row)
    assert problem in fails(f"fit a.npz --space '{name}' --curve id -o b.npz")


def test_points_are_moved_onto_the_space_by_rounding_only(run, fails):
    write("a.csv", "t,x,y\n0,1.00001,0\n1,0.70711,0.70711\n")
    run("fit a.csv --space s:1 -o a.npz")
    np.testing.assert_allclose(np.linalg.norm(ss.load("a.npz").points, axis=1), 1, atol=1e-15)
    write("a.csv", "t,x,y\n0,1.001,0\n1,0.70711,0.70711\n")
    problem = fails("fit a.csv --space s:1 -o b.npz")
    assert problem.startswith("a.csv: the point in line 2 is off the space by 1.000e-3")
    assert "1e-4" in problem and "space.project" not in problem


def test_bad_usage(run, fails):
    write("a.csv", AXES)
    run("fit a.csv --space s:2 -o a.npz")
    assert fails("").endswith("(see symspline --help)")
    assert "invalid choice: 'ft'" in fails("ft")
    assert (
        fails("fit a.csv --space s:2")
        == "the following arguments are required: -o (see symspline fit --help)"
    )
    assert "unrecognized arguments: --tiem" in fails("fit a.csv --space s:2 --tiem t -o b.npz")
    assert "--every -n --at is required" in fails("sample a.npz -o b.csv")
    assert "--" in fails("sample a.npz --every=-- -o b.csv")
    assert "not allowed with" in fails("sample a.npz -n 3 --every 1 -o b.csv")
    assert fails("sample a.npz -n 3 --nu 0,3 -o b.csv").startswith("--nu 0,3: give one or more of 0, 1 and 2")
    assert fails("fit a.csv --space s:2 -o b.csv") == "b.csv: the name of a file of curves must end in .npz"
    ending = "b.txt: the name of a table must end in .csv or .npz or .parquet"
    assert fails("sample a.npz -n 3 -o b.txt") == ending
    assert fails("plot a.npz -o b.txt").startswith("b.txt: the name of a picture must end in .")
    assert "must end in .csv" in fails("fit a.txt --space s:2 -o b.npz")


def test_files_that_cannot_be_read(fails):
    assert fails("fit no.csv --space s:2 -o a.npz") == "cannot read no.csv: No such file or directory"
    assert fails("fit no.npz --space s:2 -o a.npz") == "cannot read no.npz: No such file or directory"
    assert fails("check no.npz") == "cannot read no.npz: No such file or directory"
    os.mkdir("folder.csv")
    assert fails("fit folder.csv --space s:2 -o a.npz") == "cannot read folder.csv: Is a directory"
    Path("latin.csv").write_bytes("t,x\n0,1\n1,2°\n".encode("latin-1"))
    assert fails("fit latin.csv --space r:1 -o a.npz") == "latin.csv is not text in UTF-8"
    write("a.npz", "no zip")
    assert fails("check a.npz") == "a.npz is not a file of curves, such as `symspline fit` makes"
    np.savez("a.npz", x=1)
    assert "a.npz" in fails("check a.npz")
    ss.CubicSpline(None, [[0], [1]], "r:1").save("a.npz")
    np.savez("a.npz", **dict(np.load("a.npz")), columns="{}")
    assert fails("check a.npz").startswith("a.npz is damaged")
    Path("a.npz").write_bytes(Path("a.npz").read_bytes()[:-300])
    assert "a.npz" in fails("check a.npz")


def in_archive(name, **arrays):
    """A copy of a.npz in which some arrays are others."""
    np.savez(name, **(dict(np.load("a.npz")) | arrays))


@pytest.mark.parametrize(
    "columns",
    [
        "no JSON",
        pytest.param("[" * 100_000, id="deep"),
        "[]",
        "{}",
        '{"points": 3}',
        '{"points": ["x", "y"]}',
        '{"points": ["x", "y", 3]}',
        '{"points": ["x", "y", "z"], "time": null}',
        '{"points": ["x", "y", "z"], "curve": 1}',
        '{"points": ["x", "y", "z"], "lonlat": "no"}',
        '{"points": ["x", "y", "z"], "utc": 2}',
        '{"points": ["x", "y", "z"], "lonlat": true}',
        '{"points": ["x", "y", "z"], "surprise": 1}',
    ],
)
def test_names_of_columns_that_are_damaged(run, fails, columns):
    write("axes.csv", AXES)
    run("fit axes.csv --space s:2 -o a.npz")
    in_archive("b.npz", columns=columns)
    assert fails("sample b.npz -n 3 -o c.csv").startswith("b.npz is damaged: ")


def test_longitudes_of_other_spaces(fails):
    ss.CubicSpline(None, [[0.0, 0], [1, 2]], "r:2").save("a.npz")
    in_archive("b.npz", columns='{"points": ["lon", "lat"], "lonlat": true}')
    assert fails("check b.npz") == "b.npz is damaged: its names of columns do not suit euclidean:2"


def claim(entry, method):
    """A copy of a.npz in which an entry claims to be compressed by a method by which it is not."""
    data, name = bytearray(Path("a.npz").read_bytes()), f"{entry}.npy".encode()
    # Names end the headers of entries, and their lines in the list of all at the end of the file.
    data[data.index(name) - 30 + 8] = data[data.rindex(name) - 46 + 10] = method
    Path("b.npz").write_bytes(data)


@pytest.mark.parametrize("method", [8, 12, 14, 99], ids=["deflate", "bzip2", "lzma", "unknown"])
def test_archives_that_cannot_be_unpacked(run, fails, method):
    write("axes.csv", AXES)
    run("fit axes.csv --space s:2 -o a.npz")
    for entry in ("points", "columns"):
        claim(entry, method)
        assert "b.npz" in fails("check b.npz")
    np.savez("a.npz", t=[0.0, 1, 2], x=[0.0, 1, 0])
    claim("x", method)
    assert "b.npz" in fails("fit b.npz --space r:1 -o c.npz")


def test_archives_with_a_damaged_list_of_entries(fails):
    ss.CubicSpline(None, np.eye(3), "s:2").save("a.npz")
    data = Path("a.npz").read_bytes()
    for damaged in (data.replace(b"PK\1\2", b"PK\1\0"), data[:-10] + b"\xff" * 4 + data[-6:]):
        Path("b.npz").write_bytes(damaged)
        assert fails("check b.npz") == "b.npz is not a file of curves, such as `symspline fit` makes"


def test_messages_are_short(fails):
    write("a.csv", "t,x\n0,1\n1," + "9" * 5000 + "x\n")
    assert 1000 < len(fails("fit a.csv --space r:1 -o a.npz")) < 1100


def test_pictures_without_matplotlib(run, fails, monkeypatch):
    write("a.csv", AXES)
    run("fit a.csv --space s:2 -o a.npz")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert "pip install 'symspline[plot]'" in fails("plot a.npz -o a.png")


def test_a_fit_that_does_not_converge(fails, monkeypatch):
    monkeypatch.setattr("symspline.cli.fit.fit_many", partial(ss.fit_many, max_iter=2))
    write("pair.csv", PAIR)
    write("old.npz", "as it was")
    problem = fails("fit pair.csv --space s:2 --columns x,y,z --curve id -o old.npz", code=1)
    assert problem.startswith("pair.csv: no convergence of curve 'a': residual")
    assert "max_iter" not in problem
    write("axes.csv", AXES)
    problem = fails("fit axes.csv --space s:2 -o old.npz", code=1)
    assert problem.startswith("axes.csv: no convergence of the curve: residual")
    assert Path("old.npz").read_text() == "as it was"


# ---- output ----


def test_output_that_cannot_be_written(run, fails, monkeypatch):
    write("a.csv", AXES)
    run("fit a.csv --space s:2 -o a.npz")
    assert fails("fit a.csv --space s:2 -o no/b.npz") == "cannot write no/b.npz: there is no folder no"
    os.mkdir("b.npz")
    assert fails("fit a.csv --space s:2 -o b.npz") == "cannot write b.npz: it is a folder"
    assert fails("plot a.npz -o no/b.png").startswith("cannot write no/b.png")
    assert fails("sample a.npz -n 3 -o no/b.csv").startswith("cannot write no/b.csv")
    assert fails("demo --out a.csv") == "cannot make the folder a.csv: File exists"
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert fails("fit a.csv --space s:2 -o c.npz") == "cannot write c.npz: no permission to write into ."


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission(run, fails, folder):
    write("a.csv", AXES)
    folder.chmod(0o500)
    try:
        assert "no permission" in fails("fit a.csv --space s:2 -o a.npz")
    finally:
        folder.chmod(0o700)


ENDINGS = pytest.mark.parametrize("ending", ["csv", "npz", "parquet", "png", "fit"])


def written_into(ending, folder):
    """A line that writes more than 16 kB into a folder, and the name of the file."""
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    if ending == "fit":
        return f"fit long.csv --space r:1 -o {folder}/out.npz", f"{folder}/out.npz"
    verb = "plot a.npz" if ending == "png" else "sample a.npz -n 3000"
    return f"{verb} -o {folder}/out.{ending}", f"{folder}/out.{ending}"


@pytest.fixture
def curves(run):
    """Files to begin with: ``a.npz``, and ``long.csv``."""
    write("a.csv", AXES)
    run("fit a.csv --space s:2 -o a.npz")
    write("long.csv", "x\n" + "".join(f"{i}\n" for i in range(3000)))


@ENDINGS
def test_a_full_disk(curves, fails, folder, ending):
    os.mkdir("disk")
    mount = ["mount", "-t", "tmpfs", "-o", "size=16k", "tmpfs", "disk"]
    if not shutil.which("mount") or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("only root can mount a small disk")
    try:
        line, out = written_into(ending, "disk")
        write(out, "as it was")
        assert fails(line) == f"cannot write {out}: No space left on device"
        assert [(path.name, path.read_text()) for path in Path("disk").iterdir()] == [(out[5:], "as it was")]
    finally:
        subprocess.run(["umount", "disk"], check=True)


@ENDINGS
def test_writing_that_fails_midway(curves, fails, ending):
    resource = pytest.importorskip("resource")
    line, out = written_into(ending, ".")
    write(out, "as it was")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (12_000, hard))
    try:
        assert fails(line) == f"cannot write {Path(out)}: File too large"
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert Path(out).read_text() == "as it was"


@pytest.mark.parametrize("where", ["fitting", "saving"])
def test_interrupted(fails, monkeypatch, where):
    def interrupt(file, *_, **__):
        if where == "saving":
            file.write(b"half of it")
        raise KeyboardInterrupt

    write("a.csv", AXES)
    write("a.npz", "as it was")
    target = {"fitting": "symspline.cli.fit.fit_many", "saving": "numpy.savez"}[where]
    monkeypatch.setattr(target, interrupt)
    assert fails("fit a.csv --space s:2 -o a.npz", code=130) == "interrupted"
    assert Path("a.npz").read_text() == "as it was"


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_interrupted_by_a_signal(curves, folder):
    os.mkdir("out")
    line = [sys.executable, "-m", "symspline", "sample", "a.npz", "-n", "1000000", "-o", "out/out.csv"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 20
        while not any(path.stat().st_size for path in Path("out").iterdir()) and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=20)
    assert (process.returncode, out, err) == (130, "", "symspline: interrupted\n")
    assert not os.listdir("out")


def test_nobody_reads_on(curves):
    line = [sys.executable, "-m", "symspline", "check", "a.npz"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 141


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_output_into_a_full_disk(curves):
    with open("/dev/full", "w") as full:
        line = [sys.executable, "-m", "symspline", "check", "a.npz"]
        done = subprocess.run(line, stdout=full, stderr=subprocess.PIPE, text=True, timeout=20)
    problem = "symspline: cannot write the output: No space left on device\n"
    assert (done.returncode, done.stderr) == (2, problem)


def test_not_enough_memory(curves, fails, monkeypatch):
    def too_much(*_):
        raise MemoryError

    monkeypatch.setattr("symspline.cli.sample.spread", too_much)
    assert fails("sample a.npz -n 3 -o b.csv") == "there is not enough memory for this"


def test_progress_on_a_terminal(curves, capsys, monkeypatch):
    monkeypatch.setattr("symspline.cli.progress._WAIT", 0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert main(shlex.split("sample a.npz -n 5000 -o b.csv")) == 0
    shown = capsys.readouterr().err
    assert "\rsampling: 100 %" in shown and "\rwriting: 40 %" in shown
    assert shown.endswith(" \r") and "\n" not in shown


@pytest.mark.parametrize("names", ["\n0", "a\nb", '"a\n'])
def test_lists_of_names_that_are_none(fails, names):
    Path("points.csv").write_text("t,x\n0,1\n1,2\n")
    line = shlex.join(["fit", "points.csv", "--space", "r:1", "--columns", names, "-o", "curve.npz"])
    assert "list of names" in fails(line) or "no column" in fails(line)

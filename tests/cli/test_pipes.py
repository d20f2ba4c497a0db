"""Standard input and output, formats of tables, and outputs that would replace an input."""

import gzip
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tabular import AXES, TRACK, numbers, table, write

import symspline as ss


def process(line, given=b"", **options):
    """Run a command line as a process of its own."""
    command = [sys.executable, "-m", "symspline", *line.split()]
    return subprocess.run(command, input=given, capture_output=True, timeout=60, **options)


@pytest.mark.slow
def test_a_pipe_of_two_commands():
    fitted = process("fit - --space s:2 -o -", AXES.encode())
    assert fitted.returncode == 0
    assert fitted.stderr.decode().startswith("standard output: 1 curve through 3 points of sphere:2")
    Path("a.npz").write_bytes(fitted.stdout)
    assert ss.load("a.npz") == ss.CubicSpline([0, 1, 3], np.eye(3), "s:2")
    sampled = process("sample - --every 0.5 --digits 17 -o -", fitted.stdout)
    assert (sampled.returncode, sampled.stderr) == (0, b"standard output: 7 rows\n")
    lines = sampled.stdout.decode().split("\n")
    assert lines[0] == "t,x,y,z" and lines[-1] == "" and len(lines) == 9
    found = np.array([line.split(",") for line in lines[1:-1]], float)
    np.testing.assert_array_equal(found[:, 1:], ss.load("a.npz")(found[:, 0]))


@pytest.mark.slow
def test_results_are_alone_on_standard_output():
    fitted = process("fit - --from csv --space s:2 -o - -q", AXES.encode())
    assert fitted.stderr == b""
    for line, start in [
        ("sample - -n 3 --to npz -o - -q", b"PK"),
        ("plot - --to svg -o - -q", b"<?xml"),
    ]:
        done = process(line, fitted.stdout)
        assert (done.returncode, done.stderr) == (0, b"") and done.stdout.startswith(start)


def test_a_failure_writes_nothing_to_standard_output():
    done = process("fit - --space s:2 -o -", b"t,x,y,z\n0,1,0,0\n1,2,0,0\n")
    assert (done.returncode, done.stdout) == (2, b"")
    assert done.stderr.startswith(b"symspline: standard input: the point in line 3 is off the space")
    done = process("sample - --at - -o -", b"")
    assert (done.returncode, done.stderr.count(b"\n")) == (2, 1) and b"for one of the files only" in done.stderr


def test_a_closed_pipe_ends_a_table(curves):
    line = [sys.executable, "-m", "symspline", "sample", "a.npz", "-n", "300000", "-q", "-o", "-"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdout.readline() == b"t,x,y,z\n"
        running.stdout.close()
        assert running.stderr.read() == b""
    assert running.returncode == 141


def same_tables(run, name, line="--lonlat"):
    run(f"fit {name} {line} -o other.npz")
    found, expected = ss.load("other.npz"), ss.load("curve.npz")
    np.testing.assert_array_equal(found.t, expected.t)
    np.testing.assert_allclose(found.points, expected.points, atol=1e-15)


def test_formats_of_the_same_track(run):
    write("a.csv", TRACK)
    run("fit a.csv --lonlat -o curve.npz")
    rows = [line.split(",") for line in TRACK.splitlines()[1:]]
    records = [{"time": time, "lon": float(lon), "lat": float(lat)} for time, lon, lat in rows]
    write("a.json", json.dumps(records))
    write("columns.json", json.dumps({name: [row[name] for row in records] for name in records[0]}))
    Path("a.csv.gz").write_bytes(gzip.compress(TRACK.encode()))
    write("tabs.tsv", TRACK.replace(",", "\t"))
    write("semicolons.csv", TRACK.replace(",", ";"))
    write("commas.csv", TRACK.replace(",", ";").replace(".", ","))
    points = [[row["lon"], row["lat"]] for row in records]
    features = [
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": place}, "properties": {"time": row["time"]}}
        for place, row in zip(points, records, strict=True)
    ]
    write("a.geojson", json.dumps({"type": "FeatureCollection", "features": features}))
    line = {"type": "LineString", "coordinates": [[*place, 12.5] for place in points]}
    times = {"name": "one", "coordTimes": [row["time"] for row in records]}
    write("line.geojson", json.dumps({"type": "Feature", "geometry": line, "properties": times}))
    names = ["a.json", "columns.json", "a.csv.gz", "tabs.tsv", "semicolons.csv", "commas.csv", "a.geojson"]
    for name in names:
        same_tables(run, name)
    same_tables(run, "line.geojson", "--space sphere:2")
    write("a.dat", TRACK)
    same_tables(run, "a.dat", "--lonlat --from csv")


def test_formats_that_are_written_can_be_read(run):
    write("a.csv", TRACK)
    run("fit a.csv --lonlat -o curve.npz")
    spline = ss.load("curve.npz")
    for name in ("b.json", "b.geojson", "b.csv.gz", "b.tsv"):
        run(f"sample curve.npz --every 1h --digits 17 -o {name}")
        run(f"fit {name} --lonlat -o again.npz")
        again = ss.load("again.npz")
        np.testing.assert_array_equal(again.t, np.arange("2021-08-29T00", "2021-08-29T19", dtype="M8[h]"))
        np.testing.assert_allclose(again.points, spline(again.t), atol=1e-15)
    first = json.loads(Path("b.geojson").read_text())["features"][1]
    assert first["properties"] == {"time": "2021-08-29T01:00:00Z"} and first["geometry"]["type"] == "Point"
    assert Path("b.csv.gz").read_bytes().startswith(b"\x1f\x8b")


def test_gpx(run, fails):
    gpxpy = pytest.importorskip("gpxpy")
    write("a.csv", TRACK)
    run("fit a.csv --lonlat -o curve.npz")
    run("sample curve.npz --at a.csv -o b.gpx")
    assert len(gpxpy.parse(Path("b.gpx").read_text()).tracks) == 1
    same_tables(run, "b.gpx")
    write("pair.csv", "time,lon,lat,id\n" + "".join(f"{line},{name}\n" for name in "ab" for line in TRACK.split()[1:]))
    run("fit pair.csv --lonlat --curve id -o pair.npz")
    run("sample pair.npz -n 5 -o pair.gpx")
    run("fit pair.gpx --lonlat --curve track -o again.npz")
    assert list(ss.load("again.npz")) == ["a", "b"]
    write("broken.gpx", "<gpx")
    assert "broken.gpx is damaged or not a GPX file" in fails("fit broken.gpx --lonlat -o c.npz")


def test_gpx_without_its_library(fails, monkeypatch):
    monkeypatch.setitem(sys.modules, "gpxpy", None)
    write("a.gpx", "<gpx/>")
    assert fails("fit a.gpx --lonlat -o a.npz") == "GPX files need gpxpy; install it with: pip install 'symspline[gpx]'"


def test_damaged_records(fails):
    for name, text, problem in [
        ("a.json", "[1, 2", "a.json is not JSON"),
        ("a.json", "[]", "a.json is not a table: give a list of objects"),
        ("a.json", "[1, 2]", "a.json is not a table: give a list of objects"),
        ("a.json", '{"t": 1}', "a.json is not a table: give a list of objects"),
        ("a.json", '{"t": [0, 1], "lon": [1], "lat": [1, 2]}', "a.json: arrays differ in length: 1 and 2"),
        ("a.json", '{"t": [0, 1], "lon": [1, null], "lat": [1, 2]}', "(counted from 0): column 'lon' is empty or NaN"),
        ("a.geojson", '{"type": "Point"}', "a.geojson: GeoJSON must be a collection of features"),
        ("a.geojson", "[]", "a.geojson: GeoJSON must be a collection of features"),
        ("a.csv.gz", "t,lon,lat\n0,1,2\n1,2,3\n", None),
    ]:
        write(name, text)
        if problem is not None:
            assert problem in fails(f"fit {name} --lonlat -o a.npz")
    Path("a.csv.gz").write_bytes(gzip.compress(TRACK.encode())[:-20])
    assert fails("fit a.csv.gz --lonlat -o a.npz") == "a.csv.gz is damaged: it cannot be decompressed"
    assert "GeoJSON has longitude and latitude" in fails_on_axes(fails, "b.geojson")


def fails_on_axes(fails, name):
    ss.CubicSpline(None, np.eye(3), "s:2").save("axes.npz")
    return fails(f"sample axes.npz -n 3 -o {name}")


def test_inputs_are_not_replaced(curves, fails):
    write("a.npz.csv", "t\n0\n")
    for line, name in [
        ("sample a.npz -n 3 -o a.npz", "a.npz"),
        ("sample a.npz --at a.npz.csv -o a.npz.csv", "a.npz.csv"),
        ("sample a.npz -n 3 -o ./a.npz", "a.npz"),
        ("plot a.npz -o a.npz", "a.npz"),
    ]:
        before = Path(name).read_bytes()
        assert fails(line) == f"cannot write {name}: it is an input; give the output another name"
        assert Path(name).read_bytes() == before


def test_cells_of_all_kinds(run, fails):
    """Blanks, quotes, blank lines, characters beyond ASCII; numbers have all their digits."""
    t = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.3, 300))
    rows = [f"{a!r},{math.sin(a)!r}, {'ann' if i % 2 else 'Zoë'} ,{a * 1e-7!r}\n" for i, a in enumerate(t.tolist())]
    write("a.csv", "\ufeff\nt, x,who,y\r\n\n" + "".join(rows[:150]) + "\n\n" + "".join(rows[150:]))
    line = "fit a.csv --space r:2 --columns x,y --curve who"
    run(f"{line} -o a.npz")
    found = ss.load("a.npz")
    assert list(found) == ["Zoë", "ann"]
    np.testing.assert_array_equal(found["Zoë"].points, [[math.sin(a), a * 1e-7] for a in t[::2]])
    write("b.csv", 't,x,who,y\n0,1, "007",2\n1,1, "007",3\n')
    run(f"{line.replace('a.csv', 'b.csv')} -o c.npz")
    assert list(ss.load("c.npz")) == ["007"]


def test_numbers_in_text_read_back_equal(run):
    x = np.random.default_rng(1).standard_normal((40, 1)) * 10.0 ** np.arange(-20, 20)[:, None]
    ss.CubicSpline(None, x, "r:1").save("a.npz")
    write("at.csv", "t\n" + "".join(f"{i}\n" for i in range(40)))
    run("sample a.npz --at at.csv -o b.csv")
    np.testing.assert_array_equal(numbers(table("b.csv"), "x0"), ss.load("a.npz")(np.arange(40.0)))
    run("sample a.npz --at at.csv --digits 4 -o b.csv")
    assert [f"{float(text):.3e}" for text in table("b.csv")["x0"]] == [f"{value:.3e}" for value in x[:, 0]]
    assert np.array_equal(numbers(table("b.csv"), "x0")[:, 0], [float(f"{value:.3e}") for value in x[:, 0]])


def test_digits_are_checked(curves, fails):
    assert "--digits: 0: give a number between 1 and 17 (see" in fails("sample a.npz -n 3 --digits 0 -o b.csv")


@pytest.mark.skipif(os.name != "posix", reason="descriptors are closed by a shell")
@pytest.mark.parametrize(
    "line, says", [("fit - --lonlat -o a.npz <&-", "input"), ("fit a.csv --lonlat -o - >&-", "output")]
)
def test_streams_that_are_closed(line, says):
    write("a.csv", TRACK)
    command = f'"{sys.executable}" -m symspline {line}'
    done = subprocess.run(
        ["/bin/sh", "-c", command], capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL
    )
    assert (done.returncode, done.stderr) == (2, f"symspline: standard {says} is closed; give the name of a file\n")

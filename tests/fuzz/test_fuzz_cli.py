"""The command line: exit code 0, 1 or 2, an error of one line, and no partial files."""

import io
import shutil
import tempfile
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np
from hypothesis import given, note
from hypothesis import strategies as st

from fuzz.damage import damaged_bytes, damaged_json
from fuzz.outcomes import attempt
from fuzz.tables import CELLS, GOOD, NAMES, SPACES, STEPS, csv_bytes, npz_bytes, parquet_bytes
from fuzz.values import rarely
from symspline.cli import main

ENDINGS = {".csv": csv_bytes(), ".npz": npz_bytes(), ".parquet": parquet_bytes()}
words = st.one_of(
    st.sampled_from([*CELLS[:12], *NAMES, "x,y,z", "lon,lat", "a,b", '"', ",", "-", "--"]), st.text(max_size=4)
)


@contextmanager
def folder():
    """A folder that is gone afterwards."""
    path = Path(tempfile.mkdtemp())
    try:
        yield path
    finally:
        shutil.rmtree(path)


def run(path, *arguments):
    """Runs a command line that reads and writes in a folder; returns its exit code and what it prints."""
    note(repr(arguments))
    before = {file.name: file.read_bytes() for file in path.iterdir()}
    out, err = io.StringIO(), io.StringIO()

    def call():
        with redirect_stdout(out), redirect_stderr(err):
            try:
                return main(list(arguments))
            except SystemExit as end:
                return end.code

    code, said = attempt(call), err.getvalue()
    note(f"{code}: {said}")
    assert code in (0, 1, 2)
    if code == 0:
        assert "symspline: " not in said
    else:
        assert said.startswith("symspline: ") and said.count("\n") == 1 and said.endswith("\n") and len(said) < 3000
    after = {file.name: file.read_bytes() for file in path.iterdir()}
    new = {name for name in after if after[name] != before.get(name)}
    assert set(before) <= set(after) and len(new) <= (code == 0), new
    return code


OPTIONS = {
    "--space": st.one_of(st.sampled_from(SPACES), words),
    "--time": words,
    "--columns": words,
    "--curve": st.one_of(st.just("id"), words),
    "--lonlat": None,
    "--bc-type": st.one_of(st.sampled_from(["clamped", "not-a-knot", "periodic", "natural,clamped", "x"]), words),
    "--method": st.sampled_from(["auto", "fixed-point", "quasi-newton", "newton", "x"]),
    "--tol": st.sampled_from(["1e-9", "0", "-1", "nan", "inf", "x", "1e400", "1e-300"]),
    "--extrapolate": st.sampled_from(["continue", "geodesic", "periodic", "x"]),
    "--max-gap": st.one_of(st.sampled_from(STEPS), words),
    "--from": st.sampled_from(["csv", "json", "geojson", "npz", "parquet", "tum", "x"]),
    "--smooth": None,
    "--criterion": st.sampled_from(["gcv", "reml", "cp", "x"]),
    "--lam": st.sampled_from(["0", "1", "1,2", "-1", "x"]),
    "--surprise": None,
}


@st.composite
def some_options(draw, options, most):
    arguments = []
    for name in draw(st.lists(st.sampled_from(list(options)), max_size=most)):
        value = options[name]
        arguments += (
            [name] if value is None else [f"{name}={draw(value)}"] if draw(st.booleans()) else [name, draw(value)]
        )
    return arguments


@given(st.data())
def test_fit(data):
    draw = data.draw
    with folder() as path:
        ending = draw(st.sampled_from([".csv", ".csv", *ENDINGS]))
        table = path / f"table{ending}"
        table.write_bytes(draw(ENDINGS[ending]))
        output = path / draw(
            st.sampled_from(["curve.npz", "curve.npz", "curve.npz", "curve.csv", "no/curve.npz", table.name])
        )
        if draw(st.booleans()):
            (path / "curve.npz").write_bytes(b"older")
        arguments = draw(some_options(OPTIONS, 3))
        if not any(a.startswith(("--space", "--lonlat")) for a in arguments):
            arguments += ["--space", draw(st.sampled_from(SPACES))]
        if draw(st.booleans()):
            run(path, "info", str(table))
        if run(path, "fit", str(table), "-o", str(output), *arguments) == 0:
            use(draw, path, output)


def use(draw, path, curve):
    """What can be done with a file of curves, fitted or not."""
    run(path, "check", str(curve))
    run(path, "info", str(curve))
    run(path, "sample", str(curve), "-n", "3", "-o", str(path / "samples.csv"))
    if rarely(draw, 20):
        run(path, "plot", str(curve), "-o", str(path / draw(st.sampled_from(["a.svg", "a.x", "a"]))))


@given(st.data())
def test_the_good_tables_are_good(data):
    with folder() as path:
        table = data.draw(st.sampled_from(range(len(GOOD))))
        (path / "a.csv").write_bytes(GOOD[table])
        own = [
            ["--space=s:2"],
            ["--lonlat"],
            ["--space=s:2", "--curve=id"],
            ["--space=cp:1"],
            ["--space=spd:2"],
            ["--space=s:2", "--columns=c,d,e"],
        ]
        assert run(path, "fit", str(path / "a.csv"), "-o", str(path / "a.npz"), *own[table]) == 0
        use(data.draw, path, path / "a.npz")


SAMPLE = {
    "--every": st.one_of(st.sampled_from(STEPS), words),
    "-n": st.sampled_from(["1", "2", "9", "0", "-1", "x", "1e3", "10" * 20]),
    "--nu": st.sampled_from(["0", "1", "2", "0,1,2", "1,1", "3", "", "x", "0,"]),
    "--lonlat": None,
    "--curve": words,
    "--to": st.sampled_from(["csv", "json", "geojson", "npz", "parquet", "tum", "x"]),
    "--digits": st.sampled_from(["1", "3", "17", "0", "-1", "99", "x"]),
}


@given(st.data())
def test_sample(data):
    draw = data.draw
    with folder() as path:
        curve, times = path / "curve.npz", path / "times.csv"
        curve.write_bytes(draw(st.sampled_from(curves())))
        times.write_bytes(draw(csv_bytes()))
        arguments = draw(some_options(SAMPLE, 2))
        if draw(st.booleans()):
            arguments += ["--at", str(times)]
        output = path / draw(
            st.sampled_from(["a.csv", "a.npz", "a.parquet", "a.json", "a.geojson", "a.csv.gz", "a.x", "no/a.csv"])
        )
        run(path, "sample", str(curve), "-o", str(output), *arguments)


_CURVES = []


def curves():
    """Files of curves that the command line wrote."""
    if not _CURVES:
        lines = [("a", "--space=s:2"), ("b", "--lonlat"), ("c", "--space=s:2", "--curve=id"), ("d", "--space=cp:1")]
        for data, (name, *options) in zip(GOOD, lines, strict=False):
            with folder() as path:
                (path / f"{name}.csv").write_bytes(data)
                main(["fit", str(path / f"{name}.csv"), "-o", str(path / "x.npz"), *options])
                _CURVES.append((path / "x.npz").read_bytes())
    return _CURVES


@given(st.data())
def test_damaged_curves(data):
    draw = data.draw
    with folder() as path, redirect_stdout(io.StringIO()):
        source = draw(st.sampled_from(curves()))
        (path / "a.npz").write_bytes(
            draw(damaged_bytes(source, curves())) if draw(st.booleans()) else draw(other_columns(source))
        )
        use(draw, path, path / "a.npz")


@st.composite
def other_columns(draw, source):
    """A file of curves whose names of columns are not what they should be."""
    arrays = dict(np.load(io.BytesIO(source)))
    key = draw(
        st.sampled_from(["columns", "columns", *(key for key in ("names", "report", "bc_type") if key in arrays)])
    )
    arrays[key] = np.array(draw(damaged_json(str(arrays[key]))))
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


@given(st.data())
def test_any_arguments(data):
    verbs = ["fit", "sample", "check", "plot", "-h", "--help", "-o", "-n", "--every", "a.npz", "a.csv"]
    arguments = data.draw(st.lists(st.one_of(words, st.sampled_from(verbs)), max_size=5))
    with folder() as path:
        run(path, *(a for a in arguments if "demo" not in a and "\0" not in a and not a.startswith("/")))

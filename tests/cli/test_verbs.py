"""The commands of the command line and their usage errors."""

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from tabular import AXES, PAIR, numbers, table, write

import symspline as ss
from symspline.cli import main

ROOT = Path(__file__).parents[2]


def test_the_example_of_the_start_page(run):
    section = (ROOT / "docs/start.md").read_text(encoding="utf-8").split("## Command line")[1].split("\n## ")[0]
    write("ida.csv", re.search(r"```text\n(.*?)```", section, re.S)[1])
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
    spline = ss.CubicSpline([0, 1, 3], np.eye(3), "sphere:2", bc_type=("not-a-knot", "clamped"), extrapolate="geodesic")
    loaded = ss.load("axes.npz")
    assert loaded == spline and loaded.extrapolate == "geodesic"
    run("sample axes.npz -n 7 --nu 0,1,2 --digits 17 -o out.csv")
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
    assert fails("fit axes.csv --space s:2 --bc-type foo -o b.npz").startswith("argument --bc-type: foo: give natural")
    assert fails("fit axes.csv --space s:2 --bc-type periodic,natural -o b.npz").startswith("argument --bc-type: ")
    assert fails("fit axes.csv --space s:2 --bc-type periodic -o b.npz").startswith("axes.csv: bc_type='periodic'")


def test_rows_without_times_are_at_whole_numbers(run):
    write("a.csv", "x,y\n1,2\n3,4\n5,7\n")
    run("fit a.csv --space r:2 -o a.npz")
    assert ss.load("a.npz") == ss.CubicSpline(None, [[1, 2], [3, 4], [5, 7]], "r:2")
    run("sample a.npz --every 1 -o b.csv")
    assert list(table("b.csv")) == ["time", "x", "y"]
    write("a.csv", "t,y\n1,2\n3,4\n5,7\n")
    run("fit a.csv --space r:2 --columns t,y -o b.npz")
    assert ss.load("a.npz") == ss.load("b.npz")


def test_help_has_examples_and_the_version_is_that_of_the_core(capsys):
    for verb in ("", "fit", "sample", "plot", "check", "info"):
        with pytest.raises(SystemExit) as end:
            main([*verb.split(), "--help"])
        assert end.value.code == 0
        out = capsys.readouterr().out
        assert f"  symspline {verb}" in out.split("\nexample")[1]
        assert verb != "fit" or "quasi-newton, newton, homotopy or fixed-point" in " ".join(out.split())
    with pytest.raises(SystemExit):
        main(["--version"])
    assert capsys.readouterr().out == f"symspline {ss.__version__}\n"
    assert f'version = "{ss.__version__}"' in (ROOT / "Cargo.toml").read_text(encoding="utf-8")


def test_samples_at_given_times(run, fails):
    write("pair.csv", PAIR)
    run("fit pair.csv --space s:2 --curve id -o pair.npz")
    a, b = ss.load("pair.npz").values()
    write("at.csv", "id,t\nb,1.5\na,0.5\nb,1.25\n")
    run("sample pair.npz --at at.csv --digits 17 -o out.csv")
    columns = table("out.csv")
    assert (columns["id"], columns["t"]) == (["b", "a", "b"], ["1.5", "0.5", "1.25"])
    np.testing.assert_array_equal(numbers(columns, *"xyz"), [b(1.5), a(0.5), b(1.25)])
    np.savez("at.npz", T=[1.5, 1.25])
    run("sample pair.npz --at at.npz --digits 17 -o out.csv")
    assert table("out.csv")["id"] == ["a", "a", "b", "b"]
    write("at.csv", "when\n1\n")
    run("sample pair.npz --at at.csv --digits 17 -o out.csv")
    write("at.csv", "t,id\n1.5,q\n")
    assert fails("sample pair.npz --at at.csv -o x.csv") == "at.csv, line 2: there is no curve 'q'; there are a, b"
    write("at.csv", "t\n1.5\n2.5\n")
    problem = "at.csv, line 3: time 2.5 is outside curve 'b', which runs from 1.0 to 2.0; fit with --extrapolate"
    assert fails("sample pair.npz --at at.csv -o x.csv").startswith(problem)
    write("at.csv", "when,id\n1.5,a\n")
    assert "at.csv has no column 't' of times; there are when, id" in fails("sample pair.npz --at at.csv -o x.csv")
    write("at.csv", "t\n2020-01-01\n")
    assert "are numbers, but these are dates" in fails("sample pair.npz --at at.csv -o x.csv")


def test_invalid_usage_fails(curves, fails):
    assert fails("ft").endswith("invalid choice: 'ft'; did you mean fit? (see symspline --help)")
    assert "invalid choice: 'x'; choose from fit, sample, resample, plot, check, info" in fails("x")
    assert (
        fails("fit a.csv --space s:2") == "the following arguments are required: -o/--output (see symspline fit --help)"
    )
    problem = "unrecognized arguments: --tiem t; did you mean --time? (see symspline fit --help)"
    assert fails("fit a.csv --space s:2 --tiem t -o b.npz") == problem
    assert "--every -n --at is required" in fails("sample a.npz -o b.csv")
    assert "--" in fails("sample a.npz --every=-- -o b.csv")
    assert "not allowed with" in fails("sample a.npz -n 3 --every 1 -o b.csv")
    assert "--nu: 0,3: give one or more of 0, 1 and 2" in fails("sample a.npz -n 3 --nu 0,3 -o b.csv")
    assert fails("fit a.csv --space s:2 -o b.csv") == "b.csv: the name of a file of curves must end in .npz"
    names = ".csv, .tsv, .npz, .parquet, .npy, .json, .jsonl, .ndjson, .geojson, .gpx, .tum or .txt"
    ending = f"b.xls: the name of a table must end in {names}"
    assert fails("sample a.npz -n 3 -o b.xls") == ending
    assert fails("plot a.npz -o b.txt").startswith("b.txt: the name of a picture must end in .")
    assert "must end in .csv" in fails("fit a.xls --space s:2 -o b.npz")


def test_a_fit_that_does_not_converge(fails, monkeypatch):
    monkeypatch.setattr("symspline.cli._fit.fit_many", partial(ss.fit_many, max_iter=2))
    write("pair.csv", PAIR)
    write("old.npz", "as it was")
    problem = fails("fit pair.csv --space s:2 --columns x,y,z --curve id -o old.npz", code=1)
    assert problem.startswith("pair.csv: no convergence of curve 'a': residual")
    assert "max_iter" not in problem
    assert Path("old.npz").read_text() == "as it was"


def test_points_are_moved_onto_the_space_by_rounding_only(run, fails):
    write("a.csv", "t,x,y\n0,1.00001,0\n1,0.70711,0.70711\n")
    run("fit a.csv --space s:1 -o a.npz")
    np.testing.assert_allclose(np.linalg.norm(ss.load("a.npz").points, axis=1), 1, atol=1e-15)
    write("a.csv", "t,x,y\n0,1.001,0\n1,0.70711,0.70711\n")
    problem = fails("fit a.csv --space s:1 -o b.npz")
    assert problem.startswith("a.csv: the point in line 2 is off the space by 1.000e-3")
    assert "1e-4" in problem and "space.project" not in problem

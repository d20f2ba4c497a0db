"""Help at the width of the terminal, completion, and ``symspline info``."""

import os
import subprocess
import sys

import numpy as np
import pytest
from tabular import PAIR, TRACK, write

from symspline.cli import main


def test_without_arguments_help_is_printed(capsys):
    assert main([]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("usage: symspline") and "  fit " in out and not err


@pytest.mark.slow
def test_completion():
    pytest.importorskip("shtab")
    line = [sys.executable, "-m", "symspline", "--print-completion"]
    for shell in ("bash", "zsh", "fish"):
        done = subprocess.run([*line, shell], capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stderr) == (0, "") and "max-gap" in done.stdout
        assert "sphere:2" in done.stdout.replace("\\:", ":") and "not-a-knot" in done.stdout
    script = subprocess.run([*line, "bash"], capture_output=True, text=True, timeout=60).stdout
    if os.path.exists("/bin/bash"):
        ask = "COMP_WORDS=(symspline fit --crit); COMP_CWORD=2; _shtab_symspline; echo ${COMPREPLY[@]}"
        done = subprocess.run(["/bin/bash", "-c", f"{script}\n{ask}"], capture_output=True, text=True, timeout=60)
        assert done.stdout == "--criterion\n"


def test_completion_without_its_library(fails, monkeypatch):
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert "pip install 'symspline[completion]'" in fails("--print-completion bash")


def test_info_of_tables(run):
    write("a.csv", TRACK)
    assert run("info a.csv").splitlines() == [
        "a.csv: csv table, 4 rows",
        "  time: 4 distinct texts: 2021-08-29T00:00Z, 2021-08-29T06:00Z, 2021-08-29T12:00Z, ...",
        "  lon: -179.0 to 178.5",
        "  lat: 28.0 to 31.5",
        "times in column 'time': 2021-08-29T00:00 to 2021-08-29T18:00 UTC, usual step 21600 s",
    ]
    rows = [
        (f"{t:.2f}", t * t, who) for who in ("ann", "bob") for t in [*np.arange(0, 2, 0.05), *np.arange(14, 15, 0.05)]
    ]
    write("b.csv", "t,x,who\n" + "".join(",".join(map(str, row)) + "\n" for row in rows) + "15,,bob\n")
    out = run("info b.csv")
    assert "  x: 0.0 to 2" in out and ", 1 missing\n" in out
    assert "usual step 0.05, 1 step back in time\n" in out and out.endswith("--curve who fits one curve per who\n")
    write("c.csv", "t,x\n" + "".join(f"{t:.2f},1\n" for t in [*np.arange(0, 2, 0.05), *np.arange(14, 15, 0.05)]))
    assert "usual step 0.05, 1 long gap, up to 12.05\n" in run("info c.csv")
    np.savez("d.npz", t=[0.0, 1, 1, 3], points=np.eye(4))
    assert "times in column 't': 0.0 to 3.0, usual step 1.5, 1 repeated time" in run("info d.npz")
    write("mixed.csv", "t,x,code,note,nothing\n0,1,7,,\n1,2,A3,here,\n")
    out = run("info mixed.csv")
    assert "  code: 2 distinct texts: 7, A3\n  note: 1 distinct text: here, 1 missing\n  nothing: no values\n" in out
    np.savez("other.npz", t=[0.0, 1, 1, 3], x=[1.0, 2, 3, 4], ship=["a", "a", "b"])
    assert "1 repeated time\n" in run("info other.npz")
    write("e.csv", "hours,x\n0,1\n1,2\n")
    assert "hours may hold the times; say --time hours" in run("info e.csv")
    assert "usual step 1\n" in run("info e.csv --time hours")


def test_info_of_curves(run, curves):
    out = run("info a.npz")
    assert out.startswith("a.npz: 1 curve on sphere:2, columns x, y, z\n  3 nodes, 0.0 to 3.0; natural ends, residual ")
    write("pair.csv", PAIR)
    run("fit pair.csv --space s:2 --curve id -o pair.npz")
    assert [line.split(":")[0] for line in run("info pair.npz").splitlines()] == ["pair.npz", "  a", "  b"]
    write("n.csv", "t,x\n" + "".join(f"{t},{np.sin(t) + 0.1 * np.cos(17 * t)}\n" for t in np.arange(0, 6, 0.1)))
    run("fit n.csv --space r:1 --smooth -o n.npz")
    assert "; λ " in run("info n.npz") and " degrees of freedom, noise 0.0" in run("info n.npz")
    write("gap.csv", "t,x\n0,1\n1,2\n9,3\n10,4\n")
    run("fit gap.csv --space r:1 --max-gap 2 -o gap.npz")
    assert run("info gap.npz").startswith(
        "gap.npz: 2 segments of one recording on euclidean:1, columns x\n  1: 2 nodes"
    )


def test_info_of_the_installation(run):
    out = run("info")
    assert "  sphere:2: " in out and "  so:2: " in out and ".geojson" in out and "matplotlib" in out
    assert max(map(len, out.splitlines())) < 100


@pytest.mark.parametrize("verb", ["fit", "sample", "resample", "plot", "check", "info"])
def test_the_short_help_is_one_screen(capsys, verb, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        main([verb, "-h"])
    out = capsys.readouterr().out
    lines = out.splitlines()
    assert out.startswith(f"usage: symspline {verb} ") and "--help prints all options" in lines[-1]
    assert len(lines) <= 32 and max(map(len, lines)) <= 100
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    whole = capsys.readouterr().out
    # A usual option has its names in both.
    assert len(whole) > len(out) and ("--method" in whole) == (verb in ("fit", "resample"))
    assert "--method" not in out and "--tol" not in out
    assert main(["help", verb]) == 0
    assert capsys.readouterr().out == whole


def test_help_and_version(capsys, fails):
    assert main(["help"]) == 0
    assert capsys.readouterr().out.startswith("usage: symspline")
    assert "did you mean sample?" in fails("help sampl")
    with pytest.raises(SystemExit):
        main(["-V"])
    assert capsys.readouterr().out.startswith("symspline ")

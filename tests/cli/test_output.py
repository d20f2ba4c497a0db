"""Output that cannot be written, interruptions, and progress on a terminal."""

import os
import shlex
import sys
import time
import warnings
from pathlib import Path

import pytest
from tabular import AXES, write

from symspline import fit_many
from symspline.cli import main
from symspline.cli._curves import read_curves


def test_pictures_without_matplotlib(curves, fails, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert "pip install 'symspline[plot]'" in fails("plot a.npz -o a.png")


def test_output_that_cannot_be_written(curves, fails, monkeypatch):
    assert fails("fit a.csv --space s:2 -o no/b.npz") == "cannot write no/b.npz: there is no folder no"
    os.mkdir("b.npz")
    assert fails("fit a.csv --space s:2 -o b.npz") == "cannot write b.npz: it is a folder"
    assert fails("plot a.npz -o no/b.png").startswith("cannot write no/b.png")
    assert fails("sample a.npz -n 3 -o no/b.csv").startswith("cannot write no/b.csv")
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert fails("fit a.csv --space s:2 -o c.npz") == "cannot write c.npz: no permission to write into ."


@pytest.mark.parametrize("ending", ["csv", "npz", "parquet", "png", "fit"])
def test_writing_that_fails_midway(curves, run, fails, monkeypatch, ending):
    resource = pytest.importorskip("resource")
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    lines = {"fit": "fit long.csv --space r:1 -o out.npz", "png": "plot a.npz -o out.png"}
    line = lines.get(ending, f"sample a.npz -n 3000 -o out.{ending}")
    out = line.split()[-1]
    # Python and matplotlib keep files of their own, which the limit would truncate for later tests.
    run(line)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    write(out, "as it was")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (12_000, hard))
    try:
        assert fails(line) == f"cannot write {out}: File too large"
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert Path(out).read_text() == "as it was"


def test_not_enough_memory(curves, fails, monkeypatch):
    def too_much(*_):
        raise MemoryError

    monkeypatch.setattr("symspline.cli._sample.spread", too_much)
    assert fails("sample a.npz -n 3 -o b.csv") == "there is not enough memory for this"


@pytest.mark.filterwarnings("default:too steep")
@pytest.mark.parametrize("line", ["sample a.npz -n 3 -o b.csv", "check a.npz", "info a.npz"])
def test_warnings_of_the_library_are_messages(curves, run, monkeypatch, line):
    def warned(*arguments):
        warnings.warn("too steep", UserWarning, stacklevel=2)
        return read_curves(*arguments)

    for verb in ("sample", "check", "info"):
        monkeypatch.setattr(f"symspline.cli._{verb}.read_curves", warned)
    assert run(line, notes=True).endswith("symspline: too steep\n")


def test_progress_on_a_terminal(curves, capsys, monkeypatch):
    """The line also moves while a single step takes long."""

    def slow(*arguments, progress, **options):
        time.sleep(0.2)
        progress(1, 4)
        time.sleep(0.2)
        return fit_many(*arguments, **options)

    monkeypatch.setattr("symspline.cli._messages._WAIT", 0.03)
    monkeypatch.setattr("symspline.cli._fit.fit_many", slow)
    assert main(shlex.split("fit a.csv --space s:2 -o b.npz")) == 0
    assert "\r" not in capsys.readouterr().err
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert main(shlex.split("fit a.csv --space s:2 -o b.npz")) == 0
    shown = capsys.readouterr().err
    assert "\rfitting: 0 s\r" in shown and "\rfitting: 25 %, 0 s\r" in shown
    assert " \rb.npz: 1 curve" in shown
    assert main(shlex.split("fit a.csv --space s:2 -o b.npz -q")) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.skipif(os.name != "posix", reason="links and pipes as on POSIX systems")
def test_links_are_followed_and_pipes_refused(run, fails):
    write("a.csv", AXES)
    os.mkdir("kept")
    os.symlink("kept/curve.npz", "a.npz")
    run("fit a.csv --space s:2 -o a.npz")
    assert os.path.islink("a.npz") and os.listdir("kept") == ["curve.npz"]
    os.mkfifo("pipe.npz")
    assert fails("fit a.csv --space s:2 -o pipe.npz") == (
        "cannot write pipe.npz: it is a device, a pipe or a socket; give the name of a regular file, or - for "
        "standard output"
    )

"""Fixtures: an empty current folder for every test, and the command line."""

import os
import shlex

import pytest
from tabular import AXES, write

from symspline.cli import main


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Every test has the current folder to itself."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(capsys):
    """Runs a command line that works, and returns its texts; ``notes`` is whether warnings are expected, or None."""

    def run(line, notes=False):
        code = main(shlex.split(line))
        out, err = capsys.readouterr()
        assert code == 0 and notes in (None, "symspline: " in err), err
        return out + err

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


@pytest.fixture
def curves(run):
    """Files to begin with: ``a.csv``, its curve ``a.npz``, and ``long.csv``."""
    write("a.csv", AXES)
    run("fit a.csv --space s:2 -o a.npz")
    write("long.csv", "x\n" + "".join(f"{i}\n" for i in range(3000)))

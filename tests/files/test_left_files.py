"""Temporary files of a killed process are removed by the next save with the same name."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest

import symspline as ss
from symspline._base.system import _machine

pytestmark = pytest.mark.skipif(os.name != "posix", reason="processes are looked up as POSIX does")

KILLED = """
import os, sys
from pathlib import Path
from symspline._base.system import replacing
with replacing(Path(sys.argv[1])) as temporary:
    temporary.write_bytes(b"half")
    os.kill(os.getpid(), 9)
"""


def test_the_file_of_a_killed_save_is_removed(tmp_path):
    curve, file, other = ss.CubicSpline(None, np.eye(3), "r:3"), tmp_path / "run.npz", tmp_path / "walk.npz"
    for path in (file, other):
        subprocess.run([sys.executable, "-c", KILLED, path], check=False)
    hidden = set(os.listdir(tmp_path))
    assert len(hidden) == 2
    curve.save(file)
    left = set(os.listdir(tmp_path)) - {"run.npz"}
    assert len(left) == 1 and left < hidden and next(iter(left)).endswith("walk.npz")
    assert ss.load(file) == curve


def test_other_files_are_kept(tmp_path):
    """Files of running processes, of other machines, and of the user are not removed."""
    file = tmp_path / "run.npz"
    kept = [f".00000000-1-{'0' * 16}run.npz", ".notes run.npz", f".{'0' * 16}run.npz"]
    with_parent = f".{_machine()}-{os.getppid():x}-{'0' * 16}run.npz"
    for name in [*kept, with_parent]:
        (tmp_path / name).touch()
    ss.CubicSpline(None, np.eye(3), "r:3").save(file)
    assert set(os.listdir(tmp_path)) == {*kept, with_parent, "run.npz"}
    # Two days later.
    old = time.time() - 2 * 86400
    for name in [*kept, with_parent]:
        os.utime(tmp_path / name, (old, old))
    ss.CubicSpline(None, np.eye(3), "r:3").save(file)
    assert set(os.listdir(tmp_path)) == {*kept[1:], "run.npz"}

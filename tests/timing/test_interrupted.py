"""A command that is interrupted leaves no file."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import symspline as ss


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_interrupted_by_a_signal(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    ss.CubicSpline(None, np.eye(3), "s:2").save(tmp_path / "a.npz")
    line = [sys.executable, "-m", "symspline", "sample", tmp_path / "a.npz", "-n", "1000000", "-o", out / "out.csv"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 20
        while not any(path.stat().st_size for path in out.iterdir()) and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        printed, err = process.communicate(timeout=20)
    assert (process.returncode, printed, err) == (130, "", "symspline: interrupted\n")
    assert not os.listdir(out)

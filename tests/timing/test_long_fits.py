"""Progress of fits that take a second or more, exceptions in its callback, and Ctrl-C."""

import signal
import subprocess
import sys

import numpy as np
import pytest
from curves import S3, run_python, scattered

import symspline as ss


def hard_fit(progress, n=400_000, **options):
    options = {"method": "fixed-point", "max_iter": 100, "on_failure": "ignore", "progress": progress} | options
    return ss.CubicSpline(None, scattered(n), S3, **options)


@pytest.mark.parametrize("n", [1, 2])
def test_progress(threads, n):
    ss.set_num_threads(n)
    calls = []
    hard_fit(lambda *call: calls.append(call))
    finished, total = np.transpose(calls)
    assert len(calls) >= 3
    assert (total == 400_000).all()
    # Nothing may have been finished between two calls, but nothing is ever taken back.
    assert finished[0] >= 0 and (np.diff(finished) >= 0).all() and finished[-1] == 400_000


def test_progress_never_passes_its_total(threads):
    ss.set_num_threads(1)
    rng, n = np.random.default_rng(0), 150_000
    p = [S3.random_point(rng)]
    directions = rng.standard_normal((n, 4))
    for d in directions[1:]:
        d -= d @ p[-1] * p[-1]
        p.append(np.cos(1.6) * p[-1] + np.sin(1.6) / np.sqrt(d @ d) * d)
    calls = []
    ss.CubicSpline(None, S3.project(p), S3, on_failure="ignore", progress=lambda *call: calls.append(call))
    finished, total = np.transpose(calls)
    assert (finished <= total).all() and (np.diff(finished) >= 0).all()


class Enough(Exception):
    pass


@pytest.mark.parametrize("n", [1, 2])
@pytest.mark.parametrize("after", [1, 2])
def test_an_exception_in_progress_stops_the_work(threads, n, after):
    ss.set_num_threads(n)
    calls, error = [], Enough("enough")

    def progress(finished, total):
        calls.append(finished)
        if len(calls) == after:
            raise error

    with pytest.raises(Enough) as caught:
        hard_fit(progress)
    assert caught.value is error
    assert len(calls) == after and calls[-1] < 400_000


NESTED = """
import sys, numpy as np, symspline as ss
ss.set_num_threads(int(sys.argv[1]))
rng = np.random.default_rng(0)
inner = ss.CubicSpline(None, np.eye(3), "sphere:2")
calls = []

def progress(finished, total):
    calls.append(ss.CubicSpline(None, np.eye(3), "sphere:2") == inner and inner(0.5).shape == (3,))

p = ss.Sphere(3).random_point(rng, 400_000)
ss.CubicSpline(None, p, "sphere:3", method="fixed-point", max_iter=100, on_failure="ignore", progress=progress)
assert len(calls) > 2 and all(calls)
"""


@pytest.mark.parametrize("n", [1, 2])
def test_progress_may_fit_another_curve(n):
    run_python(NESTED, n, RUST_BACKTRACE="0")


INTERRUPTED = """
import sys, time, numpy as np, symspline as ss
ss.set_num_threads(int(sys.argv[1]))
p = ss.Sphere(3).random_point(np.random.default_rng(0), 2_000_000)
started = lambda *call: print("started", flush=True)
try:
    ss.CubicSpline(None, p, "sphere:3", method="fixed-point", progress=started)
except KeyboardInterrupt:
    print("interrupted", flush=True)
    # Everything still works.
    assert ss.CubicSpline(None, p[:2], "sphere:3", on_failure="ignore").report.iterations >= 0
    print("well", flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")
@pytest.mark.parametrize("n", [1, 2])
def test_ctrl_c_stops_a_long_fit(n):
    command = [sys.executable, "-c", INTERRUPTED, str(n)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "started\n"
            process.send_signal(signal.SIGINT)
            # The whole fit takes minutes.
            out, _ = process.communicate(timeout=60)
            assert process.returncode == 0
            assert out.replace("started\n", "") == "interrupted\nwell\n"
        finally:
            process.kill()


def test_progress_within_an_evaluation():
    """Between its ends, too, the core counts points, of which complex ones of three numbers have six doubles."""
    rng = np.random.default_rng(0)
    space = ss.ComplexProjective(2)
    points = np.stack([space.exp(np.eye(1, 3)[0], v) for v in ([0, 0, 0], [0, 0.3j, 0], [0, 0, 0.3])])
    spline, calls, size = ss.CubicSpline(None, points, space), [], 100_000
    while len(calls) < 3 and size < 2**27:
        # Twenty times a second somebody is called; how fast a machine is nobody knows.
        calls.clear()
        size *= 2
        x = rng.uniform(0, 2, size)
        spline(x, 2, progress=lambda *call: calls.append(call))
    finished, total = np.transpose(calls)
    assert len(calls) >= 3 and (total == size).all() and (np.diff(finished) >= 0).all()
    assert finished[-1] == size and (finished[1:-1] < size).all()

"""Long work that is stopped, memory that is not there, and memory that should not grow."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from curves import run_python

pytest.importorskip("resource", reason="needs POSIX limits")
proc = pytest.mark.skipif(
    not Path("/proc/self/statm").exists(), reason="reads the size of a process in /proc"
)


# ---- Ctrl-C; what it does to a fit is in test_behaviour.py ----

INTERRUPTED = """
import sys, numpy as np, symspline as ss

space = ss.space("{name}")
p = np.broadcast_to(space.random_point(np.random.default_rng(0)), (2, *space.point_shape))
v = space.random_tangent(np.random.default_rng(1), p)
spline = ss.CubicSpline(None, space.exp(p, 0.3 * v / space.norm(p, v)[:, None, None]), space)
before = spline(0.5, nu=2)
print("started", flush=True)
try:
    {work}
    print("finished", flush=True)
except KeyboardInterrupt:
    print("interrupted", flush=True)
assert (spline(0.5, nu=2) == before).all()
print("well", flush=True)
"""


# All of it takes much longer than the test.
@pytest.mark.parametrize(
    "name, work",
    [
        ("spd:3", "spline(np.broadcast_to(0.5, 20_000_000), nu=2)"),
        ("spd:3", "spline.speed(np.broadcast_to(0.5, 50_000_000))"),
        ("so:8", "space.log(*np.broadcast_to(spline.points[:, None], (2, 1_000_000, 8, 8)))"),
        ("so:80", "spline(np.broadcast_to(0.5, 4_000), nu=2)"),
    ],
    ids=["points", "speeds", "operations", "large-matrices"],
)
def test_ctrl_c_stops_long_work(name, work):
    command = [sys.executable, "-c", INTERRUPTED.format(name=name, work=work)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "started\n"
            # By then arrays are copied, and compiled code runs.
            time.sleep(0.6)
            start = time.perf_counter()
            process.send_signal(signal.SIGINT)
            out, _ = process.communicate(timeout=1.5)
            # It takes about 0.05 s.
            assert time.perf_counter() - start < 1.5
            assert out == "interrupted\nwell\n" and process.returncode == 0
        finally:
            process.kill()


# ---- memory that is not there ----

SHORT = """
import resource, sys, numpy as np, symspline as ss

ss.set_num_threads(1)
n, rng = 1_000_000, np.random.default_rng(0)
curve = ss.CubicSpline(None, np.eye(3), "sphere:2")
t, p, v = np.arange(float(n)), np.zeros((n, 3)), np.zeros((n, 3))
x = np.full(n, 0.5)
p[:, 0] = v[:, 1] = 1
before = curve(0.5)
used = 4096 * int(open("/proc/self/statm").read().split()[0])
most = resource.getrlimit(resource.RLIMIT_AS)[1]
resource.setrlimit(resource.RLIMIT_AS, (used + {spare} * 10**6, most))
try:
    {work}
    raise SystemExit("there was enough")
except MemoryError:
    pass
resource.setrlimit(resource.RLIMIT_AS, (most, most))
assert (curve(0.5) == before).all()
"""


@proc
@pytest.mark.parametrize(
    "work, spare",
    [
        pytest.param("curve(np.broadcast_to(0.5, 10**8))", 60, id="times"),
        pytest.param("curve(np.broadcast_to(0.5, 10**12))", 60, id="absurdly many times"),
        pytest.param("ss.CubicSpline(None, np.broadcast_to(0.0, (10**8, 1)), 'r:1')", 60, id="knots"),
        pytest.param("ss.space('sphere:2').random_point(rng, 10**9)", 60, id="random points"),
        pytest.param("ss.space('so:100000').random_point(rng)", 60, id="a huge space"),
        pytest.param("curve(x)", 10, id="values"),
        pytest.param("curve.space.exp(p, v)", 10, id="operation"),
        pytest.param("curve.space.distance(p, v)", 4, id="distances"),
        pytest.param("curve.space.project(p)", 40, id="projection"),
        pytest.param("curve.space.check_point(p)", 10, id="checks"),
        pytest.param("ss.CubicSpline(t, p, 'sphere:2')", 30, id="fit"),
    ],
)
def test_too_little_memory_is_an_error(work, spare):
    run_python(SHORT.format(work=work, spare=spare), timeout=5, RUST_BACKTRACE="0")


# ---- memory that should not grow ----

GROWTH = """
import gc, pickle, numpy as np, symspline as ss

space, x = ss.Sphere(2), np.linspace(0, 99, 100)
p = space.geodesic([1, 0, 0], [0, 1, 0], x / 99)

def calls():
    spline = ss.CubicSpline(None, p, space, progress=lambda *_: None)
    spline(x, nu=2), spline.length(), pickle.loads(pickle.dumps(spline)), str(spline.report)
    ss.fit_many([(None, p), (None, p[:9])], space)
    ss.CubicSpline(None, (p, p), "sphere:2 x r:3")(x)
    space.log(p, p[::-1]), space.random_point(np.random.default_rng(0), 100)
    for bad in (lambda: spline(x + 1), lambda: space.log(p, -p), lambda: space.check_point(p + 1)):
        try:
            bad()
            raise SystemExit("no error")
        except ValueError:
            pass

def size():
    gc.collect()
    return 4096 * int(open("/proc/self/statm").read().split()[1])

for _ in range(100):
    calls()
before = size()
for _ in range(300):
    calls()
print(size() - before)
"""


@proc
def test_memory_does_not_grow():
    # One lost array a call would be 0.7 MB.
    assert int(run_python(GROWTH)) < 400_000


# ---- threads that wait for each other ----

CROWD = """
import threading, time, numpy as np, symspline as ss

ss.set_num_threads(2)
space = ss.Sphere(2)
p = space.geodesic([1, 0, 0], [0, 1, 0], np.linspace(0, 1, 40_000))
spline, x = ss.CubicSpline(None, p, space), np.linspace(0, 39_999, 400_000)
until = time.monotonic() + 1.5

def work(call):
    while time.monotonic() < until:
        call()

calls = [lambda: spline(x, nu=2), lambda: ss.CubicSpline(None, p, space), lambda: space.check_point(p)]
threads = [threading.Thread(target=work, args=(call,), daemon=True) for call in calls * 2]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join(20)
    assert not thread.is_alive(), "threads wait for each other"
"""


def test_threads_do_not_wait_for_each_other():
    """Some ask Python whether to go on while others hold its lock and wait for the same cores."""
    run_python(CROWD, timeout=60)

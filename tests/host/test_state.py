"""The library does not change the state of the program that uses it."""

from pathlib import Path

import numpy as np
import pytest
from compare import same, same_curve
from curves import every_common, points_on, run_python

import symspline as ss

STATE = """
import json, locale, logging, os, random, signal, sys, threading, warnings
import numpy as np

def state():
    return dict(
        errors=np.geterr(), callback=np.geterrcall() is None, printing=str(np.get_printoptions()),
        filters=[str(f) for f in warnings.filters], environment=dict(os.environ), path=list(sys.path),
        signals=[str(signal.getsignal(s)) for s in signal.valid_signals()], directory=os.getcwd(),
        locale=str(locale.localeconv()), random=str(random.getstate()[1][:9]), threads=threading.active_count(),
        numpy_random=np.random.get_state()[1].tolist(), logging=str(logging.root.handlers),
        umask=(os.umask(0o22), os.umask(0o22))[1], hooks=[str(sys.excepthook), str(threading.excepthook)],
        recursion=sys.getrecursionlimit(), switch=sys.getswitchinterval(), subnormal=np.float64(5e-324) * 1.0,
    )

os.umask(0o22)
with np.errstate(divide="raise", over="raise", invalid="raise"):
    before = state()
    import symspline as ss
    imported = state()
    rng = np.random.default_rng(0)
    p = ss.Sphere(3).geodesic([1, 0, 0, 0], [0, 1, 0, 0], np.linspace(0, 1, 20000))
    spline = ss.CubicSpline(None, p, "sphere:3")
    spline(rng.uniform(0, 19999, 100000), nu=2), spline.length(), str(spline.report)
    for bad in (lambda: ss.CubicSpline(None, -p[::19999], "sphere:2"), lambda: spline(-1)):
        try:
            bad()
        except ValueError:
            pass
    ss.CubicSpline(None, [p[0], -p[0]], "sphere:3", on_failure="ignore").control_points
    used = state()
for name in before:
    assert before[name] == imported[name], ("import", name, before[name], imported[name])
    assert before[name] == used[name], ("use", name, before[name], used[name])
"""


def test_nothing_of_the_host_is_changed():
    run_python(STATE)


@every_common
def test_works_where_numpy_raises(space):
    p = points_on(space, 6, (2,))
    x = np.linspace(0, 5, 11)
    spline = ss.CubicSpline(None, p, space)
    with np.errstate(all="raise"):
        strict = ss.CubicSpline(None, p, space)
        assert same_curve(strict, spline)
        assert same(strict(x, nu=2), spline(x, nu=2))
        assert same(strict.length(), spline.length())
        assert same(strict.bending_energy(), spline.bending_energy())
        assert str(strict.report) == str(spline.report)


proc = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads the size of a process in /proc")


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
        pytest.param("ss.space('so:100000').random_point(rng)", 60, id="a huge space"),
        pytest.param("curve(x)", 10, id="values"),
        pytest.param("curve.space.exp(p, v)", 10, id="operation"),
        pytest.param("ss.CubicSpline(t, p, 'sphere:2')", 30, id="fit"),
    ],
)
def test_too_little_memory_is_an_error(work, spare):
    run_python(SHORT.format(work=work, spare=spare), timeout=60, RUST_BACKTRACE="0")

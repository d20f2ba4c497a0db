"""Memory does not grow, may end, and is no more than the data of large spaces need."""

import sys
from pathlib import Path

import pytest
from curves import run_python

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


SMOKE = """
import numpy as np, symspline as ss, sys
space = ss.space(sys.argv[1])
rng = np.random.default_rng(0)
start = np.eye(1, space.point_shape[0])[0] if sys.argv[1][0] == "h" else space.random_point(rng)
v = space.random_tangent(rng, np.broadcast_to(start, (20, *start.shape)))
p = space.exp(start, 0.3 / np.sqrt(space.dim) * v)
w = 0.2 / np.sqrt(space.dim) * space.random_tangent(rng, p[0])
for bc_type in ("not-a-knot", ((1, w), "natural")):
    spline = ss.CubicSpline(None, p, space, bc_type=bc_type)
    assert spline.report.converged
    for nu in range(3):
        assert np.isfinite(spline([0.5, 7.3], nu)).all()
assert space.distance(spline(np.arange(20.0)), p).max() < 1e-12
assert spline.length() > 1
many = ss.fit_many([(None, p[:7]), (None, p)], space)
assert many[1] == ss.CubicSpline(None, p, space)
assert np.isfinite(ss.BezierCurve(p[:4], space)([0.0, 0.5], nu=2)).all()
print(*(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads the memory used in /proc")
@pytest.mark.parametrize("name", ["sphere:49999", "gr:2,10000"])
def test_really_large_spaces(name):
    """Seconds, where an n × n array would be 3 GB at least."""
    peak = run_python(SMOKE, name, timeout=60)
    assert int(peak) < 1_500_000

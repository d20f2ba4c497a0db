"""The library does not change the state of the program that uses it."""

import numpy as np
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

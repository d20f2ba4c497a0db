"""No input aborts the process: huge sizes raise an error, and long calls end after Ctrl-C."""

import sys

import pytest
from limited import run

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of memory as Linux has them")


@pytest.mark.parametrize(
    ("name", "nodes", "options", "words"),
    [
        ("spd:100", 20, {"method": "newton"}, "Pass method='quasi-newton', which needs far less"),
        ("so:60", 30, {"method": "homotopy"}, "so:60"),
        ("so:60", 2, {}, None),
        ("spd:40", 12, {}, None),
    ],
)
def test_fits_in_many_dimensions_do_not_abort(name, nodes, options, words):
    script = f"""
    space = ss.space({name!r})
    rng = np.random.default_rng(1)
    first = space.random_point(rng)
    v = space.random_tangent(rng, np.broadcast_to(first, ({nodes}, *first.shape)))
    points = space.exp(first, 0.05 * v)
    try:
        print(ss.CubicSpline(None, points, space, **{options!r}).report.converged)
    except MemoryError as error:
        print(error)
    """
    said = run(script)
    if words is None:
        assert said.strip() == "True"
    else:
        assert words in said and "GB" in said


def test_sizes_that_no_memory_holds_raise_memory_error():
    """In statistics and on grids, as in fits: the message names the size and a remedy."""
    script = """
    m, rng = ss.measure, np.random.default_rng(0)

    t = np.arange(100.0)
    y = np.cumsum(0.1 * rng.standard_normal((100, 3)), axis=0)
    points = m.Points(t, y, sigma=0.1)
    many = m.Constant(3000, sigma=1.0)
    range_of = m.Function(t, lambda x, p: x[:, 0] - y[:, 0] + p["many"][:100], sigma=1.0, parameters={"many": many})
    curve = ss.estimate([points, m.Velocities(t, y, 0 * y, sigma=1.0)], 20, "r:3", lam=1.0)
    grid = ss.GridSpline((None,) * 3, np.zeros((3, 3, 3, 1)), "r:1")
    line = np.linspace(0, 1, 2**22)
    calls = {
        "estimate": lambda: ss.estimate([points, range_of], 20, "r:3", lam=1.0),
        "cov": lambda: curve.cov(np.linspace(0, 99, 20_000_000)),
        "grid": lambda: grid.grid(line, line, line),
    }
    for name, call in calls.items():
        try:
            call()
            print(name, "done")
        except MemoryError as error:
            print(name, "GB" in str(error) and str(error).count(". ") >= 1)
    """
    said = dict(line.split() for line in run(script, 200).splitlines())
    assert len(said) == 3 and set(said.values()) == {"True"}, said


def test_little_address_space_never_aborts():
    """With a little less memory than needed or much less, each call returns or raises MemoryError."""
    script = """
    import os

    def turns(n):
        return ss.rotations.from_rotation_vectors(np.sin(np.linspace(0, 20, n))[:, None] * [0.1, 0.2, 0.3])

    m, n = ss.measure, 1500
    points, y = turns(n), np.cumsum(np.random.default_rng(0).standard_normal((300, 5)), axis=0)
    t, spline = np.arange(300.0), ss.CubicSpline(None, points, "so:3")
    data = [m.Points(t, y, sigma=0.1), m.Velocities(t, y, 0 * y, sigma=1.0)]
    curve = ss.estimate(data, 60, "r:5", lam=1.0)
    bezier = ss.BezierCurve(y[:, :3], "r:3")
    calls = [
        lambda: ss.CubicSpline(None, points, "so:3"),
        lambda: spline.jvp(np.linspace(0, n - 1, 2000), np.zeros((n, 3, 3))),
        lambda: spline.vjp(np.linspace(0, n - 1, 2000), np.zeros((2000, 3, 3))),
        lambda: ss.make_smoothing_spline(None, points, "so:3", 1.0),
        lambda: ss.estimate(data, 60, "r:5", lam=1.0),
        lambda: curve.cov(np.linspace(0, 299, 20_000)),
        lambda: curve.sample(np.random.default_rng(0), 1000),
        lambda: bezier(np.linspace(0, 1, 3000)),
        lambda: spline.closest(points[:100]),
    ]
    failed = []
    for k, call in enumerate(calls):
        for more in (1, 8, 60):
            child = os.fork()
            if child == 0:
                used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
                resource.setrlimit(resource.RLIMIT_AS, (used + more * 10**6,) * 2)
                try:
                    call()
                except MemoryError:
                    pass
                os._exit(0)
            if os.waitpid(child, 0)[1]:
                failed.append((k, more))
    print(failed)
    """
    assert run(script, 200).strip() == "[]"


def test_pools_of_other_sizes_end():
    script = """
    import threading
    import time

    def count():
        return int(next(line for line in open("/proc/self/status") if line.startswith("Threads")).split()[1])

    points = ss.space("so:3").random_point(np.random.default_rng(0), (20_000,))
    for n in [*range(2, 12)] * 3:
        ss.set_num_threads(n)
        ss.space("so:3").project(points)
        ss.make_smoothing_spline(None, np.zeros((40, 300, 1)), "r:1", 1.0)
    time.sleep(0.5)
    print(count())
    """
    assert int(run(script)) < 30


# `interrupts.py` has many more, and measures the time until they end.
LONG_CALLS = {
    "fixed-point": "ss.CubicSpline(None, far(ss.space('so:9'), 300), 'so:9', method='fixed-point', tol=0)",
    "log": "many(ss.space('so:150'), 'log')",
    "evaluate": "while True: spline('spd:30', 4)(np.linspace(0, 3, 200_000))",
    "smooth": "ss.make_smoothing_spline(None, far(ss.space('spd:9'), 400), 'spd:9', method='newton')",
}


@pytest.mark.parametrize("call", LONG_CALLS)
def test_long_calls_end_after_a_signal(call):
    """They take minutes, or do not end; the process has half a minute."""
    script = f"""
    import signal
    import threading

    def far(space, nodes):
        rng = np.random.default_rng(2)
        p = space.random_point(rng)
        return space.exp(p, 0.4 * space.random_tangent(rng, np.broadcast_to(p, (nodes, *p.shape))))

    def spline(name, nodes):
        space = ss.space(name)
        return ss.CubicSpline(None, far(space, nodes), space, method="quasi-newton", on_failure="ignore")

    def many(space, name):
        p = far(space, 40)
        while True:
            getattr(space, name)(p, p[::-1])

    main = threading.main_thread().ident
    timer = threading.Timer(1.0, lambda: signal.pthread_kill(main, signal.SIGINT))
    timer.start()
    try:
        {LONG_CALLS[call]}
        timer.cancel()
    except KeyboardInterrupt:
        print("interrupted")
    # Everything still works.
    assert np.array_equal(ss.CubicSpline(None, np.eye(3), "sphere:2")([0, 1, 2]), np.eye(3))
    """
    # A machine that is fast enough may finish before the signal comes.
    assert run(script, 30).strip() in ("interrupted", "")

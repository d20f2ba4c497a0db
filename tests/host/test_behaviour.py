"""What the library does to the program that uses it, and how it behaves at the edges."""

import itertools
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from cases import jumps, steep_tangent
from curves import EPS, SPACES, each, largest_difference, points_on, run_python, same, same_curve
from scipy.interpolate import CubicSpline as FlatSpline

import symspline as ss

every_space = pytest.mark.parametrize("space", SPACES, ids=str)
every_factor = pytest.mark.parametrize("space", SPACES[:3], ids=str)
S2, S3 = ss.Sphere(2), ss.Sphere(3)


@pytest.fixture
def threads():
    """Puts the number of threads back."""
    yield
    ss.set_num_threads(0)


def scattered(n, seed=0):
    """Points on S³ that are far apart: hard work for Algorithm 1."""
    return S3.random_point(np.random.default_rng(seed), n)


# ---- the host program ----

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


def test_saving_leaves_the_umask_alone(tmp_path, monkeypatch):
    masks = []
    monkeypatch.setattr(os, "umask", lambda mask: masks.append(mask) or 0o22)
    ss.CubicSpline(None, np.eye(3), S2).save(tmp_path / "curve.npz")
    assert not masks


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX rights")
def test_saved_files_have_the_rights_of_new_files(tmp_path):
    ss.CubicSpline(None, np.eye(3), S2).save(tmp_path / "curve.npz")
    (tmp_path / "other").write_text("")
    assert (tmp_path / "curve.npz").stat().st_mode == (tmp_path / "other").stat().st_mode


@every_space
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


def test_nan_curves_warn_of_nothing():
    p = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0]])
    with warnings.catch_warnings(), np.errstate(all="raise"):
        warnings.simplefilter("error")
        spline = ss.CubicSpline(None, [p, np.roll(p, 1, axis=0)[[0, 1, 0]]], S2, on_failure="ignore")
        assert np.isnan(spline(0.5)[0]).all()
        assert np.isnan(spline.length()[0]) and np.isnan(spline.bending_energy()[0])
        assert np.isnan(spline.control_points[0, 0, 1]).all()
        assert "1 of 2" in str(spline.report)


# ---- the GIL, Ctrl-C, progress ----


@pytest.mark.parametrize("n", [1, 2])
def test_other_threads_run_during_a_fit(threads, n):
    ss.set_num_threads(n)
    ticks, stop = [], threading.Event()

    def tick():
        while not stop.wait(0.001):
            ticks.append(time.perf_counter())

    other = threading.Thread(target=tick)
    other.start()
    try:
        size, seconds = 50_000, 0.0
        while seconds < 0.2:
            size *= 2
            p = scattered(size)
            start = time.perf_counter()
            ss.CubicSpline(None, p, S3, method="fixed-point", max_iter=60, on_failure="ignore")
            end = time.perf_counter()
            seconds = end - start
    finally:
        stop.set()
        other.join()
    # About 200 ticks fit in; if the lock were held, all but one or two would come later.
    assert sum(start < t < end for t in ticks) > 10


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
            start = time.perf_counter()
            process.send_signal(signal.SIGINT)
            while (line := process.stdout.readline()) == "started\n":
                pass
            seconds = time.perf_counter() - start
            assert line == "interrupted\n"
            assert process.stdout.read() == "well\n"
            assert process.wait(10) == 0
            # It takes about 0.05 s; the whole fit takes minutes.
            assert seconds < 2
        finally:
            process.kill()


def hard_fit(progress, n=400_000, **options):
    options = {
        "method": "fixed-point",
        "max_iter": 100,
        "on_failure": "ignore",
        "progress": progress,
    } | options
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


def test_progress_of_a_short_fit():
    calls = []
    ss.CubicSpline(None, np.eye(3), S2, progress=lambda *call: calls.append(call))
    assert calls[-1] == (3, 3)
    calls.clear()
    ss.fit_many([(None, np.eye(3)), (None, np.eye(3)[:2])], S2, progress=lambda *call: calls.append(call))
    assert calls[-1] == (5, 5)


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


def test_progress_of_a_product():
    calls = []
    ss.CubicSpline(None, (np.eye(3), np.eye(3)), "sphere:2 x r:3", progress=lambda *call: calls.append(call))
    assert [finished for finished, total in calls].count(calls[-1][0]) == 1


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


def test_an_exception_in_the_last_call_of_progress_comes_out():
    def progress(finished, total):
        raise Enough

    with pytest.raises(Enough):
        ss.CubicSpline(None, np.eye(3), S2, progress=progress)
    with pytest.raises(Enough):
        ss.fit_many([(None, np.eye(3))], S2, progress=progress)


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


@pytest.mark.parametrize(
    "n",
    [
        1,
        2,
    ],
)
def test_progress_may_fit_another_curve(n):
    run_python(NESTED, n, RUST_BACKTRACE="0")


# ---- the same bits ----


def work(seed):
    space = SPACES[seed % len(SPACES)]
    p = points_on(space, 40, (3,), step=0.5, seed=seed % 8)
    spline = ss.CubicSpline(None, p, space, bc_type="not-a-knot")
    x = np.linspace(0, 39, 200)
    return spline, *(spline(x, nu=nu) for nu in range(3))


def test_calls_from_many_threads_give_the_same_bits(threads):
    ss.set_num_threads(2)
    expected = [work(seed) for seed in range(8)]
    with ThreadPoolExecutor(8) as pool:
        for seed, (spline, *values) in enumerate(pool.map(work, range(64))):
            assert same_curve(spline, expected[seed % 8][0])
            assert all(map(same, values, expected[seed % 8][1:]))


def test_parallel_calls_from_many_threads_give_the_same_bits(threads):
    ss.set_num_threads(2)
    p = S3.geodesic([1, 0, 0, 0], [0, 1, 0, 0], np.linspace(0, 9, 20_000))
    x = np.random.default_rng(0).uniform(0, 19_999, 30_000)
    expected = ss.CubicSpline(None, p, S3)
    values = expected(x, nu=2)

    def fit_and_evaluate(_):
        spline = ss.CubicSpline(None, p, S3)
        return same_curve(spline, expected) and same(spline(x, nu=2), values)

    with ThreadPoolExecutor(6) as pool:
        assert all(pool.map(fit_and_evaluate, range(24)))


@every_space
@pytest.mark.parametrize("kind", ["long", "closed", "batch", "many"])
def test_one_thread_and_two_give_the_same_bits(threads, space, kind):
    if kind == "many":
        curves = [(None, points_on(space, n, step=0.4, seed=n)) for n in range(2, 60)] * 20
        fits = [(lambda c=curves: ss.fit_many(c, space))]
    else:
        n, batch = (300, ()) if kind != "batch" else (30, (40,))
        p = points_on(space, n, batch, step=0.4)
        if kind != "batch":
            # There and back again and again: 20 000 points.
            p = each(lambda q: np.concatenate([*[q, q[-2:0:-1]] * 33, q[:1]]), p)
        else:
            p = each(lambda q: np.concatenate([q] * 30), p)
        bc_type = "periodic" if kind == "closed" else "natural"
        fits = [lambda: [ss.CubicSpline(None, p, space, bc_type=bc_type)]]
    for fit in fits:
        results = []
        for n in (1, 2, 3):
            ss.set_num_threads(n)
            results.append(fit())
        for one, *others in zip(*results, strict=True):
            assert all(same_curve(one, other) for other in others)


@every_space
@pytest.mark.parametrize("quantity", [0, 1, 2, "speed", "per curve"])
def test_one_thread_and_two_evaluate_the_same_bits(threads, space, quantity):
    spline = ss.CubicSpline(None, points_on(space, 50, (2,), step=0.4), space)
    x = np.random.default_rng(0).uniform(0, 49, (2, 20_000))

    def values():
        if quantity == "speed":
            return spline.speed(x)
        return spline(x, per_curve=True) if quantity == "per curve" else spline(x, nu=quantity)

    results = []
    for n in (1, 2, 3):
        ss.set_num_threads(n)
        results.append(values())
    assert same(results[0], results[1]) and same(results[0], results[2])


@every_factor
def test_one_thread_and_two_operate_the_same(threads, space):
    p = np.tile(points_on(space, 100, step=0.3), (300, 1))
    q = np.roll(p, 1, axis=0)
    results = []
    for n in (1, 2):
        ss.set_num_threads(n)
        v = space.log(p, q)
        results.append((v, space.exp(p, v), space.distance(p, q)))
    assert all(map(same, *results))


def in_child(queue):
    spline, *values = work(1)
    p = S3.geodesic([1, 0, 0, 0], [0, 1, 0, 0], np.linspace(0, 9, 20_000))
    long = ss.CubicSpline(None, p, S3)
    queue.put((spline.velocities, *values, long.velocities, long(np.linspace(0, 19_999, 50_000))))


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="needs fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
# JAX, which other tests import, warns of its own threads.
@pytest.mark.filterwarnings("ignore:os.fork:RuntimeWarning")
def test_a_forked_process_works(threads):
    ss.set_num_threads(2)
    context = multiprocessing.get_context("fork")
    queue = context.Queue()

    class Here:
        def put(self, value):
            self.value = value

    # The parent's threads are running when it forks, and again between two children.
    expected = Here()
    in_child(expected)
    for _ in range(2):
        children = [context.Process(target=in_child, args=(queue,)) for _ in range(2)]
        for child in children:
            child.start()
        found = [queue.get(timeout=20) for _ in children]
        for child in children:
            child.join(20)
            assert child.exitcode == 0
        assert all(map(same, found[0], expected.value)) and all(map(same, found[1], expected.value))
        in_child(expected)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_fork_in_the_middle_of_work():
    run_python("""
import os, threading, time, numpy as np, symspline as ss
ss.set_num_threads(2)
p = ss.Sphere(3).random_point(np.random.default_rng(0), 200_000)
q = ss.Sphere(3).geodesic(p[0], p[1], np.linspace(0, 1, 20_000))
options = dict(method="fixed-point", max_iter=60, on_failure="ignore")
other = threading.Thread(target=lambda: ss.CubicSpline(None, p, "sphere:3", **options))
expected = ss.CubicSpline(None, q, "sphere:3")
other.start()
time.sleep(0.05)
child = os.fork()
if child == 0:
    os._exit(0 if ss.CubicSpline(None, q, "sphere:3") == expected else 1)
assert os.waitpid(child, 0)[1] == 0
other.join()
""")


# ---- points that coincide ----


@every_space
@pytest.mark.parametrize("bc_type", ["natural", "clamped", "not-a-knot", "periodic"])
@pytest.mark.parametrize("n", [2, 3, 4, 30])
def test_a_curve_that_stands_still(space, bc_type, n):
    p = each(lambda q: np.repeat(q, n, axis=0), points_on(space, 1))
    spline = ss.CubicSpline(None, p, space, bc_type=bc_type)
    assert spline.report.converged
    x = np.linspace(0, n - 1, 50)
    here = each(lambda q: q[0], p)
    assert largest_difference(spline(x), here) < 20 * EPS
    for nu in (1, 2):
        # Rounding of points, which the hyperboloid counts squared, over h or h².
        assert largest_difference(spline(x, nu=nu), each(np.zeros_like, here)) < 500 * EPS


@every_factor
@pytest.mark.parametrize("size", [1e-9, 1e-12, 1e-15, 1e-100])
@pytest.mark.parametrize("bc_type", ["natural", "clamped", "not-a-knot"])
def test_points_a_hair_apart_are_as_in_flat_space(space, size, bc_type):
    rng = np.random.default_rng(3)
    p = points_on(space, 1)[0]
    t = np.array([0.0, 1, 1.5, 3, 4, 4.5])
    v = size * space.random_tangent(rng, np.broadcast_to(p, (6, *p.shape)))
    spline = ss.CubicSpline(t, space.exp(p, v), space, bc_type=bc_type)
    assert spline.report.converged
    flat, x = FlatSpline(t, v, bc_type=bc_type), np.linspace(0, 4.5, 30)
    # Curvature counts with size³; what is left is the rounding of points.
    assert largest_difference(spline(x), p + flat(x)) < 20 * EPS
    assert largest_difference(spline(x, nu=1), flat(x, 1)) < 200 * EPS


@every_space
def test_a_curve_that_pauses(space):
    q = points_on(space, 5)
    p = each(lambda a: a[[0, 1, 2, 2, 2, 2, 3, 4]], q)
    spline = ss.CubicSpline(None, p, space)
    assert spline.report.converged
    assert largest_difference(spline(spline.t), p) < 20 * EPS
    assert np.isfinite(spline.length()) and spline.length() > 4 * 0.69


@every_factor
@pytest.mark.parametrize("h", [1e-9, 1e-3, 1e3, 1e12])
def test_the_unit_of_time_does_not_matter(space, h):
    p, t = points_on(space, 6), np.array([0.0, 1, 1.5, 3, 4, 4.5])
    spline, scaled = ss.CubicSpline(t, p, space), ss.CubicSpline(h * t, p, space)
    x = np.linspace(0, 4.5, 20)
    scale = np.abs(spline.velocities).max()
    assert largest_difference(scaled.velocities * h, spline.velocities) < 1e-12 * scale
    assert largest_difference(scaled(h * x), spline(x)) < 1e-12


def test_repeated_points_with_a_jump_between():
    p = np.repeat(np.eye(3), 3, axis=0)
    spline = ss.CubicSpline(None, p, S2)
    assert spline.report.converged and largest_difference(spline(spline.t), p) < 20 * EPS


# ---- precision far out ----


def mirrored(d):
    """Two points of H² at distance d whose middle is (1, 0, 0)."""
    x = np.sinh(d / 2)
    return np.array([[np.sqrt(1 + x * x), -x, 0], [np.sqrt(1 + x * x), x, 0]])


# Velocities are ambient arrays, whose rounding de Casteljau's algorithm multiplies by the legs' cosh.
lossy = pytest.mark.xfail(strict=True, reason="rounding grows faster than |p|² for steps this long")


@pytest.mark.parametrize(
    ("how", "d"),
    [
        *(("geodesic", d) for d in (2, 5, 15, 20)),
        *(("spline", d) for d in (2, 5)),
        *(pytest.param("spline", d, marks=lossy) for d in (15, 20)),
    ],
)
def test_the_hyperboloid_costs_no_more_than_the_square_of_its_points(how, d):
    space, p = ss.Hyperbolic(2), mirrored(d)
    middle = space.geodesic(*p, 0.5) if how == "geodesic" else ss.CubicSpline(None, p, space)(0.5)
    # In all but rounding this is (p + q)/|p + q|.
    assert np.abs(middle - [1, 0, 0]).max() < 100 * EPS * p[0, 0] ** 2


def test_what_is_mostly_rounding_has_not_converged():
    report = ss.CubicSpline(None, mirrored(30), "h:2", on_failure="ignore").report
    assert not report.converged or report.residual < 1e-3


def test_legs_that_doubles_cannot_hold_are_an_error():
    # Given velocities are a solution at once, but ε cosh²(30) is far above 1.
    p, v = [[1.0, 0, 0], [np.cosh(1), np.sinh(1), 0]], np.array([0, 0, 90.0])
    with pytest.raises(ss.ConvergenceError, match=r"control leg at points\[0\] has length 30\.0, .*times"):
        ss.CubicSpline(None, p, "h:2", bc_type=((1, v), (1, v)))
    assert np.isfinite(ss.CubicSpline(None, p, "h:2", bc_type=((1, v / 10), (1, v / 10)))(0.5)).all()


# ---- tracks on a globe ----


def on_globe(lonlat):
    lon, lat = np.radians(np.transpose(lonlat))
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)


TRACKS = {
    "across the date line": [(172, 12), (175, 14), (178, 15), (-179, 17), (-176, 20), (-172, 24), (-167, 27)],
    "back and forth at the date line": [
        (178, 0),
        (-178, 3),
        (179, 6),
        (-179, 8),
        (180, 11),
        (-180, 15),
        (177, 18),
    ],
    "over the pole": [(20, 80), (20, 84), (20, 88), (-160, 88), (-160, 84), (-160, 80)],
    "on the pole": [(20, 80), (35, 85), (123, 90), (-140, 85), (-150, 80)],
    "round the pole": [(0, 88), (60, 89), (120, 88), (180, 89), (-120, 88), (-60, 89), (0, 88)],
    "from pole to pole": [(0, 90), (30, 45), (60, 0), (90, -45), (0, -90)],
}


@pytest.mark.parametrize("name", TRACKS)
@pytest.mark.parametrize("bc_type", ["natural", "not-a-knot"])
def test_tracks_are_smooth(name, bc_type):
    p = on_globe(TRACKS[name])
    t = np.cumsum(np.r_[0, np.random.default_rng(0).uniform(3, 9, len(p) - 1)]) * 3600
    spline = ss.CubicSpline(t, p, S2, bc_type=bc_type)
    assert max(jumps(spline)) <= 1
    # Continuous also across the places where longitude jumps: no step is longer than speed allows.
    x = np.linspace(t[0], t[-1], 5001)
    steps = S2.distance(spline(x[:-1]), spline(x[1:]))
    assert steps.max() <= 1.001 * spline.speed(x).max() * (x[1] - x[0])


@pytest.mark.parametrize("name", TRACKS)
def test_tracks_make_no_detour(name):
    p = on_globe(TRACKS[name])
    spline = ss.CubicSpline(None, p, S2)
    chords = S2.distance(p[:-1], p[1:])
    assert chords.sum() <= spline.length() < 1.3 * chords.sum()
    # The curve between two points stays near the geodesic between them.
    for i, chord in enumerate(chords):
        x = np.linspace(i, i + 1, 21)
        off = S2.distance(spline(x), S2.geodesic(p[i], p[i + 1], x - i))
        assert off.max() < 0.4 * chord


@pytest.mark.parametrize("name", TRACKS)
def test_tracks_do_not_know_where_the_poles_are(name):
    p = on_globe(TRACKS[name])
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    x = np.linspace(0, len(p) - 1, 101)
    here, there = ss.CubicSpline(None, p, S2), ss.CubicSpline(None, p @ turn, S2)
    for nu in range(3):
        assert largest_difference(here(x, nu=nu) @ turn, there(x, nu=nu)) < 1e-12


def test_a_straight_flight_over_the_pole_stays_straight():
    p = on_globe(TRACKS["over the pole"])
    spline = ss.CubicSpline(None, p, S2)
    x = np.linspace(0, 5, 101)
    across = on_globe([(110, 0)])[0]
    assert np.abs(spline(x) @ across).max() < 4 * EPS
    assert S2.distance(spline(2.5), [0, 0, 1]) < 4 * EPS
    assert spline.length() == pytest.approx(np.radians(20), rel=1e-13)


# ---- whatever comes, no crash ----


def test_strange_but_lawful_input():
    rng = np.random.default_rng(0)
    spaces = [ss.Euclidean(1), ss.Sphere(1), ss.Sphere(9), ss.Hyperbolic(1), ss.Hyperbolic(9)]
    for space, n, bc_type in itertools.product(spaces, (2, 3, 4, 9), ("natural", "clamped", "not-a-knot")):
        p = points_on(space, n, step=0.5, seed=n)
        t = np.cumsum(10.0 ** rng.uniform(-3, 3, n))
        spline = ss.CubicSpline(t, p, space, bc_type=bc_type, on_failure="ignore")
        x = rng.uniform(t[0] - 1, t[-1] + 1, 20)
        for nu, policy in itertools.product(range(3), (True, "geodesic", "periodic")):
            assert spline(x, nu=nu, extrapolate=policy).shape == (20, *space.point_shape)
        assert "\n" not in str(spline.report)


@pytest.mark.parametrize("size", [1e-200, 1e-150, 1e-30, 1e30, 1e150, 1e200])
def test_huge_and_tiny_flat_data(size):
    t, p = np.arange(5.0), size * points_on(ss.Euclidean(2), 5)
    spline, flat = ss.CubicSpline(t, p, "r:2"), FlatSpline(t, p, bc_type="natural")
    assert np.abs(spline.velocities - flat(t, 1)).max() < 1e-13 * size


def test_state_is_described_by_plain_json():
    # Used by whoever logs reports.
    report = ss.CubicSpline(None, np.eye(3), S2).report
    assert json.loads(json.dumps(vars(report)))["converged"] is True


@pytest.mark.parametrize("n", [1, 2, 3, 7])
@pytest.mark.parametrize("gap", [0.1, 1e-3, 1e-8, 1e-12, 1e-13, 1e-14])
def test_the_last_digits_before_the_antipode(n, gap):
    """A logarithm there is tangent, of the right length, and leads to the point; so do curves."""
    space, rng = ss.Sphere(n), np.random.default_rng(n)
    p = space.random_point(rng, 20)
    v = space.random_tangent(rng, p)
    q = space.exp(p, (np.pi - gap) * v / space.norm(p, v)[:, None])
    log = space.log(p, q)
    assert np.abs(np.sum(p * log, axis=-1)).max() < 1e-15
    np.testing.assert_allclose(space.norm(p, log), np.pi - gap, rtol=0, atol=2e-15)
    for t in (0.0, 0.3, 1.0):
        np.testing.assert_allclose(space.geodesic(p, q, t), space.exp(p, t * log), atol=1e-15)
    np.testing.assert_allclose(space.exp(p, log), q, atol=2e-15)
    curves = ss.CubicSpline(None, np.stack([p, q], axis=1), space)
    np.testing.assert_allclose(curves(1.0), q, atol=4e-15)
    # A curve's points are normalised, which turns the direction by as much as rounding is of the gap.
    np.testing.assert_allclose(curves(0.3), space.geodesic(p, q, 0.3), atol=4e-15 + 4 * EPS / gap)


@pytest.mark.parametrize("name", ["gr:2,5", "cgr:2,4", "gr:1,3", "rp:2", "cp:2"])
def test_b_splines_of_subspaces_that_reach_the_cut_locus(name):
    space, rng = ss.space(name), np.random.default_rng(1)
    for _ in range(5):
        p = space.random_point(rng)
        q = space.exp(p, space.injectivity_radius * (1 - 4e-15) * steep_tangent(space, p, rng))
        curve = ss.BSpline([0, 0, 1, 1], [p, q], 1, space)
        for nu in range(3):
            assert np.isfinite(curve(0.3, nu)).all()
        assert np.isclose(curve.speed(0.3), space.distance(p, q), atol=1e-12)

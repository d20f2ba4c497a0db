"""The number of threads, and bit-identical results for every number of them."""

import multiprocessing
import os
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from cases import COMMON
from compare import each, same, same_curve
from curves import S3, every_common, points_on, run_python
from refused import raises

import symspline as ss
from symspline import _core


def test_set_num_threads(threads):
    for n in (1, 2, 3):
        ss.set_num_threads(n)
        assert ss.num_threads() == n
    ss.set_num_threads(0)
    assert 1 <= ss.num_threads() <= os.cpu_count()


def test_threads_from_the_environment():
    code = """
try:
    import symspline as ss
    print(ss.num_threads())
except ImportError as error:
    print(error)
"""
    assert run_python(code, SYMSPLINE_NUM_THREADS="3") == "3\n" and int(run_python(code, SYMSPLINE_NUM_THREADS=""))
    assert "SYMSPLINE_NUM_THREADS must be a whole number, not 'many'" in run_python(code, SYMSPLINE_NUM_THREADS="many")


@pytest.mark.skipif(sys.platform != "linux", reason="counts threads in /proc")
@pytest.mark.parametrize("counts, most", [([1], 0), ([2], 2), ([2, 3] * 8, 5)], ids=str)
def test_no_more_threads_than_allowed(counts, most):
    code = """
import json, os, sys, numpy as np, symspline as ss
spline = ss.CubicSpline(None, np.eye(3), "sphere:2")
x = np.linspace(0, 2, 200_000)
before = len(os.listdir("/proc/self/task"))
for n in json.loads(sys.argv[1]):
    ss.set_num_threads(n)
    spline(x)
print(len(os.listdir("/proc/self/task")) - before)
"""
    assert int(run_python(code, counts)) <= most


def work(seed):
    space = COMMON[seed % len(COMMON)]
    p = points_on(space, 40, (3,), step=0.5, seed=seed % 8)
    spline = ss.CubicSpline(None, p, space, bc_type="not-a-knot")
    x = np.linspace(0, 39, 200)
    return spline, *(spline(x, nu=nu) for nu in range(3))


@every_common
def test_one_spline_asked_by_many_threads(threads, space):
    """Without a lock of Python's, too, all of them are in the compiled module at once."""
    ss.set_num_threads(2)
    spline = ss.CubicSpline(None, points_on(space, 40, step=0.5), space, bc_type="not-a-knot")
    x = np.random.default_rng(0).uniform(0, 39, 3_000)
    calls = [lambda nu=nu: spline(x, nu=nu) for nu in range(3)]
    calls += [lambda: spline.speed(x), spline.length]
    expected, begin = [call() for call in calls], threading.Barrier(8)

    def ask(i):
        begin.wait(20)
        turns = [(i + j) % len(calls) for j in range(20)]
        return all(same(calls[k](), expected[k]) for k in turns)

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(ask, range(8)))


def with_threads(call):
    """What a call returns with one, two and three threads."""
    results = []
    for n in (1, 2, 3):
        ss.set_num_threads(n)
        results.append(call())
    return results


@pytest.mark.parametrize(
    ("space", "kind"), list(zip(COMMON, ["long", "closed", "batch", "many"], strict=True)), ids=str
)
def test_fits_do_not_depend_on_the_number_of_threads(threads, space, kind):
    if kind == "many":
        curves = [(None, points_on(space, n, step=0.4, seed=n)) for n in range(2, 60)] * 5

        def fit():
            return ss.fit_many(curves, space)

    else:
        n, batch = (300, ()) if kind != "batch" else (30, (40,))
        p = points_on(space, n, batch, step=0.4)
        if kind != "batch":
            # There and back again and again: 20 000 points.
            p = each(lambda q: np.concatenate([*[q, q[-2:0:-1]] * 33, q[:1]]), p)
        else:
            p = each(lambda q: np.concatenate([q] * 30), p)
        bc_type = "periodic" if kind == "closed" else "natural"

        def fit():
            return [ss.CubicSpline(None, p, space, bc_type=bc_type)]

    for one, *others in zip(*with_threads(fit), strict=True):
        assert all(same_curve(one, other) for other in others)


@pytest.mark.parametrize(
    ("space", "quantity"), list(zip([*COMMON, COMMON[1]], [1, 2, "speed", 0, "per curve"], strict=True)), ids=str
)
def test_evaluation_does_not_depend_on_the_number_of_threads(threads, space, quantity):
    spline = ss.CubicSpline(None, points_on(space, 50, (2,), step=0.4), space)
    x = np.random.default_rng(0).uniform(0, 49, (2, 20_000))

    def values():
        if quantity == "speed":
            return spline.speed(x)
        return spline(x, per_curve=True) if quantity == "per curve" else spline(x, nu=quantity)

    one, two, three = with_threads(values)
    assert same(one, two) and same(one, three)


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
        found = [queue.get(timeout=60) for _ in children]
        for child in children:
            child.join(60)
            assert child.exitcode == 0
        assert all(map(same, found[0], expected.value)) and all(map(same, found[1], expected.value))
        in_child(expected)


def test_a_panic_in_a_worker_is_an_error(threads):
    """No call of the interface panics: this one lies to the core about the velocities it brings."""
    curves, samples = 4000, np.linspace(0, 2, 50)
    points = np.tile(np.eye(3), (curves, 1, 1))
    short = np.zeros((curves // 2, 3, 3))
    curve = _core.Curve([(ss.Sphere(2)._handle, np.arange(3.0), points, short, None)])
    for n in (1, 2):
        ss.set_num_threads(n)
        raises("out of range", curve.evaluate, samples, "point", "raise", False, error=RuntimeError)

"""The benchmarks run, and the libraries that they compare compute the same values."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks import cost, data, every_space, geodesics, geometries, libraries, tables, timing
from benchmarks.walks import LONGEST, walks
from cases import loop_over
from scipy.spatial.transform import Rotation

import symspline as ss

ROOT = Path(__file__).parents[2]
TINY = timing.Effort(runs=2, shortest=0, longest=1)


@pytest.fixture(autouse=True)
def threads():
    before = ss.num_threads()
    yield
    ss.set_num_threads(before)


def test_smoke_test_runs_and_keeps_nothing():
    kept = {file: file.read_bytes() for file in (ROOT / "benchmarks").glob("*.*")}
    command = [sys.executable, "-m", "benchmarks", "--quick"]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, encoding="utf-8", env={**os.environ, "PYTHONUTF8": "1"}
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("A smoke test")
    assert "goal for" not in done.stdout.lower() and "missed" not in done.stdout
    assert done.stdout.count("\n## ") == 6
    failed = [line for line in done.stdout.splitlines() if "fails" in line]
    assert all("Unsupported n: 2" in line for line in failed), failed
    assert kept == {file: file.read_bytes() for file in (ROOT / "benchmarks").glob("*.*")}


def test_motion_is_smooth_and_steps_are_as_said():
    q = data.rotations(5000)
    np.testing.assert_allclose(np.linalg.norm(q, axis=-1), 1, atol=1e-14)
    steps = Rotation.from_quat(np.roll(q, -1, axis=-1))
    angles = (steps[:-1].inv() * steps[1:]).magnitude()
    assert angles.mean() == pytest.approx(data.STEP, rel=0.01) and angles.max() < 1
    assert np.sum(q[1:] * q[:-1], axis=-1).min() > 0.8
    np.testing.assert_array_equal(q, data.rotations(5000))


@pytest.mark.parametrize("n", [1, 2, 9, 10])
def test_running_product(n):
    q = data.rotations(n, seed=5)
    slow = [q[0]]
    for factor in q[1:]:
        slow.append(data.product(slow[-1], factor))
    np.testing.assert_allclose(data.running_product(q), slow, atol=1e-14)


@pytest.mark.parametrize(("name", "bounds"), [("RotationSpline", (1e-4, 1e-3, 1e-2)), ("splines", (1e-2, 0.1))])
def test_libraries_compute_the_same(name, bounds):
    if name == "splines":
        pytest.importorskip("splines")
    t, q = data.knots(60), data.rotations(60)
    x = np.linspace(10, 49, 100)
    own, *others = libraries.all_libraries()
    other = next(library for library in others if library.name == name)
    curve, theirs = (library.curve(*library.arguments(t, q)) for library in (own, other))
    for nu, bound in enumerate(bounds):
        expected = own.numbers(curve, x, nu)
        assert np.abs(expected).max() > 0.1
        np.testing.assert_allclose(other.numbers(theirs, x, nu), expected, atol=bound)
        assert len(other.at(theirs)(x, nu)) == len(own.at(curve)(x, nu)) == 100


SPACES = [
    *("spd:1", "spd:3", "hpd:2", "so:3", "u:1", "u:4", "su:3", "se:3"),
    *("rp:2", "cp:3", "gr:1,3", "gr:2,5", "gr:3,4", "gr:2,40", "cgr:2,4"),
]


@pytest.mark.parametrize("name", SPACES)
@loop_over("knots", [2, 3, 12])
def test_fit_in_numpy_is_the_same(name, knots):
    space = ss.space(name)
    points = walks(space, 4, knots)
    expected = ss.CubicSpline(None, points, space).velocities
    assert space.norm(points, expected).min() > 0.05
    np.testing.assert_allclose(geometries.velocities(points, space), expected, atol=1e-12)


def test_fit_in_numpy_that_differs_stops_the_benchmark(monkeypatch):
    space = ss.SpecialOrthogonal(3)
    points = walks(space, 2, 5)
    every_space.check(points, space)
    monkeypatch.setattr(geometries, "velocities", lambda points, space: 0.5 * points)
    with pytest.raises(SystemExit, match=r"fit in SpecialOrthogonal\(3\) differs"):
        every_space.check(points, space)


def test_fit_in_numpy_knows_its_spaces():
    with pytest.raises(ValueError, match=r"SpecialOrthogonal\(4\)"):
        geometries.velocities(walks(ss.SpecialOrthogonal(4), 1, 3), ss.SpecialOrthogonal(4))


@pytest.mark.parametrize("name", ["spd:3", "u:4", "cp:3", "se:2", "gr:2,5", "gr:2,40", "hyperbolic:2"])
def test_steps_of_the_walks_are_as_said(name):
    space = ss.space(name)
    points = walks(space, 3, 8)
    space.check_point(points)
    np.testing.assert_array_equal(points, walks(space, 3, 8))
    if name != "se:2":
        steps = space.distance(points[:, :-1], points[:, 1:])
        assert LONGEST / 3 < steps.min() < 0.17 and 0.23 < steps.max() < LONGEST


@pytest.mark.parametrize("name", ["spd:3", "hpd:2", "so:3", "u:4", "gr:2,5", "cp:3"])
@pytest.mark.parametrize("operation", geodesics.OPERATIONS)
def test_geodesics_of_others_are_the_same(name, operation):
    space = ss.space(name)
    p, q = np.moveaxis(walks(space, 5, 2), 1, 0)
    offered = [peer for peer in geodesics.PEERS if geodesics.offers(peer, space, operation)]
    for peer in offered:
        pytest.importorskip(peer)
        assert len(geodesics.checked(peer, space, operation, p, q)()) == 5
    assert offered or operation == "geodesic" or name == "hpd:2"


def test_geodesics_that_differ_stop_the_benchmark(monkeypatch):
    space = ss.SymmetricPositiveDefinite(2)
    p, q = np.moveaxis(walks(space, 2, 2), 1, 0)
    wrong = geodesics.Call(lambda: p, lambda points: points)
    monkeypatch.setattr(geodesics, "_pyriemann", lambda *_: wrong)
    with pytest.raises(SystemExit, match="pyriemann: geodesic"):
        geodesics.text({"spd:2": (p, q)}, TINY)


def test_failure_is_recorded(monkeypatch):
    def fail():
        raise ValueError("no | such\nthing")

    contestants = {"good": timing.ready(lambda: None), "bad": timing.ready(fail)}
    found = timing.measure(contestants, TINY)
    assert isinstance(found["good"], timing.Timing) and found["good"].runs == 2
    assert str(found["bad"]) == "fails: ValueError: no | such\nthing"
    assert tables.versus(found, "bad", "good", 2.0) == [None, "2×: not measured"]
    assert tables.table(("a", "b"), [(1, found["bad"])]).endswith(
        "| no \\| such thing |".replace("no", "fails: ValueError: no")
    )
    monkeypatch.setitem(sys.modules, "splines", None)
    monkeypatch.setitem(sys.modules, "splines.quaternion", None)
    missing = libraries.all_libraries()[-1]
    with pytest.raises(ImportError, match="splines"):
        missing.arguments(data.knots(2), data.rotations(2))


def test_slow_work_runs_once_and_fast_work_often():
    calls = []
    slow = timing.measure({"a": timing.ready(lambda: calls.append(0))}, timing.Effort(7, 0, 0))
    assert len(calls) == 1 and "once" in str(slow["a"])
    timing.measure({"a": timing.ready(lambda: calls.append(0))}, timing.Effort(1, 1e-3, 1))
    assert len(calls) > 100


def test_time_is_shared():
    each = timing.shared(timing.Timing(2.5, 2.0, 3.0, 7), 1000)
    assert timing.in_unit(each, 1e-6) == "2500 (2000–3000)"
    failed = timing.failure(ValueError("no"))
    assert timing.in_unit(timing.shared(failed, 10), 1e-6) == str(failed)


def test_slope():
    built = {n: {"symspline": timing.Timing(1e-9 * n**1.5, 0, 0, 1)} for n in (10, 1000, 10_000, 100_000)}
    built[10] = {"symspline": timing.Timing(1, 0, 0, 1)}
    assert cost.slope(built, "symspline") == pytest.approx(1.5)
    assert cost.slope({10: built[10]}, "symspline") is None


@pytest.mark.parametrize(
    ("timing_", "text"),
    [
        (timing.Timing(1.234e-5, 1.2e-5, 1.3e-5, 7), "12.3 µs (12.0–13.0)"),
        (timing.Timing(2.5, 2.5, 2.5, 1), "2.50 s (once)"),
        (timing.Timing(9.999e-9, 9e-9, 1e-7, 3), "10.0 ns (9.00–100)"),
    ],
)
def test_times_are_written_with_three_digits(timing_, text):
    assert str(timing_) == text

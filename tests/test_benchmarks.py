"""The benchmarks run, and what they compute is the same thing."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks import cost, data, libraries, tables, timing
from scipy.spatial.transform import Rotation

import symspline as ss

ROOT = Path(__file__).parents[1]
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
    assert done.stdout.count("\n## ") == 5
    failed = [line for line in done.stdout.splitlines() if "fails" in line]
    assert all("acceleration" in line or line.startswith("| splines |") for line in failed), failed
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


@pytest.mark.parametrize(
    ("name", "bounds"), [("RotationSpline", (1e-4, 1e-3, 1e-2)), ("splines", (1e-2, 0.1))]
)
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

"""The benchmarks run, and the libraries that they compare compute the same values."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks import accelerators, data, every_space, geodesics, geometries, libraries, tables, timing
from benchmarks.walks import walks
from cases import loop_over

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
    assert "goal for" not in done.stdout.lower() and "reached" not in done.stdout
    assert done.stdout.count("\n## ") == 8
    failed = [line for line in done.stdout.splitlines() if "fails" in line]
    assert all("Unsupported n: 2" in line for line in failed), failed
    assert kept == {file: file.read_bytes() for file in (ROOT / "benchmarks").glob("*.*")}


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


def test_times_on_a_gpu_can_be_measured(monkeypatch):
    """On the device that there is, with a space that compiles quickly."""
    jax = pytest.importorskip("jax")
    monkeypatch.setattr(accelerators, "SPACES", ("r:3",))
    before = jax.config.read("jax_enable_x64")
    try:
        lines = accelerators.text(2, timing.Effort(runs=1, shortest=0, longest=0)).splitlines()
    finally:
        jax.config.update("jax_enable_x64", before)
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines if line.startswith("| r:3")]
    assert [row[:2] for row in rows[:3]] == [["r:3, double", "core"], ["r:3, double", "JAX"], ["r:3, single", "JAX"]]
    assert float(rows[1][-1]) < 1e-12 and 0 < float(rows[2][-1]) < 1e-4
    assert not any("fails" in cell for row in rows for cell in row)


SPACES = [
    *("spd:1", "spd:3", "hpd:2", "so:3", "u:1", "u:4", "su:3", "se:3"),
    *("sphere:2", "so:4", "o:3", "sspd:3", "siegel:1", "hp:1"),
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


def test_failure_is_recorded(monkeypatch):
    def fail():
        raise ValueError("no | such\nthing")

    contestants = {"good": timing.ready(lambda: None), "bad": timing.ready(fail)}
    found = timing.measure(contestants, TINY)
    assert isinstance(found["good"], timing.Timing) and found["good"].runs == 2
    assert str(found["bad"]) == "fails: ValueError: no | such\nthing"
    assert tables.versus(found, "bad", "good", 2.0) == [None, "2×: not measured"]
    assert tables.table(("a", "b"), [(1, found["bad"])]).endswith("| fails: ValueError: no \\| such thing |")
    monkeypatch.setitem(sys.modules, "splines", None)
    monkeypatch.setitem(sys.modules, "splines.quaternion", None)
    missing = libraries.all_libraries()[-1]
    with pytest.raises(ImportError, match="splines"):
        missing.arguments(data.knots(2), data.rotations(2))


def test_times_are_written_with_three_digits():
    assert str(timing.Timing(1.234e-5, 1.2e-5, 1.3e-5, 7)) == "12.3 µs (12.0–13.0)"
    assert str(timing.Timing(2.5, 2.5, 2.5, 1)) == "2.50 s (once)"
    assert str(timing.Timing(9.999e-9, 9e-9, 1e-7, 3)) == "10.0 ns (9.00–100)"

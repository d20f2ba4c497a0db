"""Progress of evaluations counts points."""

import numpy as np
import pytest
from curves import S2, pair_of_curves

import symspline as ss


@pytest.mark.parametrize("nu", [0, 1])
@pytest.mark.parametrize(
    "space, per_curve", [("sphere:2", False), ("sphere:2", True), ("sphere:2 x r:3", False)]
)
def test_progress_of_evaluation_counts_points(space, per_curve, nu):
    spline = pair_of_curves(ss.space(space))
    x = np.linspace(0, 2, 100).reshape((2, 50) if per_curve else 100)
    calls = []
    spline(x, nu, per_curve=per_curve, progress=lambda *call: calls.append(call))
    total = 2 * (50 if per_curve else 100) * (2 if "x" in space else 1)
    assert calls[-1] == (total, total) and calls == sorted(calls)
    calls.clear()
    arrays = (x, None, spline.points, spline.velocities, space, nu)
    ss.evaluate(*arrays, per_curve=per_curve, progress=lambda *call: calls.append(call))
    assert calls[-1] == (total, total)


def test_progress_within_an_evaluation():
    """Between its ends, too, the core counts points, of which complex ones of three numbers have six doubles."""
    rng = np.random.default_rng(0)
    space = ss.ComplexProjective(2)
    points = np.stack([space.exp(np.eye(1, 3)[0], v) for v in ([0, 0, 0], [0, 0.3j, 0], [0, 0, 0.3])])
    spline, calls, size = ss.CubicSpline(None, points, space), [], 100_000
    while len(calls) < 3 and size < 2**27:
        # Twenty times a second somebody is called; how fast a machine is nobody knows.
        calls.clear()
        size *= 2
        x = rng.uniform(0, 2, size)
        spline(x, 2, progress=lambda *call: calls.append(call))
    finished, total = np.transpose(calls)
    assert len(calls) >= 3 and (total == size).all() and (np.diff(finished) >= 0).all()
    assert finished[-1] == size and (finished[1:-1] < size).all()


def test_progress_of_evaluation_must_be_a_function():
    with pytest.raises(ss.ValidationError, match="progress must be a function"):
        pair_of_curves(S2)(0.5, progress=3)
    with pytest.raises(ss.ValidationError, match="progress must be a function"):
        ss.evaluate(0.5, None, np.eye(3), np.eye(3), S2, progress=3)


def test_an_exception_in_progress_stops_an_evaluation():
    def stop(*_):
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        pair_of_curves(S2)(0.5, progress=stop)

"""Progress callbacks and exceptions in them."""

import numpy as np
import pytest
from curves import S2, pair_of_curves
from refused import raises

import symspline as ss


def test_progress_of_a_short_fit():
    calls = []
    ss.CubicSpline(None, np.eye(3), S2, progress=lambda *call: calls.append(call))
    assert calls[-1] == (3, 3)
    calls.clear()
    ss.fit_many([(None, np.eye(3)), (None, np.eye(3)[:2])], S2, progress=lambda *call: calls.append(call))
    assert calls[-1] == (5, 5)
    calls.clear()
    ss.CubicSpline(None, (np.eye(3), np.eye(3)), "sphere:2 x r:3", progress=lambda *call: calls.append(call))
    assert [finished for finished, total in calls].count(calls[-1][0]) == 1


class Enough(Exception):
    pass


def test_an_exception_in_the_last_call_of_progress_comes_out():
    def stop(*_):
        raise Enough

    spline = pair_of_curves(S2)
    for call in (
        lambda progress: ss.CubicSpline(None, np.eye(3), S2, progress=progress),
        lambda progress: ss.fit_many([(None, np.eye(3))], S2, progress=progress),
        lambda progress: spline(0.5, progress=progress),
        lambda progress: ss.evaluate(None, np.eye(3), np.eye(3), S2, 0.5, progress=progress),
    ):
        with pytest.raises(Enough):
            call(stop)
        raises("progress must be a function", call, 3)


@pytest.mark.parametrize("nu", [0, 1])
@pytest.mark.parametrize("space, per_curve", [("sphere:2", False), ("sphere:2", True), ("sphere:2 x r:3", False)])
def test_progress_of_evaluation_counts_points(space, per_curve, nu):
    spline = pair_of_curves(ss.space(space))
    x = np.linspace(0, 2, 100).reshape((2, 50) if per_curve else 100)
    calls = []
    spline(x, nu, per_curve=per_curve, progress=lambda *call: calls.append(call))
    total = 2 * (50 if per_curve else 100) * (2 if "x" in space else 1)
    assert calls[-1] == (total, total) and calls == sorted(calls)
    calls.clear()
    arrays = (None, spline.points, spline.velocities, space, x)
    ss.evaluate(*arrays, nu=nu, per_curve=per_curve, progress=lambda *call: calls.append(call))
    assert calls[-1] == (total, total)

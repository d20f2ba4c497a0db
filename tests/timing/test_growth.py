"""The cost of long recordings is proportional to their length."""

import tracemalloc
from unittest import mock

import numpy as np

import symspline as ss


def recording(count):
    """A curve of many segments with gaps."""
    t = np.arange(3.0 * count) + np.repeat(np.arange(count), 3) * 5
    return ss.fit_segments(t, np.sin(t)[:, None] * [1.0, 2.0, 3.0], "r:3", max_gap=2)


def meeting(count):
    own = ss.CubicSpline(np.arange(3.0), np.eye(3), "r:3")
    return ss.SegmentedCurve([own.shift(2.0 * i) for i in range(count)])


def test_evaluation_needs_memory_in_proportion_to_the_times():
    def peak(count):
        curve = recording(count)
        x = np.linspace(*curve.domain, 20 * count)
        tracemalloc.start()
        curve(x)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    # A mask per segment would be 16 times as large.
    assert peak(800) < 6 * peak(200)


def test_values_are_those_of_the_segments():
    curve = recording(7)
    x = np.random.default_rng(0).permutation(np.linspace(*curve.domain, 500)).reshape(20, 25)
    wanted = np.full((20, 25, 3), np.nan)
    for own in curve:
        inside = (x >= own.t[0]) & (x <= own.t[-1])
        wanted[inside] = own(x[inside])
    assert np.array_equal(curve(x), wanted, equal_nan=True)
    # Batches with times of their own.
    both = ss.CubicSpline(np.arange(3.0), np.random.default_rng(1).standard_normal((2, 3, 1)), "r:1")
    curve = ss.SegmentedCurve([both, both.shift(5.0), both.shift(7.0)])
    x = np.array([[0.5, 6.0, 3.0, 8.5], [8.0, 1.0, 5.5, 0.0]])
    found = curve(x, per_curve=True)
    for i in range(2):
        single = ss.SegmentedCurve([own[i] for own in curve])
        assert np.array_equal(found[i], single(x[i]), equal_nan=True)


def test_every_segment_is_visited_a_fixed_number_of_times():
    """Extrema and crossings compare the values of both segments at each meeting only."""

    def domains(count):
        curve, calls = meeting(count), []
        own = type(curve[0]).domain
        with mock.patch.object(type(curve[0]), "domain", property(lambda self: calls.append(1) or own.fget(self))):
            curve.extrema()
            curve.solve("speed", 1.0)
        return len(calls)

    assert domains(80) < 2.5 * domains(40)

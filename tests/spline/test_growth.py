"""The cost of long recordings is proportional to their length."""

import tracemalloc
from unittest import mock

import numpy as np

import symspline as ss
from symspline._curves import composed


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


def test_no_times():
    for curve in (recording(2), meeting(2)):
        assert curve([]).shape == (0, 3) and curve.speed([]).shape == (0,)
        assert curve(np.zeros((2, 0))).shape == (2, 0, 3)
    batch = ss.CubicSpline(np.arange(3.0), np.zeros((2, 3, 1)), "r:1")
    assert ss.SegmentedCurve([batch, batch.shift(4.0)])([]).shape == (2, 0, 1)


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


def test_sections_are_evaluated_once():
    curve, calls = recording(30), []
    own = composed.Joined._in_section
    with mock.patch.object(
        composed.Joined, "_in_section", lambda self, *args: calls.append(args[0]) or own(self, *args)
    ):
        curve(np.random.default_rng(0).uniform(*curve.domain, 1000))
    assert len(calls) == len(set(calls)) == 30


def test_curves_that_are_joined_in_a_loop():
    # The velocity jumps between the parts, so that they are not merged. Nested parts would exceed the recursion limit.
    part = ss.CubicSpline([0.0, 1, 2], [[0.0], [1], [0]], "r:1")
    whole, count = part, 300
    for i in range(1, count):
        whole = whole.concatenate(part.shift(2.0 * i))
    assert len(whole) == count
    x = np.linspace(0, 2 * count, 1001)[:-1]
    np.testing.assert_allclose(whole(x), part(x % 2), atol=1e-12)
    assert whole == ss.SegmentedCurve([part, *(part.shift(2.0 * i) for i in range(1, count))])
    assert part.concatenate(part.shift(2.0).concatenate(part.shift(4.0))) == whole[:3]

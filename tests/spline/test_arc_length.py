"""Arc length as a function of time, and times at given arc lengths."""

from itertools import pairwise

import numpy as np
import pytest
from curves import KNOTS, every_batch, every_kind, points_on
from refused import raises
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

import symspline as ss

S2 = ss.Sphere(2)


def walk(rng, *batch, n=40, scale=0.2):
    """Points of irregular walks on the sphere."""
    steps = scale * rng.standard_normal((*batch, n, 3))
    return S2.project(np.array([3.0, 0, 0]) + np.cumsum(steps, axis=-2))


@every_kind
@every_batch
def test_times_at_arc_lengths_invert_the_arc_length(space, batch):
    curve = ss.CubicSpline(KNOTS, points_on(space, batch=batch, step=0.5), space)
    total = curve.length()
    s = np.linspace(0, total, 30, axis=-1)
    t = curve.at_length(s, per_curve=True)
    assert np.abs(curve.arc_length(t, per_curve=True) - s).max() <= 1e-12 * np.max(total)
    assert (np.diff(t, axis=-1) > 0).all() and t.shape == (*batch, 30)
    x = np.linspace(KNOTS[0], KNOTS[-1], 23)
    assert np.allclose(curve.at_length(curve.arc_length(x), per_curve=True), x, rtol=0, atol=1e-9)


def test_arc_length_is_the_integral_of_the_speed(rng):
    t = 1e3 + np.cumsum(rng.uniform(0.2, 2, 40))
    curve = ss.CubicSpline(t, walk(rng), S2)
    for end in (t[0], t[3] + 1e-4, t[20], t[-1]):
        steps = [*t[t < end], end]
        expected = sum(quad(curve.speed, a, b, epsabs=0, epsrel=1e-12)[0] for a, b in pairwise(steps))
        assert curve.arc_length(end) == pytest.approx(expected, rel=1e-11, abs=1e-300)
    # The length between two times is accurate relative to itself.
    a, b = t[-2] + 1e-7, t[-2] + 2e-7
    assert curve.length(a, b) == pytest.approx(quad(curve.speed, a, b, epsabs=0, epsrel=1e-13)[0], rel=1e-12)
    assert curve.length(t[3], t[30]) == pytest.approx(curve.arc_length(t[30]) - curve.arc_length(t[3]), rel=1e-13)
    assert curve.length(b=t[5]) + curve.length(t[5]) == pytest.approx(curve.length(), rel=1e-14)
    assert curve.length(t[7], t[7]) == 0


@pytest.mark.parametrize("scale", [1e-150, 1e-6, 1, 1e150])
def test_scales_of_time_and_space(scale):
    # x = t² stands still at the start, where the inverse has an infinite slope.
    curve = ss.HermiteSpline([0, scale], [[0.0], [scale]], [[0.0], [2.0]], "r:1")
    u = np.r_[0, 1e-3, 0.3, 1]
    assert curve.arc_length(u * scale) == pytest.approx(u**2 * scale, rel=1e-13)
    assert curve.at_length(u**2 * scale) == pytest.approx(u * scale, rel=1e-9)


def test_a_curve_that_rests_and_turns_back():
    curve = ss.HermiteSpline([0, 1, 2, 3], [[0.0], [1.0], [1.0], [0.0]], np.zeros((4, 1)), "r:1")
    assert curve.arc_length([1, 1.5, 2, 3]).tolist() == pytest.approx([1, 1, 1, 2], rel=1e-15)
    assert curve.at_length([0, 1, 2]) == pytest.approx([0, 1, 3])
    turning = ss.CubicSpline([0, 1, 2], [[0.0], [1.0], [0.0]], "r:1", bc_type=((1, [2.0]), (1, [-2.0])))
    s = np.linspace(0, turning.length(), 101)
    assert np.abs(turning.arc_length(turning.at_length(s)) - s).max() < 1e-14
    still = ss.CubicSpline(None, np.ones((3, 2)), "r:2")
    assert still.length(0, 1) == 0 and still.at_length(0) == 0


def test_lengths_of_curves_that_turn_are_total_variations(rng):
    curves = ss.CubicSpline(np.arange(12.0) + 3, rng.standard_normal((300, 12, 1)), "r:1")
    # On the two-sphere, along a great circle.
    angles = 0.3 * curves.points
    points = np.concatenate([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
    circles = ss.CubicSpline(np.arange(12.0) + 3, points, S2)
    for curve, lengths, circle in zip(curves, curves.length(), circles.length(), strict=True):
        flat = CubicSpline(curve.t, curve.points[:, 0], bc_type="natural")
        turns = np.sort(np.r_[curve.t, flat.derivative().roots(extrapolate=False)])
        exact = np.abs(np.diff(flat(turns))).sum()
        assert lengths == pytest.approx(exact, rel=1e-12)
        assert circle == pytest.approx(0.3 * exact, rel=1e-12)


@pytest.mark.parametrize(("origin", "unit"), [(0.1, 1.0), (1e6, 1e-3)])
def test_the_whole_length_is_an_arc_length(rng, origin, unit):
    # Rounding errors are large beside the steps between points, and between times.
    for _ in range(50):
        t = origin + unit * np.cumsum(rng.uniform(0.1, 2, 5))
        curve = ss.CubicSpline(t, 1 + 1e-6 * rng.standard_normal((5, 3)), "r:3")
        assert curve.at_length(curve.length()) == pytest.approx(t[-1], abs=1e-6 * (t[-1] - t[0]))
    raises("is not an arc length", curve.at_length, 1.001 * curve.length())


def test_dates_of_arc_lengths(rng):
    t = np.datetime64("2024-02-28T23:59", "s") + np.cumsum(rng.integers(1, 90, 40))
    points = walk(rng)
    seconds = (t - t[0]).astype(float)
    dated, plain = ss.CubicSpline(t, points, S2), ss.CubicSpline(seconds, points, S2)
    assert np.array_equal(dated.arc_length(t), plain.arc_length(seconds))
    assert dated.length(t[2], t[9]) == plain.length(seconds[2], seconds[9])
    s = np.linspace(0, dated.length(), 50)
    found = dated.at_length(s)
    assert found.dtype == "datetime64[ns]" and found[0] == t[0] and found[-1] == t[-1]
    assert np.abs((found - t[0]) / np.timedelta64(1, "s") - plain.at_length(s)).max() <= 1e-9
    # Years that nanoseconds do not reach.
    old = ss.CubicSpline(t - np.timedelta64(365 * 1000, "D"), points, S2)
    assert old.at_length(0) == old.t[0] and old.at_length(old.length()) == old.t[-1]
    assert old.at_length(0).dtype == "datetime64[us]"


def test_batches_with_their_own_times(rng):
    points = walk(rng, 2, 3)
    rows = np.cumsum(rng.uniform(0.1, 2, (2, 3, 40)), axis=-1)
    dates = np.datetime64("2020-01-01T00:00:00", "ms") + (1000 * rows).astype(int)
    for t in (rows, dates):
        curves = ss.CubicSpline(t, points, S2)
        total = curves.length()
        found = curves.at_length(total[..., None] / 2, per_curve=True)
        assert found.shape == (2, 3, 1)
        assert curves.arc_length(found, per_curve=True)[..., 0] == pytest.approx(total / 2, rel=1e-8)
        for i, j in np.ndindex(2, 3):
            alone = curves[i][j]
            off = np.abs(alone.at_length(alone.length() / 2) - found[i, j, 0])
            assert off <= (1e-9 if t is rows else np.timedelta64(1, "ns"))
            assert curves.length(t[..., 0].max(), t[..., -1].min()).shape == (2, 3)
    # The same arc length for all curves of a batch.
    assert curves.at_length([0.0, 0.1]).shape == (2, 3, 2)


def test_curves_that_failed_are_missing(rng):
    points = walk(rng, 3, n=5)
    curves = ss.CubicSpline(None, points, S2, where=[True, False, True])
    assert np.isnan(curves.at_length([0.0, 0.01])).tolist() == [[False] * 2, [True] * 2, [False] * 2]
    assert np.isnan(curves.arc_length(1.0)).tolist() == [False, True, False]
    dated = ss.CubicSpline(np.arange("2020-01-01", "2020-01-06", dtype="M8[D]"), points, S2, where=[True, False, True])
    assert np.isnat(dated.at_length(0.0)).tolist() == [False, True, False]


def test_curves_with_control_points_of_arc_lengths(rng):
    points = walk(rng, 2, n=6)
    for curve in (
        ss.BezierCurve(points, S2),
        ss.BSpline([0, 0, 0, 0, 1, 3, 4, 4, 4, 4], points, 3, S2),
        ss.BSpline([0, 0, 1, 2, 3, 4, 5, 5], points, 1, S2),
    ):
        s = np.linspace(0, curve.length(), 20, axis=-1)
        t = curve.at_length(s, per_curve=True)
        assert np.abs(curve.arc_length(t, per_curve=True) - s).max() < 1e-13
        assert np.allclose(curve[1].at_length(s[1]), t[1], atol=1e-12)


def test_empty_input(rng):
    curve = ss.CubicSpline(None, walk(rng, 2, n=5), S2)
    assert curve.at_length([]).shape == curve.arc_length([]).shape == (2, 0)
    none = curve[:0]
    assert none.length(0, 1).shape == (0,) and none.at_length([0.0]).shape == (0, 1) == none.arc_length([0.0]).shape


def test_invalid_input_of_arc_lengths_raises(rng):
    curve = ss.CubicSpline(None, walk(rng, 2, n=5), S2)
    one = curve[0]
    raises(r"s\[1\] = 99.0 is not an arc length of the curve: it must be between", one.at_length, [0.0, 99.0])
    for s in (-1.0, np.nan, np.inf):
        raises("is not an arc length", one.at_length, s)
    raises("s must be real numbers", one.at_length, [1j])
    raises(r"the shape of s must begin with the batch axes \(2,\)", curve.at_length, [0.0, 0.1, 0.2], per_curve=True)
    raises(r"the shape of x must begin with the batch axes \(2,\)", curve.arc_length, [0.0, 0.1, 0.2], per_curve=True)
    raises(r"x\[1\] = 4.5 is outside the domain \[0.0, 4.0\]", one.arc_length, [0, 4.5])
    raises(r"a = -1\.0 is outside the domain", one.length, -1)
    raises("b is before a", one.length, 2, 1)
    raises("do not broadcast", one.length, [0, 1], [1, 2, 3])
    raises("b must be numbers", one.length, b=np.datetime64("2020-01-01"))
    raises("outside the domain", ss.BezierCurve([[0.0], [1.0]], "r:1").length, b=2)

"""Times of knots: numbers, dates, integers beyond 2⁵³, and invalid times."""

from contextlib import suppress

import numpy as np
import pytest
from cases import EPS, loop_over
from compare import largest_difference, same
from curves import S2, THREE, points_on
from refused import INF, NAN, TWO, P, fit_error, raises

import symspline as ss

EPOCH = 1_700_000_000_000_000_000


@pytest.mark.parametrize("dtype", ["i1", "u4", "i8", "u8", ">i4", "f2", "f4", "f8", ">f8"])
def test_times_of_any_number_type(dtype):
    p = points_on(S2, 4)
    spline = ss.CubicSpline(np.array([0, 1, 3, 4], dtype), p, S2)
    assert spline.t.dtype == np.float64
    assert spline == ss.CubicSpline([0, 1, 3, 4], p, S2)
    assert same(spline(np.array([1, 4], dtype)), spline([1.0, 4.0]))


@pytest.mark.parametrize("dtype", ["i8", "u8"])
def test_epoch_nanoseconds_lose_nothing(dtype):
    p, small = points_on(S2, 4), np.array([0, 1, 3, 4])
    t = np.array(EPOCH + small, dtype)
    spline, reference = ss.CubicSpline(t, p, S2), ss.CubicSpline(small, p, S2)
    assert same(spline.velocities, reference.velocities)
    assert spline.t.dtype.kind in "iu" and np.array_equal(spline.t, t)
    assert same(spline(t), reference(small))
    assert same(spline(t[1], nu=1), reference(1, nu=1))


UNITS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "m": 60.0, "h": 3600.0, "D": 86400.0, "W": 604800.0}


@pytest.mark.parametrize("unit", UNITS)
def test_dates_give_rates_per_second(unit):
    p, ticks = points_on(S2, 4), np.array([0, 1, 3, 4])
    t = np.datetime64("2024-02-29", unit) + ticks.astype(f"m8[{unit}]")
    # Division by 10⁹ and multiplication with 10⁻⁹ differ in the last bit.
    reference = ss.CubicSpline(ticks * UNITS[unit], p, S2)
    spline = ss.CubicSpline(t, p, S2)
    assert spline.t.dtype == t.dtype and np.array_equal(spline.t, t)
    scale = np.abs(reference.velocities).max()
    assert largest_difference(spline.velocities, reference.velocities) < 1e-14 * scale
    assert largest_difference(spline(t), p) < 4 * EPS
    middle = t[0] + (t[-1] - t[0]) // 2
    speed = reference.speed(2 * UNITS[unit])
    assert spline.speed(middle) == pytest.approx(speed, rel=1e-13)


def test_units_of_dates_may_differ():
    t = np.array(["2024-01-01", "2024-01-02", "2024-01-04", "2024-01-05"], "M8[D]")
    spline = ss.CubicSpline(t, points_on(S2, 4), S2)
    flat = ss.CubicSpline([0, 1, 3, 4], points_on(S2, 4), S2)
    for x, day in [("2024-01-01T12", 0.5), ("2024-01-02T06:00:00.000000000", 1.25), ("2024-01-03", 2)]:
        assert largest_difference(spline(np.datetime64(x)), flat(day)) < 4 * EPS
    assert spline([np.datetime64("2024-01-03"), np.datetime64("2024-01-02T01")]).shape == (2, 3)
    # Months and years become days.
    spline = ss.CubicSpline(np.array(["2024-01", "2024-02", "2024-04"], "M8[M]"), THREE, S2)
    assert np.array_equal(spline.t, np.array(["2024-01-01", "2024-02-01", "2024-04-01"], "M8[D]"))
    # Nanoseconds cannot count a thousand years.
    far = np.array(["1500-01-01", "1500-01-02", "2500-01-04"], "M8[D]")
    spline = ss.CubicSpline(far, [[0.0], [1.0], [2.0]], "r:1")
    assert same(spline(np.datetime64("2000-01-01", "ns")), spline(np.datetime64("2000-01-01", "D")))


def test_invalid_times_of_knots_raise():
    for t, match in [
        ([], r"t is empty; a curve needs at least two points"),
        ([0, 1], r"t has shape \(2,\), but 3 points per curve need \(3,\)"),
        (5.0, r"t has shape \(\), but 3 points"),
        ([[0, 1, 2]], r"t has shape \(1, 3\), but 3 points"),
        ([0, NAN, 2], r"t\[1\] is NaN; times must be finite"),
        ([0, 1, INF], r"t\[2\] is inf; times must be finite"),
        ([-INF, 1, 2], r"t\[0\] is -inf; times must be finite"),
        ([0, 2, 1], r"t\[2\] = 1 is before t\[1\] = 2.*np\.argsort\(t\)"),
        ([0, 1, 1], r"t\[2\] = 1 repeats t\[1\] = 1.*different times"),
        ([0, -0.0, 1], r"t\[1\] = -?0 repeats t\[0\] = 0"),
        (["a", "b", "c"], r"t\[0\] is 'a', not a date such as 2021-08-29"),
        ([0, 1j, 2], r"t must be numbers or datetime64, not complex128"),
        ([0, None, 2], r"t\[1\] must be an array of numbers, not of object: it is a NoneType; leave it out"),
        (np.array([0, "NaT", 2], "m8[s]"), r"t\[1\] is NaT"),
        (np.array(["2024-01-01", "NaT", "2024-01-03"], "M8[D]"), r"t\[1\] is NaT"),
        (np.array(["2024-01-01", "2024-01-03", "2024-01-02"], "M8[D]"), r"t\[2\] .*is before t\[1\]"),
        ([-1e308, 0, 1e308], r"t spans more than the largest floating-point number"),
    ]:
        fit_error(match, t)


def test_error_names_the_curve_of_an_invalid_time():
    fit_error(r"t\[1\]\[2\] = 1 is before t\[1\]\[1\] = 2", [[0, 1, 2], [0, 2, 1]], TWO)
    fit_error(r"t has shape \(3, 3\), but 3 points per curve need \(3,\) or \(2, 3\)", np.ones((3, 3)), TWO)
    raises(r"curve 1: t has shape \(2,\), but 3 points", ss.fit_many, [(None, P), ([0, 1], P)], S2)
    raises(r"t\[1\]\[2\] = 1 is before", ss.fit_many, [(None, P), ([0, 2, 1], P)], S2)


UP = np.arange(12.0)
BAD_KNOTS = [np.roll(UP, 5), UP[::-1], 0 * UP, NAN * UP, np.r_[UP[1:], INF]]


@loop_over("t", BAD_KNOTS)
@loop_over("policy", [None, True, "geodesic", "periodic"])
def test_knots_that_are_not_checked_never_panic(t, policy):
    p, x = np.repeat(np.eye(3), 4, axis=0), np.linspace(-1, 13, 40)
    for nu in range(3):
        with suppress(ss.ValidationError):
            ss.CubicSpline(t, p, S2, check=False, on_failure="ignore")(x, nu, extrapolate=policy)
        with pytest.raises(ss.ValidationError):
            ss.evaluate(t, p, 0 * p, S2, x, nu=nu, extrapolate=policy)


def recording(close, start=0.0):
    """Points along an equator, 0.1 apart with noise of 0.01, every quarter of a second but for two of them."""
    rng = np.random.default_rng(0)
    t = np.linspace(0, 10, 40)
    t = np.sort(np.append(t, t[20] + close)) + start
    angle = 0.1 * np.arange(41)
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1) + 0.01 * rng.standard_normal((41, 3))
    return t, ss.Sphere(2).project(points)


@loop_over("close", [1e-3, 1e-9])
def test_the_two_times_are_named(close):
    t, points = recording(close)
    with pytest.raises(ss.ConvergenceError) as caught:
        ss.CubicSpline(t, points, "sphere:2")
    message = str(caught.value)
    assert f"t[20] = {t[20]} and t[21] = {t[21]} are too close for the distance 0.0958 " in message
    assert "merge the two samples, smooth the data with make_smoothing_spline, or correct the times" in message
    assert "long" not in message.partition("t[20]")[2]
    assert caught.value.node == 20


@loop_over("space", ["sphere:2", "so:3", "se:3", "so:3 x r:3"])
def test_a_gap_in_which_the_curve_would_go_far_away_is_named(space):
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(0, 100, 100))
    t[50:] += 1000
    turns = np.cumsum(0.05 * rng.standard_normal((100, 3)), axis=0)
    rotations, positions = ss.rotations.from_rotation_vectors(turns), np.cumsum(rng.standard_normal((100, 3)), axis=0)
    points = {
        "sphere:2": rotations[:, :, 0],
        "so:3": rotations,
        "se:3": np.block([[rotations, positions[..., None]], [np.zeros((100, 1, 3)), np.ones((100, 1, 1))]]),
        "so:3 x r:3": (rotations, positions),
    }[space]
    with pytest.raises(ss.ConvergenceError) as caught:
        ss.CubicSpline(t, points, space)
    assert caught.value.node == 49
    assert f"no data between t[49] = {t[49]} and t[50] = {t[50]}, a gap of " in str(caught.value)
    assert "cut it there (fit_segments), or smooth noisy data (make_smoothing_spline)" in str(caught.value)
    # The advice works.
    assert len(ss.fit_segments(t, points, space, max_gap=100)) == 2


def test_times_too_close_are_named_in_batches_lists_products_and_dates():
    t, points = recording(1e-6)
    good = np.linspace(0, 10, 41)
    dates = np.datetime64("2024-01-01", "ns") + np.rint(1e9 * t).astype("m8[ns]")
    for fit, match in (
        (lambda: ss.CubicSpline([good, t], [points, points], S2), r"of curve 1.*; t\[20\] = 5\.12\d+ and t\[21\] = "),
        (lambda: ss.fit_many([(good, points), (t, points)], S2), r"of curve 1.*; t\[20\] = 5\.12\d+ and t\[21\] = "),
        (lambda: ss.CubicSpline(t, (points, t[:, None]), "sphere:2 x r:1"), r"t\[20\] = 5\.12\d+ and t\[21\] = "),
        (lambda: ss.CubicSpline(dates, points, S2), r"t\[20\] = 2024-01-01T00:00:05\.12\d+ and t\[21\] = 2024"),
    ):
        raises(match, fit, error=ss.ConvergenceError)


def intervals(count=2000):
    """Ends of intervals of any length and place, and the last time that a user computes for each."""
    rng = np.random.default_rng(0)
    scale = 10.0 ** rng.integers(-3, 10, count)
    start, end = np.sort(rng.standard_normal((2, count)), axis=0) * scale
    last = np.array([(a + (b - a) * np.linspace(0, 1, 7))[-1] for a, b in zip(start, end, strict=True)])
    return start, end, last


START, END, LAST = intervals()
BEYOND = np.flatnonzero(LAST > END)
UNIT = np.spacing(np.maximum(abs(START), abs(END)))
FRAME = np.eye(4, 2)


def knots(i):
    return np.array([START[i], 0.5 * (START[i] + END[i]), END[i]])


def middle(i):
    return knots(i)[1]


def curve(i, points=THREE, space=S2):
    return ss.CubicSpline(knots(i), points, space)


QUBIT = [[1, 0], [0.8, 0.6j], [0.6, 0.8]]

LOOKUPS = {
    "call": lambda i, x: curve(i)(x),
    "call with one time": lambda i, x: curve(i)(float(x)),
    "transport": lambda i, x: curve(i).transport(middle(i), x, curve(i)(middle(i), nu=1)),
    "jvp": lambda i, x: curve(i).jvp(x, points=np.zeros((3, 3))),
    "evaluate": lambda i, x: ss.evaluate(knots(i), THREE, np.zeros((3, 3)), S2, x),
    "BSpline": lambda i, x: ss.BSpline(np.repeat([START[i], END[i]], 3), THREE, 2, S2)(x),
    "Stiefel": lambda i, x: curve(i, [FRAME] * 3, ss.Stiefel(2, 4))(x),
    "propagator": lambda i, x: ss.quantum.propagator(curve(i, QUBIT, "cp:1"), x),
    "pulses": lambda i, x: ss.quantum.pulses(curve(i, QUBIT, "cp:1"), np.sort([middle(i), x])),
}


# Where one curve takes a millisecond or more, fewer of the intervals are tried.
SLOW = {"jvp", "Stiefel", "propagator", "pulses"}


@pytest.mark.parametrize("name", LOOKUPS)
def test_times_that_exceed_a_knot_by_rounding_are_that_knot(name):
    look = LOOKUPS[name]
    for i in BEYOND[: 5 if name in SLOW else 40]:
        assert np.array_equal(look(i, LAST[i]), look(i, END[i])), (START[i], END[i])
    for i in BEYOND[:5]:
        assert np.array_equal(look(i, START[i] - 2 * UNIT[i]), look(i, START[i]))
        for x in (START[i] - 10 * UNIT[i], END[i] + 10 * UNIT[i]):
            raises(r"outside|must be between", look, i, x)


def test_rounding_beyond_knots_of_their_own():
    some = BEYOND[:8]
    splines = ss.CubicSpline([knots(i) for i in some], [THREE] * 8, S2)
    x = np.stack([END[some], LAST[some]], axis=-1)
    for values in (splines(x, per_curve=True), splines(x, nu=1, per_curve=True)):
        assert np.array_equal(values[:, 0], values[:, 1])
    # One time for curves of which only the first ends there.
    ends, late = ss.CubicSpline([[0, 0.1, 0.3], [0, 1, 2]], [THREE, THREE], S2), 0.1 + 0.2
    assert np.array_equal(ends(late), [ends[0](0.3), ends[1](late)])
    assert np.array_equal(ends.jvp(late, np.zeros((2, 3, 3))), np.zeros((2, 3)))
    v = ends(0, nu=1)
    assert np.array_equal(
        ends.transport(0, late, v), [ends[0].transport(0, 0.3, v[0]), ends[1].transport(0, late, v[1])]
    )


def test_times_in_single_precision_have_its_rounding():
    spline = ss.CubicSpline([0, 0.1, 0.3], THREE, S2)
    x = np.linspace(0, 0.3, 5, dtype=np.float32)
    assert float(x[-1]) > 0.3 + 1e-9
    assert np.array_equal(spline(x)[-1], spline(0.3))
    raises("outside", spline, np.float32(0.3) + np.float32(1e-6))


def test_other_times_beyond_the_last_knot():
    # Dates are exact.
    t = np.array(["2024-01-01", "2024-01-02", "2024-01-03"], "M8[ns]")
    raises("outside", ss.CubicSpline(t, THREE, S2), t[-1] + np.timedelta64(1, "ns"))
    # A Bézier curve ends at 1.
    curve = ss.BezierCurve(THREE, S2)
    assert np.array_equal(curve(1 + 2**-52), curve(1.0))
    raises("outside", curve, 1 + 10 * 2**-52)


def test_a_batch_without_curves_has_checked_knots():
    for knots in ([0, 1, 1], [0, np.nan, 1]):
        for call in (ss.CubicSpline, ss.PiecewiseGeodesic, ss.fit):
            raises(r"t\[[12]\]", call, knots, np.zeros((0, 3, 3)), "sphere:2")
        empty = np.zeros((0, 3, 3))
        raises(r"t\[[12]\]", ss.HermiteSpline, knots, empty, empty, "sphere:2")

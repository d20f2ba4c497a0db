"""Times of knots: numbers, dates, whole numbers too large for doubles; and bad ones."""

import numpy as np
import pytest
from cases import COMMON, EPS
from curves import KNOTS, S2, THREE, largest_difference, points_on, run_python, same
from refused import INF, NAN, TWO, P, fit_error

import symspline as ss

EPOCH = 1_700_000_000_000_000_000


def test_t_none_counts_from_zero():
    p = points_on(S2, 5)
    spline = ss.CubicSpline(None, p, S2)
    assert same(spline.t, np.arange(5.0))
    assert spline == ss.CubicSpline(np.arange(5.0), p, S2)


def test_one_row_of_times_serves_all_curves():
    p = points_on(S2, 6, (2, 3))
    spline = ss.CubicSpline(KNOTS, p, S2)
    assert spline.t.shape == (6,)
    for i in np.ndindex(2, 3):
        assert same(spline.velocities[i], ss.CubicSpline(KNOTS, p[i], S2).velocities)


def test_every_curve_may_have_its_own_times():
    p = points_on(S2, 5, (2, 3))
    t = np.cumsum(np.random.default_rng(0).uniform(0.5, 2, (2, 3, 5)), axis=-1)
    spline = ss.CubicSpline(t, p, S2)
    assert same(spline.t, t)
    for i in np.ndindex(2, 3):
        assert same(spline.velocities[i], ss.CubicSpline(t[i], p[i], S2).velocities)


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


@pytest.mark.parametrize("kind", ["int", "date"])
def test_epoch_nanoseconds_lose_nothing_in_every_row(kind):
    p, small = points_on(S2, 4, (2,)), np.array([0, 1, 3, 4])
    t = np.stack([small, EPOCH + small])
    if kind == "date":
        t = t.astype("M8[ns]")
    reference = ss.CubicSpline(small * (1e-9 if kind == "date" else 1), p, S2)
    spline = ss.CubicSpline(t, p, S2)
    assert np.array_equal(spline.t, t)
    assert (
        largest_difference(
            spline.velocities / reference.velocities.max(), reference.velocities / reference.velocities.max()
        )
        < 1e-14
    )


def test_unsigned_times_are_shown_as_given():
    t = np.array([2**63 + 1, 2**63 + 2, 2**63 + 4], np.uint64)
    assert ss.CubicSpline(t, THREE, S2).t.tolist() == t.tolist()


# ---- dates ----


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


def test_dates_are_evaluated_at_finer_and_coarser_dates():
    t = np.array(["2024-01-01", "2024-01-02", "2024-01-04", "2024-01-05"], "M8[D]")
    spline = ss.CubicSpline(t, points_on(S2, 4), S2)
    flat = ss.CubicSpline([0, 1, 3, 4], points_on(S2, 4), S2)
    for x, day in [("2024-01-01T12", 0.5), ("2024-01-02T06:00:00.000000000", 1.25), ("2024-01-03", 2)]:
        assert largest_difference(spline(np.datetime64(x)), flat(day)) < 4 * EPS
    assert spline([np.datetime64("2024-01-03"), np.datetime64("2024-01-02T01")]).shape == (2, 3)


def test_months_and_years_become_days():
    spline = ss.CubicSpline(np.array(["2024-01", "2024-02", "2024-04"], "M8[M]"), THREE, S2)
    assert np.array_equal(spline.t, np.array(["2024-01-01", "2024-02-01", "2024-04-01"], "M8[D]"))


def test_dates_in_different_units_far_apart():
    t = np.array(["1500-01-01", "1500-01-02", "2500-01-04"], "M8[D]")
    spline = ss.CubicSpline(t, [[0.0], [1.0], [2.0]], "r:1")
    assert same(spline(np.datetime64("2000-01-01", "ns")), spline(np.datetime64("2000-01-01", "D")))


# ---- units ----


@pytest.mark.parametrize("space", COMMON[:3], ids=str)
@pytest.mark.parametrize("h", [1e-9, 1e-3, 1e3, 1e12])
def test_the_unit_of_time_does_not_matter(space, h):
    p, t = points_on(space, 6), np.array([0.0, 1, 1.5, 3, 4, 4.5])
    spline, scaled = ss.CubicSpline(t, p, space), ss.CubicSpline(h * t, p, space)
    x = np.linspace(0, 4.5, 20)
    scale = np.abs(spline.velocities).max()
    assert largest_difference(scaled.velocities * h, spline.velocities) < 1e-12 * scale
    assert largest_difference(scaled(h * x), spline(x)) < 1e-12


# ---- bad times ----


@pytest.mark.parametrize(
    "t, match",
    [
        ([], r"t is empty; a curve needs at least two points"),
        ([0, 1], r"t has shape \(2,\), but 3 points a curve need \(3,\)"),
        (5.0, r"t has shape \(\), but 3 points"),
        ([[0, 1, 2]], r"t has shape \(1, 3\), but 3 points"),
        ([0, NAN, 2], r"t\[1\] is NaN; times must be finite"),
        ([0, 1, INF], r"t\[2\] is inf; times must be finite"),
        ([-INF, 1, 2], r"t\[0\] is -inf; times must be finite"),
        ([0, 2, 1], r"t\[2\] = 1 is before t\[1\] = 2.*np\.argsort\(t\)"),
        ([0, 1, 1], r"t\[2\] = 1 repeats t\[1\] = 1.*different times"),
        ([0, -0.0, 1], r"t\[1\] = -?0 repeats t\[0\] = 0"),
        (["a", "b", "c"], r"t\[0\] is 'a', no date such as 2021-08-29"),
        ([0, 1j, 2], r"t must be numbers or datetime64, not complex128"),
        ([0, None, 2], r"t\[1\] must be an array of numbers, not of object: it is a NoneType; leave it out"),
        (np.array([0, "NaT", 2], "m8[s]"), r"t\[1\] is NaT"),
        (np.array(["2024-01-01", "NaT", "2024-01-03"], "M8[D]"), r"t\[1\] is NaT"),
        (np.array(["2024-01-01", "2024-01-03", "2024-01-02"], "M8[D]"), r"t\[2\] .*is before t\[1\]"),
        ([-1e308, 0, 1e308], r"t spans more than a double can hold"),
    ],
    ids=str,
)
def test_bad_times(t, match):
    fit_error(match, t)


def test_the_bad_time_of_a_batch_is_named():
    fit_error(r"t\[1\]\[2\] = 1 is before t\[1\]\[1\] = 2", [[0, 1, 2], [0, 2, 1]], TWO)
    fit_error(r"t has shape \(3, 3\), but 3 points a curve need \(3,\) or \(2, 3\)", np.ones((3, 3)), TWO)
    with pytest.raises(ss.ValidationError, match=r"curve 1: t has shape \(2,\), but 3 points"):
        ss.fit_many([(None, P), ([0, 1], P)], S2)
    with pytest.raises(ss.ValidationError, match=r"t\[1\]\[2\] = 1 is before"):
        ss.fit_many([(None, P), ([0, 2, 1], P)], S2)


def test_times_in_messages_are_those_that_were_given():
    with pytest.raises(ss.ValidationError, match=r"t\[2\] = 6 repeats") as caught:
        ss.CubicSpline([5, 6, 6], P, S2)
    assert "counted from" not in str(caught.value)


BAD_KNOTS = """
import itertools, sys, numpy as np, symspline as ss
p = np.repeat(np.eye(3), 4, axis=0)
rng = np.random.default_rng(0)
up = np.arange(12.0)
knots = [rng.permutation(up), up[::-1], 0 * up, np.nan * up, np.r_[up[1:], np.inf]]
for t, nu, extrapolate in itertools.product(knots, range(3), (None, True, "geodesic", "periodic")):
    for size in (1, 40):
        x = rng.uniform(-1, 13, size)
        try:
            if sys.argv[1] == "evaluate":
                ss.evaluate(x, t, p, 0 * p, "sphere:2", nu, extrapolate=extrapolate)
            else:
                ss.CubicSpline(t, p, "sphere:2", check=False, on_failure="ignore")(x, nu, extrapolate=extrapolate)
        except ss.ValidationError:
            pass
"""


@pytest.mark.parametrize("how", ["evaluate", "check=False"])
def test_bad_knots_never_panic(how):
    run_python(BAD_KNOTS, how, RUST_BACKTRACE="0")

"""Times in tables, and sampling times along a curve."""

import os
from fractions import Fraction

import numpy as np
import pytest
from tabular import table, write

import symspline as ss


def dated(cells):
    write("a.csv", "time,x\n" + "".join(f"{cell},{i}\n" for i, cell in enumerate(cells)))


def test_dates_of_tables(run):
    for cells, t in [
        (["2020-01-01", "2020-02-29"], ["2020-01-01", "2020-02-29"]),
        (["2020-01-01 12:00", "2020-02-29T06:30"], ["2020-01-01T12:00", "2020-02-29T06:30"]),
        (["2020-01-01", "2020-01-02T00:30"], ["2020-01-01T00:00", "2020-01-02T00:30"]),
        (["2020-01-01T12:00:00", "2020-01-01T12:00:00.25"], ["2020-01-01T12:00:00", "2020-01-01T12:00:00.25"]),
        (["2020-01-01T12:00Z", "2020-01-01T12:30+00:00"], ["2020-01-01T12:00", "2020-01-01T12:30"]),
        (["2019-12-31T23:00-0300", "2020-01-01T05:00+02:30"], ["2020-01-01T02:00", "2020-01-01T02:30"]),
        (["2020-01-01 00:00:00.5 +01", "2020-01-01 00:00:01 Z"], ["2019-12-31T23:00:00.5", "2020-01-01T00:00:01"]),
    ]:
        dated(cells)
        run("fit a.csv --space r:1 -o a.npz")
        np.testing.assert_array_equal(ss.load("a.npz").t, np.array(t, "datetime64[ms]"))


def test_invalid_times(fails):
    for cells, found in [
        (
            ["2020-01-01T00:00Z", "2020-01-02T00:00"],
            "line 3: column 'time' holds '2020-01-02T00:00', but '2020-",
        ),
        (["2020-01-01", "2020-01-02", "7"], "line 4: column 'time' holds '7', not a time: write 0.5, 2021-08-29 or"),
        (["7", "2020-01-02"], "line 3: column 'time' holds '2020-01-02', which is not a number"),
        (["2020-01-01", "soon"], "line 3: column 'time' holds 'soon', not a time: write 0.5, 2021-08-29 or"),
        (["29.8.2021", "30.8.2021"], "line 2: column 'time' holds '29.8.2021', not a time"),
        (["2020-01-01", "2020-02-30"], "line 3: column 'time' holds '2020-02-30', which is not a date"),
        (["2020-01-01", ""], "line 3: column 'time' is empty"),
        (["1", "nan"], "line 3: column 'time' is empty or NaN"),
        (["2020-01-02", "2020-01-01"], "line 3: time 2020-01-01 does not come after 2020-01-02 in line 2"),
        (["1", "1"], "line 3: time 1.0 does not come after 1.0 in line 2; times must increase"),
    ]:
        dated(cells)
        problem = fails("fit a.csv --space r:1 -o a.npz")
        assert problem.startswith("a.csv, line ") and found in problem


def test_large_whole_times_are_exact(run):
    start = 1_630_000_000_000_000_001
    dated([start, start + 1, start + 3])
    run("fit a.csv --space r:1 -o a.npz")
    assert ss.load("a.npz").t.tolist() == [start, start + 1, start + 3]
    run("sample a.npz --every 1 -o b.csv")
    assert table("b.csv")["time"] == [str(start + i) for i in range(4)]
    run("sample a.npz -n 2 -o b.csv")
    assert table("b.csv")["time"] == [str(start), str(start + 3)]


def curve(knots):
    """A curve with these knots, in a.npz."""
    ss.CubicSpline(knots, np.zeros((len(knots), 1)), "r:1").save("a.npz")


@pytest.fixture
def along(run):
    """The times of samples of a curve with given knots."""

    def along(option, knots):
        curve(knots)
        run(f"sample a.npz {option} -o b.npz")
        return np.load("b.npz")["time"]

    return along


def test_times_along_a_curve(along):
    day = np.array(["2020-01-01", "2020-01-02"], "datetime64[D]")
    assert len(along("--every 10min", day)) == 145
    assert along("--every 6H", day)[-1] == day[-1]
    assert along("--every 7h", day).tolist() == along("--every 25200", day).tolist()
    # 438 291 hours since 1970 are a multiple of seven.
    sevenths = np.arange("2020-01-01T03:00", "2020-01-02T00:01", 420, dtype="M8[m]")
    assert along("--every 7h", day).astype("M8[m]").tolist() == sevenths.tolist()
    half = along("--every 0.5s", np.array(["2020-01-01T00:00:00", "2020-01-01T00:00:01"], "datetime64[s]"))
    assert half.astype(str).tolist()[1] == "2020-01-01T00:00:00.500"
    # The even days since 1970.
    assert along("--every 2d", day).tolist() == [day[0].astype("datetime64[s]").item()]
    np.testing.assert_array_equal(along("--every 0.1", np.array([0.0, 1.0])), np.arange(11) / 10)
    assert along("--every 0.3", np.array([0.0, 1.0]))[-1] == 0.9
    # The last sample is at the end if the step divides the curve up to rounding.
    for end, step in ((0.3, 0.1), (0.7, 0.1), (1.1, 0.1), (2.1, 0.7), (0.7999999999999999, 0.1)):
        times = along(f"--every {step}", np.array([0.0, 0.1, end]))
        assert times[-1] == end and len(times) == round(end / step) + 1
    assert along("-n 3", day).astype(str).tolist()[1] == "2020-01-01T12:00:00"
    thirds = along("-n 4", np.array(["2020-01-01T00:00:00", "2020-01-01T00:00:01"], "datetime64[s]"))
    assert thirds.astype(str).tolist()[1] == "2020-01-01T00:00:00.333333"
    for fine in ("ns", "ps"):
        knots = np.array([0, 10**18 + 1], f"datetime64[{fine}]")
        spread = along("-n 1000", knots)
        assert spread[0] == knots[0] and spread[-1] == knots[-1] and (np.diff(spread) > np.timedelta64(0)).all()


def test_times_have_no_rounding_errors(along):
    """Each is the number that is nearest to its exact value, so that its text is short."""
    knots = np.array([17.0, 19.0])
    for option, times in [
        ("--every 0.1", [f"{17 + i // 10}.{i % 10}" for i in range(21)]),
        ("--every 0.25", [f"{17 + i * 0.25}" for i in range(9)]),
        ("-n 11", [f"{17 + i // 5}.{i % 5 * 2}" for i in range(11)]),
    ]:
        assert along(option, knots).tolist() == list(map(float, times))
    for knots, option in [
        (np.array([1305031102.1758, 1305031110.25]), "--every 0.0333"),
        (np.array([0.1234567890123, 0.7]), "-n 1001"),
        (np.array([-1e-30, 3e5]), "-n 7"),
    ]:
        found = along(option, knots)
        first, last = (Fraction(repr(float(knot))) for knot in knots)
        step = (last - first) / (len(found) - 1) if option[1] == "n" else Fraction(option.split()[1])
        assert found.tolist() == [float(first + i * step) for i in range(len(found))]
        assert found[0] == knots[0] and found[-1] <= knots[-1]


DAY = np.array(["2020-01-01", "2020-01-02"], "datetime64[D]")
NUMBERS, WHOLE = np.array([0.0, 1, 3]), np.array([2**60, 2**60 + 5])
FAR = np.array(["300000-01-01", "300000-01-03"], "datetime64[D]")
FINE, LONG = np.array([1, 2], "datetime64[as]"), np.array([-(2**62) - 1, 2**62 + 1], "datetime64[s]")


@pytest.mark.parametrize(("unit", "scale"), [("ns", 10**9), ("us", 10**6), ("ms", 10**3), ("s", 1)])
def test_numbers_since_1970(unit, scale, run, fails):
    start = 1_717_200_000
    write("a.csv", "stamp,x\n" + "".join(f"{(start + i) * scale},{i * i}\n" for i in range(4)))
    advice = f"--time stamp, with --unix if it counts from 1970, or --time {'none'}"
    assert advice in fails("fit a.csv --space r:1 -o a.npz")
    run(f"fit a.csv --space r:1 --time stamp --unix {unit} -o a.npz")
    spline = ss.load("a.npz")
    assert spline.t[0] == np.datetime64("2024-06-01T00:00:00")
    assert (np.diff(spline.t) == np.timedelta64(1, "s")).all()
    problem = fails("sample a.npz --at a.csv -o b.csv")
    assert problem.endswith("are dates, but these are numbers; give --unix if they count from 1970")
    run(f"sample a.npz --at a.csv --unix {unit} -o b.csv")
    assert table("b.csv")["x"] == ["0.0", "1.0", "4.0", "9.0"]
    assert table("b.csv")["stamp"][1] == "2024-06-01T00:00:01.000000000Z"
    write("c.csv", "t,x\n2020-01-01,0\n2020-01-02,1\n")
    assert fails(f"fit c.csv --space r:1 --unix {unit} -o c.npz") == (
        "--unix is for times that are numbers; column 't' has dates"
    )


def test_seconds_and_nanoseconds_in_two_columns(run, fails):
    write("a.csv", "sec,nsec,x\n1717200000,1,0\n1717200000,500000000,1\n1717200001,7,2\n")
    problem = fails("fit a.csv --space r:1 --columns x -o a.npz")
    assert "say --time sec,nsec, which adds seconds and nanoseconds since 1970, or --time none" in problem
    run("fit a.csv --space r:1 --time sec,nsec -o a.npz")
    expected = np.array([1717200000 * 10**9 + 1, 1717200000 * 10**9 + 5 * 10**8, 1717200001 * 10**9 + 7])
    np.testing.assert_array_equal(ss.load("a.npz").t.astype("datetime64[ns]").astype(np.int64), expected)
    run("sample a.npz --at a.csv --time sec,nsec -o b.csv")
    assert table("b.csv")["time"][2] == "2024-06-01T00:00:01.000000007Z"
    write("c.csv", "sec,nsec,x\n0,0,1\n1,,2\n2,5,3\n")
    assert "line 3: column 'nsec' is empty or NaN; symspline fit --skipna" in fails(
        "fit c.csv --space r:1 --time sec,nsec -o c.npz"
    )
    assert "1 row without a point or a time omitted" in run("fit c.csv --space r:1 --time sec,nsec --skipna -o c.npz")
    os.remove("c.npz")
    for sec, nsec in (("1e12", "3"), ("1.5", "3"), ("1", "0.5")):
        write("c.csv", f"sec,nsec,x\n0,0,0\n{sec},{nsec},1\n")
        problem = fails("fit c.csv --space r:1 --time sec,nsec -o c.npz")
        assert problem.startswith("c.csv, line 3: --time sec,nsec: the columns hold ")
        assert problem.endswith(", which are not whole seconds since 1970 and nanoseconds")
    np.testing.assert_allclose(np.array(table("b.csv")["x"], float), [0, 1, 2], atol=1e-12)


def test_fractions_of_a_second_since_1970(run, fails):
    write("a.csv", "t,x\n1717200000.25,0\n1717200001.5,1\n")
    run("fit a.csv --space r:1 --unix s -o a.npz")
    expected = np.array(["2024-06-01T00:00:00.25", "2024-06-01T00:00:01.5"], "datetime64[ns]")
    np.testing.assert_array_equal(ss.load("a.npz").t, expected)
    # Text is exact, and floating-point numbers have no digits beyond their precision.
    write("a.csv", "t,x\n1717200000.000000001,0\n1717200000.3,1\n")
    run("fit a.csv --space r:1 --unix s -o a.npz")
    expected = np.array(["2024-06-01T00:00:00.000000001", "2024-06-01T00:00:00.3"], "datetime64[ns]")
    np.testing.assert_array_equal(ss.load("a.npz").t, expected)
    np.savez("b.npz", t=np.array([1717200000.1, 1717200000.3]), x=np.array([0.0, 1]))
    run("fit b.npz --space r:1 --unix s -o a.npz")
    expected = np.array(["2024-06-01T00:00:00.1", "2024-06-01T00:00:00.3"], "datetime64[ns]")
    np.testing.assert_array_equal(ss.load("a.npz").t, expected)
    write("a.csv", "t,x\n1e12,0\n2e12,1\n")
    assert "is too far from 1970" in fails("fit a.csv --space r:1 --unix s -o b.npz")


def test_invalid_steps(fails):
    for knots, option, found in [
        (DAY, "--every=0", "larger than zero"),
        (DAY, "--every=-1", "a duration is a number"),
        (DAY, "--every=1y", "units are ns, us, ms, s, min, h, d"),
        (DAY, "--every=0.5ns", "whole number of nanoseconds"),
        (DAY, "--every=1ns", "samples of one curve"),
        (DAY, "--every=1e30d", "no multiple of this step lies between the start and the end of the curve"),
        (DAY, "--every=1e401", "too long"),
        (DAY, "--every=1e-999999999", "too short"),
        (DAY, "--every=1e99999999999999999999", "exponent is too large"),
        (NUMBERS, "--every 10min", "give a step without a unit"),
        (NUMBERS, "--every 1e-300", "samples of one curve"),
        (NUMBERS, "-n 0", "-n: 0: the number of samples"),
        (NUMBERS, "--every 1e350", "too long"),
        (NUMBERS, "--every 1e-350", "too short"),
        (WHOLE, "--every 0.5", "a step must be a whole number"),
        (FAR, "--every 1ns", "cannot be counted"),
        (FINE, "--every 1s", "cannot be counted"),
        (LONG, "--every 1s", "samples"),
        (LONG, "-n 3", "cannot be counted in units of 1 microseconds"),
        (FAR + np.timedelta64(10**9), "-n 3", "cannot be counted in units of 1 microseconds"),
    ]:
        curve(knots)
        assert found in fails(f"sample a.npz {option} -o b.npz")


def test_steps_of_large_whole_numbers(along):
    for start, kind in [(2**60, ">i8"), (2**62, "<i8"), (-(2**63), "<i8"), (2**64 - 9, "<u8")]:
        knots = np.array([start, start + 5, start + 8], kind)
        assert along("--every 3", knots).tolist() == [start, start + 3, start + 6]
        assert along("--every 99999999999999999999", knots).tolist() == [start]
        assert along("-n 3", knots).tolist() == [start, start + 4, start + 8]


def test_dates_are_aligned_as_those_of_resample(along):
    """Whole multiples in UTC, before and after 1970, whatever the unit of the knots."""
    pd = pytest.importorskip("pandas")
    table = pd.DataFrame({"lon": [0.0, 1, 2], "lat": 0.0})
    for start, unit in [("2021-08-28T05:47:13", "s"), ("1969-12-30T22:59:59.999", "ms"), ("2024-02-29T23:00", "us")]:
        knots = np.datetime64(start, unit) + np.array([0, 5, 31]) * np.timedelta64(3599, "s")
        table.index = pd.DatetimeIndex(knots)
        for step in ("1h", "10min", "7h", "90s"):
            expected = ss.geo.resample(table, step, max_gap="10D")["time"].to_numpy()
            found = along(f"--every {step}", knots)
            np.testing.assert_array_equal(found, expected)
            assert found[0] >= knots[0] and found[-1] <= knots[-1]


def test_times_of_tables_with_and_without_a_zone_do_not_mix(run, fails):
    for zone, other in [("", "+05:00"), ("Z", ""), ("+01:00", "")]:
        dated([f"2021-08-{day}T00:00{zone}" for day in (28, 29, 30)])
        run("fit a.csv --space r:1 -o a.npz")
        write("at.csv", f"time\n2021-08-28T12:00{other}\n")
        problem = fails("sample a.npz --at at.csv -o b.csv")
        assert problem.startswith("at.csv: its times have ") and "which time is meant is in doubt" in problem
        write("at.csv", f"time\n2021-08-28T12:00{zone}\n")
        run("sample a.npz --at at.csv -o b.csv")
        # Arrays of NumPy know of no zone.
        np.savez("at.npz", time=np.array(["2021-08-28T12:00"], "M8[s]"))
        run("sample a.npz --at at.npz -o b.csv")

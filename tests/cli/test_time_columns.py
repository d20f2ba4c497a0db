"""The column of times is found by its name and never ignored silently."""

import numpy as np
import pytest
from tabular import table, write, write_table

import symspline as ss

DATES = ["2021-08-29T00:00:00Z", "2021-08-29T06:00:00Z", "2021-08-29T18:00:00Z"]
HOURS = np.array(["2021-08-29T00", "2021-08-29T06", "2021-08-29T18"], "datetime64[h]")


def write_columns(**columns):
    write_table("a.csv", columns | {"x": [0, 1, 5]})


@pytest.fixture
def times(run):
    """The knots of a curve through a table of these columns."""

    def times(options="--columns x", **columns):
        write_columns(**columns)
        run(f"fit a.csv --space r:1 {options} -o a.npz")
        return ss.load("a.npz").t.tolist()

    return times


def test_dates_under_a_usual_name_are_the_time(run, times):
    names = [
        "timestamp",
        "ISO_TIME",
        "Date",
        "DateTime",
        "date_time",
        "#timestamp [ns]",
        "BaseDateTime",
        "Date (UTC)",
        "header.stamp",
    ]
    for name in [*names, "utc"]:
        assert times("", **{name: DATES}) == HOURS.astype("M8[s]").tolist()
        run("sample a.npz --every 6h -o b.csv")
        assert list(table("b.csv")) == [name.removeprefix("#"), "x"]
    # A date with the time of day needs no other columns.
    assert times(ISO_TIME=DATES, year=[2021] * 3, hour=[0, 6, 18]) == HOURS.astype("M8[s]").tolist()


def test_dates_in_arrays(run, fails):
    for ending in ["npz", "parquet"]:
        for dates in (np.array([date[:-1] for date in DATES]), HOURS.astype("M8[s]")):
            write_table(f"a.{ending}", {"timestamp": dates, "x": np.array([0.0, 1, 5])})
            run(f"fit a.{ending} --space r:1 -o c.npz")
            np.testing.assert_array_equal(ss.load("c.npz").t, HOURS)
            write_table(f"a.{ending}", {"when": dates, "x": np.array([0.0, 1, 5])})
            problem = fails(f"fit a.{ending} --space r:1 -o b.npz")
            assert f"a.{ending}: when may hold the times; say --time when" in problem
    np.savez("a.npz", t=np.array([0, 1, 2], "m8[s]"), x=[0.0, 1, 2])
    assert "column 't' holds timedelta64[s], not numbers" in fails("fit a.npz --space r:1 -o b.npz")


def test_columns_that_may_hold_the_times_raise(fails, times):
    for columns, named in [
        ({"when": DATES}, "when"),
        ({"when": ["29.8.2021", "30.8.2021", "31.8.2021"]}, "when"),
        ({"when": ["8/29/21", "8/30/21", "8/31/21"]}, "when"),
        ({"when": ["29 Aug 2021", "30 Aug 2021", "31 Aug 2021"]}, "when"),
        ({"when": ["Aug 29 2021", "Aug 30 2021", "Aug 31 2021"]}, "when"),
        ({"when": ["20210829T1655", "20210829T1755", "20210829T1855"]}, "when"),
        ({"when": ["16:55", "17:55", "18:55"]}, "when"),
        ({"when": ["", "2021-08-30", "2021-08-31"]}, "when"),
        ({"seen": [20210829, 20210831, 20210901]}, "seen"),
        ({"timestamp": [0, 5, 9]}, "timestamp"),
        ({"stamp_ns": [0, 5, 9]}, "stamp_ns"),
        ({"rosbagTimestamp": [0, 5, 9]}, "rosbagTimestamp"),
        ({"sec": [0, 5, 9]}, "sec"),
        ({"time_ns": [0, 5, 9]}, "time_ns"),
        ({"year": [2001, 2002, 2005]}, "year"),
        ({"Date": [20210829, 20210830, 20210831]}, "Date"),
        ({"t": [1, 2, 3], "time": DATES}, "t, time"),
        ({"time": ["0000", "0600", "1200"], "date": [20210829] * 3}, "time, date"),
        ({"date": ["2021-08-29", "2021-08-30", "2021-08-31"], "hour": [0, 6, 18]}, "date, hour"),
    ]:
        write_columns(**columns)
        assert f"a.csv: {named} may " in fails("fit a.csv --space r:1 --columns x -o a.npz")
        assert times("--columns x --time none", **columns) == [0, 1, 2]


def test_other_columns_are_not_times(times):
    for cells in (["1.2.3"] * 3, ["10.0.0.1"] * 3, ["a-1-2"] * 3, ["12-34"] * 3, ["north"] * 3):
        assert times(note=cells) == [0, 1, 2]
    # No days: of another century, or with numbers that no month has.
    for cells in ([18990829, 18990830, 18990831], [20211329, 20211330, 20211331], [0.5, 20210829, 20210830]):
        assert times(seen=cells) == [0, 1, 2]
    assert times("--time none", none=[3, 4, 5]) == [3, 4, 5]


def test_days_as_one_number_are_refused(fails, times):
    write_columns(date=[20210829, 20210831, 20210901])
    problem = fails("fit a.csv --space r:1 --time date -o a.npz")
    assert "line 2: column 'date' holds 20210829, which is a day but not a number of days; write 2021-08-29" in problem
    assert times("--time date", date=[20210829, 20210899, 20210901]) == [20210829, 20210899, 20210901]


@pytest.mark.filterwarnings("always::UserWarning")
def test_rounded_times_name_the_option(run):
    t = 1.4e9 + np.arange(30) * 1e-3
    write("a.csv", "t,x\n" + "".join(f"{own!r},{i * i}\n" for i, own in enumerate(t.tolist())))
    assert "give the unit, such as --unix s" in run("fit a.csv --space r:1 -o a.npz", notes=True)


@pytest.mark.parametrize(
    "dates, options, zone",
    [
        (["2021-08-29 16:55:00 UTC", "2021-08-29 17:05:30.5 UTC"], "", "Z"),
        (['"Sun, 29 Aug 2021 16:55:00 GMT"', '"Sun, 29 Aug 2021 17:05:30 GMT"'], "", "Z"),
        (['"Sun, 29 Aug 2021 18:55:00 +0200"', '"Sun, 29 Aug 2021 19:05:30 +0200"'], "", "Z"),
        (["29.08.2021 16:55:00", "29.08.2021 17:05:30"], "--time-format '%d.%m.%Y %H:%M:%S'", ""),
        (["8/29/21 06:55:00 PM +0200", "8/29/21 07:05:30 PM +0200"], "--time-format '%m/%d/%y %I:%M:%S %p %z'", "Z"),
        (["20210829165500", "20210829170530"], "--time-format %Y%m%d%H%M%S", ""),
    ],
)
def test_dates_of_other_programs(run, dates, options, zone):
    write("a.csv", "time,x\n" + "".join(f"{date},{i}\n" for i, date in enumerate(dates)))
    run(f"fit a.csv --space r:1 {options} -o a.npz")
    run("sample a.npz -n 2 -o b.csv")
    first, last = table("b.csv")["time"]
    assert first.removesuffix("Z").removesuffix(".000") == "2021-08-29T16:55:00" and last[:19] == "2021-08-29T17:05:30"
    assert first.endswith("Z") == bool(zone)


def test_dates_that_do_not_match_a_format(fails):
    write("a.csv", "time,x\n29.08.2021,0\n2021-08-30,1\n")
    assert "such as --time-format '%d.%m.%Y %H:%M'" in fails("fit a.csv --space r:1 -o a.npz")
    problem = fails("fit a.csv --space r:1 --time-format %d.%m.%Y -o a.npz")
    assert problem == "a.csv, line 3: column 'time' holds '2021-08-30', which does not match --time-format %d.%m.%Y"


@pytest.mark.parametrize("names", ["date,time", "Time,Date", "day,clock"])
def test_a_date_and_a_time_of_day(run, fails, names):
    cells = {"date": "2021-08-29", "Date": "2021-08-29", "day": "2021-08-29"}
    rows = [",".join([cells.get(name, clock) for name in names.split(",")]) for clock in ("16:55:00", "17:05:30")]
    write("a.csv", f"{names},x\n" + "".join(f"{row},{i}\n" for i, row in enumerate(rows)))
    first, last = sorted(names.split(","), key=lambda name: name not in cells)
    if names != "day,clock":
        problem = f"say --time {first},{last}, which joins a date and a time of day"
        assert problem in fails("fit a.csv --space r:1 -o a.npz")
    run(f"fit a.csv --space r:1 --time {first},{last} -o a.npz")
    assert [str(t) for t in ss.load("a.npz").t] == ["2021-08-29T16:55:00", "2021-08-29T17:05:30"]

"""The column of times is found by its name and never ignored silently."""

import numpy as np
from tabular import table, write, write_table

import symspline as ss

DATES = ["2021-08-29T00:00:00Z", "2021-08-29T06:00:00Z", "2021-08-29T18:00:00Z"]
HOURS = np.array(["2021-08-29T00", "2021-08-29T06", "2021-08-29T18"], "datetime64[h]")


def tabled(**columns):
    columns |= {"x": [0, 1, 5]}
    rows = zip(*columns.values(), strict=True)
    write("a.csv", "\n".join([",".join(columns), *(",".join(map(str, row)) for row in rows)]) + "\n")


def test_dates_under_a_usual_name_are_the_time(run):
    for name in [
        "timestamp",
        "ISO_TIME",
        "Date",
        "DateTime",
        "date_time",
        "#timestamp [ns]",
        "BaseDateTime",
        "Date (UTC)",
        "utc",
    ]:
        write("a.csv", f"{name},x\n" + "".join(f"{date},{x}\n" for date, x in zip(DATES, [0, 1, 5], strict=True)))
        run("fit a.csv --space r:1 -o a.npz")
        np.testing.assert_array_equal(ss.load("a.npz").t, HOURS)
        run("sample a.npz --every 6h -o b.csv")
        assert list(table("b.csv")) == [name, "x"]


def test_dates_in_arrays(run, fails):
    for ending in ["npz", "parquet"]:
        for kind in ["text", "date"]:
            dates = np.array([date[:-1] for date in DATES]) if kind == "text" else HOURS.astype("M8[s]")
            write_table(f"a.{ending}", {"timestamp": dates, "x": np.array([0.0, 1, 5])})
            run(f"fit a.{ending} --space r:1 -o c.npz")
            np.testing.assert_array_equal(ss.load("c.npz").t, HOURS)
            write_table(f"a.{ending}", {"when": dates, "x": np.array([0.0, 1, 5])})
            assert f"a.{ending}: when may hold the times; say --time when" in fails(
                f"fit a.{ending} --space r:1 -o b.npz"
            )


def test_dates_under_other_names(run, fails):
    for cells in [
        DATES,
        ["29.8.2021", "30.8.2021", "31.8.2021"],
        ["8/29/21", "8/30/21", "8/31/21"],
        ["29 Aug 2021", "30 Aug 2021", "31 Aug 2021"],
        ["Aug 29 2021", "Aug 30 2021", "Aug 31 2021"],
        ["20210829T1655", "20210829T1755", "20210829T1855"],
        ["16:55", "17:55", "18:55"],
        ["", "2021-08-30", "2021-08-31"],
    ]:
        tabled(when=cells)
        problem = fails("fit a.csv --space r:1 --columns x -o a.npz")
        assert problem.startswith(
            "a.csv: when may hold the times; say --time when, or --time none to number the points"
        )
        run("fit a.csv --space r:1 --time none -o a.npz")
        assert ss.load("a.npz").t.tolist() == [0, 1, 2]


def test_ambiguous_time_columns(fails):
    for columns, named in [
        ({"timestamp": [0, 5, 9]}, "timestamp"),
        ({"time_ns": [0, 5, 9]}, "time_ns"),
        ({"year": [2001, 2002, 2005]}, "year"),
        ({"Date": [20210829, 20210830, 20210831]}, "Date"),
        ({"t": [1, 2, 3], "time": DATES}, "t, time"),
        ({"time": ["0000", "0600", "1200"], "date": [20210829] * 3}, "time, date"),
        ({"date": ["2021-08-29", "2021-08-30", "2021-08-31"], "hour": [0, 6, 18]}, "date, hour"),
    ]:
        tabled(**columns)
        assert f"a.csv: {named} may " in fails("fit a.csv --space r:1 --columns x -o a.npz")


def test_a_date_with_time_needs_no_parts(run):
    tabled(ISO_TIME=DATES, year=[2021] * 3, hour=[0, 6, 18])
    run("fit a.csv --space r:1 --columns x -o a.npz")
    np.testing.assert_array_equal(ss.load("a.npz").t, HOURS)


def test_words_that_resemble_dates(run):
    for cell in ("1.2.3", "10.0.0.1", "a-1-2", "12-34", "north"):
        tabled(note=[cell] * 3)
        run("fit a.csv --space r:1 --columns x -o a.npz")
        assert ss.load("a.npz").t.tolist() == [0, 1, 2]


def test_days_as_one_number_are_refused(run, fails):
    tabled(date=[20210829, 20210831, 20210901])
    problem = fails("fit a.csv --space r:1 --time date -o a.npz")
    assert (
        "a.csv, line 2: column 'date' holds 20210829, which is a day but not a number of days; write 2021-08-29"
        in problem
    )
    tabled(date=[20210829, 20210899, 20210901])
    run("fit a.csv --space r:1 --time date -o a.npz")


def test_days_as_one_number_are_found_under_any_name(run, fails):
    tabled(seen=[20210829, 20210831, 20210901])
    assert "seen may hold the times; say --time seen" in fails("fit a.csv --space r:1 --columns x -o a.npz")
    assert "which is a day but not a number" in fails("fit a.csv --space r:1 --columns x --time seen -o a.npz")
    run("fit a.csv --space r:1 --columns x --time none -o a.npz")
    # No days: of another century, or with numbers that no month has.
    for cells in ([18990829, 18990830, 18990831], [20211329, 20211330, 20211331], [0.5, 20210829, 20210830]):
        tabled(seen=cells)
        run("fit a.csv --space r:1 --columns x -o a.npz")


def test_a_column_called_none_is_a_column(run):
    tabled(none=[3, 4, 5])
    run("fit a.csv --space r:1 --time none -o a.npz")
    assert ss.load("a.npz").t.tolist() == [3, 4, 5]


def test_durations_are_not_times(fails):
    np.savez("a.npz", t=np.array([0, 1, 2], "m8[s]"), x=[0.0, 1, 2])
    assert "column 't' holds timedelta64[s], not numbers" in fails("fit a.npz --space r:1 -o b.npz")

"""Recordings with unsorted rows, duplicates and gaps."""

import numpy as np
import pytest
from tabular import table, write, write_table

import symspline as ss


def line(t, x=None, **more):
    write_table("a.csv", {"t": t, **more, "x": range(len(t)) if x is None else x})


@pytest.fixture
def fit(run):
    """Fits numbers with some options, and returns the curve or the curves."""

    def fit(options):
        run(f"fit a.csv --space r:1 {options} -o a.npz")
        return ss.load("a.npz")

    return fit


def through(t, x):
    return ss.CubicSpline(t, np.reshape(x, (-1, 1)), "r:1")


def test_sort(fit, fails):
    line([0, 3, 1, 2])
    problem = fails("fit a.csv --space r:1 -o a.npz")
    assert problem.startswith("a.csv, line 4: time 1.0 does not come after 3.0 in line 3")
    assert problem.endswith("times must increase; --sort puts the rows in order")
    assert fit("--sort") == through([0, 1, 2, 3], [0, 2, 3, 1])
    line([5, 0, 1, 4], id=[*"abba"])
    assert fit("--curve id --sort") == {"a": through([4, 5], [3, 0]), "b": through([0, 1], [1, 2])}
    line([0, 3, 1, 1])
    problem = fails("fit a.csv --space r:1 --sort -o b.npz")
    assert problem.startswith("a.csv, line 5: time 1.0 does not come after 1.0 in line 4")
    assert problem.endswith("--dedup first or mean makes one point of them")


def test_dedup(run, fit, fails):
    line([0, 0, 1, 2, 2, 2], [1, 3, 5, 1, 2, 6])
    out = run("fit a.csv --space r:1 --dedup first -o a.npz")
    assert out.endswith("; 3 rows omitted after another of their time (--dedup first)\n")
    assert ss.load("a.npz") == through([0, 1, 2], [1, 5, 1])
    assert fit("--dedup mean") == through([0, 1, 2], [2, 5, 3])
    line([0, 1, 0, 2], [1, 3, 5, 7])
    assert "line 4: time 0.0 does not come after 1.0" in fails("fit a.csv --space r:1 --dedup first -o b.npz")
    assert fit("--dedup mean --sort") == through([0, 1, 2], [3, 3, 7])
    assert "--dedup" in fails("fit a.csv --space r:1 --dedup last -o b.npz")
    write("a.csv", "t,x,y,z\n0,1,0,0\n1,0,1,0\n1,0,-1,0\n")
    problem = fails("fit a.csv --space s:2 --dedup mean -o a.npz")
    assert problem.startswith("a.csv: points with one time are too far apart to have a mean; --dedup first")


@pytest.mark.parametrize("ending", ["csv", "npz", "parquet"])
def test_rows_with_empty_cells_are_omitted_on_request(ending, run, fails):
    if ending == "csv":
        write("a.csv", "t,x,note\n0,1,\n1,,a\n2,NA,b\n,4,c\n4,nan,d\n5,9,\n6,4,e\n")
    else:
        write_table(f"a.{ending}", {"t": [0.0, 1, np.nan, 5, 6], "x": [1, np.nan, 3, 9, 4]})
    problem = fails(f"fit a.{ending} --space r:1 --columns x -o b.npz")
    assert "symspline fit --skipna omits such rows" in problem
    out = run(f"fit a.{ending} --space r:1 --columns x --skipna -o b.npz")
    assert f"; {4 if ending == 'csv' else 2} rows without a point or a time omitted (--skipna)" in out
    assert ss.load("b.npz") == through([0, 5, 6], [1, 9, 4])
    write("a.csv", "t,x\n0,\n1,\n")
    problem = fails("fit a.csv --space r:1 --columns x --skipna -o c.npz")
    assert problem == "a.csv has no row in which x and t are all given"


def test_poses_that_are_not_known_are_omitted_from_a_trajectory(run, fails):
    write("a.txt", "0 0 0 0 0 0 0 1\n1 1 0 0 nan nan nan nan\n2 2 0 0 0 0 0 1\n3 3 1 0 0 0 0 1\n")
    problem = fails("fit a.txt --space se:3 -o a.npz")
    assert problem == "a.txt, line 2: column 'qx' is empty or NaN; symspline fit --skipna omits such rows"
    assert "; 1 row without a point or a time omitted" in run("fit a.txt --space se:3 --skipna -o a.npz")
    np.testing.assert_array_equal(ss.load("a.npz").t, [0, 2, 3])
    write("a.txt", "0 0 0 0 0 0 0 1\n1 1 0 0 inf 0 0 0\n")
    assert "line 2: column 'qx' holds inf" in fails("fit a.txt --space se:3 --skipna -o b.npz")


def test_a_line_of_excel_names_the_separator(run):
    for mark, comma in (";", ","), (",", "."):
        write("a.csv", "sep=;\r\nt;x\r\n0;1,5\r\n1;2,5\r\n".replace(",", comma).replace(";", mark))
        run("fit a.csv --space r:1 -o a.npz")
        assert ss.load("a.npz") == through([0, 1], [1.5, 2.5])


def test_a_gap_that_no_curve_bridges_is_named_with_its_remedy(run, fails):
    rng = np.random.default_rng(0)
    t = np.arange(100) + 1000 * (np.arange(100) > 49)
    walk = np.cumsum(0.05 * rng.standard_normal((100, 2)), axis=0)
    p = np.column_stack([np.cos(walk[:, :1]) * [1, 1], np.sin(walk[:, :1])])
    p = np.column_stack([p[:, 0] * np.cos(walk[:, 1]), p[:, 1] * np.sin(walk[:, 1]), p[:, 2]])
    write_table("a.csv", {"t": t, "x": p[:, 0], "y": p[:, 1], "z": p[:, 2]})
    problem = fails("fit a.csv --space sphere:2 -o a.npz", 1)
    assert "no data between time 49.0 in line 51 and time 1050.0 in line 52, a gap of 1001 median steps" in problem
    assert problem.endswith("cut it there (--max-gap), or smooth noisy data (--smooth)")
    assert run("fit a.csv --space sphere:2 --max-gap 100 -o a.npz")


def test_max_gap(run, fit, fails):
    line([0, 1, 2, 12, 13, 40, 60, 61])
    out = run("fit a.csv --space r:1 --max-gap 5 -o a.npz")
    assert out.startswith("a.npz: 3 curves through 7 points") and out.endswith("; 1 row alone between gaps omitted\n")
    segments = [through([0, 1, 2], [0, 1, 2]), through([12, 13], [3, 4]), through([60, 61], [6, 7])]
    assert ss.load("a.npz") == ss.SegmentedCurve(segments)
    run("sample a.npz --every 1 -o b.csv")
    assert table("b.csv")["curve"] == [*"1112233"]
    # As long as the limit is no gap.
    assert len(fit("--max-gap 27")) == 1
    for gap, problem in [
        ("0.5", "every point is alone; the median step is 1"),
        ("5s", "give a gap without a unit"),
        ("soon", "--max-gap soon: a duration is a number"),
    ]:
        assert problem in fails(f"fit a.csv --space r:1 --max-gap {gap} -o c.npz")
    days = [f"2021-08-{day:02}" for day in (1, 2, 9, 10, 1, 2)]
    line(days, id=[*"aaaabb"])
    assert list(fit("--curve id --max-gap 36h")) == ["a/1", "a/2", "b"]
    assert list(fit("--curve id --max-gap 604800")) == ["a", "b"]
    line(days, id=["a", "a", "a", "a", "a/1", "a/1"])
    assert "two curves would have the name 'a/1'" in fails("fit a.csv --space r:1 --curve id --max-gap 36h -o b.npz")


def test_options_that_need_times(fails):
    write("a.csv", "x\n1\n2\n")
    for option in ["--sort", "--dedup first", "--max-gap 3"]:
        problem = fails(f"fit a.csv --space r:1 {option} -o a.npz")
        assert problem.startswith(f"{option.split()[0]} needs times, and there is no column of times")


def test_errors_after_sorting_name_the_row(fails):
    write("a.csv", "t,x,y,z\n5,0,-1,0\n0,1,0,0\n0,1,0,0\n1,0,1,0\n")
    problem = fails("fit a.csv --space s:2 --sort --dedup first -o a.npz")
    assert "the point in line 5 and the point in line 2 of the curve" in problem

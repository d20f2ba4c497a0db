"""Columns and indices of pandas as times and points."""

import numpy as np
import pytest
from refused import raises

import symspline as ss

pd = pytest.importorskip("pandas")
HOURS = np.array(["2025-12-31T23", "2026-01-01T00", "2026-01-01T01"], "datetime64[us]")
BERLIN = pd.date_range("2026-01-01", periods=3, freq="h", tz="Europe/Berlin")


@pytest.mark.parametrize("times", [BERLIN, pd.Series(BERLIN), list(BERLIN), BERLIN.to_series()])
def test_times_with_a_zone_become_utc(times):
    spline = ss.CubicSpline(times, np.eye(3), "sphere:2")
    assert np.array_equal(spline.t, HOURS)
    for x in (BERLIN[1], pd.Timestamp("2026-01-01 00:00", tz="UTC")):
        assert np.array_equal(spline(x), [0, 1, 0])
    raises("x has no time zone, but the knots have one", spline, pd.Timestamp("2026-01-01 00:00"))


def test_other_times():
    table = pd.DataFrame(np.eye(3), columns=["x", "y", "z"])
    for times, expected in [
        (pd.date_range("2026-01-01", periods=3, freq="h"), HOURS + np.timedelta64(1, "h")),
        (pd.to_timedelta([0, 1, 2], unit="h"), [0.0, 3600, 7200]),
        (pd.Series([0.0, 1, 3]), [0, 1, 3]),
        (pd.array([0, 1, 3], dtype="Int64"), [0, 1, 3]),
    ]:
        spline = ss.CubicSpline(times, table, "sphere:2")
        assert np.array_equal(spline.t, expected) and np.array_equal(spline.points, np.eye(3))


def test_times_that_are_missing():
    raises(r"t\[1\] is NaN", ss.CubicSpline, pd.array([0, None, 2], dtype="Int64"), np.eye(3), "sphere:2")
    raises(r"t\[1\] is NaT", ss.CubicSpline, [BERLIN[0], pd.NaT, BERLIN[2]], np.eye(3), "sphere:2")

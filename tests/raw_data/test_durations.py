"""Durations as texts, in every function that takes them."""

from datetime import timedelta

import numpy as np
import pytest
from refused import raises

import symspline as ss

HOURS = np.datetime64("2024-03-01T07:30") + np.array([0, 1, 2, 9, 10, 11]) * np.timedelta64(1, "h")
Y = np.arange(6.0)[:, None]


def test_gaps():
    expected = ss.fit_segments(HOURS, Y, "r:1", max_gap=10800.0)
    pd = pytest.importorskip("pandas")
    for gap in ("3h", "180min", timedelta(hours=3), np.timedelta64(3, "h"), pd.Timedelta("3h")):
        found = ss.fit_segments(HOURS, Y, "r:1", max_gap=gap)
        assert len(found) == 2 and found[1] == expected[1]
        # Durations as times.
        assert len(ss.fit_segments(HOURS - HOURS[0], Y, "r:1", max_gap=gap)) == 2
        raises("the times are numbers", ss.fit_segments, np.arange(6.0), Y, "r:1", max_gap=gap)
        table = pd.DataFrame({"time": HOURS, "lon": np.arange(6.0), "lat": 50.0})
        assert len(ss.geo.resample(table, "1h", time="time", max_gap=gap)) == 4
    for wrong in ("3", "soon", "3 parsecs"):
        raises("max_gap is .* not a duration.*units are ns", ss.fit_segments, HOURS, Y, "r:1", max_gap=wrong)
        raises("max_gap is .* not a duration", ss.geo.resample, table, "1h", time="time", max_gap=wrong)


def test_shifts():
    curve = ss.CubicSpline(HOURS, Y, "r:1")
    texts = {"3h": 10800, "90 min": 5400, "1.5 hours": 5400, "250ms": 0.25, "2 d": 172800, "1e3us": 1e-3, "-2h": -7200}
    for text, seconds in texts.items():
        assert (curve.shift(text).domain[0] - HOURS[0]) / np.timedelta64(1, "s") == pytest.approx(seconds, rel=1e-15)
    raises("dt is 'x', which is not a duration", curve.shift, "x")

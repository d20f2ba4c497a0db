"""Two times that lie too close for the distance of their points: the message names them."""

import numpy as np
import pytest

import symspline as ss
from symspline.cli import main


def recording(close, start=0.0):
    """Points along an equator, 0.1 apart with noise of 0.01, every quarter of a second but for two of them."""
    rng = np.random.default_rng(0)
    t = np.linspace(0, 10, 40)
    t = np.sort(np.append(t, t[20] + close)) + start
    angle = 0.1 * np.arange(41)
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1) + 0.01 * rng.standard_normal((41, 3))
    return t, ss.Sphere(2).project(points)


@pytest.mark.parametrize("close", [1e-3, 1e-6, 1e-9])
def test_the_two_times_are_named(close):
    t, points = recording(close)
    with pytest.raises(ss.ConvergenceError) as caught:
        ss.CubicSpline(t, points, "sphere:2")
    message = str(caught.value)
    assert f"t[20] = {t[20]} and t[21] = {t[21]} are too close for the distance 0.0958 " in message
    assert (
        "merge the two samples, smooth the data with make_smoothing_spline, or correct the clock" in message
    )
    assert "long" not in message.partition("t[20]")[2]


def test_batches_lists_products_and_dates():
    t, points = recording(1e-6)
    good = np.linspace(0, 10, 41)
    with pytest.raises(ss.ConvergenceError, match=r"of curve 1.*; t\[20\] = 5\.12\d+ and t\[21\] = "):
        ss.CubicSpline([good, t], [points, points], "sphere:2")
    with pytest.raises(ss.ConvergenceError, match=r"of curve 1.*; t\[20\] = 5\.12\d+ and t\[21\] = "):
        ss.fit_many([(good, points), (t, points)], "sphere:2")
    with pytest.raises(ss.ConvergenceError, match=r"t\[20\] = 5\.12\d+ and t\[21\] = "):
        ss.CubicSpline(t, (points, t[:, None]), "sphere:2 x r:1")
    dates = np.datetime64("2024-01-01", "ns") + np.rint(1e9 * t).astype("m8[ns]")
    with pytest.raises(ss.ConvergenceError, match=r"t\[20\] = 2024-01-01T00:00:05\.12\d+ and t\[21\] = 2024"):
        ss.CubicSpline(dates, points, "sphere:2")


def test_long_steps_stay_the_reason_where_they_are():
    rng = np.random.default_rng(1)
    points = ss.Sphere(2).random_point(rng, 12)
    with pytest.raises((ss.ConvergenceError, ss.CutLocusError)) as caught:
        ss.CubicSpline(None, points, "sphere:2", method="fixed-point", max_iter=3)
    assert "too close" not in str(caught.value)


def test_the_command_line_names_the_lines(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    t, points = recording(1e-6)
    rows = np.column_stack([t, points]).tolist()
    (tmp_path / "a.csv").write_text("t,x,y,z\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))
    assert main(["fit", "a.csv", "--space", "sphere:2", "-o", "a.npz"]) == 1
    message = capsys.readouterr().err
    assert f"time {t[20]} in line 22 and time {t[21]} in line 23 are too close" in message

"""Seconds since 1970 in double precision: exact readings, and warnings where rounding spoils accelerations."""

import io
import warnings

import numpy as np
import pytest

import symspline as ss

START = 1_403_636_580_838_555_648


def recording(rate=1000, n=400):
    """Positions of a car at 10 m/s on a straight line, whose acceleration is zero."""
    ns = START + np.arange(n) * (10**9 // rate)
    s = np.arange(n) / rate
    return ns, np.stack([10 * s, 0 * s, 0 * s], axis=-1)


def lines(ns, x):
    rows = zip(ns.tolist(), x.tolist(), strict=True)
    return "\n".join(f"{a // 10**9}.{a % 10**9:09d} {' '.join(map(repr, b))} 0 0 0 1" for a, b in rows)


def test_dates_of_a_file_are_exact():
    ns, x = recording()
    t, poses = ss.poses.read_tum(io.StringIO(lines(ns, x)), dates=True)
    assert np.array_equal(t.astype(np.int64), ns)
    curve = ss.CubicSpline(t, ss.poses.split(poses), "so:3 x r:3")
    assert np.abs(ss.poses.linear_acceleration(curve, t[5:-5])).max() < 1e-6


def test_rounded_times_of_files_warn():
    ns, x = recording()
    with pytest.warns(UserWarning, match=r"0.00024 of the time step 0.001.*Pass dates=True"):
        t, _ = ss.poses.read_tum(io.StringIO(lines(ns, x)))
    text = "\n".join(repr(value) for value in t.tolist())
    pose = "1 0 0 5 0 1 0 6 0 0 1 7\n" * len(t)
    with pytest.warns(UserWarning, match="times of .* are rounded"):
        ss.poses.read_kitti(io.StringIO(pose), io.StringIO(text))


FUNCTIONS = {
    "CubicSpline": lambda t, x: ss.CubicSpline(t, x, "r:3"),
    "batch": lambda t, x: ss.CubicSpline(np.stack([t, t]), np.stack([x, x]), "r:3"),
    "HermiteSpline": lambda t, x: ss.HermiteSpline.from_points(t, x, "r:3"),
    "PiecewiseGeodesic": lambda t, x: ss.PiecewiseGeodesic(t, x, "r:3"),
    "fit_many": lambda t, x: ss.fit_many([(t, x)], "r:3"),
    "fit_segments": lambda t, x: ss.fit_segments(t, x, "r:3", max_gap=1e9),
    "make_smoothing_spline": lambda t, x: ss.make_smoothing_spline(t, x, "r:3", 1e-9),
    "estimate": lambda t, x: ss.estimate([ss.measure.Points(t, x, sigma=1.0)], 5, "r:3", lam=1e-9),
    "integrate": lambda t, x: ss.rotations.integrate(t, x / 10),
}


@pytest.mark.parametrize("function", FUNCTIONS)
def test_rounded_times_warn_once(function):
    ns, x = recording(n=60)
    seconds = ns / 1e9
    with pytest.warns(UserWarning, match="are rounded to multiples of 2.4e-07") as caught:
        FUNCTIONS[function](seconds, x)
    assert len({str(own.message) for own in caught}) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for t in (seconds - seconds[0], ns, ns.astype("datetime64[ns]"), seconds[0] + np.arange(60) / 32):
            FUNCTIONS[function](t, x)


@pytest.mark.parametrize("rate, warned", [(30, False), (200, False), (500, True), (2000, True)])
def test_the_limit_is_a_part_of_the_time_step(rate, warned):
    ns, x = recording(rate, 50)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        ss.CubicSpline(ns / 1e9, x, "r:3")
    assert bool(caught) == warned

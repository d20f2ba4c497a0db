"""Missing samples: `skipna=True` in every function that takes recordings is the same as their removal by hand."""

import io

import numpy as np
import pytest
from curves import points_on
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss

SPACES = ["sphere:2", "so:3", "so:3 x r:3", "cp:1", "spd:2", "r:1", "torus:2"]
T = 3.7 + np.cumsum(0.5 + np.random.default_rng(1).random(14))
GONE = [0, 4, 5, 13]
KEPT = np.setdiff1d(np.arange(14), GONE)


def parts(points):
    return points if isinstance(points, tuple) else (points,)


def recording(name, seed=0):
    return points_on(ss.space(name), 14, step=0.2)


def with_gaps(points, rows=GONE):
    """Only one number of each missing point is NaN."""
    found = tuple(part.copy() for part in parts(points))
    for i in rows:
        found[i % len(found)][i].flat[-1] = np.nan
    return found if isinstance(points, tuple) else found[0]


def kept(points, rows=KEPT):
    found = tuple(part[rows] for part in parts(points))
    return found if isinstance(points, tuple) else found[0]


# Of all functions see `test_same_data`.
FUNCTIONS = {
    "CubicSpline": lambda t, p, s, **how: ss.CubicSpline(t, p, s, **how),
    "fit_segments, smooth": lambda t, p, s, **how: ss.fit_segments(t, p, s, max_gap=9, smooth=True, lam=1e-3, **how),
    "estimate": lambda t, p, s, **how: ss.estimate([ss.measure.Points(t, p)], 6, s, lam=1e-3, **how),
}


@pytest.mark.parametrize("name", SPACES)
@pytest.mark.parametrize("function", FUNCTIONS)
def test_missing_points_are_omitted(function, name):
    fit, points = FUNCTIONS[function], recording(name)
    expected = fit(T[KEPT], kept(points), name)
    x = np.linspace(T[KEPT][0], T[KEPT][-1], 30)
    bad = with_gaps(points)
    for found in (fit(T, bad, name, skipna=True), fit(T[KEPT], kept(points), name, skipna=True)):
        for a, b in zip(parts(found(x)), parts(expected(x)), strict=True):
            np.testing.assert_array_equal(a, b)
    raises(r"\[0\].*skipna=True", fit, T, bad, name)
    # Of the times.
    times = T.copy()
    times[GONE] = np.nan
    for a, b in zip(parts(fit(times, points, name, skipna=True)(x)), parts(expected(x)), strict=True):
        np.testing.assert_array_equal(a, b)
    masked = tuple(np.ma.masked_invalid(part) for part in parts(bad))
    masked = masked if isinstance(bad, tuple) else masked[0]
    for a, b in zip(parts(fit(T, masked, name, skipna=True)(x)), parts(expected(x)), strict=True):
        np.testing.assert_array_equal(a, b)
    raises(r"is masked.*skipna=True", fit, T, masked, name)


@pytest.mark.parametrize("kind", [int, float])
def test_as_many_times_as_points_that_are_present_are_refused(kind):
    """They may belong to other points."""
    y = np.arange(6.0)[:, None]
    y[2] = np.nan
    raises(r"t has shape \(5,\)", ss.CubicSpline, np.arange(5).astype(kind), y, "r:1", skipna=True)


def test_dates_with_a_time_zone_keep_it():
    pd = pytest.importorskip("pandas")
    t = pd.date_range("2024-05-01", periods=14, freq="90s", tz="Europe/Stockholm")
    bad = with_gaps(recording("sphere:2"))
    for times in (t, list(t), t.strftime("%Y-%m-%dT%H:%M:%S%z").tolist()):
        curve = ss.CubicSpline(times, bad, "sphere:2", skipna=True)
        assert len(curve.t) == len(KEPT)
        np.testing.assert_array_equal(curve(t[3]), bad[3])


def test_batches_of_recordings():
    p = np.stack([recording("so:3"), recording("so:3")[::-1]])
    same = p.copy()
    same[:, GONE] = np.nan
    for fit in (ss.CubicSpline, ss.HermiteSpline.from_points, ss.PiecewiseGeodesic):
        assert np.array_equal(fit(T, same, "so:3", skipna=True)(9.0), fit(T[KEPT], p[:, KEPT], "so:3")(9.0))
    differ = p.copy()
    differ[1, [2, 3]] = np.nan
    for fit in (ss.CubicSpline, ss.HermiteSpline.from_points, ss.PiecewiseGeodesic):
        raises(r"points\[2\] of curve 1 is missing.*fit_many", fit, T, differ, "so:3", skipna=True)
    smooth = ss.make_smoothing_spline(T, differ, "so:3", 1e-3, skipna=True)
    alone = ss.make_smoothing_spline(np.delete(T, [2, 3]), np.delete(p[1], [2, 3], 0), "so:3", 1e-3, knots=T)
    assert np.abs(smooth[1](T) - alone(T)).max() < 1e-9
    many = ss.fit_many([(T, own) for own in differ], "so:3", skipna=True)
    assert [len(own.t) for own in many] == [14, 12]


def test_weights_and_velocities_follow_their_points():
    rng, p = np.random.default_rng(2), recording("sphere:2")
    bad, w = with_gaps(p), rng.uniform(1, 4, 14)
    found = ss.make_smoothing_spline(T, bad, "sphere:2", 1e-2, weights=w, skipna=True)
    np.testing.assert_array_equal(
        found(9.0), ss.make_smoothing_spline(T[KEPT], p[KEPT], "sphere:2", 1e-2, weights=w[KEPT])(9.0)
    )
    v = ss.Sphere(2).project_tangent(p, rng.normal(size=(14, 3)) / 9)
    v[7] = np.nan
    rows = np.setdiff1d(KEPT, [7])
    curve = ss.HermiteSpline(T, bad, v, "sphere:2", skipna=True)
    assert curve == ss.HermiteSpline(T[rows], p[rows], v[rows], "sphere:2")


def test_velocities_at_inner_points_count_all_samples():
    p = recording("so:3")
    v = ss.space("so:3").project_tangent(p[7], np.ones((3, 3)) / 9)
    found = ss.CubicSpline(T, with_gaps(p), "so:3", velocities={7: v}, skipna=True)
    assert found == ss.CubicSpline(T[KEPT], p[KEPT], "so:3", velocities={4: v})
    raises(
        "velocities has the key 4, but this point is missing",
        ss.CubicSpline,
        T,
        with_gaps(p),
        "so:3",
        velocities={4: v},
        skipna=True,
    )
    raises(r"velocities\[7\]", ss.CubicSpline, T, with_gaps(p), "so:3", velocities={7: 9 + v}, skipna=True)


@pytest.mark.parametrize("function", FUNCTIONS)
def test_errors_count_all_samples(function):
    fit, bad = FUNCTIONS[function], with_gaps(recording("so:3"))
    bad[9] *= 1.01
    raises(r"point(s\[| )9\]? .*is off the space", fit, T, bad, "so:3", skipna=True)
    times = T.copy()
    times[7] = T[9]
    if function != "estimate":
        raises(
            r"t(\[0\])?\[8\] = .* is before t(\[0\])?\[7\]",
            fit,
            times,
            with_gaps(recording("so:3")),
            "so:3",
            skipna=True,
        )


def test_measurements_of_sensors():
    rng, s = np.random.default_rng(3), np.linspace(0, 6, 60)
    truth = Rotation.from_rotvec(np.outer(np.sin(s), [0, 0.3, 1]))
    rates = np.outer(np.cos(s), [0, 0.3, 1]) + 0.01 * rng.normal(size=(60, 3))
    seen, noise = truth.as_matrix()[::6], np.full(60, 0.01) * rng.uniform(1, 2, 60)
    rates[[3, 17], 1] = np.nan
    seen = seen @ Rotation.from_rotvec(0.01 * rng.normal(size=(10, 3))).as_matrix()
    seen[4] = np.nan

    def fit(i, j, **how):
        points = ss.measure.Points(s[::6][i], seen[i], sigma=0.01)
        gyro = ss.measure.BodyRates(s[j], rates[j], sigma=noise[j])
        return ss.estimate([points, gyro], np.linspace(0, 6, 20), "so:3", lam=1e-4, **how)

    every = np.arange(60)
    found = fit(np.arange(10), every, skipna=True)
    expected = fit(np.delete(np.arange(10), 4), np.delete(every, [3, 17]))
    np.testing.assert_array_equal(found(s), expected(s))
    raises(r"y\[4\] is not finite.*skipna=True", fit, np.arange(10), every)
    raises(r"omega\[3, 1\] is nan.*skipna=True", fit, np.delete(np.arange(10), 4), every)


def test_conversions_return_nan():
    r = Rotation.random(8, rng=5)
    for convert, given in (
        (lambda q, **how: ss.rotations.from_quaternions(q, scalar_first=False, **how), r.as_quat()),
        (lambda q, **how: ss.rotations.from_quaternions(q, scalar_first=False, **how), r.as_quat()),
        (ss.rotations.from_rotation_vectors, r.as_rotvec()),
    ):
        given[[2, 5], 1] = np.nan
        found = convert(given, skipna=True)
        assert np.isnan(found[[2, 5]]).all()
        rows = [0, 1, 3, 4, 6, 7]
        np.testing.assert_allclose(found[rows], r.as_matrix()[rows], atol=1e-14)
        np.testing.assert_array_equal(convert(np.ma.masked_invalid(given), skipna=True), found)
        raises(r"\[2, 1\] is nan.*skipna=True", convert, given)
        assert len(ss.CubicSpline(None, found, "so:3", skipna=True).t) == 6


def test_integrated_rates():
    rng = np.random.default_rng(4)
    rates, first = rng.normal(size=(2, 14, 3)), Rotation.random(2, rng=7).as_matrix()
    bad = rates.copy()
    bad[1, GONE, 2] = np.nan
    expected = ss.rotations.integrate(T[KEPT], rates[1, KEPT], first[1], "world")
    for given in (bad, np.ma.masked_invalid(bad)):
        found = ss.rotations.integrate(T, given, first, "world", skipna=True)
        np.testing.assert_array_equal(found[0], ss.rotations.integrate(T, rates[0], first[0], "world"))
        np.testing.assert_array_equal(found[1, KEPT], expected)
        assert np.isnan(found[1, GONE]).all()
    np.testing.assert_array_equal(
        ss.rotations.integrate(None, bad[1], skipna=True)[KEPT],
        ss.rotations.integrate(KEPT, rates[1, KEPT]),
    )
    dates = np.datetime64("2024-05-01") + (1e9 * T).astype("m8[ns]")
    dates[GONE] = "NaT"
    found = ss.rotations.integrate(dates, rates, skipna=True)
    np.testing.assert_array_equal(found[:, KEPT], ss.rotations.integrate(dates[KEPT], rates[:, KEPT]))
    raises(r"omega\[1, 0, 2\] is nan.*skipna=True", ss.rotations.integrate, T, bad)
    raises(r"t\[0\] is NaT.*skipna=True", ss.rotations.integrate, dates, rates)
    raises(r"t has shape \(13,\)", ss.rotations.integrate, T[:13], bad, skipna=True)


def test_files():
    q = Rotation.random(5, rng=6).as_quat()
    rows = np.column_stack([np.arange(5.0), np.arange(15.0).reshape(5, 3), q])
    rows[[0, 3], 1:] = np.nan
    tum = "\n".join(" ".join(map(repr, row)) for row in rows.tolist())
    t, poses = ss.poses.read_tum(io.StringIO(tum), skipna=True)
    assert t.tolist() == [1, 2, 4] and np.array_equal(poses[:, :3, 3], rows[[1, 2, 4], 1:4])
    euroc = "\n".join(
        f"{i}," + ",".join(map(repr, row)) for i, row in enumerate(rows[:, [1, 2, 3, 7, 4, 5, 6]].tolist())
    )
    t, again = ss.poses.read_euroc(io.StringIO(euroc), skipna=True)
    assert t.astype(int).tolist() == [1, 2, 4] and np.abs(again - poses).max() < 1e-15
    kitti = np.full((5, 12), np.nan)
    kitti[[1, 2, 4]] = poses[:, :3].reshape(3, 12)
    text = "\n".join(" ".join(map(repr, row)) for row in kitti.tolist())
    t, again = ss.poses.read_kitti(io.StringIO(text), skipna=True)
    assert t.tolist() == [1, 2, 4] and np.abs(again - poses).max() < 1e-15
    for read, given in ((ss.poses.read_tum, tum), (ss.poses.read_kitti, text), (ss.poses.read_euroc, euroc)):
        raises("line 1: column .* holds nan.*skipna=True", read, io.StringIO(given))


def test_invalid_arguments_with_skipna_raise_as_without():
    # The rows that are present follow from these arguments.
    raises("measurements\\[0\\] must be one of symspline.measure", ss.estimate, [1], 4, "r:1", skipna=True)
    raises("vectors must be an array of numbers", ss.rotations.from_rotation_vectors, "x", skipna=True)
    raises("skipna must be True or False", ss.PiecewiseGeodesic, None, np.eye(3), "r:3", skipna=np.zeros(0))

"""Uncleaned recordings: every function gives the result for data cleaned by hand, or a clear error."""

import numpy as np
import pytest
from cases import loop_over
from refused import raises

import symspline as ss
from symspline.cli import main

EPOCH = 1.7e9


def path(t):
    """A smooth path on the sphere."""
    t = np.asarray(t, float)
    lon, lat = 0.3 * t, 0.4 * np.sin(0.5 * t)
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], -1)


def irregular(n=60):
    return np.cumsum(np.random.default_rng(0).uniform(0.05, 0.4, n))


T = irregular()
P = path(T)


def at_knots(spline):
    return spline(spline.t)


def by_fit(t, points):
    velocities, _ = ss.fit(t, points, "sphere:2")
    return ss.evaluate(t, points, velocities, "sphere:2", t)


def by_xarray(t, points):
    xr = pytest.importorskip("xarray")
    import symspline.xarray

    da = xr.DataArray(points, dims=("time", "q"), coords={"time": t})
    ds = symspline.xarray.fit(da, "sphere:2", on_failure="raise")
    return symspline.xarray.evaluate(ds, np.asarray(t)).values


def by_command_line(t, points):
    np.savez("a.npz", t=t, points=points)
    if main(["fit", "a.npz", "--space", "sphere:2", "-o", "b.npz"]):
        raise ss.ValidationError("the command line failed")
    return at_knots(ss.load("b.npz"))


ENTRIES = {
    "CubicSpline": lambda t, points: at_knots(ss.CubicSpline(t, points, "sphere:2")),
    "fit": by_fit,
    "fit_many": lambda t, points: at_knots(*ss.fit_many([(t, points)], "sphere:2")),
    "fit_segments": lambda t, points: at_knots(*ss.fit_segments(t, points, "sphere:2", max_gap=1e9)),
    "HermiteSpline": lambda t, points: at_knots(ss.HermiteSpline(t, points, np.zeros(np.shape(points)), "sphere:2")),
    "xarray": by_xarray,
    "command line": by_command_line,
}
entries = pytest.mark.parametrize("entry", ENTRIES.values(), ids=list(ENTRIES))


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


CLEAN = {
    "irregular": (T, P),
    "long": (np.arange(20_000) * 0.01, path(np.arange(20_000) * 0.01)),
    "with a gap": (np.delete(T, slice(20, 30)), np.delete(P, slice(20, 30), axis=0)),
    "single precision": (T.astype(np.float32), P.astype(np.float32)),
    "seconds since 1970": (T + EPOCH, P),
    "nanoseconds since 1970": (np.rint((T + EPOCH) * 1e9).astype(np.int64).astype("M8[ns]"), P),
    "whole nanoseconds": (np.int64(EPOCH) * 10**9 + np.rint(T * 1e9).astype(np.int64), P),
    "sorted afterwards": (T[::-1][np.argsort(T[::-1])], P[::-1][np.argsort(T[::-1])]),
}


@entries
@loop_over("kind", CLEAN)
def test_points_come_back(entry, kind):
    t, points = CLEAN[kind]
    tolerance = 1e-6 if kind == "single precision" else 1e-9
    np.testing.assert_allclose(entry(t, points), points, atol=tolerance)


def test_a_table_of_pandas_in_any_order():
    pd = pytest.importorskip("pandas")
    lon, lat = ss.geo.to_lonlat(P)
    stamps = pd.to_datetime(np.rint((T + EPOCH) * 1e3).astype(np.int64), unit="ms")
    frame = pd.DataFrame({"time": stamps, "lon": lon, "lat": lat})
    expected = ss.geo.resample(frame, "1s", time="time", max_gap=9)
    shuffled = frame.sample(frac=1, random_state=0)
    pd.testing.assert_frame_equal(ss.geo.resample(shuffled, "1s", time="time", max_gap=9), expected)
    frame.loc[5, "lat"] = np.nan
    raises(r"row 5.*dropna", ss.geo.resample, frame, "1s", time="time", max_gap=9)


def test_trajectories_with_gaps_and_huge_offsets():
    t = T + EPOCH
    turns = ss.rotations.from_rotation_vectors(np.outer(T, [0.0, 0.1, 0.3]))
    ss.poses.write_tum("a.txt", t, (turns, P))
    read, poses = ss.poses.read_tum("a.txt")
    assert np.array_equal(read, t)
    np.testing.assert_allclose(poses[:, :3, 3], P, atol=1e-15)
    with open("a.txt", "a") as file:
        file.write("1.8e9 0 0 nan 0 0 0 1\n")
    raises(rf"line {len(T) + 1}.*'tz' holds nan", ss.poses.read_tum, "a.txt")

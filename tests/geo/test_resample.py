"""Tables of positions at regular times."""

import numpy as np
import pytest
from refused import raises

import symspline as ss
from symspline import geo

pd = pytest.importorskip("pandas")


def ais(zone=None):
    """Messages of ships in disorder: one goes east, with a pause and a message twice, one north; one is lone."""
    east = np.array([0, 61, 119, 119, 185, 3900, 3960, 4021])
    north = np.array([30, 90, 151])
    rows = pd.DataFrame(
        {
            "mmsi": [211] * len(east) + [244] * len(north) + [999],
            "when": pd.Timestamp("2026-03-01 06:00", tz=zone) + pd.to_timedelta([*east, *north, 7], unit="s"),
            "lon": [*(1e-4 * east), *(0 * north + 5.0), 1.0],
            "lat": [*(0.0 * east), *(50 + 1e-4 * north), 1.0],
        }
    )
    return rows.sample(frac=1, random_state=3)


@pytest.mark.filterwarnings("ignore:.* tracks are not in the result:UserWarning")
@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_tracks_at_full_minutes(zone):
    found = geo.resample(ais(zone), "1min", by="mmsi", time="when", max_gap=600, duplicates="first")
    assert list(found.columns) == ["mmsi", "when", "lon", "lat", "sog", "cog", "quality"]
    minutes = (found["when"] - pd.Timestamp("2026-03-01 06:00", tz=zone)) / pd.Timedelta("1min")
    east = found["mmsi"] == 211
    assert sorted(minutes[east]) == [0, 1, 2, 3, 65, 66, 67]
    assert sorted(minutes[found["mmsi"] == 244]) == [1, 2]
    assert set(found["mmsi"]) == {211, 244}
    np.testing.assert_allclose(found["lon"][east], 1e-4 * 60 * minutes[east], atol=1e-9)
    off = found["cog"] - np.where(east, 90, 0)
    np.testing.assert_allclose((off + 180) % 360, 180, atol=1e-6)
    np.testing.assert_allclose(found["sog"], np.radians(1e-4) * geo.EARTH_RADIUS, rtol=1e-6)


def test_it_is_the_curve_itself():
    rng = np.random.default_rng(0)
    table = pd.DataFrame(
        {"lon": 10 + rng.uniform(0, 1, 8).cumsum(), "lat": 40 + rng.uniform(-1, 1, 8).cumsum()},
        index=pd.date_range("2026-01-01", periods=8, freq="7h"),
    )
    found = geo.resample(table, "90min", max_gap=np.timedelta64(1, "D"), bc_type="not-a-knot")
    spline = ss.CubicSpline(table.index, geo.from_lonlat(table["lon"], table["lat"]), "sphere:2", bc_type="not-a-knot")
    lon, lat = geo.to_lonlat(spline(found["time"].to_numpy()))
    np.testing.assert_array_equal(found["lon"], lon)
    np.testing.assert_array_equal(found["lat"], lat)
    assert len(found) == 49 * 60 // 90 + 1
    none = geo.resample(table[:0], "90min", max_gap=60)
    assert list(none.columns) == ["time", "lon", "lat", "sog", "cog", "quality"] and len(none) == 0


def test_noisy_tracks_are_smoothed():
    rng, t = np.random.default_rng(0), np.arange(200)
    lon, lat = 179 + t / 50, 10 + np.sin(t / 40)
    noisy = pd.DataFrame(
        {"lon": lon + 0.02 * rng.standard_normal(200), "lat": lat + 0.02 * rng.standard_normal(200)},
        index=pd.date_range("2026-01-01", periods=200, freq="10min"),
    )
    smooth = geo.resample(noisy, "10min", max_gap=3600, smooth=True)
    rough = geo.resample(noisy, "10min", max_gap=3600)
    off = [np.sqrt(np.mean((found["lat"] - lat) ** 2)) for found in (smooth, rough)]
    assert len(smooth) == 200 and off[0] < 0.4 * off[1]
    assert smooth["sog"].std() < 0.3 * rough["sog"].std()
    # Two places at one time both count.
    twice = pd.concat([noisy, noisy[50:60].assign(lon=lon[50:60])])
    assert len(geo.resample(twice, "10min", max_gap=3600, smooth=True)) == 200


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
def test_smoothness_that_varies_along_a_track():
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 60, 300))
    lat = 40 + 0.3 * np.sin(0.1 * np.pi * t) + np.exp(-(((t - 30) / 1.8) ** 2) / 2) * np.sin(np.pi * (t - 30))
    when = np.datetime64("2026-01-01T00:00", "s") + (60 * t).astype("m8[s]")
    track = pd.DataFrame({"time": when, "lon": 0.02 * rng.standard_normal(300), "lat": lat})
    options = {"max_gap": 3600, "duplicates": "first", "smooth": True, "lam": "adaptive"}
    table = geo.resample(track, "1min", time="time", **options)
    points = geo.from_lonlat(track["lon"], track["lat"])
    (curve,) = ss.fit_segments(when, points, "sphere:2", **options)
    assert np.array_equal(table["lam"], curve.lam_at(table["time"].to_numpy()))
    assert table["lam"].max() > 100 * table["lam"].min()


def test_invalid_resampling_raises():
    for change, what in [
        (lambda t: {"by": "ship"}, "column 'ship' does not exist; the columns are mmsi, when, lon, lat"),
        (lambda t: {"time": "lon"}, "column 'lon' must hold dates"),
        (lambda t: {"time": None}, r"the index of frame holds no dates. Pass the column of the times: time='when'\."),
        (lambda t: {"time": "text", "frame": t.assign(text="1.2.2026 10:00")}, "column 'text' must hold .* ISO 8601"),
        (lambda t: {"interpolate": "mmsi"}, "interpolate has the column 'mmsi', but only columns of numbers"),
        (lambda t: {"interpolate": "name", "frame": t.assign(name="x")}, "interpolate has the column 'name'"),
        (lambda t: {"interpolate": "sog", "frame": t.assign(sog=1.0)}, "column 'sog' has the name of a column of the"),
        (lambda t: {"frame": pd.concat([t, t[["lon"]]], axis=1)}, "two columns with the name 'lon'"),
        (lambda t: {"frame": t.assign(when=t["when"].where(t["mmsi"] != 999))}, r"no 'when', .* \(mmsi 999\)"),
        (lambda t: {"duplicates": "raise"}, r"mmsi 211, rows in the order of time: t\[2\] and t\[3\] are both"),
        (lambda t: {"smooth": 0.5}, "smooth must be True or False, not 0.5"),
        (lambda t: {"smooth": True, "duplicates": "mean"}, "Omit duplicates='mean'"),
        (lambda t: {"smooth": True, "weights": [1]}, "resample does not support weights"),
        (lambda t: {"max_gap": 6}, "fewer than 2 positions between gaps longer than max_gap=6 seconds"),
        (
            lambda t: {"frame": t.assign(mmsi=t["mmsi"].where(t.index != 3))},
            r"no 'mmsi', the first of them row 8; drop",
        ),
        (lambda t: {"frame": t.assign(lat=100.0)}, r"lat\[0\] is 100.0, but lat must be from -90 to 90 degrees"),
        (lambda t: {"frame": t.to_numpy()}, "frame must be a pandas DataFrame"),
    ]:
        table = ais()
        usual = {"frame": table, "by": "mmsi", "time": "when", "max_gap": 600, "duplicates": "first"}
        raises(what, geo.resample, **usual | change(table))


@pytest.mark.parametrize("smooth", [False, True])
def test_rows_of_curves_that_did_not_converge_are_nan(smooth):
    rng = np.random.default_rng(2)
    table = pd.DataFrame(
        {
            "mmsi": np.repeat([211, 244], 12),
            "lon": np.concatenate([np.arange(12) * 1e-3, rng.uniform(0, 60, 12)]),
            "lat": np.concatenate([np.zeros(12), rng.uniform(-60, 60, 12)]),
        },
        index=np.tile(pd.date_range("2026-01-01", periods=12, freq="1h"), 2),
    )
    options = {"by": "mmsi", "max_gap": 86400, "smooth": smooth, "max_iter": 1 if smooth else 2}
    found = geo.resample(table, "1h", on_failure="ignore", **options)
    wild = found["mmsi"] == 244
    assert found.loc[wild, ["lon", "lat", "sog", "cog"]].isna().all(axis=None)
    assert (found["quality"][wild] == "not converged").all()
    if not smooth:
        assert (found["quality"][~wild] == "good").all() and found["lon"][~wild].notna().all()
    whose = "mmsi 244, the segment from 2026-01-01T00:00:00 on"
    with pytest.raises(ss.ConvergenceError, match=whose) as error:
        geo.resample(table[12:], "1h", **options)
    assert len(error.value.spline) == 1
    with pytest.warns(ss.ConvergenceWarning, match=whose) as warned:
        geo.resample(table[12:], "1h", on_failure="warn", **options)
    assert warned[0].filename == __file__


@pytest.mark.filterwarnings("ignore:.* tracks are not in the result:UserWarning")
def test_several_columns_tell_tracks_apart():
    table = ais().assign(trip=1)
    table = pd.concat([table, table.assign(trip=2, lat=table["lat"] + 1)])
    options = {"time": "when", "max_gap": 600, "duplicates": "first"}
    found = geo.resample(table, "1min", by=["mmsi", "trip"], **options)
    assert list(found.columns) == ["mmsi", "trip", "when", "lon", "lat", "sog", "cog", "quality"]
    for trip in (1, 2):
        alone = geo.resample(table[table["trip"] == trip], "1min", by="mmsi", **options)
        own = found[found["trip"] == trip].drop(columns="trip").reset_index(drop=True)
        assert (alone["trip"] == trip).all()
        pd.testing.assert_frame_equal(own, alone.drop(columns="trip"))
    with pytest.raises(ss.ValidationError, match="mmsi 211, trip 1, rows in the order of time"):
        geo.resample(table, by=("mmsi", "trip"), **options | {"duplicates": "raise"})
    one = geo.resample(ais(), "1min", by=["mmsi"], **options)
    pd.testing.assert_frame_equal(one, geo.resample(ais(), "1min", by="mmsi", **options))

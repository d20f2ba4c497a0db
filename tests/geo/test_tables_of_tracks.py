"""Tables as ships, animals and sensors send them, compared with one spline per track that is fitted by hand."""

import numpy as np
import pytest
from refused import raises

import symspline as ss
from symspline import geo

pd = pytest.importorskip("pandas")


NAMES = {"by": "individual-local-identifier", "time": "timestamp", "columns": ("location-long", "location-lat")}


def storks(zone=None, seed=0):
    """A download from Movebank: two animals, irregular fixes with a lost day, a sensor with gaps, rows in disorder."""
    rng, tables = np.random.default_rng(seed), []
    for number, (name, lon, lat) in enumerate([("DER AN858", 11.0, 47.7), ("Maria", 178.5, -40.0)]):
        seconds = np.cumsum(rng.uniform(600, 5400, 90))
        seconds[60:] += 86400
        east = lon + 3e-5 * seconds + 0.3 * np.sin(seconds / 2e4) + 0.003 * rng.standard_normal(90)
        table = pd.DataFrame(
            {
                "event-id": np.arange(90) + 1000 * number,
                "visible": True,
                "timestamp": pd.Timestamp("2013-08-06 09:57:03.2", tz=zone) + pd.to_timedelta(seconds, unit="s"),
                "location-long": (east + 180) % 360 - 180,
                "location-lat": lat + 0.2 * np.cos(seconds / 3e4) + 0.003 * rng.standard_normal(90),
                "external-temperature": np.where(rng.uniform(size=90) < 0.3, np.nan, 20 + seconds / 1e5),
                "individual-taxon-canonical-name": ["Ciconia ciconia", "Larus dominicanus"][number],
                "tag-local-identifier": 3000 + number,
                "individual-local-identifier": name,
            }
        )
        tables.append(table)
    return pd.concat(tables, ignore_index=True).sample(frac=1, random_state=1)


def segments(table, name, **options):
    """The splines of one animal, by hand."""
    own = table[table["individual-local-identifier"] == name].sort_values("timestamp")
    seconds = own["timestamp"].dt.tz_localize(None) if own["timestamp"].dt.tz is not None else own["timestamp"]
    times, points = seconds.to_numpy(), geo.from_lonlat(own["location-long"], own["location-lat"])
    cuts = np.flatnonzero(np.diff(times) > np.timedelta64(6, "h")) + 1
    fit = ss.make_smoothing_spline if options.pop("smooth", False) else ss.CubicSpline
    return [
        fit(t, p, "sphere:2", **options) for t, p in zip(np.split(times, cuts), np.split(points, cuts), strict=True)
    ]


@pytest.mark.parametrize("smooth", [False, True])
def test_columns_of_any_name(smooth):
    table = storks()
    found = geo.resample(table, "1h", max_gap="6h", smooth=smooth, interpolate="external-temperature", **NAMES)
    keys, errors = ["individual-local-identifier", "timestamp"], ["position_std", "sog_std", "cog_std", "lam"]
    constant = ["visible", "individual-taxon-canonical-name", "tag-local-identifier"]
    columns = [*keys, "location-long", "location-lat", "sog", "cog", *(errors if smooth else []), "quality", *constant]
    assert list(found.columns) == [*columns, "external-temperature"]
    for name, own in found.groupby("individual-local-identifier"):
        x = own["timestamp"].to_numpy()
        assert (x == x.astype("M8[h]")).all() and len(own) > 40
        splines = segments(table, name, smooth=smooth)
        assert len(splines) == 2
        for spline in splines:
            inside = (x >= spline.t[0]) & (x <= spline.t[-1])
            part = own[inside]
            hours = np.arange(spline.t[0].astype("M8[h]") + 1, spline.t[-1].astype("M8[h]") + 1, dtype="M8[h]")
            np.testing.assert_array_equal(x[inside], hours)
            lon, lat = geo.to_lonlat(spline(x[inside]))
            np.testing.assert_allclose(part["location-long"], lon, atol=1e-10)
            np.testing.assert_allclose(part["location-lat"], lat, atol=1e-10)
            if smooth:
                speed, speed_std = geo.sog(spline, x[inside], return_std=True)
                np.testing.assert_allclose(part["sog_std"], speed_std, rtol=1e-9)
                np.testing.assert_allclose(part["cog_std"], geo.cog(spline, x[inside], return_std=True)[1], rtol=1e-9)
                std = geo.EARTH_RADIUS * spline.std(x[inside])
                np.testing.assert_allclose(part["position_std"], std, rtol=1e-9)
                assert (part["lam"] == spline.lam).all()
                # The noise is 0.003 degrees per coordinate: 330 m to the north, and less to the east.
                assert std.min() > 20 and std.max() < 400
            speed = geo.sog(spline, x[inside])
            np.testing.assert_allclose(part["sog"], speed, rtol=1e-9)
        source = table[table["individual-local-identifier"] == name].set_index("timestamp").sort_index()
        known = source["external-temperature"].dropna()
        expected = np.interp(x.astype("M8[ns]").astype(int), known.index.to_numpy().astype("M8[ns]").astype(int), known)
        within = (x >= known.index[0]) & (x <= known.index[-1])
        np.testing.assert_allclose(own["external-temperature"][within], expected[within], rtol=1e-9)
        assert own["external-temperature"][~within].isna().all()
        assert (own["tag-local-identifier"] == source["tag-local-identifier"].iloc[0]).all()
    assert found["tag-local-identifier"].dtype == table["tag-local-identifier"].dtype
    assert found["quality"].dtype == "category" and (found["quality"] == "good").all()


def test_texts_and_time_zones():
    table = storks()
    texts = table.assign(timestamp=table["timestamp"].dt.strftime("%Y-%m-%d %H:%M:%S.%f"))
    expected = geo.resample(table, "1h", max_gap="6h", **NAMES)
    pd.testing.assert_frame_equal(geo.resample(texts, "1h", max_gap="6h", **NAMES), expected, check_dtype=False)
    # Whole hours of UTC are half hours in India.
    local = table.assign(timestamp=table["timestamp"].dt.tz_localize("UTC").dt.tz_convert("Asia/Kolkata"))
    zoned = geo.resample(local, "1h", max_gap=np.timedelta64(6, "h"), **NAMES)
    assert str(zoned["timestamp"].dt.tz) == "Asia/Kolkata" and (zoned["timestamp"].dt.minute == 30).all()
    np.testing.assert_array_equal(zoned["location-lat"], expected["location-lat"])
    aware = table.assign(timestamp=table["timestamp"].dt.strftime("%Y-%m-%dT%H:%M:%S.%fZ"))
    assert str(geo.resample(aware, "1h", max_gap="6h", **NAMES)["timestamp"].dt.tz) == "UTC"
    with pytest.raises(ss.ValidationError, match=r"'lon' does not exist.* Pass columns=\(longitude, latitude\)"):
        geo.resample(table, "1h", time="timestamp", max_gap="6h")


def test_other_columns_are_kept_where_they_are_constant():
    times = pd.date_range("2026-03-01", periods=6, freq="10min", tz="UTC")
    ships = pd.DataFrame(
        {
            "mmsi": pd.Categorical(np.repeat([211, 244], 6), [999, 244, 211]),
            "trip": np.tile([1, 1, 1, 2, 2, 2], 2),
            "t": np.tile(times, 2),
            "lon": np.linspace(5, 6, 12),
            "lat": np.linspace(50, 49, 12),
            "sog": 7.0,
            "name": [None, "Ida", None, "Ida", None, None, "Bo", *[None] * 5],
            "flag": pd.array([1, None, 1] * 4, dtype="Int64"),
            "heading": np.arange(12),
            "status": ["under way", "moored", "moored"] * 4,
            "route": [[1, 2]] * 12,
            "draught": np.repeat([4.5, 6.0], 6),
        }
    )
    found = geo.resample(ships, "5min", by=["mmsi", "trip"], time="t", max_gap=3600)
    kept = ["name", "flag", "draught"]
    assert list(found.columns) == ["mmsi", "trip", "t", "lon", "lat", "sog", "cog", "quality", *kept]
    assert found["mmsi"].dtype == ships["mmsi"].dtype and found["flag"].dtype == "Int64" and (found["sog"] > 20).all()
    assert found.groupby(["mmsi", "trip"], observed=True)["draught"].first().tolist() == [6.0, 6.0, 4.5, 4.5]
    names = found.groupby(["mmsi", "trip"], observed=True)["name"].agg(list)
    assert set(names[(211, 1)]) == set(names[(211, 2)]) == {"Ida"} and pd.isna(names[(244, 2)]).all()
    more = geo.resample(ships, "5min", by=["mmsi", "trip"], time="t", max_gap=3600, interpolate=["heading"])
    np.testing.assert_allclose(more["heading"], np.r_[0:2.1:0.5, 3:5.1:0.5, 6:8.1:0.5, 9:11.1:0.5])


def test_repeated_times_are_averaged_in_other_columns():
    times = pd.to_datetime(["2026-01-01 00:00", "2026-01-01 00:10", "2026-01-01 00:10", "2026-01-01 00:20"])
    table = pd.DataFrame({"lon": [0, 1, 1, 2.0], "lat": 0.0, "depth": [0.0, 10, 20, 30]}, index=times)
    found = geo.resample(table, "5min", max_gap=3600, duplicates="mean", interpolate="depth")
    assert found["depth"].tolist() == [0, 7.5, 15, 22.5, 30]


def test_straight_tracks_are_marked_and_messages_name_the_track():
    table = storks()
    lost = table.copy()
    lost.iloc[7, lost.columns.get_loc("location-lat")] = np.nan
    owner = lost["individual-local-identifier"].iloc[7]
    raises(rf"row 7 \(individual-local-identifier {owner}\)", lambda: geo.resample(lost, "1h", max_gap="6h", **NAMES))
    wrong = table.assign(**{"location-lat": table["location-lat"].where(table["event-id"] != 1003, 93.0)})
    with pytest.raises(ss.ValidationError, match=r"identifier Maria, rows in the order of time: lat\[3\] is 93"):
        geo.resample(wrong, "1h", max_gap="6h", **NAMES)
    rng = np.random.default_rng(1)
    index = pd.date_range("2026-01-01", periods=100, freq="1min")
    straight = pd.DataFrame(
        {"lon": 5 + 1e-4 * rng.standard_normal(100), "lat": 50 + 1e-3 * np.arange(100)}, index=index
    )
    straight = straight.assign(mmsi=211)
    with pytest.warns(ss.SmoothingWarning, match="mmsi 211, the segment from 2026-01-01T00:00:00 on"):
        found = geo.resample(straight, "10min", by="mmsi", max_gap=600, smooth=True)
    assert (found["quality"] == "lam at bound").all() and found["sog_std"].between(0, 1).all()

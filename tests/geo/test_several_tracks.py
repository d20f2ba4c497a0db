"""Tables and maps of several tracks: forgotten names, tracks without rows, headings, pictures."""

import warnings

import numpy as np
import pytest

import symspline as ss

pd = pytest.importorskip("pandas")


def track(name, lon, lat, n=30, minutes=0, **columns):
    t = pd.date_range("2024-05-01 03:20", periods=n, freq="20min") + pd.Timedelta(minutes=minutes)
    s = np.arange(n)
    return pd.DataFrame({"when": t, "animal": name, "lon": lon + 0.01 * s, "lat": lat + 0.005 * np.sin(s), **columns})


def resampled(frame, every="15min", **options):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = ss.geo.resample(frame, every, time="when", max_gap="2h", **options)
    return found, [str(own.message) for own in caught]


@pytest.mark.parametrize("seed", range(5))
def test_merged_tracks_warn(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 5))
    each = [
        track(f"no {i}", *rng.uniform([-170, -60], [170, 60]), n=int(rng.integers(10, 40)), minutes=3 + 4 * i)
        for i in range(count)
    ]
    table = pd.concat(each).sample(frac=1, random_state=seed)
    _, said = resampled(table)
    assert ["Pass by='animal'" in own for own in said if "several tracks" in own] == [True]
    numbered = table.drop(columns="animal").assign(mmsi=table.animal.factorize()[0] + 211000000)
    assert "by='mmsi'" in " ".join(resampled(numbered)[1])
    for options in ({"by": "animal"}, {"by": []}):
        assert not [own for own in resampled(table, **options)[1] if "several tracks" in own]


def test_labels_along_one_track_do_not_warn():
    one = track("A", 10.0, 50.0, n=60)
    states = np.repeat(["rest", "fly", "rest", "feed"], 15)
    assert resampled(one.assign(state=states, quality=["a", "b"] * 30, tag_voltage=3.7))[1] == []
    # One after the other.
    both = pd.concat([one, track("B", 10.6, 50.0, minutes=1200)])
    assert resampled(both)[1] == []


def test_tracks_without_rows_are_named():
    table = pd.concat([track("A", 10.0, 50.0), track("B", 20.0, 50.0, n=1), track("C", 30.0, 50.0, n=3)])
    found, said = resampled(table, "2h", by="animal")
    assert set(found.animal) == {"A", "C"} and said == [
        "1 of 3 tracks are not in the result: animal B (1 position, but min_points=2)"
    ]
    _, said = resampled(table, "1D", by="animal")
    assert "3 of 3" in said[0] and "animal A (no multiple of every=" in said[0]
    found, said = resampled(track("A", 10.0, 50.0), "7D")
    assert len(found) == 0 and "the track is not in the result: no multiple of every='7D'" in said[0]
    gaps = track("D", 0.0, 0.0, n=8).assign(when=lambda d: d.when + pd.to_timedelta(5 * np.arange(8), "h"))
    _, said = resampled(pd.concat([table, gaps]), by="animal")
    assert "animal D (fewer than min_points=2 positions between gaps" in said[0]


@pytest.mark.parametrize("name", ["heading", "Course", "wind_direction", "cog_deg", "magnetic heading", "yaw"])
def test_headings_are_interpolated_along_the_shorter_arc(name):
    rng = np.random.default_rng(1)
    angles = np.cumsum(rng.uniform(-60, 60, 30)) + 340
    for shown in (angles % 360, (angles + 180) % 360 - 180):
        found, _ = resampled(track("A", 10.0, 50.0, **{name: shown}), interpolate=name)
        seconds = [(t - pd.Timestamp("2024-05-01 03:20")).total_seconds() for t in found.when]
        expected = np.interp(seconds, 1200 * np.arange(30), angles)
        off = found[name].to_numpy() - expected
        assert np.abs((off + 180) % 360 - 180).max() < 1e-9
        assert found[name].between(*((0, 360) if shown.min() >= 0 else (-180, 180))).all()


def test_other_columns_are_not_angles():
    depth = np.where(np.arange(30) % 2, 10.0, 350.0)
    found, _ = resampled(track("A", 10.0, 50.0, depth=depth), "10min", interpolate="depth")
    assert found.depth[1] == pytest.approx(180)
    far = np.where(np.arange(30) % 2, 10.0, 3500.0)
    assert resampled(track("A", 10.0, 50.0, course=far), "10min", interpolate="course")[0].course[1] == pytest.approx(
        1755
    )


def test_a_second_track_on_one_globe_names_the_function():
    track = ss.CubicSpline(None, ss.geo.from_lonlat([0, 10, 20], [40, 45, 40]), "sphere:2")
    axes = ss.geo.plot(track).axes[0]
    with pytest.raises(ss.ValidationError, match=r"symspline\.geo\.plot\(\[first, second\], ax=ax\)"):
        ss.geo.plot(track, ax=axes)

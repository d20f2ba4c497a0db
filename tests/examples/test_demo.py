"""The demo: storm tracks on a globe."""

import csv
import sys

import demo
import hurdat
import numpy as np
import pytest
import tracks

import symspline as ss
from symspline.geo import from_lonlat

HOUR = np.timedelta64(1, "h")


@pytest.fixture(scope="module")
def storms():
    return [storm.spaced(HOUR) for storm in hurdat.read_sample()]


@pytest.fixture(scope="module")
def splines(storms):
    return tracks.fit_tracks(storms)


def test_sample_is_read_completely():
    sample = hurdat.read_sample()
    assert len(sample) == len({storm.label for storm in sample}) == 37 and sum(map(len, sample)) == 1073
    ida = next(storm for storm in sample if storm.label == "Ida 2021")
    assert ida.key == "AL092021"
    landfall = np.flatnonzero(ida.times == np.datetime64("2021-08-29T16:55"))
    assert ida.lat[landfall] == 29.1 and ida.lon[landfall] == -90.2


def test_hemispheres_and_times():
    (storm,) = hurdat.parse(
        "SH012021, SOUTH, 2,\n20210101, 0000, , TS, 10.5S, 179.5E, 0\n20210101, 0630, , TS, 1.0N, 0.5W, 0"
    )
    assert storm.lat.tolist() == [-10.5, 1.0] and storm.lon.tolist() == [179.5, -0.5]
    assert storm.times[1] - storm.times[0] == np.timedelta64(390, "m")


def test_only_extra_fixes_close_to_another_are_dropped(storms):
    for before, after in zip(hurdat.read_sample(), storms, strict=True):
        assert np.diff(after.times).min() >= HOUR
        left_out = before.times[~np.isin(before.times, after.times)]
        assert (left_out.astype(int) % 360 > 0).all()  # in minutes: none is a six-hourly fix
    assert sum(map(len, storms)) == 1064


def test_tracks_are_twice_continuously_differentiable(storms, splines):
    for storm, spline in zip(storms, splines, strict=True):
        row = tracks.summary(storm, spline)
        assert spline.report.converged
        assert max(row.jumps[:2]) < 1e-12 and row.jumps[2] < 1e-11
        assert 10 < row.mean_speed <= row.top_speed < 1.2 * row.mean_speed < 140
        assert spline.t[0] <= row.top_time <= spline.t[-1]


def test_demo_writes_its_files(tmp_path, capsys):
    assert demo.main(["--out", str(tmp_path / "new" / "folder")]) == 0
    folder = tmp_path / "new" / "folder"
    text = capsys.readouterr().out
    assert text.isascii()
    assert "37 storms, 1073 fixes; 9 landfalls" in " ".join(text.split())
    with (folder / "tracks.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    with np.load(folder / "tracks.npz") as arrays:
        assert list(arrays) == list(rows[0]) == ["storm", "time", "lon", "lat", "speed_kmh"]
        assert len(rows) == len(arrays["time"]) == 6007
        np.testing.assert_array_equal([row["storm"] for row in rows], arrays["storm"])
        np.testing.assert_array_equal(np.array([row["time"] for row in rows], "datetime64[m]"), arrays["time"])
        for name, error in (("lon", 6e-6), ("lat", 6e-6), ("speed_kmh", 6e-4)):
            np.testing.assert_allclose([float(row[name]) for row in rows], arrays[name], rtol=0, atol=error)
        own = arrays["storm"] == "Gaston 2022"
        spline = ss.load(folder / "gaston-2022.npz")
        points = from_lonlat(arrays["lon"][own], arrays["lat"][own])
        np.testing.assert_allclose(spline(arrays["time"][own]), points, atol=1e-13)
    for name in ("tracks", "three-points", "c2"):
        picture = (folder / f"{name}.png").read_bytes()
        assert picture.startswith(b"\x89PNG") and len(picture) > 50_000


def test_demo_without_matplotlib(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    demo.run(tmp_path)
    assert "pip install 'symspline[plot]'" in capsys.readouterr().out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["gaston-2022.npz", "tracks.csv", "tracks.npz"]

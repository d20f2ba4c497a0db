"""`symspline resample`, the digits of samples, and lines in GeoJSON."""

import json
from pathlib import Path

import numpy as np
import pytest
from tabular import PAIR, TRACK, numbers, table, write

import symspline as ss


def test_resample_fits_and_samples(run, fails):
    write("a.csv", TRACK)
    run("fit a.csv --lonlat --bc-type not-a-knot -o a.npz")
    run("sample a.npz --every 1h --nu 0,1 -o b.csv")
    out = run("resample a.csv --lonlat --bc-type not-a-knot --every 1h --nu 0,1 -o c.csv")
    assert out.splitlines()[0].startswith("1 curve through 4 points of sphere:2") and out.endswith("c.csv: 19 rows\n")
    assert Path("c.csv").read_bytes() == Path("b.csv").read_bytes()
    write("pair.csv", PAIR)
    run("resample pair.csv --space s:2 --curve id --every 0.5 -o '{curve}.csv'")
    assert len(table("a.csv")["t"]) == 7 and len(table("b.csv")["t"]) == 3
    assert "is required" in fails("resample pair.csv --space s:2 -o d.csv")
    assert "it is an input" in fails("resample pair.csv --space s:2 --curve id -n 3 -o pair.csv")


def test_text_has_two_decimals_more_than_the_data(run):
    write("a.csv", "t,lon,lat,note\n0,7.12345,46.5,\n1,7.25,46.75,\n3,7.5,47.012345678,\n")
    run("fit a.csv --lonlat --columns lon,lat -o a.npz")
    curve = ss.load("a.npz")
    lon, lat = ss.geo.to_lonlat(curve([0, 1.5, 3]))
    run("sample a.npz --every 1.5 --nu 0,1 -o b.csv")
    columns = table("b.csv")
    assert columns["lon"] == ["7.12345", str(round(lon[1], 7)), "7.5"]
    assert columns["lat"] == ["46.5", str(round(lat[1], 11)), "47.012345678"]
    assert all(len(cell) <= 16 for cell in columns["east_d1"])
    # Other formats, and --digits 17, have all.
    run("sample a.npz --every 1.5 --digits 17 -o c.csv")
    run("sample a.npz --every 1.5 -o c.npz")
    np.testing.assert_array_equal(numbers(table("c.csv"), "lon", "lat"), np.stack([lon, lat], axis=1))
    np.testing.assert_array_equal(np.load("c.npz")["lat"], lat)


def test_few_decimals_are_no_sign_of_low_accuracy(run):
    write("a.csv", "t,x,y\n0,1,0\n1,0,1\n2,-1,0\n")
    run("resample a.csv --space s:1 -n 9 -o b.csv")
    found = numbers(table("b.csv"), "x", "y")
    np.testing.assert_allclose(np.hypot(*found.T), 1, atol=1e-8)
    assert table("b.csv")["x"][1] == "0.92387953"


def test_data_with_all_decimals_are_sampled_with_all(run):
    write("a.csv", "t,x\n0,0.1\n1,0.3333333333333333\n2,1\n")
    run("resample a.csv --space r:1 -n 4 -o b.csv")
    curve = ss.CubicSpline([0, 1, 2], [[0.1], [1 / 3], [1]], "r:1")
    t = numbers(table("b.csv"), "t")[:, 0]
    np.testing.assert_array_equal(numbers(table("b.csv"), "x"), curve(t))


def test_lines_in_geojson(run, fails):
    write("a.csv", TRACK)
    run("resample a.csv --lonlat --every 6h --lines -o b.geojson")
    (feature,) = json.loads(Path("b.geojson").read_text())["features"]
    assert feature["geometry"]["type"] == "MultiLineString"
    assert [[place[0] for place in part] for part in feature["geometry"]["coordinates"]] == [
        [178.5],
        [-179.0, -177.0, -176.2],
    ]
    assert feature["properties"]["coordTimes"][0] == ["2021-08-29T00:00:00Z"]
    run("fit a.csv --lonlat -o a.npz")
    run("fit b.geojson -o b.npz")
    np.testing.assert_allclose(ss.load("b.npz").points, ss.load("a.npz").points, atol=1e-9)
    rows = [f"{t},{name},{lon},50" for name, lon in (("a", 5), ("b", 6)) for t in range(3)]
    write("two.csv", "t,id,lon,lat\n" + "\n".join(rows) + "\n")
    run("resample two.csv --lonlat --curve id -n 4 --lines -o two.geojson")
    run("fit two.geojson -o two.npz")
    assert list(ss.load("two.npz")) == ["a", "b"]
    assert "--lines is for GeoJSON" in fails("resample two.csv --lonlat --curve id -n 4 --lines -o c.csv")
    assert "omit --nu" in fails("resample two.csv --lonlat --curve id -n 4 --lines --nu 0,1 -o c.geojson")


@pytest.mark.parametrize("ending", ["csv", "json", "npz"])
def test_heights_and_noise_have_their_columns(run, ending):
    rng, t = np.random.default_rng(1), np.arange(40)
    rows = zip(t, 5 + 0.01 * t, 50 + 0.001 * rng.standard_normal(40), rng.standard_normal(40), strict=True)
    write("a.csv", "t,lon,lat,ele\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    run(f"resample a.csv --lonlat --smooth -n 3 -o b.{ending}", notes=None)
    if ending == "csv":
        assert list(table("b.csv")) == ["t", "lon", "lat", "ele", "std1", "std2"]

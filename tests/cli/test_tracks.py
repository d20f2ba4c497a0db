"""Tracks stay separate, files of positions and poses need no space, and positions keep their heights."""

import json
from pathlib import Path

import numpy as np
import pytest
from tabular import numbers, table, write

import symspline as ss
from symspline.geo import from_lonlat


def gpx(*tracks):
    """A GPX file of tracks: a name, and segments of positions with heights, one per minute."""
    text, minute = '<gpx xmlns="http://www.topografix.com/GPX/1/1" version="1.1" creator="a">', 0
    for name, *segments in tracks:
        text += f"<trk><name>{name}</name>"
        for segment in segments:
            text += "<trkseg>"
            for lon, lat, *height in segment:
                ele = f"<ele>{height[0]}</ele>" if height else ""
                text += f'<trkpt lat="{lat}" lon="{lon}">{ele}<time>2024-01-01T00:{minute:02}:00Z</time></trkpt>'
                minute += 1
            text += "</trkseg>"
        text += "</trk>"
    return text + "</gpx>"


A = [(5, 50, 100), (5.1, 50.1, 120), (5.3, 50.1, 110)]
B = [(5, 60, 0), (5.1, 60.1, 5), (5.3, 60.1, 0)]
TIMES = [f"2024-01-01T0{i}:00:00Z" for i in range(4)]
EAST, WEST = [[178, 10], [179, 11]], [[-179, 12], [-178, 13]]
HEIGHTS = "t,lon,lat,ele\n0,7,46,500\n1,7.1,46.1,900\n2,7.2,46.1,700\n"


def feature(kind, coordinates, **properties):
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": kind, "coordinates": coordinates},
    }


def collection(*features):
    return json.dumps({"type": "FeatureCollection", "features": features})


def test_tracks_of_a_gpx_file_are_curves_of_their_own(run):
    pytest.importorskip("gpxpy")
    write("a.gpx", gpx(("run", A), ("run", B), ("walk", A, B, [(1, 2, 3)])))
    out = run("fit a.gpx -o a.npz", notes=True)
    assert "a.gpx: 1 track of one point omitted: walk/3\n" in out
    assert "a.gpx: 4 tracks, each of which becomes a curve; --curve none makes one curve of them\n" in out
    curves = ss.load("a.npz")
    assert list(curves) == ["run", "run (2)", "walk/1", "walk/2"]
    lon, lat, height = np.array(B, float).T
    positions, heights = curves["run (2)"].points
    np.testing.assert_allclose(positions, from_lonlat(lon, lat), atol=1e-15)
    np.testing.assert_array_equal(heights[:, 0], height)
    assert len(run("sample a.npz -n 2 -o -").splitlines()) == 1 + 8 + 1
    assert "fit makes one curve per track" in run("info a.gpx", notes=True)
    run("fit a.gpx --curve none -o b.npz", notes=True)
    assert len(ss.load("b.npz").t) == 12


def test_one_track_needs_no_name(run):
    pytest.importorskip("gpxpy")
    write("a.gpx", gpx(("run", A)))
    assert "tracks" not in run("fit a.gpx -o a.npz")
    assert isinstance(ss.load("a.npz"), ss.CubicSpline)


@pytest.mark.parametrize("times", [[TIMES[:2], TIMES[2:]], TIMES], ids=["nested", "flat"])
def test_a_line_that_is_split_at_the_date_line_is_one_track(run, times):
    write("a.geojson", collection(feature("MultiLineString", [EAST, WEST], coordTimes=times)))
    run("fit a.geojson -o a.npz")
    curve = ss.load("a.npz")
    assert [str(t)[11:13] for t in curve.t] == ["00", "01", "02", "03"]
    np.testing.assert_allclose(curve.points, from_lonlat(*np.array([*EAST, *WEST], float).T), atol=1e-15)
    # RFC 7946 adds the point on the date line to both parts.
    cut = [[*EAST, [180, 11.5]], [[-180, 11.5], *WEST]]
    write("b.geojson", collection(feature("MultiLineString", cut)))
    run("fit b.geojson -o b.npz")
    assert len(ss.load("b.npz").t) == 5


def test_other_parts_of_a_line_are_tracks(run):
    parts = [EAST, [[10, 50], [11, 51]]]
    write("a.geojson", collection(feature("MultiLineString", parts, name="x", coordTimes=[TIMES[:2], TIMES[2:]])))
    run("fit a.geojson -o a.npz")
    assert list(ss.load("a.npz")) == ["x/1", "x/2"]


def test_names_in_blocks_are_suggested(run):
    """The tracks are long beside the way between them."""
    rows = [f"{i},{name},{i},50" for i, name in enumerate("aaaaabbbbb")]
    write("a.csv", "time,trip,lon,lat\n" + "\n".join(rows) + "\n")
    said = run("fit a.csv --lonlat -o a.npz", notes=True)
    assert "column 'trip' has one block of rows for each of its values" in said and "--curve trip" in said
    assert "--curve trip fits one curve per trip" in run("info a.csv")
    run("fit a.csv --lonlat --curve trip -o b.npz")


def test_a_single_long_step_is_reported(run):
    lon = [*range(0, 8), *range(90, 98)]
    write("a.csv", "time,lon,lat\n" + "".join(f"{i},{x},50\n" for i, x in enumerate(lon)))
    said = run("fit a.csv --lonlat -o a.npz", notes=True)
    assert "the step from line 9 to line 10 is " in said and "give a column of their names with --curve" in said
    # The same step takes its time.
    times = np.arange(16) + 80 * (np.arange(16) > 7)
    write("b.csv", "time,lon,lat\n" + "".join(f"{t},{x},50\n" for t, x in zip(times, lon, strict=True)))
    run("fit b.csv --lonlat -o b.npz")


@pytest.mark.parametrize(
    "head, space",
    [
        ("lon_deg,lat_deg", "sphere:2"),
        ("Longitude (deg),Latitude (deg)", "sphere:2"),
        ("LON [°],LAT [°],Altitude [m]", "sphere:2 x euclidean:1"),
    ],
)
def test_names_of_positions_with_units(run, fails, head, space):
    rows = [f"{i},{7 + i},{50 + i * i},{i}" for i in range(3)]
    write("a.csv", f"t,{head}\n" + "\n".join(row[: None if "Alt" in head else -2] for row in rows) + "\n")
    names = head.split(",")
    says = f"a.csv: columns {names[0]} and {names[1]} look like positions on the Earth: give --lonlat"
    assert fails("fit a.csv -o a.npz") == says
    run("fit a.csv --lonlat -o a.npz")
    assert str(ss.load("a.npz").space) == space


def test_poses_need_no_space(run, fails):
    write("a.txt", "0 1 2 3 0 0 0 1\n1 1 2 4 0 0 0.6 0.8\n2 1 2 4 0 0 1 0\n")
    run("fit a.txt -o a.npz")
    assert str(ss.load("a.npz").space) == "so:3 x euclidean:3"
    write("b.csv", "t,qw,qx,qy,qz\n0,1,0,0,0\n1,0.8,0,0,0.6\n")
    assert fails("fit b.csv -o b.npz") == "b.csv: the columns look like a unit quaternion: give --space so:3"
    write("c.csv", "t,x,y,z,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n1,1,2,3,0.8,0,0,0.6\n")
    assert fails("fit c.csv -o c.npz").endswith("a position and a unit quaternion: give --space 'so:3 x r:3'")
    run("fit c.csv --space 'so:3 x r:3' -o c.npz")


def test_positions_have_heights(run):
    write("a.csv", HEIGHTS)
    run("fit a.csv --lonlat -o a.npz")
    run("fit a.csv --lonlat --columns lon,lat,ele -o b.npz")
    run("fit a.csv --lonlat --space 'sphere:2 x r:1' -o c.npz")
    curve = ss.load("a.npz")
    assert ss.load("b.npz") == curve == ss.load("c.npz")
    ground, height = from_lonlat([7, 7.1, 7.2], [46, 46.1, 46.1]), [[500.0], [900], [700]]
    assert curve == ss.CubicSpline([0, 1, 2], (ground, height), "sphere:2 x r:1")
    run("sample a.npz --every 0.5 --nu 0,1 -o b.csv")
    columns = table("b.csv")
    assert list(columns) == ["t", "lon", "lat", "ele", "east_d1", "north_d1", "ele_d1"]
    alone = ss.CubicSpline([0, 1, 2], height, "r:1")
    x = numbers(columns, "t")[:, 0]
    np.testing.assert_allclose(numbers(columns, "ele"), alone(x), rtol=1e-14)
    np.testing.assert_allclose(numbers(columns, "ele_d1"), alone(x, nu=1), rtol=1e-12, atol=1e-9)
    run("fit a.csv --lonlat --space sphere:2 -o d.npz")
    assert ss.load("d.npz") == ss.CubicSpline([0, 1, 2], ground, "sphere:2")
    run("fit a.csv --space r:1 --columns ele --time t -o f.npz")


def test_heights_that_are_missing_are_not_used(run, fails):
    write("a.csv", HEIGHTS.replace("900", ""))
    assert "heights in column ele are not used, as 1 of 3 are missing" in run("fit a.csv --lonlat -o a.npz")
    assert str(ss.load("a.npz").space) == "sphere:2"
    write("b.csv", "t,lon,lat\n0,7,46\n1,8,47\n")
    assert "needs a column of heights" in fails("fit b.csv --lonlat --space 'sphere:2 x r:1' -o b.npz")


@pytest.mark.parametrize("ending", ["gpx", "geojson"])
def test_files_of_positions_keep_heights(run, ending):
    pytest.importorskip("gpxpy")
    write("a.gpx", gpx(("run", A)))
    run("fit a.gpx -o a.npz")
    run(f"sample a.npz -n 3 -o b.{ending}")
    run(f"fit b.{ending} -o b.npz")
    first, again = ss.load("a.npz").points, ss.load("b.npz").points
    np.testing.assert_allclose(again[0], first[0], atol=1e-12)
    np.testing.assert_allclose(again[1], first[1], atol=1e-9)


def test_noise_of_positions_with_heights_has_two_units(run, fails):
    rng, n = np.random.default_rng(0), 60
    rows = np.c_[
        np.arange(n), 5 + 0.01 * rng.standard_normal(n), 50 + 0.01 * rng.standard_normal(n), np.sin(np.arange(n))
    ]
    write("a.csv", "t,lon,lat,ele\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    problem = fails("fit a.csv --lonlat --smooth --sigma 0.01 -o a.npz")
    assert "such as --sigma 0.01,5; --space sphere:2 fits positions without heights" in problem
    run("fit a.csv --lonlat --smooth --sigma 0.01,0.5 -o a.npz")
    np.testing.assert_allclose(ss.load("a.npz").sigma, [np.radians(0.01), 0.5])
    run("sample a.npz -n 3 -o b.csv")
    std = numbers(table("b.csv"), "std1", "std2")
    spread = ss.load("a.npz").std([0, 29.5, 59])
    np.testing.assert_allclose(std, np.stack([np.degrees(spread[0]), spread[1]], axis=1), rtol=1e-12)
    run("plot a.npz -o a.png")
    assert Path("a.png").stat().st_size

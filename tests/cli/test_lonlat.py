"""Tables of longitudes and latitudes."""

import numpy as np
from tabular import FIXES, TRACK, numbers, table, write

import symspline as ss
from symspline.geo import from_lonlat, to_lonlat


def test_a_track_across_the_date_line(run):
    write("a.csv", TRACK)
    run("fit a.csv --lonlat -o a.npz")
    spline = ss.load("a.npz")
    lon, lat = np.array([row[1:] for row in FIXES]).T
    np.testing.assert_allclose(spline.points, from_lonlat(lon, lat), atol=1e-15)
    run("sample a.npz --every 10min --nu 0,1,2 -o b.csv")
    columns = table("b.csv")
    assert list(columns) == ["time", "lon", "lat", "east_d1", "north_d1", "east_d2", "north_d2"]
    track = numbers(columns, "lon", "lat")
    assert (np.abs(track[:, 0]) > 175).all() and (np.abs(track[:, 0]) <= 180).all()
    assert np.count_nonzero(np.abs(np.diff(track[:, 0])) > 300) == 1
    # Differences along the curve, in degrees of arc and seconds.
    rate = numbers(columns, "east_d1", "north_d1")
    middle = np.radians(track[1:-1, 1])
    turn = (track[2:] - track[:-2] + 180) % 360 - 180
    seen = turn / 1200 * np.stack([np.cos(middle), np.ones_like(middle)], axis=1)
    np.testing.assert_allclose(rate[1:-1], seen, rtol=1e-3)
    acceleration = numbers(columns, "east_d2", "north_d2")
    assert np.abs(acceleration[[0, -1]]).max() < 1e-12 * np.abs(acceleration).max()  # natural ends


def test_lonlat_by_column_names(run, fails):
    write("a.csv", "t,b,l\n0,50,7\n1,51,8\n")
    run("fit a.csv --lonlat --columns l,b -o a.npz")
    np.testing.assert_allclose(to_lonlat(ss.load("a.npz").points), [[7, 8], [50, 51]], atol=1e-13)
    assert "--lonlat needs columns lon or lng or longitude" in fails("fit a.csv --lonlat -o b.npz")
    write("c.csv", "t,location-lat,location-long\n0,50,7\n1,51,8\n")
    run("fit c.csv --lonlat -o d.npz")
    assert ss.load("d.npz") == ss.load("a.npz")
    problem = fails("fit c.csv --lonlat --columns location-lat,location-long -o b.npz")
    assert problem == (
        "--columns location-lat,location-long: longitude comes first: --columns location-long,location-lat"
    )
    assert "longitude and latitude are 2 numbers" in fails("fit a.csv --lonlat --columns l -o b.npz")
    write("c.csv", "t,Lat,Lng\n0,50,7\n1,51,8\n")
    run("fit c.csv --lonlat -o c.npz")
    assert ss.load("c.npz") == ss.load("a.npz")
    assert "with a height, not for sphere:3" in fails("fit a.csv --lonlat --space s:3 -o b.npz")
    write("a.csv", "t,b,l\n0,50,7\n1,51,98\n")
    problem = fails("fit a.csv --lonlat --columns b,l -o b.npz")
    assert problem.startswith("a.csv, line 3: latitude 98 is not between -90 and 90 degrees")


def test_lonlat_of_a_curve_that_was_made_in_python(run, fails):
    ss.CubicSpline(None, np.eye(3), "s:2").save("a.npz")
    run("sample a.npz -n 3 -o b.csv")
    assert list(table("b.csv")) == ["time", "x0", "x1", "x2"]
    run("sample a.npz -n 3 --lonlat -o b.csv")
    np.testing.assert_allclose(numbers(table("b.csv"), "lon", "lat")[:2], [[0, 0], [90, 0]], atol=1e-13)
    ss.CubicSpline(None, [[0], [1]], "r:1").save("c.npz")
    assert fails("sample c.npz -n 3 --lonlat -o b.csv").endswith(", not for euclidean:1")

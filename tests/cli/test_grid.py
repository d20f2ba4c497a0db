"""Grids of points: ``symspline grid``."""

import io
import os
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from compare import parts

import symspline as ss
from symspline.cli import main

RNG = np.random.default_rng(3)
LAT = np.array([30.0, 31, 33, 36, 38, 39])
LON = np.linspace(0, 20, 8)


def directions(noise=0.02):
    lat, lon = np.meshgrid(LAT, LON, indexing="ij")
    sphere = ss.Sphere(2)
    points = ss.geo.from_lonlat(lon * 3 + lat, 50 * np.sin(lat / 9) * np.cos(lon / 15))
    return sphere.exp(points, noise * sphere.random_tangent(np.random.default_rng(0), points))


@pytest.fixture
def wind(run):
    points = directions()
    np.savez("wind.npz", points=points, lat=LAT, lon=LON)
    return points


def arrays(name):
    with np.load(name) as file:
        return dict(file)


def test_values_are_those_of_the_library(wind, run):
    out = run("grid wind.npz --space s:2 --bc-type natural,not-a-knot --zoom 2,3 -o fine.npz")
    assert out.startswith("fine.npz: 11 x 22 values of sphere:2, axis order gap ")
    found = arrays("fine.npz")
    assert list(found) == ["lat", "lon", "points"]
    np.testing.assert_allclose(found["lat"], np.interp(np.arange(11) / 2, np.arange(6), LAT))
    np.testing.assert_allclose(found["lon"][::3], LON)
    spline = ss.GridSpline((LAT, LON), wind, "sphere:2", bc_type=("natural", "not-a-knot"))
    np.testing.assert_array_equal(found["points"], spline.grid(found["lat"], found["lon"]))
    run("grid wind.npz --space s:2 --axes lat,lon --symmetric --points 4,5 -o fine.npz")
    found = arrays("fine.npz")
    spline = ss.GridSpline((LAT, LON), wind, "sphere:2", symmetric=True)
    np.testing.assert_array_equal(found["points"], spline.grid(np.linspace(30, 39, 4), np.linspace(0, 20, 5)))


def test_a_pipe_of_two_commands(wind):
    def process(line, given):
        command = [sys.executable, "-m", "symspline", *line.split()]
        return subprocess.run(command, input=given, capture_output=True, timeout=120)

    fitted = process("grid - --space s:2 -o -", Path("wind.npz").read_bytes())
    assert fitted.stderr.decode().startswith("standard output: a spline through 6 x 8 points of sphere:2")
    sampled = process("grid - --points 5,6 -o -", fitted.stdout)
    assert sampled.returncode == 0
    found = np.load(io.BytesIO(sampled.stdout))["points"]
    spline = ss.GridSpline((LAT, LON), wind, "sphere:2")
    np.testing.assert_array_equal(found, spline.grid(np.linspace(30, 39, 5), np.linspace(0, 20, 6)))
    damaged = process("grid - --space s:2 -o -", b"no grid")
    assert (damaged.returncode, damaged.stderr) == (2, b"symspline: standard input is not an NPZ file\n")


def test_values_at_given_positions(wind, run, fails):
    np.savez("to.npz", lon=[0.5, 19.0], lat=LAT[2:4], other=1)
    run("grid wind.npz --space s:2 --to to.npz -o out.npz")
    expected = ss.GridSpline((LAT, LON), wind, "sphere:2").grid(LAT[2:4], [0.5, 19.0])
    np.testing.assert_array_equal(arrays("out.npz")["points"], expected)
    np.savez("to.npz", lon=[0.5, 19.0])
    assert fails("grid wind.npz --space s:2 --to to.npz -o x.npz") == (
        "to.npz has no array 'lat' with one axis, the positions along 'lat'"
    )
    np.savez("to.npz", lon=[0.5, 21.0], lat=LAT)
    assert "21" in fails("grid wind.npz --space s:2 --to to.npz -o x.npz")


def test_splines_are_saved_and_sampled(wind, run, fails):
    out = run("grid wind.npz --space s:2 -o spline.npz")
    assert out.startswith("spline.npz: a spline through 6 x 8 points of sphere:2, axis order gap ")
    spline = ss.load("spline.npz")
    assert isinstance(spline, ss.GridSpline)
    run("grid spline.npz --points 5,6 -o a.npz")
    run("grid wind.npz --space s:2 --points 5,6 -o b.npz")
    a, b = arrays("a.npz"), arrays("b.npz")
    assert list(a) == list(b) == ["lat", "lon", "points"]
    np.testing.assert_array_equal(a["points"], b["points"])
    # Positions are found by the names of the axes.
    np.savez("to.npz", lat=a["lat"], lon=a["lon"])
    run("grid spline.npz --to to.npz -o c.npz")
    np.testing.assert_array_equal(arrays("c.npz")["points"], b["points"])
    os.remove("c.npz")
    np.savez("to.npz", lat=[1e6], lon=a["lon"])
    problem = fails("grid spline.npz --to to.npz -o c.npz")
    assert problem.startswith("the coordinate 1000000.0 is outside axis 0, which extends from ")
    assert "pass" not in problem
    assert run("info spline.npz").startswith(
        "spline.npz: a spline through 6 x 8 points of sphere:2; see symspline grid"
    )
    assert fails("grid spline.npz -o c.npz") == "spline.npz: this is a spline; give --to, --zoom or --points"
    assert "for which --space cannot be given" in fails("grid spline.npz --space s:2 --zoom 2 -o c.npz")
    assert fails("sample spline.npz -n 5 -o c.csv") == "spline.npz is a grid; see symspline grid --help"


def test_axes_in_another_order_than_the_points_are_named(wind, fails):
    found = arrays("wind.npz")
    np.savez("b.npz", **{name: found[name] for name in ("lon", "lat", "points")})
    problem = fails("grid b.npz --space s:2 -o c.npz")
    assert problem == (
        "b.npz: lon has 8 positions and lat has 6 positions, but the points have 6 x 8 nodes; give --axes lat,lon"
    )


def test_info_of_a_grid(wind, run):
    out = run("info wind.npz")
    assert out.startswith("wind.npz: arrays of different lengths, such as a grid; see symspline grid --help\n")
    assert "  lat: 6 numbers\n" in out
    assert "  points: 6 x 24 numbers\n" in out


def test_missing_points_and_axes_without_names(wind, run):
    points = wind.copy()
    points[2:4, 5], points[0, 0] = np.nan, np.nan
    np.savez("wind.npz", points=points.astype(np.float32))
    out = run("grid wind.npz --space sphere:2 --zoom 2 -o fine.npz")
    found = arrays("fine.npz")
    assert list(found) == ["axis0", "axis1", "points"] and "% of them missing" in out
    missing = np.isnan(found["points"]).any(axis=-1)
    assert 0 < missing.mean() < 0.5 and missing[4, 10] and missing[0, 0] and not missing[2, 2]
    np.testing.assert_allclose(found["points"][::2, ::2][2, 2], points[2, 2], atol=1e-7)


def test_dates_on_an_axis(run, fails):
    days = np.datetime64("2021-08-28", "s") + np.array([0, 6, 12, 24, 48]) * np.timedelta64(3600, "s")
    values = np.cumsum(RNG.standard_normal((5, 4, 2)), axis=0)
    np.savez("a.npz", when=days, points=values)
    assert "there are arrays 'when' for the axes" in fails("grid a.npz --space r:2 --zoom 2 -o b.npz")
    np.savez("a.npz", when=days, x=np.arange(4), points=values)
    run("grid a.npz --space r:2 --zoom 2,1 -o b.npz")
    found = arrays("b.npz")
    assert found["when"][1] == np.datetime64("2021-08-28T03:00") and found["x"].tolist() == [0, 1, 2, 3]
    expected = ss.GridSpline((days, np.arange(4.0)), values, "r:2").grid(found["when"], found["x"])
    np.testing.assert_array_equal(found["points"], expected)
    run("grid a.npz --space r:2 --points 3,2 -o b.npz")
    assert (arrays("b.npz")["when"] == days[0] + np.arange(3) * np.timedelta64(86400, "s")).all()


def test_products_have_one_array_per_factor(run):
    space = ss.space("so:3 x r:3")
    rng = np.random.default_rng(0)
    p = space.random_point(rng)
    poses = tuple(np.stack([np.stack([own] * 5)] * 4) for own in p)
    poses = space.exp(poses, tuple(0.1 * own for own in space.random_tangent(rng, poses)))
    np.savez("poses.npz", points_0=poses[0], points_1=poses[1], u=np.arange(4.0), v=np.arange(5.0))
    run("grid poses.npz --space 'so:3 x r:3' --zoom 2 -o fine.npz")
    found = arrays("fine.npz")
    expected = ss.GridSpline((None, None), poses, space).grid(found["u"], found["v"])
    for i, own in enumerate(parts(expected)):
        np.testing.assert_array_equal(found[f"points_{i}"], own)


@pytest.mark.parametrize(
    "line, problem",
    [
        ("grid wind.npz -o x.npz", "say which space the points are on with --space"),
        ("grid wind.npz --space s:2 --axes lat,lno -o x.npz", "wind.npz has no array 'lno'; did you mean 'lon'?"),
        (
            "grid wind.npz --space s:2 --axes lat -o x.npz",
            "wind.npz: there are arrays 'lat' for the axes, but the points have 2 axes",
        ),
        ("grid wind.npz --space s:3 -o x.npz", "wind.npz: 'points' has shape (6, 8, 3), which must end in (4,)"),
        (
            "grid wind.npz --space spd:3 --zoom 2 -o x.npz",
            "wind.npz: 'points' has shape (6, 8, 3), which must end in (3, 3)",
        ),
        ("grid wind.npz --space s:2 --zoom 0 -o x.npz", "--zoom 0: give numbers larger than 0, separated by commas"),
        ("grid wind.npz --space s:2 --points 3 -o x.npz", "--points 3: there are 2 axes, which need 2 numbers, not 1"),
        ("grid wind.npz --space s:2 --points 3,1 -o x.npz", "--points 3,1: give whole numbers from 2 on"),
        ("grid wind.npz --space s:2 --zoom 2 --points 3,3 -o x.npz", "argument --points: not allowed with"),
        ("grid wind.npz --space s:2 --bc-type guess -o x.npz", "--bc-type guess: give not-a-knot, natural"),
        ("grid wind.npz --space s:2 --variable q -o x.npz", "--variable is not for .npz files"),
        ("grid wind.npz --space s:2 --zoom 2 -o x.zarr", "x.zarr: values of a .npz file are written to such a file"),
        (
            "grid wind.npz --space s:2 -o x.csv",
            "x.csv: the name of a grid must end in .npz or .zarr",
        ),
        ("grid none.npz --space s:2 -o x.npz", "cannot read none.npz: No such file or directory"),
        ("grid none.zarr --space s:2 --zoom 2 -o x.zarr", "cannot read none.zarr: No such file or directory"),
        ("grid wind.npz --space s:2 --zoom 2 -o no/x.npz", "cannot write no/x.npz: there is no folder no"),
    ],
)
def test_invalid_usage_fails(wind, fails, line, problem):
    assert fails(line).startswith(problem)


def test_points_off_the_space_fail(wind, fails, run):
    np.savez("a.npz", points=np.float32(wind))
    run("grid a.npz --space s:2 --zoom 2 -o b.npz")
    wind[3, 2] *= 1.1
    np.savez("a.npz", points=wind)
    problem = fails("grid a.npz --space s:2 --zoom 2 -o c.npz")
    assert "3" in problem and "space.project" not in problem
    np.savez("c.npz", curve=wind[0])
    assert fails("grid c.npz --space s:2 -o d.npz").startswith("c.npz has no array 'points' of points")


def test_points_that_are_far_apart_are_noted(run):
    np.savez("a.npz", points=ss.geo.from_lonlat(*np.meshgrid(150 * np.arange(6), np.arange(3.0))))
    notes = run("grid a.npz --space s:2 --zoom 2 -o b.npz", notes=True)
    assert "symspline: more than half of the steps" in notes and "Warning" not in notes


def test_progress_on_a_terminal(wind, capsys, monkeypatch):
    monkeypatch.setattr("symspline.cli._messages._WAIT", 0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert main(shlex.split("grid wind.npz --space s:2 --zoom 3 -o b.npz")) == 0
    assert "%" in capsys.readouterr().err

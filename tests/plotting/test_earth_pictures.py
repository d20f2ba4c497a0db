"""Pictures of tracks on the Earth: land, scale and units."""

from itertools import pairwise

import numpy as np
import pytest
from drawn import axes_named, dots_of, rendered, texts_of
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.transforms import Affine2D
from refused import raises

import symspline as ss
from symspline import geo

DATES = np.datetime64("2024-05-01T08:00") + np.arange(9).astype("m8[h]")
U = np.linspace(0, 1, 9)
FLIGHT = geo.from_lonlat([0, -74, -46.6, 28, 103.8, 139.7], [51.5, 40.7, -23.5, -26.2, 1.35, 35.7])


def track(lon, lat, size, times=DATES):
    return ss.CubicSpline(times, geo.from_lonlat(lon + size * U, lat + size * np.sin(2 * U)), "sphere:2")


def windings(polygons, points):
    """How often polygons go counterclockwise round points, by the crossings of rays to the right."""
    total = np.zeros(len(points), int)
    x, y = points.T
    for ring in polygons:
        for (x0, y0), (x1, y1) in pairwise(ring):
            if y0 != y1:
                crossed = (y >= min(y0, y1)) & (y < max(y0, y1)) & (x < x0 + (y - y0) / (y1 - y0) * (x1 - x0))
                total += np.where(crossed, 1 if y1 > y0 else -1, 0)
    return total


def test_land_contains_known_positions():
    """On the map, and on the near side of the globe."""
    figure = rendered(geo.plot(ss.CubicSpline(None, FLIGHT, "sphere:2")))
    dry = [(2.3, 48.9), (-100, 40), (134, -25), (25, 0), (90, -80), (-42, 72), (100, 60), (-60, -10)]
    wet = [(-30, 30), (-150, 0), (80, -30), (0, 80), (51, 42), (5, 38), (-89, 25), (-170, -60)]
    (land,) = land_of(axes_named(figure, "map"))
    for positions, number in ((dry, 1), (wet, 0)):
        assert (windings(land.get_path().to_polygons(), np.array(positions)) == number).all()
    # The view of the globe is that which projects the points of the curve to their dots.
    axes = figure.axes[0]
    (land,) = land_of(axes)
    places, _ = dots_of(axes)
    view = np.linalg.lstsq(FLIGHT, places)[0]
    up = np.cross(*view.T)
    polygons = land.get_path().to_polygons(Affine2D().scale(1e4))
    for positions, number in ((dry, True), (wet, False)):
        points = geo.from_lonlat(*np.transpose(positions))
        seen = points[points @ up > 0.15]
        assert len(seen) > 2 and ((windings(polygons, 1e4 * seen @ view) != 0) == number).all()


def land_of(axes):
    return [own for own in axes.get_children() if isinstance(own, PathPatch) and own.get_label() == "_land"]


@pytest.mark.parametrize("size, has_land, length", [(12.0, True, "200 km"), (0.01, False, "200 m")])
def test_local_tracks_are_enlarged(size, has_land, length):
    figure = rendered(geo.plot(track(5, 40, size)))
    frame = figure.axes[0]
    assert bool(land_of(frame)) == has_land
    # The frame is filled by the track.
    line = next(
        line.get_xydata()
        for line in frame.lines
        if len(line.get_xdata()) > 1000 and np.isfinite(line.get_xydata()).all()
    )
    low, high = line.min(axis=0), line.max(axis=0)
    limits = np.array([frame.get_xlim(), frame.get_ylim()])
    assert (low > limits[:, 0]).all() and (high < limits[:, 1]).all()
    assert ((high - low) / np.ptp(limits, axis=1)).max() == pytest.approx(1 / 1.22)
    # The bar is as long as it says.
    (bar,) = [line.get_xdata() for line in frame.lines if line.get_label() == "_scale"]
    number, unit = length.split()
    assert np.ptp(bar) * geo.EARTH_RADIUS == pytest.approx(float(number) * {"m": 1, "km": 1000}[unit])
    assert length in texts_of(figure)


def test_speed_is_in_kilometres_per_hour():
    spline = track(5, 40, 2.0)
    figure = rendered(geo.plot(spline))
    speed, acceleration = axes_named(figure, "speed"), axes_named(figure, "acceleration")
    assert speed.get_ylabel() == "speed\nkm/h" and acceleration.get_ylabel() == "acceleration\nm/s²"
    x = np.linspace(0, 28800, 5)
    at = DATES[0] + x.astype("m8[s]")
    drawn = np.interp(
        x, 86400 * (speed.lines[0].get_xdata() - speed.lines[0].get_xdata()[0]), speed.lines[0].get_ydata()
    )
    np.testing.assert_allclose(drawn, 3.6 * geo.sog(spline, at), rtol=1e-3)
    bend = acceleration.lines[0].get_ydata().max()
    fine = DATES[0] + np.arange(0, 28801, 60).astype("m8[s]")
    norm = ss.Sphere(2).norm(spline(fine), spline(fine, nu=2))
    assert bend == pytest.approx(geo.EARTH_RADIUS * norm.max(), rel=1e-3)
    bare = geo.plot(track(5, 40, 2.0, np.arange(9.0)), radius=1000.0)
    assert axes_named(bare, "speed").get_ylabel() == "speed\nkm per unit of t"
    unit = track(5, 40, 2.0, np.arange(9.0)).speed(0.0)
    assert axes_named(bare, "speed").lines[0].get_ydata()[0] == pytest.approx(unit)


def test_axes_of_the_user_have_land():
    ax = Figure().add_subplot()
    assert geo.plot(track(5, 40, 12.0), ax=ax, title="Rhône") is ax
    assert land_of(ax) and ax.get_title() == "Rhône" and any(line.get_label() == "_scale" for line in ax.lines)
    rendered(ax.figure)


def test_other_curves_are_refused(tmp_path):
    raises("must be on Sphere", geo.plot, ss.CubicSpline(None, np.eye(3), "r:3"))
    raises("radius must be a number above 0", geo.plot, track(5, 40, 2.0), radius=-1.0)
    geo.plot(track(5, 40, 2.0), tmp_path / "track.svg")
    assert (tmp_path / "track.svg").read_text("utf-8").startswith("<?xml")

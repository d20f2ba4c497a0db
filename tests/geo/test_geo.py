"""Speed and course over ground, against the formulas of navigation."""

import numpy as np
import pytest
from curves import S2
from refused import raises

import symspline as ss
from symspline.geo import EARTH_RADIUS, cog, compass, from_lonlat, sog, to_lonlat

LON, LAT = [172, 175, 178, -179, -176, -172, -167], [12, 14, 15, 17, 20, 24, 27]
HOURS = np.array([0, 6, 12, 18, 24, 33, 36])
START = np.datetime64("2021-08-28T00:00")


def track(**options):
    return ss.CubicSpline(START + HOURS.astype("m8[h]"), from_lonlat(LON, LAT), S2, **options)


def haversine(a, b):
    """The angle between places, in radians."""
    (lon1, lat1), (lon2, lat2) = np.radians(a), np.radians(b)
    square = np.sin((lat2 - lat1) / 2) ** 2 + np.cos(lat1) * np.cos(lat2) * np.sin((lon2 - lon1) / 2) ** 2
    return 2 * np.arcsin(np.sqrt(square))


def bearing(a, b):
    """The initial course from a to b, in degrees."""
    (lon1, lat1), (lon2, lat2) = np.radians(a), np.radians(b)
    east = np.sin(lon2 - lon1) * np.cos(lat2)
    north = np.cos(lat1) * np.sin(lat2) - np.sin(lat1) * np.cos(lat2) * np.cos(lon2 - lon1)
    return np.degrees(np.arctan2(east, north)) % 360


def test_speed_and_course_are_those_between_places_close_together():
    spline, step = track(), np.timedelta64(3, "s")
    x = START + np.arange(1, 36).astype("m8[h]")
    before, after = (np.array(to_lonlat(spline(x + s * step))) for s in (-1, 1))
    assert sog(spline, x) == pytest.approx(EARTH_RADIUS * haversine(before, after) / 6, rel=1e-7)
    middle = np.array(to_lonlat(spline(x)))
    ahead, behind = bearing(middle, after), bearing(middle, before) - 180
    # Over six seconds the course turns evenly.
    assert np.abs((cog(spline, x) - ahead + cog(spline, x) - behind + 540) % 360 - 180).max() < 1e-5


@pytest.mark.parametrize("course", [0.0, 37.0, 90.0, 180.0, 269.0, 359.0])
def test_along_great_circles(course):
    """The formulas of the direct problem on a sphere."""
    lon, lat, angle, turn = np.radians([10, 50, 5, course])
    there = np.arcsin(np.sin(lat) * np.cos(angle) + np.cos(lat) * np.sin(angle) * np.cos(turn))
    across = np.arctan2(np.sin(turn) * np.sin(angle) * np.cos(lat), np.cos(angle) - np.sin(lat) * np.sin(there))
    spline = ss.CubicSpline([0, 3600], from_lonlat([10, np.degrees(lon + across)], np.degrees([lat, there])), S2)
    assert sog(spline, [0, 100.0], radius=6.4e6) == pytest.approx(6.4e6 * angle / 3600, rel=1e-13)
    assert np.abs((cog(spline, 0.0) - course + 180) % 360 - 180) < 1e-11
    assert 0 <= cog(spline, 0.0) < 360


def test_at_rest_at_a_pole_and_due_north():
    still = ss.CubicSpline(None, from_lonlat([5, 5], [50, 50]), S2)
    assert sog(still, 0.5) == 0 and np.isnan(cog(still, 0.5))
    over = ss.CubicSpline(None, [from_lonlat(90, 80), [0, 0, 1], from_lonlat(-90, 80)], S2)
    assert cog(over, [0.2, 1, 1.8]) == pytest.approx([0, 270, 180], abs=1e-9)
    # Due north the eastward part of the velocity is 0 to the last bit, and the place does not rest.
    track = ss.CubicSpline([0, 1, 2], from_lonlat([0, 0, 0], [10, 11, 12]), "sphere:2")
    assert (cog(track, [0, 0.5, 2]) == 0).all()
    # One degree of the mean sphere.
    track = ss.CubicSpline([0, 1], from_lonlat([0, 1], [0, 0]), "sphere:2")
    assert sog(track, 0.5) == pytest.approx(np.radians(6_371_008.8), rel=1e-14)


def test_batches_of_tracks():
    points = np.stack([from_lonlat(LON, LAT), from_lonlat(LON[::-1], LAT)[:, [1, 2, 0]]])
    spline = ss.CubicSpline(None, points, S2)
    x = np.linspace(0, 6, 5)
    for quantity in (sog, cog):
        assert np.array_equal(quantity(spline, x)[1], quantity(spline[1], x))


def test_other_spaces():
    spline = ss.CubicSpline(None, np.eye(4), "sphere:3")
    for call in (sog, cog):
        raises(r"product with one Sphere\(2\), not on Sphere\(3\)", call, spline, 0.5)


def test_invalid_angles_raise():
    for lon, lat, what in [
        (40.0, 178.0, "lat is 178.0, but lat must be from -90 to 90 degrees. Check whether lon and lat are swapped"),
        ([0, -9999], [0, 0], r"lon\[1\] is -9999.0, but lon must be from -3600 to 3600"),
        ([[0], [1]], [[0], [90.001]], r"lat\[1, 0\] is 90.001"),
    ]:
        raises(what, ss.geo.from_lonlat, lon, lat)
    # Unwound tracks, poles in single precision, and gaps.
    assert np.isnan(ss.geo.from_lonlat([720.0, np.nan], np.float32([90, 90]))).any(axis=1).tolist() == [0, 1]


def test_latitudes_and_directions_near_a_pole_keep_their_digits():
    co = np.array([1e-3, 1e-7, 1e-9])
    near = np.stack([np.sin(np.radians(co)), 0 * co, np.cos(np.radians(co))], axis=-1)
    assert np.abs(90 - to_lonlat(near)[1] - co).max() < 5e-14
    east, north = compass(from_lonlat([90, 180], [90 - 1e-6, -90 + 1e-6]))
    assert np.abs(east - [[-1, 0, 0], [0, -1, 0]]).max() < 1e-7
    assert np.abs(north - [[0, -1, 0], [-1, 0, 0]]).max() < 1e-7


def test_heights_do_not_count():
    t = np.arange(30.0)
    ground = from_lonlat(5 + 0.01 * t, 50 + 1e-4 * np.sin(7 * t))
    height = np.sin(t)[:, None]
    alone, fitted = ss.make_smoothing_spline(t, ground, "sphere:2", lam=1.0), []
    for points, space in (((ground, height), "sphere:2 x r:1"), ((height, ground), "r:1 x sphere:2")):
        curve = ss.make_smoothing_spline(t, points, space, lam=1.0)
        for function in (ss.geo.sog, ss.geo.cog):
            found, expected = (function(spline, t, return_std=True) for spline in (curve, alone))
            np.testing.assert_allclose(found, expected, rtol=1e-12)
        fitted.append(ss.geo.plot(curve))
    for figure in fitted:
        labels = [axes.get_ylabel() for axes in figure.axes]
        assert "speed\nkm per unit of t" in labels, labels
    with pytest.raises(ss.ValidationError, match="product with one Sphere"):
        ss.geo.sog(ss.CubicSpline(t, (ground, ground), "sphere:2 x sphere:2"), 1.0)

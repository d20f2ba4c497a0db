"""Tracks on a globe: the date line and the poles are not special."""

import numpy as np
import pytest
from cases import EPS, jumps
from curves import S2, largest_difference

import symspline as ss


def on_globe(lonlat):
    lon, lat = np.radians(np.transpose(lonlat))
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)


TRACKS = {
    "across the date line": [(172, 12), (175, 14), (178, 15), (-179, 17), (-176, 20), (-172, 24), (-167, 27)],
    "back and forth at the date line": [(178, 0), (-178, 3), (179, 6), (-179, 8), (180, 11), (-180, 15), (177, 18)],
    "over the pole": [(20, 80), (20, 84), (20, 88), (-160, 88), (-160, 84), (-160, 80)],
    "on the pole": [(20, 80), (35, 85), (123, 90), (-140, 85), (-150, 80)],
    "round the pole": [(0, 88), (60, 89), (120, 88), (180, 89), (-120, 88), (-60, 89), (0, 88)],
    "from pole to pole": [(0, 90), (30, 45), (60, 0), (90, -45), (0, -90)],
}


@pytest.mark.parametrize("name", TRACKS)
@pytest.mark.parametrize("bc_type", ["natural", "not-a-knot"])
def test_tracks_are_smooth(name, bc_type):
    p = on_globe(TRACKS[name])
    t = np.cumsum(np.r_[0, np.random.default_rng(0).uniform(3, 9, len(p) - 1)]) * 3600
    spline = ss.CubicSpline(t, p, S2, bc_type=bc_type)
    assert max(jumps(spline)) <= 1
    # Continuous also across the places where longitude jumps: no step is longer than speed allows.
    x = np.linspace(t[0], t[-1], 5001)
    steps = S2.distance(spline(x[:-1]), spline(x[1:]))
    assert steps.max() <= 1.001 * spline.speed(x).max() * (x[1] - x[0])


@pytest.mark.parametrize("name", TRACKS)
def test_tracks_make_no_detour(name):
    p = on_globe(TRACKS[name])
    spline = ss.CubicSpline(None, p, S2)
    chords = S2.distance(p[:-1], p[1:])
    assert chords.sum() <= spline.length() < 1.3 * chords.sum()
    # The curve between two points stays near the geodesic between them.
    for i, chord in enumerate(chords):
        x = np.linspace(i, i + 1, 21)
        off = S2.distance(spline(x), S2.geodesic(p[i], p[i + 1], x - i))
        assert off.max() < 0.4 * chord


@pytest.mark.parametrize("name", TRACKS)
def test_tracks_do_not_know_where_the_poles_are(name):
    p = on_globe(TRACKS[name])
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    x = np.linspace(0, len(p) - 1, 101)
    here, there = ss.CubicSpline(None, p, S2), ss.CubicSpline(None, p @ turn, S2)
    for nu in range(3):
        assert largest_difference(here(x, nu=nu) @ turn, there(x, nu=nu)) < 1e-12


def test_a_straight_flight_over_the_pole_stays_straight():
    p = on_globe(TRACKS["over the pole"])
    spline = ss.CubicSpline(None, p, S2)
    x = np.linspace(0, 5, 101)
    across = on_globe([(110, 0)])[0]
    assert np.abs(spline(x) @ across).max() < 4 * EPS
    assert S2.distance(spline(2.5), [0, 0, 1]) < 4 * EPS
    assert spline.length() == pytest.approx(np.radians(20), rel=1e-13)

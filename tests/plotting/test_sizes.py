"""Letters of pages of journals, slides and screens: they have at least six points, and never overlap."""

import numpy as np
import pytest
from drawn import VIEWS, faults_of_texts, points_around, spline_on
from matplotlib import rc_context
from matplotlib.figure import Figure
from test_grid_pictures import U, V, smooth_field

import symspline as ss
from symspline import geo, measure
from symspline.geo import from_lonlat

T = np.arange(9.0)
TURNS = ss.rotations.from_rotation_vectors(
    np.stack([0.9 * np.sin(T), 0.9 * np.cos(T), 0 * T], axis=-1)
) @ ss.rotations.from_rotation_vectors(T[:, None] * [0, 0, 1.0])
HELIX = np.stack([2 * np.cos(T), 2 * np.sin(T), 0.4 * T], axis=-1)
DATES = np.datetime64("2024-03-01T10:00:00", "s") + np.arange(60)


def small_turns(t, size=0.0):
    noise = size * np.random.default_rng(1).standard_normal((len(t), 3))
    return ss.rotations.from_rotation_vectors(np.sin(0.4 * np.multiply.outer(t, [0.5, 0.4, 0.8])) + noise)


def noisy_poses():
    t = np.linspace(0, 6, 60)
    poses = np.tile(np.eye(4), (60, 1, 1))
    poses[:, :3, :3] = small_turns(t, 0.02)
    positions = np.stack([5 * np.cos(t), 5 * np.sin(t), t], axis=-1)
    poses[:, :3, 3] = positions + 0.05 * np.random.default_rng(2).standard_normal((60, 3))
    return ss.make_smoothing_spline(DATES, poses, "se:3")


def batch_of_rotations():
    turned = ss.rotations.from_rotation_vectors(np.random.default_rng(1).standard_normal((8, 1, 3)))
    return ss.CubicSpline(None, small_turns(T) @ turned, "so:3")


def product_with_a_gap():
    t = np.concatenate([np.linspace(0, 10, 21), np.linspace(40, 50, 21)])
    return ss.CubicSpline(t, (small_turns(t / 8), np.sin(np.multiply.outer(t / 8, [1, 2, 3]))), "so:3 x r:3")


def several_sensors():
    t, s = np.linspace(0, 10, 30), np.linspace(0, 10, 120)
    rates = ss.rotations.angular_velocity(ss.CubicSpline(s, small_turns(s), "so:3", bc_type="not-a-knot"), s)
    rates = rates + 0.02 * np.random.default_rng(3).standard_normal(rates.shape)
    gyro = measure.BodyRates(s, rates, sigma=0.02, bias=measure.Constant(3))
    return ss.estimate([measure.Points(t, small_turns(t, 0.03), sigma=0.03), gyro], 20, "so:3", penalty="jerk")


def retimed():
    points = [np.sin(np.arange(5.0) + i)[:, None] for i in range(3)]
    path = ss.CubicSpline(None, points, "r:1 x r:1 x r:1")
    return path.retime(ss.time_law(path, max_speed=(2.0,) * 3, max_acceleration=(5.0,) * 3))


def tracks():
    t = np.datetime64("2024-05-01") + np.arange(6)
    lon, lat = np.array([10, 14, 19, 25, 29, 35.0]), np.array([40, 43, 41, 38, 37, 42.0])
    return [ss.CubicSpline(t, from_lonlat(lon + 5 * i, lat + 3 * i), "sphere:2") for i in range(3)]


def compared():
    spline = spline_on("r:2")
    return [spline, ss.PiecewiseGeodesic(None, spline.points, "r:2"), (np.arange(6.0), spline.points)]


def crystal_map(name):
    orientations = small_turns(np.add.outer(U, V).ravel()).reshape(len(U), len(V), 3, 3)
    return ss.GridSpline((U, V), orientations, ss.Quotient("so:3", name))


LONG = from_lonlat([10, 60, 120, 170, -140, -100], [0, 40, 20, -30, -20, 30])
WIDE = np.tile(np.eye(4), (9, 1, 1))
WIDE[:, :3, 3] = np.stack([3 * T, np.sin(T), 0.3 * np.cos(T)], axis=-1)
KINDS = {
    **{name: lambda name=name: spline_on(name).plot for name in VIEWS},
    "batch": lambda: spline_on("sphere:2", (12, 6)).plot,
    "long track": lambda: ss.CubicSpline(None, LONG, "sphere:2").plot,
    "tracks": lambda: lambda **look: geo.plot(tracks(), label=["A18", "B03", "C7"], **look),
    "large rotations": lambda: ss.CubicSpline(None, TURNS, "so:3").plot,
    "large rotations and positions": lambda: ss.CubicSpline(None, (TURNS, HELIX), "so:3 x r:3").plot,
    "rotations and positions": lambda: ss.CubicSpline(None, (small_turns(T), HELIX), "so:3 x r:3").plot,
    "wide path of poses": lambda: ss.CubicSpline(None, WIDE, "se:3").plot,
    "noisy poses": lambda: noisy_poses().plot,
    "batch of rotations": lambda: batch_of_rotations().plot,
    "product with a gap": lambda: product_with_a_gap().plot,
    "sensors": lambda: several_sensors().plot,
    "torus": lambda: ss.CubicSpline(None, points_around(ss.Torus(3), np.random.default_rng(1), (6,)), "torus:3").plot,
    "retimed path": lambda: retimed().plot,
    "comparison": lambda: lambda **look: ss.plot(compared(), labels=["C² spline", "geodesics", "data"], **look),
    **{
        f"grid on {name}": lambda name=name: ss.GridSpline((U, V), smooth_field(name), name).plot
        for name in ("r:1", "r:2", "r:3", "sphere:1", "sphere:2", "so:3", "spd:2", "spd:3", "cp:1", "gr:2,5")
    },
    "cubic crystals": lambda: crystal_map("432").plot,
    "hexagonal crystals": lambda: crystal_map("622").plot,
    "grid on a product": lambda: ss.GridSpline((U, V), (smooth_field("so:3"), smooth_field("r:1")), "so:3 x r:1").plot,
}


WIDTHS = [3.4, pytest.param(7.0, marks=pytest.mark.slow), pytest.param(12.0, marks=pytest.mark.slow)]
"""The widths of a column of a journal, of its page, and of a screen."""


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("kind", KINDS)
def test_letters_do_not_overlap(kind, width):
    figure = KINDS[kind]()(figsize=width)
    assert figure.get_figwidth() == width
    assert faults_of_texts(figure) == []


@pytest.mark.parametrize("name", ["r:1", "sphere:2", "so:3", "spd:3", "torus:2", "cp:1"])
def test_letters_in_axes_of_the_user_do_not_overlap(name):
    spline = spline_on(name)
    for width in (3.4, 7.0, 12.0):
        figure = Figure(figsize=(width, 0.5 * width), layout="constrained")
        for ax in figure.subplots(1, 2):
            spline.plot(ax=ax, title=name)
        assert faults_of_texts(figure) == []


def test_the_helper_finds_faults():
    figure = Figure(figsize=(4, 3))
    look = {"transform": figure.transFigure, "fontsize": 12}
    figure.text(0.5, 0.5, "one", **look)
    assert not faults_of_texts(figure)
    figure.text(0.51, 0.51, "two", **look)
    figure.text(0.99, 0.1, "three", **look)
    figure.text(0.1, 0.1, "four", fontsize=5)
    found = faults_of_texts(figure)
    assert found == ["'four' has 5.0 points", "'three' leaves the figure", "'two' overlaps 'one'"]


def test_users_with_small_fonts_keep_them():
    with rc_context({"font.size": 6.0}):
        assert faults_of_texts(spline_on("r:2").plot(figsize=3.4), smallest=4.9) == []

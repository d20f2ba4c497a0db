"""Pictures of smoothing splines: data instead of knots, and bands."""

import numpy as np
import pytest
from drawn import axes_named, has_title, lines_of, points_around, rate_axes, rendered, role, texts_of
from matplotlib.dates import date2num

import symspline as ss

T = np.linspace(0, 10, 40)


def noisy(name, curves=None, n=40, seed=0):
    """Data near smooth curves."""
    space, rng = ss.space(name), np.random.default_rng(seed)
    shape = () if curves is None else (curves,)
    truth = ss.CubicSpline(np.linspace(0, 10, 4), points_around(space, rng, (*shape, 4)), space)
    points = truth(np.linspace(0, 10, n))
    return space.exp(points, 0.05 * space.random_tangent(rng, points))


def smooth(name, t=T, curves=None, **options):
    return ss.make_smoothing_spline(t, noisy(name, curves, len(t)), name, **options)


def data_of(axes):
    """Where the small dots are."""
    dots = [line.get_xydata() for line in axes.lines if line.get_marker() == "o"]
    return np.concatenate(dots)


def bands_of(axes):
    return [artist for artist in (*axes.patches, *axes.collections) if role(artist) == "95 % band"]


@pytest.mark.parametrize("name", ["euclidean:1", "sphere:2", "so:3", "spd:2", "se:3"])
def test_every_space_shows_data(name):
    spline = smooth(name)
    figure = rendered(spline.plot())
    assert has_title(figure, "Smoothing spline", spline.space)
    speed = rate_axes(figure)[0][0]
    x, y = lines_of(speed)[0].T
    if name.startswith("se"):
        # Turns and positions have a deviation each, and no speed in common.
        assert not bands_of(speed)
        return
    (band,) = bands_of(speed)
    corners = band.get_paths()[0].vertices
    wanted = y + 1.96 * spline.std(x, nu=1)
    assert np.abs(corners[:, None] - np.column_stack([x, wanted])).sum(axis=2).min(axis=0).max() < 1e-12
    assert speed.get_ylim()[1] > wanted.max()


def test_data_are_drawn_and_not_knots():
    weights = np.where(np.arange(40) % 4, 1.0, 0.0)
    spline = smooth("r:2", weights=weights, knots=9)
    figure = rendered(spline.plot())
    np.testing.assert_array_equal(data_of(figure.axes[0]), spline.data[1][weights > 0])
    marks = next(c for c in axes_named(figure, "speed").collections if role(c) != "95 % band")
    np.testing.assert_array_equal([path[0, 0] for path in marks.get_segments()], T[weights > 0])


def test_band_of_a_graph():
    spline = smooth("r:1")
    axes = axes_named(spline.plot(), "x")
    x, y = axes.lines[0].get_data()
    (band,) = bands_of(axes)
    path = band.get_paths()[0]
    radius = spline.band(x[10])
    assert path.contains_points([[x[10], y[10] + 0.98 * radius], [x[10], y[10] - 0.98 * radius]]).all()
    assert not path.contains_points([[x[10], y[10] + 1.02 * radius], [x[10], y[10] - 1.02 * radius]]).any()


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
def test_angles_of_data_are_those_beside_the_curve():
    """After several turns."""
    t = np.linspace(0, 10, 80)
    angle = 2 * t + 0.05 * np.random.default_rng(0).standard_normal(80)
    for name, half in (("sphere:1", 1), ("rp:1", 2)):
        points = np.stack([np.cos(angle / half), np.sin(angle / half)], axis=-1)
        figure = rendered(ss.make_smoothing_spline(t, points, name).plot())
        dots = data_of(axes_named(figure, "angle, degrees"))
        np.testing.assert_allclose(dots, np.column_stack([t, np.degrees(angle / half)]), atol=1e-6)


@pytest.mark.filterwarnings("ignore:there are no data:symspline.SmoothingWarning")
def test_dates_and_repeated_times():
    dates = np.datetime64("2024-05-01") + np.repeat(np.arange(20), 2).astype("m8[h]")
    dates[30:] += np.timedelta64(3, "D")
    spline = smooth("r:1", dates)
    figure = rendered(spline.plot())
    axes = axes_named(figure, "x")
    np.testing.assert_allclose(data_of(axes)[:, 0], date2num(dates), rtol=0, atol=2e-11)
    assert any(text.endswith("band 95 %, 1 long gap") for text in texts_of(figure))
    assert any(text.endswith("without data, acceleration not drawn") for text in texts_of(figure))

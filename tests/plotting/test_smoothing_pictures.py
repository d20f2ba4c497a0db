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


def varying(kind, times=None, m=1):
    """A slow motion in m coordinates and a burst or a part of larger noise, or both."""
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 60, 300))
    y = np.outer(0.3 * np.sin(0.1 * np.pi * t), np.ones(m))
    if kind != "noise":
        y[:, 0] += np.exp(-(((t - 50) / 1.2) ** 2) / 2) * np.sin(1.5 * np.pi * (t - 50))
    sigma = np.where((t > 20) & (t < 40) & (kind != "burst"), 0.2, 0.02)
    return t, y + sigma[:, None] * rng.standard_normal((300, m))


ADAPTIVE = {"lam": "adaptive", "noise": "adaptive"}


def panels_of(figure, *names):
    """Axes whose label begins with one of these names, in the order of the page."""
    return [axes for axes in figure.axes if axes.get_ylabel().startswith(names)]


def test_smoothness_and_noise_that_vary_have_panels():
    t, y = varying("both")
    spline = ss.make_smoothing_spline(t, y, "r:1", **ADAPTIVE)
    figure = rendered(spline.plot())
    lam, sigma = panels_of(figure, "λ", "noise σ")
    assert (lam.get_ylabel(), sigma.get_ylabel()) == ("λ", "noise σ")
    assert lam.get_yscale() == "log" and sigma.get_ylim()[0] == 0
    assert lam.lines[0].get_drawstyle() == "steps-post"
    x, values = lam.lines[0].get_data()
    np.testing.assert_allclose(x, spline.t, rtol=1e-14)
    np.testing.assert_allclose(values[:-1], spline.lam_at((spline.t[1:] + spline.t[:-1]) / 2), rtol=1e-15)
    x, values = sigma.lines[0].get_data()
    np.testing.assert_allclose(values, spline.sigma_at(x), rtol=1e-10)


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
def test_constant_numbers_have_no_panels():
    t, y = varying("burst")
    assert not panels_of(ss.make_smoothing_spline(t, y, "r:1", 1.0, noise="adaptive").plot(), "λ")
    (lam,) = panels_of(ss.make_smoothing_spline(t, y, "r:1", **ADAPTIVE).plot(), "λ", "noise σ")
    assert lam.get_ylabel() == "λ"
    t, y = varying("noise")
    spline = ss.make_smoothing_spline(t, y, "r:1", noise="adaptive")
    (sigma,) = panels_of(spline.plot(), "λ", "noise σ")
    assert sigma.get_ylabel() == "noise σ"
    batch = ss.make_smoothing_spline(t, np.stack([y, y - y.mean() + 0.1 * np.cos(t)[:, None]]), "r:1", **ADAPTIVE)
    assert not panels_of(batch.plot(), "λ", "noise σ") and panels_of(batch[0].plot(), "noise σ")


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
def test_panels_of_factors_and_units():
    t, y = varying("both", m=3)
    dates = np.datetime64("2024-05-01", "ns") + (1e9 * t).astype("m8[ns]")
    rotations = ss.rotations.from_rotation_vectors(y)
    spline = ss.make_smoothing_spline(dates, (rotations, y), "so:3 x r:3", **ADAPTIVE)
    figure = rendered(spline.plot())
    labels = [axes.get_ylabel() for axes in panels_of(figure, "λ", "noise σ")]
    assert labels == [
        *("λ\nof so:3, s³", "λ\nof r:3, s³"),
        *("noise σ\nof so:3, rad", "noise σ\nof r:3"),
    ]
    sphere = ss.Sphere(2)
    points = sphere.exp([1.0, 0, 0], 0.1 * y[:, :2] @ np.array([[0.0, 1, 0], [0, 0, 1]]))
    spline = ss.make_smoothing_spline(dates, points, sphere, **ADAPTIVE)
    (sigma,) = panels_of(rendered(spline.plot()), "noise σ")
    assert sigma.get_ylabel() == "noise σ, rad"
    (sigma,) = panels_of(rendered(ss.geo.plot(spline)), "noise σ")
    assert sigma.get_ylabel() == "noise σ, m"
    x = spline.t[[100, 200]]
    height = np.interp(date2num(x), *sigma.lines[0].get_data())
    np.testing.assert_allclose(height / ss.geo.EARTH_RADIUS, spline.sigma_at(x), rtol=1e-2)

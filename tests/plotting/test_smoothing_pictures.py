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


NAMES = ["euclidean:1", "euclidean:3", "sphere:2", "hyperbolic:2", "so:3", "spd:2", "se:3", "gr:2,5", "u:2"]


@pytest.mark.parametrize("name", NAMES)
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


def test_heading():
    spline = smooth("r:2", weights=np.where(np.arange(40) % 4, 1.0, 0.0))
    wanted = f"30 data, {spline.df:.3g} degrees of freedom, noise {spline.sigma:.2g}, band 95 %"
    assert wanted in texts_of(spline.plot())
    for name in ("s:2", "gr:2,4"):
        turned = smooth(name)
        angle = f"40 data, {turned.df:.3g} degrees of freedom, noise {turned.sigma:.2g} rad, band 95 %"
        assert angle in texts_of(turned.plot())
    both = ss.make_smoothing_spline(T, (noisy("r:1"), noisy("s:2")), "r:1 x s:2")
    (one, other), (first, second) = both.df, both.sigma
    counts = f"40 data, {one:.3g} and {other:.3g} degrees of freedom"
    wanted = f"{counts}, noise {first:.2g} and {second:.2g} (r:1 and sphere:2), band 95 %"
    assert wanted in texts_of(rendered(both.plot()))


def test_data_are_drawn_and_not_knots():
    weights = np.where(np.arange(40) % 4, 1.0, 0.0)
    spline = smooth("r:2", weights=weights, knots=9)
    figure = rendered(spline.plot())
    np.testing.assert_array_equal(data_of(figure.axes[0]), spline.data[1][weights > 0])
    marks = next(c for c in axes_named(figure, "speed").collections if role(c) != "95 % band")
    np.testing.assert_array_equal([path[0, 0] for path in marks.get_segments()], T[weights > 0])


def test_products_lack_a_speed_band():
    both = ss.make_smoothing_spline(T, (noisy("r:1"), noisy("s:2")), "r:1 x s:2")
    figure = rendered(both.plot())
    assert not bands_of(axes_named(figure, "speed"))
    graph = axes_named(figure, "x")
    np.testing.assert_array_equal(data_of(graph), np.column_stack([T, both.data[1][0][:, 0]]))
    assert len(bands_of(graph)) == 1


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


def test_legends_say_whether_rates_have_bands():
    assert "95 % band of curve and speed" in texts_of(smooth("r:2").plot())
    product = ss.make_smoothing_spline(T, (noisy("so:3"), noisy("r:2")), "so:3 x r:2")
    texts = texts_of(product.plot())
    assert "95 % band of curve" in texts and "95 % band of curve and speed" not in texts


def test_a_long_gap_has_samples_of_its_own():
    # Drawn by a few chords the curve and its band were beside themselves.
    t = np.r_[np.linspace(0, 4, 60), np.linspace(7, 10, 50)]
    points = np.stack([np.cos(t), np.sin(t), 0.2 * t], -1)
    points = points + 0.05 * np.random.default_rng(0).standard_normal(points.shape)
    x = axes_named(ss.make_smoothing_spline(t, points, "r:3").plot(), "speed").lines[0].get_xdata()
    assert np.diff(x).max() <= 10 / 1200 * (1 + 1e-12)
    assert np.isin(t, x).all()

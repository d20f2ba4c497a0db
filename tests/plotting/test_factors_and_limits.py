"""Products with equal factors, angles of tori, limits of time laws, and noise on the Earth."""

import numpy as np
import pytest
from drawn import axes_named, rate_axes, rendered, role, texts_of

import symspline as ss


def test_angles_on_a_torus_break_at_180_degrees():
    angles = np.column_stack([np.linspace(2, 9, 8), np.linspace(-1, 1, 8)])
    spline = ss.CubicSpline(None, (angles + np.pi) % (2 * np.pi) - np.pi, "torus:2")
    figure = rendered(spline.plot())
    axes = axes_named(figure, "angles, degrees")
    wrapped = (np.degrees(angles) + 180) % 360 - 180
    for line, given in zip((own for own in axes.lines if own.get_gid() == "_curve"), wrapped.T, strict=True):
        x, shown = line.get_data()
        np.testing.assert_allclose(shown[np.searchsorted(x, np.arange(8))], given, atol=1e-9)
        assert np.nanmax(np.abs(np.diff(shown))) < 5 and np.nanmax(np.abs(shown)) <= 180
        assert np.isnan(shown).sum() == np.count_nonzero(np.abs(np.diff(given)) > 180)
    for dots, given in zip((own for own in axes.lines if role(own) == "given points"), wrapped.T, strict=True):
        np.testing.assert_allclose(dots.get_ydata(), given, atol=1e-9)
    assert axes.get_yticks().tolist() == [-180, -90, 0, 90, 180]
    rate = axes_named(figure, "speed")
    assert rate.get_ylabel() == "speed\n|γ′|, °/t"
    x, shown = next(own for own in rate.lines if own.get_gid() == "_curve").get_data()
    np.testing.assert_allclose(shown, np.degrees(spline.speed(x)))
    # Data are close to the first curve, and the quantiles of a batch to its mean.
    t = np.array([1.3, 6.6])
    both = rendered(ss.plot([spline, (t, np.array([[3.4 - 2 * np.pi, -0.5], [8.4, 0.9]]))]))
    dots = next(line for line in axes_named(both, "x₁").lines if role(line) == "data")
    np.testing.assert_allclose(dots.get_ydata(), np.degrees([3.4 - 2 * np.pi, 8.4 - 2 * np.pi]), atol=1e-9)
    many = spline.space.exp(spline.points, np.linspace(-0.1, 0.1, 9)[:, None, None] * [1.0, 1.0])
    axes = axes_named(rendered(ss.CubicSpline(None, many, "torus:2").plot()), "x₁")
    (area,) = (own for own in axes.collections if role(own) == "5–95 %")
    low, high = area.get_paths()[0].get_extents().intervaly
    assert low > np.degrees(1.9) and high < np.degrees(9.1)
    moving = spline.animate(frames=3)
    moving._draw_was_started = True
    moving._func(1000)


def test_limits_of_time_laws():
    path = ss.CubicSpline(None, (np.arange(4.0)[:, None], ss.Sphere(1).from_angles(np.arange(4.0))), "r:1 x s:1")
    law = ss.time_law(path, max_speed=(0.75, None), max_acceleration=(None, 0.5))
    figure = rendered(path.retime(law).plot())
    found = [
        [line.get_ydata()[0] for line in axes.lines if role(line) == "limit"]
        for column in rate_axes(figure)
        for axes in column
    ]
    assert found == [[0.75, -0.75], [], [], [np.degrees(0.5), -np.degrees(0.5)]]
    assert "limit" in texts_of(figure)
    # Other laws are functions without limits.
    figure = path.retime(lambda x, nu: x if nu == 0 else (x * 0 + (nu == 1)), domain=(0.0, 2.0)).plot()
    assert "limit" not in texts_of(figure)


def test_velocities_of_a_fast_law_are_not_clipped():
    """The knots of the law are close together, so that rounding errors of points could explain large velocities."""
    corners = np.array([[0, -1, 0.5], [0.8, -0.6, 0.9], [1.5, 0, 0.2], [1.0, 0.7, -0.6], [0, 0.2, 0.3]])
    path = ss.CubicSpline(None, [corners[:, [j]] for j in range(3)], "r:1 x r:1 x r:1")
    moved = path.retime(ss.time_law(path, max_speed=(2.0,) * 3, max_acceleration=(5.0, 5.0, 6.0)))
    for axes in rate_axes(rendered(moved.plot()))[0]:
        low, high = axes.get_ylim()
        for line in axes.lines:
            assert low < np.min(line.get_ydata()) and np.max(line.get_ydata()) < high


def test_noise_on_the_earth_is_in_metres():
    rng = np.random.default_rng(0)
    lon, lat = np.linspace(5, 6, 40), 52 + 1e-3 * rng.normal(size=40)
    spline = ss.make_smoothing_spline(np.arange(40.0), ss.geo.from_lonlat(lon, lat), "sphere:2")
    (words,) = [text for text in texts_of(ss.geo.plot(spline)) if "noise" in text]
    assert float(words.split("noise ")[1].split(" m")[0]) == pytest.approx(6371008.8 * float(spline.sigma), rel=0.01)

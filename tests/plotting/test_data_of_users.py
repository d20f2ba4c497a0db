"""Pictures of recordings with gaps, noise, time zones, large coordinates, many points and several curves."""

import numpy as np
import pandas as pd
import pytest
from drawn import axes_named, rendered, role, texts_of
from matplotlib.figure import Figure

import symspline as ss

UTM = np.array([692_345.0, 5_334_781.0, 520.0])


# ---- recordings ----


@pytest.mark.parametrize("shift", [0.0, 1000.0])
def test_segments_near_noisy_points_show_their_data_and_bands(shift, rng):
    t = np.append(np.arange(0, 10, 0.5), np.arange(30, 40, 0.5)) + shift
    y = np.sin(t / 3)[:, None] + 0.3 * rng.standard_normal((40, 1))
    curve = ss.fit_segments(t, y, "r:1", max_gap=2, smooth=True)
    figure = rendered(curve.plot())
    axes = axes_named(figure, "x")
    seen = [line.get_xydata() for line in axes.lines if role(line) == "data"]
    seen = np.concatenate(seen)
    np.testing.assert_allclose(seen[:, 1], y[:, 0])
    np.testing.assert_allclose(np.diff(seen[:, 0]), np.diff(t))
    assert {"data", "95 % band of curve and speed"} <= set(texts_of(figure))
    assert "given points" not in texts_of(figure)
    # The bands are those of the segments, and not drawn in the gap.
    for name, nu in (("x", 0), ("velocity", 1)):
        bands = [own for own in axes_named(figure, name).collections if role(own) == "95 % band"]
        assert len(bands) == 2
        for band, segment in zip(bands, curve, strict=True):
            (path,) = band.get_paths()
            first, last = path.vertices[:, 0].min(), path.vertices[:, 0].max()
            assert last - first == pytest.approx(9.5)
            for edge, i in ((first, 0), (last, -1)):
                width = np.ptp(path.vertices[path.vertices[:, 0] == edge][:, 1])
                assert width == pytest.approx(2 * 1.96 * segment.std(segment.t[i], nu=nu), rel=2e-3)


def test_dates_with_a_time_zone_are_in_utc():
    t = pd.date_range("2024-03-30 22:10", periods=6, freq="3h", tz="Asia/Tokyo")
    figure = rendered(ss.CubicSpline(t, np.arange(6.0)[:, None] ** 2, "r:1").plot())
    assert {axes.get_xlabel() for axes in figure.axes} == {"UTC", ""}
    figure = rendered(ss.CubicSpline(t.tz_localize(None), np.arange(6.0)[:, None] ** 2, "r:1").plot())
    assert {axes.get_xlabel() for axes in figure.axes} == {""}


@pytest.mark.parametrize("name", ["r:2", "se:3"])
def test_large_coordinates_count_from_round_numbers(name):
    u = np.linspace(0, 6, 30)
    places = UTM + np.stack([300 * np.sin(u), 200 * u, 5 * np.cos(3 * u)], axis=1)
    n = int(name[-1])
    points = places[:, :n]
    if name.startswith("se"):
        points = np.tile(np.eye(n + 1), (30, 1, 1))
        points[:, :n, n] = places[:, :n]
    curve = ss.CubicSpline(u, points, name)
    axes = rendered(curve.plot()).axes[0]
    labels = [getattr(axes, f"get_{letter}label")() for letter in "xyz"[:n]]
    assert labels == ["x₁ − 692000", "x₂ − 5330000", "x₃"][:n]
    data = next(line for line in axes.lines if line.get_gid() == "_curve")
    data = np.stack(data.get_data_3d() if n == 3 else data.get_data(), axis=1)
    np.testing.assert_allclose(data[[0, -1]] + [692_000, 5_330_000, 0][:n], places[[0, -1], :n], atol=1e-8)
    assert np.ptp(axes.get_ylim()) < 2 * np.ptp(places[:, 1])
    # Axes of the user have the coordinates themselves.
    ax = Figure().add_subplot(projection="3d" if n == 3 else None)
    curve.plot(ax=ax)
    assert ax.get_xlim()[0] > 600_000


# ---- several curves ----


# ---- fonts and rates ----

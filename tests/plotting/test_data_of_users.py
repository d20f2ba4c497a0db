"""Pictures of recordings with gaps, noise, time zones, large coordinates, many points and several curves."""

import matplotlib
import matplotlib.style
import numpy as np
import pandas as pd
import pytest
from drawn import axes_named, legend_of, lines_of, rate_axes, rendered, role, spline_on, texts_of
from matplotlib.colors import to_hex
from matplotlib.dates import date2num
from matplotlib.figure import Figure
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline._base.report import long_gaps

RNG = np.random.default_rng(0)
UTM = np.array([692_345.0, 5_334_781.0, 520.0])


# ---- recordings ----


@pytest.mark.parametrize("shift", [0.0, 1000.0])
def test_segments_near_noisy_points_show_their_data_and_bands(shift):
    t = np.append(np.arange(0, 10, 0.5), np.arange(30, 40, 0.5)) + shift
    y = np.sin(t / 3)[:, None] + 0.3 * RNG.standard_normal((40, 1))
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


def test_data_of_segments_with_dates_of_their_own():
    t = np.datetime64("2024-03-01") + np.arange(40) * np.timedelta64(6, "h")
    y = np.sin(np.arange(40) / 3)[:, None] + 0.1 * RNG.standard_normal((40, 1))
    parts = [ss.make_smoothing_spline(t[i], y[i], "r:1") for i in (slice(0, 15), slice(25, 40))]
    axes = axes_named(ss.SegmentedCurve(parts).plot(), "x")
    seen = np.concatenate([line.get_xydata() for line in axes.lines if role(line) == "data"])
    np.testing.assert_allclose(seen, np.column_stack([date2num(t), y[:, 0]])[[*range(15), *range(25, 40)]])


def test_each_segment_has_a_frame():
    t = np.concatenate([np.arange(0, 10, 0.5), [17.3, 17.4, 17.5], np.arange(30, 40, 0.5)])
    turns = Rotation.from_rotvec(np.stack([np.sin(t), t / 3, np.cos(t)], axis=1))
    axes = ss.fit_segments(t, turns, "so:3", max_gap=2).plot().axes[0]
    offsets = np.concatenate([np.asarray(own.get_offsets()) for own in axes.collections if hasattr(own, "get_offsets")])
    times = offsets[offsets[:, 1] == -1, 0]
    for first, last in ((0, 9.5), (17.3, 17.5), (30, 39.5)):
        assert ((times >= first) & (times <= last)).any()


def test_random_times_have_no_long_gaps():
    """The longest of n random steps is about log2(n) times the median."""
    rng = np.random.default_rng(5)
    found = [long_gaps(np.cumsum(rng.exponential(size=n))).sum() for n in (100, 1000, 10_000) for _ in range(20)]
    assert np.sum(found) < 5
    t = np.arange(1000.0)
    t[600:] += 30
    assert np.flatnonzero(long_gaps(t)).tolist() == [599]
    assert np.flatnonzero(long_gaps(np.array([0, 1, 2, 13.5, 14, 15]))).tolist() == [2]


def test_gaps_are_those_of_all_curves():
    t = np.arange(100.0)
    some = np.concatenate([t[:20], t[60:]])
    whole, part = (ss.CubicSpline(x, np.sin(x / 5)[:, None], "r:1") for x in (t, some))
    figure = rendered(ss.plot([whole, part], labels=["a", "b"]))
    assert not any("without data" in text for text in texts_of(figure))
    assert not [own for axes in figure.axes for own in axes.collections if role(own) == "gap"]
    other = ss.CubicSpline(np.delete(t, range(15, 50)), np.delete(t, range(15, 50))[:, None], "r:1")
    figure = rendered(ss.plot([part, other]))
    assert any(text.startswith("gap of 31 without data") for text in texts_of(figure))


def test_dates_with_a_time_zone_are_in_utc():
    t = pd.date_range("2024-03-30 22:10", periods=6, freq="3h", tz="Asia/Tokyo")
    figure = rendered(ss.CubicSpline(t, np.arange(6.0)[:, None] ** 2, "r:1").plot())
    assert {axes.get_xlabel() for axes in figure.axes} == {"UTC", ""}
    figure = rendered(ss.CubicSpline(t.tz_localize(None), np.arange(6.0)[:, None] ** 2, "r:1").plot())
    assert {axes.get_xlabel() for axes in figure.axes} == {""}


@pytest.mark.parametrize("name", ["r:2", "r:3", "se:2", "se:3"])
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


def test_a_moving_frame_counts_from_the_same_number():
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, :3, 3] = UTM + np.arange(5)[:, None] * [10, 20, 1]
    moving = ss.CubicSpline(None, poses, "se:3").animate(frames=3)
    moving._draw_frame(0)
    moving._draw_was_started = True
    axes = moving._fig.axes[0]
    sticks = [line.get_data_3d() for line in axes.lines if line.get_linewidth() == 3.5]
    assert len(sticks) == 3 and all(abs(x[0] - 45) < 1e-6 and abs(y[0] - 81) < 1e-6 for x, y, _ in sticks)


def test_rounding_errors_of_a_constant_component_are_not_magnified():
    t = np.concatenate([np.arange(0, 10, 0.5), np.arange(30, 40, 0.5)])
    turns = Rotation.from_rotvec(np.stack([np.sin(t / 3), t / 40, 0 * t], axis=1))
    figure = ss.CubicSpline(t, turns, "so:3").plot()
    low, high = axes_named(figure, "about x₃").get_ylim()
    assert high - low > 0.5


# ---- several curves ----


def test_a_batch_says_how_many_curves_it_shows():
    batch = ss.CubicSpline(None, np.cumsum(RNG.standard_normal((300, 12, 2)), axis=1), "r:2")
    texts = texts_of(rendered(batch.plot()))
    assert {"other curves, 47 of 297", "5–95 % of 300 curves"} <= set(texts)


@pytest.mark.parametrize("name", ["torus:2", "gr:2,4", "stiefel:2,4", "spd:5"])
def test_curves_of_components_have_their_colours(name):
    curve = spline_on(name)
    figure = rendered(ss.plot([curve, curve.reverse()], labels=["a", "b"], colors=["#ff0000", "#0000ff"]))
    components = [axes for axes in figure.axes if axes.get_ylabel()[:1] in "xθ"]
    assert len(components) == (2 if name in ("torus:2", "gr:2,4") else 4)
    for axes in components:
        assert {to_hex(line.get_color()) for line in axes.lines if line.get_gid() == "_curve"} <= {"#ff0000", "#0000ff"}


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("logspd:2", "x₁₁ x₁₂ x₂₂"),
        ("siegel:1", "x₁₁ x₁₂ x₂₂"),
        ("hpd:2", "Re x₁₁,Re x₁₂,Im x₁₂,Re x₂₂"),
        ("aff:2", "x₁₁ x₁₂ x₁₃ x₂₁ x₂₂ x₂₃"),
        ("r:4", "x₁ x₂ x₃ x₄"),
        ("u:2", "Re x₁₁,Im x₁₁,Re x₁₂,Im x₁₂,Re x₂₁,Im x₂₁,Re x₂₂,Im x₂₂"),
    ],
)
def test_components_that_others_determine_are_omitted(name, shown):
    names = shown.split("," if "," in shown else " ")
    texts = texts_of(rendered(spline_on(name).plot()))
    assert sorted(text for text in texts if text.startswith(("x", "Re x", "Im x"))) == sorted(names)


def test_many_curves_have_different_colours():
    curves = [ss.CubicSpline(None, np.arange(3.0)[:, None] + i, "r:1") for i in range(9)]
    labels = [f"a rather long label of run number {i}" for i in range(9)]
    figure = rendered(ss.plot(curves, labels=labels, title="A very long title " * 6))
    assert len({to_hex(line.get_color()) for line in figure.axes[0].lines if line.get_gid() == "_curve"}) == 9
    figure.draw_without_rendering()
    for text in figure.findobj(matplotlib.text.Text):
        if text.get_text().startswith(("a rather", "A very")):
            box = text.get_window_extent()
            assert box.x1 < figure.bbox.width and box.y1 < figure.bbox.height


def test_labels_and_colours_in_axes_of_the_user_distinguish_curves():
    ax = Figure().add_subplot()
    first = spline_on("torus:2")
    first.plot(ax=ax, label="A", color="red")
    first.reverse().plot(ax=ax, label="B", color="blue")
    handles, labels = ax.get_legend_handles_labels()
    assert labels == ["A: x₁", "A: x₂", "B: x₁", "B: x₂"]
    assert [own.get_color() for own in handles] == ["red", "red", "blue", "blue"]
    assert handles[0].get_linestyle() != handles[1].get_linestyle()


@pytest.mark.parametrize("name", ["so:3", "spd:2"])
def test_symbols_are_not_drawn_over_others(name):
    ax = Figure().add_subplot()
    spline_on(name).plot(ax=ax, label="A")
    assert [own.get_text() for own in ax.get_yticklabels()] == ["A: given", "A: curve"]
    if name == "so:3":
        assert ax.get_legend_handles_labels()[1] == ["first axis", "second axis", "third axis"]
    raises("ax already contains a picture, and symbols of several curves would overlap", spline_on(name).plot, ax=ax)


def test_data_have_one_entry_in_legends():
    ax = Figure().add_subplot()
    curve = spline_on("sphere:2")
    ss.plot([curve, (curve.t, curve.points)], labels=["a", "b"], ax=ax)
    assert ax.get_legend_handles_labels()[1].count("b") == 1
    t = np.arange(30.0)
    noisy = np.sin(t)[:, None] + 0.1 * RNG.standard_normal((30, 1))
    figure = rendered(ss.plot([ss.make_smoothing_spline(t, noisy, "r:1"), (t, noisy)], labels=["fit", "data"]))
    assert texts_of(figure).count("data") == 1


# ---- fonts and rates ----


@pytest.mark.parametrize("size", [16])
@pytest.mark.parametrize("name", ["sphere:2", "se:2", "so:3", "r:3", "spd:2"])
def test_pages_grow_with_the_font(name, size):
    usual = spline_on(name).plot()
    with matplotlib.rc_context({"font.size": size}):
        figure = spline_on(name).plot()
        np.testing.assert_allclose(figure.get_size_inches(), usual.get_size_inches() * size / 10)
        figure.draw_without_rendering()
        for axes in figure.axes:
            for label in (axes.xaxis.label, axes.yaxis.label):
                box = label.get_window_extent()
                assert not label.get_text() or (box.x0 >= 0 and box.y0 >= 0)
        assert spline_on(name).plot(figsize=(8, 6)).get_size_inches().tolist() == [8, 6]
    label = rate_axes(figure)[0][0].yaxis.label if rate_axes(figure)[0] else figure.axes[-1].yaxis.label
    assert label.get_fontsize() == pytest.approx(size)


def test_rates_of_one_angle_have_a_sign():
    t = np.linspace(0, 6, 20)
    curve = ss.CubicSpline(t, np.sin(t)[:, None], "torus:1")
    figure = curve.plot()
    (axes,) = rate_axes(figure)[0]
    assert axes.get_ylabel() == "velocity\nγ′, rad/t"
    (line,) = lines_of(axes)
    np.testing.assert_allclose(line[:, 1], curve(line[:, 0], 1)[:, 0], atol=1e-12)
    assert line[:, 1].min() < -0.5


@pytest.mark.parametrize("name", ["se:2", "se:3"])
def test_the_acceleration_of_a_pose_is_that_of_its_position(name):
    n = int(name[-1])
    t = np.linspace(0, 5, 12)
    poses = np.tile(np.eye(n + 1), (12, 1, 1))
    poses[:, :2, :2] = np.moveaxis([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]], -1, 0)
    poses[:, :n, n] = np.stack([3 * t + np.sin(t), np.cos(t), t], axis=1)[:, :n]
    curve = ss.CubicSpline(t, poses, name)
    (axes,) = [own for own in curve.plot().axes if own.get_ylabel().startswith("acceleration")]
    (line,) = lines_of(axes)
    x, h = np.linspace(0.3, 4.7, 40), 1e-3
    x = x[np.abs(x[:, None] - t).min(axis=1) > 0.02]
    second = np.linalg.norm((curve(x + h) - 2 * curve(x) + curve(x - h))[:, :n, n], axis=1) / h**2
    np.testing.assert_allclose(np.interp(x, *line.T), second, atol=2e-3)


@pytest.mark.parametrize("name", ["sphere:3", "su:2", "cp:1"])
def test_angles_that_are_twice_the_distances_are_explained(name):
    figure = rendered(spline_on(name).plot())
    label = rate_axes(figure)[0][0].get_ylabel()
    if name == "cp:1":
        assert label == "speed\n|γ′| of states, rad/t"
        assert any(text.endswith("angles on it are twice the distances of states") for text in texts_of(figure))
    else:
        assert label == "speed\n|γ′| = |ω|/2, rad/t"


def test_symbols_that_are_omitted_are_counted():
    u = np.arange(40.0)
    turns = Rotation.from_rotvec(np.stack([u / 6, u / 12, np.cos(u / 5)], axis=1))
    curve = ss.CubicSpline(None, turns, "so:3")
    ax = Figure(figsize=(5, 4)).add_subplot()
    curve.plot(ax=ax)
    assert ax.get_yticklabels()[0].get_text().startswith("given\n") and "of 40" in ax.get_yticklabels()[0].get_text()
    names = ["Recursive estimate of the calibrated gimbal (run 7)", "slerp", "measured"]
    figure = rendered(ss.plot([curve, ss.PiecewiseGeodesic(None, turns, "so:3"), (u, turns)], labels=names))
    texts = texts_of(figure)
    assert any(text.startswith("measured\n") and text.endswith(" of 40") for text in texts)
    assert "Recursive\nestimate of\nthe …" in texts
    colors = {to_hex(line.get_color()) for axes in figure.axes for line in lines_of_gid(axes)}
    assert not colors & {"#d55e00", "#009e73", "#0072b2", "#0b559f", "#d95f0e"}


def lines_of_gid(axes):
    return [line for line in axes.lines if line.get_gid() == "_curve"]


def test_tracks_of_a_metre_are_enlarged():
    lon, lat = 10 + 1e-6 * np.array([0, 1, 2, 3.0]), 50 + 1e-6 * np.array([0, 1, 0, 2.0])
    figure = rendered(ss.geo.plot(ss.CubicSpline(None, ss.geo.from_lonlat(lon, lat), "sphere:2")))
    assert any(text.endswith(" m") for text in texts_of(figure))


def test_markers_in_the_legend_have_the_colour_of_the_curve():
    figure = ss.CubicSpline(None, [[0, 0], [1, 1], [2, 0.0]], "r:2").plot(label="A", color="#ff0000")
    assert to_hex(legend_of(figure)["given points"].get_color()) == "#ff0000"

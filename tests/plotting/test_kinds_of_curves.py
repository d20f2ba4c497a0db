"""Plots of all classes of curves, of gaps, of times far from zero, and of batches."""

import numpy as np
import pytest
from drawn import (
    axes_named,
    has_title,
    lines_of,
    points_around,
    rate_axes,
    rendered,
    role,
    spline_on,
    texts_of,
)
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import proj3d
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline._plotting.curves import Axis, curves_of

NAMES = ["euclidean:1", "euclidean:2", "sphere:2", "so:3", "spd:2", "gr:2,5", "cp:1", "rp:2", "hyperbolic:2"]
T = np.array([0.0, 1.1, 1.9, 3.2, 4.0, 5.3])


def bezier(name):
    space = ss.space(name)
    return ss.BezierCurve(points_around(space, np.random.default_rng(1), (5,)), space)


CURVES = {
    "B-spline": lambda name: ss.BSpline([0, 0, 0, 0, 1, 2, 2, 2, 2], bezier(name).control_points, 3, name),
    "Bézier curve": bezier,
    "Piecewise geodesic": lambda name: ss.PiecewiseGeodesic(T, spline_on(name, t=T).points, name),
    "Retimed curve": lambda name: spline_on(name, t=T).restrict(0.5, 3.5),
    "Segmented curve": lambda name: ss.SegmentedCurve([spline_on(name, t=T), spline_on(name, t=T + 15)]),
    "C¹ Hermite spline": lambda name: spline_on(name, t=T).restrict(1.1, 4.0),
}


# Every kind on two spaces.
SQUARE = [(kind, NAMES[(i + shift) % len(NAMES)]) for shift in (0, 4) for i, kind in enumerate(CURVES)]


@pytest.mark.parametrize(("kind", "name"), SQUARE)
def test_every_kind_of_curve_is_drawn(kind, name):
    curve = CURVES[kind](name)
    figure = rendered(curve.plot())
    assert has_title(figure, kind, curve.space)
    for axes, nu in zip([own[0] for own in rate_axes(figure)], (1, 2), strict=True):
        line = np.concatenate(lines_of(axes))
        x = line[::7, 0]
        norm = curve.space.norm(curve(x), curve(x, nu))
        np.testing.assert_allclose(np.abs(line[::7, 1]), norm, atol=1e-6)


@pytest.mark.parametrize("name", ["r:2", "r:3", "sphere:2", "h:2", "cp:1"])
def test_control_polygons(name):
    """Control points are joined by geodesics, and the picture contains them."""
    curve = ss.BezierCurve(ss.space(name).project(points_around(ss.space(name), np.random.default_rng(2), (4,))), name)
    figure = rendered(curve.plot())
    assert "control points" in texts_of(figure)
    axes = figure.axes[0]
    control = next(line for line in axes.lines if role(line) == "control points")
    polygon = next(line for line in axes.lines if line.get_linewidth() == 0.9)
    if name.startswith("r"):
        found = np.stack(control.get_data_3d() if name == "r:3" else control.get_data(), axis=1)
        np.testing.assert_allclose(found, curve.control_points)
        corners = np.stack(polygon.get_data_3d() if name == "r:3" else polygon.get_data(), axis=1)[::30]
        np.testing.assert_allclose(corners, curve.control_points[:-1])
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    x, y = control.get_data_3d()[:2] if name == "r:3" else control.get_data()
    seen = np.isfinite(x)
    assert ((x >= x0) & (x <= x1) & (y >= y0) & (y <= y1))[seen].all() and seen.any()
    assert "control points" not in texts_of(spline_on(name).plot())


@pytest.mark.parametrize("name", ["r:3", "se:3"])
def test_the_end_in_space_is_the_last_point(name):
    curves = [spline_on(name), spline_on(name).restrict(0.5, 3.7)]
    if name == "r:3":
        curves.append(ss.BezierCurve(np.random.default_rng(0).normal(size=(4, 3)), name))
    for curve in curves:
        axes = curve.plot().axes[0]
        (end,) = [line.get_data_3d() for line in axes.lines if role(line) == "end"]
        last = curve(curve.domain[1])
        np.testing.assert_allclose(np.ravel(end), last if name == "r:3" else last[:3, 3], atol=1e-9)


def test_notebooks_show_every_kind():
    for make in CURVES.values():
        assert "<img" in make("euclidean:2")._repr_html_()


def test_given_points_of_a_part_are_those_of_the_whole():
    """The ends of a part are not given points; those between are."""
    part = spline_on("r:2", t=T).restrict(0.5, 3.5)
    (dots,) = [line.get_xydata() for line in part.plot().axes[0].lines if role(line) == "given points"]
    np.testing.assert_allclose(dots, spline_on("r:2", t=T)(T[1:4]), atol=1e-12)
    mirrored = bezier("r:2").reverse().plot()
    assert not [line for line in mirrored.axes[0].lines if role(line) == "given points"]


@pytest.mark.parametrize("name", ["r:1", "r:2", "so:3", "se:3", "sphere:2 x r:1"])
def test_gaps_between_segments_are_shaded_and_lines_stop(name):
    if " x " in name:
        space, rng = ss.space(name), np.random.default_rng(0)
        points = tuple(points_around(own, rng, (6,)) for own in space.factors)
        segments = [ss.CubicSpline(T + shift, points, space) for shift in (0, 15)]
    else:
        segments = [spline_on(name, t=T), spline_on(name, t=T + 15)]
    figure = rendered(ss.SegmentedCurve(segments).plot())
    assert "2 segments (C² spline), 1 gap" in texts_of(figure)
    axes = rate_axes(figure)[0][0]
    (band,) = [own for own in axes.collections if role(own) == "gap"]
    assert sorted(set(band.get_paths()[0].vertices[:, 0])) == [5.3, 15.0]
    assert [line[[0, -1], 0].tolist() for line in lines_of(axes)] == [[0.0, 5.3], [15.0, 20.3]]


def test_segments_that_meet_are_not_joined_where_velocities_differ():
    second = ss.CubicSpline([1, 2], [[1.0], [5.0]], "r:1")
    whole = ss.SegmentedCurve([ss.CubicSpline([0, 1], [[0.0], [1.0]], "r:1"), second])
    figure = whole.plot()
    assert "2 segments (C² spline), 0 gaps" in texts_of(figure)
    first, last = lines_of(axes_named(figure, "velocity"))
    np.testing.assert_allclose(first[:, 1], 1.0)
    np.testing.assert_allclose(last[:, 1], 4.0)


@pytest.mark.parametrize(
    ("t", "name", "ends"),
    [
        (1305031102.175 + np.arange(6), "t − 1305031100", [2.175, 7.175]),
        (1_700_000_000_000_000_001 + np.arange(6), "t − 1700000000000000000", [1.0, 6.0]),
        (-5e6 + 0.1 * np.arange(6), "t + 5000000", [0.0, 0.5]),
        (np.arange(6) + 50.0, "t", [50.0, 55.0]),
        (np.arange(6).astype("m8[s]"), "t, seconds", [0.0, 5.0]),
    ],
)
def test_times_far_from_zero_are_differences_from_a_round_number(t, name, ends):
    axes = axes_named(rendered(spline_on("r:2", t=t).plot()), "acceleration")
    assert axes.get_xlabel() == name and axes.xaxis.get_offset_text().get_text() == ""
    np.testing.assert_allclose(lines_of(axes)[0][[0, -1], 0], ends, atol=1e-6)


@pytest.mark.parametrize("name", ["euclidean:1", "sphere:1"])
def test_quantiles_of_a_batch(name):
    space, rng = ss.space(name), np.random.default_rng(4)
    middle = space.random_point(rng)
    points = space.exp(middle, 0.3 * space.random_tangent(rng, np.broadcast_to(middle, (40, 6, *space.point_shape))))
    batch = ss.CubicSpline(T, points, space)
    figure = rendered(batch.plot())
    assert "5–95 % of 40 curves" in texts_of(figure)
    for axes in figure.axes:
        assert len(lines_of(axes)) == 3
    axes = axes_named(figure, "velocity")
    (band,) = [own for own in axes.collections if role(own) == "5–95 %"]
    corners = band.get_paths()[0].vertices
    x = np.unique(corners[:, 0])[100:200:20]
    velocities, at = batch(x, 1), batch(x)
    # The sign is that of the increasing angle or number.
    signed = velocities[..., 0]
    if name == "sphere:1":
        signed = at[..., 0] * velocities[..., 1] - at[..., 1] * velocities[..., 0]
    for time, values in zip(x, signed.T, strict=True):
        drawn = corners[corners[:, 0] == time, 1]
        expected = np.quantile(values, [0.05, 0.95])
        np.testing.assert_allclose([drawn.min(), drawn.max()], expected, atol=1e-9)


def test_angles_of_a_batch_are_unwrapped_beside_each_other():
    angles = np.pi - 0.1 + np.linspace(0, 0.4, 6) * np.linspace(0.8, 1.2, 20)[:, None]
    batch = ss.CubicSpline(T, np.stack([np.cos(angles), np.sin(angles)], axis=-1), "sphere:1")
    axes = axes_named(batch.plot(), "angle, degrees")
    (band,) = [own for own in axes.collections if role(own) == "5–95 %"]
    corners = band.get_paths()[0].vertices
    assert np.ptp(corners[:, 1]) < 40


def test_curves_with_their_own_times_have_no_quantiles():
    t = T + np.linspace(0, 1, 12)[:, None]
    figure = rendered(spline_on("r:1", (12, 6), t).plot())
    assert not any("5–95 %" in text for text in texts_of(figure))
    assert len(lines_of(figure.axes[0])) == 3


def test_the_part_of_a_line_in_a_long_gap_is_light():
    t = np.array([0.0, 1, 2, 3, 20, 21, 22, 23])
    spline = ss.CubicSpline(t, np.stack([t, np.sin(t)], axis=-1), "r:2")
    figure = rendered(spline.plot())
    lines = {role(line): line.get_xydata() for line in figure.axes[0].lines}
    assert "curve in a gap, where near the data" in texts_of(figure)
    light, bold = lines["curve in a gap"], lines["curve"]
    x = np.linspace(0, 23, 2000)
    for line, inside in ((light, (x > 3) & (x < 20)), (bold, (x <= 3) | (x >= 20))):
        drawn = line[np.isfinite(line).all(axis=1)]
        expected = spline(x[inside])
        distance = np.linalg.norm(expected[:, None] - drawn, axis=-1)
        size = 0.02 * np.ptp(spline(x), axis=0).max()
        assert distance.min(axis=1).max() < size and distance.min(axis=0).max() < size
    # Neighbours of gaps connect both parts.
    np.testing.assert_array_equal(light[np.isfinite(light).all(axis=1)][[0, -1]], spline(t[[3, 4]]))
    assert not any("long gap" in text for text in texts_of(spline_on("r:2", t=T).plot()))


@pytest.mark.parametrize("name", ["r:2", "r:3", "se:2", "se:3"])
def test_pictures_are_not_as_large_as_a_curve_in_a_long_gap(name):
    """The spline leaves the neighbourhood of its data by ten times their extent."""
    t = np.array([0.0, 1, 2, 3, 60, 61, 62, 63])
    path = np.stack([np.sin(2 * t), np.cos(3 * t), np.sin(t)], axis=-1)[:, : int(name[-1])]
    space = ss.space(name)
    points = path
    if name.startswith("se"):
        points = np.broadcast_to(np.eye(len(path[0]) + 1), (8, *space.point_shape)).copy()
        points[:, :-1, -1] = path
    spline = ss.CubicSpline(t, points, space)
    far = np.abs(spline(np.linspace(3, 60, 50))).max()
    figure = rendered(spline.plot())
    axes = figure.axes[0]
    assert far > 8
    assert all(np.abs(getattr(axes, f"get_{k}lim")()).max() < 5 for k in axes._axis_map)
    bridges = [line for line in axes.lines if role(line) == "curve in a gap"]
    drawn = [np.stack(line.get_data_3d() if name.endswith("3") else line.get_data(), axis=1) for line in bridges]
    finite = np.concatenate([own[np.isfinite(own).all(axis=1)] for own in drawn])
    for node in path[[3, 4]]:
        # In space, the part after the gap is a line of its own.
        assert np.linalg.norm(finite - node, axis=1).min() < (0.2 if name.endswith("3") else 1e-12)
    assert ("after the first gap" in texts_of(figure)) == name.endswith("3")


def test_labels_of_seconds_name_the_minute():
    t = np.datetime64("2026-03-01T10:00", "s") + 10 * np.arange(7)
    axes = axes_named(rendered(spline_on("r:1", (7,), t).plot()), "acceleration")
    labels = [label.get_text() for label in axes.get_xticklabels()]
    assert "10:00:30" in labels and axes.xaxis.get_offset_text().get_text() == "2026-Mar-01"


@pytest.mark.parametrize(
    ("lengths", "text"),
    [((25.0,), "gap of 25"), ((25.0, 70.0), "gaps of up to 70"), (("20s",), "gap of 20 s"), (("3h",), "gap of 3 h")],
)
def test_lengths_of_gaps(lengths, text):
    steps = np.array([1.0] * 6)
    if isinstance(lengths[0], str):
        lengths = np.array([lengths[0][:-1]], float) * {"s": 1, "h": 3600}[lengths[0][-1]]
        t = np.datetime64("2026-03-01T10:00", "ms") + (
            1000 * np.cumsum(np.concatenate([steps, lengths, steps]))
        ).astype("timedelta64[ms]")
    else:
        t = np.cumsum(np.concatenate([steps, *([own, *steps] for own in lengths)]))
    words = texts_of(spline_on("r:1", (len(t),), t).plot())
    assert any(own.startswith(f"{text} without data, ") for own in words)


def test_segments_have_their_own_colours_and_starts():
    parts = [spline_on("r:2", t=T + shift) for shift in (0, 15, 40)]
    curve = ss.SegmentedCurve(parts)
    figure = rendered(curve.plot())
    assert {"segment 0", "segment 1", "segment 2"} <= set(texts_of(figure))
    for axes in (figure.axes[0], *rate_axes(figure)[0]):
        assert len({to_hex(line.get_color()) for line in axes.lines if line.get_gid() == "_curve"}) == 3
    starts = [line.get_xydata()[0] for line in figure.axes[0].lines if role(line) == "start"]
    np.testing.assert_allclose(starts, [part(part.domain[0]) for part in parts])
    figure = curve.plot(color="tab:red", label="track")
    assert "track" in texts_of(figure) and "segment 0" not in texts_of(figure)
    many = ss.SegmentedCurve([spline_on("r:2", t=T + 15 * i) for i in range(7)]).plot()
    assert "segment 0" not in texts_of(many)
    assert len([line for line in many.axes[0].lines if role(line) == "start"]) == 1


@pytest.mark.parametrize("name", ["r:2", "sphere:2", "se:3"])
def test_batches_close_to_their_mean_show_it(name):
    """The line of the mean is that of the Karcher means, and no curve is named."""
    space, rng = ss.space(name), np.random.default_rng(8)
    p = space.random_point(rng)
    v = space.random_tangent(rng, p)
    t = np.cumsum(rng.exponential(1.0, 9))
    path = np.stack([space.exp(p, s * v / space.norm(p, v)) for s in np.linspace(0, 0.9, 9)])
    points = np.broadcast_to(path, (12, *path.shape))
    points = space.exp(points, 0.03 * space.random_tangent(rng, points))
    batch = ss.CubicSpline(t, points, space)
    figure = rendered(batch.plot())
    assert {"mean curve", "single curves", "median of 12 curves", "5–95 % of 12 curves"} <= set(texts_of(figure))
    ends = " (constant twist)" * (name == "se:3")
    assert f"12 curves, 9 points each, natural ends{ends}" in texts_of(figure)
    assert "given points" not in texts_of(figure) and "curve 0" not in texts_of(figure)
    # The mean is smoother than the curves, so that its speed is not among theirs.
    ((median,), *_) = [axes_named(figure, "speed").lines]
    line = median.get_xydata()
    speed = batch.speed(line[:, 0])
    if name == "se:3":
        speed = np.linalg.norm(batch(line[:, 0], 1)[..., :3, 3], axis=-1)
    assert role(median) == "median"
    np.testing.assert_allclose(line[:, 1], np.median(speed, axis=0), atol=1e-9)
    mean = curves_of(batch, Axis())[0][0]
    # The third axis of frames has nearly the usual colour.
    assert to_hex(mean.color) == ("#7b3294" if name == "se:3" else "#0b559f")
    x = mean.x[100:-100:50]
    means = space.mean(np.moveaxis(batch(x), 0, 1))
    assert space.distance(mean.points[100:-100:50], means).max() < 1e-3
    if name in ("r:2", "r:3"):
        drawn = next(line for line in figure.axes[0].lines if line.get_label() == "mean curve")
        drawn = np.stack(drawn.get_data_3d() if name == "r:3" else drawn.get_data(), axis=1)
        np.testing.assert_allclose(drawn[100:-100:50], batch(x).mean(axis=0), atol=1e-6)
    # Far from each other, some of the curves have their names instead.
    centres = space.exp(p, 0.3 * space.random_tangent(rng, np.broadcast_to(p, (12, 1, *space.point_shape))))
    around = np.broadcast_to(centres, points.shape)
    apart = space.exp(around, 0.05 * space.random_tangent(rng, around))
    assert {"curve 0", "other curves"} <= set(texts_of(ss.CubicSpline(None, apart, space).plot()))


@pytest.mark.parametrize("name", ["r:1", "so:3", "spd:2", "torus:2"])
def test_batches_close_to_their_mean_show_it_with_quantiles(name):
    space, rng = ss.space(name), np.random.default_rng(8)
    path = points_around(space, rng, (7,))
    points = np.broadcast_to(path, (12, *path.shape))
    batch = ss.CubicSpline(None, space.exp(points, 0.02 * space.random_tangent(rng, points)), space)
    figure = rendered(batch.plot())
    texts = texts_of(figure)
    assert {"median of 12 curves", "5–95 % of 12 curves"} <= set(texts) and "curve 0" not in texts
    ends = "natural ends" + ", affine-invariant metric" * name.startswith("spd")
    assert "mean curve" in texts and ("mean\ncurve" in texts) == (name == "spd:2")
    assert ("rotation vector log(R R₀ᵀ) in rad, R₀: start of the mean curve" in texts) == (name == "so:3")
    (median,) = (line for line in axes_named(figure, "distance").lines if role(line) == "median")
    mean, (x, y) = curves_of(batch, Axis())[0][0], median.get_data()
    middle = mean.data.evaluate(x, "point", "raise", False)
    np.testing.assert_allclose(y, np.median(space.distance(middle, batch(x)), axis=0), atol=1e-9)
    assert "start" not in texts and f"12 curves, 7 points each, {ends}" in texts
    if name == "so:3":
        # Rotations of several curves are graphs, with the quantiles of all of them.
        axes = axes_named(figure, "about x₂")
        (area,) = [own for own in axes.collections if role(own) == "5–95 %"]
        t, y = area.get_paths()[0].vertices.T
        at = np.unique(t)[100]
        first = curves_of(batch, Axis())[0][0].first_point
        vectors = Rotation.from_matrix(batch(at) @ first.T).as_rotvec()[:, 1]
        np.testing.assert_allclose(np.unique(y[t == at]), np.quantile(vectors, [0.05, 0.95]), atol=1e-9)
    if name == "spd:2":
        # The ellipses of the other curves are around those of the mean.
        given, *others = (own for own in figure.axes[0].collections if isinstance(own, PolyCollection))
        assert [role(own) for own in others] == ["single curves"] * 12
        assert len({tuple(own.get_offsets()[3]) for own in (given, *others)}) == 1
        assert len(np.unique(given.get_edgecolor(), axis=0)) == 1
        widths = [[np.ptp(path.vertices[:, 0]) for path in own.get_paths()] for own in (given, *others)]
        np.testing.assert_allclose(widths[0], np.mean(widths[1:], axis=0), rtol=0.03)
    if name == "r:1":
        drawn = next(line for line in figure.axes[0].lines if line.get_label() == "mean curve")
        np.testing.assert_allclose(drawn.get_ydata(), batch(drawn.get_xdata()).mean(axis=0)[:, 0], atol=1e-9)


@pytest.mark.parametrize("name", ["r:2", "se:2"])
@pytest.mark.parametrize(("across", "high"), [(50.0, 5.0), (20.0, 25.0), (5.0, 4.0), (3.0, 0.0), (0.0, 0.0)])
def test_pages_have_the_proportions_of_curves_in_the_plane(name, across, high):
    """Long curves are above their rates, and fill their axes."""
    t = np.sort(np.random.default_rng(0).uniform(0, 9, 30))
    path = np.stack([across * t / np.ptp(t), high * np.sin(t)], axis=-1)
    points = path
    if name == "se:2":
        points = np.broadcast_to(np.eye(3), (30, 3, 3)).copy()
        points[:, :2, 2] = path
    figure = rendered(ss.CubicSpline(t - t[0], points, name).plot())
    picture, rate = figure.axes[:2]
    box = picture.get_window_extent()
    is_long = across > 2 * 2 * high
    assert (rate.get_window_extent().y1 < box.y0) == is_long
    for low, top in (picture.get_xlim(), picture.get_ylim()):
        assert top > low
    if across and high:
        shares = np.ptp(path, axis=0) / [np.ptp(picture.get_xlim()), np.ptp(picture.get_ylim())]
        assert shares.max() > 0.8 and shares.min() > 0.3


@pytest.mark.parametrize("name", ["r:3", "se:3"])
@pytest.mark.parametrize(
    ("sides", "is_long"), [((9, 2, 1), True), ((-1, 9, 1), True), ((2, 1, 9), False), ((9, 8, 1), False)]
)
def test_long_curves_in_space_are_above_their_rates(name, sides, is_long):
    """They run to the right, and turning and moving have a column of rates each."""
    t = np.array([0, 0.5, 1.8, 2.0, 3.1, 4.0])
    path = np.stack([t / 4, np.sin(t) / 2, (t / 4) ** 2], axis=1)[:, np.argsort(np.argsort(-np.abs(sides)))] * sides
    points = path
    if name == "se:3":
        points = np.broadcast_to(np.eye(4), (len(t), 4, 4)).copy()
        points[:, :3, 3] = path
    figure = rendered(ss.CubicSpline(t, points, name).plot())
    picture = figure.axes[0]
    speed, bend = (axes_named(figure, word).get_window_extent() for word in ("speed", "acceleration"))
    assert (speed.y1 < picture.get_window_extent().y0 + 0.2 * picture.get_window_extent().height) == is_long
    assert bend.x0 == pytest.approx(speed.x0)
    line = next(own for own in picture.lines if own.get_gid() == "_curve")
    x, *_ = proj3d.proj_transform(*line.get_data_3d(), picture.get_proj())
    assert x[-1] > x[0] or not is_long
    if name == "se:3":
        turning = axes_named(figure, "turning rate").get_window_extent()
        assert (turning.x1 < speed.x0 and turning.y0 == pytest.approx(speed.y0)) == is_long


def test_numbers_in_axes_of_the_user_count_from_zero():
    x = 5e6 + np.array([0.0, 3.0, 1.0, 7.0])
    spline = ss.CubicSpline(None, x[:, None], "r:1")
    ax = Figure().add_subplot()
    spline.plot(ax=ax)
    assert ax.lines[0].get_ydata().min() > 4e6 and ax.get_ylabel() == "x"
    page = spline.plot().axes[0]
    assert page.get_ylabel() == "x − 5000000" and page.lines[0].get_ydata().max() < 10

"""Pictures in small axes and on small pages, dark styles, and the space that boxes fill."""

import warnings
from itertools import product

import matplotlib.style
import numpy as np
import pytest
from drawn import axes_named, rate_axes, rendered, spline_on, texts_of
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import proj3d
from test_figure import KINDS

import symspline as ss
from symspline._plotting.style import plain

ONE_OF_EACH = {draw: name for name, draw in KINDS.items()}.values()


def widest(axes):
    return max(line.get_linewidth() for line in axes.lines if line.get_gid() == "_curve")


# ---- small axes and pages ----


@pytest.mark.parametrize("name", ONE_OF_EACH)
def test_small_axes_can_be_laid_out(name):
    """The layout of matplotlib succeeds, and nothing is far outside the axes."""
    figure = Figure(figsize=(3, 2.4), layout="constrained")
    axes = figure.add_subplot(projection="3d" if name in ("euclidean:3", "se:3") else None)
    spline_on(name).plot(ax=axes, title="small")
    with warnings.catch_warnings():
        # A layout that fails issues a warning.
        warnings.simplefilter("error")
        rendered(figure)
    box, page = axes.get_tightbbox(), figure.bbox
    # Boxes in three dimensions have labels that layouts do not know exactly.
    most = 30 if axes.name == "3d" else 15
    assert page.x0 - most < box.x0 < box.x1 < page.x1 + most and page.y0 - most < box.y0 < box.y1 < page.y1 + most


def test_lines_are_thinner_in_small_axes():
    large, small = (Figure(figsize=size).add_subplot() for size in ((8, 6), (2, 2)))
    for axes in (large, small):
        spline_on("r:2").plot(ax=axes)
    assert widest(small) < 0.7 * widest(large) == pytest.approx(0.7 * 2.4)


def test_frames_are_smaller_in_small_axes():
    lengths = []
    for size in ((9, 4), (3, 2.4)):
        axes = Figure(figsize=size).add_subplot()
        spline_on("so:3").plot(ax=axes)
        arrows = next(own for own in axes.collections if type(own).__name__ == "Quiver")
        lengths.append(np.hypot(arrows.U, arrows.V).max() / arrows.scale)
    assert 0.1 < lengths[1] < 0.8 * lengths[0] < 0.5


@pytest.mark.parametrize("name", ["so:3", "se:3", "sphere:2", "spd:5", "gr:2,3"])
@pytest.mark.parametrize("size", [(6, 4), (5, 6)])
def test_small_pages_keep_their_text_inside(name, size):
    figure = rendered(spline_on(name).plot(figsize=size))
    assert tuple(figure.get_size_inches()) == size
    for text in figure.findobj(matplotlib.text.Text):
        if text.get_text() and text.get_visible() and "axis" not in str(text.get_gid()):
            box = text.get_window_extent()
            centre = (box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2
            inside = figure.bbox.contains(*centre)
            assert inside or text.axes is None or text.axes.name == "3d", (text.get_text(), box)
    label = rate_axes(figure)[0][0].yaxis.label
    # The page would be 11 inches wide or wider.
    assert label.get_fontsize() < 8


def test_large_pages_keep_the_size_of_text():
    figure = spline_on("so:3").plot(figsize=(20, 15))
    assert rate_axes(figure)[0][0].yaxis.label.get_fontsize() == pytest.approx(10)


# ---- boxes ----


@pytest.mark.parametrize("shape", [(1, 1, 1), (5, 1, 0.5), (1, 1, 8)])
def test_boxes_fill_their_panel(shape):
    points = np.random.default_rng(3).normal(size=(12, 3)) * shape
    figure = rendered(ss.CubicSpline(None, points, "r:3").plot())
    axes = figure.axes[0]
    limits = [axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]
    x, y, _ = proj3d.proj_transform(*np.array(list(product(*limits))).T, axes.get_proj())
    corners = axes.transData.transform(np.column_stack([x, y]))
    panel = figure.subfigs[0].bbox
    share = np.ptp(corners, axis=0) / [panel.width, panel.height]
    assert share.max() > 0.7 and share.max() < 1
    assert panel.contains(*corners.min(axis=0)) and panel.contains(*corners.max(axis=0))


# ---- numbers on axes, factors and limits ----


def test_small_rates_have_a_power_of_ten():
    figure = rendered(spline_on("sphere:3", t=1e6 * np.arange(6.0)).plot())
    axes = axes_named(figure, "acceleration")
    assert axes.yaxis.get_offset_text().get_text() == "×10⁻¹²"
    numbers = [own.get_text() for own in axes.get_yticklabels()]
    assert all(len(number) < 6 for number in numbers)


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ((1e-8, 5e-8), "×10⁻⁸"),
        ((-1e9, 1e9), "×10⁹"),
        ((5.2e6 - 20, 5.2e6 + 20), "+5.2×10⁶"),
        ((-1e6 - 1e-2, -1e6), "−1×10⁶"),
        ((0, 4e-4), "×10⁻⁴"),
        ((0, 100), ""),
    ],
)
def test_powers_and_differences_are_plain_text(limits, expected):
    axes = Figure().add_subplot()
    plain(axes)
    axes.set_ylim(limits)
    rendered(axes.figure)
    assert axes.yaxis.get_offset_text().get_text() == expected
    assert not any("$" in label.get_text() for label in axes.get_yticklabels())


def test_equal_factors_have_numbers():
    angles = tuple(ss.Sphere(1).from_angles(np.linspace(k, 2 + k, 5)) for k in range(3))
    texts = texts_of(ss.CubicSpline(None, angles, "s:1 x s:1 x s:1").plot())
    assert [f"factor {k}: Sphere(1)" in texts for k in range(3)] == [True] * 3
    # Rates are below the picture of their factor.
    assert texts.count("velocity\nγ′, rad/t") == 3
    texts = texts_of(ss.CubicSpline(None, (*angles, *angles), " x ".join(["s:1"] * 6)).plot())
    assert {"velocity\nγ′, rad/t of factor 5", "acceleration\n∇γ′, rad/t² of factor 0"} <= set(texts)
    grid = ss.GridSpline((np.arange(4.0), np.arange(3.0)), (np.zeros((4, 3, 2)),) * 2, "r:2 x r:2")
    assert "factor 1: Euclidean(2), vectors" in texts_of(grid.plot())
    texts = texts_of(spline_product().plot())
    assert "Sphere(1)" in texts and not any("factor" in text for text in texts)


def spline_product():
    return ss.CubicSpline(None, (ss.Sphere(1).from_angles(np.arange(4.0)), np.arange(4.0)[:, None]), "s:1 x r:1")


def test_angles_on_a_torus_have_no_jumps():
    angles = np.column_stack([np.linspace(2, 9, 8), np.linspace(-1, 1, 8)])
    spline = ss.CubicSpline(None, (angles + np.pi) % (2 * np.pi) - np.pi, "torus:2")
    figure = rendered(spline.plot())
    axes = axes_named(figure, "angles, degrees")
    for line, given in zip((own for own in axes.lines if own.get_gid() == "_curve"), angles.T, strict=True):
        np.testing.assert_allclose(np.interp(np.arange(8), *line.get_data()), np.degrees(given), atol=1e-9)
    for dots, given in zip((own for own in axes.lines if own.get_label() == "_given"), angles.T, strict=True):
        np.testing.assert_allclose(dots.get_ydata(), np.degrees(given), atol=1e-9)
    # Data are close to the first curve, and the quantiles of a batch to its mean.
    t = np.array([1.3, 6.6])
    both = rendered(ss.plot([spline, (t, np.array([[3.4 - 2 * np.pi, -0.5], [8.4, 0.9]]))]))
    dots = next(line for line in axes_named(both, "x₁").lines if line.get_label() == "_data")
    np.testing.assert_allclose(dots.get_ydata(), np.degrees([3.4, 8.4]), atol=1e-9)
    many = spline.space.exp(spline.points, np.linspace(-0.1, 0.1, 9)[:, None, None] * [1.0, 1.0])
    axes = axes_named(rendered(ss.CubicSpline(None, many, "torus:2").plot()), "x₁")
    (area,) = (own for own in axes.collections if own.get_label() == "_quantiles")
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
        [line.get_ydata()[0] for line in axes.lines if line.get_label() == "_limit"]
        for column in rate_axes(figure)
        for axes in column
    ]
    assert found == [[0.75, -0.75], [], [], [0.5, -0.5]]
    assert "limit" in texts_of(figure)
    # Other laws are functions without limits.
    figure = path.retime(lambda x, nu: x if nu == 0 else (x * 0 + (nu == 1)), domain=(0.0, 2.0)).plot()
    assert "limit" not in texts_of(figure)


def test_noise_on_the_earth_is_in_metres():
    rng = np.random.default_rng(0)
    lon, lat = np.linspace(5, 6, 40), 52 + 1e-3 * rng.normal(size=40)
    spline = ss.make_smoothing_spline(np.arange(40.0), ss.geo.from_lonlat(lon, lat), "sphere:2")
    (words,) = [text for text in texts_of(ss.geo.plot(spline)) if "noise" in text]
    assert float(words.split("noise ")[1].split(" m")[0]) == pytest.approx(6371008.8 * float(spline.sigma), rel=0.01)


# ---- dark styles ----


def lightness(color):
    return np.mean(to_rgb(color))


@pytest.fixture
def dark():
    with matplotlib.style.context("dark_background"):
        yield


@pytest.mark.parametrize("name", ["so:3", "spd:3", "sphere:2", "r:2", "se:3", "u:1"])
def test_grids_follow_dark_styles(name, dark):
    space, rng = ss.space(name), np.random.default_rng(1)
    middle = space.random_point(rng)
    around = np.broadcast_to(middle, (5, 4, *space.point_shape))
    points = space.project(space.exp(middle, 0.2 * space.random_tangent(rng, around)))
    figure = rendered(ss.GridSpline((np.arange(5.0), np.arange(4.0)), points, space).plot())
    assert to_rgb(figure.get_facecolor()) == (0, 0, 0)
    assert all(lightness(text.get_color()) > 0.5 for text in figure.texts)
    for axes in figure.axes:
        for own in (axes.xaxis, axes.yaxis):
            assert all(lightness(tick.get_color()) > 0.5 for tick in own.get_ticklabels())


def test_colours_with_a_meaning_are_not_inverted(dark):
    """The key of tensors shows pure red, green and blue, and ellipses over the image stay dark."""
    points = np.tile(np.diag([3.0, 1.0, 1.0]), (5, 4, 1, 1))
    figure = ss.GridSpline((np.arange(5.0), np.arange(4.0)), points, "spd:3").plot()
    bars = [patch.get_facecolor() for axes in figure.axes for patch in axes.patches]
    assert bars == [(1, 0, 0, 1), (0, 1, 0, 1), (0, 0, 1, 1)]
    (image,) = axes_named(figure, "field").images
    red = image.get_array()[0, 0]
    assert red[0] > 0.95 and red[1] < 0.6
    ellipses = axes_named(figure, "field").collections[-1]
    assert lightness(ellipses.get_edgecolor()[0][:3]) < 0.3

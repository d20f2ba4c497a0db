"""Pictures of curves: what is in them, and what they leave alone."""

import subprocess
import sys
from io import BytesIO

import matplotlib
import numpy as np
import pytest
from matplotlib.dates import date2num
from matplotlib.figure import Figure

import symspline as ss
from symspline.lonlat import from_lonlat
from symspline.plotting import components, disk, flat, frames, globe, sphere
from symspline.plotting.pictures import picture_of

KINDS = {
    "euclidean:1": flat.draw_graph,
    "euclidean:2": flat.draw_plane,
    "euclidean:3": flat.draw_room,
    "euclidean:5": components.draw_components,
    "sphere:1": sphere.draw_angle,
    "sphere:2": sphere.draw_sphere,
    "sphere:3": frames.draw_quaternions,
    "sphere:15": components.draw_components,
    "hyperbolic:1": components.draw_components,
    "hyperbolic:2": disk.draw_disk,
}


def points_on(space, rng, shape):
    """Points less than a radian or so from each other."""
    middle = space.random_point(rng)
    around = np.broadcast_to(middle, (*shape, *space.point_shape))
    return space.project(space.exp(middle, 0.3 * space.random_tangent(rng, around)))


def spline_on(name, shape=(6,), t=None, **options):
    space = ss.space(name)
    return ss.CubicSpline(t, points_on(space, np.random.default_rng(1), shape), space, **options)


def rendered(figure):
    """The figure, drawn: any warning would be an error."""
    file = BytesIO()
    figure.savefig(file, format="png", dpi=40)
    assert file.getvalue().startswith(b"\x89PNG")
    return figure


def axes_named(figure, label):
    """The axes whose vertical axis has a label, or which have the name themselves."""
    (found,) = [axes for axes in figure.axes if label in (axes.get_ylabel().split("\n")[0], axes.get_label())]
    return found


def lines_of(axes):
    return [line.get_xydata() for line in axes.lines]


def texts_of(figure):
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text)]


# ---- every kind ----


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("shape", [(6,), (3, 6)], ids=["one curve", "batch"])
def test_every_space_is_drawn(name, shape):
    spline = spline_on(name, shape)
    assert picture_of(spline.space).draw is KINDS[name]
    figure = rendered(spline.plot())
    assert isinstance(figure, Figure)
    assert f"C² spline on {spline.space!r}" in texts_of(figure)
    curves = shape[0] if len(shape) > 1 else 1
    for label, nu in (("speed", 1), ("acceleration", 2)):
        lines = lines_of(axes_named(figure, label))
        assert len(lines) == curves
        for line, curve in zip(lines, spline if len(shape) > 1 else [spline], strict=True):
            norm = spline.space.norm(curve(line[:, 0]), curve(line[:, 0], nu))
            np.testing.assert_allclose(line[:, 1], norm, atol=1e-6)


@pytest.mark.parametrize("name", KINDS)
def test_a_curve_that_stands_still(name):
    point = ss.space(name).random_point(np.random.default_rng(3))
    figure = ss.CubicSpline(None, np.stack([point] * 3), name).plot()
    assert axes_named(figure, "speed").get_ylim()[1] > 0.5


def test_knots_are_marked():
    t = [0.0, 0.5, 2.0, 3.5]
    for label in ("speed", "acceleration"):
        (marks,) = axes_named(spline_on("r:2", (4,), t).plot(), label).collections
        np.testing.assert_array_equal([path[0, 0] for path in marks.get_segments()], t)


def test_many_knots_are_marked_at_the_bottom():
    (marks,) = axes_named(spline_on("r:2", (5000,)).plot(), "speed").collections
    assert len(marks.get_segments()) < 2500
    assert marks.get_segments()[0][1, 1] < 0.1


def test_rounding_is_not_blown_up():
    """A great circle at constant speed has acceleration 0, whatever the rounding."""
    angle = np.arange(5)
    spline = ss.CubicSpline(None, np.stack([np.cos(angle), np.sin(angle)], axis=-1), "sphere:1")
    assert axes_named(spline.plot(), "acceleration").get_ylim()[1] > 0.1


# ---- batches, times, products ----


def test_batch_is_thinned_with_a_note():
    figure = spline_on("r:2", (7, 10, 4)).plot()
    assert len(axes_named(figure, "speed").lines) == 50
    assert "50 of 70 curves, 4 points each, natural ends" in texts_of(figure)


def test_bad_curves_are_left_out():
    good = [[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]
    points = [good, [[1.0, 0, 0], [-1, 0, 0], [0, 1, 0]], good]
    figure = rendered(ss.CubicSpline(None, points, "sphere:2", on_failure="ignore").plot())
    assert len(axes_named(figure, "speed").lines) == 2
    assert "2 of 3 curves, 3 points each, natural ends, 1 not converged" in texts_of(figure)
    with pytest.raises(ss.ValidationError, match="nothing to plot"):
        ss.CubicSpline(None, points[1], "sphere:2", on_failure="ignore").plot()


def test_unconverged_curve_is_drawn_and_named():
    figure = spline_on("sphere:2", max_iter=1, on_failure="ignore").plot()
    assert any(text.endswith("not converged") for text in texts_of(figure))


@pytest.mark.parametrize(
    "name, unit, step",
    [
        ("r:1", "us", 500),
        ("r:2", "s", 3),
        ("r:1", "m", 70),
        ("r:2", "h", 10),
        ("r:1", "D", 1),
        ("r:2", "D", 300),
    ],
)
def test_dates(name, unit, step):
    t = np.datetime64("2024-02-27", unit) + step * np.array([0, 1, 2, 4, 5]).astype(f"timedelta64[{unit}]")
    figure = rendered(spline_on(name, (5,), t).plot())
    axes = axes_named(figure, "speed")
    np.testing.assert_allclose(axes.lines[0].get_xdata()[[0, -1]], date2num(t[[0, -1]]), rtol=0, atol=2e-11)
    assert axes.get_ylabel().endswith("1/s")
    labels = [text.get_text() for text in axes_named(figure, "acceleration").get_xticklabels()]
    assert 2 <= sum(map(bool, labels)) <= 12


def test_curves_with_dates_of_their_own():
    t = np.array([["2024-01-01", "2024-01-03"], ["2024-01-02", "2024-01-09"]], "datetime64[D]")
    lines = lines_of(axes_named(rendered(spline_on("r:2", (2, 2), t).plot()), "speed"))
    for line, dates in zip(lines, t, strict=True):
        np.testing.assert_allclose(line[[0, -1], 0], date2num(dates))


def test_nanoseconds_are_finer_than_dates_on_an_axis():
    t = np.datetime64("2024-01-01", "ns") + np.arange(5) * np.timedelta64(100, "ns")
    axes = axes_named(rendered(spline_on("r:2", (5,), t).plot()), "acceleration")
    assert axes.get_xlabel().startswith("seconds since 2024-01-01")
    np.testing.assert_allclose(axes.lines[0].get_xdata()[[0, -1]], [0, 4e-7], atol=1e-15)


def test_large_whole_numbers_as_times():
    t = 1_700_000_000_000_000_000 + 10**9 * np.arange(4)
    axes = axes_named(rendered(spline_on("r:2", (4,), t).plot()), "speed")
    np.testing.assert_allclose(axes.lines[0].get_xdata()[[0, -1]], t[[0, -1]].astype(float))


@pytest.mark.parametrize("shape", [(5,), (3, 5)], ids=["one curve", "batch"])
def test_product_has_a_picture_a_factor(shape):
    space = ss.space("sphere:2 x sphere:3 x h:2 x r:4")
    rng = np.random.default_rng(2)
    spline = ss.CubicSpline(None, tuple(points_on(s, rng, shape) for s in space.factors), space)
    figure = rendered(spline.plot())
    assert {repr(factor) for factor in space.factors} <= set(texts_of(figure))
    first = spline[0] if len(shape) > 1 else spline
    line = lines_of(axes_named(figure, "speed"))[0]
    np.testing.assert_allclose(line[:, 1], first.speed(line[:, 0]), atol=1e-12)
    assert len(figure.axes) == 4 + 2


def test_product_of_many_factors():
    spline = ss.CubicSpline(None, (np.arange(4.0)[:, None],) * 7, " x ".join(["r:1"] * 7))
    figure = rendered(spline.plot())
    assert "4 points, natural ends, 6 of 7 factors" in texts_of(figure)
    assert len(figure.axes) == 6 + 2


# ---- the pictures ----


MERIDIAN = np.array([[1.0, 0, 0], [1, 0, 1], [0, 0, 1], [-1, 0, 2], [-1, 0, 0]])
DATE_LINE = from_lonlat([150, 170, -170, 175, -160], [-20, 10, 20, 30, 40])
ROUND = from_lonlat([0, 120, 240, 360], [10, 20, 30, 10])
NEAR_POLE = from_lonlat([20, 25, -150, -140], [40, 80, 85, 30])


@pytest.mark.parametrize("points", [MERIDIAN, -MERIDIAN, DATE_LINE, ROUND, NEAR_POLE, ROUND[::-1]])
def test_no_line_jumps_across_the_map(points):
    spline = ss.CubicSpline(None, ss.Sphere(2).project(points), "sphere:2")
    line = lines_of(axes_named(rendered(spline.plot()), "map"))[0]
    steps = np.abs(np.diff(line, axis=0))
    assert np.isnan(line).any()
    assert np.nanmax(steps[:, 0]) < 60 and np.nanmax(steps[:, 1]) < 5
    assert np.nanmax(np.abs(line), axis=0) == pytest.approx([180, 90], abs=90)


def test_map_line_is_broken_where_it_leaves_the_map():
    broken = sphere.broken(np.array([[170.0, 10], [-170, 20], [-160, 30]]))
    np.testing.assert_array_equal(
        broken, [[170, 10], [180, 15], [np.nan] * 2, [-180, 15], [-170, 20], [-160, 30]]
    )
    broken = sphere.broken(np.array([[30.0, 88], [-150, 89]]))
    np.testing.assert_array_equal(broken, [[30, 88], [30, 90], [np.nan] * 2, [-150, 90], [-150, 89]])


def test_longitude_at_a_pole_is_that_before():
    places = sphere.lonlat_of(from_lonlat([50, 50, 50, -130], [80, 89, 90, 89]))
    np.testing.assert_allclose(places[:, 0], [50, 50, 50, -130])
    places = sphere.lonlat_of(np.array([[0, 0, 1.0], [0, 0.6, 0.8]]))
    np.testing.assert_allclose(places[:, 0], [90, 90])


def test_globe_is_turned_towards_the_curve():
    rng = np.random.default_rng(4)
    for size in (1e-5, 0.1, 0.6):
        points = ss.Sphere(2).project(from_lonlat(130, -40) + size * rng.uniform(-1, 1, (30, 3)))
        view = globe.View.above(*globe.middle_of(points))
        assert (points @ view.up > 0).all()
        assert np.linalg.norm(view.flat(points), axis=-1).max() < 1.8 * size
    equator = from_lonlat(np.arange(0, 360, 5), 0)
    view = globe.View.above(*globe.middle_of(equator))
    assert np.ptp(view.flat(equator), axis=0).min() > 0.5  # not seen from its edge


@pytest.mark.parametrize("lon, lat", [(10, 50), (179.9, 0), (40, 89), (0, -89.9)])
@pytest.mark.parametrize("size", [1e-5, 10])
def test_small_curve_is_enlarged_with_labels(lon, lat, size):
    rng = np.random.default_rng(5)
    offsets = np.radians(size) * rng.uniform(-1, 1, (6, 3))
    spline = ss.CubicSpline(None, ss.Sphere(2).project(from_lonlat(lon, lat) + offsets), "sphere:2")
    axes = rendered(spline.plot()).axes[0]
    assert np.ptp(axes.get_xlim()) < 10 * np.radians(size)
    for axis, letters in ((axes.xaxis, "°EW"), (axes.yaxis, "°NS")):
        labels = [text.get_text() for text in axis.get_ticklabels()]
        assert 1 <= len(labels) <= 12 and all(set(label) & set(letters) for label in labels)


def test_degrees():
    values = [-30, 0, 30, 180, -180, 190, 12.5]
    words = ["30°W", "0°", "30°E", "180°", "180°", "170°W", "12.5°E"]
    assert [globe.degrees(value, "E", "W") for value in values] == words


def test_angle_does_not_jump():
    angle = 1.3 * np.arange(12)
    spline = ss.CubicSpline(None, np.stack([np.cos(angle), np.sin(angle)], axis=-1), "sphere:1")
    line = lines_of(axes_named(spline.plot(), "angle, degrees"))[0]
    np.testing.assert_allclose(line[-1, 1], np.degrees(angle[-1]))
    assert np.abs(np.diff(line[:, 1])).max() < 5


def test_quaternions_as_rotations():
    half = np.sqrt(0.5)
    about_z = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    np.testing.assert_allclose(frames.rotations(np.array([half, 0, 0, half])), about_z, atol=1e-15)
    q = ss.Sphere(3).random_point(np.random.default_rng(6), 20)
    matrices = frames.rotations(q)
    np.testing.assert_allclose(
        matrices @ matrices.swapaxes(1, 2), np.broadcast_to(np.eye(3), (20, 3, 3)), atol=1e-14
    )
    np.testing.assert_allclose(np.linalg.det(matrices), 1)
    np.testing.assert_allclose(frames.rotations(-q), matrices)
    np.testing.assert_allclose(frames._VIEW @ frames._VIEW.T, np.eye(3), atol=1e-3)


def test_given_frames_are_bold():
    spline = spline_on("sphere:3", (4,), [0, 1, 2.5, 4])
    faint, bold = (q for q in spline.plot().axes[0].collections if hasattr(q, "U"))
    np.testing.assert_allclose(np.unique(bold.X), spline.t)
    assert bold.width > faint.width and len(faint.X) > len(bold.X)
    right_up = np.sort(np.hypot(bold.U, bold.V).reshape(4, 3))
    lengths = np.linalg.norm((frames._VIEW @ frames.rotations(spline.points))[:, :2], axis=1)
    np.testing.assert_allclose(right_up, 0.7 * np.sort(lengths), atol=1e-12)


def test_poincare_disk():
    plane, origin = ss.Hyperbolic(2), np.array([1.0, 0, 0])
    p = plane.random_point(np.random.default_rng(7), 20)
    places = disk.flat(p, origin)
    np.testing.assert_allclose(np.linalg.norm(places, axis=-1), np.tanh(plane.distance(origin, p) / 2))
    np.testing.assert_allclose(disk.flat(p[0], p[0]), 0, atol=1e-14)
    moved = disk.flat(p, p[0])
    np.testing.assert_allclose(
        np.linalg.norm(moved, axis=-1), np.tanh(plane.distance(p[0], p) / 2), atol=1e-7
    )


def test_disk_moves_to_a_curve_that_is_far_away():
    far = [[np.sqrt(1 + x * x + y * y), x, y] for x, y in ((50, 20), (52, 22), (50, 25))]
    figure = rendered(ss.CubicSpline(None, far, "h:2").plot())
    assert any("middle: (" in text for text in texts_of(figure))
    assert np.abs(lines_of(figure.axes[0])[-3]).max() < 0.7  # the curve; after it come its dots


def test_names_of_components():
    assert components.component_names((3,), False) == ["x₁", "x₂", "x₃"]
    assert components.component_names((2, 2), False) == ["x₁₁", "x₁₂", "x₂₁", "x₂₂"]
    assert components.component_names((2,), True) == ["Re x₁", "Im x₁", "Re x₂", "Im x₂"]
    assert components.component_names((10, 1), False)[-1] == "x₁₀,₁"
    numbers = components.components(np.array([[1 + 2j, 3 + 4j], [5, 6j]]))
    np.testing.assert_array_equal(numbers, [[1, 2, 3, 4], [5, 0, 0, 6]])
    figure = spline_on("sphere:15").plot()
    (legend,) = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    assert sorted(text.get_text() for text in legend.texts) == sorted(
        components.component_names((12,), False)
    )


# ---- files, and the rest of the program ----


@pytest.mark.parametrize("suffix, start", [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_figure_is_saved(tmp_path, suffix, start):
    path = tmp_path / f"curve.{suffix}"
    assert isinstance(spline_on("r:2").plot(path), Figure)
    assert path.read_bytes().startswith(start)


def test_figure_is_saved_into_an_open_file():
    file = BytesIO()
    spline_on("r:2").plot(file)
    assert file.getvalue().startswith(b"\x89PNG")


def test_notebooks_show_the_figure():
    assert spline_on("r:2").plot()._repr_png_().startswith(b"\x89PNG")


def test_without_matplotlib(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match=r"^plots need matplotlib.*pip install 'symspline\[plot\]'$"):
        spline_on("r:2").plot()


def test_nothing_global_is_touched(tmp_path):
    code = """
import sys, warnings
warnings.simplefilter("error")
import symspline as ss, numpy as np
assert "matplotlib" not in sys.modules
import matplotlib
def settings():  # read so that matplotlib does not choose a backend on the way
    return {name: dict.__getitem__(matplotlib.rcParams, name) for name in matplotlib.rcParams}
before = settings()
ss.CubicSpline(None, np.eye(3), "sphere:2").plot("a.png")
ss.CubicSpline(np.arange(3).astype("datetime64[D]"), np.eye(3), "r:3").plot("b.png")
assert settings() == before
assert "matplotlib.pyplot" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path)

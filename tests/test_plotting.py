"""Pictures of curves: what is in them, and what they leave alone."""

import subprocess
import sys
from io import BytesIO

import matplotlib
import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.dates import date2num
from matplotlib.figure import Figure

import symspline as ss
from symspline.lonlat import from_lonlat
from symspline.plotting import (
    angle,
    bloch,
    components,
    disk,
    dome,
    ellipses,
    flat,
    frames,
    globe,
    poses,
    sphere,
    subspaces,
)
from symspline.plotting.pictures import picture_of

KINDS = {
    "euclidean:1": flat.draw_graph,
    "euclidean:2": flat.draw_plane,
    "euclidean:3": flat.draw_room,
    "euclidean:5": components.draw_components,
    "sphere:1": angle.draw_circle,
    "sphere:2": sphere.draw_sphere,
    "sphere:3": frames.draw_quaternions,
    "sphere:15": components.draw_components,
    "hyperbolic:1": components.draw_components,
    "hyperbolic:2": disk.draw_disk,
    "rp:1": angle.draw_slope,
    "rp:2": dome.draw_lines,
    "rp:4": subspaces.draw_principal_angles,
    "cp:1": bloch.draw_bloch,
    "cp:2": subspaces.draw_principal_angles,
    "ch:2": subspaces.draw_ratios,
    "gr:1,2": angle.draw_slope,
    "gr:1,3": dome.draw_lines,
    "gr:2,3": dome.draw_normals,
    "gr:2,5": subspaces.draw_principal_angles,
    "gr:4,5": subspaces.draw_principal_angles,
    "cgr:1,2": bloch.draw_bloch,
    "cgr:2,3": subspaces.draw_principal_angles,
    "so:2": angle.draw_turn,
    "so:3": frames.draw_rotations,
    "so:4": components.draw_components,
    "o:2": angle.draw_turn,
    "o:3": frames.draw_rotations,
    "u:1": angle.draw_phase,
    "u:3": components.draw_components,
    "su:2": frames.draw_spins,
    "su:3": components.draw_components,
    "spd:1": components.draw_components,
    "spd:2": ellipses.draw_ellipses,
    "spd:3": ellipses.draw_ellipsoids,
    "spd:4": components.draw_components,
    "hpd:2": components.draw_components,
    "se:2": poses.draw_flat_poses,
    "se:3": poses.draw_poses,
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


def dots_of(axes):
    """Where the dots of the only curve are, near and far side together: all, and the first."""
    dots = [line.get_xydata() for line in axes.lines if line.get_marker() == "o"]
    return [np.where(np.isnan(far), near, far) for far, near in zip(dots[:2], dots[2:], strict=True)]


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
@pytest.mark.parametrize("name", ["sphere:2 x sphere:3 x h:2 x r:4", "cp:1 x gr:2,3 x spd:3 x u:3"])
def test_product_has_a_picture_a_factor(name, shape):
    space = ss.space(name)
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


TURN = 1.3 * np.arange(12)
DIRECTION = np.stack([np.cos(TURN), np.sin(TURN)], axis=-1)
TURNED = np.stack([DIRECTION, DIRECTION[:, ::-1] * [-1, 1]], axis=-1)
SIGNS = np.random.default_rng(9).choice([-1, 1], (12, 1))


@pytest.mark.parametrize(
    "name, points",
    [
        ("sphere:1", DIRECTION),
        ("so:2", TURNED),
        ("o:2", TURNED * [1, -1]),
        ("u:1", np.exp(1j * TURN)[:, None, None]),
        ("rp:1", DIRECTION * SIGNS),
        ("gr:1,2", (DIRECTION * SIGNS)[:, :, None]),
    ],
)
def test_angle_does_not_jump(name, points):
    spline = ss.CubicSpline(None, points, name)
    line = lines_of(axes_named(spline.plot(), "angle, degrees"))[0]
    np.testing.assert_allclose(line[-1, 1] - line[0, 1], np.degrees(TURN[-1]))
    assert np.abs(np.diff(line[:, 1])).max() < 5
    assert (line[0, 1] - np.degrees(TURN[0])) % 180 == pytest.approx(0, abs=1e-9)


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
    np.testing.assert_allclose(frames.VIEW @ frames.VIEW.T, np.eye(3), atol=1e-3)


def test_spins_as_rotations():
    """U (v·σ) U* = (Rv)·σ."""
    pauli = np.array([[[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]]])
    u = ss.SpecialUnitary(2).random_point(np.random.default_rng(10), 20)
    turned = u[:, None] @ pauli @ u[:, None].conj().swapaxes(-1, -2)
    matrices = frames.rotations(frames.quaternions(u))
    np.testing.assert_allclose(np.einsum("mij,ikl->mjkl", matrices, pauli), turned, atol=1e-14)


@pytest.mark.parametrize(
    "name, rotations",
    [
        ("sphere:3", frames.rotations),
        ("so:3", np.array),
        ("o:3", np.array),
        ("su:2", lambda u: frames.rotations(frames.quaternions(u))),
    ],
)
def test_given_frames_are_bold(name, rotations):
    spline = spline_on(name, (4,), [0, 1, 2.5, 4])
    faint, bold = (q for q in spline.plot().axes[0].collections if hasattr(q, "U"))
    np.testing.assert_allclose(np.unique(bold.X), spline.t)
    assert bold.width > faint.width and len(faint.X) > len(bold.X)
    right_up = np.sort(np.hypot(bold.U, bold.V).reshape(4, 3))
    lengths = np.linalg.norm((frames.VIEW @ rotations(spline.points))[:, :2], axis=1)
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


BLOCH = {
    (1, 0): (0, 0, 1),
    (0, 1j): (0, 0, -1),
    (0.5**0.5, 0.5**0.5): (1, 0, 0),
    (0.5**0.5, 0.5**0.5 * 1j): (0, 1, 0),
    (0.6, 0.8j): (0, 0.96, -0.28),
}


def test_bloch_vectors():
    states = np.array(list(BLOCH))
    vectors = bloch.bloch_vectors(states)
    np.testing.assert_allclose(vectors, list(BLOCH.values()), atol=1e-15)
    np.testing.assert_allclose(bloch.bloch_vectors(states[:, :, None] * np.exp(2j)), vectors, atol=1e-15)
    p, q = ss.ComplexProjective(1).random_point(np.random.default_rng(11), (2, 20))
    angle = np.arccos(np.sum(bloch.bloch_vectors(p) * bloch.bloch_vectors(q), axis=1))
    np.testing.assert_allclose(angle, 2 * ss.ComplexProjective(1).distance(p, q))


@pytest.mark.parametrize("size, zoomed", [(0.3, False), (0.03, True)])
def test_states_are_drawn_on_the_bloch_sphere(size, zoomed):
    """The dots are a right-angled projection of the Bloch vectors, as the labels are, with |0⟩ up."""
    space, rng = ss.ComplexProjective(1), np.random.default_rng(12)
    middle = space.random_point(rng)
    points = space.exp(middle, size * space.random_tangent(rng, np.stack([middle] * 8)))
    figure = rendered(ss.CubicSpline(None, points, "cp:1").plot())
    axes, vectors = figure.axes[0], bloch.bloch_vectors(points)
    places, first = dots_of(axes)
    view = np.linalg.lstsq(vectors, places)[0]
    np.testing.assert_allclose(vectors @ view, places, atol=1e-9)
    np.testing.assert_allclose(view.T @ view, np.eye(2), atol=1e-9)
    np.testing.assert_array_equal(first, places[:1])
    labels = {text.get_text(): text.get_position() for text in axes.texts}
    assert not labels if zoomed else labels.keys() == {"|0⟩", "|1⟩", "x", "y"}
    for label, direction in {"|0⟩": 2, "x": 0, "y": 1}.items() if labels else ():
        np.testing.assert_allclose(labels[label], 1.17 * view[direction], atol=1e-9)
    assert not labels or labels["|0⟩"][1] > 1 > -1 > labels["|1⟩"][1]


# Through the rim three times, and along it.
HALF_SPHERE = ss.Sphere(2).project(
    np.array([[1.0, 0, 1], [1, 0.5, 0.2], [0.5, 1, -0.3], [-0.5, 1, -0.2], [-1, 0, 0.3], [-1, -1, -0.4]])
)
RIM = ss.Sphere(2).project(np.array([[1.0, 0, 0], [1, 1, 0], [0, 1, 0], [-1, 1, 0], [-1, 0, 0]]))


def planes(normals, rng):
    """Any orthonormal bases of the planes with these normals."""
    bases = np.linalg.svd(normals[:, None])[2][:, 1:].swapaxes(1, 2)
    return bases @ ss.Orthogonal(2).random_point(rng, len(normals))


@pytest.mark.parametrize("name", ["rp:2", "gr:1,3", "gr:2,3"])
@pytest.mark.parametrize("points, crossings", [(HALF_SPHERE, 3), (HALF_SPHERE[::-1], 3), (RIM, 0)])
def test_no_line_jumps_across_the_half_sphere(name, points, crossings):
    rng = np.random.default_rng(13)
    signs = rng.choice([-1, 1], (len(points), 1))
    made = {
        "rp:2": points * signs,
        "gr:1,3": (points * signs)[:, :, None],
        "gr:2,3": planes(points, rng),
    }
    spline = ss.CubicSpline(None, made[name], name)
    axes = rendered(spline.plot()).axes[0]
    (far, near), (dots, _) = [line for line in lines_of(axes) if len(line) > 1000], dots_of(axes)
    line = np.where(np.isnan(near), far, near)
    broken = np.isnan(line[:, 0])
    assert broken.sum() == crossings
    assert np.nanmax(np.linalg.norm(np.diff(line, axis=0), axis=1)) < 0.05
    # At a break the line goes on at the opposite point.
    (gaps,) = np.nonzero(broken)
    np.testing.assert_allclose(line[gaps - 1], -line[gaps + 1], atol=1e-12)
    for dot in dots:
        assert np.nanmin(np.linalg.norm(line - dot, axis=1)) < 1e-12


def test_half_sphere_is_the_upper_one():
    line = dome.broken(dome.lifted(ss.CubicSpline(None, HALF_SPHERE, "sphere:2")(np.linspace(0, 5, 2001))))
    np.testing.assert_allclose(np.linalg.norm(line[~np.isnan(line[:, 0])], axis=1), 1)
    assert np.nanmin(line) >= -1 and np.nanmin(line[:, 2]) >= 0


def test_small_curve_on_the_half_sphere_is_enlarged():
    """Also across the rim, where nothing is broken."""
    points = ss.Sphere(2).project(np.array([[1, 0, 0.02], [1, 0.03, -0.01], [1, 0.04, -0.05]]))
    axes = rendered(ss.CubicSpline(None, [[1], [-1], [1]] * points, "rp:2").plot()).axes[0]
    assert np.ptp(axes.get_xlim()) < 0.2
    (line,) = [line for line in lines_of(axes) if len(line) > 1000 and np.isfinite(line).all()]
    assert np.linalg.norm(np.diff(line, axis=0), axis=1).max() < 0.01


@pytest.mark.parametrize("name", ["rp:4", "cp:2", "gr:2,5", "gr:4,5", "cgr:2,3", "cgr:2,5"])
def test_principal_angles(name):
    """Distance is √(Σ θᵢ²), and the bases do not matter."""
    space, rng = ss.space(name), np.random.default_rng(14)
    spline = spline_on(name)
    axes = axes_named(rendered(spline.plot()), "principal angles to")
    lines = [line for line in lines_of(axes) if len(line) > 1000]
    n, k = np.reshape(spline.points[0], (space.point_shape[0], -1)).shape
    assert len(lines) == min(k, n - k)
    distance = space.distance(spline.points[0], spline(lines[0][:, 0]))
    norm = np.linalg.norm([np.radians(line[:, 1]) for line in lines], axis=0)
    np.testing.assert_allclose(norm, distance, atol=1e-12)
    p = space.random_point(rng, 5)
    turn = ss.Orthogonal(k) if k > 1 and not np.iscomplexobj(p) else ss.Unitary(k)
    turned = p.reshape(5, n, k) @ turn.random_point(rng, 5)
    np.testing.assert_allclose(subspaces.principal_angles(turned), subspaces.principal_angles(p), atol=1e-12)


def test_outlines_of_positive_definite_matrices():
    matrices = ss.SymmetricPositiveDefinite(2).random_point(np.random.default_rng(15), 20)
    rings = ellipses.outlines(matrices)
    np.testing.assert_allclose(np.einsum("mai,mij,maj->ma", rings, np.linalg.inv(matrices), rings), 1)
    radii = np.linalg.norm(rings, axis=-1)
    roots = np.sqrt(np.linalg.eigvalsh(matrices))
    np.testing.assert_allclose(np.stack([radii.min(axis=1), radii.max(axis=1)], axis=1), roots, rtol=1e-2)


def test_sections_lie_in_the_outline_of_an_ellipsoid():
    """The shadow of xᵀA⁻¹x ≤ 1 is the ellipse of a block of A."""
    matrices = ss.SymmetricPositiveDefinite(3).random_point(np.random.default_rng(16), 20)
    halves = ellipses.sections(matrices)
    inside = np.einsum("mnai,mij,mnaj->mna", halves, np.linalg.inv(matrices[:, :2, :2]), halves)
    assert np.nanmax(inside) <= 1 + 1e-12 and np.nanmax(inside) > 0.99
    # Two of the halves go through the near end of a half axis, none through the far end.
    values, vectors = np.linalg.eigh(matrices)
    ends = np.sqrt(values)[:, None] * vectors * np.where(vectors[:, 2:] > 0, 1, -1)
    for sign, number in ((1, 2), (-1, 0)):
        gaps = halves[:, :, :, None] - sign * ends.swapaxes(1, 2)[:, None, None, :, :2]
        met = (np.linalg.norm(gaps, axis=-1) < 1e-12).any(axis=2)
        assert (met.sum(axis=1) == number).all()


@pytest.mark.parametrize("name", ["spd:2", "spd:3"])
def test_ellipses_are_drawn_to_scale(name):
    spline = spline_on(name, (4,), [0, 1, 2.5, 4])
    figure = rendered(spline.plot())
    axes = figure.axes[0]
    faint, bold = (found for found in axes.collections if isinstance(found, PolyCollection))
    np.testing.assert_allclose(bold.get_offsets(), np.stack([spline.t, [0] * 4], axis=1))
    assert len(faint.get_offsets()) > 4 and bold.get_linewidth()[0] > faint.get_linewidth()[0]
    assert bold.get_facecolor()[0, 3] > 0 == faint.get_facecolor()[0, 3]
    view = np.eye(2) if name == "spd:2" else frames.VIEW[:2]
    roots = np.sqrt(np.linalg.eigvalsh(view @ spline.points @ view.T))
    # The bar says how long a number is.
    (bar,) = [line for line in axes.lines if line.get_marker() == "|"]
    (number,) = [float(text.get_text()) for text in axes.texts if text.get_text().replace(".", "").isdigit()]
    unit = np.ptp(axes.transAxes.transform(bar.get_xydata())[:, 0]) / number
    scale = bold.get_transform().get_matrix()[:2, :2]
    radii = np.linalg.norm([path.vertices @ scale for path in bold.get_paths()], axis=-1)
    found = np.stack([radii.min(axis=1), radii.max(axis=1)], axis=1)
    np.testing.assert_allclose(found, unit * roots, rtol=1e-2)


def test_bodies_of_the_plane_point_along_their_first_axis():
    spline = spline_on("se:2", (5,))
    figure = rendered(spline.plot())
    between, given, first = figure.axes[0].collections
    paths = [path.vertices for path in (*first.get_paths(), *given.get_paths())]
    assert len(between.get_paths()) > 5 and len(paths) == 5
    for path, pose in zip(paths, spline.points, strict=True):
        tip = (path[0] - pose[:2, 2]) / np.linalg.norm(path[0] - pose[:2, 2])
        np.testing.assert_allclose(tip, pose[:2, 0])
        left = path[1] - path[3]
        assert left @ pose[:2, 1] == pytest.approx(np.linalg.norm(left))


def test_frames_stand_on_the_path():
    spline = spline_on("se:3", (5,))
    axes = rendered(spline.plot()).axes[0]
    sticks = [np.stack(line.get_data_3d(), axis=1) for line in axes.lines if line.get_linewidth() == 2.0]
    length = np.linalg.norm(sticks[0][1] - sticks[0][0])
    for i, (stick, color) in enumerate(zip(sticks, frames.AXES, strict=True)):
        ends = stick.reshape(5, 3, 3)
        np.testing.assert_allclose(ends[:, 0], spline.points[:, :3, 3])
        np.testing.assert_allclose(ends[:, 1] - ends[:, 0], length * spline.points[:, :3, i])
        assert color in [line.get_color() for line in axes.lines if line.get_linewidth() == 2.0]


def test_lengths_of_rigid_motions_are_those_in_the_body():
    labels = {axes.get_ylabel() for axes in spline_on("se:3").plot().axes}
    assert {"speed\n|(ω, v)|", "acceleration\n|(ω′, v′)|"} <= labels


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
        [*components.component_names((12,), False), "4 others"]
    )


def test_imaginary_parts_are_dashed():
    spline = spline_on("u:2")
    axes = axes_named(spline.plot(), "components")
    lines = [line for line in axes.lines if len(line.get_xdata()) > 1000]
    assert [line.get_linestyle() for line in lines] == ["-", "--"] * 4
    assert [line.get_color() for line in lines[::2]] == [line.get_color() for line in lines[1::2]]
    entries = spline(lines[0].get_xdata()).reshape(-1, 4)
    for i in range(4):
        drawn = lines[2 * i].get_ydata() + 1j * lines[2 * i + 1].get_ydata()
        np.testing.assert_allclose(drawn, entries[:, i], atol=1e-12)


@pytest.mark.parametrize(
    "name, words",
    [
        ("spd:1", "x₁₁"),
        ("spd:4", "x₁₁ x₁₂ x₁₃ x₁₄ x₂₂ x₂₃ x₂₄ x₃₃ x₃₄ x₄₄"),
        ("hpd:1", "Re_x₁₁"),
        ("hpd:2", "Re_x₁₁ Re_x₁₂ Im_x₁₂ Re_x₂₂"),
    ],
)
def test_components_that_follow_from_others_are_left_out(name, words):
    figure = spline_on(name).plot()
    (legend,) = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    assert {text.get_text().replace(" ", "_") for text in legend.texts} == set(words.split())


def test_legend_of_a_large_matrix_is_short():
    figure = rendered(spline_on("u:5", (2, 4)).plot())
    (legend,) = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    words = [text.get_text() for text in legend.texts]
    assert len(words) == 13 and "38 others" in words


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

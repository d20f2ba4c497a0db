"""The pictures of spaces: maps, spheres, disks, frames, ellipses and components."""

import numpy as np
import pytest
from drawn import axes_named, dots_of, lines_of, rendered, role

import symspline as ss
from symspline import geo
from symspline.geo import from_lonlat

MERIDIAN = np.array([[1.0, 0, 0], [1, 0, 1], [0, 0, 1], [-1, 0, 2], [-1, 0, 0]])
ROUND = from_lonlat([0, 120, 240, 360], [10, 20, 30, 10])
NEAR_POLE = from_lonlat([20, 25, -150, -140], [40, 80, 85, 30])


@pytest.mark.parametrize("points", [MERIDIAN, ROUND, NEAR_POLE])
def test_no_line_jumps_across_the_map(points):
    spline = ss.CubicSpline(None, ss.Sphere(2).project(points), "sphere:2")
    # Maps with land are not centred on the curve.
    line = lines_of(axes_named(rendered(geo.plot(spline)), "map"))[0]
    steps = np.abs(np.diff(line, axis=0))
    assert np.isnan(line).any()
    assert np.nanmax(steps[:, 0]) < 60 and np.nanmax(steps[:, 1]) < 5
    assert np.nanmax(np.abs(line), axis=0) == pytest.approx([180, 90], abs=90)


TURN = 1.3 * np.arange(12)
DIRECTION = np.stack([np.cos(TURN), np.sin(TURN)], axis=-1)
TURNED = np.stack([DIRECTION, DIRECTION[:, ::-1] * [-1, 1]], axis=-1)
SIGNS = np.random.default_rng(9).choice([-1, 1], (12, 1))


def test_angle_does_not_jump():
    for name, points in [
        ("sphere:1", DIRECTION),
        ("so:2", TURNED),
        ("o:2", TURNED * [1, -1]),
        ("u:1", np.exp(1j * TURN)[:, None, None]),
        ("rp:1", DIRECTION * SIGNS),
        ("gr:1,2", (DIRECTION * SIGNS)[:, :, None]),
    ]:
        spline = ss.CubicSpline(None, points, name)
        line = lines_of(axes_named(spline.plot(), "angle, degrees"))[0]
        np.testing.assert_allclose(line[-1, 1] - line[0, 1], np.degrees(TURN[-1]))
        assert np.abs(np.diff(line[:, 1])).max() < 5
        assert (line[0, 1] - np.degrees(TURN[0])) % 180 == pytest.approx(0, abs=1e-9)


def test_poincare_disk():
    """Distances from the centre are those of the hyperbolic plane."""
    plane, origin = ss.Hyperbolic(2), np.array([1.0, 0, 0])
    points = plane.random_point(np.random.default_rng(7), 20)
    axes = ss.CubicSpline(None, np.concatenate([points, [origin]]), plane, on_failure="ignore").plot().axes[0]
    (places,) = [line.get_xydata() for line in axes.lines if role(line) == "given points"]
    np.testing.assert_allclose(np.linalg.norm(places[:-1], axis=-1), np.tanh(plane.distance(origin, points) / 2))


def bloch_vectors(states):
    """The expected values of the Pauli matrices."""
    a, b = states.T
    return np.stack([2 * (a.conj() * b).real, 2 * (a.conj() * b).imag, np.abs(a) ** 2 - np.abs(b) ** 2], axis=-1)


@pytest.mark.parametrize("size, zoomed", [(0.3, False), (0.03, True)])
def test_states_are_drawn_on_the_bloch_sphere(size, zoomed):
    """The dots are a right-angled projection of the Bloch vectors, as the labels are, seen as in textbooks."""
    space, rng = ss.ComplexProjective(1), np.random.default_rng(12)
    middle = space.random_point(rng)
    points = space.exp(middle, size * space.random_tangent(rng, np.stack([middle] * 8)))
    figure = rendered(ss.CubicSpline(None, points, "cp:1").plot())
    axes, vectors = figure.axes[0], bloch_vectors(points)
    places, first = dots_of(axes)
    view = np.linalg.lstsq(vectors, places)[0]
    np.testing.assert_allclose(vectors @ view, places, atol=1e-9)
    np.testing.assert_allclose(view.T @ view, np.eye(2), atol=1e-9)
    np.testing.assert_array_equal(first, places[:1])
    labels = {text.get_text(): text.get_position() for text in axes.texts if len(text.get_text()) < 4}
    assert not labels if zoomed else labels.keys() == {"|0⟩", "|1⟩", "x", "y"}
    for label, direction in {"|0⟩": 2, "x": 0, "y": 1}.items() if labels else ():
        # Beside the tip of its axis if the curve is there.
        aside = np.linalg.norm(labels[label] - view[direction])
        assert np.allclose(labels[label], 1.17 * view[direction]) or aside == pytest.approx(0.17)
    if not zoomed:
        # The axis x points to the left and downwards, y to the right, and |0⟩ upwards.
        expected = [[-0.5, -0.3], [0.87, -0.17], [0, 0.94]]
        np.testing.assert_allclose(view, expected, atol=0.01)
    assert not labels or labels["|0⟩"][1] > 1 > -1 > labels["|1⟩"][1]


# Farther than half around, and along a great circle.
HALF_SPHERE = ss.Sphere(2).project(
    np.array([[1.0, 0, 1], [1, 0.5, 0.2], [0.5, 1, -0.3], [-0.5, 1, -0.2], [-1, 0, 0.3], [-1, -1, -0.4]])
)


RIM = ss.Sphere(2).project(np.array([[1.0, 0, 0], [1, 1, 0], [0, 1, 0], [-1, 1, 0], [-1, 0, 0]]))


def planes(normals, rng):
    """Any orthonormal bases of the planes with these normals."""
    bases = np.linalg.svd(normals[:, None])[2][:, 1:].swapaxes(1, 2)
    return bases @ ss.Orthogonal(2).random_point(rng, len(normals))


@pytest.mark.parametrize(
    "name, points, crosses",
    [
        ("rp:2", HALF_SPHERE, True),
        ("gr:1,3", RIM, False),
        ("gr:2,3", HALF_SPHERE, True),
        ("rp:2", HALF_SPHERE[:4], False),
    ],
)
def test_no_line_jumps_across_the_half_sphere(name, points, crosses):
    """The half sphere is that around the curve, which leaves it only if it is too long."""
    rng = np.random.default_rng(13)
    signs = rng.choice([-1, 1], (len(points), 1))
    made = {"rp:2": points * signs, "gr:1,3": (points * signs)[:, :, None], "gr:2,3": planes(points, rng)}
    spline = ss.CubicSpline(None, made[name], name)
    axes = rendered(spline.plot()).axes[0]
    (line,) = [line for line in lines_of(axes) if len(line) > 1000]
    dots, _ = dots_of(axes)
    broken = np.isnan(line[:, 0])
    assert (broken.sum() > 0) == crosses
    assert np.nanmax(np.linalg.norm(np.diff(line, axis=0), axis=1)) < 0.05
    # At a break the line goes on at the opposite point.
    (gaps,) = np.nonzero(broken)
    np.testing.assert_allclose(line[gaps - 1], -line[gaps + 1], atol=1e-12)
    for dot in dots:
        assert np.nanmin(np.linalg.norm(line - dot, axis=1)) < 1e-12

"""The pictures of matrices: frames, subspaces, ellipses, poses and components."""

import numpy as np
import pytest
from drawn import axes_named, lines_of, rendered, role, spline_on, texts_of
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import symspline as ss

# Directions to the right and up, as the view explains them.
VIEW = np.array([[-0.5, 0.866, 0.0], [-0.296, -0.171, 0.940]])


@pytest.mark.parametrize("name", ["rp:4", "gr:2,5", "cgr:2,3"])
def test_principal_angles(name):
    """Distance is √(Σ θᵢ²), and the bases do not matter."""
    space = ss.space(name)

    def angles(spline):
        axes = axes_named(rendered(spline.plot()), "principal angles to")
        return np.array([line for line in lines_of(axes) if len(line) > 1000])

    spline = spline_on(name)
    lines = angles(spline)
    n, k = np.reshape(spline.points[0], (space.point_shape[0], -1)).shape
    assert len(lines) == min(k, n - k)
    distance = space.distance(spline.points[0], spline(lines[0, :, 0]))
    np.testing.assert_allclose(np.linalg.norm(np.radians(lines[..., 1]), axis=0), distance, atol=1e-12)
    bases = np.linalg.qr(np.random.default_rng(14).standard_normal((6, k, k)).astype(spline.points.dtype))[0]
    turned = np.reshape(spline.points.reshape(6, n, k) @ bases, spline.points.shape)
    np.testing.assert_allclose(angles(ss.CubicSpline(None, space.project(turned), space)), lines, atol=1e-9)


@pytest.mark.parametrize("name", ["spd:2", "spd:3"])
def test_ellipses_are_drawn_to_scale(name):
    spline = spline_on(name, (4,), [0, 1, 2.5, 4])
    figure = rendered(spline.plot())
    axes = figure.axes[0]
    bold, faint = (found for found in axes.collections if type(found) is PolyCollection)
    np.testing.assert_allclose(bold.get_offsets(), np.stack([spline.t, [0] * 4], axis=1))
    assert len(faint.get_offsets()) > 4 and bold.get_linewidth()[0] > faint.get_linewidth()[0]
    assert bold.get_facecolor()[0, 3] > 0 == faint.get_facecolor()[0, 3]
    times, rows = faint.get_offsets().T
    np.testing.assert_allclose(times, np.linspace(0, 4, len(times)), atol=4 / 1000)
    assert set(rows) == {-1}
    view = np.eye(2) if name == "spd:2" else VIEW
    roots = np.sqrt(np.linalg.eigvalsh(view @ spline.points @ view.T))
    # The bar shows the length of a number.
    (words,) = (text for text in texts_of(figure) if "bar: " in text)
    number = float(words.split("bar: ")[1].split(";")[0])
    bar = next(own for own in axes.collections if isinstance(own, LineCollection) and len(own.get_segments()) == 3)
    unit = np.ptp(bar.get_segments()[0][:, 0]) / number
    radii = np.linalg.norm([path.vertices for path in bold.get_paths()], axis=-1)
    found = np.stack([radii.min(axis=1), radii.max(axis=1)], axis=1)
    np.testing.assert_allclose(found, unit * roots, rtol=1e-2)


@pytest.mark.parametrize(("name", "size"), [("so:3", 1e-7), ("sphere:3", 0.02), ("su:2", 0.02)])
def test_small_rotations_are_graphs(name, size):
    """Frames would look equal. The graphs, one per axis of space, begin at zero."""
    rng = np.random.default_rng(5)
    vectors = np.cumsum(size * rng.normal(size=(7, 3)), axis=0)
    first = Rotation.from_rotvec([0.4, -1.0, 0.2])
    rotations = Rotation.from_rotvec(vectors) * first
    x, y, z, w = rotations.as_quat().T
    points = {
        "so:3": rotations.as_matrix(),
        "sphere:3": np.stack([w, x, y, z], axis=-1),
        "su:2": np.moveaxis(np.array([[w - 1j * z, -y - 1j * x], [y - 1j * x, w + 1j * z]]), -1, 0),
    }[name]
    spline = ss.CubicSpline(None, points, name)
    figure = rendered(spline.plot())
    assert [axes.get_ylabel() for axes in figure.axes[:3]] == [f"about x{i}" for i in "₁₂₃"]
    assert "first axis" not in texts_of(figure)
    expected = (rotations * rotations[0].inv()).as_rotvec()
    dots = [line.get_ydata() for axes in figure.axes[:3] for line in axes.lines if role(line) == "given points"]
    np.testing.assert_allclose(np.transpose(dots), expected, rtol=1e-6, atol=1e-9)
    # One set of axes has all of them.
    axes = spline.plot(ax=Figure().add_subplot())
    assert axes.get_ylabel() == "rotation vector log(R R₀ᵀ) in rad, R₀: start of the curve"
    dots = [line.get_ydata() for line in axes.lines if role(line) == "given points"]
    np.testing.assert_allclose(np.transpose(dots), expected, rtol=1e-6, atol=1e-9)
    moving = spline.animate(frames=2)
    moving._draw_was_started = True
    moving._func(0.5)


@pytest.mark.slow
def test_covariances_are_standard_deviations_and_correlations():
    spline = spline_on("spd:4", (5,))
    figure = rendered(spline.plot())
    upper, lower = axes_named(figure, "standard"), axes_named(figure, "correlations")
    assert [text.get_text() for text in upper.get_legend().texts] == ["σ₁", "σ₂", "σ₃", "σ₄"]
    assert [text.get_text() for text in lower.get_yticklabels()] == ["ρ₁₂", "ρ₁₃", "ρ₁₄", "ρ₂₃", "ρ₂₄", "ρ₃₄"]
    line = lines_of(upper)[2]
    matrices = spline(line[:, 0])
    np.testing.assert_allclose(line[:, 1], np.sqrt(matrices[:, 2, 2]), atol=1e-12)
    rows = [own for own in lower.collections if hasattr(own, "get_coordinates")]
    assert len(rows) == 6 and lower.get_ylim() == (6, 0)
    for k, (row, (i, j)) in enumerate(zip(rows, [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)], strict=True)):
        expected = matrices[:, i, j] / np.sqrt(matrices[:, i, i] * matrices[:, j, j])
        np.testing.assert_allclose(np.reshape(row.get_array(), (2, -1)), [expected, expected], atol=1e-12)
        at = row.get_coordinates()
        np.testing.assert_allclose(at[0, :, 0], line[:, 0])
        assert k < at[..., 1].min() < at[..., 1].max() < k + 1
    # Many correlations have fewer names.
    many = axes_named(rendered(spline_on("spd:9", (4,)).plot()), "correlations")
    assert len(many.get_yticklabels()) == 12
    assert len([own for own in many.collections if hasattr(own, "get_coordinates")]) == 36


def test_columns_of_frames_have_a_panel_each():
    spline = spline_on("stiefel:2,4")
    figure = rendered(spline.plot())
    panels = [axes_named(figure, f"column {j}") for j in (1, 2)]
    assert panels[0].get_ylim() == panels[1].get_ylim()
    for j, axes in enumerate(panels):
        lines = [line for line in axes.lines if len(line.get_xdata()) > 1000]
        drawn = np.stack([line.get_ydata() for line in lines], axis=1)
        np.testing.assert_allclose(drawn, spline(lines[0].get_xdata())[:, :, j], atol=1e-12)
        dots = np.stack([line.get_ydata() for line in axes.lines if line.get_marker() == "o"], axis=1)
        np.testing.assert_allclose(dots, spline.points[:, :, j], atol=1e-12)
    assert [text.get_text() for text in panels[0].get_legend().texts] == ["x₁", "x₂", "x₃", "x₄"]
    assert axes_named(spline_on("stiefel:5,7").plot(), "components")

"""The pictures of matrices: frames, subspaces, ellipses, poses and components."""

import numpy as np
import pytest
from drawn import axes_named, lines_of, rendered, spline_on
from matplotlib.collections import PolyCollection

import symspline as ss
from symspline._plotting import ellipses, frames, graphs


def test_quaternions_as_rotations():
    half = np.sqrt(0.5)
    about_z = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    np.testing.assert_allclose(frames.rotations(np.array([half, 0, 0, half])), about_z, atol=1e-15)
    q = ss.Sphere(3).random_point(np.random.default_rng(6), 20)
    matrices = frames.rotations(q)
    np.testing.assert_allclose(matrices @ matrices.swapaxes(1, 2), np.broadcast_to(np.eye(3), (20, 3, 3)), atol=1e-14)
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
    np.testing.assert_allclose(graphs.principal_angles(turned, turned[0]), graphs.principal_angles(p, p[0]), atol=1e-12)


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
    # The bar shows the length of a number.
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
    assert graphs.component_names((3,), False) == ["x₁", "x₂", "x₃"]
    assert graphs.component_names((2, 2), False) == ["x₁₁", "x₁₂", "x₂₁", "x₂₂"]
    assert graphs.component_names((2,), True) == ["Re x₁", "Im x₁", "Re x₂", "Im x₂"]
    assert graphs.component_names((10, 1), False)[-1] == "x₁₀,₁"
    numbers = graphs.components(np.array([[1 + 2j, 3 + 4j], [5, 6j]]))
    np.testing.assert_array_equal(numbers, [[1, 2, 3, 4], [5, 0, 0, 6]])
    figure = spline_on("sphere:15").plot()
    (legend,) = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    assert sorted(text.get_text() for text in legend.texts) == sorted(
        [*graphs.component_names((12,), False), "4 others"]
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

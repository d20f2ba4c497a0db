"""The pictures of matrices: frames, subspaces, ellipses, poses and components."""

import numpy as np
import pytest
from drawn import axes_named, lines_of, rendered, spline_on
from matplotlib.collections import PolyCollection

import symspline as ss
from symspline._plotting import matrices as pictures
from symspline._plotting.matrices import AXES, VIEW

PAULI = np.array([[[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]]])
ROTATIONS = {
    "sphere:3": lambda q: ss.convert.quaternion_to_matrix(q, scalar_first=True),
    "so:3": np.array,
    "o:3": np.array,
    # U (v·σ) U* = (Rv)·σ
    "su:2": lambda u: np.einsum("iab,mbc,jcd,mad->mij", PAULI, u, PAULI, u.conj()).real / 2,
}


@pytest.mark.parametrize("name", ROTATIONS)
def test_given_frames_are_bold(name):
    spline = spline_on(name, (4,), [0, 1, 2.5, 4])
    faint, bold = (q for q in spline.plot().axes[0].collections if hasattr(q, "U"))
    np.testing.assert_allclose(np.unique(bold.X), spline.t)
    assert bold.width > faint.width and len(faint.X) > len(bold.X)
    right_up = np.sort(np.hypot(bold.U, bold.V).reshape(4, 3))
    np.testing.assert_allclose(VIEW @ VIEW.T, np.eye(3), atol=1e-3)
    lengths = np.linalg.norm((VIEW @ ROTATIONS[name](spline.points))[:, :2], axis=1)
    np.testing.assert_allclose(right_up, 0.7 * np.sort(lengths), atol=1e-12)


@pytest.mark.parametrize("name", ["rp:4", "cp:2", "gr:2,5", "gr:4,5", "cgr:2,3", "cgr:2,5"])
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


def test_sections_lie_in_the_outline_of_an_ellipsoid():
    """The shadow of xᵀA⁻¹x ≤ 1 is the ellipse of a block of A."""
    matrices = ss.SymmetricPositiveDefinite(3).random_point(np.random.default_rng(16), 20)
    halves = pictures.sections(matrices)
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
    view = np.eye(2) if name == "spd:2" else VIEW[:2]
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
    for i, (stick, color) in enumerate(zip(sticks, AXES, strict=True)):
        ends = stick.reshape(5, 3, 3)
        np.testing.assert_allclose(ends[:, 0], spline.points[:, :3, 3])
        np.testing.assert_allclose(ends[:, 1] - ends[:, 0], length * spline.points[:, :3, i])
        assert color in [line.get_color() for line in axes.lines if line.get_linewidth() == 2.0]


def test_lengths_of_rigid_motions_are_those_in_the_body():
    labels = {axes.get_ylabel() for axes in spline_on("se:3").plot().axes}
    assert {"speed\n|(ω, v)|", "acceleration\n|(ω′, v′)|"} <= labels


def test_names_of_components():
    for name, words in [
        ("euclidean:5", "x₁ x₂ x₃ x₄ x₅"),
        ("sphere:15", "x₁ x₂ x₃ x₄ x₅ x₆ x₇ x₈ x₉ x₁₀ x₁₁ x₁₂ 4_others"),
        ("u:5", " ".join(f"{part}_x₁{i}" for i in "₁₂₃₄₅" for part in ("Re", "Im")) + " Re_x₂₁ Im_x₂₁ 38_others"),
        ("so:10", "x₁,₁ x₁,₂ x₁,₃ x₁,₄ x₁,₅ x₁,₆ x₁,₇ x₁,₈ x₁,₉ x₁,₁₀ x₂,₁ x₂,₂ 88_others"),
        # Components that follow from others are left out.
        ("spd:1", "x₁₁"),
        ("spd:4", "x₁₁ x₁₂ x₁₃ x₁₄ x₂₂ x₂₃ x₂₄ x₃₃ x₃₄ x₄₄"),
        ("hpd:2", "Re_x₁₁ Re_x₁₂ Im_x₁₂ Re_x₂₂"),
    ]:
        figure = spline_on(name).plot()
        (legend,) = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
        assert {text.get_text().replace(" ", "_") for text in legend.texts} == set(words.split())


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

"""Pictures of estimated curves: points of all measurements, bands, constants and residuals."""

import re

import numpy as np
import pytest
from drawn import axes_named, rendered, role, texts_of

import symspline as ss
from symspline import measure

T, S = np.linspace(0, 10, 30), np.linspace(0, 10, 90)
SO3 = ss.SpecialOrthogonal(3)


def rotation(t):
    return ss.rotations.from_rotation_vectors(np.sin(0.5 * np.multiply.outer(t, [1.0, 0.8, 0.6])))


def path(t, nu=0):
    return np.stack([np.sin(0.5 * t + nu * np.pi / 2), np.cos(0.4 * t + nu * np.pi / 2)], axis=-1) * [0.5**nu, 0.4**nu]


def noise(*shape, seed=0):
    return np.random.default_rng(seed).standard_normal(shape)


def noisy_rotations(t, seed=0):
    return SO3.exp(rotation(t), 0.03 * SO3.random_tangent(np.random.default_rng(seed), rotation(t)))


def rates(t, outlier=0.0):
    truth = ss.CubicSpline(np.linspace(0, 10, 200), rotation(np.linspace(0, 10, 200)), SO3, bc_type="not-a-knot")
    omega = ss.rotations.angular_velocity(truth, t) + 0.02 * noise(len(t), 3)
    omega[10, 1] += outlier
    return measure.BodyRates(t, omega, sigma=0.02, bias=measure.Constant(3))


def attitudes(outlier=0.0, **options):
    given = [measure.Points(T, noisy_rotations(T), sigma=0.03), rates(S, outlier)]
    return ss.estimate(given, 20, "so:3", penalty="jerk", **options)


def attitudes_of(rotation):
    """A curve of rotations and of their rates."""
    turns = rotation(T)
    given = measure.Points(T, SO3.exp(turns, 0.03 * SO3.random_tangent(np.random.default_rng(4), turns)), sigma=0.03)
    slow = measure.BodyRates(S, np.tile([0.3, 0.6, 0.3], (len(S), 1)) + 0.02 * noise(len(S), 3), sigma=0.02)
    return ss.estimate([given, slow], 20, "so:3")


def dots(axes):
    found = [line.get_xydata() for line in axes.lines if line.get_marker() == "o"]
    return np.concatenate(found)


def test_residuals_and_band_of_rotations():
    curve = attitudes()
    figure = rendered(curve.plot())
    assert "30 Points, 90 BodyRates, 20 knots" in " ".join(texts_of(figure))
    panel = axes_named(figure, "BodyRates")
    assert panel.get_ylabel() == "BodyRates\nresidual / σ"
    assert {"residual in x", "residual in y", "residual in z"} <= set(texts_of(figure))
    # Points have residuals, too, and the constant is in the heading.
    attitude = axes_named(figure, "Points")
    np.testing.assert_allclose(dots(attitude)[:, 1], curve.residuals[0].T.ravel())
    bias = curve.parameters["gyro bias"]
    (words,) = [text for text in texts_of(figure) if "gyro bias" in text]
    shown = re.search(r"gyro bias \((.*), (.*), (.*)\) ± ([\d.]+)", words.replace("\n", " "))
    np.testing.assert_allclose([float(x) for x in shown.groups()[:3]], bias.value, atol=0.2 * bias.std.max())
    assert float(shown[4]) == pytest.approx(bias.std.max(), rel=0.06)
    residuals = curve.residuals[1]
    np.testing.assert_allclose(dots(panel), np.column_stack([np.tile(S, 3), residuals.T.ravel()]))
    share = 100 * np.mean(np.abs(residuals) > 1.96)
    assert f"{share:.1f} % beyond ±1.96 (5 % expected)" in texts_of(figure)
    # Graphs of rotation vectors show the band, and frames along the time axis do not.
    assert not any("95 %" in axes.get_ylabel() for axes in figure.axes)
    far = attitudes_of(lambda t: ss.rotations.from_rotation_vectors(np.multiply.outer(t, [0.3, 0.6, 0.3])))
    band = axes_named(rendered(far.plot()), "95 % band")
    assert band.get_ylabel() == "95 % band\nof so:3, rad"
    x, y = band.lines[0].get_data()
    np.testing.assert_allclose(y, far.band(x))
    assert [own.get_label() for own in axes_named(figure, "speed").collections if role(own) == "95 % band"]


@pytest.mark.filterwarnings("ignore:The residuals:symspline.SmoothingWarning")
def test_points_of_several_sensors_are_drawn():
    """Points of weight zero are not."""
    weights = np.where(np.arange(90) % 3, 1.0, 0.0)
    coarse, fine = path(T) + 0.1 * noise(30, 2), path(S) + 0.02 * noise(90, 2, seed=1)
    fine[weights == 0] = np.nan
    given = [
        measure.Points(T[::-1], coarse[::-1], sigma=0.1),
        measure.Points(S, fine, sigma=0.02, weights=weights),
        measure.Velocities(S, path(S), path(S, 1) + 0.1 * noise(90, 2, seed=2), sigma=0.1),
        measure.Function(S, lambda x: np.sum(x**2, axis=1) - np.sum(path(S) ** 2, axis=1), sigma=0.05),
    ]
    curve = ss.estimate(given, 20, "r:2")
    figure = rendered(curve.plot())
    picture = figure.axes[0]
    expected = np.concatenate([coarse, fine[weights > 0]])
    found = dots(picture)
    assert sorted(map(tuple, found)) == sorted(map(tuple, expected))
    assert [own.get_label() for own in picture.get_children() if role(own) == "95 % band"] == [
        "95 % band of curve and speed"
    ]
    labels = [axes.get_ylabel() for axes in figure.axes]
    # The picture of the plane shows the band.
    assert [label.removesuffix("\nresidual / σ") for label in labels if "residual" in label] == [
        *("Points 1", "Points 2", "Velocities", "Function")
    ]
    panel = axes_named(figure, "Points 2")
    np.testing.assert_array_equal(np.unique(dots(panel)[:, 0]), S[weights > 0])
    assert not any("95 %" in label for label in labels)


@pytest.mark.filterwarnings("ignore:The residuals:symspline.SmoothingWarning")
def test_curves_from_files_have_bands_and_no_data(tmp_path):
    attitudes().save(tmp_path / "a.npz")
    figure = rendered(ss.load(tmp_path / "a.npz").plot())
    assert len(dots(figure.axes[0])) == 0 and axes_named(figure, "about x₁").collections
    assert not any("residual" in axes.get_ylabel() for axes in figure.axes)
    plane = ss.estimate(
        [measure.Points(T, path(T), sigma=0.1), measure.Velocities(T, path(T), path(T, 1), sigma=0.1)], 8, "r:2"
    )
    plane.save(tmp_path / "b.npz")
    assert len(dots(rendered(ss.load(tmp_path / "b.npz").plot()).axes[0])) == 0

"""Tangent PCA: principal components in flat space, orthonormal components, curves, and invalid input."""

import numpy as np
import pytest
from cases import REPRESENTATIVE
from refused import raises
from test_means import on_each

import symspline as ss

METRIC = [space for space in REPRESENTATIVE if np.isfinite(space.curvature)]


def arrays(points):
    return points if isinstance(points, tuple) else (points,)


def samples(space, rng, count, axes, size):
    """Samples around a random mean at each index of the axes."""
    centre = space.random_point(rng, axes)
    at = on_each(lambda x: np.broadcast_to(x, (count, *x.shape)), centre)
    return space.exp(at, on_each(lambda x: size * x, space.random_tangent(rng, at)))


def test_flat_components_are_those_of_the_singular_value_decomposition():
    rng = np.random.default_rng(0)
    for axes in ((), (7,)):
        x = rng.standard_normal((12, *axes, 3)) * [1e3, 1.0, 1e-2]
        found = ss.tangent_pca(x, "r:3")
        number = int(np.prod(axes))
        rows = (x - x.mean(axis=0)).reshape(12, -1) / np.sqrt(number)
        _, sizes, v = np.linalg.svd(rows, full_matrices=False)
        count = len(found.explained_variance)
        assert count == min(11, 3 * number)
        np.testing.assert_allclose(found.explained_variance, sizes[:count] ** 2 / 11, rtol=1e-6)
        flat = found.components.reshape(count, -1) / np.sqrt(number)
        np.testing.assert_allclose(np.abs(np.sum(flat * v[:count], axis=1)), 1, atol=1e-6)
        assert found.explained_variance_ratio.sum() == pytest.approx(1)


@pytest.mark.parametrize("space", METRIC, ids=str)
@pytest.mark.parametrize("axes", [(), (4,)])
def test_components_are_orthonormal_and_reconstruct_the_samples(space, axes):
    rng = np.random.default_rng(1)
    for size in (1e-7, 1e-3, 0.1):
        points = samples(space, rng, 6, axes, size)
        found = ss.tangent_pca(points, space)
        count = found.scores.shape[1]
        for i in range(count):
            own = on_each(lambda x, i=i: x[i], found.components)
            products = space.inner(found.mean, own, found.components)
            gram = np.asarray(products).reshape(count, -1).mean(axis=-1)
            np.testing.assert_allclose(gram, np.eye(count)[i], atol=1e-9)
        again = found.reconstruct(found.scores)
        assert np.max(space.distance(again, points)) < 1e-6 * size + 1e-13
        first = found.reconstruct(found.scores[:, :1])
        assert arrays(first)[0].shape == arrays(points)[0].shape
        assert (np.diff(found.explained_variance) <= 1e-12 * found.explained_variance[0]).all()
        total = np.mean(np.asarray(space.distance(on_each(lambda x: x[None], found.mean), points)) ** 2) * 6 / 5
        assert found.explained_variance.sum() == pytest.approx(total, rel=1e-6)


def test_curves_of_one_mode_have_one_component():
    # Great circles at different speeds: the displacement from the mean curve is (speed − mean) t along the equator.
    t, speeds = np.linspace(0, 1, 9), np.array([0.6, 0.9, 1.0, 1.5])
    angle = speeds[:, None] * t
    curves = ss.CubicSpline(t, np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1), "sphere:2")
    times = np.linspace(0, 1, 101)
    found = ss.tangent_pca(curves(times), "sphere:2", n_components=1)
    expected = (speeds - 1) * np.sqrt(np.mean(times**2))
    np.testing.assert_allclose(found.scores[:, 0] * np.sign(found.scores[-1, 0]), expected, atol=1e-9)
    assert found.components.shape == (1, 101, 3) and found.explained_variance_ratio[0] == pytest.approx(1)


def test_equal_samples_have_no_components():
    found = ss.tangent_pca(np.tile([1.0, 0, 0], (5, 1)), "sphere:2")
    assert found.components.shape == (0, 3) and found.scores.shape == (5, 0)
    np.testing.assert_array_equal(found.reconstruct(np.zeros(0)), [1, 0, 0])


def test_large_points_need_no_frames():
    rng = np.random.default_rng(2)
    space = ss.Grassmannian(2, 300)
    found = ss.tangent_pca(samples(space, rng, 4, (), 1e-2), space)
    assert found.components.shape == (3, 300, 2)


def test_invalid_arguments_name_the_argument():
    points = np.eye(3)
    raises("points has the leading axes", ss.tangent_pca, points[0], "sphere:2")
    raises("points has the leading axes", ss.tangent_pca, points[:1], "sphere:2")
    raises("n_components is 5", ss.tangent_pca, points, "sphere:2", n_components=5)
    raises("n_components", ss.tangent_pca, points, "sphere:2", n_components=0)
    raises("no invariant metric", ss.tangent_pca, np.tile(np.eye(4), (3, 1, 1)), "se:3")
    raises("leading axes", ss.tangent_pca, (points, np.zeros((2, 1))), "sphere:2 x r:1")
    found = ss.tangent_pca(points, "sphere:2")
    raises("scores must be finite real numbers", found.reconstruct, np.zeros(3))
    raises("scores must be finite real numbers", found.reconstruct, [np.nan])

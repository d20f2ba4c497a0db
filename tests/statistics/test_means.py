"""Means and medians: conditions of optimality, batches, weights, closed forms, and invalid input."""

import numpy as np
import pytest
from cases import EPS, SINGLE, SPACES
from refused import raises
from scipy.optimize import minimize

import symspline as ss

EXTRA = [ss.space("so:3/432"), ss.Stiefel(2, 4)]
METRIC = [space for space in [*SPACES, *EXTRA] if np.isfinite(space.curvature)]


def on_each(function, *values):
    """Apply a function to arrays, or to the factors of tuples of arrays."""
    if isinstance(values[0], tuple):
        return tuple(function(*each) for each in zip(*values, strict=True))
    return function(*values)


def cloud(space, rng, batch=(), count=9, size=0.3):
    """Random points around a random point for every batch index, at distances of about `size`."""
    centre = space.random_point(rng, batch)
    axis = len(batch)
    at = on_each(lambda x: np.repeat(np.expand_dims(x, axis), count, axis), centre)
    v = space.random_tangent(rng, at)
    root = np.sqrt(space.dim)
    return space.exp(at, on_each(lambda x: size / root * x, v))


def sum_of_logs(space, mean, points, weights, axis):
    logs = space.log(on_each(lambda x: np.expand_dims(x, axis), mean), points)
    return on_each(lambda x: np.tensordot(weights, np.moveaxis(x, axis, 0), 1), logs)


@pytest.mark.parametrize("space", [*SPACES, *EXTRA], ids=str)
def test_the_weighted_logarithms_at_the_mean_add_up_to_zero(space):
    rng = np.random.default_rng(1)
    for size in (1e-9, 1e-6, 1e-3, 0.1, 0.4):
        points = cloud(space, rng, (2,), size=size)
        weights = rng.uniform(0.1, 10, 9)
        mean = space.mean(points, weights)
        total = sum_of_logs(space, mean, points, weights, 1)
        rounding = np.max(space._rounding(mean))
        for own in total if isinstance(total, tuple) else (total,):
            assert np.abs(own).max() < 1e3 * EPS * rounding * (1 + max(np.abs(x).max() for x in _arrays(mean)))


def _arrays(points):
    return points if isinstance(points, tuple) else (points,)


@pytest.mark.parametrize("space", METRIC, ids=str)
def test_no_point_nearby_has_a_smaller_sum_of_distances(space):
    rng = np.random.default_rng(2)
    for size in (1e-6, 0.3):
        points, weights = cloud(space, rng, size=size), rng.uniform(0.1, 2, 9)
        for found, power in ((space.mean(points, weights), 2), (space.median(points, weights), 1)):

            def objective(q, power=power, points=points, weights=weights):
                return np.sum(weights * space.distance(on_each(lambda x: x[None], q), points) ** power)

            least = objective(found)
            for _ in range(10):
                v = space.random_tangent(rng, found)
                aside = space.exp(found, on_each(lambda x, size=size: 1e-3 * size * x, v))
                assert objective(aside) > least * (1 - 1e-9)


@pytest.mark.parametrize("space", ["sphere:2", "gr:2,5", "so:3/222", "sphere:3 x r:2"])
def test_batches_equal_single_calls_bit_for_bit(space):
    space, rng = ss.space(space), np.random.default_rng(3)
    points, weights = cloud(space, rng, (2, 3)), rng.uniform(0.1, 2, (2, 3, 9))
    for method in (space.mean, space.median):
        whole = method(points, weights)
        for index in np.ndindex(2, 3):
            one = method(on_each(lambda x, index=index: x[index], points), weights[index])
            for a, b in zip(_arrays(whole), _arrays(one), strict=True):
                np.testing.assert_array_equal(a[index], b)


def test_flat_means_are_averages():
    rng = np.random.default_rng(4)
    points, weights = 1e6 + rng.standard_normal((4, 50, 3)), rng.uniform(size=50)
    flat = ss.Euclidean(3)
    np.testing.assert_allclose(flat.mean(points, weights), np.average(points, axis=1, weights=weights), rtol=1e-15)
    product = ss.space("r:3 x so:3")
    turns = np.broadcast_to(np.eye(3), (4, 50, 3, 3))
    np.testing.assert_array_equal(product.mean((points, turns), weights)[0], flat.mean(points, weights))


def test_medians_on_a_line_are_weighted_medians():
    rng = np.random.default_rng(5)
    x = rng.standard_normal((30, 11, 1))
    np.testing.assert_allclose(ss.Euclidean(1).median(x), np.median(x, axis=1), atol=1e-12)
    # A point with more than half of the weight is the median.
    assert ss.Euclidean(1).median([[0.0], [1], [7]], weights=[1, 1, 3]) == 7


def test_flat_medians_equal_those_of_another_minimiser():
    rng = np.random.default_rng(6)
    for scale in (1e-6, 1.0, 1e6):
        x = scale * rng.standard_normal((20, 3))
        found = ss.Euclidean(3).median(x)
        other = minimize(lambda m, y=x / scale: np.linalg.norm(m - y, axis=-1).sum(), np.zeros(3), tol=1e-12)
        np.testing.assert_allclose(found / scale, other.x, atol=1e-5)


def test_an_iterate_at_a_datum_moves_on():
    # The first datum is where the iteration starts, and not the median.
    points = np.array([[0.0, 0], [2, 1], [2, -1], [2.5, 0.2]])
    found = ss.Euclidean(2).median(points)
    assert np.linalg.norm(found - points[0]) > 1
    pull = (points - found) / np.linalg.norm(points - found, axis=-1, keepdims=True)
    assert np.linalg.norm(pull.sum(axis=0)) < 1e-9
    # Equal points.
    np.testing.assert_array_equal(ss.Euclidean(2).median(np.ones((5, 2))), [1, 1])


def test_points_of_weight_zero_may_be_nan():
    rng = np.random.default_rng(11)
    space = ss.Sphere(2)
    points = cloud(space, rng, (2,))
    weights = np.ones((2, 9))
    weights[0, 3], weights[1, 0] = 0, 0
    points[weights == 0] = np.nan
    for method in (space.mean, space.median):
        found = method(points, weights)
        np.testing.assert_array_equal(found[0], method(np.delete(points[0], 3, axis=0)))
        np.testing.assert_array_equal(found[1], method(points[1, 1:]))
    single = points.astype(np.float32)
    np.testing.assert_allclose(space.mean(single, weights), space.mean(points, weights), atol=1e-6)


@pytest.mark.parametrize("method", ["mean", "median"])
def test_invalid_arguments_of_means_name_the_argument(method):
    average = getattr(ss.Sphere(2), method)
    points = np.eye(3)
    raises("at least one point", average, points[0])
    raises("at least one point", average, np.zeros((4, 0, 3)))
    raises("off the space", average, 2 * points)
    raises(r"weights has shape \(2,\).*leading axes \(3,\)", average, points, [1, 2])
    raises(r"weights\[1\] is -1", average, points, [1, -1, 2])
    raises(r"weights\[0\] is nan", average, points, [np.nan, 1, 2])
    raises("`weights` are all 0", average, points, [0, 0, 0])
    raises("real numbers", average, points, ["a", "b", "c"])
    with pytest.raises(ss.CutLocusError):
        average([[1.0, 0, 0], [-1, 0, 0]])
    product = getattr(ss.space("sphere:2 x r:1"), method)
    raises(r"leading axes|needs shape", product, (points, np.zeros((2, 1))), None if method == "median" else [1, 1, 1])


def test_medians_need_a_metric():
    for space in SINGLE:
        if np.isnan(space.curvature):
            raises("median needs distances", space.median, space.random_point(np.random.default_rng(0), 3))

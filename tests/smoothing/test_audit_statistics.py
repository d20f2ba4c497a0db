"""Residuals and their statistics in the core, compared with the same in NumPy."""

import numpy as np
import pytest

import symspline as ss
from symspline import _core


@pytest.mark.parametrize(("n", "d"), [(40, 3), (41, 1), (200, 2)])
def test_statistics_equal_those_of_numpy(n, d):
    rng = np.random.default_rng(n)
    rows = rng.standard_normal((2, n, d))
    rows[0, [3, 17]] *= 40
    rows[1, 5] = np.nan
    rows[1, 11, 0] = np.nan
    neighbours = rng.chisquare(d, (2, n - 2))
    neighbours[0, 4] = np.nan
    limits, variances = np.array([6.0, 7.0]), np.array([0.4, 0.5])
    columns, products, sizes = _core.residual_statistics(rows, neighbours, limits, variances)
    for k, own in enumerate(rows):
        squares = np.nansum(own**2, axis=1)[np.isfinite(own).any(axis=1)]
        median = np.median(squares)
        size = np.nan_to_num(np.abs(own)).max(axis=1)
        inner = own[:, :].copy()
        inner[size > limits[k] * np.sqrt(variances[k] * median)] = np.nan
        pairs = inner[1:] * inner[:-1]
        expected = median, np.nanmedian(neighbours[k]), np.nanmean(inner**2), np.nanmean(pairs)
        np.testing.assert_allclose([column[k] for column in columns], expected, rtol=1e-13)
        assert products[k] == np.isfinite(pairs).sum()
        np.testing.assert_array_equal(sizes[k], size)
    assert np.isnan(rows[1]).any() and (sizes[0] > 20).sum() == 2


def test_residuals_of_zero_have_no_limit():
    # Most residuals are zero, so that the median does not show the noise.
    rows = np.zeros((1, 30, 1))
    rows[0, :5] = 1.0
    columns, products, _ = _core.residual_statistics(rows, np.zeros((1, 28)), np.ones(1), np.ones(1))
    assert [column[0] for column in columns] == [0.0, 0.0, pytest.approx(5 / 30), pytest.approx(4 / 29)]
    assert products == [29]


@pytest.mark.parametrize("name", ["r:3", "sphere:2", "so:3", "cp:2", "spd:2", "gr:2,4"])
def test_residuals_and_deviations_from_neighbours(name):
    """Lengths of residuals are distances; deviations are those from geodesics, for noise with these weights."""
    space, rng, n = ss.space(name), np.random.default_rng(3), 20
    t, weights = 100 + np.cumsum(rng.exponential(1, n)), rng.uniform(0.2, 5, n)
    weights[7], t[12] = 0, t[11]
    start = space.random_point(rng)
    points = space.exp(start, 0.3 * space.random_tangent(rng, np.broadcast_to(start, (n, *start.shape))))
    at = space.exp(points, 0.1 * space.random_tangent(rng, points))
    points[3] = np.nan
    x, y = (np.ascontiguousarray(space._as_doubles(own))[None] for own in (at, points))
    rows, deviations = _core.residuals_at(space._handle, t[None], x, y, weights[None])
    used = np.flatnonzero((weights > 0) & (np.arange(n) != 3))
    assert np.isfinite(rows[0]).all(axis=1).nonzero()[0].tolist() == used.tolist()
    np.testing.assert_allclose(
        np.linalg.norm(rows[0, used], axis=1), space.distance(at[used], points[used]), rtol=1e-7, atol=1e-12
    )
    expected = np.full(n, np.nan)
    for a, b, c in zip(used, used[1:], used[2:], strict=False):
        if t[c] > t[a]:
            s = (t[b] - t[a]) / (t[c] - t[a])
            apart = space.distance(space.exp(points[a], s * space.log(points[a], points[c])), points[b])
            expected[b] = apart**2 / (1 / weights[b] + s**2 / weights[c] + (1 - s) ** 2 / weights[a])
    np.testing.assert_allclose(deviations[0], expected, rtol=1e-6, atol=1e-12)

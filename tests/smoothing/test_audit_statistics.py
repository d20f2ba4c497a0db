"""Residuals and their statistics in the core, compared with the same in NumPy."""

import numpy as np
import pytest
from scipy.stats import chi2

import symspline as ss
from symspline import _core


def examined(rows, neighbours, leverages):
    """Examine curves that estimate their noise level, under least squares."""
    curves, n, _ = rows.shape
    # Without a robust loss, points do not matter.
    data = [np.zeros((curves, n)), *np.zeros((2, curves, n, 1)), np.ones((curves, n))]
    sigmas = np.full(curves, np.nan)
    return _core.examine_curves(ss.space("r:1")._handle, data, rows, neighbours, leverages, sigmas, None)


@pytest.mark.parametrize(("n", "d"), [(40, 3), (41, 1), (200, 2)])
def test_statistics_equal_those_of_numpy(n, d):
    rng = np.random.default_rng(n)
    rows = rng.standard_normal((2, n + 2, d))
    rows = rows[:, 2:] + rows[:, 1:-1] + rows[:, :-2]
    rows[0, [3, 17]] *= 40
    rows[1, 5] = np.nan
    rows[1, 11, 0] = np.nan
    neighbours = 0.1 * rng.chisquare(d, (2, n))
    neighbours[0, 4] = np.nan
    leverages = np.array([0.1, 0.2])
    found = examined(rows, neighbours, leverages)
    assert [curve for curve, *_ in found] == [0, 1]
    for k, (_, bypassed, given, (ratio, correlation, outliers, run)) in enumerate(found):
        assert bypassed is given is run is None
        known = np.isfinite(rows[k])
        used = known.any(axis=1)
        median_of_chi = chi2.median(round(known.sum() / used.sum()))
        scale = np.median(np.nansum(rows[k] ** 2, axis=1)[used]) / median_of_chi / (1 - leverages[k])
        noise = np.nanmedian(neighbours[k]) / median_of_chi
        assert ratio == pytest.approx(np.sqrt(scale / noise), rel=1e-12)
        sizes = np.nan_to_num(np.abs(rows[k])).max(axis=1) / np.sqrt(scale)
        limit = max(6, np.sqrt(2 * np.log(known.sum() / 1e-5))) * (1 + 2 / np.sqrt(used.sum()))
        inner = np.where((sizes > limit)[:, None], np.nan, rows[k])
        products = inner[1:] * inner[:-1]
        expected = np.nanmean(products) / np.nanmean(inner**2) + leverages[k]
        significant = abs(expected) > 4.5 / np.sqrt(np.isfinite(products).sum())
        assert correlation == (pytest.approx(expected, rel=1e-12) if significant else 0)
        near = [np.median(np.r_[sizes[max(0, i - 10) : i], sizes[i + 1 : i + 11]]) for i in range(n)]
        far = sizes > limit * np.maximum(near, 1)
        assert outliers[0] == far.sum() and far.any() == (k == 0)
        if far.any():
            assert outliers[1:] == (sizes.argmax(), pytest.approx(sizes.max(), rel=1e-12))


def test_residuals_of_zero_have_no_limit():
    # Most residuals are zero, so that the median does not show the noise.
    rows = np.zeros((1, 30, 1))
    rows[0, :5] = 1.0
    assert examined(rows, np.zeros((1, 30)), np.zeros(1)) == []


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

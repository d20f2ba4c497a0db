"""Stiefel manifolds just inside and just outside of their tolerances."""

import numpy as np
import pytest
from refused import raises

import symspline as ss

SPACE = ss.Stiefel(2, 5)


@pytest.mark.parametrize(("k", "n"), [(2, 4), (2, 5), (3, 7)])
def test_the_injectivity_radius_is_that_of_the_canonical_metric(k, n):
    """√(4/5) π, by Absil and Mataigne (2024)."""
    assert ss.Stiefel(k, n).injectivity_radius == pytest.approx(np.sqrt(4 / 5) * np.pi)


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-7, 1e-5, 1e-4, 1e-2, 0.3])
def test_projections_are_factors_of_the_polar_decomposition(size, rng):
    x = SPACE.random_point(rng, 20) + size * rng.standard_normal((20, 5, 2))
    u, _, v = np.linalg.svd(x, full_matrices=False)
    assert np.abs(SPACE.project(x) - u @ v).max() < 2e-15 + 1e-13 * size


def test_points_off_the_manifold_raise(rng):
    p = SPACE.random_point(rng, 4)
    SPACE.check_point(p * (1 + 3e-9))
    for size in (3e-8, 1e-6, 1e-3):
        raises("off the space", SPACE.check_point, p * (1 + size))

"""The joint choice of λ along several axes, against the criterion on a dense grid of λ in flat space."""

import numpy as np
import pytest

import symspline as ss


def energy_matrix(t):
    """Matrix of ∫ f''² of the natural spline through values at t (Green & Silverman 1994, Section 2.1)."""
    h, n = np.diff(t), len(t)
    q, r = np.zeros((n, n - 2)), np.zeros((n - 2, n - 2))
    for j in range(1, n - 1):
        q[j - 1, j - 1], q[j, j - 1], q[j + 1, j - 1] = 1 / h[j - 1], -1 / h[j - 1] - 1 / h[j], 1 / h[j]
        r[j - 1, j - 1] = (h[j - 1] + h[j]) / 3
        if j < n - 2:
            r[j - 1, j] = r[j, j - 1] = h[j] / 6
    return q @ np.linalg.solve(r, q.T)


def gcv_of(u, v, y):
    """The criterion as a function of both λ: the smoother is a Kronecker product."""
    (a, left), (b, right) = (np.linalg.eigh(energy_matrix(t)) for t in (u, v))
    z = np.einsum("ij...,ik,jl->kl...", y, left, right)
    size = y.shape[0] * y.shape[1]

    def score(lam1, lam2):
        kept = np.outer(1 / (1 + lam1 * np.maximum(a, 0)), 1 / (1 + lam2 * np.maximum(b, 0)))
        left = size - kept.sum()
        return np.log(np.sum(((1 - kept)[..., None] * z) ** 2) / left**2) if left > 0 else np.inf

    return score


def waves(n1, n2, nodes_per_period, noise, seed):
    rng = np.random.default_rng(seed)
    u = 7 + np.sort(np.linspace(0, 3, n1) + 0.2 / n1 * rng.uniform(-1, 1, n1))
    v = np.linspace(-1, 1, n2)
    i, j = np.meshgrid(np.arange(n1), np.arange(n2), indexing="ij")
    f = np.sin(2 * np.pi * i / nodes_per_period) * np.cos(2 * np.pi * j / nodes_per_period)
    return u, v, f[..., None] + noise * rng.standard_normal((n1, n2, 1)), f


@pytest.mark.filterwarnings("ignore:The smoothing along axis:symspline.SmoothingWarning")
@pytest.mark.parametrize(("nodes_per_period", "noise"), [(6, 0.1), (8, 0.3), (20, 0.2)])
def test_the_joint_minimum_is_found(nodes_per_period, noise):
    u, v, y, f = waves(32, 28, nodes_per_period, noise, 1)
    s = ss.make_smoothing_grid((u, v), y, "r:1")
    score = gcv_of(u, v, y)
    powers = 10.0 ** np.arange(-11, 3, 0.25)
    least = min(score(a, b) for a in powers for b in powers)
    assert score(*s.lam) < least + 0.02
    assert np.sqrt(np.mean((s.points[..., 0] - f) ** 2)) < noise


def test_noise_remains_a_plane():
    u, v, y, _ = waves(20, 24, 5, 0.1, 2)
    y = 0.1 * np.random.default_rng(3).standard_normal(y.shape)
    with pytest.warns(ss.SmoothingWarning, match="geodesics"):
        s = ss.make_smoothing_grid((u, v), y, "r:1")
    assert s.df < 8
